//! Tests and the levels at which they fail.

/// One statistic with its chance, and what was seen where.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// Name of the check.
    pub id: &'static str,
    /// Statistic.
    pub statistic: f64,
    /// Chance of a larger one under the model.
    pub p_value: f64,
    /// What it sees.
    pub what: String,
}

/// Chance below which a check fails.
pub const OMNIBUS_LEVEL: f64 = 1e-5;
/// Chance below which a claim fails. It is weighed only where a process is named, not on every record.
pub(crate) const CLAIM_LEVEL: f64 = 1e-3;
/// Samples of ten minutes at 20 Hz, which the checks are calibrated on. Of a longer record of a real part, whatever its size,
/// something is always left that is no linear, normal noise.
pub(crate) const RECORD: f64 = 12_000.0;
/// Samples that are looked at: so many show what repeats itself.
pub(crate) const MOST: usize = 1 << 18;
/// Name of the check for a rhythm of the variance.
pub(crate) const RHYTHM: &str = "variance_rhythm";
/// The claims.
pub(crate) const CLAIMS: [&str; 7] = [
    "process_spectrum",
    "process_law",
    "process_steadiness",
    "process_levels",
    "process_dwells",
    "process_size",
    "process_source",
];
/// The same of what stands at one frequency.
pub(crate) const BAND_CLAIMS: [&str; 4] = [
    "band_spectrum",
    "band_steadiness",
    "band_size",
    ENVELOPE_CLAIM,
];
/// That of its envelope.
pub(crate) const ENVELOPE_CLAIM: &str = "band_envelope";
/// The claim of every stationary process, filters among them: neither its variance nor how its neighbours depend on each other
/// has a rhythm, as what is held, bridged or switched by a clock of its own has.
pub(crate) const STATIONARY_CLAIM: &str = "process_rhythm";
/// The checks of short-time spectra.
pub(crate) const COLOUR: &str = "colour_follows";
pub(crate) const ORDER: &str = "order";
pub(crate) const LEANING: &str = "leaning";
pub(crate) const IDS: [&str; 3] = [COLOUR, ORDER, LEANING];
/// The claim of a law of the variance.
pub(crate) const VARIANCE_CLAIM: &str = "variance_law";
/// The claim of an effect that follows a channel.
pub(crate) const FOLLOWER_CLAIM: &str = "follower_law";
/// Share of what a shape explains that departures from it may hold: it is off by a fifth of its size. Real responses are
/// not exactly in proportion, and a small part of a strong effect is no other cause.
pub(crate) const DEPARTURE: f64 = 0.05;
