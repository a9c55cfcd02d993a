//! What is planted in a stand: an effect of the library, at a wanted strength.

use model::Parameter;
use model::effect::{Parameters, Stage};
use model::effects::effect;
use model::file::EffectModel;
use model::record::flag;
use model::simulate::{Simulation, Stretch};
use rand_core::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::random::Draw;
use crate::series::each;
use crate::stand::{GYROS, Needs, Stand};
use crate::strength::Meter;

mod counted;
mod strong;

pub use counted::COUNTED;
pub use strong::{LARGEST_RMS, STRONG, TURNS_BELOW_HZ};

/// An effect of the library, as the campaign plants it: a row of its tables.
#[derive(Clone, Copy)]
pub struct LibraryEffect<How: 'static> {
    /// Number of its family: all draws hang on it, so it never changes.
    pub id: u16,
    /// The row of the tables.
    pub label: &'static str,
    /// Cause id that the answer has to give.
    pub cause: &'static str,
    /// The environment that it needs.
    pub needs: Needs,
    /// The strength from which it is asked to be named.
    pub asked_from: f64,
    /// How far above the oracle's limit the smallest named size may lie.
    pub asked_ratio: f64,
    /// Whether it shows on a moving base alone, on a level axis; that excludes most others.
    pub moves: bool,
    /// Whether it concerns all channels.
    pub everywhere: bool,
    /// Causes that are true of the run as well.
    pub true_parts: &'static [&'static str],
    /// How it is drawn.
    pub how: How,
}

impl<How: Copy> LibraryEffect<How> {
    /// One as most are.
    const fn new(id: u16, cause: &'static str, how: How) -> Self {
        Self {
            id,
            label: cause,
            cause,
            needs: Needs::NONE,
            asked_from: 8.0,
            asked_ratio: 1.3,
            moves: false,
            everywhere: false,
            true_parts: &[],
            how,
        }
    }

    const fn needs(mut self, needs: Needs) -> Self {
        self.needs = needs;
        self
    }

    /// Asked for from this strength on, and up to so far above the oracle's limit.
    const fn asked(mut self, asked_from: f64, asked_ratio: f64) -> Self {
        (self.asked_from, self.asked_ratio) = (asked_from, asked_ratio);
        self
    }

    const fn on_a_moving_base(mut self) -> Self {
        self.moves = true;
        self
    }

    const fn on_all_channels(mut self) -> Self {
        self.everywhere = true;
        self
    }

    const fn called(mut self, label: &'static str) -> Self {
        self.label = label;
        self
    }
}

/// A row whose strength is a d'.
pub type StrongRow = LibraryEffect<strong::How>;

/// The rows of the tables: what has a strength, then what is counted.
pub fn labels() -> impl Iterator<Item = &'static str> {
    let counted = COUNTED.iter().map(|row| row.label);
    STRONG.iter().map(|row| row.label).chain(counted)
}

/// The row of this label, of those whose strength is a d'.
///
/// # Panics
/// For a label that no row of [`STRONG`] has.
#[must_use]
pub fn strong(label: &str) -> &'static StrongRow {
    let own = STRONG.iter().find(|row| row.label == label);
    own.unwrap_or_else(|| panic!("{label} has no strength"))
}

