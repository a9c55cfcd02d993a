//! A gyro that is no measurement: no readings, the same one throughout, or none that is ever new. The others are
//! diagnosed without it.

use std::borrow::Cow;

use model::record::{Channel, Quantity, Record, flag};

use crate::ingest::grid::LEAST_SAMPLES;
use crate::test_level::Observation;
use model::record::AnalysisError;

/// Readings that are there and, where there are flags, new.
fn new_readings(record: &Record, c: &Channel) -> usize {
    let flags = record.flags.as_ref().filter(|f| f.len() == c.values.len());
    let bit = c.axis.map(|a| flag::NEW_DATA_X << a.index());
    let is_new = |i: usize| match (flags, bit) {
        (Some(flags), Some(bit)) => flags[i] & bit != 0,
        _ => true,
    };
    (0..c.values.len())
        .filter(|i| c.values[*i].is_finite() && is_new(*i))
        .count()
}

fn bit_of(c: &Channel) -> usize {
    c.axis.map_or(0, model::record::Axis::index)
}

/// Why a channel is no measurement.
fn why(record: &Record, channel: &Channel) -> Option<String> {
    let values = &channel.values;
    let known: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    if known.len() < LEAST_SAMPLES {
        return Some(format!(
            "{} readings, of which {LEAST_SAMPLES} are needed",
            known.len()
        ));
    }
    let new = new_readings(record, channel);
    if new == 0 {
        return Some(format!(
            "is never flagged as new (bit {} of `flags`): what it reads is old, or the column is not filled",
            bit_of(channel)
        ));
    }
    if new < LEAST_SAMPLES {
        return Some(format!(
            "{new} readings are flagged as new, of which {LEAST_SAMPLES} are needed"
        ));
    }
    known.iter().all(|v| *v == known[0]).then(|| {
        format!(
            "reads {:.4} throughout: a sensor at rest has noise, so this is no measurement",
            known[0]
        )
    })
}

/// The record without its dead gyros, and what is to be said of them. Where none is left alive the record stays as it
/// is, for the error that names the first.
///
/// # Errors
/// [`AnalysisError::NeverNew`] where none is left alive because the flags say that nothing is new.
pub fn left_out(record: &Record) -> Result<(Cow<'_, Record>, Vec<Observation>), AnalysisError> {
    let dead: Vec<Observation> = record
        .all(Quantity::Gyro)
        .filter_map(|c| {
            let why = why(record, c)?;
            Some(Observation::of_readings(
                &c.name,
                format!("{why}; it is left out"),
            ))
        })
        .collect();
    let gyros = record.all(Quantity::Gyro).count();
    if dead.is_empty() || dead.len() == gyros {
        let old =
            |c: &&Channel| c.values.iter().any(|v| v.is_finite()) && new_readings(record, c) == 0;
        if let Some(c) = record
            .all(Quantity::Gyro)
            .find(old)
            .filter(|_| !dead.is_empty())
        {
            return Err(AnalysisError::NeverNew {
                name: c.name.clone(),
                bit: bit_of(c),
            });
        }
        return Ok((Cow::Borrowed(record), vec![]));
    }
    let mut rest = record.clone();
    rest.channels
        .retain(|c| dead.iter().all(|d| d.channel != c.name));
    Ok((Cow::Owned(rest), dead))
}

#[cfg(test)]
mod tests {
    use super::*;
    use model::ModelFile;

    #[test]
    fn a_gyro_that_never_changes_and_an_empty_one_leave_the_third_to_be_diagnosed() {
        let mut record = model::simulate(&ModelFile::paper(), 60.0, 20.0, 1).expect("simulated");
        let mut gyros = record
            .channels
            .iter_mut()
            .filter(|c| c.quantity == Quantity::Gyro);
        let (first, second) = (gyros.next().expect("x"), gyros.next().expect("y"));
        first.values.fill(0.25);
        second.values.fill(f64::NAN);
        let (rest, told) = left_out(&record).expect("one is left");
        assert_eq!(rest.all(Quantity::Gyro).count(), 1);
        let words: Vec<&str> = told.iter().map(|u| u.what.as_str()).collect();
        assert!(
            words[0].starts_with("reads 0.2500 throughout") && words[1].starts_with("0 readings")
        );
        let found =
            crate::diagnose(&record, &crate::DiagnoseOptions::default()).expect("one is left");
        assert_eq!(found.diagnosis.unexplained.len(), 2);
    }

    #[test]
    fn with_no_gyro_alive_the_error_names_the_first() {
        let mut record = model::simulate(&ModelFile::paper(), 60.0, 20.0, 1).expect("simulated");
        for c in &mut record.channels {
            c.values.fill(1.0);
        }
        assert!(left_out(&record).is_ok_and(|left| left.1.is_empty()));
        let error = crate::diagnose(&record, &crate::DiagnoseOptions::default()).err();
        assert!(error.is_some_and(|e| e.to_string().contains("gyro_x reads 1")));
    }
}
