//! How much of what a signal or a spectrum adds to the likelihood the closest effect of the library describes. From 95 % on
//! it would not be foreign.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use diagnosis::likelihood::{Bins, Dct};
use model::effect::{Column, Covariance, Effect, Hypothesis, Peak, Signal, View};
use model::effects::EFFECTS;
use model::record::{Axis, Base};
use numerics::minimise::nelder_mead;

use crate::series::{add_at, each, each_pair, one_if};
use crate::stand::{GYROS, LSB, Stand};
use crate::strength::Meter;

/// Share of the gain from which an effect of the library describes it.
pub(super) const DESCRIBED: f64 = 0.95;

/// The signals of a stand, as an effect sees them, without reading noise.
fn signals(stand: &Stand) -> Vec<Signal> {
    let seen = stand.witness().channels.into_iter();
    seen.map(|c| Signal {
        name: c.name,
        quantity: c.quantity,
        axis: c.axis,
        unit: c.unit,
        smooth: c.values.clone().into(),
        values: c.values.into(),
        lsb: None,
        moving: false,
    })
    .collect()
}

pub(super) fn hypotheses(effect: &dyn Effect, stand: &Stand, axis: usize) -> Vec<Hypothesis> {
    let all = signals(stand);
    let view = View {
        channel: GYROS[axis],
        axis: Some(Axis::ALL[axis]),
        lsb: Some(LSB),
        white_sigma: stand.white(axis).sqrt(),
        neighbours_sigma: stand.white(axis).sqrt(),
        rate_hz: stand.rate_hz,
        samples: stand.samples(),
        base: Some(Base::Static),
        moving: false,
        signals: &all,
    };
    effect.hypotheses(&view).unwrap_or_default()
}

/// Columns of an effect's regressions. What is at most a part of another comes with it, nothing of it or all that it may be
/// either way.
fn within_bounds(effect: &dyn Effect, all: &[Column]) -> Vec<Vec<Vec<f64>>> {
    let (parts, whole): (Vec<&Column>, Vec<&Column>) = all
        .iter()
        .partition(|c| effect.at_most(c.parameter).is_some());
    let signs: &[f64] = match parts.is_empty() {
        true => &[0.0],
        false => &[-1.0, 0.0, 1.0],
    };
    let with = |c: &Column, sign: f64| {
        let mut values = c.values.clone();
        for p in &parts {
            if let Some((_, most)) = effect.at_most(p.parameter).filter(|a| a.0 == c.parameter) {
                add_at(&mut values, 0, each(&p.values, |p| sign * most * p));
            }
        }
        values
    };
    let set = |sign: &f64| whole.iter().map(|c| with(c, *sign)).collect();
    signs.iter().map(set).collect()
}

/// Sets of columns by which an effect could describe a signal: all its regressions together, each with each value of a
/// shape, and every step.
fn columns(effect: &dyn Effect, stand: &Stand, axis: usize) -> Vec<Vec<Vec<f64>>> {
    let (mut regressions, mut shaped, mut sets) = (vec![], vec![], vec![]);
    for h in hypotheses(effect, stand, axis) {
        match h {
            Hypothesis::Regression(r) => regressions.extend(r.columns),
            Hypothesis::Shaped(s) => {
                let values = |columns: Vec<Column>| columns.into_iter().map(|c| c.values);
                let at = |x: f64| values(s.columns(x)).collect::<Vec<_>>();
                shaped.extend(s.grid().into_iter().map(at));
            }
            Hypothesis::Step => {
                let step = |at: usize| vec![stand.series(|i| one_if(i >= at))];
                sets.extend((40..stand.samples()).step_by(40).map(step));
            }
            _ => {}
        }
    }
    for fixed in within_bounds(effect, &regressions) {
        let with = |s: &Vec<_>| [fixed.clone(), s.clone()].concat();
        sets.extend(shaped.iter().map(with));
        if !fixed.is_empty() {
            sets.push(fixed);
        }
    }
    sets
}

/// Share of a signal's gain that the strongest line takes, and a line with two neighbours wherever they lie, of which one
/// that swings is a case.
fn of_lines(stand: &Stand, axis: usize, signal: &[f64]) -> (f64, f64) {
    let meter = Meter::new(stand, axis);
    let whole = meter.of_signal(&meter.energy(signal)).powi(2);
    let mut rest = signal.to_vec();
    let mut taken = vec![];
    for _ in 0..3 {
        rest = meter.beyond(&rest, &strongest_line(stand, axis, &rest));
        taken.push(1.0 - meter.of_signal(&meter.energy(&rest)).powi(2) / whole);
    }
    (taken[0], taken[2])
}

