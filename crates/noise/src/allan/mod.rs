//! The Allan family: estimators on integrated readings, their grids of cluster times and the streaming form.
//!
//! ```
//! use noise::allan::{Deviation, Phase, deviation};
//!
//! // A reading that alternates by +-1 averages out over two samples.
//! let readings: Vec<f64> = (0..100).map(|i| f64::from(1 - 2 * (i % 2))).collect();
//! let phase = Phase::from_values(&readings, &[0..100]);
//! let at = |m| deviation(&phase, Deviation::Oadev, 0.05, m).map(|e| e.deviation);
//! assert!((at(1).unwrap() - 2f64.sqrt()).abs() < 1e-12);
//! assert!(at(2).unwrap() < 1e-12);
//! assert_eq!(at(51), None);
//! ```

mod correlate;
mod fast;
mod gapped;
mod gapped_modified;
mod gapped_total;
mod kernels;
mod phase;
mod streaming;
mod theoh;
mod total;

pub(crate) use gapped::segments;
pub use gapped::{Gapped, GappedEstimate};
pub use kernels::Estimate;
pub use phase::{Phase, PhasePoint};
pub use streaming::Streaming;
pub(crate) use theoh::allan_to;

use serde::{Deserialize, Serialize};

use model::record::AnalysisError;

/// A deviation of the family. All read the rate; `Tdev` carries another factor τ.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Deviation {
    /// Allan, clusters side by side. NIST SP 1065 (2008), eq. (7).
    Adev,
    /// Overlapping Allan. Eq. (9).
    Oadev,
    /// Modified Allan. Eq. (14).
    Mdev,
    /// Time deviation, τ/√3 times the modified Allan deviation. Eq. (16).
    Tdev,
    /// Hadamard. Eq. (17).
    Hdev,
    /// Overlapping Hadamard. Eq. (18).
    Ohdev,
    /// Total. Eq. (25).
    Totdev,
    /// Modified total, without correction of its bias. Eq. (27).
    Mtotdev,
    /// Theo1, whose cluster time is 0.75·m·τ₀ (m even, from 10). Eq. (30). Unbiased for white rate noise; for other noise
    /// it differs from the Allan deviation by a factor that depends on the noise.
    Theo1,
    /// ThêoH: overlapping Allan up to a fifth of the longest run, beyond it Theo1 freed from its bias (m even), whose
    /// cluster time is 0.75·m·τ₀. Eq. (31) and (32).
    Theoh,
}

impl Deviation {
    /// All of them, in the order of the documentation.
    pub const ALL: [Self; 10] = [
        Self::Adev,
        Self::Oadev,
        Self::Mdev,
        Self::Tdev,
        Self::Hdev,
        Self::Ohdev,
        Self::Totdev,
        Self::Mtotdev,
        Self::Theo1,
        Self::Theoh,
    ];

    /// `oadev`, ...: the name in options and JSON.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Adev => "adev",
            Self::Oadev => "oadev",
            Self::Mdev => "mdev",
            Self::Tdev => "tdev",
            Self::Hdev => "hdev",
            Self::Ohdev => "ohdev",
            Self::Totdev => "totdev",
            Self::Mtotdev => "mtotdev",
            Self::Theo1 => "theo1",
            Self::Theoh => "theoh",
        }
    }

    /// The largest averaging factor a run of `n` samples carries.
    #[must_use]
    pub fn longest(self, n: usize) -> usize {
        match self {
            Self::Adev | Self::Oadev => n / 2,
            Self::Mdev | Self::Tdev | Self::Mtotdev => (n + 1) / 3,
            Self::Hdev | Self::Ohdev => n / 3,
            Self::Totdev => n.saturating_sub(1),
            Self::Theo1 if n >= 10 => n / 2 * 2,
            Self::Theoh if n + 1 >= theoh::NEEDED => n / 2 * 2,
            Self::Theo1 | Self::Theoh => 0,
        }
    }
}

impl std::str::FromStr for Deviation {
    type Err = AnalysisError;

    fn from_str(s: &str) -> Result<Self, Self::Err> {
        Self::ALL
            .into_iter()
            .find(|d| d.name() == s)
            .ok_or_else(|| AnalysisError::BadOption {
                option: "--deviations",
                found: s.to_owned(),
                expected: format!("of {}", Self::ALL.map(Self::name).join(", ")),
            })
    }
}

/// Which cluster times are computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TauGrid {
    /// m = 1, 2, 4, 8, ...
    #[default]
    Octave,
    /// m = 1, 2, 4, 10, 20, 40, ...
    Decade,
    /// Every m.
    All,
    /// So many for each decade, evenly spaced in log m.
    Log(u32),
}

impl TauGrid {
    /// Averaging factors up to `longest`, ascending, each once.
    #[must_use]
    pub fn factors(self, longest: usize) -> Vec<usize> {
        let mut out: Vec<usize> = match self {
            Self::Octave => std::iter::successors(Some(1usize), |m| m.checked_mul(2))
                .take_while(|m| *m <= longest)
                .collect(),
            Self::Decade => std::iter::successors(Some(1usize), |m| m.checked_mul(10))
                .take_while(|m| *m <= longest)
                .flat_map(|m| [m, m.saturating_mul(2), m.saturating_mul(4)])
                .collect(),
            Self::All => (1..=longest).collect(),
            Self::Log(per_decade) => {
                let step = 10f64.powf(1.0 / f64::from(per_decade.max(1)));
                std::iter::successors(Some(1.0f64), |m| Some(m * step))
                    .take_while(|m| m.round() <= longest as f64)
                    .map(|m| m.round() as usize)
                    .collect()
            }
        };
        out.retain(|m| *m <= longest);
        out.dedup();
        out
    }
}

impl std::str::FromStr for TauGrid {
    type Err = AnalysisError;

    fn from_str(s: &str) -> Result<Self, Self::Err> {
        match s {
            "octave" => Ok(Self::Octave),
            "decade" => Ok(Self::Decade),
            "all" => Ok(Self::All),
            _ => s
                .strip_prefix("log:")
                .and_then(|n| n.parse().ok())
                .filter(|n| (1..=1000).contains(n))
                .map(Self::Log)
                .ok_or_else(|| AnalysisError::BadOption {
                    option: "--taus",
                    found: s.to_owned(),
                    expected: "octave, decade, all or log:N with N = 1 to 1000 for each decade"
                        .into(),
                }),
        }
    }
}

/// One deviation of integrated readings at the averaging factor `m`; `None` where no run is long enough.
///
/// | name | meaning | unit | shape |
/// |---|---|---|---|
/// | `phase` | integrated readings, in runs without gaps | U·samples | – |
/// | `tau0`, `m` | sample interval; averaging factor | s; – | scalars |
/// | returns | deviation and the number of differences in it | U (`Tdev`: U·s); – | – |
///
/// No difference spans a gap: runs add their squares, and a run too short for `m` adds nothing.
#[must_use]
pub fn deviation(phase: &Phase, kind: Deviation, tau0: f64, m: usize) -> Option<Estimate> {
    if m == 0 {
        return None;
    }
    phase.deviation(kind, tau0, m, &mut correlate::Correlator::new())
}
