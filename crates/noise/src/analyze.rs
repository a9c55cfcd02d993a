//! `imu-stand analyze`: deviations, noise parameters and the paper's figures of every channel.

use std::collections::BTreeMap;

use model::record::{Channel, Quantity, Record};
use rand_core::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};

use crate::allan::{Deviation, Gapped, Phase, TauGrid};
use crate::angles::{Angle, Attitude, angle, attitude};
pub use crate::curves::DeviationPoint;
use crate::curves::{curve, gapped_curve, gaps_note};
use crate::fit::{Described, Estimated, NoiseFit, Ramp, Spectrum, Term, fit_described};
use crate::paper::{Figure, paper_figures};
use crate::units::{Scale, Units};
use model::record::AnalysisError;
use model::record::rows;
use model::record::sampling::Sampling;

/// The `format` of an analysis.
pub const ANALYSIS_FORMAT: &str = "imu-stand-analysis/1";

/// Samples in runs below which no noise parameter is estimated.
const FIT_NEEDS: usize = 64;

/// Options of [`analyze`].
#[derive(Clone, Debug, PartialEq)]
pub struct AnalyzeOptions {
    /// Deviations to compute.
    pub deviations: Vec<Deviation>,
    /// Cluster times.
    pub taus: TauGrid,
    /// Channels by name; without it the gyros, the accelerometers and channels of unknown kind.
    pub channels: Option<Vec<String>>,
    /// Sample rate that overrides what the record says, Hz.
    pub rate_hz: Option<f64>,
    /// Seed of the replicates behind intervals and the check of the fit.
    pub seed: u64,
    /// Name of the file, for the report.
    pub file: String,
}

impl Default for AnalyzeOptions {
    fn default() -> Self {
        Self {
            deviations: vec![Deviation::Oadev],
            taus: TauGrid::Octave,
            channels: None,
            rate_hz: None,
            seed: 0,
            file: String::new(),
        }
    }
}

/// What was analyzed.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AnalysisInput {
    /// File name as the user gave it.
    pub file: String,
    /// Time covered by samples, s.
    pub seconds: f64,
    /// Sample rate, Hz.
    pub rate_hz: f64,
    /// Rows.
    pub samples: usize,
    /// Channels present.
    pub channels: Vec<String>,
    /// Interruptions of the record.
    pub gaps: usize,
    /// Samples lost in them, as far as they can be counted.
    pub lost_samples: u64,
    /// What was wrong with the rows, and what was done about it.
    #[serde(default)]
    pub notes: Vec<String>,
    /// Scatter of the sample times about an even grid, s rms, where times are known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub jitter_s: Option<f64>,
}

/// A figure with its 95 % interval.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// `None` where the record does not establish it.
    pub value: Option<f64>,
    /// Standard error; `None` without a value.
    pub std_error: Option<f64>,
    /// Lower end.
    pub low: Option<f64>,
    /// Upper end; without a value the upper limit.
    pub high: Option<f64>,
    /// Unit of all four.
    pub unit: String,
}

impl Interval {
    fn unknown(scale: &Scale) -> Self {
        Self {
            value: None,
            std_error: None,
            low: None,
            high: None,
            unit: scale.unit.clone(),
        }
    }

    fn estimated(e: Estimated, scale: &Scale) -> Self {
        Self {
            value: e.value.map(|v| v * scale.factor),
            std_error: e.std_error.map(|v| v * scale.factor),
            low: Some(e.low * scale.factor),
            high: Some(e.high * scale.factor),
            unit: scale.unit.clone(),
        }
    }

    fn figure(f: Option<Figure>, scale: &Scale) -> Self {
        f.map_or_else(
            || Self::unknown(scale),
            |f| {
                Self::estimated(
                    Estimated {
                        value: Some(f.value),
                        std_error: Some(f.std_error),
                        low: f.low,
                        high: f.high,
                    },
                    scale,
                )
            },
        )
    }
}

/// N, B, K, R, Q of IEEE Std 952.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NoiseParameters {
    /// N.
    pub angle_random_walk: Interval,
    /// B.
    pub bias_instability: Interval,
    /// K.
    pub rate_random_walk: Interval,
    /// R.
    pub rate_ramp: Interval,
    /// Q.
    pub quantization_noise: Interval,
}

