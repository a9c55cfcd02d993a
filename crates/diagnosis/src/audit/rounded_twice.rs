//! Codes of readings that were rounded before, to other steps: a sensor's that a file holds with few digits.
//!
//! A reading x becomes the sensor's code m, and m the file's, c = round(a m + b), with the sensor's step a and its offset b
//! in steps of the file. All x of one m have one c, so that the cell of c, which would be [c - 1/2, c + 1/2), ends
//! where cells of m end: it is 0, 1 or more sensor steps wide. Under a law that is smooth over a step, the share of a code is the
//! density there times the width of its cell. Step and offset are those of the highest likelihood of the histogram, sought on
//! a grid over the codes that are read most, and followed as more of them are added: over many codes a step has to be right to a
//! part in as many.

use super::cells::{Cells, Decimal};
use super::codes::Histogram;
use model::effects::double_rounding::Halves;
use numerics::tails::TWO_SIDED;

/// Sensor steps in those of the file that are sought. Below, cells of three steps and more are nearly as wide, and other faults do
/// as much; beyond, the codes that are read lie apart, on a grid of their own.
const STEPS: [f64; 2] = [0.4, 3.2];
/// Most codes of the first search.
const FIRST: usize = 256;
/// Points of its grid: in the resolution of a pitch over so many codes, and in a sensor step.
const BY_RESOLUTION: f64 = 4.0;
const PHASES: usize = 32;
/// Candidates that are followed over those codes, and over all.
const FOLLOWED: [usize; 2] = [24, 4];
/// Spread of the weights of which the density is a mean, in spreads of a reading: cells of up to its pitch are evened out.
const EVENED: f64 = 0.7;
/// Times that what is left is evened too.
const AGAIN: usize = 2;
/// Width of a cell that holds no sensor step, in the file's: on the grid, and in the end, where a reading there costs ln 1000 nats.
const NO_WIDTH: [f64; 2] = [0.1, 1e-3];
/// Rounds of the search about a place, each of so many places to either side and so much finer.
const ROUNDS: usize = 4;
const SIDE: i32 = 16;
const FINER: f64 = 0.4;
/// Largest denominator of steps that have codes half-way throughout: 7 / 8 of a data sheet's 8.75 mdeg/s in hundredths is one.
const DENOMINATOR: u32 = 40;
/// Nats that such a step has to be ahead: the logarithm of their number, 700, and of the ways to round halves.
const AHEAD: f64 = 8.2;
/// Nats that two roundings have to gain at least. Of 200 histograms of one rounding none gains it, and two roundings
/// that do come back with their step (tests below).
const LEAST: f64 = 45.0;
/// Nats that cells tell so many codes apart from the one that tells most: a third of what two roundings have to.
const ELSEWHERE: f64 = 15.0;
const APART: f64 = 4.0;
/// Nats below the best at which a step is at the end of its 95 % interval: half the quantile of chi-square, one degree.
const INTERVAL: f64 = 1.92;
/// Steps to either side that are tried for its ends, out to so many resolutions of a pitch over the codes, and offsets of each.
const PLACES: i32 = 50;
const PITCHES: f64 = 1.0;
/// Parts of the way to cells in whose middle the codes are read, and nats below the best that describe them as well.
const PARTS: u32 = 20;
const AS_WELL: f64 = 0.5;

/// Codes in a row, from `first` on: how often each occurs, and how often where all cells are alike.
struct Codes<'a> {
    first: f64,
    times: &'a [f64],
    even: &'a [f64],
    n: f64,
    /// Width of a cell without a sensor step.
    no_width: f64,
}

