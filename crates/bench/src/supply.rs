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

#[cfg(test)]
mod tests {
    use super::*;

    fn part() -> SupplyPart {
        SupplyPart {
            open_v: 5.02,
            motor_ohm: 0.25,
            wander_v: 0.0,
            load_step_v: 0.0,
            load_dwell_s: 20.0,
        }
    }

    #[test]
    fn a_motor_pulls_it_down_by_its_wire_either_way() {
        let mut supply = Supply::new(part(), 3);
        assert!((supply.volts() - 5.02).abs() < 1e-12);
        for amps in [0.4, -0.4] {
            supply.step(1.0, 1e-3, amps);
            assert!((supply.volts() - (5.02 - 0.1)).abs() < 1e-12);
        }
    }

    #[test]
    fn a_load_comes_and_goes_after_dwells_of_its_mean() {
        let loaded = SupplyPart {
            load_step_v: 0.06,
            ..part()
        };
        let mut supply = Supply::new(loaded, 3);
        let (mut switches, mut with, mut before) = (0, 0, supply.volts());
        let n = 400_000;
        for k in 1..=n {
            supply.step(f64::from(k) * 0.1, 0.1, 0.0);
            let volts = supply.volts();
            assert!(
                (volts - 5.02).abs() < 1e-9 || (volts - 4.96).abs() < 1e-9,
                "{volts}"
            );
            switches += i32::from((volts - before).abs() > 0.01);
            with += i32::from(volts < 5.0);
            before = volts;
        }
        // 40 000 s of 20 s each: 2000 switches, 2.2 % rms.
        assert!(
            (f64::from(switches) / 2000.0 - 1.0).abs() < 0.08,
            "{switches}"
        );
        assert!((f64::from(with) / f64::from(n) - 0.5).abs() < 0.05);
    }

    #[test]
    fn it_wanders_by_its_rms_with_a_minutes_memory() {
        let wanders = SupplyPart {
            wander_v: 0.01,
            ..part()
        };
        // At the start it is anywhere in its range already.
        let starts: Vec<f64> = (0..400)
            .map(|seed| Supply::new(wanders.clone(), seed).volts() - 5.02)
            .collect();
        let rms = |x: &[f64]| (x.iter().map(|v| v * v).sum::<f64>() / x.len() as f64).sqrt();
        assert!((rms(&starts) / 0.01 - 1.0).abs() < 0.12);
        let mut supply = Supply::new(wanders, 3);
        let course: Vec<f64> = (1..=60_000)
            .map(|k| {
                supply.step(f64::from(k), 1.0, 0.0);
                supply.volts() - 5.02
            })
            .collect();
        assert!((rms(&course) / 0.01 - 1.0).abs() < 0.12, "{}", rms(&course));
        let later = course[60..]
            .iter()
            .zip(&course)
            .map(|(a, b)| a * b)
            .sum::<f64>();
        let all = course.iter().map(|a| a * a).sum::<f64>();
        // After a minute e^-1 of it is left.
        assert!(
            (later / all - (-1f64).exp()).abs() < 0.12,
            "{}",
            later / all
        );
    }
}
