//! What one axis has of another, beyond a straight line in the same frame.

use super::super::prelude::*;
use super::Make::Shaped;
use super::{ForeignEffect, Strength, TM, row};

mod memory;
mod words;

/// One row each, unbroken so that columns can be read down.
#[rustfmt::skip]
pub(super) const EFFECTS: &[ForeignEffect] = &[
    row(366, 4, "another axis, frames late", Shaped(|d, s, a, _| late(d, s, a))).needs(TM),
    row(367, 4, "frames that hold another axis", Shaped(|d, s, a, _| other_frames(d, s, a))).needs(TM),
    row(405, 6, "toggling line of another axis's word", Shaped(|d, s, a, _| toggling(d, s, a))).needs(TM),
    row(406, 6, "another axis, its sign alternating", Shaped(|d, s, a, _| alternating(d, s, a))).needs(TM),
    row(407, 6, "product of the two other axes", Shaped(|d, s, a, _| product(d, s, a))).needs(TM),
    row(426, 7, "tail of another axis", Shaped(|d, s, a, _| tail(d, s, a))).needs(TM),
    row(444, 8, "changes of another axis", Shaped(|d, s, a, _| differences(d, s, a))).needs(TM),
    row(445, 8, "magnitude of another axis", Shaped(|d, s, a, _| magnitude(d, s, a))).needs(TM),
    row(461, 9, "another axis through a resonance", Shaped(|d, s, a, _| resonance(d, s, a))).needs(TM).parts(&["narrow_band"]),
    row(462, 9, "gain that another axis turns", Shaped(|d, s, a, w| gain(d, s, a, w))).needs(TM),
    row(463, 9, "diode between two axes", Shaped(|d, s, a, _| diode(d, s, a))).needs(TM).parts(&["cross_axis"]),
    row(515, 12, "axis that reads its neighbour for a while", Shaped(neighbour)).parts(&["noise_change"]).twin(367),
    row(585, 15, "reading dropped where it equals its neighbour's", Shaped(|d, s, a, _| duplicates(d, s, a))).parts(&["stale_samples"]).strength(Strength::Whole),
    row(586, 15, "reading renewed only when its neighbour's changes", Shaped(|d, _, a, _| by_neighbour(d, a))).parts(&["stale_samples"]),
    row(587, 15, "limit to the length of the vector", Shaped(|d, s, a, _| limited(d, s, a))),
    row(602, 16, "latch that another axis sets and clears", Shaped(|d, s, a, _| memory::latch(d, s, a))).parts(&["telegraph"]),
    row(603, 16, "last reading turned round by another axis", Shaped(|d, s, a, _| memory::turned_round(d, s, a))),
    row(614, 17, "words whose sum is kept even", Shaped(|_, _, a, _| words::even_sum(a))),
    row(615, 17, "two parts that drive the line at once", Shaped(|d, _, a, _| words::both_drive(d, a))).parts(&["stuck_bit"]),
];

/// One of the two others.
fn other_than(draw: &mut Draw, axis: usize) -> usize {
    (axis + 1 + draw.of_many(2)) % 3
}

/// What an axis has read, deg/s.
fn rates(counts: &[i32]) -> Vec<f64> {
    each(counts, |c| LSB * f64::from(c))
}

/// What an axis has read about its bias, deg/s.
fn about_bias(counts: &[i32], bias: f64) -> Vec<f64> {
    each(counts, |c| LSB * f64::from(c) - bias)
}

/// White readings of an axis about its bias, deg/s.
fn white_of(draw: &mut Draw, stand: &Stand, axis: usize) -> Vec<f64> {
    let sigma = stand.white(axis).sqrt();
    stand.series(|_| sigma * draw.normal())
}

/// Firmware has taken the biases off: another axis is about as far from zero as this one, to within a share of its noise.
fn without_bias(draw: &mut Draw, stand: &mut Stand, (axis, other): (usize, usize), within: f64) {
    let sigma = stand.white(axis).sqrt();
    stand.bias[other] = stand.bias[axis] + within * sigma * draw.between(-1.0, 1.0);
}

/// A capacitor that samples the axes in turn, or a buffer that is not cleared, keeps a share of another axis's reading for
/// one to four frames: what two axes have in common is in no frame, only in frames that far apart.
fn late(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let (other, frames) = (other_than(draw, axis), 1 + draw.of_many(4));
    let sign = draw.sign();
    coupled_by(Meter::new(stand, other).noise(), axis, move |counts| {
        let from = about_mean(&rates(&counts[other]));
        let kept = |i: usize| sign * from[i.saturating_sub(frames)];
        (0..from.len()).map(kept).collect()
    })
}

