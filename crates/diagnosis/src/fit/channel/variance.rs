//! The laws of the variance of a channel.

use model::effect::{Effect, Found, Parameters, extremes};

use crate::fit::scan::LOUD;

/// A law of the variance that was found.
pub(crate) struct VarianceFound {
    pub effect: &'static dyn Effect,
    pub parameters: Parameters,
    /// What was estimated.
    pub found: Found,
    /// What it adds, by sample, in units of the coefficient: the law is 1 + coefficient x shape.
    pub shape: Vec<f64>,
    pub lr: f64,
    pub threshold: f64,
    pub alternatives: Vec<(&'static dyn Effect, f64)>,
    /// Variance over its mean, by sample.
    pub law: Vec<f64>,
    /// The channel that it follows.
    pub follows: Option<String>,
}

impl VarianceFound {
    /// Coefficient of the law.
    pub fn gamma(&self) -> f64 {
        self.found.coefficients.first().map_or(0.0, |c| c.0)
    }
}

/// Laws of the variance of a channel, which multiply.
#[derive(Default)]
pub(crate) struct VarianceLaws {
    /// Each law.
    pub each: Vec<VarianceFound>,
    /// Variance under all of them over its mean, by sample; of no law empty.
    product: Vec<f64>,
}

impl VarianceLaws {
    /// These laws together.
    pub fn of(each: Vec<VarianceFound>) -> Self {
        let count = each.first().map_or(0, |v| v.law.len());
        let at = |i: usize| each.iter().map(|v| v.law[i]).product::<f64>();
        let mut product: Vec<f64> = (0..count).map(at).collect();
        over_mean(&mut product);
        Self { each, product }
    }

    /// Variance over its mean by sample, where it is not the same throughout.
    pub fn product(&self) -> Option<&[f64]> {
        (!self.is_empty()).then_some(self.product.as_slice())
    }

    /// Likelihood ratio of all of them.
    pub fn lr(&self) -> f64 {
        self.each.iter().map(|v| v.lr).sum()
    }

    /// Whether the variance is the same throughout.
    pub fn is_empty(&self) -> bool {
        self.each.is_empty()
    }

    /// Whether it is many times as large in some places as in others.
    pub fn are_loud(&self) -> bool {
        let [least, most] = extremes(&self.product);
        most > LOUD * least
    }

    /// A residual over the square root of the variance.
    pub fn divide(&self, e: &mut [f64]) {
        divide(e, &self.product);
    }

    /// The same undone.
    pub fn undo(&self, e: &mut [f64]) {
        undo(e, &self.product);
    }
}

/// A residual over the square root of a variance by sample; of no variance as it is.
pub(crate) fn divide(e: &mut [f64], variance: &[f64]) {
    let both = e.iter_mut().zip(variance);
    both.for_each(|(e, v)| *e /= v.sqrt());
}

/// The same undone.
pub(crate) fn undo(e: &mut [f64], variance: &[f64]) {
    let both = e.iter_mut().zip(variance);
    both.for_each(|(e, v)| *e *= v.sqrt());
}

/// Values over their mean.
pub(crate) fn over_mean(values: &mut [f64]) {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter_mut().for_each(|v| *v /= mean);
}
