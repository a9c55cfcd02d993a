//! A file that was dropped on the page, and what is asked of it.

use diagnosis::DiagnoseOptions;
use diagnosis::result::Diagnosed;
use imu_stand::capture::{CaptureError, Read, Span, read_from, unpacked};
use imu_stand::explain::explain;
use imu_stand::report::{Subject, report};
use imu_stand::text::{self, shell_word};
use imu_stand::{ColumnMapping, ReadOptions};
use miette::Diagnostic;
use noise::AnalyzeOptions;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};

/// What can be asked, in this order.
#[derive(Debug, Deserialize)]
#[serde(tag = "do", rename_all = "snake_case")]
enum Request {
    /// Reads the file.
    Read {
        /// Its name.
        name: String,
        /// How.
        #[serde(flatten)]
        how: How,
    },
    /// The analysis.
    Analyze,
    /// The diagnosis, as JSON, as text, and the extended model.
    Diagnose,
    /// The report.
    Report,
}

/// As `--columns`, `--units`, `--rate` and `--span` of the program.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct How {
    columns: String,
    units: String,
    rate_hz: Option<f64>,
    span: String,
}

impl How {
    fn options(&self) -> Result<ReadOptions, CaptureError> {
        let span = said(&self.span).map(str::parse::<Span>).transpose();
        Ok(ReadOptions {
            mapping: ColumnMapping::parse(said(&self.columns), said(&self.units))?,
            rate_hz: self.rate_hz,
            span: span.map_err(|why| CaptureError::Option {
                option: "--span",
                why: format!("`{}`", self.span),
                help: format!("it {why}"),
            })?,
            ..ReadOptions::default()
        })
    }

    /// The program's words for it.
    fn words(&self) -> Vec<String> {
        let texts = [
            ("--columns", &self.columns),
            ("--units", &self.units),
            ("--span", &self.span),
        ];
        let texts = texts.into_iter().filter_map(|(option, text)| {
            said(text).map(|value| format!("{option} {}", shell_word(value)))
        });
        let rate = self.rate_hz.map(|rate| format!("--rate {rate}"));
        texts.chain(rate).collect()
    }
}

/// What stands in a field; nothing where it is empty.
fn said(field: &str) -> Option<&str> {
    Some(field.trim()).filter(|text| !text.is_empty())
}

/// Why something was not done.
#[derive(Debug, Serialize)]
struct Failure {
    what: String,
    help: Option<String>,
    /// A mapping for the file, where the program proposes one: columns and units.
    proposal: Option<[String; 2]>,
    /// The first part of a file with two sample rates.
    span: Option<String>,
}

impl Failure {
    fn of(error: &dyn Diagnostic) -> Self {
        Self {
            what: error.to_string(),
            help: error.help().map(|help| help.to_string()),
            proposal: None,
            span: None,
        }
    }

    fn out_of_turn() -> Self {
        Self {
            what: "nothing was read yet".to_owned(),
            help: None,
            proposal: None,
            span: None,
        }
    }
}

impl From<CaptureError> for Failure {
    fn from(error: CaptureError) -> Self {
        let mut failure = Self::of(&error);
        match &error {
            CaptureError::Columns { example, .. } => {
                failure.proposal = Some(["--columns", "--units"].map(|name| option(example, name)));
            }
            CaptureError::TwoRates { at_s, .. } => failure.span = Some(format!(",{at_s:.6}")),
            _ => {}
        }
        failure
    }
}

/// The value of an option in a line for a shell, without its quotes; nothing where it has none.
fn option(line: &str, name: &str) -> String {
    let Some((_, rest)) = line.split_once(name) else {
        return String::new();
    };
    let rest = rest.trim_start();
    let value = match rest.strip_prefix('\'') {
        Some(quoted) => quoted.split('\'').next(),
        None => rest.split_whitespace().next(),
    };
    value.unwrap_or_default().to_owned()
}

/// What is known of a file so far.
#[derive(Debug, Default)]
pub struct Session {
    read: Option<Opened>,
    diagnosed: Option<Diagnosed>,
}

#[derive(Debug)]
struct Opened {
    read: Read,
    name: String,
    hash: String,
    command: String,
}

