//! The smallest size of each cause that a record would have shown.
//!
//! A cause of size s is found 95 times in 100 where the likelihood ratio that is expected of it, d'², takes its square
//! root 1.645 sigma beyond that of the threshold of its search. What is expected is that of the record's own noise and
//! excitation, with the white variance and the random walk fitted again without the cause: what a random walk can hide
//! does not count. A cause with more than one parameter has its limit where the others are as [`DetectionLimit::at`]
//! says.

use std::f64::consts::TAU;
use std::sync::Arc;

use model::effect::{Covariance, Found, Hypothesis, Regression, Shape, VarianceLaw};
use model::effects::EFFECTS;
use model::record::Quantity;

use crate::criticise::shock;
use crate::fit::channel::Form;
use crate::fit::likelihood::{Noise, Panel, least_walk};
use crate::fit::{channel, scan, threshold};
use crate::ingest::base_turns::MOTION_RMS;
use crate::ingest::blows;
use crate::result::{DetectionLimit, Finding, limit};
use crate::search::Candidate;
use crate::search::searched::Searched;
use numerics::column::dot;
use numerics::log_product::sum_of_logs;
use numerics::minimise::{peak, size_for};
use numerics::tails::ONE_SIDED;

/// Random walks that are tried without the cause, from none to that of this logarithm of the ratio to white.
const WALKS: usize = 64;
const MOST_WALK: f64 = 4.0;
/// Share of a strength that is near enough: between the random walks that are tried it is interpolated.
const NEARLY: f64 = 0.98;
/// Share of the energy of a column beyond others below which they span it: the normal equations lose as many digits, and a
/// limit a thousand times as large is no size of anything.
const SPANNED: f64 = 1e-6;
/// Of a line: its frequency over the sample rate. The limit is that of white noise wherever that is white.
const LINE: f64 = 0.25;
/// Of two levels: stays in the record.
const STAYS: f64 = 60.0;
/// ln of their variance over white, lowest and highest.
const SPREAD: (f64, f64) = (-16.0, 6.0);
/// Of noise that changes: where the stretch begins and ends, as shares of the record.
const STRETCH: (f64, f64) = (0.4, 0.6);

/// d' from which on a statistic passes its threshold 95 times in 100.
pub(crate) fn strength_for(threshold: f64) -> f64 {
    threshold.sqrt() + ONE_SIDED
}

/// A random walk that is tried without the cause.
struct Walk {
    /// ln of its step variance over the white variance.
    log: f64,
    /// 1/g over the bins.
    weight: Vec<f64>,
    /// Sum of ln g.
    logs: f64,
    /// Sum of the expected energies over g, where there is no cause.
    clean: f64,
}

/// Measures strengths on one channel.
struct Meter<'a> {
    panel: &'a Panel,
    white: f64,
    /// Coefficients in each bin, and all.
    count: &'a [f64],
    n: f64,
    /// Shape of the noise as it was fitted.
    g: Vec<f64>,
    walks: Vec<Walk>,
}

impl<'a> Meter<'a> {
    fn new(panel: &'a Panel, noise: &Noise, white: f64) -> Self {
        let count = panel.bins.counts();
        let g = noise.over(&panel.bins);
        let low = least_walk(panel.bins.n);
        let with = noise.with_walks(&panel.bins);
        let walk = |i: usize| {
            let log_walk = low + (MOST_WALK - low) * i as f64 / (WALKS - 1) as f64;
            let tried = with(log_walk);
            Walk {
                log: log_walk,
                logs: sum_of_logs(count, &tried),
                clean: (tried.iter().zip(count))
                    .zip(&g)
                    .map(|((tried, m), g)| m * white * g / tried)
                    .sum(),
                weight: tried.iter().map(|g| 1.0 / g).collect(),
            }
        };
        Self {
            walks: (0..WALKS).map(walk).collect(),
            n: count.iter().sum(),
            panel,
            white,
            count,
            g,
        }
    }

