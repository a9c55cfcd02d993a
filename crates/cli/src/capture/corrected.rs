//! The rates that the board has corrected, in place of those that it read.

use model::record::{Axis, Quantity, Record};

use super::CaptureError;
use super::build::CORRECTED;

/// The column of what the board says of its correction.
pub(super) const STATE: &str = "corrected_state";

/// Takes out the rates of rows whose correction was not applied, which mean nothing: captures are written without them, and
/// older ones have zeros there. The column that says it is no measurement, and goes.
pub(super) fn without_unapplied(record: &mut Record) {
    let Some(at) = record.channels.iter().position(|c| c.name == STATE) else {
        return;
    };
    let states = record.channels.remove(at).values;
    let is_unapplied = |state: &f64| *state as u8 & wire::correction_state::APPLIED == 0;
    let rows: Vec<usize> = (0..states.len())
        .filter(|row| !states[*row].is_nan() && is_unapplied(&states[*row]))
        .collect();
    let mut most = 0;
    for channel in record
        .channels
        .iter_mut()
        .filter(|c| CORRECTED.contains(&c.name.as_str()))
    {
        let values = &mut channel.values;
        let taken = rows.iter().filter(|row| !values[**row].is_nan()).count();
        most = most.max(taken);
        rows.iter().for_each(|row| values[*row] = f64::NAN);
    }
    if most > 0 {
        record.notes.push(format!(
            "{most} rows have corrected rates although the correction was not applied: they mean nothing, and are not read"
        ));
    }
}

/// The record with its corrected rates as the gyros, and without the rates as they were read. Rows without a corrected frame
/// have no reading.
///
/// # Errors
/// [`CaptureError::Option`] where the record has no corrected rates.
pub fn corrected(mut record: Record) -> Result<Record, CaptureError> {
    let has = |name: &&str| record.channel(name).is_some();
    if let Some(missing) = CORRECTED.iter().find(|name| !has(name)) {
        return Err(CaptureError::Option {
            option: "--corrected",
            why: format!("there is no column {missing}: the board corrected nothing in this run"),
            help:
                "`imu-stand board correct --model model.toml` before the capture, or leave it out"
                    .to_owned(),
        });
    }
    let lsb = record.all(Quantity::Gyro).find_map(|c| c.lsb);
    record.channels.retain(|c| c.quantity != Quantity::Gyro);
    for (axis, name) in Axis::ALL.into_iter().zip(CORRECTED) {
        for channel in record.channels.iter_mut().filter(|c| c.name == name) {
            channel.name = ["gyro_x", "gyro_y", "gyro_z"][axis.index()].to_owned();
            channel.quantity = Quantity::Gyro;
            channel.axis = Some(axis);
            // Sums of what was read and of what was computed: no counts of the part, whose rounding is in them all the same.
            (channel.counts, channel.lsb) = (None, lsb);
        }
    }
    record
        .notes
        .push("the gyros are the rates that the board has corrected (--corrected)".to_owned());
    Ok(record)
}
