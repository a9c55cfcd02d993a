//! How strong what is hidden is: d', by physics, not asked of the engine.
//!
//! What adds a signal is run twice through the firmware's logic, with and without it: the difference of the two captures
//! is the signal. What adds noise has its density from its own parameters. d' is the square root of twice the expected
//! log likelihood ratio against white noise and a random walk refitted (docs/power.md).

use std::f64::consts::TAU;

use bench::{Fault, Motor, Run, bartlett};
use campaign::stand::Stand;
use campaign::strength::{Meter, of_common, of_variance};
use imu_stand::stand::{Hidden, Plan, run_native};
use model::excitation::World;
use model::record::Record;

const RATE_HZ: f64 = 20.0;

/// How strong.
#[derive(Clone, Copy, Debug)]
pub enum Strength {
    /// Drawn so that it is certain to show.
    Certain,
    /// d', and from which one on it is asked to be named.
    Detectability {
        /// d'.
        d: f64,
        /// From there on.
        asked: f64,
    },
}

impl Strength {
    /// Whether it has to be named.
    pub fn asks(self) -> bool {
        match self {
            Strength::Certain => true,
            Strength::Detectability { d, asked } => d >= asked,
        }
    }
}

impl std::fmt::Display for Strength {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Strength::Certain => f.write_str("certain"),
            Strength::Detectability { d, .. } => write!(f, "d' {d:.1}"),
        }
    }
}

/// The noise of the stand as the meter takes it.
fn noise(plan: &Plan, samples: usize) -> Stand {
    let parts = &plan.run.scenario.gyros;
    Stand {
        seconds: samples as f64 / RATE_HZ,
        rate_hz: RATE_HZ,
        walk_of_angle: std::array::from_fn(|i| parts[i].angle_random_walk_deg_sqrt_h),
        walk_of_rate: std::array::from_fn(|i| parts[i].rate_random_walk),
        bias: [0.0; 3],
        lsb: [campaign::stand::LSB; 3],
        world: World {
            duty: vec![0.0; samples],
            ..World::default()
        },
        excitation: vec![],
    }
}

fn rates(record: &Record, axis: usize) -> &[f64] {
    let name = ["gyro_x", "gyro_y", "gyro_z"][axis];
    &record.channel(name).expect("a gyro").values
}

/// The same run with nothing wrong.
fn sound(plan: &Plan) -> Plan {
    let mut other = plan.clone();
    other.run.scenario.faults.clear();
    other
}

/// Strength of what is hidden in a run.
pub fn strength(plan: &Plan, hidden: Hidden) -> Strength {
    let of = |d: f64, asked: f64| Strength::Detectability { d, asked };
    let axis = plan.channel.unwrap_or(0);
    match hidden {
        Hidden::Tempco
        | Hidden::MotorCoupling
        | Hidden::SupplyCoupling
        | Hidden::Vibration
        | Hidden::Knock
        | Hidden::Bump
        | Hidden::WarmUp
        | Hidden::Leak => of(of_difference(plan, axis, &[]), 8.0),
        // Beyond a straight line.
        Hidden::TempcoCurved => of(of_difference(plan, axis, &["temp"]), 8.0),
        // The part that the accelerometer shows: it is read at other instants, through another filter.
        Hidden::GSensitivity => {
            let all = of_difference(plan, axis, &[]);
            let beyond = of_difference(plan, axis, &["acc_x", "acc_y", "acc_z"]);
            of((all * all - beyond * beyond).max(0.0).sqrt(), 8.0)
        }
        Hidden::CommonNoise => {
            let (shared, _) = added(plan, 0);
            let variance = shared.iter().map(|d| d * d).sum::<f64>() / shared.len() as f64;
            let stand = noise(plan, shared.len());
            let whites: Vec<f64> = (0..3).map(|axis| stand.white(axis)).collect();
            of(of_common(&whites, variance, shared.len()), 8.0)
        }
        // Neighbours are alike by chance, too: so many more, in units of the own scatter of that.
        Hidden::SilentStall => {
            let (with, without) = twice(plan);
            let alike = |record: &Record| {
                let pairs = rates(record, axis).windows(2);
                pairs.filter(|pair| pair[0] == pair[1]).count() as f64
            };
            let by_chance = alike(&without);
            of((alike(&with) - by_chance) / by_chance.sqrt(), 8.0)
        }
        // A bit that always is as the stuck one reads changes nothing.
        Hidden::StuckBit => {
            let (with, without) = twice(plan);
            let changed = pairs(&with, &without, axis).filter(|(a, b)| a != b).count();
            if changed * 100 >= with.len() {
                Strength::Certain
            } else {
                of(0.0, 8.0)
            }
        }
        _ => of_process(plan, axis),
    }
}

