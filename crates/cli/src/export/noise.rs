//! N, B and K for programs that take them, each in its own convention.
//!
//! Here N and K are those of IEEE Std 952 in continuous time, two-sided: the noise of a rate has the density N^2 + K^2 / (2 pi f)^2
//! at frequencies of either sign. Sampled at f_s by averaging, its white part has a standard deviation of N sqrt(f_s),
//! and its random walk takes steps of K / sqrt(f_s). Every consumer is described by what *it* does with its numbers at
//! each step; `crates/cli/tests/export.rs` writes those steps down once more and gets N and K back from what they simulate.

use std::fmt::Write;

use noise::analyze::{Analysis, ChannelAnalysis, Interval};

use super::causes::Cause;

/// Who takes the numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Consumer {
    /// Kalibr's imu.yaml, read by OpenVINS and others too
    Kalibr,
    /// VINS-Mono and VINS-Fusion: acc_n, gyr_n, acc_w, gyr_w of their yaml
    Vins,
    /// MATLAB's imuSensor: gyroparams and accelparams
    Matlab,
    /// Gazebo Sim, and PX4 with it: the imu element of SDF
    Gz,
    /// gnss-ins-sim: the dictionary of an IMU
    GnssInsSim,
    /// PX4: noise of EKF2, thermal calibration of the gyro
    Px4,
}

/// Reported units to SI.
pub(super) const DEG: f64 = std::f64::consts::PI / 180.0;
/// sqrt(s) in sqrt(h).
pub(super) const ROOT_HOUR: f64 = 60.0;

/// A figure in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Figure {
    /// Established.
    Known(f64),
    /// Not established; at most this.
    AtMost(f64),
    /// Too small to be told from 0; a record of this length shows one of this size.
    Unseen(f64),
    /// Nothing is known.
    Unknown,
}

impl Figure {
    fn of(interval: &Interval, to_si: f64) -> Self {
        match (interval.value, interval.high) {
            (Some(value), _) if value > 0.0 => Figure::Known(value * to_si),
            (_, Some(high)) if high > 0.0 => Figure::AtMost(high * to_si),
            _ => Figure::Unknown,
        }
    }

    /// For a filter, which has to expect it: where there is no value the limit, or what would just be seen.
    #[must_use]
    pub fn expected(self) -> Option<f64> {
        match self {
            Figure::Known(value) | Figure::AtMost(value) | Figure::Unseen(value) => Some(value),
            Figure::Unknown => None,
        }
    }

    /// For a simulation, which must not invent it: 0 where there is no value.
    #[must_use]
    pub fn simulated(self) -> f64 {
        match self {
            Figure::Known(value) => value,
            Figure::AtMost(_) | Figure::Unseen(_) | Figure::Unknown => 0.0,
        }
    }

    pub(super) fn remark(self) -> String {
        match self {
            Figure::Known(_) => String::new(),
            Figure::AtMost(limit) => {
                format!("not established by this record; 95 % limit {limit:.6e}")
            }
            Figure::Unseen(smallest) => {
                format!("too small to be told from 0; a record this long shows {smallest:.6e}")
            }
            Figure::Unknown => "this record says nothing about it".to_owned(),
        }
    }
}

/// A sensor axis in SI units: rad/s and m/s^2.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisNoise {
    /// gyro_x, ...
    pub name: String,
    /// N, U/sqrt(Hz).
    pub white: Figure,
    /// B, U.
    pub flicker: Figure,
    /// K, U/s/sqrt(Hz).
    pub walk: Figure,
}

/// What a record says of an IMU.
#[derive(Clone, Debug, PartialEq)]
pub struct ImuNoise {
    /// File that was analyzed.
    pub file: String,
    /// Its length, s.
    pub seconds: f64,
    /// Its sample rate, Hz.
    pub rate_hz: f64,
    /// x, y, z, those there are, rad/s.
    pub gyro: Vec<AxisNoise>,
    /// x, y, z, those there are, m/s^2.
    pub acc: Vec<AxisNoise>,
    /// What a reader of the numbers has to know: where the terms do not describe an axis.
    pub remarks: Vec<String>,
    /// Causes that were found beside the noise, channel by channel.
    pub causes: Vec<Cause>,
    /// Whether N and K are those of a diagnosis, after its causes; else causes are in them.
    pub is_after_causes: bool,
}

impl ImuNoise {
    /// From an analysis. Channels whose units are neither those of a gyro nor of an accelerometer are left out.
    #[must_use]
    pub fn of(analysis: &Analysis) -> Self {
        let axis = |name: &str, channel: &ChannelAnalysis, to_si: f64, flicker: f64| AxisNoise {
            name: name.to_owned(),
            white: Figure::of(&channel.parameters.angle_random_walk, to_si / ROOT_HOUR),
            flicker: Figure::of(&channel.parameters.bias_instability, flicker),
            walk: Figure::of(&channel.parameters.rate_random_walk, to_si),
        };
        let of = |unit: &str, to_si: f64, flicker: f64| {
            analysis
                .channels
                .iter()
                .filter(|(name, channel)| {
                    channel.unit == unit && (name.starts_with("gyro") || name.starts_with("acc"))
                })
                .map(|(name, channel)| axis(name, channel, to_si, flicker))
                .collect()
        };
        Self {
            file: analysis.input.file.clone(),
            seconds: analysis.input.seconds,
            rate_hz: analysis.input.rate_hz,
            gyro: of("deg/s", DEG, DEG / 3600.0),
            acc: of("m/s^2", 1.0, 1.0),
            remarks: remarks(analysis),
            causes: Vec::new(),
            is_after_causes: false,
        }
    }

