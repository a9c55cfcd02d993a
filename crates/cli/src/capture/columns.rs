//! Which column of a file is what: by its own names, or by a mapping.

use std::collections::BTreeMap;

use model::record::Quantity;

use super::angle::is_rate;
use super::assumed::{contradiction, note, whose};
use super::build::CORRECTED;
use super::conventions::unit_of;
use super::foreign::meaning;
use super::header::Lines;
use super::mapped::{
    UNASKED, beside_known, beside_ours, by_known_names, mapped, refuse_beside, with_time,
};
use super::names::{TIMES, in_its_place, left, not_read, other_clock, respelt, taken};
use super::own::{own, take_counted};
use super::preamble::Stated;
use super::propose::{date_of, inertial, stated_time, times, unknown};
use super::units::{COUNTS, What, convert, in_brackets};
use super::{CaptureError, ColumnMapping};

/// A column of the file: what it is here, and how its cells become values.
pub(super) struct Column {
    pub at: usize,
    pub name: String,
    pub role: Role,
    /// Whether a name of ours or the mapping asks for it. What merely stands in the file may hold anything.
    pub is_asked: bool,
}

pub(super) enum Role {
    Seq,
    Ticks,
    /// In s, once it is scaled.
    Time {
        scale: f64,
    },
    Flags,
    /// value = (cell - zero) * scale, in `unit`.
    Measured {
        quantity: Quantity,
        unit: String,
        zero: f64,
        scale: f64,
        held: Held,
    },
}

/// What cells of a channel are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Held {
    /// Values in some unit.
    Values,
    /// Counts of the part: whole numbers.
    Counts,
    /// As a scale multiplies them that somebody states: counts, where all are whole numbers.
    Scaled,
}

/// What a file says of its columns.
pub(super) struct Said<'a> {
    /// The header's keys.
    pub lines: &'a Lines,
    /// Names of the columns.
    pub names: &'a [String],
    /// Whether the names are made up.
    pub numbered: bool,
    /// Units that the file states.
    pub units: &'a [Option<String>],
    /// Whether the sample rate is known without times.
    pub knows_rate: bool,
    /// Whether the file states it in words, which its times overrule.
    pub states_rate: bool,
    /// Whether cells without a unit are measured values; else they are counts, and the header scales them.
    pub is_scaled: bool,
}

/// The columns that are read, and how they are taken.
#[derive(Default)]
pub(super) struct Columns {
    pub columns: Vec<Column>,
    /// What was assumed, for the user.
    pub notes: Vec<String>,
    /// Whether the time column is in a unit that nobody said.
    pub time_is_assumed: bool,
    /// Gyros of which nobody did.
    pub assumed_gyros: Vec<String>,
    /// The rate that the file states in words.
    pub stated_rate: Option<Stated>,
}

impl Columns {
    /// Whether one of them has the time.
    fn has_time(&self) -> bool {
        let is_time = |c: &Column| matches!(c.role, Role::Time { .. });
        self.columns.iter().any(is_time)
    }

    /// Takes what nobody stated in the usual units, and says so.
    pub fn assume(&mut self, assumed: &[(String, What)]) {
        self.notes.extend(note(assumed));
        let gyros = (assumed.iter()).filter(|(_, what)| *what == What::Channel(Quantity::Gyro));
        self.assumed_gyros
            .extend(gyros.map(|(name, _)| name.clone()));
    }

    /// Asks for the unit of gyros that nobody stated.
    pub fn ask(&self) -> Result<(), CaptureError> {
        match self.assumed_gyros.as_slice() {
            [] => Ok(()),
            gyros => Err(whose(gyros)),
        }
    }
}

