//! Tables that are none yet: measurements of LabVIEW, counts in hexadecimal, cells with units, cells beyond all numbers, and
//! files whose name alone says the sensor.

use imu_stand::capture::read_capture;

use super::{error, is_the_table, options, read};

/// A measurement of LabVIEW of the rows that all tables here have: keys of the file's header, lines of the segment's, names and
/// rows.
fn lvm(keys: &[(&str, &str)], segment: &str, rows: &str) -> String {
    let mut text =
        "LabVIEW Measurement\t\r\nWriter_Version\t2\r\nReader_Version\t2\r\nSeparator\tTab\r\n"
            .to_owned();
    for (key, value) in keys {
        text += &format!("{key}\t{value}\r\n");
    }
    text +=
        "Date\t2026/11/21\r\nTime\t12:26:38.0541324615478515625\r\n***End_of_Header***\t\r\n\t\r\n";
    text + segment + rows
}

const SEGMENT: &str = "Channels\t2\t\t\r\nSamples\t8\t8\t\r\nDate\t2026/11/21\t2026/11/21\t\r\nTime\t12:26:38.05\t12:26:38.05\t\r\n\
                       Y_Unit_Label\tdeg/s\tdeg/s\t\r\nX_Dimension\tTime\tTime\t\r\nX0\t0.0000000000000000E+0\t0.0000000000000000E+0\t\r\n\
                       Delta_X\t0.020000\t0.020000\t\r\n***End_of_Header***\t\t\t\r\nX_Value\tgyro_x\tgyro_y\tComment\r\n";

fn lvm_rows(from: u32, to: u32, time: &dyn Fn(u32) -> String) -> String {
    let row = |k| format!("{}\t{:.6}\t-1.000000\r\n", time(k), 0.25 * f64::from(k));
    (from..to).map(row).collect()
}

#[test]
fn a_measurement_of_labview_is_the_table_behind_its_second_header() {
    let x = |k: u32| format!("{:.6}", 0.02 * f64::from(k));
    let none = |_: u32| String::new();
    let later = SEGMENT.replace("12:26:38.05", "12:26:38.13");
    let halves = |later: &str, time: &dyn Fn(u32) -> String| {
        format!(
            "{}\r\n{later}{}",
            lvm_rows(0, 4, time),
            lvm_rows(4, 8, time)
        )
    };
    let restarted = |k: u32| format!("{:.6}", 0.02 * f64::from(k % 4));
    let one = &[("X_Columns", "One"), ("Multi_Headings", "Yes")][..];
    let no = &[("X_Columns", "No"), ("Multi_Headings", "Yes")][..];
    for (keys, rows, told) in [
        (one, lvm_rows(0, 8, &x), "(LVM)"),
        (no, lvm_rows(0, 8, &none), "counted by its X0 and Delta_X"),
        // Segments go on, begin again in their own time, or have no time but that.
        (one, halves(SEGMENT, &x), "2 segments"),
        (one, halves(&later, &restarted), "2 segments"),
        (no, halves(&later, &none), "2 segments"),
        (&[("X_Columns", "One")], halves("", &x), "(LVM)"),
    ] {
        let text = lvm(keys, SEGMENT, &rows);
        let read = read(text.as_bytes(), "", "").unwrap_or_else(|e| panic!("{e}\n{text}"));
        is_the_table(&read);
        let notes = read.record.notes.join("\n");
        assert!(notes.contains(told), "{told}: {notes}");
    }
    // A comma before fractions; times for each channel.
    let german = lvm(
        &[("Decimal_Separator", ","), ("X_Columns", "No")],
        SEGMENT,
        &lvm_rows(0, 8, &none),
    );
    let german = german
        .replace("0.", "0,")
        .replace("1.", "1,")
        .replace("8.", "8,");
    is_the_table(&read(german.as_bytes(), "", "").expect("decimal commas"));
    let multi = SEGMENT.replace("gyro_x\tgyro_y", "gyro_x\tX_Value\tgyro_y");
    let rows: String = (0..8)
        .map(|k| format!("{0}\t{1:.6}\t{0}\t-1.0\r\n", x(k), 0.25 * f64::from(k)))
        .collect();
    let text = lvm(&[("X_Columns", "Multi")], &multi, &rows);
    is_the_table(&read(text.as_bytes(), "", "").expect("times for each"));
    let apart = text.replace("Delta_X\t0.020000\t0.020000", "Delta_X\t0.020000\t0.040000");
    let said = error(apart.as_bytes(), "", "");
    assert!(said.contains("times of their own"), "{said}");
}

