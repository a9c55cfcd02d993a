//! Total deviations: the record extended by reflection, so that long cluster times keep more degrees of freedom.

// Indices here name a term or a place in the reflected record, in several arrays at once.
#![allow(clippy::needless_range_loop)]

use super::correlate::Correlator;
use super::{PhasePoint, fast};

/// Σ (x*[i−m] − 2x*[i] + x*[i+m])² over the inner points i, where x* is `x` reflected oddly about both ends, and the
/// number of terms. NIST SP 1065 (2008), eq. (25).
pub(crate) fn total<T: PhasePoint>(x: &[T], m: usize) -> (f64, usize) {
    let n = x.len();
    if n < 3 || m > n - 2 {
        return (0.0, 0);
    }
    let (first, last) = (x[0], x[n - 1]);
    let left = |i: usize| {
        if i >= m {
            x[i - m]
        } else {
            first + first - x[m - i]
        }
    };
    let right = |i: usize| {
        if i + m < n {
            x[i + m]
        } else {
            last + last - x[2 * (n - 1) - i - m]
        }
    };
    let mut sum = 0.0;
    for i in 1..n - 1 {
        let value = ((right(i) - x[i]) - (x[i] - left(i))).to_f64();
        sum += value * value;
    }
    (sum, n - 2)
}

/// The modified total sum over all windows of 3m points, each freed from the slope between its halves and extended to
/// both sides by even reflection; and the number of windows. NIST SP 1065 (2008), eq. (27).
///
/// With Q the running sums of a window (Q₀ = 0, Q₃ₘ = T), the 6m inner sums z of the definition are four points of Q
/// away. Reflection makes them even about both ends of the window, so 0 ≤ i < m (twice) and m ≤ i ≤ 2m (once) say all,
/// for the window against its reflection on the left, and the same on the right:
///
/// | | left | right |
/// |---|---|---|
/// | i < m | Qᵢ + Q₃ₘ₋ᵢ + 3(Qₘ₋ᵢ − Q₂ₘ₋ᵢ) | 2T − Qᵢ − Q₃ₘ₋ᵢ + 3(Qₘ₊ᵢ − Q₂ₘ₊ᵢ) |
/// | m + j | Qₘ₊ⱼ + Q₂ₘ₋ⱼ − 3(Qⱼ + Qₘ₋ⱼ) | 3(Q₂ₘ₊ⱼ + Q₃ₘ₋ⱼ) − Qₘ₊ⱼ − Q₂ₘ₋ⱼ − 4T |
///
/// The slope enters linearly: with b the z of a unit slope, Σ(z − s·b)² = Σz² − 2s·Σzb + s²·Σb². No window is built; the
/// running sums are those of a block of windows, from its own middle, so that they stay small. That takes n·m steps; from
/// m = 96 on [`fast::modified_total`] gives the same sum in n·log²m.
pub(super) fn modified_total<T: PhasePoint>(
    x: &[T],
    m: usize,
    correlator: &mut Correlator,
) -> (f64, usize) {
    let Some(windows) = (x.len() + 1).checked_sub(3 * m).filter(|w| *w > 0) else {
        return (0.0, 0);
    };
    if windows >= m / 4 && m >= fast::MODIFIED_TOTAL_FROM {
        return fast::modified_total(x, m, correlator);
    }
    modified_total_directly(x, m, windows)
}

fn modified_total_directly<T: PhasePoint>(x: &[T], m: usize, windows: usize) -> (f64, usize) {
    let length = 3 * m;
    let half = length / 2;
    // Running sums of 0, 1, 2, ...
    let ramp: Vec<f64> = (0..=length)
        .map(|i| (i * i.saturating_sub(1) / 2) as f64)
        .collect();
    let mut unit = InnerSums::new(m);
    unit.fill(&ramp);
    let unit_squares = unit.product(&unit);
    let mut z = InnerSums::new(m);
    let mut sums = Vec::with_capacity(length + length.max(BLOCK) + 1);
    let mut total = 0.0;
    for start in (0..windows).step_by(length.max(BLOCK)) {
        let end = (start + length.max(BLOCK)).min(windows);
        let points = &x[start..end + length - 1];
        let middle = points[points.len() / 2];
        let mut running = 0.0;
        sums.clear();
        sums.push(0.0);
        sums.extend(points.iter().map(|v| {
            running += (*v - middle).to_f64();
            running
        }));
        for q in sums.windows(length + 1) {
            z.fill(q);
            let slope = if half == 0 {
                0.0
            } else {
                let (low, high) = (q[half] - q[0], q[length] - q[length - half]);
                (high - low) / (half as f64 * (length - half) as f64)
            };
            let inner =
                z.product(&z) - 2.0 * slope * z.product(&unit) + slope * slope * unit_squares;
            // Sums of m points here, means of m samples in the definition: the caller divides by m⁴ as for `mdev`.
            total += inner.max(0.0) / (6 * m) as f64;
        }
    }
    (total, windows)
}

