//! The law of the codes: what their histogram is under a smooth law of the readings and one fault of the converter.
//!
//! A reading before the fault is normal with the spread s about a level that is anywhere: its codes x have the chances
//! p(x) = sum over k of w_k [Phi((x + 1/2 - m_k) / s) - Phi((x - 1/2 - m_k) / s)]
//! with levels m_k half an s apart and weights w_k >= 0 that are whatever fits best. Any noise that is no finer than s, with
//! tails heavy or light, about a level that wanders or not, is such a law: it needs no model of the record. What it cannot
//! have are edges and holes finer than s, and those are what a fault of the converter makes. The fault moves a share f
//! of the readings from x to a(x): q(c) = (1 - f) p(c) + f sum over a(x) = c of p(x). Weights and share are fitted by
//! expectation and maximization; the likelihood is that of the histogram.

mod histogram;

use std::rc::Rc;

use super::cells::Cells;
pub(super) use histogram::Histogram;
use histogram::{BY_SPREAD, Levels};
use numerics::column::dot;
use numerics::exp_ln::{logarithms, powers};
use numerics::wide;

/// Most levels of a law: a record that moves far has a spread of its levels too.
const MOST_LEVELS: f64 = 400.0;
/// Chance of a code that no level reaches.
const LEAST: f64 = 1e-10;
/// Share of the weights that a fit begins with everywhere.
const EVERYWHERE: f64 = 0.03;
/// Exponent of a step: a fixed point of steps of 1 is one of longer steps, reached sooner.
const STEP: f64 = 1.7;
/// Nats in eight steps at which a fit has ended.
const ENDED: f64 = 0.02;
/// Rounds after which fits from several starts are compared, and the difference of shares and weights at which they have met:
/// from there they would go the same way.
const MEET: [usize; 3] = [1, 8, 24];
const MET: f64 = 1e-9;
/// Nats that a law wider than the spread of a reading has to gain for each e-fold of it: levels that are only there to
/// bend the law are as many parameters.
const COST: f64 = 50.0;

/// What a converter does to a code.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Fault {
    /// Nothing.
    None,
    /// A bit takes a value.
    Bit { bit: u32, value: i32 },
    /// Codes end at rails.
    Rails { low: i32, high: i32 },
    /// Readings were rounded before, to other steps: no code moves, and the law is that of other cells.
    Twice(Cells),
}

impl Fault {
    fn of(self, x: i32) -> i32 {
        match self {
            Self::None | Self::Twice(_) => x,
            Self::Bit { bit, value } => (x & !(1 << bit)) | (value << bit),
            Self::Rails { low, high } => x.clamp(low, high),
        }
    }

    /// The farthest that it moves a code, where it is known.
    fn moves(self) -> i32 {
        match self {
            Self::Bit { bit, .. } => 1 << bit,
            Self::None | Self::Rails { .. } | Self::Twice(_) => 0,
        }
    }
}

/// A law that was fitted.
#[derive(Clone, Debug)]
pub(super) struct Fit {
    /// Spread of a reading about its level, counts.
    pub spread: f64,
    /// Share of the readings that the fault takes.
    pub share: f64,
    /// Nats.
    pub likelihood: f64,
    /// Nats that its levels cost.
    pub cost: f64,
    weights: Vec<f64>,
}

impl Fit {
    /// Likelihood less the cost of the levels.
    pub(super) fn score(&self) -> f64 {
        self.likelihood - self.cost
    }
}

/// A fit on its way, before the round that is next.
pub(super) struct Course {
    weights: Vec<f64>,
    share: f64,
    held: bool,
    step: f64,
    round: usize,
    /// Log likelihood of the round before, and of the last eighth one.
    likelihood: f64,
    before: f64,
    /// The fit, where further rounds would not change it.
    ended: Option<Fit>,
}

impl Course {
    /// Whether two of one round are at the same place.
    fn has_met(&self, other: &Self) -> bool {
        let near = |a: f64, b: f64| (a - b).abs() <= MET;
        let mut weights = self.weights.iter().zip(&other.weights);
        self.round == other.round
            && near(self.share, other.share)
            && weights.all(|(a, b)| near(*a, *b))
    }
}

/// Codes and levels of the laws of one spread.
pub(super) struct Laws<'a> {
    of: &'a Histogram,
    fault: Fault,
    spread: f64,
    /// Codes from `first` on, with their occurrences.
    first: i32,
    times: Vec<f64>,
    /// Where the fault takes each code.
    to: Vec<usize>,
    levels: Rc<Levels>,
    /// Where a fit begins, off the mean of the codes.
    pub shift: f64,
}

