//! From frames to rows.

use model::record::{Axis, Base, Channel, Header, Quantity, Record};
use wire::{Corrected, Sample, flags};

use super::STANDARD_GRAVITY;
use super::order::unwrap;

/// What the board's counts mean; goes into the header.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// Samples a second.
    pub rate_hz: f64,
    /// Tick of the time stamps, s.
    pub tick_s: f64,
    /// Tolerance of the board's crystal, ppm.
    pub tick_tolerance_ppm: f64,
    /// deg/s for each count.
    pub gyro_lsb_dps: f64,
    /// ADC counts at 0 g.
    pub acc_zero_counts: f64,
    /// ADC counts for 1 g.
    pub acc_counts_per_g: f64,
    /// What the base does.
    pub base: Base,
    /// Whether the board corrects its rates: the capture then has columns for what it makes of them.
    pub corrected: bool,
}

impl Default for Calibration {
    /// The stand of the paper: 20 Hz, ADIS16250 at 320 deg/s, MMA7260QT at 1.5 g with AREF at its own 3.3 V
    /// (1024 counts / 3.3 V * 0.8 V/g), a 100-ppm crystal.
    fn default() -> Self {
        Self {
            rate_hz: 20.0,
            tick_s: 4e-6,
            tick_tolerance_ppm: 100.0,
            gyro_lsb_dps: GYRO_LSB_DPS,
            acc_zero_counts: 512.0,
            acc_counts_per_g: 1024.0 / 3.3 * 0.8,
            base: Base::Static,
            corrected: false,
        }
    }
}

/// Rates of corrected frames are Q12.20: deg/s a count.
pub(crate) const CORRECTED_LSB_DPS: f64 = 1.0 / (1 << 20) as f64;
/// Names of the corrected rates' columns.
pub(crate) const CORRECTED: [&str; 3] = ["corrected_x", "corrected_y", "corrected_z"];
/// Columns of what else a corrected frame says: the correction's number, the bits of its state, and the attitude, a quaternion.
pub(crate) const OF_CORRECTION: [&str; 6] = [
    "correction",
    "corrected_state",
    "attitude_w",
    "attitude_x",
    "attitude_y",
    "attitude_z",
];
/// Parts of the quaternion are Q2.30.
pub(crate) const ATTITUDE_LSB: f64 = 1.0 / (1 << 30) as f64;
/// How many rows back a corrected frame's sample is looked for: its frame comes behind that sample, a line that is full
/// puts no more than replies and reports in between.
const BEHIND: usize = 8;

/// GYRO_OUT at the 320 deg/s range: deg/s a count (ADIS16250 data sheet).
const GYRO_LSB_DPS: f64 = 0.073_26;
/// TEMP_OUT: degC a count, and the temperature of count 0 (ADIS16250 data sheet).
pub const TEMP: (f64, f64) = (0.1453, 25.0);
/// SUPPLY_OUT: V a count (ADIS16250 data sheet).
pub const SUPPLY_LSB_V: f64 = 1.8315e-3;

/// A sample, when it arrived, s, and what the board made of its rates.
#[derive(Clone, Debug)]
pub(super) struct Row {
    sample: Sample,
    host_time_s: f64,
    corrected: Option<Corrected>,
}

/// Collects frames.
#[derive(Clone, Debug)]
pub struct RecordBuilder {
    calibration: Calibration,
    rows: Vec<Row>,
}

impl RecordBuilder {
    /// Nothing yet.
    #[must_use]
    pub fn new(calibration: Calibration) -> Self {
        Self {
            calibration,
            rows: Vec::new(),
        }
    }

    /// A frame and when it arrived, s.
    pub fn push(&mut self, sample: &Sample, host_time_s: f64) {
        self.rows.push(Row {
            sample: *sample,
            host_time_s,
            corrected: None,
        });
    }

    /// What the board made of the rates of a sample before: goes to its row. From the first one on there are columns for it.
    pub fn corrected(&mut self, corrected: &Corrected) {
        self.calibration.corrected = true;
        let mut behind = self.rows.iter_mut().rev().take(BEHIND);
        if let Some(row) = behind.find(|row| row.sample.seq == corrected.seq) {
            row.corrected = Some(*corrected);
        }
    }

    /// Takes the last row out where its corrected frame may still come.
    pub(super) fn take_waiting(&mut self) -> Option<Row> {
        let waits = |row: &mut Row| row.corrected.is_none();
        let has_columns = self.calibration.corrected;
        self.rows.pop_if(|row| has_columns && waits(row))
    }

