/* Latency of timer 1's compare interrupt, in busy code and out of sleep; the instruction behind sei and reti; a flag
 * that is set before its interrupt is enabled; two at once. */
#include "mark.h"

volatile uint8_t busy_count, sleep_count, order[4], seen, shadow;
volatile uint8_t *volatile next_order = order;

ISR(TIMER1_COMPA_vect, ISR_NAKED) {
    __asm__ volatile("in r20, %0\n\treti" ::"I"(_SFR_IO_ADDR(TCNT1L)));
}
ISR(TIMER0_COMP_vect) { *next_order++ = 19; }
ISR(TIMER2_COMP_vect) { *next_order++ = 3; }
ISR(TIMER1_OVF_vect, ISR_NAKED) {
    __asm__ volatile("sts shadow, r21\n\treti");
}

int main(void) {
    uint8_t count;
    DDRB = 0xff;
    OCR1A = 200;
    TIMSK = 1 << OCIE1A;
    TCCR1B = 1 << WGM12 | 1 << CS10;
    sei();
    __asm__ volatile("clr r20\n1:\ttst r20\n\tnop\n\tnop\n\tnop\n\tnop\n\tnop\n\tnop\n\tbreq 1b\n\tmov %0, r20" : "=r"(count)::"r20");
    busy_count = count;
    MCUCR = 1 << SE;
    __asm__ volatile("sleep\n\tmov %0, r20" : "=r"(count)::"r20");
    sleep_count = count;
    cli();
    TCCR1B = 0;
    TIMSK = 0;
    /* Both flags set, interrupts off; then enabled: the lower vector first. */
    OCR0 = 1;
    OCR2 = 1;
    TCCR0 = 1 << CS00;
    TCCR2 = 1 << CS20;
    for (volatile uint8_t i = 0; i < 5; i++) {}
    TIMSK = 1 << OCIE0 | 1 << OCIE2;
    __asm__ volatile("sei\n\tnop\n\tnop\n\tnop\n\tcli");
    TIMSK = 0;
    /* One instruction runs behind sei. */
    TCNT1 = 0xffff;
    TCCR1B = 1 << CS10;
    __asm__ volatile("nop\n\tnop\n\tnop");
    TIMSK = 1 << TOIE1;
    __asm__ volatile("ldi r21, 1\n\tsei\n\tinc r21\n\tinc r21\n\tcli" ::: "r21");
    end();
}
