//! The correction of the rates on the board, in fixed point; what it computes is in [`wire::correction`], with a twin in double
//! precision that the tests hold it to.
//!
//! The coefficients stay in the EEPROM and are read from there, number by number, as they are needed: SRAM has no room for them.
//! So a correction is in use whole or not at all, and one that is half written is never applied. Two copies, each with a CRC and
//! a generation; the one that is not in use is written.
//!
//! | quantity | format |
//! |---|---|
//! | rates, biases | Q12.20 deg/s |
//! | what they depend on | Q16.16, whole counts but for the temperature behind its low pass |
//! | what the filter knows | Q8.8 blocks |
//! | noise over what was told | Q8 |
//!
//! Bounds, deg/s: a rate below 1024 at the input; the terms add 32 + 16 + 128 + 16 + 128 + 96 at the most, whatever the
//! coefficients are, and the matrix 3/8 of the sum: below 2048, which Q12.20 holds.

use wire::correction::{
    ADAPT_SHIFT, BLOCK_SHIFT_MAX, FORMAT, GATE_SHIFT, NOISE_SHIFT, REST_DPS, ROWS, STORED_LEN,
    TEMPERATURE_SHIFT,
};
use wire::correction_state::{
    APPLIED, AT_REST, EXTRAPOLATED, FILTERED, NOISE_OFF, NOT_IN_ORDER, REFUSED,
};
use wire::fields::Corrected;
use zerocopy::little_endian::I32;

use crate::acquire::Raw;
use crate::config::Config;
use crate::math::divide;
use crate::stand::Board;

/// Where the two copies begin in the EEPROM, behind those of the set-up.
pub const COPIES: [u16; 2] = [144, 272];
const _: () = assert!(
    // The row of the CRC has two bytes that mean nothing.
    COPIES[0] as usize + STORED_LEN + 2 <= COPIES[1] as usize
        && COPIES[1] as usize + STORED_LEN + 2 <= 512
);
/// Rest ends here, upper half of Q12.20 deg/s.
const REST: i16 = (REST_DPS << 4) as i16;
/// A scale of 1/8 deg/s for each count makes a rate of 1024 deg/s, Q8.24: larger ones lose their upper bits.
const SCALE_MASK: i32 = (1 << 21) - 1;
/// A bit of the state beside those of [`wire::correction_state`]: the low pass of the temperature has begun.
const WARM: u8 = 1 << 7;

/// The square of a block's mean is taken for this at the most, over the variance that was told, Q8: [`wire::correction::REACH`].
const SQUARE_MAX: u32 = 0x7fff;
/// Half a step of what the noise follows by.
const HALF: i16 = 1 << (ADAPT_SHIFT - 1);

/// What the correction keeps. All zeros: none in use.
pub struct Correction {
    /// Where the copy in use begins; 0: none, or off.
    at: u16,
    /// Number of the newest copy that is in order, 1 or 2; 0: none.
    newest: u8,
    /// Bits of [`wire::correction_state`] that outlast a sample; 0: the filter has not been started.
    state: u8,
    /// Samples until the block ends.
    left: u16,
    axes: [Axis; 3],
}

#[derive(Clone, Copy)]
struct Axis {
    /// Behind its low pass, Q10.22.
    temp: i32,
    bias: i32,
    /// The variance of the bias is that of a block, as it was told, over this: Q8.8.
    known: u16,
    /// The variance of a block, over that which was told, less 1: Q8.
    noise: i16,
    /// Of what is left of the rates of a block at rest: below 4 deg/s in each of 256.
    sum: i32,
}

const AXIS: Axis = Axis {
    temp: 0,
    bias: 0,
    known: 0,
    noise: 0,
    sum: 0,
};

/// 1 in Q8.
const NOISE_TOLD: i16 = 1 << 8;
const NOISE_LEAST: i16 = (NOISE_TOLD >> NOISE_SHIFT) - NOISE_TOLD;
const NOISE_MOST: i16 = (NOISE_TOLD << NOISE_SHIFT) - NOISE_TOLD;

