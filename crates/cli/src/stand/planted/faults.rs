//! Each fault of the bench: its physics in a sentence, and its sizes in the parameters of the effect that names it.

use bench::{Fault, Run, Scenario};

use super::sampled::{RATE_HZ, folded, lag1_correlation, shared_sigma, tone_gain};
use super::{ACCELEROMETERS, GYROS, Planted, Size, motor};
use crate::report::plot::number;

/// In one gyro, with sizes to compare.
fn in_gyro(gyro: usize, cause: &'static str, what: String, sizes: Vec<Size>) -> Planted {
    Planted {
        what,
        cause,
        channels: vec![GYROS[gyro]],
        sizes,
        name_alone: "",
    }
}

/// A fault of the bench, as the diagnosis would state it.
pub(super) fn planted(fault: &Fault, run: &Run, start_s: f64) -> Vec<Planted> {
    match *fault {
        Fault::AccReference { share } => by_reference(share, &run.scenario).into(),
        _ => vec![one(fault, run, start_s)],
    }
}

fn one(fault: &Fault, run: &Run, start_s: f64) -> Planted {
    following(fault, run)
        .or_else(|| in_accelerometers(fault))
        .or_else(|| knocked(fault, start_s))
        .or_else(|| in_time(fault, start_s))
        .or_else(|| process(fault, &run.scenario))
        .or_else(|| in_the_readings(fault))
        .unwrap_or_else(|| Planted {
            what: "something that the diagnosis has no name for".to_owned(),
            cause: "",
            channels: vec![],
            sizes: vec![],
            name_alone: "there is no name to compare",
        })
}

/// Standard gravity, m/s^2.
const STANDARD_GRAVITY: f64 = 9.806_65;
/// Supply of the accelerometer, V, and its sensitivity there, V/g (MMA7260QT data sheet).
const ACC_SUPPLY_V: f64 = 3.3;
const ACC_V_PER_G: f64 = 0.8;

/// What accelerometers make of a reference that takes a share of what the rail changes by: V / reference falls by as much as the
/// reference rises, in proportion to the voltage of the axis, which is that of zero and of the part of gravity that it feels.
fn by_reference(share: f64, scenario: &Scenario) -> [Planted; 3] {
    let [about_x, about_y] = scenario.base.tilt_deg.map(f64::to_radians);
    let felt = [
        -about_y.sin() * about_x.cos(),
        about_x.sin(),
        about_y.cos() * about_x.cos(),
    ];
    std::array::from_fn(|axis| {
        let volts = 0.5 * ACC_SUPPLY_V + ACC_V_PER_G * felt[axis];
        let slope = -share * volts / ACC_SUPPLY_V / ACC_V_PER_G * STANDARD_GRAVITY;
        Planted {
            what: format!(
                "the converter's reference takes {} of what the 5-V rail changes by, and {} goes against it",
                number(share, 3),
                ACCELEROMETERS[axis]
            ),
            cause: "supply_sensitivity",
            channels: vec![ACCELEROMETERS[axis]],
            // Zero and sensitivity of a part are off by some percent, and the rail is no small change.
            sizes: vec![Size::new("slope", slope, "m/s^2/V").within(0.05 * slope.abs())],
            name_alone: "",
        }
    })
}
/// Parameters of `cross_axis`.
const FROM: [&str; 3] = ["from_gyro_x", "from_gyro_y", "from_gyro_z"];

