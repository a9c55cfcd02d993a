//! The fourteenth set's noise.

use super::super::Foreign;
use super::super::kept_back_tenth::noise::by_law;
use super::super::kept_back_tenth::{DWELL, programme};
use crate::random::Draw;
use crate::stand::{Stand, lagged};

/// One of them; `None` for another name.
pub(super) fn one(
    draw: &mut Draw,
    stand: &mut Stand,
    name: &'static str,
    wanted: f64,
) -> Option<Foreign> {
    if name != "edge that whistles at some speeds" {
        return None;
    }
    let shape = whistle(draw, stand);
    Some(by_law(name, &shape, wanted))
}

/// Air whistles at an edge of the turning table while its speed is within a band, and shakes the element. A tone that sounds
/// holds on beyond the band in which it begins.
pub(in super::super) fn whistle(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, DWELL);
    let speed = lagged(&stand.world.duty, draw.by_ratio(0.5, 3.0), stand.rate_hz);
    let (low, wide) = (draw.between(0.1, 0.4), draw.between(0.1, 0.25));
    let (high, holds) = (low + wide, wide * draw.between(0.2, 0.5));
    let mut on = false;
    let sounds: Vec<f64> = speed
        .iter()
        .map(|s| {
            let beyond = if on { holds } else { 0.0 };
            on = (low - beyond..high + beyond).contains(&s.abs());
            f64::from(u8::from(on))
        })
        .collect();
    lagged(&sounds, draw.by_ratio(0.1, 0.6), stand.rate_hz)
}

#[cfg(test)]
mod tests {
    use super::super::tests::stand;
    use super::*;
    use crate::foreign::extremes;

    #[test]
    fn an_edge_whistles_in_a_band_and_neither_at_rest_nor_at_full_speed() {
        let (mut draw, mut stand) = stand(30);
        for _ in 0..5 {
            let y = whistle(&mut draw, &mut stand);
            let (low, high) = extremes(&y);
            assert!(low < 0.05 && high > 0.8 && high <= 1.0, "{low} {high}");
            let mut seen = 0;
            for (i, w) in stand.world.duty.windows(220).enumerate() {
                // A motor of 3 s is within 0.03 of its speed after 11 s, and the highest band ends at 0.775.
                if w.iter().all(|d| *d == w[0]) && (w[0] == 0.0 || w[0].abs() > 0.82) {
                    seen += 1;
                    assert!(y[i + 219] < 0.1, "{}", y[i + 219]);
                }
            }
            assert!(seen > 0, "no rest");
        }
    }
}