#[test]
fn what_a_measurement_of_labview_does_not_say_is_asked_and_its_comments_are_told() {
    let x = |k: u32| format!("{:.6}", 0.02 * f64::from(k));
    let rows = lvm_rows(0, 8, &x).replacen("-1.000000", "-1.000000\tstandby", 1);
    let text = lvm(&[("X_Columns", "One")], SEGMENT, &rows);
    let notes = read(text.as_bytes(), "", "")
        .expect("a comment")
        .record
        .notes
        .join("\n");
    assert!(
        notes.contains("comments in rows: 1") && notes.contains("line 20: `standby`"),
        "{notes}"
    );
    // Errors tell the lines of the file.
    let broken = text.replace("0.750000", "what");
    let said = error(broken.as_bytes(), "", "");
    assert!(said.contains("line 23, column `gyro_x`: `what`"), "{said}");
    // Volts of an analog gyro.
    let volts = text
        .replace("deg/s\tdeg/s", "Volts\tVolts")
        .replace("gyro_x\tgyro_y", "Voltage_0\tVoltage_1");
    let said = error(volts.as_bytes(), "", "");
    assert!(
        said.contains("`Voltage_0` in Volts") && said.contains("gyro=UNIT"),
        "{said}"
    );
    let read_as = read(
        volts.as_bytes(),
        "gyro_x=Voltage_0,gyro_y=Voltage_1",
        "gyro=1deg/s",
    );
    is_the_table(&read_as.expect("volts times a scale"));
    // What LabVIEW writes where it knows no timing is no rate.
    let untimed = lvm(
        &[("X_Columns", "No")],
        SEGMENT,
        &lvm_rows(0, 8, &|_| String::new()),
    );
    let untimed = untimed.replace("0.020000", "1.000000");
    let read_as = read(untimed.as_bytes(), "", "").expect("rows without times");
    assert!(read_as.record.host_time_s.is_none() && read_as.record.header.rate_hz.is_none());
    let counted = lvm(
        &[("X_Columns", "One")],
        SEGMENT,
        &lvm_rows(0, 8, &|k| format!("{k}.000000")),
    );
    let counted = counted.replace("0.020000", "1.000000");
    let read_as = read(counted.as_bytes(), "", "").expect("numbered rows");
    assert!(
        read_as.record.host_time_s.is_none(),
        "{:?}",
        read_as.record.notes
    );
}

/// Rows of ms and three counts, each as `write` has it.
fn counts(head: &str, write: &dyn Fn(i16) -> String) -> String {
    let row = |k: i16| {
        let [x, y, z] = [k % 7 * 13 - 40, -145 - k % 5, 53 + k % 3];
        format!(
            "{},{},{},{}\n",
            20 * i32::from(k),
            write(x),
            write(y),
            write(z)
        )
    };
    head.to_owned() + &(0..60).map(row).collect::<String>()
}

