/* Marks on port B, and the end of a program: asleep for good. */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <stdint.h>

#define MARK(n) (PORTB = (n))

__attribute__((noreturn)) static inline void end(void) {
    cli();
    WDTCR = 1 << WDTOE | 1 << WDE;
    WDTCR = 0;
    MCUCR = 1 << SE;
    for (;;) sleep_cpu();
}