    /// Puts it back.
    pub(super) fn put_back(&mut self, row: Option<Row>) {
        self.rows.extend(row);
    }

    /// The board says how it is set: rate, tick and range are taken from it.
    pub fn hello(&mut self, hello: &wire::Hello) {
        // Whole nanoseconds: 4000 ns times 12500 is 20 Hz and not 19.999.
        let period_ns = u64::from(hello.tick_ns)
            * u64::from(hello.period_ticks)
            * u64::from(hello.periods_per_sample.max(1));
        if period_ns > 0 {
            self.calibration.tick_s = f64::from(hello.tick_ns) / 1e9;
            self.calibration.rate_hz = 1e9 / period_ns as f64;
        }
        // Ranges of 320, 160 and 80 deg/s (SENS/AVG bits 10:8) share their codes.
        match hello.gyro_range {
            4 => self.calibration.gyro_lsb_dps = GYRO_LSB_DPS,
            2 => self.calibration.gyro_lsb_dps = GYRO_LSB_DPS / 2.0,
            1 => self.calibration.gyro_lsb_dps = GYRO_LSB_DPS / 4.0,
            _ => {}
        }
        // mV/g at 3.3 V for the four settings of g-select (MMA7260QT data sheet).
        if let Some(millivolt) = [800.0, 600.0, 300.0, 200.0].get(usize::from(hello.acc_range)) {
            self.calibration.acc_counts_per_g = 1024.0 / 3.3 * millivolt * 1e-3;
        }
    }

    /// What the counts mean, as far as is known.
    #[must_use]
    pub fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    /// Forgets the rows.
    pub fn clear(&mut self) {
        self.rows.clear();
    }

    /// Forgets the oldest rows.
    pub fn forget(&mut self, rows: usize) {
        self.rows.drain(..rows.min(self.rows.len()));
    }

    /// Rows so far.
    #[must_use]
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// The record.
    #[must_use]
    pub fn build(&self) -> Record {
        let counter = |of: fn(&Sample) -> u64| -> Vec<u64> {
            self.rows.iter().map(|row| of(&row.sample)).collect()
        };
        Record {
            header: self.header(),
            seq: Some(unwrap(&counter(|s| s.seq.into()), 1 << 16)),
            t_ticks: Some(unwrap(&counter(|s| s.t_ticks.into()), 1 << 32)),
            host_time_s: Some(self.rows.iter().map(|row| row.host_time_s).collect()),
            flags: Some(self.rows.iter().map(|row| row.sample.flags).collect()),
            channels: self.channels(),
            notes: Vec::new(),
        }
    }

    /// What the file says at its head.
    fn header(&self) -> Header {
        let c = &self.calibration;
        let entry = |key: &str, value: f64| (key.to_owned(), format!("{value}"));
        Header {
            rate_hz: Some(c.rate_hz),
            tick_s: Some(c.tick_s),
            tick_tolerance_ppm: Some(c.tick_tolerance_ppm),
            base: Some(c.base),
            entries: vec![
                ("format".to_owned(), "imu-stand-capture/1".to_owned()),
                entry("rate_hz", c.rate_hz),
                entry("tick_s", c.tick_s),
                entry("tick_tolerance_ppm", c.tick_tolerance_ppm),
                entry("gyro_lsb_dps", c.gyro_lsb_dps),
                entry("temp_lsb_c", TEMP.0),
                entry("temp_zero_c", TEMP.1),
                entry("supply_lsb_v", SUPPLY_LSB_V),
                entry("acc_zero_counts", c.acc_zero_counts),
                entry("acc_counts_per_g", c.acc_counts_per_g),
            ]
            .into_iter()
            .chain(
                (c.corrected.then(|| {
                    [
                        entry("corrected_lsb_dps", CORRECTED_LSB_DPS),
                        entry("attitude_lsb", ATTITUDE_LSB),
                    ]
                }))
                .into_iter()
                .flatten(),
            )
            .collect(),
        }
    }

