//! Toolchain, image, tests: what a newcomer types.

mod answers;
mod campaign;
mod closed;
mod demo;
mod effects;
mod fuzz;
mod image;
mod mutants;
mod page;
mod peers;
mod reproduce;
mod size;
mod soak;
mod step;
mod suite;
mod supply;
mod toolchain;
mod wheel;

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::time::Instant;

use step::{Failure, Pace};
use suite::Extent;

const USAGE: &str = "usage: cargo xtask COMMAND

  test     sets up what is missing and runs every check and test; those that grade by rates make a sample of their draws,
           with --all-draws all of them, as before a release
  check    the everyday part of it: format, lints, and the tests that are quick
  demo     hides something in the simulated stand, runs the image on it in the simulated ATmega16 for 600 s, captures,
           diagnoses, and shows what was planted beside what was found; then corrects the board by that, records the same
           stand again, and compares; a number after it is the seed, `--hide KIND` hides something else
  campaign measures by rates what the diagnosis can tell, and writes docs/power.md: up to an hour on two cores;
           --quick for minutes, --full for hours, --seed N for a run that was made before, --help for the rest
  answers  --write [DIR] keeps what the engine says of some 400 records of every kind; --compare [DIR] names by record and
           path what has moved since: before and after a change of the engine's code that is to move nothing
  effects  writes docs/effects.md and its figures from the files of the effects; --check tells whether they are current
  image    builds the firmware for the ATmega16: target/avr/avr-none/firmware/firmware.{elf,hex};
           --check-reproducible builds it in another folder too and compares
  size     what the image costs beside the same function in C, and what grew; --accept writes docs/image-size.txt;
           --search-flags looks for the C compiler's options of least flash, from `-fOPTION ...` on; --write keeps docs/c-flags.txt
  mutants  plants small faults in drivers, wire, firmware and bench, one at a time, and says which of them no test notices;
           --seed N and --count N draw, --minutes N bounds, --write keeps docs/mutants.txt, --registers plants those that only the image has
  loop     grades the loop over draws: recorded, diagnosed, the board corrected, recorded again; --draws N by the firmware's
           logic, --image N through its image, --seed N; --write keeps docs/loop.txt; 100 and 10 take 40 minutes of a core
  page     builds the page that runs the engine in a browser: target/page/index.html
  wheel    builds the Python package, target/wheel/dist/*.whl, and tests it in a virtual environment of its own;
           --dev compiles it as tests are
  soak     30 days of the board's time through its logic, 24 h through its image, 24 h of a live capture on a bad line;
           --quick for minutes, --hours N, --minutes N, --seed N, --only logic, image or line
  fuzz     any bytes in everything that is read: --minutes N for each target, --target NAME, --seed N, --stable
  supply   licences, sources and duplicates of the dependencies (cargo-deny), the oldest Rust that compiles them, and what is in the
           program (target/sbom/imu-stand.cdx.json, CycloneDX); --advisories asks the advisory database as well
  compare-peers
           Allan family against allantools (in a venv) and the crate `allan`: speed, memory, agreement; `--long` adds 1e8";

/// What [`USAGE`] says of a command, if that is all there is to say: the others have a help of their own.
fn help_of(command: &str) -> Option<String> {
    if ["campaign", "answers", "mutants"].contains(&command) {
        return None;
    }
    let mut lines = USAGE.lines().skip(2).skip_while(|line| {
        let name = line.strip_prefix("  ");
        name.is_none_or(|line| line.split(' ').next() != Some(command))
    });
    let first = lines.next()?;
    let rest = lines.take_while(|line| line.starts_with("    "));
    let text: Vec<&str> = std::iter::once(first).chain(rest).collect();
    Some(format!("cargo xtask\n{}", text.join("\n")))
}

fn main() -> ExitCode {
    let command = std::env::args().nth(1);
    let asks = std::env::args()
        .skip(2)
        .any(|word| word == "--help" || word == "-h");
    if let Some(help) = command.as_deref().filter(|_| asks).and_then(help_of) {
        println!("{help}");
        return ExitCode::SUCCESS;
    }
    // Where it runs, not where it was built: checkouts may share a target folder.
    let own = std::env::var_os("CARGO_MANIFEST_DIR");
    let own = own.map_or_else(|| env!("CARGO_MANIFEST_DIR").into(), PathBuf::from);
    let root = own.parent().unwrap_or(&own).to_owned();
    let done = match command.as_deref() {
        Some("test") => match std::env::args().nth(2).as_deref() {
            None => suite::suite(&root, Extent::All),
            Some("--all-draws") => suite::suite(&root, Extent::AllDraws),
            Some(_) => Err(Failure::new(
                "`cargo xtask test` takes --all-draws or nothing",
                "`cargo test -p PACKAGE --test NAME` runs one test program",
            )),
        },
        Some("check") => suite::suite(&root, Extent::Everyday),
        Some("demo") => demo::demo(&root, &std::env::args().skip(2).collect::<Vec<_>>()),
        Some("image") => match std::env::args().nth(2).as_deref() {
            None => build_image(&root, &mut Pace::Rarer(0)).map(|complaints| {
                complaints.iter().for_each(|line| eprintln!("{line}"));
            }),
            Some("--check-reproducible") => reproduce::check(&root),
            Some(_) => Err(Failure::new(
                "`cargo xtask image` takes --check-reproducible or nothing",
                "cargo xtask image",
            )),
        },
        Some("campaign") => campaign::measure(&root, &std::env::args().skip(2).collect::<Vec<_>>()),
        Some("answers") => answers::freeze(&root, &std::env::args().skip(2).collect::<Vec<_>>()),
        Some("effects") => effects::page(&root, &std::env::args().skip(2).collect::<Vec<_>>()),
        Some("loop") => closed::grade(&root, &std::env::args().skip(2).collect::<Vec<_>>()),
        Some("size") => size::report(&root, &std::env::args().skip(2).collect::<Vec<_>>()),
        Some("soak") => soak::soak(&root, &std::env::args().skip(2).collect::<Vec<_>>()),
        Some("fuzz") => fuzz::fuzz(&root, &std::env::args().skip(2).collect::<Vec<_>>()),
        Some("supply") => supply::supply(&root, &std::env::args().skip(2).collect::<Vec<_>>()),
        Some("mutants") => mutants::hunt(&root, &std::env::args().skip(2).collect::<Vec<_>>()),
        Some("page") => page::page(&root).map(|said| println!("{said}")),
        Some("wheel") => wheel::wheel(&root, &std::env::args().skip(2).collect::<Vec<_>>()),
        Some("compare-peers") => peers::compare(&root, std::env::args().any(|a| a == "--long")),
        Some("help" | "--help" | "-h") => {
            println!("{USAGE}");
            return ExitCode::SUCCESS;
        }
        other => {
            eprintln!("{USAGE}");
            if let Some(other) = other {
                eprintln!("\nerror: there is no command {other}");
            }
            return ExitCode::from(2);
        }
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("{failure}");
            ExitCode::FAILURE
        }
    }
}

/// A cargo of the toolchain that runs this.
fn cargo(root: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.current_dir(root).args(arguments);
    command
}

/// Builds the image and says how large it is; returns what the compiler complained of.
fn build_image(root: &Path, pace: &mut Pace) -> Result<Vec<String>, Failure> {
    let from = Instant::now();
    let built = image::build(root, pace)?;
    println!(
        "image: {}, built in {:.0} s: {}",
        say_sizes(&built.elf)?,
        from.elapsed().as_secs_f64(),
        built.elf.display()
    );
    Ok(built.complaints)
}

/// How large an image is, of what there is.
fn say_sizes(elf: &Path) -> Result<String, Failure> {
    let sizes = image::sizes(elf)?;
    Ok(format!(
        "{} B of 16384 B flash, {} B of 1024 B SRAM static",
        sizes.flash, sizes.sram
    ))
}

#[cfg(test)]
mod tests {
    use super::{Failure, fuzz, help_of, soak};

    #[test]
    fn every_command_says_what_it_does_where_it_is_asked() {
        for (command, told) in [
            ("size", "--accept"),
            ("size", "--search-flags"),
            ("soak", "--only logic"),
            ("fuzz", "--target NAME"),
            ("compare-peers", "--long"),
            ("image", "firmware.{elf,hex}"),
        ] {
            let help = help_of(command).expect("it is a command");
            assert!(help.contains(told), "{help}");
            assert!(!help.contains("every check and test"), "{help}");
        }
        assert_eq!(help_of("nix"), None);
        assert_eq!(help_of("campaign"), None, "it has its own");
    }

    #[test]
    fn an_option_that_there_is_not_is_named() {
        let understood = |command: &str, words: &[&str]| -> Result<(), Failure> {
            let words: Vec<String> = words.iter().map(|word| (*word).to_owned()).collect();
            match command {
                "fuzz" => fuzz::plan(&words).map(|_| ()),
                _ => soak::plan(&words).map(|_| ()),
            }
        };
        for command in ["fuzz", "soak"] {
            for (words, told) in [
                (&["--nix"][..], Some("it knows no --nix")),
                (&["--seed"], Some("--seed takes a value")),
                (&["--minutes", "2"], None),
            ] {
                let said = understood(command, words).err().map(|f| f.to_string());
                let is_told = match (&said, told) {
                    (Some(said), Some(told)) => {
                        said.contains(told) && said.contains(&format!("cargo xtask {command}"))
                    }
                    (said, told) => said.is_none() && told.is_none(),
                };
                assert!(is_told, "{command} {words:?}: {said:?}");
            }
        }
    }
}
