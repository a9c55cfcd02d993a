//! Gains of causes that are no term of the likelihood: events and codes by their chance, and for every cause the angle before
//! and after. Where a gain has no number, why.

use std::collections::BTreeMap;

use model::effects;
use statrs::distribution::{ContinuousCDF, Normal};

use crate::audit::repeats;
use crate::fit::prequential;
use crate::ingest::types::Grid;
use crate::result::{Finding, Gain};
use crate::search::searched::Searched;

/// Why the log score of a cause has no number.
fn without_score(cause: &str) -> Option<&'static str> {
    match cause {
        effects::base_motion::ID => {
            Some("the base moved: what it did is an input of the model, and no error of the sensor")
        }
        effects::dropped_samples::ID => Some(
            "the model without it loses no frame: under it such a record is impossible, and the ratio has no limit",
        ),
        effects::timestamp_jitter::ID | effects::clock_rate::ID => Some(
            "the model without it says nothing of the clocks, so there is no likelihood to compare with",
        ),
        _ => None,
    }
}

/// A channel without what its terms add to the mean.
struct Rest {
    values: Vec<f64>,
    /// Data as fitted, lost readings filled.
    data: Vec<f64>,
}

impl Rest {
    fn of(s: &Searched<'_>) -> Self {
        let panel = &s.search.panel;
        let mut c = vec![0.0; panel.bins.n];
        for (term, own) in s.state.parts() {
            panel.add_columns(&mut c, 0, &term.columns, own);
        }
        let data = panel.dct.inverse(&panel.column(0));
        let added = panel.dct.inverse(&c);
        let values = data.iter().zip(&added).map(|(y, a)| y - a).collect();
        Self { values, data }
    }

    fn angles(
        &self,
        s: &Searched<'_>,
        law: Option<&[f64]>,
        grid: &Grid,
    ) -> Vec<(&'static str, f64)> {
        prequential::angles(&self.values, s.state.noise.log_walk, law, grid.rate_hz)
    }
}

