/* What the board is set to, and its two copies in EEPROM, of which the older one is overwritten. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "wire.h"

/* Where the set-up comes from; the second copy is one more than the first. */
enum source { SOURCE_BUILT_IN, SOURCE_STORED, SOURCE_SET = 3 };

struct config {
    struct set_up set_up;
    uint16_t board_id;
    uint16_t ramp_per_s;
    uint8_t max_duty;
};
extern struct config config;

void config_set_default(void);
/* The nominal scale of the range. */
void config_set_scale_of_range(void);
uint16_t config_sens_avg(void);
bool config_rate_in_order(uint16_t period_ticks, uint8_t periods_per_sample);
bool config_baud_in_order(uint16_t divisor);
bool config_gyro_in_order(uint8_t range, uint8_t filter);
bool config_scale_in_order(int32_t scale);
bool config_bias_in_order(int32_t bias);

uint8_t eeprom_read(uint16_t address);
bool eeprom_is_ready(void);
/* Which of two copies is the newest that is whole: 1, 2, or 0 for neither; four more for each that is spoilt. */
uint8_t store_newest(uint16_t first, uint16_t second);

/* Whether nothing is being written. */
bool store_is_idle(void);
/* Takes the newer of the two copies that are in order; false when neither is. Not while one is written. */
bool store_load(void);
/* Starts to write the set-up; false while something is under way. */
bool store_begin(void);
/* Starts to write a row of a correction; not while something is under way. */
void store_begin_row(uint16_t place, const uint8_t bytes[6]);
/* A millisecond has passed: STATUS_OK or STATUS_NOT_STORED when that was the end, else STORE_GOES_ON. */
#define STORE_GOES_ON 0xff
uint8_t store_step(void);
