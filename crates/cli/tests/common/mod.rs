//! A simulated board behind a real serial device (a pseudo-terminal), and the program run as a user runs it.
#![allow(dead_code)] // Each test binary uses its own part.

use std::io::Write as _;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use bench::{Run, Scenario, Timeline};
use imu_stand::pty::{Cable, Pace};
use serialport::{SerialPort as _, TTYPort};
use wire::{Decoder, Frame, Request, RequestDecoder, encode_request};

/// The program with these arguments, waited for.
pub fn run(arguments: &[&str]) -> Output {
    program(arguments).output().expect("the program starts")
}

/// The program with these arguments.
pub fn program(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_imu-stand"));
    command.args(arguments).env_remove("IMU_STAND_PORT");
    command
}

/// The same, without the pseudo-terminals' own ends, which a process inherits here: only without them does it see that
/// a port is gone.
pub fn program_alone(arguments: &[&str]) -> Command {
    const CLOSE: &str = "for fd in /dev/fd/*; do fd=${fd##*/}; [ $fd -gt 2 ] && eval \"exec $fd>&-\"; done; \
                         exec \"$@\"";
    let mut command = Command::new("bash");
    command
        .args(["-c", CLOSE, "bash", env!("CARGO_BIN_EXE_imu-stand")])
        .args(arguments)
        .env_remove("IMU_STAND_PORT");
    command
}

/// The command, in which a write over the limit of a file's size fails with EFBIG, as one on a full disk does with ENOSPC,
/// where it would kill it by default.
pub fn unkilled_by_limits(command: &Command) -> Command {
    let mut shell = Command::new("bash");
    shell
        .args(["-c", "trap '' XFSZ; exec \"$@\"", "bash"])
        .arg(command.get_program())
        .args(command.get_args())
        .env_remove("IMU_STAND_PORT");
    shell
}

/// Sets how large the files of a process may grow.
#[cfg(target_os = "linux")]
pub fn limit_files(process: u32, bytes: Option<u64>) {
    let most = bytes.unwrap_or(libc::RLIM_INFINITY);
    let limit = libc::rlimit {
        rlim_cur: most,
        rlim_max: libc::RLIM_INFINITY,
    };
    // SAFETY: the limit lives through the call, and what it was is not asked for.
    let done = unsafe {
        libc::prlimit(
            process as libc::pid_t,
            libc::RLIMIT_FSIZE,
            &raw const limit,
            std::ptr::null_mut(),
        )
    };
    assert_eq!(done, 0, "{}", std::io::Error::last_os_error());
}

/// What it printed, both ways, on one line: errors are wrapped to the width of a terminal.
pub fn said(output: &Output) -> String {
    let both =
        [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned());
    let words: Vec<&str> = both
        .iter()
        .flat_map(|text| text.split_whitespace())
        .filter(|word| *word != "│")
        .collect();
    words.join(" ")
}

/// It succeeded; what it said.
pub fn assert_success(output: &Output) -> String {
    let said = said(output);
    assert_eq!(output.status.code(), Some(0), "{said}");
    said
}

/// It failed and said each of these; all that it said.
pub fn assert_refused(output: &Output, needles: &[&str]) -> String {
    ended_with(1, output, needles)
}

/// It was used wrongly and said each of these; all that it said.
pub fn assert_misused(output: &Output, needles: &[&str]) -> String {
    ended_with(2, output, needles)
}

fn ended_with(code: i32, output: &Output, needles: &[&str]) -> String {
    let said = said(output);
    assert_eq!(output.status.code(), Some(code), "{said}");
    for needle in needles {
        assert!(said.contains(needle), "no `{needle}` in: {said}");
    }
    said
}

/// A folder of this test's own, new at each run.
pub fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&path);
    std::fs::create_dir_all(&path).expect("a folder for the test");
    path
}

/// A file as JSON.
pub fn json(path: &Path) -> serde_json::Value {
    serde_json::from_str(&std::fs::read_to_string(path).expect("the JSON is there"))
        .expect("it is JSON")
}

/// What the cable swallows.
#[derive(Clone, Debug, Default)]
pub struct Swallow {
    /// Replies to commands of these codes: each entry one reply.
    pub replies: Vec<u8>,
    /// Requests of these codes: each entry one request.
    pub requests: Vec<u8>,
    /// Sample frames with these sequence numbers.
    pub samples: Vec<u16>,
    /// Frames at random: a byte flipped, a byte lost, the whole frame lost.
    pub damage: Option<Damage>,
}

