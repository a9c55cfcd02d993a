//! The thirteenth set's signals that have a structure in time of their own.

use super::super::kept_back_fourth::about_mean;
use super::super::kept_back_ninth::resonating;
use crate::random::Draw;
use crate::stand::{Stand, held, lagged};

/// The sun comes through drifting clouds and warms one side of the part; the other follows through the housing, and what
/// the two differ by bends it. The thermometer is in the shade.
pub(super) fn sun(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let mut shines = draw.chance(0.5);
    let dwell = draw.by_ratio(4.0, 15.0);
    let reach = (0.3 * dwell, 1.7 * dwell);
    let sky = held(draw, stand.samples(), stand.rate_hz, reach, |d| {
        shines = !shines;
        f64::from(u8::from(shines)) * d.between(0.4, 1.0)
    });
    // The edge of a cloud is not sharp.
    let sky = lagged(&sky, draw.between(0.3, 1.0), stand.rate_hz);
    let (near, apart) = (draw.by_ratio(0.8, 2.5), draw.between(2.5, 6.0));
    let sides = [near, near * apart].map(|tau| lagged(&sky, tau, stand.rate_hz));
    let sign = draw.sign();
    let bend: Vec<f64> = sides[0]
        .iter()
        .zip(&sides[1])
        .map(|(n, f)| sign * (n - f))
        .collect();
    about_mean(&bend)
}

/// Where the axles of a carriage are, of its length: two pairs, of which each is near an end. Those of a pair are 1.8 to 2.6 m
/// apart, and a carriage is some 15 to 26 m long.
fn axles(draw: &mut Draw) -> [f64; 4] {
    let (from_end, wheelbase) = (draw.between(0.08, 0.15), draw.between(0.08, 0.15));
    let last = 1.0 - from_end;
    [from_end, from_end + wheelbase, last - wheelbase, last]
}

/// Trains pass: each axle is a stroke at the ground, which has a mode of its own. Carriages are alike, and the strokes come
/// by the axles of each, at the pace of the train, which is 30 to 100 km/h, swelling and fading as it goes by.
pub(super) fn trains(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let ground = (draw.by_ratio(1.5, 8.0), draw.by_ratio(0.3, 1.2));
    let mut strokes = vec![0.0; stand.samples()];
    let mut at = draw.between(2.0, 30.0);
    while at < stand.seconds {
        let (carriage_s, carriages) = (draw.by_ratio(0.7, 2.5), 4 + draw.of_many(14));
        let (axles, heavy) = (axles(draw), draw.between(0.6, 1.4));
        let lasts = carriage_s * carriages as f64;
        for carriage in 0..carriages {
            let load = heavy * draw.between(0.6, 1.0);
            for axle in axles {
                let since = carriage_s * (carriage as f64 + axle);
                let near = 1.0 / (1.0 + (4.0 * (since / lasts - 0.5)).powi(2));
                let place = (at + since) * stand.rate_hz;
                // Between two readings, a part of it in either.
                for (i, part) in [(0, 1.0 - place.fract()), (1, place.fract())] {
                    if let Some(s) = strokes.get_mut(place as usize + i) {
                        *s += part * load * near;
                    }
                }
            }
        }
        at += lasts + 5.0 + 30.0 * draw.exponential();
    }
    resonating(&strokes, ground, stand.rate_hz)
}

#[cfg(test)]
mod tests {
    use super::super::tests::stand;
    use super::*;
    use crate::foreign::kept_back_tenth::tests::largest_change;
    use crate::foreign::swing;

    #[test]
    fn a_side_in_the_sun_bends_the_part_softly_and_to_either_side() {
        let (mut draw, mut stand) = stand(20);
        stand.world.temperature = std::array::from_fn(|_| vec![25.0; stand.samples()]);
        for _ in 0..5 {
            let y = sun(&mut draw, &stand);
            let turns = y
                .windows(3)
                .filter(|w| (w[1] - w[0]) * (w[2] - w[1]) < 0.0)
                .count();
            assert!(turns > 40, "{turns}");
            assert!(largest_change(&y) < 0.1 * swing(&y));
        }
    }

    #[test]
    fn axles_stand_in_two_pairs_within_a_carriage() {
        let (mut draw, _) = stand(21);
        for _ in 0..100 {
            let [a, b, c, d] = axles(&mut draw);
            assert!(0.0 < a && a < b && b < 0.5 && 0.5 < c && c < d && d < 1.0);
            assert!((b - a - (d - c)).abs() < 1e-12 && (a + d - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn a_train_passes_and_the_ground_is_still_again() {
        let (mut draw, stand) = stand(22);
        for _ in 0..5 {
            let y = trains(&mut draw, &stand);
            let size = swing(&y);
            let loud: Vec<bool> = y
                .chunks(20)
                .map(|second| swing(second) > 0.1 * size)
                .collect();
            let passes = loud.chunk_by(|a, b| a == b).filter(|run| run[0]).count();
            assert!((4..80).contains(&passes), "{passes}");
            let share = loud.iter().filter(|l| **l).count() as f64 / loud.len() as f64;
            assert!((0.05..0.8).contains(&share), "{share}");
        }
    }
}
