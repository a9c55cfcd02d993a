//! What the image costs, beside the same function in C, and what grew since the figures in docs/image-size.txt.

mod search;

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::image::{self, Sizes};
use crate::step::{Failure, Pace, run};

/// The figures that this compares with; `--accept` rewrites them.
const BASELINE: &str = "docs/image-size.txt";
/// Changes of a function below this many bytes are not told.
const TOLD_FROM: i64 = 8;
/// How many changes are told, largest first.
const TOLD: usize = 20;

/// A goal for the Rust image.
struct Goal {
    /// Most, as a multiple of the C image.
    ratio: Option<f64>,
    /// Most, as it is.
    most: Option<u32>,
}

const FLASH: Goal = Goal {
    ratio: Some(1.05),
    // 16 KiB less 512 B for a boot loader.
    most: Some(15_872),
};
const SRAM: Goal = Goal {
    ratio: None,
    most: Some(640),
};
const CYCLES: Goal = Goal {
    ratio: Some(1.0),
    most: None,
};
const NO_GOAL: Goal = Goal {
    ratio: None,
    most: None,
};

impl Goal {
    /// In words, with whether it is met; empty where there is none.
    fn verdict(&self, rust: u32, c: u32) -> String {
        let ratio = f64::from(rust) / f64::from(c.max(1));
        let mut goals = Vec::new();
        let mut met = true;
        if let Some(most) = self.ratio {
            goals.push(format!("<= {most:.2} x C"));
            met &= ratio <= most;
        }
        if let Some(most) = self.most {
            goals.push(format!("<= {most}"));
            met &= rust <= most;
        }
        if goals.is_empty() {
            return String::new();
        }
        format!(
            "{} {}",
            goals.join(", "),
            if met { "met" } else { "NOT MET" }
        )
    }
}

/// What running an image in the simulator showed.
#[derive(Clone, Copy)]
struct Cost {
    /// Cycles awake for each tick at 20 Hz.
    cycles: u32,
    /// What a correction in use adds to them, at rest.
    corrected: u32,
    /// From the tick until its sample is queued, timer ticks, the longest of a busy session.
    busy_ticks: u32,
    /// Deepest stack of that session, bytes.
    stack: u32,
    /// Peak-to-peak jitter of the sampling instant, cycles.
    jitter: u32,
}

/// Builds both images and prints the table and what grew.
///
/// # Errors
/// Toolchain or build.
pub fn report(root: &Path, arguments: &[String]) -> Result<(), Failure> {
    let accept = match arguments {
        [] => false,
        [option] if option == "--accept" => true,
        [option, more @ ..] if option == "--search-flags" => return search::search(root, more),
        _ => {
            return Err(Failure::new(
                &format!("`size` does not know {}", arguments.join(" ")),
                "cargo xtask size, with --accept or --search-flags, or nothing",
            ));
        }
    };
    let rust = image::build(root, &mut Pace::Rarer(0))?.elf;
    let c = build_reference(root)?;
    let sizes = [image::sizes(&rust)?, image::sizes(&c)?];
    let costs = measure(root, &[&rust, &c]);
    let table = match costs.as_deref() {
        Ok(&[of_rust, of_c]) => table(&sizes, Some([of_rust, of_c])),
        _ => table(&sizes, None),
    };
    print!("{table}");
    if let Err(why) = &costs {
        println!("stack and cycles are not measured: {why}");
    }
    let now = functions(&rust)?;
    let path = root.join(BASELINE);
    if accept {
        costs.map_err(|why| {
            Failure::new(
                &format!("figures without stack and cycles are not accepted: {why}"),
                "run it where the simulator builds",
            )
        })?;
        return write(&path, &table, &now);
    }
    match std::fs::read_to_string(&path) {
        Ok(text) => print!("{}", changes(&parse(&text), &now)),
        Err(error) => println!("{BASELINE}: {error}; `cargo xtask size --accept` writes it"),
    }
    Ok(())
}

/// Builds the C reference as its README says, by `AVR_GCC` where it is set.
fn build_reference(root: &Path) -> Result<PathBuf, Failure> {
    let elf = root.join("target/avr/reference.elf");
    build_with(root, &[], &elf, Stdio::inherit())?;
    Ok(elf)
}

/// Builds it with options beside those in `flags`; what the compiler says goes to `complaints`.
fn build_with(
    root: &Path,
    options: &[String],
    elf: &Path,
    complaints: Stdio,
) -> Result<(), Failure> {
    let folder = reference_folder(root);
    let no_folder = |error| {
        Failure::new(
            &format!("{}: {error}", folder.display()),
            "is it all there?",
        )
    };
    let mut sources = Vec::new();
    for entry in std::fs::read_dir(&folder).map_err(no_folder)? {
        let name = entry.map_err(no_folder)?.file_name();
        if Path::new(&name).extension().is_some_and(|kind| kind == "c") {
            sources.push(name);
        }
    }
    // LTO lays the code out in this order.
    sources.sort();
    let elf_from_folder = std::path::absolute(elf).map_err(no_folder)?;
    let mut gcc = gcc(root, &["@flags"]);
    gcc.args(options)
        .args(sources)
        .arg("-o")
        .arg(elf_from_folder)
        .stderr(complaints);
    run("the build of the C reference", &mut gcc)
}

