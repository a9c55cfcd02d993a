//! Rows that carry what they are: sentences of instruments, readings behind their names, objects of JSON, messages of ROS 2, and
//! what a terminal received.

use imu_stand::capture::{CaptureError, read_from};
use imu_stand::{ColumnMapping, ReadOptions};
use model::record::Record;

fn read(text: &str, units: &str, rate_hz: Option<f64>) -> Result<Record, CaptureError> {
    let options = ReadOptions {
        mapping: ColumnMapping::parse(None, Some(units)).expect("a mapping"),
        rate_hz,
        ..ReadOptions::default()
    };
    read_from(text.as_bytes(), &options).map(|read| read.record)
}

fn refusal(text: &str) -> String {
    let error = read(text, "", Some(50.0)).expect_err("something is asked");
    format!("{:?}", miette::Report::new(error))
}

fn rows(count: usize, row: impl Fn(usize) -> String) -> String {
    (0..count).map(|k| format!("{}\n", row(k))).collect()
}

/// The value of a channel in a row, in the record's unit.
#[track_caller]
fn is_at(record: &Record, channel: &str, row: usize, value: f64) {
    let of = record.channel(channel);
    let of = of.unwrap_or_else(|| panic!("{channel}: {:?}", record.notes));
    assert!(
        (of.values[row] - value).abs() < 1e-9,
        "{channel}: {}",
        of.values[row]
    );
}

/// A sentence with its checksum.
fn sentence(body: &str) -> String {
    let sum = body.bytes().fold(0, |all, byte| all ^ byte);
    format!("${body}*{sum:02X}")
}

fn ymr(k: usize) -> String {
    let body = format!(
        "VNYMR,+010.1,-002.0,+000.5,+0.2,+0.1,-0.4,+00.100,-00.200,-09.{k:03},+0.01,-0.02,+0.{k:06}"
    );
    sentence(&body)
}

#[test]
fn sentences_of_an_instrument_say_their_columns_and_a_damaged_one_keeps_its_place() {
    let text = rows(60, |k| match k {
        7 => ymr(k).replace("-09", "-08"),
        9 => format!("{}\n{}", ymr(k), sentence("VNGPS,1,2,3")),
        _ => ymr(k),
    });
    let record = read(&text, "", Some(50.0)).expect("a record");
    is_at(&record, "gyro_z", 20, 20e-6_f64.to_degrees());
    is_at(&record, "acc_z", 20, -9.020);
    // The sensor's rate is not in them; a damaged one was sent, and the sentence of something else is no sample.
    let gyro = &record.channel("gyro_x").expect("a gyro").values;
    assert_eq!(
        (gyro.len(), gyro[7].is_nan(), gyro[8].is_nan()),
        (60, true, false)
    );
    let said = record.notes.join("\n");
    assert!(said.contains("checksum or length is wrong: 1;"), "{said}");
    assert!(said.contains("which are not read: 1"), "{said}");
    let without = read(&rows(60, ymr), "", None).expect("a record without a rate");
    assert!(without.header.rate_hz.is_none());
    // A program may have put the time before each.
    let timed = rows(60, |k| format!("{:.2},{}", 1.7e9 + 0.02 * k as f64, ymr(k)));
    let timed = timed.replacen("+00.100", "+00.101", 1);
    let record = read(&timed, "", None).expect("a record with times");
    assert!(record.channel("gyro_x").expect("a gyro").values[0].is_nan());
    assert!((record.header.rate_hz.expect("a rate") - 50.0).abs() < 1e-3);
}

