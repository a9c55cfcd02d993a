//! The paper's own two figures from the Allan curve: a line of slope −1/2 between 0.1 and 10 s, a flat level between 10
//! and 100 s. With intervals, and with the reasons where they mislead.
//!
//! Source: Istomin, Belyaev (2009), sections 3.1 to 3.3.

use rand_core::Rng;

use crate::allan::{Deviation, Gapped, Phase, TauGrid, deviation};
use crate::fit::{NoiseFit, Spectrum, Term, replicate};
use crate::paper_model::{FLAT_S, LINE_S, PER_DECADE};

/// Length of a record over the longest cluster time that the paper asks for.
const LENGTH_OVER_TAU: f64 = 10.0;
/// Draws behind an interval.
const REPLICATES: usize = 400;

/// A figure with its 95 % interval, in the channel's unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Figure {
    /// The figure as the paper computes it.
    pub value: f64,
    /// Standard error over replicates of the fitted model.
    pub std_error: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// The paper's figures.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PaperFigures {
    /// σ(τ)·√τ of the line, U·√s.
    pub angle_random_walk: Option<Figure>,
    /// Level of the flat part, U (B of IEEE Std 952 is this over 0.664).
    pub in_run_bias_stability: Option<Figure>,
    /// What a reader has to know.
    pub notes: Vec<String>,
}

/// The curve that both figures are read from, with the model that its replicates are of.
struct Curve<'a> {
    phase: &'a Phase,
    gapped: Option<&'a Gapped>,
    spectrum: &'a Spectrum,
    fit: &'a NoiseFit,
    tau0: f64,
}

impl Curve<'_> {
    /// Averaging factors with cluster times in a range, s.
    fn factors(&self, (low, high): (f64, f64)) -> Vec<usize> {
        let longest = self.gapped.map_or(self.phase.longest_run(), |g| {
            g.lengths().into_iter().max().unwrap_or(0)
        });
        TauGrid::Log(PER_DECADE)
            .factors(longest / 2)
            .into_iter()
            .filter(|m| (low * 0.999..=high * 1.001).contains(&(*m as f64 * self.tau0)))
            .collect()
    }

    /// The overlapping Allan deviation.
    fn observed(&self, m: usize) -> Option<f64> {
        match self.gapped {
            Some(g) => g
                .overlapping_allan(self.tau0, m, self.fit.white_share(m))
                .map(|e| e.estimate.deviation),
            None => deviation(self.phase, Deviation::Oadev, self.tau0, m).map(|e| e.deviation),
        }
    }

    /// ln of a level, by least squares in log-log with the slope held.
    fn mean_log(&self, ms: &[usize], slope: f64, of: impl Fn(usize) -> Option<f64>) -> Option<f64> {
        let logs: Vec<f64> = ms
            .iter()
            .filter_map(|m| of(*m).map(|s| s.ln() - slope * (*m as f64 * self.tau0).ln()))
            .collect();
        (!logs.is_empty()).then(|| logs.iter().sum::<f64>() / logs.len() as f64)
    }

    /// ln of (figure of a replicate over figure of its model), with all terms or with the white noise alone; sorted.
    fn draw(&self, ms: &[usize], white_only: bool, rng: &mut impl Rng) -> Vec<f64> {
        let spectrum = self.spectrum;
        let mut copy = spectrum.clone();
        let weights: Vec<Vec<f64>> = ms.iter().map(|m| spectrum.allan_weights(*m)).collect();
        let (mut c, mut ramp) = (self.fit.maximum.coefficients, self.fit.maximum.ramp);
        if white_only {
            c[1..].fill(0.0);
            ramp = 0.0;
        }
        let mut ratios: Vec<f64> = (0..REPLICATES)
            .map(|_| {
                replicate(&mut copy, &c, ramp, rng);
                weights
                    .iter()
                    .map(|w| {
                        let (mut seen, mut expected) = (0.0, 0.0);
                        for (bin, weight) in copy.bins.iter().zip(w) {
                            seen += weight * bin.cc;
                            expected += weight
                                * (bin.count * Spectrum::variance(bin, &c) + ramp * ramp * bin.rr);
                        }
                        0.5 * (seen / expected).ln()
                    })
                    .sum::<f64>()
                    / ms.len() as f64
            })
            .collect();
        ratios.sort_by(f64::total_cmp);
        ratios
    }

    /// A figure with its interval.
    fn figure(&self, ms: &[usize], slope: f64, rng: &mut impl Rng) -> Option<Figure> {
        let value = self.mean_log(ms, slope, |m| self.observed(m))?.exp();
        let ratios = self.draw(ms, false, rng);
        let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
        let variance =
            ratios.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / (ratios.len() - 1) as f64;
        Some(Figure {
            value,
            std_error: value * variance.sqrt(),
            low: value * (-at(&ratios, 0.975)).exp(),
            high: value * (-at(&ratios, 0.025)).exp(),
        })
    }

    /// What part of the flat level white noise makes.
    fn white_part(&self, flat: &[usize], level: f64, rng: &mut impl Rng) -> Option<String> {
        let white = self.fit.maximum.coefficients[Term::White as usize];
        let mean = self.mean_log(flat, 0.0, |m| Some((white / m as f64).sqrt()))?;
        let bound = at(&self.draw(flat, true, rng), 0.975);
        let share = mean.exp() / level;
        if (level.ln() - mean) <= bound {
            Some(format!(
                "white noise alone explains the flat level ({:.0} % of it): it says nothing about the bias, and \
                 is no more than an upper limit",
                100.0 * share.min(1.0)
            ))
        } else if share > 0.5 {
            Some(format!(
                "white noise makes up {:.0} % of the flat level",
                100.0 * share
            ))
        } else {
            None
        }
    }

    /// What a reader has to know of the line.
    fn notes_of_line(&self, line: &[usize]) -> Option<String> {
        let slope = free_slope(line, self.tau0, &|m| self.observed(m))?;
        ((slope + 0.5).abs() > 0.05).then(|| {
            format!(
                "between {} and {} s the curve has slope {slope:.3}, not -0.5: the line is no pure angle random walk, \
                 and the number depends on the cluster times chosen",
                LINE_S.0, LINE_S.1
            )
        })
    }

    /// What a reader has to know of the flat level.
    fn notes_of_flat(&self, flat: &[usize], level: f64, rng: &mut impl Rng) -> Vec<String> {
        let mut notes = Vec::new();
        let seconds = self.phase.samples() as f64 * self.tau0;
        let longest = flat[flat.len() - 1] as f64 * self.tau0;
        if seconds < LENGTH_OVER_TAU * longest {
            notes.push(format!(
                "the record of {seconds:.0} s supports cluster times up to {:.0} s by the paper's own rule (10 times \
                 the longest), yet the flat level is taken from {} to {longest:.0} s",
                seconds / LENGTH_OVER_TAU,
                FLAT_S.0
            ));
        }
        notes.extend(self.white_part(flat, level, rng));
        if let Some(slope) = free_slope(flat, self.tau0, &|m| self.observed(m))
            && slope.abs() > 0.2
        {
            notes.push(format!(
                "between {} and {longest:.0} s the curve has slope {slope:+.2}: it is not flat there",
                FLAT_S.0
            ));
        }
        notes.push("in_run_bias_stability is the level itself; bias instability B of IEEE Std 952 is the level over 0.664".into());
        notes
    }
}

