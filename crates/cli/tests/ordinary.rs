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

#[test]
fn a_list_of_names_behind_a_label_or_in_a_format_of_printf_is_one() {
    let body = rows(40, &|k| {
        format!("{},{},0.99", 90_198 + 9_087 * k, 0.001 * (k % 7) as f64)
    });
    let head = " # Data format: \"%int(ChipTimeUS),%float(RawGyroX),%float(RawAccelZ)\"\r\n";
    let told = refusal(&format!("{head}{body}"), "", "");
    assert!(
        told.contains(
            "--columns time=ChipTimeUS,gyro_x=RawGyroX,acc_z=RawAccelZ --units time=us,gyro=UNIT"
        ),
        "{told}"
    );
    let (record, _) = notes(
        &format!("{head}{body}"),
        "time=ChipTimeUS,gyro_x=RawGyroX",
        "gyro=rad/s",
    );
    assert!((middle_step(&record) - 9.087e-3).abs() < 1e-9);
    let (record, _) = notes(
        &format!("#Fields: time_us,gyro_x,acc_z\n{body}"),
        "",
        "gyro=rad/s,acc=g",
    );
    assert!((middle_step(&record) - 9.087e-3).abs() < 1e-9);
    // Behind the last name, nothing is no column.
    let told = refusal(
        &format!("n;Gyr_X;Gyr_Y;\n{}", rows(9, &|k| format!("{k};1;2;"))),
        "",
        "",
    );
    assert!(
        told.contains("Gyr_Y; map") || told.contains("Gyr_Y;"),
        "{told}"
    );
}

#[test]
fn each_column_has_the_unit_that_its_own_name_says() {
    let body = rows(40, &|k| {
        format!("{:.2},{},{}", 0.01 * k as f64, 1 + k % 2, 1 + k % 2)
    });
    let (record, said) = notes(&format!("t[s],wx[rad/s],wy[deg/s]\n{body}"), "", "");
    let first = |name: &str| record.channel(name).expect(name).values[0];
    assert!((first("gyro_x") - 57.295_779_513).abs() < 1e-6 && first("gyro_y") == 1.0);
    assert!(
        said.contains("gyro_y in deg/s") && !said.contains("although"),
        "{said}"
    );
    // What is said by hand is so for all.
    let (record, _) = notes(
        &format!("t[s],wx[rad/s],wy[deg/s]\n{body}"),
        "",
        "gyro=deg/s",
    );
    assert_eq!(record.channel("gyro_x").expect("x").values[0], 1.0);
    // Increments of an angle are not differenced once more.
    let text = format!("time_s,dtheta_x [deg],dtheta_y [deg]\n{body}");
    for columns in ["", "time=time_s,gyro_x=dtheta_x"] {
        let told = refusal(&text, columns, "");
        assert!(
            told.contains("increments of an angle") && told.contains("gyro=100deg/s"),
            "{told}"
        );
    }
    let sloppy = format!("time_s,gyro_x_deg,gyro_y_deg\n{body}");
    let told = refusal(&sloppy, "", "");
    assert!(
        told.contains("has a rate, by its unit (deg) an angle") && told.contains("gyro=deg/s"),
        "{told}"
    );
    assert_eq!(
        notes(&sloppy, "", "gyro=deg/s").0.channels[0].values[0],
        1.0
    );
    // Nor is any other angle differenced unasked: its unit may be a rate's, written short.
    for (head, what) in [
        (
            "time_s,gyro_x [deg],gyro_y [deg]",
            "has a rate, by its unit (deg) an angle",
        ),
        (
            "time_s,Gyroscope X (rad),Gyroscope Y (rad)",
            "has a rate, by its unit (rad) an angle",
        ),
        (
            "time_s,gx [deg],gy [deg]",
            "has an angle, and a gyro reads rates",
        ),
        (
            "time_s,roll [deg],pitch [deg]",
            "an angle of the attitude (deg)",
        ),
        (
            "time_s,roll_deg,pitch_deg",
            "as deg is an angle's (map the columns of the rates",
        ),
    ] {
        let told = refusal(&format!("{head}\n{body}"), "", "");
        let unit = if head.contains("rad") { "rad" } else { "deg" };
        let asks =
            told.contains(&format!("gyro={unit}/s")) && told.contains(&format!("gyro={unit}`"));
        assert!(told.contains(what) && asks, "{head}: {told}");
    }
    let text_of_angles = format!("time_s,gyro_x [deg],gyro_y [deg]\n{body}");
    let (record, _) = notes(&text_of_angles, "", "gyro=deg");
    assert!((record.channels[0].values[0] - 100.0).abs() < 1e-6);
    let stated =
        format!("# unit of gyro_x: deg\n# unit of gyro_y: deg\ntime_s,gyro_x,gyro_y\n{body}");
    let (record, _) = notes(&stated, "", "");
    assert!((record.channels[0].values[0] - 100.0).abs() < 1e-6);
    // A unit with a number before it is not that unit.
    let told = refusal(&format!("time_s,gyro_x (0.01 deg/s),b\n{body}"), "", "");
    assert!(told.contains("gyro=UNIT"), "{told}");
    let (record, _) = notes(&text, "time=time_s,gyro_x=dtheta_x", "gyro=100deg/s");
    assert_eq!(record.channels[0].values[0], 100.0);
}

