//! The way back: what was fitted on a run goes onto the parts of the bench, the firmware samples them, and the
//! diagnosis of that capture finds the same errors again.

use diagnosis::DiagnoseOptions;
use diagnosis::result::Diagnosed;
use imu_stand::stand::{Hidden, Sizes, plan, plan_fitted, run_native};
use model::file::ModelFile;
use model::record::Record;

fn diagnosed(record: &Record) -> Diagnosed {
    diagnosis::diagnose(record, &DiagnoseOptions::default()).expect("600 s are enough")
}

/// Value and standard error of a parameter of a cause on a channel.
fn found(of: &Diagnosed, cause: &str, channel: &str, name: &str) -> (f64, f64) {
    let finding = of
        .diagnosis
        .findings
        .iter()
        .find(|f| f.cause == cause && f.channels.iter().any(|c| c == channel))
        .unwrap_or_else(|| panic!("{cause} on {channel}: {:?}", of.diagnosis.findings));
    let p = &finding.parameters[name];
    (p.value, p.std_error.unwrap_or(f64::NAN))
}

/// Within four standard errors of both estimates together.
fn agree(a: (f64, f64), b: (f64, f64)) {
    let error = a.1.hypot(b.1);
    assert!((a.0 - b.0).abs() < 4.0 * error, "{a:?} {b:?}");
}

#[test]
fn the_firmware_meets_the_motor_that_was_fitted() {
    let (first, _) = run_native(
        &plan(Hidden::MotorCoupling, Sizes::Visible, 600.0, 9),
        |_| {},
    );
    let first = diagnosed(&first);
    let motor = first
        .diagnosis
        .findings
        .iter()
        .find(|f| f.cause == "motor_bias")
        .expect("the motor couples");
    let channel = motor.channels[0].clone();
    // What is carried is the file, not what is in memory.
    let file = first.extended_model.to_toml();
    let model = ModelFile::parse(&file).expect("what is written can be read");
    let (again, carried) = plan_fitted(&model, 600.0, 10).expect("the stand's gyros");
    assert_eq!(carried.not, Vec::<String>::new());
    let (second, _) = run_native(&again, |_| {});
    let second = diagnosed(&second);
    // Steps of the command do not tell the share that friction takes from what is proportional to it: together they do.
    let at_60_percent = |d: &Diagnosed| {
        let all = d
            .diagnosis
            .findings
            .iter()
            .find(|f| f.cause == "motor_bias");
        let p = &all.expect("the motor couples").parameters;
        0.6 * p["at_full_duty"].value + p.get("while_turning").map_or(0.0, |w| w.value)
    };
    let (a, b) = (at_60_percent(&first), at_60_percent(&second));
    assert!((a / b - 1.0).abs() < 0.05, "{a} {b}");
    let of = |d: &Diagnosed| found(d, "motor_bias", &channel, "surge_at_full_duty");
    agree(of(&first), of(&second));
    for (a, b) in first
        .extended_model
        .channels
        .iter()
        .zip(&second.extended_model.channels)
    {
        let of = |m: &model::file::ChannelModel| {
            let p = &m.baseline["angle_random_walk"];
            (p.value, p.std_error.unwrap_or(f64::NAN))
        };
        agree(of(a), of(b));
    }
}

#[test]
fn causes_stated_by_hand_are_found_on_the_stand_and_others_are_listed() {
    let mut text = ModelFile::paper().to_toml();
    text.push_str(
        r#"
[[effect]]
cause = "bias_step"
channels = ["gyro_x"]
time = { value = 260.0, unit = "s" }
height = { value = -0.6, unit = "deg/s" }

[[effect]]
cause = "line"
channels = ["gyro_y"]
frequency = { value = 3.7, unit = "Hz" }
amplitude = { value = 0.12, unit = "deg/s" }

[[effect]]
cause = "flicker"
channels = ["gyro_z"]
bias_instability = { value = 1.0, unit = "deg/h" }
"#,
    );
    let model = ModelFile::parse(&text).expect("a model file");
    let (plan, carried) = plan_fitted(&model, 600.0, 4).expect("the stand's gyros");
    assert!(carried.not.len() == 1 && carried.not[0].starts_with("flicker on gyro_z: "));
    let (record, _) = run_native(&plan, |_| {});
    let d = diagnosed(&record);
    for (cause, channel, name, truth) in [
        ("bias_step", "gyro_x", "height", -0.6),
        ("bias_step", "gyro_x", "time", 260.0),
        ("line", "gyro_y", "frequency", 3.7),
    ] {
        let estimate = found(&d, cause, channel, name);
        agree(estimate, (truth, 0.1 * estimate.1.max(1e-3)));
    }
}

#[test]
fn a_model_of_other_channels_or_units_is_refused() {
    let mut model = ModelFile::paper();
    model.channels[1].unit = "rad/s".into();
    let told = plan_fitted(&model, 600.0, 1)
        .map(|_| ())
        .unwrap_err()
        .to_string();
    assert!(told.contains("gyro_y in rad/s"), "{told}");
    model.channels.clear();
    let told = plan_fitted(&model, 600.0, 1)
        .map(|_| ())
        .unwrap_err()
        .to_string();
    assert!(told.contains("no channel gyro_x"), "{told}");
}
