//! What is doubtful of a record is said by every command that believes it, on the screen and in the files.

mod common;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use common::{assert_refused, assert_success, folder, json, run};

/// Normal noise of variance 1: twelve even draws less their mean are normal enough for a sensor.
fn noise() -> impl FnMut() -> f64 {
    let mut state = 7u64;
    let mut draw = move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    move || (0..12).map(|_| draw()).sum::<f64>() - 6.0
}

fn text(path: &Path) -> &str {
    path.to_str().expect("a name in UTF-8")
}

/// A table with a gyro, and accelerometers where the sensor lies as `down` says, in units of gravity.
fn table(
    folder: &Path,
    name: &str,
    time: impl Fn(usize) -> f64,
    down: impl Fn(usize) -> [f64; 3],
) -> PathBuf {
    let mut out = "time_s,gyro_x [deg/s],acc_x [m/s^2],acc_y [m/s^2],acc_z [m/s^2]\n".to_owned();
    let mut noise = noise();
    for k in 0..2400 {
        let acc = down(k).map(|g| 9.806_65 * g + 0.02 * noise());
        let _ = writeln!(
            out,
            "{:.6},{:.4},{:.4},{:.4},{:.4}",
            time(k),
            0.3 * noise(),
            acc[0],
            acc[1],
            acc[2]
        );
    }
    let path = folder.join(name);
    std::fs::write(&path, out).expect("room");
    path
}

/// Every command that believes the record says so, and its files have it.
fn told_by_all(path: &Path, what: &str) {
    let folder = path.parent().expect("a folder");
    let (a, d, h) = (
        folder.join("a.json"),
        folder.join("d.json"),
        folder.join("r.html"),
    );
    let file = text(path);
    let said = assert_success(&run(&["analyze", file, "--json", text(&a)]));
    assert_eq!(said.matches(what).count(), 1, "analyze: {said}");
    let words = [
        "diagnose",
        file,
        "--no-replicates",
        "--json",
        text(&d),
        "--report",
        text(&h),
    ];
    let said = assert_success(&run(&words));
    assert_eq!(said.matches(what).count(), 1, "diagnose: {said}");
    let from = |file: &Path| {
        assert_success(&run(&[
            "export",
            text(file),
            "--to",
            "vins",
            "--at-rate",
            "200",
        ]))
    };
    for file in [path, &a, &d] {
        let said = from(file);
        let comment = said.split("# ").any(|line| line.contains(what));
        assert!(comment, "export of {}: {said}", file.display());
    }
    for file in [&a, &d] {
        let notes = &json(file)["input"]["notes"];
        let notes = notes.as_array().expect("notes");
        let told = notes
            .iter()
            .filter(|n| n.as_str().is_some_and(|n| n.contains(what)));
        assert_eq!(told.count(), 1, "{notes:?}");
    }
    assert!(
        std::fs::read_to_string(&h)
            .expect("a report")
            .contains(what)
    );
}

const FLAT: fn(usize) -> [f64; 3] = |_| [0.0, 0.0, 1.0];

fn even(k: usize) -> f64 {
    0.05 * k as f64
}

#[test]
fn two_sample_rates_in_one_file_are_refused_by_all_and_a_span_takes_one() {
    let folder = folder("doubts_rates");
    let time = |k: usize| match k.checked_sub(1200) {
        None => even(k),
        Some(later) => 60.0 + 0.01 * later as f64,
    };
    let path = table(&folder, "joined.csv", time, FLAT);
    let file = text(&path);
    for words in [
        &["analyze", file][..],
        &["diagnose", file],
        &["report", file],
        &["export", file, "--to", "vins", "--at-rate", "200"],
        &["plan", file, "--want", "K within 20 %"],
        &["representative", file, file, file, file],
    ] {
        let said = assert_refused(&run(words), &["two sample rates"]);
        let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(
            said.contains("20.0000 Hz before row 1201, 100.000 Hz from there on (60.000000 s"),
            "{said}"
        );
        assert!(
            said.contains("`--span ,60.000000` or `--span 60.000000,`"),
            "{said}"
        );
    }
    for (span, rows, hz) in [(",60", 1201, "20 Hz"), ("60,", 1200, "100 Hz")] {
        let said = assert_success(&run(&["analyze", file, "--span", span]));
        assert!(said.contains(&format!("{hz}, {rows} samples")), "{said}");
        assert!(said.contains("(--span)"), "{said}");
    }
    let changing = table(
        &folder,
        "twice.csv",
        |k| {
            let fast = k.clamp(800, 1600) - 800;
            0.05 * (k - fast) as f64 + 0.01 * fast as f64
        },
        FLAT,
    );
    told_by_all(
        &changing,
        "the sample rate changes: 20.0000 Hz at the start",
    );
}

#[test]
fn times_that_tell_arrival_are_told_by_all() {
    let folder = folder("doubts_bursts");
    let time = |k: usize| 0.1 * (k / 2) as f64 + 0.02 * (k % 2) as f64;
    told_by_all(
        &table(&folder, "bursts.csv", time, FLAT),
        "the times are uneven",
    );
}

