//! What an axis takes from the others otherwise than in proportion: their products, their lines of a shared word, one of
//! them with its sign alternating. No correlation shows any of it, and no effect of the library makes it.

use model::effect::Signal;
use model::record::Quantity;

use crate::ingest::types::Grid;
use crate::result::Check;
use crate::search::searched::Searched;
use crate::test_level::{CheckId, MOST, omnibus_level};
use numerics::column::{dot, sum_of, sums_of_products};
use numerics::tails;

/// Bits of a code that are looked at.
const BITS: u32 = 14;
/// Least share of the readings in which a bit is set, or not, or toggles.
const LEAST_SHARE: f64 = 0.01;

/// Something of the other axes, and what it is.
struct Source {
    /// Names of the channels that it is made of.
    of: Vec<String>,
    what: String,
    values: Vec<f64>,
}

fn without_mean(mut values: Vec<f64>) -> Vec<f64> {
    let mean = sum_of(&values, |v| v) / values.len().max(1) as f64;
    values.iter_mut().for_each(|v| *v -= mean);
    values
}

/// What `of` has beyond a share of `e`.
fn beyond(of: Vec<f64>, e: &[f64]) -> Vec<f64> {
    let of = without_mean(of);
    let share = dot(&of, e) / dot(e, e).max(f64::MIN_POSITIVE);
    of.iter().zip(e).map(|(a, b)| a - share * b).collect()
}

/// The sources of one axis.
fn of_one(s: &Searched<'_>, samples: usize) -> Vec<Source> {
    let (name, e) = (&s.target.name, &s.e[..samples]);
    let alternating = e
        .iter()
        .enumerate()
        .map(|(i, v)| if i % 2 == 0 { *v } else { -v });
    let mut all = vec![
        Source {
            of: vec![name.clone()],
            what: format!("{name} with its sign alternating"),
            values: alternating.collect(),
        },
        Source {
            of: vec![name.clone()],
            what: format!("the square of {name}"),
            values: beyond(e.iter().map(|v| v * v).collect(), e),
        },
    ];
    let Some(lsb) = s.target.lsb else {
        return all;
    };
    let codes: Vec<i32> = s.target.y[..samples]
        .iter()
        .map(|v| (v / lsb).round() as i32)
        .collect();
    let mut add = |what: String, set: &dyn Fn(usize) -> bool| {
        let values: Vec<f64> = (0..samples).map(|i| f64::from(u8::from(set(i)))).collect();
        let share = values.iter().sum::<f64>() / samples as f64;
        if (LEAST_SHARE..=1.0 - LEAST_SHARE).contains(&share) {
            all.push(Source {
                of: vec![name.clone()],
                what,
                values: beyond(values, e),
            });
        }
    };
    for bit in 0..BITS {
        let bit_of = |i: usize| codes[i] >> bit & 1;
        add(format!("bit {bit} of the code of {name}"), &|i| {
            bit_of(i) == 1
        });
        add(
            format!("changes of bit {bit} of the code of {name}"),
            &|i| i > 0 && bit_of(i) != bit_of(i - 1),
        );
    }
    all
}

/// As [`tails::errors_of_sum`], of many.
fn errors(a: &[f64], b: &[f64]) -> f64 {
    let [sum, square] = sums_of_products(a, b);
    sum / square.max(f64::MIN_POSITIVE).sqrt()
}

/// Times over which a blow is felt, s.
const FELT_S: [f64; 4] = [0.05, 0.25, 1.0, 4.0];

/// What the accelerometers have felt of late: their largest reading about the mean, faded with a time constant.
fn felt(grid: &Grid, samples: usize) -> Vec<Source> {
    let of = |s: &Signal, tau: f64| {
        let fade = (-1.0 / (tau * grid.rate_hz)).exp();
        let mean = s.values.iter().sum::<f64>() / s.values.len() as f64;
        let mut held = 0.0f64;
        let course = s.values[..samples].iter().map(|v| {
            held = (held * fade).max((v - mean).abs());
            held
        });
        Source {
            of: vec![s.name.clone()],
            what: format!("what {} felt within {tau} s", s.name),
            values: without_mean(course.collect()),
        }
    };
    let accelerometers = grid.signals.iter().filter(|s| s.quantity == Quantity::Acc);
    let all = accelerometers.flat_map(|s| FELT_S.iter().map(move |tau| of(s, *tau)));
    all.collect()
}

