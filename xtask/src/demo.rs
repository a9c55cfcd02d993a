//! The demo: something is hidden in the simulated stand, the image samples it, and the diagnosis says what it was. Then the board
//! is corrected by that, and the same stand recorded again.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::step::{Crates, Failure, Pace, Silent, watched};
use crate::{build_image, cargo, toolchain};

/// What is hidden where nobody says what, and the seed: the run of the README, with a figure that shows it.
const HIDE: &str = "tempco";
const SEED: &str = "5";
/// What can be hidden: `imu-stand run --hide` knows no other, and is not built yet when this is asked for.
const KINDS: [&str; 30] = [
    "random",
    "none",
    "tempco",
    "tempco-curved",
    "motor-coupling",
    "motor-noise",
    "supply-coupling",
    "vibration",
    "knock",
    "stall",
    "silent-stall",
    "warm-up",
    "leak",
    "slow-filter",
    "wandering-bias",
    "trap",
    "g-sensitivity",
    "common-noise",
    "noisy-spell",
    "glitches",
    "stuck-bit",
    "dead-spi",
    "lossy-line",
    "shove",
    "scale-error",
    "wrong-crystal",
    "bump",
    "acc-tempco",
    "acc-reference",
    "uncalibrated",
];
/// Where its files go, from the root, so that the command in the report can be typed again.
const FOLDER: &str = "target/demo";
/// All that the program says.
const TEXT: &str = "diagnosis.txt";
/// Lines that it prints of that, before what was planted stands beside what was found.
const LINES: usize = 12;
/// Most lines of what was planted and found.
const MOST_COMPARED: usize = 11;
/// How that part begins.
const COMPARED: &str = "planted and found";
/// How what the loop prints after that part begins.
const CORRECTED: &str = "correction ";
/// Most lines of it.
const MOST_CORRECTED: usize = 12;

/// What the demo takes.
struct Options {
    hide: String,
    seed: String,
    /// A program that is built already.
    program: Option<PathBuf>,
}

fn options(arguments: &[String]) -> Result<Options, Failure> {
    let usage = |what: &str| {
        Failure::new(
            what,
            &format!(
                "cargo xtask demo [SEED] [--hide KIND]; the kinds: {}",
                KINDS.join(", ")
            ),
        )
    };
    let mut options = Options {
        hide: HIDE.to_owned(),
        seed: SEED.to_owned(),
        program: None,
    };
    let mut rest = arguments.iter();
    while let Some(argument) = rest.next() {
        let mut value = || {
            let missing = || usage(&format!("{argument} needs a value"));
            rest.next().cloned().ok_or_else(missing)
        };
        match argument.as_str() {
            "--hide" => {
                options.hide = value()?;
                if !KINDS.contains(&options.hide.as_str()) {
                    return Err(usage(&format!(
                        "nothing called `{}` can be hidden",
                        options.hide
                    )));
                }
            }
            "--program" => options.program = Some(PathBuf::from(value()?)),
            seed if seed.parse::<u64>().is_ok() => options.seed = seed.to_owned(),
            other => return Err(usage(&format!("`demo` does not know {other}"))),
        }
    }
    Ok(options)
}

/// Runs it, in fewer than 60 lines.
///
/// # Errors
/// Toolchain, build, or the run.
pub fn demo(root: &Path, arguments: &[String]) -> Result<(), Failure> {
    let options = options(arguments)?;
    let mut pace = Pace::Rarer(0);
    toolchain::simulator()?;
    build_image(root, &mut pace)?;
    let folder = Path::new(FOLDER);
    let no_room = |error| Failure::new(&format!("{FOLDER}: {error}"), "make room or rights for it");
    std::fs::create_dir_all(root.join(folder)).map_err(no_room)?;
    // The capture of an earlier demo, which may be of a version that did not mark it as simulated.
    let _ = std::fs::remove_file(root.join(folder).join("capture.csv"));
    if options.program.is_none() {
        build(root, &mut pace)?;
    }
    let mut program = program(root, &options);
    program.args(["run", "--seconds", "600", "--hide", &options.hide]);
    program.args(["--seed", &options.seed]);
    for (option, file) in [
        ("--out", "capture.csv"),
        ("--analysis", "analysis.json"),
        ("--json", "diagnosis.json"),
        ("--report", "report.html"),
    ] {
        program.arg(option).arg(folder.join(file));
    }
    println!(
        "run: {} hidden in the simulated stand, seed {}; the image samples 600 s of it, the diagnosis sees the capture alone",
        options.hide, options.seed
    );
    let mut meter = Silent("600 s of the stand, then the diagnosis and the report");
    let said = watched("the run", &mut program, &mut meter, &mut pace)?;
    let text = said.out.join("\n") + "\n";
    std::fs::write(root.join(folder).join(TEXT), text).map_err(no_room)?;
    for line in abridged(&said.out) {
        println!("{line}");
    }
    println!("(with a figure of the cause; capture, analysis and diagnosis lie beside it)");
    corrected(root, &options, &mut pace)
}

