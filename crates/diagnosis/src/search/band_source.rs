//! Whether the pitch or the size of a band follows what was recorded.
//!
//! A mode that noise drives and a tone whose pitch wanders know nothing of temperature, supply and command. The band alone, on
//! the half line of frequencies, is a complex envelope z: |z|^2 is its size, and the imaginary part of z(t+1) z*(t), turned back
//! by the mean pitch, its pitch. Both are regressed on each recorded course, on its square, and for a command on what rings
//! after each change of it and on where it changes; so are the squared changes of z, as a command that shifts its phase makes it jump.
//! The scatter of a coefficient is that of the residual at the frequencies where the course moves.
//!
//! What drives a mode may be recorded, too, or make a period that wanders: then z is coherent with the envelope of that at the same
//! place, whatever comes between makes of its phase.

use std::f64::consts::PI;
use std::ops::Range;

use model::effect::Signal;
use model::record::Quantity;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::envelope::law::{changes, pitch};
use super::envelope::{Band, REACH, envelope_of, kept};
use crate::fit::threshold;
use crate::ingest::motion::drives;
use crate::test_level::{CheckId, Outcome};
use numerics::column::dot;
use numerics::tails;

/// Frequencies either side over which the energy of a residual is averaged.
const SMOOTHED: usize = 6;
/// Degrees of freedom of such a mean: two for each frequency.
const DEGREES: f64 = 2.0 * (2.0 * SMOOTHED as f64 + 1.0);
/// Least part of the energy of pitch or size that has to follow: it is otherwise off by a seventh at most.
pub(crate) const FOLLOWED: f64 = 0.02;
/// Half widths off a band up to which what lies beside it is looked at.
const BESIDE: f64 = 3.0 * REACH;
/// Standard errors by which an accelerometer reads more where a band is than beside it, where the band knows of it: one in a thousand.
const MORE: f64 = 3.0;
/// Fewest values of the envelope.
const LEAST: usize = 64;

/// Means of a course in `cells` parts of the record.
pub(super) fn in_cells(values: &[f64], cells: usize) -> Vec<f64> {
    let n = values.len();
    let part = |i: usize| {
        let (from, to) = (i * n / cells, ((i + 1) * n / cells).max(i * n / cells + 1));
        values[from..to.min(n)].iter().sum::<f64>() / (to.min(n) - from).max(1) as f64
    };
    (0..cells).map(part).collect()
}

/// Without its mean and what others have of it.
pub(super) fn beyond(mut own: Vec<f64>, others: &[&[f64]]) -> Vec<f64> {
    let mean = own.iter().sum::<f64>() / own.len() as f64;
    own.iter_mut().for_each(|v| *v -= mean);
    for o in others {
        let share = dot(&own, o) / dot(o, o).max(f64::MIN_POSITIVE);
        own.iter_mut().zip(*o).for_each(|(v, o)| *v -= share * o);
    }
    own
}

/// What rings for a while after each change of a course, by the part of it that is left in the next cell.
fn rung(course: &[f64], keep: f64) -> Vec<f64> {
    let mut level = 0.0;
    let changes = course.windows(2).map(|w| (w[1] - w[0]).abs());
    std::iter::once(0.0)
        .chain(changes)
        .map(|change| {
            level = keep * level + change;
            level
        })
        .collect()
}

/// Where a course changes, in cells of an envelope: a shift of phase shows in the differences to either neighbour, however large.
fn switched(values: &[f64], cells: usize) -> Vec<f64> {
    let changes = values.windows(2).map(|w| f64::from(u8::from(w[1] != w[0])));
    let in_cells = in_cells(&changes.chain([0.0]).collect::<Vec<_>>(), cells);
    let near = |i: usize| &in_cells[i.saturating_sub(1)..(i + 2).min(cells)];
    let any = |i| near(i).iter().any(|c| *c > 0.0);
    (0..cells).map(|i| f64::from(u8::from(any(i)))).collect()
}

/// Energies of a series by frequency.
fn energies(series: &[f64], planner: &mut FftPlanner<f64>) -> Vec<f64> {
    let mut z: Vec<Complex<f64>> = series.iter().map(|v| Complex::new(*v, 0.0)).collect();
    planner.plan_fft_forward(z.len()).process(&mut z);
    z.iter().map(Complex::norm_sqr).collect()
}