impl Codes<'_> {
    /// Log likelihood of the codes with these cells over that of one rounding.
    fn gain(&self, cells: Cells) -> f64 {
        let (mut sum, mut expected, mut all) = (0.0, 0.0, 0.0);
        let mut begin = cells.begin(self.first);
        let mut code = self.first;
        for (times, even) in self.times.iter().zip(self.even) {
            code += 1.0;
            let end = cells.begin(code);
            let width = (end - begin).max(self.no_width);
            sum += if *times > 0.0 {
                times * width.ln()
            } else {
                0.0
            };
            expected += even * width;
            all += even;
            begin = end;
        }
        sum - self.n * (expected / all).ln()
    }

    /// Whether cells of another width than most readings have tell of themselves in more than one place: a dead zone, or one code
    /// that is never sent, is in one.
    fn tells_in_places(&self, cells: Cells) -> bool {
        let all: f64 = self.even.iter().sum();
        let width = |code: f64| cells.begin(code + 1.0) - cells.begin(code);
        let codes = || (0..self.times.len()).map(|i| self.first + i as f64);
        // Of the two widths that there are, by half a sensor step.
        let narrow = cells.step * ((1.0 / cells.step).floor() + 0.5);
        let wide = codes()
            .zip(self.times)
            .filter(|(code, _)| width(*code) > narrow);
        let is_wide = 2.0 * wide.map(|(_, times)| times).sum::<f64>() > self.n;
        let gain = |times: f64, even: f64, width: f64| {
            times * width.max(self.no_width).ln() - even * self.n / all * (width - 1.0)
        };
        let each = codes().zip(self.times.iter().zip(self.even));
        let told: Vec<(f64, f64)> = each
            .map(|(code, (times, even))| (code, width(code), times, even))
            .filter(|(_, width, ..)| (*width > narrow) != is_wide)
            .map(|(code, width, times, even)| (code, gain(*times, *even, width)))
            .collect();
        let most = told.iter().max_by(|a, b| a.1.total_cmp(&b.1));
        most.is_some_and(|(at, _)| {
            let apart = told.iter().filter(|(code, _)| (code - at).abs() >= APART);
            apart.map(|(_, gain)| gain).sum::<f64>() > ELSEWHERE
        })
    }
}

/// The density of codes: their means under a bell of a spread, and the means of what those leave, which take the bell's own width
/// off again (twicing; Tukey 1977, section 16).
fn evened(times: &[f64], spread: f64) -> Vec<f64> {
    let reach = (4.0 * spread).ceil() as usize;
    let bell: Vec<f64> = (0..=reach)
        .map(|k| (-0.5 * (k as f64 / spread).powi(2)).exp())
        .collect();
    let all = 2.0 * bell.iter().sum::<f64>() - bell[0];
    let means = |x: &[f64]| -> Vec<f64> {
        let at = |i: usize| {
            let near = i.saturating_sub(reach)..x.len().min(i + reach + 1);
            near.map(|j| x[j] * bell[i.abs_diff(j)]).sum::<f64>() / all
        };
        (0..x.len()).map(at).collect()
    };
    let first = means(times);
    let mut density = first.clone();
    for _ in 0..AGAIN {
        let left: Vec<f64> = times.iter().zip(&density).map(|(t, d)| t - d).collect();
        density
            .iter_mut()
            .zip(means(&left))
            .for_each(|(d, m)| *d += m);
    }
    // Where few are read the bell alone is as good, and never below 0.
    let floor = first.iter().map(|f| 0.1 * f);
    density.iter().zip(floor).map(|(d, f)| d.max(f)).collect()
}

/// A place in the search: what it gains, sensor steps in a step of the file, and the part of a sensor step by which the offset is
/// off the middle code.
type Place = (f64, f64, f64);

/// The two roundings that describe a histogram best, of readings with the spread `sigma` about their level and so many units a code,
/// and the standard error of the step; none where one rounding does nearly as well.
pub(super) fn cells(h: &Histogram, sigma: f64, lsb: f64) -> Option<(Cells, f64)> {
    let even = evened(&h.times, EVENED * sigma);
    let (mut from, mut to) = most(&h.times, FIRST.min(h.times.len()));
    // Places are held against this code throughout, so that codes that are added turn no step about a far one.
    let middle = f64::from(h.first) + ((from + to) / 2) as f64;
    let window = |from: usize, to: usize, no_width: f64| Codes {
        first: f64::from(h.first) + from as f64 - middle,
        times: &h.times[from..to],
        even: &even[from..to],
        n: h.times[from..to].iter().sum(),
        no_width,
    };
    let mut places = grid(&window(from, to, NO_WIDTH[0]));
    let (mut apart, mut aside) = (
        2.0 / BY_RESOLUTION / (to - from) as f64,
        2.0 / PHASES as f64,
    );
    loop {
        let codes = window(from, to, NO_WIDTH[1]);
        let all = places.iter();
        places = all.map(|p| refined(&codes, *p, apart, aside)).collect();
        places.sort_by(|a, b| b.0.total_cmp(&a.0));
        places.truncate(FOLLOWED[1]);
        if to - from == h.times.len() {
            break;
        }
        let half = (to - from) / 2;
        (apart, aside) = (0.5 / (to - from) as f64, 0.1);
        (from, to) = (from.saturating_sub(half), (to + half).min(h.times.len()));
    }
    let codes = window(0, h.times.len(), NO_WIDTH[1]);
    let best = places.into_iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    let near = centered(&codes, of(best));
    let found = near.from(-middle);
    let absolute = Codes {
        first: f64::from(h.first),
        ..codes
    };
    let halves = halves(&absolute, (1.0 / lsb).round());
    let ahead = |cells: &Cells| absolute.gain(*cells) > best.0 + AHEAD;
    let cells = halves.filter(ahead).unwrap_or(found);
    let holds = absolute.gain(cells) > LEAST && absolute.tells_in_places(cells);
    // What the arithmetic of the file would add to that is known for a few steps alone.
    holds.then(|| (cells, error(&codes, near)))
}

