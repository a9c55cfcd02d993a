//! Noise that comes again: readings a lag apart correlate, and no others do.
//!
//! x(t) = w(t) + c (v(t) +- v(t - L)) of white w and v has the density 1 + p (1 +- cos(w L)) over that of w, with p = 2 c^2 over the
//! variance of w, and a correlation of +- p / (2 (1 + p)) at the lag L alone. Neither a process nor a filter of the library
//! has one: without it the search lays it out in bands and filters, which then stand where the names beside it would.

use std::sync::Arc;

use model::effect::{Covariance, Frequencies};

/// Of any lag: the search finds it in the data.
pub(crate) struct Sought;

/// At one lag.
struct Echo {
    /// Samples.
    lag: usize,
    /// 1 where what comes again is the same, -1 where it is turned round.
    sign: f64,
}

/// Bounds of ln p: what is too small to be seen in any record, and 27 dB above the white noise.
const BOUNDS: (f64, f64) = (-16.0, 6.0);
/// Largest correlation that it starts from; one of 1/2 would leave no white noise.
const MOST: f64 = 0.45;

impl Covariance for Sought {
    fn dimensions(&self) -> usize {
        1
    }

    fn density(&self, _: &[f64], at: &Frequencies) -> Vec<f64> {
        vec![0.0; at.omega.len()]
    }

    fn bounds(&self, _: usize) -> Vec<(f64, f64)> {
        vec![BOUNDS]
    }

    fn starts(&self, _: usize) -> Vec<Vec<f64>> {
        vec![]
    }

    fn at_lag(&self, lag: usize, correlation: f64) -> Option<(Arc<dyn Covariance>, Vec<f64>)> {
        let size = correlation.abs().min(MOST);
        let p = 2.0 * size / (1.0 - 2.0 * size);
        let sign = correlation.signum();
        Some((Arc::new(Echo { lag, sign }), vec![p.ln().max(BOUNDS.0)]))
    }
}

impl Covariance for Echo {
    fn dimensions(&self) -> usize {
        1
    }

    fn density(&self, theta: &[f64], at: &Frequencies) -> Vec<f64> {
        let (p, lag) = (theta[0].exp(), self.lag as f64);
        let of = |w: &f64| p * (1.0 + self.sign * (w * lag).cos());
        at.omega.iter().map(of).collect()
    }

    fn bounds(&self, _: usize) -> Vec<(f64, f64)> {
        vec![BOUNDS]
    }

    fn starts(&self, _: usize) -> Vec<Vec<f64>> {
        vec![]
    }

    fn lag(&self, theta: &[f64]) -> Option<(usize, f64)> {
        let p = theta[0].exp();
        Some((self.lag, self.sign * 0.5 * p / (1.0 + p)))
    }
}
