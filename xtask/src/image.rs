//! Builds the image and holds it to its budgets.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::step::{Crates, Failure, Pace, Said, run, watched};
use crate::toolchain::{self, Toolchain};

/// Where the image's build keeps its files.
fn target(root: &Path) -> PathBuf {
    root.join("target/avr")
}

/// The cargo of a toolchain, compiling for the ATmega16.
fn cargo(toolchain: &Toolchain, root: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(&toolchain.cargo);
    command
        .current_dir(root)
        .args(arguments)
        .env("CARGO_TARGET_DIR", target(root))
        .env("RUSTC", &toolchain.rustc);
    // -Zbuild-std on a rustc that is not a nightly.
    command.env("RUSTC_BOOTSTRAP", "1");
    // rustc hands -no-pie to every GNU linker, and warns where it has to link again without: the avr-gcc of Debian 12
    // (5.4) does not know it, and the target knows no linker of another flavour.
    command.env("RUSTC_LOG", "warn,rustc_codegen_ssa::back::link=error");
    // What an outer cargo or a CI sets for the host would replace the flags and the profile of the target.
    for variable in [
        "RUSTFLAGS",
        "CARGO_ENCODED_RUSTFLAGS",
        "CARGO_BUILD_TARGET",
        "RUSTUP_TOOLCHAIN",
        "RUSTC_WRAPPER",
        // Compiled in pieces the image is 160 B larger.
        "CARGO_INCREMENTAL",
    ] {
        command.env_remove(variable);
    }
    command
}

/// An image that was built.
#[derive(Debug)]
pub struct Built {
    /// The ELF file; the hex file lies beside it.
    pub elf: PathBuf,
    /// What the compiler complained of: warnings, and anything that LLVM prints of its own accord.
    pub complaints: Vec<String>,
    /// Whether it is of the pinned toolchain.
    pub is_pinned: bool,
}

/// Builds the firmware for the ATmega16. memory.x makes the link fail where it does not fit.
///
/// # Errors
/// Toolchain or build.
pub fn build(root: &Path, pace: &mut Pace) -> Result<Built, Failure> {
    let toolchain = toolchain::find()?;
    let mut fw = cargo(&toolchain, root, &["fw"]);
    let what = "the build of the image";
    let said = watched(what, &mut fw, &mut Crates::default(), pace)?;
    let elf = target(root).join("avr-none/firmware/firmware.elf");
    let hex = elf.with_extension("hex");
    let mut objcopy = Command::new("avr-objcopy");
    objcopy
        .args(["-O", "ihex", "-R", ".eeprom", "-R", ".noinit"])
        .arg(&elf)
        .arg(&hex);
    run("avr-objcopy", &mut objcopy)?;
    let complaints = complaints(&said);
    Ok(Built {
        elf,
        complaints,
        is_pinned: toolchain.is_pinned,
    })
}

/// Lines of a build that neither say what is compiled nor that it is done, and what belongs to them.
fn complaints(said: &Said) -> Vec<String> {
    const PROGRESS: &[&str] = &[
        "Compiling",
        "Finished",
        "Downloading",
        "Downloaded",
        "Updating",
        "Blocking",
        "Locking",
        "Adding",
        "Fresh",
    ];
    let is_progress = |line: &&String| {
        let first = line.split_whitespace().next();
        first.is_none_or(|word| PROGRESS.contains(&word))
    };
    said.all
        .iter()
        .filter(|l| !is_progress(l))
        .cloned()
        .collect()
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_compiler_complains_of_is_told_from_what_it_does() {
        let lines = [
            "   Compiling core v0.0.0 (/x)",
            "warning: suspicious definition of the runtime `memcpy` symbol",
            " WARN rustc_codegen_ssa::back::link Linker does not support -no-pie",
            "BISECT: running pass (1) verify on f",
            "    Finished `firmware` profile [optimized + debuginfo] target(s) in 1.00s",
        ];
        let all = lines.map(str::to_owned).to_vec();
        let said = Said { all, out: vec![] };
        assert_eq!(complaints(&said), lines[1..4]);
    }
}
