//! Terms without a name in a simulation.

use std::f64::consts::{PI, TAU};

use rand_core::Rng;

use super::{STANDARD_GRAVITY, SimulateError, Simulation, Stretch, axis_named};
use crate::effects::correlated_noise;
use crate::file::ModelFile;
use crate::unnamed::{Domain, Unnamed, between};
use distribution::SinhArcsinh;

mod distribution;

/// Widths of each place that a visit of a tone lasts at least, as times 1 / width; and the longest round over all places, s.
const VISIT: f64 = 10.0;
const LONGEST_ROUND_S: f64 = 100.0;

/// What chance has a part in.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Random {
    /// A noise of a Lorentzian spectrum: axis, standard deviation deg/s, centre and full width at half power, Hz.
    Mode {
        axis: usize,
        size: f64,
        center: f64,
        width: f64,
    },
    /// A tone of steady size, standard deviation deg/s, that visits places: centre and full width at half power, Hz, share of the
    /// time.
    Tone {
        axis: usize,
        size: f64,
        places: Vec<[f64; 3]>,
    },
    /// White noise and `weight` times the same `lag` samples later: axis, standard deviation of both together, deg/s.
    Echo {
        axis: usize,
        size: f64,
        lag: usize,
        weight: f64,
    },
    /// White noise that two axes share, and the correlation that it makes.
    Shared { axes: [usize; 2], correlation: f64 },
}

impl Random {
    pub fn is_noise(&self) -> bool {
        matches!(self, Self::Shared { .. })
    }

    pub fn on(&self, run: &mut Simulation) {
        match self {
            Self::Mode {
                axis,
                size,
                center,
                width,
            } => run.add_mode(*axis, *size, *center, *width, |_| {}),
            Self::Tone { axis, size, places } => run.add_tone(*axis, *size, places),
            Self::Echo {
                axis,
                size,
                lag,
                weight,
            } => run.add_echo(*axis, *size, *lag, *weight),
            Self::Shared { axes, correlation } => {
                correlated_noise::share(run, *axes, *correlation);
            }
        }
    }
}

/// The unnamed terms of a model.
#[derive(Clone, Debug, Default)]
pub(super) struct Generic {
    /// What is drawn for each run.
    pub random: Vec<Random>,
    /// Distribution of the white noise of each axis, where it is not normal.
    pub shapes: [Option<SinhArcsinh>; 3],
}

impl Generic {
    /// Of a model, whose fixed terms are laid on the run at once.
    ///
    /// # Errors
    /// [`SimulateError::NothingToFollow`] for a channel that no simulation has.
    pub fn of(model: &ModelFile, run: &mut Simulation) -> Result<Self, SimulateError> {
        let mut all = Self::default();
        for term in &model.unnamed {
            let axes: Vec<usize> = (term.channels.iter())
                .filter_map(|c| axis_named(c))
                .collect();
            match term.domain {
                Domain::Mean | Domain::Channel => {
                    fixed(term, &axes, run, |run, axis, i, level| {
                        run.rate[axis][i] += level;
                    })?
                }
                Domain::Variance => fixed(term, &axes, run, |run, axis, i, log| {
                    run.variance[axis][i] *= log.exp();
                })?,
                Domain::Spectrum if term.refines.is_some() => all.tones(term, &axes),
                Domain::Spectrum => all.modes(term, &axes),
                Domain::Lag => all.echoes(term, &axes, run.rate_hz),
                Domain::Cross => {
                    if let ([a, b], [r, ..]) = (&*axes, term.values(0)) {
                        all.random.push(Random::Shared {
                            axes: [*a, *b],
                            correlation: *r,
                        });
                    }
                }
                Domain::Codes => {
                    let number = |k: usize| term.values(k).first().copied().unwrap_or(0.0);
                    let shape = SinhArcsinh::of(number(0), number(1));
                    axes.iter().for_each(|a| all.shapes[*a] = Some(shape));
                }
            }
        }
        Ok(all)
    }

    fn tones(&mut self, term: &Unnamed, axes: &[usize]) {
        let squares = term.values(2).iter().map(|s| s * s);
        let in_all: f64 = squares.clone().sum();
        let columns = term.values(0).iter().zip(term.values(1)).zip(squares);
        let places = columns.map(|((center, width), square)| [*center, *width, square / in_all]);
        let places: Vec<[f64; 3]> = places.filter(|p| p[2] > 0.0).collect();
        self.random.extend(axes.iter().map(|axis| Random::Tone {
            axis: *axis,
            size: in_all.sqrt(),
            places: places.clone(),
        }));
    }

