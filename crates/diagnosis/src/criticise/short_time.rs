//! Short-time spectra of what a model leaves, against what else was recorded.
//!
//! White noise, a random walk and one stationary process come near the mean spectrum of almost anything, and their
//! whitened residual is as flat as that of true noise. But noise knows nothing of the motor or the temperature. Neither its
//! colour nor its size in any band follows them, it leans to neither side by them, and no ridge runs through its spectra at a
//! pitch in proportion to a speed. That holds whatever process the model took for the effect.

mod spectra;

use std::f64::consts::PI;

use model::effect::{Signal, View};
use model::record::Quantity;

use crate::criticise::mixing::mixing;
use crate::features::{LEAST_COMMAND, LEAST_SUPPLY, LEAST_TEMPERATURE, lagged};
use crate::fit::channel::Form;
use crate::fit::likelihood::{Dct, Noise};
use crate::result::Check;
use crate::search::searched::Searched;
use crate::test_level;
use crate::test_level::{CheckId, MOST, Outcome, omnibus_level};
use numerics::tails::{chi_tail, errors_of_sum, normal_tail};
use numerics::wide;
use spectra::{Spectra, mean};

/// Lengths of the windows, s: what a motor holds a speed for, and the time in which a slow pitch comes round.
const WINDOWS_S: [f64; 2] = [3.2, 12.8];
/// Fewest samples of a window, and fewest windows.
const LEAST_WINDOW: usize = 16;
const LEAST_WINDOWS: usize = 24;
/// Times for which a change of the command is remembered, s.
const FADES_S: [f64; 2] = [1.0, 4.0];
/// Times by which the speed of a motor is behind its command, s.
const LAGS_S: [f64; 3] = [0.0, 0.7, 3.0];
/// Highest pitch at full speed, over half the sample rate: beyond it pitches fold into the band.
const FOLDS: usize = 4;
/// Samples over which residuals are summed before they are asked whether they lean: what slips or jerks lasts some.
const SUMS: [usize; 5] = [1, 2, 4, 8, 16];
/// Widest step of the readings that hides in their noise, standard deviations: the third moment of a rounded normal value
/// swings with its level by (2 pi / step)^3 exp(-2 (pi / step)^2), which is 1e-6 here.
const WIDEST_STEP: f64 = 1.0;
/// Half the width of a ridge, coefficients.
const BESIDE: usize = 1;

/// Something recorded.
struct Course {
    /// Name of its channel.
    channel: String,
    what: String,
    values: Vec<f64>,
}

/// Lengths of windows that a record of so many samples allows, samples.
fn lengths(samples: usize, rate_hz: f64) -> Vec<usize> {
    let even = |s: f64| ((s * rate_hz).max(LEAST_WINDOW as f64) as usize).next_power_of_two();
    let mut all: Vec<usize> = WINDOWS_S.iter().map(|s| even(*s)).collect();
    all.dedup();
    all.retain(|l| samples / l >= LEAST_WINDOWS);
    all
}

fn changes(values: &[f64]) -> Vec<f64> {
    let first = values.first().copied().unwrap_or(0.0);
    let before = std::iter::once(first).chain(values.iter().copied());
    values
        .iter()
        .zip(before)
        .map(|(v, b)| (v - b).abs())
        .collect()
}

/// The motor command of a record, where it moves.
fn motor<'a>(view: &'a View<'_>) -> Option<&'a Signal> {
    let motor = view.signal(Quantity::Pwm);
    motor.filter(|s| s.range() >= LEAST_COMMAND)
}

/// What noise may be held against, by sample.
fn courses(view: &View<'_>, samples: usize) -> Vec<Course> {
    let mut all = vec![];
    let mut add = |s: &Signal, what: String, values: Vec<f64>| {
        all.push(Course {
            channel: s.name.clone(),
            what,
            values,
        });
    };
    if let Some(m) = motor(view) {
        let (v, name) = (&m.smooth[..samples], &m.name);
        let of = |f: &dyn Fn(f64) -> f64| v.iter().map(|v| f(*v)).collect::<Vec<f64>>();
        let on = |v: f64| v.abs() >= 1.0;
        add(m, name.clone(), v.to_vec());
        add(m, format!("the size of {name}"), of(&f64::abs));
        let runs = of(&|v| f64::from(u8::from(on(v))));
        add(m, format!("whether {name} is on"), runs);
        let sense = of(&|v| if on(v) { v.signum() } else { 0.0 });
        add(m, format!("the sense of {name}"), sense);
        for tau in FADES_S {
            add(
                m,
                format!("changes of {name} within {tau} s"),
                lagged(&changes(v), tau * view.rate_hz),
            );
        }
    }
    let slow = [
        (Quantity::Temp, LEAST_TEMPERATURE),
        (Quantity::Supply, LEAST_SUPPLY),
    ];
    for (quantity, least) in slow {
        let signal = view.signal(quantity).filter(|s| s.range() >= least);
        if let Some(s) = signal {
            add(s, s.name.clone(), s.smooth[..samples].to_vec());
        }
    }
    for a in view.all(Quantity::Acc) {
        let values = &a.values[..samples];
        let middle = mean(values);
        let square = values.iter().map(|v| (v - middle).powi(2)).collect();
        add(a, format!("the vibration of {}", a.name), square);
    }
    all
}

