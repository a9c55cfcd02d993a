//! What a law of the variance, and noise that channels share, gain on data that their sizes have not seen.

use numerics::log_product::LogProduct;

use super::{BEFORE, ends};

/// Least share of a record that shows a law of the variance at more than half its height, for it to have a size.
const SHOWN: f64 = 2e-3;
/// Largest ratio of variances that is asked, as ln.
const MOST_RATIO: f64 = 6.0;

/// What a law of the variance gains on data that its size has not seen, nats, and the standard error. `e` is the whitened
/// residual without the law, `law` its shape in time, which is that of the whole record, as the time of a step is.
#[must_use]
pub fn of_variance(e: &[f64], law: &[f64]) -> (f64, f64) {
    let low = law.iter().copied().fold(f64::INFINITY, f64::min);
    let high = law.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let height: Vec<f64> = law.iter().map(|v| (v - low) / (high - low)).collect();
    let ends = ends(e.len());
    // What one coefficient that is learned adds to the variance, as of a term.
    let mut variance = 1.0 - BEFORE;
    let nats = ends
        .windows(2)
        .map(|w| {
            let (seen, of) = (&e[..w[0]], &height[..w[0]]);
            let shown = of.iter().filter(|h| **h > 0.5).count() as f64;
            let (all, count) = (e.len() as f64, seen.len() as f64);
            if shown < SHOWN * all || shown > count - SHOWN * all {
                return 0.0;
            }
            // The larger over the smaller variance, and the smaller one by the likelihood.
            let at = |ratio: f64| {
                let rise = ratio.exp_m1();
                move |h: f64| 1.0 + rise * h
            };
            let energy = |ratio: f64| -> f64 {
                let (parts, at) = (seen.iter().zip(of), at(ratio));
                parts.map(|(e, h)| e * e / at(*h)).sum::<f64>() / count
            };
            let minus_l = |ratio: f64| {
                let (mut product, at) = (LogProduct::default(), at(ratio));
                of.iter().for_each(|h| product.multiply(at(*h)));
                0.5 * (product.ln() + count * energy(ratio).ln())
            };
            let ratio = numerics::minimise::golden(&minus_l, -MOST_RATIO, MOST_RATIO, 30);
            let (plain, least, at) = (energy(0.0), energy(ratio), at(ratio));
            let nats = |e: f64, v: f64| -0.5 * (v.ln() + e * e / v);
            let next = || e[w[0]..w[1]].iter().zip(&height[w[0]..w[1]]);
            variance += 0.5
                * next()
                    .map(|(_, h)| (least * at(*h) / plain - 1.0).powi(2))
                    .sum::<f64>();
            next()
                .map(|(e, h)| nats(*e, least * at(*h)) - nats(*e, plain))
                .sum::<f64>()
        })
        .sum();
    (nats, variance.sqrt())
}

/// What knowing that channels share noise gains on data that the correlation was not taken from, nats, and the standard
/// error: each block under the correlations of all that lies before it.
#[must_use]
pub fn of_correlation(channels: &[&[f64]]) -> (f64, f64) {
    let Some(n) = channels.iter().map(|c| c.len()).min() else {
        return (0.0, 0.0);
    };
    let pairs = (channels.len() * channels.len().saturating_sub(1) / 2) as f64;
    let mut variance = (1.0 - BEFORE) * pairs;
    let nats = ends(n)
        .windows(2)
        .map(|w| {
            let rms =
                |c: &&[f64]| (c[..w[0]].iter().map(|v| v * v).sum::<f64>() / w[0] as f64).sqrt();
            let scale: Vec<f64> = channels.iter().map(rms).collect();
            let moment = |i: usize, j: usize, from: usize, to: usize| -> f64 {
                let both = channels[i][from..to].iter().zip(&channels[j][from..to]);
                both.map(|(a, b)| a * b).sum::<f64>() / (scale[i] * scale[j])
            };
            let matrix = |of: &dyn Fn(usize, usize) -> f64| -> Vec<Vec<f64>> {
                let row = |i| (0..channels.len()).map(|j| of(i, j)).collect();
                (0..channels.len()).map(row).collect()
            };
            let before = matrix(&|i, j| moment(i, j, 0, w[0]) / w[0] as f64);
            let (inverse, log_det) = crate::fit::likelihood::invert(&before);
            let inside = matrix(&|i, j| moment(i, j, w[0], w[1]));
            let mut square = 0.0;
            for (i, row) in inside.iter().enumerate() {
                for (j, v) in row.iter().enumerate() {
                    square += v * (inverse[i][j] - f64::from(u8::from(i == j)));
                    if j < i {
                        variance += (w[1] - w[0]) as f64 * before[i][j].powi(2);
                    }
                }
            }
            -0.5 * ((w[1] - w[0]) as f64 * log_det + square)
        })
        .sum();
    (nats, variance.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::white;

    #[test]
    fn a_law_of_the_variance_gains_what_it_is_worth_and_costs_where_there_is_none() {
        let law: Vec<f64> = (0..12_000)
            .map(|i| if i / 600 % 2 == 0 { 1.0 } else { 2.0 })
            .collect();
        let e: Vec<f64> = white(12_000, 1)
            .iter()
            .zip(&law)
            .map(|(e, v)| e * f64::sqrt(*v))
            .collect();
        // A reading tells ln(mean) - mean ln of the variances over two: (ln 1.5 - ln 2 / 2) / 2 = 0.0294 nats, of 7200.
        let (nats, error) = of_variance(&e, &law);
        assert!(
            (nats - 212.0).abs() < 5.0 * error && error < 40.0,
            "{nats} {error}"
        );
        let costs: f64 = (0..20)
            .map(|s| of_variance(&white(12_000, s + 10), &law).0)
            .sum();
        assert!((-40.0..5.0).contains(&costs), "{costs}");
    }

    #[test]
    fn shared_noise_gains_what_it_is_worth_and_costs_where_there_is_none() {
        let shared = white(12_000, 2);
        let with = |seed: u64| -> Vec<f64> {
            let own = white(12_000, seed);
            own.iter().zip(&shared).map(|(a, b)| a + 0.5 * b).collect()
        };
        let (x, y) = (with(3), with(4));
        // Correlation 0.25 / 1.25: -ln(1 - 0.04) / 2 nats of 7200 readings.
        let (nats, error) = of_correlation(&[&x, &y]);
        assert!(
            (nats - 147.0).abs() < 5.0 * error && error < 40.0,
            "{nats} {error}"
        );
        let (x, y) = (white(12_000, 5), white(12_000, 6));
        assert!(of_correlation(&[&x, &y]).0 < 3.0);
    }
}
