//! What an analysis could not do, and what to do about it.

use crate::text::shell_word;

/// Turns an analysis error into what the user is told, with what to do next.
#[must_use]
pub fn explain(error: model::record::AnalysisError) -> miette::Report {
    let help = match &error {
        model::record::AnalysisError::Inconclusive {
            need, unit: "runs", ..
        } => format!("name {need} captures of the same stand at least"),
        model::record::AnalysisError::Inconclusive { have: 0.0, .. } => {
            "no gyro has a reading: map the columns that hold numbers, `--columns gyro_x=...`".to_owned()
        }
        model::record::AnalysisError::Inconclusive { need, unit, .. } => {
            format!("record for longer: {need} {unit} at least")
        }
        model::record::AnalysisError::NoRate => "add `--rate HZ`, or map a time column".to_owned(),
        model::record::AnalysisError::NoChannel { name, present } => match present.first() {
            Some(_) if name.starts_with("gyro_x,") => {
                let known = ["temp", "acc", "supply", "pwm"];
                let is_known = |name: &&String| known.iter().any(|stem| name.starts_with(stem));
                // What is mapped to something else already is no gyro.
                let column = present.iter().find(|name| !is_known(name));
                let gyro = column.map_or_else(
                    || "gyro_x=COLUMN".to_owned(),
                    |column| shell_word(&format!("gyro_x={column}")),
                );
                format!("say which column is a gyro, and in which unit: --columns {gyro} --units gyro=deg/s")
            }
            _ => "name one of the channels that are there".to_owned(),
        },
        model::record::AnalysisError::Constant { name, .. } => format!(
            "see to the sensor's supply and wiring (`imu-stand board self-test`); to go on without {name}, name the others: \
             `analyze --channels ...`, or `--columns` without it"
        ),
        model::record::AnalysisError::NeverNew { .. } => {
            "check the gyros' SPI lines; where the flags come from elsewhere, leave the column `flags` out".to_owned()
        }
        _ => "`--help` after the command lists its options, with an example".to_owned(),
    };
    miette::miette!(help = help, "{error}")
}
