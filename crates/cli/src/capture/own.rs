//! The columns of the stand's own format, by whose header they are scaled.

use model::record::Quantity;

use super::build::{CORRECTED, OF_CORRECTION};
use super::columns::{Column, Columns, Held, NONE_OF_OURS, Role, Said, is_inertial};
use super::corrected::STATE;
use super::error::brief;
use super::foreign::meaning;
use super::header::Lines;
use super::names::{meant, missing, not_read, respelt};
use super::propose::unknown;
use super::units::What;
use super::{CaptureError, ColumnMapping, STANDARD_GRAVITY};

/// Takes columns of counts, by their places and names, as the header's keys scale them.
pub(super) fn take_counted(
    found: &mut Columns,
    counted: &[(usize, String)],
    said: &Said<'_>,
    mapping: &ColumnMapping,
) -> Result<(), CaptureError> {
    if counted.is_empty() {
        return Ok(());
    }
    let names: Vec<String> = counted.iter().map(|(_, name)| name.clone()).collect();
    let own = own(said, &names, mapping)?;
    found.notes.extend(own.notes);
    found
        .columns
        .extend(own.columns.into_iter().map(|c| Column {
            at: counted[c.at].0,
            ..c
        }));
    Ok(())
}

/// Columns of the stand's own format that are no channels.
const OF_FRAMES: [&str; 4] = ["seq", "t_ticks", "host_time_s", "flags"];

/// The columns of the stand's own format, by whose header they are scaled.
pub(super) fn own(
    said: &Said<'_>,
    names: &[String],
    mapping: &ColumnMapping,
) -> Result<Columns, CaptureError> {
    let lines = said.lines;
    let is_capture = lines.get("format").is_some();
    let theirs = names;
    let (names, mut notes) = respelt(theirs, &[], is_capture);
    let (mut columns, mut unread) = (Vec::new(), Vec::new());
    let missing = missing(&names);
    for (at, name) in names.iter().enumerate() {
        let (quantity, _) = meaning(name);
        // What the board says of its correction is no measurement.
        if is_capture && OF_CORRECTION.contains(&name.as_str()) && name != STATE {
            continue;
        }
        let role = match role_of(name, lines, is_capture)? {
            Some(role) => role,
            // The format may grow: what is not known is kept as it is, where the file says that it is ours.
            None if is_capture => {
                notes.extend(misspelt(name, &missing));
                let unit = mapping.unit(name, What::Channel(quantity)).unwrap_or("1");
                Role::Measured {
                    quantity,
                    unit: unit.to_owned(),
                    zero: 0.0,
                    scale: 1.0,
                    held: Held::Values,
                }
            }
            None => {
                unread.push(&theirs[at]);
                continue;
            }
        };
        columns.push(Column {
            at,
            name: name.clone(),
            role,
            is_asked: quantity != Quantity::Other || OF_FRAMES.contains(&name.as_str()),
        });
    }
    if !columns.iter().any(is_inertial) {
        return Err(unknown(said.names, NONE_OF_OURS.to_owned()));
    }
    notes.extend(not_read(&unread, &names));
    Ok(Columns {
        columns,
        notes,
        ..Columns::default()
    })
}

/// What a column of our names is, by the header's keys; `None` for a name that the format does not have.
fn role_of(name: &str, lines: &Lines, is_capture: bool) -> Result<Option<Role>, CaptureError> {
    let (quantity, _) = meaning(name);
    let scaled = |zero, scale, unit: &str| Role::Measured {
        quantity,
        unit: unit.to_owned(),
        zero,
        scale,
        held: Held::Counts,
    };
    Ok(Some(match (name, quantity) {
        ("seq", _) => Role::Seq,
        ("t_ticks", _) => {
            lines.needed("tick_s", name)?;
            Role::Ticks
        }
        ("host_time_s", _) => Role::Time { scale: 1.0 },
        ("flags", _) => Role::Flags,
        (_, Quantity::Gyro) => scaled(0.0, lines.scale("gyro_lsb_dps", name)?, "deg/s"),
        (_, Quantity::Temp) => {
            let lsb = lines.scale("temp_lsb_c", name)?;
            scaled(-lines.needed("temp_zero_c", name)? / lsb, lsb, "degC")
        }
        (_, Quantity::Supply) => scaled(0.0, lines.scale("supply_lsb_v", name)?, "V"),
        (_, Quantity::Acc) => {
            let per_g = lines.scale("acc_counts_per_g", name)?;
            scaled(
                lines.needed("acc_zero_counts", name)?,
                STANDARD_GRAVITY / per_g,
                "m/s^2",
            )
        }
        (_, Quantity::Pwm) => scaled(0.0, 1.0, "1"),
        // Which rates are none, it says; then it goes.
        (STATE, _) if is_capture => Role::Measured {
            quantity: Quantity::Derived,
            unit: "1".to_owned(),
            zero: 0.0,
            scale: 1.0,
            held: Held::Values,
        },
        (name, _) if is_capture && CORRECTED.contains(&name) => Role::Measured {
            quantity: Quantity::Derived,
            unit: "deg/s".to_owned(),
            zero: 0.0,
            scale: lines.scale("corrected_lsb_dps", name)?,
            held: Held::Values,
        },
        (_, Quantity::Other | Quantity::Derived) => return Ok(None),
    }))
}

/// What to tell of a column that is none of the format's, where its name is near one that is missing.
fn misspelt(name: &str, missing: &[&'static str]) -> Option<String> {
    let ours = meant(name, missing)?;
    Some(format!(
        "column `{}` is none of the format's, so it is a channel of its own, which no cause knows: did you mean `{ours}`? \
         Then rename it in the line of the names",
        brief(name)
    ))
}
