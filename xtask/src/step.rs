//! Running programs and saying what failed.

use std::process::Command;

/// What failed, and what to do.
#[derive(Debug)]
pub struct Failure {
    what: String,
    help: String,
}

impl Failure {
    /// A failure with the way out of it.
    pub fn new(what: &str, help: &str) -> Self {
        Self {
            what: what.to_owned(),
            help: help.to_owned(),
        }
    }
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        writeln!(f, "error: {}", self.what)?;
        write!(f, "help:  {}", self.help)
    }
}

/// Runs a command to its end.
///
/// # Errors
/// When it cannot be started or does not succeed.
pub fn run(what: &str, command: &mut Command) -> Result<(), Failure> {
    let status = command.status().map_err(|error| {
        Failure::new(
            &format!("{what} cannot be started: {error}"),
            "is it installed and in PATH?",
        )
    })?;
    if status.success() {
        return Ok(());
    }
    Err(Failure::new(
        &format!("{what} failed ({status})"),
        "its own message stands above",
    ))
}
