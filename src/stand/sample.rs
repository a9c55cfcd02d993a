//! A tick's sample: scaled, flagged, counted, sent, corrected, and taken into a bias measurement.

use fixed::types::I16F16;
use wire::fields::Sample;
use wire::{Fault, Status, flags, kind};
use zerocopy::{FromZeros, IntoBytes};

use super::line::SAMPLES_PER_REPORT;
use super::{Board, SET, Stand, source};
use crate::acquire::{Raw, Task};
use crate::bias::{Outcome, TURNS};
use crate::math::{count_up, times};

/// The flags of EA begin here.
const ERROR_SHIFT: u8 = 3;
const _: () = assert!(flags::error(0) == 1 << ERROR_SHIFT);
/// Codes at which the accelerometer's output is at the converter's end.
const ADC_MAX: u16 = 1_023;

impl Stand {
    /// A tick's sample, and how many ticks before it had none: scales, flags, counts and sends it.
    #[inline(never)]
    pub fn on_sample<B: Board>(&mut self, board: &mut B, raw: &Raw, missed: u8) {
        let mut sample = Sample::new_zeroed();
        let mut seen = 0;
        if missed != 0 {
            self.count(Fault::TickOverrun, missed);
            self.take_seq(missed);
            seen = flags::TICK_OVERRUN;
        }
        sample.seq.set(self.take_seq(1));
        sample.t_ticks.set(raw.t_ticks);
        sample.pwm.set(self.motor.output());
        let (mut silent, mut bit, mut noise) = (0, 1, 0);
        for axis in 0..3 {
            let gyro = self.gyro(axis, bit, raw, &mut sample);
            if gyro & flags::GYRO_NOT_ANSWERING != 0 {
                silent |= bit;
            }
            seen |= gyro | self.accelerometer(axis, bit, raw, &mut sample);
            noise ^= raw.gyro[axis as usize].bits() as u8;
            bit <<= 1;
        }
        let sum = crate::math::somewhere(&mut self.noise);
        *sum = wire::crc::update(*sum, noise);
        self.look_after_gyros(board, silent, (seen >> ERROR_SHIFT) as u8 & 7);
        if (self.misconfigured | self.touched) & !silent != 0 || self.setting != SET {
            seen |= flags::GYRO_MISCONFIGURED;
        }
        seen |= self.supply(silent, raw, &mut sample);
        self.in_order = seen == flags::IN_ORDER;
        if !self.null.is_none() {
            seen |= flags::BIAS_NULL;
            self.step_bias_null(board, &sample);
        }
        sample.flags.set(seen);
        if self.late != 0 || !board.send(kind::SAMPLE, sample.as_bytes()) {
            self.record(Fault::FrameDropped, 0);
        } else {
            count_up(&mut self.since_reply);
            count_up(&mut self.since_report);
        }
        self.late = if self.since_report >= SAMPLES_PER_REPORT {
            self.owed & self.waited
        } else {
            0
        };
        self.waited = self.owed;
        if !matches!(raw.done.task, Task::None) {
            self.job_done(board, raw.done);
        }
        let busy = board.ticks_since();
        if busy > self.health.tick_busy_max.get() {
            self.health.tick_busy_max.set(busy);
        }
    }

    /// The next sequence number; `times` of them are spent.
    #[inline(never)]
    pub(super) fn take_seq(&mut self, times: u8) -> u16 {
        let seq = self.health.next_seq.get();
        self.health.next_seq.set(seq.wrapping_add(times.into()));
        seq
    }

    /// One gyro's part of the sample; its flags. `bit` is the one of the axis.
    pub(super) fn gyro(&mut self, axis: u8, bit: u8, raw: &Raw, sample: &mut Sample) -> u16 {
        let at = axis as usize;
        if at >= 3 {
            return 0;
        }
        let word = raw.gyro[at];
        let stalled = raw.spi_stalled & bit != 0;
        if stalled {
            self.record(Fault::SpiStalled, 0);
        }
        // A rate may be zero without new data, or -1 count with an alarm; its supply is neither 0 V nor full scale.
        if stalled || word.is_stuck() && raw.supply[at].is_stuck() {
            self.record(Fault::GyroNotAnsweringX, axis);
            return flags::GYRO_NOT_ANSWERING;
        }
        sample.gyro[at].set(word.signed_14());
        sample.temp[at].set(raw.temp[at].signed_12());
        // Q24 times counts; scale and bias are bounded so that nothing wraps.
        let scale = self.config.set_up.scale[at].get();
        let rate = I16F16::from_bits(times(scale << 8, word.signed_14()));
        let bias = I16F16::from_bits(self.config.set_up.bias[at].get());
        sample.rate[at].set(rate.wrapping_sub(bias).to_bits());
        let mut seen = 0;
        if word.is_new() {
            seen = flags::NEW_X * u16::from(bit);
        } else {
            self.record(Fault::GyroStaleX, axis);
        }
        if word.has_error() {
            seen |= flags::ERROR_X * u16::from(bit);
            self.record(Fault::GyroErrorAlarmX, axis);
        }
        seen
    }

