//! `cargo xtask campaign`: see docs/power.md.

use std::hash::{BuildHasher, Hasher};
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use campaign::{Outcome, Size, cases, report, run_all};
use clap::Parser;

/// Measures what the diagnosis can and cannot tell, and writes docs/power.md.
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
    /// Only this row of the tables ("line", "nothing", "two", "chirp", ...), with every run that is not right listed.
    #[arg(long)]
    only: Option<String>,
    /// Runs per family in place of the size's.
    #[arg(long)]
    runs: Option<u64>,
    /// List every run that is not right.
    #[arg(long)]
    list: bool,
    /// Where to write the report; nowhere where it is not given.
    #[arg(long)]
    out: Option<PathBuf>,
    /// With `--only` and a seed: plant this one run and print the whole answer.
    #[arg(long, requires_all = ["only", "seed"])]
    run: Option<u64>,
    /// Date to print in the report.
    #[arg(long, default_value = "")]
    date: String,
}

fn main() -> ExitCode {
    let a = Arguments::parse();
    let (mut size, name) = match (a.quick, a.full) {
        (true, _) => (campaign::QUICK, "--quick "),
        (_, true) => (campaign::FULL, "--full "),
        _ => (campaign::DEFAULT, ""),
    };
    if let Some(n) = a.runs {
        size = Size {
            clean: n,
            elsewhere: n,
            one: n,
            counted: n,
            pairs: n,
            foreign: n,
        };
    }
    let seed = a
        .seed
        .unwrap_or_else(|| std::hash::RandomState::new().build_hasher().finish() >> 16);
    let threads = a
        .threads
        .or_else(|| std::thread::available_parallelism().ok().map(Into::into))
        .unwrap_or(1);
    let all = cases(size, a.only.as_deref());
    if all.is_empty() {
        eprintln!(
            "error: no row of the tables is called {:?}",
            a.only.unwrap_or_default()
        );
        eprintln!(
            "help:  rows are the causes of docs/effects.md, \"nothing\", \"two\", and the foreign effects of docs/power.md"
        );
        return ExitCode::from(2);
    }
    if let (Some(index), Some((family, _))) = (a.run, all.first()) {
        let (told, d) = campaign::case::describe(seed, *family, index);
        println!("planted: {told}");
        for f in &d.findings {
            println!("named {} on {}: {}", f.cause, f.channels.join("+"), f.what);
        }
        for u in &d.unexplained {
            println!("unexplained on {}: {}", u.channel, u.what);
        }
        return ExitCode::SUCCESS;
    }
    let list = a.list || a.only.is_some();
    let begun = Instant::now();
    let done = AtomicUsize::new(0);
    let seen = |o: &Outcome| {
        let n = done.fetch_add(1, Ordering::Relaxed) + 1;
        if list && report::worth_a_line(o) {
            println!("{}", report::line(o));
        }
        if !list && (n.is_multiple_of(20) || n == all.len()) {
            let left = begun.elapsed().as_secs_f64() / n as f64 * (all.len() - n) as f64;
            print!("\r{n} of {} runs, {:.0} min left  ", all.len(), left / 60.0);
            let _ = std::io::stdout().flush();
        }
    };
    println!("seed {seed}, {} runs on {threads} threads", all.len());
    let outcomes = run_all(seed, &all, threads, &seen);
    let command = format!("cargo xtask campaign {name}--seed {seed}");
    let text = report::page(&outcomes, &command, &a.date, begun.elapsed().as_secs_f64());
    println!("\n{text}");
    if let Some(path) = a.out {
        if let Err(error) = std::fs::write(&path, &text) {
            eprintln!("error: {}: {error}", path.display());
            eprintln!("help:  name a file in a folder that exists and can be written");
            return ExitCode::FAILURE;
        }
        println!("written to {}", path.display());
    }
    ExitCode::SUCCESS
}
