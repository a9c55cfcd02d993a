//! Blows of a base at rest: where in the record something happens that is over within a second, or rings on for some
//! (`long_rings`), on one channel or on several at once.
//!
//! The whitened readings of each channel are held against half sines and decaying rings of all lengths at all times. Of one
//! shape at one time the energies of the channels that feel it add up. What stands out has to be all that does: a noise with
//! tails, a machine that knocks again and again or a wandering bias has many more that nearly stand out, and is none. What is
//! found here is left out of the readings; whether it is a shock, the final model tells.

use std::f64::consts::PI;
use std::ops::Range;

use model::effects::shock::LONGEST_S;

use crate::fit::likelihood::{Bins, Dct, Noise};
use crate::fit::threshold;
use crate::ingest::base_turns::overlap;
use crate::ingest::types::Target;
use crate::test_level::on_two_threads;
use numerics::order_statistics::{median, robust_sigma};

mod long_rings;

/// Half sines have lengths this far apart; their ends are sought in steps of this part of them.
const APART: f64 = 1.4;
const STEPS: usize = 8;
/// Longest time constant of a ring, readings: rings of that time constant have some 80 pitches.
const LONGEST_RING: f64 = 32.0;
/// Time constants of a ring in its duration, in which it falls to exp(-3).
pub(super) const FALLEN: f64 = 3.0;
/// Distance of two pitches over the width of a ring's peak, 1 / its time constant, rad per reading.
pub(super) const PITCH: f64 = 1.2;
/// Chance, where it is given, that a channel feels one by its noise: of a shape of several readings, and of a single one, of
/// which another channel has a fault of its own now and then.
const FELT: f64 = 1e-2;
const FELT_SINGLE: f64 = 1e-3;
/// Likelihood ratio by which a shape has to be better than a single reading, where one channel alone feels it.
const NO_SINGLE: f64 = 12.0;
/// Most blows in a record, and most places that nearly stand out beside them, with the likelihood ratio that "nearly" allows:
/// one clean record in ten has such a place.
pub(super) const MOST: usize = 4;
const BESIDE: usize = 3;
const NEARLY: f64 = 12.0;
/// Readings before and after it that tell of the level, and the part of its energy that stays where that steps.
const LEVEL: usize = 60;
const SHARE: f64 = 0.6;
/// Readings of a block whose spread is its own, and the spread from which on it counts.
const BLOCK: usize = 200;
const LOUD: f64 = 1.15;
/// Readings that tell how large a shape's energy usually is.
const TOLD: usize = 1 << 14;

/// One of them.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Blow {
    /// Its readings, some beside them included.
    pub readings: Range<usize>,
    /// The first of it.
    pub first: usize,
    /// Its shape.
    pub shape: Shape,
    /// Places of the channels that feel it among the targets.
    pub felt: Vec<usize>,
}

/// A shape, in readings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Shape {
    /// Half sine of so many readings.
    HalfSine(f64),
    /// Ring of a time constant and a pitch, rad per reading.
    Ring(f64, f64),
}

impl Shape {
    /// Readings that it takes.
    pub fn reach(self) -> usize {
        match self {
            Self::HalfSine(width) => width.ceil() as usize,
            Self::Ring(fades, _) => (2.0 * FALLEN * fades).ceil() as usize,
        }
    }

    /// Sizes of its own on each channel.
    pub fn sizes(self) -> usize {
        match self {
            Self::HalfSine(_) => 1,
            Self::Ring(..) => 2,
        }
    }

    /// All that are looked for.
    fn all(rate_hz: f64) -> Vec<Self> {
        let longest = (LONGEST_S * rate_hz).max(1.0);
        let mut all = vec![];
        let mut width = 1.0;
        while width <= longest {
            all.push(Self::HalfSine(width));
            width = (width * APART).round().max(width + 1.0);
        }
        let mut fades = 1.0;
        while fades <= longest_fades(rate_hz) {
            let pitches = (PI * fades / PITCH).round() as usize;
            let pitch = |i: usize| PI * (i as f64 + 0.5) / pitches as f64;
            all.extend((0..pitches).map(|i| Self::Ring(fades, pitch(i))));
            fades *= 2.0;
        }
        all
    }

