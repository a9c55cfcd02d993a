//! What acts on a simulated stand: temperature, supply, motor, vibration. Stated in the model file, or taken from a record.

mod fitted;
mod moved;

pub use moved::at_rest;
pub(crate) use moved::{fast, moved_like, slow};

use std::collections::BTreeMap;

use rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::effects::effect;
use crate::file::ModelFile;

/// A setting of the `[excitation]` section.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setting {
    /// Key; its last word is the unit.
    pub key: &'static str,
    /// Value where the file does not give it.
    pub default: f64,
    /// What it means.
    pub meaning: &'static str,
}

/// Settings that turn the stand, as a `base_motion` in the model does.
const MOTION: [&str; 2] = ["turn_dps", "sway_deg"];

const fn setting(key: &'static str, default: f64, meaning: &'static str) -> Setting {
    Setting {
        key,
        default,
        meaning,
    }
}

/// All settings. What is zero does not act.
pub const SETTINGS: &[Setting] = &[
    setting("ambient_degc", 25.0, "temperature at the start"),
    setting(
        "self_heating_degc",
        0.0,
        "rise of the temperature by self-heating",
    ),
    setting("self_heating_time_constant_s", 120.0, "its time constant"),
    setting(
        "drift_degc",
        0.0,
        "rise of the temperature over the whole run, linear",
    ),
    setting(
        "heater_degc",
        0.0,
        "swing of the temperature by a heater, peak to peak",
    ),
    setting("heater_period_s", 240.0, "its period, half of it on"),
    setting(
        "heater_time_constant_s",
        40.0,
        "thermal time constant of the heater",
    ),
    setting("supply_v", 5.0, "supply voltage"),
    setting("supply_load_v", 0.0, "sag of the supply by a switched load"),
    setting(
        "supply_load_period_s",
        55.0,
        "period of the load, half of it on",
    ),
    setting(
        "supply_motor_v",
        0.0,
        "sag of the supply at full duty of the motor",
    ),
    setting("motor_duty", 0.0, "duty of the motor while it turns, 0..1"),
    setting(
        "motor_period_s",
        80.0,
        "period of its profile: off, forward, off, back",
    ),
    setting(
        "motor_on",
        0.5,
        "part of the time that the motor turns, 0..1",
    ),
    setting(
        "motor_forward",
        0.5,
        "part of that in which it turns forward, 0..1",
    ),
    setting(
        "vibration_g",
        0.0,
        "rms of a broadband vibration on each accelerometer axis",
    ),
    setting(
        "sway_deg",
        0.0,
        "amplitude of a sway of the base about x and y",
    ),
    setting("sway_period_s", 10.0, "period of the sway"),
    setting(
        "sway_from_s",
        0.0,
        "when the sway begins; the base is at rest before",
    ),
    setting("sway_about_x", 1.0, "part of the sway that is about x"),
    setting("sway_about_y", 1.0, "part of the sway that is about y"),
    setting(
        "turn_dps",
        0.0,
        "amplitude of a slow turning of the table about z",
    ),
    setting("turn_period_s", 40.0, "period of the turning"),
];

/// The value of a setting.
#[must_use]
pub fn setting_value(given: &BTreeMap<String, f64>, key: &str) -> f64 {
    given.get(key).copied().unwrap_or_else(|| {
        SETTINGS
            .iter()
            .find(|s| s.key == key)
            .map_or(0.0, |s| s.default)
    })
}

/// The effects of a model that cannot show in its simulation, each with the settings of which one would let it.
#[must_use]
pub fn unexcited(model: &ModelFile) -> Vec<(&'static str, &'static [&'static str])> {
    let acts = |key: &&str| setting_value(&model.excitation, key) != 0.0;
    let moved = model.effects.iter().any(|e| e.cause == "base_motion");
    let known = model.effects.iter().filter_map(|e| effect(&e.cause));
    let mut missing: Vec<_> = known
        .filter(|e| {
            let settings = e.excited_by();
            let by_motion = moved && settings.iter().any(|s| MOTION.contains(s));
            !settings.is_empty() && !by_motion && !settings.iter().any(acts)
        })
        .map(|e| (e.id(), e.excited_by()))
        .collect();
    missing.dedup();
    missing
}

/// The world of a run, one value per sample.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct World {
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
}

