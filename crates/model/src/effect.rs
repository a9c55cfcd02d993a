//! What every effect of the library says about itself: physics, parameters, simulation, place in the likelihood.
//!
//! The search knows hypotheses, never effects by name: an effect lays out its hypotheses for a channel of a record
//! ([`Effect::hypotheses`]) and turns what was estimated into its parameters ([`Effect::describe`]).

mod covariance;
mod docs;
mod shape;
mod slowest;

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::parameter::Parameter;
use crate::record::{Axis, Base, Quantity};
use crate::simulate::Simulation;
pub use covariance::{Covariance, Frequencies, Peak};
pub use docs::{Docs, Example, Plot, Rival};
pub use shape::Shape;
pub use slowest::{Frames, Held, slowest};

/// Parameters of one effect by name.
pub type Parameters = BTreeMap<String, Parameter>;

/// A parameter of an effect, as the contract names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ParameterSpec {
    /// Name.
    pub name: &'static str,
    /// Unit on a channel in deg/s.
    pub unit: &'static str,
    /// What it means.
    pub meaning: &'static str,
    /// Whether a model file has to give it.
    pub required: bool,
    /// Whether it is for programs alone: one of many numbers that say something together.
    pub detail: bool,
}

/// Standard errors within which values on two channels are one: by chance 1 in 16 000 of such pairs lie farther apart.
const ONE: f64 = 4.0;

/// Whether a value is the same on two channels, which both state it, within their errors.
pub(crate) fn agree(a: &Parameters, b: &Parameters, name: &str) -> bool {
    let (Some(a), Some(b)) = (a.get(name), b.get(name)) else {
        return false;
    };
    let error = a.std_error.unwrap_or(0.0).hypot(b.std_error.unwrap_or(0.0));
    (a.value - b.value).abs() <= ONE * error
}

/// Shorthand for a required parameter.
#[must_use]
pub const fn parameter(
    name: &'static str,
    unit: &'static str,
    meaning: &'static str,
) -> ParameterSpec {
    ParameterSpec {
        name,
        unit,
        meaning,
        required: true,
        detail: false,
    }
}

/// Shorthand for a parameter that may be left out.
#[must_use]
pub const fn optional(
    name: &'static str,
    unit: &'static str,
    meaning: &'static str,
) -> ParameterSpec {
    ParameterSpec {
        name,
        unit,
        meaning,
        required: false,
        detail: false,
    }
}

/// Shorthand for a parameter that may be left out, and that nobody reads by itself.
#[must_use]
pub const fn detail(
    name: &'static str,
    unit: &'static str,
    meaning: &'static str,
) -> ParameterSpec {
    ParameterSpec {
        detail: true,
        ..optional(name, unit, meaning)
    }
}

/// When an effect acts in a simulation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// On the world around the sensors: motion.
    World,
    /// On the rate before it is quantised.
    Rate,
    /// On the size of the white noise, before it is drawn.
    Noise,
    /// On all that the sensor put out before quantisation, noise included (filters).
    Output,
    /// On what the filters let through, before it is counted.
    Reading,
    /// On counts.
    Counts,
    /// On frames and clocks.
    Frames,
}

/// A recorded signal on the time grid of the analysis, without gaps.
#[derive(Clone, Debug, PartialEq)]
pub struct Signal {
    /// Channel name.
    pub name: String,
    /// What it measures.
    pub quantity: Quantity,
    /// Axis, where it has one.
    pub axis: Option<Axis>,
    /// Unit of the readings.
    pub unit: String,
    /// Readings on the grid.
    pub values: Arc<Vec<f64>>,
    /// The same without reading noise, as a local-level smoother gives it; where there is none to take off, the same.
    pub smooth: Arc<Vec<f64>>,
    /// Unit per count.
    pub lsb: Option<f64>,
    /// For a gyro: whether its true rate visibly moves.
    pub moving: bool,
}

/// The least and the greatest of some values, eight at a time: they are the same in any order. Infinite, the least above
/// the greatest, of none.
#[must_use]
pub fn extremes(values: &[f64]) -> [f64; 2] {
    let [mut low, mut high] = [f64::INFINITY, f64::NEG_INFINITY].map(|v| [v; 8]);
    let (eights, rest) = values.as_chunks::<8>();
    for some in eights.iter().map(<[f64; 8]>::as_slice).chain([rest]) {
        for ((low, high), v) in low.iter_mut().zip(&mut high).zip(some) {
            *low = if v < low { *v } else { *low };
            *high = if v > high { *v } else { *high };
        }
    }
    let low = low.into_iter().fold(f64::INFINITY, f64::min);
    [low, high.into_iter().fold(f64::NEG_INFINITY, f64::max)]
}

impl Signal {
    /// Highest minus lowest value of the smoothed signal.
    #[must_use]
    pub fn range(&self) -> f64 {
        let [low, high] = extremes(&self.smooth);
        high - low
    }

