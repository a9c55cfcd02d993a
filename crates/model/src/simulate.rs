//! A capture straight from a model file.

mod frames;
mod prepared;
mod replicas;
mod unnamed;

pub use replicas::Replicas;

use std::ops::Range;

use rand_core::{Rng, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::effects::double_rounding::Halves;
use crate::effects::wandering_line::Turned;
use crate::excitation::{Recorded, World, moved_like};
use crate::file::{ChannelModel, ModelFile};
use crate::one_source::Felt;
use crate::range::written;
use crate::record::{Axis, Quantity, Record};
use frames::frames;
use prepared::Prepared;

/// Unit per count of the ADIS16250's temperature, degC.
pub(crate) const TEMP_LSB_C: f64 = 0.1453;
/// Unit per count of the ADIS16250's supply reading, V.
pub(crate) const SUPPLY_LSB_V: f64 = 1.8315e-3;
/// Scale of the accelerometer on the 10-bit converter at 3.3 V, 800 mV/g, counts.
pub(crate) const ACC_PER_G: f64 = 248.24;
/// Noise of the accelerometer, g rms (data sheet: 4.7 mV at 800 mV/g).
pub(crate) const ACC_NOISE_G: f64 = 4.7 / 800.0;
/// Standard gravity, m/s^2.
pub(crate) const STANDARD_GRAVITY: f64 = 9.80665;
/// Step of a channel whose model states none, deg/s: a file holds counts, and these are far below the noise of any gyro.
const STEPLESS_DPS: f64 = 1e-6;
/// Limit of a count in a file. The word of a part may be shorter: what clips is said by `saturation`.
const COUNT_LIMIT: i32 = i32::MAX - 1;
/// Why a model cannot be simulated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SimulateError {
    /// A rate that is none.
    #[error("the rate is {} Hz; it has to be above 0", written(*found))]
    BadRate {
        /// What was given, Hz.
        found: f64,
    },
    /// A length and a rate that make no record together.
    #[error(
        "{} s at {} Hz are {} samples; a simulated record has 1 to {limit}",
        written(*seconds),
        written(*rate_hz),
        written((seconds * rate_hz).round())
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
        "channel {name}: only gyro_x, gyro_y and gyro_z in deg/s, and acc_x, acc_y and acc_z, can be simulated, this one is in {unit}"
    )]
    NotAGyro {
        /// Its name.
        name: String,
        /// Its unit.
        unit: String,
    },
    /// An unnamed term follows a channel that the world of a simulation has not.
    #[error(
        "nothing in a simulation reads as {name}; a term may follow temp_x, temp_y, temp_z, supply, acc_x, acc_y, acc_z or pwm"
    )]
    NothingToFollow {
        /// The channel.
        name: String,
    },
    /// An axis that shares all of its noise, and more.
    #[error(
        "{name} shares white noise with other axes by correlations whose sizes add up to {sum}; that has to be below 1"
    )]
    TooCorrelated {
        /// The axis.
        name: String,
        /// The sum.
        sum: f64,
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
#[derive(Clone)]
pub struct Simulation {
    /// Sample rate, Hz.
    pub rate_hz: f64,
    /// Samples that are simulated.
    pub samples: usize,
    /// Samples of the whole run, those between the stretches included.
    pub span: usize,
    /// The stretches of the run that are simulated, one after the other.
    pub stretches: Vec<Stretch>,
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
    /// Oscillations of axes, where others feel them too.
    pub felt: Option<Vec<Felt>>,
    /// Rotors of which some tone has been drawn.
    pub rotors: Vec<Turned>,
    /// Whether the axes are those of accelerometers.
    pub of_accelerometers: bool,
    /// White standard deviation of the baseline, rounding included, deg/s.
    pub white_sigma: [f64; 3],
    /// Variance that rounding to the step of the readings adds, (deg/s)^2.
    pub rounding: [f64; 3],
    /// White noise that the axis shares with others, deg/s; empty where it shares none.
    pub shared: [Vec<f64>; 3],
    /// Part of the white variance of each axis that it shares with no other one by their correlation.
    pub own: [f64; 3],
    /// White variance over that of the baseline and the shared part.
    pub variance: [Vec<f64>; 3],
    /// White noise, deg/s; empty before the stage [`Stage::Output`].
    pub white: [Vec<f64>; 3],
    /// A rounding by the sensor before the readings are rounded to their step.
    pub sensor_step: [Option<SensorStep>; 3],
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

/// Codes of a sensor that are rounded once more.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorStep {
    /// Their step, deg/s.
    pub step: f64,
    /// Their zero, deg/s.
    pub zero: f64,
    /// What becomes of one half-way between two readings.
    pub halves: Halves,
}

impl SensorStep {
    /// Nearer to the middle of two readings than this part of a step, a code is half-way.
    const HALF_WAY: f64 = 1e-6;

    /// The code nearest to a rate, in the unit of the readings, deg/s, and off the middle of two of them.
    fn read(self, rate: f64, unit: f64) -> f64 {
        let own = ((rate - self.zero) / self.step).round();
        let code = (self.step * own + self.zero) / unit;
        let below = code.floor();
        if (code - below - 0.5).abs() > Self::HALF_WAY {
            return code;
        }
        let up = self.halves.up(own, self.step, below, (1.0 / unit).round());
        below + f64::from(u8::from(up))
    }
}

/// Samples of a simulation without a gap between them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stretch {
    /// Their places in the columns of the simulation.
    pub samples: Range<usize>,
    /// Samples of the run since the stretch before, or since its start, that are not simulated.
    pub skipped: usize,
}

