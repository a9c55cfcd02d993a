//! From the world to the ADIS16250's output registers: errors, sensor pole, sample clock, Bartlett filter, converter.

use std::f64::consts::TAU;

use rand_xoshiro::Xoshiro256PlusPlus;

use crate::adis16250::{Adis16250, Outputs, status};
use crate::base::Tone;
use crate::random::{Stream, standard_normal, uniform};
use crate::scenario::{Fault, GyroPart, StallFlags};

/// Longest filter: 2 x 64 - 1 taps.
const HISTORY: usize = 128;
/// The filter at which the angle random walk is stated: 2^2 taps.
const STATED_FILTER: u32 = 2;
const STATED_POLE_HZ: f64 = 50.0;
const STATED_PERIOD_S: f64 = 1.0 / 256.0;
const STATED_RATE_HZ: f64 = 20.0;
const SUPPLY_LSB_V: f64 = 1.8315e-3;
const TEMP_LSB_C: f64 = 0.1453;

/// Weights of the Bartlett window: two boxcars of 2^m taps, 2^(m+1) - 1 long, sum 1.
#[must_use]
pub fn bartlett(m: u32) -> Vec<f64> {
    let n = 1i64 << m;
    (1 - n..n)
        .map(|k| (n - k.abs()) as f64 / (n * n) as f64)
        .collect()
}

/// What a gyro meets when it takes a sample.
#[derive(Clone, Copy, Debug, Default)]
pub struct Stimulus {
    /// True rate about its axis, deg/s, but for the tones.
    pub rate_dps: f64,
    /// Its die, degC.
    pub die_c: f64,
    /// Its supply, V.
    pub supply_v: f64,
    /// The motor's current, A.
    pub motor_a: f64,
    /// Specific force along the body axes, g.
    pub acc_g: [f64; 3],
    /// Noise on the common reference, deg/s.
    pub common_dps: f64,
}

/// Everything in a gyro before its registers.
#[derive(Clone, Debug)]
pub struct GyroChain {
    axis: usize,
    part: GyroPart,
    faults: Vec<Fault>,
    tones: Vec<Tone>,
    noise: Xoshiro256PlusPlus,
    bias_noise: Xoshiro256PlusPlus,
    fault_noise: Xoshiro256PlusPlus,
    sensor_noise: Xoshiro256PlusPlus,
    /// rms of the noise behind the analog pole, deg/s.
    sigma_dps: f64,
    analog_noise: f64,
    extra_noise: f64,
    walk_dps: f64,
    wander_dps: f64,
    trapped: bool,
    signal: Option<f64>,
    history: [f64; HISTORY],
    newest: usize,
    weights: (u32, Vec<f64>),
    angle_deg: f64,
}

/// Whether a fault acts on the signal chain of the gyro of an axis.
fn acts_in_chain(fault: &Fault, axis: usize) -> bool {
    match *fault {
        Fault::Tempco { gyro, .. }
        | Fault::MotorCoupling { gyro, .. }
        | Fault::MotorNoise { gyro, .. }
        | Fault::SupplyCoupling { gyro, .. }
        | Fault::Knock { gyro, .. }
        | Fault::WarmUp { gyro, .. }
        | Fault::Leak { gyro, .. }
        | Fault::WanderingBias { gyro, .. }
        | Fault::Trap { gyro, .. }
        | Fault::GSensitivity { gyro, .. }
        | Fault::NoisySpell { gyro, .. } => gyro == axis,
        _ => false,
    }
}

