//! What a converter does to the codes: nothing, a bit that sticks, or rails, by the likelihood of their histogram.
//!
//! Each fault is fitted with the smooth law ([`super::codes`]) that suits it best. A bit that sticks is told where it
//! describes the codes better than any smooth law and than rails do, and leaves next to nothing of what any shares
//! of the codes could explain: a hole inside the range has no place in rails, a pile on one code none in a bit. What
//! nothing here explains is not passed over ([`Verdict::Unlike`]).

use super::cells::Cells;
use super::codes::{Course, Fault, Fit, Histogram, Laws};
use super::rounded_twice;
use crate::test_level::audit_level;
use numerics::tails;

/// Spreads of a reading that are tried, over what was measured: bits that stick widen it more than they narrow it.
const SPREADS: [f64; 7] = [0.15, 0.23, 0.35, 0.5, 0.7, 0.9, 1.1];
/// Spread, over what noise without the fault has, below which a law has edges of its own: one that narrow is made to hold a
/// code that is never read, or read too often, and no converter's noise.
const NATURAL: f64 = 0.35;
/// A finer step between them, once one is known.
const FINER: f64 = 1.12;
/// Shares of the readings that a search begins with.
const SHARES: [f64; 2] = [0.1, 0.6];
/// Rounds of a first fit, and of a last one.
const FIRST: usize = 48;
const LAST: usize = 320;
/// Bits that are fitted to the end.
const BEST: usize = 2;
/// A bit beyond this many spreads is not looked at.
const WITHIN: f64 = 24.0;

/// Nats by which a bit that sticks has to describe the codes better than sound ones and than rails.
pub(super) const CLEARLY: f64 = 12.0;
/// Cost up to which a smooth law is plain: one of many narrow levels explains almost anything.
const PLAIN: f64 = 8.0;
/// Spreads of a reading about its level from which on the codes' own says that the level moves far.
const MOVES: f64 = 2.0;
/// Nats that a bit has to gain, with the smooth law as it is, to be fitted at all.
const WORTH_A_LOOK: f64 = 5.0;
/// Share that it has to explain of what shares of the codes of their own would.
const NEARLY_ALL: f64 = 0.9;
/// Chance below which a law with a bit that sticks does not hold, and share of what the bit explains that may be left where
/// a long record shows how uneven the steps of any converter are.
const LEAST_CHANCE: f64 = 1e-3;
const LITTLE: f64 = 0.05;
/// Nats, and nats for each reading, that the best law without a bit that sticks has to leave before the codes are told to
/// be unlike any: converters have uneven steps by nature, and a long record shows them.
const UNLIKE: f64 = 20.0;
const UNLIKE_BY_READING: f64 = 1e-3;
/// Least expected occurrences of the codes that are held against a law together.
const LEAST_EXPECTED: f64 = 8.0;

/// A fitted bit.
#[derive(Clone, Debug)]
pub(super) struct Stuck {
    pub bit: u32,
    pub value: u8,
    pub fraction: f64,
    /// Standard error of the fraction.
    pub error: f64,
}

/// What the histogram says.
#[derive(Clone, Debug)]
pub(super) enum Verdict {
    /// A smooth law explains it.
    Smooth,
    /// Rails do, and a smooth law does not.
    Rails,
    /// A bit that sticks does.
    Bit(Stuck),
    /// Two roundings do, in cells whose step, in steps of the codes, has this standard error.
    Twice { cells: Cells, error: f64 },
    /// Nothing here does; `nats` are left over. With the bit that comes nearest, and the cells of two roundings that do.
    Unlike {
        nats: f64,
        nearest: Option<Stuck>,
        twice: Option<Cells>,
    },
}

/// Fits of one fault on their way, at several spreads and from several starts.
struct Tries<'a> {
    of: &'a Histogram,
    fault: Fault,
    by_spread: Vec<(Laws<'a>, Vec<Course>)>,
}

