//! A tone whose phase is that of another one, times a ratio of small numbers.
//!
//! A rotor shakes a stand at its pitch and at multiples of it, on every axis. One of these is the strongest; by its phase the others are
//! two coefficients of a linear fit, however weak they are and wherever they fold to.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use numerics::column::dot;
use rustfft::num_complex::Complex;

use super::claims::claim_of_led;
use super::{LEAST_BLOCKS, LEAST_REACH, MARGIN, Place, REACH, Stated, TrackedTone, density};
use super::{turned_back, without_others};
use crate::fit::channel::{Path, State, Term};
use crate::search::Search;
use crate::test_level::Outcome;

/// Ratios of pitches that are asked for.
pub(super) const RATIOS: [(u32, u32); 9] = [
    (1, 1),
    (2, 1),
    (3, 1),
    (4, 1),
    (5, 1),
    (1, 2),
    (3, 2),
    (1, 3),
    (2, 3),
];
/// Variance of the phase, rad^2, up to which a tone is led by another one: what it leaves is then a fifth of its power.
const LARGEST_DOUBT: f64 = 0.2;

/// A tone that was tracked, whose phase may lead others.
#[derive(Clone)]
pub(crate) struct Lead {
    path: Arc<Path>,
    stated: Stated,
}

impl Lead {
    /// Of a term whose phase was tracked.
    pub(crate) fn of(term: &Term) -> Option<Self> {
        Some(Self {
            path: Arc::clone(term.path.as_ref()?),
            stated: term.stated.as_deref()?.try_into().ok()?,
        })
    }

    /// The same of a tone of so many times the pitch, whose size and place in time are not known.
    fn times(&self, ratio: f64) -> Self {
        let [_, omega, half, pitch, time] = self.stated;
        let of = |(v, error): (f64, f64)| (ratio * v, ratio * error);
        let (turned, sign) = folded(ratio * self.path.omega);
        let phases = self.path.phase.iter();
        let path = Path {
            amplitude: 1.0,
            omega: turned,
            length: self.path.length,
            phase: phases
                .map(|(p, v)| (sign * ratio * p, ratio * ratio * v))
                .collect(),
        };
        Self {
            path: Arc::new(path),
            stated: [
                (1.0, 0.0),
                (folded(ratio * omega.0).0, ratio * omega.1),
                of(half),
                of(pitch),
                time,
            ],
        }
    }

    /// Whether a term stands where a multiple of this tone does, and knows less of its phase.
    pub(crate) fn may_lead(&self, term: &Term, spacing: f64) -> bool {
        let Some(own) = term.peak() else {
            return false;
        };
        let own_doubt = term.path.as_ref().map_or(f64::INFINITY, |p| p.doubt());
        RATIOS.iter().any(|(a, b)| {
            let ratio = f64::from(*a) / f64::from(*b);
            let (place, half) = self.place(ratio, spacing);
            (own.omega - place).abs() < half && 2.0 * ratio * ratio * self.path.doubt() < own_doubt
        })
    }

    /// Middle and half of the place of a multiple.
    fn place(&self, ratio: f64, spacing: f64) -> (f64, f64) {
        let [_, (omega, _), (half, _), ..] = self.stated;
        let half = (REACH * ratio * half).max(LEAST_REACH * spacing);
        (folded(ratio * omega).0, half)
    }
}

/// An angular frequency where sampling puts it, and whether it turns there as it does: 1, or -1.
pub(super) fn folded(omega: f64) -> (f64, f64) {
    let omega = omega.rem_euclid(TAU);
    if omega > PI {
        (TAU - omega, -1.0)
    } else {
        (omega, 1.0)
    }
}