/// The one that stands out most, with its standard errors, and its chance among all of them.
fn most<'a>(
    e: &[f64],
    sources: impl Iterator<Item = &'a Source>,
) -> Option<(f64, &'a Source, f64)> {
    let scored: Vec<(f64, &Source)> = sources.map(|s| (errors(e, &s.values), s)).collect();
    let (z, source) = scored
        .iter()
        .max_by(|a, b| a.0.abs().total_cmp(&b.0.abs()))?;
    let p = (tails::normal_tail(*z) * scored.len() as f64).min(1.0);
    Some((*z, *source, p))
}

/// What is told of the one that stands out `most` over so many samples.
fn told(
    id: CheckId,
    channel: &str,
    what: &str,
    samples: usize,
    (z, of, p): (f64, &Source, f64),
) -> Check {
    let share = z / (samples as f64).sqrt();
    let fails = p < omnibus_level();
    let what = format!("{what} {} ({share:+.3} of it)", of.what);
    Check {
        id: id.into(),
        about: of.of.clone(),
        channel: channel.into(),
        statistic: z,
        p_value: Some(p),
        threshold: omnibus_level(),
        fails_before: fails,
        fails_after: fails,
        what: if fails {
            what
        } else {
            format!("most of all, {what}")
        },
    }
}

/// Each axis at rest against what the others are made of, and its variance against what the accelerometers felt; `alone` are the
/// residuals without what a source makes of several axes, where there is one.
pub(crate) fn couplings(searched: &[Searched<'_>], alone: &[Vec<f64>], grid: &Grid) -> Vec<Check> {
    let at_rest = searched.iter().enumerate();
    let at_rest = at_rest.filter(|(_, s)| !s.target.moving && !s.search.view.sways());
    let (own, still): (Vec<&Vec<f64>>, Vec<&Searched<'_>>) = at_rest
        .map(|(k, s)| (alone.get(k).unwrap_or(&s.e), s))
        .unzip();
    let mut found = vec![];
    let Some(samples) = still.iter().map(|s| s.e.len().min(MOST)).min() else {
        return found;
    };
    let sources: Vec<Vec<Source>> = still.iter().map(|s| of_one(s, samples)).collect();
    let felt = felt(grid, samples);
    for (i, a) in still.iter().enumerate() {
        let e = &own[i][..samples];
        let others = || (0..still.len()).filter(|j| *j != i);
        let pairs = others().flat_map(|j| others().filter(move |k| *k > j).map(move |k| (j, k)));
        let products: Vec<Source> = pairs
            .map(|(j, k)| {
                let (b, c) = (still[j], still[k]);
                let product = b.e.iter().zip(&c.e).map(|(b, c)| b * c);
                Source {
                    of: vec![b.target.name.clone(), c.target.name.clone()],
                    what: format!("the product of {} and {}", b.target.name, c.target.name),
                    values: without_mean(product.take(samples).collect()),
                }
            })
            .collect();
        let all = others().flat_map(|j| &sources[j]).chain(&products);
        let mut tell = |id: CheckId, what: &str, most: Option<(f64, &Source, f64)>| {
            found.extend(most.map(|most| told(id, &a.target.name, what, samples, most)));
        };
        let follows = "the whitened residual follows";
        tell(CheckId::Couplings, follows, most(e, all));
        let square = without_mean(e.iter().map(|v| v * v).collect());
        let of_variance = most(&square, felt.iter());
        tell(
            CheckId::VarianceFollows,
            "the variance follows",
            of_variance,
        );
    }
    found
}

#[cfg(test)]
mod tests {
    use rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    #[test]
    fn errors_are_standard_though_both_sides_are_loud_at_the_same_time() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(4);
        let mut draw = |loud: bool| -> f64 {
            let v: f64 = StandardNormal.sample(&mut rng);
            if loud { 4.0 * v } else { v }
        };
        let runs = 400;
        let square: f64 = (0..runs)
            .map(|_| {
                let a: Vec<f64> = (0..2000).map(|i| draw(i < 200)).collect();
                let b: Vec<f64> = (0..2000).map(|i| draw(i < 200)).collect();
                errors(&a, &b).powi(2)
            })
            .sum();
        // Chi-square of 400: 400 +- 28.
        assert!((290.0..510.0).contains(&square), "{square}");
    }
}
