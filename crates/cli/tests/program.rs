//! The program as a user runs it.

mod common;
#[path = "program/there_and_back.rs"]
mod there_and_back;

#[path = "program/times.rs"]
mod times;

#[path = "program/measured.rs"]
mod measured;

#[path = "program/usage.rs"]
mod usage;

use std::path::{Path, PathBuf};

use common::{assert_success, folder, json, run};

#[test]
fn wrong_usage_exits_2_and_a_missing_file_1_with_what_to_do() {
    assert_eq!(run(&["diagnose"]).status.code(), Some(2));
    assert_eq!(run(&["no-such-command"]).status.code(), Some(2));
    for line in [
        "analyze x.csv --taus foo",
        "analyze x.csv --deviations foo",
        "analyze x.csv --rate=0",
        "analyze x.csv --rate -3",
        "simulate --out x.csv --seconds=0",
        "simulate --out x.csv --rate nan",
    ] {
        let words: Vec<&str> = line.split(' ').collect();
        let wrong = run(&words);
        let said = String::from_utf8_lossy(&wrong.stderr);
        assert_eq!(wrong.status.code(), Some(2), "{line}");
        assert!(said.contains("has to be"), "{line}: {said}");
    }
    for (words, what) in [
        (vec!["plan"], "--separate <CAUSE,CAUSE>"),
        (vec!["plan", "--want", "Z within 20 %"], "K within 20 %"),
        (
            vec!["plan", "--separate", "temperature"],
            "is not two causes",
        ),
        (
            vec!["plan", "--separate", "temperature,foo"],
            "`foo` is no cause",
        ),
    ] {
        let wrong = run(&words);
        let said = String::from_utf8_lossy(&wrong.stderr);
        assert_eq!(wrong.status.code(), Some(2), "{words:?}");
        assert!(said.contains(what), "{words:?}: {said}");
    }
    let missing = run(&["analyze", "no-such-file.csv"]);
    assert_eq!(missing.status.code(), Some(1));
    let said = String::from_utf8_lossy(&missing.stderr);
    assert!(
        said.contains("no-such-file.csv") && said.contains("help"),
        "{said}"
    );
}

#[test]
fn a_series_without_a_gyro_a_dead_channel_and_noise_that_nobody_knows_are_told_what_to_do() {
    let folder = folder("told");
    let write = |name: &str, text: String| {
        let path = folder.join(name);
        std::fs::write(&path, text).expect("a file");
        path.to_str().expect("a name").to_owned()
    };
    let noise = |k: i32| (k * 7919 + k * k * 31) % 101 - 50;
    let series = write(
        "one.txt",
        (0..900).map(|k| format!("{}\n", noise(k))).collect(),
    );
    let dead = "# rate_hz: 20\ngyro_x\n".to_owned() + &"1\n".repeat(900);
    let dead = write("dead.csv", dead);
    let short = write("short.csv", "# rate_hz: 20\ngyro_x\n1\n3\n2\n".to_owned());
    for (line, expected) in [
        (
            vec!["diagnose", &series, "--rate", "20"],
            "--columns gyro_x=values --units gyro=deg/s",
        ),
        (
            vec!["analyze", &dead, "--units", "gyro=deg/s"],
            "supply and wiring",
        ),
        (
            vec!["export", &short, "--units", "gyro=deg/s", "--to", "kalibr"],
            "record for longer",
        ),
        (
            vec!["export", &short, "--units", "gyro=deg/s", "--to", "matlab"],
            "record for longer",
        ),
    ] {
        let told = run(&line);
        let said = String::from_utf8_lossy(&told.stderr);
        assert_eq!(told.status.code(), Some(1), "{line:?}: {said}");
        assert!(said.contains(expected), "{line:?}: {said}");
    }
}

