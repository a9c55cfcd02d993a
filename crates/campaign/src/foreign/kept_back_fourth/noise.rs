//! The fourth set's noise.

use std::f64::consts::{PI, TAU};

use analysis::likelihood::Dct;

use super::super::kept_back::{cells, of_law, shaped, variance};
use super::super::{Change, Foreign};
use super::about_mean;
use crate::random::Draw;
use crate::stand::{Stand, held};
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
        "noise that ends at an edge" => edge(draw, stand, name, axis, wanted),
        "noise as large as the acceleration" => {
            let force = about_mean(&stand.world.acc[draw.of_many(3)]);
            let square = force.iter().map(|a| a * a).sum::<f64>() / force.len() as f64;
            by_square(name, wanted, &force, square)
        }
        "noise after each change of the command" => {
            let since = after_changes(draw, stand);
            variance(name, wanted, &|size| {
                since.iter().map(|s| 1.0 + size * s).collect()
            })
        }
        "tone caught at any phase" => any_phase(draw, stand, name, wanted),
        _ => return None,
    })
}

/// A gyro reads its rate as a carrier's size; what the carrier leaks into the read-out, its quadrature, is as large as the
/// acceleration that pushes the two plates apart, and the phase of the demodulator is never quiet: noise whose size is
/// the acceleration of the same instant.
fn by_square(name: &'static str, wanted: f64, force: &[f64], mean_square: f64) -> Foreign {
    variance(name, wanted, &|size| {
        force
            .iter()
            .map(|a| 1.0 + size * a * a / mean_square)
            .collect()
    })
}

/// What a filter of high order passes, of variance 1: white up to an edge, Hz, then down by the 2 x `order`-th power of
/// the frequency (Butterworth 1930).
pub(in super::super) struct Edge {
    edge: f64,
    order: i32,
    mean: f64,
}

impl Edge {
    /// By its edge, Hz, and its order.
    pub(in super::super) fn new(edge_hz: f64, order: i32, rate_hz: f64) -> Self {
        const CELLS: i32 = 4096;
        let mut new = Self {
            edge: TAU * edge_hz / rate_hz,
            order,
            mean: 1.0,
        };
        let at = |i: i32| PI * (f64::from(i) + 0.5) / f64::from(CELLS);
        new.mean = (0..CELLS).map(|i| new.density(at(i))).sum::<f64>() / f64::from(CELLS);
        new
    }

    /// Density at an angular frequency, rad per sample.
    pub(in super::super) fn density(&self, w: f64) -> f64 {
        1.0 / (1.0 + (w / self.edge).powi(2 * self.order)) / self.mean
    }
}

/// A part whose own noise is cut by a filter of high order, as sigma-delta converters have it, and a stage behind that is
/// white: the spectrum has a shoulder and then a floor.
fn edge(draw: &mut Draw, stand: &Stand, name: &'static str, axis: usize, wanted: f64) -> Foreign {
    let part = Edge::new(
        draw.between(1.5, 7.5),
        4 + draw.of_many(5) as i32,
        stand.rate_hz,
    );
    of_density(draw, stand, name, axis, wanted, &|w| part.density(w))
}

/// Noise of which a share has another density, of variance 1, at an angular frequency.
pub(in super::super) fn of_density(
    draw: &mut Draw,
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
    density: &dyn Fn(f64) -> f64,
) -> Foreign {
    let n = stand.samples();
    let strength = |share: f64| shaped(stand, axis, &|w| share.min(1.0) * (density(w) - 1.0));
    let share = size_for(wanted, &strength).min(1.0);
    let c: Vec<f64> = (0..n)
        .map(|k| density(PI * k as f64 / n as f64).sqrt() * draw.normal())
        .collect();
    Foreign {
        name,
        strength: strength(share),
        change: Change::Noise(Dct::new(n).inverse(&c), share),
    }
}

/// How much is left, by sample, of what the last changes of the motor's command have stirred up: brushes that leave their
/// seat spark until they have found another, the more the larger the change, whether the motor runs then or not. The
/// command changes by steps.
fn after_changes(draw: &mut Draw, stand: &mut Stand) -> Vec<f64> {
    let (n, rate_hz) = (stand.samples(), stand.rate_hz);
    stand.world.duty = held(draw, n, rate_hz, (6.0, 30.0), |d| {
        (d.between(-1.0, 1.0) * 255.0).round() / 255.0
    });
    let keep = (-1.0 / (draw.by_ratio(0.8, 4.0) * rate_hz)).exp();
    let (mut left, mut last) = (0.0f64, stand.world.duty[0]);
    stand
        .world
        .duty
        .iter()
        .map(|d| {
            left = keep * left + (d - last).abs();
            last = *d;
            left
        })
        .collect()
}

