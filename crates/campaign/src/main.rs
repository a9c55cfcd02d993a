//! `cargo xtask campaign`: see docs/power.md.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Instant;

use campaign::log::{self, Head, Log, Writer};
use campaign::{Outcome, Size, cases, report, run_all};
use clap::Parser;

/// Measures what the diagnosis can and cannot tell, and writes docs/power.md. Ctrl-C ends it with a page of what is
/// done; the same seed takes it up again where its log is kept.
#[derive(Parser)]
struct Arguments {
    /// Minutes instead of an hour; too few runs for the bars.
    #[arg(long, conflicts_with = "full")]
    quick: bool,
    /// Hours, for narrower bounds.
    #[arg(long)]
    full: bool,
    /// Seed; a fresh one where it is not given.
    #[arg(long)]
    seed: Option<u64>,
    /// Threads.
    #[arg(long)]
    threads: Option<usize>,
    /// Begin no run after so many minutes.
    #[arg(long)]
    minutes: Option<f64>,
    /// Only this row of the tables ("line", "nothing", "two", "chirp", ...), or the foreign effects of one set ("set 15"),
    /// with every run that is not right listed.
    #[arg(long)]
    only: Option<String>,
    /// Runs per family in place of the size's.
    #[arg(long)]
    runs: Option<u64>,
    /// List every run that is not right.
    #[arg(long)]
    list: bool,
    /// Where to write the page; nowhere where it is not given.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Folder in which each run is noted as it ends, in a file by the seed; a campaign of that seed goes on from there.
    #[arg(long)]
    log: Option<PathBuf>,
    /// Run nothing: the page of a log.
    #[arg(long, conflicts_with_all = ["seed", "log", "run"])]
    from: Option<PathBuf>,
    /// With `--only` and a seed: plant this one run and print the whole answer.
    #[arg(long, requires_all = ["only", "seed"])]
    run: Option<u64>,
    /// Date to print in the report.
    #[arg(long, default_value = "")]
    date: String,
}

fn main() -> ExitCode {
    match campaign_of(Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err((what, help)) => {
            eprintln!("error: {what}\nhelp:  {help}");
            ExitCode::from(2)
        }
    }
}

