//! A live capture over a pseudo-terminal, in real time: frames are damaged and lost, the cable is pulled, the program is
//! stopped, ended and killed, the disk is full. Every frame that reached the program is a row in the end.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use bench::Scenario;
use imu_stand::capture::{ReadOptions, read_capture};
use rand_core::{Rng as _, SeedableRng as _};
use rand_xoshiro::Xoshiro256PlusPlus;
use wire::{Decoder, Frame};

use super::common::{Board, Damage, Swallow, folder, limit_files, program, unkilled_by_limits};

/// One frame in so many is damaged.
const DAMAGED: u64 = 300;
/// Growth of the capture's memory, bytes: its buffers, and what the disk had no room for.
const GROWTH: u64 = 8 << 20;

/// What may be on its way to the program when it is killed, ticks: a second, as the computer may be busy.
const ON_ITS_WAY: u32 = 250_000;

/// What befalls a capture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Event {
    /// The cable is out for some seconds.
    Cable,
    /// The program is killed in the middle of whatever it does.
    Kill,
    /// Ctrl-C, and on.
    Interrupt,
    /// Files may not grow for some seconds.
    Full,
    /// Killed while they may not grow: what waited in memory is gone with it.
    KillFull,
    /// The program does not run for some seconds.
    Stop,
}

const EVENTS: [Event; 6] = [
    Event::Cable,
    Event::Kill,
    Event::Interrupt,
    Event::Full,
    Event::KillFull,
    Event::Stop,
];

struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Running {
    fn start(board: &Board, out: &Path) -> Self {
        let out = out.to_str().expect("a plain path");
        let arguments = [
            "capture",
            "--port",
            board.port(),
            "--out",
            out,
            "--resume",
            "--quiet",
        ];
        let child = unkilled_by_limits(&program(&arguments))
            .stdout(Stdio::null())
            .stderr(Stdio::inherit())
            .spawn();
        Running(child.expect("the program starts"))
    }

    fn signal(&self, name: &str) {
        let done = Command::new("kill")
            .args([name, &self.0.id().to_string()])
            .status();
        assert!(done.expect("kill is there").success());
    }

    fn resident(&self) -> u64 {
        let path = format!("/proc/{}/statm", self.0.id());
        let told = fs::read_to_string(path).unwrap_or_default();
        let pages = told
            .split_whitespace()
            .nth(1)
            .and_then(|n| n.parse::<u64>().ok());
        pages.unwrap_or(0) * 4096
    }

    /// Waits for its own end; whether it succeeded.
    fn ended(mut self) -> bool {
        self.0.wait().expect("it ends").success()
    }
}

fn size(path: &Path) -> u64 {
    path.metadata().map_or(0, |file| file.len())
}

fn wait(seconds: f64) {
    std::thread::sleep(Duration::from_secs_f64(seconds));
}

/// Number and ticks of each sample in raw bytes.
fn samples(bytes: &[u8]) -> Vec<(u16, u32)> {
    let mut decoder = Decoder::new();
    let frames = bytes.iter().filter_map(|byte| decoder.push(*byte)?.ok());
    frames
        .filter_map(|frame| match frame {
            Frame::Sample(sample) => Some((sample.seq, sample.t_ticks)),
            _ => None,
        })
        .collect()
}

/// Number and ticks of each row as the board sent them: on a busy computer the simulated board falls behind the clock on the wall,
/// which looks like a restart, so what the file says it has added is taken off.
fn as_sent(text: &str) -> Vec<(u16, u32)> {
    let (mut rows, mut offsets) = (Vec::new(), (0, 0));
    for line in text.lines() {
        if let Some(told) = line.strip_prefix("# offsets: seq ") {
            let (seq, ticks) = told.split_once(" t_ticks ").expect("both");
            let number = |text: &str| text.parse::<i64>().expect("a number");
            offsets = (number(seq), number(ticks));
        } else if line.starts_with(|c: char| c.is_ascii_digit()) {
            let mut cells = line.split(',').map(|cell| cell.parse::<i64>());
            let mut cell = || cells.next().expect("a cell").expect("a whole number");
            let (seq, ticks) = (cell(), cell());
            rows.push(((seq - offsets.0) as u16, (ticks - offsets.1) as u32));
        }
    }
    rows
}

/// A capture and what was done to it.
struct Trial {
    board: Board,
    out: PathBuf,
    raw: PathBuf,
    running: Running,
    rng: Xoshiro256PlusPlus,
    done: [u32; EVENTS.len()],
    memory: [u64; 2],
    /// Times in which nobody listened, or what was heard went with a killed program: samples that reached the line then may be
    /// missing. By the board's ticks.
    deaf: Vec<[u32; 2]>,
}

