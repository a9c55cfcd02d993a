#include "correction.h"

#include <stdlib.h>
#include <string.h>

#include "attitude.h"
#include "frame.h"
#include "maths.h"
#include "store.h"

/* Rest ends here, upper half of Q12.20 deg/s: 4 deg/s. */
#define REST 64
#define BLOCK_SHIFT_MAX 7
/* A block's mean may be off by four sigma, squared. */
#define GATE_SHIFT 4
#define ADAPT_SHIFT 5
/* 1 in Q8, and a fourth and four times that, less 1. */
#define NOISE_TOLD 256
#define NOISE_LEAST (-192)
#define NOISE_MOST 768
#define SQUARE_MAX 0x7fff
/* Variance of a bias that is not known, over that which was told of a block: Q8. */
#define EXPECTED_MOST 0xfbffUL
/* Longest time between samples that the attitude goes on over, timer ticks. */
#define LONGEST_TICKS 25000
/* Bytes of three numbers, as each axis has them in the matrix and for the filter; where those of the filter begin. */
#define OF_AXIS 6
#define OF_FILTER 96

static struct {
    uint16_t at;    /* of the copy in use; 0: none, or off */
    uint8_t newest; /* 1, 2; 0: none */
    uint8_t state;  /* what outlasts a sample */
    uint8_t left;   /* samples until the block ends */
    uint16_t t_ticks;
    uint32_t squares; /* of what is left of all rates in the block, Q16 */
    int32_t speed;    /* of the motor, steps in Q16 */
    struct axis {
        int32_t rate; /* with the model's terms */
        int32_t sum;  /* of what is left of the block's rates */
        int16_t noise; /* over what was told, less 1: Q8 */
        bool trusted; /* the block before was at rest, and not refused */
    } axes[3];
    struct corrected frame;
    bool waits; /* for room */
} now;

/* Where the next stored number is read from, and what they are summed up to. */
static uint16_t reading;
static uint32_t total;

static int16_t next(void)
{
    uint8_t low = eeprom_read(reading++);
    return (int16_t)(low | eeprom_read(reading++) << 8);
}

/* Adds x, Q16, times the next number. */
static void __attribute__((noinline)) weigh(int32_t x)
{
    total += (uint32_t)times(x, next());
}

/* Adds x times the next number. */
static void __attribute__((noinline)) count(int16_t x)
{
    total += (uint32_t)((int32_t)x * next());
}

bool correction_on(void)
{
    memset(&now, 0, sizeof now);
    now.newest = store_newest(CORRECTION_FIRST, CORRECTION_SECOND) & 3;
    if (now.newest)
        now.at = correction_place(false, 0);
    return now.newest;
}

void correction_off(void)
{
    now.at = 0;
}

uint8_t correction_in_use(void)
{
    return now.at ? now.newest : 0;
}

uint16_t correction_place(bool other, uint8_t row)
{
    if (row > CORRECTION_ROWS)
        return 0;
    return ((now.newest == 2) != other ? CORRECTION_SECOND : CORRECTION_FIRST) + row * 6;
}

void correction_read(uint16_t place, int32_t into[3])
{
    reading = place;
    for (uint8_t i = 0; i < 3; i++)
        into[i] = next();
}

bool correction_is_ready(void)
{
    return now.waits = now.at && eeprom_is_ready();
}

bool correction_waits(void)
{
    return now.waits;
}

void correction_tell(void)
{
    now.waits = !frame_send(KIND_CORRECTED, &now.frame, sizeof now.frame);
}

/* The model's terms for each axis. */
static void model(const struct raw *raw, int16_t duty, int8_t lowest, int8_t highest)
{
    for (uint8_t i = 0; i < 3; i++) {
        struct axis *axis = &now.axes[i];
        int16_t temp = (int16_t)(raw->temp[i] << 6) >> 6; /* ten bits */
        int8_t step = (int8_t)(temp >> 2);
        if (step < lowest || step > highest)
            now.frame.state |= STATE_EXTRAPOLATED;
        total = (uint32_t)times(config.set_up.scale[i] << 8, (int16_t)(raw->gyro[i] << 2) >> 2) << 4;
        count(temp);
        weigh((int32_t)temp * temp << 10);
        count(1 << 10);
        count(1);
        count(duty);
        count((int16_t)abs(duty));
        count(duty > 0 ? 1 << 7 : duty < 0 ? -(1 << 7) : 0);
        count((int16_t)(raw->supply[0] & 0x0fff));
        for (uint8_t k = 0; k < 3; k++)
            count((int16_t)raw->acc[k]);
        axis->rate = (int32_t)total;
    }
}

/* The square of a rate below 4 deg/s, Q12.20: Q16, of it to the nearest 2^-8. */
static uint32_t __attribute__((noinline)) square(int32_t x)
{
    int16_t coarse = (int16_t)times(x, 1 << 4);
    return (uint32_t)((int32_t)coarse * coarse);
}

/* The shares of the other axes, the motor's surge and the filter's bias; what is left is summed up at rest. */
static void rest(int32_t ahead)
{
    for (uint8_t i = 0; i < 3; i++) {
        struct axis *axis = &now.axes[i];
        total = (uint32_t)axis->rate - (uint32_t)now.frame.bias[i];
        for (uint8_t k = 0; k < 3; k++)
            weigh(now.axes[k].rate >> 2);
        /* Noise and walk are for the end of the block. */
        reading += OF_AXIS * 2 + 4;
        weigh(ahead);
        reading -= OF_AXIS * 3;
        int32_t left = (int32_t)total;
        now.frame.rate[i] = left;
        int16_t high = (int16_t)(left >> 16);
        if (high >= -REST && high < REST) {
            axis->sum += left;
            now.squares += square(left);
        } else {
            now.state &= (uint8_t)~STATE_AT_REST;
        }
    }
}

