//! What the page asks the engine, without a browser.

use imu_stand_web::Session;
use serde_json::{Value, json};

fn asked(session: &mut Session, file: &[u8], request: &Value) -> Value {
    serde_json::from_str(&session.answer(file, &request.to_string())).expect("JSON")
}

/// A simulated capture.
fn capture() -> Vec<u8> {
    let record = model::simulate(&model::ModelFile::paper(), 60.0, 20.0, 1).expect("a record");
    let mut out = Vec::new();
    imu_stand::capture::write_to(&mut out, &record).expect("a capture");
    out
}

#[test]
fn a_capture_is_read_analyzed_diagnosed_and_reported() {
    let (file, mut session) = (capture(), Session::default());
    let read = asked(
        &mut session,
        &file,
        &json!({"do": "read", "name": "run.csv"}),
    );
    assert_eq!(read["ok"]["samples"], 1200);
    let analysis = asked(&mut session, &file, &json!({"do": "analyze"}));
    assert!(
        analysis["ok"]["json"]
            .as_str()
            .expect("text")
            .contains("imu-stand-analysis/1")
    );
    let diagnosis = asked(&mut session, &file, &json!({"do": "diagnose"}));
    let text = diagnosis["ok"]["text"].as_str().expect("text");
    assert!(text.contains("verdict"), "{text}");
    let model = diagnosis["ok"]["model"].as_str().expect("a model");
    assert!(model.contains("sha256:"), "{model}");
    let report = asked(&mut session, &file, &json!({"do": "report"}));
    let page = report["ok"]["html"].as_str().expect("a page");
    assert!(page.contains("imu-stand diagnose run.csv --report report.html"));
}

#[test]
fn a_foreign_table_is_proposed_a_mapping_that_reads_it() {
    let (file, mut session) = (b"t [s],roll rate,q\n0,1,2\n0.05,2,3\n", Session::default());
    let request = json!({"do": "read", "name": "their.csv"});
    let failed = asked(&mut session, file, &request);
    let proposal = &failed["failed"]["proposal"];
    assert!(proposal[0].is_string(), "{failed}");
    let request = json!({"do": "read", "name": "their.csv", "columns": "time=1,gyro_x=roll rate", "units": "gyro=deg/s"});
    let read = asked(&mut session, file, &request);
    assert_eq!(read["ok"]["channels"][0], "gyro_x", "{read}");
}

#[test]
fn a_file_with_two_sample_rates_is_read_in_parts() {
    let rows = (0..400).map(|k| (f64::from(k) * 0.05, k));
    let faster = (1..400).map(|k| (20.0 + f64::from(k) * 0.01, k));
    let mut file = "time_s,gyro_x_dps\n".to_owned();
    for (t, k) in rows.chain(faster) {
        file += &format!("{t:.3},{}\n", f64::from(k * 7919 % 101) / 100.0);
    }
    let mut session = Session::default();
    let mut read = |span: &str| {
        let request = json!({"do": "read", "name": "two.csv", "span": span});
        asked(&mut session, file.as_bytes(), &request)
    };
    let failed = read("");
    let first = failed["failed"]["span"]
        .as_str()
        .expect("a span")
        .to_owned();
    for (span, samples) in [(first.as_str(), 400), ("20,", 399)] {
        let part = read(span);
        let near = part["ok"]["samples"]
            .as_i64()
            .is_some_and(|n| (n - samples).abs() <= 1);
        assert!(near, "{span}: {part}");
    }
    let refused = read("9,3");
    assert!(
        refused["failed"]["what"]
            .as_str()
            .is_some_and(|what| what.contains("--span")),
        "{refused}"
    );
}

#[test]
fn what_cannot_be_done_is_said() {
    let mut session = Session::default();
    for request in [
        json!({"do": "report"}),
        json!({"do": "sing"}),
        json!({"do": "read", "name": "empty.csv"}),
    ] {
        let answer = asked(&mut session, b"", &request);
        assert!(answer["failed"]["what"].is_string(), "{answer}");
    }
}
