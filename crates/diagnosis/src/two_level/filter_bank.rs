//! Two or more levels beside white noise and a random walk: a bank of Kalman filters, one for each level, merged by moments.
//!
//! What one step hands on to the next is a long chain of divisions and exponentials, in which a processor mostly waits. So
//! four likelihoods are made side by side, of other readings or other parameters.

use numerics::exp_ln::{exponentials, product_and};
use numerics::log_product::LogProduct;
use numerics::wide;

/// ln of variance, ln of random-walk step over it, ln of half height over the white sigma, ln of dwell in blocks.
pub(crate) type Coordinates = [f64; 4];

/// Levels in half heights, and what a reading is in which they change.
#[derive(Clone, Copy)]
pub(crate) struct Levels<const K: usize> {
    pub at: [f64; K],
    /// Whether such a reading is a mean over both levels, that of a block in which they change at any time with the same chance:
    /// then it is half way between them, give or take 1/sqrt(12) of their distance. Else it is the new level.
    pub mixed: bool,
}

/// Likelihoods that are made side by side.
pub(crate) const ABREAST: usize = 4;
/// Readings whose factors are multiplied before their size is looked at: each is some 1e-4 at least, the chance of a switch.
const FEW: usize = 4;
/// A number of each.
type Each = [f64; ABREAST];

fn each(f: impl Fn(usize) -> f64) -> Each {
    std::array::from_fn(f)
}

/// The least of some exponents, which become exp(least - exponent).
#[inline(always)]
#[allow(clippy::needless_range_loop)] // one number after the other of several arrays, side by side
fn below_least<const K: usize, const AT_ONCE: bool>(of: &mut [Each; K]) -> Each {
    // Of two, one is 1: half the exponentials.
    if K == 2 {
        let [mut least, mut off, mut fall] = [[0.0; ABREAST]; 3];
        for l in 0..ABREAST {
            least[l] = of[0][l].min(of[1][l]);
            off[l] = of[0][l] - of[1][l];
            fall[l] = -off[l].abs();
        }
        exponentials::<ABREAST, AT_ONCE>(&mut fall);
        for l in 0..ABREAST {
            of[0][l] = if off[l] > 0.0 { fall[l] } else { 1.0 };
        }
        for l in 0..ABREAST {
            of[1][l] = if off[l] > 0.0 { 1.0 } else { fall[l] };
        }
        return least;
    }
    let mut least = of[0];
    for e in &of[1..] {
        for l in 0..ABREAST {
            least[l] = if e[l] < least[l] { e[l] } else { least[l] };
        }
    }
    for e in of {
        for l in 0..ABREAST {
            e[l] = least[l] - e[l];
        }
        exponentials::<ABREAST, AT_ONCE>(e);
    }
    least
}

/// Log likelihoods by [`new_level`] or [`mean_of_both`].
pub(crate) fn filter<const K: usize>(
    y: [&[f64]; ABREAST],
    x: &[Coordinates; ABREAST],
    first: &[usize; ABREAST],
    levels: &Levels<K>,
    seen: impl FnMut(&Each),
) -> Each {
    match levels.mixed {
        true => mean_of_both(y, x, first, &levels.at, seen),
        false => new_level(y, x, first, &levels.at, seen),
    }
}

wide! {
    /// Those of blocks which are mixed where the level changes.
    fn mean_of_both[const K: usize](
        y: [&[f64]; ABREAST],
        x: &[Coordinates; ABREAST],
        first: &[usize; ABREAST],
        levels: &[f64; K],
        seen: impl FnMut(&Each),
    ) -> Each = run::<K, true, true>, else run::<K, false, true>
}

wide! {
    /// Log likelihoods of readings of one length, the mean taken out, under jumps between any of `levels`, all equally
    /// likely, the first reading on the level of the number `first`; `seen` is told the chances of the first of `levels`
    /// after each reading. Where the first level is not known either, every level has two places where the mean may be, and
    /// a filter that merges them by moments ends up at none of them.
    fn new_level[const K: usize](
        y: [&[f64]; ABREAST],
        x: &[Coordinates; ABREAST],
        first: &[usize; ABREAST],
        levels: &[f64; K],
        seen: impl FnMut(&Each),
    ) -> Each = run::<K, true, false>, else run::<K, false, false>
}

