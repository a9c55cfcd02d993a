use super::*;
use crate::foreign::kept_back_twelfth::tests::alike;
use crate::stand::Needs;

pub(super) fn stand(index: u64) -> (Draw, Stand) {
    let mut draw = Draw::of(20_261_122, 150, index);
    let stand = Stand::draw(&mut draw, 600.0, 20.0, Needs::default());
    (draw, stand)
}

/// Where the command has been 0 for so many readings: the last of them.
fn rests(stand: &Stand, readings: usize) -> Vec<usize> {
    let all = stand.world.duty.windows(readings).enumerate();
    let at: Vec<usize> = all
        .filter(|(_, w)| w.iter().all(|d| *d == 0.0))
        .map(|(i, _)| i + readings - 1)
        .collect();
    assert!(!at.is_empty(), "no rest");
    at
}

#[test]
fn converters_that_take_turns_differ_by_the_rate_and_slip() {
    let (mut draw, mut stand) = stand(0);
    let y = converters(&mut draw, &mut stand);
    let turning = y
        .windows(2)
        .filter(|w| w[0].abs() > 0.05 && w[1].abs() > 0.05);
    let signs: Vec<bool> = turning.map(|w| w[0] * w[1] < 0.0).collect();
    let share = signs.iter().filter(|s| **s).count() as f64 / signs.len() as f64;
    assert!((0.75..1.0).contains(&share), "{share}");
    // A motor of 1.5 s is at a two-hundredth of its speed 8 s later.
    for i in rests(&stand, 160) {
        assert!(y[i].abs() < 0.006);
    }
}

#[test]
fn a_scale_factor_errs_about_one_temperature() {
    let (mut draw, mut stand) = stand(1);
    let y = modes(&mut draw, &mut stand, 2);
    let own = &stand.world.temperature[2];
    let (low, span) = (extremes(own).0, swing(own));
    let in_tenths: Vec<f64> = (0..10)
        .map(|k| {
            let tenth = |t: f64| ((t - low) / span * 10.0) as usize == k;
            let all = y.iter().zip(own).filter(|(_, t)| tenth(**t));
            all.map(|(y, _)| y.abs()).fold(0.0, f64::max)
        })
        .collect();
    let most = extremes(&in_tenths).1;
    assert!(in_tenths[2..8].contains(&most), "{in_tenths:?}");
    assert!(in_tenths[0] < 0.8 * most && in_tenths[9] < 0.8 * most);
}

#[test]
fn what_a_difference_could_not_hold_is_missing_until_the_key_frame() {
    let (mut draw, mut stand) = stand(2);
    let y = differences(&mut draw, &mut stand);
    let back = |i: &usize| y[*i] == 0.0 && y[i - 1].abs() > 1e-9;
    let key_frames: Vec<usize> = (1..y.len()).filter(back).collect();
    let every = (20..=160).find(|n| key_frames.iter().all(|k| k % n == 0));
    assert!(key_frames.len() > 20 && every.is_some(), "{key_frames:?}");
}

#[test]
fn a_coarse_thermometer_leaves_teeth_of_one_height() {
    let (mut draw, mut stand) = stand(3);
    let y = coarse(&mut draw, &mut stand, 0);
    let (low, high) = extremes(&y);
    assert!((-0.5..-0.4).contains(&low) && (0.4..=0.5).contains(&high));
    let falls = y.windows(2).filter(|w| (w[1] - w[0]).abs() > 0.8).count();
    assert!(falls > 20, "{falls}");
}

#[test]
fn a_cable_jumps_while_the_table_turns_forward_alone() {
    let (mut draw, mut stand) = stand(4);
    for _ in 0..5 {
        let y = edge(&mut draw, &mut stand);
        let most = extremes(&y).1;
        let back = stand.world.duty.windows(100);
        let mut seen = 0;
        for (i, w) in back.enumerate() {
            if w.iter().all(|d| *d < 0.0) {
                seen += 1;
                // A motor of 1.5 s turns back within 3 s, and a ring is over 2 s later.
                assert!(y[i + 99].abs() < 0.1 * most, "{}", y[i + 99]);
            }
        }
        assert!(most > 0.0 && seen > 0);
    }
}

#[test]
fn a_rubber_leans_out_and_back_by_as_much() {
    let (mut draw, mut stand) = stand(5);
    let y = rubber(&mut draw, &mut stand);
    let mut leans = 0.0;
    let path: Vec<f64> = y
        .iter()
        .map(|v| {
            leans += v;
            leans
        })
        .collect();
    let (low, high) = extremes(&path);
    let sign = if high > -low { 1.0 } else { -1.0 };
    assert!(path.iter().all(|p| sign * p > -0.2 * (high - low)));
    for i in rests(&stand, 200) {
        assert!(y[i].abs() < 0.1 * extremes(&y).1);
    }
}

