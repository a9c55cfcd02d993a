//! A stand as it may be: random noise, and random histories of temperature, supply, motor command and vibration.

use std::f64::consts::TAU;

use model::ModelFile;
use model::excitation::World;
use model::file::EffectModel;
use model::record::{Axis, Base, Channel, Header, Quantity, Record};
use model::simulate::SimulateError;

use crate::random::Draw;
use crate::series::{add_at, each, lagged, one_if};

/// Names of the gyro channels.
pub const GYROS: [&str; 3] = ["gyro_x", "gyro_y", "gyro_z"];
/// Standard gravity, m/s^2.
const GRAVITY: f64 = 9.80665;
/// Unit of the gyros, deg/s per count.
pub const LSB: f64 = 0.07326;

/// What the environment has to do so that an effect can show: any of what it may do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Needs(u8);

impl Needs {
    /// Nothing beyond what any stand has.
    pub const NONE: Self = Self(0);
    /// A temperature that moves.
    pub const TEMPERATURE: Self = Self(1);
    /// A supply whose load switches.
    pub const SUPPLY: Self = Self(2);
    /// A motor that is switched.
    pub const MOTOR: Self = Self(4);
    /// Vibration.
    pub const VIBRATION: Self = Self(8);
    /// All of it.
    pub const ALL: Self = Self(15);

    /// This and more.
    #[must_use]
    pub const fn and(self, more: Self) -> Self {
        Self(self.0 | more.0)
    }

    const fn has(self, one: Self) -> bool {
        self.0 & one.0 != 0
    }
}

/// A stand: length, noise and world.
#[derive(Clone)]
pub struct Stand {
    /// Length, s.
    pub seconds: f64,
    /// Sample rate, Hz.
    pub rate_hz: f64,
    /// Angle random walk by axis, deg/sqrt(h).
    pub walk_of_angle: [f64; 3],
    /// Rate random walk by axis, deg/s/sqrt(s).
    pub walk_of_rate: [f64; 3],
    /// Constant bias by axis, deg/s.
    pub bias: [f64; 3],
    /// Step of the readings by axis, deg/s; 0 where they are exact.
    pub lsb: [f64; 3],
    /// Temperature, supply, duty, specific force; motion comes by the model file's excitation.
    pub world: World,
    /// Settings of the excitation: sway, turn.
    pub excitation: Vec<(&'static str, f64)>,
}

impl Stand {
    /// A random one.
    #[must_use]
    pub fn draw(draw: &mut Draw, seconds: f64, rate_hz: f64, needs: Needs) -> Self {
        let samples = (seconds * rate_hz).round() as usize;
        let mut stand = Self {
            seconds,
            rate_hz,
            walk_of_angle: std::array::from_fn(|_| draw.between(3.6, 7.0)),
            walk_of_rate: std::array::from_fn(|_| draw.zero_or(0.15, |d| d.by_ratio(3e-4, 7e-3))),
            bias: std::array::from_fn(|_| draw.between(-1.0, 1.0)),
            lsb: [LSB; 3],
            world: World {
                duty: vec![0.0; samples],
                ..World::default()
            },
            excitation: vec![],
        };
        stand.world = stand.drawn_world(draw, needs);
        stand
    }

    /// Samples.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.world.duty.len()
    }

    /// White variance of a sample, (deg/s)^2. The angle random walk of a model includes the rounding to counts.
    #[must_use]
    pub fn white(&self, axis: usize) -> f64 {
        (self.walk_of_angle[axis] / 60.0).powi(2) * self.rate_hz
    }

    /// The same before rounding to counts, which adds a twelfth of a squared count.
    #[must_use]
    pub fn white_before_rounding(&self, axis: usize) -> f64 {
        self.white(axis) - self.lsb[axis].powi(2) / 12.0
    }

    /// Variance of a step of the random walk, (deg/s)^2.
    #[must_use]
    pub fn step(&self, axis: usize) -> f64 {
        self.walk_of_rate[axis].powi(2) / self.rate_hz
    }

    /// So many values as it has samples, by their number.
    pub(crate) fn series<A>(&self, of: impl FnMut(usize) -> A) -> Vec<A> {
        (0..self.samples()).map(of).collect()
    }

