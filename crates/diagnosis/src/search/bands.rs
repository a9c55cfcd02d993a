//! A peak of the spectrum, sought at all centres and widths, and what it is called.
//!
//! Under the model each whitened coefficient has the energy 1. A window of m of them about a peak holds the mean energy E,
//! and a noise that stands there is ahead by m (E - 1 - ln E) of likelihood ratio: sums from the first coefficient on give
//! that of every window. The best ones are where the term of the library starts from, which is then fitted with all other
//! noise.

use std::f64::consts::{FRAC_2_PI, PI};
use std::ops::Range;
use std::sync::Arc;

use model::effect::{Covariance, Hypothesis, Peak};
use model::record::Quantity;

use super::band_source::{self, Moves};
use super::envelope::{Band, Seen};
use super::harmonic::{self, Place};
use super::{Search, band_alone, envelope};
use crate::fit::channel::{Cluster, Form, State, Term};
use crate::fit::likelihood::{Bins, Noise};
use crate::fit::scan::residual;
use crate::fit::threshold;
use crate::ingest::motion::drives;

/// Nats by which another shape of a peak has to be ahead of the plain one: 95 % of a plain one's shapes are not, by the chi-square
/// of the one degree that they differ by.
const LIKELIER: f64 = 1.92;
/// Most bands on one channel: a band that is no Lorentzian takes several.
const MOST_BANDS: usize = 3;
/// Least half width of a band that is fitted, in bins of the likelihood: over one of these a Lorentzian is its middle to an eighth.
const RESOLVED: f64 = 1.5;
/// Narrowest window, coefficients, the ratio of the next to it, and the widest over its centre.
const NARROWEST: f64 = 4.0;
const WIDER: f64 = std::f64::consts::SQRT_2;
const WIDEST: f64 = 0.7;
/// Windows of one width begin this part of it apart.
const APART: f64 = 0.25;
/// The window that shows a weak Lorentzian best holds this many half widths either side: the largest of atan(b)^2 / b.
const HALF_WIDTHS: f64 = 1.39;
/// A fitted peak is ahead of its best window by so much at most: a weak Lorentzian is by 1.22, a strong one by the energy in
/// its skirts.
pub(super) const AHEAD: f64 = 2.0;
/// How much wider a window is that may show a broader peak than the best one.
const BROADER: f64 = 4.0;
/// Part of the width at which a peak was seen, below which it is sought anew about where it was found.
const NARROWER: f64 = 0.5;
/// Bands that lie within so many of their half widths are one: a twentieth of the height of each is left there.
const NEAR: f64 = 4.0;
/// Peaks about which the bins are made finer, at most.
const MOST_PEAKS: usize = 8;
/// Half width over the centre, up to which bins of all records are too wide for a peak.
const FINE: f64 = 0.06;

/// A window: first coefficient and the end, mean energy in it, how far a noise there is ahead.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Window {
    from: usize,
    to: usize,
    energy: f64,
    lr: f64,
}

impl Window {
    fn width(&self) -> f64 {
        (self.to - self.from) as f64
    }

    /// Middle and half width of the Lorentzian that it shows best, in coefficients.
    fn peak(&self) -> (f64, f64) {
        let middle = 0.5 * (self.from + self.to - 1) as f64;
        (middle, 0.5 * self.width() / HALF_WIDTHS)
    }
}

/// Sums of energies from the first coefficient on.
struct Sums(Vec<f64>);

impl Sums {
    fn new(energies: impl Iterator<Item = f64>) -> Self {
        let sums = energies.scan(0.0, |sum, e| {
            *sum += e;
            Some(*sum)
        });
        Self([0.0].into_iter().chain(sums).collect())
    }

    fn mean(&self, from: usize, to: usize) -> f64 {
        (self.0[to] - self.0[from]) / (to - from).max(1) as f64
    }

    /// The best window of each width up to `widest` times its centre that is ahead by more than `least`, the energy over
    /// what `level` says of its surroundings.
    fn best(&self, widest: f64, least: f64, level: impl Fn(usize, usize) -> f64) -> Vec<Window> {
        let n = self.0.len() - 1;
        let widths = std::iter::successors(Some(NARROWEST), |w| Some(w * WIDER));
        let widths = widths.map(|w| w as usize).take_while(|w| 2 * w < n);
        let of_width = |width: usize| {
            let count = width as f64;
            let first = ((count / widest - 0.5 * count) as usize).max(1);
            let starts = (first..=n - width).step_by(((APART * count) as usize).max(1));
            let windows = starts.filter_map(|from| {
                let energy = self.mean(from, from + width);
                // E - 1 - ln E is less than half the square of E - 1.
                if energy < 1.0 || count * (energy - 1.0).powi(2) < 2.0 * least {
                    return None;
                }
                let energy = energy / level(from, from + width);
                let lr = count * (energy - 1.0 - energy.ln());
                let to = from + width;
                (energy > 1.0 && lr > least).then_some(Window {
                    from,
                    to,
                    energy,
                    lr,
                })
            });
            windows.max_by(|a, b| a.lr.total_cmp(&b.lr))
        };
        widths.filter_map(of_width).collect()
    }
}

