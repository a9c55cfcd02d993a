//! `imu-stand run --pty`: the simulated board as a serial device, in real time.

use std::io::{ErrorKind, Read, Write};
use std::ops::ControlFlow;
use std::os::fd::AsRawFd;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use bench::{Run, SerialByte, Timeline, native_live};
use imu_stand::stand::{Hidden, plan};
use miette::{IntoDiagnostic, Result, WrapErr};
use serialport::{SerialPort, TTYPort};

use super::run::Board;

/// The board's end of a pseudo-terminal.
struct Line {
    port: TTYPort,
    /// Bytes on their way to whoever has the other end open.
    out: Vec<u8>,
}

impl Line {
    /// Opens a pair; returns this end and the other's name.
    fn open() -> Result<(Self, String)> {
        let (mut port, other) = TTYPort::pair()
            .into_diagnostic()
            .wrap_err("cannot make a pseudo-terminal")?;
        port.set_timeout(Duration::ZERO).into_diagnostic()?;
        let name = other.name().unwrap_or_default();
        Ok((
            Line {
                port,
                out: Vec::new(),
            },
            name,
        ))
    }

    /// Whether somebody has the other end open.
    fn is_heard(&self) -> bool {
        let mut poll = libc::pollfd {
            fd: self.port.as_raw_fd(),
            events: libc::POLLOUT,
            revents: 0,
        };
        // SAFETY: one descriptor, which is open.
        let ready = unsafe { libc::poll(&raw mut poll, 1, 0) };
        ready > 0 && poll.revents & libc::POLLHUP == 0
    }

    /// Hands on what the board has sent: as on a cable, what nobody hears is gone.
    fn flush(&mut self) {
        if self.is_heard() && !self.out.is_empty() {
            // A reader that does not keep up loses bytes, and the decoder tells it so.
            let _lost = self.port.write(&self.out);
        }
        self.out.clear();
    }

    /// What the other end has sent.
    fn take(&mut self) -> Result<Vec<u8>> {
        let mut buffer = [0; 256];
        match self.port.read(&mut buffer) {
            Ok(count) => Ok(buffer[..count].to_vec()),
            Err(error)
                if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock)
                    || error.raw_os_error() == Some(libc::EIO)
                    || error.kind() == ErrorKind::BrokenPipe =>
            {
                Ok(Vec::new())
            }
            Err(error) => Err(error).into_diagnostic().wrap_err("the pseudo-terminal"),
        }
    }
}

/// Runs until the time is over or Ctrl-C comes.
pub fn run(board: &Board, hide: Hidden, seconds: f64, seed: u64) -> Result<()> {
    let mut plan = plan(hide, seconds, seed);
    // Whoever opens the port drives the motor.
    plan.run.requests.clear();
    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed)).into_diagnostic()?;
    let (line, name) = Line::open()?;
    say!("the board is at {name} for {seconds} s, in real time; Ctrl-C ends it");
    say!("  imu-stand capture --port {name} --out capture.csv");
    let line = std::cell::RefCell::new(line);
    let begun = Instant::now();
    let mut failure = None;
    let listen = |t: f64| {
        let wait = Duration::from_secs_f64(t).saturating_sub(begun.elapsed());
        std::thread::sleep(wait);
        let mut line = line.borrow_mut();
        line.flush();
        line.take().unwrap_or_else(|error| {
            failure.get_or_insert(error);
            stop.store(true, Ordering::Relaxed);
            Vec::new()
        })
    };
    let receive = |received: SerialByte| {
        line.borrow_mut().out.push(received.byte);
        if stop.load(Ordering::Relaxed) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    };
    play(board, &plan.run, listen, receive)?;
    failure.map_or(Ok(()), Err)
}

fn play(
    board: &Board,
    run: &Run,
    listen: impl FnMut(f64) -> Vec<u8>,
    receive: impl FnMut(SerialByte) -> ControlFlow<()>,
) -> Result<()> {
    match board {
        Board::Native => {
            native_live(run, &Timeline::default(), listen, receive);
        }
        #[cfg(feature = "simavr")]
        Board::Image(image) => {
            bench::simavr::simavr_live(image, run, listen, receive)
                .map_err(super::run::image_error)?;
        }
    }
    Ok(())
}
