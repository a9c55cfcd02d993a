//! A capture straight from a model file.

use rand_core::SeedableRng;
use rand_distr::{Distribution, Normal, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::effect::Stage;
use crate::effects::effect;
use crate::excitation::{World, moved_like, slow};
use crate::file::{ChannelModel, ModelFile};
use crate::record::{Axis, Base, Channel, Header, Quantity, Record, flag};

/// Unit per count of the ADIS16250's temperature, degC, and reading of the count 0.
pub(crate) const TEMP_LSB_C: f64 = 0.1453;
const TEMP_ZERO_C: f64 = 25.0;
/// Unit per count of the ADIS16250's supply reading, V.
pub(crate) const SUPPLY_LSB_V: f64 = 1.8315e-3;
/// Accelerometer on the 10-bit converter at 3.3 V, 800 mV/g: zero and scale in counts.
const ACC_ZERO: f64 = 512.0;
pub(crate) const ACC_PER_G: f64 = 248.24;
/// Noise of the accelerometer, g rms (data sheet: 4.7 mV at 800 mV/g).
pub(crate) const ACC_NOISE_G: f64 = 4.7 / 800.0;
/// Reading noise of temperature and supply, counts.
const SLOW_NOISE_COUNTS: f64 = 0.5;
/// Length of a tick of the board, s, and its stated tolerance.
const TICK_S: f64 = 4e-6;
const TICK_TOLERANCE_PPM: f64 = 100.0;
/// Standard gravity, m/s^2.
pub(crate) const STANDARD_GRAVITY: f64 = 9.80665;
/// Step of a channel whose model states none, deg/s: a file holds counts, and these are far below the noise of any gyro.
const STEPLESS_DPS: f64 = 1e-6;
/// Limits of the 14-bit word.
const COUNT_LIMIT: i32 = 8191;
/// Time a frame spends on the line, s, and its spread.
const LATENCY_S: (f64, f64) = (0.018, 0.0005);

/// Why a model cannot be simulated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SimulateError {
    /// A rate that is none.
    #[error("the rate is {found} Hz; it has to be above 0")]
    BadRate {
        /// What was given, Hz.
        found: f64,
    },
    /// A length and a rate that make no record together.
    #[error(
        "{seconds} s at {rate_hz} Hz are {:.0} samples; a simulated record has 1 to {limit}",
        seconds * rate_hz
    )]
    BadLength {
        /// Length, s.
        seconds: f64,
        /// Sample rate, Hz.
        rate_hz: f64,
        /// Longest record, samples.
        limit: usize,
    },
    /// A channel that is no gyro axis.
    #[error(
        "channel {name}: only gyro_x, gyro_y and gyro_z in deg/s can be simulated, this one is in {unit}"
    )]
    NotAGyro {
        /// Its name.
        name: String,
        /// Its unit.
        unit: String,
    },
    /// An effect that the library does not have.
    #[error("no effect {cause}")]
    NoEffect {
        /// Its id.
        cause: String,
    },
}

/// Longest record, samples.
const LONGEST: usize = 400_000_000;

/// A run while it is being simulated. Effects act on it, stage by stage.
pub struct Simulation {
    /// Sample rate, Hz.
    pub rate_hz: f64,
    /// Samples.
    pub samples: usize,
    /// Random numbers.
    pub rng: Xoshiro256PlusPlus,
    /// Die temperature by axis, degC.
    pub temperature: [Vec<f64>; 3],
    /// Supply, V.
    pub supply: Vec<f64>,
    /// Motor duty, -1..1.
    pub duty: Vec<f64>,
    /// Specific force, g.
    pub acc: [Vec<f64>; 3],
    /// True rate, deg/s.
    pub motion: [Vec<f64>; 3],
    /// Scale factor over the stated one.
    pub scale: [f64; 3],
    /// Errors of the rate but for the white noise, deg/s.
    pub rate: [Vec<f64>; 3],
    /// White standard deviation of the baseline, deg/s.
    pub white_sigma: [f64; 3],
    /// White variance over that of the baseline.
    pub variance: [Vec<f64>; 3],
    /// White noise, deg/s; empty before the stage [`Stage::Output`].
    pub white: [Vec<f64>; 3],
    /// Readings, counts; empty before the stage [`Stage::Counts`].
    pub counts: [Vec<i32>; 3],
    /// Flags.
    pub flags: Vec<u16>,
    /// Frames that arrive.
    pub keep: Vec<bool>,
    /// Device time, s.
    pub device_time: Vec<f64>,
    /// Host time, s.
    pub host_time: Vec<f64>,
}

