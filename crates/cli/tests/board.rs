//! `imu-stand board` against a simulated board behind a real serial device.
#![cfg(unix)]

mod common;

use std::time::Duration;

use bench::Scenario;
use common::{Board, Swallow, assert_misused, assert_refused, assert_success, folder, json, run};

#[test]
fn a_board_says_who_it_is_and_keeps_what_is_set_stored_and_loaded() {
    let board = Board::start();
    let folder = folder("board_info");
    let out = folder.join("info.json");
    let out = out.to_str().unwrap();
    let said = assert_success(&board.ask(&["info", "--json", out]));
    assert!(
        said.contains("power-on") && said.contains("20.0000 Hz"),
        "{said}"
    );
    let info = json(out.as_ref());
    assert_eq!(info["format"], "imu-stand-board/1");
    assert_eq!(info["config_source"], "built in");
    assert_eq!(info["gyro_range_dps"], 320.0);

    assert_success(&board.ask(&["set", "rate", "10"]));
    assert_success(&board.ask(&["set", "acc-range", "4"]));
    assert_success(&board.ask(&["set", "board-id", "77"]));
    let said = assert_success(&board.ask(&["set", "bias", "y", "-0.25"]));
    assert!(
        said.contains("-0.25000") && said.contains("not stored"),
        "{said}"
    );
    assert_success(&board.ask(&["store"]));
    assert_success(&board.ask(&["set", "rate", "20"]));
    assert_success(&board.ask(&["load", "--json", out]));
    let info = json(out.as_ref());
    assert_eq!(info["rate_hz"], 10.0);
    assert_eq!(info["acc_range_g"], 4.0);
    assert_eq!(info["board_id"], 77);
    assert_eq!(info["bias_dps"][1], -0.25);
    assert!(
        info["config_source"]
            .as_str()
            .unwrap()
            .starts_with("EEPROM"),
        "{info}"
    );
    assert_eq!(
        assert_success(&board.ask(&["get", "bias"])).trim(),
        "0 -0.25 0"
    );
    assert_success(&board.ask(&["defaults"]));
    assert_eq!(assert_success(&board.ask(&["get", "rate"])).trim(), "20");
    // What is stored outlives a reset.
    let said = assert_success(&board.ask(&["reboot"]));
    assert!(
        said.contains("watchdog or reboot") && said.contains("10.0000 Hz"),
        "{said}"
    );
}

#[test]
fn gyros_are_set_by_range_and_filter_and_their_registers_read_and_written() {
    let board = Board::start();
    let said = assert_success(&board.ask(&["set", "gyro", "--range", "160", "--filter", "3"]));
    assert!(said.contains("160 deg/s, filter 3 (8 taps"), "{said}");
    let said = assert_success(&board.ask(&["register", "read", "z", "SENS/AVG"]));
    assert!(
        said.contains("0x0203") && said.contains("160 deg/s"),
        "{said}"
    );
    assert_success(&board.ask(&["register", "write", "x", "0x20", "0x8123"]));
    let said = assert_success(&board.ask(&["register", "read", "x", "alm_mag1"]));
    assert!(said.contains("0x8123"), "{said}");
    let said = assert_success(&board.ask(&["register", "read", "y", "SUPPLY_OUT"]));
    assert!(said.contains("V"), "{said}");

    // The part wants taps at a narrow range: refused, and nothing has changed.
    let refused = board.ask(&["set", "gyro", "--range", "80"]);
    assert_refused(&refused, &["out of range", "80 deg/s 4 to 6"]);
    assert_eq!(
        assert_success(&board.ask(&["get", "gyro-range"])).trim(),
        "160"
    );
    // What would undo the board's own set-up wants a yes.
    let refused = board.ask(&["register", "write", "x", "COMMAND", "1"]);
    assert_refused(&refused, &["--yes"]);
}

