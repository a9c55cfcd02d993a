//! The motor current shifts the rate.

use crate::record::Base;
use crate::effect::{Docs, Effect, Hypothesis, ParameterSpec, Parameters, Rival, Stage, View, Column, Regression, optional, parameter, value};
use crate::record::Quantity;
use crate::simulate::Simulation;

/// The effect.
pub struct MotorBias;

/// The one instance that the library lists.
pub static EFFECT: MotorBias = MotorBias;

impl Effect for MotorBias {
    fn id(&self) -> &'static str {
        "motor_bias"
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            parameter("at_full_duty", "deg/s", "shift at full duty"),
            optional("by_magnitude", "1", "1 where the shift follows |duty|, else it follows the sign too"),
        ];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Motor shifts the bias",
            physics: "b(t) = at_full_duty x duty, or x |duty| where both directions are driven and the magnitude fits better: magnetic field or ground shift of the motor current.",
            excitation: "A motor command that changes, while the axis itself does not turn.",
            test: "Least squares on the command, random walk refitted.",
            figure: "Rate in time blocks against duty.",
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[
            Rival { cause: "supply_sensitivity", experiment: "switch a dummy load with the motor off" },
            Rival { cause: "line", experiment: "spin the motor without load" },
            Rival { cause: "bias_step", experiment: "switch the motor several times" }
        ];
        RIVALS
    }

    fn hypotheses(&self, view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        let signal = view.signal(Quantity::Pwm).ok_or("no motor channel: record the motor command")?;
        if view.base == Some(Base::Turntable) && view.moving {
            return Err("the motor turns this axis: its true rate follows the command; disconnect the rotor or test an axis at rest".into());
        }
        let values = || signal.values.iter();
        let (low, high) = values().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &v| (l.min(v), h.max(v)));
        let duty: Vec<f64> = values().map(|v| v / FULL_DUTY).collect();
        let size: Vec<f64> = duty.iter().map(|d| d.abs()).collect();
        let regression = |values, by_magnitude| {
            Hypothesis::Regression(Regression {
                columns: vec![Column { parameter: "at_full_duty", values }],
                fixed: if by_magnitude { vec![("by_magnitude", 1.0, "1")] } else { vec![] },
                follows: Some(signal.name.clone()),
            })
        };
        match (high - low < LEAST_CHANGE, low < 0.0 && high > 0.0) {
            (true, _) => Err("the motor command does not change: switch the motor during the record".into()),
            (false, false) => Ok(vec![regression(duty, false)]),
            (false, true) => Ok(vec![regression(duty, false), regression(size, true)]),
        }
    }

    fn stage(&self) -> Stage {
        Stage::Rate
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        let full = value(parameters, "at_full_duty");
        let by_size = value(parameters, "by_magnitude") != 0.0;
        for &axis in channels {
            for (rate, d) in simulation.rate[axis].iter_mut().zip(&simulation.duty) {
                *rate += full * if by_size { d.abs() } else { *d };
            }
        }
    }
}

/// Counts of the command at full duty.
pub(super) const FULL_DUTY: f64 = 255.0;
/// Smallest change of the command that says anything, counts.
pub(super) const LEAST_CHANGE: f64 = 8.0;
