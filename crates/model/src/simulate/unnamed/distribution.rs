//! A distribution of a stated skewness and kurtosis.

/// Steps of the quadrature over a normal value, and how far it reaches: the density there is 1e-14 of that at 0.
const STEPS: i32 = 320;
const REACH: f64 = 8.0;
/// Least and greatest weight of the tails, and how far it may lean: beyond these the moments hardly change.
const TAILS: [f64; 2] = [0.25, 4.0];
const LEAN: f64 = 4.0;
/// Halvings of each search: 4 / 2^40 is beyond what moments of a record tell.
const HALVINGS: usize = 40;

/// The value (sinh((asinh z + lean) / tails) - mean) / spread of a standard normal z, of mean 0 and variance 1.
///
/// # Source
/// Jones, Pewsey (2009), Sinh-arcsinh distributions, Biometrika 96: 761-780.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::simulate) struct SinhArcsinh {
    lean: f64,
    tails: f64,
    mean: f64,
    spread: f64,
}

impl SinhArcsinh {
    /// Of a skewness and an excess kurtosis, or of the nearest that it can have.
    pub fn of(skewness: f64, excess_kurtosis: f64) -> Self {
        // The kurtosis falls with `tails` at the lean that gives the skewness.
        let leaning = |tails: f64| {
            bisected([-LEAN, LEAN], |lean| {
                Self::moments(lean, tails).1 < skewness
            })
        };
        let tails = bisected(TAILS, |tails| {
            Self::moments(leaning(tails), tails).2 > excess_kurtosis
        });
        Self::moments(leaning(tails), tails).0
    }

    /// The distribution with its skewness and excess kurtosis.
    fn moments(lean: f64, tails: f64) -> (Self, f64, f64) {
        let raw = |z: f64| ((z.asinh() + lean) / tails).sinh();
        let nodes = (-STEPS / 2..=STEPS / 2).map(|k| {
            let z = f64::from(k) * 2.0 * REACH / f64::from(STEPS);
            ((-0.5 * z * z).exp(), raw(z))
        });
        let all: Vec<(f64, f64)> = nodes.collect();
        let weight: f64 = all.iter().map(|n| n.0).sum();
        let about = |centre: f64, power: i32| -> f64 {
            let each = all.iter().map(|(w, x)| w * (x - centre).powi(power));
            each.sum::<f64>() / weight
        };
        let mean = about(0.0, 1);
        let variance = about(mean, 2);
        let own = Self {
            lean,
            tails,
            mean,
            spread: variance.sqrt(),
        };
        let third = about(mean, 3) / variance.powf(1.5);
        (own, third, about(mean, 4) / variance.powi(2) - 3.0)
    }

    /// Its value where a standard normal one is `z`.
    pub fn value(&self, z: f64) -> f64 {
        (((z.asinh() + self.lean) / self.tails).sinh() - self.mean) / self.spread
    }
}

/// Where a condition that holds below a place, and not above it, ends.
fn bisected([mut low, mut high]: [f64; 2], below: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if below(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_has_the_moments_that_were_asked_for() {
        for (skewness, kurtosis) in [
            (0.0, 0.0),
            (-0.04, 0.0),
            (0.3, 0.5),
            (0.0, 6.0),
            (0.0, -0.3),
        ] {
            let own = SinhArcsinh::of(skewness, kurtosis);
            let (_, third, fourth) = SinhArcsinh::moments(own.lean, own.tails);
            assert!((third - skewness).abs() < 1e-6, "{skewness} {third}");
            assert!((fourth - kurtosis).abs() < 1e-6, "{kurtosis} {fourth}");
        }
    }

    #[test]
    fn without_skewness_and_kurtosis_it_is_the_normal_one() {
        let own = SinhArcsinh::of(0.0, 0.0);
        for z in [-4.0, -1.0, 0.0, 0.5, 3.0] {
            assert!((own.value(z) - z).abs() < 1e-6, "{z}");
        }
    }
}
