//! PX4's parameters: the noise that its filter expects, and the thermal calibration of its gyro.

use std::fmt::Write as _;

use super::noise::{Consumer, DEG, ImuNoise, rms};

/// Rate of EKF2's steps, Hz: `EKF2_PREDICT_US` is 10 000.
pub const EKF2_RATE_HZ: f64 = 100.0;
/// MAV_PARAM_TYPE of a parameter file: REAL32 and INT32.
const REAL: u8 = 9;
const WHOLE: u8 = 6;
/// Default of `TC_G0_TREF`, degC.
const REFERENCE_DEGC: f64 = 25.0;

impl ImuNoise {
    /// A parameter file as QGroundControl loads it: vehicle, component, name, value and type between tabs. EKF2 adds
    /// (n dt)^2 to the variance of an angle at each of its steps, and (w dt)^2 to that of a bias
    /// (`Ekf::predictCovariance`); so n = N sqrt(rate), w = K sqrt(rate) of its own rate.
    pub(super) fn px4(&self, rate_hz: f64) -> String {
        let mut out = self.origin("#", Consumer::Px4);
        let _ = writeln!(
            out,
            "# For an EKF2 of {rate_hz} Hz (1e6 / EKF2_PREDICT_US), whatever the rate of the sensor: n = N sqrt(rate), w = K sqrt(rate).\n\
             # One number for all axes: their root mean square. What is not established stands at its 95 % limit.\n\
             # Vibration in flight is not in a record at rest: PX4's defaults are larger for its sake.\n\
             # vehicle component name value type"
        );
        for (axes, sensor, noise, walk) in [
            (
                &self.gyro,
                "gyroscope",
                "EKF2_GYR_NOISE",
                "EKF2_GYR_B_NOISE",
            ),
            (
                &self.acc,
                "accelerometer",
                "EKF2_ACC_NOISE",
                "EKF2_ACC_B_NOISE",
            ),
        ] {
            if axes.is_empty() {
                let _ = writeln!(out, "# {noise}, {walk}: {}", self.absent(sensor));
                continue;
            }
            let white = rms(axes.iter().map(|axis| axis.white.expected()));
            let bias = rms(axes.iter().map(|axis| axis.walk.expected()));
            line(&mut out, noise, white * rate_hz.sqrt());
            line(&mut out, walk, bias * rate_hz.sqrt());
        }
        self.thermal(&mut out);
        out
    }

    /// The polynomials of the bias over the temperature, where causes give them: X1 T + X2 T^2 about TREF.
    fn thermal(&self, out: &mut String) {
        let polynomials = ["x", "y", "z"].map(|axis| self.polynomial(&format!("gyro_{axis}")));
        if polynomials == [[0.0; 2]; 3] {
            return;
        }
        out.push_str(
            "# Thermal calibration of the gyro: set TC_G0_ID to the device's own id (CAL_GYRO0_ID), TC_G0_TMIN and TC_G0_TMAX to\n\
             # the temperatures of the record, and calibrate the gyro again afterwards: the constant part of the bias is left to that.\n",
        );
        let _ = writeln!(out, "1\t1\tTC_G_ENABLE\t1\t{WHOLE}");
        line(out, "TC_G0_TREF", REFERENCE_DEGC);
        for (axis, [slope, curvature]) in polynomials.iter().enumerate() {
            line(out, &format!("TC_G0_X0_{axis}"), 0.0);
            line(out, &format!("TC_G0_X1_{axis}"), *slope);
            line(out, &format!("TC_G0_X2_{axis}"), *curvature);
            line(out, &format!("TC_G0_X3_{axis}"), 0.0);
        }
    }

    /// Slope and curvature of a gyro's bias at [`REFERENCE_DEGC`], rad/s/K and rad/s/K^2.
    fn polynomial(&self, channel: &str) -> [f64; 2] {
        let mut sum = [self.temperature_slope(channel), 0.0];
        let quadratic =
            |c: &&super::causes::Cause| c.cause == "temperature_quadratic" && c.channel == channel;
        for cause in self.causes.iter().filter(quadratic) {
            let slope = cause.value("slope", "deg/s/degC").unwrap_or(0.0) * DEG;
            let curvature = cause.value("curvature", "deg/s/degC^2").unwrap_or(0.0) * DEG;
            let reference = cause.value("reference", "degC").unwrap_or(REFERENCE_DEGC);
            sum[0] += slope + 2.0 * curvature * (REFERENCE_DEGC - reference);
            sum[1] += curvature;
        }
        sum
    }
}

/// PX4 keeps floats of 32 bits.
fn line(out: &mut String, name: &str, value: f64) {
    let _ = writeln!(out, "1\t1\t{name}\t{}\t{REAL}", value as f32);
}
