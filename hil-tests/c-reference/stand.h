/* The work below the tick: scaling, framing, counting, answering. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "sensors.h"
#include "wire.h"

/* Reads the stored set-up and applies it. */
void stand_boot(void);
/* What gyro_configure_all returned at start; says hello. */
void stand_started(uint8_t misconfigured);
void stand_on_sample(const struct raw *raw, uint8_t missed);
/* Corrects the sample before, where a correction is in use. */
void stand_correct(const struct raw *raw);
void stand_on_millisecond(void);
void stand_on_request(const struct request *request);
/* Whether there is room for the reply that the next received byte may bring: until then the bytes wait, so that no request
 * takes the room of a sample, or of a report that is late. */
bool stand_listens(void);
/* Counts a fault so many times more. */
void stand_count(uint8_t fault, uint8_t times);
/* Counts a fault for each axis that has its bit set; fault is that of x. */
void stand_count_each(uint8_t fault, uint8_t axes);

/* Between stand.c and requests.c. */

/* A request that is answered when it is done; code 0: none. */
struct pending {
    uint8_t code;
    uint16_t number;
};
/* What the board does unasked, and nobody is told of. */
#define CODE_OWN 0xff

extern struct pending stand_job, stand_null;
/* What the next reply says beside its status. */
extern struct reply stand_answer;
/* Bit per axis: not set up as the hello frame says. */
extern uint8_t stand_misconfigured;
/* Bit per axis: a register was written by hand since it was set up. */
extern uint8_t stand_touched;

/* Sends what is owed, and more, as far as there is room; counters are cleared once they have been told. */
void stand_tell(uint8_t more);
enum { OWED_HELLO = 1, OWED_HEALTH = 2, OWED_CLEAR = 4 };
/* Where the host fell silent the motor has been cut: its command ends with it. */
bool stand_miss_host(void);
/* Applies the set-up to motor, clock, line and sensors. */
void stand_apply(void);
/* What has come of setting up the gyros that have their bit in axes. */
void stand_note_configured(uint8_t axes, uint8_t wrong);
/* Has a gyro set up in the next slot. */
bool stand_configure(uint8_t axis);
/* The reply to the bias measurement that is under way, if one is. */
void stand_end_bias_null(uint8_t status);
/* The gyro that is being set up; SET: none. */
#define SET 3
extern uint8_t stand_setting;
/* What the sensors' noise has come to. */
extern uint32_t stand_noise;
/* The one reply to a request. */
void stand_reply(uint8_t code, uint16_t number, uint8_t status);
/* The same for one that was pending, and is no more. */
void stand_reply_pending(struct pending *pending, uint8_t status);
void requests_on_sample(void);
void requests_on_millisecond(void);
