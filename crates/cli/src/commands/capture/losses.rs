//! Whose fault it is that samples are missing.

use serde::Serialize;

/// Why the samples right before the next one may be missing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Apart {
    /// The board or the line lost them; which, the board's counters say.
    #[default]
    No,
    /// The port was gone.
    PortGone,
    /// This program did not run.
    NotRunning,
}

/// Sample instants without a sample that neither the board nor the line lost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub(super) struct Lost {
    /// While the port was gone, or silent and opened again.
    pub lost_while_port_gone: u64,
    /// Between a capture that ended and its resumption.
    pub lost_while_not_running: u64,
    /// While the board started anew.
    pub lost_by_restart: u64,
}

/// Charges them.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Holes {
    pub next: Apart,
    pub lost: Lost,
}

impl Holes {
    /// A sample came, with so many missing before it: charges them, and says why where that is known.
    pub fn charge(&mut self, missing: u64, is_restart: bool) -> Option<&'static str> {
        let apart = std::mem::take(&mut self.next);
        let lost = &mut self.lost;
        if is_restart {
            lost.lost_by_restart += missing;
            return None;
        }
        let (count, why) = match apart {
            Apart::No => return None,
            Apart::PortGone => (&mut lost.lost_while_port_gone, "the port was gone"),
            Apart::NotRunning => (&mut lost.lost_while_not_running, "the capture did not run"),
        };
        *count += missing;
        (missing > 0).then_some(why)
    }
}

/// What is not 0, in words; with a bracket around it.
pub(super) fn by_whom(lost: &[(&str, u64)]) -> String {
    let some = lost.iter().filter(|(_, count)| *count > 0);
    let words: Vec<String> = some
        .map(|(whom, count)| format!("{count} {whom}"))
        .collect();
    if words.is_empty() {
        return String::new();
    }
    format!(" ({})", words.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hole_is_charged_to_what_made_it_and_the_next_one_is_not() {
        let mut holes = Holes {
            next: Apart::PortGone,
            ..Holes::default()
        };
        assert_eq!(holes.charge(7, false), Some("the port was gone"));
        assert_eq!(holes.charge(3, false), None);
        holes.next = Apart::NotRunning;
        assert_eq!(holes.charge(2, true), None, "the board started meanwhile");
        let lost = holes.lost;
        assert_eq!((lost.lost_while_port_gone, lost.lost_by_restart), (7, 2));
        assert_eq!(lost.lost_while_not_running, 0);
        assert_eq!(
            by_whom(&[("by the line", 3), ("by the board", 0)]),
            " (3 by the line)"
        );
    }
}
