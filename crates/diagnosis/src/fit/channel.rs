//! The model of a channel: its terms, their form, the noise and the fit.

mod path;
mod variance;

use std::sync::Arc;

use model::effect::{Effect, Found, Frequencies, Peak, Shape};

use crate::fit::likelihood::{Noise, Panel, Solution};
use crate::fit::scan::residual;
use crate::test_level::{Outcome, Worded};
use numerics::tails::TWO_SIDED;
pub use path::Path;
pub(crate) use variance::{VarianceFound, VarianceLaws, divide, over_mean, undo};

/// Id of the stand-in that the search knows them by; no cause of the library.
pub const ID: &str = "beyond";

/// Scores closer than this (twice 3 nats) leave the answer open.
pub const RIVAL_SPAN: f64 = 6.0;

/// Place of the correlation time of its pitch among what is stated of a tone that was tracked.
const PITCH_TIME: usize = 4;

/// Half widths about the centre of a band that hold what it explains.
pub(crate) const BAND_REACH: f64 = 3.0;

/// Largest width at half power over the centre: a mode of a lower quality factor than 3 is hardly one, and what wanders, bent
/// by what a random walk takes up, has such a peak.
const NARROW: f64 = 1.0 / 3.0;
/// Whether a peak is no narrow one, or is not seen to have two sides: a fifth of its height, two half widths from its middle, lies
/// beyond half the sample rate.
pub(crate) fn is_wide(peak: &Peak) -> bool {
    let width = 2.0 * peak.half_width;
    width > NARROW * peak.omega || peak.omega + width > std::f64::consts::PI
}

/// What an accepted or weighed term is made of.
#[derive(Clone)]
pub enum Form {
    /// Columns of a regression.
    Columns,
    /// Columns of a shape at its coordinate.
    Shaped(Arc<dyn Shape>, f64),
    /// A step at that time in samples, with its standard error.
    Step(f64, f64),
    /// A line of that angular frequency.
    Line(f64),
    /// A line with side bands at that distance, both rad per sample.
    SideBands(f64, f64),
    /// A stationary term of the noise.
    Covariance(Arc<dyn model::effect::Covariance>, Vec<f64>),
}

/// A term of the model of a channel.
#[derive(Clone)]
pub struct Term {
    /// The effect.
    pub effect: &'static dyn Effect,
    /// Number of its hypothesis in the list of candidates.
    pub candidate: usize,
    /// What it is made of.
    pub form: Form,
    /// Columns of the panel that it uses.
    pub columns: Vec<usize>,
    /// Names of the coefficients.
    pub names: Vec<&'static str>,
    /// Values held fixed.
    pub fixed: Vec<(&'static str, f64, &'static str)>,
    /// What it follows, in words.
    pub follows: Option<String>,
    /// Names of the recorded channels that this is made of.
    pub of: Vec<String>,
    /// Likelihood ratio against the model without it.
    pub lr: f64,
    /// What a false one reaches once in the stated number of clean channels.
    pub threshold: f64,
    /// Effects that leave the answer open, with their log odds.
    pub alternatives: Vec<(&'static dyn Effect, f64)>,
    /// Coefficients found by other means than the fit.
    pub stated: Option<Vec<(f64, f64)>>,
    /// Of a tone that was tracked: its phase.
    pub path: Option<Arc<Path>>,
    /// What its name claims, where a contest has weighed that.
    pub claims: Vec<Outcome>,
    /// Of a band: the bands that it is one with.
    pub cluster: Option<Cluster>,
    /// How much wider the errors of its coordinates are than those of Gaussian noise of its spectrum; none where it is that.
    pub wider: Vec<f64>,
}

/// Bands that overlap: one phenomenon, and one entry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cluster {
    /// Which one of the channel.
    pub number: usize,
    /// Place of the band among them, the strongest first.
    pub place: usize,
    /// Likelihood ratio of all of them against none.
    pub lr: f64,
}

