//! The spreads of what is drawn, over many seeds: a stand is as different from the next as parts and rooms are.

use super::*;

const SEEDS: u64 = 2_000;

/// Root mean square.
fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

/// A normal draw of mean 0: its rms is known to 1 / sqrt(2 n), its mean to sigma / sqrt(n); five of these are left.
fn is_normal(what: &str, values: &[f64], sigma: f64) {
    let n = values.len() as f64;
    let off = rms(values) / sigma - 1.0;
    assert!(
        off.abs() < 5.0 / (2.0 * n).sqrt(),
        "{what}: rms off by {off}"
    );
    let mean = values.iter().sum::<f64>() / n;
    assert!(mean.abs() < 5.0 * sigma / n.sqrt(), "{what}: mean {mean}");
}

/// An even draw: all within, the mean in the middle, and the ends come near.
fn is_even(what: &str, values: &[f64], low: f64, high: f64) {
    let n = values.len() as f64;
    assert!(
        values.iter().all(|v| (low..high).contains(v)),
        "{what} leaves {low} .. {high}"
    );
    let sigma = (high - low) / 12f64.sqrt();
    let mean = values.iter().sum::<f64>() / n;
    let middle = low.midpoint(high);
    assert!(
        (mean - middle).abs() < 5.0 * sigma / n.sqrt(),
        "{what}: mean {mean}"
    );
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    assert!(
        most - least > 0.97 * (high - low),
        "{what}: {least} .. {most}"
    );
}

fn of(stands: &[Scenario], each: impl Fn(&Scenario) -> Vec<f64>) -> Vec<f64> {
    stands.iter().flat_map(each).collect()
}

#[test]
fn the_parts_of_a_quiet_stand_spread_as_they_say() {
    let stands: Vec<Scenario> = (0..SEEDS).map(Scenario::quiet).collect();
    let gyros = |each: fn(&GyroPart) -> f64| of(&stands, |s| s.gyros.iter().map(each).collect());
    is_normal("turn-on bias", &gyros(|g| g.turn_on_bias_dps), 0.3);
    is_normal("scale", &gyros(|g| g.scale_error), 0.004);
    is_normal("clock", &gyros(|g| g.clock_ppm), 3000.0);
    is_normal("thermometer", &gyros(|g| g.temp_offset_c), 0.8);
    is_even("phase", &gyros(|g| g.clock_phase), 0.0, 1.0);
    is_normal(
        "zero",
        &of(&stands, |s| s.acc.zero_g_error_v.to_vec()),
        0.03,
    );
    is_normal(
        "sensitivity",
        &of(&stands, |s| s.acc.scale_error.to_vec()),
        0.015,
    );
    is_normal("tilt", &of(&stands, |s| s.base.tilt_deg.to_vec()), 0.5);
    // No two axes alike.
    let alike = stands.iter().any(|s| {
        s.gyros[0].turn_on_bias_dps == s.gyros[1].turn_on_bias_dps
            || s.base.tilt_deg[0] == s.base.tilt_deg[1]
    });
    assert!(!alike);
}

#[test]
fn the_world_of_a_lively_stand_spreads_as_it_says() {
    let stands: Vec<Scenario> = (0..SEEDS).map(Scenario::lively).collect();
    let one = |each: fn(&Scenario) -> f64| of(&stands, |s| vec![each(s)]);
    let gyros = |each: fn(&GyroPart) -> f64| of(&stands, |s| s.gyros.iter().map(each).collect());
    is_even("N", &gyros(|g| g.angle_random_walk_deg_sqrt_h), 3.6, 7.0);
    let walks = gyros(|g| g.rate_random_walk);
    let logs: Vec<f64> = (walks.iter().filter(|k| **k > 0.0))
        .map(|k| k.ln())
        .collect();
    is_even("ln K", &logs, 3e-4_f64.ln(), 5e-3_f64.ln());
    let share = 1.0 - logs.len() as f64 / walks.len() as f64;
    assert!((share - 0.15).abs() < 0.025, "{share} have no K");
    is_even("room", &one(|s| s.thermal.room_c), 18.0, 27.0);
    is_even("drift", &one(|s| s.thermal.drift_c_h), -4.0, 4.0);
    is_even("swing", &one(|s| s.thermal.swing_c), 0.2, 1.0);
    is_even(
        "its period",
        &one(|s| s.thermal.swing_period_s),
        150.0,
        500.0,
    );
    is_even("its phase", &one(|s| s.thermal.swing_phase), 0.0, 1.0);
    let heated: Vec<&Scenario> = (stands.iter().filter(|s| s.thermal.heater_c > 0.0)).collect();
    let share = heated.len() as f64 / stands.len() as f64;
    assert!((share - 0.6).abs() < 0.055, "{share} have a heater");
    let heaters: Vec<f64> = heated.iter().map(|s| s.thermal.heater_c).collect();
    is_even("heater", &heaters, 5.0, 15.0);
    let periods: Vec<f64> = heated.iter().map(|s| s.thermal.heater_period_s).collect();
    is_even("its period", &periods, 100.0, 250.0);
    is_normal("supply", &one(|s| s.supply.open_v - 5.0), 0.03);
    is_even("load", &one(|s| s.supply.load_step_v), 0.03, 0.06);
    is_even("its dwell", &one(|s| s.supply.load_dwell_s), 15.0, 50.0);
    is_even("motor's wire", &one(|s| s.supply.motor_ohm), 0.0, 0.02);
    is_even("floor", &one(|s| s.base.floor_g_rms), 0.0, 0.1);
}
