/* SPI with three chip selects, and the ADC. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

/* What a tick delivered, as it came. */
struct raw {
    uint32_t t_ticks;
    uint16_t gyro[3];
    uint16_t temp[3];
    uint16_t supply[3];
    uint16_t acc[3];
    uint8_t spi_stalled; /* bit per axis: an SPI frame did not end */
    uint8_t adc_stalled; /* bit per axis: a conversion did not end */
};

/* Sets up SPI, ADC and pins, and waits until the gyros have started. */
void sensors_start(void);
/* One sample. The first thing it does is to start the ADC, the second is the first SPI frame; calls sampled() after
 * the first round over the gyros, when interruptions do no harm any more. */
void sensors_acquire(struct raw *raw, void (*sampled)(void));
/* A frame to a gyro: sends a command, brings the reply to the one before; false when a byte does not end. */
bool sensors_exchange(uint8_t axis, uint8_t address, uint8_t value, uint16_t *reply);
/* SPI at 1 MHz, which a gyro of any sample period stands, or at the sampling's own clock. */
void sensors_slow(bool slow);
/* g-select: 0..3 for 1.5, 2, 4, 6 g. */
void sensors_set_acc_range(uint8_t range);
