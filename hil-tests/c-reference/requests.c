#include <stddef.h>

#include "bias.h"
#include "board.h"
#include "correction.h"
#include "gyro.h"
#include "motor.h"
#include "serial.h"
#include "stand.h"
#include "store.h"
#include "tick.h"

/* The reply comes when it is done, or has been sent. */
#define LATER 0xff
/* A gyro's self-test takes 25 ms, with margin. */
#define SELF_TEST_MS 40

static struct pending storing;

/* A gyro's self-test: a job at a time, each posted from the millisecond. */
static struct {
    enum { IDLE, CLEAR_STATUS, START, HAS_ENDED, VERDICT } step;
    uint8_t wait_ms; /* 0: its job is under way */
} self_test;

/* The gyro that stand_job is for. */
static uint8_t job_axis;

/* How many argument bytes a command has; 0xff where no command has the code. */
static uint8_t arguments_of(uint8_t code)
{
    switch (code) {
    case CODE_PING ... CODE_REBOOT:
    case CODE_STORE_CONFIG ... CODE_DEFAULT_CONFIG:
        return 0;
    case CODE_SET_ACC_RANGE:
    case CODE_SELF_TEST:
    case CODE_CORRECTION:
        return 1;
    case CODE_SET_BAUD ... CODE_SET_GYRO:
    case CODE_BIAS_NULL:
    case CODE_MOTOR_DUTY:
    case CODE_ARM:
    case CODE_READ_REGISTER:
    case CODE_GET_CORRECTION:
    case CODE_SET_BOARD_ID:
        return 2;
    case CODE_SET_RATE:
    case CODE_MOTOR_LIMITS:
        return 3;
    case CODE_WRITE_REGISTER:
        return 4;
    case CODE_SET_BIAS ... CODE_SET_SCALE:
        return 5;
    case CODE_SET_CORRECTION:
        return 7;
    case CODE_MOTOR_PROFILE:
        return 8;
    default:
        return 0xff;
    }
}

static uint8_t changed(void)
{
    config.set_up.config_source = SOURCE_SET;
    return STATUS_OK;
}

static uint8_t pend(struct pending *pending, const struct request *request)
{
    pending->code = request->command;
    pending->number = request->number;
    return LATER;
}

/* Posts work whose end answers the request. */
static uint8_t post(const struct request *request, uint8_t what, uint8_t axis, uint8_t address, uint16_t value)
{
    if (stand_job.code || !tick_post(what, axis, address, value))
        return STATUS_BUSY;
    job_axis = axis;
    return pend(&stand_job, request);
}

static uint8_t begin_self_test(const struct request *request)
{
    enum { ACCELEROMETER = 3 };
    uint8_t sensor = request->u8;
    if (sensor == ACCELEROMETER)
        return STATUS_UNSUPPORTED; /* the MMA7260QT has none */
    if (sensor > ACCELEROMETER)
        return STATUS_BAD_ARGUMENT;
    if (stand_job.code)
        return STATUS_BUSY;
    self_test.step = CLEAR_STATUS;
    self_test.wait_ms = 1;
    job_axis = sensor;
    stand_misconfigured |= (uint8_t)(1 << sensor); /* its rate is not to be trusted until the end */
    return pend(&stand_job, request);
}

static uint8_t begin_bias_null(const struct request *request)
{
    if (stand_null.code)
        return STATUS_BUSY;
    if (!bias_begin(request->u16, config.set_up.gyro_filter, config.set_up.period_ticks))
        return STATUS_BAD_ARGUMENT;
    if (motor_is_on())
        return STATUS_MOVING;
    return pend(&stand_null, request);
}

/* A measurement of the bias mixes what was before with what is now. */
static void set_up_changes(void)
{
    stand_end_bias_null(STATUS_ABORTED);
}

/* Why the motor may not turn. */
static uint8_t off(void)
{
    return tick_is_stopped() ? STATUS_STOPPED : STATUS_NO_KEEP_ALIVE;
}

/* Without a nonce: makes one of the sensors' noise so far and tells it. With that one, once: the host is there. A stop that is
 * pressed refuses both, one that was pressed since the nonce was told refuses that. */
static uint8_t arm(uint16_t said)
{
    static uint16_t told;
    uint16_t nonce = told;
    stand_miss_host();
    told = 0;
    if (said == 0)
        tick_forget_stop();
    if (tick_is_stopped())
        return STATUS_STOPPED;
    if (said == 0)
        stand_answer.value = told = (uint16_t)stand_noise | 1;
    else if (said == nonce)
        tick_keep_alive();
    else
        return STATUS_BAD_ARGUMENT;
    return STATUS_OK;
}

