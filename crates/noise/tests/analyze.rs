//! `analyze` on whole records: the contract of its JSON, the measured records, and its answers to bad input.

use model::record::AnalysisError;
use model::record::{Axis, Channel, Quantity, Record};
use noise::allan::{Deviation, TauGrid};
use noise::{AnalyzeOptions, analyze};
use rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

fn gyro(values: Vec<f64>) -> Record {
    let mut record = Record {
        channels: vec![Channel {
            name: "gyro_z".into(),
            quantity: Quantity::Gyro,
            axis: Some(Axis::Z),
            unit: "deg/s".into(),
            values,
            counts: None,
            lsb: None,
        }],
        ..Record::default()
    };
    record.header.rate_hz = Some(20.0);
    record
}

/// 600 s at 20 Hz of the paper's 5.27 deg/sqrt(h), white.
fn white(seed: u64) -> Record {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let sigma = 5.27 / 60.0 / 0.05f64.sqrt();
    gyro(
        (0..12_000)
            .map(|_| {
                let e: f64 = StandardNormal.sample(&mut rng);
                0.3 + sigma * e
            })
            .collect(),
    )
}

#[test]
fn the_json_is_the_contract_and_white_noise_reads_as_5_27_without_a_bias_instability() {
    let options = AnalyzeOptions {
        deviations: vec![Deviation::Oadev, Deviation::Mdev],
        ..AnalyzeOptions::default()
    };
    let json = serde_json::to_value(analyze(&white(1), &options).unwrap()).unwrap();
    assert_eq!(json["format"], "imu-stand-analysis/1");
    let z = &json["channels"]["gyro_z"];
    assert_eq!(z["unit"], "deg/s");
    for kind in ["oadev", "mdev"] {
        for key in ["tau_s", "deviation", "low", "high", "edf", "n"] {
            assert!(z["deviations"][kind][0][key].is_number(), "{kind} {key}");
        }
        // White there, and said so.
        assert_eq!(z["deviations"][kind][2]["noise_alpha"], 0, "{kind}");
    }
    for (name, unit) in [
        ("angle_random_walk", "deg/sqrt(h)"),
        ("bias_instability", "deg/h"),
        ("rate_random_walk", "deg/s/sqrt(s)"),
        ("rate_ramp", "deg/s^2"),
        ("quantization_noise", "deg"),
    ] {
        assert_eq!(z["parameters"][name]["unit"], unit);
        assert!(z["parameters"][name]["high"].is_number(), "{name}");
    }
    let n = &z["parameters"]["angle_random_walk"];
    // Standard error N/sqrt(2·12000) = 0.65 %: 4 of them.
    assert!(
        (n["value"].as_f64().unwrap() / 5.27 - 1.0).abs() < 0.026,
        "{n}"
    );
    assert!(z["parameters"]["bias_instability"]["value"].is_null());
    assert_eq!(z["parameters_hold_from_s"], 0.05);
    let paper = &z["paper"];
    assert!(
        (paper["angle_random_walk"]["value"].as_f64().unwrap() / 5.27 - 1.0).abs() < 0.15,
        "{paper}"
    );
    assert_eq!(paper["in_run_bias_stability"]["unit"], "deg/h");
    let notes = paper["notes"].to_string();
    assert!(
        notes.contains("supports cluster times up to 60 s"),
        "{notes}"
    );
    assert!(
        notes.contains("white noise alone explains the flat level"),
        "{notes}"
    );
    assert_eq!(
        z["warnings"].as_array().unwrap().len(),
        0,
        "{}",
        z["warnings"]
    );
}

#[test]
fn the_same_seed_gives_the_same_answer() {
    let options = AnalyzeOptions {
        seed: 7,
        ..AnalyzeOptions::default()
    };
    assert_eq!(
        analyze(&white(2), &options).unwrap(),
        analyze(&white(2), &options).unwrap()
    );
}

