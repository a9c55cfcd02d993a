//! The mutants that cargo-mutants makes, each with its change of a file.

use std::path::Path;

use crate::step::{Failure, Pace, Silent, watched};

/// Packages and the folders of their files.
const PACKAGES: [(&str, &str); 5] = [
    ("firmware", "src/"),
    ("wire", "crates/wire/"),
    ("adis16250", "crates/drivers/adis16250/"),
    ("mma7260qt", "crates/drivers/mma7260qt/"),
    ("bench", "crates/bench/"),
];
/// What the host does not compile, or only with the simulated chip.
const NOT_HERE: [&str; 4] = [
    "src/main.rs",
    "src/avr/**",
    "crates/bench/src/simavr.rs",
    "crates/bench/src/simavr/**",
];

/// A change of one file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mutant {
    pub package: &'static str,
    /// From the root.
    pub file: String,
    /// "replace < with <= in Motor::aim".
    pub what: String,
    /// The first line that it changes, from 1.
    pub line: usize,
    /// That line as it was, without blanks at its ends.
    pub was: String,
    /// Lines to be found from there on, and what stands in their place.
    pub old: Vec<String>,
    pub new: Vec<String>,
}

impl Mutant {
    /// What tells it from others as long as its line stays as it is, wherever that moves.
    pub fn id(&self) -> String {
        format!("{}: {} | {}", self.file, self.what, self.was)
    }

    #[cfg(test)]
    pub fn numbered(number: usize) -> Self {
        Self {
            package: "wire",
            file: "lib.rs".to_owned(),
            what: number.to_string(),
            line: number,
            was: String::new(),
            old: vec![],
            new: vec![],
        }
    }

    /// The file's text with it.
    pub fn applied(&self, text: &str) -> Option<String> {
        let lines: Vec<&str> = text.lines().collect();
        let place = self.line.checked_sub(1)?;
        let there = lines.get(place..place + self.old.len())?;
        if there != self.old {
            return None;
        }
        let new = self.new.iter().map(String::as_str);
        let all: Vec<&str> = (lines[..place].iter().copied())
            .chain(new)
            .chain(lines[place + self.old.len()..].iter().copied())
            .collect();
        Some(all.join("\n") + "\n")
    }
}

/// All of them, or those of a package.
///
/// # Errors
/// cargo-mutants is missing, or says what nobody understands.
pub fn all(root: &Path, package: Option<&str>) -> Result<Vec<Mutant>, Failure> {
    let mut command = crate::cargo(root, &["mutants", "--list", "--diff", "--colors", "never"]);
    for (name, _) in PACKAGES {
        if package.is_none_or(|one| one == name) {
            command.args(["-p", name]);
        }
    }
    for glob in NOT_HERE {
        command.args(["-e", glob]);
    }
    let said = watched(
        "cargo mutants",
        &mut command,
        &mut Silent("listing"),
        &mut Pace::Steady,
    )
    .map_err(|_| {
        Failure::new(
            "cargo-mutants does not list what it would change",
            "cargo install cargo-mutants --locked; without it `cargo xtask mutants --registers` works",
        )
    })?;
    let mut found = parse(&said.out);
    found.retain(|mutant| {
        let text = std::fs::read_to_string(root.join(&mutant.file));
        text.is_ok_and(|text| !is_of_the_avr(&text, mutant.line))
    });
    if found.is_empty() {
        return Err(Failure::new(
            "cargo mutants lists nothing that is understood",
            "`cargo mutants --version`: 27 was known when this was written",
        ));
    }
    Ok(found)
}

/// Whether the item about a line is compiled for the board alone.
fn is_of_the_avr(text: &str, line: usize) -> bool {
    let mut inside = false;
    for (number, text) in (1..).zip(text.lines()) {
        if text == "#[cfg(target_arch = \"avr\")]" {
            inside = true;
        }
        if number == line {
            return inside;
        }
        if text == "}" {
            inside = false;
        }
    }
    false
}

/// Mutants of a list with diffs: a line with place and name, then a unified diff of one hunk.
fn parse(lines: &[String]) -> Vec<Mutant> {
    let mut found = Vec::new();
    let mut lines = lines.iter().map(String::as_str).peekable();
    while let Some(line) = lines.next() {
        let Some(file) = line.strip_prefix("--- ") else {
            continue;
        };
        let what = lines.next().and_then(|line| line.strip_prefix("+++ "));
        let begin = lines.next().and_then(hunk);
        let (Some(what), Some(mut at)) = (what, begin) else {
            continue;
        };
        let (mut old, mut new) = (Vec::new(), Vec::new());
        let (mut seen, mut changed) = (Vec::new(), None);
        while let Some(next) = lines.peek() {
            let Some((kind, rest)) = next.split_at_checked(1) else {
                break;
            };
            match kind {
                " " => {
                    seen.push(rest);
                    old.push(rest.to_owned());
                    new.push(rest.to_owned());
                }
                "-" if !next.starts_with("--- ") => {
                    changed.get_or_insert((at + seen.len(), rest));
                    seen.push(rest);
                    old.push(rest.to_owned());
                }
                "+" => new.push(rest.to_owned()),
                _ => break,
            }
            lines.next();
        }
        let package = PACKAGES.iter().find(|(_, folder)| file.starts_with(folder));
        if let (Some((package, _)), Some((_, was))) = (package, changed) {
            // Without what stays the same before it.
            let same = old.iter().zip(&new).take_while(|(a, b)| a == b).count();
            at += same;
            found.push(Mutant {
                package,
                file: file.to_owned(),
                what: what.to_owned(),
                line: at,
                was: was.trim().to_owned(),
                old: old.split_off(same),
                new: new.split_off(same),
            });
        }
    }
    found
}

/// The line that a hunk begins at: "@@ -12,7 +12,7 @@".
fn hunk(line: &str) -> Option<usize> {
    let numbers = line.strip_prefix("@@ -")?;
    let end = numbers.find([',', ' '])?;
    numbers[..end].parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    const LISTED: &str = "\
crates/wire/src/cobs.rs:4:10: replace < with <= in push
--- crates/wire/src/cobs.rs
+++ replace < with <= in push
@@ -2,5 +2,5 @@
 fn push() {
     let a = 1;
-    if a < b {
+    if a <= b {
         go();
     }
src/motor.rs:9:1: replace cut with ()
--- src/motor.rs
+++ replace cut with ()
@@ -9,3 +9,1 @@
 fn cut() {
-    off();
+    ()
 }
";

    #[test]
    fn a_list_with_diffs_is_read_and_a_change_is_put_where_it_belongs() {
        let lines: Vec<String> = LISTED.lines().map(str::to_owned).collect();
        let found = parse(&lines);
        assert_eq!(found.len(), 2);
        assert_eq!(
            (found[0].package, found[0].line, found[0].was.as_str()),
            ("wire", 4, "if a < b {")
        );
        assert_eq!((found[1].package, found[1].line), ("firmware", 10));
        let text =
            "// first\nfn push() {\n    let a = 1;\n    if a < b {\n        go();\n    }\n}\n";
        let with = found[0].applied(text).expect("it is there");
        assert_eq!(with, text.replace("a < b", "a <= b"));
        assert_eq!(found[0].applied(&text.replace("a < b", "a > b")), None);
    }

    #[test]
    fn what_only_the_board_compiles_is_left_out() {
        let text = "fn a() {\n}\n#[cfg(target_arch = \"avr\")]\nfn b() {\n    x\n}\nfn c() {\n}\n";
        let of = |line| is_of_the_avr(text, line);
        assert_eq!((of(1), of(5), of(7)), (false, true, false));
    }
}
