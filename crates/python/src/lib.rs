//! The engine of `imu-stand` for Python: the module `imu_stand._engine`, on which the package `imu_stand` stands.
//!
//! Numbers come and go as the bytes of `float64` arrays, results as the JSON that the program writes; what Python's users
//! see of it is made in `python/imu_stand`. Whatever computes lets go of the interpreter's lock.

use std::fs::File;
use std::path::PathBuf;

use diagnosis::DiagnoseOptions;
use diagnosis::result::Diagnosed;
use imu_stand::capture::{Read, Span, Table, mark_simulated, read_capture, read_columns};
use imu_stand::explain::explain;
use imu_stand::report::{Subject, report};
use imu_stand::{ColumnMapping, ReadOptions, text, write_capture};
use model::ModelFile;
use model::record::Record;
use noise::AnalyzeOptions;
use pyo3::create_exception;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use sha2::{Digest, Sha256};

create_exception!(
    imu_stand,
    Error,
    PyValueError,
    "What the engine cannot do, and what to do about it."
);

/// Pairs of texts: ours and theirs, channel and unit, key and value.
type Pairs = Vec<(String, String)>;

/// An error with what to do about it, in a line of its own.
fn failed(error: &dyn miette::Diagnostic) -> PyErr {
    let mut said = error.to_string();
    if let Some(help) = error.help() {
        said += &format!("\n{help}");
    }
    Error::new_err(said)
}

fn reported(error: miette::Report) -> PyErr {
    failed(&*error)
}

fn json(value: &impl serde::Serialize) -> PyResult<String> {
    serde_json::to_string(value).map_err(|error| Error::new_err(error.to_string()))
}

/// A record, as the reader of captures made it.
#[pyclass(frozen, module = "imu_stand._engine")]
struct Capture {
    record: Record,
    file: String,
    hash: Option<String>,
}

impl Capture {
    fn new(read: Read, file: String) -> Self {
        Self {
            record: read.record,
            file,
            hash: None,
        }
    }
}

#[pymethods]
impl Capture {
    /// Name, unit and the bytes of the readings of each channel.
    fn channels<'py>(&self, py: Python<'py>) -> Vec<(String, String, Bound<'py, PyBytes>)> {
        let channels = self.record.channels.iter();
        channels
            .map(|c| (c.name.clone(), c.unit.clone(), bytes(py, &c.values)))
            .collect()
    }

    /// Bytes of the times in s, where the record has any.
    fn times<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyBytes>> {
        let record = &self.record;
        let ticks = record.t_ticks.as_ref().zip(record.header.tick_s);
        let times = ticks.map(|(ticks, tick_s)| {
            let times = ticks.iter().map(|t| *t as f64 * tick_s);
            times.collect::<Vec<f64>>()
        });
        let times = times.as_ref().or(record.host_time_s.as_ref())?;
        Some(bytes(py, times))
    }

    /// The lines of its header.
    fn header(&self) -> Pairs {
        self.record.header.entries.clone()
    }

    /// What a reader of results has to know of its rows.
    fn notes(&self) -> Vec<String> {
        self.record.notes.clone()
    }

    /// Writes it as the program does.
    fn write(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        py.detach(|| write_capture(&path, &self.record))
            .map_err(|error| failed(&error))
    }
}

fn bytes<'py>(py: Python<'py>, values: &[f64]) -> Bound<'py, PyBytes> {
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_ne_bytes()).collect();
    PyBytes::new(py, &bytes)
}

/// Reads a file as the program does.
#[pyfunction]
#[expect(
    clippy::too_many_arguments,
    reason = "the arguments of `imu_stand.read`, which names them"
)]
fn read(
    py: Python<'_>,
    path: PathBuf,
    columns: Pairs,
    units: Pairs,
    rate_hz: Option<f64>,
    skip_bad: bool,
    topic: Option<String>,
    span: Option<(f64, f64)>,
) -> PyResult<Capture> {
    let no_span = || {
        Error::new_err(
            "span: two times, s from the first row, the later one second\nspan=(None, 60) or span=(60, None) leaves an end out",
        )
    };
    let span = match span {
        Some((from_s, to_s)) => Some(Span::new(from_s, to_s).ok_or_else(no_span)?),
        None => None,
    };
    let options = ReadOptions {
        mapping: ColumnMapping { columns, units },
        rate_hz,
        skip_bad,
        topic,
        span,
        base: None,
    };
    let mut hash = Sha256::new();
    py.detach(|| {
        File::open(&path).and_then(|mut file| std::io::copy(&mut file, &mut hash))?;
        let file = path.file_name().unwrap_or(path.as_os_str());
        let file = file.to_string_lossy().into_owned();
        let read = read_capture(&path, &options).map_err(|error| failed(&error))?;
        let hash = Some(format!("sha256:{:x}", hash.finalize()));
        Ok(Capture {
            hash,
            ..Capture::new(read, file)
        })
    })
}

