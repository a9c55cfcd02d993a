//! What a motor's current makes of a command, in the terms of the effects that follow the command.

use bench::Run;
use bench::scenario::MotorPart;
use model::record::FULL_DUTY;
use wire::Command;

use super::Size;

/// The steady current of a motor that turns is duty x `by_duty` + sign of duty x `by_friction`.
struct Current {
    /// A at full duty.
    by_duty: f64,
    /// A.
    by_friction: f64,
    /// At full duty with the rotor held, A.
    blocked: f64,
    /// In which it falls to the steady one, s.
    time_s: f64,
}

/// Of V duty = R i + k w and k i = b w + c in rest; right after a step the current is V duty / R, and the rotor gains
/// speed with J / (b + k^2 / R).
fn current(motor: &MotorPart) -> Current {
    let (r, k, b) = (motor.resistance_ohm, motor.constant, motor.viscous);
    let both = k * k + b * r;
    Current {
        by_duty: b * motor.driver_v / both,
        by_friction: k * motor.coulomb / both,
        blocked: motor.driver_v / r,
        time_s: motor.inertia / (b + k * k / r),
    }
}

/// Parameters of `motor_bias`.
pub(super) fn bias_sizes(run: &Run, dps_per_amp: f64) -> Vec<Size> {
    let current = current(&run.scenario.motor);
    let alone = dps_per_amp * (current.by_duty + current.by_friction * friction_in_duty(run));
    let at_full_duty = Size {
        without: Some(("while_turning", alone)),
        ..Size::new("at_full_duty", dps_per_amp * current.by_duty, "deg/s")
    };
    let surge = current.blocked - current.by_duty - current.by_friction;
    vec![
        at_full_duty,
        Size::new("while_turning", dps_per_amp * current.by_friction, "deg/s"),
        Size::new("surge_at_full_duty", dps_per_amp * surge, "deg/s"),
        Size::new("surge_time", current.time_s, "s"),
    ]
}

/// Parameters of `motor_noise`: the noise power is 1 + power x |current|. The motor stands still for 10 s of a run only, so
/// what the record calls rest is the power that the law has at duty 0 of a motor that turns.
pub(super) fn noise_sizes(run: &Run, power_per_amp: f64) -> Vec<Size> {
    let current = current(&run.scenario.motor);
    let turning = 1.0 + power_per_amp * current.by_friction;
    let increase = power_per_amp * current.by_duty / turning;
    vec![Size::new("variance_increase_at_full_duty", increase, "1")]
}

/// What a least squares fit of the command alone makes of a current of 1 that has the sign of the command:
/// sum |d| / sum d^2.
fn friction_in_duty(run: &Run) -> f64 {
    let mut changes: Vec<(f64, f64)> = (run.requests.iter())
        .filter_map(|timed| match timed.request.command {
            Command::MotorDuty { duty } => {
                Some((timed.at_us as f64 * 1e-6, f64::from(duty) / FULL_DUTY))
            }
            _ => None,
        })
        .collect();
    changes.push((run.seconds, 0.0));
    let lasting = || {
        changes
            .windows(2)
            .map(|pair| (pair[1].0 - pair[0].0, pair[0].1))
    };
    let size: f64 = lasting().map(|(time, duty)| time * duty.abs()).sum();
    let square: f64 = lasting().map(|(time, duty)| time * duty * duty).sum();
    if square > 0.0 { size / square } else { 0.0 }
}
