//! The campaign: measures what the diagnosis can tell and writes docs/power.md.

use std::path::Path;
use std::process::Command;

use crate::cargo;
use crate::step::{Failure, run};

/// Where the page goes.
const PAGE: &str = "docs/power.md";
/// Where runs are noted as they end, so that the same seed takes up a campaign that was cut off.
const LOGS: &str = "target/campaign";

/// Builds the campaign in the dev profile, which compiles the crates of the engine at the level of a release, and runs
/// it with `arguments`. Without `--only` its page goes to docs/power.md, in any case its runs to target/campaign.
///
/// # Errors
/// When it does not build or run.
pub fn measure(root: &Path, arguments: &[String]) -> Result<(), Failure> {
    let mut program = cargo(root, &["run", "--quiet", "-p", "campaign", "--"]);
    program.args(arguments);
    let told = |option: &str| {
        arguments
            .iter()
            .any(|a| a == option || a.starts_with(&format!("{option}=")))
    };
    if !(told("--only") || told("--out") || told("--help")) {
        program.args(["--out", PAGE]);
    }
    if !(told("--log") || told("--from") || told("--run") || told("--help")) {
        program.args(["--log", LOGS]);
    }
    if let Some(date) = today().filter(|_| !told("--date")) {
        program.args(["--date", &date]);
    }
    run("the campaign", &mut program)
}

/// The date, where the system has the program that tells it.
fn today() -> Option<String> {
    let told = Command::new("date").arg("+%Y-%m-%d").output().ok()?;
    let text = String::from_utf8(told.stdout).ok()?;
    told.status.success().then(|| text.trim().to_owned())
}