#[test]
fn a_rate_that_the_line_cannot_carry_is_refused_before_it_is_set() {
    let board = Board::start();
    let refused = board.ask(&["set", "rate", "256"]);
    assert_refused(&refused, &["set baud 250000"]);
    for beyond in ["0.5", "1000", "nan"] {
        let refused = board.ask(&["set", "rate", beyond]);
        assert_misused(&refused, &["1 to 256 Hz, not at"]);
    }
    // What the line would carry is what is proposed.
    let refused = board.ask(&["set", "baud", "9600"]);
    let said = assert_refused(&refused, &["9600 baud do not carry", "set rate "]);
    assert!(!said.contains("set rate 20"), "{said}");
    let said = assert_success(&board.ask(&["set", "baud", "250000"]));
    assert!(said.contains("--baud 250000"), "{said}");
    assert_success(&board.ask(&["set", "rate", "250"]));
    assert_eq!(assert_success(&board.ask(&["get", "rate"])).trim(), "250");
    // -3.5 % is too far off.
    assert_misused(&board.ask(&["set", "baud", "115200"]), &["115200 baud"]);
}

#[test]
fn the_bias_is_measured_and_agrees_with_what_the_samples_say() {
    let board = Board::with(Scenario::lively(3), Swallow::default());
    let folder = folder("board_null");
    let out = folder.join("null.json");
    assert_success(&board.ask(&[
        "bias-null",
        "--samples",
        "40",
        "--store",
        "--json",
        out.to_str().unwrap(),
    ]));
    let answer = json(&out);
    let largest = answer["std_error_dps"].as_f64().unwrap();
    // The board's own, of thirteen blocks: within a factor of two of it.
    assert!((0.03..0.2).contains(&largest), "{largest}");
    assert_eq!(answer["samples_seen_here"], 40);
    assert_eq!(answer["reply_lost"], false);
    for axis in 0..3 {
        let error = answer["std_error_if_white_dps"][axis].as_f64().unwrap();
        // 5.27 deg/sqrt(h) at 20 Hz over 40 samples: 0.062 deg/s; chi-square with 39 degrees keeps it within a third.
        assert!((0.035..0.1).contains(&error), "{error}");
    }
    let biases: Vec<f64> = assert_success(&board.ask(&["get", "bias"]))
        .split_whitespace()
        .map(|word| word.parse().unwrap())
        .collect();
    assert!(biases.iter().any(|bias| *bias != 0.0));
    for (axis, bias) in biases.iter().enumerate() {
        assert_eq!(answer["bias_dps"][axis].as_f64(), Some(*bias));
    }
    assert_eq!(
        assert_success(&board.ask(&["get", "source"]))
            .split(',')
            .next(),
        Some("EEPROM")
    );
}

#[test]
fn a_lost_request_is_repeated_and_a_lost_reply_does_not_measure_twice() {
    let null = wire::Command::BiasNull { samples: 0 }.code();
    let swallow = Swallow {
        replies: vec![null, wire::Command::Ping.code()],
        requests: vec![null, wire::Command::GetHello.code()],
        ..Swallow::default()
    };
    let board = Board::with(Scenario::lively(4), swallow);
    let folder = folder("board_lost");
    let out = folder.join("null.json");
    let said = assert_success(&board.ask(&[
        "bias-null",
        "--samples",
        "30",
        "--json",
        out.to_str().unwrap(),
    ]));
    assert!(said.contains("reply was lost"), "{said}");
    let answer = json(&out);
    assert_eq!(answer["reply_lost"], true);
    assert_eq!(answer["samples_seen_here"], 30, "measured once");
}

#[test]
fn what_must_not_happen_twice_is_not_sent_twice_but_looked_up() {
    let swallow = Swallow {
        replies: vec![
            wire::Command::StoreConfig.code(),
            wire::Command::Reboot.code(),
            wire::Command::ClearCounters.code(),
        ],
        ..Swallow::default()
    };
    let board = Board::with(Scenario::quiet(1), swallow);
    assert_success(&board.ask(&["set", "board-id", "5"]));
    let said = assert_success(&board.ask(&["store"]));
    assert!(said.contains("EEPROM"), "{said}");
    let said = assert_success(&board.ask(&["reboot"]));
    assert!(said.contains("; 1 since power came on"), "{said}");
    // Here nothing can be looked up: the error says so.
    let lost = board.ask(&["health", "--clear"]);
    assert_refused(&lost, &["is not known", "frames in order"]);
}

