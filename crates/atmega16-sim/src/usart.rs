//! The USART, asynchronous, 8N1: transmitter with its buffer, receiver that samples the line, buffer of two and the
//! shift register.

use std::collections::VecDeque;

use crate::timer::Unmodelled;

const RXC: u8 = 1 << 7;
const TXC: u8 = 1 << 6;
const UDRE: u8 = 1 << 5;
const FE: u8 = 1 << 4;
const DOR: u8 = 1 << 3;
const U2X: u8 = 1 << 1;
const RXCIE: u8 = 1 << 7;
const TXCIE: u8 = 1 << 6;
const UDRIE: u8 = 1 << 5;
const RXEN: u8 = 1 << 4;
const TXEN: u8 = 1 << 3;
const UCSZ2: u8 = 1 << 2;
const URSEL: u8 = 1 << 7;
const USBS: u8 = 1 << 3;
const RESET_C: u8 = 0x86;
/// The receiver has a byte in the middle of the stop bit: after its tenth sixteenth.
const STOP_SAMPLE: f64 = 9.0 + 10.0 / 16.0;

/// The line from the host: characters of ten bits, start bit first, each from a time on.
#[derive(Clone, Debug, Default)]
struct Line {
    chars: VecDeque<Char>,
    free: f64,
}

#[derive(Clone, Copy, Debug)]
struct Char {
    start: f64,
    bit: f64,
    bits: u16,
}

impl Char {
    fn end(&self) -> f64 {
        self.start + 10.0 * self.bit
    }
}

impl Line {
    fn is_high(&self, at: f64) -> bool {
        let on = self.chars.iter().find(|c| c.start <= at && at < c.end());
        on.is_none_or(|c| c.bits >> (((at - c.start) / c.bit) as u32).min(9) & 1 == 1)
    }

    /// The first fall of the line at or after `from`.
    fn fall(&self, from: f64) -> Option<f64> {
        for c in &self.chars {
            if c.end() <= from {
                continue;
            }
            for bit in 0..10 {
                let at = c.start + f64::from(bit) * c.bit;
                let before = if bit == 0 {
                    self.is_high(at - 1e-3 * c.bit)
                } else {
                    c.bits >> (bit - 1) & 1 == 1
                };
                if at >= from && before && c.bits >> bit & 1 == 0 {
                    return Some(at);
                }
            }
        }
        None
    }

    fn forget(&mut self, before: f64) {
        while self.chars.front().is_some_and(|c| c.end() + c.bit < before) {
            self.chars.pop_front();
        }
    }
}

#[derive(Clone, Copy, Debug)]
struct Received {
    byte: u8,
    status: u8,
}

/// State of the USART.
#[derive(Clone, Debug)]
pub struct Usart {
    ubrr: u16,
    double: bool,
    mpcm: u8,
    b: u8,
    c: u8,
    txc: bool,
    /// Byte on its way, and the cycle of the end of its stop bit.
    shift: Option<(u8, u64)>,
    buffer: Option<u8>,
    line: Line,
    host_bit: Option<f64>,
    /// The receiver looks for a start bit from here on.
    from: f64,
    received: VecDeque<Received>,
    /// The cycle of the last read at the address that UBRRH and UCSRC share.
    shared_read: Option<u64>,
}

impl Usart {
    pub fn new() -> Self {
        Usart {
            ubrr: 0,
            double: false,
            mpcm: 0,
            b: 0,
            c: RESET_C,
            txc: false,
            shift: None,
            buffer: None,
            line: Line::default(),
            host_bit: None,
            from: 0.0,
            received: VecDeque::new(),
            shared_read: None,
        }
    }

    /// A reset of the chip: the host and its line know nothing of it.
    pub fn reset(&mut self) {
        let (line, host_bit) = (std::mem::take(&mut self.line), self.host_bit);
        *self = Usart {
            line,
            host_bit,
            ..Usart::new()
        };
    }

