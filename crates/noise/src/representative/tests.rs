//! Tests of [`super`].

use super::*;
use model::record::{Axis, Channel};

fn run(sigma: f64, bias: f64, rng: &mut Xoshiro256PlusPlus) -> Record {
    let values = (0..2000)
        .map(|_| {
            let e: f64 = StandardNormal.sample(rng);
            bias + sigma * e
        })
        .collect();
    let mut record = Record {
        channels: vec![Channel {
            name: "gyro_z".into(),
            quantity: Quantity::Gyro,
            axis: Some(Axis::Z),
            unit: "deg/s".into(),
            values,
            counts: None,
            lsb: None,
        }],
        ..Record::default()
    };
    record.header.rate_hz = Some(20.0);
    record
}

fn bias(rng: &mut Xoshiro256PlusPlus) -> f64 {
    let e: f64 = StandardNormal.sample(rng);
    0.5 + 0.1 * e
}

#[test]
fn equal_runs_are_seldom_called_odd() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
    let alarms = (0..40)
        .filter(|_| {
            let runs: Vec<Record> = (0..12)
                .map(|_| {
                    let b = bias(&mut rng);
                    run(0.39, b, &mut rng)
                })
                .collect();
            !representative(&runs, 1).unwrap().odd.is_empty()
        })
        .count();
    // Binomial(40, 0.05): 9 or more has a chance of 1e-4.
    assert!(alarms < 9, "{alarms}");
}

#[test]
fn equal_runs_are_called_different_as_often_as_stated() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(12);
    let alarms = (0..200)
        .filter(|_| {
            let runs: Vec<Record> = (0..5).map(|_| run(0.39, 0.5, &mut rng)).collect();
            let samplings: Vec<Sampling> = runs
                .iter()
                .map(|r| Sampling::of(r, None).unwrap())
                .collect();
            let runs: Vec<Cow<'_, Record>> = runs.iter().map(Cow::Borrowed).collect();
            let (mut figures, _) = figures_of(&runs, &samplings, "gyro_z").unwrap();
            pool_figures(&mut figures, &|_| false);
            figures.iter().any(|f| f.differ == Some(true))
        })
        .count();
    // Two figures at 5 % together: Binomial(200, 0.05), of which 21 or more have a chance of 1e-3.
    assert!(alarms < 21, "{alarms}");
}

#[test]
fn a_run_with_twice_the_noise_is_odd_in_that_and_not_chosen() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(12);
    let runs: Vec<Record> = (0..12)
        .map(|i| {
            let b = bias(&mut rng);
            run(if i == 5 { 0.78 } else { 0.39 }, b, &mut rng)
        })
        .collect();
    let answer = representative(&runs, 1).unwrap();
    assert!(
        answer
            .odd
            .iter()
            .any(|o| o.run == 5 && o.figure == "angle_random_walk" && o.z > 0.0),
        "{answer:?}"
    );
    assert_ne!(answer.run, 5);
    // The others are one noise: N of eleven runs together, 0.39/sqrt(20) deg/sqrt(s), 5.23 deg/sqrt(h).
    let together = &answer.together[0];
    assert_eq!(together.runs, 11);
    let n = &together.parameters.angle_random_walk;
    assert!(n.low.unwrap() < 5.232 && 5.232 < n.high.unwrap(), "{n:?}");
    assert!(n.std_error.unwrap() / n.value.unwrap() < 0.012, "{n:?}");
    let figure = |name: &str| answer.figures.iter().find(|f| f.figure == name).unwrap();
    let noise = figure("angle_random_walk");
    assert_eq!(noise.differ, Some(false), "{noise:?}");
    // Biases scatter by 0.1 deg/s.
    let bias = figure("bias").over_runs.unwrap();
    assert!(
        bias.run_to_run_low < 0.1 && 0.1 < bias.run_to_run_high,
        "{bias:?}"
    );
    assert!(representative(&runs[..3], 1).is_err());
}

#[test]
fn one_noisier_run_of_six_is_seen() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(13);
    let runs: Vec<Record> = (0..6)
        .map(|i| {
            let b = bias(&mut rng);
            run(if i == 2 { 0.55 } else { 0.39 }, b, &mut rng)
        })
        .collect();
    let answer = representative(&runs, 1).unwrap();
    assert!(
        answer
            .odd
            .iter()
            .any(|o| o.run == 2 && o.figure == "angle_random_walk")
            && answer.odd.iter().all(|o| o.run == 2),
        "{:?}",
        answer.odd
    );
}
