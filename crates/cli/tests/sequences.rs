//! The calibration sequences on simulated stands with planted physics: what they find holds it, what they cannot use is refused,
//! what they write is what a board takes.
#![cfg(unix)]

mod common;

use bench::{Fault, Pose, Scenario};
use imu_stand::calibrate::{
    Heater, Outcome, SequenceError, SixPosition, Told, Turns, heater, merged, six_position, turns,
};
use imu_stand::export::board::BoardCorrection;
use imu_stand::link::Link;
use imu_stand::stand::{Board, Simulated};
use model::ModelFile;

/// A board on a stand, as fast as it is computed.
fn link(scenario: Scenario) -> Link {
    let port = Simulated::start(Board::Native, scenario);
    Link::over(Box::new(port), "the simulated stand", 38_400)
}

/// Half a minute and more on each side; `off` is how far from flat they lie.
fn sides(first_s: f64, each_s: f64, off: f64) -> Vec<Pose> {
    let ups = [
        [1.0, off, 0.0],
        [-1.0, 0.0, off],
        [off, 1.0, 0.0],
        [0.0, -1.0, -off],
        [0.0, off, -1.0],
    ];
    let poses = ups.into_iter().enumerate().map(|(k, up)| Pose {
        at_s: first_s + each_s * k as f64,
        turn_s: 2.0,
        up,
    });
    poses.collect()
}

fn found<'a>(outcome: &'a Outcome, channel: &str, what: &str) -> &'a model::Parameter {
    let all = &outcome.identified;
    let one = all
        .iter()
        .find(|i| i.channel == channel && i.what.starts_with(what));
    &one.unwrap_or_else(|| panic!("no {what} of {channel} in {all:#?}"))
        .size
}

/// How many standard errors it is off.
fn off(size: &model::Parameter, planted: f64) -> f64 {
    (size.value - planted) / size.std_error.expect("an error")
}

const HOW: SixPosition = SixPosition {
    seconds: 30.0,
    within: 120.0,
};

#[test]
fn six_positions_tell_accelerometers_and_g_sensitivity() {
    let planted = [[0.4, -0.1, 0.2], [0.0, 0.3, 0.0], [-0.2, 0.0, 0.1]];
    let (mut distances, mut widths) = (Vec::new(), Vec::new());
    for seed in 1..=6 {
        let mut scenario = Scenario::quiet(seed);
        scenario.base.poses = sides(45.0, 45.0, 0.1);
        for (gyro, g) in scenario.gyros.iter_mut().zip(planted) {
            gyro.g_sensitivity_dps_g = g;
        }
        let acc = scenario.acc.clone();
        let scales = scenario.gyros.clone().map(|gyro| 1.0 + gyro.scale_error);
        let mut told = Vec::new();
        let outcome =
            six_position(&mut link(scenario), HOW, &mut |t| told.push(t)).expect("it is done");
        assert!(
            told.iter().filter(|t| matches!(t, Told::Do(_))).count() == 6,
            "{told:?}"
        );
        for (k, axis) in ["x", "y", "z"].into_iter().enumerate() {
            let channel = format!("acc_{axis}");
            // A converter that cuts off reads half a count low.
            let zero = 512.0 + acc.zero_g_error_v[k] / 3.3 * 1024.0 - 0.5;
            let scale = 0.8 / 3.3 * 1024.0 * (1.0 + acc.scale_error[k]);
            let (z, s) = (
                found(&outcome, &channel, "zero"),
                found(&outcome, &channel, "scale"),
            );
            assert!(
                (z.value - zero).abs() < 0.7 && (s.value - scale).abs() < 0.7,
                "{seed} {channel}: {z:?} {zero}, {s:?} {scale}"
            );
            for (j, along) in ["x", "y", "z"].into_iter().enumerate() {
                let size = found(
                    &outcome,
                    &format!("gyro_{axis}"),
                    &format!("g-sensitivity along {along}"),
                );
                distances.push(off(size, planted[k][j] * scales[k]));
                widths.push(1.96 * size.std_error.unwrap());
            }
        }
        assert!(
            outcome
                .not_identified
                .iter()
                .any(|what| what.contains("Earth"))
        );
    }
    // 54 intervals of 95 %: fewer than 46 would hold by chance once in 5000.
    let held = distances.iter().filter(|d| d.abs() <= 1.96).count();
    assert!(held >= 46, "{held} of {}: {distances:.1?}", distances.len());
    widths.sort_by(f64::total_cmp);
    assert!(widths[27] < 0.1, "deg/s/g: {:?}", widths[27]);
}

