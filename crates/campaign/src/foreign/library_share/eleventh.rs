//! The eleventh set against the library, a sum of two of its effects included.

use super::super::kept_back_eleventh::{NAMES, codes, noise};
use super::super::kept_back_ninth::codes::Next;
use super::codes::{hold_codes, hold_next, hold_outliers, hold_stage};
use super::tenth::hold_beside;
use super::*;

/// Those whose shape is a signal that could be known, the ramp's as it came out included.
const SIGNALS: u64 = 15;

#[test]
fn no_effect_of_the_library_nor_two_describe_a_signal_of_the_eleventh_set() {
    hold_signals(NAMES, 113, SIGNALS);
}

#[test]
fn no_law_of_variance_of_the_library_describes_those_of_the_eleventh_set() {
    type Shape = fn(&mut Draw, &mut Stand) -> Vec<f64>;
    type Law = fn(&[f64], f64) -> Vec<f64>;
    let more: Law = |shape, size| shape.iter().map(|s| 1.0 + size * s).collect();
    let all: [(&str, Shape, Law); 3] = [
        (
            "noise that ramps through the record",
            |draw, stand| noise::ramp(draw, stand),
            noise::by_exponential,
        ),
        ("slip ring that is worn at some angles", noise::worn, more),
        (
            "noise that grows with the warmth",
            |_, stand| noise::warmth(stand, 0),
            noise::by_exponential,
        ),
    ];
    for (name, shape, law) in all {
        for index in 0..DRAWS {
            let draw = &mut Draw::of(20_261_122, 114, index);
            let mut stand = stand(draw, name);
            let shape = shape(draw, &mut stand);
            let of = |size: f64| law(&shape, size);
            let size = crate::strength::size_for(25.0, &|s| of_variance(&of(s)));
            hold_law(name, &stand, &of(size));
        }
    }
}

#[test]
fn no_process_of_the_library_describes_a_ramp_that_wanders() {
    for index in 0..DRAWS {
        let draw = &mut Draw::of(20_261_122, 115, index);
        let name = "ramp of the rate that wanders";
        let stand = stand(draw, name);
        let ramp = noise::Ramp::new(draw, stand.rate_hz);
        hold_beside(name, &stand, &|w| ramp.density(w));
    }
}

#[test]
fn no_bit_rail_filter_stale_sample_or_outlier_describes_the_readings_of_the_eleventh_set() {
    for index in 0..DRAWS {
        let draw = &mut Draw::of(20_261_122, 116, index);
        let stand = stand(draw, NAMES[0]);
        let stage = codes::mid_scale(draw, &stand, 0);
        hold_stage("code step at mid-scale", &stand, &stage);
        for bits in codes::LOW_BITS.0..=codes::LOW_BITS.1 {
            let name = "high byte of the reading before";
            let next: &Next = &codes::torn(bits);
            let (first, steps, shares) = hold_next(name, &stand, next);
            hold_codes(name, &stand, first, &shares);
            hold_outliers(name, &stand, first, &steps, &shares);
        }
    }
}

/// In the readings: a misalignment that is the same at every temperature.
#[test]
fn no_cross_axis_describes_a_misalignment_that_grows_with_temperature() {
    for index in 0..DRAWS {
        let draw = &mut Draw::of(20_261_122, 117, index);
        hold_coupling(draw, "misalignment that grows with temperature");
    }
}

#[test]
fn the_eleventh_set_is_as_strong_as_wanted_or_as_large_as_may_be() {
    are_as_strong_as_wanted(&NAMES, 118);
}

#[test]
fn each_of_the_eleventh_set_acts_on_its_channel_and_leaves_the_others() {
    act_on_their_channel_alone(&NAMES, 119, 0.005);
}