#[test]
fn the_motor_turns_for_as_long_as_it_is_kept_alive_and_then_stands() {
    let board = Board::start();
    let folder = folder("board_motor");
    let out = folder.join("motor.json");
    assert_success(&board.ask(&["set", "motor-limits", "--max-duty", "100", "--ramp", "400"]));
    assert_success(&board.ask(&[
        "motor",
        "--duty",
        "-150",
        "--seconds",
        "1.5",
        "--json",
        out.to_str().unwrap(),
    ]));
    let answer = json(&out);
    assert_eq!(answer["duty_after_limits"], -100);
    assert_eq!(answer["smallest_pwm_seen"], -100);
    assert_eq!(answer["stopped"], true);
    let health = folder.join("health.json");
    assert_success(&board.ask(&["health", "--json", health.to_str().unwrap()]));
    let health = json(&health);
    assert_eq!(health["counters"]["motor_timeout"], 0, "never starved");
    assert!(
        health["stack_free_bytes"].is_null(),
        "the host's is not the board's"
    );
    assert_eq!(
        health["counters"].as_object().unwrap().len(),
        wire::Fault::COUNT
    );
}

#[test]
fn a_motor_whose_stop_is_pressed_does_not_start_and_one_that_turns_ends_with_what_to_do() {
    let mut scenario = Scenario::quiet(1);
    scenario.stop_pressed = vec![[0.0, 3.0], [6.0, 6.2]];
    let board = Board::with(scenario, Swallow::default());
    let began = std::time::Instant::now();
    let turn = || board.ask(&["motor", "--duty", "80", "--seconds", "20"]);
    let needles = ["the motor's stop is pressed", "let go of the stop"];
    let said = assert_refused(&turn(), &needles);
    assert!(said.contains("arm motor"), "{said}");
    std::thread::sleep(Duration::from_secs_f64(3.5).saturating_sub(began.elapsed()));
    let said = assert_refused(&turn(), &needles);
    assert!(said.contains("keep-alive"), "{said}");
    assert!(began.elapsed() < Duration::from_secs(15));
    let said = assert_success(&board.ask(&["motor", "--duty", "80", "--seconds", "1"]));
    assert!(said.contains("and stands"), "{said}");
}

#[test]
fn ctrl_c_stops_the_motor_and_a_killed_program_leaves_it_to_the_board() {
    let board = Board::start();
    let arguments = ["board", "--port", board.port(), "motor", "--duty", "80"];
    let signal = |id: u32, name: &str| {
        let done = std::process::Command::new("kill")
            .args([name, &id.to_string()])
            .status();
        assert!(done.expect("kill is there").success());
    };
    let child = common::program(&arguments)
        .stdout(std::process::Stdio::piped())
        .spawn()
        .expect("the program starts");
    std::thread::sleep(Duration::from_millis(1500));
    signal(child.id(), "-INT");
    let output = child.wait_with_output().unwrap();
    let said = assert_success(&output);
    assert!(said.contains("and stands"), "{said}");

    let child = common::program(&arguments)
        .stderr(std::process::Stdio::null())
        .spawn()
        .expect("the program starts");
    std::thread::sleep(Duration::from_millis(1500));
    signal(child.id(), "-KILL");
    let mut child = child;
    child.wait().unwrap();
    // The board sees that by itself, within its timeout.
    let began = std::time::Instant::now();
    loop {
        let said = assert_success(&board.ask(&["health"]));
        if said.contains("motor_timeout") {
            break;
        }
        assert!(began.elapsed() < Duration::from_secs(10), "{said}");
    }
}

