//! The mapping that is proposed for a file whose columns have other names than ours.

use model::record::Quantity;

use crate::text::shell_word;

use super::conventions::unit_of;
use super::units::{What, in_brackets, is_unit_of, known};

const AXES: [&str; 3] = ["x", "y", "z"];
/// Bytes of a name beyond which its number is easier to write.
const LONG: usize = 80;

/// What the columns of a file most probably are.
pub(super) struct Guess {
    /// Our name, and the place of the column.
    pub columns: Vec<(String, usize)>,
    /// Key of `--units`, and the unit that the file or a convention says; nothing inside where neither does.
    pub units: Vec<(&'static str, Option<&'static str>)>,
    /// Whether another column could be one of them, or a gyro's may be something else: the choice is then not ours.
    pub is_ambiguous: bool,
}

impl Guess {
    fn add(&mut self, names: &[String], ours: &str, at: usize, what: What) {
        self.columns.push((ours.to_owned(), at));
        let key = match what {
            What::Time => "time",
            What::Channel(Quantity::Gyro) => "gyro",
            What::Channel(Quantity::Acc) => "acc",
            What::Channel(_) => return,
        };
        // The unit of a quantity is that of its first column.
        if !self.units.iter().any(|(k, _)| *k == key) {
            self.units.push((key, unit_of(&names[at], what, names)));
        }
    }
}

/// What the columns of a file most probably are, by their names. `numbered` says that the names are made up.
pub(super) fn guess(names: &[String], numbered: bool) -> Guess {
    let mut guess = Guess {
        columns: Vec::new(),
        units: Vec::new(),
        is_ambiguous: false,
    };
    if numbered {
        guess_by_number(names, &mut guess);
    } else {
        guess_by_name(names, &mut guess);
    }
    guess
}

/// As such files usually are: three gyros, three accelerometers, a time before them where the number is odd.
fn guess_by_number(names: &[String], guess: &mut Guess) {
    let first = usize::from(names.len() > 3 && names.len() != 6);
    if first == 1 {
        guess.add(names, "time", 0, What::Time);
    }
    for (k, axis) in AXES.iter().enumerate().take(names.len() - first) {
        let gyro = What::Channel(Quantity::Gyro);
        guess.add(names, &format!("gyro_{axis}"), first + k, gyro);
    }
    if names.len() >= first + 6 {
        for (k, axis) in AXES.iter().enumerate() {
            let acc = What::Channel(Quantity::Acc);
            guess.add(names, &format!("acc_{axis}"), first + 3 + k, acc);
        }
    }
}

fn guess_by_name(names: &[String], guess: &mut Guess) {
    let meanings = meanings(names);
    let time = |with_unit: bool| {
        meanings.iter().zip(names).position(|(m, name)| {
            let says = || unit_of(name, What::Time, names).is_some();
            m.kind == Kind::Time && (!with_unit || says() || m.is_seconds)
        })
    };
    if let Some(at) = time(true).or_else(|| time(false)) {
        guess.add(names, "time", at, What::Time);
    }
    let find = |kind: Kind, axis: usize| {
        (meanings.iter()).position(|m| m.kind == kind && m.axis == Some(axis))
    };
    let has_gyro = (0..3).any(|axis| find(Kind::Gyro, axis).is_some());
    let has_acc = (0..3).any(|axis| find(Kind::Acc, axis).is_some());
    // Bare x, y, z are what the file is about, and most often a gyro here.
    let gyro = if has_gyro || has_acc {
        Kind::Gyro
    } else {
        Kind::Bare
    };
    guess.is_ambiguous |= gyro == Kind::Bare;
    for (kind, stem, quantity) in [
        (gyro, "gyro", Quantity::Gyro),
        (Kind::Acc, "acc", Quantity::Acc),
    ] {
        for (k, axis) in AXES.iter().enumerate() {
            if let Some(at) = find(kind, k) {
                let same = |m: &&Meaning| m.kind == kind && m.axis == Some(k);
                guess.is_ambiguous |= meanings.iter().filter(same).count() > 1;
                guess.add(
                    names,
                    &format!("{stem}_{axis}"),
                    at,
                    What::Channel(quantity),
                );
            }
        }
    }
    if let Some(at) = meanings.iter().position(|m| m.kind == Kind::Temp) {
        guess.add(names, "temp", at, What::Channel(Quantity::Temp));
    }
    if !has_gyro && !has_acc && (0..3).all(|axis| find(Kind::Bare, axis).is_none()) {
        // A gyro without an axis; or nothing is recognized: the form of a mapping, with the first column that is no time.
        let first = |wanted: fn(Kind) -> bool| meanings.iter().position(|m| wanted(m.kind));
        if let Some(at) = first(|k| k == Kind::Gyro).or_else(|| first(|k| k != Kind::Time)) {
            guess.add(names, "gyro_x", at, What::Channel(Quantity::Gyro));
        }
    }
}

