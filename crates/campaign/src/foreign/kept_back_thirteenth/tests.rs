use super::*;
use crate::foreign::extremes;
use crate::foreign::kept_back_twelfth::tests::alike;
use crate::stand::Needs;

pub(super) fn stand(index: u64) -> (Draw, Stand) {
    let mut draw = Draw::of(20_261_122, 140, index);
    let stand = Stand::draw(&mut draw, 600.0, 20.0, Needs::default());
    (draw, stand)
}

fn mean_square(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64
}

#[test]
fn clocks_apart_show_the_change_of_the_rate_with_either_sign() {
    let (mut draw, mut stand) = stand(0);
    let y = clock(&mut draw, &mut stand);
    let (low, high) = extremes(&y);
    // The drive's ramp is 0.6 a second at most.
    let most = 0.6 / stand.rate_hz;
    assert!(low < 0.0 && high > 0.0 && -low <= most && high <= most);
    // Ramps take 2 s for the whole span at 0.6 a second, and 14 s at 0.15, and some dwells are longer.
    let still = y.iter().filter(|v| **v == 0.0).count();
    assert!(still > y.len() / 20, "{still}");
}

#[test]
fn a_table_that_creeps_stands_and_jerks_and_comes_along_in_the_mean() {
    for index in 0..5 {
        let (mut draw, mut stand) = stand(index);
        let y = friction(&mut draw, &mut stand);
        let duty = &stand.world.duty;
        let held = |i: &usize| duty[*i] != 0.0 && (y[*i] + duty[*i]).abs() < 1e-12;
        let slips = |i: &usize| y[*i] * duty[*i] > 0.0 && y[*i].abs() > duty[*i].abs();
        let count = |of: &dyn Fn(&usize) -> bool| (0..y.len()).filter(|i| of(i)).count();
        let (held, slips) = (count(&held), count(&slips));
        assert!(held > 1000 && slips > 200, "{held} {slips}");
        // What it is behind is the give of the belt, some seconds of the least creep.
        let mut behind = 0.0f64;
        for v in &y {
            behind += v / stand.rate_hz;
            assert!(behind.abs() < 0.5, "{behind}");
        }
    }
}

#[test]
fn a_belt_is_still_while_the_table_rests_and_swings_to_either_side() {
    let (mut draw, mut stand) = stand(2);
    let y = belt(&mut draw, &mut stand);
    let (low, high) = extremes(&y);
    assert!(low < 0.0 && high > 0.0);
    let rests = stand.world.duty.windows(160);
    let mut seen = 0;
    for (i, w) in rests.enumerate() {
        // It dies away by the half width, over 8 s by a factor e^2 and more.
        if w.iter().all(|d| *d == 0.0) {
            seen += 1;
            assert!(mean_square(&y[i + 140..i + 160]) < 0.5 * mean_square(&y[i..i + 40]) + 1e-9);
        }
    }
    assert!(seen > 0, "no rest");
}

#[test]
fn a_zero_follows_slow_turns_and_stands_in_fast_ones() {
    let (mut draw, mut stand) = stand(3);
    let y = slow_turns(&mut draw, &mut stand);
    let duty = &stand.world.duty;
    let slow = duty.iter().fold(
        0.0f64,
        |m, d| {
            if d.abs() < 0.225 { m.max(d.abs()) } else { m }
        },
    );
    assert!(y.iter().all(|v| v.abs() < 0.25));
    // A motor takes 1.5 s at most to get beyond the threshold.
    let (mut stood, mut moved) = (0, 0);
    for (i, w) in duty.windows(60).enumerate() {
        let same = y[i + 58] == y[i + 59];
        if w.iter().all(|d| d.abs() > 2.0 * slow && *d == w[0]) {
            assert!(same, "{i}");
            stood += 1;
        } else if w.iter().all(|d| *d != 0.0 && d.abs() <= slow && *d == w[0]) {
            moved += usize::from(!same);
        }
    }
    assert!(stood > 50 && moved > 50, "{stood} {moved}");
}

