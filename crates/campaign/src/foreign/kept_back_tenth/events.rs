//! The tenth set's events: what happens now and then, and leaves something.

use std::f64::consts::TAU;

use super::super::kept_back_fourth::about_mean;
use crate::random::Draw;
use crate::stand::Stand;

/// Events of a record, s: `count` of them, the first after a tenth of it, and no two within a twentieth.
pub(in super::super) fn events(draw: &mut Draw, stand: &Stand, count: usize) -> Vec<f64> {
    let mut all: Vec<f64> = vec![];
    while all.len() < count {
        let at = stand.seconds * draw.between(0.1, 0.9);
        if all.iter().all(|a| (a - at).abs() > 0.05 * stand.seconds) {
            all.push(at);
        }
    }
    all
}

/// How large each of them is, of either sign.
pub(in super::super) fn sizes(draw: &mut Draw, events: &[f64]) -> Vec<f64> {
    let size = |_: &f64| draw.sign() * draw.between(0.5, 1.5);
    events.iter().map(size).collect()
}

/// What events add, by the time since each of them, s.
pub(in super::super) fn since(
    stand: &Stand,
    events: &[f64],
    of: impl Fn(usize, f64) -> f64,
) -> Vec<f64> {
    (0..stand.samples())
        .map(|i| {
            let t = i as f64 / stand.rate_hz;
            let one = |(k, at): (usize, &f64)| if t < *at { 0.0 } else { of(k, t - at) };
            events.iter().enumerate().map(one).sum()
        })
        .collect()
}

/// Discharges that leave charge at the proof mass: each a jump of the bias that leaks away through the oxide.
pub(super) fn charge(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let count = 3 + draw.of_many(5);
    let at = events(draw, stand, count);
    let leaks = draw.by_ratio(3.0, 25.0);
    let size = sizes(draw, &at);
    about_mean(&since(stand, &at, |k, t| size[k] * (-t / leaks).exp()))
}

/// Knocks at the stand: the part rings, has another bias after each, and recovers a part of that. The accelerometers feel
/// the knock itself.
pub(super) fn shocks(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let count = 2 + draw.of_many(4);
    let at = events(draw, stand, count);
    for knock in &at {
        let i = (knock * stand.rate_hz).ceil() as usize;
        for acc in &mut stand.world.acc {
            let g = draw.sign() * draw.between(0.3, 0.9);
            if let Some(a) = acc.get_mut(i) {
                *a += g;
            }
        }
    }
    let (pitch, rings) = (draw.by_ratio(1.0, 8.5), draw.by_ratio(0.5, 2.5));
    let (recovers, stays) = (draw.by_ratio(4.0, 30.0), draw.between(0.2, 0.5));
    let loud = draw.between(2.0, 5.0);
    let size = sizes(draw, &at);
    let after = |k: usize, t: f64| {
        let ring = loud * (-t / rings).exp() * (TAU * pitch * t).sin();
        let bias = stays + (1.0 - stays) * (-t / recovers).exp();
        size[k] * (ring + bias)
    };
    about_mean(&since(stand, &at, after))
}

/// Jolts that leave stress in the package, which relaxes as the logarithm of the time since.
pub(super) fn creep(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let count = 3 + draw.of_many(5);
    let at = events(draw, stand, count);
    let (begins, ends) = (draw.by_ratio(0.1, 1.0), draw.by_ratio(20.0, 120.0));
    let size = sizes(draw, &at);
    let whole = (ends / begins).ln_1p();
    let left = |t: f64| (1.0 - (t / begins).ln_1p() / whole).max(0.0);
    about_mean(&since(stand, &at, |k, t| size[k] * left(t)))
}

#[cfg(test)]
mod tests {
    use super::super::tests::{largest_change, stand};
    use super::*;

    #[test]
    fn what_jumps_leaks_away_or_stays_in_part_or_relaxes_as_a_logarithm() {
        let record = stand(6).1;
        let [charged, shaken, crept] = [0, 1, 2].map(|which| {
            let (mut draw, mut own) = stand(7);
            match which {
                0 => charge(&mut draw, &own),
                1 => shocks(&mut draw, &mut own),
                _ => creep(&mut draw, &own),
            }
        });
        for y in [&charged, &shaken, &crept] {
            assert_eq!(y.len(), record.samples());
            // Nothing happens in the first tenth.
            assert!(largest_change(&y[..1200]) < 1e-12);
        }
        let jumps = |y: &[f64]| y.windows(2).filter(|w| (w[1] - w[0]).abs() > 0.3).count();
        assert!((3..8).contains(&jumps(&charged)), "{}", jumps(&charged));
        let at = events(&mut stand(8).0, &record, 5);
        let one = since(&record, &at[..1], |_, t| 1.0 / (1.0 + t));
        let first = (at[0] * 20.0).ceil() as usize;
        assert!(one[first - 1] == 0.0 && one[first] > 0.9 && one[first + 20] < 0.51);
    }

    #[test]
    fn a_knock_is_felt_by_every_accelerometer() {
        let (mut draw, mut stand) = stand(9);
        let before = stand.world.acc.clone();
        let y = shocks(&mut draw, &mut stand);
        for (old, new) in before.iter().zip(&stand.world.acc) {
            let hit = old.iter().zip(new).filter(|(a, b)| a != b).count();
            assert!((2..6).contains(&hit), "{hit}");
        }
        // Something stays.
        assert!((y[y.len() - 1] - y[0]).abs() > 0.02);
    }
}
