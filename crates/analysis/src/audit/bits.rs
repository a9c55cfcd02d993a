//! Low bits: missing ones, and one that sticks.
//!
//! Missing bits need no noise model. Where all counts are one residue apart by 2^k, every change is a multiple of 2^k;
//! a change of a finer converter is even with a chance below 1/2, however small or large its noise.
//!
//! A bit that sticks moves the share of ones. With the reading normal about what its neighbours predict, L, the square
//! wave s of period P = 2^(b+1) (+1 where bit b is 0) has the mean
//! E s = sum over odd m of 4/(pi m) exp(-2 pi^2 sigma^2 m^2 / P^2) sin(2 pi m (L + 1/2) / P),
//! nearly 0 for the lowest bits and far from it where P exceeds 4 sigma. That shows that the counts are not what they
//! should be; which bit sticks is decided by the likelihood of the counts ([`super::stuck`]), for a high one moves the level
//! and the spread that the share of a lower one is judged by.

use std::f64::consts::PI;

use model::Parameter;

use super::stuck::Tally;
use super::{Audit, Gyro, LEAST_READINGS, tails};
use crate::audit::local::{Levels, Local};
use crate::result::{Alternative, Finding, Unexplained};

/// Most low bits that are looked at.
const BITS: u32 = 8;
/// Share of the readings that have to lie on the coarse grid; the rails may lie beside it.
const ON_GRID: f64 = 0.97;
/// A bit is tested while its weight is below this many sigma: beyond, the level decides it, not the noise.
const WITHIN_SIGMA: f64 = 2.0;
/// Least noise, counts: below it the level decides even the lowest bit.
const LEAST_SIGMA: f64 = 0.9;
/// Coarse grid that the counts lie on.
struct Coarse {
    bits: u32,
    residue: i32,
    changes: u64,
}

fn coarse(counts: &[i32], known: &[bool]) -> Option<Coarse> {
    let mut found = None;
    for bits in 1..=BITS {
        let step = 1 << bits;
        let mut tally = vec![0u64; step as usize];
        let mut all = 0u64;
        for (c, _) in counts.iter().zip(known).filter(|(_, k)| **k) {
            tally[c.rem_euclid(step) as usize] += 1;
            all += 1;
        }
        let (residue, most) = tally
            .iter()
            .enumerate()
            .max_by_key(|(_, t)| **t)
            .map(|(r, t)| (r as i32, *t))?;
        if (most as f64) < ON_GRID * all as f64 {
            break;
        }
        // Pairs that do not share a reading are independent.
        let changes: Vec<bool> = counts
            .chunks_exact(2)
            .zip(known.chunks_exact(2))
            .filter(|(c, k)| k[0] && k[1] && c[0] != c[1])
            .map(|(c, _)| (c[1] - c[0]).rem_euclid(step) == 0)
            .collect();
        let even = changes.iter().filter(|e| **e).count() as u64;
        let trials = changes.len() as u64;
        if (even as f64) < ON_GRID * trials as f64
            || tails::hits_at_least(even, trials, 0.5) > super::FALSE_ALARM
        {
            break;
        }
        found = Some(Coarse {
            bits,
            residue,
            changes: trials,
        });
    }
    found
}

/// Mean of a square wave (+1 in the first half of its period) of normal readings, rounded.
pub(super) struct Square {
    /// 2 pi over the period.
    turn: f64,
    /// Of sin(m turn (level + 1/2)), m = 1, 3, 5, ...
    sizes: Vec<f64>,
}

impl Square {
    pub(super) fn new(sigma: f64, period: f64) -> Self {
        let mut sizes = vec![];
        for j in 0..200 {
            let m = f64::from(2 * j + 1);
            sizes.push(4.0 / (PI * m) * (-2.0 * (PI * sigma * m / period).powi(2)).exp());
            if sizes.last().is_none_or(|s| *s < 1e-9) {
                break;
            }
        }
        Self {
            turn: 2.0 * PI / period,
            sizes,
        }
    }

