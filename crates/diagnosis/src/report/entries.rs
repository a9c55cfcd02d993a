//! What has no name, as entries: what is seen of one thing is one entry, with its place, its size and what it does.

use std::collections::BTreeSet;

use model::effect::extremes;
use model::unnamed::{self, Unnamed};

use crate::criticise::residual::swing;
use crate::ingest::types::Grid;
use crate::report::left_over::{Left, left_over};
use crate::result::{Consequence, Unexplained};
use crate::search::searched::Searched;
use crate::test_level::{CheckId, Domain, Observation};

/// The entries of a record. Observations of the noise of one channel are views of one residual, and one entry; so are those
/// of what an axis has in common with others, and what audits see in how the readings of one channel are made. What else befalls
/// readings stands for itself.
pub(crate) fn entries(
    all: Vec<Observation>,
    searched: &[Searched<'_>],
    grid: &Grid,
    terms: &[Unnamed],
    matters: f64,
) -> Vec<Unexplained> {
    let mut groups: Vec<Vec<Observation>> = vec![];
    for seen in all {
        let together = |group: &&mut Vec<Observation>| {
            let first = &group[0];
            seen.domain != Domain::Readings
                && (first.domain, &first.channel) == (seen.domain, &seen.channel)
        };
        match groups.iter_mut().find(together) {
            Some(group) => group.push(seen),
            None => groups.push(vec![seen]),
        }
    }
    let entry = |group: Vec<Observation>| {
        let own = searched.iter().find(|s| s.target.name == group[0].channel);
        let told = match (group[0].domain, own) {
            (Domain::Noise, Some(s)) => of_noise(&group, s, grid, matters),
            (Domain::Coupling, Some(s)) => of_coupling(&group, s, matters),
            _ => plain(&group),
        };
        Unexplained {
            modelled: modelled(&group, terms),
            ..told
        }
    };
    groups.into_iter().map(entry).collect()
}

/// Domains of the terms of a model that an entry has there.
fn modelled(group: &[Observation], terms: &[Unnamed]) -> Vec<String> {
    let shared = group[0].domain == Domain::Coupling;
    let in_residual = matches!(group[0].domain, Domain::Noise | Domain::Coupling);
    let own = terms.iter().filter(|t| {
        let of_domain = shared == (t.domain == unnamed::Domain::Cross);
        of_domain && in_residual && t.channels.contains(&group[0].channel)
    });
    let ids: BTreeSet<&str> = own.map(|t| t.domain.id()).collect();
    ids.into_iter().map(String::from).collect()
}

/// An entry whose consequence nobody knows.
fn plain(group: &[Observation]) -> Unexplained {
    let checks: BTreeSet<CheckId> = group.iter().filter_map(|o| o.check).map(|c| c.0).collect();
    let chance = |o: &Observation| o.check.map_or(1.0, |(_, chance)| chance);
    let surest = group.iter().min_by(|a, b| chance(a).total_cmp(&chance(b)));
    Unexplained {
        channel: group[0].channel.clone(),
        what: surest.map_or_else(String::new, |o| o.what.clone()),
        details: match group {
            [_] => vec![],
            _ => group.iter().map(|o| o.what.clone()).collect(),
        },
        follows: group.iter().find_map(|o| o.follows.first().cloned()),
        lines: group.iter().flat_map(|o| o.lines.iter().cloned()).collect(),
        checks: checks.into_iter().map(String::from).collect(),
        material: true,
        ..Unexplained::default()
    }
}

fn of_coupling(group: &[Observation], s: &Searched<'_>, matters: f64) -> Unexplained {
    let all = group.iter().filter_map(|o| o.correlation);
    let largest = all.fold(
        0.0f64,
        |most, r| if r.abs() > most.abs() { r } else { most },
    );
    let with: BTreeSet<&str> = group
        .iter()
        .flat_map(|o| &o.follows)
        .map(String::as_str)
        .collect();
    let with: Vec<&str> = with.into_iter().collect();
    let others = match with.as_slice() {
        [] => "another axis".to_owned(),
        some => some.join(" and "),
    };
    let consequence = Consequence::of_correlation(largest);
    Unexplained {
        what: format!(
            "shares noise with {others} (correlation {largest:+.3}), as no cause found makes it"
        ),
        rms: Some((largest.abs() * s.state.solution.white).sqrt()),
        share_of_variance: Some(largest.abs()),
        details: group.iter().map(|o| o.what.clone()).collect(),
        material: consequence.largest_change > matters,
        consequence: Some(consequence),
        ..plain(group)
    }
}

fn of_noise(group: &[Observation], s: &Searched<'_>, grid: &Grid, matters: f64) -> Unexplained {
    if s.target.moving {
        // What is left has the motion in it that moved the axis, and nobody knows how large it is without.
        return plain(group);
    }
    let terms: Vec<usize> = group.iter().flat_map(|o| o.terms.iter().copied()).collect();
    let Left {
        rms,
        share_of_variance,
        band_hz,
        span_s,
        mut consequence,
        local_change,
    } = left_over(s, grid, &terms);
    // A law of the variance that has lost its name stays out of the residual.
    let nearest = |title: &str| group.iter().any(|o| o.nearest.contains(&title));
    let laws = s.variance.each.iter();
    for v in laws.filter(|v| nearest(v.effect.docs().title)) {
        let largest = extremes(&v.law)[1].max(0.0).sqrt() - 1.0;
        consequence.largest_change = consequence.largest_change.max(largest);
    }
    let band_hz = band_hz.or_else(|| stated(group, grid.rate_hz));
    let material = consequence.largest_change.max(local_change) > matters;
    let follows = group.iter().flat_map(|o| &o.follows);
    let follows: BTreeSet<&String> = follows.filter(|c| **c != s.target.name).collect();
    let follows: Vec<&String> = follows.into_iter().collect();
    let entry = Unexplained {
        rms,
        share_of_variance,
        band_hz,
        span_s,
        follows: follows.first().map(|c| (*c).clone()),
        details: group.iter().map(|o| o.what.clone()).collect(),
        consequence: Some(consequence),
        material,
        ..plain(group)
    };
    let swings = group
        .iter()
        .any(|o| o.check.is_some_and(|c| c.0 == CheckId::VarianceRhythm));
    let swing = swings.then(|| swing(&s.e)).flatten();
    let swing = swing.map(|cycles| cycles * grid.rate_hz);
    Unexplained {
        what: sentence(group, &entry, &follows, swing, &s.target.unit),
        ..entry
    }
}

/// The place that an observation states, Hz.
fn stated(group: &[Observation], rate_hz: f64) -> Option<[f64; 2]> {
    let place = group.iter().find_map(|o| o.place)?;
    Some(place.map(|share| 0.5 * rate_hz * share))
}

/// One sentence: what, where, how large, what comes nearest. A `swing` of the size of the noise, Hz, is what checks see parts of.
fn sentence(
    group: &[Observation],
    entry: &Unexplained,
    follows: &[&String],
    swing: Option<f64>,
    unit: &str,
) -> String {
    let checks = group.iter().filter_map(|o| o.check);
    let lead = checks.min_by(|a, b| a.1.total_cmp(&b.1)).map(|c| c.0);
    // What says of itself what it is goes before the checks that see parts of it.
    let structure = group.iter().find(|o| o.structure);
    let seen = || match (lead.and_then(CheckId::seen_as), follows) {
        (_, []) if swing.is_some() => {
            let hz = swing.unwrap_or_default();
            format!(
                "the size of the noise swings with a period of {} s ({} Hz)",
                digits(hz.recip()),
                digits(hz)
            )
        }
        (Some(seen), []) => seen.to_owned(),
        (Some(seen), some) => format!("{seen}, with {}", joined(some)),
        (None, []) if group.iter().any(|o| !o.nearest.is_empty()) => {
            "noise that no cause of the library fits".to_owned()
        }
        (None, []) => group[0].what.clone(),
        (None, some) => format!("follows {} as no cause does", joined(some)),
    };
    let mut parts = vec![structure.map_or_else(seen, |o| o.what.clone())];
    let stated = structure.is_some_and(|o| o.place.is_some());
    if let Some([low, high]) = entry.band_hz.filter(|_| !stated) {
        let [low, high] = [digits(low), digits(high)];
        parts.push(if low == high {
            format!("at {low} Hz")
        } else {
            format!("{low} to {high} Hz")
        });
    }
    if let Some([from, to]) = entry.span_s {
        parts.push(format!("from {from:.0} to {to:.0} s"));
    }
    if let (Some(rms), Some(share)) = (entry.rms, entry.share_of_variance) {
        parts.push(format!(
            "{} {unit} rms ({:.1} % of the variance)",
            digits(rms),
            100.0 * share
        ));
    }
    let nearest: BTreeSet<&str> = group.iter().flat_map(|o| &o.nearest).copied().collect();
    if !nearest.is_empty() {
        let names: Vec<String> = nearest.iter().map(|n| n.to_lowercase()).collect();
        parts.push(format!("nearest cause: {}", names.join(", ")));
    }
    parts.join("; ")
}

fn joined(names: &[&String]) -> String {
    let names: Vec<&str> = names.iter().map(|n| n.as_str()).collect();
    names.join(" and ")
}

/// Three digits.
fn digits(v: f64) -> String {
    if v == 0.0 {
        return "0".into();
    }
    let places = 2 - v.abs().log10().floor() as i32;
    if places > 6 {
        return format!("{v:.2e}");
    }
    format!("{v:.*}", places.max(0) as usize)
}

/// Something that has a place in the order.
pub(crate) trait Ranked {
    /// What it does, where that is known.
    fn consequence(&self) -> Option<&Consequence>;
    /// Whether that matters.
    fn material(&self) -> bool;
    /// Takes its place.
    fn rank(&mut self, place: usize);
}

impl Ranked for Unexplained {
    fn consequence(&self) -> Option<&Consequence> {
        self.consequence.as_ref()
    }
    fn material(&self) -> bool {
        self.material
    }
    fn rank(&mut self, place: usize) {
        self.rank = place;
    }
}

impl Ranked for crate::result::Finding {
    fn consequence(&self) -> Option<&Consequence> {
        self.consequence.as_ref()
    }
    fn material(&self) -> bool {
        self.material
    }
    fn rank(&mut self, place: usize) {
        self.rank = place;
    }
}

/// Gives all their places: what matters first, by how much it changes; what is not known to be small stands before what is.
pub(crate) fn rank(mut all: Vec<&mut dyn Ranked>) {
    let size = |r: &dyn Ranked| r.consequence().map_or(0.0, |c| c.largest_change);
    all.sort_by(|a, b| {
        let of = |r: &dyn Ranked| (r.material(), size(r));
        let (a, b) = (of(&**a), of(&**b));
        b.0.cmp(&a.0).then(b.1.total_cmp(&a.1))
    });
    for (place, r) in all.into_iter().enumerate() {
        r.rank(place + 1);
    }
}