#[test]
fn a_floor_that_shakes_widens_the_intervals_and_stops_nothing() {
    for seed in 1..=4 {
        let mut scenario = Scenario::lively(seed);
        scenario.base.floor_g_rms = 0.08;
        scenario.base.poses = sides(45.0, 45.0, 0.1);
        scenario.gyros[2].g_sensitivity_dps_g = [0.0, 0.4, 0.0];
        let outcome = six_position(&mut link(scenario), HOW, &mut |_| {}).expect("it is done");
        let size = found(&outcome, "gyro_z", "g-sensitivity along y");
        assert!(off(size, 0.4).abs() < 4.0, "{seed}: {size:?}");
        let zero = found(&outcome, "acc_x", "zero");
        // 0.08 g of 10 Hz and less are 20 counts: a quarter of a count over 30 s and two sides, at the least.
        assert!((0.2..3.0).contains(&zero.std_error.unwrap()), "{zero:?}");
    }
}

#[test]
fn a_side_that_is_not_still_not_flat_or_not_new_is_refused() {
    let mut scenario = Scenario::quiet(3);
    let mut poses = sides(45.0, 45.0, 0.05);
    // Upright once more in between, then askew, before the second side; and a shove while the third is recorded.
    poses.insert(
        1,
        Pose {
            at_s: 90.0,
            turn_s: 2.0,
            up: [0.0, 0.0, 1.0],
        },
    );
    poses.insert(
        2,
        Pose {
            at_s: 100.0,
            turn_s: 2.0,
            up: [0.7, 0.0, 0.7],
        },
    );
    for pose in &mut poses[3..] {
        pose.at_s += 25.0;
    }
    scenario.base.poses = poses;
    scenario = scenario.with(Fault::Shove {
        axis: 2,
        time_s: 124.0,
        peak_dps: 20.0,
        length_s: 1.0,
    });
    // Of the side that was shoved enough stays to be recorded anew.
    let how = SixPosition {
        seconds: 12.0,
        ..HOW
    };
    let mut told = Vec::new();
    let outcome =
        six_position(&mut link(scenario), how, &mut |t| told.push(t)).expect("it is done");
    let refused = outcome.refused.join("\n");
    assert!(
        refused.contains("not used: gyro_z turned"),
        "{refused}\n{told:#?}"
    );
    assert!(refused.contains("+z is done"), "{refused}\n{told:#?}");
    // A stand that nobody turns has no second side.
    let nobody = six_position(&mut link(Scenario::quiet(4)), how, &mut |_| {});
    let Err(SequenceError::NotDone { what, help }) = nobody else {
        panic!("{nobody:?}")
    };
    assert!(
        what.contains("left are +x, -x, +y, -y, -z") && help.contains("--within"),
        "{what} {help}"
    );
}

/// A table that turns.
fn table(seed: u64, tilt: f64) -> Scenario {
    let mut scenario = Scenario::quiet(seed);
    scenario.motor.table_ratio = 0.004;
    scenario.base.poses = vec![Pose {
        at_s: 0.0,
        turn_s: 0.05,
        up: [0.0, tilt, 1.0],
    }];
    scenario.gyros[2].scale_error = 0.008;
    scenario
        .with(Fault::Misalignment {
            gyro: 0,
            from: 2,
            share: 0.02,
        })
        .with(Fault::Misalignment {
            gyro: 1,
            from: 2,
            share: -0.01,
        })
}

