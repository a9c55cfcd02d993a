//! Coefficients of the columns that may explain the data.

use std::ops::Range;
use std::sync::Arc;

use crate::wide;

/// Sum of products, in eight sums that a processor makes at once.
#[inline(always)]
pub fn dot<A, B>(a: &[A], b: &[B]) -> f64
where
    A: Copy + Into<f64>,
    B: Copy + Into<f64>,
{
    let (mut eight, mut rest) = ([0.0; 8], 0.0);
    let (x, y) = (a.chunks_exact(8), b.chunks_exact(8));
    for (p, q) in x.remainder().iter().zip(y.remainder()) {
        rest += (*p).into() * (*q).into();
    }
    for (p, q) in x.zip(y) {
        for (sum, (p, q)) in eight.iter_mut().zip(p.iter().zip(q)) {
            *sum += (*p).into() * (*q).into();
        }
    }
    sum_of_eight(eight) + rest
}

/// Sums of products with two, as [`dot`] makes each: a processor that adds to one need not wait for the other.
#[inline(always)]
fn dot_two<A: Copy + Into<f64>>(a: &[A], [b, c]: [&[f64]; 2]) -> [f64; 2] {
    let ([mut first, mut second], mut rest) = ([[0.0; 8]; 2], [0.0; 2]);
    let (x, y, z) = (a.chunks_exact(8), b.chunks_exact(8), c.chunks_exact(8));
    for ((p, q), r) in x.remainder().iter().zip(y.remainder()).zip(z.remainder()) {
        rest[0] += (*p).into() * q;
        rest[1] += (*p).into() * r;
    }
    for ((p, q), r) in x.zip(y).zip(z) {
        for i in 0..8 {
            first[i] += p[i].into() * q[i];
            second[i] += p[i].into() * r[i];
        }
    }
    [
        sum_of_eight(first) + rest[0],
        sum_of_eight(second) + rest[1],
    ]
}

/// Halves, quarters and eighths on each other, as they lie side by side in a processor.
#[inline(always)]
fn sum_of_eight([a, b, c, d, e, f, g, h]: [f64; 8]) -> f64 {
    ((a + e) + (c + g)) + ((b + f) + (d + h))
}

wide! {
    /// [`dot`] of each value but the last ones with that 1, 2 and so on up to `lags` behind it: a stretch after the other,
    /// which stays at hand for all.
    pub fn dots_behind[](a: &[f64], b: &[f64], lags: usize) -> Vec<f64> = dots_behind_of
}

#[inline(always)]
fn dots_behind_of(a: &[f64], b: &[f64], lags: usize) -> Vec<f64> {
    const STRETCH: usize = 1 << 10;
    let mut sums = vec![[0.0; 8]; lags];
    let pairs = |lag: usize| (&a[..a.len() - lag], &b[lag..]);
    for from in (0..a.len()).step_by(STRETCH) {
        for (lag, eight) in (1..).zip(&mut sums) {
            let (x, y) = pairs(lag);
            let whole = x.len() - x.len() % 8;
            let part = from.min(whole)..(from + STRETCH).min(whole);
            let (x, y) = (x[part.clone()].chunks_exact(8), y[part].chunks_exact(8));
            for (p, q) in x.zip(y) {
                for (sum, (p, q)) in eight.iter_mut().zip(p.iter().zip(q)) {
                    *sum += p * q;
                }
            }
        }
    }
    let of = |(lag, eight): (usize, [f64; 8])| {
        let (x, y) = pairs(lag);
        let rest = x.len() - x.len() % 8;
        sum_of_eight(eight)
            + x[rest..]
                .iter()
                .zip(&y[rest..])
                .fold(0.0, |s, (p, q)| s + p * q)
    };
    (1..).zip(sums).map(of).collect()
}

wide! {
    /// Sum of products, and that of their squares, as [`sum_of`] and [`dot`] make them of the products.
    pub fn sums_of_products[](a: &[f64], b: &[f64]) -> [f64; 2] = sums_of_products_of
}

#[inline(always)]
fn sums_of_products_of(a: &[f64], b: &[f64]) -> [f64; 2] {
    let [mut sums, mut squares] = [[0.0; 8]; 2];
    let (x, y) = (a.chunks_exact(8), b.chunks_exact(8));
    let (mut sum, mut square) = (0.0, 0.0);
    for (p, q) in x.remainder().iter().zip(y.remainder()) {
        let product = p * q;
        sum += product;
        square += product * product;
    }
    for (p, q) in x.zip(y) {
        for i in 0..8 {
            let product = p[i] * q[i];
            sums[i] += product;
            squares[i] += product * product;
        }
    }
    [sum_of_eight(sums) + sum, sum_of_eight(squares) + square]
}

/// Sum of a function of the values, in eight sums as [`dot`].
pub fn sum_of(a: &[f64], f: impl Fn(f64) -> f64) -> f64 {
    let (eights, rest) = a.as_chunks::<8>();
    let mut sums = [0.0; 8];
    for eight in eights {
        for (sum, v) in sums.iter_mut().zip(eight) {
            *sum += f(*v);
        }
    }
    sum_of_eight(sums) + rest.iter().map(|v| f(*v)).sum::<f64>()
}

