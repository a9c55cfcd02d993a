//! `imu-stand analyze`: deviations, noise parameters and the paper's figures of every channel.

mod channel;

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
use crate::paper::{Figure, PaperFigures, paper_figures};
use crate::units::{Scale, Units};
use channel::analyze_channel;
pub use channel::misfit_warning;
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

/// Names of the channels of a record.
fn names(record: &Record) -> Vec<String> {
    record.channels.iter().map(|c| c.name.clone()).collect()
}

/// The channels to analyze: those that were asked for, or the gyros, accelerometers and others; where there are none of these,
/// thermometers and supply.
fn chosen<'a>(
    record: &'a Record,
    asked: Option<&[String]>,
) -> Result<Vec<&'a Channel>, AnalysisError> {
    let absent = |name: &str| AnalysisError::NoChannel {
        name: name.to_owned(),
        present: names(record),
    };
    let of = |all: &[Quantity]| -> Vec<&Channel> {
        let channels = record.channels.iter();
        channels.filter(|c| all.contains(&c.quantity)).collect()
    };
    let found = match asked {
        Some(asked) => asked
            .iter()
            .map(|name| record.channel(name).ok_or_else(|| absent(name)))
            .collect::<Result<Vec<_>, _>>()?,
        None => match of(&[
            Quantity::Gyro,
            Quantity::Acc,
            Quantity::Other,
            Quantity::Derived,
        ]) {
            // Who has nothing else to show has chosen by that.
            main if main.is_empty() => of(&[Quantity::Temp, Quantity::Supply]),
            main => main,
        },
    };
    if found.is_empty() {
        return Err(absent("gyro_*, acc_*, temp* or supply"));
    }
    Ok(found)
}

/// Analyze a record.
///
/// # Errors
/// [`AnalysisError::NoChannel`] when a channel asked for is absent or the record has none to analyze,
/// [`AnalysisError::NoRate`] when its sample rate is unknown, [`AnalysisError::BadOption`] for a rate that is not
/// positive, [`AnalysisError::Inconclusive`] below 3 samples, [`AnalysisError::Constant`] when nothing in it moves.
pub fn analyze(record: &Record, options: &AnalyzeOptions) -> Result<Analysis, AnalysisError> {
    let record = &*rows::in_order(record);
    let chosen = chosen(record, options.channels.as_deref())?;
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
            channels: names(record),
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
