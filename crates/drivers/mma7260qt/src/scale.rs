//! From counts to acceleration, in fixed point.

use crate::{Axis, Range, ReadCounts};

/// Zero and scale of an output, as a converter sees it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scale {
    zero_q4: i32,
    micro_g_per_count_q4: i32,
}

impl Scale {
    /// For a converter whose reference is the part's supply: independent of the supply, as zero is VDD/2 and the
    /// sensitivity is in proportion to VDD. `adc_bits` up to 16.
    #[must_use]
    pub const fn ratiometric(range: Range, adc_bits: u8) -> Self {
        let adc_bits = if adc_bits > 16 { 16 } else { adc_bits };
        // Scale, µg for each count = 3300 mV · 10^6 / (sensitivity · 2^bits). 3300 · 10^6 / sensitivity for the four
        // ranges, so that nothing is divided at run time:
        let micro_g_full_scale: u32 = match range {
            Range::G1_5 => 4_125_000,
            Range::G2 => 5_500_000,
            Range::G4 => 11_000_000,
            Range::G6 => 16_500_000,
        };
        let half: u32 = if adc_bits == 0 {
            0
        } else {
            1 << (adc_bits as u32 - 1)
        };
        Scale {
            zero_q4: (half << 4).cast_signed(),
            micro_g_per_count_q4: (((micro_g_full_scale << 4) + half) >> adc_bits).cast_signed(),
        }
    }

    /// For a converter with a reference of its own. All in mV; `None` where one of them is 0 or where full scale is
    /// beyond 26 bits.
    #[must_use]
    pub const fn with_reference(
        range: Range,
        supply_mv: u16,
        reference_mv: u16,
        adc_bits: u8,
    ) -> Option<Self> {
        if supply_mv == 0 || reference_mv == 0 || adc_bits == 0 || adc_bits > 16 {
            return None;
        }
        let (supply, reference, full) = (supply_mv as u64, reference_mv as u64, 1_u64 << adc_bits);
        let zero = (supply * full * 8 + reference / 2) / reference;
        // µg for each count = reference / 2^bits / (S33 · VDD / 3300 mV) · 10^6, and sixteen times that.
        let micro_g = 16 * reference * 3_300_000_000_u64;
        let per = full * range.millivolts_per_g() as u64 * supply;
        let scale = (micro_g + per / 2) / per;
        if zero > 0x03FF_FFFF || scale > 0x03FF_FFFF {
            None
        } else {
            Some(Scale {
                zero_q4: zero as i32,
                micro_g_per_count_q4: scale as i32,
            })
        }
    }

    /// Measured by a flip: the counts with the axis up (+1 g) and with the axis down (-1 g), each the mean of many
    /// readings in sixteenths of a count. `None` where up is not above down: then the axis, or the range inputs, are
    /// not what they are thought to be.
    #[must_use]
    pub const fn from_flip(up_q4: u32, down_q4: u32) -> Option<Self> {
        if up_q4 <= down_q4 || up_q4 > 0x00FF_FFFF {
            return None;
        }
        let span = up_q4 - down_q4;
        // 2 g over the span, in sixteenths of a µg for each count: 2 · 10^6 · 16 · 16 / span.
        let scale = (512_000_000 + span / 2) / span;
        Some(Scale {
            zero_q4: ((up_q4 + down_q4) >> 1).cast_signed(),
            micro_g_per_count_q4: scale.cast_signed(),
        })
    }

    /// Whether a measured zero and scale are within what the data sheet allows a part at this range, for a ratiometric
    /// converter of `adc_bits`: zero 10 % and sensitivity 7.5 % to either side (*unverified*). After a flip this tells a
    /// part in order from a broken one, and from one at another range.
    #[must_use]
    pub const fn is_within_limits(&self, range: Range, adc_bits: u8) -> bool {
        let typical = Scale::ratiometric(range, adc_bits);
        let off = self.zero_q4.abs_diff(typical.zero_q4);
        let (measured, nominal) = (
            self.micro_g_per_count_q4.unsigned_abs(),
            typical.micro_g_per_count_q4.unsigned_abs(),
        );
        // Sensitivity is the inverse of the scale: nominal / measured is in 0.925 ..= 1.075.
        let thousand = nominal.saturating_mul(1_000);
        off.saturating_mul(10) <= typical.zero_q4.unsigned_abs()
            && thousand >= measured.saturating_mul(925)
            && thousand <= measured.saturating_mul(1_075)
    }

