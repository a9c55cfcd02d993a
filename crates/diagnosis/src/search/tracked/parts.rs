//! The tones of a channel that are parts of a rotor: by its phase each is two coefficients of a linear fit, however weak it is and
//! wherever it folds to.

use std::f64::consts::PI;
use std::sync::Arc;

use numerics::column::dot;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

use super::claims::claim_of_part;
use super::rotor::{LEAST_PART, Rotor, folded};
use super::{LEAST_BLOCKS, MOST_DOUBLED, Place, REACH, TrackedTone};
use super::{places, turned_back, without_others};
use crate::fit::channel::{Path, State};
use crate::search::Search;
use crate::test_level::Outcome;
use model::effect::Peak;

/// How often the band of a tone is doubled, so that its phase is known within a block in which its size is asked.
const FINER: u32 = 4;

impl Search<'_> {
    /// The tones of a channel that are parts of a rotor.
    pub(super) fn parts(&self, state: &State, rotor: &Rotor, target: usize) -> Vec<TrackedTone> {
        let all = places(state, self.spacing());
        let one = |ratio: f64| self.part(state, &all, rotor, ratio);
        rotor.ratios_on(target).filter_map(one).collect()
    }

    /// The tone of so many times the pitch of a rotor.
    fn part(&self, state: &State, all: &[Place], of: &Rotor, ratio: f64) -> Option<TrackedTone> {
        let n = self.panel.bins.n;
        let (middle, half) = of.lead.place(ratio, self.spacing());
        let about = Place {
            terms: vec![],
            from: middle - half,
            to: middle + half,
        };
        let place = about.wider(1.0, all);
        let to_k = n as f64 / PI;
        let from = (place.from * to_k).max(1.0) as usize;
        let to = ((place.to * to_k) as usize).min(n);
        let others = without_others(self, state, &place.terms);
        let density = self.density_about(state, &place.wider(f64::from(1 << MOST_DOUBLED), all));
        let mut tone = of.lead.times(ratio);
        let path = Arc::make_mut(&mut tone.path);
        let columns = path.quadratures(n).map(|c| self.panel.dct.forward(&c));
        let [own, across] = [0, 1].map(|k| &columns[k][from..to]);
        let (p, q, r) = (dot(own, own), dot(own, across), dot(across, across));
        let read = &others[from..to];
        let (x, y) = (dot(own, read), dot(across, read));
        let whole = p * r - q * q;
        let (a, b) = ((r * x - q * y) / whole, (p * y - q * x) / whole);
        let nats = 0.5 * (a * x + b * y) / density;
        if nats.is_nan() || nats < LEAST_PART {
            return None;
        }
        path.amplitude = a.hypot(b);
        let ahead = -b.atan2(a);
        path.phase.iter_mut().for_each(|(phase, _)| *phase += ahead);
        let error = (density / (0.5 * (p + r))).sqrt();
        tone.stated[0] = (path.amplitude, error);
        let of_rotor = (of.tones() > 1).then(|| {
            let multiple = ratio * folded(ratio * of.lead.path.omega).1;
            [(multiple, 0.0), (ahead, error / path.amplitude)]
        });
        let course = path.course(n);
        let mut term = self.described(tone.stated, &tone.path, density, nats)?;
        term.stated
            .iter_mut()
            .for_each(|s| s.extend(of_rotor.iter().flatten()));
        // Where it is, the rotor tells: it is not the best of all places.
        term.threshold = term.threshold.min(2.0 * LEAST_PART);
        term.claims.push(of.claim.clone());
        Some(TrackedTone {
            term,
            course,
            by_itself: 0.25 * n as f64 * tone.path.doubt() * tone.path.amplitude.powi(2) / density,
            among: of.tones(),
            from: place.from,
            to: place.to,
        })
    }

    /// Puts to a tone what is claimed of its size, beside the noise that is found without it: that it is steady. Not where half the
    /// sample rate turns it back.
    pub(super) fn claim_steady(&self, tone: &mut TrackedTone, rest: &State) {
        let claim = tone.term.path.as_deref().zip(tone.term.peak());
        let claim = claim.and_then(|(path, peak)| self.steady(tone, path, &peak, rest));
        tone.term.claims.extend(claim);
    }

    fn steady(
        &self,
        tone: &TrackedTone,
        path: &Path,
        peak: &Peak,
        rest: &State,
    ) -> Option<Outcome> {
        let n = self.panel.bins.n;
        let spacing = self.spacing();
        let reach = (REACH * peak.half_width / spacing).max(LEAST_BLOCKS as f64) as usize;
        let middle = (peak.omega / spacing) as usize;
        let about = |reach: usize| {
            let from = middle.checked_sub(reach).filter(|f| *f > 0)?;
            (middle + reach <= n).then_some(from..middle + reach)
        };
        let here = about(reach)?;
        let tone_again = self.panel.dct.forward(&tone.course);
        let without = without_others(self, rest, &[]);
        let noise = rest.noise.through(here.map(|k| k as f64 * spacing));
        let density = rest.solution.white * noise.iter().sum::<f64>() / noise.len() as f64;
        // So far either side that the pitch turns no block by itself.
        let finer = (0..=FINER)
            .rev()
            .find_map(|f| Some((1 << f, about(reach << f)?)));
        let (finer, wide) = finer?;
        let pairs = without[wide.clone()].iter().zip(&tone_again[wide]);
        let coefficients: Vec<f64> = pairs.map(|(w, t)| w + t).collect();
        let turn = middle as f64 * spacing;
        let length = n as f64 / (finer * reach) as f64;
        let at = |block: usize| (block as f64 + 1.0) * length - 0.5;
        let blocks = turned_back(&coefficients, turn, n);
        let still = blocks.into_iter().enumerate().map(|(k, z)| {
            let turned = turn * at(k) - path.at(at(k)).0;
            z * Complex::from_polar(1.0, turned)
        });
        let blocks = slowed(still.collect(), finer);
        let length = n as f64 / reach as f64;
        let noise = 2.0 * density / length;
        let size = path.amplitude;
        let along = blocks.iter().enumerate().map(|(k, z)| {
            let (_, doubt) = path.at((k as f64 + 1.0) * length - 0.5);
            let spread = noise + 0.5 * (size * doubt).powi(2);
            (z.re - size * (-0.5 * doubt).exp()) / spread.sqrt()
        });
        let along: Vec<f64> = along.collect();
        Some(claim_of_part(&along, size, noise, tone.among))
    }
}

/// A series without what turns faster than once in twice as many values, in one value for so many.
fn slowed(mut z: Vec<Complex<f64>>, many: usize) -> Vec<Complex<f64>> {
    let count = z.len();
    let slower = count / many;
    let mut planner = FftPlanner::new();
    planner.plan_fft_forward(count).process(&mut z);
    let half = slower / 2;
    z.drain(slower - half..count - half);
    planner.plan_fft_inverse(slower).process(&mut z);
    z.iter().map(|v| v / count as f64).collect()
}
