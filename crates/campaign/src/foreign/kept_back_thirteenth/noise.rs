//! The thirteenth set's noise.

use super::super::Foreign;
use super::super::kept_back_tenth::noise::by_law;
use crate::random::Draw;
use crate::stand::{Stand, held, lagged};

/// One of them; `None` for another name.
pub(super) fn one(
    draw: &mut Draw,
    stand: &Stand,
    name: &'static str,
    wanted: f64,
) -> Option<Foreign> {
    let shape = match name {
        "fan coil that a thermostat switches" => fan(draw, stand),
        "gas that leaks into the cavity" => gas(draw, stand),
        _ => return None,
    };
    Some(by_law(name, &shape, wanted))
}

/// A fan coil that blows until its thermostat is content, on one of three steps, and runs up and down within seconds. The
/// pressure of turbulence goes with the square of the speed, and its variance with the fourth power.
pub(in super::super) fn fan(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    const STEPS: [f64; 3] = [0.6, 0.8, 1.0];
    let (period, blows) = (draw.by_ratio(12.0, 80.0), draw.between(0.2, 0.6));
    let runs_up = draw.by_ratio(0.5, 3.0);
    let (mut on, mut left, mut step) = (draw.chance(0.5), 0.0, 1.0);
    let asked: Vec<f64> = (0..stand.samples())
        .map(|_| {
            left -= 1.0 / stand.rate_hz;
            if left <= 0.0 {
                (on, step) = (!on, STEPS[draw.of_many(STEPS.len())]);
                let share = if on { blows } else { 1.0 - blows };
                left = period * share * draw.between(0.75, 1.25);
            }
            f64::from(u8::from(on)) * step
        })
        .collect();
    let speed = lagged(&asked, runs_up, stand.rate_hz);
    speed.iter().map(|s| s.powi(4)).collect()
}

/// Helium that is blown about the stand now and then, as for a leak test, goes through the lid and into the cavity behind
/// it, and out again: a lag for each. The gas damps the element, and the noise of damping goes with it.
pub(in super::super) fn gas(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (lid, cavity) = (draw.by_ratio(8.0, 30.0), draw.by_ratio(20.0, 90.0));
    let mut blown = true;
    // Once a record would be a stretch of more noise.
    let outside = held(draw, stand.samples(), stand.rate_hz, (15.0, 120.0), |d| {
        blown = !blown;
        f64::from(u8::from(blown)) * d.between(0.5, 1.0)
    });
    let inside = lagged(&outside, lid, stand.rate_hz);
    lagged(&inside, cavity, stand.rate_hz)
}

#[cfg(test)]
mod tests {
    use super::super::tests::stand;
    use super::*;
    use crate::foreign::extremes;
    use crate::foreign::kept_back_tenth::tests::largest_change;

    #[test]
    fn a_fan_comes_and_goes_and_is_never_louder_than_its_highest_step() {
        let (mut draw, stand) = stand(30);
        for _ in 0..5 {
            let y = fan(&mut draw, &stand);
            let (low, high) = extremes(&y);
            assert!(low < 0.05 && high > 0.5 && high <= 1.0, "{low} {high}");
            let starts = y.windows(2).filter(|w| w[0] < 0.05 && w[1] >= 0.05).count();
            // Periods of 12 to 80 s, each part of which may be a quarter shorter or longer.
            assert!((4..=70).contains(&starts), "{starts}");
        }
    }

    #[test]
    fn gas_comes_into_the_cavity_and_leaves_it_more_than_once_and_softly() {
        let (mut draw, stand) = stand(31);
        for _ in 0..5 {
            let y = gas(&mut draw, &stand);
            assert!(y[0] == 0.0 && y.iter().all(|v| (0.0..1.0).contains(v)));
            let rises: Vec<bool> = y.windows(2).map(|w| w[1] > w[0]).collect();
            let times = rises.chunk_by(|a, b| a == b).filter(|run| run[0]).count();
            assert!((2..=21).contains(&times), "{times}");
            // Both lags are 8 and 20 s at least.
            assert!(largest_change(&y) < 1.0 / (20.0 * stand.rate_hz));
        }
    }
}
