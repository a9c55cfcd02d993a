//! The motor current shifts the rate.

use std::sync::Arc;

use crate::effect::{
    Column, Docs, Effect, Example, Found, Hypothesis, ParameterSpec, Parameters, Plot, Regression,
    Rival, Shape, Stage, View, optional, parameter, value,
};
use crate::parameter::Parameter;
use crate::record::{Base, FULL_DUTY, Quantity};
use crate::simulate::Simulation;

/// The effect.
pub struct MotorBias;

/// Its id.
pub const ID: &str = "motor_bias";

/// The one instance that the library lists.
pub static EFFECT: MotorBias = MotorBias;

impl Effect for MotorBias {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            parameter(
                "at_full_duty",
                "deg/s",
                "shift at full duty, once the motor has its speed",
            ),
            optional(
                "while_turning",
                "deg/s",
                "shift beyond that while the motor turns forward, the opposite backward: the current that friction takes",
            ),
            optional(
                "surge_at_full_duty",
                "deg/s",
                "shift beyond that right after a step from standstill to full duty",
            ),
            optional(
                "surge_at_start",
                "deg/s",
                "shift at the start beyond that: the motor did not have its speed yet",
            ),
            optional(
                "surge_time",
                "s",
                "time in which the surge falls to 1/e: the motor's mechanical time constant",
            ),
            optional(
                "delay",
                "s",
                "how late the sensor shows all of it: its filter, and the instant of its reading",
            ),
            optional(
                "by_magnitude",
                "1",
                "1 where the shift follows |duty|, else it follows the sign too",
            ),
        ];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Motor shifts the bias",
            physics: "b(t) = at_full_duty x duty, or x |duty| where both directions are driven and the magnitude fits better: magnetic field or ground shift of the motor current. Current surges until the motor has spun up: with w' = (duty - w) / surge_time, surge_at_full_duty x (duty - w) is added, and surge_at_start x exp(-t / surge_time) where the record begins while it does. Dry friction takes the same current at any speed: while_turning x sign(duty). The sensor's filter shows all of it late by delay, to a line between two samples; delay and surge_time stand for each other in part, so each is uncertain by what the other is.",
            excitation: "A motor command that changes, while the axis itself does not turn.",
            test: "Least squares on the command, and on the surge over a grid of times and delays, refined and averaged over both; random walk refitted.",
            remedy: "Twist and shield the motor leads, give the motor a ground return of its own, or subtract the bias times the duty.",
            figure: "Rate in time blocks against duty.",
            example: Example::new(Plot::RateAgainst("pwm"), &[("at_full_duty", 0.4)])
                .in_a_world(&[("motor_duty", 0.8)]),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[
            Rival {
                cause: "supply_sensitivity",
                experiment: "switch a dummy load with the motor off",
            },
            Rival {
                cause: "line",
                experiment: "spin the motor without load",
            },
            Rival {
                cause: "bias_step",
                experiment: "switch the motor several times",
            },
        ];
        RIVALS
    }

    fn hypotheses(&self, view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        let signal = view
            .signal(Quantity::Pwm)
            .ok_or("no motor channel: record the motor command")?;
        if view.base == Some(Base::Turntable) && view.moving {
            return Err("the motor turns this axis: its true rate follows the command; disconnect the rotor or test an axis at rest".into());
        }
        let values = || signal.values.iter();
        let (low, high) = values().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &v| {
            (l.min(v), h.max(v))
        });
        let duty: Vec<f64> = values().map(|v| v / FULL_DUTY).collect();
        let size: Vec<f64> = duty.iter().map(|d| d.abs()).collect();
        let regression = |values, by_magnitude| {
            Hypothesis::Regression(Regression {
                columns: vec![Column {
                    parameter: "at_full_duty",
                    values,
                }],
                fixed: if by_magnitude {
                    vec![("by_magnitude", 1.0, "1")]
                } else {
                    vec![]
                },
                follows: Some(signal.name.clone()),
            })
        };
        if high - low < LEAST_CHANGE {
            return Err(
                "the motor command does not change: switch the motor during the record".into(),
            );
        }
        let surge = Hypothesis::Shaped(Arc::new(Surge {
            command: Arc::clone(&signal.values),
            rate_hz: view.rate_hz,
            delay: 0.0,
        }));
        let mut all = vec![regression(duty.clone(), false)];
        if low < 0.0 && high > 0.0 {
            all.push(regression(size, true));
        }
        let turning: Vec<f64> = duty.iter().map(|d| direction(*d)).collect();
        // A command of two levels cannot tell them apart.
        if likeness(&turning, &duty) < MOST_ALIKE {
            all.push(Hypothesis::Regression(Regression {
                columns: vec![Column {
                    parameter: "while_turning",
                    values: turning,
                }],
                fixed: vec![],
                follows: Some(signal.name.clone()),
            }));
        }
        all.push(surge);
        Ok(all)
    }

    fn describe(&self, found: &Found) -> Parameters {
        let mut all = crate::effect::columns_as_parameters(self.parameters(), found);
        for (name, (value, error)) in ["surge_time", "delay"].iter().zip(&found.location) {
            all.insert((*name).into(), Parameter::estimated(*value, *error, "s"));
        }
        all
    }

    fn excited_by(&self) -> &'static [&'static str] {
        &["motor_duty"]
    }

    fn stage(&self) -> Stage {
        Stage::Rate
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        let of = |name| value(parameters, name);
        let duty = &simulation.duty;
        let by_size = of("by_magnitude") != 0.0;
        let steady = |d: &f64| {
            let size = if by_size { d.abs() } else { *d };
            of("at_full_duty") * size + of("while_turning") * direction(*d)
        };
        let mut shift: Vec<f64> = duty.iter().map(steady).collect();
        let tau = of("surge_time") * simulation.rate_hz;
        if tau > 0.0 {
            let (surge, start) = (of("surge_at_full_duty"), of("surge_at_start"));
            let each = lagging(duty.iter().copied(), tau)
                .into_iter()
                .zip(settling(duty.len(), tau));
            for (shift, (ahead, left)) in shift.iter_mut().zip(each) {
                *shift += surge * ahead + start * left;
            }
        }
        let shift = late(shift, of("delay") * simulation.rate_hz);
        for &axis in channels {
            let rate = simulation.rate[axis].iter_mut();
            rate.zip(&shift).for_each(|(rate, shift)| *rate += shift);
        }
    }
}