/// Windows that share their running sums, where 3m is shorter.
const BLOCK: usize = 4096;

/// The z of a window that differ: left and right, those that count twice and those that count once.
struct InnerSums {
    m: usize,
    twice: [Vec<f64>; 2],
    once: [Vec<f64>; 2],
}

impl InnerSums {
    fn new(m: usize) -> Self {
        Self {
            m,
            twice: [vec![0.0; m], vec![0.0; m]],
            once: [vec![0.0; m + 1], vec![0.0; m + 1]],
        }
    }

    /// From the running sums of a window, whose first value is taken as 0.
    fn fill(&mut self, q: &[f64]) {
        let m = self.m;
        let (first, last) = (q[0], q[3 * m]);
        let up = |from: usize| q[from..].iter();
        // The same points backwards from `from`.
        let down = |from: usize| q[..=from].iter().rev();
        let [left, right] = &mut self.twice;
        for ((((z, a), b), c), d) in left
            .iter_mut()
            .zip(up(0))
            .zip(down(3 * m))
            .zip(down(m))
            .zip(down(2 * m))
        {
            *z = (a + b) + 3.0 * (c - d) - 2.0 * first;
        }
        for ((((z, a), b), c), d) in right
            .iter_mut()
            .zip(up(0))
            .zip(down(3 * m))
            .zip(up(m))
            .zip(up(2 * m))
        {
            *z = 3.0 * (c - d) - (a + b) + 2.0 * last;
        }
        let [left, right] = &mut self.once;
        for ((((z, a), b), c), d) in left
            .iter_mut()
            .zip(up(m))
            .zip(down(2 * m))
            .zip(up(0))
            .zip(down(m))
        {
            *z = (a + b) - 3.0 * (c + d) + 4.0 * first;
        }
        for ((((z, a), b), c), d) in right
            .iter_mut()
            .zip(up(m))
            .zip(down(2 * m))
            .zip(up(2 * m))
            .zip(down(3 * m))
        {
            *z = 3.0 * (c + d) - (a + b) - 4.0 * last;
        }
    }

