//! The motor's command: never faster than its limits, never a jump. That it is off unless the PC is there is the board's
//! part (see [`Board::keep_alive`](crate::Board::keep_alive)).

use crate::math::{divide, scaled, times, upper};

/// The motor turns no longer than this without a word from the PC, ms.
pub const KEEP_ALIVE_MS: u8 = 200;
/// Default ramp, command steps a second: from rest to full in half a second.
pub const DEFAULT_RAMP_PER_S: u16 = 510;
/// Milliseconds that it rests before it turns the other way, whatever the ramp: longer than a small motor's current takes to
/// die away (some tenths of a millisecond to a millisecond), so that the bridge never reverses under current.
const DEAD_MS: i8 = 3;
/// Largest command.
pub const FULL: i16 = 255;

/// Shapes of a profile, as on the wire.
mod shape {
    pub const STOP: u8 = wire::Shape::Stop as u8;
    pub const STEPS: u8 = wire::Shape::Steps as u8;
    pub const TRIANGLE: u8 = wire::Shape::Triangle as u8;
    pub const SINE: u8 = wire::Shape::Sine as u8;
}

/// Whether a command is in its range.
#[inline(never)]
#[must_use]
pub fn is_duty(duty: i16) -> bool {
    (-FULL..=FULL).contains(&duty)
}

/// Command, limits and what is put out now.
#[derive(Clone, Copy, Debug)]
pub struct Motor {
    target: i16,
    /// Output in Q6 steps.
    output_q6: i16,
    /// The same in whole steps.
    output: i16,
    /// Milliseconds until it may turn the other way, with the sign of the way that it turned.
    dead: i8,
    max_duty: i16,
    /// Q6 steps a millisecond.
    ramp_q6: i16,
    shape: u8,
    /// Periods left; 0 for as long as the PC is there.
    cycles: u8,
    amplitude: i16,
    offset: i16,
    /// Part of the period that has passed, in 2^-32, and what a millisecond adds.
    phase: u32,
    phase_per_ms: u32,
}

impl Motor {
    /// At rest, with limits of zero: it does not turn before [`limit`](Self::limit).
    #[must_use]
    pub const fn new() -> Self {
        Self {
            target: 0,
            output_q6: 0,
            output: 0,
            dead: 0,
            max_duty: 0,
            ramp_q6: 0,
            shape: shape::STOP,
            cycles: 0,
            amplitude: 0,
            offset: 0,
            phase: 0,
            phase_per_ms: 0,
        }
    }

    /// Brings it to rest at once and sets its limits: largest magnitude 0..=255; largest change, steps a second.
    #[inline(never)]
    pub fn limit(&mut self, max_duty: u8, ramp_per_s: u16) {
        self.cut();
        self.max_duty = max_duty.into();
        // steps/s -> Q6 steps/ms: * 64 / 1000, which is 4194 / 2^16 to 8e-5; at least the smallest there is.
        self.ramp_q6 = upper(ramp_per_s, 4_194).max(1).cast_signed();
    }

    /// New command, which ends a profile; what is beyond the limit is cut to it. Returns the command that holds.
    #[inline(never)]
    pub fn command(&mut self, duty: i16) -> i16 {
        self.shape = shape::STOP;
        self.aim(duty);
        self.target
    }

    #[inline(never)]
    fn aim(&mut self, duty: i16) {
        // Not `clamp`, which panics where the limits are crossed.
        self.target = duty.min(self.max_duty).max(self.max_duty.wrapping_neg());
    }

    /// New profile about `offset`, `cycles` periods of `period_ms` long (0: endless); false, and nothing changed, when
    /// there is no such shape or an argument is out of range.
    pub fn profile(
        &mut self,
        shape: u8,
        amplitude: i16,
        offset: i16,
        period_ms: u16,
        cycles: u8,
    ) -> bool {
        let this = crate::math::somewhere(self);
        if shape == shape::STOP {
            this.command(0);
            return true;
        }
        if shape > shape::SINE || period_ms < 2 || !is_duty(amplitude) || !is_duty(offset) {
            return false;
        }
        (this.shape, this.cycles) = (shape, cycles);
        (this.amplitude, this.offset) = (amplitude, offset);
        this.phase = 0;
        // Rounded up, so that the last millisecond of a period completes it.
        this.phase_per_ms = divide(u32::MAX, period_ms).wrapping_add(1);
        true
    }

    /// A millisecond of the profile.
    fn step_profile(&mut self) {
        // -1 .. 1 in Q14 over the period.
        let part = ((self.phase >> 16) as u16).cast_signed();
        let height = match self.shape {
            shape::STEPS => {
                if part >= 0 {
                    1 << 14
                } else {
                    -(1 << 14)
                }
            }
            shape::TRIANGLE => {
                // From -1 at the start up to 1 at the middle.
                (part.unsigned_abs().wrapping_sub(1 << 14)).cast_signed()
            }
            _ => sine_q14(part),
        };
        // Q14.
        let swing = times(i32::from(self.amplitude << 2), height);
        self.aim(self.offset.wrapping_add(swing as i16));
        let (phase, ended) = self.phase.overflowing_add(self.phase_per_ms);
        self.phase = phase;
        if ended && self.cycles > 0 {
            self.cycles = self.cycles.wrapping_sub(1);
            if self.cycles == 0 {
                self.command(0);
            }
        }
    }

