//! What a diagnosis or a model file says of an IMU: the noise that is left after its causes, and the causes themselves.

use std::collections::BTreeMap;

use diagnosis::result::{Diagnosis, Parameter};
use model::ModelFile;

use super::noise::{AxisNoise, Consumer, DEG, Figure, ImuNoise, ROOT_HOUR, noted};
use crate::text::{answer, noise as told};

/// Parameters by name.
type Parameters = BTreeMap<String, Parameter>;

/// Quantile of the standard normal distribution at 0.975: half of a two-sided interval of 95 %.
const NORMAL_975: f64 = 1.959_964;

/// A cause that was found on a channel, or that a model has there.
#[derive(Clone, Debug, PartialEq)]
pub struct Cause {
    /// Cause id of docs/effects.md.
    pub cause: String,
    /// The channel.
    pub channel: String,
    /// Its parameters by name, in the units of docs/effects.md.
    pub parameters: Parameters,
    /// Causes that the record could not tell apart from it.
    pub rivals: Vec<String>,
}

impl Cause {
    /// A parameter's value where it has this unit.
    pub(super) fn value(&self, name: &str, unit: &str) -> Option<f64> {
        let found = self.parameters.get(name).filter(|p| p.unit == unit)?;
        Some(found.value)
    }

    /// What of it a consumer is given as a parameter of its own, by that parameter's name.
    fn held_by(&self, consumer: Consumer, imu: &ImuNoise) -> Option<&'static str> {
        match (consumer, self.cause.as_str()) {
            (Consumer::Matlab, "temperature") => Some("TemperatureBias"),
            _ if !self.channel.starts_with("gyro") => None,
            (Consumer::Matlab, "flicker") => Some("BiasInstability"),
            (Consumer::Px4, "temperature" | "temperature_quadratic") => Some("TC_G0_X*"),
            (Consumer::Gz, "gauss_markov") => {
                let process = imu.process(&self.channel)?;
                (process.of == self).then_some("dynamic_bias_stddev, dynamic_bias_correlation_time")
            }
            (Consumer::GnssInsSim, "gauss_markov") => {
                let process = imu.process(&self.channel)?;
                (process.of == self).then_some("gyro_b_stability, gyro_b_corr")
            }
            _ => None,
        }
    }

    /// `gyro_y: temperature, slope 0.131 deg/s/degC (95 %: 0.125 to 0.137)`, without what only says which law it is.
    fn sentence(&self) -> String {
        let size = |(name, p): (&String, &Parameter)| {
            format!(", {} {}", name.replace('_', " "), answer::size(name, p))
        };
        let sizes =
            (self.parameters.iter()).filter(|(name, p)| !answer::is_switch(&self.cause, name, p));
        let sizes: String = sizes.map(size).collect();
        let rivals = if self.rivals.is_empty() {
            String::new()
        } else {
            format!(" (or: {})", self.rivals.join(", "))
        };
        let sizes = sizes.replace('\u{a0}', " ");
        format!("{}: {}{rivals}{sizes}", self.channel, self.cause)
    }
}

/// A bias that comes back: what a consumer with one first-order process for the bias can be given in place of a walk.
pub(super) struct Process<'a> {
    of: &'a Cause,
    /// Standard deviation, rad/s.
    pub sigma: f64,
    /// Correlation time, s.
    pub correlation_time: f64,
}

impl ImuNoise {
    /// From a model file: N and K of its channels, and its effects.
    #[must_use]
    pub fn of_model(model: &ModelFile) -> Self {
        let channels =
            || (model.channels.iter()).filter(|c| ["deg/s", "m/s^2"].contains(&c.unit.as_str()));
        let noise = channels().map(|c| (c.name.as_str(), &c.baseline));
        let causes = model.effects.iter().flat_map(|effect| {
            let is_on = |name: &str| {
                effect.channels.is_empty() || effect.channels.iter().any(|channel| channel == name)
            };
            channels().filter(move |c| is_on(&c.name)).map(|c| Cause {
                cause: effect.cause.clone(),
                channel: c.name.clone(),
                parameters: effect.parameters.clone(),
                rivals: Vec::new(),
            })
        });
        let fitted = model.fitted_on.as_ref();
        Self::after_causes(
            fitted.map_or_else(|| model.stand.clone(), |on| on.file.clone()),
            fitted.map_or(0.0, |on| on.seconds),
            model.rate_hz,
            noise,
            causes.collect(),
            &|_| Figure::Unknown,
        )
    }

