//! Low bits: missing ones, and one that sticks.
//!
//! Missing bits need no noise model. Where all counts are one residue apart by 2^k, every change is a multiple of 2^k;
//! a change of a finer converter is even with a chance below 1/2, however small or large its noise. The same holds of
//! multiples of any other number, where no reading but those at the ends lies beside them.
//!
//! A bit that sticks moves the share of ones. With the reading normal about what its neighbours predict, L, the square
//! wave s of period P = 2^(b+1) (+1 where bit b is 0) has the mean
//! E s = sum over odd m of 4/(pi m) exp(-2 pi^2 sigma^2 m^2 / P^2) sin(2 pi m (L + 1/2) / P),
//! nearly 0 for the lowest bits and far from it where P exceeds 4 sigma. That shows that the counts are not what normal
//! noise makes them; whether a bit sticks, and which, is decided by the likelihood of their histogram ([`super::stuck`]).

mod coarse;

use std::f64::consts::PI;

use model::record::Channel;
use model::{Parameter, effects};

use super::cells::Cells;
use super::stuck::{self, Stuck, Verdict};
use super::{Audit, Gyro, LEAST_READINGS};
use crate::audit::local::{Levels, Local};
use crate::result::Finding;
use crate::test_level::{CheckId, Observation};
use numerics::tails;
use numerics::tails::ONE_SIDED;

/// Most low bits that are looked at.
const BITS: u32 = 8;
/// A bit is tested while its weight is below this many sigma: beyond, the level decides it, not the noise.
const WITHIN_SIGMA: f64 = 2.0;
/// Least noise, counts: below it the level decides even the lowest bit.
const LEAST_SIGMA: f64 = 0.9;
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

/// What the histogram of the codes says of rails.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shape {
    /// It was not judged.
    Unknown,
    /// It is smooth.
    Sound,
    /// Rails explain it.
    Rails,
    /// Something else does, or nothing.
    Other,
}

/// Bits that never change, and one whose share of ones normal noise does not make.
pub(super) fn audit(g: &Gyro<'_>, audit: &mut Audit) -> Shape {
    let Some(counts) = g.counts else {
        return Shape::Unknown;
    };
    let name = g.channel.name.as_str();
    audit.smallest(effects::coarse_lsb::ID, name, "missing_bits", 1.0, "1");
    let known: Vec<bool> = (0..counts.len()).map(|i| g.known(i)).collect();
    let coarse = coarse::grid(counts, &known);
    if let Some(c) = coarse.as_ref().filter(|c| c.whole) {
        coarse::tell(c, g.channel, unrounded(&g.local), audit);
        return Shape::Other;
    }
    if known.iter().filter(|k| **k).count() < LEAST_READINGS {
        return Shape::Unknown;
    }
    let codes: Vec<i32> = counts
        .iter()
        .zip(&known)
        .filter(|(_, k)| **k)
        .map(|(c, _)| *c)
        .collect();
    let sigma = unrounded(&g.local);
    let levels = Levels::new(&g.local.level, &known);
    let Some(worst) = worst_share(&codes, &levels, sigma, name, audit) else {
        return Shape::Unknown;
    };
    let lsb = g.channel.lsb.unwrap_or(1.0);
    let verdict = stuck::judge(&codes, sigma, lsb, BITS, worst.alarmed);
    // Single readings off a coarse grid are another fault's, unless two roundings make them.
    if let Some(c) = coarse.filter(|_| !matches!(verdict, Verdict::Twice { .. })) {
        coarse::tell(&c, g.channel, unrounded(&g.local), audit);
        return Shape::Other;
    }
    match verdict {
        Verdict::Smooth => Shape::Sound,
        Verdict::Rails => Shape::Rails,
        Verdict::Bit(s) => {
            audit.findings.push(sticks(&s, name));
            let step = f64::from(1u32 << (s.bit + 1));
            audit.lacks_a_bit(name, effects::stuck_bit::ID, step, sigma);
            Shape::Other
        }
        Verdict::Twice { cells, error } => {
            let found = rounded_twice(cells, error, lsb, g.channel);
            audit.findings.push(found);
            let wide = cells.step.max(1.0);
            audit.lacks_a_bit(name, effects::double_rounding::ID, wide, sigma);
            audit.untested_on(
                name,
                effects::stuck_bit::ID,
                "its readings were rounded twice: record the sensor's own counts",
            );
            Shape::Other
        }
        Verdict::Unlike {
            nats,
            nearest,
            twice,
        } => {
            let nearest = match twice {
                Some(cells) => format!(
                    "a step of {:.4} {} that was rounded to {lsb:.4} comes nearest: write the sensor's counts, or more digits",
                    cells.step * lsb,
                    g.channel.unit
                ),
                None => nearest_bit(nearest.as_ref()),
            };
            let what = unlike(name, &worst, nats, &nearest);
            audit.not_normal.push(Observation::of_codes(name, what));
            Shape::Other
        }
    }
}