    /// Under N(`level`, sigma^2).
    pub(super) fn at(&self, level: f64) -> f64 {
        let (sine, cosine) = (self.turn * (level + 0.5)).sin_cos();
        // sin (m + 2)x = 2 cos 2x sin mx - sin (m - 2)x.
        let twice = 2.0 * (1.0 - 2.0 * sine * sine);
        let (mut before, mut now, mut sum) = (-sine, sine, 0.0);
        if self.sizes.len() > 40 {
            // Long sums of the recurrence lose digits.
            let x = sine.atan2(cosine);
            let terms = self.sizes.iter().enumerate();
            sum = terms.map(|(j, s)| s * ((2 * j + 1) as f64 * x).sin()).sum();
        } else {
            for size in &self.sizes {
                sum += size * now;
                (before, now) = (now, twice * now - before);
            }
        }
        sum.clamp(-1.0, 1.0)
    }
}

/// Standard deviation of the readings before they were rounded, far ones left out. A spread between two shares of the
/// readings would be a whole number of counts where the level stands still.
fn unrounded(local: &Local) -> f64 {
    const FAR: f64 = 4.5;
    let limit = FAR * local.sigma.max(1.0);
    let near = local.residual.iter().filter(|r| r.abs() < limit);
    let (sum, count) = near.fold((0.0, 0.0), |(s, n), r| (s + r * r, n + 1.0));
    (sum / f64::max(count, 1.0) - 1.0 / 12.0).max(1e-4).sqrt()
}

/// A bit whose share of ones the noise does not explain.
struct Share {
    bit: u32,
    value: u8,
    z: f64,
}

/// Share of ones of a bit against the expected one.
fn share(ones: f64, levels: &Levels, bit: u32, sigma: f64) -> Option<Share> {
    let square = Square::new(sigma, 2.0 * f64::from(1u32 << bit));
    let (mut expected, mut variance) = (0.0, 0.0);
    for (level, readings) in levels.iter() {
        let p = 0.5 * (1.0 - square.at(level));
        expected += readings * p;
        variance += readings * p * (1.0 - p);
    }
    (variance > 0.0).then(|| Share {
        bit,
        value: u8::from(ones > expected),
        z: (ones - expected) / variance.sqrt(),
    })
}

/// Nats by which a bit that sticks has to describe the counts better than sound ones.
const CLEARLY_STUCK: f64 = 12.0;

/// Share of what any shape or any code of its own gains over sound counts that it has to gain: the level is only known
/// to what its neighbours tell, which a hard edge between codes shows.
const NEARLY_ALL: f64 = 0.95;

/// Half width of the kernel of the smooth density, in sigma: wide against the comb that a low bit makes.
const KERNEL: f64 = 0.5;

/// Nats that the smooth density has to gain over the normal one before the counts are told not to be normal.
const CLEARLY_NOT_NORMAL: f64 = 20.0;
/// The same for each reading of a long record, in which the level's own error adds up; noise with an exponential tail
/// gains 0.07.
const BY_READING: f64 = 0.003;

