//! Tests of [`super`].

use std::f64::consts::TAU;
use std::sync::Arc;

use super::*;
use crate::test_level::OMNIBUS_LEVEL;

const N: usize = 12_000;
const RATE_HZ: f64 = 20.0;

fn white(seed: u64) -> Vec<f64> {
    crate::fit::white(N, seed)
}

/// A command that goes through levels of either sign, each held for 6.5 s.
fn command(seed: u64) -> Vec<f64> {
    let levels = white(1000 + seed);
    let held = |i: usize| (80.0 * levels[i / 130]).clamp(-255.0, 255.0).round();
    (0..N).map(held).collect()
}

fn signals(command: &[f64]) -> Vec<Signal> {
    let values = Arc::new(command.to_vec());
    vec![Signal {
        name: "pwm".into(),
        quantity: Quantity::Pwm,
        axis: None,
        unit: "counts".into(),
        smooth: Arc::clone(&values),
        values,
        lsb: None,
        moving: false,
    }]
}

/// Chances of colour, order and leaning.
fn chances(e: &[f64], command: &[f64]) -> [f64; 3] {
    let signals = signals(command);
    let view = View {
        channel: "gyro_x",
        axis: None,
        lsb: None,
        white_sigma: 1.0,
        neighbours_sigma: 1.0,
        rate_hz: RATE_HZ,
        samples: N,
        base: None,
        moving: false,
        signals: &signals,
    };
    let lengths = lengths(N, RATE_HZ);
    let spectra: Vec<Spectra> = lengths.iter().map(|l| Spectra::new(e, *l)).collect();
    let steady = spectra.iter().map(|s| vec![0.0; s.bands().len()]);
    let steady: Vec<Vec<f64>> = steady.collect();
    let courses = courses(&view, N);
    let order = order(&view, e, &spectra).map_or(1.0, |o| o.p_value);
    let colour = colour(RATE_HZ, None, &courses, &spectra, &steady);
    [colour.p_value, order, leaning(e, &courses).p_value]
}

#[test]
fn white_noise_follows_nothing_more_often_than_the_chances_say() {
    let runs = 200;
    let mut low = [0; 3];
    for seed in 0..runs {
        let all = chances(&white(seed), &command(seed));
        let counted = low.iter_mut().zip(all);
        counted.for_each(|(l, p)| *l += usize::from(p < 0.02));
    }
    // 4 are expected at most, for what is asked many times is not independent.
    assert!(low.iter().all(|l| *l <= 11), "{low:?}");
}

#[test]
fn a_ripple_at_the_speed_of_a_motor_that_is_late_is_an_order() {
    for (seed, pitch) in [(1, 6.0), (2, 14.0), (3, 30.0)] {
        let v = command(seed);
        let mut angle = 0.0;
        let speed = lagged(&v, 0.5 * RATE_HZ);
        let e = speed.iter().zip(white(seed)).map(|(s, e)| {
            angle += TAU * pitch * s / 255.0 / RATE_HZ;
            e + 0.45 * angle.sin()
        });
        let e: Vec<f64> = e.collect();
        let order = chances(&e, &v)[1];
        assert!(order < OMNIBUS_LEVEL, "{pitch} Hz: {order}");
    }
}

#[test]
fn a_hum_while_the_motor_runs_has_a_colour_that_follows_it() {
    let v: Vec<f64> = command(4).iter().map(|v| v.max(0.0)).collect();
    let hum = lagged(&white(5), 3.0);
    let e: Vec<f64> = (white(4).iter().zip(&hum).zip(&v))
        .map(|((e, h), v)| e + 1.2 * h * f64::from(u8::from(*v > 0.0)))
        .collect();
    let colour = chances(&e, &v)[0];
    assert!(colour < OMNIBUS_LEVEL, "{colour}");
}

#[test]
fn what_winds_up_and_slips_leans_the_way_the_motor_turns() {
    let v = command(6);
    let (mut wound, mut e) = (0.0, white(6));
    for (e, v) in e.iter_mut().zip(&v) {
        wound += v / 255.0;
        *e -= v / 255.0;
        if wound.abs() > 6.0 {
            *e += wound;
            wound = 0.0;
        }
    }
    let leaning = chances(&e, &v)[2];
    assert!(leaning < OMNIBUS_LEVEL, "{leaning}");
}
