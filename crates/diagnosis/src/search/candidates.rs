//! The hypotheses of a channel: those of the effects, and what is of none of them.

use std::sync::Arc;

use model::effect::{Effect, Hypothesis, Shape, VarianceLaw, View};
use model::effects::EFFECTS;
use model::record::Quantity;

use crate::features::{self, echo};
use crate::fit::channel::{self, RIVAL_SPAN};
use crate::fit::likelihood::{Panel, digest};
use crate::test_level::worded;

/// A hypothesis under test.
pub struct Candidate {
    /// Its effect.
    pub effect: &'static dyn Effect,
    /// The hypothesis.
    pub hypothesis: Hypothesis,
    /// Names of the recorded channels that a regression follows.
    pub(super) of: Vec<String>,
    pub(super) columns: Vec<usize>,
    pub(super) grid: Vec<(f64, Vec<usize>)>,
    pub(super) siblings: usize,
    /// What it has to reach beyond its threshold.
    pub(super) handicap: f64,
}

impl Candidate {
    /// Columns of the panel that a regression uses.
    #[must_use]
    pub fn columns(&self) -> &[usize] {
        &self.columns
    }

    /// A shape's coordinates that are tried first, with the columns there.
    pub(crate) fn grid(&self) -> &[(f64, Vec<usize>)] {
        &self.grid
    }

    /// How many hypotheses its effect offers.
    pub(crate) fn siblings(&self) -> usize {
        self.siblings
    }

    /// Whether what it makes is of no effect of the library.
    pub(crate) fn is_nameless(&self) -> bool {
        self.effect.id() == channel::ID
    }

    /// The same, and those of a shape at every point of its grid.
    pub(crate) fn all_columns(&self) -> impl Iterator<Item = usize> {
        let grid = self.grid.iter().flat_map(|(_, columns)| columns);
        self.columns.iter().chain(grid).copied()
    }
}

/// Names of the recorded channels that a hypothesis of the library follows: it lists them.
fn channels_of(hypothesis: &Hypothesis) -> Vec<String> {
    let follows = match hypothesis {
        Hypothesis::Regression(r) => r.follows.as_deref(),
        Hypothesis::Shaped(s) => s.follows(),
        _ => None,
    };
    let names = follows.into_iter().flat_map(|f| f.split(", "));
    names.map(str::to_owned).collect()
}

/// Why a course of time is not sought in bursts.
const IN_BURSTS: &str =
    "the record comes in bursts, and says nothing of the time between: record in one piece";

/// Whether bursts laid end to end tell of it: what follows a recorded channel, what is faster than a burst, and what axes
/// or counts have. Courses of time and tones break off at every burst, and a slow process has no time of its own.
fn told_by_bursts(hypothesis: &Hypothesis, samples: usize) -> bool {
    match hypothesis {
        Hypothesis::Regression(r) => r.follows.is_some(),
        Hypothesis::Covariance(c) => {
            let start = c.starts(samples).into_iter().next();
            !c.is_peak() && start.is_some_and(|s| c.poles(&s, samples).is_none())
        }
        Hypothesis::Variance(law) => matches!(law, VarianceLaw::Shape { .. }),
        Hypothesis::Shaped(_)
        | Hypothesis::Step
        | Hypothesis::Line
        | Hypothesis::SideBands
        | Hypothesis::TwoLevel
        | Hypothesis::WanderingTone
        | Hypothesis::Motion
        | Hypothesis::Blow => false,
        Hypothesis::Common | Hypothesis::Correlation | Hypothesis::Scale | Hypothesis::Audit => {
            true
        }
    }
}

