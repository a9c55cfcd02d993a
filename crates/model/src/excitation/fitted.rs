//! Settings that make a world like a record's: alike in size and pace, not in its course.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::f64::consts::TAU;

use rand_core::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::moved::{BLOCK_S, MOVED, at_rest, moved_channels, moves_throughout, scale_of};
use super::{MOTION, World};
use crate::file::{EffectModel, ModelFile};
use crate::parameter::Parameter;
use crate::record::{Axis, Base, Channel, Quantity, Record};
use crate::simulate::{ACC_NOISE_G, ACC_PER_G, STANDARD_GRAVITY, SUPPLY_LSB_V, TEMP_LSB_C};

/// Blocks in which slow histories are fitted: a second, longer where a record would have more of them.
const MOST_BLOCKS: usize = 4000;
/// Part of the scatter that a term has to take away before it is stated.
const WORTH: f64 = 0.25;
/// Blocks of half a second that make a rest, or a swing.
const LEAST_REST: usize = 10;
/// Time constants of the self-heating that are tried.
const TIME_CONSTANTS: usize = 24;

impl ModelFile {
    /// The model with an excitation under which its simulation meets temperatures, supply, motor, vibration and motion
    /// like those of the record. A motion of the base that the accelerometers saw becomes a part of that; else each axis
    /// swings by itself.
    #[must_use]
    pub fn excited_like(mut self, record: &Record) -> Self {
        let named = moved_channels(&self);
        let moves = !named.is_empty() || record.header.base.is_some_and(|b| b != Base::Static);
        let turned = self.turned(record, &named);
        self.excitation = settings_like(&turned, self.rate_hz, moves, &named);
        // What of the motion the settings do not make, each axis makes by itself: alike in size and pace too.
        let acts = |key: &&str| self.excitation.contains_key(*key);
        let by_settings: &[&str] = match MOTION.iter().find(|k| acts(k)) {
            Some(&"sway_deg") => &["gyro_x", "gyro_y"],
            Some(_) => &["gyro_z"],
            None => &[],
        };
        let fit = Fit::fine(&turned, self.rate_hz);
        self.effects.retain(|e| !moves_throughout(e));
        for channel in &mut self.channels {
            let moved = named.contains(&channel.name);
            let [Some(read), Some(seen)] =
                [record, &*turned].map(|r| r.channel(&channel.name).filter(|_| moved))
            else {
                continue;
            };
            at_rest(channel, &read.values, self.rate_hz);
            if by_settings.contains(&channel.name.as_str()) {
                continue;
            }
            let swing = fit.swing(&seen.values);
            let parameters = [
                (
                    "peak".to_owned(),
                    Parameter::exact(swing.amplitude, "deg/s"),
                ),
                (
                    "frequency".to_owned(),
                    Parameter::exact(1.0 / swing.period, "Hz"),
                ),
            ];
            self.effects.push(EffectModel {
                cause: MOVED.into(),
                channels: vec![channel.name.clone()],
                parameters: parameters.into(),
            });
        }
        self
    }

    /// The record with the rates of the axes that moved as they truly were: a simulation makes the error of their scale anew.
    fn turned<'a>(&self, record: &'a Record, moved: &[String]) -> Cow<'a, Record> {
        let scale = |name: &String| scale_of(self, name);
        let mut turned = Cow::Borrowed(record);
        for name in moved.iter().filter(|n| ![0.0, 1.0].contains(&scale(n))) {
            let mut all = turned.to_mut().channels.iter_mut();
            if let Some(c) = all.find(|c| c.name == *name) {
                c.values.iter_mut().for_each(|v| *v /= scale(name));
            }
        }
        turned
    }
}

/// The settings of such a world. What the record does not have, or what does not move, is left out.
fn settings_like(
    record: &Record,
    rate_hz: f64,
    moves: bool,
    moved: &[String],
) -> BTreeMap<String, f64> {
    let samples = record.len();
    if samples < 2 || !(rate_hz.is_finite() && rate_hz > 0.0) {
        return BTreeMap::new();
    }
    let length = (rate_hz as usize).max(samples / MOST_BLOCKS).max(1);
    let fit = Fit {
        record,
        rate_hz,
        length,
        moves,
    };
    let mut settings = vec![];
    fit.temperature(&mut settings);
    fit.supply(&mut settings);
    fit.motor(&mut settings);
    fit.vibration(&mut settings);
    if moves {
        fit.motion(&mut settings, moved);
    }
    let rounded = |v: f64| format!("{v:.3e}").parse().unwrap_or(v);
    settings
        .into_iter()
        .map(|(key, value)| (key.to_owned(), rounded(value)))
        .collect()
}

