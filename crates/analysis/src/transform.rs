//! Fourier and cosine transforms of real records: of an even length through complex ones of half of it, of an odd one two at
//! a time.

use std::cell::{Cell, OnceCell, RefCell};
use std::collections::{HashMap, HashSet};
use std::f64::consts::{FRAC_1_SQRT_2, PI, SQRT_2};
use std::rc::Rc;
use std::sync::Arc;

use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};

use crate::column::{Column, LONG, sum_of};
use crate::wide::wide;
use abreast::{ABREAST, Abreast, Number, Plane, each};

mod abreast;

/// Longest transform whose plan is kept for the next one who asks on the same thread, and most of them.
const KEPT: usize = 1 << 17;
const MOST_KEPT: usize = 64;

thread_local! {
    static PLANS: RefCell<HashMap<usize, Plan<f64>>> = RefCell::default();
}

/// What real transforms of one length need.
#[derive(Clone)]
struct Plan<T> {
    /// Of half an even length, of the whole of an odd one.
    complex: Arc<dyn Fft<T>>,
    turn: Rc<Turns<T>>,
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
            turn: Rc::new(Turns::new(n, last)),
        }
    }
}

impl Plan<f64> {
    /// As [`Plan::new`], or the one that was made before.
    fn known(n: usize) -> Self {
        if n > KEPT {
            return Self::new(n);
        }
        PLANS.with_borrow_mut(|known| {
            if known.len() >= MOST_KEPT && !known.contains_key(&n) {
                known.clear();
            }
            known.entry(n).or_insert_with(|| Self::new(n)).clone()
        })
    }
}

/// Work space that transforms have in common.
struct Space<T> {
    packed: Vec<Complex<T>>,
    scratch: Vec<Complex<T>>,
}

/// The complex transform that real ones are made by.
#[derive(Clone)]
struct Packed<T> {
    plan: Plan<T>,
    space: Rc<RefCell<Space<T>>>,
}

impl<T: Number> Packed<T> {
    fn new(plan: Plan<T>) -> Self {
        let space = Space {
            packed: vec![],
            scratch: vec![],
        };
        Self {
            plan,
            space: Rc::new(RefCell::new(space)),
        }
    }