/// The same stand once more: its board corrected by what is found, and a second record held against the first.
fn corrected(root: &Path, options: &Options, pace: &mut Pace) -> Result<(), Failure> {
    let folder = Path::new(FOLDER);
    let mut program = program(root, options);
    // By the firmware's logic: the image would take as long again for each 600 s.
    program.args(["run", "--native", "--correct", "--no-replicates"]);
    program.args(["--seconds", "600"]);
    program.args(["--hide", &options.hide, "--seed", &options.seed]);
    program.arg("--out").arg(folder.join("loop.csv"));
    program.arg("--json").arg(folder.join("loop.json"));
    let mut meter = Silent("the same again, the correction, and 1260 s under another history");
    let said = watched("the loop", &mut program, &mut meter, pace)?;
    println!(
        "\nthe loop closed, on the firmware's logic: the board corrected by what its record showed"
    );
    for line in (said.out.iter())
        .skip_while(|line| !line.starts_with(CORRECTED))
        .take(MOST_CORRECTED)
    {
        println!("{line}");
    }
    Ok(())
}

/// How cargo is told of the program.
const PROGRAM: [&str; 6] = [
    "--release",
    "-p",
    "imu-stand",
    "--features",
    "simavr",
    "--bin=imu-stand",
];

/// A call of the program, which is built: cargo knows the target folder, wherever the user has set it.
fn program(root: &Path, options: &Options) -> Command {
    match &options.program {
        Some(program) => {
            let mut command = Command::new(program);
            command.current_dir(root);
            command
        }
        None => {
            let mut run = cargo(root, &["run", "--quiet"]);
            run.args(PROGRAM).arg("--");
            run
        }
    }
}

/// Builds the program.
fn build(root: &Path, pace: &mut Pace) -> Result<(), Failure> {
    let mut build = cargo(root, &["build"]);
    build.args(PROGRAM);
    let from = std::time::Instant::now();
    watched(
        "the build of the program",
        &mut build,
        &mut Crates::default(),
        pace,
    )?;
    println!("program: built in {:.0} s", from.elapsed().as_secs_f64());
    Ok(())
}

/// The verdict and the finding, then what was planted beside what was found.
fn abridged(lines: &[String]) -> Vec<String> {
    let compared = (lines.iter()).position(|line| line.starts_with(COMPARED));
    let (before, compared) = lines.split_at(compared.unwrap_or(lines.len()));
    let mut shown: Vec<String> = before.iter().take(LINES).cloned().collect();
    if before.len() > LINES {
        let rest = before.len() - LINES;
        shown.push(format!("    ({rest} lines more: {FOLDER}/{TEXT})\n"));
    }
    shown.extend(compared.iter().take(MOST_COMPARED).cloned());
    if compared.len() > MOST_COMPARED {
        let rest = compared.len() - MOST_COMPARED;
        shown.push(format!("    ({rest} lines more: {FOLDER}/{TEXT})"));
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn however_much_is_said_what_was_planted_is_shown_in_few_lines() {
        let mut lines: Vec<String> = (0..500).map(|n| format!("line {n}")).collect();
        lines.push(COMPARED.to_owned());
        lines.extend((0..100).map(|n| format!("planted {n}")));
        let shown = abridged(&lines);
        assert!(shown.join("\n").lines().count() <= LINES + MOST_COMPARED + 3);
        assert!(shown.iter().any(|line| line == COMPARED));
        assert!(shown.iter().any(|line| line == "planted 0"));
    }

    #[test]
    fn what_is_short_is_shown_whole() {
        let lines = ["a", "b", COMPARED, "planted x, found x: match"].map(str::to_owned);
        assert_eq!(abridged(&lines), lines);
    }

    #[test]
    fn a_number_is_the_seed_and_what_is_unknown_is_refused() {
        let of =
            |words: &[&str]| options(&words.iter().map(|w| (*w).to_owned()).collect::<Vec<_>>());
        let options = of(&["7", "--hide", "trap"]).expect("both are known");
        assert_eq!(
            (options.seed.as_str(), options.hide.as_str()),
            ("7", "trap")
        );
        assert!(of(&["--seed"]).is_err());
        assert!(of(&["--hide"]).is_err());
        // At once, with what there is.
        let said = of(&["--hide", "nothing"])
            .err()
            .map(|failure| failure.to_string());
        let said = said.expect("there is none");
        assert!(
            said.contains("nothing called `nothing`") && said.contains("none, tempco"),
            "{said}"
        );
    }

    #[test]
    fn what_can_be_hidden_is_what_the_program_can_hide() {
        let source = include_str!("../../crates/cli/src/stand/hidden.rs");
        let (_, body) = source.split_once("pub enum Hidden {").expect("the enum");
        let (body, _) = body.split_once('}').expect("its end");
        let variants = body
            .lines()
            .map(str::trim)
            .filter(|line| line.ends_with(',') && !line.starts_with('/'));
        let kebab = |name: &str| {
            let mut text = String::new();
            for c in name.trim_end_matches(',').chars() {
                if c.is_uppercase() && !text.is_empty() {
                    text.push('-');
                }
                text.extend(c.to_lowercase());
            }
            text
        };
        let all: Vec<String> = variants.map(kebab).collect();
        assert_eq!(all, KINDS);
    }
}