impl<'a> Tries<'a> {
    /// Over the spreads that noise of `sigma` may have.
    fn new(of: &'a Histogram, fault: Fault, sigma: f64) -> Self {
        let mut new = Self::none(of, fault);
        SPREADS.iter().for_each(|s| new.also(s * sigma));
        new
    }

    fn none(of: &'a Histogram, fault: Fault) -> Self {
        let by_spread = vec![];
        Self {
            of,
            fault,
            by_spread,
        }
    }

    /// Those at another spread too.
    fn also(&mut self, spread: f64) {
        if spread <= LEAST_SPREAD {
            return;
        }
        let mut laws = Laws::new(self.of, self.fault, spread);
        let never = |bit: u32, value: i32| self.of.iter().all(|(c, _)| (c >> bit) & 1 == value);
        let courses = match self.fault {
            // What a bit that never changes has taken may be most of the readings: then a fit begins where they came from.
            Fault::Bit { bit, value } if never(bit, value) => {
                let weight = f64::from(1u32 << bit);
                let away = if value == 1 { -weight } else { weight };
                let from = |shift| {
                    laws.shift = shift;
                    laws.begin(None, 1.0, false)
                };
                [0.0, away].map(from).into()
            }
            Fault::Bit { .. } => SHARES.map(|share| laws.begin(None, share, false)).into(),
            Fault::None | Fault::Rails { .. } | Fault::Twice(_) => {
                vec![laws.begin(None, 1.0, false)]
            }
        };
        self.by_spread.push((laws, courses));
    }

    /// Those about a spread, that one included.
    fn around(&mut self, spread: f64) {
        [-1, 0, 1]
            .iter()
            .for_each(|i| self.also(spread * FINER.powi(*i)));
    }

    /// The best of them after so many rounds.
    fn best(&mut self, rounds: usize) -> Option<Fit> {
        let all = self.by_spread.iter_mut();
        all.flat_map(|(laws, courses)| laws.go_on_together(courses, rounds))
            .max_by(|a, b| a.score().total_cmp(&b.score()))
    }
}

/// Least spread, counts: below it a law has edges of its own.
const LEAST_SPREAD: f64 = 0.7;

/// What a law leaves of the histogram: the excess of the chi-square of codes, taken together where few are expected, in
/// nats, and its chance.
fn left_by(h: &Histogram, laws: &Laws<'_>, fit: &Fit) -> (f64, f64) {
    let (mut sum, mut cells) = (0.0, 0usize);
    let (mut seen, mut expected) = (0.0, 0.0);
    for (t, e) in h.times.iter().zip(laws.expected(fit)) {
        seen += t;
        expected += e;
        if expected >= LEAST_EXPECTED {
            sum += (seen - expected).powi(2) / expected;
            cells += 1;
            (seen, expected) = (0.0, 0.0);
        }
    }
    // Mean, spread and the size, at least; more of them would only make it fail sooner.
    let free = cells.saturating_sub(3).max(1) as f64;
    (0.5 * (sum - free), tails::chi_square(sum, free))
}

/// A fit with its bit and the value at which that sticks.
type OfBit = (u32, i32, Fit);

/// Codes, with what is asked of them.
struct Judged {
    h: Histogram,
    /// Spread of a reading about its level.
    sigma: f64,
    /// Bits below this one are looked at.
    bits: u32,
    /// Units a code.
    lsb: f64,
}

impl Judged {
    /// None where the codes tell of nothing.
    fn of(codes: &[i32], sigma: f64, lsb: f64, bits: u32, alarmed: bool) -> Option<Self> {
        const FAR: f64 = 8.0;
        let h = Histogram::new(codes, FAR * sigma)?;
        // Where codes are fewer than once each, no share of any is known. Where the level moves far it is the share of ones
        // about each level that tells.
        let told = h.times.len() as f64 <= h.n && (alarmed || h.spread <= MOVES * sigma);
        told.then_some(Self {
            h,
            sigma,
            bits,
            lsb,
        })
    }

    /// The bits that a spread of readings can show, at both values.
    fn every(&self) -> impl Iterator<Item = (u32, i32)> {
        let near = (0..self.bits).filter(|b| f64::from(1u32 << b) <= WITHIN * self.sigma);
        near.flat_map(|bit| [(bit, 0), (bit, 1)])
    }

