//! Energy that a model leaves about a line.

use numerics::tails::chi_tail;

/// Coefficients from a line within which another one is of the same tone.
pub(crate) const BESIDE: f64 = 30.0;
/// Half widths about a line, in coefficients, and chance below which the energy there is not the model's. It is asked only
/// where something is left over somewhere.
const ABOUT: [usize; 3] = [BESIDE as usize, 120, 480];
const LEAST_CHANCE_ABOUT: f64 = 0.01;

/// Nats by which a model that knows the energy of `count` coefficients, over the model's, is ahead.
pub(crate) fn nats(energy: f64, count: f64) -> f64 {
    0.5 * count * (energy - 1.0 - energy.max(1e-12).ln())
}

/// What is left about a coefficient of the whitened ones, nats; 0 where that may be chance: what makes a line of a tone that is
/// not steady lies beside it.
pub(crate) fn stands_out(u: &[f64], at: f64) -> f64 {
    let left = ABOUT.iter().map(|half| {
        let from = (at as usize).saturating_sub(*half).max(1);
        let to = (at as usize + half).min(u.len());
        let sum: f64 = u[from..to].iter().map(|v| v * v).sum();
        let count = (to - from) as f64;
        if chi_tail(sum, count) < LEAST_CHANCE_ABOUT {
            nats(sum / count, count)
        } else {
            0.0
        }
    });
    left.fold(0.0, f64::max)
}
