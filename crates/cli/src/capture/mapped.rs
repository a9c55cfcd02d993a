//! Columns that `--columns` names, or that names of known writers do.

use model::record::Quantity;

use super::angle::is_rate;
use super::assumed::contradiction;
use super::columns::{Column, Columns, Role, Said, measured, time};
use super::conventions::unit_of;
use super::error::{brief, brief_list};
use super::foreign::meaning;
use super::names::{TIMES, respelt};
use super::propose::seen::Seen;
use super::propose::{alias, guess, inertial, nearest, times, unknown};
use super::units::{COUNTS, What, in_brackets, is_angle, known};
use super::{CaptureError, ColumnMapping};

/// Begins the name of a column in whose place the mapping names another: a name that is none of ours in any spelling.
pub(super) const UNASKED: &str = "unasked ";

/// Where a mapping names nothing that is analyzed (a time, a temperature, ...), and the file has gyros or accelerometers by
/// names of ours, these are read too: the file's names with the mapping's in their places, and its units. Nothing where the
/// mapping chooses, or the file is a capture of the stand.
pub(super) fn beside_ours(
    said: &Said<'_>,
    mapping: &ColumnMapping,
) -> Option<(Vec<String>, Vec<Option<String>>)> {
    let ours = |given: &str| alias(given).unwrap_or_else(|| given.to_owned());
    if !all_beside(mapping)
        || said.lines.get("format").is_some()
        || !said.names.iter().any(|name| is_inertial(name))
    {
        return None;
    }
    let (mut names, mut units) = (said.names.to_vec(), said.units.to_vec());
    let mut given_places = Vec::new();
    for (given, theirs) in &mapping.columns {
        // What is not there is told by who reads the mapping.
        let at = place(said, theirs).filter(|at| !given_places.contains(at))?;
        given_places.push(at);
        let what = match meaning(&ours(given)).0 {
            Quantity::Other => What::Time,
            quantity => What::Channel(quantity),
        };
        units[at] = units[at].take().or_else(|| {
            let said = unit_of(&said.names[at], what, said.names);
            said.map(str::to_owned)
        });
        names[at] = ours(given);
    }
    // A column of the same kind that is not the one given is none of ours here.
    let is_time = |name: &str| name == "host_time_s" || TIMES.contains(&name);
    let gives_time = mapping
        .columns
        .iter()
        .any(|(given, _)| is_time(&ours(given)));
    for at in (0..names.len()).filter(|at| !given_places.contains(at)) {
        let stem = in_brackets(&said.names[at]).0;
        let is_given = mapping.columns.iter().any(|(given, _)| ours(given) == stem);
        if is_given || (gives_time && is_time(stem)) {
            names[at] = format!("{UNASKED}{}", said.names[at]);
        }
    }
    Some((names, units))
}

/// Refuses to put a column beside those of a capture of the stand: its header scales them, and a mapping would read the counts
/// of a thermometer as degC, and leave out the gyros.
pub(super) fn refuse_beside(said: &Said<'_>, mapping: &ColumnMapping) -> Result<(), CaptureError> {
    let is_capture =
        said.lines.get("format").is_some() && said.names.iter().any(|name| is_inertial(name));
    if !is_capture || !all_beside(mapping) {
        return Ok(());
    }
    Err(CaptureError::Option {
        option: "--columns",
        why: "the file is a capture, whose header says what its columns are".to_owned(),
        help: "leave it out: all of them are read; to read the cells of a gyro as other values, map it: `--columns gyro_x=gyro_x`"
            .to_owned(),
    })
}

