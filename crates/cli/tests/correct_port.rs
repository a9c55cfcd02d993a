//! The loop on a port, `run --correct --port`: the firmware's logic behind a serial device, in real time, so that nothing in the
//! loop knows that it is simulated. What is planted there is recorded, diagnosed, corrected on the board and recorded again; what
//! the board has then is read back by another line.
//!
//! The shortest loop is a record of 60 s and one of 180 s, by the host's clock and the board's: most of the time of these tests
//! is waiting.
#![cfg(unix)]

mod common;

use std::path::Path;

use bench::scenario::MotorPart;
use bench::{Fault, Scenario};
use common::{Board, assert_success, folder, json, run};
use imu_stand::capture::{ReadOptions, read_capture};
use imu_stand::correct::in_use;
use imu_stand::export::board::{BoardCorrection, values};
use imu_stand::link::{DEFAULT_BAUD, Link};
use model::ModelFile;
use model::record::Record;
use serde_json::Value;
use wire::correction::{NUMBERS, Numbers, name};

/// Spans that a second record of 180 s is judged over, s.
const SPAN_S: f64 = 10.0;

/// The shortest loop on the board; its answer, and what it said.
fn looped(board: &Board, folder: &Path, more: &[&str]) -> (Value, String) {
    let [out, answer] = ["run.csv", "loop.json"].map(|name| folder.join(name));
    let fixed = [
        "run",
        "--correct",
        "--port",
        board.port(),
        "--seconds",
        "60",
        "--longest",
        "60",
        "--no-replicates",
        "--out",
        out.to_str().unwrap(),
        "--json",
        answer.to_str().unwrap(),
    ];
    let said = assert_success(&run(&[&fixed[..], more].concat()));
    (json(&answer), said)
}

/// The numbers that the board has in use, asked for by a line of our own.
fn read_back(board: &Board) -> Numbers {
    let mut link = Link::open(board.port(), DEFAULT_BAUD).expect("the port opens");
    let numbers = in_use(&mut link).expect("the board answers");
    numbers.expect("a correction is in use")
}

/// What the answer tells of each coefficient that has changed: its axis and name, before and after.
fn told(answer: &Value) -> Vec<(String, f64, f64)> {
    let changed = answer["correction"]["changed"].as_array().unwrap();
    let told = changed.iter().map(|change| {
        let word = |key: &str| change[key].as_str().unwrap().to_owned();
        let number = |key: &str| change[key].as_f64().unwrap();
        let what = format!("{} {}", word("axis"), word("what"));
        (what, number("before"), number("after"))
    });
    told.collect()
}

/// The board has what the model asks for, and the answer tells each coefficient of it, before and after.
fn assert_is_on_the_board(board: &Board, model: &ModelFile, answer: &Value) {
    let stored = read_back(board);
    let asked = BoardCorrection::of(model, stored[3] as u16).expect("a correction");
    // The first number holds the generation, which the board's past decides.
    assert_eq!(stored[1..], asked.numbers[1..]);
    assert_eq!(answer["correction"]["number"], asked.correction.number);
    let told = told(answer);
    let there: Vec<(String, f64, f64)> = values(&stored)
        .filter(|(place, ..)| (6..NUMBERS).contains(place))
        .map(|(place, what, _, value)| (format!("{} {what}", name(place).0), 0.0, value))
        .collect();
    assert!(!there.is_empty());
    // JSON is read to the last digit but one.
    let is_same = |told: &(String, f64, f64), there: &(String, f64, f64)| {
        told.0 == there.0 && told.1 == there.1 && (told.2 - there.2).abs() <= 1e-12 * there.2.abs()
    };
    let are_same = told.len() == there.len() && told.iter().zip(&there).all(|(a, b)| is_same(a, b));
    assert!(are_same, "told {told:?}, on the board {there:?}");
}

/// Angle errors at rest over [`SPAN_S`]: read, corrected, and whether that is flagged as worse.
fn row(answer: &Value, gyro: &str) -> (f64, f64, bool) {
    let judged = &answer["angle_errors"][0];
    assert_eq!(judged["what"], "at rest");
    let rows = judged["rows"].as_array().unwrap();
    let row = (rows.iter()).find(|row| row["channel"] == gyro && row["span_s"] == SPAN_S);
    let row = row.unwrap_or_else(|| panic!("no {gyro} over {SPAN_S} s in {judged}"));
    assert_eq!(row["limit_deg"], Value::Null, "nobody knows a real stand");
    println!("{row}");
    let number = |key: &str| row[key].as_f64().unwrap();
    (
        number("before_deg"),
        number("after_deg"),
        row["worse"].as_bool().unwrap(),
    )
}

/// Both captures, which are as of any board: whole, not marked as simulated, and the motor turns behind the second one's rest.
fn assert_measured(folder: &Path, answer: &Value) {
    let of = |name: &str| -> Record {
        let path = folder.join(name);
        let text = std::fs::read_to_string(&path).expect("a capture");
        assert!(!text.contains("imulated"), "{}", &text[..400]);
        let read = read_capture(&path, &ReadOptions::default());
        read.expect("a capture").record
    };
    let (first, second) = (of("run.csv"), of("run-corrected.csv"));
    for (record, seconds) in [(&first, 60.0), (&second, 180.0)] {
        let lasts = record.len() as f64 / 20.0;
        assert!((lasts / seconds - 1.0).abs() < 0.05, "{lasts} s");
    }
    let pwm = &second.channel("pwm").expect("the motor's command").values;
    assert!(pwm[..59 * 20].iter().all(|v| *v == 0.0));
    let turning = pwm.iter().filter(|v| **v != 0.0).count();
    assert!(turning > 100 * 20, "it turns for {turning} samples");
    assert_eq!(answer.get("planted"), None);
    let board = &answer["angle_errors"][0]["board"];
    assert_eq!(board["applied"], 1.0, "{board}");
}

