//! A mapping in words: options as a shell takes them, and what they leave to the reader.

use crate::text::shell_word;

use super::super::angle::Angle;
use super::super::carried::{raw_imu, razor};
use super::super::columns::Said;
use super::super::error::{brief, brief_list};
use super::super::mapped::place;
use super::super::units::{COUNTS, is_angle};
use super::super::{CaptureError, ColumnMapping};
use super::seen::Seen;
use super::{Guess, alias, guess};

/// Bytes of a name beyond which its number is easier to write.
const LONG: usize = 80;
/// Stands where a unit has to be put in: no unit is called so, and a mapping with it is refused.
const UNIT: &str = "UNIT";
/// The time in files of Xsens and Movella, whose programs have two units for the same names.
const OF_XSENS: &str = "SampleTimeFine";
/// Stands where nothing says which column is meant.
const COLUMN: &str = "COLUMN";

/// `--columns ... --units ...`, and what it leaves open.
pub(super) struct Proposal {
    pub line: String,
    /// Keys of `--units` whose unit neither the file nor a convention says.
    pub open: Vec<&'static str>,
    /// A name that two columns have, one of them in it.
    pub twice: Option<String>,
    /// What else has to be known of the columns.
    pub hints: Vec<String>,
}

/// A mapping made of a file's column names. `numbered` says that the names are made up, and columns are called by their
/// numbers; `knows_rate` that the sample rate is known without times.
#[cfg(test)]
pub(super) fn proposal(
    names: &[String],
    numbered: bool,
    knows_rate: bool,
    seen: &Seen,
) -> Proposal {
    let guess = guess(names, numbered, seen);
    line_of(&guess, &[], names, &[], numbered, knows_rate)
}

/// What was asked for, where a column of it is not there: the file's best guess stands in its place, and the time beside it, which
/// the rows need.
fn asked(guess: Guess, said: &Said<'_>, mapping: &ColumnMapping, knows_rate: bool) -> Guess {
    let ours = |given: &str| alias(given).unwrap_or_else(|| given.to_owned());
    let there: Vec<Option<usize>> = (mapping.columns.iter())
        .map(|(_, theirs)| place(said, theirs))
        .collect();
    let is_free = |at: &usize| !there.contains(&Some(*at));
    let guessed = |name: &str| {
        let column = guess.columns.iter().find(|(guessed, _)| guessed == name);
        column.map(|(_, at)| *at).filter(is_free)
    };
    let mut columns: Vec<(String, usize)> = (mapping.columns.iter().zip(&there))
        .map(|((given, _), at)| {
            let at = at.or_else(|| guessed(&ours(given)));
            (given.clone(), at.unwrap_or(usize::MAX))
        })
        .collect();
    let is_time = |given: &str| matches!(ours(given).as_str(), "time" | "host_time_s");
    if !knows_rate
        && !columns.iter().any(|(given, _)| is_time(given))
        && let Some(at) = guessed("time")
    {
        columns.insert(0, ("time".to_owned(), at));
    }
    let is_asked = |key: &str| {
        columns
            .iter()
            .any(|(given, _)| ours(given).starts_with(key))
    };
    let is_given = |key: &str| {
        let given = mapping.units.iter();
        given.map(|(given, _)| given).any(|given| given == key)
    };
    let units = guess.units.into_iter();
    let units = units
        .filter(|(key, _)| is_asked(key) && !is_given(key))
        .collect();
    Guess {
        columns,
        units,
        is_ambiguous: guess.is_ambiguous,
        is_bare: guess.is_bare,
        second: Vec::new(),
    }
}

