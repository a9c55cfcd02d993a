//! A filter makes neighbouring samples alike.

mod drawn;
mod mean;
mod shapes;
mod smooth;

use std::f64::consts::TAU;
use std::sync::Arc;

use crate::effect::{
    Docs, Effect, Example, Found, Frequencies, Hypothesis, ParameterSpec, Parameters, Plot, Rival,
    Stage, View, agree, detail, optional, parameter, value,
};
use crate::parameter::Parameter;
use crate::simulate::Simulation;
use drawn::{averaged, behind_a_window, two_samples, window};
use mean::Mean;
use shapes::{BehindWindow, Pole, Triangle, least_pole, logistic, pole};
use smooth::{MOST, NAMES, Smooth};

/// The effect.
pub struct LowPass;

/// Its id.
pub const ID: &str = "low_pass";

/// The one instance that the library lists.
pub static EFFECT: LowPass = LowPass;

/// Cosines of the filters of any smooth shape that are tried: each about twice as sharp as the one before.
const COSINES: [usize; 3] = [6, 14, MOST];
/// Most means one after the other.
const MOST_STAGES: usize = 3;
/// Largest correlation of neighbours that is taken for a mean of two samples where a model does not say the filter's kind.
const TWO_SAMPLES: f64 = 0.3;
/// Largest correlation that is simulated.
const MOST_ALIKE: f64 = 0.999;

const PLAIN: [ParameterSpec; 6] = [
    parameter(
        "lag1_correlation",
        "1",
        "correlation of neighbouring samples of the white part",
    ),
    optional(
        "averaged",
        "samples",
        "how many readings each is the mean of",
    ),
    optional(
        "stages",
        "1",
        "means one after the other, each of what the one before gives",
    ),
    optional(
        "triangular",
        "1",
        "1 where the filter is a triangular window of that lag1_correlation, 0 where it is one pole; left out, a mean of two samples up to a correlation of 0.3 and one pole beyond",
    ),
    optional(
        "pole",
        "1",
        "correlation from one lag to the next beyond the first, of one pole behind a window that is shorter than a sample; left out, lag1_correlation",
    ),
    optional(
        "half_power",
        "Hz",
        "frequency of which half as much passes as of the slowest; of a mean, and of a filter that has a cepstrum",
    ),
];

static PARAMETERS: [ParameterSpec; PLAIN.len() + MOST] = {
    let mut all = [PLAIN[0]; PLAIN.len() + MOST];
    let mut i = 1;
    while i < all.len() {
        all[i] = if i < PLAIN.len() {
            PLAIN[i]
        } else {
            detail(
                NAMES[i - PLAIN.len()],
                "1",
                "the filter's power gain is exp of the sum of cepstrum_k cos(2 pi k f / rate) over k, but for a factor",
            )
        };
        i += 1;
    }
    all
};