    /// The first axis and term that a consumer needs and this record says nothing about, not even a limit: white noise
    /// everywhere, the walk where a filter would trust a bias without one.
    #[must_use]
    pub fn lacks(&self, consumer: Consumer) -> Option<(&str, &'static str)> {
        let is_filter = matches!(consumer, Consumer::Kalibr | Consumer::Vins | Consumer::Px4);
        let lacks = |axes: &[AxisNoise]| {
            let unknown = |of: fn(&AxisNoise) -> Figure| {
                let is_unknown = |axis: &AxisNoise| of(axis) == Figure::Unknown;
                // A filter has one number for all axes, and it takes one of them to know it.
                let found = axes.iter().position(is_unknown)?;
                (!is_filter || axes.iter().all(is_unknown)).then_some(found)
            };
            let white = unknown(|axis| axis.white).map(|at| (at, "white noise"));
            let walk = || unknown(|axis| axis.walk).map(|at| (at, "random walk of the bias"));
            white.or_else(|| is_filter.then(walk).flatten())
        };
        [&self.gyro, &self.acc]
            .into_iter()
            .find_map(|axes| lacks(axes).map(|(at, term)| (axes[at].name.as_str(), term)))
    }

    /// The text that a consumer reads, for a sensor that is sampled at `rate_hz` there.
    #[must_use]
    pub fn text(&self, consumer: Consumer, rate_hz: f64) -> String {
        let rate_hz = tidy(rate_hz);
        match consumer {
            Consumer::Kalibr => self.kalibr(rate_hz),
            Consumer::Vins => self.vins(rate_hz),
            Consumer::Matlab => self.matlab(rate_hz),
            Consumer::Gz => self.gz(rate_hz),
            Consumer::GnssInsSim => self.gnss_ins_sim(),
            Consumer::Px4 => self.px4(rate_hz),
        }
    }

    /// Why a kind of sensor is missing, and what adds it.
    pub(super) fn absent(&self, name: &str) -> String {
        if !self.is_after_causes {
            return format!("no {name} in the record");
        }
        format!(
            "no {name} in the diagnosis or model; `imu-stand diagnose --channels gyro_x,gyro_y,gyro_z,acc_x,acc_y,acc_z` of a \
             record at rest fits both, and a capture beside it (`imu-stand export model.toml run.csv`) gives what is missing"
        )
    }

    /// Where the numbers come from, what they leave out, and the causes, in lines of comments.
    pub(super) fn origin(&self, comment: &str, consumer: Consumer) -> String {
        let mut out = format!(
            "{comment} from {}: {:.0} s at {} Hz, by imu-stand {}\n",
            self.file,
            self.seconds,
            tidy(self.rate_hz),
            env!("CARGO_PKG_VERSION")
        );
        for remark in self.remarks.iter().chain(&self.on_causes(consumer)) {
            let _ = writeln!(out, "{comment} {remark}");
        }
        out
    }
}

/// What was doubtful of the record, and the axes whose noise the terms do not describe, or only at long cluster times.
fn remarks(analysis: &Analysis) -> Vec<String> {
    let tau0 = 1.0 / analysis.input.rate_hz;
    let of_record = analysis.input.notes.iter().map(|note| noted(note));
    let of_axes = (analysis.channels.iter())
        .filter(|(_, c)| c.parameters.angle_random_walk.high.is_some())
        .filter_map(|(name, c)| match c.parameters_hold_from_s {
            None => Some(format!(
                "NOT TO BE RELIED ON, {name}: white noise, flicker and random walk do not describe this record; `imu-stand diagnose`"
            )),
            Some(from) if from > 1.5 * tau0 => Some(format!(
                "{name}: from the slow part of the record, for cluster times from {} s on; a filter or a line bends the rest",
                tidy(from)
            )),
            Some(_) => None,
        });
    of_record.chain(of_axes).chain(walks(analysis)).collect()
}

/// A note on a record, in one line of a comment.
pub(super) fn noted(note: &str) -> String {
    format!("note: {}", note.replace(['\n', '\r'], " "))
}

/// Whether the slow part of a channel is a random walk or ramp to the analysis, which knows no other name for it: a cause may
/// be what makes it.
#[must_use]
pub fn may_have_causes(channel: &ChannelAnalysis) -> bool {
    let p = &channel.parameters;
    p.rate_random_walk.value.is_some() || p.rate_ramp.value.is_some()
}

/// Says of which axes.
fn walks(analysis: &Analysis) -> Option<String> {
    let channels = analysis.channels.iter();
    let names: Vec<&str> = channels
        .filter(|(_, c)| may_have_causes(c))
        .map(|(name, _)| name.as_str())
        .collect();
    (!names.is_empty()).then(|| {
        format!(
            "{}: the slow part stands here as a random walk, and causes (temperature, supply, motor) may be in it; `imu-stand \
             diagnose` finds them, and `export` of its model or JSON is without them",
            names.join(", ")
        )
    })
}

/// A rate as a person would write it: a sample interval that was measured or computed has a last digit of its own.
fn tidy(rate_hz: f64) -> f64 {
    format!("{rate_hz:.5e}").parse().unwrap_or(rate_hz)
}

/// Root mean square of those that are known; 0 where none is.
pub(super) fn rms(values: impl Iterator<Item = Option<f64>>) -> f64 {
    let known: Vec<f64> = values.flatten().collect();
    if known.is_empty() {
        return 0.0;
    }
    (known.iter().map(|v| v * v).sum::<f64>() / known.len() as f64).sqrt()
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_rate_from_times_in_whole_milliseconds_is_written_as_the_one_meant() {
        // 11999 intervals of 10 ms, the last time cut to 119 989 ms for 119 990.
        assert_eq!(super::tidy(99.999_991).to_string(), "100");
        assert_eq!(super::tidy(19.864_312).to_string(), "19.8643");
    }
}
