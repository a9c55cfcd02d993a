//! How often each code occurs, and the levels of which a law of them is made.

use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;

use statrs::distribution::{ContinuousCDF, Normal};

use crate::audit::cells::Cells;

/// Levels in a spread.
pub(super) const BY_SPREAD: f64 = 2.0;
/// Spreads beyond which a level has no codes.
const REACH: f64 = 6.5;

/// How often each code occurs.
#[derive(Clone, Debug)]
pub(in crate::audit) struct Histogram {
    /// The first code.
    pub first: i32,
    /// Occurrences from there on; the last one is not 0.
    pub times: Vec<f64>,
    pub n: f64,
    pub mean: f64,
    /// Standard deviation.
    pub spread: f64,
    /// Levels that were made: faults that move codes as far have the same.
    known: RefCell<HashMap<OfLevels, Rc<Levels>>>,
}

/// What levels are made of: first code, codes, and the bits of spread and cells.
type OfLevels = (i32, usize, [u64; 3]);

/// Levels of one spread.
#[derive(Debug)]
pub(super) struct Levels {
    pub at: Vec<f64>,
    /// Of each: its first code, and the chances from there on.
    pub chances: Vec<(usize, Vec<f64>)>,
}

impl Levels {
    fn new(first: i32, codes: usize, spread: f64, cells: Cells) -> Self {
        let normal = Normal::standard();
        let step = spread / BY_SPREAD;
        let levels: Vec<f64> = (0..=((codes - 1) as f64 / step) as usize)
            .map(|k| f64::from(first) + k as f64 * step)
            .collect();
        let chances = levels
            .iter()
            .map(|m| {
                let at = |x: f64| (x - f64::from(first)).clamp(0.0, (codes - 1) as f64) as usize;
                let (a, b) = (at(m - REACH * spread), at(m + REACH * spread));
                let begin = |i: usize| cells.begin(f64::from(first) + i as f64);
                let edge = |i: usize| normal.cdf((begin(i) - m) / spread);
                let edges: Vec<f64> = (a..=b + 1).map(edge).collect();
                (a, edges.windows(2).map(|w| w[1] - w[0]).collect())
            })
            .collect();
        Self {
            at: levels,
            chances,
        }
    }
}

impl Histogram {
    /// Of the codes but for single far ones, which no law of the bulk explains: those beyond `far` of the middle 99.8 %.
    pub(in crate::audit) fn new(codes: &[i32], far: f64) -> Option<Self> {
        let mut sorted = codes.to_vec();
        sorted.sort_unstable();
        let last = sorted.len().checked_sub(1)?;
        let at = |share: f64| f64::from(sorted[(share * last as f64).round() as usize]);
        let (low, high) = (at(0.001) - far, at(0.999) + far);
        let near: Vec<i32> = sorted
            .into_iter()
            .filter(|c| (low..=high).contains(&f64::from(*c)))
            .collect();
        let (first, end) = (*near.first()?, *near.last()?);
        let mut times = vec![0.0; (end - first) as usize + 1];
        near.iter().for_each(|c| times[(c - first) as usize] += 1.0);
        let n = near.len() as f64;
        let mean = near.iter().map(|c| f64::from(*c)).sum::<f64>() / n;
        let variance = near
            .iter()
            .map(|c| (f64::from(*c) - mean).powi(2))
            .sum::<f64>()
            / n;
        Some(Self {
            first,
            times,
            n,
            mean,
            spread: variance.sqrt(),
            known: RefCell::default(),
        })
    }

    pub(in crate::audit) fn last(&self) -> i32 {
        self.first + self.times.len() as i32 - 1
    }

    /// Codes that occur, with how often.
    pub(in crate::audit) fn iter(&self) -> impl Iterator<Item = (i32, f64)> {
        let own = self.times.iter().zip(self.first..);
        own.filter(|(t, _)| **t > 0.0).map(|(t, c)| (c, *t))
    }

    /// Log likelihood when every code has a share of its own, whatever it is, less what so many shares cost: half of
    /// ln n for each (the criterion of Schwarz).
    pub(in crate::audit) fn of_its_own(&self) -> f64 {
        let cost = 0.5 * self.n.ln();
        self.iter().map(|(_, t)| t * (t / self.n).ln() - cost).sum()
    }

    /// Levels of a spread over so many codes from a first one on, made once.
    pub(super) fn levels(&self, first: i32, codes: usize, spread: f64, cells: Cells) -> Rc<Levels> {
        let key = (
            first,
            codes,
            [spread, cells.step, cells.offset].map(f64::to_bits),
        );
        let mut known = self.known.borrow_mut();
        let levels = known.entry(key);
        let levels = levels.or_insert_with(|| Rc::new(Levels::new(first, codes, spread, cells)));
        Rc::clone(levels)
    }
}
