//! Cosine transforms of an even length, by a complex one of half of it.

use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2};

use rustfft::num_complex::Complex;

use super::abreast::{ABREAST, Abreast, Number, Plane, each};
use super::{About, Packed, Turns, both};
use crate::wide;

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

/// Work on what lies at k and at its mirror images, by the turn there.
trait AtTurns<T> {
    fn one(&mut self, k: usize, turn: Complex<T>);
    /// From k on, side by side.
    fn some(&mut self, k: usize, turn: Abreast<T>);
}

impl<T: Number> Turns<T> {
    /// Work at k = 0 ..= h/2, side by side where neither end is among them.
    #[inline(always)]
    fn to_half(&self, h: usize, mut work: impl AtTurns<T>) {
        let coarse = self.coarse.iter().zip((0..=h / 2).step_by(Self::FINE));
        for (coarse, from) in coarse {
            let fine = self.fine.as_chunks::<ABREAST>().0.iter();
            for (fine, k) in fine.zip((from..=h / 2).step_by(ABREAST)) {
                if k == 0 || k + ABREAST > h / 2 {
                    for (fine, k) in fine.iter().zip(k..=h / 2) {
                        work.one(k, coarse * fine);
                    }
                } else {
                    let turn = Abreast::of(|_| *coarse) * Abreast::of(|i| fine[i]);
                    work.some(k, turn);
                }
            }
        }
    }
}

wide! {
    /// Coefficients from the transform z of a packed sequence, by the scales of all and of those an eighth of a circle on.
    fn coefficients[T: Number](z: &[Complex<T>], turns: &Turns<T>, scale: [T; 2], c: &mut [T]) -> ()
    = coefficients_of
}

#[inline(always)]
fn coefficients_of<T: Number>(z: &[Complex<T>], turns: &Turns<T>, scale: [T; 2], c: &mut [T]) {
    turns.to_half(z.len(), Coefficients { z, scale, c });
}

struct Coefficients<'a, T> {
    z: &'a [Complex<T>],
    scale: [T; 2],
    c: &'a mut [T],
}

impl<T: Number> AtTurns<T> for Coefficients<'_, T> {
    #[inline(always)]
    fn one(&mut self, k: usize, turn: Complex<T>) {
        let Self { z, scale, c } = self;
        let (h, n) = (z.len(), c.len());
        let mirrored = z[if k == 0 { 0 } else { h - k }];
        let [v, w] = turned(z[k], mirrored, turn, *scale);
        (c[k], c[h - k], c[h + k]) = (v.re, w.re - w.im, w.re + w.im);
        if k > 0 {
            c[n - k] = -v.im;
        }
    }

    #[inline(always)]
    fn some(&mut self, k: usize, turn: Abreast<T>) {
        let Self { z, scale, c } = self;
        let (h, n, last) = (z.len(), c.len(), k + ABREAST - 1);
        let (a, b) = (&z[k..=last], &z[h - last..=h - k]);
        let a = Abreast::of(|i| a[i]);
        let b = Abreast::of(|i| b[ABREAST - 1 - i]);
        let [v, w] = turned(a, b, turn, *scale);
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

/// Coefficients k and n - k in the parts of the first, those about h in the second: the turn at h - k is that at k
/// conjugated, by an eighth of a circle.
#[inline(always)]
fn turned<Z: Plane>(a: Z, b: Z, turn: Z, scale: [Z::Real; 2]) -> [Z; 2] {
    let (f, g) = both(a, b, turn);
    [(f * turn).by(scale[0]), (g * turn).by(scale[1])]
}

/// The orthonormal DCT-II of a sequence of even length.
pub(super) fn forward_of_one<T: Number>(packed: &Packed<T>, x: About) -> Vec<T> {
    let n = x.samples.len();
    let mut c = vec![T::zero(); n];
    // The spectrum of what is laid out, turned by k/4 of a sample, holds coefficient k in its real part and n - k in its
    // imaginary one.
    let scale = T::of((2.0 / n as f64).sqrt());
    let of_eighth = T::of((2.0 / n as f64).sqrt() * FRAC_1_SQRT_2);
    packed.run(
        |z| laid_out(x, z),
        |z, turns| coefficients(z, turns, [scale, of_eighth], &mut c),
    );
    c[0] = c[0] * T::of(FRAC_1_SQRT_2) + T::of(x.level * (n as f64).sqrt());
    c
}

wide! {
    /// The spectrum, conjugated, of the packed sequence that has these coefficients.
    fn spectrum[T: Number](c: &[f64], turns: &Turns<T>, half: [T; 2], z: &mut [Complex<T>]) -> ()
    = spectrum_of
}

#[inline(always)]
fn spectrum_of<T: Number>(c: &[f64], turns: &Turns<T>, half: [T; 2], z: &mut [Complex<T>]) {
    turns.to_half(z.len(), Spectrum { c, half, z });
}

struct Spectrum<'a, T> {
    c: &'a [f64],
    half: [T; 2],
    z: &'a mut [Complex<T>],
}

#[inline(always)]
fn number<T: Number>(re: f64, im: f64) -> Complex<T> {
    Complex::new(T::of(re), T::of(im))
}

impl<T: Number> AtTurns<T> for Spectrum<'_, T> {
    #[inline(always)]
    fn one(&mut self, k: usize, turn: Complex<T>) {
        let Self { c, half, z } = self;
        let (h, n) = (z.len(), c.len());
        let v = match k {
            0 => number(SQRT_2 * c[0], 0.0),
            k => number(c[k], -c[n - k]),
        };
        let w = number(c[h - k] + c[h + k], c[h + k] - c[h - k]);
        let (low, high) = returned(v, w, turn, *half);
        z[k] = low;
        if k > 0 {
            z[h - k] = high;
        }
    }

    #[inline(always)]
    fn some(&mut self, k: usize, turn: Abreast<T>) {
        let Self { c, half, z } = self;
        let (h, n, last) = (z.len(), c.len(), k + ABREAST - 1);
        let (low, high) = (&c[k..=last], &c[n - last..=n - k]);
        let (below, above) = (&c[h - last..=h - k], &c[h + k..=h + last]);
        let v = Abreast::of(|i| number(low[i], -high[ABREAST - 1 - i]));
        let w = Abreast::of(|i| {
            let below = below[ABREAST - 1 - i];
            number(below + above[i], above[i] - below)
        });
        let (low, high) = returned(v, w, turn, *half);
        for i in 0..ABREAST {
            z[k + i] = Complex::new(low.re[i], low.im[i]);
            z[h - k - i] = Complex::new(high.re[i], high.im[i]);
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
pub(super) fn inverse_of_one<T: Number>(packed: &Packed<T>, c: &[f64]) -> Vec<f64> {
    let n = c.len();
    let h = n / 2;
    let half = 0.5 * (0.5 * n as f64).sqrt() / h as f64;
    let mut x = vec![0.0; n];
    let half = [half, half * FRAC_1_SQRT_2].map(T::of);
    packed.run(
        |z| spectrum(c, &packed.plan.turn, half, z),
        |z, _| {
            let (fours, last) = x.as_chunks_mut::<4>();
            for (j, four) in fours.iter_mut().enumerate() {
                let (a, b) = (z[j], z[h - 1 - j]);
                *four = [a.re, -b.im, -a.im, b.re].map(T::into);
            }
            if let [a, b] = last {
                (*a, *b) = (z[h / 2].re.into(), (-z[h / 2].im).into());
            }
        },
    );
    x
}
