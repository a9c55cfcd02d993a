//! When what happens in a history: a rest, the motor in steps, and, where the base sways, a rest and the sway.

use std::time::Duration;

use bench::{Run, Scenario, duty_profile};
use imu_stand::correct::Course;
use imu_stand::stand::course;
use model::record::Base;

/// When records begin, s since power came on: a correction is written and read back in 6 s before.
pub const BEGIN_S: f64 = 20.0;
/// The rest in which the bias is taken, s.
pub const REST_S: f64 = 60.0;
/// Between two records, s: the motor runs down in 2.
const GAP_S: f64 = 5.0;
/// The record of the sway: its rest, and its length, s.
const SWAY_REST_S: f64 = 30.0;
const SWAY_S: f64 = 330.0;

/// Length of the record at rest.
pub enum Length {
    /// As asked for, s.
    First(f64),
    /// Twice that behind the rest, so that it holds two spans as long as the first record.
    Second(f64),
}

impl Length {
    /// In seconds.
    pub fn seconds(&self) -> f64 {
        match *self {
            Length::First(seconds) => seconds,
            Length::Second(seconds) => REST_S + 2.0 * seconds,
        }
    }
}

/// The records of a history.
pub struct Planned {
    /// In words, and the course.
    pub courses: Vec<(&'static str, Course)>,
    /// The heater, where there is one, is on for so long and off for so long in turn, s; else it does as it likes.
    pub heater_s: Option<f64>,
    seed: u64,
}

impl Planned {
    pub fn new(length: Length, sways: bool, seed: u64) -> Self {
        let seconds = length.seconds();
        let rest = Course {
            from: Duration::from_secs_f64(BEGIN_S),
            seconds,
            steps: course(seed, REST_S, seconds),
            base: Base::Static,
        };
        let sway = Course {
            from: Duration::from_secs_f64(BEGIN_S + seconds + GAP_S),
            seconds: SWAY_S,
            steps: Vec::new(),
            base: Base::Moving,
        };
        let sway = sways.then_some(("swaying", sway));
        Self {
            courses: [("at rest", rest)].into_iter().chain(sway).collect(),
            heater_s: None,
            seed,
        }
    }

    /// The same history with its record at rest longer, and the heater switched.
    pub fn again(&self, seconds: f64, heater_s: Option<f64>) -> Self {
        let longer = Self::new(Length::First(seconds), self.courses.len() > 1, self.seed);
        Self { heater_s, ..longer }
    }

    /// The rest at the begin of a record, s.
    pub fn rest_s(&self, record: usize) -> f64 {
        if record == 0 { REST_S } else { SWAY_REST_S }
    }

    /// The end of the last record, s since power came on.
    pub fn end_s(&self) -> f64 {
        let ends = self.courses.iter();
        let ends = ends.map(|(_, course)| course.from.as_secs_f64() + course.seconds);
        ends.fold(0.0, f64::max)
    }

    /// The stand, which sways in the record of the sway alone.
    pub fn scenario(&self, scenario: &Scenario) -> Scenario {
        let mut scenario = scenario.clone();
        if let Some((_, sway)) = self.courses.get(1) {
            scenario.base.sway_from_s = sway.from.as_secs_f64() + SWAY_REST_S;
        }
        if let Some(half_s) = self.heater_s {
            scenario.thermal.heater_period_s = 2.0 * half_s;
        }
        scenario.seconds = self.courses[0].1.seconds;
        scenario
    }

    /// The record at rest as a run of the bench.
    pub fn run(&self, run: &Run) -> Run {
        let course = &self.courses[0].1;
        let steps: Vec<(f64, i16)> = (course.steps.iter())
            .map(|(at, duty)| (BEGIN_S + at, *duty))
            .collect();
        let seconds = BEGIN_S + course.seconds;
        Run {
            scenario: self.scenario(&run.scenario),
            seconds,
            requests: duty_profile(&steps, seconds),
        }
    }
}
