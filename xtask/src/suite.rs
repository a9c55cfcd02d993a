//! Every check and test, and the everyday part of them.

use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::image;
use crate::page;
use crate::reproduce;
use crate::step::{Crates, Failure, Pace, run, watched};
use crate::wheel::{self, Profile};
use crate::{cargo, say_sizes, toolchain};

mod programs;
mod which;

pub use programs::TestProgram;
use programs::side_by_side;
use which::{LONG, WAIT, integration_tests, package_name, packages, quick};

/// no_std crates, tested each alone as well: a run of the workspace unites features.
const ALONE: &[&str] = &["wire", "adis16250", "mma7260qt"];

/// How much is run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// Everything; tests that grade by rates make a sample of their draws.
    All,
    /// Everything, with all draws.
    AllDraws,
    /// Format, lints, and the tests that are quick.
    Everyday,
}

/// Runs the checks and tests.
///
/// # Errors
/// The first step that fails.
pub fn suite(root: &Path, extent: Extent) -> Result<(), Failure> {
    let start = Instant::now();
    prepared()?;
    let mut steps = Steps { root };
    steps.step("format", |root| {
        run("format", &mut cargo(root, &["fmt", "--all", "--check"])).map(|()| String::new())
    })?;
    steps.step("image for the ATmega16", image_without_complaint)?;
    if extent != Extent::Everyday {
        steps.step("image from another folder", |root| {
            reproduce::check(root).map(|()| String::new())
        })?;
    }
    steps.step("lints", |root| {
        let lints = [
            "clippy",
            "--workspace",
            "--all-targets",
            "--",
            "-D",
            "warnings",
        ];
        watched(
            "lints",
            &mut cargo(root, &lints),
            &mut Crates::default(),
            &mut Pace::Steady,
        )?;
        Ok("no warning".to_owned())
    })?;
    // Before the tests, which open it.
    if extent != Extent::Everyday {
        steps.step("page for a browser", page::page)?;
    }
    let mut built = Built::default();
    steps.step("build of the tests", |root| {
        built = Built::of(root, extent)?;
        Ok(format!("{} programs", built.tests.len()))
    })?;
    let mut beside = vec![];
    if extent != Extent::Everyday {
        steps.step("Python package", |root| {
            let installed = wheel::installed(root, Profile::Dev)?;
            beside.push(installed.tests(root, built.program()?));
            Ok(installed.said)
        })?;
        beside.push(short_demo(root, &built)?);
    }
    steps.step("tests", |root| built.run(root, extent, &beside))?;
    if extent != Extent::Everyday {
        beside_the_tests(&mut steps)?;
    }
    println!("all passed in {:.0} s", start.elapsed().as_secs_f64());
    Ok(())
}

/// What cargo tests beside the programs that were built: examples in the documentation, packages alone.
fn beside_the_tests(steps: &mut Steps<'_>) -> Result<(), Failure> {
    steps.step("examples in the documentation", |root| {
        let mut docs = cargo(root, &["test", "--workspace", "--doc"]);
        watched(
            "examples",
            &mut docs,
            &mut Crates::default(),
            &mut Pace::Steady,
        )?;
        Ok(String::new())
    })?;
    for package in ALONE {
        steps.step(&format!("{package} alone"), |root| {
            let mut alone = cargo(root, &["test", "--no-default-features", "-p", package]);
            watched(
                package,
                &mut alone,
                &mut Crates::default(),
                &mut Pace::Steady,
            )?;
            Ok(String::new())
        })?;
    }
    Ok(())
}

/// Installs what is missing and says what is not run.
fn prepared() -> Result<(), Failure> {
    if !toolchain::has("cc") {
        toolchain::install("a C compiler, which Rust links with", &["gcc", "libc6-dev"])?;
    }
    if !toolchain::has("avrdude") {
        toolchain::install(
            "avrdude, which `imu-stand flash` is tested with",
            &["avrdude"],
        )?;
    }
    // What looks at results as their users do: without them those tests say that they are left out.
    if !["chromium", "chromium-browser", "google-chrome"]
        .iter()
        .any(|name| toolchain::has(name))
        && let Err(failure) = toolchain::install(
            "Chromium, in which the report is looked at",
            &["chromium", "fonts-dejavu-core"],
        )
    {
        eprintln!("{failure}");
    }
    match std::env::var_os("IMU_STAND_DATA") {
        Some(folder) => println!("measured records: {}", Path::new(&folder).display()),
        None => println!(
            "measured records: IMU_STAND_DATA is unset, tests on them will say so and not run"
        ),
    }
    toolchain::simulator()
}

/// Steps, each with a line before it and one after.
struct Steps<'a> {
    root: &'a Path,
}

