//! Units: how others write them, in which of ours they end, and where a file says them.

use model::record::{FULL_DUTY, Quantity};

use super::columns::Held;
use super::error::brief;
use super::{CaptureError, STANDARD_GRAVITY};

/// Unit of a gyro channel that holds the angle.
pub(super) const ANGLE: &str = "deg";
/// Cells as the part delivers them.
pub(super) const COUNTS: &str = "counts";

/// One name of each unit, and the others that it has in headers and papers, in small letters.
const SPELLINGS: [(&str, &[&str]); 26] = [
    (
        "deg/s",
        &[
            "dps",
            "°/s",
            "º/s",
            "deg/sec",
            "degrees/s",
            "degree/s",
            "deg s^-1",
            "° s^-1",
            "deg_s",
            "degs",
        ],
    ),
    (
        "rad/s",
        &[
            "rad/sec",
            "radians/s",
            "rad s^-1",
            "rad·s^-1",
            "radps",
            "rad_s",
            "rads",
        ],
    ),
    ("mrad/s", &["mrad s^-1"]),
    ("mdps", &["mdeg/s", "m°/s"]),
    ("deg/h", &["deg/hr", "°/h", "°/hr", "º/h", "dph"]),
    ("deg", &["°", "º", "degrees"]),
    ("rad", &["radians"]),
    ("arcsec", &["\"", "as"]),
    (
        "m/s2",
        &[
            "m/s^2", "m/(s^2)", "m/s²", "m/s/s", "m s^-2", "m·s^-2", "mps2", "m_s2", "ms2", "ms^-2",
        ],
    ),
    ("g", &["g0", "gee"]),
    ("mg", &[]),
    ("degC", &["°c", "ºc", "℃", "degc", "deg c", "c", "celsius"]),
    ("K", &["k", "kelvin"]),
    ("degF", &["°f", "ºf", "℉", "deg f", "f", "fahrenheit"]),
    ("V", &["v", "volt", "volts"]),
    ("mV", &["mv"]),
    ("s", &["sec", "secs", "second", "seconds"]),
    ("ms", &["msec", "millis", "milliseconds"]),
    ("us", &["µs", "μs", "usec", "micros", "microseconds"]),
    ("ns", &["nsec", "nanos", "nanoseconds"]),
    ("min", &["minute", "minutes"]),
    ("h", &["hr", "hrs", "hour", "hours"]),
    (COUNTS, &["lsb", "raw", "count"]),
    ("1", &["-"]),
    ("%", &["percent"]),
    ("fraction", &[]),
];

/// Our name of a unit; `None` where it is none of those known.
pub(super) fn known(text: &str) -> Option<&'static str> {
    let text = text.trim().to_lowercase().replace('−', "-");
    SPELLINGS
        .iter()
        .find(|(name, others)| name.to_lowercase() == text || others.contains(&text.as_str()))
        .map(|(name, _)| *name)
}

/// What a column's name says of its unit, in brackets at its end: `Gyroscope x (rad/s)`, `timestamp [ns]`. The name
/// without it, and the unit.
pub(super) fn in_brackets(name: &str) -> (&str, Option<&'static str>) {
    let split = || {
        let open = name.rfind(['(', '[', '{'])?;
        let inner = name
            .get(open + 1..)?
            .trim_end()
            .strip_suffix([')', ']', '}'])?;
        let stem = name[..open].trim_end();
        (!stem.is_empty()).then_some((stem, known(inner).filter(|unit| *unit != "1")?))
    };
    split().map_or((name, None), |(stem, unit)| (stem, Some(unit)))
}

