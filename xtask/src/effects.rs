//! docs/effects.md and its figures, made of the effects' own files.

use std::path::Path;

use crate::cargo;
use crate::step::{Failure, run};

/// Writes them; with `--check` among `arguments` it writes nothing and fails when one is old.
///
/// # Errors
/// When it does not build, an example does not show, or a file is old or cannot be written.
pub fn page(root: &Path, arguments: &[String]) -> Result<(), Failure> {
    let make = "run --quiet -p imu-stand --example effects --";
    let mut program = cargo(root, &make.split(' ').collect::<Vec<_>>());
    program.args(arguments);
    run("docs/effects.md", &mut program)
}
