/* The frames of docs/wire-format.md, version 1. The AVR is little endian and packs its structs: these are the bytes. */
#pragma once

#include <stdint.h>

#define WIRE_VERSION 1

enum kind { KIND_HELLO = 1, KIND_SAMPLE = 2, KIND_HEALTH = 3, KIND_REPLY = 4, KIND_CORRECTED = 5, KIND_REQUEST = 16 };

enum {
    FLAG_NEW_X = 1 << 0,
    FLAG_ERROR_X = 1 << 3,
    FLAG_GYRO_NOT_ANSWERING = 1 << 6,
    FLAG_ACC_AT_RAIL = 1 << 7,
    FLAG_TICK_OVERRUN = 1 << 8,
    FLAG_BIAS_NULL = 1 << 9,
    FLAG_SUPPLY_OUT_OF_RANGE = 1 << 11,
    FLAG_ACC_NOT_CONVERTED = 1 << 12,
    FLAG_GYRO_MISCONFIGURED = 1 << 13,
    FLAGS_IN_ORDER = 7,
};

/* Bits of a corrected frame's state. */
enum state {
    STATE_APPLIED = 1 << 0,
    STATE_FILTERED = 1 << 1,
    STATE_AT_REST = 1 << 2,
    STATE_REFUSED = 1 << 3,
    STATE_NOISE_OFF = 1 << 4,
    STATE_EXTRAPOLATED = 1 << 5,
    STATE_NOT_IN_ORDER = 1 << 6,
    STATE_YAW_FREE = 1 << 7,
};

enum code {
    CODE_PING = 1,
    CODE_GET_HELLO = 2,
    CODE_KEEP_ALIVE = 3,
    CODE_COUNTERS = 4,
    CODE_CLEAR_COUNTERS = 5,
    CODE_REBOOT = 6,
    CODE_SET_RATE = 16,
    CODE_SET_BAUD = 17,
    CODE_SET_GYRO = 18,
    CODE_SET_ACC_RANGE = 19,
    CODE_BIAS_NULL = 32,
    CODE_SET_BIAS = 33,
    CODE_SET_SCALE = 34,
    CODE_SET_CORRECTION = 35,
    CODE_CORRECTION = 36,
    CODE_GET_CORRECTION = 37,
    CODE_MOTOR_DUTY = 48,
    CODE_MOTOR_PROFILE = 49,
    CODE_MOTOR_LIMITS = 50,
    CODE_ARM = 51,
    CODE_READ_REGISTER = 64,
    CODE_WRITE_REGISTER = 65,
    CODE_SELF_TEST = 66,
    CODE_STORE_CONFIG = 80,
    CODE_LOAD_CONFIG = 81,
    CODE_DEFAULT_CONFIG = 82,
    CODE_SET_BOARD_ID = 83,
};

enum status {
    STATUS_OK,
    STATUS_UNKNOWN_COMMAND,
    STATUS_UNSUPPORTED,
    STATUS_BAD_ARGUMENT,
    STATUS_BUSY,
    STATUS_MOVING,
    STATUS_NOT_ANSWERING,
    STATUS_READ_BACK_WRONG,
    STATUS_SELF_TEST_FAILED,
    STATUS_NO_KEEP_ALIVE,
    STATUS_NOT_STORED,
    STATUS_NO_CONFIG,
    STATUS_ABORTED,
    STATUS_STOPPED,
};

