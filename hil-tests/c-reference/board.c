#include "board.h"

#include <avr/io.h>
#include <avr/wdt.h>
#include <stdlib.h>
#include <util/atomic.h>

#include "serial.h"
#include "tick.h"

#define PAINT 0xc5

extern uint8_t _end; /* of .data, .bss and .noinit, by the linker */

static uint16_t restarts __attribute__((section(".noinit")));
uint16_t board_watchdog_resets __attribute__((section(".noinit")));
uint16_t board_brown_out_resets __attribute__((section(".noinit")));
static uint8_t reset_cause;

/* After the stack pointer is set, before anything is on the stack. */
static void __attribute__((naked, used, section(".init3"))) paint_stack(void)
{
    for (uint8_t *at = &_end; at <= (uint8_t *)RAMEND; at++)
        *at = PAINT;
}

void board_start(void)
{
    PORTD = _BV(PD2); /* the pull-up of the motor's stop */
    DDRD = _BV(PD7) | _BV(PD6);
    reset_cause = MCUCSR & (_BV(PORF) | _BV(EXTRF) | _BV(BORF) | _BV(WDRF) | _BV(JTRF));
    MCUCSR = 0;
    if (reset_cause & _BV(PORF))
        restarts = board_watchdog_resets = board_brown_out_resets = 0;
    else if (restarts != UINT16_MAX)
        restarts++;
    if (reset_cause & _BV(WDRF) && board_watchdog_resets != UINT16_MAX)
        board_watchdog_resets++;
    if (reset_cause & _BV(BORF) && board_brown_out_resets != UINT16_MAX)
        board_brown_out_resets++;
}

uint8_t board_reset_cause(void)
{
    return reset_cause;
}

uint16_t board_restarts(void)
{
    return restarts;
}

uint16_t board_stack_free(void)
{
    const uint8_t *at = &_end;
    while (at <= (uint8_t *)RAMEND && *at == PAINT)
        at++;
    return (uint16_t)(at - &_end);
}

void board_set_motor(int16_t duty)
{
    if (duty == 0) {
        TCCR2 = 0; /* disconnected, so that the pin is low: fast PWM would leave a spike at 0 */
        return;
    }
    if (duty < 0)
        PORTD |= _BV(PD6);
    else
        PORTD &= (uint8_t)~_BV(PD6);
    OCR2 = (uint8_t)abs(duty);
    ATOMIC_BLOCK(ATOMIC_FORCEON) /* not behind the interrupt that cuts it */
    {
        if (tick_host_is_there())
            TCCR2 = _BV(WGM21) | _BV(WGM20) | _BV(COM21) | _BV(CS21); /* fast PWM, clock / 8: 7.8 kHz */
    }
}

void board_reboot(void)
{
    tick_stop();
    while (!serial_is_idle()) /* bounded by the watchdog, still at 1 s */
        ;
    wdt_enable(WDTO_15MS);
    for (;;)
        ;
}