    /// A signal that holds each of its levels for a random time, s.
    pub(crate) fn held(
        &self,
        draw: &mut Draw,
        dwell_s: (f64, f64),
        mut level: impl FnMut(&mut Draw) -> f64,
    ) -> Vec<f64> {
        let mut all = Vec::with_capacity(self.samples());
        while all.len() < self.samples() {
            let length = (draw.between(dwell_s.0, dwell_s.1) * self.rate_hz).ceil() as usize;
            let value = level(draw);
            all.extend(std::iter::repeat_n(value, length.max(1)));
        }
        all.truncate(self.samples());
        all
    }

    /// What is on and off by turns, each for a random time, s: of a size each time, and 0 while it is off. It begins other than
    /// `on`.
    pub(crate) fn by_turns(
        &self,
        draw: &mut Draw,
        mut on: bool,
        dwell_s: (f64, f64),
        mut size: impl FnMut(&mut Draw) -> f64,
    ) -> Vec<f64> {
        self.held(draw, dwell_s, |d| {
            on = !on;
            one_if(on) * size(d)
        })
    }

    /// An Ornstein-Uhlenbeck process of this standard deviation and time constant, s.
    pub(crate) fn wander(&self, draw: &mut Draw, sigma: f64, tau: f64) -> Vec<f64> {
        let keep = (-1.0 / (tau * self.rate_hz)).exp();
        let step = sigma * (1.0 - keep * keep).sqrt();
        let mut x = sigma * draw.normal();
        self.series(|_| {
            x = keep * x + step * draw.normal();
            x
        })
    }

    /// Values behind a lag of `tau` s.
    pub(crate) fn lagged(&self, values: &[f64], tau: f64) -> Vec<f64> {
        lagged(values, tau, self.rate_hz)
    }

    /// The stand without the white noise of an axis, which something else brings: exact there, for without noise the steps of the
    /// readings would be steps of the bias.
    #[must_use]
    pub(crate) fn without_noise(&self, axis: usize) -> Self {
        let mut exact = self.clone();
        (exact.walk_of_angle[axis], exact.lsb[axis]) = (0.0, 0.0);
        exact
    }

    /// Simulate with these effects.
    ///
    /// # Errors
    /// As [`model::simulate`].
    pub fn record(&self, effects: &[EffectModel], seed: u64) -> Result<Record, SimulateError> {
        let mut model = ModelFile::paper();
        model.rate_hz = self.rate_hz;
        for (i, channel) in model.channels.iter_mut().enumerate() {
            channel.lsb = Some(self.lsb[i]).filter(|lsb| *lsb > 0.0);
            for (name, value) in [
                ("angle_random_walk", self.walk_of_angle[i]),
                ("rate_random_walk", self.walk_of_rate[i]),
                ("bias", self.bias[i]),
            ] {
                if let Some(p) = channel.baseline.get_mut(name) {
                    p.value = value;
                }
            }
        }
        let settings = self.excitation.iter().map(|(k, v)| ((*k).to_owned(), *v));
        model.excitation.extend(settings);
        model.effects = effects.to_vec();
        // A sway tilts the accelerometers, which only the stated world knows.
        if self.excitation.iter().any(|(k, _)| k.starts_with("sway")) {
            return model::simulate(&model, self.seconds, self.rate_hz, seed);
        }
        model::simulate_in_the_world_of(&model, &self.witness(), self.rate_hz, seed)
    }

    /// The world as a record, exact.
    pub(crate) fn witness(&self) -> Record {
        let channel = |name: String, quantity, axis, values: &[f64], by: f64| Channel {
            name,
            quantity,
            axis,
            unit: String::new(),
            values: each(values, |v| v * by),
            counts: None,
            lsb: None,
        };
        let (world, none) = (&self.world, None);
        let mut channels = vec![
            channel("supply".into(), Quantity::Supply, none, &world.supply, 1.0),
            channel("pwm".into(), Quantity::Pwm, none, &world.duty, 255.0),
        ];
        for (i, letter) in ["x", "y", "z"].into_iter().enumerate() {
            let axis = Some(Axis::ALL[i]);
            let (temp, acc) = (format!("temp_{letter}"), format!("acc_{letter}"));
            channels.extend([
                channel(temp, Quantity::Temp, axis, &world.temperature[i], 1.0),
                channel(acc, Quantity::Acc, axis, &world.acc[i], GRAVITY),
            ]);
        }
        let header = Header {
            rate_hz: Some(self.rate_hz),
            base: Some(Base::Static),
            ..Header::default()
        };
        Record {
            header,
            channels,
            ..Record::default()
        }
    }

