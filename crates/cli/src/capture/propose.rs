//! The mapping that is proposed for a file whose columns have other names than ours.

use model::record::Quantity;

use super::conventions::unit_of;
use super::units::{What, at_the_end, in_brackets, is_angle, is_unit_of, known};

mod say;
pub(super) mod seen;
mod words;

pub(super) use say::{proposed, unknown};
use seen::Seen;
use words::{TURNS, axis_of, words};

const AXES: [&str; 3] = ["x", "y", "z"];

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

/// What the columns of a file most probably are, by their names and by what was seen of their values. `numbered` says that
/// the names are made up.
pub(super) fn guess(names: &[String], numbered: bool, seen: &Seen) -> Guess {
    let mut guess = Guess {
        columns: Vec::new(),
        units: Vec::new(),
        is_ambiguous: false,
    };
    if numbered || are_numbers(names) {
        guess_by_number(names, seen, &mut guess);
    } else {
        guess_by_name(names, seen, &mut guess);
    }
    by_gravity(seen, &mut guess);
    guess
}

/// Three accelerometers of a unit that nobody says read gravity, and so say it.
fn by_gravity(seen: &Seen, guess: &mut Guess) {
    let accs = guess
        .columns
        .iter()
        .filter(|(ours, _)| ours.starts_with("acc_"));
    let accs: Vec<usize> = accs.map(|(_, at)| *at).collect();
    if accs.len() == AXES.len()
        && let Some((_, said)) = guess.units.iter_mut().find(|(key, _)| *key == "acc")
    {
        *said = said.or_else(|| seen.gravity(&accs));
    }
}

/// Whether names are places in one array of which its own name says nothing: `values[0]`, `values[1]`, ...
fn are_numbers(names: &[String]) -> bool {
    let stem = |name: &String| name.split_once('[').map(|(stem, _)| stem.to_owned());
    let first = names.first().and_then(stem);
    let is_same = |name| stem(name) == first;
    names.len() > 1
        && first.is_some()
        && names.iter().all(is_same)
        && meanings(names).iter().all(|m| m.kind == Kind::Unknown)
}

/// As such files usually are: a time, three gyros, three accelerometers. The time rises, and accelerometers read gravity; where
/// no value is seen, the time is first where the number of columns is odd.
fn guess_by_number(names: &[String], seen: &Seen, guess: &mut Guess) {
    let all = || 0..names.len();
    let time = match all().any(|at| seen.rises(at)) {
        true => all().find(|at| seen.is_time(*at)),
        false => (names.len() > 3 && names.len() != 6).then_some(0),
    };
    if let Some(at) = time {
        guess.add(names, "time", at, What::Time);
    }
    let is_reading = |at: &usize| Some(*at) != time && !seen.rises(*at) && !seen.is_constant(*at);
    let mut readings: Vec<usize> = all().filter(is_reading).collect();
    if readings.is_empty() {
        readings = all().filter(|at| Some(*at) != time).collect();
    }
    let (first, then) = readings.split_at(readings.len().min(AXES.len()));
    let then = &then[..if then.len() < AXES.len() {
        0
    } else {
        AXES.len()
    }];
    let of_triple = |of: &[usize]| match of.len() == AXES.len() {
        true => seen.gravity(of),
        false => None,
    };
    let (gyros, accs) = match (of_triple(first), of_triple(then)) {
        (Some(_), None) => (then, first),
        _ => (first, then),
    };
    for (stem, of, quantity) in [
        ("gyro", gyros, Quantity::Gyro),
        ("acc", accs, Quantity::Acc),
    ] {
        for (axis, at) in AXES.iter().zip(of) {
            guess.add(
                names,
                &format!("{stem}_{axis}"),
                *at,
                What::Channel(quantity),
            );
        }
    }
}