wide! {
    fn fitted[](laws: &Laws<'_>, course: &mut Course, rounds: usize) -> Fit = Laws::fitted
}

impl<'a> Laws<'a> {
    pub(super) fn new(of: &'a Histogram, fault: Fault, spread: f64) -> Self {
        let beyond = match fault {
            Fault::Rails { .. } => (4.0 * of.spread) as i32,
            _ => fault.moves(),
        } + (2.0 * spread) as i32;
        let (first, last) = (of.first - beyond, of.last() + beyond);
        let codes = (last - first) as usize + 1;
        let spread = spread.max(BY_SPREAD * codes as f64 / MOST_LEVELS);
        let mut times = vec![0.0; codes];
        for (c, t) in of.iter() {
            times[(c - first) as usize] = t;
        }
        let to = (first..=last)
            .map(|x| (fault.of(x).clamp(first, last) - first) as usize)
            .collect();
        let cells = match fault {
            Fault::Twice(cells) => cells,
            _ => Cells::ONE_ROUNDING,
        };
        Self {
            of,
            fault,
            spread,
            first,
            times,
            to,
            levels: of.levels(first, codes, spread, cells),
            shift: 0.0,
        }
    }

    #[inline(always)]
    fn sound(&self, weights: &[f64]) -> Vec<f64> {
        let mut p = vec![LEAST; self.times.len()];
        for (w, (at, chances)) in weights
            .iter()
            .zip(&self.levels.chances)
            .filter(|(w, _)| **w > 0.0)
        {
            // A closure would be made without the instructions of the function around it.
            for (p, c) in p[*at..].iter_mut().zip(chances) {
                *p += w * c;
            }
        }
        p
    }

    /// Where the fault takes the codes.
    #[inline(always)]
    fn taken(&self, p: &[f64]) -> Vec<f64> {
        let mut taken = vec![0.0; p.len()];
        self.to.iter().zip(p).for_each(|(to, p)| taken[*to] += p);
        taken
    }

    /// Log likelihood under (1 - f) p + f taken.
    #[inline(always)]
    fn likelihood(&self, p: &[f64], taken: &[f64], share: f64) -> f64 {
        let mut logs: Vec<f64> = (p.iter().zip(taken))
            .map(|(p, a)| ((1.0 - share) * p + share * a).max(LEAST))
            .collect();
        logarithms(&mut logs);
        dot(&self.times, &logs)
    }

    /// The best share for given chances: the likelihood is concave in it.
    #[inline(always)]
    fn best_share(&self, p: &[f64], taken: &[f64], mut share: f64) -> f64 {
        for _ in 0..2 {
            let (mut slope, mut bend) = (0.0, 0.0);
            for (t, (p, a)) in self.times.iter().zip(p.iter().zip(taken)) {
                if *t > 0.0 {
                    let d = (a - p) / ((1.0 - share) * p + share * a).max(LEAST);
                    slope += t * d;
                    bend += t * d * d;
                }
            }
            share = (share + slope / bend.max(1e-9)).clamp(0.0, 1.0);
        }
        share
    }

    /// Nats that another fault gains with the best share, the chances before it as they were fitted: no more than it
    /// gains when they are fitted too.
    pub(super) fn gain_of(&self, fit: &Fit, fault: Fault) -> f64 {
        let p = self.sound(&fit.weights);
        let end = p.len() as i32 - 1;
        let mut taken = vec![0.0; p.len()];
        for (x, p) in (self.first..).zip(&p) {
            taken[(fault.of(x) - self.first).clamp(0, end) as usize] += p;
        }
        let share = self.best_share(&p, &taken, 0.0);
        self.likelihood(&p, &taken, share) - self.likelihood(&p, &taken, 0.0)
    }

    /// Weights of a normal law with the mean and the spread of the codes, and a few everywhere.
    fn start(&self) -> Vec<f64> {
        let wide = (self.of.spread.powi(2) - self.spread.powi(2))
            .max((0.3 * self.spread).powi(2))
            .sqrt();
        let bell: Vec<f64> = self
            .levels
            .at
            .iter()
            .map(|m| (-0.5 * ((m - self.of.mean - self.shift) / wide).powi(2)).exp())
            .collect();
        let all: f64 = bell.iter().sum::<f64>().max(1e-300);
        let even = EVERYWHERE / bell.len() as f64;
        bell.iter()
            .map(|b| (1.0 - EVERYWHERE) * b / all + even)
            .collect()
    }

    /// A fit that begins with a share, from weights of its own or those of another fit; `held` keeps the share as it is.
    pub(super) fn begin(&self, from: Option<&Fit>, share: f64, held: bool) -> Course {
        let known = from.filter(|f| f.weights.len() == self.levels.at.len());
        Course {
            weights: known.map_or_else(|| self.start(), |f| f.weights.clone()),
            share: match self.fault {
                Fault::None | Fault::Twice(_) => 0.0,
                Fault::Bit { .. } | Fault::Rails { .. } => share,
            },
            held: held || !matches!(self.fault, Fault::Bit { .. }),
            step: STEP,
            round: 0,
            likelihood: f64::NEG_INFINITY,
            before: f64::NEG_INFINITY,
            ended: None,
        }
    }

    /// Fit of at most so many rounds from a start.
    pub(super) fn fit(&self, from: Option<&Fit>, share: f64, held: bool, rounds: usize) -> Fit {
        self.go_on(&mut self.begin(from, share, held), rounds)
    }

    /// Fits of at most so many rounds, those behind them included. Of those that meet on their way one goes on.
    pub(super) fn go_on_together(&self, courses: &mut Vec<Course>, rounds: usize) -> Vec<Fit> {
        for stop in MEET.into_iter().filter(|stop| *stop < rounds) {
            for i in (1..courses.len()).rev() {
                let (one, others) = courses.split_at_mut(i);
                let (one, other) = (&mut one[0], &mut others[0]);
                if one.round.max(other.round) <= stop {
                    self.go_on(one, stop);
                    self.go_on(other, stop);
                    if one.has_met(other) {
                        courses.remove(i);
                    }
                }
            }
        }
        let all = courses.iter_mut();
        all.map(|c| self.go_on(c, rounds)).collect()
    }

    /// Go on with a fit, up to so many rounds in all.
    fn go_on(&self, course: &mut Course, rounds: usize) -> Fit {
        fitted(self, course, rounds)
    }

    #[inline(always)]
    fn fitted(&self, course: &mut Course, rounds: usize) -> Fit {
        if let Some(fit) = &course.ended {
            return fit.clone();
        }
        let mut gains = vec![0.0; course.weights.len()];
        loop {
            let p = self.sound(&course.weights);
            let taken = self.taken(&p);
            let share = if course.held {
                course.share
            } else {
                self.best_share(&p, &taken, course.share)
            };
            let l = self.likelihood(&p, &taken, share);
            let eighth = course.round % 8 == 7;
            let ended = eighth && l - course.before < ENDED;
            if course.round >= rounds || ended {
                let fit = Fit {
                    spread: self.spread,
                    share,
                    likelihood: l,
                    cost: self.cost(&course.weights),
                    weights: course.weights.clone(),
                };
                course.ended = ended.then(|| fit.clone());
                return fit;
            }
            if eighth {
                course.before = l;
            }
            if l < course.likelihood {
                course.step = 1.0;
            }
            course.likelihood = l;
            course.share = share;
            course.round += 1;
            self.reweigh(course, &p, &taken, &mut gains);
        }
    }

    /// Weights times what each level gains, to the power of the step.
    #[inline(always)]
    fn reweigh(&self, course: &mut Course, p: &[f64], taken: &[f64], gains: &mut [f64]) {
        let (weights, share) = (&mut course.weights, course.share);
        let ratio: Vec<f64> = self
            .times
            .iter()
            .zip(p.iter().zip(taken))
            .map(|(t, (p, a))| t / ((1.0 - share) * p + share * a).max(LEAST))
            .collect();
        let back: Vec<f64> = ratio
            .iter()
            .zip(&self.to)
            .map(|(r, to)| (1.0 - share) * r + share * ratio[*to])
            .collect();
        for ((gain, w), (at, chances)) in gains
            .iter_mut()
            .zip(weights.iter())
            .zip(&self.levels.chances)
        {
            *gain = 0.0;
            if *w >= 1e-12 {
                *gain = dot(&back[*at..][..chances.len()], chances) / self.of.n;
            }
        }
        powers(gains, course.step);
        let mut all = 0.0;
        for (w, gain) in weights.iter_mut().zip(gains) {
            *w = if *w < 1e-12 { 0.0 } else { *w * *gain };
            all += *w;
        }
        weights.iter_mut().for_each(|w| *w /= all);
    }

    /// What the levels cost, by how much wider than a reading's spread they make the law.
    fn cost(&self, weights: &[f64]) -> f64 {
        let about = |f: &dyn Fn(f64) -> f64| -> f64 {
            weights
                .iter()
                .zip(&self.levels.at)
                .map(|(w, m)| w * f(*m))
                .sum()
        };
        let mean = about(&|m| m);
        let variance = about(&|m| (m - mean).powi(2));
        let wider = (1.0 + variance / self.spread.powi(2)).sqrt();
        COST * wider.ln()
    }

    /// Standard error of the share, by the bend of the likelihood when the weights follow.
    pub(super) fn share_error(&self, top: &Fit) -> f64 {
        const H: f64 = 0.01;
        const ROUNDS: usize = 40;
        let at = |f: f64| self.fit(Some(top), f, true, ROUNDS).likelihood;
        let (below, above) = ((top.share - H).max(0.0), (top.share + H).min(1.0));
        let bend = (2.0 * top.likelihood - at(below) - at(above)) / ((above - below) / 2.0).powi(2);
        if bend > 0.0 { bend.sqrt().recip() } else { H }
    }

    /// Expected occurrences of the codes from the first one of the histogram on.
    pub(super) fn expected(&self, fit: &Fit) -> Vec<f64> {
        let p = self.sound(&fit.weights);
        let taken = self.taken(&p);
        let at = (self.of.first - self.first) as usize;
        (at..at + self.of.times.len())
            .map(|i| self.of.n * ((1.0 - fit.share) * p[i] + fit.share * taken[i]))
            .collect()
    }
}