/// A level of a filter before a reading, and what one makes of it.
#[derive(Clone, Copy)]
struct Predicted {
    /// 1 over the variance of the reading, gain, and the variance of the slow level after it.
    inverse: Each,
    gain: Each,
    after: Each,
}

impl Predicted {
    /// Of the variance `p` of the slow level and that of the reading about it.
    #[inline(always)]
    fn new(p: &Each, noise: &Each) -> Self {
        let inverse = each(|l| 1.0 / (p[l] + noise[l]));
        let gain = each(|l| p[l] * inverse[l]);
        Self {
            inverse,
            gain,
            after: each(|l| gain[l] * noise[l]),
        }
    }
}

/// The filter. Its inner loops are over the likelihoods alone, so that each becomes an instruction or two.
#[inline(always)]
#[allow(clippy::needless_range_loop)]
fn run<const K: usize, const AT_ONCE: bool, const MIXED: bool>(
    y: [&[f64]; ABREAST],
    x: &[Coordinates; ABREAST],
    first: &[usize; ABREAST],
    levels: &[f64; K],
    mut seen: impl FnMut(&Each),
) -> Each {
    let of = product_and::<AT_ONCE>;
    let count = y[0].len();
    let y = y.map(|y| &y[..count]);
    let white = x.map(|x| x[0].exp());
    let walk = each(|l| white[l] * x[l][1].exp());
    let half = each(|l| x[l][2].exp() * white[l].sqrt());
    let others = (K - 1) as f64;
    // Two levels keep their share of 1/2 for ever, many theirs of 1/K.
    let share = K as f64 / others;
    let switch = x.map(|x| (1.0 - (-share * (-x[3]).exp()).exp()) / share);
    let (stays, comes) = (switch.map(|s| 1.0 - s), switch.map(|s| s / others));
    let start = each(|l| 1e4 * white[l] + half[l] * half[l]);
    // State by level: weight, mean and variance of the slow level.
    let mut weight: [Each; K] =
        std::array::from_fn(|i| each(|l| if first[l] == i { 1.0 } else { 0.0 }));
    let mut mean = [[0.0; ABREAST]; K];
    let mut variance = [start; K];
    let mut sums = [-0.5 * count as f64 * std::f64::consts::TAU.ln(); ABREAST];
    let mut products: [LogProduct; ABREAST] = std::array::from_fn(|_| LogProduct::default());
    let mut product = [1.0; ABREAST];
    // None before the first reading.
    let mut step = [0.0; ABREAST];
    for t in 0..count {
        let v = y.map(|y| y[t]);
        // Prediction by level: weight times 1/sqrt(s), 1/s, gain, variance after the reading.
        let ahead: [Each; K] = std::array::from_fn(|i| each(|l| variance[i][l] + step[l]));
        let stayed: [Predicted; K] = std::array::from_fn(|i| Predicted::new(&ahead[i], &white));
        if !MIXED {
            for i in 0..K {
                for l in 0..ABREAST {
                    weight[i][l] *= stayed[i].inverse[l].sqrt();
                }
            }
        }
        step = walk;
        // State by level after it, with what it is off at best.
        let before = mean;
        let [mut all, mut leasts] = [[[0.0; ABREAST]; K]; 2];
        for j in 0..K {
            let [mut parts, mut at] = [[[0.0; ABREAST]; K]; 2];
            let mut to = stayed;
            for i in 0..K {
                let (mut place, apart) = (levels[j], levels[j] - levels[i]);
                if MIXED && i != j {
                    place -= 0.5 * apart;
                    let more = apart * apart / 12.0;
                    let noise = each(|l| white[l] + more * half[l] * half[l]);
                    to[i] = Predicted::new(&ahead[i], &noise);
                }
                for l in 0..ABREAST {
                    let off = of(-half[l], place, v[l] - before[i][l]);
                    at[i][l] = of(to[i].gain[l], off, before[i][l]);
                    parts[i][l] = 0.5 * off * off * to[i].inverse[l];
                }
            }
            leasts[j] = below_least::<K, AT_ONCE>(&mut parts);
            let [mut sum, mut middle, mut spread] = [[0.0; ABREAST]; 3];
            for i in 0..K {
                let moved = if i == j { stays } else { comes };
                for l in 0..ABREAST {
                    let wide = if MIXED { to[i].inverse[l].sqrt() } else { 1.0 };
                    parts[i][l] *= weight[i][l] * moved[l] * wide;
                    sum[l] += parts[i][l];
                    middle[l] = of(parts[i][l], at[i][l], middle[l]);
                }
            }
            let once = sum.map(f64::recip);
            for l in 0..ABREAST {
                middle[l] *= once[l];
            }
            for i in 0..K {
                for l in 0..ABREAST {
                    let away = at[i][l] - middle[l];
                    spread[l] = of(parts[i][l], of(away, away, to[i].after[l]), spread[l]);
                }
            }
            (all[j], mean[j]) = (sum, middle);
            for l in 0..ABREAST {
                variance[j][l] = spread[l] * once[l];
            }
        }
        let least = below_least::<K, AT_ONCE>(&mut leasts);
        let mut total = [0.0; ABREAST];
        for j in 0..K {
            for l in 0..ABREAST {
                weight[j][l] = all[j][l] * leasts[j][l];
                total[l] += weight[j][l];
            }
        }
        let once = total.map(f64::recip);
        for w in &mut weight {
            for l in 0..ABREAST {
                w[l] *= once[l];
            }
        }
        for l in 0..ABREAST {
            sums[l] -= least[l];
        }
        for l in 0..ABREAST {
            product[l] *= total[l];
        }
        if t % FEW == FEW - 1 {
            let all = products.iter_mut().zip(product);
            all.for_each(|(all, few)| all.multiply(few));
            product = [1.0; ABREAST];
        }
        seen(&weight[0]);
    }
    // The diffuse start integrates the mean out. Its prior density is put back, and the factor of sqrt(count) by which
    // that integral differs from the density of the coefficients k >= 1 of the orthonormal DCT.
    each(|l| {
        sums[l] - (K as f64).ln()
            + products[l].ln()
            + product[l].ln()
            + 0.5 * (std::f64::consts::TAU * start[l] * count as f64).ln()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_processor_finds_the_same() {
        let y: Vec<f64> = (0..2001)
            .map(|i| f64::from(i * 7919 % 997) / 300.0 - 1.6 + f64::from(i / 100 % 2))
            .collect();
        let x: [Coordinates; ABREAST] =
            std::array::from_fn(|l| [0.1 * l as f64, -9.0, -0.5 + 0.3 * l as f64, 4.0]);
        let first = [0, 1, 1, 0];
        let (two, many) = ([1.0, -1.0], [-1.5, -0.7, 0.0, 0.7, 1.5]);
        let y = [&y[..]; ABREAST];
        let here = [
            new_level(y, &x, &first, &two, |_| {}),
            new_level(y, &x, &first, &many, |_| {}),
            mean_of_both(y, &x, &first, &two, |_| {}),
            mean_of_both(y, &x, &first, &many, |_| {}),
        ];
        let plain = [
            run::<2, false, false>(y, &x, &first, &two, |_| {}),
            run::<5, false, false>(y, &x, &first, &many, |_| {}),
            run::<2, false, true>(y, &x, &first, &two, |_| {}),
            run::<5, false, true>(y, &x, &first, &many, |_| {}),
        ];
        for (a, b) in here.iter().flatten().zip(plain.iter().flatten()) {
            assert!((a / b - 1.0).abs() < 1e-10, "{a} {b}");
        }
        assert!(here[0][0] != here[0][1] && here[0][0] != here[2][0]);
    }
}
