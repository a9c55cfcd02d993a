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
//! | what they depend on | Q16.16, whole counts but for the motor's speed |
//! | squares of rates at rest | Q16 (deg/s)^2 |
//! | what the filter knows | Q8.8 blocks |
//! | noise over what was told | Q8 |
//!
//! Bounds, deg/s: a rate below 1024 at the input, which a scale below 1/8 deg/s for each count makes (a larger one wraps; no part
//! has it); the terms add 32 + 16 + 128 + 16 + 4 + 128 + 96 at the most, whatever the coefficients are, the matrix 3/8 of the sum, the
//! surge 16: below 2048, which Q12.20 holds.

use core::num::NonZeroU16;

use wire::correction::{
    ADAPT_SHIFT, BLOCK_SHIFT_MAX, GATE_SHIFT, LONGEST_TICKS, NOISE_SHIFT, REST_DPS, ROWS,
    STORED_LEN,
};
use wire::correction_state::{
    APPLIED, AT_REST, EXTRAPOLATED, FILTERED, NOISE_OFF, NOT_IN_ORDER, REFUSED, YAW_FREE,
};
use wire::fields::Corrected;
use wire::kind;
use zerocopy::IntoBytes;
use zerocopy::little_endian::{I32, U16};

use crate::acquire::Raw;
use crate::attitude;
use crate::config::Config;
use crate::math::{divide, product, shifted, sum, times, upper};
use crate::stand::Board;
use crate::stand::store::newest;

/// Where the two copies begin in the EEPROM, behind those of the set-up.
pub const COPIES: [u16; 2] = [144, 272];
const _: () = assert!(
    // The row of the CRC has two bytes that mean nothing.
    COPIES[0] as usize + STORED_LEN + 2 <= COPIES[1] as usize
        && COPIES[1] as usize + STORED_LEN + 2 <= 512
);
/// Rest ends here, upper half of Q12.20 deg/s.
const REST: i16 = (REST_DPS << 4) as i16;
/// The square of a block's mean is taken for this at the most, over the variance that was told, Q8: [`wire::correction::REACH`].
const SQUARE_MAX: u32 = 0x7fff;
/// Variance of a bias that is not known, over that which was told of a block: Q8.
const EXPECTED_MOST: u32 = 0xffff - (NOISE_TOLD << NOISE_SHIFT) as u32;
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
    left: u8,
    sum: Sum,
    /// Of each axis, in arrays of their own: a stride that is no power of two is a product on the AVR.
    /// Rates with the model's terms, before the other axes' shares.
    rate: [i32; 3],
    /// Of what is left of the rates of a block: below 4 deg/s in each of 128 at rest.
    left_over: [i32; 3],
    axes: [Axis; 3],
    /// Of the squares of what is left of all three rates in a block, Q16.
    squares: u32,
    /// What the motor has turned to, steps in Q16.
    speed: i32,
    /// When the sample before was, timer ticks.
    t_ticks: u16,
    /// As it goes out, and whether it waits for room.
    frame: Corrected,
    waits: bool,
}

#[derive(Clone, Copy)]
struct Axis {
    /// The variance of a block, over that which was told, less 1: Q8.
    noise: i16,
    /// The block before was at rest, and not refused.
    trusted: bool,
}

/// 1 in Q8.
const NOISE_TOLD: i16 = 1 << 8;
const NOISE_LEAST: i16 = (NOISE_TOLD >> NOISE_SHIFT) - NOISE_TOLD;
const NOISE_MOST: i16 = (NOISE_TOLD << NOISE_SHIFT) - NOISE_TOLD;

/// Bytes of three numbers, as each axis has them in the matrix and for the filter.
const OF_AXIS: u16 = 6;

/// Where those of the filter begin.
const OF_FILTER: u16 = 96;
const _: () = assert!(OF_FILTER as usize + 3 * OF_AXIS as usize == wire::correction::NUMBERS_LEN);

/// A sum of what is weighed by the stored numbers, in their order.
struct Sum {
    /// Where the next number is read from.
    at: u16,
    total: i32,
}

impl Sum {
    #[inline(never)]
    fn next<B: Board>(&mut self, board: &mut B) -> i16 {
        let low = self.byte(board);
        i16::from_le_bytes([low, self.byte(board)])
    }

