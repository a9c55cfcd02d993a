//! Sums of lagged products by Fourier transforms: what lets the total deviations and Theo1 grow with n·log²m where their
//! definitions take n·m steps.

use std::collections::HashMap;
use std::sync::Arc;

use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};

/// Below this many points a triangle of products is summed as it stands.
const DIRECT: usize = 64;

/// Transforms of the lengths that were needed so far.
pub(super) struct Correlator {
    planner: FftPlanner<f64>,
    plans: HashMap<usize, [Arc<dyn Fft<f64>>; 2]>,
    work: Vec<Complex<f64>>,
    scratch: Vec<Complex<f64>>,
}

impl Correlator {
    pub(super) fn new() -> Self {
        Self {
            planner: FftPlanner::new(),
            plans: HashMap::new(),
            work: Vec::new(),
            scratch: Vec::new(),
        }
    }

    /// Leaves Σⱼ a[j]·b[j + l] at the place `l` of the work space of `length`, from its end for a negative `l`.
    fn correlate(&mut self, a: &[f64], b: &[f64], length: usize) {
        let planner = &mut self.planner;
        let [forward, inverse] = self.plans.entry(length).or_insert_with(|| {
            [
                planner.plan_fft_forward(length),
                planner.plan_fft_inverse(length),
            ]
        });
        // Both in one transform: of one size, lest the rounding of the larger drown the smaller.
        let size = |v: &[f64]| v.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        let (a_size, b_size) = (size(a), size(b));
        let relative = if a_size > 0.0 && b_size > 0.0 {
            b_size / a_size
        } else {
            1.0
        };
        let z = &mut self.work;
        z.clear();
        z.resize(length, Complex::default());
        for (z, a) in z.iter_mut().zip(a) {
            z.re = relative * *a;
        }
        for (z, b) in z.iter_mut().zip(b) {
            z.im = *b;
        }
        let scratch = forward
            .get_inplace_scratch_len()
            .max(inverse.get_inplace_scratch_len());
        self.scratch.resize(scratch, Complex::default());
        forward.process_with_scratch(z, &mut self.scratch);
        // Both spectra are in that of a + ib: A = (Z + Z*)/2 and B = (Z − Z*)/2i, with Z* the conjugate at −k.
        let scale = 1.0 / (4.0 * length as f64 * relative);
        for k in 0..=length / 2 {
            let other = (length - k) % length;
            let (z1, z2) = (z[k], z[other].conj());
            let a = z1 + z2;
            let b = (z1 - z2) * Complex::new(0.0, -1.0);
            let product = a.conj() * b * scale;
            z[k] = product;
            z[other] = product.conj();
        }
        inverse.process_with_scratch(z, &mut self.scratch);
    }

    /// Σⱼ a[j]·b[j + l] for the lags `from .. from + count`; what is outside of either counts as 0.
    pub(super) fn lags(&mut self, a: &[f64], b: &[f64], from: isize, count: usize) -> Vec<f64> {
        if a.is_empty() || b.is_empty() {
            return vec![0.0; count];
        }
        let (low, high) = (1 - a.len() as isize, b.len() as isize);
        // Lags that are not asked for may fall onto one another.
        let needed = (high - from)
            .max(from + count as isize - low)
            .max(high)
            .max(1 - low);
        let length = transform_length(needed as usize);
        self.correlate(a, b, length);
        (from..from + count as isize)
            .map(|l| {
                if (low..high).contains(&l) {
                    self.work[l.rem_euclid(length as isize) as usize].re
                } else {
                    0.0
                }
            })
            .collect()
    }

    /// Sᵢ = Σ_w q[w + i]·q[w + s − i] over `windows` places w, for 0 ≤ i ≤ s/2. `q` has `windows + s` points.
    ///
    /// Each is the autocorrelation of q at the lag s − 2i without the pairs before the first window and after the last:
    /// those pairs fill a triangle at either end.
    pub(super) fn symmetric(&mut self, q: &[f64], windows: usize, s: usize) -> Vec<f64> {
        let q = &q[..windows + s];
        let mut sums = self.lags(q, q, 0, s + 1);
        let mut edges = vec![0.0; s + 1];
        self.corner(&q[..s], &mut edges);
        let last: Vec<f64> = q[windows..].iter().rev().copied().collect();
        self.corner(&last, &mut edges);
        for (sum, edge) in sums.iter_mut().zip(&edges) {
            *sum -= edge;
        }
        (0..=s / 2)
            .map(|i| match s - 2 * i {
                0 => q[i..i + windows].iter().map(|v| v * v).sum(),
                lag => sums[lag],
            })
            .collect()
    }

