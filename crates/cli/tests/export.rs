//! `imu-stand export`: what each consumer makes of the numbers it is given, written down from its own sources and
//! documentation, has to be the noise that was measured; and data come back as they were.

mod common;

use std::collections::BTreeMap;
use std::io::Read as _;
use std::path::Path;

use common::{folder, json, run, said};
use imu_stand::capture::{ReadOptions, read_capture};
use imu_stand::export::noise::{AxisNoise, Consumer, Figure, ImuNoise};
use rand_core::SeedableRng as _;
use rand_xoshiro::Xoshiro256PlusPlus;

/// What a consumer adds to a rate at each step of 1/rate.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Step {
    /// Standard deviation of the white part.
    white: f64,
    /// Standard deviation of the bias's step.
    walk: f64,
    /// What is left of the bias at the next step.
    keeps: f64,
}

const RATE: f64 = 50.0;

fn axis(name: &str, white: f64, flicker: f64, walk: f64) -> AxisNoise {
    AxisNoise {
        name: name.to_owned(),
        white: Figure::Known(white),
        flicker: Figure::Known(flicker),
        walk: Figure::Known(walk),
    }
}

/// 5.27 deg/sqrt(h) in rad/s/sqrt(Hz), and numbers of the kind.
fn imu() -> ImuNoise {
    ImuNoise {
        file: "run.csv".to_owned(),
        seconds: 7200.0,
        rate_hz: 20.0,
        gyro: vec![
            axis("gyro_x", 1.533e-3, 2.0e-4, 5.0e-6),
            axis("gyro_y", 1.533e-3, 2.0e-4, 5.0e-6),
            axis("gyro_z", 1.533e-3, 2.0e-4, 5.0e-6),
        ],
        acc: vec![
            axis("acc_x", 3.4e-3, 4.0e-4, 6.0e-5),
            axis("acc_y", 3.4e-3, 4.0e-4, 6.0e-5),
            axis("acc_z", 3.4e-3, 4.0e-4, 6.0e-5),
        ],
        remarks: Vec::new(),
        causes: Vec::new(),
        is_after_causes: false,
    }
}

fn yaml(text: &str) -> BTreeMap<String, f64> {
    text.lines()
        .filter(|line| !line.starts_with('#'))
        .filter_map(|line| {
            let (key, value) = line.split_once(':')?;
            let value = value.split('#').next()?.trim().parse().ok()?;
            Some((key.trim().to_owned(), value))
        })
        .collect()
}

/// The first number after each occurrence of `before`.
fn numbers(text: &str, before: &str) -> Vec<f64> {
    text.split(before)
        .skip(1)
        .map(|rest| {
            let end = rest
                .find(|c: char| !(c.is_ascii_digit() || "+-.e".contains(c)))
                .unwrap_or(rest.len());
            rest[..end].parse().expect("a number")
        })
        .collect()
}

fn close(a: f64, b: f64, what: &str) {
    // Files carry seven digits.
    assert!((a / b - 1.0).abs() < 1e-5, "{what}: {a:e} is not {b:e}");
}

/// The measured noise as steps: sampled by averaging over 1/RATE.
fn measured(axis: &AxisNoise) -> Step {
    Step {
        white: axis.white.expected().unwrap() * RATE.sqrt(),
        walk: axis.walk.expected().unwrap() / RATE.sqrt(),
        keeps: 1.0,
    }
}

fn same(step: Step, axis: &AxisNoise, what: &str) {
    let truth = measured(axis);
    close(step.white, truth.white, what);
    // A long correlation time in place of an infinite one.
    assert!(
        (step.walk / truth.walk - 1.0).abs() < 1e-4,
        "{what}: {step:?}, {truth:?}"
    );
    assert!(
        (1.0 - step.keeps) * RATE * 7200.0 < 0.11,
        "{what}: no walk over the record: {step:?}"
    );
}

/// Kalibr, wiki "IMU noise model": n_d = sigma / sqrt(dt) * w, b_d += sigma_b * sqrt(dt) * w.
#[test]
fn kalibr_simulates_what_was_measured() {
    let imu = imu();
    let read = yaml(&imu.text(Consumer::Kalibr, RATE));
    assert_eq!(read["update_rate"], RATE);
    for (name, axis) in [("gyroscope", &imu.gyro[0]), ("accelerometer", &imu.acc[0])] {
        let dt = 1.0 / RATE;
        let step = Step {
            white: read[&format!("{name}_noise_density")] / dt.sqrt(),
            walk: read[&format!("{name}_random_walk")] * dt.sqrt(),
            keeps: 1.0,
        };
        same(step, axis, name);
    }
}