/// A series less its mean; none where it does not move.
fn centred(values: &[f64]) -> Option<Vec<f64>> {
    let middle = mean(values);
    let centred: Vec<f64> = values.iter().map(|v| v - middle).collect();
    let moves = centred.iter().any(|v| v.abs() > 1e-9 * middle.abs());
    moves.then_some(centred)
}

/// Share of the energy in each band that a law of the variance does not change: that of the processes and of the walk.
fn steady(s: &Searched<'_>, spectra: &Spectra) -> Vec<f64> {
    let bins = &s.search.panel.bins;
    let (mut all, mut white) = (s.state.noise.clone(), Noise::new(f64::NEG_INFINITY));
    // What is known sample by sample was taken off.
    let covariances = s.state.terms.iter().filter_map(|t| match &t.form {
        Form::Covariance(c, _) => Some((t.stated.is_some(), c.filters_white())),
        _ => None,
    });
    let kinds: Vec<(bool, bool)> = covariances.collect();
    let kept = |keep: &dyn Fn(&(bool, bool)) -> bool| {
        let pairs = s.state.noise.terms.iter().zip(&kinds);
        let kept = pairs.filter(|(_, k)| keep(k)).map(|(t, _)| t.clone());
        kept.collect::<Vec<_>>()
    };
    white.terms = kept(&|k| k.1);
    all.terms = kept(&|k| !k.0);
    let (all, white) = (all.over(bins), white.over(bins));
    let of_band = |(from, to): (usize, usize)| {
        let scale = spectra.length as f64 / PI;
        let (mut count, mut share) = (0.0, 0.0);
        for (((a, w), m), omega) in all
            .iter()
            .zip(&white)
            .zip(bins.counts())
            .zip(&bins.at.omega)
        {
            if (from as f64..to as f64).contains(&(omega * scale)) {
                count += m;
                share += m * (1.0 - w / a);
            }
        }
        share / f64::max(count, 1.0)
    };
    spectra.bands().into_iter().map(of_band).collect()
}

/// Standard scores of the energies in a band, by window, over what is `told` of them: the cube root of a chi-square over its
/// degrees is normal (Wilson and Hilferty, 1931).
fn scores(spectra: &Spectra, (from, to): (usize, usize), told: impl Fn(usize) -> f64) -> Vec<f64> {
    let degrees = (to - from) as f64;
    let sum = |w: &[f64]| w[from..to].iter().sum::<f64>() / degrees;
    let energies = spectra.of.iter().enumerate().map(|(i, w)| sum(w) / told(i));
    let energies: Vec<f64> = energies.collect();
    let level = mean(&energies).max(f64::MIN_POSITIVE);
    let off = 2.0 / (9.0 * degrees);
    let score = |e: &f64| ((e / level).cbrt() - 1.0 + off) / off.sqrt();
    energies.iter().map(score).collect()
}

/// Standard scores of the energies in each band, by window, about their mean: over what a `law` of the variance that all but the
/// `steady` share of the band follows tells of them.
fn scores_about_mean(spectra: &Spectra, law: Option<&[f64]>, steady: &[f64]) -> Vec<Vec<f64>> {
    let law = law.map(|law| spectra.means(law));
    let bands = spectra.bands().into_iter().zip(steady);
    bands
        .map(|(band, steady)| {
            let told = |i: usize| law.as_ref().map_or(1.0, |l| steady + (1.0 - steady) * l[i]);
            let mut y = scores(spectra, band, told);
            let middle = mean(&y);
            y.iter_mut().for_each(|v| *v -= middle);
            // What is more uneven than noise has larger errors.
            let spread = mean(&y.iter().map(|v| v * v).collect::<Vec<f64>>()).sqrt();
            y.iter_mut().for_each(|v| *v /= spread.max(1.0));
            y
        })
        .collect()
}

