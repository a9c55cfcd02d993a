//! Contests between whole explanations: two levels against what looks like a stationary process or a chain of steps.
//!
//! Both sides are weighed on the same block means: the Gaussian model by its exact likelihood, the two-level one (with
//! white noise and a random walk of the level) by a bank of Kalman filters, one for each level, merged by moments.

mod dwell_times;
mod level;
mod plain;
mod steps;

use std::f64::consts::TAU;
use std::sync::Arc;

use model::effect::{Covariance, Effect, Hypothesis};

use crate::fit::channel::{Form, Note, State, Term, by_model};
use crate::fit::likelihood::{Bins, Dct, Noise, Panel, Solution, least_walk};
use crate::fit::scan::{self, residual};
use crate::fit::threshold;
use crate::search::Search;
use crate::test_level::{CLAIM_LEVEL, CheckId, Outcome};
pub use crate::two_level::fit::two_level;
use crate::two_level::fit::{Coordinates, again, coordinates, fitted, many_ahead};
use crate::two_level::of_blocks::OfBlocks;
use crate::two_level::sides::{Side, Sides};
use numerics::tails::normal_tail;

/// Nats by which two levels have to be better.
const MARGIN: f64 = 4.0;
/// Switches that two levels make at least, where steps explain them too.
const LEAST_SWITCHES: f64 = 3.0;
/// Nats within which the answer stays open.
const OPEN: f64 = 3.0;
/// Longest block of a short record, s, and most blocks.
const BLOCK_S: f64 = 0.2;
const MOST_BLOCKS: usize = 6000;
/// How much longer a block is behind a filter of a pole up to 0.7 from sample to sample: it leaves neighbours of such
/// blocks a correlation of a tenth.
const BEHIND_A_FILTER: f64 = 4.0;
/// Fewest blocks on which both sides are weighed.
const LEAST_BLOCKS: usize = 200;
/// Blocks of a coarse look.
const COARSE_BLOCKS: usize = 400;
/// Most blocks of a correlation time, where a record holds more blocks than that.
const BLOCKS_OF_A_TIME: f64 = 10.0;
/// Stationary terms with their coordinates.
type Processes = Vec<(Arc<dyn Covariance>, Vec<f64>)>;

/// The AR(1)-like term of the library: stationary, two coordinates, no filter.
fn stationary(search: &Search<'_>) -> Option<(usize, &'static dyn Effect, Arc<dyn Covariance>)> {
    search
        .candidates
        .iter()
        .enumerate()
        .find_map(|(i, c)| match &c.hypothesis {
            Hypothesis::Covariance(p) if p.dimensions() == 2 && !p.filters_white() => {
                Some((i, c.effect, Arc::clone(p)))
            }
            _ => None,
        })
}

/// Means of at most `count` blocks.
fn means(y: &[f64], length: usize, count: usize) -> Vec<f64> {
    let mean = |c: &[f64]| c.iter().sum::<f64>() / length as f64;
    y.chunks_exact(length).take(count).map(mean).collect()
}

/// Share of each of `count` blocks that lies behind time `at`, samples; the blocks start at `first`.
fn after(count: usize, first: usize, length: usize, at: f64) -> Vec<f64> {
    let behind = |i: usize| (first + (i + 1) * length) as f64 - at;
    let share = |i: usize| (behind(i) / length as f64).clamp(0.0, 1.0);
    (0..count).map(share).collect()
}

