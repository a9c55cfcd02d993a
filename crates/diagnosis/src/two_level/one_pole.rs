//! A process of one pole, as tests hold it against what is known of it.

use model::effect::{Covariance, Frequencies};

/// A process of variance exp(theta0) and correlation of exp(theta1) samples.
pub struct OnePole;

impl Covariance for OnePole {
    fn dimensions(&self) -> usize {
        2
    }

    fn density(&self, theta: &[f64], at: &Frequencies) -> Vec<f64> {
        at.one_pole(theta[0].exp(), (-(-theta[1]).exp()).exp())
    }

    fn bounds(&self, _: usize) -> Vec<(f64, f64)> {
        vec![(-16.0, 6.0), (0.0, 8.0)]
    }

    fn starts(&self, _: usize) -> Vec<Vec<f64>> {
        vec![vec![0.0, 3.0]]
    }
}