/// The mapping with the column of the time, where it names none, nothing says the rate, and one column alone calls itself a time;
/// and what to say of it.
///
/// # Errors
/// [`CaptureError::Option`] where several do.
pub(super) fn with_time(
    said: &Said<'_>,
    mapping: &ColumnMapping,
) -> Result<(ColumnMapping, Option<String>), CaptureError> {
    let mut all = mapping.clone();
    let is_time = |(given, _): &(String, String)| {
        let ours = alias(given).unwrap_or_else(|| given.clone());
        matches!(ours.as_str(), "time" | "host_time_s")
    };
    if said.knows_rate || said.numbered || mapping.columns.iter().any(is_time) {
        return Ok((all, None));
    }
    let given: Vec<Option<usize>> = (mapping.columns.iter())
        .map(|(_, theirs)| place(said, theirs))
        .collect();
    // What is not there is told by who reads the mapping.
    if given.contains(&None) {
        return Ok((all, None));
    }
    let mut times = times(said.names);
    times.retain(|at| !given.contains(&Some(*at)));
    let name = |at: &usize| brief(&said.names[*at]);
    match times[..] {
        [] => Ok((all, None)),
        [at] => {
            all.columns
                .insert(0, ("time".to_owned(), (at + 1).to_string()));
            let name = name(&at);
            let note = format!(
                "the times are those of `{name}`, as `--columns` names no time; `time=...` or `--rate` says otherwise"
            );
            Ok((all, Some(note)))
        }
        _ if said.states_rate => Ok((all, None)),
        _ => Err(CaptureError::Option {
            option: "--columns",
            why: format!(
                "it names no time, and several columns may be it: {}",
                brief_list(&times.iter().map(name).collect::<Vec<_>>()).join(", ")
            ),
            help: format!(
                "add the right one, `time={}` for example; or say `--rate HZ` where none is",
                name(&times[0])
            ),
        }),
    }
}

/// Whether a name is that of a gyro or an accelerometer.
fn is_inertial(name: &str) -> bool {
    matches!(
        meaning(in_brackets(name).0).0,
        Quantity::Gyro | Quantity::Acc
    )
}

/// Whether a mapping names nothing that is analyzed.
fn all_beside(mapping: &ColumnMapping) -> bool {
    let is_beside = |name: &str| {
        matches!(name, "time" | "host_time_s" | "seq" | "flags")
            || matches!(
                meaning(name).0,
                Quantity::Temp | Quantity::Supply | Quantity::Pwm
            )
    };
    let given = mapping.columns.iter();
    let mut given = given.map(|(given, _)| alias(given).unwrap_or_else(|| given.clone()));
    given.all(|name| is_beside(&name))
}

/// Where a mapping names nothing that is analyzed, and the file's names say what their columns are, those that it does not name
/// are read, too.
pub(super) fn beside_known(said: &Said<'_>, mapping: &ColumnMapping) -> Option<ColumnMapping> {
    if !all_beside(mapping) || said.lines.get("format").is_some() {
        return None;
    }
    let places: Option<Vec<usize>> = (mapping.columns.iter())
        .map(|(_, theirs)| place(said, theirs))
        .collect();
    let places = places?;
    // One of two times, say, may be what was given.
    let others = said.names.iter().enumerate();
    let others = others.map(|(at, name)| {
        if places.contains(&at) {
            "-"
        } else {
            name.as_str()
        }
    });
    let others: Vec<String> = others.map(str::to_owned).collect();
    let said_of_others = Said {
        names: &others,
        ..*said
    };
    let known = by_known_names(&said_of_others, mapping)?;
    let kind = |name: &str| match alias(name).unwrap_or_else(|| name.to_owned()).as_str() {
        "host_time_s" | "time" => "time".to_owned(),
        name => name.to_owned(),
    };
    let given: Vec<String> = mapping.columns.iter().map(|(ours, _)| kind(ours)).collect();
    let is_free = |(ours, theirs): &(String, String)| {
        let at = place(said, theirs);
        !given.contains(&kind(ours)) && at.is_some_and(|at| !places.contains(&at))
    };
    let mut columns: Vec<(String, String)> = known.columns.into_iter().filter(is_free).collect();
    // What a name says of a column holds for no other one.
    let of_known = |key: &str| columns.iter().any(|(ours, _)| ours.starts_with(key));
    let is_given = |key: &str| mapping.units.iter().any(|(known, _)| known == key);
    let units = known.units.into_iter();
    let units = units
        .filter(|(key, _)| is_given(key) || of_known(key))
        .collect();
    columns.extend(mapping.columns.iter().cloned());
    columns.sort_by_key(|(_, theirs)| place(said, theirs));
    Some(ColumnMapping { columns, units })
}

