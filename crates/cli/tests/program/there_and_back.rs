//! Causes of a model file, found in its simulation and simulated again from what was found.

use super::*;

#[test]
fn what_is_put_into_a_model_is_found_and_the_extended_model_simulates() {
    let folder = folder("loop");
    let [model, run_csv, out, found, again] =
        ["m.toml", "run.csv", "d.json", "found.toml", "again.csv"].map(|name| folder.join(name));
    // The paper's stand with a line of half the noise's standard deviation: d' is far above the detection limit.
    let made = run(&[
        "simulate",
        "--seconds",
        "60",
        "--out",
        folder.join("paper.csv").to_str().unwrap(),
    ]);
    assert!(made.status.success());
    let mut stand = model::file::ModelFile::paper();
    let effect = "[[effect]]\ncause = \"line\"\nchannels = [\"gyro_z\"]\nfrequency = { value = 3.7, unit = \"Hz\" }\n\
                  amplitude = { value = 0.2, unit = \"deg/s\" }\n";
    let text = format!("{}\n{effect}", stand.to_toml());
    stand = model::file::ModelFile::parse(&text).unwrap_or_else(|error| panic!("{error}\n{text}"));
    std::fs::write(&model, stand.to_toml()).unwrap();
    let simulate = |model: &Path, out: &Path| {
        run(&[
            "simulate",
            "--model",
            model.to_str().unwrap(),
            "--seed",
            "3",
            "--out",
            out.to_str().unwrap(),
        ])
    };
    assert!(simulate(&model, &run_csv).status.success());
    let made = run(&[
        "diagnose",
        run_csv.to_str().unwrap(),
        "--json",
        out.to_str().unwrap(),
        "--model-out",
        found.to_str().unwrap(),
    ]);
    assert_success(&made);
    let diagnosis = json(&out);
    assert_eq!(diagnosis["format"], "imu-stand-diagnosis/1");
    assert_eq!(diagnosis["verdict"], "extended", "{diagnosis}");
    let line = diagnosis["findings"]
        .as_array()
        .unwrap()
        .iter()
        .find(|f| f["cause"] == "line")
        .expect("a line");
    assert_eq!(line["channels"], serde_json::json!(["gyro_z"]));
    let frequency = line["parameters"]["frequency"]["value"].as_f64().unwrap();
    assert!((frequency - 3.7).abs() < 0.002, "{frequency}");
    assert!(
        simulate(&found, &again).status.success(),
        "the extended model is a simulator"
    );
}

#[test]
fn a_cause_that_needs_excitation_comes_back_from_the_fitted_model() {
    let folder = folder("there-and-back");
    let text = format!(
        "{}\n[[effect]]\ncause = \"temperature\"\nchannels = [\"gyro_y\"]\n\
         slope = {{ value = -0.13, unit = \"deg/s/degC\" }}\n",
        model::file::ModelFile::paper().to_toml()
    );
    let still = folder.join("still.toml");
    std::fs::write(&still, &text).unwrap();
    let warmed = folder.join("warmed.toml");
    let excitation = "\n[excitation]\nself_heating_degc = 8.0\n\n[[channel]]";
    std::fs::write(&warmed, text.replacen("\n[[channel]]", excitation, 1)).unwrap();
    let simulate = |model: &Path, out: &str, seed: &str| {
        let made = run(&[
            "simulate",
            "--model",
            model.to_str().unwrap(),
            "--seed",
            seed,
            "--out",
            folder.join(out).to_str().unwrap(),
        ]);
        assert!(made.status.success());
        String::from_utf8_lossy(&made.stderr).into_owned()
    };
    let warning = simulate(&still, "still.csv", "1");
    assert!(warning.contains("temperature will not show"), "{warning}");
    assert_eq!(simulate(&warmed, "first.csv", "2"), "");
    let fitted = folder.join("fitted.toml");
    for (capture, seed) in [("first.csv", "3"), ("second.csv", "4")] {
        let answer = folder.join("d.json");
        let made = run(&[
            "diagnose",
            folder.join(capture).to_str().unwrap(),
            "--quiet",
            "--json",
            answer.to_str().unwrap(),
            "--model-out",
            fitted.to_str().unwrap(),
        ]);
        assert!(made.status.success());
        let diagnosis = json(&answer);
        assert_eq!(
            diagnosis["findings"][0]["cause"], "temperature",
            "{capture}: {diagnosis}"
        );
        assert_eq!(simulate(&fitted, "second.csv", seed), "");
    }
}
