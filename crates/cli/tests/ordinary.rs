//! Ordinary files, as loggers, spreadsheets and this program itself write them: what is read of them without a mapping or with a
//! short one, and what is said of it.

use std::path::PathBuf;

use imu_stand::capture::{Read, read_from, write_to};
use imu_stand::export::data::Table;
use imu_stand::{CaptureError, ColumnMapping, ReadOptions, read_capture};
use model::ModelFile;
use model::record::{Quantity, Record};

fn options(columns: &str, units: &str, rate_hz: Option<f64>) -> ReadOptions {
    ReadOptions {
        mapping: ColumnMapping::parse(Some(columns), Some(units)).expect("a mapping"),
        rate_hz,
        ..ReadOptions::default()
    }
}

fn read(text: &str, columns: &str, units: &str) -> Result<Read, CaptureError> {
    read_from(text.as_bytes(), &options(columns, units, None))
}

/// What is said of a record that is read.
fn notes(text: &str, columns: &str, units: &str) -> (Record, String) {
    let record = read(text, columns, units).expect("a table").record;
    let notes = record.notes.join("\n");
    (record, notes)
}

/// The whole text of an error, its help too.
fn refusal(text: &str, columns: &str, units: &str) -> String {
    let error = read(text, columns, units).expect_err("no record");
    let help = miette::Diagnostic::help(&error).map_or_else(String::new, |help| help.to_string());
    format!("{error}; {help}")
}

/// Rows of a time and a reading.
fn rows(count: usize, row: &dyn Fn(usize) -> String) -> String {
    (0..count).map(|k| row(k) + "\n").collect()
}

fn middle_step(record: &Record) -> f64 {
    let times = record.host_time_s.as_ref().expect("times");
    (times[times.len() - 1] - times[0]) / (times.len() - 1) as f64
}

#[test]
fn a_mapping_without_a_time_takes_the_one_column_that_calls_itself_one_and_says_so() {
    let row = |k: usize| format!("{:.2},{},{}", 0.01 * k as f64, k % 7, k % 5);
    let body = rows(50, &row);
    let (record, said) = notes(&format!("time_s,gx,gy\n{body}"), "gyro_x=gx", "gyro=deg/s");
    assert!((middle_step(&record) - 0.01).abs() < 1e-9);
    assert!(said.contains("the times are those of `time_s`"), "{said}");
    // In the unit that its name says.
    let body = rows(50, &|k| format!("{},{},{}", 10 * k, k % 7, k % 5));
    let (record, _) = notes(&format!("t_ms,gx,gy\n{body}"), "gyro_x=gx", "gyro=deg/s");
    assert!((middle_step(&record) - 0.01).abs() < 1e-9);
    // Which of two, nobody knows.
    let two = format!("time_s,timestamp_us,gyr\n{body}");
    let told = refusal(&two, "gyro_x=gyr", "gyro=deg/s");
    assert!(
        told.contains("several columns may be it: time_s, timestamp_us")
            && told.contains("`time=time_s`"),
        "{told}"
    );
    // Who says a rate does not want the times.
    let given = options("gyro_x=gyr", "gyro=deg/s", Some(100.0));
    let record = read_from(two.as_bytes(), &given).expect("a rate").record;
    assert!(record.host_time_s.is_none() && record.header.rate_hz == Some(100.0));
}

#[test]
fn a_rate_in_words_before_the_table_is_taken_where_nothing_else_says_it() {
    let body = rows(60, &|k| format!("{}\t{}\t{}\t", k, k % 7, k % 5));
    let mt = format!(
        "// Start Time: 0\n// Sample rate: 50.0Hz\n// Firmware Version: 2.5.1\nCounter\tGyr_X\tGyr_Y\t\n{body}"
    );
    let (record, said) = notes(&mt, "gyro_x=Gyr_X,gyro_y=Gyr_Y", "gyro=rad/s");
    assert_eq!(record.header.rate_hz, Some(50.0));
    assert!(
        said.contains("the sample rate is 50 Hz, as line 2 says (`// Sample rate: 50.0Hz`)"),
        "{said}"
    );
    // The mapping that is proposed does not ask for the rate any more.
    assert!(!refusal(&mt, "", "").contains("--rate"));
    // What is said by hand overrules it, and is told.
    let given = options("gyro_x=Gyr_X", "gyro=rad/s", Some(100.0));
    let record = read_from(mt.as_bytes(), &given).expect("a rate").record;
    let said = record.notes.join("\n");
    assert_eq!(record.header.rate_hz, Some(100.0));
    assert!(
        said.contains("100 Hz, as --rate says, although line 2 says 50 Hz"),
        "{said}"
    );
    for head in [
        "# Sampling rate [Hz]: 50",
        "# fs = 50",
        "Update Rate: 50.0Hz",
    ] {
        let text = format!(
            "{head}\nn,gx,gy\n{}",
            body.replace('\t', ",").replace(",\n", "\n")
        );
        let (record, said) = notes(&text, "gyro_x=gx", "gyro=deg/s");
        assert_eq!(record.header.rate_hz, Some(50.0), "{head}: {said}");
    }
}

