//! The thirteenth set against the library, a sum of two of its effects included.

use super::super::kept_back_ninth::codes::Next;
use super::super::kept_back_sixth::codes::{law_of_map, of_map};
use super::super::kept_back_thirteenth::{NAMES, codes, noise};
use super::codes::{hold_codes, hold_next, hold_outliers, hold_steps};
use super::*;

/// Those whose shape is a signal that could be known.
const SIGNALS: u64 = 12;

#[test]
fn no_effect_of_the_library_nor_two_describe_a_signal_of_the_thirteenth_set() {
    hold_signals(NAMES, 141, SIGNALS);
}

#[test]
fn no_law_of_variance_of_the_library_describes_those_of_the_thirteenth_set() {
    type Shape = fn(&mut Draw, &Stand) -> Vec<f64>;
    let all: [(&str, Shape); 2] = [
        ("fan coil that a thermostat switches", noise::fan),
        ("gas that leaks into the cavity", noise::gas),
    ];
    for (name, shape) in all {
        for index in 0..DRAWS {
            let draw = &mut Draw::of(20_261_122, 142, index);
            let stand = stand(draw, name);
            let shape = shape(draw, &stand);
            let of = |size: f64| -> Vec<f64> { shape.iter().map(|s| 1.0 + size * s).collect() };
            let size = crate::strength::size_for(25.0, &|s| of_variance(&of(s)));
            hold_law(name, &stand, &of(size));
        }
    }
}

#[test]
fn no_bit_rail_or_outlier_describes_the_maps_of_the_thirteenth_set() {
    for index in 0..DRAWS {
        let draw = &mut Draw::of(20_261_122, 143, index);
        let stand = stand(draw, NAMES[0]);
        let form = codes::form_of(draw, &stand, 0, 25.0);
        println!("{form:?}");
        type Map = dyn Fn(i32) -> i32;
        let maps: [(&str, Box<Map>); 3] = [
            (
                "lines printed with few digits",
                Box::new(move |code| form.read(code)),
            ),
            (
                "filter whose register wraps round",
                Box::new(codes::wrapped(draw, &stand, 0)),
            ),
            (
                "half-precision number about a power of two",
                Box::new(codes::halved(draw, &stand, 0)),
            ),
        ];
        for (name, map) in maps {
            let of = |chance: f64| of_map(&stand, 0, chance.min(1.0), &map);
            let chance = crate::strength::size_for(25.0, &of);
            println!("{name}: chance {chance:.2}");
            let (first, read) = law_of_map(&stand, 0, chance, &map);
            hold_codes(name, &stand, first, &read);
            // Each on its own, whatever the one before.
            let steps = vec![read.clone(); read.len()];
            hold_outliers(name, &stand, first, &steps, &read);
        }
        let name = "bit of the converter that weighs wrong";
        let weight = codes::Weight::new(draw, &stand, 0, 25.0);
        let off = crate::strength::size_for(25.0, &|off| weight.strength(&stand, 0, off));
        println!("{name}: {weight:?}, {off:.2} counts");
        let (first, edges) = weight.edges(&stand, 0, off);
        let (mean, sigma) = (stand.bias[0] / LSB, stand.white(0).sqrt() / LSB);
        hold_codes(name, &stand, first, &shares(&edges, mean, sigma));
    }
}

#[test]
fn no_filter_stale_sample_bit_or_outlier_describes_the_steps_of_the_thirteenth_set() {
    for index in 0..DRAWS {
        let draw = &mut Draw::of(20_261_122, 144, index);
        let stand = stand(draw, NAMES[0]);
        let name = "output that falls slower than it rises";
        let next: &Next = &codes::falling(draw, &stand, 0);
        let (first, steps, shares) = hold_next(name, &stand, next);
        hold_codes(name, &stand, first, &shares);
        hold_outliers(name, &stand, first, &steps, &shares);
        let name = "low nibble of the reading after";
        let of = |chance: f64| codes::of_nibble(&stand, 0, chance);
        let chance = crate::strength::size_for(25.0, &of);
        println!("{name}: chance {chance:.2}");
        let (first, steps, shares) = codes::steps_of_nibble(&stand, 0, chance);
        hold_steps(name, &stand, first, &steps, &shares);
        hold_codes(name, &stand, first, &shares);
        hold_outliers(name, &stand, first, &steps, &shares);
    }
}

#[test]
fn the_thirteenth_set_is_as_strong_as_wanted_or_as_large_as_may_be() {
    are_as_strong_as_wanted(&NAMES, 145);
}

#[test]
fn each_of_the_thirteenth_set_acts_on_its_channel_and_leaves_the_others() {
    act_on_their_channel_alone(&NAMES, 146, 0.005);
}
