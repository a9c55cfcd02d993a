//! Scans: a step at all times at once, a line at all frequencies at once, side bands, stretches of larger variance.

mod variance;

use std::sync::Arc;

use rustfft::num_complex::Complex;

use crate::fit::likelihood::{Bins, Dct, Noise, Panel, Solution};
use numerics::transform::RealFft;
pub(crate) use variance::{LOUD, levels};
pub use variance::{ends, of_a_stretch, segment, to_a_reading, variance_law};

/// Longest grid of step times; beyond it the scan is as fine as this many places.
const LONGEST_STEP_GRID: usize = 1 << 16;

/// Places that are worked on at a time: a few columns of so many fit the nearest cache.
const AT_HAND: usize = 512;

/// Residual coefficients of the data under a solution.
#[must_use]
pub fn residual(panel: &Panel, columns: &[usize], solution: &Solution) -> Vec<f64> {
    first_of_residual(panel, columns, solution, panel.bins.n)
}

/// The first `count` residual coefficients.
fn first_of_residual(
    panel: &Panel,
    columns: &[usize],
    solution: &Solution,
    count: usize,
) -> Vec<f64> {
    let mut r = panel.first(0, count);
    let minus: Vec<f64> = solution.beta.iter().map(|b| -b).collect();
    panel.add_columns(&mut r, 0, columns, &minus);
    r[0] = 0.0;
    r
}

/// Energy over white noise + random walk of a step at each of n times, beside its mean, by the walk's shape
/// 1 / (lambda + 4 sin^2(w / 2)): with lambda = 4 sinh^2(kappa / 2) the sum over all coefficients is that of a ring of twice
/// the length.
fn energies_beside_walk(n: usize, log_walk: f64) -> Vec<f64> {
    let kappa = 2.0 * (0.5 * (0.5 * log_walk).exp()).asinh();
    let kept = (-2.0 * kappa).exp();
    let lost = -(-2.0 * kappa).exp_m1();
    // 1 - exp(-2 kappa j), which loses no digits where kappa is next to nothing.
    let gone: Vec<f64> = std::iter::successors(Some(0.0), |gone| Some(kept * gone + lost))
        .take(n + 1)
        .collect();
    let scale = 1.0 / (gone[n] * 2.0 * kappa.sinh());
    let ends = gone.iter().zip(gone.iter().rev());
    ends.take(n).map(|(a, b)| a * b * scale).collect()
}

/// The same of any noise g, from the first coefficients of it and of the walk's shape.
fn energies_beside(g: &[f64], walks: &[f64], n: usize) -> Vec<f64> {
    let m = g.len();
    // Sums of cosines of even multiples: between the places of an odd length stands nothing.
    let apart = 1 + m % 2;
    let mut d = vec![0.0; apart * m];
    for (k, (w, g)) in walks.iter().zip(g).enumerate().skip(1) {
        d[apart * k] = w / g;
    }
    let total: f64 = d.iter().sum();
    let pair = |j: usize| Complex::new(d[2 * j], d[2 * j + 1]);
    let mut energies = vec![0.0; m];
    RealFft::new(apart * m).run(pair, |j, f| {
        if j > 0 && 2 * j <= m {
            let energy = (total - f.re) / n as f64;
            (energies[j], energies[m - j]) = (energy, energy);
        }
    });
    energies
}

/// What columns leave of energies, from the products of these with the columns and the columns' inverse; some places at a
/// time, which stay at hand for all pairs of columns.
fn energies_left(energies: &[f64], crossed: &[Vec<f64>], inverse: &[Vec<f64>]) -> Vec<f64> {
    let mut all = energies.to_vec();
    for (i, left) in all.chunks_mut(AT_HAND).enumerate() {
        let from = i * AT_HAND;
        for (p, x) in crossed.iter().enumerate() {
            for (q, y) in crossed.iter().enumerate().skip(p) {
                let times = if p == q { 1.0 } else { 2.0 };
                let v = times * inverse[p][q];
                let both = x[from..].iter().zip(&y[from..]);
                let both = left.iter_mut().zip(both);
                both.for_each(|(left, (x, y))| *left -= v * x * y);
            }
        }
    }
    all
}

