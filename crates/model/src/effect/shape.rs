//! Regressions with a shape of their own.

use std::sync::Arc;

use super::Column;

/// A family of regressions with one shape coordinate (a time constant), which is sought on a grid and refined.
pub trait Shape: Send + Sync {
    /// Name and unit of the coordinate.
    fn coordinate(&self) -> (&'static str, &'static str);
    /// Values to try first, ascending; the refinement stays within the outermost.
    fn grid(&self) -> Vec<f64>;
    /// The columns at one value.
    fn columns(&self, at: f64) -> Vec<Column>;
    /// How many samples the sensor may show it late, least and most: a filter and the instant of its reading delay what it
    /// feels, and not the source's record. The same for one that is never late.
    fn delays(&self) -> (f64, f64) {
        (0.0, 0.0)
    }
    /// How many samples late it is.
    fn delay(&self) -> f64 {
        0.0
    }
    /// The same so many samples late; `None` of one that is never late.
    fn later(&self, _samples: f64) -> Option<Arc<dyn Shape>> {
        None
    }
    /// The column of another parameter of its effect as late as this is, where `fixed` holds; `None` of one that it shares no
    /// delay with.
    fn beside(&self, _parameter: &str, _fixed: &[(&str, f64, &str)]) -> Option<Vec<f64>> {
        None
    }
    /// The channel that it follows; `None` of a shape of time.
    fn follows(&self) -> Option<&str> {
        None
    }
    /// A value of the coordinate as the effect's parameter has it.
    fn told(&self, at: f64) -> f64 {
        at
    }
    /// Whether it is all that its effect does: it takes the place of the effect's other terms, and joins none.
    fn whole(&self) -> bool {
        false
    }
}
