//! Mounts that ring on for seconds: longer than the shapes that a search over all times holds against the readings.
//!
//! A ring that is worth it to be told is far beyond the noise where it begins, so only stretches of far readings are asked. There a short
//! ring stands out at its begin; from that one its time constant and pitch are followed to longer ones. A hand that turns the base, a
//! band that is loud for a while and a sensor that settles are no such ring: it explains nearly all of itself, over many periods.

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use model::effects::shock::{LONGEST_RING_S, LONGEST_S, PERIODS};
use numerics::order_statistics::robust_sigma;

use super::{Blow, FALLEN, MOST, PITCH, Shape, rings, with_margin};
use crate::ingest::spikes::spike_limit;

/// Fewest far readings of one: a ring over three periods has two in each.
const FEWEST: usize = 2 * PERIODS as usize;
/// From a time constant to the next, and pitches on either side of the last one, in parts of 1 over the time constant.
const LONGER: f64 = 1.25;
const PITCHES: i32 = 3;
const FINER: f64 = 0.4;
/// Rounds in which time constant and pitch are found to a third of what they were.
const ROUNDS: i32 = 5;
/// Part of its energy that a ring may leave, before its place is known better than that: a tone of the same energy throughout leaves a
/// fifth, band noise and hands more.
const LEFT: f64 = 0.1;
/// How much longer than the longest it may seem.
const SEEMS: f64 = 1.3;

/// A ring in some channels at one time.
#[derive(Clone, Copy)]
struct Ring {
    energy: f64,
    at: usize,
    fades: f64,
    pitch: f64,
}

/// The channels of a record, whitened, and their standard deviations.
struct Record<'a> {
    channels: &'a [Vec<f64>],
    sigma: Vec<f64>,
}

/// The rings of a few seconds; they are taken off the whitened channels. None where there are more than a base at rest feels.
pub(super) fn take_off(channels: &mut [Vec<f64>], rate_hz: f64, shortest: f64) -> Vec<Blow> {
    let of = |seconds: f64| (seconds * rate_hz).max(1.0);
    let sigma: Vec<f64> = channels.iter().map(|e| robust_sigma(e)).collect();
    let stretches = far(channels, &sigma, of(LONGEST_S) as usize);
    if stretches.len() > MOST {
        return vec![];
    }
    let longest = of(LONGEST_RING_S) / FALLEN;
    let mut found = vec![];
    for stretch in stretches {
        let record = Record {
            channels,
            sigma: sigma.clone(),
        };
        let Some(ring) = record.ring(&stretch, shortest, longest) else {
            continue;
        };
        let periods = FALLEN * ring.fades * ring.pitch / TAU;
        if ring.fades < LONGER * shortest || ring.fades > SEEMS * longest || periods < PERIODS {
            continue;
        }
        let shape = Shape::Ring(ring.fades, ring.pitch);
        let all: Vec<Option<Vec<f64>>> = (0..channels.len())
            .map(|k| record.course(ring, k))
            .collect();
        let felt: Vec<usize> = (0..all.len()).filter(|k| all[*k].is_some()).collect();
        if felt.is_empty() {
            continue;
        }
        for (e, course) in channels.iter_mut().zip(all) {
            let course = course.into_iter().flatten();
            e[ring.at..]
                .iter_mut()
                .zip(course)
                .for_each(|(e, c)| *e -= c);
        }
        found.push(Blow {
            readings: with_margin(ring.at, shape, channels[0].len()),
            first: ring.at,
            shape,
            felt,
        });
    }
    found
}

/// Stretches of readings that are far off on any channel, no two of them more than `apart` from each other.
fn far(channels: &[Vec<f64>], sigma: &[f64], apart: usize) -> Vec<Range<usize>> {
    let n = channels.first().map_or(0, Vec::len);
    let limit = spike_limit(n.max(2));
    let mut all: Vec<(Range<usize>, usize)> = vec![];
    for i in 0..n {
        let is_far = channels
            .iter()
            .zip(sigma)
            .any(|(e, s)| e[i].abs() > limit * s);
        match all.last_mut() {
            _ if !is_far => {}
            Some((last, count)) if i - last.end < apart => {
                last.end = i + 1;
                *count += 1;
            }
            _ => all.push((i..i + 1, 1)),
        }
    }
    let many = all.into_iter().filter(|(_, count)| *count >= FEWEST);
    many.map(|(stretch, _)| stretch).collect()
}

