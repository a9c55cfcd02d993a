//! The eighth set against the library, a sum of two of its effects included.

use super::super::kept_back_eighth::{NAMES, codes, noise};
use super::super::kept_back_fourth::codes::{law, long_run};
use super::super::kept_back_seventh::noise::of_memory;
use super::super::kept_back_third::noise::of_humps;
use super::codes::{by_neighbours, hold_codes, hold_steps};
use super::seventh::hold_spectrum;
use super::*;

/// Those whose shape is a signal that could be known, the hump that runs among them.
const SIGNALS: u64 = 11;

#[test]
fn no_effect_of_the_library_nor_two_describe_a_signal_of_the_eighth_set() {
    hold_signals(NAMES, 76, SIGNALS);
}

#[test]
fn no_process_of_the_library_describes_the_spectra_of_the_eighth_set() {
    for index in 0..DRAWS {
        let draw = &mut Draw::of(20_261_122, 77, index);
        let stand = stand(draw, NAMES[0]);
        let axis = draw.of_many(3);
        hold_spectrum("noise that undoes itself", &stand, axis, &|order, w| {
            of_memory(-order.min(0.9), w)
        });
        for (low, high) in [(0.6, 1.1), (0.6, 3.0), (3.0, 6.0), (6.5, 9.5)] {
            let band = noise::Band {
                low: TAU * low / stand.rate_hz,
                high: TAU * high / stand.rate_hz,
            };
            hold_noise("noise between two edges", &stand, axis, &|w| {
                band.density(w)
            });
        }
    }
}

/// Its mean spectrum: what a process that stands still has of it.
#[test]
fn no_process_of_the_library_describes_a_hump_that_runs() {
    for index in 0..DRAWS {
        let draw = &mut Draw::of(20_261_122, 78, index);
        let stand = stand(draw, NAMES[0]);
        let axis = draw.of_many(3);
        let meter = Meter::new(&stand, axis);
        for (from, to, half_width) in [(1.0, 9.3, 0.1), (4.0, 6.0, 0.1), (4.0, 6.0, 0.5)] {
            let keep = (-TAU * half_width / stand.rate_hz).exp();
            let at_hz = noise::places(from, to);
            let each: Vec<Vec<f64>> = at_hz
                .iter()
                .map(|f| of_humps(&meter, &[*f], keep, stand.rate_hz))
                .collect();
            let strength = |power: f64| {
                let of = |d: &Vec<f64>| {
                    let density: Vec<f64> = d.iter().map(|d| power * d).collect();
                    meter.of_density(&density).powi(2) / each.len() as f64
                };
                each.iter().map(of).sum::<f64>().sqrt()
            };
            let power = crate::strength::size_for(25.0, &strength);
            let mean = of_humps(&meter, &at_hz, keep, stand.rate_hz);
            let with: Vec<f64> = mean.iter().map(|d| power * d).collect();
            let flat = meter.of_density(&with).powi(2) / 625.0;
            let ones = vec![1.0; stand.samples()];
            let count = analysis::likelihood::Bins::new(stand.samples()).products(&ones, &ones);
            let beside: Vec<f64> = with.iter().zip(&count).map(|(d, m)| d * m).collect();
            let expected = spectrum(&stand, axis, &|_| 1.0, &beside);
            let own = saturated(&stand, &expected);
            for effect in EFFECTS {
                let share = of_process(&stand, axis, &expected, own, *effect);
                hold(NAMES[15], effect.id(), share * flat);
            }
        }
    }
}

/// Against what the law of the blocks gains, of which the spectrum is a part.
#[test]
fn no_process_of_the_library_describes_a_reference_renewed_every_few_readings() {
    let draw = &mut Draw::of(20_261_122, 79, 0);
    let name = "reference renewed every few readings";
    let stand = stand(draw, name);
    let axis = draw.of_many(3);
    for length in 2..=6 {
        let n = stand.samples() as f64;
        let of = |part: f64| (n * noise::of_reference(length, part)).sqrt();
        let part = crate::strength::size_for(25.0, &of);
        let density = |w: f64| noise::density_of_reference(length, part, w);
        let expected = spectrum(&stand, axis, &density, &[]);
        let own = saturated(&stand, &expected);
        let flat = kept_back::shaped(&stand, axis, &|w| density(w) - 1.0).powi(2) / 625.0;
        println!("{name}: {length} readings, {part:.2}, spectrum {flat:.2}");
        for effect in EFFECTS {
            let of_spectrum = of_process(&stand, axis, &expected, own, *effect);
            hold(name, effect.id(), of_spectrum * flat);
        }
    }
}

