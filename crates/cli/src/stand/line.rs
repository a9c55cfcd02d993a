//! The simulated board at the end of a line, as fast as it can be computed: in a thread of its own, which goes on only while
//! the host waits for bytes. So a run depends on what the host does and not on when.

use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::io::{Error, ErrorKind, Result};
use std::ops::ControlFlow;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;
use std::time::Duration;

use bench::{Run, SerialByte};

use super::Board;
use crate::link::Port;

/// Silence of the board after which a read of the host ends, s: a board says something each second.
const SILENCE_S: f64 = 1.0;

/// What the board has sent, and the time by then, s.
type Sent = (Vec<SerialByte>, f64);

/// The host's end.
pub struct Simulated {
    /// What the host sends, with leave to go on; `None` at the end.
    to: Option<Sender<Vec<u8>>>,
    from: Receiver<Sent>,
    thread: Option<JoinHandle<std::result::Result<(), String>>>,
    received: VecDeque<SerialByte>,
    outgoing: Vec<u8>,
    /// Whether the board waits for leave to go on.
    waits: bool,
    now_s: f64,
}

impl Simulated {
    /// Power comes on, on the stand of `scenario`.
    #[must_use]
    pub fn start(board: Board, scenario: bench::Scenario) -> Self {
        let (to, grants) = channel();
        let (sent, from) = channel();
        let run = Run {
            scenario,
            // Until the host hangs up.
            seconds: f64::from(u32::MAX),
            requests: Vec::new(),
        };
        let thread = std::thread::spawn(move || play(&board, &run, &grants, &sent));
        Self {
            to: Some(to),
            from,
            thread: Some(thread),
            received: VecDeque::new(),
            outgoing: Vec::new(),
            waits: false,
            now_s: 0.0,
        }
    }

    /// Why the board says nothing any more.
    fn ended(&mut self) -> Error {
        let why = match self.thread.take().map(JoinHandle::join) {
            Some(Ok(Err(why))) => why,
            _ => "the simulated board has stopped".to_owned(),
        };
        Error::other(why)
    }
}

impl Port for Simulated {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize> {
        if self.received.is_empty() {
            if std::mem::take(&mut self.waits) {
                let bytes = std::mem::take(&mut self.outgoing);
                // Where it has stopped the answer says so.
                let _ = self.to.as_ref().map(|to| to.send(bytes));
            }
            let Ok((bytes, now_s)) = self.from.recv() else {
                return Err(self.ended());
            };
            self.waits = true;
            if bytes.is_empty() {
                self.now_s = self.now_s.max(now_s);
                return Err(ErrorKind::TimedOut.into());
            }
            self.received.extend(bytes);
        }
        // A frame at a time, so that each has its own time.
        let mut count = 0;
        while let (Some(place), Some(received)) = (buffer.get_mut(count), self.received.front()) {
            *place = received.byte;
            self.now_s = self.now_s.max(received.time_s);
            count += 1;
            if self.received.pop_front().is_some_and(|r| r.byte == 0) {
                break;
            }
        }
        Ok(count)
    }

    fn write_all(&mut self, bytes: &[u8]) -> Result<()> {
        self.outgoing.extend_from_slice(bytes);
        Ok(())
    }

    fn set_baud(&mut self, _baud: u32) -> Result<()> {
        self.received.clear();
        Ok(())
    }

    fn now(&self) -> Duration {
        Duration::from_secs_f64(self.now_s)
    }
}

impl Drop for Simulated {
    fn drop(&mut self) {
        self.to = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Plays the board until the host hangs up.
fn play(
    board: &Board,
    run: &Run,
    grants: &Receiver<Vec<u8>>,
    sent: &Sender<Sent>,
) -> std::result::Result<(), String> {
    let out = RefCell::new(Vec::new());
    let (over, due) = (Cell::new(false), Cell::new(f64::INFINITY));
    // Once each simulated millisecond. Before its first byte the board hears nothing yet.
    let listen = |t: f64| {
        if over.get() || (out.borrow().is_empty() && t < due.get()) {
            return Vec::new();
        }
        let told = sent.send((out.take(), t));
        due.set(t + SILENCE_S);
        told.ok()
            .and_then(|()| grants.recv().ok())
            .unwrap_or_else(|| {
                over.set(true);
                Vec::new()
            })
    };
    let receive = |byte: SerialByte| {
        out.borrow_mut().push(byte);
        if over.get() {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    };
    board
        .live(run, listen, receive)
        .map_err(|error| error.to_string())
}
