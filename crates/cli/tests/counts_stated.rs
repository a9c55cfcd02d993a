//! Counts of which a file says what one is, names of others beside ours, and tables that loggers begin with remarks.

use std::fmt::Write as _;

use diagnosis::{DiagnoseOptions, diagnose};
use imu_stand::capture::{Read, read_from};
use imu_stand::{ColumnMapping, ReadOptions};
use model::record::{Channel, Quantity};
use rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

fn read(text: &str, units: Option<&str>) -> Read {
    let options = ReadOptions {
        mapping: ColumnMapping::parse(None, units).expect("a mapping"),
        ..ReadOptions::default()
    };
    read_from(text.as_bytes(), &options).expect("a table")
}

fn channel<'a>(read: &'a Read, name: &str) -> &'a Channel {
    read.record.channel(name).expect(name)
}

/// Codes of white noise of 4 steps, all of them multiples of `step`.
fn codes(step: i32, seed: u64) -> Vec<i32> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut one = || {
        let z: f64 = StandardNormal.sample(&mut rng);
        (4.0 * z).round() as i32 * step
    };
    (0..6000).map(|_| one()).collect()
}

/// A table of one gyro at 100 Hz, behind what the file says.
fn table(said: &str, name: &str, cell: &dyn Fn(i32) -> String, codes: &[i32]) -> String {
    let mut text = format!("{said}time [s],{name}\n");
    for (k, code) in codes.iter().enumerate() {
        let _ = writeln!(text, "{:.2},{}", 0.01 * k as f64, cell(*code));
    }
    text
}

#[test]
fn a_step_of_several_counts_is_named_where_the_count_is_stated_and_only_there() {
    let (counts, rates) = (&|c: i32| c.to_string() as String, &|c: i32| {
        format!("{:.7}", f64::from(c) / 131.0)
    });
    let said = "# Gyro scale: 131 LSB/(deg/s)\n";
    let unit = Some("gyro=0.0076335878deg/s");
    for step in [1, 2, 3, 5, 6, 8] {
        let codes = codes(step, 40 + step as u64);
        for (text, units, is_stated) in [
            (table(said, "gyro_x", counts, &codes), None, true),
            (table("", "gyro_x", counts, &codes), unit, true),
            (table(said, "gyro_x [deg/s]", rates, &codes), None, true),
            (table("", "gyro_x [deg/s]", rates, &codes), None, false),
        ] {
            let read = read(&text, units);
            let options = DiagnoseOptions {
                replicates: 0,
                ..DiagnoseOptions::default()
            };
            let found = diagnose(&read.record, &options).expect("a diagnosis");
            let findings = &found.diagnosis.findings;
            let coarse = findings.iter().find(|f| f.cause == "coarse_lsb");
            let told = coarse.map(|f| f.parameters["step_counts"].value);
            let wanted = (is_stated && step > 1).then_some(f64::from(step));
            assert_eq!(told, wanted, "step {step}: {findings:#?}");
        }
    }
}

#[test]
fn whole_cells_of_a_stated_count_are_counts_and_others_are_none() {
    let text = |cell: &str| {
        let row = |k: usize| format!("{:.2},{},0.{k:03}\n", 0.01 * k as f64, k % 7);
        let rows: String = (0..200).map(row).collect();
        format!(
            "time [s],gyro_x,acc_x [m/s2]\n{}",
            rows.replacen(",3,", cell, 1)
        )
    };
    let units = Some("gyro=0.0076deg/s");
    let whole = read(&text(",3,"), units);
    let gyro = channel(&whole, "gyro_x");
    assert_eq!(gyro.lsb, Some(0.0076));
    assert_eq!(gyro.counts.as_ref().expect("counts")[..5], [0, 1, 2, 3, 4]);
    let parts = read(&text(",3.5,"), units);
    assert_eq!(channel(&parts, "gyro_x").counts, None);
    // Of a unit that is no count's nothing is said.
    let rates = read(&text(",3,"), Some("gyro=deg/s"));
    assert_eq!(channel(&rates, "gyro_x").counts, None);
}

#[test]
fn gyros_of_other_names_stand_beside_accelerometers_and_a_supply_of_ours() {
    let rows: String = (0..200)
        .map(|k| {
            format!(
                "{},{},{},{},0.{k:03},9.8,0.1,5.{k:03},20.5\n",
                10 * k,
                k % 7,
                k % 5,
                k % 3
            )
        })
        .collect();
    let head = "# Gyro scale: 131 LSB/(deg/s)\n";
    let names = "time [ms],gx,gy,gz,acc_x [m/s2],acc_y [m/s2],acc_z [m/s2],supply [V],temp [degC]";
    let found = read(&format!("{head}{names}\n{rows}"), None);
    let of = |quantity: Quantity| found.record.all(quantity).count();
    assert_eq!(
        [
            Quantity::Gyro,
            Quantity::Acc,
            Quantity::Supply,
            Quantity::Temp
        ]
        .map(of),
        [3, 3, 1, 1],
        "{:?}",
        found.record.notes
    );
    let lsb = channel(&found, "gyro_y").lsb.expect("a count");
    assert!((lsb * 131.0 - 1.0).abs() < 1e-9, "{lsb}");
    assert!((channel(&found, "supply").values[7] - 5.007).abs() < 1e-9);
}