fn pairs<'a>(
    with: &'a Record,
    without: &'a Record,
    axis: usize,
) -> impl Iterator<Item = (f64, f64)> + 'a {
    let (a, b) = (rates(with, axis), rates(without, axis));
    a.iter().copied().zip(b.iter().copied())
}

/// The captures with it and without.
fn twice(plan: &Plan) -> (Record, Record) {
    let (with, _) = run_native(plan, |_| {});
    let (without, _) = run_native(&sound(plan), |_| {});
    (with, without)
}

/// So much larger is what is hidden for the measurement of its shape: the difference of two captures in counts has a
/// rounding noise of its own, which at the true size would count as signal. Within the range of the gyro.
const ENLARGED: f64 = 32.0;

/// The same run with what is hidden enlarged.
fn enlarged(plan: &Plan) -> Plan {
    let mut other = plan.clone();
    for fault in &mut other.run.scenario.faults {
        match fault {
            Fault::Tempco {
                dps_per_c,
                dps_per_c2,
                ..
            } => {
                *dps_per_c *= ENLARGED;
                *dps_per_c2 *= ENLARGED;
            }
            Fault::GSensitivity { dps_per_g, .. } => {
                dps_per_g.iter_mut().for_each(|s| *s *= ENLARGED)
            }
            Fault::MotorCoupling {
                dps_per_amp: size, ..
            }
            | Fault::SupplyCoupling {
                dps_per_volt: size, ..
            }
            | Fault::Vibration {
                amplitude_dps: size,
                ..
            }
            | Fault::Knock { step_dps: size, .. }
            | Fault::Bump { peak_dps: size, .. }
            | Fault::WarmUp {
                amplitude_dps: size,
                ..
            }
            | Fault::Leak {
                dps_per_s: size, ..
            }
            | Fault::CommonNoise { sigma_dps: size } => *size *= ENLARGED,
            other => unreachable!("{other:?} is not measured by its shape"),
        }
    }
    other
}

/// What is hidden adds to a gyro, deg/s, and the capture of the enlarged run.
fn added(plan: &Plan, axis: usize) -> (Vec<f64>, Record) {
    let (with, _) = run_native(&enlarged(plan), |_| {});
    let (without, _) = run_native(&sound(plan), |_| {});
    let signal = pairs(&with, &without, axis).map(|(a, b)| (a - b) / ENLARGED);
    (signal.collect(), with)
}

/// d' of what a fault adds to a gyro, beyond what follows these channels.
fn of_difference(plan: &Plan, axis: usize, beyond: &[&str]) -> f64 {
    let (signal, record) = added(plan, axis);
    let meter = Meter::new(&noise(plan, signal.len()), axis);
    let letter = ["x", "y", "z"][axis];
    let others: Vec<Vec<f64>> = beyond
        .iter()
        .map(|name| match *name {
            "temp" => format!("temp_{letter}"),
            other => other.to_owned(),
        })
        .map(|name| {
            record
                .channel(&name)
                .expect("it is recorded")
                .values
                .clone()
        })
        .collect();
    meter.of_signal(&meter.energy(&meter.beyond(&signal, &others)))
}