/// Damage at random, the same at each run of a seed.
#[derive(Clone, Debug)]
pub struct Damage {
    /// Draws it.
    pub rng: rand_xoshiro::Xoshiro256PlusPlus,
    /// One frame in so many.
    pub one_in: u64,
}

impl Damage {
    /// A number below `n`.
    fn below(&mut self, n: u64) -> u64 {
        ((u128::from(rand_core::Rng::next_u64(&mut self.rng)) * u128::from(n)) >> 64) as u64
    }

    /// Damages a frame, or leaves it as it is; whether it is intact.
    pub fn pass(&mut self, frame: &mut Vec<u8>) -> bool {
        if self.below(self.one_in) > 0 {
            return true;
        }
        let at = self.below(frame.len() as u64) as usize;
        match self.below(3) {
            0 => frame[at] ^= 1 << self.below(8),
            1 => drop(frame.remove(at)),
            _ => frame.clear(),
        }
        false
    }
}

/// What the board's thread and the tests' share.
#[derive(Default)]
struct Shared {
    /// Both ends of the line; `None` while it is unplugged.
    ends: Mutex<Option<(TTYPort, TTYPort)>>,
    /// Bytes that the board is sent by somebody else.
    aside: Mutex<Vec<u8>>,
    /// Samples that were sent while nothing was plugged in.
    unheard: AtomicU64,
    /// Samples whose frames went onto the line whole, in their order: number and ticks.
    intact: Mutex<Vec<(u16, u32)>>,
    stop: AtomicBool,
}

/// A clock that stands while a busy computer holds up the host that keeps the motor alive, as no host is held up that has a
/// computer for itself: a test of minutes is not to end by a motor that was cut.
#[derive(Clone, Copy, Debug, Default)]
struct Leash {
    /// When the motor was kept alive last, s; `None` while it is off.
    alive_s: Option<f64>,
}

impl Leash {
    /// So long after the last keep-alive the clock stands, s: the board cuts the motor after 0.2.
    const REACH_S: f64 = 0.15;
    /// A host that says nothing for so long has gone.
    const MOST: Duration = Duration::from_secs(10);

    /// A request arrives at `t` s.
    fn hears(&mut self, command: &wire::Command, t: f64) {
        match command {
            wire::Command::MotorDuty { duty: 0 } => self.alive_s = None,
            wire::Command::Arm { nonce: 0 } => {}
            wire::Command::Arm { .. }
            | wire::Command::KeepAlive
            | wire::Command::MotorDuty { .. } => self.alive_s = Some(t),
            _ => {}
        }
    }