    /// d' of what is expected to have these sums of energies over the g of each random walk, where the truth has these
    /// variances over white.
    fn strength(&self, sums: impl Iterator<Item = f64>, truth: &[f64]) -> f64 {
        let truth = self.n * self.white.ln() + sum_of_logs(self.count, truth);
        let without = self.walks.iter().zip(sums).map(|(walk, sum)| {
            let minus_two_l = self.n * (sum / self.n).ln() + walk.logs;
            (walk.log, -minus_two_l)
        });
        let best = peak(&without.collect::<Vec<_>>());
        (-best - truth).max(0.0).sqrt()
    }

    /// Size of a signal with these energies at size 1.
    fn signal(&self, energy: &[f64], wanted: f64) -> Option<f64> {
        let over = |weight: &[f64]| dot(energy, weight);
        let of_signal: Vec<f64> = self.walks.iter().map(|w| over(&w.weight)).collect();
        let inverse: Vec<f64> = self.g.iter().map(|g| 1.0 / g).collect();
        // With the random walk as it is: less is never enough.
        let least = wanted * (self.white / over(&inverse)).sqrt();
        let strength = |ratio: f64| {
            let square = (ratio * least).powi(2);
            let sums = self.walks.iter().zip(&of_signal);
            self.strength(sums.map(|(w, s)| w.clean + square * s), &self.g)
        };
        let ratio = size_for(wanted, &strength);
        // Where a random walk takes it at any size there is no limit.
        (least.is_finite() && strength(ratio) > NEARLY * wanted).then_some(ratio * least)
    }

    /// What is left of a column beyond others: its size; none where they span it.
    fn column(&self, others: &[usize], column: usize, wanted: f64) -> Option<f64> {
        let beyond = |others: &[usize]| self.panel.energy_beyond(&self.g, others, column);
        let all = |energy: &[f64]| energy.iter().sum::<f64>();
        let left = beyond(others);
        (all(&left) > SPANNED * all(&beyond(&[]))).then(|| self.signal(&left, wanted))?
    }

    /// The same for values that are no column yet.
    fn values(&self, others: &[usize], values: &[f64], wanted: f64) -> Option<f64> {
        let width = self.panel.width();
        let size = self.column(others, self.panel.add(values), wanted);
        self.panel.truncate(width);
        size
    }

    /// First coordinate, within its bounds, at which a shape of the noise is as strong as wanted.
    fn shape(&self, bounds: (f64, f64), wanted: f64, at: &dyn Fn(f64) -> Vec<f64>) -> Option<f64> {
        let strength = |x: f64| {
            let truth = at(x);
            let energy: Vec<f64> = truth
                .iter()
                .zip(self.count)
                .map(|(g, m)| self.white * g * m)
                .collect();
            let sums = self.walks.iter().map(|w| dot(&energy, &w.weight));
            self.strength(sums, &truth)
        };
        let (mut low, mut high) = bounds;
        if strength(high) < wanted {
            return None;
        }
        const HALVINGS: usize = 16;
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if strength(middle) < wanted {
                low = middle;
            } else {
                high = middle;
            }
        }
        Some(high)
    }
}

/// d' of a variance that changes in time: how many samples have which ratio to that at rest.
fn of_variance(law: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (mut n, mut sum, mut logs) = (0.0, 0.0, 0.0);
    for (count, ratio) in law {
        n += count;
        sum += count * ratio;
        logs += count * ratio.ln();
    }
    (n * (sum / n).ln() - logs).max(0.0).sqrt()
}

/// A size that would have been found.
#[derive(Default)]
struct Smallest {
    /// As an effect describes it, without standard errors.
    coefficients: Vec<f64>,
    location: Vec<f64>,
    names: Vec<&'static str>,
    fixed: Vec<(&'static str, f64, &'static str)>,
    /// The parameter that has the limit, and those at which it holds.
    parameter: &'static str,
    at: Vec<&'static str>,
}

