//! The simulated board as a serial device: what works on a board works on it.
#![cfg(unix)]

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};

struct Ended(Child);

impl Drop for Ended {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _gone = self.0.kill();
        let _status = self.0.wait();
    }
}

fn program() -> Command {
    Command::new(env!("CARGO_BIN_EXE_imu-stand"))
}

#[test]
fn capture_and_board_work_on_the_pseudo_terminal_in_real_time() {
    let mut child = program()
        .args([
            "run",
            "--native",
            "--pty",
            "--hide",
            "none",
            "--seconds",
            "60",
        ])
        .stdout(Stdio::piped())
        .spawn()
        .expect("it starts");
    let output = child.stdout.take().expect("piped");
    let _ended = Ended(child);
    // Kept open to the end: a program whose reader has gone ends.
    let mut lines = BufReader::new(output).lines();
    let line = lines.next().expect("it says where").expect("text");
    let port = line
        .split_whitespace()
        .find(|word| word.starts_with("/dev/"))
        .unwrap_or_else(|| panic!("no device in: {line}"))
        .to_owned();

    let folder = std::env::temp_dir().join(format!("imu-stand-pty-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let out = folder.join("c.csv");
    let made = program()
        .args([
            "capture",
            "--port",
            &port,
            "--seconds",
            "3",
            "--quiet",
            "--out",
        ])
        .arg(&out)
        .output()
        .expect("it runs");
    assert!(
        made.status.success(),
        "{}",
        String::from_utf8_lossy(&made.stderr)
    );
    let text = std::fs::read_to_string(&out).expect("a capture");
    let rows = text.lines().filter(|line| !line.starts_with('#')).count() - 1;
    // 3 s at 20 Hz, less what it takes to begin, longer on a busy computer.
    assert!((20..=62).contains(&rows), "{rows} samples in 3 s");

    let info = program()
        .args(["board", "--port", &port, "info"])
        .output()
        .expect("it runs");
    assert!(
        info.status.success(),
        "{}",
        String::from_utf8_lossy(&info.stderr)
    );
    assert!(String::from_utf8_lossy(&info.stdout).contains("power"));
    std::fs::remove_dir_all(&folder).expect("it is ours");
}
