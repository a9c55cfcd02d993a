//! The record among replicates of its model: the level by true parameters, and what is rejected. A fast sample of
//! `examples/replicates.rs`, whose figures stand in docs/replicates.md. Seeds are fixed.

use diagnosis::replicates::{LEVEL, REPLICATES, judge_record};
use diagnosis::result::{Among, Diagnosis, Verdict};
use diagnosis::{DiagnoseOptions, diagnose};
use model::file::EffectModel;
use model::record::Record;
use model::{ModelFile, Parameter};

/// One gyro of the paper's stand, with this random walk, deg/s/sqrt(s).
fn stand(walk: f64) -> ModelFile {
    let mut model = ModelFile::paper();
    model.channels.truncate(1);
    for (name, p) in &mut model.channels[0].baseline {
        if name == "rate_random_walk" {
            p.value = walk;
        }
    }
    model
}

fn with(model: &ModelFile, cause: &str, parameters: &[(&str, f64, &str)]) -> ModelFile {
    let mut model = model.clone();
    model.effects.push(EffectModel {
        cause: cause.into(),
        channels: vec![],
        parameters: (parameters.iter())
            .map(|(name, value, unit)| ((*name).to_owned(), Parameter::exact(*value, unit)))
            .collect(),
    });
    model
}

fn louder(model: &ModelFile, factor: f64) -> ModelFile {
    let mut model = model.clone();
    for c in &mut model.channels {
        if let Some(p) = c.baseline.get_mut("angle_random_walk") {
            p.value *= factor;
        }
    }
    model
}

fn record(model: &ModelFile, seconds: f64, seed: u64) -> Record {
    model::simulate(model, seconds, 20.0, seed).expect("a stand simulates")
}

/// The first gyro of a record among replicates of a model.
fn among(record: &Record, model: &ModelFile, seed: u64) -> Among {
    let models = [model, model];
    let all = judge_record(record, models, REPLICATES, seed).expect("long enough");
    all.into_values().next().expect("it is simulated").after
}

#[test]
fn a_true_model_is_rejected_as_often_as_the_level_says() {
    const RECORDS: u64 = 120;
    let model = stand(0.0015);
    let rejected = (0..RECORDS)
        .filter(|k| !among(&record(&model, 120.0, 500 + k), &model, *k).holds())
        .count();
    // Binomial of 120 at 5 %: 6 expected; 14 and more have a chance of 0.3 %.
    assert!(rejected <= 13, "{rejected} of {RECORDS}");
}

#[test]
fn noise_off_by_four_percent_and_a_term_left_out_are_rejected() {
    let model = stand(0.0015);
    let paper = |cause, parameters| (cause, with(&model, cause, parameters), model.clone());
    let wrong = [
        ("N too high", model.clone(), louder(&model, 1.04)),
        ("N too low", model.clone(), louder(&model, 0.96)),
        ("walk left out", stand(0.006), stand(0.0)),
        paper("low_pass", &[("lag1_correlation", 0.15, "1")]),
        paper(
            "bias_step",
            &[("time", 310.0, "s"), ("height", 0.5, "deg/s")],
        ),
        paper(
            "line",
            &[("frequency", 3.3, "Hz"), ("amplitude", 0.06, "deg/s")],
        ),
        paper("outliers", &[("count", 2.0, "1")]),
    ];
    for (what, truth, model) in wrong {
        let held: Vec<Among> = (0..4)
            .map(|k| among(&record(&truth, 600.0, 900 + k), &model, k))
            .filter(Among::holds)
            .collect();
        assert!(held.is_empty(), "{what}: {held:?}");
    }
}

#[test]
fn what_is_off_is_named_with_its_envelope() {
    let model = stand(0.0);
    let spikes = with(
        &model,
        "outliers",
        &[("count", 3.0, "1"), ("size", 8.0, "deg/s")],
    );
    let worst = among(&record(&spikes, 600.0, 3), &model, 3).worst;
    // Two up, one down, of 20 sigma.
    let names = ["highest reading", "lowest reading", "kurtosis", "skewness"];
    assert!(
        names.iter().any(|n| worst.statistic.starts_with(n)),
        "{worst:?}"
    );
    assert!(
        worst.value < worst.low || worst.value > worst.high,
        "{worst:?}"
    );
}

fn diagnosed(record: &Record, replicates: usize) -> Diagnosis {
    let options = DiagnoseOptions {
        replicates,
        ..DiagnoseOptions::default()
    };
    diagnose(record, &options).expect("long enough").diagnosis
}

#[test]
fn an_extended_model_is_called_so_only_where_its_replicates_hold_the_record() {
    let line = [("frequency", 3.7, "Hz"), ("amplitude", 0.2, "deg/s")];
    for seed in 40..42 {
        let record = record(&with(&stand(0.001), "line", &line), 600.0, seed);
        let without = diagnosed(&record, 0);
        assert!(without.replicates.is_empty());
        assert_eq!(without.verdict, Verdict::Extended);
        let found = diagnosed(&record, REPLICATES);
        let channel = &found.replicates["gyro_x"];
        assert!(channel.before.p_value <= LEVEL, "{channel:?}");
        let holds = channel.after.holds();
        assert_eq!(found.verdict == Verdict::Extended, holds, "{channel:?}");
        assert_eq!(found.unexplained.is_empty(), holds);
        let check = found
            .checks
            .iter()
            .find(|c| c.id == "replicates")
            .expect("a check");
        assert!(check.fails_before && check.fails_after != holds);
    }
}

#[test]
fn a_bit_that_was_put_right_is_in_the_model_and_not_in_the_noise() {
    const BIT: i32 = 1 << 9;
    for seed in 60..62 {
        let truth = stand(0.001);
        let mut record = record(&truth, 600.0, seed);
        let x = &mut record.channels[0];
        let (lsb, counts) = (x.lsb.expect("a step"), x.counts.as_mut().expect("counts"));
        for (count, value) in counts.iter_mut().zip(&mut x.values) {
            *value += lsb * f64::from((*count | BIT) - *count);
            *count |= BIT;
        }
        let options = DiagnoseOptions {
            replicates: REPLICATES,
            ..DiagnoseOptions::default()
        };
        let found = diagnose(&record, &options).expect("long enough");
        let of = found.diagnosis;
        assert_eq!(of.verdict, Verdict::Extended, "{:?}", of.unexplained);
        let causes: Vec<&str> = of.findings.iter().map(|f| f.cause.as_str()).collect();
        assert_eq!(causes, ["stuck_bit"]);
        let n = |m: &ModelFile| m.channels[0].baseline["angle_random_walk"].value;
        let ratio = n(&found.extended_model) / n(&truth);
        // 12 000 readings tell N within 0.65 %.
        assert!((0.97..1.03).contains(&ratio), "{ratio}");
    }
}