/// Where the next number is read from.
struct Reader<'a, B> {
    board: &'a mut B,
    at: u16,
}

impl<B: Board> Reader<'_, B> {
    #[inline(never)]
    fn next(&mut self) -> i16 {
        let low = self.board.eeprom_read(self.at);
        let high = self.board.eeprom_read(self.at.wrapping_add(1));
        self.at = self.at.wrapping_add(2);
        i16::from_le_bytes([low, high])
    }

    /// Adds `x` times the next number to `to`.
    #[inline(never)]
    fn add(&mut self, x: i32, to: &mut i32) {
        add_times(to, x, self.next());
    }
}

/// `x y / 2^16`, rounded down.
#[inline(never)]
fn times(x: i32, y: i16) -> i32 {
    let high = i32::from((x >> 16) as i16).wrapping_mul(y.into());
    let low = i32::from(x as u16).wrapping_mul(y.into()) >> 16;
    high.wrapping_add(low)
}

/// Adds `x y / 2^16`.
#[inline(never)]
fn add_times(to: &mut i32, x: i32, y: i16) {
    *to = to.wrapping_add(times(x, y));
}

/// `x / 2^n`, rounded down. (The AVR shifts in a loop, or unrolled in ten times the flash.)
#[inline(never)]
fn shifted(mut x: i32, n: u8) -> i32 {
    for _ in 0..core::hint::black_box(n) {
        x >>= 1;
    }
    x
}

/// `x y` of what has no sign.
#[inline(never)]
fn wide(x: u16, y: u16) -> u32 {
    u32::from(x).wrapping_mul(y.into())
}

/// `x y / 2^16` of what has no sign.
#[inline(never)]
fn upper(x: u16, y: u16) -> u16 {
    (wide(x, y) >> 16) as u16
}

/// `x y`.
#[inline(never)]
fn product(x: i16, y: i16) -> i32 {
    i32::from(x).wrapping_mul(y.into())
}

/// The square of a temperature, Q10.22 counts: Q22.10.
#[inline(always)]
fn square(t: i32) -> i32 {
    // By its whole counts: Q6; by the rest in 15 bits: Q21.
    let whole = times(t, (t >> 16) as i16 >> 6);
    let rest = times(t, ((t >> 7) as u16 & 0x7fff).cast_signed());
    (whole << 4).wrapping_add(shifted(rest, 11))
}