#[test]
fn no_law_of_variance_of_the_library_describes_noise_that_feeds_its_size() {
    for index in 0..DRAWS {
        let draw = &mut Draw::of(20_261_122, 80, index);
        let name = "noise that feeds its own size";
        let stand = stand(draw, name);
        let independent: Vec<f64> = (0..stand.samples()).map(|_| draw.normal()).collect();
        for stays in [0.9, 0.95, 0.98] {
            let of = |gain: f64| of_variance(&noise::fed(gain, stays, &independent).0);
            let gain = crate::strength::size_for(25.0, &of);
            assert!((of(gain) - 25.0).abs() < 0.1 && gain < 0.9 * stays);
            hold_law(name, &stand, &noise::fed(gain, stays, &independent).0);
        }
    }
}

/// Correlation of neighbours is all that a filter has of it.
#[test]
fn correlation_of_neighbours_is_a_small_part_of_a_swing_that_pushes() {
    for index in 0..DRAWS {
        let draw = &mut Draw::of(20_261_122, 81, index);
        let name = "swing that pushes one way";
        let mut stand = stand(draw, name);
        let f = foreign(draw, &mut stand, name, 0, 25.0);
        let Change::Noise(x, _) = &f.change else {
            panic!("{name} is no noise")
        };
        let square: f64 = x.iter().map(|v| v * v).sum();
        let r = x.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / square;
        hold(name, "low_pass", by_neighbours(r, x.len(), f.strength));
    }
}

/// Play against a pole, by the correlation of neighbours, and against readings that come again at random.
#[test]
fn neither_a_filter_nor_stale_samples_describe_play_in_the_reading() {
    for index in 0..DRAWS {
        let draw = &mut Draw::of(20_261_122, 82, index);
        let name = "play in the reading";
        let stand = stand(draw, name);
        let play = crate::strength::size_for(25.0, &|p| codes::of_play(&stand, 0, p.min(6.0)));
        let (first, even) = law(&stand, 0);
        let steps = codes::steps_with_play(&stand, 0, play);
        let shares = long_run(&steps, &even);
        println!("{name}: {play:.2} counts");
        hold_steps(name, &stand, first, &steps, &shares);
    }
}

#[test]
fn no_stuck_bit_nor_rail_describes_an_amplifier_that_bends() {
    for index in 0..DRAWS {
        let draw = &mut Draw::of(20_261_122, 83, index);
        let name = "amplifier that bends to a logarithm";
        let mut stand = stand(draw, name);
        let f = foreign(draw, &mut stand, name, 0, 25.0);
        let Change::Edges(first, edges) = &f.change else {
            panic!("{name} has no edges")
        };
        let (mean, sigma) = (stand.bias[0] / LSB, stand.white(0).sqrt() / LSB);
        hold_codes(name, &stand, *first, &shares(edges, mean, sigma));
    }
}

/// In the readings: what a straight line of the other two axes has of a coupling.
#[test]
fn no_cross_axis_describes_the_couplings_of_the_eighth_set() {
    for name in ["changes of another axis", "magnitude of another axis"] {
        for index in 0..DRAWS {
            let draw = &mut Draw::of(20_261_122, 84, index);
            hold_coupling(draw, name);
        }
    }
}

#[test]
fn the_eighth_set_is_as_strong_as_wanted_or_as_large_as_may_be() {
    are_as_strong_as_wanted(&NAMES, 85);
}

#[test]
fn each_of_the_eighth_set_acts_on_its_channel_and_leaves_the_others() {
    act_on_their_channel_alone(&NAMES, 86, 0.005);
}
