//! Converters: where one code ends and the next one begins.

use std::rc::Rc;

use super::super::super::prelude::*;

/// Most that the line of a wavy converter leans: at 1 it would turn back, and codes be missing.
pub(super) const STEEPEST: f64 = 0.9;

/// First code, and the lower edge of each code within a reach of a middle one, counts, by the edge that an even converter has
/// there.
fn about(middle: f64, reach: f64, edge: impl Fn(f64) -> f64) -> (i32, Vec<f64>) {
    let (middle, reach) = (middle.round() as i32, reach.ceil() as i32);
    let codes = middle - reach..=middle + reach;
    (
        middle - reach,
        codes.map(|code| edge(f64::from(code) - 0.5)).collect(),
    )
}

/// The major carry: at mid-scale, which lies near the rate at rest, all bits of the converter turn over, and the largest
/// weighs more than all others together by so many counts, or less: readings on one side are off from those on the other,
/// with codes between that never come, or that come from both sides.
pub(super) fn mid_scale(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let (zero, sign) = (zero_of(draw, stand, axis), draw.sign());
    by_stage(axis, move |size| Stage {
        zero,
        threshold: 0.0,
        inside: 1.0,
        beyond: 1.0,
        from: 0.5 * sign * size,
    })
}

/// Lower edges, counts, of codes about a middle when every other is missing beyond a limit, and three of four beyond twice
/// as much.
pub(super) fn of_growing(middle: i32, limit: i32, reach: i32) -> (i32, Vec<f64>) {
    let mut codes = vec![0];
    let mut last = 0;
    while last < reach {
        last += match last {
            l if l < limit => 1,
            l if l < 2 * limit => 2,
            _ => 4,
        };
        codes.push(last);
        codes.insert(0, -last);
    }
    let first = codes[0];
    let edges = (first..=last)
        .map(|code| {
            // A code that is missing begins where the next one does that is not.
            let next = codes.partition_point(|c| *c < code);
            let below = if next == 0 {
                f64::from(codes[0]) - 1.0
            } else {
                f64::from(codes[next - 1])
            };
            f64::from(middle) + 0.5 * (below + f64::from(codes[next]))
        })
        .collect();
    (middle + first, edges)
}

/// A stage whose output is a straight line of its input on each side of two thresholds and between them, counts.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stage {
    /// Zero rate.
    pub(super) zero: f64,
    /// The thresholds are this far from it.
    pub(super) threshold: f64,
    /// Gain between them.
    pub(super) inside: f64,
    /// Gain beyond.
    pub(super) beyond: f64,
    /// What comes out just beyond them, from zero.
    pub(super) from: f64,
}

impl Stage {
    /// What comes out.
    pub(super) fn of(self, rate: f64) -> f64 {
        let off = rate - self.zero;
        let past = off.abs() - self.threshold;
        self.zero
            + if past < 0.0 {
                self.inside * off
            } else {
                off.signum() * (self.from + self.beyond * past)
            }
    }

    /// The first code and the share of each, of a rate that is normal: piece by piece, what comes to lie between the edges
    /// of a code.
    pub(super) fn law(self, stand: &Stand, axis: usize) -> (i32, Vec<f64>) {
        let (first, even) = law(stand, axis);
        let (mean, sigma) = (stand.bias[axis] / LSB, stand.white(axis).sqrt() / LSB);
        let far = even.len() as f64;
        let (low, high) = (self.zero - self.threshold, self.zero + self.threshold);
        let pieces = [
            (low - 2.0 * far, low, self.beyond),
            (low, high, self.inside),
            (high, high + 2.0 * far, self.beyond),
        ];
        let mut read = vec![0.0; even.len()];
        for (from, to, gain) in pieces {
            let middle = 0.5 * (from + to);
            let comes_out = self.of(middle);
            // The rate at which the piece's line comes to an edge between codes.
            let at = |edge: f64| match gain {
                0.0 if edge > comes_out => to,
                0.0 => from,
                _ => (middle + (edge - comes_out) / gain).clamp(from, to),
            };
            // What is beyond the codes looked at counts to the last of them.
            let inner = (1..even.len()).map(|i| at(f64::from(first) + i as f64 - 0.5));
            let edges: Vec<f64> = [from].into_iter().chain(inner).chain([to]).collect();
            let own = shares(&edges, mean, sigma);
            read.iter_mut().zip(own).for_each(|(r, o)| *r += o);
        }
        (first, read)
    }