#[test]
fn a_diagnosis_goes_back_to_the_board() {
    let board = Board::start();
    let folder = folder("board_calibrate");
    let [run_csv, found, model, out] =
        ["c.csv", "d.json", "m.toml", "o.json"].map(|name| folder.join(name).display().to_string());
    // A model with biases, simulated, diagnosed, and written to the board.
    let mut stand = model::file::ModelFile::paper();
    for (channel, bias) in stand.channels.iter_mut().zip([0.5, -1.25, 0.0]) {
        if let Some(parameter) = channel.baseline.get_mut("bias") {
            parameter.value = bias;
        }
        channel.baseline.remove("rate_random_walk");
    }
    std::fs::write(&model, stand.to_toml()).unwrap();
    assert_success(&run(&[
        "simulate",
        "--model",
        &model,
        "--seconds",
        "300",
        "--out",
        &run_csv,
    ]));
    assert_success(&run(&["diagnose", &run_csv, "--json", &found]));
    let said = assert_success(&run(&["board", "calibrate", &found, "--dry-run"]));
    assert!(said.contains("nothing is written"), "{said}");
    assert_success(&board.ask(&["calibrate", &found, "--store", "--force", "--json", &out]));
    let biases: Vec<f64> = assert_success(&board.ask(&["get", "bias"]))
        .split_whitespace()
        .map(|word| word.parse().unwrap())
        .collect();
    let diagnosis = json(found.as_ref());
    for (k, truth) in [0.5, -1.25, 0.0].iter().enumerate() {
        let name = ["gyro_x", "gyro_y", "gyro_z"][k];
        let found = diagnosis["baseline"][name]["bias"]["value"]
            .as_f64()
            .unwrap();
        assert!((biases[k] - found).abs() <= 0.5 / 65_536.0, "{name}");
        // White noise of 5.27 deg/sqrt(h) over 300 s leaves 0.005 deg/s; six of those.
        assert!((biases[k] - truth).abs() < 0.03, "{name}: {biases:?}");
    }
    assert_eq!(json(out.as_ref())["stored"], true);

    let analysis = folder.join("a.json").display().to_string();
    assert_success(&run(&["analyze", &run_csv, "--json", &analysis]));
    let refused = board.ask(&["calibrate", &analysis]);
    assert_refused(&refused, &["holds no bias"]);
}

#[test]
fn silence_is_an_error_that_says_what_was_heard() {
    let missing = run(&["board", "--port", "/dev/no-such-port", "info"]);
    assert_refused(&missing, &["/dev/no-such-port"]);
    assert_eq!(
        run(&["board", "info"]).status.code(),
        Some(2),
        "no port named"
    );
    // A board that hears nothing: every hello request is lost.
    let code = wire::Command::GetHello.code();
    let swallow = Swallow {
        requests: vec![code; 9],
        ..Swallow::default()
    };
    let board = Board::with(Scenario::quiet(1), swallow);
    std::thread::sleep(Duration::from_millis(500));
    let deaf = board.ask(&["info"]);
    assert_refused(&deaf, &["in 3 tries", "does not hear"]);
}

#[test]
fn sensors_test_themselves_and_a_profile_is_driven() {
    let board = Board::start();
    let folder = folder("board_self_test");
    let (tested, driven) = (folder.join("t.json"), folder.join("m.json"));
    let said = common::said(&board.ask(&["self-test", "--json", tested.to_str().unwrap()]));
    assert!(said.contains("gyro x passed"), "{said}");
    let answer = json(&tested);
    let sensors = answer["sensors"].as_array().unwrap();
    assert_eq!(sensors.len(), 4);
    assert!(sensors[..3].iter().all(|s| s["passed"] == true), "{answer}");
    assert_success(&board.ask(&[
        "motor",
        "--shape",
        "triangle",
        "--amplitude",
        "90",
        "--period-ms",
        "1000",
        "--seconds",
        "2.5",
        "--json",
        driven.to_str().unwrap(),
    ]));
    let answer = json(&driven);
    let of = |key: &str| answer[key].as_i64().unwrap();
    // 20 samples a period see the peaks to within a step of the triangle.
    assert!((60..=90).contains(&of("largest_pwm_seen")), "{answer}");
    assert!((-90..=-60).contains(&of("smallest_pwm_seen")), "{answer}");
    assert_eq!(answer["stopped"], true);
}