/// Narrow peaks of a channel whose coefficients and first guess of the noise are these: where the bins have to be fine.
pub(crate) fn peaks(coefficients: &[f64], noise: &Noise, white: f64, bins: &Bins) -> Vec<Peak> {
    let n = coefficients.len();
    let least = threshold::peak(n) / AHEAD;
    let g = noise.everywhere(bins);
    let mut energies: Vec<f64> = (coefficients
        .iter()
        .zip(&g)
        .map(|(c, g)| c * c / (g * white)))
    .collect();
    let mut found: Vec<Peak> = vec![];
    while found.len() < MOST_PEAKS {
        let sums = Sums::new(energies.iter().copied());
        // A slope of the spectrum is no peak: the surroundings on either side are its level.
        let level = |from: usize, to: usize| {
            let width = to - from;
            let before = sums.mean(from.saturating_sub(2 * width).max(1), from);
            let behind = sums.mean(to, (to + 2 * width).min(n));
            before.max(behind).max(1.0)
        };
        let widest = 2.0 * HALF_WIDTHS * FINE;
        let all = sums.best(widest, least, level);
        let Some(best) = all.into_iter().max_by(|a, b| a.lr.total_cmp(&b.lr)) else {
            break;
        };
        let (middle, half) = best.peak();
        let spacing = PI / n as f64;
        found.push(Peak {
            omega: middle * spacing,
            half_width: half * spacing,
            variance: best.energy,
        });
        let about = best.to - best.from;
        energies[best.from.saturating_sub(about)..(best.to + about).min(n)].fill(1.0);
    }
    found
}