    pub(super) fn accelerometer(
        &mut self,
        axis: u8,
        bit: u8,
        raw: &Raw,
        sample: &mut Sample,
    ) -> u16 {
        let at = axis as usize;
        if at >= 3 {
            return 0;
        }
        let counts = raw.acc[at];
        sample.acc[at].set(counts);
        if raw.adc_stalled & bit != 0 {
            self.record(Fault::AdcStalled, 0);
            flags::ACC_NOT_CONVERTED
        } else if counts == 0 || counts >= ADC_MAX {
            self.record(Fault::AccAtRailX, axis);
            flags::ACC_AT_RAIL
        } else {
            0
        }
    }

    /// One supply for three gyros: the first that answers says what it is.
    pub(super) fn supply(&mut self, silent: u8, raw: &Raw, sample: &mut Sample) -> u16 {
        let mut bit = 1;
        for &word in &raw.supply {
            if silent & bit == 0 {
                let counts = word.unsigned_12();
                sample.supply.set(counts);
                if word.supply().is_in_range() {
                    return 0;
                }
                self.record(Fault::SupplyOutOfRange, 0);
                return flags::SUPPLY_OUT_OF_RANGE;
            }
            bit <<= 1;
        }
        0
    }

    /// Corrects the sample that [`on_sample`](Self::on_sample) had just before. Its frame goes out with a millisecond, as soon as
    /// the line has room for it beside the next one and a reply, and nothing else is owed; one that has not until the next sample is dropped.
    #[inline(always)]
    pub fn correct<B: Board>(&mut self, board: &mut B, raw: &Raw) {
        if self.correction.is_ready(board) {
            // One behind the other, so that the stack has to hold one of them.
            self.correction.end(board);
            self.correct_rates(board, raw);
            self.correction.turn(raw);
        }
    }

    #[inline(never)]
    pub(super) fn correct_rates<B: Board>(&mut self, board: &mut B, raw: &Raw) {
        self.correction.step(
            board,
            raw,
            self.health.next_seq.get().wrapping_sub(1),
            self.motor.output(),
            &self.config,
            self.in_order,
        );
    }

    pub(super) fn step_bias_null<B: Board>(&mut self, board: &mut B, sample: &Sample) {
        let outcome = if self.motor.is_on() {
            Outcome::Moving
        } else {
            self.bias_null.take(&sample.gyro, self.in_order)
        };
        let status = match outcome {
            Outcome::GoesOn => return,
            Outcome::NotInOrder => Status::NotAnswering,
            Outcome::Done if self.take_biases() => Status::Ok,
            _ => Status::Moving,
        };
        self.end_bias_null(board, status);
    }

    /// The means become the biases; false, and nothing changed, when the stand turns.
    pub(super) fn take_biases(&mut self) -> bool {
        let mut largest = 0;
        for ((sum, scale), mean) in (self.bias_null.axes())
            .zip(&self.config.set_up.scale)
            .zip(&mut self.answer.detail)
        {
            let scale = scale.get();
            let found = self.bias_null.mean(sum, scale);
            if found == TURNS {
                return false;
            }
            mean.set(found);
            largest = self.bias_null.error(sum, scale).max(largest);
        }
        self.answer.value.set(largest);
        self.config.set_up.bias = self.answer.detail;
        self.config.set_up.config_source = source::SET;
        true
    }

    /// The reply to the bias measurement that is under way, if one is.
    #[inline(never)]
    pub(super) fn end_bias_null<B: Board>(&mut self, board: &mut B, status: Status) {
        if self.null.is_none() {
            return;
        }
        if !matches!(status, Status::Ok) {
            self.answer.zero();
        }
        let asked = self.null.take();
        self.reply(board, asked, status);
    }
}
