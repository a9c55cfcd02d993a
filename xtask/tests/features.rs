//! The engine is compiled once: whatever part of the workspace is built, what stands below `diagnosis` has the same features.
//! `crates/workspace-hack` asks for them; where this test fails, it says what is missing there.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

/// Packages with their features, a line each, as `cargo tree` resolves them for a build.
fn resolved(of: &[&str], edges: &str) -> BTreeSet<String> {
    let output = Command::new(env!("CARGO"))
        .current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join(".."))
        .args(["tree", "--locked", "--prefix", "none", "--no-dedupe"])
        .args(["--format", "{p} [{f}]", "--edges", edges])
        .args(of)
        .output()
        .expect("cargo tree");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    let text = String::from_utf8(output.stdout).expect("names");
    text.lines()
        .map(|line| line.replace(" (*)", ""))
        .filter(|line| !line.is_empty())
        .collect()
}

/// Name and version of a line.
fn package(line: &str) -> &str {
    line.split(" [").next().unwrap_or(line)
}

#[test]
fn what_the_engine_stands_on_has_the_same_features_in_every_build() {
    // What a macro or a build script is made of has features of its own: a library that is there for both has two lines, and only
    // that of the programs counts for the engine.
    let whole = resolved(&["--workspace"], "normal,build,dev");
    let of_programs = resolved(&["--workspace"], "normal,dev");
    let engine = resolved(&["--package", "diagnosis"], "normal,build");
    let below: BTreeSet<&str> = engine.iter().map(|line| package(line)).collect();
    let rustfft = below.iter().any(|name| name.starts_with("rustfft "));
    assert!(rustfft, "no engine: {below:?}");
    for part in ["diagnosis", "imu-stand", "imu-stand-python"] {
        for (edges, whole) in [("normal,build", &whole), ("normal", &of_programs)] {
            let own = resolved(&["--package", part], edges);
            let other: Vec<&String> = own
                .difference(whole)
                .filter(|line| below.contains(package(line)))
                .collect();
            assert!(
                other.is_empty(),
                "a build of {part} alone compiles the engine again: {other:?}"
            );
        }
    }
}
