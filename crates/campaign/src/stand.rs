//! A stand as it may be: random noise, and random histories of temperature, supply, motor command and vibration.

use model::ModelFile;
use model::excitation::World;
use model::file::EffectModel;
use model::record::{Axis, Base, Channel, Header, Quantity, Record};
use model::simulate::SimulateError;

use crate::random::Draw;

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
        let walk = |draw: &mut Draw| {
            if draw.chance(0.15) {
                0.0
            } else {
                draw.by_ratio(3e-4, 7e-3)
            }
        };
        Self {
            seconds,
            rate_hz,
            walk_of_angle: std::array::from_fn(|_| draw.between(3.6, 7.0)),
            walk_of_rate: std::array::from_fn(|_| walk(draw)),
            bias: std::array::from_fn(|_| draw.between(-1.0, 1.0)),
            lsb: [LSB; 3],
            world: world(draw, samples, rate_hz, needs),
            excitation: vec![],
        }
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
        level: impl FnMut(&mut Draw) -> f64,
    ) -> Vec<f64> {
        held(draw, self.samples(), self.rate_hz, dwell_s, level)
    }

    /// An Ornstein-Uhlenbeck process of this standard deviation and time constant, s.
    pub(crate) fn wander(&self, draw: &mut Draw, sigma: f64, tau: f64) -> Vec<f64> {
        wander(draw, self.samples(), self.rate_hz, sigma, tau)
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
        let axis = |i: usize| Some(Axis::ALL[i]);
        let channel = |name: &str, quantity, axis, values: Vec<f64>| Channel {
            name: name.to_owned(),
            quantity,
            axis,
            unit: String::new(),
            values,
            counts: None,
            lsb: None,
        };
        let scaled = |values: &[f64], by: f64| values.iter().map(|v| v * by).collect::<Vec<_>>();
        let mut channels = vec![
            channel("supply", Quantity::Supply, None, self.world.supply.clone()),
            channel("pwm", Quantity::Pwm, None, scaled(&self.world.duty, 255.0)),
        ];
        for i in 0..3 {
            let letter = ["x", "y", "z"][i];
            channels.push(channel(
                &format!("temp_{letter}"),
                Quantity::Temp,
                axis(i),
                self.world.temperature[i].clone(),
            ));
            channels.push(channel(
                &format!("acc_{letter}"),
                Quantity::Acc,
                axis(i),
                scaled(&self.world.acc[i], GRAVITY),
            ));
        }
        Record {
            header: Header {
                rate_hz: Some(self.rate_hz),
                base: Some(Base::Static),
                ..Header::default()
            },
            channels,
            ..Record::default()
        }
    }
}

/// A signal that holds each of its levels for a random time.
pub(crate) fn held(
    draw: &mut Draw,
    samples: usize,
    rate_hz: f64,
    dwell_s: (f64, f64),
    mut level: impl FnMut(&mut Draw) -> f64,
) -> Vec<f64> {
    let mut all = Vec::with_capacity(samples);
    while all.len() < samples {
        let length = (draw.between(dwell_s.0, dwell_s.1) * rate_hz).ceil() as usize;
        let value = level(draw);
        all.extend(std::iter::repeat_n(value, length.max(1)));
    }
    all.truncate(samples);
    all
}

fn duty(draw: &mut Draw, samples: usize, rate_hz: f64) -> Vec<f64> {
    let top = draw.between(0.4, 1.0);
    let one_way = draw.chance(0.3);
    let mut d = match draw.of_many(4) {
        0 => held(draw, samples, rate_hz, (8.0, 40.0), |d| {
            top * d.between(-1.0, 1.0)
        }),
        1 => {
            let mut on = false;
            held(draw, samples, rate_hz, (15.0, 50.0), |d| {
                on = !on;
                if on { top * d.sign() } else { 0.0 }
            })
        }
        2 => {
            let period = draw.between(30.0, 120.0) * rate_hz;
            (0..samples)
                .map(|i| {
                    let x = (i as f64 / period).fract();
                    top * (4.0 * (x - 0.5).abs() - 1.0)
                })
                .collect()
        }
        _ => {
            let period = draw.between(30.0, 120.0) * rate_hz;
            (0..samples)
                .map(|i| top * (std::f64::consts::TAU * i as f64 / period).sin())
                .collect()
        }
    };
    for v in &mut d {
        if one_way {
            *v = v.abs();
        }
        *v = (*v * 255.0).round() / 255.0;
    }
    d
}

