//! Bands of several axes that are one: a stand that shakes turns about all of them.
//!
//! Of the whitened residuals X and Y of two axes, transformed, a frequency at which one source makes the parts b^2 and d^2 of their
//! variances has the correlation E[Y X*] = r b d e^(ip). Coherence r and phase p are estimated by the likelihood of jointly normal
//! values over all frequencies (Whittle). What axes share beside that is asked of what a common source leaves of each ([`Way`]).

use std::collections::BTreeMap;
use std::f64::consts::{SQRT_2, TAU};

use model::effect::{Parameters, Signal};
use model::effects::effect;
use model::one_source;
use model::record::Quantity;
use numerics::minimise::golden;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

use crate::fit::channel::{Form, Term};
use crate::fit::threshold;
use crate::result::{Finding, sentence};
use crate::search::band_source::{FOLLOWED, Standing};
use crate::search::envelope::REACH;
use crate::search::searched::Searched;

/// Largest coherence: of more, what noise there is tells nothing.
const MOST: f64 = 0.9999;
/// Steps of the search for it, each of which leaves 0.62 of where it may be; times that its phase is estimated anew.
const STEPS: usize = 40;
const ROUNDS: usize = 3;

/// A band of an axis.
struct Band {
    /// The axis, by its place among those searched.
    axis: usize,
    /// Its terms, the strongest first.
    terms: Vec<usize>,
    omega: f64,
    half_width: f64,
}

/// What a band has of the source.
struct Member {
    band: Band,
    /// With the first band of the source.
    coherence: (f64, f64),
    phase: (f64, f64),
    /// Likelihood ratio of the two against none.
    lr: f64,
    /// Its part of the standard deviation at each frequency.
    weights: Vec<f64>,
}

/// An accelerometer that feels a source.
struct Acceleration {
    name: String,
    /// Of the first band with what the accelerometer reads.
    coherence: (f64, f64),
    phase: (f64, f64),
    lr: f64,
    read: Shaken,
}

/// A source that several axes feel, or one and an accelerometer. The first stands for it.
pub(crate) struct OneSource {
    members: Vec<Member>,
    accelerations: Vec<Acceleration>,
}

impl OneSource {
    /// The coherence at which the first band of a standard deviation, centre and half width in rad per sample, is what a simulation makes
    /// of the accelerometers' readings: those know how large the source was in this record. Generalised least squares of the residual.
    fn as_simulated(&self, s: &Searched<'_>, [rms, omega, half_width]: [f64; 3]) -> Option<f64> {
        let signals = s.search.view.signals.iter();
        let read = self.accelerations.iter().filter_map(|a| {
            let own = signals.clone().find(|s| s.name == a.name)?;
            Some((own.values.as_slice(), a.phase.0))
        });
        let z = one_source::read(&read.collect::<Vec<_>>(), omega, half_width)?;
        let planner = &mut FftPlanner::new();
        let (z, own) = (transformed(&z, planner), transformed(&s.e, planner));
        let g = s.state.noise.through(frequencies(s.e.len()));
        let each = z[1..].iter().zip(&own[1..]).zip(g);
        let (mut product, mut square) = (Complex::<f64>::default(), 0.0);
        for ((z, e), g) in each {
            let x = z / (s.state.solution.white * g).sqrt();
            product += x.conj() * e;
            square += x.norm_sqr();
        }
        Some((product.norm() / square / rms).min(1.0))
    }
}

/// What an accelerometer reads about a band.
struct Shaken {
    /// Transform of its readings over the square root of their density; 0 elsewhere.
    values: Vec<Complex<f64>>,
    /// The part of its standard deviation that the oscillation makes; 0 elsewhere.
    weights: Vec<f64>,
}