impl Simulation {
    /// Of so many events at random times in the whole run, those that the samples simulated see.
    pub fn events(&mut self, in_all: usize) -> usize {
        if self.samples == self.span {
            return in_all;
        }
        let seen = self.samples as f64 / self.span as f64;
        let mut falls = |_: &usize| self.rng.next_u64() as f64 / u64::MAX as f64 <= seen;
        (0..in_all).filter(|k| falls(k)).count()
    }

    /// Adds to the rate of an axis a Gauss-Markov process of so many deg/s that is correlated over so many samples.
    pub fn add_markov(&mut self, axis: usize, sigma: f64, samples: f64) {
        let pole = |apart: f64| {
            if samples > 0.0 {
                (-apart / samples).exp()
            } else {
                0.0
            }
        };
        let (p, step) = (pole(1.0), sigma * (1.0 - pole(2.0)).sqrt());
        let mut rates = std::mem::take(&mut self.rate[axis]);
        let mut x = sigma * self.normal();
        for k in 0..self.stretches.len() {
            let Stretch { samples, skipped } = self.stretches[k].clone();
            if skipped > 0 {
                let kept = pole(skipped as f64);
                x = kept * x + sigma * (1.0 - kept * kept).sqrt() * self.normal();
            }
            for rate in &mut rates[samples] {
                *rate += x;
                x = p * x + step * self.normal();
            }
        }
        self.rate[axis] = rates;
    }

    /// A draw from a standard normal distribution.
    pub(crate) fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.rng)
    }
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
    run(model, world, Default::default(), rate_hz, rng)
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
    let (model, world, read) = world_of(model, model, record, rate_hz, Some(&mut rng))?;
    run(&model, world, read, rate_hz, rng)
}

/// What each gyro read, where the record has it.
type Read = [Option<Vec<f64>>; 3];

