//! Gyros and accelerometers of one record, each kind diagnosed by itself: the ones are no cause of what the others read, but
//! for a knock at the base, which both feel.
//!
//! The search knows sensors under test, beside which temperatures, supply and command are recorded. Accelerometers under test
//! take the place of the gyros in a record of their own, so that every audit, hypothesis and check is asked of them too. What
//! moves the base moves them, and is no error of theirs: a line, a band or a step of an accelerometer has a motion of the base
//! for its rival, and they are diagnosed at rest only.

use model::effects::effect;
use model::effects::{
    am_line, base_motion, bias_step, common_noise, correlated_noise, gauss_markov, line, low_pass,
    narrow_band, noise_change, rate_ramp, shock, wandering_line,
};
use model::file::ModelFile;
use model::integral;
use model::record::{AnalysisError, Base, Channel, Quantity, Record};

use super::{DiagnoseOptions, diagnose, ranked};
use crate::criticise::one_source;
use crate::result::{Alternative, Consequence, Diagnosed, Diagnosis, Finding, Verdict};
use crate::test_level::with_part;

/// What an accelerometer at rest may show because the base does it.
const OF_THE_BASE: [&str; 11] = [
    line::ID,
    am_line::ID,
    narrow_band::ID,
    wandering_line::ID,
    gauss_markov::ID,
    low_pass::ID,
    bias_step::ID,
    rate_ramp::ID,
    noise_change::ID,
    common_noise::ID,
    correlated_noise::ID,
];
/// What tells.
const DECOUPLED: &str =
    "decouple the base from the bench, or stand it on another one: what changes is of the base";
/// What only a gyro has, or a record as a whole, of which the gyros' diagnosis tells.
const NOT_OF_ACCELEROMETERS: [&str; 8] = [
    "g_sensitivity",
    "cross_axis",
    "scale_error",
    "base_motion",
    "stale_samples",
    "dropped_samples",
    "timestamp_jitter",
    "clock_rate",
];

/// Diagnose some channels of a record, gyros and accelerometers. Each kind has half of the error budget where both are asked.
///
/// # Errors
/// Those of [`diagnose`]; [`AnalysisError::NoChannel`] for a name that is no gyro or accelerometer of the record.
pub fn diagnose_channels(
    record: &Record,
    channels: &[String],
    options: &DiagnoseOptions,
) -> Result<Diagnosed, AnalysisError> {
    let of = |quantity: Quantity| {
        let own = move |c: &&Channel| c.quantity == quantity && channels.contains(&c.name);
        record.channels.iter().filter(own).count()
    };
    let sensor = |c: &&Channel| matches!(c.quantity, Quantity::Gyro | Quantity::Acc);
    let sensors: Vec<&Channel> = record.channels.iter().filter(sensor).collect();
    if let Some(unknown) = channels
        .iter()
        .find(|n| sensors.iter().all(|c| c.name != **n))
    {
        return Err(AnalysisError::NoChannel {
            name: unknown.clone(),
            present: sensors.iter().map(|c| c.name.clone()).collect(),
        });
    }
    let (gyros, accelerometers) = (of(Quantity::Gyro), of(Quantity::Acc));
    let under_test = |c: &Channel| c.quantity != Quantity::Gyro || channels.contains(&c.name);
    let mut own = record.clone();
    own.channels.retain(under_test);
    match (gyros, accelerometers) {
        (_, 0) => diagnose(&own, options),
        (0, _) => diagnose(&felt(record, channels), options).map(of_accelerometers),
        _ => with_part(0.5, || {
            let mut first = diagnose(&own, options)?;
            let moved = |f: &Finding| f.cause == base_motion::ID;
            let turned = matches!(record.header.base, Some(Base::Moving | Base::Turntable));
            if turned || first.diagnosis.findings.iter().any(moved) {
                let note =
                    "the accelerometers are not diagnosed: the base moves, and they feel that";
                first.diagnosis.input.notes.push(note.to_owned());
                return Ok(first);
            }
            let second = diagnose(&felt(record, channels), options)?;
            Ok(joined(first, of_accelerometers(second)))
        }),
    }
}

/// The accelerometers of these names in the gyros' place, and what was recorded beside them.
fn felt(record: &Record, channels: &[String]) -> Record {
    let mut own = record.clone();
    own.channels.retain(|c| {
        c.quantity != Quantity::Gyro && (c.quantity != Quantity::Acc || channels.contains(&c.name))
    });
    for c in own
        .channels
        .iter_mut()
        .filter(|c| c.quantity == Quantity::Acc)
    {
        c.quantity = Quantity::Gyro;
        from_zero(c);
    }
    // Frames and their clocks are the gyros' to tell of.
    (own.t_ticks, own.host_time_s, own.flags) = (None, None, None);
    own.header.rate_hz = crate::ingest::grid::rate_of(record);
    own
}

/// Counts from the reading 0 on, as those of a gyro are.
fn from_zero(channel: &mut Channel) {
    let (Some(counts), Some(lsb)) = (&mut channel.counts, channel.lsb) else {
        return;
    };
    let mut known = channel
        .values
        .iter()
        .zip(counts.iter())
        .filter(|(v, _)| v.is_finite());
    let Some(zero) = known
        .next()
        .map(|(v, c)| (f64::from(*c) - v / lsb).round() as i32)
    else {
        return;
    };
    counts.iter_mut().for_each(|c| *c -= zero);
}