/// Limits of one channel, for every cause that its search weighs and has not found.
pub(crate) fn of_channel(s: &Searched<'_>) -> Vec<DetectionLimit> {
    if s.target.moving {
        return vec![];
    }
    let meter = Meter::new(&s.search.panel, &s.state.noise, s.state.solution.white);
    let mut all: Vec<DetectionLimit> = vec![];
    for c in &s.search.candidates {
        let id = c.effect.id();
        if id == channel::ID || s.state.terms.iter().any(|t| t.effect.id() == id) {
            continue;
        }
        let Some(smallest) = smallest(s, &meter, c) else {
            continue;
        };
        let exactly = |values: &[f64]| values.iter().map(|v| (*v, 0.0)).collect();
        let described = c.effect.describe(&Found {
            unit: s.target.unit.clone(),
            rate_hz: s.search.view.rate_hz,
            white_sigma: meter.white.sqrt(),
            names: smallest.names,
            coefficients: exactly(&smallest.coefficients),
            fixed: smallest.fixed,
            location: exactly(&smallest.location),
        });
        let listed = |l: &DetectionLimit| l.cause == id && l.parameter == smallest.parameter;
        // Of several shapes that estimate one parameter, the first is the effect's own.
        if !all.iter().any(listed) {
            let (parameter, at) = (smallest.parameter, smallest.at);
            all.extend(limit(id, &s.target.name, &described, parameter, &at));
        }
    }
    all
}

/// The smallest size of one hypothesis; `None` where there is none, or where those say it that look for it.
fn smallest(s: &Searched<'_>, meter: &Meter<'_>, c: &Candidate) -> Option<Smallest> {
    let first = c.effect.parameters().first()?.name;
    match &c.hypothesis {
        Hypothesis::Regression(r) => of_regression(s, meter, c, r),
        // The limit of the same at once says it.
        Hypothesis::Shaped(shape) if shape.whole() => None,
        Hypothesis::Shaped(shape) => of_shape(s, meter, c, shape.as_ref()),
        Hypothesis::Step => of_step(s, meter),
        Hypothesis::Line => Some(of_line(s, meter)),
        Hypothesis::SideBands => Some(of_side_bands(s, meter)),
        // The smallest filter is told by those whose size is free: a mean of two readings is large.
        Hypothesis::Covariance(process) if !process.grid().is_empty() => None,
        Hypothesis::Covariance(process) => of_process(s, meter, c, process),
        Hypothesis::TwoLevel => of_two_levels(s, meter),
        Hypothesis::Variance(law) => Some(of_variance_law(s, first, law)),
        Hypothesis::Motion => (s.target.unit == "deg/s").then(|| Smallest {
            // Of a sway.
            coefficients: vec![MOTION_RMS * 2f64.sqrt()],
            parameter: "peak",
            ..Smallest::default()
        }),
        Hypothesis::Blow => of_blow(s),
        Hypothesis::WanderingTone
        | Hypothesis::Common
        | Hypothesis::Correlation
        | Hypothesis::Scale
        | Hypothesis::Audit => None,
    }
}

/// Of a half sine of this length, s, that one channel feels.
fn of_blow(s: &Searched<'_>) -> Option<Smallest> {
    const LENGTH_S: f64 = 0.25;
    let channels = s.search.view.all(Quantity::Gyro).count().max(1);
    let least = blows::least(threshold::false_alarm(), s.search.panel.bins.n, 1, channels);
    let peak = shock::peak_of(s, LENGTH_S, strength_for(*least.first()?))?;
    Some(Smallest {
        coefficients: vec![peak],
        location: vec![0.0, LENGTH_S],
        parameter: "peak",
        at: vec!["duration"],
        ..Smallest::default()
    })
}

/// Of the last column of a regression.
fn of_regression(
    s: &Searched<'_>,
    meter: &Meter<'_>,
    c: &Candidate,
    r: &Regression,
) -> Option<Smallest> {
    let own = s.state.columns();
    let (column, rest) = c.columns().split_last()?;
    let parameter = r.columns.last()?.parameter;
    let wanted = strength_for(threshold::regression(1, c.siblings()));
    let size = meter.column(&[own.as_slice(), rest].concat(), *column, wanted)?;
    Some(Smallest {
        coefficients: vec![size],
        names: vec![parameter],
        fixed: r.fixed.clone(),
        parameter,
        at: r.fixed.iter().map(|f| f.0).collect(),
        ..Smallest::default()
    })
}

