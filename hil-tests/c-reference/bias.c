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
    uint32_t steps;   /* of their magnitudes, from block to block */
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
    if (blocks)
        axis->steps += (uint16_t)abs(axis->part - axis->last);
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

/* sqrt(pi)/2 in Q10 times the mean magnitude of the steps over b sqrt(k): counts in Q10, times the scale: Q16.16. */
static int32_t error_of(uint32_t steps, int32_t scale)
{
    uint32_t step = steps * 907 / (uint16_t)(block * (blocks - 1));
    return times(scale, (int16_t)((step << 8) / root((uint32_t)blocks << 16))) >> 2;
}

bool bias_mean(uint8_t axis, int32_t scale, int32_t *mean, int32_t *error)
{
    const struct axis_sum *sum = &sums[axis];
    /* Of offsets above -60: nothing has a sign. */
    uint32_t above = (uint32_t)sum->sum + (uint32_t)have * SPREAD_AT_REST;
    int16_t mean_q8 = (int16_t)(((uint16_t)(sum->first - SPREAD_AT_REST) << 8) + (uint16_t)((above << 8) / have));
    if (abs(sum->first) >= LARGEST_BIAS + SPREAD_AT_REST || abs(mean_q8) >= LARGEST_BIAS << 8)
        return false;
    *mean = times(scale, mean_q8);
    *error = error_of(sum->steps, scale);
    return true;
}
