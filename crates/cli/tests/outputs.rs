//! What a command writes goes over nothing that it reads, and over nothing that was measured.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

fn run(folder: &Path, line: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_imu-stand"))
        .args(line.split_whitespace())
        .current_dir(folder)
        .output()
        .expect("the program starts")
}

/// A folder with `run.csv`, simulated, and `board.csv`, the same as a board would have delivered it.
fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("outputs-{name}"));
    let _ = std::fs::remove_dir_all(&path);
    std::fs::create_dir_all(&path).expect("a folder for the test");
    assert!(
        run(&path, "simulate --seconds 60 --out run.csv")
            .status
            .success()
    );
    let text = std::fs::read_to_string(path.join("run.csv")).expect("the run");
    let recorded = text.replacen("# rate_hz", "# start_unix_s: 1763712345.1\n# rate_hz", 1);
    std::fs::write(path.join("board.csv"), recorded).expect("the other run");
    path
}

#[test]
fn an_output_never_goes_over_an_input_or_over_what_was_measured() {
    let folder = folder("kept");
    let text = std::fs::read_to_string(folder.join("run.csv")).expect("the run");
    let converted = text.replacen("# simulated: imu-stand simulate\n", "", 1);
    assert_ne!(converted, text, "{text:.400}");
    for (name, text) in [
        ("m.toml", "rate_hz = 20\n"),
        ("run.raw", "bytes"),
        ("converted.csv", &converted),
    ] {
        std::fs::write(folder.join(name), text).expect("a file");
    }
    #[cfg(unix)]
    std::os::unix::fs::symlink("run.csv", folder.join("link")).expect("a link");
    let before = contents(&folder);
    let lines = [
        "analyze run.csv --json run.csv",
        "analyze run.csv --json ./run.csv",
        "analyze run.csv --json board.csv",
        "diagnose run.csv --json run.csv",
        "diagnose run.csv --report run.csv",
        "diagnose run.csv --model-out run.csv",
        "diagnose run.csv --json a.json --report a.json",
        "diagnose run.csv board.csv --json board.csv",
        "report run.csv --out run.csv",
        "representative run.csv run.csv run.csv run.csv --json run.csv",
        "plan run.csv --want K --json run.csv",
        "paper --capture run.csv --json run.csv",
        "simulate --out board.csv",
        "simulate --out converted.csv",
        "simulate --out m.toml",
        "simulate --model m.toml --out m.toml",
        "run --native --seconds 60 --out board.csv",
        "run --native --seconds 60 --out n.csv --json board.csv",
        "export run.csv --out run.csv",
        "export run.csv --out board.csv",
        "export run.csv --to kalibr --out run.csv",
        "analyze board.csv --json run.raw",
        "analyze run.csv --json - --json no-folder/a.json",
        #[cfg(unix)]
        "analyze run.csv --json link",
    ];
    for line in lines {
        let refused = run(&folder, line);
        let said = String::from_utf8_lossy(&refused.stderr);
        assert!(matches!(refused.status.code(), Some(1 | 2)), "{line}");
        assert!(said.contains("--"), "{line}: {said}");
        assert!(before == contents(&folder), "{line}");
    }
    // A simulated run goes over another one, and JSON over JSON.
    for _ in 0..2 {
        assert!(
            run(&folder, "simulate --seconds 60 --out run.csv")
                .status
                .success()
        );
        assert!(
            run(&folder, "analyze run.csv --json a.json")
                .status
                .success()
        );
    }
}

/// Names and bytes of all files.
fn contents(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut files: Vec<_> = std::fs::read_dir(folder)
        .expect("the folder")
        .map(|entry| entry.expect("an entry").path())
        .map(|path| (path.clone(), std::fs::read(path).expect("a file")))
        .collect();
    files.sort();
    files
}