    /// What it does to an axis.
    pub(super) fn change(self, axis: usize) -> Change {
        Change::made(move |counts, draw| {
            counts[axis]
                .iter()
                .map(|c| self.of(within_step(*c, draw)).round() as i32)
                .collect()
        })
    }
}

/// Zero rate of a stage, counts: not quite that of the part.
pub(super) fn zero_of(draw: &mut Draw, stand: &Stand, axis: usize) -> f64 {
    let sigma = stand.white(axis).sqrt();
    (stand.bias[axis] + sigma * draw.between(-0.7, 0.7)) / LSB
}

/// Nothing comes out until the rate is so far from zero, counts, and only what is beyond afterwards.
pub(super) fn dead_zone(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let zero = zero_of(draw, stand, axis);
    by_stage(axis, move |size| Stage {
        zero,
        threshold: size,
        inside: 0.0,
        beyond: 1.0,
        from: 0.0,
    })
}

/// A stage that changes its range beyond a rate: the coarse one has an offset from the fine one, counts, and another gain.
pub(super) fn ranges(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let zero = zero_of(draw, stand, axis);
    let threshold = stand.white(axis).sqrt() / LSB * draw.between(0.7, 1.5);
    let (offset, gain) = (draw.sign(), draw.sign() * draw.between(0.02, 0.08));
    by_stage(axis, move |size| Stage {
        zero,
        threshold,
        inside: 1.0,
        beyond: (gain * size).exp(),
        from: threshold * (offset * size / threshold).exp(),
    })
}

/// A converter by successive approximation of which one bit is not what it should be, counts.
#[derive(Clone, Copy, Debug)]
pub(super) struct Weight {
    bit: u32,
    /// The word's code of the zero code, of which only what is below the next bit counts.
    offset: i32,
    sign: f64,
}

impl Weight {
    /// Bits that may be off: the lowest is told by its share of ones alone, as one that sticks.
    const BITS: (u32, u32) = (1, 3);
    /// Most that it may be off, of what it is.
    const MOST: f64 = 0.95;

    pub(super) fn any(draw: &mut Draw) -> Self {
        let bit = Self::BITS.0 + draw.of_many((Self::BITS.1 - Self::BITS.0 + 1) as usize) as u32;
        Self {
            bit,
            offset: draw.of_many(1 << (bit + 1)) as i32,
            sign: draw.sign(),
        }
    }

    /// Lower edges of the codes from the first on, counts. A code whose edge lies above a later one's never comes: the higher
    /// bit is tried first.
    pub(super) fn edges(self, stand: &Stand, axis: usize, off: f64) -> (i32, Vec<f64>) {
        let (first, even) = law(stand, axis);
        let off = self.sign * off.min(Self::MOST * f64::from(1 << self.bit));
        let mut edges: Vec<f64> = (first..=first + even.len() as i32)
            .map(|code| {
                let set = (code + self.offset) >> self.bit & 1;
                f64::from(code) - 0.5 + off * f64::from(set)
            })
            .collect();
        for i in (1..edges.len()).rev() {
            edges[i - 1] = edges[i - 1].min(edges[i]);
        }
        (first, edges)
    }
}

/// A folding converter: its line waves about the straight one, once for each fold.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wave {
    /// Codes of a fold.
    period: f64,
    /// Where it begins, rad.
    first: f64,
}

impl Wave {
    /// Folds of this many sigma of the noise at least, and at most: wider ones are a change of the gain.
    const FOLDS: (f64, f64) = (1.2, 3.0);

    pub(super) fn new(draw: &mut Draw, stand: &Stand, axis: usize) -> Self {
        let (_, sigma) = mean_and_sigma(stand, axis);
        Self {
            period: sigma * draw.by_ratio(Self::FOLDS.0, Self::FOLDS.1),
            first: draw.between(0.0, TAU),
        }
    }

    /// What is read, before it is rounded, of a rate, counts.
    pub(super) fn of(self, lean: f64, rate: f64) -> f64 {
        let turn = TAU / self.period;
        rate + lean.min(STEEPEST) / turn * (turn * rate + self.first).sin()
    }