#[test]
fn where_a_filter_bends_the_spectrum_the_slow_part_is_fitted_without_it() {
    // A first-order filter of pole 0.17, as the ADIS16405 looks at 100 Hz: its gain is 1 at rest, so N is that of the white
    // noise before it, 2.4 deg/sqrt(h); K 0.003 deg/s/sqrt(s). The whole spectrum says 2.0, and a flicker of 200 deg/h.
    let tau0 = 0.01f64;
    let (mut sum, mut covered) = (0.0, 0);
    for seed in 31..41 {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut draw = || -> f64 { StandardNormal.sample(&mut rng) };
        let (mut filtered, mut bias) = (0.0, 0.2);
        let values: Vec<f64> = (0..60_000)
            .map(|_| {
                filtered = 0.17 * filtered + 0.83 * 0.04 / tau0.sqrt() * draw();
                bias += 0.003 * tau0.sqrt() * draw();
                bias + filtered
            })
            .collect();
        let mut record = gyro(values);
        record.header.rate_hz = Some(100.0);
        let analysis = analyze(&record, &AnalyzeOptions::default()).unwrap();
        let z = &analysis.channels["gyro_z"];
        let n = &z.parameters.angle_random_walk;
        eprintln!(
            "{seed} {:?} from {:?}",
            (n.low, n.value, n.high),
            z.parameters_hold_from_s
        );
        sum += n.value.unwrap() / 2.4;
        covered += usize::from(n.low.unwrap() < 2.4 && 2.4 < n.high.unwrap());
        let b = &z.parameters.bias_instability;
        // Half of what the whole spectrum claims is there.
        assert!(b.value.is_none() && b.high.unwrap() < 100.0, "{b:?}");
        assert!(z.parameters_hold_from_s.unwrap() >= 0.04);
        let warning = &z.warnings[0];
        assert!(
            warning.contains("do not describe the curve") && warning.contains("Hz they do"),
            "{warning}"
        );
    }
    // A standard error of 1.2 % each, 0.4 % of the mean; what is left of the filter below 6.25 Hz takes 0.6 %. Of ten intervals
    // at 95 %, six or fewer has a chance of 1e-3.
    assert!((sum / 10.0 - 1.0).abs() < 0.016, "{sum}");
    assert!(covered > 6, "{covered}");
}

#[test]
fn where_the_slow_part_is_what_does_not_fit_no_band_is_made_to() {
    let mut record = white(32);
    for (i, v) in record.channels[0].values.iter_mut().enumerate() {
        *v += 0.2 * (i as f64 * 0.05 * std::f64::consts::TAU / 60.0).sin();
    }
    let analysis = analyze(&record, &AnalyzeOptions::default()).unwrap();
    let warnings = &analysis.channels["gyro_z"].warnings;
    assert!(
        warnings[0].contains("Parameters and intervals presume the terms"),
        "{warnings:?}"
    );
    assert_eq!(analysis.channels["gyro_z"].parameters_hold_from_s, None);
}

#[test]
fn missing_readings_are_gaps() {
    let mut record = white(3);
    for i in [4000, 4001, 9000] {
        record.channels[0].values[i] = f64::NAN;
    }
    let analysis = analyze(&record, &AnalyzeOptions::default()).unwrap();
    let z = &analysis.channels["gyro_z"];
    // Runs of 4000, 4998 and 2999 samples; n − 2m + 1 each.
    assert_eq!(z.deviations[&Deviation::Oadev][0].n, 3999 + 4997 + 2998);
    assert!(z.warnings[0].contains("2 gaps"), "{:?}", z.warnings);
    // Clusters bridge them: the curve ends where that of the whole record does, with a little less freedom.
    let whole = analyze(&white(3), &AnalyzeOptions::default()).unwrap();
    let (gaps, whole) = (
        &z.deviations[&Deviation::Oadev],
        &whole.channels["gyro_z"].deviations[&Deviation::Oadev],
    );
    assert_eq!(gaps.len(), whole.len());
    for (a, b) in gaps.iter().zip(whole) {
        assert!(a.n <= b.n && a.edf <= b.edf * 1.001, "{a:?} {b:?}");
        assert!(
            (a.deviation / b.deviation - 1.0).abs() < 0.02,
            "{a:?} {b:?}"
        );
    }
    assert!(z.parameters.angle_random_walk.value.is_some());
}

