/* The motor's command: never faster than its limits, never a jump. That it is off unless the PC is there is tick.c's part. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#define MOTOR_FULL 255
#define MOTOR_DEFAULT_RAMP_PER_S 510

enum shape { SHAPE_STOP, SHAPE_STEPS, SHAPE_TRIANGLE, SHAPE_SINE };

/* Brings it to rest at once and sets its limits. */
void motor_limit(uint8_t max_duty, uint16_t ramp_per_s);
/* A new command, which ends a profile; returns the one that holds after the limits. */
int16_t motor_command(int16_t duty);
/* A new profile; false, and nothing changed, when an argument is out of range. */
bool motor_profile(uint8_t shape, int16_t amplitude, int16_t offset, uint16_t period_ms, uint8_t cycles);
/* Put out now, -255..255. */
int16_t motor_output(void);
bool motor_is_on(void);
void motor_cut(void);
/* A millisecond has passed. */
void motor_on_millisecond(bool on);
