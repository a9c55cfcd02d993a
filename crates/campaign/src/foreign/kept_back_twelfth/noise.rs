//! The twelfth set's noise.

use std::f64::consts::TAU;

use super::super::kept_back_ninth::in_time;
use super::super::kept_back_tenth::noise::by_law;
use super::super::{Change, Foreign};
use crate::random::Draw;
use crate::stand::{LSB, Stand, lagged};
use crate::strength::{Meter, size_for};

/// One of them; `None` for another name.
pub(super) fn one(
    draw: &mut Draw,
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Option<Foreign> {
    Some(match name {
        "bursts of a bus every few seconds" => {
            let shape = bursts(draw, stand);
            by_law(name, &shape, wanted)
        }
        "coupling capacitor in the signal's way" => coupled(stand, name, axis, wanted),
        _ => return None,
    })
}

/// A bus or a radio that is busy for a moment every few seconds, and adds noise as long as it is; its clock is another than
/// that of the readings.
pub(in super::super) fn bursts(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let period = draw.by_ratio(1.5, 10.0);
    let busy = draw.between(0.06, 0.3);
    let first = draw.between(0.0, 1.0);
    in_time(stand, |t| {
        f64::from(u8::from((first + t / period).fract() < busy))
    })
}

/// What a capacitor of this corner, Hz, leaves of the power at an angular frequency, rad per sample.
pub(in super::super) fn passed(corner_hz: f64, rate_hz: f64, w: f64) -> f64 {
    let keep = (-TAU * corner_hz / rate_hz).exp();
    keep * keep * (2.0 - 2.0 * w.cos()) / (1.0 + keep * keep - 2.0 * keep * w.cos())
}

/// d' of it: white noise and random walk both pass it.
pub(in super::super) fn of_corner(stand: &Stand, axis: usize, corner_hz: f64) -> f64 {
    let meter = Meter::new(stand, axis);
    let taken = |w: &f64| {
        let own = stand.white(axis) + stand.step(axis) / (2.0 - 2.0 * w.cos());
        own * (passed(corner_hz, stand.rate_hz, *w) - 1.0)
    };
    meter.of_density(&meter.omega().iter().map(taken).collect::<Vec<_>>())
}

/// What is left of a series about a level behind a capacitor that had settled at it.
fn behind_capacitor(series: &[f64], level: f64, corner_hz: f64, rate_hz: f64) -> Vec<f64> {
    let from_level: Vec<f64> = [level].iter().chain(series).copied().collect();
    let slow = lagged(&from_level, 1.0 / (TAU * corner_hz), rate_hz);
    series.iter().zip(&slow[1..]).map(|(v, s)| v - s).collect()
}

/// A capacitor in the signal's way, as for a part that is to feel shaking alone: what is slower than its corner does not
/// pass, be it noise or rate. The converter adds the level that it rests at.
fn coupled(stand: &Stand, name: &'static str, axis: usize, wanted: f64) -> Foreign {
    let strength = |corner: f64| of_corner(stand, axis, corner);
    let corner = size_for(wanted, &strength);
    let (level, rate_hz) = (stand.bias[axis] / LSB, stand.rate_hz);
    let change = move |counts: &[Vec<i32>; 3], draw: &mut Draw| {
        // Within its step the rate is anywhere.
        let rate: Vec<f64> = counts[axis]
            .iter()
            .map(|c| f64::from(*c) + draw.between(-0.5, 0.5))
            .collect();
        behind_capacitor(&rate, level, corner, rate_hz)
            .iter()
            .map(|v| (level + v).round() as i32)
            .collect()
    };
    Foreign {
        name,
        strength: strength(corner),
        change: Change::Made(Box::new(change)),
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::stand;
    use super::*;

    #[test]
    fn a_bus_is_busy_for_a_moment_of_every_period() {
        let (mut draw, stand) = stand(30);
        for _ in 0..5 {
            let shape = bursts(&mut draw, &stand);
            let runs: Vec<&[f64]> = shape.chunk_by(|a, b| a == b).collect();
            let busy = |run: &&&[f64]| run[0] == 1.0;
            let each: Vec<usize> = runs[1..runs.len() - 1]
                .iter()
                .filter(busy)
                .map(|r| r.len())
                .collect();
            let (least, most) = (each.iter().min(), each.iter().max());
            assert!(least.zip(most).is_some_and(|(l, m)| m - l <= 1));
            assert!(each.len() >= 58, "{}", each.len());
        }
    }

    #[test]
    fn a_capacitor_passes_half_at_its_corner_and_leaves_no_level() {
        let at = |hz: f64| passed(0.2, 20.0, TAU * hz / 20.0);
        assert!((at(0.2) - 0.5).abs() < 0.05 && at(0.001) < 1e-4 && at(5.0) > 0.9);
        let step: Vec<f64> = (0..4000).map(|i| if i < 100 { 3.0 } else { 4.0 }).collect();
        let y = behind_capacitor(&step, 3.0, 0.2, 20.0);
        assert!(y[..100].iter().all(|v| v.abs() < 1e-12));
        assert!(y[100] > 0.9 && y[3999].abs() < 1e-9);
        // What it passes of white noise is what is reckoned with.
        let (mut draw, _) = stand(31);
        let noise: Vec<f64> = (0..200_000).map(|_| draw.normal()).collect();
        let y = behind_capacitor(&noise, 0.0, 2.0, 20.0);
        let seen = y.iter().map(|v| v * v).sum::<f64>() / y.len() as f64;
        const BINS: i32 = 10_000;
        let w = |i: i32| std::f64::consts::PI * (f64::from(i) + 0.5) / f64::from(BINS);
        let told = (0..BINS).map(|i| passed(2.0, 20.0, w(i))).sum::<f64>() / f64::from(BINS);
        assert!((seen / told - 1.0).abs() < 0.02, "{seen} {told}");
    }

    #[test]
    fn no_corner_is_no_effect() {
        let (_, stand) = stand(32);
        assert!(of_corner(&stand, 0, 1e-6) < 1.0);
        assert!(of_corner(&stand, 0, 1.0) > 25.0);
    }
}
