//! What who knows a foreign effect knows of a channel, and its d' by that: the laws of codes and of steps from reading to
//! reading among it.

use crate::series::each;
use crate::stand::{LSB, Stand};
use crate::strength::{Meter, of_variance};

/// Codes and steps of an axis are followed within so many sigma of its bias.
pub(super) const REACH: f64 = 6.0;

/// Shares of the codes of an axis, from a first code on.
#[derive(Clone)]
pub(super) struct Law {
    pub first: i32,
    pub shares: Vec<f64>,
}

impl Law {
    /// The codes with the share of each.
    pub(super) fn codes(&self) -> impl Iterator<Item = (i32, f64)> {
        (self.first..).zip(self.shares.iter().copied())
    }

    /// The place of a code among those that are followed.
    fn place(&self, code: i32) -> Option<usize> {
        let place = usize::try_from(code - self.first).ok()?;
        (place < self.shares.len()).then_some(place)
    }

    /// The share of a code; 0 of one that is not followed.
    pub(super) fn of(&self, code: i32) -> f64 {
        self.place(code).map_or(0.0, |place| self.shares[place])
    }

    /// The law where codes, by chance, are read as others. What is read as a code that is not followed is next to nothing.
    pub(super) fn mapped(&self, chance: f64, map: impl Fn(i32) -> i32) -> Self {
        let mut read = each(&self.shares, |p| (1.0 - chance) * p);
        for (code, p) in self.codes() {
            if let Some(place) = self.place(map(code)) {
                read[place] += chance * p;
            }
        }
        self.with(read)
    }

    /// The same codes of other shares.
    pub(super) fn with(&self, shares: Vec<f64>) -> Self {
        let first = self.first;
        Self { first, shares }
    }

    /// The shares that a normal law of their own mean and variance gives the same codes.
    pub(super) fn refitted(&self) -> Vec<f64> {
        let mean: f64 = self.codes().map(|(c, p)| f64::from(c) * p).sum();
        let off = |(c, p): (i32, f64)| (f64::from(c) - mean).powi(2) * p;
        let square: f64 = self.codes().map(off).sum();
        let edges = even_edges(self.first, self.shares.len());
        shares(&edges, mean, (square - 1.0 / 12.0).max(1e-3).sqrt())
    }
}

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
    /// The law of the codes, and the shares that they are held for.
    Codes(Law, Vec<f64>),
    /// The law of the codes, the chances from each code (row) to the next reading's, and the shares of readings that they are
    /// held for, each on its own.
    Steps(Law, Vec<Vec<f64>>, Vec<f64>),
}

impl Known {
    /// d' of it, who does not know it refitting what the reader of a record would.
    pub(super) fn strength(&self, stand: &Stand, axis: usize) -> f64 {
        let of_density = |density: &[f64]| Meter::new(stand, axis).of_density(density);
        let n = stand.samples();
        match self {
            Self::Strength(strength) => *strength,
            Self::Energy(energy) => Meter::new(stand, axis).of_signal(energy),
            Self::Variance(law) => of_variance(law),
            Self::Shaped(by) => of_density(&each(by, |b| stand.white(axis) * b)),
            Self::Beside(places) => match places.as_slice() {
                [one] => of_density(one),
                all => {
                    let squares = all.iter().map(|d| of_density(d).powi(2));
                    (squares.sum::<f64>() / all.len() as f64).sqrt()
                }
            },
            Self::Codes(law, held) => of_law(&law.shares, held, n),
            Self::Steps(law, steps, held) => of_steps(steps, &law.shares, &|_, to| held[to], n),
        }
    }

    /// What the readings of a run tell, nats: d'^2 / 2.
    pub(super) fn nats(nats: f64) -> Self {
        Self::Strength((2.0 * nats).max(0.0).sqrt())
    }

    /// What each reading tells, nats, twice over: d'^2 = samples x that.
    pub(super) fn by_reading(stand: &Stand, twice_nats: f64) -> Self {
        Self::nats(0.5 * stand.samples() as f64 * twice_nats)
    }

    /// A signal, deg/s.
    pub(super) fn signal(stand: &Stand, axis: usize, signal: &[f64]) -> Self {
        Self::Energy(Meter::new(stand, axis).energy(signal))
    }

    /// White noise whose density is changed by `by`, as a share of it, at an angular frequency, rad per sample.
    pub(super) fn shaped(stand: &Stand, axis: usize, by: impl Fn(f64) -> f64) -> Self {
        Self::Shaped(each(Meter::new(stand, axis).omega(), by))
    }

    /// A process of this density beside the noise, by angular frequency, rad per sample.
    pub(super) fn beside(stand: &Stand, axis: usize, density: impl Fn(f64) -> f64) -> Self {
        Self::Beside(vec![each(Meter::new(stand, axis).omega(), density)])
    }

    /// Codes of a law, held for those of a normal law of their own mean and variance.
    pub(super) fn codes(law: Law) -> Self {
        let held = law.refitted();
        Self::Codes(law, held)
    }

    /// Codes between lower edges from the first on, counts, of an axis.
    pub(super) fn edges(stand: &Stand, axis: usize, (first, edges): &(i32, Vec<f64>)) -> Self {
        let (bias, sigma) = mean_and_sigma(stand, axis);
        Self::codes(Law {
            first: *first,
            shares: shares(edges, bias, sigma),
        })
    }

