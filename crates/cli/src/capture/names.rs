//! Column names that are ours but for their spelling: those that differ in case and punctuation alone are taken for ours, the
//! nearest is told of others.

use model::record::Quantity;

use super::ColumnMapping;
use super::columns::{Columns, Said};
use super::conventions::unit_of;
use super::error::brief;
use super::foreign::meaning;
use super::propose::alias;
use super::units::{What, known};

/// The names of the format.
const OURS: [&str; 16] = [
    "seq",
    "t_ticks",
    "host_time_s",
    "gyro_x",
    "gyro_y",
    "gyro_z",
    "temp_x",
    "temp_y",
    "temp_z",
    "temp",
    "supply",
    "acc_x",
    "acc_y",
    "acc_z",
    "pwm",
    "flags",
];
/// Those of a time in tables of others.
pub(super) const TIMES: [&str; 4] = ["time", "time_s", "timestamp", "t"];

/// Letters and digits of a name, small.
fn plain(name: &str) -> String {
    let letters = name.chars().filter(|c| c.is_alphanumeric());
    letters.flat_map(char::to_lowercase).collect()
}

/// The columns' names with those of ours, and `more`, where case and punctuation are all that differs, and notes of them.
/// Nothing is guessed: not where ours is there too, or two columns may be it; nor where no gyro or accelerometer has a name
/// of ours and the file does not say that it is a capture of the stand.
pub(super) fn respelt(
    names: &[String],
    more: &[&'static str],
    is_capture: bool,
) -> (Vec<String>, Vec<String>) {
    let is_inertial = |n: &String| matches!(meaning(n).0, Quantity::Gyro | Quantity::Acc);
    if !is_capture && !names.iter().any(is_inertial) {
        return (names.to_vec(), Vec::new());
    }
    let plains: Vec<String> = names.iter().map(|name| plain(name)).collect();
    // A letter of its own may be anything.
    let known = OURS.iter().chain(more).filter(|ours| ours.len() > 1);
    let known: Vec<(&str, String)> = known.map(|ours| (*ours, plain(ours))).collect();
    let mut notes = Vec::new();
    let has_gyro = names.iter().any(|n| meaning(n).0 == Quantity::Gyro);
    let gyros = names.iter().filter(|_| !has_gyro).filter_map(|n| alias(n));
    let gyros: Vec<String> = gyros.filter(|ours| ours.starts_with("gyro_")).collect();
    let ours = |(name, own): (&String, &String)| {
        let found = known.iter().find(|(_, plain)| plain == own);
        let found = found.map(|(ours, _)| (*ours).to_owned());
        // As Bosch and others write it beside `acc_x`.
        let is_one = |ours: &String| gyros.iter().filter(|gyro| *gyro == ours).count() == 1;
        let gyro = || alias(name).filter(is_one);
        let found = found.or_else(gyro)?;
        // Looked for last: a table may have a hundred thousand columns.
        if plains.iter().filter(|other| *other == own).nth(1).is_some() {
            return None;
        }
        if found != *name {
            notes.push(format!(
                "column `{}` is taken as `{found}`, the name that it has here",
                brief(name)
            ));
        }
        Some(found)
    };
    let found: Vec<Option<String>> = names.iter().zip(&plains).map(ours).collect();
    let names = found.into_iter().zip(names);
    let names = names.map(|(ours, name)| ours.unwrap_or_else(|| name.clone()));
    (names.collect(), notes)
}

/// The names of ours that are not among a file's.
pub(super) fn missing(names: &[String]) -> Vec<&'static str> {
    let is_there = |ours: &str| names.iter().any(|name| name == ours);
    (OURS.into_iter()).filter(|ours| !is_there(ours)).collect()
}

