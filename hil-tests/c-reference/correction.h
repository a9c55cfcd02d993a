/* The correction of the rates, its bias filter and the attitude: docs/wire-format.md, "Corrected". */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "sensors.h"
#include "wire.h"

#define CORRECTION_FORMAT 2
#define CORRECTION_BYTES 118
#define CORRECTION_ROWS 19
/* Where the two copies begin, behind those of the set-up. */
#define CORRECTION_FIRST 144
#define CORRECTION_SECOND 272

/* Puts the newest copy that is whole in use, the filter started anew; false where none is. */
bool correction_on(void);
void correction_off(void);
/* Number of the copy in use, 1 or 2; 0: none. */
uint8_t correction_in_use(void);
/* Where a row of the newest copy begins, or of the other one; 0 where there is no such row. */
uint16_t correction_place(bool other, uint8_t row);
/* The three numbers there. */
void correction_read(uint16_t place, int32_t into[3]);
/* Whether a sample is corrected now; the frame of the one before waits no longer. */
bool correction_is_ready(void);
/* Corrects the sample of this number. */
void correction_step(const struct raw *raw, uint16_t seq, int16_t duty, bool in_order);
/* Whether a frame waits for room, and sends it. */
bool correction_waits(void);
void correction_tell(void);