impl Effect for LowPass {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        &PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Low-pass filter",
            physics: "The white noise has passed a filter whose memory reaches over a sample: the Bartlett filter of the ADIS16250 with many taps, the digital filter of another sensor, a moving average of the logger, or a pole of the read-out. The filter passes the slowest as it is: angle_random_walk is the density of the noise before it, by which an angle grows.",
            excitation: "Nothing.",
            test: "White noise shaped by one pole, by one pole behind a window that is shorter than a sample, by a triangular window, by a mean of some readings that is taken once to three times, or by a filter of any smooth shape that passes the slow best and stops some frequency; refitted by maximum likelihood.",
            remedy: "Simulate white noise through this filter, and take fewer taps, or a lower sample rate, if the filter has to see white noise.",
            figure: "Spectrum of the rate with the model before and after: what the filter takes away.",
            example: Example::new(Plot::Spectrum, &[("lag1_correlation", 0.5)]),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[
            Rival {
                cause: "gauss_markov",
                experiment: "change the filter taps",
            },
            Rival {
                cause: "flicker",
                experiment: "change the filter taps",
            },
        ];
        RIVALS
    }

    fn hypotheses(&self, view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        if view.samples < 256 {
            return Err("fewer than 256 samples".into());
        }
        let step = view.lsb.unwrap_or(0.0) / view.neighbours_sigma;
        let rounding = step * step / 12.0;
        let smooth =
            COSINES.map(|cosines| Hypothesis::Covariance(Arc::new(Smooth { cosines, rounding })));
        let means = (1..=MOST_STAGES)
            .map(|stages| Hypothesis::Covariance(Arc::new(Mean { stages, rounding })));
        let plain = [
            Hypothesis::Covariance(Arc::new(Pole)),
            Hypothesis::Covariance(Arc::new(Triangle)),
            Hypothesis::Covariance(Arc::new(BehindWindow)),
        ];
        Ok(plain.into_iter().chain(means).chain(smooth).collect())
    }

    fn describe(&self, found: &Found) -> Parameters {
        let Some(&(theta, error)) = found.coefficients.first() else {
            return Parameters::new();
        };
        if COSINES.contains(&found.coefficients.len()) {
            return described(found);
        }
        if let Some((_, stages, _)) = found.fixed.iter().find(|f| f.0 == "stages") {
            return described_mean(found, Mean::taken(*stages as usize));
        }
        let rho = logistic(theta);
        let fixed = found
            .fixed
            .iter()
            .map(|(name, value, unit)| ((*name).to_owned(), Parameter::exact(*value, unit)));
        let size = (
            "lag1_correlation".to_owned(),
            Parameter::estimated(rho, error * rho * (1.0 - rho), "1"),
        );
        let pole = found.coefficients.get(1).map(|&(q, error)| {
            let least = least_pole(rho);
            let q_error = error * logistic(q) * (1.0 - logistic(q));
            let pole = Parameter::estimated(pole(rho, q), (rho - least) * q_error, "1");
            ("pole".to_owned(), pole)
        });
        fixed.chain([size]).chain(pole).collect()
    }

    fn named_first(&self, parameters: &Parameters) -> &'static [&'static str] {
        match parameters.get("stages").map(|p| p.value) {
            None => &[],
            Some(1.0) => &["averaged", "half_power"],
            Some(_) => &["averaged", "stages", "half_power"],
        }
    }

    fn same_event(&self, a: &Parameters, b: &Parameters) -> bool {
        agree(a, b, "lag1_correlation")
    }

    fn stage(&self) -> Stage {
        Stage::Output
    }

    fn passes(&self, parameters: &Parameters, at: &Frequencies) -> Option<Vec<f64>> {
        if let Some(cepstrum) = smooth::stated(parameters) {
            return Some(smooth::density(&cepstrum, at));
        }
        let (rho, kind) = stated(parameters);
        Some(match kind {
            Kind::Mean(mean, readings) => mean.passes(readings as f64, at),
            Kind::Triangular => Triangle::of(rho, at),
            Kind::TwoSamples => at.cosine.iter().map(|c| 1.0 + 2.0 * rho * c).collect(),
            Kind::Pole(pole) => BehindWindow::of(rho, pole.clamp(least_pole(rho), rho), at),
        })
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        let cepstrum = smooth::stated(parameters);
        let (stated, kind) = stated(parameters);
        for &axis in channels {
            // The correlation is that of the readings: rounding, which comes behind the filter, has none.
            let rounding = simulation.rounding[axis] / simulation.white_sigma[axis].powi(2);
            let noise = &mut simulation.white[axis];
            if let Some(cepstrum) = &cepstrum {
                averaged(noise, &smooth::taps(cepstrum, rounding));
                continue;
            }
            let drawn = if rounding < 1.0 { 1.0 - rounding } else { 1.0 };
            let rho = (stated / drawn).clamp(0.0, MOST_ALIKE);
            match kind {
                Kind::Mean(mean, readings) => averaged(noise, &mean.taps(readings)),
                Kind::Triangular => averaged(noise, &window(rho)),
                Kind::TwoSamples => averaged(noise, &two_samples(rho)),
                // From one lag to the next rounding changes nothing.
                Kind::Pole(pole) => behind_a_window(noise, rho, pole.clamp(least_pole(rho), rho)),
            }
        }
    }
}

/// A filter that two numbers tell.
#[derive(Clone, Copy)]
enum Kind {
    /// A mean of so many readings.
    Mean(Mean, usize),
    Triangular,
    TwoSamples,
    /// One pole, behind a window where it is smaller than the correlation of neighbours.
    Pole(f64),
}

/// Correlation of neighbours and kind that a model states.
fn stated(parameters: &Parameters) -> (f64, Kind) {
    let rho = value(parameters, "lag1_correlation").clamp(0.0, MOST_ALIKE);
    let triangular = parameters.get("triangular").map(|p| p.value != 0.0);
    let pole = parameters.get("pole").map(|p| p.value);
    let readings = parameters.get("averaged").map(|p| p.value as usize);
    let kind = match (triangular, pole) {
        _ if readings.is_some_and(|n| n > 0) => {
            let stages = parameters.get("stages").map_or(1, |p| p.value as usize);
            Kind::Mean(Mean::taken(stages.max(1)), readings.unwrap_or(1))
        }
        (Some(true), _) => Kind::Triangular,
        (None, None) if rho <= TWO_SAMPLES => Kind::TwoSamples,
        (_, pole) => Kind::Pole(pole.unwrap_or(rho)),
    };
    (rho, kind)
}

/// Parameters of a mean. Whole readings have no error.
fn described_mean(found: &Found, mean: Mean) -> Parameters {
    let readings = Mean::readings(found.coefficients[0].0).round();
    let half = mean.half_power(readings).map(|omega| {
        let hz = omega * found.rate_hz / TAU;
        ("half_power", hz, "Hz")
    });
    let all = [
        ("averaged", readings, "samples"),
        ("stages", mean.stages as f64, "1"),
        ("lag1_correlation", mean.lag1(readings), "1"),
    ];
    let all = all.into_iter().chain(half);
    all.map(|(name, value, unit)| (name.to_owned(), Parameter::exact(value, unit)))
        .collect()
}

/// Parameters of a filter of a smooth shape.
fn described(found: &Found) -> Parameters {
    let own = &found.coefficients;
    let (rho, error) = smooth::lag1(own);
    let half = smooth::half_power(own).map(|(omega, error)| {
        let hz = found.rate_hz / TAU;
        let half = Parameter::estimated(omega * hz, error * hz, "Hz");
        ("half_power".to_owned(), half)
    });
    let cepstrum = NAMES
        .iter()
        .zip(own)
        .map(|(name, (v, error))| ((*name).to_owned(), Parameter::estimated(*v, *error, "1")));
    let lag1 = (
        "lag1_correlation".to_owned(),
        Parameter::estimated(rho, error, "1"),
    );
    [lag1].into_iter().chain(half).chain(cepstrum).collect()
}