    /// The range at which a measured scale is within limits: settles on hardware which g-select input is which. `None`
    /// where it fits none.
    #[must_use]
    pub const fn range(&self, adc_bits: u8) -> Option<Range> {
        let mut code = 0;
        while let Some(range) = Range::from_code(code) {
            if self.is_within_limits(range, adc_bits) {
                return Some(range);
            }
            code += 1;
        }
        None
    }

    /// The reading at 0 g, sixteenths of a count.
    #[must_use]
    pub const fn zero_q4(&self) -> i32 {
        self.zero_q4
    }

    /// Sixteenths of a µg for each count.
    #[must_use]
    pub const fn micro_g_per_count_q4(&self) -> i32 {
        self.micro_g_per_count_q4
    }

    /// Acceleration in µg, saturating at 2147 g, rounded down. No division and no 64-bit arithmetic.
    #[must_use]
    pub const fn micro_g(&self, counts: u16) -> i32 {
        let from_zero_q4 = ((counts as i32) << 4).saturating_sub(self.zero_q4);
        // Whole counts and sixteenths apart, so that 1023 counts of 16 mg stay inside 32 bits.
        let (whole, sixteenths) = (from_zero_q4 >> 4, from_zero_q4 & 0x0F);
        let part = sixteenths.saturating_mul(self.micro_g_per_count_q4) >> 4;
        (whole.saturating_mul(self.micro_g_per_count_q4)).saturating_add(part) >> 4
    }
}

/// The three accelerations in µg, all with the same scale.
///
/// # Errors
/// Those of the converter.
pub fn acceleration<C: ReadCounts>(converter: &mut C, scale: &Scale) -> Result<[i32; 3], C::Error> {
    let mut one = |axis| Ok(scale.micro_g(converter.read_counts(axis)?));
    Ok([one(Axis::X)?, one(Axis::Y)?, one(Axis::Z)?])
}

