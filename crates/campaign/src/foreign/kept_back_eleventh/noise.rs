//! The eleventh set's noise.

use super::super::kept_back::variance;
use super::super::kept_back_fourth::about_mean;
use super::super::kept_back_tenth::noise::by_law;
use super::super::kept_back_tenth::{DWELL, angle_of_table, programme, rate_of_table};
use super::super::{Change, Foreign, swing};
use crate::random::Draw;
use crate::stand::{Stand, lagged};
use crate::strength::{Meter, size_for};

/// One of them; `None` for another name.
pub(super) fn one(
    draw: &mut Draw,
    stand: &mut Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Option<Foreign> {
    Some(match name {
        "noise that ramps through the record" => {
            let shape = ramp(draw, stand);
            variance(name, wanted, &|size| by_exponential(&shape, size))
        }
        "slip ring that is worn at some angles" => {
            let shape = worn(draw, stand);
            by_law(name, &shape, wanted)
        }
        "noise that grows with the warmth" => {
            let shape = warmth(stand, axis);
            variance(name, wanted, &|size| by_exponential(&shape, size))
        }
        "ramp of the rate that wanders" => wandering_ramp(draw, stand, name, axis, wanted),
        _ => return None,
    })
}

/// A variance that is the exponential of so much of a shape.
pub(in super::super) fn by_exponential(shape: &[f64], size: f64) -> Vec<f64> {
    shape.iter().map(|s| (size * s).exp()).collect()
}

/// A part that ages in the course of the record, or settles: by so many decibels an hour its noise goes up or down.
pub(in super::super) fn ramp(draw: &mut Draw, stand: &Stand) -> Vec<f64> {
    let (sign, n) = (draw.sign(), stand.samples() as f64);
    (0..stand.samples())
        .map(|i| sign * (i as f64 / n - 0.5))
        .collect()
}

/// Leakage that doubles every so many degrees: so does the variance of its noise.
pub(in super::super) fn warmth(stand: &Stand, axis: usize) -> Vec<f64> {
    let own = about_mean(&stand.world.temperature[axis]);
    let span = swing(&own);
    own.iter().map(|t| t / span).collect()
}

/// A slip ring whose brushes ride over one to three worn places a turn, at which the contact is noisy whether it turns or
/// not. The programme turns slowly enough to tell them.
pub(in super::super) fn worn(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    programme(draw, stand, DWELL);
    let rate = rate_of_table(draw, stand);
    let full = draw.by_ratio(0.1, 0.5);
    let places: Vec<(f64, f64)> = (0..1 + draw.of_many(3))
        .map(|_| (draw.between(0.0, 1.0), draw.between(0.05, 0.15)))
        .collect();
    angle_of_table(&rate, full, stand.rate_hz)
        .iter()
        .map(|angle| {
            let turns = angle / std::f64::consts::TAU;
            let on = |(at, wide): &(f64, f64)| (turns - at).rem_euclid(1.0) < *wide;
            f64::from(u8::from(places.iter().any(on)))
        })
        .collect()
}

/// A rate that follows its ramp, each forgetting by a time constant of its own, samples: of variance 1.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct Ramp {
    ramp: f64,
    rate: f64,
}

impl Ramp {
    /// Longest time constant, s: what is slower is hidden by a random walk.
    const LONGEST_S: f64 = 4.0;

    pub(in super::super) fn new(draw: &mut Draw, rate_hz: f64) -> Self {
        let mut samples = || rate_hz * draw.by_ratio(0.8, Self::LONGEST_S);
        let (ramp, rate) = (samples(), samples());
        Self { ramp, rate }
    }

    /// Variance of the white noise that drives it.
    fn drive(self) -> f64 {
        // Of two poles in series, which are many samples long.
        2.0 * (self.ramp + self.rate)
    }

    /// Its density at an angular frequency, rad per sample.
    pub(in super::super) fn density(self, w: f64) -> f64 {
        let pole = |samples: f64| {
            let keep = (-1.0 / samples).exp();
            (1.0 - keep).powi(2) / (1.0 - 2.0 * keep * w.cos() + keep * keep)
        };
        self.drive() * pole(self.ramp) * pole(self.rate)
    }

    /// So many samples.
    fn of(self, draw: &mut Draw, n: usize) -> Vec<f64> {
        // It wandered before.
        let before = (10.0 * self.ramp.max(self.rate)) as usize;
        let size = self.drive().sqrt();
        let drive: Vec<f64> = (0..before + n).map(|_| size * draw.normal()).collect();
        lagged(&lagged(&drive, self.ramp, 1.0), self.rate, 1.0).split_off(before)
    }
}

/// Not the rate but its ramp takes a random walk: a spectrum by the fourth power, above corners where both leak, for else it
/// would leave the scale.
fn wandering_ramp(
    draw: &mut Draw,
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Foreign {
    let ramp = Ramp::new(draw, stand.rate_hz);
    let meter = Meter::new(stand, axis);
    let strength = |sigma: f64| {
        let density = |w: &f64| sigma * sigma * ramp.density(*w);
        meter.of_density(&meter.omega().iter().map(density).collect::<Vec<_>>())
    };
    let sigma = size_for(wanted, &strength);
    let unit = ramp.of(draw, stand.samples());
    Foreign {
        name,
        strength: strength(sigma),
        change: Change::Add(unit.iter().map(|v| sigma * v).collect()),
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::stand;
    use super::*;
    use crate::foreign::kept_back_tenth::tests::largest_change;

    #[test]
    fn noise_goes_up_or_down_all_the_way() {
        let (mut draw, stand) = stand(20);
        let law = by_exponential(&ramp(&mut draw, &stand), 1.3);
        let steps: Vec<bool> = law.windows(2).map(|w| w[1] > w[0]).collect();
        assert!(steps.iter().all(|up| *up == steps[0]));
        let whole = (law[law.len() - 1] / law[0]).ln().abs();
        assert!((whole - 1.3).abs() < 1e-3, "{whole}");
    }

    #[test]
    fn a_worn_place_comes_again_at_its_angle() {
        let (mut draw, mut stand) = stand(21);
        for _ in 0..5 {
            let shape = worn(&mut draw, &mut stand);
            let noisy = shape.iter().sum::<f64>() / shape.len() as f64;
            assert!((0.01..0.6).contains(&noisy), "{noisy}");
            assert!(shape.iter().all(|s| *s == 0.0 || *s == 1.0));
        }
    }

    #[test]
    fn a_ramp_that_wanders_is_smooth_and_has_the_variance_of_its_density() {
        let (mut draw, _) = stand(22);
        let ramp = Ramp::new(&mut draw, 20.0);
        const BINS: i32 = 100_000;
        let at = |i: i32| std::f64::consts::PI * (f64::from(i) + 0.5) / f64::from(BINS);
        let told = (0..BINS).map(|i| ramp.density(at(i))).sum::<f64>() / f64::from(BINS);
        assert!((told - 1.0).abs() < 0.05, "{told}");
        let y = ramp.of(&mut draw, 2_000_000);
        let seen = y.iter().map(|v| v * v).sum::<f64>() / y.len() as f64;
        // 100 000 s, of which 10 depend on each other at most: five standard deviations.
        assert!((seen / told - 1.0).abs() < 0.12, "{seen}");
        assert!(largest_change(&y) < 0.2);
    }
}