#[test]
fn bad_input_says_what_to_do() {
    let mut record = white(4);
    record.header.rate_hz = None;
    assert_eq!(
        analyze(&record, &AnalyzeOptions::default()),
        Err(AnalysisError::NoRate)
    );
    let rate = AnalyzeOptions {
        rate_hz: Some(20.0),
        ..AnalyzeOptions::default()
    };
    assert!(analyze(&record, &rate).is_ok());
    let missing = AnalyzeOptions {
        channels: Some(vec!["gyro_q".into()]),
        ..rate.clone()
    };
    assert_eq!(
        analyze(&record, &missing).unwrap_err().to_string(),
        "no channel gyro_q; the record has: gyro_z"
    );
    let stuck = gyro(vec![0.25; 100]);
    assert!(matches!(
        analyze(&stuck, &rate),
        Err(AnalysisError::Constant { .. })
    ));
    assert!(matches!(
        analyze(&gyro(vec![0.1, 0.2]), &rate),
        Err(AnalysisError::Inconclusive { .. })
    ));
    let short = analyze(&gyro(vec![0.1, 0.2, 0.15, 0.12]), &rate).unwrap();
    assert!(short.channels["gyro_z"].warnings[0].contains("inconclusive"));
}

/// The folder of measured records: `IMU_STAND_DATA`, else `../shared/data` beside the checkout.
fn data(name: &str) -> Option<std::path::PathBuf> {
    let folder = std::env::var_os("IMU_STAND_DATA").map_or_else(
        || std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"),
        Into::into,
    );
    let path = folder.join(name);
    if path.exists() {
        return Some(path);
    }
    println!(
        "NOT RUN: no {name} in {}; set IMU_STAND_DATA to the folder of measured records",
        folder.display()
    );
    None
}

#[test]
fn ref_stable32_ocxo_overlapping_allan() {
    let (Some(record), Some(table)) = (
        data("aux_ocxo_fractional_freq_1hz.csv.gz"),
        data("aux_ocxo_stable32_oadev.txt"),
    ) else {
        return;
    };
    let text = std::io::read_to_string(flate2::read::GzDecoder::new(
        std::fs::File::open(record).unwrap(),
    ))
    .unwrap();
    let y: Vec<f64> = text
        .lines()
        .filter(|l| !l.starts_with('#'))
        .skip(1)
        .map(|l| l.split(',').nth(1).unwrap().parse().unwrap())
        .collect();
    let phase = noise::allan::Phase::from_values(&y, std::slice::from_ref(&(0..y.len())));
    let mut compared = 0;
    for line in std::fs::read_to_string(table)
        .unwrap()
        .lines()
        .filter(|l| !l.starts_with('#'))
    {
        let columns: Vec<f64> = line
            .split_whitespace()
            .map(|v| v.parse().unwrap())
            .collect();
        let [m, _, n, _, _, sigma, _] = columns[..] else {
            continue;
        };
        let e = noise::allan::deviation(&phase, Deviation::Oadev, 1.0, m as usize).unwrap();
        assert_eq!(e.n as f64, n, "m = {m}");
        assert!(
            (e.deviation / sigma - 1.0).abs() < 1e-4,
            "m = {m}: {} {sigma}",
            e.deviation
        );
        compared += 1;
    }
    assert!(compared > 100, "{compared}");
}

#[test]
fn the_measured_adis16405_has_the_noise_its_makers_state() {
    let Some(path) = data("adis16405_run1_20hz_600s.csv.gz") else {
        return;
    };
    let text = std::io::read_to_string(flate2::read::GzDecoder::new(
        std::fs::File::open(path).unwrap(),
    ))
    .unwrap();
    let rows: Vec<Vec<f64>> = text
        .lines()
        .filter(|l| !l.starts_with('#'))
        .skip(1)
        .map(|l| l.split(',').map(|v| v.parse().unwrap()).collect())
        .collect();
    let mut record = gyro(Vec::new());
    record.header.rate_hz = None;
    record.host_time_s = Some(rows.iter().map(|r| r[0]).collect());
    record.channels = ["gyro_x", "gyro_y", "gyro_z"]
        .into_iter()
        .enumerate()
        .map(|(i, name)| Channel {
            name: name.into(),
            values: rows.iter().map(|r| r[i + 1]).collect(),
            ..record.channels[0].clone()
        })
        .collect();
    let options = AnalyzeOptions {
        taus: TauGrid::Decade,
        ..AnalyzeOptions::default()
    };
    let analysis = analyze(&record, &options).unwrap();
    assert!((analysis.input.rate_hz - 20.0).abs() < 1e-6);
    for (name, channel) in &analysis.channels {
        // data/README.md: overlapping Allan deviation at 1 s 0.041, 0.043, 0.039 deg/s over 10 000 s.
        let at_1s = channel.deviations[&Deviation::Oadev]
            .iter()
            .find(|p| (p.tau_s - 1.0).abs() < 1e-6)
            .unwrap();
        assert!(
            (0.033..0.050).contains(&at_1s.deviation),
            "{name} {at_1s:?}"
        );
        println!("{name}: N {:?}", channel.parameters.angle_random_walk);
        println!("{name}: B {:?}", channel.parameters.bias_instability);
        println!("{name}: K {:?}", channel.parameters.rate_random_walk);
        println!("{name}: {:?} {:?}", channel.paper, channel.warnings);
    }
}