#[test]
fn readings_behind_their_names_are_the_columns_of_those_names() {
    let of = |k: usize| 0.001 * (k % 50) as f64;
    let rad = |k: usize| of(k).to_degrees();
    for (row, units) in [
        ("A: 0.1 0.2 9.8 G: 0.01 0.02 {} ", "gyro=rad/s,acc=m/s2"),
        (
            "ax:0.1,ay:0.2,az:9.8,gx:0.01,gy:0.02,gz:{}",
            "gyro=rad/s,acc=m/s2",
        ),
        (
            "t: 5\tAccX = 0.1\tAccY = 0.2\tAccZ = 9.8\tGyroZ = {}",
            "gyro=rad/s,acc=m/s2,time=ms",
        ),
        (
            "Accel X: 0.1 Y: 0.2 Z: 9.8 m/s^2 Gyro X: 0.01 Y: 0.02 Z: {} rad/s Temp: 25.1 C",
            "",
        ),
        (
            "Accel X: 0.1m/s^2, Y: 0.2m/s^2, Z: 9.8m/s^2 | Gyro X: 1rad/s, Y: -2rad/s, Z: {}rad/s",
            "",
        ),
        (
            "12:00:00.000 -> gyro: 0.01, 0.02, {}; accel: 0.1, 0.2, 9.8",
            "gyro=rad/s,acc=m/s2",
        ),
    ] {
        let text = rows(60, |k| {
            let row = row.replace("t: 5", &format!("t: {}", 20 * k));
            let row = row.replace("00.000", &format!("{:06.3}", 0.02 * k as f64));
            row.replace("{}", &format!("{:.3}", of(k)))
        });
        // What a board says when it starts is no row.
        let text = format!("MPU6050 found\ncalibrating ...\n{text}");
        let has_time = row.starts_with('t') || row.starts_with('1');
        let record = read(&text, units, (!has_time).then_some(50.0));
        let record =
            record.unwrap_or_else(|error| panic!("{row}: {:?}", miette::Report::new(error)));
        is_at(&record, "gyro_z", 20, rad(20));
        if row.contains("A: ") || row.contains("Acc") || row.contains("acc") {
            is_at(&record, "acc_z", 20, 9.8);
        }
        let said = record.notes.join("\n");
        assert!(said.contains("readings behind their names"), "{said}");
        // Without the unit of the gyro it is asked for, by the names that the rows have.
        if !units.is_empty() {
            let said = refusal(&text);
            assert!(said.contains("gyro=UNIT"), "{row}: {said}");
        }
    }
}

#[test]
fn a_row_may_have_several_lines() {
    let of = |k: usize| 0.001 * (k % 50) as f64;
    let sample = |k: usize| {
        format!(
            "Acceleration X: 0.10, Y: 0.20, Z: 9.80 m/s^2\nRotation X: 0.01, Y: -0.02, Z: {:.3} rad/s\nTemperature: 25.{} degC\n",
            of(k),
            k % 7
        )
    };
    let indented = |k: usize| {
        format!(
            "\t\tTemperature 25.{} deg C\n\n\t\tAccel X: 0.1 \tY: 0.2 \tZ: 9.8 m/s^2 \n\t\tGyro X: 0.01 \tY: 0.02 \tZ: {:.3} radians/s \n",
            k % 7,
            of(k)
        )
    };
    for text in [rows(60, sample), rows(60, indented)] {
        let text = format!("starts\nsensor found\n{text}");
        let record = read(&text, "", Some(50.0));
        let record = record.unwrap_or_else(|error| panic!("{:?}", miette::Report::new(error)));
        is_at(&record, "gyro_z", 20, of(20).to_degrees());
        is_at(&record, "acc_z", 20, 9.8);
        let temp = &record.channel("temp").expect("a thermometer").values;
        assert_eq!((temp.len(), temp[20]), (60, 25.6));
        // A sample of which a line is missing is told with its place.
        let short = text.replacen("9.8", "lost", 5).replacen("lost", "9.8", 4);
        let error = read(&short, "", Some(50.0)).expect_err("a line says something else");
        assert!(error.to_string().contains("line "), "{error}");
    }
}

#[test]
fn a_row_that_lacks_a_reading_is_refused_with_its_line() {
    let text = rows(60, |k| match k {
        30 => "ax:0.1,gx:".to_owned(),
        _ => format!("ax:0.1,gx:0.{k:02}"),
    });
    let error = read(&text, "gyro=deg/s,acc=g", Some(50.0)).expect_err("a row is short");
    assert!(error.to_string().contains("line 31"), "{error}");
}

