//! Foreign CSV: which column is what, and in which unit.

use model::record::{Axis, Quantity};

use super::{CaptureError, STANDARD_GRAVITY};

/// `--columns` and `--units`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ColumnMapping {
    /// Ours -> theirs, in the order given.
    pub columns: Vec<(String, String)>,
    /// Quantity or channel name -> unit.
    pub units: Vec<(String, String)>,
}

impl ColumnMapping {
    /// From the texts of the options, `time=time_s,gyro_x=gx_dps` and `gyro=deg/s,acc=m/s2`.
    ///
    /// # Errors
    /// [`CaptureError::Option`] where a text is no list of `a=b`.
    pub fn parse(columns: Option<&str>, units: Option<&str>) -> Result<Self, CaptureError> {
        let columns = pairs(
            "--columns",
            columns,
            "write `--columns time=time_s,gyro_x=gx_dps,acc_x=ax_mps2`",
        )?;
        let units = pairs(
            "--units",
            units,
            "write `--units gyro=deg/s,acc=m/s2,temp=degC,supply=V`",
        )?;
        Ok(Self { columns, units })
    }

    /// The unit that was given for a channel: by its name, or by its quantity.
    pub(crate) fn unit(&self, name: &str, quantity: Quantity) -> Option<&str> {
        let of_quantity = match quantity {
            Quantity::Gyro => "gyro",
            Quantity::Acc => "acc",
            Quantity::Temp => "temp",
            Quantity::Supply => "supply",
            Quantity::Pwm => "pwm",
            Quantity::Other => "other",
        };
        let find = |key: &str| {
            self.units
                .iter()
                .find(|(k, _)| k == key)
                .map(|(_, unit)| unit.as_str())
        };
        find(name).or_else(|| find(of_quantity))
    }
}

fn pairs(
    option: &'static str,
    text: Option<&str>,
    help: &str,
) -> Result<Vec<(String, String)>, CaptureError> {
    let mut list = Vec::new();
    for item in text
        .unwrap_or_default()
        .split(',')
        .map(str::trim)
        .filter(|item| !item.is_empty())
    {
        match item.split_once('=') {
            Some((ours, theirs)) if !ours.trim().is_empty() && !theirs.trim().is_empty() => {
                list.push((ours.trim().to_owned(), theirs.trim().to_owned()));
            }
            _ => {
                return Err(CaptureError::Option {
                    option,
                    why: format!("`{item}` is not of the form OURS=THEIRS"),
                    help: help.to_owned(),
                });
            }
        }
    }
    Ok(list)
}

/// Unit of a gyro channel that holds the angle.
pub(crate) const ANGLE: &str = "deg";

/// What a channel's name says that it is.
pub(crate) fn meaning(name: &str) -> (Quantity, Option<Axis>) {
    let (stem, axis) = match name.rsplit_once('_') {
        Some((stem, "x")) => (stem, Some(Axis::X)),
        Some((stem, "y")) => (stem, Some(Axis::Y)),
        Some((stem, "z")) => (stem, Some(Axis::Z)),
        _ => (name, None),
    };
    match (stem, axis) {
        ("gyro", Some(_)) => (Quantity::Gyro, axis),
        ("acc", Some(_)) => (Quantity::Acc, axis),
        ("temp", _) => (Quantity::Temp, axis),
        ("supply", None) => (Quantity::Supply, None),
        ("pwm", None) => (Quantity::Pwm, None),
        _ => (Quantity::Other, None),
    }
}

/// Our unit for a unit given, and the factor into it.
pub(crate) fn convert(
    quantity: Quantity,
    given: Option<&str>,
) -> Result<(String, f64), CaptureError> {
    let ours = match quantity {
        Quantity::Gyro => "deg/s",
        Quantity::Acc => "m/s^2",
        Quantity::Temp => "degC",
        Quantity::Supply => "V",
        Quantity::Pwm | Quantity::Other => "1",
    };
    let Some(given) = given else {
        return Ok((ours.to_owned(), 1.0));
    };
    let factor = match (quantity, given) {
        (Quantity::Gyro, "deg/s" | "dps") => 1.0,
        (Quantity::Gyro, "rad/s") => 180.0 / std::f64::consts::PI,
        (Quantity::Gyro, "deg/h") => 1.0 / 3600.0,
        (Quantity::Gyro, "mdps") => 1e-3,
        // Angles: what is read is differenced into a rate.
        (Quantity::Gyro, "deg") => return Ok((ANGLE.to_owned(), 1.0)),
        (Quantity::Gyro, "rad") => return Ok((ANGLE.to_owned(), 180.0 / std::f64::consts::PI)),
        (Quantity::Gyro, "arcsec") => return Ok((ANGLE.to_owned(), 1.0 / 3600.0)),
        (Quantity::Acc, "m/s2" | "m/s^2" | "mps2") => 1.0,
        (Quantity::Acc, "g") => STANDARD_GRAVITY,
        (Quantity::Acc, "mg") => STANDARD_GRAVITY * 1e-3,
        (Quantity::Temp, "degC" | "C" | "K") => 1.0,
        (Quantity::Supply, "V") => 1.0,
        (Quantity::Supply, "mV") => 1e-3,
        (Quantity::Pwm, "1") => 1.0,
        (Quantity::Other, unit) => return Ok((unit.to_owned(), 1.0)),
        (_, unit) => {
            return Err(CaptureError::Option {
                option: "--units",
                why: format!("`{unit}` is no unit of {ours}"),
                help: "gyro: deg/s, rad/s, deg/h, mdps, or of an angle deg, rad, arcsec; acc: m/s2, g, mg; temp: degC, K; supply: V, mV".to_owned(),
            });
        }
    };
    Ok((ours.to_owned(), factor))
}

/// A mapping made of real column names, for the error that asks for one.
pub(crate) fn example(columns: &[String]) -> String {
    let mut out = Vec::new();
    let lower: Vec<String> = columns.iter().map(|c| c.to_lowercase()).collect();
    let mut find = |ours: &str, test: &dyn Fn(&str) -> bool| {
        if let Some(k) = lower.iter().position(|c| test(c)) {
            out.push(format!("{ours}={}", columns[k]));
        }
    };
    find("time", &|c| c.starts_with('t') && !c.starts_with("temp"));
    for (axis, letter) in [("x", 'x'), ("y", 'y'), ("z", 'z')] {
        find(&format!("gyro_{axis}"), &|c| {
            c.contains(letter) && (c.contains('g') || c.contains('w')) && !c.starts_with('a')
        });
    }
    for (axis, letter) in [("x", 'x'), ("y", 'y'), ("z", 'z')] {
        find(&format!("acc_{axis}"), &|c| {
            c.contains(letter) && c.starts_with('a')
        });
    }
    find("temp", &|c| c.starts_with("temp"));
    if out.is_empty() {
        out = columns
            .iter()
            .take(2)
            .zip(["time", "gyro_z"])
            .map(|(c, ours)| format!("{ours}={c}"))
            .collect();
    }
    out.join(",")
}
