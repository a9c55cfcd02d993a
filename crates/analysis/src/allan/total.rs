//! Total deviations: the record extended by reflection, so that long cluster times keep more degrees of freedom.

// Indices here name a term or a place in the reflected record, in several arrays at once.
#![allow(clippy::needless_range_loop)]

use super::PhasePoint;

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
pub(crate) fn modified_total<T: PhasePoint>(x: &[T], m: usize) -> (f64, usize) {
    let Some(windows) = (x.len() + 1).checked_sub(3 * m).filter(|w| *w > 0) else {
        return (0.0, 0);
    };
    let length = 3 * m;
    let half = length / 2;
    let mut window = vec![0.0; length];
    let mut prefix = vec![0.0; 9 * m + 1];
    let mut sum = 0.0;
    for n in 0..windows {
        let x = &x[n..n + length];
        let low: f64 = x[..half].iter().map(|v| (*v - x[0]).to_f64()).sum();
        let high: f64 = x[length - half..]
            .iter()
            .map(|v| (*v - x[0]).to_f64())
            .sum();
        let slope = if half == 0 {
            0.0
        } else {
            (high - low) / (half as f64 * (length - half) as f64)
        };
        for (i, (w, v)) in window.iter_mut().zip(x).enumerate() {
            *w = (*v - x[0]).to_f64() - slope * i as f64;
        }
        let mut running = 0.0;
        let extended = window
            .iter()
            .rev()
            .chain(&window)
            .chain(window.iter().rev());
        for (p, w) in prefix[1..].iter_mut().zip(extended) {
            running += w;
            *p = running;
        }
        let mut inner = 0.0;
        for i in 0..6 * m {
            let (a, b, c, d) = (
                prefix[i],
                prefix[i + m],
                prefix[i + 2 * m],
                prefix[i + 3 * m],
            );
            let z = (d - c) - 2.0 * (c - b) + (b - a);
            inner += z * z;
        }
        // Sums of m points here, means of m samples in the definition: the caller divides by m⁴ as for `mdev`.
        sum += inner / (6 * m) as f64;
    }
    (sum, windows)
}
