#include "bias.h"

#include <stdlib.h>

#include "maths.h"

/* Largest max - min of a rate at rest, counts. */
#define SPREAD_AT_REST 60
/* Largest mean that can be a bias, counts: 5 deg/s. */
#define LARGEST_BIAS 68

static uint16_t have;
static struct axis_sum {
    int32_t sum;
    uint32_t steps; /* sum of the squared steps from sample to sample */
    int16_t last, low, high;
} sums[3];

void bias_begin(void)
{
    have = 0;
}

uint16_t bias_have(void)
{
    return have;
}

bool bias_take(const int16_t gyro[3])
{
    bool resting = true;
    struct axis_sum *axis = sums;
    for (uint8_t left = 3; left; left--, axis++) {
        int16_t value = *gyro++;
        if (have == 0) {
            axis->sum = 0;
            axis->steps = 0;
            axis->last = axis->low = axis->high = value;
        }
        int16_t step = (int16_t)(value - axis->last);
        axis->last = value;
        axis->sum += value;
        if (value < axis->low)
            axis->low = value;
        if (value > axis->high)
            axis->high = value;
        if (axis->high - axis->low > SPREAD_AT_REST)
            resting = false;
        else
            axis->steps += (uint16_t)(step * step); /* at most 3600 * 16384 in all */
    }
    have++;
    return resting;
}

bool bias_mean(uint8_t axis, int32_t scale, int32_t *mean, int32_t *error)
{
    const struct axis_sum *sum = &sums[axis];
    uint32_t magnitude = (uint32_t)labs(sum->sum);
    if (magnitude / have >= LARGEST_BIAS)
        return false;
    int32_t value = scaled((uint16_t)((magnitude << 8) / have), scale);
    *mean = sum->sum < 0 ? -value : value;
    /* White noise: half the mean square of the steps, Q6, is the variance; a further division by n, in Q20, the mean's. */
    uint32_t square_q6 = (sum->steps << 6) / (uint16_t)(have - 1);
    *error = scaled(root((square_q6 << 13) / have), scale) >> 2;
    return true;
}
