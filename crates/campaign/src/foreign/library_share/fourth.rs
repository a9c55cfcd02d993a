//! The fourth set against the library, a sum of two of its effects included.

use super::super::kept_back_fourth::{NAMES, codes, noise};
use super::*;

/// Those whose shape is a signal that could be known.
const SIGNALS: u64 = 11;

#[test]
fn no_effect_of_the_library_nor_two_describe_a_signal_of_the_fourth_set() {
    hold_signals(NAMES, 24, SIGNALS);
}

#[test]
fn no_process_of_the_library_describes_noise_that_ends_at_an_edge() {
    for index in 0..DRAWS {
        let draw = &mut Draw::of(20_261_121, 25, index);
        let name = "noise that ends at an edge";
        let stand = stand(draw, name);
        let axis = draw.of_many(3);
        for (edge_hz, order) in [(1.5, 4), (1.5, 8), (3.0, 6), (5.0, 4), (7.5, 4), (7.5, 8)] {
            let part = noise::Edge::new(edge_hz, order, stand.rate_hz);
            hold_noise(name, &stand, axis, &|w| part.density(w));
        }
    }
}

#[test]
fn no_law_of_variance_of_the_library_describes_those_of_the_fourth_set() {
    for name in [
        "noise as large as the acceleration",
        "noise after each change of the command",
    ] {
        for index in 0..DRAWS {
            let draw = &mut Draw::of(20_261_121, 26, index);
            hold_variance(draw, name);
        }
    }
}

/// Readings that come again at random describe the repeats, not that small steps are missing.
#[test]
fn no_stale_samples_describe_a_reading_that_is_renewed_beyond_a_threshold() {
    for index in 0..DRAWS {
        let draw = &mut Draw::of(20_261_121, 27, index);
        let name = "reading that is renewed beyond a threshold";
        let mut stand = stand(draw, name);
        let f = foreign(draw, &mut stand, name, 0, 25.0);
        let Change::Holds(beyond) = f.change else {
            panic!("{name} holds nothing")
        };
        let (_, even) = codes::law(&stand, 0);
        let steps = codes::steps(&stand, 0, beyond);
        let shares = codes::long_run(&steps, &even);
        let against = |stale: f64| {
            let law = |from: usize, to: usize| {
                stale * f64::from(u8::from(from == to)) + (1.0 - stale) * even[to]
            };
            codes::of_steps(&steps, &shares, &law, stand.samples()).powi(2)
        };
        let whole = against(0.0);
        assert!((whole.sqrt() - f.strength).abs() < 1e-6);
        let least = (1..400)
            .map(|k| against(f64::from(k) / 1000.0))
            .fold(f64::INFINITY, f64::min);
        println!("beyond {beyond:.2} counts");
        hold(name, "stale_samples", 1.0 - least / whole);
    }
}

/// The other axis of the same instant, which is what the library has, tells nothing of the one that came late: white noise
/// of another frame. What both have of a slow wander is a little.
#[test]
fn no_cross_axis_describes_another_axis_that_comes_late() {
    for index in 0..DRAWS {
        let draw = &mut Draw::of(20_261_121, 28, index);
        let name = "another axis, frames late";
        let mut stand = stand(draw, name);
        let f = foreign(draw, &mut stand, name, 0, 25.0);
        let Change::Late {
            axis,
            share,
            frames,
        } = f.change
        else {
            panic!("{name} adds no other axis")
        };
        assert!(share.abs() < 1.0 && (f.strength - 25.0).abs() < 0.1);
        let mut walk = 0.0;
        let other: Vec<f64> = (0..stand.samples() + frames)
            .map(|_| {
                walk += stand.step(axis).sqrt() * draw.normal();
                walk + stand.white(axis).sqrt() * draw.normal()
            })
            .collect();
        let meter = Meter::new(&stand, 0);
        let late: Vec<f64> = other[..stand.samples()].iter().map(|v| share * v).collect();
        let now = other[frames..].to_vec();
        let gain = |s: &[f64]| meter.of_signal(&meter.energy(s)).powi(2);
        // As strong as its expectation says: chi-square of 12 000 degrees.
        let whole = gain(&late);
        assert!(
            (whole.sqrt() / f.strength - 1.0).abs() < 0.1,
            "{} {}",
            whole.sqrt(),
            f.strength
        );
        hold(
            name,
            "cross_axis",
            1.0 - gain(&meter.beyond(&late, &[now])) / whole,
        );
    }
}

