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

#[cfg(test)]
mod tests {
    use super::*;

    fn part() -> BasePart {
        BasePart {
            tilt_deg: [0.0; 2],
            floor_g_rms: 0.0,
            sway_deg: 0.0,
            sway_period_s: 10.0,
            sway_from_s: 0.0,
            poses: Vec::new(),
        }
    }

    fn base(part: BasePart, fault: Fault) -> Base {
        Base::new(part, &[fault], 7)
    }

    fn near(got: f64, wanted: f64) {
        assert!((got - wanted).abs() < 1e-9, "{got}, not {wanted}");
    }

    const G: f64 = STANDARD_GRAVITY;

    #[test]
    fn a_sway_turns_about_x_and_tips_gravity_with_it() {
        let sways = BasePart {
            sway_deg: 3.0,
            sway_period_s: 8.0,
            sway_from_s: 5.0,
            ..part()
        };
        let base = Base::new(sways, &[], 7);
        assert_eq!(base.rate_dps(4.9, 0.0), [0.0; 3]);
        // 3 deg sin(2 pi t / 8 s): its rate is the derivative.
        near(base.rate_dps(5.0, 0.0)[0], 3.0 * TAU / 8.0);
        near(base.rate_dps(6.0, 0.0)[0], 3.0 * TAU / 8.0 * 0.5f64.sqrt());
        near(base.rate_dps(9.0, 0.0)[0], -3.0 * TAU / 8.0);
        let (sin, cos) = 3f64.to_radians().sin_cos();
        let acceleration = base.acceleration(7.0, 0.0);
        near(acceleration[1], sin * G);
        near(acceleration[2], cos * G);
        near(acceleration[0], 0.0);
    }

    #[test]
    fn a_tilt_about_both_axes_is_one_behind_the_other() {
        let tilted = BasePart {
            tilt_deg: [10.0, 20.0],
            ..part()
        };
        let acceleration = Base::new(tilted, &[], 7).acceleration(0.0, 0.0);
        let (sx, cx) = 10f64.to_radians().sin_cos();
        let (sy, cy) = 20f64.to_radians().sin_cos();
        near(acceleration[0], -sy * cx * G);
        near(acceleration[1], sx * G);
        near(acceleration[2], cy * cx * G);
        // A table that lies on its side, and has turned by a quarter.
        let lies = BasePart {
            poses: vec![pose::Pose {
                at_s: 0.0,
                turn_s: 1.0,
                up: [1.0, 0.0, 0.0],
            }],
            tilt_deg: [10.0, 0.0],
            ..part()
        };
        let acceleration = Base::new(lies, &[], 7).acceleration(2.0, std::f64::consts::FRAC_PI_2);
        // Up points along -y of the table, and the sensor leans about x.
        near(acceleration[1], -cx * G);
        near(acceleration[2], sx * G);
        near(acceleration[0], 0.0);
    }

    #[test]
    fn a_knock_rings_at_18_hz_and_leaves_its_tilt() {
        let base = base(
            part(),
            Fault::Knock {
                gyro: 2,
                time_s: 4.0,
                step_dps: 0.5,
                tilt_deg: 1.5,
            },
        );
        assert_eq!(base.rate_dps(3.99, 0.0), [0.0; 3]);
        // A quarter of the first period.
        let quarter = 0.25 / 18.0;
        let damped = (-quarter / 0.06f64).exp();
        near(base.rate_dps(4.0 + quarter, 0.0)[2], 4.0 * 1.5 * damped);
        near(base.rate_dps(4.0 + quarter, 0.0)[0], 0.0);
        let (sin, cos) = 1.5f64.to_radians().sin_cos();
        let acceleration = base.acceleration(4.0 + quarter, 0.0);
        near(acceleration[0], -sin * G);
        near(acceleration[2], (cos + 0.2 * 1.5 * damped) * G);
        near(base.acceleration(3.9, 0.0)[2], G);
        near(base.acceleration(4.0, 0.0)[0], -sin * G);
    }

