//! The eleventh set's signals that have a structure in time of their own.

use std::f64::consts::TAU;

use super::super::kept_back_fourth::about_mean;
use super::super::kept_back_ninth::in_time;
use crate::random::Draw;
use crate::stand::{Stand, lagged};

/// Lorries pass now and then: the ground swells under each, sways at a pitch of its own that the load moves a little, and is
/// still again.
pub(super) fn lorries(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let ground = draw.by_ratio(0.3, 2.0);
    let mut y = vec![0.0; stand.samples()];
    let mut at = draw.between(2.0, 25.0);
    while at < stand.seconds {
        let (takes, size) = (draw.by_ratio(1.5, 4.0), draw.between(0.5, 1.5));
        let (pitch, first) = (ground * draw.between(0.85, 1.15), draw.between(0.0, TAU));
        let packet = in_time(stand, |t| {
            let since = t - at;
            size * (-0.5 * (since / takes).powi(2)).exp() * (first + TAU * pitch * since).sin()
        });
        y.iter_mut().zip(packet).for_each(|(y, p)| *y += p);
        at += 4.0 * takes + 25.0 * draw.exponential();
    }
    y
}

/// A tone that the sampling folds into the band: as the oscillator of one of the two warms up it glides to where it stays,
/// by the exponential of the warming.
pub(super) fn gliding(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (stays, warms) = (draw.between(0.8, 9.2), draw.by_ratio(120.0, 400.0));
    // From the side on which there is room.
    let from = draw.between(0.5, 3.0) * if stays < 5.0 { 1.0 } else { -1.0 };
    let first = draw.between(0.0, TAU);
    in_time(stand, |t| {
        let turns = stays * t + from * warms * (1.0 - (-t / warms).exp());
        (first + TAU * turns).sin()
    })
}

/// The gain control of the drive hunts: the amplitude grows slowly until a comparator trips, falls much faster until it trips
/// back, and so on; noise at the comparator makes no two of them quite alike.
pub(super) fn hunting(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (period, falls) = (draw.by_ratio(2.0, 12.0), draw.between(0.1, 0.25));
    let (up, down) = (1.0 / (1.0 - falls), -1.0 / falls);
    let noise = draw.between(0.03, 0.1);
    let per_sample = 1.0 / (period * stand.rate_hz);
    let (mut level, mut rises, mut until) = (draw.between(0.0, 1.0), true, 1.0);
    let sign = draw.sign();
    let y: Vec<f64> = (0..stand.samples())
        .map(|_| {
            level += per_sample * if rises { up } else { down };
            if rises == (level > until) {
                rises = !rises;
                until = f64::from(u8::from(rises)) + noise * draw.normal();
            }
            sign * level
        })
        .collect();
    about_mean(&y)
}

/// A radio next to the part sends for a moment once a period, and rectified at the reference its carrier is an offset for as
/// long as it lasts; a reading that it begins or ends in has its share.
pub(super) fn sending(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let period = draw.by_ratio(1.0, 6.0);
    let lasts = period * draw.between(0.04, 0.12);
    let (first, sign) = (draw.between(0.0, period), draw.sign());
    let reading = 1.0 / stand.rate_hz;
    in_time(stand, |t| {
        let since = (first + t) % period;
        let ended = (lasts - since).clamp(0.0, reading);
        let next = (since + reading - period).clamp(0.0, lasts);
        sign * (ended + next) / reading
    })
}

/// The firmware fires the self-test at a fixed period, as for a part that is not in use: the mass is pushed one way, held,
/// pushed the other way and let go, and follows behind its read-out's filter.
pub(super) fn self_test(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (period, holds) = (draw.between(12.0, 45.0), draw.between(0.4, 1.5));
    let (first, sign) = (draw.between(0.0, period), draw.sign());
    let pushed = in_time(stand, |t| match (first + t) % period / holds {
        x if x < 1.0 => sign,
        x if x < 2.0 => -sign,
        _ => 0.0,
    });
    lagged(&pushed, draw.by_ratio(0.05, 0.3), stand.rate_hz)
}

#[cfg(test)]
mod tests {
    use super::super::tests::stand;
    use super::*;
    use crate::foreign::swing;

    #[test]
    fn lorries_are_gone_most_of_the_time() {
        let (mut draw, stand) = stand(10);
        for _ in 0..3 {
            let y = lorries(&mut draw, &stand);
            let felt = y.iter().filter(|v| v.abs() > 0.1).count();
            assert!(felt > y.len() / 50 && felt < y.len() / 2, "{felt}");
        }
    }

    #[test]
    fn a_glide_slows_down_and_stays_within_the_band() {
        let (mut draw, stand) = stand(11);
        for _ in 0..20 {
            let y = gliding(&mut draw, &stand);
            let crossings = |y: &[f64]| y.windows(2).filter(|w| w[0] * w[1] < 0.0).count();
            let [begin, middle, end] = [0, 5000, 10_000].map(|i| crossings(&y[i..i + 2000]));
            let (early, later) = (begin.abs_diff(middle), middle.abs_diff(end));
            assert!(
                early > later && begin.max(end) < 2000,
                "{begin} {middle} {end}"
            );
        }
    }

    #[test]
    fn a_loop_that_hunts_falls_faster_than_it_grows_and_has_no_exact_period() {
        let (mut draw, stand) = stand(12);
        for _ in 0..10 {
            let y = hunting(&mut draw, &stand);
            let up = y.windows(2).filter(|w| w[1] > w[0]).count() as f64 / y.len() as f64;
            assert!(!(0.3..0.7).contains(&up), "{up}");
            assert!(swing(&y) < 2.0);
            let peaks: Vec<f64> = y
                .windows(3)
                .filter(|w| w[1] > w[0] && w[1] > w[2])
                .map(|w| w[1])
                .collect();
            assert!(peaks.len() > 30 && swing(&peaks) > 0.05);
        }
    }

    #[test]
    fn a_transmission_has_the_same_area_wherever_it_begins() {
        let (mut draw, stand) = stand(13);
        let y = sending(&mut draw, &stand);
        let areas: Vec<f64> = y
            .split(|v| *v == 0.0)
            .filter(|p| !p.is_empty())
            .map(|p| p.iter().sum::<f64>().abs())
            .collect();
        assert!(areas.len() > 80, "{}", areas.len());
        let whole = &areas[1..areas.len() - 1];
        assert!(whole.iter().all(|a| (a - whole[0]).abs() < 1e-6));
        assert!((0.04..0.72).contains(&(whole[0] / stand.rate_hz)));
    }

    #[test]
    fn a_self_test_pushes_both_ways_alike() {
        let (mut draw, stand) = stand(14);
        let y = self_test(&mut draw, &stand);
        let (all, sum) = (
            y.iter().map(|v| v.abs()).sum::<f64>(),
            y.iter().sum::<f64>(),
        );
        assert!(sum.abs() < 0.1 * all, "{sum} {all}");
        let (low, high) = crate::foreign::extremes(&y);
        assert!(high > 0.7 && low < -0.7);
    }
}
