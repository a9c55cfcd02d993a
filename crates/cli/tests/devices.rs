//! Files as the tools of sensors' makers write them: scales in words, counters of packets, times in ticks.

use imu_stand::capture::read_from;
use imu_stand::{CaptureError, ColumnMapping, ReadOptions};
use model::record::Record;

fn read(text: &str, columns: &str, units: &str) -> Result<Record, CaptureError> {
    let options = ReadOptions {
        mapping: ColumnMapping::parse(Some(columns), Some(units))?,
        ..ReadOptions::default()
    };
    read_from(text.as_bytes(), &options).map(|read| read.record)
}

/// The whole text of an error, its help too.
fn refusal(text: &str, columns: &str) -> String {
    let error = read(text, columns, "").expect_err("no record");
    let help = miette::Diagnostic::help(&error).map_or_else(String::new, |help| help.to_string());
    format!("{error}; {help}")
}

fn rows(count: usize, row: &dyn Fn(usize) -> String) -> String {
    (0..count).map(|k| row(k) + "\n").collect()
}

fn step(record: &Record) -> f64 {
    let times = record.host_time_s.as_ref().expect("times");
    (times[times.len() - 1] - times[0]) / (times.len() - 1) as f64
}

/// Counts of a gyro and of an accelerometer that reads gravity in z.
fn counts(k: usize) -> String {
    let gyro = 131 + k % 7;
    format!("{gyro},{gyro},{gyro},{},{},{}", k % 5, k % 3, 16384 + k % 4)
}

#[test]
fn a_scale_in_words_is_taken_for_counts_and_told() {
    let body = rows(60, &|k| format!("{:.2},{}", 0.01 * k as f64, counts(k)));
    let head = "# Gyro scale: 131 LSB/(deg/s)\n# Accel scale: 16384 LSB/g\n";
    for names in [
        "time_s,gx,gy,gz,ax,ay,az",
        "time_s,gyro_x,gyro_y,gyro_z,acc_x,acc_y,acc_z",
        "time_s,gx [LSB],gy [LSB],gz [LSB],ax [LSB],ay [LSB],az [LSB]",
    ] {
        let record = read(&format!("{head}{names}\n{body}"), "", "").expect(names);
        let first = |name: &str| record.channel(name).expect(name).values[0];
        assert!((first("gyro_x") - 1.0).abs() < 1e-12, "{names}");
        assert!((first("acc_z") - 9.80665).abs() < 1e-9, "{names}");
        let said = record.notes.join("\n");
        assert!(
            said.contains("0.007634 deg/s each, as line 1 says") && said.contains("as line 2 says"),
            "{said}"
        );
        // What is given by hand goes before it; without either the question is what a count is.
        let said = refusal(&format!("{names}\n{body}"), "");
        assert!(
            said.contains("unit") && !said.contains("`counts`"),
            "{said}"
        );
        let record = read(&format!("{head}{names}\n{body}"), "", "gyro=deg/s").expect(names);
        assert_eq!(record.channel("gyro_x").expect("x").values[0], 131.0);
    }
}

#[test]
fn a_range_two_scales_and_a_scale_of_measured_values_are_told_with_the_question() {
    let body = rows(60, &|k| format!("{:.2},{}", 0.01 * k as f64, counts(k)));
    let measured = body.replace(",131,", ",131.5,");
    for (head, body) in [
        ("gyro range: 250 dps\n", &body),
        ("# Gyro: 131 LSB/dps\n# Gyro: 65.5 LSB/dps\n", &body),
        ("# Gyro scale: 131 LSB/dps\n", &measured),
    ] {
        for names in [
            "time_s,gx,gy,gz,ax,ay,az",
            "time_s,gyro_x,gyro_y,gyro_z,a,b,c",
        ] {
            let said = refusal(&format!("{head}{names}\n{body}"), "");
            let line = head.lines().next().expect("a line");
            assert!(said.contains(&format!("line 1 says `{line}`")), "{said}");
        }
    }
}

