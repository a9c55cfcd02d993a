//! What the base does: tilt, sway, floor, vibration, knocks. Rates about and accelerations along the body axes.

use std::f64::consts::TAU;

use rand_xoshiro::Xoshiro256PlusPlus;

use crate::pose;
use crate::random::{Stream, standard_normal, uniform};
use crate::scenario::{BasePart, Fault, STANDARD_GRAVITY};

/// Corner of the floor's vibration, Hz.
const FLOOR_CORNER_HZ: f64 = 10.0;
/// A knock rings at this frequency, Hz, and dies out with this time constant, s.
const KNOCK_HZ: f64 = 18.0;
const KNOCK_TAU_S: f64 = 0.06;
/// Peak rate and acceleration of a knock for each degree that the mount gives way, deg/s and g.
const KNOCK_DPS_PER_DEG: f64 = 4.0;
const KNOCK_G_PER_DEG: f64 = 0.2;

/// Parts of a bump's acceleration along x, y and z: the bench gives way downwards most.
const BUMP: [f64; 3] = [0.5, 0.3, 1.0];

/// The stand rings after a blow at the bench, which gives it a speed at once.
#[derive(Clone, Copy, Debug)]
struct Bump {
    axis: usize,
    time_s: f64,
    peak_dps: f64,
    linear_g: f64,
    frequency_hz: f64,
    decay_s: f64,
}

impl Bump {
    /// Of size 1 at the blow; none before it.
    fn ring(&self, t: f64) -> f64 {
        let since = t - self.time_s;
        if since < 0.0 {
            0.0
        } else {
            (-since / self.decay_s).exp() * (TAU * self.frequency_hz * since).cos()
        }
    }
}

/// One sine that both the gyros and the accelerometer see.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tone {
    pub axis: usize,
    pub frequency_hz: f64,
    pub amplitude_dps: f64,
    pub linear_g: f64,
    /// Turns.
    pub phase: f64,
}

#[derive(Clone, Debug)]
pub(crate) struct Base {
    part: BasePart,
    tones: Vec<Tone>,
    knocks: Vec<(usize, f64, f64)>,
    shoves: Vec<(usize, f64, f64, f64)>,
    bumps: Vec<Bump>,
    rng: Xoshiro256PlusPlus,
    floor_g: [f64; 3],
}

impl Base {
    pub fn new(part: BasePart, faults: &[Fault], seed: u64) -> Self {
        let mut rng = Stream::Base.of(seed);
        let mut base = Base {
            part,
            tones: Vec::new(),
            knocks: Vec::new(),
            shoves: Vec::new(),
            bumps: Vec::new(),
            rng: rng.clone(),
            floor_g: [0.0; 3],
        };
        for fault in faults {
            match *fault {
                Fault::Vibration {
                    axis,
                    frequency_hz,
                    amplitude_dps,
                    linear_g,
                } => {
                    let phase = uniform(&mut rng, 0.0, 1.0);
                    base.tones.push(Tone {
                        axis,
                        frequency_hz,
                        amplitude_dps,
                        linear_g,
                        phase,
                    });
                }
                Fault::Knock {
                    gyro,
                    time_s,
                    tilt_deg,
                    ..
                } => base.knocks.push((gyro, time_s, tilt_deg)),
                Fault::Bump {
                    axis,
                    time_s,
                    peak_dps,
                    linear_g,
                    frequency_hz,
                    decay_s,
                } => base.bumps.push(Bump {
                    axis,
                    time_s,
                    peak_dps,
                    linear_g,
                    frequency_hz,
                    decay_s,
                }),
                Fault::Shove {
                    axis,
                    time_s,
                    peak_dps,
                    length_s,
                } => {
                    base.shoves.push((axis, time_s, peak_dps, length_s));
                }
                _ => {}
            }
        }
        base
    }

    /// Moves the floor on by `dt` s.
    pub fn step(&mut self, dt: f64) {
        if self.part.floor_g_rms > 0.0 {
            let keep = (-dt * TAU * FLOOR_CORNER_HZ).exp();
            let fresh = self.part.floor_g_rms * (1.0 - keep * keep).sqrt();
            for value in &mut self.floor_g {
                *value = keep * *value + fresh * standard_normal(&mut self.rng);
            }
        }
    }

    /// True rate about each axis, deg/s, without the tones: those go through the sensor's pole in closed form. The table has
    /// turned by `azimuth`, rad.
    pub fn rate_dps(&self, t: f64, azimuth: f64) -> [f64; 3] {
        let mut rate = match self.part.poses.is_empty() {
            true => [0.0; 3],
            false => pose::on_table(pose::at(&self.part.poses, t).1, azimuth),
        };
        if let Some(turns) = self.sway(t) {
            let w = TAU / self.part.sway_period_s;
            rate[0] += self.part.sway_deg * w * (TAU * turns).cos();
        }
        for &(axis, time, tilt) in &self.knocks {
            rate[axis] += KNOCK_DPS_PER_DEG * tilt * ring(t - time);
        }
        for bump in &self.bumps {
            rate[bump.axis] += bump.peak_dps * bump.ring(t);
        }
        for &(axis, time, peak, length) in &self.shoves {
            let turn = (t - time) / length;
            if (0.0..1.0).contains(&turn) {
                // There and back: the base ends where it was.
                rate[axis] += peak * (TAU * turn).sin();
            }
        }
        rate
    }

    /// How far the sway has got, turns; `None` while there is none.
    fn sway(&self, t: f64) -> Option<f64> {
        let since = t - self.part.sway_from_s;
        (self.part.sway_deg != 0.0 && since >= 0.0).then_some(since / self.part.sway_period_s)
    }

    pub fn tones(&self) -> &[Tone] {
        &self.tones
    }

    /// Specific force along each axis, m/s^2, on a table that has turned by `azimuth`, rad.
    pub fn acceleration(&self, t: f64, azimuth: f64) -> [f64; 3] {
        let mut tilt = self.part.tilt_deg;
        let mut g = self.floor_g;
        if let Some(turns) = self.sway(t) {
            tilt[0] += self.part.sway_deg * (TAU * turns).sin();
        }
        for &(_, time, angle) in &self.knocks {
            if t >= time {
                tilt[1] += angle;
                g[2] += KNOCK_G_PER_DEG * angle * ring(t - time);
            }
        }
        for bump in &self.bumps {
            let ring = bump.linear_g * bump.ring(t);
            g.iter_mut()
                .zip(BUMP)
                .for_each(|(g, part)| *g += part * ring);
        }
        for tone in &self.tones {
            let value = tone.linear_g * (TAU * (tone.frequency_hz * t + tone.phase)).sin();
            for axis in &mut g {
                *axis += value;
            }
        }
        let (sin_x, cos_x) = tilt[0].to_radians().sin_cos();
        let (sin_y, cos_y) = tilt[1].to_radians().sin_cos();
        // The tilt is the sensor's on its table: gravity on a stand that lies upright is the same whatever the azimuth.
        let up = pose::on_table(pose::at(&self.part.poses, t).0, azimuth);
        let (across, above) = (cos_x * up[1] + sin_x * up[2], cos_x * up[2] - sin_x * up[1]);
        g[0] += cos_y * up[0] - sin_y * above;
        g[1] += across;
        g[2] += sin_y * up[0] + cos_y * above;
        g.map(|value| value * STANDARD_GRAVITY)
    }
}

/// A damped ring that starts at 0.
fn ring(since: f64) -> f64 {
    if since < 0.0 {
        0.0
    } else {
        (-since / KNOCK_TAU_S).exp() * (TAU * KNOCK_HZ * since).sin()
    }
}