impl Search<'_> {
    /// Whether a further band may join.
    pub(super) fn open_to_bands(state: &State) -> bool {
        state.terms.iter().filter(|t| t.is_band()).count() < MOST_BANDS
    }

    /// The peak of candidate `i` that explains most of what a state leaves.
    /// Windows that are no farther ahead than `least` are not asked.
    pub(super) fn weigh_peak(
        &self,
        state: &State,
        i: usize,
        c: &Arc<dyn Covariance>,
        least: f64,
    ) -> Option<Term> {
        let n = self.panel.bins.n;
        let own = state.columns();
        let g = state.noise.everywhere(&self.panel.bins);
        let white = state.solution.white;
        let r = residual(&self.panel, &own, &state.solution);
        let sums = Sums::new(r.iter().zip(&g).map(|(r, g)| r * r / (g * white)));
        let all = sums.best(WIDEST, least, |_, _| 1.0);
        let most = |of: &dyn Fn(&Window) -> bool| {
            let of = all.iter().copied().filter(of);
            of.max_by(|a, b| a.lr.total_cmp(&b.lr))
        };
        let best = most(&|_| true)?;
        let broader = most(&|w| w.width() >= BROADER * best.width());
        let spacing = PI / n as f64;
        let fitted = |of: Arc<dyn Covariance>, from: Vec<f64>| {
            let mut noise = state.noise.clone();
            noise.terms.push((Arc::clone(&of), from));
            let (noise, solution) = self.panel.fit(&noise, &own);
            let theta = noise.terms.last().map(|t| t.1.clone())?;
            Some((of, theta, solution.log_likelihood))
        };
        // The likelihood does not see what is narrower than its bins.
        let resolved = |omega: f64| RESOLVED * self.panel.bins.width_at(omega) * spacing;
        let fits = [Some(best), broader].into_iter().flatten().filter_map(|w| {
            let (middle, half) = w.peak();
            let omega = middle * spacing;
            let level = g[w.from..w.to].iter().sum::<f64>() / w.width();
            let held = FRAC_2_PI * HALF_WIDTHS.atan();
            let mut seen = Peak {
                omega,
                half_width: (half * spacing).max(resolved(omega)),
                variance: (w.energy - 1.0) * level * w.width() / n as f64 / held,
            };
            let (located, theta) = c.about(&seen)?;
            let mut fit = fitted(located, theta)?;
            // The skirts of a strong peak fill a window that is many times as wide, and about which it may be this much narrower.
            while let Some(peak) = fit.0.peak(&fit.1)
                && peak.half_width < NARROWER * seen.half_width
                && NARROWER * seen.half_width > resolved(peak.omega)
            {
                seen = Peak {
                    half_width: peak.half_width.max(resolved(peak.omega)),
                    ..peak
                };
                let (located, theta) = c.about(&seen)?;
                fit = fitted(located, theta)?;
            }
            Some(fit)
        });
        let plain = fits.max_by(|a, b| a.2.total_cmp(&b.2))?;
        let variants = plain.0.variants().into_iter();
        let variants = variants.filter_map(|v| fitted(v, plain.1.clone()));
        let other = variants.max_by(|a, b| a.2.total_cmp(&b.2));
        let clearly = other.filter(|o| o.2 > plain.2 + LIKELIER);
        let (located, theta, l) = clearly.unwrap_or(plain);
        let form = Form::Covariance(located, theta);
        let limit = threshold::peak(n);
        let mut term = Term::new(self.candidates[i].effect, i, form, limit);
        term.lr = self.of_read() * 2.0 * (l - state.solution.log_likelihood);
        Some(term)
    }

    /// Terms that are bands, those that overlap together, the strongest of all first.
    fn clusters(state: &State) -> Vec<Vec<usize>> {
        let mut bands: Vec<(usize, Peak)> = (state.terms.iter().enumerate())
            .filter_map(|(i, t)| Some((i, t.peak()?)))
            .collect();
        bands.sort_by(|a, b| b.1.variance.total_cmp(&a.1.variance));
        let mut all: Vec<Vec<(usize, Peak)>> = vec![];
        for band in bands {
            let near = |o: &(usize, Peak)| {
                (o.1.omega - band.1.omega).abs() < NEAR * (o.1.half_width + band.1.half_width)
            };
            match all.iter_mut().find(|c| c.iter().any(near)) {
                Some(cluster) => cluster.push(band),
                None => all.push(vec![band]),
            }
        }
        let places = |c: Vec<(usize, Peak)>| c.into_iter().map(|b| b.0).collect();
        all.into_iter().map(places).collect()
    }

    /// Give each band the name that its envelope bears out, and those that overlap one and the same.
    pub(super) fn name_bands(&self, state: &mut State) {
        let tone = (self.candidates.iter())
            .position(|c| matches!(c.hypothesis, Hypothesis::WanderingTone));
        let Some(tone) = tone else { return };
        let clusters = Self::clusters(state);
        let bands: Vec<Option<(Band, usize)>> =
            clusters.iter().map(|c| self.band(state, c)).collect();
        let recorded = self.view.signals.iter().filter(|_| !bands.is_empty());
        let courses = recorded.filter_map(|s| match s.quantity {
            Quantity::Acc => Some((s, &s.values)),
            quantity => drives(quantity).then_some((s, &s.smooth)),
        });
        let felt = courses.map(|(s, values)| (s.name.as_str(), self.panel.dct.forward(values)));
        let felt: Vec<(&str, Vec<f64>)> = felt.collect();
        let moves: Vec<Option<Moves>> = (bands.iter())
            .map(|b| b.as_ref().and_then(|(band, from)| Moves::of(band, *from)))
            .collect();
        let firsts: Vec<usize> = clusters.iter().map(|c| c[0]).collect();
        for (number, (cluster, band)) in clusters.into_iter().zip(&bands).enumerate() {
            // Of a tone that was tracked its course has told.
            let tracked = cluster.iter().any(|i| state.terms[*i].stated.is_some());
            let seen = band.as_ref().filter(|_| !tracked);
            let seen = seen.and_then(|(band, from)| Seen::new(band, *from as u64));
            let others = state.terms.iter().enumerate();
            let others = others.filter(|(i, _)| !cluster.contains(i));
            let rest = self.refit(
                others.map(|(_, t)| t.clone()).collect(),
                state.noise.log_walk,
            );
            let lr = 2.0 * (state.solution.log_likelihood - rest.solution.log_likelihood);
            let lr = self.of_read() * lr;
            // What else turns with a rotor is named with it.
            let own = &state.terms[cluster[0]];
            let turns_with = |k: &usize| own.turns_with(&state.terms[firsts[*k]]);
            let others = moves.iter().enumerate();
            let others = others.filter(|(k, _)| *k != number && !turns_with(k));
            let others: Vec<&Moves> = others.filter_map(|(_, m)| m.as_ref()).collect();
            // A tone that accelerometers read is a motion of the stand, harmonics and all; and what is locked to another is none that
            // noise drives.
            let is_read = (moves[number].as_ref())
                .is_some_and(|own| band_source::is_read(own, self.view.signals, &felt));
            let is_harmonic = is_read
                && (moves[number].as_ref()).is_some_and(|own| band_alone::is_locked(own, &others));
            let harmonics = moves[number].as_ref().filter(|_| !own.is_shared_tone());
            let harmonics = harmonics.map_or(vec![], |own| self.harmonics(state, &cluster, own));
            for (place, i) in cluster.iter().enumerate() {
                let t = &mut state.terms[*i];
                t.cluster = Some(Cluster { number, place, lr });
                if let Some(seen) = &seen {
                    let [noise, steady] = [t.candidate, tone].map(|c| self.candidates[c].effect);
                    let is_tone = seen.odds > 0.0 || is_harmonic;
                    if is_tone {
                        t.effect = steady;
                        t.candidate = tone;
                    }
                    if seen.odds.abs() < envelope::OPEN && !is_harmonic {
                        let other = if is_tone { noise } else { steady };
                        t.alternatives.push((other, -seen.odds.abs()));
                    }
                }
                if place == 0 && (seen.is_some() || tracked) {
                    let named = t.effect.id();
                    t.claims.extend(seen.as_ref().map(|s| s.claim(named)));
                    let source = moves[number]
                        .as_ref()
                        .and_then(|own| band_source::claim(own, self.view.signals, &felt, named));
                    let alone = moves[number]
                        .as_ref()
                        .filter(|_| !(is_read && t.candidate == tone))
                        .and_then(|own| band_alone::claim(own, &others, &harmonics, named));
                    t.claims.extend(source.into_iter().chain(alone));
                }
            }
            // Of several the one tone has no coordinates of its own.
            if let ([i], Some(Seen { odds, .. })) = (cluster.as_slice(), seen)
                && odds > 0.0
                && let (Form::Covariance(c, _), Some(peak)) =
                    (&state.terms[*i].form, state.terms[*i].peak())
            {
                let level = Self::beside(state, &cluster).at(peak.omega);
                state.terms[*i].wider = envelope::wider(c, &peak, level);
            }
        }
    }

    /// All noise but some bands.
    pub(super) fn beside(state: &State, without: &[usize]) -> Noise {
        let mut places = (0..state.terms.len()).filter(|i| state.terms[*i].is_covariance());
        let mut noise = state.noise.clone();
        noise
            .terms
            .retain(|_| !places.next().is_some_and(|i| without.contains(&i)));
        noise
    }

    /// Some bands together, and their first coefficient.
    fn band(&self, state: &State, cluster: &[usize]) -> Option<(Band, usize)> {
        let n = self.panel.bins.n;
        let to_k = n as f64 / PI;
        let ends = cluster
            .iter()
            .filter_map(|i| state.terms[*i].peak())
            .map(|p| {
                let reach = envelope::REACH * p.half_width;
                [(p.omega - reach) * to_k, (p.omega + reach) * to_k]
            });
        let [low, high] = ends.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])?;
        let (from, to) = (low.max(1.0) as usize, (high as usize + 1).min(n));
        let noise = Self::beside(state, cluster);
        let r = residual(&self.panel, &state.columns(), &state.solution);
        let (coefficients, beside) = over(&noise, state.solution.white, &r, from..to);
        let all = state.noise.through((from..to).map(|k| k as f64 / to_k));
        let band = Band {
            coefficients,
            density: all.iter().zip(&beside).map(|(a, b)| a / b - 1.0).collect(),
        };
        Some((band, from))
    }

    /// Chances that a channel has as much at the harmonics of some bands that are one thing.
    fn harmonics(&self, state: &State, cluster: &[usize], own: &Moves) -> Vec<f64> {
        let noise = Self::beside(state, cluster);
        let r = residual(&self.panel, &state.columns(), &state.solution);
        let over = |places| over(&noise, state.solution.white, &r, places);
        let middle = own.middle() as usize;
        let (_, level) = over(middle..middle + 1);
        let chance = |order| {
            let place = Place::of(own, order, r.len())?;
            let (there, levels) = over(place.places.clone());
            Some(place.chance(own, &there, levels[levels.len() / 2] / level[0]))
        };
        harmonic::ORDERS.filter_map(chance).collect()
    }
}

/// Coefficients of a residual over a noise, and that noise over the white one.
fn over(noise: &Noise, white: f64, residual: &[f64], places: Range<usize>) -> (Vec<f64>, Vec<f64>) {
    let to_omega = PI / residual.len() as f64;
    let levels = noise.through(places.clone().map(|k| k as f64 * to_omega));
    let each = residual[places].iter().zip(&levels);
    let whole = each.map(|(r, g)| r / (white * g).sqrt()).collect();
    (whole, levels)
}
