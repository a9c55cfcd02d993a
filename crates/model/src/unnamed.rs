//! What a record has and no effect of the library makes: a term of its domain, with a size and without a name.
//!
//! | domain | columns | what a simulation adds |
//! |---|---|---|
//! | `mean` | `time` s, `level` | a level that goes straight from knot to knot |
//! | `channel` | `at` in the unit of the channel followed, `level` | the same over what that channel reads |
//! | `spectrum` | `center` Hz, `width` Hz, `size` | a noise for each: a Lorentzian of that full width at half power |
//! | the same with `refines` | | a tone of steady size that visits each bump for its share of the time |
//! | `lag` | `lag` s, `size`, `weight` 1 | white noise and `weight` times the same that much later, of that size together |
//! | `variance` | `time` s or `at`, `factor` | white variance times a factor, whose logarithm goes straight from knot to knot |
//! | `cross` | `correlation` | white noise that two axes share |
//! | `codes` | `skewness`, `excess_kurtosis` | the shape of the distribution of the white noise |

use crate::parameter::Parameter;
use crate::range::{self, Range};

/// Least and greatest skewness that a simulation has a distribution for.
pub const SKEWNESS_LIMITS: [f64; 2] = [-3.0, 3.0];
/// The same of the excess kurtosis.
pub const EXCESS_KURTOSIS_LIMITS: [f64; 2] = [-0.7, 100.0];

/// Knots or bumps of one term: no fit asks for more.
pub(crate) const MOST_KNOTS: usize = 10_000;

/// What a term is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Domain {
    /// The mean over time.
    Mean,
    /// The mean over a recorded channel.
    Channel,
    /// The spectrum of the noise.
    Spectrum,
    /// Noise that comes again.
    Lag,
    /// The variance of the white noise over time or over a recorded channel.
    Variance,
    /// What two axes share.
    Cross,
    /// The distribution of the readings.
    Codes,
}

/// A column of numbers that a domain has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColumnSpec {
    /// Its name.
    pub name: &'static str,
    /// Its unit on a gyro in deg/s; none where it is that of the channel followed.
    pub unit: Option<&'static str>,
    /// What it may hold.
    pub(crate) range: Range,
    /// Whether it rises from each number to the next.
    pub(crate) rises: bool,
}

const fn column(name: &'static str, unit: Option<&'static str>, range: Range) -> ColumnSpec {
    let rises = matches!(name.as_bytes(), b"time" | b"at");
    ColumnSpec {
        name,
        unit,
        range,
        rises,
    }
}

impl Domain {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Mean,
        Self::Channel,
        Self::Spectrum,
        Self::Lag,
        Self::Variance,
        Self::Cross,
        Self::Codes,
    ];

    /// As the model file has it.
    #[must_use]
    pub fn id(self) -> &'static str {
        match self {
            Self::Mean => "mean",
            Self::Channel => "channel",
            Self::Spectrum => "spectrum",
            Self::Lag => "lag",
            Self::Variance => "variance",
            Self::Cross => "cross",
            Self::Codes => "codes",
        }
    }

    /// Its columns; what is over time is over a channel where one is followed.
    #[must_use]
    pub fn columns(self, follows: bool) -> &'static [ColumnSpec] {
        const LEVEL: ColumnSpec = column("level", Some("deg/s"), range::ANY);
        const TIME: ColumnSpec = column("time", Some("s"), range::ANY);
        const AT: ColumnSpec = column("at", None, range::ANY);
        const FACTOR: ColumnSpec = column("factor", Some("1"), range::POSITIVE);
        const SPECTRUM: &[ColumnSpec] = &[
            column("center", Some("Hz"), range::SIZE),
            column("width", Some("Hz"), range::POSITIVE),
            column("size", Some("deg/s"), range::SIZE),
        ];
        const LAG: &[ColumnSpec] = &[
            column("lag", Some("s"), range::POSITIVE),
            column("size", Some("deg/s"), range::SIZE),
            column("weight", Some("1"), range::WEIGHT),
        ];
        const CODES: &[ColumnSpec] = &[
            column("skewness", Some("1"), range::SKEWNESS),
            column("excess_kurtosis", Some("1"), range::EXCESS_KURTOSIS),
        ];
        const MEAN: &[ColumnSpec] = &[TIME, LEVEL];
        const CHANNEL: &[ColumnSpec] = &[AT, LEVEL];
        const OVER_TIME: &[ColumnSpec] = &[TIME, FACTOR];
        const OVER_CHANNEL: &[ColumnSpec] = &[AT, FACTOR];
        const CROSS: &[ColumnSpec] = &[column("correlation", Some("1"), range::CORRELATION)];
        match (self, follows) {
            (Self::Mean, _) => MEAN,
            (Self::Channel, _) => CHANNEL,
            (Self::Spectrum, _) => SPECTRUM,
            (Self::Lag, _) => LAG,
            (Self::Variance, false) => OVER_TIME,
            (Self::Variance, true) => OVER_CHANNEL,
            (Self::Cross, _) => CROSS,
            (Self::Codes, _) => CODES,
        }
    }

    /// Whether a term of this domain names a channel that it follows: always, never, or as it is.
    pub(crate) fn follows(self) -> Option<bool> {
        match self {
            Self::Channel => Some(true),
            Self::Variance => None,
            _ => Some(false),
        }
    }
}

/// Numbers of a column.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Column {
    /// Their unit.
    pub unit: String,
    /// The numbers.
    pub values: Vec<f64>,
}

impl Column {
    /// Numbers in a unit.
    #[must_use]
    pub fn new(values: Vec<f64>, unit: &str) -> Self {
        Self {
            unit: unit.to_owned(),
            values,
        }
    }
}

/// A term without a name.
#[derive(Clone, Debug, PartialEq)]
pub struct Unnamed {
    /// What it is of.
    pub domain: Domain,
    /// The channels that it acts on, each by itself; of `cross`, the two that share.
    pub channels: Vec<String>,
    /// The recorded channel that it follows.
    pub follows: Option<String>,
    /// The cause whose tone it tells in detail: its bumps are the places that the tone visits, and it stands for the cause in a
    /// simulation.
    pub refines: Option<String>,
    /// Its size, in the unit of the channels.
    pub rms: Parameter,
    /// Its numbers, in the order of [`Domain::columns`], all of one length.
    pub columns: Vec<Column>,
}

impl Unnamed {
    /// The numbers of its column `k`.
    #[must_use]
    pub fn values(&self, k: usize) -> &[f64] {
        self.columns.get(k).map_or(&[], |c| &c.values)
    }
}

/// What knots say at a place: straight from one to the next, the first and the last beyond them.
pub(crate) fn between(at: &[f64], values: &[f64], place: f64) -> f64 {
    let above = at.partition_point(|a| *a <= place);
    match (above.checked_sub(1), at.get(above)) {
        (None, _) => values.first().copied().unwrap_or(0.0),
        (Some(k), None) => values[k],
        (Some(k), Some(next)) => {
            let part = (place - at[k]) / (next - at[k]);
            values[k] + part * (values[k + 1] - values[k])
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn knots_are_joined_by_straight_lines_and_held_beyond_their_ends() {
        let (at, values) = ([1.0, 2.0, 4.0], [10.0, 20.0, 0.0]);
        for (place, value) in [
            (-5.0, 10.0),
            (1.0, 10.0),
            (1.5, 15.0),
            (3.0, 10.0),
            (4.0, 0.0),
            (9.0, 0.0),
        ] {
            assert_eq!(between(&at, &values, place), value, "{place}");
        }
    }
}
