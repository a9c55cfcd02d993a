//! What the loop says: on the terminal, and as `--json` writes it.

use diagnosis::MATTERS;
use diagnosis::result::{Diagnosis, Finding};
use imu_stand::correct::{Change, Judged, NEAR, Needed, Proposed, Row, SPANS_S, short};
use imu_stand::stand::planted::Comparison;
use imu_stand::text;
use model::ModelFile;
use serde::Serialize;
use std::fmt::Write as _;

const GYROS: [&str; 3] = ["gyro_x", "gyro_y", "gyro_z"];
/// Causes that the board takes off, with the parameters that it has terms for.
const CORRECTED: [(&str, &[&str]); 7] = [
    ("temperature", &["slope"]),
    ("temperature_quadratic", &["curvature", "slope"]),
    (
        "motor_bias",
        &["at_full_duty", "surge_at_full_duty", "while_turning"],
    ),
    ("supply_sensitivity", &["slope"]),
    ("g_sensitivity", &["acc_x", "acc_y", "acc_z"]),
    ("cross_axis", &["from_gyro_x", "from_gyro_y", "from_gyro_z"]),
    ("scale_error", &["relative"]),
];
/// Standard errors beyond which a size is not 0 (95 %).
const NORMAL_95: f64 = 1.96;

/// The correction on the board.
#[derive(Serialize)]
struct Written {
    number: u16,
    changed: Vec<Change>,
    notes: Vec<String>,
}

/// The first record.
#[derive(Serialize)]
pub struct Recorded {
    /// Its length, s.
    pub seconds: f64,
    /// As asked for, s.
    asked_s: f64,
    /// What a record of that length, s, was too short for.
    pub needed: Option<Needed>,
    #[serde(skip)]
    pub needed_by_s: f64,
    /// What this one is too short for.
    pub left: Option<Needed>,
    /// The heater was to be on for so long and off for so long in turn, s.
    pub heater_s: Option<f64>,
}

impl Recorded {
    /// As long as asked for.
    pub fn new(asked_s: f64) -> Self {
        Self {
            seconds: asked_s,
            asked_s,
            needed: None,
            needed_by_s: asked_s,
            left: None,
            heater_s: None,
        }
    }

    /// Why it is as it is.
    fn line(&self) -> Option<String> {
        if self.seconds <= self.asked_s {
            return None;
        }
        let mut line = format!("{:.0} s", self.seconds);
        if let Some(half_s) = self.heater_s {
            let _ = write!(line, ", the heater on and off for {half_s:.0} s each");
        }
        match &self.needed {
            None => {
                line.push_str(", as long as the second: what that can show is to be in the model");
            }
            Some(needed) => {
                let _ = write!(line, ", because by {:.0} s {needed}", self.needed_by_s);
            }
        }
        if let Some(left) = &self.left {
            let _ = write!(
                line,
                "; by {:.0} s they would be off by {} deg over {:.0} s in the mean, where the noise alone leaves {}: for nine of ten \
                 records within {NEAR} times their noise {} on {} takes {:.0} s (`--longest {:.0}`)",
                self.seconds,
                short(left.expected_deg),
                left.span_s,
                short(left.floor_deg),
                left.cause,
                left.channel,
                left.seconds,
                left.seconds
            );
        }
        Some(wrapped(&format!("first record: {line}")))
    }
}

/// A line of the answer, not longer than a terminal's.
fn wrapped(line: &str) -> String {
    text::item("", line).trim_start().to_owned()
}

/// A cause that was corrected on an axis.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Cause {
    cause: String,
    channel: String,
}

/// What came of it.
#[derive(Serialize)]
pub struct Answer {
    format: &'static str,
    recorded: Recorded,
    correction: Written,
    /// Angle errors in the second history.
    angle_errors: Vec<Judged>,
    /// Corrected is worse than read somewhere, or the board did not apply the correction.
    worse: bool,
    corrected: Vec<Cause>,
    /// Causes that were corrected, and that the second diagnosis names on the same axis all the same, with a size that the
    /// board has a term for.
    still_named: Vec<Cause>,
    /// The same with sizes alone that the board has no term for.
    no_term: Vec<Cause>,
    /// What was planted beside what the first diagnosis found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub planted: Option<Comparison>,
    first: Vec<Diagnosis>,
    second: Vec<Diagnosis>,
}