impl Steps<'_> {
    fn step(
        &mut self,
        name: &str,
        step: impl FnOnce(&Path) -> Result<String, Failure>,
    ) -> Result<(), Failure> {
        let from = Instant::now();
        println!("== {name}");
        let said = step(self.root)?;
        let comma = if said.is_empty() { "" } else { ", " };
        println!(
            "== {name}: {:.0} s{comma}{said}",
            from.elapsed().as_secs_f64()
        );
        Ok(())
    }
}

/// Builds the image; a build by the pinned toolchain that complains of anything fails.
fn image_without_complaint(root: &Path) -> Result<String, Failure> {
    let built = image::build(root, &mut Pace::Steady)?;
    for line in &built.complaints {
        eprintln!("{line}");
    }
    if built.complaints.is_empty() || !built.is_pinned {
        return say_sizes(&built.elf);
    }
    Err(Failure::new(
        "the build of the image says more than what it compiles",
        "mend what it complains of, above",
    ))
}

/// What the build of the tests made.
#[derive(Debug, Default)]
struct Built {
    tests: Vec<TestProgram>,
    /// The program itself, with the simulated ATmega16.
    program: Option<PathBuf>,
}

impl Built {
    fn of(root: &Path, extent: Extent) -> Result<Self, Failure> {
        // Examples are compiled by the lints, and run by nobody here.
        let mut builds = vec![cargo(root, &["test", "--workspace", "--no-run", "--tests"])];
        if extent == Extent::Everyday {
            // Of the engine, which is compiled as a release is, the tests beside its code take as long to compile as all the rest.
            let mut units = cargo(root, &["test", "--workspace", "--no-run", "--lib"]);
            let mut others = cargo(root, &["test", "--workspace", "--no-run", "--bins"]);
            for package in packages(root).iter().map(|folder| package_name(folder)) {
                if LONG.contains(&format!("{package} {package}").as_str()) {
                    units.args(["--exclude", &package]);
                }
            }
            for name in quick(&integration_tests(root)) {
                others.args(["--test", &name]);
            }
            builds = vec![others, units];
        }
        let mut messages = vec![];
        for mut build in builds {
            build.arg("--message-format=json-render-diagnostics");
            let what = "the build of the tests";
            let (mut crates, mut pace) = (Crates::default(), Pace::Steady);
            messages.extend(watched(what, &mut build, &mut crates, &mut pace)?.out);
        }
        Ok(Self::read(&messages))
    }

    /// Of the messages of cargo, one a line, whose fields come in an order that does not matter here.
    fn read(messages: &[String]) -> Self {
        let mut built = Built::default();
        for message in messages {
            let Some(file) = field(message, "executable").map(PathBuf::from) else {
                continue;
            };
            let (Some(manifest), Some(name)) =
                (field(message, "manifest_path"), field(message, "name"))
            else {
                continue;
            };
            let folder = Path::new(manifest)
                .parent()
                .map(Path::to_owned)
                .unwrap_or_default();
            // The profile's; the target has a `test` of its own, which says whether it could be one.
            let is_test = message.contains("\"test\":true},\"features\"");
            if !is_test {
                if name == "imu-stand" {
                    built.program = Some(file);
                }
                continue;
            }
            let package = package_name(&folder);
            let name = format!("{package} {name}");
            built.tests.push(TestProgram {
                file,
                arguments: vec![],
                environment: vec![("CARGO_MANIFEST_DIR", folder.clone().into())],
                folder,
                waits: WAIT.contains(&name.as_str()),
                name,
                objection: |_| None,
            });
        }
        built
    }

    /// The program.
    fn program(&self) -> Result<&Path, Failure> {
        self.program.as_deref().ok_or_else(|| {
            Failure::new(
                "the build of the tests made no program `imu-stand`",
                "`cargo build --workspace` shows why",
            )
        })
    }

    /// Runs the test programs and others beside them, which are started first; one on each core.
    fn run(&self, root: &Path, extent: Extent, beside: &[TestProgram]) -> Result<String, Failure> {
        let order = |test: &TestProgram| {
            let place = LONG.iter().position(|long| *long == test.name);
            place.unwrap_or(usize::MAX)
        };
        let mut tests: Vec<&TestProgram> = self.tests.iter().collect();
        tests.sort_by_key(|test| order(test));
        if extent == Extent::Everyday {
            tests.retain(|test| !LONG.contains(&test.name.as_str()));
        }
        tests.splice(0..0, beside);
        let done = side_by_side(&tests, extent == Extent::AllDraws)?;
        // Where to look which program is a long one.
        let seconds: String = (done.iter())
            .map(|d| format!("{:7.1} s {}\n", d.seconds, d.name))
            .collect();
        let _ = std::fs::write(root.join("target/test-seconds.txt"), seconds);
        let failed: Vec<&str> = (done.iter())
            .filter(|d| !d.passed)
            .map(|d| d.name.as_str())
            .collect();
        if !failed.is_empty() {
            return Err(Failure::new(
                &format!("tests failed: {}", failed.join(", ")),
                "what they said stands above; `cargo test -p PACKAGE --test NAME` runs one alone",
            ));
        }
        let passed: usize = done.iter().map(|d| d.tests).sum();
        let mut text = format!("{passed} passed in {} programs", done.len());
        if extent == Extent::Everyday {
            text += &format!("; {} long ones are left to `cargo xtask test`", LONG.len());
        }
        Ok(text)
    }
}

