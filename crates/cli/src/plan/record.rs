//! What a record tells of the noise to plan by.

use miette::Result;
use model::record::sampling::Sampling;
use model::record::{Channel, Quantity, Record};
use noise::analyze::misfit_warning;
use noise::fit::{Described, Estimated, Spectrum, Term, fit_described};
use rand_core::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::{LEAST_SAMPLES, Noise};
use crate::explain::explain;
use crate::report::plot::number;

/// The gyro of that name, or the first one.
fn gyro_of<'a>(record: &'a Record, from: &str, channel: Option<&str>) -> Result<&'a Channel> {
    record
        .channels
        .iter()
        .find(|c| match channel {
            Some(name) => c.name == name,
            None => c.quantity == Quantity::Gyro,
        })
        .ok_or_else(|| {
            let names: Vec<&str> = record.channels.iter().map(|c| c.name.as_str()).collect();
            miette::miette!(
                help = "`--channel NAME` names one, `--columns` maps a foreign file",
                "{} has no such gyro; it has {}",
                from,
                names.join(", ")
            )
        })
}

/// What a record tells of the noise of a gyro: of the one of that name, or of the first.
///
/// # Errors
/// Where it has no such gyro, no rate, or too few samples.
pub fn of_record(
    record: &Record,
    from: &str,
    channel: Option<&str>,
    rate_hz: Option<f64>,
    seed: u64,
) -> Result<Noise> {
    let gyro = gyro_of(record, from, channel)?;
    let sampling = Sampling::of(record, rate_hz).map_err(explain)?;
    let described = described(gyro, &sampling, seed)?;
    let mut noise = noise_of(&described, sampling.tau0);
    noise.notes.extend(first_of(record, gyro, channel));
    noise.notes.extend(may_be_causes(&noise));
    noise.from = format!("{}, {}", from, gyro.name);
    Ok(noise)
}

/// Which gyro it is, where nobody named one of several.
fn first_of(record: &Record, gyro: &Channel, named: Option<&str>) -> Option<String> {
    let is_other = |c: &&Channel| c.quantity == Quantity::Gyro && c.name != gyro.name;
    let others: Vec<&str> = (record.channels.iter().filter(is_other))
        .map(|c| c.name.as_str())
        .collect();
    (named.is_none() && !others.is_empty()).then(|| {
        format!(
            "planned for {}: `--channel` names {} instead",
            gyro.name,
            others.join(" or ")
        )
    })
}

/// The slow part of a curve is a random walk or a ramp to who knows no other name for it. Beside a cause that a model holds it
/// may be far smaller, and the plan another one.
fn may_be_causes(noise: &Noise) -> Option<String> {
    let letters = [("K", noise.k), ("R", noise.r)].into_iter();
    let letters: Vec<&str> = letters.filter(|(_, v)| *v != 0.0).map(|(l, _)| l).collect();
    let is = match letters.len() {
        0 => return None,
        1 => "is",
        _ => "are",
    };
    Some(format!(
        "{} {is} read off the curve, and a cause (temperature, supply, motor) may be behind it: `imu-stand diagnose CAPTURE \
         --model-out model.toml` looks for one, and `imu-stand plan --model model.toml` plans by the noise beside it",
        letters.join(" and ")
    ))
}

/// The terms that describe the noise of a gyro.
fn described(gyro: &Channel, sampling: &Sampling, seed: u64) -> Result<Described> {
    let runs = sampling.runs_of(&gyro.values);
    let spectrum = Spectrum::with_gaps(&gyro.values, &runs, &sampling.slots, sampling.tau0);
    let samples: usize = runs.iter().map(ExactSizeIterator::len).sum();
    if samples < LEAST_SAMPLES {
        return Err(explain(model::record::AnalysisError::Inconclusive {
            what: format!("a plan by the noise of {}", gyro.name),
            have: samples as f64,
            need: LEAST_SAMPLES as f64,
            unit: "samples",
        }));
    }
    let longest = runs.iter().map(ExactSizeIterator::len).max().unwrap_or(0);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    Ok(fit_described(&spectrum, longest / 5, &mut rng))
}

/// The noise to plan by, with notes on what is assumed of terms that are not established; steps are `tau0` s apart.
fn noise_of(described: &Described, tau0: f64) -> Noise {
    let found = &described.fit;
    let mut notes = Vec::new();
    notes.extend(misfit_warning(described, tau0));
    let estimates = [
        found.term(Term::White),
        found.term(Term::Flicker),
        found.term(Term::RandomWalk),
        found.term(Term::Quantization),
        found.rate_ramp,
    ];
    let limits = estimates.map(|e| if e.value.is_none() { e.high } else { 0.0 });
    let mut absent = vec![];
    let mut value = |name: &str, (scale, unit): (f64, &str), e: Estimated| {
        e.value.unwrap_or_else(|| {
            absent.push(format!(
                "{name} (at most {} {unit})",
                number(scale * e.high, 3)
            ));
            0.0
        })
    };
    let white = found.term(Term::White);
    // No gyro is without it: of what is not known, the worst.
    let n = white.value.unwrap_or(white.high);
    let b = value("B", (3600.0, "deg/h"), found.term(Term::Flicker));
    let k = value("K", (1.0, "deg/s/sqrt(s)"), found.term(Term::RandomWalk));
    let q = value("Q", (1.0, "deg"), found.term(Term::Quantization));
    let r = value("R", (1.0, "deg/s^2"), found.rate_ramp);
    if !absent.is_empty() {
        notes.push(format!(
            "not established in this capture, and planned as absent: {}",
            absent.join(", ")
        ));
    }
    if white.value.is_none() {
        notes.push(format!(
            "N is not established in this capture: planned at its limit, {} deg/sqrt(h)",
            number(60.0 * n, 3)
        ));
    }
    Noise {
        from: String::new(),
        rate_hz: 1.0 / tau0,
        n,
        b,
        k,
        q,
        r,
        notes,
        limits,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_walk_of_the_curve_points_to_the_diagnosis_and_the_gyro_taken_is_named() {
        let noise = |k: f64| Noise {
            from: String::new(),
            rate_hz: 20.0,
            n: 0.1,
            b: 0.0,
            k,
            q: 0.0,
            r: 0.0,
            notes: Vec::new(),
            limits: [0.0; 5],
        };
        let said = may_be_causes(&noise(0.01)).expect("K is the curve's");
        assert!(
            said.starts_with("K is ") && said.contains("plan --model"),
            "{said}"
        );
        assert_eq!(may_be_causes(&noise(0.0)), None);
        let model = model::ModelFile::paper();
        let record = model::simulate(&model, 10.0, 20.0, 1).expect("a record");
        let gyro = record.channel("gyro_x").expect("a gyro");
        let said = first_of(&record, gyro, None).expect("one of three");
        assert_eq!(
            said,
            "planned for gyro_x: `--channel` names gyro_y or gyro_z instead"
        );
        assert_eq!(first_of(&record, gyro, Some("gyro_x")), None);
    }
}