#[test]
fn what_is_found_over_a_port_is_corrected_on_the_board_at_its_end() {
    let folder = folder("correct_port_found");
    let mut scenario = Scenario::quiet(21);
    // A light board in a draught: its temperature is seen to move in 60 s.
    let thermal = &mut scenario.thermal;
    (thermal.swing_c, thermal.swing_period_s) = (6.0, 40.0);
    (thermal.board_tau_s, thermal.die_tau_s) = (3.0, [1.0, 1.5, 2.0]);
    for (gyro, dps_per_c) in [(0, 0.15), (1, -0.12)] {
        scenario = scenario.with(Fault::Tempco {
            gyro,
            dps_per_c,
            dps_per_c2: 0.0,
        });
    }
    let board = Board::that_waits(scenario);
    let (answer, said) = looped(&board, &folder, &[]);
    assert_measured(&folder, &answer);
    // A count of TEMP_OUT is 0.1453 degC (data sheet), and what is planted is taken off.
    for (what, planted) in [("x temperature", 0.15), ("y temperature", -0.12)] {
        let stored = told(&answer).into_iter().find(|(name, ..)| name == what);
        let (_, before, after) = stored.unwrap_or_else(|| panic!("no {what}: {said}"));
        let off = (after / 0.1453 / -planted - 1.0).abs();
        assert!(off < 0.05, "{what}: {before} -> {after} deg/s for a count");
    }

    let text = std::fs::read_to_string(folder.join("run.toml")).expect("the model");
    let model = ModelFile::parse(&text).expect("a model");
    assert_is_on_the_board(&board, &model, &answer);
    assert_eq!(answer["worse"], false, "{said}");
    for gyro in ["gyro_x", "gyro_y"] {
        let corrected = answer["corrected"].as_array().unwrap();
        assert!(corrected.iter().any(|c| c["channel"] == gyro), "{said}");
        let (before, after, worse) = row(&answer, gyro);
        assert!(after < before / 5.0, "{gyro}: {before} -> {after} deg");
        assert!(!worse);
    }
    assert_eq!(answer["still_named"], serde_json::json!([]), "{said}");
}

/// What a current makes of the command of a free motor: V duty = R i + k w, k i = b w + c; behind a step V duty / R, which falls
/// with J / (b + k^2 / R).
fn motor_bias(gyro: &str, dps_per_amp: f64) -> String {
    let motor = MotorPart::default();
    let (r, k, b) = (motor.resistance_ohm, motor.constant, motor.viscous);
    let by_duty = b * motor.driver_v / (k * k + b * r);
    let by_friction = k * motor.coulomb / (k * k + b * r);
    let sizes = [
        ("at_full_duty", dps_per_amp * by_duty, "deg/s"),
        ("while_turning", dps_per_amp * by_friction, "deg/s"),
        (
            "surge_at_full_duty",
            dps_per_amp * (motor.driver_v / r - by_duty - by_friction),
            "deg/s",
        ),
        ("surge_time", motor.inertia / (b + k * k / r), "s"),
    ];
    let lines = sizes
        .map(|(name, value, unit)| format!("{name} = {{ value = {value}, unit = \"{unit}\" }}\n"));
    format!(
        "[[effect]]\ncause = \"motor_bias\"\nchannels = [\"{gyro}\"]\n{}",
        lines.concat()
    )
}

#[test]
fn a_model_that_is_right_of_one_axis_and_turned_of_another_is_told_so_over_a_port() {
    let folder = folder("correct_port_by");
    let (of_x, of_y) = (2.0, -1.5);
    let mut scenario = Scenario::quiet(22);
    for (gyro, dps_per_amp) in [(0, of_x), (1, of_y)] {
        scenario = scenario.with(Fault::MotorCoupling { gyro, dps_per_amp });
    }
    let board = Board::that_waits(scenario);
    let text = [
        ModelFile::paper().to_toml(),
        motor_bias("gyro_x", of_x),
        motor_bias("gyro_y", -of_y),
    ];
    let model = ModelFile::parse(&text.join("\n")).expect("a model");
    let by = folder.join("by.toml");
    std::fs::write(&by, text.join("\n")).unwrap();
    let (answer, said) = looped(&board, &folder, &["--correct-by", by.to_str().unwrap()]);
    assert_measured(&folder, &answer);

    assert_is_on_the_board(&board, &model, &answer);
    let (before, after, worse) = row(&answer, "gyro_x");
    assert!(after < before / 5.0, "{before} -> {after} deg");
    assert!(!worse, "{said}");
    let (before, after, worse) = row(&answer, "gyro_y");
    assert!(after > 1.6 * before, "{before} -> {after} deg");
    assert!(worse, "{said}");
    assert_eq!(answer["worse"], true);
    assert!(
        said.contains("WORSE than the rates as they are read"),
        "{said}"
    );
    let (_, _, worse) = row(&answer, "gyro_z");
    assert!(!worse, "{said}");
}
