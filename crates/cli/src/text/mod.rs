//! What people read in a terminal.

pub mod advice;
pub mod answer;
mod cost;
mod details;
pub mod noise;
mod screen;
pub mod verdict;

pub use details::{details, held_at, measured, rounded_as};
pub use screen::{MORE, diagnosis};

/// Columns of a terminal that text is wrapped to.
const WIDTH: usize = 80;

/// A word as a shell takes it, in quotes where it needs them.
#[must_use]
pub fn shell_word(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,:+".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', r"'\''"))
}

/// A wrapped paragraph, indented, with a lead before its first line. No line ends at a no-break space.
#[must_use]
pub fn item(lead: &str, text: &str) -> String {
    let indent = " ".repeat(4);
    let mut out = format!("{indent}{lead}");
    let mut column = out.chars().count();
    let mut first = true;
    for word in text.split_ascii_whitespace() {
        let length = word.chars().count();
        if !first && column + 1 + length > WIDTH {
            out.push('\n');
            out.push_str(&indent);
            out.push_str("  ");
            column = indent.len() + 2;
        } else if !first {
            out.push(' ');
            column += 1;
        }
        out.push_str(word);
        column += length;
        first = false;
    }
    out.replace('\u{a0}', " ")
}

/// What the line did: frames in order and frames that were not.
#[must_use]
pub fn link(counts: &wire::LinkCounts) -> String {
    format!(
        "{} frames in order, {} rejected",
        counts.frames,
        counts.rejected()
    )
}

#[cfg(test)]
mod tests {
    #[test]
    fn long_text_is_wrapped_and_indented() {
        let text = super::item("why: ", &"word ".repeat(40));
        assert!(text.lines().count() > 1);
        assert!(
            text.lines()
                .all(|line| line.starts_with("    ") && line.chars().count() <= super::WIDTH)
        );
    }
}
