//! A tone of steady size whose pitch wanders.

use std::f64::consts::{PI, SQRT_2, TAU};

use rand_distr::{Distribution, StandardNormal, Uniform};

use super::narrow_band::LEAST_SAMPLES;
use crate::effect::{
    Docs, Effect, Example, Found, Hypothesis, ParameterSpec, Parameters, Plot, Rival, Stage, View,
    parameter, value,
};
use crate::one_source::{self, with_shared};
use crate::parameter::Parameter;
use crate::simulate::Simulation;

/// The effect.
pub struct WanderingLine;

/// Its id.
pub const ID: &str = "wandering_line";

/// The one instance that the library lists.
pub static EFFECT: WanderingLine = WanderingLine;

impl Effect for WanderingLine {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &with_shared::<3, 15>([
            parameter("amplitude", "deg/s", "amplitude"),
            parameter(
                "center_frequency",
                "Hz",
                "frequency on average, as sampled; the true one may be an alias",
            ),
            parameter(
                "linewidth",
                "Hz",
                "full width of its spectrum at half power",
            ),
        ]);
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Wandering line",
            physics: "b(t) = amplitude cos(2 pi center_frequency t + phase), the phase a random walk: its variance grows by 2 pi linewidth in a second, and the spectrum is a Lorentzian peak of that full width at half power (the line of a free-running oscillator). A motor or a fan whose speed drifts, a clock that is not locked.",
            excitation: "Nothing; some ten times 1 / linewidth.",
            test: "As for the narrow band; the mean square of the squared envelope over its squared mean is 1 of a steady tone and 2 of noise; simulations of the tone then have its sizes, and no line in the spectrum of size, pitch or square.",
            remedy: "Find the rotor or oscillator that runs free at this frequency and lock, isolate or filter it with the whole band in which it wanders.",
            figure: "Spectrum of the rate with the model before and after: a peak that is wider than a line.",
            example: Example::new(
                Plot::Spectrum,
                &[
                    ("center_frequency", 4.0),
                    ("linewidth", 0.1),
                    ("amplitude", 0.3),
                ],
            ),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[
            Rival {
                cause: "narrow_band",
                experiment: "a record that is long against 1 / linewidth: a tone keeps its size, a noise-driven mode comes and goes",
            },
            Rival {
                cause: "line",
                experiment: "a longer record: a steady line stays as narrow as the record resolves",
            },
        ];
        RIVALS
    }

    fn hypotheses(&self, view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        if view.samples < LEAST_SAMPLES {
            return Err(format!("fewer than {LEAST_SAMPLES} samples"));
        }
        Ok(vec![Hypothesis::WanderingTone])
    }

    fn describe(&self, found: &Found) -> Parameters {
        let [(a, a_error), (omega, omega_error), (half, half_error), ..] = found.coefficients[..]
        else {
            return Parameters::new();
        };
        let amplitude = SQRT_2 * found.white_sigma * (a / 2.0).exp();
        let hz = found.rate_hz / TAU;
        let width = 2.0 * half.exp() * hz;
        [
            (
                "amplitude".to_owned(),
                Parameter::estimated(amplitude, amplitude * a_error / 2.0, &found.unit),
            ),
            (
                "center_frequency".to_owned(),
                Parameter::estimated(omega * hz, omega_error * hz, "Hz"),
            ),
            (
                "linewidth".to_owned(),
                Parameter::estimated(width, width * half_error, "Hz"),
            ),
        ]
        .into()
    }

    fn stage(&self) -> Stage {
        Stage::Rate
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        let (amplitude, centre) = (
            value(parameters, "amplitude"),
            value(parameters, "center_frequency"),
        );
        let width = value(parameters, "linewidth");
        let step = (TAU * width / simulation.rate_hz).max(0.0).sqrt();
        let turn = TAU * centre / simulation.rate_hz;
        let keeps = simulation.keeps(parameters);
        for &axis in channels {
            let split = simulation.split(axis, [centre, width], parameters);
            let own = amplitude * split.own;
            let mut turning = Vec::new();
            let mut phase = Uniform::new(-PI, PI).map_or(0.0, |u| u.sample(&mut simulation.rng));
            for i in 0..simulation.samples {
                let (sin, cos) = phase.sin_cos();
                simulation.rate[axis][i] += own * cos;
                if keeps {
                    turning.push([cos, sin].map(|v| split.own * v));
                }
                let by: f64 = StandardNormal.sample(&mut simulation.rng);
                phase += turn + step * by;
            }
            // Its standard deviation, and quadratures over that.
            let rms = amplitude / SQRT_2;
            turning.iter_mut().for_each(|z| *z = z.map(|v| SQRT_2 * v));
            simulation.add_shared(axis, [rms, centre, width], &split, turning);
        }
    }

    fn same_event(&self, a: &Parameters, b: &Parameters) -> bool {
        one_source::is_one(a, b, "linewidth")
    }
}
