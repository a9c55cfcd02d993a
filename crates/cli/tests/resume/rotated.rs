//! A capture in many files.

use super::*;

/// The files of a rotated capture.
fn parts(folder: &Path, ending: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path());
    let mut all: Vec<PathBuf> = entries
        .filter(|path| path.to_str().unwrap().ends_with(ending))
        .collect();
    all.sort();
    all
}

#[test]
fn a_rotated_capture_is_one_record_of_files_that_are_each_whole() {
    let board = Board::start();
    let folder = folder("rotate_time");
    let out = folder.join("run.csv");
    let child = Running::start(capture(&board, &out, &["--rotate", "2s"]));
    wait_until("a third file", || parts(&folder, ".csv").len() >= 3);
    child.kill();
    // Another capture does not go into it.
    let other = Running::start(capture(&board, &out, &["--rotate", "2s"])).output();
    assert_refused(&other, &["run-0001.csv", "--resume"]);
    let more = ["--rotate", "2s", "--resume", "--seconds", "3"];
    assert_success(&Running::start(capture(&board, &out, &more)).output());
    let (rows, raws) = (parts(&folder, ".csv"), parts(&folder, ".raw"));
    assert!(rows.len() >= 4 && raws.len() == rows.len(), "{rows:?}");
    let mut line = Vec::new();
    let mut sum = 0;
    for (k, (part, raw)) in rows.iter().zip(&raws).enumerate() {
        assert_eq!(
            part.file_name().unwrap().to_str(),
            Some(&*format!("run-{:04}.csv", k + 1))
        );
        let record = record(part);
        let bytes = fs::read(raw).unwrap();
        assert_holds(&record, &samples(&bytes));
        assert!(
            record
                .header
                .entries
                .iter()
                .any(|(key, value)| key == "part" && *value == (k + 1).to_string())
        );
        assert_eq!(record.header.rate_hz, Some(20.0));
        sum += record.len();
        line.extend(bytes);
        // Its raw bytes alone make the same rows.
        if k == 1 {
            let again = folder.join("again");
            let names = [
                "--replay",
                raw.to_str().unwrap(),
                "--out",
                again.to_str().unwrap(),
            ];
            assert_success(&run(&[&["capture"], &names[..]].concat()));
            assert_holds(&self::record(&again), &samples(&fs::read(raw).unwrap()));
            fs::remove_file(&again).unwrap();
        }
    }
    // Two seconds of 20 Hz; the killed and resumed ones are shorter.
    assert!(
        (38..=42).contains(&record(&rows[1]).len()),
        "{}",
        record(&rows[1]).len()
    );
    let all = samples(&line);
    assert_eq!(all.len(), sum);
    let times = |of: &str| -> Vec<f64> {
        let json = folder.join(of);
        assert_success(&run(&[
            "analyze",
            folder.to_str().unwrap(),
            "--json",
            json.to_str().unwrap(),
        ]));
        let answer = common::json(&json);
        let points = answer["channels"]["gyro_x"]["deviations"]["oadev"]
            .as_array()
            .unwrap();
        points.iter().map(|p| p["n"].as_f64().unwrap()).collect()
    };
    // One record: its shortest deviation has the differences of all rows, but those over the hole of the resumption.
    let differences = times("all.json")[0];
    let most = sum as f64;
    assert!(
        (most - 5.0..most).contains(&differences),
        "{differences} of {most}"
    );
    // Not where they are not of one capture.
    fs::copy(&rows[0], folder.join("zero.csv")).unwrap();
    let text = fs::read_to_string(&rows[0]).unwrap();
    fs::write(
        folder.join("zero.csv"),
        text.replace("start_unix_s: ", "start_unix_s: 1"),
    )
    .unwrap();
    assert_refused(
        &run(&["analyze", folder.to_str().unwrap()]),
        &["not of one capture", "zero.csv"],
    );
}

#[test]
fn a_capture_rotates_by_size_too_and_resumes_in_a_file_that_has_no_row_yet() {
    let board = Board::start();
    let folder = folder("rotate_size");
    let out = folder.join("run.csv.gz");
    let child = Running::start(capture(&board, &out, &["--rotate", "10kB"]));
    wait_until("a second file", || parts(&folder, ".csv.gz").len() >= 2);
    child.kill();
    let second = folder.join("run-0002.csv.gz");
    let text = {
        let text =
            imu_stand::capture::unpacked(std::io::BufReader::new(fs::File::open(&second).unwrap()))
                .unwrap();
        std::io::read_to_string(text).unwrap_or_default()
    };
    let first = record(&folder.join("run-0001.csv.gz"));
    let more = ["--resume", "--rotate", "10kB", "--seconds", "2"];
    assert_success(&Running::start(capture(&board, &out, &more)).output());
    let record = record(&second);
    assert_holds(
        &record,
        &samples(&fs::read(folder.join("run-0002.raw")).unwrap()),
    );
    let (last, next) = (
        first.seq.as_ref().unwrap().last().unwrap(),
        record.seq.as_ref().unwrap()[0],
    );
    assert_eq!(next, last + 1, "{text}");
}
