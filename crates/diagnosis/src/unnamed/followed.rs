//! What follows recorded channels as no effect of the library does: a simulation has no such channel, so that it is told over
//! time. What is too fast for knots is noise of the same size and memory.

use std::f64::consts::PI;

use model::unnamed::{Column, Domain, Unnamed};

use super::term;
use crate::fit::channel::{self, Term};
use crate::ingest::types::Grid;
use crate::search::searched::Searched;

/// Fewest and most knots of a course over time; their number doubles until the course is told.
const KNOTS: (usize, usize) = (64, 2048);
/// Share of the energy of a course, or of the white noise where that has less, that need not be told: a course may nearly cancel
/// what stands beside it.
const LEFT_OUT: f64 = 0.01;
/// Least correlation of neighbours of what is noise: less is white.
const WHITE: f64 = 0.02;

/// The terms of a channel that the search found by combinations of recorded channels.
pub(super) fn of_combinations(s: &Searched<'_>, grid: &Grid) -> Vec<Unnamed> {
    let found =
        (s.state.parts()).filter(|(t, own)| t.effect.id() == channel::ID && !own.is_empty());
    found
        .flat_map(|(t, own)| of_course(s, &course(s, t, own), grid.rate_hz))
        .collect()
}

/// What a term adds to the readings, sample by sample.
fn course(s: &Searched<'_>, t: &Term, own: &[f64]) -> Vec<f64> {
    let panel = &s.search.panel;
    let mut sum = vec![0.0; panel.bins.n];
    panel.add_columns(&mut sum, 0, &t.columns, own);
    panel.dct.inverse(&sum)
}

fn of_course(s: &Searched<'_>, course: &[f64], rate_hz: f64) -> Vec<Unnamed> {
    let Told {
        length,
        means,
        rest,
    } = Told::of(course, s.state.solution.white);
    let energy = |of: &[f64]| of.iter().map(|v| v * v).sum::<f64>();
    let rms = |energy: f64| (energy / course.len().max(1) as f64).sqrt();
    let (all, left) = (energy(course), energy(&rest));
    let mut terms = vec![];
    if left < (1.0 - LEFT_OUT) * all {
        let middle = |k: usize| (k as f64 + 0.5) * length as f64 / rate_hz;
        let columns = vec![
            Column::new((0..means.len()).map(middle).collect(), "s"),
            Column::new(means, &s.target.unit),
        ];
        terms.push(term(s, Domain::Mean, rms((all - left).max(0.0)), columns));
    }
    if left > LEFT_OUT * all {
        let of_neighbours: f64 = rest
            .iter()
            .zip(rest.iter().skip(1))
            .map(|(a, b)| a * b)
            .sum();
        let width = -(of_neighbours / left).max(WHITE).ln() * rate_hz / PI;
        let columns = vec![
            Column::new(vec![0.0], "Hz"),
            Column::new(vec![width], "Hz"),
            Column::new(vec![rms(left)], &s.target.unit),
        ];
        terms.push(term(s, Domain::Spectrum, rms(left), columns));
    }
    terms
}

/// A course by means about its knots, and what they leave.
struct Told {
    /// Samples from knot to knot.
    length: usize,
    means: Vec<f64>,
    rest: Vec<f64>,
}

impl Told {
    /// By as few knots as tell it beside white noise of that variance; by the fewest where all of them would not.
    fn of(course: &[f64], white: f64) -> Self {
        let energy = |of: &[f64]| of.iter().map(|v| v * v).sum::<f64>();
        let counts = std::iter::successors(Some(KNOTS.0), |k| Some(2 * k));
        let told: Vec<Self> = counts
            .take_while(|k| *k <= KNOTS.1 && *k <= course.len())
            .map(|k| Self::by(course, k))
            .collect();
        let all = energy(course);
        let noise = white * course.len() as f64;
        let enough = |most: f64| told.iter().position(|t| energy(&t.rest) <= LEFT_OUT * most);
        let best = enough(all.min(noise)).or_else(|| enough(all));
        told.into_iter()
            .nth(best.unwrap_or(0))
            .unwrap_or_else(|| Self::by(course, KNOTS.0))
    }

    fn by(course: &[f64], knots: usize) -> Self {
        let length = course.len().div_ceil(knots).max(1);
        let means: Vec<f64> = (course.chunks(length))
            .map(|of| of.iter().sum::<f64>() / of.len() as f64)
            .collect();
        // As a simulation goes from one to the next.
        let told = |i: usize| {
            let at = (i as f64 / length as f64 - 0.5).clamp(0.0, (means.len() - 1) as f64);
            let k = (at as usize).min(means.len().saturating_sub(2));
            let next = means.get(k + 1).unwrap_or(&means[k]);
            means[k] + (at - k as f64) * (next - means[k])
        };
        let rest = course
            .iter()
            .enumerate()
            .map(|(i, v)| v - told(i))
            .collect();
        Self {
            length,
            means,
            rest,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slow_course_has_few_knots_a_fast_one_more_and_a_wild_one_few() {
        let knots = |period: f64| {
            let course: Vec<f64> = (0..12_000).map(|i| (f64::from(i) / period).sin()).collect();
            Told::of(&course, 1.0).means.len()
        };
        assert_eq!(knots(2000.0), KNOTS.0);
        assert!(knots(40.0) > 4 * KNOTS.0, "{}", knots(40.0));
        assert_eq!(knots(0.5), KNOTS.0);
    }
}
