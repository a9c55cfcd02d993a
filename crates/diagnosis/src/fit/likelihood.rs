//! The likelihood of white noise + random walk + regressors + stationary terms, in the DCT-II domain.
//!
//! The DCT-II diagonalises a flat-start random walk plus white noise exactly (the path graph's Laplacian has it as
//! eigenvectors): the coefficients c_k, k = 1..N-1, are independent with var c_k = s² g_k,
//! g_k = h(w_k) + lambda / (2 - 2 cos w_k) + further densities, w_k = pi k / N. What a fit needs of the data are sums
//! of products of coefficients over bins in which g hardly changes: singly at low frequency, then 1 % wide.

use std::cell::{Cell, RefCell};
use std::collections::HashMap;
use std::sync::Arc;

mod normal;
pub(crate) mod scoring;
mod walks;

pub use crate::fit::bins::{Bins, Noise, least_walk};
pub(crate) use normal::Normal;
use normal::Sums;
pub use normal::{Solution, invert};
use numerics::column::Column;
pub use numerics::transform::Dct;

/// Two numbers of the samples' bits and places: columns that agree in both are the same. Products of two words, their halves
/// laid on each other.
pub(crate) fn digest(x: &[f64]) -> [u64; 2] {
    const BY: [u64; 4] = [
        0x9e37_79b9_7f4a_7c15,
        0xc2b2_ae3d_27d4_eb4f,
        0x243f_6a88_85a3_08d3,
        0x1319_8a2e_0370_7344,
    ];
    let fold = |a: u64, b: u64| {
        let product = u128::from(a) * u128::from(b);
        product as u64 ^ (product >> 64) as u64
    };
    // Every fourth pair of samples in a number of its own: none waits for the one before.
    let (eights, rest) = x.as_chunks::<8>();
    let mut all = BY;
    for eight in eights {
        for (own, (pair, by)) in all.iter_mut().zip(eight.as_chunks::<2>().0.iter().zip(BY)) {
            *own = fold(pair[0].to_bits() ^ by, pair[1].to_bits() ^ *own);
        }
    }
    for (i, v) in rest.iter().enumerate() {
        let i = i % all.len();
        all[i] = fold(v.to_bits() ^ BY[i], all[i]);
    }
    let length = x.len() as u64;
    [fold(all[0] ^ length, all[1]), fold(all[2] ^ length, all[3])]
}

/// Sums over bins by pair of columns.
type Pairs = HashMap<(usize, usize), Arc<Vec<f64>>>;

/// The data of one channel and all columns that may explain it, as coefficients.
pub struct Panel {
    /// Transform.
    pub dct: Dct,
    /// Bins.
    pub bins: Arc<Bins>,
    columns: RefCell<Vec<Column>>,
    pairs: RefCell<Pairs>,
    revision: Cell<usize>,
}

impl Panel {
    /// A panel on the data `y`, which becomes column 0.
    #[must_use]
    pub fn new(dct: &Dct, bins: &Arc<Bins>, y: &[f64]) -> Self {
        Self::of(dct, bins, Arc::new(dct.forward(y)))
    }

    /// A panel on the first of these sequences, which the others may explain; they are columns 0, 1 and so on, those of a long
    /// record in short numbers.
    pub(crate) fn of_all(dct: &Dct, bins: &Arc<Bins>, all: &[&[f64]]) -> Self {
        let panel = Self::of(dct, bins, Arc::default());
        *panel.columns.borrow_mut() = dct.columns(all);
        panel
    }

    /// A panel on data whose coefficients are known.
    #[must_use]
    pub fn of(dct: &Dct, bins: &Arc<Bins>, coefficients: Arc<Vec<f64>>) -> Self {
        Self {
            dct: dct.clone(),
            bins: Arc::clone(bins),
            columns: RefCell::new(vec![Column::Whole(coefficients)]),
            pairs: RefCell::default(),
            revision: Cell::default(),
        }
    }

    /// Add columns of a candidate, which other channels may have in `common`; returns their numbers.
    pub fn add_candidate(&self, values: &[Vec<f64>], common: bool) -> Vec<usize> {
        self.push(self.candidate(values, common))
    }

