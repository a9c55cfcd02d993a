//! `imu-stand completions` and `imu-stand man`: what a shell and `man` want to know of the program, made of its options.

use std::path::PathBuf;

use clap::{Args, Command};
use miette::Result;

use super::outputs;

/// The program's name to a shell.
const NAME: &str = "imu-stand";

/// What `completions` takes.
#[derive(Args)]
pub struct Completions {
    /// For which shell
    #[arg(value_enum)]
    shell: clap_complete::Shell,
}

/// What `man` takes.
#[derive(Args)]
pub struct Man {
    /// Folder for the pages
    #[arg(long, value_name = "FOLDER", default_value = "man")]
    out: PathBuf,
}

/// Prints the completions.
pub fn completions(arguments: &Completions, mut program: Command) -> Result<()> {
    let mut text = Vec::new();
    clap_complete::generate(arguments.shell, &mut program, NAME, &mut text);
    outputs::to_stdout(|out| out.write_all(&text))
}

/// Writes the pages.
pub fn man(arguments: &Man, program: Command) -> Result<()> {
    let folder = &arguments.out;
    std::fs::create_dir_all(folder).map_err(|error| outputs::failed(folder, &error))?;
    clap_mangen::generate_to(program, folder).map_err(|error| outputs::failed(folder, &error))?;
    say!(
        "{}: written; `man -l {}/{NAME}.1` shows it",
        folder.display(),
        folder.display()
    );
    Ok(())
}