/// VINS-Mono, midpoint integration: of each of two samples dt/2 goes into the angle, with noise n; the bias takes a step of
/// dt * w. Over one step an angle gathers N^2 dt of variance, a bias K^2 dt.
#[test]
fn vins_propagates_the_variance_that_was_measured() {
    let imu = imu();
    let read = yaml(&imu.text(Consumer::Vins, RATE));
    let dt = 1.0 / RATE;
    for (name, axis) in [("gyr", &imu.gyro[0]), ("acc", &imu.acc[0])] {
        let n = read[&format!("{name}_n")];
        let angle_variance = 2.0 * (0.5 * dt * n).powi(2);
        let step = Step {
            // What a white sample of this standard deviation puts into the angle: (white dt)^2.
            white: angle_variance.sqrt() / dt,
            walk: dt * read[&format!("{name}_w")],
            keeps: 1.0,
        };
        same(step, axis, name);
    }
}

/// MATLAB imuSensor, "Algorithms": white = NoiseDensity sqrt(fs / s), walk = cumulated RandomWalk / sqrt(fs / s), with s = 2
/// for NoiseType double-sided (the default) and 1 for single-sided.
#[test]
fn matlab_simulates_what_was_measured() {
    let imu = imu();
    let text = imu.text(Consumer::Matlab, RATE);
    assert!(text.contains("'SampleRate', 50)"));
    let (density, walk) = (
        numbers(&text, "'NoiseDensity', ["),
        numbers(&text, "'RandomWalk', ["),
    );
    assert_eq!(text.matches("'NoiseType', 'single-sided'").count(), 2);
    let sides = 1.0f64;
    for (k, axis) in [&imu.gyro[0], &imu.acc[0]].into_iter().enumerate() {
        let step = Step {
            white: density[k] * (RATE / sides).sqrt(),
            walk: walk[k] / (RATE / sides).sqrt(),
            keeps: 1.0,
        };
        same(step, axis, &axis.name);
        close(
            numbers(&text, "'BiasInstability', [")[k],
            axis.flicker.expected().unwrap(),
            "B",
        );
    }
}

/// gz-sensors, GaussianNoiseModel: white N(0, stddev) per sample; bias = exp(-dt/tau) bias + N(0, s),
/// s^2 = -sigma_b^2 tau/2 expm1(-2 dt/tau).
#[test]
fn gazebo_simulates_what_was_measured() {
    let imu = imu();
    let text = imu.text(Consumer::Gz, RATE);
    let stddev = numbers(&text, "<stddev>");
    let bias = numbers(&text, "<dynamic_bias_stddev>");
    let tau = numbers(&text, "<dynamic_bias_correlation_time>");
    assert_eq!([stddev.len(), bias.len(), tau.len()], [6; 3]);
    for (k, axis) in imu.gyro.iter().chain(&imu.acc).enumerate() {
        let dt = 1.0 / RATE;
        let step = Step {
            white: stddev[k],
            walk: (-bias[k] * bias[k] * tau[k] / 2.0 * (-2.0 * dt / tau[k]).exp_m1()).sqrt(),
            keeps: (-dt / tau[k]).exp(),
        };
        same(step, axis, &axis.name);
    }
}

/// gnss-ins-sim: white = arw / sqrt(dt); bias = (1 - dt/tau) bias + drift sqrt(1 - exp(-2 dt/tau)) w, after arw * pi/180/60 and
/// b_stability * pi/180/3600.
#[test]
fn gnss_ins_sim_simulates_what_was_measured() {
    let imu = imu();
    let text = imu.text(Consumer::GnssInsSim, RATE);
    let of = |key: &str| numbers(&text, &format!("'{key}': np.array(["))[0];
    let deg = std::f64::consts::PI / 180.0;
    let dt = 1.0 / RATE;
    for (name, noise, axis, to_n, to_b) in [
        ("gyro", "arw", &imu.gyro[0], deg / 60.0, deg / 3600.0),
        ("accel", "vrw", &imu.acc[0], 1.0 / 60.0, 1.0),
    ] {
        let tau = of(&format!("{name}_b_corr"));
        let drift = of(&format!("{name}_b_stability")) * to_b;
        let step = Step {
            white: of(&format!("{name}_{noise}")) * to_n / dt.sqrt(),
            walk: drift * (1.0 - (-2.0 * dt / tau).exp()).sqrt(),
            keeps: 1.0 - dt / tau,
        };
        same(step, axis, name);
    }
}

