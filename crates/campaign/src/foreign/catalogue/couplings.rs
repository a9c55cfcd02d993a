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

/// d' of frames of which a share hold another axis's reading, who looks at one against mean and variance refitted, who
/// knows at both.
fn of_exchanged(stand: &Stand, axis: usize, other: usize, chance: f64) -> f64 {
    let chance = chance.min(0.9);
    let at = |axis: usize| (stand.bias[axis] / LSB, stand.white(axis).sqrt() / LSB);
    let ((mean, sigma), (its_mean, its_sigma)) = (at(axis), at(other));
    let reach = sigma.max(its_sigma) + (mean - its_mean).abs() / REACH;
    let law = |m: f64, s: f64| law_of(m, s, mean, reach).1;
    let own = law(mean, sigma);
    let its = law(its_mean, its_sigma);
    let both = mean + chance * (its_mean - mean);
    let spread = (1.0 - chance) * sigma.powi(2)
        + chance * its_sigma.powi(2)
        + chance * (1.0 - chance) * (its_mean - mean).powi(2);
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
    (2.0 * stand.samples() as f64 * nats).max(0.0).sqrt()
}

/// What an axis has read about its bias, deg/s.
fn about_bias(counts: &[i32], bias: f64) -> Vec<f64> {
    each(counts, |c| LSB * f64::from(c) - bias)
}

/// d' of `n` readings whose gain is exp(turn z) for a z of the normal law: what is left of the logarithms of the variance.
fn of_gain(turn: f64, n: usize) -> f64 {
    turn * (2.0 * n as f64).sqrt()
}

/// A diode from another axis's line to this one's.
#[derive(Clone, Copy)]
struct Diode {
    /// How far the other has to be beyond this one, deg/s.
    threshold: f64,
    /// Share of what it is beyond that comes over.
    share: f64,
}

impl Diode {
    /// Largest share: at 1 the two lines are one.
    const MOST: f64 = 0.9;

    fn of(self, own: f64, other: f64) -> f64 {
        own + self.share * (other - own - self.threshold).max(0.0)
    }

    /// d' of readings of an axis that these of the other do so to, the variance refitted: what the law narrows by, where
    /// it conducts, over what the readings as a whole still spread.
    fn strength(self, own: &[f64], other: &[f64], white: f64) -> f64 {
        let n = own.len() as f64;
        let with: Vec<f64> = each_pair(own, other, |w, o| self.of(w, o));
        let variance = |of: &[f64]| {
            let mean = of.iter().sum::<f64>() / n;
            of.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n
        };
        let open = |(w, o): &(&f64, &f64)| *o - *w > self.threshold;
        let conducts = own.iter().zip(other).filter(open).count() as f64;
        // The draws themselves are not exactly of their variance.
        let spread = variance(&with) / variance(own) * white;
        (n * (spread / white).ln() - 2.0 * conducts * (-self.share).ln_1p())
            .max(0.0)
            .sqrt()
    }
}

/// What a tail does to a spectrum.
fn of_tail(keep: f64, w: f64) -> f64 {
    1.0 / (1.0 + keep * keep - 2.0 * keep * w.cos())
}

/// White readings of an axis about its bias, deg/s.
fn white_of(draw: &mut Draw, stand: &Stand, axis: usize) -> Vec<f64> {
    let sigma = stand.white(axis).sqrt();
    stand.series(|_| sigma * draw.normal())
}

/// Nats of a reading that is another axis's, for who holds it for one of its own and, knowing, has it to the count.
fn nats_of_copy(stand: &Stand, axis: usize, other: usize) -> f64 {
    let (first, own) = law(stand, axis);
    let (its_first, its) = law(stand, other);
    let of = |(i, q): (usize, &f64)| {
        let code = usize::try_from(its_first + i as i32 - first).ok();
        let p = code.and_then(|c| own.get(c)).copied().unwrap_or(0.0);
        -q * p.max(1e-12).ln()
    };
    its.iter().enumerate().map(of).sum()
}