#[test]
fn words_in_a_table_are_no_names_of_readings() {
    // A state in the last column; a table of one; keys before a table.
    for text in [
        format!(
            "t_s,gyro_x_dps,note\n{}",
            rows(60, |k| format!("{:.2},{},state: 0", 0.02 * k as f64, k % 7))
        ),
        format!(
            "rate: 50 Hz\nstart: 3\nt_s,gyro_x_dps\n{}",
            rows(60, |k| format!("{:.2},{}", 0.02 * k as f64, k % 7))
        ),
        format!(
            "t,gyro_x_dps\n{}",
            rows(60, |k| format!(
                "2026-11-21T10:00:{:06.3}Z,{}",
                0.02 * k as f64,
                k % 7
            ))
        ),
    ] {
        let record = read(&text, "", None).expect("a table");
        is_at(&record, "gyro_x", 20, 6.0);
        assert!(!record.notes.join("\n").contains("behind their names"));
    }
}

#[test]
fn an_object_of_json_a_line_has_its_keys_for_names() {
    let text = rows(60, |k| {
        let null = if k == 5 {
            "null".to_owned()
        } else {
            format!("0.{k:03}")
        };
        format!(
            "{{\"ts_ms\":{},\"gyro\":{{\"x\":0.1,\"y\":0.2,\"z\":{null}}},\"acc\":[0.1,0.2,9.8],\"id\":\"a,b\"}}",
            20 * k
        )
    });
    assert!(
        refusal(&text).contains("gyro_z=gyro.z"),
        "{}",
        refusal(&text)
    );
    // What was given is not asked for again.
    let given = read(&text, "gyro=rad/s", None).expect_err("the accelerometers' unit is not said");
    let said = format!("{:?}", miette::Report::new(given));
    assert!(
        said.contains("acc=m/s2") && said.contains("gyro=rad/s") && !said.contains("UNIT"),
        "{said}"
    );
    let record = read(&text, "gyro=rad/s,acc=m/s2", None).expect("a record");
    is_at(&record, "gyro_z", 20, 0.02_f64.to_degrees());
    is_at(&record, "acc_z", 20, 9.8);
    assert!(record.channel("gyro_z").expect("a gyro").values[5].is_nan());
    // One object over many lines is none of these.
    let said = refusal("{\n  \"a\": 1,\n  \"b\": 2\n}\n");
    assert!(said.contains("jq -c"), "{said}");
}

#[test]
fn messages_of_ros_2_without_names_are_known_by_their_forty_cells() {
    let covariance = ["0.0"; 9].join(",");
    let text = rows(60, |k| {
        let (s, ns) = (1_764_000_000 + k / 50, 20_000_000 * (k % 50));
        format!(
            "{s},{ns},imu_link,0.0,0.0,0.0,1.0,{covariance},0.01,0.02,0.{k:03},{covariance},0.1,0.2,9.8,{covariance}"
        )
    });
    let record = read(&text, "", None).expect("a record");
    is_at(&record, "gyro_z", 20, 0.02_f64.to_degrees());
    is_at(&record, "acc_z", 20, 9.8);
    assert!((record.header.rate_hz.expect("a rate") - 50.0).abs() < 1e-6);
}

#[test]
fn a_table_behind_the_times_of_a_terminal_is_a_table_with_those_times() {
    let at = |k: usize| format!("18:23:{:06.3} -> ", 0.02 * k as f64);
    let text = rows(60, |k| match k {
        0 => format!("{}gx,gy,gz", at(k)),
        _ => format!("{}0.01,0.02,0.{k:03}", at(k)),
    });
    let record = read(&text, "gyro=deg/s", None).expect("a record");
    is_at(&record, "gyro_z", 20, 0.021);
    assert!((record.header.rate_hz.expect("a rate") - 50.0).abs() < 1e-3);
}

#[test]
fn a_date_in_a_column_of_its_own_belongs_to_the_time_beside_it() {
    // A logger that ran to midnight and was switched on again two days later.
    let head = "rtcDate,rtcTime,aX,aY,aZ,gX,gY,gZ,imu_degC,output_Hz,";
    let row = |date: &str, second: usize, k: usize| {
        format!(
            "{date},10:{:02}:{:02}.{:02},1,2,1000,0.1,0.2,0.{:02},25.1,10.0,\n",
            second / 60,
            second % 60,
            10 * (k % 10),
            k % 100
        )
    };
    let day = |date: &str| -> String { (0..600).map(|k| row(date, k / 10, k)).collect() };
    let text = format!("{head}\n{}{}", day("11/21/2026"), day("11/23/2026"));
    let record = read(&text, "", None).expect("a record");
    is_at(&record, "gyro_z", 20, 0.20);
    is_at(&record, "acc_z", 20, 9.80665);
    let times = record.host_time_s.as_ref().expect("times");
    assert!((times[600] - times[0] - 2.0 * 86_400.0).abs() < 1e-6);
}

