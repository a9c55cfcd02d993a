/* Conversions: the first, others, a pin's and the band gap's counts; free running; triggered by timer 1; begun by idle sleep. */
#include "mark.h"

volatile uint16_t counts[8], gap;
volatile uint8_t taken, running;

EMPTY_INTERRUPT(TIMER1_COMPA_vect)

ISR(ADC_vect) {
    MARK(taken + 1);
    if (taken < 8) counts[taken] = ADC;
    taken++;
#ifdef TRIGGERED
    TIFR = 1 << OCF1B;
#endif
}

static inline uint16_t convert(uint8_t mux) {
    ADMUX = mux;
    ADCSRA = 1 << ADEN | 1 << ADSC | PRESCALE;
    MARK(1);
    while (ADCSRA & 1 << ADSC) {}
    MARK(2);
    return ADC;
}

int main(void) {
    DDRB = 0xff;
    MCUCR = 1 << SE;
#if defined(TRIGGERED)
    OCR1A = 12499;
    OCR1B = 400;
    TCCR1B = 1 << WGM12 | 1;
    SFIOR = 1 << ADTS2 | 1 << ADTS0;
    ADCSRA = 1 << ADEN | 1 << ADATE | 1 << ADIE | PRESCALE;
    sei();
    while (taken < 8) {} /* sleep would start conversions of its own */
#elif defined(IDLE)
    convert(7);
    ADMUX = 2;
    OCR1A = 1000; /* cycles: less than a conversion */
    TCCR1B = 1 << WGM12 | 1;
    TIMSK = 1 << OCIE1A;
#ifdef OFF_BEFORE_SLEEP
    ADCSRA = 0;
#endif
    sei();
    sleep_cpu();
    cli();
    running = ADCSRA & 1 << ADSC;
#ifdef OFF_AFTER_SLEEP
    ADCSRA = 0;
#endif
    counts[0] = convert(0);
#elif defined(FREE_RUNNING)
    ADCSRA = 1 << ADEN | 1 << ADATE | 1 << ADSC | 1 << ADIE | PRESCALE;
    sei();
    while (taken < 8) sleep_cpu();
#else
    for (uint8_t i = 0; i < 8; i++) counts[i] = convert(i);
    gap = convert(0x1e);
#endif
    end();
}