    /// Holds the clock at `t` s until the host speaks again, if that is due.
    fn hold(&mut self, shared: &Shared, t: f64) {
        let waited = Instant::now();
        while self.alive_s.is_some_and(|alive| t - alive > Self::REACH_S) {
            let speaks = match &*shared.ends.lock().unwrap() {
                Some((master, _)) => master.bytes_to_read().is_ok_and(|count| count > 0),
                None => false,
            };
            if speaks {
                return;
            }
            if waited.elapsed() > Self::MOST || shared.stop.load(Ordering::Relaxed) {
                self.alive_s = None;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
    }
}

/// The simulated board, in real time, on a pseudo-terminal.
pub struct Board {
    /// A link to the device, whose name changes when it is plugged in again.
    path: PathBuf,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Board {
    /// A sound stand.
    pub fn start() -> Self {
        Self::with(Scenario::quiet(1), Swallow::default())
    }

    /// This stand, behind this cable.
    pub fn with(scenario: Scenario, swallow: Swallow) -> Self {
        Self::served(scenario, swallow, None)
    }

    /// This stand, which waits for a host that is held up while it keeps the motor alive.
    pub fn that_waits(scenario: Scenario) -> Self {
        Self::served(scenario, Swallow::default(), Some(Leash::default()))
    }

    fn served(scenario: Scenario, swallow: Swallow, leash: Option<Leash>) -> Self {
        static NUMBER: AtomicUsize = AtomicUsize::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let name = format!("port-{}-{number}", std::process::id());
        let mut board = Board {
            path: Path::new(env!("CARGO_TARGET_TMPDIR")).join(name),
            shared: Arc::default(),
            thread: None,
        };
        board.plug();
        let shared = Arc::clone(&board.shared);
        board.thread = Some(std::thread::spawn(move || {
            serve(&shared, scenario, swallow, leash);
        }));
        board
    }

    /// Plugs the cable in.
    pub fn plug(&self) {
        let (mut master, slave) = TTYPort::pair().expect("a pseudo-terminal");
        (master.set_timeout(Duration::ZERO)).expect("a pseudo-terminal takes a timeout");
        let device = slave.name().expect("it has a name");
        let _ = std::fs::remove_file(&self.path);
        std::os::unix::fs::symlink(device, &self.path).expect("a link to it");
        // The slave stays open here, so that the line lives on between two runs of the program.
        *self.shared.ends.lock().unwrap() = Some((master, slave));
    }

    /// Pulls it out; the board goes on.
    pub fn unplug(&self) {
        let _ = std::fs::remove_file(&self.path);
        *self.shared.ends.lock().unwrap() = None;
    }

    /// Samples that it sent while the cable was out.
    pub fn unheard(&self) -> u64 {
        self.shared.unheard.load(Ordering::Relaxed)
    }

    /// Samples whose frames went onto the line whole, in their order: number and ticks.
    pub fn intact(&self) -> Vec<(u16, u32)> {
        self.shared.intact.lock().unwrap().clone()
    }

    /// Sends the board a command without the program's knowledge.
    pub fn send_aside(&self, command: wire::Command) {
        let mut line = [0; Request::FRAME_LEN];
        let request = Request { number: 7, command };
        let length = encode_request(&request, &mut line).expect("it fits");
        self.shared.aside.lock().unwrap().extend(&line[..length]);
    }

    /// The device.
    pub fn port(&self) -> &str {
        self.path.to_str().expect("a plain path")
    }

    /// `imu-stand board --port P ...`
    pub fn ask(&self, arguments: &[&str]) -> Output {
        let mut all = vec!["board", "--port", self.port()];
        all.extend(arguments);
        run(&all)
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
        let _ = std::fs::remove_file(&self.path);
    }
}

fn taken(list: &mut Vec<u8>, code: u8) -> bool {
    let at = list.iter().position(|c| *c == code);
    at.map(|at| list.remove(at)).is_some()
}

fn serve(shared: &Shared, scenario: Scenario, swallow: Swallow, mut leash: Option<Leash>) {
    let swallow = std::cell::RefCell::new(swallow);
    let run = Run {
        scenario,
        seconds: 1e5,
        requests: vec![],
    };
    let (mut pace, mut cable) = (Pace::default(), Cable::default());
    let mut requests = RequestDecoder::new();
    let mut request = Vec::new();
    let listen = |t: f64| {
        if let Some(leash) = &mut leash {
            leash.hold(shared, t);
        }
        pace.wait(t);
        let arrived = match &mut *shared.ends.lock().unwrap() {
            Some((master, _)) => cable.read(master, t).unwrap_or_default(),
            None => Vec::new(),
        };
        let mut through = std::mem::take(&mut *shared.aside.lock().unwrap());
        for byte in arrived {
            request.push(byte);
            let decoded = requests.push(byte);
            if let (Some(leash), Some(Ok(request))) = (&mut leash, &decoded) {
                leash.hears(&request.command, t);
            }
            if byte == 0 {
                let lost = matches!(&decoded, Some(Ok(r))
                    if taken(&mut swallow.borrow_mut().requests, r.command.code()));
                if !lost {
                    through.append(&mut request);
                }
                request.clear();
            }
        }
        through
    };
    let (mut frames, mut frame) = (Decoder::new(), Vec::new());
    bench::native_live(&run, &Timeline::default(), listen, |received| {
        frame.push(received.byte);
        let decoded = frames.push(received.byte);
        if received.byte == 0 {
            let swallow = &mut *swallow.borrow_mut();
            let lost = match &decoded {
                Some(Ok(Frame::Reply(reply))) => taken(&mut swallow.replies, reply.command),
                Some(Ok(Frame::Sample(sample))) => swallow.samples.contains(&sample.seq),
                _ => false,
            };
            let is_whole = swallow.damage.as_mut().is_none_or(|d| d.pass(&mut frame));
            match (lost, &mut *shared.ends.lock().unwrap()) {
                // A line that nobody reads overflows.
                (false, Some((master, _))) => {
                    let is_sent = master.write_all(&frame).is_ok();
                    if let (true, true, Some(Ok(Frame::Sample(s)))) = (is_sent, is_whole, decoded) {
                        shared.intact.lock().unwrap().push((s.seq, s.t_ticks));
                    }
                }
                (false, None) if matches!(decoded, Some(Ok(Frame::Sample(_)))) => {
                    shared.unheard.fetch_add(1, Ordering::Relaxed);
                }
                _ => {}
            }
            frame.clear();
        }
        if shared.stop.load(Ordering::Relaxed) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    });
}