impl GyroChain {
    pub(crate) fn new(
        axis: usize,
        mut part: GyroPart,
        faults: &[Fault],
        tones: &[Tone],
        seed: u64,
    ) -> Self {
        let stated = part.angle_random_walk_deg_sqrt_h / 60.0 * STATED_RATE_HZ.sqrt();
        let density = stated / filter_gain(STATED_POLE_HZ, STATED_PERIOD_S, STATED_FILTER);
        let own: Vec<Fault> = (faults.iter())
            .filter(|fault| acts_in_chain(fault, axis))
            .cloned()
            .collect();
        for fault in faults {
            if let Fault::SlowFilter { gyro, pole_hz } = *fault
                && gyro == axis
            {
                part.pole_hz = pole_hz;
            }
        }
        // Behind a pole the variance of white noise is proportional to the corner.
        let sigma_dps = density * (part.pole_hz / STATED_POLE_HZ).sqrt();
        let id = axis as u8;
        let mut fault_noise = Stream::GyroFault(id).of(seed);
        let trapped = uniform(&mut fault_noise, 0.0, 1.0) < 0.5;
        let wander_dps = standard_normal(&mut fault_noise);
        let mut sensor_noise = Stream::GyroPart(id).of(seed);
        // The first draws of this stream made the part itself.
        for _ in 0..16 {
            standard_normal(&mut sensor_noise);
        }
        GyroChain {
            axis,
            faults: own,
            tones: tones
                .iter()
                .copied()
                .filter(|tone| tone.axis == axis)
                .collect(),
            noise: Stream::GyroNoise(id).of(seed),
            bias_noise: Stream::GyroBias(id).of(seed),
            fault_noise,
            sensor_noise,
            sigma_dps,
            analog_noise: 0.0,
            extra_noise: 0.0,
            walk_dps: part.turn_on_bias_dps,
            wander_dps,
            trapped,
            signal: None,
            history: [0.0; HISTORY],
            newest: 0,
            weights: (0, bartlett(0)),
            angle_deg: 0.0,
            part,
        }
    }

    /// The axis this gyro measures.
    #[must_use]
    pub fn axis(&self) -> usize {
        self.axis
    }

    /// One sample at `t` s, `dt` s after the last. Returns the output registers and the persistent STATUS bits.
    pub fn sample(
        &mut self,
        world: &Stimulus,
        adis: &Adis16250,
        t: f64,
        dt: f64,
    ) -> (Outputs, u16) {
        let (electrical, extra_power) = self.electrical(world, t, dt);
        let part = &self.part;
        let keep = (-TAU * part.pole_hz * dt).exp();
        let input = world.rate_dps * (1.0 + part.scale_error) + electrical;
        let before = self.signal.unwrap_or(input);
        let signal = input + (before - input) * keep;
        self.signal = Some(signal);
        let noise = self.noise_dps(keep, extra_power);
        let mut analog = signal + noise + adis.stimulus_counts() * 0.073_26;
        for tone in &self.tones {
            analog += behind_the_pole(tone, self.part.pole_hz, t);
        }
        let filtered = self.filtered(analog, adis.filter());
        let corrected = filtered * adis.scale() + f64::from(adis.offset()) * 0.018_315;
        self.angle_deg += corrected * dt;
        let alarms = alarms(world, corrected.abs() > adis.range_dps());
        (self.outputs(world, corrected / adis.lsb_dps()), alarms)
    }

    /// What the electronics add to the rate, deg/s, and by how much they raise the power of the noise, over its own.
    fn electrical(&mut self, world: &Stimulus, t: f64, dt: f64) -> (f64, f64) {
        let part = &self.part;
        self.walk_dps += part.rate_random_walk * dt.sqrt() * standard_normal(&mut self.bias_noise);
        let mut electrical = self.walk_dps
            + part.tempco_dps_c * (world.die_c - 25.0)
            + part.supply_dps_v * (world.supply_v - 5.0)
            + dot(part.g_sensitivity_dps_g, world.acc_g)
            + world.common_dps;
        let mut extra_power = 0.0;
        for fault in &self.faults {
            electrical += match *fault {
                Fault::Tempco {
                    dps_per_c,
                    dps_per_c2,
                    ..
                } => {
                    let warm = world.die_c - 25.0;
                    warm * (dps_per_c + dps_per_c2 * warm)
                }
                Fault::MotorCoupling { dps_per_amp, .. } => dps_per_amp * world.motor_a,
                Fault::SupplyCoupling { dps_per_volt, .. } => dps_per_volt * (world.supply_v - 5.0),
                Fault::Knock {
                    time_s, step_dps, ..
                } if t >= time_s => step_dps,
                Fault::WarmUp {
                    amplitude_dps,
                    tau_s,
                    ..
                } => amplitude_dps * (-t / tau_s).exp(),
                Fault::Leak { dps_per_s, .. } => dps_per_s * t,
                Fault::GSensitivity { dps_per_g, .. } => dot(dps_per_g, world.acc_g),
                Fault::WanderingBias {
                    sigma_dps, tau_s, ..
                } => {
                    let keep = (-dt / tau_s).exp();
                    let fresh = (1.0 - keep * keep).sqrt() * standard_normal(&mut self.fault_noise);
                    self.wander_dps = keep * self.wander_dps + fresh;
                    sigma_dps * self.wander_dps
                }
                Fault::Trap {
                    half_height_dps,
                    dwell_s,
                    ..
                } => {
                    // Chance of an odd number of jumps within dt.
                    let jump = 0.5 * (1.0 - (-2.0 * dt / dwell_s).exp());
                    self.trapped ^= uniform(&mut self.fault_noise, 0.0, 1.0) < jump;
                    if self.trapped {
                        half_height_dps
                    } else {
                        -half_height_dps
                    }
                }
                Fault::MotorNoise { power_per_amp, .. } => {
                    extra_power += power_per_amp * world.motor_a.abs();
                    0.0
                }
                Fault::NoisySpell {
                    start_s,
                    end_s,
                    power,
                    ..
                } => {
                    if (start_s..end_s).contains(&t) {
                        extra_power += power;
                    }
                    0.0
                }
                _ => 0.0,
            };
        }
        (electrical, extra_power)
    }

