//! The fifth set's noise and codes.

use std::f64::consts::{PI, TAU};

use super::super::kept_back::{of_law, shares, variance};
use super::super::kept_back_fourth::noise::of_density;
use super::super::{Change, Foreign};
use crate::random::Draw;
use crate::stand::{LSB, Stand, held, wander};
use crate::strength::size_for;

/// One of them; `None` for another name.
pub(super) fn one(
    draw: &mut Draw,
    stand: &mut Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Option<Foreign> {
    Some(match name {
        "noise of a supply near its end" => {
            let missing = near_end(draw, stand);
            variance(name, wanted, &|size| {
                missing.iter().map(|m| 1.0 + size * m).collect()
            })
        }
        "noise that a loop holds down" => held_down(draw, stand, name, axis, wanted),
        "dead zone of a push-pull stage" => dead_zone(draw, stand, name, axis, wanted),
        _ => return None,
    })
}

/// How much of its input's noise a regulator lets through, by sample: the less is left above its output, the less its loop
/// can hold it down, by a factor e for every few millivolts. The loads are of many sizes.
fn near_end(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let (n, rate_hz) = (stand.samples(), stand.rate_hz);
    let most = draw.between(0.05, 0.15);
    let load = held(draw, n, rate_hz, (3.0, 25.0), |d| d.between(0.0, most));
    let slow = wander(draw, n, rate_hz, 0.001, 60.0);
    stand.world.supply = load.iter().zip(slow).map(|(l, s)| 5.0 - l - s).collect();
    let fold = most * draw.between(0.1, 0.4);
    let supply = &stand.world.supply;
    let least = supply.iter().copied().fold(f64::INFINITY, f64::min);
    supply.iter().map(|u| ((least - u) / fold).exp()).collect()
}

/// Density, of mean 1, of white noise that a loop of first order holds down below its edge: without the loop's share of it,
/// |jw / (jw + edge)|^2 is left.
pub(in super::super) struct HeldDown {
    edge: f64,
    mean: f64,
}

impl HeldDown {
    /// By the edge of the loop, Hz.
    pub(in super::super) fn new(edge_hz: f64, rate_hz: f64) -> Self {
        let edge = TAU * edge_hz / rate_hz;
        // Mean of w^2 / (w^2 + edge^2) over 0..pi.
        let mean = 1.0 - edge / PI * (PI / edge).atan();
        Self { edge, mean }
    }

    /// Density at an angular frequency, rad per sample.
    pub(in super::super) fn density(&self, w: f64) -> f64 {
        w * w / (w * w + self.edge * self.edge) / self.mean
    }
}

/// A gyro that is balanced by force: what the loop can follow it takes out of its own noise, and what is faster stays. A
/// stage behind the loop adds white noise that no loop sees.
fn held_down(
    draw: &mut Draw,
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Foreign {
    let part = HeldDown::new(draw.by_ratio(0.7, 3.0), stand.rate_hz);
    of_density(draw, stand, name, axis, wanted, &|w| part.density(w))
}

/// First code and lower edges, counts, of a stage that does not answer until its input is `zone` counts off zero, and then
/// answers by what is beyond; zero lies at `middle`.
fn edges(middle: i32, reach: i32, zone: f64) -> (i32, Vec<f64>) {
    let edge = |code: i32| {
        let off = if code > middle { zone } else { -zone };
        f64::from(code) - 0.5 + off
    };
    let first = middle - reach;
    (first, (first..=middle + reach).map(edge).collect())
}

/// Crossover: of two transistors that push and pull, neither leads until the input is a little off zero. Firmware that takes
/// the bias off and then divides whole numbers does the same by half a count: the quotient is cut towards zero. What is
/// left of the bias lies within a sigma of that zero.
fn dead_zone(
    draw: &mut Draw,
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Foreign {
    let (bias, sigma) = (stand.bias[axis] / LSB, stand.white(axis).sqrt() / LSB);
    let middle = (bias + draw.between(-1.0, 1.0) * sigma).round() as i32;
    let reach = (8.0 * sigma).ceil() as i32;
    // Two sigma of it would leave few readings but zero.
    let at = |zone: f64| edges(middle, reach, zone.min(2.0 * sigma));
    let strength = |zone: f64| {
        let (first, edges) = at(zone);
        of_edges(stand, axis, first, &edges)
    };
    let zone = size_for(wanted, &strength);
    let (first, edges) = at(zone);
    Foreign {
        name,
        strength: of_edges(stand, axis, first, &edges),
        change: Change::Edges(first, edges),
    }
}

/// Mean and sigma, counts, that who knows of no edges finds: those of the codes, without what even rounding adds.
pub(in super::super) fn refitted(
    stand: &Stand,
    axis: usize,
    first: i32,
    edges: &[f64],
) -> (f64, f64) {
    let law = shares(
        edges,
        stand.bias[axis] / LSB,
        stand.white(axis).sqrt() / LSB,
    );
    let codes = || {
        law.iter()
            .enumerate()
            .map(|(i, p)| (f64::from(first) + i as f64, p))
    };
    let mean: f64 = codes().map(|(code, p)| p * code).sum();
    let spread: f64 = codes().map(|(code, p)| p * (code - mean).powi(2)).sum();
    (mean, (spread - 1.0 / 12.0).max(1e-3).sqrt())
}

/// d' of these edges, mean and variance refitted.
pub(in super::super) fn of_edges(stand: &Stand, axis: usize, first: i32, edges: &[f64]) -> f64 {
    let (bias, sigma) = (stand.bias[axis] / LSB, stand.white(axis).sqrt() / LSB);
    let straight: Vec<f64> = (0..edges.len())
        .map(|i| f64::from(first) + i as f64 - 0.5)
        .collect();
    let (mean, spread) = refitted(stand, axis, first, edges);
    of_law(
        &shares(edges, bias, sigma),
        &shares(&straight, mean, spread),
        stand.samples(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stand::Needs;

    fn stand() -> Stand {
        let draw = &mut Draw::of(20_261_121, 34, 0);
        Stand::draw(draw, 3000.0, 20.0, Needs::default())
    }

    #[test]
    fn what_a_loop_holds_down_has_variance_1_and_nothing_at_the_lowest() {
        let stand = stand();
        let draw = &mut Draw::of(20_261_121, 35, 0);
        let f = held_down(draw, &stand, "noise that a loop holds down", 0, 60.0);
        let Change::Noise(x, _) = &f.change else {
            panic!("no noise")
        };
        let mean = x.iter().map(|v| v * v).sum::<f64>() / x.len() as f64;
        assert!((mean - 1.0).abs() < 0.06, "{mean}");
        let part = HeldDown::new(2.0, 20.0);
        let at = |f: f64| part.density(TAU * f / 20.0);
        // Half of the plateau at the edge.
        assert!(at(0.01) < 1e-4 && (at(2.0) / at(1e3) - 0.5).abs() < 1e-3);
        let cells = 10_000;
        let sum: f64 = (0..cells)
            .map(|i| at(10.0 * (f64::from(i) + 0.5) / f64::from(cells)))
            .sum();
        assert!((sum / f64::from(cells) - 1.0).abs() < 1e-3);
    }

    #[test]
    fn an_even_stage_is_no_effect_and_a_zone_makes_zero_wider_and_leaves_no_code_out() {
        let stand = stand();
        let middle = (stand.bias[0] / LSB).round() as i32;
        let (first, straight) = edges(middle, 40, 0.0);
        assert!(of_edges(&stand, 0, first, &straight) < 0.5);
        let (first, zone) = edges(middle, 40, 1.5);
        for (i, w) in zone.windows(2).enumerate() {
            let wide = if first + i as i32 == middle { 4.0 } else { 1.0 };
            assert!((w[1] - w[0] - wide).abs() < 1e-9);
        }
        assert!(of_edges(&stand, 0, first, &zone) > 25.0);
    }
}
