//! One stand recorded many times: seeds of their own for stand, fault and noise, folders as input, one table.

mod common;

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use common::{assert_refused, assert_success, folder, json, program, run};

/// A run of a stand into a file.
fn record(folder: &Path, name: &str, words: &str) {
    let out = folder.join(name);
    let mut arguments = vec!["run", "--native", "--no-replicates", "--quiet", "--out"];
    arguments.push(out.to_str().expect("a name in UTF-8"));
    arguments.extend(words.split(' '));
    assert_success(&run(&arguments));
}

/// A folder with five runs of one sound stand.
fn five() -> &'static PathBuf {
    static MADE: OnceLock<PathBuf> = OnceLock::new();
    MADE.get_or_init(|| {
        let folder = folder("many_five");
        for k in 1..=5 {
            let words = format!("--hide none --stand-seed 3 --fault-seed {k} --noise-seed {k}");
            record(&folder, &format!("run{k}.csv"), &words);
        }
        // What is no capture is passed over.
        std::fs::write(folder.join("notes.md"), "shelf 3").expect("room");
        folder
    })
}

#[test]
fn five_runs_of_one_stand_have_one_that_represents_them_and_one_of_another_stand_stands_out() {
    let folder = five();
    let out = folder.with_extension("json");
    let words = |captures: &[&Path]| {
        let mut command = program(&["representative", "--json", out.to_str().expect("UTF-8")]);
        let output = command.args(captures).output().expect("it starts");
        (assert_success(&output), json(&out))
    };
    let (said, found) = words(&[folder]);
    assert!(said.contains("no run stands out"), "{said}");
    assert_eq!(found["files"].as_array().map(Vec::len), Some(5));
    // The bias at turn-on is the stand's, and so are N and K of every gyro.
    let other = folder.with_file_name("many_other");
    std::fs::create_dir_all(&other).expect("a folder");
    record(
        &other,
        "other.csv",
        "--hide leak --stand-seed 3 --fault-seed 9 --noise-seed 9",
    );
    let (said, found) = words(&[folder, &other.join("other.csv")]);
    assert!(said.contains("not other.csv"), "{said}");
    let odd = found["odd"].as_array().expect("those that stand out");
    assert!(odd.iter().all(|odd| odd["run"] == 5), "{odd:?}");
}

#[test]
fn one_seed_for_all_is_the_run_that_it_was_and_another_noise_is_another_run_of_the_same_fault() {
    let folder = folder("many_seeds");
    record(&folder, "a.csv", "--hide tempco --seed 5 --seconds 60");
    record(
        &folder,
        "b.csv",
        "--hide tempco --stand-seed 5 --fault-seed 5 --noise-seed 5 --seconds 60",
    );
    record(
        &folder,
        "c.csv",
        "--hide tempco --seed 5 --noise-seed 6 --seconds 60",
    );
    let rows = |name: &str| {
        let text = std::fs::read_to_string(folder.join(name)).expect("a capture");
        text.lines()
            .filter(|l| !l.starts_with('#'))
            .map(str::to_owned)
            .collect::<Vec<_>>()
    };
    assert!(rows("a.csv") == rows("b.csv"));
    assert!(rows("a.csv") != rows("c.csv"));
    let planted = |words: &str| {
        let out = folder.join("d.json");
        let arguments = format!(
            "{words} --hide tempco --seconds 300 --json {}",
            out.display()
        );
        record(&folder, "d.csv", &arguments);
        json(&out)["planted"]["items"][0]["sizes"][0]["planted"].clone()
    };
    let five = planted("--seed 5");
    assert!(five.is_number(), "{five}");
    assert_eq!(five, planted("--seed 5 --noise-seed 6"));
    assert_eq!(five, planted("--seed 4 --fault-seed 5"));
    assert_ne!(five, planted("--seed 5 --fault-seed 6"));
}