    /// White noise behind the analog pole, deg/s.
    fn noise_dps(&mut self, keep: f64, extra_power: f64) -> f64 {
        let fresh = (1.0 - keep * keep).sqrt();
        self.analog_noise = keep * self.analog_noise + fresh * standard_normal(&mut self.noise);
        let mut noise = self.sigma_dps * self.analog_noise;
        if extra_power > 0.0 {
            self.extra_noise =
                keep * self.extra_noise + fresh * standard_normal(&mut self.fault_noise);
            noise += self.sigma_dps * extra_power.sqrt() * self.extra_noise;
        }
        noise
    }

    /// The part's Bartlett filter over the last samples.
    fn filtered(&mut self, analog: f64, filter: u32) -> f64 {
        self.newest = (self.newest + 1) % HISTORY;
        self.history[self.newest] = analog;
        if self.weights.0 != filter {
            self.weights = (filter, bartlett(filter));
        }
        let weights = self.weights.1.iter().enumerate();
        weights
            .map(|(back, weight)| weight * self.history[(self.newest + HISTORY - back) % HISTORY])
            .sum()
    }

    /// The registers, of a rate in counts.
    fn outputs(&mut self, world: &Stimulus, counts: f64) -> Outputs {
        let counts = counts.round().clamp(-8192.0, 8191.0);
        let temp =
            world.die_c + self.part.temp_offset_c + 0.05 * standard_normal(&mut self.sensor_noise);
        let supply = world.supply_v + 1e-3 * standard_normal(&mut self.sensor_noise);
        Outputs {
            gyro: counts as i16,
            temp: ((temp - 25.0) / TEMP_LSB_C).round().clamp(-2048.0, 2047.0) as i16,
            supply: (supply / SUPPLY_LSB_V).round().clamp(0.0, 4095.0) as u16,
            aux: 0,
            angle: (self.angle_deg / 0.036_63).rem_euclid(16384.0) as u16,
        }
    }
}

/// A tone behind one pole in closed form, deg/s, so that what lies above half the sample rate folds as it would.
fn behind_the_pole(tone: &Tone, pole_hz: f64, t: f64) -> f64 {
    let ratio = tone.frequency_hz / pole_hz;
    let (gain, lag) = ((1.0 + ratio * ratio).sqrt().recip(), ratio.atan());
    tone.amplitude_dps * gain * (TAU * (tone.frequency_hz * t + tone.phase) - lag).sin()
}

/// The persistent bits of STATUS.
fn alarms(world: &Stimulus, is_over_range: bool) -> u16 {
    let mut alarms = 0;
    if world.supply_v < 4.75 {
        alarms |= status::SUPPLY_LOW;
    }
    if world.supply_v > 5.25 {
        alarms |= status::SUPPLY_HIGH;
    }
    if is_over_range {
        alarms |= status::OVERRANGE;
    }
    alarms
}

