//! Counts of readings that come without them: a file in deg/s whose readings are multiples of a step holds what the
//! converter delivered, times a scale. Where the record says the scale, or another gyro has finer steps, a step may be several counts.

use std::borrow::Cow;

use model::record::{Channel, Quantity, Record};
use numerics::order_statistics::robust_sigma;
use numerics::series::smallest_step;

/// Distance of a reading from its multiple, steps, up to which it is that multiple printed with few digits: a step of
/// 0.07 deg/s printed to 0.001 leaves 0.007.
const NEAR: f64 = 0.05;
/// Digits behind the point that a file may have, and how near to a multiple of the last one a number is one.
const DIGITS: i32 = 9;
const LAST_DIGIT: f64 = 1e-3;
/// Steps to either side that are tried, within what the last digits at both ends leave open.
const PLACES: i32 = 100;
/// Distance of a reading from its multiple, steps, from which on it may be another one's.
const FAR: f64 = 0.22;
/// Steps in the spread of the readings from which on a grid is that of a number's last digit. No audit of counts looks at
/// more than eight bits within it.
const FINE: f64 = 256.0;
/// How far two steps may be apart, in powers of two, to be told as one times a power of two.
const SAME_STEP: f64 = 0.02;
/// Key of the header that says what a count of the gyros is, deg/s.
const SCALE: &str = "gyro_lsb_dps";
/// Relative distance of a step from a whole number of the counts stated: 16.4 counts a deg/s, as data sheets write it, are 16.384.
const STATED: f64 = 2e-3;
/// Most bits that a converter may have lost beside its like.
const MOST_BITS: f64 = 8.5;
/// Largest count: converters of 20 bits are the finest of inertial sensors in use.
const LARGEST: f64 = 524_288.0;

/// The record with the counts of gyros whose readings are multiples of a step.
#[must_use]
pub fn counted(record: &Record) -> Cow<'_, Record> {
    let mut whole = Cow::Borrowed(record);
    let stated = stated(record);
    let without = |c: &Channel| c.quantity == Quantity::Gyro && c.counts.is_none();
    let all = record.channels.iter().enumerate();
    let found: Vec<(usize, f64, Vec<i32>)> = all
        .filter(|(_, c)| without(c))
        .filter_map(|(i, c)| multiples(&c.values).map(|(step, counts)| (i, step, counts)))
        .collect();
    for (i, step, counts) in &found {
        let unit = &record.channels[*i].unit;
        let alike = found.iter().filter(|f| record.channels[f.0].unit == *unit);
        let finest = alike.map(|f| f.1).fold(*step, f64::min);
        let of_scale = stated.filter(|_| unit == "deg/s");
        let coarse = of_scale
            .and_then(|stated| of_stated(*step, stated))
            .unwrap_or_else(|| beside(*step, finest));
        let own = &mut whole.to_mut().channels[*i];
        own.lsb = Some(step / f64::from(coarse));
        own.counts = Some(counts.iter().map(|c| c * coarse).collect());
        // What few digits took off the multiples is no noise of the sensor, and hangs on the code.
        let multiples: Vec<f64> = counts.iter().map(|c| f64::from(*c) * step).collect();
        let off = |(v, m): (&f64, &f64)| (v - m).abs() > NEAR * step;
        if own.values.iter().zip(&multiples).any(off) {
            let known = own.values.iter_mut().zip(multiples);
            known
                .filter(|(v, _)| v.is_finite())
                .for_each(|(v, m)| *v = m);
        }
    }
    whole
}

/// Counts in a step that is coarser than that of another gyro of the sensor, whose converters are alike: a power of two; 1 where
/// it is no such multiple of it, or one that no counts reach.
fn beside(step: f64, finest: f64) -> i32 {
    let bits = (step / finest).log2();
    let is_one = (bits - bits.round()).abs() < SAME_STEP && bits < MOST_BITS;
    if is_one { 1 << bits.round() as u32 } else { 1 }
}

/// Counts in a step, where it is a whole number of those that the record states.
fn of_stated(step: f64, stated: f64) -> Option<i32> {
    let counts = (step / stated).round();
    // As exact as a step of one count is told from one of its neighbours: a scale is stated to three digits or more.
    let is_one = (step / stated - counts).abs() < STATED * counts.max(1.0);
    (is_one && (1.0..MOST_BITS.exp2()).contains(&counts)).then_some(counts as i32)
}

/// What a count of the gyros is, in deg/s, as the record says.
fn stated(record: &Record) -> Option<f64> {
    let mut entries = record.header.entries.iter().rev();
    let (_, lsb) = entries.find(|(key, _)| key == SCALE)?;
    lsb.parse().ok().filter(|lsb: &f64| *lsb > 0.0)
}