#[test]
fn times_overrule_a_rate_in_words_and_two_rates_are_none() {
    let body = rows(60, &|k| {
        format!("{:.2},{},{}", 0.01 * k as f64, k % 7, k % 5)
    });
    let text = format!("# Sample rate: 256 Hz\ntime_s,gx,gy\n{body}");
    for columns in ["time=time_s,gyro_x=gx", "gyro_x=gx"] {
        let (record, said) = notes(&text, columns, "gyro=deg/s");
        assert!((middle_step(&record) - 0.01).abs() < 1e-9);
        assert!(
            said.contains("come at 100 Hz, although line 1 says 256 Hz")
                && said.contains("times are taken"),
            "{said}"
        );
    }
    let same = text.replace("256", "100");
    let (_, said) = notes(&same, "time=time_s,gyro_x=gx", "gyro=deg/s");
    assert!(!said.contains("Sample rate"), "{said}");
    let two = format!("# Gyro sample rate: 100 Hz\n# Accel sample rate: 50 Hz\nn,gx,gy\n{body}");
    let (record, said) = notes(&two, "gyro_x=gx", "gyro=deg/s");
    assert_eq!(record.header.rate_hz, None);
    assert!(said.contains("none of them is taken"), "{said}");
}

/// A capture of the paper's stand, with a channel of another kind beside.
fn simulated() -> Record {
    let mut record = model::simulate(&ModelFile::paper(), 20.0, 20.0, 1).expect("a run");
    let mut other = record.channels[0].clone();
    other.name = "flow".to_owned();
    other.quantity = Quantity::Other;
    other.axis = None;
    other.unit = "l/s".to_owned();
    other.counts = None;
    record.channels.push(other);
    let mut text = Vec::new();
    write_to(&mut text, &record).expect("room");
    let text = String::from_utf8(text).expect("text");
    read(&text, "", "").expect("a capture").record
}

#[test]
fn what_this_program_exports_is_read_again_whole_and_without_a_remark() {
    let record = simulated();
    let folder: PathBuf = std::env::temp_dir().join(format!("ordinary_{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("room");
    // A reading that is missing leaves its channel in degC, where the others are in counts.
    let mut lacking = record.clone();
    let hot = lacking
        .channels
        .iter_mut()
        .find(|c| c.quantity == Quantity::Temp);
    hot.expect("a thermometer").values[3] = f64::NAN;
    // And a record without ticks has its times alone.
    let mut timed = record.clone();
    timed.t_ticks = None;
    timed.header.entries.retain(|(key, _)| key != "rate_hz");
    for (name, record) in [("whole", &record), ("lacking", &lacking), ("timed", &timed)] {
        for raw in [false, true] {
            let table = Table::of(record, raw);
            for ending in ["csv", "csv.gz", "npz", "parquet"] {
                let path = folder.join(format!("{name}_{raw}.{ending}"));
                match ending {
                    "npz" => table.write_npz(&path),
                    "parquet" => table.write_parquet(&path),
                    _ => table.write_csv(&path),
                }
                .expect("room");
                let again = read_capture(&path, &ReadOptions::default())
                    .expect("an export")
                    .record;
                let which = format!("{name} {raw} {ending}");
                // One is true of it.
                let mut said = again.notes.clone();
                said.retain(|note| !note.contains("1 of 400 rows have no reading of"));
                assert_eq!(said, Vec::<String>::new(), "{which}");
                assert!(
                    again.t_ticks.is_some() || again.host_time_s.is_some(),
                    "{which}"
                );
                for channel in &record.channels {
                    let back = again.channel(&channel.name).expect(&channel.name);
                    assert_eq!(back.unit, channel.unit, "{which}: {}", channel.name);
                    let far = |(a, b): (&f64, &f64)| (a - b).abs() > 1e-9;
                    assert!(
                        !back.values.iter().zip(&channel.values).any(far),
                        "{which}: {}",
                        channel.name
                    );
                }
            }
        }
    }
    std::fs::remove_dir_all(&folder).expect("ours");
}

#[test]
fn thousands_are_read_where_they_can_be_nothing_else_and_refused_where_they_may_be_a_fraction() {
    let quoted = rows(40, &|k| {
        format!("{:.2},\"2,{}.33\",{}", 0.01 * k as f64, 299 + k, k % 5)
    });
    let (record, said) = notes(&format!("time_s,gyro_x,gyro_y\n{quoted}"), "", "gyro=deg/s");
    assert_eq!(record.len(), 40);
    assert_eq!(record.channels[0].values[1], 2300.33);
    assert!(said.contains("`2,299.33` is 2299.33"), "{said}");
    let german = rows(40, &|k| {
        format!("0,{:03};2.{},33;{}", 10 * k, 299 + k, k % 5)
    });
    let (record, _) = notes(&format!("time_s;gyro_x;gyro_y\n{german}"), "", "gyro=deg/s");
    assert_eq!(record.channels[0].values[1], 2300.33);
    // A decimal comma is one as before.
    let comma = rows(40, &|k| format!("0,{:03};2,{};{}", 10 * k, 299 + k, k % 5));
    let (record, said) = notes(&format!("time_s;gyro_x;gyro_y\n{comma}"), "", "gyro=deg/s");
    assert_eq!(record.channels[0].values[1], 2.3);
    assert!(!said.contains("thousands"), "{said}");
    // In quotes between commas, it may be either; and what was in groups is not left out as a bad row.
    let either = rows(40, &|k| format!("{k},\"2,{}\",{}", 299 + k, k % 5));
    let text = format!("time_ms,gyro_x,gyro_y\n{either}");
    for skip_bad in [false, true] {
        let options = ReadOptions {
            skip_bad,
            ..options("", "gyro=deg/s", None)
        };
        let told = read_from(text.as_bytes(), &options)
            .expect_err("two numbers")
            .to_string();
        assert!(
            told.contains("line 2") && told.contains("`2,299`") && told.contains("thousands"),
            "{told}"
        );
    }
    let mixed = format!("time_s;gyro_x;gyro_y\n{}", german.replace("0,0", "0.0"));
    let told = refusal(&mixed, "", "gyro=deg/s");
    assert!(told.contains("numbers before it have a point"), "{told}");
}