/// <step at t, x> under each of some noises, for all t of a grid of the steps whose coefficients have `parts` of those in the
/// record; x is the residual, then each column. The sum of x over the noise, in time, from t on.
fn from_each_time(
    panel: &Panel,
    dct: &Dct,
    parts: &[f64],
    columns: &[usize],
    fits: &[(Vec<f64>, Solution)],
) -> Vec<Vec<f64>> {
    let m = parts.len();
    let weighted = fits.iter().flat_map(|(g, solution)| {
        let left = first_of_residual(panel, columns, solution, m);
        let own = columns.iter().map(|c| panel.first(*c, m));
        let all = std::iter::once(left).chain(own);
        all.map(move |mut x| {
            let by = parts.iter().zip(g).map(|(part, g)| part / g);
            x.iter_mut().zip(by).for_each(|(x, by)| *x *= by);
            x
        })
    });
    let mut sums: Vec<Vec<f64>> = dct.inverse_all(weighted).collect();
    for x in &mut sums {
        let mut sum = 0.0;
        for v in x.iter_mut().rev() {
            sum += *v;
            *v = sum;
        }
    }
    sums
}

/// Readings between two places of the scan for steps in a record of `n`.
#[must_use]
pub fn apart(n: usize) -> f64 {
    n as f64 / n.min(LONGEST_STEP_GRID) as f64
}

/// Likelihood ratio of a step at each of the grid's times, the random walk profiled; times in samples.
#[must_use]
pub fn steps(panel: &Panel, walks: &[Noise], columns: &[usize], null: f64) -> Vec<(f64, f64)> {
    let n = panel.bins.n;
    let m = n.min(LONGEST_STEP_GRID);
    let (dct, coarse) = if m < n {
        (Dct::new(m), Arc::new(Bins::new(m)))
    } else {
        (panel.dct.clone(), Arc::clone(&panel.bins))
    };
    let walk_shapes = &panel.bins.walks()[..m];
    // A step on the grid has these parts of the coefficients of one in the record: 1 where the grid is the record.
    let parts: &[f64] = &(walk_shapes.iter().zip(coarse.walks()))
        .map(|(fine, coarse)| (fine / coarse * m as f64 / n as f64).sqrt())
        .collect::<Vec<f64>>();
    let count = (n - 1) as f64;
    // The likelihood falls with the residual sum of squares times the geometric mean of the noise: the least of the walks.
    let mut least = vec![f64::INFINITY; m];
    // Two at a time, as their transforms are made.
    for walks in walks.chunks(2) {
        let fits: Vec<(Vec<f64>, Solution)> = walks
            .iter()
            .map(|noise| {
                let solution = panel.solve(&noise.over(&panel.bins), columns);
                (noise.first(&panel.bins, m), solution)
            })
            .collect();
        let sums = from_each_time(panel, &dct, parts, columns, &fits);
        let sums = sums.chunks(1 + columns.len());
        for ((noise, (g, solution)), sums) in walks.iter().zip(&fits).zip(sums) {
            let energies = if noise.terms.is_empty() && m == n {
                energies_beside_walk(n, noise.log_walk)
            } else {
                energies_beside(g, walk_shapes, n)
            };
            let mean = (solution.log_det_noise / count).exp();
            let left = energies_left(&energies, &sums[1..], &solution.inverse);
            for (j, a) in sums[0].iter().enumerate().skip(1) {
                if left[j] < 1e-6 * energies[j] {
                    continue;
                }
                let rss = (solution.rss - a * a / left[j]).max(solution.rss * 1e-9);
                least[j] = least[j].min(rss * mean);
            }
        }
    }
    let places = n as f64 / m as f64;
    let lr = |least: f64| -count * (least / count).ln() - 2.0 * null;
    // A step next to an end is a spike or an offset of a few samples: half a second is left out by the caller.
    least
        .into_iter()
        .enumerate()
        .skip(1)
        .map(|(j, least)| (j as f64 * places, lr(least)))
        .collect()
}

/// The line at k pi / n, k from `least` on, that explains most, and its likelihood ratio: by the amplitude of the whitened
/// residual at twice the Fourier frequencies.
#[must_use]
pub fn best_line(
    panel: &Panel,
    noise: &Noise,
    columns: &[usize],
    solution: &Solution,
    least: usize,
) -> Option<(usize, f64)> {
    let n = panel.bins.n;
    let g = noise.everywhere(&panel.bins);
    let mut weighted = residual(panel, columns, solution);
    weighted.iter_mut().zip(&g).for_each(|(r, g)| *r /= g);
    let energies = panel.dct.energies(&weighted);
    let drops =
        (energies.iter().zip(&g).enumerate()).map(|(k, (e, g))| (k, e * 2.0 * g / n as f64));
    let all = drops.take(n - 1).skip(least.max(1));
    let (k, drop) = all.max_by(|a, b| a.1.total_cmp(&b.1))?;
    let count = (n - 1) as f64;
    Some((k, -count * (1.0 - (drop / solution.rss).min(0.999)).ln()))
}

