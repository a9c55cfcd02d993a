//! What is known of the bands of a channel when their names are weighed: what has its place where they lie.

use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::ops::Range;

use model::effect::Peak;

use super::facts::{Facts, LEFT};
use crate::criticise::residual;
use crate::fit::channel::{ID, Term};
use crate::search::band_source::{FOLLOWED, coherence};
use crate::test_level::{CheckId, Outcome};

/// Half widths about the centre of a band that hold what it explains, and the share of that which a follower has there, from
/// which on the band may be what its shape leaves.
const BAND_REACH: f64 = 3.0;
const OF_BAND: f64 = 0.5;
/// Energy that a follower has at the place of a band over what it would have of an even spectrum, from which on it is that of
/// the band.
const CONCENTRATED: f64 = 2.0;
/// Part of the nats of a failure that is left without the coefficients of a band, up to which the failure is the band's: of one
/// that is of all frequencies more is left, as long as the band is narrow.
const ELSEWHERE: f64 = 1.0 / 3.0;

/// Tests of the whitened residual in time.
type InTime = fn(&Facts<'_>, &[f64]) -> Outcome;
const IN_TIME: [(CheckId, InTime); 7] = [
    (CheckId::Kurtosis, |f, e| residual::kurtosis(e, f.rate_hz())),
    (CheckId::Skewness, |_, e| residual::skewness(e)),
    (CheckId::Bicovariance, |_, e| residual::bicovariance(e)),
    (CheckId::ThreeReadings, |_, e| residual::three_readings(e)),
    (CheckId::Neighbours, |f, e| {
        residual::neighbours(e, f.s.step())
    }),
    (CheckId::VarianceRhythm, |f, e| {
        residual::variance_rhythm(e, f.rate_hz())
    }),
    (CheckId::Period, |f, e| residual::period(e, f.rate_hz())),
];

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

    /// Whether what follows a recorded channel by no law of the library does so at the place of a band: noise and a tone that
    /// wanders know nothing of what was recorded, and the two are one thing.
    pub(super) fn is_told_by_a_channel(&self, t: &Term) -> bool {
        let Some(peak) = t.peak() else {
            return false;
        };
        let panel = &self.s.search.panel;
        let mut nameless = self.s.state.parts().filter(|(o, _)| o.effect.id() == ID);
        nameless.any(|(o, own)| {
            let mut sum = vec![0.0; panel.bins.n];
            panel.add_columns(&mut sum, 0, &o.columns, own);
            let energy = panel.bins.products(&sum, &sum);
            let tells = self.at(&peak, &self.information(o, own)) / self.s.state.solution.white;
            let share = self.at(&peak, &energy) / energy.iter().sum::<f64>();
            let even = self.at(&peak, &self.counts) / self.counts.iter().sum::<f64>();
            tells > LEFT * explains(t) && share > CONCENTRATED * even
        })
    }

    /// Coefficients about the centre of a band that hold what it explains.
    fn place_of(&self, peak: &Peak) -> Range<usize> {
        let to_places = self.s.u.len() as f64 / PI;
        let reach = BAND_REACH * peak.half_width;
        let from = ((peak.omega - reach).max(0.0) * to_places) as usize;
        let to = ((peak.omega + reach) * to_places).ceil() as usize;
        from.max(1)..to.min(self.s.u.len())
    }

    /// Whether a test of the residual in time fails, and hardly does without the coefficients of a band: what it shows is then
    /// how that band is made, for which its name has no word.
    pub(super) fn failure_is_of(&self, t: &Term) -> bool {
        let asked: Vec<&InTime> = (IN_TIME.iter())
            .filter(|(id, _)| self.fails(*id))
            .map(|(_, test)| test)
            .collect();
        let Some(peak) = t.peak().filter(|_| !asked.is_empty()) else {
            return false;
        };
        let dct = &self.s.search.panel.dct;
        let mut without = self.s.u.clone();
        without[self.place_of(&peak)].fill(0.0);
        let (all, rest) = (dct.inverse(&self.s.u), dct.inverse(&without));
        let nats = |test: &InTime, e: &[f64]| -test(self, e).p_value.max(f64::MIN_POSITIVE).ln();
        (asked.iter()).any(|test| nats(test, &rest) < ELSEWHERE * nats(test, &all))
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
