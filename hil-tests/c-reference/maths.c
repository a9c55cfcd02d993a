#include "maths.h"

int32_t __attribute__((noinline)) times(int32_t x, int16_t y)
{
    int32_t low = (int32_t)(uint16_t)x * y;
    int32_t high = (int32_t)(int16_t)(x >> 16) * y;
    return (int32_t)((uint32_t)high + (uint32_t)((low + 0x8000) >> 16));
}

int32_t __attribute__((noinline)) mul(int32_t x, int32_t y)
{
    return (int32_t)(((int64_t)x * y + 0x80000000LL) >> 32);
}

uint16_t upper(uint16_t x, uint16_t y)
{
    return (uint16_t)((uint32_t)x * y >> 16);
}

uint16_t root(uint32_t x)
{
    uint16_t result = 0;
    for (uint16_t bit = 0x8000; bit; bit >>= 1) {
        uint16_t tried = result | bit;
        if ((uint32_t)tried * tried <= x)
            result = tried;
    }
    return result;
}
