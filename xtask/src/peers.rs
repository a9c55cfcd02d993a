//! `cargo xtask compare-peers`: speed, memory and agreement against allantools (in a venv of its own) and the Rust crate
//! `allan`, on the same readings in the same run.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::step::{Failure, run};

const SCRIPT: &str = include_str!("peers.py");
/// The version compared with; a change of it is a change of the table.
const ALLANTOOLS: &str = "allantools==2024.6";

/// Deviation, readings. allantools needs time with the square of the readings for `mtotdev` and `theo1`.
const ROWS: &[(&str, usize)] = &[
    ("oadev", 1_000_000),
    ("mdev", 1_000_000),
    ("ohdev", 1_000_000),
    ("totdev", 1_000_000),
    ("theo1", 5_000),
    ("mtotdev", 2_000),
    ("mtotdev", 5_000),
    ("oadev", 10_000_000),
];
/// Only with `--long`: allantools takes 3 GiB of memory.
const LONG: (&str, usize) = ("oadev", 100_000_000);

/// What one side printed.
#[derive(Debug, Default)]
struct Outcome {
    seconds: f64,
    crate_seconds: f64,
    peak_mib: f64,
    /// What a plain pass over the readings for each octave takes.
    pass_seconds: Option<f64>,
    deviations: Vec<(usize, f64)>,
    crate_deviations: Vec<(usize, f64)>,
}

impl Outcome {
    fn of(what: &str, command: &mut Command) -> Result<Self, Failure> {
        let output = command.output().map_err(|error| {
            Failure::new(
                &format!("{what} cannot be started: {error}"),
                "is it in PATH?",
            )
        })?;
        if !output.status.success() {
            return Err(Failure::new(
                &format!("{what}: {}", String::from_utf8_lossy(&output.stderr).trim()),
                "its own message stands above",
            ));
        }
        let mut out = Self::default();
        for line in String::from_utf8_lossy(&output.stdout).lines() {
            let words: Vec<&str> = line.split_whitespace().collect();
            let bad = || {
                Failure::new(
                    &format!("{what} printed `{line}`"),
                    "this is a defect: report it",
                )
            };
            let number = |i: usize| -> Result<f64, Failure> {
                words.get(i).and_then(|w| w.parse().ok()).ok_or_else(bad)
            };
            match words.first().copied() {
                Some("seconds") => out.seconds = number(1)?,
                Some("pass_seconds") => out.pass_seconds = Some(number(1)?),
                Some("crate_seconds") => out.crate_seconds = number(1)?,
                Some("peak_kib") => out.peak_mib = number(1)? / 1024.0,
                Some("dev") => out.deviations.push((number(1)? as usize, number(2)?)),
                Some("crate_dev") => out.crate_deviations.push((number(1)? as usize, number(2)?)),
                _ => return Err(bad()),
            }
        }
        Ok(out)
    }
}

/// Largest relative difference over the cluster times that both have, and their number.
fn disagreement(a: &[(usize, f64)], b: &[(usize, f64)]) -> (f64, usize) {
    let mut largest = 0.0f64;
    let mut common = 0;
    for (m, ours) in a {
        if let Some((_, theirs)) = b.iter().find(|(other, _)| other == m) {
            largest = largest.max((ours / theirs - 1.0).abs());
            common += 1;
        }
    }
    (largest, common)
}

/// Prints the table.
///
/// # Errors
/// Where Python, its package or the build are missing; where two implementations disagree by more than 1e-6.
pub fn compare(root: &Path, long: bool) -> Result<(), Failure> {
    let folder = root.join("target/peers");
    std::fs::create_dir_all(&folder).map_err(io)?;
    let peers = Peers {
        python: allantools(&folder)?,
        script: folder.join("peers.py"),
        ours: root.join("target/release/examples/peers"),
        folder,
    };
    std::fs::write(&peers.script, SCRIPT).map_err(io)?;
    run(
        "the build",
        Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
            .current_dir(root)
            .args([
                "build",
                "--release",
                "--quiet",
                "-p",
                "noise",
                "--example",
                "peers",
                "--target-dir",
                "target",
            ]),
    )?;
    let worst = peers
        .against_allantools(long)?
        .max(peers.against_the_crate()?);
    if worst > 1e-6 {
        return Err(Failure::new(
            &format!("two implementations differ by {worst:.1e}"),
            "compare the definitions row by row before believing either",
        ));
    }
    Ok(())
}

fn io(error: std::io::Error) -> Failure {
    Failure::new(
        &format!("target/peers: {error}"),
        "make room or rights for it",
    )
}