/// Log likelihood of the same counts when their distances from their level have one smooth density, whatever its shape:
/// a kernel estimate of the others, its spread kept.
fn smooth_likelihood(local: &Local, known: &[bool]) -> f64 {
    /// A quarter of a count, or of a wide spread a sixteenth of the kernel.
    const FINEST: f64 = 0.25;
    const OF_KERNEL: f64 = 1.0 / 16.0;
    let r: Vec<f64> = (0..known.len())
        .filter(|i| known[*i])
        .map(|i| local.residual[i])
        .collect();
    let n = r.len() as f64;
    let mean = r.iter().sum::<f64>() / n;
    let variance = r.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n;
    let h = KERNEL * variance.sqrt();
    let shrink = (1.0 / (1.0 + KERNEL * KERNEL)).sqrt();
    let h_shrunk = h * shrink;
    let width = FINEST.max(OF_KERNEL * h);
    let reach = (6.0 * variance.sqrt() / width).ceil() as i64;
    let bin = |v: f64| ((v - mean) / width).round() as i64;
    let mut tally = vec![0.0; 2 * reach as usize + 1];
    for v in &r {
        tally[(bin(mean + (v - mean) * shrink).clamp(-reach, reach) + reach) as usize] += 1.0;
    }
    let kernel = |d: f64| (-0.5 * (d / h_shrunk).powi(2)).exp() / (h_shrunk * (2.0 * PI).sqrt());
    let density: Vec<f64> = (-reach..=reach)
        .map(|a| {
            tally
                .iter()
                .zip(-reach..)
                .filter(|(t, _)| **t > 0.0)
                .map(|(t, b)| t * kernel((a - b) as f64 * width))
                .sum()
        })
        .collect();
    r.iter()
        .map(|v| {
            let at = (bin(*v).clamp(-reach, reach) + reach) as usize;
            let own = kernel((v - mean) * (1.0 - shrink));
            ((density[at] - own) / (n - 1.0)).max(1e-12).ln()
        })
        .sum()
}

/// Log likelihood of the counts when every code has a share of its own, whatever it is, less what so many shares cost.
fn code_likelihood(counts: &[i32], known: &[bool]) -> f64 {
    /// Nats for a share: the criterion of Schwarz asks half of ln n, which is 4.7 for 12 000 readings.
    const COST: f64 = 4.7;
    let mut tally = std::collections::BTreeMap::<i32, f64>::new();
    let mut n = 0.0;
    for (c, _) in counts.iter().zip(known).filter(|(_, k)| **k) {
        *tally.entry(*c).or_default() += 1.0;
        n += 1.0;
    }
    tally.values().map(|t| t * (t / n).ln() - COST).sum()
}

