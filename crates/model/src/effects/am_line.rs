//! A sinusoid whose amplitude swings.

use crate::parameter::Parameter;
use crate::effect::{Docs, Effect, Hypothesis, ParameterSpec, Parameters, Rival, Stage, View, Found, parameter, optional, value};
use crate::simulate::Simulation;

/// The effect.
pub struct AmLine;

/// The one instance that the library lists.
pub static EFFECT: AmLine = AmLine;

impl Effect for AmLine {
    fn id(&self) -> &'static str {
        "am_line"
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
            figure: "Amplitude spectrum of the whitened rate: a peak with two symmetric neighbours.",
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[
            Rival { cause: "line", experiment: "a longer record: side bands grow apart from the carrier" }
        ];
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

    /// Coefficients: carrier cos, sin, upper side band cos, sin, lower side band cos, sin.
    fn describe(&self, found: &Found) -> Parameters {
        let mut all = Parameters::new();
        let [c, s, uc, us, lc, ls, ..] = found.coefficients[..] else { return all };
        let amplitude = c.0.hypot(s.0);
        let error = (c.1 * s.1).sqrt();
        // Each side band of an AM line has the amplitude depth x amplitude / 2.
        let bands = uc.0.hypot(us.0) + lc.0.hypot(ls.0);
        let bands_error = uc.1.hypot(lc.1);
        let depth = bands / amplitude;
        let depth_error = depth * ((bands_error / bands).powi(2) + (error / amplitude).powi(2)).sqrt();
        all.insert("amplitude".into(), Parameter::estimated(amplitude, error, &found.unit));
        all.insert("depth".into(), Parameter::estimated(depth, depth_error, "1"));
        all.insert("phase".into(), Parameter::exact((-s.0).atan2(c.0), "rad"));
        let (upper, lower) = ((-us.0).atan2(uc.0), (-ls.0).atan2(lc.0));
        all.insert("modulation_phase".into(), Parameter::exact(half_difference(upper, lower, (-s.0).atan2(c.0)), "rad"));
        for (name, at) in ["frequency", "modulation_frequency"].iter().zip(&found.location) {
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
        let (modulation, depth, modulation_phase) = (get("modulation_frequency"), get("depth"), get("modulation_phase"));
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

/// Phase of the swing: half of upper minus lower, on the branch whose mean is the carrier's phase.
fn half_difference(upper: f64, lower: f64, carrier: f64) -> f64 {
    let swing = (upper - lower) / 2.0;
    let off = (swing + lower - carrier).cos();
    if off < 0.0 { swing + std::f64::consts::PI } else { swing }
}