/// A capacitor that samples the axes in turn, or a buffer that is not cleared, keeps a share of another axis's reading for
/// one to four frames: what two axes have in common is in no frame, only in frames that far apart.
fn late(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let (other, frames) = (other_than(draw, axis), 1 + draw.of_many(4));
    let sign = draw.sign();
    by_energy(Meter::new(stand, other).noise(), move |share| {
        Change::made(move |counts, draw| {
            let from = about_mean(&each(&counts[other], |c| LSB * f64::from(c)));
            let added = (0..from.len()).map(|i| sign * share * from[i.saturating_sub(frames)]);
            let own = counts[axis].iter().zip(added);
            own.map(|(own, a)| ((LSB * within_step(*own, draw) + a) / LSB).round() as i32)
                .collect()
        })
    })
}

/// The part answers on its bus what was asked a word before: when an interrupt comes in between, a frame holds the reading
/// of another axis, code for code. The firmware has taken the biases off, so that it does not stand out.
fn other_frames(draw: &mut Draw, stand: &mut Stand, axis: usize) -> Shape {
    let other = other_than(draw, axis);
    let off = draw.between(-1.0, 1.0) * stand.white(axis).sqrt();
    stand.bias[other] = stand.bias[axis] + off;
    remade(
        0.9,
        move |stand, chance| Known::Strength(of_exchanged(stand, axis, other, chance)),
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
    let like: Vec<f64> = stand.series(|_| 0.5 * draw.sign());
    coupled(stand, axis, &like, move |counts, i| {
        sign * (f64::from(counts[other][i] >> bit & 1) - 0.5)
    })
}

/// A multiplexer that is chopped: what leaks from the axis before comes with one sign in one frame and with the other in
/// the next.
fn alternating(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let (other, first) = (other_than(draw, axis), draw.of_many(2));
    let like = white_of(draw, stand, other);
    let middle = stand.bias[other];
    coupled(stand, axis, &like, move |counts, i| {
        let sign = if (i + first) % 2 == 0 { 1.0 } else { -1.0 };
        sign * (LSB * f64::from(counts[other][i]) - middle)
    })
}

/// Anisoinertia (IEEE Std 528), or an amplifier that is bent and shared: the product of what the two other axes read.
fn product(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let (one, other, sign) = ((axis + 1) % 3, (axis + 2) % 3, draw.sign());
    let (a, b) = (white_of(draw, stand, one), white_of(draw, stand, other));
    let like: Vec<f64> = each_pair(&a, &b, |a, b| a * b);
    let (first, second) = (stand.bias[one], stand.bias[other]);
    coupled(stand, axis, &like, move |counts, i| {
        let about = |k: usize, middle: f64| LSB * f64::from(counts[k][i]) - middle;
        sign * about(one, first) * about(other, second)
    })
}

/// The axes are converted in turn, this one first, and a capacitor between them lets changes through alone: what another
/// reading has changed by, up to the frame before.
fn differences(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let (other, sign) = (other_than(draw, axis), draw.sign());
    let white = white_of(draw, stand, other);
    let like: Vec<f64> = (0..white.len())
        .map(|i| white[i] - white[i.saturating_sub(1)])
        .collect();
    coupled(stand, axis, &like, move |counts, i| {
        let at = |before: usize| LSB * f64::from(counts[other][i.saturating_sub(before)]);
        sign * (at(1) - at(2))
    })
}

/// A rectifier on the board: how far another axis is off its middle, either way.
fn magnitude(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let (other, sign) = (other_than(draw, axis), draw.sign());
    let white = white_of(draw, stand, other);
    let like = about_mean(&each(&white, |v| v.abs()));
    // Of half a normal law, so that the bias of this axis stays.
    let mean = (2.0 / std::f64::consts::PI * stand.white(other)).sqrt();
    let middle = stand.bias[other];
    coupled(stand, axis, &like, move |counts, i| {
        sign * ((LSB * f64::from(counts[other][i]) - middle).abs() - mean)
    })
}

/// A line between the axes that is driven by one and discharges into the other: nothing in the same frame, then a tail.
fn tail(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let other = other_than(draw, axis);
    let (keep, sign) = (draw.between(0.2, 0.85), draw.sign());
    // Of its own noise, not of what the other axis's bias does.
    let energy: Vec<f64> = each_pair(
        Meter::new(stand, axis).omega(),
        &Meter::new(stand, other).noise(),
        |w, e| e * of_tail(keep, w),
    );
    by_energy(energy, move |share| {
        Change::made(move |counts, draw| {
            let from = &counts[other];
            let mean = from.iter().map(|c| f64::from(*c)).sum::<f64>() / from.len() as f64;
            let mut held = 0.0;
            each_pair(&counts[axis], from, |own, from| {
                let new = within_step(own, draw) + sign * share * held;
                held = keep * held + f64::from(from) - mean;
                new.round() as i32
            })
        })
    })
}

/// The element of one axis shakes the frame, and the frame, which has a mode of its own, that of this one: nothing in the
/// same frame, then a ringing.
fn resonance(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let (other, rate_hz) = (other_than(draw, axis), stand.rate_hz);
    let mode = (draw.by_ratio(0.8, 8.5), draw.by_ratio(0.1, 0.6));
    let like = resonating(&white_of(draw, stand, other), mode, rate_hz);
    let bias = stand.bias[other];
    coupled_series(stand, axis, &like, move |counts| {
        resonating(&about_bias(&counts[other], bias), mode, rate_hz)
    })
}

/// Readings of an axis that are made of its own and another's of the same frame, each about its bias, deg/s.
fn of_both(
    stand: &Stand,
    (axis, other): (usize, usize),
    of: impl Fn(f64, f64) -> f64 + 'static,
) -> Change {
    let (own_bias, bias) = (stand.bias[axis], stand.bias[other]);
    Change::made(move |counts, draw| {
        each_pair(
            &about_bias(&counts[other], bias),
            &counts[axis],
            |z, own| {
                let rate = LSB * within_step(own, draw) - own_bias;
                ((own_bias + of(rate, z)) / LSB).round() as i32
            },
        )
    })
}

/// An amplifier whose gain is set by a current that another axis carries along: this one is louder while that is on one
/// side, and quieter on the other, by decibels.
fn gain(draw: &mut Draw, stand: &Stand, axis: usize, wanted: f64) -> Shape {
    let (other, sign) = (other_than(draw, axis), draw.sign());
    let turn = wanted / of_gain(1.0, stand.samples());
    let sigma = stand.white(other).sqrt();
    Shape::Fixed(
        Known::Strength(of_gain(turn, stand.samples())),
        of_both(stand, (axis, other), move |own, z| {
            own * (sign * turn * z / sigma).exp()
        }),
    )
}

/// A protection diode between two lines: where another axis is far enough above this one it draws it along. The line that
/// a part of it is counts as true.
fn diode(draw: &mut Draw, stand: &Stand, axis: usize) -> Shape {
    let other = other_than(draw, axis);
    let threshold = stand.white(axis).sqrt() * draw.between(0.0, 1.0);
    let own = white_of(draw, stand, axis);
    let its = white_of(draw, stand, other);
    let at = move |share: f64| Diode {
        threshold,
        share: share.min(Diode::MOST),
    };
    sized(
        f64::INFINITY,
        move |stand, share| Known::Strength(at(share).strength(&own, &its, stand.white(axis))),
        move |stand, _, share| {
            let diode = at(share);
            of_both(stand, (axis, other), move |own, z| diode.of(own, z))
        },
    )
}

/// The address of the register that is read for this axis flips to another axis's, until it is written anew: meanwhile both
/// are told as one. The firmware has taken the biases off, so that it does not stand out. Were the two exchanged, a stand at
/// rest would show two steps and a change of the noise, which the library has.
fn neighbour(draw: &mut Draw, stand: &mut Stand, axis: usize, wanted: f64) -> Shape {
    let other = other_than(draw, axis);
    stand.bias[other] = stand.bias[axis] + 0.2 * stand.white(axis).sqrt() * draw.between(-1.0, 1.0);
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
    stand.bias[other] = stand.bias[axis] + 0.3 * stand.white(axis).sqrt() * draw.between(-1.0, 1.0);
    let strength = move |stand: &Stand, chance: f64| {
        let (first, own) = law(stand, axis);
        let (its_first, its) = law(stand, other);
        let mut nats = 0.0;
        for (p, code) in own.iter().zip(first..) {
            let at = usize::try_from(code - its_first).ok();
            let same = p * at.and_then(|at| its.get(at)).copied().unwrap_or(0.0);
            // What is dropped is missing here, and comes where the reading before was.
            nats += same * (1.0 - chance) * (1.0 - chance).max(1e-12).ln();
            let gains =
                |r: &f64| same / p.max(1e-300) * r * (r + chance * p) * (chance * p / r).ln_1p();
            nats += own.iter().filter(|r| **r > 1e-300).map(gains).sum::<f64>();
        }
        Known::nats(stand.samples() as f64 * nats)
    };
    remade(
        1.0,
        move |stand, chance| strength(stand, chance.min(1.0)),
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
    let strength = move |stand: &Stand, chance: f64| {
        let square = |law: &[f64]| law.iter().map(|p| p * p).sum::<f64>();
        let own = law(stand, axis).1;
        let stands = |p: &f64| {
            let again = chance + (1.0 - chance) * p;
            p * again * (again / p).ln()
        };
        let again: f64 = own.iter().filter(|p| **p > 1e-300).map(stands).sum();
        let moves = (1.0 - chance) * (1.0 - square(&own)) * (1.0 - chance).max(1e-12).ln();
        let frames = stand.samples() as f64 * square(&law(stand, other).1);
        Known::nats(frames * (again + moves))
    };
    remade(
        1.0,
        move |stand, chance| strength(stand, chance.min(1.0)),
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
    let (one, two) = ((axis + 1) % 3, (axis + 2) % 3);
    let own = white_of(draw, stand, axis);
    let others = each_pair(
        &white_of(draw, stand, one),
        &white_of(draw, stand, two),
        f64::hypot,
    );
    let biases = stand.bias;
    let limit_of = move |stand: &Stand, size: f64| stand.white(axis).sqrt() / size.max(1e-9);
    sized(
        f64::INFINITY,
        move |stand, size| {
            let limit = limit_of(stand, size);
            // No slope tells more than the code that is read.
            let least = LSB / stand.white(axis).sqrt() / std::f64::consts::TAU;
            let (mut square, mut logs) = (0.0, 0.0);
            for (w, r) in own.iter().zip(&others) {
                let (read, slope) = within(*w, *r, limit);
                square += read * read;
                logs += slope.max(least).ln();
            }
            let n = own.len() as f64;
            let input: f64 = own.iter().map(|w| w * w).sum();
            Known::Strength((n * (square / input).ln() - 2.0 * logs).max(0.0).sqrt())
        },
        move |stand, _, size| {
            let limit = limit_of(stand, size);
            Change::made(move |counts, draw| {
                let [a, b] = [one, two].map(|k| about_bias(&counts[k], biases[k]));
                let others = each_pair(&a, &b, f64::hypot);
                each_pair(&counts[axis], &others, |own, r| {
                    let rate = LSB * within_step(own, draw) - biases[axis];
                    ((biases[axis] + within(rate, r, limit).0) / LSB).round() as i32
                })
            })
        },
    )
}
