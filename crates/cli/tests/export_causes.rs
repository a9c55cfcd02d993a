//! `imu-stand export` of a diagnosis and of a model: N and K after the causes, the causes where the consumer holds them,
//! written down again from what each consumer does with its numbers, and as comments elsewhere.

mod common;

use std::path::Path;

use common::{assert_misused, assert_refused, assert_success, folder, run};
use imu_stand::export::noise::{Consumer, Figure, ImuNoise};
use model::ModelFile;

const DEG: f64 = std::f64::consts::PI / 180.0;

/// Gyro x follows the temperature, gyro y has a process and no walk, gyro z a square of the temperature and flicker.
const MODEL: &str = r#"
format = "imu-stand-model/1"
stand = "the test's"
rate_hz = 20.0
[fitted_on]
file = "run.csv"
seconds = 600.0
[[channel]]
name = "gyro_x"
unit = "deg/s"
angle_random_walk = { value = 5.4, std_error = 0.03, unit = "deg/sqrt(h)" }
rate_random_walk = { value = 0.002, std_error = 0.0003, unit = "deg/s/sqrt(s)" }
[[channel]]
name = "gyro_y"
unit = "deg/s"
angle_random_walk = { value = 5.2, std_error = 0.03, unit = "deg/sqrt(h)" }
rate_random_walk = { value = 0.00001, std_error = 0.00032, unit = "deg/s/sqrt(s)" }
[[channel]]
name = "gyro_z"
unit = "deg/s"
angle_random_walk = { value = 5.3, std_error = 0.03, unit = "deg/sqrt(h)" }
rate_random_walk = { value = 0.001, std_error = 0.0001, unit = "deg/s/sqrt(s)" }
[[effect]]
cause = "temperature"
channels = ["gyro_x"]
slope = { value = 0.2, std_error = 0.01, unit = "deg/s/degC" }
[[effect]]
cause = "gauss_markov"
channels = ["gyro_y"]
sigma = { value = 0.05, std_error = 0.004, unit = "deg/s" }
correlation_time = { value = 12.5, std_error = 2.0, unit = "s" }
[[effect]]
cause = "temperature_quadratic"
channels = ["gyro_z"]
slope = { value = 0.1, unit = "deg/s/degC" }
curvature = { value = 0.01, unit = "deg/s/degC^2" }
reference = { value = 20.0, unit = "degC" }
[[effect]]
cause = "flicker"
channels = ["gyro_z"]
bias_instability = { value = 36.0, std_error = 2.0, unit = "deg/h" }
"#;

fn imu() -> ImuNoise {
    ImuNoise::of_model(&ModelFile::parse(MODEL).expect("a model"))
}

/// The numbers of a list after `before`.
fn list(text: &str, before: &str) -> Vec<f64> {
    let (_, rest) = text.split_once(before).expect(before);
    let inner = rest.split([']', ')']).next().expect("a list");
    let numbers = inner.split([' ', ',']).filter(|n| !n.is_empty());
    numbers.map(|n| n.parse().expect("a number")).collect()
}

/// The text of an element of each axis, `None` where an axis has none.
fn elements(text: &str, name: &str) -> Vec<Option<f64>> {
    let axes = text.split("<noise type=").skip(1);
    axes.map(|axis| {
        let (_, rest) = axis.split_once(&format!("<{name}>"))?;
        rest.split('<').next()?.parse().ok()
    })
    .collect()
}

fn close(a: f64, b: f64) {
    assert!((a / b - 1.0).abs() < 1e-5, "{a:e} is not {b:e}");
}

#[test]
fn noise_is_that_of_the_model_with_limits_where_it_is_not_established() {
    let imu = imu();
    assert_eq!((imu.seconds, imu.rate_hz), (600.0, 20.0));
    let Figure::Known(white) = imu.gyro[0].white else {
        panic!("N is known");
    };
    close(white, 5.4 * DEG / 60.0);
    let Figure::AtMost(walk) = imu.gyro[1].walk else {
        panic!("K of y is not established: {:?}", imu.gyro[1].walk);
    };
    close(walk, (1e-5 + 1.959_964 * 3.2e-4) * DEG);
    let Figure::Known(flicker) = imu.gyro[2].flicker else {
        panic!("B is known");
    };
    close(flicker, 36.0 / 3600.0 * DEG);
}