/// Of the cells that describe the codes as well, those in whose middle the codes are read: the second rounding moves neither mean nor
/// spread of the readings.
fn centered(codes: &Codes<'_>, cells: Cells) -> Cells {
    let gain = codes.gain(cells);
    // Least squares of the codes on the middles of their cells.
    let places = || (0..codes.times.len()).map(|i| codes.first + i as f64);
    let middle = |code: f64| 0.5 * (cells.begin(code) + cells.begin(code + 1.0));
    let mean = |of: &dyn Fn(f64) -> f64| {
        let all = codes.times.iter().zip(places());
        all.map(|(times, code)| times * of(code)).sum::<f64>() / codes.n
    };
    let (code, center) = (mean(&|c| c), mean(&middle));
    let slope =
        mean(&|c| (c - code) * (middle(c) - center)) / mean(&|c| (middle(c) - center).powi(2));
    let moved = |part: f64| {
        let slope = 1.0 + part * (slope - 1.0);
        let to = center + part * (code - center);
        Cells {
            step: slope * cells.step,
            offset: to + slope * (cells.offset - center),
            ..cells
        }
    };
    let all = (0..=PARTS)
        .rev()
        .map(|k| moved(f64::from(k) / f64::from(PARTS)));
    let mut well = all.filter(|c| codes.gain(*c) > gain - AS_WELL);
    well.next().unwrap_or(cells)
}

/// The best of the steps that have codes half-way, of so many codes in a unit, the zeros of sensor and file being one.
fn halves(codes: &Codes<'_>, in_unit: f64) -> Option<Cells> {
    let [least, most] = STEPS.map(|s| (s * f64::from(DENOMINATOR)) as u32);
    let within = |p: u32, q: u32| (least * q..=most * q).contains(&(p * DENOMINATOR));
    // Odd over even.
    let steps = (2..=DENOMINATOR).step_by(2).flat_map(|q| {
        let odd = (1..most * q).step_by(2).filter(move |p| within(*p, q));
        odd.map(move |p| [p, q].map(f64::from))
    });
    let all = steps.flat_map(|[p, q]| {
        Halves::ALL.map(|halves| Cells {
            step: p / q,
            offset: 0.0,
            decimal: Some(Decimal {
                step: p / (q * in_unit),
                in_unit,
                halves,
            }),
        })
    });
    all.max_by(|a, b| codes.gain(*a).total_cmp(&codes.gain(*b)))
}

/// Where so many codes in a row are read most.
fn most(times: &[f64], codes: usize) -> (usize, usize) {
    let mut now: f64 = times[..codes].iter().sum();
    let (mut best, mut at) = (now, 0);
    for from in 1..=times.len() - codes {
        now += times[from + codes - 1] - times[from - 1];
        if now > best {
            (best, at) = (now, from);
        }
    }
    (at, at + codes)
}

fn of((_, turns, place): Place) -> Cells {
    let step = 1.0 / turns;
    Cells {
        step,
        offset: place * step,
        decimal: None,
    }
}

fn at(codes: &Codes<'_>, turns: f64, place: f64) -> Place {
    (codes.gain(of((0.0, turns, place))), turns, place)
}

/// The best places on a grid over all steps and offsets, no two at neighbouring steps.
fn grid(codes: &Codes<'_>) -> Vec<Place> {
    let apart = 1.0 / BY_RESOLUTION / codes.times.len() as f64;
    let [most, least] = STEPS.map(f64::recip);
    let count = ((most - least) / apart) as usize;
    let phase = |j: usize| j as f64 / PHASES as f64 - 0.5;
    let of_turns = |i: usize| {
        let turns = least + apart * i as f64;
        let all = (0..PHASES).map(|j| at(codes, turns, phase(j)));
        all.max_by(|a, b| a.0.total_cmp(&b.0))
    };
    let all: Vec<Place> = (0..=count).filter_map(of_turns).collect();
    let top = |i: &usize| {
        let near = i.saturating_sub(1)..all.len().min(i + 2);
        all[near].iter().all(|p| p.0 <= all[*i].0)
    };
    let mut tops: Vec<Place> = (0..all.len()).filter(top).map(|i| all[i]).collect();
    tops.sort_by(|a, b| b.0.total_cmp(&a.0));
    tops.truncate(FOLLOWED[0]);
    tops
}

