//! The model that `diagnose` hands over is the record's: simulated in the world that the record saw, it has the record's Allan
//! deviation, whatever was hidden in the stand.

use diagnosis::DiagnoseOptions;
use diagnosis::result::Verdict;
use imu_stand::stand::{Hidden, Sizes, plan, run_native};
use model::file::ModelFile;
use model::record::Record;
use model::record::sampling::Sampling;
use noise::allan::{Deviation, Phase, deviation};

type Tested = Result<(), Box<dyn std::error::Error>>;

/// Averaging factors, to one second.
const FACTORS: [usize; 5] = [1, 2, 4, 10, 20];
/// Simulations, and how far their mean may be off.
const SIMULATIONS: u64 = 4;
const FAR: f64 = 0.06;

/// Overlapping Allan deviations of a channel; what `like` does not have is left out.
fn deviations(record: &Record, name: &str, like: &Record) -> Vec<f64> {
    let (Ok(sampling), Some(own), Some(like)) = (
        Sampling::of(record, None),
        record.channel(name),
        like.channel(name),
    ) else {
        return vec![];
    };
    let mut values = own.values.clone();
    for (v, like) in values.iter_mut().zip(&like.values) {
        if !like.is_finite() {
            *v = f64::NAN;
        }
    }
    let phase = Phase::from_values(&values, &sampling.runs_of(&values));
    let at = |m: &usize| deviation(&phase, Deviation::Oadev, sampling.tau0, *m);
    let all = FACTORS.iter().map(at);
    all.map(|e| e.map_or(f64::NAN, |e| e.deviation)).collect()
}

/// Relative standard error of such a deviation of white noise (NIST SP 1065, table 5).
fn error(samples: usize, m: usize) -> f64 {
    let (n, m) = (samples as f64, m as f64);
    let degrees = (1.5 * (n - 1.0) / m - 2.0 * (n - 2.0) / n) * 4.0 * m * m / (4.0 * m * m + 5.0);
    (2.0 * degrees).sqrt().recip()
}

/// Simulated over measured deviations of every channel and factor.
fn ratios(hidden: Hidden, seed: u64) -> Result<Vec<f64>, Box<dyn std::error::Error>> {
    let (record, _) = run_native(&plan(hidden, Sizes::Visible, 600.0, seed), |_| {});
    let found = diagnosis::diagnose(&record, &DiagnoseOptions::default())?;
    // What is written is read again, and simulated by itself.
    let written = found.extended_model.clone().excited_like(&record).to_toml();
    let written = ModelFile::parse(&written).map_err(|e| format!("{hidden:?}: {e}"))?;
    model::simulate(&written, 10.0, 20.0, 1)?;
    let mut all = vec![];
    for channel in &found.extended_model.channels {
        let measured = deviations(&record, &channel.name, &record);
        let mut mean = vec![0.0; FACTORS.len()];
        for seed in 0..SIMULATIONS {
            let again =
                model::simulate_in_the_world_of(&found.extended_model, &record, 20.0, seed)?;
            let made = deviations(&again, &channel.name, &record);
            let each = mean.iter_mut().zip(&made);
            each.for_each(|(mean, v)| *mean += v / SIMULATIONS as f64);
        }
        for ((made, read), m) in mean.iter().zip(&measured).zip(FACTORS) {
            let (ratio, doubt) = (made / read, 1.96 * error(record.len(), m));
            assert!(
                (ratio - 1.0).abs() < FAR + doubt,
                "{hidden:?} {seed}, {} over {m} samples: {ratio:.3}",
                channel.name
            );
            all.push(ratio);
        }
    }
    Ok(all)
}

#[test]
fn a_model_that_is_handed_over_simulates_its_record() -> Tested {
    let mut all = vec![];
    for (hidden, seed) in [
        (Hidden::MotorNoise, 64),
        (Hidden::NoisySpell, 61),
        (Hidden::CommonNoise, 62),
        (Hidden::Glitches, 63),
        (Hidden::SlowFilter, 2),
        (Hidden::SilentStall, 65),
        (Hidden::ScaleError, 66),
        // Only a surge: `motor_bias` without a shift at full duty.
        (Hidden::MotorCoupling, 21),
    ] {
        all.extend(ratios(hidden, seed)?);
    }
    all.sort_by(f64::total_cmp);
    let median = all[all.len() / 2];
    assert!((0.98..1.02).contains(&median), "{median}");
    Ok(())
}

/// Kinds whose model has to have more than a size right: how long a stall lasts, the filter's second pole, the noise in front of a
/// bit that sticks, when a sway begins.
const BY_COURSE: [Hidden; 4] = [
    Hidden::SilentStall,
    Hidden::SlowFilter,
    Hidden::StuckBit,
    Hidden::Uncalibrated,
];
/// Runs of each, and how many of all are to be right: of nine in ten, 98 % of such tests have as many.
const RUNS: u64 = 4;
const RIGHT: usize = 12;

#[test]
fn nothing_is_left_beside_what_was_hidden_and_the_record_is_among_its_replicates() -> Tested {
    let options = DiagnoseOptions {
        replicates: 199,
        no_evidence: true,
        ..DiagnoseOptions::default()
    };
    let mut wrong = vec![];
    for hidden in BY_COURSE {
        for seed in 300..300 + RUNS {
            let (record, _) = run_native(&plan(hidden, Sizes::Visible, 600.0, seed), |_| {});
            let found = diagnosis::diagnose(&record, &options)?;
            let whole = found.extended_model.unnamed.is_empty();
            if !(whole && found.diagnosis.verdict == Verdict::Extended) {
                wrong.push((hidden, seed));
            }
        }
    }
    let right = BY_COURSE.len() * RUNS as usize - wrong.len();
    assert!(right >= RIGHT, "{right}; not {wrong:?}");
    Ok(())
}