#[test]
fn a_folder_is_diagnosed_in_one_table_that_is_the_one_by_one_answer() {
    let folder = five();
    let out = folder.with_file_name("many_all.json");
    let text = |path: &Path| path.to_str().expect("UTF-8").to_owned();
    let arguments = [
        "diagnose",
        "--no-replicates",
        "--json",
        &text(&out),
        &text(folder),
    ];
    let said = assert_success(&run(&arguments));
    assert!(
        said.contains("capture verdict found") || said.contains("capture   verdict"),
        "{said}"
    );
    let all = json(&out);
    assert_eq!(all["format"], "imu-stand-diagnoses/1");
    assert_eq!(all["failed"], serde_json::json!([]));
    for k in 1..=5 {
        let name = format!("run{k}.csv");
        assert!(said.contains(&name), "{said}");
        let one = folder.with_file_name("many_one.json");
        let path = text(&folder.join(&name));
        assert_success(&run(&[
            "diagnose",
            "--no-replicates",
            "--json",
            &text(&one),
            &path,
        ]));
        assert_eq!(all["runs"][k - 1], json(&one), "{name}");
    }
}

#[test]
fn a_capture_that_cannot_be_read_keeps_no_other_from_its_answer() {
    let folder = folder("many_bad");
    record(&folder, "a.csv", "--hide none --seconds 120");
    std::fs::write(folder.join("b.csv"), "no table\n").expect("room");
    let out = folder.join("all.json");
    let text = |path: &Path| path.to_str().expect("UTF-8").to_owned();
    let words = [
        "diagnose",
        "--no-replicates",
        "--json",
        &text(&out),
        &text(&folder),
    ];
    assert_refused(
        &run(&words),
        &["1 of 2 captures could not be diagnosed, first b.csv"],
    );
    let all = json(&out);
    assert_eq!(all["runs"][0]["input"]["file"], "a.csv");
    assert_eq!(all["failed"][0]["file"], "b.csv");
    let empty = folder.join("empty");
    std::fs::create_dir(&empty).expect("a folder");
    assert_refused(
        &run(&["diagnose", &text(&empty)]),
        &["no capture is in this folder"],
    );
}

#[test]
fn a_folder_of_rosbag2_is_its_recording() {
    let folder = folder("many_rosbag2");
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    std::fs::write(
        folder.join("metadata.yaml"),
        "rosbag2_bagfile_information:\n",
    )
    .expect("room");
    let log = folder.join("imu_0.mcap");
    std::fs::copy(data.join("imu_zstd.mcap"), &log).expect("room");
    let name = folder.to_str().expect("UTF-8");
    let out = assert_success(&run(&["analyze", name, "--channels", "gyro_x"]));
    assert!(out.contains("50 samples"), "{out}");
    // Split, it is no record that can be joined here.
    std::fs::copy(&log, folder.join("imu_1.mcap")).expect("room");
    let words = ["split into 2 files", "imu_0.mcap", "ros2 bag convert"];
    assert_refused(&run(&["analyze", name]), &words);
    // Packed as a whole, and what is in SQLite says how to get out of it.
    std::fs::remove_file(folder.join("imu_1.mcap")).expect("it is there");
    let bytes = std::fs::read(&log).expect("it is there");
    let fast = ruzstd::encoding::CompressionLevel::Fastest;
    let packed = ruzstd::encoding::compress_to_vec(&bytes[..], fast);
    std::fs::rename(&log, folder.join("imu_0.mcap.zstd")).expect("room");
    std::fs::write(folder.join("imu_0.mcap.zstd"), packed).expect("room");
    assert_success(&run(&["analyze", name, "--channels", "gyro_x"]));
    assert_refused(&run(&["diagnose", name]), &["50 samples"]);
    std::fs::remove_file(folder.join("imu_0.mcap.zstd")).expect("it is there");
    std::fs::write(folder.join("imu_0.db3"), b"SQLite format 3\0").expect("room");
    assert_refused(&run(&["analyze", name]), &["mcap"]);
}
