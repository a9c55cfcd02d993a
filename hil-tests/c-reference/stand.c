#include "stand.h"

#include <avr/io.h>
#include <string.h>

#include "bias.h"
#include "board.h"
#include "correction.h"
#include "frame.h"
#include "gyro.h"
#include "maths.h"
#include "motor.h"
#include "serial.h"
#include "store.h"
#include "tick.h"

#define TICK_NS 4000
#define HEALTH_MS 1000
/* Less stack than this left is counted with each health frame. */
#define STACK_GUARD 32
/* SUPPLY_OUT at 4.75 V and 5.25 V. */
#define SUPPLY_LOWEST 2594
#define SUPPLY_HIGHEST 2866
#define ADC_MAX 1023
/* Samples from reply to reply and from hello or health frame to the next, where the queue has no room for a sample beside it:
 * then samples have four fifths of any line. */
#define SAMPLES_PER_REPLY 4
#define SAMPLES_PER_REPORT 16
#define ON_LINE(fields) (sizeof(fields) + 6)

struct pending stand_job, stand_null;
uint8_t stand_setting;
uint32_t stand_noise;
struct reply stand_answer;
uint8_t stand_misconfigured, stand_touched;
static struct health health;
static uint8_t silent; /* bit per axis: not answering at the last sample */
static uint8_t owed;   /* to the host, as soon as there is room */
static uint8_t late;   /* of it, what has been owed for a sample's time */
static uint8_t waited; /* what was owed at the last sample */
static uint8_t since_reply, since_report; /* samples sent since then; they saturate */
static uint8_t cleared; /* bit per axis: its STATUS has been read in this second */
static bool in_order;  /* the last sample was */
static bool unset;     /* the gyros have to be set up (anew) */

void stand_count(uint8_t fault, uint8_t times)
{
    uint16_t *count = &health.faults[fault];
    if (__builtin_add_overflow(*count, times, count))
        *count = UINT16_MAX;
}

void stand_count_each(uint8_t fault, uint8_t axes)
{
    for (; axes; axes >>= 1, fault++) {
        if (axes & 1)
            stand_count(fault, 1);
    }
}

bool stand_listens(void)
{
    uint8_t room = ON_LINE(struct reply);
    if (late)
        room += ON_LINE(struct health) + ON_LINE(struct reply);
    else if (since_reply < SAMPLES_PER_REPLY)
        room += ON_LINE(struct sample) + ON_LINE(struct reply);
    return serial_room() >= room;
}

static bool may_report(uint8_t length)
{
    length += ON_LINE(struct reply);
    if (!late)
        length += ON_LINE(struct sample);
    return serial_room() >= length;
}

void __attribute__((noinline)) stand_tell(uint8_t more)
{
    owed |= more;
    if (owed & OWED_HELLO && may_report(ON_LINE(struct hello))) {
        struct hello hello = {
            .firmware = {FIRMWARE_VERSION},
            .board_id = config.board_id,
            .reset_cause = board_reset_cause(),
            .restarts = board_restarts(),
            .next_seq = health.next_seq,
            .tick_ns = TICK_NS,
            .set_up = config.set_up,
        };
        if (frame_send(KIND_HELLO, &hello, sizeof hello)) {
            owed &= (uint8_t)~OWED_HELLO;
            since_report = late = 0;
        }
    }
    if (owed & OWED_HEALTH && may_report(ON_LINE(struct health))) {
        health.stack_free = board_stack_free();
        if (health.stack_free < STACK_GUARD)
            stand_count(FAULT_STACK_LOW, 1);
        if (frame_send(KIND_HEALTH, &health, sizeof health)) {
            if (owed & OWED_CLEAR) {
                memset(health.faults, 0, sizeof health.faults);
                board_watchdog_resets = board_brown_out_resets = 0;
            }
            owed &= (uint8_t)~(OWED_HEALTH | OWED_CLEAR);
            since_report = late = 0;
        }
    }
}

void stand_reply(uint8_t code, uint16_t number, uint8_t status)
{
    stand_answer.number = number;
    stand_answer.command = code;
    stand_answer.status = status;
    if (!frame_send(KIND_REPLY, &stand_answer, sizeof stand_answer))
        stand_count(FAULT_REPORT_DROPPED, 1);
    since_reply = 0;
    memset(&stand_answer, 0, sizeof stand_answer);
}

void stand_reply_pending(struct pending *pending, uint8_t status)
{
    uint8_t code = pending->code;
    pending->code = 0;
    stand_reply(code, pending->number, status);
}

void stand_note_configured(uint8_t axes, uint8_t wrong)
{
    uint8_t now = (wrong | wrong >> 3) & 7;
    stand_count_each(FAULT_GYRO_RECOVERED_X, stand_misconfigured & axes & (uint8_t)~now);
    stand_misconfigured = (uint8_t)((stand_misconfigured & ~axes) | now);
    stand_touched &= (uint8_t)~axes;
    stand_count_each(FAULT_GYRO_REGISTER_MISMATCH_X, wrong & 7);
    stand_count_each(FAULT_GYRO_SCALE_IMPOSSIBLE_X, wrong >> 3);
}