#[test]
fn numbers_that_do_not_describe_the_record_say_so_to_every_consumer() {
    let folder = folder("export-remarks");
    let path = folder.join("swing.csv");
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
    let mut text = String::from("time,x\n");
    for i in 0..12_000 {
        let t = f64::from(i) * 0.05;
        let uniform = |_| rand_core::Rng::next_u64(&mut rng) as f64 / 2f64.powi(64);
        let e = (0..12).map(uniform).sum::<f64>() - 6.0;
        let swing = 0.2 * (t * std::f64::consts::TAU / 60.0).sin();
        text.push_str(&format!("{t:.2},{}\n", swing + 0.4 * e));
    }
    std::fs::write(&path, text).unwrap();
    for to in ["kalibr", "vins", "matlab", "gz", "gnss-ins-sim"] {
        let out = run(&[
            "export",
            path.to_str().unwrap(),
            "--columns",
            "time=time,gyro_x=x",
            "--units",
            "gyro=deg/s",
            "--to",
            to,
        ]);
        let said = String::from_utf8_lossy(&out.stdout).into_owned();
        assert!(said.contains("NOT TO BE RELIED ON, gyro_x"), "{to}: {said}");
    }
}

#[test]
fn a_rate_is_written_as_a_person_would() {
    let measured = ImuNoise {
        rate_hz: 20.000_000_000_001_03,
        ..imu()
    };
    for consumer in [
        Consumer::Kalibr,
        Consumer::Vins,
        Consumer::Matlab,
        Consumer::Gz,
    ] {
        let text = measured.text(consumer, measured.rate_hz);
        assert!(
            text.contains("20 ") || text.contains(" 20)") || text.contains(">20<"),
            "{text}"
        );
        assert!(!text.contains("20.0"), "{text}");
    }
}

#[test]
fn what_is_not_established_is_a_limit_for_a_filter_and_nothing_for_a_simulator() {
    let mut imu = imu();
    for axis in &mut imu.gyro {
        axis.walk = Figure::AtMost(2.0e-6);
    }
    let kalibr = imu.text(Consumer::Kalibr, RATE);
    close(yaml(&kalibr)["gyroscope_random_walk"], 2.0e-6, "limit");
    assert!(kalibr.contains("not established"));
    let matlab = imu.text(Consumer::Matlab, RATE);
    assert_eq!(numbers(&matlab, "'RandomWalk', [")[0], 0.0);
    assert!(matlab.contains("95 % limit 2.0"));
    assert_eq!(
        numbers(&imu.text(Consumer::Gz, RATE), "<dynamic_bias_stddev>").len(),
        3
    );
    imu.acc.clear();
    assert!(
        imu.text(Consumer::Kalibr, RATE)
            .contains("no accelerometer in the record")
    );
}

/// The whole way: a capture is analyzed, exported, simulated as Gazebo does it, captured and analyzed again.
#[test]
fn a_simulator_fed_with_the_export_gives_a_record_with_the_same_noise() {
    let folder = folder("export_loop");
    let path = |name: &str| folder.join(name).display().to_string();
    let (capture, analysis, sdf) = (path("c.csv"), path("a.json"), path("imu.sdf"));
    let (again, after) = (path("again.csv"), path("after.json"));
    for arguments in [
        vec![
            "simulate",
            "--seconds",
            "3600",
            "--seed",
            "3",
            "--out",
            &capture,
        ],
        vec!["analyze", &capture, "--json", &analysis],
        vec!["export", &analysis, "--out", &sdf, "--at-rate", "50"],
    ] {
        let done = run(&arguments);
        assert_eq!(done.status.code(), Some(0), "{}", said(&done));
    }
    let text = std::fs::read_to_string(&sdf).unwrap();
    let stddev = numbers(&text, "<stddev>");
    let mut random = Xoshiro256PlusPlus::seed_from_u64(11);
    let mut out = String::from("time,gx\n");
    for k in 0..180_000 {
        let rate = stddev[0] * bench::standard_normal(&mut random);
        out += &format!("{},{rate}\n", f64::from(k) / RATE);
    }
    std::fs::write(&again, out).unwrap();
    let done = run(&[
        "analyze",
        &again,
        "--columns",
        "time=time,gyro_x=gx",
        "--units",
        "gyro=rad/s",
        "--json",
        &after,
    ]);
    assert_eq!(done.status.code(), Some(0), "{}", said(&done));
    let n = |file: &str| {
        json(Path::new(file))["channels"]["gyro_x"]["parameters"]["angle_random_walk"]["value"]
            .as_f64()
            .unwrap()
    };
    // 180000 samples know N to 0.17 %; six of those.
    assert!(
        (n(&after) / n(&analysis) - 1.0).abs() < 0.01,
        "{} {}",
        n(&after),
        n(&analysis)
    );
}

