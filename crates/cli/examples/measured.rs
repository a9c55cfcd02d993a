//! How the model that is handed over holds measured records: each part of 600 s of each record of a folder.
//!
//! `cargo run --release -p imu-stand --example measured -- ../shared/data`: by channel the chance of the part among the
//! replicates of its models before and after, its causes (`~`: immaterial) and its entries without a name; at the end how many
//! channels are held, and how many causes and entries a channel has.

use std::ops::Range;
use std::path::Path;

use diagnosis::replicates::REPLICATES;
use diagnosis::{DiagnoseOptions, diagnose};
use imu_stand::{ReadOptions, read_capture};
use model::record::{Channel, Record};

type Fallible<T> = Result<T, Box<dyn std::error::Error>>;

/// Records of gyros at rest, and parts that are taken of each at most.
const RECORDS: [(&str, usize); 5] = [
    ("adis16405_run1_100hz.csv.gz", 16),
    ("adis16405_run1_20hz_600s.csv.gz", 1),
    ("mpu6050_static_20hz_600s.csv.gz", 1),
    ("mpu6050_static_100hz_655s.csv.gz", 1),
    ("pan_tvac_spliced_50hz.csv.gz", 1),
];
/// Length of a part, s.
const PART_S: f64 = 600.0;

/// Rows of a record.
fn part(of: &Record, rows: Range<usize>) -> Record {
    let taken = |c: &Channel| Channel {
        values: c.values[rows.clone()].to_vec(),
        counts: c.counts.as_ref().map(|v| v[rows.clone()].to_vec()),
        ..c.clone()
    };
    Record {
        header: of.header.clone(),
        host_time_s: of.host_time_s.as_ref().map(|t| t[rows.clone()].to_vec()),
        channels: of.channels.iter().map(taken).collect(),
        ..Record::default()
    }
}

fn main() -> Fallible<()> {
    let folder = std::env::args()
        .nth(1)
        .ok_or("name the folder of the records")?;
    let (mut held, mut entries) = (0, vec![]);
    for (file, most) in RECORDS {
        // Its rows have no times, and its name says its rate.
        let rate_hz = file.contains("spliced").then_some(50.0);
        let options = ReadOptions {
            rate_hz,
            ..ReadOptions::default()
        };
        let read = read_capture(&Path::new(&folder).join(file), &options)?;
        let times = read.record.host_time_s.as_deref().unwrap_or_default();
        let timed = times.iter().take_while(|t| **t - times[0] < PART_S).count();
        let length = if timed > 0 { timed } else { read.record.len() };
        let parts = (read.record.len() / length.max(1)).min(most);
        for k in 0..parts {
            let record = part(&read.record, k * length..(k + 1) * length);
            let options = DiagnoseOptions {
                no_evidence: true,
                replicates: REPLICATES,
                ..DiagnoseOptions::default()
            };
            let d = diagnose(&record, &options)?.diagnosis;
            for (name, r) in &d.replicates {
                held += usize::from(r.after.holds());
                let causes: Vec<String> = (d.findings.iter())
                    .filter(|f| f.channels.contains(name))
                    .map(|f| format!("{}{}", f.cause, if f.material { "" } else { "~" }))
                    .collect();
                let left = d.unexplained.iter().filter(|u| u.channel == *name);
                let left: Vec<&str> = left.map(|u| u.what.as_str()).collect();
                entries.push(causes.len() + left.len());
                let [before, after] = [r.before.p_value, r.after.p_value];
                let why = if r.after.holds() {
                    String::new()
                } else {
                    format!(" ({})", r.after.strays())
                };
                println!("{file} {k} {name}: {before:.3} -> {after:.3}{why} {causes:?} {left:?}");
            }
        }
    }
    entries.sort_unstable();
    let middle = entries.get(entries.len() / 2).copied().unwrap_or(0);
    let last = entries.last().copied().unwrap_or(0);
    println!(
        "{held} of {} channels held; causes and entries a channel: median {middle}, most {last}",
        entries.len()
    );
    Ok(())
}
