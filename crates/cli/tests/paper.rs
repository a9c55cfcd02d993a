//! `imu-stand paper` as a user runs it.

use std::path::Path;
use std::process::Command;

#[test]
fn the_papers_figures_are_drawn_and_their_contradiction_is_told() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("paper");
    let _ = std::fs::remove_dir_all(&folder);
    let output = Command::new(env!("CARGO_BIN_EXE_imu-stand"))
        .args(["paper", "--runs", "60", "--draws", "10", "--out"])
        .arg(&folder)
        .output()
        .expect("the program starts");
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{output:?}");
    assert!(said.contains("exclude each other"), "{said}");
    for figure in ["3", "4", "5", "8a", "8b"] {
        let svg = std::fs::read_to_string(folder.join(format!("figure-{figure}.svg"))).unwrap();
        assert!(svg.starts_with("<svg"), "figure {figure}");
    }
    assert!(folder.join("paper.html").exists());
    let text = std::fs::read_to_string(folder.join("paper.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(json["format"], "imu-stand-paper/1");
    // The stand was sized so that the procedure reads the stated numbers: its intervals hold them.
    for (name, stated) in [
        ("angle_random_walk", 5.27),
        ("in_run_bias_stability", 150.0),
    ] {
        let number = &json["two_numbers"][name];
        let (low, high) = (
            number["low"].as_f64().unwrap(),
            number["high"].as_f64().unwrap(),
        );
        assert!(low < stated && stated < high, "{name} {number}");
    }
    let hypotheses = json["hypotheses"].as_array().unwrap();
    assert_eq!(hypotheses.len(), 5);
    for h in hypotheses {
        let name = h["name"].as_str().unwrap();
        let adev = h["expected_adev_deg_h"].as_array().unwrap();
        if name.starts_with("white noise alone") {
            assert!((adev[2][1].as_f64().unwrap() - 100.0).abs() < 0.1, "{h}");
            assert_eq!(h["share_with_both"], 0.0, "{h}");
        }
        if name.contains("flicker") {
            // Flat means bent: no record of it has a line of slope -1/2.
            assert!(h["line_slope"]["low"].as_f64().unwrap() > -0.49, "{h}");
        }
    }
    let alike = &json["looks_alike"];
    let rms = alike["rms_ratio"]["median"].as_f64().unwrap();
    assert!((0.8..1.25).contains(&rms), "{alike}");
    assert!(alike["named"].as_f64().unwrap() >= 0.8, "{alike}");
}

#[test]
fn a_channel_that_is_no_gyro_is_refused_with_what_to_do() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("paper-refused");
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    let capture = folder.join("c.csv");
    std::fs::write(&capture, "time,ax\n0,1\n0.05,2\n0.1,1\n").unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_imu-stand"))
        .args(["paper", "--columns", "time=time,acc_x=ax", "--channel"])
        .args(["acc_x", "--capture"])
        .arg(&capture)
        .arg("--out")
        .arg(folder.join("out"))
        .output()
        .expect("the program starts");
    assert_eq!(output.status.code(), Some(1));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("no gyro") && said.contains("help"), "{said}");
}
