//! What to do about what has no name: by what it is of.

use diagnosis::result::Unexplained;
use diagnosis::test_level::{CheckId, Domain};

use super::verdict;

const NOT_READ: &str =
    "Look to the sensor, its supply and the column: nothing can be said of what was not measured.";
const MADE: &str = "Look to how the readings are made, from the converter to the file: bits, digits, filters and words of the bus. A longer record shows the same.";
const LINES: &str = "Find what turns, switches or hums at these frequencies: stop it, isolate the sensor, or notch them. Record at another rate too: a line that moves is an alias.";
const NOISE: &str = "Record again, twice as long: what comes again belongs to the sensor or the stand. The report shows where it lies.";

/// A sentence for each kind of thing among some entries.
pub fn of<'a>(all: impl Iterator<Item = &'a Unexplained>) -> Vec<&'static str> {
    let mut told: Vec<&str> = all.map(of_one).collect();
    if told.iter().any(|t| *t != NOT_READ) {
        told.retain(|t| *t != NOT_READ);
    }
    [LINES, NOISE, MADE, NOT_READ]
        .into_iter()
        .filter(|t| told.contains(t))
        .collect()
}

fn of_one(left: &Unexplained) -> &'static str {
    let of = |domain| {
        let mut ids = left.checks.iter().filter_map(|id| CheckId::of(id));
        ids.any(|id| id.of_what() == domain)
    };
    // What audits see in codes may have no check of its own, and no size.
    if verdict::is_dead(left) {
        NOT_READ
    } else if !verdict::was_read(left) || of(Domain::Codes) || of(Domain::Readings) {
        MADE
    } else if !left.lines.is_empty() {
        LINES
    } else {
        NOISE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(check: &str) -> Unexplained {
        Unexplained {
            checks: vec![check.to_owned()],
            ..Unexplained::default()
        }
    }

    fn dead() -> Unexplained {
        Unexplained {
            what: "too few readings: it is left out".to_owned(),
            ..Unexplained::default()
        }
    }

    #[test]
    fn a_longer_record_is_advised_where_it_tells_more() {
        let all = [entry("ljung_box"), entry("fine_codes"), dead()];
        assert_eq!(of(all.iter()), [NOISE, MADE]);
        assert_eq!(of(all[1..2].iter()), [MADE]);
        assert_eq!(of(all[..1].iter()), [NOISE]);
        assert_eq!(of(all[2..].iter()), [NOT_READ]);
        assert_eq!(of([Unexplained::default()].iter()), [MADE]);
        let comb = Unexplained {
            rms: Some(0.1),
            lines: vec![std::collections::BTreeMap::new()],
            ..Unexplained::default()
        };
        assert_eq!(of([comb].iter()), [LINES]);
    }
}