    /// From a diagnosis; `None` where it does not say which noise is left after the causes, as those written before that
    /// was in them.
    #[must_use]
    pub fn of_diagnosis(diagnosis: &Diagnosis) -> Option<Self> {
        if diagnosis.extended.is_empty() {
            return None;
        }
        let noise = diagnosis.extended.iter();
        let noise = noise.map(|(name, parameters)| (name.as_str(), parameters));
        let causes = diagnosis.findings.iter().flat_map(|finding| {
            finding.channels.iter().map(|channel| Cause {
                cause: finding.cause.clone(),
                channel: channel.clone(),
                parameters: (finding
                    .per_channel
                    .get(channel)
                    .unwrap_or(&finding.parameters))
                .clone(),
                rivals: finding
                    .alternatives
                    .iter()
                    .map(|a| a.cause.clone())
                    .collect(),
            })
        });
        let input = &diagnosis.input;
        let causes = causes.collect();
        let mut imu = Self::after_causes(
            input.file.clone(),
            input.seconds,
            input.rate_hz,
            noise,
            causes,
            &|channel| limit_of_flicker(diagnosis, channel),
        );
        let notes = diagnosis.input.notes.iter().map(|note| noted(note));
        let left = diagnosis.unexplained.iter().map(|left| {
            format!(
                "NOT ALL OF IT, {}: something in the record has no cause yet and is not in these numbers: {}",
                left.channel, left.what
            )
        });
        imu.remarks = notes.chain(left).collect();
        Some(imu)
    }

    fn after_causes<'a>(
        file: String,
        seconds: f64,
        rate_hz: f64,
        noise: impl Iterator<Item = (&'a str, &'a Parameters)>,
        causes: Vec<Cause>,
        limit_of_flicker: &dyn Fn(&str) -> Figure,
    ) -> Self {
        let axis = |(name, parameters): (&str, &Parameters)| AxisNoise {
            name: name.to_owned(),
            white: figure(parameters.get("angle_random_walk"), &WHITE),
            flicker: (causes.iter())
                .find(|c| c.cause == "flicker" && c.channel == name)
                .map_or_else(
                    || limit_of_flicker(name),
                    |c| figure(c.parameters.get("bias_instability"), &FLICKER),
                ),
            walk: walk(parameters, seconds),
        };
        let (gyro, rest): (Vec<_>, Vec<_>) = noise
            .map(axis)
            .partition(|axis| axis.name.starts_with("gyro"));
        let acc = (rest.into_iter())
            .filter(|axis| axis.name.starts_with("acc"))
            .collect();
        Self {
            file,
            seconds,
            rate_hz,
            gyro,
            acc,
            remarks: Vec::new(),
            causes,
            is_after_causes: true,
        }
    }

    /// The first-order process of a gyro's bias, where it has one and no walk beside it.
    pub(super) fn process(&self, channel: &str) -> Option<Process<'_>> {
        let axis = self.gyro.iter().find(|axis| axis.name == channel)?;
        if matches!(axis.walk, Figure::Known(_)) {
            return None;
        }
        let of =
            (self.causes.iter()).find(|c| c.cause == "gauss_markov" && c.channel == channel)?;
        Some(Process {
            of,
            sigma: of.value("sigma", "deg/s")? * DEG,
            correlation_time: of.value("correlation_time", "s")?,
        })
    }

    /// Change of a bias per degree, rad/s/K or m/s^2/K: of a cause that is linear in the temperature; 0 without one.
    pub(super) fn temperature_slope(&self, channel: &str) -> f64 {
        let slope = |c: &Cause| {
            let of_gyro = c.value("slope", "deg/s/degC").map(|slope| slope * DEG);
            of_gyro.or_else(|| c.value("slope", "m/s^2/degC"))
        };
        (self.causes.iter())
            .filter(|c| c.cause == "temperature" && c.channel == channel)
            .filter_map(slope)
            // The sum of nothing is -0 in Rust, and would be written so.
            .fold(0.0, |sum, slope| sum + slope)
    }

    /// The lines on causes that stand above the numbers: each with the parameter that holds it, or as not held.
    pub(super) fn on_causes(&self, consumer: Consumer) -> Vec<String> {
        if !self.is_after_causes {
            return Vec::new();
        }
        if self.causes.is_empty() {
            return vec!["no cause was found beyond N and K".to_owned()];
        }
        let mut lines = vec!["N and K are what is left after these causes:".to_owned()];
        lines.extend(self.causes.iter().map(|cause| {
            let held = cause.held_by(consumer, self).map_or_else(
                || "not in the numbers below".to_owned(),
                |parameter| format!("in {parameter}"),
            );
            format!("  {}: {held}", cause.sentence())
        }));
        lines
    }
}

