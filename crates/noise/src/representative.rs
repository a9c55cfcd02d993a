//! Which of many runs represents them, and which do not: the paper's step before the analysis proper.

mod slow;

use std::borrow::Cow;

use model::record::{Channel, Quantity, Record};
use rand_core::{Rng, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, StudentsT};

use crate::allan::{Deviation, Phase, deviation};
use crate::analyze::{NoiseParameters, misfit_warning};
use crate::edf::NoiseType;
use crate::fit::{Spectrum, Term, fit, fit_described};
use crate::random_effects::{Pooled, pool};
use crate::units::Units;
use model::record::AnalysisError;
use model::record::rows;
use model::record::sampling::Sampling;

/// Runs below which nothing can be said about any one of them.
const NEEDED: usize = 4;
/// Chance of calling any run odd where none is, over all runs and figures.
const FALSE_ALARM: f64 = 0.05;
/// Draws behind the limit.
const DRAWS: usize = 4000;

/// One figure of one channel over all runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunFigure {
    /// The channel.
    pub channel: String,
    /// `angle_random_walk` (`short_term_noise` where N holds for long cluster times alone: the white noise nearest to the
    /// whole band), `slow_deviation` (overlapping Allan deviation at a tenth of the shortest run) or `bias`.
    pub figure: String,
    /// Unit of `values`, `pooled` and `spread`.
    pub unit: String,
    /// By run.
    pub values: Vec<f64>,
    /// Standard error of each, 0 where it is not known apart from the spread.
    pub std_errors: Vec<f64>,
    /// Median over the runs.
    pub pooled: f64,
    /// Run-to-run standard deviation (robust), what the errors alone would make included.
    pub spread: f64,
    /// Distance of each run from the median, in its own scale.
    pub z: Vec<f64>,
    /// Mean over the runs that are not odd, their run-to-run spread beyond the errors, and the test of equality. Sizes
    /// are pooled as logarithms; `mean` and its interval are sizes again, `run_to_run` is in parts of them.
    pub over_runs: Option<Pooled>,
    /// Whether the runs differ, after correction for the number of figures (Holm, 5 %); `None` where errors are unknown.
    pub differ: Option<bool>,
}

/// N, B, K, Q and R of all runs that are not odd, by one likelihood: each run has a constant of its own, the noise is one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Together {
    /// The channel.
    pub channel: String,
    /// Runs in it.
    pub runs: usize,
    /// The parameters, as `analyze` gives them.
    pub parameters: NoiseParameters,
    /// Cluster time from which on they describe the runs, as `analyze` gives it.
    pub parameters_hold_from_s: Option<f64>,
    /// What a reader has to know: that the terms do not describe the runs, or only at long cluster times.
    pub warnings: Vec<String>,
}

/// A run that does not represent the others.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Odd {
    /// Index of the run.
    pub run: usize,
    /// The channel.
    pub channel: String,
    /// In what.
    pub figure: String,
    /// Its distance from the others, in spreads.
    pub z: f64,
    /// Distance beyond which it stands out.
    pub limit: f64,
}

/// The answer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Representative {
    /// Index of the run nearest to the middle in all figures together, among those that are not odd.
    pub run: usize,
    /// Runs that stand out, after correction for the number of looks.
    pub odd: Vec<Odd>,
    /// |z| beyond which a run stands out of the median of all.
    pub limit: f64,
    /// Distance from the mean of the others, in their spread, beyond which it stands out as well.
    pub limit_alone: f64,
    /// All figures.
    pub figures: Vec<RunFigure>,
    /// Noise parameters of the runs together, by channel; empty where the sample rates differ.
    pub together: Vec<Together>,
}

