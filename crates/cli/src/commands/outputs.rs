//! What a command writes: to where it may, and how.

use std::fs::File;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

pub use imu_stand::capture::mark_simulated;
use imu_stand::capture::{CaptureError, SIMULATED, unpacked, write_capture};
use miette::{IntoDiagnostic, Result};
use model::record::Record;
use serde::Serialize;

/// Stands for standard input or output in place of a file.
pub const DASH: &str = "-";

/// Whether a result goes to standard output; what is said to people then goes to standard error.
static STDOUT_IS_TAKEN: AtomicBool = AtomicBool::new(false);

/// Whether standard output is for a result alone.
pub fn stdout_is_taken() -> bool {
    STDOUT_IS_TAKEN.load(Ordering::Relaxed)
}

/// Looks, before any work, at everything that a command will write: nothing goes over an input, over another output,
/// or over what was measured.
pub struct Outputs {
    /// Option and file of what is read, and of what is going to be written.
    taken: Vec<(&'static str, PathBuf)>,
}

/// Endings of files that hold data: no JSON, report or model goes over one.
const DATA: [&str; 16] = [
    "csv", "gz", "zst", "bz2", "raw", "npz", "npy", "parquet", "pq", "mat", "h5", "hdf5", "mcap",
    "bag", "ulg", "db3",
];

/// Endings that promise another form of table than the text that a capture is.
const OTHER_TABLES: [&str; 7] = ["npz", "npy", "parquet", "pq", "mat", "h5", "hdf5"];

/// Endings of a page, and those that promise another form of document.
const PAGE: [&str; 3] = ["html", "htm", "xhtml"];
const OTHER_DOCUMENTS: [&str; 18] = [
    "pdf", "txt", "text", "md", "json", "csv", "toml", "yaml", "yml", "xml", "svg", "png", "jpg",
    "doc", "docx", "odt", "rtf", "tex",
];

/// Refuses to write a page to a file whose name says that it is something else.
pub fn named_as_page(option: &str, path: Option<&PathBuf>) -> Result<()> {
    let ending = path.map(|path| ending(path)).unwrap_or_default();
    let help = match ending.as_str() {
        "pdf" => {
            "`imu-stand report CAPTURE --pdf report.pdf` prints one, beside the page, with Chromium, Chrome or Edge"
        }
        "txt" | "text" | "md" => {
            "name it .html; `imu-stand diagnose CAPTURE --details` prints the answers as text"
        }
        "json" => "name it .html; `imu-stand diagnose CAPTURE --json FILE` writes JSON",
        _ => "name it .html",
    };
    if let Some(path) = path.filter(|_| OTHER_DOCUMENTS.contains(&ending.as_str())) {
        misused!(
            help = help,
            "{option}: {}: a report is a page of HTML, and would not be what its name says",
            path.display()
        );
    }
    Ok(())
}

/// Refuses to print a PDF to a file whose name says that it is the page.
pub fn named_as_pdf(option: &str, path: Option<&PathBuf>) -> Result<()> {
    if let Some(path) = path.filter(|path| PAGE.contains(&ending(path).as_str())) {
        misused!(
            help = "name it .pdf; `--out` names the page",
            "{option}: {}: it writes a PDF, and would not be what its name says",
            path.display()
        );
    }
    Ok(())
}

/// How a name ends, in small letters, without the dot.
fn ending(path: &Path) -> String {
    let ending = path.extension().and_then(|ending| ending.to_str());
    ending.map(str::to_ascii_lowercase).unwrap_or_default()
}

/// Refuses an output in a folder that is not there.
pub fn has_folder(option: &str, path: &Path) -> Result<()> {
    let folder = path.parent().filter(|f| !f.as_os_str().is_empty());
    match folder.filter(|folder| !folder.is_dir()) {
        None => Ok(()),
        Some(folder) => miette::bail!(
            help = "make it first, or name another file",
            "{option}: {} is no folder",
            folder.display()
        ),
    }
}

/// Refuses to write a capture, which is CSV, to a file whose name says that it is something else.
pub fn named_as_text(option: &str, path: &Path) -> Result<()> {
    if OTHER_TABLES.contains(&ending(path).as_str()) {
        misused!(
            help = "name it .csv or .csv.gz; `imu-stand export run.csv --out run.npz` (or .parquet) makes another form of it",
            "{option}: {}: a capture is CSV, and would not be what its name says",
            path.display()
        );
    }
    Ok(())
}

impl Outputs {
    /// With what the command reads.
    pub fn beside<'a>(inputs: impl IntoIterator<Item = &'a PathBuf>) -> Self {
        let taken = inputs.into_iter().map(|path| ("", path.clone())).collect();
        Self { taken }
    }