#[test]
fn data_come_back_from_npz_and_parquet_as_they_went_in() {
    use npyz::NpyFile;
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::Field;

    let folder = folder("export_data");
    let path = |name: &str| folder.join(name);
    let capture = path("c.csv");
    let text = |path: &Path| path.display().to_string();
    let (npz, parquet, csv) = (path("c.npz"), path("c.parquet"), path("d.csv"));
    let made = run(&[
        "simulate",
        "--seconds",
        "60",
        "--seed",
        "3",
        "--out",
        &text(&capture),
    ]);
    assert_eq!(made.status.code(), Some(0), "{}", said(&made));
    for out in [&npz, &parquet, &csv] {
        let done = run(&["export", &text(&capture), "--out", &text(out)]);
        assert_eq!(done.status.code(), Some(0), "{}", said(&done));
    }
    let record = read_capture(&capture, &ReadOptions::default())
        .unwrap()
        .record;
    let truth = &record.channel("gyro_y").unwrap().values;

    let mut archive = zip::ZipArchive::new(std::fs::File::open(&npz).unwrap()).unwrap();
    let array = NpyFile::new(archive.by_name("gyro_y.npy").unwrap()).unwrap();
    assert_eq!(&array.into_vec::<f64>().unwrap(), truth);
    let time = NpyFile::new(archive.by_name("time_s.npy").unwrap()).unwrap();
    let time = time.into_vec::<f64>().unwrap();
    assert!(
        time[0] == 0.0 && (time[20] - 1.0).abs() < 1e-9,
        "{:?}",
        &time[..21]
    );
    // An array as all others are: one text, of UTF-32.
    let mut about = Vec::new();
    (archive.by_name("about.json.npy").unwrap())
        .read_to_end(&mut about)
        .unwrap();
    let head = 10 + usize::from(u16::from_le_bytes([about[8], about[9]]));
    assert_eq!(head % 64, 0);
    let letters = about[head..].chunks(4).map(|letter| letter[0]).collect();
    let about: serde_json::Value =
        serde_json::from_str(&String::from_utf8(letters).unwrap()).unwrap();
    assert_eq!(about["unit of gyro_y"], "deg/s");

    let reader = SerializedFileReader::new(std::fs::File::open(&parquet).unwrap()).unwrap();
    let metadata = reader.metadata().file_metadata();
    let about = metadata.key_value_metadata().unwrap();
    assert!(
        about
            .iter()
            .any(|kv| kv.key == "unit of gyro_y" && kv.value.as_deref() == Some("deg/s"))
    );
    let column: Vec<f64> = reader
        .get_row_iter(None)
        .unwrap()
        .map(|row| {
            let row = row.unwrap();
            let cell = row.get_column_iter().find(|(name, _)| *name == "gyro_y");
            match cell.unwrap().1 {
                Field::Double(value) => *value,
                other => panic!("{other:?}"),
            }
        })
        .collect();
    assert_eq!(&column, truth);

    // The CSV is read again by its columns and units.
    let mapped = run(&[
        "analyze",
        &text(&csv),
        "--columns",
        "time=time_s,gyro_y=gyro_y",
        "--units",
        "gyro=deg/s",
    ]);
    assert_eq!(mapped.status.code(), Some(0), "{}", said(&mapped));
}

#[test]
fn what_cannot_be_exported_is_told() {
    let none = run(&["export", "no-such.csv", "--to", "kalibr"]);
    assert_eq!(none.status.code(), Some(1));
    assert!(said(&none).contains("no-such.csv"));
    let what = run(&["export", "c.csv"]);
    assert!(said(&what).contains("--to kalibr"), "{}", said(&what));
    let ending = run(&["export", "c.csv", "--out", "c.xyz"]);
    assert!(said(&ending).contains("does not say"), "{}", said(&ending));
}

#[test]
fn what_is_exported_is_read_again_and_gives_the_same_figures() {
    let folder = folder("export_again");
    let path = |name: &str| folder.join(name).display().to_string();
    let capture = path("c.csv");
    let made = run(&[
        "simulate",
        "--seconds",
        "120",
        "--seed",
        "9",
        "--out",
        &capture,
    ]);
    assert_eq!(made.status.code(), Some(0), "{}", said(&made));
    let figures = |file: &str| {
        let out = path("a.json");
        let done = run(&["analyze", file, "--json", &out, "--quiet"]);
        assert_eq!(done.status.code(), Some(0), "{file}: {}", said(&done));
        json(Path::new(&out))["channels"]["gyro_z"]["parameters"].clone()
    };
    let truth = figures(&capture);
    for (name, raw) in [
        ("c.npz", false),
        ("c.parquet", false),
        ("r.npz", true),
        ("r.parquet", true),
    ] {
        let out = path(name);
        let mut arguments = vec!["export", &capture, "--out", &out];
        arguments.extend(raw.then_some("--raw"));
        let done = run(&arguments);
        assert_eq!(done.status.code(), Some(0), "{name}: {}", said(&done));
        let again = figures(&out);
        let n =
            |figures: &serde_json::Value| figures["angle_random_walk"]["value"].as_f64().unwrap();
        assert!(
            (n(&again) / n(&truth) - 1.0).abs() < 1e-9,
            "{name}: {again} {truth}"
        );
    }
}
