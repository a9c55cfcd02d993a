//! The seventh set against the library, a sum of two of its effects included.

use super::super::kept_back_fifth::noise::refitted;
use super::super::kept_back_seventh::{NAMES, noise};
use super::*;

/// Those whose shape is a signal that could be known, the mode that noise drives among them.
const SIGNALS: u64 = 11;

#[test]
fn no_effect_of_the_library_nor_two_describe_a_signal_of_the_seventh_set() {
    hold_signals(NAMES, 62, SIGNALS);
}

#[test]
fn no_law_of_variance_of_the_library_describes_those_of_the_seventh_set() {
    for name in ["noise that swells and ebbs", "noise of random size"] {
        for index in 0..DRAWS {
            let draw = &mut Draw::of(20_261_121, 63, index);
            hold_variance(draw, name);
        }
    }
}

/// A spectrum that white noise is given whole, at the size that makes it 25 strong, against every process of the library.
pub(super) fn hold_spectrum(name: &str, stand: &Stand, axis: usize, by: &dyn Fn(f64, f64) -> f64) {
    let strength = |size: f64| kept_back::shaped(stand, axis, &|w| by(size, w) - 1.0);
    let size = crate::strength::size_for(25.0, &strength);
    let expected = spectrum(stand, axis, &|w| by(size, w), &[]);
    let own = saturated(stand, &expected);
    println!("{name}: size {size:.2}");
    for effect in EFFECTS {
        let share = of_process(stand, axis, &expected, own, *effect);
        hold(name, effect.id(), share);
    }
}

#[test]
fn no_process_of_the_library_describes_the_spectra_of_the_seventh_set() {
    for index in 0..DRAWS {
        let draw = &mut Draw::of(20_261_121, 64, index);
        let stand = stand(draw, NAMES[0]);
        let axis = draw.of_many(3);
        hold_spectrum("angle that is rounded", &stand, axis, &|share, w| {
            1.0 - share.min(1.0) * w.cos()
        });
        for (sign, after) in [(1.0, 3), (-1.0, 3), (1.0, 17), (-1.0, 40)] {
            hold_spectrum("reverberation of the noise", &stand, axis, &|share, w| {
                noise::of_return(sign * share.min(0.95), after, w)
            });
        }
    }
}

/// Over whole periods nothing is left of it in the correlation of neighbours, which is all that a filter has.
#[test]
fn correlation_of_neighbours_is_no_part_of_a_colour_that_turns() {
    for index in 0..DRAWS {
        let draw = &mut Draw::of(20_261_121, 65, index);
        let name = "colour that turns";
        let mut stand = stand(draw, name);
        let f = foreign(draw, &mut stand, name, 0, 25.0);
        let Change::Noise(x, share) = &f.change else {
            panic!("{name} is no noise")
        };
        let square: f64 = x.iter().map(|v| v * v).sum();
        let r = share * x.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / square;
        let described = -(x.len() as f64) * (-r * r).ln_1p() / f.strength.powi(2);
        hold(name, "low_pass", described);
    }
}

#[test]
fn no_stuck_bit_describes_a_dead_band() {
    for index in 0..DRAWS {
        let draw = &mut Draw::of(20_261_121, 66, index);
        let name = "dead band at zero";
        let mut stand = stand(draw, name);
        let f = foreign(draw, &mut stand, name, 0, 25.0);
        let Change::Edges(first, edges) = &f.change else {
            panic!("{name} has no edges")
        };
        let refitted = refitted(&stand, 0, *first, edges);
        hold_edges_about(name, &stand, *first, edges, f.strength, refitted);
    }
}

/// In the readings: what a straight line of the other two axes has of a tail.
#[test]
fn no_cross_axis_describes_a_tail_of_another_axis() {
    for index in 0..DRAWS {
        let draw = &mut Draw::of(20_261_121, 67, index);
        let name = "tail of another axis";
        hold_coupling(draw, name);
    }
}

/// White noise and random walk refitted, it has hardly more than 25 in 600 s, whatever its order.
#[test]
fn no_process_of_the_library_describes_a_long_memory_of_its_orders() {
    for index in 0..DRAWS {
        let draw = &mut Draw::of(20_261_121, 70, index);
        let name = "long memory";
        let mut stand = stand(draw, name);
        let axis = draw.of_many(3);
        let f = foreign(draw, &mut stand, name, axis, 40.0);
        println!("{name}: d' {:.1}", f.strength);
        assert!((25.0..27.0).contains(&f.strength), "{}", f.strength);
        for order in [noise::ORDERS.0, noise::ORDERS.1] {
            let expected = spectrum(&stand, axis, &|w| noise::of_memory(order, w), &[]);
            let own = saturated(&stand, &expected);
            for effect in EFFECTS {
                let share = of_process(&stand, axis, &expected, own, *effect);
                hold(name, effect.id(), share);
            }
        }
    }
}

#[test]
fn the_seventh_set_is_as_strong_as_wanted_or_as_large_as_may_be() {
    let rest: Vec<&'static str> = NAMES.into_iter().filter(|n| *n != "long memory").collect();
    are_as_strong_as_wanted(&rest, 68);
}

#[test]
fn each_of_the_seventh_set_acts_on_its_channel_and_leaves_the_others() {
    act_on_their_channel_alone(&NAMES, 69, 0.005);
}
