//! The tenth set's laws that act on what is read.

use super::super::kept_back::{of_law, shares};
use super::super::kept_back_fourth::codes::{law, long_run, of_steps};
use super::super::kept_back_ninth::codes::steps_of;
use super::super::kept_back_sixth::codes::refitted;
use super::super::{Change, Foreign};
use crate::random::Draw;
use crate::stand::{LSB, Stand};
use crate::strength::size_for;

/// One of them; `None` for another name.
pub(super) fn one(
    draw: &mut Draw,
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Option<Foreign> {
    let stage: Box<dyn Fn(f64) -> Stage> = match name {
        "dead zone about zero rate" => Box::new(dead_zone(draw, stand, axis)),
        "other gain and offset beyond a rate" => Box::new(ranges(draw, stand, axis)),
        "slew limit of the output stage" => return Some(slew(stand, name, axis, wanted)),
        _ => return None,
    };
    Some(by_stage(stand, name, axis, wanted, &stage))
}

/// A stage of the size that is as strong as wanted.
pub(in super::super) fn by_stage(
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
    stage: &dyn Fn(f64) -> Stage,
) -> Foreign {
    let strength = |size: f64| stage(size).strength(stand, axis);
    let size = size_for(wanted, &strength);
    Foreign {
        name,
        strength: strength(size),
        change: stage(size).change(axis),
    }
}

/// A stage whose output is a straight line of its input on each side of two thresholds and between them, counts.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct Stage {
    /// Zero rate.
    pub(in super::super) zero: f64,
    /// The thresholds are this far from it.
    pub(in super::super) threshold: f64,
    /// Gain between them.
    pub(in super::super) inside: f64,
    /// Gain beyond.
    pub(in super::super) beyond: f64,
    /// What comes out just beyond them, from zero.
    pub(in super::super) from: f64,
}

