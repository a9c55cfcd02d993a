//! Numbers that transforms are made in, one or some side by side: loops so short that a processor does each at once.

use std::ops::{Add, Mul, Sub};

use rustfft::Real;
use rustfft::num_complex::Complex;

/// Numbers that a transform is made in.
pub(super) trait Number: Real + Into<f64> {
    fn of(v: f64) -> Self;
}

impl Number for f64 {
    #[inline]
    fn of(v: f64) -> Self {
        v
    }
}

impl Number for f32 {
    #[inline]
    fn of(v: f64) -> Self {
        v as Self
    }
}

/// Complex numbers, one or some side by side.
pub(super) trait Plane:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self>
{
    type Real: Number;
    fn conjugate(self) -> Self;
    fn by(self, real: Self::Real) -> Self;
    /// By -i.
    fn quarter_back(self) -> Self;
}

impl<T: Number> Plane for Complex<T> {
    type Real = T;

    #[inline(always)]
    fn conjugate(self) -> Self {
        self.conj()
    }

    #[inline(always)]
    fn by(self, real: T) -> Self {
        self * real
    }

    #[inline(always)]
    fn quarter_back(self) -> Self {
        Self::new(self.im, -self.re)
    }
}

/// Complex numbers side by side, real and imaginary parts apart.
#[derive(Clone, Copy)]
pub(super) struct Abreast<T> {
    pub(super) re: [T; ABREAST],
    pub(super) im: [T; ABREAST],
}

/// Numbers side by side: as many short ones as wide registers hold.
pub(super) const ABREAST: usize = 8;

/// A function of each two numbers.
#[inline(always)]
pub(super) fn each<T: Number>(
    a: [T; ABREAST],
    b: [T; ABREAST],
    f: impl Fn(T, T) -> T,
) -> [T; ABREAST] {
    let mut made = a;
    for (made, b) in made.iter_mut().zip(b) {
        *made = f(*made, b);
    }
    made
}

impl<T: Number> Abreast<T> {
    #[inline(always)]
    pub(super) fn of(z: impl Fn(usize) -> Complex<T>) -> Self {
        let [mut re, mut im] = [[T::zero(); ABREAST]; 2];
        for i in 0..ABREAST {
            (re[i], im[i]) = (z(i).re, z(i).im);
        }
        Self { re, im }
    }
}

impl<T: Number> Add for Abreast<T> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self {
            re: each(self.re, other.re, |a, b| a + b),
            im: each(self.im, other.im, |a, b| a + b),
        }
    }
}

impl<T: Number> Sub for Abreast<T> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self {
            re: each(self.re, other.re, |a, b| a - b),
            im: each(self.im, other.im, |a, b| a - b),
        }
    }
}

impl<T: Number> Mul for Abreast<T> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let of = |a, b| each(a, b, |a, b| a * b);
        let (re, im) = (of(self.re, other.re), of(self.im, other.im));
        let (across, back) = (of(self.re, other.im), of(self.im, other.re));
        Self {
            re: each(re, im, |a, b| a - b),
            im: each(across, back, |a, b| a + b),
        }
    }
}

impl<T: Number> Plane for Abreast<T> {
    type Real = T;

    #[inline(always)]
    fn conjugate(self) -> Self {
        let im = each(self.im, self.im, |a, _| -a);
        Self { im, ..self }
    }

    #[inline(always)]
    fn by(self, real: T) -> Self {
        Self {
            re: each(self.re, self.re, |a, _| a * real),
            im: each(self.im, self.im, |a, _| a * real),
        }
    }

    #[inline(always)]
    fn quarter_back(self) -> Self {
        Self {
            re: self.im,
            im: each(self.re, self.re, |a, _| -a),
        }
    }
}