    /// Transform in the work space.
    fn run(
        &self,
        fill: impl FnOnce(&mut [Complex<T>]),
        take: impl FnOnce(&[Complex<T>], &Turns<T>),
    ) {
        let Plan { complex, turn } = &self.plan;
        let Space { packed, scratch } = &mut *self.space.borrow_mut();
        let zero = Complex::new(T::zero(), T::zero());
        packed.resize(complex.len(), zero);
        fill(packed);
        let need = complex.get_inplace_scratch_len();
        if scratch.len() < need {
            scratch.resize(need, zero);
        }
        complex.process_with_scratch(packed, &mut scratch[..need]);
        take(packed, turn);
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

/// Coefficients of columns that the channels of a record have in common, by a digest of their samples.
#[derive(Default)]
pub(crate) struct Known {
    pub(crate) columns: RefCell<HashMap<[u64; 2], Column>>,
    /// Those that go by a name.
    pub(crate) named: RefCell<HashMap<String, Vec<Column>>>,
    /// Whether what the channels have in common is known: those of the first are, and no later one's own are kept.
    pub(crate) complete: Cell<bool>,
    /// Sums of products of the columns, by their places in memory, where they stay while they are kept.
    products: RefCell<HashMap<[usize; 2], Rc<Vec<f64>>>>,
    kept: RefCell<HashSet<usize>>,
}

impl Known {
    pub(crate) fn keep(&self, key: [u64; 2], column: &Column) {
        self.kept.borrow_mut().insert(column.place());
        self.columns.borrow_mut().insert(key, column.clone());
    }

    /// Sums of products of two columns, made once where both are kept.
    pub(crate) fn products(
        &self,
        a: &Column,
        b: &Column,
        make: impl FnOnce() -> Rc<Vec<f64>>,
    ) -> Rc<Vec<f64>> {
        let mut places = [a.place(), b.place()];
        places.sort_unstable();
        let kept = self.kept.borrow();
        if !places.iter().all(|p| kept.contains(p)) {
            return make();
        }
        let mut products = self.products.borrow_mut();
        Rc::clone(products.entry(places).or_insert_with(make))
    }

    fn forget(&self) {
        self.products.borrow_mut().clear();
        self.kept.borrow_mut().clear();
        self.columns.borrow_mut().clear();
        self.named.borrow_mut().clear();
    }
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

    /// Short numbers would spend their digits on the level.
    fn mean(samples: &[f64]) -> About<'_> {
        let level = sum_of(samples, |v| v) / samples.len().max(1) as f64;
        About { samples, level }
    }

    #[inline]
    fn number<T: Number>(self, v: f64) -> T {
        T::of(v - self.level)
    }
}

wide! {
    /// Even samples forwards, then odd ones backwards, two a complex number.
    fn laid_out[T: Number](x: About, z: &mut [Complex<T>]) -> () = laid_out_in
}

#[inline(always)]
fn laid_out_in<T: Number>(x: About, z: &mut [Complex<T>]) {
    let (fours, last) = x.samples.as_chunks::<4>();
    let (first, second) = z.split_at_mut(fours.len());
    for ((four, z), mirrored) in fours.iter().zip(first).zip(second.iter_mut().rev()) {
        let [a, b, c, d] = four.map(|v| x.number(v));
        *z = Complex::new(a, c);
        *mirrored = Complex::new(d, b);
    }
    if let [a, b] = last {
        second[0] = Complex::new(x.number(*a), x.number(*b));
    }
}

wide! {
    /// Coefficients from the transform z of a packed sequence, by the scales of all and of those an eighth of a circle on.
    fn coefficients[T: Number](z: &[Complex<T>], turns: &Turns<T>, scale: [T; 2], c: &mut [T]) -> ()
    = coefficients_of
}

#[inline(always)]
fn coefficients_of<T: Number>(z: &[Complex<T>], turns: &Turns<T>, scale: [T; 2], c: &mut [T]) {
    let (h, n) = (z.len(), c.len());
    let coarse = turns
        .coarse
        .iter()
        .zip((0..=h / 2).step_by(Turns::<T>::FINE));
    for (coarse, from) in coarse {
        let fine = turns.fine.as_chunks::<ABREAST>().0.iter();
        for (fine, k) in fine.zip((from..=h / 2).step_by(ABREAST)) {
            let last = k + ABREAST - 1;
            if k == 0 || last >= h / 2 {
                for (fine, k) in fine.iter().zip(k..=h / 2) {
                    let mirrored = z[if k == 0 { 0 } else { h - k }];
                    let [v, w] = turned(z[k], mirrored, *coarse * *fine, scale);
                    (c[k], c[h - k], c[h + k]) = (v.re, w.re - w.im, w.re + w.im);
                    if k > 0 {
                        c[n - k] = -v.im;
                    }
                }
                continue;
            }
            let (a, b) = (&z[k..=last], &z[h - last..=h - k]);
            let a = Abreast::of(|i| a[i]);
            let b = Abreast::of(|i| b[ABREAST - 1 - i]);
            let turn = Abreast::of(|_| *coarse) * Abreast::of(|i| fine[i]);
            let [v, w] = turned(a, b, turn, scale);
            let mut below = each(w.re, w.im, |a, b| a - b);
            let mut high = each(v.im, v.im, |a, _| -a);
            below.reverse();
            high.reverse();
            c[k..=last].copy_from_slice(&v.re);
            c[h - last..=h - k].copy_from_slice(&below);
            c[h + k..=h + last].copy_from_slice(&each(w.re, w.im, |a, b| a + b));
            c[n - last..=n - k].copy_from_slice(&high);
        }
    }
}

/// Coefficients k and n - k in the parts of the first, those about h in the second: the turn at h - k is that at k
/// conjugated, by an eighth of a circle.
#[inline(always)]
fn turned<Z: Plane>(a: Z, b: Z, turn: Z, scale: [Z::Real; 2]) -> [Z; 2] {
    let (f, g) = both(a, b, turn);
    [(f * turn).by(scale[0]), (g * turn).by(scale[1])]
}

/// The orthonormal DCT-II of a sequence of even length.
fn forward_of_one<T: Number>(packed: &Packed<T>, x: About) -> Vec<T> {
    let n = x.samples.len();
    let mut c = vec![T::zero(); n];
    // The spectrum of what is laid out, turned by k/4 of a sample, holds coefficient k in its
    // real part and n - k in its imaginary one.
    let scale = T::of((2.0 / n as f64).sqrt());
    let of_eighth = T::of((2.0 / n as f64).sqrt() * FRAC_1_SQRT_2);
    packed.run(
        |z| laid_out(x, z),
        |z, turns| coefficients(z, turns, [scale, of_eighth], &mut c),
    );
    c[0] = c[0] * T::of(FRAC_1_SQRT_2) + T::of(x.level * (n as f64).sqrt());
    c
}

/// The orthonormal DCT-II of two sequences of one odd length, or of the first alone where the second is empty.
fn forward_of_two<T: Number>(packed: &Packed<T>, a: About, b: About) -> [Vec<T>; 2] {
    let [mut c, mut d] = [a, b].map(|x| vec![T::zero(); x.samples.len()]);
    let x = |i: usize| {
        let second = b.samples.get(i).map_or(T::zero(), |v| b.number(*v));
        Complex::new(a.number(a.samples[i]), second)
    };
    packed.run(
        // Even samples forwards, then odd ones backwards.
        |z| {
            let (even, odd) = z.split_at_mut(a.samples.len().div_ceil(2));
            let even = even.iter_mut().zip((0..).step_by(2));
            even.for_each(|(z, i)| *z = x(i));
            let odd = odd.iter_mut().rev().zip((1..).step_by(2));
            odd.for_each(|(z, i)| *z = x(i));
        },
        |z, turns| {
            let n = z.len();
            let scale = T::of((0.5 / n as f64).sqrt());
            let (root, level) = (T::of(SQRT_2), (n as f64).sqrt());
            let mut put = |k: usize, v: T, w: T| {
                c[k] = v;
                d.get_mut(k).into_iter().for_each(|d| *d = w);
            };
            turns.each(n.div_ceil(2), |k, turn| {
                let turn = turn * scale;
                if k == 0 {
                    let [v, w] = [(z[0].re, a), (z[0].im, b)]
                        .map(|(z, x)| root * turn.re * z + T::of(x.level * level));
                    put(0, v, w);
                    return;
                }
                let mirrored = z[n - k].conj();
                let (sum, off) = (z[k] + mirrored, z[k] - mirrored);
                let (v, w) = (sum * turn, Complex::new(off.im, -off.re) * turn);
                put(k, v.re, w.re);
                put(n - k, -v.im, -w.im);
            });
        },
    );
    [c, d]
}

/// The steps of [`forward_of_two`], back, by a transform forwards of what is conjugated.
fn inverse_of_two(packed: &Packed<f64>, c: &[f64], d: &[f64]) -> [Vec<f64>; 2] {
    let [mut a, mut b] = [c, d].map(|x| vec![0.0; x.len()]);
    let second = |k: usize| d.get(k).copied().unwrap_or(0.0);
    packed.run(
        |z| {
            let n = z.len();
            let scale = (0.5 / n as f64).sqrt();
            packed.plan.turn.each(n.div_ceil(2), |k, turn| {
                let back = turn.conj() * scale;
                if k == 0 {
                    z[0] = Complex::new(c[0], -second(0)) * (SQRT_2 * back.re);
                    return;
                }
                let v = Complex::new(c[k], -c[n - k]) * back;
                let w = Complex::new(second(k), -second(n - k)) * back;
                z[k] = Complex::new(v.re - w.im, -v.im - w.re);
                z[n - k] = Complex::new(v.re + w.im, v.im - w.re);
            });
        },
        |z, _| {
            let mut put = |i: usize, z: &Complex<f64>| {
                a[i] = z.re;
                b.get_mut(i).into_iter().for_each(|b| *b = -z.im);
            };
            let (even, odd) = z.split_at(z.len().div_ceil(2));
            let even = even.iter().zip((0..).step_by(2));
            even.for_each(|(z, i)| put(i, z));
            let odd = odd.iter().rev().zip((1..).step_by(2));
            odd.for_each(|(z, i)| put(i, z));
        },
    );
    [a, b]
}

wide! {
    /// The spectrum, conjugated, of the packed sequence that has these coefficients.
    fn spectrum[](c: &[f64], turns: &Turns<f64>, half: [f64; 2], z: &mut [Complex<f64>]) -> ()
    = spectrum_of
}

#[inline(always)]
fn spectrum_of(c: &[f64], turns: &Turns<f64>, half: [f64; 2], z: &mut [Complex<f64>]) {
    let (h, n) = (z.len(), c.len());
    let one = |k: usize, turn: Complex<f64>, z: &mut [Complex<f64>]| {
        let v = match k {
            0 => Complex::new(SQRT_2 * c[0], 0.0),
            k => Complex::new(c[k], -c[n - k]),
        };
        let w = Complex::new(c[h - k] + c[h + k], c[h + k] - c[h - k]);
        let (low, high) = returned(v, w, turn, half);
        z[k] = low;
        if k > 0 {
            z[h - k] = high;
        }
    };
    let coarse = turns
        .coarse
        .iter()
        .zip((0..=h / 2).step_by(Turns::<f64>::FINE));
    for (coarse, from) in coarse {
        let fine = turns.fine.as_chunks::<ABREAST>().0.iter();
        for (fine, k) in fine.zip((from..=h / 2).step_by(ABREAST)) {
            let last = k + ABREAST - 1;
            if k == 0 || last >= h / 2 {
                let alone = fine.iter().zip(k..=h / 2);
                alone.for_each(|(fine, k)| one(k, coarse * fine, z));
                continue;
            }
            let (low, high) = (&c[k..=last], &c[n - last..=n - k]);
            let (below, above) = (&c[h - last..=h - k], &c[h + k..=h + last]);
            let v = Abreast::of(|i| Complex::new(low[i], -high[ABREAST - 1 - i]));
            let w = Abreast::of(|i| {
                let below = below[ABREAST - 1 - i];
                Complex::new(below + above[i], above[i] - below)
            });
            let turn = Abreast::of(|_| *coarse) * Abreast::of(|i| fine[i]);
            let (low, high) = returned(v, w, turn, half);
            for i in 0..ABREAST {
                z[k + i] = Complex::new(low.re[i], low.im[i]);
                z[h - k - i] = Complex::new(high.re[i], high.im[i]);
            }
        }
    }
}

/// The steps of [`turned`], back.
#[inline(always)]
fn returned<Z: Plane>(v: Z, w: Z, turn: Z, half: [Z::Real; 2]) -> (Z, Z) {
    let back = turn.conjugate();
    let (f, g) = ((v * back).by(half[0]), (w * back).by(half[1]));
    let square = back * back;
    let odd = ((f - g) * square * square).quarter_back();
    let even = f + g;
    ((even - odd).conjugate(), even + odd)
}

/// The steps of [`forward_of_one`], back, by a transform forwards of what is conjugated.
fn inverse_of_one(packed: &Packed<f64>, c: &[f64]) -> Vec<f64> {
    let n = c.len();
    let h = n / 2;
    let half = 0.5 * (0.5 * n as f64).sqrt() / h as f64;
    let mut x = vec![0.0; n];
    let half = [half, half * FRAC_1_SQRT_2];
    packed.run(
        |z| spectrum(c, &packed.plan.turn, half, z),
        |z, _| {
            let (fours, last) = x.as_chunks_mut::<4>();
            for (j, four) in fours.iter_mut().enumerate() {
                let (a, b) = (z[j], z[h - 1 - j]);
                *four = [a.re, -b.im, -a.im, b.re];
            }
            if let [a, b] = last {
                (*a, *b) = (z[h / 2].re, -z[h / 2].im);
            }
        },
    );
    x
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
    kind: Kind<f64>,
    /// In short numbers, for the columns of long records.
    short: Rc<OnceCell<Kind<f32>>>,
    pub(crate) known: Rc<Known>,
}

impl Dct {
    /// Plan for `n` samples.
    #[must_use]
    pub fn new(n: usize) -> Self {
        Self {
            n,
            kind: Kind::new(n, Plan::known(n)),
            short: Rc::default(),
            known: Rc::default(),
        }
    }