/// The finding of a bit that sticks.
fn sticks(s: &Stuck, name: &str) -> Finding {
    Finding {
        cause: effects::stuck_bit::ID.into(),
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
    }
}

/// The finding of readings that were rounded before, of codes that are `lsb` each.
fn rounded_twice(cells: Cells, error: f64, lsb: f64, of: &Channel) -> Finding {
    let unit = &of.unit;
    let sensor = Parameter {
        std_error: Some(error * lsb),
        ..Parameter::exact(cells.decimal.map_or(cells.step * lsb, |d| d.step), unit)
    };
    Finding {
        cause: effects::double_rounding::ID.into(),
        channels: vec![of.name.clone()],
        what: format!(
            "{} holds a sensor's steps of {:.4} {unit} rounded to {lsb:.4} {unit}",
            of.name, sensor.value
        ),
        parameters: [
            ("sensor_step".to_owned(), sensor),
            ("file_step".to_owned(), Parameter::exact(lsb, unit)),
            (
                "offset".to_owned(),
                Parameter::exact(cells.offset * lsb, unit),
            ),
            (
                "halves".to_owned(),
                Parameter::exact(cells.decimal.map_or(0.0, |d| d.halves.number()), "1"),
            ),
        ]
        .into(),
        ..Finding::default()
    }
}

/// The bit that comes nearest to making codes as they are.
fn nearest_bit(nearest: Option<&Stuck>) -> String {
    nearest.map_or("no bit that sticks makes them so".to_owned(), |s| {
        format!(
            "bit {} at {} in {:.0} % of the samples comes nearest and leaves much of it",
            s.bit,
            s.value,
            100.0 * s.fraction
        )
    })
}

/// What is said of codes that no smooth law explains, and of what comes nearest.
fn unlike(name: &str, worst: &Worst, nats: f64, nearest: &str) -> String {
    format!(
        "the codes of {name} have shares that no smooth distribution has ({nats:.0} nats; {:.1} sigma at bit {}), and {nearest}",
        worst.share.z.abs(),
        worst.share.bit
    )
}

/// The bit whose share of ones is farthest from the expected one.
struct Worst {
    share: Share,
    /// Whether that is more than chance makes.
    alarmed: bool,
}

/// Tests the share of ones of each bit that the noise decides; none where the level alone decides them all.
fn worst_share(
    codes: &[i32],
    levels: &Levels,
    sigma: f64,
    name: &str,
    audit: &mut Audit,
) -> Option<Worst> {
    let ones = |bit: u32| codes.iter().filter(|c| (*c >> bit) & 1 == 1).count() as f64;
    let tested: Vec<Share> = (0..BITS)
        .filter(|b| sigma >= LEAST_SIGMA && f64::from(1u32 << b) <= WITHIN_SIGMA * sigma)
        .filter_map(|b| share(ones(b), levels, b, sigma))
        .collect();
    let bits = tested.len() as f64;
    let farthest = tested
        .into_iter()
        .max_by(|a, b| a.z.abs().total_cmp(&b.z.abs()));
    let Some(share) = farthest else {
        audit.untested_on(
            name,
            effects::stuck_bit::ID,
            "the noise is less than a count, so the level alone decides the bits",
        );
        return None;
    };
    // A bit that changes the readings by one count leaves nothing but its share of ones.
    let readings = levels.iter().map(|l| l.1).sum::<f64>();
    let reach = (2.0 * stuck::CLEARLY).sqrt() + ONE_SIDED;
    audit.smallest(
        effects::stuck_bit::ID,
        name,
        "fraction",
        reach / readings.sqrt(),
        "1",
    );
    let chance = (bits * tails::two_sided(share.z)).min(1.0);
    let what = format!(
        "bit {} of {name} reads {} more often than normal noise makes it ({:.1} sigma)",
        share.bit,
        share.value,
        share.z.abs()
    );
    let alarmed = audit.check(CheckId::BitShare, name, share.z, chance, what);
    Some(Worst { share, alarmed })
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
