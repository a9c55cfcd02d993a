//! A tone of steady size whose pitch wanders.

use std::f64::consts::{PI, SQRT_2, TAU};

use rand_distr::{Distribution, Uniform};

use super::narrow_band::LEAST_SAMPLES;
use crate::effect::{
    Docs, Effect, Example, Found, Hypothesis, ParameterSpec, Parameters, Plot, Rival, Stage, View,
    detail, optional, parameter, value,
};
use crate::one_source::{self, with_shared};
use crate::parameter::Parameter;
use crate::simulate::Simulation;

/// The effect.
pub struct WanderingLine;

/// Its id.
pub const ID: &str = "wandering_line";

/// Name of the correlation time of the pitch: to the last digit the same of all tones of one rotor.
pub const PITCH_TIME: &str = "pitch_time";

/// Name of the multiple of its rotor's pitch that a tone turns at.
pub const MULTIPLE: &str = "multiple";

/// Name of the phase of a tone less that many times its rotor's.
pub const ROTOR_PHASE: &str = "rotor_phase";

/// The one instance that the library lists.
pub static EFFECT: WanderingLine = WanderingLine;

impl Effect for WanderingLine {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &with_shared::<7, 19>([
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
            optional(
                "pitch_rms",
                "Hz",
                "standard deviation of its frequency; left out, the phase is a random walk",
            ),
            optional(
                PITCH_TIME,
                "s",
                "correlation time of its frequency; left out, the phase is a random walk",
            ),
            detail(
                MULTIPLE,
                "1",
                "times the pitch of the rotor that it turns with, below 0 where sampling turns it back: tones of one pitch_time turn with one rotor",
            ),
            detail(
                ROTOR_PHASE,
                "rad",
                "its phase less that many times the phase of that rotor",
            ),
        ]);
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Wandering line",
            physics: "b(t) = amplitude cos(2 pi center_frequency t + phase), the phase a random walk: its variance grows by 2 pi linewidth in a second, and the spectrum is a Lorentzian peak of that full width at half power (the line of a free-running oscillator). A pitch that stays for some time is an Ornstein-Uhlenbeck process of standard deviation pitch_rms and correlation time pitch_time, and the line that of R. Kubo (1954): nearly normal where it turns the phase by more than 1 rad in that time. A motor or a fan whose speed drifts, the hum of the mains, a clock that is not locked.",
            excitation: "Nothing; some ten times 1 / linewidth.",
            test: "A pitch so slow that its phase can be tracked: an extended Kalman filter over all channels, accelerometers among them, and multiples of the pitch up to the fifth; without the tones the record is searched again, and has to be told better than by lines and bands laid there; then the surprises of the filter have no rhythm, memory or jumps, and each size is steady. Tones of one rotor are one finding, the others its `harmonics`. Else as for the narrow band; the mean square of the squared envelope over its squared mean is 1 of a steady tone and 2 of noise; simulations of the tone then have its sizes, and no line in the spectrum of size, pitch or square.",
            remedy: "Find the rotor or oscillator that runs free at this frequency and lock, isolate or filter it with the whole band in which it wanders. At 50 or 60 Hz, a multiple of it, or where that folds to, it is the mains: shield and ground in one place, and keep cables apart.",
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

