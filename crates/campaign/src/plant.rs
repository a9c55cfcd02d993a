//! What is planted in a stand: an effect of the library, at a wanted strength.

use model::Parameter;
use model::effect::{Parameters, Stage};
use model::effects::effect;
use model::file::EffectModel;
use model::record::flag;
use model::simulate::{Simulation, Stretch};
use rand_core::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::motor;
use crate::random::Draw;
use crate::stand::{GYROS, LSB, Needs, Stand};
use crate::strength::{Meter, of_common, of_variance, size_for};

/// Causes whose strength is a d'.
pub const BY_STRENGTH: [&str; 22] = [
    "temperature",
    "temperature_quadratic",
    "warm_up",
    "rate_ramp",
    "line",
    "am_line",
    "motor_bias",
    CURRENT,
    "motor_noise",
    "g_sensitivity",
    "supply_sensitivity",
    "bias_step",
    "cross_axis",
    "scale_error",
    "gauss_markov",
    "flicker",
    "low_pass",
    "telegraph",
    "common_noise",
    "noise_change",
    "narrow_band",
    "wandering_line",
];
/// Causes that are counted, at sizes that are certain to show.
pub const BY_COUNT: [&str; 9] = [
    "base_motion",
    "outliers",
    "saturation",
    "coarse_lsb",
    "stuck_bit",
    "stale_samples",
    "dropped_samples",
    "timestamp_jitter",
    "clock_rate",
];
/// The motor's bias by physics: it follows the current of a motor that has to spin up, not the command.
pub const CURRENT: &str = "motor_bias by current";

/// The strength from which a cause is asked to be named.
#[must_use]
pub fn asked_from(cause: &str) -> f64 {
    match cause {
        "am_line" => 13.0,
        "telegraph" | "noise_change" | "scale_error" => 10.0,
        _ => 8.0,
    }
}

/// How far above the oracle's limit the smallest named size may lie.
#[must_use]
pub fn asked_ratio(cause: &str) -> f64 {
    match cause {
        "am_line" => 2.5,
        "telegraph" | "noise_change" | "scale_error" => 2.0,
        "line" => 1.7,
        "bias_step" => 1.5,
        _ => 1.3,
    }
}

/// What is true of a run.
#[derive(Clone, Debug)]
pub struct Truth {
    /// Row of the tables.
    pub label: &'static str,
    /// Cause id that the answer has to give.
    pub cause: &'static str,
    /// Channel; empty where it concerns all.
    pub channel: String,
    /// d', or NaN for what is counted.
    pub strength: f64,
    /// Parameters.
    pub parameters: Parameters,
    /// Signal that it adds to its channel, where it is one.
    pub signal: Option<Vec<f64>>,
    /// Variance that it adds to the coefficients of its channel, by bin, where it is a process.
    pub density: Option<Vec<f64>>,
}

/// The environment that a cause needs.
#[must_use]
pub fn needs(cause: &str) -> Needs {
    Needs {
        temperature: matches!(cause, "temperature" | "temperature_quadratic"),
        supply: cause == "supply_sensitivity",
        motor: matches!(cause, "motor_bias" | "motor_noise" | CURRENT),
        vibration: cause == "g_sensitivity",
    }
}

