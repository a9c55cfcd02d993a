//! The eighth set's couplings of axes and codes.

use super::super::kept_back::shares;
use super::super::kept_back_fifth::noise::of_edges;
use super::super::kept_back_fourth::about_mean;
use super::super::kept_back_fourth::codes::{law, long_run, of_steps};
use super::super::kept_back_sixth::codes::{coupled, refitted, white_of};
use super::super::{Change, Foreign};
use crate::random::Draw;
use crate::stand::{LSB, Stand};
use crate::strength::size_for;

/// One of them; `None` for another name.
pub(super) fn one(
    draw: &mut Draw,
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Option<Foreign> {
    Some(match name {
        "changes of another axis" => changes(draw, stand, name, axis, wanted),
        "magnitude of another axis" => magnitude(draw, stand, name, axis, wanted),
        "amplifier that bends to a logarithm" => bent(draw, stand, name, axis, wanted),
        "play in the reading" => play(stand, name, axis, wanted),
        _ => return None,
    })
}

/// The axes are converted in turn, this one first, and a capacitor between them lets changes through alone: what another
/// reading has changed by, up to the frame before.
fn changes(
    draw: &mut Draw,
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Foreign {
    let (other, sign) = ((axis + 1 + draw.of_many(2)) % 3, draw.sign());
    let white = white_of(draw, stand, other);
    let like: Vec<f64> = (0..white.len())
        .map(|i| white[i] - white[i.saturating_sub(1)])
        .collect();
    coupled(stand, name, axis, wanted, &like, move |counts, i| {
        let at = |before: usize| LSB * f64::from(counts[other][i.saturating_sub(before)]);
        sign * (at(1) - at(2))
    })
}

/// A rectifier on the board: how far another axis is off its middle, either way.
fn magnitude(
    draw: &mut Draw,
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Foreign {
    let (other, sign) = ((axis + 1 + draw.of_many(2)) % 3, draw.sign());
    let white = white_of(draw, stand, other);
    let like = about_mean(&white.iter().map(|v| v.abs()).collect::<Vec<f64>>());
    // Of half a normal law, so that the bias of this axis stays.
    let mean = (2.0 / std::f64::consts::PI * stand.white(other)).sqrt();
    let middle = stand.bias[other];
    coupled(stand, name, axis, wanted, &like, move |counts, i| {
        sign * ((LSB * f64::from(counts[other][i]) - middle).abs() - mean)
    })
}

/// First code and lower edges, counts, of an amplifier that reads asinh(bend x) / bend of what is x off its middle.
fn of_bend(middle: f64, reach: i32, bend: f64) -> (i32, Vec<f64>) {
    let first = middle.round() as i32 - reach;
    let edge = |code: i32| {
        let off = f64::from(code) - 0.5 - middle;
        middle + (bend * off).sinh() / bend
    };
    (first, (first..=first + 2 * reach).map(edge).collect())
}

/// An amplifier that is straight for small rates and bends to a logarithm for large ones, either way, so that they fit into
/// few codes; nobody has bent them back.
fn bent(draw: &mut Draw, stand: &Stand, name: &'static str, axis: usize, wanted: f64) -> Foreign {
    let (mean, sigma) = (stand.bias[axis] / LSB, stand.white(axis).sqrt() / LSB);
    let middle = mean + sigma * draw.between(-0.3, 0.3);
    let reach = (10.0 * sigma).ceil() as i32;
    let at = |bend: f64| of_bend(middle, reach, bend.min(3.0) / sigma);
    let strength = |bend: f64| {
        let (first, edges) = at(bend);
        of_edges(stand, axis, first, &edges)
    };
    let bend = size_for(wanted, &strength);
    let (first, edges) = at(bend);
    Foreign {
        name,
        strength: of_edges(stand, axis, first, &edges),
        change: Change::Edges(first, edges),
    }
}

/// Chances from each code (row) to the next reading's, when it follows the rate to within so many counts.
pub(in super::super) fn steps_with_play(stand: &Stand, axis: usize, play: f64) -> Vec<Vec<f64>> {
    let (mean, sigma) = (stand.bias[axis] / LSB, stand.white(axis).sqrt() / LSB);
    let (first, even) = law(stand, axis);
    // Codes of what is left when the play is taken off, below and above.
    let edges = |off: f64| -> Vec<f64> {
        (0..=even.len())
            .map(|i| f64::from(first) + i as f64 - 0.5 + off)
            .collect()
    };
    let up = shares(&edges(play), mean, sigma);
    let down = shares(&edges(-play), mean, sigma);
    (0..even.len())
        .map(|from| {
            let to = |to: usize| match to.cmp(&from) {
                std::cmp::Ordering::Less => down[to],
                std::cmp::Ordering::Equal => 0.0,
                std::cmp::Ordering::Greater => up[to],
            };
            let mut row: Vec<f64> = (0..even.len()).map(to).collect();
            row[from] = 1.0 - row.iter().sum::<f64>();
            row
        })
        .collect()
}

/// d' of readings with so much play, mean and variance refitted.
pub(in super::super) fn of_play(stand: &Stand, axis: usize, play: f64) -> f64 {
    let (first, even) = law(stand, axis);
    let steps = steps_with_play(stand, axis, play);
    let long = long_run(&steps, &even);
    let other = refitted(first, &long);
    of_steps(&steps, &long, &|_, to| other[to], stand.samples())
}

/// Largest play, counts.
const MOST_PLAY: f64 = 6.0;

/// What a code becomes when the rate is `at`, counts, and the code may stay `play` behind it.
fn followed(code: i32, at: f64, play: f64) -> i32 {
    let (low, high) = ((at - play).round() as i32, (at + play).round() as i32);
    code.clamp(low, high)
}

/// A tracking converter whose comparator has hysteresis: its code moves only when the rate is further off than that, and
/// then no closer.
fn play(stand: &Stand, name: &'static str, axis: usize, wanted: f64) -> Foreign {
    let strength = |play: f64| of_play(stand, axis, play.min(MOST_PLAY));
    let play = size_for(wanted, &strength).min(MOST_PLAY);
    let change = move |counts: &[Vec<i32>; 3], draw: &mut Draw| {
        let own = &counts[axis];
        let mut code = own[0];
        own.iter()
            .map(|c| {
                // Within its step the rate is anywhere.
                code = followed(code, f64::from(*c) + draw.between(-0.5, 0.5), play);
                code
            })
            .collect()
    };
    Foreign {
        name,
        strength: strength(play),
        change: Change::Made(Box::new(change)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stand::Needs;

    fn stand() -> Stand {
        let draw = &mut Draw::of(20_261_122, 74, 0);
        Stand::draw(draw, 600.0, 20.0, Needs::default())
    }

    #[test]
    fn steps_with_play_are_chances_and_no_play_is_none() {
        let stand = stand();
        for play in [0.0, 0.7, 3.0] {
            for row in steps_with_play(&stand, 0, play) {
                assert!((row.iter().sum::<f64>() - 1.0).abs() < 1e-9);
                assert!(row.iter().all(|p| *p >= 0.0));
            }
        }
        assert!(of_play(&stand, 0, 0.0) < 1.0 && of_play(&stand, 0, 0.5) > 3.0);
    }

    #[test]
    fn readings_with_play_stand_as_often_as_the_steps_say() {
        let stand = stand();
        let play = 0.8;
        let (_, even) = law(&stand, 0);
        let steps = steps_with_play(&stand, 0, play);
        let shares = long_run(&steps, &even);
        let told: f64 = (0..even.len()).map(|i| shares[i] * steps[i][i]).sum();
        let draw = &mut Draw::of(20_261_122, 75, 0);
        let (mean, sigma) = (stand.bias[0] / LSB, stand.white(0).sqrt() / LSB);
        const N: i32 = 200_000;
        let (mut code, mut stands) = (mean.round() as i32, 0);
        for _ in 0..N {
            let next = followed(code, mean + sigma * draw.normal(), play);
            stands += i32::from(next == code);
            code = next;
        }
        let seen = f64::from(stands) / f64::from(N);
        let error = (told * (1.0 - told) / f64::from(N)).sqrt();
        // Readings that stand come in runs.
        assert!((seen - told).abs() < 8.0 * error, "{seen} {told}");
    }

    #[test]
    fn a_bent_amplifier_reads_the_inverse_hyperbolic_sine() {
        let (first, edges) = of_bend(2.3, 40, 0.2);
        for x in [-25.0, -3.0, 0.4, 2.3, 11.0, 60.0] {
            let code = first + edges.partition_point(|e| *e <= x) as i32 - 1;
            let told = 2.3 + (0.2f64 * (x - 2.3)).asinh() / 0.2;
            assert!(
                (f64::from(code) - told).abs() <= 0.5 + 1e-9,
                "{x}: {code} {told}"
            );
        }
    }
}
