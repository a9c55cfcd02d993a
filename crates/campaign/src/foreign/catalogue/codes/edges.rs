//! Converters: where one code ends and the next one begins.

use super::super::super::prelude::*;

/// Most that the line of a wavy converter leans: at 1 it would turn back, and codes be missing.
const STEEPEST: f64 = 0.9;

/// Sigma either way of the bias within which the edges between codes are drawn.
const REACH: f64 = 7.0;

/// Zero rate of a stage, counts: not quite that of the part.
fn zero_of(draw: &mut Draw, stand: &Stand, axis: usize) -> f64 {
    let sigma = stand.white(axis).sqrt();
    (stand.bias[axis] + sigma * draw.between(-0.7, 0.7)) / LSB
}

/// The code of such a zero: one that comes often.
pub(super) fn zero_code(draw: &mut Draw, stand: &Stand, axis: usize) -> i32 {
    zero_of(draw, stand, axis).round() as i32
}

/// First code, and the lower edge of each code within a reach of a middle one, counts, by the edge that an even converter has
/// there.
fn about(middle: f64, reach: f64, edge: impl Fn(f64) -> f64) -> (i32, Vec<f64>) {
    let (middle, reach) = (middle.round() as i32, reach.ceil() as i32);
    let even = even_edges(middle - reach, 2 * reach as usize);
    (middle - reach, each(&even, edge))
}

/// A stage whose output is a straight line of its input on each side of two thresholds and between them, counts.
#[derive(Clone, Copy)]
struct Stage {
    /// Zero rate.
    zero: f64,
    /// The thresholds are this far from it.
    threshold: f64,
    /// Gain between them.
    inside: f64,
    /// Gain beyond.
    beyond: f64,
    /// What comes out just beyond them, from zero.
    from: f64,
}

impl Stage {
    /// One that changes nothing.
    fn straight(zero: f64) -> Self {
        Self {
            zero,
            threshold: 0.0,
            inside: 1.0,
            beyond: 1.0,
            from: 0.0,
        }
    }

    /// What comes out.
    fn of(self, rate: f64) -> f64 {
        let off = rate - self.zero;
        let past = off.abs() - self.threshold;
        if past < 0.0 {
            self.zero + self.inside * off
        } else {
            self.zero + off.signum() * (self.from + self.beyond * past)
        }
    }

    /// The law of the codes, of a rate that is normal: piece by piece, what comes to lie between the edges of a code.
    fn law(self, stand: &Stand, axis: usize) -> Law {
        let even = law(stand, axis);
        let (mean, sigma) = mean_and_sigma_read(stand, axis);
        let codes = even.shares.len();
        let far = 2.0 * codes as f64;
        let (low, high) = (self.zero - self.threshold, self.zero + self.threshold);
        let mut read = vec![0.0; codes];
        for (from, to, gain) in [
            (low - far, low, self.beyond),
            (low, high, self.inside),
            (high, high + far, self.beyond),
        ] {
            let middle = 0.5 * (from + to);
            let comes_out = self.of(middle);
            // The rate at which the piece's line comes to an edge between codes.
            let at = |edge: f64| match gain {
                0.0 if edge > comes_out => to,
                0.0 => from,
                _ => (middle + (edge - comes_out) / gain).clamp(from, to),
            };
            // What is beyond the codes looked at counts to the last of them.
            let mut edges = each(&even_edges(even.first, codes), at);
            (edges[0], edges[codes]) = (from, to);
            add_at(&mut read, 0, shares(&edges, mean, sigma));
        }
        even.with(read)
    }
}

/// A stage of a size.
fn by_stage(axis: usize, stage: impl Fn(f64) -> Stage + Copy + 'static) -> Shape {
    sized(
        f64::INFINITY,
        move |stand, size| Known::codes(stage(size).law(stand, axis)),
        move |_, _, size| {
            let stage = stage(size);
            Change::reread(axis, move |rate| stage.of(rate).round() as i32)
        },
    )
}

/// The major carry: at mid-scale, which lies near the rate at rest, all bits of the converter turn over, and the largest
/// weighs more than all others together by so many counts, or less: readings on one side are off from those on the other,
/// with codes between that never come, or that come from both sides.
pub(super) fn mid_scale(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let (zero, sign) = (zero_of(draw, stand, axis), draw.sign());
    by_stage(axis, move |size| Stage {
        from: 0.5 * sign * size,
        ..Stage::straight(zero)
    })
}

/// Nothing comes out until the rate is so far from zero, counts, and only what is beyond afterwards.
pub(super) fn dead_zone(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let zero = zero_of(draw, stand, axis);
    by_stage(axis, move |size| Stage {
        threshold: size,
        inside: 0.0,
        ..Stage::straight(zero)
    })
}

