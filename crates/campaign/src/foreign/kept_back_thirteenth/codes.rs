//! The thirteenth set's laws that act on what is read.

use super::super::kept_back_fifth::noise::of_edges;
use super::super::kept_back_fourth::codes::{law, of_steps};
use super::super::kept_back_ninth::codes::by_chance;
use super::super::kept_back_sixth::codes::{mapped, mean_and_sigma, of_map, refitted};
use super::super::kept_back_tenth::codes::zero_of;
use super::super::{Change, Foreign};
use crate::random::Draw;
use crate::stand::{LSB, Stand};
use crate::strength::size_for;

/// One of them; `None` for another name.
pub(super) fn one(
    draw: &mut Draw,
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Option<Foreign> {
    Some(match name {
        "low nibble of the reading after" => nibble(stand, name, axis, wanted),
        "lines printed with few digits" => {
            let form = form_of(draw, stand, axis, wanted);
            by_map(stand, name, axis, wanted, move |code| form.read(code))
        }
        "output that falls slower than it rises" => {
            by_chance(stand, name, axis, wanted, falling(draw, stand, axis))
        }
        "bit of the converter that weighs wrong" => weighed(draw, stand, name, axis, wanted),
        "filter whose register wraps round" => {
            by_map(stand, name, axis, wanted, wrapped(draw, stand, axis))
        }
        "half-precision number about a power of two" => {
            by_map(stand, name, axis, wanted, halved(draw, stand, axis))
        }
        _ => return None,
    })
}

/// Readings of which so many, by chance, go through a map that the strength is had with.
fn by_map(
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
    map: impl Fn(i32) -> i32 + 'static,
) -> Foreign {
    let strength = |chance: f64| of_map(stand, axis, chance.min(1.0), &map);
    let chance = size_for(wanted, &strength).min(1.0);
    mapped(name, axis, chance, strength(chance), map)
}

/// Bits of the part of a word that is packed apart.
pub(in super::super) const NIBBLE: i32 = 4;

/// The upper bits of one code and the lowest of another.
fn mixed(upper: i32, lower: i32) -> i32 {
    let low = (1 << NIBBLE) - 1;
    (upper & !low) | (lower & low)
}

/// Chances from each reading (row) to the next where some have the low nibble of the reading after: the first code, the
/// steps, and the share of each code. What two neighbours have in common is the code of the second.
pub(in super::super) fn steps_of_nibble(
    stand: &Stand,
    axis: usize,
    chance: f64,
) -> (i32, Vec<Vec<f64>>, Vec<f64>) {
    let (first, even) = law(stand, axis);
    let n = even.len();
    let last = n as i32 - 1;
    // A code beyond those that are followed, which next to none is, counts to the last of them.
    let place =
        |upper: usize, lower: i32| (mixed(first + upper as i32, lower) - first).clamp(0, last);
    let mut nibbles = [0.0; 1 << NIBBLE];
    for (i, p) in even.iter().enumerate() {
        nibbles[(first + i as i32).rem_euclid(1 << NIBBLE) as usize] += p;
    }
    let mut both = vec![vec![0.0; n]; n];
    for (second, q) in even.iter().enumerate() {
        let mut then = vec![0.0; n];
        then[second] += 1.0 - chance;
        for (low, share) in nibbles.iter().enumerate() {
            then[place(second, low as i32) as usize] += chance * share;
        }
        for (own, p) in even.iter().enumerate() {
            let torn = place(own, first + second as i32) as usize;
            for (to, r) in then.iter().enumerate().filter(|(_, r)| **r > 0.0) {
                both[own][to] += p * q * (1.0 - chance) * r;
                both[torn][to] += p * q * chance * r;
            }
        }
    }
    let shares: Vec<f64> = both.iter().map(|row| row.iter().sum()).collect();
    for (row, share) in both.iter_mut().zip(&shares) {
        row.iter_mut().for_each(|p| *p /= share.max(1e-300));
    }
    (first, both, shares)
}

/// d' of them, mean and variance refitted.
pub(in super::super) fn of_nibble(stand: &Stand, axis: usize, chance: f64) -> f64 {
    let (first, steps, shares) = steps_of_nibble(stand, axis, chance.min(1.0));
    let other = refitted(first, &shares);
    of_steps(&steps, &shares, &|_, to| other[to], stand.samples())
}

/// Words that are packed by one and a half bytes, of which the byte with the nibbles is read last: where the part has a new
/// reading meanwhile, the low nibble is already that one's.
fn nibble(stand: &Stand, name: &'static str, axis: usize, wanted: f64) -> Foreign {
    let chance = size_for(wanted, &|chance| of_nibble(stand, axis, chance)).min(1.0);
    let change = move |counts: &[Vec<i32>; 3], draw: &mut Draw| {
        let own = &counts[axis];
        let one = |i: usize| {
            if draw.chance(chance) {
                mixed(own[i], own[(i + 1).min(own.len() - 1)])
            } else {
                own[i]
            }
        };
        (0..own.len()).map(one).collect()
    };
    Foreign {
        name,
        strength: of_nibble(stand, axis, chance),
        change: Change::Made(Box::new(change)),
    }
}

/// How a rate is printed: the unit of a deg/s, and how many digits it gets.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct Form {
    unit: f64,
    digits: i32,
}

