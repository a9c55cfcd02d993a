//! The world that a record saw, on its grid, and what of the record is held against replicates.

use std::ops::Range;

use model::file::ModelFile;
use model::record::{Channel, Header, Quantity, Record};

use crate::ingest::types::{Grid, Target};

/// Longest record of which every sample is simulated; of a longer one as many in all, in stretches.
const MOST: usize = 1 << 17;
/// A stretch is to hold angles over 100 s and more, s, and is within these lengths.
const STRETCH_S: f64 = 240.0;
const STRETCH: [usize; 2] = [1 << 12, 1 << 15];

/// The parts of a record that are compared, of one length, which transforms like.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Parts {
    /// Samples of each.
    pub length: usize,
    /// Where they are in the record.
    pub stretches: Vec<Range<usize>>,
}

impl Parts {
    /// Of a record of `n` samples: the whole, but for a few of the last samples that would make its length an awkward one,
    /// or stretches at equal distances.
    pub fn of(n: usize, rate_hz: f64) -> Self {
        if n <= MOST {
            let length = (2..=n).rev().find(|m| handy(*m)).unwrap_or(n);
            return Self {
                length,
                stretches: std::iter::once(0..length).collect(),
            };
        }
        let wanted = (STRETCH_S * rate_hz).max(1.0).log2().ceil() as u32;
        let length = (1usize << wanted.min(30)).clamp(STRETCH[0], STRETCH[1]);
        let count = MOST / length;
        let start = |j: usize| (n - length) * j / (count - 1);
        Self {
            length,
            stretches: (0..count).map(|j| start(j)..start(j) + length).collect(),
        }
    }

    /// These parts of a column, one after the other.
    pub fn pick(&self, column: &[f64]) -> Vec<f64> {
        let parts = self.stretches.iter().flat_map(|s| &column[s.clone()]);
        parts.copied().collect()
    }

    /// Where a sample of the record is among what is picked.
    fn place(&self, sample: usize) -> Option<usize> {
        let part = self.stretches.iter().position(|s| s.contains(&sample))?;
        Some(part * self.length + sample - self.stretches[part].start)
    }
}

/// An even number without a prime factor above 5.
fn handy(n: usize) -> bool {
    let without = |mut n: usize, p: usize| {
        while n.is_multiple_of(p) {
            n /= p;
        }
        n
    };
    n.is_multiple_of(2) && without(without(without(n, 2), 3), 5) == 1
}

/// What was recorded beside the gyros, without reading noise where that is known, and what the gyros read.
pub(super) fn record_of(grid: &Grid) -> Record {
    let gyro = |name: &str| grid.targets.iter().find(|t| t.name == name);
    let channels = grid.signals.iter().map(|s| {
        let target = gyro(&s.name).filter(|_| s.quantity == Quantity::Gyro);
        Channel {
            name: s.name.clone(),
            quantity: s.quantity,
            axis: s.axis,
            unit: target.map_or_else(|| s.unit.clone(), |t| t.unit.clone()),
            values: s.smooth.to_vec(),
            counts: None,
            lsb: target.map_or(s.lsb, |t| t.lsb),
        }
    });
    Record {
        header: Header {
            rate_hz: Some(grid.rate_hz),
            base: grid.base,
            ..Header::default()
        },
        channels: channels.collect(),
        ..Record::default()
    }
}

/// A gyro as it was read, what the search set aside put back, and the samples that it lacks.
pub(super) struct Measured {
    /// Of the parts that are compared.
    pub values: Vec<f64>,
    /// Places among them without a reading, or in a turn of the base.
    pub lost: Vec<usize>,
}

pub(super) fn measured(target: &Target, parts: &Parts) -> Measured {
    let mut y = target.y.to_vec();
    let mut lost = vec![false; y.len()];
    target.lost.iter().for_each(|i| lost[*i] = true);
    for (place, read) in &target.aside {
        (y[*place], lost[*place]) = (*read, false);
    }
    for e in &target.excursions {
        lost[e.with_margin(y.len())].fill(true);
    }
    let places = (0..y.len())
        .filter(|i| lost[*i])
        .filter_map(|i| parts.place(i));
    let lost = places.collect();
    let mut measured = Measured {
        values: parts.pick(&y),
        lost,
    };
    bridge(&mut measured.values, &measured.lost);
    measured
}

/// Puts straight lines where readings are lost, given by their places in order.
pub(super) fn bridge(values: &mut [f64], lost: &[usize]) {
    let n = values.len();
    let mut k = 0;
    while k < lost.len() {
        let run = (k..lost.len())
            .take_while(|j| lost[*j] == lost[k] + j - k)
            .count();
        let (from, to) = (lost[k], lost[k] + run);
        let (left, right) = (
            from.checked_sub(1).map(|i| values[i]),
            (to < n).then(|| values[to]),
        );
        let [a, b] = match (left, right) {
            (Some(a), Some(b)) => [a, b],
            (Some(a), None) | (None, Some(a)) => [a, a],
            (None, None) => [0.0, 0.0],
        };
        for (step, v) in values[from..to].iter_mut().enumerate() {
            *v = a + (b - a) * (step + 1) as f64 / (run + 1) as f64;
        }
        k += run;
    }
}

/// The model whose readings come in the steps that the record's show.
pub(super) fn in_steps(model: &ModelFile, grid: &Grid) -> ModelFile {
    let mut model = model.clone();
    for channel in model.channels.iter_mut().filter(|c| c.lsb.is_none()) {
        let target = grid.targets.iter().find(|t| t.name == channel.name);
        channel.lsb = target.map(|t| t.step).filter(|step| *step > 0.0);
    }
    model
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lost_readings_are_bridged_and_ends_held() {
        let mut values = [9.0, 1.0, 9.0, 9.0, 4.0, 9.0];
        bridge(&mut values, &[0, 2, 3, 5]);
        assert_eq!(values, [1.0, 1.0, 2.0, 3.0, 4.0, 4.0]);
    }

    #[test]
    fn a_short_record_is_compared_whole_and_a_day_in_stretches_over_all_of_it() {
        let short = Parts::of(12_007, 20.0);
        assert_eq!(short.stretches, vec![0..12_000]);
        let day = Parts::of(1_728_000, 20.0);
        assert_eq!(day.length, 8192);
        assert_eq!(day.stretches.len() * day.length, MOST);
        assert_eq!(day.stretches[0].start, 0);
        assert_eq!(day.stretches.last().map(|s| s.end), Some(1_728_000));
    }
}