/// Chooses: the mapping's columns; those of the stand's own format; or those of our names, in the units stated.
pub(super) fn columns(said: &Said<'_>, mapping: &ColumnMapping) -> Result<Columns, CaptureError> {
    let found = chosen(said, mapping);
    if let Err(CaptureError::MissingKey { .. }) = &found {
        // A misspelt key of `--units` leaves the cells as counts.
        let stems = said.names.iter().map(|name| in_brackets(name).0);
        mapping.check_units(stems)?;
        if mapping.columns.is_empty() && has_foreign_gyros(said) {
            return Err(unknown(said.names, FOREIGN_GYROS.to_owned()));
        }
    }
    let found = found?;
    if !mapping.columns.is_empty() && !found.columns.iter().any(is_measured) {
        return Err(unknown(
            said.names,
            "`--columns` names nothing that was measured".to_owned(),
        ));
    }
    let names = found.columns.iter().map(|c| c.name.as_str());
    mapping.check_units(names)?;
    not_twice(said, mapping, &found)?;
    Ok(found)
}

fn chosen(said: &Said<'_>, mapping: &ColumnMapping) -> Result<Columns, CaptureError> {
    Ok(if !mapping.columns.is_empty() {
        refuse_beside(said, mapping)?;
        match beside_ours(said, mapping) {
            Some((names, units)) => {
                let said = Said {
                    names: &names,
                    units: &units,
                    ..*said
                };
                by_our_names(&said, mapping)?
            }
            None => match beside_known(said, mapping) {
                Some(all) => {
                    let mut found = mapped(said, &all)?;
                    found.notes.push(taken(said, &all, &found));
                    found
                }
                None => {
                    let (mapping, note) = with_time(said, mapping)?;
                    let mut found = mapped(said, &mapping)?;
                    found.notes.extend(note);
                    found
                }
            },
        }
    } else if said.lines.get("format").is_some() {
        refuse_units(said, mapping)?;
        own(said, said.names, mapping)?
    } else if let ([name], true) = (said.names, meaning(&said.names[0]).0 == Quantity::Other) {
        // A single series needs no name.
        let unit = mapping.unit(name, What::Channel(Quantity::Other));
        let unit = unit.or(said.units[0].as_deref());
        let column = measured(0, name, Quantity::Other, unit)?;
        Columns {
            columns: vec![column],
            ..Columns::default()
        }
    } else {
        match by_known_names(said, mapping) {
            Some(mapping) => {
                let mut found = mapped(said, &mapping)?;
                found.notes.push(taken(said, &mapping, &found));
                let is_date = |c: &Column, at| {
                    matches!(c.role, Role::Time { .. }) && date_of(said.names, c.at) == Some(at)
                };
                let is_read =
                    |at: usize| found.columns.iter().any(|c| c.at == at || is_date(c, at));
                found.notes.extend(left(said.names, &is_read));
                found
            }
            None => by_our_names(said, mapping)?,
        }
    })
}

/// Whether a file that is no capture of the stand has gyros, none by a name of ours: beside those, what has a name of ours is
/// most probably in units too, and no key of the header is missing.
fn has_foreign_gyros(said: &Said<'_>) -> bool {
    let is_ours = |name: &String| meaning(in_brackets(name).0).0 == Quantity::Gyro;
    said.lines.get("format").is_none()
        && !said.names.iter().any(is_ours)
        && inertial(said.names).contains(&Some(Quantity::Gyro))
}

/// Refuses a name that two columns have, where it was not its number that chose one of them.
fn not_twice(
    said: &Said<'_>,
    mapping: &ColumnMapping,
    found: &Columns,
) -> Result<(), CaptureError> {
    let mut often: BTreeMap<&String, usize> = BTreeMap::new();
    for name in said.names {
        *often.entry(name).or_default() += 1;
    }
    for column in &found.columns {
        let name = &said.names[column.at];
        let is_by_number = mapping
            .columns
            .iter()
            .any(|(_, theirs)| theirs == &(column.at + 1).to_string());
        if !is_by_number && often.get(name).is_some_and(|n| *n > 1) {
            return Err(CaptureError::Twice {
                name: name.clone(),
                ours: column.name.clone(),
                number: said.names.iter().position(|n| n == name).unwrap_or(0) + 1,
            });
        }
    }
    Ok(())
}

