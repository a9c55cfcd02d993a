//! What can keep an analysis from an answer.

/// Why there is no result.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum AnalysisError {
    /// The record is too short to say anything. An answer, not a fault.
    #[error("inconclusive: {what} needs {need} {unit}, the record has {} {unit}", (have * 1e3).round() / 1e3)]
    Inconclusive {
        /// What was asked.
        what: String,
        /// What the record has.
        have: f64,
        /// What it takes.
        need: f64,
        /// Unit of both.
        unit: &'static str,
    },
    /// A channel that is needed is not there.
    #[error("no channel {name}; the record has: {}", present.join(", "))]
    NoChannel {
        /// What was asked for.
        name: String,
        /// What there is.
        present: Vec<String>,
    },
    /// Neither the header nor the times give a sample rate.
    #[error(
        "the sample rate is unknown: neither the header key `rate_hz` nor a time column gives it"
    )]
    NoRate,
    /// A channel that has to vary does not.
    #[error(
        "channel {name} reads {value} throughout: a sensor at rest has noise, so this is no measurement"
    )]
    Constant {
        /// The channel.
        name: String,
        /// Its only value.
        value: f64,
    },
    /// The flags say that no reading of a channel is new.
    #[error(
        "channel {name} is never flagged as new (bit {bit} of `flags`): what it reads is old, so this is no measurement"
    )]
    NeverNew {
        /// The channel.
        name: String,
        /// The bit that says so.
        bit: usize,
    },
    /// An option out of its range.
    #[error("{option} is {found}; it has to be {expected}")]
    BadOption {
        /// Name of the option.
        option: &'static str,
        /// What was given.
        found: String,
        /// What is allowed.
        expected: String,
    },
}
