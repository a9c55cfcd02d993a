//! Records that nobody here made: no slow or exogenous cause is named that a second part of the same record does not
//! repeat. The data lie beside the project (`../shared/data`) or where `IMU_STAND_DATA` says.

use std::collections::BTreeSet;
use std::io::Read as _;
use std::path::PathBuf;

use diagnosis::result::Diagnosis;
use diagnosis::{DiagnoseOptions, diagnose};
use model::record::{Axis, Base, Channel, Header, Quantity, Record};

fn read(file: &str) -> (Vec<String>, Vec<Vec<f64>>) {
    let folder = std::env::var_os("IMU_STAND_DATA").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"),
        PathBuf::from,
    );
    let path = folder.join(file);
    let bytes = std::fs::File::open(&path).unwrap_or_else(|e| {
        panic!(
            "{}: {e}; set IMU_STAND_DATA to the folder with the measured records",
            path.display()
        )
    });
    let mut text = String::new();
    flate2::read::GzDecoder::new(bytes)
        .read_to_string(&mut text)
        .expect("gzip text");
    let mut lines = text.lines().filter(|l| !l.starts_with('#'));
    let names: Vec<String> = lines
        .next()
        .expect("a header")
        .split(',')
        .map(str::to_owned)
        .collect();
    let mut columns = vec![vec![]; names.len()];
    for line in lines {
        for (c, v) in columns.iter_mut().zip(line.split(',')) {
            c.push(v.parse().unwrap_or(f64::NAN));
        }
    }
    (names, columns)
}

/// Rows `from..to`, averaged by `by`.
fn record(file: &str, rate_hz: f64, rows: std::ops::Range<usize>, by: usize) -> Record {
    let (names, columns) = read(file);
    let axis = |i: usize| Some(Axis::ALL[i]);
    let known = [
        ("gx_dps", "gyro_x", Quantity::Gyro, axis(0), "deg/s"),
        ("gy_dps", "gyro_y", Quantity::Gyro, axis(1), "deg/s"),
        ("gz_dps", "gyro_z", Quantity::Gyro, axis(2), "deg/s"),
        ("ax_mps2", "acc_x", Quantity::Acc, axis(0), "m/s^2"),
        ("ay_mps2", "acc_y", Quantity::Acc, axis(1), "m/s^2"),
        ("az_mps2", "acc_z", Quantity::Acc, axis(2), "m/s^2"),
        ("temp_c", "temp", Quantity::Temp, None, "degC"),
    ];
    let channels = known
        .iter()
        .filter_map(|(column, name, quantity, axis, unit)| {
            let i = names.iter().position(|n| n == column)?;
            let values = columns[i]
                [rows.start.min(columns[i].len())..rows.end.min(columns[i].len())]
                .chunks_exact(by)
                .map(|c| c.iter().sum::<f64>() / by as f64)
                .collect();
            Some(Channel {
                name: (*name).into(),
                quantity: *quantity,
                axis: *axis,
                unit: (*unit).into(),
                values,
                counts: None,
                lsb: None,
            })
        })
        .collect();
    Record {
        header: Header {
            rate_hz: Some(rate_hz),
            base: Some(Base::Static),
            ..Header::default()
        },
        channels,
        ..Record::default()
    }
}

/// The bursts of a thermal chamber, with their times.
fn bursts() -> Record {
    let file = "pan_tvac_bursts_50hz.csv.gz";
    let (names, columns) = read(file);
    let time = names.iter().position(|n| n == "time_s").expect("times");
    Record {
        host_time_s: Some(columns[time].clone()),
        header: Header::default(),
        ..record(file, 50.0, 0..usize::MAX, 1)
    }
}