/// The line, as two columns, that takes most of a signal.
fn strongest_line(stand: &Stand, axis: usize, signal: &[f64]) -> [Vec<f64>; 2] {
    let (n, meter) = (stand.samples(), Meter::new(stand, axis));
    let c = Dct::new(n).forward(signal);
    let weight = |k: usize| {
        let w = PI * k as f64 / n as f64;
        c[k] * c[k] / (stand.white(axis) + stand.step(axis) / (2.0 - 2.0 * w.cos()))
    };
    let mut order: Vec<usize> = (2..n).collect();
    order.sort_by(|a, b| weight(*b).total_cmp(&weight(*a)));
    let near = |k: &usize| [-0.5, 0.0, 0.5].map(|d| PI * (*k as f64 + d) / n as f64);
    let line = |w: f64| {
        let at = |phase: f64| stand.series(|i| (w * i as f64 + phase).cos());
        [0.0, TAU / 4.0].map(at)
    };
    let left = |line: &[Vec<f64>; 2]| meter.of_signal(&meter.energy(&meter.beyond(signal, line)));
    let lines = order.iter().take(6).flat_map(near).map(line);
    let best = lines.min_by(|a, b| left(a).total_cmp(&left(b)));
    best.expect("there are tries")
}

/// What an expected spectrum is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// A noise.
    Noise,
    /// A signal: a mode that noise drives may have its spectrum, and has another envelope. No peak is placed in it.
    Signal,
}

/// Most coordinates that a simplex finds its way in: filters of more are the sharper ones of a family.
const MOST_COORDINATES: usize = 6;

/// Share of the gain of an expected spectrum that the best process of an effect describes, random walk and white noise
/// refitted.
pub(super) fn of_process(
    stand: &Stand,
    axis: usize,
    expected: &[f64],
    effect: &dyn Effect,
    kind: Kind,
) -> f64 {
    let meter = Meter::new(stand, axis);
    let (bins, count) = (meter.bins(), meter.counts());
    let walk = each(meter.omega(), |w| 1.0 / (2.0 - 2.0 * w.cos()));
    let n: f64 = count.iter().sum();
    let minus_two_l = |lambda: f64, density: &dyn Fn(usize) -> f64| {
        let (mut sum, mut logs) = (0.0, 0.0);
        for b in 0..count.len() {
            let g = (density(b) + lambda * walk[b]).max(1e-9);
            sum += expected[b] / g;
            logs += count[b] * g.ln();
        }
        n * (sum / n).ln() + logs + n
    };
    let baseline = (-30..=6)
        .map(|k| minus_two_l(f64::from(k).exp(), &|_| 1.0))
        .fold(minus_two_l(0.0, &|_| 1.0), f64::min);
    let mut best = baseline;
    for h in hypotheses(effect, stand, axis) {
        let Hypothesis::Covariance(process) = h else {
            continue;
        };
        if process.dimensions() > MOST_COORDINATES {
            continue;
        }
        let starts = if process.is_peak() && kind == Kind::Noise {
            placed(&process, expected, count, bins)
        } else {
            let starts = process.starts(stand.samples()).into_iter();
            starts.map(|s| (Arc::clone(&process), s)).collect()
        };
        for (process, start) in starts {
            let bounds = process.bounds(stand.samples());
            let white = one_if(!process.filters_white());
            let value = |x: &[f64]| {
                let inside = |(v, (low, high)): (&f64, &(f64, f64))| v.clamp(*low, *high);
                let theta: Vec<f64> = x[1..].iter().zip(&bounds).map(inside).collect();
                let density = process.density(&theta, &bins.at);
                minus_two_l(x[0].min(6.0).exp(), &|b| white + density[b])
            };
            for log_walk in [-16.0, -8.0] {
                let from = [vec![log_walk], start.clone()].concat();
                let steps = vec![1.0; from.len()];
                let once = nelder_mead(&value, &from, &steps, 300);
                let found = nelder_mead(&value, &once, &steps, 300);
                // A shape that its name does not mean is not told by it.
                if process.claims(&found[1..]) {
                    best = best.min(value(&found));
                }
            }
        }
    }
    let under_itself = each_pair(expected, count, |e, m| m * (1.0 + (e / m).ln()));
    (baseline - best) / (baseline - under_itself.iter().sum::<f64>())
}

/// A peak with each place that its search starts from: where the expected spectrum is highest, narrow and wide, and of each of its
/// shapes.
fn placed(
    process: &Arc<dyn Covariance>,
    expected: &[f64],
    count: &[f64],
    bins: &Bins,
) -> Vec<(Arc<dyn Covariance>, Vec<f64>)> {
    let slowest = bins.at.omega.iter().position(|w| *w > 0.02).unwrap_or(0);
    let height = |b: &usize| expected[*b] / count[*b];
    let highest = (slowest..count.len()).max_by(|a, b| height(a).total_cmp(&height(b)));
    let Some(at) = highest else { return vec![] };
    let widths = [0.003, 0.03, 0.1];
    let located = widths.into_iter().filter_map(|half_width| {
        process.about(&Peak {
            omega: bins.at.omega[at],
            half_width,
            variance: (height(&at) * half_width).max(1e-4),
        })
    });
    located
        .flat_map(|(of, start)| {
            let shapes = [vec![Arc::clone(&of)], of.variants()].concat();
            shapes.into_iter().map(move |shape| (shape, start.clone()))
        })
        .collect()
}