    /// What is put out now, -255..=255.
    #[must_use]
    pub fn output(&self) -> i16 {
        self.output
    }

    /// Whether it turns or is to turn.
    #[must_use]
    #[inline(never)]
    pub fn is_on(&self) -> bool {
        self.turns()
    }

    /// The same in line, for what asks each millisecond.
    #[inline(always)]
    pub fn turns(&self) -> bool {
        self.output_q6 != 0 || self.target != 0 || self.shape != shape::STOP
    }

    /// Off at once, without the ramp: for faults.
    #[inline(never)]
    pub fn cut(&mut self) {
        let this = crate::math::somewhere(self);
        this.target = 0;
        this.output_q6 = 0;
        this.output = 0;
        this.shape = shape::STOP;
    }

    /// A millisecond has passed. `on` is what [`is_on`](Self::is_on) says.
    #[inline(always)]
    pub fn on_millisecond(&mut self, on: bool) {
        // One that is not on puts nothing out.
        if on && self.output != 0 {
            self.dead = if self.output < 0 { -DEAD_MS } else { DEAD_MS };
        } else if self.dead > 0 {
            self.dead = self.dead.wrapping_sub(1);
        } else if self.dead < 0 {
            self.dead = self.dead.wrapping_add(1);
        }
        if !on {
            return;
        }
        if self.shape != shape::STOP {
            self.step_profile();
        }
        let step = (self.target << 6)
            .wrapping_sub(self.output_q6)
            .min(self.ramp_q6)
            .max(self.ramp_q6.wrapping_neg());
        self.output_q6 = self.output_q6.wrapping_add(step);
        if self.dead > 0 && self.output_q6 < 0 || self.dead < 0 && self.output_q6 > 0 {
            self.output_q6 = 0;
        }
        // Towards zero, as a division rounds.
        let round = if self.output_q6 < 0 { 63 } else { 0 };
        self.output = self.output_q6.wrapping_add(round) >> 6;
    }
}

impl Default for Motor {
    fn default() -> Self {
        Self::new()
    }
}

/// The sine of `part` / 2^16 of a turn, Q14: a parabola over each half turn, then once corrected by its own square; off
/// by 0.0011 at most (0.3 steps of 255).
#[inline(never)]
fn sine_q14(part: i16) -> i16 {
    // x in -1 .. 1 (Q15), y = 4 x (1 - |x|) in Q14, and y + 0.225 (y |y| - y).
    let y = times_q14(part, 32_768u16.wrapping_sub(part.unsigned_abs()));
    let square = times_q14(y, y.unsigned_abs());
    y.wrapping_add(times_q14(square.wrapping_sub(y), 3_686))
}

/// `a * b / 2^14`, rounded down.
#[inline(never)]
fn times_q14(a: i16, b: u16) -> i16 {
    (scaled(a, b) >> 14) as i16
}

#[cfg(test)]
mod tests {
    use super::*;

    fn motor(max_duty: u8, ramp_per_s: u16) -> Motor {
        let mut motor = Motor::new();
        motor.limit(max_duty, ramp_per_s);
        motor
    }

    #[test]
    fn what_was_cut_stays_off() {
        for profile in [false, true] {
            let mut motor = motor(255, DEFAULT_RAMP_PER_S);
            if profile {
                assert!(motor.profile(shape::SINE, 100, 0, 1000, 0));
            } else {
                motor.command(255);
            }
            (0..100).for_each(|_| motor.on_millisecond(motor.is_on()));
            assert_ne!(motor.output(), 0);
            motor.cut();
            (0..400).for_each(|_| {
                motor.on_millisecond(motor.is_on());
                assert_eq!(motor.output(), 0);
            });
            assert!(!motor.is_on());
        }
    }

    #[test]
    fn it_never_jumps_and_never_passes_its_limit() {
        let mut motor = motor(100, 500);
        motor.command(255);
        let (mut before, mut highest) = (0, 0);
        for _ in 0..1000 {
            motor.on_millisecond(motor.is_on());
            assert!(motor.output() - before <= 1);
            before = motor.output();
            highest = highest.max(before);
        }
        assert_eq!(highest, 100);
    }

    #[test]
    fn it_rests_before_it_turns_the_other_way_whatever_the_ramp() {
        for ramp in [510, 20_000, u16::MAX] {
            let mut motor = motor(255, ramp);
            let (mut way, mut rested, mut turns) = (0, 0, 0);
            for ms in 0..4000 {
                motor.command(if ms / 1000 % 2 == 0 { 255 } else { -255 });
                motor.on_millisecond(motor.is_on());
                let now = motor.output().signum();
                if now == 0 {
                    rested += 1;
                } else {
                    if way == -now {
                        assert!(rested >= DEAD_MS, "{rested} ms at ramp {ramp}");
                        turns += 1;
                    }
                    (way, rested) = (now, 0);
                }
            }
            assert_eq!(turns, 3);
        }
    }