/// The causes that a model has corrected, by axis.
pub fn corrected_causes(model: &ModelFile) -> Vec<Cause> {
    let effects = model.effects.iter();
    let those = effects.filter(|e| CORRECTED.iter().any(|(cause, _)| *cause == e.cause));
    let by_axis = those.flat_map(|effect| {
        let on =
            |gyro: &&str| effect.channels.is_empty() || effect.channels.iter().any(|c| c == gyro);
        GYROS.into_iter().filter(on).map(|channel| Cause {
            cause: effect.cause.clone(),
            channel: channel.to_owned(),
        })
    });
    let mut all: Vec<Cause> = by_axis.collect();
    // Several terms of one cause on one axis are one cause.
    all.sort_by(|a, b| (&a.channel, &a.cause).cmp(&(&b.channel, &b.cause)));
    all.dedup();
    all
}

impl Answer {
    pub fn new(
        model: &ModelFile,
        proposed: Proposed,
        recorded: Recorded,
        angle_errors: Vec<Judged>,
        planted: Option<Comparison>,
        first: Vec<Diagnosis>,
        second: Vec<Diagnosis>,
    ) -> Self {
        let corrected = corrected_causes(model);
        let (mut still_named, mut no_term) = (Vec::new(), Vec::new());
        for cause in &corrected {
            let mut findings = second.iter().flat_map(|d| &d.findings);
            let same = |f: &&Finding| f.cause == cause.cause && f.channels.contains(&cause.channel);
            match findings.find(same) {
                Some(finding) if has_term(finding, &cause.channel) => {
                    still_named.push(cause.clone());
                }
                Some(_) => no_term.push(cause.clone()),
                None => {}
            }
        }
        let worse = angle_errors.iter().any(|judged| {
            judged.rows.iter().any(|row| row.worse) || judged.board.applied < 1.0 - MATTERS
        });
        Self {
            format: "imu-stand-loop/1",
            recorded,
            correction: Written {
                number: proposed.board.correction.number,
                changed: proposed.changed,
                notes: proposed.board.notes,
            },
            angle_errors,
            worse,
            corrected,
            still_named,
            no_term,
            planted,
            first,
            second,
        }
    }

    /// For people.
    pub fn lines(&self) -> Vec<String> {
        let mut lines: Vec<String> = self.recorded.line().into_iter().collect();
        lines.push(wrapped(&format!(
            "correction {:#06x} written, read back, in use; the same stand again under another history",
            self.correction.number
        )));
        let notes = self.correction.notes.iter();
        lines.extend(notes.map(|note| text::item("note: ", note)));
        lines.push(wrapped(
            "angle error, deg rms: read -> corrected (predicted by the model; limit: nothing wrong, same noise)",
        ));
        for judged in &self.angle_errors {
            for gyro in GYROS {
                let mut name = format!("{gyro}, {}", judged.what);
                for span in SPANS_S {
                    let mut rows = judged.rows.iter();
                    let row = rows.find(|row| row.channel == gyro && row.span_s == span);
                    let cell = row.map_or_else(|| "-".to_owned(), cell);
                    lines.push(format!("    {name:<18}{:>6}  {cell}", format!("{span} s")));
                    name.clear();
                }
            }
        }
        let flags = self.angle_errors.iter().flat_map(flags);
        lines.extend(flags.map(|line| wrapped(&line)));
        lines.push(wrapped(&self.named()));
        lines
    }

    /// What the second diagnosis says of what was corrected.
    fn named(&self) -> String {
        let list = |causes: &[Cause]| {
            let words: Vec<String> = (causes.iter())
                .map(|c| format!("{} on {}", c.cause, c.channel))
                .collect();
            words.join(", ")
        };
        if self.corrected.is_empty() {
            return "the first diagnosis found nothing that the board has a term for: the correction is its bias filter"
                .to_owned();
        }
        let mut words = if self.still_named.is_empty() {
            format!(
                "diagnosed again, the corrected rates no longer show: {}",
                list(&self.corrected)
            )
        } else {
            format!(
                "diagnosed again, the corrected rates still show: {} (corrected: {})",
                list(&self.still_named),
                list(&self.corrected)
            )
        };
        if !self.no_term.is_empty() {
            let _ = write!(
                words,
                "; what stays of {} is what the board has no term for",
                list(&self.no_term)
            );
        }
        words
    }
}

