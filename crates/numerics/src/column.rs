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
    /// Of a long record, where what may explain the data fills memory: those up to the last one that tells, and how many there
    /// are in all.
    Short(Arc<Vec<f32>>, usize),
}

/// Samples beyond which columns that may explain the data are kept short.
pub const LONG: usize = 1 << 18;

/// Part of a column's energy that its last coefficients may have where they are left out: what short numbers leave of a transform is
/// as much. At a hundred times that a check of what a strong response leaves moves by a quarter.
const UNTOLD: f64 = 1e-13;
/// Coefficients that are left out or kept together.
const TOGETHER: usize = 1 << 10;

impl Column {
    /// Of coefficients in short numbers, but for the last ones where they tell nothing.
    #[must_use]
    pub fn short(mut c: Vec<f32>) -> Self {
        let n = c.len();
        let energy = |some: &[f32]| dot(some, some);
        let all: Vec<f64> = c.chunks(TOGETHER).map(energy).collect();
        // The level is no part of what moves.
        let level = c.first().map_or(0.0, |v| f64::from(v * v));
        let most = UNTOLD * (all.iter().sum::<f64>() - level).max(0.0);
        let mut untold = 0.0;
        let few = all.iter().rev().take_while(|energy| {
            untold += **energy;
            untold <= most
        });
        let told = (all.len() - few.count()).max(1) * TOGETHER;
        if told < n {
            c.truncate(told);
            c.shrink_to_fit();
        }
        Self::Short(Arc::new(c), n)
    }

    /// Where its coefficients are in memory: columns that share them are one.
    pub fn place(&self) -> usize {
        match self {
            Self::Whole(c) => Arc::as_ptr(c).addr(),
            Self::Short(c, _) => Arc::as_ptr(c).addr(),
        }
    }

    /// The first `count`.
    pub fn first(&self, count: usize) -> Vec<f64> {
        match self {
            Self::Whole(c) => c.iter().take(count).copied().collect(),
            Self::Short(c, n) => padded(c, (*n).min(count)),
        }
    }

    /// All its samples, in full numbers.
    #[must_use]
    pub fn whole(&self) -> Arc<Vec<f64>> {
        match self {
            Self::Whole(c) => Arc::clone(c),
            Self::Short(c, n) => Arc::new(padded(c, *n)),
        }
    }

    /// Adds coefficients `from` on, each times a number, to others.
    pub fn add_to(&self, sum: &mut [f64], from: usize, by: f64) {
        match self {
            Self::Whole(c) => sum
                .iter_mut()
                .zip(&c[from..])
                .for_each(|(s, x)| *s += by * x),
            Self::Short(c, _) => {
                let c = &c[from.min(c.len())..];
                (sum.iter_mut().zip(c)).for_each(|(s, x)| *s += by * f64::from(*x));
            }
        }
    }

    /// Sum of products of some coefficients with numbers.
    #[inline(always)]
    pub fn along(&self, part: Range<usize>, by: &[f64]) -> f64 {
        match self {
            Self::Whole(c) => dot(&c[part], by),
            Self::Short(c, _) => {
                let c = told(c, part);
                dot(c, &by[..c.len()])
            }
        }
    }

    /// The same with two sets of numbers.
    #[inline(always)]
    pub fn along_two(&self, part: Range<usize>, by: [&[f64]; 2]) -> [f64; 2] {
        match self {
            Self::Whole(c) => dot_two(&c[part], by),
            Self::Short(c, _) => {
                let c = told(c, part);
                dot_two(c, by.map(|by| &by[..c.len()]))
            }
        }
    }

    /// Some coefficients, each times a number.
    #[inline(always)]
    pub fn times(&self, part: Range<usize>, by: &[f64], into: &mut Vec<f64>) {
        into.clear();
        match self {
            Self::Whole(c) => into.extend(c[part].iter().zip(by).map(|(c, by)| c * by)),
            Self::Short(c, _) => {
                let (all, c) = (part.len(), told(c, part));
                into.extend(c.iter().zip(by).map(|(c, by)| f64::from(*c) * by));
                into.resize(all, 0.0);
            }
        }
    }

