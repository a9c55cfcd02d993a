//! Fuzzing: by cargo-fuzz where it is installed, else by mutations of the corpus on stable.

use std::path::Path;
use std::process::Command;

use crate::cargo;
use crate::step::{Failure, run};
use crate::toolchain::{NIGHTLY, has};

/// Targets of `fuzz/`, each of which `crates/cli/tests/fuzz.rs` or `crates/wire/tests/fuzz_corpus.rs` has on stable.
const TARGETS: [&str; 12] = [
    "frames", "requests", "capture", "mapping", "model", "npy", "npz", "parquet", "mat", "hdf5",
    "log", "packed",
];
/// Fuzzed on stable alone: it lives in the program.
const ARGUMENTS: &str = "arguments";

const HELP: &str = "--minutes N for each target (1), --target NAME for one of them, --seed N, --stable for the driver that needs \
                    neither cargo-fuzz nor nightly";

pub(crate) struct Plan {
    minutes: f64,
    target: Option<String>,
    seed: u64,
    stable: bool,
}

/// Options that take a value.
const VALUED: [&str; 3] = ["--minutes", "--seed", "--target"];

pub(crate) fn plan(arguments: &[String]) -> Result<Plan, Failure> {
    let wrong = |what: &str| Failure::new(&format!("`cargo xtask fuzz`: {what}"), HELP);
    let mut plan = Plan {
        minutes: 1.0,
        target: None,
        seed: 20_261_124,
        stable: false,
    };
    let mut words = arguments.iter();
    while let Some(word) = words.next() {
        if word == "--stable" {
            plan.stable = true;
            continue;
        }
        if !VALUED.contains(&word.as_str()) {
            return Err(wrong(&format!("it knows no {word}")));
        }
        let value = words.next();
        let value = value.ok_or_else(|| wrong(&format!("{word} takes a value")))?;
        let number = value
            .parse::<f64>()
            .ok()
            .filter(|n| *n > 0.0 && n.is_finite());
        match (word.as_str(), number) {
            ("--minutes", Some(minutes)) => plan.minutes = minutes,
            ("--seed", Some(seed)) => plan.seed = seed as u64,
            ("--target", _) if TARGETS.contains(&value.as_str()) || value == ARGUMENTS => {
                plan.target = Some(value.clone());
            }
            ("--target", _) => {
                return Err(wrong(&format!(
                    "there is no target {value}; there are {}, {ARGUMENTS}",
                    TARGETS.join(", ")
                )));
            }
            _ => return Err(wrong(&format!("it knows no {word} {value}"))),
        }
    }
    Ok(plan)
}

/// Fuzzes each target for so long.
///
/// # Errors
/// When something is found: the input is kept, and its path printed.
pub fn fuzz(root: &Path, arguments: &[String]) -> Result<(), Failure> {
    let plan = plan(arguments)?;
    let wanted = |name: &str| plan.target.as_deref().is_none_or(|target| target == name);
    let with_libfuzzer = !plan.stable && is_cargo_fuzz_there(root);
    if !with_libfuzzer && !plan.stable {
        println!(
            "cargo-fuzz or {NIGHTLY} is not installed (`cargo install cargo-fuzz`, `rustup toolchain install {NIGHTLY}`): mutations \
             of the corpus by a seed stand for it"
        );
    }
    let seconds = (plan.minutes * 60.0).ceil();
    if with_libfuzzer {
        for target in TARGETS.into_iter().filter(|name| wanted(name)) {
            println!("== {target}");
            run(target, &mut libfuzzer(root, target, seconds, plan.seed))?;
        }
    } else {
        on_stable(root, &plan, seconds)?;
    }
    if wanted(ARGUMENTS) {
        println!("== {ARGUMENTS}");
        let mut words = cargo(
            root,
            &["test", "--quiet", "--workspace", "--bin", "imu-stand"],
        );
        words.args(["--", "--nocapture", "any_words"]);
        run(ARGUMENTS, with(&mut words, seconds, plan.seed))?;
    }
    Ok(())
}

fn with(command: &mut Command, seconds: f64, seed: u64) -> &mut Command {
    command
        .env("IMU_STAND_FUZZ_SECONDS", seconds.to_string())
        .env("IMU_STAND_SEED", seed.to_string())
}

fn is_cargo_fuzz_there(root: &Path) -> bool {
    let mut version = Command::new("rustup");
    version.args(["run", NIGHTLY, "cargo", "fuzz", "--version"]);
    has("cargo-fuzz")
        && version
            .current_dir(root)
            .output()
            .is_ok_and(|output| output.status.success())
}

fn libfuzzer(root: &Path, target: &str, seconds: f64, seed: u64) -> Command {
    let mut command = Command::new("rustup");
    command.current_dir(root);
    command.args(["run", NIGHTLY, "cargo", "fuzz", "run", target]);
    // What it finds of its own goes there; the committed corpus stays as it is.
    let found = format!("target/fuzz/{target}");
    let _ = std::fs::create_dir_all(root.join(&found));
    command.arg(&found);
    for seeds in [
        format!("fuzz/corpus/{target}"),
        "crates/cli/tests/data".to_owned(),
    ] {
        if root.join(&seeds).is_dir() {
            command.arg(seeds);
        }
    }
    command.arg("--");
    command.args([
        format!("-max_total_time={seconds}"),
        format!("-seed={}", seed % u64::from(u32::MAX)),
        "-timeout=10".to_owned(),
        "-rss_limit_mb=3072".to_owned(),
        "-max_len=20000".to_owned(),
        "-print_final_stats=1".to_owned(),
    ]);
    command
}

fn on_stable(root: &Path, plan: &Plan, seconds: f64) -> Result<(), Failure> {
    let target = plan.target.as_deref();
    let is_wire = |name: &str| ["frames", "requests"].contains(&name);
    if target.is_none_or(is_wire) {
        println!("== frames, requests");
        let mut wire = cargo(
            root,
            &["test", "--quiet", "--workspace", "--test", "fuzz_corpus"],
        );
        wire.args(["--", "--nocapture"]);
        run("frames, requests", with(&mut wire, seconds, plan.seed))?;
    }
    if target.is_none_or(|name| !is_wire(name) && name != ARGUMENTS) {
        println!("== files");
        let mut files = cargo(root, &["test", "--quiet", "--workspace", "--test", "fuzz"]);
        files.args(["--", "--nocapture"]);
        if let Some(target) = target {
            files.env("IMU_STAND_FUZZ_TARGET", target);
        }
        run("files", with(&mut files, seconds, plan.seed))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str) -> Result<Plan, Failure> {
        let words: Vec<String> = text.split_whitespace().map(str::to_owned).collect();
        plan(&words)
    }

    #[test]
    fn targets_are_known_by_name_and_each_has_its_file() {
        let plan = of("--minutes 3 --target npy --stable").expect("all known");
        assert_eq!((plan.minutes, plan.target.as_deref()), (3.0, Some("npy")));
        for wrong in ["--target pdf", "--minutes 0", "--minutes", "--long 3"] {
            assert!(of(wrong).is_err(), "{wrong}");
        }
        let manifest = include_str!("../../fuzz/Cargo.toml");
        for target in TARGETS {
            assert!(
                manifest.contains(&format!("name = \"{target}\"")),
                "{target}"
            );
        }
    }
}
