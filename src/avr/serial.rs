//! The USART: two rings between its interrupts and the main loop.

use core::ptr::{addr_of_mut, read_volatile};

use avr_device::atmega16::USART;
use firmware::Stand;
use wire::Fault;
use wire::fields::{encode_by, room_for};

use super::ring::Ring;

/// Room for a sample, a health frame and the next sample: 190 bytes.
static TX: Tx = Ring::new();
type Tx = Ring<192>;
/// Nearly two requests: what comes while a sample is taken, at 250 kBd.
static RX: Ring<36> = Ring::new();
const UDRE: u8 = 1 << 5;
const TXC: u8 = 1 << 6;
const FE: u8 = 1 << 4;
const DOR: u8 = 1 << 3;
const RXCIE: u8 = 1 << 7;
const UDRIE: u8 = 1 << 5;
const RXEN_TXEN: u8 = 1 << 4 | 1 << 3;
/// URSEL, 8 data bits, no parity, 1 stop bit.
const UCSRC_8N1: u8 = 1 << 7 | 3 << 1;

/// A divisor that waits for the line to be idle, low byte and high byte, which has four bits and [`WAITS`].
static mut NEXT: [u8; 2] = [0; 2];
const WAITS: u8 = 1 << 7;

/// Whether a divisor waits.
fn next_waits() -> bool {
    // SAFETY: the main loop's alone.
    let [_, high] = unsafe { NEXT };
    high != 0
}

/// Losses that the interrupts saw: overrun, framing.
static mut LOST: [u8; 2] = [0; 2];

fn usart() -> &'static avr_device::atmega16::usart::RegisterBlock {
    // SAFETY: every access below is a single one, or with its interrupts off.
    unsafe { &*USART::ptr() }
}

/// The next received byte.
pub fn received() -> Option<u8> {
    RX.pop()
}

/// Sets the divisor as soon as the line is idle. After a reset at once, and switches the USART on; its interrupts wait for the
/// global enable. The first byte is a delimiter: power may have gone in the middle of a frame, and this ends what the host has
/// of it.
#[inline(never)]
pub fn set_baud(divisor: u16) {
    if usart().ucsrb.read().bits() != 0 {
        let [low, high] = divisor.to_le_bytes();
        // SAFETY: the main loop's alone.
        unsafe { NEXT = [low, high | WAITS] };
        return;
    }
    set_divisor(divisor);
    usart().ucsrb.write(|w| bits!(w, RXCIE | RXEN_TXEN));
    usart().udr.write(|w| bits!(w, 0));
}

/// What has to wait for the line to be idle.
pub fn work() {
    if next_waits() && is_idle() {
        // SAFETY: as above. `set_divisor` takes the divisor's twelve bits of it.
        unsafe {
            set_divisor(u16::from_le_bytes(NEXT));
            NEXT[1] = 0;
        }
    }
}

/// Order as on silicon: UBRRH (URSEL = 0), UBRRL, UCSRC.
#[inline(never)]
fn set_divisor(divisor: u16) {
    usart()
        .ubrrh()
        .write(|w| bits!(w, (divisor >> 8) as u8 & 0x0f));
    usart().ubrrl.write(|w| bits!(w, divisor as u8));
    usart().ucsrc().write(|w| bits!(w, UCSRC_8N1));
}

/// Whether bytes wait in the receive ring.
pub fn has_received() -> bool {
    !RX.is_empty()
}

/// Queues a frame, or nothing where there is less room than [`room_for`] says. It is framed where it lies in the ring. While a
/// divisor waits there are replies alone: a line that is too slow for its frames would never fall idle.
#[inline(never)]
pub fn send(kind: u8, fields: &[u8]) -> bool {
    let waits = kind != wire::kind::REPLY && next_waits();
    // A byte holds the room of any frame.
    const { assert!(room_for(wire::kind::HEALTH, wire::MAX_FRAME) < 256) };
    if waits || room() < room_for(kind, fields.len()) as u8 {
        return false;
    }
    let end = encode_by(kind, fields, TX.head(), Tx::after, |at, byte| {
        TX.put(at, byte)
    });
    TX.advance(end);
    begin();
    true
}

/// Bytes that the transmit queue still takes.
#[inline(never)]
pub fn room() -> u8 {
    TX.room()
}

/// Queues a plain byte, for which there is room.
#[inline(never)]
pub fn say(byte: u8) {
    TX.push(byte);
    begin();
}

fn begin() {
    // A single-bit write, which the interrupts cannot split.
    usart().ucsrb.modify(|r, w| bits!(w, r.bits() | UDRIE));
}

/// Whether the last byte has left the shift register.
fn is_idle() -> bool {
    TX.is_empty() && usart().ucsra.read().bits() & (UDRE | TXC) == UDRE | TXC
}

/// Waits until what is queued has gone out. On a line so slow that it takes more than a second the watchdog ends it.
pub fn drain() {
    while !is_idle() {}
}

/// Hands what the interrupts lost to the counters.
pub fn count_losses(stand: &mut Stand) {
    // SAFETY: a byte each; only that it is zero is believed.
    let any = unsafe {
        let lost = addr_of_mut!(LOST).cast::<u8>();
        read_volatile(lost) | read_volatile(lost.wrapping_add(1))
    };
    if any != 0 {
        take_losses(stand);
    }
}

#[inline(never)]
fn take_losses(stand: &mut Stand) {
    let [overrun, framing] = avr_device::interrupt::free(|_| {
        // SAFETY: interrupts are off.
        unsafe { core::mem::take(&mut *addr_of_mut!(LOST)) }
    });
    stand.count(Fault::RxOverrun, overrun);
    stand.count(Fault::RxFraming, framing);
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
    match TX.pop() {
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
            firmware::math::count_up(&mut lost[1]);
        }
        let full = !RX.push(byte);
        if status & DOR != 0 || full {
            firmware::math::count_up(&mut lost[0]);
        }
    }
}
