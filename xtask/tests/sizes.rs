//! Sizes: no function has more than 100 lines, and no file more than 500 without saying why in its header. A function
//! that is longer stands below with its reason; an entry that is no longer needed fails too.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Lines of a function, signature and closing brace included.
const FUNCTION_LINES: usize = 100;
/// Lines of a file.
const FILE_LINES: usize = 500;
/// How the header of a longer file begins to say why.
const REASON: &str = "//! More than 500 lines: ";

/// Functions that are longer: file, name, why.
const LONG_FUNCTIONS: &[(&str, &str, &str)] = &[
    (
        "crates/cli/src/commands/paper/criticism.rs",
        "claims",
        "one row for each claim of the paper",
    ),
    (
        "crates/cli/src/stand/hidden.rs",
        "fault",
        "one arm for each thing that is hidden",
    ),
    (
        "crates/diagnosis/src/two_level/filter_bank.rs",
        "run",
        "one loop over the readings, whose state stays in registers",
    ),
    (
        "src/stand/requests.rs",
        "carry_out",
        "one arm for each command",
    ),
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Rust files below a folder, by their path from the root.
fn files(root: &Path, below: &str, all: &mut Vec<String>) {
    let Ok(entries) = std::fs::read_dir(root.join(below)) else {
        return;
    };
    for entry in entries {
        let name = entry.expect("an entry").file_name();
        let path = format!("{below}/{}", name.to_string_lossy());
        if root.join(&path).is_dir() {
            files(root, &path, all);
        } else if path.ends_with(".rs") {
            all.push(path);
        }
    }
}

/// The sources of the firmware, of every crate and of this one.
fn sources(root: &Path) -> Vec<(String, String)> {
    let mut all = Vec::new();
    files(root, "src", &mut all);
    files(root, "xtask/src", &mut all);
    for folder in ["crates", "crates/drivers"] {
        for entry in std::fs::read_dir(root.join(folder)).expect("a folder of crates") {
            let name = entry.expect("an entry").file_name();
            files(
                root,
                &format!("{folder}/{}/src", name.to_string_lossy()),
                &mut all,
            );
        }
    }
    all.sort();
    all.into_iter()
        .map(|path| {
            let text = std::fs::read_to_string(root.join(&path)).expect("a source file");
            (path, text)
        })
        .collect()
}

/// The name of the function that a line begins.
fn begun(line: &str) -> Option<&str> {
    let (before, after) = line.split_once("fn ")?;
    let words = ["const", "async", "unsafe", "extern", "\"C\""];
    let mut words_before = before.split_whitespace();
    let is_visibility = |w: &str| w.starts_with("pub") || w.ends_with(')');
    if !words_before.all(|w| is_visibility(w) || words.contains(&w)) {
        return None;
    }
    let name = after.split(['(', '<']).next()?;
    let is_name = |c: char| c.is_alphanumeric() || c == '_';
    (!name.is_empty() && name.chars().all(is_name)).then_some(name)
}

/// Functions with their lines. `cargo fmt` closes a body by a brace as far to the right as its first line.
fn functions(text: &str) -> Vec<(&str, usize)> {
    let lines: Vec<&str> = text.lines().collect();
    let mut found = Vec::new();
    for (i, line) in lines.iter().enumerate() {
        let Some(name) = begun(line) else { continue };
        let indent = &line[..line.len() - line.trim_start().len()];
        let ends = |l: &&str| {
            l.strip_prefix(indent)
                .is_some_and(|l| l == "}" || l.ends_with(';') && !l.starts_with(' '))
        };
        let length = 1 + lines[i..].iter().take_while(|l| !ends(l)).count();
        found.push((name, length));
    }
    found
}

#[test]
fn a_function_is_found_with_its_lines() {
    let text = "pub(in super::super) const fn one() {\n    two();\n}\n\nimpl A {\n    fn two(\n        &self,\n    ) -> u8 {\n        1\n    }\n    fn three();\n}\n";
    assert_eq!(functions(text), [("one", 3), ("two", 5), ("three", 1)]);
}

#[test]
fn no_function_is_longer_than_its_limit() {
    let mut long = BTreeSet::new();
    for (path, text) in sources(&root()) {
        let over = functions(&text)
            .into_iter()
            .filter(|f| f.1 > FUNCTION_LINES);
        long.extend(over.map(|(name, lines)| (path.clone(), name.to_owned(), lines)));
    }
    let listed = |path: &str, name: &str| LONG_FUNCTIONS.iter().any(|f| f.0 == path && f.1 == name);
    let new: Vec<_> = long.iter().filter(|(p, n, _)| !listed(p, n)).collect();
    assert!(new.is_empty(), "more than {FUNCTION_LINES} lines: {new:?}");
    for (path, name, _) in LONG_FUNCTIONS {
        let still = long.iter().any(|(p, n, _)| p == path && n == name);
        assert!(
            still,
            "{path}: {name} is short enough now: take it off the list"
        );
    }
}

#[test]
fn a_long_file_says_why() {
    let mut long = BTreeSet::new();
    for (path, text) in sources(&root()) {
        let says_why = text
            .lines()
            .take_while(|l| l.starts_with("//!"))
            .any(|l| l.starts_with(REASON));
        let lines = text.lines().count();
        if lines > FILE_LINES && !says_why {
            long.insert(path);
        } else {
            assert!(
                !says_why || lines > FILE_LINES,
                "{path} gives a reason and is short"
            );
        }
    }
    assert!(
        long.is_empty(),
        "more than {FILE_LINES} lines, and no reason in the header: {long:?}"
    );
}
