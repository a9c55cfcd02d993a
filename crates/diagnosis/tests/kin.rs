//! Names that fall with another: a foreign effect has several sides, and the library comes near some of them.

mod graded;

use std::f64::consts::TAU;

use graded::{add, graded, graded_over, named, record, said, told, values};
use model::file::EffectModel;
use model::record::{Quantity, Record};
use model::{ModelFile, Parameter};
use rand_distr::{Distribution, Exp1, StandardNormal, Uniform};
use rand_xoshiro::Xoshiro256PlusPlus;

fn between(rng: &mut Xoshiro256PlusPlus, from: f64, to: f64) -> f64 {
    Uniform::new(from, to).expect("a range").sample(rng)
}

fn normal(rng: &mut Xoshiro256PlusPlus) -> f64 {
    StandardNormal.sample(rng)
}

/// The size of the motor's command, 1 at most.
fn duty(record: &Record) -> Vec<f64> {
    let pwm = values(record, Quantity::Pwm);
    let most = pwm.iter().fold(1.0, |m: f64, v| m.max(v.abs()));
    pwm.iter().map(|v| v.abs() / most).collect()
}

/// Strokes of a damaged bearing come at random while the motor runs and die away: what they add has a mean, a variance and a
/// colour, which all follow the command, and no cause of the library has them all.
#[test]
fn strokes_while_the_motor_runs_do_not_shift_the_bias() {
    graded("strokes", |run, rng| {
        let mut r = record(&[("motor_duty", 0.7)], 7100 + run);
        let duty = duty(&r);
        let (a_second, fade) = (between(rng, 1.0, 3.0), between(rng, 0.6, 0.85));
        let mut left = 0.0;
        let strokes: Vec<f64> = duty
            .iter()
            .map(|d| {
                let chance = d * a_second / 20.0;
                let hit = between(rng, 0.0, 1.0) < chance;
                let e: f64 = Exp1.sample(rng);
                left = fade * left + if hit { 0.6 * e } else { 0.0 };
                left
            })
            .collect();
        add(&mut r, "gyro_y", |i| strokes[i]);
        let d = told(&r);
        let here = d.unexplained.iter().any(|u| u.channel == "gyro_y");
        let right = named(&d).is_empty() && here;
        right
            .then_some(())
            .ok_or_else(|| format!("{a_second} {fade}: {}", said(&d)))
    });
}

/// A motor that both shifts the bias and adds white noise has two causes of the library, and both keep their names.
#[test]
fn a_motor_that_shifts_the_bias_and_adds_noise_is_told_as_both() {
    graded("two causes of one motor", |run, rng| {
        let mut r = record(&[("motor_duty", 0.7)], 7200 + run);
        let pwm = values(&r, Quantity::Pwm);
        let full = pwm.iter().fold(1.0, |m: f64, v| m.max(v.abs()));
        let (shift, noise) = (between(rng, 0.15, 0.3), between(rng, 0.3, 0.5));
        let more: Vec<f64> = (pwm.iter())
            .map(|p| shift * p / full + noise * (p / full).abs() * normal(rng))
            .collect();
        add(&mut r, "gyro_z", |i| more[i]);
        let d = told(&r);
        let mut names = named(&d);
        names.sort_unstable();
        let right = names == [("motor_bias", "gyro_z"), ("motor_noise", "gyro_z")];
        right
            .then_some(())
            .ok_or_else(|| format!("{shift} {noise}: {}", said(&d)))
    });
}

/// Counts of the motor command at full duty.
const FULL: f64 = 255.0;

/// Gives a record another programme of its motor: levels at random either way, held for some seconds.
fn programme(record: &mut Record, rng: &mut Xoshiro256PlusPlus) -> Vec<f64> {
    let motor = (record.channels.iter_mut()).find(|c| c.quantity == Quantity::Pwm);
    let command = &mut motor.expect("a motor").values;
    let mut from = 0;
    while from < command.len() {
        let to = command.len().min(from + between(rng, 20.0, 100.0) as usize);
        command[from..to].fill((FULL * between(rng, -1.0, 1.0)).round());
        from = to;
    }
    command.clone()
}

/// Firmware that takes a slow turn of the table for its bias and lets its zero follow it, and in fast ones leaves the zero where
/// it is: a wander that is made of the command's past, by no law of the library, and no process.
#[test]
fn a_zero_that_follows_slow_turns_is_no_process() {
    graded("a zero that follows slow turns", |run, rng| {
        let mut r = record(&[("motor_duty", 0.9)], 7500 + run);
        let pwm = programme(&mut r, rng);
        let (slow, takes) = (between(rng, 0.35, 0.5), between(rng, 0.4, 1.0));
        let size = between(rng, 1.0, 1.4);
        let (mut rate, mut zero) = (0.0, 0.0);
        let zeros: Vec<f64> = (pwm.iter())
            .map(|p| {
                rate += (p / FULL - rate) / (20.0 * 0.3);
                if rate.abs() < slow {
                    zero += (rate - zero) / (20.0 * takes);
                }
                size * zero
            })
            .collect();
        add(&mut r, "gyro_z", |i| -zeros[i]);
        let d = told(&r);
        let right = named(&d).is_empty() && !d.unexplained.is_empty();
        right
            .then_some(())
            .ok_or_else(|| format!("{slow} {takes} {size}: {}", said(&d)))
    });
}

