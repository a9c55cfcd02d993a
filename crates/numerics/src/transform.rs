//! Fourier and cosine transforms of real records: of an even length through complex ones of half of it, of an odd one two at
//! a time.
//!
//! ```
//! // DCT-II, orthonormal: a constant has one coefficient, sqrt(n) times it.
//! let dct = numerics::transform::Dct::new(9);
//! let c = dct.forward(&[2.0; 9]);
//! assert!((c[0] - 6.0).abs() < 1e-12 && (dct.inverse(&c)[4] - 2.0).abs() < 1e-12);
//! ```

use std::collections::HashMap;
use std::f64::consts::PI;
use std::sync::{Arc, LazyLock, Mutex, OnceLock, PoisonError};

use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};

use crate::column::{Column, LONG, sum_of};
use abreast::{Number, Plane};
use even::{forward_of_one, inverse_of_one};
use odd::{forward_of_two, inverse_of_two};

pub use known::Known;
pub use length::quick_length;

mod abreast;
mod even;
mod known;
mod length;
mod odd;

/// Longest transform whose plan is kept for the next one who asks, and most of them.
const KEPT: usize = 1 << 17;
const MOST_KEPT: usize = 64;

static PLANS: LazyLock<Mutex<HashMap<usize, Plan<f64>>>> = LazyLock::new(Mutex::default);

/// What real transforms of one length need.
#[derive(Clone)]
struct Plan<T> {
    /// Of half an even length, of the whole of an odd one.
    complex: Arc<dyn Fft<T>>,
    turn: Arc<Turns<T>>,
}

/// exp(-i pi k / (2 n)) of the first k, each the product of one of few coarse and one of few fine turns: what would be a
/// table as long as the record takes no memory.
struct Turns<T> {
    coarse: Vec<Complex<T>>,
    fine: Vec<Complex<T>>,
}

impl<T: Number> Turns<T> {
    const FINE: usize = 1 << 9;

    /// Up to k = `last`.
    fn new(n: usize, last: usize) -> Self {
        let turn = |k: usize| {
            let (sin, cos) = (-PI * k as f64 / (2 * n) as f64).sin_cos();
            Complex::new(T::of(cos), T::of(sin))
        };
        Self {
            coarse: (0..=last / Self::FINE)
                .map(|c| turn(c * Self::FINE))
                .collect(),
            fine: (0..Self::FINE).map(turn).collect(),
        }
    }

    /// The first `count`, one after the other.
    #[inline]
    fn each(&self, count: usize, mut take: impl FnMut(usize, Complex<T>)) {
        for (coarse, from) in self.coarse.iter().zip((0..count).step_by(Self::FINE)) {
            for (fine, k) in self.fine.iter().zip(from..count) {
                take(k, coarse * fine);
            }
        }
    }
}

impl<T: Number> Plan<T> {
    fn new(n: usize) -> Self {
        let (length, last) = if n.is_multiple_of(2) {
            (n / 2, n / 4)
        } else {
            (n, n / 2)
        };
        Self {
            complex: FftPlanner::new().plan_fft_forward(length),
            turn: Arc::new(Turns::new(n, last)),
        }
    }
}

impl Plan<f64> {
    /// As [`Plan::new`], or the one that was made before.
    fn known(n: usize) -> Self {
        if n > KEPT {
            return Self::new(n);
        }
        let mut known = PLANS.lock().unwrap_or_else(PoisonError::into_inner);
        if known.len() >= MOST_KEPT && !known.contains_key(&n) {
            known.clear();
        }
        known.entry(n).or_insert_with(|| Self::new(n)).clone()
    }
}

/// Work space of a transform.
struct Space<T> {
    packed: Vec<Complex<T>>,
    scratch: Vec<Complex<T>>,
}

/// The complex transform that real ones are made by.
#[derive(Clone)]
struct Packed<T> {
    plan: Plan<T>,
    /// One for each that is made at the same time.
    spaces: Arc<Mutex<Vec<Space<T>>>>,
}

impl<T: Number> Packed<T> {
    fn new(plan: Plan<T>) -> Self {
        Self {
            plan,
            spaces: Arc::default(),
        }
    }

    /// Transform in the work space.
    fn run(
        &self,
        fill: impl FnOnce(&mut [Complex<T>]),
        take: impl FnOnce(&[Complex<T>], &Turns<T>),
    ) {
        let Plan { complex, turn } = &self.plan;
        let spaces = || self.spaces.lock().unwrap_or_else(PoisonError::into_inner);
        let idle = spaces().pop();
        let mut space = idle.unwrap_or_else(|| Space {
            packed: vec![],
            scratch: vec![],
        });
        let Space { packed, scratch } = &mut space;
        let zero = Complex::new(T::zero(), T::zero());
        packed.resize(complex.len(), zero);
        fill(packed);
        let need = complex.get_inplace_scratch_len();
        if scratch.len() < need {
            scratch.resize(need, zero);
        }
        complex.process_with_scratch(packed, &mut scratch[..need]);
        take(packed, turn);
        spaces().push(space);
    }
}

