//! What was seen and has no name, before what belongs together is one entry.

use model::effect::Parameters;

use super::CheckId;

/// What kind of thing an observation is of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Domain {
    /// Mean, spectrum, size or law of the noise of one channel: views of one residual.
    #[default]
    Noise,
    /// What axes have in common.
    Coupling,
    /// How the readings of one channel are made: which codes there are, and how each depends on others.
    Codes,
    /// Frames and clocks, or a channel that is not searched at all: each is a thing of its own.
    Readings,
}

/// One thing that was seen on a channel and that no effect of the library explains.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Observation {
    /// The channel.
    pub channel: String,
    /// What is seen, and where.
    pub what: String,
    /// What it is of.
    pub domain: Domain,
    /// The check that saw it, and the chance of its statistic; none where a name was withdrawn or nothing was asked.
    pub check: Option<(CheckId, f64)>,
    /// Recorded channels that it follows.
    pub follows: Vec<String>,
    /// Titles of the effects that come nearest to it.
    pub nearest: Vec<&'static str>,
    /// Correlation with another axis, where it is one.
    pub correlation: Option<f64>,
    /// Places, among the terms of the channel's model, of those that stand for it there.
    pub terms: Vec<usize>,
    /// Parameters of each line that it is made of, the largest first.
    pub lines: Vec<Parameters>,
    /// Lowest and highest frequency, as shares of half the sample rate, where it has such a place.
    pub place: Option<[f64; 2]>,
    /// Whether it says what the structure is that checks see parts of.
    pub structure: bool,
}

impl Observation {
    /// Of the noise of a channel.
    pub(crate) fn of_noise(channel: &str, what: String) -> Self {
        Self {
            channel: channel.to_owned(),
            what,
            ..Self::default()
        }
    }

    /// Of what a channel has in common with another one.
    pub(crate) fn of_coupling(channel: &str, what: String, correlation: f64) -> Self {
        Self {
            domain: Domain::Coupling,
            correlation: Some(correlation),
            ..Self::of_noise(channel, what)
        }
    }

    /// Of readings.
    pub(crate) fn of_readings(channel: &str, what: String) -> Self {
        Self {
            domain: Domain::Readings,
            ..Self::of_noise(channel, what)
        }
    }

    /// Of how the readings of a channel are made.
    pub(crate) fn of_codes(channel: &str, what: String) -> Self {
        Self {
            domain: Domain::Codes,
            ..Self::of_noise(channel, what)
        }
    }

    /// As a check saw it, with the chance of its statistic.
    pub(crate) fn by(mut self, check: CheckId, chance: f64) -> Self {
        self.check = Some((check, chance));
        self
    }

    /// As following another channel.
    pub(crate) fn following(mut self, channel: &str) -> Self {
        self.follows.push(channel.to_owned());
        self
    }
}
