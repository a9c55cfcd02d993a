//! A sinusoid whose amplitude swings.

use crate::effect::{
    Docs, Effect, Example, Found, Hypothesis, ParameterSpec, Parameters, Plot, Rival, Stage, View,
    optional, parameter, value,
};
use crate::parameter::Parameter;
use crate::simulate::Simulation;

/// The effect.
pub struct AmLine;

/// Its id.
pub const ID: &str = "am_line";

/// The one instance that the library lists.
pub static EFFECT: AmLine = AmLine;

impl Effect for AmLine {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            parameter("frequency", "Hz", "frequency of the carrier"),
            parameter("amplitude", "deg/s", "mean amplitude"),
            parameter("modulation_frequency", "Hz", "frequency of the swing"),
            parameter("depth", "1", "swing of the amplitude over its mean"),
            optional("phase", "rad", "phase of the carrier at the start"),
            optional("modulation_phase", "rad", "phase of the swing at the start"),
        ];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Line with swinging amplitude",
            physics: "b(t) = amplitude (1 + depth cos(2 pi modulation_frequency t + modulation_phase)) cos(2 pi frequency t + phase): two vibrations that beat, a rotor with an eccentric load.",
            excitation: "Nothing; several cycles of the swing.",
            test: "After a line: pairs of side bands at equal distances, tested together.",
            remedy: "Find and damp the two vibrations that beat, or filter at their frequencies; until then simulate the line with its modulation.",
            figure: "Amplitude spectrum of the rate around it, other terms taken out: a peak with two symmetric neighbours.",
            example: Example::new(
                Plot::Lines {
                    from_hz: 2.15,
                    to_hz: 2.65,
                },
                &[
                    ("frequency", 2.4),
                    ("amplitude", 0.12),
                    ("modulation_frequency", 0.05),
                    ("depth", 0.8),
                ],
            ),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[Rival {
            cause: "line",
            experiment: "a longer record: side bands grow apart from the carrier",
        }];
        RIVALS
    }

    fn hypotheses(&self, view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        if view.samples < 256 {
            return Err("fewer than 256 samples".into());
        }
        Ok(vec![Hypothesis::SideBands])
    }

    fn extends(&self) -> Option<&'static str> {
        Some("line")
    }

    /// Coefficients: carrier cos, sin; then, of the line itself, its swing's cos and sin.
    fn describe(&self, found: &Found) -> Parameters {
        let mut all = Parameters::new();
        let [c, s, a, b, ..] = found.coefficients[..] else {
            return all;
        };
        let amplitude = c.0.hypot(s.0);
        let error = (c.1 * s.1).sqrt();
        let swing_error = (a.1 * b.1).sqrt();
        // The size of two noisy coefficients is too large by their noise.
        let swing = (a.0 * a.0 + b.0 * b.0 - swing_error * swing_error)
            .max(0.0)
            .sqrt();
        let depth = swing / amplitude;
        let depth_error = (swing_error / amplitude).hypot(depth * error / amplitude);
        all.insert(
            "amplitude".into(),
            Parameter::estimated(amplitude, error, &found.unit),
        );
        all.insert(
            "depth".into(),
            Parameter::estimated(depth, depth_error, "1"),
        );
        all.insert("phase".into(), Parameter::exact((-s.0).atan2(c.0), "rad"));
        all.insert(
            "modulation_phase".into(),
            Parameter::exact((-b.0).atan2(a.0), "rad"),
        );
        for (name, at) in ["frequency", "modulation_frequency"]
            .iter()
            .zip(&found.location)
        {
            all.insert((*name).into(), Parameter::estimated(at.0, at.1, "Hz"));
        }
        all
    }

    fn same_event(&self, a: &Parameters, b: &Parameters) -> bool {
        super::line::EFFECT.same_event(a, b)
    }

    fn stage(&self) -> Stage {
        Stage::Rate
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        let get = |name| value(parameters, name);
        let (frequency, amplitude, phase) = (get("frequency"), get("amplitude"), get("phase"));
        let (modulation, depth, modulation_phase) = (
            get("modulation_frequency"),
            get("depth"),
            get("modulation_phase"),
        );
        let turn = std::f64::consts::TAU;
        for &axis in channels {
            for (i, rate) in simulation.rate[axis].iter_mut().enumerate() {
                let t = i as f64 / simulation.rate_hz;
                let swing = 1.0 + depth * (turn * modulation * t + modulation_phase).cos();
                *rate += amplitude * swing * (turn * frequency * t + phase).cos();
            }
        }
    }
}