/// The strength from which a cause is asked to be named.
#[must_use]
pub fn asked_from(label: &str) -> f64 {
    strong(label).asked_from
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

impl Truth {
    /// A cause on an axis or on all, with these parameters and without a strength.
    fn of(label: &'static str, cause: &'static str, axis: Option<usize>, values: &[Value]) -> Self {
        Self {
            label,
            cause,
            channel: axis.map_or("", |axis| GYROS[axis]).to_owned(),
            strength: f64::NAN,
            parameters: parameters_of(cause, values),
            signal: None,
            density: None,
        }
    }
}

/// A parameter of a cause, in its unit.
type Value = (&'static str, f64);
type Values = Vec<Value>;

fn parameters_of(cause: &str, values: &[Value]) -> Parameters {
    let specs = effect(cause).map_or(&[][..], |e| e.parameters());
    let with_unit = |(name, value): &Value| {
        let spec = specs.iter().find(|s| s.name == *name);
        let unit = spec.map_or("1", |s| s.unit);
        ((*name).to_owned(), Parameter::exact(*value, unit))
    };
    values.iter().map(with_unit).collect()
}

/// The history of the table's turning about z, deg/s, that a stand's excitation asks for.
fn turning(stand: &Stand, times: &[f64]) -> Option<Vec<f64>> {
    let setting = |key: &str| Some(stand.excitation.iter().find(|(k, _)| *k == key)?.1);
    let (turn, period) = (setting("turn_dps")?, setting("turn_period_s")?);
    let w = std::f64::consts::TAU / period;
    Some(each(times, |t| turn * (w * t).sin()))
}

/// An empty run in the world of a stand, for an effect to act on.
fn blank(stand: &Stand) -> Simulation {
    let n = stand.samples();
    let zeros = || std::array::from_fn(|_| vec![0.0; n]);
    let times = stand.series(|i| i as f64 / stand.rate_hz);
    let mut motion: [Vec<f64>; 3] = zeros();
    if let Some(turned) = turning(stand, &times) {
        motion[2] = turned;
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
        rounding: [0.0; 3],
        felt: None,
        rotors: vec![],
        of_accelerometers: false,
        shared: Default::default(),
        own: [1.0; 3],
        variance: std::array::from_fn(|_| vec![1.0; n]),
        white: Default::default(),
        sensor_step: [None; 3],
        counts: Default::default(),
        flags: vec![flag::IN_ORDER; n],
        keep: vec![true; n],
        device_time: times.clone(),
        host_time: times,
    }
}

/// What an effect without chance adds to the rate of an axis.
fn signal_of(stand: &Stand, cause: &str, values: &[Value], axis: usize) -> Vec<f64> {
    let mut run = blank(stand);
    if let Some(e) = effect(cause).filter(|e| e.stage() == Stage::Rate) {
        e.simulate(&parameters_of(cause, values), &[axis], &mut run);
    }
    std::mem::take(&mut run.rate[axis])
}

/// What is to be planted, where and how strong.
#[derive(Clone, Copy, Debug)]
pub struct Asked {
    /// Cause.
    pub cause: &'static str,
    /// Axis.
    pub axis: usize,
    /// d'.
    pub wanted: f64,
    /// 1 or -1.
    pub sign: f64,
}

/// An effect with a strength, as drawn.
pub struct Drawn {
    values: Values,
    strength: f64,
    /// Signal that it adds to its channel, where it is one.
    signal: Option<Vec<f64>>,
    /// Variance that it adds to the coefficients of its channel, by bin, where it is a process.
    density: Option<Vec<f64>>,
}

impl Drawn {
    /// Neither a signal nor a process.
    fn of(values: Values, strength: f64) -> Self {
        Self {
            values,
            strength,
            signal: None,
            density: None,
        }
    }

    /// A process.
    fn process(values: Values, strength: f64, density: Vec<f64>) -> Self {
        Self {
            density: Some(density),
            ..Self::of(values, strength)
        }
    }

    /// A shape of the size that is as strong as asked: its parameters, those that its size multiplies, and signals beyond which it
    /// is measured, for a simpler cause describes them.
    fn shape(
        stand: &Stand,
        asked: Asked,
        (shape, sized): (&[Value], &[Value]),
        less: &[Vec<f64>],
    ) -> Self {
        let all = |size: f64| [shape, &each(sized, |(name, v)| (name, v * size))].concat();
        let meter = Meter::new(stand, asked.axis);
        let unit = signal_of(stand, asked.cause, &all(1.0), asked.axis);
        let energy = match less {
            [] => meter.energy(&unit),
            _ => meter.energy(&meter.beyond(&unit, less)),
        };
        let (size, strength) = meter.sized(&energy, asked.wanted);
        Self {
            signal: Some(each(&unit, |v| v * size)),
            ..Self::of(all(size), strength)
        }
    }
}

/// Plant the row `label` on `axis` of a stand at a strength of `wanted`. The stand's excitation may gain a turn or a sway.
///
/// # Panics
/// Never for the labels of [`STRONG`].
#[must_use]
pub fn plant(draw: &mut Draw, stand: &mut Stand, label: &str, axis: usize, wanted: f64) -> Truth {
    let row = strong(label);
    let (cause, sign) = (row.cause, draw.sign());
    let asked = Asked {
        cause,
        axis,
        wanted,
        sign,
    };
    let drawn = (row.how)(draw, stand, asked);
    let axis = Some(axis).filter(|_| !row.everywhere);
    Truth {
        strength: drawn.strength,
        signal: drawn.signal,
        density: drawn.density,
        ..Truth::of(row.label, cause, axis, &drawn.values)
    }
}

/// Plant something counted, by its place in [`COUNTED`], at a size that is certain to show.
#[must_use]
pub fn plant_counted(draw: &mut Draw, stand: &Stand, place: usize, axis: usize) -> Truth {
    let row = &COUNTED[place];
    let counted::Fault { values, everywhere } = (row.how)(draw, stand, axis);
    let axis = Some(axis).filter(|_| !(everywhere || row.everywhere));
    Truth::of(row.label, row.cause, axis, &values)
}

/// Wild readings on an axis: how many, and how far off in standard deviations of the white noise, even in the logarithm.
#[must_use]
pub fn plant_outliers(
    draw: &mut Draw,
    stand: &Stand,
    axis: usize,
    many: (f64, f64),
    far: (f64, f64),
) -> Truth {
    let count = draw.by_ratio(many.0, many.1 + 1.0).floor();
    let size = stand.white(axis).sqrt() * draw.by_ratio(far.0, far.1);
    let values = [("count", count), ("size", size)];
    Truth::of("outliers", "outliers", Some(axis), &values)
}

/// The effect of a truth, as the simulation takes it; `None` where its signal is added afterwards.
#[must_use]
pub fn as_effect(truth: &Truth) -> Option<EffectModel> {
    let channel = Some(truth.channel.clone()).filter(|c| !c.is_empty());
    (truth.label != strong::CURRENT).then(|| EffectModel {
        cause: truth.cause.to_owned(),
        channels: channel.into_iter().collect(),
        parameters: truth.parameters.clone(),
    })
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use model::effects::EFFECTS;

    use super::*;

    #[test]
    fn every_effect_of_the_library_has_a_row() {
        let counted = COUNTED.iter().map(|r| r.cause);
        let causes: Vec<&str> = STRONG.iter().map(|r| r.cause).chain(counted).collect();
        for id in EFFECTS.iter().map(|e| e.id()) {
            assert!(
                causes.contains(&id),
                "{id} has no row in plant/strong.rs or plant/counted.rs: the campaign would never plant it"
            );
        }
        for cause in causes {
            assert!(effect(cause).is_some(), "the library has no {cause}");
        }
    }

    #[test]
    fn no_two_rows_have_a_number_or_a_label_in_common() {
        let counted = COUNTED.iter().map(|r| r.id);
        let numbers: BTreeSet<u16> = STRONG.iter().map(|r| r.id).chain(counted).collect();
        let all = STRONG.len() + COUNTED.len();
        let labels: BTreeSet<&str> = labels().collect();
        assert_eq!((numbers.len(), labels.len()), (all, all));
    }

    #[test]
    fn each_row_is_as_strong_as_asked_unless_it_is_as_large_as_may_be() {
        for (i, row) in STRONG.iter().enumerate() {
            let draw = &mut Draw::of(3, 900 + i as u64, 0);
            let mut stand = Stand::draw(draw, 600.0, 20.0, row.needs);
            let truth = plant(draw, &mut stand, row.label, 1, 12.0);
            let off = truth.strength / 12.0 - 1.0;
            let kept = off < 0.01 && (off > -0.02 || truth.density.is_some());
            assert!(kept, "{}: {}", row.label, truth.strength);
        }
    }
}
