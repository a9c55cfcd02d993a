//! Tests of [`super`].

use super::*;
use crate::fit::white;

#[test]
fn they_fail_on_white_noise_as_often_as_their_chance_says() {
    let runs = 500;
    let (mut low, mut half, mut repeating) = (0, 0, 0);
    let (mut rhythmic, mut of_three, mut depending) = (0, 0, 0);
    for seed in 0..runs {
        let e = white(3000, seed);
        rhythmic += usize::from(variance_rhythm(&e, 20.0).p_value < 0.01);
        of_three += usize::from(three_readings(&e).p_value < 0.01);
        depending += usize::from(neighbours(&e, 0.0).p_value < 0.01);
        let p = bicovariance(&e).p_value;
        low += usize::from(p < 0.01);
        half += usize::from(p < 0.5);
        repeating += usize::from(period(&e, 20.0).p_value < 0.01);
    }
    // 5 and 250 are expected; the third chance is a bound, for periods share their multiples.
    assert!(low <= 15, "{low}");
    assert!((200..=300).contains(&half), "{half}");
    assert!(repeating <= 12, "{repeating}");
    assert!(
        rhythmic <= 15 && of_three <= 15 && depending <= 15,
        "{rhythmic} {of_three} {depending}"
    );
}

#[test]
fn a_square_that_is_left_behind_shows_though_nothing_correlates() {
    let e = white(6000, 3);
    let x: Vec<f64> = (1..e.len())
        .map(|i| e[i] + 0.15 * (e[i - 1] * e[i - 1] - 1.0))
        .collect();
    let found = bicovariance(&x);
    assert!(found.p_value < 1e-12, "{}", found.p_value);
    assert!(
        found.what.contains("the square 1 samples earlier"),
        "{}",
        found.what
    );
    assert!(super::super::ljung_box(&x).p_value > 1e-4);
}

#[test]
fn what_draws_small_readings_alone_to_the_one_before_shows() {
    let mut held = 0.0;
    let x: Vec<f64> = (white(6000, 16).iter())
        .map(|e| {
            let change = e - held;
            held += change * (1.0 - 0.5 * (-change * change).exp());
            held
        })
        .collect();
    let found = neighbours(&x, 0.2);
    assert!(found.p_value < 1e-9, "{}", found.p_value);
}

#[test]
fn a_product_of_two_earlier_readings_shows() {
    let e = white(6000, 12);
    let x: Vec<f64> = (2..e.len())
        .map(|i| e[i] + 0.2 * e[i - 1] * e[i - 2])
        .collect();
    let found = three_readings(&x);
    assert!(found.p_value < 1e-12, "{}", found.p_value);
    assert!(
        found.what.contains("those 1 and 2 before it"),
        "{}",
        found.what
    );
    assert!(bicovariance(&x).p_value > 1e-4);
}

#[test]
fn what_is_held_by_a_clock_of_its_own_shows_its_rhythm() {
    for (samples, share) in [(3, 0.6), (20, 0.6)] {
        let held = white(6000, 15);
        let e: Vec<f64> = (white(6000, 14).iter().enumerate())
            .map(|(i, v)| v + share * held[i / samples])
            .collect();
        let found = variance_rhythm(&e, 20.0);
        assert!(found.p_value < 1e-5, "{samples}: {}", found.p_value);
        assert!(found.what.contains("products"), "{}", found.what);
    }
}

#[test]
fn a_variance_that_beats_shows_its_rhythm() {
    let e: Vec<f64> = white(6000, 13)
        .iter()
        .enumerate()
        .map(|(i, v)| v * (1.0 + 0.25 * (0.7 * i as f64).sin()))
        .collect();
    let found = variance_rhythm(&e, 20.0);
    assert!(found.p_value < 1e-12, "{}", found.p_value);
    // 0.7 rad at 20 Hz.
    assert!(
        found.what.contains("2.22") || found.what.contains("2.23"),
        "{}",
        found.what
    );
}

#[test]
fn a_band_that_is_left_over_repeats_nothing() {
    let dct = Dct::new(6000);
    let mut u = dct.forward(&white(6000, 8));
    u[2000..2200].iter_mut().for_each(|v| *v *= 4.0);
    let found = repeats(&dct.inverse(&u)).unwrap();
    assert!(
        found.chance > 1e-3,
        "{} samples, {}",
        found.period,
        found.chance
    );
}

#[test]
fn levels_that_come_again_every_63_samples_show() {
    let mut e = white(6000, 5);
    let levels = white(63, 6);
    for (i, v) in e.iter_mut().enumerate() {
        *v += 0.3 * levels[i % 63];
    }
    let found = repeats(&e).unwrap();
    assert_eq!(found.period % 63, 0);
    assert!(found.chance < 1e-12, "{}", found.chance);
}
