//! What is known of the bands of a channel when their names are weighed: what has its place where they lie.

use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::ops::Range;

use model::effect::Peak;

use super::facts::Facts;
use crate::fit::channel::{BAND_REACH, Term};
use crate::search::band_source::{FOLLOWED, coherence};
use crate::test_level::CheckId;

/// Share of what a band explains that a follower has at its place, from which on the band may be what its shape leaves.
const OF_BAND: f64 = 0.5;

/// What a band explains, with those that it is one with.
pub(super) fn explains(t: &Term) -> f64 {
    t.cluster.map_or(t.lr, |c| c.lr)
}

impl Facts<'_> {
    /// Whether a band explains no more than a follower of a recorded channel has at its place: late or bent, that leaves as
    /// much. The follower, and the share of what it explains.
    pub(super) fn beside_follower(&self, t: &Term) -> Option<(&'static str, f64)> {
        let peak = t.peak()?;
        let lr = explains(t);
        let mut found: BTreeMap<&'static str, f64> = BTreeMap::new();
        for (o, own) in self.s.state.parts() {
            if self.s.search.followed(o).is_none() {
                continue;
            }
            *found.entry(o.effect.id()).or_default() +=
                self.at(&peak, &self.information(o, own)) / self.s.state.solution.white;
        }
        let most = found.into_iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
        let all = self.followed.iter().find(|f| f.0 == most.0)?.1;
        (most.1 > OF_BAND * lr).then_some((most.0, lr / all))
    }

    /// What the bins at the place of a band hold of some values.
    fn at(&self, peak: &Peak, values: &[f64]) -> f64 {
        let inside = |w: f64| (w - peak.omega).abs() < BAND_REACH * peak.half_width;
        let bins = values.iter().zip(&self.s.search.panel.bins.at.omega);
        bins.filter(|(_, w)| inside(**w)).map(|(v, _)| v).sum()
    }

    /// Coefficients about the centre of a band that hold what it explains.
    fn place_of(&self, peak: &Peak) -> Range<usize> {
        let to_places = self.s.u.len() as f64 / PI;
        let reach = BAND_REACH * peak.half_width;
        let from = ((peak.omega - reach).max(0.0) * to_places) as usize;
        let to = ((peak.omega + reach) * to_places).ceil() as usize;
        from.max(1)..to.min(self.s.u.len())
    }

    /// Whether the channel follows another axis later, and does so at the place of a band.
    pub(super) fn is_of_another_axis(&self, t: &Term) -> bool {
        let Some(peak) = t.peak() else {
            return false;
        };
        let place = self.place_of(&peak);
        self.left.before.iter().any(|before| {
            let (p, part) = coherence(&self.s.u[place.clone()], &before[place.clone()]);
            part > FOLLOWED && p < CheckId::BandSource.level()
        })
    }
}
