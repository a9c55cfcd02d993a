#include "bias.h"

#include <stdlib.h>
#include <string.h>

#include "maths.h"

/* Largest max - min of a rate at rest, counts. */
#define SPREAD_AT_REST 60
/* Largest mean that can be a bias, counts: 5 deg/s. */
#define LARGEST_BIAS 68
#define MIN_BLOCKS 8
#define MAX_SAMPLES 16384
/* Samples in a row that are not in order, after which a measurement is given up. */
#define PATIENCE 16
/* A block without a filter, timer ticks: eight of the gyro's samples; 2^m times as long for a filter of 2^m taps. */
#define BLOCK_TICKS 7813UL

/* The error of the mean comes from the steps between sums of blocks: single samples are alike through the gyro's filter. */
static uint16_t wanted, have, block, in_block, blocks;
static uint8_t lost;
static struct axis_sum {
    int32_t sum;      /* of the offsets from the first reading */
    uint32_t squares; /* of the steps from block to block; saturates */
    int16_t first, part, last;
    int8_t low, high;
} sums[3];

bool bias_begin(uint16_t samples, uint8_t filter, uint16_t period_ticks)
{
    memset(sums, 0, sizeof sums);
    have = in_block = blocks = 0;
    lost = 0;
    wanted = samples;
    block = (uint16_t)((BLOCK_TICKS << filter) / period_ticks) + 1;
    return samples >= block * MIN_BLOCKS && samples <= MAX_SAMPLES;
}

static bool take(struct axis_sum *axis, int16_t value)
{
    if (have == 1)
        axis->first = value;
    int16_t offset = (int16_t)(value - axis->first);
    if (abs(offset) > SPREAD_AT_REST)
        return false;
    axis->sum += offset;
    axis->part += offset;
    if (offset < axis->low)
        axis->low = (int8_t)offset;
    if (offset > axis->high)
        axis->high = (int8_t)offset;
    return axis->high - axis->low <= SPREAD_AT_REST;
}

static void end_block(struct axis_sum *axis)
{
    if (blocks) {
        uint16_t step = (uint16_t)abs(axis->part - axis->last);
        if (__builtin_add_overflow(axis->squares, (uint32_t)step * step, &axis->squares))
            axis->squares = UINT32_MAX;
    }
    axis->last = axis->part;
    axis->part = 0;
}

enum bias_outcome bias_take(const int16_t gyro[3], bool in_order)
{
    if (!in_order)
        return ++lost >= PATIENCE ? BIAS_NOT_IN_ORDER : BIAS_GOES_ON;
    bool resting = true;
    lost = 0;
    have++;
    bool ends = ++in_block >= block;
    for (struct axis_sum *axis = sums; axis < sums + 3; axis++) {
        if (!take(axis, *gyro++))
            resting = false;
        if (ends)
            end_block(axis);
    }
    if (ends) {
        in_block = 0;
        blocks++;
    }
    return !resting ? BIAS_MOVING : have >= wanted ? BIAS_DONE : BIAS_GOES_ON;
}

/* sqrt(2 squares) / (b (2 k - 1)) counts, Q10, times the scale: Q16.16. */
static int32_t error_of(uint32_t squares, int32_t scale)
{
    uint32_t twice = squares;
    uint8_t place = 0;
    if (__builtin_add_overflow(twice, twice, &twice))
        twice = UINT32_MAX;
    for (; twice >> 30 == 0 && place < 10; place++)
        twice <<= 2;
    uint32_t error = (uint32_t)root(twice) << (10 - place);
    return scaled((uint16_t)(error / (uint16_t)(block * (2 * blocks - 1))), scale) >> 2;
}

bool bias_mean(uint8_t axis, int32_t scale, int32_t *mean, int32_t *error)
{
    const struct axis_sum *sum = &sums[axis];
    int32_t part = (int32_t)(((uint32_t)labs(sum->sum) << 8) / have);
    int32_t mean_q8 = ((int32_t)sum->first << 8) + (sum->sum < 0 ? -part : part);
    uint32_t magnitude = (uint32_t)labs(mean_q8);
    if (magnitude >= (uint32_t)LARGEST_BIAS << 8)
        return false;
    int32_t value = scaled((uint16_t)magnitude, scale);
    *mean = mean_q8 < 0 ? -value : value;
    *error = error_of(sum->squares, scale);
    return true;
}
