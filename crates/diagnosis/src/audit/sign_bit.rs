//! A bit far above the noise that never changes, though the sign does.
//!
//! In two's complement all bits above the size of the readings are the sign. One of them that sticks moves the readings
//! of one sign by 2^b and makes two levels of one. What it should read is known from the sign, so the readings are
//! mended before anything else is asked of the record.

use std::borrow::Cow;

use model::Parameter;
use model::effects;
use model::record::{Quantity, Record};

use super::LEAST_READINGS;
use crate::result::Finding;
use numerics::order_statistics::median;

/// Bits of the gyros' words; the last one is the sign.
const WORD: u32 = 14;
/// Fewest readings of each sign.
const LEAST_OF_A_SIGN: usize = 20;

/// The counts as they would be if bit `bit` followed the sign; `None` where it does not stick or is no copy of the sign.
fn mended(counts: &[i32], known: &[bool], bit: u32) -> Option<(u8, Vec<i32>)> {
    let readings = || {
        counts
            .iter()
            .zip(known)
            .filter(|(_, k)| **k)
            .map(|(c, _)| *c)
    };
    let weight = 1i32 << bit;
    let value = (readings().next()? >> bit) & 1;
    if readings().any(|c| (c >> bit) & 1 != value) {
        return None;
    }
    // Of the sign bit itself the next one tells.
    let sign = if bit + 1 == WORD { bit - 1 } else { WORD - 1 };
    let negative = |c: i32| (c >> sign) & 1 == 1;
    let below = readings().filter(|c| negative(*c)).count();
    let above = readings().count() - below;
    if below < LEAST_OF_A_SIGN || above < LEAST_OF_A_SIGN {
        return None;
    }
    let true_of = |c: i32| {
        let word = (c & !weight) | if negative(c) { weight } else { 0 };
        if bit + 1 == WORD {
            // Extend the sign over the word's end.
            (word << (32 - WORD)) >> (32 - WORD)
        } else {
            word
        }
    };
    // The bit is a copy of the sign only where no reading is larger than it; the sign's own copy, the next one, too.
    let largest = if bit + 1 == WORD { weight / 4 } else { weight };
    if readings().any(|c| !(-largest..largest).contains(&true_of(c))) {
        return None;
    }
    let right: Vec<i32> = counts.iter().map(|c| true_of(*c)).collect();
    joins(counts, &right, known, sign).then(|| (u8::from(value == 1), right))
}

/// Whether the readings, put right, pass from one sign to the other by steps like all others, and often: a base that
/// turns to and fro has two levels all the same.
fn joins(counts: &[i32], right: &[i32], known: &[bool], sign: u32) -> bool {
    const LIKE: f64 = 4.0;
    let (mut across, mut within) = (vec![], vec![]);
    for i in (1..right.len()).filter(|i| known[*i] && known[i - 1]) {
        let step = f64::from((right[i] - right[i - 1]).abs());
        if ((counts[i] ^ counts[i - 1]) >> sign) & 1 == 1 {
            across.push(step);
        } else {
            within.push(step);
        }
    }
    across.len() >= LEAST_OF_A_SIGN && median(&across) <= LIKE * median(&within) + LIKE
}

/// The record with the readings of such bits put right, and the findings.
#[must_use]
pub fn mend(record: &Record) -> (Cow<'_, Record>, Vec<Finding>) {
    let mut whole = Cow::Borrowed(record);
    let mut findings = vec![];
    for (i, channel) in record.channels.iter().enumerate() {
        let (Quantity::Gyro, Some(counts), Some(lsb)) =
            (channel.quantity, &channel.counts, channel.lsb)
        else {
            continue;
        };
        let known: Vec<bool> = channel.values.iter().map(|v| v.is_finite()).collect();
        if counts.len() != known.len() || known.iter().filter(|k| **k).count() < LEAST_READINGS {
            continue;
        }
        // The highest that fits: of those below it a sound one is a copy of the sign that does change.
        let Some((bit, (value, right))) = (5..WORD)
            .rev()
            .find_map(|b| mended(counts, &known, b).map(|m| (b, m)))
        else {
            continue;
        };
        let own = &mut whole.to_mut().channels[i];
        for (v, (was, is)) in own.values.iter_mut().zip(counts.iter().zip(&right)) {
            *v += lsb * f64::from(is - was);
        }
        own.counts = Some(right);
        let exact = |name: &str, v: f64| (name.to_owned(), Parameter::exact(v, "1"));
        findings.push(Finding {
            cause: effects::stuck_bit::ID.into(),
            channels: vec![channel.name.clone()],
            what: format!(
                "bit {bit} of {} reads {value} throughout, though the sign of the readings changes; above their size every bit is the sign, and what follows is of the readings with that bit put right",
                channel.name
            ),
            parameters: [
                exact("bit", f64::from(bit)),
                exact("value", f64::from(value)),
                exact("fraction", 1.0),
            ]
            .into(),
            ..Finding::default()
        });
    }
    (whole, findings)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Readings about zero through a word in which `bit` is held at `value`.
    fn through(bit: u32, value: i32) -> (Vec<i32>, Vec<i32>) {
        let sound: Vec<i32> = (0..400).map(|i| (i * 37) % 61 - 30).collect();
        let held = sound
            .iter()
            .map(|c| {
                let word = (c & !(1 << bit)) | value << bit;
                (word << (32 - WORD)) >> (32 - WORD)
            })
            .collect();
        (sound, held)
    }

    #[test]
    fn any_bit_above_the_readings_is_told_from_the_sign_and_put_right() {
        for bit in 5..WORD {
            for value in [0, 1] {
                let (sound, held) = through(bit, value);
                let found = (5..WORD)
                    .rev()
                    .find_map(|b| mended(&held, &[true; 400], b).map(|m| (b, m)));
                let (at, (told, right)) = found.expect("it sticks");
                assert_eq!((at, i32::from(told), right), (bit, value, sound));
            }
        }
    }

    #[test]
    fn sound_readings_of_one_sign_or_of_both_stay_as_they_are() {
        let (sound, _) = through(5, 0);
        let one_sign: Vec<i32> = sound.iter().map(|c| c + 40).collect();
        for counts in [sound, one_sign] {
            assert!((5..WORD).all(|b| mended(&counts, &[true; 400], b).is_none()));
        }
    }

    #[test]
    fn a_base_that_turns_to_and_fro_has_two_levels_by_itself() {
        // -600 +- 30 and 20 +- 15 counts: bit 9 reads 0 throughout.
        let turned: Vec<i32> = (0..4000)
            .map(|i| {
                if i / 50 % 2 == 0 {
                    -600 + (i * 37) % 61 - 30
                } else {
                    20 + (i * 37) % 31 - 15
                }
            })
            .map(|c| if c < 0 && c > -500 { 0 } else { c })
            .collect();
        assert!((5..WORD).all(|b| mended(&turned, &[true; 4000], b).is_none()));
    }
}
