//! Short-time spectra of a residual.

use super::*;

/// Spectra of a series in windows that do not overlap.
pub(super) struct Spectra {
    /// Samples of a window.
    pub(super) length: usize,
    /// Squared coefficients of the DCT-II, by window.
    pub(super) of: Vec<Vec<f64>>,
}

pub(super) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

impl Spectra {
    pub(super) fn new(e: &[f64], length: usize) -> Self {
        let dct = Dct::new(length);
        let square = |c: &[f64]| dct.forward(c).iter().map(|v| v * v).collect();
        Self {
            length,
            of: e.chunks_exact(length).map(square).collect(),
        }
    }

    /// Mean of a series in each window.
    pub(super) fn means(&self, values: &[f64]) -> Vec<f64> {
        let windows = values.chunks_exact(self.length).map(mean);
        windows.take(self.of.len()).collect()
    }

    /// Octaves of coefficients: first one and end.
    pub(super) fn bands(&self) -> Vec<(usize, usize)> {
        let mut all = vec![(0, 2)];
        while let Some((_, end)) = all.last().filter(|b| b.1 < self.length) {
            all.push((*end, (2 * end).min(self.length)));
        }
        all
    }

    /// Energy of each coefficient over the mean of its window and over that of its frequency: what is steady in pitch, and what
    /// is louder at all pitches, is 1.
    pub(super) fn evened(&self) -> Vec<Vec<f64>> {
        let levels: Vec<f64> = self
            .of
            .iter()
            .map(|w| mean(w).max(f64::MIN_POSITIVE))
            .collect();
        let over = |w: &[f64], level: f64| w.iter().map(|v| v / level).collect();
        let mut all: Vec<Vec<f64>> = (self.of.iter().zip(&levels))
            .map(|(w, l)| over(w, *l))
            .collect();
        let mut columns = vec![0.0; self.length];
        for w in &all {
            columns
                .iter_mut()
                .zip(w)
                .for_each(|(c, v)| *c += v / self.of.len() as f64);
        }
        for w in &mut all {
            let pairs = w.iter_mut().zip(&columns);
            pairs.for_each(|(v, c)| *v /= c.max(f64::MIN_POSITIVE));
        }
        all
    }
}
