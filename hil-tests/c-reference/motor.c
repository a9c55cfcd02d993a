#include "motor.h"

#include <stdlib.h>

static int16_t target, output_q6, output, max_duty, ramp_q6, amplitude, offset;
/* Rest before it turns the other way, ms. */
#define DEAD_MS 3
static int8_t dead; /* left of it, with the sign of the way that it turned */
static uint32_t phase, phase_per_ms; /* of a period, in 2^-32 */
static uint8_t shape, cycles;

void motor_limit(uint8_t limit, uint16_t ramp_per_s)
{
    motor_cut();
    max_duty = limit;
    /* steps/s to Q6 steps/ms: * 64 / 1000 */
    ramp_q6 = (int16_t)((uint32_t)ramp_per_s * 4194 >> 16);
    if (ramp_q6 == 0)
        ramp_q6 = 1;
}

static int16_t clamp(int16_t value, int16_t limit)
{
    if (value > limit)
        return limit;
    return value < -limit ? (int16_t)-limit : value;
}

static void aim(int16_t duty)
{
    target = clamp(duty, max_duty);
}

int16_t motor_command(int16_t duty)
{
    shape = SHAPE_STOP;
    aim(duty);
    return target;
}

bool motor_profile(uint8_t new_shape, int16_t new_amplitude, int16_t new_offset, uint16_t period_ms,
                   uint8_t new_cycles)
{
    if (new_shape == SHAPE_STOP) {
        motor_command(0);
        return true;
    }
    if (new_shape > SHAPE_SINE || period_ms < 2 || clamp(new_amplitude, MOTOR_FULL) != new_amplitude ||
        clamp(new_offset, MOTOR_FULL) != new_offset)
        return false;
    shape = new_shape;
    cycles = new_cycles;
    amplitude = new_amplitude;
    offset = new_offset;
    phase = 0;
    /* Rounded up, so that the last millisecond of a period completes it. */
    phase_per_ms = UINT32_MAX / period_ms + 1;
    return true;
}

/* The sine of part / 2^16 of a turn, Q14: a parabola over each half turn, once corrected by its own square. */
static int16_t sine_q14(int16_t part)
{
    int32_t x = part;
    int32_t y = x * (32768 - labs(x)) >> 14;
    int32_t square = y * labs(y) >> 14;
    return (int16_t)(y + ((square - y) * 3686 >> 14));
}

static void step_profile(void)
{
    int16_t part = (int16_t)(phase >> 16);
    int16_t height; /* -1 .. 1 in Q14 over the period */
    if (shape == SHAPE_STEPS)
        height = part >= 0 ? 1 << 14 : -(1 << 14);
    else if (shape == SHAPE_TRIANGLE)
        height = (int16_t)((part < 0 ? -(uint16_t)part : (uint16_t)part) - (1 << 14));
    else
        height = sine_q14(part);
    int16_t swing = (int16_t)(((int32_t)amplitude * height + (1 << 13)) >> 14);
    aim((int16_t)(offset + swing));
    uint32_t before = phase;
    phase += phase_per_ms;
    if (phase < before && cycles && --cycles == 0)
        motor_command(0);
}

int16_t motor_output(void)
{
    return output;
}

bool motor_is_on(void)
{
    return output_q6 || target || shape != SHAPE_STOP;
}

void motor_cut(void)
{
    target = output_q6 = output = 0;
    shape = SHAPE_STOP;
}

void motor_on_millisecond(bool on)
{
    /* One that is not on puts nothing out. */
    if (on && output)
        dead = output < 0 ? -DEAD_MS : DEAD_MS;
    else if (dead > 0)
        dead--;
    else if (dead < 0)
        dead++;
    if (!on)
        return;
    if (shape != SHAPE_STOP)
        step_profile();
    output_q6 = (int16_t)(output_q6 + clamp((int16_t)(target * 64 - output_q6), ramp_q6));
    if ((dead > 0 && output_q6 < 0) || (dead < 0 && output_q6 > 0))
        output_q6 = 0;
    output = output_q6 / 64;
}