/// A record of arrays; `about` is what a header would say.
#[pyfunction]
fn from_columns(
    py: Python<'_>,
    arrays: Vec<(String, Bound<'_, PyBytes>)>,
    about: Pairs,
    columns: Pairs,
    units: Pairs,
    rate_hz: Option<f64>,
    file: String,
) -> PyResult<Capture> {
    let mut table = Table {
        about,
        ..Table::default()
    };
    for (name, bytes) in arrays {
        table.names.push(name);
        let numbers = bytes.as_bytes().as_chunks::<8>().0;
        let numbers = numbers.iter().map(|number| f64::from_ne_bytes(*number));
        table.columns.push(numbers.collect());
    }
    let options = ReadOptions {
        mapping: ColumnMapping { columns, units },
        rate_hz,
        ..ReadOptions::default()
    };
    let read = py.detach(|| read_columns(table, &options));
    Ok(Capture::new(read.map_err(|error| failed(&error))?, file))
}

/// The JSON of an analysis.
#[pyfunction]
fn analyze(
    py: Python<'_>,
    capture: &Capture,
    deviations: Vec<String>,
    taus: &str,
    channels: Option<Vec<String>>,
    seed: u64,
) -> PyResult<String> {
    let unknown = |error| reported(explain(error));
    let deviations = deviations.iter().map(|name| name.parse());
    let options = AnalyzeOptions {
        deviations: deviations.collect::<Result<_, _>>().map_err(unknown)?,
        taus: taus.parse().map_err(unknown)?,
        channels,
        rate_hz: None,
        seed,
        file: capture.file.clone(),
    };
    let analysis = py.detach(|| noise::analyze(&capture.record, &options));
    json(&analysis.map_err(|error| reported(explain(error)))?)
}

/// A diagnosis and the record that it is of, for the report.
#[pyclass(frozen, module = "imu_stand._engine")]
struct Diagnosis {
    capture: Py<Capture>,
    diagnosed: Diagnosed,
    seed: u64,
}

#[pymethods]
impl Diagnosis {
    /// As the program writes it.
    fn json(&self) -> PyResult<String> {
        json(&self.diagnosed.diagnosis)
    }

    /// As the program prints it.
    fn text(&self) -> String {
        text::diagnosis(&self.diagnosed, self.capture.get().record.header.base)
            .trim_end()
            .to_owned()
    }

    /// The extended model, as a file.
    fn model(&self) -> String {
        let model = self.diagnosed.extended_model.clone();
        model.excited_like(&self.capture.get().record).to_toml()
    }

    /// The report, a page of HTML.
    fn report(&self, py: Python<'_>) -> PyResult<String> {
        let capture = self.capture.get();
        let subject = Subject {
            record: &capture.record,
            diagnosed: &self.diagnosed,
            rate_hz: None,
            command: "imu_stand.diagnose(...)",
            seed: self.seed,
            hash: capture.hash.as_deref(),
            hidden: None,
        };
        py.detach(|| report(&subject))
            .map_err(|error| Error::new_err(error.to_string()))
    }
}

/// Diagnoses a record; its gyros, or the channels that are named.
#[pyfunction]
#[pyo3(signature = (capture, channels, seed, replicates, matters))]
fn diagnose(
    py: Python<'_>,
    capture: Py<Capture>,
    channels: Option<Vec<String>>,
    seed: u64,
    replicates: usize,
    matters: f64,
) -> PyResult<Diagnosis> {
    let given = capture.get();
    let options = DiagnoseOptions {
        seed,
        file: given.file.clone(),
        hash: given.hash.clone(),
        no_evidence: false,
        replicates,
        matters,
    };
    let diagnosed = py.detach(|| match &channels {
        Some(channels) => diagnosis::diagnose_channels(&given.record, channels, &options),
        None => diagnosis::diagnose(&given.record, &options),
    });
    let diagnosed = diagnosed.map_err(|error| reported(explain(error)))?;
    Ok(Diagnosis {
        capture,
        diagnosed,
        seed,
    })
}

/// A model file, and what to call it; without one the paper's stand.
fn parsed(model: Option<&(String, String)>) -> PyResult<(ModelFile, String)> {
    let Some((text, name)) = model else {
        return Ok((ModelFile::paper(), "the paper".to_owned()));
    };
    let model = ModelFile::parse(text).map_err(|error| {
        Error::new_err(format!(
            "{name}: {error}\ndocs/model-file.md lists keys, effects and units"
        ))
    })?;
    Ok((model, name.clone()))
}

/// What a plan is asked for.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct Wanted {
    want: Option<String>,
    separate: Option<String>,
    channel: Option<String>,
    rate_hz: Option<f64>,
    check: Option<usize>,
    seed: u64,
}