/// Chance that a series follows a course as well, and the part of its energy that does.
pub(super) fn chance(
    series: &[f64],
    course: &[f64],
    planner: &mut FftPlanner<f64>,
) -> Option<(f64, f64)> {
    let (all, own) = (dot(series, series), dot(course, course));
    if all <= 0.0 || own <= 1e-12 * all.min(1.0) {
        return None;
    }
    let slope = dot(series, course) / own;
    let residual: Vec<f64> = series
        .iter()
        .zip(course)
        .map(|(s, c)| s - slope * c)
        .collect();
    let (of_course, of_rest) = (energies(course, planner), energies(&residual, planner));
    let n = of_rest.len();
    // Without frequency 0, which both lack.
    let about = |k: usize| {
        let near = (1..=2 * SMOOTHED + 1).map(|j| of_rest[((k + n + j - SMOOTHED - 1) % n).max(1)]);
        near.sum::<f64>() / (2 * SMOOTHED + 1) as f64
    };
    let variance = (1..n).map(|k| of_course[k] * about(k)).sum::<f64>() / (n * n) as f64;
    let t = slope * own / variance.sqrt();
    let law = StudentsT::new(0.0, 1.0, DEGREES).ok()?;
    Some((2.0 * law.sf(t.abs()), slope * slope * own / all))
}

/// A peak of a channel where a band is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Standing {
    /// Density at its top over what is beside it, and that.
    pub height: f64,
    pub level: f64,
}

impl Standing {
    /// The part of the energy about the middle that is more than beside it, and its standard error where there is no more; energies
    /// are squares of normal values.
    fn share(energies: impl Iterator<Item = (f64, f64)>) -> (f64, f64) {
        let (mut near, mut beside) = ([0.0; 2], [0.0; 2]);
        for (off, energy) in energies.filter(|(off, _)| off.abs() <= BESIDE) {
            let sums = if off.abs() <= REACH {
                &mut near
            } else {
                &mut beside
            };
            *sums = [sums[0] + energy, sums[1] + 1.0];
        }
        let share = 1.0 - beside[0] / beside[1] * near[1] / near[0];
        (share, (2.0 / near[1] + 2.0 / beside[1]).sqrt())
    }

    /// Height over the top, some half widths off it.
    pub(crate) fn shape(off: f64) -> f64 {
        (1.0 + off * off).recip()
    }

    /// Of energies and how many half widths they lie off the middle, each of which scatters by `spread` times its mean; none where
    /// no peak stands out.
    pub(crate) fn of(energies: impl Iterator<Item = (f64, f64)>, spread: f64) -> Option<Self> {
        // Energies are a height times the shape and a level: by their sums about the middle and beside it.
        let (mut near, mut beside) = ([0.0; 3], [0.0; 3]);
        for (off, energy) in energies.filter(|(off, _)| off.abs() <= BESIDE) {
            let sums = if off.abs() <= REACH {
                &mut near
            } else {
                &mut beside
            };
            let each = sums.iter_mut().zip([energy, Self::shape(off), 1.0]);
            each.for_each(|(sum, v)| *sum += v);
        }
        // What of each sum about the middle is more than that beside it.
        let share = near[2] / beside[2];
        let more = |k: usize| near[k] - share * beside[k];
        let height = more(0) / more(1);
        // A tone has not the skirts of its shape: those would be more than there is.
        let skirts = (beside[0] - height * beside[1]) / beside[2];
        let level = if skirts > 0.0 {
            skirts
        } else {
            beside[0] / beside[2]
        };
        let error = spread * level * (near[2] * (1.0 + share)).sqrt() / more(1);
        let z = height / error;
        let stands = level > 0.0 && z > 0.0 && tails::normal_tail(z) < threshold::false_alarm();
        stands.then_some(Self { height, level })
    }
}

/// How a band moves.
pub(super) struct Moves {
    /// The first of its coefficients and the end.
    pub(super) places: Range<usize>,
    /// Half its width, coefficients.
    pub(super) half: f64,
    pub(super) envelope: Vec<Complex<f64>>,
    /// Its pitch, its size and how much it changes in time, without their means.
    pub(super) pitch: Vec<f64>,
    pub(super) size: Vec<f64>,
    changes: Vec<f64>,
}

