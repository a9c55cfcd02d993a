//! What is a piece of something without a name has none itself: the first harmonic of what repeats itself in another shape than a
//! sine, the largest of many strokes, the band of a mode that an acceleration or another axis drives, a tone that the command shifts,
//! a zero in steps of the temperature, noise that a line swells. Nor has what is like something in its spectrum alone, or in
//! the place and width of it: noise between two edges, spikes in pairs. Nor is a tone that
//! the shaking bends noise.

mod graded;

use std::f64::consts::{PI, TAU};

use diagnosis::result::Diagnosis;
use graded::{add, graded, named, record, said, told, values};
use model::record::{Quantity, Record};
use rand_core::Rng;
use rand_distr::{Distribution, Exp1, StandardNormal, Uniform};

/// Rate of the records.
const RATE_HZ: f64 = 20.0;

/// Full duty, counts.
const FULL: f64 = 100.0;

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

/// What a mode of that frequency and linewidth makes of a drive, over its own rms.
fn rung(drive: &[f64], (pitch_hz, linewidth_hz): (f64, f64)) -> Vec<f64> {
    let keep = (-PI * linewidth_hz / RATE_HZ).exp();
    let turn = 2.0 * keep * (TAU * pitch_hz / RATE_HZ).cos();
    let (mut last, mut before) = (0.0, 0.0);
    let next = |v: &f64| {
        (last, before) = (turn * last - keep * keep * before + v, last);
        last
    };
    let all: Vec<f64> = drive.iter().map(next).collect();
    let rms = (all.iter().map(|v| v * v).sum::<f64>() / all.len() as f64).sqrt();
    all.iter().map(|v| v / rms).collect()
}

/// Whether something is told of gyro_x, and nothing is named that would be wrong.
fn told_without(
    d: &Diagnosis,
    is_wrong: impl Fn(&str) -> bool,
    of: impl Fn() -> String,
) -> Result<(), String> {
    let told_of = d.unexplained.iter().any(|u| u.channel.contains("gyro_x"));
    let wrong = named(d).iter().any(|n| is_wrong(n.0));
    (told_of && !wrong)
        .then_some(())
        .ok_or_else(|| format!("{}: {}", of(), said(d)))
}

/// The same of bands.
fn no_band(d: &Diagnosis, of: impl Fn() -> String) -> Result<(), String> {
    told_without(d, |n| ["narrow_band", "wandering_line"].contains(&n), of)
}

/// Shakes the first accelerometer by so many counts; the shaking, over its rms.
fn shaken(r: &mut Record, counts: f64, rng: &mut impl Rng) -> Vec<f64> {
    let shakes: Vec<f64> = (0..count(r)).map(|_| StandardNormal.sample(rng)).collect();
    let felt = r.channels.iter_mut().find(|c| c.quantity == Quantity::Acc);
    let felt = felt.expect("an accelerometer");
    let lsb = felt.lsb.expect("counts");
    let each = felt.values.iter_mut().zip(&shakes);
    each.for_each(|(v, a)| *v = ((*v / lsb) + counts * a).round() * lsb);
    shakes
}

#[test]
fn a_mode_that_an_acceleration_drives_is_no_noise_of_the_sensor() {
    graded("a mode behind an acceleration", |run, rng| {
        let mut r = record(&[], 7300 + run);
        let mode = (between(0.8, 8.0, rng), between(0.05, 0.3, rng));
        // Beside the noise of the sensor.
        let shakes = shaken(&mut r, 3.0, rng);
        let course = rung(&shakes, mode);
        add(&mut r, "gyro_x", |i| 0.12 * course[i]);
        no_band(&told(&r), || format!("{mode:?}"))
    });
}

#[test]
fn a_mode_that_another_axis_drives_is_none_of_this_one() {
    graded("a mode behind another axis", |run, rng| {
        let mut r = record(&[], 7400 + run);
        let mode = (between(0.8, 8.0, rng), between(0.1, 0.4, rng));
        let other = r.channels.iter().find(|c| c.name == "gyro_y");
        let course = rung(&other.expect("an axis").values.clone(), mode);
        add(&mut r, "gyro_x", |i| 0.15 * course[i]);
        no_band(&told(&r), || format!("{mode:?}"))
    });
}

#[test]
fn a_tone_whose_phase_the_command_shifts_is_no_wandering_line() {
    graded("a phase behind the command", |run, rng| {
        let mut r = record(&[], 7600 + run);
        let (pitch_hz, late) = (between(0.5, 8.0, rng), between(4.0, 10.0, rng));
        let mut left = 0;
        let mut level = 0.0;
        let commands = r.channels.iter_mut().find(|c| c.quantity == Quantity::Pwm);
        let commands = commands.expect("a command");
        for v in &mut commands.values {
            if left == 0 {
                left = (between(5.0, 20.0, rng) * RATE_HZ) as usize;
                level = between(-1.0, 1.0, rng);
            }
            left -= 1;
            *v = (FULL * level).round();
        }
        let duty = values(&r, Quantity::Pwm);
        let phase = |i: usize| TAU * pitch_hz * i as f64 / RATE_HZ + late * (duty[i] / FULL).abs();
        add(&mut r, "gyro_x", |i| 0.2 * phase(i).cos());
        no_band(&told(&r), || format!("{pitch_hz} Hz, {late} rad"))
    });
}

