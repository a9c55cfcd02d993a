//! Noise and tones at one frequency: named by their envelope, sized, and no hindrance to what stands beside them.
//! `cargo run --release -p diagnosis --example bands` makes the rates.

use diagnosis::result::{Diagnosed, Finding};
use diagnosis::{DiagnoseOptions, diagnose};
use model::file::EffectModel;
use model::{ModelFile, Parameter};
use rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Ten minutes of one gyro of the paper's stand with effects on it.
fn run(effects: &[(&str, &[(&str, f64)])], seed: u64) -> Diagnosed {
    let mut model = ModelFile::paper();
    model.channels.truncate(1);
    model.effects = effects
        .iter()
        .map(|(cause, parameters)| EffectModel {
            cause: (*cause).into(),
            channels: vec!["gyro_x".into()],
            parameters: parameters
                .iter()
                .map(|(k, v)| ((*k).to_owned(), Parameter::exact(*v, "1")))
                .collect(),
        })
        .collect();
    let record = model::simulate(&model, 600.0, 20.0, seed).expect("a run");
    let options = DiagnoseOptions {
        no_evidence: true,
        ..DiagnoseOptions::default()
    };
    diagnose(&record, &options).expect("a diagnosis")
}

fn of<'a>(d: &'a Diagnosed, cause: &str) -> Option<&'a Finding> {
    d.diagnosis.findings.iter().find(|f| f.cause == cause)
}

fn causes(d: &Diagnosed) -> Vec<&str> {
    let all = d.diagnosis.findings.iter();
    all.map(|f| f.cause.as_str()).collect()
}

/// Asserts that each parameter lies within four of its standard errors.
fn sized(f: &Finding, truth: &[(&str, f64)]) {
    for (name, value) in truth {
        let p = &f.parameters[*name];
        let error = p.std_error.expect("an error");
        assert!(
            (p.value - value).abs() < 4.0 * error,
            "{name} {} +- {error}, true {value}",
            p.value
        );
    }
}

/// Mean squares of 190 and 150 independent values of the envelope tell the two apart.
const BAND: [(&str, f64); 3] = [("rms", 0.15), ("center_frequency", 4.3), ("bandwidth", 0.1)];
const TONE: [(&str, f64); 3] = [
    ("amplitude", 0.2),
    ("center_frequency", 6.1),
    ("linewidth", 0.08),
];

#[test]
fn a_mode_that_noise_drives_and_a_tone_that_wanders_are_named_and_sized() {
    for (cause, truth) in [("narrow_band", BAND), ("wandering_line", TONE)] {
        let named = (0..8).filter(|seed| {
            let d = run(&[(cause, &truth)], *seed);
            let found = of(&d, cause).filter(|_| causes(&d) == [cause]);
            if let Some(f) = found {
                sized(f, &truth);
            } else {
                println!("{seed}: {:?} {:?}", causes(&d), d.diagnosis.unexplained);
            }
            found.is_some()
        });
        let named = named.count();
        assert!(named >= 7, "{cause}: {named} of 8");
    }
}

#[test]
fn beside_a_band_a_line_a_ramp_and_a_step_keep_their_names() {
    // Some ten to fifteen times their standard errors. The line stands six half widths beside the middle, where the density
    // is 0.019 (deg/s)^2/Hz: d' = A sqrt(T / S) = 14. One in the middle of the band is taken for a part of it.
    let others: [(&str, &[(&str, f64)]); 3] = [
        ("line", &[("frequency", 4.6), ("amplitude", 0.08)]),
        ("rate_ramp", &[("slope", 3e-3)]),
        ("bias_step", &[("time", 250.0), ("height", 0.4)]),
    ];
    for (cause, parameters) in others {
        for seed in 0..2 {
            let d = run(&[("narrow_band", &BAND), (cause, parameters)], seed);
            let mut found = causes(&d);
            found.sort_unstable();
            let mut both = ["narrow_band", cause];
            both.sort_unstable();
            assert_eq!(found, both, "{seed}: {:?}", d.diagnosis.unexplained);
        }
    }
}

#[test]
fn what_is_steady_or_swings_is_no_band() {
    for (cause, parameters) in [
        ("line", &[("frequency", 4.3), ("amplitude", 0.1)][..]),
        (
            "am_line",
            &[
                ("frequency", 4.3),
                ("amplitude", 0.15),
                ("modulation_frequency", 0.05),
                ("depth", 0.8),
            ],
        ),
        ("gauss_markov", &[("sigma", 0.1), ("correlation_time", 2.0)]),
    ] {
        for seed in 0..2 {
            let d = run(&[(cause, parameters)], seed);
            assert_eq!(causes(&d), [cause], "{seed}");
        }
    }
}

#[test]
fn white_noise_has_no_peak_beyond_the_threshold() {
    // The stated chance is 6.5e-5: none of 100; and the tail is not so thin that the threshold is idle.
    let n = 3000;
    let mut highest = 0.0f64;
    for seed in 0..100 {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let y: Vec<f64> = (0..n).map(|_| StandardNormal.sample(&mut rng)).collect();
        highest = highest.max(diagnosis::peak_of_white(&y));
    }
    let limit = diagnosis::threshold::peak(n);
    assert!(highest < limit, "{highest} of {limit}");
    assert!(highest > 0.4 * limit, "{highest} of {limit}");
}
