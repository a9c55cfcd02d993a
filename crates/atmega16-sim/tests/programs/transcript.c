/* What a chip can see of itself, a line each over the USART, 38400 baud 8N1 at 16 MHz: `name value`. transcript.txt says between which
 * values the data sheet has it. It needs a crystal and TXD alone, and drives PB4, PB5, PB7 and PC0 to PC3 as well. */
#include "mark.h"
#include "waits.h"

#define DIVISOR 25
#define ADC_ON (1 << ADEN | 7) /* clock / 128 */

static void put(char c) {
    while (!(UCSRA & 1 << UDRE)) {}
    UDR = c;
}

static void say(const char *name, uint16_t value) {
    char digits[6];
    uint8_t n = 0;
    while (*name) put(*name++);
    put(' ');
    do digits[n++] = '0' + value % 10;
    while ((value /= 10));
    while (n) put(digits[--n]);
    put('\n');
}

/* Cycles of an instruction: timer 1 counts them, and reading it twice takes two. */
#define CYCLES(code)                                                                                                   \
    ({                                                                                                                 \
        uint16_t from = TCNT1;                                                                                         \
        __asm__ volatile(code ::: "r0", "r1", "r18", "r19", "r24", "r25", "r30", "r31", "memory");                     \
        uint16_t to = TCNT1;                                                                                           \
        __asm__ volatile("clr r1");                                                                                    \
        to - from - 2;                                                                                                 \
    })

static void instructions(void) {
    TCCR1B = 1 << CS10;
    say("nop", CYCLES("nop"));
    say("mul", CYCLES("mul r18, r19"));
    say("adiw", CYCLES("adiw r24, 1"));
    say("push_pop", CYCLES("push r18\n\tpop r18"));
    say("lpm", CYCLES("lpm r18, Z"));
    say("rjmp", CYCLES("rjmp .+0"));
    say("rcall_ret", CYCLES("rcall 1f\n\trjmp 2f\n1:\tret\n2:"));
    say("branch_taken", CYCLES("sez\n\tbreq .+0"));
    say("branch_not_taken", CYCLES("clz\n\tbreq .+0"));
}

static void usart(void) {
    uint16_t at[4];
    UCSRC = 1 << URSEL | 3 << UCSZ0;
    UBRRH = 0;
    say("ubrrh", UBRRH);
    while (!(UCSRA & 1 << UDRE)) {}
    for (uint8_t i = 0; i < 4; i++) {
        UDR = ' ';
        while (!(UCSRA & 1 << UDRE)) {}
        at[i] = TCNT1;
    }
    say("usart_byte", at[3] - at[2]);
}

static void ports(void) {
    DDRC = 0x0f;
    PORTC = 0x35;
    PINC = 0xff;
    say("portc_after_pinc", PORTC);
    DDRC = PORTC = 0;
}

static void spi(void) {
    uint16_t from;
    DDRB = 1 << 4 | 1 << 5 | 1 << 7;
    SPCR = 1 << SPE | 1 << MSTR | 3; /* clock / 128 */
    from = TCNT1;
    SPDR = 0x5a;
    while (!(SPSR & 1 << SPIF)) {}
    say("spi_bits", (TCNT1 - from) / 128);
    SPDR = 0x10;
    SPDR = 0x20;
    say("spi_collision", SPSR & 1 << WCOL);
    while (!(SPSR & 1 << SPIF)) {}
    (void)SPDR;
    SPCR = 0;
}

static void eeprom(void) {
    uint16_t from, to;
    EEAR = 0x1ff;
    TCCR1B = 1 << CS11 | 1 << CS10; /* 4 us */
    from = TCNT1;
    EEDR = 0x42;
    EECR = 1 << EEMWE;
    EECR = 1 << EEMWE | 1 << EEWE;
    say("eeprom_busy", EECR & 1 << EEWE);
    while (EECR & 1 << EEWE) {}
    to = TCNT1;
    say("eeprom_write_us", 4 * (to - from));
    EEDR = 1;
    EECR = 1 << EEWE;
    say("eeprom_unarmed", EECR & 1 << EEWE);
    EECR = 1 << EEMWE;
    __asm__ volatile("nop\n\tnop\n\tnop\n\tnop\n\tnop");
    EECR = 1 << EEMWE | 1 << EEWE;
    say("eeprom_late", EECR & 1 << EEWE);
    TCCR1B = 1 << CS10;
    say("eeprom_read", CYCLES("sbi 0x1c, 0"));
    say("eeprom_read_back", EEDR);
}