/// The value of a field of text in a line of JSON, the first of that name. Paths and names have no escapes here.
fn field<'a>(message: &'a str, name: &str) -> Option<&'a str> {
    let start = message.find(&format!("\"{name}\":\""))? + name.len() + 4;
    message[start..].split('"').next()
}

/// Most lines that the demo may print, whatever state the machine is in.
const MOST_LINES: usize = 60;

/// The demo with the program that the tests were built with: it is short, complains of nothing, and finds what is planted.
fn short_demo(root: &Path, built: &Built) -> Result<TestProgram, Failure> {
    let own = std::env::current_exe().map_err(|error| {
        Failure::new(&format!("the demo: {error}"), "`cargo xtask demo` shows it")
    })?;
    let program = built.program()?;
    Ok(TestProgram {
        name: "demo".to_owned(),
        file: own,
        arguments: vec!["demo".into(), "--program".into(), program.into()],
        environment: vec![("CARGO_MANIFEST_DIR", root.join("xtask").into())],
        folder: root.to_owned(),
        waits: false,
        objection,
    })
}

/// What is wrong with what the demo printed.
fn objection(lines: &[String]) -> Option<String> {
    if lines.len() > MOST_LINES {
        return Some(format!(
            "the demo prints {} lines, more than {MOST_LINES}",
            lines.len()
        ));
    }
    for word in ["warning", "BISECT", " WARN ", " { "] {
        if let Some(line) = lines.iter().find(|line| line.contains(word)) {
            return Some(format!("the demo prints `{word}`: {line}"));
        }
    }
    let compared = |line: &String| line.contains("planted ") && line.ends_with(": match");
    if !lines.iter().any(compared) {
        return Some("the demo ends without what was planted beside what was found".to_owned());
    }
    if !lines.iter().any(|line| line.starts_with("angle error")) {
        return Some("the demo ends without what the correction of the board is worth".to_owned());
    }
    if let Some(line) = lines.iter().find(|line| line.contains("WORSE")) {
        return Some(format!("the demo's correction is no gain: {line}"));
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn test_programs_and_the_program_are_read_from_cargos_messages() {
        let message = |target: &str, kind: &str, test: bool, file: &str| {
            format!(
                r#"{{"reason":"compiler-artifact","package_id":"path+file:///r/crates/cli#imu-stand@0.1.0","manifest_path":"/r/crates/cli/Cargo.toml","target":{{"kind":["{kind}"],"name":"{target}"}},"profile":{{"opt_level":"0","test":{test}}},"features":[],"executable":{file}}}"#
            )
        };
        let messages = [
            message("imu_stand", "lib", false, "null"),
            message("imu-stand", "bin", false, r#""/t/imu-stand""#),
            message("report", "test", true, r#""/t/report-1""#),
        ];
        let built = Built::read(&messages);
        assert_eq!(built.program, Some(PathBuf::from("/t/imu-stand")));
        let [test] = built.tests.as_slice() else {
            panic!("{built:?}")
        };
        assert_eq!(test.name, "imu-stand report");
        assert_eq!(test.folder, Path::new("/r/crates/cli"));
    }

    #[test]
    fn a_demo_that_is_long_complains_or_compares_nothing_is_objected_to() {
        let good = "    temperature on gyro_x, slope: planted 1, found 1 +- 1 deg/s/degC: match";
        let table = "angle error, deg rms: read -> corrected";
        let lines = |more: &[&str]| -> Vec<String> {
            more.iter()
                .chain(&[good, table])
                .map(|l| (*l).to_owned())
                .collect()
        };
        assert_eq!(objection(&lines(&[])), None);
        for word in [
            "warning: unused",
            "BISECT: running pass",
            " WARN rustc",
            "Tempco { gyro: 0 }",
        ] {
            assert!(objection(&lines(&[word])).is_some(), "{word}");
        }
        assert!(objection(&lines(&["a line"; 60])).is_some());
        assert!(objection(&[]).is_some());
        assert!(objection(&lines(&["! WORSE than"])).is_some());
        assert!(objection(&lines(&[])[..1]).is_some());
    }
}