/// Those whose last digit is more than a count, and less than the noise, at the rates of a stand at rest: deg/s, gon/s,
/// minutes of arc a second, and deg/h.
const FORMS: [Form; 5] = [
    Form::new(1.0, 2),
    Form::new(10.0 / 9.0, 2),
    Form::new(60.0, 2),
    Form::new(60.0, 1),
    Form::new(3600.0, 1),
];

impl Form {
    const fn new(unit: f64, digits: i32) -> Self {
        Self { unit, digits }
    }

    /// What is read again of the text.
    pub(in super::super) fn read(self, code: i32) -> i32 {
        let rate = LSB * self.unit * f64::from(code);
        if code == 0 {
            return 0;
        }
        let place = 10f64.powi(rate.abs().log10().floor() as i32 + 1 - self.digits);
        ((rate / place).round() * place / self.unit / LSB).round() as i32
    }
}

/// One of the forms that are strong enough, or the coarsest.
pub(in super::super) fn form_of(draw: &mut Draw, stand: &Stand, axis: usize, wanted: f64) -> Form {
    let strong = |form: &&Form| of_map(stand, axis, 1.0, &|c| form.read(c)) >= wanted;
    let enough: Vec<&Form> = FORMS.iter().filter(strong).collect();
    match enough.len() {
        0 => FORMS[FORMS.len() - 1],
        k => *enough[draw.of_many(k)],
    }
}

/// An output that is driven upward and let go downward: where a long cable hangs on it, as it does in some frames, it falls
/// by so much at most, of the noise's sigma, from one reading to the next.
pub(in super::super) fn falling(
    draw: &mut Draw,
    stand: &Stand,
    axis: usize,
) -> impl Fn(i32, i32) -> i32 + use<> {
    let (_, sigma) = mean_and_sigma(stand, axis);
    let most = (sigma * draw.between(0.2, 0.9)).round().max(1.0) as i32;
    move |before, code| code.max(before - most)
}

/// A converter by successive approximation of which one bit is not what it should be, counts.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct Weight {
    bit: u32,
    /// The word's code of the zero code, of which only what is below the next bit counts.
    offset: i32,
    sign: f64,
}

impl Weight {
    /// Bits that may be off: the lowest is told by its share of ones alone, as one that sticks.
    const BITS: (u32, u32) = (1, 3);
    /// Most that it may be off, of what it is.
    const MOST: f64 = 0.95;

    fn any(draw: &mut Draw) -> Self {
        let bit = Self::BITS.0 + draw.of_many((Self::BITS.1 - Self::BITS.0 + 1) as usize) as u32;
        Self {
            bit,
            offset: draw.of_many(1 << (bit + 1)) as i32,
            sign: draw.sign(),
        }
    }

    /// One that is as strong as wanted at the most that it may be off, if a few draws have one.
    pub(in super::super) fn new(draw: &mut Draw, stand: &Stand, axis: usize, wanted: f64) -> Self {
        const TRIES: usize = 20;
        let mut own = Self::any(draw);
        for _ in 0..TRIES {
            if own.strength(stand, axis, f64::INFINITY) >= wanted {
                break;
            }
            own = Self::any(draw);
        }
        own
    }