/// What happened, and what to do.
type Failure = (String, &'static str);

/// An error with a file.
fn with(path: &Path, help: &'static str) -> impl Fn(std::io::Error) -> Failure {
    let name = path.display().to_string();
    move |error| (format!("{name}: {error}"), help)
}

const WRITABLE: &str = "name a place that exists and can be written";
const ROWS: &str = "rows are the causes of docs/effects.md, \"nothing\", \"two\", and the foreign effects of docs/power.md";

fn campaign_of(a: Arguments) -> Result<(), Failure> {
    let (mut size, name) = match (a.quick, a.full) {
        (true, _) => (campaign::QUICK, "--quick "),
        (_, true) => (campaign::FULL, "--full "),
        _ => (campaign::DEFAULT, ""),
    };
    if let Some(n) = a.runs {
        size = Size::even(n);
    }
    let all = cases(size, a.only.as_deref());
    if all.is_empty() {
        let only = a.only.unwrap_or_default();
        return Err((format!("no row of the tables is called {only:?}"), ROWS));
    }
    let told = |log: &Log| {
        let command = format!("cargo xtask campaign {name}--seed {}", log.head.seed);
        let (runs, date) = (&log.outcomes, &log.head.date);
        report::page(runs, &command, date, log.seconds, all.len())
    };
    if let Some(path) = &a.from {
        let log = log::read(path).map_err(with(path, "name a file that --log made"))?;
        return put(&told(&log), a.out.as_deref());
    }
    let seed = a.seed.unwrap_or_else(campaign::fresh_seed);
    if let (Some(index), Some((family, _))) = (a.run, all.first()) {
        describe(seed, *family, index);
        return Ok(());
    }
    let program = log::program().map_err(with(Path::new("this program"), WRITABLE))?;
    let head = Head {
        program,
        seed,
        date: a.date.clone(),
    };
    let path = a.log.as_ref().map(|f| f.join(format!("{seed}.jsonl")));
    let before = path.as_deref().map_or(Ok(None), |p| earlier(p, &head))?;
    let writer = match &path {
        Some(p) => Some(Writer::open(p, &head, before.is_some()).map_err(with(p, WRITABLE))?),
        None => None,
    };
    let before = before.unwrap_or(Log {
        head,
        outcomes: vec![],
        seconds: 0.0,
    });
    let log = go_on(&a, before, &all, writer)?;
    put(&told(&log), a.out.as_deref())
}

/// Prints what is planted in one run, and what is found there.
fn describe(seed: u64, family: campaign::Family, index: u64) {
    let (told, d) = campaign::case::describe(seed, family, index);
    println!("planted: {told}");
    for f in &d.findings {
        println!("named {} on {}: {}", f.cause, f.channels.join("+"), f.what);
    }
    let checks = d.checks.iter();
    for c in checks.filter(|c| c.fails_after || c.threshold > 1e-4) {
        let (id, channel, p) = (&c.id, &c.channel, c.p_value.unwrap_or(f64::NAN));
        println!("{id} on {channel}: {:.3}, chance {p:.1e}", c.statistic);
    }
    for u in &d.unexplained {
        println!("unexplained on {}: {}", u.channel, u.what);
    }
}

/// What a log of this seed holds already. One that another build made is put aside: its runs would not be the same.
fn earlier(path: &Path, head: &Head) -> Result<Option<Log>, Failure> {
    if !path.exists() {
        return Ok(None);
    }
    if let Ok(log) = log::read(path)
        && (log.head.program, log.head.seed) == (head.program, head.seed)
    {
        println!("{} runs are in {}", log.outcomes.len(), path.display());
        return Ok(Some(log));
    }
    let aside = path.with_extension("jsonl.old");
    let (name, kept) = (path.display(), aside.display());
    println!("{name} is of another build: kept as {kept}, all runs anew");
    std::fs::rename(path, &aside).map_err(with(&aside, WRITABLE))?;
    Ok(None)
}

/// Runs what a log does not hold yet.
fn go_on(
    a: &Arguments,
    mut log: Log,
    all: &[(campaign::Family, u64)],
    writer: Option<Writer>,
) -> Result<Log, Failure> {
    log.outcomes.retain(|o| all.contains(&(o.family, o.index)));
    let held: std::collections::HashSet<_> =
        log.outcomes.iter().map(|o| (o.family, o.index)).collect();
    let left: Vec<_> = all.iter().copied().filter(|c| !held.contains(c)).collect();
    let threads = a.threads.unwrap_or_else(campaign::threads);
    let standard = !(a.quick || a.full || a.runs.is_some() || a.only.is_some());
    let minutes = a.minutes.or(standard.then_some(campaign::MINUTES));
    let list = a.list || a.only.is_some();
    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed))
        .map_err(|e| (format!("no handler for Ctrl-C: {e}"), "try again"))?;
    let (begun, done) = (Instant::now(), AtomicUsize::new(0));
    let written = Mutex::new((writer, None));
    let seen = |o: &Outcome| {
        let n = done.fetch_add(1, Ordering::Relaxed) + 1;
        let passed = begun.elapsed().as_secs_f64();
        if let Ok(mut w) = written.lock()
            && let Some(Err(error)) = w.0.as_mut().map(|f| f.add(o, log.seconds + passed))
        {
            *w = (None, Some(error));
        }
        if minutes.is_some_and(|m| log.seconds + passed > 60.0 * m) {
            stop.store(true, Ordering::Relaxed);
        }
        if list && report::worth_a_line(o) {
            println!("{}", report::line(o));
        }
        if !list && (n.is_multiple_of(20) || n == left.len()) {
            let left = passed / n as f64 * (left.len() - n) as f64;
            print!("\r{n} runs, {:.0} min left  ", left / 60.0);
            let _ = std::io::stdout().flush();
        }
    };
    let (seed, runs) = (log.head.seed, left.len());
    println!("seed {seed}, {runs} runs on {threads} threads");
    let new = run_all(seed, &left, threads, &stop, &seen);
    if let Ok((_, Some(error))) = written.into_inner() {
        eprintln!(
            "\nwarning: the log ended early, {error}: what came after cannot be taken up again"
        );
    }
    log.outcomes.extend(new);
    log.outcomes.sort_by_key(|o| (o.family, o.index));
    log.seconds += begun.elapsed().as_secs_f64();
    Ok(log)
}

/// The page to its file, and to whoever still reads.
fn put(text: &str, out: Option<&Path>) -> Result<(), Failure> {
    if let Some(path) = out {
        std::fs::write(path, text).map_err(with(path, WRITABLE))?;
    }
    let mut screen = std::io::stdout();
    let _ = writeln!(screen, "\n{text}");
    if let Some(path) = out {
        let _ = writeln!(screen, "written to {}", path.display());
    }
    Ok(())
}
