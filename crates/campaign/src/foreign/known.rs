//! What who knows a foreign effect knows of a channel, and its d' by that: the laws of codes and of steps from reading to
//! reading among it.

use crate::stand::{LSB, Stand};
use crate::strength::{Meter, of_variance};

/// Codes and steps of an axis are followed within so many sigma of its bias.
pub(super) const REACH: f64 = 6.0;

/// What is known of a channel with a foreign effect.
pub(super) enum Known {
    /// d' by a formula of its own; NaN where none is defined.
    Strength(f64),
    /// Energy of what is added, by bin.
    Energy(Vec<f64>),
    /// Variance by sample, over that at rest.
    Variance(Vec<f64>),
    /// What the density of the white noise is changed by, as a share of it, by bin.
    Shaped(Vec<f64>),
    /// Density of a process beside the noise, by bin, in each of some equal parts of the run.
    Beside(Vec<Vec<f64>>),
    /// Shares of the codes from the first on, and those that they are held for.
    Codes {
        #[cfg_attr(not(test), expect(dead_code, reason = "where the battery begins"))]
        first: i32,
        read: Vec<f64>,
        held: Vec<f64>,
    },
    /// Chances from each code (row) to the next reading's, shares of the codes from the first on, and those of readings that
    /// they are held for, each on its own.
    Steps {
        #[cfg_attr(not(test), expect(dead_code, reason = "where the battery begins"))]
        first: i32,
        steps: Vec<Vec<f64>>,
        shares: Vec<f64>,
        held: Vec<f64>,
    },
}

impl Known {
    /// d' of it, who does not know it refitting what the reader of a record would.
    pub(super) fn strength(&self, stand: &Stand, axis: usize) -> f64 {
        let of_density = |density: &[f64]| Meter::new(stand, axis).of_density(density);
        match self {
            Self::Strength(strength) => *strength,
            Self::Energy(energy) => Meter::new(stand, axis).of_signal(energy),
            Self::Variance(law) => of_variance(law),
            Self::Shaped(by) => {
                let white = stand.white(axis);
                of_density(&by.iter().map(|b| white * b).collect::<Vec<f64>>())
            }
            Self::Beside(places) => match places.as_slice() {
                [one] => of_density(one),
                all => {
                    let squares = all.iter().map(|d| of_density(d).powi(2));
                    (squares.sum::<f64>() / all.len() as f64).sqrt()
                }
            },
            Self::Codes { read, held, .. } => of_law(read, held, stand.samples()),
            Self::Steps {
                steps,
                shares,
                held,
                ..
            } => of_steps(steps, shares, &|_, to| held[to], stand.samples()),
        }
    }

    /// What the readings of a run tell, nats: d'^2 / 2.
    pub(super) fn nats(nats: f64) -> Self {
        Self::Strength((2.0 * nats).max(0.0).sqrt())
    }

    /// A signal, deg/s.
    pub(super) fn signal(stand: &Stand, axis: usize, signal: &[f64]) -> Self {
        Self::Energy(Meter::new(stand, axis).energy(signal))
    }

    /// White noise whose density is changed by `by`, as a share of it, at an angular frequency, rad per sample.
    pub(super) fn shaped(stand: &Stand, axis: usize, by: impl Fn(f64) -> f64) -> Self {
        let meter = Meter::new(stand, axis);
        Self::Shaped(meter.omega().iter().map(|w| by(*w)).collect())
    }

    /// A process of this density beside the noise, by angular frequency, rad per sample.
    pub(super) fn beside(stand: &Stand, axis: usize, density: impl Fn(f64) -> f64) -> Self {
        let meter = Meter::new(stand, axis);
        Self::Beside(vec![meter.omega().iter().map(|w| density(*w)).collect()])
    }

    /// Codes of these shares, held for those of a normal law of their own mean and variance.
    pub(super) fn codes(first: i32, read: Vec<f64>) -> Self {
        let held = refitted(first, &read);
        Self::Codes { first, read, held }
    }

    /// Codes between lower edges from the first on, counts, of an axis.
    pub(super) fn edges(stand: &Stand, axis: usize, (first, edges): &(i32, Vec<f64>)) -> Self {
        let (bias, sigma) = mean_and_sigma(stand, axis);
        Self::codes(*first, shares(edges, bias, sigma))
    }

    /// Codes some of which, by chance, are read as others.
    pub(super) fn map(stand: &Stand, axis: usize, chance: f64, map: &dyn Fn(i32) -> i32) -> Self {
        let (first, even) = law(stand, axis);
        let mut read: Vec<f64> = even.iter().map(|p| (1.0 - chance) * p).collect();
        for (i, p) in even.iter().enumerate() {
            let code = map(first + i as i32) - first;
            // What is read as something beyond the codes that are followed is next to nothing.
            if let Some(share) = usize::try_from(code).ok().and_then(|c| read.get_mut(c)) {
                *share += chance * p;
            }
        }
        Self::codes(first, read)
    }

    /// Readings that step by these chances, from codes that had these shares, held for a normal law of the mean and variance
    /// that they come to have.
    pub(super) fn steps(first: i32, steps: Vec<Vec<f64>>, even: &[f64]) -> Self {
        let shares = long_run(&steps, even);
        Self::steps_of(first, steps, shares)
    }

    /// The same where the shares are known.
    pub(super) fn steps_of(first: i32, steps: Vec<Vec<f64>>, shares: Vec<f64>) -> Self {
        Self::Steps {
            held: refitted(first, &shares),
            first,
            steps,
            shares,
        }
    }

