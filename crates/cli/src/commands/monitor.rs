//! `imu-stand monitor`.

use std::io::{IsTerminal, Write};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use clap::Args;
use imu_stand::link::{Change, Feed};
use imu_stand::monitor::View;
use miette::{IntoDiagnostic, Result};

use super::Line;

/// What `monitor` takes.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    line: Line,
    /// How long, s; without it until Ctrl-C
    #[arg(long)]
    seconds: Option<f64>,
    /// Write the last view as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Show nothing while it runs
    #[arg(long, short)]
    quiet: bool,
}

/// From page to page on a terminal, and from line to line elsewhere.
const PAGE: Duration = Duration::from_millis(500);
const LINE: Duration = Duration::from_secs(1);
/// The terminal's other screen on and off, and its upper left corner with all below cleared.
const OTHER_SCREEN: &str = "\x1b[?1049h";
const OWN_SCREEN: &str = "\x1b[?1049l";
const HOME: &str = "\x1b[H\x1b[J";

/// Runs it.
pub fn run(arguments: &Arguments) -> Result<()> {
    super::Outputs::beside([]).result("--json", arguments.json.as_ref())?;
    let mut feed = Feed::new(arguments.line.open()?);
    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed)).into_diagnostic()?;
    // A port that fails right here is gone for the loop below, which waits for it.
    let _ = feed.ask();
    let is_page = std::io::stdout().is_terminal() && !arguments.quiet;
    if is_page {
        print!("{OTHER_SCREEN}");
    }
    let mut view = View::new();
    let watched = watch(arguments, &mut feed, &mut view, is_page, &stop);
    if is_page {
        print!("{OWN_SCREEN}");
        std::io::stdout().flush().into_diagnostic()?;
    }
    watched?;
    let heard = feed.link.heard();
    let last = view.snapshot();
    if last.samples == 0 {
        miette::bail!(
            help = heard.remedy(feed.link.baud()),
            "no sample arrived on {}; heard: {heard}",
            feed.link.name()
        );
    }
    if !arguments.quiet {
        say!("{}", view.page(feed.link.name(), &heard).trim_end());
    }
    super::write_json(arguments.json.as_ref(), &last)
}

fn watch(
    arguments: &Arguments,
    feed: &mut Feed,
    view: &mut View,
    is_page: bool,
    stop: &AtomicBool,
) -> Result<()> {
    let (began, mut shown) = (Instant::now(), Instant::now());
    let every = if is_page { PAGE } else { LINE };
    let mut port = String::new();
    let over = |began: Instant| {
        arguments
            .seconds
            .is_some_and(|seconds| began.elapsed().as_secs_f64() >= seconds)
    };
    while !stop.load(Ordering::Relaxed) && !over(began) {
        match feed.poll(|_| {}) {
            Some(Change::Gone { why }) => {
                port = format!("\nthe port is gone ({why}); waiting for it to come back")
            }
            Some(Change::Back { after }) => {
                view.reconnected();
                port = format!("\nthe port was gone for {:.1} s", after.as_secs_f64());
            }
            None => {}
        }
        let now = began.elapsed().as_secs_f64();
        while let Some(frame) = feed.link.next() {
            view.push(&frame, now);
        }
        if shown.elapsed() < every || arguments.quiet {
            continue;
        }
        shown = Instant::now();
        if is_page {
            let page = view.page(feed.link.name(), &feed.link.heard());
            print!("{HOME}{page}{port}\nCtrl-C ends\n");
            std::io::stdout().flush().into_diagnostic()?;
        } else {
            let s = view.snapshot();
            let rates = s.gyros.map(|gyro| {
                gyro.mean_dps
                    .map_or_else(|| "-".to_owned(), |rate| format!("{rate:.3}"))
            });
            eprintln!(
                "{now:>8.0} s {:>8} samples, {} missing  {} deg/s{}",
                s.samples,
                s.missing,
                rates.join(" "),
                port.replace('\n', "  ")
            );
        }
    }
    Ok(())
}