#[test]
fn cages_ripple_as_fast_as_the_table_turns_and_beat() {
    let (mut draw, mut stand) = stand(6);
    let y = cages(&mut draw, &mut stand);
    let (low, high) = extremes(&y);
    assert!(low < -0.5 && high > 0.5 && high <= 2.0 && low >= -2.0);
    for i in rests(&stand, 160) {
        assert!(y[i].abs() < 0.02);
    }
}

#[test]
fn light_comes_in_at_some_angles_alone() {
    let (mut draw, mut stand) = stand(7);
    for _ in 0..5 {
        let y = lamps(&mut draw, &mut stand);
        let (low, high) = extremes(&y);
        // In the dark it is what the mean has been taken off.
        let dark = |end: f64| y.iter().filter(|v| (*v - end).abs() < 1e-9).count();
        assert!(dark(low).max(dark(high)) > y.len() / 50);
    }
}

#[test]
fn a_limit_cycle_is_as_large_as_the_rate() {
    let (mut draw, mut stand) = stand(8);
    let y = limit_cycle(&mut draw, &mut stand);
    assert!(y.iter().all(|v| v.abs() <= 1.0) && extremes(&y).1 > 0.5);
    assert!(alike(&y, &stand.world.duty).abs() < 0.3);
    for i in rests(&stand, 160) {
        assert!(y[i].abs() < 0.01);
    }
}

#[test]
fn a_zero_is_led_to_a_steady_turn_and_stands_while_the_rate_changes() {
    let (mut draw, mut stand) = stand(9);
    let y = steady(&mut draw, &mut stand);
    let duty = &stand.world.duty;
    let (mut stood, mut led) = (0, 0);
    for i in 1..duty.len() - 8 {
        if (duty[i] - duty[i - 1]).abs() > 0.5 {
            // The slowest motor moves by more than the widest window within the shortest wait, of 8 readings.
            assert_eq!(y[i + 8].to_bits(), y[i + 7].to_bits());
            stood += 1;
        } else if y[i] != y[i - 1] {
            led += 1;
        }
    }
    assert!(stood > 20 && led > 1000, "{stood} {led}");
}

#[test]
fn a_charge_grows_with_either_sense_and_is_lost_the_slower_the_later() {
    let (mut draw, mut stand) = stand(10);
    let y = charge(&mut draw, &mut stand);
    let turned: Vec<f64> = stand.world.duty.iter().map(|d| d * d).collect();
    let known = lagged(&turned, 3.0, stand.rate_hz);
    assert!(alike(&y, &about_mean(&known)).abs() > 0.5);
    assert!(alike(&y, &stand.world.duty).abs() < 0.3);
}

#[test]
fn a_belt_jumps_against_the_change_and_not_at_small_ones() {
    let (mut draw, mut stand) = stand(11);
    let y = tooth(&mut draw, &mut stand);
    let duty = &stand.world.duty;
    let (mut jumps, mut holds) = (0, 0);
    for i in 1..duty.len() {
        let change = duty[i] - duty[i - 1];
        // A slip that is going on dies away.
        let jumped = y[i].abs() > y[i - 1].abs();
        if change != 0.0 && jumped {
            // The least that a belt holds.
            assert!(y[i] * change < 0.0 && change.abs() > 0.4 * 0.4);
            jumps += 1;
        } else if change != 0.0 {
            // Beyond the most that one holds it would have jumped.
            assert!(change.abs() < 0.8 * 1.6);
            holds += 1;
        }
    }
    assert!(jumps > 10 && holds > 5, "{jumps} {holds}");
}

#[test]
fn a_range_is_left_at_a_lower_rate_than_it_is_taken_at() {
    let (mut draw, mut stand) = stand(12);
    let y = range(&mut draw, &mut stand);
    let at_rest = rests(&stand, 160);
    assert!(
        at_rest
            .iter()
            .all(|i| y[*i].to_bits() == y[at_rest[0]].to_bits())
    );
    let switched = y.windows(2).filter(|w| (w[1] - w[0]).abs() > 0.3).count();
    assert!(switched > 20, "{switched}");
}

#[test]
fn oil_rings_on_after_the_table_has_come_to_rest() {
    let (mut draw, mut stand) = stand(13);
    let y = slosh(&mut draw, &mut stand);
    let (low, high) = extremes(&y);
    assert!(low < 0.0 && high > 0.0);
    let rings = rests(&stand, 60).iter().any(|i| y[*i].abs() > 0.1 * high);
    assert!(rings);
}