pub(super) fn audit(g: &Gyro<'_>, audit: &mut Audit) {
    let Some(counts) = g.counts else {
        return;
    };
    let local = &g.local;
    let name = g.channel.name.as_str();
    let known: Vec<bool> = (0..counts.len()).map(|i| g.known(i)).collect();
    if let Some(c) = coarse(counts, &known) {
        let chance = 0.5f64.powi(c.changes.min(900) as i32);
        let what = format!(
            "the {} lowest bits of {name} never change: its step is {} counts ({} changes, all of whole steps)",
            c.bits,
            1 << c.bits,
            c.changes
        );
        audit.check("low_bits", name, f64::from(c.bits), chance, what.clone());
        // One bit at 1 throughout is no grid that a converter makes.
        let sticks = c.bits == 1 && c.residue == 1;
        let mut finding = Finding {
            cause: if sticks { "stuck_bit" } else { "coarse_lsb" }.into(),
            channels: vec![name.into()],
            what,
            ..Finding::default()
        };
        if sticks {
            finding.parameters = parameters(0, 1, 1.0, None);
        } else {
            finding.parameters.insert(
                "missing_bits".into(),
                Parameter::exact(f64::from(c.bits), "1"),
            );
            if c.bits == 1 {
                finding.alternatives.push(Alternative {
                    cause: "stuck_bit".into(),
                    log_odds: 0.0,
                });
                finding.experiment = Some("read a register with known odd contents over the same line: a stuck line shows there too".into());
            }
        }
        audit.findings.push(finding);
        audit.suppress(
            &["stuck_bit", "stale_samples", "outliers", "kurtosis"],
            name,
            "coarse_lsb",
        );
        return;
    }
    let sigma = unrounded(local);
    if known.iter().filter(|k| **k).count() < LEAST_READINGS {
        return;
    }
    let levels = Levels::new(&local.level, &known);
    // How often each bit is 1.
    let ones = |bit: u32| {
        let own = counts.iter().zip(&known).filter(|(_, k)| **k);
        own.map(|(c, _)| u64::from(((c >> bit) & 1) as u32))
            .sum::<u64>() as f64
    };
    let tested: Vec<Share> = (0..BITS)
        .filter(|b| sigma >= LEAST_SIGMA && f64::from(1u32 << b) <= WITHIN_SIGMA * sigma)
        .filter_map(|b| share(ones(b), &levels, b, sigma))
        .collect();
    let Some(worst) = tested.iter().max_by(|a, b| a.z.abs().total_cmp(&b.z.abs())) else {
        audit.untested(
            "stuck_bit",
            &format!("{name}: the noise is less than a count, so the level alone decides the bits"),
        );
        return;
    };
    let chance = (tested.len() as f64 * tails::two_sided(worst.z)).min(1.0);
    let told = |z: f64, what: &str| {
        format!(
            "bit {} of {name} reads {} more often than normal noise makes it ({z:.1} sigma){what}",
            worst.bit, worst.value
        )
    };
    if !audit.check("bit_share", name, worst.z, chance, told(worst.z.abs(), "")) {
        return;
    }
    let tally = Tally::new(counts, local, &known);
    let sound = tally.sound(sigma);
    let smooth = smooth_likelihood(local, &known).max(code_likelihood(counts, &known));
    match tally.best(sigma, BITS) {
        Some(s) if s.log_likelihood - sound > CLEARLY_STUCK.max(NEARLY_ALL * (smooth - sound)) => {
            audit.findings.push(Finding {
                cause: "stuck_bit".into(),
                channels: vec![name.into()],
                parameters: parameters(s.bit, s.value, s.fraction, Some(s.error)),
                what: format!(
                    "bit {} of {name} reads {} too often: it sticks in {:.1} +- {:.1} % of the samples",
                    s.bit,
                    s.value,
                    100.0 * s.fraction,
                    100.0 * s.error,
                ),
                ..Finding::default()
            });
            audit.suppress(
                &["outliers", "kurtosis", "variance_in_time"],
                name,
                "stuck_bit",
            );
        }
        _ if smooth - sound > CLEARLY_NOT_NORMAL.max(BY_READING * counts.len() as f64) => {
            audit.not_normal.push(Unexplained {
                channel: name.into(),
                what: format!(
                    "the counts of {name} are not normally distributed about their level ({:.1} sigma at bit {}), and no bit that sticks makes them so",
                    worst.z.abs(),
                    worst.bit
                ),
            });
        }
        _ => {}
    }
}

fn parameters(bit: u32, value: u8, fraction: f64, error: Option<f64>) -> model::effect::Parameters {
    let mut share = Parameter::exact(fraction, "1");
    share.std_error = error;
    [
        ("bit".to_owned(), Parameter::exact(f64::from(bit), "1")),
        ("value".to_owned(), Parameter::exact(f64::from(value), "1")),
        ("fraction".to_owned(), share),
    ]
    .into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use statrs::distribution::{ContinuousCDF, Normal};

    #[test]
    fn the_square_wave_agrees_with_a_sum_over_codes() {
        for (level, sigma, bit) in [
            (0.3, 2.0, 2u32),
            (-5.2, 5.3, 3),
            (11.7, 0.7, 0),
            (3.0, 4.0, 2),
        ] {
            let normal = Normal::new(level, sigma).unwrap();
            let direct: f64 = (-200i32..200)
                .map(|c| {
                    let p = normal.cdf(f64::from(c) + 0.5) - normal.cdf(f64::from(c) - 0.5);
                    if (c >> bit) & 1 == 0 { p } else { -p }
                })
                .sum();
            let series = Square::new(sigma, f64::from(1u32 << (bit + 1))).at(level);
            assert!((direct - series).abs() < 1e-6, "{direct} {series}");
        }
    }
}
