#include "sensors.h"

#include <avr/io.h>
#include <util/delay.h>

#include "gyro.h"
#include "tick.h"

/* Chip selects: x PB2, y PB3, z PB4 (SS, which has to be an output anyway). */
#define SELECT_X _BV(PB2)
#define SELECTS (_BV(PB2) | _BV(PB3) | _BV(PB4))
/* Master, mode 3; with SPI2X clock / 8 = 2 MHz, below the part's 2.5 MHz. */
#define SPCR_MASTER (_BV(SPE) | _BV(MSTR) | _BV(CPOL) | _BV(CPHA) | _BV(SPR0))
/* Polls: a byte takes 64 cycles, 128 at the slow clock, a conversion 1664, the first of a tick 3200. */
#define SPI_BUDGET 60
#define ADC_BUDGET 1000
/* Clock / 128 = 125 kHz. */
#define ADC_ON (_BV(ADEN) | _BV(ADPS2) | _BV(ADPS1) | _BV(ADPS0))
/* A round over the gyros takes about 33 us, a gyro wants 40 us. */
#define ROUND_STALL_US 12
#define SENSOR_START_MS 220

void sensors_start(void)
{
    PORTB = SELECTS | _BV(PB7);
    DDRB = SELECTS | _BV(PB5) | _BV(PB7);
    SPCR = SPCR_MASTER;
    DDRA = 0;
    PORTA = 0;
    /* g-select is driven low or left to the pull-up to 3.3 V, never driven high: 5 V would harm the part. */
    PORTC = 0;
    DDRC = _BV(PC0) | _BV(PC1);
    _delay_ms(SENSOR_START_MS);
}

void sensors_set_acc_range(uint8_t range)
{
    DDRC = ~range & (_BV(PC0) | _BV(PC1));
}

void sensors_slow(bool slow)
{
    SPSR = slow ? 0 : _BV(SPI2X);
}

static bool transfer(uint8_t out, uint8_t *in)
{
    SPDR = out;
    tick_cut_if_pressed(); /* in the first round INT0 is masked */
    for (uint8_t polls = SPI_BUDGET; polls; polls--) {
        if (SPSR & _BV(SPIF)) {
            *in = SPDR;
            return true;
        }
    }
    /* A low level on SS drops the master bit, and the byte never ends: become master again. */
    SPCR = SPCR_MASTER;
    return false;
}

static bool exchange(uint8_t select, uint8_t address, uint8_t value, uint16_t *reply)
{
    uint8_t high = 0, low = 0;
    PORTB &= (uint8_t)~select;
    bool done = transfer(address, &high) && transfer(value, &low);
    PORTB |= select;
    if (done)
        *reply = (uint16_t)(high << 8 | low);
    return done;
}

bool sensors_exchange(uint8_t axis, uint8_t address, uint8_t value, uint16_t *reply)
{
    return exchange((uint8_t)(SELECT_X << axis), address, value, reply);
}

/* Asks all three for a register; brings what they were asked for before. */
static uint8_t read_all(uint8_t address, uint16_t *replies)
{
    uint8_t stalled = 0;
    for (uint8_t bit = 1, select = SELECT_X; bit < 8; bit <<= 1, select <<= 1) {
        if (!exchange(select, address, 0, replies++))
            stalled |= bit;
    }
    return stalled;
}

static void adc_start(uint8_t channel)
{
    /* REFS = 00: AREF is the sensor's own 3.3 V, so the reading is ratiometric. */
    ADMUX = channel;
    ADCSRA = ADC_ON | _BV(ADSC);
}

static void adc_finish(struct raw *raw, uint8_t channel)
{
    for (uint16_t polls = ADC_BUDGET; polls; polls--) {
        if (!(ADCSRA & _BV(ADSC))) {
            raw->acc[channel] = ADC;
            return;
        }
    }
    raw->acc[channel] = 0;
    raw->adc_stalled |= (uint8_t)(1 << channel);
}

void sensors_acquire(struct raw *raw, void (*sampled)(void))
{
    adc_start(0);
    raw->adc_stalled = 0;
    /* What comes back is the answer to last time's last question; gyro is overwritten below. */
    uint8_t stalled = read_all(GYRO_OUT, raw->gyro);
    sampled();
    _delay_us(ROUND_STALL_US);
    stalled |= read_all(TEMP_OUT, raw->gyro);
    adc_finish(raw, 0);
    adc_start(1);
    stalled |= read_all(SUPPLY_OUT, raw->temp);
    _delay_us(ROUND_STALL_US);
    stalled |= read_all(SUPPLY_OUT, raw->supply);
    raw->spi_stalled = stalled;
    adc_finish(raw, 1);
    adc_start(2);
    adc_finish(raw, 2);
    /* Off: idle sleep starts conversions by itself while it is on. */
    ADCSRA = 0;
}
