//! Messages as `ros2 topic echo --csv` writes them: a row of numbers for each `sensor_msgs/Imu`, without names.

use super::{Made, SHOWN, write_cells};

/// Cells of a message: stamp (s, ns), frame, orientation and 9 covariances, rates and 9, accelerations and 9.
const CELLS: usize = 40;
/// Nanoseconds a second.
const NS: i64 = 1_000_000_000;

/// Rows that are such messages.
pub(super) struct Messages {
    pub names: Vec<String>,
}

impl Messages {
    pub fn of(lines: &[&str]) -> Option<Self> {
        let count = lines.iter().filter(|line| parts(line).is_some()).count();
        let axes = |stem: &str| {
            ["x", "y", "z"]
                .map(|axis| format!("{stem}.{axis}"))
                .to_vec()
        };
        (count >= SHOWN && count == lines.len()).then(|| Self {
            names: [
                vec!["stamp [ns]".to_owned()],
                axes("angular_velocity"),
                axes("linear_acceleration"),
            ]
            .concat(),
        })
    }

    pub fn row(&self, line: &str, row: &mut String) -> Made {
        let Some((time, readings)) = parts(line) else {
            return Made::Other;
        };
        let time = time.to_string();
        write_cells([time.as_str()].into_iter().chain(readings), row);
        Made::Row
    }
}

/// The stamp, ns, and the rates and accelerations of a line that is such a message.
fn parts(line: &str) -> Option<(i64, Vec<&str>)> {
    let cells: Vec<&str> = line.split(',').map(str::trim).collect();
    if cells.len() != CELLS || cells[2].parse::<f64>().is_ok() {
        return None;
    }
    let numbers = cells[3..].iter().all(|cell| cell.parse::<f64>().is_ok());
    let (s, ns) = (cells[0].parse::<i64>().ok()?, cells[1].parse::<i64>().ok()?);
    let is_stamp = (0..NS).contains(&ns);
    let time = s.checked_mul(NS)?.checked_add(ns)?;
    let readings = cells[16..19].iter().chain(&cells[28..31]).copied();
    (numbers && is_stamp).then(|| (time, readings.collect()))
}
