/* Bias null: the mean of each rate at rest, with the standard error it reached. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

enum bias_outcome { BIAS_GOES_ON, BIAS_DONE, BIAS_MOVING, BIAS_NOT_IN_ORDER };

/* Begins one of gyros with a filter of 2^filter taps; false for fewer than eight blocks, or too many samples. */
bool bias_begin(uint16_t samples, uint8_t filter, uint16_t period_ticks);
/* Takes a sample, if it is in order. */
enum bias_outcome bias_take(const int16_t gyro[3], bool in_order);
/* Q16.16 deg/s, by a scale in Q8.24 deg/s for each count; false for a stand that turns. */
bool bias_mean(uint8_t axis, int32_t scale, int32_t *mean, int32_t *error);
