//! Combinations of the recorded channels that no effect of the library is made of. A channel that follows one of them
//! has a cause without a name: the search weighs them beside the effects, and the answer is "unexplained, but follows".

use model::effect::{
    Column, Docs, Effect, Example, Hypothesis, ParameterSpec, Parameters, Plot, Regression, Rival,
    Signal, Stage, View,
};
use model::record::Quantity;
use model::simulate::Simulation;

/// Id of the stand-in that the search knows them by; no cause of the library.
pub const ID: &str = "beyond";

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
const LEAST_TEMPERATURE: f64 = 0.5;
const LEAST_COMMAND: f64 = 8.0;
const LEAST_SUPPLY: f64 = 5e-3;
const LEAST_VIBRATION: f64 = 0.15;

fn centred(values: &[f64]) -> Vec<f64> {
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

fn lagged(values: &[f64], tau: f64) -> Vec<f64> {
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

/// Makes the values of a combination; long records hold one at a time.
type Maker<'a> = Box<dyn Fn() -> Vec<f64> + 'a>;

/// The combinations that a record allows, each with its name.
fn combinations<'a>(view: &'a View<'_>) -> Vec<(String, Maker<'a>)> {
    let moves = |s: &&Signal, least: f64| s.range() >= least;
    let temperature = view
        .signal(Quantity::Temp)
        .filter(|s| moves(s, LEAST_TEMPERATURE));
    let motor = view
        .signal(Quantity::Pwm)
        .filter(|s| moves(s, LEAST_COMMAND));
    let supply = view
        .signal(Quantity::Supply)
        .filter(|s| moves(s, LEAST_SUPPLY));
    let mut all: Vec<(String, Maker<'a>)> = vec![];
    if let Some(t) = temperature {
        let c = || centred(&t.smooth);
        let reach = ((SLOPE_S * view.rate_hz).round() as usize).max(1);
        all.push((
            format!("rate of change of {}", t.name),
            Box::new(move || slope(&t.smooth, reach)),
        ));
        all.push((
            format!("{} behind a lag", t.name),
            Box::new(|| lagged(&t.smooth, LAG_S * view.rate_hz)),
        ));
        for share in PLAYS {
            let what = format!(
                "{} with a play of {:.1} {}",
                t.name,
                share * t.range(),
                t.unit
            );
            all.push((
                what,
                Box::new(move || played(&t.smooth, 0.5 * share * t.range())),
            ));
        }
        all.push((
            format!("cube of {}", t.name),
            Box::new(move || c().iter().map(|v| v.powi(3)).collect()),
        ));
        // The command has a zero of its own; the supply has none that means anything.
        if let Some(m) = motor {
            all.push((
                format!("{} times {}", m.name, t.name),
                Box::new(move || product(&m.smooth, &c())),
            ));
        }
        if let Some(u) = supply {
            let name = format!("{} times {}", u.name, t.name);
            all.push((name, Box::new(move || product(&centred(&u.smooth), &c()))));
        }
        if let Some(m) = motor {
            let size = || m.smooth.iter().map(|v| v.abs()).collect::<Vec<f64>>();
            all.push((
                format!("size of {} times {}", m.name, t.name),
                Box::new(move || product(&size(), &c())),
            ));
        }
    }
    if let (Some(m), Some(u)) = (motor, supply) {
        let name = format!("{} times {}", m.name, u.name);
        all.push((
            name,
            Box::new(move || product(&m.smooth, &centred(&u.smooth))),
        ));
    }
    for a in view
        .all(Quantity::Acc)
        .filter(|a| a.std_dev() >= LEAST_VIBRATION && !view.sways())
    {
        let square = || centred(&a.values).iter().map(|v| v * v).collect();
        all.push((format!("square of {}", a.name), Box::new(square)));
    }
    all
}

/// Its hypotheses, each made when it is asked for.
pub fn one_by_one<'a>(view: &'a View<'_>) -> impl ExactSizeIterator<Item = Hypothesis> + 'a {
    combinations(view).into_iter().map(|(name, values)| {
        Hypothesis::Regression(Regression {
            columns: vec![Column {
                parameter: "size",
                values: values(),
            }],
            fixed: vec![],
            follows: Some(name),
        })
    })
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
            figure: "",
            example: Example::new(Plot::Spectrum, &[]),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        &[]
    }

    fn hypotheses(&self, view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        Ok(one_by_one(view).collect())
    }

    fn stage(&self) -> Stage {
        Stage::Rate
    }

    /// It has no physics that could be simulated.
    fn simulate(&self, _: &Parameters, _: &[usize], _: &mut Simulation) {}
}
