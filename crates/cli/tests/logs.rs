//! Logs of robots, made by the writers of others: `rosbags` (ROS 1 bags packed by bzip2 and LZ4), `mcap` (chunks packed by
//! Zstandard and LZ4, CDR by `rosbags`), a ULog that `pyulog` reads. 50 rows at 100 Hz of a gyro (k/100, -k/200, 0.02) rad/s and an
//! accelerometer (0, (k mod 5)/10, 9.81) m/s^2; the bags also have a thermometer at 10 Hz, 25 degC + k/10.

use std::path::{Path, PathBuf};

use imu_stand::capture::read_from;
use imu_stand::{ReadOptions, read_capture};
use model::record::Record;

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data")
        .join(name)
}

fn read(path: &Path, topic: Option<&str>) -> Result<Record, String> {
    let options = ReadOptions {
        topic: topic.map(str::to_owned),
        ..ReadOptions::default()
    };
    read_capture(path, &options)
        .map(|read| read.record)
        .map_err(told)
}

fn told(error: imu_stand::CaptureError) -> String {
    let help = miette::Diagnostic::help(&error).map(|help| help.to_string());
    format!("{error}\n{}", help.unwrap_or_default())
}

const DEGREES: f64 = 180.0 / std::f64::consts::PI;

fn is_the_log(record: &Record, name: &str) {
    // A float of 32 bits has seven digits.
    let value = |channel: &str, row: usize, expected: f64| {
        let channel = record
            .channel(channel)
            .unwrap_or_else(|| panic!("{name}: {channel}"));
        let found = channel.values[row];
        assert!(
            (found - expected).abs() < 1e-5,
            "{name} {}: {found}, not {expected}",
            channel.name
        );
    };
    assert_eq!(record.len(), 50, "{name}");
    for row in [0, 7, 49] {
        let k = row as f64;
        value("gyro_x", row, 0.01 * k * DEGREES);
        value("gyro_y", row, -0.005 * k * DEGREES);
        value("gyro_z", row, 0.02 * DEGREES);
        value("acc_y", row, 0.1 * (k % 5.0));
        value("acc_z", row, 9.81);
    }
    let times = record.host_time_s.as_ref().expect("times");
    assert!(
        (times[49] - times[0] - 0.49).abs() < 1e-9,
        "{name}: {times:?}"
    );
    assert!(
        record.notes.iter().any(|n| n.contains("rad/s")),
        "{name}: {:?}",
        record.notes
    );
}

#[test]
fn an_imu_is_read_from_each_kind_of_log_in_its_own_units_without_being_asked() {
    for name in [
        "imu_bz2.bag",
        "imu_lz4.bag",
        "imu_zstd.mcap",
        "imu_lz4.mcap",
        "imu.ulg",
    ] {
        is_the_log(&read(&data(name), None).expect(name), name);
    }
    // By what is in it, not by its ending.
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("logs");
    std::fs::create_dir_all(&folder).unwrap();
    let other = folder.join("run.csv");
    std::fs::copy(data("imu_zstd.mcap"), &other).unwrap();
    is_the_log(&read(&other, None).unwrap(), "by content");
    // Packed as a whole, as rosbag2 does it with `compression_mode: file`.
    let bytes = std::fs::read(data("imu_lz4.mcap")).unwrap();
    let packed =
        ruzstd::encoding::compress_to_vec(&bytes[..], ruzstd::encoding::CompressionLevel::Fastest);
    let whole = folder.join("imu.mcap.zstd");
    std::fs::write(&whole, packed).unwrap();
    is_the_log(&read(&whole, None).unwrap(), "packed as a whole");
}

#[test]
fn a_thermometer_of_its_own_topic_holds_its_last_reading() {
    for (name, first) in [("imu_bz2.bag", 25.0), ("imu.ulg", 25.0)] {
        let record = read(&data(name), None).unwrap();
        let temp = &record.channel("temp").expect("temp").values;
        assert!((temp[0] - first).abs() < 1e-5, "{name}: {}", temp[0]);
        assert!((temp[39] - 28.0).abs() < 1e-5, "{name}: {}", temp[39]);
        assert!(
            record
                .notes
                .iter()
                .any(|n| n.contains("last reading before")),
            "{name}"
        );
    }
}