/// The discrete Fourier transform of real sequences of one even length n: F[k] = sum of x[j] exp(-2 pi i j k / n).
#[derive(Clone)]
pub struct RealFft {
    n: usize,
    packed: Packed<f64>,
}

impl RealFft {
    /// Plan for `n` samples.
    ///
    /// # Panics
    /// When `n` is odd or 0.
    #[must_use]
    pub fn new(n: usize) -> Self {
        assert!(n > 0 && n.is_multiple_of(2), "{n} is no even length");
        let packed = Packed::new(Plan::known(n));
        Self { n, packed }
    }

    /// Samples.
    #[must_use]
    pub fn length(&self) -> usize {
        self.n
    }

    /// Transform x, of which x[2j] + i x[2j + 1] is `x(j)`, and hand F[k] of k = 0 ..= n/2 to `take`, in any order.
    pub fn run(
        &self,
        x: impl Fn(usize) -> Complex<f64>,
        mut take: impl FnMut(usize, Complex<f64>),
    ) {
        let h = self.n / 2;
        let fill = |z: &mut [Complex<f64>]| z.iter_mut().enumerate().for_each(|(j, z)| *z = x(j));
        self.packed.run(fill, |z, turns| {
            turns.each(h / 2 + 1, |k, turn| {
                let (f, g) = both(z[k], z[if k == 0 { 0 } else { h - k }], turn);
                take(k, f);
                if h - k > k {
                    take(h - k, g.conj());
                }
            });
        });
    }
}

/// F[k], and F[h - k] conjugated, from z[k] and z[h - k], or twice z[0], of the transform z of the packed sequence of length
/// h, k <= h/2; `turn` is exp(-i pi k / (4 h)). What differs between the two is their signs alone.
#[inline(always)]
fn both<Z: Plane>(a: Z, b: Z, turn: Z) -> (Z, Z) {
    let (half, b) = (Z::Real::of(0.5), b.conjugate());
    let (even, odd) = ((a + b).by(half), (a - b).by(half));
    let square = turn * turn;
    let turned = square * square * odd.quarter_back();
    (even + turned, even - turned)
}

/// Samples about their level, as numbers of a transform.
#[derive(Clone, Copy)]
struct About<'a> {
    samples: &'a [f64],
    level: f64,
}

impl About<'_> {
    fn nothing(samples: &[f64]) -> About<'_> {
        let level = 0.0;
        About { samples, level }
    }

    /// Short numbers would spend their digits on the level: about as much of it as some stretches tell.
    fn level(samples: &[f64]) -> About<'_> {
        const STRETCH: usize = 64;
        const EVERY: usize = 16;
        let some = || samples.chunks(STRETCH).step_by(EVERY);
        let sum: f64 = some().map(|few| sum_of(few, |v| v)).sum();
        let count: usize = some().map(<[f64]>::len).sum();
        let level = sum / count.max(1) as f64;
        About { samples, level }
    }

    #[inline]
    fn number<T: Number>(self, v: f64) -> T {
        T::of(v - self.level)
    }
}

/// How a cosine transform is made.
#[derive(Clone)]
enum Kind<T> {
    Even(Packed<T>),
    Odd(Packed<T>),
}

impl<T: Number> Kind<T> {
    fn new(n: usize, plan: Plan<T>) -> Self {
        let packed = Packed::new(plan);
        if n > 0 && n.is_multiple_of(2) {
            Self::Even(packed)
        } else {
            Self::Odd(packed)
        }
    }

    fn forward(&self, x: About) -> Vec<T> {
        match self {
            Self::Even(packed) => forward_of_one(packed, x),
            Self::Odd(packed) => {
                let [c, _] = forward_of_two(packed, x, About::nothing(&[]));
                c
            }
        }
    }

    fn inverse(&self, c: &[f64]) -> Vec<f64> {
        match self {
            Self::Even(packed) => inverse_of_one(packed, c),
            Self::Odd(packed) => {
                let [x, _] = inverse_of_two(packed, c, &[]);
                x
            }
        }
    }

    /// Of several, one after the other; two of an odd length are made at once. No more are held than that.
    fn each<X, Y>(
        &self,
        all: impl IntoIterator<Item = X>,
        of_one: impl Fn(&X) -> Y,
        of_two: impl Fn(&Packed<T>, &X, &X) -> [Y; 2],
    ) -> impl Iterator<Item = Y> {
        let mut all = all.into_iter();
        let mut second = None;
        std::iter::from_fn(move || {
            if second.is_some() {
                return second.take();
            }
            let a = all.next()?;
            let Self::Odd(packed) = self else {
                return Some(of_one(&a));
            };
            let Some(b) = all.next() else {
                return Some(of_one(&a));
            };
            let [first, other] = of_two(packed, &a, &b);
            second = Some(other);
            Some(first)
        })
    }