/// Quantile of sorted values.
fn at(sorted: &[f64], p: f64) -> f64 {
    sorted[((sorted.len() - 1) as f64 * p).round() as usize]
}

/// Compute both, by least squares in log-log with the slope held: N in U·√s, the level in U, of a record in unit U.
///
/// Intervals (95 %) are those of replicates of `fit`, which `rng` draws. `gapped` is the record where it has gaps. A figure is
/// left out where the record does not hold its range of cluster times.
#[must_use]
pub fn paper_figures(
    phase: &Phase,
    gapped: Option<&Gapped>,
    spectrum: &Spectrum,
    fit: &NoiseFit,
    rng: &mut impl Rng,
) -> PaperFigures {
    let tau0 = spectrum.tau0;
    let mut out = PaperFigures::default();
    let curve = Curve {
        phase,
        gapped,
        spectrum,
        fit,
        tau0,
    };
    let (line, flat) = (curve.factors(LINE_S), curve.factors(FLAT_S));
    match curve.figure(&line, -0.5, rng) {
        Some(arw) if line.last().zip(line.first()).is_some_and(|(b, a)| *b >= 4 * a) => {
            out.angle_random_walk = Some(arw);
            out.notes.extend(curve.notes_of_line(&line));
        }
        _ => out.notes.push(format!(
            "no line: at {:.6} s for each sample and {:.0} s of record the range {} to {} s holds too few cluster times",
            tau0,
            phase.samples() as f64 * tau0,
            LINE_S.0,
            LINE_S.1
        )),
    }
    match curve.figure(&flat, 0.0, rng) {
        Some(level) if line.last().is_some() && flat.len() > 1 => {
            out.notes.extend(curve.notes_of_flat(&flat, level.value, rng));
            out.in_run_bias_stability = Some(level);
        }
        _ => out.notes.push(format!(
            "no flat level: the longest stretch without a gap is {:.0} s, the level needs cluster times of {} to {} s",
            phase.longest_run() as f64 * tau0,
            FLAT_S.0,
            FLAT_S.1
        )),
    }
    out
}

fn free_slope(ms: &[usize], tau0: f64, of: &dyn Fn(usize) -> Option<f64>) -> Option<f64> {
    let points: Vec<(f64, f64)> = ms
        .iter()
        .filter_map(|m| of(*m).map(|s| ((*m as f64 * tau0).ln(), s.ln())))
        .collect();
    (points.len() >= 3).then(|| crate::paper_model::slope(&points))
}