/// Whether a finding has a size, other than 0, that the board has a term for.
fn has_term(finding: &Finding, channel: &str) -> bool {
    let terms = CORRECTED.iter().find(|(cause, _)| *cause == finding.cause);
    let own = finding
        .per_channel
        .get(channel)
        .unwrap_or(&finding.parameters);
    terms.is_none_or(|(_, names)| {
        names.iter().any(|name| {
            own.get(*name)
                .is_some_and(|p| p.value.abs() > NORMAL_95 * p.std_error.unwrap_or(0.0))
        })
    })
}

fn cell(row: &Row) -> String {
    let limit = row
        .limit_deg
        .map_or(String::new(), |limit| format!("; {}", short(limit)));
    format!(
        "{} -> {} ({}{limit}){}",
        short(row.before_deg),
        short(row.after_deg),
        short(row.predicted_deg),
        if row.worse { " !" } else { "" }
    )
}

/// What is to be looked at.
fn flags(judged: &Judged) -> Vec<String> {
    let mut lines = Vec::new();
    let worse: Vec<String> = (judged.rows.iter().filter(|row| row.worse))
        .map(|row| format!("{} over {} s", row.channel, row.span_s))
        .collect();
    if !worse.is_empty() {
        lines.push(format!(
            "! WORSE than the rates as they are read, {}: {}. The model is wrong or stale: `imu-stand board correct --off`, then record and diagnose anew",
            judged.what,
            worse.join(", ")
        ));
    }
    let board = &judged.board;
    let percent = |share: f64| 100.0 * share;
    if board.applied < 1.0 - MATTERS {
        lines.push(format!(
            "the board applied the correction in {:.0} % of {} frames only: the gyros are not set up as it wants them",
            percent(board.applied),
            board.frames
        ));
    }
    if board.extrapolated > 0.0 {
        lines.push(format!(
            "{}: in {:.1} % of the frames a temperature was outside the range that the model was fitted on",
            judged.what,
            percent(board.extrapolated)
        ));
    }
    if judged.what == "at rest" && board.refused > MATTERS {
        lines.push(format!(
            "the bias filter refused what it read at rest in {:.0} % of the frames: a slow turn, a step, or a wrong model",
            percent(board.refused)
        ));
    }
    if judged.what == "at rest" && board.noise_off > MATTERS {
        lines.push(format!(
            "in {:.0} % of the frames the noise was far from what the model says",
            percent(board.noise_off)
        ));
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_first_record_is_still_too_short_for_is_no_contradiction() {
        let by = |seconds: f64, expected_deg: f64| Needed {
            seconds,
            cause: "temperature".to_owned(),
            channel: "gyro_x",
            span_s: 600.0,
            expected_deg,
            floor_deg: 14.4,
        };
        let recorded = Recorded {
            seconds: 7200.0,
            needed: Some(by(7200.0, 23.0)),
            needed_by_s: 600.0,
            left: Some(by(14_040.0, 14.4)),
            ..Recorded::new(600.0)
        };
        let line = recorded.line().expect("it was taken again");
        let line = line.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(
            line.ends_with(
                "by 7200 s they would be off by 14.4 deg over 600 s in the mean, where the noise alone leaves 14.4: for nine of ten \
                 records within 1.15 times their noise temperature on gyro_x takes 14040 s (`--longest 14040`)"
            ),
            "{line}"
        );
        assert_eq!(Recorded::new(600.0).line(), None);
    }

    #[test]
    fn no_line_is_longer_than_a_terminals() {
        let row = |channel: &'static str, span_s: f64| Row {
            channel,
            span_s,
            before_deg: 320.123,
            after_deg: 106.861,
            predicted_deg: 114.512,
            limit_deg: Some(108.631),
            worse: true,
        };
        let rows = GYROS
            .iter()
            .flat_map(|gyro| SPANS_S.map(|span| row(gyro, span)));
        let cells: Vec<String> = rows.map(|row| cell(&row)).collect();
        assert!(
            cells.iter().all(|cell| cell.len() < 80 - 4 - 18 - 8),
            "{cells:?}"
        );
        let line = wrapped(&"corrected rates no longer show ".repeat(9));
        assert!(
            line.lines().all(|line| line.chars().count() <= 80),
            "{line}"
        );
    }
}