impl Trial {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.rng.next_u64() >> 11) as f64 * 2f64.powi(-53)
    }

    /// The board's time, by the last frame that went onto the line.
    fn ticks(&self) -> u32 {
        self.board.intact().last().map_or(0, |(_, ticks)| *ticks)
    }

    /// Does it, and sees to it that the capture runs again.
    fn befall(&mut self, event: Event) {
        let from = self.ticks().saturating_sub(ON_ITS_WAY);
        let pause = self.between(1.0, 3.0);
        match event {
            Event::Cable => {
                self.board.unplug();
                wait(pause);
                self.board.plug();
                // Told after 5 s of silence.
                wait(6.0);
            }
            Event::Kill => self.again("-KILL"),
            Event::Interrupt => self.again("-INT"),
            Event::Full | Event::KillFull => {
                let room = self.between(0.0, 200.0) as u64;
                limit_files(
                    self.running.0.id(),
                    Some(size(&self.raw).max(size(&self.out)) + room),
                );
                // The larger of the two files is over the limit first, the other one goes on for a while.
                wait(2.0 + pause);
                if event == Event::KillFull {
                    self.again("-KILL");
                } else {
                    limit_files(self.running.0.id(), None);
                    wait(1.5);
                    return;
                }
            }
            Event::Stop => {
                self.running.signal("-STOP");
                // What the system holds meanwhile is 4 KiB of the line: 3 s.
                wait(pause);
                self.running.signal("-CONT");
                wait(0.5);
            }
        }
        // Until the capture is known to have heard something new.
        let before = size(&self.raw);
        let began = Instant::now();
        while size(&self.raw) <= before + 200 {
            assert!(
                began.elapsed() < Duration::from_secs(180),
                "{event:?}: nothing arrives any more"
            );
            wait(0.05);
        }
        self.deaf.push([from, self.ticks()]);
    }

    /// Ends it by a signal and goes on.
    fn again(&mut self, signal: &str) {
        self.memory[1] = self.memory[1].max(self.running.resident());
        self.running.signal(signal);
        let ended = self.running.0.wait().expect("it ends").success();
        assert_eq!(ended, signal == "-INT", "{signal}");
        self.running = Running::start(&self.board, &self.out);
    }
}

/// So many seconds of it.
pub fn soak(seconds: f64, seed: u64) {
    let rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let damage = Damage {
        rng: rng.clone(),
        one_in: DAMAGED,
    };
    let swallow = Swallow {
        damage: Some(damage),
        ..Swallow::default()
    };
    let board = Board::with(Scenario::quiet(seed), swallow);
    let folder = folder("soak_line");
    let (out, raw) = (folder.join("run.csv"), folder.join("run.raw"));
    let running = Running::start(&board, &out);
    let mut trial = Trial {
        board,
        out,
        raw,
        running,
        rng,
        done: [0; EVENTS.len()],
        memory: [0; 2],
        deaf: Vec::new(),
    };
    wait(3.0);
    trial.memory[0] = trial.running.resident();
    let began = Instant::now();
    let mut told = 0;
    while began.elapsed().as_secs_f64() < seconds {
        let next: usize = trial.done.iter().map(|n| *n as usize).sum();
        // Each once in turn first, then at random.
        let k = match next {
            next if next < EVENTS.len() => next,
            _ => trial.between(0.0, EVENTS.len() as f64) as usize,
        };
        let quiet = trial.between(0.5, 4.0);
        wait(quiet);
        trial.befall(EVENTS[k]);
        trial.done[k] += 1;
        let minutes = (began.elapsed().as_secs() / 60) as u32;
        if minutes >= told + 5 {
            told = minutes;
            println!(
                "{minutes} min: {:?}",
                EVENTS.iter().zip(trial.done).collect::<Vec<_>>()
            );
        }
    }
    wait(1.0);
    trial.memory[1] = trial.memory[1].max(trial.running.resident());
    trial.running.signal("-INT");
    judge(trial, began.elapsed().as_secs_f64());
}

fn judge(trial: Trial, seconds: f64) {
    let Trial {
        board,
        out,
        raw,
        running,
        done,
        memory,
        deaf,
        ..
    } = trial;
    assert!(running.ended(), "the last capture ends in order");
    let arrived = samples(&fs::read(&raw).expect("raw bytes"));
    let read = read_capture(&out, &ReadOptions::default()).expect("a capture");
    let text = fs::read_to_string(&out).expect("text");
    let rows = as_sent(&text);
    assert_eq!(read.record.len(), rows.len(), "rows that are read");
    assert_eq!(
        rows.len(),
        arrived.len(),
        "rows, and samples of the raw bytes"
    );
    let other = rows
        .iter()
        .zip(&arrived)
        .position(|(row, sent)| row != sent);
    assert_eq!(other, None, "this row is not the sample of the raw bytes");
    // Every whole frame on the line has arrived, but where nobody listened.
    let intact = board.intact();
    let mut missing = 0;
    let mut there = arrived.iter().peekable();
    for (seq, ticks) in &intact {
        if there.next_if(|next| **next == (*seq, *ticks)).is_some() {
            continue;
        }
        missing += 1;
        let is_excused = deaf.iter().any(|[from, to]| (*from..=*to).contains(ticks));
        // The last ones may still have been on their way, and one behind a damaged end goes with it.
        let is_last = intact.last().is_some_and(|(_, last)| last - ticks < 50_000);
        let was_damaged_before =
            !intact.contains(&(seq.wrapping_sub(1), ticks.wrapping_sub(12_500)));
        assert!(
            is_excused || is_last || was_damaged_before,
            "sample {seq} at {ticks} ticks is missing"
        );
    }
    assert!(
        there.next().is_none(),
        "a sample arrived that was never sent"
    );
    println!(
        "{:.1} min of a live capture: {} samples went onto the line whole, {} are rows, {missing} reached nobody",
        seconds / 60.0,
        intact.len(),
        rows.len()
    );
    println!("{:?}", EVENTS.iter().zip(done).collect::<Vec<_>>());
    println!(
        "memory of the capture: {:.1} MiB at first, {:.1} MiB at the most",
        memory[0] as f64 / f64::from(1 << 20),
        memory[1] as f64 / f64::from(1 << 20)
    );
    assert!(memory[1] <= memory[0] + GROWTH, "{memory:?}");
}
