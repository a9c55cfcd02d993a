//! Frozen answers: what the engine says of some 400 records, written and compared.

use std::path::Path;

use crate::cargo;
use crate::step::{Failure, run};

/// Where the answers go where no folder is named.
const FOLDER: &str = "target/answers";

/// Builds and runs the crate `answers` in the dev profile, which compiles the engine at the level of a release.
///
/// # Errors
/// When it does not build, or when something moved.
pub fn freeze(root: &Path, arguments: &[String]) -> Result<(), Failure> {
    let mut program = cargo(root, &["run", "--quiet", "-p", "answers", "--"]);
    program.args(arguments);
    // `--write` and `--compare` alone.
    if arguments
        .last()
        .is_some_and(|a| a == "--write" || a == "--compare")
    {
        program.arg(FOLDER);
    }
    run("the answers", &mut program)
}
