//! What the board sends and the host writes of a simulated run.

use rand_distr::{Distribution, Normal, StandardNormal};

use super::{
    ACC_NOISE_G, ACC_PER_G, STANDARD_GRAVITY, STEPLESS_DPS, SUPPLY_LSB_V, Simulated, Simulation,
    TEMP_LSB_C,
};
use crate::file::ModelFile;
use crate::record::{Axis, Base, Channel, Header, Quantity, Record};

/// Reading of the count 0, degC.
const TEMP_ZERO_C: f64 = 25.0;
/// Accelerometer on the 10-bit converter at 3.3 V, 800 mV/g: zero and scale in counts.
const ACC_ZERO: f64 = 512.0;
/// Reading noise of temperature and supply, counts.
const SLOW_NOISE_COUNTS: f64 = 0.5;
/// Length of a tick of the board, s, and its stated tolerance.
const TICK_S: f64 = 4e-6;
const TICK_TOLERANCE_PPM: f64 = 100.0;
/// Time a frame spends on the line, s, and its spread.
const LATENCY_S: (f64, f64) = (0.018, 0.0005);

/// Names of the axes.
const NAMES: [&str; 3] = ["x", "y", "z"];

/// Counts of a channel, and what they mean: value = scale (count - zero) + offset.
struct Counted<'a> {
    name: String,
    quantity: Quantity,
    axis: Option<Axis>,
    unit: &'a str,
    counts: Vec<i32>,
    scale: f64,
    zero: f64,
    offset: f64,
}

impl Counted<'_> {
    fn channel(self) -> Channel {
        let value = |c: &i32| self.scale * (f64::from(*c) - self.zero) + self.offset;
        Channel {
            values: self.counts.iter().map(value).collect(),
            name: self.name,
            quantity: self.quantity,
            axis: self.axis,
            unit: self.unit.to_owned(),
            counts: Some(self.counts),
            lsb: Some(self.scale),
        }
    }
}

/// A reading in counts, with its noise.
fn read(rng: &mut impl rand_core::Rng, value: f64, zero: f64, per_unit: f64, noise: f64) -> i32 {
    let e: f64 = StandardNormal.sample(rng);
    ((value - zero) * per_unit + noise * e).round() as i32
}

fn gyro(s: &Simulation, rows: &[usize], axis: Axis, lsb: Option<f64>) -> Channel {
    let i = axis.index();
    Counted {
        name: format!("gyro_{}", NAMES[i]),
        quantity: Quantity::Gyro,
        axis: Some(axis),
        unit: "deg/s",
        counts: rows.iter().map(|r| s.counts[i][*r]).collect(),
        scale: lsb.unwrap_or(STEPLESS_DPS),
        zero: 0.0,
        offset: 0.0,
    }
    .channel()
}

fn temperature(s: &mut Simulation, rows: &[usize], axis: Axis) -> Channel {
    let i = axis.index();
    let per_unit = 1.0 / TEMP_LSB_C;
    let (truth, rng) = (&s.temperature[i], &mut s.rng);
    let counts = rows
        .iter()
        .map(|r| read(rng, truth[*r], TEMP_ZERO_C, per_unit, SLOW_NOISE_COUNTS))
        .collect();
    Counted {
        name: format!("temp_{}", NAMES[i]),
        quantity: Quantity::Temp,
        axis: Some(axis),
        unit: "degC",
        counts,
        scale: TEMP_LSB_C,
        zero: 0.0,
        offset: TEMP_ZERO_C,
    }
    .channel()
}

fn supply(s: &mut Simulation, rows: &[usize]) -> Channel {
    let (truth, rng) = (&s.supply, &mut s.rng);
    let counts = rows
        .iter()
        .map(|r| read(rng, truth[*r], 0.0, 1.0 / SUPPLY_LSB_V, SLOW_NOISE_COUNTS))
        .collect();
    Counted {
        name: "supply".into(),
        quantity: Quantity::Supply,
        axis: None,
        unit: "V",
        counts,
        scale: SUPPLY_LSB_V,
        zero: 0.0,
        offset: 0.0,
    }
    .channel()
}

fn accelerometer(s: &mut Simulation, rows: &[usize], axis: Axis) -> Channel {
    let i = axis.index();
    let noise = ACC_NOISE_G * ACC_PER_G;
    let (truth, rng) = (&s.acc[i], &mut s.rng);
    let counts = rows
        .iter()
        .map(|r| (ACC_ZERO as i32 + read(rng, truth[*r], 0.0, ACC_PER_G, noise)).clamp(0, 1023))
        .collect();
    Counted {
        name: format!("acc_{}", NAMES[i]),
        quantity: Quantity::Acc,
        axis: Some(axis),
        unit: "m/s^2",
        counts,
        scale: STANDARD_GRAVITY / ACC_PER_G,
        zero: ACC_ZERO,
        offset: 0.0,
    }
    .channel()
}

