#include "gyro.h"

#include <avr/pgmspace.h>
#include <util/delay.h>

#include "sensors.h"
#include "wire.h"

#define WRITE 0x80
/* From frame to frame, at any sample period. */
#define PAUSE_US 100

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

static bool frame(uint8_t axis, uint8_t address, uint8_t value, uint16_t *reply)
{
    bool done = sensors_exchange(axis, address, value, reply);
    _delay_us(PAUSE_US);
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

uint8_t gyro_configure(uint16_t sens_avg)
{
    uint8_t wrong = 0;
    for (uint8_t axis = 0; axis < 3; axis++) {
        uint16_t value;
        if (!write(axis, SENS_AVG, sens_avg) || !read(axis, SENS_AVG, &value) || value != sens_avg)
            wrong |= (uint8_t)(1 << axis);
        else if (!read(axis, GYRO_SCALE, &value) || (value & 0x0fff) != FACTORY_SCALE)
            wrong |= (uint8_t)(8 << axis);
    }
    return wrong;
}

void gyro_work(struct gyro_job *job)
{
    if (job->what == JOB_CONFIGURE) {
        job->value = gyro_configure(job->value);
        job->status = STATUS_OK;
        return;
    }
    job->status = work_on_register(job);
}