    /// Energy of a series in it at every time, by its number of sizes chi-square of a white one.
    fn energies(self, e: &[f64]) -> Vec<f64> {
        match self {
            Self::HalfSine(width) => half_sines(e, width as usize),
            Self::Ring(fades, pitch) => rings(e, fades, pitch),
        }
    }
}

/// Longest time constant of the rings that are looked for at all times, readings.
fn longest_fades(rate_hz: f64) -> f64 {
    ((LONGEST_S * rate_hz).max(1.0) / FALLEN).min(LONGEST_RING)
}

/// Energy in a half sine that begins at each reading.
fn half_sines(e: &[f64], width: usize) -> Vec<f64> {
    let shape: Vec<f64> = (0..width)
        .map(|j| (PI * (j as f64 + 0.5) / width as f64).sin())
        .collect();
    let square: f64 = shape.iter().map(|v| v * v).sum();
    let stride = (width / STEPS).max(1);
    let mut all = vec![0.0; e.len()];
    for (i, window) in e.windows(width).enumerate().step_by(stride) {
        let sum: f64 = window.iter().zip(&shape).map(|(e, s)| e * s).sum();
        all[i] = sum * sum / square;
    }
    all
}

/// Energy in the cosine and the sine of a ring that begins at each reading.
pub(super) fn rings(e: &[f64], fades: f64, pitch: f64) -> Vec<f64> {
    let kept = (-1.0 / fades).exp();
    let (sine, cosine) = pitch.sin_cos();
    let [a, b] = [kept * cosine, kept * sine];
    // Sums of squares and products of exp(-s / fades) (cos, sin)(pitch s).
    let all = 1.0 / (1.0 - kept * kept);
    let turn = 1.0 - 2.0 * kept * kept * (2.0 * pitch).cos() + kept.powi(4);
    let even = (1.0 - kept * kept * (2.0 * pitch).cos()) / turn;
    let odd = kept * kept * (2.0 * pitch).sin() / turn;
    let (cc, ss, cs) = (0.5 * (all + even), 0.5 * (all - even), 0.5 * odd);
    let determinant = cc * ss - cs * cs;
    let [vc, vs, vx] = [ss, cc, -2.0 * cs].map(|v| v / determinant);
    let (mut c, mut s) = (0.0, 0.0);
    let mut energies = vec![0.0; e.len()];
    for (energy, e) in energies.iter_mut().zip(e).rev() {
        (c, s) = (e + a * c - b * s, a * s + b * c);
        *energy = vc * c * c + vs * s * s + vx * c * s;
    }
    energies
}

/// The places that a search of `n` readings for shapes has, each of one reading and one shape: neighbours of either are alike.
/// `cargo test -p diagnosis --lib blows` counts what that makes of white noise.
fn places(n: usize) -> f64 {
    const ALIKE: f64 = 4.0;
    ALIKE * n as f64
}

/// What the energies of the one, two and so on strongest of `channels` channels have to reach together, each in so many sizes:
/// a record of white noise reaches one of them with this chance.
pub(crate) fn least(chance: f64, n: usize, sizes: usize, channels: usize) -> Vec<f64> {
    let mut choices = 1.0;
    (1..=channels)
        .map(|felt| {
            // Any number of channels, any of them.
            choices *= (channels + 1 - felt) as f64 / felt as f64;
            threshold::tail(
                felt * sizes,
                chance / (places(n) * channels as f64 * choices),
            )
        })
        .collect()
}

/// The strongest of some energies at one place that are felt together, and by how much they stand out.
struct Sum<'a> {
    sizes: usize,
    /// What one, two and so on of them have to reach.
    least: &'a [f64],
}

