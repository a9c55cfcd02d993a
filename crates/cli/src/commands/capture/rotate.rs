//! When a capture goes on in another file.

/// `--rotate`: after a time, or from a size on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Rotate {
    /// At every multiple of so many seconds since the capture began.
    Every(f64),
    /// As soon as the file has so many bytes, to within what is written in a second.
    Size(u64),
}

/// Units, and how many seconds they are.
const TIMES: [(&str, f64); 4] = [("min", 60.0), ("h", 3600.0), ("d", 86_400.0), ("s", 1.0)];
/// Units, and how many bytes they are.
const SIZES: [(&str, f64); 3] = [("kB", 1e3), ("MB", 1e6), ("GB", 1e9)];
/// A file of less is a waste of files, and a row is written within a second.
const SHORTEST_S: f64 = 2.0;
/// A file has some header.
const SMALLEST: f64 = 10e3;

impl Rotate {
    /// Whether the next row belongs into another file: this one's last row so far came at `last_s`.
    pub fn is_due(self, last_s: f64, now_s: f64, bytes: u64) -> bool {
        match self {
            Rotate::Every(s) => (now_s / s).floor() > (last_s / s).floor(),
            Rotate::Size(most) => bytes >= most,
        }
    }
}

/// `24h`, `30min`, `7d`, `100MB`.
pub(super) fn parse(text: &str) -> Result<Rotate, String> {
    let of = |units: &[(&str, f64)]| {
        units.iter().find_map(|(unit, factor)| {
            let number: f64 = text.strip_suffix(unit)?.trim().parse().ok()?;
            (number.is_finite() && number > 0.0).then_some(number * factor)
        })
    };
    match (of(&TIMES), of(&SIZES)) {
        (Some(s), _) if s >= SHORTEST_S => Ok(Rotate::Every(s)),
        (_, Some(bytes)) if bytes >= SMALLEST => Ok(Rotate::Size(bytes as u64)),
        _ => Err(format!(
            "takes a time of {SHORTEST_S} s at least (24h, 30min, 7d) or a size of 10 kB at least (100MB, 1GB)"
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_and_sizes_are_told_by_their_units() {
        assert_eq!(parse("24h"), Ok(Rotate::Every(86_400.0)));
        assert_eq!(parse("1.5 min"), Ok(Rotate::Every(90.0)));
        assert_eq!(parse("100MB"), Ok(Rotate::Size(100_000_000)));
        for wrong in ["24", "h", "-1h", "1s", "5kB", "nanh", "infd", ""] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_file_ends_at_the_multiple_that_lies_between_two_rows() {
        let day = Rotate::Every(86_400.0);
        assert!(!day.is_due(1.0, 86_399.9, u64::MAX));
        assert!(day.is_due(86_399.95, 86_400.0, 0));
        // Resumed two days later.
        assert!(day.is_due(10.0, 200_000.0, 0));
        let big = Rotate::Size(1_000_000);
        assert!(!big.is_due(0.0, 1e9, 999_999) && big.is_due(0.0, 0.0, 1_000_000));
    }
}
