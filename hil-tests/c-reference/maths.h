#pragma once

#include <stdint.h>

/* x y / 2^16, to the nearest. */
int32_t times(int32_t x, int16_t y);
/* x y / 2^32, to the nearest. */
int32_t mul(int32_t x, int32_t y);
/* x y / 2^16, rounded down. */
uint16_t upper(uint16_t x, uint16_t y);
/* The square root, rounded down. */
uint16_t root(uint32_t x);
