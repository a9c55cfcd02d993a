//! Steps of channels in a file that has one scale for all gyros, and one for all accelerometers.
//!
//! A capture's columns are counts of `gyro_lsb_dps` and of `acc_counts_per_g`. Where channels step differently, their counts are
//! those of one common step, fine enough for all; `gyro_x_step_dps` and its kin say by which step a channel really moves. A reader
//! that does not know these keys has the rates right; one that does has the codes, too.

use std::borrow::Cow;

use model::record::{Channel, Quantity, Record};

use super::STANDARD_GRAVITY;

/// Counts of a file stay below: docs/capture.md.
pub(super) const LARGEST_COUNT: f64 = 1e9;
/// The finest step is cut in as many at most, for all steps to be whole numbers of parts.
const MOST_PARTS: u32 = 64;
/// Where none are whole, a step that is nothing beside any noise, deg/s and m/s^2, and parts of the finest one at least: half a
/// part is too little to be taken for another code.
const FINE: f64 = 1e-6;
const PARTS: f64 = 4.0;
/// Part of a step by which the largest value may be off where steps are estimates of one, which differ in their last digits.
const OFF: f64 = 1e-3;
/// Parts are whole that are off by less of themselves.
const EQUAL: f64 = 1e-9;

/// What columns of a kind have in common: their scale's key, their own step's ending and its unit here.
struct Kind {
    quantity: Quantity,
    ending: &'static str,
}

const KINDS: [Kind; 2] = [
    Kind {
        quantity: Quantity::Gyro,
        ending: "_step_dps",
    },
    Kind {
        quantity: Quantity::Acc,
        ending: "_step_m_s2",
    },
];

impl Kind {
    /// The step and the zero of a file's counts, by a header.
    fn scale(&self, record: &Record) -> Option<(f64, f64)> {
        let number = |key: &str| entry(record, key)?.parse::<f64>().ok();
        match self.quantity {
            Quantity::Gyro => Some((number("gyro_lsb_dps")?, 0.0)),
            _ => Some((
                STANDARD_GRAVITY / number("acc_counts_per_g")?,
                number("acc_zero_counts")?,
            )),
        }
    }

    /// States a step of the counts in a header.
    fn state(&self, record: &mut Record, step: f64) {
        match self.quantity {
            Quantity::Gyro => put(record, "gyro_lsb_dps", step),
            _ => put(record, "acc_counts_per_g", STANDARD_GRAVITY / step),
        }
    }

    fn has(&self, c: &Channel) -> bool {
        c.quantity == self.quantity && c.axis.is_some()
    }
}

fn entry<'a>(record: &'a Record, key: &str) -> Option<&'a str> {
    let entries = record.header.entries.iter().rev();
    let mut found = entries.filter(|(k, _)| k == key);
    found.next().map(|(_, value)| value.as_str())
}

fn put(record: &mut Record, key: &str, value: f64) {
    let entries = &mut record.header.entries;
    match entries.iter_mut().find(|(k, _)| k == key) {
        Some((_, old)) => *old = value.to_string(),
        None => entries.push((key.to_owned(), value.to_string())),
    }
}

/// The record as a file can hold it: all gyros in counts of one step, and all accelerometers.
pub(crate) fn in_one_step(record: &Record) -> Cow<'_, Record> {
    let mut out = Cow::Borrowed(record);
    for kind in &KINDS {
        let Some((stated, zero)) = kind.scale(record) else {
            continue;
        };
        let own: Vec<&Channel> = record.channels.iter().filter(|c| kind.has(c)).collect();
        let steps: Option<Vec<f64>> = own.iter().map(|c| c.lsb).collect();
        let Some(steps) = steps.filter(|steps| !steps.is_empty()) else {
            continue;
        };
        let largest = largest(&own);
        let off = |s: &f64| (s / stated - 1.0).abs() * (largest / stated).max(1.0);
        let fits = steps.iter().all(|s| off(s) < OFF)
            && own.iter().all(|c| c.counts.is_some())
            && largest / stated < LARGEST_COUNT;
        if fits {
            continue;
        }
        let step = common(&steps, largest);
        let out = out.to_mut();
        kind.state(out, step);
        for c in &mut record_channels(out, kind) {
            let count = |v: &f64| (v / step + zero).round() as i32;
            c.counts = Some(c.values.iter().map(count).collect());
        }
        for (c, own) in own.iter().zip(steps) {
            // What is finer than the file's step is lost, and far below any noise.
            if own > 2.0 * step * (1.0 - EQUAL) {
                put(out, &format!("{}{}", c.name, kind.ending), own);
            }
        }
    }
    out
}

fn record_channels<'a>(record: &'a mut Record, kind: &Kind) -> Vec<&'a mut Channel> {
    let channels = record.channels.iter_mut();
    channels.filter(|c| kind.has(c)).collect()
}

fn largest(channels: &[&Channel]) -> f64 {
    let values = channels.iter().flat_map(|c| &c.values);
    values
        .filter(|v| v.is_finite())
        .fold(0.0, |most: f64, v| most.max(v.abs()))
}

/// A step of which all others are whole numbers, or which is much finer; as coarse as the largest value needs.
fn common(steps: &[f64], largest: f64) -> f64 {
    let finest = steps.iter().copied().fold(f64::INFINITY, f64::min);
    let coarsest = 1.01 * largest / LARGEST_COUNT;
    let whole = |step: f64| {
        let mut parts = steps.iter().map(|s| s / step);
        parts.all(|parts| (parts - parts.round()).abs() < EQUAL * parts)
    };
    let parts = (1..=MOST_PARTS).map(|m| finest / f64::from(m));
    let found = parts.take_while(|s| *s > coarsest).find(|s| whole(*s));
    found.unwrap_or(FINE.min(finest / PARTS)).max(coarsest)
}

/// The codes of channels whose own step the header states.
pub(super) fn own_steps(record: &mut Record) {
    for kind in &KINDS {
        let stated = |c: &Channel| -> Option<f64> {
            let key = format!("{}{}", c.name, kind.ending);
            let step = entry(record, &key)?.parse::<f64>().ok()?;
            (step > 0.0 && step.is_finite()).then_some(step)
        };
        let steps: Vec<Option<f64>> = record.channels.iter().map(stated).collect();
        for (c, step) in record.channels.iter_mut().zip(steps) {
            let (Some(step), true) = (step, kind.has(c) && c.counts.is_some()) else {
                continue;
            };
            let codes: Vec<f64> = c.values.iter().map(|v| (v / step).round()).collect();
            c.values = codes.iter().map(|k| k * step).collect();
            // Codes of an accelerometer's own step have a zero that nobody states.
            let counts = || codes.iter().map(|k| *k as i32).collect();
            c.counts = (kind.quantity == Quantity::Gyro).then(counts);
            c.lsb = Some(step);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_have_a_common_one_that_fits() {
        // Whole numbers of the finest; of a half of it; of none: then far below any noise.
        assert_eq!(common(&[0.0076, 1e-6], 30.0), 1e-6);
        assert_eq!(common(&[1.0, 0.01, 0.001], 30.0), 0.001);
        assert!((common(&[0.1, 0.15], 30.0) - 0.05).abs() < 1e-12);
        assert_eq!(common(&[0.01, 0.0123456789], 30.0), 1e-6);
        // Counts are below 1e9.
        let step = common(&[1e-6, 0.061], 2000.0);
        assert!(2000.0 / step < LARGEST_COUNT && step < 3e-6, "{step}");
    }
}