    fn echoes(&mut self, term: &Unnamed, axes: &[usize], rate_hz: f64) {
        let columns = term.values(0).iter().zip(term.values(1));
        for ((lag, size), weight) in columns.zip(term.values(2)) {
            self.random.extend(axes.iter().map(|axis| Random::Echo {
                axis: *axis,
                size: *size,
                lag: (lag * rate_hz).round().max(1.0) as usize,
                weight: *weight,
            }));
        }
    }

    fn modes(&mut self, term: &Unnamed, axes: &[usize]) {
        let columns = term.values(0).iter().zip(term.values(1));
        for ((center, width), size) in columns.zip(term.values(2)) {
            self.random.extend(axes.iter().map(|axis| Random::Mode {
                axis: *axis,
                size: *size,
                center: *center,
                width: *width,
            }));
        }
    }
}

/// Refuses axes that share all of their white noise, by correlations of causes and of terms without a name.
///
/// # Errors
/// [`SimulateError::TooCorrelated`].
pub(super) fn too_correlated(model: &ModelFile) -> Result<(), SimulateError> {
    let mut sums = [0.0; 3];
    let mut add = |channel: Option<usize>, r: f64| {
        if let Some(axis) = channel {
            sums[axis] += r.abs();
        }
    };
    let axis = |name: &str| axis_named(name);
    for e in model
        .effects
        .iter()
        .filter(|e| e.cause == correlated_noise::ID)
    {
        let named: Vec<Option<usize>> = match &*e.channels {
            [] => (0..3).map(Some).collect(),
            some => some.iter().map(|c| axis(c)).collect(),
        };
        for (k, with) in correlated_noise::WITH.iter().enumerate() {
            let other = k % 3;
            let r = e.parameters.get(*with).map_or(0.0, |p| p.value);
            for own in named.iter().filter(|own| **own != Some(other)) {
                add(*own, r);
                add(Some(other), r);
            }
        }
    }
    for term in model.unnamed.iter().filter(|t| t.domain == Domain::Cross) {
        let r = term.values(0).first().copied().unwrap_or(0.0);
        term.channels.iter().for_each(|c| add(axis(c), r));
    }
    let most = (0..3).max_by(|a, b| sums[*a].total_cmp(&sums[*b]));
    match most {
        Some(axis) if sums[axis] >= 1.0 => Err(SimulateError::TooCorrelated {
            name: (model.channels.iter())
                .find(|c| axis_named(&c.name) == Some(axis))
                .map_or_else(String::new, |c| c.name.clone()),
            sum: sums[axis],
        }),
        _ => Ok(()),
    }
}

/// Lays knots on each axis: levels as they are, factors by their logarithms.
fn fixed(
    term: &Unnamed,
    axes: &[usize],
    run: &mut Simulation,
    lay: impl Fn(&mut Simulation, usize, usize, f64),
) -> Result<(), SimulateError> {
    let at = term.values(0);
    let values: Vec<f64> = match term.domain {
        Domain::Variance => term.values(1).iter().map(|f| f.ln()).collect(),
        _ => term.values(1).to_vec(),
    };
    let place = match &term.follows {
        Some(name) => followed(name, run)?,
        None => (0..run.samples).map(|i| i as f64 / run.rate_hz).collect(),
    };
    for axis in axes {
        for (i, place) in place.iter().enumerate() {
            lay(run, *axis, i, between(at, &values, *place));
        }
    }
    Ok(())
}

/// What a channel of the world reads, in the unit of its column.
fn followed(name: &str, run: &Simulation) -> Result<Vec<f64>, SimulateError> {
    let scaled = |x: &[f64], by: f64| x.iter().map(|v| v * by).collect();
    let (kind, axis) = name.split_once('_').unwrap_or((name, ""));
    let axis = ["x", "y", "z"].iter().position(|a| *a == axis);
    match (kind, axis) {
        ("temp", axis) => Ok(run.temperature[axis.unwrap_or(0)].clone()),
        ("acc", Some(axis)) => Ok(scaled(&run.acc[axis], STANDARD_GRAVITY)),
        ("supply", _) => Ok(run.supply.clone()),
        ("pwm", _) => Ok(scaled(&run.duty, 255.0)),
        _ => Err(SimulateError::NothingToFollow {
            name: name.to_owned(),
        }),
    }
}

