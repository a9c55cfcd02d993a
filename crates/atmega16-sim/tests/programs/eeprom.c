/* A byte written and read; EEWE without EEMWE; EEWE too late. */
#include "mark.h"

volatile uint8_t busy, read_back, unarmed, late, before;

static void put(uint16_t at, uint8_t value) {
    EEAR = at;
    EEDR = value;
    EECR = 1 << EEMWE;
    EECR = 1 << EEMWE | 1 << EEWE;
}

static uint8_t get(uint16_t at) {
    EEAR = at;
    EECR = 1 << EERE;
    return EEDR;
}

int main(void) {
    DDRB = 0xff;
    before = get(5);
    put(0x1ff, 0x42);
    MARK(1);
    busy = EECR & 1 << EEWE;
    while (EECR & 1 << EEWE) {}
    MARK(2);
    read_back = get(0x1ff);
    EEAR = 7;
    EEDR = 1;
    EECR = 1 << EEWE;
    unarmed = EECR & 1 << EEWE;
    EECR = 1 << EEMWE;
    __asm__ volatile("nop\n\tnop\n\tnop\n\tnop\n\tnop");
    EECR = 1 << EEMWE | 1 << EEWE;
    late = EECR & 1 << EEWE;
    MARK(3);
    EEAR = 9;
    __asm__ volatile("out 0x18, %0\n\tsbi 0x1c, 0\n\tout 0x18, %1" ::"r"((uint8_t)4), "r"((uint8_t)5));
    put(6, 0x55);
    MARK(6);
    for (;;) {}
}