/// `--columns ... --units ...` made of a file's column names, as a shell takes them, and whether a unit in it is a guess.
/// `numbered` says that the names are made up, and columns are called by their numbers.
pub(super) fn proposal(names: &[String], numbered: bool) -> (String, bool) {
    let guess = guess(names, numbered);
    let column = |(ours, at): &(String, usize)| {
        let name = &names[*at];
        // What would be taken for the list's own commas goes by its number.
        if numbered || name.contains(',') || name.len() > LONG {
            format!("{ours}={}", at + 1)
        } else {
            format!("{ours}={name}")
        }
    };
    let mut is_guessed = false;
    let unit = |(key, said): &(&str, Option<&str>)| {
        let unit = match (*key, *said) {
            // Seconds go without saying; other times are guessed by nobody.
            ("time", None | Some("s")) => return None,
            (_, Some(unit)) => unit,
            ("gyro", None) => "deg/s",
            (_, None) => "m/s2",
        };
        is_guessed |= said.is_none();
        Some(format!("{key}={unit}"))
    };
    let units: Vec<String> = guess.units.iter().filter_map(unit).collect();
    let columns: Vec<String> = guess.columns.iter().map(column).collect();
    let columns = shell_word(&columns.join(","));
    if units.is_empty() {
        return (format!("--columns {columns}"), false);
    }
    let units = shell_word(&units.join(","));
    (format!("--columns {columns} --units {units}"), is_guessed)
}

/// The name of ours that another spelling of it can only mean: `temperature`, `GyroX`, `accel_z`, `t`. `None` for names
/// that are ours already, and for all others.
pub(super) fn alias(name: &str) -> Option<String> {
    const STEMS: [(&str, bool, &[&str]); 6] = [
        ("gyro", true, &["gyr", "gyroscope"]),
        ("acc", true, &["accel", "accelerometer"]),
        ("temp", true, &["temperature"]),
        ("temp", false, &["temperature"]),
        ("supply", false, &["supplyvoltage", "vdd", "vcc"]),
        ("time", false, &["t", "timestamp"]),
    ];
    let word: String = name.chars().filter(|c| c.is_alphanumeric()).collect();
    let word = word.to_lowercase();
    let ours = STEMS.iter().find_map(|(ours, has_axis, others)| {
        let axis = AXES.iter().find(|axis| *has_axis && word.ends_with(**axis));
        let stem = axis.map_or(word.as_str(), |_| &word[..word.len() - 1]);
        let is_it = axis.is_some() == *has_axis && (stem == *ours || others.contains(&stem));
        is_it.then(|| axis.map_or_else(|| (*ours).to_owned(), |axis| format!("{ours}_{axis}")))
    })?;
    (ours != name).then_some(ours)
}

