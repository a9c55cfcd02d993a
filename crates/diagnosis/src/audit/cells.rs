//! Cells of the codes of a file: what of a reading becomes which of them, where it was rounded once or twice.

use model::effects::double_rounding::Halves;

/// Sensor codes nearer to the middle of two codes, in sensor steps, are half-way.
const HALF_WAY: f64 = 1e-6;

/// A sensor's step in a file of decimals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Decimal {
    /// The step, units: the double nearest to the fraction.
    pub step: f64,
    /// Codes of the file in a unit.
    pub in_unit: f64,
    pub halves: Halves,
}

/// Cells of the file's codes: step and offset of the first rounding, in steps of the file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cells {
    pub step: f64,
    pub offset: f64,
    /// Where a sensor code half-way between two codes goes; none where it comes to the upper one.
    pub decimal: Option<Decimal>,
}

impl Cells {
    /// Those of one rounding.
    pub(super) const ONE_ROUNDING: Self = Self {
        step: 1.0,
        offset: 0.0,
        decimal: None,
    };

    /// Where the cell of code c begins, its end being the beginning of the next, in steps of the file.
    pub(super) fn begin(self, c: f64) -> f64 {
        // The first sensor code that comes to c or beyond.
        let edge = (c - 0.5 - self.offset) / self.step;
        let first = match self.decimal {
            Some(of) if (edge - edge.round()).abs() < HALF_WAY => {
                let own = edge.round();
                own + f64::from(u8::from(!of.halves.up(own, of.step, c - 1.0, of.in_unit)))
            }
            _ => edge.ceil(),
        };
        (first - 0.5) * self.step + self.offset
    }

    /// The same cells, codes counted from another one.
    pub(super) fn from(self, code: f64) -> Self {
        let offset = self.offset - code;
        Self {
            offset: offset - self.step * (offset / self.step).round(),
            ..self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_holds_the_sensor_codes_that_come_to_its_code() {
        let cells = Cells {
            step: 1.5,
            offset: 0.2,
            decimal: None,
        };
        for m in -20..20 {
            let x = f64::from(m) * 1.5 + 0.2;
            let c = x.round();
            assert!(cells.begin(c) <= x && x < cells.begin(c + 1.0), "{m}");
        }
    }
}
