//! `imu-stand capture` on a simulated board behind a pseudo-terminal: what is lost, and that nothing else is.
#![cfg(unix)]

mod common;

use std::path::Path;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use bench::Scenario;
use common::{Board, Swallow, assert_misused, assert_refused, assert_success, folder, json, run};
use imu_stand::capture::{ReadOptions, read_capture};
use model::record::Record;

/// A capture under way; killed when a test fails.
struct Running(Option<Child>);

impl Drop for Running {
    fn drop(&mut self) {
        if let Some(child) = &mut self.0 {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

/// Starts `imu-stand capture`.
fn start(board: &Board, out: &Path, more: &[&str]) -> Running {
    start_as(common::program, board, out, more)
}

fn start_as(
    program: impl Fn(&[&str]) -> std::process::Command,
    board: &Board,
    out: &Path,
    more: &[&str],
) -> Running {
    let mut arguments = vec!["capture", "--port", board.port(), "--out"];
    arguments.push(out.to_str().expect("a plain path"));
    arguments.extend(more);
    let child = program(&arguments)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn();
    Running(Some(child.expect("the program starts")))
}

fn signal(running: &Running, name: &str) {
    let child = running.0.as_ref().expect("it runs");
    let done = std::process::Command::new("kill")
        .args([name, &child.id().to_string()])
        .status();
    assert!(done.expect("kill is there").success());
}

/// What it said, when it has ended.
fn ended(mut running: Running) -> std::process::Output {
    let child = running.0.take().expect("it runs");
    child.wait_with_output().expect("it ends")
}

/// Ends it by Ctrl-C; what it said.
fn end(running: Running) -> String {
    signal(&running, "-INT");
    assert_success(&ended(running))
}

fn wait(seconds: f64) {
    std::thread::sleep(Duration::from_secs_f64(seconds));
}

/// Waits until the file has so many rows.
fn wait_for_rows(path: &Path, rows: usize) {
    let began = Instant::now();
    loop {
        let text = std::fs::read_to_string(path).unwrap_or_default();
        let there = text.lines().filter(|line| !line.starts_with('#')).count();
        if there > rows {
            return;
        }
        assert!(
            began.elapsed() < Duration::from_secs(30),
            "{rows} rows, {there} there"
        );
        wait(0.1);
    }
}

fn record(path: &Path) -> Record {
    let read = read_capture(path, &ReadOptions::default()).expect("a capture");
    assert_eq!(read.skipped, 0);
    read.record
}

/// Time and number agree in every row: a regular grid with holes in it. Returns the holes' lengths, in samples.
fn holes(record: &Record) -> Vec<u64> {
    let (seq, ticks) = (
        record.seq.as_ref().unwrap(),
        record.t_ticks.as_ref().unwrap(),
    );
    let mut out = vec![];
    for k in 1..seq.len() {
        let step = seq[k] - seq[k - 1];
        assert_eq!(ticks[k] - ticks[k - 1], step * 12_500, "row {k}");
        if step > 1 {
            out.push(step - 1);
        }
    }
    out
}

#[test]
fn ctrl_c_ends_a_capture_cleanly_and_its_header_says_how_the_board_was_set() {
    let board = Board::start();
    let folder = folder("capture_plain");
    let out = folder.join("run.csv");
    let answer = folder.join("run.json");
    let child = start(&board, &out, &["--json", answer.to_str().unwrap()]);
    wait_for_rows(&out, 40);
    let said = end(child);
    assert!(said.contains("0 missing"), "{said}");
    let record = record(&out);
    assert!(record.len() >= 40);
    assert!(holes(&record).is_empty());
    assert_eq!(record.header.rate_hz, Some(20.0));
    let has = |key: &str| record.header.entries.iter().any(|(name, _)| name == key);
    assert!(has("firmware") && has("board_id") && has("start_unix_s"));
    let answer = json(&answer);
    assert_eq!(answer["rows"], record.len());
    assert_eq!(answer["missing"], 0);
    // The raw bytes decode to the same samples.
    let mut decoder = wire::Decoder::new();
    let raw = std::fs::read(folder.join("run.raw")).unwrap();
    let samples = raw
        .iter()
        .filter(|byte| matches!(decoder.push(**byte), Some(Ok(wire::Frame::Sample(_)))))
        .count();
    assert_eq!(samples, record.len());
    let replayed = folder.join("again.csv");
    let raw = folder.join("run.raw");
    let done = run(&[
        "capture",
        "--replay",
        raw.to_str().unwrap(),
        "--out",
        replayed.to_str().unwrap(),
    ]);
    assert_success(&done);
    let again = self::record(&replayed);
    assert_eq!(
        (&again.seq, &again.t_ticks, &again.flags),
        (&record.seq, &record.t_ticks, &record.flags)
    );
    assert_eq!(again.channels, record.channels);
    // A second capture does not overwrite the first.
    let again = run(&[
        "capture",
        "--port",
        board.port(),
        "--out",
        out.to_str().unwrap(),
    ]);
    assert_refused(&again, &["--resume"]);
}

#[test]
fn a_hang_up_ends_a_capture_as_ctrl_c_does_and_the_raw_bytes_file_is_no_capture() {
    let board = Board::start();
    let folder = folder("capture_terminated");
    for name in ["-TERM", "-HUP"] {
        let out = folder.join(format!("run{name}.csv"));
        let child = start(&board, &out, &[]);
        wait_for_rows(&out, 20);
        signal(&child, name);
        assert_success(&ended(child));
        let text = std::fs::read_to_string(&out).unwrap();
        assert!(text.contains("the capture ends"), "{name}");
    }
    let out = folder.join("run.raw");
    let refused = ended(start(&board, &out, &[]));
    assert_misused(&refused, &["where the raw bytes go", "run.csv"]);
    assert!(!out.exists());
}

#[test]
fn an_unplugged_cable_leaves_a_hole_of_its_length_and_a_note() {
    // A system that tells, and one that goes on reading nothing: there the port is opened again after 5 s.
    let tells: (fn(&[&str]) -> _, f64) = (common::program_alone, 2.0);
    let silent: (fn(&[&str]) -> _, f64) = (common::program, 6.0);
    for (k, (program, seconds)) in [tells, silent].into_iter().enumerate() {
        let board = Board::start();
        let folder = folder(&format!("capture_unplugged_{k}"));
        let out = folder.join("run.csv");
        let child = start_as(program, &board, &out, &[]);
        wait_for_rows(&out, 20);
        board.unplug();
        wait(seconds);
        board.plug();
        let rows = std::fs::read_to_string(&out).unwrap().lines().count();
        wait_for_rows(&out, rows + 40);
        let said = end(child);
        assert!(
            said.contains("the port is gone") && said.contains("is back"),
            "{said}"
        );
        let record = record(&out);
        let holes = holes(&record);
        assert_eq!(holes.len(), 1, "{holes:?}");
        // Half a second at most until it is tried again; a busy computer may take ten times as long.
        let least = board.unheard();
        assert!(
            (least..=least + 100).contains(&holes[0]),
            "{holes:?}, {least} unheard"
        );
        let text = std::fs::read_to_string(&out).unwrap();
        assert!(text.contains("# event at") && text.contains("the port is back after"));
    }
}

#[test]
fn a_board_that_restarts_goes_on_in_the_same_time() {
    let board = Board::start();
    let folder = folder("capture_restart");
    let out = folder.join("run.csv");
    let child = start(&board, &out, &[]);
    wait_for_rows(&out, 40);
    board.send_aside(wire::Command::Reboot);
    wait_for_rows(&out, 120);
    let said = end(child);
    assert!(said.contains("started anew"), "{said}");
    let record = record(&out);
    let holes = holes(&record);
    // The watchdog's 16 ms, 250 ms of the gyros' start, and the set-up: a dozen samples at the most.
    assert!(
        holes.len() == 1 && (1..=16).contains(&holes[0]),
        "{holes:?}"
    );
    let host = record.host_time_s.as_ref().unwrap();
    let (seq, ticks) = (
        record.seq.as_ref().unwrap(),
        record.t_ticks.as_ref().unwrap(),
    );
    let anew =
        1 + (seq.windows(2).position(|pair| pair[1] > pair[0] + 1)).expect("the hole found above");
    // Half of the rows are in time; a simulated board on a busy computer may have lost half a second meanwhile.
    let apart = |rows: std::ops::Range<usize>| {
        let mut late: Vec<f64> = rows
            .map(|k| host[k] - (ticks[k] - ticks[0]) as f64 * 4e-6)
            .collect();
        late.sort_by(f64::total_cmp);
        late[late.len() / 2]
    };
    let moved = apart(anew..record.len()) - apart(0..anew);
    assert!(moved.abs() < 1.0, "{moved} s");
    assert!(
        std::fs::read_to_string(&out)
            .unwrap()
            .contains("the board has started anew")
    );
}

#[test]
fn a_capture_that_was_killed_is_resumed_where_it_was_cut() {
    for name in ["run.csv", "run.csv.gz"] {
        let board = Board::start();
        let folder = folder(&format!("capture_killed_{}", name.len()));
        let out = folder.join(name);
        let child = start(&board, &out, &["--quiet"]);
        wait(3.0);
        signal(&child, "-KILL");
        ended(child);
        // And in the middle of a row, as a full disk or a pulled plug leaves it.
        if name == "run.csv" {
            let text = std::fs::read_to_string(&out).unwrap();
            std::fs::write(&out, &text[..text.len() - 5]).unwrap();
        }
        wait(1.0);
        let child = start(&board, &out, &["--resume"]);
        wait(3.0);
        end(child);
        let record = record(&out);
        let holes = holes(&record);
        assert_eq!(holes.len(), 1, "{name}: {holes:?}");
        // A second, and what it takes to start; more on a busy computer.
        assert!((15..=200).contains(&holes[0]), "{name}: {holes:?}");
        assert!(record.len() > 60, "{name}: {}", record.len());
        let host = record.host_time_s.as_ref().unwrap();
        assert!(host.windows(2).all(|pair| pair[0] <= pair[1]));
    }
}

#[test]
fn a_board_that_is_set_anew_gets_another_file_and_only_the_last_one_is_gone_on_with() {
    let board = Board::start();
    let folder = folder("capture_set");
    let out = folder.join("run.csv");
    let child = start(&board, &out, &[]);
    wait_for_rows(&out, 20);
    let set_rate = |period_ticks| {
        board.send_aside(wire::Command::SetRate {
            period_ticks,
            periods_per_sample: 1,
        });
        board.send_aside(wire::Command::GetHello);
    };
    set_rate(6_250);
    let second = folder.join("run-2.csv");
    wait_for_rows(&second, 40);
    end(child);
    assert_eq!(record(&out).header.rate_hz, Some(20.0));
    assert_eq!(record(&second).header.rate_hz, Some(40.0));
    let (before, first) = (record(&second).len(), record(&out).len());
    assert_success(&ended(start(&board, &out, &["--resume", "--seconds", "2"])));
    assert!(record(&second).len() > before + 20);
    assert_eq!(record(&out).len(), first);
    // Nor into a file of another rate.
    set_rate(12_500);
    wait(0.5);
    let refused = ended(start(&board, &out, &["--resume"]));
    assert_refused(&refused, &["set differently", "rate_hz"]);
}

#[test]
fn samples_that_the_line_lost_are_charged_to_the_line() {
    let swallow = Swallow {
        samples: vec![60, 61, 70],
        ..Swallow::default()
    };
    let board = Board::with(Scenario::quiet(1), swallow);
    let folder = folder("capture_lossy");
    let (out, answer) = (folder.join("run.csv"), folder.join("run.json"));
    let child = start(&board, &out, &["--json", answer.to_str().unwrap()]);
    wait_for_rows(&out, 110);
    end(child);
    assert_eq!(holes(&record(&out)), [2, 1]);
    let answer = json(&answer);
    assert_eq!(answer["missing"], 3);
    assert_eq!(answer["lost_by_line"], 3);
    assert_eq!(answer["lost_by_board"], 0);
}

#[test]
fn a_monitor_shows_what_the_board_sends_and_writes_its_last_view() {
    let board = Board::with(Scenario::lively(5), Swallow::default());
    let folder = folder("monitor");
    let out = folder.join("view.json");
    let done = run(&[
        "monitor",
        "--port",
        board.port(),
        "--seconds",
        "5",
        "--json",
        out.to_str().unwrap(),
    ]);
    let said = assert_success(&done);
    assert!(
        said.contains("Allan deviation, deg/s, with 95 % intervals") && said.contains("0 missing"),
        "{said}"
    );
    let view = json(&out);
    assert!(view["samples"].as_u64().unwrap() > 60, "{view}");
    // Angle random walk of 5.27 deg/sqrt(h): 0.088 deg/s at 1 s, 0.39 deg/s at 0.05 s; 60 samples know it to 10 %.
    let first = view["allan"][0][0]["deviation"].as_f64().unwrap();
    assert!((0.2..0.6).contains(&first), "{first}");
    let supply = view["supply_v"].as_f64().unwrap();
    assert!((4.5..5.5).contains(&supply), "{supply}");
}

#[test]
fn requests_that_have_piled_up_arrive_one_after_the_other_and_cost_no_sample() {
    let board = Board::start();
    wait(0.5);
    let mut port = serialport::new(board.port(), 38_400)
        .open()
        .expect("it is there");
    // What a capture that drives the motor has sent while the board was held up, at all times between two samples.
    let asked = [
        wire::Command::MotorDuty { duty: 0 },
        wire::Command::GetCorrection {
            other: false,
            row: 0,
        },
        wire::Command::GetHello,
        wire::Command::KeepAlive,
    ];
    let mut piled = vec![];
    for command in asked {
        let mut line = [0; wire::Request::FRAME_LEN];
        let request = wire::Request { number: 7, command };
        let length = wire::encode_request(&request, &mut line).expect("it fits");
        piled.extend(&line[..length]);
    }
    for _ in 0..40 {
        std::io::Write::write_all(&mut port, &piled).expect("the line takes it");
        wait(0.107);
    }
    drop(port);
    let health = folder("capture_piled").join("health.json");
    assert_success(&board.ask(&["health", "--json", health.to_str().unwrap()]));
    let counters = &json(&health)["counters"];
    assert_eq!(counters["frame_dropped"], 0, "{counters}");
    assert_eq!(counters["rx_overrun"], 0, "{counters}");
}

/// A capture with the motor driven to and fro. `None`: the computer was too busy to keep the motor alive, and the board
/// stopped it.
fn driven(name: &str) -> Option<Record> {
    let board = Board::start();
    let folder = folder(name);
    let out = folder.join("run.csv");
    let shape = ["--shape", "triangle", "--amplitude", "90"];
    let child = start(
        &board,
        &out,
        &[&shape[..], &["--period-ms", "1000", "--quiet"]].concat(),
    );
    wait_for_rows(&out, 70);
    let said = end(child);
    assert!(!said.contains("driven"), "--quiet: {said}");
    let health = folder.join("health.json");
    assert_success(&board.ask(&["health", "--json", health.to_str().unwrap()]));
    let starved = json(&health)["counters"]["motor_timeout"].as_u64();
    (starved.expect("a count") == 0).then(|| record(&out))
}

#[test]
fn the_motor_is_driven_while_the_capture_runs_and_stands_at_its_end() {
    // The board waits 200 ms for the next sign of life, which comes every 60 ms.
    let driven = (0..5).find_map(|k| driven(&format!("capture_driven_{k}")));
    let driven = driven.expect("once in five the motor is never starved");
    assert!(holes(&driven).is_empty());
    assert_eq!(driven.header.base, Some(model::record::Base::Turntable));
    let pwm = &driven.channel("pwm").unwrap().values;
    let (low, high) = pwm.iter().fold((0.0, 0.0), |(low, high): (f64, f64), v| {
        (low.min(*v), high.max(*v))
    });
    assert!(
        (-90.0..=-60.0).contains(&low) && (60.0..=90.0).contains(&high),
        "{low} {high}"
    );
    assert_eq!(pwm.last(), Some(&0.0), "{:?}", &pwm[pwm.len() - 20..]);
}

#[test]
fn the_motor_of_a_board_that_restarts_stays_off() {
    let board = Board::start();
    let folder = folder("capture_motor_off");
    let out = folder.join("run.csv");
    let child = start(&board, &out, &["--duty", "80", "--base", "static"]);
    wait_for_rows(&out, 20);
    board.send_aside(wire::Command::Reboot);
    wait_for_rows(&out, 60);
    // Nobody may be watching.
    let said = end(child);
    assert!(said.contains("the motor stays off"), "{said}");
    let again = record(&out);
    assert_eq!(again.header.base, Some(model::record::Base::Static));
    let pwm = &again.channel("pwm").unwrap().values;
    assert!(pwm.iter().any(|v| *v > 70.0), "{pwm:?}");
    assert_eq!(pwm.last(), Some(&0.0));
}

#[test]
fn a_capture_goes_on_where_the_motors_stop_is_pressed() {
    let mut scenario = Scenario::quiet(1);
    scenario.stop_pressed = vec![[4.0, 4.1]];
    let board = Board::with(scenario, Swallow::default());
    let folder = folder("capture_stopped");
    let out = folder.join("run.csv");
    let child = start(&board, &out, &["--duty", "80", "--base", "static"]);
    wait_for_rows(&out, 120);
    let said = end(child);
    assert!(said.contains("the motor's stop was pressed"), "{said}");
    let record = record(&out);
    assert!(holes(&record).is_empty());
    let pwm = &record.channel("pwm").unwrap().values;
    assert!(pwm.iter().any(|v| *v > 70.0), "{pwm:?}");
    assert_eq!(pwm.last(), Some(&0.0));
}
