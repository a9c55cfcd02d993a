//! Corrected frames in captures: columns of their own where they arrive, nothing new where they do not.
#![cfg(unix)]

mod common;

use common::{Board, assert_refused, assert_success, folder, run};
use imu_stand::capture::{Calibration, corrected, read_from, write_to};
use imu_stand::{ReadOptions, RecordBuilder, read_capture};
use model::record::Quantity;
use wire::{Corrected, Sample, correction_state};

fn sample(seq: u16) -> Sample {
    Sample {
        seq,
        t_ticks: u32::from(seq) * 12_500,
        gyro: [10 + seq as i16, -3, 7],
        temp: [30; 3],
        supply: 2730,
        acc: [512, 510, 760],
        pwm: 0,
        flags: 7,
        rate: [0; 3],
    }
}

fn of(seq: u16) -> Corrected {
    Corrected {
        seq,
        rate: [1 << 20, -(1 << 19), 3],
        bias: [0; 3],
        known: [0; 3],
        correction: 0xbeef,
        state: correction_state::APPLIED,
        attitude: Some([1 << 30, -5, 0, 1 << 29]),
    }
}

fn text(builder: &RecordBuilder) -> String {
    let mut out = Vec::new();
    write_to(&mut out, &builder.build()).unwrap();
    String::from_utf8(out).unwrap()
}

#[test]
fn columns_are_added_where_corrected_frames_arrive_and_nothing_where_not() {
    let mut builder = RecordBuilder::new(Calibration::default());
    (0..4).for_each(|seq| builder.push(&sample(seq), f64::from(seq) * 0.05));
    let plain = text(&builder);
    assert!(!plain.contains("correct"), "{plain}");
    // To its own row, behind which another sample may have come.
    builder.corrected(&of(2));
    let with = text(&builder);
    let names = "pwm,corrected_x,corrected_y,corrected_z,correction,corrected_state,attitude_w,attitude_x,attitude_y,attitude_z,flags";
    assert!(with.contains(names), "{with}");
    let rows: Vec<&str> = with.lines().filter(|l| !l.starts_with('#')).collect();
    assert!(rows[2].ends_with(",0,,,,,,,,,,7"), "{}", rows[2]);
    assert!(
        rows[3].ends_with(",0,1048576,-524288,3,48879,1,1073741824,-5,0,536870912,7"),
        "{}",
        rows[3]
    );
    let record = read_from(with.as_bytes(), &ReadOptions::default())
        .unwrap()
        .record;
    let x = record.channel("corrected_x").unwrap();
    assert_eq!((x.unit.as_str(), x.values[2]), ("deg/s", 1.0));
    assert!(x.values[1].is_nan());
    assert!(
        record.channel("corrected_state").is_none(),
        "no measurement"
    );
    // Rates of a correction that is not applied mean nothing, and are none.
    builder.corrected(&Corrected { state: 0, ..of(3) });
    let without = text(&builder);
    let last = without.lines().last().unwrap();
    assert!(
        last.ends_with(",0,,,,48879,0,1073741824,-5,0,536870912,7"),
        "{last}"
    );
    // Captures of before have zeros there, which are read as none.
    let before = without.replace(",0,,,,48879,0,", ",0,0,0,0,48879,0,");
    assert_ne!(before, without);
    for (text, is_told) in [(&before, true), (&without, false)] {
        let read = read_from(text.as_bytes(), &ReadOptions::default()).unwrap();
        let x = read.record.channel("corrected_x").unwrap();
        assert!(x.values[3].is_nan() && x.values[2] == 1.0, "{:?}", x.values);
        let told = read.record.notes.join("\n");
        assert_eq!(
            told.contains("1 rows have corrected rates although"),
            is_told,
            "{told}"
        );
        assert!(read.record.channel("corrected_state").is_none());
    }
    // Of a firmware that has no attitude.
    let mut builder = RecordBuilder::new(Calibration::default());
    builder.push(&sample(0), 0.0);
    builder.corrected(&Corrected {
        attitude: None,
        ..of(0)
    });
    let plainer = text(&builder);
    assert!(plainer.contains(",48879,1,,,,,7"), "{plainer}");
    // Rows without a frame are told, and nothing else is.
    let [note] = record.notes.as_slice() else {
        panic!("{:?}", record.notes)
    };
    assert!(
        note.starts_with("3 of 4 rows have no reading of corrected_x"),
        "{note}"
    );
    let gyros = corrected(record).unwrap();
    let names: Vec<&str> = gyros.all(Quantity::Gyro).map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["gyro_x", "gyro_y", "gyro_z"]);
    assert_eq!(gyros.channel("gyro_y").unwrap().values[2], -0.5);
    // Without the key nobody knows what they mean.
    let without = with.replace("# corrected_lsb_dps", "# another_key");
    let error = read_from(without.as_bytes(), &ReadOptions::default()).unwrap_err();
    assert!(error.to_string().contains("corrected_lsb_dps"), "{error}");
    let plain = read_from(plain.as_bytes(), &ReadOptions::default()).unwrap();
    let error = corrected(plain.record).unwrap_err().to_string();
    assert!(error.contains("corrected_x"), "{error}");
}

#[test]
fn a_capture_of_a_board_that_corrects_has_its_rates_and_one_without_refuses_to_go_on() {
    let board = Board::start();
    let folder = folder("corrected_columns");
    let path = |name: &str| folder.join(name).to_str().unwrap().to_owned();
    let capture = |more: &[&str]| {
        let (out, port) = (path("run.csv"), board.port().to_owned());
        let mut all = vec!["capture", "--port", &port, "--out", &out, "--seconds", "2"];
        all.extend(more);
        run(&all)
    };
    assert_success(&capture(&[]));
    let before = std::fs::read_to_string(path("run.csv")).unwrap();
    assert!(!before.contains("corrected"), "{before}");
    std::fs::write(path("model.toml"), model::ModelFile::paper().to_toml()).unwrap();
    let said = assert_success(&board.ask(&["correct", "--model", &path("model.toml")]));
    assert!(said.contains("read back"), "{said}");
    assert_refused(&capture(&["--resume"]), &["has no columns for corrected"]);
    for name in ["run.csv", "run.raw"] {
        std::fs::remove_file(path(name)).unwrap();
    }
    assert_success(&capture(&[]));
    assert_success(&capture(&["--resume"]));
    let record = read_capture(path("run.csv").as_ref(), &ReadOptions::default())
        .unwrap()
        .record;
    let rates = &record.channel("corrected_z").unwrap().values;
    let missing = rates.iter().filter(|rate| rate.is_nan()).count();
    // The first rows of each part come before the board has said that it corrects.
    assert!(
        rates.len() > 60 && missing <= 12,
        "{missing} of {}",
        rates.len()
    );
    // The raw bytes give the same again.
    let out = path("again.csv");
    assert_success(&run(&[
        "capture",
        "--replay",
        &path("run.raw"),
        "--out",
        &out,
    ]));
    let again = read_capture(out.as_ref(), &ReadOptions::default()).unwrap();
    assert!(again.record.channel("corrected_z").is_some());
    let said = assert_success(&run(&["analyze", &out, "--corrected"]));
    assert!(
        said.contains("gyro_x") && !said.contains("corrected_x "),
        "{said}"
    );
}
