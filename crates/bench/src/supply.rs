//! The 5-V rail: regulator wander, a load that switches, and the motor's current in the common wire.

use rand_xoshiro::Xoshiro256PlusPlus;

use crate::random::{Stream, standard_normal, uniform};
use crate::scenario::SupplyPart;

const WANDER_TAU_S: f64 = 60.0;

/// The rail.
#[derive(Clone, Debug)]
pub struct Supply {
    part: SupplyPart,
    rng: Xoshiro256PlusPlus,
    wander_v: f64,
    loaded: bool,
    next_switch_s: f64,
    volts: f64,
}

impl Supply {
    /// Without load.
    #[must_use]
    pub fn new(part: SupplyPart, seed: u64) -> Self {
        let mut rng = Stream::Supply.of(seed);
        let wander_v = part.wander_v * standard_normal(&mut rng);
        let volts = part.open_v + wander_v;
        let next_switch_s = dwell(&part, &mut rng);
        Supply {
            part,
            rng,
            wander_v,
            loaded: false,
            next_switch_s,
            volts,
        }
    }

    /// Moves on by `dt` s to the time `t` s while the motor takes `motor_a` A.
    pub fn step(&mut self, t: f64, dt: f64, motor_a: f64) {
        let keep = (-dt / WANDER_TAU_S).exp();
        if self.part.wander_v > 0.0 {
            self.wander_v = keep * self.wander_v
                + self.part.wander_v * (1.0 - keep * keep).sqrt() * standard_normal(&mut self.rng);
        }
        while self.part.load_step_v != 0.0 && t >= self.next_switch_s {
            self.loaded = !self.loaded;
            self.next_switch_s += dwell(&self.part, &mut self.rng);
        }
        let load = if self.loaded {
            self.part.load_step_v
        } else {
            0.0
        };
        self.volts = self.part.open_v + self.wander_v - load - self.part.motor_ohm * motor_a.abs();
    }

    /// V.
    #[must_use]
    pub fn volts(&self) -> f64 {
        self.volts
    }
}

/// Exponential with the part's mean.
fn dwell(part: &SupplyPart, rng: &mut Xoshiro256PlusPlus) -> f64 {
    -part.load_dwell_s * (1.0 - uniform(rng, 0.0, 1.0)).ln()
}