    /// Adds Σ q[j]·q[k] over j < k with j + k < s, the number of points, to `out[k − j]`.
    fn corner(&mut self, q: &[f64], out: &mut [f64]) {
        let s = q.len();
        let half = s.div_ceil(2);
        let square = self.lags(&q[..half], &q[..half], 0, half);
        for (out, v) in out.iter_mut().zip(square).skip(1) {
            *out += v;
        }
        self.triangle(&q[..s - half], &q[half..], half, out);
    }

    /// Adds Σ a[u]·b[v] over u + v < n, the length of both, to `out[shift + v − u]`.
    fn triangle(&mut self, a: &[f64], b: &[f64], shift: usize, out: &mut [f64]) {
        let n = a.len().min(b.len());
        if n <= DIRECT {
            for (u, a) in a[..n].iter().enumerate() {
                for (out, b) in out[shift - u..].iter_mut().zip(&b[..n - u]) {
                    *out += a * b;
                }
            }
            return;
        }
        // A square, and two triangles of half the size on its sides.
        let half = n.div_ceil(2);
        let square = self.lags(&a[..half], &b[..half], 1 - half as isize, 2 * half - 1);
        for (out, v) in out[shift + 1 - half..].iter_mut().zip(square) {
            *out += v;
        }
        self.triangle(&a[half..n], &b[..n - half], shift - half, out);
        self.triangle(&a[..n - half], &b[half..n], shift + half, out);
    }
}

/// Of the next lengths 2ᵏ, 3·2ᵏ and 9·2ᵏ the shortest.
fn transform_length(needed: usize) -> usize {
    let power = needed.next_power_of_two().max(16);
    [power / 16 * 9, power / 4 * 3]
        .into_iter()
        .find(|length| *length >= needed)
        .unwrap_or(power)
}

/// Takes the straight line of least squares out.
pub(super) fn remove_line(x: &mut [f64]) {
    let n = x.len() as f64;
    let middle = (n - 1.0) / 2.0;
    let mean = x.iter().sum::<f64>() / n;
    let moment: f64 = x
        .iter()
        .enumerate()
        .map(|(i, v)| (i as f64 - middle) * (v - mean))
        .sum();
    let slope = if x.len() > 1 {
        moment / (n * (n * n - 1.0) / 12.0)
    } else {
        0.0
    };
    for (i, v) in x.iter_mut().enumerate() {
        *v -= mean + slope * (i as f64 - middle);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(n: i64) -> Vec<f64> {
        (0..n)
            .map(|k| ((k * k * 7919 + 31 * k) % 1013) as f64 / 500.0 - 1.0)
            .collect()
    }

    #[test]
    fn lagged_products_are_those_of_the_definition() {
        let (a, b) = (points(37), points(90));
        let got = Correlator::new().lags(&a, &b, -40, 140);
        for (l, got) in (-40isize..100).zip(got) {
            let expected: f64 = (0..37isize)
                .filter(|j| (0..90).contains(&(j + l)))
                .map(|j| a[j as usize] * b[(j + l) as usize])
                .sum();
            assert!((got - expected).abs() < 1e-11, "{l}: {got} {expected}");
        }
    }

    #[test]
    fn symmetric_products_are_those_of_the_definition() {
        let q = points(1400);
        let mut correlator = Correlator::new();
        for (windows, s) in [
            (1, 2),
            (1, 1),
            (5, 64),
            (300, 129),
            (700, 700),
            (10, 901),
            (999, 400),
        ] {
            let got = correlator.symmetric(&q[..windows + s], windows, s);
            assert_eq!(got.len(), s / 2 + 1);
            for (i, got) in got.into_iter().enumerate() {
                let expected: f64 = (0..windows).map(|w| q[w + i] * q[w + s - i]).sum();
                assert!(
                    (got - expected).abs() < 1e-9,
                    "{windows} {s} {i}: {got} {expected}"
                );
            }
        }
    }
}
