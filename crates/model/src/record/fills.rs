//! Numbers that stand where there is no reading.

use std::borrow::Cow;

use super::Record;

/// What no sensor reads in any unit: fill values of file formats (1e20, NetCDF's 9.97e36, the largest number), wrecked ones.
const BEYOND: f64 = 1e20;

/// The record with such numbers as missing readings, which a note counts by channel.
#[must_use]
pub fn left_out(record: Cow<'_, Record>) -> Cow<'_, Record> {
    let is_fill = |v: &f64| v.abs() >= BEYOND;
    let any = (record.channels.iter()).any(|c| c.values.iter().any(is_fill));
    if !any {
        return record;
    }
    let mut record = record.into_owned();
    for channel in &mut record.channels {
        let (mut count, mut largest) = (0, 0.0f64);
        for v in channel.values.iter_mut().filter(|v| is_fill(v)) {
            if v.abs() > largest.abs() {
                largest = *v;
            }
            count += 1;
            *v = f64::NAN;
        }
        if count > 0 {
            let name = &channel.name;
            record.notes.push(format!(
                "{name}: {count} x a number that no sensor reads ({largest:e} {}): taken as no reading",
                channel.unit
            ));
        }
    }
    Cow::Owned(record)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::{Channel, Quantity};

    #[test]
    fn a_fill_value_is_no_reading_and_is_told() {
        let record = |values: Vec<f64>| Record {
            channels: vec![Channel {
                name: "gyro_x".into(),
                quantity: Quantity::Gyro,
                axis: None,
                unit: "deg/s".into(),
                values,
                counts: None,
                lsb: None,
            }],
            ..Record::default()
        };
        let whole = record(vec![1.0, -9e19, f64::NAN]);
        assert!(matches!(left_out(Cow::Borrowed(&whole)), Cow::Borrowed(_)));
        let filled = record(vec![1.0, 1e300, f64::NEG_INFINITY, -1e20]);
        let left = left_out(Cow::Owned(filled));
        let [first, others @ ..] = &*left.channels[0].values else {
            panic!("no reading");
        };
        assert!(*first == 1.0 && others.iter().all(|v| v.is_nan()));
        let told = "gyro_x: 3 x a number that no sensor reads (-inf deg/s): taken as no reading";
        assert_eq!(left.notes, [told]);
    }
}
