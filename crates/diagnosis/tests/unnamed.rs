//! What has no name is in the model that is handed over: a simulation of it is the record's there too.

use std::f64::consts::TAU;

use diagnosis::replicates::REPLICATES;
use diagnosis::{DiagnoseOptions, diagnose};
use model::ModelFile;
use model::file::EffectModel;
use model::record::Record;
use model::unnamed::{Domain, Unnamed};
use rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

const RATE: f64 = 20.0;
const SECONDS: f64 = 600.0;

type Tested = Result<(), Box<dyn std::error::Error>>;

/// The paper's stand, with something added to the readings of gyro_x.
fn stand(seed: u64, mut add: impl FnMut(f64) -> f64) -> Result<Record, Box<dyn std::error::Error>> {
    let mut record = model::simulate(&ModelFile::paper(), SECONDS, RATE, seed)?;
    let x = &mut record.channels[0];
    (x.counts, x.lsb) = (None, None);
    for (i, v) in x.values.iter_mut().enumerate() {
        *v += add(i as f64 / RATE);
    }
    Ok(record)
}

/// The power of a channel between two frequencies, by the periodogram.
fn power(record: &Record, [low, high]: [f64; 2]) -> f64 {
    let x = &record.channels[0].values;
    let n = x.len() as f64;
    let bins = (low * SECONDS) as usize..(high * SECONDS) as usize;
    bins.map(|k| {
        let turn = TAU * k as f64 / n;
        let (c, s) = x.iter().enumerate().fold((0.0, 0.0), |(c, s), (i, v)| {
            let (sin, cos) = (turn * i as f64).sin_cos();
            (c + v * cos, s + v * sin)
        });
        2.0 * (c * c + s * s) / (n * n)
    })
    .sum()
}

fn terms(of: &ModelFile, domain: Domain) -> Vec<&Unnamed> {
    of.unnamed.iter().filter(|u| u.domain == domain).collect()
}

#[test]
fn a_swept_tone_is_simulated_with_its_power_where_it_is() -> Tested {
    for seed in 20..23 {
        // Between 3 and 6 Hz and back, once in 40 s: no cause of the library.
        let record = stand(seed, |t| {
            let phase = 4.5 * t - 1.5 * 40.0 / TAU * (TAU * t / 40.0).cos();
            0.5 * (TAU * phase).sin()
        })?;
        let told = diagnose(&record, &DiagnoseOptions::default())?;
        assert!(!told.diagnosis.unexplained.is_empty(), "seed {seed}");
        let model = &told.extended_model;
        assert_eq!(ModelFile::parse(&model.to_toml()).as_ref(), Ok(model));
        // A spectrum of its own, or the cosines of a filter that are not called one.
        let named = told.diagnosis.findings.iter();
        let named: Vec<&str> = named.map(|f| f.cause.as_str()).collect();
        let cosines = |e: &EffectModel| e.cause == "low_pass" && !named.contains(&"low_pass");
        assert!(
            !terms(model, Domain::Spectrum).is_empty() || model.effects.iter().any(cosines),
            "seed {seed}"
        );
        for (band, allowed) in [([2.8, 6.2], 0.08), ([0.5, 2.0], 0.15), ([7.0, 9.5], 0.15)] {
            let simulated = model::simulate(model, SECONDS, RATE, seed + 100)?;
            // Some hundreds of coefficients in each: their power is known to 4 %, and the fit stands on the record.
            let ratio = (power(&simulated, band) / power(&record, band)).sqrt();
            assert!(
                (ratio - 1.0).abs() < allowed,
                "seed {seed}, {band:?}: {ratio}"
            );
        }
    }
    Ok(())
}

#[test]
fn a_lopsided_noise_has_its_skewness_in_the_model_which_then_holds_the_record() -> Tested {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(9);
    // The square of a normal value has the mean 1, the variance 2 and the third cumulant 8.
    let part = 0.15;
    let record = stand(7, |_| {
        let z: f64 = StandardNormal.sample(&mut rng);
        part * (z * z - 1.0)
    })?;
    let options = DiagnoseOptions {
        replicates: REPLICATES,
        ..DiagnoseOptions::default()
    };
    let told = diagnose(&record, &options)?;
    let model = &told.extended_model;
    let codes = terms(model, Domain::Codes);
    let white = 5.27 / 60.0 * RATE.sqrt();
    let wanted = 8.0 * part.powi(3) / (white * white + 2.0 * part * part).powf(1.5);
    let found = codes
        .first()
        .ok_or("no term of the distribution")?
        .values(0)[0];
    // Of 12 000 readings 0.022 for normal ones, 0.3 of which is 7 %.
    assert!((found / wanted - 1.0).abs() < 0.25, "{found} {wanted}");
    let own = &told.diagnosis.replicates["gyro_x"];
    assert!(!own.before.holds());
    assert!(own.after.holds(), "{}", own.after.strays());
    Ok(())
}

#[test]
fn a_record_of_the_baseline_has_no_unnamed_term() -> Tested {
    for seed in 40..44 {
        let record = model::simulate(&ModelFile::paper(), SECONDS, RATE, seed)?;
        let told = diagnose(&record, &DiagnoseOptions::default())?;
        assert_eq!(told.extended_model.unnamed, [], "seed {seed}");
    }
    Ok(())
}
