//! Combinations of the recorded channels that no effect of the library is made of. A channel that follows one of them
//! has a cause without a name: the search weighs them beside the effects, and the answer is "unexplained, but follows".

use std::iter;
use std::sync::Arc;

use model::effect::{
    Column, Docs, Effect, Example, Hypothesis, ParameterSpec, Parameters, Plot, Regression, Rival,
    Signal, Stage, View,
};
use model::record::Quantity;
use model::simulate::Simulation;

use crate::fit::channel::{ID, Term};

pub(crate) mod echo;
pub(crate) mod lagged;

/// The stand-in.
pub struct Beyond;

/// Its one instance.
pub static EFFECT: Beyond = Beyond;

/// Half the time over which the rate of a temperature is taken, s.
const SLOPE_S: f64 = 2.0;
/// Lag of a thermometer that sits elsewhere, s.
const LAG_S: f64 = 40.0;
/// Plays of a hysteresis, as shares of the swing.
const PLAYS: [f64; 2] = [0.3, 0.7];
/// Smallest changes that a combination is made of: degC, counts of the motor command, V, m/s^2 rms.
pub(crate) const LEAST_TEMPERATURE: f64 = 0.5;
pub(crate) const LEAST_COMMAND: f64 = 8.0;
pub(crate) const LEAST_SUPPLY: f64 = 5e-3;
const LEAST_VIBRATION: f64 = 0.15;

pub(crate) fn centred(values: &[f64]) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
    values.iter().map(|v| v - mean).collect()
}

fn product(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a * b).collect()
}

fn slope(values: &[f64], reach: usize) -> Vec<f64> {
    let last = values.len().saturating_sub(1);
    (0..values.len())
        .map(|i| values[(i + reach).min(last)] - values[i.saturating_sub(reach)])
        .collect()
}

/// A signal behind a lag of `tau` samples.
pub(crate) fn lagged(values: &[f64], tau: f64) -> Vec<f64> {
    let gain = 1.0 - (-1.0 / tau).exp();
    let mut y = values.first().copied().unwrap_or(0.0);
    values
        .iter()
        .map(|v| {
            y += gain * (v - y);
            y
        })
        .collect()
}

/// What follows a signal only once it has moved through a play of twice `half`.
fn played(values: &[f64], half: f64) -> Vec<f64> {
    let mut held = values.first().copied().unwrap_or(0.0);
    values
        .iter()
        .map(|v| {
            held = held.clamp(v - half, v + half);
            held
        })
        .collect()
}

/// Makes the columns of a combination; long records hold one combination at a time.
type Maker<'a> = Box<dyn Fn() -> Vec<Vec<f64>> + 'a>;

/// A combination: what it is, and its columns.
pub(crate) struct Combination<'a> {
    pub(crate) what: String,
    /// Names of the channels that it is made of.
    pub(crate) channels: Vec<String>,
    pub(crate) columns: Maker<'a>,
}

impl<'a> Combination<'a> {
    fn of(what: String, channels: &[&Signal], values: impl Fn() -> Vec<f64> + 'a) -> Self {
        Self {
            what,
            channels: channels.iter().map(|c| c.name.clone()).collect(),
            columns: Box::new(move || vec![values()]),
        }
    }
}

/// The combinations that a record allows.
pub(crate) fn combinations<'a>(view: &'a View<'_>) -> Vec<Combination<'a>> {
    let moving = |quantity, least: f64| view.signal(quantity).filter(|s| s.range() >= least);
    let temperature = moving(Quantity::Temp, LEAST_TEMPERATURE);
    let motor = moving(Quantity::Pwm, LEAST_COMMAND);
    let supply = moving(Quantity::Supply, LEAST_SUPPLY);
    let mut all: Vec<Combination<'a>> = vec![];
    if let Some(t) = temperature {
        all.extend(of_temperature(view, t, motor, supply));
    }
    if let (Some(m), Some(u)) = (motor, supply) {
        all.push(Combination::of(
            format!("{} times {}", m.name, u.name),
            &[m, u],
            move || product(&m.smooth, &centred(&u.smooth)),
        ));
    }
    for a in accelerations(view) {
        all.push(Combination::of(
            format!("square of {}", a.name),
            &[a],
            || centred(&a.values).iter().map(|v| v * v).collect(),
        ));
    }
    for w in turning(view) {
        all.push(Combination::of(
            format!("square of {}", w.name),
            &[w],
            || w.smooth.iter().map(|v| v * v).collect(),
        ));
    }
    for o in others(view) {
        all.push(Combination::of(o.name.clone(), &[o], || centred(&o.smooth)));
        // What is smoothed away of a channel that is fast may be what is followed.
        if !Arc::ptr_eq(&o.smooth, &o.values) {
            let what = format!("{}, reading by reading", o.name);
            all.push(Combination::of(what, &[o], || centred(&o.values)));
        }
    }
    all.extend(lagged::combinations(view, motor, supply));
    all
}