/// What frames of another axis have in common with it, in a straight line.
#[test]
fn no_cross_axis_describes_frames_that_hold_another_axis() {
    for index in 0..DRAWS {
        let draw = &mut Draw::of(20_261_121, 29, index);
        let name = "frames that hold another axis";
        let mut stand = stand(draw, name);
        let f = foreign(draw, &mut stand, name, 0, 25.0);
        let Change::Frames { axis, chance } = f.change else {
            panic!("{name} takes no frames")
        };
        assert!((codes::of_exchanged(&stand, 0, axis, chance) - f.strength).abs() < 1e-9);
        assert!((f.strength - 25.0).abs() < 0.1 && chance < 0.3, "{chance}");
        let (own, its) = (stand.white(0), stand.white(axis));
        let apart = (stand.bias[0] - stand.bias[axis]).powi(2);
        let variance = (1.0 - chance) * own + chance * its + chance * (1.0 - chance) * apart;
        let correlation_squared = chance * chance * its / variance;
        let line = -(stand.samples() as f64) * (-correlation_squared).ln_1p();
        hold(name, "cross_axis", line / f.strength.powi(2));
    }
}

#[test]
fn the_fourth_set_is_as_strong_as_wanted_or_as_large_as_may_be() {
    are_as_strong_as_wanted(&NAMES, 30);
}

#[test]
fn each_of_the_fourth_set_acts_on_its_channel_and_leaves_the_others() {
    act_on_their_channel_alone(&NAMES, 31, 0.005);
}

#[test]
fn a_reading_that_stands_another_axis_and_its_frames_come_as_they_are_said_to() {
    let draw = &mut Draw::of(20_261_121, 32, 0);
    let stand = stand(draw, "");
    let record = stand.record(&[], 7).expect("a stand can be simulated");
    let counts = |r: &model::record::Record, axis: usize| -> Vec<i32> {
        let name = crate::stand::GYROS[axis];
        let channel = r.channels.iter().find(|c| c.name == name);
        channel
            .and_then(|c| c.counts.clone())
            .expect("gyros have counts")
    };
    let mut acted = |change: Change| {
        let (name, mut record) = ("", record.clone());
        let f = super::super::Foreign {
            name,
            strength: 0.0,
            change,
        };
        f.act(&mut record, crate::stand::GYROS[0], &stand, 0, draw);
        counts(&record, 0)
    };
    let held = acted(Change::Holds(2.6));
    assert!(
        held.windows(2)
            .all(|w| w[0] == w[1] || (w[0] - w[1]).abs() > 2)
    );
    let (own, other) = (counts(&record, 0), counts(&record, 2));
    let taken = acted(Change::Frames {
        axis: 2,
        chance: 0.25,
    });
    let (mut its, mut unlike) = (0, 0);
    for ((t, a), b) in taken.iter().zip(&own).zip(&other) {
        assert!(t == a || t == b);
        unlike += usize::from(a != b);
        its += usize::from(t == b && a != b);
    }
    let share = its as f64 / unlike as f64;
    assert!((share - 0.25).abs() < 0.03, "{share}");
    let late = acted(Change::Late {
        axis: 2,
        share: -0.5,
        frames: 3,
    });
    let mean = |v: &[i32]| v.iter().map(|c| f64::from(*c)).sum::<f64>() / v.len() as f64;
    let middle = mean(&other);
    for i in 3..own.len() {
        let added = f64::from(late[i] - own[i]);
        let asked = -0.5 * (f64::from(other[i - 3]) - middle);
        assert!((added - asked).abs() <= 1.0, "{added} {asked}");
    }
}