impl Term {
    /// A term of candidate number `candidate`, not weighed yet.
    pub(crate) fn new(
        effect: &'static dyn Effect,
        candidate: usize,
        form: Form,
        threshold: f64,
    ) -> Self {
        Self {
            effect,
            candidate,
            form,
            columns: vec![],
            names: vec![],
            fixed: vec![],
            follows: None,
            of: vec![],
            lr: 0.0,
            threshold,
            alternatives: vec![],
            stated: None,
            path: None,
            claims: vec![],
            cluster: None,
            wider: vec![],
        }
    }

    /// Whether it is a tone that several channels have a part of.
    pub(crate) fn is_shared_tone(&self) -> bool {
        self.path.as_ref().is_some_and(|p| p.shared)
    }

    /// Whether it and another one are tones of one rotor that shakes several channels: their pitches stay for one time. What one channel
    /// alone has need be no rotor.
    pub(crate) fn turns_with(&self, other: &Self) -> bool {
        let stays = |t: &Self| Some(t.stated.as_ref()?.get(PITCH_TIME)?.0);
        self.is_shared_tone() && other.is_shared_tone() && stays(self) == stays(other)
    }

    /// Likelihood ratio beyond the threshold.
    #[must_use]
    pub fn score(&self) -> f64 {
        self.lr - self.threshold
    }

    /// Whether it is a process that is added and stands at no one frequency and at no one lag.
    pub(crate) fn is_process(&self) -> bool {
        matches!(&self.form, Form::Covariance(c, theta) if !c.filters_white() && !c.is_peak() && c.lag(theta).is_none())
    }

    /// Whether it is a process that wanders: one whose density falls with the frequency. Rounded angles make one that rises, in
    /// which no level stays.
    pub(crate) fn wanders(&self) -> bool {
        const ENDS: [f64; 2] = [0.01, std::f64::consts::PI];
        let Form::Covariance(c, theta) = &self.form else {
            return false;
        };
        let at = Frequencies::at(ENDS.to_vec());
        let density = c.density(theta, &at);
        self.is_process() && density.first() > density.last()
    }

    /// The peak that it is, where it stands at one frequency.
    pub(crate) fn peak(&self) -> Option<Peak> {
        match &self.form {
            Form::Covariance(c, theta) => c.peak(theta),
            _ => None,
        }
    }

    /// Whether it is a noise, or a tone that wanders, at one frequency.
    pub(crate) fn is_band(&self) -> bool {
        self.peak().is_some()
    }

    /// Whether it is told with another band that it is a part of.
    pub(crate) fn is_part(&self) -> bool {
        self.cluster.is_some_and(|c| c.place > 0)
    }

    /// Whether it is a filter that the white noise goes through.
    pub(crate) fn is_filter(&self) -> bool {
        matches!(&self.form, Form::Covariance(c, _) if c.filters_white())
    }

    /// Whether it stands for a spectrum of no kind: what follows any smooth one, and is not what its name claims.
    pub(crate) fn is_any_spectrum(&self) -> bool {
        matches!(&self.form, Form::Covariance(c, theta) if c.filters_white() && !c.claims(theta))
    }

    pub(crate) fn is_covariance(&self) -> bool {
        matches!(self.form, Form::Covariance(..))
    }

    /// Whether the noise that it is, if it is one, is Gaussian.
    pub(crate) fn is_normal(&self) -> bool {
        !matches!(&self.form, Form::Covariance(c, _) if !c.is_normal())
    }

    /// The lag at which it makes readings correlate, samples, and by how much, where it is noise that comes again.
    pub(crate) fn lag(&self) -> Option<(usize, f64)> {
        match &self.form {
            Form::Covariance(c, theta) => c.lag(theta),
            _ => None,
        }
    }

    /// Whether it is what follows recorded channels as no effect of the library does.
    pub(crate) fn is_combination(&self) -> bool {
        self.has_no_name() && !self.is_covariance()
    }

    pub(crate) fn has_no_name(&self) -> bool {
        self.effect.id() == ID
    }