impl NoiseParameters {
    pub(crate) fn of(fitted: &NoiseFit, units: &Units) -> Self {
        let term = |term: Term, scale: &Scale| Interval::estimated(fitted.term(term), scale);
        Self {
            angle_random_walk: term(Term::White, &units.angle_random_walk),
            bias_instability: term(Term::Flicker, &units.bias_instability),
            rate_random_walk: term(Term::RandomWalk, &units.rate_random_walk),
            rate_ramp: Interval::estimated(fitted.rate_ramp, &units.rate_ramp),
            quantization_noise: term(Term::Quantization, &units.quantization_noise),
        }
    }
}

/// The paper's figures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Paper {
    /// From the line between 0.1 and 10 s.
    pub angle_random_walk: Interval,
    /// Level between 10 and 100 s.
    pub in_run_bias_stability: Interval,
    /// What a reader has to know.
    pub notes: Vec<String>,
}

/// Everything about one channel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChannelAnalysis {
    /// Unit of the deviations.
    pub unit: String,
    /// By name of the deviation.
    pub deviations: BTreeMap<Deviation, Vec<DeviationPoint>>,
    /// Noise parameters.
    pub parameters: NoiseParameters,
    /// The paper's figures.
    pub paper: Paper,
    /// What a reader has to know.
    pub warnings: Vec<String>,
    /// Cluster time from which on the parameters describe the record, s: the sample interval, or more where the upper end of
    /// the spectrum had to be left out. `None` where they do not: values and intervals are then no more than a description.
    #[serde(default)]
    pub parameters_hold_from_s: Option<f64>,
    /// Overlapping Allan deviation of the fitted parameters at the cluster times of the octave grid: `[τ in s, σ]`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub fitted: Vec<[f64; 2]>,
    /// The integral, with what the fit predicts for it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angle: Option<Angle>,
}

/// An analysis, exactly as `--json` writes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Analysis {
    /// [`ANALYSIS_FORMAT`].
    pub format: String,
    /// What was analyzed.
    pub input: AnalysisInput,
    /// By channel.
    pub channels: BTreeMap<String, ChannelAnalysis>,
    /// The attitude, where there are three gyros.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub attitude: Option<Attitude>,
}

/// Analyze a record.
///
/// # Errors
/// [`AnalysisError::NoChannel`] when a channel asked for is absent or the record has none to analyze,
/// [`AnalysisError::NoRate`] when its sample rate is unknown, [`AnalysisError::BadOption`] for a rate that is not
/// positive, [`AnalysisError::Inconclusive`] below 3 samples, [`AnalysisError::Constant`] when nothing in it moves.
pub fn analyze(record: &Record, options: &AnalyzeOptions) -> Result<Analysis, AnalysisError> {
    let record = &*rows::in_order(record);
    let present = || {
        record
            .channels
            .iter()
            .map(|c| c.name.clone())
            .collect::<Vec<_>>()
    };
    let chosen: Vec<&Channel> = match &options.channels {
        Some(names) => names
            .iter()
            .map(|name| {
                record
                    .channel(name)
                    .ok_or_else(|| AnalysisError::NoChannel {
                        name: name.clone(),
                        present: present(),
                    })
            })
            .collect::<Result<_, _>>()?,
        None => {
            let of = |all: &[Quantity]| -> Vec<&Channel> {
                let channels = record.channels.iter();
                channels.filter(|c| all.contains(&c.quantity)).collect()
            };
            let main = of(&[Quantity::Gyro, Quantity::Acc, Quantity::Other]);
            // Who has nothing else to show has chosen by that.
            if main.is_empty() {
                of(&[Quantity::Temp, Quantity::Supply])
            } else {
                main
            }
        }
    };
    if chosen.is_empty() {
        return Err(AnalysisError::NoChannel {
            name: "gyro_*, acc_*, temp* or supply".into(),
            present: present(),
        });
    }
    if record.len() < 3 {
        return Err(AnalysisError::Inconclusive {
            what: "a deviation".into(),
            have: record.len() as f64,
            need: 3.0,
            unit: "samples",
        });
    }
    let sampling = Sampling::of(record, options.rate_hz)?;
    let (mut channels, mut fits) = (BTreeMap::new(), BTreeMap::new());
    let mut constant = None;
    for channel in &chosen {
        let (result, fit) = analyze_channel(channel, &sampling, options);
        fits.extend(fit.map(|fit| (channel.name.clone(), fit)));
        if result.deviations.is_empty() {
            constant.get_or_insert((
                channel.name.clone(),
                channel.values.iter().copied().find(|v| v.is_finite()),
            ));
        }
        channels.insert(channel.name.clone(), result);
    }
    if channels.values().all(|c| c.deviations.is_empty())
        && let Some((name, value)) = constant
    {
        return Err(AnalysisError::Constant {
            name,
            value: value.unwrap_or(f64::NAN),
        });
    }
    Ok(Analysis {
        format: ANALYSIS_FORMAT.into(),
        input: AnalysisInput {
            file: options.file.clone(),
            seconds: record.len() as f64 * sampling.tau0,
            rate_hz: 1.0 / sampling.tau0,
            samples: record.len(),
            channels: present(),
            gaps: sampling.runs.len().saturating_sub(1),
            lost_samples: sampling.lost,
            notes: record.notes.clone(),
            jitter_s: sampling.jitter_s,
        },
        attitude: attitude(record, &sampling, &fits).filter(|_| {
            channels
                .keys()
                .filter(|name| name.starts_with("gyro_"))
                .count()
                == 3
        }),
        channels,
    })
}