bool stand_miss_host(void)
{
    bool on = motor_is_on();
    if (on && !tick_host_is_there()) {
        motor_cut();
        /* Somebody wanted that: no fault. */
        if (!tick_is_stopped())
            stand_count(FAULT_MOTOR_TIMEOUT, 1);
        return false;
    }
    return on;
}

void stand_apply(void)
{
    stand_end_bias_null(STATUS_ABORTED);
    motor_limit(config.max_duty, config.ramp_per_s);
    board_set_motor(0);
    tick_set_period(config.set_up.period_ticks, config.set_up.periods_per_sample);
    serial_set_baud_later(config.set_up.baud_divisor);
    sensors_set_acc_range(config.set_up.acc_range);
    unset = true;
}

void stand_boot(void)
{
    health.faults[FAULT_WATCHDOG_RESET] = board_watchdog_resets;
    health.faults[FAULT_BROWN_OUT_RESET] = board_brown_out_resets;
    if (!store_load())
        config_set_default();
    stand_apply();
    correction_on();
}

void stand_started(uint8_t wrong)
{
    unset = false;
    stand_setting = SET;
    stand_note_configured(7, wrong);
    stand_tell(OWED_HELLO);
}

/* One gyro's part of the sample; its flags. */
static bool is_stuck(uint16_t word)
{
    return word == 0 || word == 0xffff;
}

static uint16_t take_gyro(uint8_t axis, const struct raw *raw, struct sample *sample)
{
    uint16_t word = raw->gyro[axis];
    bool stalled = raw->spi_stalled & 1 << axis;
    if (stalled)
        stand_count(FAULT_SPI_STALLED, 1);
    /* A rate may be zero without new data, or -1 count with an alarm; its supply is neither 0 V nor full scale. */
    if (stalled || (is_stuck(word) && is_stuck(raw->supply[axis]))) {
        stand_count(FAULT_GYRO_NOT_ANSWERING_X + axis, 1);
        return FLAG_GYRO_NOT_ANSWERING;
    }
    int16_t counts = (int16_t)(word << 2) >> 2;
    sample->gyro[axis] = counts;
    sample->temp[axis] = (int16_t)(raw->temp[axis] << 4) >> 4;
    sample->rate[axis] = times(config.set_up.scale[axis] << 8, counts) - config.set_up.bias[axis];
    uint16_t flags = 0;
    if (word & 0x8000)
        flags = FLAG_NEW_X << axis;
    else
        stand_count(FAULT_GYRO_STALE_X + axis, 1);
    if (word & 0x4000) {
        flags |= FLAG_ERROR_X << axis;
        stand_count(FAULT_GYRO_ERROR_ALARM_X + axis, 1);
    }
    return flags;
}

static uint16_t take_accelerometer(uint8_t axis, const struct raw *raw, struct sample *sample)
{
    uint16_t counts = raw->acc[axis];
    sample->acc[axis] = counts;
    if (raw->adc_stalled & 1 << axis) {
        stand_count(FAULT_ADC_STALLED, 1);
        return FLAG_ACC_NOT_CONVERTED;
    }
    if (counts == 0 || counts >= ADC_MAX) {
        stand_count(FAULT_ACC_AT_RAIL_X + axis, 1);
        return FLAG_ACC_AT_RAIL;
    }
    return 0;
}

/* One supply for three gyros: the first that answers says what it is. */
static uint16_t take_supply(const struct raw *raw, struct sample *sample)
{
    for (uint8_t axis = 0; axis < 3; axis++) {
        if (silent & 1 << axis)
            continue;
        uint16_t counts = raw->supply[axis] & 0x0fff;
        sample->supply = counts;
        if (counts >= SUPPLY_LOWEST && counts <= SUPPLY_HIGHEST)
            return 0;
        stand_count(FAULT_SUPPLY_OUT_OF_RANGE, 1);
        return FLAG_SUPPLY_OUT_OF_RANGE;
    }
    return 0;
}

bool stand_configure(uint8_t axis)
{
    if (!tick_post(JOB_CONFIGURE, axis, 0, config_sens_avg()))
        return false;
    stand_setting = axis;
    return true;
}

/* A gyro that answers again may have lost its set-up with its power; one that raises its error or alarm bit keeps it up until
 * its STATUS is read. */
