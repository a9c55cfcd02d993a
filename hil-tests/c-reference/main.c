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

int main(void)
{
    board_start();
    serial_start();
    sensors_start();
    stand_boot();
    stand_started(gyro_configure(config_sens_avg()));
    tick_start();
    sei();
    for (;;) {
        uint8_t missed;
        const struct raw *raw = tick_take(&missed);
        if (raw) {
            stand_on_sample(raw, missed);
            /* Fed by the sample clock alone, and from here: a tick that stalls is a reset, a main loop that hangs is one,
             * and a reset stops the motor. */
            wdt_reset();
        } else if (tick_take_passed()) {
            wdt_reset();
        }
        for (int16_t byte; (byte = serial_receive()) >= 0;) {
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
        serial_count_losses();
        if (tick_take_millisecond())
            stand_on_millisecond();
        serial_work();
        tick_sleep_until_work();
    }
}
