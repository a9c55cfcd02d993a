//! `imu-stand monitor`: lines, a screen of the terminal, or a page in a browser.

mod engine;
mod guard;
mod http;
mod terminal;
mod web;

use std::io::IsTerminal;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use clap::Args;
use imu_stand::link::{Change, Feed};
use imu_stand::monitor::{About, Action, Control, Snapshot, View};
use imu_stand::report::plot::fixed;
use miette::{IntoDiagnostic, Result};
use wire::Frame;

use super::Line;
use super::board::motor::RAMP_DOWN;
use terminal::Terminal;
use web::Web;

/// What `monitor` takes.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    line: Line,
    /// Show it as a page in a browser on this computer, at this port of 127.0.0.1; any free one where none is named
    #[arg(long, value_name = "PORT", num_args = 0..=1, default_missing_value = "0")]
    web: Option<u16>,
    /// How long, s; without it until q or Ctrl-C
    #[arg(long, value_parser = super::positive, allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// Write the last view as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Show nothing while it runs
    #[arg(long, short)]
    quiet: bool,
}

/// From picture to picture on a terminal or a page, and from line to line elsewhere.
const PICTURE: Duration = Duration::from_millis(500);
const LINE: Duration = Duration::from_secs(1);

/// How it is shown.
enum Show {
    Nothing,
    Lines,
    Terminal(Terminal),
    Web(Web),
}

/// A view under way.
struct Monitor {
    feed: Feed,
    view: View,
    control: Control,
    /// What happened to the port.
    line: String,
    restarts: u64,
    began: Instant,
}

/// Runs it.
pub fn run(arguments: &Arguments) -> Result<()> {
    super::Outputs::beside([]).result("--json", arguments.json.as_ref())?;
    let feed = Feed::new(arguments.line.open()?);
    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed)).into_diagnostic()?;
    let mut monitor = Monitor {
        feed,
        view: View::new(),
        control: Control::default(),
        line: String::new(),
        restarts: 0,
        began: Instant::now(),
    };
    // A port that fails right here is gone for the loop below, which waits for it.
    let _ = monitor.feed.ask();
    let mut show = match (arguments.web, arguments.quiet) {
        (Some(port), _) => Show::Web(Web::start(port)?),
        (None, true) => Show::Nothing,
        (None, false) if std::io::stdout().is_terminal() => Show::Terminal(Terminal::start()?),
        (None, false) => Show::Lines,
    };
    let over = |began: Instant| {
        let seconds = arguments.seconds;
        stop.load(Ordering::Relaxed) || seconds.is_some_and(|s| began.elapsed().as_secs_f64() >= s)
    };
    let watched = monitor.watch(&mut show, over);
    // Whatever ended it, the motor is told to stop; if the board does not hear it, it stops by itself.
    let halted = monitor.halt();
    drop(show);
    watched?;
    halted?;
    let last = monitor.snapshot();
    let link = &monitor.feed.link;
    if last.samples == 0 {
        let heard = link.heard();
        miette::bail!(
            help = heard.remedy(link.baud()),
            "no sample arrived on {}; heard: {heard}",
            link.name()
        );
    }
    if !arguments.quiet {
        let page = last.page(link.name(), &monitor.view.board());
        say!("{}", page.trim_end());
    }
    super::write_json(arguments.json.as_ref(), &last)
}

impl Monitor {
    fn snapshot(&self) -> Snapshot {
        self.view.snapshot(&self.feed.link.heard())
    }

    fn about(&self) -> About {
        About {
            port: self.feed.link.name().to_owned(),
            board: self.view.board(),
            line: self.line.clone(),
            said: self.control.said().to_owned(),
        }
    }

