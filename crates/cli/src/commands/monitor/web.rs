//! The view as a page in a browser on this computer: a stream of snapshots, and commands that the page has confirmed.

use std::collections::VecDeque;
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use diagnosis::DiagnoseOptions;
use imu_stand::capture::{Calibration, read_from, write_to};
use imu_stand::monitor::{About, Action, Snapshot};
use imu_stand::report::{Subject, report};
use imu_stand::{ReadOptions, RecordBuilder};
use miette::{IntoDiagnostic, Result, WrapErr};
use serde::Serialize;
use sha2::{Digest, Sha256};
use wire::Frame;

use super::engine;
use super::guard::{For, Guard, Refused};
use super::http::{Request, answer, events};

/// Name of what was recorded so far.
const RECORD: &str = "record.csv";
const PAGE: &str = include_str!("page.html");
/// Who the page may speak to: whoever sent it.
const POLICY: &str = "Content-Security-Policy: default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; \
                      img-src data:; connect-src 'self'; frame-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'\r\n";
/// Connections at once.
const MOST: usize = 32;
/// The page says this often that somebody has it open; after so long without, the motor is stopped. A tab in the background says
/// it once a second.
const WATCHED: Duration = Duration::from_secs(3);
/// From try to try to send a snapshot that is not there yet.
const EVENT: Duration = Duration::from_secs(2);
/// Rows that are kept for the diagnosis, the latest: 14 h at 20 Hz, 120 MB.
const ROWS: usize = 1 << 20;

/// What a snapshot's event says.
#[derive(Serialize)]
struct Event<'a> {
    #[serde(flatten)]
    snapshot: &'a Snapshot,
    port: &'a str,
    board: &'a str,
    line: &'a str,
    said: &'a str,
    turns: bool,
}

/// What the loop and the connections share.
struct Shared {
    guard: Guard,
    /// The last event, and its number.
    latest: Mutex<(u64, String)>,
    is_new: Condvar,
    asked: Mutex<VecDeque<Action>>,
    watched: Mutex<Option<Instant>>,
    record: Mutex<RecordBuilder>,
    ends: AtomicBool,
    connections: AtomicUsize,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The server.
pub(super) struct Web {
    shared: Arc<Shared>,
}

impl Web {
    /// Listens, and says where.
    pub fn start(port: u16) -> Result<Self> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))
            .into_diagnostic()
            .wrap_err_with(|| format!("cannot listen at port {port} of 127.0.0.1: is it taken? `--web` alone takes a free one"))?;
        let port = listener.local_addr().into_diagnostic()?.port();
        let shared = Arc::new(Shared {
            guard: Guard::new(port),
            latest: Mutex::default(),
            is_new: Condvar::new(),
            asked: Mutex::default(),
            watched: Mutex::default(),
            record: Mutex::new(RecordBuilder::new(Calibration::default())),
            ends: AtomicBool::new(false),
            connections: AtomicUsize::new(0),
        });
        say!(
            "open {} in a browser on this computer; Ctrl-C ends",
            shared.guard.address()
        );
        let served = Arc::clone(&shared);
        std::thread::spawn(move || serve(&listener, &served));
        Ok(Self { shared })
    }

    /// Keeps what was measured, for the diagnosis.
    pub fn record(&self, frame: &Frame, now: f64) {
        let mut record = lock(&self.shared.record);
        match frame {
            Frame::Sample(sample) => {
                if record.len() >= ROWS {
                    record.forget(ROWS / 8);
                }
                record.push(sample, now);
            }
            Frame::Hello(hello) => {
                let before = record.calibration().clone();
                record.hello(hello);
                if *record.calibration() != before {
                    // Other counts.
                    record.clear();
                }
            }
            _ => {}
        }
    }

    /// What somebody has asked for; that the motor stop where it turns and nobody has the page open any more.
    pub fn asked(&self, turns: bool) -> Option<Action> {
        let action = lock(&self.shared.asked).pop_front();
        let mut watched = lock(&self.shared.watched);
        let is_left = turns && watched.is_none_or(|watched| watched.elapsed() > WATCHED);
        if is_left {
            // Once: the stop is sent again by who carries it out.
            *watched = Some(Instant::now());
            return Some(Action::Stop);
        }
        action
    }

    /// Sends a snapshot to every page.
    pub fn publish(&self, snapshot: &Snapshot, about: &About, turns: bool) -> Result<()> {
        let event = Event {
            snapshot,
            port: &about.port,
            board: &about.board,
            line: &about.line,
            said: &about.said,
            turns,
        };
        let text = serde_json::to_string(&event).into_diagnostic()?;
        let mut latest = lock(&self.shared.latest);
        *latest = (latest.0 + 1, text);
        self.shared.is_new.notify_all();
        Ok(())
    }
}

impl Drop for Web {
    fn drop(&mut self) {
        self.shared.ends.store(true, Ordering::Relaxed);
        self.shared.is_new.notify_all();
        // The thread that waits for a connection gets one, and looks.
        let _ = TcpStream::connect((Ipv4Addr::LOCALHOST, self.shared.guard.port));
    }
}

fn serve(listener: &TcpListener, shared: &Arc<Shared>) {
    for stream in listener.incoming() {
        if shared.ends.load(Ordering::Relaxed) {
            return;
        }
        let Ok(stream) = stream else { continue };
        if shared.connections.fetch_add(1, Ordering::Relaxed) >= MOST {
            shared.connections.fetch_sub(1, Ordering::Relaxed);
            continue;
        }
        let shared = Arc::clone(shared);
        std::thread::spawn(move || {
            // A browser that has gone away is no failure.
            let _ = shared.connection(&stream);
            shared.connections.fetch_sub(1, Ordering::Relaxed);
        });
    }
}

