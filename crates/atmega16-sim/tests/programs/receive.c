/* Receives: waits DELAY milliseconds, then keeps each byte with its status. */
#include "mark.h"

volatile uint8_t bytes[16], status[16], taken;

int main(void) {
    DDRB = 0xff;
    UBRRH = 0;
    UBRRL = 25;
    UCSRC = 1 << URSEL | 3 << UCSZ0;
    UCSRB = 1 << RXEN;
    MARK(1);
    for (uint16_t ms = 0; ms < DELAY; ms++) {
        for (uint16_t i = 0; i < 4000; i++) __asm__ volatile("");
    }
    for (uint32_t idle = 0; idle < 20000 && taken < 16; idle++) {
        uint8_t now = UCSRA;
        if (now & 1 << RXC) {
            status[taken] = now & (1 << FE | 1 << DOR);
            bytes[taken++] = UDR;
            MARK(2 + taken);
        }
    }
    end();
}
