#include "gyro.h"

#include <avr/pgmspace.h>
#include <util/delay.h>

#include "sensors.h"
#include "wire.h"

#define WRITE 0x80
/* Behind a frame, at a fast sample period and at any. */
#define FAST_PAUSE_US 32
#define SLOW_PAUSE_US 100
static bool fast;

/* GYRO_SCALE as the parts leave the factory: 1. */
#define FACTORY_SCALE 0x0800

enum access { NONE, READ, WRITABLE, BOTH };

/* By address / 2. */
static const uint8_t __flash access[32] = {
    [0x00 / 2] = READ,     [0x02 / 2] = READ, [0x04 / 2] = READ, [0x0a / 2] = READ, [0x0c / 2] = READ,
    [0x0e / 2] = READ,     [0x14 / 2] = BOTH, [0x16 / 2] = BOTH, [0x20 / 2] = BOTH, [0x22 / 2] = BOTH,
    [0x24 / 2] = BOTH,     [0x26 / 2] = BOTH, [0x28 / 2] = BOTH, [0x30 / 2] = BOTH, [0x32 / 2] = BOTH,
    [0x34 / 2] = BOTH,     [0x36 / 2] = BOTH, [0x38 / 2] = BOTH, [0x3a / 2] = BOTH, [0x3c / 2] = READ,
    [0x3e / 2] = WRITABLE,
};

static void set_pace(bool is_fast)
{
    fast = is_fast;
    sensors_slow(!is_fast);
}

static bool frame(uint8_t axis, uint8_t address, uint8_t value, uint16_t *reply)
{
    bool done = sensors_exchange(axis, address, value, reply);
    if (fast)
        _delay_us(FAST_PAUSE_US);
    else
        _delay_us(SLOW_PAUSE_US);
    return done;
}

static bool read(uint8_t axis, uint8_t address, uint16_t *value)
{
    /* The reply comes with any next frame; one that asks for ENDURANCE disturbs nothing. */
    return frame(axis, address, 0, value) && frame(axis, ENDURANCE, 0, value);
}

static bool write(uint8_t axis, uint8_t address, uint16_t value)
{
    uint16_t ignored;
    return frame(axis, WRITE | address, (uint8_t)value, &ignored) &&
           frame(axis, WRITE | address | 1, (uint8_t)(value >> 8), &ignored);
}

static uint8_t work_on_register(struct gyro_job *job)
{
    uint8_t address = job->address & (uint8_t)~1;
    uint8_t may = address < 0x40 ? access[address >> 1] : NONE;
    uint16_t wanted = job->value;
    bool is_write = job->what == JOB_WRITE, done = true;
    if (job->axis > 2 || !(may & (is_write ? WRITABLE : READ))) {
        job->value = 0;
        return STATUS_BAD_ARGUMENT;
    }
    if (is_write)
        done = write(job->axis, address, wanted);
    if (done && (may & READ))
        done = read(job->axis, address, &job->value);
    if (!done) {
        job->value = 0;
        return STATUS_NOT_ANSWERING;
    }
    return is_write && job->value != wanted ? STATUS_READ_BACK_WRONG : STATUS_OK;
}

/* Bit axis: a register does not read as written; bit axis + 3: GYRO_SCALE is not what the part was calibrated to. */
static uint8_t configure(uint8_t axis, uint16_t sens_avg)
{
    /* The sample period comes first: the pace of all else hangs on it. */
    const struct {
        uint8_t address;
        uint16_t value;
    } wanted[] = {{SMPL_PRD, GYRO_FASTEST}, {SENS_AVG, sens_avg}, {GYRO_OFF, 0}, {ALM_CTRL, 0}, {MSC_CTRL, 0}};
    uint16_t value;
    set_pace(false);
    for (uint8_t i = 0; i < sizeof wanted / sizeof *wanted; i++) {
        if (!write(axis, wanted[i].address, wanted[i].value) || !read(axis, wanted[i].address, &value) ||
            value != wanted[i].value)
            return (uint8_t)(1 << axis);
        set_pace(true); /* from here on it has its fastest sample period */
    }
    if (!read(axis, GYRO_SCALE, &value) || (value & 0x0fff) != FACTORY_SCALE)
        return (uint8_t)(8 << axis);
    return 0;
}

uint8_t gyro_configure_all(uint16_t sens_avg)
{
    uint8_t wrong = 0;
    for (uint8_t axis = 0; axis < 3; axis++)
        wrong |= configure(axis, sens_avg);
    set_pace(true);
    return wrong;
}

void gyro_work(struct gyro_job *job)
{
    set_pace(false);
    if (job->what == JOB_CONFIGURE) {
        job->value = configure(job->axis, job->value);
        job->status = STATUS_OK;
    } else {
        job->status = work_on_register(job);
    }
    set_pace(true);
}
