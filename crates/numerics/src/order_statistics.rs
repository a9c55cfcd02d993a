//! Order statistics: quantiles, medians and widths.
//!
//! ```
//! use numerics::order_statistics::{median, quantile};
//!
//! let readings = [3.0, 1.0, f64::NAN, 2.0, 100.0, 4.0];
//! assert_eq!(median(&readings), 3.0);
//! assert_eq!(quantile(&readings, 1.0), 100.0);
//! ```

use crate::wide;

/// The 90 % point of the standard normal.
pub const TENTH: f64 = 1.281_552;

/// Standard deviation of normal values by the width between their 10 % and 90 % points: what lies beyond does not move it.
/// 0 of none.
#[must_use]
pub fn robust_sigma(values: &[f64]) -> f64 {
    width(values, 0.1) / (2.0 * TENTH)
}

/// Whether the 10 % and 90 % points of values, all of them finite, lie within `near` of 0; false where that is not plain.
pub fn holds_most(values: &[f64], near: f64) -> bool {
    let beyond = |past: &dyn Fn(f64) -> bool| values.iter().filter(|v| past(**v)).count();
    let last = values.len().saturating_sub(1) as f64;
    let place = |p: f64| (p * last).round() as usize;
    values.iter().all(|v| v.is_finite())
        && beyond(&|v| v < -near) <= place(0.1)
        && beyond(&|v| v > near) < values.len() - place(0.9)
}

/// Width between the `share` and `1 - share` points of the finite values; 0 of none.
#[must_use]
pub fn width(values: &[f64], share: f64) -> f64 {
    let places = |count: usize| {
        let place = |p: f64| (p * (count - 1) as f64).round() as usize;
        [place(share), place(1.0 - share)]
    };
    ordered(values, places).map_or(0.0, |[below, above]| above - below)
}

/// Values beyond which order statistics are found by counting first.
const COUNTED: usize = 2048;

/// The finite values of two places, the lower one first, in their order, ascending; the places are those of so many. `None` of
/// no values.
fn ordered(values: &[f64], places: impl Fn(usize) -> [usize; 2]) -> Option<[f64; 2]> {
    if values.len() > COUNTED {
        let span = Span::of(values);
        if span.high - span.low < f64::MAX {
            return counted(values, places, span);
        }
    }
    let mut v: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    if v.is_empty() {
        return None;
    }
    let [first, second] = places(v.len());
    let (rest, above, _) = v.select_nth_unstable_by(second, f64::total_cmp);
    let above = *above;
    let below = if first < second {
        *rest.select_nth_unstable_by(first, f64::total_cmp).1
    } else {
        above
    };
    Some([below, above])
}

/// Values that a processor looks at at once.
const ABREAST: usize = 8;

/// About the least and the greatest finite value.
#[derive(Clone, Copy)]
struct Span {
    low: f64,
    high: f64,
}

impl Span {
    /// By every sixteenth few values: beyond it lie few, or none.
    fn of(values: &[f64]) -> Self {
        const EVERY: usize = 16;
        let some = values.chunks(ABREAST).step_by(EVERY).flatten();
        let finite = || some.clone().filter(|v| v.is_finite());
        Self {
            low: finite().copied().fold(f64::INFINITY, f64::min),
            high: finite().copied().fold(f64::NEG_INFINITY, f64::max),
        }
    }
}

wide! {
    /// As [`ordered`]: counted in even bins over a span, what lies beyond in the outer ones, and sorted out in the bin of the
    /// place alone.
    fn counted[P: Fn(usize) -> [usize; 2]](values: &[f64], places: P, span: Span) -> Option<[f64; 2]>
    = counted_in_bins
}

/// Bins of a span, what lies beyond in the outer ones.
const BINS: usize = 2048;

/// Even bins over a span.
#[derive(Clone, Copy)]
struct Bins {
    low: f64,
    scale: f64,
}

impl Bins {
    const LAST: f64 = (BINS - 1) as f64;

    #[inline(always)]
    fn of(Span { low, high }: Span) -> Self {
        let scale = if high > low {
            Self::LAST / (high - low)
        } else {
            0.0
        };
        Self { low, scale }
    }

    /// The bin of a value; what is not finite has the one behind all others.
    #[inline(always)]
    fn at(self, v: f64) -> u64 {
        /// 2^52: added to a number, its whole part stands in the last bits.
        const WHOLE: f64 = 4_503_599_627_370_496.0;
        let at = (v - self.low) * self.scale;
        let at = if at > 0.0 { at } else { 0.0 };
        let at = if at < Self::LAST { at } else { Self::LAST };
        let whole = (at + WHOLE).to_bits() - WHOLE.to_bits();
        if v.abs() <= f64::MAX {
            whole
        } else {
            BINS as u64
        }
    }

    #[inline(always)]
    fn of_few(self, few: &[f64; ABREAST]) -> [u64; ABREAST] {
        few.map(|v| self.at(v))
    }

