//! Exponentials and logarithms without a branch, of which a processor makes several at once where they stand in a loop.

use std::f64::consts::LOG2_E;

/// Added and taken off again, it leaves the nearest whole number, which then stands in the lowest bits.
const WHOLE: f64 = 6_755_399_441_055_744.0;
/// ln 2 in a part of few digits, whose multiples are exact, and the rest.
const LN_2_HIGH: f64 = 6.931_471_803_691_238e-1;
const LN_2_LOW: f64 = 1.908_214_929_270_587_7e-10;
/// Beyond, exponentials stand still: as good as nothing, and as everything.
const FARTHEST: f64 = 700.0;

/// 1/k! from k = 0 on.
const TAYLOR: [f64; 14] = {
    let mut all = [1.0; 14];
    let mut k = 1;
    while k < 14 {
        all[k] = all[k - 1] / k as f64;
        k += 1;
    }
    all
};

/// a b + c; `at_once` on a processor that makes it so, rounded once.
#[inline(always)]
pub fn product_and<const AT_ONCE: bool>(a: f64, b: f64, c: f64) -> f64 {
    if AT_ONCE { a.mul_add(b, c) } else { a * b + c }
}

/// e to the power of `x`, within some 4e-16 of itself.
#[inline(always)]
pub fn exp<const AT_ONCE: bool>(x: f64) -> f64 {
    let mut one = [x];
    exponentials::<1, AT_ONCE>(&mut one);
    one[0]
}

/// Of each, e to its power, step by step beside the others.
#[inline(always)]
#[allow(clippy::needless_range_loop)]
pub fn exponentials<const N: usize, const AT_ONCE: bool>(all: &mut [f64; N]) {
    let of = product_and::<AT_ONCE>;
    let [mut r, mut power, mut sum] = [[0.0; N]; 3];
    for l in 0..N {
        let x = all[l];
        let x = if x < -FARTHEST { -FARTHEST } else { x };
        let x = if x > FARTHEST { FARTHEST } else { x };
        let shifted = of(x, LOG2_E, WHOLE);
        let whole = shifted - WHOLE;
        r[l] = of(-whole, LN_2_LOW, of(-whole, LN_2_HIGH, x));
        power[l] = f64::from_bits((shifted.to_bits() << 52).wrapping_add(1f64.to_bits()));
    }
    for l in 0..N {
        let (r, c) = (r[l], &TAYLOR);
        // Pairs, fours and eights: no long chain of sums.
        let (two, four) = (r * r, (r * r) * (r * r));
        let pair = |k: usize| of(c[k + 1], r, c[k]);
        let fours = |k: usize| of(pair(k + 2), two, pair(k));
        sum[l] = of(
            of(of(pair(12), four, fours(8)), four, fours(4)),
            four,
            fours(0),
        );
    }
    for l in 0..N {
        all[l] = sum[l] * power[l];
    }
}

/// Natural logarithm of a positive `x`, within some 4e-16 of itself or of ln 2; of 0 and the numbers next to it, some -700.
#[inline(always)]
pub fn ln(x: f64) -> f64 {
    const ONE: u64 = 1f64.to_bits();
    /// 2^52, whose last bit is worth 1.
    const UNIT: f64 = 4_503_599_627_370_496.0;
    // From sqrt(1/2) to sqrt(2), times a power of 2.
    let bits = x.to_bits();
    let biased =
        bits.wrapping_add(ONE.wrapping_sub(std::f64::consts::FRAC_1_SQRT_2.to_bits())) >> 52;
    let power = f64::from_bits(biased | UNIT.to_bits()) - (UNIT + 1023.0);
    let m = f64::from_bits(bits.wrapping_sub(biased << 52).wrapping_add(ONE));
    // 2 artanh s.
    let s = (m - 1.0) / (m + 1.0);
    let z = s * s;
    let mut sum = 1.0 / 23.0;
    let mut k = 21;
    while k > 1 {
        sum = sum * z + 1.0 / k as f64;
        k -= 2;
    }
    (2.0 * s + 2.0 * s * (z * sum)) + (power * LN_2_LOW + power * LN_2_HIGH)
}

// Loops and no closures: those would be made without the instructions of the function around them.

/// Each its natural logarithm.
#[inline(always)]
pub fn logarithms(all: &mut [f64]) {
    for x in all {
        *x = ln(*x);
    }
}

/// Each, none of them negative, to a `power`.
#[inline(always)]
pub fn powers(all: &mut [f64], power: f64) {
    for x in all {
        *x = exp::<false>(power * ln(*x));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn they_are_those_of_the_library() {
        for i in -69_000..69_000 {
            let x = 0.01 * f64::from(i) + 0.003;
            let e = exp::<false>(x);
            for e in [e, exp::<true>(x)] {
                assert!((e / x.exp() - 1.0).abs() < 6e-16, "exp {x}");
            }
            let near = 3e-16 * x.abs().max(1.0);
            assert!((ln(e) - e.ln()).abs() <= near, "ln {e}");
        }
        for i in 1..40_000 {
            let x = 5e-5 * f64::from(i) + 1e-9;
            assert!((ln(x) - x.ln()).abs() <= 6e-16 * x.ln().abs(), "ln {x}");
        }
    }

    #[test]
    fn beyond_the_numbers_they_stand_still() {
        assert_eq!((exp::<false>(0.0), ln(1.0)), (1.0, 0.0));
        assert!(exp::<false>(f64::NEG_INFINITY) < 1e-300 && exp::<false>(f64::INFINITY) > 1e300);
        assert!(ln(0.0) < -700.0 && exp::<false>(f64::NAN).is_nan());
    }
}
