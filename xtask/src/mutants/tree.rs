//! A copy of the working tree in which mutants are compiled and tested, so that nobody's files change.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use super::list::Mutant;
use crate::image;
use crate::step::{Failure, Pace};

/// No build takes longer.
const DEADLINE: Duration = Duration::from_secs(900);
/// How often the clock is looked at.
const LOOKED: Duration = Duration::from_millis(50);
/// And how often what the tests have said so far is read.
const LOOKS_PER_READING: u32 = 40;
/// A test that takes longer than that hangs: none takes a minute on two idle cores.
const PATIENCE: Duration = Duration::from_secs(300);

/// The tests of purpose of a package: stages, of which the later ones run where the earlier ones noticed nothing.
fn stages(package: &str) -> &'static [&'static [&'static str]] {
    const STAND: &[&str] = &["-p", "bench", "--test", "native"];
    // Holds the twin in double precision beside the fixed point, and both to the equations.
    const FIRMWARE: &[&str] = &["-p", "firmware", "--lib"];
    match package {
        "firmware" => &[FIRMWARE, STAND],
        "bench" => &[&["-p", "bench", "--lib", "--test", "physics"], STAND],
        "wire" => &[
            &[
                "-p",
                "wire",
                "--lib",
                "--test",
                "decode",
                "--test",
                "link",
                "--test",
                "ref_vectors",
                "--test",
                "roundtrip",
            ],
            FIRMWARE,
        ],
        "adis16250" => &[&["-p", "adis16250", "--tests"]],
        "mma7260qt" => &[&["-p", "mma7260qt", "--tests"]],
        _ => &[],
    }
}

/// Tests of the image that meet what the host's did not notice: programs of `hil-tests`.
fn of_the_image(package: &str) -> &'static [&'static str] {
    match package {
        "firmware" => &["boot", "motor", "stop", "faults", "flood"],
        _ => &[],
    }
}

/// What the tests make of a mutant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// By this test.
    Caught(String),
    /// It is no program.
    DoesNotCompile,
    Survived,
}

/// The copy.
pub struct Tree {
    /// The working tree.
    origin: PathBuf,
    root: PathBuf,
    target: PathBuf,
}

impl Tree {
    /// Copies what git knows or would take, as it lies in the working tree, to a folder of this name: two runs that go on at the
    /// same time need two.
    pub fn copy(root: &Path, name: &str) -> Result<Self, Failure> {
        let tree = Self {
            origin: root.to_owned(),
            root: root.join("target/mutants").join(name),
            target: root.join("target/mutants/build"),
        };
        let output = Command::new("git")
            .current_dir(root)
            .args(["ls-files", "-co", "--exclude-standard", "-z"])
            .output();
        let output = output.ok().filter(|output| output.status.success());
        let names = output.ok_or_else(|| {
            Failure::new("git does not list the files", "is this a checkout of git?")
        })?;
        let names = String::from_utf8_lossy(&names.stdout).into_owned();
        let mut there = BTreeSet::new();
        let names = names.split_terminator('\0');
        // The copy lies in the tree, so cargo reads the tree's settings for it too: with its own it would have each flag twice.
        for name in names.filter(|name| !name.starts_with(".cargo/")) {
            // Deleted, but not yet told to git.
            if let Ok(bytes) = std::fs::read(root.join(name)) {
                tree.put(name, &bytes)?;
                there.insert(tree.root.join(name));
            }
        }
        forget(&tree.root, &there);
        Ok(tree)
    }

    pub fn root(&self) -> &Path {
        &self.root
    }

    /// Writes a file unless it is the same: what does not change is not compiled again.
    fn put(&self, name: &str, bytes: &[u8]) -> Result<(), Failure> {
        let path = self.root.join(name);
        if std::fs::read(&path).is_ok_and(|there| there == bytes) {
            return Ok(());
        }
        let folder = path.parent().unwrap_or(&self.root);
        std::fs::create_dir_all(folder)
            .and_then(|()| std::fs::write(&path, bytes))
            .map_err(|error| {
                Failure::new(
                    &format!("{}: {error}", path.display()),
                    "make room or rights for it",
                )
            })
    }

