//! What is said of units that nobody stated, or that are stated twice.

use model::record::Quantity;

use super::CaptureError;
use super::units::{What, known, usual};

/// Asks for the unit of gyros: deg/s and rad/s are as usual, and one for the other is wrong by 57.3.
pub(super) fn whose(gyros: &[String]) -> CaptureError {
    CaptureError::Option {
        option: "--units",
        why: format!("nothing says the unit of {}", gyros.join(", ")),
        help: "say it: `--units gyro=deg/s`, `gyro=rad/s` as phones, ROS and MATLAB's toolboxes have it, or what a count is, \
               `gyro=0.0076deg/s`"
            .to_owned(),
    }
}

/// Says that a unit given is another one than the column's own.
pub(super) fn contradiction(
    ours: &str,
    column: &str,
    given: Option<&str>,
    stated: Option<&str>,
) -> Option<String> {
    let (given, stated) = (known(given?)?, known(stated?)?);
    (given != stated).then(|| {
        format!(
            "{ours} is taken in {given}, as --units says, although its column `{column}` says {stated}"
        )
    })
}

/// Says what was assumed.
pub(super) fn note(assumed: &[(String, What)]) -> Vec<String> {
    let mut notes = Vec::new();
    for (quantity, key) in [
        (Quantity::Gyro, "gyro=rad/s"),
        (Quantity::Acc, "acc=g"),
        (Quantity::Temp, "temp=K"),
        (Quantity::Supply, "supply=mV"),
    ] {
        let what = What::Channel(quantity);
        let names: Vec<&str> = (assumed.iter().filter(|(_, w)| *w == what))
            .map(|(name, _)| name.as_str())
            .collect();
        if !names.is_empty() {
            notes.push(format!(
                "{} taken in {}, as nothing says a unit; `--units {key}` or the like does",
                names.join(", "),
                usual(what)
            ));
        }
    }
    notes
}
