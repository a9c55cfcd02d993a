//! A mapping in words: options as a shell takes them, and what they leave to the reader.

use crate::text::shell_word;

use super::super::CaptureError;
use super::super::columns::Said;
use super::super::error::{brief, brief_list};
use super::guess;
use super::seen::Seen;

/// Bytes of a name beyond which its number is easier to write.
const LONG: usize = 80;
/// Stands where a unit has to be put in: no unit is called so, and a mapping with it is refused.
const UNIT: &str = "UNIT";

/// `--columns ... --units ...`, and what it leaves open.
pub(super) struct Proposal {
    pub line: String,
    /// Keys of `--units` whose unit neither the file nor a convention says.
    pub open: Vec<&'static str>,
    /// A name that two columns have, one of them in it.
    pub twice: Option<String>,
}

/// A mapping made of a file's column names. `numbered` says that the names are made up, and columns are called by their
/// numbers; `knows_rate` that the sample rate is known without times.
pub(super) fn proposal(
    names: &[String],
    numbered: bool,
    knows_rate: bool,
    seen: &Seen,
) -> Proposal {
    let guess = guess(names, numbered, seen);
    let is_twice = |name: &String| names.iter().filter(|other| *other == name).count() > 1;
    let twice = guess.columns.iter().map(|(_, at)| &names[*at]);
    let twice = twice
        .filter(|_| !numbered)
        .find(|name| is_twice(name))
        .cloned();
    let column = |(ours, at): &(String, usize)| {
        let name = &names[*at];
        // What would be taken for the list's own commas goes by its number, and so do a name that two columns have and none at
        // all, as pandas gives an index.
        if numbered
            || is_twice(name)
            || name.trim().is_empty()
            || name.contains(',')
            || name.len() > LONG
        {
            format!("{ours}={}", at + 1)
        } else {
            format!("{ours}={name}")
        }
    };
    let mut open = Vec::new();
    let mut units = Vec::new();
    for (key, said) in &guess.units {
        match (*key, *said) {
            // Seconds go without saying; other times are guessed by nobody.
            ("time", None | Some("s")) => {}
            (key, Some(unit)) => units.push(format!("{key}={unit}")),
            ("freq", None) => units.push("freq=1".to_owned()),
            (key, None) => {
                open.push(key);
                units.push(format!("{key}={UNIT}"));
            }
        }
    }
    let has_time = guess.columns.iter().any(|(ours, _)| ours == "time");
    let columns: Vec<String> = guess.columns.iter().map(column).collect();
    let mut line = format!("--columns {}", shell_word(&columns.join(",")));
    if !units.is_empty() {
        line += &format!(" --units {}", shell_word(&units.join(",")));
    }
    if !has_time && !knows_rate {
        line += " --rate HZ";
    }
    Proposal { line, open, twice }
}

/// An error of columns that mean nothing here; a mapping is [`proposed`] once rows are seen.
pub(in crate::capture) fn unknown(names: &[String], why: String) -> CaptureError {
    CaptureError::Columns {
        why,
        columns: brief_list(names),
        hint: String::new(),
        example: String::new(),
    }
}

/// An error of columns that mean nothing here, with a mapping by their names and what was seen of their values.
pub(in crate::capture) fn proposed(
    error: CaptureError,
    said: &Said<'_>,
    knows_rate: bool,
    seen: &Seen,
) -> CaptureError {
    let CaptureError::Columns { why, columns, .. } = error else {
        return error;
    };
    let Proposal { line, open, twice } = proposal(said.names, said.numbered, knows_rate, seen);
    let mut hint = String::new();
    if said.numbered {
        hint += "; see that the columns are right, which go by their places and values";
    }
    if let Some(name) = twice {
        hint += &format!(
            "; two columns are called `{}`, so take the right one by its number",
            brief(&name)
        );
    }
    let asked: Vec<&str> = open.iter().filter_map(|key| choices(key)).collect();
    if !asked.is_empty() {
        hint += &format!(
            "; put in the unit, which the file does not say ({})",
            asked.join("; ")
        );
    }
    CaptureError::Columns {
        why,
        columns,
        hint,
        example: line,
    }
}

/// The units from which to choose.
fn choices(key: &str) -> Option<&'static str> {
    match key {
        "gyro" => {
            Some("gyro: deg/s, rad/s as phones and ROS have it, or what a count is: `0.0076deg/s`")
        }
        "acc" => Some("acc: m/s2, g, mg, or what a count is"),
        _ => None,
    }
}
