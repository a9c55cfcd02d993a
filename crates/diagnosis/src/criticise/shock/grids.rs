//! What the readings leave open of a blow: grids over its begin, its length and its pitch, each of which is laid about what the
//! one before has left.

use std::f64::consts::PI;

use model::effects::shock::{LONGEST_RING_S, LONGEST_S};

use super::{Piece, Place};
use crate::ingest::blows::{Blow, Shape};

/// What is fitted may be so many times as long as a shock: then it is none.
const LONGER: f64 = 2.0;
/// Standard deviations of what is left that a grid reaches to, either way.
const REACH: f64 = 4.0;
/// Grids, each of which is laid about what the one before has left: at least so many, and more until what is left is no less than a
/// step of the grid. Each is four times as fine as the one before: the last one tells of a blow of 10^4 standard deviations.
const GRIDS: usize = 3;
const MOST_GRIDS: usize = 9;
/// Points of a grid from one value to another.
fn points(from: f64, to: f64, count: usize) -> impl Iterator<Item = f64> + Clone {
    let step = (to - from) / (count - 1).max(1) as f64;
    (0..count).map(move |i| from + step * i as f64)
}

/// A grid of half sines: begins or, of which less is left open beside the length, middles, and logarithms of their lengths.
struct HalfSines {
    at: [f64; 3],
    of_middle: bool,
    log_width: [f64; 3],
}

/// A grid of rings: first readings, logarithms of time constants, and pitches.
struct Rings {
    first: [f64; 3],
    log_fades: [f64; 3],
    pitch: [f64; 3],
}

/// From, to and count of a grid about a value, within bounds.
fn about(middle: f64, spread: f64, count: usize, bounds: [f64; 2]) -> [f64; 3] {
    let [low, high] = [-REACH, REACH].map(|r| (middle + r * spread).clamp(bounds[0], bounds[1]));
    [low, high, if high > low { count as f64 } else { 1.0 }]
}

fn grid([from, to, count]: [f64; 3]) -> impl Iterator<Item = f64> + Clone {
    points(from, to, count as usize)
}

impl HalfSines {
    fn places(&self) -> Vec<Place> {
        let widths = grid(self.log_width);
        let before = if self.of_middle { 0.5 } else { 0.0 };
        let of = |at: f64| {
            let widths = widths.clone().map(f64::exp);
            widths.map(move |w| (at - before * w, Shape::HalfSine(w)))
        };
        grid(self.at).flat_map(of).collect()
    }
}

impl Rings {
    fn places(&self) -> Vec<Place> {
        let (fades, pitch) = (grid(self.log_fades), grid(self.pitch));
        let of = |first: f64| {
            let pitch = pitch.clone();
            fades.clone().flat_map(move |f| {
                pitch
                    .clone()
                    .map(move |p| (first.round(), Shape::Ring(f.exp(), p)))
            })
        };
        grid(self.first).flat_map(of).collect()
    }
}

/// What is known of a blow from a grid: each place that has readings, with its likelihood ratio and what it says of each channel.
pub(super) struct Known {
    places: Vec<(Place, f64)>,
}

impl Known {
    fn of(piece: &Piece, places: Vec<Place>, felt: &[usize]) -> Self {
        let lr = |place: Place| {
            let columns = piece.columns(place)?;
            let all = piece.sizes(&columns, felt);
            Some((place, all.iter().map(|s| s.lr).sum::<f64>()))
        };
        Self {
            places: places.into_iter().filter_map(lr).collect(),
        }
    }