    /// Every channel, in the order of the format.
    fn channels(&self) -> Vec<Channel> {
        let c = &self.calibration;
        let mut channels = Vec::new();
        let acc = (c.acc_zero_counts, STANDARD_GRAVITY / c.acc_counts_per_g);
        for axis in Axis::ALL {
            let k = axis.index();
            // A gyro that does not answer delivers neither a new sample nor an alarm: there is no value.
            let lost = move |s: &Sample| {
                s.flags & flags::GYRO_NOT_ANSWERING != 0
                    && s.flags & (flags::new_data(k as u8) | flags::error(k as u8)) == 0
            };
            channels.push(self.channel(
                "gyro",
                Quantity::Gyro,
                Some(axis),
                "deg/s",
                (0.0, c.gyro_lsb_dps),
                move |s| (!lost(s)).then_some(i32::from(s.gyro[k])),
            ));
        }
        for axis in Axis::ALL {
            let k = axis.index();
            let temp = (-TEMP.1 / TEMP.0, TEMP.0);
            channels.push(self.channel(
                "temp",
                Quantity::Temp,
                Some(axis),
                "degC",
                temp,
                move |s| Some(i32::from(s.temp[k])),
            ));
        }
        channels.push(self.channel(
            "supply",
            Quantity::Supply,
            None,
            "V",
            (0.0, SUPPLY_LSB_V),
            |s| Some(i32::from(s.supply)),
        ));
        for axis in Axis::ALL {
            let k = axis.index();
            channels.push(
                self.channel("acc", Quantity::Acc, Some(axis), "m/s^2", acc, move |s| {
                    (s.flags & flags::ACC_NOT_CONVERTED == 0).then_some(i32::from(s.acc[k]))
                }),
            );
        }
        channels.push(
            self.channel("pwm", Quantity::Pwm, None, "1", (0.0, 1.0), |s| {
                Some(i32::from(s.pwm))
            }),
        );
        if c.corrected {
            channels.extend(self.corrections());
        }
        channels
    }

    fn channel(
        &self,
        stem: &str,
        quantity: Quantity,
        axis: Option<Axis>,
        unit: &str,
        (zero, lsb): (f64, f64),
        count: impl Fn(&Sample) -> Option<i32>,
    ) -> Channel {
        let letter = axis
            .map(|axis| ["_x", "_y", "_z"][axis.index()])
            .unwrap_or_default();
        let counts: Vec<Option<i32>> = self.rows.iter().map(|row| count(&row.sample)).collect();
        Channel {
            axis,
            ..in_counts(
                &format!("{stem}{letter}"),
                quantity,
                unit,
                (zero, lsb),
                &counts,
            )
        }
    }

    /// What the corrected frames say, as columns.
    fn corrections(&self) -> impl Iterator<Item = Channel> {
        let counts = |of: &dyn Fn(&Corrected) -> i32| -> Vec<Option<i32>> {
            let rows = self.rows.iter();
            rows.map(|row| row.corrected.as_ref().map(of)).collect()
        };
        let rates = [0, 1, 2].map(|axis| {
            // A correction that is not applied, as it is for gyros set up otherwise, makes rates that mean nothing.
            let applied = |c: &&Corrected| c.state & wire::correction_state::APPLIED != 0;
            let rows = self.rows.iter();
            let rate = |row: &Row| Some(row.corrected.as_ref().filter(applied)?.rate[axis]);
            let counts: Vec<Option<i32>> = rows.map(rate).collect();
            let scale = (0.0, CORRECTED_LSB_DPS);
            in_counts(CORRECTED[axis], Quantity::Derived, "deg/s", scale, &counts)
        });
        // A firmware without an attitude leaves its cells empty.
        let attitude = [0, 1, 2, 3].map(|part: usize| {
            let rows = self.rows.iter();
            let of = |row: &Row| row.corrected.as_ref()?.attitude.map(|q| q[part]);
            rows.map(of).collect()
        });
        let others = [
            counts(&|c| i32::from(c.correction)),
            counts(&|c| i32::from(c.state)),
        ];
        let lsb = [1.0, 1.0].into_iter().chain([ATTITUDE_LSB; 4]);
        let others = (OF_CORRECTION.into_iter().zip(lsb))
            .zip(others.into_iter().chain(attitude))
            .map(|((name, lsb), counts)| {
                in_counts(name, Quantity::Derived, "1", (0.0, lsb), &counts)
            });
        rates.into_iter().chain(others.collect::<Vec<_>>())
    }
}

/// A channel of counts that mean (count - zero) lsb; rows without one have no value.
fn in_counts(
    name: &str,
    quantity: Quantity,
    unit: &str,
    (zero, lsb): (f64, f64),
    counts: &[Option<i32>],
) -> Channel {
    Channel {
        name: name.to_owned(),
        quantity,
        axis: None,
        unit: unit.to_owned(),
        values: (counts.iter())
            .map(|c| c.map_or(f64::NAN, |c| (f64::from(c) - zero) * lsb))
            .collect(),
        counts: Some(counts.iter().map(|c| c.unwrap_or(0)).collect()),
        lsb: Some(lsb),
    }
}