#[test]
fn a_simulated_run_is_reproducible_and_its_analysis_has_the_contracts_shape() {
    let folder = folder("analysis");
    let [a, b, out] = ["a.csv", "b.csv.gz", "a.json"].map(|name| folder.join(name));
    for path in [&a, &b] {
        let made = run(&[
            "simulate",
            "--seconds",
            "120",
            "--seed",
            "7",
            "--out",
            path.to_str().unwrap(),
        ]);
        assert_success(&made);
    }
    let made = run(&[
        "analyze",
        a.to_str().unwrap(),
        "--json",
        out.to_str().unwrap(),
        "--quiet",
    ]);
    assert_success(&made);
    assert!(made.stdout.is_empty(), "--quiet prints nothing");
    let analysis = json(&out);
    assert_eq!(analysis["format"], "imu-stand-analysis/1");
    let gyro = &analysis["channels"]["gyro_z"];
    assert_eq!(gyro["unit"], "deg/s");
    for key in ["tau_s", "deviation", "low", "high", "edf", "n"] {
        assert!(gyro["deviations"]["oadev"][0][key].is_number(), "{key}");
    }
    for (term, unit) in [
        ("angle_random_walk", "deg/sqrt(h)"),
        ("bias_instability", "deg/h"),
        ("rate_random_walk", "deg/s/sqrt(s)"),
        ("rate_ramp", "deg/s^2"),
        ("quantization_noise", "deg"),
    ] {
        assert_eq!(gyro["parameters"][term]["unit"], unit, "{term}");
    }
    // The paper's stand: 5.27 deg/sqrt(h). 2400 samples know sigma to 1.4 %; six of those.
    let arw = gyro["parameters"]["angle_random_walk"]["value"]
        .as_f64()
        .unwrap();
    assert!((arw / 5.27 - 1.0).abs() < 0.09, "{arw}");
    // The same seed gives the same rows, compressed or not.
    let again = folder.join("b.json");
    assert!(
        run(&[
            "analyze",
            b.to_str().unwrap(),
            "--json",
            again.to_str().unwrap()
        ])
        .status
        .success()
    );
    assert_eq!(analysis["channels"], json(&again)["channels"]);
}

#[test]
fn a_model_file_with_an_unknown_effect_is_an_error_that_names_the_line() {
    let folder = folder("model");
    let path = folder.join("m.toml");
    let text = format!(
        "{}\n[[effect]]\ncause = \"gremlins\"\n",
        model::file::ModelFile::paper().to_toml()
    );
    std::fs::write(&path, &text).unwrap();
    let out = folder.join("c.csv");
    let made = run(&[
        "simulate",
        "--model",
        path.to_str().unwrap(),
        "--out",
        out.to_str().unwrap(),
    ]);
    assert_eq!(made.status.code(), Some(1));
    let said = String::from_utf8_lossy(&made.stderr);
    assert!(
        said.contains("line ") && said.contains("gremlins"),
        "{said}"
    );
    assert!(!out.exists());
}

#[test]
fn a_fault_hidden_in_the_stand_goes_through_the_boards_logic_and_is_named() {
    let folder = folder("run");
    let [out, found] = ["c.csv", "d.json"].map(|name| folder.join(name));
    let made = run(&["run", "--out", out.to_str().unwrap()]);
    assert_eq!(
        made.status.code(),
        Some(1),
        "without a simulated ATmega16 `run` says so"
    );
    let made = run(&[
        "run",
        "--native",
        "--hide",
        "motor-coupling",
        "--seed",
        "11",
        "--out",
        out.to_str().unwrap(),
        "--json",
        found.to_str().unwrap(),
    ]);
    assert_success(&made);
    let said = String::from_utf8_lossy(&made.stdout);
    let diagnosis = json(&found);
    let named = diagnosis["findings"]
        .as_array()
        .unwrap()
        .iter()
        .any(|finding| {
            finding["cause"] == "motor_bias"
                || finding["alternatives"]
                    .as_array()
                    .unwrap()
                    .iter()
                    .any(|rival| rival["cause"] == "motor_bias")
        });
    assert!(named, "{said}");
    let (_, compared) = said.split_once("planted and found").expect("it ends so");
    assert!(
        compared.contains("motor_bias on gyro_") && compared.contains(": planted "),
        "{said}"
    );
    assert!(!said.contains(" { "), "{said}");
}