#[test]
fn a_sensor_that_was_laid_on_its_side_is_told_by_all() {
    let folder = folder("doubts_turned");
    let down = |k: usize| {
        if k < 1600 {
            [0.0, 0.0, 1.0]
        } else {
            [0.0, 1.0, 0.0]
        }
    };
    told_by_all(
        &table(&folder, "turned.csv", even, down),
        "turned against gravity, by 90 deg at most, from 80.0000 s on",
    );
}

#[test]
fn a_sound_record_has_no_doubts() {
    let folder = folder("doubts_none");
    let path = table(&folder, "sound.csv", even, FLAT);
    for command in ["analyze", "diagnose"] {
        let said = assert_success(&run(&[command, text(&path)]));
        assert!(!said.contains("note:"), "{command}: {said}");
    }
}

/// What `diagnose` says, and writes, of a rate that follows a duty by 1 deg/s at full, where the file has the duty times `full`.
fn of_duty(folder: &Path, full: f64, unit: &str) -> (String, serde_json::Value) {
    let (path, out) = (folder.join("duty.csv"), folder.join("d.json"));
    let mut noise = noise();
    let mut rows = "time_s,gyro_x [deg/s],motor\n".to_owned();
    for k in 0..2400 {
        let duty = [0.0, 0.5, -0.5, 0.25][k / 100 % 4];
        let rate = duty + 0.3 * noise();
        let _ = writeln!(rows, "{:.2},{rate:.4},{}", even(k), full * duty);
    }
    std::fs::write(&path, rows).expect("room");
    let said = assert_success(&run(&[
        "diagnose",
        text(&path),
        "--columns",
        "time=time_s,gyro_x=gyro_x,pwm=motor",
        "--units",
        &format!("time=s,gyro=deg/s,pwm={unit}"),
        "--base",
        "static",
        "--no-replicates",
        "--json",
        text(&out),
    ]));
    (said, json(&out))
}

#[test]
fn a_motor_command_has_a_unit_and_one_that_cannot_be_in_it_is_told() {
    let folder = folder("doubts_motor");
    for (full, unit) in [(1.0, "fraction"), (100.0, "%"), (255.0, "1")] {
        let (said, d) = of_duty(&folder, full, unit);
        assert!(!said.contains("motor command"), "{unit}: {said}");
        let found = d["findings"].as_array().expect("findings");
        let motor = found.iter().find(|f| f["cause"] == "motor_bias");
        let size = motor.and_then(|f| f["parameters"]["at_full_duty"]["value"].as_f64());
        let size = size.unwrap_or_else(|| panic!("{unit}: {d}"));
        assert!((size - 1.0).abs() < 0.1, "{unit}: {size}");
    }
    for (full, what) in [(1.0, "turns nothing"), (1000.0, "full duty is 255")] {
        let (said, _) = of_duty(&folder, full, "1");
        assert!(said.contains(what), "{full}: {said}");
    }
}

#[test]
fn the_largest_holes_have_their_place() {
    let folder = folder("doubts_holes");
    let time = |k: usize| 0.05 * k as f64 + if k < 1000 { 0.0 } else { 20.0 };
    let path = table(&folder, "hole.csv", time, |_| [0.0, 0.0, 1.0]);
    told_by_all(&path, "no rows from 49.95 to 70.00 s (400");
}

#[test]
fn several_sensors_in_one_file_are_no_record_of_one() {
    let folder = folder("doubts_sensors");
    let path = folder.join("two.csv");
    let mut noise = noise();
    for (first, other) in [("A", "B"), ("1", "2")] {
        let mut out = "device_id,time_s,gyro_x [deg/s]\n".to_owned();
        for k in 0..1200 {
            let time = 0.05 * f64::from(k);
            let _ = writeln!(out, "{first},{time:.2},{:.4}", noise());
            let _ = writeln!(out, "{other},{time:.2},{:.4}", 3.0 + noise());
        }
        std::fs::write(&path, &out).expect("room");
        let other = format!("`device_id` has `{first}`, and `{other}` in line 3");
        for command in ["analyze", "diagnose", "export"] {
            let words = [command, text(&path), "--to", "kalibr"];
            let words = &words[..if command == "export" { 4 } else { 2 }];
            assert_refused(&run(words), &[&other, "a file for each"]);
        }
        // One alone is as any column that nobody needs.
        let is_other = |(k, _): &(usize, &str)| *k > 0 && k % 2 == 0;
        let one = out.lines().enumerate().filter(|row| !is_other(row));
        let one: Vec<&str> = one.map(|(_, line)| line).collect();
        std::fs::write(&path, one.join("\n")).expect("room");
        assert_success(&run(&["analyze", text(&path)]));
    }
    // A number that each row has for itself counts them.
    let counted = (0..1200).map(|k| format!("{k},{:.2},{:.4}\n", 0.05 * f64::from(k), noise()));
    let counted: String = counted.collect();
    std::fs::write(&path, format!("serial,time_s,gyro_x [deg/s]\n{counted}")).expect("room");
    assert_success(&run(&["analyze", text(&path)]));
}