    fn forward_all<X: AsRef<[f64]>>(
        &self,
        all: impl IntoIterator<Item = X>,
        about: for<'a> fn(&'a [f64]) -> About<'a>,
    ) -> impl Iterator<Item = Vec<T>> {
        self.each(
            all,
            move |x| self.forward(about(x.as_ref())),
            move |packed, a, b| forward_of_two(packed, about(a.as_ref()), about(b.as_ref())),
        )
    }
}

/// The orthonormal DCT-II of one length.
#[derive(Clone)]
pub struct Dct {
    n: usize,
    /// Each made for the first who asks.
    whole: Arc<OnceLock<Kind<f64>>>,
    /// In short numbers, for the columns of long records.
    short: Arc<OnceLock<Kind<f32>>>,
    /// Columns that channels have in common.
    pub known: Arc<Known>,
}

impl Dct {
    /// Plan for `n` samples.
    #[must_use]
    pub fn new(n: usize) -> Self {
        Self {
            n,
            whole: Arc::default(),
            short: Arc::default(),
            known: Arc::default(),
        }
    }

    /// Keep no further columns for other channels.
    pub fn keep_no_more(&self) {
        self.known.complete();
    }

    /// Let go of the columns that channels have in common.
    pub fn forget(&self) {
        self.known.forget();
    }

    /// Coefficients of `x`.
    #[must_use]
    pub fn forward(&self, x: &[f64]) -> Vec<f64> {
        self.in_whole().forward(About::nothing(x))
    }

    /// Coefficients of several, one after the other; of an odd length at half the time of each alone.
    pub fn forward_all<X: AsRef<[f64]>>(
        &self,
        all: impl IntoIterator<Item = X>,
    ) -> impl Iterator<Item = Vec<f64>> {
        self.in_whole().forward_all(all, About::nothing)
    }

    /// Columns of several that may explain the data, those of a long record in short numbers.
    pub fn columns<X: AsRef<[f64]>>(&self, all: impl IntoIterator<Item = X>) -> Vec<Column> {
        if self.n > LONG {
            self.short(all).map(Column::short).collect()
        } else {
            let whole = self.forward_all(all);
            whole.map(|c| Column::Whole(Arc::new(c))).collect()
        }
    }

    /// As [`Dct::forward_all`], in short numbers: twice as fast, within parts in 10^6 of what moves in a
    /// sequence.
    fn short<X: AsRef<[f64]>>(
        &self,
        all: impl IntoIterator<Item = X>,
    ) -> impl Iterator<Item = Vec<f32>> {
        self.in_short().forward_all(all, About::level)
    }

    fn in_whole(&self) -> &Kind<f64> {
        let known = || Kind::new(self.n, Plan::known(self.n));
        self.whole.get_or_init(known)
    }

    fn in_short(&self) -> &Kind<f32> {
        let new = || Kind::new(self.n, Plan::new(self.n));
        self.short.get_or_init(new)
    }

    /// Samples of several, as [`Dct::forward_all`].
    pub fn inverse_all<X: AsRef<[f64]>>(
        &self,
        all: impl IntoIterator<Item = X>,
    ) -> impl Iterator<Item = Vec<f64>> {
        self.in_whole().each(
            all,
            |c| self.inverse(c.as_ref()),
            |packed, c, d| inverse_of_two(packed, c.as_ref(), d.as_ref()),
        )
    }

    /// Samples from coefficients.
    #[must_use]
    pub fn inverse(&self, c: &[f64]) -> Vec<f64> {
        self.in_whole().inverse(c)
    }

    /// Energy of the Fourier transform at twice its frequencies: |sum of z[j] exp(-i pi j k / n)|^2, k = 0..n, of samples z
    /// whose coefficients are c. Of a long record it is made in short numbers.
    #[must_use]
    pub fn energies(&self, c: &[f64]) -> Vec<f64> {
        if self.n > LONG {
            energies(self.in_short(), c, self.in_short().inverse(c))
        } else {
            energies(self.in_whole(), c, self.inverse(c))
        }
    }

    /// The same of the samples.
    #[must_use]
    pub fn energies_of(&self, z: Vec<f64>) -> Vec<f64> {
        if self.n > LONG {
            let c = self.in_short().forward(About::nothing(&z));
            energies(self.in_short(), &c, z)
        } else {
            energies(self.in_whole(), &self.forward(&z), z)
        }
    }
}

/// Cosines about half a sample are the coefficients c; sines are those of the samples z with every second sign turned,
/// backwards.
fn energies<T: Number>(kind: &Kind<T>, c: &[impl Copy + Into<f64>], mut z: Vec<f64>) -> Vec<f64> {
    z.iter_mut().skip(1).step_by(2).for_each(|v| *v = -*v);
    let sines = kind.forward(About::nothing(&z));
    let mut energies = z;
    let half = 0.5 * c.len() as f64;
    let level: f64 = c[0].into();
    energies[0] = 2.0 * half * level * level;
    for ((energy, c), s) in energies.iter_mut().zip(c).skip(1).zip(sines.iter().rev()) {
        let (c, s): (f64, f64) = ((*c).into(), (*s).into());
        *energy = half * (c * c + s * s);
    }
    energies
}

#[cfg(test)]
mod tests;
