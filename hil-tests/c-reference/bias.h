/* Bias null: the mean of each rate at rest, over N samples, with its standard error. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#define BIAS_MIN_SAMPLES 2
#define BIAS_MAX_SAMPLES 16384

void bias_begin(void);
/* A sample of all axes, counts; false when the stand moves. */
bool bias_take(const int16_t gyro[3]);
uint16_t bias_have(void);
/* Mean of an axis and its standard error, Q16.16 deg/s, by a scale in Q8.24; false when it is that of a rotation. */
bool bias_mean(uint8_t axis, int32_t scale, int32_t *mean, int32_t *error);