    /// Readings that with `chance` are what `next` makes of the reading before and the code.
    pub(super) fn next(stand: &Stand, axis: usize, chance: f64, next: &Next) -> Self {
        let (first, even) = law(stand, axis);
        Self::steps(first, steps_of(stand, axis, chance, next), &even)
    }
}

/// What is read, by the reading before and the code, counts.
pub(super) type Next = dyn Fn(i32, i32) -> i32;

/// d' of `n` draws from a law (probabilities of equal cells) against the other law.
pub(super) fn of_law(truth: &[f64], other: &[f64], n: usize) -> f64 {
    let nats: f64 = truth
        .iter()
        .zip(other)
        .filter(|(p, _)| **p > 1e-300)
        .map(|(p, q)| p * (p / q.max(1e-300)).ln())
        .sum();
    (2.0 * n as f64 * nats).max(0.0).sqrt()
}

/// Shares of so many equal cells either way of 0, as far as `reach`, by a density.
pub(super) fn cells(count: i32, reach: f64, of: &dyn Fn(f64) -> f64) -> Vec<f64> {
    let at = |i: i32| reach * f64::from(i) / f64::from(count);
    let all: Vec<f64> = (-count..=count).map(|i| of(at(i))).collect();
    let sum: f64 = all.iter().sum();
    all.iter().map(|p| p / sum).collect()
}

/// Edges of so many codes from the first on, counts, the upper one of the last included, by a converter whose steps are even.
pub(super) fn even_edges(first: i32, codes: usize) -> Vec<f64> {
    let edge = |i: usize| f64::from(first) + i as f64 - 0.5;
    (0..=codes).map(edge).collect()
}

/// Shares of the codes between these edges, counts, for a normal law.
pub(super) fn shares(edges: &[f64], mean: f64, sigma: f64) -> Vec<f64> {
    let below = |e: &f64| 0.5 * statrs::function::erf::erfc((mean - e) / sigma / 2f64.sqrt());
    let below: Vec<f64> = edges.iter().map(below).collect();
    below.windows(2).map(|w| w[1] - w[0]).collect()
}

/// The codes of an axis, counts: the first, with the share of each in readings without fault.
pub(super) fn law(stand: &Stand, axis: usize) -> (i32, Vec<f64>) {
    let (mean, sigma) = mean_and_sigma(stand, axis);
    law_of(mean, sigma, mean, sigma)
}

/// The same of a normal law, over the reach of another.
pub(super) fn law_of(bias: f64, sigma: f64, middle: f64, reach: f64) -> (i32, Vec<f64>) {
    let first = (middle - REACH * reach).floor() as i32;
    let last = (middle + REACH * reach).ceil() as i32;
    let edges = even_edges(first, (last + 1 - first) as usize);
    (first, shares(&edges, bias, sigma))
}

/// Shares of the codes in the long run.
pub(super) fn long_run(steps: &[Vec<f64>], from: &[f64]) -> Vec<f64> {
    let mut now = from.to_vec();
    for _ in 0..12 {
        let mut next = vec![0.0; now.len()];
        for (p, row) in now.iter().zip(steps) {
            next.iter_mut().zip(row).for_each(|(n, s)| *n += p * s);
        }
        let sum: f64 = next.iter().sum();
        now = next.iter().map(|p| p / sum).collect();
    }
    now
}

/// d' of `n` readings that step by these chances, against another law of the steps.
pub(super) fn of_steps(
    truth: &[Vec<f64>],
    shares: &[f64],
    other: &dyn Fn(usize, usize) -> f64,
    n: usize,
) -> f64 {
    let mut nats = 0.0;
    for (from, (share, row)) in shares.iter().zip(truth).enumerate() {
        for (to, p) in row.iter().enumerate().filter(|(_, p)| **p > 1e-300) {
            nats += share * p * (p / other(from, to).max(1e-300)).ln();
        }
    }
    (2.0 * n as f64 * nats).max(0.0).sqrt()
}

/// Chances from each code (row) to the next reading's, when with `chance` it is what `next` makes of the reading before
/// and the code.
pub(super) fn steps_of(stand: &Stand, axis: usize, chance: f64, next: &Next) -> Vec<Vec<f64>> {
    let (first, even) = law(stand, axis);
    let last = even.len() as i32 - 1;
    (0..=last)
        .map(|from| {
            let mut row: Vec<f64> = even.iter().map(|p| (1.0 - chance) * p).collect();
            for (code, p) in (first..).zip(&even) {
                let to = next(first + from, code) - first;
                row[to.clamp(0, last) as usize] += chance * p;
            }
            row
        })
        .collect()
}

/// Mean and standard deviation of the readings of an axis before rounding, counts.
pub(super) fn mean_and_sigma(stand: &Stand, axis: usize) -> (f64, f64) {
    let sigma = stand.white_before_rounding(axis).sqrt();
    (stand.bias[axis] / LSB, sigma / LSB)
}

/// Shares that a normal law of their own mean and variance gives the same codes.
pub(super) fn refitted(first: i32, read: &[f64]) -> Vec<f64> {
    let codes = || {
        read.iter()
            .enumerate()
            .map(|(i, p)| (f64::from(first) + i as f64, p))
    };
    let mean: f64 = codes().map(|(c, p)| c * p).sum();
    let square: f64 = codes().map(|(c, p)| (c - mean).powi(2) * p).sum();
    shares(
        &even_edges(first, read.len()),
        mean,
        (square - 1.0 / 12.0).max(1e-3).sqrt(),
    )
}
