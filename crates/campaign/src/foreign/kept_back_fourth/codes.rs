//! The fourth set's codes and couplings of axes.

use super::super::kept_back::shares;
use super::super::{Change, Foreign};
use crate::random::Draw;
use crate::stand::{LSB, Stand};
use crate::strength::{Meter, size_for};

/// One of them; `None` for another name.
pub(super) fn one(
    draw: &mut Draw,
    stand: &mut Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Option<Foreign> {
    Some(match name {
        "reading that is renewed beyond a threshold" => threshold(stand, name, axis, wanted),
        "another axis, frames late" => late(draw, stand, name, axis, wanted),
        "frames that hold another axis" => exchanged(draw, stand, name, axis, wanted),
        _ => return None,
    })
}

/// Sigma either way of the bias within which the codes are followed.
const REACH: f64 = 6.0;

/// The codes of an axis, counts: the first, with the share of each in readings without fault.
pub(in super::super) fn law(stand: &Stand, axis: usize) -> (i32, Vec<f64>) {
    law_of(
        stand.bias[axis] / LSB,
        stand.white(axis).sqrt() / LSB,
        stand.bias[axis] / LSB,
        stand.white(axis).sqrt() / LSB,
    )
}

/// The same of a normal law, over the reach of another.
fn law_of(bias: f64, sigma: f64, middle: f64, reach: f64) -> (i32, Vec<f64>) {
    let first = (middle - REACH * reach).floor() as i32;
    let last = (middle + REACH * reach).ceil() as i32;
    let edges: Vec<f64> = (first..=last + 1).map(|c| f64::from(c) - 0.5).collect();
    (first, shares(&edges, bias, sigma))
}

/// Chances from each code (row) to the next reading's, when one stands until the input is `holds` counts away from it.
pub(in super::super) fn steps(stand: &Stand, axis: usize, holds: f64) -> Vec<Vec<f64>> {
    let (bias, sigma) = (stand.bias[axis] / LSB, stand.white(axis).sqrt() / LSB);
    let (first, even) = law(stand, axis);
    let within = |low: f64, high: f64| {
        if high > low {
            shares(&[low, high], bias, sigma)[0]
        } else {
            0.0
        }
    };
    (0..even.len())
        .map(|from| {
            let stands = f64::from(first) + from as f64;
            let mut row: Vec<f64> = (0..even.len())
                .map(|to| {
                    // What of the code's width lies outside of what is held.
                    let (low, high) = (to as f64 - 0.5, to as f64 + 0.5);
                    let (low, high) = (f64::from(first) + low, f64::from(first) + high);
                    within(low, high.min(stands - holds)) + within(low.max(stands + holds), high)
                })
                .collect();
            row[from] += within(stands - holds, stands + holds);
            row
        })
        .collect()
}

/// Shares of the codes in the long run.
pub(in super::super) fn long_run(steps: &[Vec<f64>], from: &[f64]) -> Vec<f64> {
    let mut now = from.to_vec();
    for _ in 0..12 {
        let mut next = vec![0.0; now.len()];
        for (p, row) in now.iter().zip(steps) {
            next.iter_mut().zip(row).for_each(|(n, s)| *n += p * s);
        }
        let sum: f64 = next.iter().sum();
        now = next.iter().map(|p| p / sum).collect();
    }
    now
}

/// d' of `n` readings that step by these chances, against another law of the steps.
pub(in super::super) fn of_steps(
    truth: &[Vec<f64>],
    shares: &[f64],
    other: &dyn Fn(usize, usize) -> f64,
    n: usize,
) -> f64 {
    let mut nats = 0.0;
    for (from, (share, row)) in shares.iter().zip(truth).enumerate() {
        for (to, p) in row.iter().enumerate().filter(|(_, p)| **p > 1e-300) {
            nats += share * p * (p / other(from, to).max(1e-300)).ln();
        }
    }
    (2.0 * n as f64 * nats).max(0.0).sqrt()
}

/// A node that saves its line sends a reading on only when it is a threshold away from the last it sent ("send on delta"),
/// and a comparator with hysteresis does the same: the code that stands is wider than the others, and its neighbours
/// come less often after it.
fn threshold(stand: &Stand, name: &'static str, axis: usize, wanted: f64) -> Foreign {
    let (_, even) = law(stand, axis);
    let strength = |beyond: f64| {
        let steps = steps(stand, axis, 0.5 + beyond.min(4.0));
        let shares = long_run(&steps, &even);
        of_steps(&steps, &shares, &|_, to| even[to], stand.samples())
    };
    let beyond = size_for(wanted, &strength).min(4.0);
    Foreign {
        name,
        strength: strength(beyond),
        change: Change::Holds(0.5 + beyond),
    }
}

/// One of the two others.
pub(in super::super) fn other_than(draw: &mut Draw, axis: usize) -> usize {
    (axis + 1 + draw.of_many(2)) % 3
}

/// What an axis reads, without its bias, by bin of the spectrum: expected energies.
pub(in super::super) fn energy_of(stand: &Stand, axis: usize) -> Vec<f64> {
    let ones = vec![1.0; stand.samples()];
    let count = analysis::likelihood::Bins::new(stand.samples()).products(&ones, &ones);
    let omega = Meter::new(stand, axis).omega().to_vec();
    omega
        .iter()
        .zip(count)
        .map(|(w, m)| {
            let walk = 1.0 / (4.0 * (w / 2.0).sin().powi(2));
            m * (stand.white(axis) + stand.step(axis) * walk)
        })
        .collect()
}

/// A capacitor that samples the axes in turn, or a buffer that is not cleared, keeps a share of another axis's reading for
/// one to four frames: what two axes have in common is in no frame, only in frames that far apart.
fn late(draw: &mut Draw, stand: &Stand, name: &'static str, axis: usize, wanted: f64) -> Foreign {
    let (other, frames) = (other_than(draw, axis), 1 + draw.of_many(4));
    let meter = Meter::new(stand, axis);
    let (share, strength) = meter.sized(&energy_of(stand, other), wanted);
    Foreign {
        name,
        strength,
        change: Change::Late {
            axis: other,
            share: share * draw.sign(),
            frames,
        },
    }
}

/// d' of frames of which a share hold another axis's reading, who looks at one against mean and variance refitted, who
/// knows at both.
pub(in super::super) fn of_exchanged(stand: &Stand, axis: usize, other: usize, chance: f64) -> f64 {
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

/// The part answers on its bus what was asked a word before: when an interrupt comes in between, a frame holds the reading
/// of another axis, code for code. The firmware has taken the biases off, so that it does not stand out.
fn exchanged(
    draw: &mut Draw,
    stand: &mut Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Foreign {
    let other = other_than(draw, axis);
    let off = draw.between(-1.0, 1.0) * stand.white(axis).sqrt();
    stand.bias[other] = stand.bias[axis] + off;
    let strength = |chance: f64| of_exchanged(stand, axis, other, chance);
    let chance = size_for(wanted, &strength).min(0.9);
    Foreign {
        name,
        strength: strength(chance),
        change: Change::Frames {
            axis: other,
            chance,
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stand::Needs;

    fn stand() -> Stand {
        let draw = &mut Draw::of(20_261_121, 22, 0);
        Stand::draw(draw, 600.0, 20.0, Needs::default())
    }

    #[test]
    fn steps_are_chances_and_half_a_count_holds_nothing() {
        let stand = stand();
        let (_, even) = law(&stand, 0);
        for holds in [0.5, 0.8, 1.3, 3.0] {
            let steps = steps(&stand, 0, holds);
            for row in &steps {
                assert!((row.iter().sum::<f64>() - 1.0).abs() < 1e-6);
            }
            let strength = of_steps(
                &steps,
                &long_run(&steps, &even),
                &|_, to| even[to],
                stand.samples(),
            );
            assert_eq!(strength > 1.0, holds > 0.6, "{holds}: {strength}");
        }
    }

    #[test]
    fn held_readings_repeat_as_often_as_the_steps_say() {
        let stand = stand();
        let holds = 1.2;
        let (_, even) = law(&stand, 0);
        let steps = steps(&stand, 0, holds);
        let shares = long_run(&steps, &even);
        let expected: f64 = shares
            .iter()
            .enumerate()
            .map(|(i, p)| p * steps[i][i])
            .sum();
        let draw = &mut Draw::of(20_261_121, 23, 0);
        let (bias, sigma) = (stand.bias[0] / LSB, stand.white(0).sqrt() / LSB);
        let (mut code, mut repeats) = (bias.round(), 0.0);
        const N: usize = 200_000;
        for _ in 0..N {
            let v = bias + sigma * draw.normal();
            if (v - code).abs() >= holds {
                code = v.round();
            } else {
                repeats += 1.0;
            }
        }
        let seen = repeats / N as f64;
        // Five sigma of the count.
        let error = (expected * (1.0 - expected) / N as f64).sqrt();
        assert!((seen - expected).abs() < 5.0 * error, "{seen} {expected}");
    }

    #[test]
    fn frames_of_an_equal_axis_are_told_by_the_codes_that_agree() {
        let mut stand = stand();
        stand.bias[1] = stand.bias[0];
        stand.walk_of_angle[1] = stand.walk_of_angle[0];
        // One law: all there is are the codes that agree, more often than by chance.
        let (chance, (_, own)) = (0.07, law(&stand, 0));
        let by_chance: f64 = own.iter().map(|p| p * p).sum();
        let agree = chance + (1.0 - chance) * by_chance;
        let nats = agree * (agree / by_chance).ln()
            + (1.0 - agree) * ((1.0 - agree) / (1.0 - by_chance)).ln();
        let of_codes = (2.0 * stand.samples() as f64 * nats).sqrt();
        let found = of_exchanged(&stand, 0, 1, chance);
        // Rare codes that agree tell more than those in the middle.
        assert!(
            found > of_codes && found < 1.3 * of_codes,
            "{found} {of_codes}"
        );
        assert!(of_exchanged(&stand, 0, 1, 0.0) < 1e-3);
    }
}
