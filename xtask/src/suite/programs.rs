//! Test programs, run side by side.

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::Command;
use std::sync::Mutex;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use crate::step::{Failure, Pace, Progress};

/// A test program, or another whose end tells whether something works.
#[derive(Clone, Debug)]
pub struct TestProgram {
    /// Package and target.
    pub name: String,
    pub file: PathBuf,
    pub arguments: Vec<OsString>,
    pub environment: Vec<(&'static str, OsString)>,
    /// Folder in which it runs: of its package, as cargo would run it.
    pub folder: PathBuf,
    /// It waits for a clock more than it computes, so that it needs no core of its own.
    pub waits: bool,
    /// What is wrong with the lines that it printed, where it ended well.
    pub objection: fn(&[String]) -> Option<String>,
}

impl TestProgram {
    /// What starts it.
    pub fn command(&self) -> Command {
        let mut command = Command::new(&self.file);
        command
            .args(&self.arguments)
            .envs(self.environment.iter().map(|(key, value)| (key, value)))
            .current_dir(&self.folder);
        command
    }
}

/// How a test program ended.
pub struct Done {
    pub name: String,
    pub passed: bool,
    pub tests: usize,
    pub seconds: f64,
    pub said: String,
}

/// Runs test programs, as many at a time as there are cores and one more of those that wait; prints what
/// the failed ones said, and how long the longest took. Tests that grade by rates make all their draws, or a sample.
pub fn side_by_side(tests: &[&TestProgram], all_draws: bool) -> Result<Vec<Done>, Failure> {
    let mut progress = Progress::new("tests", Pace::Steady);
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let (waiting, computing): (Vec<_>, Vec<_>) = tests.iter().partition(|test| test.waits);
    let (waiting, computing) = [waiting, computing]
        .map(|tests| Mutex::new(tests.into_iter()))
        .into();
    let (send, results) = channel();
    let mut done: Vec<Done> = Vec::new();
    let mut broken = None;
    std::thread::scope(|scope| {
        for worker in 0..=cores {
            let send = send.clone();
            let (waiting, computing) = (&waiting, &computing);
            scope.spawn(move || {
                let next = |tests: &Mutex<std::vec::IntoIter<_>>| tests.lock().ok()?.next();
                loop {
                    let computes = (worker < cores).then(|| next(computing)).flatten();
                    let Some(test) = computes.or_else(|| next(waiting)) else {
                        return;
                    };
                    if send.send(run_one(test, all_draws)).is_err() {
                        return;
                    }
                }
            });
        }
        drop(send);
        loop {
            match results.recv_timeout(Duration::from_millis(500)) {
                Ok(Ok(one)) => done.push(one),
                Ok(Err(failure)) => broken = Some(failure),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return,
            }
            let counted: usize = done.iter().map(|d| d.tests).sum();
            progress.tick(&format!(
                "{} of {} programs done, {counted} tests",
                done.len(),
                tests.len()
            ));
        }
    });
    progress.end();
    if let Some(failure) = broken {
        return Err(failure);
    }
    for failed in done.iter().filter(|d| !d.passed) {
        eprintln!("---- {}\n{}", failed.name, failed.said);
    }
    done.sort_by(|a, b| b.seconds.total_cmp(&a.seconds));
    let longest = done.iter().take(5);
    let longest: Vec<String> = longest
        .map(|d| format!("{} {:.0} s", d.name, d.seconds))
        .collect();
    println!("   longest: {}", longest.join(", "));
    Ok(done)
}

fn run_one(test: &TestProgram, all_draws: bool) -> Result<Done, Failure> {
    let from = Instant::now();
    let mut program = test.command();
    program.env("RUST_TEST_THREADS", if test.waits { "4" } else { "1" });
    if all_draws {
        // Read by crates/diagnosis/tests/draws/mod.rs.
        program.env("IMU_STAND_ALL_DRAWS", "1");
    }
    let output = program.output().map_err(|error| {
        Failure::new(
            &format!("{} cannot be started: {error}", test.file.display()),
            "run it again: another build may have taken it away",
        )
    })?;
    let mut said = String::from_utf8_lossy(&output.stdout).into_owned();
    said += &String::from_utf8_lossy(&output.stderr);
    let lines: Vec<String> = said.lines().map(str::to_owned).collect();
    let objection = (output.status.success())
        .then(|| (test.objection)(&lines))
        .flatten();
    if let Some(what) = &objection {
        said += &format!("error: {what}\n");
    }
    Ok(Done {
        name: test.name.clone(),
        passed: output.status.success() && objection.is_none(),
        tests: passed(&said),
        seconds: from.elapsed().as_secs_f64(),
        said,
    })
}

/// Tests that passed, of what a test program says, of Rust's or of pytest's.
fn passed(said: &str) -> usize {
    let counts = said.lines().filter_map(|line| {
        let is_count = line.starts_with("test result: ") || line.contains(" passed in ");
        let (before, _) = is_count.then_some(line)?.split_once(" passed")?;
        before.split_whitespace().last()?.parse::<usize>().ok()
    });
    counts.sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passed_tests_are_counted() {
        let said = "test result: ok. 12 passed; 0 failed; 1 ignored\nx\ntest result: FAILED. 3 passed; 1 failed";
        assert_eq!(passed(said), 15);
        assert_eq!(passed("....\n60 passed in 67.94s (0:01:07)"), 60);
    }
}
