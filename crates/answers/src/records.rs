//! The records: every kind that the engine meets, each drawn from a fixed seed.

use std::path::PathBuf;

use campaign::{Family, Size};
use diagnosis::{DiagnoseOptions, diagnose};
use imu_stand::ReadOptions;
use imu_stand::capture::{ColumnMapping, read_capture, read_from, write_to};
use imu_stand::stand::{Hidden, Sizes, plan, run_native};
use model::ModelFile;
use model::docs::example;
use model::effects::EFFECTS;
use model::record::{Channel, Record};
use noise::{AnalyzeOptions, analyze};
use serde_json::{Value, json};

/// Seed of every draw.
const SEED: u64 = 2009;
/// Length of a run of the bench, s: the paper's.
const BENCH_SECONDS: f64 = 600.0;
/// Length of a simulated example, s: long enough for every effect to show.
const EXAMPLE_SECONDS: f64 = 300.0;
/// Rates other than 20 Hz, and lengths that take about as long each: Hz, s.
const ELSEWHERE: [(f64, f64); 4] = [(1.0, 3600.0), (5.0, 1200.0), (100.0, 120.0), (1000.0, 20.0)];
/// Effects simulated at these rates: the noise, a mean, a tone, a process.
const AT_RATES: [&str; 4] = ["temperature", "line", "gauss_markov", "outliers"];

/// A record, and how its answer is made.
pub struct Entry {
    /// Its name: kind and what is in it.
    pub name: String,
    /// The answer as JSON.
    pub answer: Box<dyn Fn() -> Value + Sync>,
}

/// An entry whose record is made anew when it is asked.
fn entry(
    name: String,
    full: bool,
    record: impl Fn() -> Result<Record, String> + Sync + 'static,
) -> Entry {
    let file = name.clone();
    Entry {
        name,
        answer: Box::new(move || match record() {
            Ok(record) => answer(&record, &file, full),
            Err(what) => json!({ "error": what }),
        }),
    }
}

/// What the engine says of a record; `full` with the analysis and the figures.
fn answer(record: &Record, file: &str, full: bool) -> Value {
    let options = DiagnoseOptions {
        seed: SEED,
        file: file.to_owned(),
        hash: None,
        no_evidence: !full,
        ..DiagnoseOptions::default()
    };
    let diagnosed = match diagnose(record, &options) {
        Ok(d) => json!({
            "diagnosis": d.diagnosis,
            "baseline_model": d.baseline_model.to_toml(),
            "extended_model": d.extended_model.to_toml(),
            "evidence": d.evidence,
        }),
        Err(e) => json!({ "error": e.to_string() }),
    };
    let analyzed = full.then(|| {
        let options = AnalyzeOptions {
            seed: SEED,
            ..AnalyzeOptions::default()
        };
        analyze(record, &options).map_or_else(|e| json!(e.to_string()), |a| json!(a))
    });
    json!({ "diagnosed": diagnosed, "analyzed": analyzed })
}

/// All records.
///
/// # Errors
/// When `IMU_STAND_DATA` names no folder with the measured records.
pub fn all() -> Result<Vec<Entry>, String> {
    let mut all = of_campaign();
    all.extend(of_bench());
    all.extend(of_model());
    all.extend(with_gaps());
    match std::env::var_os("IMU_STAND_DATA") {
        Some(folder) => all.extend(measured(PathBuf::from(folder))?),
        None => println!("IMU_STAND_DATA is unset: no measured records"),
    }
    Ok(all)
}

/// Every row of the campaign's tables once, clean runs at every rate, and some pairs.
fn of_campaign() -> Vec<Entry> {
    let more = |family: Family| match family {
        Family::Clean => 6,
        Family::Elsewhere => 6,
        Family::Pair => 12,
        _ => 1,
    };
    campaign::cases(Size::even(1), None)
        .into_iter()
        .flat_map(|(family, _)| (0..more(family)).map(move |index| (family, index)))
        .map(|(family, index)| Entry {
            name: format!("campaign {} {index}", family.label()),
            answer: Box::new(move || {
                let (planted, diagnosis) = campaign::case::describe(SEED, family, index);
                json!({ "planted": planted, "diagnosis": diagnosis })
            }),
        })
        .collect()
}

