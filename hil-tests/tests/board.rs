//! What makes sense on a real board too. `IMU_STAND_PORT=/dev/ttyUSB0` runs it there, the motor's supply off or its belt
//! taken off; without it the simulated board takes its place, at a pseudo-terminal, in real time.
#![cfg(unix)]

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use bench::Scenario;
use hil_tests::{image, run};
use imu_stand::link::{DEFAULT_BAUD, Link};
use imu_stand::pty::{Line, PtyError, serve};
use imu_stand::stand::Board;
use wire::{Axis, Command, Frame, Sample, Status, flags};

/// One test at a time at the port.
static PORT: Mutex<()> = Mutex::new(());

struct Bench {
    /// Before a simulated board was started.
    begun: Instant,
    link: Link,
    stop: Arc<AtomicBool>,
    board: Option<JoinHandle<Result<(), PtyError>>>,
    _alone: MutexGuard<'static, ()>,
}

impl Bench {
    fn new() -> Self {
        let alone = PORT.lock().unwrap_or_else(PoisonError::into_inner);
        let stop = Arc::new(AtomicBool::new(false));
        let begun = Instant::now();
        let (name, board) = match std::env::var("IMU_STAND_PORT") {
            Ok(port) => (port, None),
            Err(_) => {
                let (line, name) = Line::open().expect("a pseudo-terminal");
                let flag = Arc::clone(&stop);
                let board = std::thread::spawn(move || {
                    serve(
                        line,
                        &Board::Image(image()),
                        &run(Scenario::quiet(3), 600.0),
                        &flag,
                    )
                });
                (name, Some(board))
            }
        };
        println!("the board at {name}");
        let link = Link::open(&name, DEFAULT_BAUD).expect("the port opens");
        let mut bench = Bench {
            begun,
            link,
            stop,
            board,
            _alone: alone,
        };
        // It may be starting: its sensors need 220 ms.
        bench.link.ask_hello().expect("it says hello");
        bench
    }

    fn samples(&mut self, seconds: f64) -> Vec<(f64, Sample)> {
        let begun = Instant::now();
        let mut samples = Vec::new();
        while begun.elapsed() < Duration::from_secs_f64(seconds) {
            self.link.read().expect("the line");
            while let Some(frame) = self.link.next() {
                if let Frame::Sample(sample) = frame {
                    samples.push((begun.elapsed().as_secs_f64(), sample));
                }
            }
        }
        samples
    }
}

impl Drop for Bench {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(board) = self.board.take() {
            let ended = board.join();
            if !std::thread::panicking() {
                ended
                    .expect("it did not panic")
                    .expect("the simulated board ran");
            }
        }
    }
}

#[test]
fn it_samples_at_its_rate_by_the_clock_on_the_wall_without_a_gap() {
    let mut bench = Bench::new();
    let begun = Instant::now();
    let samples = bench.samples(6.0);
    let (first, last) = (samples[0], samples[samples.len() - 1]);
    for pair in samples.windows(2) {
        assert_eq!(pair[1].1.seq, pair[0].1.seq.wrapping_add(1));
        assert_eq!(pair[1].1.t_ticks.wrapping_sub(pair[0].1.t_ticks), 12_500);
    }
    if bench.board.is_some() {
        // A busy machine holds a simulated board up, and then it makes good at more than its rate: what it may never be is
        // ahead of the wall.
        let since_start = last.0 + (begun - bench.begun).as_secs_f64();
        let tick_ns = bench.link.hello.expect("it said hello").tick_ns;
        let board = f64::from(last.1.t_ticks) * f64::from(tick_ns) * 1e-9;
        assert!(
            board <= since_start,
            "{board} s of the board in {since_start} s"
        );
    } else {
        // The arrival of the first and the last is known to some ten milliseconds.
        let rate = (samples.len() - 1) as f64 / (last.0 - first.0);
        assert!((0.99..1.01).contains(&(rate / 20.0)), "{rate} Hz");
    }
    let in_order = samples
        .iter()
        .filter(|(_, s)| s.flags & flags::IN_ORDER == flags::IN_ORDER);
    assert!(in_order.count() * 100 >= samples.len() * 99);
}

#[test]
fn at_rest_it_feels_gravity_and_no_turn() {
    let mut bench = Bench::new();
    let samples = bench.samples(4.0);
    let mean = |of: &dyn Fn(&Sample) -> f64| {
        samples.iter().map(|(_, sample)| of(sample)).sum::<f64>() / samples.len() as f64
    };
    let g = [0, 1, 2].map(|axis| (mean(&|s| f64::from(s.acc[axis])) - 512.0) / 248.2);
    let total = g.iter().map(|g| g * g).sum::<f64>().sqrt();
    // Zero-g offset and sensitivity as the data sheet allows them: 0.19 g and 7.5 %.
    assert!((0.7..1.3).contains(&total), "{total} g");
    for axis in 0..3 {
        let dps = mean(&|s| f64::from(s.gyro[axis])) * 0.07326;
        // Initial bias error, 3 deg/s (1 sigma: data sheet), four times.
        assert!(dps.abs() < 12.0, "gyro {axis}: {dps} deg/s");
    }
}

#[test]
fn commands_are_answered_once_each_and_registers_read_as_they_are_set() {
    let mut bench = Bench::new();
    let ping = bench.link.ask(Command::Ping).expect("an answer");
    assert_eq!(ping.status, Status::Ok);
    for gyro in [Axis::X, Axis::Y, Axis::Z] {
        let reply = bench
            .link
            .ask(Command::ReadRegister {
                gyro,
                address: 0x38,
            })
            .expect("an answer");
        assert_eq!(
            (reply.status, reply.value & 0x707),
            (Status::Ok, 0x402),
            "SENS/AVG of {gyro:?}"
        );
    }
    let health = bench.link.ask_health(false).expect("a health frame");
    assert!(health.stack_free > 0);
}
