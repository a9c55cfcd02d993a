//! The twelfth set against the library, a sum of two of its effects included.

use super::super::kept_back_sixth::codes::{law_of_map, of_map};
use super::super::kept_back_twelfth::{NAMES, codes, noise};
use super::codes::{hold_codes, hold_steps};
use super::*;

/// Those whose shape is a signal that could be known.
const SIGNALS: u64 = 14;

#[test]
fn no_effect_of_the_library_nor_two_describe_a_signal_of_the_twelfth_set() {
    hold_signals(NAMES, 131, SIGNALS);
}

#[test]
fn no_law_of_variance_of_the_library_describes_the_bursts_of_a_bus() {
    let name = "bursts of a bus every few seconds";
    for index in 0..DRAWS {
        let draw = &mut Draw::of(20_261_122, 132, index);
        let stand = stand(draw, name);
        let shape = noise::bursts(draw, &stand);
        let of = |size: f64| -> Vec<f64> { shape.iter().map(|s| 1.0 + size * s).collect() };
        let size = crate::strength::size_for(25.0, &|s| of_variance(&of(s)));
        hold_law(name, &stand, &of(size));
    }
}

/// Of a white noise and a random walk behind a capacitor, by what is left of them.
#[test]
fn no_process_of_the_library_describes_what_a_capacitor_passes() {
    let name = "coupling capacitor in the signal's way";
    for index in 0..DRAWS {
        let draw = &mut Draw::of(20_261_122, 133, index);
        let stand = stand(draw, name);
        let corner = crate::strength::size_for(25.0, &|c| noise::of_corner(&stand, 0, c));
        println!("{name}: {corner:.2} Hz");
        let mut expected = spectrum(&stand, 0, &|_| 1.0, &[]);
        let meter = Meter::new(&stand, 0);
        for (e, w) in expected.iter_mut().zip(meter.omega()) {
            *e *= noise::passed(corner, stand.rate_hz, *w).max(1e-9);
        }
        let own = saturated(&stand, &expected);
        for effect in EFFECTS {
            let share = of_process(&stand, 0, &expected, own, *effect);
            hold(name, effect.id(), share);
        }
    }
}

#[test]
fn no_bit_rail_filter_or_stale_sample_describes_the_readings_of_the_twelfth_set() {
    for index in 0..DRAWS {
        let draw = &mut Draw::of(20_261_122, 134, index);
        let stand = stand(draw, NAMES[0]);
        let name = "gain of one that cuts toward zero";
        let cut = codes::cut(draw, &stand, 0);
        let of = |chance: f64| of_map(&stand, 0, chance.min(1.0), &cut);
        let chance = crate::strength::size_for(25.0, &of);
        println!("{name}: chance {chance:.2}");
        let (first, read) = law_of_map(&stand, 0, chance, &cut);
        hold_codes(name, &stand, first, &read);
        let wave = codes::Wave::new(draw, &stand, 0);
        let (first, edges) = wave.edges(&stand, 0, 0.6);
        let (mean, sigma) = (stand.bias[0] / LSB, stand.white(0).sqrt() / LSB);
        let read = shares(&edges, mean, sigma);
        hold_codes("converter whose line is wavy", &stand, first, &read);
        let name = "despiker that takes the median";
        let gate = codes::gate_for(&stand, 0, 25.0);
        println!("{name}: {gate:.2} counts");
        let (first, steps, shares) = codes::steps_of_gate(&stand, 0, gate);
        hold_steps(name, &stand, first, &steps, &shares);
    }
}

/// Of another axis's readings for a while, a change of the noise has only what the two differ by.
#[test]
fn no_change_of_the_noise_describes_a_neighbour_that_is_read() {
    let name = "axis that reads its neighbour for a while";
    for index in 0..DRAWS {
        let draw = &mut Draw::of(20_261_122, 135, index);
        let mut stand = stand(draw, name);
        let f = foreign(draw, &mut stand, name, 0, 25.0);
        let Change::Made(change) = &f.change else {
            panic!("{name} makes no counts")
        };
        let [own, others] = [0, 1].map(|count| vec![count; stand.samples()]);
        let read = change(&[own, others.clone(), others], draw);
        for other in [1, 2] {
            let ratio = stand.white(other) / stand.white(0);
            let at = |count: &i32| if *count == 1 { ratio } else { 1.0 };
            let law: Vec<f64> = read.iter().map(at).collect();
            let share = (of_variance(&law) / f.strength).powi(2);
            hold(name, "noise_change", share);
        }
    }
}

#[test]
fn the_twelfth_set_is_as_strong_as_wanted_or_as_large_as_may_be() {
    are_as_strong_as_wanted(&NAMES, 136);
}

#[test]
fn each_of_the_twelfth_set_acts_on_its_channel_and_leaves_the_others() {
    act_on_their_channel_alone(&NAMES, 137, 0.005);
}
