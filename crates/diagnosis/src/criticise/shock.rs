//! A blow under the final model: its shape, how large it is on each channel, and whether it is there.
//!
//! The readings about it, less what the terms of the model make of them, are held against half sines and rings in the
//! coefficients of a short piece of the record, which the noise of the model weighs as in the search. Begin, length and pitch
//! are tried on grids that narrow; sizes are averaged over all that the readings leave open, so that their errors hold where a
//! blow is a reading or two long.

use std::f64::consts::PI;
use std::ops::Range;

use model::effects::shock::{LONGEST_RING_S, LONGEST_S, PERIODS};

use crate::fit::likelihood::{Bins, Dct};
use crate::fit::scan::residual;
use crate::fit::threshold;
use crate::ingest::blows::{Blow, Shape, least};
use crate::search::searched::Searched;
use crate::test_level::CLAIM_LEVEL;
use grids::{Known, coordinates, half_sines, rings};
use meetings::meet;
use numerics::tails::chi_square;

mod grids;
mod meetings;

/// Readings of the piece over those of the blow, and the fewest; of a long blow fewer times as many tell what the noise is about it.
const PIECE: usize = 8;
const LEAST_PIECE: usize = 256;
const LONG_PIECE: usize = 2;
const ENOUGH: usize = 4096;
/// Likelihood ratio by which more than one reading has to tell of a blow that has a course in time.
const COURSE: f64 = 12.0;

/// What a channel feels.
#[derive(Clone, Debug)]
pub(crate) struct Felt {
    /// Its place among the channels.
    pub channel: usize,
    /// Largest reading, with its standard error, in the unit of the channel.
    pub peak: (f64, f64),
    /// Its part of the likelihood ratio.
    pub lr: f64,
    /// Phase of a ring at its begin, rad.
    pub phase: Option<(f64, f64)>,
    /// Share of the noise that the processes of the channel make where it acts.
    pub by_processes: f64,
}

/// A blow as the final model has it.
#[derive(Clone, Debug)]
pub(crate) struct Fitted {
    /// Likelihood ratio of it on all channels that feel it.
    pub lr: f64,
    /// What that has to reach.
    pub least: f64,
    /// Parameters that were estimated.
    pub freedom: usize,
    /// Begin and length, s, and the frequency of a ring, Hz, with their standard errors.
    pub location: Vec<(f64, f64)>,
    /// What each channel feels.
    pub felt: Vec<Felt>,
    /// Whether one reading holds it.
    pub single: bool,
}

/// Begin, readings from the start of the piece, and shape.
type Place = (f64, Shape);

/// A channel in the piece.
struct Channel {
    /// Coefficients of what the terms leave.
    left: Vec<f64>,
    /// 1 / variance of each.
    weight: Vec<f64>,
    /// Share of it that processes make.
    by_processes: Vec<f64>,
}

impl Channel {
    /// Product of two shapes by the noise.
    fn over(&self, a: &[f64], b: &[f64]) -> f64 {
        let pairs = a.iter().zip(b).zip(&self.weight);
        pairs.map(|((a, b), w)| a * b * w).sum()
    }
}

/// A piece of the record about a blow.
struct Piece {
    dct: Dct,
    /// Readings.
    all: Range<usize>,
    channels: Vec<Channel>,
}

/// Sizes of a shape on a channel, their covariance, and how much it explains.
struct Sizes {
    beta: Vec<f64>,
    covariance: [[f64; 2]; 2],
    lr: f64,
}

