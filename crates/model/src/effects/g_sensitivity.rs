//! The gyro feels acceleration.

use crate::effect::{
    Column, Docs, Effect, Example, Hypothesis, ParameterSpec, Parameters, Plot, Regression, Rival,
    Stage, View, optional, value,
};
use crate::record::Quantity;
use crate::simulate::Simulation;

/// The effect.
pub struct GSensitivity;

/// Its id.
pub const ID: &str = "g_sensitivity";

/// The one instance that the library lists.
pub static EFFECT: GSensitivity = GSensitivity;

impl Effect for GSensitivity {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            optional("acc_x", "deg/s/g", "shift per g along x"),
            optional("acc_y", "deg/s/g", "shift per g along y"),
            optional("acc_z", "deg/s/g", "shift per g along z"),
            optional(
                "late_x",
                "deg/s/g",
                "part of the shift along x that comes a sample late",
            ),
            optional(
                "late_y",
                "deg/s/g",
                "part of the shift along y that comes a sample late",
            ),
            optional(
                "late_z",
                "deg/s/g",
                "part of the shift along z that comes a sample late",
            ),
        ];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Sensitivity to acceleration",
            physics: "b(t) = sum over axes of k a(t) / g: the proof mass of a vibrating gyro is also an accelerometer; the ADIS16250 data sheet gives 0.2 deg/s/g. The gyro's own filter, and its pole, delay what it feels, and not what the accelerometer shows: a part of fast vibration comes in the sample after, late (a(t - 1) - a(t)) / g.",
            excitation: "Acceleration that changes by more than 0.015 g rms: shaking, tilting, a six-position test.",
            test: "Least squares on each accelerometer axis, and on its change since the sample before where the base is still; random walk refitted. More than half of it late is no filter of the gyro, unless its noise went through one.",
            remedy: "Mount the gyro away from vibration, and subtract the sensitivity times the measured acceleration from the rate.",
            figure: "Rate in blocks of acceleration against acceleration.",
            example: Example::new(Plot::RateByValue("acc_x"), &[("acc_x", 0.6)])
                .in_a_world(&[("vibration_g", 0.15)]),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[
            Rival {
                cause: "base_motion",
                experiment: "shake along the axis without turning (a shaker), or a six-position test",
            },
            Rival {
                cause: "cross_axis",
                experiment: "a six-position test at rest",
            },
            Rival {
                cause: "line",
                experiment: "a shaker run at another frequency",
            },
        ];
        RIVALS
    }

    fn hypotheses(&self, view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        let mut any = false;
        let mut all = vec![];
        let mut changes = vec![];
        let mut followed = vec![];
        for signal in view.all(Quantity::Acc) {
            any = true;
            let Some(axis) = signal.axis else { continue };
            let in_g: Vec<f64> = signal.values.iter().map(|a| a / STANDARD_GRAVITY).collect();
            if signal.std_dev() / STANDARD_GRAVITY < LEAST_RMS {
                continue;
            }
            let mean = in_g.iter().sum::<f64>() / in_g.len() as f64;
            changes.push(Column {
                parameter: LATE[axis.index()],
                values: late(&in_g).collect(),
            });
            followed.push(signal.name.as_str());
            all.push(Hypothesis::Regression(Regression {
                columns: vec![Column {
                    parameter: AT_ONCE[axis.index()],
                    values: in_g.iter().map(|a| a - mean).collect(),
                }],
                fixed: vec![],
                follows: Some(signal.name.clone()),
            }));
        }
        // What is late is so along every axis. The change of a tilt is a true rate.
        if !changes.is_empty() && !view.sways() {
            all.push(Hypothesis::Regression(Regression {
                columns: changes,
                fixed: vec![],
                follows: Some(followed.join(", ")),
            }));
        }
        match (any, all.is_empty()) {
            (false, _) => Err("no accelerometer channel".into()),
            (true, true) => Err(format!(
                "acceleration changes by less than {LEAST_RMS} g rms: do a six-position or a shaker run"
            )),
            _ => Ok(all),
        }
    }

    fn excited_by(&self) -> &'static [&'static str] {
        &["vibration_g", "sway_deg"]
    }

    fn at_most(&self, parameter: &str) -> Option<(&'static str, f64)> {
        let axis = LATE.iter().position(|l| *l == parameter)?;
        Some((AT_ONCE[axis], MOST_LATE))
    }

    fn felt_late(&self) -> bool {
        true
    }

    fn stage(&self) -> Stage {
        Stage::Rate
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        for (source, acc) in simulation.acc.iter().enumerate() {
            let mean = acc.iter().sum::<f64>() / simulation.samples.max(1) as f64;
            let (k, k_late) = (
                value(parameters, AT_ONCE[source]),
                value(parameters, LATE[source]),
            );
            for &axis in channels {
                for ((rate, a), change) in simulation.rate[axis].iter_mut().zip(acc).zip(late(acc))
                {
                    *rate += k * (a - mean) + k_late * change;
                }
            }
        }
    }
}

/// Parameters of what comes at once and in all, by axis of the acceleration.
const AT_ONCE: [&str; 3] = ["acc_x", "acc_y", "acc_z"];
/// Parameters of the part of it that comes a sample late.
const LATE: [&str; 3] = ["late_x", "late_y", "late_z"];
/// A window that covers more than one sample interval, and so delays by more than half of it, gives neighbouring samples
/// noise in common: a filter that would be seen.
const MOST_LATE: f64 = 0.5;

/// What a shift of 1 that comes a sample late adds to one that comes at once.
fn late(acc: &[f64]) -> impl Iterator<Item = f64> {
    let before = acc.iter().take(1).chain(acc);
    before.zip(acc).map(|(before, a)| before - a)
}

/// Standard gravity, m/s^2.
const STANDARD_GRAVITY: f64 = 9.80665;
/// Smallest rms change of acceleration that is more than the accelerometer's own noise, g.
const LEAST_RMS: f64 = 0.015;