/// The peak that an accelerometer reads where a band is; none where it shows none.
fn shaken(values: &[Complex<f64>], band: &Band) -> Option<Shaken> {
    let step = std::f64::consts::TAU / values.len() as f64;
    let off = |k: usize| (k as f64 * step - band.omega) / band.half_width;
    let places = 1..values.len().div_ceil(2);
    let energies = places.clone().map(|k| (off(k), values[k].norm_sqr()));
    let Standing { height, level } = Standing::of(energies, 1.0)?;
    let mut found = Shaken {
        values: vec![Complex::default(); values.len()],
        weights: vec![0.0; places.len()],
    };
    for k in places.filter(|k| off(*k).abs() <= REACH) {
        let above = height * Standing::shape(off(k));
        let density = above + level;
        found.values[k] = values[k] / density.sqrt();
        found.weights[k - 1] = (above / density).sqrt();
    }
    Some(found)
}

/// The accelerometers that read a peak where a band is, and feel the same.
fn accelerations(
    s: &Searched<'_>,
    band: &Band,
    own: &[Complex<f64>],
    weights: &[f64],
    planner: &mut FftPlanner<f64>,
) -> Vec<Acceleration> {
    let signals = s.search.view.signals.iter();
    let accelerometers = signals.filter(|c| c.quantity == Quantity::Acc);
    let all = accelerometers.filter_map(|c| {
        let mean = c.values.iter().sum::<f64>() / c.values.len() as f64;
        let centred: Vec<f64> = c.values.iter().map(|v| v - mean).collect();
        let read = shaken(&transformed(&centred, planner), band)?;
        let pair = Pair::new(&read.values, own, &read.weights, weights);
        let (coherence, phase, lr) = pair.estimate();
        is_one(coherence.0, lr).then(|| Acceleration {
            name: c.name.clone(),
            coherence,
            phase,
            lr,
            read,
        })
    });
    all.collect()
}

/// Whether a coherence of that likelihood ratio is none of chance: it has two degrees of freedom.
fn is_one(coherence: f64, lr: f64) -> bool {
    (-lr / 2.0).exp() < threshold::false_alarm() && coherence.powi(2) > FOLLOWED
}

/// The bands of an axis at rest.
fn bands(axis: usize, s: &Searched<'_>) -> Vec<Band> {
    if s.target.moving || s.search.view.sways() {
        return vec![];
    }
    let terms = s.state.terms.iter().enumerate();
    let first = terms.filter(|(_, t)| t.is_band() && !t.is_part());
    let all = first.filter_map(|(i, t)| {
        let peak = t.peak()?;
        let of_it = |o: &Term| {
            o.cluster
                .is_some_and(|c| Some(c.number) == t.cluster.map(|c| c.number))
        };
        let others = s.state.terms.iter().enumerate();
        let others = others.filter(|(k, o)| *k != i && of_it(o)).map(|(k, _)| k);
        Some(Band {
            axis,
            terms: std::iter::once(i).chain(others).collect(),
            omega: peak.omega,
            half_width: peak.half_width,
        })
    });
    all.collect()
}

/// Angular frequencies of the transform of so many samples, without 0 and the highest.
fn frequencies(samples: usize) -> impl Iterator<Item = f64> {
    let step = std::f64::consts::TAU / samples as f64;
    (1..samples.div_ceil(2)).map(move |k| step * k as f64)
}

/// The part of the standard deviation of an axis that a band makes, at each frequency.
fn weights(s: &Searched<'_>, band: &Band) -> Vec<f64> {
    let omega: Vec<f64> = frequencies(s.e.len()).collect();
    let all = s.state.noise.through(omega.iter().copied());
    let cosine = omega.iter().map(|w| w.cos()).collect();
    let at = model::effect::Frequencies { omega, cosine };
    let mut own = vec![0.0; all.len()];
    for i in &band.terms {
        if let Form::Covariance(process, theta) = &s.state.terms[*i].form {
            let density = process.density(theta, &at);
            own.iter_mut().zip(density).for_each(|(o, d)| *o += d);
        }
    }
    own.iter().zip(all).map(|(o, g)| (o / g).sqrt()).collect()
}

/// A residual transformed, of variance 1 at each frequency.
fn transformed(e: &[f64], planner: &mut FftPlanner<f64>) -> Vec<Complex<f64>> {
    let scale = (e.len() as f64).sqrt().recip();
    let mut z: Vec<_> = e.iter().map(|v| Complex::new(v * scale, 0.0)).collect();
    planner.plan_fft_forward(z.len()).process(&mut z);
    z
}