/// Whether two levels may stand behind what the search left to the random walk, by a coarse look.
fn looks_two_level(search: &Search<'_>, state: &State) -> bool {
    let n = search.panel.bins.n;
    if search.view.moving || search.view.sways() {
        return false;
    }
    let length = n.div_ceil(COARSE_BLOCKS);
    let r = residual(&search.panel, &state.columns(), &state.solution);
    let blocks = means(&search.panel.dct.inverse(&r), length, COARSE_BLOCKS);
    let m = blocks.len();
    if m < COARSE_BLOCKS / 2 {
        return false;
    }
    let panel = Panel::new(&Dct::new(m), &Arc::new(Bins::new(m)), &blocks);
    let (noise, walk) = panel.fit(&Noise::new(-9.0), &[]);
    // A level that never moves does not switch.
    if noise.log_walk <= least_walk(m) {
        return false;
    }
    let variance = blocks.iter().map(|v| v * v).sum::<f64>() / m as f64;
    let white = (state.solution.white / length as f64).min(variance);
    let excess = (variance - white).max(0.05 * white);
    let (two, _) = fitted(&blocks, white, excess, &[(0.9, 10.0), (0.7, 40.0)], 100);
    let gaussian = walk.log_likelihood - 0.5 * (m - 1) as f64 * (1.0 + TAU.ln());
    let gaussian = gaussian + of_a_stretch(&panel, &[], (&noise, &walk));
    two - gaussian > MARGIN
}

/// Whether two levels may stand in the place of a term: a process that wanders, or a step.
fn contested(t: &Term) -> bool {
    t.wanders() || is_step(t)
}

fn is_step(t: &Term) -> bool {
    matches!(t.form, Form::Step(..))
}

/// What two levels compete with in a state.
struct Contest {
    /// Steps.
    steps: usize,
    /// Whether there is a process.
    wandering: bool,
}

impl Contest {
    fn of(state: &State) -> Self {
        let terms = || state.terms.iter();
        Self {
            steps: terms().filter(|t| is_step(t)).count(),
            wandering: terms().any(|t| contested(t) && !is_step(t)),
        }
    }

    /// Whether what was found is reason enough to ask.
    fn is_on(&self) -> bool {
        self.wandering || self.steps >= 2
    }
}

/// Let two levels compete with the stationary terms and steps of a state.
#[must_use]
pub fn hold(search: &Search<'_>, state: State) -> State {
    let mut candidates = search.candidates.iter().enumerate();
    let Some((at, candidate)) =
        candidates.find(|(_, c)| matches!(c.hypothesis, Hypothesis::TwoLevel))
    else {
        return state;
    };
    let contest = Contest::of(&state);
    // The data without the terms that are not contested.
    let kept = state.terms.iter().filter(|t| !contested(t));
    let kept: Vec<Term> = kept.cloned().collect();
    let process = stationary(search).map(|(_, _, process)| process);
    if let Some(plain) = plain::hold(search, &state, &kept, (at, candidate.effect), process) {
        return plain;
    }
    let asked = contest.is_on()
        || looks_two_level(search, &search.refit(kept.clone(), state.noise.log_walk));
    if !asked {
        return state;
    }
    let Some(rival) = rival_of(search, &state, kept, (at, candidate.effect)) else {
        return state;
    };
    let Some(field) = Field::new(search, &state, &rival, &contest) else {
        return state;
    };
    // Gaussian side: the better of what was found and the AR(1)-like term, steps as columns.
    let panel = field.panel();
    let columns = field.columns_of_steps(&panel, &state);
    let like_one = gaussian(&panel, field.processes(&rival), &[]);
    let found = gaussian(&panel, field.processes(&state), &columns);
    // Each step costs its time and its height.
    let m = field.blocks.len() as f64;
    let theirs = like_one.0.max(found.0 - contest.steps as f64 * m.ln());
    let (two, x) = field.two_levels(&state);
    let ahead = two - theirs;
    // A step or two are no noise that switches, whatever wanders beside them.
    if contest.steps > 0 && m < 1.001 * LEAST_SWITCHES * x[3].exp() {
        return state;
    }
    if !contest.is_on() && 2.0 * ahead < threshold::two_level() {
        return state;
    }
    let other = if contest.wandering { found } else { like_one };
    if ahead > MARGIN {
        return field.settled(rival, ahead, (two, x), other);
    }
    let mut state = state;
    if contest.wandering {
        let z = field.cox(two, &x, other, Side::Gaussian);
        let claim = levels_claim(z, Side::Gaussian);
        for t in state.terms.iter_mut().filter(|t| contested(t)) {
            t.claims.push(claim.clone());
        }
    }
    if ahead.abs() <= OPEN {
        for t in state.terms.iter_mut().filter(|t| contested(t)) {
            t.alternatives.push((candidate.effect, ahead));
        }
    }
    state
}