    #[test]
    fn a_bump_gives_a_speed_at_once_and_rings_with_its_own_frequency_and_decay() {
        let base = base(
            part(),
            Fault::Bump {
                axis: 1,
                time_s: 2.0,
                peak_dps: 3.0,
                linear_g: 0.4,
                frequency_hz: 12.0,
                decay_s: 0.3,
            },
        );
        near(base.rate_dps(1.999, 0.0)[1], 0.0);
        near(base.rate_dps(2.0, 0.0)[1], 3.0);
        // An eighth of a period later, and three periods later.
        let eighth = 0.125 / 12.0;
        let ring = (-eighth / 0.3f64).exp() * 0.5f64.sqrt();
        near(base.rate_dps(2.0 + eighth, 0.0)[1], 3.0 * ring);
        near(base.rate_dps(2.25, 0.0)[1], 3.0 * (-0.25 / 0.3f64).exp());
        let acceleration = base.acceleration(2.0 + eighth, 0.0);
        for (axis, part) in [0.5, 0.3, 1.0].into_iter().enumerate() {
            let gravity = if axis == 2 { G } else { 0.0 };
            near(acceleration[axis] - gravity, part * 0.4 * ring * G);
        }
    }

    #[test]
    fn a_shove_goes_there_and_back_within_its_length() {
        let base = base(
            part(),
            Fault::Shove {
                axis: 0,
                time_s: 10.0,
                peak_dps: 5.0,
                length_s: 4.0,
            },
        );
        for (t, rate) in [
            (9.9, 0.0),
            (11.0, 5.0),
            (12.0, 0.0),
            (13.0, -5.0),
            (14.1, 0.0),
        ] {
            near(base.rate_dps(t, 0.0)[0], rate);
        }
    }

    #[test]
    fn a_vibration_is_felt_by_all_three_outputs_of_the_accelerometer() {
        let base = base(
            part(),
            Fault::Vibration {
                axis: 2,
                frequency_hz: 30.0,
                amplitude_dps: 1.0,
                linear_g: 0.05,
            },
        );
        let tone = base.tones()[0];
        assert_eq!(
            (tone.axis, tone.frequency_hz, tone.amplitude_dps),
            (2, 30.0, 1.0)
        );
        // A quarter of a turn behind its zero.
        let t = (1.25 - tone.phase) / 30.0;
        for (axis, gravity) in [0.0, 0.0, G].into_iter().enumerate() {
            near(base.acceleration(t, 0.0)[axis] - gravity, 0.05 * G);
        }
        near(base.rate_dps(t, 0.0)[2], 0.0);
    }

    #[test]
    fn the_floor_has_its_rms_and_its_corner() {
        let shaken = BasePart {
            floor_g_rms: 0.01,
            ..part()
        };
        let mut base = Base::new(shaken, &[], 7);
        let (dt, n) = (1e-3, 200_000);
        let (mut squares, mut products, mut before) = ([0.0; 3], 0.0, 0.0);
        for _ in 0..n {
            base.step(dt);
            let a = base.acceleration(0.0, 0.0);
            for (sum, value) in squares.iter_mut().zip([a[0], a[1], a[2] - G]) {
                *sum += (value / G).powi(2) / f64::from(n);
            }
            products += a[0] / G * before / f64::from(n);
            before = a[0] / G;
        }
        // 200 s of a corner of 10 Hz are some 6000 independent values: 1.3 % rms of the rms.
        for square in squares {
            assert!(
                (square.sqrt() / 0.01 - 1.0).abs() < 0.06,
                "{}",
                square.sqrt()
            );
        }
        let corner = -(products / squares[0]).ln() / (TAU * dt);
        assert!((corner / 10.0 - 1.0).abs() < 0.1, "{corner} Hz");
    }
}