/// A capture of the stand is in counts, and its header says what they mean.
fn refuse_units(said: &Said<'_>, mapping: &ColumnMapping) -> Result<(), CaptureError> {
    let is_other = |key: &str| {
        key == "other" || said.names.iter().any(|n| n == key) && meaning(key).0 == Quantity::Other
    };
    match mapping.units.iter().find(|(key, _)| !is_other(key)) {
        None => Ok(()),
        Some((key, unit)) => Err(CaptureError::Option {
            option: "--units",
            why: format!("{key}={unit}, but the file is a capture in counts, whose header has their scales"),
            help: "leave it out; to read the cells as other values, map them: `--columns gyro_x=gyro_x`".to_owned(),
        }),
    }
}

fn is_measured(column: &Column) -> bool {
    matches!(column.role, Role::Measured { .. })
}

pub(super) fn is_inertial(column: &Column) -> bool {
    matches!(
        column.role,
        Role::Measured {
            quantity: Quantity::Gyro | Quantity::Acc,
            ..
        }
    )
}

pub(super) fn measured(
    at: usize,
    name: &str,
    quantity: Quantity,
    unit: Option<&str>,
) -> Result<Column, CaptureError> {
    let by = convert(What::Channel(quantity), unit)?;
    let held = by.held(quantity);
    Ok(Column {
        at,
        name: name.to_owned(),
        role: Role::Measured {
            quantity,
            unit: by.unit,
            zero: by.zero,
            scale: by.scale,
            held,
        },
        is_asked: true,
    })
}

/// Columns with names of ours: in the units that are given or stated, in counts where the file says so or says nothing.
fn by_our_names(said: &Said<'_>, mapping: &ColumnMapping) -> Result<Columns, CaptureError> {
    let stems: Vec<String> = (said.names.iter())
        .map(|name| in_brackets(name).0.to_owned())
        .collect();
    let (names, notes) = respelt(&stems, &TIMES, false);
    let stem = |at: usize| names[at].as_str();
    let unit = |at: usize, what: What| {
        let given = mapping.unit(stem(at), what);
        given.or(said.units[at].as_deref())
    };
    let gyro_or_acc = |at: &usize| matches!(meaning(stem(*at)).0, Quantity::Gyro | Quantity::Acc);
    let mut inertial = (0..said.names.len()).filter(gyro_or_acc);
    let is_scaled = said.is_scaled
        || inertial
            .any(|at| unit(at, What::Channel(meaning(stem(at)).0)).is_some_and(|u| u != COUNTS));
    let is_export = is_export(said, &names)?;
    // Where nothing says a unit, cells are counts, and so they are in columns of which the file says it.
    let is_counted = |unit: Option<&str>| unit == Some(COUNTS) || (unit.is_none() && !is_scaled);
    let has = |name: &str| names.iter().any(|n| n == name);
    // `export` tells the board's time once more, in s.
    let has_ticks =
        mapping.columns.is_empty() && has("t_ticks") && said.lines.get("tick_s").is_some();
    let other_time = other_time(said, &names);
    let mut found = Columns {
        notes,
        ..Columns::default()
    };
    let (mut counted, mut assumed, mut unread) = (Vec::new(), Vec::new(), Vec::new());
    for (at, theirs) in stems.iter().enumerate() {
        let name = match other_time {
            Some(time) if time == at => TIMES[0],
            _ => stem(at),
        };
        let (quantity, _) = meaning(name);
        let unit = unit(at, What::Channel(quantity));
        let role = match name {
            "seq" => Role::Seq,
            "t_ticks" if !is_scaled || said.lines.get("tick_s").is_some() => {
                said.lines.needed("tick_s", name)?;
                Role::Ticks
            }
            "flags" => Role::Flags,
            "host_time_s" => Role::Time { scale: 1.0 },
            name if TIMES.contains(&name)
                && !has_ticks
                && !has("host_time_s")
                && !found.has_time() =>
            {
                time(said, mapping, at, &mut found)?
            }
            name if TIMES.contains(&name) && has_ticks => continue,
            name if TIMES.contains(&name) && has("host_time_s") => {
                found.notes.push(other_clock(theirs));
                continue;
            }
            _ if quantity == Quantity::Other => {
                if let Some(unit) = said.lines.unit_of(theirs).filter(|_| is_export) {
                    found.columns.push(exported(at, theirs, unit));
                    continue;
                }
                let other = theirs.strip_prefix(UNASKED);
                found.notes.extend(other.map(in_its_place));
                unread.extend(other.is_none().then_some(theirs));
                continue;
            }
            _ if is_counted(unit) => {
                counted.push((at, name.to_owned()));
                continue;
            }
            _ => {
                is_rate(
                    said,
                    at,
                    mapping.unit(name, What::Channel(quantity)),
                    unit,
                    quantity,
                )?;
                if unit.is_none() && quantity != Quantity::Pwm {
                    assumed.push((name.to_owned(), What::Channel(quantity)));
                }
                measured(at, name, quantity, unit)?.role
            }
        };
        found.columns.push(Column {
            at,
            name: name.to_owned(),
            role,
            is_asked: true,
        });
    }
    take_counted(&mut found, &counted, said, mapping)?;
    let is_ours = |c: &Column| is_inertial(c) || (is_measured(c) && !c.is_asked);
    if !found.columns.iter().any(is_ours) {
        return Err(unknown(said.names, NONE_OF_OURS.to_owned()));
    }
    found.assume(&assumed);
    found.notes.extend(not_read(&unread, &names));
    Ok(found)
}