#[test]
fn a_chain_kicks_at_any_speed_alike_and_not_at_rest() {
    let (mut draw, mut stand) = stand(4);
    let y = chain(&mut draw, &mut stand);
    let (low, high) = extremes(&y);
    assert!(low < 0.0 && high > 0.0);
    let mut seen = 0;
    for (i, w) in stand.world.duty.windows(100).enumerate() {
        if w.iter().all(|d| *d == 0.0) {
            seen += 1;
            assert!(mean_square(&y[i + 80..i + 100]) < 1e-2 * mean_square(&y));
        }
    }
    assert!(seen > 0, "no rest");
}

#[test]
fn what_a_mount_makes_of_a_shaking_is_squared_and_rings_on() {
    let (mut draw, mut stand) = stand(5);
    let y = mount(&mut draw, &mut stand);
    let (low, high) = extremes(&y);
    let (few, most) = (low.abs().min(high), low.abs().max(high));
    assert!(most > 4.0 * few, "{low} {high}");
    // It is none of the squares of the accelerations themselves.
    for acc in &stand.world.acc {
        let square: Vec<f64> = about_mean(acc).iter().map(|a| a * a).collect();
        // An axis along which nothing shakes has none.
        assert!(mean_square(&square) < 1e-9 || alike(&y, &square).abs() < 0.8);
    }
}

#[test]
fn traps_know_the_sense_and_stay_as_they_are_at_low_rates() {
    let (mut draw, mut stand) = stand(6);
    let y = sense(&mut draw, &mut stand);
    let mut seen = 0;
    for (i, w) in stand.world.duty.windows(80).enumerate() {
        // 4 s after it was stopped, a motor of 1.5 s is below 0.1.
        if w.iter().all(|d| *d == 0.0) {
            seen += 1;
            assert_eq!(y[i + 78].to_bits(), y[i + 79].to_bits());
        }
    }
    assert!(seen > 0, "no rest");
    let (low, high) = extremes(&y);
    // Four traps, each between full of one sense and of the other.
    assert!(high - low > 2.0 && high - low <= 8.0);
}

#[test]
fn a_table_out_of_balance_is_pushed_as_hard_as_its_weight_and_not_at_rest() {
    let (mut draw, mut stand) = stand(7);
    let y = unbalanced(&mut draw, &mut stand);
    let (low, high) = extremes(&y);
    assert!(low < 0.0 && high > 0.0 && low >= -0.08 && high <= 0.08);
    let mut seen = 0;
    for (i, w) in stand.world.duty.windows(80).enumerate() {
        if w.iter().all(|d| *d == 0.0) {
            seen += 1;
            assert!(y[i + 79].abs() <= y[i].abs() * 0.1 + 1e-12);
        }
    }
    assert!(seen > 0, "no rest");
}

#[test]
fn cogging_is_larger_at_low_rates_and_none_at_rest() {
    let (mut draw, mut stand) = stand(8);
    let y = cogging(&mut draw, &mut stand);
    let (mut rest, mut slow, mut fast) = (vec![], vec![], vec![]);
    for (y, w) in y[99..].iter().zip(stand.world.duty.windows(100)) {
        let (rate, same) = (w[99].abs(), w.iter().all(|d| *d == w[99]));
        if same && rate == 0.0 {
            rest.push(*y);
        } else if same && (0.05..0.35).contains(&rate) {
            slow.push(*y);
        } else if same && rate > 0.6 {
            fast.push(*y);
        }
    }
    assert!(rest.len() > 100 && slow.len() > 100 && fast.len() > 100);
    assert!(mean_square(&slow) > mean_square(&fast));
    assert!(mean_square(&rest) < 0.1 * mean_square(&slow));
}

#[test]
fn a_sample_droops_the_more_the_warmer_it_is() {
    let (mut draw, mut stand) = stand(9);
    let y = droop(&mut draw, &mut stand, 1);
    let own = &stand.world.temperature[1];
    let (cold, warm) = extremes(own);
    let of = |near: &dyn Fn(f64) -> bool| {
        let some: Vec<f64> = y
            .iter()
            .zip(own)
            .filter(|(_, t)| near(**t))
            .map(|(y, _)| *y)
            .collect();
        let (low, high) = extremes(&some);
        high - low
    };
    let third = (warm - cold) / 3.0;
    let (cold, warm) = (of(&|t| t < cold + third), of(&|t| t > warm - third));
    assert!(warm > 1.1 * cold, "{cold} {warm}");
}