#[test]
fn of_many_runs_the_one_that_is_noisier_is_not_the_representative_one() {
    let folder = folder("representative");
    let mut noisy = model::file::ModelFile::paper();
    for channel in &mut noisy.channels {
        // 2400 samples know sigma to 1.4 %; this is 35 times that.
        if let Some(parameter) = channel.baseline.get_mut("angle_random_walk") {
            parameter.value *= 1.5;
        }
    }
    let model = folder.join("noisy.toml");
    std::fs::write(&model, noisy.to_toml()).unwrap();
    // Of five runs a robust spread may be tiny by chance, and the limit is 26 of it; of eight it is about 10.
    let names = [
        "a.csv",
        "b.csv",
        "c.csv",
        "noisy.csv",
        "d.csv",
        "e.csv",
        "f.csv",
        "g.csv",
    ];
    let paths: Vec<String> = names
        .iter()
        .map(|name| folder.join(name).to_str().unwrap().to_owned())
        .collect();
    for (seed, path) in paths.iter().enumerate() {
        let seed = seed.to_string();
        let mut arguments = vec![
            "simulate",
            "--seconds",
            "120",
            "--seed",
            &seed,
            "--out",
            path,
        ];
        if path.ends_with("noisy.csv") {
            arguments.extend(["--model", model.to_str().unwrap()]);
        }
        assert!(run(&arguments).status.success());
    }
    let out = folder.join("r.json");
    let mut arguments = vec!["representative", "--json", out.to_str().unwrap()];
    arguments.extend(paths.iter().map(String::as_str));
    let made = run(&arguments);
    let said = String::from_utf8_lossy(&made.stdout);
    assert_success(&made);
    let answer = json(&out);
    assert_eq!(answer["files"][3], "noisy.csv");
    assert_ne!(answer["run"], 3, "{said}");
    let odd = answer["odd"].as_array().unwrap();
    assert!(
        odd.iter()
            .any(|odd| odd["run"] == 3 && odd["figure"] == "angle_random_walk"),
        "{said}"
    );

    let twice = run(&[
        "representative",
        &paths[0],
        &paths[1],
        &paths[2],
        &paths[3],
        &paths[1],
    ]);
    assert_eq!(twice.status.code(), Some(1));
    let why = String::from_utf8_lossy(&twice.stderr);
    assert!(why.contains("have the same readings"), "{why}");
    let few = run(&["representative", &paths[0], &paths[1]]);
    common::assert_misused(&few, &["4 runs", "name 4 captures"]);
}

#[test]
fn a_run_writes_over_its_own_captures_and_over_no_others() {
    let folder = folder("run_over");
    let out = folder.join("c.csv");
    let again = || {
        run(&[
            "run",
            "--native",
            "--seconds",
            "60",
            "--quiet",
            "--out",
            out.to_str().unwrap(),
        ])
    };
    assert!(again().status.success());
    let first = std::fs::read_to_string(&out).unwrap();
    assert!(again().status.success(), "the same run once more");
    // The same rows as a board's: with the time of day at which they were taken.
    let boards = first.replacen('\n', "\n# start_unix_s: 1763712345.123\n", 1);
    // One of a converter's, which has no time of day, and does not say that it was simulated.
    let converted = first.replacen("# simulated: imu-stand run\n", "", 1);
    assert_ne!(converted, first, "{first:.400}");
    for text in [boards.as_str(), converted.as_str(), "not a capture\n"] {
        std::fs::write(&out, text).unwrap();
        let refused = again();
        assert_eq!(refused.status.code(), Some(1));
        let said = String::from_utf8_lossy(&refused.stderr);
        assert!(said.contains("there already"), "{said}");
        assert_eq!(std::fs::read_to_string(&out).unwrap(), text, "as it was");
    }
    let nowhere = folder.join("no/c.csv");
    let refused = run(&["run", "--native", "--out", nowhere.to_str().unwrap()]);
    assert_eq!(refused.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("is no folder"));
}