#[test]
fn turns_tell_the_cross_axis_and_on_a_tilted_stand_the_scale() {
    let how = Turns {
        duty: 120,
        seconds: 60.0,
    };
    let (mut held, mut all) = (0, 0);
    for seed in 1..=5 {
        let scenario = table(seed, 0.3);
        let scales = [0, 1, 2].map(|k| 1.0 + scenario.gyros[k].scale_error);
        let outcome = turns(&mut link(scenario), how, &mut |_| {}).expect("it is done");
        let scale = found(&outcome, "gyro_z", "scale error");
        assert!(
            (scale.value - 0.008).abs() < 1e-3 && scale.std_error.unwrap() < 5e-4,
            "{seed}: {scale:?}"
        );
        // What x reads of what z reads.
        let cross = [
            ("gyro_x", 0.02 * scales[0] / scales[2]),
            ("gyro_y", -0.01 * scales[1] / scales[2]),
        ];
        for (channel, planted) in cross {
            let size = found(&outcome, channel, "share of the rate about z");
            assert!(
                (size.value - planted).abs() < 2e-3,
                "{seed} {channel}: {size:?} {planted}"
            );
            held += u32::from(off(size, planted).abs() <= 1.96);
            all += 1;
        }
        held += u32::from(off(scale, 0.008).abs() <= 1.96);
        all += 1;
    }
    // 15 intervals of 95 %: fewer than 12 by chance once in 200.
    assert!(held >= 12, "{held} of {all}");
}

#[test]
fn an_upright_table_tells_no_scale_and_one_that_stands_tells_nothing() {
    let how = Turns {
        duty: 120,
        seconds: 30.0,
    };
    let outcome = turns(&mut link(table(1, 0.0)), how, &mut |_| {}).expect("it is done");
    assert!(!outcome.identified.iter().any(|i| i.what.contains("scale")));
    let why = outcome.not_identified.join("\n");
    assert!(
        why.contains("tilt the stand") && why.contains("belt off"),
        "{why}"
    );
    let upright = found(&outcome, "gyro_x", "share of the rate about z");
    assert!((upright.value - 0.02).abs() < 2e-3, "{upright:?}");
    // Somebody lays it down while it should rest.
    let mut moved = table(1, 0.3);
    moved.base.poses[0].at_s = 4.0;
    let moved = turns(&mut link(moved), how, &mut |_| {});
    let Err(SequenceError::NotDone { what, .. }) = moved else {
        panic!("{moved:?}")
    };
    assert!(what.contains("should rest"), "{what}");
    let belt_off = turns(&mut link(Scenario::quiet(1)), how, &mut |_| {});
    let Err(SequenceError::NotDone { what, help }) = belt_off else {
        panic!("{belt_off:?}")
    };
    assert!(
        what.contains("not turned") && help.contains("belt"),
        "{what} {help}"
    );
}

