//! What is handed over of what was found: one entry for one thing, its place and size, what it does, and the order.

use std::f64::consts::TAU;

use diagnosis::result::{Diagnosis, Verdict};
use diagnosis::{DiagnoseOptions, diagnose};
use model::file::EffectModel;
use model::record::Record;
use model::{ModelFile, Parameter};
use rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

const RATE: f64 = 20.0;
const SECONDS: f64 = 600.0;

/// Name, value and unit of each parameter.
type Values<'a> = &'a [(&'a str, f64, &'a str)];

fn stand(effects: &[(&str, Values<'_>)], seed: u64) -> Record {
    let mut model = ModelFile::paper();
    let parameters = |all: Values<'_>| {
        let each = all.iter();
        each.map(|(name, v, unit)| ((*name).to_owned(), Parameter::exact(*v, unit)))
            .collect()
    };
    let of = |(cause, all): &(&str, Values<'_>)| EffectModel {
        cause: (*cause).into(),
        channels: vec!["gyro_x".into()],
        parameters: parameters(all),
    };
    model.effects = effects.iter().map(of).collect();
    model::simulate(&model, SECONDS, RATE, seed).expect("a record")
}

/// Adds to gyro_x, in place of its counts too.
fn add(record: &mut Record, mut signal: impl FnMut(f64) -> f64) {
    let x = record.channels.iter_mut().find(|c| c.name == "gyro_x");
    let x = x.expect("gyro_x");
    x.counts = None;
    x.lsb = None;
    for (i, v) in x.values.iter_mut().enumerate() {
        *v += signal(i as f64 / RATE);
    }
}

fn told(record: &Record, replicates: usize) -> Diagnosis {
    let options = DiagnoseOptions {
        replicates,
        no_evidence: true,
        ..DiagnoseOptions::default()
    };
    diagnose(record, &options).expect("an answer").diagnosis
}

#[test]
fn a_swept_tone_is_one_entry_with_its_band_and_its_size() {
    for seed in 0..6 {
        let mut record = stand(&[], seed);
        let amplitude = 0.5;
        // Between 3 and 6 Hz and back, once in 40 s: no line, no noise, and no tone that wanders.
        let swing = 40.0;
        add(&mut record, |t| {
            let phase = 4.5 * t - 1.5 * swing / TAU * (TAU * t / swing).cos();
            amplitude * (TAU * phase).sin()
        });
        let d = told(&record, 0);
        let of_x: Vec<_> = d
            .unexplained
            .iter()
            .filter(|u| u.channel == "gyro_x")
            .collect();
        assert_eq!(of_x.len(), 1, "seed {seed}: {of_x:#?}");
        let entry = of_x[0];
        let rms = entry.rms.expect("a size");
        let true_rms = amplitude / 2f64.sqrt();
        // White noise makes a tenth of the variance in that band, which its place shares; a tenth of the tone lies at its ends.
        let ratio = rms / true_rms;
        assert!((0.85..1.15).contains(&ratio), "seed {seed}: {rms}");
        let [low, high] = entry.band_hz.expect("a place");
        assert!((2.8..3.2).contains(&low), "seed {seed}: {low}");
        assert!((5.8..6.3).contains(&high), "seed {seed}: {high}");
        assert!(entry.material && entry.rank == 1, "seed {seed}: {entry:?}");
        assert!(
            entry.checks.len() > 1 && !entry.what.contains('_'),
            "{entry:?}"
        );
    }
}

#[test]
fn a_ramp_costs_the_angle_that_it_makes() {
    let slope = 0.001;
    let record = stand(&[("rate_ramp", &[("slope", slope, "deg/s^2")])], 3);
    let d = told(&record, 99);
    let ramp = d.findings.iter().find(|f| f.cause == "rate_ramp");
    let ramp = ramp.expect("the ramp");
    let c = ramp.consequence.as_ref().expect("what it does");
    // Windows of T that lie anywhere in S have means that are uniform over S - T.
    for (key, t) in [("10s", 10.0), ("100s", 100.0)] {
        let wanted = t * slope * (SECONDS - t) / 12f64.sqrt();
        let found = c.angle_rms_deg[key];
        assert!(
            (found / wanted - 1.0).abs() < 0.1,
            "{key}: {found}, {wanted}"
        );
    }
    assert!(ramp.material && ramp.rank == 1, "{ramp:?}");
    assert_eq!(d.verdict, Verdict::Extended);
}

#[test]
fn the_larger_consequence_stands_first_and_the_share_is_that_of_the_variance() {
    let hum: Values<'_> = &[("frequency", 2.37, "Hz"), ("amplitude", 0.08, "deg/s")];
    let ramp: Values<'_> = &[("slope", 0.002, "deg/s^2")];
    let d = told(&stand(&[("line", hum), ("rate_ramp", ramp)], 5), 99);
    let causes: Vec<&str> = d.findings.iter().map(|f| f.cause.as_str()).collect();
    assert_eq!(causes, ["rate_ramp", "line"]);
    let share = |k: usize| {
        d.findings[k]
            .consequence
            .as_ref()
            .map(|c| c.share_of_variance)
    };
    // White noise of 4.2 deg/sqrt(h) is 0.31 deg/s at 20 Hz; a ramp over S has the variance (slope S)^2 / 12.
    let (white, ramp, line) = (
        0.31f64.powi(2),
        1.2f64.powi(2) / 12.0,
        0.08f64.powi(2) / 2.0,
    );
    let all = white + ramp + line;
    for (found, wanted) in [(share(0), ramp / all), (share(1), line / all)] {
        let found = found.expect("a share");
        assert!((found / wanted - 1.0).abs() < 0.25, "{found} {wanted}");
    }
}

#[test]
fn what_changes_nothing_by_a_twentieth_is_not_material_and_turns_no_verdict() {
    let mut extended = 0;
    for seed in 0..4 {
        // A correlation of 0.03: certain in 120 000 samples, and 2 % of a deviation.
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut record =
            model::simulate(&ModelFile::paper(), 1200.0, 100.0, seed).expect("a record");
        let x = record.channels.iter_mut().find(|c| c.name == "gyro_x");
        let x = x.expect("gyro_x");
        (x.counts, x.lsb) = (None, None);
        let noise: Vec<f64> = (x.values.iter())
            .map(|_| -> f64 { StandardNormal.sample(&mut rng) })
            .collect();
        let shares: Vec<f64> = noise
            .windows(2)
            .map(|w| 0.7 * w[0] + 0.042 * w[1])
            .collect();
        x.values[1..]
            .iter_mut()
            .zip(shares)
            .for_each(|(v, s)| *v += s);
        let d = told(&record, 99);
        for f in &d.findings {
            assert!(!f.material, "seed {seed}: {f:?}");
        }
        assert!(
            d.unexplained.iter().all(|u| !u.material),
            "{:?}",
            d.unexplained
        );
        extended += u32::from(d.verdict != Verdict::Unexplained);
    }
    assert_eq!(extended, 4);
}

#[test]
fn a_noise_that_the_motor_swells_in_one_band_is_material_though_its_law_has_no_name() {
    for seed in 0..3 {
        let mut record = stand(&[], seed);
        // On for half a minute, off for another.
        let duty = |t: f64| 200.0 * f64::from(u8::from(t % 60.0 < 30.0));
        let pwm = record.channels.iter_mut().find(|c| c.name == "pwm");
        let pwm = &mut pwm.expect("the motor's command").values;
        for (i, v) in pwm.iter_mut().enumerate() {
            *v = duty(i as f64 / RATE);
        }
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(70 + seed);
        let mut last = 0.0;
        // Less of it below a third of the band: it has another colour than the noise of the gyro.
        let mut hiss = || {
            let now: f64 = StandardNormal.sample(&mut rng);
            now - 0.6 * std::mem::replace(&mut last, now)
        };
        add(&mut record, |t| 0.0015 * duty(t) * hiss());
        let d = told(&record, 99);
        let of_x = d.unexplained.iter().find(|u| u.channel == "gyro_x");
        let entry = of_x.expect("what the motor adds is not white");
        assert!(entry.what.contains("motor adds noise"), "{}", entry.what);
        // The rms rises by a third with the motor on: 13 % above that of the whole record.
        let change = entry.consequence.as_ref().map(|c| c.largest_change);
        assert!(
            change.is_some_and(|c| c > 0.1) && entry.material,
            "{entry:#?}"
        );
        assert_ne!(d.verdict, Verdict::Adequate, "seed {seed}");
    }
}