impl Correction {
    /// None.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            at: 0,
            newest: 0,
            state: 0,
            left: 0,
            axes: [AXIS; 3],
        }
    }

    /// Number of the copy in use, 1 or 2; 0: none.
    #[must_use]
    pub fn in_use(&self) -> u8 {
        if self.at == 0 { 0 } else { self.newest }
    }

    /// Where a row of the newest copy begins, or of the other one; the row behind the last is that of the CRC.
    #[must_use]
    #[inline(never)]
    pub fn place(&self, other: bool, row: u8) -> Option<u16> {
        if row > ROWS as u8 {
            return None;
        }
        let second = (self.newest == 2) != other;
        let copy = if second { COPIES[1] } else { COPIES[0] };
        Some(copy.wrapping_add(u16::from(row.wrapping_mul(6))))
    }

    /// No corrected frames any more.
    pub fn off(&mut self) {
        self.at = 0;
    }

    /// Puts the newest copy that is in order in use, the filter started anew; false where none is.
    #[inline(never)]
    pub fn on<B: Board>(&mut self, board: &mut B) -> bool {
        *self = Self::new();
        let (mut generation, mut copy, mut number) = (0, COPIES[0], 1);
        while number <= 2 {
            let its = board.eeprom_read(copy.wrapping_add(1));
            // Generations wrap: the newer one is ahead by less than half the circle.
            if is_whole(board, copy, STORED_LEN as u8)
                && board.eeprom_read(copy) == FORMAT
                && (self.at == 0 || its.wrapping_sub(generation) < 128)
            {
                (self.at, self.newest, generation) = (copy, number, its);
            }
            copy = COPIES[1];
            number = number.wrapping_add(1);
        }
        self.at != 0
    }

    /// The three numbers there.
    #[inline(always)]
    pub fn read<B: Board>(board: &mut B, place: u16, into: &mut [I32; 3]) {
        let mut reader = Reader { board, at: place };
        for number in into {
            number.set(reader.next().into());
        }
    }

    /// Whether a sample is corrected: one is in use, and can be read.
    pub fn is_ready<B: Board>(&self, board: &mut B) -> bool {
        self.at != 0 && board.eeprom_is_ready()
    }

    /// Corrects a sample; says all of the frame but number and time.
    #[inline(always)]
    pub fn step<B: Board>(
        &mut self,
        board: &mut B,
        raw: &Raw,
        duty: i16,
        config: &Config,
        in_order: bool,
        out: &mut Corrected,
    ) {
        let mut reader = Reader {
            board,
            at: self.at.wrapping_add(2),
        };
        out.correction.set(reader.next().cast_unsigned());
        let shift = reader.next() as u8 & BLOCK_SHIFT_MAX;
        if reader.next().cast_unsigned() != config.sens_avg() {
            return;
        }
        if self.left == 0 {
            self.left = block_len(shift);
            self.state |= APPLIED | AT_REST;
        }
        if !in_order {
            out.state = NOT_IN_ORDER;
            self.state &= !AT_REST;
        }
        if duty != 0 {
            self.state &= !AT_REST;
        }
        let mut rates = [0; 3];
        let range = reader.next().to_le_bytes().map(u8::cast_signed);
        reader.at = reader.at.wrapping_add(2);
        self.model(&mut reader, raw, duty, config, &mut rates);
        self.rest(&mut reader, &rates, range, out);
        out.state |= self.state & !WARM;
        self.left = self.left.wrapping_sub(1);
        if self.left == 0 {
            self.end_block(&mut reader, shift);
        }
    }

    /// The model's terms for each axis.
    #[inline(never)]
    fn model<B: Board>(
        &mut self,
        reader: &mut Reader<'_, B>,
        raw: &Raw,
        duty: i16,
        config: &Config,
        rates: &mut [i32; 3],
    ) {
        let starts = self.state & WARM == 0;
        let [x, y, z] = raw.acc;
        let by = [
            1 << 10,
            1,
            duty,
            duty.wrapping_abs(),
            raw.supply[0].unsigned_12().cast_signed(),
            x.cast_signed(),
            y.cast_signed(),
            z.cast_signed(),
        ];
        for ((((axis, rate), temp), word), scale) in (self.axes.iter_mut())
            .zip(rates)
            .zip(&raw.temp)
            .zip(&raw.gyro)
            .zip(&config.set_up.scale)
        {
            // Ten bits.
            axis.warm((temp.bits() << 6).cast_signed(), starts);
            // Q8.24 << 8 times counts is Q16.16; of the scale 29 bits, so that nothing wraps.
            *rate = times((scale.get() & SCALE_MASK) << 8, word.signed_14()) << 4;
            reader.add(axis.temp >> 6, rate);
            reader.add(square(axis.temp), rate);
            for by in by {
                *rate = rate.wrapping_add(product(by, reader.next()));
            }
        }
        self.state |= WARM;
    }

    /// The shares of the other axes, and the filter's bias; what is left is told, and summed up unless it is too much for a stand
    /// at rest.
    #[inline(always)]
    fn rest<B: Board>(
        &mut self,
        reader: &mut Reader<'_, B>,
        rates: &[i32; 3],
        [lowest, highest]: [i8; 2],
        out: &mut Corrected,
    ) {
        for ((axis, &rate), to) in self.axes.iter_mut().zip(rates).zip(&mut out.rate) {
            let mut left = rate.wrapping_sub(axis.bias);
            for &share in rates {
                reader.add(share >> 2, &mut left);
            }
            if (-REST..REST).contains(&((left >> 16) as i16)) {
                axis.sum = axis.sum.wrapping_add(left);
            } else {
                self.state &= !AT_REST;
            }
            to.set(left);
        }
        for ((axis, bias), known) in self.axes.iter().zip(&mut out.bias).zip(&mut out.known) {
            bias.set(axis.bias);
            known.set(axis.known);
            let temp = (axis.temp >> 24) as i8;
            if temp < lowest || temp > highest {
                out.state |= EXTRAPOLATED;
            }
        }
    }

    /// A block has ended: one step of the filter. `reader` is at its numbers.
    #[inline(always)]
    fn end_block<B: Board>(&mut self, reader: &mut Reader<'_, B>, shift: u8) {
        let rested = self.state & AT_REST != 0;
        self.state &= FILTERED | WARM;
        for axis in &mut self.axes {
            let told = reader.next().cast_unsigned();
            let walk = reader.next().cast_unsigned();
            // P' = P + q with P = R / known, to the first order of known q / R.
            let lost = upper(upper(axis.known, walk), axis.known);
            axis.known = axis.known.wrapping_sub(lost);
            let _none = reader.next();
            let mean = shifted(core::mem::take(&mut axis.sum), shift);
            if rested {
                self.state |= axis.measure(mean, told);
            }
        }
    }
}

