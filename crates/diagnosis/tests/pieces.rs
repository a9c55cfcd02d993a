//! What is a piece of something without a name has none itself: the first harmonic of what repeats itself in another shape than a
//! sine, and the largest of many strokes.

mod graded;

use std::f64::consts::{PI, TAU};

use graded::{add, graded, named, record, said, told, values};
use model::record::{Quantity, Record};
use rand_core::Rng;
use rand_distr::{Distribution, Exp1, StandardNormal, Uniform};

/// Rate of the records.
const RATE_HZ: f64 = 20.0;

fn between(low: f64, high: f64, rng: &mut impl Rng) -> f64 {
    Uniform::new(low, high).expect("a range").sample(rng)
}

fn count(r: &Record) -> usize {
    values(r, Quantity::Temp).len()
}

/// Shapes by the part of a period.
fn saw_tooth(part: f64) -> f64 {
    2.0 * part - 1.0
}

fn pulse(part: f64) -> f64 {
    (-0.5 * ((part - 0.5) / 0.1).powi(2)).exp()
}

#[test]
fn what_repeats_itself_as_no_sine_is_no_wandering_line() {
    graded("a period that wanders", |run, rng| {
        let mut r = record(&[], 7100 + run);
        let pitch_hz = between(0.4, 8.0, rng);
        let linewidth_hz = between(0.01, 0.1, rng);
        let shape = if run % 2 == 0 { saw_tooth } else { pulse };
        let step = (linewidth_hz / (TAU * RATE_HZ)).sqrt();
        let mut phase = 0.0;
        let course: Vec<f64> = (0..count(&r))
            .map(|_| {
                let walks: f64 = StandardNormal.sample(rng);
                phase += pitch_hz / RATE_HZ + step * walks;
                shape(phase.rem_euclid(1.0))
            })
            .collect();
        add(&mut r, "gyro_x", |i| 0.3 * course[i]);
        let d = told(&r);
        let told_of = d.unexplained.iter().any(|u| u.channel == "gyro_x");
        let wrong = named(&d).iter().any(|n| n.0 != "line");
        (told_of && !wrong)
            .then_some(())
            .ok_or_else(|| format!("{pitch_hz} Hz, {linewidth_hz} Hz: {}", said(&d)))
    });
}

#[test]
fn the_largest_of_many_strokes_is_no_shock() {
    graded("strokes of all sizes", |run, rng| {
        let mut r = record(&[], 7200 + run);
        let (apart_s, lasts_s) = (between(4.0, 8.0, rng), between(0.8, 1.5, rng));
        let count = count(&r);
        let mut course = vec![0.0; count];
        let mut at: f64 = 0.0;
        loop {
            let gap: f64 = Exp1.sample(rng);
            at += apart_s * gap;
            if at > count as f64 / RATE_HZ {
                break;
            }
            let (a, b): (f64, f64) = (Exp1.sample(rng), Exp1.sample(rng));
            let from = (at * RATE_HZ) as usize;
            let to = (from + (lasts_s * RATE_HZ) as usize).min(count);
            for (i, v) in course[from..to].iter_mut().enumerate() {
                *v += 0.3 * (a - b) * (PI * i as f64 / RATE_HZ / lasts_s).sin();
            }
        }
        add(&mut r, "gyro_x", |i| course[i]);
        let d = told(&r);
        let wrong = named(&d).iter().any(|n| n.0 == "shock");
        (!wrong && !d.unexplained.is_empty())
            .then_some(())
            .ok_or_else(|| said(&d))
    });
}
