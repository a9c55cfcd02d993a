//! What the program is made of: licences, sources and duplicates of its dependencies, the oldest Rust that compiles it, and a
//! list of its parts.

use std::path::Path;
use std::process::Command;

use crate::cargo;
use crate::step::{Failure, run};
use crate::toolchain::has;

const HELP: &str = "--advisories asks the advisory database as well, for which it has to be reachable; nothing else";

/// Checks them, and writes target/sbom/imu-stand.cdx.json.
///
/// # Errors
/// What is not allowed by deny.toml, does not compile, or is not installed.
pub fn supply(root: &Path, arguments: &[String]) -> Result<(), Failure> {
    let advisories = match arguments {
        [] => false,
        [one] if one == "--advisories" => true,
        _ => {
            return Err(Failure::new(
                "`cargo xtask supply` takes --advisories or nothing",
                HELP,
            ));
        }
    };
    installed("cargo-deny")?;
    println!("== licenses, bans, sources");
    run(
        "cargo deny",
        deny(root).args(["licenses", "bans", "sources"]),
    )?;
    let oldest = oldest(root)?;
    println!("== Rust {oldest}");
    compiles_with(root, &oldest)?;
    installed("cargo-cyclonedx")?;
    println!("== parts");
    parts(root)?;
    if advisories {
        println!("== advisories");
        return asked(root);
    }
    println!("advisories: not asked for (--advisories)");
    Ok(())
}

/// The whole workspace: at the root cargo-deny would look at the firmware alone.
fn deny(root: &Path) -> Command {
    cargo(root, &["deny", "--workspace", "--locked", "check"])
}

/// Asks the database of advisories. One that cannot be had, and one that knows of something, both fail; what cargo-deny says tells
/// which.
fn asked(root: &Path) -> Result<(), Failure> {
    run("cargo deny check advisories", deny(root).arg("advisories")).map_err(|_| {
        Failure::new(
            "the advisories are not known to be clear",
            "either one of them is about a dependency, or their database could not be fetched: its own message above says which; \
             all that came before them passed",
        )
    })
}

fn installed(name: &str) -> Result<(), Failure> {
    if has(name) {
        return Ok(());
    }
    Err(Failure::new(
        &format!("{name} is not installed"),
        &format!("`cargo install --locked {name}`"),
    ))
}

/// `rust-version` of the workspace.
fn oldest(root: &Path) -> Result<String, Failure> {
    let manifest = std::fs::read_to_string(root.join("Cargo.toml")).unwrap_or_default();
    let line = manifest
        .lines()
        .find_map(|line| line.strip_prefix("rust-version = "));
    let version = line.map(|version| version.trim_matches('"').to_owned());
    version.ok_or_else(|| {
        Failure::new(
            "Cargo.toml states no rust-version",
            "state it under [workspace.package]",
        )
    })
}

/// Checks the program and its libraries with the oldest Rust that is promised, which rustup installs where it is missing.
fn compiles_with(root: &Path, version: &str) -> Result<(), Failure> {
    let mut install = Command::new("rustup");
    install.args(["toolchain", "install", version, "--profile", "minimal"]);
    install.args(["--no-self-update"]);
    run("rustup", &mut install)?;
    let mut check = Command::new("rustup");
    check.current_dir(root);
    check.args([
        "run",
        version,
        "cargo",
        "check",
        "--locked",
        "--bin",
        "imu-stand",
    ]);
    // Beside the other build, whose files are of another compiler.
    check.args(["--quiet", "--target-dir", "target/oldest"]);
    run(&format!("cargo check with Rust {version}"), &mut check)
}

/// How the lists are called.
const NAME: &str = "imu-stand.cdx.json";

/// Removes the lists of the other members, so many folders deep.
fn remove_others(folder: &Path, deep: usize) {
    let _ = std::fs::remove_file(folder.join(NAME));
    let within = std::fs::read_dir(folder).into_iter().flatten().flatten();
    for entry in within.filter(|entry| entry.file_name() != "target") {
        if deep > 0 && entry.path().is_dir() {
            remove_others(&entry.path(), deep - 1);
        }
    }
}

/// Writes the list of parts of the program.
fn parts(root: &Path) -> Result<(), Failure> {
    let name = NAME.trim_end_matches(".json");
    let mut list = cargo(
        root,
        &["cyclonedx", "--manifest-path", "crates/cli/Cargo.toml"],
    );
    list.args(["--quiet", "--format", "json", "--override-filename", name]);
    run("cargo cyclonedx", &mut list)?;
    // It writes one for each member of the workspace; the program's is the one that is asked for.
    let out = root.join("target/sbom");
    let to = out.join(NAME);
    let kept = std::fs::create_dir_all(&out)
        .and_then(|()| std::fs::rename(root.join("crates/cli").join(NAME), &to));
    remove_others(root, 3);
    kept.map_err(|error| Failure::new(&format!("{}: {error}", to.display()), "is the disk full?"))?;
    let text = std::fs::read_to_string(&to).unwrap_or_default();
    println!(
        "target/sbom/{NAME}: {} parts",
        text.matches("\"purl\"").count()
    );
    Ok(())
}
