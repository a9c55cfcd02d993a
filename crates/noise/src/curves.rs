//! Curves of a deviation with their intervals, with and without gaps.

use crate::allan::{Deviation, Gapped, GappedEstimate, Phase, TauGrid};
use crate::edf::{NoiseType, chi_square_interval, edf};
use crate::fit::NoiseFit;
use crate::identify::identify;
use crate::units::Scale;
use serde::{Deserialize, Serialize};

pub(crate) fn gaps_note(gapped: &Gapped, phase: &Phase, tau0: f64) -> String {
    let longest = gapped.lengths().into_iter().max().unwrap_or(0);
    format!(
        "{} gaps, {:.2} % of the sample times empty: deviations are of means over the samples that are there (the overlapping \
         Allan deviation up to {:.6} s; without bridging, the longest run would end it at {:.6} s), and their intervals count the \
         differences that are left. Nothing is filled in",
        phase.run_lengths().len() - 1,
        100.0 * (1.0 - gapped.filled()),
        (longest / 2) as f64 * tau0,
        (phase.longest_run() / 2) as f64 * tau0
    )
}

/// A deviation at one cluster time, with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DeviationPoint {
    /// Cluster time, s.
    pub tau_s: f64,
    /// The deviation, in the unit of the channel (`tdev`: times s).
    pub deviation: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// Equivalent degrees of freedom.
    pub edf: f64,
    /// Differences in it.
    pub n: usize,
    /// Noise that was identified there and that the degrees of freedom are of: exponent α of the rate's spectral density
    /// f^α. 2: quantization (white phase), 1: flicker phase, 0: white, −1: flicker, −2: random walk.
    #[serde(default)]
    pub noise_alpha: i32,
}

/// Estimates at some averaging factors. The larger white noise of partly filled clusters is divided out by the share that
/// the fit gives it.
fn estimates(
    gapped: &Gapped,
    kind: Deviation,
    fitted: Option<&NoiseFit>,
    tau0: f64,
    factors: &[usize],
) -> Vec<GappedEstimate> {
    let share = |of: fn(&NoiseFit, usize) -> f64, m: usize| fitted.map_or(1.0, |f| of(f, m));
    if kind == Deviation::Theoh {
        return gapped.theoh_curve(tau0, factors, |theo1, m| {
            let of = if theo1 {
                NoiseFit::white_share_theo1
            } else {
                NoiseFit::white_share
            };
            share(of, m)
        });
    }
    let at = |m: usize| match kind {
        Deviation::Adev => gapped.allan(tau0, m, share(NoiseFit::white_share, m)),
        Deviation::Hdev => gapped.hadamard(tau0, m, share(NoiseFit::white_share_hadamard, m)),
        Deviation::Ohdev => {
            gapped.overlapping_hadamard(tau0, m, share(NoiseFit::white_share_hadamard, m))
        }
        Deviation::Mdev | Deviation::Tdev => {
            gapped.modified_allan(tau0, m, share(NoiseFit::white_share_modified, m))
        }
        Deviation::Totdev => gapped.total(tau0, m, share(NoiseFit::white_share, m)),
        Deviation::Mtotdev => {
            gapped.modified_total(tau0, m, share(NoiseFit::white_share_modified, m))
        }
        Deviation::Theo1 => gapped.theo1(tau0, m, share(NoiseFit::white_share_theo1, m)),
        Deviation::Oadev | Deviation::Theoh => {
            gapped.overlapping_allan(tau0, m, share(NoiseFit::white_share, m))
        }
    };
    factors.iter().copied().filter_map(at).collect()
}

/// The curve of a record with gaps. The freedom is that of the grid, less the share of differences that
/// the gaps took.
pub(crate) fn gapped_curve(
    gapped: &Gapped,
    kind: Deviation,
    phase: &Phase,
    fitted: Option<&NoiseFit>,
    tau0: f64,
    grid: TauGrid,
    scale: &Scale,
) -> Vec<DeviationPoint> {
    let lengths = gapped.lengths();
    let longest = kind.longest(lengths.iter().copied().max().unwrap_or(0));
    let factors = grid.factors(longest);
    let mut noise = NoiseType::WhiteRate;
    estimates(gapped, kind, fitted, tau0, &factors)
        .into_iter()
        .map(|mut found| {
            let m = found.estimate.m;
            if kind == Deviation::Tdev {
                found.estimate.deviation *= found.estimate.tau_s / 3f64.sqrt();
            }
            // Where no run is long enough to tell, the fit does: by the slope of its curve.
            noise = identify(phase, m)
                .or_else(|| {
                    let f = fitted?;
                    let slope = (f.deviation(2 * m) / f.deviation(m)).log2();
                    Some(NoiseType::nearest(-1.0 - 2.0 * slope))
                })
                .unwrap_or(noise);
            let share = found.estimate.n as f64 / found.possible as f64;
            let edf = (edf(kind, noise, m, &lengths) * share).max(1.0);
            let (low, high) = chi_square_interval(found.estimate.deviation, edf, 0.95);
            DeviationPoint {
                tau_s: found.estimate.tau_s,
                deviation: found.estimate.deviation * scale.factor,
                low: low * scale.factor,
                high: high * scale.factor,
                edf,
                n: found.estimate.n,
                noise_alpha: noise.alpha(),
            }
        })
        .collect()
}

/// A curve with its intervals. Where too few clusters are left to identify the noise, the last type identified holds.
pub(crate) fn curve(
    phase: &Phase,
    kind: Deviation,
    tau0: f64,
    grid: TauGrid,
    scale: &Scale,
) -> Vec<DeviationPoint> {
    let runs = phase.run_lengths();
    let mut noise = NoiseType::WhiteRate;
    let factors = grid.factors(kind.longest(phase.longest_run()));
    phase
        .curve(kind, tau0, &factors)
        .into_iter()
        .map(|e| {
            if let Some(found) = identify(phase, e.m) {
                noise = found;
            }
            let edf = edf(kind, noise, e.m, &runs);
            let (low, high) = chi_square_interval(e.deviation, edf, 0.95);
            DeviationPoint {
                tau_s: e.tau_s,
                deviation: e.deviation * scale.factor,
                low: low * scale.factor,
                high: high * scale.factor,
                edf,
                n: e.n,
                noise_alpha: noise.alpha(),
            }
        })
        .collect()
}
