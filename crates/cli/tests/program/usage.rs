//! Wrong usage of every command: exit code 2, with what to write instead, and nothing of it is tried.

use super::common::{assert_misused, folder};

#[test]
fn what_is_wrong_whatever_the_files_hold_and_whatever_is_connected_exits_2() {
    let folder = folder("usage");
    std::fs::write(folder.join("x.csv"), "# rate_hz: 20\ngyro_x\n1\n").expect("a file");
    for (line, told) in [
        ("export x.csv", "--out run.parquet"),
        ("export x.csv --out x.foo", "add `--to`"),
        ("export x.csv --to npz", "add `--out FILE`"),
        ("export x.csv --to npz --out -", "--to csv"),
        ("export x.csv x.csv --to csv --out y.csv", "one by one"),
        (
            "diagnose x.csv --units gyro=furlong",
            "`furlong` is no unit",
        ),
        ("diagnose x.csv --units gyro", "not of the form"),
        ("diagnose x.csv --columns x=1,x=2", "given twice"),
        ("diagnose x.csv y.csv --report r.html", "one by one"),
        ("diagnose x.csv --json - --report -", "name a file"),
        ("diagnose x.csv --json x.csv", "name another file"),
        ("analyze x.csv --channels ,", "--channels"),
        ("representative x.csv x.csv", "name 4 captures"),
        ("report x.csv --out r.html --pdf -", "--pdf report.pdf"),
        ("run --native --seconds 5", "--seconds 60"),
        ("run --native --seconds -5", "--seconds 60"),
        ("run --native --seconds nan", "--seconds 60"),
        ("run --native --pty --seconds 0", "--seconds 600"),
        ("run --native --out -", "--out run.csv"),
        ("run --native --out r.npz", "name it .csv"),
        ("run --native --port x", "--correct"),
        (
            "run --vcd t.vcd --vcd-span 70,80 --seconds 60",
            "ends at 80 s, and the run at 60 s",
        ),
        ("simulate --seconds 1e300 --out s.csv", "1e300 s at 20 Hz"),
        ("simulate --seconds 0.001 --out s.csv", "--seconds"),
        ("paper --out p --channel nix", "gyro_x, gyro_y, gyro_z"),
        ("plan --separate temperature,temperature", "one cause twice"),
        ("capture --port x --out a.raw", "--out run.csv"),
        ("capture --port x --out a.csv --seconds -1", "above 0"),
        ("capture --port x --out a.csv --baud 0", "--baud"),
        ("monitor --port x --seconds nan", "above 0"),
        ("board --port x set rate 0", "1 to 256 Hz"),
        ("board --port x set acc-range 3", "acc-range 1.5"),
        ("board --port x set gyro", "--range 160"),
        ("board --port x set gyro --range 100", "--range 320"),
        ("board --port x set scale x 0", "0.07326"),
        ("board --port x set bias x 1e300", "fixed point"),
        ("board --port x set baud 115200", "38400"),
        ("board --port x register read x nix", "register list"),
        ("board --port x register read x COMMAND", "only be written"),
        ("board --port x register write x GYRO_OUT 1", "only be read"),
        ("board --port x register write x ALM_MAG1 y", "0x0402"),
        ("board --port x motor", "--duty 100"),
    ] {
        let mut program = std::process::Command::new(env!("CARGO_BIN_EXE_imu-stand"));
        program.args(line.split(' ')).current_dir(&folder);
        let output = program.output().expect("the program runs");
        assert_misused(&output, &[told]);
    }
    let there = std::fs::read_dir(&folder).expect("the folder").count();
    assert_eq!(there, 1, "nothing was written");
}

#[test]
fn quiet_leaves_nothing_but_errors() {
    use std::fmt::Write as _;
    let folder = folder("quiet");
    let mut text = "t,gyro_x\n".to_owned();
    for k in 0..800 {
        let reading = match k {
            100 => "foo".to_owned(),
            200 => "NaN".to_owned(),
            k => format!("{}", (k * 7919 + k * k * 31) % 101 - 50),
        };
        let _ = writeln!(text, "{},{reading}", f64::from(k) / 20.0);
    }
    std::fs::write(folder.join("x.csv"), text).expect("a file");
    for line in [
        "analyze x.csv",
        "diagnose x.csv --no-replicates",
        "export x.csv --to csv --out e.csv",
        "plan x.csv --separate temperature,rate_ramp",
    ] {
        let said = |quiet: &[&str]| {
            let mut program = std::process::Command::new(env!("CARGO_BIN_EXE_imu-stand"));
            program.args(line.split(' ')).args(quiet);
            program.args(["--skip-bad", "--units", "gyro=deg/s"]);
            let output = program.current_dir(&folder).output();
            super::common::assert_success(&output.expect("the program runs"))
        };
        assert!(said(&[]).contains("left out"), "{line}");
        assert_eq!(said(&["--quiet"]), "", "{line}");
    }
}
