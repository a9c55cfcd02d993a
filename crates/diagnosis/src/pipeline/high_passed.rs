//! Readings of which a high-pass filter took the slow part, put back before the search.
//!
//! A filter of one pole is undone exactly but for a constant, and what its way back makes of the readings' density is known: the
//! record as it is and as it was before the filter are two accounts of the same numbers, and their likelihoods compare. Noise with
//! a random walk behind such a filter has less at the slowest frequencies than at those above, which nothing that is added to white
//! noise makes. Where that is seen the whole search is made of both, beyond the start of the record: what the filter makes of the
//! bias looks like many things.

use std::borrow::Cow;
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use model::Parameter;
use model::effects::high_pass::{self, Filter};
use model::record::{Base, Channel, Quantity, Record, rows};
use numerics::minimise::golden;
use numerics::transform::{Dct, quick_length};
use rand_core::SeedableRng;
use rand_distr::{Distribution, Uniform};
use rand_xoshiro::Xoshiro256PlusPlus;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::channel;
use crate::fit::likelihood::{Bins, Noise, Panel};
use crate::fit::threshold;
use crate::ingest::grid::{interpolated, lay_out, rate_of};
use crate::result::Finding;

/// Part of the record at its start that does not tell whether there is a filter: of the longest time constant that is sought,
/// eight are over by then.
const START: f64 = 0.15;
/// Shortest time constant, samples: a corner at a nineteenth of the sample rate.
const SHORTEST: f64 = 3.0;
/// Fewest coefficients below the corner, of which few enough are too little by chance.
const LEAST_BELOW: f64 = 14.0;
/// Places, in corners, that are compared: what lies below is to hold less than what lies between.
const BELOW: [f64; 2] = [0.5, 1.0];
const ABOVE: [f64; 2] = [3.0, 8.0];
/// Chance of that in white noise, at one time constant and one place: the search of both accounts is the judge.
const LEVEL: f64 = 1e-3;
/// Part of the readings that may be missing: the way back over them is a guess.
const MISSING: f64 = 0.01;
/// Standard errors within which two time constants are one.
const ONE: f64 = 4.0;
/// Steps of the search for a time constant between half and twice a first guess, to a fiftieth; then steps of Newton, from places
/// at that distance.
const STEPS: usize = 8;
const NEWTON: usize = 2;
const BEND: f64 = 0.02;

/// Part of a step by which readings of one code are told apart, and the seed of that.
const TIES: f64 = 1e-3;
const APART: u64 = 0x7469_6573;

/// A time constant, in samples.
#[derive(Clone, Copy)]
struct Told {
    log: f64,
    error: f64,
}

impl Told {
    fn filter(self) -> Filter {
        Filter::of(self.log.exp())
    }

    /// Whether both are one.
    fn agrees(self, other: Self) -> bool {
        (self.log - other.log).abs() <= ONE * self.error.hypot(other.error)
    }
}

/// A filter, and the places of the channels that went through it.
pub(super) struct Found {
    channels: Vec<usize>,
    told: Told,
}

/// Such filters. A record with gaps, and one of a base that moves, is not asked.
pub(super) fn found(record: &Record, masked: &dyn Fn(&str) -> Vec<usize>, seed: u64) -> Vec<Found> {
    let gaps = record.seq.as_ref().is_some_and(|s| {
        let mut steps = s.windows(2);
        steps.any(|w| w[1] != w[0] + 1)
    });
    if gaps || matches!(record.header.base, Some(Base::Moving | Base::Turntable)) {
        return vec![];
    }
    let seeker = Seeker {
        record,
        masked,
        seed,
    };
    let gyros =
        (0..record.channels.len()).filter(|i| record.channels[*i].quantity == Quantity::Gyro);
    let own: Vec<(usize, Option<Told>)> = gyros.map(|i| (i, seeker.alone(i))).collect();
    let first = own.iter().find_map(|(_, t)| *t);
    let told: Vec<(usize, Told)> = (own.into_iter())
        .filter_map(|(i, told)| Some((i, told.or_else(|| seeker.beside(i, first?))?)))
        .collect();
    seeker.one_or_each(&told)
}

/// The record as it was before filters.
pub(super) fn undone<'a>(
    record: &'a Record,
    filters: &[Found],
    masked: &dyn Fn(&str) -> Vec<usize>,
) -> Cow<'a, Record> {
    let mut whole = Cow::Borrowed(record);
    for found in filters {
        for i in &found.channels {
            let channel = &mut whole.to_mut().channels[*i];
            before(channel, found.told.filter(), &masked(&channel.name));
        }
    }
    whole
}