type Settings = Vec<(&'static str, f64)>;

/// A swing: its amplitude in the unit of the channel, its period and when it begins, s.
struct Swing {
    amplitude: f64,
    period: f64,
    begins: f64,
}

struct Fit<'a> {
    record: &'a Record,
    rate_hz: f64,
    /// Samples in a block.
    length: usize,
    /// Whether the base moves.
    moves: bool,
}

impl Fit<'_> {
    fn block_s(&self) -> f64 {
        self.length as f64 / self.rate_hz
    }

    fn seconds(&self) -> f64 {
        self.record.len() as f64 / self.rate_hz
    }

    /// Means of the blocks; a block without a reading repeats the one before.
    fn blocks(&self, values: &[f64]) -> Vec<f64> {
        let mut last = values
            .iter()
            .copied()
            .find(|v| v.is_finite())
            .unwrap_or(0.0);
        values
            .chunks(self.length)
            .map(|block| {
                let (mut sum, mut n) = (0.0, 0.0);
                for v in block.iter().filter(|v| v.is_finite()) {
                    sum += v;
                    n += 1.0;
                }
                if n > 0.0 {
                    last = sum / n;
                }
                last
            })
            .collect()
    }

    /// Ambient, drift, self-heating; what is left is a heater of that size and pace.
    fn temperature(&self, settings: &mut Settings) {
        let Some(first) = self.record.all(Quantity::Temp).next() else {
            return;
        };
        let measured = self.blocks(&first.values);
        let at = |i: usize| (i as f64 + 0.5) * self.block_s();
        let warming = |constant: f64| -> Vec<f64> {
            (0..measured.len())
                .map(|i| 1.0 - (-at(i) / constant).exp())
                .collect()
        };
        let straight = off_line(&measured);
        let shapes = (0..TIME_CONSTANTS).map(|k| {
            let share = k as f64 / (TIME_CONSTANTS - 1) as f64;
            // From ten blocks to half the run: what is slower is a drift.
            let (least, most) = (10.0 * self.block_s(), 0.5 * self.seconds());
            let constant = least * (most / least).powf(share);
            let shape = off_line(&warming(constant));
            let size = dot(&straight, &shape) / dot(&shape, &shape);
            (dot(&straight, &shape) * size, constant, size)
        });
        let best = shapes
            .filter(|s| s.0.is_finite())
            .max_by(|a, b| a.0.total_cmp(&b.0));
        let mut left = measured.clone();
        if let Some((gain, constant, size)) = best
            && gain > WORTH * dot(&straight, &straight)
        {
            for (y, w) in left.iter_mut().zip(warming(constant)) {
                *y -= size * w;
            }
            settings.push(("self_heating_degc", size));
            settings.push(("self_heating_time_constant_s", constant));
        }
        let rest = off_line(&left);
        if rms(&rest) > TEMP_LSB_C {
            let period = period(&rest, self.block_s());
            let unit = self.heater_of(period, left.len());
            let swing = rms(&rest) / rms(&off_line(&unit));
            for (y, u) in left.iter_mut().zip(unit) {
                *y -= swing * u;
            }
            settings.push(("heater_degc", swing));
            settings.push(("heater_period_s", period));
        }
        let (middle, slope) = line(&left);
        let rise = slope * (left.len() - 1) as f64;
        settings.push(("ambient_degc", middle - rise / 2.0));
        if rise.abs() > TEMP_LSB_C {
            settings.push(("drift_degc", rise));
        }
    }

    /// Blocks of the temperature by a heater of that period, s, and of 1 degC.
    fn heater_of(&self, period: f64, blocks: usize) -> Vec<f64> {
        let heater: BTreeMap<String, f64> = [
            ("heater_degc".to_owned(), 1.0),
            ("heater_period_s".to_owned(), period),
            ("ambient_degc".to_owned(), 0.0),
        ]
        .into();
        let world = World::stated(
            &heater,
            blocks,
            1.0 / self.block_s(),
            &mut Xoshiro256PlusPlus::seed_from_u64(0),
        );
        let [unit, ..] = world.temperature;
        unit
    }

    /// Mean, the part that follows the motor's duty, and a load for what is left.
    fn supply(&self, settings: &mut Settings) {
        let Some(supply) = self.record.all(Quantity::Supply).next() else {
            return;
        };
        let volts = self.blocks(&supply.values);
        let mut left = centred(&volts);
        let mut most = mean(&volts);
        if let Some(duty) = self.duty() {
            let pull = self.blocks(&duty.iter().map(|d| d.abs()).collect::<Vec<_>>());
            let shape = centred(&pull);
            let sag = -dot(&left, &shape) / dot(&shape, &shape);
            if sag > 0.0 && sag * sag * dot(&shape, &shape) > WORTH * dot(&left, &left) {
                for (y, d) in left.iter_mut().zip(&shape) {
                    *y += sag * d;
                }
                most += sag * mean(&pull);
                settings.push(("supply_motor_v", sag));
            }
        }
        // A load that is on for half of its period moves the supply by half its sag to either side.
        let load = 2.0 * rms(&left);
        if load > SUPPLY_LSB_V {
            most += load / 2.0;
            settings.push(("supply_load_v", load));
            settings.push(("supply_load_period_s", period(&left, self.block_s())));
        }
        settings.push(("supply_v", most));
    }

    fn duty(&self) -> Option<Vec<f64>> {
        let pwm = self.record.all(Quantity::Pwm).next()?;
        let duty: Vec<f64> = pwm.values.iter().map(|v| v / 255.0).collect();
        duty.iter().any(|d| *d != 0.0).then_some(duty)
    }

    /// A profile of on and off whose mean, mean size and mean square are the record's: what follows the duty, its size or its
    /// square is then as large. It switches on as often.
    fn motor(&self, settings: &mut Settings) {
        let Some(duty) = self.duty() else { return };
        let size: Vec<f64> = duty.iter().map(|d| d.abs()).collect();
        let (mean_size, mean_square) = (mean(&size), mean(&squares(&duty)));
        let level = mean_square / mean_size;
        let (on, forward) = (mean_size / level, (1.0 + mean(&duty) / mean_size) / 2.0);
        let starts = size
            .windows(2)
            .filter(|w| w[0] < level / 2.0 && w[1] >= level / 2.0)
            .count();
        // A column of others' may count otherwise.
        settings.push(("motor_duty", level.min(1.0)));
        settings.push(("motor_on", on));
        settings.push(("motor_forward", forward));
        // The profile has a start in a period for each way that the motor turns.
        let ways = [forward > 0.0, forward < 1.0].map(usize::from);
        let starts_a_period = ways.iter().sum::<usize>() as f64;
        let period = starts_a_period * self.seconds() / starts.max(1) as f64;
        settings.push(("motor_period_s", period));
    }

    /// What the accelerometers see beyond their own noise and, where the base sways, beyond its slow tilt.
    fn vibration(&self, settings: &mut Settings) {
        let own = ACC_NOISE_G * ACC_NOISE_G + ACC_PER_G.powi(-2) / 12.0;
        let variances: Vec<f64> = self
            .record
            .all(Quantity::Acc)
            .map(|c| {
                let g: Vec<f64> = finite(c).map(|v| v / STANDARD_GRAVITY).collect();
                let whole = if self.moves {
                    let steps: Vec<f64> = g.windows(2).map(|w| w[1] - w[0]).collect();
                    dot(&steps, &steps) / (2 * steps.len().max(1)) as f64
                } else {
                    rms(&centred(&g)).powi(2)
                };
                (whole - own).max(0.0)
            })
            .collect();
        let vibration = mean(&variances).sqrt();
        if vibration > ACC_NOISE_G {
            settings.push(("vibration_g", vibration));
        }
    }

    /// Blocks as short as motion is fast.
    fn fine(record: &Record, rate_hz: f64) -> Fit<'_> {
        Fit {
            record,
            rate_hz,
            length: ((BLOCK_S * rate_hz) as usize).max(1),
            moves: true,
        }
    }

    /// A swing that is as large and as frequent since it began.
    fn swing(&self, values: &[f64]) -> Swing {
        let rate = centred(&self.blocks(values));
        let rest = rest_before(&rate);
        let rate = &rate[rest..];
        Swing {
            amplitude: std::f64::consts::SQRT_2 * rms(rate),
            period: period(rate, self.block_s()),
            begins: rest as f64 * self.block_s(),
        }
    }

    /// The turning of a table or the sway of a base, by the gyro that sees most of it. A sway tilts the accelerometers: what
    /// they do not see is none, as a shove.
    fn motion(&self, settings: &mut Settings, moved: &[String]) {
        let fine = Self::fine(self.record, self.rate_hz);
        let seen = Axis::ALL.into_iter().filter_map(|axis| {
            let channel = self.record.of(Quantity::Gyro, Some(axis))?;
            Some((axis, fine.swing(&channel.values)))
        });
        let largest = seen.max_by(|a, b| a.1.amplitude.total_cmp(&b.1.amplitude));
        let Some((axis, swing)) = largest else {
            return;
        };
        let Swing {
            amplitude,
            period,
            begins,
        } = swing;
        if axis == Axis::Z {
            settings.push(("turn_dps", amplitude));
            settings.push(("turn_period_s", period));
            return;
        }
        let sway = amplitude * period / TAU;
        let tilts = self
            .record
            .all(Quantity::Acc)
            .map(|c| fine.swing(&c.values).amplitude);
        let tilt = tilts.fold(0.0, f64::max) / STANDARD_GRAVITY;
        if tilt > 0.5 * sway.to_radians().sin() {
            settings.push(("sway_deg", sway));
            settings.push(("sway_period_s", period));
            if begins > 0.0 {
                settings.push(("sway_from_s", begins));
            }
            // Where it is not said which axes moved, both may have.
            let about = [
                (Axis::X, "gyro_x", "sway_about_x"),
                (Axis::Y, "gyro_y", "sway_about_y"),
            ];
            for (own, name, key) in about.into_iter().filter(|a| a.0 != axis) {
                let still = !moved.is_empty() && !moved.iter().any(|m| m == name);
                let seen = self.record.of(Quantity::Gyro, Some(own)).filter(|_| !still);
                let part = seen.map_or(0.0, |c| fine.swing(&c.values).amplitude / amplitude);
                settings.push((key, part));
            }
        }
    }
}