#[test]
fn ref_lsm6dsm_the_bursts_of_a_thermal_chamber_have_two_slopes_and_a_silent_axis() {
    let d = told("bursts", &bursts());
    // Least squares on block means, and their halves, as those who published the record have them.
    let known = [
        ("gyro_x", Some((0.0298, [0.0327, 0.0295]))),
        ("gyro_y", Some((-0.0141, [-0.0142, -0.0134]))),
        ("gyro_z", None),
    ];
    for (channel, known) in known {
        let mut own = d.findings.iter().filter(|f| f.channels == [channel]);
        let found = own.find(|f| f.cause == "temperature");
        let Some((slope, halves)) = known else {
            assert!(found.is_none(), "{channel}: {found:?}");
            continue;
        };
        let p = &found.expect(channel).parameters["slope"];
        let within = 1.96 * p.std_error.expect("an error");
        println!(
            "{channel}: {:.4} +- {within:.4} (95 %), least squares {slope}",
            p.value
        );
        for other in [slope, halves[0], halves[1]] {
            assert!(
                (p.value - other).abs() <= within,
                "{channel}: {p:?}, {other}"
            );
        }
    }
}

fn told(of: &str, record: &Record) -> Diagnosis {
    let d = diagnose(record, &DiagnoseOptions::default())
        .expect("a diagnosis")
        .diagnosis;
    for f in &d.findings {
        let others: Vec<_> = f.alternatives.iter().map(|a| &a.cause).collect();
        println!(
            "{of}: {} (LR {:.1}, or {others:?}, held out {:.1})",
            f.what,
            f.likelihood_ratio.unwrap_or(0.0),
            f.gain
                .as_ref()
                .and_then(|g| g.held_out_log_score_nats)
                .unwrap_or(f64::NAN)
        );
    }
    for u in &d.unexplained {
        println!("{of}: unexplained on {}: {}", u.channel, u.what);
    }
    d
}

/// Slow and exogenous causes by channel.
fn slow(d: &Diagnosis) -> BTreeSet<(String, String)> {
    const SLOW: [&str; 10] = [
        "temperature",
        "temperature_quadratic",
        "warm_up",
        "rate_ramp",
        "bias_step",
        "motor_bias",
        "supply_sensitivity",
        "g_sensitivity",
        "cross_axis",
        "telegraph",
    ];
    d.findings
        .iter()
        .filter(|f| SLOW.contains(&f.cause.as_str()))
        .flat_map(|f| f.channels.iter().map(|c| (f.cause.clone(), c.clone())))
        .collect()
}

#[test]
fn ref_adis16405_no_slow_cause_is_named_that_another_part_does_not_repeat() {
    let file = "adis16405_run1_100hz.csv.gz";
    let parts: Vec<_> = [0, 3, 6, 9, 12]
        .iter()
        .map(|i| {
            slow(&told(
                &format!("adis16405 part {i}"),
                &record(file, 20.0, i * 60_000..(i + 1) * 60_000, 5),
            ))
        })
        .collect();
    for (i, part) in parts.iter().enumerate() {
        for named in part {
            assert!(
                parts
                    .iter()
                    .enumerate()
                    .any(|(j, p)| j != i && p.contains(named)),
                "{named:?} in part {i} alone"
            );
        }
    }
}

#[test]
fn ref_adis16405_no_slow_cause_is_named_at_100_hz_that_another_part_does_not_repeat() {
    let file = "adis16405_run1_100hz.csv.gz";
    let parts: Vec<_> = [0..60_000, 500_000..560_000]
        .into_iter()
        .enumerate()
        .map(|(i, rows)| {
            let of = format!("adis16405 at 100 Hz, part {i}");
            slow(&told(&of, &record(file, 100.0, rows, 1)))
        })
        .collect();
    assert_eq!(parts[0], parts[1]);
}

#[test]
fn ref_mpu6050_no_slow_cause_is_named_that_its_halves_do_not_repeat() {
    let file = "mpu6050_static_20hz_600s.csv.gz";
    let whole = slow(&told("mpu6050", &record(file, 19.864, 0..usize::MAX, 1)));
    let halves: Vec<_> = [0..5900, 5900..11_900]
        .into_iter()
        .map(|r| slow(&told("mpu6050 half", &record(file, 19.864, r, 1))))
        .collect();
    for named in whole {
        assert!(
            halves.iter().all(|h| h.contains(&named)),
            "{named:?} in the whole alone"
        );
    }
}