    /// Adds sums of products with another over bins, as [`add_sums`].
    pub fn add_sums(&self, other: &Self, start: &[usize], sums: &mut Vec<f64>) {
        match (self, other) {
            (Self::Whole(a), Self::Whole(b)) => add_sums(start, a, b, sums),
            (Self::Whole(a), Self::Short(b, _)) | (Self::Short(b, _), Self::Whole(a)) => {
                add_sums_told(start, a, b, sums);
            }
            (Self::Short(a, _), Self::Short(b, _)) => add_sums_told(start, a, b, sums),
        }
    }
}

/// The first `count` of coefficients, of which the last ones are left out.
fn padded(c: &[f32], count: usize) -> Vec<f64> {
    let mut all = Vec::with_capacity(count);
    all.extend(c.iter().take(count).map(|v| f64::from(*v)));
    all.resize(count, 0.0);
    all
}

/// Those of a part that are not left out.
#[inline(always)]
fn told(c: &[f32], part: Range<usize>) -> &[f32] {
    &c[part.start.min(c.len())..part.end.min(c.len())]
}

/// As [`add_sums`], where the last coefficients may be left out.
fn add_sums_told<A>(start: &[usize], a: &[A], b: &[f32], sums: &mut Vec<f64>)
where
    A: Copy + Into<f64>,
{
    let end = a.len().min(b.len());
    let within = start.partition_point(|from| *from <= end);
    add_sums(&start[..within], a, b, sums);
    let bins = start.len().saturating_sub(1);
    if let Some(from) = start[..within].last().filter(|_| within <= bins) {
        add_sums(&[*from, end], a, b, sums);
    }
    let beyond = bins - within.min(bins);
    sums.resize(sums.len() + beyond, 0.0);
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
    fn a_short_column_without_its_last_coefficients_is_the_same_column() {
        let n = 9000;
        // Falls as the coefficients of what has no steps do, into what single precision leaves.
        let c: Vec<f32> = (0..n)
            .map(|k| (f64::from(k).sin() / f64::from(1 + k).powi(4)) as f32)
            .collect();
        let (column, all) = (Column::short(c.clone()), Column::Short(Arc::new(c), 9000));
        let Column::Short(told, 9000) = &column else {
            panic!("a short column of all its places")
        };
        assert!((1000..5000).contains(&told.len()), "{}", told.len());
        assert_eq!(column.whole().len(), 9000);
        let other = Column::Whole(Arc::new((0..n).map(|k| f64::from(k).cos()).collect()));
        let start = [1, 2, 3, 100, 1500, 2000, 2050, 4000, 8990, 9000];
        let sums = |a: &Column, b: &Column| {
            let mut sums = vec![];
            a.add_sums(b, &start, &mut sums);
            sums
        };
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-7, "{a} {b}");
        for second in [&other, &column] {
            let (few, whole) = (sums(&column, second), sums(&all, second));
            assert_eq!(few.len(), start.len() - 1);
            few.iter().zip(&whole).for_each(|(a, b)| close(*a, *b));
        }
        for part in [0..500, 900..1100, 4000..9000, 8999..9000] {
            let by = wave(0.3);
            let by = [&by[..part.len()], &by[1..=part.len()]];
            close(
                column.along(part.clone(), by[0]),
                all.along(part.clone(), by[0]),
            );
            let two = [&column, &all].map(|c| c.along_two(part.clone(), by));
            close(two[0][1], two[1][1]);
            let times = [&column, &all].map(|c| {
                let mut into = vec![];
                c.times(part.clone(), by[0], &mut into);
                into
            });
            assert_eq!(times[0].len(), part.len());
            times[0]
                .iter()
                .zip(&times[1])
                .for_each(|(a, b)| close(*a, *b));
            let sums = [&column, &all].map(|c| {
                let mut sum = vec![1.0; part.len()];
                c.add_to(&mut sum, part.start, 2.0);
                sum
            });
            sums[0]
                .iter()
                .zip(&sums[1])
                .for_each(|(a, b)| close(*a, *b));
        }
        // A step has no last ones that tell nothing.
        let step: Vec<f32> = (0..n).map(|k| 1.0 / (1 + k) as f32).collect();
        assert!(matches!(Column::short(step), Column::Short(c, _) if c.len() == 9000));
    }

    #[test]
    fn products_behind_are_those_of_the_shifted_values() {
        let (a, b) = (wave(0.7), wave(1.3));
        for (lag, sum) in (1..).zip(dots_behind(&a, &b, 20)) {
            assert_eq!(sum, dot(&a[..a.len() - lag], &b[lag..]), "{lag}");
        }
    }
}