/// The mapping of a file whose names say of each column what it is and in which unit, and leave no choice; nothing where
/// anything would have to be guessed.
pub(super) fn by_known_names(said: &Said<'_>, mapping: &ColumnMapping) -> Option<ColumnMapping> {
    if said.numbered || has_our_names(said) {
        return None;
    }
    let guess = guess(said.names, false, &Seen::default());
    let has_gyro = guess
        .columns
        .iter()
        .any(|(ours, _)| ours.starts_with("gyro"));
    let mut units = mapping.units.clone();
    for (key, of_name) in &guess.units {
        // A row of units under the names says it as well.
        let of_column = (guess.columns.iter())
            .find(|(ours, _)| ours.starts_with(key))
            .and_then(|(_, at)| said.units[*at].as_deref());
        let of_column = of_column.filter(|unit| *unit != COUNTS);
        let is_given = units.iter().any(|(known, _)| known == key);
        match (*of_name).or(of_column) {
            _ if is_given => {}
            // Whether they are has to be said.
            Some(unit) if *key == "gyro" && is_angle(unit) => {}
            Some(unit) => units.push(((*key).to_owned(), unit.to_owned())),
            // Times without a unit are held against their steps.
            None if *key == "time" => {}
            None => return None,
        }
    }
    // A column that says another unit than the first of its kind is in that.
    for (ours, at) in &guess.columns {
        let (key, what) = match meaning(ours).0 {
            quantity @ Quantity::Gyro => ("gyro", What::Channel(quantity)),
            quantity @ Quantity::Acc => ("acc", What::Channel(quantity)),
            _ => continue,
        };
        let of_name = unit_of(&said.names[*at], what, said.names).filter(|unit| *unit != COUNTS);
        let own = of_name.or(said.units[*at].as_deref());
        let of_kind = (units.iter()).find(|(known, _)| known == key);
        let is_given = mapping.unit(ours, what).is_some();
        if let (Some(own), Some((_, of_kind)), false) = (own, of_kind, is_given)
            && known(own) != known(of_kind)
        {
            units.push((ours.clone(), own.to_owned()));
        }
    }
    let others = beside_sensors(said, &guess.columns);
    let columns = guess.columns.iter().chain(&others);
    let columns = columns.map(|(ours, at)| (ours.clone(), (at + 1).to_string()));
    (has_gyro && !guess.is_ambiguous).then(|| ColumnMapping {
        columns: columns.collect(),
        units,
    })
}

/// Whether gyros or accelerometers have names of ours. Accelerometers alone do not say what gyros of other names are.
fn has_our_names(said: &Said<'_>) -> bool {
    let stems: Vec<String> = (said.names.iter())
        .map(|name| in_brackets(name).0.to_owned())
        .collect();
    let (names, _) = respelt(&stems, &TIMES, false);
    let has = |quantity: Quantity| names.iter().any(|name| meaning(name).0 == quantity);
    let has_foreign = || inertial(said.names).contains(&Some(Quantity::Gyro));
    has(Quantity::Gyro) || has(Quantity::Acc) && !has_foreign()
}

/// What stands beside sensors by a name of ours, the first of each: a supply whose unit the file says, and the motor's command.
fn beside_sensors(said: &Said<'_>, taken: &[(String, usize)]) -> Vec<(String, usize)> {
    let mut found: Vec<(String, usize)> = Vec::new();
    for (at, name) in said.names.iter().enumerate() {
        let stem = in_brackets(name).0;
        let ours = alias(stem).unwrap_or_else(|| stem.to_owned());
        let what = What::Channel(meaning(&ours).0);
        let has_unit = said.units[at].is_some() || unit_of(name, what, said.names).is_some();
        let is_one = match meaning(&ours).0 {
            Quantity::Supply => has_unit,
            Quantity::Pwm => true,
            _ => false,
        };
        let mut both = taken.iter().chain(&found);
        if is_one && both.all(|(other, place)| *other != ours && *place != at) {
            found.push((ours, at));
        }
    }
    found
}

