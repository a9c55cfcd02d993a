//! The tenth set against the library, a sum of two of its effects included.

use super::super::kept_back::shaped;
use super::super::kept_back_fourth::codes::{law, long_run};
use super::super::kept_back_tenth::codes::{dead_zone, limit_of, of_limit, ranges, steps_of_limit};
use super::super::kept_back_tenth::{NAMES, noise};
use super::codes::{hold_stage, hold_steps};
use super::*;

/// Those whose shape is a signal that could be known, the narrow band's as it came out included.
const SIGNALS: u64 = 13;

#[test]
fn no_effect_of_the_library_nor_two_describe_a_signal_of_the_tenth_set() {
    hold_signals(NAMES, 101, SIGNALS);
}

#[test]
fn no_law_of_variance_of_the_library_describes_those_of_the_tenth_set() {
    type Shape = fn(&mut Draw, &mut Stand) -> Vec<f64>;
    let all: [(&str, Shape); 2] = [
        ("brushes that spark when the command changes", noise::sparks),
        (
            "noise by the magnitude of the table's rate",
            noise::squared_rate,
        ),
    ];
    for (name, shape) in all {
        for index in 0..DRAWS {
            let draw = &mut Draw::of(20_261_122, 102, index);
            let mut stand = stand(draw, name);
            let shape = shape(draw, &mut stand);
            let of = |size: f64| -> Vec<f64> { shape.iter().map(|s| 1.0 + size * s).collect() };
            let size = crate::strength::size_for(25.0, &|s| of_variance(&of(s)));
            hold_law(name, &stand, &of(size));
        }
    }
}

/// A process of this density beside the noise of an axis 0, of 25, against every process of the library.
pub(super) fn hold_beside(name: &str, stand: &Stand, density: &dyn Fn(f64) -> f64) {
    let meter = Meter::new(stand, 0);
    let of = |variance: f64| -> Vec<f64> {
        let one = |w: &f64| variance * density(*w);
        meter.omega().iter().map(one).collect()
    };
    let variance = crate::strength::size_for(25.0, &|v| meter.of_density(&of(v)));
    let beside = |w: f64| 1.0 + variance * density(w) / stand.white(0);
    let expected = spectrum(stand, 0, &beside, &[]);
    let own = saturated(stand, &expected);
    for effect in EFFECTS {
        let share = of_process(stand, 0, &expected, own, *effect);
        hold(name, effect.id(), share);
    }
}

#[test]
fn no_process_of_the_library_describes_the_noise_of_the_tenth_set() {
    for index in 0..DRAWS {
        let draw = &mut Draw::of(20_261_122, 103, index);
        let name = "quantisation of an angle that is differenced";
        let stand = stand(draw, name);
        hold_noise(name, &stand, 0, &|w| 1.0 + noise::by_difference(1.0, w));
        let name = "narrow band that a fan drives";
        let mode = (draw.by_ratio(0.8, 8.5), draw.by_ratio(0.05, 0.4));
        hold_beside(name, &stand, &|w| noise::of_mode(mode, stand.rate_hz, w));
    }
}

/// Not even the whole of its mean spectrum describes what is filled up.
#[test]
fn no_filter_describes_a_lower_rate_that_is_filled_up() {
    let draw = &mut Draw::of(20_261_122, 104, 0);
    let name = "lower rate filled up by straight lines";
    let stand = stand(draw, name);
    for ratio in [0.5, 0.58, 0.67, 0.76, 0.85, 0.95] {
        let n = stand.samples();
        let strength = |share: f64| noise::of_filled(ratio, share, n);
        let share = crate::strength::size_for(25.0, &strength);
        println!("{name}: ratio {ratio}, {share:.2} of the noise");
        assert!((strength(share) / 25.0 - 1.0).abs() < 0.01);
        let mean =
            |apart| noise::mean_covariance(ratio, n, apart) / noise::mean_covariance(ratio, n, 0);
        let r = [mean(1), mean(2), mean(3)];
        let density = |w: f64| {
            let waves = r
                .iter()
                .zip(1..)
                .map(|(r, k)| 2.0 * r * (f64::from(k) * w).cos());
            share * waves.sum::<f64>()
        };
        let whole = shaped(&stand, 0, &density).powi(2) / 25.0f64.powi(2);
        hold(name, "any stationary process", whole);
    }
}

#[test]
fn no_bit_rail_filter_or_stale_sample_describes_the_readings_of_the_tenth_set() {
    for index in 0..DRAWS {
        let draw = &mut Draw::of(20_261_122, 105, index);
        let stand = stand(draw, NAMES[0]);
        let dead = dead_zone(draw, &stand, 0);
        hold_stage("dead zone about zero rate", &stand, &dead);
        let beyond = ranges(draw, &stand, 0);
        hold_stage("other gain and offset beyond a rate", &stand, &beyond);
        let name = "slew limit of the output stage";
        let of = |steep: f64| of_limit(&stand, 0, limit_of(steep));
        let limit = limit_of(crate::strength::size_for(25.0, &of));
        println!("{name}: {limit:.2} counts");
        let (first, even) = law(&stand, 0);
        let steps = steps_of_limit(&stand, 0, limit);
        let shares = long_run(&steps, &even);
        hold_steps(name, &stand, first, &steps, &shares);
    }
}

#[test]
fn the_tenth_set_is_as_strong_as_wanted_or_as_large_as_may_be() {
    are_as_strong_as_wanted(&NAMES, 106);
}

#[test]
fn each_of_the_tenth_set_acts_on_its_channel_and_leaves_the_others() {
    act_on_their_channel_alone(&NAMES, 107, 0.005);
}
