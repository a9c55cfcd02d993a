//! What a board has terms for, from a model's channels and effects.

use model::ModelFile;
use model::file::EffectModel;
use model::record::FULL_DUTY;
use wire::correction::Correction;

use super::{
    ACC_COUNTS_PER_G, ACC_ZERO, BoardError, FLICKER_AT_S, GYROS, SUPPLY_LSB_V, TEMP_LSB_C,
    TEMP_ZERO_C,
};

/// The terms of a model's effects, summed axis by axis.
pub(super) struct Sum {
    pub(super) out: Correction,
    /// Squares of the random walks.
    pub(super) walks: [f64; 3],
    /// Mean temperature, degC.
    pub(super) mean_c: f64,
    /// Supply, V.
    pub(super) supply_v: f64,
    /// Samples a second.
    pub(super) rate_hz: f64,
    /// The largest surge so far, whose time all axes share.
    pub(super) surge: f64,
}

impl Sum {
    /// Bias and random walk of each gyro; returns the densities of their noise.
    pub(super) fn baseline(&mut self, model: &ModelFile) -> Result<[f64; 3], BoardError> {
        let mut density = [0.0; 3];
        for (axis, channel) in GYROS.into_iter().enumerate() {
            let found = (model.channels.iter())
                .find(|c| c.name == channel && c.unit == "deg/s")
                .ok_or(BoardError::NoChannel { channel })?;
            let value = |key: &str| found.baseline.get(key).map(|p| p.value);
            self.out.bias[axis] = -value("bias").unwrap_or(0.0);
            let n = value("angle_random_walk").filter(|n| *n > 0.0);
            density[axis] = (n.ok_or(BoardError::NoNoise { channel })? / 60.0).powi(2);
            self.walks[axis] = value("rate_random_walk").unwrap_or(0.0).powi(2);
        }
        Ok(density)
    }

    /// What a motor does until it has spun up, as the model has it: of what the command is ahead of a speed that follows it with
    /// this time constant, the mean over a sample. The motor has one time; that of the largest surge counts.
    fn surge(&mut self, axis: usize, Surge { at_full, time_s }: Surge) {
        if at_full == 0.0 || time_s <= 0.0 {
            return;
        }
        let samples = time_s * self.rate_hz;
        let follow = 1.0 - (-1.0 / samples).exp();
        self.out.surge[axis] -= at_full * samples * follow / FULL_DUTY;
        if at_full.abs() > self.surge {
            (self.surge, self.out.follow) = (at_full.abs(), follow);
        }
    }

    /// An effect on a gyro; whether the board has a term for it.
    pub(super) fn take(&mut self, effect: &EffectModel, axis: usize) -> bool {
        let value = |key: &str| effect.parameters.get(key).map_or(0.0, |p| p.value);
        match effect.cause.as_str() {
            "temperature" => {
                self.out.temperature[axis] -= value("slope") * TEMP_LSB_C;
                self.out.bias[axis] -= value("slope") * (TEMP_ZERO_C - self.mean_c);
            }
            "temperature_quadratic" => {
                let reference =
                    (effect.parameters.get("reference")).map_or(TEMP_ZERO_C, |p| p.value);
                let (off, square) = (TEMP_ZERO_C - reference, value("curvature"));
                self.out.temperature_squared[axis] -= square * TEMP_LSB_C.powi(2);
                self.out.temperature[axis] -= (value("slope") + 2.0 * square * off) * TEMP_LSB_C;
                self.out.bias[axis] -= value("slope") * off + square * off.powi(2);
            }
            "motor_bias" => {
                let term = if value("by_magnitude") == 1.0 {
                    &mut self.out.motor_magnitude
                } else {
                    &mut self.out.motor
                };
                term[axis] -= value("at_full_duty") / FULL_DUTY;
                self.out.motor_turning[axis] -= value("while_turning");
                let surge = Surge {
                    at_full: value("surge_at_full_duty"),
                    time_s: value("surge_time"),
                };
                self.surge(axis, surge.at_once(value("at_full_duty"), value("delay")));
            }
            "supply_sensitivity" => {
                self.out.supply[axis] -= value("slope") * SUPPLY_LSB_V;
                self.out.bias[axis] += value("slope") * self.supply_v;
            }
            "g_sensitivity" => {
                for (k, key) in ["acc_x", "acc_y", "acc_z"].into_iter().enumerate() {
                    let per_count = value(key) / ACC_COUNTS_PER_G;
                    self.out.acc[axis][k] -= per_count;
                    self.out.bias[axis] += per_count * ACC_ZERO;
                }
            }
            "cross_axis" => {
                let keys = ["from_gyro_x", "from_gyro_y", "from_gyro_z"];
                for (k, key) in keys.into_iter().enumerate() {
                    self.out.matrix[axis][k] -= value(key);
                }
            }
            "scale_error" => {
                self.out.matrix[axis][axis] += 1.0 / (1.0 + value("relative")) - 1.0;
            }
            "gauss_markov" => {
                self.walks[axis] +=
                    2.0 * value("sigma").powi(2) / value("correlation_time").max(f64::MIN_POSITIVE);
            }
            "flicker" => {
                let level = 0.664 * value("bias_instability") / 3600.0;
                self.walks[axis] += 3.0 * level.powi(2) / FLICKER_AT_S;
            }
            // It passes the mean of a block as it is.
            "low_pass" => {}
            _ => return false,
        }
        true
    }
}

/// What a motor's current adds right after a step to full duty, deg/s, and the time in which it falls, s.
#[derive(Clone, Copy)]
struct Surge {
    at_full: f64,
    time_s: f64,
}

impl Surge {
    /// The surge that a board without a delay, s, needs beside a steady part, deg/s: that of the same area and the same centre behind
    /// a step, with what the steady part makes too early. Both are so behind any command.
    fn at_once(self, steady: f64, delay_s: f64) -> Self {
        let area = self.at_full * self.time_s - steady * delay_s;
        let moment =
            self.at_full * self.time_s * (self.time_s + delay_s) - steady * delay_s.powi(2) / 2.0;
        let time_s = moment / area;
        if delay_s > 0.0 && time_s > 0.0 && time_s.is_finite() {
            let at_full = area / time_s;
            Self { at_full, time_s }
        } else {
            self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_delay_is_in_the_surge_by_its_area_and_its_centre_behind_a_step() {
        let (steady, delay) = (0.5, 0.03);
        let sensor = Surge {
            at_full: 1.5,
            time_s: 0.2,
        };
        let board = sensor.at_once(steady, delay);
        // In steps of 0.1 ms: what the sensor shows beyond a steady part that is there at once.
        let (mut area, mut moment) = (0.0, 0.0);
        for t in (0..40_000).map(|i| (f64::from(i) + 0.5) * 1e-4) {
            let shown = if t < delay {
                -steady
            } else {
                sensor.at_full * (-(t - delay) / sensor.time_s).exp()
            };
            let rest = shown - board.at_full * (-t / board.time_s).exp();
            area += 1e-4 * rest;
            moment += 1e-4 * rest * t;
        }
        assert!(area.abs() < 1e-6 && moment.abs() < 1e-6, "{area} {moment}");
        assert_eq!(sensor.at_once(steady, 0.0).time_s, 0.2);
    }
}
