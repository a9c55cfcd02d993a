/* The function of the Rust firmware (src/), in C: see README.md. */
#include <avr/interrupt.h>
#include <avr/wdt.h>

#include "board.h"
#include "console.h"
#include "frame.h"
#include "serial.h"
#include "stand.h"
#include "store.h"
#include "tick.h"

/* Received bytes that are looked at before the next sample and millisecond have their turn. */
#define BYTES_PER_PASS 32

static void take_bytes(void)
{
    for (uint8_t left = BYTES_PER_PASS; left && serial_has_received() && stand_listens(); left--) {
        int16_t byte = serial_receive();
        if (console_takes((uint8_t)byte))
            continue;
        switch (frame_receive((uint8_t)byte)) {
        case RECEIVED_REQUEST:
            stand_on_request(&frame_incoming.request);
            break;
        case RECEIVED_DAMAGED:
            stand_count(FAULT_RX_BAD_FRAME, 1);
            break;
        case RECEIVED_NOTHING:
            break;
        }
    }
}

int main(void)
{
    /* Which of the two clocks have moved since the watchdog was fed. */
    bool ticked = false, passed = false;
    board_start();
    sensors_start();
    stand_boot();
    stand_started(gyro_configure_all(config_sens_avg()));
    tick_start();
    sei();
    for (;;) {
        uint8_t missed;
        const struct raw *raw = tick_take(&missed);
        if (raw) {
            stand_on_sample(raw, missed);
            stand_correct(raw);
            ticked = true;
        } else if (tick_take_passed()) {
            ticked = true;
        }
        take_bytes();
        serial_count_losses();
        if (tick_take_millisecond()) {
            stand_on_millisecond();
            passed = true;
        }
        /* Fed by both clocks, and from here alone: one that stalls is a reset, a main loop that hangs is one, and a reset
         * stops the motor. */
        if (ticked && passed) {
            wdt_reset();
            ticked = passed = false;
        }
        serial_work();
        tick_sleep_until_work(!serial_has_received() || stand_listens());
    }
}