#[test]
fn names_of_loggers_say_their_times_and_which_acceleration_has_gravity() {
    let body = |k: usize| {
        format!(
            "{:.3}\t0.1\t0.2\t9.8\t0.01\t0.02\t0.{k:03}\t",
            1.764e12 + 20.0 * k as f64
        )
    };
    let names = [
        "Timestamp_Unix",
        "Accel_LN_X",
        "Accel_LN_Y",
        "Accel_LN_Z",
        "Gyro_X",
        "Gyro_Y",
        "Gyro_Z",
    ];
    let names: String = names
        .iter()
        .map(|n| format!("Unit_6813_{n}_CAL\t"))
        .collect();
    let units = "ms\tm/(s^2)\tm/(s^2)\tm/(s^2)\tdeg/s\tdeg/s\tdeg/s\t";
    let text = format!("{names}\n{units}\n{}", rows(60, body));
    let record = read(&text, "", None).expect("a record");
    is_at(&record, "gyro_z", 20, 0.02);
    is_at(&record, "acc_z", 20, 9.8);
    assert!((record.header.rate_hz.expect("a rate") - 50.0).abs() < 1e-3);

    let names = "motionTimestamp_sinceReboot(s),motionRotationRateX(rad/s),motionUserAccelerationX(G),accelerometerAccelerationX(G)";
    let text = format!(
        "{names}\n{}",
        rows(60, |k| format!("{:.2},0.{k:03},0.001,1.0", 0.02 * k as f64))
    );
    let record = read(&text, "", None).expect("a record");
    is_at(&record, "acc_x", 20, 9.80665);

    let month = rows(60, |k| {
        format!("21-Nov-2026 10:00:{:06.3},0.{k:03}", 0.02 * k as f64)
    });
    let record = read(&format!("Timestamp,wx [rad/s]\n{month}"), "", None).expect("a record");
    assert!((record.header.rate_hz.expect("a rate") - 50.0).abs() < 1e-3);
}

#[test]
fn a_log_for_stabilizing_videos_says_what_its_numbers_are() {
    let head = "GYROFLOW IMU LOG\nversion,1.3\norientation,YxZ\ntscale,0.001\ngscale,0.001\nascale,0.0005\nt,gx,gy,gz,ax,ay,az\n";
    let text = format!(
        "{head}{}",
        rows(60, |k| format!("{},3,4,{k},10,20,2000", 20 * k))
    );
    let record = read(&text, "", None).expect("a record");
    is_at(&record, "gyro_z", 20, 0.02_f64.to_degrees());
    is_at(&record, "acc_z", 20, 9.80665);
    assert!((record.header.rate_hz.expect("a rate") - 50.0).abs() < 1e-6);
}

#[test]
fn two_programs_of_one_maker_have_two_units_and_the_question_says_so() {
    let head = "PacketCounter,SampleTimeFine,Gyr_X,Gyr_Y,Gyr_Z";
    let text = format!(
        "{head}\n{}",
        rows(60, |k| format!("{k},{},0.1,0.2,0.{k:02}", 1000 * k))
    );
    let said = refusal(&text);
    assert!(said.contains("DOT") && said.contains("gyro=UNIT"), "{said}");
}

/// NovAtel's CRC of a body: that of Ethernet, from 0 on and not inverted.
fn novatel(body: &str) -> String {
    let crc = body.bytes().fold(0u32, |crc, byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| {
            (crc >> 1) ^ if crc & 1 == 1 { 0xedb8_8320 } else { 0 }
        })
    });
    format!("{body}*{crc:08x}")
}