/// imuSensor adds (T - 25 degC) TemperatureBias to an axis, T its property Temperature.
#[test]
fn matlab_holds_the_temperature() {
    let text = imu().text(Consumer::Matlab, 100.0);
    let slopes = list(&text, "'TemperatureBias', [");
    close(slopes[0], 0.2 * DEG);
    assert_eq!(slopes[1..], [0.0, 0.0]);
    assert!(!text.contains("-0.0"), "{text}");
    assert!(
        text.contains(
            "gyro_x: temperature, slope 0.200 deg/s/degC (95 %: 0.180 to 0.220): in TemperatureBias"
        ),
        "{text}"
    );
    assert!(
        text.contains(
            "gyro_z: flicker, bias instability 36.0 deg/h (95 %: 32.1 to 39.9): in BiasInstability"
        ),
        "{text}"
    );
    let other = "curvature 0.01 deg/s/degC^2, reference 20 degC, slope 0.1 deg/s/degC: not in the numbers below";
    assert!(text.contains(other), "{text}");
}

/// A diagnosis may have accelerometers (`--channels`): their N and K are written, and what of a cause only says which law it is
/// is no size.
#[test]
fn accelerometers_of_a_model_are_written_with_its_gyros() {
    let acc = r#"
[[channel]]
name = "acc_x"
unit = "m/s^2"
angle_random_walk = { value = 0.09, std_error = 0.0006, unit = "m/s^2*sqrt(s)" }
bias = { value = 0.1, unit = "m/s^2" }
rate_random_walk = { value = 3e-4, std_error = 6e-4, unit = "m/s^2/sqrt(s)" }
[[effect]]
cause = "low_pass"
channels = ["acc_x"]
lag1_correlation = { value = 0.05, std_error = 0.009, unit = "1" }
triangular = { value = 1.0, unit = "1" }
"#;
    let imu = ImuNoise::of_model(&ModelFile::parse(&format!("{MODEL}{acc}")).expect("a model"));
    assert_eq!(imu.gyro.len(), 3);
    assert_eq!(imu.acc[0].white, Figure::Known(0.09));
    let text = imu.text(Consumer::Kalibr, 100.0);
    for line in [
        "accelerometer_noise_density: 9.000000e-2  # m/s^2/sqrt(Hz)",
        "accelerometer_random_walk: 1.475978e-3  # m/s^3/sqrt(Hz)",
        "#   acc_x: low_pass, lag1 correlation 0.050 (95 %: 0.032 to 0.068): not in the numbers below",
    ] {
        assert!(text.lines().any(|own| own == line), "{line}\n{text}");
    }
}

/// gz-sensors: the bias is a process of variance dynamic_bias_stddev^2 tau / 2.
#[test]
fn gazebo_and_gnss_ins_sim_hold_a_process_where_there_is_no_walk() {
    let text = imu().text(Consumer::Gz, 100.0);
    let density = elements(&text, "dynamic_bias_stddev");
    let tau = elements(&text, "dynamic_bias_correlation_time");
    close(tau[1].unwrap(), 12.5);
    close(density[1].unwrap() * (12.5f64 / 2.0).sqrt(), 0.05 * DEG);
    close(density[0].unwrap(), 0.002 * DEG);
    assert_eq!(tau[0], Some(6000.0));
    assert!(text.contains("correlation time 12.5 s (95 %: 8.6 to 16.4), sigma 0.0500 deg/s (95 %: 0.0422 to 0.0578): in dynamic_bias_stddev"), "{text}");
    assert!(
        !text.split("-->").next().unwrap()[4..].contains("--"),
        "{text}"
    );

    // gnss-ins-sim: standard deviation b_stability in deg/h, correlation time b_corr.
    let text = imu().text(Consumer::GnssInsSim, 100.0);
    let (sigma, tau) = (
        list(&text, "'gyro_b_stability': np.array(["),
        list(&text, "'gyro_b_corr': np.array(["),
    );
    close(sigma[1], 0.05 * 3600.0);
    close(tau[1], 12.5);
    close(sigma[0], 0.002 * (6000.0f64 / 2.0).sqrt() * 3600.0);
}

