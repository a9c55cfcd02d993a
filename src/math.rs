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

/// `x / 2^n`, rounded down; `n` below 32.
#[cfg(not(target_arch = "avr"))]
#[must_use]
pub fn shifted(x: i32, n: u8) -> i32 {
    x >> n
}

/// `x / 2^n`, rounded down; `n` below 32. Bit by bit, as the AVR has it: the compiler unrolls the loop.
#[cfg(target_arch = "avr")]
#[inline(never)]
#[allow(unsafe_code)]
#[must_use]
pub fn shifted(x: i32, n: u8) -> i32 {
    let (mut low, mut high) = (x as u16, (x >> 16) as u16);
    // SAFETY: registers and flags alone.
    unsafe {
        core::arch::asm!(
            "rjmp 3f",
            "2:",
            "asr {high:h}",
            "ror {high:l}",
            "ror {low:h}",
            "ror {low:l}",
            "3:",
            "subi {n}, 1",
            "brcc 2b",
            n = inout(reg_upper) n => _,
            low = inout(reg_pair) low,
            high = inout(reg_pair) high,
            options(pure, nomem, nostack),
        );
    }
    (u32::from(high) << 16 | u32::from(low)).cast_signed()
}

/// `x y` of what has no sign.
#[cfg(not(target_arch = "avr"))]
#[must_use]
pub fn area(x: u16, y: u16) -> u32 {
    u32::from(x).wrapping_mul(y.into())
}

/// `x y` of what has no sign. The compiler has none but that of 32 bits with 32.
#[cfg(target_arch = "avr")]
#[inline(never)]
#[allow(unsafe_code)]
#[must_use]
pub fn area(x: u16, y: u16) -> u32 {
    let (low, high): (u16, u16);
    // SAFETY: registers and flags alone; r1 is zero again at the end.
    unsafe {
        core::arch::asm!(
            "mul {x:l}, {y:l}",
            "movw {low}, r0",
            "mul {x:h}, {y:h}",
            "movw {high}, r0",
            "clr {zero}",
            "mul {x:l}, {y:h}", "add {low:h}, r0", "adc {high:l}, r1", "adc {high:h}, {zero}",
            "mul {x:h}, {y:l}", "add {low:h}, r0", "adc {high:l}, r1", "adc {high:h}, {zero}",
            "clr r1",
            x = in(reg_pair) x,
            y = in(reg_pair) y,
            low = out(reg_pair) low,
            high = out(reg_pair) high,
            zero = out(reg) _,
            options(pure, nomem, nostack),
        );
    }
    u32::from(high) << 16 | u32::from(low)
}

/// `x y`, of which one has a sign.
#[inline(never)]
#[must_use]
pub fn scaled(x: i16, y: u16) -> i32 {
    let exact = area(x.cast_unsigned(), y).cast_signed();
    // Without its sign x was 2^16 more.
    if x < 0 {
        exact.wrapping_sub(i32::from(y.cast_signed()) << 16)
    } else {
        exact
    }
}

/// `x y`.
#[inline(never)]
#[must_use]
pub fn product(x: i16, y: i16) -> i32 {
    let exact = scaled(x, y.cast_unsigned());
    if y < 0 {
        exact.wrapping_sub(i32::from(x) << 16)
    } else {
        exact
    }
}

/// `x y / 2^16` of what has no sign, rounded down.
#[must_use]
pub fn upper(x: u16, y: u16) -> u16 {
    (area(x, y) >> 16) as u16
}

/// `x y / 2^16`, to the nearest.
#[cfg(not(target_arch = "avr"))]
#[must_use]
pub fn times(x: i32, y: i16) -> i32 {
    let low = i32::from(x as u16).wrapping_mul(y.into());
    product((x >> 16) as i16, y).wrapping_add(low.wrapping_add(1 << 15) >> 16)
}

