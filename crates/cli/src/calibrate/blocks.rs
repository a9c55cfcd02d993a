//! Seconds of a record: means over about a second each, of which a sequence is made.

use wire::{Sample, flags};

use crate::capture::{Calibration, TEMP};

/// Length of a block, s, and readings in it at the least.
const LENGTH_S: f64 = 1.0;
const LEAST: usize = 8;
/// What the accelerometers' means of two blocks may differ by beside what the floor shakes, g; a twentieth of a face's tilt that
/// would matter.
const STEADY_G: f64 = 0.02;
/// What neighbouring readings of an accelerometer may scatter by, g rms: more than a floor that shakes, less than a hand.
const QUIET_G: f64 = 0.2;
/// What the gyros' means of two blocks may differ by beside their noise, deg/s.
const STEADY_DPS: f64 = 0.5;

/// Means over a block.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Block {
    /// Its middle, by the line's clock, s.
    pub t: f64,
    /// Rates as read, deg/s.
    pub gyro: [f64; 3],
    /// Squares of the standard errors of these means if readings are independent, (deg/s)^2.
    pub gyro_variance: [f64; 3],
    /// Spread of the readings about them, deg/s rms.
    pub gyro_rms: [f64; 3],
    /// Accelerometers, counts.
    pub acc: [f64; 3],
    /// Spread of the readings about them, counts rms.
    pub acc_rms: [f64; 3],
    /// Squares of the standard errors of these means if readings are independent, counts^2: on a floor that shakes they are not
    /// small.
    pub acc_variance: [f64; 3],
    /// degC.
    pub temp: [f64; 3],
}

/// Collects samples in order.
pub struct Blocks {
    calibration: Calibration,
    length: usize,
    waiting: Vec<(f64, Sample)>,
}

impl Blocks {
    /// Of a board that is set so.
    #[must_use]
    pub fn new(calibration: Calibration) -> Self {
        let length = (calibration.rate_hz * LENGTH_S).round() as usize;
        Self {
            calibration,
            length: length.max(LEAST),
            waiting: Vec::new(),
        }
    }

    /// Length of a block, s.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.length as f64 / self.calibration.rate_hz
    }

    /// A sample that arrived at `t` s; a block where it is the last of one. A sample out of order begins anew.
    pub fn push(&mut self, sample: &Sample, t: f64) -> Option<Block> {
        if sample.flags & flags::IN_ORDER != flags::IN_ORDER
            || sample.flags & flags::GYRO_NOT_ANSWERING != 0
        {
            self.waiting.clear();
            return None;
        }
        self.waiting.push((t, *sample));
        if self.waiting.len() < self.length {
            return None;
        }
        let waiting = std::mem::take(&mut self.waiting);
        let n = waiting.len() as f64;
        let moments = |of: &dyn Fn(&Sample) -> f64| {
            let mean = waiting.iter().map(|(_, s)| of(s)).sum::<f64>() / n;
            let squares: f64 = waiting.iter().map(|(_, s)| (of(s) - mean).powi(2)).sum();
            (mean, squares / (n - 1.0))
        };
        let c = &self.calibration;
        let gyro = [0, 1, 2].map(|k| moments(&|s| f64::from(s.gyro[k]) * c.gyro_lsb_dps));
        let acc = [0, 1, 2].map(|k| moments(&|s| f64::from(s.acc[k])));
        Some(Block {
            t: (waiting[0].0 + t) / 2.0,
            gyro: gyro.map(|m| m.0),
            gyro_variance: gyro.map(|m| m.1 / n),
            gyro_rms: gyro.map(|m| m.1.sqrt()),
            acc: acc.map(|m| m.0),
            acc_rms: acc.map(|m| m.1.sqrt()),
            acc_variance: acc.map(|m| m.1 / n),
            temp: [0, 1, 2].map(|k| moments(&|s| f64::from(s.temp[k]) * TEMP.0 + TEMP.1).0),
        })
    }
}

/// Why a stand is not still between two neighbouring blocks; `None` where it is.
#[must_use]
pub fn moved(before: &Block, now: &Block, c: &Calibration) -> Option<String> {
    for k in 0..3 {
        let axis = ["x", "y", "z"][k];
        let tilt = (now.acc[k] - before.acc[k]).abs() / c.acc_counts_per_g;
        let shaken = (before.acc_variance[k] + now.acc_variance[k]).sqrt() / c.acc_counts_per_g;
        if tilt > STEADY_G + 4.0 * shaken {
            return Some(format!("acc_{axis} moved by {tilt:.3} g within a second"));
        }
        if now.acc_rms[k] > QUIET_G * c.acc_counts_per_g {
            return Some(format!("acc_{axis} shakes"));
        }
        let noise = (before.gyro_variance[k] + now.gyro_variance[k]).sqrt();
        let apart = (now.gyro[k] - before.gyro[k]).abs();
        // A turn there and back within a block leaves its mean, and not its spread.
        let wider = now.gyro_rms[k] - 3.0 * before.gyro_rms[k];
        if apart > STEADY_DPS + 4.0 * noise || wider > STEADY_DPS {
            let turned = apart.max(now.gyro_rms[k]);
            return Some(format!("gyro_{axis} turned by {turned:.1} deg/s"));
        }
    }
    None
}

/// The variance of a block's mean of each gyro, from neighbouring blocks: what a walk of the bias does between two of them is
/// small, and what the gyro's filter does to neighbouring readings is in it. `runs` of blocks, each without a gap.
#[must_use]
pub fn white(runs: &[&[Block]]) -> [f64; 3] {
    [0, 1, 2].map(|k| {
        let pairs = runs.iter().flat_map(|run| run.windows(2));
        let (sum, count) = pairs.fold((0.0, 0.0), |(sum, count), pair| {
            (
                sum + (pair[1].gyro[k] - pair[0].gyro[k]).powi(2) / 2.0,
                count + 1.0,
            )
        });
        sum / f64::max(count, 1.0)
    })
}