/// exp(i (omega t + phase)) for t = 0..n, turned on from sample to sample and set anew now and then.
fn turning(n: usize, omega: f64, phase: f64) -> impl Iterator<Item = Complex<f64>> {
    const ANEW: usize = 64;
    let step = Complex::from_polar(1.0, omega);
    let mut at = Complex::new(1.0, 0.0);
    (0..n).map(move |t| {
        at = if t.is_multiple_of(ANEW) {
            Complex::from_polar(1.0, omega * t as f64 + phase)
        } else {
            at * step
        };
        at
    })
}

/// Cosine and sine of a frequency in rad per sample.
#[must_use]
pub fn sinusoid(n: usize, omega: f64) -> [Vec<f64>; 2] {
    let (cosine, sine) = turning(n, omega, 0.0).map(|c| (c.re, c.im)).unzip();
    [cosine, sine]
}

/// A line of that frequency and phase whose amplitude swings with the angular frequency `beat`: cosine and sine of the
/// swing.
#[must_use]
pub fn swings(n: usize, carrier: f64, phase: f64, beat: f64) -> [Vec<f64>; 2] {
    let (cosine, sine) = turning(n, carrier, phase)
        .zip(turning(n, beat, 0.0))
        .map(|(line, swing)| (line.re * swing.re, line.re * swing.im))
        .unzip();
    [cosine, sine]
}

/// A neighbourhood of one frequency, narrow against 1 over the length of a stretch: sums of a signal turned back by that
/// frequency over stretches, from which its Fourier integral at any frequency close by is made.
struct Zoom {
    omega: f64,
    stretch: f64,
    sums: Vec<Complex<f64>>,
}

impl Zoom {
    /// Stretches: within a bin of half a cycle, what turns in one of them is a thousandth of a cycle.
    const STRETCHES: usize = 1024;

    fn new(n: usize, signal: impl Iterator<Item = f64>, omega: f64) -> Self {
        let length = n.div_ceil(Self::STRETCHES);
        let mut sums = vec![Complex::new(0.0, 0.0); n.div_ceil(length)];
        for (i, (v, turned)) in signal.zip(turning(n, -omega, 0.0)).enumerate() {
            sums[i / length] += turned * v;
        }
        Self {
            omega,
            stretch: length as f64,
            sums,
        }
    }

    /// Sum of signal[t] exp(-i omega t).
    fn at(&self, omega: f64) -> Complex<f64> {
        let off = self.omega - omega;
        let middle = off * 0.5 * (self.stretch - 1.0);
        turning(self.sums.len(), off * self.stretch, middle)
            .zip(&self.sums)
            .map(|(turn, sum)| turn * sum)
            .sum()
    }
}

/// Frequencies of a state's lines with the places of their cosine and sine among its columns.
pub type Lines = [(f64, usize)];

/// Half cycles in the record from which a line is sought by its Fourier integral, and within which lines know of each
/// other.
const MANY: f64 = 256.0;
const CLOSE: f64 = 100.0;
/// Largest density over the least at a line: what leaks out of it into quieter bands then says nothing of its place.
const EVEN: f64 = 1.3;

/// Sums of products of the cosine and the sine of a line over `n` samples of white noise of variance `own`.
fn products_of_line(w: f64, n: usize, own: f64) -> [[f64; 2]; 2] {
    // Sum of exp(-2 i w t).
    let turn = Complex::from_polar(1.0, -2.0 * w);
    let all = (1.0 - Complex::from_polar(1.0, -2.0 * w * n as f64)) / (1.0 - turn);
    let half = 0.5 * n as f64;
    let b = [
        [half + 0.5 * all.re, -0.5 * all.im],
        [-0.5 * all.im, half - 0.5 * all.re],
    ];
    b.map(|row| row.map(|v| v / own))
}