/// The record without what the filters made of the bias at its start, which audits take for readings far from others.
pub(super) fn settled(record: &Record, filters: &[Found]) -> Record {
    let mut settled = record.clone();
    for found in filters {
        for i in &found.channels {
            settle(&mut settled.channels[*i], found.told);
        }
    }
    settled
}

fn settle(channel: &mut Channel, told: Told) {
    let Some(mut x) = whole(channel, &[]) else {
        return;
    };
    told.filter().undo(&mut x);
    let first = &x[..x.len().min(told.log.exp().ceil() as usize)];
    let level = first.iter().sum::<f64>() / first.len() as f64;
    let mut start = vec![level; x.len()];
    told.filter().pass(&mut start, 0.0);
    let step = channel.lsb.unwrap_or(0.0);
    for (i, start) in start.into_iter().enumerate() {
        if step <= 0.0 {
            channel.values[i] -= start;
            continue;
        }
        // The readings stay in their codes.
        let codes = (start / step).round();
        channel.values[i] -= step * codes;
        if let Some(counts) = &mut channel.counts {
            counts[i] -= codes as i32;
        }
    }
}

/// What was found, in words.
pub(super) fn findings(record: &Record, filters: &[Found]) -> Vec<Finding> {
    let Some(rate_hz) = rate_of(record) else {
        return vec![];
    };
    let each = filters.iter().map(|f| {
        let names = f.channels.iter().map(|i| record.channels[*i].name.clone());
        finding(names.collect(), f.told, rate_hz)
    });
    each.collect()
}

fn finding(channels: Vec<String>, told: Told, rate_hz: f64) -> Finding {
    let corner = rate_hz / TAU / told.log.exp();
    Finding {
        cause: high_pass::ID.into(),
        what: format!(
            "the slow part of {} is missing, as behind a filter of one pole that passes half the power at {corner:.3} Hz; what follows is of the readings before it",
            channels.join(", ")
        ),
        channels,
        parameters: [(
            "corner_frequency".to_owned(),
            Parameter::estimated(corner, corner * told.error, "Hz"),
        )]
        .into(),
        ..Finding::default()
    }
}

/// The readings of a channel without gaps; `None` where too many are missing.
fn whole(channel: &Channel, masked: &[usize]) -> Option<Vec<f64>> {
    let mut y = channel.values.clone();
    masked.iter().for_each(|i| y[*i] = f64::NAN);
    let missing = y.iter().filter(|v| !v.is_finite()).count();
    (missing as f64 <= MISSING * y.len() as f64).then(|| interpolated(&y))
}

/// Puts a channel before a filter. A reading that is not believed says nothing of those behind it.
fn before(channel: &mut Channel, filter: Filter, masked: &[usize]) {
    let Some(believed) = whole(channel, masked) else {
        return;
    };
    let mut x = believed.clone();
    filter.undo(&mut x);
    // Where zero is read again what was before the filter stays the same to the last digit, which is no reading that repeats.
    let lsb = channel.lsb.unwrap_or(0.0);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(APART);
    if let Ok(little) = Uniform::new_inclusive(0.0, TIES * lsb) {
        x.iter_mut().for_each(|x| *x += little.sample(&mut rng));
    }
    let read = channel.values.iter().zip(&believed);
    for (x, (read, believed)) in x.iter_mut().zip(read) {
        *x += read - believed;
    }
    channel.values = x;
    // Behind the way back there are no codes.
    (channel.counts, channel.lsb) = (None, None);
}

/// A record that is asked.
struct Seeker<'a> {
    record: &'a Record,
    masked: &'a dyn Fn(&str) -> Vec<usize>,
    seed: u64,
}

