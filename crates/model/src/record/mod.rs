//! A record: what a run delivered, scaled, before anybody explains it.
//!
//! Everything that computes takes a [`Record`]: captures of the board, simulations and foreign files all become one.

pub mod batches;
pub mod error;
pub mod fills;
pub mod rows;
pub mod sampling;
pub mod sentinels;

pub use error::AnalysisError;

use serde::Serialize;

/// What a channel measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Angular rate.
    Gyro,
    /// Specific force.
    Acc,
    /// Die temperature of a gyro, or of the board where there is one sensor for all.
    Temp,
    /// Supply voltage as a gyro reads it.
    Supply,
    /// Motor command, -255..255.
    Pwm,
    /// Anything else that was measured beside them: a sensor may follow it, as no effect of the library does.
    Other,
    /// What the board makes of its readings, like corrected rates: analyzed, and no source of anything.
    Derived,
}

/// Counts of the motor command at full duty ([`Quantity::Pwm`]).
pub const FULL_DUTY: f64 = 255.0;

/// A body axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs)]
pub enum Axis {
    X,
    Y,
    Z,
}

impl Axis {
    /// All three, in order.
    pub const ALL: [Self; 3] = [Self::X, Self::Y, Self::Z];

    /// 0, 1, 2.
    #[must_use]
    pub fn index(self) -> usize {
        self as usize
    }
}

/// One column of a record.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Column name of the capture format: `gyro_x`, `temp_z`, `supply`, `pwm`, ...; foreign names are kept.
    pub name: String,
    /// What it measures.
    pub quantity: Quantity,
    /// Its axis, where it has one.
    pub axis: Option<Axis>,
    /// Unit of `values`: `deg/s`, `m/s^2`, `degC`, `V`, `1`, or what `--units` said.
    pub unit: String,
    /// Scaled readings, one per row; NaN where the row has none.
    pub values: Vec<f64>,
    /// Counts as the part delivered them, where the record has them (then `values` = `lsb` * (count - zero)).
    pub counts: Option<Vec<i32>>,
    /// Unit per count, where it is known.
    pub lsb: Option<f64>,
}

/// What the base under the stand did, as the operator says (`base` in the header).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Base {
    /// At rest.
    #[default]
    Static,
    /// Moving, not by our motor.
    Moving,
    /// The motor turns the table.
    Turntable,
}

/// The header of a capture, parsed where the analysis needs it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Header {
    /// Nominal sample rate, Hz.
    pub rate_hz: Option<f64>,
    /// Length of a tick of `t_ticks`, s.
    pub tick_s: Option<f64>,
    /// Stated tolerance of the device clock, parts per million.
    pub tick_tolerance_ppm: Option<f64>,
    /// What the base did; `None` where the header does not say.
    pub base: Option<Base>,
    /// All `# key: value` lines in file order, values verbatim.
    pub entries: Vec<(String, String)>,
}

/// Flag bits of a capture row (docs/wire-format.md names the higher ones).
pub mod flag {
    /// Gyro x delivered a new sample; y and z are the next two bits.
    pub const NEW_DATA_X: u16 = 1 << 0;
    /// Gyro x raised its error/alarm bit; y and z are the next two bits.
    pub const ERROR_ALARM_X: u16 = 1 << 3;
    /// A frame in order: all three gyros new, no alarm.
    pub const IN_ORDER: u16 = 7;
}

/// A run, one entry per row in every column.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Record {
    /// The header.
    pub header: Header,
    /// Frame sequence number, unwrapped.
    pub seq: Option<Vec<u64>>,
    /// Device time, ticks of `header.tick_s`, unwrapped.
    pub t_ticks: Option<Vec<u64>>,
    /// Host arrival time (or the time column of a foreign file), s.
    pub host_time_s: Option<Vec<f64>>,
    /// Flags; see [`flag`].
    pub flags: Option<Vec<u16>>,
    /// The measured columns.
    pub channels: Vec<Channel>,
    /// What a reader of the results has to know about the rows: what was put in order, left out or missing.
    pub notes: Vec<String>,
}

impl Record {
    /// Rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.channels.first().map_or(0, |c| c.values.len())
    }

    /// Whether there is no row.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The channel of that name.
    #[must_use]
    pub fn channel(&self, name: &str) -> Option<&Channel> {
        self.channels.iter().find(|c| c.name == name)
    }

    /// The channel of that quantity and axis.
    #[must_use]
    pub fn of(&self, quantity: Quantity, axis: Option<Axis>) -> Option<&Channel> {
        self.channels
            .iter()
            .find(|c| c.quantity == quantity && c.axis == axis)
    }

    /// All channels of that quantity.
    pub fn all(&self, quantity: Quantity) -> impl Iterator<Item = &Channel> {
        self.channels.iter().filter(move |c| c.quantity == quantity)
    }
}
