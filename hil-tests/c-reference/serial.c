#include "serial.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <util/atomic.h>

#include "stand.h"

struct tx serial_tx;
static volatile uint8_t rx[RX_BYTES];
static volatile uint8_t rx_head, rx_tail;
static volatile uint8_t lost_overrun, lost_framing;
static uint16_t waiting_divisor;
static bool waiting;

void serial_set_baud(uint16_t divisor)
{
    /* UBRRH and UCSRC share an address; URSEL says which. */
    UBRRH = (uint8_t)(divisor >> 8) & 0x0f;
    UBRRL = (uint8_t)divisor;
    UCSRC = _BV(URSEL) | _BV(UCSZ1) | _BV(UCSZ0);
}

void serial_set_baud_later(uint16_t divisor)
{
    if (UCSRB == 0) { /* off since the reset */
        serial_set_baud(divisor);
        UCSRB = _BV(RXCIE) | _BV(RXEN) | _BV(TXEN);
        UDR = 0; /* ends a frame that power went in the middle of */
        return;
    }
    waiting_divisor = divisor;
    waiting = true;
}

bool serial_is_idle(void)
{
    return serial_tx.head == serial_tx.tail && (~UCSRA & (_BV(UDRE) | _BV(TXC))) == 0;
}

void serial_work(void)
{
    if (waiting && serial_is_idle()) {
        serial_set_baud(waiting_divisor);
        waiting = false;
    }
}

bool serial_is_to_change(void)
{
    return waiting;
}

bool serial_has_received(void)
{
    return rx_head != rx_tail;
}

int16_t serial_receive(void)
{
    uint8_t tail = rx_tail;
    if (rx_head == tail)
        return -1;
    uint8_t byte = rx[tail];
    rx_tail = (uint8_t)(tail + 1) % RX_BYTES;
    return byte;
}

void serial_count_losses(void)
{
    uint8_t overrun, framing;
    if (!(lost_overrun | lost_framing))
        return;
    ATOMIC_BLOCK(ATOMIC_FORCEON)
    {
        overrun = lost_overrun;
        framing = lost_framing;
        lost_overrun = lost_framing = 0;
    }
    stand_count(FAULT_RX_OVERRUN, overrun);
    stand_count(FAULT_RX_FRAMING, framing);
}

uint8_t serial_mask(void)
{
    uint8_t was = UCSRB;
    UCSRB = was & (uint8_t) ~(_BV(RXCIE) | _BV(UDRIE));
    return was;
}

void serial_unmask(uint8_t was)
{
    UCSRB = was;
}

uint8_t serial_room(void)
{
    uint8_t head = serial_tx.head, tail = serial_tx.tail;
    uint8_t used = (uint8_t)(head - tail);
    if (head < tail)
        used = (uint8_t)(used + TX_BYTES);
    return (uint8_t)(TX_BYTES - 1 - used);
}

void serial_publish(uint8_t head)
{
    /* The bytes have to be in the ring before the interrupt may read them. */
    __asm__ volatile("" ::: "memory");
    serial_tx.head = head;
    UCSRB |= _BV(UDRIE); /* a single sbi: the interrupts cannot split it */
}

ISR(USART_UDRE_vect)
{
    uint8_t tail = serial_tx.tail;
    if (tail == serial_tx.head) {
        UCSRB &= (uint8_t)~_BV(UDRIE);
        return;
    }
    UCSRA = _BV(TXC); /* so that it tells of the end of this byte */
    UDR = serial_tx.bytes[tail];
    serial_tx.tail = serial_after(tail);
}

ISR(USART_RXC_vect)
{
    uint8_t status = UCSRA; /* holds for the byte that is read next */
    uint8_t byte = UDR;
    uint8_t next = (uint8_t)(rx_head + 1) % RX_BYTES;
    bool full = next == rx_tail;
    if (!full) {
        rx[rx_head] = byte;
        rx_head = next;
    }
    if ((status & _BV(FE)) && lost_framing != UINT8_MAX)
        lost_framing++;
    if ((full || (status & _BV(DOR))) && lost_overrun != UINT8_MAX)
        lost_overrun++;
}