/// Density, at x, of what has variance 1: a sine of any phase, `share` of the variance, and a normal rest.
pub(in super::super) fn with_sine(share: f64, x: f64) -> f64 {
    const PHASES: i32 = 96;
    let (size, rest) = ((2.0 * share).sqrt(), (1.0 - share).max(1e-4).sqrt());
    let at = |i: i32| {
        let phase = PI * (f64::from(i) + 0.5) / f64::from(PHASES);
        let z = (x - size * phase.cos()) / rest;
        (-0.5 * z * z).exp()
    };
    (0..PHASES).map(at).sum::<f64>() / f64::from(PHASES) / rest / TAU.sqrt()
}

/// A tone far above the samples' rate, from a switched supply or the part's own drive, whose clock is so unsteady that
/// each sample catches it at another phase: no line is left, but values that crowd at its two crests.
fn any_phase(draw: &mut Draw, stand: &Stand, name: &'static str, wanted: f64) -> Foreign {
    let cells = |of: &dyn Fn(f64) -> f64| cells(400, 6.0, of);
    let n = stand.samples();
    let normal = cells(&|x| (-0.5 * x * x).exp());
    let strength = |share: f64| of_law(&cells(&|x| with_sine(share.min(0.98), x)), &normal, n);
    let share = size_for(wanted, &strength).min(0.98);
    let noise = (0..n)
        .map(|_| 2f64.sqrt() * draw.between(0.0, TAU).sin())
        .collect();
    Foreign {
        name,
        strength: strength(share),
        change: Change::Noise(noise, share),
    }
}

/// A charge that gets into an integrator and out again at the next reading, a sum that misses a bit and is put right: a
/// spike, and at once its opposite. Each is a few sigma high, so that there are as many as the strength asks.
pub(super) fn pairs(draw: &mut Draw, stand: &Stand, wanted: f64) -> Vec<f64> {
    let n = stand.samples();
    let sigma_high = draw.by_ratio(1.5, 3.0);
    let count = (wanted * wanted / (2.0 * sigma_high * sigma_high)).ceil() as usize;
    let mut y = vec![0.0; n];
    for _ in 0..count {
        let (at, size) = (draw.of_many(n - 1), draw.sign() * draw.between(0.8, 1.2));
        y[at] += size;
        y[at + 1] -= size;
    }
    y
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stand::Needs;
    use crate::strength::Meter;

    #[test]
    fn noise_with_an_edge_has_variance_1_and_its_density() {
        let draw = &mut Draw::of(20_261_121, 20, 0);
        let stand = Stand::draw(draw, 3000.0, 20.0, Needs::default());
        let f = edge(draw, &stand, "noise that ends at an edge", 0, 60.0);
        let Change::Noise(x, _) = &f.change else {
            panic!("no noise")
        };
        let n = x.len() as f64;
        let mean = x.iter().map(|v| v * v).sum::<f64>() / n;
        assert!((mean - 1.0).abs() < 0.06, "{mean}");
        // White up to the edge, half of that at it, next to nothing at twice.
        let low = Edge::new(2.0, 6, 20.0);
        let at = |f: f64| low.density(TAU * f / 20.0);
        assert!((at(1.0) - 5.0).abs() < 0.1 && (at(2.0) - 2.5).abs() < 0.1 && at(4.0) < 2e-3);
    }

    #[test]
    fn a_sine_at_any_phase_leaves_the_variance_and_crowds_at_the_crests() {
        for share in [0.1, 0.5, 0.9] {
            let (mut whole, mut square) = (0.0, 0.0);
            for i in -3000..=3000 {
                let x = f64::from(i) / 500.0;
                whole += with_sine(share, x) / 500.0;
                square += x * x * with_sine(share, x) / 500.0;
            }
            assert!((whole - 1.0).abs() < 1e-4, "{share}: {whole}");
            assert!((square - 1.0).abs() < 1e-3, "{share}: {square}");
        }
        assert!(with_sine(0.9, 1.2) > with_sine(0.9, 0.0));
    }

    #[test]
    fn pairs_sum_to_nothing_and_are_as_many_as_the_strength_asks() {
        let draw = &mut Draw::of(20_261_121, 21, 0);
        let stand = Stand::draw(draw, 600.0, 20.0, Needs::default());
        for wanted in [25.0, 40.0] {
            let y = pairs(draw, &stand, wanted);
            assert!(y.iter().sum::<f64>().abs() < 1e-9);
            let meter = Meter::new(&stand, 0);
            let (size, strength) = meter.sized(&meter.energy(&y), wanted);
            assert!((strength / wanted - 1.0).abs() < 1e-6);
            // Between 1.5 and 3 sigma, but for the refit of what is known of the noise.
            let sigmas = size / stand.white(0).sqrt();
            assert!((1.3..3.4).contains(&sigmas), "{sigmas}");
        }
    }
}