/// The Python that has allantools, made where there is none.
fn allantools(folder: &Path) -> Result<PathBuf, Failure> {
    let python = folder.join("venv/bin/python");
    let has_it = Command::new(&python)
        .args(["-c", "import allantools"])
        .output()
        .is_ok_and(|o| o.status.success());
    if !has_it {
        run(
            "a virtual environment (Debian: apt-get install python3-venv)",
            Command::new("python3")
                .args(["-m", "venv"])
                .arg(folder.join("venv")),
        )?;
        run(
            "pip",
            Command::new(&python).args([
                "-m", "pip", "install", "--quiet", ALLANTOOLS, "numpy", "scipy",
            ]),
        )?;
    }
    Ok(python)
}

/// The programs that are compared, and where their readings are.
struct Peers {
    folder: PathBuf,
    python: PathBuf,
    script: PathBuf,
    ours: PathBuf,
}

impl Peers {
    /// Prints the table against allantools, and that of the passes; returns the largest difference.
    fn against_allantools(&self, long: bool) -> Result<f64, Failure> {
        println!(
            "one process each; `input` is 8 B a reading; agreement is the largest relative difference of a deviation\n\n\
         | deviation, octaves | readings | allantools | imu-stand | times faster | peak memory, allantools | imu-stand \
         (input) | agreement |\n|---|---|---|---|---|---|---|---|"
        );
        let mut worst = 0.0f64;
        let mut passes = Vec::new();
        for (kind, samples) in ROWS.iter().chain(long.then_some(&LONG)) {
            let file = self.folder.join(format!("{samples}.f64"));
            if !file.exists() {
                run(
                    "writing the readings",
                    Command::new(&self.ours)
                        .arg("write")
                        .arg(&file)
                        .arg(samples.to_string()),
                )?;
            }
            let theirs = Outcome::of(
                "allantools",
                Command::new(&self.python)
                    .arg(&self.script)
                    .arg(kind)
                    .arg(&file),
            )?;
            let own = Outcome::of(
                "imu-stand",
                Command::new(&self.ours).args(["run", kind]).arg(&file),
            )?;
            let (difference, common) = disagreement(&own.deviations, &theirs.deviations);
            worst = worst.max(difference);
            if let Some(pass) = own.pass_seconds {
                passes.push((*samples, own.seconds, pass));
            }
            println!(
                "| {kind} | {samples:.0e} | {:.4} s | {:.6} s | {:.1} | {:.0} MiB | {:.0} MiB ({:.0}) | {difference:.1e} over \
             {common} |",
                theirs.seconds,
                own.seconds,
                theirs.seconds / own.seconds,
                theirs.peak_mib,
                own.peak_mib,
                *samples as f64 * 8.0 / 1_048_576.0,
                samples = *samples as f64,
            );
        }
        tell_passes(&passes);
        Ok(worst)
    }

    /// Prints the table against the crate; returns the largest difference that its definition does not explain.
    fn against_the_crate(&self) -> Result<f64, Failure> {
        let mut worst = 0.0f64;
        println!(
            "\n| overlapping Allan, 1-2-4 decades | readings | crate allan | imu-stand | times faster | agreement |\n\
         |---|---|---|---|---|---|"
        );
        for samples in [1_000_000usize, 10_000_000] {
            let file = self.folder.join(format!("{samples}.f64"));
            let both = Outcome::of("peers", Command::new(&self.ours).arg("crate").arg(&file))?;
            let (difference, common) = disagreement(&both.deviations, &both.crate_deviations);
            // The crate leaves out the phase after the last reading: one difference fewer, a change of the order of 1/n.
            if difference > 10.0 / samples as f64 {
                worst = worst.max(difference);
            }
            println!(
                "| to 1e5 | {:.0e} | {:.4} s | {:.4} s | {:.1} | {difference:.1e} over {common} |",
                samples as f64,
                both.crate_seconds,
                both.seconds,
                both.crate_seconds / both.seconds
            );
        }
        Ok(worst)
    }
}

/// Prints how this program compares with one plain pass for each octave: readings, its seconds, those of the pass.
fn tell_passes(passes: &[(usize, f64, f64)]) {
    println!(
        "\n| oadev, octaves | this program, integration included | one plain pass over the readings for each octave | ratio |\n\
         |---|---|---|---|"
    );
    for (samples, seconds, pass) in passes {
        println!(
            "| {:.0e} | {seconds:.4} s | {pass:.4} s | {:.2} |",
            *samples as f64,
            seconds / pass
        );
    }
}
