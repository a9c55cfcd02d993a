//! A board for days of its own time, and the host's whole way from its bytes to the files: every counter of both comes round,
//! the line damages what it carries, set-ups and corrections are stored, the board restarts, and nothing may be lost unnoticed.
//!
//! Shared by crates/cli/tests/soak.rs (the firmware's logic) and hil-tests/tests/soak.rs (its image).

mod bad_line;

use std::cell::RefCell;
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::time::Instant;

use bench::Scenario;
use imu_stand::RecordBuilder;
use imu_stand::capture::{Calibration, Live};
use imu_stand::link::{Link, LinkError};
use imu_stand::monitor::View;
use imu_stand::stand::{Board, Simulated};
use wire::correction::{self, NUMBERS, ROWS};
use wire::{Axis, Command, Fault, Frame, Sample};

use bad_line::{Line, Truth};

/// How long and how.
pub struct Soak {
    /// Time of the board, s.
    pub seconds: f64,
    /// Draws the stand and the damage.
    pub seed: u64,
    /// Where its files go; they are read back and removed.
    pub folder: PathBuf,
}

/// Turns of the run in each of which one sound request is sent, and so many damaged ones: more of either than 16 bits count.
const TURNS: f64 = 30_000.0;
const DAMAGED_REQUESTS: u64 = 3;
/// Times that a set-up and a correction are stored: more than the generation's 8 bits count, also where the line damages the reply to
/// one in a hundred. A set-up whose reply is lost does not count: it may not have been stored.
const CORRECTIONS: f64 = 280.0;
/// Files, and lines about how it goes.
const PARTS: u64 = 30;
/// Files after which the board is reset. Its counters begin anew with each, so they are left alone from then on.
const RESETS: u64 = 6;
/// Growth of the process, bytes, from a tenth of the run to its end. What grew with time would have grown ninefold by then.
const GROWTH: u64 = 4 << 20;
/// A simulated board starts within this, s.
const START_S: f64 = 1.0;

/// What the host has seen so far.
#[derive(Default)]
struct Seen {
    samples: u64,
    /// Samples of the line that did not arrive.
    lost: u64,
    bytes_of_files: u64,
    rows: u64,
    /// Checksum of what was put into the file that is open.
    sum: u64,
    files: u64,
    seq_wraps: u64,
    tick_wraps: u64,
    millisecond_wraps: u64,
    last: Option<Sample>,
    healths: u64,
    bad_frames: u16,
    tick_busy_max: u16,
    stack_free: u16,
    requests: u64,
    unanswered: u64,
    corrections: u64,
    stored: u64,
    restarts: u64,
}

/// The host.
struct Host {
    truth: Rc<RefCell<Truth>>,
    seen: Seen,
    live: Option<Live>,
    view: View,
    restarts: Option<u16>,
    /// Numbers and ticks are about to begin anew.
    starts: bool,
    folder: PathBuf,
    start: Instant,
}

