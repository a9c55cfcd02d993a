//! Nothing that arrived is missing from a capture: killed, on a full disk, cut off anywhere, and spread over many files.
#![cfg(unix)]

mod common;

#[path = "resume/rotated.rs"]
mod rotated;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use common::{Board, assert_refused, assert_success, folder, json, run, said};
use imu_stand::capture::{ReadOptions, read_capture};
use model::record::Record;
use wire::{Decoder, Frame, Sample};

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

impl Running {
    fn start(mut command: Command) -> Self {
        let child = command
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn();
        Running(Some(child.expect("the program starts")))
    }

    fn kill(mut self) {
        let mut child = self.0.take().expect("it runs");
        child.kill().expect("it is killed");
        child.wait().expect("it ends");
    }

    /// Ctrl-C, or its own end: what it said.
    fn output(mut self) -> std::process::Output {
        self.0
            .take()
            .expect("it runs")
            .wait_with_output()
            .expect("it ends")
    }
}

fn capture(board: &Board, out: &Path, more: &[&str]) -> Command {
    let mut arguments = vec!["capture", "--port", board.port(), "--out"];
    arguments.push(out.to_str().expect("a plain path"));
    arguments.extend(more);
    common::program(&arguments)
}

/// Samples of raw bytes, in their order.
fn samples(bytes: &[u8]) -> Vec<Sample> {
    let mut decoder = Decoder::new();
    let frames = bytes.iter().filter_map(|byte| decoder.push(*byte)?.ok());
    frames
        .filter_map(|frame| match frame {
            Frame::Sample(sample) => Some(sample),
            _ => None,
        })
        .collect()
}

fn record(path: &Path) -> Record {
    let read = read_capture(path, &ReadOptions::default()).expect("a capture");
    assert_eq!(read.skipped, 0);
    read.record
}

/// The rows of a record are the samples, one for one.
fn assert_holds(record: &Record, samples: &[Sample]) {
    let seq = record.seq.as_ref().unwrap();
    let ticks = record.t_ticks.as_ref().unwrap();
    let rows: Vec<(u16, u32)> = (seq.iter().zip(ticks))
        .map(|(s, t)| (*s as u16, *t as u32))
        .collect();
    let sent: Vec<(u16, u32)> = samples.iter().map(|s| (s.seq, s.t_ticks)).collect();
    assert_eq!(rows, sent);
    let x = record.channel("gyro_x").unwrap().counts.as_ref().unwrap();
    let sent: Vec<i32> = samples.iter().map(|s| i32::from(s.gyro[0])).collect();
    assert_eq!(x, &sent);
}

/// Lengths of the holes, in samples.
fn holes(record: &Record) -> Vec<u64> {
    let seq = record.seq.as_ref().unwrap();
    let steps = seq.windows(2).map(|pair| pair[1] - pair[0] - 1);
    steps.filter(|hole| *hole > 0).collect()
}

fn wait_until(what: &str, is: impl Fn() -> bool) {
    let began = Instant::now();
    while !is() {
        assert!(began.elapsed() < Duration::from_secs(40), "{what}");
        std::thread::sleep(Duration::from_millis(50));
    }
}

fn size(path: &Path) -> u64 {
    path.metadata().map_or(0, |file| file.len())
}

/// Without what stands behind the end of its last `rows` lines, and the half of the one before.
fn tear_rows(path: &Path, rows: usize) {
    let text = fs::read_to_string(path).unwrap();
    let ends: Vec<usize> = text.match_indices('\n').map(|(at, _)| at).collect();
    fs::write(path, &text[..ends[ends.len() - 1 - rows] - 9]).unwrap();
}

#[test]
fn what_a_killed_capture_had_received_is_in_the_file_after_resume() {
    for name in ["run.csv", "run.csv.gz"] {
        let board = Board::start();
        let folder = folder(&format!("resume_killed_{}", name.len()));
        let (out, raw) = (folder.join(name), folder.join("run.raw"));
        let answer = folder.join("run.json");
        let child = Running::start(capture(&board, &out, &["--quiet"]));
        wait_until("3 s of samples", || size(&raw) > 3_000);
        child.kill();
        // Rows that were not written yet, and a frame that was read in part.
        if name == "run.csv" {
            tear_rows(&out, 12);
        }
        let mut bytes = fs::read(&raw).unwrap();
        bytes.extend([0x30, 0x01, 0x02]);
        fs::write(&raw, &bytes).unwrap();
        let before = samples(&bytes);
        // Without a board, too.
        let arguments = [
            "capture",
            "--port",
            "/dev/no-such-board",
            "--out",
            out.to_str().unwrap(),
        ];
        let refused = run(&[&arguments[..], &["--resume"]].concat());
        assert_eq!(refused.status.code(), Some(1), "{}", said(&refused));
        if name == "run.csv" {
            assert!(
                said(&refused).contains("put in from the raw bytes"),
                "{}",
                said(&refused)
            );
        }
        assert_holds(&record(&out), &before);
        // And on, when some samples have passed unheard.
        std::thread::sleep(Duration::from_secs(1));
        let more = [
            "--resume",
            "--seconds",
            "3",
            "--json",
            answer.to_str().unwrap(),
        ];
        assert_success(&Running::start(capture(&board, &out, &more)).output());
        let all = samples(&fs::read(&raw).unwrap());
        assert!(
            all.len() > before.len() + 30,
            "{} {}",
            all.len(),
            before.len()
        );
        let record = record(&out);
        assert_holds(&record, &all);
        // The one hole is the time in which nobody listened, and it is told so.
        let holes = holes(&record);
        assert_eq!(holes.len(), 1, "{holes:?}");
        let answer = json(&answer);
        assert_eq!(answer["lost_while_not_running"], holes[0]);
        assert_eq!(answer["missing"], holes[0]);
        let text = {
            let text = imu_stand::capture::unpacked(std::io::BufReader::new(
                fs::File::open(&out).unwrap(),
            ));
            std::io::read_to_string(text.unwrap()).unwrap()
        };
        assert!(text.contains("the capture did not run"), "{text}");
        let host = record.host_time_s.as_ref().unwrap();
        assert!(host.windows(2).all(|pair| pair[0] <= pair[1]));
    }
}

