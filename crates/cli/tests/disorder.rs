//! Captures whose rows are out of order, or cannot be read, and what a rate given means beside their times.

use imu_stand::capture::{Read, read_from, write_to};
use imu_stand::{CaptureError, ColumnMapping, ReadOptions};

/// Header, names and rows of a simulated capture of the stand.
fn capture(seconds: f64) -> (Vec<String>, Vec<String>) {
    let record = model::simulate(&model::ModelFile::paper(), seconds, 20.0, 5).expect("the stand");
    let mut text = Vec::new();
    write_to(&mut text, &record).expect("memory");
    let lines: Vec<String> = (String::from_utf8(text).expect("text").lines())
        .map(str::to_owned)
        .collect();
    let is_head = |line: &&String| line.starts_with('#') || line.starts_with("seq");
    let head: Vec<String> = lines.iter().take_while(is_head).cloned().collect();
    let rows = lines[head.len()..].to_vec();
    (head, rows)
}

/// Rows of a table of times in s and a gyro that says which row it is.
fn foreign(rows: usize) -> Vec<String> {
    let row = |k: usize| format!("{:.2},{k}", 0.05 * k as f64);
    (0..rows).map(row).collect()
}

/// All rows, in an order without rule: 7919 is a prime, no part of the lengths here.
fn shuffled(rows: &[String]) -> Vec<String> {
    let n = rows.len();
    (0..n).map(|k| rows[k * 7919 % n].clone()).collect()
}

/// One row in three changes places with one far away.
fn swapped(rows: &[String]) -> Vec<String> {
    let mut rows = rows.to_vec();
    let (half, last) = (rows.len() / 2, rows.len() - 1);
    (0..half).step_by(3).for_each(|k| rows.swap(k, last - k));
    rows
}

fn read(head: &[String], rows: &[String], options: &ReadOptions) -> Result<Read, CaptureError> {
    let text = [head, rows].concat().join("\n");
    read_from(text.as_bytes(), options)
}

fn mapped(columns: &str) -> ReadOptions {
    ReadOptions {
        mapping: ColumnMapping::parse(Some(columns), Some("gyro=deg/s")).expect("a mapping"),
        ..ReadOptions::default()
    }
}

#[test]
fn rows_in_any_order_are_read_as_in_theirs_and_the_places_are_told() {
    // More rows than half of what the number holds on the wire.
    let (head, rows) = capture(2000.0);
    let plain = read(&head, &rows, &ReadOptions::default()).expect("in order");
    for rows in [shuffled(&rows), swapped(&rows)] {
        let read = read(&head, &rows, &ReadOptions::default()).expect("out of order");
        assert!(read.record.seq == plain.record.seq && read.record.t_ticks == plain.record.t_ticks);
        assert!(read.record.channels == plain.record.channels);
        let notes = read.record.notes.join("; ");
        assert!(
            notes.contains("the time goes back at ") && notes.contains("put in order by sequence"),
            "{notes}"
        );
    }
    let head = ["t,gx".to_owned()];
    let rows = foreign(4000);
    for rows in [shuffled(&rows), swapped(&rows)] {
        let read = read(&head, &rows, &mapped("time=t,gyro_x=gx")).expect("out of order");
        let gyro = &read.record.channel("gyro_x").expect("a gyro").values;
        assert!(gyro.iter().enumerate().all(|(k, v)| *v == k as f64));
        let notes = read.record.notes.join("; ");
        assert!(notes.contains("put in order by their times"), "{notes}");
    }
    // An angle is differenced in order of time.
    let mut angle = mapped("time=t,gyro_x=gx");
    angle.mapping.units = vec![("gyro".to_owned(), "deg".to_owned())];
    let read = self::read(&head, &shuffled(&rows), &angle).expect("an angle");
    let gyro = &read.record.channel("gyro_x").expect("a gyro").values;
    assert!(gyro[..3999].iter().all(|v| (v - 20.0).abs() < 1e-6));
}

#[test]
fn times_that_are_none_are_refused_with_what_to_do() {
    let rows: Vec<String> = (0..400u32)
        .map(|k| format!("{},{k}", (f64::from(k) * 12.9898).sin() * 43.758_545_3))
        .collect();
    let error =
        read(&["t,gx".to_owned()], &rows, &mapped("time=t,gyro_x=gx")).expect_err("no times");
    let help = miette::Diagnostic::help(&error).map(|help| help.to_string());
    let said = format!("{error} {}", help.unwrap_or_default());
    for part in [
        "does not rise",
        "--columns time=",
        "--rate",
        "sort the rows",
    ] {
        assert!(said.contains(part), "{said}");
    }
}

/// Rows of which every fiftieth from the tenth on is another text.
fn spoilt(rows: &[String], as_what: impl Fn(&str) -> Option<String>) -> Vec<String> {
    let is_spoilt = |k: usize| k % 50 == 10;
    (rows.iter().enumerate())
        .filter_map(|(k, row)| {
            if is_spoilt(k) {
                as_what(row)
            } else {
                Some(row.clone())
            }
        })
        .collect()
}