/// Whether the energy in some bands follows something that was recorded, beyond a `law` of the variance that all but the
/// `steady` share of each band follows.
fn colour(
    rate_hz: f64,
    law: Option<&[f64]>,
    courses: &[Course],
    all: &[Spectra],
    steady: &[Vec<f64>],
) -> Outcome {
    let mut worst: Option<(f64, f64, Option<&Course>, String)> = None;
    let mut asked = 0usize;
    for (spectra, steady) in all.iter().zip(steady) {
        let bands = spectra.bands();
        let scores = scores_about_mean(spectra, law, steady);
        for course in courses {
            let Some(values) = centred(&spectra.means(&course.values)) else {
                continue;
            };
            let length = values.iter().map(|v| v * v).sum::<f64>().sqrt();
            let along = |y: &Vec<f64>| -> f64 {
                y.iter().zip(&values).map(|(y, x)| y * x).sum::<f64>() / length
            };
            let z: Vec<f64> = scores.iter().map(along).collect();
            let statistic = z.iter().map(|z| z * z).sum::<f64>();
            let p = chi_tail(statistic, z.len() as f64);
            asked += 1;
            if worst.as_ref().is_none_or(|w| p < w.1) {
                let most = (0..z.len()).max_by(|a, b| z[*a].abs().total_cmp(&z[*b].abs()));
                let most = most.unwrap_or(0);
                let hz = |j: usize| j as f64 / spectra.length as f64 * rate_hz / 2.0;
                let what = format!(
                    "energy from {:.2} to {:.2} Hz follows {} by {:+.1} standard errors",
                    hz(bands[most].0),
                    hz(bands[most].1),
                    course.what,
                    z[most]
                );
                worst = Some((statistic, p, Some(course), what));
            }
        }
    }
    let nothing = (0.0, 1.0, None, "nothing recorded moves".into());
    let (statistic, p, course, what) = worst.unwrap_or(nothing);
    Outcome {
        id: CheckId::ColourFollows,
        about: course.iter().map(|c| c.channel.clone()).collect(),
        statistic,
        p_value: (p * asked.max(1) as f64).min(1.0),
        what: format!("short-time spectra of the whitened residual: {what}"),
    }
}

wide! {
    /// Where pitches of 0, 1, 2 and so on coefficients at full speed lie at a `speed` of `top` once they are folded into the
    /// band.
    fn folded[](speed: f64, top: f64, length: usize, at: &mut [i32]) -> () = folded_of
}

#[inline(always)]
fn folded_of(speed: f64, top: f64, length: usize, at: &mut [i32]) {
    let twice = (2 * length) as f64;
    let over = twice.recip();
    for (highest, at) in (0i32..).zip(at) {
        let pitch = f64::from(highest) * speed / top;
        let around = pitch - f64::from((pitch * over) as i32) * twice;
        *at = ((around.min(twice - around) + 0.5) as i32).max(0);
    }
}

/// A ridge: energy of its coefficients, their number, the pitch at full speed, Hz, and how late it is, s.
#[derive(Clone, Copy, Default)]
struct Ridge {
    energy: f64,
    count: f64,
    hz: f64,
    lag: f64,
}

impl Ridge {
    /// Standard errors beyond the energy of noise.
    fn score(self) -> f64 {
        (self.energy - self.count) / f64::max(2.0 * self.count, 1.0).sqrt()
    }
}

/// Energy and number of the coefficients of a window about each; none about the first two, and beyond the band.
fn about_each(window: &[f64]) -> Vec<(f64, f64)> {
    let length = window.len();
    let ridge = |at: usize| {
        let (from, to) = (at.saturating_sub(BESIDE), (at + BESIDE + 1).min(length));
        if from == 0 || from >= to {
            return (0.0, 0.0);
        }
        (window[from..to].iter().sum(), (to - from) as f64)
    };
    (0..=length).map(ridge).collect()
}

/// Whether a ridge runs through the spectra at a pitch in proportion to the speed of the motor (order tracking).
fn order(view: &View<'_>, e: &[f64], all: &[Spectra]) -> Option<Outcome> {
    let motor = motor(view)?;
    let size: Vec<f64> = motor.smooth[..e.len()].iter().map(|v| v.abs()).collect();
    let top = size.iter().copied().fold(0.0, f64::max);
    let mut worst = Ridge::default();
    let mut asked = 0usize;
    for spectra in all {
        let length = spectra.length;
        let evened = spectra.evened();
        let evened: Vec<Vec<(f64, f64)>> = evened.iter().map(|w| about_each(w)).collect();
        for lag in LAGS_S {
            let speeds = spectra.means(&lagged(&size, lag * view.rate_hz));
            let mut ridges: Vec<(f64, f64)> = vec![(0.0, 0.0); FOLDS * length];
            let mut places = vec![0; ridges.len()];
            // Window by window: each is at hand for all pitches.
            for (w, speed) in evened.iter().zip(&speeds) {
                folded(*speed, top, length, &mut places);
                for (ridge, at) in ridges.iter_mut().zip(&places).skip(2) {
                    let (energy, count) = w[*at as usize];
                    *ridge = (ridge.0 + energy, ridge.1 + count);
                }
            }
            for (highest, (energy, count)) in ridges.into_iter().enumerate().skip(2) {
                let ridge = Ridge {
                    energy,
                    count,
                    hz: highest as f64 / length as f64 * view.rate_hz / 2.0,
                    lag,
                };
                asked += 1;
                if ridge.score() > worst.score() {
                    worst = ridge;
                }
            }
        }
    }
    let chance = if worst.count > 0.0 {
        chi_tail(worst.energy, worst.count)
    } else {
        1.0
    };
    let energy = worst.energy / worst.count.max(1.0);
    Some(Outcome {
        id: CheckId::Order,
        about: vec![motor.name.clone()],
        statistic: energy,
        p_value: (chance * asked.max(1) as f64).min(1.0),
        what: format!(
            "pitches in proportion to the size of {}, some {} s late: {energy:.2} of the mean energy along that of {:.2} Hz at its highest",
            motor.name, worst.lag, worst.hz
        ),
    })
}