    fn bit(&self) -> u64 {
        (if self.double { 8 } else { 16 }) * (u64::from(self.ubrr) + 1)
    }

    fn frame(&self) -> u64 {
        self.bit() * if self.c & USBS == 0 { 10 } else { 11 }
    }

    /// The host's time for a bit, cycles of this chip; `None`: whatever this chip is set to.
    pub fn set_host_bit(&mut self, cycles: Option<f64>) {
        self.host_bit = cycles;
    }

    /// The host sends a byte, not before `at` and not before what it is sending has gone out: when that begins, and the time
    /// of a bit.
    pub fn host_sends(&mut self, at: u64, byte: u8, stop_bit: bool) -> (f64, f64) {
        let bit = self.host_bit.unwrap_or(self.bit() as f64);
        let start = self.line.free.max(at as f64);
        let bits = u16::from(byte) << 1 | u16::from(stop_bit) << 9;
        self.line.chars.push_back(Char { start, bit, bits });
        self.line.free = start + 10.0 * bit;
        (start, bit)
    }

    /// Bytes of the host that have not yet gone out at `now`.
    pub fn host_queue(&self, now: u64) -> usize {
        self.line
            .chars
            .iter()
            .filter(|c| c.end() > now as f64)
            .count()
    }

    pub fn status(&self) -> u8 {
        let front = self.received.front();
        let mut a = (u8::from(self.double) * U2X) | self.mpcm;
        a |= front.map_or(0, |r| RXC | r.status);
        if self.buffer.is_none() {
            a |= UDRE;
        }
        if self.txc {
            a |= TXC;
        }
        a
    }

    pub fn read_b(&self) -> u8 {
        self.b
    }

    pub fn read_ubrrl(&self) -> u8 {
        self.ubrr as u8
    }

    /// UBRRH; UCSRC where the address was read in the cycle before.
    pub fn read_shared(&mut self, now: u64) -> u8 {
        if self.shared_read.is_some_and(|at| at + 1 == now) {
            self.shared_read = None;
            return self.c;
        }
        self.shared_read = Some(now);
        (self.ubrr >> 8) as u8
    }

    pub fn read_data(&mut self) -> u8 {
        self.received.pop_front().map_or(0, |r| r.byte)
    }

    pub fn write_a(&mut self, value: u8) {
        if value & TXC != 0 {
            self.txc = false;
        }
        self.double = value & U2X != 0;
        self.mpcm = value & 1;
    }

    pub fn write_b(&mut self, value: u8, now: u64) -> Result<(), Unmodelled> {
        let before = std::mem::replace(&mut self.b, value & !(1 << 1));
        if value & RXEN == 0 {
            self.received.clear();
        } else if before & RXEN == 0 {
            self.from = now as f64;
        }
        if value & UCSZ2 != 0 {
            return Err(Unmodelled("characters of nine bits"));
        }
        Ok(())
    }

    pub fn write_ubrrl(&mut self, value: u8, now: u64) {
        self.set_divisor(self.ubrr & 0xf00 | u16::from(value), now);
    }

    /// "Ongoing transmissions by the transmitter and receiver will be corrupted if the baud rate is changed" (2466T, UBRR):
    /// the bits that have not gone out yet are as long as the new speed has them, and whoever listens at the old one takes
    /// what is on the line in the middle of each of its own bits. (The receiver samples a character at one speed, the
    /// present one.)
    fn set_divisor(&mut self, divisor: u16, now: u64) {
        let old = self.bit();
        self.ubrr = divisor;
        let new = self.bit();
        let Some((byte, end)) = self.shift.filter(|_| new != old) else {
            return;
        };
        // Start bit, eight data bits, stop bits; past their end the line is high.
        let bits = u64::from(byte) << 1 | !0 << 9;
        let start = end.saturating_sub(self.frame() / new * old);
        let gone = now.saturating_sub(start);
        let (whole, part) = (gone / old, gone % old);
        // The bit that is going out keeps its share of time.
        let rest = (old - part) * new / old;
        let on_line = |at: u64| match at.checked_sub(gone) {
            None => bits >> (at / old) & 1,
            Some(since) if since < rest => bits >> whole & 1,
            Some(since) => bits >> (whole + 1 + (since - rest) / new).min(63) & 1,
        };
        let heard = (0..8).fold(0, |heard, n| {
            heard | (on_line(old * (n + 1) + old / 2) as u8) << n
        });
        let frame_bits = self.frame() / new;
        let left = frame_bits.saturating_sub(whole + 1);
        self.shift = Some((heard, now + rest + left * new));
    }