/// Every kind hidden in the simulated stand, through the firmware's logic and a capture file.
fn of_bench() -> Vec<Entry> {
    std::iter::once(Hidden::None)
        .chain(Hidden::ALL)
        .enumerate()
        .map(|(i, hidden)| {
            entry(format!("hidden {hidden:?}"), i % 3 == 0, move || {
                let plan = plan(hidden, Sizes::Visible, BENCH_SECONDS, SEED + i as u64);
                let (record, _) = run_native(&plan, |_| {});
                let mut file = Vec::new();
                write_to(&mut file, &record).map_err(|e| e.to_string())?;
                let read = read_from(file.as_slice(), &ReadOptions::default());
                read.map(|r| r.record).map_err(|e| e.to_string())
            })
        })
        .collect()
}

fn simulated(model: &ModelFile, seconds: f64, rate_hz: f64) -> Result<Record, String> {
    model::simulate(model, seconds, rate_hz, SEED).map_err(|e| e.to_string())
}

/// The example of every effect at 20 Hz, and some at other rates.
fn of_model() -> Vec<Entry> {
    let mut all: Vec<Entry> = EFFECTS
        .iter()
        .map(|effect| {
            entry(format!("example {}", effect.id()), true, || {
                simulated(&example(*effect, true), EXAMPLE_SECONDS, 20.0)
            })
        })
        .collect();
    for (rate_hz, seconds) in ELSEWHERE {
        for effect in EFFECTS.iter().filter(|e| AT_RATES.contains(&e.id())) {
            let name = format!("rate {rate_hz} Hz {}", effect.id());
            all.push(entry(name, false, move || {
                simulated(&example(*effect, true), seconds, rate_hz)
            }));
        }
        all.push(entry(
            format!("rate {rate_hz} Hz nothing"),
            true,
            move || simulated(&ModelFile::paper(), seconds, rate_hz),
        ));
    }
    all
}

/// Rows that are missing: single ones, blocks, bursts that are left.
fn with_gaps() -> Vec<Entry> {
    type Kept = fn(usize) -> bool;
    let gaps: [(&str, Kept); 3] = [
        ("single", |i| {
            !i.wrapping_mul(2_654_435_761).is_multiple_of(97)
        }),
        ("block", |i| {
            !(2000..2600).contains(&i) && !(4000..4010).contains(&i)
        }),
        ("bursts", |i| i % 500 < 200),
    ];
    let effects = ["temperature", "line", "gauss_markov", "telegraph"];
    let mut all = vec![];
    for (kind, kept) in gaps {
        for effect in EFFECTS.iter().filter(|e| effects.contains(&e.id())) {
            let name = format!("gaps {kind} {}", effect.id());
            all.push(entry(name, effect.id() == "line", move || {
                let record = simulated(&example(*effect, true), EXAMPLE_SECONDS, 20.0)?;
                Ok(rows(&record, kept))
            }));
        }
    }
    all
}

/// The rows of a record that are kept.
fn rows(record: &Record, kept: impl Fn(usize) -> bool) -> Record {
    fn those<T: Copy>(all: &[T], kept: impl Fn(usize) -> bool) -> Vec<T> {
        let numbered = all.iter().enumerate().filter(|(i, _)| kept(*i));
        numbered.map(|(_, v)| *v).collect()
    }
    Record {
        header: record.header.clone(),
        seq: record.seq.as_deref().map(|c| those(c, &kept)),
        t_ticks: record.t_ticks.as_deref().map(|c| those(c, &kept)),
        host_time_s: record.host_time_s.as_deref().map(|c| those(c, &kept)),
        flags: record.flags.as_deref().map(|c| those(c, &kept)),
        channels: (record.channels.iter())
            .map(|c| Channel {
                values: those(&c.values, &kept),
                counts: c.counts.as_deref().map(|c| those(c, &kept)),
                ..c.clone()
            })
            .collect(),
        notes: record.notes.clone(),
    }
}