impl Seeker<'_> {
    /// The time constant of the filter of a channel, where its own spectrum shows one.
    fn alone(&self, channel: usize) -> Option<Told> {
        let own = &self.record.channels[channel];
        let y = whole(own, &(self.masked)(&own.name))?;
        let first = (START * y.len() as f64) as usize;
        let seen = Spectrum::of(&y[first..]).lacks()?;
        let late = estimate(&y[first..], seen.ln());
        let least = threshold::undone_filter();
        if !self.is_before(channel, late, first, [least; 2]) {
            return None;
        }
        // The whole tells more, where the filter was at rest when the record began.
        let all = estimate(&y, late.log);
        Some(if all.agrees(late) { all } else { late })
    }

    /// The same of a channel whose own spectrum shows none, where another one has such a filter: the start tells too. What else is
    /// on the channel may bend its own estimate.
    fn beside(&self, channel: usize, other: Told) -> Option<Told> {
        let own = &self.record.channels[channel];
        let y = whole(own, &(self.masked)(&own.name))?;
        let all = estimate(&y, other.log);
        let told = if all.agrees(other) { all } else { other };
        self.is_before(channel, told, 0, [threshold::covariance(1), 0.0])
            .then_some(told)
    }

    /// One filter of all channels that do about as well with it as with their own, and those of the others.
    fn one_or_each(&self, all: &[(usize, Told)]) -> Vec<Found> {
        let Some((_, surest)) = all.iter().min_by(|a, b| a.1.error.total_cmp(&b.1.error)) else {
            return vec![];
        };
        let read = |i: usize| {
            whole(
                &self.record.channels[i],
                &(self.masked)(&self.record.channels[i].name),
            )
        };
        let each: Vec<_> = all
            .iter()
            .filter_map(|(i, t)| Some((*i, *t, Unfiltered::new(read(*i)?))))
            .collect();
        let one = near(
            &|log| each.iter().map(|(.., y)| y.minus_log_likelihood(log)).sum(),
            surest.log,
        );
        let lost = |own: &Told, y: &Unfiltered| {
            2.0 * (y.minus_log_likelihood(one.log) - y.minus_log_likelihood(own.log))
        };
        let (shared, others): (Vec<_>, Vec<_>) = each
            .iter()
            .partition(|(_, own, y)| lost(own, y) < ONE * ONE);
        let shared = Found {
            channels: shared.iter().map(|(i, ..)| *i).collect(),
            told: one,
        };
        let others = others.iter().map(|(i, own, _)| Found {
            channels: vec![*i],
            told: *own,
        });
        let all = std::iter::once(shared).chain(others);
        all.filter(|f| !f.channels.is_empty()).collect()
    }

    /// Whether the readings from row `first` on are explained better before a filter than behind it, by `least[0]`, and the filter
    /// took something: put back before it, white noise that never went through has a random walk of its own, and one of less has
    /// to be likelier than that, by `least[1]`. Signals alone do not tell: of what the bias follows a filter makes its pace.
    fn is_before(&self, channel: usize, told: Told, first: usize, least: [f64; 2]) -> bool {
        let behind = rows::part_of(self.record, first..self.record.len());
        let masked = |name: &str| -> Vec<usize> {
            let all = (self.masked)(name).into_iter();
            all.filter_map(|i| i.checked_sub(first)).collect()
        };
        let own = &self.record.channels[channel].name;
        let mut undone = behind.clone();
        before(&mut undone.channels[channel], told.filter(), &masked(own));
        let best = |record: &Record| {
            let grid = lay_out(record, &masked, self.seed).ok()?;
            let target = grid.targets.iter().find(|t| t.name == *own);
            let still = target.filter(|t| !t.moving)?;
            Some(channel::best(&grid, still, -2.0 * told.log))
        };
        let Some((score, lacks)) = best(&undone) else {
            return false;
        };
        let gained = |(as_read, _)| score - as_read + 2.0 * shrunk(told.log, behind.len());
        lacks >= least[1] && best(&behind).map(gained).is_some_and(|g| g >= least[0])
    }
}

/// By how much the way back makes the logarithm of the density of `n` readings larger.
fn shrunk(log: f64, n: usize) -> f64 {
    let gain = 0.5 * (1.0 + (-(-log).exp()).exp());
    -(n.saturating_sub(1) as f64) * gain.ln()
}

/// Readings, and what white noise and a random walk before a filter say of them.
struct Unfiltered {
    y: Vec<f64>,
    dct: Dct,
    bins: Arc<Bins>,
}

impl Unfiltered {
    fn new(y: Vec<f64>) -> Self {
        let n = y.len();
        let (dct, bins) = (Dct::new(n), Arc::new(Bins::new(n)));
        Self { y, dct, bins }
    }

    /// Before a filter of that logarithm of a time constant.
    fn minus_log_likelihood(&self, log: f64) -> f64 {
        let mut x = self.y.clone();
        Filter::of(log.exp()).undo(&mut x);
        let panel = Panel::new(&self.dct, &self.bins, &x);
        let (_, solution) = panel.fit(&Noise::new(-12.0), &[]);
        -solution.log_likelihood - shrunk(log, x.len())
    }
}

