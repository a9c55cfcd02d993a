//! The sixth set against the library, a sum of two of its effects included.

use super::super::kept_back_fourth::codes::{law, long_run};
use super::super::kept_back_sixth::{NAMES, codes, noise};
use super::codes::{by_neighbours, hold_codes, of_neighbours};
use super::*;

/// Those whose shape is a signal that could be known.
const SIGNALS: u64 = 13;

#[test]
fn no_effect_of_the_library_nor_two_describe_a_signal_of_the_sixth_set() {
    hold_signals(NAMES, 45, SIGNALS);
}

#[test]
fn no_law_of_variance_of_the_library_describes_those_of_the_sixth_set() {
    for name in [
        "amplifier blocked after a shock",
        "mean over as many looks as fit",
    ] {
        let draw = &mut Draw::of(20_261_121, 46, 0);
        hold_variance(draw, name);
    }
}

#[test]
fn no_process_of_the_library_describes_a_zero_taken_from_blocks() {
    let draw = &mut Draw::of(20_261_121, 47, 0);
    let name = "zero taken anew from each block";
    let stand = stand(draw, name);
    let axis = draw.of_many(3);
    for length in [4, 7] {
        let share = (length as f64 * ((625.0 / stand.samples() as f64).exp() - 1.0)).sqrt();
        let density = |w: f64| noise::density_of_blocks(length, share, w);
        // Against what the law of the blocks gains, of which the spectrum is a part.
        let whole = 25.0f64.powi(2);
        let expected = spectrum(&stand, axis, &density, &[]);
        let own = saturated(&stand, &expected);
        let flat = kept_back::shaped(&stand, axis, &|w| density(w) - 1.0).powi(2);
        for effect in EFFECTS {
            let of_spectrum = of_process(&stand, axis, &expected, own, *effect);
            hold(name, effect.id(), of_spectrum * flat / whole);
        }
    }
}

#[test]
fn correlation_of_neighbours_is_a_part_of_what_filters_of_the_sixth_set_do() {
    for name in [
        "interpolation between two clocks",
        "memory that is trimmed at one temperature",
        "product of the last two swings",
        "filter that lets large changes through",
        "filter that is switched in while the motor runs",
    ] {
        for index in 0..DRAWS {
            let draw = &mut Draw::of(20_261_121, 48, index);
            let mut stand = stand(draw, name);
            let f = foreign(draw, &mut stand, name, 0, 25.0);
            let Change::Noise(x, share) = &f.change else {
                panic!("{name} is no noise")
            };
            let square: f64 = x.iter().map(|v| v * v).sum();
            let r = share * x.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / square;
            hold(name, "low_pass", by_neighbours(r, x.len(), f.strength));
        }
    }
    for index in 0..DRAWS {
        let draw = &mut Draw::of(20_261_121, 49, index);
        let name = "reading that may change by so much at most";
        let stand = stand(draw, name);
        let most = (1..60)
            .rev()
            .find(|most| codes::of_limit(&stand, 0, *most) >= 25.0)
            .expect("a limit of one count is felt");
        let (_, even) = law(&stand, 0);
        let steps = codes::steps_within(&even, most);
        let shares = long_run(&steps, &even);
        let r = of_neighbours(&steps, &shares);
        let strength = codes::of_limit(&stand, 0, most);
        let share = by_neighbours(r, stand.samples(), strength);
        hold(name, "low_pass", share);
    }
}

#[test]
fn no_stuck_bit_nor_rail_describes_codes_of_the_sixth_set() {
    for index in 0..DRAWS {
        let draw = &mut Draw::of(20_261_121, 50, index);
        let mut stand = stand(draw, NAMES[0]);
        for name in [
            "gain that differs with the sense",
            "step that grows with the reading",
        ] {
            let f = foreign(draw, &mut stand, name, 0, 25.0);
            let Change::Edges(first, edges) = &f.change else {
                panic!("{name} has no edges")
            };
            let (mean, sigma) = (stand.bias[0] / LSB, stand.white(0).sqrt() / LSB);
            hold_codes(name, &stand, *first, &shares(edges, mean, sigma));
        }
        for pair in [(1, 2), (1, 3), (2, 3)] {
            for chance in [0.4, 1.0] {
                let map = |c: i32| codes::with_exchanged(c, pair);
                let (first, read) = codes::law_of_map(&stand, 0, chance, &map);
                hold_codes("two lines of the word exchanged", &stand, first, &read);
            }
        }
        let (first, read) = codes::law_of_map(&stand, 0, 0.3, &codes::with_parity);
        hold_codes("lowest bit that carries the parity", &stand, first, &read);
        let gate = (2.0 * stand.white(0).sqrt() / LSB).round() as i32;
        let (first, read) = codes::law_of_gate(&stand, 0, gate);
        hold_codes(
            "far readings put between their neighbours",
            &stand,
            first,
            &read,
        );
    }
}

/// Couplings, in the readings: what a straight line of the other two axes has of what was added.
#[test]
fn no_cross_axis_describes_the_couplings_of_the_sixth_set() {
    for name in [
        "toggling line of another axis's word",
        "another axis, its sign alternating",
        "product of the two other axes",
    ] {
        let draw = &mut Draw::of(20_261_121, 51, 0);
        hold_coupling(draw, name);
    }
}

/// Limits that are whole counts: they come a little stronger than wanted.
const BY_COUNTS: [&str; 3] = [
    "step that grows with the reading",
    "far readings put between their neighbours",
    "reading that may change by so much at most",
];

#[test]
fn the_sixth_set_is_as_strong_as_wanted_or_as_large_as_may_be() {
    let rest: Vec<&'static str> = NAMES
        .into_iter()
        .filter(|n| !BY_COUNTS.contains(n))
        .collect();
    are_as_strong_as_wanted(&rest, 52);
    for name in BY_COUNTS {
        for index in 0..STRENGTHS {
            let draw = &mut Draw::of(20_261_121, 53, index);
            let mut stand = stand(draw, name);
            let wanted = draw.by_ratio(25.0, 40.0);
            let f = foreign(draw, &mut stand, name, 0, wanted);
            println!("{name}: {:.1} for {wanted:.1}", f.strength);
            // Of the codes alone, a gate has no more than some 30.
            let least = if name == BY_COUNTS[1] { 25.0 } else { wanted };
            assert!(f.strength >= least && f.strength < 2.5 * wanted, "{name}");
        }
    }
}

#[test]
fn each_of_the_sixth_set_acts_on_its_channel_and_leaves_the_others() {
    act_on_their_channel_alone(&NAMES, 54, 0.005);
}