const TEXT: &str = "text/plain; charset=utf-8";
const HTML: &str = "text/html; charset=utf-8";

impl Shared {
    fn connection(&self, stream: &TcpStream) -> std::io::Result<()> {
        let Some(request) = Request::read(stream)? else {
            return answer(stream, "400 Bad Request", TEXT, "", b"no request");
        };
        let purpose = match &*request.path {
            "/" | "/engine" => For::Page,
            "/act" | "/watched" | "/diagnose" => For::Acting,
            _ => For::Looking,
        };
        match self.guard.check(&request, purpose) {
            Ok(()) => {}
            Err(Refused::Method) => {
                return answer(stream, "405 Method Not Allowed", TEXT, "", b"");
            }
            Err(_) => {
                let help =
                    "open the address that `imu-stand monitor --web` printed, with its token";
                return answer(stream, "403 Forbidden", TEXT, "", help.as_bytes());
            }
        }
        match &*request.path {
            "/" => answer(stream, "200 OK", HTML, POLICY, PAGE.as_bytes()),
            // Its own policy, in its head, allows no connection.
            "/engine" => match engine::page() {
                Ok(page) => answer(stream, "200 OK", HTML, "", &page),
                Err(why) => answer(stream, "404 Not Found", TEXT, "", why.as_bytes()),
            },
            "/events" => self.events(stream),
            "/record.csv" => {
                let record = lock(&self.record).build();
                let mut text = Vec::new();
                write_to(&mut text, &record)?;
                answer(stream, "200 OK", "text/csv", "", &text)
            }
            "/watched" => {
                *lock(&self.watched) = Some(Instant::now());
                answer(stream, "204 No Content", TEXT, "", b"")
            }
            "/act" => match action(&request.body) {
                Some(action) => {
                    *lock(&self.watched) = Some(Instant::now());
                    lock(&self.asked).push_back(action);
                    answer(stream, "204 No Content", TEXT, "", b"")
                }
                None => answer(
                    stream,
                    "400 Bad Request",
                    TEXT,
                    "",
                    b"motor DUTY, stop, or null SAMPLES",
                ),
            },
            "/diagnose" => match self.diagnosed() {
                Ok(html) => answer(stream, "200 OK", HTML, "", html.as_bytes()),
                Err(why) => answer(stream, "409 Conflict", TEXT, "", why.as_bytes()),
            },
            _ => answer(stream, "404 Not Found", TEXT, "", b""),
        }
    }

    /// Sends snapshots for as long as they are taken.
    fn events(&self, stream: &TcpStream) -> std::io::Result<()> {
        use std::io::Write as _;
        events(stream)?;
        let mut out = stream;
        let mut sent = 0;
        while !self.ends.load(Ordering::Relaxed) {
            let latest = lock(&self.latest);
            let waited = self
                .is_new
                .wait_timeout_while(latest, EVENT, |(number, _)| *number == sent);
            let (latest, _) = waited.unwrap_or_else(PoisonError::into_inner);
            let (number, text) = latest.clone();
            drop(latest);
            match number == sent {
                true => write!(out, ":\n\n")?,
                false => write!(out, "data: {text}\n\n")?,
            }
            out.flush()?;
            sent = number;
        }
        Ok(())
    }

    /// The report of what was recorded so far, as `diagnose --report` writes it.
    fn diagnosed(&self) -> std::result::Result<String, String> {
        let mut text = Vec::new();
        let record = lock(&self.record).build();
        write_to(&mut text, &record).map_err(|error| error.to_string())?;
        // Through the same door as a file: rows in order, doubts told.
        let read =
            read_from(&text[..], &ReadOptions::default()).map_err(|error| error.to_string())?;
        let hash = format!("sha256:{:x}", Sha256::digest(&text));
        let options = DiagnoseOptions {
            file: RECORD.to_owned(),
            hash: Some(hash.clone()),
            replicates: diagnosis::replicates::REPLICATES,
            ..DiagnoseOptions::default()
        };
        let diagnosed = diagnosis::diagnose(&read.record, &options)
            .map_err(|error| format!("{error}: let it record for longer"))?;
        let subject = Subject {
            record: &read.record,
            diagnosed: &diagnosed,
            rate_hz: None,
            command: &format!("imu-stand diagnose {RECORD} --report report.html"),
            seed: DiagnoseOptions::default().seed,
            hash: Some(&hash),
            hidden: None,
        };
        report(&subject).map_err(|error| format!("no report: {error}"))
    }
}

/// `motor 60`, `stop`, `null 600`.
fn action(text: &str) -> Option<Action> {
    let mut words = text.split(' ');
    let action = match (words.next()?, words.next()) {
        ("stop", None) => Action::Stop,
        ("motor", Some(duty)) => {
            let duty: i16 = duty.parse().ok()?;
            (-255..=255)
                .contains(&duty)
                .then_some(Action::Motor(duty))?
        }
        ("null", Some(samples)) => {
            let samples: u16 = samples.parse().ok()?;
            (1..=16_384)
                .contains(&samples)
                .then_some(Action::BiasNull(samples))?
        }
        _ => return None,
    };
    words.next().is_none().then_some(action)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_are_those_that_the_board_takes() {
        assert_eq!(action("motor -60"), Some(Action::Motor(-60)));
        assert_eq!(action("stop"), Some(Action::Stop));
        assert_eq!(action("null 600"), Some(Action::BiasNull(600)));
        for wrong in [
            "",
            "motor",
            "motor 256",
            "motor 6 0",
            "null 0",
            "null -1",
            "reboot",
            "stop now",
        ] {
            assert_eq!(action(wrong), None, "{wrong}");
        }
    }
}