    /// The coefficients of a candidate's columns, transformed once for all that have the same in `common`.
    fn candidate(&self, values: &[Vec<f64>], common: bool) -> Vec<Column> {
        if !common {
            return self.dct.columns(values);
        }
        let keys: Vec<[u64; 2]> = values.iter().map(|v| digest(v)).collect();
        let known = &self.dct.known;
        let mut all: Vec<Option<Column>> = keys.iter().map(|k| known.column(k)).collect();
        let missing: Vec<usize> = (0..all.len()).filter(|i| all[*i].is_none()).collect();
        let new: Vec<&Vec<f64>> = missing.iter().map(|i| &values[*i]).collect();
        for (i, c) in missing.into_iter().zip(self.dct.columns(new)) {
            known.keep(keys[i], &c);
            all[i] = Some(c);
        }
        all.into_iter().flatten().collect()
    }

    fn push(&self, new: Vec<Column>) -> Vec<usize> {
        let mut columns = self.columns.borrow_mut();
        let first = columns.len();
        columns.extend(new);
        (first..columns.len()).collect()
    }

    /// Add the columns that go by a name, which other channels may have in `common`: then they are made once. Returns
    /// their numbers.
    pub(crate) fn add_named(
        &self,
        name: &str,
        common: bool,
        make: &dyn Fn() -> Vec<Vec<f64>>,
    ) -> Vec<usize> {
        let made = || self.candidate(&make(), common);
        let all = if common {
            self.dct.known.named(name).unwrap_or_else(|| {
                let all = made();
                self.dct.known.keep_named(name, &all);
                all
            })
        } else {
            made()
        };
        self.push(all)
    }

    /// Add a column of samples; returns its number.
    pub fn add(&self, values: &[f64]) -> usize {
        let c = self.dct.forward(values);
        self.columns.borrow_mut().push(Column::Whole(Arc::new(c)));
        self.columns.borrow().len() - 1
    }

    /// Add columns of samples; returns their numbers.
    pub(crate) fn add_all<X: AsRef<[f64]>>(
        &self,
        values: impl IntoIterator<Item = X>,
    ) -> Vec<usize> {
        let all = self.dct.forward_all(values);
        self.push(all.map(|c| Column::Whole(Arc::new(c))).collect())
    }

    /// Put other coefficients in the place of the data's.
    pub fn replace_data(&self, coefficients: Vec<f64>) {
        self.revision.set(self.revision.get() + 1);
        self.columns.borrow_mut()[0] = Column::Whole(Arc::new(coefficients));
        self.pairs.borrow_mut().retain(|k, _| k.0 > 0);
    }

    /// What `f` makes of the data without a course that is known sample by sample.
    pub(crate) fn without<T>(&self, course: &[f64], f: impl FnOnce() -> T) -> T {
        let data = self.column(0);
        let course = self.dct.forward(course);
        self.replace_data(data.iter().zip(course).map(|(d, c)| d - c).collect());
        let made = f();
        self.replace_data(data.to_vec());
        made
    }

    /// How often the data were replaced.
    pub(crate) fn revision(&self) -> usize {
        self.revision.get()
    }

    /// Coefficients of a column.
    #[must_use]
    pub fn column(&self, i: usize) -> Arc<Vec<f64>> {
        self.columns.borrow()[i].whole()
    }

    /// The data and some columns.
    pub(crate) fn data_and(&self, columns: &[usize]) -> Vec<Column> {
        let all = self.columns.borrow();
        let data = std::iter::once(&0);
        data.chain(columns).map(|c| all[*c].clone()).collect()
    }

    /// The first `count` of them.
    pub(crate) fn first(&self, i: usize, count: usize) -> Vec<f64> {
        self.columns.borrow()[i].first(count)
    }

    /// Adds columns, each by its factor, to coefficients `from` on.
    pub(crate) fn add_columns(&self, sum: &mut [f64], from: usize, columns: &[usize], by: &[f64]) {
        let all = self.columns.borrow();
        for (c, by) in columns.iter().zip(by) {
            all[*c].add_to(sum, from, *by);
        }
    }

    /// Forget the columns from `length` on.
    pub fn truncate(&self, length: usize) {
        self.columns.borrow_mut().truncate(length);
        self.pairs.borrow_mut().retain(|k, _| k.1 < length);
    }

    /// Let go of all columns but the data and `kept`; sums of products that were asked for before stay known.
    pub fn release(&self, kept: &[usize]) {
        for (i, c) in self.columns.borrow_mut().iter_mut().enumerate() {
            if i > 0 && !kept.contains(&i) {
                *c = Column::Whole(Arc::default());
            }
        }
    }