/// Counts of a row, mixed into a sum by which two lists of rows are compared in order.
fn mixed(sum: u64, values: impl Iterator<Item = i64>) -> u64 {
    // FNV-1a, by whole numbers.
    values.fold(sum, |sum, value| {
        (sum ^ value.cast_unsigned()).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

impl Host {
    fn path(&self, number: u64) -> PathBuf {
        self.folder.join(format!("part-{number:02}.csv"))
    }

    /// Takes a frame that arrived at `now` s.
    fn frame(&mut self, frame: &Frame, now: f64) {
        self.view.push(frame, now);
        match frame {
            Frame::Sample(sample) => self.sample(sample, now),
            Frame::Hello(hello) => {
                let before = self.restarts.replace(hello.restarts);
                if let Some(live) = &mut self.live {
                    live.hello(hello, before);
                } else {
                    let mut builder = RecordBuilder::new(Calibration::default());
                    builder.hello(hello);
                    let path = self.path(1);
                    let live = Live::create(&path, builder.calibration(), &[], Some(0.0));
                    self.live = Some(live.expect("a file"));
                    self.seen.files = 1;
                }
            }
            Frame::Health(health) => {
                self.seen.healths += 1;
                self.seen.tick_busy_max = self.seen.tick_busy_max.max(health.tick_busy_max);
                self.seen.stack_free = self.seen.stack_free.min(health.stack_free);
                self.seen.bad_frames = self
                    .seen
                    .bad_frames
                    .max(health.faults.get(Fault::RxBadFrame));
                for fault in Fault::all() {
                    let count = health.faults.get(fault);
                    let may = matches!(fault, Fault::RxBadFrame | Fault::WatchdogReset);
                    assert!(may || count == 0, "{fault:?}: {count} at {now:.0} s");
                }
            }
            Frame::Corrected(_) | Frame::Reply(_) => {}
        }
    }

    fn sample(&mut self, sample: &Sample, now: f64) {
        // Whatever arrives was sent, whole and in this order.
        loop {
            let sent = self.truth.borrow_mut().samples.pop_front();
            let sent = sent.unwrap_or_else(|| panic!("{sample:?} at {now:.3} s was never sent"));
            if sent == *sample {
                break;
            }
            self.seen.lost += 1;
        }
        let begins = |last: &Sample| self.starts && sample.t_ticks < last.t_ticks;
        if self.seen.last.as_ref().is_some_and(begins) {
            (self.seen.last, self.starts) = (None, false);
        }
        if let Some(last) = self.seen.last.replace(*sample) {
            let steps = sample.seq.wrapping_sub(last.seq);
            let ticks = sample.t_ticks.wrapping_sub(last.t_ticks);
            assert_eq!(ticks, u32::from(steps) * 12_500, "at {now:.3} s");
            self.seen.seq_wraps += u64::from(sample.seq < last.seq);
            self.seen.tick_wraps += u64::from(sample.t_ticks < last.t_ticks);
        }
        self.seen.millisecond_wraps = (now * 1000.0 / 65_536.0) as u64;
        self.seen.samples += 1;
        let Some(live) = &mut self.live else { return };
        live.push(sample, now).expect("it is written");
        self.seen.rows += 1;
        self.seen.sum = mixed(self.seen.sum, counts(sample));
        if self.seen.rows.is_multiple_of(200) {
            live.flush().expect("it is written");
        }
    }

    /// Ends the file, reads it back, removes it, and begins another.
    fn next_file(&mut self, goes_on: bool) {
        let Some(live) = self.live.take() else { return };
        let path = live.path().to_owned();
        if goes_on {
            let next = self.path(self.seen.files + 1);
            self.live = Some(live.next_part(&next, &[]).expect("another file"));
        } else {
            live.finish().expect("it is written");
        }
        let (rows, sum) = read_back(&path);
        assert_eq!(
            (rows, sum),
            (self.seen.rows, self.seen.sum),
            "{}",
            path.display()
        );
        self.seen.bytes_of_files += path.metadata().expect("it is there").len();
        std::fs::remove_file(&path).expect("it is removed");
        self.seen.files += u64::from(goes_on);
        (self.seen.rows, self.seen.sum) = (0, 0);
    }

    fn say(&self, now: f64, link: &Link) {
        let seen = &self.seen;
        println!(
            "{:7.2} h of the board, {:5.0} s here: {} samples, {} lost on the line, {} rejected; memory {:.1} MiB",
            now / 3600.0,
            self.start.elapsed().as_secs_f64(),
            seen.samples,
            seen.lost,
            link.heard().counts.rejected(),
            resident() as f64 / f64::from(1 << 20)
        );
    }
}

/// What a row has of a sample.
fn counts(sample: &Sample) -> impl Iterator<Item = i64> + use<> {
    let (seq, ticks) = (i64::from(sample.seq), i64::from(sample.t_ticks));
    let gyro = sample.gyro.map(i64::from);
    [seq, ticks].into_iter().chain(gyro)
}

/// Number of rows of a file and their sum; numbers and ticks as the board sent them. Only rising numbers at even steps pass.
fn read_back(path: &Path) -> (u64, u64) {
    let (mut rows, mut sum) = (0, 0);
    let (mut offsets, mut last) = ((0, 0), None::<(i64, i64)>);
    for line in BufReader::new(std::fs::File::open(path).expect("the file")).lines() {
        let line = line.expect("text");
        if let Some(told) = line.strip_prefix("# offsets: seq ") {
            let (seq, ticks) = told.split_once(" t_ticks ").expect("both");
            offsets = (
                seq.parse().expect("a number"),
                ticks.parse().expect("a number"),
            );
        }
        if !line.starts_with(|c: char| c.is_ascii_digit()) {
            continue;
        }
        let cells: Vec<&str> = line.splitn(7, ',').collect();
        let cell = |at: usize| cells[at].parse::<i64>().expect("a whole number");
        let (seq, ticks) = (cell(0), cell(1));
        if let Some((before, ticks_before)) = last.replace((seq, ticks)) {
            assert!(seq > before, "{line}");
            assert_eq!(ticks - ticks_before, (seq - before) * 12_500, "{line}");
        }
        let raw = [
            (seq - offsets.0).rem_euclid(1 << 16),
            (ticks - offsets.1).rem_euclid(1 << 32),
        ];
        sum = mixed(sum, raw.into_iter().chain([cell(3), cell(4), cell(5)]));
        rows += 1;
    }
    (rows, sum)
}

/// Memory of this process, bytes; 0 where the system does not say.
pub fn resident() -> u64 {
    let told = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
    let pages = told
        .split_whitespace()
        .nth(1)
        .and_then(|n| n.parse::<u64>().ok());
    // Pages of 4 KiB, as every Linux on x86-64 has them.
    pages.unwrap_or(0) * 4096
}

/// Asks, and hands on what comes meanwhile; a request or reply that the line spoilt is asked for again by the link.
fn ask(link: &mut Link, host: &mut Host, command: Command) -> Option<wire::Reply> {
    let mut frames = Vec::new();
    host.seen.requests += 1;
    let reply = link.ask_any(command, |frame| frames.push(*frame));
    let now = link.now().as_secs_f64();
    frames.iter().for_each(|frame| host.frame(frame, now));
    match reply {
        Ok(reply) => Some(reply),
        Err(LinkError::NoReply { .. } | LinkError::Unknown { .. }) => {
            host.seen.unanswered += 1;
            None
        }
        Err(error) => panic!("{error}"),
    }
}

/// Stores a correction that corrects nothing, and switches it off again.
fn correct(link: &mut Link, host: &mut Host, number: u64) {
    let generation = (number % 256) as u8;
    let mut numbers = [0; NUMBERS];
    numbers[0] = i16::from_le_bytes([correction::FORMAT, generation]);
    numbers[1] = (number % 1000) as i16;
    // The part's set-up after a start: 320 deg/s, the filter of the built-in set-up.
    numbers[3] = link.hello.map_or(0, |hello| {
        i16::from_le_bytes([hello.gyro_filter, hello.gyro_range])
    });
    numbers[4] = i16::from_le_bytes([0x80, 0x7f]);
    let mut is_stored = true;
    for (row, three) in (0u8..).zip(numbers.chunks_exact(3)) {
        let values = [three[0], three[1], three[2]];
        is_stored &= ask(link, host, Command::SetCorrection { row, values }).is_some();
    }
    let crc = Command::SetCorrection {
        row: ROWS as u8,
        values: correction::crc_row(&numbers),
    };
    let answer = ask(link, host, crc);
    is_stored &= answer.is_none_or(|reply| reply.status == wire::Status::Ok);
    // What is read back says it, with or without a reply.
    let in_use = Command::GetCorrection {
        other: false,
        row: 0,
    };
    let read = ask(link, host, in_use).map(|reply| reply.detail[0] as i16);
    is_stored &= read.is_none_or(|number| number == numbers[0]);
    host.seen.corrections += u64::from(is_stored);
    ask(link, host, Command::Correction { on: false });
}

/// Runs it to its end, and says what was seen.
pub fn soak(board: Board, plan: &Soak) {
    let truth = Rc::new(RefCell::new(Truth::default()));
    let stand = Simulated::start(board, Scenario::quiet(plan.seed));
    let line = Line::new(stand, plan.seed, Rc::clone(&truth));
    let mut link = Link::over(Box::new(line), "the simulated board", 38_400);
    let mut host = Host {
        truth,
        seen: Seen {
            stack_free: u16::MAX,
            ..Seen::default()
        },
        live: None,
        view: View::new(),
        restarts: None,
        starts: false,
        folder: plan.folder.clone(),
        start: Instant::now(),
    };
    let every = |count: f64| plan.seconds / count;
    let (mut request, mut stored, mut part) = (START_S, START_S, every(PARTS as f64));
    let mut early = 0;
    // A board that starts hears nothing yet, and counts what it loses.
    while host.live.is_none() {
        link.read().expect("the board runs");
        if link.now().as_secs_f64() > START_S {
            ask(&mut link, &mut host, Command::GetHello);
        }
        let now = link.now().as_secs_f64();
        while let Some(frame) = link.next() {
            host.frame(&frame, now);
        }
    }
    loop {
        link.read().expect("the board runs");
        let now = link.now().as_secs_f64();
        while let Some(frame) = link.next() {
            host.frame(&frame, now);
        }
        if now >= plan.seconds {
            break;
        }
        if now >= request {
            request += every(TURNS);
            for _ in 0..DAMAGED_REQUESTS {
                host.truth.borrow_mut().damages_request = true;
                link.send(Command::Ping).expect("it is sent");
                host.seen.requests += 1;
            }
            ask(&mut link, &mut host, Command::Ping);
        }
        if now >= stored {
            stored += every(CORRECTIONS);
            let bias = Command::SetBias {
                axis: Axis::X,
                value: now as i32,
            };
            ask(&mut link, &mut host, bias);
            let done = ask(&mut link, &mut host, Command::StoreConfig);
            host.seen.stored += u64::from(done.is_some_and(|r| r.status == wire::Status::Ok));
            let number = host.seen.corrections;
            correct(&mut link, &mut host, number);
        }
        if now >= part {
            part += every(PARTS as f64);
            host.next_file(true);
            host.say(now, &link);
            if early == 0 && now >= plan.seconds / 10.0 {
                early = resident();
            }
            if host.seen.restarts < RESETS {
                host.starts = true;
                ask(&mut link, &mut host, Command::Reboot);
                host.seen.restarts += 1;
                (request, stored) = (request.max(now + START_S), stored.max(now + START_S));
            }
        }
    }
    let last = resident();
    host.next_file(false);
    judge(&host, &link, plan, [early, last]);
}

/// Whether everything adds up.
fn judge(host: &Host, link: &Link, plan: &Soak, [early, last]: [u64; 2]) {
    let (seen, heard) = (&host.seen, link.heard());
    let damaged = host.truth.borrow().damaged;
    let snapshot = host.view.snapshot(&heard);
    println!(
        "{} samples in {} files ({} MB), {} lost of {damaged} frames that the line damaged",
        seen.samples,
        seen.files,
        seen.bytes_of_files / 1_000_000,
        seen.lost
    );
    println!(
        "came round: milliseconds {} times, numbers {}, ticks {}, numbers of requests {}, generation of corrections {}",
        seen.millisecond_wraps,
        seen.seq_wraps,
        seen.tick_wraps,
        seen.requests / 65_536,
        seen.corrections / 256
    );
    println!(
        "stored: {} set-ups, {} corrections; {} restarts; damaged requests: the board counts {} (65535: at least)",
        seen.stored, seen.corrections, seen.restarts, seen.bad_frames
    );
    println!(
        "{} requests, {} without an answer; {} health frames; longest tick {} ticks, least stack {} B",
        seen.requests, seen.unanswered, seen.healths, seen.tick_busy_max, seen.stack_free
    );
    println!(
        "memory {:.1} MiB after a tenth, {:.1} MiB at the end; {:.0} s here",
        early as f64 / f64::from(1 << 20),
        last as f64 / f64::from(1 << 20),
        host.start.elapsed().as_secs_f64()
    );
    // A frame whose end was damaged takes the next with it.
    assert!(seen.lost <= 2 * damaged, "{} {damaged}", seen.lost);
    let (losses, total) = (heard.losses, plan.seconds * 20.0);
    assert_eq!(losses.device, 0, "{losses:?}");
    assert_eq!(losses.out_of_order, 0, "{losses:?}");
    assert_eq!(losses.received, seen.samples);
    let told = losses.line + losses.unattributed;
    // What is lost beside a restart has no number after it.
    assert!(
        told <= seen.lost && seen.lost <= told + 2 * seen.restarts,
        "{told} {}",
        seen.lost
    );
    // A start costs some ten samples.
    let there = (seen.samples + seen.lost) as f64;
    let starts = 20.0 * (seen.restarts + 1) as f64;
    assert!(
        there <= total && total <= there + starts,
        "{there} of {total}"
    );
    assert_eq!(snapshot.samples, seen.samples);
    assert_eq!(seen.files, PARTS);
    assert_eq!(seen.restarts, RESETS);
    // All counters that come round within the time, and those that stop at their end.
    let turns = |period: f64| (plan.seconds / period) as u64;
    assert!(seen.millisecond_wraps >= turns(66.0));
    assert!(seen.requests > 65_536, "{}", seen.requests);
    assert_eq!(seen.bad_frames, u16::MAX);
    assert!(seen.seq_wraps >= turns(3_300.0).saturating_sub(RESETS));
    assert!(seen.tick_wraps >= turns(17_200.0).saturating_sub(RESETS));
    assert!(seen.corrections > 256 && seen.stored > 256);
    assert!(
        seen.unanswered * 1000 < seen.requests,
        "{}",
        seen.unanswered
    );
    assert!(early == 0 || last <= early + GROWTH, "{early} {last}");
}