wide! {
    /// Adds sums of a[k] b[k] over bins, which begin at the places in `start` and end at its last, to others.
    pub fn add_sums[A: Copy + Into<f64>, B: Copy + Into<f64>](
        start: &[usize],
        a: &[A],
        b: &[B],
        sums: &mut Vec<f64>,
    ) -> () = add_sums_of
}

#[inline(always)]
fn add_sums_of<A, B>(start: &[usize], a: &[A], b: &[B], sums: &mut Vec<f64>)
where
    A: Copy + Into<f64>,
    B: Copy + Into<f64>,
{
    for w in start.windows(2) {
        sums.push(if w[1] - w[0] == 1 {
            a[w[0]].into() * b[w[0]].into()
        } else {
            dot(&a[w[0]..w[1]], &b[w[0]..w[1]])
        });
    }
}

/// Coefficients of a column.
#[derive(Clone)]
pub enum Column {
    /// As computed.
    Whole(Arc<Vec<f64>>),
    /// Of a long record, where what may explain the data fills memory.
    Short(Arc<Vec<f32>>),
}

/// Samples beyond which columns that may explain the data are kept short.
pub const LONG: usize = 1 << 18;

impl Column {
    /// Where its coefficients are in memory: columns that share them are one.
    pub fn place(&self) -> usize {
        match self {
            Self::Whole(c) => Arc::as_ptr(c).addr(),
            Self::Short(c) => Arc::as_ptr(c).addr(),
        }
    }

    /// The first `count`.
    pub fn first(&self, count: usize) -> Vec<f64> {
        match self {
            Self::Whole(c) => c.iter().take(count).copied().collect(),
            Self::Short(c) => c.iter().take(count).map(|v| f64::from(*v)).collect(),
        }
    }

    /// All its samples, in full numbers.
    #[must_use]
    pub fn whole(&self) -> Arc<Vec<f64>> {
        match self {
            Self::Whole(c) => Arc::clone(c),
            Self::Short(c) => Arc::new(c.iter().map(|v| f64::from(*v)).collect()),
        }
    }

    /// Adds coefficients `from` on, each times a number, to others.
    pub fn add_to(&self, sum: &mut [f64], from: usize, by: f64) {
        match self {
            Self::Whole(c) => sum
                .iter_mut()
                .zip(&c[from..])
                .for_each(|(s, x)| *s += by * x),
            Self::Short(c) => {
                (sum.iter_mut().zip(&c[from..])).for_each(|(s, x)| *s += by * f64::from(*x))
            }
        }
    }

    /// Sum of products of some coefficients with numbers.
    #[inline(always)]
    pub fn along(&self, part: Range<usize>, by: &[f64]) -> f64 {
        match self {
            Self::Whole(c) => dot(&c[part], by),
            Self::Short(c) => dot(&c[part], by),
        }
    }

    /// The same with two sets of numbers.
    #[inline(always)]
    pub fn along_two(&self, part: Range<usize>, by: [&[f64]; 2]) -> [f64; 2] {
        match self {
            Self::Whole(c) => dot_two(&c[part], by),
            Self::Short(c) => dot_two(&c[part], by),
        }
    }

    /// Some coefficients, each times a number.
    #[inline(always)]
    pub fn times(&self, part: Range<usize>, by: &[f64], into: &mut Vec<f64>) {
        into.clear();
        match self {
            Self::Whole(c) => into.extend(c[part].iter().zip(by).map(|(c, by)| c * by)),
            Self::Short(c) => into.extend(c[part].iter().zip(by).map(|(c, by)| f64::from(*c) * by)),
        }
    }

    /// Adds sums of products with another over bins, as [`add_sums`].
    pub fn add_sums(&self, other: &Self, start: &[usize], sums: &mut Vec<f64>) {
        match (self, other) {
            (Self::Whole(a), Self::Whole(b)) => add_sums(start, a, b, sums),
            (Self::Whole(a), Self::Short(b)) | (Self::Short(b), Self::Whole(a)) => {
                add_sums(start, a, b, sums);
            }
            (Self::Short(a), Self::Short(b)) => add_sums(start, a, b, sums),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(by: f64) -> Vec<f64> {
        (0..5003).map(|i| (f64::from(i) * by).sin()).collect()
    }

    #[test]
    fn sums_of_products_are_those_of_the_products() {
        let (a, b) = (wave(0.7), wave(1.3));
        let products: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a * b).collect();
        let direct = [sum_of(&products, |p| p), dot(&products, &products)];
        assert_eq!(sums_of_products(&a, &b), direct);
    }

    #[test]
    fn products_behind_are_those_of_the_shifted_values() {
        let (a, b) = (wave(0.7), wave(1.3));
        for (lag, sum) in (1..).zip(dots_behind(&a, &b, 20)) {
            assert_eq!(sum, dot(&a[..a.len() - lag], &b[lag..]), "{lag}");
        }
    }
}