/// d' of frames of which a share hold another axis's reading, who looks at one against mean and variance refitted, who
/// knows at both.
fn of_exchanged(stand: &Stand, axis: usize, other: usize, chance: f64) -> Known {
    let [(mean, sigma), (its_mean, its_sigma)] =
        [axis, other].map(|axis| mean_and_sigma_read(stand, axis));
    let reach = sigma.max(its_sigma) + (mean - its_mean).abs() / REACH;
    let law = |m: f64, s: f64| law_of(m, s, mean, reach).shares;
    let both = mean + chance * (its_mean - mean);
    let spread = (1.0 - chance) * sigma.powi(2)
        + chance * its_sigma.powi(2)
        + chance * (1.0 - chance) * (its_mean - mean).powi(2);
    let (own, its) = (law(mean, sigma), law(its_mean, its_sigma));
    let refitted = law(both, spread.sqrt());
    let mut nats = 0.0;
    for ((p, q), r) in own.iter().zip(&its).zip(&refitted) {
        let r = r.max(1e-300);
        // The frames that read the same, and those that do not.
        let same = (1.0 - chance) * p + chance;
        let unlike = (1.0 - chance) * p;
        nats += q * same * (same / r).ln();
        nats += unlike * (1.0 - q) * (unlike.max(1e-300) / r).ln();
    }
    Known::nats(stand.samples() as f64 * nats)
}