fn analyze_channel(
    channel: &Channel,
    sampling: &Sampling,
    options: &AnalyzeOptions,
) -> (ChannelAnalysis, Option<NoiseFit>) {
    let units = Units::of(channel.quantity, &channel.unit);
    let tau0 = sampling.tau0;
    let runs = sampling.runs_of(&channel.values);
    let mut out = ChannelAnalysis {
        unit: units.reading.unit.clone(),
        deviations: BTreeMap::new(),
        parameters: NoiseParameters {
            angle_random_walk: Interval::unknown(&units.angle_random_walk),
            bias_instability: Interval::unknown(&units.bias_instability),
            rate_random_walk: Interval::unknown(&units.rate_random_walk),
            rate_ramp: Interval::unknown(&units.rate_ramp),
            quantization_noise: Interval::unknown(&units.quantization_noise),
        },
        paper: Paper {
            angle_random_walk: Interval::unknown(&units.angle_random_walk),
            in_run_bias_stability: Interval::unknown(&units.bias_instability),
            notes: Vec::new(),
        },
        warnings: sampling.warnings.clone(),
        parameters_hold_from_s: None,
        fitted: Vec::new(),
        angle: None,
    };
    let mut readings = runs.iter().flat_map(|r| &channel.values[r.clone()]);
    let Some(first) = readings.next() else {
        out.warnings
            .push("the channel has no finite reading".into());
        return (out, None);
    };
    if readings.all(|v| v == first) {
        out.warnings.push(format!(
            "the channel reads {first} throughout: a sensor at rest has noise, so this is no measurement"
        ));
        return (out, None);
    }
    let phase = match (&channel.counts, channel.lsb) {
        (Some(counts), Some(lsb)) if counts.len() == channel.values.len() => {
            Phase::from_counts(counts, lsb, &runs)
        }
        _ => Phase::from_values(&channel.values, &runs),
    };
    let spectrum = (phase.samples() >= FIT_NEEDS)
        .then(|| Spectrum::with_gaps(&channel.values, &runs, &sampling.slots, tau0))
        .filter(|s| s.coefficients() >= FIT_NEEDS as f64 / 2.0);
    let gapped = (runs.len() > 1).then(|| Gapped::new(&channel.values, &runs, &sampling.slots));
    let longest = gapped.as_ref().map_or(phase.longest_run(), |g| {
        g.lengths().into_iter().max().unwrap_or(0)
    });
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(options.seed);
    let described = spectrum
        .as_ref()
        .map(|s| fit_described(s, longest / 5, &mut rng));
    let fitted = described.as_ref().map(|d| d.fit.clone());
    if let Some(gapped) = &gapped {
        out.warnings.push(gaps_note(gapped, &phase, tau0));
    }
    for kind in &options.deviations {
        let scale = if *kind == Deviation::Tdev {
            &units.time_deviation
        } else {
            &units.reading
        };
        let points = match &gapped {
            Some(gapped) => gapped_curve(
                gapped,
                *kind,
                &phase,
                fitted.as_ref(),
                tau0,
                options.taus,
                scale,
            ),
            None => curve(&phase, *kind, tau0, options.taus, scale),
        };
        out.deviations.insert(*kind, points);
    }
    let (Some(spectrum), Some(fitted), Some(described)) = (spectrum, fitted, described) else {
        out.warnings.push(format!(
            "inconclusive: noise parameters need {FIT_NEEDS} samples, the channel has {}",
            phase.samples()
        ));
        return (out, None);
    };
    out.parameters = NoiseParameters::of(&fitted, &units);
    out.parameters_hold_from_s = described.hold_from_m().map(|m| m as f64 * tau0);
    out.warnings.extend(misfit_warning(&described, tau0));
    let short_times = out.parameters_hold_from_s.filter(|_| described.from_m > 1);
    let n = &out.parameters.angle_random_walk;
    if let (Some(from), Some(high)) = (short_times, n.high)
        && let Some((least, at)) = (out.deviations.get(&Deviation::Oadev).into_iter().flatten())
            .filter(|p| p.tau_s < from)
            .map(|p| {
                let per_reading = units.angle_random_walk.factor / units.reading.factor;
                (p.high * p.tau_s.sqrt() * per_reading, p.tau_s)
            })
            .min_by(|a, b| a.0.total_cmp(&b.0))
        && least < high
    {
        out.warnings.push(format!(
            "the curve at {} s leaves room for N up to {} {} and no more, unless something filters the readings over such times: \
             what is above is what the curve from {} s on allows by itself",
            short(at),
            short(least),
            n.unit,
            short(from)
        ));
    }
    let walk = fitted.term(Term::RandomWalk);
    if walk.value.is_some() && walk.low == 0.0 && fitted.term(Term::Flicker).value.is_none() {
        out.warnings.push(
            "slow noise is there, but the record is too short to tell a rate random walk from a bias instability: the \
             interval of each allows for the other. `imu-stand plan` says what to record"
                .into(),
        );
    }
    out.fitted = TauGrid::Octave
        .factors(longest / 2)
        .into_iter()
        .filter(|m| *m >= described.from_m)
        .map(|m| [m as f64 * tau0, fitted.deviation(m) * units.reading.factor])
        .collect();
    if channel.quantity == Quantity::Gyro {
        out.angle = angle(channel, &runs, &fitted, &units.integral);
        if runs.len() > 1 && out.angle.is_some() {
            out.warnings.push(format!(
                "the integrated angle is that of the longest run without a gap, {:.6} of {:.6} s: what turned in a gap \
                 nobody measured",
                phase.longest_run() as f64 * tau0,
                phase.samples() as f64 * tau0
            ));
        }
    }
    if let Some(lsb) = channel.lsb
        && let Some(n) = fitted.term(Term::White).value
        && n / tau0.sqrt() < 0.5 * lsb
    {
        out.warnings.push(format!(
            "the noise of a sample is {:.2} steps of the converter: below half a step the readings stick to codes, and \
             every figure here is in doubt",
            n / tau0.sqrt() / lsb
        ));
    }
    let figures = paper_figures(&phase, gapped.as_ref(), &spectrum, &fitted, &mut rng);
    out.paper = Paper {
        angle_random_walk: Interval::figure(figures.angle_random_walk, &units.angle_random_walk),
        in_run_bias_stability: Interval::figure(
            figures.in_run_bias_stability,
            &units.bias_instability,
        ),
        notes: figures.notes,
    };
    (out, Some(fitted))
}

