//! Tables as pandas writes them: an index without a name, marks of its own for what is missing, times in single precision.

use super::{error, is_the_table, read, table};

#[test]
fn an_index_without_a_name_goes_by_its_number_in_the_mapping_that_is_proposed() {
    let text = table(",wx,wy\n", ",", ".", 1.0, 1.0);
    let said = error(text.as_bytes(), "", "");
    let map = "time=1,gyro_x=wx,gyro_y=wy";
    assert!(said.contains(&format!("--columns {map} --units")), "{said}");
    is_the_table(&read(text.as_bytes(), map, "gyro=deg/s").expect("what was proposed"));
}

#[test]
fn three_axes_of_an_unknown_name_are_proposed_together() {
    for stem in ["Drehrate", "Sensor"] {
        let text = format!("Zeit;{stem}_x;{stem}_y;{stem}_z\n0,00;0,1;0,2;0,3\n0,01;0,2;0,2;0,1\n");
        let said = error(text.as_bytes(), "", "");
        let map = format!("time=Zeit,gyro_x={stem}_x,gyro_y={stem}_y,gyro_z={stem}_z");
        assert!(said.contains(&map), "{said}");
    }
}

#[test]
fn what_tables_write_for_a_missing_reading_is_a_missing_reading() {
    for word in ["N/A", "NA", "null", "None", "<NA>", "NaN", ""] {
        let text = format!("time,gyro_x,gyro_y\n0.00,1,2\n0.02,{word},2\n0.04,3,2\n0.06,4,2\n");
        let read = read(text.as_bytes(), "", "gyro=deg/s").expect(word);
        let x = &read.record.channel("gyro_x").expect("gyro x").values;
        assert!(
            x.len() == 4 && x[1].is_nan() && x[2] == 3.0,
            "{word}: {x:?}"
        );
        assert!(
            read.record.notes.iter().any(|n| n.contains("1 of 4 rows")),
            "{word}"
        );
    }
    // What is no word for it stays an error.
    let said = error(b"time,gyro_x\n0.00,1\n0.02,bad\n0.04,3\n", "", "gyro=deg/s");
    assert!(said.contains("`bad` is not a finite number"), "{said}");
}

#[test]
fn times_too_coarse_to_tell_a_rate_ask_for_it() {
    // Seconds since 1970 in single precision are 128 s apart: 100 Hz looked like 80 Hz.
    let rows = |count: u32, step: f64| -> String {
        let each = (0..count).map(|k| {
            let t = (1.7e9 + 0.01 * f64::from(k)) / step;
            format!("{},{}\n", t.round() * step, k % 7)
        });
        std::iter::once("time,gyro_x\n".to_owned())
            .chain(each)
            .collect()
    };
    let coarse = rows(20_000, 128.0);
    let said = error(coarse.as_bytes(), "", "gyro=deg/s");
    assert!(
        said.contains("tell the rate to") && said.contains("--rate HZ"),
        "{said}"
    );
    let read = read(rows(20_000, 1.0).as_bytes(), "", "gyro=deg/s").expect("whole seconds");
    let told = |part: &str| read.record.notes.iter().any(|note| note.contains(part));
    assert!(
        told("such times tell the rate to 0.50 %"),
        "{:?}",
        read.record.notes
    );
}

#[test]
fn a_typographic_minus_is_a_minus() {
    let text = "t;gx\n0;\u{2212}0,25\n0,02;1,5e\u{2212}1\n0,04;-7\n";
    let record = read(text.as_bytes(), "time=t,gyro_x=gx", "gyro=deg/s")
        .expect("numbers")
        .record;
    assert_eq!(record.channels[0].values, [-0.25, 0.15, -7.0]);
    let said = error(
        "t,gx\n0,1\n0.02,\u{2212}\n".as_bytes(),
        "time=t,gyro_x=gx",
        "gyro=deg/s",
    );
    assert!(
        said.contains("line 3") && said.contains("not a finite number"),
        "{said}"
    );
}

#[test]
fn readings_that_no_sensor_has_are_out_of_range_and_not_missing() {
    let rows = |gyro: &str| {
        (0..9).fold("time_s,gyro_x,gyro_y\n".to_owned(), |text, k| {
            text + &format!("{},1e200,{gyro}\n", 0.02 * f64::from(k))
        })
    };
    let said = error(rows("nan").as_bytes(), "", "gyro=deg/s");
    assert!(
        said.contains("gyro_x: all 9 readings are out of range, up to 1e200 deg/s")
            && said.contains("--units"),
        "{said}"
    );
    let one = read(rows("2").as_bytes(), "", "gyro=deg/s")
        .expect("one gyro is whole")
        .record;
    assert!(
        one.notes.join("; ").contains("no sensor reads"),
        "{:?}",
        one.notes
    );
}
