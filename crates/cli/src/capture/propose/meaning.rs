//! What the names of columns most probably mean.

use model::record::Quantity;

use super::super::conventions::DATAFLASH;
use super::super::units::{What, at_the_end, in_brackets, is_angle, is_unit_of, known};
use super::words::{TURNS, axis_of, words};

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    Time,
    Date,
    Gyro,
    Acc,
    Temp,
    /// An axis of nobody knows what.
    Bare,
    Unknown,
}

#[derive(Debug)]
pub(super) struct Meaning {
    pub kind: Kind,
    pub axis: Option<usize>,
    pub is_seconds: bool,
}

/// What the names of a file most probably mean, together: axes may be counted from 1 on, or be flight's p, q, r.
pub(super) fn meanings(names: &[String]) -> Vec<Meaning> {
    let mut meanings: Vec<Meaning> = names.iter().map(|name| Meaning::of(name)).collect();
    for kind in [Kind::Gyro, Kind::Acc, Kind::Bare] {
        let has = |axis| (meanings.iter()).any(|m| m.kind == kind && m.axis == Some(axis));
        // Only what is counted reaches 3.
        if has(3) && !has(0) {
            let of_kind = meanings.iter_mut().filter(|m| m.kind == kind);
            of_kind.for_each(|m| m.axis = m.axis.map(|axis| axis - 1));
        }
    }
    // Beside rates, what is in counts is the same as it came, and what is in an angle is the attitude.
    let unit = |at: usize| in_brackets(&names[at]).1;
    let is_rate = |unit| is_unit_of(unit, What::Channel(Quantity::Gyro)) && !is_angle(unit);
    let gyros = (0..names.len()).filter(|at| meanings[*at].kind == Kind::Gyro);
    let (rates, others): (Vec<usize>, Vec<usize>) = gyros
        .filter(|at| unit(*at).is_some())
        .partition(|at| unit(*at).is_some_and(is_rate));
    if !rates.is_empty() {
        others
            .iter()
            .for_each(|at| meanings[*at].kind = Kind::Unknown);
    }
    // ArduPilot's IMU has one letter for its temperature.
    if names.iter().any(|name| name == DATAFLASH)
        && let Some(at) = names.iter().position(|name| name == "T")
    {
        meanings[at].kind = Kind::Temp;
    }
    let at = |letter: &str| {
        (names.iter()).position(|name| in_brackets(name).0.eq_ignore_ascii_case(letter))
    };
    if let [Some(p), Some(q), Some(r)] = ["p", "q", "r"].map(at) {
        for (axis, at) in [p, q, r].into_iter().enumerate() {
            (meanings[at].kind, meanings[at].axis) = (Kind::Gyro, Some(axis));
        }
    }
    meanings
}

impl Meaning {
    /// What a name most probably means; one within a group by itself, where the group tells nothing.
    pub fn of(name: &str) -> Self {
        let whole = Self::of_word(name);
        match name.rsplit_once(['.', '/']) {
            Some((_, last)) if whole.kind == Kind::Unknown && in_brackets(name).1.is_none() => {
                Self::of_word(last)
            }
            _ => whole,
        }
    }

    fn of_word(name: &str) -> Self {
        let words = words(in_brackets(name).0);
        // Of a letter and a number, the number counts sensors.
        let is_number = |word: &&String| word.ends_with(|c: char| c.is_ascii_digit());
        let axis = words
            .iter()
            .rev()
            .filter(|w| !is_number(w))
            .find_map(|w| axis_of(w));
        let axis = axis.or_else(|| words.iter().rev().find_map(|word| axis_of(word)));
        let is = |starts: &[&str]| (words.iter()).any(|w| starts.iter().any(|s| w.starts_with(s)));
        let first = words.first().map_or("", String::as_str);
        // The number of a sensor stands behind two letters: `gx1`.
        let bare = first.trim_end_matches(|c: char| c.is_ascii_digit());
        let letters = |list: &[&str]| list.contains(if bare.len() > 1 { &bare } else { &first });
        let is_seconds = known(first) == Some("s");
        let is_of_time =
            words.len() == 1 && known(first).is_some_and(|unit| is_unit_of(unit, What::Time));
        let unit = in_brackets(name).1;
        let unit_is_of = |what| unit.is_some_and(|unit| is_unit_of(unit, what));
        let is_stamp =
            || is(&["time", "stamp"]) && at_the_end(in_brackets(name).0, What::Time).is_some();
        let is_time_of =
            CLOCKS.contains(&first) && words.get(1).is_some_and(|w| w.starts_with("time"));
        let is_called_time = is_time_of || TIME.iter().any(|s| first.starts_with(s));
        let kind = if unit_is_of(What::Channel(Quantity::Temp)) {
            Kind::Temp
        } else if (is_called_time && unit_is_of(What::Time)) || is(&["timestamp"]) {
            Kind::Time
        } else if is(&["user"]) && is(&["acc"]) {
            // What a phone has left of its acceleration without gravity.
            Kind::Unknown
        } else if is(&["mag", "quat", "orient", "gravity", "euler", "tick"]) {
            Kind::Unknown
        } else if is(&[
            "gyr",
            "angular",
            "angul",
            "omega",
            "rot",
            "rate",
            "dreh",
            "winkelg",
            "角速度",
            "ジャイロ",
        ]) || letters(&["g", "w", "gx", "gy", "gz", "wx", "wy", "wz"])
        {
            Kind::Gyro
        } else if is(&["acc", "linear", "beschl", "加速度"])
            || letters(&["a", "ac", "ax", "ay", "az"])
        {
            Kind::Acc
        } else if (is(&["temp", "温度"]) || letters(&["tmp"])) && !TEMPS.contains(&first) {
            Kind::Temp
        } else if is_called_time
            || first == "t"
            || is_seconds
            || is_of_time
            || unit_is_of(What::Time)
            || is_stamp()
        {
            Kind::Time
        } else if first == "date" || first == "utc" {
            Kind::Date
        } else if unit_is_of(What::Channel(Quantity::Gyro)) {
            Kind::Gyro
        } else if unit_is_of(What::Channel(Quantity::Acc)) {
            Kind::Acc
        } else if axis.is_some() && words.len() == 1 && !TURNS.contains(&first) {
            Kind::Bare
        } else {
            Kind::Unknown
        };
        Self {
            kind,
            axis,
            is_seconds,
        }
    }
}

/// What a time may be of.
const CLOCKS: [&str; 15] = [
    "elapsed",
    "rtc",
    "chip",
    "host",
    "board",
    "sample",
    "system",
    "sys",
    "device",
    "sensor",
    "unix",
    "utc",
    "local",
    "log",
    "recording",
];
/// How the name of a time begins.
const TIME: [&str; 9] = [
    "time", "zeit", "stamp", "epoch", "datetime", "temps", "tiempo", "時刻", "時間",
];
/// Those that begin as a temperature does.
const TEMPS: [&str; 2] = ["temps", "tempo"];
