//! The Python package: its wheel, and its tests in a virtual environment of its own.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::step::{Crates, Failure, Pace, Silent, run, watched};
use crate::suite::TestProgram;
use crate::{cargo, toolchain};

/// What builds the wheel and what its tests need; allantools is what deviations are compared with, so it is fixed. Dask maps
/// over the captures of a fleet.
const PACKAGES: &[&str] = &[
    "maturin>=1.9,<2",
    "numpy",
    "pandas",
    "pytest",
    "allantools==2024.6",
    "dask[dataframe]",
    "distributed",
];

/// What Debian and Ubuntu call Python and its virtual environments.
const DEBIAN: &[&str] = &["python3", "python3-venv"];

/// How a wheel is compiled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Profile {
    /// For use.
    Release,
    /// As the tests are, whose crates are there already.
    Dev,
}

/// Builds the wheel and the program, and tests the one against the other: for use, or with `--dev` as the tests are
/// compiled, which is quicker where their crates are there.
///
/// # Errors
/// Where Python or a package is missing, a build or a test fails.
pub fn wheel(root: &Path, arguments: &[String]) -> Result<(), Failure> {
    let (profile, folder) = match arguments {
        [] => (Profile::Release, "release"),
        [dev] if dev == "--dev" => (Profile::Dev, "debug"),
        _ => {
            return Err(Failure::new(
                "`cargo xtask wheel` takes --dev or nothing",
                "leave the rest out",
            ));
        }
    };
    let mut program = cargo(root, &["build", "--workspace", "--bin", "imu-stand"]);
    if profile == Profile::Release {
        program = cargo(root, &["build", "--release", "--bin", "imu-stand"]);
    }
    let (mut crates, mut pace) = (Crates::default(), Pace::Rarer(0));
    watched("the program", &mut program, &mut crates, &mut pace)?;
    let program = root.join("target").join(folder).join("imu-stand");
    let installed = installed(root, profile)?;
    let program = program.with_extension(std::env::consts::EXE_EXTENSION);
    let said = watched(
        "the tests of the wheel",
        &mut installed.tests(root, &program).command(),
        &mut Silent("runs"),
        &mut Pace::Steady,
    )?;
    let counted = said.all.last().map_or("", String::as_str).trim_matches('=');
    println!("{}, {}", installed.said, counted.trim());
    Ok(())
}

/// The wheel, in a virtual environment.
pub struct Installed {
    python: PathBuf,
    /// Where the wheel is and how large.
    pub said: String,
}

impl Installed {
    /// Its tests, those against the program too.
    pub fn tests(&self, root: &Path, program: &Path) -> TestProgram {
        TestProgram {
            name: "Python package".to_owned(),
            file: self.python.clone(),
            arguments: ["-m", "pytest", "-q", "-p", "no:cacheprovider", "tests"]
                .map(OsString::from)
                .to_vec(),
            environment: vec![
                ("PYTHONDONTWRITEBYTECODE", "1".into()),
                ("IMU_STAND_PROGRAM", program.into()),
            ],
            folder: root.join("crates/python"),
            waits: false,
            objection: |_| None,
        }
    }
}

/// Builds the wheel and installs it where its tests are run.
///
/// # Errors
/// As [`wheel`].
pub fn installed(root: &Path, profile: Profile) -> Result<Installed, Failure> {
    let python = environment(root)?;
    let dist = root.join("target/wheel/dist");
    // One wheel is left in it: the one that is tested.
    if dist.exists() {
        std::fs::remove_dir_all(&dist).map_err(|error| cannot(&dist, &error))?;
    }
    build(root, profile, &python, &dist)?;
    let wheel = only_file(&dist)?;
    let mut install = pip(&python);
    install.args(["--force-reinstall", "--no-deps"]).arg(&wheel);
    run("the wheel", &mut install)?;
    let bytes = std::fs::metadata(&wheel).map_or(0, |file| file.len());
    let said = format!(
        "{} of {:.1} MB",
        wheel.strip_prefix(root).unwrap_or(&wheel).display(),
        bytes as f64 / 1e6
    );
    Ok(Installed { python, said })
}

fn build(root: &Path, profile: Profile, python: &Path, dist: &Path) -> Result<(), Failure> {
    let mut maturin = Command::new(python);
    maturin
        .current_dir(root.join("crates/python"))
        .args(["-m", "maturin", "build", "--quiet", "--locked", "--out"])
        .arg(dist)
        .arg("--interpreter")
        .arg(python);
    // What the tests were built of serves it, too; a release has a folder of its own, for maturin sets what `pyo3` is built for.
    let (name, target) = match profile {
        Profile::Release => ("release", root.join("target/wheel")),
        Profile::Dev => ("dev", root.join("target")),
    };
    maturin
        .args(["--profile", name])
        .env("CARGO_TARGET_DIR", target);
    watched(
        "the build of the wheel",
        &mut maturin,
        &mut Silent("compiling"),
        &mut Pace::Steady,
    )
    .map(drop)
}

/// The Python of the virtual environment, made where it is missing.
fn environment(root: &Path) -> Result<PathBuf, Failure> {
    let folder = root.join("target/wheel/venv");
    let python = folder.join(if cfg!(windows) {
        "Scripts/python.exe"
    } else {
        "bin/python"
    });
    let has = |python: &Path, module: &str| {
        let mut import = Command::new(python);
        import.args(["-c", &format!("import {module}")]);
        import.output().is_ok_and(|output| output.status.success())
    };
    if !has(
        &python,
        "maturin, numpy, pandas, pytest, allantools, dask.dataframe, distributed",
    ) {
        // Debian's python3 has no ensurepip without python3-venv.
        if !has(Path::new("python3"), "venv, ensurepip") {
            toolchain::install("Python, for the wheel", DEBIAN)?;
        }
        let mut venv = Command::new("python3");
        venv.args(["-m", "venv", "--clear"]).arg(&folder);
        run("a virtual environment of Python", &mut venv)?;
        let mut install = pip(&python);
        install.args(PACKAGES);
        let mut meter = Silent("downloading and unpacking");
        watched("pip", &mut install, &mut meter, &mut Pace::Steady).map_err(|failure| {
            eprintln!("{failure}");
            Failure::new(
                "the packages that the wheel is built and tested with could not be installed",
                &format!(
                    "let pip reach its index, or name a folder of wheels by PIP_FIND_LINKS; then `{} -m pip install {}`",
                    python.display(),
                    quoted(PACKAGES)
                ),
            )
        })?;
    }
    Ok(python)
}

/// Names that a shell takes as they are.
fn quoted(names: &[&str]) -> String {
    let quoted: Vec<String> = names.iter().map(|name| format!("'{name}'")).collect();
    quoted.join(" ")
}

fn pip(python: &Path) -> Command {
    let mut command = Command::new(python);
    command.args([
        "-m",
        "pip",
        "install",
        "--quiet",
        "--disable-pip-version-check",
    ]);
    command
}

fn cannot(path: &Path, error: &std::io::Error) -> Failure {
    Failure::new(
        &format!("{}: {error}", path.display()),
        "make room or rights for it",
    )
}

fn only_file(folder: &Path) -> Result<PathBuf, Failure> {
    let mut files = std::fs::read_dir(folder).map_err(|error| cannot(folder, &error))?;
    match files.next() {
        Some(Ok(file)) => Ok(file.path()),
        _ => Err(Failure::new(
            &format!("{} has no wheel", folder.display()),
            "run it again: another build may have taken it away",
        )),
    }
}
