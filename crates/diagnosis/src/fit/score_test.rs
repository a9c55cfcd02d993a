//! What sequences explain beside columns under noise as it was fitted. None of them is kept: a name is asked by many.

use crate::fit::likelihood::{Normal, Panel};
use numerics::column::Column;
use numerics::wide;

/// Coefficients that a processor has at hand, of all columns at once.
const AT_HAND: usize = 1 << 11;

/// Columns of a panel under one noise.
pub(crate) struct Beside<'a> {
    panel: &'a Panel,
    data_and_columns: Vec<Column>,
    /// 1/g at every coefficient.
    weight: Vec<f64>,
    normal: Normal,
    /// Log likelihood of the columns alone.
    alone: f64,
}

impl<'a> Beside<'a> {
    /// Columns under the shape `g` over the bins.
    pub(crate) fn new(panel: &'a Panel, g: &[f64], columns: &[usize]) -> Self {
        let weight: Vec<f64> = g.iter().map(|g| 1.0 / g).collect();
        let normal = panel.normal(&weight, columns);
        Self {
            alone: likelihood(panel, &normal),
            panel,
            data_and_columns: panel.data_and(columns),
            weight: panel.bins.spread(&weight),
            normal,
        }
    }

    /// Likelihood ratio that sequences of samples gain, each let go of once it is transformed, and how many they are.
    pub(crate) fn gain_of(&self, further: impl IntoIterator<Item = Vec<f64>>) -> (f64, usize) {
        let new = self.panel.dct.columns(further);
        let all = [&self.data_and_columns[..], &new].concat();
        let sums = products(&new, &all, &self.weight);
        let mut normal = self.normal.clone();
        // Each row holds the data first, and ends with its own square.
        for (i, own) in normal.matrix.iter_mut().enumerate() {
            own.extend(sums.iter().map(|row| row[1 + i]));
        }
        let own = self.data_and_columns.len();
        for (i, row) in sums.iter().enumerate() {
            normal.right.push(row[0]);
            let behind = sums[i + 1..].iter().map(|other| other[own + i]);
            let row = row[1..].iter().copied().chain(behind);
            normal.matrix.push(row.collect());
        }
        let gain = 2.0 * (likelihood(self.panel, &normal) - self.alone);
        (gain, new.len())
    }
}

wide! {
    /// Sums of products of the last of some columns with all of them up to themselves, under weights at every coefficient.
    fn products[](last: &[Column], all: &[Column], weight: &[f64]) -> Vec<Vec<f64>> = products_of
}

#[inline(always)]
fn products_of(last: &[Column], all: &[Column], weight: &[f64]) -> Vec<Vec<f64>> {
    let first = all.len() - last.len();
    let mut sums: Vec<Vec<f64>> = (0..last.len()).map(|i| vec![0.0; first + i + 1]).collect();
    let mut weighted = [vec![], vec![]];
    for (at, weight) in weight.chunks(AT_HAND).enumerate() {
        let part = at * AT_HAND..at * AT_HAND + weight.len();
        for (sums, two) in sums.chunks_mut(2).zip(last.chunks(2)) {
            for (c, weighted) in two.iter().zip(&mut weighted) {
                c.times(part.clone(), weight, weighted);
            }
            let [a, b] = weighted.each_ref().map(Vec::as_slice);
            let with = all.iter().map(|c| (c, part.clone()));
            match sums {
                [one, two] => {
                    let shared = one.len();
                    let (both, beyond) = two.split_at_mut(shared);
                    for (((c, part), p), q) in with.clone().zip(one).zip(both) {
                        let more = c.along_two(part, [a, b]);
                        *p += more[0];
                        *q += more[1];
                    }
                    for ((c, part), q) in with.skip(shared).zip(beyond) {
                        *q += c.along(part, b);
                    }
                }
                one => {
                    for ((c, part), p) in with.zip(one.iter_mut().flatten()) {
                        *p += c.along(part, a);
                    }
                }
            }
        }
    }
    sums
}

/// Log likelihood but for the part of the noise, which is the same.
fn likelihood(panel: &Panel, normal: &Normal) -> f64 {
    let n = (panel.bins.n - 1) as f64;
    normal.solved(n, 0.0).log_likelihood
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::fit::likelihood::{Bins, Dct};

    #[test]
    fn what_is_gained_beside_columns_is_what_a_panel_with_all_of_them_gains() {
        let n = 5000;
        let mut state = 9u32;
        let mut column = || -> Vec<f64> {
            let next = |_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                f64::from(state >> 8) / f64::from(1u32 << 24) - 0.5
            };
            (0..n).map(next).collect()
        };
        let (dct, bins) = (Dct::new(n), Arc::new(Bins::new(n)));
        let panel = Panel::new(&dct, &bins, &column());
        let own: Vec<usize> = (0..4).map(|_| panel.add(&column())).collect();
        let mut further: Vec<Vec<f64>> = (0..3).map(|_| column()).collect();
        // One that the others span.
        let sum = further[0].iter().zip(&further[1]).map(|(a, b)| a + b);
        further.push(sum.collect());
        let g: Vec<f64> = bins.at.omega.iter().map(|w| 1.0 + 0.1 / w).collect();
        let (gain, count) = Beside::new(&panel, &g, &own).gain_of(further.clone());
        assert_eq!(count, 4);
        let alone = panel.solve(&g, &own).log_likelihood;
        let all = [own, panel.add_all(&further)].concat();
        let whole = panel.solve(&g, &all).log_likelihood;
        let expected = 2.0 * (whole - alone);
        assert!(
            (gain - expected).abs() < 1e-8 * expected,
            "{gain} {expected}"
        );
    }
}