#[test]
fn ref_mpu6050_the_known_line_at_31_hz_is_named_on_z() {
    let record = record("mpu6050_static_100hz_655s.csv.gz", 99.32, 0..usize::MAX, 1);
    let d = told("mpu6050 at 100 Hz", &record);
    // It wanders by 0.3 Hz at a steady size.
    let line = d.findings.iter().find(|f| {
        f.cause == "wandering_line"
            && f.channels == ["gyro_z"]
            && f.parameters
                .get("center_frequency")
                .is_some_and(|p| (p.value - 31.37).abs() < 0.1)
    });
    assert!(line.is_some(), "no line at 31.37 Hz on gyro_z");
}

/// Standard deviation between two frequencies.
fn rms_in(values: &[f64], rate_hz: f64, from: f64, to: f64) -> f64 {
    let n = values.len() as f64;
    let c = diagnosis::likelihood::Dct::new(values.len()).forward(values);
    let k = |hz: f64| (2.0 * hz / rate_hz * n) as usize;
    (c[k(from)..k(to)].iter().map(|c| c * c).sum::<f64>() / n).sqrt()
}

#[test]
fn ref_adis16405_the_band_of_gyro_z_is_one_entry_and_comes_back_from_the_model() {
    let file = "adis16405_run1_100hz.csv.gz";
    for rows in [0..60_000, 500_000..560_000] {
        let mut record = record(file, 100.0, rows, 1);
        record.channels.retain(|c| c.name == "gyro_z");
        let d = diagnose(&record, &DiagnoseOptions::default()).expect("a diagnosis");
        let bands = d.diagnosis.findings.iter();
        let bands = bands.filter(|f| ["wandering_line", "narrow_band"].contains(&f.cause.as_str()));
        assert_eq!(bands.count(), 1, "{:?}", d.diagnosis.unexplained);
        let lines = d.diagnosis.findings.iter().filter(|f| f.cause == "line");
        assert_eq!(lines.count(), 0);
        let again = model::simulate_in_the_world_of(&d.extended_model, &record, 100.0, 1);
        let [own, simulated] = [&record, &again.expect("a run")]
            .map(|r| rms_in(&r.channels[0].values, 100.0, 17.0, 23.0));
        assert!((simulated / own - 1.0).abs() < 0.05, "{own} {simulated}");
    }
}

/// Overlapping Allan deviation at `m` samples.
fn allan(y: &[f64], m: usize) -> f64 {
    let mut sums = vec![0.0];
    y.iter().for_each(|v| sums.push(sums[sums.len() - 1] + v));
    let apart = |i: usize| sums[i + 2 * m] - 2.0 * sums[i + m] + sums[i];
    let count = y.len() + 1 - 2 * m;
    let squares: f64 = (0..count).map(|i| apart(i).powi(2)).sum();
    (squares / (2.0 * count as f64)).sqrt() / m as f64
}

#[test]
fn ref_adis16405_the_noise_beside_its_filter_is_that_of_the_allan_deviation() {
    const RATE_HZ: f64 = 100.0;
    let file = "adis16405_run1_100hz.csv.gz";
    let (whole, part) = (0..usize::MAX, 0..60_000);
    let whole = record(file, RATE_HZ, whole, 1);
    let made = diagnose(&record(file, RATE_HZ, part, 1), &DiagnoseOptions::default())
        .expect("a diagnosis");
    for own in &made.extended_model.channels {
        let n = &own.baseline["angle_random_walk"];
        let y = &whole.channel(&own.name).expect("the channel").values;
        // At 0.5 s the filter's memory of some samples is over, and the bias has not begun to wander.
        let wanted = 60.0 * allan(y, 50) * 0.5f64.sqrt();
        // The whole record's is known to half a per cent; what the 600 s have beside a band is told by its own error.
        let error = n.std_error.expect("an error").hypot(0.005 * wanted);
        let off = (n.value - wanted) / error;
        eprintln!("{}: {:.3} +- {error:.3}, {wanted:.3}", own.name, n.value);
        assert!(off.abs() < 3.5, "{}: {} for {wanted}", own.name, n.value);
        assert!(error < 0.03 * wanted, "{}: {error}", own.name);
    }
}