#[test]
fn counts_in_hexadecimal_are_read_by_twos_complement_and_what_a_count_is_is_asked_for() {
    let forms: [&dyn Fn(i16) -> String; 6] = [
        &|v| format!("0x{v:04X}"),
        &|v| format!("{v:04X}"),
        &|v| format!("{v:04x}h"),
        // As `Serial.print(v, HEX)` of an int of 32 bits, and `%x` of an unsigned of 16.
        &|v| format!("{:X}", i32::from(v)),
        &|v| format!("0x{v:x}"),
        &|v| format!("{}0x{:02X}", if v < 0 { "-" } else { "" }, v.unsigned_abs()),
    ];
    for (k, write) in forms.into_iter().enumerate() {
        for (head, columns) in [
            ("ms,gx,gy,gz\n", "time=ms,gyro_x=gx,gyro_y=gy,gyro_z=gz"),
            ("", "time=1,gyro_x=2,gyro_y=3,gyro_z=4"),
        ] {
            let text = counts(head, write);
            let said = error(text.as_bytes(), "", "");
            assert!(
                said.contains("cells are hexadecimal in") && said.contains("gyro=UNIT"),
                "{k}: {said}"
            );
            let ours = text.replace("ms,gx,gy,gz", "time_ms,gyro_x,gyro_y,gyro_z");
            let said = error(ours.as_bytes(), "", "");
            assert!(said.contains("cells are hexadecimal in"), "{k}: {said}");
            let units = "time=ms,gyro=0.5deg/s";
            let read = read(text.as_bytes(), columns, units).unwrap_or_else(|e| panic!("{k}: {e}"));
            let value = |name: &str, row| read.record.channel(name).expect(name).values[row];
            let row = usize::from(head.is_empty());
            assert_eq!(
                value("gyro_x", row),
                if row == 0 { -20.0 } else { -13.5 },
                "{k}"
            );
            assert_eq!(value("gyro_y", 4), -74.5, "{k}");
            assert_eq!(value("gyro_z", 5), 27.5, "{k}");
            let times = read.record.host_time_s.as_ref().expect("times");
            assert!((times[59] - 1.18).abs() < 1e-9, "{k}: {times:?}");
            let notes = read.record.notes.join("\n");
            assert!(notes.contains("cells are hexadecimal in"), "{k}: {notes}");
        }
    }
    let text = counts("# Gyro scale: 131 LSB/(deg/s)\nms,gx,gy,gz\n", &|v| {
        format!("0x{v:04X}")
    });
    let read = read(text.as_bytes(), "", "").expect("a scale that the file says");
    let x = &read.record.channel("gyro_x").expect("a gyro").values;
    assert!((x[0] + 40.0 / 131.0).abs() < 1e-9, "{x:?}");
    // A counter has no sign, and an unsigned converter none about its middle.
    let row = |k: u32| {
        format!(
            "0x{:08X},0x{:04X}\n",
            0x7fff_f000 + 1000 * k,
            0x7fe0 + 13 * (k % 5)
        )
    };
    let rows: String = (0..60).map(row).collect();
    let read = super::read(
        format!("t,gx\n{rows}").as_bytes(),
        "time=t,gyro_x=gx",
        "time=us,gyro=1deg/s",
    );
    let record = read.expect("a counter").record;
    let times = record.host_time_s.as_ref().expect("times");
    assert!((times[59] - times[0] - 0.059).abs() < 1e-9, "{times:?}");
    assert_eq!(
        record.channel("gyro_x").expect("counts").values[4],
        f64::from(0x7fe0 + 52)
    );
    let bytes: String = (0..60)
        .map(|k| format!("{k} 0{} F{} 3C\n", k % 10, k % 7))
        .collect();
    let said = error(bytes.as_bytes(), "", "");
    assert!(said.contains("single bytes in hexadecimal"), "{said}");
}

#[test]
fn what_is_decimal_stays_so() {
    // Names of hexadecimal letters, exponents, and a column of states.
    let row = |k: u32| {
        format!(
            "{:.2},{k}e1,{},{}\n",
            0.02 * f64::from(k),
            1000 + k,
            ["a", "b"][k as usize % 2]
        )
    };
    let rows: String = (0..40).map(row).collect();
    let text = format!("a,b,c,d\n{rows}");
    let read = read(text.as_bytes(), "time=a,gyro_x=b,gyro_y=c", "gyro=deg/s").expect("decimals");
    let value = |name: &str| read.record.channel(name).expect(name).values[3];
    assert_eq!((value("gyro_x"), value("gyro_y")), (30.0, 1003.0));
    let notes = read.record.notes.join("\n");
    assert!(!notes.contains("hexadecimal"), "{notes}");
}

#[test]
fn cells_beyond_all_numbers_are_no_readings_and_are_counted() {
    for word in ["inf", "-inf", "Infinity", "1.#INF", "ovf", "1e999"] {
        let text = super::table("time_s,gyro_x_dps,gyro_y_dps\n", ",", ".", 1.0, 1.0);
        let text = text.replace("0.06,0.75", &format!("0.06,{word}"));
        let read = read(text.as_bytes(), "", "").unwrap_or_else(|e| panic!("{word}: {e}"));
        let x = &read.record.channel("gyro_x").expect("a gyro").values;
        assert!(x[3].is_nan() && x[4] == 1.0, "{word}: {x:?}");
        let notes = read.record.notes.join("\n");
        let told =
            format!("cells that are infinite: 1, first in line 5, column `gyro_x` (`{word}`)");
        assert!(notes.contains(&told), "{word}: {notes}");
    }
    // A time has to be one.
    let said = error(b"time_s,gyro_x_dps\n0,1\ninf,2\n0.04,1\n", "", "");
    assert!(
        said.contains("line 3, column `time`: `inf` is no time"),
        "{said}"
    );
}