    pub fn best(&self) -> Option<(Place, f64)> {
        self.places
            .iter()
            .copied()
            .max_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Each place with its chance, the data given.
    pub fn weighed(&self) -> Vec<(Place, f64)> {
        let most = self.best().map_or(0.0, |b| b.1);
        let weight = |lr: f64| (0.5 * (lr - most)).exp();
        let sum: f64 = self.places.iter().map(|p| weight(p.1)).sum();
        let each = self.places.iter().map(|p| (p.0, weight(p.1) / sum));
        each.filter(|p| p.1 > 1e-6).collect()
    }

    /// Root of the mean square distance of a coordinate from its value at the best place.
    pub fn spread(&self, of: &dyn Fn(&Place) -> f64) -> f64 {
        let Some((best, _)) = self.best() else {
            return 0.0;
        };
        let middle = of(&best);
        let square = |(place, w): &(Place, f64)| w * (of(place) - middle).powi(2);
        self.weighed().iter().map(square).sum::<f64>().sqrt()
    }
}

/// Width of a half sine or time constant of a ring, readings, and pitch.
pub(super) fn coordinates(place: &Place) -> (f64, f64) {
    match place.1 {
        Shape::HalfSine(width) => (width, 0.0),
        Shape::Ring(fades, pitch) => (fades, pitch),
    }
}

/// The half sines that a blow may be.
pub(super) fn half_sines(piece: &Piece, blow: &Blow, rate_hz: f64) -> Known {
    let longest = (LONGER * LONGEST_S * rate_hz).max(2.0).ln();
    let from = (blow.readings.start - piece.all.start) as f64;
    let reach = blow.readings.len() as f64;
    let mut wanted = HalfSines {
        at: [from - 1.0, from + reach, (2.0 * reach).clamp(24.0, 80.0)],
        of_middle: false,
        log_width: [0.0, longest.min((1.5 * reach).ln()), 20.0],
    };
    let mut known = Known::of(piece, wanted.places(), &blow.felt);
    for grids in 1..MOST_GRIDS {
        let Some((best, _)) = known.best() else { break };
        let log_width = |p: &Place| coordinates(p).0.ln();
        let middle = |p: &Place| p.0 + 0.5 * coordinates(p).0;
        let left = [known.spread(&middle), known.spread(&log_width)];
        let steps = [wanted.at, wanted.log_width].map(step);
        if grids >= GRIDS && resolved(&left, &steps) {
            break;
        }
        let width = coordinates(&best).0;
        let starts = [from - 2.0, from + reach].map(|start| start + 0.5 * width);
        wanted = HalfSines {
            at: about(middle(&best), left[0].max(0.5 * steps[0]), 25, starts),
            of_middle: true,
            log_width: about(
                log_width(&best),
                left[1].max(0.5 * steps[1]),
                17,
                [0.0, longest],
            ),
        };
        known = Known::of(piece, wanted.places(), &blow.felt);
    }
    known
}

/// From one value of a grid to the next.
fn step([from, to, count]: [f64; 3]) -> f64 {
    (to - from) / (count - 1.0).max(1.0)
}

/// Whether what is left of each coordinate is no less than a step of its grid.
fn resolved(left: &[f64], steps: &[f64]) -> bool {
    left.iter().zip(steps).all(|(left, step)| left >= step)
}

/// The rings that a blow may be; none where it has too few readings of one.
pub(super) fn rings(piece: &Piece, blow: &Blow, rate_hz: f64) -> Known {
    const SHORTEST: f64 = 0.6;
    const PITCHES: [f64; 2] = [0.03, PI - 0.03];
    let longest = LONGER * LONGEST_RING_S * rate_hz / 3.0;
    if longest < 2.0 * SHORTEST {
        return Known { places: vec![] };
    }
    let bounds = [SHORTEST.ln(), longest.ln()];
    let first = (blow.first - piece.all.start) as f64;
    let reach = blow.readings.len() as f64;
    // A half sine that stands out tells little of the time constant and the pitch.
    let (fades, pitch) = match blow.shape {
        Shape::Ring(fades, pitch) => (fades, Some(pitch)),
        Shape::HalfSine(width) => (0.5 * width, None),
    };
    let wide = 1.5 / fades;
    let mut wanted = Rings {
        first: [
            first - 2.0,
            first + (0.25 * reach).clamp(2.0, 4.0).round(),
            0.0,
        ],
        log_fades: [(0.4 * fades).ln(), (2.5 * fades).ln(), 8.0],
        pitch: match pitch {
            Some(p) => [p - wide, p + wide, 11.0],
            None => [PITCHES[0], PITCHES[1].min(4.0 * wide), 16.0],
        },
    };
    wanted.first[2] = wanted.first[1] - wanted.first[0] + 1.0;
    let within = |[from, to, count]: [f64; 3], [low, high]: [f64; 2]| {
        [from.clamp(low, high), to.clamp(low, high), count]
    };
    wanted.log_fades = within(wanted.log_fades, bounds);
    wanted.pitch = within(wanted.pitch, PITCHES);
    let mut known = Known::of(piece, wanted.places(), &blow.felt);
    for grids in 1..MOST_GRIDS {
        let Some((best, _)) = known.best() else { break };
        let log_fades = |p: &Place| coordinates(p).0.ln();
        let pitch = |p: &Place| coordinates(p).1;
        let left = [known.spread(&log_fades), known.spread(&pitch)];
        let steps = [wanted.log_fades, wanted.pitch].map(step);
        if grids >= GRIDS && resolved(&left, &steps) {
            break;
        }
        let spreads = [0, 1].map(|k| left[k].max(0.5 * steps[k]));
        wanted = Rings {
            first: [best.0 - 2.0, best.0 + 2.0, 5.0],
            log_fades: about(log_fades(&best), spreads[0], 11, bounds),
            pitch: about(pitch(&best), spreads[1], 13, PITCHES),
        };
        known = Known::of(piece, wanted.places(), &blow.felt);
    }
    known
}