#[test]
fn times_and_rates_are_known_in_other_languages_and_two_sensors_by_their_numbers() {
    let body = rows(40, &|k| {
        format!("{:.2};{};{};25", 0.01 * k as f64, k % 7, k % 5)
    });
    for names in [
        "Temps (s);Vitesse angulaire X (°/s);Vitesse angulaire Y (°/s);Température (°C)",
        "Zeit [s];Drehrate X [°/s];Drehrate Y [°/s];Temperatur [°C]",
        "時刻[s];角速度X[deg/s];角速度Y[deg/s];温度[℃]",
    ] {
        let (record, said) = notes(&format!("{names}\n{body}"), "", "");
        assert!((middle_step(&record) - 0.01).abs() < 1e-9, "{said}");
        assert_eq!(
            record.channel("gyro_y").expect("y").values[3],
            3.0,
            "{said}"
        );
        assert_eq!(
            record.channel("temp").expect("temp").values[3],
            25.0,
            "{said}"
        );
    }
    let two = format!("time_s;gyro_x_1 (dps);gyro_x_2 (dps);gyro_y_1 (dps)\n{body}");
    let told = refusal(&two, "", "");
    assert!(
        told.contains("gyro_x=gyro_x_1 (dps),gyro_y=gyro_y_1 (dps)"),
        "{told}"
    );
}

#[test]
fn a_first_row_without_readings_is_a_row_and_a_comment_may_begin_with_slashes() {
    let body = rows(40, &|k| {
        format!("{:.2},{},{}", 0.01 * k as f64, k % 7, k % 5)
    });
    let text = format!("time_s,gyro_x [deg/s],gyro_y [deg/s]\n-0.01,NaN,\n{body}// end\n");
    let (record, _) = notes(&text, "", "");
    assert_eq!(record.len(), 41);
    assert!(record.channels[0].values[0].is_nan());
}

#[test]
fn an_imu_of_ardupilots_logs_is_read_from_the_converters_csv_and_two_are_refused() {
    let row = |k: usize, imu: usize| {
        format!(
            "1574187013.{:02},{},{imu},0.0{},0.01,0.02,0.1,0.2,-9.8,0,0,45.5",
            k,
            12_000_000 + 10_000 * k + imu,
            k % 7
        )
    };
    let head = "timestamp,TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T";
    let (record, said) = notes(&format!("{head}\n{}", rows(60, &|k| row(k, 0))), "", "");
    assert!((middle_step(&record) - 0.01).abs() < 1e-9, "{said}");
    let gyro = &record.channel("gyro_z").expect("z").values;
    assert!((gyro[0] - 0.02f64.to_degrees()).abs() < 1e-9, "{said}");
    let told = refusal(
        &format!("{head}\n{}", rows(60, &|k| row(k / 2, k % 2))),
        "",
        "",
    );
    assert!(told.contains("several sensors: column `I`"), "{told}");
    let text = "FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns\nIMU, 1, 0, 0.1\n";
    let told = refusal(text, "", "");
    assert!(
        told.contains("ArduPilot") && told.contains("mavlogdump.py"),
        "{told}"
    );
}

#[test]
fn beside_rates_the_attitude_and_the_counts_of_the_same_gyros_are_left() {
    let body = rows(40, &|k| {
        format!("{:.2},{},{}", 0.01 * k as f64, 131 * (k % 7), k % 7)
    });
    for other in ["Roll (deg)", "Gyro X raw (LSB)"] {
        let (record, said) = notes(&format!("Time (s),{other},Gyro X (deg/s)\n{body}"), "", "");
        assert_eq!(
            record.channel("gyro_x").expect("x").values[3],
            3.0,
            "{said}"
        );
        assert!(said.contains(&format!("not read: `{other}`")), "{said}");
    }
}

#[test]
fn the_one_column_that_calls_itself_a_time_is_taken_beside_names_of_ours() {
    let body = rows(40, &|k| {
        format!("{:.2},{},{}", 0.01 * k as f64, k % 7, k % 5)
    });
    for time in ["Elapsed Time", "SampleTimeFine", "Zeit"] {
        let (record, said) = notes(&format!("{time},gyro_x [deg/s],T\n{body}"), "", "");
        assert!((middle_step(&record) - 0.01).abs() < 1e-9, "{time}: {said}");
    }
}
