//! The fourteenth set against the library, a sum of two of its effects included.

use super::super::kept_back_fourteenth::{NAMES, codes, noise};
use super::super::kept_back_ninth::codes::Next;
use super::codes::{hold_codes, hold_next, hold_outliers};
use super::*;

/// Those whose shape is a signal that could be known.
const SIGNALS: u64 = 17;

#[test]
fn no_effect_of_the_library_nor_two_describe_a_signal_of_the_fourteenth_set() {
    hold_signals(NAMES, 151, SIGNALS);
}

#[test]
fn no_law_of_variance_of_the_library_describes_that_of_the_fourteenth_set() {
    let name = "edge that whistles at some speeds";
    for index in 0..DRAWS {
        let draw = &mut Draw::of(20_261_122, 152, index);
        let mut stand = stand(draw, name);
        let shape = noise::whistle(draw, &mut stand);
        let of = |size: f64| -> Vec<f64> { shape.iter().map(|s| 1.0 + size * s).collect() };
        let size = crate::strength::size_for(25.0, &|s| of_variance(&of(s)));
        hold_law(name, &stand, &of(size));
    }
}

#[test]
fn no_filter_stale_sample_bit_or_outlier_describes_the_steps_of_the_fourteenth_set() {
    for index in 0..DRAWS {
        let draw = &mut Draw::of(20_261_122, 153, index);
        let stand = stand(draw, NAMES[0]);
        let all: [(&str, Box<Next>); 2] = [
            (
                "output stage that slews softly",
                Box::new(codes::slewing(draw, &stand, 0)),
            ),
            (
                "filter that smooths small changes",
                Box::new(codes::smoothing(draw, &stand, 0)),
            ),
        ];
        for (name, next) in all {
            let (first, steps, shares) = hold_next(name, &stand, &*next);
            hold_codes(name, &stand, first, &shares);
            hold_outliers(name, &stand, first, &steps, &shares);
        }
    }
}

#[test]
fn the_fourteenth_set_is_as_strong_as_wanted_or_as_large_as_may_be() {
    are_as_strong_as_wanted(&NAMES, 154);
}

#[test]
fn each_of_the_fourteenth_set_acts_on_its_channel_and_leaves_the_others() {
    act_on_their_channel_alone(&NAMES, 155, 0.005);
}
