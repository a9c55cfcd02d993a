//! Several sensors in one file: a column that names the sensor has more than one value.

use super::CaptureError;
use super::columns::Column;
use super::conventions::DATAFLASH;
use super::error::brief;

/// What columns that name a sensor are called, letters and digits alone.
const NAMES: [&str; 14] = [
    "device",
    "deviceid",
    "devicename",
    "sensor",
    "sensorid",
    "sensorname",
    "imu",
    "imuid",
    "serial",
    "serialno",
    "serialnumber",
    "boardid",
    "unitid",
    "nodeid",
];

/// The column that names the sensor, the first name in it, whether that comes again, as it does not where rows are counted, and
/// the first other one with its line.
pub(super) struct Sensors {
    pub at: usize,
    column: String,
    first: Option<String>,
    comes_again: bool,
    other: Option<(u64, String)>,
}

impl Sensors {
    /// Of the columns of a file, where one of those that are not read has such a name.
    pub fn of(names: &[String], read: &[Column]) -> Option<Self> {
        // There it numbers the sensors; elsewhere it may be a current.
        let is_dataflash = names.iter().any(|name| name == DATAFLASH);
        let is_one = |name: &String| {
            let letters: String = name.chars().filter(char::is_ascii_alphanumeric).collect();
            NAMES.contains(&letters.to_ascii_lowercase().as_str()) || (name == "I" && is_dataflash)
        };
        let is_read = |at: usize| read.iter().any(|column| column.at == at);
        let (at, name) =
            (names.iter().enumerate()).find(|(at, name)| is_one(name) && !is_read(*at))?;
        Some(Sensors {
            at,
            column: name.clone(),
            first: None,
            comes_again: false,
            other: None,
        })
    }

    /// Takes what a line says; nothing is a missing reading.
    pub fn take(&mut self, cell: &str, line: u64) {
        let cell = cell.trim();
        match &self.first {
            _ if cell.is_empty() => {}
            None => self.first = Some(cell.to_owned()),
            Some(first) if first == cell => self.comes_again = true,
            Some(_) if self.other.is_none() => self.other = Some((line, cell.to_owned())),
            Some(_) => {}
        }
    }

    /// The same of a number.
    pub fn take_number(&mut self, number: f64, line: u64) {
        if !(self.comes_again && self.other.is_some()) {
            self.take(&number.to_string(), line);
        }
    }

    /// An error where there were several: no noise figure holds for all of them.
    pub fn one(self) -> Result<(), CaptureError> {
        match (self.first, self.other) {
            (Some(first), Some((line, other))) if self.comes_again => Err(CaptureError::Several {
                column: brief(&self.column),
                first: brief(&first),
                other: brief(&other),
                line,
            }),
            _ => Ok(()),
        }
    }
}