/// The frequency within half a cycle of `omega` at which a line explains most, the columns of the state with it; `None`
/// where the noise about it is not even enough, or the line too slow, for sums in time.
#[must_use]
pub fn place_of_line(
    panel: &Panel,
    noise: &Noise,
    columns: &[usize],
    solution: &Solution,
    lines: &Lines,
    omega: f64,
) -> Option<f64> {
    let n = panel.bins.n;
    let bin = std::f64::consts::PI / n as f64;
    let bare = noise.over(&panel.bins);
    let least = bare.iter().copied().fold(f64::INFINITY, f64::min);
    let own = noise.at(omega);
    if omega < MANY * bin || std::f64::consts::PI - omega < MANY * bin || own > EVEN * least {
        return None;
    }
    let g = noise.everywhere(&panel.bins);
    let mut r = residual(panel, columns, solution);
    r.iter_mut().zip(&g).for_each(|(r, g)| *r /= g);
    let left = Zoom::new(n, panel.dct.inverse(&r).into_iter(), omega);
    // Of the other lines only near ones depend on where this one is.
    let near: Vec<(usize, Zoom)> = lines
        .iter()
        .filter(|(w, _)| (w - omega).abs() < CLOSE * bin)
        .flat_map(|(w, column)| {
            let of = |part: fn(Complex<f64>) -> f64| {
                Zoom::new(n, turning(n, *w, 0.0).map(move |c| part(c) / own), omega)
            };
            [(*column, of(|c| c.re)), (column + 1, of(|c| c.im))]
        })
        .collect();
    let explained = |w: f64| -> f64 {
        let parts = |z: Complex<f64>| [z.re, -z.im];
        let a = parts(left.at(w));
        let mut b = products_of_line(w, n, own);
        let crossed: Vec<(usize, [f64; 2])> =
            near.iter().map(|(c, z)| (*c, parts(z.at(w)))).collect();
        for (i, x) in &crossed {
            for (j, y) in &crossed {
                let v = solution.inverse[*i][*j];
                for p in 0..2 {
                    for q in 0..2 {
                        b[p][q] -= x[p] * v * y[q];
                    }
                }
            }
        }
        let det = b[0][0] * b[1][1] - b[0][1] * b[1][0];
        // Nothing is left of a line that the others make.
        if det < 1e-6 * (0.5 * n as f64 / own).powi(2) {
            return 0.0;
        }
        (a[0] * a[0] * b[1][1] - 2.0 * a[0] * a[1] * b[0][1] + a[1] * a[1] * b[0][0]) / det
    };
    let (from, to) = (omega - bin, omega + bin);
    Some(numerics::minimise::golden(&|w| -explained(w), from, to, 20))
}

/// Likelihood ratio of a swing of a line's amplitude with the angular frequency k pi / n, for k = 0..n: its two side
/// bands have the amplitude and the phase that the line and one swing leave them, two unknowns instead of four.
#[must_use]
pub fn beats(
    panel: &Panel,
    noise: &Noise,
    columns: &[usize],
    solution: &Solution,
    carrier: f64,
    phase: f64,
) -> Vec<f64> {
    let n = panel.bins.n;
    let g = noise.everywhere(&panel.bins);
    let mut weighted = residual(panel, columns, solution);
    weighted.iter_mut().zip(&g).for_each(|(r, g)| *r /= g);
    let z = panel.dct.inverse(&weighted);
    drop(weighted);
    let moved: Vec<f64> = z
        .iter()
        .zip(turning(n, carrier, phase))
        .map(|(v, line)| v * line.re)
        .collect();
    let seen = panel.dct.energies_of(moved);
    let centre = carrier / std::f64::consts::PI * n as f64;
    let at = |k: f64| 1.0 / g[(k.round().max(1.0) as usize).min(n - 1)];
    let count = (n - 1) as f64;
    (0..n)
        .map(|k| {
            // Energy of a swing over its noise: a quarter of the samples, half of it in each side band.
            let energy = n as f64 / 8.0 * (at(centre + k as f64) + at((centre - k as f64).abs()));
            let drop = seen[k] / energy;
            -count * (1.0 - (drop / solution.rss).min(0.999)).ln()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::likelihood::least_walk;

    #[test]
    fn a_step_has_the_energy_of_its_coefficients_over_the_noise() {
        for n in [600, 601] {
            let (dct, bins) = (Dct::new(n), Bins::new(n));
            for log_walk in [least_walk(n), -9.0, 1.0] {
                let g = Noise::new(log_walk).everywhere(&bins);
                let closed = energies_beside_walk(n, log_walk);
                let summed = energies_beside(&g, bins.walks(), n);
                for t in [1, 7, n / 2, n - 1] {
                    let step = (0..n).map(|i| f64::from(u8::from(i >= t)));
                    let c = dct.forward(&step.collect::<Vec<_>>());
                    let parts = c.iter().zip(&g).skip(1);
                    let energy: f64 = parts.map(|(c, g)| c * c / g).sum();
                    for found in [closed[t], summed[t]] {
                        assert!((found / energy - 1.0).abs() < 1e-9, "{n} {log_walk} {t}");
                    }
                }
            }
        }
    }
}
