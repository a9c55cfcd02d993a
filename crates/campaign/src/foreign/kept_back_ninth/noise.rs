//! The ninth set's noise.

use super::super::kept_back::{cells, of_law};
use super::super::{Change, Foreign};
use super::with_rests;
use crate::random::Draw;
use crate::stand::Stand;
use crate::strength::{of_variance, size_for};

/// One of them; `None` for another name.
pub(super) fn one(
    draw: &mut Draw,
    stand: &mut Stand,
    name: &'static str,
    wanted: f64,
) -> Option<Foreign> {
    Some(match name {
        "noise that leans the way the motor turns" => leaning(draw, stand, name, wanted),
        "noise that a swing to one side leaves louder" => one_sided(draw, stand, name, wanted),
        _ => return None,
    })
}

/// Least and largest share of the variance that leans; below the least the law is normal, as far as can be seen.
const SHARES: (f64, f64) = (0.05, 0.95);

/// Density, at x, of what has mean 0 and variance 1: an exponential law about its mean, `share` of the variance, and a
/// normal rest (Grushka 1972).
fn leans(share: f64, x: f64) -> f64 {
    let (rate, rest) = (1.0 / share.sqrt(), 1.0 - share);
    let off = rate * rest - 1.0 / rate - x;
    let tail = statrs::function::erf::erfc(off / (2.0 * rest).sqrt());
    0.5 * rate * (rate * (off - 0.5 * rate * rest)).exp() * tail
}

/// d' of `n` readings of that law against the normal one.
fn of_leaning(share: f64, n: f64) -> f64 {
    let share = share.clamp(SHARES.0, SHARES.1);
    let law = |of: &dyn Fn(f64) -> f64| cells(1200, 8.0, of);
    let normal = law(&|x| (-0.5 * x * x).exp());
    of_law(&law(&|x| leans(share, x)), &normal, 1) * n.sqrt()
}

/// Sparks at the brushes, each with a tail to the side the current flows: skewed one way while the motor turns forward, the
/// other way backward, and not at rest. Its size stays.
fn leaning(draw: &mut Draw, stand: &mut Stand, name: &'static str, wanted: f64) -> Foreign {
    stand.world.duty = with_rests(draw, stand);
    let turning = stand.world.duty.iter().filter(|d| **d != 0.0).count() as f64;
    let strength = |share: f64| of_leaning(share, turning);
    let share = size_for(wanted, &strength).clamp(SHARES.0, SHARES.1);
    let sense = draw.sign();
    let noise = stand.world.duty.iter().map(|d| {
        if *d == 0.0 {
            draw.normal()
        } else {
            sense * d.signum() * (draw.exponential() - 1.0)
        }
    });
    Foreign {
        name,
        change: Change::Noise(noise.collect(), share),
        strength: strength(share),
    }
}

/// Noise whose size is exp(size z / 2) for the swing z before it, itself of variance 1: the law of its variance, with the
/// series.
pub(in super::super) fn louder(size: f64, independent: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let mut last = 0.0f64;
    independent
        .iter()
        .map(|z| {
            let variance = (size * last).exp();
            last = *z;
            (variance, variance.sqrt() * z)
        })
        .unzip()
}

/// An amplifier whose working point is carried along by what it last gave out: after a swing to one side the next reading
/// is noisier, after one to the other quieter (the asymmetry of Nelson 1991). Neither readings nor their squares correlate
/// by much; a reading does with the square after it.
fn one_sided(draw: &mut Draw, stand: &Stand, name: &'static str, wanted: f64) -> Foreign {
    let independent: Vec<f64> = (0..stand.samples()).map(|_| draw.normal()).collect();
    let strength = |size: f64| of_variance(&louder(size, &independent).0);
    let (size, sign) = (size_for(wanted, &strength), draw.sign());
    let (law, series) = louder(size, &independent);
    let mean = law.iter().sum::<f64>() / law.len() as f64;
    Foreign {
        name,
        strength: strength(size),
        change: Change::Noise(series.iter().map(|x| sign * x / mean.sqrt()).collect(), 1.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise_of(name: &'static str) -> (Vec<f64>, f64, Stand) {
        let draw = &mut Draw::of(20_261_122, 88, 0);
        let needed = super::super::needs(name);
        let mut stand = Stand::draw(draw, 3000.0, 20.0, needed);
        let f = one(draw, &mut stand, name, 50.0).expect("a name of this set");
        assert!((f.strength - 50.0).abs() < 0.1, "{name}: {}", f.strength);
        let Change::Noise(x, share) = f.change else {
            panic!("{name} is no noise")
        };
        (x, share, stand)
    }

    fn mean(all: impl Iterator<Item = f64>) -> f64 {
        let (mut sum, mut n) = (0.0, 0.0);
        all.for_each(|v| (sum, n) = (sum + v, n + 1.0));
        sum / n
    }

    #[test]
    fn the_law_that_leans_has_mean_0_variance_1_and_its_skewness() {
        for share in [0.1, 0.4, 0.9] {
            const CELLS: i32 = 4000;
            let law = cells(CELLS, 12.0, &|x| leans(share, x));
            let moment = |k: i32| -> f64 {
                let at = |i: usize| 12.0 * (i as f64 / f64::from(CELLS) - 1.0);
                law.iter().enumerate().map(|(i, p)| p * at(i).powi(k)).sum()
            };
            let told = 2.0 * share.powf(1.5);
            assert!(moment(1).abs() < 1e-3 && (moment(2) - 1.0).abs() < 5e-3);
            assert!((moment(3) - told).abs() < 0.02, "{} {told}", moment(3));
        }
        // The least is as good as none.
        assert!(of_leaning(0.0, 12_000.0) < 2.0);
    }

    #[test]
    fn noise_leans_with_the_motor_and_not_at_rest() {
        let (x, _, stand) = noise_of("noise that leans the way the motor turns");
        let duty = &stand.world.duty;
        let cubes = |way: f64| {
            let of = |(x, d): (&f64, &f64)| (d.signum() * d.abs().ceil() == way).then(|| x.powi(3));
            mean(x.iter().zip(duty).filter_map(of))
        };
        let (forward, backward) = (cubes(1.0), cubes(-1.0));
        assert!(forward * backward < 0.0, "{forward} {backward}");
        assert!((forward.abs() - 2.0).abs() < 0.6 && (backward.abs() - 2.0).abs() < 0.6);
        assert!(cubes(0.0).abs() < 0.2);
        assert!((mean(x.iter().map(|v| v * v)) - 1.0).abs() < 0.06);
    }

    #[test]
    fn a_swing_to_one_side_leaves_the_next_louder_and_its_square_alone_does_not() {
        let (x, _, _) = noise_of("noise that a swing to one side leaves louder");
        let lag = |f: &dyn Fn(f64, f64) -> f64| mean(x.windows(2).map(|w| f(w[0], w[1])));
        assert!((mean(x.iter().map(|v| v * v)) - 1.0).abs() < 0.05);
        assert!(lag(&|a, b| a * b).abs() < 0.03);
        assert!(lag(&|a, b| a * b * b).abs() > 0.15);
        // What a square does is of second order.
        assert!(lag(&|a, b| (a * a - 1.0) * (b * b - 1.0)).abs() < 0.15);
    }
}