fn finite(channel: &Channel) -> impl Iterator<Item = f64> {
    channel.values.iter().copied().filter(|v| v.is_finite())
}

fn mean(y: &[f64]) -> f64 {
    if y.is_empty() {
        return 0.0;
    }
    y.iter().sum::<f64>() / y.len() as f64
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub(super) fn rms(y: &[f64]) -> f64 {
    (dot(y, y) / y.len().max(1) as f64).sqrt()
}

fn squares(y: &[f64]) -> Vec<f64> {
    y.iter().map(|v| v * v).collect()
}

fn centred(y: &[f64]) -> Vec<f64> {
    let mean = mean(y);
    y.iter().map(|v| v - mean).collect()
}

/// Middle and slope of the straight line through a history.
fn line(y: &[f64]) -> (f64, f64) {
    let middle = (y.len() as f64 - 1.0) / 2.0;
    let (mut xy, mut xx) = (0.0, 0.0);
    for (i, v) in y.iter().enumerate() {
        let x = i as f64 - middle;
        xy += x * v;
        xx += x * x;
    }
    (mean(y), if xx > 0.0 { xy / xx } else { 0.0 })
}

fn off_line(y: &[f64]) -> Vec<f64> {
    let (level, slope) = line(y);
    let middle = (y.len() as f64 - 1.0) / 2.0;
    y.iter()
        .enumerate()
        .map(|(i, v)| v - level - slope * (i as f64 - middle))
        .collect()
}

/// Values at the start that are at rest, of a history that swings about zero: where two variances, one before and one after,
/// are likeliest; none where the first is not much less.
fn rest_before(y: &[f64]) -> usize {
    let all = dot(y, y);
    let (mut before, mut best) = (0.0, (0, f64::INFINITY));
    for (k, v) in y.iter().enumerate() {
        let [rest, swing] = [(before, k), (all - before, y.len() - k)];
        before += v * v;
        if k < LEAST_REST || y.len() - k < LEAST_REST {
            continue;
        }
        let [rest, swing] = [rest, swing].map(|(sum, n)| sum.max(f64::MIN_POSITIVE) / n as f64);
        let unlikely = k as f64 * rest.ln() + (y.len() - k) as f64 * swing.ln();
        if rest < WORTH * WORTH * swing && unlikely < best.1 {
            best = (k, unlikely);
        }
    }
    best.0
}

/// Period of a history that swings about zero, by how often it passes from well below to well above it.
fn period(y: &[f64], step_s: f64) -> f64 {
    let half = rms(y) / 2.0;
    let (mut low, mut cycles) = (false, 0.0);
    for v in y {
        if *v < -half {
            low = true;
        } else if *v > half && low {
            low = false;
            cycles += 1.0;
        }
    }
    y.len() as f64 * step_s / f64::max(cycles, 1.0)
}

#[cfg(test)]
mod tests;