fn reference_folder(root: &Path) -> PathBuf {
    root.join("hil-tests/c-reference")
}

/// The compiler of the C reference, in its folder; `AVR_GCC` names another release, or a script that adds options.
fn gcc(root: &Path, arguments: &[&str]) -> Command {
    let mut gcc = Command::new(std::env::var_os("AVR_GCC").unwrap_or_else(|| "avr-gcc".into()));
    gcc.current_dir(reference_folder(root)).args(arguments);
    gcc
}

/// Runs the images in the simulator, which not every machine has the libraries for.
fn measure(root: &Path, images: &[&Path]) -> Result<Vec<Cost>, String> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo)
        .current_dir(root)
        .args([
            "run",
            "--quiet",
            "-p",
            "hil-tests",
            "--example",
            "cost",
            "--",
        ])
        .args(images)
        .stderr(std::process::Stdio::inherit())
        .output()
        .map_err(|error| error.to_string())?;
    if !output.status.success() {
        return Err("hil-tests/examples/cost.rs does not build or run, see above".to_owned());
    }
    let text = String::from_utf8_lossy(&output.stdout);
    let costs = text.lines().map(|line| {
        let value = |key: &str| {
            let word = line
                .split_whitespace()
                .find_map(|word| word.strip_prefix(key));
            word.and_then(|word| word.strip_prefix('=')?.parse().ok())
                .ok_or_else(|| format!("cost does not say {key}: {line}"))
        };
        Ok::<_, String>(Cost {
            cycles: value("cycles")?,
            corrected: value("corrected")?,
            busy_ticks: value("busy_ticks")?,
            stack: value("stack")?,
            jitter: value("jitter")?,
        })
    });
    let costs = costs.collect::<Result<Vec<Cost>, String>>()?;
    if costs.len() == images.len() {
        Ok(costs)
    } else {
        Err("cost says too little".to_owned())
    }
}

fn table(sizes: &[Sizes; 2], costs: Option<[Cost; 2]>) -> String {
    let [rust, c] = sizes;
    let mut text = format!("{:<44}{:>8}{:>8}{:>8}\n", "", "Rust", "C", "ratio");
    let mut row = |what: &str, rust: u32, c: u32, goal: &Goal| {
        let ratio = if c == 0 {
            "-".to_owned()
        } else {
            format!("{:.2}", f64::from(rust) / f64::from(c))
        };
        let verdict = goal.verdict(rust, c);
        let line = format!("{what:<44}{rust:>8}{c:>8}{ratio:>8}  {verdict}");
        let _ = writeln!(text, "{}", line.trim_end());
    };
    row("flash, B (.text + .data)", rust.flash, c.flash, &FLASH);
    row("static SRAM, B", rust.sram, c.sram, &NO_GOAL);
    if let Some([of_rust, of_c]) = costs {
        row("deepest stack, B", of_rust.stack, of_c.stack, &NO_GOAL);
        let sram = [rust.sram + of_rust.stack, c.sram + of_c.stack];
        row("SRAM with it, B", sram[0], sram[1], &SRAM);
        row(
            "cycles a sample at 20 Hz, all that is awake",
            of_rust.cycles,
            of_c.cycles,
            &CYCLES,
        );
        row(
            "what a correction in use adds to them",
            of_rust.corrected,
            of_c.corrected,
            &CYCLES,
        );
        row(
            "tick to queued sample, us, longest",
            of_rust.busy_ticks * 4,
            of_c.busy_ticks * 4,
            &NO_GOAL,
        );
        row(
            "jitter of the sampling instant, cycles",
            of_rust.jitter,
            of_c.jitter,
            &NO_GOAL,
        );
    }
    text
}

/// Bytes of each function and static by its name, kinds apart: `t` is flash, `b` and `d` are SRAM.
type Functions = BTreeMap<(char, String), i64>;