/// The state with one AR(1)-like term in the place of all that is contested.
fn rival_of(
    search: &Search<'_>,
    state: &State,
    kept: Vec<Term>,
    (at, effect): (usize, &'static dyn Effect),
) -> Option<State> {
    let (_, _, process) = stationary(search)?;
    let mut theirs = kept;
    let longest = 100f64.min(search.panel.bins.n as f64 / 60.0);
    let limits = state.terms.iter().filter(|t| contested(t));
    theirs.push(Term::new(
        effect,
        at,
        Form::Covariance(process, vec![-3.0, longest.max(2.0).ln()]),
        limits
            .map(|t| t.threshold)
            .fold(threshold::two_level(), f64::min),
    ));
    Some(search.refit(theirs, state.noise.log_walk))
}

/// The log likelihood of blocks under stationary terms and columns, the noise there and its white variance.
fn gaussian(panel: &Panel, terms: Processes, columns: &[usize]) -> (f64, Noise, f64) {
    let noise = Noise {
        log_walk: -9.0,
        terms,
    };
    let (noise, solution) = panel.fit(&noise, columns);
    let count = (panel.bins.n - 1) as f64;
    let l = solution.log_likelihood - 0.5 * count * (1.0 + TAU.ln());
    let l = l + of_a_stretch(panel, columns, (&noise, &solution));
    (l, noise, solution.white)
}

/// Nats that noise gains by being much louder for a while: to levels it is what it is not to a noise that is the same throughout.
fn of_a_stretch(panel: &Panel, columns: &[usize], (noise, solution): (&Noise, &Solution)) -> f64 {
    let r = residual(panel, columns, solution);
    let (_, e) = by_model(panel, &r, noise, solution.white);
    scan::of_a_stretch(&e)
}

/// Samples of a block. A process that is fast for a long record is weighed on a stretch of it, in blocks that still show it;
/// what a filter makes of neighbours is to be gone from block to block.
fn block_length(search: &Search<'_>, state: &State, rival: &State, contest: &Contest) -> usize {
    let longer = if state.terms.iter().any(Term::is_filter) {
        BEHIND_A_FILTER
    } else {
        1.0
    };
    let shortest = ((longer * BLOCK_S * search.view.rate_hz) as usize).max(1);
    let time_of = |s: &State| {
        s.noise
            .terms
            .last()
            .map_or(0.0, |(_, theta)| theta[1].exp())
    };
    // What a step beside it adds to its spectrum is none of its own.
    let time = if contest.wandering && contest.steps > 0 {
        let beside = state.terms.iter().filter(|t| is_step(t)).cloned();
        let terms = rival.terms.iter().cloned().chain(beside).collect();
        time_of(&search.refit(terms, state.noise.log_walk))
    } else {
        time_of(rival)
    };
    let n = search.panel.bins.n;
    n.div_ceil(MOST_BLOCKS)
        .min((time / BLOCKS_OF_A_TIME) as usize)
        .max(shortest)
}

/// What both sides are weighed on.
struct Field<'a> {
    search: &'a Search<'a>,
    /// Samples of a block, and where the first one begins.
    length: usize,
    first: usize,
    /// What the terms that are not contested leave, by sample, and its means over blocks.
    rest: Vec<f64>,
    blocks: Vec<f64>,
    dct: Dct,
    bins: Arc<Bins>,
}

