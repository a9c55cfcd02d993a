//! A model file on the bench: the parts of the simulated stand get the errors that were fitted, so that the firmware
//! meets them sample by sample. What the file states of a cause becomes the physics that makes it; what the bench has no
//! physics for is listed, not left out in silence.

use bench::scenario::MotorPart;
use bench::{Fault, Scenario};
use model::effect::{Parameters, value};
use model::file::{EffectModel, ModelFile};

/// The gyros of the stand, in their order.
const GYROS: [&str; 3] = ["gyro_x", "gyro_y", "gyro_z"];

/// A model file that the bench cannot stand for.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FittedError {
    /// No channel is one of the stand's gyros.
    #[error("the model has no channel gyro_x, gyro_y or gyro_z, which are what the stand has")]
    NoGyro,
    /// Rates in another unit.
    #[error("the model states {channel} in {unit}; the stand's gyros are in deg/s")]
    Unit {
        /// The channel.
        channel: String,
        /// Its unit.
        unit: String,
    },
}

/// What became of the model's effects.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Carried {
    /// On the stand: "motor_bias on gyro_x", ...
    pub over: Vec<String>,
    /// Not on the stand, with the reason.
    pub not: Vec<String>,
}

/// Gives the gyros of `scenario` the baseline of the model, and the stand its effects.
///
/// # Errors
/// [`FittedError`] where the model is of no such gyros.
pub fn onto(model: &ModelFile, scenario: &mut Scenario) -> Result<Carried, FittedError> {
    let mut any = false;
    for channel in &model.channels {
        let Some(axis) = GYROS.iter().position(|g| *g == channel.name) else {
            continue;
        };
        if channel.unit != "deg/s" {
            return Err(FittedError::Unit {
                channel: channel.name.clone(),
                unit: channel.unit.clone(),
            });
        }
        any = true;
        let of = |name: &str, or: f64| channel.baseline.get(name).map_or(or, |p| p.value);
        let part = &mut scenario.gyros[axis];
        part.angle_random_walk_deg_sqrt_h =
            of("angle_random_walk", part.angle_random_walk_deg_sqrt_h);
        part.rate_random_walk = of("rate_random_walk", 0.0);
        part.turn_on_bias_dps = of("bias", 0.0);
        part.scale_error = 0.0;
    }
    if !any {
        return Err(FittedError::NoGyro);
    }
    let mut carried = Carried::default();
    for effect in &model.effects {
        let everywhere: Vec<String> = GYROS.iter().map(|g| (*g).to_owned()).collect();
        let channels = if effect.channels.is_empty() {
            &everywhere
        } else {
            &effect.channels
        };
        let told = format!("{} on {}", effect.cause, channels.join("+"));
        let axes: Vec<usize> = channels
            .iter()
            .filter_map(|c| GYROS.iter().position(|g| g == c))
            .collect();
        match put(effect, &axes, scenario) {
            Ok(()) => carried.over.push(told),
            Err(why) => carried.not.push(format!("{told}: {why}")),
        }
    }
    for term in &model.unnamed {
        let (domain, channels) = (term.domain.id(), term.channels.join("+"));
        carried.not.push(format!(
            "unnamed {domain} on {channels}: the stand has physics for causes with a name"
        ));
    }
    Ok(carried)
}

/// One effect on the gyros `axes`.
fn put(effect: &EffectModel, axes: &[usize], scenario: &mut Scenario) -> Result<(), &'static str> {
    let p = &effect.parameters;
    let v = |name: &str| value(p, name);
    let cause = effect.cause.as_str();
    let of = |gyro: usize| {
        following(cause, p, gyro)
            .or_else(|| in_time(cause, p, gyro))
            .or_else(|| in_the_output(cause, p, gyro))
    };
    // Whether there is one does not hang on the gyro.
    if of(0).is_some() {
        let faults = axes.iter().filter_map(|gyro| of(*gyro));
        scenario.faults.extend(faults);
        return Ok(());
    }
    match cause {
        "scale_error" => {
            for axis in axes {
                scenario.gyros[*axis].scale_error = v("relative");
            }
        }
        "clock_rate" => scenario.crystal_ppm = v("ppm"),
        "dropped_samples" => scenario.faults.push(Fault::LossyLine {
            count: v("count").round().max(0.0) as usize,
        }),
        "motor_bias" => return motor(p, axes, scenario),
        _ => {
            return Err(
                "the bench has no physics that makes it of these parameters; `simulate` does",
            );
        }
    }
    Ok(())
}

