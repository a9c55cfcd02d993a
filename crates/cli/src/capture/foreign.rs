//! Foreign CSV: which column is what, and in which unit.

use model::record::{Axis, Quantity};

use super::CaptureError;
use super::units::{COUNTS, What, convert, known};

/// What a unit can be given for.
const QUANTITIES: [&str; 7] = ["time", "gyro", "acc", "temp", "supply", "pwm", "other"];

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
    /// [`CaptureError::Option`] where a text is no list of `a=b`, or a unit is of another quantity.
    pub fn parse(columns: Option<&str>, units: Option<&str>) -> Result<Self, CaptureError> {
        let columns = pairs(
            "--columns",
            columns,
            "write `--columns time=time_s,gyro_x=gx_dps,acc_x=ax_mps2`",
        )?;
        let units = pairs(
            "--units",
            units,
            "write `--units time=ms,gyro=deg/s,acc=m/s2,temp=degC,supply=V`",
        )?;
        let mapping = Self { columns, units };
        mapping.have_their_units()?;
        Ok(mapping)
    }

    /// An error where a quantity was given a unit of another one, whether the file has such a channel or not.
    fn have_their_units(&self) -> Result<(), CaptureError> {
        let of = |key: &str| match key {
            "time" => Some(What::Time),
            "gyro" => Some(What::Channel(Quantity::Gyro)),
            "acc" => Some(What::Channel(Quantity::Acc)),
            "temp" => Some(What::Channel(Quantity::Temp)),
            "supply" => Some(What::Channel(Quantity::Supply)),
            "pwm" => Some(What::Channel(Quantity::Pwm)),
            _ => None,
        };
        for (key, unit) in &self.units {
            if let Some(what) = of(key).filter(|_| known(unit) != Some(COUNTS)) {
                convert(what, Some(unit))?;
            }
        }
        Ok(())
    }

    /// The unit that was given for a channel: by its name, or by its quantity.
    pub(super) fn unit(&self, name: &str, what: What) -> Option<&str> {
        let of_quantity = match what {
            What::Time => "time",
            What::Channel(Quantity::Gyro) => "gyro",
            What::Channel(Quantity::Acc) => "acc",
            What::Channel(Quantity::Temp) => "temp",
            What::Channel(Quantity::Supply) => "supply",
            What::Channel(Quantity::Pwm) => "pwm",
            What::Channel(Quantity::Other | Quantity::Derived) => "other",
        };
        let find = |key: &str| {
            self.units
                .iter()
                .find(|(k, _)| k == key)
                .map(|(_, unit)| unit.as_str())
        };
        find(name).or_else(|| find(of_quantity))
    }

    /// An error where a unit was given for what is neither a quantity nor one of the channels that are read.
    pub(super) fn check_units<'a>(
        &self,
        channels: impl Iterator<Item = &'a str> + Clone,
    ) -> Result<(), CaptureError> {
        for (key, _) in &self.units {
            if !QUANTITIES.contains(&key.as_str()) && !channels.clone().any(|name| name == key) {
                return Err(CaptureError::Option {
                    option: "--units",
                    why: format!("`{key}` is neither a quantity nor a channel that is read"),
                    help: format!("one of {}, or the name of a channel", QUANTITIES.join(", ")),
                });
            }
        }
        Ok(())
    }
}

fn pairs(
    option: &'static str,
    text: Option<&str>,
    help: &str,
) -> Result<Vec<(String, String)>, CaptureError> {
    let mut list: Vec<(String, String)> = Vec::new();
    for item in text
        .unwrap_or_default()
        .split(',')
        .map(str::trim)
        .filter(|item| !item.is_empty())
    {
        match item.split_once('=') {
            Some((ours, _)) if list.iter().any(|(known, _)| known == ours.trim()) => {
                return Err(CaptureError::Option {
                    option,
                    why: format!("`{}` is given twice", ours.trim()),
                    help: help.to_owned(),
                });
            }
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

/// What a channel's name says that it is.
pub(super) fn meaning(name: &str) -> (Quantity, Option<Axis>) {
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