/// Compare runs of the same stand by the gyros (without any, by all channels) that all of them have.
///
/// A run stands out by its distance from the median of all, over their robust spread, which several odd runs do not hide;
/// or by its distance from the mean of the others, over their spread, which sees a single odd run among few (Student's t).
/// A spread is never taken as less than the figure's own error. Each way may accuse runs that are alike in 2.5 % of the cases,
/// runs and figures counted (the first limit is simulated, the second exact, both with Bonferroni's correction).
///
/// # Errors
/// [`AnalysisError::Inconclusive`] below 4 runs or with runs too short to fit, [`AnalysisError::NoRate`] and
/// [`AnalysisError::NoChannel`] as elsewhere.
pub fn representative(records: &[Record], seed: u64) -> Result<Representative, AnalysisError> {
    if records.len() < NEEDED {
        return Err(AnalysisError::Inconclusive {
            what: "a comparison of runs".into(),
            have: records.len() as f64,
            need: NEEDED as f64,
            unit: "runs",
        });
    }
    let records: Vec<Cow<'_, Record>> = records.iter().map(rows::in_order).collect();
    let names = common_channels(&records)?;
    let samplings = records
        .iter()
        .map(|r| Sampling::of(r, None))
        .collect::<Result<Vec<_>, _>>()?;
    let mut figures = Vec::new();
    let mut spectra = Vec::new();
    for name in &names {
        let (of_channel, of_runs) = figures_of(&records, &samplings, name)?;
        figures.extend(of_channel);
        spectra.push(of_runs);
    }
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let limit = limit(records.len(), figures.len(), &mut rng);
    let limit_alone = limit_alone(records.len(), figures.len());
    let mut odd = stand_out(&figures, limit, limit_alone);
    let odd_runs: Vec<usize> = odd.iter().map(|o| o.run).collect();
    let is_odd = |run: usize| odd_runs.contains(&run);
    pool_figures(&mut figures, &is_odd);
    let together = together(&records, &samplings, &names, &spectra, &is_odd, &mut rng);
    for of in (together.iter()).filter(|t| t.parameters_hold_from_s != Some(samplings[0].tau0)) {
        call_short_term(&of.channel, &mut figures, &mut odd);
    }
    Ok(Representative {
        run: middle(records.len(), &figures, &is_odd),
        odd,
        limit,
        limit_alone,
        figures,
        together,
    })
}