/// The best place about one.
fn refined(codes: &Codes<'_>, from: Place, mut apart: f64, mut aside: f64) -> Place {
    let mut best = at(codes, from.1, from.2);
    (apart, aside) = (apart / f64::from(SIDE), aside / f64::from(SIDE));
    for _ in 0..ROUNDS {
        let (_, turns, place) = best;
        for i in -SIDE..=SIDE {
            for j in -SIDE..=SIDE {
                let near = at(
                    codes,
                    turns + apart * f64::from(i),
                    place + aside * f64::from(j),
                );
                if near.0 > best.0 {
                    best = near;
                }
            }
        }
        (apart, aside) = (apart * FINER, aside * FINER);
    }
    best
}

/// Standard error of the step, by the farthest step that describes the codes nearly as well with an offset of its own: between those
/// that do may lie some that do not.
fn error(codes: &Codes<'_>, cells: Cells) -> f64 {
    let best = codes.gain(cells);
    let turns = 1.0 / cells.step;
    let place = cells.offset * turns;
    let offset = |j: i32| 0.5 * f64::from(j) / f64::from(PLACES);
    let nearly = |turns: f64| {
        let mut places = (-PLACES..=PLACES).map(|j| place + offset(j));
        places.any(|p| at(codes, turns, p).0 > best - INTERVAL)
    };
    let apart = PITCHES / codes.times.len() as f64 / f64::from(PLACES);
    let farthest = (1..=PLACES).rev().find(|k| {
        let by = apart * f64::from(*k);
        nearly(turns - by) || nearly(turns + by)
    });
    apart * f64::from(farthest.unwrap_or(1)) / TWO_SIDED * cells.step.powi(2)
}

#[cfg(test)]
mod tests {
    use rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    fn histogram(step: f64, offset: f64, level: f64, sigma: f64, seed: u64) -> Histogram {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let codes: Vec<i32> = (0..6000)
            .map(|_| {
                let z: f64 = StandardNormal.sample(&mut rng);
                let first = ((level + sigma * z - offset) / step).round();
                (first * step + offset).round_ties_even() as i32
            })
            .collect();
        Histogram::new(&codes, 8.0 * sigma).expect("codes")
    }

    fn gain(h: &Histogram, cells: Cells, sigma: f64) -> f64 {
        let codes = Codes {
            first: f64::from(h.first),
            times: &h.times,
            even: &evened(&h.times, EVENED * sigma),
            n: h.n,
            no_width: NO_WIDTH[1],
        };
        codes.gain(cells)
    }

    #[test]
    fn step_and_offset_of_the_first_rounding_come_back() {
        let mut seed = 0;
        for step in [
            0.437_5,
            0.610_1,
            0.763_4,
            0.875,
            1.221,
            4.0 / 3.0,
            1.75,
            2.3,
        ] {
            for (offset, level) in [(0.0, 3.0), (0.0, -871.0), (0.31 * step, 40.0)] {
                seed += 1;
                let h = histogram(step, offset, level, 6.0, seed);
                let (cells, error) = cells(&h, 6.0, 0.01).expect("two roundings");
                let off = (cells.step - step).abs();
                assert!(
                    off < 4.0 * error && off < 0.02 * step && error < 0.02 * step,
                    "{step}: {cells:?} +- {error}"
                );
                let truth = Cells {
                    step,
                    offset,
                    decimal: None,
                };
                // As many nats as the offsets that were sought make by chance.
                assert!(
                    gain(&h, cells, 6.0) > gain(&h, truth, 6.0) - 8.0,
                    "{cells:?}"
                );
            }
        }
    }

    #[test]
    fn a_code_that_takes_two_and_one_that_is_never_sent_are_no_second_rounding() {
        for seed in 0..20 {
            let mut h = histogram(1.0, 0.0, 7.3, 5.0, seed);
            let at = (9 - h.first) as usize;
            if seed % 2 == 0 {
                h.times[at] += h.times[at - 1];
            }
            h.times[at - 1] = 0.0;
            let found = cells(&h, 5.0, 0.01);
            assert!(found.is_none(), "{seed}: {found:?}");
        }
    }

    #[test]
    fn one_rounding_has_no_cells_of_another() {
        let none = (0..200)
            .filter(|seed| cells(&histogram(1.0, 0.0, 7.3, 5.0, *seed), 5.0, 0.01).is_none());
        assert_eq!(none.count(), 200);
    }
}