/// rms behind the Bartlett filter for rms 1 behind the analog pole: h' R h with R_ij = exp(-2 pi f dt |i - j|).
fn filter_gain(pole_hz: f64, dt: f64, m: u32) -> f64 {
    let weights = bartlett(m);
    let keep = (-TAU * pole_hz * dt).exp();
    let mut variance = 0.0;
    for (i, a) in weights.iter().enumerate() {
        for (j, b) in weights.iter().enumerate() {
            variance += a * b * keep.powi(i.abs_diff(j) as i32);
        }
    }
    variance.sqrt()
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// A gyro with its sample clock and what disturbs its digital side.
#[derive(Clone, Debug)]
pub(crate) struct Gyro {
    pub adis: Adis16250,
    chain: GyroChain,
    clock: f64,
    next_s: f64,
    last_s: Option<f64>,
    stalls: Vec<(f64, f64, StallFlags)>,
    glitches: Vec<(f64, i16)>,
    dead: Vec<(f64, f64, bool)>,
}

impl Gyro {
    pub fn new(
        axis: usize,
        part: &GyroPart,
        faults: &[Fault],
        tones: &[Tone],
        seconds: f64,
        seed: u64,
    ) -> Self {
        let mut gyro = Gyro {
            adis: Adis16250::new(),
            chain: GyroChain::new(axis, part.clone(), faults, tones, seed),
            clock: 1.0 / (1.0 + part.clock_ppm * 1e-6),
            next_s: part.clock_phase * STATED_PERIOD_S,
            last_s: None,
            stalls: Vec::new(),
            glitches: Vec::new(),
            dead: Vec::new(),
        };
        gyro.plan_events(faults, seconds, seed);
        gyro.glitches.sort_by(|a, b| b.0.total_cmp(&a.0));
        gyro
    }

    /// Times of events: of a stream of their own, away from the chain's.
    fn plan_events(&mut self, faults: &[Fault], seconds: f64, seed: u64) {
        let axis = self.chain.axis;
        let rng = &mut Stream::GyroFault(0x80 | axis as u8).of(seed);
        for fault in faults {
            match *fault {
                Fault::Stall {
                    gyro: at,
                    count,
                    length_s,
                    flags,
                } if at == axis => {
                    for _ in 0..count {
                        let start = uniform(rng, 1.0, (seconds - length_s).max(1.0));
                        self.stalls.push((start, start + length_s, flags));
                    }
                }
                Fault::Glitches {
                    gyro: at,
                    count,
                    height_dps,
                } if at == axis => {
                    for _ in 0..count {
                        let time = uniform(rng, 1.0, seconds.max(1.0));
                        let sign = if uniform(rng, 0.0, 1.0) < 0.5 {
                            -1.0
                        } else {
                            1.0
                        };
                        self.glitches
                            .push((time, (sign * height_dps / 0.073_26).round() as i16));
                    }
                }
                Fault::StuckBit {
                    gyro: at,
                    bit,
                    value,
                } if at == axis => self.adis.stick(bit, value),
                Fault::DeadSpi {
                    gyro: at,
                    start_s,
                    end_s,
                    level,
                } if at == axis => {
                    self.dead.push((start_s, end_s, level));
                }
                _ => {}
            }
        }
    }

    /// Time of the next sample, s.
    pub fn next_s(&self) -> f64 {
        self.next_s
    }

    /// Takes the sample that is due.
    pub fn sample(&mut self, world: &Stimulus) {
        let t = self.next_s;
        let period = self.adis.sample_period_s() * self.clock;
        let dt = self.last_s.map_or(period, |last| t - last);
        self.last_s = Some(t);
        self.next_s = t + period;
        let (outputs, alarms) = self.chain.sample(world, &self.adis, t, dt);
        let stalled = self
            .stalls
            .iter()
            .find(|(start, end, _)| (*start..*end).contains(&t));
        match stalled {
            Some((_, _, flags)) => self.adis.lie_about_new_data(*flags == StallFlags::Silent),
            None => {
                self.adis.lie_about_new_data(false);
                self.adis.refresh(outputs, alarms, t);
            }
        }
        while self.glitches.last().is_some_and(|(time, _)| *time <= t) {
            if let Some((_, counts)) = self.glitches.pop() {
                self.adis.disturb(counts);
            }
        }
    }

    /// Eight clocks that end at `t` s; `None` when not selected.
    pub fn transfer(&mut self, mosi: u8, t: f64) -> Option<u8> {
        let answer = self.adis.transfer(mosi, t)?;
        let dead = self
            .dead
            .iter()
            .find(|(start, end, _)| (*start..*end).contains(&t));
        Some(match dead {
            Some((_, _, true)) => 0xff,
            Some((_, _, false)) => 0x00,
            None => answer,
        })
    }
}

#[cfg(test)]
mod tests;