/// The name of ours that a column was probably meant to have, of those that are missing; none where several are as near.
pub(super) fn meant(name: &str, missing: &[&'static str]) -> Option<String> {
    let own = plain(name);
    let mut near: Vec<(usize, &str)> = (missing.iter().map(|ours| (plain(ours), *ours)))
        .filter(|(plain, _)| plain.len().abs_diff(own.len()) <= WRONG)
        .map(|(plain, ours)| (distance(&plain, &own), ours))
        .filter(|(distance, ours)| *distance <= if plain(ours).len() > SHORT { WRONG } else { 1 })
        .collect();
    near.sort_unstable();
    match near[..] {
        [] => alias(name).filter(|ours| missing.contains(&ours.as_str())),
        [(first, _), (second, _), ..] if first == second => None,
        [(_, ours), ..] => Some(ours.to_owned()),
    }
}

/// Wrong letters that a longer name of ours stands.
const WRONG: usize = 2;
/// Letters of a name up to which one wrong one is all that it stands.
const SHORT: usize = 4;

/// Letters that are wrong, missing, too many, or changed with their neighbour.
fn distance(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().collect(), b.chars().collect());
    let mut rows: Vec<Vec<usize>> = vec![(0..=b.len()).collect()];
    for i in 1..=a.len() {
        let mut row = vec![i];
        for j in 1..=b.len() {
            let is_other = usize::from(a[i - 1] != b[j - 1]);
            let mut least = (rows[i - 1][j - 1] + is_other)
                .min(rows[i - 1][j] + 1)
                .min(row[j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                least = least.min(rows[i - 2][j - 2] + 1);
            }
            row.push(least);
        }
        rows.push(row);
    }
    rows[a.len()][b.len()]
}

/// Names that a note lists.
const LISTED: usize = 20;

/// Says which columns are not read because of their names.
pub(super) fn not_read(unread: &[&String], names: &[String]) -> Option<String> {
    let missing = missing(names);
    let say = |name: &&String| match meant(name, &missing) {
        Some(ours) => format!("`{}` (did you mean `{ours}`?)", brief(name)),
        None => format!("`{}`", brief(name)),
    };
    let mut list: Vec<String> = unread.iter().take(LISTED).map(say).collect();
    if unread.len() > LISTED {
        list.push(format!("and {} more", unread.len() - LISTED));
    }
    (!unread.is_empty()).then(|| {
        format!(
            "not read, as their names are none of the stand's: {}; `--columns` maps them, or rename them",
            list.join(", ")
        )
    })
}

/// Names that a note lists of a log of others, which has dozens.
const LEFT_LISTED: usize = 5;

/// Says which columns are not read where the names of the others say what they are.
pub(super) fn left(names: &[String], is_read: &dyn Fn(usize) -> bool) -> Option<String> {
    let names = names.iter().enumerate().filter(|(at, _)| !is_read(*at));
    let names: Vec<String> = names.map(|(_, n)| format!("`{}`", brief(n))).collect();
    let more = match names.len().saturating_sub(LEFT_LISTED) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    let listed = names.iter().take(LEFT_LISTED).cloned().collect::<Vec<_>>();
    (!names.is_empty()).then(|| {
        let listed = listed.join(", ");
        format!("not read: {listed}{more}; `--columns` maps them, too")
    })
}

/// Says what was made of names that say it themselves.
pub(super) fn taken(said: &Said<'_>, mapping: &ColumnMapping, found: &Columns) -> String {
    let columns = found.columns.iter();
    let columns = columns.map(|c| format!("{} from `{}`", c.name, brief(&said.names[c.at])));
    let mut units: Vec<String> = (mapping.units.iter())
        .map(|(key, unit)| format!("{key} in {unit}"))
        .collect();
    for column in &found.columns {
        let quantity = meaning(&column.name).0;
        let is_said = (mapping.units.iter()).any(|(key, _)| column.name.starts_with(key.as_str()));
        let unit = unit_of(&said.names[column.at], What::Channel(quantity), said.names);
        let unit = said.units[column.at].as_deref().or(unit).and_then(known);
        if let (Quantity::Acc | Quantity::Temp | Quantity::Supply, false, Some(unit)) =
            (quantity, is_said, unit)
        {
            units.push(format!("{} in {unit}", column.name));
        }
    }
    format!(
        "columns are taken as their names say: {}; {}; `--columns` and `--units` say otherwise",
        columns.collect::<Vec<_>>().join(", "),
        units.join(", ")
    )
}

/// Says that a column is not read, because the mapping names another one for it.
pub(super) fn in_its_place(column: &str) -> String {
    let column = brief(column);
    format!("`{column}` is not read: `--columns` names another column for it")
}

/// Says which of two times is not read.
pub(super) fn other_clock(column: &str) -> String {
    let column = brief(column);
    format!(
        "the times are those of `host_time_s`, and `{column}` is not read: `--columns time={column}` takes it in its place"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn list(names: &str) -> Vec<String> {
        names.split(',').map(str::to_owned).collect()
    }

    #[test]
    fn case_and_punctuation_make_no_other_name_and_nothing_is_guessed() {
        for (names, is_capture, taken) in [
            (
                "gyro_x,Gyro_Y,gyro-z,ACC X,Time",
                false,
                "gyro_x,gyro_y,gyro_z,acc_x,time",
            ),
            ("SEQ,GyroX,Temp", true, "seq,gyro_x,temp"),
            ("acc_x,gyr_x,Gyr_Y", false, "acc_x,gyro_x,gyro_y"),
            ("acc_x,gyro_y,gyr_x", false, "acc_x,gyro_y,gyr_x"),
            ("acc_x,gyr_x,gyroscope_x", false, "acc_x,gyr_x,gyroscope_x"),
            // Ours is there too; two may be it; the file is not known to be ours.
            ("gyro_x,Gyro_X", true, "gyro_x,Gyro_X"),
            ("gyro_y,Gyro-X,gyro x", true, "gyro_y,Gyro-X,gyro x"),
            ("Gyro_X,Gyro_Y", false, "Gyro_X,Gyro_Y"),
            ("gyro_x,T", false, "gyro_x,T"),
        ] {
            let (found, notes) = respelt(&list(names), &TIMES, is_capture);
            assert_eq!(found, list(taken));
            let other = list(names)
                .iter()
                .zip(&found)
                .filter(|(a, b)| a != b)
                .count();
            assert_eq!(notes.len(), other, "{notes:?}");
        }
    }

    #[test]
    fn the_name_that_was_meant_is_told_where_it_is_one_and_missing() {
        let missing = missing(&list("seq,gyro_x,gyro_y,acc_x"));
        for (name, ours) in [
            ("gyro_zz", Some("gyro_z")),
            ("gyor_z", Some("gyro_z")),
            ("suply", Some("supply")),
            ("tick", Some("t_ticks")),
            ("t_tick", Some("t_ticks")),
            ("flag", Some("flags")),
            ("pmw", Some("pwm")),
            ("accel_z", Some("acc_z")),
            ("temperature_y", Some("temp_y")),
            // As near to y as to z; there already; nothing like ours.
            ("acc_w", None),
            ("gyro_xx", Some("gyro_z")),
            ("vibration_g", None),
            ("heater_degc", None),
        ] {
            assert_eq!(meant(name, &missing).as_deref(), ours, "{name}");
        }
    }
}
