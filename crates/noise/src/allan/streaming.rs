//! Overlapping Allan deviation of a live capture: O(longest τ) memory, whatever the length of the run.

use super::{Estimate, PhasePoint};

/// Overlapping Allan deviation on the octave grid, sample by sample.
///
/// Holds 2·m_max + 1 points of the integrated readings in a ring and one sum for each averaging factor; a gap starts a
/// new run, as everywhere in this crate. `i64` counts are summed exactly for as long as they fit.
#[derive(Clone, Debug)]
pub struct Streaming<T> {
    tau0: f64,
    unit: f64,
    ring: Vec<T>,
    mask: usize,
    /// Points of the present run, the first of them the zero before its first sample.
    points: usize,
    sum: T,
    squares: Vec<f64>,
    terms: Vec<usize>,
}

impl<T: PhasePoint> Streaming<T> {
    /// For samples every `tau0` seconds, each worth `unit` U, with averaging factors 1, 2, 4, ... 2^`octaves`.
    #[must_use]
    pub fn new(tau0: f64, unit: f64, octaves: u32) -> Self {
        let size = 1usize << (octaves + 2);
        Self {
            tau0,
            unit,
            ring: vec![T::default(); size],
            mask: size - 1,
            points: 1,
            sum: T::default(),
            squares: vec![0.0; octaves as usize + 1],
            terms: vec![0; octaves as usize + 1],
        }
    }

    /// The next sample. A reading far from zero should come with its typical value taken out, as a deviation does not
    /// see it and sums stay small.
    pub fn push(&mut self, sample: T) {
        self.sum = self.sum + sample;
        let head = self.points;
        self.ring[head & self.mask] = self.sum;
        self.points += 1;
        for (octave, (squares, terms)) in self.squares.iter_mut().zip(&mut self.terms).enumerate() {
            let m = 1usize << octave;
            let Some(first) = head.checked_sub(2 * m) else {
                break;
            };
            let (a, b) = (
                self.ring[first & self.mask],
                self.ring[(head - m) & self.mask],
            );
            let value = ((self.sum - b) - (b - a)).to_f64();
            *squares += value * value;
            *terms += 1;
        }
    }

    /// Samples are missing before the next one: no difference will span the place.
    pub fn gap(&mut self) {
        self.points = 1;
        self.sum = T::default();
        self.ring[0] = T::default();
    }

    /// The deviations so far.
    #[must_use]
    pub fn estimates(&self) -> Vec<Estimate> {
        self.squares
            .iter()
            .zip(&self.terms)
            .enumerate()
            .filter(|(_, (_, n))| **n > 0)
            .map(|(octave, (squares, n))| {
                let m = 1usize << octave;
                Estimate {
                    m,
                    tau_s: m as f64 * self.tau0,
                    deviation: (squares / (2.0 * *n as f64)).sqrt() / m as f64 * self.unit,
                    n: *n,
                }
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::allan::{Deviation, Phase, deviation};

    #[test]
    fn the_stream_gives_the_deviations_of_the_whole_with_a_gap_in_it() {
        let counts: Vec<i32> = (0..500i64)
            .map(|k| ((k * k * 7919 + 31 * k) % 101) as i32 - 50)
            .collect();
        let mut stream = Streaming::<i64>::new(0.05, 0.1, 6);
        for (i, c) in counts.iter().enumerate() {
            if i == 123 {
                stream.gap();
            }
            stream.push(i64::from(*c));
        }
        let phase = Phase::from_counts(&counts, 0.1, &[0..123, 123..500]);
        let live = stream.estimates();
        assert_eq!(live.len(), 7);
        for e in live {
            let whole = deviation(&phase, Deviation::Oadev, 0.05, e.m).unwrap();
            assert_eq!(e.n, whole.n);
            assert!((e.deviation / whole.deviation - 1.0).abs() < 1e-12);
        }
    }
}