#[test]
fn a_slow_board_is_waited_for() {
    let board = Board::start();
    assert_success(&board.ask(&["set", "rate", "1"]));
    assert_eq!(assert_success(&board.ask(&["get", "rate"])).trim(), "1");
    // Work on the gyros is done beside a sample, once a second.
    let said = assert_success(&board.ask(&["register", "read", "y", "SENS_AVG"]));
    assert!(said.contains("0x0402"), "{said}");
    let said = assert_success(&board.ask(&["self-test", "gyro-z"]));
    assert!(said.contains("gyro z passed"), "{said}");
    let said = assert_success(&board.ask(&["bias-null", "--samples", "8"]));
    assert!(!said.contains("reply was lost"), "{said}");
}

#[test]
fn the_correction_in_use_is_told_with_the_set_up() {
    let board = Board::start();
    let folder = folder("board_correction");
    let [model, out] = ["model.toml", "info.json"].map(|name| folder.join(name));
    std::fs::write(&model, model::ModelFile::paper().to_toml()).expect("a file");
    let [model, out] = [&model, &out].map(|path| path.to_str().expect("a name"));
    let said = assert_success(&board.ask(&["info", "--json", out]));
    assert!(said.contains("correction none in use"), "{said}");
    assert!(json(out.as_ref())["correction"].is_null());
    assert_refused(
        &board.ask(&["correct", "--on"]),
        &["no stored correction", "correct --model model.toml"],
    );
    let written = assert_success(&board.ask(&["correct", "--model", model]));
    let said = assert_success(&board.ask(&["info", "--json", out]));
    let number = json(out.as_ref())["correction"].as_u64().expect("a number");
    let number = format!("{number:#06x}");
    assert!(
        written.contains(&number) && said.contains(&number),
        "{written}{said}"
    );
    // The same again: nothing that would change.
    let said = assert_success(&board.ask(&["correct", model, "--dry-run"]));
    assert!(said.contains("has these numbers already"), "{said}");
    // Off until the next reset.
    assert_success(&board.ask(&["correct", "--off"]));
    let said = assert_success(&board.ask(&["info"]));
    assert!(said.contains("correction none in use"), "{said}");
    assert_success(&board.ask(&["correct", "--on"]));
    let said = assert_success(&board.ask(&["info"]));
    assert!(said.contains("stored and in use"), "{said}");
    // The gyros are set anew: the board does not apply it, and its rates mean nothing.
    let said = assert_success(&board.ask(&["set", "gyro", "--range", "160", "--filter", "3"]));
    let stale = "not applied: it is for gyros at 320 deg/s, filter 2";
    assert!(said.contains(stale), "{said}");
    let said = assert_success(&board.ask(&["correct", "--on", "--json", out]));
    assert!(said.contains(stale), "{said}");
    assert_eq!(json(out.as_ref())["correction_fits"], false);
    let said = assert_success(&board.ask(&["correct", "--model", model, "--dry-run"]));
    assert!(
        said.contains("is for gyros at 320 deg/s, filter 2"),
        "{said}"
    );
    assert_success(&board.ask(&["correct", "--model", model]));
    let said = assert_success(&board.ask(&["info"]));
    assert!(said.contains("stored and in use"), "{said}");
}

#[test]
fn a_profile_that_is_too_fast_for_the_ramp_is_told() {
    let board = Board::start();
    let profile = |period: &str| {
        let mut words = vec!["motor", "--shape", "sine", "--amplitude", "60"];
        words.extend(["--period-ms", period, "--seconds", "1.5"]);
        assert_success(&board.ask(&words))
    };
    let said = profile("2");
    assert!(said.contains("too short for the ramp"), "{said}");
    let said = profile("1200");
    assert!(!said.contains("note"), "{said}");
}
