//! The USART: two rings between its interrupts and the main loop.

use core::ptr::addr_of_mut;

use avr_device::atmega16::USART;
use firmware::Stand;
use heapless::spsc::{Consumer, Producer, Queue};
use wire::Fault;

/// Room for the longest burst of a second: hello or reply, health and two samples.
const TX_LEN: usize = 224;
/// Two requests.
const RX_LEN: usize = 40;
const UDRE: u8 = 1 << 5;
const TXC: u8 = 1 << 6;
const FE: u8 = 1 << 4;
const DOR: u8 = 1 << 3;
const RXCIE: u8 = 1 << 7;
const UDRIE: u8 = 1 << 5;
const RXEN_TXEN: u8 = 1 << 4 | 1 << 3;
/// URSEL, 8 data bits, no parity, 1 stop bit.
const UCSRC_8N1: u8 = 1 << 7 | 3 << 1;

static mut TX: Queue<u8, TX_LEN> = Queue::new();
static mut RX: Queue<u8, RX_LEN> = Queue::new();
static mut TX_IN: Option<Producer<'static, u8>> = None;
static mut TX_OUT: Option<Consumer<'static, u8>> = None;
static mut RX_IN: Option<Producer<'static, u8>> = None;
/// Losses that the interrupts saw: overrun, framing.
static mut LOST: [u8; 2] = [0; 2];

fn usart() -> &'static avr_device::atmega16::usart::RegisterBlock {
    // SAFETY: every access below is a single one, or with its interrupts off.
    unsafe { &*USART::ptr() }
}

/// Sets up the rings and switches the USART on; the interrupts wait for the global enable. Called once.
pub fn start() -> Consumer<'static, u8> {
    // SAFETY: called once, before interrupts are on.
    let received = unsafe {
        let (tx_in, tx_out) = (*addr_of_mut!(TX)).split();
        let (rx_in, rx_out) = (*addr_of_mut!(RX)).split();
        (TX_IN, TX_OUT, RX_IN) = (Some(tx_in), Some(tx_out), Some(rx_in));
        rx_out
    };
    usart().ucsrb.write(|w| bits!(w, RXCIE | RXEN_TXEN));
    received
}

/// Sets the divisor. Order as on silicon: UBRRH (URSEL = 0), UBRRL, UCSRC.
pub fn set_baud(divisor: u16) {
    usart()
        .ubrrh()
        .write(|w| bits!(w, (divisor >> 8) as u8 & 0x0f));
    usart().ubrrl.write(|w| bits!(w, divisor as u8));
    usart().ucsrc().write(|w| bits!(w, UCSRC_8N1));
}

/// Whether no divisor has been set since the reset.
pub fn is_unset() -> bool {
    usart().ubrrl.read().bits() == 0
}

/// Whether bytes wait in the receive ring.
pub fn has_received() -> bool {
    // SAFETY: reads the length only.
    unsafe {
        (*addr_of_mut!(RX_IN))
            .as_ref()
            .is_some_and(|ring| ring.len() > 0)
    }
}

/// Queues all of it or nothing.
pub fn send(frame: &[u8]) -> bool {
    // SAFETY: the producer is the main loop's; the interrupts have the consumer.
    let Some(ring) = (unsafe { &mut *addr_of_mut!(TX_IN) }) else {
        return false;
    };
    if ring.capacity().wrapping_sub(ring.len()) < frame.len() {
        return false;
    }
    for &byte in frame {
        if ring.enqueue(byte).is_err() {
            return false;
        }
    }
    // A single-bit write, which the interrupts cannot split.
    usart().ucsrb.modify(|r, w| bits!(w, r.bits() | UDRIE));
    true
}

/// Whether the last byte has left the shift register.
pub fn is_idle() -> bool {
    // SAFETY: reads the length only.
    let empty = unsafe {
        (*addr_of_mut!(TX_IN))
            .as_ref()
            .is_none_or(|ring| ring.len() == 0)
    };
    empty && usart().ucsra.read().bits() & (UDRE | TXC) == UDRE | TXC
}

/// Hands what the interrupts lost to the counters.
pub fn count_losses(stand: &mut Stand) {
    let lost = avr_device::interrupt::free(|_| {
        // SAFETY: interrupts are off.
        unsafe { core::mem::take(&mut *addr_of_mut!(LOST)) }
    });
    for (&times, fault) in lost.iter().zip([Fault::RxOverrun, Fault::RxFraming]) {
        if times > 0 {
            stand.count(fault, u16::from(times));
        }
    }
}

/// Masks both interrupts of the USART; returns what to hand to [`unmask`].
pub fn mask() -> u8 {
    let was = usart().ucsrb.read().bits();
    usart().ucsrb.write(|w| bits!(w, was & !(RXCIE | UDRIE)));
    was
}

/// Back to what [`mask`] found.
pub fn unmask(was: u8) {
    usart().ucsrb.write(|w| bits!(w, was));
}

#[avr_device::interrupt(atmega16)]
fn USART_UDRE() {
    // SAFETY: the consumer is this interrupt's.
    let next = unsafe { (*addr_of_mut!(TX_OUT)).as_mut().and_then(Consumer::dequeue) };
    match next {
        Some(byte) => {
            usart().ucsra.write(|w| bits!(w, TXC));
            usart().udr.write(|w| bits!(w, byte));
        }
        None => usart().ucsrb.modify(|r, w| bits!(w, r.bits() & !UDRIE)),
    }
}

#[avr_device::interrupt(atmega16)]
fn USART_RXC() {
    // The flags hold for the byte that is read next.
    let status = usart().ucsra.read().bits();
    let byte = usart().udr.read().bits();
    // SAFETY: producer and counts are this interrupt's; the main loop takes the counts with interrupts off.
    unsafe {
        let lost = &mut *addr_of_mut!(LOST);
        if status & FE != 0 {
            lost[1] = lost[1].saturating_add(1);
        }
        let full = (*addr_of_mut!(RX_IN))
            .as_mut()
            .is_none_or(|ring| ring.enqueue(byte).is_err());
        if status & DOR != 0 || full {
            lost[0] = lost[0].saturating_add(1);
        }
    }
}