/// Two residuals at the frequencies that both bands share, each by a weight.
struct Pair {
    /// Product of the weights, X* Y, and the energy of both.
    each: Vec<(f64, Complex<f64>, f64)>,
}

impl Pair {
    fn new(x: &[Complex<f64>], y: &[Complex<f64>], a: &[f64], b: &[f64]) -> Self {
        let values = x[1..].iter().zip(&y[1..]).zip(a.iter().zip(b));
        let each =
            values.map(|((x, y), (a, b))| (a * b, x.conj() * y, x.norm_sqr() + y.norm_sqr()));
        Self {
            each: each.collect(),
        }
    }

    /// Phase at which a coherence is likeliest.
    fn phase(&self, r: f64) -> f64 {
        let terms = self.each.iter();
        let sum: Complex<f64> = terms
            .map(|(w, product, _)| product * (w / (1.0 - (r * w).powi(2))))
            .sum();
        sum.arg()
    }

    /// Likelihood ratio of a coherence and a phase against none.
    fn ratio(&self, r: f64, phase: f64) -> f64 {
        let turned = Complex::from_polar(1.0, -phase);
        let terms = self.each.iter().map(|(w, product, energy)| {
            let a = r * w;
            let left = 1.0 - a * a;
            -left.ln() - (a * a * energy - 2.0 * a * (product * turned).re) / left
        });
        2.0 * terms.sum::<f64>()
    }

    /// Coherence and phase with their standard errors, and their likelihood ratio.
    fn estimate(&self) -> ((f64, f64), (f64, f64), f64) {
        let mut r = 0.0;
        for _ in 0..ROUNDS {
            let phase = self.phase(r);
            r = golden(&|r| -self.ratio(r, phase), 0.0, MOST, STEPS);
        }
        let phase = self.phase(r);
        // Fisher's information of a correlation of complex normal values beside their variances, and of its phase.
        let [of_size, of_phase] = self
            .each
            .iter()
            .fold([0.0, 0.0], |[size, phase], (w, _, _)| {
                let square = (r * w).powi(2);
                let left = 1.0 - square;
                [size + 2.0 * (w / left).powi(2), phase + 2.0 * square / left]
            });
        let error = |information: f64| information.max(f64::MIN_POSITIVE).sqrt().recip();
        (
            (r, error(of_size)),
            (phase, error(of_phase)),
            self.ratio(r, phase),
        )
    }
}

/// The sources that bands of more than one axis have in common.
pub(crate) fn found(searched: &[Searched<'_>]) -> Vec<OneSource> {
    let mut left: Vec<Band> = (searched.iter().enumerate())
        .flat_map(|(axis, s)| bands(axis, s))
        .collect();
    let mut planner = FftPlanner::new();
    let mut all = vec![];
    while !left.is_empty() {
        let first = left.remove(0);
        let near = |b: &Band| {
            b.axis != first.axis && (b.omega - first.omega).abs() < b.half_width + first.half_width
        };
        let felt = |c: &Signal| c.quantity == Quantity::Acc;
        let shakes = searched[first.axis].search.view.signals.iter().any(felt);
        if !shakes && !left.iter().any(near) {
            continue;
        }
        let own = transformed(&searched[first.axis].e, &mut planner);
        let of_first = weights(&searched[first.axis], &first);
        let mut others: Vec<Member> = vec![];
        while let Some(k) = (0..left.len())
            .find(|k| near(&left[*k]) && others.iter().all(|m| m.band.axis != left[*k].axis))
        {
            let band = left.remove(k);
            let s = &searched[band.axis];
            let weights = weights(s, &band);
            let there = transformed(&s.e, &mut planner);
            let (coherence, phase, lr) = Pair::new(&own, &there, &of_first, &weights).estimate();
            if is_one(coherence.0, lr) {
                others.push(Member {
                    band,
                    coherence,
                    phase,
                    lr,
                    weights,
                });
            }
        }
        let s = &searched[first.axis];
        let accelerations = accelerations(s, &first, &own, &of_first, &mut planner);
        if !others.is_empty() || !accelerations.is_empty() {
            let first = Member {
                band: first,
                coherence: (1.0, 0.0),
                phase: (0.0, 0.0),
                lr: 0.0,
                weights: of_first,
            };
            let members = std::iter::once(first).chain(others).collect();
            all.push(OneSource {
                members,
                accelerations,
            });
        }
    }
    all
}

/// What is left of residuals x with correlations R at a frequency.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Way {
    /// Of each axis what those before it do not foretell, L^-1 x with R = L L*: all independent of each other.
    Independent,
    /// Of each axis what all others do not foretell, R^-1 x: each independent of whatever is made of the others' readings.
    Alone,
}