/// Of a shape at the middle of its grid.
fn of_shape(
    s: &Searched<'_>,
    meter: &Meter<'_>,
    c: &Candidate,
    shape: &dyn Shape,
) -> Option<Smallest> {
    let own = s.state.columns();
    let (place, columns) = c.grid().get(c.grid().len() / 2)?;
    let parameter = shape.columns(*place).first()?.parameter;
    let (first, rest) = columns.split_first()?;
    let wanted = strength_for(c.limit_of_shape(columns.len()));
    let size = meter.column(&[own.as_slice(), rest].concat(), *first, wanted)?;
    Some(Smallest {
        coefficients: vec![size],
        location: vec![shape.told(*place)],
        names: vec![parameter],
        parameter,
        at: vec![shape.coordinate().0],
        ..Smallest::default()
    })
}

/// Of a step in the middle of the record.
fn of_step(s: &Searched<'_>, meter: &Meter<'_>) -> Option<Smallest> {
    let n = s.search.panel.bins.n;
    let rate_hz = s.search.view.rate_hz;
    let own = s.state.columns();
    let jump: Vec<f64> = (0..n).map(|i| f64::from(u8::from(i >= n / 2))).collect();
    Some(Smallest {
        coefficients: vec![meter.values(&own, &jump, strength_for(threshold::step(n)))?],
        location: vec![(n / 2) as f64 / rate_hz],
        parameter: "height",
        at: vec!["time"],
        ..Smallest::default()
    })
}

/// Of a line wherever the noise is white.
fn of_line(s: &Searched<'_>, meter: &Meter<'_>) -> Smallest {
    let n = s.search.panel.bins.n;
    let rate_hz = s.search.view.rate_hz;
    // n/2 of the square of the amplitude, at one frequency: no random walk takes it.
    let variance = meter.white * s.state.noise.at(TAU * LINE);
    let size = strength_for(threshold::line(n)) * (2.0 * variance / n as f64).sqrt();
    Smallest {
        coefficients: vec![size, 0.0],
        location: vec![LINE * rate_hz],
        parameter: "amplitude",
        at: vec!["frequency"],
        ..Smallest::default()
    }
}

/// Of the swing of the line that was found, or of one that would swing by all of itself.
fn of_side_bands(s: &Searched<'_>, meter: &Meter<'_>) -> Smallest {
    let n = s.search.panel.bins.n;
    let rate_hz = s.search.view.rate_hz;
    let line = s.state.parts().find_map(|(t, own)| match (&t.form, own) {
        (Form::Line(omega), [c, s, ..]) => Some((*omega, c.hypot(*s))),
        _ => None,
    });
    let omega = line.map_or(TAU * LINE, |l| l.0);
    let wanted = strength_for(threshold::side_bands(s.search.slow_beats()));
    // The swing holds n/4 of the square of amplitude times depth.
    let variance = meter.white * s.state.noise.at(omega);
    let swing = wanted * (4.0 * variance / n as f64).sqrt();
    let (parameter, at) = match line {
        Some(_) => ("depth", vec!["amplitude", "frequency"]),
        // Where there is no line, its amplitude is that of full depth.
        None => ("amplitude", vec!["depth", "frequency"]),
    };
    Smallest {
        coefficients: vec![line.map_or(swing, |l| l.1), 0.0, swing, 0.0],
        location: vec![omega / TAU * rate_hz],
        parameter,
        at,
        ..Smallest::default()
    }
}