/// The three accelerations in µg, each axis with a scale of its own, as flips find them.
///
/// # Errors
/// Those of the converter.
pub fn acceleration_each<C: ReadCounts>(
    converter: &mut C,
    scales: &[Scale; 3],
) -> Result<[i32; 3], C::Error> {
    let mut one = |axis, scale: &Scale| Ok(scale.micro_g(converter.read_counts(axis)?));
    let [x, y, z] = scales;
    Ok([one(Axis::X, x)?, one(Axis::Y, y)?, one(Axis::Z, z)?])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The part as its formula has it: V = VDD/2 + S · VDD/3.3 V · a, converted without rounding.
    fn counts(range: Range, supply_v: f64, reference_v: f64, bits: u8, acceleration_g: f64) -> f64 {
        let sensitivity = f64::from(range.millivolts_per_g()) / 1000.0 * supply_v / 3.3;
        (supply_v / 2.0 + sensitivity * acceleration_g) / reference_v * f64::from(1_u32 << bits)
    }

    const RANGES: [(Range, f64); 4] = [
        (Range::G1_5, 1.5),
        (Range::G2, 2.0),
        (Range::G4, 4.0),
        (Range::G6, 6.0),
    ];

    #[test]
    fn a_ratiometric_reading_does_not_depend_on_the_supply() {
        for (range, full_g) in RANGES {
            for bits in [8, 10, 12, 16] {
                let scale = Scale::ratiometric(range, bits);
                for supply_v in [2.2, 3.3, 3.6] {
                    for step in -8_i32..=8 {
                        let g = full_g * f64::from(step) / 8.0;
                        let reading = counts(range, supply_v, supply_v, bits, g).round();
                        let lsb_g = 1.0
                            / (counts(range, 3.3, 3.3, bits, 1.0)
                                - counts(range, 3.3, 3.3, bits, 0.0));
                        let found = f64::from(scale.micro_g(reading as u16)) * 1e-6;
                        let scale_step = full_g / lsb_g / 16.0 * 1e-6; // the scale's own rounding, at full range
                        assert!(
                            (found - g).abs() <= 0.51 * lsb_g + scale_step + 2e-6,
                            "{range:?} {bits} bits: {found} for {g}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn another_reference_is_accounted_for() {
        let scale = Scale::with_reference(Range::G2, 3300, 5000, 10).unwrap();
        for step in -8_i32..=8 {
            let g = f64::from(step) / 4.0;
            let reading = counts(Range::G2, 3.3, 5.0, 10, g).round();
            assert!(
                (f64::from(scale.micro_g(reading as u16)) * 1e-6 - g).abs() < 0.51 / 122.88,
                "{g} g"
            );
        }
        assert_eq!(Scale::with_reference(Range::G2, 3300, 0, 10), None);
        assert_eq!(Scale::with_reference(Range::G2, 0, 5000, 10), None);
    }

    #[test]
    fn a_flip_finds_zero_and_scale() {
        // 20 counts beside the middle, 3 % less sensitive than typical.
        let (zero, per_g) = (532.0_f64, 248.2 * 0.97);
        let scale = Scale::from_flip(
            ((zero + per_g) * 16.0) as u32,
            ((zero - per_g) * 16.0) as u32,
        )
        .unwrap();
        assert!((f64::from(scale.micro_g(532)) * 1e-6).abs() < 0.001);
        assert!(
            (f64::from(scale.micro_g((zero + per_g).round() as u16)) * 1e-6 - 1.0).abs() < 0.003
        );
        assert_eq!(
            Scale::from_flip(500 * 16, 532 * 16),
            None,
            "an axis that reads less when it points up"
        );
    }

    #[test]
    fn what_a_flip_says_is_rounded_to_the_nearest() {
        // 2 g over the difference of both, both in sixteenths: 2 * 10^6 * 16 * 16 / span.
        for span in 1_000..6_000 {
            let scale = Scale::from_flip(8_000 + span, 8_000).unwrap();
            let exact = 512e6 / f64::from(span);
            let off = f64::from(scale.micro_g_per_count_q4()) - exact;
            assert!(off.abs() <= 0.5, "{span}: {off}");
        }
    }

    #[test]
    fn a_flip_tells_the_range_and_a_part_that_is_out_of_limits() {
        for (range, _) in RANGES {
            let flip = |zero_error: f64, sensitivity_error: f64| {
                let half = counts(range, 3.3, 3.3, 10, 0.0);
                let per_g = counts(range, 3.3, 3.3, 10, 1.0) - half;
                let (zero, per_g) = (half * (1.0 + zero_error), per_g * (1.0 + sensitivity_error));
                Scale::from_flip(
                    ((zero + per_g) * 16.0) as u32,
                    ((zero - per_g) * 16.0) as u32,
                )
                .unwrap()
            };
            for (zero, sensitivity) in [(0.0, 0.0), (0.095, 0.07), (-0.095, -0.07)] {
                let scale = flip(zero, sensitivity);
                assert!(
                    scale.is_within_limits(range, 10),
                    "{range:?} {zero} {sensitivity}"
                );
                assert_eq!(scale.range(10), Some(range));
            }
            for (zero, sensitivity) in [(0.105, 0.0), (-0.105, 0.0), (0.0, 0.08), (0.0, -0.08)] {
                let scale = flip(zero, sensitivity);
                assert!(
                    !scale.is_within_limits(range, 10),
                    "{range:?} {zero} {sensitivity}"
                );
                assert_eq!(scale.range(10), None);
            }
        }
    }

    #[test]
    fn each_axis_has_its_own_scale() {
        let scales = [Range::G1_5, Range::G2, Range::G6].map(|range| Scale::ratiometric(range, 10));
        let mut adc = |axis| Ok::<u16, ()>(if axis == Axis::Y { 512 - 62 } else { 512 + 62 });
        let [x, y, z] = acceleration_each(&mut adc, &scales).unwrap();
        assert!((x - 249_756).abs() < 10 && (y + 333_008).abs() < 10 && (z - 999_023).abs() < 10);
        let mut broken = |axis| {
            if axis == Axis::Z {
                Err("no conversion")
            } else {
                Ok(512)
            }
        };
        assert_eq!(
            acceleration_each(&mut broken, &scales),
            Err("no conversion")
        );
    }

    #[test]
    fn nothing_overflows_at_the_ends() {
        let steepest = Scale::from_flip(17, 16).unwrap();
        assert_eq!(steepest.micro_g(0xFFFF), i32::MAX >> 4);
        assert_eq!(
            Scale::ratiometric(Range::G6, 200),
            Scale::ratiometric(Range::G6, 16)
        );
        let _ = Scale::ratiometric(Range::G6, 0).micro_g(0xFFFF);
    }

    #[test]
    fn scales_are_those_of_the_data_sheets_sensitivities() {
        for (range, full) in [
            (Range::G1_5, 4_125_000.0),
            (Range::G2, 5_500_000.0),
            (Range::G4, 11_000_000.0),
            (Range::G6, 16_500_000.0),
        ] {
            for bits in [1u8, 8, 10, 12, 16, 20] {
                let scale = Scale::ratiometric(range, bits);
                let counts = f64::from(1u32 << bits.min(16));
                assert_eq!(f64::from(scale.zero_q4()), counts / 2.0 * 16.0, "{bits}");
                let exact = full / counts * 16.0;
                let off = f64::from(scale.micro_g_per_count_q4()) - exact;
                assert!(off.abs() <= 0.5, "{range:?} {bits}: {off}");
            }
        }
        assert_eq!(Scale::ratiometric(Range::G2, 0).zero_q4(), 0);
    }

    #[test]
    fn another_reference_is_to_the_nearest_and_what_is_none_is_refused() {
        for (supply, reference, bits) in
            [(3_300, 2_560, 10), (3_000, 5_000, 12), (3_600, 3_300, 16)]
        {
            let scale = Scale::with_reference(Range::G4, supply, reference, bits).expect("a scale");
            let (s, r, full) = (
                f64::from(supply),
                f64::from(reference),
                f64::from(1u32 << bits),
            );
            let zero = s / 2.0 / r * full * 16.0;
            let micro = r / full / (300.0 * s / 3_300.0) * 1e6 * 16.0;
            assert!((f64::from(scale.zero_q4()) - zero).abs() <= 0.5, "{zero}");
            assert!(
                (f64::from(scale.micro_g_per_count_q4()) - micro).abs() <= 0.5,
                "{micro}"
            );
        }
        for (supply, reference, bits) in [
            (0, 1, 10),
            (1, 0, 10),
            (1, 1, 0),
            (1, 1, 17),
            (65_535, 1, 16),
            (1, 65_535, 1),
        ] {
            let scale = Scale::with_reference(Range::G4, supply, reference, bits);
            assert_eq!(scale, None, "{supply} {reference} {bits}");
        }
        assert!(Scale::with_reference(Range::G4, 1, 1, 16).is_some());
    }

    #[test]
    fn a_flip_has_its_bounds_and_limits_are_met_to_the_count() {
        assert_eq!(Scale::from_flip(100, 100), None);
        assert_eq!(Scale::from_flip(0x0100_0000, 1), None);
        assert!(Scale::from_flip(0x00ff_ffff, 1).is_some());
        let flip = Scale::from_flip(760 * 16, 264 * 16).expect("a flip");
        assert_eq!(flip.zero_q4(), 512 * 16);
        // 2 g over 496 counts.
        assert!((f64::from(flip.micro_g_per_count_q4()) - 2e6 / 496.0 * 16.0).abs() <= 0.5);
        let typical = Scale::ratiometric(Range::G1_5, 10);
        let with = |zero_q4: i32, scale: f64| Scale {
            zero_q4: typical.zero_q4 + zero_q4,
            micro_g_per_count_q4: (f64::from(typical.micro_g_per_count_q4) * scale).round() as i32,
        };
        // A tenth of 512 counts; a sensitivity within 7.5 %.
        for (zero, scale, within) in [
            (819, 1.0, true),
            (-819, 1.0, true),
            (820, 1.0, false),
            (-820, 1.0, false),
            (0, 1.0 / 0.926, true),
            (0, 1.0 / 0.924, false),
            (0, 1.0 / 1.074, true),
            (0, 1.0 / 1.076, false),
        ] {
            let part = with(zero, scale);
            assert_eq!(
                part.is_within_limits(Range::G1_5, 10),
                within,
                "{zero} {scale}"
            );
            assert_eq!(part.range(10), within.then_some(Range::G1_5));
        }
        // In sixteenths of a count.
        let off = with(8, 1.0);
        let exact = (600.0 - 512.5) * f64::from(off.micro_g_per_count_q4) / 16.0;
        assert!((f64::from(off.micro_g(600)) - exact).abs() <= 1.0);
        let exact = (400.0 - 512.5) * f64::from(off.micro_g_per_count_q4) / 16.0;
        assert!((f64::from(off.micro_g(400)) - exact).abs() <= 1.0);
    }
}
