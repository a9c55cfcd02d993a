/* Counts its starts and keeps each reset's flags; the watchdog bites in the first. */
#include "mark.h"
#include <avr/wdt.h>

uint8_t starts __attribute__((section(".noinit")));
uint8_t causes[8] __attribute__((section(".noinit")));
uint8_t control[8] __attribute__((section(".noinit")));
volatile uint8_t zeroed;

int main(void) {
    uint8_t cause = MCUCSR;
    if (cause & 1 << PORF) starts = 0;
    causes[starts & 7] = cause;
    control[starts & 7] = WDTCR;
    MCUCSR = 0;
    DDRB = 0xff;
    MARK(++starts);
    zeroed++;
#ifdef WATCHDOG
    if (starts < 3) {
        wdt_enable(WATCHDOG);
        MARK(0x80);
#ifdef FED
        for (uint16_t i = 0; i < 10000; i++) {
            wdt_reset();
            for (volatile uint8_t k = 0; k < 5; k++) {}
        }
        wdt_reset();
        MARK(0x81);
#endif
#ifdef STOP_WRONG
        WDTCR = 0;
#endif
        for (;;) {}
    }
#endif
    end();
}