/// `x y / 2^16`, to the nearest. Byte by byte: the compiler's 32-bit products take three times as long.
#[cfg(target_arch = "avr")]
#[inline(never)]
#[allow(unsafe_code)]
#[must_use]
pub fn times(x: i32, y: i16) -> i32 {
    let (mut low, mut high) = (x as u16, (x >> 16) as u16);
    // SAFETY: registers and flags alone; r1 is zero again at the end.
    unsafe {
        core::arch::asm!(
            // x is r25 .. r22, y is r21, r20; as in `mul`.
            "clr r31",
            "mul r22, r20",
            "mov r30, r1",
            "clr r26",
            "clr r27",
            "mul r22, r21", "add r30, r0", "adc r26, r1", "adc r27, r31",
            "mul r23, r20", "add r30, r0", "adc r26, r1", "adc r27, r31",
            "clr r18",
            "mul r23, r21", "add r26, r0", "adc r27, r1", "adc r18, r31",
            "mul r24, r20", "add r26, r0", "adc r27, r1", "adc r18, r31",
            "clr r19",
            "mul r24, r21", "add r27, r0", "adc r18, r1", "adc r19, r31",
            "mul r25, r20", "add r27, r0", "adc r18, r1", "adc r19, r31",
            "mul r25, r21", "add r18, r0", "adc r19, r1",
            "sbrs r25, 7",
            "rjmp 2f",
            "sub r18, r20", "sbc r19, r21",
            "2:",
            "sbrs r21, 7",
            "rjmp 3f",
            "sub r26, r22", "sbc r27, r23", "sbc r18, r24", "sbc r19, r25",
            "3:",
            "lsl r30",
            "adc r26, r31", "adc r27, r31", "adc r18, r31", "adc r19, r31",
            "movw r22, r26",
            "movw r24, r18",
            "clr r1",
            in("r21r20") y,
            inout("r23r22") low,
            inout("r25r24") high,
            out("r19r18") _,
            out("X") _,
            out("Z") _,
            options(pure, nomem, nostack),
        );
    }
    (u32::from(high) << 16 | u32::from(low)).cast_signed()
}

/// `x y / 2^32`, to the nearest.
#[cfg(not(target_arch = "avr"))]
#[must_use]
pub fn mul(x: i32, y: i32) -> i32 {
    let exact = i64::from(x).wrapping_mul(y.into());
    (exact.wrapping_add(1 << 31) >> 32) as i32
}

/// `x y / 2^32`, to the nearest. Column by column of their bytes, without signs; then each factor is taken off that the sign of the
/// other one stands for. The compiler's 64-bit product takes ten times as long.
#[cfg(target_arch = "avr")]
#[inline(never)]
#[allow(unsafe_code)]
#[must_use]
pub fn mul(x: i32, y: i32) -> i32 {
    let (mut low, mut high) = (x as u16, (x >> 16) as u16);
    // SAFETY: registers and flags alone; r1 is zero again at the end.
    unsafe {
        core::arch::asm!(
            // x is r25 .. r22, y is r21 .. r18. Of each column a byte stays, and two go on to the next.
            "clr r31",
            "mul r22, r18",
            "mov r27, r1",
            "clr r26",
            "clr r30",
            "mul r22, r19", "add r27, r0", "adc r26, r1", "adc r30, r31",
            "mul r23, r18", "add r27, r0", "adc r26, r1", "adc r30, r31",
            "clr r27",
            "mul r22, r20", "add r26, r0", "adc r30, r1", "adc r27, r31",
            "mul r23, r19", "add r26, r0", "adc r30, r1", "adc r27, r31",
            "mul r24, r18", "add r26, r0", "adc r30, r1", "adc r27, r31",
            "clr r26",
            "mul r22, r21", "add r30, r0", "adc r27, r1", "adc r26, r31",
            "mul r23, r20", "add r30, r0", "adc r27, r1", "adc r26, r31",
            "mul r24, r19", "add r30, r0", "adc r27, r1", "adc r26, r31",
            "mul r25, r18", "add r30, r0", "adc r27, r1", "adc r26, r31",
            "clr r14",
            "mul r23, r21", "add r27, r0", "adc r26, r1", "adc r14, r31",
            "mul r24, r20", "add r27, r0", "adc r26, r1", "adc r14, r31",
            "mul r25, r19", "add r27, r0", "adc r26, r1", "adc r14, r31",
            "clr r15",
            "mul r24, r21", "add r26, r0", "adc r14, r1", "adc r15, r31",
            "mul r25, r20", "add r26, r0", "adc r14, r1", "adc r15, r31",
            "mul r25, r21", "add r14, r0", "adc r15, r1",
            // r15, r14, r26, r27 from the top.
            "sbrs r25, 7",
            "rjmp 2f",
            "sub r27, r18", "sbc r26, r19", "sbc r14, r20", "sbc r15, r21",
            "2:",
            "sbrs r21, 7",
            "rjmp 3f",
            "sub r27, r22", "sbc r26, r23", "sbc r14, r24", "sbc r15, r25",
            "3:",
            // The highest bit of what is below rounds.
            "lsl r30",
            "adc r27, r31", "adc r26, r31", "adc r14, r31", "adc r15, r31",
            "mov r22, r27",
            "mov r23, r26",
            "movw r24, r14",
            "clr r1",
            in("r19r18") y as u16,
            in("r21r20") (y >> 16) as u16,
            inout("r23r22") low,
            inout("r25r24") high,
            out("r15r14") _,
            out("X") _,
            out("Z") _,
            options(pure, nomem, nostack),
        );
    }
    (u32::from(high) << 16 | u32::from(low)).cast_signed()
}

