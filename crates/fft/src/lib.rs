//! What of rustfft is used here, by its names, for `f32` and `f64`.
//!
//! rustfft is generic over its numbers, so each crate that makes a plan compiles all of it: it was nine tenths of the code of
//! `numerics` and most of that of `noise`, and as much again of their tests. A plan is made here, where both kinds are compiled once.
//!
//! ```
//! use fft::{FftPlanner, num_complex::Complex};
//!
//! let mut values = [Complex::new(1.0, 0.0); 4];
//! FftPlanner::new().plan_fft_forward(4).process(&mut values);
//! assert_eq!(values[0].re, 4.0);
//! ```

use std::sync::Arc;

pub use rustfft::{Fft, num_complex};

/// Numbers that there are transforms of.
pub trait Real: rustfft::FftNum {
    /// Of these numbers, without a plan so far.
    #[doc(hidden)]
    fn plans() -> Box<dyn Plans<Self>>;
}

/// Behind a table of functions, so that whoever asks compiles none of them.
#[doc(hidden)]
pub trait Plans<T>: Send {
    fn forward(&mut self, length: usize) -> Arc<dyn Fft<T>>;
    fn inverse(&mut self, length: usize) -> Arc<dyn Fft<T>>;
}

impl<T: Real> Plans<T> for rustfft::FftPlanner<T> {
    fn forward(&mut self, length: usize) -> Arc<dyn Fft<T>> {
        self.plan_fft_forward(length)
    }

    fn inverse(&mut self, length: usize) -> Arc<dyn Fft<T>> {
        self.plan_fft_inverse(length)
    }
}

impl Real for f32 {
    #[inline(never)]
    fn plans() -> Box<dyn Plans<Self>> {
        Box::new(rustfft::FftPlanner::new())
    }
}

impl Real for f64 {
    #[inline(never)]
    fn plans() -> Box<dyn Plans<Self>> {
        Box::new(rustfft::FftPlanner::new())
    }
}

/// Makes plans of transforms, and keeps what they share.
pub struct FftPlanner<T: Real>(Box<dyn Plans<T>>);

impl<T: Real> FftPlanner<T> {
    /// Without a plan so far.
    #[must_use]
    pub fn new() -> Self {
        Self(T::plans())
    }

    /// Σ x exp(-2 pi i j k / n), not scaled.
    pub fn plan_fft_forward(&mut self, length: usize) -> Arc<dyn Fft<T>> {
        self.0.forward(length)
    }

    /// Σ x exp(2 pi i j k / n), not scaled.
    pub fn plan_fft_inverse(&mut self, length: usize) -> Arc<dyn Fft<T>> {
        self.0.inverse(length)
    }
}

impl<T: Real> Default for FftPlanner<T> {
    fn default() -> Self {
        Self::new()
    }
}