/// A K that the diagnosis calls too small to be told from 0 is no size: the process found stays, no simulator walks, and a filter
/// expects what a record of 600 s shows, sqrt(3) N / T.
#[test]
fn a_walk_too_small_to_be_told_leaves_the_process_to_the_consumers() {
    let none = r#"rate_random_walk = { value = 0.00006, unit = "deg/s/sqrt(s)" }"#;
    let with =
        r#"rate_random_walk = { value = 0.00001, std_error = 0.00032, unit = "deg/s/sqrt(s)" }"#;
    let text = MODEL.replace(with, none);
    let imu = ImuNoise::of_model(&ModelFile::parse(&text).expect("a model"));
    let Figure::Unseen(smallest) = imu.gyro[1].walk else {
        panic!("K of y is not told from 0: {:?}", imu.gyro[1].walk);
    };
    close(smallest, 3f64.sqrt() * 5.2 / 60.0 / 600.0 * DEG);
    let gz = imu.text(Consumer::Gz, 100.0);
    close(
        elements(&gz, "dynamic_bias_correlation_time")[1].unwrap(),
        12.5,
    );
    let dictionary = imu.text(Consumer::GnssInsSim, 100.0);
    close(list(&dictionary, "'gyro_b_corr': np.array([")[1], 12.5);
    for (text, parameter) in [
        (&gz, "dynamic_bias_stddev"),
        (&dictionary, "gyro_b_stability"),
    ] {
        let held = |l: &&str| l.contains("gauss_markov") && l.contains(&format!("in {parameter}"));
        assert_eq!(text.lines().filter(held).count(), 1, "{text}");
    }
    let matlab = imu.text(Consumer::Matlab, 100.0);
    assert_eq!(list(&matlab, "'RandomWalk', [")[1], 0.0);
    assert!(
        matlab.contains("gyro_y: too small to be told from 0"),
        "{matlab}"
    );
    let kalibr = imu.text(Consumer::Kalibr, 100.0);
    assert!(kalibr.contains(&format!(
        "walk {smallest:.6e} (too small to be told from 0; a record this long shows {smallest:.6e})"
    )));
    // By hand, of no record: as it is.
    let by_hand = text.replace("[fitted_on]\nfile = \"run.csv\"\nseconds = 600.0\n", "");
    let imu = ImuNoise::of_model(&ModelFile::parse(&by_hand).expect("a model"));
    assert_eq!(imu.gyro[1].walk, Figure::Known(0.00006 * DEG));
}

/// gnss-ins-sim keeps 1 - 1 / (f_s b_corr) of a bias at each step, of accelerometers that no record had too.
#[test]
fn a_sensor_that_is_missing_is_still_a_number_to_gnss_ins_sim() {
    let text = imu().text(Consumer::GnssInsSim, 100.0);
    let (kept, drift) = (
        list(&text, "'accel_b_corr': np.array(["),
        list(&text, "'accel_b_stability': np.array(["),
    );
    assert_eq!((kept.len(), drift), (3, vec![0.0; 3]));
    assert!(
        kept.iter()
            .all(|tau| (0.0..1.0).contains(&(1.0 - 0.01 / tau)))
    );
    for consumer in [Consumer::GnssInsSim, Consumer::Gz] {
        let text = imu().text(consumer, 100.0);
        assert!(text.contains("no accelerometer in the diagnosis"), "{text}");
        assert!(
            consumer != Consumer::Gz || !text.split("-->").next().unwrap()[4..].contains("--"),
            "{text}"
        );
    }
}

/// The limit of a flicker that was not found stands in the diagnosis; a model file has none.
#[test]
fn matlab_is_told_how_large_the_flicker_may_be() {
    let diagnosis = serde_json::json!({
        "format": "imu-stand-diagnosis/1",
        "input": {"file": "f", "seconds": 600.0, "rate_hz": 20.0, "samples": 12000, "channels": ["gyro_x"]},
        "baseline": {}, "checks": [], "findings": [], "unexplained": [], "not_tested": [], "verdict": "adequate",
        "extended": {"gyro_x": {"angle_random_walk": {"value": 5.0, "std_error": 0.03, "unit": "deg/sqrt(h)"}}},
        "detection_limits": [
            {"cause": "flicker", "channel": "gyro_x", "parameter": "bias_instability", "value": 169.0, "unit": "deg/h"}
        ]
    });
    let diagnosis = serde_json::from_value(diagnosis).expect("a diagnosis");
    let imu = ImuNoise::of_diagnosis(&diagnosis).expect("its noise");
    let text = imu.text(Consumer::Matlab, 100.0);
    let limit = format!(
        "gyro_x: not established by this record; 95 % limit {:.6e}",
        169.0 / 3600.0 * DEG
    );
    assert!(text.contains(&limit), "{text}");
    let model = self::imu().text(Consumer::Matlab, 100.0);
    assert!(
        model.contains("gyro_x: not in this file; `imu-stand diagnose --json` says"),
        "{model}"
    );
}