impl World {
    /// A world in which nothing acts.
    pub(crate) fn at_rest(samples: usize) -> Self {
        let zeros = || vec![0.0; samples];
        Self {
            temperature: std::array::from_fn(|_| zeros()),
            supply: zeros(),
            duty: zeros(),
            acc: std::array::from_fn(|_| zeros()),
            motion: std::array::from_fn(|_| zeros()),
        }
    }

    /// The world that the settings describe.
    #[must_use]
    pub fn stated(
        given: &BTreeMap<String, f64>,
        samples: usize,
        rate_hz: f64,
        rng: &mut Xoshiro256PlusPlus,
    ) -> Self {
        Self::stated_but(given, samples, rate_hz, Some(rng), Recorded::default())
    }

    /// The same, but for what was recorded of it. Without random numbers a vibration is drawn where it is to be seen alone.
    pub(crate) fn stated_but(
        given: &BTreeMap<String, f64>,
        samples: usize,
        rate_hz: f64,
        rng: Option<&mut Xoshiro256PlusPlus>,
        recorded: Recorded,
    ) -> Self {
        let stated = Stated {
            given,
            samples,
            rate_hz,
        };
        let mut own = Xoshiro256PlusPlus::seed_from_u64(0);
        let is_seen = recorded.acc.iter().any(Option::is_none);
        let rng = rng.or_else(|| is_seen.then_some(&mut own));
        let (mut acc, motion) = stated.moved(rng);
        for (acc, recorded) in acc.iter_mut().zip(recorded.acc) {
            *acc = recorded.unwrap_or_else(|| std::mem::take(acc));
        }
        let temperature = match recorded.temperature {
            [Some(x), Some(y), Some(z)] => [x, y, z],
            some => {
                let all = stated.temperature();
                some.map(|own| own.unwrap_or_else(|| all.clone()))
            }
        };
        let (supply, duty) = match (recorded.supply, recorded.duty) {
            (Some(supply), Some(duty)) => (supply, duty),
            (supply, duty) => {
                let turning = stated.turning();
                let rounded = |d: &f64| (d * 255.0).round() / 255.0;
                let supply = supply.unwrap_or_else(|| stated.supply(&turning));
                let duty = duty.unwrap_or_else(|| turning.iter().map(rounded).collect());
                (supply, duty)
            }
        };
        Self {
            temperature,
            supply,
            duty,
            acc,
            motion,
        }
    }
}

/// What was recorded of a world, as [`World`] has it.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Recorded {
    pub temperature: [Option<Vec<f64>>; 3],
    pub supply: Option<Vec<f64>>,
    pub duty: Option<Vec<f64>>,
    pub acc: [Option<Vec<f64>>; 3],
}

/// Settings, and the run that they are of.
struct Stated<'a> {
    given: &'a BTreeMap<String, f64>,
    samples: usize,
    rate_hz: f64,
}

