/* Sends BYTES bytes by polling, FASTER one before them whose speed changes on its way; UBRR, U2X by the command line; marks port B at each write of UDR. */
#include "mark.h"

volatile uint8_t after_ubrrh, after_ucsrc;

int main(void) {
    DDRB = 0xff;
#ifdef UCSRC_FIRST
    UCSRC = 1 << URSEL | 3 << UCSZ0;
#endif
    UBRRH = (DIVISOR) >> 8;
    UBRRL = (DIVISOR) & 0xff;
    UCSRA = (DOUBLE) << U2X;
    UCSRC = 1 << URSEL | 3 << UCSZ0;
    after_ubrrh = UBRRH;
    __asm__ volatile("in __tmp_reg__, %1\n\tin %0, %1" : "=r"(after_ucsrc) : "I"(_SFR_IO_ADDR(UCSRC)));
    UCSRB = 1 << TXEN;
#ifdef FASTER
    UDR = 0x55;
    for (uint16_t cycles = 0; cycles < 1456 / 4; cycles++) __asm__ volatile("");
    UBRRL = 3;
    while (!(UCSRA & 1 << TXC)) {}
    UCSRA = 1 << TXC;
#endif
    for (uint8_t i = 0; i < BYTES; i++) {
        while (!(UCSRA & 1 << UDRE)) {}
        UDR = i;
        PORTB = i + 1;
    }
    while (!(UCSRA & 1 << TXC)) {}
    PORTB = 0;
    end();
}