impl Sum<'_> {
    fn of(&self, single: bool, energies: &mut Vec<(f64, usize)>) -> f64 {
        energies.sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
        let felt = threshold::tail(self.sizes, if single { FELT_SINGLE } else { FELT });
        let (mut sum, mut best, mut count) = (0.0, f64::NEG_INFINITY, 0);
        for (k, (energy, least)) in energies.iter().zip(self.least).enumerate() {
            if k > 0 && energy.0 < felt {
                break;
            }
            sum += energy.0;
            if sum - least > best {
                (best, count) = (sum - least, k + 1);
            }
        }
        energies.truncate(count);
        best
    }
}

/// A place where something may happen.
#[derive(Clone, Copy)]
struct Place {
    at: usize,
    shape: usize,
    excess: f64,
}

/// The blows that targets of one record at rest felt. `read` gives their readings, those that the noise cannot have made put
/// back.
pub(crate) fn blows(
    targets: &[&Target],
    read: &dyn Fn(&Target) -> Vec<f64>,
    (dct, bins): (&Dct, &Bins),
    rate_hz: f64,
) -> Vec<Blow> {
    if targets.is_empty() || targets.iter().any(|t| t.moving) {
        return vec![];
    }
    let mut readings: Vec<Vec<f64>> = targets.iter().map(|t| read(t)).collect();
    // A stay on another level is short, and none.
    let noise = (targets.iter().zip(&mut readings)).map(|(t, y)| {
        let own = (t.jumps.take_levels_off(y)).map(|(noise, white)| (noise, *white));
        own.unwrap_or((&t.noise, t.white))
    });
    let noise: Vec<(&Noise, f64)> = noise.collect();
    let mut whitened: Vec<Vec<f64>> = (noise.iter().zip(&readings))
        .map(|(noise, y)| whitened(y, *noise, dct, bins))
        .collect();
    let mut found = long_rings::take_off(&mut whitened, rate_hz, longest_fades(rate_hz).max(1.0));
    whitened.iter_mut().for_each(|e| even_out(e));
    let changes = |place: Place, shape: Shape| {
        let felt = felt(&whitened, place, shape);
        let all = felt.iter().map(|(energy, k)| {
            let sigma = noise[*k].1.sqrt();
            beside_a_step(&readings[*k], sigma, place.at, shape) < SHARE * energy
        });
        all.clone().filter(|changed| *changed).count() * 2 > all.count()
    };
    let shapes = Shape::all(rate_hz);
    let mut places = standing_out(&whitened, &shapes, threshold::false_alarm());
    places.sort_by(|a, b| b.excess.total_cmp(&a.excess));
    let mut seen: Vec<Range<usize>> = found.iter().map(|b| b.readings.clone()).collect();
    let mut beside = 0;
    for place in places {
        let shape = shapes[place.shape];
        let own = with_margin(place.at, shape, whitened[0].len());
        if seen.iter().any(|s| overlap(s, &own)) {
            continue;
        }
        seen.push(own.clone());
        // What the record begins with may be the end of what began before it: a bias that settles.
        if own.start == 0 {
            continue;
        }
        if is_single(&whitened, place, shape) || changes(place, shape) {
            continue;
        }
        if place.excess <= 0.0 {
            beside += 1;
            continue;
        }
        found.push(Blow {
            readings: own,
            first: place.at,
            shape,
            felt: (felt(&whitened, place, shape).iter().map(|f| f.1)).collect(),
        });
        if found.len() > MOST {
            return vec![];
        }
    }
    if beside > BESIDE { vec![] } else { found }
}

/// The readings of a shape from a place on, and a quarter of them on either side.
pub(super) fn with_margin(at: usize, shape: Shape, n: usize) -> Range<usize> {
    let reach = shape.reach();
    let margin = 1 + reach / 4;
    at.saturating_sub(margin)..(at + reach + margin).min(n)
}

/// The energies of a shape at a place, strongest first, with the channels: of those that feel it.
fn felt(whitened: &[Vec<f64>], place: Place, shape: Shape) -> Vec<(f64, usize)> {
    let (n, end) = (whitened[0].len(), place.at + shape.reach());
    let mut energies = (whitened.iter().enumerate())
        .map(|(k, e)| (shape.energies(&e[place.at..end.min(n)])[0], k))
        .collect();
    let least = least(threshold::false_alarm(), n, shape.sizes(), whitened.len());
    let sum = Sum {
        sizes: shape.sizes(),
        least: &least,
    };
    sum.of(shape == Shape::HalfSine(1.0), &mut energies);
    energies
}

