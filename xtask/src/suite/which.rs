//! Which test programs there are, and which of them are long.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Test programs that wait for a board's clock or a browser more than they compute, the long ones first: a worker of their own runs
/// them, each with four tests at a time.
pub const WAIT: &[&str] = &[
    "imu-stand correct_port",
    "imu-stand live_page",
    "imu-stand soak",
    "imu-stand board",
    "imu-stand capture",
    "imu-stand bring_up",
    "imu-stand resume",
    "imu-stand pty",
    "imu-stand flash",
];

/// Test programs that take long, by target/test-seconds.txt: they are started first, so that none is left for the end, when one core
/// would wait for it, and the everyday check leaves them out.
pub const LONG: &[&str] = &[
    "campaign sample",
    "campaign campaign",
    "imu-stand hidden_effect",
    "hil-tests hidden",
    "diagnosis closed_loop",
    "diagnosis limits",
    "diagnosis claims",
    "imu-stand soak",
    "hil-tests soak",
    "hil-tests rates",
    "hil-tests timing",
    "hil-tests same",
    "hil-tests stack",
    "hil-tests faults",
    "hil-tests flood",
    "diagnosis events",
    "diagnosis spectra",
    "diagnosis white_floor",
    "diagnosis high_pass",
    "diagnosis shaken",
    "diagnosis large_noise",
    "diagnosis counts",
    "diagnosis hum",
    "diagnosis flicker",
    "diagnosis couplings",
    "diagnosis kin",
    "diagnosis audit",
    "diagnosis joint",
    "diagnosis accelerometers",
    "diagnosis entries",
    "diagnosis other_channels",
    "diagnosis pieces",
    "diagnosis levels",
    "diagnosis shocks",
    "diagnosis unnamed",
    "diagnosis diagnosis",
    "noise noise",
    "imu-stand plan",
    "imu-stand tutorial",
    "imu-stand resume",
    "imu-stand bring_up",
    "imu-stand live_page",
    "imu-stand correct",
    "imu-stand correct_port",
    "imu-stand sequences",
    "imu-stand model_out",
    "imu-stand browser",
    "imu-stand many",
    "imu-stand abuse",
    "hil-tests corrected",
    "noise analyze",
    "diagnosis real_records",
    "bench correction",
    "hil-tests c_reference",
];

/// Folders of a folder's, or files.
fn entries(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    entries.map(|entry| entry.path()).collect()
}

/// Folders of the packages.
pub fn packages(root: &Path) -> Vec<PathBuf> {
    let mut folders = vec![root.to_owned(), root.join("hil-tests"), root.join("xtask")];
    folders.extend(entries(&root.join("crates")));
    folders.extend(entries(&root.join("crates/drivers")));
    folders.retain(|folder| folder.join("Cargo.toml").exists());
    folders
}

/// Packages with their programs in `tests`.
pub fn integration_tests(root: &Path) -> Vec<(String, String)> {
    let mut tests = vec![];
    for package in packages(root) {
        for path in entries(&package.join("tests")) {
            let is_program =
                path.extension().is_some_and(|end| end == "rs") || path.join("main.rs").exists();
            if let (true, Some(name)) = (is_program, path.file_stem()) {
                tests.push((package_name(&package), name.to_string_lossy().into_owned()));
            }
        }
    }
    tests
}

/// What a package is called here that lies in a folder.
pub fn package_name(folder: &Path) -> String {
    match folder.file_name().unwrap_or_default().to_string_lossy() {
        cli if cli == "cli" => "imu-stand".to_owned(),
        other => other.into_owned(),
    }
}

/// Names of the programs that are not all long ones: cargo builds those of a name in every package.
pub fn quick(tests: &[(String, String)]) -> BTreeSet<String> {
    let is_long =
        |(package, name): &&(String, String)| LONG.contains(&format!("{package} {name}").as_str());
    let short = tests.iter().filter(|test| !is_long(test));
    short.map(|(_, name)| name.clone()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_said_of_test_programs_is_said_of_some_that_are_there() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        let tests = integration_tests(&root);
        let mut names: BTreeSet<String> = (tests.iter())
            .map(|(package, name)| format!("{package} {name}"))
            .collect();
        for folder in packages(&root) {
            let name = package_name(&folder);
            names.insert(format!("{name} {name}"));
        }
        for name in LONG.iter().chain(WAIT) {
            assert!(names.contains(*name), "`{name}` is no test program");
        }
        let quick = quick(&tests);
        // Of two of that name one is long.
        assert!(
            quick.contains("board") && !quick.contains("tutorial"),
            "{quick:?}"
        );
    }
}