/// What follows something that is recorded.
fn following(fault: &Fault, run: &Run) -> Option<Planted> {
    let scenario = &run.scenario;
    let planted = match *fault {
        Fault::Tempco {
            gyro,
            dps_per_c,
            dps_per_c2: 0.0,
        } => in_gyro(
            gyro,
            "temperature",
            format!(
                "the bias of {} follows its temperature, {} deg/s/degC",
                GYROS[gyro],
                number(dps_per_c, 3)
            ),
            vec![Size::new("slope", dps_per_c, "deg/s/degC")],
        ),
        Fault::Tempco {
            gyro,
            dps_per_c,
            dps_per_c2,
        } => {
            // About 25 degC of the die; the thermometer reads 25 at 25 less its own error.
            let slope = dps_per_c - 2.0 * dps_per_c2 * scenario.gyros[gyro].temp_offset_c;
            in_gyro(
                gyro,
                "temperature_quadratic",
                format!(
                    "the bias of {} follows its temperature along a parabola, {} deg/s/degC^2",
                    GYROS[gyro],
                    number(dps_per_c2, 3)
                ),
                vec![
                    Size::new("curvature", dps_per_c2, "deg/s/degC^2"),
                    Size::new("slope", slope, "deg/s/degC"),
                ],
            )
        }
        Fault::SupplyCoupling { gyro, dps_per_volt } => in_gyro(
            gyro,
            "supply_sensitivity",
            format!(
                "the bias of {} follows a supply that sags, {} deg/s/V",
                GYROS[gyro],
                number(dps_per_volt, 3)
            ),
            vec![Size::new("slope", dps_per_volt, "deg/s/V")],
        ),
        Fault::GSensitivity { gyro, dps_per_g } => in_gyro(
            gyro,
            "g_sensitivity",
            format!(
                "{} reacts to acceleration, {} deg/s/g, on a shaking floor",
                GYROS[gyro],
                number(dps_per_g.iter().map(|s| s * s).sum::<f64>().sqrt(), 3)
            ),
            (["acc_x", "acc_y", "acc_z"].into_iter().zip(dps_per_g))
                .map(|(parameter, size)| Size::new(parameter, size, "deg/s/g"))
                .collect(),
        ),
        Fault::MotorCoupling { gyro, dps_per_amp } => in_gyro(
            gyro,
            "motor_bias",
            format!(
                "the motor's current couples into {}, {} deg/s/A",
                GYROS[gyro],
                number(dps_per_amp, 3)
            ),
            motor::bias_sizes(run, dps_per_amp),
        ),
        Fault::Misalignment { gyro, from, share } => in_gyro(
            gyro,
            "cross_axis",
            format!(
                "{} leans towards the axis of {} and feels {} of its rate",
                GYROS[gyro],
                GYROS[from],
                number(share, 3)
            ),
            vec![Size::new(FROM[from], share, "1")],
        ),
        Fault::MotorNoise {
            gyro,
            power_per_amp,
        } => in_gyro(
            gyro,
            "motor_noise",
            format!(
                "the motor's commutation makes {} noisier, its noise power by {} for each ampere",
                GYROS[gyro],
                number(power_per_amp, 3)
            ),
            motor::noise_sizes(run, power_per_amp),
        ),
        _ => return None,
    };
    Some(planted)
}

/// What is in the accelerometers.
fn in_accelerometers(fault: &Fault) -> Option<Planted> {
    let planted = match *fault {
        Fault::AccTempco { axis, g_per_c, .. } => Planted {
            what: format!(
                "the zero of {} follows the temperature of its package, {} mg/degC",
                ACCELEROMETERS[axis],
                number(1e3 * g_per_c, 3)
            ),
            cause: "temperature",
            channels: vec![ACCELEROMETERS[axis]],
            // The gyros' thermometers follow the board a little sooner or later than its package.
            sizes: vec![
                Size::new("slope", g_per_c * STANDARD_GRAVITY, "m/s^2/degC")
                    .within(0.05 * (g_per_c * STANDARD_GRAVITY).abs()),
            ],
            name_alone: "",
        },
        _ => return None,
    };
    Some(planted)
}