/// PX4: EKF2 adds (n dt)^2 to an angle's variance and (w dt)^2 to a bias's at each step (predictCovariance); the thermal
/// correction subtracts X0 + X1 d + X2 d^2 + X3 d^3 with d = T - TREF.
#[test]
fn px4_expects_the_noise_and_corrects_the_temperature() {
    let imu = imu();
    let text = imu.text(Consumer::Px4, 100.0);
    let value = |name: &str| -> f64 {
        let row = text
            .lines()
            .map(|line| line.split('\t').collect::<Vec<_>>());
        let row = row
            .into_iter()
            .find(|row| row.get(2) == Some(&name))
            .expect(name);
        assert_eq!((row.len(), row[0], row[1]), (5, "1", "1"));
        row[3].parse().expect("a number")
    };
    let dt: f64 = 0.01;
    let squares =
        |of: &dyn Fn(usize) -> f64| ((0..3).map(|k| of(k).powi(2)).sum::<f64>() / 3.0).sqrt();
    let n = squares(&|k| imu.gyro[k].white.expected().unwrap());
    let k = squares(&|k| imu.gyro[k].walk.expected().unwrap());
    close((value("EKF2_GYR_NOISE") * dt).powi(2), n * n * dt);
    close((value("EKF2_GYR_B_NOISE") * dt).powi(2), k * k * dt);
    assert!(
        text.contains(
            "# EKF2_ACC_NOISE, EKF2_ACC_B_NOISE: no accelerometer in the diagnosis or model;"
        ),
        "{text}"
    );
    assert_eq!(value("TC_G_ENABLE"), 1.0);
    // What is taken off between two temperatures is what the model's effects put on.
    let correction = |axis: usize, t: f64| {
        let d = t - value("TC_G0_TREF");
        let x = |power: usize| value(&format!("TC_G0_X{power}_{axis}"));
        x(0) + x(1) * d + x(2) * d * d + x(3) * d * d * d
    };
    let square = |t: f64| 0.1 * (t - 20.0) + 0.01 * (t - 20.0) * (t - 20.0);
    for (from, to) in [(10.0, 30.0), (20.0, 21.0), (45.0, 25.0)] {
        close(
            correction(0, to) - correction(0, from),
            0.2 * (to - from) * DEG,
        );
        close(
            correction(2, to) - correction(2, from),
            (square(to) - square(from)) * DEG,
        );
        assert_eq!(correction(1, to), 0.0);
    }
    let quiet = MODEL.split("[[effect]]").next().unwrap();
    let none = ImuNoise::of_model(&ModelFile::parse(quiet).unwrap()).text(Consumer::Px4, 100.0);
    assert!(
        !none.contains("TC_G") && none.contains("no cause was found"),
        "{none}"
    );
}

#[test]
fn a_filter_that_holds_no_cause_gets_them_as_comments_alone() {
    for consumer in [Consumer::Kalibr, Consumer::Vins] {
        let text = imu().text(consumer, 100.0);
        let told = text
            .lines()
            .filter(|line| line.ends_with("not in the numbers below"));
        assert_eq!(told.count(), 4, "{text}");
    }
}

/// Lines that are no comments: where two files come from one diagnosis, these are the same.
fn numbers(text: &str) -> Vec<&str> {
    text.lines()
        .filter(|line| !line.starts_with(['#', '%', ' ']))
        .collect()
}

