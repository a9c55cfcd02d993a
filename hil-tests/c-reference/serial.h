/* The USART: two rings between its interrupts and the main loop. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

/* A sample, a health frame and the next sample: 190 bytes; three requests. A ring holds one less than it has. */
#define TX_BYTES 192
#define RX_BYTES 36

struct tx {
    volatile uint8_t head;
    volatile uint8_t tail;
    uint8_t bytes[TX_BYTES];
};
extern struct tx serial_tx;

void serial_set_baud(uint16_t divisor);
/* Sets it once all that is queued has gone out; at once, and switches the USART on, where it is off since the reset. */
void serial_set_baud_later(uint16_t divisor);
/* Sets the divisor that waits, if the line is idle. */
void serial_work(void);

/* Whether a divisor waits: frames but replies wait too, or a line that is too slow for them would never fall idle. */
bool serial_is_to_change(void);

/* Whether the last byte has left the shift register. */
bool serial_is_idle(void);
bool serial_has_received(void);
/* The next received byte, or -1. */
int16_t serial_receive(void);
/* Hands the losses that the interrupts saw to the counters. */
void serial_count_losses(void);

/* Keeps both interrupts off the sampling instant; unmask brings back what mask returned. */
uint8_t serial_mask(void);
void serial_unmask(uint8_t was);

/* The transmit ring, for the one that writes frames into it. */
static inline uint8_t serial_after(uint8_t at)
{
    return at == TX_BYTES - 1 ? 0 : (uint8_t)(at + 1);
}

static inline uint8_t serial_head(void)
{
    return serial_tx.head;
}

static inline void serial_put(uint8_t at, uint8_t byte)
{
    serial_tx.bytes[at] = byte;
}

uint8_t serial_room(void);
void serial_publish(uint8_t head);
