/* INT0: sense control ISC, out of idle sleep; its pin with the pull-up on. */
#include "mark.h"

#ifndef ISC
#define ISC 2
#endif

volatile uint8_t undriven, taken, pin, flag;

ISR(INT0_vect) {
    taken++;
    PORTD = 1 << 6 | 1 << 2;
    pin = PIND & 1 << 2;
}

int main(void) {
    DDRD = 1 << 6;
    PORTD = 1 << 2;
    undriven = PIND & 1 << 2;
    MCUCR = 1 << SE | ISC;
    GIFR = 1 << INTF0;
#ifdef MASKED
    /* An edge is kept until its interrupt is enabled, and one that was cleared is not. */
    MARK(1);
    while (!(GIFR & 1 << INTF0)) {}
    flag = GIFR;
    GIFR = 1 << INTF0;
    flag |= GIFR >> 1;
    MARK(2);
    while (!(GIFR & 1 << INTF0)) {}
#endif
    GICR = 1 << INT0;
    sei();
    for (;;) sleep_cpu();
}
