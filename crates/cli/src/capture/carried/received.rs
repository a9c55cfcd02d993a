//! Lines behind the time at which a terminal received them: `10:00:01.5 -> 0.1,0.2,0.3`.

use super::{Made, SHOWN, behind_time};

/// What stands between.
const ARROW: &str = "->";
/// What may separate the cells of what was received.
const SEPARATORS: [char; 4] = [';', '\t', ',', ' '];

/// Lines of which all have such a time.
pub(super) struct Received {
    separator: char,
}

impl Received {
    pub fn of(lines: &[&str]) -> Option<Self> {
        let is_received = |line: &&&str| line.contains(ARROW) && behind_time(line).0.is_some();
        let count = lines.iter().filter(is_received).count();
        let (_, last) = behind_time(lines.last()?);
        let separator = SEPARATORS.into_iter().find(|s| last.contains(*s))?;
        (count >= SHOWN && count == lines.len()).then_some(Self { separator })
    }

    /// The time is the first cell; its name, where what was received are names.
    pub fn row(&self, line: &str, row: &mut String) -> Made {
        let (Some(time), rest) = behind_time(line) else {
            return Made::Other;
        };
        let is_number = |cell: &str| cell.trim().parse::<f64>().is_ok();
        let has_number = rest.split(self.separator).any(is_number);
        row.push_str(if has_number { time } else { "time" });
        row.push(self.separator);
        row.push_str(rest);
        Made::Row
    }
}