/// Behind a lag of `tau` s.
pub(crate) fn lagged(values: &[f64], tau: f64, rate_hz: f64) -> Vec<f64> {
    let gain = 1.0 - (-1.0 / (tau * rate_hz)).exp();
    let mut y = values.first().copied().unwrap_or(0.0);
    values
        .iter()
        .map(|v| {
            y += gain * (v - y);
            y
        })
        .collect()
}

/// An Ornstein-Uhlenbeck process.
pub(crate) fn wander(
    draw: &mut Draw,
    samples: usize,
    rate_hz: f64,
    sigma: f64,
    tau: f64,
) -> Vec<f64> {
    let keep = (-1.0 / (tau * rate_hz)).exp();
    let step = sigma * (1.0 - keep * keep).sqrt();
    let mut x = sigma * draw.normal();
    (0..samples)
        .map(|_| {
            x = keep * x + step * draw.normal();
            x
        })
        .collect()
}

/// What the room and a heater make of the temperature, deg C.
fn temperature(draw: &mut Draw, samples: usize, rate_hz: f64, needs: Needs) -> Vec<f64> {
    let seconds = samples as f64 / rate_hz;
    let heater = needs.has(Needs::TEMPERATURE) || draw.chance(0.5);
    let mut temperature = vec![draw.between(18.0, 32.0); samples];
    let mut add = |values: Vec<f64>| {
        temperature
            .iter_mut()
            .zip(values)
            .for_each(|(t, v)| *t += v);
    };
    if heater {
        let swing = draw.between(3.0, 10.0);
        let mut on = draw.chance(0.5);
        let target = held(draw, samples, rate_hz, (40.0, 150.0), |_| {
            on = !on;
            if on { swing } else { 0.0 }
        });
        let lag = draw.between(15.0, 60.0);
        add(lagged(&target, lag, rate_hz));
    }
    if draw.chance(0.5) {
        let (rise, tau) = (draw.between(1.0, 8.0), draw.between(60.0, 240.0));
        let heat = |i: usize| rise * (1.0 - (-(i as f64) / rate_hz / tau).exp());
        add((0..samples).map(heat).collect());
    }
    if draw.chance(0.3) {
        let rise = draw.between(-3.0, 3.0);
        add((0..samples)
            .map(|i| rise * i as f64 / rate_hz / seconds)
            .collect());
    }
    let room = draw.by_ratio(0.02, 0.3);
    add(wander(draw, samples, rate_hz, room, 200.0));
    temperature
}

/// A supply of 5 V that a load and the motor pull down, V.
fn supply(draw: &mut Draw, duty: &[f64], rate_hz: f64, needs: Needs) -> Vec<f64> {
    let samples = duty.len();
    let mut supply = vec![5.0; samples];
    let mut sag = |values: Vec<f64>| supply.iter_mut().zip(values).for_each(|(u, v)| *u -= v);
    sag(wander(draw, samples, rate_hz, 0.001, 60.0));
    if needs.has(Needs::SUPPLY) || draw.chance(0.5) {
        let drop = draw.between(0.03, 0.06);
        let mut on = false;
        sag(held(draw, samples, rate_hz, (10.0, 50.0), |_| {
            on = !on;
            if on { drop } else { 0.0 }
        }));
    }
    if draw.chance(0.3) {
        let drop = draw.between(0.01, 0.04);
        sag(lagged(duty, 0.3, rate_hz)
            .iter()
            .map(|d| drop * d.abs())
            .collect());
    }
    supply
}

fn world(draw: &mut Draw, samples: usize, rate_hz: f64, needs: Needs) -> World {
    let duty = if needs.has(Needs::MOTOR) || draw.chance(0.6) {
        duty(draw, samples, rate_hz)
    } else {
        vec![0.0; samples]
    };
    let temperature = temperature(draw, samples, rate_hz, needs);
    let supply = supply(draw, &duty, rate_hz, needs);
    let rms = if needs.has(Needs::VIBRATION) || draw.chance(0.5) {
        draw.between(0.05, 0.2)
    } else {
        0.0
    };
    let acc = std::array::from_fn(|axis| {
        let still = if axis == 2 { 1.0 } else { 0.0 };
        (0..samples).map(|_| still + rms * draw.normal()).collect()
    });
    // Three parts on one board: nearly the same temperature.
    let temperature = std::array::from_fn(|_| {
        let (gain, offset) = (draw.between(0.95, 1.05), draw.between(-0.5, 0.5));
        let first = temperature[0];
        temperature
            .iter()
            .map(|t| first + offset + gain * (t - first))
            .collect()
    });
    World {
        temperature,
        supply,
        duty,
        acc,
        motion: std::array::from_fn(|_| vec![0.0; samples]),
    }
}
