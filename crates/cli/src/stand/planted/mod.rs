//! What was planted in a stand, in the words and units in which the diagnosis would state it.
//!
//! The bench plants physics: a current that couples, a corner of a filter, noise before the part's own filters. The
//! diagnosis states what the samples show. Where both have a size in common, the physics is converted here into the
//! parameter of the effect (docs/effects.md); where they have not, the name alone can be compared, and why is said.

mod compare;
mod faults;
mod motor;
mod sampled;

use bench::{Run, Scenario};

use crate::report::plot::number;
pub use compare::{Compared, ComparedSize, Comparison, Named, RULE, compare};
use sampled::RATE_HZ;

/// The gyros of the stand, in their order.
pub const GYROS: [&str; 3] = ["gyro_x", "gyro_y", "gyro_z"];
/// Its accelerometers.
pub const ACCELEROMETERS: [&str; 3] = ["acc_x", "acc_y", "acc_z"];
/// Scale errors from here on are planted, 1: five times what the stand's sound parts scatter by (0.004).
const SCALE_PLANTED: f64 = 0.02;
/// Half of the interval between two samples, s: nearer no time in a record can be told.
const HALF_A_SAMPLE_S: f64 = 0.5 / RATE_HZ;

/// From a sample to the time that the host gives it, s: the board has put it into a frame after 1 ms (`bench::Timeline`), and the
/// host has it with its last bit.
pub const ON_ITS_WAY_S: f64 =
    1e-3 + (10 * wire::Sample::FRAME_LEN) as f64 / crate::link::DEFAULT_BAUD as f64;

/// Something planted in the stand.
#[derive(Clone, Debug, PartialEq)]
pub struct Planted {
    /// The stand's physics, in a sentence.
    pub what: String,
    /// The cause that names it (docs/effects.md).
    pub cause: &'static str,
    /// The channels it is in; none where it is in all rows of the record.
    pub channels: Vec<&'static str>,
    /// Its sizes, as the effect states them. The first is always stated by a finding.
    pub sizes: Vec<Size>,
    /// Why no size can be compared, where there is none.
    pub name_alone: &'static str,
}

/// A size, converted into a parameter of an effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Size {
    /// Name of the parameter.
    pub parameter: &'static str,
    /// What was planted.
    pub value: f64,
    /// Unit of both.
    pub unit: &'static str,
    /// What the record itself cannot resolve, in the same unit: added to the interval on both sides.
    pub within: f64,
    /// The value that this parameter has where a finding lacks another one, which then goes into it.
    pub without: Option<(&'static str, f64)>,
}

impl Size {
    fn new(parameter: &'static str, value: f64, unit: &'static str) -> Self {
        Size {
            parameter,
            value,
            unit,
            within: 0.0,
            without: None,
        }
    }

    fn within(self, within: f64) -> Self {
        Size { within, ..self }
    }

    fn at(parameter: &'static str, time_s: f64) -> Self {
        Size::new(parameter, time_s, "s").within(HALF_A_SAMPLE_S)
    }

    /// Of what goes through a gyro's filters: when the readings show it.
    fn read_at(parameter: &'static str, time_s: f64) -> Self {
        Size::at(parameter, time_s + sampled::LATE_S)
    }
}

/// Everything planted in a run, the first sample of whose record was taken `start_s` after power came on.
#[must_use]
pub fn planted(run: &Run, start_s: f64) -> Vec<Planted> {
    let scenario = &run.scenario;
    let mut all: Vec<Planted> = scenario
        .faults
        .iter()
        .flat_map(|fault| faults::planted(fault, run, start_s))
        .collect();
    all.extend(in_parts(scenario));
    all
}

/// What is planted in the parts themselves.
fn in_parts(scenario: &Scenario) -> Vec<Planted> {
    let mut all = Vec::new();
    let base = &scenario.base;
    for (gyro, part) in scenario.gyros.iter().enumerate() {
        if part.scale_error.abs() < SCALE_PLANTED {
            continue;
        }
        let relative = part.scale_error;
        all.push(Planted {
            what: format!(
                "{} reads {} times the true rate, and the base sways by {} deg in {} s",
                GYROS[gyro],
                number(1.0 + relative, 4),
                number(base.sway_deg, 3),
                number(base.sway_period_s, 3)
            ),
            cause: "scale_error",
            channels: vec![GYROS[gyro]],
            sizes: vec![Size::new("relative", relative, "1")],
            name_alone: "",
        });
    }
    if scenario.crystal_ppm != 0.0 {
        all.push(Planted {
            what: format!(
                "the board's crystal is {} ppm fast",
                number(scenario.crystal_ppm, 4)
            ),
            cause: "clock_rate",
            channels: vec![],
            // Times of the host are written to the microsecond: 1 us at each end, over the length of the run.
            sizes: vec![
                Size::new("ppm", scenario.crystal_ppm, "ppm").within(2.0 / scenario.seconds),
            ],
            name_alone: "",
        });
    }
    all
}