#[test]
fn a_zero_in_steps_of_the_temperature_is_no_process() {
    graded("steps of the temperature", |run, rng| {
        let mut r = record(&[], 7700 + run);
        let (step, period_s) = (between(0.7, 2.0, rng), between(120.0, 300.0, rng));
        let swings = |i: usize| {
            let turn = TAU * i as f64 / RATE_HZ;
            5.0 * (turn / period_s).sin() + (turn / 61.0).sin()
        };
        for c in r
            .channels
            .iter_mut()
            .filter(|c| c.quantity == Quantity::Temp)
        {
            let lsb = c.lsb.unwrap_or(0.1453);
            let each = c.values.iter_mut().enumerate();
            each.for_each(|(i, v)| *v = ((30.0 + swings(i)) / lsb).round() * lsb);
        }
        let saw_tooth = |i: usize| swings(i) / step - (swings(i) / step).round();
        add(&mut r, "gyro_x", |i| 0.2 * saw_tooth(i));
        let a_process = [
            "gauss_markov",
            "flicker",
            "low_pass",
            "telegraph",
            "narrow_band",
        ];
        told_without(
            &told(&r),
            |n| a_process.contains(&n),
            || format!("{step} degC, {period_s} s"),
        )
    });
}

#[test]
fn noise_that_a_line_swells_is_no_process_of_the_library() {
    graded("noise that a line swells", |run, rng| {
        let mut r = record(&[], 7500 + run);
        let (period_s, memory_s) = (between(15.0, 40.0, rng), between(0.4, 1.0, rng));
        let keep = (-1.0 / (memory_s * RATE_HZ)).exp();
        let mut level = 0.0;
        let course: Vec<f64> = (0..count(&r))
            .map(|i| {
                let drive: f64 = StandardNormal.sample(rng);
                level = keep * level + (1.0 - keep * keep).sqrt() * drive;
                let line = (TAU * i as f64 / RATE_HZ / period_s).sin();
                0.15 * line + 0.2 * (1.0 + line) * level
            })
            .collect();
        add(&mut r, "gyro_x", |i| course[i]);
        let d = told(&r);
        let wrong = named(&d).iter().any(|n| n.0 != "line");
        (!wrong && !d.unexplained.is_empty())
            .then_some(())
            .ok_or_else(|| format!("{period_s} s, {memory_s} s: {}", said(&d)))
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

#[test]
fn noise_between_two_edges_is_no_resonance() {
    graded("noise between two edges", |run, rng| {
        let mut r = record(&[], 7800 + run);
        let (low_hz, width_hz) = (between(0.8, 7.0, rng), between(0.5, 2.0, rng));
        let seconds = count(&r) as f64 / RATE_HZ;
        let tones: Vec<(f64, f64)> = (0..(width_hz * seconds) as usize)
            .map(|k| (low_hz + k as f64 / seconds, between(0.0, TAU, rng)))
            .collect();
        let size = 0.2 * (2.0 / tones.len() as f64).sqrt();
        let tone =
            |i: usize, (hz, first): &(f64, f64)| (TAU * hz * i as f64 / RATE_HZ + first).sin();
        add(&mut r, "gyro_x", |i| {
            size * tones.iter().map(|t| tone(i, t)).sum::<f64>()
        });
        no_band(&told(&r), || format!("{low_hz} Hz, {width_hz} Hz wide"))
    });
}

#[test]
fn spikes_in_pairs_are_no_rounded_angle() {
    graded("spikes in pairs", |run, rng| {
        let mut r = record(&[], 7900 + run);
        let count = count(&r);
        let (size, pairs) = (between(0.6, 1.2, rng), 250);
        let mut course = vec![0.0; count];
        for _ in 0..pairs {
            let at = between(0.0, count as f64 - 1.0, rng) as usize;
            let up = if between(0.0, 1.0, rng) < 0.5 {
                size
            } else {
                -size
            };
            course[at] += up;
            course[at + 1] -= up;
        }
        add(&mut r, "gyro_x", |i| course[i]);
        let is_wrong = |n: &str| n == "quantization_noise";
        told_without(&told(&r), is_wrong, || format!("{size} deg/s"))
    });
}

#[test]
fn a_tone_whose_phase_the_shaking_bends_is_told() {
    graded("a phase behind an acceleration", |run, rng| {
        let mut r = record(&[], 8000 + run);
        let (hz, bend) = (between(0.5, 9.0, rng), between(1.0, 3.0, rng));
        let shakes = shaken(&mut r, 8.0, rng);
        add(&mut r, "gyro_x", |i| {
            0.15 * (TAU * hz * i as f64 / RATE_HZ + bend * shakes[i]).sin()
        });
        let is_wrong = |n: &str| n != "line";
        told_without(&told(&r), is_wrong, || format!("{hz} Hz, {bend} rad"))
    });
}
