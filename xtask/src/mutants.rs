//! Mutants: small faults put into the code one at a time, to see whether a test of purpose notices. Those of the code that runs on
//! the host are cargo-mutants' list, from which a seed draws; those of the registers, which the host does not compile, are a table
//! of our own and meet the tests of the image.

mod known;
mod list;
mod registers;
pub mod tree;

use std::path::Path;
use std::time::Instant;

use crate::step::{Failure, Pace, Progress};
use known::Known;
use list::Mutant;
use tree::{Outcome, Tree};

/// How many are drawn where nobody says.
const COUNT: usize = 100;
const USAGE: &str = "cargo xtask mutants [--seed N] [--count N] [--minutes N] [--package NAME] [--write]
  draws from cargo-mutants' list (`cargo install cargo-mutants --locked`), and tests each in a copy of the tree; half a minute
  each on two free cores; --write keeps docs/mutants.txt
cargo xtask mutants --registers [WORD | --write]
  plants those of the image's registers, or those whose name has the word; leave hil-tests alone meanwhile; --write keeps
  docs/mutants-registers.txt; six minutes on two free cores";

/// What is asked for.
#[derive(Debug, Default, PartialEq, Eq)]
struct Asked {
    seed: Option<u64>,
    count: Option<usize>,
    /// No other is begun after so many; the first ones of a draw are what a smaller count draws.
    minutes: Option<u64>,
    package: Option<String>,
    write: bool,
    registers: bool,
    help: bool,
    /// Of the registers' mutants, those whose name has it.
    word: Option<String>,
}

impl Asked {
    fn of(arguments: &[String]) -> Result<Self, Failure> {
        let mut asked = Self::default();
        let mut words = arguments.iter();
        let bad = |what: &str| Failure::new(&format!("`mutants` does not know {what}"), USAGE);
        while let Some(word) = words.next() {
            let mut number = || {
                let value = words.next().and_then(|value| value.parse::<u64>().ok());
                value.ok_or_else(|| bad(&format!("a {word} without its number")))
            };
            match word.as_str() {
                "--seed" => asked.seed = Some(number()?),
                "--count" => asked.count = Some(number()? as usize),
                "--minutes" => asked.minutes = Some(number()?),
                "--package" => asked.package = words.next().cloned(),
                "--write" => asked.write = true,
                "--registers" => asked.registers = true,
                word if asked.registers && !word.starts_with('-') => {
                    asked.word = Some(word.to_owned());
                }
                "--help" | "-h" => asked.help = true,
                word => return Err(bad(word)),
            }
        }
        Ok(asked)
    }
}

/// What became of a mutant.
struct Verdict {
    mutant: Mutant,
    outcome: Outcome,
}

/// Draws mutants, runs the tests against each, and says which of them nobody noticed.
///
/// # Errors
/// A tool that is missing, tests that fail without a mutant, or fewer caught than asked for.
pub fn hunt(root: &Path, arguments: &[String]) -> Result<(), Failure> {
    let asked = Asked::of(arguments)?;
    if asked.help {
        println!("{USAGE}");
        return Ok(());
    }
    if asked.registers {
        return registers::hunt(root, asked.word.as_deref(), asked.write);
    }
    let all = list::all(root, asked.package.as_deref())?;
    let clock = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    let seed = (asked.seed).unwrap_or_else(|| clock.map_or(0, |time| time.as_secs()));
    let drawn = draw(all.clone(), seed, asked.count.unwrap_or(COUNT));
    println!("--seed {seed}: {} of {} mutants", drawn.len(), all.len());
    let tree = Tree::copy(root, "code")?;
    let mut packages: Vec<&str> = drawn.iter().map(|mutant| mutant.package).collect();
    packages.sort_unstable();
    packages.dedup();
    for package in packages {
        sound(&tree, package)?;
    }
    let mut known = Known::read(root)?;
    let (mut verdicts, begun) = (Vec::new(), Instant::now());
    for (n, mutant) in drawn.into_iter().enumerate() {
        if let Some(minutes) = asked.minutes
            && begun.elapsed().as_secs() >= 60 * minutes
        {
            println!("{minutes} minutes are over");
            break;
        }
        let from = Instant::now();
        let outcome = tree.try_one(&mutant)?;
        let seconds = from.elapsed().as_secs();
        let told = known.told(&mutant, &outcome);
        println!("{:>4} {told:<10} {} ({seconds} s)", n + 1, mutant.id());
        if let Outcome::Caught(by) = &outcome {
            println!("                by {by}");
        }
        verdicts.push(Verdict { mutant, outcome });
    }
    let sum = known.sum(&verdicts);
    println!("{sum}");
    if asked.write {
        known.write(root, seed, &verdicts)?;
    }
    if sum.met() {
        return Ok(());
    }
    Err(Failure::new(
        "mutants survive",
        "write the test that each of them asks for, or argue in docs/mutants.txt why nobody can tell it from the code",
    ))
}

/// Without a mutant the tests pass, or nothing that they say counts.
fn sound(tree: &Tree, package: &str) -> Result<(), Failure> {
    let mut progress = Progress::new(&format!("tests of {package}"), Pace::Steady);
    progress.tick("without a mutant");
    let outcome = tree.test(package)?;
    progress.end();
    match outcome {
        Outcome::Survived => Ok(()),
        outcome => Err(Failure::new(
            &format!("the tests of {package} do not pass without a mutant: {outcome:?}"),
            "mend them first",
        )),
    }
}

/// So many of them, in an order that the seed tells.
fn draw(mut all: Vec<Mutant>, seed: u64, count: usize) -> Vec<Mutant> {
    let mut state = seed;
    // SplitMix64.
    let mut next = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    };
    let count = count.min(all.len());
    for place in 0..count {
        let left = (all.len() - place) as u64;
        all.swap(place, place + (next() % left) as usize);
    }
    all.truncate(count);
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seed_draws_the_same_ones_again_and_each_once() {
        let all: Vec<Mutant> = (0..50).map(Mutant::numbered).collect();
        let ids = |seed| -> Vec<String> {
            let drawn = draw(all.clone(), seed, 20);
            drawn.iter().map(Mutant::id).collect()
        };
        assert_eq!(ids(3), ids(3));
        assert_ne!(ids(3), ids(4));
        let mut once = ids(3);
        once.sort();
        once.dedup();
        assert_eq!(once.len(), 20);
        assert_eq!(
            ids(3)[..7],
            draw(all.clone(), 3, 7)
                .iter()
                .map(Mutant::id)
                .collect::<Vec<_>>()
        );
        assert_eq!(draw(all, 1, 1000).len(), 50);
    }

    #[test]
    fn what_is_asked_is_read_and_what_is_not_known_is_refused() {
        let of =
            |words: &[&str]| Asked::of(&words.iter().map(|w| (*w).to_owned()).collect::<Vec<_>>());
        let asked = of(&["--seed", "7", "--minutes", "20", "--write"]).expect("known");
        assert_eq!(
            (asked.seed, asked.minutes, asked.write),
            (Some(7), Some(20), true)
        );
        assert!(of(&["--registers", "TXC"]).is_ok_and(|asked| asked.word.is_some()));
        assert!(of(&["--help"]).is_ok_and(|asked| asked.help));
        assert!(of(&["--seed"]).is_err() && of(&["TXC"]).is_err());
    }
}
