//! Responses with a memory: a channel that follows another one, though not at once.
//!
//! A linear response that starts and fades with one time constant, in any proportion to what comes at once, lies in the
//! span of the signal and of the signal behind a lag of that time: a late response, one that is ahead and one to changes
//! alone are points of it. Vibration has no time constant that fits a few samples; there it is any response of that
//! many of them.

use std::f64::consts::PI;
use std::rc::Rc;

use model::effect::{Signal, View, extremes};
use model::record::Quantity;

use numerics::column::LONG;

use super::{Combination, accelerations, centred, lagged, others};

/// Time constants, s, a factor of four apart: a lag half way between two of them is spanned by either to some percent.
const SUPPLY_S: [f64; 4] = [0.5, 2.0, 8.0, 32.0];
/// The same for the heat of a motor, which goes with the size of the command.
const HEAT_S: [f64; 4] = [1.0, 4.0, 16.0, 64.0];
/// The same for a command beyond the surges that the library has.
const COMMAND_S: [f64; 2] = [12.0, 48.0];
/// The same for a temperature.
const TEMPERATURE_S: [f64; 3] = [10.0, 40.0, 160.0];
/// The same for a rate that the table makes, which is asked of a name alone: a gyro with a memory is its noise too, and that
/// may be shared.
const TURNING_S: [f64; 2] = [0.8, 3.2];
/// Shares of the largest command from which on its sense alone counts, and memories of it, s: at once, and a factor of four
/// apart.
const GATES: [f64; 3] = [0.02, 0.25, 0.5];
const SENSE_S: [f64; 4] = [0.05, 0.5, 2.0, 8.0];
/// Memories of what shakes, s, a factor of four apart.
const SHAKEN_S: [f64; 4] = [0.5, 2.0, 8.0, 32.0];
/// Places of bends, as shares of what a signal spans.
const BENDS: [f64; 4] = [0.2, 0.4, 0.6, 0.8];
/// Half waves over what a level spans, of any phase by two neighbours: 24 waves are those of a table in steps of half a degree over a
/// heater cycle of 6 degC either way.
const HALF_WAVES: usize = 48;
/// Samples over which a response to vibration may go on, and that of a long record.
const SAMPLES: usize = 6;
const SAMPLES_OF_LONG: usize = 3;

/// A signal and what is behind it.
fn pair(values: &[f64], tau: f64) -> Vec<Vec<f64>> {
    let c = centred(values);
    let behind = lagged(&c, tau);
    vec![c, behind]
}

/// A signal and the same up to some samples later.
fn shifted(values: &[f64]) -> impl Iterator<Item = Vec<f64>> + use<> {
    let c = centred(values);
    let shifts = shifts(c.len());
    (0..=shifts).map(move |k| {
        let before = std::iter::repeat_n(c.first().copied().unwrap_or(0.0), k.min(c.len()));
        let mut column = Vec::with_capacity(c.len());
        column.extend(before);
        column.extend(&c[..c.len().saturating_sub(k)]);
        column
    })
}

fn shifts(samples: usize) -> usize {
    if samples > LONG {
        SAMPLES_OF_LONG
    } else {
        SAMPLES
    }
}

fn size(signal: &Signal) -> Vec<f64> {
    signal.values.iter().map(|v| v.abs()).collect()
}

/// Those of the times that the grid resolves.
fn resolved<'a>(view: &'a View<'_>, times: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
    let (least, most) = (1.0 / view.rate_hz, view.seconds() / 8.0);
    let within = move |t: &f64| *t >= least && *t <= most;
    times.iter().copied().filter(within)
}

