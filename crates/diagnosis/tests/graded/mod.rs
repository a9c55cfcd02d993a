//! Effects and causes hidden in simulated runs of the paper's stand, and what is told of them, graded by rate as in
//! `closed_loop`.

#[path = "../draws/mod.rs"]
pub mod draws;

use diagnosis::result::Diagnosis;
use diagnosis::{DiagnoseOptions, diagnose};
use model::ModelFile;
use model::record::{Quantity, Record};
use rand_core::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

/// Runs of a test; `draws` says how many of them a sample makes.
pub const RUNS: u64 = 8;
/// Right answers that it asks for.
pub const LEAST: u64 = 7;

/// Ten minutes of the stand with an excitation.
pub fn record(excitation: &[(&str, f64)], seed: u64) -> Record {
    let mut model = ModelFile::paper();
    let moves = excitation.iter().map(|(k, v)| ((*k).to_owned(), *v));
    model.excitation.extend(moves);
    model::simulate(&model, 600.0, 20.0, seed).expect("a run")
}

/// Adds a signal to a channel, in counts.
pub fn add(record: &mut Record, name: &str, of: impl Fn(usize) -> f64) {
    let c = record.channels.iter_mut().find(|c| c.name == name);
    let values = &mut c.expect("a channel").values;
    let lsb = 0.07326;
    for (i, v) in values.iter_mut().enumerate() {
        *v = ((*v + of(i)) / lsb).round() * lsb;
    }
}

/// The first channel of a quantity.
pub fn values(record: &Record, quantity: Quantity) -> Vec<f64> {
    let c = record.channels.iter().find(|c| c.quantity == quantity);
    c.expect("a channel").values.clone()
}

/// What is told of a record.
pub fn told(record: &Record) -> Diagnosis {
    diagnose(record, &DiagnoseOptions::default())
        .expect("a diagnosis")
        .diagnosis
}

/// The causes that it names, with their channels.
pub fn named(d: &Diagnosis) -> Vec<(&str, &str)> {
    (d.findings.iter())
        .flat_map(|f| f.channels.iter().map(|c| (f.cause.as_str(), c.as_str())))
        .collect()
}

/// Draws and grades up to [`RUNS`] runs.
pub fn graded(what: &str, right: impl FnMut(u64, &mut Xoshiro256PlusPlus) -> Result<(), String>) {
    graded_over((RUNS, LEAST), what, right);
}

/// Draws and grades up to so many runs, of which at least so many have to be right.
pub fn graded_over(
    (runs, least): (u64, u64),
    what: &str,
    mut right: impl FnMut(u64, &mut Xoshiro256PlusPlus) -> Result<(), String>,
) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(0xc1a1);
    let told = draws::graded(runs, least, |run| right(run, &mut rng));
    assert!(told.is_ok(), "{what}: {}", told.unwrap_err());
}

/// An answer in short.
pub fn said(d: &Diagnosis) -> String {
    format!("{:?} | {:?}", named(d), d.unexplained)
}