/// Angles before and after, by horizon.
fn pairs(
    before: Vec<(&'static str, f64)>,
    after: Vec<(&'static str, f64)>,
) -> BTreeMap<String, [f64; 2]> {
    let both = before.into_iter().zip(after);
    both.map(|((key, a), (_, b))| (key.to_owned(), [a, b]))
        .collect()
}

/// Readings of a channel where there are any, those that are not believed as they were read.
fn read(s: &Searched<'_>) -> Vec<Option<f64>> {
    let mut all: Vec<Option<f64>> = s.target.y.iter().map(|v| Some(*v)).collect();
    s.target.lost.iter().for_each(|i| all[*i] = None);
    for (i, given) in &s.target.aside {
        all[*i] = Some(*given);
    }
    all
}

/// Places of the times of a finding.
fn places(f: &Finding, grid: &Grid) -> Vec<usize> {
    let at = f
        .times_s
        .iter()
        .map(|t| (t * grid.rate_hz).round() as usize);
    let mut all: Vec<usize> = at.filter(|i| *i < grid.n).collect();
    all.dedup();
    all
}

/// Wild readings, set aside, against noise that holds them.
fn of_outliers(f: &Finding, s: &Searched<'_>, grid: &Grid) -> Gain {
    let after = Rest::of(s);
    let mut before = Rest {
        values: after.values.clone(),
        data: vec![],
    };
    let (mut e, white) = (s.e.clone(), s.state.solution.white.sqrt());
    let near = |i: usize, at: &[usize]| at.iter().any(|a| a.abs_diff(i) <= 1);
    let at = places(f, grid);
    let wild: Vec<usize> = (s.target.aside.iter())
        .filter(|(i, _)| near(*i, &at))
        .map(|(i, given)| {
            let off = given - after.data[*i];
            before.values[*i] += off;
            e[*i] += off / white;
            *i
        })
        .collect();
    let (nats, std_error) = prequential::of_outliers(&e, &wild);
    Gain {
        held_out_log_score_nats: Some(nats),
        std_error: Some(std_error),
        angle_rms_deg: pairs(before.angles(s, None, grid), after.angles(s, None, grid)),
        ..Gain::default()
    }
}

/// Codes of a channel, with the normal law of their middle and spread.
struct Codes {
    of: Vec<Option<i64>>,
    mean: f64,
    sigma: f64,
}

impl Codes {
    fn of(s: &Searched<'_>) -> Option<Self> {
        let step = s.target.lsb.unwrap_or(s.target.step);
        if step <= 0.0 {
            return None;
        }
        let code = |v: Option<f64>| v.map(|v| (v / step).round() as i64);
        let of: Vec<Option<i64>> = read(s).into_iter().map(code).collect();
        let known = || of.iter().flatten().map(|c| *c as f64);
        let count = known().count() as f64;
        let mean = known().sum::<f64>() / count;
        let square = known().map(|c| (c - mean).powi(2)).sum::<f64>() / count;
        Some(Self {
            mean,
            sigma: square.sqrt().max(0.3),
            of,
        })
    }

    /// Chance of the codes that `has` holds for.
    fn chance(&self, has: &dyn Fn(i64) -> bool) -> f64 {
        const REACH: f64 = 8.0;
        let Ok(law) = Normal::new(self.mean, self.sigma) else {
            return 0.5;
        };
        let reach = REACH * self.sigma;
        let codes = (self.mean - reach) as i64 - 1..=(self.mean + reach) as i64 + 1;
        let own = codes.filter(|c| has(*c)).map(|c| c as f64);
        own.map(|c| law.cdf(c + 0.5) - law.cdf(c - 0.5)).sum()
    }

    fn events(&self, has: &dyn Fn(i64) -> bool) -> Vec<Option<bool>> {
        self.of.iter().map(|c| c.map(has)).collect()
    }
}

/// Events of a fault of the counts, and the chance of one without it.
fn coded(f: &Finding, of: &[&Searched<'_>]) -> Option<(Vec<Option<bool>>, f64)> {
    let value = |name: &str| f.parameters.get(name).map(|p| p.value);
    let codes = || Codes::of(of.first()?);
    match f.cause.as_str() {
        effects::stale_samples::ID => {
            let (mut chance, mut events): (f64, Vec<Option<bool>>) = (1.0, vec![]);
            let behind = value("behind").map_or(1, |b| (b as usize).max(1));
            for s in of {
                let (read, step) = (read(s), s.target.step);
                chance *= repeats::agreement(&s.target.y, step).0;
                let same = read.windows(behind + 1).map(|w| {
                    let both = w[0].zip(w[behind]);
                    both.map(|(a, b)| repeats::equal(a, b, step))
                });
                if events.is_empty() {
                    events = same.collect();
                } else {
                    let all = events.iter_mut().zip(same);
                    all.for_each(|(e, s)| *e = e.zip(s).map(|(a, b)| a && b));
                }
            }
            Some((events, chance))
        }
        effects::saturation::ID => {
            let codes = codes()?;
            let rails = [value("low"), value("high")];
            let at = move |c: i64| rails.iter().flatten().any(|r| *r as i64 == c);
            Some((codes.events(&at), codes.chance(&at)))
        }
        effects::coarse_lsb::ID => {
            let codes = codes()?;
            let step = i64::from(effects::coarse_lsb::step(&f.parameters));
            let rest = codes.of.iter().flatten().next()?.rem_euclid(step);
            let on = move |c: i64| c.rem_euclid(step) == rest;
            Some((codes.events(&on), codes.chance(&on)))
        }
        effects::stuck_bit::ID => {
            let codes = codes()?;
            let (bit, stuck) = (value("bit")? as u32, value("value")? as i64);
            let reads = move |c: i64| (c >> bit.min(62)) & 1 == stuck;
            Some((codes.events(&reads), codes.chance(&reads)))
        }
        _ => None,
    }
}

/// What a finding gains that the fit does not tell.
fn gain(f: &Finding, of: &[&Searched<'_>], grid: &Grid) -> (Gain, Option<String>) {
    let Some(first) = of.first() else {
        return (Gain::default(), without_score(&f.cause).map(str::to_owned));
    };
    if f.cause == effects::outliers::ID {
        return (of_outliers(f, first, grid), None);
    }
    // A fault of codes or times changes no level that a filter holds.
    let angles = || {
        let rest = Rest::of(first);
        pairs(
            rest.angles(first, None, grid),
            rest.angles(first, None, grid),
        )
    };
    let angle_rms_deg = if first.target.moving {
        BTreeMap::new()
    } else {
        angles()
    };
    let scored = coded(f, of).map(|(events, chance)| prequential::of_events(&events, chance));
    let why = match scored {
        Some(_) => None,
        None => Some(
            without_score(&f.cause)
                .unwrap_or("the readings come in no known steps")
                .to_owned(),
        ),
    };
    let gain = Gain {
        held_out_log_score_nats: scored.map(|s| s.0),
        std_error: scored.map(|s| s.1),
        angle_rms_deg,
        ..Gain::default()
    };
    (gain, why)
}

/// Gives every finding its gain, or the reason why it has none. Faults that were `mended` before the fit are in the model before
/// and after.
pub(crate) fn complete(
    findings: &mut [Finding],
    searched: &[Searched<'_>],
    grid: &Grid,
    mended: &[Finding],
) {
    for f in findings {
        let of: Vec<&Searched<'_>> = (searched.iter())
            .filter(|s| f.channels.is_empty() || f.channels.contains(&s.target.name))
            .collect();
        let is_mended = |m: &Finding| m.cause == f.cause && m.channels == f.channels;
        if mended.iter().any(is_mended) {
            f.no_gain = Some("the readings were put right before the fit, for both models".into());
            continue;
        }
        match &mut f.gain {
            None => {
                let (own, why) = gain(f, &of, grid);
                f.gain = Some(own);
                f.no_gain = why;
            }
            Some(own) if own.angle_rms_deg.is_empty() => {
                let Some(s) = of.iter().find(|s| !s.target.moving) else {
                    continue;
                };
                let rest = Rest::of(s);
                let mut laws = s.variance.each.iter();
                let law = laws.find(|v| v.effect.id() == f.cause);
                let law = law.map(|v| v.law.as_slice());
                let (before, after) = (rest.angles(s, None, grid), rest.angles(s, law, grid));
                own.angle_rms_deg = pairs(before, after);
            }
            Some(_) => {}
        }
    }
}