    /// Whether it has the freedom to stand for several terms of the library.
    pub(crate) fn may_swallow(&self) -> bool {
        self.is_covariance() || self.has_no_name()
    }
}

/// Structure that was seen and that no single effect explains.
#[derive(Clone, Debug)]
pub struct Note {
    /// What is seen.
    pub what: String,
    /// Lowest and highest angular frequency, rad per sample, of each place that it has; none where it has no such place.
    pub at: Vec<(f64, f64)>,
    /// Whether the terms of the model hold it, and nothing is left.
    pub held: bool,
}

impl Worded for Note {
    fn text(&mut self) -> &mut String {
        &mut self.what
    }
}

/// A model of a channel.
#[derive(Clone)]
pub struct State {
    /// Terms.
    pub terms: Vec<Term>,
    /// Noise shape, the covariance terms in it.
    pub noise: Noise,
    /// Its fit.
    pub solution: Solution,
    /// Structure that was seen and that no single effect explains.
    pub notes: Vec<Note>,
    /// The level of a process that is not Gaussian, where one was named: sample by sample.
    pub level: Option<Arc<Vec<f64>>>,
    /// The one power law that explains as much as the processes.
    pub power_law: Option<PowerLawFound>,
    /// How much wider lost readings make the errors of the noise: of the white variance, the random walk, the coordinates of
    /// the terms; none where they are few.
    pub wider: Vec<f64>,
}

impl State {
    /// Whether all of its noise is Gaussian.
    pub(crate) fn is_normal(&self) -> bool {
        self.terms.iter().all(Term::is_normal)
    }

    /// The noise without all processes and bands.
    pub(crate) fn noise_beside_processes(&self) -> Noise {
        let mut noise = self.noise.clone();
        let mut filters = (self.terms.iter())
            .filter(|t| t.is_covariance())
            .map(Term::is_filter);
        noise.terms.retain(|_| filters.next().unwrap_or(false));
        noise
    }

    /// The noise without what the level stands for where it is known sample by sample.
    pub(crate) fn noise_beside_level(&self) -> Noise {
        let mut noise = self.noise.clone();
        if self.level.is_some() {
            let processes = self.terms.iter().filter(|t| t.is_covariance());
            let mut stated = processes.map(|t| t.stated.is_some());
            noise.terms.retain(|_| !stated.next().unwrap_or(false));
        }
        noise
    }

    /// All columns in use, term by term.
    #[must_use]
    pub fn columns(&self) -> Vec<usize> {
        self.terms
            .iter()
            .flat_map(|t| t.columns.iter().copied())
            .collect()
    }

    /// Every term with the coefficients of its columns.
    pub(crate) fn parts(&self) -> impl Iterator<Item = (&Term, &[f64])> {
        let mut rest = self.solution.beta.as_slice();
        self.terms.iter().map(move |t| {
            let (own, others) = rest.split_at(t.columns.len());
            rest = others;
            (t, own)
        })
    }

    /// Angular frequencies of the lines, with the places of their columns.
    pub(crate) fn lines(&self) -> Vec<(f64, usize)> {
        let mut at = 0;
        let mut all = vec![];
        for t in &self.terms {
            if let Form::Line(omega) | Form::SideBands(omega, _) = t.form {
                all.push((omega, at));
            }
            at += t.columns.len();
        }
        all
    }

    /// Angular frequency of the first line, and phase p of its cos(w t + p).
    pub(crate) fn carrier(&self) -> Option<(f64, f64)> {
        self.parts().find_map(|(t, own)| match (&t.form, own) {
            (Form::Line(omega), [c, s, ..]) => Some((*omega, (-s).atan2(*c))),
            _ => None,
        })
    }
}

/// The one power law that explains a state without what is named in it.
#[derive(Clone, Copy, Debug)]
pub struct PowerLawFound {
    /// Exponent gamma.
    pub exponent: f64,
    /// Whether it stands for a filter of the white noise as well.
    pub filter: bool,
}