/// Names of the gyros (without any, of all channels) that every run has.
fn common_channels(records: &[Cow<'_, Record>]) -> Result<Vec<String>, AnalysisError> {
    let common = |gyro: bool| -> Vec<String> {
        records[0]
            .channels
            .iter()
            .filter(|c| !gyro || c.quantity == Quantity::Gyro)
            .map(|c| c.name.clone())
            .filter(|name| records.iter().all(|r| r.channel(name).is_some()))
            .collect()
    };
    let gyros = common(true);
    let names = if gyros.is_empty() {
        common(false)
    } else {
        gyros
    };
    if names.is_empty() {
        return Err(AnalysisError::NoChannel {
            name: "common to all runs".into(),
            present: Vec::new(),
        });
    }
    Ok(names)
}

/// Runs beyond one of the limits, of the median of all or of the mean of the others, by the one they exceed more.
fn stand_out(figures: &[RunFigure], limit: f64, limit_alone: f64) -> Vec<Odd> {
    let mut odd = Vec::new();
    for figure in figures {
        for (run, z) in figure.z.iter().enumerate() {
            let alone = from_the_others(figure, run);
            let found = [(*z, limit), (alone, limit_alone)]
                .into_iter()
                .filter(|(z, limit)| z.abs() > *limit)
                .max_by(|a, b| (a.0.abs() / a.1).total_cmp(&(b.0.abs() / b.1)));
            if let Some((z, limit)) = found {
                odd.push(Odd {
                    run,
                    channel: figure.channel.clone(),
                    figure: figure.figure.clone(),
                    z,
                    limit,
                });
            }
        }
    }
    odd
}

/// Where the terms do not describe the whole band, N is what they say below; the whole band compares runs all the same, by
/// what it holds at its upper end, too, under another name.
fn call_short_term(channel: &str, figures: &mut [RunFigure], odd: &mut [Odd]) {
    let figures = figures.iter_mut().map(|f| (&f.channel, &mut f.figure));
    let odd = odd.iter_mut().map(|o| (&o.channel, &mut o.figure));
    for (of, figure) in figures.chain(odd) {
        if of == channel && figure == WHITE {
            SHORT_TERM.clone_into(figure);
        }
    }
}

/// The run with the least sum of z^2 over the figures, among those that are not odd.
fn middle(runs: usize, figures: &[RunFigure], is_odd: &dyn Fn(usize) -> bool) -> usize {
    let distance = |run: usize| figures.iter().map(|f| f.z[run].powi(2)).sum::<f64>();
    let place = |run: usize| (is_odd(run), distance(run));
    (0..runs)
        .map(|run| (place(run), run))
        .min_by(|((a, x), _), ((b, y), _)| a.cmp(b).then(x.total_cmp(y)))
        .map_or(0, |(_, run)| run)
}

/// Adds to each figure what its runs say together; the tests of equality are corrected for their number by Holm's method.
fn pool_figures(figures: &mut [RunFigure], is_odd: &dyn Fn(usize) -> bool) {
    for figure in figures.iter_mut() {
        let sizes = figure.figure != "bias";
        let (mut x, mut errors) = (Vec::new(), Vec::new());
        for (run, (value, error)) in figure.values.iter().zip(&figure.std_errors).enumerate() {
            if !is_odd(run) {
                x.push(if sizes { value.ln() } else { *value });
                errors.push(if sizes { error / value } else { *error });
            }
        }
        figure.over_runs = pool(&x, &errors).map(|mut p| {
            if sizes {
                p.mean = p.mean.exp();
                p.mean_low = p.mean_low.exp();
                p.mean_high = p.mean_high.exp();
            }
            p
        });
    }
    let mut tests: Vec<(usize, f64)> = figures
        .iter()
        .enumerate()
        .filter_map(|(i, f)| Some((i, f.over_runs?.equal_p?)))
        .collect();
    tests.sort_by(|a, b| a.1.total_cmp(&b.1));
    let count = tests.len();
    let mut differ = true;
    for (rank, (i, p)) in tests.into_iter().enumerate() {
        differ &= p * ((count - rank) as f64) < FALSE_ALARM;
        figures[i].differ = Some(differ);
    }
}

fn together(
    records: &[Cow<'_, Record>],
    samplings: &[Sampling],
    names: &[String],
    spectra: &[Vec<Spectrum>],
    is_odd: &dyn Fn(usize) -> bool,
    rng: &mut impl Rng,
) -> Vec<Together> {
    let tau0 = samplings[0].tau0;
    if samplings
        .iter()
        .any(|s| (s.tau0 / tau0 - 1.0).abs() > SAME_RATE)
    {
        return Vec::new();
    }
    names
        .iter()
        .zip(spectra)
        .filter_map(|(name, spectra)| {
            let channel = records[0].channel(name)?;
            let chosen: Vec<Spectrum> = spectra
                .iter()
                .enumerate()
                .filter(|(run, _)| !is_odd(*run))
                .map(|(_, s)| s.clone())
                .collect();
            let longest = chosen.iter().map(|s| s.samples).max().unwrap_or(0);
            let described = fit_described(&Spectrum::together(&chosen), longest / 5, rng);
            Some(Together {
                channel: name.clone(),
                runs: chosen.len(),
                parameters: NoiseParameters::of(
                    &described.fit,
                    &Units::of(channel.quantity, &channel.unit),
                ),
                parameters_hold_from_s: described.hold_from_m().map(|m| m as f64 * tau0),
                warnings: misfit_warning(&described, tau0).into_iter().collect(),
            })
        })
        .collect()
}

/// The white noise of a run, where it is N.
const WHITE: &str = "angle_random_walk";
/// The same where the terms do not describe the whole band: the white noise that is nearest to all of it.
const SHORT_TERM: &str = "short_term_noise";

/// Relative difference of sample intervals up to which runs have the same.
const SAME_RATE: f64 = 1e-3;

/// Samples of a run that a comparison needs.
const RUN_NEEDS: usize = 64;

/// White noise, slow deviation and bias of one run, each with its standard error.
fn row_of(
    name: &str,
    (channel, sampling, phase): (&Channel, &Sampling, &Phase),
    (tau, noise): (f64, NoiseType),
    units: &Units,
) -> Result<([(f64, f64); 3], Spectrum), AnalysisError> {
    let short = || AnalysisError::Inconclusive {
        what: format!("a comparison of runs by {name}"),
        have: phase.samples() as f64,
        need: RUN_NEEDS as f64,
        unit: "samples in a run",
    };
    if phase.samples() < RUN_NEEDS {
        return Err(short());
    }
    let runs = sampling.runs_of(&channel.values);
    let spectrum = Spectrum::with_gaps(&channel.values, &runs, &sampling.slots, sampling.tau0);
    let n = fit(&spectrum).term(Term::White);
    let (Some(value), Some(error)) = (n.value, n.std_error) else {
        return Err(short());
    };
    let m = slow::cluster(sampling, tau);
    let slow = deviation(phase, Deviation::Oadev, sampling.tau0, m).ok_or_else(short)?;
    let readings: Vec<f64> = runs
        .iter()
        .flat_map(|r| channel.values[r.clone()].iter().copied())
        .collect();
    let bias = readings.iter().sum::<f64>() / readings.len() as f64;
    let row = [
        (
            value * units.angle_random_walk.factor,
            error * units.angle_random_walk.factor,
        ),
        (
            slow.deviation * units.reading.factor,
            slow.deviation * units.reading.factor * slow::ln_error(noise, m, phase),
        ),
        (bias * units.reading.factor, 0.0),
    ];
    Ok((row, spectrum))
}

/// One figure of all runs: values and errors, and how far each run is off the median. Sizes are compared as ratios.
fn figure_of(
    name: &str,
    (figure, unit, is_size): (&str, String, bool),
    of: &[(f64, f64)],
) -> RunFigure {
    let values: Vec<f64> = of.iter().map(|r| r.0).collect();
    let std_errors: Vec<f64> = of.iter().map(|r| r.1).collect();
    let x: Vec<f64> = values
        .iter()
        .map(|v| if is_size { v.ln() } else { *v })
        .collect();
    let errors: Vec<f64> = values
        .iter()
        .zip(&std_errors)
        .map(|(v, e)| if is_size { e / v } else { *e })
        .collect();
    let (centre, spread) = (median(&x), scatter(&x));
    let z = x
        .iter()
        .zip(&errors)
        .map(|(x, e)| (x - centre) / spread.max(*e).max(f64::MIN_POSITIVE))
        .collect();
    let pooled = if is_size { centre.exp() } else { centre };
    RunFigure {
        channel: name.to_owned(),
        figure: figure.to_owned(),
        unit,
        values,
        std_errors,
        pooled,
        spread: if is_size { spread * pooled } else { spread },
        z,
        over_runs: None,
        differ: None,
    }
}

fn figures_of(
    records: &[Cow<'_, Record>],
    samplings: &[Sampling],
    name: &str,
) -> Result<(Vec<RunFigure>, Vec<Spectrum>), AnalysisError> {
    let channels: Vec<_> = records.iter().filter_map(|r| r.channel(name)).collect();
    let units = Units::of(channels[0].quantity, &channels[0].unit);
    let phases: Vec<Phase> = channels
        .iter()
        .zip(samplings)
        .map(|(c, s)| Phase::from_values(&c.values, &s.runs_of(&c.values)))
        .collect();
    let tau = phases
        .iter()
        .zip(samplings)
        .map(|(p, s)| p.longest_run() as f64 * s.tau0)
        .fold(f64::INFINITY, f64::min)
        / 10.0;
    let noise = slow::noise(&phases, samplings, tau);
    let mut spectra = Vec::new();
    let mut rows: Vec<[(f64, f64); 3]> = Vec::new();
    for ((channel, sampling), phase) in channels.iter().zip(samplings).zip(&phases) {
        let (row, spectrum) = row_of(name, (channel, sampling, phase), (tau, noise), &units)?;
        rows.push(row);
        spectra.push(spectrum);
    }
    let titles = [
        (WHITE, units.angle_random_walk.unit, true),
        ("slow_deviation", units.reading.unit.clone(), true),
        ("bias", units.reading.unit, false),
    ];
    let figures = titles
        .into_iter()
        .enumerate()
        .map(|(i, title)| {
            let of: Vec<(f64, f64)> = rows.iter().map(|r| r[i]).collect();
            figure_of(name, title, &of)
        })
        .collect();
    Ok((figures, spectra))
}

fn median(x: &[f64]) -> f64 {
    let mut sorted = x.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len();
    0.5 * (sorted[(n - 1) / 2] + sorted[n / 2])
}

/// 1.4826 times the median distance from the median: the standard deviation of Gaussian values.
fn scatter(x: &[f64]) -> f64 {
    let centre = median(x);
    1.4826 * median(&x.iter().map(|v| (v - centre).abs()).collect::<Vec<_>>())
}

/// A figure on the scale on which runs are compared, with its error: sizes as logarithms.
fn compared(figure: &RunFigure, run: usize) -> (f64, f64) {
    let (value, error) = (figure.values[run], figure.std_errors[run]);
    if figure.figure == "bias" {
        (value, error)
    } else {
        (value.ln(), error / value)
    }
}

/// Distance of a run from the mean of the others, in the spread that one more of them would have.
fn from_the_others(figure: &RunFigure, run: usize) -> f64 {
    let others: Vec<f64> = (0..figure.values.len())
        .filter(|other| *other != run)
        .map(|other| compared(figure, other).0)
        .collect();
    let n = others.len() as f64;
    let mean = others.iter().sum::<f64>() / n;
    let variance = others.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
    let (x, error) = compared(figure, run);
    let spread = (variance * (1.0 + 1.0 / n)).sqrt().max(error);
    (x - mean) / spread.max(f64::MIN_POSITIVE)
}

/// Student's t with n − 2 degrees of freedom, two-sided, for all runs and figures.
fn limit_alone(runs: usize, figures: usize) -> f64 {
    let tail = FALSE_ALARM / 2.0 / (2 * runs * figures) as f64;
    StudentsT::new(0.0, 1.0, runs as f64 - 2.0).map_or(f64::INFINITY, |t| t.inverse_cdf(1.0 - tail))
}

fn limit(runs: usize, figures: usize, rng: &mut impl Rng) -> f64 {
    let mut largest: Vec<f64> = (0..DRAWS)
        .map(|_| {
            let x: Vec<f64> = (0..runs).map(|_| StandardNormal.sample(rng)).collect();
            let (centre, spread) = (median(&x), scatter(&x));
            x.iter()
                .map(|v| ((v - centre) / spread).abs())
                .fold(0.0, f64::max)
        })
        .collect();
    largest.sort_by(f64::total_cmp);
    let tail = FALSE_ALARM / 2.0 / figures as f64;
    largest[(((1.0 - tail) * DRAWS as f64) as usize).min(DRAWS - 1)]
}

#[cfg(test)]
mod tests;