pub(super) fn combinations<'a>(
    view: &'a View<'_>,
    motor: Option<&'a Signal>,
    supply: Option<&'a Signal>,
) -> Vec<Combination<'a>> {
    let mut all = vec![];
    let mut pairs = |what: String, times: &'a [f64], of: fn(&Signal) -> Vec<f64>, s: &'a Signal| {
        for t in resolved(view, times) {
            all.push(Combination {
                what: format!("{what} with a memory of about {t} s"),
                channels: vec![s.name.clone()],
                columns: Box::new(move || pair(&of(s), t * view.rate_hz)),
            });
        }
    };
    let smooth = |s: &Signal| s.smooth.to_vec();
    if let Some(u) = supply {
        pairs(u.name.clone(), &SUPPLY_S, smooth, u);
    }
    if let Some(m) = motor {
        // A command of one direction is its own size, and the library has its surges.
        let sign = |s: f64| m.values.iter().any(|v| *v * s > 0.0);
        if sign(1.0) && sign(-1.0) {
            pairs(format!("size of {}", m.name), &HEAT_S, size, m);
        }
        pairs(m.name.clone(), &COMMAND_S, smooth, m);
    }
    for o in others(view) {
        pairs(o.name.clone(), &TEMPERATURE_S, smooth, o);
    }
    for a in accelerations(view) {
        all.push(Combination {
            what: format!(
                "{} over its last {:.2} s",
                a.name,
                shifts(view.samples) as f64 / view.rate_hz
            ),
            channels: vec![a.name.clone()],
            columns: Box::new(|| shifted(&a.values).collect()),
        });
    }
    all
}

/// One kind of what a response may differ by: how it follows the signal then, and the columns, each made as it is asked for.
pub(crate) struct Departure<'a> {
    pub(crate) how: &'static str,
    pub(crate) columns: Columns<'a>,
}

type Columns<'a> = Box<dyn Iterator<Item = Vec<f64>> + 'a>;
type Kind<'a> = (&'static str, fn(Rc<Followed<'a>>) -> Columns<'a>);

/// Everything by which a response to a signal may differ from one that is in proportion and at once, by kind: its bend and
/// its drift in time, its memory, and of a motor the memory of its heat, what follows its changes, and what knows no more
/// than its sense. Columns beside the signal itself, made when their kind is asked for.
pub(crate) fn departures<'a>(
    view: &'a View<'_>,
    signal: &'a Signal,
) -> impl Iterator<Item = Departure<'a>> {
    let of_any: [Kind<'a>; 2] = [("by a bend or a drift", bent), ("late", late)];
    let of_a_motor: [Kind<'a>; 4] = [
        ("behind the heat of its size", behind_heat),
        ("after each of its changes", |f| {
            Box::new(after_changes(&f.scaled))
        }),
        ("after each change of its size", |f| {
            Box::new(after_changes(&size(f.signal)))
        }),
        ("by its sense alone", by_sense),
    ];
    let is_motor = signal.quantity == Quantity::Pwm;
    let beside = of_a_motor.into_iter().filter(move |_| is_motor);
    let followed = Rc::new(Followed::new(view, signal));
    of_any.into_iter().chain(beside).map(move |(how, columns)| {
        let columns = columns(Rc::clone(&followed));
        Departure { how, columns }
    })
}

/// A signal that is followed.
struct Followed<'a> {
    view: &'a View<'a>,
    signal: &'a Signal,
    /// About its middle, over the largest of it.
    scaled: Vec<f64>,
}

impl<'a> Followed<'a> {
    fn new(view: &'a View<'_>, signal: &'a Signal) -> Self {
        let mut scaled = centred(if signal.quantity == Quantity::Acc {
            &signal.values
        } else {
            &signal.smooth
        });
        let largest = scaled.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        let largest = largest.max(1e-300);
        scaled.iter_mut().for_each(|v| *v /= largest);
        Self {
            view,
            signal,
            scaled,
        }
    }

    fn behind(
        &self,
        values: Vec<f64>,
        times: &'a [f64],
    ) -> impl Iterator<Item = Vec<f64>> + use<'a> {
        let view = self.view;
        resolved(view, times).map(move |t| lagged(&values, t * view.rate_hz))
    }
}