static void look_after_gyros(uint8_t silent_now, uint8_t errors)
{
    uint8_t back = silent & (uint8_t)~silent_now;
    silent = silent_now;
    if (back) {
        stand_count_each(FAULT_GYRO_RECOVERED_X, back);
        unset = true;
    }
    if (stand_job.code)
        return;
    if (unset) {
        if (stand_configure(0)) {
            unset = false;
            stand_job.code = CODE_OWN;
        }
        return;
    }
    errors &= (uint8_t)~cleared;
    if (errors == 0)
        return;
    uint8_t axis = 0;
    while (!(errors & 1 << axis))
        axis++;
    if (tick_post(JOB_READ, axis, GYRO_STATUS, 0)) {
        cleared |= (uint8_t)(1 << axis);
        stand_job.code = CODE_OWN;
    }
}

void stand_end_bias_null(uint8_t status)
{
    if (stand_null.code == 0)
        return;
    if (status != STATUS_OK)
        memset(&stand_answer, 0, sizeof stand_answer);
    stand_reply_pending(&stand_null, status);
}

/* The means become the biases; false, and nothing changed, when the stand turns. */
static bool take_biases(void)
{
    int32_t largest = 0;
    for (uint8_t axis = 0; axis < 3; axis++) {
        int32_t error;
        if (!bias_mean(axis, config.set_up.scale[axis], &stand_answer.detail[axis], &error))
            return false;
        if (error > largest)
            largest = error;
    }
    stand_answer.value = largest;
    memcpy(config.set_up.bias, stand_answer.detail, sizeof config.set_up.bias);
    config.set_up.config_source = SOURCE_SET;
    return true;
}

static void step_bias_null(const struct sample *sample)
{
    switch (motor_is_on() ? BIAS_MOVING : bias_take(sample->gyro, in_order)) {
    case BIAS_GOES_ON:
        break;
    case BIAS_NOT_IN_ORDER:
        stand_end_bias_null(STATUS_NOT_ANSWERING);
        break;
    case BIAS_MOVING:
        stand_end_bias_null(STATUS_MOVING);
        break;
    case BIAS_DONE:
        stand_end_bias_null(take_biases() ? STATUS_OK : STATUS_MOVING);
        break;
    }
}

void __attribute__((noinline)) stand_on_sample(const struct raw *raw, uint8_t missed)
{
    struct sample sample;
    memset(&sample, 0, sizeof sample);
    uint16_t flags = 0;
    if (missed) {
        stand_count(FAULT_TICK_OVERRUN, missed);
        health.next_seq += missed;
        flags = FLAG_TICK_OVERRUN;
    }
    sample.seq = health.next_seq++;
    sample.t_ticks = raw->t_ticks;
    sample.pwm = motor_output();
    uint8_t silent_now = 0, noise = 0;
    for (uint8_t axis = 0; axis < 3; axis++) {
        uint16_t gyro = take_gyro(axis, raw, &sample);
        if (gyro == FLAG_GYRO_NOT_ANSWERING)
            silent_now |= (uint8_t)(1 << axis);
        flags |= gyro | take_accelerometer(axis, raw, &sample);
        noise ^= (uint8_t)raw->gyro[axis];
    }
    stand_noise = crc_update_byte(stand_noise, noise);
    look_after_gyros(silent_now, (flags >> 3) & 7); /* the flags of EA */
    if (((stand_misconfigured | stand_touched) & ~silent_now) || stand_setting != SET)
        flags |= FLAG_GYRO_MISCONFIGURED;
    flags |= take_supply(raw, &sample);
    in_order = flags == FLAGS_IN_ORDER;
    if (stand_null.code) {
        flags |= FLAG_BIAS_NULL;
        step_bias_null(&sample);
    }
    sample.flags = flags;
    /* What has been owed since a sample ago goes before samples. */
    if (late || !frame_send(KIND_SAMPLE, &sample, sizeof sample)) {
        stand_count(FAULT_FRAME_DROPPED, 1);
    } else {
        if (since_reply != UINT8_MAX)
            since_reply++;
        if (since_report != UINT8_MAX)
            since_report++;
    }
    late = since_report >= SAMPLES_PER_REPORT ? owed & waited : 0;
    waited = owed;
    requests_on_sample();
    uint16_t busy = tick_since();
    if (busy > health.tick_busy_max)
        health.tick_busy_max = busy;
}

void stand_correct(const struct raw *raw)
{
    if (correction_is_ready())
        correction_step(raw, health.next_seq - 1, motor_output(), in_order);
}

void __attribute__((noinline)) stand_on_millisecond(void)
{
    static uint16_t millisecond;
    motor_on_millisecond(stand_miss_host());
    board_set_motor(motor_output());
    requests_on_millisecond();
    if (++millisecond >= HEALTH_MS) {
        millisecond = 0;
        cleared = 0;
        /* What does not read back is tried anew each second. */
        if (stand_misconfigured & (uint8_t)~silent)
            unset = true;
        health.uptime_s++;
        owed |= OWED_HEALTH;
    }
    if (owed)
        stand_tell(0);
    else if (correction_waits() && serial_room() >= ON_LINE(struct corrected) + ON_LINE(struct sample) + ON_LINE(struct reply))
        correction_tell();
}
