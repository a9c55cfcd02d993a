/* In PWM a compare value waits for the end of the period: the flag of one that was passed, before that end and after it. Timer 1 has to
 * stand; it runs on. */
#include <avr/io.h>
#include <stdint.h>

static inline void compare_waits(volatile uint8_t *early, volatile uint8_t *late) {
    ICR1 = 1000;
    TCCR1A = 1 << WGM11;
    TCCR1B = 1 << WGM13 | 1 << WGM12 | 1;
    TCNT1 = 100;
    OCR1A = 300;
    TIFR = 0xff;
    while (TCNT1 < 500) {}
    *early = TIFR & 1 << OCF1A;
    while (TCNT1 > 400) {}
    while (TCNT1 < 400) {}
    *late = TIFR & 1 << OCF1A;
}