/* The attitude: begins anew where the sample before is too long ago, or there is none. */
static void __attribute__((noinline)) turn(const struct raw *raw)
{
    uint16_t t_ticks = (uint16_t)raw->t_ticks, ticks = t_ticks - now.t_ticks;
    now.t_ticks = t_ticks;
    if (!(now.state & STATE_YAW_FREE) || ticks > LONGEST_TICKS) {
        now.state |= STATE_YAW_FREE;
        now.frame.state &= (uint8_t)~STATE_YAW_FREE;
        attitude_begin(now.frame.attitude);
    } else if (now.frame.state & STATE_APPLIED) {
        attitude_step(now.frame.attitude, now.frame.rate, ticks, now.frame.state & STATE_AT_REST ? raw->acc : NULL);
    }
}

static void __attribute__((noinline)) correct(const struct raw *raw, int16_t duty, bool in_order)
{
    now.frame.correction = (uint16_t)next();
    uint8_t shift = next() & BLOCK_SHIFT_MAX;
    now.frame.state = 0;
    if ((uint16_t)next() != config_sens_avg())
        return;
    if (now.left == 0) {
        now.left = (uint8_t)(1 << shift);
        now.state |= STATE_APPLIED | STATE_AT_REST;
    }
    if (!in_order)
        now.frame.state = STATE_NOT_IN_ORDER;
    if (!in_order || duty)
        now.state &= (uint8_t)~STATE_AT_REST;
    uint16_t range = (uint16_t)next();
    int32_t ahead = (int32_t)(((uint32_t)duty << 16) - (uint32_t)now.speed);
    total = (uint32_t)now.speed;
    weigh(ahead << 1);
    now.speed = (int32_t)total;
    model(raw, duty, (int8_t)range, (int8_t)(range >> 8));
    rest(ahead);
    now.frame.state |= now.state;
    now.left--;
}

/* A measurement of the scalar Kalman filter, by the mean of a block; what it has to say of it as bits of the state. */
static uint8_t measure(uint8_t i, int32_t mean, uint16_t told)
{
    struct axis *axis = &now.axes[i];
    /* Q13, whose square is Q26; over Q18 that is Q8. */
    int16_t coarse = (int16_t)(mean >> 7);
    uint32_t over = told ? (uint32_t)((int32_t)coarse * coarse) / told : UINT32_MAX;
    uint16_t seen = over > SQUARE_MAX ? SQUARE_MAX : (uint16_t)over;
    uint16_t noise = (uint16_t)(NOISE_TOLD + axis->noise);
    uint16_t known = now.frame.known[i];
    uint16_t expected = (uint16_t)(EXPECTED_MOST / (known | 1)) + noise;
    bool before = axis->trusted;
    axis->trusted = seen >> GATE_SHIFT <= expected;
    if (!axis->trusted)
        return STATE_REFUSED;
    if (!before)
        return 0;
    uint16_t measured = (uint16_t)(0x10000UL / noise);
    if (__builtin_add_overflow(known, measured, &known))
        known = UINT16_MAX;
    now.frame.known[i] = known;
    now.frame.bias[i] += times(mean << 2, (int16_t)(((uint32_t)measured << 14) / known));
    if (expected > SQUARE_MAX)
        return STATE_FILTERED; /* it knew nothing yet */
    int16_t wanted = axis->noise + (((int16_t)(seen - expected) + (1 << (ADAPT_SHIFT - 1))) >> ADAPT_SHIFT);
    axis->noise = wanted < NOISE_LEAST ? NOISE_LEAST : wanted > NOISE_MOST ? NOISE_MOST : wanted;
    return axis->noise == wanted ? STATE_FILTERED : STATE_FILTERED | STATE_NOISE_OFF;
}

/* Where a block has ended with the sample before, one step of the filter. */
static void __attribute__((noinline)) end_block(void)
{
    if (now.left || !(now.state & STATE_APPLIED))
        return;
    reading = now.at + 4;
    uint8_t shift = next() & BLOCK_SHIFT_MAX;
    /* The mean square about the means, over what it is by what was told: above four times that it is no rest. */
    int32_t spread = (int32_t)now.squares >> shift;
    uint16_t all = 0;
    reading = now.at + OF_FILTER;
    for (uint8_t i = 0; i < 3; i++) {
        now.axes[i].sum >>= shift;
        spread -= (int32_t)square(now.axes[i].sum);
        all += (uint16_t)next() >> 2;
        reading += 4;
    }
    now.squares = 0;
    bool rested = now.state & STATE_AT_REST;
    now.state &= STATE_FILTERED | STATE_YAW_FREE;
    if (rested && spread >> (shift + 2) > all) {
        now.state |= STATE_NOISE_OFF;
        rested = false;
    }
    reading = now.at + OF_FILTER;
    for (uint8_t i = 0; i < 3; i++) {
        uint16_t told = (uint16_t)next(), walk = (uint16_t)next();
        reading += 2;
        uint16_t known = now.frame.known[i];
        now.frame.known[i] -= upper(upper(known, walk), known);
        if (rested)
            now.state |= measure(i, now.axes[i].sum, told);
        else
            now.axes[i].trusted = false;
        now.axes[i].sum = 0;
    }
}

void correction_step(const struct raw *raw, uint16_t seq, int16_t duty, bool in_order)
{
    end_block();
    reading = now.at + 2;
    now.frame.seq = seq;
    correct(raw, duty, in_order);
    turn(raw);
}
