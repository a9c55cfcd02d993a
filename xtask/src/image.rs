//! Builds the image and holds it to its budgets.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::step::{Failure, run};
use crate::toolchain;

/// Where the image's build keeps its files.
fn target(root: &Path) -> PathBuf {
    root.join("target/avr")
}

/// A cargo that compiles for the ATmega16.
fn cargo(root: &Path, arguments: &[&str]) -> Result<Command, Failure> {
    let toolchain = toolchain::find()?;
    let mut command = Command::new(&toolchain.cargo);
    command
        .current_dir(root)
        .args(arguments)
        .env("CARGO_TARGET_DIR", target(root))
        .env("RUSTC", &toolchain.rustc);
    // -Zbuild-std on a rustc that is not a nightly.
    command.env("RUSTC_BOOTSTRAP", "1");
    // What an outer cargo or a CI sets for the host would replace the flags of the target.
    for variable in [
        "RUSTFLAGS",
        "CARGO_ENCODED_RUSTFLAGS",
        "CARGO_BUILD_TARGET",
        "RUSTUP_TOOLCHAIN",
        "RUSTC_WRAPPER",
    ] {
        command.env_remove(variable);
    }
    Ok(command)
}

/// Builds the firmware for the ATmega16; returns the ELF. memory.x makes the link fail where it does not fit.
///
/// # Errors
/// Toolchain or build.
pub fn build(root: &Path) -> Result<PathBuf, Failure> {
    run("the build of the image", &mut cargo(root, &["fw"])?)?;
    let elf = target(root).join("avr-none/firmware/firmware.elf");
    let hex = elf.with_extension("hex");
    let mut objcopy = Command::new("avr-objcopy");
    objcopy
        .args(["-O", "ihex", "-R", ".eeprom", "-R", ".noinit"])
        .arg(&elf)
        .arg(&hex);
    run("avr-objcopy", &mut objcopy)?;
    Ok(elf)
}

/// Sizes of an image, bytes.
#[derive(Debug)]
pub struct Sizes {
    /// Flash: code, constants and the start values of RAM.
    pub flash: u32,
    /// Static RAM.
    pub sram: u32,
}

/// Reads them off by avr-size.
///
/// # Errors
/// When avr-size does not answer as expected.
pub fn sizes(elf: &Path) -> Result<Sizes, Failure> {
    let bad = || {
        Failure::new(
            "avr-size does not say the sizes of the image",
            "is binutils-avr installed?",
        )
    };
    let output = Command::new("avr-size")
        .arg("-A")
        .arg(elf)
        .output()
        .map_err(|_| bad())?;
    let text = String::from_utf8_lossy(&output.stdout);
    let section = |name: &str| {
        text.lines().find_map(|line| {
            let mut words = line.split_whitespace();
            (words.next() == Some(name)).then(|| words.next()?.parse::<u32>().ok())?
        })
    };
    let (code, data, zero) = (section(".text"), section(".data"), section(".bss"));
    let code = code.ok_or_else(bad)?;
    let data = data.unwrap_or(0);
    Ok(Sizes {
        flash: code + data,
        sram: data + zero.unwrap_or(0) + section(".noinit").unwrap_or(0),
    })
}