fn bent<'a>(f: Rc<Followed<'a>>) -> Columns<'a> {
    let n = f.scaled.len() as f64;
    let powers = [|v: f64| v * v, |v: f64| v * v * v].into_iter();
    let of = Rc::clone(&f);
    let powers = powers.map(move |power| of.scaled.iter().map(|v| power(*v)).collect());
    let of = Rc::clone(&f);
    let drift = std::iter::once_with(move || {
        let all = of.scaled.iter().enumerate();
        all.map(|(i, v)| v * (2.0 * i as f64 / n - 1.0)).collect()
    });
    let bends = bends(&f.scaled).collect::<Vec<_>>();
    Box::new(powers.chain(drift).chain(bends))
}

/// A bend anywhere: what dips, saturates or has a dead zone is no parabola.
pub(super) fn bends(values: &[f64]) -> impl Iterator<Item = Vec<f64>> {
    let [low, high] = extremes(values);
    BENDS.iter().map(move |share| {
        let at = low + share * (high - low);
        values.iter().map(|v| (v - at).max(0.0)).collect()
    })
}

/// What goes up and down over what a level spans, of no use to a response that is nearly straight: a table of steps makes a
/// saw-tooth of it, light that interferes a wave.
pub(crate) fn in_waves(signal: &Signal) -> Departure<'_> {
    let [low, high] = extremes(&signal.smooth);
    let wave = move |half: usize| {
        let turn = PI * half as f64 / (high - low);
        (signal.smooth.iter())
            .map(|v| (turn * (v - low)).cos())
            .collect()
    };
    Departure {
        how: "in waves of its level",
        columns: Box::new((1..=HALF_WAVES).map(wave)),
    }
}

/// How much the accelerometers shake, of late: the mean square of all of them, and the largest, which fades.
pub(crate) fn shaking<'a>(view: &'a View<'_>) -> Option<Departure<'a>> {
    let mut squares = vec![];
    for a in accelerations(view) {
        let own = centred(&a.values).into_iter().map(|v| v * v);
        match squares.is_empty() {
            true => squares.extend(own),
            false => squares.iter_mut().zip(own).for_each(|(s, v)| *s += v),
        }
    }
    let any = !squares.is_empty();
    let columns = move || {
        resolved(view, &SHAKEN_S).flat_map(move |t| {
            let fade = (-1.0 / (t * view.rate_hz)).exp();
            let mut held = 0.0;
            let largest = squares.iter().map(|s: &f64| {
                held = s.sqrt().max(fade * held);
                held
            });
            [largest.collect(), lagged(&squares, t * view.rate_hz)]
        })
    };
    any.then(|| Departure {
        how: "by how much they shake",
        columns: Box::new(columns()),
    })
}

fn late<'a>(f: Rc<Followed<'a>>) -> Columns<'a> {
    let times: &[f64] = match f.signal.quantity {
        Quantity::Acc => return Box::new(shifted(&f.scaled).skip(1)),
        Quantity::Gyro => &TURNING_S,
        // Surges of a motor take their part of a short memory.
        Quantity::Pwm => &COMMAND_S,
        Quantity::Temp => &TEMPERATURE_S,
        _ => &SUPPLY_S,
    };
    Box::new(f.behind(f.scaled.clone(), times))
}

fn behind_heat<'a>(f: Rc<Followed<'a>>) -> Columns<'a> {
    Box::new(f.behind(centred(&size(f.signal)), &HEAT_S))
}

fn by_sense<'a>(f: Rc<Followed<'a>>) -> Columns<'a> {
    let of_gate = move |g| f.behind(sense(&f.signal.smooth, g), &SENSE_S);
    Box::new(GATES.into_iter().flat_map(of_gate))
}

