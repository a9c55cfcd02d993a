//! Sample rates and lengths as times say them.

use super::*;

/// A table of a gyro with white noise at these times, and its name.
fn table_at(folder: &Path, name: &str, times: impl Iterator<Item = f64>) -> PathBuf {
    let mut state = 88_172_645_463_325_252_u64;
    let mut uniform = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let mut text = "t,gx\n".to_owned();
    for t in times {
        let noise: f64 = (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
        text += &format!("{t},{noise}\n");
    }
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    path
}

#[test]
fn analyze_and_diagnose_read_one_rate_from_whole_seconds_and_from_a_clock_that_was_set_back() {
    let folder = folder("rates");
    let at = |i: u32| 0.05 * f64::from(i);
    let whole = table_at(&folder, "whole.csv", (0..2400).map(|i| at(i).floor()));
    let set_back = (0..2400).map(|i| if i < 1000 { at(i) } else { at(i) - 20.0 });
    let set_back = table_at(&folder, "set_back.csv", set_back);
    for (path, told) in [
        (&whole, "rounded to more than the interval"),
        (&set_back, "was set back by 19.950 s before row 1001"),
    ] {
        for command in ["analyze", "diagnose"] {
            let out = folder.join("found.json");
            let done = run(&[
                command,
                path.to_str().unwrap(),
                "--columns",
                "time=t,gyro_x=gx",
                "--units",
                "gyro=deg/s",
                "--quiet",
                "--json",
                out.to_str().unwrap(),
            ]);
            let said = String::from_utf8_lossy(&done.stderr).into_owned();
            assert_eq!(done.status.code(), Some(0), "{said}");
            let input = &json(&out)["input"];
            let rate = input["rate_hz"].as_f64().unwrap();
            assert!((rate - 20.0).abs() < 5e-3, "{command} {told}: {rate}");
            assert_eq!(input["samples"], 2400);
            assert!(input["notes"].to_string().contains(told), "{input}");
        }
    }
    // Another rate than that of the times is a mistake, whichever of them is wrong.
    let units = ["--units", "gyro=deg/s"];
    let stated = ["--columns", "time=t,gyro_x=gx", "--rate", "40"];
    let refused = run(&[
        &["analyze", set_back.to_str().unwrap()],
        &stated[..],
        &units,
    ]
    .concat());
    let said = String::from_utf8_lossy(&refused.stderr);
    assert_eq!(refused.status.code(), Some(1), "{said}");
    assert!(
        said.contains("by their times the rows come at 20.0000 Hz"),
        "{said}"
    );
    let still = table_at(&folder, "still.csv", (0..100).map(|_| 5.0));
    let refused = run(&[
        "analyze",
        still.to_str().unwrap(),
        "--columns",
        "time=t,gyro_x=gx",
        units[0],
        units[1],
    ]);
    let said = String::from_utf8_lossy(&refused.stderr);
    assert!(said.contains("the time column is 5 throughout"), "{said}");
}

#[test]
fn a_rate_that_makes_too_long_a_record_is_told_with_the_length() {
    let line = "simulate --rate 1e9 --seconds 1 --out x.csv";
    let refused = run(&line.split(' ').collect::<Vec<_>>());
    let said = String::from_utf8_lossy(&refused.stderr);
    assert_eq!(refused.status.code(), Some(2));
    assert!(said.contains("1 s at 1e9 Hz are 1e9 samples"), "{said}");
}