/// What a reader has to know where the terms do not describe the whole curve.
#[must_use]
pub fn misfit_warning(described: &Described, tau0: f64) -> Option<String> {
    let (refused, found) = described.refused.as_ref()?;
    let cure = if described.from_m > 1 {
        let half_band = 1.0 / (described.from_m as f64 * tau0);
        format!(
            "Below {} Hz they do ({}): parameters and intervals are from there, for cluster times from {} s on",
            short(half_band),
            letters(&described.fit),
            short(described.from_m as f64 * tau0)
        )
    } else {
        "Parameters and intervals presume the terms".to_owned()
    };
    Some(format!(
        "the fitted terms ({}) do not describe the curve: sup |z| = {:.1} at {} s, where the deviation is {:.1} % {} the \
         fit (p = {:.3} over refitted replicates). {cure}; `imu-stand diagnose` looks for the cause",
        letters(refused),
        found.sup_z,
        short(found.worst_m as f64 * tau0),
        100.0 * (found.ratio - 1.0).abs(),
        if found.ratio > 1.0 { "above" } else { "below" },
        found.p_value
    ))
}

/// Four significant digits, without zeros behind them.
fn short(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

/// The terms in a fit.
fn letters(fitted: &NoiseFit) -> String {
    let names: Vec<&str> = Term::ALL
        .into_iter()
        .filter(|t| fitted.model.terms[*t as usize])
        .map(|t| match t {
            Term::White => "N",
            Term::Flicker => "B",
            Term::RandomWalk => "K",
            Term::Quantization => "Q",
        })
        .chain((fitted.model.ramp != Ramp::Absent).then_some("R"))
        .collect();
    names.join(", ")
}