#[test]
fn a_topic_is_chosen_by_name_and_those_that_are_there_are_told() {
    let record = read(&data("imu.ulg"), None).unwrap();
    let notes = record.notes.join("; ");
    assert!(
        notes.contains("topic sensor_combined") && notes.contains("vehicle_imu (50 messages)"),
        "{notes}"
    );
    assert!(notes.contains("dropouts of the logger: 1"), "{notes}");
    // Angles of an interval become rates.
    let record = read(&data("imu.ulg"), Some("vehicle_imu")).unwrap();
    is_the_log(&record, "vehicle_imu");
    let record = read(&data("imu.ulg"), Some("sensor_gyro")).unwrap();
    assert_eq!((record.len(), record.channel("acc_x")), (5, None));
    let error = read(&data("imu.ulg"), Some("imu")).unwrap_err();
    assert!(
        error.contains("sensor_combined") && error.contains("--topic"),
        "{error}"
    );
    let error = read(&data("imu_lz4.bag"), Some("/other")).unwrap_err();
    assert!(
        error.contains("/imu/data (sensor_msgs/Imu, 50 messages)")
            || error.contains("/imu/data (sensor_msgs/msg/Imu"),
        "{error}"
    );
    let error = read(&data("gzip.parquet"), Some("x")).unwrap_err();
    assert!(error.contains("--topic"), "{error}");
}

/// A record of an MCAP.
fn record(opcode: u8, content: &[u8]) -> Vec<u8> {
    let mut out = vec![opcode];
    out.extend((content.len() as u64).to_le_bytes());
    out.extend(content);
    out
}

fn text(text: &str) -> Vec<u8> {
    let mut out = (text.len() as u32).to_le_bytes().to_vec();
    out.extend(text.bytes());
    out
}

/// An MCAP without chunks or an end, of a recorder that was killed, with ROS 1 messages of these topics.
fn mcap(topics: &[&str], rows: u32) -> Vec<u8> {
    let mut out = b"\x89MCAP0\r\n".to_vec();
    let schema = [
        1u16.to_le_bytes().to_vec(),
        text("sensor_msgs/Imu"),
        text("ros1msg"),
        text(""),
    ];
    out.extend(record(3, &schema.concat()));
    for (id, topic) in topics.iter().enumerate() {
        let ids = [(id as u16).to_le_bytes(), 1u16.to_le_bytes()].concat();
        out.extend(record(
            4,
            &[ids, text(topic), text("ros1"), text("")].concat(),
        ));
    }
    for k in 0..rows {
        for id in 0..topics.len() {
            let mut message = (id as u16).to_le_bytes().to_vec();
            message.extend(k.to_le_bytes());
            message.extend(u64::from(k * 10_000_000).to_le_bytes());
            message.extend([0; 8]);
            // Sequence number, stamp, frame.
            message.extend(
                [k, 1_700_000_000, k * 10_000_000]
                    .map(u32::to_le_bytes)
                    .concat(),
            );
            message.extend(text("imu"));
            let mut numbers = [0.0f64; 37];
            numbers[13] = f64::from(k);
            numbers[28] = -1.0; // covariance: no acceleration
            numbers[25] = 3.0;
            message.extend(numbers.map(f64::to_le_bytes).concat());
            out.extend(record(5, &message));
        }
    }
    out
}