/// Blows at the mount and the bench.
fn knocked(fault: &Fault, start_s: f64) -> Option<Planted> {
    let planted = match *fault {
        Fault::Knock {
            gyro,
            time_s,
            step_dps,
            ..
        } => in_gyro(
            gyro,
            "bias_step",
            format!(
                "the mount is knocked, and the bias of {} steps by {} deg/s",
                GYROS[gyro],
                number(step_dps, 3)
            ),
            vec![
                Size::new("height", step_dps, "deg/s"),
                Size::read_at("time", time_s - start_s),
            ],
        ),
        Fault::Bump {
            axis,
            time_s,
            peak_dps,
            frequency_hz,
            decay_s,
            ..
        } => in_gyro(
            axis,
            "shock",
            format!(
                "the bench is knocked: the stand rings about {} at {} Hz from {} deg/s on, and is at rest after {} s",
                &GYROS[axis][5..],
                number(frequency_hz, 3),
                number(peak_dps.abs(), 3),
                number(3.0 * decay_s, 2)
            ),
            // How large a reading of it is hangs on the instant of the reading.
            vec![Size::read_at("time", time_s - start_s)],
        ),
        _ => return None,
    };
    Some(planted)
}

/// What happens at a time, or with time.
fn in_time(fault: &Fault, start_s: f64) -> Option<Planted> {
    let planted = match *fault {
        Fault::WarmUp {
            gyro,
            amplitude_dps,
            tau_s,
        } => in_gyro(
            gyro,
            "warm_up",
            format!(
                "the bias of {} settles after power-on from {} deg/s within {} s",
                GYROS[gyro],
                number(amplitude_dps, 3),
                number(tau_s, 3)
            ),
            vec![
                // Of what it was at power-on, what is left at the first sample.
                Size::new(
                    "amplitude",
                    amplitude_dps * (-start_s / tau_s).exp(),
                    "deg/s",
                ),
                Size::new("time_constant", tau_s, "s"),
            ],
        ),
        Fault::Leak { gyro, dps_per_s } => in_gyro(
            gyro,
            "rate_ramp",
            format!(
                "the package of {} leaks: its bias runs away by {} deg/s^2",
                GYROS[gyro],
                number(dps_per_s, 3)
            ),
            vec![Size::new("slope", dps_per_s, "deg/s^2")],
        ),
        Fault::NoisySpell {
            gyro,
            start_s: from_s,
            end_s,
            power,
        } => in_gyro(
            gyro,
            "noise_change",
            format!(
                "{} is noisier for {} s, its noise power by {}",
                GYROS[gyro],
                number(end_s - from_s, 3),
                number(power, 3)
            ),
            vec![
                Size::new("variance_increase", power, "1"),
                Size::at("start", from_s - start_s),
                Size::at("end", end_s - start_s),
            ],
        ),
        Fault::Shove {
            axis,
            time_s,
            peak_dps,
            length_s,
        } => in_gyro(
            axis,
            "base_motion",
            format!(
                "somebody turns the base about {} by up to {} deg/s, and turns it back",
                &GYROS[axis][5..],
                number(peak_dps.abs(), 3)
            ),
            vec![
                Size::new("peak", peak_dps.abs(), "deg/s"),
                Size::at("start", time_s - start_s),
                Size::at("end", time_s + length_s - start_s),
            ],
        ),
        _ => return None,
    };
    Some(planted)
}

