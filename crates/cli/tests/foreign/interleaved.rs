//! Sensors of several rates in one table.

use imu_stand::capture::Read;

use super::read;

/// Rows of these times and cells, put in order of time.
fn table(names: &str, mut rows: Vec<(f64, String)>) -> Read {
    rows.sort_by(|a, b| a.0.total_cmp(&b.0));
    let rows: String = (rows.iter().map(|(t, cells)| format!("{t:.4},{cells}\n"))).collect();
    read(format!("{names}\n{rows}").as_bytes(), "", "").expect(names)
}

fn values<'a>(read: &'a Read, name: &str) -> &'a [f64] {
    &read.record.channel(name).expect(name).values
}

#[test]
fn rows_of_a_faster_accelerometer_are_no_missing_readings_of_the_gyro() {
    let row = |k: u32| {
        let gyro = if k.is_multiple_of(2) {
            format!("0.{k:04}")
        } else {
            String::new()
        };
        (
            0.01 * f64::from(k),
            format!("{gyro},{:.3}", 9.8 + 0.001 * f64::from(k % 7)),
        )
    };
    let read = table("time_s,gyro_x_dps,acc_z_m_s2", (0..2000).map(row).collect());
    let gyro = values(&read, "gyro_x");
    assert_eq!((gyro.len(), read.record.header.rate_hz), (1000, Some(50.0)));
    assert!((0..1000).all(|k| (gyro[k] - 2e-4 * k as f64).abs() < 1e-9));
    assert!((values(&read, "acc_z")[1] - 9.802).abs() < 1e-9);
    let notes = read.record.notes.join("\n");
    assert!(
        notes.contains("1000 of 2000 rows have no reading of gyro_x, and those"),
        "{notes}"
    );
    assert!(
        notes.contains("of acc_z the readings in these rows"),
        "{notes}"
    );
    assert!(!notes.contains("nothing is concluded"), "{notes}");
}

#[test]
fn rows_without_any_reading_that_leave_even_steps_are_no_missing_readings() {
    let cell = |k: u32| {
        if k.is_multiple_of(3) {
            format!("0.{k:04}")
        } else {
            "nan".to_owned()
        }
    };
    let read = table(
        "time_s,gyro_x_dps",
        (0..3000).map(|k| (0.01 * f64::from(k), cell(k))).collect(),
    );
    assert_eq!(values(&read, "gyro_x").len(), 1000);
    let rate = read.record.header.rate_hz.expect("a rate");
    assert!((rate - 100.0 / 3.0).abs() < 1e-3, "{rate}");
}

#[test]
fn a_thermometer_with_rows_of_its_own_is_taken_between_them() {
    let gyro = (0..3000).map(|k| {
        (
            0.02 * f64::from(k),
            format!("{:.3},", 0.001 * f64::from(k % 9)),
        )
    });
    let at = |k: u32| f64::from(k) / 7.3 + 0.003;
    let thermometer = (0..440).map(|k| (at(k), format!(",{:.4}", 25.0 + 0.01 * at(k))));
    let read = table(
        "time_s,gyro_x_dps,temp_degC",
        gyro.chain(thermometer).collect(),
    );
    assert_eq!(read.record.header.rate_hz, Some(50.0));
    let temperature = values(&read, "temp");
    assert_eq!(temperature.len(), 3000);
    let off = |k: usize| (temperature[k] - 25.0 - 2e-4 * k as f64).abs();
    assert!((0..3000).all(|k| off(k) < 1e-3), "{:?}", &temperature[..9]);
    let notes = read.record.notes.join("\n");
    assert!(notes.contains("its sensor: temp"), "{notes}");
}

#[test]
fn readings_that_a_gyro_lost_stay_missing() {
    // Alone, and a tenth of a minute of them.
    for lost in [|k: u32| k % 5 == 3, |k: u32| (700..1000).contains(&k)] {
        let row = |k: u32| {
            let gyro = if lost(k) {
                String::new()
            } else {
                format!("0.{k:04}")
            };
            (0.02 * f64::from(k), format!("{gyro},9.8{}", k % 7))
        };
        let read = table("time_s,gyro_x_dps,acc_z_m_s2", (0..2000).map(row).collect());
        let gyro = values(&read, "gyro_x");
        assert_eq!((gyro.len(), read.record.header.rate_hz), (2000, Some(50.0)));
        assert!((0..2000).all(|k| gyro[k as usize].is_nan() == lost(k)));
    }
}