#[test]
fn a_time_that_says_its_unit_in_each_cell_is_in_that() {
    for (unit, per_s) in [
        ("sec", 1.0),
        ("ms", 1e3),
        ("min", 1.0 / 60.0),
        ("hr", 1.0 / 3600.0),
    ] {
        let mut text = "Time,gyro_x_dps,gyro_y_dps\n".to_owned();
        for k in 0..8 {
            let k = f64::from(k);
            text += &format!("{} {unit},{},-1\n", 0.02 * k * per_s, 0.25 * k);
        }
        is_the_table(&read(text.as_bytes(), "", "").unwrap_or_else(|e| panic!("{unit}: {e}")));
    }
    let mut spans = ",gx,gy\n".to_owned();
    for k in 0..8 {
        spans += &format!(
            "0 days 00:00:00.{:06},{},-1\n",
            20_000 * k,
            0.25 * f64::from(k)
        );
    }
    let said = error(spans.as_bytes(), "", "");
    assert!(
        said.contains("--columns time=1,gyro_x=gx,gyro_y=gy --units gyro=UNIT"),
        "{said}"
    );
    let map = "time=1,gyro_x=gx,gyro_y=gy";
    is_the_table(&read(spans.as_bytes(), map, "gyro=deg/s").expect("spans of pandas"));
}

#[test]
fn the_counter_of_a_bosch_part_is_asked_for_by_its_tick_and_goes_on_after_24_bits() {
    // At 100 Hz; it begins again after row 99.
    let row = |k: u32| {
        format!(
            "{},{},-1\n",
            ((1 << 24) - 25_600 + 256 * k) % (1 << 24),
            k % 7
        )
    };
    let rows: String = (0..300).map(row).collect();
    let text = format!("sensor_time,gx,gy\n{rows}");
    let said = error(text.as_bytes(), "", "");
    assert!(
        said.contains("--units time=UNIT,gyro=UNIT") && said.contains("`time=39.0625us`"),
        "{said}"
    );
    // As Bosch calls them.
    let bosch = text.replace("gx,gy", "acc_x,gyr_x");
    let record = read(bosch.as_bytes(), "", "time=39.0625us,gyro=deg/s,acc=g");
    assert!(
        record
            .expect("their names")
            .record
            .channel("gyro_x")
            .is_some()
    );
    let map = "time=sensor_time,gyro_x=gx,gyro_y=gy";
    let few: Vec<&str> = text.lines().take(90).collect();
    let said = error(few.join("\n").as_bytes(), map, "gyro=deg/s");
    assert!(
        said.contains("39.0625us for the `sensor_time` of Bosch's parts: 100.0 Hz"),
        "{said}"
    );
    let read = read(text.as_bytes(), map, "time=39.0625us,gyro=deg/s").expect("a counter");
    let times = read.record.host_time_s.as_ref().expect("times");
    assert!((times[299] - times[0] - 2.99).abs() < 1e-9);
    let notes = read.record.notes.join("\n");
    assert!(notes.contains("a counter of 24 bits"), "{notes}");
}

#[test]
fn the_name_of_a_phones_file_says_of_which_sensor_x_y_and_z_are() {
    let mut text = "time,seconds_elapsed,z,y,x\n".to_owned();
    for k in 0..8 {
        let (ns, s) = (
            1_718_030_736_872_695_300_u64 + 20_000_000 * k,
            0.02 * k as f64,
        );
        text += &format!(
            "{ns},{s},0.5,{},{}\n",
            -super::RAD,
            0.25 * k as f64 * super::RAD
        );
    }
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("phone");
    std::fs::create_dir_all(&folder).expect("a folder");
    let of_file = |name: &str, columns| {
        let path = folder.join(name);
        std::fs::write(&path, &text).expect("a file");
        read_capture(&path, &options(columns, "").expect("options"))
    };
    for name in ["Gyroscope.csv", "GyroscopeUncalibrated.csv"] {
        let read = of_file(name, "").unwrap_or_else(|e| panic!("{name}: {e}"));
        is_the_table(&read);
        let notes = read.record.notes.join("\n");
        assert!(notes.contains("the app Sensor Logger"), "{notes}");
    }
    is_the_table(
        &of_file("Gyroscope.csv", "time=seconds_elapsed,gyro_x=x,gyro_y=y").expect("by name"),
    );
    for name in ["Magnetometer.csv", "TotalAcceleration.csv", "mine.csv"] {
        let said = of_file(name, "").expect_err("of any sensor");
        assert!(!said.to_string().contains("rad/s"), "{said}");
    }
}
