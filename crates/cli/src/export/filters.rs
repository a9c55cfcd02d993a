//! What filters read: they have to expect what a record does not establish, and take one number for all axes.

use std::fmt::Write as _;

use super::noise::{Consumer, Figure, ImuNoise, rms};

impl ImuNoise {
    /// Continuous time, two-sided densities, one number for all axes: their root mean square.
    pub(super) fn kalibr(&self, rate_hz: f64) -> String {
        let mut out = self.origin("#", Consumer::Kalibr);
        out.push_str(
            "# Continuous time, two-sided: discrete white noise is density * sqrt(rate), a step of the bias walk / sqrt(rate).\n\
             # One number for all axes: their root mean square. What is not established stands at its 95 % limit.\n\
             # What no random walk describes (flicker, temperature, vibration) is not in these numbers: `imu-stand diagnose`.\n",
        );
        for (axes, name, [unit, per_second]) in [
            (&self.acc, "accelerometer", ["m/s^2", "m/s^3"]),
            (&self.gyro, "gyroscope", ["rad/s", "rad/s^2"]),
        ] {
            if axes.is_empty() {
                let _ = writeln!(
                    out,
                    "# {}\n# Kalibr wants both:\n# {name}_noise_density:\n# {name}_random_walk:",
                    self.absent(name)
                );
                continue;
            }
            for axis in axes {
                let figure = |f: Figure| f.expected().map_or("?".to_owned(), float);
                let remark = |f: Figure| match f.remark() {
                    remark if remark.is_empty() => remark,
                    remark => format!(" ({remark})"),
                };
                let _ = writeln!(
                    out,
                    "# {}: density {}{}, walk {}{}",
                    axis.name,
                    figure(axis.white),
                    remark(axis.white),
                    figure(axis.walk),
                    remark(axis.walk)
                );
            }
            let white = rms(axes.iter().map(|axis| axis.white.expected()));
            let walk = rms(axes.iter().map(|axis| axis.walk.expected()));
            let _ = writeln!(
                out,
                "{name}_noise_density: {}  # {unit}/sqrt(Hz)",
                float(white)
            );
            let _ = writeln!(
                out,
                "{name}_random_walk: {}  # {per_second}/sqrt(Hz)",
                float(walk)
            );
        }
        let _ = writeln!(out, "rostopic: /imu0");
        let _ = writeln!(out, "update_rate: {rate_hz}  # Hz");
        out
    }

    /// Discrete numbers for one rate: VINS integrates them with dt where a density wants sqrt(dt).
    pub(super) fn vins(&self, rate_hz: f64) -> String {
        let mut out = self.origin("#", Consumer::Vins);
        let _ = writeln!(
            out,
            "# For {rate_hz} Hz and no other rate. VINS adds dt^2/2 * n^2 to a variance at each step, and dt^2 * w^2 to that of \
             the\n# bias; so n = N sqrt(2 rate), w = K sqrt(rate). What is not established stands at its 95 % limit."
        );
        for (axes, name, sensor, [unit, per_second]) in [
            (&self.acc, "acc", "accelerometer", ["m/s^2", "m/s^3"]),
            (&self.gyro, "gyr", "gyroscope", ["rad/s", "rad/s^2"]),
        ] {
            if axes.is_empty() {
                let _ = writeln!(out, "# {name}_n, {name}_w: {}", self.absent(sensor));
                continue;
            }
            let white = rms(axes.iter().map(|axis| axis.white.expected()));
            let walk = rms(axes.iter().map(|axis| axis.walk.expected()));
            let n = white * (2.0 * rate_hz).sqrt();
            let w = walk * rate_hz.sqrt();
            let _ = writeln!(out, "{name}_n: {}  # {unit}", float(n));
            let _ = writeln!(out, "{name}_w: {}  # {per_second}", float(w));
        }
        out
    }
}

/// A number as YAML 1.1 reads it, PyYAML for one: with an exponent without a sign it would be a text.
fn float(value: f64) -> String {
    let text = format!("{value:.6e}");
    match text.split_once('e') {
        Some((digits, exponent)) if !exponent.starts_with('-') => format!("{digits}e+{exponent}"),
        _ => text,
    }
}
