//! Bands of several axes that are one: a stand that shakes turns about all of them.
//!
//! Of the whitened residuals X and Y of two axes, transformed, a frequency at which one source makes the parts b^2 and d^2 of their
//! variances has the correlation E[Y X*] = r b d e^(ip). Coherence r and phase p are estimated by the likelihood of jointly normal
//! values over all frequencies (Whittle). What axes share beside that is asked of what a common source leaves of each.

mod apart;
mod pair;

use std::f64::consts::{SQRT_2, TAU};
use std::sync::Arc;

use model::effect::{Parameters, Peak, Signal};
use model::effects::{effect, wandering_line::is_of_rotor};
use model::one_source::{self, Wander};
use model::record::Quantity;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

use crate::fit::channel::{Form, Path, Term, whitened_by_spectrum};
use crate::fit::threshold;
use crate::result::{Finding, sentence};
use crate::search::band_source::{FOLLOWED, Standing};
use crate::search::envelope::REACH;
use crate::search::searched::Searched;
pub(crate) use apart::{alone, put_back, taken_apart};
use pair::Pair;

/// Largest coherence: of more, what noise there is tells nothing.
const MOST: f64 = 0.9999;

/// Coherence of two tones that were tracked, from which on they are one.
const TOGETHER: f64 = 0.5;

/// A band of an axis.
struct Band {
    /// The axis, by its place among those searched.
    axis: usize,
    /// Its terms, the strongest first.
    terms: Vec<usize>,
    omega: f64,
    half_width: f64,
    /// Of a tone that was tracked: its phase, and the peak that it has by what was told of it.
    path: Option<Arc<Path>>,
    told: Option<Peak>,
    wander: Option<Wander>,
}

impl Band {
    /// The residual that has the band in it: that of an axis is without a tone that was tracked.
    fn seen(&self, s: &Searched<'_>) -> Vec<f64> {
        match self.path {
            Some(_) => whitened_by_spectrum(&s.search.panel, &s.state).1,
            None => s.e.clone(),
        }
    }

    /// What it has of a residual that its source is taken out of: of a tone that was tracked nothing is left there.
    fn left(&self, weights: Vec<f64>) -> Vec<f64> {
        match self.path {
            Some(_) => vec![0.0; weights.len()],
            None => weights,
        }
    }
}

/// Coherence and phase of two tones that were tracked with their standard errors, and the likelihood ratio against tones that have
/// nothing in common.
fn of_paths(one: &Path, other: &Path, samples: usize) -> ((f64, f64), (f64, f64), f64) {
    let common = one.goes_with(other, samples);
    let coherence = common.norm().min(MOST);
    let blocks = one.phase.len().min(other.phase.len()) as f64;
    let off = 1.0 - coherence * coherence;
    let error = (off / blocks).sqrt();
    // Two pitches that wander by themselves stay together for a while by chance.
    let lr = if coherence > TOGETHER {
        -blocks * off.ln()
    } else {
        0.0
    };
    ((coherence, error), (common.arg(), error), lr)
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
        let first = self.members.first()?;
        let z = one_source::read(
            &read.collect::<Vec<_>>(),
            omega,
            half_width,
            first.band.wander,
        )?;
        let planner = &mut FftPlanner::new();
        let (z, own) = (
            transformed(&z, planner),
            transformed(&first.band.seen(s), planner),
        );
        let g = s.state.noise.through(frequencies(s.e.len()));
        let each = z[1..].iter().zip(&own[1..]).zip(g);
        let (mut product, mut square) = (Complex::<f64>::default(), 0.0);
        for ((z, e), g) in each {
            let of_noise = s.state.solution.white * g;
            // The skirts of the density that stands for a tone are none of a tone that was tracked.
            let weight = first.band.path.as_ref().map_or(of_noise.recip(), |_| 1.0);
            product += weight * z.conj() * e * of_noise.sqrt();
            square += weight * z.norm_sqr();
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
        let told = told(t, s.state.solution.white);
        let peak = told.or_else(|| t.peak())?;
        let number = t.cluster.map(|c| c.number);
        let of_it = |o: &Term| number.is_some() && o.cluster.map(|c| c.number) == number;
        let others = s.state.terms.iter().enumerate();
        let others = others.filter(|(k, o)| *k != i && of_it(o)).map(|(k, _)| k);
        Some(Band {
            axis,
            terms: std::iter::once(i).chain(others).collect(),
            omega: peak.omega,
            half_width: peak.half_width,
            path: t.path.clone(),
            told,
            wander: wander(t),
        })
    });
    all.collect()
}

/// The peak of a tone that was tracked, of which what was fitted to its spectrum beside other noise tells little.
fn told(t: &Term, white: f64) -> Option<Peak> {
    t.path.as_ref()?;
    let [(amplitude, _), (omega, _), (half_width, _), ..] = t.stated.as_deref()? else {
        return None;
    };
    Some(Peak {
        omega: *omega,
        half_width: *half_width,
        variance: 0.5 * amplitude * amplitude / white,
    })
}

