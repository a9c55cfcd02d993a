//! What holds for any bytes in a file: an answer or an error in words, and what is read is what it claims to be. Used by `fuzz/`
//! and, on stable, by crates/cli/tests/fuzz.rs.

use std::path::PathBuf;

use imu_stand::capture::{Read, read_from};
use imu_stand::{CaptureError, ColumnMapping, ReadOptions, read_capture};
use model::{ModelFile, simulate};

/// A name, and what it checks.
pub type Target = (&'static str, fn(&[u8]));

/// All of them.
pub const TARGETS: [Target; 10] = [
    ("capture", text),
    ("mapping", mapping),
    ("model", model_file),
    ("npy", |bytes| file("npy", bytes)),
    ("npz", |bytes| file("npz", bytes)),
    ("parquet", |bytes| file("parquet", bytes)),
    ("mat", |bytes| file("mat", bytes)),
    ("hdf5", |bytes| file("h5", bytes)),
    ("log", text),
    ("packed", text),
];

/// Checks one of them.
///
/// # Panics
/// Where there is none of that name, and where something is found.
#[allow(dead_code, reason = "the driver on stable goes through the list")]
pub fn check(name: &str, bytes: &[u8]) {
    let target = TARGETS.iter().find(|(own, _)| *own == name);
    target.expect("a target of the list").1(bytes);
}

/// Characters of an error with its help: what a person reads.
const WORDS: usize = 6_000;

/// What was read holds together, or the error can be shown.
fn answered(read: Result<Read, CaptureError>) {
    let error = match read {
        Ok(read) => {
            let record = &read.record;
            for channel in &record.channels {
                assert_eq!(channel.values.len(), record.len(), "{}", channel.name);
            }
            let times = record.host_time_s.as_ref();
            assert!(times.is_none_or(|times| times.len() == record.len()));
            return;
        }
        Err(error) => error,
    };
    let help = miette::Diagnostic::help(&error).map_or_else(String::new, |help| help.to_string());
    let words = error.to_string().chars().count() + help.chars().count();
    assert!(words < WORDS, "{words} characters: {error}");
}

/// Text, a log or something packed, by its first bytes.
fn text(bytes: &[u8]) {
    for skip_bad in [false, true] {
        let options = ReadOptions {
            skip_bad,
            ..ReadOptions::default()
        };
        let read = imu_stand::capture::unpacked(bytes);
        answered(match read {
            Ok(text) => read_from(text, &options),
            Err(_) => return,
        });
    }
}

/// Two lines, `--columns` and `--units`, and a table behind them.
fn mapping(bytes: &[u8]) {
    let mut parts = bytes.splitn(3, |byte| *byte == b'\n');
    let mut line = || String::from_utf8_lossy(parts.next().unwrap_or_default()).into_owned();
    let (columns, units) = (line(), line());
    let table = parts.next().unwrap_or_default();
    let some = |text: &str| (!text.is_empty()).then(|| text.to_owned());
    let parsed = ColumnMapping::parse(some(&columns).as_deref(), some(&units).as_deref());
    match parsed {
        Ok(mapping) => answered(read_from(
            table,
            &ReadOptions {
                mapping,
                ..ReadOptions::default()
            },
        )),
        Err(error) => assert!(error.to_string().chars().count() < WORDS),
    }
}

/// A model file: what is read is written and read again alike, and can be simulated, or says why not.
fn model_file(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return;
    };
    match ModelFile::parse(text) {
        Ok(model) => {
            let again = ModelFile::parse(&model.to_toml()).expect("what was written can be read");
            assert_eq!(again.to_toml(), model.to_toml());
            if let Ok(record) = simulate(&model, 2.0, 20.0, 1) {
                // An effect may drop samples.
                assert!(record.len() <= 40, "{}", record.len());
            }
        }
        Err(error) => assert!(error.to_string().chars().count() < WORDS),
    }
}

/// A file that is known by its ending.
fn file(ending: &str, bytes: &[u8]) {
    let path = folder().join(format!("input.{ending}"));
    std::fs::write(&path, bytes).expect("room for a small file");
    answered(read_capture(&path, &ReadOptions::default()));
}

/// Where inputs become files: in memory where there is such a place.
pub fn folder() -> PathBuf {
    let memory = PathBuf::from("/dev/shm");
    let base = if memory.is_dir() {
        memory
    } else {
        std::env::temp_dir()
    };
    let folder = base.join(format!("imu-stand-fuzz-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder for inputs");
    folder
}