#[test]
fn rows_that_the_raw_bytes_lack_stay_and_a_file_without_rows_gets_all() {
    let board = Board::start();
    let folder = folder("resume_edges");
    let (out, raw) = (folder.join("run.csv"), folder.join("run.raw"));
    assert_success(&run_for(&board, &out, "3"));
    let whole = fs::read_to_string(&out).unwrap();
    let all = samples(&fs::read(&raw).unwrap());
    let resume = || {
        let arguments = [
            "capture",
            "--port",
            "/dev/no-such-board",
            "--out",
            out.to_str().unwrap(),
        ];
        run(&[&arguments[..], &["--resume"]].concat())
    };
    // Every row is gone, the names of the columns are there.
    let head: Vec<&str> = whole
        .lines()
        .take_while(|line| !line.starts_with("0,") && !line.starts_with(char::is_numeric))
        .collect();
    fs::write(&out, head.join("\n") + "\n").unwrap();
    resume();
    assert_holds(&record(&out), &all);
    // What a power cut left of the raw bytes ends before the rows do.
    fs::write(&out, &whole).unwrap();
    let bytes = fs::read(&raw).unwrap();
    fs::write(&raw, &bytes[..bytes.len() / 2]).unwrap();
    resume();
    assert_eq!(fs::read_to_string(&out).unwrap(), whole);
    // An earlier capture's bytes are in the file, and are not this one's.
    let again = folder.join("run.csv.old");
    fs::rename(&out, &again).unwrap();
    assert_success(&run_for(&board, &out, "2"));
    let mine = samples(&fs::read(&raw).unwrap()[bytes.len() / 2..]);
    tear_rows(&out, 15);
    resume();
    assert_holds(&record(&out), &mine);
}

fn run_for(board: &Board, out: &Path, seconds: &str) -> std::process::Output {
    Running::start(capture(board, out, &["--seconds", seconds])).output()
}

/// A capture that ends while the disk has no room, and goes on when there is: all of the raw bytes' samples are rows.
fn full(out: &Path, first: std::process::Output, again: impl FnOnce() -> std::process::Output) {
    let refused = assert_refused(&first, &["kept in memory", "are lost", "--resume"]);
    assert!(
        refused.contains("No space") || refused.contains("File too large"),
        "{refused}"
    );
    let before = samples(&fs::read(out.with_extension("raw")).unwrap()).len();
    assert!(before > 30, "{before}");
    assert_success(&again());
    let all = samples(&fs::read(out.with_extension("raw")).unwrap());
    assert!(all.len() > before, "{} {before}", all.len());
    let record = record(out);
    assert_holds(&record, &all);
    assert!(holes(&record).len() <= 1, "the time between");
}

#[test]
fn a_file_that_may_not_grow_loses_nothing() {
    let board = Board::start();
    let folder = folder("resume_limit");
    let out = folder.join("run.csv");
    // Blocks of 1024 bytes; a write over it fails with EFBIG, as one on a full disk does with ENOSPC.
    let script = "trap '' XFSZ; ulimit -f 8; exec \"$@\"";
    let inner = capture(&board, &out, &["--quiet", "--seconds", "12"]);
    let mut limited = Command::new("bash");
    limited
        .args(["-c", script, "bash"])
        .arg(inner.get_program())
        .args(inner.get_args());
    let first = Running::start(limited).output();
    full(&out, first, || {
        Running::start(capture(&board, &out, &["--resume", "--seconds", "2"])).output()
    });
}

