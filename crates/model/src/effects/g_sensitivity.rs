//! The gyro feels acceleration.

use crate::effect::{Docs, Effect, Example, Hypothesis, ParameterSpec, Parameters, Plot, Rival, Stage, View, Column, Regression, optional, value};
use crate::record::Quantity;
use crate::simulate::Simulation;

/// The effect.
pub struct GSensitivity;

/// The one instance that the library lists.
pub static EFFECT: GSensitivity = GSensitivity;

impl Effect for GSensitivity {
    fn id(&self) -> &'static str {
        "g_sensitivity"
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            optional("acc_x", "deg/s/g", "shift per g along x"),
            optional("acc_y", "deg/s/g", "shift per g along y"),
            optional("acc_z", "deg/s/g", "shift per g along z"),
        ];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Sensitivity to acceleration",
            physics: "b(t) = sum over axes of k a(t) / g: the proof mass of a vibrating gyro is also an accelerometer; the ADIS16250 data sheet gives 0.2 deg/s/g.",
            excitation: "Acceleration that changes by more than 0.015 g rms: shaking, tilting, a six-position test.",
            test: "Least squares on each accelerometer axis, random walk refitted.",
            figure: "Rate in blocks of acceleration against acceleration.",
            example: Example::new(Plot::RateByValue("acc_x"), &[("acc_x", 0.6)]).in_a_world(&[("vibration_g", 0.15)]),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[
            Rival { cause: "base_motion", experiment: "shake along the axis without turning (a shaker), or a six-position test" },
            Rival { cause: "cross_axis", experiment: "a six-position test at rest" },
            Rival { cause: "line", experiment: "a shaker run at another frequency" }
        ];
        RIVALS
    }

    fn hypotheses(&self, view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        let mut any = false;
        let mut all = vec![];
        for signal in view.all(Quantity::Acc) {
            any = true;
            let Some(axis) = signal.axis else { continue };
            let in_g: Vec<f64> = signal.values.iter().map(|a| a / STANDARD_GRAVITY).collect();
            if signal.std_dev() / STANDARD_GRAVITY < LEAST_RMS {
                continue;
            }
            let mean = in_g.iter().sum::<f64>() / in_g.len() as f64;
            all.push(Hypothesis::Regression(Regression {
                columns: vec![Column {
                    parameter: ["acc_x", "acc_y", "acc_z"][axis.index()],
                    values: in_g.iter().map(|a| a - mean).collect(),
                }],
                fixed: vec![],
                follows: Some(signal.name.clone()),
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

    fn stage(&self) -> Stage {
        Stage::Rate
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        for (source, name) in ["acc_x", "acc_y", "acc_z"].iter().enumerate() {
            let k = value(parameters, name);
            for &axis in channels {
                let mean = simulation.acc[source].iter().sum::<f64>() / simulation.samples.max(1) as f64;
                for (rate, a) in simulation.rate[axis].iter_mut().zip(&simulation.acc[source]) {
                    *rate += k * (a - mean);
                }
            }
        }
    }
}

/// Standard gravity, m/s^2.
const STANDARD_GRAVITY: f64 = 9.80665;
/// Smallest rms change of acceleration that is more than the accelerometer's own noise, g.
const LEAST_RMS: f64 = 0.015;