/// How a tone that was tracked wanders.
fn wander(t: &Term) -> Option<Wander> {
    let [_, (omega, _), _, (rms, _), (time, _)] = t.stated.as_deref()? else {
        return None;
    };
    Some(Wander {
        omega: *omega,
        rms: *rms,
        time: *time,
    })
}

/// Angular frequencies of the transform of so many samples, without 0 and the highest.
fn frequencies(samples: usize) -> impl Iterator<Item = f64> {
    let step = std::f64::consts::TAU / samples as f64;
    (1..samples.div_ceil(2)).map(move |k| step * k as f64)
}

/// The residual of an axis with a band in it, transformed and of variance 1 at each frequency, and the part of its standard deviation that
/// the band makes.
fn unit(
    s: &Searched<'_>,
    band: &Band,
    planner: &mut FftPlanner<f64>,
) -> (Vec<Complex<f64>>, Vec<f64>) {
    let omega: Vec<f64> = frequencies(s.e.len()).collect();
    let by = s.state.noise.through(omega.iter().copied());
    let at = model::effect::Frequencies::at(omega);
    let (mut own, mut all) = (vec![0.0; by.len()], by.clone());
    for (k, i) in band.terms.iter().enumerate() {
        let Form::Covariance(process, theta) = &s.state.terms[*i].form else {
            continue;
        };
        let fitted = process.density(theta, &at);
        let told = band.told.filter(|_| k == 0).and_then(|p| process.about(&p));
        let told = told.map(|(process, theta)| process.density(&theta, &at));
        let each = own.iter_mut().zip(&mut all).zip(fitted).enumerate();
        for (k, ((own, all), fitted)) in each {
            let density = told.as_ref().map_or(fitted, |d| d[k]);
            *own += density;
            *all += density - fitted;
        }
    }
    let mut values = transformed(&band.seen(s), planner);
    for ((v, by), all) in values[1..].iter_mut().zip(&by).zip(&all) {
        *v *= (by / all).sqrt();
    }
    let weights = own.iter().zip(all).map(|(o, g)| (o / g).sqrt()).collect();
    (values, weights)
}

/// A residual transformed, of variance 1 at each frequency.
fn transformed(e: &[f64], planner: &mut FftPlanner<f64>) -> Vec<Complex<f64>> {
    let scale = (e.len() as f64).sqrt().recip();
    let mut z: Vec<_> = e.iter().map(|v| Complex::new(v * scale, 0.0)).collect();
    planner.plan_fft_forward(z.len()).process(&mut z);
    z
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
        let (own, of_first) = unit(&searched[first.axis], &first, &mut planner);
        let mut others: Vec<Member> = vec![];
        while let Some(k) = (0..left.len())
            .find(|k| near(&left[*k]) && others.iter().all(|m| m.band.axis != left[*k].axis))
        {
            let band = left.remove(k);
            let s = &searched[band.axis];
            let (there, weights) = unit(s, &band, &mut planner);
            let (coherence, phase, lr) = match (&first.path, &band.path) {
                (Some(one), Some(other)) => of_paths(one, other, s.e.len()),
                _ => Pair::new(&own, &there, &of_first, &weights).estimate(),
            };
            if is_one(coherence.0, lr) {
                others.push(Member {
                    weights: band.left(weights),
                    band,
                    coherence,
                    phase,
                    lr,
                });
            }
        }
        let s = &searched[first.axis];
        let accelerations = accelerations(s, &first, &own, &of_first, &mut planner);
        if !others.is_empty() || !accelerations.is_empty() {
            let first = Member {
                weights: first.left(of_first),
                band: first,
                coherence: (1.0, 0.0),
                phase: (0.0, 0.0),
                lr: 0.0,
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

/// Whether a finding of several channels is one source that these feel.
pub(crate) fn is_shared(f: &Finding) -> bool {
    let mut all = f.per_channel.values().flat_map(one_source::others);
    let of_rotor = f.per_channel.values().filter(|p| is_of_rotor(p));
    all.any(|(of, _)| f.channels.iter().any(|c| c == of)) || of_rotor.count() > 1
}

/// Whether a finding is an oscillation that this channel reads too.
pub(crate) fn is_read_by(f: &Finding, channel: &str) -> bool {
    let mut each = f.per_channel.values().chain([&f.parameters]);
    each.any(|p| one_source::others(p).any(|(of, _)| of == channel))
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
        // What two tones of a rotor have in common is the rotor, where no accelerometer reads it.
        let by_rotor = |m: &&Member| {
            let term = |m: &Member| {
                searched[m.band.axis]
                    .state
                    .terms
                    .get(*m.band.terms.first()?)
            };
            let pair = term(first).zip(term(m));
            source.accelerations.is_empty() && pair.is_some_and(|(a, b)| a.turns_with(b))
        };
        let felt = others.iter().filter(|m| !by_rotor(m));
        let felt = felt.map(|m| (m, name, m.coherence, m.phase, m.lr));
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