    #[inline(never)]
    fn byte<B: Board>(&mut self, board: &mut B) -> u8 {
        let at = self.at;
        self.at = at.wrapping_add(1);
        board.eeprom_read(at)
    }

    /// Adds `x`, Q16, times the next number.
    #[inline(never)]
    fn weigh<B: Board>(&mut self, board: &mut B, x: i32) {
        let more = times(x, self.next(board));
        self.total = self.total.wrapping_add(more);
    }

    /// Adds `x` times the next number.
    #[inline(never)]
    fn count<B: Board>(&mut self, board: &mut B, x: i16) {
        self.weigh(board, i32::from(x) << 16);
    }
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
            sum: Sum { at: 0, total: 0 },
            rate: [0; 3],
            left_over: [0; 3],
            axes: [Axis {
                noise: 0,
                trusted: false,
            }; 3],
            squares: 0,
            speed: 0,
            t_ticks: 0,
            frame: Corrected {
                seq: U16::ZERO,
                rate: [I32::ZERO; 3],
                bias: [I32::ZERO; 3],
                known: [U16::ZERO; 3],
                correction: U16::ZERO,
                state: 0,
                attitude: [I32::ZERO; 4],
            },
            waits: false,
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
    pub fn place(&self, other: bool, row: u8) -> Option<NonZeroU16> {
        if row > ROWS as u8 {
            return None;
        }
        let second = (self.newest == 2) != other;
        let copy = if second { COPIES[1] } else { COPIES[0] };
        NonZeroU16::new(copy.wrapping_add(u16::from(row.wrapping_mul(6))))
    }

    /// No corrected frames any more.
    pub fn off(&mut self) {
        self.at = 0;
    }

    /// Puts the newest copy that is in order in use, the filter started anew; false where none is.
    #[inline(never)]
    pub fn on<B: Board>(&mut self, board: &mut B) -> bool {
        *self = Self::new();
        self.newest = newest(board, COPIES[0], COPIES[1]) & 3;
        if let Some(at) = self.place(false, 0).filter(|_| self.newest != 0) {
            self.at = at.get();
        }
        self.at != 0
    }

    /// The three numbers there.
    #[inline(always)]
    pub fn read<B: Board>(&mut self, board: &mut B, place: u16, into: &mut [I32; 3]) {
        self.sum.at = place;
        for number in into {
            number.set(self.sum.next(board).into());
        }
    }

    /// Whether a sample is corrected: one is in use, and can be read. The frame of the one before waits no longer.
    pub fn is_ready<B: Board>(&mut self, board: &mut B) -> bool {
        self.waits = self.at != 0 && board.eeprom_is_ready();
        self.waits
    }

    /// Whether a frame waits for room.
    #[must_use]
    pub fn waits(&self) -> bool {
        self.waits
    }

    /// Sends it.
    pub fn tell<B: Board>(&mut self, board: &mut B) {
        self.waits = !board.send(kind::CORRECTED, self.frame.as_bytes());
    }

    /// Corrects the sample of this number; [`end`](Self::end) comes before, [`turn`](Self::turn) behind it.
    #[inline(always)]
    pub fn step<B: Board>(
        &mut self,
        board: &mut B,
        raw: &Raw,
        seq: u16,
        duty: i16,
        config: &Config,
        in_order: bool,
    ) {
        self.sum.at = self.at.wrapping_add(2);
        self.frame.seq.set(seq);
        self.frame
            .correction
            .set(self.sum.next(board).cast_unsigned());
        let shift = self.sum.next(board) as u8 & BLOCK_SHIFT_MAX;
        self.frame.state = 0;
        if self.sum.next(board).cast_unsigned() != config.sens_avg() {
            return;
        }
        if self.left == 0 {
            self.left = block_len(shift);
            self.state |= APPLIED | AT_REST;
        }
        if !in_order {
            self.frame.state = NOT_IN_ORDER;
            self.state &= !AT_REST;
        }
        if duty != 0 {
            self.state &= !AT_REST;
        }
        let range = self.sum.next(board).to_le_bytes().map(u8::cast_signed);
        let ahead = self.drive(board, duty);
        self.model(board, raw, duty, config, range);
        self.rest(board, ahead);
        self.frame.state |= self.state;
        self.left = self.left.wrapping_sub(1);
    }

