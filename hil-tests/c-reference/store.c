#include "store.h"

#include <avr/io.h>
#include <string.h>
#include <util/atomic.h>

#include "correction.h"
#include "frame.h"
#include "gyro.h"
#include "motor.h"
#include "stand.h"

#define FORMAT 2
/* Q8.24 deg/s for each count: 0.07326, 0.03663, 0.018315. */
#define SCALE_320 1229099L
#define SCALE_160 614549L
#define SCALE_80 307275L
/* Bounds of scale and bias, by their high words: 0.25 deg/s for each count, 512 deg/s. */
#define MAX_SCALE_HIGH 0x3f
#define BIAS_BOUND_HIGH 512
#define MIN_PERIOD 976
#define MAX_PERIOD 62500U
#define MAX_PERIODS 4 /* 1 Hz is the slowest rate */
#define MAX_DIVISOR 4095

struct stored {
    uint8_t format;
    uint8_t generation;
    struct config config;
    uint32_t crc;
};
_Static_assert(sizeof(struct stored) == 45, "the format of a stored copy");

/* Address 0 is left alone: a known weak spot when power sags. */
#define SLOT(place) ((place) ? 80 : 16)

struct config config;
static struct stored copy;
static bool storing, is_row;
static uint8_t at, generation, newest;
static uint16_t place;
static uint8_t row[6];

void config_set_scale_of_range(void)
{
    int32_t scale = SCALE_320;
    if (config.set_up.gyro_range != 4)
        scale = config.set_up.gyro_range == 2 ? SCALE_160 : SCALE_80;
    for (uint8_t axis = 0; axis < 3; axis++)
        config.set_up.scale[axis] = scale;
}

void config_set_default(void)
{
    struct set_up *set_up = &config.set_up;
    set_up->period_ticks = 12500;
    set_up->periods_per_sample = 1;
    set_up->baud_divisor = 25;
    set_up->gyro_range = 4;
    set_up->gyro_filter = 2;
    set_up->gyro_sample_period = 1;
    set_up->acc_range = 0;
    for (uint8_t axis = 0; axis < 3; axis++)
        set_up->bias[axis] = 0;
    config_set_scale_of_range();
    config.ramp_per_s = MOTOR_DEFAULT_RAMP_PER_S;
    config.max_duty = MOTOR_FULL;
}

uint16_t config_sens_avg(void)
{
    return (uint16_t)(config.set_up.gyro_range << 8 | config.set_up.gyro_filter);
}

bool config_rate_in_order(uint16_t ticks, uint8_t every)
{
    return ticks >= MIN_PERIOD && ticks <= MAX_PERIOD && every >= 1 && every <= MAX_PERIODS;
}

bool config_baud_in_order(uint16_t divisor)
{
    return divisor <= MAX_DIVISOR;
}

/* A narrow range demands taps. */
bool config_gyro_in_order(uint8_t range, uint8_t filter)
{
    uint8_t fewest_taps = range == 4 ? 0 : range == 2 ? 2 : range == 1 ? 4 : 7;
    return filter >= fewest_taps && filter <= 6;
}

bool config_scale_in_order(int32_t scale)
{
    return scale && (uint16_t)(scale >> 16) <= MAX_SCALE_HIGH;
}

bool config_bias_in_order(int32_t bias)
{
    int16_t high = (int16_t)(bias >> 16);
    return high < BIAS_BOUND_HIGH && high >= -BIAS_BOUND_HIGH;
}

uint8_t eeprom_read(uint16_t address)
{
    EEAR = address;
    EECR |= _BV(EERE);
    return EEDR;
}

bool eeprom_is_ready(void)
{
    return !(EECR & _BV(EEWE));
}

static void eeprom_write(uint16_t address, uint8_t byte)
{
    EEAR = address;
    EEDR = byte;
    ATOMIC_BLOCK(ATOMIC_FORCEON)
    {
        EECR = _BV(EEMWE);
        EECR = _BV(EEMWE) | _BV(EEWE); /* within four cycles */
    }
}

