/* Timer 0 in CTC, timer 1 in CTC and in mode 14, flags, a stopped counter, waiting compare values. */
#include "mark.h"
#include "waits.h"

volatile uint8_t tov_in_ctc, cleared, stopped, early, late;

ISR(TIMER0_COMP_vect) { MARK(PORTB + 1); }
ISR(TIMER1_COMPA_vect) { PORTC++; }
ISR(TIMER1_OVF_vect) { PORTC++; }

int main(void) {
    DDRB = DDRC = 0xff;
    MCUCR = 1 << SE;
#if defined(TIMER0)
    OCR0 = 249;
    TCCR0 = 1 << WGM01 | 3;
    TIMSK = 1 << OCIE0;
    sei();
    while (PORTB < 10) sleep_cpu();
#elif defined(TIMER1_CTC)
    OCR1A = 12499;
    TCCR1B = 1 << WGM12 | 3;
    TIMSK = 1 << OCIE1A;
    sei();
    while (PORTC < 10) sleep_cpu();
#elif defined(TIMER1_PWM)
    ICR1 = 799;
    OCR1A = 99;
    TCCR1A = 1 << WGM11;
    TCCR1B = 1 << WGM13 | 1 << WGM12 | 1;
    TIMSK = 1 << TOIE1;
    sei();
    while (PORTC < 10) sleep_cpu();
#else
    /* CTC does not overflow; writing 1 clears; a stopped counter keeps its value. */
    OCR0 = 20;
    TCCR0 = 1 << WGM01 | 1 << CS00;
    for (volatile uint8_t i = 0; i < 50; i++) {}
    tov_in_ctc = TIFR & (1 << TOV0 | 1 << OCF0);
    TCCR0 = 0;
    TIFR = 1 << OCF0;
    cleared = TIFR;
    TCNT0 = 77;
    stopped = TCNT0;
    compare_waits(&early, &late);
#endif
    end();
}
