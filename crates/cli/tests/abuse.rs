//! Files and arguments that are meant to hurt: each is refused in words, at once, and without the memory that it claims.

mod common;

use std::fmt::Write as _;
use std::fs::File;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use common::{assert_misused, assert_refused, assert_success, folder, run};

/// Longer, and a person has given up; a debug build on a shared machine needs a part of it.
const AT_MOST: Duration = Duration::from_secs(60);

fn write(folder: &Path, name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, bytes).expect("a file of the test's own");
    path
}

fn text(path: &Path) -> &str {
    path.to_str().expect("a name in UTF-8")
}

/// How NumPy writes the head of an array of that shape.
fn npy(shape: &str) -> Vec<u8> {
    let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}\n");
    raw_npy(&header)
}

fn raw_npy(header: &str) -> Vec<u8> {
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend(
        u16::try_from(header.len())
            .expect("a short header")
            .to_le_bytes(),
    );
    bytes.extend(header.as_bytes());
    bytes.extend([0; 80]);
    bytes
}

/// Both commands refuse the file for that reason, in time and in few words.
fn refused(path: &Path, why: &str) {
    for command in ["analyze", "diagnose"] {
        let begin = Instant::now();
        let said = assert_refused(&run(&[command, text(path)]), &[why]);
        assert!(said.len() < 2000, "{command}: {} characters", said.len());
        assert!(
            begin.elapsed() < AT_MOST,
            "{command}: {:?}",
            begin.elapsed()
        );
    }
}

#[test]
fn an_array_that_claims_more_than_the_file_can_hold_is_refused_before_it_is_made() {
    let folder = folder("abuse_arrays");
    for (k, shape) in [
        "(9223372036854775807, 9223372036854775807)",
        "(9223372036854775807,)",
        "(4000000000, 3)",
    ]
    .into_iter()
    .enumerate()
    {
        let path = write(&folder, &format!("{k}.npy"), &npy(shape));
        refused(&path, "would take more than 1 GiB");
    }
    let mut bytes = b"\x93NUMPY\x02\x00".to_vec();
    bytes.extend([0xff; 100]);
    refused(&write(&folder, "header.npy", &bytes), "its header claims");
    // The same within a ZIP, where a gigabyte of zeros is small.
    let path = folder.join("bomb.npz");
    let mut archive = zip::ZipWriter::new(File::create(&path).expect("a file"));
    let options = zip::write::SimpleFileOptions::default();
    archive.start_file("gyro_x.npy", options).expect("an entry");
    archive.write_all(&npy("(600000000,)")).expect("its bytes");
    archive.finish().expect("an archive");
    refused(&path, "array `gyro_x` of 600000000 numbers");
}

#[test]
fn a_header_of_brackets_is_not_printed() {
    let folder = folder("abuse_brackets");
    let path = write(&folder, "brackets.npy", &raw_npy(&"[".repeat(30_000)));
    refused(&path, "brackets.npy");
}

#[test]
fn a_gigabyte_of_nothing_ends_after_16_mib() {
    let folder = folder("abuse_nothing");
    for (name, line) in [("empty", "\n"), ("comments", "# a: b\n"), ("line", "a")] {
        let path = folder.join(format!("{name}.csv.gz"));
        let file = File::create(&path).expect("a file");
        let mut packed = flate2::write::GzEncoder::new(file, flate2::Compression::fast());
        let block = line.repeat((1 << 20) / line.len());
        for _ in 0..20 {
            packed.write_all(block.as_bytes()).expect("room");
        }
        packed.finish().expect("room");
        let why = match name {
            "line" => "is longer than 1 MiB",
            _ => "16 MiB of empty lines and comments",
        };
        refused(&path, why);
    }
}

#[test]
fn thirty_thousand_columns_are_read_in_time() {
    const COLUMNS: usize = 30_000;
    let folder = folder("abuse_wide");
    let more: String = (0..COLUMNS).map(|k| format!(",c{k}")).collect();
    let cells = ",1".repeat(COLUMNS);
    let mut foreign = format!("time_s,gyro_x{more}\n");
    let mut own = format!(
        "# format: imu-stand-capture/1\n# rate_hz: 20\n# gyro_lsb_dps: 0.07326\nseq,gyro_x{more}\n"
    );
    for row in 0..40 {
        let value = (row * 7919) % 13;
        let _ = writeln!(foreign, "{},{value}{cells}", 0.05 * f64::from(row));
        let _ = writeln!(own, "{row},{value}{cells}");
    }
    let begin = Instant::now();
    let path = write(&folder, "foreign.csv", foreign.as_bytes());
    let output = run(&["analyze", text(&path), "--units", "gyro=deg/s"]);
    assert_success(&output);
    let path = write(&folder, "own.csv", own.as_bytes());
    let output = run(&["analyze", text(&path), "--channels", "gyro_x"]);
    assert_success(&output);
    assert!(begin.elapsed() < AT_MOST, "{:?}", begin.elapsed());
}