    /// Lower edges of the codes from the first on, counts. A code whose edge lies above a later one's never comes: the higher
    /// bit is tried first.
    pub(in super::super) fn edges(self, stand: &Stand, axis: usize, off: f64) -> (i32, Vec<f64>) {
        let (first, even) = law(stand, axis);
        let off = self.sign * off.min(Self::MOST * f64::from(1 << self.bit));
        let mut edges: Vec<f64> = (first..=first + even.len() as i32)
            .map(|code| {
                let set = (code + self.offset) >> self.bit & 1;
                f64::from(code) - 0.5 + off * f64::from(set)
            })
            .collect();
        for i in (1..edges.len()).rev() {
            edges[i - 1] = edges[i - 1].min(edges[i]);
        }
        (first, edges)
    }

    pub(in super::super) fn strength(self, stand: &Stand, axis: usize, off: f64) -> f64 {
        let (first, edges) = self.edges(stand, axis, off);
        of_edges(stand, axis, first, &edges)
    }
}

fn weighed(
    draw: &mut Draw,
    stand: &Stand,
    name: &'static str,
    axis: usize,
    wanted: f64,
) -> Foreign {
    let weight = Weight::new(draw, stand, axis, wanted);
    let off = size_for(wanted, &|off| weight.strength(stand, axis, off));
    let (first, edges) = weight.edges(stand, axis, off);
    Foreign {
        name,
        strength: weight.strength(stand, axis, off),
        change: Change::Edges(first, edges),
    }
}

/// A decimating filter whose register has no bit to spare: what is beyond its range comes out at the other end. So it is in
/// the frames that are taken at the larger of two gains.
pub(in super::super) fn wrapped(
    draw: &mut Draw,
    stand: &Stand,
    axis: usize,
) -> impl Fn(i32) -> i32 + use<> {
    let (_, sigma) = mean_and_sigma(stand, axis);
    let zero = zero_of(draw, stand, axis).round() as i32;
    let half = (sigma * draw.between(0.8, 1.6)).round().max(2.0) as i32;
    move |code| zero - half + (code - zero + half).rem_euclid(2 * half)
}

