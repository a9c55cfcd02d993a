//! Cells beyond all numbers, as a division by zero or a number too large for its type is printed: no readings, and counted.

use super::error::brief;

/// Whether a cell says so: `inf`, `-Infinity`, `1e999`; `1.#INF` as Microsoft's library wrote it, `ovf` as Arduino's does.
pub(super) fn is_infinite(cell: &str) -> bool {
    const WORDS: [&str; 3] = ["1.#inf", "#inf", "ovf"];
    let bare = cell.strip_prefix(['-', '+']).unwrap_or(cell);
    // `parse` takes the words `inf` and `infinity` in any case.
    let is_it = || bare.parse::<f64>().is_ok_and(f64::is_infinite);
    WORDS.iter().any(|word| bare.eq_ignore_ascii_case(word)) || is_it()
}

/// How many there are, and the first of them.
#[derive(Debug, Default)]
pub(super) struct Infinite {
    count: usize,
    first: Option<String>,
}

impl Infinite {
    /// Takes a cell of a text.
    pub fn take(&mut self, line: u64, column: &str, cell: &str) {
        self.count += 1;
        let first = || {
            format!(
                "line {line}, column `{}` (`{}`)",
                brief(column),
                brief(cell)
            )
        };
        self.first.get_or_insert_with(first);
    }

    /// Leaves infinite values of a column out.
    pub fn leave_out(&mut self, values: &mut [f64], column: &str) {
        for (row, value) in values
            .iter_mut()
            .enumerate()
            .filter(|(_, v)| v.is_infinite())
        {
            self.count += 1;
            let first = || format!("row {}, column `{}`", row + 1, brief(column));
            self.first.get_or_insert_with(first);
            *value = f64::NAN;
        }
    }

    /// What to tell of them.
    pub fn note(&self) -> Option<String> {
        let first = self.first.as_ref()?;
        Some(format!(
            "cells that are infinite: {}, first in {first}; they are no readings",
            self.count
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_beyond_all_numbers_is_known_in_the_words_of_many() {
        for cell in [
            "inf",
            "-inf",
            "+Inf",
            "Infinity",
            "-INFINITY",
            "1e999",
            "-1e999",
            "1.#INF",
            "-1.#INF",
            "#INF",
            "ovf",
        ] {
            assert!(is_infinite(cell), "{cell}");
        }
        for cell in [
            "", "nan", "1", "1e300", "info", "-", "infinite", "1.#IND", "ovfl",
        ] {
            assert!(!is_infinite(cell), "{cell}");
        }
    }
}