/* What concerns the correction. */
static uint8_t on_correction(const struct request *request)
{
    /* The EEPROM is read at once. */
    if (!store_is_idle())
        return STATUS_BUSY;
    if (request->command == CODE_CORRECTION) {
        if (request->u8 == 0)
            correction_off();
        else if (!correction_on())
            return STATUS_NO_CONFIG;
        return STATUS_OK;
    }
    bool write = request->command == CODE_SET_CORRECTION;
    uint16_t place =
        write ? correction_place(true, request->row.row) : correction_place(request->place.other, request->place.row);
    if (place == 0)
        return STATUS_BAD_ARGUMENT;
    if (write) {
        store_begin_row(place, request->row.bytes);
        return pend(&storing, request);
    }
    stand_answer.value = correction_in_use();
    correction_read(place, stand_answer.detail);
    return STATUS_OK;
}

static uint8_t carry_out(const struct request *request)
{
    struct set_up *set_up = &config.set_up;
    switch (request->command) {
    case CODE_PING:
        return STATUS_OK;
    case CODE_GET_HELLO:
        stand_tell(OWED_HELLO);
        return STATUS_OK;
    case CODE_KEEP_ALIVE:
        stand_miss_host();
        if (!tick_host_is_there())
            return off();
        tick_keep_alive();
        return STATUS_OK;
    case CODE_COUNTERS:
        stand_tell(OWED_HEALTH);
        return STATUS_OK;
    case CODE_CLEAR_COUNTERS:
        stand_tell(OWED_HEALTH | OWED_CLEAR);
        return STATUS_OK;
    case CODE_REBOOT:
        stand_reply(CODE_REBOOT, request->number, STATUS_OK);
        motor_cut();
        board_set_motor(0);
        board_reboot();
    case CODE_SET_RATE: {
        uint8_t every = request->rate.periods_per_sample;
        if (every == 0)
            every = 1;
        if (!config_rate_in_order(request->rate.period_ticks, every))
            return STATUS_BAD_ARGUMENT;
        set_up_changes();
        set_up->period_ticks = request->rate.period_ticks;
        set_up->periods_per_sample = every;
        tick_set_period(set_up->period_ticks, every);
        return changed();
    }
    case CODE_SET_BAUD:
        if (!config_baud_in_order(request->u16))
            return STATUS_BAD_ARGUMENT;
        set_up_changes();
        set_up->baud_divisor = request->u16;
        changed();
        stand_reply(CODE_SET_BAUD, request->number, STATUS_OK);
        serial_set_baud_later(request->u16);
        return LATER;
    case CODE_SET_GYRO: {
        uint8_t range = request->gyro.range, filter = request->gyro.filter;
        if (!config_gyro_in_order(range, filter))
            return STATUS_BAD_ARGUMENT;
        /* Whether it is busy or not: as the measurement would go on with the set-up that is asked for. */
        set_up_changes();
        if (stand_job.code)
            return STATUS_BUSY;
        uint8_t range_was = set_up->gyro_range, filter_was = set_up->gyro_filter;
        set_up->gyro_range = range;
        set_up->gyro_filter = filter;
        if (!stand_configure(0)) {
            set_up->gyro_range = range_was;
            set_up->gyro_filter = filter_was;
            return STATUS_BUSY;
        }
        config_set_scale_of_range();
        changed();
        return pend(&stand_job, request);
    }
    case CODE_SET_ACC_RANGE:
        if (request->u8 > 3)
            return STATUS_BAD_ARGUMENT;
        set_up_changes();
        set_up->acc_range = request->u8;
        sensors_set_acc_range(request->u8);
        return changed();
    case CODE_BIAS_NULL:
        return begin_bias_null(request);
    case CODE_SET_BIAS:
        if (request->axis.axis > 2 || !config_bias_in_order(request->axis.value))
            return STATUS_BAD_ARGUMENT;
        set_up_changes();
        set_up->bias[request->axis.axis] = request->axis.value;
        return changed();
    case CODE_SET_SCALE:
        if (request->axis.axis > 2 || !config_scale_in_order(request->axis.value))
            return STATUS_BAD_ARGUMENT;
        set_up_changes();
        set_up->scale[request->axis.axis] = request->axis.value;
        return changed();
    case CODE_SET_CORRECTION ... CODE_GET_CORRECTION:
        return on_correction(request);
    case CODE_MOTOR_DUTY:
        if (request->i16 < -MOTOR_FULL || request->i16 > MOTOR_FULL)
            return STATUS_BAD_ARGUMENT;
        if (request->i16 && !tick_host_is_there())
            return off();
        stand_answer.value = motor_command(request->i16);
        return STATUS_OK;
    case CODE_MOTOR_PROFILE:
        if (request->profile.shape != SHAPE_STOP && !tick_host_is_there())
            return off();
        return motor_profile(request->profile.shape, request->profile.amplitude, request->profile.offset,
                             request->profile.period_ms, request->profile.cycles)
                   ? STATUS_OK
                   : STATUS_BAD_ARGUMENT;
    case CODE_MOTOR_LIMITS:
        config.max_duty = request->limits.max_duty;
        config.ramp_per_s = request->limits.ramp_per_s;
        motor_limit(config.max_duty, config.ramp_per_s);
        return changed();
    case CODE_ARM:
        return arm(request->u16);
    case CODE_READ_REGISTER:
        return post(request, JOB_READ, request->reg.gyro, request->reg.address, 0);
    case CODE_WRITE_REGISTER:
        return post(request, JOB_WRITE, request->reg.gyro, request->reg.address, request->reg.value);
    case CODE_SELF_TEST:
        return begin_self_test(request);
    case CODE_STORE_CONFIG:
        return store_begin() ? pend(&storing, request) : STATUS_BUSY;
    case CODE_LOAD_CONFIG:
        if (!store_is_idle())
            return STATUS_BUSY;
        if (!store_load())
            return STATUS_NO_CONFIG;
        stand_apply();
        return STATUS_OK;
    case CODE_DEFAULT_CONFIG:
        config_set_default();
        set_up->config_source = SOURCE_BUILT_IN;
        stand_apply();
        return STATUS_OK;
    case CODE_SET_BOARD_ID:
        config.board_id = request->u16;
        return changed();
    default:
        return STATUS_UNSUPPORTED;
    }
}

