//! Toolchain, image, tests: what a newcomer types.

mod answers;
mod campaign;
mod effects;
mod image;
mod peers;
mod size;
mod step;
mod toolchain;

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::time::Instant;

use step::{Failure, run};

const USAGE: &str = "usage: cargo xtask COMMAND

  test     sets up what is missing and runs every check and test
  demo     hides something in the simulated stand, runs the image on it in the simulated ATmega16 for 600 s, captures,
           analyzes and diagnoses; a number after it is the seed
  campaign measures by rates what the diagnosis can tell, and writes docs/power.md: up to an hour on two cores;
           --quick for minutes, --full for hours, --seed N for a run that was made before, --help for the rest
  answers  --write [DIR] keeps what the engine says of some 400 records of every kind; --compare [DIR] names by record and
           path what has moved since: before and after a change of the engine's code that is to move nothing
  effects  writes docs/effects.md and its figures from the files of the effects; --check tells whether they are current
  image    builds the firmware for the ATmega16: target/avr/avr-none/firmware/firmware.{elf,hex}
  size     what the image costs beside the same function in C, and what grew; --accept writes docs/image-size.txt
  compare-peers
           Allan family against allantools (in a venv) and the crate `allan`: speed, memory, agreement; `--long` adds 1e8";

fn main() -> ExitCode {
    let command = std::env::args().nth(1);
    // Where it runs, not where it was built: checkouts may share a target folder.
    let own = std::env::var_os("CARGO_MANIFEST_DIR");
    let root = own.map_or_else(|| env!("CARGO_MANIFEST_DIR").into(), PathBuf::from);
    let root = root.join("..");
    let done = match command.as_deref() {
        Some("test") => test(&root),
        Some("demo") => demo(&root),
        Some("image") => build_image(&root),
        Some("campaign") => campaign::measure(&root, &std::env::args().skip(2).collect::<Vec<_>>()),
        Some("answers") => answers::freeze(&root, &std::env::args().skip(2).collect::<Vec<_>>()),
        Some("effects") => effects::page(&root, &std::env::args().skip(2).collect::<Vec<_>>()),
        Some("size") => size::report(&root, &std::env::args().skip(2).collect::<Vec<_>>()),
        Some("compare-peers") => peers::compare(&root, std::env::args().any(|a| a == "--long")),
        _ => {
            eprintln!("{USAGE}");
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

/// no_std crates, tested each alone as well: a run of the workspace unites features.
const ALONE: &[&str] = &["wire", "adis16250", "mma7260qt"];

fn test(root: &Path) -> Result<(), Failure> {
    let start = Instant::now();
    if !toolchain::has("cc") {
        toolchain::install("a C compiler, which Rust links with", &["gcc", "libc6-dev"])?;
    }
    if !toolchain::has("avrdude") {
        toolchain::install(
            "avrdude, which `imu-stand flash` is tested with",
            &["avrdude"],
        )?;
    }
    match std::env::var_os("IMU_STAND_DATA") {
        Some(folder) => println!("measured records: {}", Path::new(&folder).display()),
        None => println!(
            "measured records: IMU_STAND_DATA is unset, tests on them will say so and not run"
        ),
    }
    run("format", &mut cargo(root, &["fmt", "--all", "--check"]))?;
    toolchain::simulator()?;
    println!("== firmware for the ATmega16");
    build_image(root)?;
    let lints = "clippy --workspace --all-targets --quiet -- -D warnings";
    let mut steps: Vec<(String, Vec<&str>)> = vec![
        ("lints".into(), lints.split(' ').collect()),
        ("tests".into(), vec!["test", "--workspace", "--quiet"]),
    ];
    for package in ALONE {
        steps.push((
            format!("{package} alone"),
            vec!["test", "--quiet", "-p", package, "--no-default-features"],
        ));
    }
    for (name, arguments) in &steps {
        let from = Instant::now();
        println!("== {name}: cargo {}", arguments.join(" "));
        run(name, &mut cargo(root, arguments))?;
        println!("== {name}: {:.0} s", from.elapsed().as_secs_f64());
    }
    println!("all passed in {:.0} s", start.elapsed().as_secs_f64());
    Ok(())
}

fn build_image(root: &Path) -> Result<(), Failure> {
    let from = Instant::now();
    let elf = image::build(root)?;
    let sizes = image::sizes(&elf)?;
    println!(
        "image: {} B of 16384 B flash, {} B of 1024 B SRAM static, built in {:.0} s: {}",
        sizes.flash,
        sizes.sram,
        from.elapsed().as_secs_f64(),
        elf.display()
    );
    Ok(())
}

fn demo(root: &Path) -> Result<(), Failure> {
    toolchain::simulator()?;
    build_image(root)?;
    // Relative to the root, so that the command in the report can be typed again.
    let folder = Path::new("target/demo");
    std::fs::create_dir_all(root.join(folder)).map_err(|error| {
        Failure::new(
            &format!("{}: {error}", folder.display()),
            "make room or rights for it",
        )
    })?;
    // The capture of an earlier demo, which may be of a version that did not mark it as simulated.
    let _ = std::fs::remove_file(root.join(folder).join("capture.csv"));
    let seed = std::env::args().nth(2).unwrap_or_else(|| "2009".to_owned());
    // By cargo, which knows the target folder, wherever the user has set it.
    let build = "run --release -p imu-stand --features simavr -- run --seconds 600 --seed";
    let mut program = cargo(root, &build.split(' ').collect::<Vec<_>>());
    program.arg(&seed);
    for (option, file) in [
        ("--out", "capture.csv"),
        ("--analysis", "analysis.json"),
        ("--json", "diagnosis.json"),
        ("--report", "report.html"),
    ] {
        program.arg(option).arg(folder.join(file));
    }
    run("the demo", &mut program)?;
    println!(
        "capture, analysis and diagnosis beside the report: {}",
        folder.display()
    );
    Ok(())
}