impl Moves {
    /// Of a band whose first coefficient is at `from`; `None` where it is too short.
    pub(super) fn of(band: &Band, from: usize) -> Option<Self> {
        let mut planner = FftPlanner::new();
        let z = envelope_of(&kept(&band.coefficients, &band.density), &mut planner);
        if z.len() < LEAST {
            return None;
        }
        let top = band.density.iter().copied().fold(0.0, f64::max);
        let half = band.density.iter().sum::<f64>() / (2.0 * REACH.atan() * top);
        Some(Self {
            places: from..from + band.density.len(),
            half,
            pitch: beyond(pitch(&z), &[]),
            size: beyond(z.iter().map(Complex::norm_sqr).collect(), &[]),
            changes: beyond(changes(&z), &[]),
            envelope: z,
        })
    }

    /// Its middle, coefficients.
    pub(super) fn middle(&self) -> f64 {
        0.5 * (self.places.start + self.places.end) as f64
    }
}

/// Chance that the coefficients of two channels at one place are as coherent, and the part of the energy that is.
pub(crate) fn coherence(own: &[f64], there: &[f64]) -> (f64, f64) {
    let planner = &mut FftPlanner::new();
    let own = envelope_of(own, planner);
    let (p, part, _) = coherent(&own, &envelope_of(there, planner), planner);
    (p, part)
}

/// The same of two envelopes, and at how many frequencies they have their energy. With phases at random (Theiler et al., 1992) each frequency adds its own energy to that of the sum of
/// all, which is then exponential.
fn coherent(
    own: &[Complex<f64>],
    there: &[Complex<f64>],
    planner: &mut FftPlanner<f64>,
) -> (f64, f64, f64) {
    let fft = planner.plan_fft_forward(own.len());
    let [own, there] = [own, there].map(|z| {
        let mut spectrum = z.to_vec();
        fft.process(&mut spectrum);
        spectrum
    });
    let products = own.iter().zip(&there).map(|(a, b)| a * b.conj());
    let (sum, at_random) = products.fold(
        (Complex::new(0.0, 0.0), 0.0),
        |(sum, energy), p: Complex<f64>| (sum + p, energy + p.norm_sqr()),
    );
    let energy = |z: &[Complex<f64>]| z.iter().map(Complex::norm_sqr).sum::<f64>();
    let both = energy(&own) * energy(&there);
    let part = sum.norm_sqr() / both.max(f64::MIN_POSITIVE);
    (
        (-sum.norm_sqr() / at_random.max(f64::MIN_POSITIVE)).exp(),
        part,
        both / at_random.max(f64::MIN_POSITIVE),
    )
}

/// Whether what shakes the band shakes an accelerometer, of which these are the coefficients: it then reads a peak of its own there. What
/// follows an accelerometer has a `part` of its energy, and no peak is needed for that; of a peak that is too small to stand out, what is
/// more than beside it is nearer to that part than to none.
fn shakes(own: &Moves, coefficients: &[f64], part: f64) -> bool {
    let energies = coefficients.iter().enumerate().skip(1);
    let energies = energies.map(|(k, c)| ((k as f64 - own.middle()) / own.half, c * c));
    let (share, error) = Standing::share(energies.clone());
    Standing::of(energies, std::f64::consts::SQRT_2).is_some()
        || (part > FOLLOWED && share > (0.5 * part).max(MORE * error))
}

/// Whether accelerometers read what a band is: they are coherent with it, and have a peak there.
pub(super) fn is_read(own: &Moves, signals: &[Signal], felt: &[(&str, Vec<f64>)]) -> bool {
    let planner = &mut FftPlanner::new();
    felt.iter().any(|(name, coefficients)| {
        let mut named = signals.iter().filter(|s| s.name == *name);
        if !named.any(|s| s.quantity == Quantity::Acc) {
            return false;
        }
        let there = envelope_of(&coefficients[own.places.clone()], planner);
        let (p, part, count) = coherent(&own.envelope, &there, planner);
        // Of a few frequencies that nearly agree: phases at random do so in fewer than this part, each but the first by one coordinate.
        let agree = (1.0 - part).max(0.0).powf(0.5 * (count - 1.0));
        p.min(agree) < CheckId::BandSource.level()
            && part > FOLLOWED
            && shakes(own, coefficients, part)
    })
}