impl Stated<'_> {
    fn get(&self, key: &str) -> f64 {
        setting_value(self.given, key)
    }

    fn each(&self, of: impl FnMut(f64) -> f64) -> Vec<f64> {
        let times = (0..self.samples).map(|i| i as f64 / self.rate_hz);
        times.map(of).collect()
    }

    /// degC.
    fn temperature(&self) -> Vec<f64> {
        let seconds = self.samples as f64 / self.rate_hz;
        let [swing, period, ambient, own, drift] = [
            "heater_degc",
            "heater_period_s",
            "ambient_degc",
            "self_heating_degc",
            "drift_degc",
        ]
        .map(|key| self.get(key));
        let settling = self.get("self_heating_time_constant_s");
        let slowed = (self.get("heater_time_constant_s") * self.rate_hz).max(1.0);
        let mut heater = 0.0;
        self.each(|t| {
            let target = if is_on(t, period) { swing } else { 0.0 };
            heater += (target - heater) / slowed;
            ambient + own * (1.0 - (-t / settling).exp()) + drift * t / seconds + heater
        })
    }

    /// Duty of the motor, -1..1.
    fn turning(&self) -> Vec<f64> {
        let motor = MotorProfile {
            on: self.get("motor_on"),
            forward: self.get("motor_forward"),
        };
        let [size, period] = ["motor_duty", "motor_period_s"].map(|key| self.get(key));
        self.each(|t| size * motor.turns(t / period))
    }

    /// V, at a duty of the motor.
    fn supply(&self, turning: &[f64]) -> Vec<f64> {
        let [level, load, period, motor] = [
            "supply_v",
            "supply_load_v",
            "supply_load_period_s",
            "supply_motor_v",
        ]
        .map(|key| self.get(key));
        let mut turning = turning.iter();
        self.each(|t| {
            let sag = if is_on(t, period) { 0.0 } else { load };
            level - sag - motor * turning.next().map_or(0.0, |d| d.abs())
        })
    }

    /// Specific force, g, and motion, deg/s, of a stand that sways, turns and is shaken; only the motion without random numbers.
    fn moved(&self, rng: Option<&mut Xoshiro256PlusPlus>) -> ([Vec<f64>; 3], [Vec<f64>; 3]) {
        let mut acc: [Vec<f64>; 3] = Default::default();
        if let Some(rng) = rng {
            let rms = self.get("vibration_g");
            acc = acc.map(|_| {
                self.each(|_| {
                    let e: f64 = StandardNormal.sample(rng);
                    rms * e
                })
            });
        }
        let mut motion: [Vec<f64>; 3] = std::array::from_fn(|_| vec![0.0; self.samples]);
        let [period, size, from] =
            ["sway_period_s", "sway_deg", "sway_from_s"].map(|key| self.get(key));
        let [turn, turn_period] = ["turn_dps", "turn_period_s"].map(|key| self.get(key));
        if size == 0.0 && turn == 0.0 {
            // Gravity is along z.
            acc[2].iter_mut().for_each(|z| *z += 1.0);
            return (acc, motion);
        }
        let parts = ["sway_about_x", "sway_about_y"].map(|key| self.get(key));
        let w = std::f64::consts::TAU / period;
        let sway = |t: f64, shift: f64, part: f64| {
            let amplitude = part * size;
            let since = t - from;
            let phase = w * since.max(0.0) + shift;
            let rate = if since < 0.0 { 0.0 } else { amplitude * w };
            (amplitude * phase.sin(), rate * phase.cos())
        };
        let turned = std::f64::consts::TAU / turn_period;
        let [about_x, about_y, about_z] = &mut motion;
        let rates = about_x.iter_mut().zip(about_y).zip(about_z);
        for (i, ((about_x, about_y), about_z)) in rates.enumerate() {
            let t = i as f64 / self.rate_hz;
            let (roll, roll_rate) = sway(t, 0.0, parts[0]);
            let (pitch, pitch_rate) = sway(t, 1.0, parts[1]);
            // Gravity and rates in the axes of the body, turned by the pitch first and then by the roll.
            let (sin_pitch, cos_pitch) = pitch.to_radians().sin_cos();
            let (sin_roll, cos_roll) = roll.to_radians().sin_cos();
            let gravity = [-sin_pitch, cos_pitch * sin_roll, cos_pitch * cos_roll];
            for (acc, g) in acc.iter_mut().zip(gravity) {
                acc.get_mut(i).into_iter().for_each(|a| *a += g);
            }
            *about_x = roll_rate;
            *about_y = pitch_rate * cos_roll;
            *about_z = turn * (turned * t).sin() - pitch_rate * sin_roll;
        }
        (acc, motion)
    }
}

/// Whether what is switched is on, in the first half of its period.
fn is_on(t: f64, period: f64) -> bool {
    (t / period).rem_euclid(1.0) < 0.5
}

/// When the motor turns, and which way: a rest, forward, a rest as long, back.
struct MotorProfile {
    /// Part of the time that it turns.
    on: f64,
    /// Part of that in which it turns forward.
    forward: f64,
}

impl MotorProfile {
    /// 1 while the motor turns forward, -1 while it turns back, 0 while it rests; `periods` since the start.
    fn turns(&self, periods: f64) -> f64 {
        let phase = periods.rem_euclid(1.0);
        let rest = (1.0 - self.on) / 2.0;
        let forward = self.on * self.forward;
        if (rest..rest + forward).contains(&phase) {
            1.0
        } else if phase >= 2.0 * rest + forward {
            -1.0
        } else {
            0.0
        }
    }
}