/* Places of the counters in the health frame; those of the axes y and z follow the one of x. */
enum fault {
    FAULT_SPI_STALLED = 0,
    FAULT_GYRO_STALE_X = 1,
    FAULT_GYRO_ERROR_ALARM_X = 4,
    FAULT_GYRO_NOT_ANSWERING_X = 7,
    FAULT_GYRO_REGISTER_MISMATCH_X = 10,
    FAULT_GYRO_SCALE_IMPOSSIBLE_X = 13,
    FAULT_GYRO_RECOVERED_X = 16,
    FAULT_ADC_STALLED = 19,
    FAULT_ACC_AT_RAIL_X = 20,
    FAULT_SUPPLY_OUT_OF_RANGE = 23,
    FAULT_TICK_OVERRUN = 24,
    FAULT_FRAME_DROPPED = 25,
    FAULT_REPORT_DROPPED = 26,
    FAULT_RX_OVERRUN = 27,
    FAULT_RX_FRAMING = 28,
    FAULT_RX_BAD_FRAME = 29,
    FAULT_MOTOR_TIMEOUT = 30,
    FAULT_CONFIG_INVALID = 31,
    FAULT_CONFIG_NOT_STORED = 32,
    FAULT_WATCHDOG_RESET = 33,
    FAULT_BROWN_OUT_RESET = 34,
    FAULT_STACK_LOW = 35,
    FAULTS = 36,
};

struct header {
    uint8_t version;
    uint8_t kind;
};

struct sample {
    struct header header;
    uint16_t seq;
    uint32_t t_ticks;
    int16_t gyro[3];
    int16_t temp[3];
    uint16_t supply;
    uint16_t acc[3];
    int16_t pwm;
    uint16_t flags;
    int32_t rate[3];
};

/* How the board is set, as a hello frame says it and as the EEPROM keeps it. */
struct set_up {
    uint16_t period_ticks;
    uint16_t baud_divisor;
    uint8_t gyro_range;
    uint8_t gyro_filter;
    uint8_t gyro_sample_period;
    uint8_t acc_range;
    uint8_t config_source;
    int32_t bias[3];
    int32_t scale[3];
    uint8_t periods_per_sample;
};

struct hello {
    struct header header;
    uint8_t firmware[3];
    uint16_t board_id;
    uint8_t reset_cause;
    uint16_t restarts;
    uint16_t next_seq;
    uint32_t tick_ns;
    struct set_up set_up;
};

struct health {
    struct header header;
    uint32_t uptime_s;
    uint16_t next_seq;
    uint16_t tick_busy_max;
    uint16_t stack_free;
    uint16_t faults[FAULTS];
};

struct reply {
    struct header header;
    uint16_t number;
    uint8_t command;
    uint8_t status;
    int32_t value;
    int32_t detail[3];
};

struct corrected {
    struct header header;
    uint16_t seq;
    int32_t rate[3];
    int32_t bias[3];
    uint16_t known[3];
    uint16_t correction;
    uint8_t state;
    int32_t attitude[4];
};

struct request {
    struct header header;
    uint16_t number;
    uint8_t command;
    union {
        uint8_t bytes[8];
        uint8_t u8;
        int16_t i16;
        uint16_t u16;
        struct {
            uint16_t period_ticks;
            uint8_t periods_per_sample;
        } rate;
        struct {
            uint8_t range;
            uint8_t filter;
        } gyro;
        struct {
            uint8_t axis;
            int32_t value;
        } axis;
        struct {
            uint8_t row;
            uint8_t bytes[6];
        } row;
        struct {
            uint8_t other;
            uint8_t row;
        } place;
        struct {
            uint8_t shape;
            int16_t amplitude;
            int16_t offset;
            uint16_t period_ms;
            uint8_t cycles;
        } profile;
        struct {
            uint8_t max_duty;
            uint16_t ramp_per_s;
        } limits;
        struct {
            uint8_t gyro;
            uint8_t address;
            uint16_t value;
        } reg;
    };
};

_Static_assert(sizeof(struct sample) == 44, "docs/wire-format.md");
_Static_assert(sizeof(struct hello) == 50, "docs/wire-format.md");
_Static_assert(sizeof(struct health) == 84, "docs/wire-format.md");
_Static_assert(sizeof(struct reply) == 22, "docs/wire-format.md");
_Static_assert(sizeof(struct corrected) == 53, "docs/wire-format.md");
_Static_assert(sizeof(struct request) == 13, "docs/wire-format.md");