    /// Columns held, the data included.
    #[must_use]
    pub fn width(&self) -> usize {
        self.columns.borrow().len()
    }

    fn pair(&self, i: usize, j: usize) -> Arc<Vec<f64>> {
        self.pairs([(i, j)]).swap_remove(0)
    }

    /// Sums of products of pairs of columns over the bins: those that are not known yet are made together.
    fn pairs(&self, all: impl IntoIterator<Item = (usize, usize)>) -> Vec<Arc<Vec<f64>>> {
        let in_order = |(i, j): (usize, usize)| (i.min(j), i.max(j));
        let keys: Vec<_> = all.into_iter().map(in_order).collect();
        let mut pairs = self.pairs.borrow_mut();
        let asked = |pairs: &Pairs| -> Option<Vec<_>> {
            keys.iter().map(|key| pairs.get(key).cloned()).collect()
        };
        if let Some(all) = asked(&pairs) {
            return all;
        }
        let (columns, known) = (self.columns.borrow(), &self.dct.known);
        let two = |key: &(usize, usize)| [&columns[key.0], &columns[key.1]];
        let mut missing = vec![];
        for key in &keys {
            if pairs.contains_key(key) || missing.contains(key) {
                continue;
            }
            // What others know is over the bins that every record of this length has.
            let shared = || known.products(two(key)).filter(|_| self.bins.plain);
            match shared() {
                Some(p) => drop(pairs.insert(*key, p)),
                None => missing.push(*key),
            }
        }
        let of: Vec<_> = missing.iter().map(two).collect();
        for ((key, two), made) in missing.iter().zip(&of).zip(self.bins.products_of(&of)) {
            let made = Arc::new(made);
            if self.bins.plain {
                known.keep_products(*two, &made);
            }
            pairs.insert(*key, made);
        }
        asked(&pairs).unwrap_or_default()
    }

    /// Energy in each bin of what is left of a column when the best multiples of others are taken off.
    pub(crate) fn energy_beyond(&self, g: &[f64], others: &[usize], column: usize) -> Vec<f64> {
        let over = |i, j| -> f64 { self.pair(i, j).iter().zip(g).map(|(p, g)| p / g).sum() };
        let normal: Vec<Vec<f64>> = others
            .iter()
            .map(|a| others.iter().map(|b| over(*a, *b)).collect())
            .collect();
        let right: Vec<f64> = others.iter().map(|o| over(*o, column)).collect();
        let (inverse, _) = invert(&normal);
        let shares = inverse
            .iter()
            .map(|row| -row.iter().zip(&right).map(|(a, b)| a * b).sum::<f64>());
        let all: Vec<(usize, f64)> = others
            .iter()
            .copied()
            .zip(shares)
            .chain([(column, 1.0)])
            .collect();
        let mut energy = vec![0.0; g.len()];
        for (i, a) in &all {
            for (j, b) in &all {
                let pair = self.pair(*i, *j);
                energy
                    .iter_mut()
                    .zip(pair.iter())
                    .for_each(|(e, p)| *e += a * b * p);
            }
        }
        // What rounding leaves of nothing.
        energy.iter_mut().for_each(|e| *e = e.max(0.0));
        energy
    }

    /// Energy in each bin of what columns of these coefficients leave of the data.
    pub(crate) fn energy_left(&self, columns: &[usize], beta: &[f64]) -> Vec<f64> {
        let mut energy = self.pair(0, 0).to_vec();
        for (i, (a, by)) in columns.iter().zip(beta).enumerate() {
            let mut add = |pair: &[f64], by: f64| {
                energy.iter_mut().zip(pair).for_each(|(e, p)| *e += by * p);
            };
            add(&self.pair(0, *a), -2.0 * by);
            add(&self.pair(*a, *a), by * by);
            for (b, other) in columns[i + 1..].iter().zip(&beta[i + 1..]) {
                add(&self.pair(*a, *b), 2.0 * by * other);
            }
        }
        // What rounding leaves of nothing.
        energy.iter_mut().for_each(|e| *e = e.max(0.0));
        energy
    }

    /// Least squares of the data on `columns` under the shape `g` over the bins.
    #[must_use]
    pub fn solve(&self, g: &[f64], columns: &[usize]) -> Solution {
        self.solve_by(&self.sums(columns), g)
    }