/// Reads them off by avr-nm.
fn functions(elf: &Path) -> Result<Functions, Failure> {
    let output = Command::new("avr-nm")
        .args(["-S", "--size-sort"])
        .arg(elf)
        .output();
    let output = output
        .ok()
        .filter(|output| output.status.success())
        .ok_or_else(|| {
            Failure::new(
                "avr-nm does not list the image",
                "is binutils-avr installed?",
            )
        })?;
    let mut found = Functions::new();
    for line in String::from_utf8_lossy(&output.stdout).lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        let [_, size, kind, name] = words[..] else {
            continue;
        };
        let (Ok(size), Some(kind)) = (i64::from_str_radix(size, 16), kind.chars().next()) else {
            continue;
        };
        // Without the hashes, which are another machine's tomorrow.
        let name = format!("{:#}", rustc_demangle::demangle(name));
        *found.entry((kind.to_ascii_lowercase(), name)).or_insert(0) += size;
    }
    Ok(found)
}

fn write(path: &Path, table: &str, functions: &Functions) -> Result<(), Failure> {
    let mut text = String::from(
        "# `cargo xtask size` compares with this file; `cargo xtask size --accept` writes it.\n#\n",
    );
    for line in table.lines() {
        let _ = writeln!(text, "# {line}");
    }
    text.push_str("#\n# Bytes of the Rust image by function and static: t flash, b and d SRAM.\n");
    let mut sorted: Vec<_> = functions.iter().collect();
    sorted.sort_by_key(|&(name, &size)| (std::cmp::Reverse(size), name));
    for ((kind, name), size) in sorted {
        let _ = writeln!(text, "{size:>5} {kind} {name}");
    }
    std::fs::write(path, text).map_err(|error| {
        Failure::new(
            &format!("{}: {error}", path.display()),
            "make room or rights for it",
        )
    })?;
    println!("{BASELINE} written");
    Ok(())
}

/// The figures of the file.
fn parse(text: &str) -> Functions {
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    let figures = lines.filter_map(|line| {
        let (size, rest) = line.trim_start().split_once(' ')?;
        let (kind, name) = rest.split_once(' ')?;
        Some(((kind.chars().next()?, name.to_owned()), size.parse().ok()?))
    });
    figures.collect()
}

/// What grew and what shrank, largest changes first, and the sum.
fn changes(before: &Functions, now: &Functions) -> String {
    let mut all: Vec<(i64, &(char, String))> = Vec::new();
    let names: std::collections::BTreeSet<_> = before.keys().chain(now.keys()).collect();
    for name in names {
        let size = |of: &Functions| of.get(name).copied().unwrap_or(0);
        all.push((size(now) - size(before), name));
    }
    let sum: i64 = all.iter().map(|(change, _)| change).sum();
    all.retain(|(change, _)| change.abs() >= TOLD_FROM);
    all.sort_by_key(|&(change, name)| (std::cmp::Reverse(change.abs()), name));
    if all.is_empty() {
        return format!(
            "against {BASELINE}: no function changed by {TOLD_FROM} B or more, {sum:+} B in all\n"
        );
    }
    let mut text = format!("against {BASELINE}: {sum:+} B in all\n");
    for (change, (kind, name)) in all.iter().take(TOLD) {
        let _ = writeln!(text, "{change:>+6} {kind} {name}");
    }
    if let Some(more) = all.len().checked_sub(TOLD).filter(|&more| more > 0) {
        let _ = writeln!(text, "and {more} smaller changes");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figures(of: &[(char, &str, i64)]) -> Functions {
        of.iter()
            .map(|&(kind, name, size)| ((kind, name.to_owned()), size))
            .collect()
    }

    #[test]
    fn what_grew_comes_first_and_small_changes_count_in_the_sum_alone() {
        let before = figures(&[('t', "a::b", 100), ('t', "gone", 40), ('b', "c", 5)]);
        let now = figures(&[
            ('t', "a::b", 190),
            ('b', "c", 7),
            ('t', "<X as Y>::new", 12),
        ]);
        assert_eq!(
            changes(&before, &now),
            "against docs/image-size.txt: +64 B in all\n   +90 t a::b\n   -40 t gone\n   +12 t <X as Y>::new\n"
        );
    }

    #[test]
    fn what_is_written_is_read_back() {
        let now = figures(&[('t', "<X as Y>::new", 12), ('b', "c", 7)]);
        let path = std::env::temp_dir().join(format!("image-size-{}.txt", std::process::id()));
        write(&path, "table\n", &now).expect("a temporary file");
        let text = std::fs::read_to_string(&path).expect("it was written");
        std::fs::remove_file(&path).expect("it is ours");
        assert_eq!(parse(&text), now);
    }

    #[test]
    fn a_goal_of_two_parts_is_met_by_both() {
        assert_eq!(FLASH.verdict(11_500, 11_000), "<= 1.05 x C, <= 15872 met");
        assert_eq!(
            FLASH.verdict(11_600, 11_000),
            "<= 1.05 x C, <= 15872 NOT MET"
        );
        assert_eq!(
            FLASH.verdict(15_873, 15_500),
            "<= 1.05 x C, <= 15872 NOT MET"
        );
    }
}
