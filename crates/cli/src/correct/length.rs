//! How long a record has to be for its correction to come near what the noise alone leaves.
//!
//! A coefficient's standard error e falls as the root of the record's length: what moves the bias goes on, and so does the walk
//! that hides it. Over a span the coefficient makes the angle error e A, with A the angle that its channel makes in this record
//! behind its rest. What it is held against is what the record's own noise leaves, and most of that over a long span is one number,
//! the error b of the bias: in some records b is small by chance. So e has to be small beside b as it is in most records, not
//! beside its rms alone: [`chance_near`].

use std::fmt::{Display, Formatter};

use model::record::Record;
use numerics::tails::upper_normal;
use serde::Serialize;

use super::judge::SPANS_S;
use super::noise::Noise;

/// The corrected rates' angle error over that which the noise alone leaves, at the most.
pub const NEAR: f64 = 1.15;
/// Share of the records in which they are to stay below that.
const SHARE: f64 = 0.9;
/// Over so many standard deviations of the bias its chance is summed up, in so many steps: the tail beyond is 2e-9.
const REACH: f64 = 6.0;
const STEPS: u32 = 600;
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

impl Display for Needed {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{} on {} is so unsure that the corrected rates would be off by {} deg over {:.0} s, where the noise alone leaves {}",
            self.cause,
            self.channel,
            short(self.expected_deg),
            self.span_s,
            short(self.floor_deg),
        )
    }
}

/// Three digits.
#[must_use]
pub fn short(value: f64) -> String {
    let digits = if value >= 100.0 {
        0
    } else if value >= 10.0 {
        1
    } else {
        2
    };
    format!("{value:.digits$}")
}

/// Variances of what an angle error over a span consists of, in any unit.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Parts {
    /// What all spans of a record share: the error of the bias, and its walk.
    shared: f64,
    /// What each span has of its own.
    own: f64,
    /// The errors of coefficients, which all spans share too.
    unsure: f64,
}

/// The chance that coefficients so unsure leave a record's angle error within [`NEAR`] times what its noise alone leaves: that
/// (b + s)^2 + own <= NEAR^2 (b^2 + own), where b is normal of variance `shared`, and s of variance `unsure`.
fn chance_near(parts: Parts) -> f64 {
    let Parts {
        shared,
        own,
        unsure,
    } = parts;
    let (b_rms, s_rms) = (shared.sqrt(), unsure.sqrt());
    if s_rms == 0.0 {
        return 1.0;
    }
    let step = REACH / f64::from(STEPS);
    let (mut sum, mut weights) = (0.0, 0.0);
    // b and -b have the same chance.
    for n in 0..STEPS {
        let z = (f64::from(n) + 0.5) * step;
        let (weight, b) = ((-z * z / 2.0).exp(), z * b_rms);
        let most = (NEAR.powi(2) * b * b + (NEAR.powi(2) - 1.0) * own).sqrt();
        sum += weight * (upper_normal((-most - b) / s_rms) - upper_normal((most - b) / s_rms));
        weights += weight;
    }
    sum / weights
}

/// By how much longer a record with such parts has to be for [`SHARE`] of the records to be near: `unsure` falls as the inverse of it.
fn times_longer(parts: Parts) -> f64 {
    let is_near = |times: f64| {
        let unsure = parts.unsure / times;
        chance_near(Parts { unsure, ..parts }) >= SHARE
    };
    // Halving of powers of 2; beyond a million nobody records.
    let [mut low, mut high] = [0.0_f64, 20.0];
    if is_near(low.exp2()) {
        return 1.0;
    }
    for _ in 0..30 {
        let middle = low.midpoint(high);
        if is_near(middle.exp2()) {
            high = middle;
        } else {
            low = middle;
        }
    }
    high.exp2()
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
        let unsure: f64 = uncertain.iter().map(|(_, square)| square).sum();
        let (worst, _) = uncertain.into_iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
        let own = noise.white(span_s);
        let times = times_longer(Parts {
            shared: floor - own,
            own,
            unsure,
        });
        (times > 1.0).then(|| Needed {
            seconds: (has_s * times / ROUND_S).ceil() * ROUND_S,
            cause: worst.cause.clone(),
            channel,
            span_s,
            expected_deg: (floor + unsure).sqrt(),
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
    use std::f64::consts::PI;

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
    fn a_coefficient_beside_one_number_is_near_as_often_as_a_quotient_of_two_normals_says() {
        // Without what each span has of its own, s / b is Cauchy: the chance of -1 - NEAR <= s / b <= NEAR - 1.
        for r in [0.02_f64, 0.05, 0.2, 1.0] {
            let parts = Parts {
                shared: 3.0,
                own: 0.0,
                unsure: 3.0 * r * r,
            };
            let exact = (((NEAR - 1.0) / r).atan() + ((NEAR + 1.0) / r).atan()) / PI;
            assert!((chance_near(parts) - exact).abs() < 1e-3, "{r}: {exact}");
        }
        // Without a bias, (NEAR^2 - 1) own holds s: 1.645 standard errors, nine of ten.
        let parts = Parts {
            shared: 0.0,
            own: 1.0,
            unsure: (NEAR.powi(2) - 1.0) / 1.644_854_f64.powi(2),
        };
        assert!((chance_near(parts) - 0.9).abs() < 1e-6);
        let four = Parts {
            unsure: 4.0 * parts.unsure,
            ..parts
        };
        assert!((times_longer(four) - 4.0).abs() < 1e-3);
    }

    #[test]
    fn an_unsure_slope_needs_as_much_as_brings_nine_of_ten_within_what_their_own_noise_leaves() {
        // 5 degC times 0.004 deg/s/degC for 600 s are 12 deg; white noise and a mean over 60 s of it leave
        // sqrt(0.01 * 600 + 0.01 / 60 * 600^2) = 8.124 deg.
        let needed = needed(&record(5.0), &noise(0.004), [60.0, 1200.0]).expect("more");
        assert_eq!(
            (needed.cause.as_str(), needed.channel),
            ("temperature", "gyro_z")
        );
        assert!((needed.floor_deg - 66f64.sqrt()).abs() < 1e-9);
        assert!((needed.expected_deg - (66.0_f64 + 144.0).sqrt()).abs() < 1e-9);
        let times = times_longer(Parts {
            shared: 60.0,
            own: 6.0,
            unsure: 144.0,
        });
        assert_eq!(needed.span_s, 600.0);
        assert!(
            (0.0..60.0).contains(&(needed.seconds - 600.0 * times)),
            "{needed:?}"
        );
    }
}