    /// Standard deviation of the readings.
    #[must_use]
    pub fn std_dev(&self) -> f64 {
        let n = self.values.len().max(1) as f64;
        let mean = self.values.iter().sum::<f64>() / n;
        (self.values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt()
    }
}

/// What an effect sees of a record when it lays out its hypotheses for one channel.
#[derive(Clone, Debug)]
pub struct View<'a> {
    /// The channel to be explained.
    pub channel: &'a str,
    /// Its axis.
    pub axis: Option<Axis>,
    /// Its unit per count.
    pub lsb: Option<f64>,
    /// Standard deviation of its white noise, in its unit.
    pub white_sigma: f64,
    /// Standard deviation of the change from one sample to the next over the root of 2: that of the noise which neighbours do not
    /// share, in its unit.
    pub neighbours_sigma: f64,
    /// Sample rate, Hz.
    pub rate_hz: f64,
    /// Length of the grid.
    pub samples: usize,
    /// What the base did, as the header says.
    pub base: Option<Base>,
    /// Whether the channel itself sees motion of the base.
    pub moving: bool,
    /// All signals of the record.
    pub signals: &'a [Signal],
}

impl View<'_> {
    /// The signal of a quantity for the axis of the channel, or the only one there is.
    #[must_use]
    pub fn signal(&self, quantity: Quantity) -> Option<&Signal> {
        let own = self
            .signals
            .iter()
            .find(|s| s.quantity == quantity && s.axis == self.axis);
        own.or_else(|| {
            self.signals
                .iter()
                .find(|s| s.quantity == quantity && s.axis.is_none())
        })
    }

    /// All signals of a quantity.
    pub fn all(&self, quantity: Quantity) -> impl Iterator<Item = &Signal> {
        self.signals.iter().filter(move |s| s.quantity == quantity)
    }

    /// Whether the base sways: some gyro sees motion that no turntable makes. Small true rates about the other axes come
    /// with it.
    #[must_use]
    pub fn sways(&self) -> bool {
        self.base != Some(Base::Turntable) && self.signals.iter().any(|s| s.moving)
    }

    /// Length of the record, s.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.samples as f64 / self.rate_hz
    }

    /// Time of a sample, s.
    #[must_use]
    pub fn time(&self, index: usize) -> f64 {
        index as f64 / self.rate_hz
    }
}

/// A column of a regression: its coefficient is the named parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Parameter that the coefficient estimates.
    pub parameter: &'static str,
    /// One value per sample.
    pub values: Vec<f64>,
}

/// A regression on recorded or stated shapes.
#[derive(Clone, Debug, PartialEq)]
pub struct Regression {
    /// What is estimated.
    pub columns: Vec<Column>,
    /// Values of the shape that are held fixed in this hypothesis (a time constant), with their units.
    pub fixed: Vec<(&'static str, f64, &'static str)>,
    /// The channel that the columns are made of; `None` for shapes of time.
    pub follows: Option<String>,
}

/// A law by which the white variance changes in time.
#[derive(Clone, Debug, PartialEq)]
pub enum VarianceLaw {
    /// 1 + coefficient x the shape.
    Shape {
        /// One value per sample, 0..1.
        shape: Arc<Vec<f64>>,
        /// Parameters that say which of the effect's shapes it is.
        fixed: Vec<(&'static str, f64, &'static str)>,
        /// The channel that it is made of.
        follows: String,
    },
    /// A stretch of the record, sought at all starts and lengths.
    Segment,
}

/// One thing that may be true of a channel, in a form that a likelihood can weigh.
#[derive(Clone)]
pub enum Hypothesis {
    /// Least squares on known columns.
    Regression(Regression),
    /// Least squares on a shape with one coordinate.
    Shaped(Arc<dyn Shape>),
    /// A jump of the mean at any time.
    Step,
    /// A sinusoid of any frequency.
    Line,
    /// Side bands of a line.
    SideBands,
    /// A stationary process or filter.
    Covariance(Arc<dyn Covariance>),
    /// A change of the white variance.
    Variance(VarianceLaw),
    /// A process with two levels.
    TwoLevel,
    /// A tone of steady size whose phase wanders: it has the spectrum of a noise that stands at one frequency.
    WanderingTone,
    /// Noise shared by the gyros.
    Common,
    /// Noise that pairs of gyros share, each its part.
    Correlation,
    /// The rate held against the tilt that the accelerometers see.
    Scale,
    /// True rotation of the base.
    Motion,
    /// A short event in the mean, sought on all channels at once.
    Blow,
    /// Counted in the audit of frames and counts.
    Audit,
}

/// What was estimated for a hypothesis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Found {
    /// Unit of the channel.
    pub unit: String,
    /// Sample rate, Hz.
    pub rate_hz: f64,
    /// White standard deviation of the channel, in its unit.
    pub white_sigma: f64,
    /// Names of the coefficients.
    pub names: Vec<&'static str>,
    /// Coefficients with their standard errors (columns), or coordinates of the shape (covariance).
    pub coefficients: Vec<(f64, f64)>,
    /// Fixed values of the shape.
    pub fixed: Vec<(&'static str, f64, &'static str)>,
    /// Location with its standard error: time of a step in s, frequency of a line in Hz, coordinate of a shape.
    pub location: Vec<(f64, f64)>,
}