/// 1 forward, -1 backward, 0 at rest.
fn direction(duty: f64) -> f64 {
    if duty == 0.0 { 0.0 } else { duty.signum() }
}

/// Correlation of two columns.
fn likeness(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len().max(1) as f64;
    let (ma, mb) = (a.iter().sum::<f64>() / n, b.iter().sum::<f64>() / n);
    let (mut ab, mut aa, mut bb) = (0.0, 0.0, 0.0);
    for (x, y) in a.iter().zip(b) {
        ab += (x - ma) * (y - mb);
        aa += (x - ma).powi(2);
        bb += (y - mb).powi(2);
    }
    if aa > 0.0 && bb > 0.0 {
        ab / (aa * bb).sqrt()
    } else {
        1.0
    }
}

/// Correlation of direction and command, above which one stands for both.
const MOST_ALIKE: f64 = 0.97;

/// What the command is ahead of a speed that follows it with a time constant of `tau` samples, averaged over each
/// sample. The command is held from sample to sample, and the motor has its speed at the start.
fn lagging(duty: impl Iterator<Item = f64>, tau: f64) -> Vec<f64> {
    let keep = (-1.0 / tau).exp();
    let mean = tau * (1.0 - keep);
    let mut duty = duty.peekable();
    let mut speed = duty.peek().copied().unwrap_or(0.0);
    duty.map(|d| {
        let ahead = d - speed;
        speed = d - keep * ahead;
        mean * ahead
    })
    .collect()
}

/// What is left of a surge of 1 at the first sample's beginning, averaged over each sample.
fn settling(samples: usize, tau: f64) -> Vec<f64> {
    let keep = (-1.0 / tau).exp();
    let first = tau * (1.0 - keep);
    std::iter::successors(Some(first), |s| Some(s * keep))
        .take(samples)
        .collect()
}

/// Values so many samples late, on a line between two of them; before the first they are as the first.
fn late(values: Vec<f64>, samples: f64) -> Vec<f64> {
    if samples <= 0.0 {
        return values;
    }
    let (whole, part) = (samples.floor() as usize, samples.fract());
    let at = |i: usize, back: usize| values[i.saturating_sub(back)];
    (0..values.len())
        .map(|i| (1.0 - part) * at(i, whole) + part * at(i, whole + 1))
        .collect()
}

/// Most that a sensor's filter may be late, samples: twice the mean delay of one whose window is two samples long.
const LATEST: f64 = 2.0;

/// The surge, by its time, so many samples late.
#[derive(Clone)]
struct Surge {
    /// The motor command, as it was recorded.
    command: Arc<Vec<f64>>,
    rate_hz: f64,
    delay: f64,
}

impl Surge {
    fn duty(&self) -> impl Iterator<Item = f64> {
        self.command.iter().map(|v| v / FULL_DUTY)
    }
}

impl Shape for Surge {
    fn coordinate(&self) -> (&'static str, &'static str) {
        ("surge_time", "s")
    }

    /// From half a sample to a few seconds, which no small motor needs.
    fn grid(&self) -> Vec<f64> {
        let least = (0.5 / self.rate_hz).max(0.03);
        [1.0, 3.0, 9.0, 27.0, 81.0]
            .iter()
            .map(|k| k * least)
            .filter(|t| *t < 4.0)
            .collect()
    }

    fn columns(&self, at: f64) -> Vec<Column> {
        let tau = at * self.rate_hz;
        let mut all = vec![Column {
            parameter: "surge_at_full_duty",
            values: late(lagging(self.duty(), tau), self.delay),
        }];
        // A motor that is driven from the first sample on may have been switched on just before.
        if self.command.first().is_some_and(|v| *v != 0.0) {
            all.push(Column {
                parameter: "surge_at_start",
                values: late(settling(self.command.len(), tau), self.delay),
            });
        }
        all
    }

    fn delays(&self) -> (f64, f64) {
        (0.0, LATEST)
    }

    fn delay(&self) -> f64 {
        self.delay
    }

    fn later(&self, samples: f64) -> Option<Arc<dyn Shape>> {
        Some(Arc::new(Self {
            delay: samples,
            ..self.clone()
        }))
    }

    fn beside(&self, parameter: &str, fixed: &[(&str, f64, &str)]) -> Option<Vec<f64>> {
        let by_size = fixed.iter().any(|f| f.0 == "by_magnitude" && f.1 != 0.0);
        let each = self.duty();
        let values = match parameter {
            "at_full_duty" if by_size => each.map(f64::abs).collect(),
            "at_full_duty" => each.collect(),
            "while_turning" => each.map(direction).collect(),
            _ => return None,
        };
        Some(late(values, self.delay))
    }
}

/// Smallest change of the command that says anything, counts.
pub(super) const LEAST_CHANGE: f64 = 8.0;