    /// Keep no further columns for other channels.
    pub fn keep_no_more(&self) {
        self.known.complete.set(true);
    }

    /// Let go of the columns that channels have in common.
    pub fn forget(&self) {
        self.known.forget();
    }

    /// Coefficients of `x`.
    #[must_use]
    pub fn forward(&self, x: &[f64]) -> Vec<f64> {
        self.kind.forward(About::nothing(x))
    }

    /// Coefficients of several, one after the other; of an odd length at half the time of each alone.
    pub fn forward_all<X: AsRef<[f64]>>(
        &self,
        all: impl IntoIterator<Item = X>,
    ) -> impl Iterator<Item = Vec<f64>> {
        self.kind.forward_all(all, About::nothing)
    }

    /// Columns of several that may explain the data, those of a long record in short numbers.
    pub(crate) fn columns<X: AsRef<[f64]>>(&self, all: impl IntoIterator<Item = X>) -> Vec<Column> {
        if self.n > LONG {
            self.short(all).map(|c| Column::Short(Rc::new(c))).collect()
        } else {
            let whole = self.forward_all(all);
            whole.map(|c| Column::Whole(Rc::new(c))).collect()
        }
    }

    /// As [`Dct::forward_all`], in short numbers: twice as fast, within parts in 10^6 of what moves in a
    /// sequence.
    fn short<X: AsRef<[f64]>>(
        &self,
        all: impl IntoIterator<Item = X>,
    ) -> impl Iterator<Item = Vec<f32>> {
        let new = || Kind::new(self.n, Plan::new(self.n));
        self.short.get_or_init(new).forward_all(all, About::mean)
    }