/// Extended logs of a type of IMU, at 100 Hz over the end of a week; at rest, with this velocity along z in a sample.
fn raw_imu(imu: u8, velocity: i64) -> String {
    rows(60, |k| {
        let cs = 60_479_970 + k as i64;
        let (week, s) = (2209 + cs / 60_480_000, (cs % 60_480_000) as f64 / 100.0);
        let info = if k == 9 { "02" } else { "00" };
        let log = format!(
            "RAWIMUSXA,{week},{s:.3};{info},{imu},{week},{s:.9},00801503,{velocity},-300,200,3,-{},{}",
            k + 1,
            10 * k
        );
        let other = novatel("INSPVASA,1,2.0;1,2.0,3,4,5*").replace('*', "-");
        match k {
            7 => format!("%{}", novatel(&log).replace(",200,", ",201,")),
            30 => format!("%{}\n%{other}\n#{other}", novatel(&log)),
            _ => format!("%{}", novatel(&log)),
        }
    })
}

#[test]
fn a_log_of_a_receiver_is_read_by_the_type_of_its_imu() {
    // The HG1700-AG58 of the test of the checksum: a count is 2^-33 rad and 2^-27 ft/s, 100 times a second.
    let text = raw_imu(11, 43_110_635);
    let record = read(&text, "", None).expect("a record");
    let (gyro, acc) = (100.0 * 2f64.powi(-33), 100.0 * 0.3048 * 2f64.powi(-27));
    is_at(&record, "gyro_x", 19, (200.0 * gyro).to_degrees());
    // The y axis stands turned round.
    is_at(&record, "gyro_y", 19, (21.0 * gyro).to_degrees());
    is_at(&record, "acc_y", 20, 300.0 * acc);
    is_at(&record, "acc_z", 20, 9.790_153_464_674_95);
    assert!((record.header.rate_hz.expect("a rate") - 100.0).abs() < 1e-3);
    let gyro = &record.channel("gyro_x").expect("a gyro").values;
    let missing: Vec<usize> = (0..gyro.len()).filter(|k| gyro[*k].is_nan()).collect();
    // A time behind a wrong checksum is none; readings that are encrypted are none.
    assert_eq!((gyro.len(), missing), (59, vec![8]));
    let said = record.notes.join("\n");
    assert!(
        said.contains("HG1700-AG58") && said.contains("which are not read: 2"),
        "{said}"
    );
}

#[test]
fn a_log_of_a_receiver_whose_scale_is_not_certain_asks_for_it() {
    // Another type; a type of another rate; a receiver of another maker, whose type is not what it says.
    let short = rows(60, |k| {
        let s = 100.0 + 0.01 * k as f64;
        format!(
            "%{}",
            novatel(&format!(
                "RAWIMUSA,2209,{s:.3};2209,{s:.9},00801503,43110635,-300,200,3,-5,{k}"
            ))
        )
    });
    for text in [
        raw_imu(99, 43_110_635),
        raw_imu(8, 1),
        raw_imu(58, 43_110_635),
        short.clone(),
    ] {
        let said = refusal(&text);
        assert!(
            said.contains("gyro=UNIT") && said.contains("Scale Factors"),
            "{said}"
        );
    }
    let record = read(&short, "gyro=0.5rad/s,acc=0.5m/s2", None).expect("a record");
    is_at(&record, "gyro_x", 20, 10f64.to_degrees());
    is_at(&record, "acc_y", 20, 150.0);
}

#[test]
fn lines_of_a_razor_are_no_comments() {
    let text = rows(60, |k| {
        format!("#A-R=-12.00,3.00,250.00\n#M-R=100.00,-20.00,300.00\n#G-R=-41.00,98.00,{k}.00")
    });
    let said = refusal(&text);
    assert!(
        said.contains("14.375") && said.contains("gyro=UNIT"),
        "{said}"
    );
    for head in ["", "#SYNCH00\n", "#SYNCH00\n#YPR=1.00,2.00,3.00\n"] {
        let text = format!("{head}{text}");
        let record =
            read(&text, "gyro=0.0695652deg/s,acc=0.00390625g", Some(50.0)).expect("a record");
        is_at(&record, "gyro_z", 20, 20.0 * 0.069_565_2);
        is_at(&record, "acc_x", 20, -12.0 * 0.003_906_25 * 9.80665);
    }
}