/// A wander of its own beside a motor that shifts the bias: the process knows nothing of the motor, and both keep their names.
#[test]
fn a_process_beside_a_motor_keeps_its_name() {
    graded("a process beside a motor", |run, rng| {
        let mut r = record(&[("motor_duty", 0.7)], 7600 + run);
        let pwm = values(&r, Quantity::Pwm);
        let full = pwm.iter().fold(1.0, |m: f64, v| m.max(v.abs()));
        let (shift, sigma) = (between(rng, 0.15, 0.3), between(rng, 0.12, 0.2));
        let correlated = (-1.0 / (20.0 * between(rng, 0.5, 3.0))).exp();
        let mut level = 0.0;
        let more: Vec<f64> = (pwm.iter())
            .map(|p| {
                let drive = sigma * (1.0f64 - correlated * correlated).sqrt();
                level = correlated * level + drive * normal(rng);
                shift * p / full + level
            })
            .collect();
        add(&mut r, "gyro_z", |i| more[i]);
        let d = told(&r);
        let mut names = named(&d);
        names.sort_unstable();
        let right = names == [("gauss_markov", "gyro_z"), ("motor_bias", "gyro_z")];
        right
            .then_some(())
            .ok_or_else(|| format!("{shift} {sigma} {correlated}: {}", said(&d)))
    });
}

/// A room whose thermostat lets it warm and cool between two edges, no two spells of it alike: a wander whose middle pitch
/// stands out. It is neither a process of the library nor a line in the band of one.
#[test]
fn what_a_thermostat_swings_leaves_no_steady_line() {
    graded("a thermostat", |run, rng| {
        let mut r = record(&[], 7300 + run);
        let (period, warms) = (between(rng, 20.0, 45.0), between(rng, 0.02, 0.1));
        let size = between(rng, 0.5, 0.7);
        let (mut level, mut up, mut pace) = (between(rng, 0.0, 1.0), true, 1.0);
        let room: Vec<f64> = (0..r.len())
            .map(|_| {
                level += pace / 20.0 / period / if up { warms } else { warms - 1.0 };
                if !(0.0..=1.0).contains(&level) {
                    level = level.clamp(0.0, 1.0);
                    up = !up;
                    pace = between(rng, 0.85, 1.15);
                }
                size * level
            })
            .collect();
        add(&mut r, "gyro_x", |i| room[i]);
        let d = told(&r);
        // Its pitch wanders: so far it is a `wandering_line`, with what is left of its shape unexplained.
        let wanders = |(cause, _): &(&str, &str)| *cause == "wandering_line";
        let right = named(&d).iter().all(wanders) && !d.unexplained.is_empty();
        right
            .then_some(())
            .ok_or_else(|| format!("{period} {warms} {size}: {}", said(&d)))
    });
}

/// What follows a thermometer by far more than an unknown wander beside it makes keeps its name.
#[test]
fn a_large_slope_in_temperature_keeps_its_name_beside_what_is_unexplained() {
    graded("a slope beside levels by a clock", |run, rng| {
        let mut r = record(
            &[("heater_degc", 6.0), ("heater_period_s", 170.0)],
            7400 + run,
        );
        let temperature = (r.channels.iter())
            .find(|c| c.name == "temp_x")
            .expect("a thermometer")
            .values
            .clone();
        let slope = between(rng, 0.15, 0.3);
        let (period, half) = (between(rng, 8.0, 15.0), between(rng, 0.1, 0.15));
        add(&mut r, "gyro_x", |i| {
            let level = (TAU * i as f64 / 20.0 / period).sin().signum();
            slope * (temperature[i] - temperature[0]) + half * level
        });
        let d = told(&r);
        let right = named(&d).contains(&("temperature", "gyro_x")) && !d.unexplained.is_empty();
        right
            .then_some(())
            .ok_or_else(|| format!("{slope} {period} {half}: {}", said(&d)))
    });
}

/// A process of one pole without white noise beside it is white noise through that filter, and has a parameter more.
#[test]
fn a_filter_of_one_pole_is_no_process_in_the_place_of_the_noise() {
    let mut model = ModelFile::paper();
    model.effects.push(EffectModel {
        cause: "low_pass".into(),
        channels: vec!["gyro_y".into()],
        parameters: [("lag1_correlation".to_owned(), Parameter::exact(0.4, "1"))].into(),
    });
    graded_over((40, 39), "a filter of one pole", |run, _| {
        let r = model::simulate(&model, 600.0, 20.0, 7700 + run).expect("a run");
        let d = told(&r);
        let right = named(&d) == [("low_pass", "gyro_y")];
        right.then_some(()).ok_or_else(|| said(&d))
    });
}