/// The step of readings, and the multiple that each is, 0 where there is no reading. None where they are no multiples of
/// one, or of one that is too fine to tell. Those of a grid whose zero is no reading had an offset taken off, and their bits
/// are not known. Of a few digits, a reading is near its multiple; where the step is not much more than the last digit, that is the
/// step, and the audits tell what the sensor's was.
fn multiples(values: &[f64]) -> Option<(f64, Vec<i32>)> {
    let mut levels: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    levels.sort_unstable_by(f64::total_cmp);
    let sigma = robust_sigma(&levels);
    let even = smallest_step(values);
    let digit = last_digit(&levels);
    let gaps = levels.windows(2).map(|w| w[1] - w[0]);
    let least = gaps
        .filter(|g| *g > 0.5 * digit)
        .fold(f64::INFINITY, f64::min);
    let uneven = (even <= 0.0 && digit > 0.0 && least.is_finite()).then_some([least, digit]);
    let guesses = std::iter::once(even).chain(uneven.into_iter().flatten());
    let enough = guesses.filter(|guess| *guess > 0.0 && guess * FINE >= sigma);
    let step = enough
        .filter_map(|guess| step_near(&levels, guess, digit))
        .next()?;
    let of = |v: &f64| {
        if v.is_finite() {
            (v / step).round() as i32
        } else {
            0
        }
    };
    Some((step, values.iter().map(of).collect()))
}

/// The step near a guess that sorted levels, printed to a last digit, are multiples of.
fn step_near(levels: &[f64], guess: f64, digit: f64) -> Option<f64> {
    let mut levels = levels.to_vec();
    levels.dedup_by(|a, b| (*a - *b).abs() < 0.5 * guess);
    // The smallest distance of two printed readings is a step and twice their last digit: distances of a few steps tell it
    // better, and all of them best.
    let mut step = guess;
    for reach in [2.0, 8.0, 64.0] {
        step = between(&levels, step, reach)?;
    }
    step = of_multiples(&levels, through_zero(&levels, step, digit))?;
    // Half of the last digit, and a little as the step is not known to all of its own.
    let off = 0.55 * digit / step;
    let near = if off < FAR { off.max(NEAR) } else { NEAR };
    let code = |v: f64| (v / step).round();
    let holds = |v: &f64| code(*v).abs() < LARGEST && (v / step - code(*v)).abs() < near;
    if !levels.iter().all(holds) {
        return None;
    }
    // A step that is the last digit is it exactly: what is half-way between two readings hangs on that.
    let whole = (step / digit - 1.0).abs() < 1e-9;
    Some(if whole { digit } else { step })
}

/// The step about one of which levels are multiples best: those between them alone leave open how many lie below the least.
fn through_zero(levels: &[f64], step: f64, digit: f64) -> f64 {
    let span = levels
        .last()
        .zip(levels.first())
        .map_or(0.0, |(b, a)| b - a);
    let apart = digit * step / span.max(step) / f64::from(PLACES);
    let off = |step: f64| -> f64 {
        let of = |v: &f64| (v / step - (v / step).round()).powi(2);
        levels.iter().map(of).sum()
    };
    let all = (-PLACES..=PLACES).map(|k| step + apart * f64::from(k));
    all.min_by(|a, b| off(*a).total_cmp(&off(*b)))
        .unwrap_or(step)
}

/// The last digit of decimal numbers; 0 where they have more of them than a file of few.
fn last_digit(levels: &[f64]) -> f64 {
    let is_of = |place: &f64| {
        let whole = |v: &f64| (v / place - (v / place).round()).abs() < LAST_DIGIT;
        levels.iter().all(whole)
    };
    let mut places = (0..DIGITS).map(|d| 10f64.powi(d).recip());
    places.find(is_of).unwrap_or(0.0)
}

/// The distances between neighbours of up to `reach` steps, over how many steps they are. What a last digit takes off one it adds to
/// the next. None where there are none.
fn between(levels: &[f64], step: f64, reach: f64) -> Option<f64> {
    let distances = levels.windows(2).map(|w| w[1] - w[0]);
    let counted = distances.map(|d| (d, (d / step).round()));
    let near = counted.filter(|(_, steps)| *steps <= reach);
    let (all, steps) = near.fold((0.0, 0.0), |sum, d| (sum.0 + d.0, sum.1 + d.1));
    (steps > 0.0).then(|| all / steps)
}

/// Least squares of the levels, through zero: a multiple of the step is what a reading is. None where all are zero.
fn of_multiples(levels: &[f64], step: f64) -> Option<f64> {
    let [mut products, mut squares] = [0.0; 2];
    for v in levels {
        let code = (v / step).round();
        products += code * v;
        squares += code * code;
    }
    (squares > 0.0).then(|| products / squares)
}