    /// Works on a tree in which a file is changed by `change`, and puts it back.
    pub fn changed<T>(
        &self,
        file: &str,
        change: impl FnOnce(&str) -> Option<String>,
        work: impl FnOnce() -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        let gone = |what: String| Failure::new(&what, "has it changed? run it again");
        let was = std::fs::read_to_string(self.root.join(file))
            .map_err(|error| gone(format!("{file}: {error}")))?;
        let with = change(&was).ok_or_else(|| gone(format!("{file} is not as it was listed")))?;
        self.put(file, with.as_bytes())?;
        let done = work();
        self.put(file, was.as_bytes())?;
        done
    }

    /// The tests against a mutant.
    pub fn try_one(&self, mutant: &Mutant) -> Result<Outcome, Failure> {
        self.changed(
            &mutant.file,
            |text| mutant.applied(text),
            || self.test(mutant.package),
        )
    }

    /// The tests of a package.
    pub fn test(&self, package: &str) -> Result<Outcome, Failure> {
        for stage in stages(package) {
            let mut build = self.cargo(stage);
            build.arg("--no-run");
            if !self.watch(&mut build, DEADLINE)?.passed {
                return Ok(Outcome::DoesNotCompile);
            }
            let ended = self.watch(&mut self.cargo(stage), PATIENCE)?;
            if !ended.passed {
                return Ok(Outcome::Caught(ended.by));
            }
        }
        let programs = of_the_image(package);
        if programs.is_empty() {
            return Ok(Outcome::Survived);
        }
        let Ok(built) = image::build(&self.root, &mut Pace::Rarer(0)) else {
            return Ok(Outcome::Caught("the build of the image".to_owned()));
        };
        for program in programs {
            if let Some(by) = self.test_image(&built.elf, program)? {
                return Ok(Outcome::Caught(by));
            }
        }
        Ok(Outcome::Survived)
    }

    /// The test of a program of `hil-tests`, as it is in the working tree, that fails with an image.
    pub fn test_image(&self, elf: &Path, program: &str) -> Result<Option<String>, Failure> {
        let arguments = ["test", "--quiet", "-p", "hil-tests", "--test", program];
        let mut build = crate::cargo(&self.origin, &arguments);
        if !self.watch(build.arg("--no-run"), DEADLINE)?.passed {
            return Err(Failure::new(
                &format!("hil-tests/tests/{program}.rs does not compile"),
                &format!(
                    "a test that is no program notices nothing; {} says why. It is of the working tree, which is to be left alone \
                     meanwhile",
                    self.root.with_extension("log").display()
                ),
            ));
        }
        let mut command = crate::cargo(&self.origin, &arguments);
        command.env("IMU_STAND_IMAGE", elf);
        let ended = self.watch(&mut command, PATIENCE)?;
        Ok((!ended.passed).then_some(ended.by))
    }

    fn cargo(&self, stage: &[&str]) -> Command {
        let mut command = crate::cargo(&self.root, &["test", "--quiet"]);
        command.args(stage).env("CARGO_TARGET_DIR", &self.target);
        // Compiled once and run once: what takes least in all. Lints are of no interest here.
        for package in ["firmware", "bench", "wire"] {
            command.args([
                "--config",
                &format!("profile.dev.package.{package}.opt-level=1"),
            ]);
        }
        command.args(["--config", "profile.dev.debug=false"]);
        command.env("RUSTFLAGS", "--cap-lints=allow");
        command
    }

    /// Runs tests until they end, or are taken to hang.
    fn watch(&self, command: &mut Command, patience: Duration) -> Result<Ended, Failure> {
        let log = self.root.with_extension("log");
        let file = std::fs::File::create(&log).and_then(|file| Ok((file.try_clone()?, file)));
        let (out, err) = file.map_err(|error| {
            Failure::new(&format!("{}: {error}", log.display()), "make room for it")
        })?;
        apart(command);
        let mut child = command
            .stdin(Stdio::null())
            .stdout(out)
            .stderr(err)
            .spawn()
            .map_err(|error| Failure::new(&format!("cargo: {error}"), "is it in PATH?"))?;
        let (from, mut looks) = (Instant::now(), 1u32);
        let status = loop {
            if let Ok(Some(status)) = child.try_wait() {
                break Some(status);
            }
            // One that failed is enough: others may hang.
            if from.elapsed() > patience
                || looks.is_multiple_of(LOOKS_PER_READING) && has_failed(&log)
            {
                end(&mut child);
                break None;
            }
            looks += 1;
            std::thread::sleep(LOOKED);
        };
        let said = std::fs::read(&log).unwrap_or_default();
        let said = String::from_utf8_lossy(&said);
        Ok(match status {
            Some(status) if status.success() => Ended {
                passed: true,
                by: String::new(),
            },
            Some(_) => Ended {
                passed: false,
                by: failed(&said),
            },
            None => Ended {
                passed: false,
                by: failed_so_far(&said).unwrap_or_else(|| "a test that does not end".to_owned()),
            },
        })
    }
}