/// The part answers on its bus what was asked a word before: when an interrupt comes in between, a frame holds the reading
/// of another axis, code for code. The firmware has taken the biases off, so that it does not stand out.
fn other_frames(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Shape {
    let other = other_than(draw, axis);
    without_bias(draw, stand, (axis, other), 1.0);
    remade(
        0.9,
        move |stand, chance| of_exchanged(stand, axis, other, chance),
        move |counts, draw, chance| {
            let taken = each(&counts[other], |its| draw.chance(chance).then_some(its));
            each_pair(&counts[axis], &taken, |own, its| {
                let own = within_step(own, draw).round() as i32;
                its.unwrap_or(own)
            })
        },
    )
}

/// While this axis is converted, the word of another is shifted out, and the line of one of its two lowest bits reaches the
/// input: more where the bit is 1. The bit is as good as independent of the number.
fn toggling(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let (other, bit) = (other_than(draw, axis), draw.of_many(2));
    let sign = draw.sign();
    let like = stand.series(|_| 0.5 * draw.sign());
    coupled(stand, axis, &like, move |counts| {
        each(&counts[other], |c| sign * (f64::from(c >> bit & 1) - 0.5))
    })
}

/// A multiplexer that is chopped: what leaks from the axis before comes with one sign in one frame and with the other in
/// the next.
fn alternating(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let (other, first) = (other_than(draw, axis), draw.of_many(2));
    let like = white_of(draw, stand, other);
    let bias = stand.bias[other];
    coupled(stand, axis, &like, move |counts| {
        let mut its = about_bias(&counts[other], bias);
        let turned = its.iter_mut().skip(1 - first).step_by(2);
        turned.for_each(|v| *v = -*v);
        its
    })
}

/// Anisoinertia (IEEE Std 528), or an amplifier that is bent and shared: the product of what the two other axes read.
fn product(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let (one, two, sign) = ((axis + 1) % 3, (axis + 2) % 3, draw.sign());
    let (a, b) = (white_of(draw, stand, one), white_of(draw, stand, two));
    let like = each_pair(&a, &b, |a, b| a * b);
    let biases = stand.bias;
    coupled(stand, axis, &like, move |counts| {
        let [a, b] = [one, two].map(|k| about_bias(&counts[k], biases[k]));
        each_pair(&a, &b, |a, b| sign * a * b)
    })
}

/// The axes are converted in turn, this one first, and a capacitor between them lets changes through alone: what another
/// reading has changed by, up to the frame before.
fn differences(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let (other, sign) = (other_than(draw, axis), draw.sign());
    let like = changes(&white_of(draw, stand, other));
    coupled(stand, axis, &like, move |counts| {
        let mut changes = changes(&rates(&counts[other]));
        changes.rotate_right(1);
        changes[0] = 0.0;
        each(&changes, |c| sign * c)
    })
}

/// A rectifier on the board: how far another axis is off its middle, either way.
fn magnitude(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let (other, sign) = (other_than(draw, axis), draw.sign());
    let like = about_mean(&each(&white_of(draw, stand, other), f64::abs));
    // Of half a normal law, so that the bias of this axis stays.
    let mean = (2.0 / PI * stand.white(other)).sqrt();
    let bias = stand.bias[other];
    coupled(stand, axis, &like, move |counts| {
        each(&about_bias(&counts[other], bias), |v| {
            sign * (v.abs() - mean)
        })
    })
}

/// A line between the axes that is driven by one and discharges into the other: nothing in the same frame, then a tail.
fn tail(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let other = other_than(draw, axis);
    let (keep, sign) = (draw.between(0.2, 0.85), draw.sign());
    // Of its own noise, not of what the other axis's bias does.
    let noise = Meter::new(stand, other).noise();
    let energy = each_pair(Meter::new(stand, axis).omega(), &noise, |w, e| {
        e / (1.0 + keep * keep - 2.0 * keep * w.cos())
    });
    coupled_by(energy, axis, move |counts| {
        let from = about_mean(&rates(&counts[other]));
        let mut held = carry(0.0, &from, |held, v| keep * held + sign * v);
        held.rotate_right(1);
        held[0] = 0.0;
        held
    })
}

/// The element of one axis shakes the frame, and the frame, which has a mode of its own, that of this one: nothing in the
/// same frame, then a ringing.
fn resonance(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let (other, rate_hz) = (other_than(draw, axis), stand.rate_hz);
    let mode = (draw.by_ratio(0.8, 8.5), draw.by_ratio(0.1, 0.6));
    let like = resonating(&white_of(draw, stand, other), mode, rate_hz);
    let bias = stand.bias[other];
    coupled(stand, axis, &like, move |counts| {
        resonating(&about_bias(&counts[other], bias), mode, rate_hz)
    })
}

/// Readings of an axis that are made of its own and another's of the same frame, each about its bias, deg/s.
fn of_both(
    stand: &Stand,
    (axis, other): (usize, usize),
    of: impl Fn(f64, f64) -> f64 + 'static,
) -> Change {
    let (bias, its_bias) = (stand.bias[axis], stand.bias[other]);
    Change::made(move |counts, draw| {
        let its = about_bias(&counts[other], its_bias);
        each_pair(&counts[axis], &its, |own, its| {
            let rate = LSB * within_step(own, draw) - bias;
            ((bias + of(rate, its)) / LSB).round() as i32
        })
    })
}

/// An amplifier whose gain is set by a current that another axis carries along: this one is louder while that is on one
/// side, and quieter on the other, by decibels. What is left of the logarithms of the variance tells.
fn gain(draw: &mut Draw, stand: &Stand, axis: usize, wanted: f64) -> Shape {
    let (other, sign) = (other_than(draw, axis), draw.sign());
    let turn = wanted / (2.0 * stand.samples() as f64).sqrt();
    let sigma = stand.white(other).sqrt();
    let change = of_both(stand, (axis, other), move |own, its| {
        own * (sign * turn * its / sigma).exp()
    });
    Shape::Fixed(Known::Strength(wanted), change)
}

/// A protection diode between two lines: where another axis is far enough above this one it draws it along. The line that
/// a part of it is counts as true.
fn diode(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    // At 1 the two lines are one.
    const MOST: f64 = 0.9;
    let other = other_than(draw, axis);
    let threshold = stand.white(axis).sqrt() * draw.between(0.0, 1.0);
    let own = white_of(draw, stand, axis);
    let its = white_of(draw, stand, other);
    let drawn =
        move |share: f64| move |own: f64, its: f64| own + share * (its - own - threshold).max(0.0);
    sized(
        MOST,
        move |_, share| {
            let n = own.len() as f64;
            let open = each_pair(&own, &its, |own, its| one_if(its - own > threshold));
            // What the law narrows by, where it conducts, over what the readings as a whole still spread. The draws themselves
            // are not exactly of their variance.
            let spreads = spread(&each_pair(&own, &its, drawn(share))) / spread(&own);
            let narrows = open.iter().sum::<f64>() * (-share).ln_1p();
            Known::nats(0.5 * n * spreads.ln() - narrows)
        },
        move |stand, _, share| of_both(stand, (axis, other), drawn(share)),
    )
}

/// Nats of a reading that is another axis's, for who holds it for one of its own and, knowing, has it to the count.
fn nats_of_copy(stand: &Stand, axis: usize, other: usize) -> f64 {
    let own = law(stand, axis);
    let of = |(code, q): (i32, f64)| -q * own.of(code).max(1e-12).ln();
    law(stand, other).codes().map(of).sum()
}

/// The address of the register that is read for this axis flips to another axis's, until it is written anew: meanwhile both
/// are told as one. The firmware has taken the biases off, so that it does not stand out. Were the two exchanged, a stand at
/// rest would show two steps and a change of the noise, which the library has.
fn neighbour(draw: &mut Draw, stand: &mut Stand, axis: usize, wanted: f64) -> Shape {
    let other = other_than(draw, axis);
    without_bias(draw, stand, (axis, other), 0.2);
    let nats = nats_of_copy(stand, axis, other);
    let long = (wanted * wanted / (2.0 * nats)).round() as usize;
    let from = draw.of_many(stand.samples().saturating_sub(long));
    let change = Change::made(move |counts, _| {
        let mut own = counts[axis].clone();
        let to = (from + long).min(own.len());
        own[from..to].copy_from_slice(&counts[other][from..to]);
        own
    });
    Shape::Fixed(Known::nats(long as f64 * nats), change)
}

/// Firmware that drops duplicates, and compares with the axis sent before instead of the frame before: where both read the
/// same, the last reading is sent again. It has taken the biases off. No correlation tells, only codes that never coincide.
fn duplicates(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Shape {
    let other = other_than(draw, axis);
    without_bias(draw, stand, (axis, other), 0.3);
    remade(
        1.0,
        move |stand, chance| {
            let (own, its) = (law(stand, axis), law(stand, other));
            let mut nats = 0.0;
            for (code, p) in own.codes() {
                let same = p * its.of(code);
                // What is dropped is missing here, and comes where the reading before was.
                nats += same * (1.0 - chance) * (1.0 - chance).max(1e-12).ln();
                for (_, r) in own.codes().filter(|(_, r)| *r > 1e-300) {
                    let comes = r * (r + chance * p) * (chance * p / r).ln_1p();
                    nats += same / p.max(1e-300) * comes;
                }
            }
            Known::nats(stand.samples() as f64 * nats)
        },
        move |counts, draw, chance| {
            let mut last = counts[axis][0];
            each_pair(&counts[axis], &counts[other], |own, its| {
                if own != its || !draw.chance(chance) {
                    last = own;
                }
                last
            })
        },
    )
}

/// A driver that waits for new data by looking whether the word of another axis has changed: by chance it is the same code
/// twice, and this axis is not read then. Where something else wakes it, it reads.
fn by_neighbour(draw: &mut Draw, axis: usize) -> Shape {
    let other = other_than(draw, axis);
    remade(
        1.0,
        move |stand, chance| {
            let square = |law: &Law| law.shares.iter().map(|p| p * p).sum::<f64>();
            let (own, its) = (law(stand, axis), law(stand, other));
            let stands = |p: &f64| {
                let again = chance + (1.0 - chance) * p;
                p * again * (again / p).ln()
            };
            let some = own.shares.iter().filter(|p| **p > 1e-300);
            let again: f64 = some.map(stands).sum();
            let moves = (1.0 - chance) * (1.0 - square(&own)) * (1.0 - chance).max(1e-12).ln();
            Known::nats(stand.samples() as f64 * square(&its) * (again + moves))
        },
        move |counts, draw, chance| {
            let (mut last, mut its_last) = (counts[axis][0], counts[other][0].wrapping_add(1));
            each_pair(&counts[axis], &counts[other], |own, its| {
                if its != its_last || !draw.chance(chance) {
                    last = own;
                }
                its_last = its;
                last
            })
        },
    )
}

/// What is left of a rate where the length of a vector may be so much, and the slope of that.
fn within(own: f64, others: f64, limit: f64) -> (f64, f64) {
    let length = own.hypot(others);
    if length <= limit {
        return (own, 1.0);
    }
    let part = limit / length;
    (own * part, part * (others / length).powi(2))
}

/// Firmware that limits the length of the rate's vector, about the biases: a reading is drawn in where the other axes are
/// large. The size is 1 over the limit, in sigma of this axis.
fn limited(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let others = [(axis + 1) % 3, (axis + 2) % 3];
    let own = white_of(draw, stand, axis);
    let [a, b] = others.map(|k| white_of(draw, stand, k));
    let lengths = each_pair(&a, &b, f64::hypot);
    let (sigma, biases) = (stand.white(axis).sqrt(), stand.bias);
    sized(
        f64::INFINITY,
        move |_, size| {
            let limit = sigma / size.max(1e-9);
            // No slope tells more than the code that is read.
            let least = LSB / sigma / TAU;
            let read = each_pair(&own, &lengths, |own, r| within(own, r, limit));
            let logs: f64 = read.iter().map(|(_, slope)| slope.max(least).ln()).sum();
            let square = mean_square(&each(&read, |(read, _)| read));
            let n = own.len() as f64;
            Known::nats(0.5 * n * (square / mean_square(&own)).ln() - logs)
        },
        move |_, _, size| {
            let limit = sigma / size.max(1e-9);
            Change::made(move |counts, draw| {
                let [a, b] = others.map(|k| about_bias(&counts[k], biases[k]));
                each_pair(&counts[axis], &each_pair(&a, &b, f64::hypot), |own, r| {
                    let rate = LSB * within_step(own, draw) - biases[axis];
                    ((biases[axis] + within(rate, r, limit).0) / LSB).round() as i32
                })
            })
        },
    )
}