/// The claim of a band that is told as `named`: that its pitch and its size follow nothing that was recorded, and that it is none
/// of what was `felt`, of channels with their coefficients.
pub(super) fn claim(
    own: &Moves,
    signals: &[Signal],
    felt: &[(&str, Vec<f64>)],
    named: &str,
) -> Option<Outcome> {
    let cells = own.size.len();
    // What is left of a ring in the next cell.
    let keep = (-2.0 * PI * own.half / cells as f64).exp();
    let mut all: Vec<(&str, Vec<f64>)> = vec![];
    for s in signals.iter().filter(|s| drives(s.quantity)) {
        let plain = in_cells(&s.smooth, cells);
        let first = beyond(plain.clone(), &[]);
        let square = beyond(first.iter().map(|v| v * v).collect(), &[&first]);
        all.extend([(s.name.as_str(), first), (&s.name, square)]);
        if s.quantity == Quantity::Pwm {
            all.push((&s.name, beyond(rung(&plain, keep), &[])));
            all.push((&s.name, beyond(switched(&s.values, cells), &[])));
        }
    }
    let planner = &mut FftPlanner::new();
    let mut asked = 0;
    let mut least: Option<(f64, &str, &'static str)> = None;
    for (name, course) in &all {
        let all = [
            ("pitch", &own.pitch),
            ("size", &own.size),
            ("jumps", &own.changes),
        ];
        for (what, series) in all {
            let Some((p, part)) = chance(series, course, planner) else {
                continue;
            };
            asked += 1;
            if part > FOLLOWED && least.as_ref().is_none_or(|l| p < l.0) {
                least = Some((p, name, what));
            }
        }
    }
    for (name, coefficients) in felt {
        let there = envelope_of(&coefficients[own.places.clone()], planner);
        let (p, part, _) = coherent(&own.envelope, &there, planner);
        let mut named = signals.iter().filter(|s| s.name == *name);
        let of_acceleration = named.any(|s| s.quantity == Quantity::Acc);
        if of_acceleration && shakes(own, coefficients, part) {
            continue;
        }
        asked += 1;
        if part > FOLLOWED && least.as_ref().is_none_or(|l| p < l.0) {
            least = Some((p, name, "phase"));
        }
    }
    let (p, name, what) = least?;
    Some(Outcome {
        id: CheckId::BandSource,
        about: vec![],
        statistic: p,
        p_value: (p * f64::from(asked)).min(1.0),
        what: format!("told as {named}: its {what} follows {name}"),
    })
}

#[cfg(test)]
mod tests {
    use rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    fn slow(rng: &mut Xoshiro256PlusPlus, n: usize, tau: f64) -> Vec<f64> {
        let keep = (-1.0 / tau).exp();
        let mut x = 0.0;
        (0..n)
            .map(|_| {
                let e: f64 = StandardNormal.sample(rng);
                x = keep * x + (1.0 - keep * keep).sqrt() * e;
                x
            })
            .collect()
    }

    #[test]
    fn channels_of_one_drive_are_coherent_and_others_as_often_as_their_chance_says() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(31);
        // As even as noise, and as a band is that noise makes.
        let mut draw = |half: f64| -> Vec<f64> {
            let one = |k: i32| {
                let e: f64 = StandardNormal.sample(&mut rng);
                e / (1.0 + (f64::from(k) / half).powi(2)).sqrt()
            };
            (-120..120).map(one).collect()
        };
        for half in [1e9, 20.0, 2.0] {
            let (mut low, mut seen) = (0, 0);
            for _ in 0..400 {
                let (own, other) = (draw(half), draw(1e9));
                low += usize::from(coherence(&own, &other).0 < 0.01);
                let both: Vec<f64> = own.iter().zip(&other).map(|(a, b)| a + 0.5 * b).collect();
                let (p, part) = coherence(&both, &other);
                seen += usize::from(p < 1e-3 && part > FOLLOWED);
            }
            // 4 of 400 are expected at 1 %; of a narrow band fewer, as a few phases make little chance.
            assert!(low <= 12, "{half}: {low}");
            assert!(seen >= 380, "{half}: {seen}");
        }
    }

    #[test]
    fn a_series_follows_a_course_that_it_holds_and_no_other_as_slow_one() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
        let (n, mut low, mut seen) = (600, 0, 0);
        for _ in 0..400 {
            let course = beyond(slow(&mut rng, n, 40.0), &[]);
            let series = beyond(slow(&mut rng, n, 8.0), &[]);
            let (p, _) = chance(&series, &course, &mut FftPlanner::new()).expect("both move");
            low += usize::from(p < 0.01);
            let with: Vec<f64> = series.iter().zip(&course).map(|(s, c)| s + c).collect();
            let (p, part) = chance(&with, &course, &mut FftPlanner::new()).expect("both move");
            seen += usize::from(p < 1e-3 && part > FOLLOWED);
        }
        // 4 of 400 are expected at 1 %.
        assert!(low <= 14, "{low}");
        assert!(seen > 300, "{seen}");
    }
}