void __attribute__((noinline)) stand_on_request(const struct request *request)
{
    uint8_t status = STATUS_OK, used = arguments_of(request->command);
    if (used == 0xff) {
        status = STATUS_UNKNOWN_COMMAND;
    } else {
        /* Bytes that it does not use may come to mean something. */
        for (uint8_t at = used; at < sizeof request->bytes; at++) {
            if (request->bytes[at])
                status = STATUS_BAD_ARGUMENT;
        }
    }
    if (status == STATUS_OK)
        status = carry_out(request);
    if (status != LATER)
        stand_reply(request->command, request->number, status);
}

/* A job of the self-test has ended; its status when that was the last, else LATER. */
static uint8_t next_self_test(uint16_t value, uint8_t status)
{
    self_test.wait_ms = 1;
    /* The bit that starts it need not read back: it clears itself. */
    if (self_test.step == START && (status == STATUS_OK || status == STATUS_READ_BACK_WRONG)) {
        self_test.wait_ms = SELF_TEST_MS;
        self_test.step = HAS_ENDED;
        return LATER;
    }
    if (status == STATUS_OK) {
        if (self_test.step == CLEAR_STATUS) {
            self_test.step = START;
            return LATER;
        }
        if (self_test.step == HAS_ENDED && !(value & MSC_SELF_TEST)) {
            self_test.step = VERDICT;
            return LATER;
        }
        if (self_test.step != VERDICT || (value & GYRO_STATUS_SELF_TEST_FAILED))
            status = STATUS_SELF_TEST_FAILED;
    }
    self_test.step = IDLE;
    stand_misconfigured &= (uint8_t) ~(1 << job_axis);
    return status;
}

void requests_on_sample(void)
{
    const struct gyro_job *done = tick_fetch_done();
    if (done == NULL)
        return;
    uint16_t value = done->value;
    uint8_t status = done->status;
    static uint8_t wrong; /* bit per axis: has not read back since the first of them */
    if (done->what == JOB_CONFIGURE) {
        stand_note_configured((uint8_t)(1 << stand_setting), (uint8_t)value);
        if (stand_setting == 0)
            wrong = 0;
        wrong |= value & 7;
        uint8_t next = stand_setting + 1;
        /* The slot is free: this was the job in it. */
        if (next != SET && stand_configure(next))
            return;
        stand_setting = SET;
    }
    switch (stand_job.code) {
    case CODE_OWN:
        stand_job.code = 0;
        return;
    case CODE_SELF_TEST:
        status = next_self_test(value, status);
        if (status == LATER)
            return;
        break;
    case CODE_SET_GYRO:
        value = wrong;
        if (value)
            status = STATUS_READ_BACK_WRONG;
        stand_answer.value = value;
        break;
    case CODE_WRITE_REGISTER:
        /* By hand: what the part is set to now is not what the set-up says. */
        if (status != STATUS_BAD_ARGUMENT)
            stand_touched |= (uint8_t)(1 << job_axis);
        /* fall through */
    default:
        stand_answer.value = value;
    }
    stand_reply_pending(&stand_job, status);
}

static void step_self_test(void)
{
    if (self_test.step == IDLE || self_test.wait_ms == 0 || --self_test.wait_ms)
        return;
    bool posted;
    if (self_test.step == START)
        posted = tick_post(JOB_WRITE, job_axis, MSC_CTRL, MSC_SELF_TEST);
    else
        posted = tick_post(JOB_READ, job_axis, self_test.step == HAS_ENDED ? MSC_CTRL : GYRO_STATUS, 0);
    if (!posted)
        self_test.wait_ms = 1;
}

void requests_on_millisecond(void)
{
    uint8_t stored = store_step();
    if (stored != STORE_GOES_ON)
        stand_reply_pending(&storing, stored);
    step_self_test();
}