#[test]
fn a_rate_that_no_stand_has_is_refused() {
    let folder = folder("abuse_rates");
    for line in [
        "rate_hz: 1e300",
        "rate_hz: 0",
        "tick_s: 1e-300",
        "tick_s: -1",
    ] {
        let own = format!(
            "# format: imu-stand-capture/1\n# {line}\n# gyro_lsb_dps: 0.07326\nseq,gyro_x\n0,1\n1,2\n"
        );
        let path = write(&folder, "own.csv", own.as_bytes());
        refused(&path, "expected a number above 0, from 1e-12 to 1e12");
    }
}

#[test]
fn a_terminal_is_sent_no_command_of_a_file() {
    let folder = folder("abuse_escapes");
    let rows = |head: &str| {
        let mut table = format!("{head}\n");
        for row in 0..400 {
            let _ = writeln!(
                table,
                "{},{},{row}",
                0.05 * f64::from(row),
                (row * 7919) % 13
            );
        }
        table
    };
    let hostile = "\x1b[2J\x1b]0;taken\x07";
    let name = format!("a{hostile}b.csv");
    for (name, head) in [
        ("odd.csv", format!("time_s,gyro_x,{hostile}")),
        ("none.csv", format!("time_s,{hostile}gyro_x,{hostile}")),
        ("key.csv", format!("# format: {hostile}\ntime_s,gyro_x,c")),
        (name.as_str(), "time_s,gyro_x,c".to_owned()),
    ] {
        let path = write(&folder, name, rows(&head).as_bytes());
        for command in ["analyze", "diagnose", "representative"] {
            let output = run(&[command, text(&path), "--units", "gyro=deg/s"]);
            for said in [&output.stdout, &output.stderr] {
                let obeyed = |b: &u8| *b < b' ' && !matches!(b, b'\n' | b'\t');
                let at = said.iter().position(obeyed);
                assert_eq!(
                    at,
                    None,
                    "{command} {name:?}: {}",
                    String::from_utf8_lossy(said)
                );
            }
        }
    }
}

#[test]
fn a_table_without_rows_or_with_one_is_told_so_and_not_asked_for_units_or_a_rate() {
    let folder = folder("abuse_rows");
    let none = write(&folder, "none.csv", b"time_s,gyro_x\n");
    refused(&none, "there is no row of data");
    let one = write(&folder, "one.csv", b"time_s,gyro_x\n0,1\n");
    for command in ["analyze", "diagnose"] {
        let output = run(&[command, text(&one), "--units", "gyro=deg/s"]);
        assert_refused(&output, &["one row of data", "copied whole"]);
    }
}

/// `/dev/full` takes nothing, as a full disk does.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_under_standard_output_is_told() {
    let output = common::program(&["simulate", "--seconds", "60", "--out"])
        .arg(folder("abuse_full").join("s.csv"))
        .stdout(File::options().write(true).open("/dev/full").expect("it"))
        .output()
        .expect("the program starts");
    assert_refused(&output, &["cannot write standard output", "make room"]);
}

#[test]
fn what_nobody_is_there_to_do_is_refused_with_the_line_that_does_it() {
    let folder = folder("what_nobody_is_there_to_do_is_refused_with_the_line_that_does_it");
    let out = folder.join("run.csv");
    let out = out.to_str().expect("UTF-8");
    // Beside --out, which --pty excludes, a clap `requires` says nothing.
    for more in [&["--out", out][..], &[]] {
        for (option, value) in [
            ("--stop", "20,25"),
            ("--belt", "0.004"),
            ("--pose", "40:+x"),
        ] {
            let run = ["run", "--native", option, value];
            let expected = [
                "goes with --pty: without it nobody is at the stand",
                "--pty --belt 0.004",
            ];
            assert_misused(&self::run(&[&run[..], more].concat()), &expected);
        }
    }
    for (option, value) in [("--correct-by", "model.toml"), ("--longest", "600")] {
        let refused = run(&["run", "--native", option, value, "--details", "--out", out]);
        assert_misused(&refused, &["goes with --correct"]);
    }
    assert!(!std::path::Path::new(out).exists());
}