    /// The same by sums that are known.
    fn solve_by(&self, sums: &Sums, g: &[f64]) -> Solution {
        let weight: Vec<f64> = g.iter().map(|g| 1.0 / g).collect();
        self.solved(&sums.under(&weight), self.bins.log_det(g))
    }

    /// As [`Panel::solve`], with 1/g and the sum of ln g at hand.
    #[must_use]
    pub fn solve_weighted(
        &self,
        weight: &[f64],
        log_det_noise: f64,
        columns: &[usize],
    ) -> Solution {
        self.solved(&self.normal(weight, columns), log_det_noise)
    }

    fn solved(&self, normal: &Normal, log_det_noise: f64) -> Solution {
        normal.solved((self.bins.n - 1) as f64, log_det_noise)
    }

    /// Sums of products under weights over the bins.
    pub(crate) fn normal(&self, weight: &[f64], columns: &[usize]) -> Normal {
        self.sums(columns).under(weight)
    }

    /// Sums of products over the bins that least squares on columns need.
    fn sums(&self, columns: &[usize]) -> Sums {
        let data_and = || std::iter::once(&0).chain(columns);
        let from = |(i, a): (usize, &usize)| {
            let a = *a;
            data_and().skip(i).map(move |b| (a, *b))
        };
        Sums {
            columns: columns.len(),
            pairs: self.pairs(data_and().enumerate().flat_map(from)),
        }
    }

    /// Maximise over the random walk and the coordinates of all terms, from where `noise` is.
    #[must_use]
    pub fn fit(&self, noise: &Noise, columns: &[usize]) -> (Noise, Solution) {
        if noise.terms.is_empty() {
            let walk = self.best_walk(noise, columns);
            let solution = self.solve(&walk.over(&self.bins), columns);
            return (walk, solution);
        }
        if scoring::serves(noise) {
            return scoring::fit(self, noise, columns);
        }
        let n = self.bins.n;
        let mut bounds = vec![(least_walk(n), 6.0)];
        let mut start = vec![noise.log_walk.max(least_walk(n))];
        let mut steps = vec![1.0];
        for (term, theta) in &noise.terms {
            bounds.extend(term.bounds(n));
            start.extend(theta);
            steps.extend(theta.iter().map(|_| 0.6));
        }
        let unpack = |x: &[f64]| {
            let mut rest = &x[1..];
            let terms = noise
                .terms
                .iter()
                .map(|(term, theta)| {
                    let (own, tail) = rest.split_at(theta.len());
                    rest = tail;
                    (Arc::clone(term), own.to_vec())
                })
                .collect();
            Noise {
                log_walk: x[0],
                terms,
            }
        };
        let sums = self.sums(columns);
        let objective = |x: &[f64]| {
            let inside: Vec<f64> = x
                .iter()
                .zip(&bounds)
                .map(|(v, b)| v.clamp(b.0, b.1))
                .collect();
            let outside: f64 = x.iter().zip(&inside).map(|(a, b)| (a - b).powi(2)).sum();
            let g = unpack(&inside).over(&self.bins);
            outside - self.solve_by(&sums, &g).log_likelihood
        };
        let best =
            numerics::minimise::nelder_mead(&objective, &start, &steps, 120 + 60 * start.len());
        let inside: Vec<f64> = best
            .iter()
            .zip(&bounds)
            .map(|(v, b)| v.clamp(b.0, b.1))
            .collect();
        let fitted = unpack(&inside);
        let solution = self.solve_by(&sums, &fitted.over(&self.bins));
        (fitted, solution)
    }

    /// The best random walk with the terms held.
    fn best_walk(&self, noise: &Noise, columns: &[usize]) -> Noise {
        let (low, high) = (least_walk(self.bins.n), 6.0);
        let (with, sums) = (noise.with_walks(&self.bins), self.sums(columns));
        let at = |x: f64| self.solve_by(&sums, &with(x)).log_likelihood;
        let count = 24;
        let step = (high - low) / f64::from(count);
        let best = (0..=count)
            .map(|i| low + step * f64::from(i))
            .map(|x| (x, at(x)))
            .fold(
                (low, f64::NEG_INFINITY),
                |a, b| if b.1 > a.1 { b } else { a },
            );
        let x = numerics::minimise::golden(
            &|x| -at(x),
            (best.0 - step).max(low),
            (best.0 + step).min(high),
            14,
        );
        let log_walk = if at(x) > best.1 { x } else { best.0 };
        Noise {
            log_walk,
            terms: noise.terms.clone(),
        }
    }
}
