//! The simulated board as a serial device, in real time: a pseudo-terminal on which everything works that works on a
//! board's port.

use std::cell::RefCell;
use std::io::{self, ErrorKind, Read, Write};
use std::ops::ControlFlow;
use std::os::fd::AsRawFd;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use bench::{Run, SerialByte};
use serialport::{SerialPort, TTYPort};

use crate::link::DEFAULT_BAUD;
use crate::stand::{Board, Stopped};

/// Why the board cannot be served any longer.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PtyError {
    /// No pair of terminals.
    #[error("cannot make a pseudo-terminal")]
    Open(#[source] serialport::Error),
    /// This end has failed.
    #[error("the pseudo-terminal failed")]
    Line(#[source] io::Error),
    /// The image does not load, or stopped.
    #[error(transparent)]
    Image(#[from] Stopped),
}

/// The host's line to the board, which takes its time for each byte. A pseudo-terminal hands over at once whatever has piled up in
/// it, as keep-alives do while a busy computer holds the board up; answers to all of them at one moment fill the board's queue
/// and cost a sample, which a board on a cable does not lose.
#[derive(Clone, Copy, Debug, Default)]
pub struct Cable {
    /// When it was asked last, s.
    last_s: f64,
    /// Part of a byte that is under way.
    part: f64,
}

/// The most that is read at once.
const MOST: usize = 4096;

impl Cable {
    /// How many bytes at most arrive between the last call and `t` s, at a speed of the line.
    pub fn carries(&mut self, t: f64, baud: u32) -> usize {
        let bytes = (t - self.last_s).max(0.0) * f64::from(baud) / 10.0 + self.part;
        let whole = (bytes as usize).min(MOST);
        (self.last_s, self.part) = (self.last_s.max(t), bytes.fract());
        whole
    }

    /// Reads what has arrived at the board by `t` s since power came on.
    ///
    /// # Errors
    /// The pseudo-terminal's, where it is not that nobody is there or nothing has come.
    pub fn read(&mut self, port: &mut TTYPort, t: f64) -> io::Result<Vec<u8>> {
        // Both ends have the speed that the host has set.
        let baud = port.baud_rate().unwrap_or(DEFAULT_BAUD);
        let mut buffer = vec![0; self.carries(t, baud)];
        if buffer.is_empty() {
            return Ok(buffer);
        }
        match port.read(&mut buffer) {
            Ok(count) => {
                buffer.truncate(count);
                Ok(buffer)
            }
            Err(error)
                if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock)
                    || error.raw_os_error() == Some(libc::EIO)
                    || error.kind() == ErrorKind::BrokenPipe =>
            {
                Ok(Vec::new())
            }
            Err(error) => Err(error),
        }
    }
}

/// The board's end of a pseudo-terminal.
pub struct Line {
    port: TTYPort,
    cable: Cable,
    /// Bytes on their way to whoever has the other end open.
    out: Vec<u8>,
}

impl Line {
    /// Opens a pair; returns this end and the other's name.
    ///
    /// # Errors
    /// [`PtyError::Open`].
    pub fn open() -> Result<(Self, String), PtyError> {
        let (mut port, other) = TTYPort::pair().map_err(PtyError::Open)?;
        port.set_timeout(Duration::ZERO).map_err(PtyError::Open)?;
        let name = other.name().unwrap_or_default();
        Ok((
            Line {
                port,
                cable: Cable::default(),
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

    /// What the other end has sent and has arrived by `t` s.
    fn take(&mut self, t: f64) -> io::Result<Vec<u8>> {
        self.cable.read(&mut self.port, t)
    }
}

/// Holds a simulated board to the clock on the wall. What it is behind, on a busy computer, it makes good a quarter
/// faster than time and no more, so that whoever keeps its motor alive is not too late through no fault of their own. By how much a
/// short sleep lasts too long is made good at once, or a board of many sleeps would never come back to the clock.
#[derive(Debug)]
pub struct Pace {
    began: Instant,
    last: Instant,
    last_s: f64,
}

/// Simulated seconds in a second, at the most.
const HASTE: f64 = 1.25;
/// What is made good at once: a twentieth of the 200 ms after which the motor is cut.
const AT_ONCE: Duration = Duration::from_millis(10);

impl Default for Pace {
    /// Time 0 is now.
    fn default() -> Self {
        let began = Instant::now();
        Pace {
            began,
            last: began,
            last_s: 0.0,
        }
    }
}

impl Pace {
    /// Waits until `t` s may be reached.
    pub fn wait(&mut self, t: f64) {
        let from = self.from(t);
        std::thread::sleep(from.saturating_duration_since(Instant::now()));
        self.reached(t, from, Instant::now());
    }

    /// From when on `t` s may be reached.
    fn from(&self, t: f64) -> Instant {
        let due = self.began + Duration::from_secs_f64(t);
        due.max(self.last + Duration::from_secs_f64((t - self.last_s).max(0.0) / HASTE))
    }

    /// It was to be from `from` on, and is.
    fn reached(&mut self, t: f64, from: Instant, now: Instant) {
        let late = now.saturating_duration_since(from);
        (self.last, self.last_s) = (from + late.saturating_sub(AT_ONCE), t);
    }
}

/// Plays the board of `run` at the line's end, in real time, until the run is over or `stop` is set.
///
/// # Errors
/// [`PtyError`].
pub fn serve(line: Line, board: &Board, run: &Run, stop: &AtomicBool) -> Result<(), PtyError> {
    let line = RefCell::new(line);
    let mut pace = Pace::default();
    let mut failure = None;
    let listen = |t: f64| {
        pace.wait(t);
        let mut line = line.borrow_mut();
        line.flush();
        line.take(t).unwrap_or_else(|error| {
            failure.get_or_insert(error);
            Vec::new()
        })
    };
    // The board speaks many times a second: soon enough to look whether it is to stop.
    let receive = |received: SerialByte| {
        line.borrow_mut().out.push(received.byte);
        if stop.load(Ordering::Relaxed) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    };
    board.live(run, listen, receive)?;
    failure.map_or(Ok(()), |error| Err(PtyError::Line(error)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pace_that_was_held_up_is_made_good_without_haste() {
        let mut pace = Pace::default();
        std::thread::sleep(Duration::from_millis(60));
        let begun = Instant::now();
        (1..=60).for_each(|ms| pace.wait(f64::from(ms) * 1e-3));
        // 60 ms less what is made good at once, a quarter faster; the first wait is over at its begin.
        assert!(begun.elapsed() >= Duration::from_millis(37));
        // And then it is the wall's again.
        pace.wait(0.4);
        assert!(pace.began.elapsed() >= Duration::from_millis(400));
    }

    #[test]
    fn a_cable_carries_no_more_than_its_speed_lets_it_and_saves_nothing_up() {
        let mut cable = Cable::default();
        let sum = |cable: &mut Cable, from: u32, to: u32| -> usize {
            let each = (from + 1..=to).map(|ms| cable.carries(f64::from(ms) * 1e-3, 38_400));
            each.sum()
        };
        // 3.84 bytes in a millisecond; while the board starts, all that comes is lost at once.
        assert_eq!(cable.carries(0.25, 38_400), 960);
        assert_eq!(sum(&mut cable, 250, 1250), 3840);
        assert!((3..=4).contains(&sum(&mut cable, 1250, 1251)));
        assert_eq!(cable.carries(1e5, 38_400), MOST);
        assert_eq!(cable.carries(1.0, 38_400), 0, "time goes one way");
    }

    #[test]
    fn sleeps_that_all_last_too_long_cost_no_time_in_all() {
        let mut pace = Pace::default();
        let mut now = pace.began;
        for ms in 1..=1000 {
            let (t, ms) = (f64::from(ms) * 1e-3, Duration::from_millis(1));
            let from = pace.from(t);
            // A busy computer wakes who sleeps 2 ms late, and who does not sleep at once.
            if from > now {
                now = from + 2 * ms;
            }
            pace.reached(t, from, now);
        }
        let took = now - pace.began;
        assert!((1000..=1003).contains(&took.as_millis()), "{took:?}");
    }
}
