//! `imu-stand plan`: what it promises, its own simulation has to keep.

mod common;

use common::{folder, run};

#[test]
fn a_plan_for_each_term_and_for_an_angle_is_checked_by_simulation() {
    let folder = folder("plan");
    let model = folder.join("noise.toml");
    std::fs::write(
        &model,
        r#"format = "imu-stand-model/1"
stand = "all five terms"
rate_hz = 20.0

[[channel]]
name = "gyro_x"
unit = "deg/s"
lsb = 0.07326
bias = { value = 0.0, unit = "deg/s" }
angle_random_walk = { value = 3.4, unit = "deg/sqrt(h)" }
rate_random_walk = { value = 0.002, unit = "deg/s/sqrt(s)" }
quantization_noise = { value = 0.004, unit = "deg" }

[[effect]]
cause = "flicker"
bias_instability = { value = 57.6, unit = "deg/h" }

[[effect]]
cause = "rate_ramp"
slope = { value = 0.003, unit = "deg/s^2" }
"#,
    )
    .expect("a file");
    let json = folder.join("plan.json");
    let wishes = "N within 5 %, B within 50 %, K within 50 %, Q within 10 %, R within 20 %, angle within 5 deg after 60 s";
    let done = run(&[
        "plan",
        "--model",
        model.to_str().expect("a name"),
        "--want",
        wishes,
        "--check",
        "20",
        "--json",
        json.to_str().expect("a name"),
    ]);
    assert!(done.status.success(), "{done:?}");
    let plan: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(&json).expect("a plan")).expect("JSON");
    let want = plan["want"].as_array().expect("wishes");
    assert_eq!(want.len(), 5);
    for wanted in want.iter().chain(plan["angle"].as_array().expect("angles")) {
        // Longer records are tried until 90 % keep the promise.
        let share = wanted["checked_share"].as_f64().expect("a share");
        assert!(share >= 0.9, "{wanted}");
    }
    for wanted in want {
        let (planned, least) = (&wanted["seconds"], &wanted["fisher_seconds"]);
        assert!(planned.as_f64() >= least.as_f64(), "{wanted}");
    }
}