/// What the end of a column's name says of the unit of what it is mapped to: `gx_dps`, `t_ms`, `ax_mps2`.
pub(super) fn at_the_end(name: &str, what: What) -> Option<&'static str> {
    let name = name.to_lowercase();
    // A number in brackets multiplies the unit: `(0.01 deg/s)`.
    let inner = name.trim_end().strip_suffix([')', ']', '}']);
    let inner = inner.and_then(|name| Some(&name[name.rfind(['(', '[', '{'])? + 1..]));
    if inner.is_some_and(|unit| unit.trim_start().starts_with(|c: char| c.is_ascii_digit())) {
        return None;
    }
    let name = name.trim_end_matches(|c: char| !c.is_alphanumeric());
    // A time may be called by its unit: `millis`, `micros`.
    if let (What::Time, Some(unit)) = (what, known(name).filter(|unit| is_unit_of(unit, what))) {
        return Some(unit);
    }
    // `TimeUS`, `timestampMs`.
    let of_stamp = |unit: &&str| {
        let stem = name.strip_suffix(*unit);
        stem.is_some_and(|stem| stem.ends_with("time") || stem.ends_with("stamp"))
    };
    if what == What::Time
        && let Some(unit) = ["ms", "us", "ns"].into_iter().find(|unit| of_stamp(unit))
    {
        return Some(unit);
    }
    // From the longest ending on: `deg_s` before `s`.
    name.match_indices(['_', ' ', '.'])
        .filter_map(|(at, _)| known(&name[at + 1..]))
        .find(|unit| is_unit_of(unit, what))
}

/// What a unit is of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum What {
    /// Of the time column.
    Time,
    /// Of a channel.
    Channel(Quantity),
}

impl What {
    /// In a sentence.
    fn in_words(self) -> &'static str {
        match self {
            Self::Time => "time",
            Self::Channel(Quantity::Gyro) => "an angular rate",
            Self::Channel(Quantity::Acc) => "an acceleration",
            Self::Channel(Quantity::Temp) => "a temperature",
            Self::Channel(Quantity::Supply) => "a voltage",
            Self::Channel(Quantity::Pwm) => "a motor command",
            Self::Channel(Quantity::Other | Quantity::Derived) => "this channel",
        }
    }
}

/// How cells become values of ours: value = (cell - zero) * scale, in `unit`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Conversion {
    pub unit: String,
    pub zero: f64,
    pub scale: f64,
    /// Whether the unit is a number of others: what a count is.
    pub is_multiple: bool,
}

impl Conversion {
    fn by(unit: &str, zero: f64, scale: f64) -> Self {
        Self {
            unit: unit.to_owned(),
            zero,
            scale,
            is_multiple: false,
        }
    }

    /// What the cells are. Counts of an angle are differenced, and none of what is read.
    pub fn held(&self, quantity: Quantity) -> Held {
        let of_rate = matches!(quantity, Quantity::Gyro | Quantity::Acc) && self.unit != ANGLE;
        if self.is_multiple && of_rate {
            Held::Scaled
        } else {
            Held::Values
        }
    }
}

/// How one of [`known`] becomes the unit of ours; `None` where it is of another quantity.
fn scale(what: What, unit: &str) -> Option<Conversion> {
    const DEGREES: f64 = 180.0 / std::f64::consts::PI;
    let table: &[(&str, &str, f64)] = match what {
        What::Time => &[
            ("s", "s", 1.0),
            ("ms", "s", 1e-3),
            ("us", "s", 1e-6),
            ("ns", "s", 1e-9),
            ("min", "s", 60.0),
            ("h", "s", 3600.0),
        ],
        What::Channel(Quantity::Gyro) => &[
            ("deg/s", "deg/s", 1.0),
            ("rad/s", "deg/s", DEGREES),
            ("mrad/s", "deg/s", DEGREES * 1e-3),
            ("mdps", "deg/s", 1e-3),
            ("deg/h", "deg/s", 1.0 / 3600.0),
            // Angles: what is read is differenced into a rate.
            ("deg", ANGLE, 1.0),
            ("rad", ANGLE, DEGREES),
            ("arcsec", ANGLE, 1.0 / 3600.0),
        ],
        What::Channel(Quantity::Acc) => &[
            ("m/s2", "m/s^2", 1.0),
            ("g", "m/s^2", STANDARD_GRAVITY),
            ("mg", "m/s^2", STANDARD_GRAVITY * 1e-3),
        ],
        What::Channel(Quantity::Temp) => {
            return match unit {
                "degC" => Some(Conversion::by("degC", 0.0, 1.0)),
                "K" => Some(Conversion::by("degC", 273.15, 1.0)),
                "degF" => Some(Conversion::by("degC", 32.0, 5.0 / 9.0)),
                _ => None,
            };
        }
        What::Channel(Quantity::Supply) => &[("V", "V", 1.0), ("mV", "V", 1e-3)],
        What::Channel(Quantity::Pwm) => &[
            ("1", "1", 1.0),
            ("%", "1", 0.01 * FULL_DUTY),
            ("fraction", "1", FULL_DUTY),
        ],
        What::Channel(Quantity::Other | Quantity::Derived) => &[],
    };
    table
        .iter()
        .find(|(name, ..)| *name == unit)
        .map(|(_, ours, factor)| Conversion::by(ours, 0.0, *factor))
}

