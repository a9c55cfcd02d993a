//! Runs without a fault in records of other kinds than the campaign's own: each kind has false alarms of its own.

use crate::random::Draw;
use crate::stand::{GYROS, Stand};
use model::record::{Quantity, Record};

/// Samples of a record, as of 600 s at 20 Hz: a kind is no longer or shorter than the rest.
const SAMPLES: f64 = 12_000.0;
/// Sample rates of the first kind, Hz.
const RATES_HZ: (f64, f64) = (5.0, 100.0);
/// Steps of the readings of the third kind, standard deviations of the white noise.
const STEPS: (f64, f64) = (0.3, 1.5);

/// What is other in a kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Rate,
    OneAxis,
    CoarseSteps,
}

/// A kind: the number of its family, the row of the tables.
#[derive(Clone, Copy, Debug)]
pub struct CleanKind {
    /// Number of its family: all draws hang on it, so it never changes.
    pub id: u16,
    /// The row of the tables.
    pub label: &'static str,
    kind: Kind,
}

const fn kind(id: u16, label: &'static str, kind: Kind) -> CleanKind {
    CleanKind { id, label, kind }
}

/// The kinds.
pub const KINDS: [CleanKind; 3] = [
    kind(10, "nothing, 5 to 100 Hz", Kind::Rate),
    kind(11, "nothing, one axis", Kind::OneAxis),
    kind(12, "nothing, steps of 0.3 to 1.5 sigma", Kind::CoarseSteps),
];

impl CleanKind {
    /// Sample rate, Hz, and length, s.
    #[must_use]
    pub fn extent(&self, draw: &mut Draw) -> (f64, f64) {
        let rate_hz = match self.kind {
            Kind::Rate => draw.by_ratio(RATES_HZ.0, RATES_HZ.1),
            Kind::OneAxis | Kind::CoarseSteps => 20.0,
        };
        (rate_hz, SAMPLES / rate_hz)
    }

    /// What is other in the stand.
    pub fn set_up(&self, draw: &mut Draw, stand: &mut Stand) {
        if self.kind == Kind::CoarseSteps {
            let sigma = [0, 1, 2].map(|axis| stand.white(axis).sqrt());
            stand.lsb = sigma.map(|s| s * draw.by_ratio(STEPS.0, STEPS.1));
        }
    }

    /// What is other in the record: of one axis the other two are not there.
    pub fn cut(&self, record: &mut Record, axis: usize) {
        if self.kind == Kind::OneAxis {
            let own =
                |c: &model::record::Channel| c.quantity != Quantity::Gyro || c.name == GYROS[axis];
            record.channels.retain(own);
        }
    }
}