/// A stage that changes its range beyond a rate: the coarse one has an offset from the fine one, counts, and another gain.
pub(super) fn ranges(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let zero = zero_of(draw, stand, axis);
    let threshold = stand.white(axis).sqrt() / LSB * draw.between(0.7, 1.5);
    let (offset, gain) = (draw.sign(), draw.signed(0.02, 0.08));
    by_stage(axis, move |size| Stage {
        threshold,
        beyond: (gain * size).exp(),
        from: threshold * (offset * size / threshold).exp(),
        ..Stage::straight(zero)
    })
}

/// A converter by successive approximation of which one bit is not what it should be, counts.
#[derive(Clone, Copy)]
struct Weight {
    bit: u32,
    /// The word's code of the zero code, of which only what is below the next bit counts.
    offset: i32,
    sign: f64,
}

impl Weight {
    /// Bits that may be off: the lowest is told by its share of ones alone, as one that sticks.
    const BITS: [u32; 3] = [1, 2, 3];
    /// Most that it may be off, of what it is.
    const MOST: f64 = 0.95;

    fn any(draw: &mut Draw) -> Self {
        let bit = draw.one_of(&Self::BITS);
        let offset = draw.of_many(1 << (bit + 1)) as i32;
        let sign = draw.sign();
        Self { bit, offset, sign }
    }

    /// Lower edges of the codes from the first on, counts. A code whose edge lies above a later one's never comes: the higher
    /// bit is tried first.
    fn edges(self, stand: &Stand, axis: usize, off: f64) -> (i32, Vec<f64>) {
        let even = law(stand, axis);
        let off = self.sign * off.min(Self::MOST * f64::from(1 << self.bit));
        let mut edges: Vec<f64> = (even.first..=even.first + even.shares.len() as i32)
            .map(|code| {
                let set = (code + self.offset) >> self.bit & 1;
                f64::from(code) - 0.5 + off * f64::from(set)
            })
            .collect();
        for i in (1..edges.len()).rev() {
            edges[i - 1] = edges[i - 1].min(edges[i]);
        }
        (even.first, edges)
    }
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
    let at = move |stand: &Stand, off: f64| weight.edges(stand, axis, off);
    edges(axis, f64::INFINITY, at)
}

/// A folding converter: its line waves about the straight one, once for each fold. Folds are of 1.2 sigma of the noise to 3:
/// wider ones are a change of the gain.
pub(super) fn wavy(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let (_, sigma) = mean_and_sigma(stand, axis);
    let (period, first) = (sigma * draw.by_ratio(1.2, 3.0), draw.phase());
    let turn = TAU / period;
    // What is read, before it is rounded, of a rate, counts.
    let wave = move |lean: f64, rate: f64| rate + lean / turn * (turn * rate + first).sin();
    edges(axis, STEEPEST, move |stand, lean| {
        let even = law(stand, axis);
        // No farther off than the wave is high; the line rises.
        let edge = |read: f64| {
            let reach = (read - period, read + period);
            last_of(reach, 1e-6, |rate| wave(lean, rate) < read)
        };
        let edges = even_edges(even.first, even.shares.len());
        (even.first, each(&edges, edge))
    })
}

/// Codes that are missing, one in so many: their readings move up by one.
pub(super) fn missing(draw: &mut Draw, axis: usize) -> Shape {
    let every = draw.one_of(&[3, 5, 6, 7, 10]);
    let change = Change::reread(axis, move |rate| {
        let code = rate.round() as i32;
        code + i32::from(code.rem_euclid(every) == 0)
    });
    Shape::Fixed(Known::Strength(f64::NAN), change)
}

/// A dead band about the middle, of the size of the noise.
pub(super) fn still_band(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let band = stand.white(axis).sqrt() * draw.between(0.5, 1.2);
    let middle = stand.bias[axis];
    let change = Change::reread(axis, move |rate| {
        let rate = LSB * rate;
        let still = (rate - middle).abs() < band;
        let read = if still { middle } else { rate };
        (read / LSB).round() as i32
    });
    Shape::Fixed(Known::Strength(f64::NAN), change)
}

/// First and last code within that reach of an axis.
fn reach(stand: &Stand, axis: usize) -> (i32, i32) {
    let (bias, sigma) = mean_and_sigma(stand, axis);
    let (first, last) = (bias - REACH * sigma, bias + REACH * sigma);
    (first.floor() as i32, last.ceil() as i32)
}

/// What edges are, held for those of an even converter of the same mean and variance.
fn against_even(stand: &Stand, axis: usize, first: i32, edges: &[f64], even: &[f64]) -> Known {
    let (bias, sigma) = mean_and_sigma(stand, axis);
    let shares = |edges: &[f64]| shares(edges, bias, sigma);
    let read = Law {
        first,
        shares: shares(edges),
    };
    Known::Codes(read, shares(even))
}