/// What was found on accelerometers, each with what the base may have to do with it.
fn of_accelerometers(mut of: Diagnosed) -> Diagnosed {
    let d = &mut of.diagnosis;
    for f in d.findings.iter_mut() {
        if OF_THE_BASE.contains(&f.cause.as_str()) {
            f.alternatives.push(Alternative {
                cause: base_motion::ID.into(),
                log_odds: 0.0,
            });
            f.experiment.get_or_insert_with(|| DECOUPLED.to_owned());
        }
    }
    as_velocity(d, &of.baseline_model);
    let asked = |cause: &String| !NOT_OF_ACCELEROMETERS.contains(&cause.as_str());
    d.not_tested.retain(|n| asked(&n.cause));
    d.detection_limits.retain(|l| asked(&l.cause));
    of
}

/// Integrated an acceleration is a velocity, and no angle: what was told by horizon, in m/s where the channel is in m/s^2.
fn as_velocity(d: &mut Diagnosis, of: &ModelFile) {
    let in_si = |channel: Option<&String>| {
        let own = of.channels.iter().find(|c| Some(&c.name) == channel);
        own.is_some_and(|c| integral::of(&c.unit).1 == "m/s")
    };
    let moved = |of: &mut Consequence, known: bool| {
        let all = std::mem::take(&mut of.angle_rms_deg);
        of.velocity_rms_mps
            .extend(all.into_iter().filter(|_| known));
    };
    for f in &mut d.findings {
        let known = in_si(f.channels.first());
        if let Some(gain) = &mut f.gain {
            let all = std::mem::take(&mut gain.angle_rms_deg);
            gain.velocity_rms_mps
                .extend(all.into_iter().filter(|_| known));
        }
        f.consequence.iter_mut().for_each(|c| moved(c, known));
    }
    for u in &mut d.unexplained {
        let known = in_si(Some(&u.channel));
        u.consequence.iter_mut().for_each(|c| moved(c, known));
    }
}

/// Both diagnoses in one.
fn joined(mut first: Diagnosed, second: Diagnosed) -> Diagnosed {
    let (d, other) = (&mut first.diagnosis, second.diagnosis);
    d.baseline.extend(other.baseline);
    d.extended.extend(other.extended);
    d.checks.extend(other.checks);
    d.replicates.extend(other.replicates);
    d.detection_limits.extend(other.detection_limits);
    let known = d.not_tested.clone();
    let new = other.not_tested.into_iter().filter(|n| !known.contains(n));
    d.not_tested.extend(new);
    for f in other.findings {
        match d
            .findings
            .iter_mut()
            .find(|own| is_one_shock(own, &f) || shakes_both(own, &f))
        {
            Some(own) => felt_too(own, f),
            None => d.findings.push(f),
        }
    }
    d.unexplained.extend(other.unexplained);
    ranked(&mut d.findings, &mut d.unexplained);
    d.verdict = match (d.verdict, other.verdict) {
        (Verdict::Unexplained, _) | (_, Verdict::Unexplained) => Verdict::Unexplained,
        (Verdict::Adequate, Verdict::Adequate) => Verdict::Adequate,
        _ => Verdict::Extended,
    };
    for (own, others) in [
        (&mut first.baseline_model, second.baseline_model),
        (&mut first.extended_model, second.extended_model),
    ] {
        own.channels.extend(others.channels);
        own.effects.extend(others.effects);
        own.unnamed.extend(others.unnamed);
    }
    first.evidence.extend(second.evidence);
    first
}

/// Whether two findings are one knock at the base.
fn is_one_shock(a: &Finding, b: &Finding) -> bool {
    let value = |f: &Finding, name: &str| f.parameters.get(name).map(|p| p.value);
    let span = |f: &Finding| Some((value(f, "time")?, value(f, "duration")?));
    match (span(a), span(b)) {
        (Some((at, lasts)), Some((other, goes_on)))
            if a.cause == shock::ID && b.cause == shock::ID =>
        {
            (at - other).abs() <= lasts.max(goes_on)
        }
        _ => false,
    }
}

/// Whether what an oscillation of the gyros is read by, as it says, is that of accelerometers.
fn shakes_both(gyros: &Finding, accelerometers: &Finding) -> bool {
    let mut channels = accelerometers.channels.iter();
    gyros.cause == accelerometers.cause
        && channels.any(|c| one_source::is_read_by(gyros, c))
        && effect(&gyros.cause)
            .is_some_and(|e| e.same_event(&gyros.parameters, &accelerometers.parameters))
}

/// Adds the channels of one finding to another of the same event.
fn felt_too(own: &mut Finding, other: Finding) {
    for f in [&*own, &other].map(Clone::clone) {
        if f.per_channel.is_empty() {
            own.per_channel.insert(f.channels[0].clone(), f.parameters);
        } else {
            own.per_channel.extend(f.per_channel);
        }
    }
    own.channels.extend(other.channels);
    own.material |= other.material;
    own.what = format!("{}; {}", own.what, other.what);
    let both = own.likelihood_ratio.zip(other.likelihood_ratio);
    own.likelihood_ratio = both.map(|(a, b)| a + b);
    if let (Some(a), Some(b)) = (&mut own.gain, other.gain) {
        a.delta_bic = a.delta_bic.zip(b.delta_bic).map(|(x, y)| x + y);
        a.ablation_nats = a.ablation_nats.zip(b.ablation_nats).map(|(x, y)| x + y);
    }
}