/// Whether one of [`known`] is a unit of this.
pub(super) fn is_unit_of(unit: &str, what: What) -> bool {
    scale(what, unit).is_some()
}

/// Whether a unit is one of an angle.
pub(super) fn is_angle(unit: &str) -> bool {
    let gyro = What::Channel(Quantity::Gyro);
    let by = known(unit).and_then(|unit| scale(gyro, unit));
    by.is_some_and(|by| by.unit == ANGLE)
}

/// How a number of units, as what one count is (`0.0076deg/s`), becomes the unit of ours.
fn multiple(what: What, given: &str) -> Option<Conversion> {
    if !given.starts_with(|c: char| c.is_ascii_digit() || c == '.') {
        return None;
    }
    let ends = given.char_indices().rev().map(|(at, _)| at);
    let (at, number) = ends
        .into_iter()
        .find_map(|at| Some((at, given[..at].parse::<f64>().ok()?)))?;
    let unit = given[at..].trim_start();
    if !(number > 0.0 && number.is_finite()) {
        return None;
    }
    let one = scale(what, known(unit)?)?;
    (one.zero == 0.0).then(|| Conversion {
        is_multiple: true,
        ..Conversion::by(&one.unit, 0.0, one.scale * number)
    })
}

/// The unit that is taken where none is said.
pub(super) fn usual(what: What) -> &'static str {
    match what {
        What::Time => "s",
        What::Channel(Quantity::Gyro) => "deg/s",
        What::Channel(Quantity::Acc) => "m/s^2",
        What::Channel(Quantity::Temp) => "degC",
        What::Channel(Quantity::Supply) => "V",
        What::Channel(Quantity::Pwm | Quantity::Other | Quantity::Derived) => "1",
    }
}

