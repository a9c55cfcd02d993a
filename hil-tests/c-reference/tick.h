/* The sample clock: the sampling instant is moved by nothing else that goes on. */
#pragma once

#include <avr/io.h>
#include <stdbool.h>
#include <stdint.h>

#include "gyro.h"
#include "sensors.h"

/* Starts both timers and the watchdog; once, with interrupts off. */
void tick_start(void);
/* Stops both: no more samples. */
void tick_stop(void);
/* The period of the timer, and that every n-th has a sample: from the next sample on. */
void tick_set_period(uint16_t ticks, uint8_t every);
/* The sample that waits, or NULL; it is the caller's until the next call. Ticks lost before it go to missed. */
const struct raw *tick_take(uint8_t *missed);
/* Whether a millisecond has passed that nobody has taken yet. */
bool tick_take_passed(void);
bool tick_take_millisecond(void);
/* Timer ticks since the tick. */
uint16_t tick_since(void);
/* Work on the gyros for the slot after the next sample; false while some waits or is not yet fetched. */
bool tick_post(uint8_t what, uint8_t axis, uint8_t address, uint16_t value);
/* The work that is done, or NULL; fetched once. */
const struct gyro_job *tick_fetch_done(void);
/* Sleeps until the next interrupt, unless something waits already; received bytes count where somebody listens. */
void tick_sleep_until_work(bool listens);
/* The host is there: the motor may turn for 200 ms, then the millisecond's interrupt cuts it; its stop does at once. */
void tick_keep_alive(void);
bool tick_host_is_there(void);
/* Cuts the motor where its stop was pressed while INT0 is masked, which GIFR notes: three cycles either way. */
static inline void tick_cut_if_pressed(void)
{
    uint8_t seen;
    __asm__ volatile("in %0, %1\n\tsbrc %0, %2\n\tout %3, __zero_reg__"
                     : "=r"(seen)
                     : "I"(_SFR_IO_ADDR(GIFR)), "I"(INTF0), "I"(_SFR_IO_ADDR(TCCR2)));
}
/* Whether the motor's stop (PD2, low) is pressed, or was since tick_forget_stop. */
bool tick_is_stopped(void);
void tick_forget_stop(void);