/// The cause id of a row.
#[must_use]
pub fn id_of(label: &'static str) -> &'static str {
    if label == CURRENT {
        "motor_bias"
    } else {
        label
    }
}

fn parameters_of(cause: &str, values: &[(&str, f64)]) -> Parameters {
    let specs = effect(cause).map_or(&[][..], |e| e.parameters());
    values
        .iter()
        .map(|(name, value)| {
            let unit = specs
                .iter()
                .find(|s| s.name == *name)
                .map_or("1", |s| s.unit);
            ((*name).to_owned(), Parameter::exact(*value, unit))
        })
        .collect()
}

/// An empty run in the world of a stand, for an effect to act on.
fn blank(stand: &Stand) -> Simulation {
    let n = stand.samples();
    let zeros = || std::array::from_fn(|_| vec![0.0; n]);
    let times: Vec<f64> = (0..n).map(|i| i as f64 / stand.rate_hz).collect();
    let mut motion: [Vec<f64>; 3] = zeros();
    let setting = |key: &str| {
        stand
            .excitation
            .iter()
            .find(|(k, _)| *k == key)
            .map(|s| s.1)
    };
    if let (Some(turn), Some(period)) = (setting("turn_dps"), setting("turn_period_s")) {
        let w = std::f64::consts::TAU / period;
        motion[2] = times.iter().map(|t| turn * (w * t).sin()).collect();
    }
    Simulation {
        rate_hz: stand.rate_hz,
        samples: n,
        span: n,
        stretches: vec![Stretch {
            samples: 0..n,
            skipped: 0,
        }],
        rng: Xoshiro256PlusPlus::seed_from_u64(1),
        temperature: stand.world.temperature.clone(),
        supply: stand.world.supply.clone(),
        duty: stand.world.duty.clone(),
        acc: stand.world.acc.clone(),
        motion,
        scale: [1.0; 3],
        rate: zeros(),
        white_sigma: [0.0; 3],
        variance: std::array::from_fn(|_| vec![1.0; n]),
        white: Default::default(),
        counts: Default::default(),
        flags: vec![flag::IN_ORDER; n],
        keep: vec![true; n],
        device_time: times.clone(),
        host_time: times,
    }
}

/// What an effect without chance adds to the rate of an axis.
fn signal_of(stand: &Stand, cause: &str, parameters: &Parameters, axis: usize) -> Vec<f64> {
    let mut run = blank(stand);
    if let Some(e) = effect(cause).filter(|e| e.stage() == Stage::Rate) {
        e.simulate(parameters, &[axis], &mut run);
    }
    std::mem::take(&mut run.rate[axis])
}

/// Largest process, deg/s rms: slower ones, which a random walk hides better, would need more for the strength, and what
/// moves that much below 1 Hz is a turn of the base to anyone who has the gyro alone.
const LARGEST_RMS: f64 = 0.25;

/// A drawn process: its time, and its size, strength and density.
type Process = (f64, (f64, f64, Vec<f64>));

/// The first draw that is as strong as wanted, or else the strongest of many.
fn strongest(wanted: f64, drawn: &mut dyn FnMut() -> Process) -> Process {
    const TRIES: usize = 40;
    let mut best = drawn();
    for _ in 0..TRIES {
        if best.1.1 >= 0.99 * wanted {
            break;
        }
        let other = drawn();
        if other.1.1 > best.1.1 {
            best = other;
        }
    }
    best
}

/// Density of a process of variance 1 with one pole, rad per sample.
fn one_pole(pole: f64, w: f64) -> f64 {
    (1.0 - pole * pole) / (1.0 + pole * pole - 2.0 * pole * w.cos())
}

/// Plant `label` on `axis` of a stand at a strength of `wanted`. The stand's excitation may gain a turn or a sway.
///
/// # Panics
/// Never for the labels of [`BY_STRENGTH`].
#[must_use]
pub fn plant(
    draw: &mut Draw,
    stand: &mut Stand,
    label: &'static str,
    axis: usize,
    wanted: f64,
) -> Truth {
    let seconds = stand.seconds;
    let cause = id_of(label);
    let channel = GYROS[axis].to_owned();
    let of_shape =
        |stand: &Stand, shape: &[(&str, f64)], sized: &[(&str, f64)], less: &[Vec<f64>]| {
            let all = |size: f64| {
                let scaled: Vec<(&str, f64)> = sized.iter().map(|(k, v)| (*k, v * size)).collect();
                parameters_of(cause, &[shape, &scaled[..]].concat())
            };
            let meter = Meter::new(stand, axis);
            let unit = signal_of(stand, cause, &all(1.0), axis);
            let seen = if less.is_empty() {
                unit.clone()
            } else {
                meter.beyond(&unit, less)
            };
            let (size, strength) = meter.sized(&meter.energy(&seen), wanted);
            (
                all(size),
                strength,
                unit.iter().map(|v| v * size).collect::<Vec<f64>>(),
            )
        };
    let of_density = |stand: &Stand, largest: f64, density: &dyn Fn(f64, f64) -> f64| {
        let meter = Meter::new(stand, axis);
        let strength = |size: f64| {
            let all: Vec<f64> = meter.omega().iter().map(|w| density(size, *w)).collect();
            meter.of_density(&all)
        };
        let size = size_for(wanted, &strength).min(largest);
        let all: Vec<f64> = meter.omega().iter().map(|w| density(size, *w)).collect();
        (size, strength(size), all)
    };
    let sign = draw.sign();
    let truth = |parameters, strength, signal| Truth {
        label,
        cause,
        channel: channel.clone(),
        strength,
        parameters,
        signal,
        density: None,
    };
    let process = |parameters, strength, density| Truth {
        density: Some(density),
        ..truth(parameters, strength, None)
    };
    match label {
        "temperature" => {
            let (p, d, s) = of_shape(stand, &[], &[("slope", sign)], &[]);
            truth(p, d, Some(s))
        }
        "temperature_quadratic" => {
            // Measured beyond a straight line, for a parabola that a line fits is none.
            let lean = draw.between(-5.0, 5.0);
            let line = stand.world.temperature[axis].clone();
            let sized = [("slope", sign * lean), ("curvature", sign)];
            let (p, d, s) = of_shape(stand, &[], &sized, &[line]);
            truth(p, d, Some(s))
        }
        "warm_up" => {
            let tau = draw.by_ratio(seconds / 60.0, seconds / 4.0);
            let (p, d, s) = of_shape(
                stand,
                &[("time_constant", tau)],
                &[("amplitude", sign)],
                &[],
            );
            truth(p, d, Some(s))
        }
        "rate_ramp" => {
            let (p, d, s) = of_shape(stand, &[], &[("slope", sign)], &[]);
            truth(p, d, Some(s))
        }
        "line" => {
            let f = draw.by_ratio(0.05, 0.49 * stand.rate_hz);
            let phase = draw.between(-3.1, 3.1);
            let shape = [("frequency", f), ("phase", phase)];
            let (p, d, s) = of_shape(stand, &shape, &[("amplitude", 1.0)], &[]);
            truth(p, d, Some(s))
        }
        "am_line" => {
            let frequency = draw.between(0.05, 0.45) * stand.rate_hz;
            let shape = [
                ("frequency", frequency),
                ("modulation_frequency", draw.by_ratio(0.02, 0.2 * frequency)),
                ("depth", draw.between(0.5, 1.0)),
                ("phase", draw.between(-3.1, 3.1)),
                ("modulation_phase", draw.between(-3.1, 3.1)),
            ];
            let (p, d, s) = of_shape(stand, &shape, &[("amplitude", 1.0)], &[]);
            truth(p, d, Some(s))
        }
        "motor_bias" => {
            let both = stand.world.duty.iter().any(|d| *d < 0.0);
            let size = f64::from(u8::from(both && draw.chance(0.4)));
            let (p, d, s) = of_shape(
                stand,
                &[("by_magnitude", size)],
                &[("at_full_duty", sign)],
                &[],
            );
            truth(p, d, Some(s))
        }
        CURRENT => {
            let unit = motor::current(draw, &stand.world.duty, stand.rate_hz);
            let meter = Meter::new(stand, axis);
            let (size, strength) = meter.sized(&meter.energy(&unit), wanted);
            let signal = unit.iter().map(|v| sign * size * v).collect();
            truth(Parameters::new(), strength, Some(signal))
        }
        "motor_noise" => {
            let square: Vec<f64> = stand.world.duty.iter().map(|d| d * d).collect();
            let law = |size: f64| square.iter().map(|d| 1.0 + size * d).collect::<Vec<f64>>();
            let size = size_for(wanted, &|x| of_variance(&law(x)));
            let p = parameters_of(cause, &[("variance_increase_at_full_duty", size)]);
            truth(p, of_variance(&law(size)), None)
        }
        "noise_change" => {
            let length = seconds * draw.between(0.1, 0.4);
            let start = draw.between(0.02 * seconds, 0.98 * seconds - length);
            let inside = length / seconds;
            let strength = |x: f64| {
                let n = stand.samples() as f64;
                (n * ((1.0 + inside * x).ln() - inside * (1.0 + x).ln()))
                    .max(0.0)
                    .sqrt()
            };
            let size = size_for(wanted, &strength);
            let values = [
                ("start", start),
                ("end", start + length),
                ("variance_increase", size),
            ];
            truth(parameters_of(cause, &values), strength(size), None)
        }
        "g_sensitivity" => {
            let name = ["acc_x", "acc_y", "acc_z"][draw.of_many(3)];
            let (p, d, s) = of_shape(stand, &[], &[(name, sign)], &[]);
            truth(p, d, Some(s))
        }
        "supply_sensitivity" => {
            let (p, d, s) = of_shape(stand, &[], &[("slope", sign)], &[]);
            truth(p, d, Some(s))
        }
        "bias_step" => {
            let at = seconds * draw.between(0.1, 0.9);
            let (p, d, s) = of_shape(stand, &[("time", at)], &[("height", sign)], &[]);
            truth(p, d, Some(s))
        }
        "cross_axis" => {
            let turn = draw.between(7.0, 28.0);
            stand.excitation = vec![
                ("turn_dps", turn),
                ("turn_period_s", draw.between(15.0, 60.0)),
            ];
            let (p, d, s) = of_shape(stand, &[], &[("from_gyro_z", sign)], &[]);
            truth(p, d, Some(s))
        }
        "scale_error" => {
            let (sway, period) = (draw.between(2.0, 8.0), draw.between(5.0, 20.0));
            stand.excitation = vec![("sway_deg", sway), ("sway_period_s", period)];
            // Amplitude of the rate, and how well rate and tilt give it: sqrt(2 / n) of their white noise.
            let w = std::f64::consts::TAU / period;
            let n = stand.samples() as f64;
            let tilt = (4.7f64 / 800.0).to_degrees() * w;
            let error = ((2.0 / n) * (stand.white(axis) + tilt * tilt)).sqrt() / (sway * w);
            let relative = sign * (wanted * error).min(0.5);
            let p = parameters_of(cause, &[("relative", relative)]);
            truth(p, relative.abs() / error, None)
        }
        "gauss_markov" => {
            let (tau, (sigma, d, density)) = strongest(wanted, &mut || {
                let tau = draw.by_ratio(0.2, 10.0);
                let pole = (-1.0 / (tau * stand.rate_hz)).exp();
                (
                    tau,
                    of_density(stand, LARGEST_RMS, &|sigma, w| {
                        sigma * sigma * one_pole(pole, w)
                    }),
                )
            });
            let values = [("sigma", sigma), ("correlation_time", tau)];
            process(parameters_of(cause, &values), d, density)
        }
        "telegraph" => {
            let (dwell, (half, d, density)) = strongest(wanted, &mut || {
                let dwell = draw.by_ratio(3.0, 40.0);
                let pole = (-2.0 / (dwell * stand.rate_hz)).exp();
                (
                    dwell,
                    of_density(stand, LARGEST_RMS, &|half, w| {
                        half * half * one_pole(pole, w)
                    }),
                )
            });
            let values = [("half_height", half), ("dwell_time", dwell)];
            process(parameters_of(cause, &values), d, density)
        }
        "flicker" => {
            // Two-sided density B^2 / (2 pi f): B^2 / w per sample.
            let (b, d, density) = of_density(stand, LARGEST_RMS, &|b, w| b * b / w);
            let p = parameters_of(cause, &[("bias_instability", b * 3600.0)]);
            process(p, d, density)
        }
        "low_pass" => {
            let white = stand.white(axis);
            let of = |rho: f64| rho.min(0.7);
            let density = |rho: f64, w: f64| {
                let rho = of(rho);
                white
                    * if rho <= 0.3 {
                        2.0 * rho * w.cos()
                    } else {
                        (1.0 - rho * rho) / (1.0 + rho * rho - 2.0 * rho * w.cos()) - 1.0
                    }
            };
            let (rho, d, density) = of_density(stand, f64::INFINITY, &density);
            let p = parameters_of(cause, &[("lag1_correlation", of(rho))]);
            process(p, d, density)
        }
        "narrow_band" | "wandering_line" => {
            let (size_name, wide, per_rms) = if cause == "narrow_band" {
                ("rms", "bandwidth", 1.0)
            } else {
                ("amplitude", "linewidth", 2f64.sqrt())
            };
            let centre = draw.by_ratio(0.03, 0.45) * stand.rate_hz;
            // Some hundred independent values of the envelope, and no wider than a tenth of the centre.
            let width = draw.by_ratio(30.0, 300.0) / (std::f64::consts::PI * seconds);
            let width = width.min(0.1 * centre);
            let per_sample = std::f64::consts::TAU / stand.rate_hz;
            let pole = (-0.5 * per_sample * width).exp();
            let (rms, d, density) = of_density(stand, f64::INFINITY, &|rms, w| {
                let turn = per_sample * centre;
                0.5 * rms * rms * (one_pole(pole, w - turn) + one_pole(pole, w + turn))
            });
            let values = [
                (size_name, rms * per_rms),
                ("center_frequency", centre),
                (wide, width),
            ];
            process(parameters_of(cause, &values), d, density)
        }
        "common_noise" => {
            let whites: Vec<f64> = (0..3).map(|i| stand.white(i)).collect();
            let strength = |s: f64| of_common(&whites, s * s, stand.samples());
            let sigma = size_for(wanted, &strength);
            let p = parameters_of(cause, &[("sigma", sigma)]);
            Truth {
                channel: String::new(),
                ..truth(p, strength(sigma), None)
            }
        }
        other => unreachable!("{other} has no strength"),
    }
}

/// Plant something counted, at a size that is certain to show.
#[must_use]
pub fn plant_counted(draw: &mut Draw, stand: &Stand, label: &'static str, axis: usize) -> Truth {
    let sigma = stand.white(axis).sqrt();
    let (values, everywhere): (Vec<(&str, f64)>, bool) = match label {
        "base_motion" => (
            vec![
                ("peak", draw.by_ratio(1.5, 20.0)),
                ("frequency", draw.between(0.05, 0.5)),
            ],
            false,
        ),
        "outliers" => (
            vec![
                ("count", 1.0 + draw.of_many(8) as f64),
                ("size", sigma * draw.between(8.5, 30.0)),
            ],
            false,
        ),
        "saturation" => {
            // A rail at 2 to 2.6 sigma, where a sound run of the same length leaves 25 to 270 samples beyond.
            let rail = (stand.bias[axis] + sigma * draw.between(2.0, 2.6)) / LSB;
            (vec![("high", rail.round())], false)
        }
        "coarse_lsb" => (vec![("missing_bits", 1.0 + draw.of_many(3) as f64)], false),
        "stuck_bit" => (
            vec![
                ("bit", draw.of_many(4) as f64),
                ("value", draw.of_many(2) as f64),
                ("fraction", draw.between(0.15, 1.0)),
            ],
            false,
        ),
        "stale_samples" => {
            let silent = draw.chance(0.5);
            let count = 15.0 + draw.of_many(60) as f64;
            (
                vec![("count", count), ("silent", f64::from(u8::from(silent)))],
                silent,
            )
        }
        "dropped_samples" => (vec![("count", 5.0 + draw.of_many(60) as f64)], true),
        "timestamp_jitter" => (vec![("sigma", draw.by_ratio(0.4e-3, 5e-3))], true),
        "clock_rate" => (
            vec![("ppm", draw.sign() * draw.by_ratio(300.0, 3000.0))],
            true,
        ),
        other => unreachable!("{other} is not counted"),
    };
    Truth {
        label,
        cause: label,
        channel: if everywhere {
            String::new()
        } else {
            GYROS[axis].to_owned()
        },
        strength: f64::NAN,
        parameters: parameters_of(label, &values),
        signal: None,
        density: None,
    }
}

/// The effect of a truth, as the simulation takes it; `None` where its signal is added afterwards.
#[must_use]
pub fn as_effect(truth: &Truth) -> Option<EffectModel> {
    (truth.label != CURRENT).then(|| EffectModel {
        cause: truth.cause.to_owned(),
        channels: if truth.channel.is_empty() {
            vec![]
        } else {
            vec![truth.channel.clone()]
        },
        parameters: truth.parameters.clone(),
    })
}
