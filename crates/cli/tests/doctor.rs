//! What a program brings for a computer and its shell: `doctor`, `completions`, `man`.

mod common;

use common::{assert_success, folder, json, program, run};

#[test]
fn the_doctor_names_each_thing_with_what_needs_it_and_what_to_do() {
    let folder = folder("doctor");
    let out = folder.join("d.json");
    // Nothing is to be found here.
    let output = program(&["doctor", "--json"])
        .arg(&out)
        .current_dir(&folder)
        .env("PATH", &folder)
        .env("IMU_STAND_CHROMIUM", folder.join("none"))
        .output()
        .expect("the program starts");
    let said = assert_success(&output);
    for what in ["serial ports", "avrdude", "image", "toolchain", "Chromium"] {
        assert!(said.contains(what), "{what}: {said}");
    }
    let answer = json(&out);
    assert_eq!(answer["format"], "imu-stand-doctor/1");
    for found in answer["found"].as_array().expect("a list") {
        let (is_there, help) = (found["is_there"] == true, found["help"].is_string());
        assert!(is_there != help, "{found}");
    }
    let missing = |what: &str| {
        let all = answer["found"].as_array().expect("a list").iter();
        all.filter(|f| f["what"] == what && f["is_there"] == false)
            .count()
    };
    for what in ["avrdude", "toolchain", "Chromium", "the firmware's image"] {
        assert_eq!(missing(what), 1, "{what} is not in an empty folder");
    }
}

#[test]
fn shells_and_man_get_every_command() {
    let folder = folder("shells");
    let out = folder.join("man");
    assert_success(&run(&["man", "--out", out.to_str().expect("UTF-8")]));
    let page = |name: &str| std::fs::read_to_string(out.join(name)).expect("a page");
    for command in ["analyze", "diagnose", "report", "run", "board", "doctor"] {
        assert!(page("imu-stand.1").contains(command), "{command}");
        assert!(
            page(&format!("imu-stand-{command}.1")).contains(".TH"),
            "{command}"
        );
        for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
            let output = run(&["completions", shell]);
            let text = String::from_utf8_lossy(&output.stdout).into_owned();
            assert!(
                output.status.success() && text.contains(command),
                "{shell} {command}"
            );
        }
    }
    assert!(page("imu-stand-report.1").contains("pdf"));
}
