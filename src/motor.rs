//! The motor: off unless the PC is there, never faster than its limits, never a jump.

/// The motor turns no longer than this without a word from the PC, ms.
pub const KEEP_ALIVE_MS: u8 = 200;
/// Default ramp, command steps a second: from rest to full in half a second.
pub const DEFAULT_RAMP_PER_S: u16 = 510;

/// Command, limits and what is put out now.
#[derive(Clone, Copy, Debug)]
pub struct Motor {
    target: i16,
    /// Output in Q6 steps.
    output_q6: i16,
    max_duty: i16,
    /// Q6 steps a millisecond.
    ramp_q6: i16,
    alive_ms: u8,
}

impl Motor {
    /// At rest. Limits: largest magnitude 0..=255; largest change, steps a second.
    #[must_use]
    #[inline(never)]
    pub fn new(max_duty: u8, ramp_per_s: u16) -> Self {
        // steps/s -> Q6 steps/ms: * 64 / 1000, which is 4194 / 2^16 to 8e-5; at least the smallest there is.
        let ramp_q6 = (u32::from(ramp_per_s).wrapping_mul(4_194) >> 16).max(1);
        Self {
            target: 0,
            output_q6: 0,
            max_duty: i16::from(max_duty),
            ramp_q6: ramp_q6 as i16,
            alive_ms: 0,
        }
    }

    /// A word from the PC.
    pub fn keep_alive(&mut self) {
        self.alive_ms = KEEP_ALIVE_MS;
    }

    /// Whether the PC was heard in time.
    #[must_use]
    pub fn is_alive(&self) -> bool {
        self.alive_ms > 0
    }

    /// New command; what is beyond the limit is cut to it. Returns the command that holds.
    #[inline(never)]
    pub fn command(&mut self, duty: i16) -> i16 {
        // Not `clamp`, which panics where the limits are crossed.
        self.target = duty.min(self.max_duty).max(self.max_duty.wrapping_neg());
        self.target
    }

    /// What is put out now, -255..=255.
    #[must_use]
    pub fn output(&self) -> i16 {
        self.output_q6 / 64
    }

    /// Whether it turns or is to turn.
    #[must_use]
    #[inline(never)]
    pub fn is_on(&self) -> bool {
        self.output_q6 != 0 || self.target != 0
    }

    /// Off at once, without the ramp: for faults.
    pub fn cut(&mut self) {
        self.target = 0;
        self.output_q6 = 0;
        self.alive_ms = 0;
    }

    /// A millisecond has passed. True when the motor was cut because the PC fell silent.
    #[inline(never)]
    pub fn on_millisecond(&mut self) -> bool {
        if self.alive_ms > 0 {
            self.alive_ms = self.alive_ms.wrapping_sub(1);
        } else if self.is_on() {
            self.cut();
            return true;
        }
        let step = (self.target * 64 - self.output_q6)
            .min(self.ramp_q6)
            .max(self.ramp_q6.wrapping_neg());
        self.output_q6 = self.output_q6.wrapping_add(step);
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_cut_200_ms_after_the_last_word() {
        let mut motor = Motor::new(255, DEFAULT_RAMP_PER_S);
        motor.keep_alive();
        motor.command(255);
        let cut_at = (1..=400).find(|_| motor.on_millisecond());
        assert_eq!(cut_at, Some(i32::from(KEEP_ALIVE_MS) + 1));
        assert_eq!(motor.output(), 0);
        assert!(!(0..400).any(|_| motor.on_millisecond()), "counted once");
    }

    #[test]
    fn it_never_jumps_and_never_passes_its_limit() {
        let mut motor = Motor::new(100, 500);
        motor.command(255);
        let (mut before, mut highest) = (0, 0);
        for _ in 0..1000 {
            motor.keep_alive();
            motor.on_millisecond();
            assert!(motor.output() - before <= 1);
            before = motor.output();
            highest = highest.max(before);
        }
        assert_eq!(highest, 100);
    }
}