/// What the residuals of an axis were.
#[derive(Default)]
pub(crate) struct Whole {
    e: Vec<f64>,
    u: Vec<f64>,
    told: Option<Vec<f64>>,
}

/// Leaves of the residuals what the sources do not make of axes before them; gives what they were.
pub(crate) fn taken_apart(searched: &mut [Searched<'_>], sources: &[OneSource]) -> Vec<Whole> {
    if sources.is_empty() {
        return vec![];
    }
    let times = |s: &Searched<'_>| s.told.as_ref().map(|told| s.search.panel.dct.inverse(told));
    let e: Vec<Vec<f64>> = searched.iter().map(|s| s.e.clone()).collect();
    let lost = searched.iter().any(|s| s.told.is_some());
    let told: Option<Vec<Vec<f64>>> = lost.then(|| {
        let each = searched.iter().zip(&e);
        let each = each.map(|(s, e)| times(s).unwrap_or_else(|| e.clone()));
        apart(each.collect(), sources, Way::Independent)
    });
    let e = apart(e, sources, Way::Independent);
    let mut whole = vec![];
    for (k, (s, e)) in searched.iter_mut().zip(e).enumerate() {
        let dct = &s.search.panel.dct;
        let u = dct.forward(&e);
        let own = told.as_ref().filter(|_| s.told.is_some());
        let own = own.map(|told| dct.forward(&told[k]));
        whole.push(Whole {
            e: std::mem::replace(&mut s.e, e),
            u: std::mem::replace(&mut s.u, u),
            told: std::mem::replace(&mut s.told, own),
        });
    }
    whole
}

/// The residual of each axis without what the sources make of all others, where there are some.
pub(crate) fn alone(searched: &[Searched<'_>], sources: &[OneSource]) -> Vec<Vec<f64>> {
    if sources.is_empty() {
        return vec![];
    }
    let all = searched.iter().map(|s| s.e.clone());
    apart(all.collect(), sources, Way::Alone)
}

/// Puts residuals back that were taken apart.
pub(crate) fn put_back(searched: &mut [Searched<'_>], whole: Vec<Whole>) {
    for (s, whole) in searched.iter_mut().zip(whole) {
        (s.e, s.u, s.told) = (whole.e, whole.u, whole.told);
    }
}

/// Residuals of all axes without what sources make of others.
fn apart(all: Vec<Vec<f64>>, sources: &[OneSource], way: Way) -> Vec<Vec<f64>> {
    let planner = &mut FftPlanner::new();
    let length = all.first().map_or(0, Vec::len);
    let mut spectra: Vec<Vec<Complex<f64>>> = all.iter().map(|e| transformed(e, planner)).collect();
    // The accelerometers come first: what they tell is known before any axis.
    let read: Vec<&Acceleration> = sources.iter().flat_map(|s| &s.accelerations).collect();
    let known = read.len();
    let axes = known + all.len();
    let mut shares = vec![vec![Complex::default(); axes]; sources.len()];
    for k in 1..length.div_ceil(2) {
        let mut places = 0..known;
        for (source, shares) in sources.iter().zip(&mut shares) {
            for m in &source.members {
                let size = m.coherence.0.min(MOST) * m.weights[k - 1];
                shares[known + m.band.axis] = Complex::from_polar(size, m.phase.0);
            }
            for (a, place) in source.accelerations.iter().zip(&mut places) {
                let size = a.coherence.0.min(MOST) * a.read.weights[k - 1];
                shares[place] = Complex::from_polar(size, -a.phase.0);
            }
        }
        let correlation = |i: usize, j: usize| -> Complex<f64> {
            if i == j {
                return Complex::new(1.0, 0.0);
            }
            shares.iter().map(|a| a[i] * a[j].conj()).sum()
        };
        let of_known = read.iter().map(|a| a.read.values[k]);
        let values = of_known.chain(spectra.iter().map(|z| z[k]));
        let values: Vec<Complex<f64>> = values.collect();
        let left = solved(&correlation, &values, way).into_iter().skip(known);
        for (z, value) in spectra.iter_mut().zip(left) {
            z[k] = value;
            z[length - k] = value.conj();
        }
    }
    let scale = (length as f64).sqrt().recip();
    let back = planner.plan_fft_inverse(length.max(1));
    spectra
        .into_iter()
        .map(|mut z| {
            back.process(&mut z);
            z.iter().map(|v| v.re * scale).collect()
        })
        .collect()
}

/// What is left of `x`, each of variance 1.
fn solved(
    correlation: &dyn Fn(usize, usize) -> Complex<f64>,
    x: &[Complex<f64>],
    way: Way,
) -> Vec<Complex<f64>> {
    let count = x.len();
    let mut lower = vec![vec![Complex::default(); count]; count];
    for i in 0..count {
        for j in 0..i {
            let sum: Complex<f64> = (0..j).map(|k| lower[i][k] * lower[j][k].conj()).sum();
            lower[i][j] = (correlation(i, j) - sum) / lower[j][j].re;
        }
        let rest = 1.0 - lower[i][..i].iter().map(Complex::norm_sqr).sum::<f64>();
        lower[i][i] = Complex::new(rest.max(1.0 - MOST).sqrt(), 0.0);
    }
    let forward = |x: &[Complex<f64>]| {
        let mut solved: Vec<Complex<f64>> = Vec::with_capacity(count);
        for (i, row) in lower.iter().enumerate() {
            let sum: Complex<f64> = row.iter().zip(&solved).map(|(l, s)| l * s).sum();
            solved.push((x[i] - sum) / row[i].re);
        }
        solved
    };
    let independent = forward(x);
    if way == Way::Independent {
        return independent;
    }
    // Row i of R^-1 is that of L^-1* L^-1; of variance 1 by its diagonal.
    let of_unit = |i: usize| {
        let mut unit = vec![Complex::default(); count];
        unit[i] = Complex::new(1.0, 0.0);
        let column = forward(&unit);
        let each = column.iter().zip(&independent);
        let sum: Complex<f64> = each.map(|(c, s)| c.conj() * s).sum();
        sum / column.iter().map(Complex::norm_sqr).sum::<f64>().sqrt()
    };
    (0..count).map(of_unit).collect()
}

/// Whether what is told by channel is one source that these feel.
pub(crate) fn is_shared(per_channel: &BTreeMap<String, Parameters>) -> bool {
    let names = || per_channel.keys();
    let mut all = per_channel.values();
    all.any(|p| names().any(|of| p.contains_key(&format!("with_{of}"))))
}

/// States in the findings of the terms of each axis what of them is another axis' too.
pub(crate) fn state(
    of_terms: &mut [Vec<Finding>],
    searched: &[Searched<'_>],
    sources: &[OneSource],
    rate_hz: f64,
) {
    for source in sources {
        let Some((first, others)) = source.members.split_first() else {
            continue;
        };
        let of_first = &searched[first.band.axis];
        let found = (first.band.terms.first()).and_then(|i| of_terms[first.band.axis].get(*i));
        let value = |name: &str| found?.parameters.get(name).map(|p| p.value);
        let to_omega = TAU / rate_hz;
        let described = value("rms")
            .or(value("amplitude").map(|a| a / SQRT_2))
            .zip(value("center_frequency").zip(value("bandwidth").or(value("linewidth"))));
        let simulated = described.and_then(|(rms, (center, width))| {
            source.as_simulated(of_first, [rms, to_omega * center, 0.5 * to_omega * width])
        });
        let read = source.accelerations.iter().map(|a| {
            let coherence = (simulated.unwrap_or(a.coherence.0), a.coherence.1);
            (first, &a.name, coherence, a.phase, a.lr)
        });
        let name = &of_first.target.name;
        let felt = others.iter().map(|m| (m, name, m.coherence, m.phase, m.lr));
        for (m, name, coherence, phase, lr) in read.chain(felt) {
            let of: Option<Parameters> = one_source::of_axis(name, coherence, phase);
            let axis = m.band.axis;
            let finding = m
                .band
                .terms
                .first()
                .and_then(|i| of_terms[axis].get_mut(*i));
            let (Some(of), Some(f)) = (of, finding) else {
                continue;
            };
            f.parameters.extend(of);
            f.likelihood_ratio = f.likelihood_ratio.map(|own| own + lr);
            if let Some(e) = effect(&f.cause) {
                f.what = sentence(e, &searched[axis].target.name, &f.parameters);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    #[test]
    fn coherence_and_phase_are_those_that_were_planted_within_their_errors() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(8);
        let mut draw = || -> Complex<f64> {
            let [a, b]: [f64; 2] = std::array::from_fn(|_| StandardNormal.sample(&mut rng));
            Complex::new(a, b) * 0.5f64.sqrt()
        };
        for (r, phase) in [(0.3, -2.0), (0.7, 0.4), (0.95, 3.0)] {
            let (mut sizes, mut phases) = (0, 0);
            for _ in 0..200 {
                // A band that makes up to nine tenths of the variance.
                let weights: Vec<f64> = (-200..200)
                    .map(|k| (9.0 / (10.0 + (f64::from(k) / 20.0).powi(2))).sqrt())
                    .collect();
                let (mut x, mut y) = (vec![Complex::default()], vec![Complex::default()]);
                for w in &weights {
                    let (source, own) = (draw(), draw());
                    let other = r * source + (1.0 - r * r as f64).sqrt() * own;
                    let left = (1.0 - w * w).sqrt();
                    x.push(w * source + left * draw());
                    y.push(w * other * Complex::from_polar(1.0, phase) + left * draw());
                }
                let (size, at, lr) = Pair::new(&x, &y, &weights, &weights).estimate();
                sizes += usize::from((size.0 - r).abs() < 1.96 * size.1);
                let off = (at.0 - phase + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU);
                phases += usize::from((off - std::f64::consts::PI).abs() < 1.96 * at.1);
                assert!(lr > 0.0);
            }
            // 190 of 200 are expected at 95 %, fewer than 180 once in 500.
            assert!(sizes >= 180 && phases >= 180, "{r}: {sizes}, {phases}");
        }
    }

    #[test]
    fn what_is_left_is_independent_and_of_variance_one() {
        let one = Complex::new(1.0, 0.0);
        let off = [
            Complex::from_polar(0.8, 1.0),
            Complex::from_polar(0.6, -2.0),
            Complex::from_polar(0.7, 0.3),
        ];
        // A source that makes these parts of three axes.
        let correlation = |i: usize, j: usize| if i == j { one } else { off[i] * off[j].conj() };
        for way in [Way::Independent, Way::Alone] {
            // Columns of the matrix that is applied.
            let columns: Vec<Vec<Complex<f64>>> = (0..3)
                .map(|k| {
                    let unit: Vec<_> = (0..3)
                        .map(|i| if i == k { one } else { Complex::default() })
                        .collect();
                    solved(&correlation, &unit, way)
                })
                .collect();
            let with = |i: usize, j: usize, of_second: &dyn Fn(usize, usize) -> Complex<f64>| {
                let mut sum = Complex::default();
                for a in 0..3 {
                    for b in 0..3 {
                        sum += columns[a][i] * correlation(a, b) * of_second(b, j).conj();
                    }
                }
                sum
            };
            for i in 0..3 {
                let variance = with(i, i, &|b, j| columns[b][j]);
                assert!((variance - 1.0).norm() < 1e-12, "{way:?}: {variance}");
                for j in (0..3).filter(|j| *j != i) {
                    let second = |b: usize, j: usize| match way {
                        Way::Independent => columns[b][j],
                        Way::Alone if b == j => one,
                        Way::Alone => Complex::default(),
                    };
                    let left = with(i, j, &second);
                    assert!(left.norm() < 1e-12, "{way:?} {i} {j}: {left}");
                }
            }
        }
    }
}