/// Noise, filters and tones.
fn process(fault: &Fault, scenario: &Scenario) -> Option<Planted> {
    let planted = match *fault {
        Fault::SlowFilter { gyro, pole_hz } => in_gyro(
            gyro,
            "low_pass",
            format!(
                "too large a capacitor at the filter pin of {}: a corner of {} Hz",
                GYROS[gyro],
                number(pole_hz, 3)
            ),
            vec![Size::new(
                "lag1_correlation",
                lag1_correlation(pole_hz, scenario.gyros[gyro].angle_random_walk_deg_sqrt_h),
                "1",
            )],
        ),
        Fault::WanderingBias {
            gyro,
            sigma_dps,
            tau_s,
        } => in_gyro(
            gyro,
            "gauss_markov",
            format!(
                "the bias of {} wanders by {} deg/s rms and returns within {} s",
                GYROS[gyro],
                number(sigma_dps, 3),
                number(tau_s, 3)
            ),
            vec![
                Size::new("sigma", sigma_dps, "deg/s"),
                Size::new("correlation_time", tau_s, "s"),
            ],
        ),
        Fault::Trap {
            gyro,
            half_height_dps,
            dwell_s,
        } => in_gyro(
            gyro,
            "telegraph",
            format!(
                "the bias of {} jumps between two values, {} deg/s apart",
                GYROS[gyro],
                number(2.0 * half_height_dps, 3)
            ),
            vec![
                Size::new("half_height", half_height_dps, "deg/s"),
                Size::new("dwell_time", dwell_s, "s"),
            ],
        ),
        Fault::CommonNoise { sigma_dps } => Planted {
            what: format!(
                "noise of {} deg/s rms on the reference that the gyros share",
                number(sigma_dps, 3)
            ),
            cause: "common_noise",
            channels: GYROS.to_vec(),
            sizes: vec![Size::new(
                "sigma",
                shared_sigma(sigma_dps, scenario.gyros[0].pole_hz),
                "deg/s",
            )],
            name_alone: "",
        },
        Fault::Vibration {
            axis,
            frequency_hz,
            amplitude_dps,
            ..
        } => {
            let seen = amplitude_dps * tone_gain(frequency_hz, scenario.gyros[axis].pole_hz);
            in_gyro(
                axis,
                "line",
                format!(
                    "a machine shakes the base about {} at {} Hz, {} deg/s",
                    &GYROS[axis][5..],
                    number(frequency_hz, 4),
                    number(amplitude_dps, 3)
                ),
                vec![
                    Size::new("amplitude", seen, "deg/s"),
                    Size::new("frequency", folded(frequency_hz), "Hz"),
                ],
            )
        }
        _ => return None,
    };
    Some(planted)
}

/// What spoils single readings, counts or frames.
fn in_the_readings(fault: &Fault) -> Option<Planted> {
    let planted = match *fault {
        Fault::Stall {
            gyro,
            count,
            length_s,
            ..
        } => Planted {
            what: format!(
                "the sample clock of {} stalls {count} times for {} s",
                GYROS[gyro],
                number(length_s, 2)
            ),
            cause: "stale_samples",
            channels: vec![GYROS[gyro]],
            sizes: vec![],
            name_alone: "frames that repeat are counted, and how many a stall makes depends on when it strikes",
        },
        Fault::Glitches {
            gyro,
            count,
            height_dps,
        } => in_gyro(
            gyro,
            "outliers",
            format!(
                "{count} discharges hit the output latch of {}, {} deg/s high",
                GYROS[gyro],
                number(height_dps, 3)
            ),
            vec![Size::new("count", count as f64, "1")],
        ),
        Fault::StuckBit { gyro, bit, value } => in_gyro(
            gyro,
            "stuck_bit",
            format!(
                "bit {bit} of {} is stuck at {}",
                GYROS[gyro],
                u8::from(value)
            ),
            vec![
                Size::new("bit", f64::from(bit), "1"),
                Size::new("value", f64::from(u8::from(value)), "1"),
            ],
        ),
        Fault::DeadSpi {
            gyro,
            start_s,
            end_s,
            ..
        } => in_gyro(
            gyro,
            "stale_samples",
            format!(
                "MISO is dead for {} s when {} is selected",
                number(end_s - start_s, 3),
                GYROS[gyro]
            ),
            // A frame at either end may be half in it.
            vec![Size::new("count", ((end_s - start_s) * RATE_HZ).round(), "1").within(2.0)],
        ),
        Fault::LossyLine { count } => Planted {
            what: format!("the serial cable loses {count} bytes"),
            cause: "dropped_samples",
            channels: vec![],
            sizes: vec![],
            name_alone: "lost frames are counted, and two lost bytes may cost one frame, or one of health that has no sample",
        },
        _ => return None,
    };
    Some(planted)
}