/// A measured file, how it is read, and which of its rows.
struct Excerpt {
    file: &'static str,
    columns: &'static str,
    units: &'static str,
    rate_hz: Option<f64>,
    rows: std::ops::Range<usize>,
}

const RATES: &str = "gyro_x=gx_dps,gyro_y=gy_dps,gyro_z=gz_dps";
const ALL: &str =
    "gyro_x=gx_dps,gyro_y=gy_dps,gyro_z=gz_dps,acc_x=ax_mps2,acc_y=ay_mps2,acc_z=az_mps2";
const TIMED: &str = "time=time_s,gyro_x=gx_dps,gyro_y=gy_dps,gyro_z=gz_dps,temp=temp_c";
const HEATED: &str = "gyro_x=gx_dps,gyro_y=gy_dps,gyro_z=gz_dps,temp=temp_c";
const EXCERPTS: &[Excerpt] = &[
    Excerpt {
        file: "adis16405_run1_20hz_600s.csv.gz",
        columns: ALL,
        units: "gyro=deg/s,acc=m/s2",
        rate_hz: Some(20.0),
        rows: 0..usize::MAX,
    },
    Excerpt {
        file: "adis16405_run1_100hz.csv.gz",
        columns: RATES,
        units: "gyro=deg/s",
        rate_hz: Some(100.0),
        rows: 200_000..212_000,
    },
    Excerpt {
        file: "adis16405_run1_100hz.csv.gz",
        columns: ALL,
        units: "gyro=deg/s,acc=m/s2",
        rate_hz: Some(100.0),
        rows: 500_000..512_000,
    },
    Excerpt {
        file: "mpu6050_static_20hz_600s.csv.gz",
        columns: HEATED,
        units: "gyro=deg/s,temp=degC",
        rate_hz: Some(19.864),
        rows: 0..usize::MAX,
    },
    Excerpt {
        file: "mpu6050_static_100hz_655s.csv.gz",
        columns: HEATED,
        units: "gyro=deg/s,temp=degC",
        rate_hz: Some(99.32),
        rows: 0..12_000,
    },
    Excerpt {
        file: "pan_tvac_bursts_50hz.csv.gz",
        columns: TIMED,
        units: "gyro=deg/s,temp=degC",
        rate_hz: None,
        rows: 0..usize::MAX,
    },
    Excerpt {
        file: "pan_tvac_spliced_50hz.csv.gz",
        columns: HEATED,
        units: "gyro=deg/s,temp=degC",
        rate_hz: Some(50.0),
        rows: 0..usize::MAX,
    },
    Excerpt {
        file: "aux_ocxo_fractional_freq_1hz.csv.gz",
        columns: "time=time_s,other=y",
        units: "",
        rate_hz: Some(1.0),
        rows: 0..8000,
    },
];

fn measured(folder: PathBuf) -> Result<Vec<Entry>, String> {
    let mut all = vec![];
    for (i, e) in EXCERPTS.iter().enumerate() {
        let path = folder.join(e.file);
        if !path.exists() {
            return Err(format!("{} does not exist", path.display()));
        }
        let given = |text: &'static str| (!text.is_empty()).then_some(text);
        let options = ReadOptions {
            mapping: ColumnMapping::parse(given(e.columns), given(e.units))
                .map_err(|e| e.to_string())?,
            rate_hz: e.rate_hz,
            skip_bad: false,
            ..ReadOptions::default()
        };
        all.push(entry(format!("measured {i} {}", e.file), true, move || {
            let read = read_capture(&path, &options).map_err(|e| e.to_string())?;
            Ok(rows(&read.record, |row| e.rows.contains(&row)))
        }));
    }
    Ok(all)
}
