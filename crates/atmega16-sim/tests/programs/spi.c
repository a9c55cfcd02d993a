/* Bytes at each divisor; a write too early; SS pulled low. */
#include "mark.h"

volatile uint8_t answer, collided, after_read, lost_master, control;

static uint8_t byte(uint8_t out) {
    SPDR = out;
    MARK(1);
    while (!(SPSR & 1 << SPIF)) {}
    MARK(2);
    return SPDR;
}

int main(void) {
    DDRB = 1 << 4 | 1 << 5 | 1 << 7;
    for (uint8_t divisor = 0; divisor < 8; divisor++) {
        SPSR = divisor >> 2;
        SPCR = 1 << SPE | 1 << MSTR | (divisor & 3);
        answer = byte(0x5a);
    }
    SPCR = 1 << SPE | 1 << MSTR | 1 << DORD;
    byte(0x01);
    SPDR = 0x10;
    SPDR = 0x20;
    collided = SPSR & 1 << WCOL;
    while (!(SPSR & 1 << SPIF)) {}
    after_read = SPDR;
    after_read = SPSR;
    /* SS an input; the test pulls it low from here on. */
    DDRB = 1 << 5 | 1 << 7;
    MARK(3);
    for (volatile uint8_t i = 0; i < 200; i++) {}
    control = SPCR;
    lost_master = SPSR & 1 << SPIF;
    end();
}
