//! Rounding to counts.

/// The integer next to a value, of two as near the one farther from 0, within bounds: `round` without a call. 0 of what is no
/// number.
#[inline]
#[must_use]
pub fn nearest(value: f64, low: i32, high: i32) -> i32 {
    let v = value.clamp(f64::from(low), f64::from(high));
    let toward_zero = v as i32;
    let rest = v - f64::from(toward_zero);
    toward_zero + i32::from(rest >= 0.5) - i32::from(rest <= -0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_round_within_bounds() {
        let round = |v: f64, low: i32, high: i32| v.round().clamp(low.into(), high.into()) as i32;
        let below_half = 0.5f64.next_down();
        let edges = [
            0.0,
            -0.0,
            0.5,
            -0.5,
            below_half,
            1.5,
            2.5,
            -2.5,
            8191.5,
            1e300,
            f64::NAN,
        ];
        let more = [2147483646.5, 2147483647.0, -2147483648.5, f64::INFINITY];
        let many = (-4000..4000).map(|k| f64::from(k) * 0.125 + 0.01);
        for v in edges.into_iter().chain(more).chain(many) {
            for (low, high) in [(i32::MIN, i32::MAX), (-8192, 8191), (-3, 2)] {
                for v in [v, -v] {
                    assert_eq!(nearest(v, low, high), round(v, low, high), "{v}");
                }
            }
        }
    }
}
