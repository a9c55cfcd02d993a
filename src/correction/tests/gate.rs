//! Edges: of the gate that the mean of a block at rest has to pass, of the temperatures that a correction is for, of rest.

use super::*;

/// Variance of a block's mean, Q18: 0.01 (deg/s)^2.
const TOLD: u16 = 2_621;

/// What a block with this mean, deg/s, does to a filter that knows so much and has trusted the block before.
fn measured(mean_dps: f64, known: u16) -> (u8, u16, f64) {
    let mut axis = Axis {
        noise: 0,
        trusted: true,
    };
    let (mut bias, mut after) = (I32::ZERO, U16::new(known));
    let mean = (mean_dps * Q20) as i32;
    let state = axis.measure(mean, TOLD, &mut bias, &mut after);
    (state, after.get(), f64::from(bias.get()) / Q20)
}

/// m^2 <= 16 R (r + 1/k): the largest mean that is taken is that of the equation, for whatever is known. The board takes an
/// odd number of 256ths as it is.
#[test]
fn a_block_is_refused_from_four_standard_deviations_on() {
    for known in [37u16, 41, 61, 101, 151, 255, 1_023, 4_095] {
        let (mut taken, mut refused) = (0.0, 4.0);
        while refused - taken > 1e-5 {
            let mean = (taken + refused) / 2.0;
            if measured(mean, known).0 & REFUSED == 0 {
                taken = mean;
            } else {
                refused = mean;
            }
        }
        // It takes a 64th less than 1/k, so that the sum has 16 bits.
        let variance = f64::from(TOLD) / 262_144.0 * (1.0 + 252.0 / f64::from(known));
        let sigmas = taken / variance.sqrt();
        // The board rounds the square's part down by 16, the expected one by 1.
        assert!((sigmas / 4.0 - 1.0).abs() < 0.005, "{known}: {sigmas}");
    }
}

/// With a fourth of the noise that was told, and a bias that is known, the gate is at 4 R: a square of 1024 in Q8 is taken, and up
/// to 1039, as its lowest four bits are left out.
#[test]
fn the_gates_own_edge_is_inside() {
    for (square, refused) in [(1_020, 0), (1_030, 0), (1_050, REFUSED)] {
        let mut axis = Axis {
            noise: NOISE_LEAST,
            trusted: true,
        };
        let mean = (f64::from(square) / 256.0 * f64::from(TOLD) / 262_144.0).sqrt();
        let state = axis.measure(
            (mean * Q20) as i32,
            TOLD,
            &mut I32::new(0),
            &mut U16::new(u16::MAX),
        );
        assert_eq!(state & REFUSED, refused, "{square}");
        assert_eq!(axis.trusted, refused == 0);
    }
}

/// The noise that a filter goes by ends at a fourth and at four times what was told, and says so there.
#[test]
fn the_noise_ends_at_a_fourth_and_at_four_times() {
    for (sigmas, variance) in [(0.0, 0.25), (3.9, 4.0)] {
        let mut axis = Axis {
            noise: 0,
            trusted: true,
        };
        let mut state = 0;
        for _ in 0..500 {
            let told = f64::from(TOLD) / 262_144.0 * (1.0 + f64::from(axis.noise) / 256.0);
            let mean = (sigmas * told.sqrt() * Q20) as i32;
            state = axis.measure(mean, TOLD, &mut I32::new(0), &mut U16::new(u16::MAX));
        }
        assert_eq!(1.0 + f64::from(axis.noise) / 256.0, variance);
        assert_eq!(state, FILTERED | NOISE_OFF);
    }
}

/// Where next to nothing is known a mean of any size is, and is taken nearly whole.
#[test]
fn a_filter_that_knows_little_takes_what_it_sees() {
    for known in 0..=21u16 {
        for mean in [-3.9, -0.5, 0.5, 3.9] {
            let (state, after, bias) = measured(mean, known);
            assert_eq!(state & (REFUSED | FILTERED), FILTERED, "{known}, {mean}");
            assert_eq!(after, known + 256, "{known}");
            // b <- b + m / (r k).
            let wanted = mean * 256.0 / f64::from(after);
            assert!((bias - wanted).abs() < 0.001, "{known}, {mean}: {bias}");
        }
    }
}

/// A board with a correction of no terms, for these temperatures, in steps of four counts.
fn of_range(lowest: i8, highest: i8) -> OnBoard {
    let mut all = [0i16; NUMBERS];
    let range = i16::from_le_bytes([lowest, highest].map(i8::cast_unsigned));
    let format = i16::from_le_bytes([FORMAT, 0]);
    all[..5].copy_from_slice(&[format, 77, 3, SENS_AVG.cast_signed(), range]);
    OnBoard::with(0, &all)
}

#[test]
fn a_temperature_is_outside_from_the_first_count_beyond_the_range_on() {
    for (lowest, highest) in [(-10, 20), (-128, 127), (5, 5), (0, 0)] {
        let mut board = of_range(lowest, highest);
        // Ten bits, as the board reads it.
        for count in -512..512i16 {
            let inside = (4 * i16::from(lowest)..4 * (i16::from(highest) + 1)).contains(&count);
            for axis in 0..3 {
                let mut temp = [4 * i16::from(lowest); 3];
                temp[axis] = count;
                let (_, frame) = board.step(&raw([0; 3], temp, 2_730, [512; 3]), 0);
                let told = frame.state & EXTRAPOLATED == 0;
                assert_eq!(told, inside, "{count} of {lowest} to {highest}");
            }
        }
    }
}

#[test]
fn rest_ends_at_four_degrees_a_second_either_way_and_with_the_motor() {
    let at_rest = |counts: i16, axis: usize, duty: i16| {
        let mut board = of_range(-128, 127);
        let mut rate = [0; 3];
        rate[axis] = counts;
        let (_, frame) = board.step(&raw(rate, [0; 3], 2_730, [512; 3]), duty);
        frame.state & AT_REST != 0
    };
    // 0.07326 deg/s a count: 54 are 3.96, 55 are 4.03.
    for axis in 0..3 {
        for (counts, rests) in [(54, true), (55, false), (-54, true), (-55, false)] {
            assert_eq!(at_rest(counts, axis, 0), rests, "{counts}");
        }
    }
    assert!(!at_rest(0, 0, 1) && !at_rest(0, 0, -1) && at_rest(0, 0, 0));
}

#[test]
fn each_row_and_the_crcs_has_its_place_in_either_copy_and_none_behind_it() {
    let mut correction = Correction::new();
    for newest in [1, 2] {
        correction.newest = newest;
        for (other, copy) in [(false, newest), (true, 3 - newest)] {
            let begin = COPIES[usize::from(copy) - 1];
            for row in 0..=ROWS as u8 {
                let place = begin + 6 * u16::from(row);
                let found = correction.place(other, row).map(core::num::NonZero::get);
                assert_eq!(found, Some(place));
            }
            assert_eq!(correction.place(other, ROWS as u8 + 1), None);
        }
    }
}