/// Removes from a copy what has been renamed or deleted since it was made, but for what was built there.
fn forget(folder: &Path, there: &BTreeSet<PathBuf>) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            if entry.file_name() != "target" {
                forget(&path, there);
            }
        } else if !there.contains(&path) && entry.file_name() != "Cargo.lock" {
            let _ = std::fs::remove_file(&path);
        }
    }
}

/// How tests ended.
pub struct Ended {
    pub passed: bool,
    /// The first that failed.
    pub by: String,
}

/// The first test that failed, of what the harness says.
fn failed(said: &str) -> String {
    let named = said.lines().find_map(|line| {
        let name = line.strip_prefix("---- ")?.strip_suffix(" stdout ----")?;
        Some(name.to_owned())
    });
    named.unwrap_or_else(|| "the test program, which ended".to_owned())
}

/// The first test that failed, while others still run: their names follow at the end alone.
fn failed_so_far(said: &str) -> Option<String> {
    let named = said
        .lines()
        .find_map(|line| line.strip_suffix(" --- FAILED"))?;
    // Behind the dots of those that have passed.
    Some(named.trim_start_matches('.').to_owned())
}

fn has_failed(log: &Path) -> bool {
    let said = std::fs::read(log).unwrap_or_default();
    failed_so_far(&String::from_utf8_lossy(&said)).is_some()
}

/// A group of its own, so that what it starts ends with it.
fn apart(command: &mut Command) {
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(command, 0);
    let _ = command;
}

/// Ends a child and what it started.
fn end(child: &mut Child) {
    if cfg!(unix) {
        let group = format!("-{}", child.id());
        let _ = Command::new("kill").args(["-KILL", "--", &group]).status();
    }
    let _ = child.kill();
    let _ = child.wait();
}

#[cfg(test)]
mod tests {
    use super::{failed, failed_so_far, forget, of_the_image};

    #[test]
    fn what_meets_the_image_is_there_and_the_motors_stop_is_among_it() {
        let tests = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../hil-tests/tests");
        let programs = of_the_image("firmware");
        assert!(programs.contains(&"stop"));
        for program in programs {
            assert!(tests.join(format!("{program}.rs")).exists(), "{program}");
        }
    }

    #[test]
    fn what_was_renamed_is_gone_from_the_copy_and_what_was_built_stays() {
        let root = std::env::temp_dir().join(format!("mutants-{}", std::process::id()));
        for name in ["a/new.rs", "a/old.rs", "target/built"] {
            let path = root.join(name);
            std::fs::create_dir_all(path.parent().expect("a folder")).expect("room");
            std::fs::write(path, "").expect("room");
        }
        forget(&root, &[root.join("a/new.rs")].into());
        let is_there = |name: &str| root.join(name).exists();
        let left = (
            is_there("a/new.rs"),
            is_there("a/old.rs"),
            is_there("target/built"),
        );
        std::fs::remove_dir_all(&root).expect("it is ours");
        assert_eq!(left, (true, false, true));
    }

    #[test]
    fn the_first_test_that_failed_is_named() {
        let said = "running 2 tests\n\nfailures:\n\n---- motor::tests::it_stops stdout ----\npanicked\n---- b stdout ----\n";
        assert_eq!(failed(said), "motor::tests::it_stops");
        assert_eq!(failed("signal: 11"), "the test program, which ended");
        let said = "running 3 tests\n.. 2/3\n.motor::tests::it_stops --- FAILED\n";
        assert_eq!(
            failed_so_far(said).as_deref(),
            Some("motor::tests::it_stops")
        );
        assert_eq!(failed_so_far("running 3 tests\n..."), None);
    }
}
