//! Fourier and cosine transforms of real records: of an even length through complex ones of half of it, of an odd one two at
//! a time.

use std::cell::{Cell, RefCell};
use std::collections::{HashMap, HashSet};
use std::f64::consts::{FRAC_1_SQRT_2, PI, SQRT_2};
use std::rc::Rc;
use std::sync::Arc;

use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};

use crate::column::Column;

/// Longest transform whose plan is kept for the next one who asks on the same thread, and most of them.
const KEPT: usize = 1 << 17;
const MOST_KEPT: usize = 64;

thread_local! {
    static PLANS: RefCell<HashMap<usize, Plan>> = RefCell::default();
}

/// What real transforms of one length need.
#[derive(Clone)]
struct Plan {
    /// Of half an even length, of the whole of an odd one.
    complex: Arc<dyn Fft<f64>>,
    turn: Rc<Turns>,
}

/// exp(-i pi k / (2 n)) of the first k, each the product of one of few coarse and one of few fine turns: what would be a
/// table as long as the record takes no memory.
struct Turns {
    coarse: Vec<Complex<f64>>,
    fine: Vec<Complex<f64>>,
}

impl Turns {
    const FINE: usize = 1 << 9;

    /// Up to k = `last`.
    fn new(n: usize, last: usize) -> Self {
        let turn = |k: usize| Complex::from_polar(1.0, -PI * k as f64 / (2 * n) as f64);
        Self {
            coarse: (0..=last / Self::FINE)
                .map(|c| turn(c * Self::FINE))
                .collect(),
            fine: (0..Self::FINE).map(turn).collect(),
        }
    }

    /// The first `count`, one after the other.
    #[inline]
    fn each(&self, count: usize, mut take: impl FnMut(usize, Complex<f64>)) {
        for (coarse, from) in self.coarse.iter().zip((0..count).step_by(Self::FINE)) {
            for (fine, k) in self.fine.iter().zip(from..count) {
                take(k, coarse * fine);
            }
        }
    }
}

impl Plan {
    fn new(n: usize) -> Self {
        let known = PLANS.with(|k| k.borrow().get(&n).cloned());
        if let Some(known) = known {
            return known;
        }
        let (length, last) = if n.is_multiple_of(2) {
            (n / 2, n / 4)
        } else {
            (n, n / 2)
        };
        let new = Self {
            complex: FftPlanner::new().plan_fft_forward(length),
            turn: Rc::new(Turns::new(n, last)),
        };
        if n <= KEPT {
            PLANS.with(|k| {
                let mut known = k.borrow_mut();
                if known.len() >= MOST_KEPT {
                    known.clear();
                }
                known.insert(n, new.clone());
            });
        }
        new
    }
}

/// Work space that transforms have in common.
#[derive(Default)]
struct Space {
    packed: Vec<Complex<f64>>,
    scratch: Vec<Complex<f64>>,
}

/// The complex transform that real ones are made by.
#[derive(Clone)]
struct Packed {
    plan: Plan,
    space: Rc<RefCell<Space>>,
}

impl Packed {
    fn new(n: usize) -> Self {
        Self {
            plan: Plan::new(n),
            space: Rc::default(),
        }
    }

    /// Transform in the work space.
    fn run(
        &self,
        fill: impl FnOnce(&mut [Complex<f64>]),
        take: impl FnOnce(&[Complex<f64>], &Turns),
    ) {
        let Plan { complex, turn } = &self.plan;
        let Space { packed, scratch } = &mut *self.space.borrow_mut();
        let zero = Complex::new(0.0, 0.0);
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
    packed: Packed,
}

impl RealFft {
    /// Plan for `n` samples.
    ///
    /// # Panics
    /// When `n` is odd or 0.
    #[must_use]
    pub fn new(n: usize) -> Self {
        assert!(n > 0 && n.is_multiple_of(2), "{n} is no even length");
        let packed = Packed::new(n);
        Self { n, packed }
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
                let (f, g) = both(z, k, turn);
                take(k, f);
                if h - k > k {
                    take(h - k, g.conj());
                }
            });
        });
    }
}

