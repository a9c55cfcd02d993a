//! Running programs: what they say is kept, how far they are is shown, and what failed is said.

use std::io::{BufRead, BufReader, IsTerminal as _, Read, Write as _};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

/// What failed, and what to do.
#[derive(Debug)]
pub struct Failure {
    what: String,
    help: String,
}

impl Failure {
    /// A failure with the way out of it.
    pub fn new(what: &str, help: &str) -> Self {
        Self {
            what: what.to_owned(),
            help: help.to_owned(),
        }
    }
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        writeln!(f, "error: {}", self.what)?;
        write!(f, "help:  {}", self.help)
    }
}

/// Runs a command to its end, on this terminal.
///
/// # Errors
/// When it cannot be started or does not succeed.
pub fn run(what: &str, command: &mut Command) -> Result<(), Failure> {
    let status = command.status().map_err(|error| unstarted(what, &error))?;
    if status.success() {
        return Ok(());
    }
    Err(Failure::new(
        &format!("{what} failed ({status})"),
        "its own message stands above",
    ))
}

/// What a program says; empty where it is missing.
pub fn said_by(command: &mut Command) -> String {
    let output = command.output().map(|output| output.stdout);
    let output = output.unwrap_or_default();
    String::from_utf8_lossy(&output).trim().to_owned()
}

/// The commit that is checked out, and whether something differs from it.
pub fn commit(root: &Path) -> String {
    let mut git = Command::new("git");
    said_by(
        git.current_dir(root)
            .args(["describe", "--always", "--dirty"]),
    )
}

/// Today.
pub fn date() -> String {
    said_by(Command::new("date").arg("+%Y-%m-%d"))
}

fn unstarted(what: &str, error: &std::io::Error) -> Failure {
    Failure::new(
        &format!("{what} cannot be started: {error}"),
        "is it installed and in PATH?",
    )
}

/// Time after which a step shows on a terminal how far it is.
const PATIENCE: Duration = Duration::from_secs(2);
/// Time between two lines where there is no terminal.
const BETWEEN_LINES: Duration = Duration::from_secs(10);
/// So many lines come at that pace, then the time between them doubles with every [`DOUBLED_AFTER`] more: an hour is told
/// in 30 lines, a day in 45.
const AT_FULL_PACE: u32 = 12;
const DOUBLED_AFTER: u32 = 3;
/// How often a terminal's line is drawn again.
const REDRAWN: Duration = Duration::from_millis(500);

/// Shows how far a step is: on a terminal by a line that is drawn again, elsewhere by a line now and then.
pub struct Progress {
    what: String,
    from: Instant,
    is_terminal: bool,
    pace: Pace,
    next: Duration,
    drawn: Option<Instant>,
}

/// How many lines a step may take where there is no terminal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// One each 10 s, however long it takes.
    Steady,
    /// So many have been printed: the more, the rarer they become.
    Rarer(u32),
}

impl Pace {
    /// Counts a line; returns the time until the next.
    fn line(&mut self) -> Duration {
        match self {
            Pace::Steady => BETWEEN_LINES,
            Pace::Rarer(printed) => {
                *printed += 1;
                let doublings = printed.saturating_sub(AT_FULL_PACE).div_ceil(DOUBLED_AFTER);
                BETWEEN_LINES * 2u32.saturating_pow(doublings.min(16))
            }
        }
    }
}

impl Progress {
    /// Starts the clock.
    pub fn new(what: &str, pace: Pace) -> Self {
        Progress {
            what: what.to_owned(),
            from: Instant::now(),
            is_terminal: std::io::stderr().is_terminal(),
            pace,
            next: BETWEEN_LINES,
            drawn: None,
        }
    }

    /// Shows `status` where it is time to.
    pub fn tick(&mut self, status: &str) {
        let elapsed = self.from.elapsed();
        let line = format!("   {}: {status} ({} s)", self.what, elapsed.as_secs());
        if self.is_terminal {
            if elapsed >= PATIENCE && self.drawn.is_none_or(|at| at.elapsed() >= REDRAWN) {
                eprint!("\r\x1b[K{}", line.chars().take(WIDTH).collect::<String>());
                let _ = std::io::stderr().flush();
                self.drawn = Some(Instant::now());
            }
        } else if elapsed >= self.next {
            println!("{line}");
            let _ = std::io::stdout().flush();
            self.next = elapsed + self.pace.line();
        }
    }

    /// Takes the line away; returns what has been printed for the pace of the next step.
    pub fn end(self) -> Pace {
        if self.drawn.is_some() {
            eprint!("\r\x1b[K");
        }
        self.pace
    }
}

/// Columns of a terminal that a line of progress may take: longer ones would wrap, and be drawn one below the other.
const WIDTH: usize = 78;

/// What a program said.
#[derive(Clone, Debug, Default)]
pub struct Said {
    /// Lines of standard output and standard error in the order in which they came.
    pub all: Vec<String>,
    /// Those of standard output alone.
    pub out: Vec<String>,
}