#[test]
fn a_counter_of_packets_is_the_sequence_number_and_its_wrap_is_none() {
    let head = "// Sample rate: 100.0Hz\nPacketCounter\tSampleTimeFine\tGyr_X\tGyr_Y\tGyr_Z\n";
    let number = |k: usize| 65_500 + k + if k > 150 { 5 } else { 0 };
    let row = |k: usize| {
        let n = number(k);
        format!("{}\t{}\t{}\t0.2\t0.{}", n % 65_536, 100 * n, k % 7, k % 9)
    };
    let text = format!("{head}{}", rows(300, &row));
    let said = refusal(&text, "");
    let proposed = "--columns time=SampleTimeFine,seq=PacketCounter,gyro_x=Gyr_X";
    assert!(said.contains(proposed), "{said}");
    // Five packets are missing, and the time has the unit that makes the rate stated.
    let record = read(
        &text,
        "time=SampleTimeFine,seq=PacketCounter,gyro_x=Gyr_X",
        "gyro=rad/s",
    );
    let record = record.expect("a record");
    let seq = record.seq.as_ref().expect("numbers");
    assert_eq!((seq[0], seq[299]), (65_500, 65_804));
    assert!((step(&record) - 304.0 / 299.0 * 0.01).abs() < 1e-9);
    let said = record.notes.join("\n");
    assert!(said.contains("time is taken in 0.1ms"), "{said}");
    // What may count in 8 bits is not proposed.
    let short = text
        .replace("PacketCounter", "Counter")
        .replace("\n655", "\n");
    assert!(!refusal(&short, "").contains("seq="));
}

#[test]
fn the_temperature_of_an_imu_of_ardupilot_has_one_letter() {
    let row = |k: usize| format!("{},0.1,0.2,0.{},41.{}", 10_000 * k, k % 7, k % 9);
    let text = format!("TimeUS,GyrX,GyrY,GyrZ,T\n{}", rows(60, &row));
    let record = read(&text, "", "").expect("a table");
    assert_eq!(record.channel("temp").expect("temp").values[8], 41.8);
    assert!((step(&record) - 0.01).abs() < 1e-9);
    // Elsewhere it may be a time.
    let said = refusal(&text.replace("TimeUS", "t_us"), "");
    assert!(!said.contains("temp="), "{said}");
}

#[test]
fn times_win_over_a_rate_that_is_stated_and_both_are_told() {
    let body = rows(60, &|k| {
        format!("{:.2},{},{}", 0.01 * k as f64, k % 7, k % 5)
    });
    for head in ["# rate_hz: 200", "# Sample rate: 200 Hz"] {
        let text = format!("{head}\ntime_s,gyro_x [deg/s],gyro_y [deg/s]\n{body}");
        let record = read(&text, "", "").expect(head);
        let said = record.notes.join("\n");
        let rate = 1.0
            / model::record::sampling::Sampling::of(&record, None)
                .expect("a rate")
                .tau0;
        assert!((rate - 100.0).abs() < 1e-6, "{head}: {rate}");
        assert!(
            said.contains("200") && said.contains("100") && said.contains("the times are taken"),
            "{said}"
        );
    }
}

#[test]
fn rows_that_repeat_their_names_in_turns_are_no_table_and_a_way_to_one_is_told() {
    let turns = "abbabaaabbbabaababba";
    for [one, other] in [
        ["AccelX:0.09,AccelY:-0.33", "GyroX:0.01,GyroY:0.02"],
        ["AcX = 213 | AcY = -502", "GyX = 56 | GyY = 57"],
    ] {
        let row = |turn| format!("{}\n", if turn == 'a' { one } else { other });
        let said = refusal(&turns.chars().map(row).collect::<String>(), "");
        assert!(
            said.contains("rows repeat the names of their readings") && said.contains("sed -E"),
            "{said}"
        );
    }
}
