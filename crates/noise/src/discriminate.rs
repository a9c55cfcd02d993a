//! What to record to tell two causes apart: the information about one that the other leaves, under an excitation.

use std::collections::BTreeMap;
use std::sync::Arc;

use model::effect::{Effect, Hypothesis, Signal, View};
use model::excitation::World;
use model::record::{Axis, Base, FULL_DUTY, Quantity};
use rand_core::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::fit::{Coefficients, Spectrum, Term};
use crate::plan::KnownNoise;
use numerics::transform::Dct;

/// Distance d = √(2 × expected log-likelihood ratio) from which two causes count as told apart.
pub const TOLD_APART: f64 = 5.0;
/// Standard gravity, m/s²: the record holds accelerations in SI.
const STANDARD_GRAVITY: f64 = 9.80665;
/// Samples beyond which a long record is laid out at a lower rate. The noise keeps its densities; of a fast excitation
/// (vibration) fewer samples count then, so that the sizes are on the safe side.
const LAID_OUT: usize = 1 << 17;
/// Places of a bias step that are tried, in parts of the record.
const STEPS: usize = 19;

/// An excitation to choose from, in settings of the model file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Preset {
    /// For a person.
    pub name: &'static str,
    /// Of [`model::excitation::SETTINGS`].
    pub settings: &'static [(&'static str, f64)],
}

/// What a stand can do, from nothing to all it has.
pub const PRESETS: &[Preset] = &[
    Preset {
        name: "from cold, at rest (self-heating 4 degC)",
        settings: &[("self_heating_degc", 4.0)],
    },
    Preset {
        name: "heater cycle (6 degC, 240 s)",
        settings: &[("heater_degc", 6.0)],
    },
    Preset {
        name: "slow heater cycle (6 degC, 1200 s)",
        settings: &[
            ("heater_degc", 6.0),
            ("heater_period_s", 1200.0),
            ("heater_time_constant_s", 200.0),
        ],
    },
    Preset {
        name: "motor profile (duty 0.8, 80 s; supply sags 0.1 V with it)",
        settings: &[("motor_duty", 0.8), ("supply_motor_v", 0.1)],
    },
    Preset {
        name: "motor profile, and a dummy load on the supply (0.1 V, 55 s)",
        settings: &[
            ("motor_duty", 0.8),
            ("supply_motor_v", 0.1),
            ("supply_load_v", 0.1),
        ],
    },
    Preset {
        name: "vibration (0.1 g rms)",
        settings: &[("vibration_g", 0.1)],
    },
];

/// What a record of one length under one excitation would tell.
#[derive(Clone, Debug, PartialEq)]
pub struct Separation {
    /// Smallest size of the first cause that it shows at all, in the unit of its parameter.
    pub shown: f64,
    /// Smallest size at which it cannot be taken for the second cause.
    pub told_apart: f64,
    /// The parameter.
    pub parameter: &'static str,
}

/// Smallest size of `cause` that a record of `seconds` under `settings` shows, and that it tells from `rival`, on a gyro
/// about z: d = [`TOLD_APART`].
///
/// With v the variance of the DCT-II coefficients under the noise, ⟨a, b⟩ = Σ aₖbₖ/vₖ over k ≥ 1 (a constant is free): a
/// cause of shape a and size s is d = s‖a‖ from nothing and d = s‖a − proj a‖ from the best of the rival's shapes. It
/// presumes that the noise is known; a random walk refitted under each hypothesis takes a part of d, so sizes are the
/// least that can work.
///
/// # Errors
/// In words, where the excitation does not move what the cause or its rival follows, or where a cause has no shape in
/// time that could be planned for.
pub fn separation(
    cause: &dyn Effect,
    rival: &dyn Effect,
    settings: &BTreeMap<String, f64>,
    noise: &KnownNoise,
    rate_hz: f64,
    seconds: f64,
) -> Result<Separation, String> {
    let rate_hz = rate_hz.min(LAID_OUT as f64 / seconds);
    let samples = (seconds * rate_hz).round().max(8.0) as usize;
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let world = World::stated(settings, samples, rate_hz, &mut rng);
    let signals = signals(&world);
    let view = View {
        channel: "gyro_z",
        axis: Some(Axis::Z),
        lsb: None,
        white_sigma: noise.angle_random_walk_n * rate_hz.sqrt(),
        neighbours_sigma: noise.angle_random_walk_n * rate_hz.sqrt(),
        rate_hz,
        samples,
        base: Some(Base::Static),
        moving: false,
        signals: &signals,
    };
    let (parameter, own) = shapes(cause, &view)?;
    // Of a family of shapes the middle one stands for the cause.
    let own = own.get(own.len() / 2).ok_or_else(|| shapeless(cause))?;
    let weights = weights(noise, 1.0 / rate_hz, samples);
    let dct = Dct::new(samples);
    let whiten = |column: &[f64]| -> Vec<f64> {
        let c = dct.forward(column);
        c.iter().zip(&weights).map(|(c, w)| c * w).collect()
    };
    let a = whiten(&own[0]);
    let whole = dot(&a, &a);
    // A rival has nothing to say where the excitation does not move it: then the cause cannot be taken for it.
    let left = match shapes(rival, &view) {
        Err(_) => whole,
        Ok((_, family)) if family.is_empty() => return Err(shapeless(rival)),
        Ok((_, family)) => family
            .iter()
            .map(|columns| residual(&a, &columns.iter().map(|c| whiten(c)).collect::<Vec<_>>()))
            .fold(whole, f64::min),
    };
    if whole <= 0.0 {
        return Err(format!(
            "{} does not show under this excitation",
            cause.id()
        ));
    }
    // Rounding leaves a little of a shape that the rival reproduces.
    let left = if left < 1e-9 * whole { 0.0 } else { left };
    Ok(Separation {
        shown: TOLD_APART / whole.sqrt(),
        told_apart: TOLD_APART / left.sqrt(),
        parameter,
    })
}