#[test]
fn the_attitude_of_a_stand_at_rest_drifts_as_the_fits_predict() {
    // White noise of independent axes: the squared angle over its prediction is χ² of three in thirds.
    let (mut sum, records) = (0.0, 30);
    for seed in 0..records {
        let mut record = white(100 + 3 * seed);
        let of = |name: &str, axis, seed| Channel {
            name: name.into(),
            axis: Some(axis),
            counts: None,
            lsb: None,
            ..white(seed).channels[0].clone()
        };
        record.channels = vec![
            of("gyro_x", Axis::X, 100 + 3 * seed),
            of("gyro_y", Axis::Y, 101 + 3 * seed),
            of("gyro_z", Axis::Z, 102 + 3 * seed),
        ];
        for channel in &mut record.channels {
            channel.values.iter_mut().for_each(|v| *v *= 0.2);
        }
        let attitude = analyze(&record, &AnalyzeOptions::default())
            .unwrap()
            .attitude
            .unwrap();
        let p = attitude.points[9];
        let sigma = p.sigma_deg.unwrap();
        assert!(
            p.predicted_deg.unwrap() >= sigma.iter().map(|s| s * s).sum::<f64>().sqrt() * 0.999
        );
        sum += (p.angle_deg / p.predicted_deg.unwrap()).powi(2) / records as f64;
    }
    // χ²(90)/90: 4.5 standard deviations are 0.67; fits that see a walk by chance predict a little more.
    assert!((0.4..1.67).contains(&sum), "{sum}");
}

#[test]
fn the_integrated_angle_stays_within_its_prediction_and_a_turn_is_seen_by_the_attitude() {
    let z = &analyze(&white(11), &AnalyzeOptions::default()).unwrap();
    let angle = z.channels["gyro_z"].angle.as_ref().unwrap();
    assert!((angle.calibration_s - 60.0).abs() < 0.1);
    assert_eq!(angle.points.len(), 20);
    for p in &angle.points {
        // Beyond 4 of its standard deviations a point lies with a chance of 6e-5; they hang together.
        assert!((p.angle - p.expected).abs() < 4.0 * p.sigma, "{p:?}");
    }
    assert!(z.attitude.is_none(), "one gyro gives no attitude");
    // Three gyros at rest for 60 s, then a turn about y by 90 degrees in 30 s.
    let mut record = white(12);
    let rest = record.channels[0].values.clone();
    let axis = |name: &str, axis, turn: f64| Channel {
        name: name.into(),
        axis: Some(axis),
        values: rest
            .iter()
            .enumerate()
            .map(|(i, v)| 1e-3 * v + if (4000..4600).contains(&i) { turn } else { 0.0 })
            .collect(),
        counts: None,
        lsb: None,
        ..record.channels[0].clone()
    };
    record.channels = vec![
        axis("gyro_x", Axis::X, 0.0),
        axis("gyro_y", Axis::Y, 3.0),
        axis("gyro_z", Axis::Z, 0.0),
    ];
    let attitude = analyze(&record, &AnalyzeOptions::default())
        .unwrap()
        .attitude
        .unwrap();
    let last = attitude.points.last().unwrap();
    assert!((last.angle_deg - 90.0).abs() < 0.5, "{last:?}");
    assert_eq!(last.predicted_deg, None, "90 degrees are not small");
    assert!(
        (last.quaternion[2] - 0.5f64.sqrt()).abs() < 0.01,
        "{last:?}"
    );
}