/// Simulate a run in the world that the model file states.
///
/// # Errors
/// [`SimulateError`] when the length makes no record or the model names what cannot be simulated.
pub fn simulate(
    model: &ModelFile,
    seconds: f64,
    rate_hz: f64,
    seed: u64,
) -> Result<Record, SimulateError> {
    if !(rate_hz.is_finite() && rate_hz > 0.0) {
        return Err(SimulateError::BadRate { found: rate_hz });
    }
    let samples = (seconds * rate_hz).round();
    if !(samples >= 1.0 && samples <= LONGEST as f64) {
        return Err(SimulateError::BadLength {
            seconds,
            rate_hz,
            limit: LONGEST,
        });
    }
    let samples = samples as usize;
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let world = World::stated(&model.excitation, samples, rate_hz, &mut rng);
    run(model, world, &Default::default(), rate_hz, rng)
}

/// Simulate the model in the world that a record saw: its temperatures, supply, motor command and accelerations.
///
/// # Errors
/// As [`simulate`].
pub fn simulate_in_the_world_of(
    model: &ModelFile,
    record: &Record,
    rate_hz: f64,
    seed: u64,
) -> Result<Record, SimulateError> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let samples = record.len();
    if samples == 0 {
        return Err(SimulateError::BadLength {
            seconds: 0.0,
            rate_hz,
            limit: LONGEST,
        });
    }
    let mut world = World::stated(&model.excitation, samples, rate_hz, &mut rng);
    let (model, read) = &moved_like(model, record, rate_hz);
    // What the other axes take of a motion.
    for (motion, read) in world.motion.iter_mut().zip(read) {
        if let Some(read) = read {
            let mean = read.iter().sum::<f64>() / samples as f64;
            *motion = read.iter().map(|v| v - mean).collect();
        }
    }
    for axis in Axis::ALL {
        let own = record
            .of(Quantity::Temp, Some(axis))
            .or_else(|| record.of(Quantity::Temp, None));
        if let Some(t) = own.and_then(|c| held(&c.values, 1.0)) {
            world.temperature[axis.index()] = t;
        }
        if let Some(a) = record
            .of(Quantity::Acc, Some(axis))
            .and_then(|c| held(&c.values, 1.0 / STANDARD_GRAVITY))
        {
            world.acc[axis.index()] = a;
        }
    }
    if let Some(u) = record
        .all(Quantity::Supply)
        .next()
        .and_then(|c| held(&c.values, 1.0))
    {
        world.supply = u;
    }
    if let Some(d) = record
        .all(Quantity::Pwm)
        .next()
        .and_then(|c| held(&c.values, 1.0 / 255.0))
    {
        world.duty = d;
    }
    run(model, world, read, rate_hz, rng)
}

/// The values, those that are missing as the ones before them, times a scale; none where none is known.
pub(crate) fn held(values: &[f64], scale: f64) -> Option<Vec<f64>> {
    let mut last = *values.iter().find(|v| v.is_finite())?;
    let each = values.iter().map(|v| {
        if v.is_finite() {
            last = *v;
        }
        last * scale
    });
    Some(each.collect())
}

fn axis_of(channel: &ChannelModel) -> Result<usize, SimulateError> {
    let axis = ["gyro_x", "gyro_y", "gyro_z"]
        .iter()
        .position(|n| *n == channel.name);
    match axis {
        Some(axis) if channel.unit == "deg/s" => Ok(axis),
        _ => Err(SimulateError::NotAGyro {
            name: channel.name.clone(),
            unit: channel.unit.clone(),
        }),
    }
}