    /// Codes some of which, by chance, are read as others.
    pub(super) fn map(stand: &Stand, axis: usize, chance: f64, map: impl Fn(i32) -> i32) -> Self {
        Self::codes(law(stand, axis).mapped(chance, map))
    }

    /// Readings that step by these chances, from codes that had these shares, held for a normal law of the mean and variance
    /// that they come to have.
    pub(super) fn steps(even: &Law, steps: Vec<Vec<f64>>) -> Self {
        let shares = long_run(&steps, &even.shares);
        Self::steps_of(even.with(shares), steps)
    }

    /// The same where the law is known.
    pub(super) fn steps_of(law: Law, steps: Vec<Vec<f64>>) -> Self {
        let held = law.refitted();
        Self::Steps(law, steps, held)
    }

    /// Readings that with `chance` are what `next` makes of the reading before and the code.
    pub(super) fn next(stand: &Stand, axis: usize, chance: f64, next: &Next) -> Self {
        Self::steps(&law(stand, axis), steps_of(stand, axis, chance, next))
    }
}

/// What is read, by the reading before and the code, counts.
pub(super) type Next = dyn Fn(i32, i32) -> i32;

/// d' of `n` draws from a law (probabilities of equal cells) against the other law.
pub(super) fn of_law(truth: &[f64], other: &[f64], n: usize) -> f64 {
    let both = truth.iter().zip(other).filter(|(p, _)| **p > 1e-300);
    let nats: f64 = both.map(|(p, q)| p * (p / q.max(1e-300)).ln()).sum();
    (2.0 * n as f64 * nats).max(0.0).sqrt()
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

/// Share of the normal law that lies below.
pub(super) fn below(z: f64) -> f64 {
    0.5 * statrs::function::erf::erfc(-z / 2f64.sqrt())
}

/// Density of the normal law.
pub(super) fn normal(z: f64) -> f64 {
    (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt()
}

/// Shares of so many equal cells either way of 0, as far as `reach`, by a density.
pub(super) fn cells(count: i32, reach: f64, of: &dyn Fn(f64) -> f64) -> Vec<f64> {
    let at = |i: i32| reach * f64::from(i) / f64::from(count);
    let all: Vec<f64> = (-count..=count).map(|i| of(at(i))).collect();
    let sum: f64 = all.iter().sum();
    each(&all, |p| p / sum)
}

/// Edges of so many codes from the first on, counts, the upper one of the last included, by a converter whose steps are even.
pub(super) fn even_edges(first: i32, codes: usize) -> Vec<f64> {
    let edge = |i: usize| f64::from(first) + i as f64 - 0.5;
    (0..=codes).map(edge).collect()
}

/// Shares of the codes between these edges, counts, for a normal law.
pub(super) fn shares(edges: &[f64], mean: f64, sigma: f64) -> Vec<f64> {
    let below = each(edges, |e| below((e - mean) / sigma));
    below.windows(2).map(|w| w[1] - w[0]).collect()
}

/// Mean and standard deviation of the readings of an axis before rounding, counts.
pub(super) fn mean_and_sigma(stand: &Stand, axis: usize) -> (f64, f64) {
    let sigma = stand.white_before_rounding(axis).sqrt();
    (stand.bias[axis] / LSB, sigma / LSB)
}

/// The same of the readings as they are, rounding included.
pub(super) fn mean_and_sigma_read(stand: &Stand, axis: usize) -> (f64, f64) {
    (stand.bias[axis] / LSB, stand.white(axis).sqrt() / LSB)
}

/// The codes of an axis with the share of each in readings without fault.
pub(super) fn law(stand: &Stand, axis: usize) -> Law {
    let (mean, sigma) = mean_and_sigma(stand, axis);
    law_of(mean, sigma, mean, sigma)
}

/// The same of a normal law, over the reach of another.
pub(super) fn law_of(bias: f64, sigma: f64, middle: f64, reach: f64) -> Law {
    let first = (middle - REACH * reach).floor() as i32;
    let last = (middle + REACH * reach).ceil() as i32;
    let edges = even_edges(first, (last + 1 - first) as usize);
    let shares = shares(&edges, bias, sigma);
    Law { first, shares }
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
        now = each(&next, |p| p / sum);
    }
    now
}

/// Chances from each code (row) to the next reading's, when with `chance` it is what `next` makes of the reading before
/// and the code.
pub(super) fn steps_of(stand: &Stand, axis: usize, chance: f64, next: &Next) -> Vec<Vec<f64>> {
    let even = law(stand, axis);
    let (first, last) = (even.first, even.first + even.shares.len() as i32 - 1);
    let row = |from| even.mapped(chance, |code| next(from, code).clamp(first, last));
    (first..=last).map(|from| row(from).shares).collect()
}

/// The last place between two at which something holds that ceases to, to within so much.
pub(super) fn last_of(
    (mut low, mut high): (f64, f64),
    within: f64,
    holds: impl Fn(f64) -> bool,
) -> f64 {
    while high - low > within {
        let middle = 0.5 * (low + high);
        if holds(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}