/// The root of `x`, rounded down.
#[inline(never)]
#[must_use]
pub fn root(x: u32) -> u16 {
    let (mut root, mut bit) = (0u16, 0x8000u16);
    while bit != 0 {
        let tried = root | bit;
        if area(tried, tried) <= x {
            root = tried;
        }
        bit >>= 1;
    }
    root
}

/// `x + y`, up to 65 535. In line the compiler makes a bit of the carry, and asks it again.
#[inline(never)]
#[must_use]
pub fn sum(x: u16, y: u16) -> u16 {
    x.saturating_add(y)
}

/// One more, up to 255.
#[inline(never)]
pub fn count_up(count: &mut u8) {
    if *count < u8::MAX {
        *count = count.wrapping_add(1);
    }
}

/// The same place, without the compiler knowing that it is a static's: what lies there then takes two bytes of flash to reach, and
/// not four. It pays where little else needs the pointer's registers.
#[cfg(target_arch = "avr")]
#[inline(always)]
#[allow(unsafe_code)]
#[must_use]
pub fn somewhere<T>(place: &mut T) -> &mut T {
    let mut at: *mut T = place;
    // SAFETY: the pointer stays what it is.
    unsafe {
        core::arch::asm!("/* {at} */", at = inout(reg_ptr) at, options(pure, nomem, nostack, preserves_flags));
        &mut *at
    }
}

/// The same place.
#[cfg(not(target_arch = "avr"))]
#[inline(always)]
#[must_use]
pub fn somewhere<T>(place: &mut T) -> &mut T {
    place
}

/// The same value, known here and at no later place. (`black_box` takes it by the stack.)
#[cfg(target_arch = "avr")]
#[inline(always)]
#[allow(unsafe_code)]
#[must_use]
pub fn known<T>(mut place: *mut T) -> *mut T {
    // SAFETY: it stays what it is; without `pure` it is neither left out nor moved beyond a sleep.
    unsafe { core::arch::asm!("/* {} */", inout(reg_ptr) place, options(nostack)) };
    place
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
    fn products_are_to_the_nearest() {
        let mut x = 1u32;
        let mut next = || {
            x = x.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            x.cast_signed()
        };
        for _ in 0..200_000 {
            let (a, b) = (next(), next());
            let y = (b >> 16) as i16;
            let exact = i64::from(a) * i64::from(y);
            assert_eq!(i64::from(times(a, y)), (exact + (1 << 15)) >> 16, "{a} {y}");
            let exact = i64::from(a) * i64::from(b);
            assert_eq!(i64::from(mul(a, b)), (exact + (1 << 31)) >> 32, "{a} {b}");
        }
    }

    #[test]
    fn products_of_sixteen_bits_are_exact_with_and_without_signs() {
        let words = [
            0,
            1,
            60,
            907,
            0x7fff,
            0x8000,
            0x8001,
            0xfffe,
            u16::MAX,
            0x1234,
            0xa5c3,
        ];
        for x in words {
            for y in words {
                let (signed_x, signed_y) = (x.cast_signed(), y.cast_signed());
                assert_eq!(area(x, y), u32::from(x) * u32::from(y), "{x} {y}");
                let half = i64::from(signed_x) * i64::from(y);
                assert_eq!(i64::from(scaled(signed_x, y)), half, "{x} {y}");
                let exact = i32::from(signed_x) * i32::from(signed_y);
                assert_eq!(product(signed_x, signed_y), exact, "{x} {y}");
                assert_eq!(u32::from(upper(x, y)), (u32::from(x) * u32::from(y)) >> 16);
                assert_eq!(
                    u32::from(sum(x, y)),
                    (u32::from(x) + u32::from(y)).min(65_535)
                );
            }
        }
    }

    #[test]
    fn a_count_stops_at_255() {
        for (before, after) in [(0, 1), (254, 255), (255, 255)] {
            let mut count = before;
            count_up(&mut count);
            assert_eq!(count, after);
        }
    }
}
