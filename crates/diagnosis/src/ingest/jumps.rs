//! Levels that jump from one reading to the next and stay: a bias that steps, a range that switches, a sign that flips.
//!
//! White noise and a random walk, which tell what readings are too far off to be believed, know no jump. Beside one of a dozen
//! standard deviations the readings on either side are farther off than noise is; set aside and filled by the walk, they make a
//! ramp of it, and the larger the jump the longer. So before that is asked the levels are made one. What is taken off comes
//! back: whether it is a step, the search tells.

mod settling;
mod two_levels;

use std::sync::Arc;

use settling::Settling;

use crate::fit::likelihood::{Bins, Dct, Noise, Panel};
use numerics::order_statistics::median;
use numerics::series::white_by_differences;
use numerics::tails;
pub(crate) use two_levels::TwoLevels;

/// Readings on either side that tell of a level, and the fewest.
const LEVEL: usize = 16;
const FEWEST: usize = 6;
/// Readings that may lie on the way from one level to the other: a filter has so many.
const ON_THE_WAY: usize = 3;
/// Least jump: standard deviations of the readings about their levels, and of the change of two of them. Half of it is less than
/// single readings need to be too far off.
const APART: f64 = 6.0;
/// Standard deviations within which a reading lies at its level.
const AT_LEVEL: f64 = 5.0;
/// Part of a jump that is left of it where the level has come back.
const BACK: f64 = 0.25;
/// Readings in a record for each jump, at least: what jumps more often is a process, which a random walk stands for.
const SELDOM: usize = 100;

/// One of them: the first reading at the new level, and how far it is from the old one.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Jump {
    at: usize,
    height: f64,
}

/// The jumps of a channel.
#[derive(Clone, Default)]
pub struct Jumps {
    all: Vec<Jump>,
    /// How the level settles from the first reading on.
    settling: Option<Settling>,
    /// Places of the readings that lie on the way.
    pub(super) on_the_way: Vec<usize>,
    /// White noise and a random walk of the readings without their jumps.
    pub(super) fit: Option<(Noise, f64)>,
    /// Whether they go between two levels.
    two_levels: bool,
}

impl Jumps {
    /// Those of readings in steps of `step`, NaN where there is none.
    pub(super) fn of(y: &[f64], step: f64) -> Self {
        if let Some(two) = TwoLevels::of(y, step) {
            return Self {
                all: two.jumps(),
                on_the_way: two.on_the_way,
                fit: None,
                two_levels: true,
                settling: None,
            };
        }
        let known: Vec<f64> = y.iter().copied().filter(|v| v.is_finite()).collect();
        let sigma = white_by_differences(&known).sqrt().max(0.5 * step);
        // What settles fast jumps as well, until it is taken off.
        if let Some(settling) = Settling::of(y, sigma, y.len()) {
            let mut rest = y.to_vec();
            settling.add(&mut rest, -1.0);
            return Self {
                settling: Some(settling),
                ..Self::steps(&rest, sigma)
            };
        }
        let steps = Self::steps(y, sigma);
        let end = steps.all.first().map_or(0, |jump| jump.at);
        Self {
            settling: Settling::of(y, sigma, end),
            ..steps
        }
    }

    /// Those that stay.
    fn steps(y: &[f64], sigma: f64) -> Self {
        let (places, known): (Vec<usize>, Vec<f64>) = (y.iter().copied().enumerate())
            .filter(|(_, v)| v.is_finite())
            .unzip();
        // A random walk has gone farther after more readings.
        let apart: Vec<f64> = (1..=ON_THE_WAY + 1)
            .map(|gap| APART * change(&known, gap).max(2f64.sqrt() * sigma))
            .collect();
        let mut found = Self::default();
        let mut from = 0;
        for k in FEWEST..known.len().saturating_sub(FEWEST) {
            let Some((gap, height)) = between(&known, from, k, (sigma, &apart)) else {
                continue;
            };
            let at = places[k];
            // Over a longer hole nobody knows that it jumps.
            if at - places[k - gap] > 2 * ON_THE_WAY {
                continue;
            }
            from = k;
            found.all.push(Jump { at, height });
            let way = k + 1 - gap..k;
            found.on_the_way.extend(way.map(|i| places[i]));
        }
        if found.all.len() * SELDOM > known.len() {
            return Self::default();
        }
        found
    }