static bool copy_is_in_order(void)
{
    const struct set_up *set_up = &copy.config.set_up;
    for (uint8_t axis = 0; axis < 3; axis++) {
        if (!config_scale_in_order(set_up->scale[axis]) || !config_bias_in_order(set_up->bias[axis]))
            return false;
    }
    return config_gyro_in_order(set_up->gyro_range, set_up->gyro_filter) && set_up->acc_range <= 3 &&
           set_up->gyro_sample_period == GYRO_FASTEST &&
           config_rate_in_order(set_up->period_ticks, set_up->periods_per_sample) &&
           config_baud_in_order(set_up->baud_divisor);
}

enum found { ERASED, SPOILT, WHOLE };

/* Looks at a copy of the set-up or, behind those, of a correction. */
static enum found look(uint16_t address)
{
    bool is_config = address < CORRECTION_FIRST;
    uint8_t left = is_config ? sizeof copy : CORRECTION_BYTES, format = eeprom_read(address), all = 0xff;
    uint32_t crc = CRC_INIT;
    for (; left; left--) {
        uint8_t byte = eeprom_read(address++);
        crc = crc_update_byte(crc, byte);
        all &= byte;
    }
    if (crc == CRC_RESIDUE && format == (is_config ? FORMAT : CORRECTION_FORMAT))
        return WHOLE;
    return all == 0xff ? ERASED : SPOILT;
}

uint8_t store_newest(uint16_t first, uint16_t second)
{
    enum found one = look(first), two = look(second);
    uint8_t found = (one == SPOILT ? 4 : 0) + (two == SPOILT ? 4 : 0);
    /* Generations, behind the format, wrap: the newer one is ahead by less than half the circle. */
    if (two == WHOLE && (one != WHOLE || (uint8_t)(eeprom_read(second + 1) - eeprom_read(first + 1)) < 128))
        return found + 2;
    return one == WHOLE ? found + 1 : found;
}

bool store_load(void)
{
    uint8_t found = store_newest(SLOT(0), SLOT(1)), number = found & 3;
    stand_count(FAULT_CONFIG_INVALID, found >> 2);
    if (number == 0)
        return false;
    uint16_t address = SLOT(number - 1);
    for (uint8_t *to = (uint8_t *)&copy; to < (uint8_t *)(&copy + 1); to++)
        *to = eeprom_read(address++);
    if (!copy_is_in_order()) {
        stand_count(FAULT_CONFIG_INVALID, 1);
        return false;
    }
    config = copy.config;
    config.set_up.config_source = SOURCE_STORED + number - 1;
    generation = copy.generation;
    newest = number - 1;
    return true;
}

bool store_is_idle(void)
{
    return !storing;
}

bool store_begin(void)
{
    if (storing)
        return false;
    storing = true;
    is_row = false;
    at = 0;
    place = SLOT(newest ^ 1);
    copy.format = FORMAT;
    copy.generation = ++generation;
    copy.config = config;
    copy.crc = ~crc_update(CRC_INIT, &copy, sizeof copy - sizeof copy.crc);
    return true;
}

void store_begin_row(uint16_t to, const uint8_t bytes[6])
{
    storing = is_row = true;
    at = 0;
    place = to;
    memcpy(row, bytes, sizeof row);
}

static bool stored(void)
{
    if (!is_row) {
        uint8_t to = newest ^ 1;
        if ((store_newest(SLOT(0), SLOT(1)) & 3) != to + 1)
            return false;
        newest = to;
        config.set_up.config_source = SOURCE_STORED + to;
        return true;
    }
    for (uint8_t i = 0; i < sizeof row; i++) {
        if (eeprom_read(place + i) != row[i])
            return false;
    }
    /* With the row of its CRC the copy is whole, and in use from then on. */
    return place != correction_place(true, CORRECTION_ROWS) ||
           (correction_on() && place == correction_place(false, CORRECTION_ROWS));
}

uint8_t store_step(void)
{
    if (!storing || !eeprom_is_ready())
        return STORE_GOES_ON;
    if (at < (is_row ? sizeof row : sizeof copy)) {
        eeprom_write(place + at, is_row ? row[at] : ((const uint8_t *)&copy)[at]);
        at++;
        return STORE_GOES_ON;
    }
    storing = false;
    if (stored())
        return STATUS_OK;
    stand_count(FAULT_CONFIG_NOT_STORED, 1);
    return STATUS_NOT_STORED;
}