impl Piece {
    fn new(blow: &Blow, searched: &[&Searched<'_>]) -> Self {
        let n = searched.first().map_or(0, |s| s.search.panel.bins.n);
        let own = blow.readings.len();
        let wanted = (PIECE * own).min(ENOUGH).max(LONG_PIECE * own);
        let wanted = wanted.max(LEAST_PIECE);
        let length = wanted.next_power_of_two().min(n);
        let middle = blow.readings.start.midpoint(blow.readings.end);
        let start = middle.saturating_sub(length / 2).min(n - length);
        let all = start..start + length;
        let (dct, bins) = (Dct::new(length), Bins::new(length));
        let channels = searched
            .iter()
            .map(|s| {
                let law = s.variance.product();
                let law = law.map_or(1.0, |v| largest(v, &blow.readings));
                let white = s.state.solution.white * law;
                let g = s.state.noise.everywhere(&bins);
                let mut weight: Vec<f64> = g.iter().map(|g| (white * g).recip()).collect();
                weight[0] = 0.0;
                let beside = s.state.noise_beside_processes().everywhere(&bins);
                let shares = beside.iter().zip(&g).map(|(b, g)| 1.0 - b / g);
                let mut by_processes: Vec<f64> = shares.collect();
                by_processes[0] = 0.0;
                Channel {
                    left: dct.forward(&left(s, &all)),
                    weight,
                    by_processes,
                }
            })
            .collect();
        Self { dct, all, channels }
    }

    /// A shape by samples of the piece: one column for each of its sizes. None where no reading falls in it.
    fn columns(&self, (start, shape): Place) -> Option<Vec<Vec<f64>>> {
        let n = self.all.len();
        let columns = match shape {
            Shape::HalfSine(width) => {
                let at = |i: usize| {
                    let part = (i as f64 - start) / width;
                    if (0.0..=1.0).contains(&part) {
                        (PI * part).sin()
                    } else {
                        0.0
                    }
                };
                vec![(0..n).map(at).collect::<Vec<f64>>()]
            }
            Shape::Ring(fades, pitch) => {
                let kept = (-fades.recip()).exp();
                let [a, b] = [kept * pitch.cos(), kept * pitch.sin()];
                let first = (start.ceil().max(0.0) as usize).min(n);
                let since = first as f64 - start;
                let (mut sin, mut cos) = (pitch * since).sin_cos();
                let size = (-since / fades).exp();
                (sin, cos) = (size * sin, size * cos);
                let [mut even, mut odd] = [vec![0.0; n], vec![0.0; n]];
                for (even, odd) in even[first..].iter_mut().zip(&mut odd[first..]) {
                    (*even, *odd) = (cos, sin);
                    (cos, sin) = (a * cos - b * sin, b * cos + a * sin);
                }
                vec![even, odd]
            }
        };
        let there = |c: &Vec<f64>| c.iter().any(|v| v.abs() > 1e-6);
        columns.iter().all(there).then_some(columns)
    }

    /// Sizes of columns on each of some channels.
    fn sizes(&self, columns: &[Vec<f64>], of: &[usize]) -> Vec<Sizes> {
        let shapes: Vec<Vec<f64>> = columns.iter().map(|c| self.dct.forward(c)).collect();
        of.iter()
            .map(|k| {
                let channel = &self.channels[*k];
                let over = |a: &[f64], b: &[f64]| channel.over(a, b);
                let right: Vec<f64> = shapes.iter().map(|s| over(s, &channel.left)).collect();
                let covariance = inverse(&shapes, &over);
                let beta: Vec<f64> = (0..shapes.len())
                    .map(|i| right.iter().zip(covariance[i]).map(|(r, v)| r * v).sum())
                    .collect();
                let lr = beta.iter().zip(&right).map(|(b, r)| b * r).sum();
                Sizes {
                    beta,
                    covariance,
                    lr,
                }
            })
            .collect()
    }

    /// Share of the noise of a channel that its processes make where columns act.
    fn by_processes(&self, columns: &[Vec<f64>], channel: usize) -> f64 {
        let Channel {
            weight,
            by_processes,
            ..
        } = &self.channels[channel];
        let (mut made, mut all) = (0.0, f64::MIN_POSITIVE);
        for column in columns {
            let own = self.dct.forward(column);
            for ((c, w), share) in own.iter().zip(weight).zip(by_processes) {
                made += c * c * w * share;
                all += c * c * w;
            }
        }
        made / all
    }
}

/// Inverse of the products of one shape or two.
fn inverse(shapes: &[Vec<f64>], over: &dyn Fn(&[f64], &[f64]) -> f64) -> [[f64; 2]; 2] {
    let least = f64::MIN_POSITIVE;
    match shapes {
        [a, b] => {
            let (aa, bb, ab) = (over(a, a), over(b, b), over(a, b));
            let determinant = (aa * bb - ab * ab).max(1e-9 * aa * bb).max(least);
            let [x, y] = [bb / determinant, aa / determinant];
            [[x, -ab / determinant], [-ab / determinant, y]]
        }
        [a] => [[over(a, a).max(least).recip(), 0.0], [0.0, 0.0]],
        _ => [[0.0; 2]; 2],
    }
}

/// What the terms of a channel leave of its readings in a piece, those that were set aside put back.
fn left(s: &Searched<'_>, piece: &Range<usize>) -> Vec<f64> {
    let panel = &s.search.panel;
    let mut left = panel
        .dct
        .inverse(&residual(panel, &s.state.columns(), &s.state.solution));
    let data = panel.dct.inverse(&panel.column(0));
    for (place, read) in &s.target.aside {
        left[*place] += read - data[*place];
    }
    let mut left = left[piece.clone()].to_vec();
    if let Some(level) = &s.state.level {
        let level = &level[piece.clone()];
        left.iter_mut().zip(level).for_each(|(r, l)| *r -= l);
    }
    left
}

/// A blow fitted to channels of one record at rest; none where the final model leaves too little of it.
pub(crate) fn fit(blow: &Blow, searched: &[&Searched<'_>], rate_hz: f64) -> Option<Fitted> {
    let piece = Piece::new(blow, searched);
    let (half, ring) = (
        half_sines(&piece, blow, rate_hz),
        rings(&piece, blow, rate_hz),
    );
    let most = |known: &Known| known.best().map_or(f64::NEG_INFINITY, |b| b.1);
    // A ring has a pitch more, and a size more on each channel: Schwarz's criterion over its readings.
    let more = (1 + blow.felt.len()) as f64 * (blow.readings.len() as f64).ln();
    let known = if most(&ring) - more > most(&half) {
        ring
    } else {
        half
    };
    let (best, _) = known.best()?;
    let columns = piece.columns(best)?;
    let sizes = best.1.sizes();
    let everyone: Vec<usize> = (0..searched.len()).collect();
    let claim = threshold::tail(sizes, CLAIM_LEVEL);
    let felt: Vec<usize> = (piece.sizes(&columns, &everyone).iter())
        .zip(&everyone)
        .filter(|(s, k)| s.lr > claim || blow.felt == [**k])
        .map(|(_, k)| *k)
        .collect();
    if felt.is_empty() {
        return None;
    }
    let lr: f64 = piece.sizes(&columns, &felt).iter().map(|s| s.lr).sum();
    let n = searched[0].search.panel.bins.n;
    let wanted = least(threshold::false_alarm(), n, sizes, searched.len())[felt.len() - 1];
    let one = one_reading(&piece, blow, &felt);
    let single = lr - one.iter().sum::<f64>() < COURSE;
    // One far reading of one channel is its own, whatever the noise of the others does then: the more such readings there are,
    // the sooner one of another channel meets one of them by chance.
    let meetings = far_readings(blow, searched) * (searched.len() - 1).max(1);
    let by_chance = threshold::tail(1, threshold::false_alarm() / meetings as f64);
    let at_once = one.iter().filter(|lr| **lr > by_chance);
    if lr < wanted || single && at_once.count() < 2 {
        return None;
    }
    let location = location(&known, &piece, best, rate_hz);
    let freedom = location.len() + felt.len() * sizes;
    if meet(&piece, blow, &felt, searched, (lr, freedom)) {
        return None;
    }
    let (length, error) = *location.get(1)?;
    let is_long = length - 2.0 * error > LONGEST_S;
    if is_long && !rings_on(&piece, (blow, best), (&columns, &felt), &location) {
        return None;
    }
    let start = location.first().map_or(0.0, |l| l.1 * rate_hz);
    let of = |k: &usize| of_channel(&piece, &known, (best, start), *k);
    Some(Fitted {
        lr,
        least: wanted,
        freedom,
        location,
        felt: felt.iter().map(of).collect(),
        single,
    })
}

/// Whether what is longer than a blow is a ring of many periods, which leaves nothing but noise of its readings.
fn rings_on(
    piece: &Piece,
    (blow, best): (&Blow, Place),
    (columns, felt): (&[Vec<f64>], &[usize]),
    location: &[(f64, f64)],
) -> bool {
    let [_, (length, error), (hz, _)] = location else {
        return false;
    };
    if length - 2.0 * error > LONGEST_RING_S || hz * length < PERIODS {
        return false;
    }
    let shapes: Vec<Vec<f64>> = columns.iter().map(|c| piece.dct.forward(c)).collect();
    // All of it is asked, not only what was left out: the first of a tone that goes on rings as well.
    let ends = (best.0 + best.1.reach() as f64) as usize;
    let [start, end] = [blow.readings.start, blow.readings.end].map(|i| i - piece.all.start);
    let own = start..end.max(ends).min(piece.all.len());
    felt.iter()
        .zip(piece.sizes(columns, felt))
        .all(|(k, sizes)| {
            let channel = &piece.channels[*k];
            let mut left = channel.left.clone();
            for (shape, beta) in shapes.iter().zip(sizes.beta) {
                left.iter_mut().zip(shape).for_each(|(v, s)| *v -= beta * s);
            }
            left.iter_mut()
                .zip(&channel.weight)
                .for_each(|(v, w)| *v *= w.sqrt());
            let left = piece.dct.inverse(&left);
            let square = left[own.clone()].iter().map(|v| v * v).sum::<f64>();
            chi_square(square, own.len() as f64) > threshold::false_alarm()
        })
}

/// Single far readings of a record, that of a blow counted once.
fn far_readings(blow: &Blow, searched: &[&Searched<'_>]) -> usize {
    let aside = searched.iter().flat_map(|s| &s.target.aside);
    let others = aside.filter(|(place, _)| !blow.readings.contains(place));
    1 + others.count()
}

/// What the one reading explains on each channel that explains most of all of them.
fn one_reading(piece: &Piece, blow: &Blow, felt: &[usize]) -> Vec<f64> {
    let at = |i: usize| {
        let mut column = vec![0.0; piece.all.len()];
        column[i - piece.all.start] = 1.0;
        let each = piece.sizes(&[column], felt);
        each.iter().map(|s| s.lr).collect::<Vec<f64>>()
    };
    let all = blow.readings.clone().map(at);
    let sum = |v: &Vec<f64>| v.iter().sum::<f64>();
    all.max_by(|a, b| sum(a).total_cmp(&sum(b)))
        .unwrap_or_default()
}

/// The largest of a law of the variance about some readings: what is left of a loud stretch without them is as loud.
fn largest(law: &[f64], readings: &Range<usize>) -> f64 {
    let from = readings.start.saturating_sub(readings.len());
    let to = (readings.end + readings.len()).min(law.len());
    law[from..to].iter().copied().fold(0.0, f64::max)
}

/// Begin and length, s, and frequency of a ring, Hz, at the best place, and how far the data leave them open.
fn location(known: &Known, piece: &Piece, best: Place, rate_hz: f64) -> Vec<(f64, f64)> {
    let spread = |of: &dyn Fn(&Place) -> f64| known.spread(of);
    let (length, pitch) = coordinates(&best);
    let start = spread(&|p| p.0);
    let length = (length, spread(&|p| coordinates(p).0));
    let scaled = |(value, error): (f64, f64), by: f64| (value * by, error * by);
    let dt = rate_hz.recip();
    let first = piece.all.start as f64 + best.0;
    match best.1 {
        Shape::HalfSine(_) => vec![scaled((first, start), dt), scaled(length, dt)],
        // It begins at some time since the reading before.
        Shape::Ring(..) => vec![
            scaled((first - 0.5, start.hypot(12f64.sqrt().recip())), dt),
            scaled(length, 3.0 * dt),
            scaled((pitch, spread(&|p| coordinates(p).1)), rate_hz / (2.0 * PI)),
        ],
    }
}

/// What a channel feels: its largest reading by every place that the data leave open, of a ring its size; and the phase at the
/// best one, whose begin has that standard error, readings.
fn of_channel(piece: &Piece, known: &Known, (best, start): (Place, f64), channel: usize) -> Felt {
    let rings = matches!(best.1, Shape::Ring(..));
    let largest = |place: Place| {
        let columns = piece.columns(place)?;
        let sizes = piece.sizes(&columns, &[channel]).pop()?;
        let at = |i: usize| {
            let parts = columns.iter().zip(&sizes.beta);
            parts.map(|(c, b)| c[i] * b).sum::<f64>()
        };
        let all = (0..piece.all.len()).map(|i| (at(i), i));
        let (peak, i) = all.max_by(|a, b| a.0.abs().total_cmp(&b.0.abs()))?;
        let c = |k: usize| columns.get(k).map_or(0.0, |c| c[i]);
        let v = &sizes.covariance;
        let variance = c(0) * c(0) * v[0][0] + c(1) * c(1) * v[1][1] + 2.0 * c(0) * c(1) * v[0][1];
        Some((if rings { peak.abs() } else { peak }, variance))
    };
    let (mut mean, mut square, mut sum) = (0.0, 0.0, 0.0);
    for (place, weight) in known.weighed() {
        if let Some((peak, variance)) = largest(place) {
            sum += weight;
            mean += weight * peak;
            square += weight * (peak * peak + variance);
        }
    }
    (mean, square) = (mean / sum, square / sum);
    let phase = match best.1 {
        Shape::HalfSine(_) => None,
        Shape::Ring(_, pitch) => phase(piece, best, channel).map(|(p, e)| {
            let begins = p - 0.5 * pitch;
            (begins, e.hypot(pitch * start))
        }),
    };
    let columns = piece.columns(best).unwrap_or_default();
    Felt {
        channel,
        lr: piece.sizes(&columns, &[channel]).iter().map(|s| s.lr).sum(),
        by_processes: piece.by_processes(&columns, channel),
        peak: (mean, (square - mean * mean).max(0.0).sqrt()),
        phase,
    }
}

/// Phase of a ring at its first reading, with its standard error, rad.
fn phase(piece: &Piece, best: Place, channel: usize) -> Option<(f64, f64)> {
    let sizes = piece.sizes(&piece.columns(best)?, &[channel]).pop()?;
    let (c, s) = (*sizes.beta.first()?, *sizes.beta.get(1)?);
    let square = (c * c + s * s).max(f64::MIN_POSITIVE);
    let v = &sizes.covariance;
    let variance = (s * s * v[0][0] + c * c * v[1][1] - 2.0 * c * s * v[0][1]) / (square * square);
    Some(((-s).atan2(c), variance.sqrt()))
}

/// Peak of a half sine of that length, s, which has the size `strength` over the noise of a channel; none where it would have
/// fewer than two readings.
pub(crate) fn peak_of(s: &Searched<'_>, duration_s: f64, strength: f64) -> Option<f64> {
    let width = duration_s * s.search.view.rate_hz;
    if width < 2.0 {
        return None;
    }
    let n = s.search.panel.bins.n;
    let length = (PIECE * width.ceil() as usize)
        .max(LEAST_PIECE)
        .next_power_of_two()
        .min(n);
    let (dct, bins) = (Dct::new(length), Bins::new(length));
    let start = (length / 2) as f64;
    let at = |i: usize| {
        let part = (i as f64 + 0.5 - start) / width;
        if (0.0..=1.0).contains(&part) {
            (PI * part).sin()
        } else {
            0.0
        }
    };
    let c = dct.forward(&(0..length).map(at).collect::<Vec<f64>>());
    let g = s.state.noise.everywhere(&bins);
    let white = s.state.solution.white;
    let over = c.iter().zip(&g).skip(1).map(|(c, g)| c * c / (white * g));
    Some(strength / over.sum::<f64>().sqrt())
}