impl Stage {
    /// What comes out.
    fn of(self, rate: f64) -> f64 {
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
    pub(in super::super) fn law(self, stand: &Stand, axis: usize) -> (i32, Vec<f64>) {
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

    /// d' of such readings, mean and variance refitted.
    pub(in super::super) fn strength(self, stand: &Stand, axis: usize) -> f64 {
        let (first, read) = self.law(stand, axis);
        of_law(&read, &refitted(first, &read), stand.samples())
    }

    fn change(self, axis: usize) -> Change {
        Change::Made(Box::new(move |counts, draw| {
            counts[axis]
                .iter()
                // Within its step the rate is anywhere.
                .map(|c| self.of(f64::from(*c) + draw.between(-0.5, 0.5)).round() as i32)
                .collect()
        }))
    }
}

/// Zero rate of a stage, counts: not quite that of the part.
pub(in super::super) fn zero_of(draw: &mut Draw, stand: &Stand, axis: usize) -> f64 {
    let sigma = stand.white(axis).sqrt();
    (stand.bias[axis] + sigma * draw.between(-0.7, 0.7)) / LSB
}

/// Nothing comes out until the rate is so far from zero, counts, and only what is beyond afterwards.
pub(in super::super) fn dead_zone(
    draw: &mut Draw,
    stand: &Stand,
    axis: usize,
) -> impl Fn(f64) -> Stage + use<> {
    let zero = zero_of(draw, stand, axis);
    move |size| Stage {
        zero,
        threshold: size,
        inside: 0.0,
        beyond: 1.0,
        from: 0.0,
    }
}

/// A stage that changes its range beyond a rate: the coarse one has an offset from the fine one, counts, and another gain.
pub(in super::super) fn ranges(
    draw: &mut Draw,
    stand: &Stand,
    axis: usize,
) -> impl Fn(f64) -> Stage + use<> {
    let zero = zero_of(draw, stand, axis);
    let threshold = stand.white(axis).sqrt() / LSB * draw.between(0.7, 1.5);
    let (offset, gain) = (draw.sign(), draw.sign() * draw.between(0.02, 0.08));
    move |size| Stage {
        zero,
        threshold,
        inside: 1.0,
        beyond: (gain * size).exp(),
        from: threshold * (offset * size / threshold).exp(),
    }
}

/// Most and least that the output may change by from one reading to the next, counts.
const LIMITS: (f64, f64) = (200.0, 1.0);

/// The next reading of an output that may change by so much.
fn limited(limit: i32) -> impl Fn(i32, i32) -> i32 {
    move |before, code| before + (code - before).clamp(-limit, limit)
}

/// Chances from each code to the next, where the limit is the whole number below, or the one above as often as what is left
/// says.
pub(in super::super) fn steps_of_limit(stand: &Stand, axis: usize, limit: f64) -> Vec<Vec<f64>> {
    let low = steps_of(stand, axis, 1.0, &limited(limit as i32));
    let high = steps_of(stand, axis, 1.0, &limited(limit as i32 + 1));
    let part = limit.fract();
    let mix = |(l, h): (&f64, &f64)| (1.0 - part) * l + part * h;
    low.iter()
        .zip(&high)
        .map(|(l, h)| l.iter().zip(h).map(mix).collect())
        .collect()
}

/// The limit of a slew that is so steep, 1/counts.
pub(in super::super) fn limit_of(steep: f64) -> f64 {
    (1.0 / steep).clamp(LIMITS.1, LIMITS.0)
}

/// d' of such readings, mean and variance refitted.
pub(in super::super) fn of_limit(stand: &Stand, axis: usize, limit: f64) -> f64 {
    let (first, even) = law(stand, axis);
    let steps = steps_of_limit(stand, axis, limit);
    let shares = long_run(&steps, &even);
    let other = refitted(first, &shares);
    of_steps(&steps, &shares, &|_, to| other[to], stand.samples())
}

/// An output stage that gets no further than so much between two readings, and is that much nearer then.
fn slew(stand: &Stand, name: &'static str, axis: usize, wanted: f64) -> Foreign {
    let strength = |steep: f64| of_limit(stand, axis, limit_of(steep));
    let limit = limit_of(size_for(wanted, &strength));
    Foreign {
        name,
        strength: of_limit(stand, axis, limit),
        change: Change::Made(Box::new(move |counts, draw| {
            let mut reading = counts[axis][0];
            let next = |code: &i32| {
                let above = i32::from(draw.chance(limit.fract()));
                reading = limited(limit as i32 + above)(reading, *code);
                reading
            };
            counts[axis].iter().map(next).collect()
        })),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stand::Needs;

    fn stand() -> (Draw, Stand) {
        let mut draw = Draw::of(20_261_122, 112, 0);
        let stand = Stand::draw(&mut draw, 600.0, 20.0, Needs::default());
        (draw, stand)
    }

    #[test]
    fn a_dead_zone_gives_zero_and_then_what_is_beyond_and_a_range_jumps() {
        let dead = Stage {
            zero: 3.0,
            threshold: 0.5,
            inside: 0.0,
            beyond: 1.0,
            from: 0.0,
        };
        assert_eq!(
            [2.6, 3.4, 3.5, 4.0, 2.0].map(|x| dead.of(x)),
            [3.0, 3.0, 3.0, 3.5, 2.5]
        );
        let range = Stage {
            inside: 1.0,
            beyond: 1.1,
            from: 0.7,
            ..dead
        };
        let off = range.of(4.5) - 4.8;
        assert!(off.abs() < 1e-12 && range.of(3.4) == 3.4);
    }

    #[test]
    fn shares_of_codes_are_those_that_come() {
        let (mut draw, stand) = stand();
        let (mean, sigma) = (stand.bias[0] / LSB, stand.white(0).sqrt() / LSB);
        let stages = [
            dead_zone(&mut draw, &stand, 0)(1.5),
            ranges(&mut draw, &stand, 0)(1.2),
        ];
        for stage in stages {
            let (first, told) = stage.law(&stand, 0);
            assert!((told.iter().sum::<f64>() - 1.0).abs() < 1e-6);
            const N: usize = 200_000;
            let mut seen = vec![0.0; told.len()];
            for _ in 0..N {
                let code = stage.of(mean + sigma * draw.normal()).round() as i32;
                seen[(code - first) as usize] += 1.0 / N as f64;
            }
            for (s, t) in seen.iter().zip(&told) {
                // Five standard deviations.
                assert!(
                    (s - t).abs() < 5.0 * ((t + 1e-5) / N as f64).sqrt(),
                    "{s} {t}"
                );
            }
        }
        // No size is no effect.
        assert!(ranges(&mut draw, &stand, 0)(0.0).strength(&stand, 0) < 1.0);
        assert!(dead_zone(&mut draw, &stand, 0)(0.0).strength(&stand, 0) < 1.0);
    }

    #[test]
    fn a_slew_limit_is_kept_to_and_none_is_no_effect() {
        let (mut draw, stand) = stand();
        assert!(of_limit(&stand, 0, LIMITS.0) < 1.0);
        for row in steps_of_limit(&stand, 0, 7.3) {
            assert!((row.iter().sum::<f64>() - 1.0).abs() < 1e-6);
        }
        let f = slew(&stand, "", 0, 30.0);
        assert!((f.strength - 30.0).abs() < 0.1, "{}", f.strength);
        let Change::Made(change) = f.change else {
            panic!("it makes no counts")
        };
        let mut jump = vec![0; 10];
        jump.extend([1000; 10]);
        let read = change(&[jump.clone(), jump.clone(), jump], &mut draw);
        let steps: Vec<i32> = read[9..].windows(2).map(|w| w[1] - w[0]).collect();
        let (least, most) = (steps.iter().min(), steps.iter().max());
        assert!(most.zip(least).is_some_and(|(m, l)| m - l <= 1 && *l > 3));
    }
}
