/* PINx is read only; pull-ups; what the outside drives. */
#include "mark.h"

volatile uint8_t toggled, pulled, driven;

int main(void) {
    DDRC = 0x0f;
    PORTC = 0x35;
    PINC = 0xff;
    toggled = PORTC;
    __asm__ volatile("sbi %0, 1" ::"I"(_SFR_IO_ADDR(PINC)));
    toggled |= PORTC;
    pulled = PINC;
    DDRA = 0;
    driven = PINA;
    end();
}