    /// Σ zᵢ·yᵢ over all 6m.
    fn product(&self, y: &Self) -> f64 {
        let sides = |side: usize| {
            let (z, y2) = (&self.twice[side], &y.twice[side]);
            2.0 * dot(z, y2) - z[0] * y2[0] + dot(&self.once[side], &y.once[side])
        };
        sides(0) + sides(1)
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0f64; 8];
    let (a8, a_rest) = a.as_chunks::<8>();
    let (b8, b_rest) = b.as_chunks::<8>();
    for (a, b) in a8.iter().zip(b8) {
        for lane in 0..8 {
            sums[lane] += a[lane] * b[lane];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + rest
}

/// Σᵢ Σδ ((x[i] − x[i−δ+m/2]) + (x[i+m] − x[i+δ+m/2]))²/(m/2 − δ) over all i and 0 ≤ δ < m/2, and the number of i. `m` is
/// even and at least 10. NIST SP 1065 (2008), eq. (30).
pub(super) fn theo1<T: PhasePoint>(x: &[T], m: usize, correlator: &mut Correlator) -> (f64, usize) {
    let Some(terms) = x.len().checked_sub(m).filter(|t| *t > 0) else {
        return (0.0, 0);
    };
    if m < 10 || !m.is_multiple_of(2) {
        return (0.0, 0);
    }
    if terms >= m / 4 && m >= fast::THEO1_FROM {
        return fast::theo1(x, m, correlator);
    }
    theo1_directly(x, m, terms)
}

fn theo1_directly<T: PhasePoint>(x: &[T], m: usize, terms: usize) -> (f64, usize) {
    let half = m / 2;
    let mut sum = 0.0;
    // δ outside: the inner loop runs along the record.
    for delta in 0..half {
        let (a, b) = (&x[..terms], &x[half - delta..][..terms]);
        let (c, d) = (&x[m..][..terms], &x[half + delta..][..terms]);
        let mut sums = [0.0f64; 8];
        for i in 0..terms {
            let value = ((a[i] - b[i]) + (c[i] - d[i])).to_f64();
            sums[i % 8] += value * value;
        }
        sum += sums.iter().sum::<f64>() / (half - delta) as f64;
    }
    (sum, terms)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The definition, window by window: detrend, reflect, average, difference.
    fn by_definition(x: &[f64], m: usize) -> (f64, usize) {
        let length = 3 * m;
        let half = length / 2;
        let mut sum = 0.0;
        let windows = x.len() + 1 - length;
        for x in x.windows(length) {
            let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
            let slope = if half == 0 {
                0.0
            } else {
                (mean(&x[length - half..]) - mean(&x[..half])) / (length - half) as f64
            };
            let window: Vec<f64> = x
                .iter()
                .enumerate()
                .map(|(i, v)| v - slope * i as f64)
                .collect();
            let extended: Vec<f64> = window
                .iter()
                .rev()
                .chain(&window)
                .chain(window.iter().rev())
                .copied()
                .collect();
            let inner: f64 = (0..6 * m)
                .map(|i| {
                    let part = |k: usize| extended[i + k * m..i + (k + 1) * m].iter().sum::<f64>();
                    (part(0) - 2.0 * part(1) + part(2)).powi(2)
                })
                .sum();
            sum += inner / (6 * m) as f64;
        }
        (sum, windows)
    }

    #[test]
    fn the_modified_total_of_running_sums_is_that_of_the_definition() {
        let mut phase = 0.0;
        let x: Vec<f64> = (0..400i64)
            .map(|k| {
                phase += ((k * k * 7919 + 31 * k) % 1013) as f64 - 500.0;
                phase
            })
            .collect();
        for m in [1, 2, 3, 7, 20, 64, 133] {
            let (got, n) = modified_total(&x, m, &mut Correlator::new());
            let (expected, windows) = by_definition(&x, m);
            assert_eq!(n, windows);
            assert!(
                (got / expected - 1.0).abs() < 1e-10,
                "m = {m}: {got} {expected}"
            );
        }
    }

    /// Records that try the transforms: white rate, a walk of the rate upon a steep ramp, white phase.
    fn hard(n: usize) -> [Vec<f64>; 3] {
        let white: Vec<f64> = (0..n as i64)
            .map(|k| ((k * k % 100_003 * 7919 + 31 * k) % 1013) as f64 - 506.0)
            .collect();
        let sums = |values: &[f64]| -> Vec<f64> {
            let mut sum = 0.0;
            values
                .iter()
                .map(|v| {
                    sum += v;
                    sum
                })
                .collect()
        };
        let rate: Vec<f64> = sums(&white)
            .into_iter()
            .enumerate()
            .map(|(i, v)| v + 50.0 * i as f64 + 1e6)
            .collect();
        [sums(&white), sums(&rate), white]
    }

    #[test]
    fn transforms_give_the_sums_as_they_stand_for_every_kind_of_noise_and_length_of_window() {
        let mut correlator = Correlator::new();
        // Upon the ramp the squares that cancel are large.
        let bounds = [1e-12, 1e-9, 1e-12];
        for ((kind, x), bound) in hard(9000).into_iter().enumerate().zip(bounds) {
            for m in [96, 97, 333, 1024, 2900] {
                let windows = x.len() + 1 - 3 * m;
                let fast = fast::modified_total(&x, m, &mut correlator);
                let (expected, n) = modified_total_directly(&x, m, windows);
                assert_eq!(fast.1, n);
                assert!(
                    (fast.0 / expected - 1.0).abs() < bound,
                    "modified total, noise {kind}, m = {m}: {:e}",
                    fast.0 / expected - 1.0
                );
            }
            for m in [256, 334, 1024, 5000, 8998] {
                let windows = x.len() - m;
                let fast = fast::theo1(&x, m, &mut correlator);
                let (expected, n) = theo1_directly(&x, m, windows);
                assert_eq!(fast.1, n);
                assert!(
                    (fast.0 / expected - 1.0).abs() < bound,
                    "Theo1, noise {kind}, m = {m}: {:e}",
                    fast.0 / expected - 1.0
                );
            }
        }
    }
}