#[cfg(test)]
mod tests {
    use rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    /// Codes of a noisy level.
    fn codes(sigma: f64, level: f64) -> Vec<i32> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
        let mut one = || {
            let z: f64 = StandardNormal.sample(&mut rng);
            (level + sigma * z).round() as i32
        };
        (0..4000).map(|_| one()).collect()
    }

    fn printed(codes: &[i32], step: f64, digits: i32) -> Vec<f64> {
        let place = 10f64.powi(digits);
        let print = |c: &i32| (f64::from(*c) * step * place).round() / place;
        codes.iter().map(print).collect()
    }

    #[test]
    fn codes_come_back_from_what_was_printed() {
        for (sigma, level) in [(0.6, 3.2), (5.0, -41.0), (40.0, 812.0)] {
            let codes = codes(sigma, level);
            for (step, digits) in [
                (0.07326, 4),
                (0.07326, 2),
                (0.0305, 2),
                (0.05, 2),
                (1.0 / 131.0, 6),
                (1.0 / 131.0, 3),
                (0.0175, 9),
            ] {
                let values = printed(&codes, step, digits);
                let (found, back) = multiples(&values)
                    .unwrap_or_else(|| panic!("a grid of {step} to {digits} at {level}"));
                let off = 10f64.powi(-digits) / (level.abs() + 3.0 * sigma);
                assert!(
                    (found - step).abs() < off.max(1e-3 * step),
                    "{found} for {step}"
                );
                assert_eq!(back, codes, "step {step} to {digits} digits at {level}");
            }
        }
    }

    #[test]
    fn a_lost_reading_has_no_code_and_a_far_one_its_own() {
        let mut values = printed(&codes(3.0, 0.0), 0.05, 2);
        (values[7], values[9]) = (f64::NAN, 327.65);
        let (_, back) = multiples(&values).expect("a grid");
        assert_eq!((back[7], back[9]), (0, 6553));
    }

    #[test]
    fn a_gyro_of_coarser_steps_than_its_like_has_their_counts() {
        let gyro = |step: f64| {
            let of = codes(6.0, 0.0);
            let c = of.iter().map(|c| f64::from(*c) * step);
            Channel {
                name: "gyro".into(),
                quantity: Quantity::Gyro,
                axis: None,
                unit: "deg/s".into(),
                lsb: None,
                counts: None,
                values: c.collect(),
            }
        };
        let record = Record {
            channels: vec![gyro(0.02), gyro(0.08), gyro(0.05)],
            ..Record::default()
        };
        let counted = counted(&record);
        let lsb = |i: usize| counted.channels[i].lsb.unwrap();
        for (i, wanted) in [0.02, 0.02, 0.05].into_iter().enumerate() {
            assert!((lsb(i) / wanted - 1.0).abs() < 1e-6, "{i}: {}", lsb(i));
        }
        let counts = counted.channels[1].counts.as_ref().unwrap();
        assert!(counts.iter().all(|c| c % 4 == 0));
    }

    #[test]
    fn a_step_of_several_stated_counts_has_them() {
        for (lsb, coarse, said, wanted) in [
            (1.0 / 131.0, 3, Some("0.0076336"), 3),
            (1.0 / 16.384, 4, Some("0.060976"), 4),
            (1.0 / 131.0, 1, Some("0.0076336"), 1),
            // 1.5 counts, and counts that nobody states.
            (1.5 / 131.0, 1, Some("0.0076336"), 1),
            (1.0 / 131.0, 3, None, 1),
        ] {
            let of = codes(6.0, 0.0).into_iter().map(|c| c * coarse);
            let values = of.map(|c| f64::from(c) * lsb).collect();
            let gyro = Channel {
                name: "gyro".into(),
                quantity: Quantity::Gyro,
                axis: None,
                unit: "deg/s".into(),
                lsb: None,
                counts: None,
                values,
            };
            let mut record = Record {
                channels: vec![gyro],
                ..Record::default()
            };
            let entries = &mut record.header.entries;
            entries.extend(said.map(|said| (SCALE.to_owned(), said.to_owned())));
            let counted = counted(&record);
            let counts = counted.channels[0].counts.as_ref().unwrap();
            assert!(counts.iter().all(|c| c % wanted == 0), "{said:?}");
            assert!(wanted != 1 || counts.iter().any(|c| c % 2 != 0), "{said:?}");
        }
    }

    #[test]
    fn readings_off_a_grid_of_their_own_or_too_fine_have_no_codes() {
        let of = codes(5.0, 0.0);
        let shifted: Vec<f64> = of.iter().map(|c| f64::from(*c) * 0.05 + 0.02).collect();
        assert!(multiples(&shifted).is_none(), "an offset was taken off");
        let bent: Vec<f64> = of.iter().map(|c| (0.1 * f64::from(*c)).sinh()).collect();
        assert!(multiples(&bent).is_none(), "no two steps are alike");
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        let noise: Vec<f64> = (0..4000).map(|_| StandardNormal.sample(&mut rng)).collect();
        assert!(multiples(&noise).is_none(), "no grid");
        assert!(multiples(&printed(&of, 1.0, 0)[..1]).is_none());
        let digits: Vec<f64> = noise.iter().map(|v| (v * 1e4f64).round() / 1e4).collect();
        assert!(multiples(&digits).is_none(), "the last digit of a number");
    }
}
