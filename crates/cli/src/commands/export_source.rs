//! What `export` was given: a capture, an analysis, a diagnosis or a model, told apart by what is in the file.

use std::io::Read as _;
use std::path::Path;

use diagnosis::result::{DIAGNOSIS_FORMAT, Diagnosis};
use imu_stand::export::noise::ImuNoise;
use miette::Result;
use model::file::FORMAT as MODEL_FORMAT;
use noise::analyze::{ANALYSIS_FORMAT, Analysis};
use serde::Deserialize;

/// What a file holds.
pub enum Source {
    /// Rows, which are analyzed.
    Capture,
    /// What `analyze --json` wrote.
    Analysis(Box<Analysis>),
    /// Noise after its causes: of a diagnosis or a model.
    Ready(Box<ImuNoise>),
}

impl Source {
    /// Whether N and K in it are those after the causes.
    pub fn is_after_causes(&self) -> bool {
        matches!(self, Source::Ready(_))
    }
}

/// Bytes of a file by which it is recognised. A model begins with its format, below comments at most.
const START: u64 = 1 << 14;

/// How a file begins; nothing of one that cannot be read, which is told by who reads it.
fn start_of(path: &Path) -> Vec<u8> {
    let mut start = Vec::new();
    let is_dash = path.as_os_str() == super::outputs::DASH;
    if !is_dash && let Ok(file) = std::fs::File::open(path) {
        let _ = file.take(START).read_to_end(&mut start);
    }
    start
}

/// Whether a file begins like a model.
fn is_model(start: &[u8]) -> bool {
    let is_toml = |line: &[u8]| line.starts_with(b"format") && !line.contains(&b',');
    start.split(|b| *b == b'\n').any(is_toml) && contains(start, MODEL_FORMAT.as_bytes())
}

/// Refuses a file that begins as no model does, and says how one is made.
pub fn has_model(path: &Path) -> Result<()> {
    let start = start_of(path);
    if !start.is_empty() && !is_model(&start) {
        miette::bail!(
            help = "`imu-stand diagnose CAPTURE --model-out model.toml` writes one",
            "{} is no model file: no line of it says `format = \"{MODEL_FORMAT}\"`",
            path.display()
        );
    }
    Ok(())
}

/// What a file is, by how it begins; its content where that is no capture.
pub fn recognise(path: &Path) -> Result<Source> {
    let start = start_of(path);
    let begins = start.trim_ascii_start();
    if begins.starts_with(b"{") {
        return json(path);
    }
    if is_model(&start) {
        let model = super::read_model(path)?;
        return Ok(Source::Ready(Box::new(ImuNoise::of_model(&model))));
    }
    Ok(Source::Capture)
}

fn contains(text: &[u8], word: &[u8]) -> bool {
    text.windows(word.len()).any(|window| window == word)
}

/// The one key by which JSON of ours is told apart.
#[derive(Deserialize)]
struct Format {
    #[serde(default)]
    format: String,
}

fn json(path: &Path) -> Result<Source> {
    const HELP: &str = "`imu-stand diagnose C --json D` writes a diagnosis, `imu-stand analyze C --json A` an analysis";
    let text = super::read_text(path)?;
    let wrong = |what: &str, error: serde_json::Error| {
        miette::miette!(help = HELP, "{} is no {what}: {error}", path.display())
    };
    let format: Format = serde_json::from_str(&text).map_err(|e| wrong("JSON", e))?;
    match format.format.as_str() {
        ANALYSIS_FORMAT => {
            let analysis = serde_json::from_str(&text).map_err(|e| wrong("analysis", e))?;
            Ok(Source::Analysis(Box::new(analysis)))
        }
        DIAGNOSIS_FORMAT => {
            let diagnosis: Diagnosis =
                serde_json::from_str(&text).map_err(|e| wrong("diagnosis", e))?;
            let noise = ImuNoise::of_diagnosis(&diagnosis).ok_or_else(|| {
                miette::miette!(
                    help = "diagnose the capture again, or export the model that `diagnose --model-out` wrote",
                    "{} does not say which noise is left after its causes: an older program wrote it",
                    path.display()
                )
            })?;
            Ok(Source::Ready(Box::new(noise)))
        }
        other => miette::bail!(
            help = HELP,
            "{}: the format is `{}`, expected `{DIAGNOSIS_FORMAT}` or `{ANALYSIS_FORMAT}`",
            path.display(),
            other.chars().take(60).collect::<String>().escape_debug()
        ),
    }
}