#[test]
fn what_cannot_be_read_is_said_once_and_a_cut_file_by_its_name() {
    let folder = folder("unreadable");
    let missing = run(&["analyze", folder.join("no.csv").to_str().unwrap()]);
    let said = String::from_utf8_lossy(&missing.stderr);
    assert_eq!(said.matches("no.csv").count(), 1, "{said}");
    assert_eq!(said.matches("No such file").count(), 1, "{said}");
    let is_folder = run(&["analyze", folder.to_str().unwrap()]);
    let said = String::from_utf8_lossy(&is_folder.stderr);
    assert!(said.contains("name one of its captures"), "{said}");
    // What has nothing to read is not told to record for longer, nor planned by.
    let (none, few) = (folder.join("none.csv"), folder.join("few.csv"));
    std::fs::write(&none, format!("t,gx\n{}", "0,\n".repeat(700))).unwrap();
    std::fs::write(&few, "t,gx\n0,1\n1,3\n2,2\n").unwrap();
    let columns = "--columns gyro_x=gx --units gyro=deg/s --rate 20".split(' ');
    for (command, path, told) in [
        ("diagnose", &none, "map the columns"),
        ("plan", &few, "64 samples"),
    ] {
        let mut line = vec![command, path.to_str().unwrap()];
        line.extend(columns.clone());
        line.extend(
            ["--want", "K within 20 %"]
                .iter()
                .filter(|_| command == "plan"),
        );
        let refused = run(&line);
        let said = String::from_utf8_lossy(&refused.stderr);
        assert_eq!(refused.status.code(), Some(1), "{said}");
        assert!(said.contains(told), "{said}");
    }
    let (whole, cut) = (folder.join("w.csv.gz"), folder.join("cut.csv.gz"));
    let made = run(&[
        "run",
        "--native",
        "--seconds",
        "60",
        "--quiet",
        "--out",
        whole.to_str().unwrap(),
    ]);
    assert!(made.status.success());
    let bytes = std::fs::read(&whole).unwrap();
    std::fs::write(&cut, &bytes[..bytes.len() / 2]).unwrap();
    let refused = run(&["analyze", cut.to_str().unwrap()]);
    assert_eq!(refused.status.code(), Some(1));
    let said = String::from_utf8_lossy(&refused.stderr);
    assert!(
        said.contains("ends in the middle") && said.contains("zcat"),
        "{said}"
    );
}

#[test]
fn a_rate_that_was_worked_out_is_said_as_a_person_writes_it() {
    let folder = folder("rate");
    let out = folder.join("c.csv");
    let rate = "--rate=19.999999999999908";
    let out = out.to_str().unwrap();
    let made = run(&["simulate", "--seconds", "60", rate, "--out", out]);
    let said = String::from_utf8_lossy(&made.stdout);
    assert!(said.contains("1200 rows at 20 Hz, seed 1"), "{said}");
}

#[test]
fn a_model_file_without_a_channel_is_refused() {
    let folder = folder("no_channel");
    let model = folder.join("model.toml");
    let cut = "format = \"imu-stand-model/1\"\nstand = \"cut off\"\nrate_hz = 20.0\n";
    std::fs::write(&model, cut).expect("a file");
    let out = folder.join("run.csv");
    let [model, out] = [&model, &out].map(|path| path.to_str().expect("a name"));
    let refused = run(&[
        "simulate",
        "--model",
        model,
        "--seconds",
        "60",
        "--out",
        out,
    ]);
    common::assert_refused(&refused, &["model.toml", "no [[channel]]", "copied whole"]);
    assert!(!Path::new(out).exists());
}

#[test]
fn results_and_models_are_no_captures_and_a_capture_is_no_model() {
    let folder = folder("no_captures");
    let [run_csv, json, model] =
        ["run.csv", "analysis.json", "model.toml"].map(|name| folder.join(name));
    let [run_csv, json, model] =
        [&run_csv, &json, &model].map(|path| path.to_str().expect("a name"));
    assert_success(&run(&["simulate", "--seconds", "60", "--out", run_csv]));
    assert_success(&run(&["analyze", run_csv, "--json", json, "--quiet"]));
    std::fs::write(model, model::ModelFile::paper().to_toml()).expect("a file");
    for command in ["diagnose", "analyze"] {
        let said = common::assert_refused(&run(&[command, json]), &["a result of this program"]);
        assert!(said.contains("name the capture"), "{said}");
        common::assert_refused(
            &run(&[command, model]),
            &["a model file", "simulate --model"],
        );
    }
    let npz = folder.join("x.npz");
    let data = run(&["export", json, "--out", npz.to_str().expect("a name")]);
    common::assert_refused(&data, &["a result of this program"]);
    for other in [run_csv, json] {
        let refused = run(&["export", other, "--to", "board"]);
        common::assert_refused(&refused, &["is no model file", "--model-out"]);
    }
}