    /// UCSRC with URSEL set, else UBRRH.
    pub fn write_shared(&mut self, value: u8, now: u64) -> Result<(), Unmodelled> {
        if value & URSEL == 0 {
            self.set_divisor(self.ubrr & 0xff | u16::from(value & 0x0f) << 8, now);
            return Ok(());
        }
        self.c = value;
        if value & !(URSEL | USBS) == 0b110 {
            Ok(())
        } else {
            Err(Unmodelled("a serial format other than 8N1"))
        }
    }

    pub fn write_data(&mut self, value: u8, now: u64) {
        if self.b & TXEN == 0 || self.buffer.is_some() {
            return;
        }
        if self.shift.is_some() {
            self.buffer = Some(value);
        } else {
            self.shift = Some((value, now + self.frame()));
        }
    }

    /// When the byte that is being received has its stop bit.
    fn reception(&self) -> Option<(f64, f64)> {
        if self.b & RXEN == 0 || self.line.chars.is_empty() {
            return None;
        }
        let start = self.line.fall(self.from)?;
        Some((start, start + STOP_SAMPLE * self.bit() as f64))
    }

    pub fn next(&self) -> Option<u64> {
        let sent = self.shift.map(|(_, end)| end);
        let received = self.reception().map(|(_, end)| end.ceil() as u64);
        match (sent, received) {
            (Some(a), Some(b)) => Some(a.min(b)),
            (a, b) => a.or(b),
        }
    }

    /// Does what is due at `now`; returns a byte that has gone out.
    pub fn process(&mut self, now: u64) -> Option<(u64, u8)> {
        if let Some((start, end)) = self.reception()
            && end.ceil() as u64 <= now
        {
            self.receive(start, end);
        }
        let (byte, end) = self.shift.filter(|&(_, end)| end <= now)?;
        self.shift = self.buffer.take().map(|byte| (byte, end + self.frame()));
        if self.shift.is_none() {
            self.txc = true;
        }
        Some((end, byte))
    }

    fn receive(&mut self, start: f64, end: f64) {
        let bit = self.bit() as f64;
        let level = |n: u32| self.line.is_high(start + (f64::from(n) + 0.5) * bit);
        if level(0) {
            // Too short for a start bit.
            self.from = start + 0.6 * bit;
            return;
        }
        let byte = (1..9).fold(0, |byte, n| byte | u8::from(level(n)) << (n - 1));
        let status = if level(9) { 0 } else { FE };
        self.from = end;
        self.line.forget(end - 10.0 * bit);
        if self.received.len() < 3 {
            self.received.push_back(Received { byte, status });
        } else if let Some(last) = self.received.back_mut() {
            // Two in the buffer, one in the shift register: what comes now is lost, and the last one says so.
            last.status |= DOR;
        }
    }

    /// Whether RXC, UDRE, TXC interrupt.
    pub fn interrupts(&self) -> [bool; 3] {
        [
            self.b & RXCIE != 0 && !self.received.is_empty(),
            self.b & UDRIE != 0 && self.buffer.is_none(),
            self.b & TXCIE != 0 && self.txc,
        ]
    }

    /// The TXC interrupt has been taken.
    pub fn clear_txc(&mut self) {
        self.txc = false;
    }

    /// Cycles for a bit, as set.
    pub fn bit_cycles(&self) -> u64 {
        self.bit()
    }
}