    fn named_first(&self, parameters: &Parameters) -> &'static [&'static str] {
        match parameters.contains_key("pitch_rms") {
            true => &["amplitude", "center_frequency", "pitch_rms", PITCH_TIME],
            false => &[],
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
        if let [size, omega, half, rms, time, ..] = found.coefficients[..] {
            return tracked(found, [size, omega, half, rms, time]);
        }
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
        let turn = TAU * centre / simulation.rate_hz;
        let keeps = simulation.keeps(parameters);
        for &axis in channels {
            let split = simulation.split(axis, [centre, width], parameters);
            let own = amplitude * split.own;
            let off = match Tone::of(parameters).filter(|_| split.is_own()) {
                Some(tone) => simulation.turned(&tone, parameters),
                None => simulation.wandered(parameters),
            };
            let mut turning = Vec::new();
            for (i, (rate, off)) in simulation.rate[axis].iter_mut().zip(off).enumerate() {
                let (sin, cos) = (turn * i as f64 + off).sin_cos();
                *rate += own * cos;
                if keeps {
                    turning.push([cos, sin].map(|v| split.own * v));
                }
            }
            // Its standard deviation, and quadratures over that.
            let rms = amplitude / SQRT_2;
            turning.iter_mut().for_each(|z| *z = z.map(|v| SQRT_2 * v));
            simulation.add_shared(axis, [rms, centre, width], &split, turning);
        }
    }

    fn same_event(&self, a: &Parameters, b: &Parameters) -> bool {
        one_source::is_one(a, b, "linewidth") || is_one_multiple(a, b)
    }
}

/// Whether a tone is one of those of a rotor.
#[must_use]
pub fn is_of_rotor(parameters: &Parameters) -> bool {
    Tone::of(parameters).is_some()
}

/// Whether two tones turn at one multiple with one rotor.
fn is_one_multiple(a: &Parameters, b: &Parameters) -> bool {
    let same = |name: &str| {
        let [a, b] = [a, b].map(|p| p.get(name).map(|p| p.value));
        a.is_some() && a == b
    };
    same(PITCH_TIME) && same(MULTIPLE)
}

/// The tone of a rotor: by how much its phase is the rotor's.
struct Tone {
    /// Time that the rotor's pitch stays for, s: the same of all its tones.
    time: f64,
    multiple: f64,
    phase: f64,
}

impl Tone {
    fn of(parameters: &Parameters) -> Option<Self> {
        let value = |name: &str| parameters.get(name).map(|p| p.value);
        Some(Self {
            time: value(PITCH_TIME)?,
            multiple: value(MULTIPLE).filter(|m| *m != 0.0)?,
            phase: value(ROTOR_PHASE)?,
        })
    }
}

/// By how much the phase of a rotor is ahead of its mean pitch at each sample, rad.
#[derive(Clone, Debug)]
pub struct Turned {
    /// Time that its pitch stays for, s.
    time: f64,
    phases: Vec<f64>,
}

/// Turns of a phase among which every multiple of a small denominator has any phase: the pitch may have a half and a third.
const WHOLE: f64 = 6.0;

impl Simulation {
    /// The phase of a tone beyond its mean frequency, that of the rotor of all tones that stay for one time.
    fn turned(&mut self, tone: &Tone, parameters: &Parameters) -> Vec<f64> {
        let known = self.rotors.iter().position(|r| r.time == tone.time);
        let k = known.unwrap_or_else(|| {
            // Any phase of the whole: the tone's own, and what turns it on.
            let mut phases = self.wandered(parameters);
            let first = phases.first().copied().unwrap_or(0.0);
            phases
                .iter_mut()
                .for_each(|p| *p = WHOLE * first + (*p - first) / tone.multiple);
            self.rotors.push(Turned {
                time: tone.time,
                phases,
            });
            self.rotors.len() - 1
        });
        let all = self.rotors[k].phases.iter();
        all.map(|p| tone.multiple * p + tone.phase).collect()
    }

    /// The phase of a tone that turns by itself, beyond its mean frequency.
    fn wandered(&mut self, parameters: &Parameters) -> Vec<f64> {
        let width = value(parameters, "linewidth");
        let step = (TAU * width / self.rate_hz).max(0.0).sqrt();
        let time = value(parameters, PITCH_TIME) * self.rate_hz;
        let rms = TAU * value(parameters, "pitch_rms") / self.rate_hz;
        let stays = (rms > 0.0 && time > 0.0).then(|| (rms, (-1.0 / time).exp()));
        let mut phase = Uniform::new(-PI, PI).map_or(0.0, |u| u.sample(&mut self.rng));
        let mut off = stays.map_or(0.0, |(rms, _)| rms * self.normal());
        let samples = 0..self.samples;
        let next = |_| {
            let now = phase;
            let by = self.normal();
            phase += match stays {
                Some((rms, keep)) => {
                    let before = off;
                    off = keep * off + rms * (1.0 - keep * keep).sqrt() * by;
                    0.5 * (before + off)
                }
                None => step * by,
            };
            now
        };
        samples.map(next).collect()
    }
}

