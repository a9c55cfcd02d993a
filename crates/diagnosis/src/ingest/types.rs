//! A record on an even grid, and a gyro of it.

use std::sync::Arc;

use model::effect::Signal;
use model::record::rows::Bursts;
use model::record::{Axis, Base};

use crate::fit::likelihood::{Bins, Dct, Noise};
use crate::ingest::base_turns::Excursion;
use crate::ingest::jumps::Jumps;

/// A gyro on the grid.
pub struct Target {
    /// Channel name.
    pub name: String,
    /// Axis.
    pub axis: Option<Axis>,
    /// Unit of `y`.
    pub unit: String,
    /// Unit per count.
    pub lsb: Option<f64>,
    /// The step in which its readings come, `lsb` or what they show themselves; 0 where there is none.
    pub step: f64,
    /// Readings, lost ones filled.
    pub y: Arc<Vec<f64>>,
    /// Their coefficients.
    pub coefficients: Arc<Vec<f64>>,
    /// Grid places without a reading, spikes included.
    pub lost: Vec<usize>,
    /// Places whose reading the noise cannot have made.
    pub spikes: Vec<usize>,
    /// Those of them that are over within two seconds, and would pass for a motion or for jumps.
    pub knocks: Vec<usize>,
    /// Places whose reading is not believed, and what was read there.
    pub aside: Vec<(usize, f64)>,
    /// Where its level jumps and stays.
    pub jumps: Jumps,
    /// Places of single far readings that the audit of counts set aside and that what was found explains.
    pub explained: Vec<usize>,
    /// Standard deviations from which on a reading is wild, where many tell that; else that of a single one.
    pub wild_from: Option<f64>,
    /// Turns of the base that it felt, taken out of `y` as lost readings are.
    pub excursions: Vec<Excursion>,
    /// Excess rms in the band of base motion, deg/s.
    pub motion_rms: f64,
    /// Whether that is more than a bias can wander.
    pub moving: bool,
    /// Whether it moves on a table that turns another axis, and does not follow that.
    pub astray: bool,
    /// Baseline noise as first fitted, and its white variance.
    pub noise: Noise,
    /// White variance.
    pub white: f64,
}

/// A record on its grid.
pub struct Grid {
    /// Sample rate, Hz.
    pub rate_hz: f64,
    /// Places.
    pub n: usize,
    /// Places up to the last reading. In a long record some lost ones follow, with which its length transforms fast: nothing
    /// that is told of the record counts them.
    pub end: usize,
    /// Transform of that length.
    pub dct: Dct,
    /// Its bins.
    pub bins: Arc<Bins>,
    /// Where the bursts lie that were laid end to end; none of a record of one piece.
    pub bursts: Option<Bursts>,
    /// What the base did.
    pub base: Option<Base>,
    /// The gyros.
    pub targets: Vec<Target>,
    /// All channels, gyros included.
    pub signals: Vec<Signal>,
}

impl Grid {
    /// Length of the record.
    pub(crate) fn seconds(&self) -> f64 {
        self.end as f64 / self.rate_hz
    }
}