/// Those of a thermometer, alone and with the motor or the supply.
fn of_temperature<'a>(
    view: &'a View<'_>,
    t: &'a Signal,
    motor: Option<&'a Signal>,
    supply: Option<&'a Signal>,
) -> Vec<Combination<'a>> {
    let c = || centred(&t.smooth);
    let reach = ((SLOPE_S * view.rate_hz).round() as usize).max(1);
    let name = &t.name;
    let mut all = vec![
        Combination::of(format!("rate of change of {name}"), &[t], move || {
            slope(&t.smooth, reach)
        }),
        Combination::of(format!("{name} behind a lag"), &[t], || {
            lagged(&t.smooth, LAG_S * view.rate_hz)
        }),
    ];
    for share in PLAYS {
        let play = share * t.range();
        let what = format!("{name} with a play of {play:.1} {}", t.unit);
        all.push(Combination::of(what, &[t], move || {
            played(&t.smooth, 0.5 * play)
        }));
    }
    all.extend(laws(t));
    // The command has a zero of its own; the supply has none that means anything.
    if let Some(m) = motor {
        let what = format!("{} times {name}", m.name);
        all.push(Combination::of(what, &[m, t], move || {
            product(&m.smooth, &c())
        }));
    }
    if let Some(u) = supply {
        let what = format!("{} times {name}", u.name);
        all.push(Combination::of(what, &[u, t], move || {
            product(&centred(&u.smooth), &c())
        }));
    }
    if let Some(m) = motor {
        let size = || m.smooth.iter().map(|v| v.abs()).collect::<Vec<f64>>();
        let what = format!("size of {} times {name}", m.name);
        all.push(Combination::of(what, &[m, t], move || {
            product(&size(), &c())
        }));
    }
    all
}

/// Laws that a bias may have of a temperature beyond a parabola, each as a whole: where it swings there and back by a cubic,
/// neither the temperature nor its cube alone explains anything, and a line at three times the frequency does.
fn laws(t: &Signal) -> [Combination<'_>; 2] {
    let cubic = || {
        let c = centred(&t.smooth);
        let power = |k: i32| c.iter().map(|v| v.powi(k)).collect();
        (1..=3).map(power).collect()
    };
    let bent = || {
        let bends = lagged::bends(&t.smooth);
        iter::once(centred(&t.smooth)).chain(bends).collect()
    };
    let all: [(&str, Maker<'_>); 2] = [
        ("by a cubic law", Box::new(cubic)),
        ("by a law with bends", Box::new(bent)),
    ];
    all.map(|(how, columns)| Combination {
        what: format!("{} {how}", t.name),
        channels: vec![t.name.clone()],
        columns,
    })
}

/// Accelerometers that feel vibration.
pub(crate) fn accelerations<'a>(view: &'a View<'_>) -> impl Iterator<Item = &'a Signal> {
    let still = !view.sways();
    view.all(Quantity::Acc)
        .filter(move |a| still && a.std_dev() >= LEAST_VIBRATION)
}

/// Channels of no quantity that the library knows.
fn others<'a>(view: &'a View<'_>) -> impl Iterator<Item = &'a Signal> {
    let changes = |s: &&Signal| s.range() > 0.0;
    view.all(Quantity::Other).filter(changes)
}

/// Gyros that the table turns.
fn turning<'a>(view: &'a View<'_>) -> impl Iterator<Item = &'a Signal> {
    let still = !view.sways() && !view.moving;
    view.all(Quantity::Gyro)
        .filter(move |g| still && g.moving && g.name != view.channel)
}

/// The one channel that a term without a name is made of, if it is one.
pub(crate) fn source(term: &Term) -> Option<&str> {
    match term.of.as_slice() {
        [one] => Some(one),
        _ => None,
    }
}

/// Names of its columns; they are no parameters of anything.
const NAMES: [&str; 8] = ["c0", "c1", "c2", "c3", "c4", "c5", "c6", "c7"];

impl Combination<'_> {
    /// Its hypothesis, with the number of columns that it turns out to have; their values are elsewhere.
    pub(crate) fn hypothesis(self, width: usize) -> Hypothesis {
        let names = NAMES.iter().take(width);
        Hypothesis::Regression(Regression {
            columns: names
                .map(|parameter| Column {
                    parameter,
                    values: vec![],
                })
                .collect(),
            fixed: vec![],
            follows: Some(self.what),
        })
    }
}

impl Effect for Beyond {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        &[]
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "No effect of the library",
            physics: "",
            excitation: "",
            test: "",
            remedy: "",
            figure: "",
            example: Example::new(Plot::Spectrum, &[]),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        &[]
    }

    /// The search asks for its [`combinations`], which are made one at a time.
    fn hypotheses(&self, _: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        Ok(vec![])
    }

    fn stage(&self) -> Stage {
        Stage::Rate
    }

    /// It has no physics that could be simulated.
    fn simulate(&self, _: &Parameters, _: &[usize], _: &mut Simulation) {}
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;

    #[test]
    fn the_words_of_a_combination_name_its_channels() {
        let signal = |name: &str, quantity, moving| {
            let values: Arc<Vec<f64>> = Arc::new(
                (0..2000)
                    .map(|i| 20.0 * (f64::from(i) * 0.01).sin())
                    .collect(),
            );
            Signal {
                name: name.into(),
                quantity,
                axis: None,
                unit: "1".into(),
                smooth: Arc::clone(&values),
                values,
                lsb: None,
                moving,
            }
        };
        let signals = [
            signal("temp_x", Quantity::Temp, false),
            signal("supply", Quantity::Supply, false),
            signal("pwm", Quantity::Pwm, false),
            signal("acc_x", Quantity::Acc, false),
            signal("acc_y", Quantity::Acc, false),
            signal("gyro_y", Quantity::Gyro, true),
        ];
        let view = View {
            channel: "gyro_x",
            axis: None,
            lsb: None,
            white_sigma: 0.3,
            neighbours_sigma: 0.3,
            rate_hz: 20.0,
            samples: 2000,
            base: None,
            moving: false,
            signals: &signals,
        };
        let all = combinations(&view);
        assert!(all.len() > 10, "{}", all.len());
        for c in all {
            let named = signals.iter().map(|s| &s.name);
            let mut named: Vec<&String> = named.filter(|n| c.what.contains(*n)).collect();
            let mut of: Vec<&String> = c.channels.iter().collect();
            named.sort();
            of.sort();
            assert_eq!(named, of, "{}", c.what);
        }
    }
}