/// The JSON of a plan: by the noise of a record, of a model file (its text and its name), or of the paper.
#[pyfunction]
fn plan(
    py: Python<'_>,
    capture: Option<&Capture>,
    model: Option<(String, String)>,
    wanted: Wanted,
) -> PyResult<String> {
    use imu_stand::plan::{Request, of_model, of_record, plan};
    let request = Request {
        want: wanted.want.as_deref(),
        separate: wanted.separate.as_deref(),
        check: wanted.check,
        seed: wanted.seed,
    };
    request.check_any().map_err(reported)?;
    let (channel, rate) = (wanted.channel.as_deref(), wanted.rate_hz);
    let model = parsed(model.as_ref())?;
    let planned = py.detach(|| {
        let noise = match capture {
            Some(c) => of_record(&c.record, &c.file, channel, rate, wanted.seed),
            None => of_model(&model.0, &model.1, channel, rate),
        };
        plan(noise?, &request)
    });
    json(&planned.map_err(reported)?)
}

/// A record from a model file (its text and its name), and what a user is to be warned of.
#[pyfunction]
fn simulate(
    py: Python<'_>,
    model: Option<(String, String)>,
    seconds: f64,
    rate_hz: Option<f64>,
    seed: u64,
) -> PyResult<(Capture, Vec<String>)> {
    let (model, _) = parsed(model.as_ref())?;
    let rate_hz = rate_hz.unwrap_or(model.rate_hz);
    let silent = model::excitation::unexcited(&model).into_iter();
    let warnings = silent.map(|(cause, settings)| {
        let settings = settings.join(" or ");
        format!("{cause} will not show, nothing excites it: under [excitation], set {settings}")
    });
    let record = py.detach(|| model::simulate(&model, seconds, rate_hz, seed));
    let mut record = record.map_err(|error| {
        Error::new_err(format!(
            "{error}\nchoose `seconds` and `rate` accordingly; docs/model-file.md lists channels and effects"
        ))
    })?;
    mark_simulated(&mut record, "simulate");
    let capture = Capture {
        record,
        file: "simulated".to_owned(),
        hash: None,
    };
    Ok((capture, warnings.collect()))
}

/// The module.
#[pymodule]
fn _engine(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("Error", module.py().get_type::<Error>())?;
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("REPLICATES", diagnosis::replicates::REPLICATES)?;
    module.add("MATTERS", diagnosis::MATTERS)?;
    module.add_class::<Capture>()?;
    module.add_class::<Diagnosis>()?;
    module.add_function(wrap_pyfunction!(read, module)?)?;
    module.add_function(wrap_pyfunction!(from_columns, module)?)?;
    module.add_function(wrap_pyfunction!(analyze, module)?)?;
    module.add_function(wrap_pyfunction!(diagnose, module)?)?;
    module.add_function(wrap_pyfunction!(plan, module)?)?;
    module.add_function(wrap_pyfunction!(simulate, module)?)
}