    /// Values in each bin.
    #[inline(always)]
    fn tally(self, values: &[f64]) -> [u32; BINS + 1] {
        /// Tallies in turn: readings come in codes, and to add to a number that was just added to takes its time.
        const TURNS: usize = 4;
        let (many, rest) = values.as_chunks::<ABREAST>();
        let mut tallies = [[0u32; BINS + 1]; TURNS];
        for few in many {
            for (i, b) in self.of_few(few).into_iter().enumerate() {
                tallies[i % TURNS][(b as usize).min(BINS)] += 1;
            }
        }
        let [mut tally, others @ ..] = tallies;
        for v in rest {
            tally[(self.at(*v) as usize).min(BINS)] += 1;
        }
        for other in others {
            tally.iter_mut().zip(other).for_each(|(t, o)| *t += o);
        }
        tally
    }

    /// Least and greatest value in bin `b`.
    #[inline(always)]
    fn extremes(self, values: &[f64], b: u64) -> [f64; 2] {
        let (many, rest) = values.as_chunks::<ABREAST>();
        let [mut least, mut most] = [f64::INFINITY, f64::NEG_INFINITY].map(|v| [v; ABREAST]);
        for few in many {
            let of = self.of_few(few);
            for i in 0..ABREAST {
                let (v, inside) = (few[i], of[i] == b);
                least[i] = if inside & (v < least[i]) { v } else { least[i] };
                most[i] = if inside & (v > most[i]) { v } else { most[i] };
            }
        }
        let inside = || rest.iter().copied().filter(|v| self.at(*v) == b);
        let least = least.into_iter().chain(inside());
        let most = most.into_iter().chain(inside());
        [
            least.fold(f64::INFINITY, f64::min),
            most.fold(f64::NEG_INFINITY, f64::max),
        ]
    }

    /// The values in bin `b`, `count` of them.
    #[inline(always)]
    fn inside(self, values: &[f64], b: u64, count: usize) -> Vec<f64> {
        let (many, rest) = values.as_chunks::<ABREAST>();
        let mut inside = Vec::with_capacity(count);
        for few in many {
            let of = self.of_few(few);
            if of.contains(&b) {
                let here = few.iter().zip(of).filter(|(_, of)| *of == b);
                inside.extend(here.map(|(v, _)| *v));
            }
        }
        inside.extend(rest.iter().filter(|v| self.at(**v) == b));
        inside
    }
}

#[inline(always)]
fn counted_in_bins(
    values: &[f64],
    places: impl Fn(usize) -> [usize; 2],
    span: Span,
) -> Option<[f64; 2]> {
    /// Share of the values from which on a bin is thought to hold one code.
    const CODE: usize = 100;
    let bins = Bins::of(span);
    let tally = bins.tally(values);
    let count = values.len() - tally[BINS] as usize;
    if count == 0 {
        return None;
    }
    let of_place = |place: usize| {
        let (mut b, mut before) = (0, 0);
        while before + tally[b] as usize <= place {
            before += tally[b] as usize;
            b += 1;
        }
        let here = tally[b] as usize;
        let b = b as u64;
        if here > values.len() / CODE {
            let [least, most] = bins.extremes(values, b);
            if least == most {
                return least;
            }
        }
        let mut inside = bins.inside(values, b, here);
        *inside
            .select_nth_unstable_by(place - before, f64::total_cmp)
            .1
    };
    let [first, second] = places(count);
    let value = of_place(first);
    let other = if second == first {
        value
    } else {
        of_place(second)
    };
    Some([value, other])
}

/// The value below which a share of the finite values lies; NaN of none.
#[must_use]
pub fn quantile(values: &[f64], share: f64) -> f64 {
    let mut v: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    if v.is_empty() {
        return f64::NAN;
    }
    let place = (share * (v.len() - 1) as f64).round() as usize;
    *v.select_nth_unstable_by(place, f64::total_cmp).1
}

/// Median of the finite values; NaN of none.
#[must_use]
pub fn median(values: &[f64]) -> f64 {
    let middle = |count: usize| [count / 2; 2];
    ordered(values, middle).map_or(f64::NAN, |[middle, _]| middle)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_by_counting_are_those_by_sorting() {
        let mut v: Vec<f64> = (0..10_000)
            .map(|i| f64::from((i * 7919) % 10_007).powi(2))
            .collect();
        v[17] = f64::NAN;
        v[18] = 1e12;
        // Few codes, and far ones that are seldom.
        let code = |i: i32| f64::from((i * 7919) % 13 - 6 + 4000 * i32::from(i % 3001 == 77));
        let codes: Vec<f64> = (0..10_000).map(code).collect();
        let one = vec![2.5; 10_000];
        for v in [v, codes, one] {
            let mut sorted: Vec<f64> = v.iter().copied().filter(|v| v.is_finite()).collect();
            sorted.sort_by(f64::total_cmp);
            for share in [0.0, 0.01, 0.1, 0.3, 0.5] {
                let at = |p: f64| sorted[(p * (sorted.len() - 1) as f64).round() as usize];
                assert_eq!(width(&v, share), at(1.0 - share) - at(share));
            }
            assert_eq!(median(&v), sorted[sorted.len() / 2]);
        }
    }
}