/// Of a stationary process with the middle one of its starts.
fn of_process(
    s: &Searched<'_>,
    meter: &Meter<'_>,
    c: &Candidate,
    process: &Arc<dyn Covariance>,
) -> Option<Smallest> {
    let panel = &s.search.panel;
    let n = s.search.panel.bins.n;
    let starts = process.starts(n);
    let start = starts.get(starts.len() / 2)?;
    let theta = |x: f64| [&[x], &start[1..]].concat();
    let shape = |x: f64| {
        let mut noise = s.state.noise.clone();
        noise.terms.push((Arc::clone(process), theta(x)));
        noise.over(&panel.bins)
    };
    let wanted = strength_for(if process.is_peak() {
        threshold::peak(n)
    } else {
        threshold::covariance(process.dimensions())
    });
    let x = meter.shape(*process.bounds(n).first()?, wanted, &shape)?;
    let others = c.effect.parameters().iter().skip(1);
    let exact: Vec<(f64, f64)> = theta(x).into_iter().map(|v| (v, 0.0)).collect();
    let described = process.described(&exact).into_iter();
    Some(Smallest {
        coefficients: described.map(|d| d.0).collect(),
        parameter: c.effect.parameters().first()?.name,
        at: others.filter(|p| p.required).map(|p| p.name).collect(),
        ..Smallest::default()
    })
}

/// Of two levels that stay as long as one would be seen best.
fn of_two_levels(s: &Searched<'_>, meter: &Meter<'_>) -> Option<Smallest> {
    let panel = &s.search.panel;
    let n = s.search.panel.bins.n;
    let rate_hz = s.search.view.rate_hz;
    let stay = n as f64 / STAYS;
    // Correlated as exp(-2 t / stay).
    let density = panel.bins.at.one_pole(1.0, (-2.0 / stay).exp());
    let shape = |x: f64| {
        let each = meter.g.iter().zip(&density);
        each.map(|(g, d)| g + x.exp() * d).collect()
    };
    let x = meter.shape(SPREAD, strength_for(threshold::two_level()), &shape)?;
    Some(Smallest {
        coefficients: vec![(meter.white * x.exp()).sqrt(), stay / rate_hz],
        parameter: "half_height",
        at: vec!["dwell_time"],
        ..Smallest::default()
    })
}

/// Of an increase of the variance.
fn of_variance_law(s: &Searched<'_>, first: &'static str, law: &VarianceLaw) -> Smallest {
    let n = s.search.panel.bins.n;
    let rate_hz = s.search.view.rate_hz;
    // Samples, and what one of them has of the increase.
    let (levels, wanted, (parameter, at)) = match law {
        VarianceLaw::Shape { shape, .. } => {
            let levels = scan::levels(&s.e, shape);
            let means = levels.iter().map(|(count, sum, _)| (*count, sum / count));
            (means.collect(), threshold::variance_law(), (first, vec![]))
        }
        VarianceLaw::Segment => {
            let inside = (STRETCH.1 - STRETCH.0) * n as f64;
            let levels = vec![(inside, 1.0), (n as f64 - inside, 0.0)];
            (
                levels,
                threshold::segment(),
                ("variance_increase", vec!["start", "end"]),
            )
        }
    };
    let strength = |x: f64| of_variance(levels.iter().map(|(m, s)| (*m, 1.0 + x * s)));
    let seconds = n as f64 / rate_hz;
    Smallest {
        coefficients: vec![size_for(strength_for(wanted), &strength)],
        location: vec![STRETCH.0 * seconds, STRETCH.1 * seconds],
        parameter,
        at,
        ..Smallest::default()
    }
}

/// Those of causes that were not found where they hold, in the order of the library.
pub(crate) fn of_not_found(all: Vec<DetectionLimit>, findings: &[Finding]) -> Vec<DetectionLimit> {
    let found = |l: &DetectionLimit| {
        let mut own = findings.iter().filter(|f| f.cause == l.cause);
        own.any(|f| l.channel == "record" || f.channels.contains(&l.channel))
    };
    let place = |l: &DetectionLimit| EFFECTS.iter().position(|e| e.id() == l.cause);
    let mut kept: Vec<DetectionLimit> = all.into_iter().filter(|l| !found(l)).collect();
    kept.sort_by_key(place);
    kept
}
