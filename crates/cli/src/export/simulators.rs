//! What simulators read: they must not invent what a record does not establish, and have numbers for each axis.

use std::fmt::Write as _;

use super::noise::{AxisNoise, Consumer, DEG, Figure, ImuNoise, ROOT_HOUR};

impl ImuNoise {
    /// Continuous time; two-sided with NoiseType "single-sided", whose steps are N sqrt(fs) and K / sqrt(fs).
    pub(super) fn matlab(&self, rate_hz: f64) -> String {
        let mut out = self.origin("%", Consumer::Matlab);
        out.push_str(
            "% imuSensor scales its noise by sqrt(fs/2) by default (NoiseType \"double-sided\"), which is short of N by sqrt(2);\n\
             % \"single-sided\" scales by sqrt(fs). Where a release has no NoiseType: NoiseDensity * sqrt(2), RandomWalk / sqrt(2).\n\
             % A term that the record does not establish is 0 here, and its 95 % limit stands beside it.\n",
        );
        let _ = writeln!(
            out,
            "imu = imuSensor('accel-gyro', 'SampleRate', {rate_hz});"
        );
        for (axes, of, params) in [
            (&self.gyro, "Gyroscope", "gyroparams"),
            (&self.acc, "Accelerometer", "accelparams"),
        ] {
            if axes.is_empty() {
                let _ = writeln!(out, "% {}", self.absent(&of.to_lowercase()));
                continue;
            }
            let unit = if of == "Gyroscope" { "rad/s" } else { "m/s^2" };
            let _ = writeln!(out, "imu.{of} = {params}( ...");
            for (name, of_axis, per) in [
                (
                    "NoiseDensity",
                    (|axis| axis.white) as fn(&AxisNoise) -> Figure,
                    "/sqrt(Hz)",
                ),
                ("BiasInstability", |axis| axis.flicker, ", B of IEEE 952"),
                ("RandomWalk", |axis| axis.walk, "*sqrt(Hz)"),
            ] {
                let values: Vec<String> = axes
                    .iter()
                    .map(|axis| format!("{:.6e}", of_axis(axis).simulated()))
                    .collect();
                let remarks: Vec<String> = axes
                    .iter()
                    .map(|axis| (&axis.name, self.remark_on(name, of_axis(axis))))
                    .filter(|(_, remark)| !remark.is_empty())
                    .map(|(axis, remark)| format!("{axis}: {remark}"))
                    .collect();
                let _ = writeln!(
                    out,
                    "    '{name}', [{}], ... % {unit}{per}{}{}",
                    values.join(" "),
                    if remarks.is_empty() { "" } else { "; " },
                    remarks.join("; ")
                );
            }
            self.temperature_bias(axes, unit, &mut out);
            out.push_str("    'NoiseType', 'single-sided');\n");
        }
        out
    }

    /// What stands beside a number of an axis. A model file says nothing of the flicker that it has not.
    fn remark_on(&self, parameter: &str, of: Figure) -> String {
        match of {
            Figure::Unknown if self.is_after_causes && parameter == "BiasInstability" => {
                "not in this file; `imu-stand diagnose --json` says how large it may be".to_owned()
            }
            _ => of.remark(),
        }
    }

    /// The slopes in temperature, where there are any.
    fn temperature_bias(&self, axes: &[AxisNoise], unit: &str, out: &mut String) {
        let slopes = axes.iter().map(|axis| self.temperature_slope(&axis.name));
        let slopes: Vec<f64> = slopes.collect();
        if slopes.iter().any(|slope| *slope != 0.0) {
            let slopes: Vec<String> = slopes.iter().map(|s| format!("{s:.6e}")).collect();
            let _ = writeln!(
                out,
                "    'TemperatureBias', [{}], ... % {unit}/degC from 25 degC on; imu.Temperature sets the temperature",
                slopes.join(" ")
            );
        }
    }