/// The place of a column by its name, by its name without a unit, or by its number from 1 on.
pub(super) fn place(said: &Said<'_>, theirs: &str) -> Option<usize> {
    let by_stem = || {
        let stems = said.names.iter().map(|name| in_brackets(name).0);
        let mut places = stems.enumerate().filter(|(_, stem)| *stem == theirs);
        // Two of one stem are told apart by their units alone.
        places.next().filter(|_| places.next().is_none())
    };
    let by_number = || {
        let number: usize = theirs.parse().ok()?;
        (1..=said.names.len()).contains(&number).then(|| number - 1)
    };
    (said.names.iter().position(|name| name == theirs))
        .or_else(|| by_stem().map(|(at, _)| at))
        .or_else(by_number)
}

/// The columns of a mapping.
pub(super) fn mapped(said: &Said<'_>, mapping: &ColumnMapping) -> Result<Columns, CaptureError> {
    let mut found = Columns::default();
    let mut assumed = Vec::new();
    for (given, theirs) in &mapping.columns {
        let Some(at) = place(said, theirs) else {
            return Err(unknown(
                said.names,
                format!("there is no column `{theirs}`"),
            ));
        };
        if let Some(other) = found.columns.iter().find(|c: &&Column| c.at == at) {
            return Err(given_twice(&said.names[at], &other.name, given));
        }
        let is_taken = |name: &str| mapping.columns.iter().any(|(other, _)| other == name);
        let alias = alias(given).filter(|name| !is_taken(name));
        if let Some(name) = &alias {
            found.notes.push(format!(
                "`{given}` is taken as `{name}`, the name that it has here"
            ));
        }
        let ours = alias.unwrap_or_else(|| given.clone());
        let role = match ours.as_str() {
            "seq" => Role::Seq,
            "time" | "host_time_s" => time(said, mapping, at, &mut found)?,
            "flags" => Role::Flags,
            name => {
                let what = What::Channel(meaning(name).0);
                let column = &said.names[at];
                let stated = said.units[at].as_deref();
                let stated = stated.or_else(|| unit_of(column, what, said.names));
                // What a count of a gyro is, is asked for.
                let is_asked = meaning(name).0 == Quantity::Gyro;
                let stated = stated.filter(|unit| !is_asked || *unit != COUNTS);
                let given = mapping.unit(name, what);
                let unit = given.or(stated);
                is_rate(said, at, given, stated, meaning(name).0)?;
                let note = contradiction(name, column, given, stated);
                found.notes.extend(note);
                if unit.is_none() {
                    assumed.push((name.to_owned(), what));
                }
                found.notes.extend(unknown_name(name, what));
                measured(at, name, meaning(name).0, unit)?.role
            }
        };
        found.columns.push(Column {
            at,
            name: ours,
            role,
            is_asked: true,
        });
    }
    found.assume(&assumed);
    Ok(found)
}

fn given_twice(column: &str, one: &str, other: &str) -> CaptureError {
    CaptureError::Option {
        option: "--columns",
        why: format!(
            "the column `{}` is given to {one} and to {other}",
            brief(column)
        ),
        help: "one column is one channel: leave one of the two out, or name its own column"
            .to_owned(),
    }
}

/// What to tell of a channel whose name is none of ours, but near one.
fn unknown_name(name: &str, what: What) -> Option<String> {
    if what != What::Channel(Quantity::Other) {
        return None;
    }
    let nearest = nearest(name)?;
    Some(format!(
        "`{name}` is no name of this program's, so the column is a channel of its own, which no cause knows: did you mean \
         {nearest}? (time, gyro_x .. gyro_z, acc_x .. acc_z, temp or temp_x .. temp_z, supply, pwm)"
    ))
}