/// Why nothing can be said of an effect that is noise.
fn shapeless(effect: &dyn Effect) -> String {
    format!(
        "{} has no shape in time that an excitation would give it: nothing can be planned for it here",
        effect.id()
    )
}

/// The parameter whose size is asked for, and the shapes: members of a family, of one or more columns each; none for a
/// cause that is noise.
type Shapes = (&'static str, Vec<Vec<Vec<f64>>>);

fn shapes(effect: &dyn Effect, view: &View<'_>) -> Result<Shapes, String> {
    let mut family = Vec::new();
    let mut parameter = effect
        .parameters()
        .first()
        .map_or("size", |specification| specification.name);
    for hypothesis in effect.hypotheses(view)? {
        match hypothesis {
            Hypothesis::Regression(r) => {
                parameter = r.columns.first().map_or(parameter, |c| c.parameter);
                family.push(r.columns.into_iter().map(|c| c.values).collect());
            }
            // A lag that nobody knows before is not planned for.
            Hypothesis::Shaped(shape) if shape.whole() => {}
            Hypothesis::Shaped(shape) => {
                for at in shape.grid() {
                    let columns = shape.columns(at);
                    parameter = columns.first().map_or(parameter, |c| c.parameter);
                    family.push(columns.into_iter().map(|c| c.values).collect());
                }
            }
            Hypothesis::Step => {
                parameter = "height";
                for i in 1..=STEPS {
                    let from = view.samples * i / (STEPS + 1);
                    let step = (0..view.samples).map(|k| f64::from(k >= from));
                    family.push(vec![step.collect()]);
                }
            }
            _ => {}
        }
    }
    Ok((parameter, family))
}

fn signals(world: &World) -> Vec<Signal> {
    let signal = |name: &str, quantity, axis, values: &[f64]| Signal {
        name: name.to_owned(),
        quantity,
        axis,
        unit: match quantity {
            Quantity::Gyro => "deg/s",
            Quantity::Acc => "m/s^2",
            Quantity::Temp => "degC",
            Quantity::Supply => "V",
            Quantity::Pwm | Quantity::Other | Quantity::Derived => "1",
        }
        .to_owned(),
        values: Arc::new(values.to_vec()),
        smooth: Arc::new(values.to_vec()),
        lsb: None,
        moving: false,
    };
    let [_, _, temperature] = &world.temperature;
    // The record holds the command in counts.
    let command: Vec<f64> = world.duty.iter().map(|d| d * FULL_DUTY).collect();
    let in_si = |g: &[f64]| -> Vec<f64> { g.iter().map(|g| g * STANDARD_GRAVITY).collect() };
    let [x, y, z] = world.acc.each_ref().map(|a| in_si(a));
    vec![
        signal(
            "the temperature",
            Quantity::Temp,
            Some(Axis::Z),
            temperature,
        ),
        signal("supply", Quantity::Supply, None, &world.supply),
        signal("pwm", Quantity::Pwm, None, &command),
        signal("acc_x", Quantity::Acc, Some(Axis::X), &x),
        signal("acc_y", Quantity::Acc, Some(Axis::Y), &y),
        signal("acc_z", Quantity::Acc, Some(Axis::Z), &z),
    ]
}

/// 1/√v of each DCT-II coefficient, 0 for the constant.
fn weights(noise: &KnownNoise, tau0: f64, samples: usize) -> Vec<f64> {
    let c: Coefficients = [
        Term::White.coefficient(noise.angle_random_walk_n, tau0),
        Term::Flicker.coefficient(noise.bias_instability_b, tau0),
        Term::RandomWalk.coefficient(noise.rate_random_walk_k, tau0),
        Term::Quantization.coefficient(noise.quantization_noise_q, tau0),
    ];
    (0..samples)
        .map(|k| {
            if k == 0 {
                return 0.0;
            }
            let w = std::f64::consts::PI * k as f64 / samples as f64;
            Spectrum::variance_at(w, &c).sqrt().recip()
        })
        .collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// ‖a‖² less its projection on the columns, by Gram-Schmidt.
fn residual(a: &[f64], columns: &[Vec<f64>]) -> f64 {
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for column in columns {
        let mut left = column.clone();
        let length = dot(column, column);
        for b in &basis {
            let along = dot(&left, b);
            left.iter_mut().zip(b).for_each(|(l, b)| *l -= along * b);
        }
        let norm = dot(&left, &left);
        // A column that the others make is none of its own.
        if norm > 1e-12 * length {
            let scale = norm.sqrt().recip();
            left.iter_mut().for_each(|l| *l *= scale);
            basis.push(left);
        }
    }
    let mut rest = a.to_vec();
    for b in &basis {
        let along = dot(&rest, b);
        rest.iter_mut().zip(b).for_each(|(r, b)| *r -= along * b);
    }
    dot(&rest, &rest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic::Truth;
    use model::effects::effect;

    const NOISE: KnownNoise = KnownNoise {
        angle_random_walk_n: 5.27 / 60.0,
        bias_instability_b: 0.0,
        rate_random_walk_k: 0.0015,
        quantization_noise_q: 0.0,
        rate_ramp_r: 0.0,
    };

    fn plan(cause: &str, rival: &str, settings: &[(&str, f64)], seconds: f64) -> Separation {
        let settings = settings
            .iter()
            .map(|(k, v)| ((*k).to_owned(), *v))
            .collect();
        separation(
            effect(cause).unwrap(),
            effect(rival).unwrap(),
            &settings,
            &NOISE,
            20.0,
            seconds,
        )
        .unwrap()
    }

    #[test]
    fn a_heater_cycle_tells_temperature_from_a_ramp_and_self_heating_does_not_tell_it_from_warm_up()
    {
        let heater = plan("temperature", "rate_ramp", &[("heater_degc", 6.0)], 600.0);
        let cold = [("self_heating_degc", 4.0)];
        let ramp = plan("temperature", "rate_ramp", &cold, 600.0);
        let warm_up = plan("temperature", "warm_up", &cold, 600.0);
        assert!(heater.told_apart < 1.1 * heater.shown, "{heater:?}");
        assert!(ramp.told_apart > 1.3 * ramp.shown, "{ramp:?}");
        assert!(warm_up.told_apart > 5.0 * warm_up.shown, "{warm_up:?}");
    }

    #[test]
    fn only_a_load_of_its_own_tells_the_supply_from_the_motor_that_makes_it_sag() {
        // A sag that follows the magnitude of the duty is the same shape as a motor bias by magnitude.
        let motor = [("motor_duty", 0.8), ("supply_motor_v", 0.1)];
        let alone = plan("supply_sensitivity", "motor_bias", &motor, 600.0);
        let load = [motor[0], motor[1], ("supply_load_v", 0.1)];
        let switched = plan("supply_sensitivity", "motor_bias", &load, 600.0);
        assert!(alone.told_apart > 20.0 * alone.shown, "{alone:?}");
        assert!(switched.told_apart < 2.0 * switched.shown, "{switched:?}");
    }

    #[test]
    fn the_planned_distance_is_the_likelihood_ratio_of_simulated_records() {
        let settings: BTreeMap<String, f64> = [("self_heating_degc".to_owned(), 4.0)].into();
        let (seconds, rate) = (600.0, 20.0);
        let planned = plan(
            "temperature",
            "rate_ramp",
            &[("self_heating_degc", 4.0)],
            seconds,
        );
        let samples = (seconds * rate) as usize;
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        let world = World::stated(&settings, samples, rate, &mut rng);
        let [_, _, t] = &world.temperature;
        let mean = t.iter().sum::<f64>() / samples as f64;
        let truth = Truth {
            n: NOISE.angle_random_walk_n,
            k: NOISE.rate_random_walk_k,
            ..Truth::default()
        };
        let dct = Dct::new(samples);
        let w = weights(&NOISE, 1.0 / rate, samples);
        let whiten =
            |y: &[f64]| -> Vec<f64> { dct.forward(y).iter().zip(&w).map(|(c, w)| c * w).collect() };
        let temperature = whiten(&t.iter().map(|t| t - mean).collect::<Vec<_>>());
        let ramp = whiten(&(0..samples).map(|i| i as f64).collect::<Vec<_>>());
        let size = planned.told_apart;
        let runs = 100;
        let ratio: f64 = (0..runs)
            .map(|_| {
                let mut y = truth.record(samples, 1.0 / rate, &mut rng);
                for (y, t) in y.iter_mut().zip(t) {
                    *y += size * t;
                }
                let y = whiten(&y);
                residual(&y, std::slice::from_ref(&ramp))
                    - residual(&y, std::slice::from_ref(&temperature))
            })
            .sum::<f64>()
            / f64::from(runs);
        // Expected 25; a single ratio has a standard deviation of 2 x 5, the mean one of 1.
        assert!((ratio - TOLD_APART * TOLD_APART).abs() < 4.0, "{ratio}");
    }
}