    /// White noise for one rate; the bias is a first-order process that looks like K over any run.
    pub(super) fn gz(&self, rate_hz: f64) -> String {
        let corr = self.long();
        let mut out = String::from("<!--\n");
        // Two hyphens would end the comment.
        out.push_str(&self.origin(" ", Consumer::Gz).replace("--", "- -"));
        let _ = writeln!(
            out,
            "  stddev is per sample, for {rate_hz} Hz and no other rate: N sqrt(rate). dynamic_bias_stddev is K, a density: the bias\n  \
             steps by K sqrt(dt). Its correlation time is ten times the record: over shorter times it is a random walk.\n  \
             A term that the record does not establish is left out. PX4's own plugin for Gazebo Classic takes N and K as they\n  \
             are in Kalibr's file. bias_mean is 0: Gazebo draws its sign at random."
        );
        for (axes, sensor) in [(&self.gyro, "gyroscope"), (&self.acc, "accelerometer")] {
            if axes.is_empty() {
                let _ = writeln!(out, "  {}", self.absent(sensor).replace("--", "- -"));
            }
        }
        out.push_str("-->\n");
        let _ = writeln!(out, "<sensor name=\"imu\" type=\"imu\">");
        let _ = writeln!(out, "  <update_rate>{rate_hz}</update_rate>");
        out.push_str("  <imu>\n");
        for (axes, element) in [
            (&self.gyro, "angular_velocity"),
            (&self.acc, "linear_acceleration"),
        ] {
            if axes.is_empty() {
                continue;
            }
            let _ = writeln!(out, "    <{element}>");
            for axis in axes {
                let letter = axis.name.chars().last().unwrap_or('x');
                let _ = writeln!(out, "      <{letter}>\n        <noise type=\"gaussian\">");
                let _ = writeln!(out, "          <mean>0</mean>");
                let stddev = axis.white.simulated() * rate_hz.sqrt();
                let _ = writeln!(out, "          <stddev>{stddev:.6e}</stddev>");
                let bias = match (axis.walk, self.process(&axis.name)) {
                    (Figure::Known(walk), _) => Some((walk, corr)),
                    // A process of this density has the variance density^2 time / 2.
                    (_, Some(p)) => Some((
                        p.sigma * (2.0 / p.correlation_time).sqrt(),
                        p.correlation_time,
                    )),
                    _ => None,
                };
                if let Some((density, time)) = bias {
                    let _ = writeln!(
                        out,
                        "          <dynamic_bias_stddev>{density:.6e}</dynamic_bias_stddev>\n          \
                         <dynamic_bias_correlation_time>{time:.6}</dynamic_bias_correlation_time>"
                    );
                }
                let _ = writeln!(out, "        </noise>\n      </{letter}>");
            }
            let _ = writeln!(out, "    </{element}>");
        }
        out.push_str("  </imu>\n</sensor>\n");
        out
    }

    /// deg/sqrt(h), deg/h; the bias is a Gauss-Markov process given by its standard deviation.
    pub(super) fn gnss_ins_sim(&self) -> String {
        let corr = self.long();
        let mut out = self.origin("#", Consumer::GnssInsSim);
        let _ = writeln!(
            out,
            "# arw and vrw: N, for any rate. gnss-ins-sim has no random walk of the bias, but a Gauss-Markov process with the\n\
             # standard deviation b_stability: K sqrt(b_corr / 2) makes it one over times far below b_corr, ten times the record.\n\
             # A term that the record does not establish is 0. Its own `b_stability` is no flicker floor B."
        );
        for (axes, sensor) in [(&self.gyro, "gyroscope"), (&self.acc, "accelerometer")] {
            if axes.is_empty() {
                let _ = writeln!(out, "# 0 below: {}", self.absent(sensor));
            }
        }
        out.push_str("import numpy as np\n\nimu_err = {\n");
        for (axes, name, noise, to_n, to_b) in [
            (&self.gyro, "gyro", "arw", ROOT_HOUR / DEG, 3600.0 / DEG),
            (&self.acc, "accel", "vrw", ROOT_HOUR, 1.0),
        ] {
            // All keys are needed, whether the record has the sensor or not.
            let list = |none: f64, of: &dyn Fn(&AxisNoise) -> f64| {
                let values: Vec<f64> = match axes.is_empty() {
                    true => vec![none; 3],
                    false => axes.iter().map(of).collect(),
                };
                let values: Vec<String> = values.iter().map(|v| format!("{v:.6e}")).collect();
                values.join(", ")
            };
            let zero = vec!["0.0"; axes.len().max(3)].join(", ");
            let n = list(0.0, &|axis| axis.white.simulated() * to_n);
            let b = list(0.0, &|axis| match self.process(&axis.name) {
                Some(process) => process.sigma * to_b,
                None => axis.walk.simulated() * (corr / 2.0).sqrt() * to_b,
            });
            // Its bias divides by the time: 0 would make each acceleration no number.
            let c = list(corr, &|axis| {
                self.process(&axis.name)
                    .map_or(corr, |p| p.correlation_time)
            });
            let _ = writeln!(out, "    '{name}_b': np.array([{zero}]),");
            let _ = writeln!(out, "    '{name}_{noise}': np.array([{n}]),");
            let _ = writeln!(out, "    '{name}_b_stability': np.array([{b}]),");
            let _ = writeln!(out, "    '{name}_b_corr': np.array([{c}]),");
        }
        out.push_str("}\n");
        out
    }

    /// A correlation time over which a process looks like a random walk for as long as anybody has looked, s.
    fn long(&self) -> f64 {
        (10.0 * self.seconds).max(3600.0).round()
    }
}