    /// Whether a first fit without a fault leaves nothing to look for.
    fn is_plain(&self, first: &Fit) -> bool {
        let laws = Laws::new(&self.h, Fault::None, first.spread);
        let gain = |(bit, value)| laws.gain_of(first, Fault::Bit { bit, value });
        first.cost < PLAIN
            && left_by(&self.h, &laws, first).1 > audit_level()
            && !self.every().any(|b| gain(b) > WORTH_A_LOOK)
    }

    /// The smooth law without a fault, of a spread.
    fn sound(&self, spread: f64) -> Fit {
        Laws::new(&self.h, Fault::None, spread).fit(None, 0.0, true, LAST)
    }

    /// The best law with rails at the ends.
    fn railed(&self) -> Option<(Fault, Fit)> {
        let (low, high) = (self.h.first, self.h.last());
        [(low, i32::MAX), (i32::MIN, high), (low, high)]
            .into_iter()
            .filter_map(|(low, high)| {
                let fault = Fault::Rails { low, high };
                let fit = Tries::new(&self.h, fault, self.sigma).best(LAST)?;
                Some((fault, fit))
            })
            .max_by(|a, b| a.1.score().total_cmp(&b.1.score()))
    }

    /// The bit that describes the codes best.
    fn nearest(&self) -> Option<OfBit> {
        let mut all: Vec<(u32, i32, Fit, Tries<'_>)> = (self.every())
            .filter_map(|(bit, value)| {
                let mut tries = Tries::new(&self.h, Fault::Bit { bit, value }, self.sigma);
                Some((bit, value, tries.best(FIRST)?, tries))
            })
            .collect();
        all.sort_by(|a, b| b.2.score().total_cmp(&a.2.score()));
        all.truncate(BEST);
        all.into_iter()
            .filter_map(|(bit, value, fit, mut tries)| {
                // A bit that folds most of the readings over is far from where a fit begins: with few rounds another
                // spread may look best than with many, and all go on.
                tries.around(fit.spread);
                Some((bit, value, tries.best(LAST)?))
            })
            .max_by(|a, b| a.2.score().total_cmp(&b.2.score()))
    }

    /// The same law, or a wider one: what only a law with edges of its own explains is not explained.
    fn without_edges(&self, fault: Fault, fit: Fit) -> (Fault, Fit) {
        if fit.spread >= NATURAL * self.sigma {
            return (fault, fit);
        }
        let wide = SPREADS.iter().filter(|s| **s >= NATURAL);
        wide.map(|s| (Fault::None, self.sound(s * self.sigma)))
            .max_by(|a, b| a.1.score().total_cmp(&b.1.score()))
            .unwrap_or((fault, fit))
    }

    /// The bit, and whether it holds: of a natural width, with next to nothing left beside it, by scores of the smooth law
    /// and of shares of the codes of their own.
    fn stuck(&self, (bit, value, fit): &OfBit, smooth: f64) -> (Stuck, bool) {
        let laws = Laws::new(
            &self.h,
            Fault::Bit {
                bit: *bit,
                value: *value,
            },
            fit.spread,
        );
        let stuck = Stuck {
            bit: *bit,
            value: u8::from(*value == 1),
            fraction: fit.share,
            error: laws.share_error(fit),
        };
        let (rest, chance) = left_by(&self.h, &laws, fit);
        // A bit adds at most a quarter of its square to the variance.
        let without_bit =
            (self.sigma * self.sigma - 0.25 * f64::from(1u32 << bit).powi(2)).max(0.0);
        let natural = fit.spread >= NATURAL * without_bit.sqrt();
        let holds = natural && self.is_whole(rest, chance, fit.score(), smooth);
        (stuck, holds)
    }

    /// Whether a law leaves next to nothing: the excess of its chi-square in nats and the chance of that, by its score, that of the
    /// smooth law and that of shares of the codes of their own.
    fn is_whole(&self, rest: f64, chance: f64, score: f64, smooth: f64) -> bool {
        let ahead = score - smooth;
        (chance > LEAST_CHANCE || rest < LITTLE * ahead)
            && ahead >= NEARLY_ALL * (self.h.of_its_own() - smooth)
    }

    /// Cells of two roundings, where a law in them is ahead of the smooth score and of others that have no edges of their own, the
    /// standard error of their step, and whether the law holds.
    fn twice(&self, smooth: f64, others: &[Option<&Fit>]) -> Option<(Cells, f64, bool)> {
        let (cells, error) = rounded_twice::cells(&self.h, self.sigma, self.lsb)?;
        let fault = Fault::Twice(cells);
        let mut tries = Tries::none(&self.h, fault);
        let natural = SPREADS.iter().filter(|s| **s >= NATURAL);
        natural.for_each(|s| tries.also(s * self.sigma));
        let fit = tries.best(LAST)?;
        let (rest, chance) = left_by(&self.h, &Laws::new(&self.h, fault, fit.spread), &fit);
        let holds = self.is_whole(rest, chance, fit.score(), smooth);
        let is_natural = |f: &&Fit| f.spread >= NATURAL * self.sigma;
        let others = others.iter().copied().flatten().filter(is_natural);
        let most = others.map(Fit::score).fold(f64::NEG_INFINITY, f64::max);
        (fit.score() > most + CLEARLY).then_some((cells, error, holds))
    }
}

/// Judge codes of `lsb` units with the spread `sigma` about their level, bits below `bits`; `alarmed` where something else has
/// shown already that they are no law.
pub(super) fn judge(codes: &[i32], sigma: f64, lsb: f64, bits: u32, alarmed: bool) -> Verdict {
    let Some(of) = Judged::of(codes, sigma, lsb, bits, alarmed) else {
        return Verdict::Smooth;
    };
    let Some(first) = Tries::new(&of.h, Fault::None, sigma).best(FIRST) else {
        return Verdict::Smooth;
    };
    if !alarmed && of.is_plain(&first) {
        return Verdict::Smooth;
    }
    let mut finer = Tries::none(&of.h, Fault::None);
    finer.around(first.spread);
    let plain = finer.best(LAST).unwrap_or(first);
    let smooth = plain.score();
    let railed = of.railed();
    let rails = railed
        .as_ref()
        .map_or(f64::NEG_INFINITY, |(_, fit)| fit.score());
    let nearest = of.nearest();
    let others = [
        Some(&plain),
        railed.as_ref().map(|(_, fit)| fit),
        nearest.as_ref().map(|(_, _, fit)| fit),
    ];
    let twice = of.twice(smooth, &others);
    if let Some((cells, error, true)) = twice {
        return Verdict::Twice { cells, error };
    }
    let twice = twice.map(|(cells, ..)| cells);
    let (fault, sound) = railed
        .filter(|(_, fit)| fit.score() > smooth)
        .unwrap_or((Fault::None, plain));
    let (fault, sound) = of.without_edges(fault, sound);
    let laws = Laws::new(&of.h, fault, sound.spread);
    let (over, chance) = left_by(&of.h, &laws, &sound);
    let unlike = chance < audit_level() && over > UNLIKE.max(UNLIKE_BY_READING * of.h.n);
    let without = |nearest| {
        if unlike {
            Verdict::Unlike {
                nats: over,
                nearest,
                twice,
            }
        } else if rails > smooth + CLEARLY {
            Verdict::Rails
        } else {
            Verdict::Smooth
        }
    };
    let Some(nearest) = nearest else {
        return without(None);
    };
    let fit = &nearest.2;
    // At the same spread too, so that it is the edges that decide and not how many levels a law needs.
    let gain =
        (fit.score() - smooth.max(rails)).min(fit.likelihood - of.sound(fit.spread).likelihood);
    let (stuck, holds) = of.stuck(&nearest, smooth);
    if gain > CLEARLY && holds {
        Verdict::Bit(stuck)
    } else {
        without((gain > CLEARLY).then_some(stuck))
    }
}