    /// How far the command is ahead of the motor, which follows it by the part that the next number tells, Q15.
    #[inline(always)]
    fn drive<B: Board>(&mut self, board: &mut B, duty: i16) -> i32 {
        let ahead = (i32::from(duty) << 16).wrapping_sub(self.speed);
        self.sum.total = self.speed;
        self.sum.weigh(board, ahead << 1);
        self.speed = self.sum.total;
        ahead
    }

    /// The model's terms for each axis.
    fn model<B: Board>(
        &mut self,
        board: &mut B,
        raw: &Raw,
        duty: i16,
        config: &Config,
        [lowest, highest]: [i8; 2],
    ) {
        let [acc_x, acc_y, acc_z] = raw.acc.map(u16::cast_signed);
        let turning = match duty {
            0 => 0,
            1.. => 1 << 7,
            _ => -(1 << 7),
        };
        // What the numbers behind those of the temperature weigh, the same for all axes.
        let shared = [
            1 << 10,
            1,
            duty,
            duty.wrapping_abs(),
            turning,
            raw.supply[0].unsigned_12().cast_signed(),
            acc_x,
            acc_y,
            acc_z,
        ];
        let sum = &mut self.sum;
        for (((temp, rate), word), scale) in (raw.temp.iter())
            .zip(&mut self.rate)
            .zip(&raw.gyro)
            .zip(&config.set_up.scale)
        {
            // Ten bits.
            let temp = (temp.bits() << 6).cast_signed() >> 6;
            let step = (temp >> 2) as i8;
            if step < lowest || step > highest {
                self.frame.state |= EXTRAPOLATED;
            }
            // Q24 times counts is Q16. A scale beyond 1/8 deg/s for each count makes rates that wrap, which no part has.
            sum.total = times(scale.get() << 8, word.signed_14()) << 4;
            sum.count(board, temp);
            // Its square, Q22.10.
            sum.weigh(board, product(temp, temp) << 10);
            for &x in &shared {
                sum.count(board, x);
            }
            *rate = sum.total;
        }
    }

    /// The shares of the other axes, what the motor does until it has spun up, and the filter's bias; what is left is told, and
    /// summed up unless it is too much for a stand at rest.
    #[inline(always)]
    fn rest<B: Board>(&mut self, board: &mut B, ahead: i32) {
        let sum = &mut self.sum;
        for (((rate, left_over), to), bias) in (self.rate.iter())
            .zip(&mut self.left_over)
            .zip(&mut self.frame.rate)
            .zip(&self.frame.bias)
        {
            sum.total = rate.wrapping_sub(bias.get());
            for &share in &self.rate {
                sum.weigh(board, shifted(share, 2));
            }
            // Behind the shares of all axes is what the filter has of each: noise and walk, for the end of the block, and this.
            sum.at = sum.at.wrapping_add(OF_AXIS * 2 + 4);
            sum.weigh(board, ahead);
            sum.at = sum.at.wrapping_sub(OF_AXIS * 3);
            let left = sum.total;
            to.set(left);
            if (-REST..REST).contains(&((left >> 16) as i16)) {
                *left_over = left_over.wrapping_add(left);
                self.squares = self.squares.wrapping_add(square(left));
            } else {
                self.state &= !AT_REST;
            }
        }
    }

    /// The attitude behind the corrected sample: begins anew where the sample before is too long ago, or there is none.
    #[inline(never)]
    pub fn turn(&mut self, raw: &Raw) {
        let now = raw.t_ticks as u16;
        let ticks = now.wrapping_sub(core::mem::replace(&mut self.t_ticks, now));
        if self.state & YAW_FREE == 0 || ticks > LONGEST_TICKS {
            self.state |= YAW_FREE;
            self.frame.state &= !YAW_FREE;
            attitude::begin(&mut self.frame.attitude);
        } else if self.frame.state & APPLIED != 0 {
            let acc = (self.frame.state & AT_REST != 0).then_some(&raw.acc);
            attitude::step(&mut self.frame.attitude, &self.frame.rate, ticks, acc);
        }
    }

