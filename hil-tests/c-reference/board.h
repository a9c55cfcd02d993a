/* Motor pins, reset cause, stack. */
#pragma once

#include <stdint.h>

#define FIRMWARE_VERSION 0, 1, 0

/* Why it started, and the motor's pins off. */
void board_start(void);
uint8_t board_reset_cause(void);
/* Resets since power-on. */
uint16_t board_restarts(void);
/* Those by the watchdog and by brown-out, until they are cleared. */
extern uint16_t board_watchdog_resets, board_brown_out_resets;
/* The least stack that was ever left, bytes. */
uint16_t board_stack_free(void);
/* -255..255 */
void board_set_motor(int16_t duty);
/* Resets through the watchdog, once what is queued has gone out. */
void board_reboot(void) __attribute__((noreturn));
