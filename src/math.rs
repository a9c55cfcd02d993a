//! Integer arithmetic that the AVR lacks, in loops of a few bytes: the general routines take ten times the flash.

/// `x / n`, rounded down; all ones for `n` = 0.
#[inline(never)]
#[must_use]
pub fn divide(mut x: u32, n: u16) -> u32 {
    let n = u32::from(n);
    let mut rest = 0u32;
    for _ in 0..32u8 {
        rest = rest << 1 | x >> 31;
        x <<= 1;
        if rest >= n {
            rest = rest.wrapping_sub(n);
            x |= 1;
        }
    }
    x
}

/// The root of `x`, rounded down.
#[inline(never)]
#[must_use]
pub fn root(x: u32) -> u16 {
    let (mut root, mut bit) = (0u16, 0x8000u16);
    while bit != 0 {
        let tried = root | bit;
        if u32::from(tried).wrapping_mul(u32::from(tried)) <= x {
            root = tried;
        }
        bit >>= 1;
    }
    root
}

/// Counts with `f` fractional bits times a Q8.24 scale: the product with `f + 8` fractional bits, rounded down in
/// magnitude. It holds up to 65535 counts and a scale below 0.5.
#[inline(never)]
#[must_use]
pub fn scaled(counts: u16, scale_q24: i32) -> i32 {
    let counts = u32::from(counts);
    let scale = scale_q24.cast_unsigned();
    let high = counts.wrapping_mul(scale >> 16);
    let low = counts.wrapping_mul(scale & 0xffff) >> 16;
    high.wrapping_add(low).cast_signed()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn division_and_root_are_those_of_the_host() {
        let mut x = 1u32;
        for step in 1..20_000u16 {
            x = x.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            assert_eq!(divide(x, step), x / u32::from(step));
            assert_eq!(u32::from(root(x)), x.isqrt());
        }
        assert_eq!((divide(u32::MAX, 1), root(u32::MAX)), (u32::MAX, 65_535));
    }

    #[test]
    fn a_product_with_a_scale_is_exact_to_its_last_bit() {
        for counts in [0, 1, 68 << 8, u16::MAX] {
            let exact = (i64::from(counts) * i64::from(crate::config::SCALE_320)) >> 16;
            assert!((i64::from(scaled(counts, crate::config::SCALE_320)) - exact).abs() <= 1);
        }
    }
}
