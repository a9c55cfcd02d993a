//! The base is knocked.

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use crate::effect::{
    Docs, Effect, Example, Found, Hypothesis, ParameterSpec, Parameters, Plot, Rival, Stage, View,
    optional, parameter, unit_on, value,
};
use crate::parameter::Parameter;
use crate::record::Base;
use crate::simulate::Simulation;

/// The effect.
pub struct Shock;

/// Its id.
pub const ID: &str = "shock";

/// The one instance that the library lists.
pub static EFFECT: Shock = Shock;

/// Longest shock, s: what takes longer is a turn of the base.
pub const LONGEST_S: f64 = 1.0;
/// Longest ring, s, by the time in which it falls to a twentieth: a mount of little damping rings on.
pub const LONGEST_RING_S: f64 = 5.0;
/// Periods in that time from which on a ring may take longer than any other shock: what swings once or twice is a turn of the base.
pub const PERIODS: f64 = 3.0;
/// A ring has fallen to exp(-3), a twentieth, by its duration; it is followed until it is a thousandth.
const FALLEN: f64 = 3.0;
const OVER: f64 = 7.0;

/// The course of a shock in time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pulse {
    /// When it begins, s.
    pub start: f64,
    /// Length of a half sine; time in which a ring falls to a twentieth, s.
    pub duration: f64,
    /// Frequency of a ring, Hz, and its phase at the start, rad; none of a half sine.
    pub ring: Option<(f64, f64)>,
}

impl Pulse {
    /// That of parameters of this effect.
    #[must_use]
    pub fn of(parameters: &Parameters) -> Self {
        let of = |name: &str| parameters.get(name).map(|p| p.value);
        Self {
            start: value(parameters, "time"),
            duration: value(parameters, "duration"),
            ring: of("frequency").map(|f| (f, of("phase").unwrap_or(0.0))),
        }
    }

    /// Its value at a time, s, in units of its amplitude.
    #[must_use]
    pub fn at(&self, t: f64) -> f64 {
        let since = t - self.start;
        let part = since / self.duration.max(f64::MIN_POSITIVE);
        match self.ring {
            _ if since < 0.0 => 0.0,
            None if part > 1.0 => 0.0,
            None => (PI * part).sin(),
            Some((frequency, phase)) => {
                (-FALLEN * part).exp() * (TAU * frequency * since + phase).cos()
            }
        }
    }

    /// The readings, of `samples`, in which it is.
    #[must_use]
    pub fn span(&self, rate_hz: f64, samples: usize) -> Range<usize> {
        let lasts = match self.ring {
            None => self.duration,
            Some(_) => OVER / FALLEN * self.duration,
        };
        let place = |t: f64| (t * rate_hz).ceil().clamp(0.0, samples as f64) as usize;
        let (first, end) = (place(self.start), place(self.start + lasts));
        // What is over between two readings is in the next one.
        first..end.max((first + 1).min(samples))
    }

    /// Its values in these readings over the size of the largest of them; where none of them is in it the first has it whole.
    #[must_use]
    pub fn readings(&self, rate_hz: f64, span: Range<usize>) -> Vec<f64> {
        let mut all: Vec<f64> = span.map(|i| self.at(i as f64 / rate_hz)).collect();
        let largest = all.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        if largest == 0.0 {
            all.iter_mut().take(1).for_each(|v| *v = 1.0);
        } else {
            all.iter_mut().for_each(|v| *v /= largest);
        }
        all
    }
}