    /// Standard deviation of the level that they make over so many readings.
    pub(crate) fn spread(&self, readings: usize) -> f64 {
        let mut level = vec![0.0; readings];
        self.add(&mut level, 1.0);
        let n = readings as f64;
        let mean = level.iter().sum::<f64>() / n;
        (level.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt()
    }

    /// Whether one of them comes back to the level before it within so many readings: something that is over, and no level that stays.
    pub(super) fn come_back(&self, within: usize) -> bool {
        let back = |(i, first): (usize, &Jump)| {
            let mut off = first.height;
            let soon = |jump: &&Jump| jump.at - first.at <= within;
            let mut next = self.all[i + 1..].iter().take_while(soon);
            next.any(|jump| {
                off += jump.height;
                off.abs() < BACK * first.height.abs()
            })
        };
        !self.two_levels && self.all.iter().enumerate().any(back)
    }

    /// Whether there are none.
    pub(super) fn is_empty(&self) -> bool {
        self.all.is_empty() && self.settling.is_none()
    }

    /// Takes two levels off readings, and gives white noise and a random walk of what that leaves; nothing of other jumps, which may be
    /// a part of what is asked.
    pub(super) fn take_levels_off(&self, y: &mut [f64]) -> Option<&(Noise, f64)> {
        let fit = self.fit.as_ref().filter(|_| self.two_levels)?;
        self.add(y, -1.0);
        Some(fit)
    }

    /// Readings at one level, those on the way left out.
    pub(super) fn levelled(&self, y: &[f64]) -> Vec<f64> {
        let mut y = y.to_vec();
        self.add(&mut y, -1.0);
        self.on_the_way.iter().for_each(|i| y[*i] = f64::NAN);
        y
    }

    fn add(&self, y: &mut [f64], sign: f64) {
        if let Some(settling) = self.settling {
            settling.add(y, sign);
        }
        let mut next = self.all.iter().peekable();
        let mut level = 0.0;
        for (i, v) in y.iter_mut().enumerate() {
            while let Some(jump) = next.next_if(|j| j.at <= i) {
                level += sign * jump.height;
            }
            *v += level;
        }
    }

    /// Puts them back into levelled readings: what white noise and a random walk make of these is kept, and they are fitted anew.
    /// Returns the coefficients.
    pub(super) fn put_back(
        &mut self,
        y: &mut [f64],
        fit: &mut (Noise, f64),
        (dct, bins): (&Dct, &Arc<Bins>),
    ) -> Arc<Vec<f64>> {
        self.add(y, 1.0);
        let panel = Panel::new(dct, bins, y);
        let (noise, solution) = panel.fit(&Noise::new(-12.0), &[]);
        self.fit = Some(std::mem::replace(fit, (noise, solution.white)));
        panel.column(0)
    }
}

/// Standard deviation of the change over so many readings, by the median of its size: jumps do not move it.
fn change(known: &[f64], gap: usize) -> f64 {
    let pairs = known.iter().zip(known.iter().skip(gap));
    let sizes: Vec<f64> = pairs.map(|(a, b)| (b - a).abs()).collect();
    median(&sizes) / tails::MEDIAN.sqrt()
}

/// How many readings before the one at `k` of all that are `known` the level was another, and how far off it was; `from` is where that
/// level begins, and `apart` how far two readings lie at least for it, by how many they are apart.
fn between(
    known: &[f64],
    from: usize,
    k: usize,
    (sigma, apart): (f64, &[f64]),
) -> Option<(usize, f64)> {
    (1..).zip(apart).find_map(|(gap, least)| {
        if k < from + gap + FEWEST - 1 || (known[k] - known[k - gap]).abs() < *least {
            return None;
        }
        let last = k - gap;
        let before = &known[from.max((last + 1).saturating_sub(LEVEL))..=last];
        let after = &known[k..(k + LEVEL).min(known.len())];
        let (a, b) = (median(before), median(after));
        let off = |part: &[f64], level: f64| {
            let sizes: Vec<f64> = part.iter().map(|v| (v - level).abs()).collect();
            median(&sizes) / tails::MEDIAN.sqrt()
        };
        let wide = off(before, a).max(off(after, b)).max(sigma);
        let (low, high) = (a.min(b) - AT_LEVEL * wide, a.max(b) + AT_LEVEL * wide);
        let at_level = |v: f64, level: f64| (v - level).abs() < AT_LEVEL * wide;
        let jumps = (b - a).abs() > APART * wide
            && at_level(known[last], a)
            && at_level(known[k], b)
            && known[last..=k].iter().all(|v| (low..=high).contains(v));
        jumps.then_some((gap, b - a))
    })
}