/// Words kept as numbers of half precision, eleven bits of mantissa: beyond a power of two, which lies near the reading at
/// rest, only every second has a number of its own, and one between two goes to that whose mantissa is even. Some frames are
/// kept so.
pub(in super::super) fn halved(
    draw: &mut Draw,
    stand: &Stand,
    axis: usize,
) -> impl Fn(i32) -> i32 + use<> {
    let zero = zero_of(draw, stand, axis).round() as i32;
    // Of a part that is mounted upside down, it is the readings below.
    let up = draw.sign() as i32;
    move |code| {
        let off = up * (code - zero);
        if off > 0 {
            let mantissa = (0.5 * f64::from(off)).round_ties_even() as i32;
            zero + up * 2 * mantissa
        } else {
            code
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::kept_back_fourth::codes::of_exchanged;
    use super::super::tests::stand;
    use super::*;

    #[test]
    fn a_nibble_is_that_of_the_reading_after_and_the_rest_its_own() {
        assert_eq!([mixed(0x35, 0x2a), mixed(-1, 0x20)], [0x3a, -16]);
        let (mut draw, stand) = stand(40);
        let (chance, sigma) = (0.3, stand.white(0).sqrt() / LSB);
        let (first, steps, shares) = steps_of_nibble(&stand, 0, chance);
        assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-6);
        let own: Vec<i32> = (0..200_000)
            .map(|_| (stand.bias[0] / LSB + sigma * draw.normal()).round() as i32)
            .collect();
        let read: Vec<i32> = own
            .windows(2)
            .map(|w| {
                if draw.chance(chance) {
                    mixed(w[0], w[1])
                } else {
                    w[0]
                }
            })
            .collect();
        let again = read.windows(2).filter(|w| w[0] == w[1]).count() as f64 / read.len() as f64;
        let told: f64 = (0..shares.len()).map(|i| shares[i] * steps[i][i]).sum();
        // Five standard deviations of 200 000: 0.004.
        assert!((again - told).abs() < 0.004, "{again} {told}");
        let mean: f64 = read.iter().map(|c| f64::from(*c)).sum::<f64>() / read.len() as f64;
        let of_law: f64 = (0..shares.len())
            .map(|i| shares[i] * f64::from(first + i as i32))
            .sum();
        assert!((mean - of_law).abs() < 0.1, "{mean} {of_law}");
        assert!(of_nibble(&stand, 0, 0.0) < 0.5 && of_exchanged(&stand, 0, 1, 0.0) < 0.5);
    }

    #[test]
    fn a_printed_rate_keeps_its_digits_and_no_more() {
        // 20 counts are 1.4652 deg/s, printed 1.5; 10 are 0.7326, printed 0.73; 14 are 1.0256, printed 1.0.
        let form = Form::new(1.0, 2);
        assert_eq!(
            [20, 10, 14, -20, 0].map(|c| form.read(c)),
            [20, 10, 14, -20, 0]
        );
        // 16 are 1.17216, printed 1.2, which is 16.4; 17 are 1.24542, printed 1.2 as well.
        assert_eq!([16, 17].map(|c| form.read(c)), [16, 16]);
        let hours = Form::new(3600.0, 1);
        // 5 counts are 1319 deg/h, printed 1000, which is 3.8.
        assert_eq!([5, -5, 9].map(|c| hours.read(c)), [4, -4, 8]);
    }

    #[test]
    fn an_output_rises_at_once_and_falls_by_so_much() {
        let (mut draw, stand) = stand(41);
        let falls = falling(&mut draw, &stand, 0);
        let most = -falls(0, -1000);
        assert!((1..10).contains(&most), "{most}");
        assert_eq!(
            [falls(0, 1000), falls(7, 7), falls(7, 7 - most)],
            [1000, 7, 7 - most]
        );
    }

    #[test]
    fn a_bit_that_weighs_more_moves_the_codes_that_have_it() {
        let (mut draw, stand) = stand(42);
        let weight = Weight {
            bit: 2,
            offset: 0,
            sign: 1.0,
        };
        let (first, edges) = weight.edges(&stand, 0, 1.5);
        for (i, edge) in edges.iter().enumerate() {
            let code = first + i as i32;
            let even = f64::from(code) - 0.5;
            let off = match code.rem_euclid(8) {
                0..=3 => 0.0,
                // Those that the next higher bit comes before: the last gives way, and the one before it in part.
                7 if i + 1 < edges.len() => 1.0,
                _ => 1.5,
            };
            assert!((edge - even - off).abs() < 1e-9, "{code}: {}", edge - even);
        }
        let own = Weight::new(&mut draw, &stand, 0, 25.0);
        assert!(own.strength(&stand, 0, 0.0) < 0.5 && own.strength(&stand, 0, 10.0) > 25.0);
    }

    #[test]
    fn a_register_wraps_to_its_other_end() {
        let (mut draw, stand) = stand(43);
        let wrap = wrapped(&mut draw, &stand, 0);
        let all: Vec<i32> = (-200..200).map(&wrap).collect();
        let (low, high) = (all.iter().min(), all.iter().max());
        let range = low.zip(high).map_or(0, |(l, h)| h - l + 1);
        for (code, read) in (-200..200).zip(&all) {
            assert_eq!((code - read) % range, 0);
        }
        let sigma = stand.white(0).sqrt() / LSB;
        assert!(
            (1.4 * sigma..3.5 * sigma).contains(&f64::from(range)),
            "{range}"
        );
    }

    #[test]
    fn a_number_of_half_precision_is_exact_below_its_power_of_two() {
        let (mut draw, stand) = stand(44);
        let read = halved(&mut draw, &stand, 0);
        let moved: Vec<i32> = (-40..40).filter(|c| read(*c) != *c).collect();
        assert!(moved.len() > 10 && moved.windows(2).all(|w| w[1] - w[0] == 2));
        for code in moved {
            assert_eq!((read(code) - code).abs(), 1);
        }
        // Every other even one takes both neighbours, and the power of two itself the one beyond it.
        let taken = |code: i32| (-60..60).filter(|c| read(*c) == code).count();
        let each: Vec<usize> = (-40..40).map(taken).collect();
        let of = |n: usize| each.iter().filter(|t| **t == n).count();
        assert!(of(2) == 1 && of(3) > 4 && of(0) + of(1) + of(2) + of(3) == each.len());
    }
}