static void timers(void) {
    volatile uint8_t early, late;
    OCR0 = 20;
    TCCR0 = 1 << WGM01 | 1 << CS00;
    for (volatile uint8_t i = 0; i < 50; i++) {}
    say("timer0_flags_in_ctc", TIFR & (1 << TOV0 | 1 << OCF0));
    TCCR0 = 0;
    TIFR = 1 << OCF0;
    say("timer0_flag_cleared", TIFR & 1 << OCF0);
    TCNT0 = 77;
    say("timer0_stopped", TCNT0);
    TCCR1B = 0;
    compare_waits(&early, &late);
    TCCR1A = TCCR1B = 0;
    say("compare_before_period", early);
    say("compare_after_period", late);
}

static uint16_t converted(void) {
    uint16_t from = TCNT1;
    ADCSRA = ADC_ON | 1 << ADSC;
    while (ADCSRA & 1 << ADSC) {}
    return (TCNT1 - from) / 128;
}

EMPTY_INTERRUPT(TIMER0_COMP_vect)

static void adc(void) {
    uint8_t periods = 0, conversions = 0;
    ADMUX = 0x1e;
    TCCR1B = 1 << CS10;
    say("adc_first_clocks", converted());
    say("adc_next_clocks", converted());
    /* On and asleep for less than a conversion. */
    OCR0 = 99;
    TCNT0 = 0;
    TIFR = 1 << OCF0;
    TIMSK = 1 << OCIE0;
    MCUCR = 1 << SE;
    TCCR0 = 1 << WGM01 | 1 << CS01;
    sei();
    sleep_cpu();
    cli();
    say("adc_begun_by_sleep", ADCSRA & 1 << ADSC);
    TIMSK = TCCR0 = ADCSRA = 0;
    /* Begun by timer 1, whose flag has to be cleared. */
    TCCR1B = 0;
    TCNT1 = 0;
    OCR1A = 12499;
    OCR1B = 400;
    TIFR = 1 << OCF1A | 1 << OCF1B;
    SFIOR = 1 << ADTS2 | 1 << ADTS0;
    ADCSRA = ADC_ON | 1 << ADATE | 1 << ADIF;
    TCCR1B = 1 << WGM12 | 1;
    while (periods < 8) {
        if (ADCSRA & 1 << ADIF) {
            ADCSRA |= 1 << ADIF;
            TIFR = 1 << OCF1B;
            conversions++;
        }
        if (TIFR & 1 << OCF1A) {
            TIFR = 1 << OCF1A;
            periods++;
        }
    }
    ADCSRA = TCCR1B = 0;
    say("adc_triggered", conversions);
}

static volatile uint8_t order[2];
static volatile uint8_t served;

ISR(TIMER2_COMP_vect) { order[served++ & 1] = 3; }
ISR(TIMER1_COMPB_vect) { order[served++ & 1] = 7; }
ISR(TIMER1_COMPA_vect, ISR_NAKED) { __asm__ volatile("in r20, %0\n\treti" ::"I"(_SFR_IO_ADDR(TCNT1L))); }

static void interrupts(void) {
    uint8_t count;
    TCNT1 = 0;
    OCR1A = 200;
    TIFR = 1 << OCF1A;
    TIMSK = 1 << OCIE1A;
    MCUCR = 1 << SE;
    TCCR1B = 1 << WGM12 | 1 << CS10;
    sei();
    __asm__ volatile("sleep\n\tmov %0, r20" : "=r"(count)::"r20");
    cli();
    TIMSK = TCCR1B = 0;
    say("cycles_out_of_sleep", count);
    /* Two flags that were set before their enables: the lower vector first. */
    OCR2 = 1;
    TCCR2 = 1 << CS20;
    TCNT1 = 0;
    OCR1B = 1;
    TCCR1B = 1 << CS10;
    for (volatile uint8_t i = 0; i < 5; i++) {}
    TIMSK = 1 << OCIE2 | 1 << OCIE1B;
    __asm__ volatile("sei\n\tnop\n\tnop\n\tnop");
    cli();
    TIMSK = 0;
    say("served_first", order[0]);
    say("served_second", order[1]);
}

int main(void) {
    UBRRH = 0;
    UBRRL = DIVISOR;
    UCSRC = 1 << URSEL | 3 << UCSZ0;
    UCSRB = 1 << TXEN;
    instructions();
    usart();
    ports();
    spi();
    eeprom();
    timers();
    adc();
    interrupts();
    say("end", 0);
    put('\n');
    UCSRA = 1 << TXC; /* It was set in each pause. */
    while (!(UCSRA & 1 << TXC)) {}
    end();
}