    #[test]
    fn a_cut_does_not_shorten_the_rest() {
        let mut motor = motor(255, u16::MAX);
        motor.command(255);
        (0..10).for_each(|_| motor.on_millisecond(motor.is_on()));
        motor.cut();
        motor.command(-255);
        motor.on_millisecond(motor.is_on());
        assert_eq!(motor.output(), 0);
    }

    #[test]
    fn a_motor_without_limits_set_does_not_turn() {
        let mut motor = Motor::new();
        assert_eq!(motor.command(255), 0);
        motor.on_millisecond(motor.is_on());
        assert_eq!(motor.output(), 0);
    }

    /// The targets of a profile, ms by ms.
    fn targets(shape: u8, amplitude: i16, offset: i16, period_ms: u16, cycles: u8) -> Vec<i16> {
        let mut motor = motor(255, u16::MAX);
        assert!(motor.profile(shape, amplitude, offset, period_ms, cycles));
        (0..2 * u32::from(period_ms))
            .map(|_| {
                motor.on_millisecond(motor.is_on());
                motor.target
            })
            .collect()
    }

    #[test]
    fn the_shapes_are_what_they_are_called() {
        let period = 1000u16;
        for (ms, &duty) in targets(shape::SINE, 200, 20, period, 0).iter().enumerate() {
            let exact =
                20.0 + 200.0 * (std::f64::consts::TAU * ms as f64 / f64::from(period)).sin();
            assert!(
                (f64::from(duty) - exact).abs() <= 1.0,
                "{ms} ms: {duty}, sine {exact}"
            );
        }
        let steps = targets(shape::STEPS, 50, -10, period, 0);
        assert!(
            steps[..500].iter().all(|&duty| duty == 40)
                && steps[501..1000].iter().all(|&duty| duty == -60)
        );
        let triangle = targets(shape::TRIANGLE, 100, 0, period, 0);
        assert_eq!(
            (triangle[0], triangle[250], triangle[500], triangle[750]),
            (-100, 0, 100, 0)
        );
    }

    #[test]
    fn a_profile_ends_after_its_cycles_and_goes_to_rest() {
        let targets = targets(shape::STEPS, 50, 100, 100, 1);
        assert_eq!(targets.iter().position(|&duty| duty == 0), Some(99));
        assert!(targets[99..].iter().all(|&duty| duty == 0));
    }

    #[test]
    fn a_profile_without_cycles_does_not_end_by_itself() {
        // A count of a byte would have gone round.
        let targets = {
            let mut motor = motor(255, u16::MAX);
            assert!(motor.profile(shape::STEPS, 50, 0, 2, 0));
            (0..2 * 600).map(move |_| {
                motor.on_millisecond(motor.is_on());
                motor.target
            })
        };
        assert!(targets.into_iter().all(|duty| duty.abs() == 50));
        let mut many = motor(255, u16::MAX);
        assert!(many.profile(shape::STEPS, 50, 0, 2, 255));
        let on = (0..2 * 600).map(|_| {
            many.on_millisecond(many.is_on());
            many.target
        });
        assert_eq!(on.filter(|&duty| duty != 0).count(), 2 * 255 - 1);
    }

    #[test]
    fn from_rest_it_starts_with_the_next_millisecond_either_way() {
        for way in [1, -1] {
            for rested in 0..6 {
                let mut motor = motor(255, 64_000);
                (0..rested).for_each(|_| motor.on_millisecond(motor.is_on()));
                motor.command(way * 255);
                motor.on_millisecond(motor.is_on());
                // 64 steps a millisecond, of which 4194 / 2^16 makes some thousandths less.
                assert_eq!(motor.output(), way * 63, "{way} after {rested} ms");
                assert!(motor.is_on());
            }
        }
    }

    #[test]
    fn its_ramp_is_in_steps_a_second_and_never_stands_still() {
        for ramp in [510, 1_000, 250, 40] {
            let mut motor = motor(255, ramp);
            motor.command(255);
            let full = (1..60_000).find(|_| {
                motor.on_millisecond(motor.is_on());
                motor.output() == 255
            });
            // Never faster, and slower by less than a 64th of a step in a millisecond and what 4194 / 2^16 lacks.
            let exact = f64::from(ramp) * 0.064;
            let full = f64::from(full.expect("it gets there"));
            let least = 255.0 * 64.0 / exact;
            let most = 255.0 * 64.0 / (exact - 1.01);
            assert!((least..=most + 1.0).contains(&full), "{ramp}: {full} ms");
        }
        let mut motor = motor(255, 0);
        motor.command(3);
        (0..3 * 64).for_each(|_| motor.on_millisecond(motor.is_on()));
        assert_eq!(motor.output(), 3);
    }

    #[test]
    fn what_is_out_of_range_changes_nothing() {
        let mut motor = motor(255, 510);
        for (shape, amplitude, offset, period) in [
            (4, 1, 0, 100),
            (1, 256, 0, 100),
            (1, 0, -256, 100),
            (1, 1, 0, 1),
        ] {
            assert!(!motor.profile(shape, amplitude, offset, period, 0));
            assert!(!motor.is_on());
        }
    }
}