/// A run in a world; of the axes whose slow part was `read`, deg/s, that is the run's.
fn run(
    model: &ModelFile,
    world: World,
    read: &[Option<Vec<f64>>; 3],
    rate_hz: f64,
    rng: Xoshiro256PlusPlus,
) -> Result<Record, SimulateError> {
    let samples = world.duty.len();
    let zeros = || std::array::from_fn(|_| vec![0.0; samples]);
    let mut s = Simulation {
        rate_hz,
        samples,
        rng,
        temperature: world.temperature,
        supply: world.supply,
        duty: world.duty,
        acc: world.acc,
        motion: world.motion,
        scale: [1.0; 3],
        rate: zeros(),
        white_sigma: [0.0; 3],
        variance: std::array::from_fn(|_| vec![1.0; samples]),
        white: Default::default(),
        counts: Default::default(),
        flags: vec![flag::IN_ORDER; samples],
        keep: vec![true; samples],
        device_time: (0..samples).map(|i| i as f64 / rate_hz).collect(),
        host_time: (0..samples).map(|i| i as f64 / rate_hz).collect(),
    };
    let mut lsb = [None; 3];
    let mut present = [false; 3];
    for channel in &model.channels {
        let axis = axis_of(channel)?;
        present[axis] = true;
        lsb[axis] = channel.lsb;
        baseline(channel, axis, &mut s);
    }
    let acting: Vec<_> = model
        .effects
        .iter()
        .map(|e| {
            let known = effect(&e.cause).ok_or_else(|| SimulateError::NoEffect {
                cause: e.cause.clone(),
            })?;
            let channels: Vec<usize> = ["gyro_x", "gyro_y", "gyro_z"]
                .iter()
                .enumerate()
                .filter(|(i, n)| {
                    present[*i] && (e.channels.is_empty() || e.channels.iter().any(|c| c == *n))
                })
                .map(|(i, _)| i)
                .collect();
            Ok((known, e, channels))
        })
        .collect::<Result<_, SimulateError>>()?;
    let stage = |at: Stage, s: &mut Simulation| {
        for (known, e, channels) in acting.iter().filter(|(known, ..)| known.stage() == at) {
            known.simulate(&e.parameters, channels, s);
        }
    };
    stage(Stage::World, &mut s);
    stage(Stage::Rate, &mut s);
    stage(Stage::Noise, &mut s);
    for axis in 0..3 {
        let sigma = s.white_sigma[axis];
        s.white[axis] = (0..samples)
            .map(|i| {
                let e: f64 = StandardNormal.sample(&mut s.rng);
                sigma * s.variance[axis][i].sqrt() * e
            })
            .collect();
    }
    stage(Stage::Output, &mut s);
    for (axis, own) in lsb.iter().enumerate() {
        let unit = own.unwrap_or(STEPLESS_DPS);
        let mut rate: Vec<f64> = (0..samples)
            .map(|i| s.scale[axis] * s.motion[axis][i] + s.rate[axis][i] + s.white[axis][i])
            .collect();
        if let Some(read) = &read[axis] {
            let own = slow(&rate, rate_hz);
            let moved = rate.iter_mut().zip(own.iter().zip(read));
            moved.for_each(|(w, (own, read))| *w += read - own);
        }
        s.counts[axis] = rate
            .iter()
            .map(|w| {
                let limit = if own.is_some() {
                    COUNT_LIMIT
                } else {
                    i32::MAX - 1
                };
                (w / unit)
                    .round()
                    .clamp(f64::from(-limit - 1), f64::from(limit)) as i32
            })
            .collect();
    }
    stage(Stage::Counts, &mut s);
    stage(Stage::Frames, &mut s);
    Ok(frames(s, model, present, lsb))
}

/// Bias and random walk of a channel, and the size of its white noise.
fn baseline(channel: &ChannelModel, axis: usize, s: &mut Simulation) {
    let get = |name: &str| channel.baseline.get(name).map_or(0.0, |p| p.value);
    // deg/sqrt(h) -> deg/s at one sample: N sqrt(rate), N in deg/s/sqrt(Hz).
    s.white_sigma[axis] = get("angle_random_walk") / 60.0 * s.rate_hz.sqrt();
    let step = get("rate_random_walk") / s.rate_hz.sqrt();
    let mut level = get("bias");
    for rate in &mut s.rate[axis] {
        *rate += level;
        let e: f64 = StandardNormal.sample(&mut s.rng);
        level += step * e;
    }
}

/// The record that the host writes.
fn frames(
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