/// Two levels fitted, with what they are held against.
struct LevelFit {
    /// Log likelihood and coordinates.
    two: f64,
    x: Coordinates,
    /// The claim that they switch at random.
    switches: Option<Outcome>,
    /// Log likelihood, noise and white variance of the Gaussian side.
    other: (f64, Noise, f64),
}

impl LevelFit {
    fn at_random(&self) -> bool {
        let claim = self.switches.as_ref();
        !claim.is_some_and(|s| s.p_value < CLAIM_LEVEL)
    }
}

impl<'a> Field<'a> {
    /// None of too few blocks.
    fn new(
        search: &'a Search<'a>,
        state: &State,
        rival: &State,
        contest: &Contest,
    ) -> Option<Self> {
        let r = residual(&search.panel, &rival.columns(), &rival.solution);
        let rest = search.panel.dct.inverse(&r);
        let length = block_length(search, state, rival, contest);
        let first = search.panel.bins.n.saturating_sub(MOST_BLOCKS * length) / 2;
        let blocks = means(&rest[first..], length, MOST_BLOCKS);
        let m = blocks.len();
        (m >= LEAST_BLOCKS).then(|| Self {
            search,
            length,
            first,
            rest,
            blocks,
            dct: Dct::new(m),
            bins: Arc::new(Bins::new(m)),
        })
    }

    fn panel(&self) -> Panel {
        Panel::new(&self.dct, &self.bins, &self.blocks)
    }

    /// The steps of a state as columns: the block that holds one reads a mean of both levels.
    fn columns_of_steps(&self, panel: &Panel, state: &State) -> Vec<usize> {
        let steps = state.terms.iter().filter_map(|t| match t.form {
            Form::Step(s, _) => Some(after(self.blocks.len(), self.first, self.length, s)),
            _ => None,
        });
        steps.map(|column| panel.add(&column)).collect()
    }

    /// The processes of a state that wander, as the blocks show them.
    fn processes(&self, state: &State) -> Processes {
        let of = |t: &Term| match &t.form {
            Form::Covariance(c, theta) if t.wanders() => {
                let (process, length) = (Arc::clone(c), self.length);
                let means: Arc<dyn Covariance> = Arc::new(OfBlocks { process, length });
                Some((means, theta.clone()))
            }
            _ => None,
        };
        state.terms.iter().filter_map(of).collect()
    }

    /// Log likelihood of two levels at its highest, and their coordinates there.
    fn two_levels(&self, state: &State) -> (f64, Coordinates) {
        let m = self.blocks.len() as f64;
        let variance = self.blocks.iter().map(|v| v * v).sum::<f64>() / m;
        let white = (state.solution.white / self.length as f64).min(variance);
        let excess = (variance - white).max(0.05 * white);
        let starts = [(1.0, 15.0), (0.8, 60.0), (0.6, 200.0)];
        fitted(&self.blocks, white, excess, &starts, 160)
    }

    /// Standard errors by which the lead of two levels differs from what `truth` would make it.
    fn cox(
        &self,
        two: f64,
        x: &Coordinates,
        (l, noise, white): (f64, Noise, f64),
        truth: Side,
    ) -> f64 {
        let sides = Sides {
            dct: &self.dct,
            bins: &self.bins,
            noise,
            white,
            two: *x,
        };
        sides.cox(two - l, truth)
    }