impl Record<'_> {
    /// The strongest ring that begins about a stretch.
    fn ring(&self, stretch: &Range<usize>, shortest: f64, longest: f64) -> Option<Ring> {
        let n = self.channels.first()?.len();
        let pitches = (PI * shortest / PITCH).round().max(1.0) as usize;
        let before = stretch.start.saturating_sub((FALLEN * shortest) as usize);
        let coarse = (0..pitches).map(|i| PI * (i as f64 + 0.5) / pitches as f64);
        let reach = |fades: f64| (2.0 * FALLEN * fades) as usize;
        let part = |fades: f64| before..(stretch.end + reach(fades)).min(n);
        let strongest = |fades: f64, pitch: &mut dyn Iterator<Item = f64>| {
            let of = |pitch: f64| self.strongest(part(fades), fades, pitch);
            let all = pitch.filter(|p| (0.0..PI).contains(p)).map(of);
            all.max_by(|a, b| a.energy.total_cmp(&b.energy))
        };
        let near =
            |pitch: f64, by: f64| (-PITCHES..=PITCHES).map(move |i| pitch + by * f64::from(i));
        let mut last = strongest(shortest, &mut coarse.into_iter())?;
        let mut best = last;
        while last.fades < SEEMS * longest {
            let fades = LONGER * last.fades;
            last = strongest(fades, &mut near(last.pitch, FINER / last.fades))?;
            if last.energy > best.energy {
                best = last;
            }
        }
        for round in 1..=ROUNDS {
            let finer = 3f64.powi(-round);
            let middle = best;
            for i in -PITCHES..=PITCHES {
                let fades = middle.fades * LONGER.powf(finer * f64::from(i));
                let pitch = &mut near(middle.pitch, FINER * finer / middle.fades);
                let next = strongest(fades, pitch)?;
                if next.energy > best.energy {
                    best = next;
                }
            }
        }
        Some(best)
    }

    /// Where in a part of the record a ring of that time constant and pitch has most energy.
    fn strongest(&self, part: Range<usize>, fades: f64, pitch: f64) -> Ring {
        let mut sum = vec![0.0; part.len()];
        for (e, s) in self.channels.iter().zip(&self.sigma) {
            let all = rings(&e[part.clone()], fades, pitch);
            let scale = (s * s).max(f64::MIN_POSITIVE);
            sum.iter_mut()
                .zip(all)
                .for_each(|(sum, v)| *sum += v / scale);
        }
        let all = sum.into_iter().enumerate();
        let (at, energy) = all.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, 0.0));
        Ring {
            energy,
            at: part.start + at,
            fades,
            pitch,
        }
    }

    /// The course of a ring on a channel from its begin on; none where that feels none, or where what is left is no noise.
    fn course(&self, ring: Ring, channel: usize) -> Option<Vec<f64>> {
        let (e, sigma) = (&self.channels[channel], self.sigma[channel]);
        let end = (ring.at + (2.0 * FALLEN * ring.fades) as usize).min(e.len());
        let own = &e[ring.at..end];
        let column = |f: fn(f64) -> f64| -> Vec<f64> {
            let at = |s: f64| (-s / ring.fades).exp() * f(ring.pitch * s);
            (0..own.len()).map(|s| at(s as f64)).collect()
        };
        let (c, s) = (column(f64::cos), column(f64::sin));
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let (cc, ss, cs) = (dot(&c, &c), dot(&s, &s), dot(&c, &s));
        let (ce, se) = (dot(&c, own), dot(&s, own));
        let determinant = (cc * ss - cs * cs).max(f64::MIN_POSITIVE);
        let (a, b) = (
            (ss * ce - cs * se) / determinant,
            (cc * se - cs * ce) / determinant,
        );
        let course: Vec<f64> = c.iter().zip(&s).map(|(c, s)| a * c + b * s).collect();
        // The noise has its part in what there is, and in what is left.
        let noise = own.len() as f64 * sigma * sigma;
        let explained = dot(&course, &course);
        let left = dot(own, own) - explained - noise;
        let limit = spike_limit(e.len()).powi(2) * sigma * sigma;
        (explained > limit && left < LEFT * explained).then_some(course)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(of: &dyn Fn(f64) -> f64) -> Vec<Blow> {
        let noise = crate::fit::white(20_000, 5);
        let at = |(i, e): (usize, &f64)| e + of(i as f64 / 100.0 - 80.0);
        let mut all = vec![noise.iter().enumerate().map(at).collect()];
        take_off(&mut all, 100.0, 32.0)
    }

    #[test]
    fn a_ring_of_seconds_is_found_with_its_time_constant_and_pitch() {
        for (strength, duration, hz) in [(25.0, 1.3, 30.0), (200.0, 2.0, 7.7), (1000.0, 4.5, 3.1)] {
            let ring = |t: f64| {
                let course = (-FALLEN * t / duration).exp() * (TAU * hz * t + 0.4).cos();
                if t < 0.0 { 0.0 } else { strength * course }
            };
            let all = found(&ring);
            let [blow] = &all[..] else { panic!("{all:?}") };
            let Shape::Ring(fades, pitch) = blow.shape else {
                panic!("{blow:?}")
            };
            let wanted = 100.0 * duration / FALLEN;
            assert!(blow.first.abs_diff(8000) < 3, "{blow:?}");
            assert!((fades / wanted - 1.0).abs() < 0.1, "{blow:?}");
            assert!((pitch - TAU * hz / 100.0).abs() * wanted < 0.1, "{blow:?}");
        }
    }

    #[test]
    fn a_tone_that_ends_a_hand_and_a_settling_are_none() {
        let tone = |t: f64| match t {
            0.0..3.0 => 60.0 * (TAU * 9.0 * t).sin(),
            _ => 0.0,
        };
        let hand = |t: f64| match t {
            0.0..4.0 => 90.0 * (PI * t / 4.0).sin() * (TAU * 0.9 * t).sin(),
            _ => 0.0,
        };
        let settles = |t: f64| if t < 0.0 { 0.0 } else { 80.0 * (-t).exp() };
        let half = |t: f64| match t {
            0.0..2.0 => 80.0 * (PI * t / 2.0).sin(),
            _ => 0.0,
        };
        for other in [&tone as &dyn Fn(f64) -> f64, &hand, &settles, &half] {
            assert_eq!(found(other), vec![]);
        }
    }
}
