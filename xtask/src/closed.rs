//! The loop, graded over many draws: recorded, diagnosed, the board corrected, recorded again.

use std::fmt::Write as _;
use std::path::Path;
use std::process::Stdio;

use crate::cargo;
use crate::step::{Failure, Pace, commit, date};

/// Where `--write` keeps what was measured.
const PAGE: &str = "docs/loop.txt";
/// Where the answers go, so that the same seed takes up what was cut off. It is of one commit.
const KEPT: &str = "target/loop";
const HELP: &str = "cargo xtask loop [--draws N] [--image N] [--seed N] [--write]: N draws by the firmware's logic (100, 20 s of a \
                    core each), N through its image (10, half a minute each); --write keeps docs/loop.txt";

/// What is asked for.
#[derive(Debug, PartialEq, Eq)]
struct Asked {
    draws: u64,
    image: u64,
    seed: Option<u64>,
    write: bool,
}

impl Asked {
    fn of(arguments: &[String]) -> Result<Self, Failure> {
        let mut asked = Self {
            draws: 100,
            image: 10,
            seed: None,
            write: false,
        };
        let bad = |what: &str| Failure::new(&format!("`cargo xtask loop`: {what}"), HELP);
        let mut words = arguments.iter();
        while let Some(word) = words.next() {
            let mut number = || {
                let value = words.next().and_then(|value| value.parse::<u64>().ok());
                value.ok_or_else(|| bad(&format!("{word} takes a number")))
            };
            match word.as_str() {
                "--draws" => asked.draws = number()?,
                "--image" => asked.image = number()?,
                "--seed" => asked.seed = Some(number()?),
                "--write" => asked.write = true,
                _ => return Err(bad(&format!("it knows no {word}"))),
            }
        }
        Ok(asked)
    }
}

/// Makes the draws, prints how they are graded, and keeps it where that is asked for.
///
/// # Errors
/// When it does not build, or a grade is below what is asked.
pub fn grade(root: &Path, arguments: &[String]) -> Result<(), Failure> {
    let asked = Asked::of(arguments)?;
    let clock = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    let seed = (asked.seed).unwrap_or_else(|| clock.map_or(0, |time| time.as_secs()));
    crate::toolchain::simulator()?;
    if asked.image > 0 {
        crate::build_image(root, &mut Pace::Steady)?;
    }
    let commit = commit(root);
    let date = date();
    let mut page = format!(
        "# `cargo xtask loop --write` writes this: how near corrected rates come to what the noise alone leaves (measurements.md, The loop).\n\
         # {date}, commit {commit}: cargo xtask loop --draws {} --image {} --seed {seed}\n",
        asked.draws, asked.image
    );
    let mut all_met = true;
    for (through, draws) in [("logic", asked.draws), ("image", asked.image)] {
        if draws == 0 {
            continue;
        }
        let mut test = cargo(
            root,
            &["test", "--quiet", "--workspace", "--test", "correct"],
        );
        test.args(["--", "--nocapture", "a_correction_by"]);
        let kept = root.join(KEPT).join(format!("{commit}-{through}"));
        test.env("IMU_STAND_KEPT", kept);
        test.env("IMU_STAND_THROUGH", through);
        test.env("IMU_STAND_SEED", seed.to_string());
        test.env("IMU_STAND_LOOPS", draws.to_string());
        let output = test.stderr(Stdio::inherit()).output().map_err(|error| {
            Failure::new(&format!("cargo: {error}"), "is it installed and in PATH?")
        })?;
        all_met &= output.status.success();
        let _ = writeln!(page, "\n{draws} draws, through the {through}");
        for line in graded(&String::from_utf8_lossy(&output.stdout)) {
            let _ = writeln!(page, "{line}");
        }
    }
    print!("{page}");
    if asked.write {
        let path = root.join(PAGE);
        std::fs::write(&path, page)
            .map_err(|error| Failure::new(&format!("{PAGE}: {error}"), "is it writable?"))?;
    }
    if all_met {
        return Ok(());
    }
    Err(Failure::new(
        "the test of the draws failed",
        "its message stands above; `imu-stand run --native --correct` with the kind and the seed of a draw makes it again",
    ))
}

/// Of what the test prints, what is its own: not how cargo frames it.
fn graded(said: &str) -> impl Iterator<Item = &str> {
    said.lines()
        .skip_while(|line| !line.starts_with("draw "))
        .take_while(|line| !line.is_empty() && !line.starts_with("test "))
        .filter(|line| *line != ".")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_asked_is_read_and_what_is_not_known_is_refused() {
        let of = |text: &str| {
            Asked::of(
                &text
                    .split_whitespace()
                    .map(str::to_owned)
                    .collect::<Vec<_>>(),
            )
        };
        let asked = of("--draws 12 --seed 3 --write").expect("all known");
        assert_eq!((asked.draws, asked.image), (12, 10));
        assert_eq!((asked.seed, asked.write), (Some(3), true));
        for wrong in ["--draws", "--draws x", "--nix", "12"] {
            assert!(of(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn of_what_the_test_says_the_draws_and_the_grades_are_kept() {
        let said = "\nrunning 1 test\nIMU_STAND_SEED=1 IMU_STAND_LOOPS=1\ndraw 0: tempco\n| a |\nbetter: 1 of 1\n.\ntest result: ok.\n";
        let kept: Vec<&str> = graded(said).collect();
        assert_eq!(kept, ["draw 0: tempco", "| a |", "better: 1 of 1"]);
    }
}