/// Whether what is left leans by what was recorded: its third moment, of sums over some samples. Noise that is even about
/// its level, of whatever size, leans to no side; what winds up and slips, or is pushed, does by the sense of the motor.
fn leaning(e: &[f64], courses: &[Course]) -> Outcome {
    let mut worst = (1.0, 0.0, None, String::new());
    let mut asked = 0usize;
    for m in SUMS
        .into_iter()
        .filter(|m| e.len() / m >= 8 * LEAST_WINDOWS)
    {
        let blocks = |values: &[f64]| values.chunks_exact(m).map(mean).collect::<Vec<f64>>();
        let sums = blocks(e);
        let spread = mean(&sums.iter().map(|v| v * v).collect::<Vec<f64>>()).sqrt();
        let third: Vec<f64> = sums
            .iter()
            .map(|v| (v / spread).powi(3) - 3.0 * v / spread)
            .collect();
        for course in courses {
            let Some(values) = centred(&blocks(&course.values)) else {
                continue;
            };
            asked += 1;
            let z = errors_of_sum(third.iter().zip(&values).map(|(h, x)| h * x));
            let p = normal_tail(z);
            if p < worst.0 {
                let what = format!(
                    "of {m} samples follows {} by {z:+.1} standard errors",
                    course.what
                );
                worst = (p, z, Some(course), what);
            }
        }
    }
    Outcome {
        id: CheckId::Leaning,
        about: worst.2.iter().map(|c| c.channel.clone()).collect(),
        statistic: worst.1,
        p_value: (worst.0 * asked.max(1) as f64).min(1.0),
        what: format!(
            "third moment of the whitened residual: that of sums {}",
            worst.3
        ),
    }
}

/// All of a channel.
fn outcomes(s: &Searched<'_>) -> Vec<Outcome> {
    let view = &s.search.view;
    if s.target.moving || view.sways() {
        return vec![];
    }
    // Divided by the law of the variance, where there is one.
    let mut e = s.e[..s.e.len().min(MOST)].to_vec();
    let of = |e: &[f64]| -> Vec<Spectra> {
        let lengths = lengths(e.len(), view.rate_hz);
        lengths.into_iter().map(|l| Spectra::new(e, l)).collect()
    };
    let courses = courses(view, e.len());
    let mut spectra = of(&e);
    let mut all: Vec<Outcome> = order(view, &e, &spectra).into_iter().collect();
    all.extend(mixing(view, &e));
    // What is rounded leans by where its level lies between the codes.
    if s.step() < WIDEST_STEP {
        all.push(leaning(&e, &courses));
    }
    // The law of the variance holds for the white noise alone.
    let law = s.variance.product();
    if law.is_some() {
        s.variance.undo(&mut e);
        spectra = of(&e);
    }
    let steady: Vec<Vec<f64>> = spectra.iter().map(|x| steady(s, x)).collect();
    all.push(colour(view.rate_hz, law, &courses, &spectra, &steady));
    all
}

/// The checks of a channel: omnibus ones, and claims of a process or a law of the variance where one was found.
pub(crate) fn checks(s: &Searched<'_>) -> impl Iterator<Item = Check> {
    let process = s
        .state
        .terms
        .iter()
        .any(|t| matches!(t.form, Form::Covariance(..)));
    let threshold = if process || !s.variance.is_empty() {
        test_level::CLAIM_LEVEL
    } else {
        omnibus_level()
    };
    let channel = s.target.name.clone();
    outcomes(s).into_iter().map(move |o| {
        let fails = o.p_value < threshold;
        Check {
            id: o.id.into(),
            about: o.about,
            channel: channel.clone(),
            statistic: o.statistic,
            p_value: Some(o.p_value),
            threshold,
            fails_before: fails,
            fails_after: fails,
            what: o.what,
        }
    })
}

#[cfg(test)]
mod tests;
