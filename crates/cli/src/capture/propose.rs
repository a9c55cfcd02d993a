//! The mapping that is proposed for a file whose columns have other names than ours.

use std::collections::HashMap;

use model::record::Quantity;

use super::conventions::unit_of;
use super::units::{COUNTS, What, in_brackets, is_unit_of};

mod by_number;
mod meaning;
mod say;
pub(super) mod seen;
mod words;

use by_number::guess_by_number;
use meaning::{Kind, Meaning, meanings};
pub(super) use say::{proposed, unknown};
use seen::Seen;
use words::{without_axis, words};

const AXES: [&str; 3] = ["x", "y", "z"];

/// What the columns of a file most probably are.
pub(super) struct Guess {
    /// Our name, and the place of the column.
    pub columns: Vec<(String, usize)>,
    /// Key of `--units`, and the unit that the file or a convention says; nothing inside where neither does.
    pub units: Vec<(&'static str, Option<&'static str>)>,
    /// Whether another column could be one of them, or a gyro's may be something else: the choice is then not ours.
    pub is_ambiguous: bool,
    /// Whether the gyros have names of axes alone, as any sensor's may.
    pub is_bare: bool,
    /// The columns of a second IMU, where there is one.
    pub second: Vec<(String, usize)>,
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
            let said = unit_of(&names[at], what, names).filter(|unit| *unit != COUNTS);
            self.units.push((key, said));
        }
    }

    /// A channel of which nothing says the column.
    fn leave_open(&mut self, ours: &str, key: &'static str) {
        self.columns.push((ours.to_owned(), usize::MAX));
        if !self.units.iter().any(|(k, _)| *k == key) {
            self.units.push((key, None));
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
        is_bare: false,
        second: Vec::new(),
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

fn guess_by_name(names: &[String], seen: &Seen, guess: &mut Guess) {
    let meanings = meanings(names);
    if let Some(at) = time_by_name(names, &meanings, seen) {
        guess.add(names, "time", at, What::Time);
    }
    if let Some(at) = (0..names.len()).find(|at| seen.counts_packets(*at, &names[*at])) {
        guess.columns.push(("seq".to_owned(), at));
    }
    let has = |kind: Kind| {
        meanings
            .iter()
            .any(|m| m.kind == kind && m.axis < Some(3) && m.axis.is_some())
    };
    // Bare x, y, z are what the file is about, and most often a gyro here.
    let gyro = match has(Kind::Gyro) || has(Kind::Acc) {
        true => Kind::Gyro,
        false => Kind::Bare,
    };
    guess.is_ambiguous |= gyro == Kind::Bare;
    let bare = of_sensor(names, &meanings, Kind::Bare, &[]);
    let places: Vec<usize> = bare.iter().map(|(_, at)| *at).collect();
    let is_gravity = places.len() == AXES.len() && seen.reads_gravity(&places).is_some();
    let (gyro, acc) = match gyro {
        Kind::Bare if is_gravity => (Kind::Gyro, Kind::Bare),
        gyro => (gyro, Kind::Acc),
    };
    for (kind, stem, quantity) in [(gyro, "gyro", Quantity::Gyro), (acc, "acc", Quantity::Acc)] {
        let first = of_sensor(names, &meanings, kind, &[]);
        let taken: Vec<usize> = first.iter().map(|(_, at)| *at).collect();
        for (k, at) in &first {
            let ours = format!("{stem}_{}", AXES[*k]);
            guess.add(names, &ours, *at, What::Channel(quantity));
            let same = |m: &&Meaning| m.kind == kind && m.axis == Some(*k);
            guess.is_ambiguous |= meanings.iter().filter(same).count() > 1;
        }
        let second = of_sensor(names, &meanings, kind, &taken);
        if second.len() == first.len() {
            let of = second.iter();
            let ours = of.map(|(k, at)| (format!("{stem}_{}", AXES[*k]), *at));
            guess.second.extend(ours);
        }
    }
    guess.is_bare = gyro == Kind::Bare && !bare.is_empty();
    if guess.is_bare {
        // What its writer delivers holds for a gyro, which nothing says that it is.
        let is_said = bare
            .iter()
            .any(|(_, at)| in_brackets(&names[*at]).1.is_some());
        let units = guess
            .units
            .iter_mut()
            .filter(|(key, _)| *key == "gyro" && !is_said);
        units.for_each(|(_, unit)| *unit = None);
    }
    if let Some(at) = meanings.iter().position(|m| m.kind == Kind::Temp) {
        guess.add(names, "temp", at, What::Channel(Quantity::Temp));
        // Beside counts it is in counts.
        let gyros = guess
            .columns
            .iter()
            .filter(|(ours, _)| ours.starts_with("gyro"));
        let are_counts =
            gyros.clone().count() > 0 && gyros.clone().all(|(_, at)| seen.is_whole(*at));
        if are_counts
            && seen.is_whole(at)
            && unit_of(&names[at], What::Channel(Quantity::Temp), names).is_none()
        {
            guess.units.push(("temp", None));
        }
    }
    if !has(Kind::Gyro) && !has(Kind::Acc) && bare.is_empty() {
        by_elimination(names, &meanings, seen, guess);
    }
    no_rates(seen, guess);
}

fn time_by_name(names: &[String], meanings: &[Meaning], seen: &Seen) -> Option<usize> {
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
    (time(true).or_else(|| time(false)))
        .or_else(date)
        .or_else(by_value)
}

/// The axes and places of the columns of the first sensor of a kind that are not `taken`: those whose names differ in the axis
/// alone, and where a name has no such neighbour the first of its axis.
fn of_sensor(
    names: &[String],
    meanings: &[Meaning],
    kind: Kind,
    taken: &[usize],
) -> Vec<(usize, usize)> {
    let stem = |at: usize| without_axis(in_brackets(&names[at]).0);
    let all = || {
        let is_it = |at: &usize| meanings[*at].kind == kind && meanings[*at].axis.is_some();
        (0..names.len())
            .filter(is_it)
            .filter(|at| !taken.contains(at))
    };
    let Some(first) = all().next().map(stem) else {
        return Vec::new();
    };
    let of_axis = |k: usize| {
        let is_axis = |at: &usize| meanings[*at].axis == Some(k);
        let of_first = all().filter(is_axis).find(|at| stem(*at) == first);
        Some((k, of_first.or_else(|| all().find(is_axis))?))
    };
    (0..AXES.len()).filter_map(of_axis).collect()
}

/// A gyro without an axis; or nothing is recognized: the form of a mapping, with the first column that is no time.
fn by_elimination(names: &[String], meanings: &[Meaning], seen: &Seen, guess: &mut Guess) {
    let first = |wanted: &dyn Fn(usize) -> bool| (0..meanings.len()).find(|at| wanted(*at));
    // Nor what has a place already, or a unit of something else.
    let taken: Vec<usize> = guess.columns.iter().map(|(_, at)| *at).collect();
    // Once each: a table may have a hundred thousand columns.
    let may_be: Vec<bool> = (0..names.len())
        .map(|at| {
            let unit = in_brackets(&names[at]).1;
            let is_rate = |unit| is_unit_of(unit, What::Channel(Quantity::Gyro));
            meanings[at].kind != Kind::Time && !taken.contains(&at) && unit.is_none_or(is_rate)
        })
        .collect();
    let may_be = |at: usize| may_be[at];
    // The other axes have the same name but for the axis.
    let stem = |at: usize| without_axis(in_brackets(&names[at]).0);
    let mut of_stem: HashMap<Vec<String>, [Option<usize>; 3]> = HashMap::new();
    for at in (0..names.len()).filter(|at| may_be(*at)) {
        if let Some(axis) = meanings[at].axis.filter(|axis| *axis < AXES.len()) {
            of_stem.entry(stem(at)).or_default()[axis].get_or_insert(at);
        }
    }
    let triple = |at: usize| {
        meanings[at].axis?;
        match of_stem.get(&stem(at))? {
            [Some(x), Some(y), Some(z)] => Some(vec![*x, *y, *z]),
            _ => None,
        }
    };
    let found = first(&|at| meanings[at].kind == Kind::Gyro)
        .or_else(|| first(&|at| may_be(at) && triple(at).is_some()))
        .or_else(|| first(&|at| may_be(at) && !seen.rises(at)))
        .or_else(|| first(&may_be));
    if let Some(at) = found {
        let of = triple(at).unwrap_or_else(|| vec![at]);
        for (axis, at) in AXES.iter().zip(of) {
            let ours = format!("gyro_{axis}");
            guess.add(names, &ours, at, What::Channel(Quantity::Gyro));
        }
    }
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

/// Which columns are of gyros and which of accelerometers, by their names.
pub(super) fn inertial(names: &[String]) -> Vec<Option<Quantity>> {
    let of = |m: &Meaning| match m.kind {
        Kind::Gyro => Some(Quantity::Gyro),
        Kind::Acc => Some(Quantity::Acc),
        _ => None,
    };
    meanings(names).iter().map(of).collect()
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

/// The place of the column of dates whose time of day is in the column at `time`, as it stands beside it.
pub(super) fn date_of(names: &[String], time: usize) -> Option<usize> {
    let is_date = |at: &usize| {
        names
            .get(*at)
            .is_some_and(|name| words(name).iter().any(|w| w == "date"))
    };
    [time.checked_sub(1), Some(time + 1)]
        .into_iter()
        .flatten()
        .find(is_date)
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

#[cfg(test)]
mod tests;