    /// The state in which two levels stand for what was contested; `ahead` nats of the Gaussian side.
    fn settled(
        mut self,
        rival: State,
        ahead: f64,
        (two, x): (f64, Coordinates),
        other: (f64, Noise, f64),
    ) -> State {
        let mut settled = rival;
        let mut term = settled.terms.len() - 1;
        let mut fit = LevelFit {
            two,
            x,
            switches: dwell_times::at_random(&self.blocks, &x, self.block_s()),
            other,
        };
        if self.shortened(&mut fit.x) {
            fit = self.again(&settled, &fit.x);
        }
        // What switches by a clock has no steps beside it: its own are surprises to levels that switch at random.
        if fit.at_random() {
            let before = settled.terms.len();
            settled = steps::beside(self.search, settled, &mut self.rest, self.length, &fit.x);
            if settled.terms.len() > before {
                fit = self.again(&settled, &fit.x);
            }
        }
        settled.level = self.level(&settled, &fit.x).map(Arc::new);
        let level = settled.level.clone().filter(|_| fit.at_random());
        if let Some(more) = level.and_then(|l| level::beside(self.search, &settled, term, &l)) {
            (settled, term, self.rest) = (more.state, more.term, more.rest);
            fit = self.again(&settled, &fit.x);
            settled.level = self.level(&settled, &fit.x).map(Arc::new);
        }
        self.give_spectrum(&mut settled, term, &fit.x);
        if many_ahead(&self.blocks, &fit.x) > MARGIN {
            settled.notes.push(Note {
                what: "jumps between more than two levels".into(),
                at: vec![],
                held: false,
            });
        }
        let stated = self.stated(&fit.x, self.block_s());
        if let Some(t) = settled.terms.get_mut(term) {
            t.stated = Some(stated);
            t.lr = 2.0 * (ahead - MARGIN) + t.threshold;
            let z = self.cox(fit.two, &fit.x, fit.other, Side::TwoLevels);
            t.claims.push(levels_claim(z, Side::TwoLevels));
            t.claims.extend(fit.switches);
        }
        settled
    }

    /// Seconds of a block.
    fn block_s(&self) -> f64 {
        self.length as f64 / self.search.view.rate_hz
    }

    /// Both sides weighed again on what a state leaves, from where the levels were.
    fn again(&mut self, state: &State, x: &Coordinates) -> LevelFit {
        self.blocks = means(&self.rest[self.first..], self.length, MOST_BLOCKS);
        let (two, x) = again(&self.blocks, x);
        LevelFit {
            two,
            x,
            switches: dwell_times::at_random(&self.blocks, &x, self.block_s()),
            other: gaussian(&self.panel(), self.processes(state), &[]),
        }
    }

    /// Half height and dwell time, s, with their standard errors.
    fn stated(&self, x: &Coordinates, block_s: f64) -> Vec<(f64, f64)> {
        let m = self.blocks.len() as f64;
        let (x, errors) = coordinates(&self.blocks, x, self.length == 1);
        // ln of the half height is x2 + x0 / 2.
        let least = (-2.0 * x[2]).exp() / m;
        let half_error = (errors[2][2] + errors[0][2] + 0.25 * errors[0][0])
            .max(least)
            .sqrt();
        // Where the likelihood hardly bends, the switches that were seen still bound it.
        let seen = m * (-x[3]).exp();
        let dwell_error = errors[3][3].max(1.0 / seen.max(1.0)).sqrt();
        let half = (x[2] + 0.5 * x[0]).exp();
        let dwell = x[3].exp() * block_s;
        vec![(half, half * half_error), (dwell, dwell * dwell_error)]
    }
}

/// The claim of a contest of levels: `z` standard errors from what the lead of two levels is for what was named. Readings that
/// keep to two levels even better than replicates do, whose switches come in the middle of a block too, speak for two levels.
pub(crate) fn levels_claim(z: f64, named: Side) -> Outcome {
    let more = if z > 0.0 { "more" } else { "less" };
    let (name, against) = match named {
        Side::Gaussian => ("a Gaussian process", true),
        Side::TwoLevels => ("two levels", z < 0.0),
    };
    Outcome {
        id: CheckId::ProcessLevels,
        about: vec![],
        statistic: z,
        p_value: if against { normal_tail(z) } else { 1.0 },
        what: format!(
            "told as {name}, it lies {more} about two levels than one does, in standard errors"
        ),
    }
}