/// The name of ours that a name which is none most probably means: `temperature`, `gyrox`, `accel_z`, `voltage`.
pub(super) fn nearest(name: &str) -> Option<String> {
    let found = Meaning::of(name);
    let axis = found.axis.or_else(|| {
        // What ends in an axis without a mark before it.
        let word = name.to_lowercase();
        AXES.iter().position(|axis| word.ends_with(axis))
    });
    let letter = axis.and_then(|axis| AXES.get(axis)).unwrap_or(&"x");
    let with_axis = |stem: &str| format!("{stem}_{letter}");
    let words = words(name);
    let is = |starts: &[&str]| (words.iter()).any(|w| starts.iter().any(|s| w.starts_with(s)));
    match found.kind {
        Kind::Gyro => Some(with_axis("gyro")),
        Kind::Acc => Some(with_axis("acc")),
        Kind::Temp => Some(
            found
                .axis
                .map_or_else(|| "temp".to_owned(), |_| with_axis("temp")),
        ),
        Kind::Time => Some("time".to_owned()),
        Kind::Bare | Kind::Unknown if is(&["volt", "vdd", "vcc", "supply", "batt"]) => {
            Some("supply".to_owned())
        }
        Kind::Bare | Kind::Unknown if is(&["pwm", "duty", "motor"]) => Some("pwm".to_owned()),
        Kind::Bare | Kind::Unknown => None,
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Time,
    Gyro,
    Acc,
    Temp,
    /// An axis of nobody knows what.
    Bare,
    Unknown,
}

#[derive(Debug)]
struct Meaning {
    kind: Kind,
    axis: Option<usize>,
    is_seconds: bool,
}

/// What the names of a file most probably mean, together: axes may be counted from 1 on, or be flight's p, q, r.
fn meanings(names: &[String]) -> Vec<Meaning> {
    let mut meanings: Vec<Meaning> = names.iter().map(|name| Meaning::of(name)).collect();
    for kind in [Kind::Gyro, Kind::Acc, Kind::Bare] {
        let has = |axis| (meanings.iter()).any(|m| m.kind == kind && m.axis == Some(axis));
        // Only what is counted reaches 3.
        if has(3) && !has(0) {
            let of_kind = meanings.iter_mut().filter(|m| m.kind == kind);
            of_kind.for_each(|m| m.axis = m.axis.map(|axis| axis - 1));
        }
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
    fn of(name: &str) -> Self {
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
        let axis = words.iter().rev().find_map(|word| axis_of(word));
        let is = |starts: &[&str]| (words.iter()).any(|w| starts.iter().any(|s| w.starts_with(s)));
        let first = words.first().map_or("", String::as_str);
        let letters = |list: &[&str]| list.contains(&first);
        let is_seconds = known(first) == Some("s");
        let is_of_time =
            words.len() == 1 && known(first).is_some_and(|unit| is_unit_of(unit, What::Time));
        let unit = in_brackets(name).1;
        let unit_is_of = |what| unit.is_some_and(|unit| is_unit_of(unit, what));
        let kind = if is(&["mag", "quat", "orient", "gravity", "euler", "tick"]) {
            Kind::Unknown
        } else if is(&["gyr", "angular", "omega", "rot", "rate"])
            || letters(&["g", "w", "gx", "gy", "gz", "wx", "wy", "wz"])
        {
            Kind::Gyro
        } else if is(&["acc", "linear"]) || letters(&["a", "ax", "ay", "az"]) {
            Kind::Acc
        } else if is(&["temp"]) {
            Kind::Temp
        } else if ["time", "zeit", "stamp", "epoch"]
            .iter()
            .any(|s| first.starts_with(s))
            || first == "t"
            || is_seconds
            || is_of_time
            || unit_is_of(What::Time)
        {
            Kind::Time
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

/// The axes' names as angles: about x, y and z.
const TURNS: [&str; 3] = ["roll", "pitch", "yaw"];

/// 0, 1, 2 for a word that is or ends in an axis; its number, up to 3, where it ends in one.
fn axis_of(word: &str) -> Option<usize> {
    if let Some(axis) = TURNS.iter().position(|turn| *turn == word) {
        return Some(axis);
    }
    let stem = word.trim_end_matches(['x', 'y', 'z', '0', '1', '2', '3']);
    let known = [
        "", "g", "w", "a", "gyro", "gyr", "acc", "accel", "omega", "angvel", "rate", "rot",
    ];
    let last = word.strip_prefix(stem)?;
    if !known.contains(&stem) {
        return None;
    }
    match last {
        "x" | "0" => Some(0),
        "y" | "1" => Some(1),
        "z" | "2" => Some(2),
        "3" => Some(3),
        _ => None,
    }
}

/// A word that begins with its axis, in two: `xgyro`, `rollrate`.
fn axis_first(word: &str) -> Option<(&str, &str)> {
    let known = ["gyro", "gyr", "acc", "accel", "rate", "speed"];
    let split = |axis: &&str| Some(word.split_at(word.strip_prefix(*axis).map(|_| axis.len())?));
    (AXES.iter().chain(&TURNS).filter_map(split)).find(|(_, rest)| known.contains(rest))
}

/// The words of a name, in small letters: `GyroX`, `gyr[0]`, `w_RS_S_x`.
fn words(name: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut was_small = false;
    for c in name.chars() {
        if !c.is_alphanumeric() || (c.is_uppercase() && was_small) {
            words.push(String::new());
        }
        was_small = c.is_lowercase();
        if let (true, Some(word)) = (c.is_alphanumeric(), words.last_mut()) {
            word.extend(c.to_lowercase());
        }
    }
    words.retain(|word| !word.is_empty());
    let split = |word: String| match axis_first(&word) {
        Some((axis, rest)) => vec![axis.to_owned(), rest.to_owned()],
        None => vec![word],
    };
    words.into_iter().flat_map(split).collect()
}

#[cfg(test)]
mod tests;
