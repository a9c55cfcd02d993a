//! The second set against the library.

use super::super::kept_back::{Mode, NAMES, by_difference, by_echo};
use super::*;

#[test]
fn no_regression_line_or_process_of_the_library_describes_a_signal() {
    for name in NAMES {
        for index in 0..DRAWS {
            let draw = &mut Draw::of(20_261_121, 7, index);
            let mut stand = stand(draw, name);
            let axis = draw.of_many(3);
            let f = foreign(draw, &mut stand, name, axis, 25.0);
            let (Change::Add(signal), true) = (&f.change, name != "noise with a resonance") else {
                continue;
            };
            println!("{name} #{index}: d' {:.1}", f.strength);
            for (library, share) in of_all(&stand, axis, signal) {
                hold(name, library, share);
            }
        }
    }
}

#[test]
fn no_process_of_the_library_describes_a_shaped_noise() {
    for index in 0..DRAWS {
        let draw = &mut Draw::of(20_261_121, 8, index);
        let stand = stand(draw, "");
        let axis = draw.of_many(3);
        let meter = Meter::new(&stand, axis);
        let hold_all = |what: &str, expected: &[f64]| {
            let own = saturated(&stand, expected);
            for effect in EFFECTS {
                hold(
                    what,
                    effect.id(),
                    of_process(&stand, axis, expected, own, *effect),
                );
            }
        };
        let share = 0.3;
        hold_all(
            "noise of a differenced angle",
            &spectrum(&stand, axis, &|w| 1.0 + by_difference(share, w), &[]),
        );
        for (g, after) in [(0.24, 3), (-0.24, 3), (0.24, 9), (-0.24, 25)] {
            hold_all(
                "echo of earlier samples",
                &spectrum(&stand, axis, &|w| 1.0 + by_echo(g, after, w), &[]),
            );
        }
        for (f, half_width) in [(0.6, 0.03), (0.6, 0.15), (3.0, 0.1), (8.0, 0.3)] {
            let mode = Mode::new(f, half_width, stand.rate_hz);
            let with = |size: f64| -> Vec<f64> {
                meter
                    .omega()
                    .iter()
                    .map(|w| size * mode.density(*w))
                    .collect()
            };
            let size = crate::strength::size_for(25.0, &|x| meter.of_density(&with(x)));
            hold_all(
                "noise with a resonance",
                &spectrum(
                    &stand,
                    axis,
                    &|w| 1.0 + size * mode.density(w) / stand.white(axis),
                    &[],
                ),
            );
        }
    }
}

#[test]
fn no_law_of_variance_of_the_library_describes_a_changing_variance() {
    for name in ["noise whose size wanders", "every few samples noisier"] {
        for index in 0..DRAWS {
            let draw = &mut Draw::of(20_261_121, 9, index);
            hold_variance(draw, name);
        }
    }
}

#[test]
fn no_stuck_or_missing_bit_describes_uneven_steps() {
    for index in 0..DRAWS {
        let draw = &mut Draw::of(20_261_121, 10, index);
        let mut stand = stand(draw, "");
        let name = "uneven steps of the converter";
        let f = foreign(draw, &mut stand, name, 0, 25.0);
        let Change::Edges(first, edges) = &f.change else {
            panic!("no edges")
        };
        assert!(f.strength > 24.0);
        hold_edges(name, &stand, *first, edges, f.strength);
    }
}