impl Search<'_> {
    /// The tones at the places of lines and bands that are led by others.
    pub(super) fn led(&self, state: &State, all: &[Place], leads: &[Lead]) -> Vec<TrackedTone> {
        let of = |lead: &Lead| -> Vec<TrackedTone> {
            let ratios = RATIOS.iter();
            ratios
                .filter_map(|(a, b)| self.led_by(state, all, lead, f64::from(*a) / f64::from(*b)))
                .collect()
        };
        leads.iter().flat_map(of).collect()
    }

    /// The tone of so many times the pitch of another one, where lines or bands lie there.
    fn led_by(&self, state: &State, all: &[Place], lead: &Lead, ratio: f64) -> Option<TrackedTone> {
        let n = self.panel.bins.n;
        let (middle, half) = lead.place(ratio, self.spacing());
        let about = Place {
            terms: vec![],
            from: middle - half,
            to: middle + half,
        };
        let place = about.wider(1.0, all);
        if place.terms.is_empty() || ratio * ratio * lead.path.doubt() > LARGEST_DOUBT {
            return None;
        }
        let to_k = n as f64 / PI;
        let from = (place.from * to_k).max(1.0) as usize;
        let to = ((place.to * to_k) as usize).min(n);
        let others = without_others(self, state, &place.terms);
        let density = density(&others);
        let mut led = lead.times(ratio);
        let path = Arc::make_mut(&mut led.path);
        let columns = path.quadratures(n).map(|c| self.panel.dct.forward(&c));
        let [own, across] = [0, 1].map(|k| &columns[k][from..to]);
        let (p, q, r) = (dot(own, own), dot(own, across), dot(across, across));
        let read = &others[from..to];
        let (x, y) = (dot(own, read), dot(across, read));
        let whole = p * r - q * q;
        let (a, b) = ((r * x - q * y) / whole, (p * y - q * x) / whole);
        let nats = 0.5 * (a * x + b * y) / density;
        let lead_of = nats - self.laid(state, &place, density, &others);
        if lead_of.is_nan() || lead_of <= MARGIN {
            return None;
        }
        path.amplitude = a.hypot(b);
        let ahead = -b.atan2(a);
        path.phase.iter_mut().for_each(|(phase, _)| *phase += ahead);
        led.stated[0] = (path.amplitude, (density / (0.5 * (p + r))).sqrt());
        let course = path.course(n);
        let claim = self.claim_of(&led, &others, density);
        let mut term = self.described(led.stated, &led.path, density, nats)?;
        term.claims.extend(claim);
        Some(TrackedTone {
            term,
            course,
            lead: lead_of,
            is_led: true,
            left: 0.25 * n as f64 * led.path.doubt() * led.path.amplitude.powi(2) / density,
            from: place.from,
            to: place.to,
        })
    }

    /// What is claimed of a tone that is led: its size is steady. None where half the sample rate turns it back.
    fn claim_of(&self, led: &Lead, coefficients: &[f64], density: f64) -> Option<Outcome> {
        let n = coefficients.len();
        let [_, (omega, _), (half, _), ..] = led.stated;
        let spacing = self.spacing();
        let reach = (REACH * half / spacing).max(LEAST_BLOCKS as f64) as usize;
        let middle = (omega / spacing) as usize;
        let from = middle.checked_sub(reach).filter(|f| *f > 0)?;
        if from + 2 * reach > n {
            return None;
        }
        let turn = (from + reach) as f64 * spacing;
        let blocks = turned_back(&coefficients[from..from + 2 * reach], turn, n);
        let length = n as f64 / reach as f64;
        let noise = 2.0 * density / length;
        let size = led.path.amplitude;
        let along = blocks.iter().enumerate().map(|(k, z)| {
            let at = (k as f64 + 1.0) * length - 0.5;
            let (phase, doubt) = led.path.at(at);
            let z = z * Complex::from_polar(1.0, turn * at - phase);
            let spread = noise + 0.5 * (size * doubt).powi(2);
            (z.re - size * (-0.5 * doubt).exp()) / spread.sqrt()
        });
        Some(claim_of_led(&along.collect::<Vec<f64>>(), size, noise))
    }
}
