//! What the program says of ordinary mistakes, and of what is no gyro: each says what to do, and nothing that is not so.

mod common;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use common::{assert_misused, assert_refused, assert_success, folder, run};

fn text(path: &Path) -> &str {
    path.to_str().expect("a name in UTF-8")
}

/// Numbers about 0, the same each time.
fn noise() -> impl FnMut() -> f64 {
    let mut state = 0x2545_f491_4f6c_dd1d_u64;
    move || {
        let mut uniform = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }
}

/// A table of noise of that size beside a time, under these names.
fn table(folder: &Path, names: &str, step: f64, size: f64) -> PathBuf {
    let mut noise = noise();
    let mut lines = format!("{names}\n");
    for row in 0..1200 {
        let _ = write!(lines, "{}", f64::from(row) * step);
        for _ in 1..names.split(',').count() {
            let _ = write!(lines, ",{:.4e}", size * noise());
        }
        lines.push('\n');
    }
    let path = folder.join("table.csv");
    std::fs::write(&path, lines).expect("a file of the test's own");
    path
}

#[test]
fn a_run_that_is_too_short_or_too_long_is_told_why_and_what_is_allowed() {
    let out = folder("words_run");
    let capture = out.join("c.csv");
    for (seconds, words) in [
        ("20", &["20 s", "60", "too short", "--pty"][..]),
        ("59.9", &["59.9 s", "--seconds 60"]),
        ("nan", &["NaN s", "--seconds 60"]),
        ("90000", &["90000 s", "--seconds 86400"]),
    ] {
        let arguments = [
            "run",
            "--native",
            "--seconds",
            seconds,
            "--out",
            text(&capture),
        ];
        assert_misused(&run(&arguments), words);
        assert!(!capture.exists(), "{seconds}");
    }
}

#[test]
fn what_is_no_gyro_is_not_read_by_the_papers_procedure() {
    let folder = folder("words_units");
    let clock = table(&folder, "time_s,y", 1.0, 1e-11);
    let said = |arguments: &[&str]| assert_success(&run(arguments));
    let of_clock = ["--columns", "time=time_s,freq=y", "--units", "freq=1"];
    let analyzed = [&["analyze", text(&clock)], &of_clock[..]].concat();
    let plain = said(&analyzed);
    for word in ["bias", "angle", "rate"] {
        assert!(!plain.contains(word), "{word}: {plain}");
    }
    for said in [plain, said(&[&analyzed[..], &["--paper"]].concat())] {
        assert!(!said.contains("paper's"), "{said}");
        assert!(said.contains("read off the deviations"), "{said}");
        assert!(said.contains("level of the flat part"), "{said}");
    }
    let force = table(&folder, "time_s,acc_x", 0.05, 1e-2);
    let force = said(&["analyze", text(&force), "--units", "acc=m/s2"]);
    assert!(!force.contains("paper's"), "{force}");
    assert!(force.contains("in-run bias stability"), "{force}");
    let rate = table(&folder, "time_s,gyro_x", 0.05, 0.3);
    let rate = said(&["analyze", text(&rate), "--units", "gyro=deg/s"]);
    assert!(rate.contains("by the paper's procedure"), "{rate}");
    assert!(!rate.contains("read off"), "{rate}");
}

#[test]
fn a_unit_of_something_else_and_a_misspelt_key_are_told() {
    let folder = folder("words_mapping");
    let path = table(&folder, "time_s,gyro_x,gyro_y", 0.05, 0.3);
    // A channel of the file could be called so.
    assert_refused(
        &run(&["analyze", text(&path), "--units", "gyr=deg/s"]),
        &["`gyr` is neither a quantity", "gyro"],
    );
    for (units, words) in [
        ("gyro=m/s2", &["no unit of an angular rate", "rad/s"][..]),
        // No accelerometer is there.
        ("gyro=deg/s,acc=deg/s", &["no unit of an acceleration"]),
        ("gyro=deg/s,time=Hz", &["no unit of time", "ms"]),
    ] {
        let arguments = ["analyze", text(&path), "--units", units];
        assert_misused(&run(&arguments), words);
    }
}

#[test]
fn a_folder_in_the_place_of_a_file_is_refused_before_the_work() {
    let folder = folder("words_folder");
    let path = table(&folder, "time_s,gyro_x", 0.05, 0.3);
    let (file, there) = (text(&path), text(&folder));
    for arguments in [
        &["analyze", file, "--json", there][..],
        &["diagnose", file, "--report", there],
        &["diagnose", file, "--model-out", there],
        &["report", file, "--out", there],
        &["simulate", "--seconds", "60", "--out", there],
        &["run", "--native", "--out", there],
    ] {
        let units = ["--units", "gyro=deg/s"];
        let units = if arguments.contains(&file) {
            &units[..]
        } else {
            &[]
        };
        let said = assert_refused(
            &run(&[arguments, units].concat()),
            &["is a folder", "name a file"],
        );
        assert!(!said.contains("verdict"), "{said}");
    }
    let figures = ["report", file, "--units", "gyro=deg/s", "--figures", file];
    assert_refused(&run(&figures), &["--figures", "is a file", "name a folder"]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_report_that_cannot_be_written_costs_no_other_result() {
    let folder = folder("words_full");
    let path = table(&folder, "time_s,gyro_x", 0.05, 0.3);
    let [json, model] = ["d.json", "m.toml"].map(|name| folder.join(name));
    let arguments = [
        "diagnose",
        text(&path),
        "--units",
        "gyro=deg/s",
        "--no-replicates",
    ];
    let outputs = [
        "--json",
        text(&json),
        "--model-out",
        text(&model),
        "--report",
        "/dev/full",
    ];
    let said = assert_refused(
        &run(&[&arguments[..], &outputs].concat()),
        &["/dev/full", "make room"],
    );
    assert!(said.contains("verdict"), "{said}");
    let found = std::fs::read_to_string(&json).expect("the result is there");
    assert!(found.contains("imu-stand-diagnosis/1") && model.is_file());
}