/// What the noise of a channel is, at the law's zero where it follows one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Levels {
    /// White variance of a reading.
    pub white: f64,
    /// Standard error of its logarithm.
    pub white_error: f64,
    /// ln of the random walk's step variance over the white variance.
    pub log_walk: f64,
    /// Standard error of ln K.
    pub walk_error: f64,
}

/// The estimate of everything on a channel together, under a law of the variance.
#[derive(Clone, Debug)]
pub(crate) struct Joint {
    /// Noise.
    pub levels: Levels,
    /// Coefficient of each law with its standard error.
    pub laws: Vec<(f64, f64)>,
    /// What was found for each term.
    pub found: Vec<Found>,
    /// Innovations over their standard deviation, NaN where nothing was read.
    pub innovations: Vec<f64>,
}

impl Joint {
    /// Lets the intervals of the laws and of the white noise reach as far as those of another law that the record does not tell
    /// from this one: which of the two it is makes most of the error.
    pub fn reach(&mut self, other: &Self) {
        let wider = |(own, error): (f64, f64), (value, others): (f64, f64)| {
            error.max(others + (value - own).abs() / TWO_SIDED)
        };
        for (own, other) in self.laws.iter_mut().zip(&other.laws) {
            own.1 = wider(*own, *other);
        }
        let white = |levels: &Levels| (levels.white.ln(), levels.white_error);
        self.levels.white_error = wider(white(&self.levels), white(&other.levels));
    }
}

/// Whitened coefficients, and the same in time: independent N(0, 1) under the model. A level that is known sample by
/// sample is taken off.
#[must_use]
pub fn whitened(panel: &Panel, state: &State) -> (Vec<f64>, Vec<f64>) {
    let Some(level) = &state.level else {
        return whitened_by_spectrum(panel, state);
    };
    let columns = state.columns();
    // What the process took of the random walk is the walk's again.
    let (r, noise, white) = panel.without(level, || {
        let (noise, solution) = panel.fit(&state.noise_beside_level(), &columns);
        (residual(panel, &columns, &solution), noise, solution.white)
    });
    by_model(panel, &r, &noise, white)
}

/// The same with every process as its spectrum alone.
#[must_use]
pub fn whitened_by_spectrum(panel: &Panel, state: &State) -> (Vec<f64>, Vec<f64>) {
    let r = residual(panel, &state.columns(), &state.solution);
    by_model(panel, &r, &state.noise, state.solution.white)
}

pub(crate) fn by_model(
    panel: &Panel,
    r: &[f64],
    noise: &Noise,
    white: f64,
) -> (Vec<f64>, Vec<f64>) {
    let g = noise.everywhere(&panel.bins);
    let u: Vec<f64> = r
        .iter()
        .zip(&g)
        .map(|(r, g)| r / (white * g).sqrt())
        .collect();
    let mut e = panel.dct.inverse(&u);
    let settled = (DIED_AWAY * noise.settles(&panel.bins)) as usize;
    if settled == 0 {
        return (u, e);
    }
    let middle = e.len() / 2;
    let (head, tail) = e.split_at_mut(middle);
    calm(&mut head[..settled.min(middle)]);
    let late = tail.len().saturating_sub(settled);
    calm(&mut tail[late..]);
    (panel.dct.forward(&e), e)
}

/// Times within which what rings has died away: a part of e^-3 is left.
const DIED_AWAY: f64 = 3.0;
/// Readings of which the size is told at once, and the rms from which on they ring: four standard errors beyond that of noise.
const TOLD_AT_ONCE: usize = 64;
const RINGS: f64 = 1.35;

/// What rings at an end of the record for what is not known beyond it, no larger than the noise.
fn calm(end: &mut [f64]) {
    for some in end.chunks_mut(TOLD_AT_ONCE) {
        let square = some.iter().map(|e| e * e).sum::<f64>() / some.len() as f64;
        let rms = square.sqrt();
        if rms > RINGS {
            some.iter_mut().for_each(|e| *e /= rms);
        }
    }
}