/// The model as it is simulated in the world of a record, that world, and the slow part of each axis that moved, deg/s, the motion
/// as the model `by` understands what was read. Without random numbers nothing is drawn of which the record says what it was.
fn world_of(
    model: &ModelFile,
    by: &ModelFile,
    record: &Record,
    rate_hz: f64,
    rng: Option<&mut Xoshiro256PlusPlus>,
) -> Result<(ModelFile, World, Read), SimulateError> {
    let samples = record.len();
    if samples == 0 {
        return Err(SimulateError::BadLength {
            seconds: 0.0,
            rate_hz,
            limit: LONGEST,
        });
    }
    let seen = |quantity, axis: Option<Axis>, scale: f64| {
        let channel = match axis {
            Some(axis) => record.of(quantity, Some(axis)),
            None => record.all(quantity).next(),
        };
        channel.and_then(|c| held(&c.values, scale))
    };
    let any = record.of(Quantity::Temp, None);
    let temperature = Axis::ALL.map(|axis| {
        let own = record.of(Quantity::Temp, Some(axis)).or(any);
        own.and_then(|c| held(&c.values, 1.0))
    });
    let recorded = Recorded {
        temperature,
        supply: seen(Quantity::Supply, None, 1.0),
        duty: seen(Quantity::Pwm, None, 1.0 / 255.0),
        acc: Axis::ALL.map(|axis| seen(Quantity::Acc, Some(axis), 1.0 / STANDARD_GRAVITY)),
    };
    let mut world = World::stated_but(&model.excitation, samples, rate_hz, rng, recorded);
    let (model, moved) = moved_like(model, by, record, rate_hz);
    // What the other axes take of a motion.
    let mut read = Read::default();
    for (axis, moved) in moved.into_iter().enumerate() {
        if let Some(moved) = moved {
            world.motion[axis] = moved.motion;
            read[axis] = Some(moved.read);
        }
    }
    Ok((model, world, read))
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

/// Sensors of one kind on three axes: a run is simulated for one bank at a time.
pub(crate) const BANKS: [[&str; 3]; 2] =
    [["gyro_x", "gyro_y", "gyro_z"], ["acc_x", "acc_y", "acc_z"]];

/// The axis of a channel of that name.
pub(crate) fn axis_named(name: &str) -> Option<usize> {
    BANKS
        .iter()
        .find_map(|names| names.iter().position(|n| *n == name))
}

fn axis_of(channel: &ChannelModel) -> Result<usize, SimulateError> {
    let is_gyro = BANKS[0].contains(&channel.name.as_str());
    match axis_named(&channel.name) {
        Some(axis) if !is_gyro || channel.unit == "deg/s" => Ok(axis),
        _ => Err(SimulateError::NotAGyro {
            name: channel.name.clone(),
            unit: channel.unit.clone(),
        }),
    }
}

/// White standard deviation of a reading for a random walk of the angle, or of the velocity, of the unit that the channel's has.
#[must_use]
pub fn white_of(unit: &str, walk: f64, rate_hz: f64) -> f64 {
    // deg/sqrt(h) -> deg/s at one sample: N sqrt(rate), N in deg/s/sqrt(Hz); any other unit U in U/sqrt(Hz).
    let per_root_hertz = if unit == "deg/s" { walk / 60.0 } else { walk };
    per_root_hertz * rate_hz.sqrt()
}

/// What of a model concerns a bank. An effect that names no channel is the gyros', and that of the frames.
fn bank_of(model: &ModelFile, names: [&str; 3]) -> ModelFile {
    let own = |c: &String| names.contains(&c.as_str());
    let mut bank = model.clone();
    bank.channels.retain(|c| own(&c.name));
    bank.effects.retain_mut(|e| {
        let of_all = e.channels.is_empty() && names == BANKS[0];
        e.channels.retain(own);
        of_all || !e.channels.is_empty()
    });
    bank.unnamed.retain(|u| u.channels.iter().all(own));
    bank
}

/// A run in a world; of the axes whose slow part was `read`, deg/s, that is the run's.
fn run(
    model: &ModelFile,
    world: World,
    read: [Option<Vec<f64>>; 3],
    rate_hz: f64,
    rng: Xoshiro256PlusPlus,
) -> Result<Record, SimulateError> {
    let others = |c: &ChannelModel| !BANKS.iter().flatten().any(|n| *n == c.name);
    if let Some(unknown) = model.channels.iter().find(|c| others(c)) {
        axis_of(unknown)?;
    }
    let [gyros, accelerometers] = BANKS.map(|names| bank_of(model, names));
    let felt = (!accelerometers.channels.is_empty())
        .then(|| felt(&accelerometers, world.clone(), rate_hz, rng.clone()));
    let mut prepared = Prepared::new(&gyros, world, read, rate_hz, rng)?;
    prepared.clocks();
    prepared.draw(None);
    prepared.frames();
    let mut record = frames(prepared.run, model, prepared.present, prepared.lsb);
    if let Some(felt) = felt {
        frames::put(&mut record, felt?);
    }
    Ok(record)
}

/// A channel that is simulated: its name, its readings and their unit.
type Simulated = (String, Vec<i32>, f64, String);

/// What the accelerometers of a model read: their bias holds the part of gravity that they feel.
fn felt(
    model: &ModelFile,
    world: World,
    rate_hz: f64,
    mut rng: Xoshiro256PlusPlus,
) -> Result<Vec<Simulated>, SimulateError> {
    // Random numbers that the gyros do not have.
    rng.long_jump();
    let mut prepared = Prepared::new(model, world, Default::default(), rate_hz, rng)?;
    prepared.clocks();
    prepared.draw(None);
    let each = model.channels.iter().map(|c| {
        let axis = axis_of(c)?;
        let counts = std::mem::take(&mut prepared.run.counts[axis]);
        Ok((c.name.clone(), counts, prepared.steps[axis], c.unit.clone()))
    });
    each.collect()
}
