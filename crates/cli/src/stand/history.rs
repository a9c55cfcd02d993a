//! The same stand again: under another history, without what is planted in it, and without any error of its gyros.

use bench::{Fault, Scenario, uniform};
use rand_core::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

/// Commands of a motor that spins free in steps, from `from_s` on.
pub(super) fn steps(rng: &mut Xoshiro256PlusPlus, from_s: f64, seconds: f64) -> Vec<(f64, i16)> {
    let mut steps = vec![];
    let mut at = from_s;
    while at < seconds - 5.0 {
        steps.push((at, uniform(rng, -255.0, 256.0) as i16));
        at += uniform(rng, 8.0, 30.0);
    }
    steps
}

/// The course of the motor in a record of `seconds` that begins with a rest: times since its begin, s, and commands.
#[must_use]
pub fn course(seed: u64, rest_s: f64, seconds: f64) -> Vec<(f64, i16)> {
    let rng = &mut Xoshiro256PlusPlus::seed_from_u64(seed ^ 0x6d6f_746f_7273);
    steps(rng, rest_s, seconds)
}

/// The same parts with the same things wrong, on another day: other noise, and another room, heater and sway within what
/// [`Scenario::lively`] draws; the room within 1.5 degC of the first.
#[must_use]
pub fn another_history(scenario: &Scenario, seed: u64) -> Scenario {
    let mut again = scenario.clone();
    again.seed = seed;
    let rng = &mut Xoshiro256PlusPlus::seed_from_u64(seed ^ 0x0068_6973_746f_7279);
    let thermal = &mut again.thermal;
    thermal.room_c += uniform(rng, -1.5, 1.5);
    thermal.drift_c_h = uniform(rng, -4.0, 4.0);
    thermal.swing_c = uniform(rng, 0.2, 1.0);
    thermal.swing_period_s = uniform(rng, 150.0, 500.0);
    thermal.swing_phase = uniform(rng, 0.0, 1.0);
    thermal.heater_period_s = uniform(rng, 100.0, 250.0);
    again.supply.load_dwell_s = uniform(rng, 15.0, 50.0);
    again.base.sway_deg *= uniform(rng, 0.7, 1.3);
    again.base.sway_period_s *= uniform(rng, 0.7, 1.3);
    again
}

/// The same history of the same stand with nothing wrong: sound parts as the seed of the stand draws them, and of what is
/// planted only what moves the base. What a perfect correction leaves.
#[must_use]
pub fn without_defects(scenario: &Scenario, stand: u64) -> Scenario {
    let mut sound = scenario.clone();
    sound.gyros = Scenario::lively(stand).gyros;
    sound.crystal_ppm = 0.0;
    sound.faults = moving(&scenario.faults);
    sound
}

/// The same history read by gyros without any error: the true rates, behind the parts' filters and rounded.
#[must_use]
pub fn without_errors(scenario: &Scenario, stand: u64) -> Scenario {
    let mut exact = without_defects(scenario, stand);
    for gyro in &mut exact.gyros {
        gyro.angle_random_walk_deg_sqrt_h = 0.0;
        gyro.rate_random_walk = 0.0;
        gyro.turn_on_bias_dps = 0.0;
        gyro.scale_error = 0.0;
    }
    exact
}

/// What moves the base, without what it does to the gyros besides.
fn moving(faults: &[Fault]) -> Vec<Fault> {
    let moves = faults.iter().filter_map(|fault| match *fault {
        Fault::Knock {
            gyro,
            time_s,
            tilt_deg,
            ..
        } => Some(Fault::Knock {
            gyro,
            time_s,
            step_dps: 0.0,
            tilt_deg,
        }),
        Fault::Vibration { .. } | Fault::Shove { .. } | Fault::Bump { .. } => Some(fault.clone()),
        _ => None,
    });
    moves.collect()
}