impl Effect for Shock {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            parameter("time", "s", "when it begins, from the start"),
            parameter(
                "peak",
                "deg/s",
                "largest reading of it, of a ring without its sign",
            ),
            parameter(
                "duration",
                "s",
                "length of the half sine; of a ring, the time in which it falls to a twentieth",
            ),
            optional(
                "frequency",
                "Hz",
                "frequency of the ring as sampled; a half sine where it is left out",
            ),
            optional(
                "phase",
                "rad",
                "phase of the ring at its begin, of a cosine",
            ),
        ];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Shock",
            physics: "The base is knocked: w(t) = peak sin(pi (t - time) / duration) for a blow that pushes once, peak exp(-3 (t - time) / duration) cos(2 pi frequency (t - time) + phase) where the mount rings, read at the sample rate. Gyros and accelerometers feel it at the same time, each by its own peak and phase. An input, no error of the sensor.",
            excitation: "Nothing; at least two readings of it, or two channels that feel it.",
            test: "Likelihood ratio of half sines and rings of all lengths up to a second, and of rings of many periods up to five, at all times, summed over the channels that feel them; again under the final model, where its readings are left out.",
            remedy: "Put the stand where nobody touches it, or fasten what fell; let the filter leave out the readings of that time.",
            figure: "The rate around it.",
            example: Example::new(
                Plot::Around,
                &[
                    ("time", 240.0),
                    ("peak", 3.0),
                    ("duration", 0.6),
                    ("frequency", 4.0),
                    ("phase", 0.0),
                ],
            ),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[
            Rival {
                cause: "outliers",
                experiment: "a faster sample rate: a knock has a course in time, a disturbed word has none",
            },
            Rival {
                cause: "base_motion",
                experiment: "a faster sample rate and the accelerometers: a knock rings, a turn does not",
            },
        ];
        RIVALS
    }

    fn hypotheses(&self, view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        let turned = matches!(view.base, Some(Base::Moving | Base::Turntable));
        if turned || view.moving || view.sways() {
            return Err("the base moves, and a shock is a part of that: record at rest".into());
        }
        Ok(vec![Hypothesis::Blow])
    }

    fn describe(&self, found: &Found) -> Parameters {
        let mut all = Parameters::new();
        let mut add = |name: &str, (value, error): (f64, f64), unit: &str| {
            all.insert(name.into(), Parameter::estimated(value, error, unit));
        };
        let names = ["peak", "phase"].into_iter().zip(["deg/s", "rad"]);
        for ((name, unit), of) in names.zip(&found.coefficients) {
            add(name, *of, &unit_on(unit, &found.unit));
        }
        let names = ["time", "duration", "frequency"].into_iter();
        for ((name, unit), of) in names.zip(["s", "s", "Hz"]).zip(&found.location) {
            add(name, *of, unit);
        }
        all
    }

    fn stage(&self) -> Stage {
        Stage::Rate
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        let (pulse, peak) = (Pulse::of(parameters), value(parameters, "peak"));
        let span = pulse.span(simulation.rate_hz, simulation.samples);
        let readings = pulse.readings(simulation.rate_hz, span.clone());
        for &axis in channels {
            let own = simulation.rate[axis][span.clone()].iter_mut();
            own.zip(&readings).for_each(|(rate, v)| *rate += peak * v);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE_HZ: f64 = 20.0;

    fn pulse(start: f64, duration: f64, ring: Option<(f64, f64)>) -> (Range<usize>, Vec<f64>) {
        let pulse = Pulse {
            start,
            duration,
            ring,
        };
        let span = pulse.span(RATE_HZ, 1000);
        (span.clone(), pulse.readings(RATE_HZ, span))
    }

    #[test]
    fn a_half_sine_is_read_between_its_ends_and_its_largest_reading_is_the_peak() {
        let (span, read) = pulse(1.0, 0.2, None);
        assert_eq!(span, 20..24);
        let wanted = [0.0, 0.5f64.sqrt(), 1.0, 0.5f64.sqrt()];
        assert!(
            read.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-12),
            "{read:?}"
        );
    }

    #[test]
    fn what_is_over_between_two_readings_is_in_the_next_one() {
        assert_eq!(pulse(1.01, 0.004, None), (21..22, vec![1.0]));
        assert_eq!(pulse(49.99, 0.004, None).0, 1000..1000);
    }

    #[test]
    fn a_ring_falls_to_a_twentieth_in_its_duration() {
        let (span, read) = pulse(1.0, 0.5, Some((RATE_HZ, 0.0)));
        assert_eq!(span.start, 20);
        assert!((read[10] - (-3.0f64).exp()).abs() < 1e-9, "{read:?}");
        assert!(read[read.len() - 1] < 2e-3);
    }
}