/// The spectrum that a channel has with this energy beside its noise, by bin.
fn with_noise(meter: &Meter, energy: &[f64]) -> Vec<f64> {
    each_pair(&meter.noise(), energy, |n, e| n + e)
}

/// The largest share of a signal's gain that each effect of the library describes.
pub(super) fn of_all(stand: &Stand, axis: usize, signal: &[f64]) -> Vec<(&'static str, f64)> {
    let meter = Meter::new(stand, axis);
    let whole = meter.of_signal(&meter.energy(signal)).powi(2);
    let expected = with_noise(&meter, &meter.energy(signal));
    let described = |set: &Vec<Vec<f64>>| {
        let left = meter.energy(&meter.beyond(signal, set));
        1.0 - meter.of_signal(&left).powi(2) / whole
    };
    let most = |effect: &&dyn Effect| {
        let process = of_process(stand, axis, &expected, *effect, Kind::Signal);
        let sets = columns(*effect, stand, axis);
        let most = sets.iter().map(described).fold(process, f64::max);
        (effect.id(), most)
    };
    let mut all: Vec<_> = EFFECTS.iter().map(most).collect();
    let (line, swinging) = of_lines(stand, axis, signal);
    all.extend([("line", line), ("am_line", swinging)]);
    all
}

/// Each effect of the library with each set of columns that it can be.
fn all_columns(stand: &Stand, axis: usize) -> Vec<(&'static str, Vec<Vec<f64>>)> {
    let of = |effect: &&'static dyn Effect| {
        let (id, sets) = (effect.id(), columns(*effect, stand, axis));
        sets.into_iter().map(move |set| (id, set))
    };
    EFFECTS.iter().flat_map(of).collect()
}

/// Of an effect with bounds one set is all that it can be: two of them would be beyond these.
fn is_bounded(id: &str) -> bool {
    let of = EFFECTS.iter().find(|e| e.id() == id);
    of.is_some_and(|e| e.parameters().iter().any(|p| e.at_most(p.name).is_some()))
}

/// Two effects of the library against a signal, with the share of its gain that both describe: the best and the best process for
/// what is left beside it, then the best and the best beside it.
pub(super) fn of_two(stand: &Stand, axis: usize, signal: &[f64]) -> Vec<(String, f64)> {
    let meter = Meter::new(stand, axis);
    let gain = |s: &[f64]| meter.of_signal(&meter.energy(s)).powi(2);
    let whole = gain(signal);
    let sets = all_columns(stand, axis);
    let (mut taken, mut names, mut pairs) = (vec![], vec![], vec![]);
    let mut rest = signal.to_vec();
    for turn in 0..2 {
        // A line, and one that swings: a line with two beside it.
        let mut lines = vec![];
        let mut own = vec![];
        for _ in 0..3 {
            let left = meter.beyond(&rest, &lines);
            lines.extend(strongest_line(stand, axis, &left));
            own.push(("line", lines.clone()));
        }
        let with = |set: &[Vec<f64>]| meter.beyond(signal, &[taken.as_slice(), set].concat());
        let (id, best) = sets
            .iter()
            .chain([&own[0], &own[2]])
            .filter(|(id, _)| !(names.contains(id) && is_bounded(id)))
            .min_by(|a, b| gain(&with(&a.1)).total_cmp(&gain(&with(&b.1))))
            .expect("the library has regressions");
        rest = with(best);
        taken.extend(best.clone());
        names.push(*id);
        if turn == 0 {
            // Beside the first a process may take more than a second regression.
            let expected = with_noise(&meter, &meter.energy(&rest));
            let (id, process) = best_process(stand, axis, &expected, Kind::Signal);
            let share = 1.0 - gain(&rest) / whole * (1.0 - process);
            pairs.push((format!("{} and {id}", names[0]), share));
        }
    }
    pairs.push((names.join(" and "), 1.0 - gain(&rest) / whole));
    pairs
}

/// The process of the library that describes most of an expected spectrum, with the share of its gain.
pub(super) fn best_process(
    stand: &Stand,
    axis: usize,
    expected: &[f64],
    kind: Kind,
) -> (&'static str, f64) {
    let of = |e: &&'static dyn Effect| (e.id(), of_process(stand, axis, expected, *e, kind));
    let best = EFFECTS.iter().map(of).max_by(|a, b| a.1.total_cmp(&b.1));
    best.expect("the library has processes")
}
