//! What sequences explain beside columns under noise as it was fitted. None of them is kept: a name is asked by many.

use crate::column::Column;
use crate::likelihood::{Normal, Panel};
use crate::wide::wide;

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
        // Each row holds the data first.
        for (i, own) in normal.matrix.iter_mut().enumerate() {
            own.extend(sums.iter().map(|row| row[1 + i]));
        }
        for row in sums {
            normal.right.push(row[0]);
            normal.matrix.push(row[1..].to_vec());
        }
        let gain = 2.0 * (likelihood(self.panel, &normal) - self.alone);
        (gain, new.len())
    }
}

wide! {
    /// Sums of products of columns with others under weights at every coefficient.
    fn products[](of: &[Column], with: &[Column], weight: &[f64]) -> Vec<Vec<f64>> = products_of
}

#[inline(always)]
fn products_of(of: &[Column], with: &[Column], weight: &[f64]) -> Vec<Vec<f64>> {
    let mut sums = vec![vec![0.0; with.len()]; of.len()];
    let mut weighted = [vec![], vec![]];
    for (at, weight) in weight.chunks(AT_HAND).enumerate() {
        let part = at * AT_HAND..at * AT_HAND + weight.len();
        for (sums, two) in sums.chunks_mut(2).zip(of.chunks(2)) {
            for (c, weighted) in two.iter().zip(&mut weighted) {
                c.times(part.clone(), weight, weighted);
            }
            let [a, b] = weighted.each_ref().map(Vec::as_slice);
            for (i, other) in with.iter().enumerate() {
                match &mut *sums {
                    [first, second] => {
                        let [p, q] = other.along_two(part.clone(), [a, b]);
                        first[i] += p;
                        second[i] += q;
                    }
                    rest => rest
                        .iter_mut()
                        .for_each(|s| s[i] += other.along(part.clone(), a)),
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
    use std::rc::Rc;

    use super::*;
    use crate::likelihood::{Bins, Dct};

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
        let (dct, bins) = (Dct::new(n), Rc::new(Bins::new(n)));
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