/// Energy of a shape beside a level that steps once, wherever it steps: little of what only begins or ends there.
fn beside_a_step(y: &[f64], sigma: f64, at: usize, shape: Shape) -> f64 {
    let own = with_margin(at, shape, y.len());
    let reach = LEVEL.max(2 * shape.reach());
    let before = &y[own.start.saturating_sub(reach)..own.start];
    let after = &y[own.end..(own.end + reach).min(y.len())];
    let level = |part: &[f64], other: &[f64]| median(if part.is_empty() { other } else { part });
    let (before, after) = (level(before, after), level(after, before));
    let end = (at + shape.reach()).min(y.len());
    let energy = |step: usize| {
        let left = (at..end).map(|i| (y[i] - if i < step { before } else { after }) / sigma);
        shape.energies(&left.collect::<Vec<f64>>())[0]
    };
    (at..=end).map(energy).fold(f64::INFINITY, f64::min)
}

/// Whether one channel alone feels it for certain, and hardly more than one reading of it: a disturbed word is as likely.
fn is_single(whitened: &[Vec<f64>], place: Place, shape: Shape) -> bool {
    let felt = felt(whitened, place, shape);
    let energy: f64 = felt.iter().map(|f| f.0).sum();
    let squares = |i: usize| felt.iter().map(move |f| whitened[f.1][i].powi(2));
    let own = with_margin(place.at, shape, whitened[0].len());
    let sum = |i: &usize| squares(*i).sum::<f64>();
    let Some(at) = own.max_by(|a, b| sum(a).total_cmp(&sum(b))) else {
        return false;
    };
    let certain = squares(at).filter(|s| *s > threshold::tail(1, FELT_SINGLE));
    energy - sum(&at) < NO_SINGLE && certain.count() < 2
}

/// Readings of a target as its first fit whitens them.
fn whitened(y: &[f64], (noise, white): (&Noise, f64), dct: &Dct, bins: &Bins) -> Vec<f64> {
    let mut c = dct.forward(y);
    let g = noise.everywhere(bins);
    c[0] = 0.0;
    c.iter_mut()
        .zip(&g)
        .skip(1)
        .for_each(|(c, g)| *c /= (white * g).sqrt());
    dct.inverse(&c)
}

/// Takes off readings where they are louder than elsewhere how much they are.
fn even_out(e: &mut [f64]) {
    let spreads: Vec<f64> = e.chunks(BLOCK).map(robust_sigma).collect();
    for (b, block) in e.chunks_mut(BLOCK).enumerate() {
        // Of three blocks the middle one: a blow is in one of them.
        let near = &spreads[b.saturating_sub(1)..(b + 2).min(spreads.len())];
        let spread = median(near);
        if spread > LOUD {
            block.iter_mut().for_each(|e| *e /= spread);
        }
    }
}

/// By how much the shape that stands out most at a reading does, and its number.
type Best = (f32, u32);

/// At every reading the shape that stands out most, where one does nearly.
fn standing_out(whitened: &[Vec<f64>], shapes: &[Shape], chance: f64) -> Vec<Place> {
    let numbered: Vec<(u32, Shape)> = (0..).zip(shapes.iter().copied()).collect();
    let halves = numbered.chunks(numbered.len().div_ceil(2).max(1));
    let mut halves = on_two_threads(halves, |half| best_of(whitened, half, chance)).into_iter();
    let mut best = halves.next().unwrap_or_default();
    for (best, other) in best.iter_mut().zip(halves.flatten()) {
        // Of two alike the first counts.
        if other.0 > best.0 {
            *best = other;
        }
    }
    let all = best.into_iter().enumerate();
    let all = all.filter(|(_, (excess, _))| f64::from(*excess) > -NEARLY);
    all.map(|(at, (excess, shape))| Place {
        at,
        shape: shape as usize,
        excess: f64::from(excess),
    })
    .collect()
}

