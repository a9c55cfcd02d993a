//! The fifth set against the library, a sum of two of its effects included.

use super::super::kept_back_fifth::{NAMES, noise};
use super::*;

/// Those whose shape is a signal that could be known.
const SIGNALS: u64 = 7;

#[test]
fn no_effect_of_the_library_nor_two_describe_a_signal_of_the_fifth_set() {
    hold_signals(NAMES, 36, SIGNALS);
}

#[test]
fn no_process_of_the_library_describes_noise_that_a_loop_holds_down() {
    let draw = &mut Draw::of(20_261_121, 37, 0);
    let name = "noise that a loop holds down";
    let stand = stand(draw, name);
    let axis = draw.of_many(3);
    for edge_hz in [0.7, 3.0] {
        let part = noise::HeldDown::new(edge_hz, stand.rate_hz);
        hold_noise(name, &stand, axis, &|w| part.density(w));
    }
}

#[test]
fn no_law_of_variance_of_the_library_describes_the_noise_of_a_supply_near_its_end() {
    let draw = &mut Draw::of(20_261_121, 38, 0);
    let name = "noise of a supply near its end";
    hold_variance(draw, name);
}

#[test]
fn no_stuck_or_missing_bit_describes_a_dead_zone() {
    for index in 0..DRAWS {
        let draw = &mut Draw::of(20_261_121, 39, index);
        let name = "dead zone of a push-pull stage";
        let mut stand = stand(draw, name);
        let f = foreign(draw, &mut stand, name, 0, 25.0);
        let Change::Edges(first, edges) = &f.change else {
            panic!("{name} has no edges")
        };
        assert!((noise::of_edges(&stand, 0, *first, edges) - f.strength).abs() < 1e-9);
        assert!((f.strength - 25.0).abs() < 0.1, "{}", f.strength);
        let refitted = noise::refitted(&stand, 0, *first, edges);
        hold_edges_about(name, &stand, *first, edges, f.strength, refitted);
    }
}

#[test]
fn the_fifth_set_is_as_strong_as_wanted_or_as_large_as_may_be() {
    are_as_strong_as_wanted(&NAMES, 40);
}

#[test]
fn each_of_the_fifth_set_acts_on_its_channel_and_leaves_the_others() {
    act_on_their_channel_alone(&NAMES, 41, 0.005);
}