    /// A motor's command: random levels, on and off, a triangle or a sine.
    fn drawn_duty(&self, draw: &mut Draw) -> Vec<f64> {
        let top = draw.between(0.4, 1.0);
        let one_way = draw.chance(0.3);
        let which = draw.of_many(4);
        let duty = match which {
            0 => self.held(draw, (8.0, 40.0), |d| top * d.between(-1.0, 1.0)),
            1 => {
                let mut on = false;
                self.held(draw, (15.0, 50.0), |d| {
                    on = !on;
                    if on { top * d.sign() } else { 0.0 }
                })
            }
            _ => {
                let period = draw.between(30.0, 120.0) * self.rate_hz;
                let triangle = |turns: f64| 4.0 * (turns.fract() - 0.5).abs() - 1.0;
                self.series(|i| match which {
                    2 => top * triangle(i as f64 / period),
                    _ => top * (TAU * i as f64 / period).sin(),
                })
            }
        };
        each(&duty, |d| {
            let d = if one_way { d.abs() } else { d };
            (d * 255.0).round() / 255.0
        })
    }

    /// What the room and a heater make of the temperature, deg C.
    fn drawn_temperature(&self, draw: &mut Draw, needs: Needs) -> Vec<f64> {
        let heater = needs.has(Needs::TEMPERATURE) || draw.chance(0.5);
        let mut temperature = vec![draw.between(18.0, 32.0); self.samples()];
        let mut add = |values: Vec<f64>| add_at(&mut temperature, 0, values);
        if heater {
            let (swing, on) = (draw.between(3.0, 10.0), draw.chance(0.5));
            let target = self.by_turns(draw, on, (40.0, 150.0), |_| swing);
            add(self.lagged(&target, draw.between(15.0, 60.0)));
        }
        if draw.chance(0.5) {
            let (rise, tau) = (draw.between(1.0, 8.0), draw.between(60.0, 240.0));
            add(self.series(|i| rise * (1.0 - (-(i as f64) / self.rate_hz / tau).exp())));
        }
        if draw.chance(0.3) {
            let seconds = self.samples() as f64 / self.rate_hz;
            let rise = draw.between(-3.0, 3.0);
            add(self.series(|i| rise * i as f64 / self.rate_hz / seconds));
        }
        let room = draw.by_ratio(0.02, 0.3);
        add(self.wander(draw, room, 200.0));
        temperature
    }

    /// A supply of 5 V that a load and the motor pull down, V.
    fn drawn_supply(&self, draw: &mut Draw, duty: &[f64], needs: Needs) -> Vec<f64> {
        let mut supply = vec![5.0; duty.len()];
        let mut sag = |values: Vec<f64>| add_at(&mut supply, 0, each(&values, |v| -v));
        sag(self.wander(draw, 0.001, 60.0));
        if needs.has(Needs::SUPPLY) || draw.chance(0.5) {
            let drop = draw.between(0.03, 0.06);
            sag(self.by_turns(draw, false, (10.0, 50.0), |_| drop));
        }
        if draw.chance(0.3) {
            let drop = draw.between(0.01, 0.04);
            sag(each(&self.lagged(duty, 0.3), |d| drop * d.abs()));
        }
        supply
    }

    fn drawn_world(&self, draw: &mut Draw, needs: Needs) -> World {
        let still = &self.world.duty;
        let duty = if needs.has(Needs::MOTOR) || draw.chance(0.6) {
            self.drawn_duty(draw)
        } else {
            still.clone()
        };
        let room = self.drawn_temperature(draw, needs);
        let supply = self.drawn_supply(draw, &duty, needs);
        let shakes = needs.has(Needs::VIBRATION) || draw.chance(0.5);
        let rms = if shakes { draw.between(0.05, 0.2) } else { 0.0 };
        World {
            duty,
            supply,
            acc: std::array::from_fn(|axis| {
                let still = if axis == 2 { 1.0 } else { 0.0 };
                self.series(|_| still + rms * draw.normal())
            }),
            // Three parts on one board: nearly the same temperature.
            temperature: std::array::from_fn(|_| {
                let (gain, offset) = (draw.between(0.95, 1.05), draw.between(-0.5, 0.5));
                each(&room, |t| room[0] + offset + gain * (t - room[0]))
            }),
            motion: std::array::from_fn(|_| still.clone()),
        }
    }
}