#[cfg(target_os = "linux")]
#[test]
fn a_disk_that_is_full_for_a_while_leaves_no_hole() {
    for name in ["run.csv", "run.csv.gz"] {
        let board = Board::start();
        let folder = folder(&format!("resume_room_{}", name.len()));
        let (out, raw) = (folder.join(name), folder.join("run.raw"));
        let child = Running::start(common::unkilled_by_limits(&capture(
            &board,
            &out,
            &["--quiet", "--seconds", "9"],
        )));
        wait_until("samples", || size(&raw) > 2_000);
        let id = child.0.as_ref().unwrap().id();
        common::limit_files(id, Some(size(&raw) + 500));
        std::thread::sleep(Duration::from_secs(4));
        let then = size(&raw);
        common::limit_files(id, None);
        let done = child.output();
        let said = assert_success(&done);
        assert!(
            said.contains("kept in memory")
                && said.contains("what had waited in memory is written"),
            "{said}"
        );
        let all = samples(&fs::read(&raw).unwrap());
        assert!(size(&raw) > then + 1_000, "{} {then}", size(&raw));
        let record = record(&out);
        assert_holds(&record, &all);
        assert!(holes(&record).is_empty(), "{:?}", holes(&record));
    }
}

/// A file system of 64 KiB, where this user may mount one.
struct Small(PathBuf);

impl Small {
    fn mount(at: &Path) -> Option<Self> {
        let options = ["-t", "tmpfs", "-o", "size=64k", "tmpfs"];
        let done = Command::new("mount").args(options).arg(at).output();
        done.is_ok_and(|done| done.status.success())
            .then(|| Small(at.to_owned()))
    }
}

impl Drop for Small {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(&self.0).status();
    }
}

#[test]
fn a_full_disk_loses_nothing() {
    let folder = folder("resume_full");
    let Some(disk) = Small::mount(&folder) else {
        eprintln!(
            "no file system can be mounted here: a_file_that_may_not_grow_loses_nothing stands for it"
        );
        return;
    };
    let board = Board::start();
    let (out, ballast) = (disk.0.join("run.csv"), disk.0.join("ballast"));
    // Room for some seconds.
    fs::write(&ballast, vec![1; 48 << 10]).unwrap();
    let first = capture(&board, &out, &["--quiet", "--seconds", "15"]);
    let first = Running::start(first).output();
    full(&out, first, || {
        fs::remove_file(&ballast).unwrap();
        Running::start(capture(&board, &out, &["--resume", "--seconds", "2"])).output()
    });
}

#[test]
fn a_file_that_began_as_the_board_was_set_anew_is_healed_from_its_own_raw_bytes() {
    for (rotate, second, raw) in [
        (&[][..], "run-2.csv", "run.raw"),
        (&["--rotate", "7d"][..], "run-0002.csv", "run-0002.raw"),
    ] {
        let board = Board::start();
        let folder = folder(&format!("resume_set_{}", second.len()));
        let out = folder.join("run.csv");
        let child = Running::start(capture(&board, &out, rotate));
        let first = folder.join(if rotate.is_empty() {
            "run.csv"
        } else {
            "run-0001.csv"
        });
        wait_until("a first file", || size(&first) > 2_000);
        board.send_aside(wire::Command::SetRate {
            period_ticks: 6_250,
            periods_per_sample: 1,
        });
        board.send_aside(wire::Command::GetHello);
        let (second, raw) = (folder.join(second), folder.join(raw));
        wait_until("a second file", || size(&second) > 4_000);
        child.kill();
        tear_rows(&second, 20);
        let more = [&["--resume", "--seconds", "2"], rotate].concat();
        assert_success(&Running::start(capture(&board, &out, &more)).output());
        let record = record(&second);
        assert_eq!(record.header.rate_hz, Some(40.0));
        // Its rows are the raw bytes' samples from its first one on.
        let all = samples(&fs::read(&raw).unwrap());
        let from = all.len() - record.len();
        assert_holds(&record, &all[from..]);
        assert_eq!(from == 0, !rotate.is_empty(), "{from}");
        assert!(holes(&record).len() <= 1);
    }
}

#[test]
fn what_was_missed_while_the_port_was_gone_is_told_so() {
    let board = Board::start();
    let folder = folder("resume_gone");
    let (out, answer) = (folder.join("run.csv"), folder.join("run.json"));
    let more = ["--json", answer.to_str().unwrap(), "--seconds", "14"];
    let mut arguments = vec![
        "capture",
        "--port",
        board.port(),
        "--out",
        out.to_str().unwrap(),
    ];
    arguments.extend(more);
    let child = Running::start(common::program_alone(&arguments));
    wait_until("a second of samples", || {
        size(&folder.join("run.raw")) > 1_500
    });
    board.unplug();
    std::thread::sleep(Duration::from_secs(2));
    board.plug();
    let output = child.output();
    let said = assert_success(&output);
    let record = record(&out);
    assert_holds(
        &record,
        &samples(&fs::read(folder.join("run.raw")).unwrap()),
    );
    let holes = holes(&record);
    assert_eq!(holes.len(), 1, "{holes:?}");
    let answer = json(&answer);
    assert_eq!(answer["missing"], holes[0]);
    assert_eq!(answer["lost_while_port_gone"], holes[0]);
    for nobody in [
        "lost_by_board",
        "lost_by_line",
        "lost_unattributed",
        "lost_by_restart",
    ] {
        assert_eq!(answer[nobody], 0, "{nobody}: {answer}");
    }
    assert!(said.contains("while the port was gone"), "{said}");
}
