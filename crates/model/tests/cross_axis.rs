//! A share of another gyro's motion is one of what that gyro reads, with the error of its scale.

use model::ModelFile;
use model::simulate::simulate;

/// The mean of a channel under a turn of 20 deg/s about z.
fn mean(effects: &str, name: &str) -> f64 {
    let channel = |name: &str| {
        format!(
            "[[channel]]\nname = \"{name}\"\nunit = \"deg/s\"\nlsb = 1e-4\n\
             angle_random_walk = {{ value = 0.01, unit = \"deg/sqrt(h)\" }}\n"
        )
    };
    let text = format!(
        "format = \"imu-stand-model/1\"\nstand = \"made\"\nrate_hz = 20.0\n\n[excitation]\nturn_dps = 20.0\n\n{}{}{effects}",
        channel("gyro_x"),
        channel("gyro_z")
    );
    let model = ModelFile::parse(&text).expect("a model");
    let record = simulate(&model, 60.0, 20.0, 1).expect("a record");
    let values = &record.channel(name).expect(name).values;
    values.iter().map(|v| v.abs()).sum::<f64>() / values.len() as f64
}

#[test]
fn a_share_is_one_of_the_reading() {
    let cross = "[[effect]]\ncause = \"cross_axis\"\nchannels = [\"gyro_x\"]\nfrom_gyro_z = { value = 0.05, unit = \"1\" }\n";
    let scale = "[[effect]]\ncause = \"scale_error\"\nchannels = [\"gyro_z\"]\nrelative = { value = 0.2, unit = \"1\" }\n";
    for effects in [
        cross.to_owned(),
        format!("{cross}{scale}"),
        format!("{scale}{cross}"),
    ] {
        let share = mean(&effects, "gyro_x") / mean(&effects, "gyro_z");
        assert!((share / 0.05 - 1.0).abs() < 1e-3, "{share}: {effects}");
    }
}