/// An effect of the library.
pub trait Effect: Send + Sync {
    /// Cause id of docs/effects.md.
    fn id(&self) -> &'static str;
    /// Its parameters.
    fn parameters(&self) -> &'static [ParameterSpec];
    /// Its page.
    fn docs(&self) -> Docs;
    /// Causes that may look the same.
    fn rivals(&self) -> &'static [Rival];
    /// The hypotheses to weigh for a channel.
    ///
    /// # Errors
    /// Why it cannot be tested on this record, and what to record instead.
    fn hypotheses(&self, view: &View<'_>) -> Result<Vec<Hypothesis>, String>;
    /// Turn an estimate into the parameters of the contract.
    fn describe(&self, found: &Found) -> Parameters {
        columns_as_parameters(self.parameters(), found)
    }
    /// The effect that this one contains as a special case: it takes its place instead of joining it.
    fn extends(&self) -> Option<&'static str> {
        None
    }
    /// The effect with one parameter less that this one is at the end of its range: beside it, where both would do, this one
    /// has to be worth the parameter.
    fn ends_in(&self) -> Option<&'static str> {
        None
    }
    /// The parameter that this one is at most a part of, either way, and the part, where the channel's noise is not filtered.
    fn at_most(&self, _parameter: &str) -> Option<(&'static str, f64)> {
        None
    }
    /// Parameters that say it all to a reader, where they are others than those that the effect requires.
    fn named_first(&self, _parameters: &Parameters) -> &'static [&'static str] {
        &[]
    }
    /// Whether the same cause on two channels is one event.
    fn same_event(&self, _a: &Parameters, _b: &Parameters) -> bool {
        false
    }
    /// Whether this is one of several times that a cause acts, all of which are told as one.
    fn recurs(&self, _parameters: &Parameters) -> bool {
        false
    }
    /// Settings of the excitation ([`crate::excitation::SETTINGS`]) without all of which it does not show in a
    /// simulation; empty where it needs none.
    fn excited_by(&self) -> &'static [&'static str] {
        &[]
    }
    /// Whether the sensor feels what it follows through its own filter, and at another instant than the channel shows it.
    fn felt_late(&self) -> bool {
        false
    }
    /// Factor by which it makes the step of the readings larger.
    fn coarsens(&self, _parameters: &Parameters) -> f64 {
        1.0
    }
    /// Density, of mean 1, of white noise that went through it; none of what is no filter.
    fn passes(&self, _parameters: &Parameters, _at: &Frequencies) -> Option<Vec<f64>> {
        None
    }
    /// How it holds readings in a run of so many frames at this rate; none of what holds none.
    fn holds(&self, _parameters: &Parameters, _frames: Frames) -> Option<Held> {
        None
    }
    /// What it takes from the readings, of an effect that adds nothing to them but what is missing.
    fn takes(&self) -> Option<&'static str> {
        None
    }
    /// When it acts in a simulation.
    fn stage(&self) -> Stage;
    /// Act on the simulation. `channels` are the gyro axes (0..2) that the model names.
    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation);
}

/// The unit of a parameter on a channel of unit `channel_unit`, where the contract states it for deg/s.
#[must_use]
pub fn unit_on(spec_unit: &str, channel_unit: &str) -> String {
    spec_unit.strip_prefix("deg/s").map_or_else(
        || spec_unit.to_owned(),
        |rest| {
            if rest == "^2" {
                format!("{channel_unit}/s")
            } else {
                format!("{channel_unit}{rest}")
            }
        },
    )
}

/// Coefficients by name and fixed values, with the units of the contract.
#[must_use]
pub fn columns_as_parameters(specs: &[ParameterSpec], found: &Found) -> Parameters {
    let unit_of = |name: &str| {
        specs
            .iter()
            .find(|s| s.name == name)
            .map_or("1", |s| s.unit)
    };
    let unit = |name: &str| {
        let spec = unit_of(name);
        if found.unit == "deg/s" {
            spec.to_owned()
        } else {
            unit_on(spec, &found.unit)
        }
    };
    let mut all: Parameters = found
        .names
        .iter()
        .zip(&found.coefficients)
        .map(|(name, (value, error))| {
            (
                (*name).to_owned(),
                Parameter::estimated(*value, *error, &unit(name)),
            )
        })
        .collect();
    for (name, value, fixed_unit) in &found.fixed {
        all.insert((*name).to_owned(), Parameter::exact(*value, fixed_unit));
    }
    all
}

/// The value of a parameter, or 0 where a model leaves it out.
#[must_use]
pub fn value(parameters: &Parameters, name: &str) -> f64 {
    parameters.get(name).map_or(0.0, |p| p.value)
}