impl Simulation {
    /// Adds to the rate of an axis a noise of a Lorentzian spectrum: standard deviation deg/s, centre and full width at half
    /// power, Hz. At the centre 0 it is a Gauss-Markov process. Both quadratures of each sample, the first of which is what is added,
    /// are told to `seen`.
    pub fn add_mode(
        &mut self,
        axis: usize,
        size: f64,
        center: f64,
        width: f64,
        mut seen: impl FnMut([f64; 2]),
    ) {
        let decay = PI * width / self.rate_hz;
        let turn = TAU * center / self.rate_hz;
        let kept = (-decay).exp();
        let driven = size * (1.0 - kept * kept).max(0.0).sqrt();
        let (sin, cos) = turn.sin_cos();
        let mut rates = std::mem::take(&mut self.rate[axis]);
        // Two quadratures that turn into each other, in their stationary state.
        let mut x = [size * self.normal(), size * self.normal()];
        for k in 0..self.stretches.len() {
            let Stretch { samples, skipped } = self.stretches[k].clone();
            if skipped > 0 {
                let kept = (-decay * skipped as f64).exp();
                let driven = size * (1.0 - kept * kept).max(0.0).sqrt();
                let (sin, cos) = (turn * skipped as f64).sin_cos();
                let turned = [cos * x[0] - sin * x[1], sin * x[0] + cos * x[1]];
                x = turned.map(|v| kept * v + driven * self.normal());
            }
            for rate in &mut rates[samples] {
                *rate += x[0];
                seen(x);
                let turned = [cos * x[0] - sin * x[1], sin * x[0] + cos * x[1]];
                x = turned.map(|v| kept * v + driven * self.normal());
            }
        }
        self.rate[axis] = rates;
    }

    /// Adds to the rate of an axis white noise and `weight` times the same `lag` samples later, standard deviation of both
    /// together deg/s. What came while no sample was taken comes again too.
    fn add_echo(&mut self, axis: usize, size: f64, lag: usize, weight: f64) {
        let own = size / (1.0 + weight * weight).sqrt();
        // No longer than the run: what began before it is as good as any other.
        let mut held = vec![0.0; lag.min(self.samples).max(1)];
        for v in &mut held {
            *v = self.normal();
        }
        let mut at = 0;
        for k in 0..self.stretches.len() {
            let Stretch { samples, skipped } = self.stretches[k].clone();
            for _ in 0..skipped.min(held.len()) {
                held[at] = self.normal();
                at = (at + 1) % held.len();
            }
            for i in samples {
                let now = self.normal();
                self.rate[axis][i] += own * (now + weight * held[at]);
                held[at] = now;
                at = (at + 1) % held.len();
            }
        }
    }

    /// Adds to the rate of an axis a tone of steady size, standard deviation deg/s, that goes round its places: centre and full
    /// width at half power, Hz, and share of the time. Its phase wanders as the width says.
    fn add_tone(&mut self, axis: usize, size: f64, places: &[[f64; 3]]) {
        let amplitude = size * std::f64::consts::SQRT_2;
        let rounds = places
            .iter()
            .map(|[_, width, share]| VISIT / (width * share));
        let round = rounds.fold(0.0, f64::max).min(LONGEST_ROUND_S) * self.rate_hz;
        let mut rates = std::mem::take(&mut self.rate[axis]);
        let mut uniform = || self.rng.next_u64() as f64 / u64::MAX as f64;
        let (mut phase, mut within) = (TAU * uniform(), round * uniform());
        for k in 0..self.stretches.len() {
            let Stretch { samples, skipped } = self.stretches[k].clone();
            within = (within + skipped as f64) % round;
            if skipped > 0 {
                phase = TAU * (self.rng.next_u64() as f64 / u64::MAX as f64);
            }
            for rate in &mut rates[samples] {
                *rate += amplitude * phase.cos();
                let mut left = within / round;
                let at = places.iter().find(|p| {
                    left -= p[2];
                    left < 0.0
                });
                let [center, width, _] = at.or(places.last()).copied().unwrap_or_default();
                let spread = (TAU * width / self.rate_hz).sqrt();
                phase += TAU * center / self.rate_hz + spread * self.normal();
                within = (within + 1.0) % round;
            }
        }
        self.rate[axis] = rates;
    }
}

#[cfg(test)]
mod tests;