/// How cells in a unit given become values of ours.
///
/// # Errors
/// [`CaptureError::Option`] where it is none of this quantity.
pub(super) fn convert(what: What, given: Option<&str>) -> Result<Conversion, CaptureError> {
    let Some(given) = given else {
        return Ok(Conversion::by(usual(what), 0.0, 1.0));
    };
    if what == What::Channel(Quantity::Other) {
        return Ok(Conversion::by(given, 0.0, 1.0));
    }
    let found = known(given).and_then(|unit| scale(what, unit));
    found.or_else(|| multiple(what, given)).ok_or_else(|| CaptureError::Option {
        option: "--units",
        why: format!("`{}` is no unit of {}", brief(given), what.in_words()),
        help: "time: s, ms, us, ns; gyro: deg/s, rad/s, mrad/s, deg/h, mdps, or of an angle deg, rad, arcsec; acc: m/s2, g, \
               mg; temp: degC, K, degF; supply: V, mV; pwm: 1 (-255 to 255), % or fraction (of the full command); a number \
               before it multiplies it, as for counts of 131 a deg/s: gyro=0.00763deg/s"
            .to_owned(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_say_their_units_in_brackets_or_at_their_ends_and_an_index_is_none() {
        for (name, stem, unit) in [
            ("Gyroscope x (rad/s)", "Gyroscope x", Some("rad/s")),
            ("timestamp [ns]", "timestamp", Some("ns")),
            ("w_RS_S_x [rad s^-1]", "w_RS_S_x", Some("rad/s")),
            ("a_RS_S_x [m s^-2]", "a_RS_S_x", Some("m/s2")),
            ("Gyro(°/s)", "Gyro", Some("deg/s")),
            ("gyr[0]", "gyr[0]", None),
            ("gyr[1]", "gyr[1]", None),
            ("(s)", "(s)", None),
        ] {
            assert_eq!(in_brackets(name), (stem, unit), "{name}");
        }
        let gyro = What::Channel(Quantity::Gyro);
        let acc = What::Channel(Quantity::Acc);
        for (name, what, unit) in [
            ("gx_dps", gyro, Some("deg/s")),
            ("gyro_x_deg_s", gyro, Some("deg/s")),
            ("t_ms", What::Time, Some("ms")),
            ("micros", What::Time, Some("us")),
            ("ChipTimeUS", What::Time, Some("us")),
            ("timestampMs", What::Time, Some("ms")),
            ("times", What::Time, None),
            ("status", What::Time, None),
            ("ax_mps2", acc, Some("m/s2")),
            ("acc_x_g", acc, Some("g")),
            ("gyro_g", gyro, None),
            ("gyro_x (0.01 deg/s)", gyro, None),
            ("gyro_x (in deg/s)", gyro, Some("deg/s")),
            ("gx", gyro, None),
        ] {
            assert_eq!(at_the_end(name, what), unit, "{name}");
        }
    }

    #[test]
    fn every_spelling_means_one_unit() {
        for (name, others) in SPELLINGS {
            assert_eq!(known(name), Some(name));
            for other in others {
                assert_eq!(known(other), Some(name), "{other}");
            }
        }
        let temp = What::Channel(Quantity::Temp);
        for (unit, cell) in [("°C", 20.0), ("K", 293.15), ("°F", 68.0)] {
            let by = convert(temp, Some(unit)).unwrap();
            let value = (cell - by.zero) * by.scale;
            assert!((value - 20.0).abs() < 1e-9, "{unit}: {value}");
        }
        let gyro = What::Channel(Quantity::Gyro);
        assert!(convert(gyro, Some("furlong/s")).is_err());
        assert!(convert(gyro, Some("UNIT")).is_err());
        assert!(convert(What::Time, Some("deg/s")).is_err());
    }

    #[test]
    fn a_number_before_a_unit_is_what_one_count_is() {
        let gyro = What::Channel(Quantity::Gyro);
        for (what, given, unit, scale) in [
            (gyro, "0.07326deg/s", "deg/s", 0.07326),
            (gyro, "1e-3 rad/s", "deg/s", 0.180 / std::f64::consts::PI),
            (What::Time, "0.1ms", "s", 1e-4),
            (What::Channel(Quantity::Temp), "0.1453degC", "degC", 0.1453),
        ] {
            let by = convert(what, Some(given)).expect(given);
            assert_eq!(by.unit, unit, "{given}");
            assert!((by.scale / scale - 1.0).abs() < 1e-12, "{given}: {by:?}");
        }
        // The zero of a scale is not known; no number, none above 0, no unit.
        for given in [
            "0.1K",
            "x deg/s",
            "0deg/s",
            "infdeg/s",
            "-1deg/s",
            "1e999deg/s",
            "0.1",
        ] {
            let what = match given.ends_with('K') {
                true => What::Channel(Quantity::Temp),
                false => gyro,
            };
            assert!(convert(what, Some(given)).is_err(), "{given}");
        }
    }
}