/// Puts simulated accelerometers in the place of the stand's.
pub(super) fn put(record: &mut Record, channels: Vec<Simulated>) {
    let rows: Vec<usize> = match &record.seq {
        Some(seq) => seq.iter().map(|s| *s as usize).collect(),
        None => (0..record.len()).collect(),
    };
    for (name, counts, step, unit) in channels {
        let scale = if unit == "g" {
            step * STANDARD_GRAVITY
        } else {
            step
        };
        let Some(own) = record.channels.iter_mut().find(|c| c.name == name) else {
            continue;
        };
        let counts: Vec<i32> = rows.iter().map(|r| counts[*r]).collect();
        own.values = counts.iter().map(|c| scale * f64::from(*c)).collect();
        // A file holds what the converter has read: those of a step of its own are no counts of it.
        let same = own.lsb.is_some_and(|lsb| (scale / lsb - 1.0).abs() < 1e-6);
        own.counts = same.then(|| counts.iter().map(|c| c + ACC_ZERO as i32).collect());
        own.lsb = Some(scale);
    }
}

fn command(s: &Simulation, rows: &[usize]) -> Channel {
    let count = |r: &usize| (s.duty[*r] * 255.0).round() as i32;
    Counted {
        name: "pwm".into(),
        quantity: Quantity::Pwm,
        axis: None,
        unit: "1",
        counts: rows.iter().map(count).collect(),
        scale: 1.0,
        zero: 0.0,
        offset: 0.0,
    }
    .channel()
}

/// The record that the host writes. The order of the channels is that of the draws.
pub(super) fn frames(
    mut s: Simulation,
    model: &ModelFile,
    present: [bool; 3],
    lsb: [Option<f64>; 3],
) -> Record {
    let rows: Vec<usize> = (0..s.samples).filter(|i| s.keep[*i]).collect();
    let mut channels: Vec<Channel> = (Axis::ALL.into_iter())
        .filter(|a| present[a.index()])
        .map(|a| gyro(&s, &rows, a, lsb[a.index()]))
        .collect();
    channels.extend(Axis::ALL.map(|a| temperature(&mut s, &rows, a)));
    channels.push(supply(&mut s, &rows));
    channels.extend(Axis::ALL.map(|a| accelerometer(&mut s, &rows, a)));
    channels.push(command(&s, &rows));
    let latency = Normal::new(LATENCY_S.0, LATENCY_S.1).ok();
    let host = rows
        .iter()
        .map(|r| s.host_time[*r] + latency.as_ref().map_or(0.0, |l| l.sample(&mut s.rng)))
        .collect();
    Record {
        header: header(&s, model),
        seq: Some(rows.iter().map(|r| *r as u64).collect()),
        t_ticks: Some(
            rows.iter()
                .map(|r| (s.device_time[*r] / TICK_S).round().max(0.0) as u64)
                .collect(),
        ),
        host_time_s: Some(host),
        flags: Some(rows.iter().map(|r| s.flags[*r]).collect()),
        channels,
        notes: vec![],
    }
}

fn header(s: &Simulation, model: &ModelFile) -> Header {
    let turns = crate::excitation::setting_value(&model.excitation, "turn_dps") != 0.0;
    let sways = crate::excitation::setting_value(&model.excitation, "sway_deg") != 0.0;
    let (base, word) = match (turns, sways) {
        (true, _) => (Base::Turntable, "turntable"),
        (_, true) => (Base::Moving, "moving"),
        _ => (Base::Static, "static"),
    };
    let lsb = model
        .channels
        .iter()
        .find_map(|c| c.lsb)
        .unwrap_or(STEPLESS_DPS);
    let entries = [
        ("format", "imu-stand-capture/1".to_owned()),
        ("rate_hz", s.rate_hz.to_string()),
        ("tick_s", TICK_S.to_string()),
        ("tick_tolerance_ppm", TICK_TOLERANCE_PPM.to_string()),
        ("gyro_lsb_dps", lsb.to_string()),
        ("temp_lsb_c", TEMP_LSB_C.to_string()),
        ("temp_zero_c", TEMP_ZERO_C.to_string()),
        ("supply_lsb_v", SUPPLY_LSB_V.to_string()),
        ("acc_zero_counts", ACC_ZERO.to_string()),
        ("acc_counts_per_g", ACC_PER_G.to_string()),
        ("base", word.to_owned()),
        ("stand", model.stand.clone()),
    ];
    Header {
        rate_hz: Some(s.rate_hz),
        tick_s: Some(TICK_S),
        tick_tolerance_ppm: Some(TICK_TOLERANCE_PPM),
        base: Some(base),
        entries: entries
            .into_iter()
            .map(|(k, v)| (k.to_owned(), v))
            .collect(),
    }
}
