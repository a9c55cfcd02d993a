//! That long work goes on, on standard error: on a terminal a line that changes, from two seconds on; elsewhere a line each ten
//! seconds. Never on standard output, and not at all with `--quiet`.

use std::io::{IsTerminal as _, Write as _};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

use super::terminal;

/// What is shorter says nothing.
const SHORT: Duration = Duration::from_secs(2);
/// How often the line of a terminal changes.
const OFTEN: Duration = Duration::from_secs(1);
/// How often a line is written where there is no terminal, into a log.
const SELDOM: Duration = Duration::from_secs(10);

/// Whether somebody tells already: work within work, or beside other work, is told as the whole.
static IS_TOLD: AtomicBool = AtomicBool::new(false);

/// Does `work`, and says meanwhile what `say` calls it.
pub fn working<T>(is_quiet: bool, say: impl Fn() -> String + Sync, work: impl FnOnce() -> T) -> T {
    watched(is_quiet, false, &say, work)
}

/// The same of work that has a bar of its own on a terminal.
pub fn beside_bar<T>(
    is_quiet: bool,
    say: impl Fn() -> String + Sync,
    work: impl FnOnce() -> T,
) -> T {
    watched(is_quiet, true, &say, work)
}

fn watched<T>(
    is_quiet: bool,
    has_bar: bool,
    say: &(dyn Fn() -> String + Sync),
    work: impl FnOnce() -> T,
) -> T {
    if is_quiet || IS_TOLD.swap(true, Ordering::Relaxed) {
        return work();
    }
    let (done, wait) = channel::<()>();
    let made = std::thread::scope(|scope| {
        scope.spawn(move || match (std::io::stderr().is_terminal(), has_bar) {
            (true, true) => {}
            (true, false) => on_terminal(&wait, say),
            (false, _) => in_lines(&wait, SELDOM, say, |line| {
                // Whoever does not listen is not told.
                let _ = writeln!(std::io::stderr(), "{}", terminal::harmless(&line));
            }),
        });
        let made = work();
        drop(done);
        made
    });
    IS_TOLD.store(false, Ordering::Relaxed);
    made
}

/// Whether the work went on for so long.
fn goes_on(wait: &Receiver<()>, pause: Duration) -> bool {
    wait.recv_timeout(pause) == Err(RecvTimeoutError::Timeout)
}

fn on_terminal(wait: &Receiver<()>, say: &dyn Fn() -> String) {
    let begun = Instant::now();
    if !goes_on(wait, SHORT) {
        return;
    }
    let style = ProgressStyle::with_template("{msg}");
    let bar = ProgressBar::new_spinner();
    bar.set_style(style.unwrap_or(ProgressStyle::default_spinner()));
    loop {
        bar.set_message(terminal::harmless(&line(say, begun)).into_owned());
        bar.tick();
        if !goes_on(wait, OFTEN) {
            break;
        }
    }
    bar.finish_and_clear();
}

fn in_lines(
    wait: &Receiver<()>,
    pause: Duration,
    say: &dyn Fn() -> String,
    mut tell: impl FnMut(String),
) {
    let begun = Instant::now();
    while goes_on(wait, pause) {
        tell(line(say, begun));
    }
}

fn line(say: &dyn Fn() -> String, begun: Instant) -> String {
    format!("{}: {} s so far", say(), begun.elapsed().as_secs())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_comes_each_while_until_the_work_is_done_and_none_of_short_work() {
        let lines_of = |work: Duration, pause: Duration| {
            let (done, wait) = channel();
            std::thread::scope(|scope| {
                let told = scope.spawn(move || {
                    let mut lines = Vec::new();
                    in_lines(&wait, pause, &|| "reading a.csv".to_owned(), |l| {
                        lines.push(l)
                    });
                    lines
                });
                std::thread::sleep(work);
                drop(done);
                told.join().expect("lines")
            })
        };
        let lines = lines_of(Duration::from_millis(300), Duration::from_millis(20));
        assert!((1..16).contains(&lines.len()), "{lines:?}");
        assert_eq!(lines[0], "reading a.csv: 0 s so far");
        assert!(lines_of(Duration::ZERO, Duration::from_secs(30)).is_empty());
    }
}