/// The parameters of a tone whose phase was tracked: amplitude in the unit of the channel; mean, half width at half power and
/// standard deviation of its frequency, rad per sample; the correlation time of that, samples; each with its standard error. One of several
/// of a rotor also has its multiple of the pitch, and its phase, rad.
fn tracked(found: &Found, all: [(f64, f64); 5]) -> Parameters {
    let hz = found.rate_hz / TAU;
    let [size, mean, half, rms, time] = all;
    let told = |(v, e): (f64, f64), by: f64, unit| Parameter::estimated(v * by, e * by, unit);
    let own = [
        ("amplitude", told(size, 1.0, &found.unit)),
        ("center_frequency", told(mean, hz, "Hz")),
        ("linewidth", told(half, 2.0 * hz, "Hz")),
        ("pitch_rms", told(rms, hz, "Hz")),
        (PITCH_TIME, told(time, found.rate_hz.recip(), "s")),
    ];
    let of_rotor = match found.coefficients[all.len()..] {
        [(multiple, _), phase] => Some([
            (MULTIPLE, Parameter::exact(multiple, "1")),
            (ROTOR_PHASE, told(phase, 1.0, "rad")),
        ]),
        _ => None,
    };
    let each = own.into_iter().chain(of_rotor.into_iter().flatten());
    each.map(|(name, p)| (name.to_owned(), p)).collect()
}

/// Phase, rad, that a departure of the pitch turns by in its correlation time, from which on the line is normal to a hundredth.
const NORMAL: f64 = 36.0;
/// Levels of the continued fraction, halvings of the way to the half power.
const LEVELS: usize = 6000;
const HALVINGS: usize = 40;

/// Full width at half power of the line of a tone whose pitch is an Ornstein-Uhlenbeck process of standard deviation `rms`, rad per
/// unit of time, and correlation time `time`: in rad per unit of time. Kubo's continued fraction; of a slow pitch its normal limit.
#[must_use]
pub fn width_at_half_power(rms: f64, time: f64) -> f64 {
    if rms * time > NORMAL {
        return 2.0 * rms * (2.0 * std::f64::consts::LN_2).sqrt();
    }
    let rate = time.recip();
    let density = |omega: f64| {
        // Of s^2 / (i w + g + 2 s^2 / (i w + 2 g + ...)) from the innermost level outwards: real and imaginary part.
        let inner = (0..LEVELS).rev().fold((0.0, 0.0), |(a, b), k| {
            let (re, im) = (a + (k + 1) as f64 * rate, b + omega);
            let over = (k + 1) as f64 * rms * rms / (re * re + im * im);
            (re * over, -im * over)
        });
        let (re, im) = (inner.0, inner.1 + omega);
        re / (re * re + im * im)
    };
    let top = density(0.0);
    let (mut low, mut high) = (0.0, 4.0 * rms);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        match density(middle) > 0.5 * top {
            true => low = middle,
            false => high = middle,
        }
    }
    2.0 * low
}

#[cfg(test)]
mod tests {
    use super::width_at_half_power;

    #[test]
    fn a_line_narrows_with_the_speed_of_its_pitch() {
        // Fast: a Lorentzian of half width s^2 T. Slow: normal.
        let fast = width_at_half_power(0.02, 1.0);
        assert!(
            (fast / (2.0 * 0.02f64.powi(2)) - 1.0).abs() < 0.01,
            "{fast}"
        );
        let slow = width_at_half_power(0.02, 1750.0);
        assert!(
            (slow / (2.0 * 0.02 * (2.0 * 2f64.ln()).sqrt()) - 1.0).abs() < 0.02,
            "{slow}"
        );
    }
}