fn guess_by_name(names: &[String], seen: &Seen, guess: &mut Guess) {
    let meanings = meanings(names);
    let time = |with_unit: bool| {
        meanings.iter().zip(names).position(|(m, name)| {
            let says = || unit_of(name, What::Time, names).is_some();
            m.kind == Kind::Time && (!with_unit || says() || m.is_seconds)
        })
    };
    // A date beside a time of day is most often the day alone.
    let date = || meanings.iter().position(|m| m.kind == Kind::Date);
    let unknown = |at: &usize| meanings[*at].kind == Kind::Unknown;
    let by_value = || (0..names.len()).find(|at| unknown(at) && seen.is_time(*at));
    if let Some(at) = time(true)
        .or_else(|| time(false))
        .or_else(date)
        .or_else(by_value)
    {
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
    let bare: Vec<usize> = (0..3).filter_map(|axis| find(Kind::Bare, axis)).collect();
    let is_gravity = bare.len() == AXES.len() && seen.gravity(&bare).is_some();
    let (gyro, acc) = match gyro {
        Kind::Bare if is_gravity => (Kind::Gyro, Kind::Bare),
        gyro => (gyro, Kind::Acc),
    };
    for (kind, stem, quantity) in [(gyro, "gyro", Quantity::Gyro), (acc, "acc", Quantity::Acc)] {
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
        let first = |wanted: &dyn Fn(usize) -> bool| (0..meanings.len()).find(|at| wanted(*at));
        // Nor what has a place already, or a unit of something else.
        let taken: Vec<usize> = guess.columns.iter().map(|(_, at)| *at).collect();
        let may_be = |at: usize| {
            let unit = in_brackets(&names[at]).1;
            let is_rate = |unit| is_unit_of(unit, What::Channel(Quantity::Gyro));
            meanings[at].kind != Kind::Time && !taken.contains(&at) && unit.is_none_or(is_rate)
        };
        let found = first(&|at| meanings[at].kind == Kind::Gyro)
            .or_else(|| first(&|at| may_be(at) && !seen.rises(at)))
            .or_else(|| first(&may_be));
        if let Some(at) = found {
            // The other axes have the same name but for the axis.
            let stem = |at: usize| {
                let mut words = words(&names[at]);
                words.pop();
                words
            };
            let of_axis = |axis| {
                let mut all = 0..names.len();
                all.find(|k| meanings[*k].axis == Some(axis) && stem(*k) == stem(at))
            };
            let of = match [0, 1, 2].map(of_axis) {
                [Some(x), Some(y), Some(z)] if meanings[at].axis.is_some() => vec![x, y, z],
                _ => vec![at],
            };
            for (axis, at) in AXES.iter().zip(of) {
                let ours = format!("gyro_{axis}");
                guess.add(names, &ours, at, What::Channel(Quantity::Gyro));
            }
        }
    }
    no_rates(seen, guess);
}

/// What is too small to be a rate is a channel of its own: a clock's frequency, most often.
fn no_rates(seen: &Seen, guess: &mut Guess) {
    let mut gyros = guess
        .columns
        .iter()
        .filter(|(ours, _)| ours.starts_with("gyro"));
    if let (Some((_, at)), None) = (gyros.next(), gyros.next())
        && seen.is_no_rate(*at)
    {
        let at = *at;
        guess.columns.retain(|(_, other)| *other != at);
        guess.units.retain(|(key, _)| *key != "gyro");
        guess.columns.push(("freq".to_owned(), at));
        guess.units.push(("freq", None));
    }
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
        Kind::Time | Kind::Date => Some("time".to_owned()),
        Kind::Bare | Kind::Unknown if is(&["volt", "vdd", "vcc", "supply", "batt"]) => {
            Some("supply".to_owned())
        }
        Kind::Bare | Kind::Unknown if is(&["pwm", "duty", "motor"]) => Some("pwm".to_owned()),
        Kind::Bare | Kind::Unknown => None,
    }
}

/// The place of the column whose name calls itself a time and says its unit, where it is the only one: `time_ms`,
/// `timestamp_ns`.
pub(super) fn stated_time(names: &[String]) -> Option<usize> {
    let is_time = |name: &String| {
        let words = words(in_brackets(name).0);
        let first = words.first().map_or("", String::as_str);
        let is_called_so = ["time", "zeit", "stamp"]
            .iter()
            .any(|s| first.starts_with(s));
        (is_called_so || first == "t") && unit_of(name, What::Time, names).is_some()
    };
    let mut all = (0..names.len()).filter(|at| is_time(&names[*at]));
    all.next().filter(|_| all.next().is_none())
}

/// The places of the columns whose names say that they are times; of dates, where there is none.
pub(super) fn times(names: &[String]) -> Vec<usize> {
    let meanings = meanings(names);
    let of = |kind: Kind| {
        // A large T is as often a temperature.
        let is_kind = |at: usize| meanings[at].kind == kind && names[at] != "T";
        let is_it = |at: &usize| is_kind(*at) || names[*at] == "host_time_s";
        (0..names.len()).filter(is_it).collect::<Vec<_>>()
    };
    let times = of(Kind::Time);
    if times.is_empty() {
        of(Kind::Date)
    } else {
        times
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
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
        let letters = |list: &[&str]| list.contains(&first);
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
        } else if is_called_time && unit_is_of(What::Time) {
            Kind::Time
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
        } else if is(&["acc", "linear", "beschl", "加速度"]) || letters(&["a", "ax", "ay", "az"])
        {
            Kind::Acc
        } else if is(&["temp", "温度"]) && !TEMPS.contains(&first) {
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
const CLOCKS: [&str; 11] = [
    "elapsed",
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

#[cfg(test)]
mod tests;
