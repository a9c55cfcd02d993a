//! The runs of a campaign as they end, one line of JSON each, so that one that is cut off loses nothing: started again
//! with the same seed it takes up what is there. A run depends on the seed, its family, its number and the program
//! alone, not on the size of the campaign.

use std::fs::{File, OpenOptions};
use std::hash::{DefaultHasher, Hasher};
use std::io::{self, BufRead, BufReader, Write};
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::case::{Estimate, Hit, Outcome};
use crate::plant::labels;

/// First line: what made the rest.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Head {
    /// Digest of the program.
    pub program: u64,
    /// Seed.
    pub seed: u64,
    /// Day on which it began.
    pub date: String,
}

/// A log that is read back.
#[derive(Clone, Debug)]
pub struct Log {
    /// What made it.
    pub head: Head,
    /// Its runs.
    pub outcomes: Vec<Outcome>,
    /// Seconds that they took, wall time.
    pub seconds: f64,
}

/// NaN is no number of JSON: it is left out.
#[derive(Serialize, Deserialize)]
struct Line {
    row: String,
    index: u64,
    truths: Vec<(String, Option<f64>, Hit)>,
    wrong: Vec<String>,
    unexplained: Vec<String>,
    #[serde(default)]
    checks: Vec<Vec<String>>,
    estimates: Vec<(String, String, f64, f64, f64)>,
    walks: [f64; 3],
    strength: Option<f64>,
    seconds: f64,
    /// Wall time since the campaign began, s.
    since: f64,
}

fn number(v: f64) -> Option<f64> {
    v.is_finite().then_some(v)
}

/// The label of the tables that reads so.
fn label(text: &str) -> Option<&'static str> {
    labels().find(|l| *l == text)
}

impl Line {
    fn of(o: &Outcome, since: f64) -> Self {
        let truths = o.truths.iter().map(|t| (t.0.into(), number(t.1), t.2));
        let estimate = |e: &Estimate| {
            let numbers = [e.value, e.std_error, e.truth].map(number);
            let [Some(value), Some(std_error), Some(truth)] = numbers else {
                return None;
            };
            Some((e.label.into(), e.parameter.clone(), value, std_error, truth))
        };
        Self {
            row: o.family.label().into(),
            index: o.index,
            truths: truths.collect(),
            wrong: o.wrong.clone(),
            unexplained: o.unexplained.clone(),
            checks: o.checks.clone(),
            estimates: o.estimates.iter().filter_map(estimate).collect(),
            walks: o.walks,
            strength: number(o.strength),
            seconds: o.seconds,
            since,
        }
    }

    /// `None` for a row that the tables do not have.
    fn outcome(self) -> Option<Outcome> {
        let truth = |(text, d, hit): (String, Option<f64>, Hit)| {
            label(&text).map(|l| (l, d.unwrap_or(f64::NAN), hit))
        };
        let estimate = |(text, parameter, value, std_error, truth): (String, _, _, _, _)| {
            label(&text).map(|label| Estimate {
                label,
                parameter,
                value,
                std_error,
                truth,
            })
        };
        let truths: Option<Vec<_>> = self.truths.into_iter().map(truth).collect();
        let estimates: Option<Vec<_>> = self.estimates.into_iter().map(estimate).collect();
        Some(Outcome {
            family: crate::family_of(&self.row)?,
            index: self.index,
            truths: truths?,
            wrong: self.wrong,
            unexplained: self.unexplained,
            checks: self.checks,
            estimates: estimates?,
            walks: self.walks,
            strength: self.strength.unwrap_or(f64::NAN),
            seconds: self.seconds,
        })
    }
}

/// Digest of the program that runs.
///
/// # Errors
/// When its file cannot be read.
pub fn program() -> io::Result<u64> {
    let mut hasher = DefaultHasher::new();
    hasher.write(&std::fs::read(std::env::current_exe()?)?);
    Ok(hasher.finish())
}

/// Reads a log. A last line that is cut off is left out; runs of rows that there are no longer, too.
///
/// # Errors
/// When the file cannot be read or does not begin as a log does.
pub fn read(path: &Path) -> io::Result<Log> {
    let mut lines = BufReader::new(File::open(path)?).lines();
    let first = lines.next().transpose()?.unwrap_or_default();
    let head = serde_json::from_str(&first)?;
    let (mut outcomes, mut seconds) = (vec![], 0.0f64);
    for line in lines {
        if let Ok(line) = serde_json::from_str::<Line>(&line?) {
            seconds = seconds.max(line.since);
            outcomes.extend(line.outcome());
        }
    }
    outcomes.sort_by_key(|o| (o.family, o.index));
    outcomes.dedup_by_key(|o| (o.family, o.index));
    Ok(Log {
        head,
        outcomes,
        seconds,
    })
}

/// A log that is being written.
pub struct Writer(File);

impl Writer {
    /// Goes on with a log, or begins it.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn open(path: &Path, head: &Head, goes_on: bool) -> io::Result<Self> {
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder)?;
        }
        if goes_on {
            let mut file = OpenOptions::new().append(true).open(path)?;
            // What a cut left of a line ends here.
            writeln!(file)?;
            return Ok(Self(file));
        }
        let mut file = File::create(path)?;
        writeln!(file, "{}", serde_json::to_string(head)?)?;
        Ok(Self(file))
    }

    /// Adds a run that ended `since` seconds after the campaign began.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn add(&mut self, outcome: &Outcome, since: f64) -> io::Result<()> {
        let mut line = serde_json::to_string(&Line::of(outcome, since))?;
        line.push('\n');
        self.0.write_all(line.as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Family;

    fn outcome(index: u64) -> Outcome {
        Outcome {
            family: Family::One(2),
            index,
            truths: vec![("warm_up", 8.5, Hit::InSet)],
            wrong: vec!["line on gyro_x".into()],
            unexplained: vec![],
            checks: vec![],
            estimates: vec![Estimate {
                label: "warm_up",
                parameter: "amplitude".into(),
                value: 1.0,
                std_error: 0.1,
                truth: 0.9,
            }],
            walks: [0.0, 1e-3, 2e-3],
            strength: f64::NAN,
            seconds: 0.25,
        }
    }

    #[test]
    fn what_is_cut_off_in_a_line_is_taken_up_after_the_last_whole_one() {
        let path = std::env::temp_dir().join(format!("campaign-log-{}.jsonl", std::process::id()));
        let head = Head {
            program: 1,
            seed: 2,
            date: "2026-01-01".into(),
        };
        let mut writer = Writer::open(&path, &head, false).expect("begun");
        writer.add(&outcome(0), 1.0).expect("written");
        writer.add(&outcome(1), 2.5).expect("written");
        drop(writer);
        let text = std::fs::read_to_string(&path).expect("there");
        std::fs::write(&path, &text[..text.len() - 40]).expect("cut");
        let mut writer = Writer::open(&path, &head, true).expect("gone on");
        writer.add(&outcome(2), 4.0).expect("written");
        drop(writer);
        let log = read(&path).expect("read");
        std::fs::remove_file(&path).expect("removed");
        assert_eq!(log.head, head);
        assert_eq!(log.seconds, 4.0);
        let indices: Vec<u64> = log.outcomes.iter().map(|o| o.index).collect();
        assert_eq!(indices, [0, 2]);
        let (read, written) = (&log.outcomes[1], outcome(2));
        assert_eq!(format!("{read:?}"), format!("{written:?}"));
    }
}
