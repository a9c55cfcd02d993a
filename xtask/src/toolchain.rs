//! Finds what builds the image: a rustc that comes with the standard library's source, and avr-gcc; installs what is
//! missing where it can, and says what to do where it can't.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::step::{Failure, Pace, Silent, watched};

/// The toolchain that the image is built with. Its size and its warnings are those of this one, so it is pinned.
pub const NIGHTLY: &str = "nightly-2026-10-29";

/// A rustc with its library's source, and the cargo that goes with it.
#[derive(Debug)]
pub struct Toolchain {
    /// Absolute path.
    pub rustc: PathBuf,
    /// `cargo`: from `AVR_CARGO`, the one beside the pinned rustc, or the one in PATH.
    pub cargo: PathBuf,
    /// Whether it is [`NIGHTLY`]: of others the size and the warnings are their own.
    pub is_pinned: bool,
}

/// What Debian and Ubuntu call the parts. `rustc-web` is Debian's recent rustc, for where rustup cannot be had.
const AVR_PACKAGES: &[&str] = &["gcc-avr", "avr-libc", "binutils-avr"];
const RUST_PACKAGES: &[&str] = &["rustc-web", "rust-web-src"];

/// Finds the toolchain, installing what is missing: `AVR_RUSTC`; else the pinned one, which rustup installs beside what is
/// there; else, where rustup cannot, any rustc that has its source, or Debian's.
///
/// # Errors
/// What is missing and the ways to get it.
pub fn find() -> Result<Toolchain, Failure> {
    if !has("avr-gcc") {
        install("the AVR linker", AVR_PACKAGES)?;
    }
    if let Some(rustc) = std::env::var_os("AVR_RUSTC").map(PathBuf::from) {
        return named(rustc);
    }
    if let Some(found) = pinned().or_else(install_pinned).or_else(any) {
        return Ok(found);
    }
    install("rustc with its library's source", RUST_PACKAGES)?;
    any().ok_or_else(|| {
        Failure::new(
            "no rustc with the source of its standard library was found",
            &format!(
                "either `rustup toolchain install {NIGHTLY} --profile minimal --component rust-src`, or on Debian \
                 `apt-get install rustc-web rust-web-src`; or name one by AVR_RUSTC"
            ),
        )
    })
}

/// The one that the user names.
fn named(rustc: PathBuf) -> Result<Toolchain, Failure> {
    if !has_source(&rustc) {
        return Err(Failure::new(
            &format!(
                "AVR_RUSTC: {} is no rustc with the source of its standard library",
                rustc.display()
            ),
            "name another, add its source (`rustup component add rust-src`), or unset AVR_RUSTC",
        ));
    }
    Ok(Toolchain {
        rustc,
        cargo: cargo(),
        is_pinned: false,
    })
}

/// The cargo that the user names, or that is in PATH.
fn cargo() -> PathBuf {
    std::env::var_os("AVR_CARGO").map_or_else(|| PathBuf::from("cargo"), PathBuf::from)
}

/// The pinned toolchain, where rustup has it.
fn pinned() -> Option<Toolchain> {
    let output = Command::new("rustup")
        .args(["which", "rustc", "--toolchain", NIGHTLY])
        // Asking must not install anything: what is installed has to have the library's source.
        .env("RUSTUP_AUTO_INSTALL", "0")
        .output()
        .ok()?;
    let rustc = PathBuf::from(String::from_utf8_lossy(&output.stdout).trim());
    if !(output.status.success() && has_source(&rustc)) {
        return None;
    }
    let beside = rustc.with_file_name("cargo");
    let is_named = std::env::var_os("AVR_CARGO").is_some();
    let cargo = if beside.exists() && !is_named {
        beside
    } else {
        cargo()
    };
    Some(Toolchain {
        rustc,
        cargo,
        is_pinned: true,
    })
}

/// Has rustup install the pinned toolchain. It goes beside those that are there: none is upgraded, the default stays.
fn install_pinned() -> Option<Toolchain> {
    if !has("rustup") {
        return None;
    }
    println!(
        "installing Rust {NIGHTLY} for the image, beside the toolchains that are there (rustup)"
    );
    let mut rustup = Command::new("rustup");
    rustup
        .args(["toolchain", "install", NIGHTLY])
        .args(["--profile", "minimal", "--component", "rust-src"])
        .args(["--no-self-update"]);
    let mut meter = Silent("downloading and unpacking");
    let mut pace = Pace::Rarer(0);
    match watched("rustup", &mut rustup, &mut meter, &mut pace) {
        Ok(_) => pinned(),
        Err(failure) => {
            eprintln!("{failure}");
            None
        }
    }
}

/// Any rustc that has the source of its library: the one in PATH, then Debian's.
fn any() -> Option<Toolchain> {
    let candidates = [which("rustc"), Some(PathBuf::from("/usr/bin/rustc"))];
    let rustc = candidates.into_iter().flatten().find(|r| has_source(r))?;
    Some(Toolchain {
        rustc,
        cargo: cargo(),
        is_pinned: false,
    })
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
        let mut meter = Silent("installing packages");
        watched("apt-get", &mut command, &mut meter, &mut Pace::Rarer(0)).map(drop)
    };
    apt(&["update"]).map_err(|_| by_hand())?;
    let mut arguments = vec!["install", "-y", "--no-install-recommends"];
    arguments.extend(packages);
    apt(&arguments).map_err(|_| by_hand())
}