/// Whether `export` wrote it: it says the unit of every column.
///
/// # Errors
/// Where it did not, and no gyro or accelerometer has a name of ours: before a key of the header is missed that a thermometer of
/// others never had.
fn is_export(said: &Said<'_>, names: &[String]) -> Result<bool, CaptureError> {
    let is_own = |name: &String| matches!(meaning(name).0, Quantity::Gyro | Quantity::Acc);
    let is_export = names.iter().any(|name| name == "time_s")
        && said.names.iter().all(|n| said.lines.unit_of(n).is_some());
    match is_export || names.iter().any(is_own) {
        true => Ok(is_export),
        false => Err(unknown(said.names, NONE_OF_OURS.to_owned())),
    }
}

/// The one column that calls itself a time, though by no name of ours.
fn other_time(said: &Said<'_>, names: &[String]) -> Option<usize> {
    let is_time = |name: &str| TIMES.contains(&name) || matches!(name, "host_time_s" | "t_ticks");
    if names.iter().any(|name| is_time(name)) {
        return None;
    }
    stated_time(said.names).or_else(|| match times(said.names)[..] {
        [at] if !said.knows_rate => Some(at),
        _ => None,
    })
}

/// A channel of its own, of which the header says the unit, as `export` writes it.
fn exported(at: usize, name: &str, unit: &str) -> Column {
    let quantity = match CORRECTED.contains(&name) {
        true => Quantity::Derived,
        false => Quantity::Other,
    };
    Column {
        at,
        name: name.to_owned(),
        role: Role::Measured {
            quantity,
            unit: unit.to_owned(),
            zero: 0.0,
            scale: 1.0,
            held: Held::Values,
        },
        is_asked: false,
    }
}

pub(super) const NONE_OF_OURS: &str =
    "no column has a name of the stand's captures (gyro_x, acc_x, ...)";

const FOREIGN_GYROS: &str =
    "the gyros have other names than the stand's, and nothing says in what units the columns are";

/// The time column at a place, in the unit that is given, stated or usual.
pub(super) fn time(
    said: &Said<'_>,
    mapping: &ColumnMapping,
    at: usize,
    found: &mut Columns,
) -> Result<Role, CaptureError> {
    let given = mapping.unit("time", What::Time);
    let stated = said.units[at].as_deref();
    let stated = stated.or_else(|| unit_of(&said.names[at], What::Time, said.names));
    let unit = given.or(stated);
    found
        .notes
        .extend(contradiction("time", &said.names[at], given, stated));
    found.time_is_assumed = unit.is_none();
    let scale = convert(What::Time, unit)?.scale;
    if let (Some(unit), None) = (unit.filter(|_| scale != 1.0), given) {
        let name = &said.names[at];
        found.notes.push(format!(
            "time is taken in {unit}, as its column `{name}` says"
        ));
    }
    Ok(Role::Time { scale })
}