/// Makes of a program's lines how far it is.
pub trait Meter {
    /// Takes a line.
    fn line(&mut self, line: &str);
    /// How far it is.
    fn status(&self) -> String;
}

/// Of a program that says nothing of how far it is.
pub struct Silent(pub &'static str);

impl Meter for Silent {
    fn line(&mut self, _line: &str) {}

    fn status(&self) -> String {
        self.0.to_owned()
    }
}

/// Counts what cargo compiles.
#[derive(Debug, Default)]
pub struct Crates {
    count: usize,
    last: String,
}

impl Meter for Crates {
    fn line(&mut self, line: &str) {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("Compiling" | "Checking") => {
                self.count += 1;
                self.last = words.next().unwrap_or_default().to_owned();
            }
            Some("Downloading" | "Downloaded" | "Updating" | "Blocking") if self.count == 0 => {
                self.last = line.trim().to_owned();
            }
            _ => {}
        }
    }

    fn status(&self) -> String {
        match self.count {
            0 if self.last.is_empty() => "starting".to_owned(),
            0 => self.last.clone(),
            1 => format!("1 crate so far, now {}", self.last),
            count => format!("{count} crates so far, now {}", self.last),
        }
    }
}

/// Runs a command to its end and keeps what it says; that is printed where it fails. `pace` goes on from step to step.
///
/// # Errors
/// When it cannot be started or does not succeed.
pub fn watched(
    what: &str,
    command: &mut Command,
    meter: &mut dyn Meter,
    pace: &mut Pace,
) -> Result<Said, Failure> {
    let mut progress = Progress::new(what, *pace);
    let (said, status) = listen(what, command, meter, &mut progress)?;
    *pace = progress.end();
    if status.success() {
        return Ok(said);
    }
    for line in &said.all {
        eprintln!("{line}");
    }
    Err(Failure::new(
        &format!("{what} failed ({status})"),
        "what it said stands above",
    ))
}

/// Runs a command to its end, telling `meter` and `progress` of it.
fn listen(
    what: &str,
    command: &mut Command,
    meter: &mut dyn Meter,
    progress: &mut Progress,
) -> Result<(Said, std::process::ExitStatus), Failure> {
    let mut child = command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|error| unstarted(what, &error))?;
    let (send, lines) = channel();
    let readers = [
        (child.stdout.take()).map(|out| forward(out, true, send.clone())),
        (child.stderr.take()).map(|err| forward(err, false, send)),
    ];
    let mut said = Said::default();
    loop {
        match lines.recv_timeout(REDRAWN) {
            Ok((is_out, line)) => {
                meter.line(&line);
                if is_out {
                    said.out.push(line.clone());
                }
                said.all.push(line);
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => break,
        }
        progress.tick(&meter.status());
    }
    for reader in readers.into_iter().flatten() {
        let _ = reader.join();
    }
    let status = child.wait().map_err(|error| unstarted(what, &error))?;
    Ok((said, status))
}

/// Sends the lines of a pipe until it is closed.
fn forward(
    pipe: impl Read + Send + 'static,
    is_out: bool,
    send: Sender<(bool, String)>,
) -> std::thread::JoinHandle<()> {
    std::thread::spawn(move || {
        let mut pipe = BufReader::new(pipe);
        let mut bytes = Vec::new();
        while pipe.read_until(b'\n', &mut bytes).is_ok_and(|n| n > 0) {
            let line = String::from_utf8_lossy(&bytes);
            let line = line.trim_end_matches(['\r', '\n']).to_owned();
            if send.send((is_out, line)).is_err() {
                return;
            }
            bytes.clear();
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_off_a_terminal_become_rarer_an_hour_takes_30() {
        let told_in = |seconds: u64| {
            let (mut pace, mut time, mut lines) = (Pace::Rarer(0), BETWEEN_LINES, 0);
            while time <= Duration::from_secs(seconds) {
                lines += 1;
                time += pace.line();
            }
            lines
        };
        assert_eq!(told_in(120), 12, "one each 10 s at first");
        assert!(told_in(3600) <= 30, "{}", told_in(3600));
        assert!(told_in(86_400) <= 45, "{}", told_in(86_400));
    }

    #[test]
    fn crates_are_counted_and_named() {
        let mut crates = Crates::default();
        assert_eq!(crates.status(), "starting");
        for line in [
            "   Compiling wire v0.1.0 (/x)",
            "warning: one",
            "    Checking model v0.1.0",
        ] {
            crates.line(line);
        }
        assert_eq!(crates.status(), "2 crates so far, now model");
    }

    #[test]
    fn what_a_program_says_is_kept_by_where_it_said_it() {
        let mut shell = Command::new("sh");
        shell.args(["-c", "echo out; echo err >&2"]);
        let mut pace = Pace::Steady;
        let said = watched("sh", &mut shell, &mut Silent("runs"), &mut pace).expect("it runs");
        assert_eq!(said.out, ["out"]);
        assert_eq!(said.all.len(), 2);
        let mut shell = Command::new("sh");
        shell.args(["-c", "exit 3"]);
        assert!(watched("sh", &mut shell, &mut Silent("runs"), &mut pace).is_err());
    }
}
