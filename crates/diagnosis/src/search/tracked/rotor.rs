//! One phase that a tone has on several channels, and at multiples of its pitch.
//!
//! A rotor shakes a stand at its pitch and at multiples of it, on every axis. No channel tells its phase as well as all of them do
//! together: those of one multiple are summed as the receivers of a maximal-ratio combiner are (D. G. Brennan, Proc. IRE 47 (1959)
//! 1075), each by its size over its noise, and the multiples are so many readings of one phase ([`model::tone`]). What accelerometers
//! read of it tells as much, though none of it is asked of them.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use model::effect::Peak;
use model::record::Quantity;
use model::tone::Reading;
use rustfft::num_complex::Complex;

use super::phase::{Coordinates, FORGOTTEN, Tracked, likeliest};
use super::{
    Attempt, LARGEST_DOUBT, LEAST_BLOCKS, LEAST_REACH, MARGIN, MOST_DOUBLED, REACH, Stated,
};
use super::{all_about, density, places, turned_back, widest};
use crate::fit::channel::{Form, Path, State, Term};
use crate::fit::likelihood::Noise;
use crate::ingest::types::Grid;
use crate::search::bands;
use crate::search::searched::Searched;
use crate::test_level::Outcome;

/// Multiples of the pitch that are asked for.
const RATIOS: [(u32, u32); 9] = [
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
/// Nats from which on a channel has a part of the tone: of noise a rotor of nine multiples on six channels reaches it once in 3000.
pub(super) const LEAST_PART: f64 = 12.0;
/// Most peaks of all channels whose phase is looked for.
const MOST_TRIES: usize = 12;
/// Most rotors of a record.
const MOST_ROTORS: usize = 5;
/// How often sizes are told by the phase, and the phase by them.
const ROUNDS: usize = 3;
/// Half widths of the widest multiple that its blocks hold, either side, over what a tone is sought in.
const HELD: f64 = 2.0;
/// Part of the pitch that the blocks of a multiple hold at most, either side: beyond lies the next one.
const APART: f64 = 0.25;
/// Half width of a tone, in coefficients, below which the record does not tell it from a line.
const NARROWEST: f64 = 0.5;

/// Ratios of small numbers.
pub(super) fn ratios() -> impl Iterator<Item = f64> {
    RATIOS.iter().map(|(a, b)| f64::from(*a) / f64::from(*b))
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

/// The phase of a tone through the record, and what is told of it.
#[derive(Clone)]
pub(super) struct Lead {
    pub path: Arc<Path>,
    pub stated: Stated,
}

impl Lead {
    fn of(attempt: &Attempt) -> Self {
        Self {
            path: Arc::new(attempt.path()),
            stated: attempt.stated(),
        }
    }

    /// The same of a tone of so many times the pitch, whose size and place in time are not known.
    pub(super) fn times(&self, ratio: f64) -> Self {
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
            shared: self.path.shared,
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

    /// Middle and half of the place of a multiple.
    pub(super) fn place(&self, ratio: f64, spacing: f64) -> (f64, f64) {
        let [_, (omega, _), (half, _), ..] = self.stated;
        let half = (REACH * ratio * half).max(LEAST_REACH * spacing);
        (folded(ratio * omega).0, half)
    }

    fn omega(&self) -> f64 {
        self.stated[1].0
    }
}

/// A tone and its multiples on all channels that have them.
pub(crate) struct Rotor {
    pub(super) lead: Lead,
    /// What its pitch claims.
    pub(super) claim: Outcome,
    /// Channels under test that have a part of it, by their number, with the ratio.
    parts: Vec<(usize, f64)>,
}

impl Rotor {
    /// The multiples that a channel under test has.
    pub(super) fn ratios_on(&self, target: usize) -> impl Iterator<Item = f64> {
        let here = self.parts.iter().filter(move |(of, _)| *of == target);
        here.map(|(_, ratio)| *ratio)
    }

    /// Tones of all channels that are parts of it.
    pub(super) fn tones(&self) -> usize {
        self.parts.len()
    }

    /// Whether a channel has any part of it.
    pub(crate) fn is_on(&self, target: usize) -> bool {
        self.ratios_on(target).next().is_some()
    }
}

/// What a channel reads, its number among all, and of one under test that among these.
struct Heard {
    number: usize,
    coefficients: Arc<Vec<f64>>,
    target: Option<usize>,
}

/// A multiple as a channel has it: its blocks, turned to the multiple of the phase, and the variance of the noise in either part.
struct Part {
    heard: usize,
    target: Option<usize>,
    ratio: f64,
    sign: f64,
    blocks: Vec<Complex<f64>>,
    variance: f64,
    /// What the tone is times, and the nats that it tells.
    gain: Complex<f64>,
    nats: f64,
}

/// The multiple of a phase that blocks of a channel hold; none beyond half the sample rate.
fn part(heard: &Heard, ratio: f64, lead: &Lead, count: usize) -> Option<Part> {
    let coefficients = &heard.coefficients;
    let n = coefficients.len();
    let spacing = PI / n as f64;
    let (omega, sign) = folded(ratio * lead.path.omega);
    let bin = (omega / spacing).round() as usize;
    let from = bin.checked_sub(count).filter(|f| *f > 0)?;
    if bin + count > n {
        return None;
    }
    let middle = bin as f64 * spacing;
    let length = n as f64 / count as f64;
    let about = all_about(from, bin + count, n);
    let variance = 2.0 * density(&coefficients[about]) / length;
    let blocks = turned_back(&coefficients[from..bin + count], middle, n);
    let at = |block: usize| (block as f64 + 1.0) * length - 0.5;
    let turned =
        |(k, z): (usize, Complex<f64>)| z * Complex::from_polar(1.0, (middle - omega) * at(k));
    let blocks: Vec<Complex<f64>> = blocks.into_iter().enumerate().map(turned).collect();
    let (mut sum, mut known) = (Complex::default(), 0.0);
    for (k, z) in blocks.iter().enumerate() {
        let (phase, doubt) = lead.path.at(at(k));
        let own = sign * ratio * (phase - lead.path.omega * at(k));
        let size = (-0.5 * ratio * ratio * doubt).exp();
        sum += z * Complex::from_polar(size, -own);
        known += size * size;
    }
    Some(Part {
        heard: heard.number,
        target: heard.target,
        ratio,
        sign,
        gain: sum / blocks.len() as f64,
        nats: 0.5 * sum.norm_sqr() / (variance * known),
        blocks,
        variance,
    })
}

/// Parts of one ratio as one reading, in the frame of the phase: blocks of a tone of size 1, and the variance of their noise.
fn combined(parts: &[&Part]) -> (f64, f64, Vec<[f64; 2]>) {
    let weight: f64 = parts.iter().map(|p| p.gain.norm_sqr() / p.variance).sum();
    let blocks = (0..parts[0].blocks.len()).map(|k| {
        let each = parts.iter();
        let z: Complex<f64> = each.map(|p| p.gain.conj() / p.variance * p.blocks[k]).sum();
        [z.re / weight, z.im / weight]
    });
    let ratio = parts[0].ratio * parts[0].sign;
    (ratio, weight.recip(), blocks.collect())
}

/// The parts that are farther than a reach from all of multiples before them: of two that sampling puts in one place the second is not
/// told.
fn apart(all: Vec<Part>, omega: f64, reach: f64) -> Vec<Part> {
    let mut kept: Vec<Part> = vec![];
    for next in all {
        let place = |p: &Part| folded(p.ratio * omega).0;
        let clear = |other: &Part| {
            other.ratio.total_cmp(&next.ratio).is_eq()
                || (place(other) - place(&next)).abs() > reach
        };
        if kept.iter().all(clear) {
            kept.push(next);
        }
    }
    kept
}

/// Blocks either side of a multiple, in coefficients, so that the widest of some is held.
fn blocks_for(lead: &Lead, widest: f64, n: usize) -> usize {
    let spacing = PI / n as f64;
    let half = lead.stated[2].0;
    let held = (HELD * REACH * widest * half / spacing) as usize;
    let apart = (APART * folded(lead.omega()).0 / spacing) as usize;
    held.clamp(LEAST_BLOCKS, apart.max(LEAST_BLOCKS))
}

/// What channels tell of a phase in so many blocks: what they have of it, the phase, and by how many nats that is ahead of noise.
struct Told {
    parts: Vec<Part>,
    lead: Lead,
    nats: f64,
}

/// The phase by multiples that are asked for, told by one that is known; none where the pitch itself is not heard, or its phase is in
/// doubt.
fn told(all: &[Heard], asked: &[f64], before: &Lead, count: usize) -> Option<Told> {
    let n = all.first()?.coefficients.len();
    let each = asked.iter().flat_map(|r| all.iter().map(move |h| (h, *r)));
    let found = each.filter_map(|(h, r)| part(h, r, before, count));
    let found = found.filter(|p| p.nats > LEAST_PART).collect();
    let parts = apart(found, before.path.omega, count as f64 * PI / n as f64);
    let of = |ratio: &f64| {
        let there = parts.iter().filter(|p| p.ratio.total_cmp(ratio).is_eq());
        let there: Vec<&Part> = there.collect();
        (!there.is_empty()).then(|| combined(&there))
    };
    let readings: Vec<_> = asked.iter().filter_map(of).collect();
    if readings.first().is_none_or(|(ratio, ..)| *ratio != 1.0) {
        return None;
    }
    let (lead, nats) = followed(&readings, before, n as f64 / count as f64)?;
    Some(Told { parts, lead, nats })
}

/// The same in blocks that are halved as long as that tells more: a phase that all tell together is known within blocks in which
/// none of them alone tells it.
fn in_shorter_blocks(all: &[Heard], asked: &[f64], mut best: Told, mut count: usize) -> Told {
    for _ in 0..MOST_DOUBLED {
        count *= 2;
        let next = told(all, asked, &best.lead, count);
        let tells_more =
            |t: &Told| t.parts.len() == best.parts.len() && t.nats > best.nats + MARGIN;
        match next.filter(tells_more) {
            Some(next) => best = next,
            None => break,
        }
    }
    best
}

/// The rotor that is heard about a tone of one channel; none where it is a line, or a noise of one channel.
fn rotor(all: &[Heard], seed: Seed) -> Option<Rotor> {
    let n = all.first()?.coefficients.len();
    let multiples: Vec<f64> = ratios().collect();
    let mut count = blocks_for(&seed.lead, 1.0, n);
    let mut found = told(all, &[1.0], &seed.lead, count)?;
    for _ in 1..ROUNDS {
        let widest = found.parts.iter().map(|p| p.ratio).fold(1.0, f64::max);
        count = blocks_for(&found.lead, widest, n);
        found = told(all, &multiples, &found.lead, count)?;
    }
    let Told {
        parts, mut lead, ..
    } = in_shorter_blocks(all, &multiples, found, count);
    let shared = parts.iter().any(|p| p.heard != parts[0].heard);
    Arc::make_mut(&mut lead.path).shared = shared;
    let is_alone = parts.len() == 1;
    let parts = parts.iter().filter_map(|p| Some((p.target?, p.ratio)));
    let rotor = Rotor {
        lead,
        claim: seed.claim,
        parts: parts.collect(),
    };
    let is_course = seed.log_time > FORGOTTEN.ln();
    let is_line = rotor.lead.stated[2].0 < NARROWEST * PI / n as f64;
    (!is_line && (is_course || !is_alone)).then_some(rotor)
}

/// The phase by some readings of it, block by block of a length, what is told of it, and by how many nats it is ahead of noise.
fn followed(
    readings: &[(f64, f64, Vec<[f64; 2]>)],
    before: &Lead,
    length: f64,
) -> Option<(Lead, f64)> {
    let [_, _, _, (pitch, _), (time, _)] = before.stated;
    let start = [0.0, (pitch * length).ln(), (time / length).ln(), 0.0];
    let each = readings.iter().map(|(ratio, variance, blocks)| Reading {
        ratio: *ratio,
        variance: *variance,
        blocks,
    });
    let seen: Tracked = likeliest(&each.collect::<Vec<_>>(), &[start as Coordinates]);
    let nats = seen.nats;
    let attempt = Attempt {
        seen,
        middle: before.path.omega,
        length,
    };
    let lead = Lead::of(&attempt);
    (lead.path.doubt() < LARGEST_DOUBT).then_some((lead, nats))
}

/// A tone that one channel tells by itself, what its pitch claims, and the logarithm of its correlation time, blocks.
struct Seed {
    lead: Lead,
    claim: Outcome,
    log_time: f64,
}

/// The tone that a peak of a channel's spectrum is, where its phase can be told.
fn seed(heard: &Heard, peak: &Peak) -> Option<Seed> {
    let coefficients = &heard.coefficients;
    let n = coefficients.len();
    let spacing = PI / n as f64;
    let half = (REACH * peak.half_width).max(LEAST_REACH * spacing);
    let bins = |omega: f64| ((omega / spacing).max(1.0) as usize).min(n);
    let about = all_about(bins(peak.omega - half), bins(peak.omega + half), n);
    let density = density(&coefficients[about]);
    let over = |by: f64, before: Option<&Attempt>| {
        let (from, to) = (peak.omega - by * half, peak.omega + by * half);
        Attempt::over(coefficients, (from, to), density, before)
    };
    let (best, claim) = widest(over)?;
    Some(Seed {
        lead: Lead::of(&best),
        claim,
        log_time: best.seen.at[2],
    })
}

impl State {
    /// Whether one line was found about a peak, and nothing else there: it needs no skirts.
    fn has_lone_line(&self, peak: &Peak, spacing: f64) -> bool {
        let places = places(self, spacing);
        let there = places.iter().find(|p| (p.from..p.to).contains(&peak.omega));
        there.is_some_and(|p| matches!(p.terms[..], [i] if !self.terms[i].is_band()))
    }
}

/// Whether what was found on a channel may be a tone whose pitch wanders.
fn may_be_tone(term: &Term) -> bool {
    let is_line = matches!(term.form, Form::Line(..) | Form::SideBands(..));
    is_line || term.is_band() || term.is_any_spectrum()
}

/// The rotors that channels which were searched each alone, and accelerometers beside them, hear; those told best first.
pub(crate) fn rotors(grid: &Grid, searched: &[Searched<'_>]) -> Vec<Rotor> {
    let has_tone = |s: &Searched<'_>| s.state.terms.iter().any(may_be_tone);
    if !searched.iter().any(has_tone) {
        return vec![];
    }
    let gyros = searched.iter().enumerate().map(|(k, s)| Heard {
        number: k,
        coefficients: Arc::clone(&s.target.coefficients),
        target: Some(k),
    });
    let beside = grid.signals.iter();
    let accelerometers = beside
        .filter(|s| s.quantity == Quantity::Acc)
        .enumerate()
        .map(|(k, s)| Heard {
            number: searched.len() + k,
            coefficients: Arc::new(grid.dct.forward(&s.values)),
            target: None,
        });
    let all: Vec<Heard> = gyros.chain(accelerometers).collect();
    let peaks_of = |h: &Heard| match h.target.map(|k| searched[k].target) {
        Some(t) => bands::peaks(&h.coefficients, &t.noise, t.white, &grid.bins),
        None => {
            let white = density(&h.coefficients[grid.n / 2..]);
            bands::peaks(
                &h.coefficients,
                &Noise::new(f64::NEG_INFINITY),
                white,
                &grid.bins,
            )
        }
    };
    let each = all
        .iter()
        .flat_map(|h| peaks_of(h).into_iter().map(move |p| (h, p)));
    let mut peaks: Vec<(&Heard, Peak)> = each.collect();
    // The strongest tells its phase best.
    let energy = |p: &Peak| p.variance * p.half_width;
    peaks.sort_by(|a, b| energy(&b.1).total_cmp(&energy(&a.1)));
    let spacing = PI / grid.n as f64;
    let mut found: Vec<Rotor> = vec![];
    let mut tries = 0;
    for (heard, peak) in peaks {
        if heard
            .target
            .is_some_and(|k| searched[k].state.has_lone_line(&peak, spacing))
        {
            continue;
        }
        let is_part = |r: &Rotor| {
            ratios().any(|ratio| {
                let (middle, half) = r.lead.place(ratio, spacing);
                (peak.omega - middle).abs() < half
            })
        };
        if found.iter().any(is_part) {
            continue;
        }
        if found.len() == MOST_ROTORS || tries == MOST_TRIES {
            break;
        }
        tries += 1;
        found.extend(seed(heard, &peak).and_then(|seed| rotor(&all, seed)));
    }
    found.retain(|r| !r.parts.is_empty());
    found
}
