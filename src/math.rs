//! Integer arithmetic that the AVR lacks, in loops of a few bytes: the general routines take ten times the flash.

/// `x / n`, rounded down; all ones for `n` = 0.
#[cfg(not(target_arch = "avr"))]
#[must_use]
pub fn divide(x: u32, n: u16) -> u32 {
    x.checked_div(n.into()).unwrap_or(u32::MAX)
}

/// `x / n`, rounded down; all ones for `n` = 0. Bit by bit, with the carry that the language does not have: a third of the
/// flash.
#[cfg(target_arch = "avr")]
#[inline(never)]
#[allow(unsafe_code)]
#[must_use]
pub fn divide(x: u32, n: u16) -> u32 {
    let (mut low, mut high) = (x as u16, (x >> 16) as u16);
    // SAFETY: registers and flags alone.
    unsafe {
        core::arch::asm!(
            "2:",
            "lsl {low:l}",
            "rol {low:h}",
            "rol {high:l}",
            "rol {high:h}",
            "rol {rest:l}",
            "rol {rest:h}",
            // The rest has 17 bits; with the highest set it is above any n.
            "brcs 3f",
            "cp {rest:l}, {n:l}",
            "cpc {rest:h}, {n:h}",
            "brcs 4f",
            "3:",
            "sub {rest:l}, {n:l}",
            "sbc {rest:h}, {n:h}",
            "inc {low:l}",
            "4:",
            "dec {left}",
            "brne 2b",
            left = inout(reg) 32_u8 => _,
            rest = inout(reg_pair) 0_u16 => _,
            low = inout(reg_pair) low,
            high = inout(reg_pair) high,
            n = in(reg_pair) n,
            options(pure, nomem, nostack),
        );
    }
    u32::from(high) << 16 | u32::from(low)
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
        let scale = adis16250::Range::Dps320.scale_q24();
        for counts in [0, 1, 68 << 8, u16::MAX] {
            let exact = (i64::from(counts) * i64::from(scale)) >> 16;
            assert!((i64::from(scaled(counts, scale)) - exact).abs() <= 1);
        }
    }
}