    /// Before a sample: where a block has ended with the one before, one step of the filter.
    pub fn end<B: Board>(&mut self, board: &mut B) {
        if self.left != 0 || self.state & APPLIED == 0 {
            return;
        }
        let sum = &mut self.sum;
        sum.at = self.at.wrapping_add(4);
        let shift = sum.next(board) as u8 & BLOCK_SHIFT_MAX;
        sum.at = self.at.wrapping_add(OF_FILTER);
        // The mean square of what is left about its own means, over what it is by what was told: above four times that it is
        // no rest.
        let mut spread = shifted(self.squares.cast_signed(), shift);
        let mut told = 0u16;
        for left_over in &mut self.left_over {
            let mean = shifted(*left_over, shift);
            *left_over = mean;
            spread = spread.wrapping_sub(square(mean).cast_signed());
            // A fourth, so that three have room.
            told = told.wrapping_add(sum.next(board).cast_unsigned() >> 2);
            sum.at = sum.at.wrapping_add(4);
        }
        self.squares = 0;
        let mut rested = self.state & AT_REST != 0;
        self.state &= FILTERED | YAW_FREE;
        if rested && shifted(spread, shift.wrapping_add(2)) > i32::from(told) {
            self.state |= NOISE_OFF;
            rested = false;
        }
        sum.at = sum.at.wrapping_sub(OF_AXIS * 3);
        for (((axis, mean), bias), known) in (self.axes.iter_mut())
            .zip(&mut self.left_over)
            .zip(&mut self.frame.bias)
            .zip(&mut self.frame.known)
        {
            let told = sum.next(board).cast_unsigned();
            let walk = sum.next(board).cast_unsigned();
            sum.at = sum.at.wrapping_add(2);
            // P' = P + q with P = R / known, to the first order of known q / R.
            let lost = upper(upper(known.get(), walk), known.get());
            known.set(known.get().wrapping_sub(lost));
            let mean = core::mem::take(mean);
            if rested {
                self.state |= axis.measure(mean, told, bias, known);
            } else {
                axis.trusted = false;
            }
        }
    }
}

impl Default for Correction {
    fn default() -> Self {
        Self::new()
    }
}

/// The square of a rate below 4 deg/s, Q12.20: Q16, of it to the nearest 2^-8.
#[inline(never)]
fn square(x: i32) -> u32 {
    let coarse = times(x, 1 << 4) as i16;
    product(coarse, coarse).cast_unsigned()
}

fn block_len(shift: u8) -> u8 {
    let mut len = 1;
    for _ in 0..shift {
        len <<= 1;
    }
    len
}

impl Axis {
    /// A measurement of the scalar Kalman filter, by the mean of a block; what it has to say of it as bits of the state.
    #[inline(always)]
    fn measure(&mut self, mean: i32, told: u16, bias: &mut I32, known: &mut U16) -> u8 {
        // Q13, whose square is Q26; over Q18 that is Q8.
        let coarse = shifted(mean, 7) as i16;
        let square = divide(product(coarse, coarse).cast_unsigned(), told).min(SQUARE_MAX) as u16;
        let noise = NOISE_TOLD.wrapping_add(self.noise).cast_unsigned();
        // 1 / known, where there is any; the sum has 16 bits.
        let expected = (divide(EXPECTED_MOST, known.get() | 1) as u16).wrapping_add(noise);
        let before = self.trusted;
        self.trusted = square >> (2 * GATE_SHIFT) <= expected;
        if !self.trusted {
            return REFUSED;
        }
        if !before {
            return 0;
        }
        let measured = divide(1 << 16, noise) as u16;
        let now = sum(known.get(), measured);
        known.set(now);
        let gain = divide(u32::from(measured) << 14, now) as i16;
        bias.set(bias.get().wrapping_add(times(mean << 2, gain)));
        if expected > SQUARE_MAX as u16 {
            // It knew nothing yet.
            return FILTERED;
        }
        // Towards what was seen, between a fourth and four times what was told.
        let beyond = square.wrapping_sub(expected).cast_signed();
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