impl Session {
    /// Answers a request about a file: `{"ok": ...}`, or `{"failed": {"what", "help", "proposal"}}`.
    #[must_use]
    pub fn answer(&mut self, file: &[u8], request: &str) -> String {
        let answer = match serde_json::from_str(request) {
            Ok(request) => self.done(file, request),
            Err(error) => Err(Failure {
                what: format!("the page asks `{request}`: {error}"),
                help: Some("this is a defect: report it".to_owned()),
                proposal: None,
                span: None,
            }),
        };
        match answer {
            Ok(value) => json!({ "ok": value }),
            Err(failure) => json!({ "failed": failure }),
        }
        .to_string()
    }

    fn done(&mut self, file: &[u8], request: Request) -> Result<Value, Failure> {
        match request {
            Request::Read { name, how } => self.open(file, name, &how),
            Request::Analyze => self.analyzed(),
            Request::Diagnose => self.diagnosed(),
            Request::Report => self.reported(),
        }
    }

    fn open(&mut self, file: &[u8], name: String, how: &How) -> Result<Value, Failure> {
        *self = Self::default();
        let options = how.options()?;
        let text = unpacked(file).map_err(|source| CaptureError::Io {
            path: name.clone().into(),
            source,
        })?;
        let read = read_from(text, &options)?;
        let mut words = vec![
            "imu-stand".to_owned(),
            "diagnose".to_owned(),
            shell_word(&name),
        ];
        words.extend(how.words());
        words.push("--report report.html".to_owned());
        let said = json!({
            "samples": read.record.len(),
            "channels": read.record.channels.iter().map(|c| &c.name).collect::<Vec<_>>(),
            "notes": read.record.notes,
        });
        self.read = Some(Opened {
            read,
            hash: format!("sha256:{:x}", Sha256::digest(file)),
            name,
            command: words.join(" "),
        });
        Ok(said)
    }

    fn opened(&self) -> Result<&Opened, Failure> {
        self.read.as_ref().ok_or_else(Failure::out_of_turn)
    }

    fn analyzed(&self) -> Result<Value, Failure> {
        let opened = self.opened()?;
        let options = AnalyzeOptions {
            file: opened.name.clone(),
            ..AnalyzeOptions::default()
        };
        let analysis = noise::analyze(&opened.read.record, &options)
            .map_err(|error| Failure::of(&*explain(error)))?;
        Ok(json!({ "json": pretty(&analysis)? }))
    }

    fn diagnosed(&mut self) -> Result<Value, Failure> {
        let opened = self.opened()?;
        let options = DiagnoseOptions {
            file: opened.name.clone(),
            hash: Some(opened.hash.clone()),
            replicates: diagnosis::replicates::REPLICATES,
            ..DiagnoseOptions::default()
        };
        let diagnosed = diagnosis::diagnose(&opened.read.record, &options)
            .map_err(|error| Failure::of(&*explain(error)))?;
        let model = diagnosed.extended_model.clone();
        let said = json!({
            "json": pretty(&diagnosed.diagnosis)?,
            "text": text::diagnosis(&diagnosed, opened.read.record.header.base),
            "model": model.excited_like(&opened.read.record).to_toml(),
        });
        self.diagnosed = Some(diagnosed);
        Ok(said)
    }

    fn reported(&self) -> Result<Value, Failure> {
        let opened = self.opened()?;
        let diagnosed = self.diagnosed.as_ref().ok_or_else(Failure::out_of_turn)?;
        let subject = Subject {
            record: &opened.read.record,
            diagnosed,
            rate_hz: None,
            command: &opened.command,
            seed: DiagnoseOptions::default().seed,
            hash: Some(&opened.hash),
            hidden: None,
        };
        let page = report(&subject).map_err(|error| Failure {
            what: format!("no report: {error}"),
            help: Some("text and JSON give the same answers".to_owned()),
            proposal: None,
            span: None,
        })?;
        Ok(json!({ "html": page }))
    }
}

/// JSON as the program writes it.
fn pretty(value: &impl Serialize) -> Result<String, Failure> {
    let text = serde_json::to_string_pretty(value).map_err(|error| Failure {
        what: error.to_string(),
        help: None,
        proposal: None,
        span: None,
    })?;
    Ok(text + "\n")
}