/// The best of some shapes at every reading.
fn best_of(whitened: &[Vec<f64>], shapes: &[(u32, Shape)], chance: f64) -> Vec<Best> {
    let (n, channels) = (whitened[0].len(), whitened.len());
    let mut best = vec![(f32::NEG_INFINITY, 0); n];
    let mut energies = vec![];
    for (k, shape) in shapes {
        let sizes = shape.sizes();
        let limits = least(chance, n, sizes, channels);
        let of_channels: Vec<Vec<f64>> = (whitened.iter())
            .map(|e| {
                let mut all = shape.energies(e);
                let usual = usual(&all, sizes).max(1.0);
                all.iter_mut().for_each(|v| *v /= usual);
                all
            })
            .collect();
        let sum = Sum {
            sizes,
            least: &limits,
        };
        // No sum of several reaches its limit where none of its parts has its share of it.
        let share = (1..=channels)
            .map(|felt| (limits[felt - 1] - NEARLY) / felt as f64)
            .fold(f64::INFINITY, f64::min);
        for i in 0..n {
            if of_channels.iter().all(|all| all[i] < share) {
                continue;
            }
            energies.clear();
            energies.extend(of_channels.iter().map(|all| all[i]).zip(0..));
            let excess = sum.of(*shape == Shape::HalfSine(1.0), &mut energies) as f32;
            if excess > best[i].0 {
                best[i] = (excess, *k);
            }
        }
    }
    best
}

/// How large an energy usually is, over that of white noise: by its median where it is asked.
fn usual(energies: &[f64], sizes: usize) -> f64 {
    let every = energies.len().div_ceil(TOLD);
    let some = energies.iter().step_by(every.max(1));
    let some: Vec<f64> = some.copied().filter(|v| *v > 0.0).collect();
    let white = if sizes == 1 {
        numerics::tails::MEDIAN
    } else {
        2.0 * std::f64::consts::LN_2
    };
    if some.is_empty() {
        1.0
    } else {
        median(&some) / white
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::white;

    #[test]
    fn energies_of_white_noise_have_their_degrees_as_means() {
        let e = white(20_000, 1);
        for shape in Shape::all(20.0) {
            let all: Vec<f64> = shape.energies(&e)[..19_900].to_vec();
            let asked = all.iter().filter(|v| **v > 0.0);
            let mean = asked.clone().sum::<f64>() / asked.count() as f64;
            let wanted = shape.sizes() as f64;
            assert!((mean / wanted - 1.0).abs() < 0.15, "{shape:?}: {mean}");
        }
    }

    #[test]
    fn a_shape_has_its_own_energy_and_no_other_place_as_much() {
        let mut e = vec![0.0; 400];
        for (s, v) in e[200..].iter_mut().enumerate() {
            let s = s as f64;
            *v = (-s / 4.0).exp() * (1.1 * s + 0.3).cos();
        }
        let whole: f64 = e.iter().map(|v| v * v).sum();
        let all = Shape::Ring(4.0, 1.1).energies(&e);
        assert!(
            (all[200] / whole - 1.0).abs() < 1e-9,
            "{} of {whole}",
            all[200]
        );
        assert!(
            all.iter()
                .enumerate()
                .all(|(i, v)| i == 200 || *v < all[200])
        );
    }

    /// The number of places, counted: white noise stands out in as many records as the chance says.
    #[test]
    fn white_noise_stands_out_as_often_as_the_places_say() {
        let (n, runs, chance) = (1000, 600, 0.05);
        let shapes = Shape::all(20.0);
        let over = (0..runs).filter(|run| {
            let channels: Vec<Vec<f64>> = (0..3).map(|k| white(n, 3 * run + k)).collect();
            let places = standing_out(&channels, &shapes, chance);
            places.iter().any(|p| p.excess > 0.0)
        });
        let (over, expected) = (over.count() as f64, chance * runs as f64);
        println!("{over} of {runs}, {expected} by the places");
        // Three standard deviations either way.
        assert!(
            (over - expected).abs() < 3.0 * expected.sqrt(),
            "{over} against {expected}"
        );
    }
}
