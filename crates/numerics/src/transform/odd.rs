//! Cosine transforms of an odd length, two at a time by a complex one.

use std::f64::consts::SQRT_2;

use rustfft::num_complex::Complex;

use super::abreast::Number;
use super::{About, Packed};

/// The orthonormal DCT-II of two sequences of one odd length, or of the first alone where the second is empty.
pub(super) fn forward_of_two<T: Number>(packed: &Packed<T>, a: About, b: About) -> [Vec<T>; 2] {
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
pub(super) fn inverse_of_two<T: Number>(packed: &Packed<T>, c: &[f64], d: &[f64]) -> [Vec<f64>; 2] {
    let [mut a, mut b] = [c, d].map(|x| vec![0.0; x.len()]);
    let second = |k: usize| d.get(k).copied().unwrap_or(0.0);
    let number = |re: f64, im: f64| Complex::new(T::of(re), T::of(im));
    packed.run(
        |z| {
            let n = z.len();
            let (scale, root) = (T::of((0.5 / n as f64).sqrt()), T::of(SQRT_2));
            packed.plan.turn.each(n.div_ceil(2), |k, turn| {
                let back = turn.conj() * scale;
                if k == 0 {
                    z[0] = number(c[0], -second(0)) * (root * back.re);
                    return;
                }
                let v = number(c[k], -c[n - k]) * back;
                let w = number(second(k), -second(n - k)) * back;
                z[k] = Complex::new(v.re - w.im, -v.im - w.re);
                z[n - k] = Complex::new(v.re + w.im, v.im - w.re);
            });
        },
        |z, _| {
            let mut put = |i: usize, z: &Complex<T>| {
                a[i] = z.re.into();
                b.get_mut(i).into_iter().for_each(|b| *b = (-z.im).into());
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