/// The time constant of the most likely filter, near a first guess.
fn estimate(y: &[f64], guess: f64) -> Told {
    let y = Unfiltered::new(y.to_vec());
    near(&|log| y.minus_log_likelihood(log), guess)
}

/// The lowest point near a first guess, of what is a parabola there.
fn near(minus_l: &dyn Fn(f64) -> f64, guess: f64) -> Told {
    let half = std::f64::consts::LN_2;
    let mut log = golden(minus_l, guess - half, guess + half, STEPS);
    let mut error = f64::INFINITY;
    for _ in 0..NEWTON {
        let (low, here, high) = (minus_l(log - BEND), minus_l(log), minus_l(log + BEND));
        let bend = (high + low - 2.0 * here).max(f64::MIN_POSITIVE);
        error = BEND * bend.powf(-0.5);
        let step = BEND * (0.5 * (low - high) / bend);
        log += step.clamp(-BEND, BEND);
    }
    Told { log, error }
}

/// Energy of the coefficients of some readings.
struct Spectrum(Vec<f64>);

impl Spectrum {
    fn of(y: &[f64]) -> Self {
        // A length that transforms fast.
        let n = (1..=y.len()).rev().find(|n| quick_length(*n) == *n);
        let y = &y[..n.unwrap_or(y.len())];
        let c = Dct::new(y.len()).forward(y);
        Self(c.iter().map(|c| c * c).collect())
    }

    /// The time constant, samples, below whose corner most is missing against what lies above; none where nothing is.
    fn lacks(&self) -> Option<f64> {
        let n = self.0.len() as f64;
        let all = std::iter::successors(Some(SHORTEST), |tau| Some(tau * std::f64::consts::SQRT_2));
        let corner = |tau: f64| n / (PI * tau);
        let sought = all.take_while(|tau| corner(*tau) >= LEAST_BELOW);
        let each = sought.map(|tau| (tau, self.chance(corner(tau))));
        let (tau, chance) = each.min_by(|a, b| a.1.total_cmp(&b.1))?;
        (chance < LEVEL).then_some(tau)
    }

    /// Chance that white noise has as little below a corner as there is, against what is above.
    fn chance(&self, corner: f64) -> f64 {
        let mean = |from: f64, to: f64| {
            let some = &self.0[(from as usize).max(1)..(to as usize).min(self.0.len())];
            (
                some.iter().sum::<f64>() / some.len() as f64,
                some.len() as f64,
            )
        };
        let (high, many) = mean(ABOVE[0] * corner, ABOVE[1] * corner);
        let below = BELOW.map(|part| {
            let (low, few) = mean(0.0, part * corner);
            let law = FisherSnedecor::new(few, many);
            law.map_or(1.0, |law| law.cdf(low / high))
        });
        below[0].min(below[1])
    }
}

#[cfg(test)]
mod tests {
    use rand_distr::StandardNormal;

    use super::*;

    fn noise(n: usize, seed: u64) -> Vec<f64> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut level = 0.7;
        let mut next = || -> f64 { StandardNormal.sample(&mut rng) };
        (0..n)
            .map(|_| {
                level += 1e-4 * next();
                level + 0.05 * next()
            })
            .collect()
    }

    #[test]
    fn white_noise_lacks_nothing_and_what_a_filter_took_is_missed() {
        for seed in 0..40 {
            let y = noise(12_000, seed);
            assert_eq!(Spectrum::of(&y).lacks(), None, "{seed}");
            let tau = 4.0 * 1.06f64.powi(seed as i32);
            let mut through = y;
            Filter::of(tau).pass(&mut through, 0.0);
            let seen = Spectrum::of(&through[3000..]).lacks().unwrap();
            assert!((seen / tau).ln().abs() < 1.2, "{seed}: {seen} for {tau}");
        }
    }

    #[test]
    fn the_time_constant_is_told_within_its_error() {
        let off: Vec<f64> = (0..40)
            .map(|seed| {
                let tau = 5.0 * 1.05f64.powi(seed);
                let mut y = noise(12_000, 100 + u64::from(seed.unsigned_abs()));
                Filter::of(tau).pass(&mut y, 0.0);
                let told = estimate(&y[3000..], tau.ln() + 0.3);
                (told.log - tau.ln()) / told.error
            })
            .collect();
        let square = off.iter().map(|v| v * v).sum::<f64>() / off.len() as f64;
        // Chi-square of 40 degrees over 40: 0.52 to 1.69 but once in 200 times.
        assert!((0.5..1.7).contains(&square), "{square} {off:?}");
    }
}
