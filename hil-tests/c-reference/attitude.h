/* Attitude by quaternion: w, x, y, z in Q2.30. */
#pragma once

#include <stdint.h>

void attitude_begin(int32_t q[4]);
/* Turns by a rate, Q12.20 deg/s, over so many timer ticks; with acc, counts, a little towards where that is up. */
void attitude_step(int32_t q[4], const int32_t rate[3], uint16_t ticks, const uint16_t *acc);
