//! What the board sends and the host writes of a simulated run.

use rand_distr::{Distribution, Normal, StandardNormal};

use super::{
    ACC_NOISE_G, ACC_PER_G, STANDARD_GRAVITY, STEPLESS_DPS, SUPPLY_LSB_V, Simulation, TEMP_LSB_C,
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

/// The record that the host writes.
pub(super) fn frames(
    mut s: Simulation,
    model: &ModelFile,
    present: [bool; 3],
    lsb: [Option<f64>; 3],
) -> Record {
    let rows: Vec<usize> = (0..s.samples).filter(|i| s.keep[*i]).collect();
    let mut channels = vec![];
    let mut push = |name: String,
                    quantity,
                    axis,
                    unit: &str,
                    counts: Vec<i32>,
                    scale: f64,
                    zero: f64,
                    offset: f64| {
        channels.push(Channel {
            name,
            quantity,
            axis,
            unit: unit.to_owned(),
            values: counts
                .iter()
                .map(|c| scale * (f64::from(*c) - zero) + offset)
                .collect(),
            counts: Some(counts),
            lsb: Some(scale),
        });
    };
    const NAMES: [&str; 3] = ["x", "y", "z"];
    for axis in Axis::ALL.into_iter().filter(|a| present[a.index()]) {
        let i = axis.index();
        let counts = rows.iter().map(|r| s.counts[i][*r]).collect();
        let name = format!("gyro_{}", NAMES[i]);
        push(
            name,
            Quantity::Gyro,
            Some(axis),
            "deg/s",
            counts,
            lsb[i].unwrap_or(STEPLESS_DPS),
            0.0,
            0.0,
        );
    }
    let mut read = |value: f64, zero: f64, per_unit: f64, noise: f64| -> i32 {
        let e: f64 = StandardNormal.sample(&mut s.rng);
        ((value - zero) * per_unit + noise * e).round() as i32
    };
    for axis in Axis::ALL {
        let i = axis.index();
        let counts = rows
            .iter()
            .map(|r| {
                read(
                    s.temperature[i][*r],
                    TEMP_ZERO_C,
                    1.0 / TEMP_LSB_C,
                    SLOW_NOISE_COUNTS,
                )
            })
            .collect();
        push(
            format!("temp_{}", NAMES[i]),
            Quantity::Temp,
            Some(axis),
            "degC",
            counts,
            TEMP_LSB_C,
            0.0,
            TEMP_ZERO_C,
        );
    }
    let counts = rows
        .iter()
        .map(|r| read(s.supply[*r], 0.0, 1.0 / SUPPLY_LSB_V, SLOW_NOISE_COUNTS))
        .collect();
    push(
        "supply".into(),
        Quantity::Supply,
        None,
        "V",
        counts,
        SUPPLY_LSB_V,
        0.0,
        0.0,
    );
    for axis in Axis::ALL {
        let i = axis.index();
        let counts = rows
            .iter()
            .map(|r| {
                (ACC_ZERO as i32 + read(s.acc[i][*r], 0.0, ACC_PER_G, ACC_NOISE_G * ACC_PER_G))
                    .clamp(0, 1023)
            })
            .collect();
        let scale = STANDARD_GRAVITY / ACC_PER_G;
        push(
            format!("acc_{}", NAMES[i]),
            Quantity::Acc,
            Some(axis),
            "m/s^2",
            counts,
            scale,
            ACC_ZERO,
            0.0,
        );
    }
    let counts = rows
        .iter()
        .map(|r| (s.duty[*r] * 255.0).round() as i32)
        .collect();
    push(
        "pwm".into(),
        Quantity::Pwm,
        None,
        "1",
        counts,
        1.0,
        0.0,
        0.0,
    );
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
