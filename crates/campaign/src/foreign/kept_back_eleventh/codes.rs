//! The eleventh set's laws that act on what is read.

use super::super::Foreign;
use super::super::kept_back_ninth::codes::{by_chance, latched};
use super::super::kept_back_tenth::codes::{Stage, by_stage, zero_of};
use crate::random::Draw;
use crate::stand::Stand;

/// One of them; `None` for another name.
pub(super) fn one(
    draw: &mut Draw,
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Option<Foreign> {
    Some(match name {
        "code step at mid-scale" => {
            let stage = mid_scale(draw, stand, axis);
            by_stage(stand, name, axis, wanted, &stage)
        }
        "high byte of the reading before" => {
            let bits = LOW_BITS.0 + draw.of_many(LOW_BITS.1 + 1 - LOW_BITS.0);
            by_chance(stand, name, axis, wanted, torn(bits))
        }
        _ => return None,
    })
}

/// The major carry: at mid-scale, which lies near the rate at rest, all bits of the converter turn over, and the largest
/// weighs more than all others together by so many counts, or less: readings on one side are off from those on the other,
/// with codes between that never come, or that come from both sides.
pub(in super::super) fn mid_scale(
    draw: &mut Draw,
    stand: &Stand,
    axis: usize,
) -> impl Fn(f64) -> Stage + use<> {
    let (zero, sign) = (zero_of(draw, stand, axis), draw.sign());
    move |size| Stage {
        zero,
        threshold: 0.0,
        inside: 1.0,
        beyond: 1.0,
        from: 0.5 * sign * size,
    }
}

/// Bits of the word that its low byte holds: words of 12 or 11 bits that begin with the high byte.
pub(in super::super) const LOW_BITS: (usize, usize) = (3, 4);

/// A word that is read in two bytes, of which the low one is new and the high one still that of the reading before.
pub(in super::super) fn torn(low_bits: usize) -> impl Fn(i32, i32) -> i32 {
    let mixed = latched(low_bits);
    move |before, code| mixed(code, before)
}

#[cfg(test)]
mod tests {
    use super::super::tests::stand;
    use super::*;

    #[test]
    fn a_torn_word_is_right_where_its_high_byte_has_not_changed() {
        let read = torn(3);
        assert_eq!([read(8, 15), read(7, 8), read(8, 7)], [15, 0, 15]);
        // Two's complement: below zero the high byte is that of -8.
        assert_eq!([read(-1, 0), read(0, -1)], [-8, 7]);
    }

    #[test]
    fn no_step_at_mid_scale_is_no_effect() {
        let (mut draw, stand) = stand(30);
        let stage = mid_scale(&mut draw, &stand, 0);
        assert!(stage(0.0).strength(&stand, 0) < 1.0);
        assert!(stage(3.0).strength(&stand, 0) > 5.0);
    }
}
