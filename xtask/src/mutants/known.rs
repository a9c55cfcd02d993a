//! docs/mutants.txt: what became of the mutants that were drawn, and why some of them nobody can tell from the code.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use super::Verdict;
use super::list::Mutant;
use super::tree::Outcome;
use crate::step::Failure;

/// Asked for: caught, of those that change anything.
const ASKED_PERCENT: usize = 95;
const HEADER: &str = "\
# Mutants that were drawn, and what became of them. `cargo xtask mutants --write` rewrites the lines `caught` and `survived`; a line
# `equivalent` is written by hand and stays: what the mutant changes, the line it changes, and why no test can tell. See mutants.md.
";

/// The list.
pub struct Known {
    /// By what the mutant is: why it changes nothing.
    equivalent: BTreeMap<String, String>,
}

fn path(root: &Path) -> PathBuf {
    root.join("docs/mutants.txt")
}

impl Known {
    /// Reads it; empty where there is none.
    pub fn read(root: &Path) -> Result<Self, Failure> {
        let text = std::fs::read_to_string(path(root)).unwrap_or_default();
        Ok(Self::parse(&text))
    }

    fn parse(text: &str) -> Self {
        let mut equivalent = BTreeMap::new();
        let mut lines = text.lines().peekable();
        while let Some(line) = lines.next() {
            let Some(id) = line.strip_prefix("equivalent  ") else {
                continue;
            };
            let why = lines.next_if(|next| next.starts_with("            "));
            equivalent.insert(id.to_owned(), why.unwrap_or_default().trim().to_owned());
        }
        Self { equivalent }
    }

    /// A word for what became of it.
    pub fn told(&mut self, mutant: &Mutant, outcome: &Outcome) -> &'static str {
        match outcome {
            Outcome::Caught(_) => "caught",
            Outcome::DoesNotCompile => "no program",
            Outcome::Survived if self.equivalent.contains_key(&mutant.id()) => "equivalent",
            Outcome::Survived => "SURVIVED",
        }
    }

    /// How many of each.
    pub fn sum(&mut self, verdicts: &[Verdict]) -> Sum {
        let mut sum = Sum::default();
        for verdict in verdicts {
            match self.told(&verdict.mutant, &verdict.outcome) {
                "caught" => sum.caught += 1,
                "no program" => sum.no_program += 1,
                "equivalent" => sum.equivalent += 1,
                _ => sum.survived += 1,
            }
        }
        sum
    }

    /// Writes the list with these.
    pub fn write(&mut self, root: &Path, seed: u64, verdicts: &[Verdict]) -> Result<(), Failure> {
        let sum = self.sum(verdicts);
        let mut text = String::from(HEADER);
        let _ = writeln!(
            text,
            "#\n# cargo xtask mutants --seed {seed} --count {}: {sum}\n",
            verdicts.len()
        );
        for (id, why) in &self.equivalent {
            let _ = writeln!(text, "equivalent  {id}\n            {why}");
        }
        let mut lines = Vec::new();
        for Verdict { mutant, outcome } in verdicts {
            match outcome {
                Outcome::Caught(by) => {
                    lines.push(format!("caught      {}\n            {by}", mutant.id()))
                }
                Outcome::Survived if !self.equivalent.contains_key(&mutant.id()) => {
                    lines.push(format!("survived    {}", mutant.id()));
                }
                _ => {}
            }
        }
        lines.sort();
        text.push('\n');
        text.push_str(&lines.join("\n"));
        text.push('\n');
        std::fs::write(path(root), text).map_err(|error| {
            Failure::new(
                &format!("{}: {error}", path(root).display()),
                "make room or rights for it",
            )
        })
    }
}

/// How many became what.
#[derive(Debug, Default)]
pub struct Sum {
    caught: usize,
    survived: usize,
    equivalent: usize,
    no_program: usize,
}

impl Sum {
    /// Whether enough are caught.
    pub fn met(&self) -> bool {
        100 * self.caught >= ASKED_PERCENT * (self.caught + self.survived)
    }
}

impl std::fmt::Display for Sum {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let counted = self.caught + self.survived;
        write!(
            f,
            "{} of {counted} caught ({:.0} %; asked {ASKED_PERCENT} %: {}), {} survived, {} equivalent, {} no program",
            self.caught,
            100.0 * self.caught as f64 / counted.max(1) as f64,
            if self.met() { "met" } else { "NOT MET" },
            self.survived,
            self.equivalent,
            self.no_program
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_argument_is_read_with_its_mutant_and_counts_where_that_survives() {
        let mutant = Mutant::numbered(3);
        let text = format!(
            "# x\nequivalent  {}\n            nobody asks\ncaught      y\n",
            mutant.id()
        );
        let mut known = Known::parse(&text);
        assert_eq!(known.told(&mutant, &Outcome::Survived), "equivalent");
        assert_eq!(
            known.told(&Mutant::numbered(4), &Outcome::Survived),
            "SURVIVED"
        );
        let verdict = |outcome| Verdict {
            mutant: mutant.clone(),
            outcome,
        };
        let sum = known.sum(&[
            verdict(Outcome::Survived),
            verdict(Outcome::Caught("t".to_owned())),
            verdict(Outcome::DoesNotCompile),
        ]);
        assert!(sum.met());
        assert_eq!((sum.caught, sum.equivalent, sum.no_program), (1, 1, 1));
        assert!(
            !Sum {
                caught: 94,
                survived: 6,
                ..Sum::default()
            }
            .met()
        );
    }
}