/// A converter whose steps are not of equal width: each edge between two codes lies off its place by its own amount.
pub(super) fn uneven_steps(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    const MOST: f64 = 0.98;
    let (first, last) = reach(stand, axis);
    let even = even_edges(first, (last - first) as usize);
    let off = each(&even, |_| draw.between(-0.5, 0.5));
    let edges = move |size: f64| each_pair(&even, &off, |e, o| e + size * o);
    let known = edges.clone();
    sized(
        MOST,
        move |stand, size| against_even(stand, axis, first, &known(size), &known(0.0)),
        move |_, _, size| Change::edges(axis, (first, edges(size))),
    )
}

/// A gain below 1 in fixed point, by which the firmware brings the part to its nominal scale: now and then two codes of the
/// part become one reading, which then comes twice as often as its neighbours. Its strength is what the gain makes it.
pub(super) fn two_in_one(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    // Below that, every other reading would be double: a bit that sticks at times does the same.
    let (gain, offset) = (draw.between(0.72, 0.91), draw.between(-0.5, 0.5));
    let (first, last) = reach(stand, axis);
    let even = even_edges(first, (last - first) as usize);
    // The lowest code of the part that rounds to a reading begins half a code below itself.
    let edges = each(&even, |edge| {
        (((edge - offset) / gain).ceil() - 0.5) * gain + offset
    });
    let known = against_even(stand, axis, first, &edges, &even);
    Shape::Fixed(known, Change::edges(axis, (first, edges)))
}

/// Crossover: of two transistors that push and pull, neither leads until the input is a little off zero. Firmware that takes
/// the bias off and then divides whole numbers does the same by half a count: the quotient is cut towards zero. What is
/// left of the bias lies within a sigma of that zero.
pub(super) fn push_pull(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let (bias, sigma) = mean_and_sigma(stand, axis);
    let middle = (bias + draw.between(-1.0, 1.0) * sigma).round();
    // Two sigma of it would leave few readings but zero.
    edges(axis, 2.0 * sigma, move |_, zone| {
        let edge = |even| even + if even > middle { zone } else { -zone };
        about(middle, 8.0 * sigma, edge)
    })
}

/// A threshold against drift: rates that are small, the bias taken off, read zero, and the others are left as they are.
pub(super) fn dead_band(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let (bias, sigma) = mean_and_sigma(stand, axis);
    let middle = (bias + sigma * draw.between(-0.5, 0.5)).round();
    edges(axis, 3.0 * sigma, move |_, wider| {
        let band = 0.5 + wider;
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
    edges(axis, 1.6, move |_, log_ratio| {
        let gain = (0.5 * sign * log_ratio).exp();
        about(middle, 20.0 * sigma, |even| match even - middle {
            off if off > 0.0 => middle + off / gain,
            off => middle + off * gain,
        })
    })
}

/// Lower edges, counts, of codes about a middle when every other is missing beyond a limit, and three of four beyond twice
/// as much.
fn of_growing(middle: i32, limit: i32, reach: i32) -> (i32, Vec<f64>) {
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
    let edge = |code: i32| {
        // A code that is missing begins where the next one does that is not.
        let next = codes.partition_point(|c| *c < code);
        let below = if next > 0 { codes[next - 1] } else { -last - 1 };
        f64::from(middle) + 0.5 * f64::from(below + codes[next])
    };
    (middle - last, (-last..=last).map(edge).collect())
}

/// A word of few bits that is a number times a power of two, the bias taken off before: small readings are told to the
/// count, larger ones by twos and by fours. The limit is the largest that makes it as strong as wanted.
pub(super) fn growing_steps(draw: &mut Draw, stand: &Stand, axis: usize, wanted: f64) -> Shape {
    let (mean, sigma) = mean_and_sigma(stand, axis);
    let middle = (mean + sigma * draw.between(-0.5, 0.5)).round() as i32;
    let reach = (8.0 * sigma).ceil() as i32;
    let edges = |limit: i32| of_growing(middle, limit, reach);
    let known = |limit: i32| Known::edges(stand, axis, &edges(limit));
    let limit = (1..reach)
        .rev()
        .find(|limit| known(*limit).strength(stand, axis) >= wanted)
        .unwrap_or(1);
    Shape::Fixed(known(limit), Change::edges(axis, edges(limit)))
}

/// An amplifier that is straight for small rates and bends to a logarithm for large ones, either way, so that they fit into
/// few codes; nobody has bent them back.
pub(super) fn bent(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let (mean, sigma) = mean_and_sigma(stand, axis);
    let middle = mean + sigma * draw.between(-0.3, 0.3);
    edges(axis, 3.0, move |_, bend| {
        let bend = bend / sigma;
        let edge = |even: f64| middle + (bend * (even - middle)).sinh() / bend;
        about(middle, 10.0 * sigma, edge)
    })
}