/// The whole way, as the README goes it: a gyro that follows the temperature. The walk that `analyze` takes it for is not in
/// the numbers of its diagnosis, and both of its files say the same.
#[test]
fn the_export_of_a_diagnosis_is_without_what_the_temperature_does() {
    let folder = folder("export_causes");
    let path = |name: &str| folder.join(name).display().to_string();
    let (capture, json, model) = (path("run.csv"), path("diagnosis"), path("model.txt"));
    let hide = [
        "run", "--native", "--hide", "tempco", "--seed", "5", "--out", &capture,
    ];
    assert_success(&run(&hide));
    assert_success(&run(&[
        "diagnose",
        &capture,
        "--json",
        &json,
        "--model-out",
        &model,
    ]));
    let kalibr = |files: &[&str]| {
        let mut arguments = vec!["export", "--to", "kalibr"];
        arguments.extend(files);
        let done = run(&arguments);
        assert_success(&done);
        String::from_utf8(done.stdout).expect("text")
    };
    let walk = |text: &str| -> f64 {
        let line = text
            .lines()
            .find(|l| l.starts_with("gyroscope_random_walk"))
            .expect("a walk");
        line.split([' ', '#'])
            .nth(1)
            .expect("a number")
            .parse()
            .expect("a number")
    };
    // Recognised by what is in them: neither file has the ending of its kind.
    let (of_json, of_model, of_capture) =
        (kalibr(&[&json]), kalibr(&[&model]), kalibr(&[&capture]));
    assert_eq!(numbers(&of_json), numbers(&of_model));
    assert!(of_json.contains(": temperature"), "{of_json}");
    assert!(
        walk(&of_json) < 0.5 * walk(&of_capture),
        "{} {}",
        walk(&of_json),
        walk(&of_capture)
    );
    assert!(
        of_capture.contains("causes (temperature, supply, motor) may be in it"),
        "{of_capture}"
    );
    assert!(
        of_model
            .contains("no accelerometer in the diagnosis or model; `imu-stand diagnose --channels"),
        "{of_model}"
    );
    // The accelerometers come from a second file, in either order.
    for files in [[&model, &capture], [&capture, &model]] {
        let both = kalibr(&[files[0], files[1]]);
        assert!(
            both.contains("accelerometer_noise_density: ") && both.contains(": temperature"),
            "{both}"
        );
        assert_eq!(walk(&both), walk(&of_model));
    }
    let said = assert_success(&run(&["analyze", &capture]));
    assert!(said.contains("gyro_x: K or R is established"), "{said}");
    // What is to be said against the paper's figures is for those who ask.
    assert!(said.contains("--paper: ") && !said.contains("the record of 600 s supports"));
    let said = assert_success(&run(&["analyze", &capture, "--paper"]));
    assert!(said.contains("the record of 600 s supports"), "{said}");
    assert_refused(
        &run(&["export", &json, &model, "--to", "kalibr"]),
        &["two files of one kind"],
    );
    assert_misused(
        &run(&["export", &capture, &model, "--out", &path("x.npz")]),
        &["data are of one capture"],
    );
}

#[test]
fn json_that_is_neither_is_named() {
    let folder = folder("export_causes_wrong");
    let file = |name: &str, text: &str| {
        let path = folder.join(name);
        std::fs::write(&path, text).expect("a file");
        path.display().to_string()
    };
    let other = file(
        "a.json",
        "{\"format\":\"imu-stand-diagnoses/1\",\"runs\":[]}",
    );
    let old = r#"{"format":"imu-stand-diagnosis/1","input":{"file":"f","seconds":1,"rate_hz":20,"samples":20,"channels":[]},
        "baseline":{},"checks":[],"findings":[],"unexplained":[],"not_tested":[],"verdict":"adequate"}"#;
    let (old, torn) = (file("old.json", old), file("torn.json", "{\"format\":"));
    let wrong = file(
        "m.toml",
        "format = \"imu-stand-model/1\"\nrate_hz = 20.0\nspeed = 3\n",
    );
    for (path, needle) in [
        (&other, "the format is `imu-stand-diagnoses/1`"),
        (&old, "an older program wrote it"),
        (&torn, "is no JSON"),
        (&wrong, "line 3"),
    ] {
        assert_refused(&run(&["export", path, "--to", "kalibr"]), &[needle]);
    }
    assert!(Path::new(&other).exists());
}