/// What cannot be tested, with the reason.
type NotTested = Vec<(&'static str, String)>;

/// All hypotheses of a channel, with their columns in the panel, and what cannot be tested; of one in `bursts` that are laid end to
/// end those that such a record can tell of.
pub(super) fn all(panel: &Panel, view: &View<'_>, bursts: bool) -> (Vec<Candidate>, NotTested) {
    let (mut all, not_tested) = of_library(panel, view, bursts);
    all.extend(combinations(panel, view));
    if !bursts {
        all.push(nameless(
            Hypothesis::Covariance(Arc::new(echo::Sought)),
            vec![],
            vec![],
            1,
        ));
    }
    (all, not_tested)
}

/// Whether channels are the thermometer of this axis, which is no column of another one.
fn own(view: &View<'_>, of: &[String]) -> bool {
    let mut thermometers = view
        .signals
        .iter()
        .filter(|s| s.quantity == Quantity::Temp && s.axis.is_some());
    thermometers.any(|s| of.contains(&s.name))
}

/// Those of the effects.
fn of_library(panel: &Panel, view: &View<'_>, bursts: bool) -> (Vec<Candidate>, NotTested) {
    let (mut candidates, mut not_tested) = (vec![], vec![]);
    for effect in EFFECTS {
        let mut hypotheses = match effect.hypotheses(view) {
            Err(why) => {
                not_tested.push((effect.id(), why));
                continue;
            }
            Ok(hypotheses) => hypotheses,
        };
        if bursts {
            hypotheses.retain(|h| told_by_bursts(h, view.samples));
            if hypotheses.is_empty() {
                not_tested.push((effect.id(), IN_BURSTS.to_owned()));
                continue;
            }
        }
        // What is weaker for a parameter more has the chance of all; what is without it keeps its own.
        let whole = |h: &Hypothesis| matches!(h, Hypothesis::Shaped(s) if s.whole());
        let all = hypotheses.len();
        let plain = all - hypotheses.iter().filter(|h| whole(h)).count();
        for mut hypothesis in hypotheses {
            let of = channels_of(&hypothesis);
            let common = !own(view, &of);
            let siblings = if whole(&hypothesis) { all } else { plain };
            let columns = match &mut hypothesis {
                // The panel has them now.
                Hypothesis::Regression(r) => {
                    let columns = r.columns.iter_mut();
                    let values = columns.map(|c| std::mem::take(&mut c.values));
                    panel.add_candidate(&values.collect::<Vec<_>>(), common)
                }
                // The channels of a record are asked for the same ones.
                Hypothesis::Variance(VarianceLaw::Shape { shape, .. }) => {
                    let own = std::mem::take(shape);
                    *shape = panel.dct.known.same(digest(&own), own);
                    vec![]
                }
                _ => vec![],
            };
            let grid = match &hypothesis {
                Hypothesis::Shaped(s) => on_grid(panel, s.as_ref(), common),
                _ => vec![],
            };
            candidates.push(Candidate {
                effect: *effect,
                hypothesis,
                of,
                columns,
                grid,
                siblings,
                handicap: 0.0,
            });
        }
    }
    (candidates, not_tested)
}

/// The columns of a shape at every point of its grid.
fn on_grid(panel: &Panel, shape: &dyn Shape, common: bool) -> Vec<(f64, Vec<usize>)> {
    let at = |at: f64| {
        let columns = shape.columns(at).into_iter().map(|c| c.values);
        let columns: Vec<Vec<f64>> = columns.collect();
        (at, panel.add_candidate(&columns, common))
    };
    shape.grid().into_iter().map(at).collect()
}

/// Combinations of the recorded channels that no effect is made of.
fn combinations(panel: &Panel, view: &View<'_>) -> Vec<Candidate> {
    let unknown = features::combinations(view);
    let siblings = unknown.len();
    let each = unknown.into_iter().map(|mut combination| {
        combination.what = worded(combination.what);
        let of = combination.channels.clone();
        let columns = panel.add_named(&combination.what, !own(view, &of), &combination.columns);
        nameless(combination.hypothesis(columns.len()), of, columns, siblings)
    });
    each.collect()
}

/// What has no name: a cause of the library that does as well goes before it.
fn nameless(
    hypothesis: Hypothesis,
    of: Vec<String>,
    columns: Vec<usize>,
    siblings: usize,
) -> Candidate {
    Candidate {
        effect: &features::EFFECT,
        hypothesis,
        of,
        columns,
        grid: vec![],
        siblings,
        handicap: RIVAL_SPAN,
    }
}