/// F[k], and F[h - k] conjugated, from the transform z of the packed sequence of length h, k <= h/2; `turn` is
/// exp(-i pi k / (4 h)). What differs between the two is their signs alone.
#[inline]
fn both(z: &[Complex<f64>], k: usize, turn: Complex<f64>) -> (Complex<f64>, Complex<f64>) {
    let a = z[k];
    let b = z[if k == 0 { 0 } else { z.len() - k }].conj();
    let (even, odd) = ((a + b) * 0.5, (a - b) * 0.5);
    let square = turn * turn;
    let turned = square * square * Complex::new(odd.im, -odd.re);
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

/// The orthonormal DCT-II of two sequences of one odd length, or of the first alone where the second is empty.
fn forward_of_two(packed: &Packed, a: &[f64], b: &[f64]) -> [Vec<f64>; 2] {
    let [mut c, mut d] = [a, b].map(|x| vec![0.0; x.len()]);
    let x = |i: usize| Complex::new(a[i], b.get(i).copied().unwrap_or(0.0));
    packed.run(
        // Even samples forwards, then odd ones backwards.
        |z| {
            let (even, odd) = z.split_at_mut(a.len().div_ceil(2));
            let even = even.iter_mut().zip((0..).step_by(2));
            even.for_each(|(z, i)| *z = x(i));
            let odd = odd.iter_mut().rev().zip((1..).step_by(2));
            odd.for_each(|(z, i)| *z = x(i));
        },
        |z, turns| {
            let n = z.len();
            let scale = (0.5 / n as f64).sqrt();
            let mut put = |k: usize, v: f64, w: f64| {
                c[k] = v;
                d.get_mut(k).into_iter().for_each(|d| *d = w);
            };
            turns.each(n.div_ceil(2), |k, turn| {
                let turn = turn * scale;
                if k == 0 {
                    put(0, SQRT_2 * turn.re * z[0].re, SQRT_2 * turn.re * z[0].im);
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
fn inverse_of_two(packed: &Packed, c: &[f64], d: &[f64]) -> [Vec<f64>; 2] {
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

/// Two real transforms by a complex one.
type OfTwo = fn(&Packed, &[f64], &[f64]) -> [Vec<f64>; 2];

/// How a cosine transform is made.
#[derive(Clone)]
enum Kind {
    Even(RealFft),
    Odd(Packed),
}

/// The orthonormal DCT-II of one length.
#[derive(Clone)]
pub struct Dct {
    n: usize,
    kind: Kind,
    pub(crate) known: Rc<Known>,
}

impl Dct {
    /// Plan for `n` samples.
    #[must_use]
    pub fn new(n: usize) -> Self {
        let kind = if n > 0 && n.is_multiple_of(2) {
            Kind::Even(RealFft::new(n))
        } else {
            Kind::Odd(Packed::new(n))
        };
        Self {
            n,
            kind,
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
        let n = self.n;
        match &self.kind {
            Kind::Odd(packed) => {
                let [c, _] = forward_of_two(packed, x, &[]);
                c
            }
            Kind::Even(fft) => {
                let mut c = vec![0.0; n];
                // Even samples forwards, then odd ones backwards: their spectrum, turned by k/4 of a sample, holds
                // coefficient k in its real part and n - k in its imaginary one.
                let scale = (2.0 / n as f64).sqrt();
                let h = n / 2;
                fft.packed.run(
                    |z| {
                        let (fours, last) = x.as_chunks::<4>();
                        for (j, [a, b, c, d]) in fours.iter().enumerate() {
                            z[j] = Complex::new(*a, *c);
                            z[h - 1 - j] = Complex::new(*d, *b);
                        }
                        if let [a, b] = last {
                            z[h / 2] = Complex::new(*a, *b);
                        }
                    },
                    |z, turns| {
                        turns.each(h / 2 + 1, |k, turn| {
                            let (f, g) = both(z, k, turn);
                            // The turn at h - k is this one's conjugate by an eighth of a circle.
                            let (v, w) = (f * turn * scale, g * turn * (scale * FRAC_1_SQRT_2));
                            c[k] = v.re;
                            c[h - k] = w.re - w.im;
                            c[h + k] = w.re + w.im;
                            if k > 0 {
                                c[n - k] = -v.im;
                            }
                        });
                    },
                );
                c[0] *= FRAC_1_SQRT_2;
                c
            }
        }
    }

    /// Coefficients of several, one after the other; of an odd length at half the time of each alone.
    pub fn forward_all<X: AsRef<[f64]>>(
        &self,
        all: impl IntoIterator<Item = X>,
    ) -> impl Iterator<Item = Vec<f64>> {
        self.each(all, forward_of_two, Self::forward)
    }

    /// Samples of several, as [`Dct::forward_all`].
    pub fn inverse_all<X: AsRef<[f64]>>(
        &self,
        all: impl IntoIterator<Item = X>,
    ) -> impl Iterator<Item = Vec<f64>> {
        self.each(all, inverse_of_two, Self::inverse)
    }

    /// No more are held than are made at once.
    fn each<X: AsRef<[f64]>>(
        &self,
        all: impl IntoIterator<Item = X>,
        of_two: OfTwo,
        of_one: fn(&Self, &[f64]) -> Vec<f64>,
    ) -> impl Iterator<Item = Vec<f64>> {
        let mut all = all.into_iter();
        let mut second = None;
        std::iter::from_fn(move || {
            if second.is_some() {
                return second.take();
            }
            let a = all.next()?;
            let Kind::Odd(packed) = &self.kind else {
                return Some(of_one(self, a.as_ref()));
            };
            let Some(b) = all.next() else {
                return Some(of_one(self, a.as_ref()));
            };
            let [first, other] = of_two(packed, a.as_ref(), b.as_ref());
            second = Some(other);
            Some(first)
        })
    }

    /// Samples from coefficients.
    #[must_use]
    pub fn inverse(&self, c: &[f64]) -> Vec<f64> {
        let n = self.n;
        match &self.kind {
            Kind::Odd(packed) => {
                let [x, _] = inverse_of_two(packed, c, &[]);
                x
            }
            Kind::Even(fft) => {
                // The steps of `forward`, back, by a transform forwards of what is conjugated.
                let h = n / 2;
                let half = 0.5 * (0.5 * n as f64).sqrt() / h as f64;
                let mut x = vec![0.0; n];
                fft.packed.run(
                    |z| {
                        fft.packed.plan.turn.each(h / 2 + 1, |k, turn| {
                            let v = match k {
                                0 => Complex::new(SQRT_2 * c[0], 0.0),
                                k => Complex::new(c[k], -c[n - k]),
                            };
                            let w = Complex::new(c[h - k] + c[h + k], c[h + k] - c[h - k]);
                            let back = turn.conj();
                            let (f, g) = (v * back * half, w * back * (half * FRAC_1_SQRT_2));
                            let square = back * back;
                            let odd = (f - g) * square * square;
                            let (even, odd) = (f + g, Complex::new(-odd.im, odd.re));
                            z[k] = (even + odd).conj();
                            if k > 0 {
                                z[h - k] = even - odd;
                            }
                        });
                    },
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
        }
    }

    /// Energy of the Fourier transform at twice its frequencies: |sum of z[j] exp(-i pi j k / n)|^2, k = 0..n, of samples z
    /// whose coefficients are c. Cosines about half a sample are these; sines are those of z with every second sign turned,
    /// backwards.
    #[must_use]
    pub fn energies(&self, c: &[f64], z: &[f64]) -> Vec<f64> {
        let turned: Vec<f64> = z
            .iter()
            .enumerate()
            .map(|(j, v)| if j % 2 == 0 { *v } else { -v })
            .collect();
        let sines = self.forward(&turned);
        let half = 0.5 * self.n as f64;
        let mut all: Vec<f64> = (c.iter().skip(1).zip(sines.iter().skip(1).rev()))
            .map(|(c, s)| half * (c * c + s * s))
            .collect();
        all.insert(0, 2.0 * half * c[0] * c[0]);
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
    fn energies_are_those_of_the_fourier_transform() {
        for n in [5, 8, 30] {
            let x = record(n);
            let dct = Dct::new(n);
            for (k, found) in dct.energies(&dct.forward(&x), &x).iter().enumerate() {
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