/// A bias that follows what the stand records.
fn following(cause: &str, p: &Parameters, gyro: usize) -> Option<Fault> {
    let v = |name: &str| value(p, name);
    Some(match cause {
        "temperature" => Fault::Tempco {
            gyro,
            dps_per_c: v("slope"),
            dps_per_c2: 0.0,
        },
        "temperature_quadratic" => {
            // About 25 degC, wherever the file has its reference.
            let away = p.get("reference").map_or(25.0, |r| r.value) - 25.0;
            Fault::Tempco {
                gyro,
                dps_per_c: v("slope") - 2.0 * v("curvature") * away,
                dps_per_c2: v("curvature"),
            }
        }
        "supply_sensitivity" => Fault::SupplyCoupling {
            gyro,
            dps_per_volt: v("slope"),
        },
        "g_sensitivity" => Fault::GSensitivity {
            gyro,
            dps_per_g: [v("acc_x"), v("acc_y"), v("acc_z")],
        },
        _ => return None,
    })
}

/// What happens at a time, or with time.
fn in_time(cause: &str, p: &Parameters, gyro: usize) -> Option<Fault> {
    let v = |name: &str| value(p, name);
    Some(match cause {
        "warm_up" => Fault::WarmUp {
            gyro,
            amplitude_dps: v("amplitude"),
            tau_s: v("time_constant"),
        },
        "rate_ramp" => Fault::Leak {
            gyro,
            dps_per_s: v("slope"),
        },
        "bias_step" => Fault::Knock {
            gyro,
            time_s: v("time"),
            step_dps: v("height"),
            tilt_deg: 0.0,
        },
        // A ring of that pitch and length, as the bench has it: from its largest rate on.
        "shock" if p.contains_key("frequency") => Fault::Bump {
            axis: gyro,
            time_s: v("time"),
            peak_dps: v("peak"),
            linear_g: 0.0,
            frequency_hz: v("frequency"),
            decay_s: v("duration") / 3.0,
        },
        "noise_change" if v("variance_increase") >= 0.0 => Fault::NoisySpell {
            gyro,
            start_s: v("start"),
            end_s: v("end"),
            power: v("variance_increase"),
        },
        _ => return None,
    })
}

/// Processes, tones and bits.
fn in_the_output(cause: &str, p: &Parameters, gyro: usize) -> Option<Fault> {
    let v = |name: &str| value(p, name);
    Some(match cause {
        "gauss_markov" => Fault::WanderingBias {
            gyro,
            sigma_dps: v("sigma"),
            tau_s: v("correlation_time"),
        },
        "telegraph" => Fault::Trap {
            gyro,
            half_height_dps: v("half_height"),
            dwell_s: v("dwell_time"),
        },
        "line" => Fault::Vibration {
            axis: gyro,
            frequency_hz: v("frequency"),
            amplitude_dps: v("amplitude"),
            linear_g: 0.0,
        },
        "stuck_bit" if v("fraction") >= 1.0 => Fault::StuckBit {
            gyro,
            bit: v("bit") as u8,
            value: v("value") != 0.0,
        },
        _ => return None,
    })
}

/// A motor whose current is the one that was fitted, coupled into gyros.
///
/// With u = duty x V, k i = b w + c and V duty = R i + k w in rest, the current is duty x V b / (k^2 + b R) and c k /
/// (k^2 + b R) beside; right after a step it is duty x V / R, and falls with J / (b + k^2 / R).
fn motor(p: &Parameters, axes: &[usize], scenario: &mut Scenario) -> Result<(), &'static str> {
    let v = |name: &str| value(p, name);
    if v("by_magnitude") != 0.0 {
        return Err("a motor's current has a sign, and this follows its size; `simulate` does it");
    }
    let (steady, surge) = (v("at_full_duty"), v("surge_at_full_duty"));
    let blocked = steady + surge;
    let part: &mut MotorPart = &mut scenario.motor;
    let (r, k) = (part.resistance_ohm, part.constant);
    let dps_per_amp = if surge == 0.0 || steady / blocked <= 0.0 || steady / blocked >= 1.0 {
        // What follows the command alone says nothing of the motor: the bench's own, its steady current.
        steady * (k * k + part.viscous * r) / (part.driver_v * part.viscous)
    } else {
        let share = steady / blocked;
        part.viscous = share / (1.0 - share) * k * k / r;
        if v("surge_time") > 0.0 {
            part.inertia = v("surge_time") * (part.viscous + k * k / r);
        }
        blocked * r / part.driver_v
    };
    if dps_per_amp == 0.0 {
        return Err("it has no size");
    }
    let beside = v("while_turning") / dps_per_amp * (k * k + part.viscous * r) / k;
    part.coulomb = beside.max(0.0);
    let make = |gyro: &usize| Fault::MotorCoupling {
        gyro: *gyro,
        dps_per_amp,
    };
    scenario.faults.extend(axes.iter().map(make));
    Ok(())
}
