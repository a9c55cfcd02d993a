//! The ninth set against the library, a sum of two of its effects included.

use super::super::kept_back_fourth::about_mean;
use super::super::kept_back_ninth::{NAMES, codes, noise};
use super::codes::{by_neighbours, hold_codes, hold_next};
use super::*;

/// Those whose shape is a signal that could be known.
const SIGNALS: u64 = 11;

#[test]
fn no_effect_of_the_library_nor_two_describe_a_signal_of_the_ninth_set() {
    hold_signals(NAMES, 93, SIGNALS);
}

#[test]
fn no_law_of_variance_of_the_library_describes_those_of_the_ninth_set() {
    for index in 0..DRAWS {
        let draw = &mut Draw::of(20_261_122, 94, index);
        let name = "noise that a swing to one side leaves louder";
        let stand = stand(draw, name);
        let independent: Vec<f64> = (0..stand.samples()).map(|_| draw.normal()).collect();
        let of = |size: f64| noise::louder(size, &independent).0;
        let size = crate::strength::size_for(25.0, &|s| of_variance(&of(s)));
        hold_law(name, &stand, &of(size));
        // Another axis's swing in place of its own.
        let name = "gain that another axis turns";
        let turn = 25.0 / codes::of_gain(1.0, stand.samples());
        let law: Vec<f64> = independent.iter().map(|z| (2.0 * turn * z).exp()).collect();
        assert!((of_variance(&law) / 25.0 - 1.0).abs() < 0.05);
        hold_law(name, &stand, &law);
    }
}

/// Neighbours: what a filter has of readings that are straight here and there, and of a size that follows a swing.
#[test]
fn correlation_of_neighbours_is_a_small_part_of_bridges_and_of_a_one_sided_swing() {
    for index in 0..DRAWS {
        let draw = &mut Draw::of(20_261_122, 95, index);
        let name = "noise that a swing to one side leaves louder";
        let mut stand = stand(draw, name);
        let f = foreign(draw, &mut stand, name, 0, 25.0);
        let Change::Noise(x, _) = &f.change else {
            panic!("{name} is no noise")
        };
        hold(name, "low_pass", by_neighbours(lag_1(x), x.len(), 25.0));
        let name = "gaps bridged by straight lines";
        let f = foreign(draw, &mut stand, name, 0, 25.0);
        let Change::Made(change) = &f.change else {
            panic!("{name} makes no counts")
        };
        let (middle, sigma) = (stand.bias[0], stand.white(0).sqrt());
        let own: Vec<i32> = (0..stand.samples())
            .map(|_| ((middle + sigma * draw.normal()) / LSB).round() as i32)
            .collect();
        let new = change(&[own.clone(), own.clone(), own], draw);
        let about: Vec<f64> = new.iter().map(|c| LSB * f64::from(*c) - middle).collect();
        hold(
            name,
            "low_pass",
            by_neighbours(lag_1(&about), about.len(), 25.0),
        );
    }
}

fn lag_1(x: &[f64]) -> f64 {
    let square: f64 = x.iter().map(|v| v * v).sum();
    x.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / square
}

#[test]
fn neither_a_filter_nor_stale_samples_describe_the_codes_of_the_ninth_set() {
    for index in 0..DRAWS {
        let draw = &mut Draw::of(20_261_122, 96, index);
        let stand = stand(draw, NAMES[0]);
        let fault = codes::repeated(codes::fault_of(draw, &stand, 0));
        let all: [(&str, &codes::Next); 4] = [
            ("low bits that a latch keeps", &codes::latched(1)),
            ("low bits that a latch keeps", &codes::latched(2)),
            ("differences sent in few levels", &codes::in_levels),
            ("code taken for a fault", &fault),
        ];
        for (name, next) in all {
            let (first, _, shares) = hold_next(name, &stand, next);
            if name == "code taken for a fault" {
                hold_codes(name, &stand, first, &shares);
            }
        }
    }
}

/// In the readings: what a straight line of the other two axes has of a coupling.
#[test]
fn no_cross_axis_describes_the_couplings_of_the_ninth_set() {
    for index in 0..DRAWS {
        let draw = &mut Draw::of(20_261_122, 97, index);
        hold_coupling(draw, "another axis through a resonance");
        let name = "diode between two axes";
        let stand = stand(draw, name);
        let (diode, [own, other]) = codes::diode_of(draw, &stand, (0, 1), 25.0);
        let with: Vec<f64> = own
            .iter()
            .zip(&other)
            .map(|(w, o)| diode.of(*w, *o))
            .collect();
        let (with, other) = (about_mean(&with), about_mean(&other));
        let of = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
        let r = of(&with, &other) / (of(&with, &with) * of(&other, &other)).sqrt();
        hold(name, "cross_axis", by_neighbours(r, with.len(), 25.0));
    }
}

#[test]
fn the_ninth_set_is_as_strong_as_wanted_or_as_large_as_may_be() {
    are_as_strong_as_wanted(&NAMES, 98);
}

#[test]
fn each_of_the_ninth_set_acts_on_its_channel_and_leaves_the_others() {
    act_on_their_channel_alone(&NAMES, 99, 0.005);
}
