#pragma once

#include <stdint.h>

/* Counts with f fractional bits times a Q8.24 scale below 0.5: the product with f + 8 fractional bits. */
int32_t scaled(uint16_t counts, int32_t scale_q24);
/* The square root, rounded down. */
uint16_t root(uint32_t x);