/// Options of a mapping, with units that were `given` before those that are guessed; what the file says of units elsewhere is
/// taken as it is.
fn line_of(
    guess: &Guess,
    given: &[(String, String)],
    names: &[String],
    units_said: &[Option<String>],
    numbered: bool,
    knows_rate: bool,
) -> Proposal {
    let is_twice = |name: &String| names.iter().filter(|other| *other == name).count() > 1;
    let twice = guess.columns.iter().filter_map(|(_, at)| names.get(*at));
    let twice = twice
        .filter(|_| !numbered)
        .find(|name| is_twice(name))
        .cloned();
    let column = |(ours, at): &(String, usize)| {
        let Some(name) = names.get(*at) else {
            return format!("{ours}={COLUMN}");
        };
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
    let name_of = |key: &str| {
        let of = (guess.columns.iter()).find(|(ours, _)| ours.starts_with(key));
        let name = of.and_then(|(_, at)| names.get(*at));
        name.map_or("", String::as_str)
    };
    let (mut open, mut hints) = (Vec::new(), Vec::new());
    let mut units: Vec<String> = (given.iter())
        .map(|(key, unit)| format!("{key}={unit}"))
        .collect();
    for (key, said) in &guess.units {
        // Lines before the table say it, or a row of units.
        let stated = (guess.columns.iter()).find(|(ours, _)| ours.starts_with(key));
        let stated = stated.and_then(|(_, at)| units_said.get(*at)?.as_deref());
        match (*key, said.or(stated.filter(|unit| *unit != COUNTS))) {
            // Seconds go without saying; other times are guessed by nobody.
            ("time", None) if is_bosch(name_of("time")) => {
                open.push("time");
                units.push(format!("time={UNIT}"));
                hints.push(OF_BOSCH.to_owned());
            }
            ("time", None | Some("s")) => {}
            ("gyro", Some(unit)) if is_angle(unit) => {
                open.push("angle");
                units.push(format!("gyro={UNIT}"));
                hints.push(format!(
                    "put in the unit, as {unit} is an angle's ({})",
                    Angle::of(name_of("gyro")).help(unit)
                ));
            }
            (key, Some(unit)) => units.push(format!("{key}={unit}")),
            ("freq", None) => units.push("freq=1".to_owned()),
            (key, None) => {
                let is_angle = || Angle::of(name_of("gyro")) == Angle::Attitude;
                if key == "gyro" && is_angle() {
                    hints.push(format!(
                        "so called are angles, most often: {}",
                        Angle::Attitude.help("deg")
                    ));
                }
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
    hints.extend(hints_of(guess, numbered, &column));
    if open.contains(&"gyro") {
        hints.extend(hints_of_unit(names));
    }
    Proposal {
        line,
        open,
        twice,
        hints,
    }
}

/// Names of what is in counts whose size the reader has to look up, and where.
const OF_COUNTS: [(&str, &str); 2] = [
    (
        raw_imu::GYRO,
        "a count is an increment over one sample of the IMU, and its size depends on the type of the IMU: take the scale from \
         the table `Raw IMU Scale Factors` of the receiver's manual, times the samples a second that the manual gives for the \
         type (an LN200: 2^-19 rad times 200 Hz, `gyro=0.00038147rad/s`; 2^-14 m/s times 200 Hz, `acc=0.012207m/s2`)",
    ),
    (
        razor::GYRO,
        "what a count is depends on the board: with the ITG-3200 `gyro=0.0695652deg/s` (14.375 counts a deg/s), with the \
         ADXL345 `acc=0.00390625g` (256 counts a g); others by their data sheets",
    ),
];

/// What is known of a `sensor_time`: data sheets of BMI088 and BMI160, and Bosch's drivers of BMI270.
const OF_BOSCH: &str = "put in the unit of the time: the `sensor_time` of Bosch's BMI parts counts `time=39.0625us`; of another \
                        sensor see its data sheet";

/// Whether a time has the name of the counter in Bosch's parts.
fn is_bosch(name: &str) -> bool {
    let letters = name.chars().filter(char::is_ascii_alphabetic);
    letters
        .collect::<String>()
        .eq_ignore_ascii_case("sensortime")
}

/// What is known of the unit of a gyro by the names of the columns.
fn hints_of_unit(names: &[String]) -> impl Iterator<Item = String> {
    let of_xsens = names.iter().any(|name| name == OF_XSENS).then_some(
        "with these names MT Manager writes rad/s and `time=0.1ms`, the app of the DOT deg/s and `time=us`",
    );
    let is_there = |start: &str| names.iter().any(|name| name.starts_with(start));
    let of_counts = OF_COUNTS.iter().filter(move |(start, _)| is_there(start));
    let of_counts = of_counts.map(|(_, hint)| *hint);
    of_xsens.into_iter().chain(of_counts).map(str::to_owned)
}

/// What else has to be known of the columns.
fn hints_of(
    guess: &Guess,
    numbered: bool,
    column: &dyn Fn(&(String, usize)) -> String,
) -> Vec<String> {
    let mut hints = Vec::new();
    if guess.columns.iter().any(|(_, at)| *at == usize::MAX) && numbered {
        hints.push(format!(
            "put in each {COLUMN}: their order says no sensor, and none reads gravity in a unit"
        ));
    }
    if guess.is_bare {
        hints.push("x, y, z may be of any sensor: of an accelerometer write acc_x, acc_y, acc_z; a phone's gyro is in rad/s".to_owned());
    }
    if guess
        .second
        .iter()
        .any(|(ours, _)| ours.starts_with("gyro"))
    {
        let second: Vec<String> = guess.second.iter().map(column).collect();
        hints.push(format!(
            "the file has a second gyro: read it in a run of its own, with {} in place of the first",
            shell_word(&second.join(","))
        ));
    }
    hints
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
    mapping: &ColumnMapping,
    knows_rate: bool,
    seen: &Seen,
) -> CaptureError {
    let CaptureError::Columns { why, columns, .. } = error else {
        return error;
    };
    if let Some(name) = said.names.iter().find(|name| is_labelled(name)) {
        return CaptureError::NoText {
            what: format!(
                "a text whose rows repeat the names of their readings (`{}`)",
                brief(name)
            ),
            help: LABELLED.to_owned(),
        };
    }
    let is_there = |(_, theirs): &(String, String)| place(said, theirs).is_some();
    let lacks_one = !mapping.columns.iter().all(is_there);
    if lacks_one && said.lines.get("format").is_some() {
        return CaptureError::Option {
            option: "--columns",
            why: format!("{why}; the columns are: {}", columns.join(", ")),
            help: "leave it out: the file is a capture, and all of its columns are read".to_owned(),
        };
    }
    let Proposal {
        line,
        open,
        twice,
        hints,
    } = {
        let mut found = guess(said.names, said.numbered, seen);
        if lacks_one {
            found = asked(found, said, mapping, knows_rate);
        }
        // What was given is not asked for again.
        let given = &mapping.units[..];
        let is_open = |key: &str| !given.iter().any(|(known, _)| known == key);
        found.units.retain(|(key, _)| is_open(key));
        let numbered = said.numbered;
        line_of(&found, given, said.names, said.units, numbered, knows_rate)
    };
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
    hints.iter().for_each(|of| hint += &format!("; {of}"));
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

/// What to do with rows that repeat their names.
const LABELLED: &str = "write the names once, in a first line, and below it numbers alone; of a log that is there already \
                        `sed -E 's/[A-Za-z_ ]+[:=] *//g; s/ *[|] */,/g' LOG > log.csv` leaves the numbers";

/// Whether what should be a column's name has its reading in it, as sketches of microcontrollers print it: `AccelX:0.09`,
/// `AcX = 213`.
fn is_labelled(name: &str) -> bool {
    let is_number = |text: &str| {
        let first = text.split_whitespace().next();
        first.is_some_and(|word| word.parse::<f64>().is_ok())
    };
    let parts = name.split_once([':', '=']);
    let has_reading = parts
        .is_some_and(|(label, value)| label.chars().any(char::is_alphabetic) && is_number(value));
    name == "=" || has_reading
}

/// The units from which to choose.
fn choices(key: &str) -> Option<&'static str> {
    match key {
        "gyro" => {
            Some("gyro: deg/s, rad/s as phones and ROS have it, or what a count is: `0.0076deg/s`")
        }
        "acc" => Some("acc: m/s2, g, mg, or what a count is"),
        "temp" => Some(
            "temp: degC, or what a count is, `0.1degC`; leave temp out where 0 counts are not 0 degC",
        ),
        _ => None,
    }
}