#[test]
fn a_dash_is_standard_input_and_output_and_nothing_else_is_said_there() {
    let folder = folder("dash");
    let child = Command::new(env!("CARGO_BIN_EXE_imu-stand"))
        .args(["diagnose", "-", "--json", "-"])
        .current_dir(&folder)
        .stdin(std::fs::File::open(folder.join("run.csv")).expect("the run"))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .output()
        .expect("the program runs");
    let found: serde_json::Value = serde_json::from_slice(&child.stdout).expect("JSON alone");
    assert_eq!(found["format"], "imu-stand-diagnosis/1");
    assert!(String::from_utf8_lossy(&child.stderr).contains("verdict"));
    assert!(!folder.join("-").exists());

    // The digest is that of the bytes, however they came.
    let models = [("-", "a.toml"), ("run.csv", "b.toml")].map(|(capture, model)| {
        let made = Command::new(env!("CARGO_BIN_EXE_imu-stand"))
            .args(["diagnose", capture, "--quiet", "--model-out", model])
            .current_dir(&folder)
            .stdin(std::fs::File::open(folder.join("run.csv")).expect("the run"))
            .status();
        assert!(made.expect("the program runs").success());
        std::fs::read_to_string(folder.join(model)).expect("the model")
    });
    let digests = models.map(|text| {
        let at = text.find("sha256:").expect("a digest");
        text[at..at + 71].to_owned()
    });
    assert_eq!(digests[0], digests[1]);

    // The same run as a file and as a stream, and as data for another program.
    let simulated = run(&folder, "simulate --seconds 60 --out -");
    let file = std::fs::read(folder.join("run.csv")).expect("the run");
    assert!(simulated.stdout == file);
    let exported = run(&folder, "export run.csv --to csv --out -");
    assert!(String::from_utf8_lossy(&exported.stdout).contains("time_s,seq"));
    let twice = run(&folder, "diagnose run.csv --json - --report -");
    assert_eq!(twice.status.code(), Some(2));
}

#[test]
fn a_capture_is_not_written_to_a_name_that_promises_another_form() {
    let folder = folder("named");
    for line in [
        "simulate --seconds 60 --out s.npz",
        "simulate --seconds 60 --out s.Parquet",
        "run --native --seconds 60 --out r.h5",
        "capture --port none --out c.parquet",
    ] {
        let output = run(&folder, line);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{line}: {said}");
        assert!(
            said.contains("a capture is CSV") && said.contains("imu-stand export"),
            "{line}: {said}"
        );
        let name = line.rsplit(' ').next().expect("a name");
        assert!(!folder.join(name).exists(), "{line}");
    }
}

#[test]
fn a_folder_that_is_not_there_is_named_before_anything_is_done() {
    let folder = folder("nowhere");
    for line in [
        "capture --port none --out data/run.csv.gz --rotate 24h",
        "simulate --seconds 60 --out data/run.csv",
        "diagnose run.csv --json data/d.json",
    ] {
        let output = run(&folder, line);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{line}: {said}");
        assert!(
            said.contains("data is no folder") && said.contains("make it first"),
            "{line}: {said}"
        );
    }
}

#[test]
fn a_reader_that_has_had_enough_costs_no_file() {
    let folder = folder("enough");
    let lines = [
        "plan --separate temperature,rate_ramp --json out.json",
        "analyze run.csv --json out.json",
    ];
    for line in lines {
        let mut child = Command::new(env!("CARGO_BIN_EXE_imu-stand"))
            .args(line.split_whitespace())
            .current_dir(&folder)
            .stdout(Stdio::piped())
            .spawn()
            .expect("the program starts");
        drop(child.stdout.take());
        assert!(child.wait().expect("it ends").success(), "{line}");
        let written = std::fs::read_to_string(folder.join("out.json")).expect(line);
        assert!(written.trim_end().ends_with('}'), "{line}");
        std::fs::remove_file(folder.join("out.json")).expect("a file");
    }
}

#[test]
fn a_report_is_not_written_under_a_name_that_lies() {
    let folder = folder("lies");
    for (line, help) in [
        ("report run.csv --out r.pdf", "--pdf report.pdf"),
        ("report run.csv --out r.txt", "--details"),
        ("diagnose run.csv --report r.PDF", "--pdf report.pdf"),
        ("report run.csv --pdf r.html", "name it .pdf"),
    ] {
        let output = run(&folder, line);
        let said = String::from_utf8_lossy(&output.stderr).replace('\n', " ");
        assert_eq!(output.status.code(), Some(2), "{line}: {said}");
        assert!(
            said.contains(help) && said.contains("what its name says"),
            "{line}: {said}"
        );
    }
    for name in ["r.pdf", "r.txt", "r.PDF", "r.html"] {
        assert!(!folder.join(name).exists(), "{name}");
    }
}

#[test]
fn what_holds_no_sample_leaves_nothing_behind() {
    let folder = folder("replay");
    let output = run(&folder, "capture --replay run.csv --out q.csv");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(
        said.contains("holds no sample") && said.contains("name the .raw file"),
        "{said}"
    );
    assert!(!folder.join("q.csv").exists());
}

#[test]
fn a_capture_in_place_of_a_model_is_told_as_such() {
    let folder = folder("model");
    for line in [
        "simulate --model run.csv --out x.csv",
        "plan --model run.csv --separate temperature,rate_ramp",
        "run --native --model run.csv --out x.csv",
    ] {
        let output = run(&folder, line);
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(
            said.contains("is no model file") && said.contains("--model-out"),
            "{line}: {said}"
        );
    }
}