    fn watch(&mut self, show: &mut Show, over: impl Fn(Instant) -> bool) -> Result<()> {
        let every = match show {
            Show::Lines => LINE,
            _ => PICTURE,
        };
        let mut shown: Option<Instant> = None;
        while !over(self.began) {
            let web = match show {
                Show::Web(web) => Some(&*web),
                _ => None,
            };
            self.step(web)?;
            let (asked, is_stale) = match show {
                Show::Terminal(terminal) => {
                    let was_pressed = terminal.keys()?;
                    if terminal.screen.ends() {
                        return Ok(());
                    }
                    (terminal.asked.take(), was_pressed)
                }
                Show::Web(web) => (web.asked(self.control.turns()), false),
                Show::Nothing | Show::Lines => (None, false),
            };
            let has_asked = asked.is_some();
            if let Some(action) = asked {
                self.act(action);
            }
            let is_due = shown.is_none_or(|shown| shown.elapsed() >= every);
            if is_due || is_stale || has_asked {
                shown = Some(Instant::now());
                self.show(show)?;
            }
        }
        Ok(())
    }

    /// Takes what has come, and does what is due.
    fn step(&mut self, web: Option<&Web>) -> Result<()> {
        match self.feed.poll(|_| {}) {
            Some(Change::Gone { why }) => {
                self.line = format!("the port is gone ({why}); waiting for it to come back");
                self.control.interrupted();
            }
            Some(Change::Back { after }) => {
                self.view.reconnected();
                self.line = format!("the port was gone for {:.1} s", after.as_secs_f64());
            }
            None => {}
        }
        let now = self.began.elapsed().as_secs_f64();
        while let Some(frame) = self.feed.link.next() {
            self.take(&frame, now);
            web.iter().for_each(|web| web.record(&frame, now));
        }
        if !self.feed.is_gone() {
            // A port that fails here is gone for the reader, too.
            let _ = self.control.drive(&mut self.feed.link);
        }
        Ok(())
    }

    fn take(&mut self, frame: &Frame, now: f64) {
        self.view.push(frame, now);
        let restarts = self.view.restarts();
        if std::mem::replace(&mut self.restarts, restarts) != restarts {
            self.control.interrupted();
        }
        self.control.take(frame);
    }

    fn act(&mut self, action: Action) {
        if self.feed.is_gone() {
            self.line = "the port is gone: nothing can be asked of the board".to_owned();
            return;
        }
        if let Err(error) = self.control.act(action, &mut self.feed.link) {
            self.line = error.to_string();
        }
    }

    fn show(&mut self, show: &mut Show) -> Result<()> {
        let s = self.snapshot();
        match show {
            Show::Nothing => {}
            Show::Lines => {
                let line = format!(
                    "{:>8.0} s {:>8} samples, {} missing  {} deg/s  {}",
                    self.began.elapsed().as_secs_f64(),
                    s.samples,
                    s.missing,
                    axes(s.gyros.map(|gyro| gyro.mean_dps)),
                    self.line
                );
                eprintln!("{}", line.trim_end());
            }
            Show::Terminal(terminal) => terminal.draw(&s, &self.about())?,
            Show::Web(web) => web.publish(&s, &self.about(), self.control.turns())?,
        }
        Ok(())
    }

    /// Lets the motor run down where it turns.
    fn halt(&mut self) -> Result<()> {
        let began = Instant::now();
        if self.control.turns() && !self.feed.is_gone() {
            self.act(Action::Stop);
        }
        while !self.control.is_at_rest() && !self.feed.is_gone() && began.elapsed() < RAMP_DOWN {
            self.step(None)?;
        }
        Ok(())
    }
}

/// Rates below each other in the lines of a log, each behind its axis.
fn axes(rates: [Option<f64>; 3]) -> String {
    let said = rates.map(|rate| rate.map_or_else(|| "-".to_owned(), |rate| fixed(rate, 3)));
    let [x, y, z] = said;
    format!("x {x:>8}  y {y:>8}  z {z:>8}")
}

#[cfg(test)]
mod tests {
    #[test]
    fn rates_stand_below_each_other_behind_their_axes() {
        let line = super::axes([Some(-0.5), None, Some(12.25)]);
        assert_eq!(line, "x   -0.500  y        -  z   12.250");
    }
}
