//! Straight lines through readings whose zero walks: generalized least squares.
//!
//! y = X b + e, cov(e)_ij = v_i [i = j] + K^2 min(t_i, t_j). The white part v is measured; the walk K comes from the same
//! readings, by restricted maximum likelihood (Patterson and Thompson 1971), so a zero that drifts widens the intervals and is
//! not taken for what was varied.

/// Values of the walk that are tried, from none on, over the white noise of a reading and the root of its spacing.
const WALKS: [f64; 17] = [
    0.0, 0.003, 0.006, 0.01, 0.02, 0.03, 0.05, 0.07, 0.1, 0.15, 0.2, 0.3, 0.5, 0.8, 1.5, 3.0, 6.0,
];

/// What is left of a column beside those before it, in squares, if it is nothing but rounding.
const ROUNDING: f64 = 1e-12;

/// What was fitted.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Coefficients, by column.
    pub values: Vec<f64>,
    /// Standard errors, scaled so that 1.96 of them make a 95 % interval by Student's t.
    pub errors: Vec<f64>,
    /// K, in the unit of y over the root of that of t.
    pub walk: f64,
}

/// Cholesky's factor of a symmetric matrix, in its lower half; `None` where it is not positive.
fn factor(mut a: Vec<Vec<f64>>) -> Option<Vec<Vec<f64>>> {
    for j in 0..a.len() {
        for i in j..a.len() {
            let done: f64 = (0..j).map(|k| a[i][k] * a[j][k]).sum();
            let left = a[i][j] - done;
            a[i][j] = if i > j {
                left / a[j][j]
            } else if left > ROUNDING * a[j][j] && left.is_finite() {
                left.sqrt()
            } else {
                return None;
            };
        }
    }
    Some(a)
}

/// L^-1 b.
fn forward(l: &[Vec<f64>], b: &[f64]) -> Vec<f64> {
    let mut x = Vec::with_capacity(b.len());
    for (i, row) in l.iter().enumerate() {
        let done: f64 = row.iter().zip(&x).map(|(l, x)| l * x).sum();
        x.push((b[i] - done) / row[i]);
    }
    x
}

/// L^-T b.
fn backward(l: &[Vec<f64>], b: &[f64]) -> Vec<f64> {
    let mut x = b.to_vec();
    for i in (0..b.len()).rev() {
        x[i] /= l[i][i];
        for k in 0..i {
            x[k] -= l[i][k] * x[i];
        }
    }
    x
}

fn log_determinant(l: &[Vec<f64>]) -> f64 {
    2.0 * (0..l.len()).map(|i| l[i][i].ln()).sum::<f64>()
}

/// One walk tried: its restricted likelihood, what is fitted, and the inverse of X' V^-1 X by its factor.
struct Tried {
    likelihood: f64,
    values: Vec<f64>,
    normal: Vec<Vec<f64>>,
    chi2: f64,
}

fn try_walk(
    y: &[f64],
    t: &[f64],
    variance: &[f64],
    columns: &[Vec<f64>],
    walk: f64,
) -> Option<Tried> {
    let n = y.len();
    let covariance = (0..n)
        .map(|i| {
            let of = |j: usize| {
                let own = if i == j { variance[i] } else { 0.0 };
                own + walk * walk * (t[i].min(t[j]) - t[0])
            };
            (0..n).map(of).collect()
        })
        .collect();
    let l = factor(covariance)?;
    let white: Vec<Vec<f64>> = columns.iter().map(|column| forward(&l, column)).collect();
    let y = forward(&l, y);
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let normal = white
        .iter()
        .map(|a| white.iter().map(|b| dot(a, b)).collect())
        .collect();
    let normal = factor(normal)?;
    let right: Vec<f64> = white.iter().map(|a| dot(a, &y)).collect();
    let values = backward(&normal, &forward(&normal, &right));
    let left = |k: usize| {
        y[k] - (0..values.len())
            .map(|c| white[c][k] * values[c])
            .sum::<f64>()
    };
    let chi2: f64 = (0..n).map(|k| left(k).powi(2)).sum();
    let likelihood = -0.5 * (log_determinant(&l) + log_determinant(&normal) + chi2);
    Some(Tried {
        likelihood,
        values,
        normal,
        chi2,
    })
}

