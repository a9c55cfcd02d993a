//! Finds what builds the image: a rustc that comes with the standard library's source, and avr-gcc; installs what is
//! missing where it can, and says what to do where it can't.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::step::{Failure, run};

/// A rustc with its library's source, and the cargo that goes with it.
#[derive(Debug)]
pub struct Toolchain {
    /// Absolute path.
    pub rustc: PathBuf,
    /// `cargo`, from `AVR_CARGO` or PATH.
    pub cargo: PathBuf,
}

/// What Debian and Ubuntu call the parts. `rustc-web` is Debian's recent rustc; where it is missing, rustup's nightly
/// with rust-src does.
const AVR_PACKAGES: &[&str] = &["gcc-avr", "avr-libc", "binutils-avr"];
const RUST_PACKAGES: &[&str] = &["rustc-web", "rust-web-src"];

/// Finds the toolchain, installing what is missing.
///
/// # Errors
/// What is missing and the two ways to get it.
pub fn find() -> Result<Toolchain, Failure> {
    if !has("avr-gcc") {
        install("the AVR linker", AVR_PACKAGES)?;
    }
    if let Some(found) = look() {
        return Ok(found);
    }
    // rustup's nightly brings its source; Debian's package is the way where rustup cannot reach it.
    let by_rustup = Command::new("rustup")
        .args([
            "toolchain",
            "install",
            "nightly",
            "--profile",
            "minimal",
            "--component",
            "rust-src",
        ])
        .status()
        .is_ok_and(|status| status.success());
    if !by_rustup {
        install("rustc with its library's source", RUST_PACKAGES)?;
    }
    look().ok_or_else(|| {
        Failure::new(
            "no rustc with the source of its standard library was found",
            "either `rustup toolchain install nightly --component rust-src`, or on Debian \
             `apt-get install rustc-web rust-web-src`; or name one by AVR_RUSTC",
        )
    })
}

fn look() -> Option<Toolchain> {
    let cargo = std::env::var_os("AVR_CARGO").map_or_else(|| PathBuf::from("cargo"), PathBuf::from);
    let named = std::env::var_os("AVR_RUSTC").map(PathBuf::from);
    let by_rustup = || {
        let output = Command::new("rustup")
            .args(["which", "rustc", "--toolchain", "nightly"])
            .output()
            .ok()?;
        output
            .status
            .success()
            .then(|| PathBuf::from(String::from_utf8_lossy(&output.stdout).trim()))
    };
    let candidates = [
        named,
        which("rustc"),
        by_rustup(),
        Some(PathBuf::from("/usr/bin/rustc")),
    ];
    let rustc = candidates
        .into_iter()
        .flatten()
        .find(|rustc| has_source(rustc))?;
    Some(Toolchain { rustc, cargo })
}

fn has_source(rustc: &Path) -> bool {
    // A proxy of rustup must not be told by an outer cargo which toolchain it is.
    let Ok(output) = Command::new(rustc)
        .env_remove("RUSTUP_TOOLCHAIN")
        .args(["--print", "sysroot"])
        .output()
    else {
        return false;
    };
    let sysroot = PathBuf::from(String::from_utf8_lossy(&output.stdout).trim());
    output.status.success()
        && sysroot
            .join("lib/rustlib/src/rust/library/Cargo.lock")
            .exists()
}

/// What the simulated ATmega16 is built with: simavr's sources come with its crate.
const SIMULATOR_PACKAGES: &[&str] = &[
    "gcc",
    "make",
    "pkg-config",
    "libelf-dev",
    "libclang-dev",
    "zlib1g-dev",
    "libzstd-dev",
];

/// Makes sure of what the simulator crate needs, installing what is missing.
///
/// # Errors
/// Where it cannot be installed.
pub fn simulator() -> Result<(), Failure> {
    let says = |program: &str, argument: &[&str]| {
        Command::new(program)
            .args(argument)
            .output()
            .ok()
            .filter(|output| output.status.success())
            .map(|output| String::from_utf8_lossy(&output.stdout).into_owned())
    };
    let has_libelf = says("pkg-config", &["--exists", "libelf", "zlib", "libzstd"]).is_some();
    // LIBCLANG_PATH is how bindgen is told of one elsewhere.
    let has_libclang = std::env::var_os("LIBCLANG_PATH").is_some()
        || says("ldconfig", &["-p"]).is_some_and(|list| list.contains("libclang"))
        || says("/sbin/ldconfig", &["-p"]).is_some_and(|list| list.contains("libclang"));
    if has_libelf && has_libclang && has("make") {
        return Ok(());
    }
    install("what the simulator is built with", SIMULATOR_PACKAGES)
}

fn which(program: &str) -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    std::env::split_paths(&path)
        .map(|folder| folder.join(program))
        .find(|file| file.is_file())
}

/// Whether a program is in PATH.
pub fn has(program: &str) -> bool {
    which(program).is_some()
}

/// Installs packages of Debian or Ubuntu.
///
/// # Errors
/// Where there is no apt, no right, or no such package: says what to do by hand.
pub fn install(what: &str, packages: &[&str]) -> Result<(), Failure> {
    let by_hand = || {
        Failure::new(
            &format!("{what} is missing and could not be installed"),
            &format!(
                "on Debian or Ubuntu: `apt-get install {}`; elsewhere install the same tools",
                packages.join(" ")
            ),
        )
    };
    if !has("apt-get") {
        return Err(by_hand());
    }
    println!("installing {what}: {}", packages.join(" "));
    let is_root = Command::new("id")
        .arg("-u")
        .output()
        .is_ok_and(|output| output.stdout.starts_with(b"0\n"));
    let apt = |arguments: &[&str]| {
        let mut command = if is_root {
            Command::new("apt-get")
        } else {
            let mut sudo = Command::new("sudo");
            sudo.arg("apt-get");
            sudo
        };
        command
            .env("DEBIAN_FRONTEND", "noninteractive")
            .args(["-qq"])
            .args(arguments);
        run("apt-get", &mut command)
    };
    apt(&["update"]).map_err(|_| by_hand())?;
    let mut arguments = vec!["install", "-y", "--no-install-recommends"];
    arguments.extend(packages);
    apt(&arguments).map_err(|_| by_hand())
}