/// Rows of three registers, of which each swings by 40 about its middle.
fn registers(middles: [i64; 3]) -> Read {
    let mut text = "time_ms,gx,gy,gz\n".to_owned();
    for k in 0..400i64 {
        let of = |middle: i64| (middle + (k * 37 % 81) - 40).rem_euclid(0x1_0000);
        let [x, y, z] = middles.map(of);
        let _ = writeln!(text, "{},0x{x:04X},0x{y:04X},0x{z:04X}", 10 * k);
    }
    read(&text, Some("gyro=0.01deg/s"))
}

#[test]
fn a_register_in_the_upper_half_has_the_sign_that_the_others_have() {
    for (middles, wanted) in [
        // About the middle, all of them; one that goes through it; one that goes through zero.
        ([0x8200, 0x8100, 0x8300], [0x8200, 0x8100, 0x8300]),
        ([0xE200, 0x8000, 0x8300], [0xE200, 0x8000, 0x8300]),
        ([0x8200, 0x0000, 0xFF00], [0x8200 - 0x1_0000, 0, -0x100]),
        // Nearer to zero from below.
        ([0xFE00, 0xF100, 0xFF00], [-0x200, -0xF00, -0x100]),
    ] {
        let read = registers(middles);
        for (name, middle) in ["gyro_x", "gyro_y", "gyro_z"].iter().zip(wanted) {
            let values = &channel(&read, name).values;
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            assert!(
                (100.0 * mean - middle as f64).abs() < 5.0,
                "{middles:x?} {name}: {mean}"
            );
        }
    }
}

#[test]
fn a_remark_before_rows_without_names_is_no_name() {
    for (remark, separator) in [
        ("logger started on bench 3", ","),
        ("Test 2, run 4", "\t"),
        ("first try", ";"),
    ] {
        let row = |k: usize| format!("{:.2},{},{},{}\n", 0.01 * k as f64, k % 7, k % 5, k % 3);
        let rows: String = (0..200).map(row).collect();
        let text = format!("{remark}\n{}", rows.replace(',', separator));
        let options = ReadOptions {
            mapping: ColumnMapping::parse(
                Some("time=1,gyro_x=2,gyro_y=3,gyro_z=4"),
                Some("gyro=deg/s"),
            )
            .expect("a mapping"),
            ..ReadOptions::default()
        };
        let found = read_from(text.as_bytes(), &options).expect(remark);
        assert_eq!(found.record.len(), 200, "{remark}");
        let notes = &found.record.notes;
        assert!(
            notes.iter().any(|n| n.contains("begins in line 2")),
            "{notes:?}"
        );
    }
    // Names that are too few stay an error.
    let text = "a,b\n".to_owned() + &"1,2,3\n".repeat(50);
    let error = read_from(text.as_bytes(), &ReadOptions::default());
    assert!(error.is_err());
}

#[test]
fn channels_of_labview_without_names_are_taken_by_their_units() {
    let lvm = |units: [&str; 4]| {
        let mut text = "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\nDecimal_Separator\t.\n\
             X_Columns\tOne\n***End_of_Header***\t\n\nChannels\t4\nSamples\t200\t200\t200\t200\n"
            .to_owned();
        let _ = writeln!(text, "Y_Unit_Label\t{}", units.join("\t"));
        text += "X_Dimension\tTime\tTime\tTime\tTime\nX0\t0\t0\t0\t0\nDelta_X\t0.01\t0.01\t0.01\t0.01\n***End_of_Header***\t\n";
        text += "X_Value\tUntitled\tUntitled 1\tUntitled 2\tUntitled 3\tComment\n";
        for k in 0..200 {
            let _ = writeln!(
                text,
                "{:.2}\t{}\t{}\t{}\t{}",
                0.01 * f64::from(k),
                k % 7,
                k % 5,
                k % 3,
                k % 11
            );
        }
        text
    };
    let found = read(&lvm(["Deg/s", "Deg/s", "Deg/s", "g"]), None);
    let names: Vec<&str> = found
        .record
        .channels
        .iter()
        .map(|c| c.name.as_str())
        .collect();
    assert_eq!(names, ["gyro_x", "gyro_y", "gyro_z", "acc_x"]);
    let told = |note: &String| note.contains("`Untitled 1` as `gyro_y`");
    assert!(
        found.record.notes.iter().any(told),
        "{:?}",
        found.record.notes
    );
    // Volts are of anything.
    let volts = lvm(["Volts", "Volts", "Volts", "Volts"]);
    assert!(read_from(volts.as_bytes(), &ReadOptions::default()).is_err());
}