impl Default for Correction {
    fn default() -> Self {
        Self::new()
    }
}

/// Whether what lies there ends with its CRC.
#[inline(never)]
pub(crate) fn is_whole<B: Board>(board: &mut B, mut at: u16, len: u8) -> bool {
    let mut register = wire::crc::INIT;
    for _ in 0..len {
        register = wire::crc::update(register, board.eeprom_read(at));
        at = at.wrapping_add(1);
    }
    register == wire::crc::RESIDUE
}

#[inline(never)]
fn block_len(shift: u8) -> u16 {
    let mut len = 1;
    for _ in 0..shift {
        len <<= 1;
    }
    len
}

impl Axis {
    /// The low pass of the temperature.
    #[inline(always)]
    fn warm(&mut self, counts_q6: i16, starts: bool) {
        let temp = i32::from(counts_q6) << 16;
        if starts {
            self.temp = temp;
        }
        let change = shifted(temp.wrapping_sub(self.temp), TEMPERATURE_SHIFT);
        self.temp = self.temp.wrapping_add(change);
    }

    /// A measurement of the scalar Kalman filter, by the mean of a block; what it has to say of it as bits of the state.
    #[inline(always)]
    fn measure(&mut self, mean: i32, told: u16) -> u8 {
        // Q13, whose square is Q26; over Q18 that is Q8.
        let coarse = shifted(mean, 7).unsigned_abs() as u16;
        let square = divide(wide(coarse, coarse), told).min(SQUARE_MAX) as u16;
        let noise = NOISE_TOLD.wrapping_add(self.noise).cast_unsigned();
        let expected = (divide(1 << 16, self.known) as u16).saturating_add(noise);
        if square >> (2 * GATE_SHIFT) > expected {
            return REFUSED;
        }
        let measured = divide(1 << 16, noise) as u16;
        self.known = self.known.saturating_add(measured);
        let gain = divide(u32::from(measured) << 14, self.known) as i16;
        add_times(&mut self.bias, mean << 2, gain);
        if expected > SQUARE_MAX as u16 {
            // It knew nothing yet.
            return FILTERED;
        }
        // Towards what was seen, between a fourth and four times what was told.
        let beyond = (square.cast_signed()).saturating_sub_unsigned(expected);
        let noise = (self.noise).wrapping_add(beyond.wrapping_add(HALF) >> ADAPT_SHIFT);
        self.noise = noise.clamp(NOISE_LEAST, NOISE_MOST);
        if self.noise == noise {
            FILTERED
        } else {
            FILTERED | NOISE_OFF
        }
    }
}

#[cfg(test)]
mod tests;
