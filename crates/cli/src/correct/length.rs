//! How long a record has to be for its correction to come near what the noise alone leaves.
//!
//! A coefficient's standard error e falls as the root of the record's length: what moves the bias, the temperature above all,
//! goes on, and so does the walk that hides it. Over a span the coefficient makes the angle error e A, with A the angle that its
//! channel makes in this record behind its rest. With L^2 of the noise, the corrected rates stay within [`NEAR`] L in
//! nine of ten records where (1.645 e A)^2 <= (NEAR^2 - 1) L^2.

use model::record::Record;
use serde::Serialize;

use super::judge::SPANS_S;
use super::noise::Noise;

/// The corrected rates' angle error over that which the noise alone leaves, at the most.
pub const NEAR: f64 = 1.15;
/// Standard errors that hold nine of ten.
const NORMAL_90: f64 = 1.645;
/// Lengths are whole minutes, s.
const ROUND_S: f64 = 60.0;

/// What a record is too short for.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Needed {
    /// Length that would do, s.
    pub seconds: f64,
    /// The coefficient that wants it: id of its effect.
    pub cause: String,
    /// gyro_x, ...
    pub channel: &'static str,
    /// Over this span, s.
    pub span_s: f64,
    /// The angle error that the correction by this record is to leave, deg.
    pub expected_deg: f64,
    /// Of the noise alone, deg.
    pub floor_deg: f64,
}

/// The length that a record needs, if it needs more than it has: `rest_s` of it are the rest, and the correction is judged
/// behind a rest as long, over spans of up to half of `behind_s`.
#[must_use]
pub fn needed(record: &Record, noise: &[Noise; 3], [rest_s, behind_s]: [f64; 2]) -> Option<Needed> {
    let rate_hz = record.header.rate_hz?;
    let (rest, has_s) = ((rest_s * rate_hz) as usize, record.len() as f64 / rate_hz);
    let channels = ["gyro_x", "gyro_y", "gyro_z"];
    let spans = SPANS_S.into_iter().filter(|span| 2.0 * span <= behind_s);
    let of = |(noise, channel): (&Noise, &'static str), span_s: f64| {
        let floor = noise.floor(noise.of_a_mean(rest_s), [span_s, behind_s]);
        let uncertain: Vec<_> = noise.uncertain(record, rest, span_s).collect();
        let sum: f64 = uncertain.iter().map(|(_, square)| square).sum();
        let (worst, _) = uncertain.into_iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
        let times = NORMAL_90.powi(2) * sum / ((NEAR.powi(2) - 1.0) * floor);
        (times > 1.0).then(|| Needed {
            seconds: (has_s * times / ROUND_S).ceil() * ROUND_S,
            cause: worst.cause.clone(),
            channel,
            span_s,
            expected_deg: (floor + sum).sqrt(),
            floor_deg: floor.sqrt(),
        })
    };
    let all = spans.flat_map(|span| {
        let axes = noise.iter().zip(channels);
        axes.filter_map(move |axis| of(axis, span))
            .collect::<Vec<_>>()
    });
    all.max_by(|a, b| a.seconds.total_cmp(&b.seconds))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::correct::Uncertain;
    use model::record::{Channel, Header, Quantity};

    /// 600 s at 20 Hz: a temperature that stands still for 60 s and is `rise` degC higher from there on.
    fn record(rise: f64) -> Record {
        let values = (0..12_000).map(|row| if row < 1200 { 0.0 } else { rise });
        Record {
            header: Header {
                rate_hz: Some(20.0),
                ..Header::default()
            },
            channels: vec![Channel {
                name: "temp_z".to_owned(),
                quantity: Quantity::Temp,
                axis: None,
                unit: "degC".to_owned(),
                values: values.collect(),
                counts: None,
                lsb: None,
            }],
            ..Record::default()
        }
    }

    fn noise(error: f64) -> [Noise; 3] {
        let mut all: [Noise; 3] = Default::default();
        for noise in &mut all {
            noise.n = 0.1;
        }
        all[2].uncertain.push(Uncertain {
            cause: "temperature".to_owned(),
            error,
            channel: "temp_z".to_owned(),
        });
        all
    }

    #[test]
    fn a_slope_that_is_sure_enough_needs_no_more() {
        assert_eq!(needed(&record(5.0), &noise(1e-6), [60.0, 1200.0]), None);
        assert_eq!(needed(&record(0.0), &noise(1.0), [60.0, 1200.0]), None);
    }

    #[test]
    fn an_unsure_slope_needs_as_much_as_brings_nine_of_ten_within_the_limit() {
        // 5 degC times 0.004 deg/s/degC for 600 s are 12 deg; white noise and a mean over 60 s of it leave
        // sqrt(0.01 * 600 + 0.01 / 60 * 600^2) = 8.124 deg.
        let needed = needed(&record(5.0), &noise(0.004), [60.0, 1200.0]).expect("more");
        assert_eq!(
            (needed.cause.as_str(), needed.channel),
            ("temperature", "gyro_z")
        );
        assert!((needed.floor_deg - 66f64.sqrt()).abs() < 1e-9);
        assert!((needed.expected_deg - (66.0_f64 + 144.0).sqrt()).abs() < 1e-9);
        let times = 1.645f64.powi(2) * 144.0 / (0.3225 * 66.0);
        assert_eq!(needed.span_s, 600.0);
        assert!(
            (0.0..60.0).contains(&(needed.seconds - 600.0 * times)),
            "{needed:?}"
        );
    }
}
