#include "maths.h"

int32_t scaled(uint16_t counts, int32_t scale_q24)
{
    uint16_t high = (uint16_t)((uint32_t)scale_q24 >> 16), low = (uint16_t)scale_q24;
    return (int32_t)((uint32_t)counts * high + ((uint32_t)counts * low >> 16));
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
