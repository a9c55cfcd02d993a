//! The third set against the library, a sum of two of its effects included.

use super::super::kept_back_third::{NAMES, noise};
use super::*;

/// Effects whose shape is not a signal that could be known: their spectrum is what is described.
const HUMP: &str = "hump of noise that moves with temperature";

/// Share of a signal's gain that the best two effects of the library describe together: the best, then the best beside it.
pub(super) fn of_two(stand: &Stand, axis: usize, signal: &[f64]) -> (Vec<&'static str>, f64) {
    let meter = Meter::new(stand, axis);
    let gain = |s: &[f64]| meter.of_signal(&meter.energy(s)).powi(2);
    let whole = gain(signal);
    let sets: Vec<(&'static str, Vec<Vec<f64>>)> = EFFECTS
        .iter()
        .flat_map(|e| {
            columns(*e, stand, axis)
                .into_iter()
                .map(|set| (e.id(), set))
        })
        .collect();
    // Of an effect with bounds one set is all that it can be: two of them would be beyond these.
    let bounded = |id: &str| {
        let of = EFFECTS.iter().find(|e| e.id() == id);
        of.is_some_and(|e| e.parameters().iter().any(|p| e.at_most(p.name).is_some()))
    };
    let (mut taken, mut names) = (vec![], vec![]);
    let mut rest = signal.to_vec();
    for _ in 0..2 {
        // A line, and one that swings: a line with two beside it.
        let mut lines = vec![];
        let mut own = vec![];
        for _ in 0..3 {
            let left = meter.beyond(&rest, &lines);
            lines.extend(strongest_line(stand, axis, &left));
            own.push(("line", lines.clone()));
        }
        let with = |set: &[Vec<f64>]| meter.beyond(signal, &[taken.as_slice(), set].concat());
        let (id, best) = sets
            .iter()
            .chain([&own[0], &own[2]])
            .filter(|(id, _)| !(names.contains(id) && bounded(id)))
            .min_by(|a, b| gain(&with(&a.1)).total_cmp(&gain(&with(&b.1))))
            .expect("the library has regressions");
        rest = with(best);
        taken.extend(best.clone());
        names.push(*id);
        if names.len() == 1 {
            // Beside the first a process may take more than a second regression.
            let left = gain(&rest) / whole;
            let expected = spectrum(stand, axis, &|_| 1.0, &meter.energy(&rest));
            let own = saturated(stand, &expected);
            let (process, share) = EFFECTS
                .iter()
                .map(|e| (e.id(), of_process(stand, axis, &expected, own, *e)))
                .max_by(|a, b| a.1.total_cmp(&b.1))
                .expect("the library has processes");
            hold(
                "what is left beside the first",
                process,
                1.0 - left * (1.0 - share),
            );
        }
    }
    (names, 1.0 - gain(&rest) / whole)
}

#[test]
fn no_effect_of_the_library_nor_two_describe_a_signal_of_the_third_set() {
    hold_signals(NAMES.into_iter().filter(|n| *n != HUMP), 14, 8);
}

#[test]
fn no_process_of_the_library_describes_a_hole_or_a_hump_that_moves() {
    for index in 0..DRAWS {
        let draw = &mut Draw::of(20_261_121, 15, index);
        let stand = stand(draw, HUMP);
        let axis = draw.of_many(3);
        let meter = Meter::new(&stand, axis);
        let hold_all = |what: &str, expected: &[f64]| {
            let own = saturated(&stand, expected);
            for effect in EFFECTS {
                let share = of_process(&stand, axis, expected, own, *effect);
                hold(what, effect.id(), share);
            }
        };
        for (f, half_width) in [(1.6, 0.2), (5.0, 0.1), (5.0, 0.4), (8.4, 0.2)] {
            let notch = noise::Notch::new(f, half_width, stand.rate_hz);
            let passed = notch.variance();
            hold_all(
                "noise with a hole in its spectrum",
                &spectrum(&stand, axis, &|w| notch.gain(w) / passed, &[]),
            );
        }
        for (from, to, half_width) in [(1.2, 2.5, 0.1), (8.0, 2.0, 0.2), (4.0, 5.3, 0.4)] {
            let keep = (-TAU * half_width / stand.rate_hz).exp();
            let at_hz: Vec<f64> = (0..40)
                .map(|i| from + (to - from) * (f64::from(i) + 0.5) / 40.0)
                .collect();
            let density = noise::of_humps(&meter, &at_hz, keep, stand.rate_hz);
            let with = |sigma: f64| -> Vec<f64> { density.iter().map(|d| sigma * d).collect() };
            let size = crate::strength::size_for(25.0, &|x| meter.of_density(&with(x)));
            let ones = vec![1.0; stand.samples()];
            let count = analysis::likelihood::Bins::new(stand.samples()).products(&ones, &ones);
            let beside: Vec<f64> = with(size).iter().zip(&count).map(|(d, m)| d * m).collect();
            hold_all(HUMP, &spectrum(&stand, axis, &|_| 1.0, &beside));
        }
    }
}

#[test]
fn no_law_of_variance_of_the_library_describes_those_of_the_third_set() {
    for index in 0..DRAWS {
        let draw = &mut Draw::of(20_261_121, 16, index);
        let name = "noise while the temperature moves";
        let stand = hold_variance(draw, name);
        let independent: Vec<f64> = (0..stand.samples()).map(|_| draw.normal()).collect();
        let name = "noise that remembers its last size";
        hold_law(name, &stand, &noise::remembered(0.25, &independent).0);
    }
}

#[test]
fn no_stuck_or_missing_bit_describes_two_codes_in_one() {
    for index in 0..4 * DRAWS {
        let draw = &mut Draw::of(20_261_121, 17, index);
        let name = "two codes of the part in one";
        let mut stand = stand(draw, name);
        let f = foreign(draw, &mut stand, name, 0, 25.0);
        let Change::Edges(first, edges) = &f.change else {
            panic!("{name} has no edges")
        };
        hold_edges(name, &stand, *first, edges, f.strength);
    }
}

/// Every effect of the set, drawn as the campaign draws: as strong as wanted, or as large as may be.
#[test]
fn the_third_set_is_as_strong_as_wanted_or_as_large_as_may_be() {
    for name in NAMES {
        let mut weak = 0;
        for index in 0..STRENGTHS {
            let draw = &mut Draw::of(20_261_121, 18, index);
            let mut stand = stand(draw, name);
            let axis = draw.of_many(3);
            let wanted = draw.by_ratio(25.0, 40.0);
            let f = foreign(draw, &mut stand, name, axis, wanted);
            if let Change::Add(signal) = &f.change {
                assert!(signal.iter().all(|v| v.is_finite()), "{name}");
            }
            let large = rms(&f);
            assert!(large <= 1.001 * LARGEST_RMS, "{name}: {large} deg/s");
            let kept = (f.strength / wanted - 1.0).abs() < 0.01;
            match name {
                "two codes of the part in one" => assert!(f.strength > 25.0, "{}", f.strength),
                _ if large > 0.999 * LARGEST_RMS => weak += usize::from(f.strength < 25.0),
                _ => assert!(kept, "{name}: d' {} for {wanted}", f.strength),
            }
        }
        println!("{name}: {weak} of {STRENGTHS} stay below d' 25");
    }
}

#[test]
fn each_of_the_third_set_acts_on_its_channel_and_leaves_the_others() {
    act_on_their_channel_alone(&NAMES, 19, 0.05);
}
