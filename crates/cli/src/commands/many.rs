//! Many captures at once: folders as input, and work in parallel in their order.

use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use indicatif::{ProgressBar, ProgressStyle};
use miette::{Result, miette};

use super::progress::beside_bar;

/// Endings of captures, packed or not.
const CAPTURES: [&str; 11] = [
    "csv", "txt", "npz", "npy", "parquet", "pq", "mat", "h5", "hdf5", "mcap", "bag",
];
const ALSO: [&str; 2] = ["ulg", "tsv"];
const PACKED: [&str; 4] = ["gz", "zst", "zstd", "bz2"];

/// The files that are named, folders by the captures in them, by name. Folders within folders are left alone.
pub fn captures(named: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let mut all = Vec::new();
    for path in named {
        if !path.is_dir() {
            all.push(path.clone());
            continue;
        }
        let entries =
            std::fs::read_dir(path).and_then(Iterator::collect::<std::io::Result<Vec<_>>>);
        let entries = entries.map_err(|error| super::unreadable(path, &error))?;
        let all_files: Vec<PathBuf> = entries.into_iter().map(|entry| entry.path()).collect();
        let files = all_files.iter().filter(|file| is_capture(file));
        let mut files: Vec<PathBuf> = files.cloned().collect();
        if files.is_empty() {
            let is_sqlite = |file: &PathBuf| file.extension().is_some_and(|e| e == "db3");
            return Err(miette!(
                help = match all_files.iter().find(|file| is_sqlite(file)) {
                    Some(file) => format!(
                        "{} is a rosbag2 in SQLite: make an MCAP of it, which is read, by `ros2 bag convert` or `mcap convert`",
                        file.display()
                    ),
                    None => "captures end in .csv, .csv.gz, .npz, .npy, .parquet, .mat, .h5, .mcap, .bag, .ulg or .txt".to_owned(),
                },
                "{}: no capture is in this folder",
                path.display()
            ));
        }
        files.sort();
        all.extend(files);
    }
    Ok(all)
}

fn is_capture(path: &Path) -> bool {
    let ending = |path: &Path| Some(path.extension()?.to_str()?.to_ascii_lowercase());
    let known = |e: String| CAPTURES.iter().chain(&ALSO).any(|known| *known == e);
    let packed = |e: &String| PACKED.contains(&e.as_str());
    let inner = match ending(path) {
        Some(e) if packed(&e) => path.file_stem().and_then(|stem| ending(Path::new(stem))),
        other => other,
    };
    path.is_file() && inner.is_some_and(known)
}

/// What `work` makes of each, in their order, by as many threads as there are processors.
pub fn in_parallel<T: Send>(
    all: &[PathBuf],
    is_quiet: bool,
    work: impl Fn(&Path) -> T + Sync,
) -> Vec<T> {
    let bar = match is_quiet || all.len() < 2 {
        true => ProgressBar::hidden(),
        false => ProgressBar::new(all.len() as u64),
    };
    let style = ProgressStyle::with_template("captures {bar:40} {pos}/{len}");
    bar.set_style(style.unwrap_or(ProgressStyle::default_bar()));
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let next = AtomicUsize::new(0);
    let done: Vec<Mutex<Option<T>>> = all.iter().map(|_| Mutex::new(None)).collect();
    let say = || format!("captures: {} of {} done", bar.position(), all.len());
    let side_by_side = || {
        std::thread::scope(|scope| {
            for _ in 0..threads.min(all.len()) {
                scope.spawn(|| {
                    while let Some((path, slot)) = {
                        let k = next.fetch_add(1, Ordering::Relaxed);
                        all.get(k).zip(done.get(k))
                    } {
                        let made = work(path);
                        if let Ok(mut slot) = slot.lock() {
                            *slot = Some(made);
                        }
                        bar.inc(1);
                    }
                });
            }
        })
    };
    beside_bar(is_quiet, say, side_by_side);
    bar.finish_and_clear();
    let made = done.into_iter().filter_map(|slot| slot.into_inner().ok());
    made.flatten().collect()
}