    /// Samples of several, as [`Dct::forward_all`].
    pub fn inverse_all<X: AsRef<[f64]>>(
        &self,
        all: impl IntoIterator<Item = X>,
    ) -> impl Iterator<Item = Vec<f64>> {
        self.kind.each(
            all,
            |c| self.inverse(c.as_ref()),
            |packed, c, d| inverse_of_two(packed, c.as_ref(), d.as_ref()),
        )
    }

    /// Samples from coefficients.
    #[must_use]
    pub fn inverse(&self, c: &[f64]) -> Vec<f64> {
        match &self.kind {
            Kind::Odd(packed) => {
                let [x, _] = inverse_of_two(packed, c, &[]);
                x
            }
            Kind::Even(packed) => inverse_of_one(packed, c),
        }
    }

    /// Energy of the Fourier transform at twice its frequencies: |sum of z[j] exp(-i pi j k / n)|^2, k = 0..n, of samples z
    /// whose coefficients are c. Cosines about half a sample are these; sines are those of z with every second sign turned,
    /// backwards.
    #[must_use]
    pub fn energies(&self, c: &[f64], mut z: Vec<f64>) -> Vec<f64> {
        z.iter_mut().skip(1).step_by(2).for_each(|v| *v = -*v);
        let mut all = self.forward(&z);
        drop(z);
        let half = 0.5 * self.n as f64;
        let energy = |c: f64, s: f64| half * (c * c + s * s);
        all[0] = 2.0 * half * c[0] * c[0];
        for k in 1..=self.n / 2 {
            let mirrored = self.n - k;
            let (low, high) = (all[k], all[mirrored]);
            (all[k], all[mirrored]) = (energy(c[k], high), energy(c[mirrored], low));
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(n: usize) -> Vec<f64> {
        (0..n)
            .map(|i| (i as f64 * 0.7).sin() + 0.01 * ((i * 7919) % 101) as f64)
            .collect()
    }

    #[test]
    fn coefficients_are_their_sums_and_go_back() {
        for n in [2, 3, 4, 6, 7, 10, 16, 27, 30, 64, 101, 202] {
            let (dct, x) = (Dct::new(n), record(n));
            let c = dct.forward(&x);
            for (k, found) in c.iter().enumerate() {
                let share = if k == 0 { 1.0 } else { 2.0 } / n as f64;
                let angle = |i: usize| PI * k as f64 * (i as f64 + 0.5) / n as f64;
                let sum: f64 = x.iter().enumerate().map(|(i, v)| v * angle(i).cos()).sum();
                assert!((found - share.sqrt() * sum).abs() < 1e-12, "{n} {k}");
            }
            for (a, b) in dct.inverse(&c).iter().zip(&x) {
                assert!((a - b).abs() < 1e-12, "{n}");
            }
        }
    }

    #[test]
    fn several_at_once_are_what_each_is_alone() {
        for n in [1, 3, 4, 10, 27, 101] {
            let dct = Dct::new(n);
            let all: Vec<Vec<f64>> = (0..3).map(|i| record(n + i)[i..].to_vec()).collect();
            let close = |a: &[f64], b: &[f64]| {
                let mut pairs = a.iter().zip(b);
                assert!(
                    a.len() == n && pairs.all(|(a, b)| (a - b).abs() < 1e-12),
                    "{n}"
                );
            };
            let c: Vec<Vec<f64>> = dct.forward_all(&all).collect();
            for ((c, back), x) in c.iter().zip(dct.inverse_all(&c)).zip(&all) {
                close(c, &dct.forward(x));
                close(&back, x);
            }
        }
    }

    #[test]
    fn in_short_numbers_they_are_the_same_about_any_level() {
        for (n, level) in [(4096, 0.0), (3125, 300.0), (6000, -1e4), (2003, 1e6)] {
            let dct = Dct::new(n);
            let all: Vec<Vec<f64>> = (0..3)
                .map(|i| record(n + i)[i..].iter().map(|v| v + level).collect())
                .collect();
            for (short, x) in dct.short(&all).zip(&all) {
                let whole = dct.forward(x);
                let error = |k: usize| f64::from(short[k]) - whole[k];
                let rms = |of: &dyn Fn(usize) -> f64| {
                    (1..n).map(|k| of(k).powi(2)).sum::<f64>().sqrt() / (n as f64).sqrt()
                };
                let size = rms(&|k| whole[k]);
                assert!(rms(&error) < 6e-7 * size, "{n}: {:e}", rms(&error) / size);
                let most = whole[1..].iter().fold(0.0, |m: f64, c| m.max(c.abs()));
                for k in 1..n {
                    let (e, bound) = (error(k).abs(), 1e-6 * size + 4e-7 * most);
                    assert!(e < bound, "{n} {k}: {e:e}, not {bound:e}");
                }
                assert!(error(0).abs() < 1e-6 * (size + whole[0].abs()), "{n}");
            }
        }
    }

    #[test]
    fn energies_are_those_of_the_fourier_transform() {
        for n in [5, 8, 30] {
            let x = record(n);
            let dct = Dct::new(n);
            for (k, found) in dct.energies(&dct.forward(&x), x.clone()).iter().enumerate() {
                let sum: Complex<f64> = x
                    .iter()
                    .enumerate()
                    .map(|(j, v)| Complex::from_polar(*v, -PI * (j * k) as f64 / n as f64))
                    .sum();
                assert!((found - sum.norm_sqr()).abs() < 1e-9, "{n} {k}");
            }
        }
    }

    #[test]
    fn a_real_transform_is_the_complex_one() {
        for n in [2, 6, 20] {
            let x = record(n);
            let mut seen = 0;
            RealFft::new(n).run(
                |j| Complex::new(x[2 * j], x[2 * j + 1]),
                |k, f| {
                    let terms = x.iter().enumerate();
                    let direct: Complex<f64> = terms
                        .map(|(j, v)| {
                            Complex::from_polar(*v, -2.0 * PI * (j * k) as f64 / n as f64)
                        })
                        .sum();
                    assert!((f - direct).norm() < 1e-10, "{n} {k}");
                    seen += 1;
                },
            );
            assert_eq!(seen, n / 2 + 1);
        }
    }
}
