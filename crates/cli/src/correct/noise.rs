//! What a model says of the angle error behind a correction: the noise that no correction takes off, and how unsure its
//! coefficients are.

use model::ModelFile;
use model::effect::value;
use model::record::{FULL_DUTY, Record};

use super::judge::{rms, without_rest};

const GYROS: [&str; 3] = ["gyro_x", "gyro_y", "gyro_z"];

/// Noise of a gyro, and what its correction rests on.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Noise {
    /// Angle random walk N, deg/sqrt(s).
    pub n: f64,
    /// Rate random walk K, deg/s/sqrt(s).
    pub k: f64,
    /// Processes that come back to zero: rms, deg/s, and correlation time, s.
    pub wanders: Vec<(f64, f64)>,
    /// Coefficients that the correction rests on.
    pub uncertain: Vec<Uncertain>,
    /// Variance of the mean of a block of the bias filter, (deg/s)^2, as the correction has it; 0 where it is not known.
    pub block: f64,
}

/// A coefficient of the correction.
#[derive(Clone, Debug, PartialEq)]
pub struct Uncertain {
    /// Id of the effect.
    pub cause: String,
    /// Standard error, deg/s for each unit of the channel that it multiplies.
    pub error: f64,
    /// That channel.
    pub channel: String,
}

impl Noise {
    /// Of x, y, z, as a model says it.
    #[must_use]
    pub fn of_model(model: &ModelFile) -> [Self; 3] {
        GYROS.map(|gyro| {
            let mut noise = Self::default();
            let channel = model.channels.iter().find(|c| c.name == gyro);
            let of = |key: &str| {
                let parameter = channel.and_then(|c| c.baseline.get(key));
                parameter.map_or(0.0, |p| p.value)
            };
            // N is in deg/sqrt(h).
            (noise.n, noise.k) = (of("angle_random_walk") / 60.0, of("rate_random_walk"));
            let here =
                |channels: &[String]| channels.is_empty() || channels.iter().any(|c| c == gyro);
            for effect in model.effects.iter().filter(|e| here(&e.channels)) {
                noise.take(effect, gyro);
            }
            noise
        })
    }

    fn take(&mut self, effect: &model::file::EffectModel, gyro: &str) {
        let p = &effect.parameters;
        let mut unsure = |parameter: &str, each: f64, channel: &str| {
            let error = p.get(parameter).and_then(|p| p.std_error).unwrap_or(0.0);
            self.uncertain.push(Uncertain {
                cause: effect.cause.clone(),
                error: error / each,
                channel: channel.to_owned(),
            });
        };
        match effect.cause.as_str() {
            "gauss_markov" => self
                .wanders
                .push((value(p, "sigma"), value(p, "correlation_time"))),
            "temperature" | "temperature_quadratic" => {
                unsure("slope", 1.0, &gyro.replace("gyro", "temp"));
            }
            "motor_bias" => unsure("at_full_duty", FULL_DUTY, "pwm"),
            "supply_sensitivity" => unsure("slope", 1.0, "supply"),
            "cross_axis" => {
                for other in GYROS {
                    unsure(&format!("from_{other}"), 1.0, other);
                }
            }
            "scale_error" => unsure("relative", 1.0, gyro),
            _ => {}
        }
    }

    /// Variance of a mean over so many seconds as the bias at their end, (deg/s)^2: a mean is off by a third of its walk.
    #[must_use]
    pub fn of_a_mean(&self, seconds: f64) -> f64 {
        self.n.powi(2) / seconds + self.k.powi(2) * seconds / 3.0
    }

    /// Variance of the angle over a span that the white noise in it makes, deg^2.
    #[must_use]
    pub fn white(&self, span_s: f64) -> f64 {
        self.n.powi(2) * span_s
    }

    /// Variance of the angle over a span that noise alone leaves, deg^2, in a record of `behind_s` behind the rest. The bias is
    /// known from the rest, with the variance `bias`, and walks on from there.
    #[must_use]
    pub fn floor(&self, bias: f64, [span_s, behind_s]: [f64; 2]) -> f64 {
        // Middle of the windows' begins, since the rest.
        let since_s = (behind_s - span_s).max(0.0) / 2.0;
        let white = self.white(span_s);
        let walk = self.k.powi(2) * span_s.powi(2) * (since_s + span_s / 3.0);
        let wanders = self.wanders.iter().map(|(sigma, tau)| {
            2.0 * sigma.powi(2) * tau * (span_s - tau * (1.0 - (-span_s / tau).exp()))
        });
        white + bias * span_s.powi(2) + walk + wanders.sum::<f64>()
    }

    /// What uncertain coefficients add, deg^2, under what a record holds behind `rest` rows: by coefficient. A span that is
    /// longer than the record is judged by the mean over all of it.
    pub fn uncertain<'a>(
        &'a self,
        record: &'a Record,
        rest: usize,
        span_s: f64,
    ) -> impl Iterator<Item = (&'a Uncertain, f64)> {
        let rate_hz = record.header.rate_hz.unwrap_or(f64::NAN);
        let within_s = span_s.min(record.len().saturating_sub(rest) as f64 / rate_hz);
        self.uncertain.iter().filter_map(move |one| {
            let values = without_rest(record.channel(&one.channel)?.values.clone(), rest);
            let angle = rms(&values, rest, within_s, rate_hz)? * span_s / within_s;
            Some((one, (one.error * angle).powi(2)))
        })
    }

    /// The angle error that noise and uncertain coefficients leave, deg.
    pub(super) fn angle_deg(
        &self,
        bias: f64,
        record: &Record,
        rest: usize,
        [span_s, behind_s]: [f64; 2],
    ) -> f64 {
        let uncertain = self
            .uncertain(record, rest, span_s)
            .map(|(_, square)| square);
        (self.floor(bias, [span_s, behind_s]) + uncertain.sum::<f64>()).sqrt()
    }
}
