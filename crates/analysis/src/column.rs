//! Coefficients of the columns that may explain the data.

use std::ops::Range;
use std::rc::Rc;

use crate::likelihood::Bins;

/// Sum of products, in eight sums that a processor makes at once.
#[inline(always)]
pub(crate) fn dot<A, B>(a: &[A], b: &[B]) -> f64
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

/// Sum of a function of the values, in eight sums as [`dot`].
pub(crate) fn sum_of(a: &[f64], f: impl Fn(f64) -> f64) -> f64 {
    let (eights, rest) = a.as_chunks::<8>();
    let mut sums = [0.0; 8];
    for eight in eights {
        for (sum, v) in sums.iter_mut().zip(eight) {
            *sum += f(*v);
        }
    }
    sum_of_eight(sums) + rest.iter().map(|v| f(*v)).sum::<f64>()
}

/// Coefficients of a column.
#[derive(Clone)]
pub(crate) enum Column {
    /// As computed.
    Whole(Rc<Vec<f64>>),
    /// Of a long record, where what may explain the data fills memory.
    Short(Rc<Vec<f32>>),
}

/// Samples beyond which columns that may explain the data are kept short.
pub(crate) const LONG: usize = 1 << 18;

impl Column {
    /// Where its coefficients are in memory: columns that share them are one.
    pub(crate) fn place(&self) -> usize {
        match self {
            Self::Whole(c) => Rc::as_ptr(c).addr(),
            Self::Short(c) => Rc::as_ptr(c).addr(),
        }
    }

    /// The first `count`.
    pub(crate) fn first(&self, count: usize) -> Vec<f64> {
        match self {
            Self::Whole(c) => c.iter().take(count).copied().collect(),
            Self::Short(c) => c.iter().take(count).map(|v| f64::from(*v)).collect(),
        }
    }

    pub(crate) fn whole(&self) -> Rc<Vec<f64>> {
        match self {
            Self::Whole(c) => Rc::clone(c),
            Self::Short(c) => Rc::new(c.iter().map(|v| f64::from(*v)).collect()),
        }
    }

    /// Sum of products of some coefficients with numbers.
    #[inline(always)]
    pub(crate) fn along(&self, part: Range<usize>, by: &[f64]) -> f64 {
        match self {
            Self::Whole(c) => dot(&c[part], by),
            Self::Short(c) => dot(&c[part], by),
        }
    }

    /// The same with two sets of numbers.
    #[inline(always)]
    pub(crate) fn along_two(&self, part: Range<usize>, by: [&[f64]; 2]) -> [f64; 2] {
        match self {
            Self::Whole(c) => dot_two(&c[part], by),
            Self::Short(c) => dot_two(&c[part], by),
        }
    }

    /// Some coefficients, each times a number.
    #[inline(always)]
    pub(crate) fn times(&self, part: Range<usize>, by: &[f64], into: &mut Vec<f64>) {
        into.clear();
        match self {
            Self::Whole(c) => into.extend(c[part].iter().zip(by).map(|(c, by)| c * by)),
            Self::Short(c) => into.extend(c[part].iter().zip(by).map(|(c, by)| f64::from(*c) * by)),
        }
    }

    pub(crate) fn products(&self, other: &Self, bins: &Bins) -> Vec<f64> {
        match (self, other) {
            (Self::Whole(a), Self::Whole(b)) => bins.sums(a, b),
            (Self::Whole(a), Self::Short(b)) | (Self::Short(b), Self::Whole(a)) => bins.sums(a, b),
            (Self::Short(a), Self::Short(b)) => bins.sums(a, b),
        }
    }
}