    /// Lower edges of the codes from the first on, counts.
    pub(super) fn edges(self, stand: &Stand, axis: usize, lean: f64) -> (i32, Vec<f64>) {
        let (first, even) = law(stand, axis);
        let edge = |i: usize| {
            let read = f64::from(first) + i as f64 - 0.5;
            // No farther off than the wave is high; the line rises.
            let (mut low, mut high) = (read - self.period, read + self.period);
            while high - low > 1e-6 {
                let middle = 0.5 * (low + high);
                if self.of(lean, middle) < read {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            low
        };
        (first, (0..=even.len()).map(edge).collect())
    }
}

/// Codes that are missing, one in so many: their readings move up by one.
pub(super) fn missing(draw: &mut Draw, axis: usize) -> Shape {
    let every = [3, 5, 6, 7, 10][draw.of_many(5)];
    let change = Change::made(move |counts, draw| {
        each(&counts[axis], |own| {
            let code = within_step(own, draw).round() as i32;
            code + i32::from(code.rem_euclid(every) == 0)
        })
    });
    Shape::Fixed(Known::Strength(f64::NAN), change)
}

/// A dead band about the middle, of the size of the noise.
pub(super) fn still_band(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let band = stand.white(axis).sqrt() * draw.between(0.5, 1.2);
    let middle = stand.bias[axis];
    let change = Change::made(move |counts, draw| {
        each(&counts[axis], |own| {
            let rate = LSB * within_step(own, draw);
            let still = (rate - middle).abs() < band;
            (if still { middle } else { rate } / LSB).round() as i32
        })
    });
    Shape::Fixed(Known::Strength(f64::NAN), change)
}

/// Sigma either way of the bias within which the edges between codes are drawn.
const REACH: f64 = 7.0;

/// First and last code within that reach of an axis.
fn reach(stand: &Stand, axis: usize) -> (i32, i32) {
    let (bias, sigma) = mean_and_sigma(stand, axis);
    let (first, last) = (bias - REACH * sigma, bias + REACH * sigma);
    (first.floor() as i32, last.ceil() as i32)
}

/// What edges are, held for those of an even converter of the same mean and variance.
fn against_even(stand: &Stand, axis: usize, first: i32, edges: &[f64], even: &[f64]) -> Known {
    let (bias, sigma) = mean_and_sigma(stand, axis);
    Known::Codes {
        first,
        read: shares(edges, bias, sigma),
        held: shares(even, bias, sigma),
    }
}

/// A converter whose steps are not of equal width: each edge between two codes lies off its place by its own amount.
pub(super) fn uneven_steps(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let (first, last) = reach(stand, axis);
    let off: Vec<f64> = (first..=last).map(|_| draw.between(-0.5, 0.5)).collect();
    let edges = move |size: f64| -> Vec<f64> {
        let at = |(i, o): (usize, &f64)| f64::from(first) + i as f64 - 0.5 + size.min(0.98) * o;
        off.iter().enumerate().map(at).collect()
    };
    let known = edges.clone();
    sized(
        0.98,
        move |stand, size| against_even(stand, axis, first, &known(size), &known(0.0)),
        move |_, _, size| Change::edges(axis, first, edges(size)),
    )
}

/// A gain below 1 in fixed point, by which the firmware brings the part to its nominal scale: now and then two codes of the
/// part become one reading, which then comes twice as often as its neighbours. Its strength is what the gain makes it.
pub(super) fn two_in_one(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    // Below that, every other reading would be double: a bit that sticks at times does the same.
    let (gain, offset) = (draw.between(0.72, 0.91), draw.between(-0.5, 0.5));
    let (first, last) = reach(stand, axis);
    // The lowest code of the part that rounds to a reading begins half a code below itself.
    let edge = |reading: i32| {
        let lowest = ((f64::from(reading) - 0.5 - offset) / gain).ceil();
        (lowest - 0.5) * gain + offset
    };
    let edges: Vec<f64> = (first..=last).map(edge).collect();
    let even = even_edges(first, (last - first) as usize);
    let known = against_even(stand, axis, first, &edges, &even);
    Shape::Fixed(known, Change::edges(axis, first, edges))
}

/// Crossover: of two transistors that push and pull, neither leads until the input is a little off zero. Firmware that takes
/// the bias off and then divides whole numbers does the same by half a count: the quotient is cut towards zero. What is
/// left of the bias lies within a sigma of that zero.
pub(super) fn push_pull(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let (bias, sigma) = mean_and_sigma(stand, axis);
    let middle = (bias + draw.between(-1.0, 1.0) * sigma).round();
    edges(axis, move |_, zone| {
        // Two sigma of it would leave few readings but zero.
        let zone = zone.min(2.0 * sigma);
        let edge = |even| even + if even > middle { zone } else { -zone };
        about(middle, 8.0 * sigma, edge)
    })
}

/// A threshold against drift: rates that are small, the bias taken off, read zero, and the others are left as they are.
pub(super) fn dead_band(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let (bias, sigma) = mean_and_sigma(stand, axis);
    let middle = (bias + sigma * draw.between(-0.5, 0.5)).round();
    edges(axis, move |_, wider| {
        let band = 0.5 + wider.min(3.0 * sigma);
        about(middle, 10.0 * sigma, |even| match even - middle {
            off if off < 0.0 => middle + off.min(-band),
            off => middle + off.max(band),
        })
    })
}

/// A push-pull read-out of two electrodes, of which one has the smaller gain: the reading has a kink where the sense of
/// the rate changes, near the middle of the noise.
pub(super) fn two_gains(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let (mean, sigma) = mean_and_sigma(stand, axis);
    let (middle, sign) = (mean + sigma * draw.between(-0.3, 0.3), draw.sign());
    edges(axis, move |_, log_ratio| {
        let gain = (0.5 * sign * log_ratio.min(1.6)).exp();
        about(middle, 20.0 * sigma, |even| match even - middle {
            off if off > 0.0 => middle + off / gain,
            off => middle + off * gain,
        })
    })
}

/// A word of few bits that is a number times a power of two, the bias taken off before: small readings are told to the
/// count, larger ones by twos and by fours. The limit is the largest that makes it as strong as wanted.
pub(super) fn growing_steps(draw: &mut Draw, stand: &Stand, axis: usize, wanted: f64) -> Shape {
    let (mean, sigma) = mean_and_sigma(stand, axis);
    let middle = (mean + sigma * draw.between(-0.5, 0.5)).round() as i32;
    let reach = (8.0 * sigma).ceil() as i32;
    let known = |limit: i32| Known::edges(stand, axis, &of_growing(middle, limit, reach));
    let limit = (1..reach)
        .rev()
        .find(|limit| known(*limit).strength(stand, axis) >= wanted)
        .unwrap_or(1);
    let (first, edges) = of_growing(middle, limit, reach);
    Shape::Fixed(known(limit), Change::edges(axis, first, edges))
}

/// An amplifier that is straight for small rates and bends to a logarithm for large ones, either way, so that they fit into
/// few codes; nobody has bent them back.
pub(super) fn bent(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let (mean, sigma) = mean_and_sigma(stand, axis);
    let middle = mean + sigma * draw.between(-0.3, 0.3);
    edges(axis, move |_, bend| {
        let bend = bend.min(3.0) / sigma;
        about(middle, 10.0 * sigma, |even| {
            middle + (bend * (even - middle)).sinh() / bend
        })
    })
}

/// A converter whose line is wavy.
pub(super) fn wavy(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let wave = Wave::new(draw, stand, axis);
    edges(axis, move |stand, lean| wave.edges(stand, axis, lean))
}

/// A bit of the converter that weighs wrong: one that at the most that it may be off is as strong as wanted, if a few draws have
/// one.
pub(super) fn weighs_wrong(draw: &mut Draw, stand: &Stand, axis: usize, wanted: f64) -> Shape {
    const TRIES: usize = 20;
    let mut weight = Weight::any(draw);
    for _ in 0..TRIES {
        let most = weight.edges(stand, axis, f64::INFINITY);
        if Known::edges(stand, axis, &most).strength(stand, axis) >= wanted {
            break;
        }
        weight = Weight::any(draw);
    }
    edges(axis, move |stand, off| weight.edges(stand, axis, off))
}

/// A stage of a size.
fn by_stage(axis: usize, stage: impl Fn(f64) -> Stage + 'static) -> Shape {
    let stage = Rc::new(stage);
    let known = Rc::clone(&stage);
    sized(
        f64::INFINITY,
        move |stand, size| {
            let (first, read) = known(size).law(stand, axis);
            Known::codes(first, read)
        },
        move |_, _, size| stage(size).change(axis),
    )
}