    /// A result that can be made again: JSON, a report, a model.
    pub fn result(mut self, option: &'static str, path: Option<&PathBuf>) -> Result<Self> {
        if let Some(path) = self.add(option, path)?
            && let Some(ending) = path.extension().and_then(|e| e.to_str())
            && DATA.contains(&ending.to_ascii_lowercase().as_str())
        {
            return Err(refused(option, path, "holds data"));
        }
        Ok(self)
    }

    /// A report, one page of HTML.
    pub fn page(self, option: &'static str, path: Option<&PathBuf>) -> Result<Self> {
        named_as_page(option, path)?;
        self.result(option, path)
    }

    /// Data in another form.
    pub fn data(mut self, option: &'static str, path: Option<&PathBuf>) -> Result<Self> {
        if let Some(path) = self.add(option, path)?
            && has_header(path, "# start_unix_s:")
        {
            return Err(refused(option, path, "is a capture of a board"));
        }
        Ok(self)
    }

    /// A simulated capture. It can be had again by its seed, and goes over another one; what a board delivered cannot.
    pub fn simulated(mut self, option: &'static str, path: Option<&PathBuf>) -> Result<Self> {
        path.map_or(Ok(()), |path| named_as_text(option, path))?;
        if let Some(path) = self.add(option, path)? {
            if has_header(path, "# start_unix_s:") {
                return Err(refused(option, path, "is a capture of a board"));
            }
            if !has_header(path, &format!("# {SIMULATED}:")) {
                return Err(refused(option, path, "does not say that it was simulated"));
            }
        }
        Ok(self)
    }

    /// Takes a file; returns it where it is there already.
    fn add<'a>(
        &mut self,
        option: &'static str,
        path: Option<&'a PathBuf>,
    ) -> Result<Option<&'a PathBuf>> {
        let Some(path) = path else { return Ok(None) };
        if path.as_os_str() == DASH {
            if STDOUT_IS_TAKEN.swap(true, Ordering::Relaxed) {
                misused!(
                    help = "name a file for all but one of them",
                    "{option}: two results cannot both go to standard output"
                );
            }
            return Ok(None);
        }
        if let Some((other, _)) = self.taken.iter().find(|(_, taken)| same(taken, path)) {
            match *other {
                "" => misused!(
                    help = "name another file",
                    "{option}: {} is read by this command, and is not written over",
                    path.display()
                ),
                other => misused!(
                    help = "name two files",
                    "{option}: {other} writes {}, too",
                    path.display()
                ),
            }
        }
        has_folder(option, path)?;
        if path.is_dir() {
            miette::bail!(
                help = "name a file in it",
                "{option}: {} is a folder",
                path.display()
            );
        }
        self.taken.push((option, path.clone()));
        // Devices and pipes lose nothing.
        Ok(path.is_file().then_some(path))
    }
}

fn refused(option: &str, path: &Path, is: &str) -> miette::Report {
    miette::miette!(
        help = "name another file, or move that one away",
        "{option}: {} is there already and {is}: it is not written over",
        path.display()
    )
}

