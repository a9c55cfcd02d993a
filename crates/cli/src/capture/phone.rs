//! Files of the app Sensor Logger: one a sensor, whose columns are x, y and z in each, and whose name alone says of what.

use super::ColumnMapping;
use super::layout::Layout;

/// Names by which its files are known.
const MARKS: [&str; 5] = ["time", "seconds_elapsed", "x", "y", "z"];
/// How the names of the files of its gyro begin; it writes them in rad/s (its page of units).
const GYRO: &str = "Gyroscope";

/// Takes the columns of a gyro's file for those of a gyro, where no mapping says what they are; and what to tell of it.
pub(super) fn take(
    layout: &mut Layout,
    file: Option<&str>,
    mapping: &ColumnMapping,
) -> Option<String> {
    let is_there = |mark: &&str| layout.names.iter().any(|name| name == mark);
    let is_its = MARKS.iter().all(is_there) && file?.starts_with(GYRO);
    if !is_its || !mapping.columns.is_empty() {
        return None;
    }
    for name in &mut layout.names {
        if matches!(name.as_str(), "x" | "y" | "z") {
            *name = format!("{GYRO} {name}");
        }
    }
    Some(format!(
        "x, y and z are taken for a gyro's in rad/s, as the app Sensor Logger writes the file {GYRO}; `--columns` and `--units` say \
         otherwise"
    ))
}
