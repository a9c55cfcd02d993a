//! A sinusoid in the rate.

use crate::effect::{
    Docs, Effect, Example, Found, Hypothesis, ParameterSpec, Parameters, Plot, Rival, Stage, View,
    agree, optional, parameter, value,
};
use crate::parameter::Parameter;
use crate::simulate::Simulation;

/// The effect.
pub struct Line;

/// Its id.
pub const ID: &str = "line";

/// The one instance that the library lists.
pub static EFFECT: Line = Line;

impl Effect for Line {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            parameter(
                "frequency",
                "Hz",
                "frequency as sampled; the true one may be an alias",
            ),
            parameter("amplitude", "deg/s", "amplitude"),
            optional("phase", "rad", "phase of the cosine at the start"),
        ];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Line",
            physics: "b(t) = amplitude cos(2 pi frequency t + phase): vibration of a structure, mains, a switching supply, an unbalanced rotor, seen directly or as an alias.",
            excitation: "Nothing; more than three cycles.",
            test: "Periodogram of the whitened residual at twice the Fourier frequencies, then the exact likelihood of the refined frequency.",
            remedy: "Remove or isolate the source of this frequency, or notch it; check for an alias by a run at another sample rate.",
            figure: "Amplitude spectrum of the rate around it, other terms taken out: one peak.",
            example: Example::new(
                Plot::Lines {
                    from_hz: 2.0,
                    to_hz: 2.8,
                },
                &[("frequency", 2.37), ("amplitude", 0.08)],
            ),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[
            Rival {
                cause: "am_line",
                experiment: "a longer record: side bands grow apart from the carrier",
            },
            Rival {
                cause: "motor_bias",
                experiment: "spin the motor without load, or disconnect it",
            },
            Rival {
                cause: "base_motion",
                experiment: "decouple the base from the bench",
            },
        ];
        RIVALS
    }

    fn hypotheses(&self, view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        if view.samples < 64 {
            return Err("fewer than 64 samples".into());
        }
        Ok(vec![Hypothesis::Line])
    }

    fn describe(&self, found: &Found) -> Parameters {
        let mut all = Parameters::new();
        let (c, c_error, s, s_error) = match found.coefficients[..] {
            [(c, c_error), (s, s_error), ..] => (c, c_error, s, s_error),
            // At half the sample rate there is no sine.
            [(c, c_error)] => (c, c_error, 0.0, c_error),
            [] => return all,
        };
        let amplitude = c.hypot(s);
        all.insert(
            "amplitude".into(),
            Parameter::estimated(amplitude, (c_error * s_error).sqrt(), &found.unit),
        );
        all.insert(
            "phase".into(),
            Parameter::estimated((-s).atan2(c), (c_error * s_error).sqrt() / amplitude, "rad"),
        );
        if let Some((frequency, error)) = found.location.first() {
            all.insert(
                "frequency".into(),
                Parameter::estimated(*frequency, *error, "Hz"),
            );
        }
        all
    }

    fn same_event(&self, a: &Parameters, b: &Parameters) -> bool {
        agree(a, b, "frequency")
    }

    fn stage(&self) -> Stage {
        Stage::Rate
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        let (frequency, amplitude) = (
            value(parameters, "frequency"),
            value(parameters, "amplitude"),
        );
        let phase = value(parameters, "phase");
        for &axis in channels {
            for (i, rate) in simulation.rate[axis].iter_mut().enumerate() {
                let t = i as f64 / simulation.rate_hz;
                *rate += amplitude * (std::f64::consts::TAU * frequency * t + phase).cos();
            }
        }
    }
}