/// The sense of a command that is beyond a share of its largest, and 0 below it.
fn sense(command: &[f64], gate: f64) -> Vec<f64> {
    let largest = command.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let sense = |v: &f64| {
        if v.abs() > gate * largest {
            v.signum()
        } else {
            0.0
        }
    };
    command.iter().map(sense).collect()
}

/// Stretches of samples after a change, of any shape within them: first one and end. What rings swings within some samples,
/// what relaxes does so in octaves.
const AFTER: [(usize, usize); 12] = [
    (0, 1),
    (1, 2),
    (2, 3),
    (3, 4),
    (4, 5),
    (5, 6),
    (6, 8),
    (8, 10),
    (10, 13),
    (13, 16),
    (16, 24),
    (24, 48),
];

/// What follows each change of a series in proportion, in each stretch after it. A series that changes more often than in one
/// of sixteen samples has no stretches of its own.
fn after_changes(values: &[f64]) -> impl Iterator<Item = Vec<f64>> + use<> {
    let n = values.len();
    let steps = values
        .windows(2)
        .enumerate()
        .map(|(i, w)| (i + 1, w[1] - w[0]));
    let largest = steps.clone().map(|(_, d)| d.abs()).fold(0.0, f64::max);
    let events: Vec<(usize, f64)> = steps
        .filter(|(_, d)| d.abs() > LEAST_STEP * largest)
        .collect();
    let seldom = !events.is_empty() && events.len() <= n / 16;
    let asked = AFTER.iter().filter(move |_| seldom);
    asked.map(move |(from, to)| {
        let mut column = vec![0.0; n];
        for (at, change) in &events {
            let range = (at + from).min(n)..(at + to).min(n);
            column[range]
                .iter_mut()
                .for_each(|v| *v += change / largest);
        }
        column
    })
}

/// Smallest change that counts, over the largest.
const LEAST_STEP: f64 = 0.05;

#[cfg(test)]
mod tests {
    use super::*;

    /// Share of the energy of `y` that columns explain.
    fn spanned(columns: &[Vec<f64>], y: &[f64]) -> f64 {
        let mut basis: Vec<Vec<f64>> = vec![];
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        for c in columns {
            let mut c = c.clone();
            for b in &basis {
                let share = dot(&c, b);
                c.iter_mut().zip(b).for_each(|(c, b)| *c -= share * b);
            }
            let length = dot(&c, &c).sqrt();
            c.iter_mut().for_each(|c| *c /= length);
            basis.push(c);
        }
        basis.iter().map(|b| dot(b, y).powi(2)).sum::<f64>() / dot(y, y)
    }

    #[test]
    fn a_lag_between_two_times_is_spanned_by_one_of_them() {
        // A load that is switched every 7 s and a response to its changes that fades in 1 s, at 20 Hz.
        let x: Vec<f64> = (0..12_000)
            .map(|i| if (i / 140) % 2 == 0 { 1.0 } else { -1.0 })
            .collect();
        let behind = lagged(&x, 20.0);
        let y: Vec<f64> = x.iter().zip(&behind).map(|(x, b)| x - b).collect();
        let best = SUPPLY_S
            .iter()
            .map(|t| spanned(&pair(&x, t * 20.0), &y))
            .fold(0.0, f64::max);
        assert!(best > 0.9, "{best}");
        assert!(spanned(&[centred(&x)], &y) < 0.6);
    }

    #[test]
    fn a_delay_of_three_samples_is_spanned_by_the_shifts() {
        let mut state = 1u32;
        let x: Vec<f64> = (0..4000)
            .map(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                f64::from(state >> 8) / f64::from(1u32 << 24) - 0.5
            })
            .collect();
        let c = centred(&x);
        let y: Vec<f64> = (0..c.len()).map(|i| c[i.saturating_sub(3)]).collect();
        assert!(spanned(&shifted(&x).collect::<Vec<_>>(), &y) > 0.999);
        assert!(spanned(&[c], &y) < 0.01);
    }
}
