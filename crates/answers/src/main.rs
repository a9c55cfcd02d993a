//! `cargo xtask answers`: writes what the engine says of some 400 records, or compares it with what was written.
//!
//! A refactoring moves nothing. Each record's answer is one JSON file; a comparison names record, path, old and new.

mod compare;
mod records;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use clap::Parser;
use serde_json::Value;

use records::Entry;

/// Writes what the engine says of some 400 records of every kind, or compares it with what was written.
#[derive(Parser)]
struct Arguments {
    /// Write the answers to a folder.
    #[arg(long, value_name = "DIR", conflicts_with = "compare")]
    write: Option<PathBuf>,
    /// Compare with the answers in a folder; ends with 1 where something moved.
    #[arg(long, value_name = "DIR", required_unless_present = "write")]
    compare: Option<PathBuf>,
    /// Only records whose name holds this text.
    #[arg(long, value_name = "TEXT")]
    only: Option<String>,
    /// Threads; all processors where it is not given.
    #[arg(long)]
    threads: Option<usize>,
    /// Lines of what moved in each record, at most.
    #[arg(long, default_value_t = 20)]
    lines: usize,
}

/// Seconds between two lines of progress.
const PROGRESS_S: f64 = 10.0;

fn main() -> ExitCode {
    match answered(&Arguments::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(what) => {
            eprintln!("error: {what}");
            ExitCode::from(2)
        }
    }
}

/// The first words of the records' names.
fn kinds(entries: &[Entry]) -> String {
    let mut kinds: Vec<&str> = entries
        .iter()
        .filter_map(|e| e.name.split(' ').next())
        .collect();
    kinds.sort_unstable();
    kinds.dedup();
    kinds.join(", ")
}

/// Whether nothing moved.
fn answered(a: &Arguments) -> Result<bool, String> {
    let mut entries = records::all()?;
    if let Some(text) = &a.only {
        let kinds = kinds(&entries);
        entries.retain(|e| e.name.contains(text));
        if entries.is_empty() {
            return Err(format!(
                "no record's name holds `{text}`; they begin with {kinds}"
            ));
        }
    }
    let begun = Instant::now();
    let answers = run(&entries, a.threads);
    println!(
        "{} records in {:.0} s",
        answers.len(),
        begun.elapsed().as_secs_f64()
    );
    match (&a.write, &a.compare) {
        (Some(folder), _) => write(folder, &entries, &answers).map(|()| true),
        (_, Some(folder)) => compare_with(folder, &entries, &answers, a),
        _ => Ok(true),
    }
}

/// The answers in the order of the entries.
fn run(entries: &[Entry], threads: Option<usize>) -> Vec<Value> {
    let threads = threads
        .or_else(|| std::thread::available_parallelism().ok().map(Into::into))
        .unwrap_or(1);
    let (next, told) = (AtomicUsize::new(0), Mutex::new(Instant::now()));
    let mut all: Vec<(usize, Value)> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads)
            .map(|_| {
                scope.spawn(|| {
                    let mut own = vec![];
                    loop {
                        let i = next.fetch_add(1, Ordering::Relaxed);
                        let Some(entry) = entries.get(i) else {
                            return own;
                        };
                        own.push((i, (entry.answer)()));
                        if let Ok(mut last) = told.lock()
                            && last.elapsed().as_secs_f64() > PROGRESS_S
                        {
                            println!("{i} of {}: {}", entries.len(), entry.name);
                            *last = Instant::now();
                        }
                    }
                })
            })
            .collect();
        workers
            .into_iter()
            .flat_map(|w| match w.join() {
                Ok(own) => own,
                Err(panic) => std::panic::resume_unwind(panic),
            })
            .collect()
    });
    all.sort_by_key(|(i, _)| *i);
    all.into_iter().map(|(_, v)| v).collect()
}

/// The file of a record.
fn file(folder: &Path, name: &str) -> PathBuf {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    folder.join(format!(
        "{}.json",
        name.chars().map(plain).collect::<String>()
    ))
}

fn write(folder: &Path, entries: &[Entry], answers: &[Value]) -> Result<(), String> {
    let with = |path: &Path, error: std::io::Error| format!("{}: {error}", path.display());
    std::fs::create_dir_all(folder).map_err(|e| with(folder, e))?;
    for (entry, answer) in entries.iter().zip(answers) {
        let path = file(folder, &entry.name);
        std::fs::write(&path, answer.to_string()).map_err(|e| with(&path, e))?;
    }
    println!("written to {}", folder.display());
    Ok(())
}

/// Whether nothing moved against a folder. A record without an answer there has moved.
fn compare_with(
    folder: &Path,
    entries: &[Entry],
    answers: &[Value],
    a: &Arguments,
) -> Result<bool, String> {
    let (mut moved, mut paths) = (0, BTreeSet::new());
    for (entry, answer) in entries.iter().zip(answers) {
        let path = file(folder, &entry.name);
        let text = match std::fs::read_to_string(&path) {
            Ok(text) => text,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound && folder.is_dir() => {
                moved += 1;
                println!("{}: no answer there, a new record", entry.name);
                continue;
            }
            Err(e) => return Err(format!("{}: {e}; write the answers first", path.display())),
        };
        let before: Value =
            serde_json::from_str(&text).map_err(|e| format!("{}: {e}", path.display()))?;
        let differences = compare::differences(&before, answer);
        if differences.is_empty() {
            continue;
        }
        moved += 1;
        println!("{}: {} moved", entry.name, differences.len());
        for d in differences.iter().take(a.lines) {
            println!("  {d}");
        }
        paths.extend(differences.iter().map(compare::Difference::kind));
    }
    println!("{moved} of {} records moved", entries.len());
    if moved > 0 {
        let kinds: Vec<_> = paths.into_iter().collect();
        println!("what moved: {}", kinds.join(", "));
    }
    Ok(moved == 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_that_no_record_has_is_an_error_that_names_the_kinds() {
        let asked = Arguments::parse_from(["answers", "--compare", "x", "--only", "nix"]);
        let said = answered(&asked).expect_err("there is none");
        assert!(
            said.contains("`nix`") && said.contains("campaign, "),
            "{said}"
        );
    }
}