#[test]
fn a_row_that_cannot_be_read_keeps_its_place_and_is_no_sample_that_was_lost() {
    let skip = |mut options: ReadOptions| {
        options.skip_bad = true;
        options
    };
    let (head, rows) = capture(150.0);
    let dropped = |read: &Read| {
        let options = diagnosis::DiagnoseOptions::default();
        let found = diagnosis::diagnose(&read.record, &options).expect("a diagnosis");
        let count = found.diagnosis.findings.iter();
        count
            .filter(|f| f.cause == "dropped_samples")
            .map(|f| f.parameters["count"].value)
            .sum::<f64>()
    };
    let cut = |row: &str| Some(row[..row.len() / 2].to_owned());
    let no_number = |row: &str| Some(row.replacen(',', ",x", 2));
    for rows in [spoilt(&rows, cut), spoilt(&rows, no_number)] {
        let read = read(&head, &rows, &skip(ReadOptions::default())).expect("a capture");
        assert_eq!((read.skipped, read.record.len()), (60, 3000));
        let seq = read.record.seq.as_ref().expect("numbers");
        assert!(seq.iter().enumerate().all(|(k, seq)| *seq == k as u64));
        let gyro = &read.record.channel("gyro_z").expect("a gyro").values;
        assert!(
            gyro.iter()
                .enumerate()
                .all(|(k, v)| v.is_nan() == (k % 50 == 10))
        );
        let notes = read.record.notes.join("; ");
        assert!(
            notes.contains(": 60; 60 of them keep their places"),
            "{notes}"
        );
        assert_eq!(dropped(&read), 0.0);
    }
    // Rows that never came are lost, and lines between rows that have no room for them are no rows.
    let lost = read(&head, &spoilt(&rows, |_| None), &ReadOptions::default()).expect("a capture");
    assert_eq!(dropped(&lost), 60.0);
    let more = spoilt(&rows, |row| Some(format!("junk\n{row}\njunk")));
    let more = read(&head, &more, &skip(ReadOptions::default())).expect("a capture");
    assert_eq!((more.skipped, more.record.len()), (120, 3000));
    assert_eq!(dropped(&more), 0.0);

    // By times, by nothing but the rows, and in any order.
    let head = ["t,gx".to_owned()];
    let rows = spoilt(&foreign(500), |_| Some("?,?".to_owned()));
    for columns in ["time=t,gyro_x=gx", "gyro_x=gx"] {
        let read = read(&head, &rows, &skip(mapped(columns))).expect(columns);
        let gyro = &read.record.channel("gyro_x").expect("a gyro").values;
        let is_right = |(k, v): (usize, &f64)| {
            if k % 50 == 10 {
                v.is_nan()
            } else {
                *v == k as f64
            }
        };
        assert!(
            gyro.len() == 500 && gyro.iter().enumerate().all(is_right),
            "{columns}"
        );
        if let Some(times) = &read.record.host_time_s {
            assert!((times[10] - 0.5).abs() < 1e-9, "{}", times[10]);
        }
    }
    let read = read(&head, &shuffled(&rows), &skip(mapped("time=t,gyro_x=gx"))).expect("any order");
    let gyro = &read.record.channel("gyro_x").expect("a gyro").values;
    let there = (0..500).filter(|k| k % 50 != 10);
    assert!(
        gyro.iter()
            .filter(|v| !v.is_nan())
            .copied()
            .eq(there.map(f64::from))
    );
}

#[test]
fn a_rate_given_is_for_files_without_times_and_refused_where_they_contradict_it() {
    let (head, rows) = capture(30.0);
    let at = |options: &ReadOptions, rate| ReadOptions {
        rate_hz: Some(rate),
        ..options.clone()
    };
    let (own, table) = (ReadOptions::default(), mapped("time=t,gyro_x=gx"));
    let names = ["t,gx".to_owned()];
    let even = foreign(400);
    for (head, rows, options) in [(&head[..], &rows, &own), (&names[..], &even, &table)] {
        let read_at = |rate| read(head, rows, &at(options, rate));
        assert_eq!(
            read_at(20.0).expect("its rate").record.header.rate_hz,
            Some(20.0)
        );
        for rate in [10.0, 40.0] {
            let error = read_at(rate).expect_err("another rate");
            let help = miette::Diagnostic::help(&error).map(|help| help.to_string());
            assert!(
                error.to_string().contains("the rows come at 20.0000 Hz"),
                "{error}"
            );
            assert!(help.expect("help").contains("leave it out"));
        }
    }
    let without = read(&names, &even, &at(&mapped("gyro_x=gx"), 40.0)).expect("no times");
    assert_eq!(without.record.header.rate_hz, Some(40.0));
}