/// Whether two names mean one file, through links, too; the file need not be there yet.
fn same(a: &Path, b: &Path) -> bool {
    let place = |path: &Path| {
        let folder = path.parent().filter(|f| !f.as_os_str().is_empty());
        let folder = folder.unwrap_or(Path::new(".")).canonicalize().ok()?;
        Some(folder.join(path.file_name()?))
    };
    same_file::is_same_file(a, b).unwrap_or_else(|_| place(a).is_some_and(|a| Some(a) == place(b)))
}

/// Whether one of the `#` lines that a file begins with starts so.
fn has_header(path: &Path, start: &str) -> bool {
    let Ok(file) = File::open(path) else {
        return false;
    };
    let Ok(input) = unpacked(BufReader::new(file)) else {
        return false;
    };
    // The header of a capture is short; the line of a file without ends need not be.
    (input.take(1 << 16).lines())
        .map_while(|line| line.ok().filter(|line| line.starts_with('#')))
        .any(|line| line.starts_with(start))
}

/// Writes a text file; `-` is standard output.
pub fn write(path: &Path, text: &str) -> Result<()> {
    if path.as_os_str() == DASH {
        return to_stdout(|out| out.write_all(text.as_bytes()));
    }
    std::fs::write(path, text).map_err(|error| failed(path, &error))
}

/// Writes a record as a capture.
pub fn write_record(path: &Path, record: &Record) -> Result<()> {
    write_capture(path, record).map_err(|error| match error {
        CaptureError::Io { path, source } => failed(&path, &source),
        error => miette::Report::new(error),
    })
}

/// Writes to standard output. A reader that has had enough is no failure.
pub fn to_stdout(write: impl FnOnce(&mut dyn Write) -> std::io::Result<()>) -> Result<()> {
    let mut out = std::io::BufWriter::new(std::io::stdout().lock());
    match write(&mut out).and_then(|()| out.flush()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(failed(Path::new("standard output"), &error))
        }
        _ => Ok(()),
    }
}

/// A file that cannot be written, and what to do. A part of it that fitted on a full disk does not stay: it would be taken
/// for the whole.
pub fn failed(path: &Path, error: &std::io::Error) -> miette::Report {
    use std::io::ErrorKind as Kind;
    let is_full = matches!(error.kind(), Kind::StorageFull | Kind::QuotaExceeded);
    if is_full && path.is_file() {
        let _ = std::fs::remove_file(path);
    }
    let help = match error.kind() {
        Kind::StorageFull | Kind::QuotaExceeded => "make room, or name a file on another disk",
        Kind::IsADirectory => "name a file in it",
        Kind::PermissionDenied | Kind::ReadOnlyFilesystem => {
            "name a file where you may write, or change its rights"
        }
        _ => "does its folder exist, and may you write there?",
    };
    miette::miette!(help = help, "cannot write {}: {error}", path.display())
}

/// Writes what a command found as JSON, where it was asked to.
pub fn write_json(path: Option<&PathBuf>, value: &impl Serialize) -> Result<()> {
    let Some(path) = path else { return Ok(()) };
    let mut text = serde_json::to_string_pretty(value).into_diagnostic()?;
    text.push('\n');
    write(path, &text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_fitted_on_a_full_disk_does_not_stay() {
        let path = std::env::temp_dir().join(format!("imu-stand-full-{}", std::process::id()));
        let left_by = |kind: std::io::ErrorKind| {
            std::fs::write(&path, "a half").expect("a file");
            let said = format!("{:?}", failed(&path, &kind.into()));
            (path.exists(), said)
        };
        let (is_there, said) = left_by(std::io::ErrorKind::StorageFull);
        assert!(!is_there && said.contains("make room"), "{said}");
        assert!(left_by(std::io::ErrorKind::PermissionDenied).0);
        std::fs::remove_file(&path).expect("it was there");
    }
}
