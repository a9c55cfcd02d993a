//! Readings that were rounded twice, to different steps.

use crate::effect::{
    Docs, Effect, Example, Hypothesis, ParameterSpec, Parameters, Plot, Rival, Stage, View, agree,
    detail, optional, parameter, value,
};
use crate::simulate::{SensorStep, Simulation};

/// How a code of the sensor that is half-way between two readings was rounded: in a file of decimals that the arithmetic decides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Halves {
    /// Away from zero.
    Away,
    /// To the even one.
    Even,
    /// As the product of code and step in double precision is printed with so many digits.
    Printed,
    /// As the product in single precision is.
    PrintedSingle,
    /// As that product times a power of ten, in double precision, is rounded to the nearest whole number (numpy's `round`).
    Scaled,
}

impl Halves {
    /// All of them, as the model file numbers them from 0 on.
    pub const ALL: [Self; 5] = [
        Self::Away,
        Self::Even,
        Self::Printed,
        Self::PrintedSingle,
        Self::Scaled,
    ];

    /// Its number in a model file.
    #[must_use]
    pub fn number(self) -> f64 {
        f64::from(self as u8)
    }

    /// Whether the code of a sensor, of steps that large, becomes the upper of the readings `below` and `below` + 1, of which there
    /// are so many in a unit.
    #[must_use]
    pub fn up(self, code: f64, step: f64, below: f64, in_unit: f64) -> bool {
        let even = below.rem_euclid(2.0) != 0.0;
        // The sign of what a number is off the middle, without rounding; a number that is there goes to the even one.
        let printed = |v: f64| match v.mul_add(2.0 * in_unit, -2.0 * below - 1.0) {
            0.0 => even,
            off => off > 0.0,
        };
        match self {
            Self::Away => below + 0.5 > 0.0,
            Self::Even => even,
            Self::Printed => printed(code * step),
            Self::PrintedSingle => printed(f64::from(code as f32 * step as f32)),
            Self::Scaled => match code * step * in_unit - (below + 0.5) {
                0.0 => even,
                off => off > 0.0,
            },
        }
    }
}

/// The effect.
pub struct DoubleRounding;

/// Its id.
pub const ID: &str = "double_rounding";

/// The one instance that the library lists.
pub static EFFECT: DoubleRounding = DoubleRounding;

impl Effect for DoubleRounding {
    fn id(&self) -> &'static str {
        ID
    }

    fn parameters(&self) -> &'static [ParameterSpec] {
        const PARAMETERS: &[ParameterSpec] = &[
            parameter("sensor_step", "deg/s", "step of the first rounding"),
            optional("file_step", "deg/s", "step of the readings"),
            detail(
                "offset",
                "deg/s",
                "what was added between the roundings, less whole sensor steps",
            ),
            detail(
                "halves",
                "1",
                "what is half-way between two steps: 0 away from zero, 1 to the even one, 2 as printed of double and 3 of single precision, 4 as rounded after scaling",
            ),
        ];
        PARAMETERS
    }

    fn docs(&self) -> Docs {
        Docs {
            title: "Rounded twice",
            physics: "The sensor's codes were scaled and rounded once more: printed with few digits, or put into whole numbers of another unit. Where the second step is not a whole part of the first, some codes of the file hold more codes of the sensor than their neighbours, or none.",
            excitation: "Nothing; noise of some steps of the file.",
            test: "Audit: likelihood of the histogram of the codes, in cells that end where those of the sensor's codes do.",
            remedy: "Write the sensor's own counts, or more digits than its step has; its noise is not harmed by more than the variance of the second rounding, step^2 / 12.",
            figure: "Histogram of the codes.",
            example: Example::new(
                Plot::Histogram,
                &[("sensor_step", 0.11), ("file_step", 0.073_26)],
            ),
        }
    }

    fn rivals(&self) -> &'static [Rival] {
        const RIVALS: &[Rival] = &[Rival {
            cause: "stuck_bit",
            experiment: "record the sensor's own counts: a bit that sticks is there too",
        }];
        RIVALS
    }

    fn hypotheses(&self, _view: &View<'_>) -> Result<Vec<Hypothesis>, String> {
        Ok(vec![Hypothesis::Audit])
    }

    /// By the square root of the sum of both variances over that of the step of the readings.
    fn coarsens(&self, parameters: &Parameters) -> f64 {
        let [sensor, file] = ["sensor_step", "file_step"].map(|name| value(parameters, name));
        if file > 0.0 {
            (sensor / file).hypot(1.0)
        } else {
            1.0
        }
    }

    fn same_event(&self, a: &Parameters, b: &Parameters) -> bool {
        agree(a, b, "sensor_step")
    }

    fn stage(&self) -> Stage {
        Stage::Reading
    }

    fn simulate(&self, parameters: &Parameters, channels: &[usize], simulation: &mut Simulation) {
        let step = value(parameters, "sensor_step");
        for &axis in channels {
            simulation.sensor_step[axis] = (step > 0.0).then(|| SensorStep {
                step,
                zero: value(parameters, "offset"),
                halves: Halves::ALL
                    .into_iter()
                    .find(|h| h.number() == value(parameters, "halves"))
                    .unwrap_or(Halves::Away),
            });
        }
    }
}