/// Fits `columns` (each as long as `y`) to readings `y` at the times `t`, ascending, whose white noise has these variances.
/// `None` where there are no more readings than columns, or the columns are not independent.
#[must_use]
pub fn fit(y: &[f64], t: &[f64], variance: &[f64], columns: &[Vec<f64>]) -> Option<Fit> {
    let (n, p) = (y.len(), columns.len());
    if n <= p {
        return None;
    }
    let spacing = (t[n - 1] - t[0]) / (n - 1) as f64;
    let white = (variance.iter().sum::<f64>() / n as f64).sqrt();
    let unit = white / spacing.sqrt();
    let tried = WALKS.iter().filter_map(|walk| {
        let walk = walk * unit;
        Some((walk, try_walk(y, t, variance, columns, walk)?))
    });
    let (walk, best) = tried.max_by(|a, b| a.1.likelihood.total_cmp(&b.1.likelihood))?;
    let free = (n - p) as f64;
    // What the walk does not explain widens the intervals; what it explains too well narrows none.
    let birge = (best.chi2 / free).max(1.0).sqrt();
    let wider = birge * student(free) / 1.96;
    let errors = (0..p).map(|k| {
        let mut unit = vec![0.0; p];
        unit[k] = 1.0;
        forward(&best.normal, &unit)
            .iter()
            .map(|v| v * v)
            .sum::<f64>()
            .sqrt()
            * wider
    });
    Some(Fit {
        errors: errors.collect(),
        values: best.values,
        walk,
    })
}

/// Student's t at 97.5 %: Cornish and Fisher's expansion about the normal quantile, right to 1 % from 3 degrees of freedom on.
#[must_use]
pub fn student(degrees: f64) -> f64 {
    let z: f64 = 1.959_964;
    let (z3, z5, z7) = (z.powi(3), z.powi(5), z.powi(7));
    z + (z3 + z) / (4.0 * degrees)
        + (5.0 * z5 + 16.0 * z3 + 3.0 * z) / (96.0 * degrees.powi(2))
        + (3.0 * z7 + 19.0 * z5 + 17.0 * z3 - 15.0 * z) / (384.0 * degrees.powi(3))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_core::{Rng, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    #[test]
    fn ref_quantiles_of_student() {
        // NIST/SEMATECH e-Handbook, 1.3.6.7.2.
        for (degrees, t) in [
            (3.0, 3.182),
            (5.0, 2.571),
            (10.0, 2.228),
            (30.0, 2.042),
            (100.0, 1.984),
        ] {
            assert!(
                (student(degrees) / t - 1.0).abs() < 0.01,
                "{degrees}: {}",
                student(degrees)
            );
        }
    }

    fn normal(random: &mut Xoshiro256PlusPlus) -> f64 {
        (0..12)
            .map(|_| f64::from(random.next_u32()) / 2f64.powi(32))
            .sum::<f64>()
            - 6.0
    }

    /// Share of draws whose 95 % interval holds a planted slope, beside a walk of `walk`.
    fn coverage(walk: f64) -> f64 {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(11);
        let (n, draws, slope, white) = (60, 400, 0.7, 0.1);
        let t: Vec<f64> = (0..n).map(f64::from).collect();
        // Six positions, one after the other.
        let x: Vec<f64> = (0..n)
            .map(|k| [1.0, -1.0, 0.2, -0.1, 0.0, 0.1][(k / 10) as usize])
            .collect();
        let columns = [vec![1.0; n as usize], x.clone()];
        let held = (0..draws).filter(|_| {
            let mut bias = 0.3;
            let y: Vec<f64> = x
                .iter()
                .map(|x| {
                    bias += walk * normal(&mut random);
                    bias + slope * x + white * normal(&mut random)
                })
                .collect();
            let fit = fit(&y, &t, &vec![white * white; n as usize], &columns).unwrap();
            (fit.values[1] - slope).abs() <= 1.96 * fit.errors[1]
        });
        held.count() as f64 / f64::from(draws)
    }

    #[test]
    fn intervals_hold_whether_the_bias_walks_or_not() {
        for walk in [0.0, 0.01, 0.05, 0.2] {
            let held = coverage(walk);
            // 400 draws: 0.95 +- 0.033 at three sigma; a walk that has to be estimated costs some.
            assert!((0.90..=0.99).contains(&held), "{walk}: {held}");
        }
    }

    #[test]
    fn columns_that_are_one_are_refused() {
        let column = vec![1.0; 8];
        let t: Vec<f64> = (0..8).map(f64::from).collect();
        assert!(fit(&t, &t, &[1.0; 8], &[column.clone(), column.clone()]).is_none());
        assert!(fit(&t[..1], &t[..1], &[1.0], &[column]).is_none());
    }
}