#[test]
fn messages_that_are_packed_one_by_one_are_read() {
    // As rosbag2 writes them with `compression_mode: message`.
    let imu = |k: u32| {
        let mut cdr = vec![0, 1, 0, 0];
        cdr.extend((k / 100).to_le_bytes());
        cdr.extend((k % 100 * 10_000_000).to_le_bytes());
        cdr.extend([1, 0, 0, 0, 0, 0, 0, 0]); // the empty name of a frame, and what aligns
        let mut numbers = vec![0.0; 4 + 9];
        numbers.extend([0.01 * f64::from(k), 0.0, 0.0]);
        numbers.extend([0.0; 9]);
        numbers.extend([0.0, 0.0, 9.81]);
        numbers.extend([0.0; 9]);
        cdr.extend(numbers.iter().flat_map(|n: &f64| n.to_le_bytes()));
        ruzstd::encoding::compress_to_vec(&cdr[..], ruzstd::encoding::CompressionLevel::Fastest)
    };
    let mut file = b"\x89MCAP0\r\n".to_vec();
    let schema = [&1_u16.to_le_bytes()[..], &text("sensor_msgs/msg/Imu")].concat();
    file.extend(record(0x03, &[schema, text("ros2msg"), text("")].concat()));
    let channel = [&[1, 0, 1, 0][..], &text("/imu"), &text("cdr"), &text("")].concat();
    file.extend(record(0x04, &channel));
    for k in 0..50_u32 {
        let head = [&[1, 0][..], &k.to_le_bytes(), &[0; 16]].concat();
        file.extend(record(0x05, &[head, imu(k)].concat()));
    }
    file.extend(record(0x0f, &[0; 4]));
    let read = read_from(&file[..], &ReadOptions::default()).map_err(told);
    let record = read.unwrap().record;
    let gyro = &record.channel("gyro_x").unwrap().values;
    assert_eq!(gyro.len(), 50);
    assert!((gyro[7] - 0.07 * DEGREES).abs() < 1e-9, "{gyro:?}");
}

#[test]
fn what_is_cut_off_is_read_as_far_as_it_goes_and_several_imus_are_asked_for() {
    let options = ReadOptions::default();
    let whole = mcap(&["/imu"], 20);
    let read = read_from(&whole[..whole.len() - 10], &options)
        .expect("a log")
        .record;
    assert_eq!(read.len(), 19);
    assert!((read.channel("gyro_x").unwrap().values[18] - 18.0 * DEGREES).abs() < 1e-9);
    assert!(
        read.channel("acc_x").is_none(),
        "the message says that there is none"
    );
    assert!(
        read.notes.iter().any(|n| n.contains("ends in the middle")),
        "{:?}",
        read.notes
    );
    let two = mcap(&["/a", "/b"], 4);
    let error = told(read_from(&two[..], &options).unwrap_err());
    assert!(
        error.contains("2 IMUs") && error.contains("`--topic /a`"),
        "{error}"
    );
    let options = ReadOptions {
        topic: Some("/b".to_owned()),
        ..options
    };
    assert_eq!(read_from(&two[..], &options).unwrap().record.len(), 4);
    for (bytes, needle) in [
        (&b"\x89MCAP0\r\n"[..], "no message"),
        (b"#ROSBAG V2.0\n", "no message"),
        (b"ULog\x01\x12\x35\x01", "no message"),
        (b"\x89MCAP0\r\n\x05\x01\0\0\0\0\0\0\0\0", "too short"),
    ] {
        let error = told(read_from(bytes, &ReadOptions::default()).unwrap_err());
        assert!(error.contains(needle), "{error}");
    }
}

#[test]
fn formats_that_are_not_read_name_who_converts_them() {
    for (start, what, who) in [
        (&b"SQLite format 3\0\0\0"[..], "rosbag2", "mcap convert"),
        (b"\xa3\x95\x80\x80\x59", "ArduPilot", "mavlogdump.py"),
        (
            b"H Product:Blackbox flight data",
            "Blackbox",
            "blackbox_decode",
        ),
        (b"ARROW1\0\0", "Feather", "to_parquet"),
    ] {
        let error = told(read_from(start, &ReadOptions::default()).unwrap_err());
        assert!(error.contains(what) && error.contains(who), "{error}");
    }
}

mod any_bytes {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(300))]

        /// A log with bytes that are changed or missing is read or refused.
        #[test]
        fn no_damage_makes_a_reader_panic(
            which in 0..5usize,
            cut in any::<prop::sample::Index>(),
            changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..8),
        ) {
            let names = ["imu_bz2.bag", "imu_lz4.bag", "imu_zstd.mcap", "imu_lz4.mcap", "imu.ulg"];
            let mut bytes = std::fs::read(data(names[which])).unwrap();
            for (at, byte) in changes {
                let at = at.index(bytes.len());
                bytes[at] = byte;
            }
            bytes.truncate(cut.index(bytes.len()).max(16));
            if let Ok(read) = read_from(&bytes[..], &ReadOptions::default()) {
                let rows = read.record.len();
                for channel in &read.record.channels {
                    prop_assert_eq!(channel.values.len(), rows);
                }
            }
        }
    }
}