/// Units of N and what makes SI of them: of a gyro, of an accelerometer.
const WHITE: [(&str, f64); 2] = [("deg/sqrt(h)", DEG / ROOT_HOUR), ("m/s^2*sqrt(s)", 1.0)];
/// Units of K.
const WALK: [(&str, f64); 2] = [("deg/s/sqrt(s)", DEG), ("m/s^2/sqrt(s)", 1.0)];
/// Units of B.
const FLICKER: [(&str, f64); 2] = [("deg/h", DEG / 3600.0), ("m/s^2", 1.0)];

/// The largest B that a diagnosis would have missed on a channel where it found none.
fn limit_of_flicker(diagnosis: &Diagnosis, channel: &str) -> Figure {
    let mut limits = diagnosis.detection_limits.iter();
    let limit = limits.find(|l| l.cause == "flicker" && l.channel == channel);
    let to_si = |unit: &str| {
        FLICKER
            .iter()
            .find(|(of, _)| *of == unit)
            .map(|(_, si)| *si)
    };
    match limit.and_then(|l| Some(l.value * to_si(&l.unit)?)) {
        Some(limit) if limit > 0.0 && limit.is_finite() => Figure::AtMost(limit),
        _ => Figure::Unknown,
    }
}

/// K in SI. What the diagnosis calls too small to be told from 0 is no size; where no length is known, as of a model by hand, it
/// is taken as it is.
fn walk(noise: &Parameters, seconds: f64) -> Figure {
    let k = noise.get("rate_random_walk");
    let unseen = (seconds > 0.0).then(|| told::unseen_walk(noise, seconds));
    match (k, unseen.flatten()) {
        (Some(k), Some(value)) if value > 0.0 && value.is_finite() => {
            let std_error = None;
            let unit = k.unit.clone();
            match figure(
                Some(&Parameter {
                    value,
                    std_error,
                    unit,
                }),
                &WALK,
            ) {
                Figure::Known(smallest) => Figure::Unseen(smallest),
                other => other,
            }
        }
        _ => figure(k, &WALK),
    }
}

/// A fitted parameter in SI: known where it is above 0 by its 95 % interval, else at most that interval's end. In a unit that is
/// not among `units` nothing is known.
fn figure(parameter: Option<&Parameter>, units: &[(&str, f64)]) -> Figure {
    let known = parameter.and_then(|p| {
        let (_, to_si) = units.iter().find(|(unit, _)| *unit == p.unit)?;
        p.value.is_finite().then_some((p, to_si))
    });
    let Some((p, to_si)) = known else {
        return Figure::Unknown;
    };
    let half = NORMAL_975 * p.std_error.unwrap_or(0.0);
    if p.value > half {
        return Figure::Known(p.value * to_si);
    }
    let limit = (p.value.max(0.0) + half) * to_si;
    if limit > 0.0 {
        Figure::AtMost(limit)
    } else {
        Figure::Unknown
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_figure_is_known_above_its_interval_and_else_a_limit() {
        let p = |value, std_error| Parameter {
            value,
            std_error,
            unit: "deg/s/sqrt(s)".to_owned(),
        };
        let of = |value, error| figure(Some(&p(value, error)), &[("deg/s/sqrt(s)", 1.0)]);
        assert_eq!(of(1.0, Some(0.5)), Figure::Known(1.0));
        assert_eq!(of(1.0, None), Figure::Known(1.0));
        assert_eq!(of(0.0, None), Figure::Unknown);
        assert_eq!(
            figure(Some(&p(1.0, None)), &[("deg", 1.0)]),
            Figure::Unknown
        );
        let Figure::AtMost(limit) = of(1e-5, Some(3.2e-4)) else {
            panic!("a limit");
        };
        assert!((limit - (1e-5 + NORMAL_975 * 3.2e-4)).abs() < 1e-12);
    }
}
