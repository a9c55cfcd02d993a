//! Logarithms of products: one for as many factors as a number can hold, where one each would be most of a likelihood.

/// The logarithm of a product of positive factors.
pub struct LogProduct {
    log: f64,
    /// Factors whose logarithm is not taken yet.
    product: f64,
}

/// The empty product.
impl Default for LogProduct {
    fn default() -> Self {
        Self {
            log: 0.0,
            product: 1.0,
        }
    }
}

impl LogProduct {
    /// Far enough from the ends of the numbers that no product within loses digits.
    const HOLDS: std::ops::Range<f64> = 1e-200..1e200;

    /// Takes one more factor, > 0.
    #[inline]
    pub fn multiply(&mut self, factor: f64) {
        let product = self.product * factor;
        if Self::HOLDS.contains(&product) {
            self.product = product;
        } else {
            self.log += self.product.ln();
            self.product = factor;
        }
    }

    /// Its natural logarithm.
    #[must_use]
    pub fn ln(&self) -> f64 {
        self.log + self.product.ln()
    }
}

/// Sum of count * ln(value); neighbours with one count share a logarithm.
pub fn sum_of_logs(counts: &[f64], values: &[f64]) -> f64 {
    let mut rest = values;
    counts
        .chunk_by(|a, b| a == b)
        .map(|same| {
            let (own, others) = rest.split_at(same.len());
            rest = others;
            let mut product = LogProduct::default();
            own.iter().for_each(|v| product.multiply(*v));
            same[0] * product.ln()
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_product_beyond_all_numbers_has_its_logarithm() {
        let factors = [1e-300, 3.0, 1e250, 1e-5, 1e300, 1e300, 0.2];
        let mut product = LogProduct::default();
        factors.iter().for_each(|f| product.multiply(*f));
        let sum: f64 = factors.iter().map(|f| f.ln()).sum();
        assert!((product.ln() - sum).abs() < 1e-11, "{}", product.ln());
        product.multiply(0.0);
        assert_eq!(product.ln(), f64::NEG_INFINITY);
        assert!(LogProduct::default().ln() == 0.0);
    }

    #[test]
    fn values_that_share_a_logarithm_have_the_sum_of_theirs() {
        let counts = [1.0, 1.0, 1.0, 2.0, 3.0, 3.0];
        let values = [0.5, 7.0, 1e-3, 11.0, 1.5, 2.5];
        let each = counts.iter().zip(&values).map(|(c, v)| c * f64::ln(*v));
        let sum: f64 = each.sum();
        assert!((sum_of_logs(&counts, &values) - sum).abs() < 1e-12);
    }
}