/// d' of what changes the noise, from its own parameters.
fn of_process(plan: &Plan, axis: usize) -> Strength {
    let scenario = &plan.run.scenario;
    let samples = (plan.run.seconds * RATE_HZ) as usize;
    let stand = noise(plan, samples);
    let meter = Meter::new(&stand, axis);
    let (white, period_s) = (stand.white(axis), 1.0 / RATE_HZ);
    let one_pole = |variance: f64, pole: f64, w: f64| {
        variance * (1.0 - pole * pole) / (1.0 + pole * pole - 2.0 * pole * w.cos())
    };
    let of_density = |density: &dyn Fn(f64) -> f64| {
        let all: Vec<f64> = meter.omega().iter().map(|w| density(*w)).collect();
        meter.of_density(&all)
    };
    let (d, asked) = match scenario.faults.first() {
        Some(&Fault::WanderingBias {
            sigma_dps, tau_s, ..
        }) => {
            let pole = (-period_s / tau_s).exp();
            (
                of_density(&|w| one_pole(sigma_dps * sigma_dps, pole, w)),
                8.0,
            )
        }
        Some(&Fault::Trap {
            half_height_dps,
            dwell_s,
            ..
        }) => {
            let pole = (-2.0 * period_s / dwell_s).exp();
            let variance = half_height_dps * half_height_dps;
            (of_density(&|w| one_pole(variance, pole, w)), 10.0)
        }
        Some(&Fault::SlowFilter { pole_hz, .. }) => {
            (of_density(&|w| slowed(white, pole_hz, w) - white), 8.0)
        }
        Some(&Fault::MotorNoise { power_per_amp, .. }) => {
            let currents = currents(&plan.run, samples);
            let law: Vec<f64> = (currents.iter())
                .map(|i| 1.0 + power_per_amp * i.abs())
                .collect();
            (of_variance(&law), 8.0)
        }
        Some(&Fault::NoisySpell {
            start_s,
            end_s,
            power,
            ..
        }) => {
            let law: Vec<f64> = (0..samples)
                .map(|i| i as f64 * period_s)
                .map(|t| {
                    if (start_s..end_s).contains(&t) {
                        1.0 + power
                    } else {
                        1.0
                    }
                })
                .collect();
            (of_variance(&law), 10.0)
        }
        None if scenario.base.sway_deg > 0.0 => {
            // How well rate and tilt give the amplitude of the rate: sqrt(2 / n) of their noise. The tilt's is that of
            // the floor within the accelerometer's band.
            let w = TAU / scenario.base.sway_period_s;
            let tilt = scenario.base.floor_g_rms.to_degrees() * w;
            let error = ((2.0 / samples as f64) * (white + tilt * tilt)).sqrt()
                / (scenario.base.sway_deg * w);
            (scenario.gyros[axis].scale_error.abs() / error, 10.0)
        }
        _ => return Strength::Certain,
    };
    Strength::Detectability { d, asked }
}

/// Density of the noise behind a pole and the part's own filter, at the sample rate: as dense at rest as before.
fn slowed(white: f64, pole_hz: f64, w: f64) -> f64 {
    /// The part's clock, Hz, and the lags that are summed at it.
    const CLOCK_HZ: f64 = 256.0;
    const LAGS: i32 = 4000;
    let weights = bartlett(2);
    let covariance = |pole_hz: f64, lag_s: f64| {
        let mut sum = 0.0;
        for (i, a) in weights.iter().enumerate() {
            for (j, b) in weights.iter().enumerate() {
                let apart = lag_s + (i as f64 - j as f64) / CLOCK_HZ;
                sum += a * b * (-TAU * pole_hz * apart.abs()).exp();
            }
        }
        // Behind a pole the variance of white noise is proportional to the corner.
        sum * pole_hz
    };
    let at_rest = covariance(50.0, 0.0);
    let last = ((8.0 / (TAU * pole_hz) * RATE_HZ).ceil() as i32).clamp(2, LAGS);
    let spectrum = (1..last).fold(covariance(pole_hz, 0.0), |sum, lag| {
        let lag = f64::from(lag);
        sum + 2.0 * covariance(pole_hz, lag / RATE_HZ) * (w * lag).cos()
    });
    white * spectrum / at_rest
}

/// The motor's current at each sample, A.
fn currents(run: &Run, samples: usize) -> Vec<f64> {
    const STEP_S: f64 = 1e-3;
    let mut motor = Motor::new(run.scenario.motor.clone());
    let mut duties = run
        .requests
        .iter()
        .filter_map(|timed| match timed.request.command {
            wire::Command::MotorDuty { duty } => Some((timed.at_us as f64 * 1e-6, duty)),
            _ => None,
        });
    let (mut next, mut duty) = (duties.next(), 0);
    let steps = (1.0 / RATE_HZ / STEP_S).round() as usize;
    (0..samples)
        .map(|sample| {
            for step in 0..steps {
                let t = sample as f64 / RATE_HZ + step as f64 * STEP_S;
                while let Some((at, new)) = next.filter(|(at, _)| *at <= t) {
                    let _reached = at;
                    duty = new;
                    next = duties.next();
                }
                motor.step(f64::from(duty) / 255.0, STEP_S);
            }
            motor.current_a()
        })
        .collect()
}