#[test]
fn a_heater_cycle_tells_the_slope_and_takes_no_curvature_that_is_none() {
    let (mut held, mut all) = (0, 0);
    for seed in 1..=5 {
        let mut scenario = Scenario::quiet(seed);
        // On for the first half.
        (scenario.thermal.heater_c, scenario.thermal.heater_period_s) = (12.0, 900.0);
        let slopes = [0.2, -0.1, 0.0];
        for (gyro, slope) in scenario.gyros.iter_mut().zip(slopes) {
            gyro.tempco_dps_c = slope;
        }
        let scales = scenario.gyros.clone().map(|gyro| 1.0 + gyro.scale_error);
        let how = Heater { seconds: 900.0 };
        let outcome = heater(&mut link(scenario), how, &mut |_| {}).expect("it is done");
        for (k, axis) in ["x", "y", "z"].into_iter().enumerate() {
            let size = found(&outcome, &format!("gyro_{axis}"), "temperature, slope");
            held += u32::from(off(size, slopes[k] * scales[k]).abs() <= 1.96);
            all += 1;
            assert!(size.std_error.unwrap() < 0.02, "{size:?}");
        }
    }
    assert!(held >= 12, "{held} of {all}");
    // On the board it takes off what was planted, over all temperatures that were measured and no others.
    let mut scenario = Scenario::quiet(9);
    (scenario.thermal.heater_c, scenario.thermal.heater_period_s) = (12.0, 900.0);
    scenario.gyros[1].tempco_dps_c = 0.15;
    let biased = scenario.gyros[1].turn_on_bias_dps;
    let outcome = heater(&mut link(scenario), Heater { seconds: 900.0 }, &mut |_| {});
    let outcome = outcome.expect("it is done");
    let board = BoardCorrection::of(&merged(None, &outcome), 0x0402);
    let board = board.expect("a correction").correction;
    let [low, high] = outcome.temperatures.expect("a range");
    for celsius in [low, (low + high) / 2.0, high] {
        let counts = (celsius - 25.0) / 0.1453;
        let taken_off = board.bias[1]
            + board.temperature[1] * counts
            + board.temperature_squared[1] * counts * counts;
        let planted = biased + 0.15 * (celsius - 25.0);
        assert!(
            (taken_off + planted).abs() < 0.3,
            "{celsius}: {taken_off} {planted}"
        );
    }
    let step = 0.1453 * f64::from(wire::correction::RANGE_STEP);
    let [from, to] = board.temp_range.map(|steps| 25.0 + f64::from(steps) * step);
    assert!(
        from <= low && to >= high && to - from < high - low + 8.0,
        "{from} {to} {low} {high}"
    );
    let cold = heater(
        &mut link(Scenario::quiet(1)),
        Heater { seconds: 60.0 },
        &mut |_| {},
    );
    let Err(SequenceError::NotDone { what, help }) = cold else {
        panic!("{cold:?}")
    };
    assert!(
        what.contains("thermometer") && help.contains("heater"),
        "{what} {help}"
    );
}

#[test]
fn what_the_sequences_write_is_a_correction_that_the_board_takes() {
    let mut scenario = Scenario::quiet(2);
    scenario.base.poses = sides(45.0, 45.0, 0.1);
    scenario.gyros[1].g_sensitivity_dps_g = [0.5, 0.0, 0.0];
    let six = six_position(&mut link(scenario), HOW, &mut |_| {}).expect("it is done");
    let model = merged(None, &six);
    let turned = turns(
        &mut link(table(2, 0.3)),
        Turns {
            duty: 120,
            seconds: 30.0,
        },
        &mut |_| {},
    );
    let model = merged(Some(model), &turned.expect("it is done"));
    let model = ModelFile::parse(&model.to_toml()).expect("a model file");
    let board = BoardCorrection::of(&model, 0x0402)
        .expect("a correction")
        .correction;
    // Counts of the accelerometer: 0.5 deg/s/g over 248 counts a g.
    let per_count = 0.5 / (0.8 / 3.3 * 1024.0);
    assert!(
        (board.acc[1][0] / -per_count - 1.0).abs() < 0.2,
        "{}",
        board.acc[1][0]
    );
    // Half a minute each way: what is found, whatever the noise has made of it, goes onto the board.
    let of = |cause: &str, name: &str| {
        let found = model.effects.iter().find(|e| e.cause == cause);
        found.expect("it was found").parameters[name].clone()
    };
    let cross = of("cross_axis", "from_gyro_z");
    let scale = of("scale_error", "relative");
    assert!(off(&cross, 0.02).abs() < 4.0, "{cross:?}");
    assert!(off(&scale, 0.008).abs() < 4.0, "{scale:?}");
    assert!((board.matrix[0][2] + cross.value).abs() < 1e-9);
    assert!((board.matrix[2][2] - (1.0 / (1.0 + scale.value) - 1.0)).abs() < 1e-9);
}
