//! The report as a reader gets it: a file that needs nothing beside it.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;

use rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

fn program() -> Command {
    Command::new(env!("CARGO_BIN_EXE_imu-stand"))
}

/// A folder of this test's own, new at each run.
fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&path);
    std::fs::create_dir_all(&path).expect("a folder for the test");
    path
}

fn succeed(command: &mut Command) {
    let output = command.output().expect("the program starts");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
}

/// A run with a bias that follows the temperature, its report and its diagnosis: made once for all tests, none of which
/// writes over them.
fn reported() -> &'static (PathBuf, String, serde_json::Value) {
    static MADE: OnceLock<(PathBuf, String, serde_json::Value)> = OnceLock::new();
    MADE.get_or_init(|| {
        let folder = folder("report");
        let arguments = [
            "run", "--native", "--hide", "tempco", "--seed", "5", "--quiet",
        ];
        succeed(
            program()
                .current_dir(&folder)
                .args(arguments)
                .args(["--out", "run.csv", "--report", "r.html", "--json", "d.json"]),
        );
        let read = |name: &str| std::fs::read_to_string(folder.join(name)).expect("it was written");
        let diagnosis = serde_json::from_str(&read("d.json")).expect("it is JSON");
        let page = read("r.html");
        (folder, page, diagnosis)
    })
}

#[test]
fn the_report_is_one_file_that_refers_to_no_other() {
    let (_, page, _) = reported();
    for reference in [
        "<script", "<link", "<img", "src=", "href=", "url(", "@import",
    ] {
        assert!(!page.contains(reference), "{reference}");
    }
    // The name of the SVG format is the only address in it.
    let addresses = page.matches("http").count();
    assert_eq!(
        addresses,
        page.matches("xmlns=\"http://www.w3.org/2000/svg\"").count()
    );
}

#[test]
fn the_report_says_the_verdict_first_and_what_the_json_says() {
    let (_, page, diagnosis) = reported();
    let at = |text: &str| {
        page.find(text)
            .unwrap_or_else(|| panic!("{text} is missing"))
    };
    let verdict = diagnosis["verdict"].as_str().unwrap();
    let body = at("<body>");
    assert!(page[body..].find(verdict).unwrap() < page[body..].find("<svg").unwrap());
    let mut causes = 0;
    for finding in diagnosis["findings"].as_array().unwrap() {
        at(&finding["cause"].as_str().unwrap().replace('_', " "));
        causes += 1;
    }
    assert!(
        causes > 0,
        "a bias of this size on the temperature is found"
    );
    for check in diagnosis["checks"].as_array().unwrap() {
        at(&check["id"].as_str().unwrap().replace('_', " "));
    }
    for not in diagnosis["not_tested"].as_array().unwrap() {
        at(&not["cause"].as_str().unwrap().replace('_', " "));
    }
    // Each gyro: the signal in two panels, or three where something was found; Allan curves; the angle. And a figure
    // for each cause.
    assert!(page.matches("<svg").count() >= 3 * 4 + causes);
    at("imu-stand run --native --hide tempco --seed 5");
    at("sha256:");
    at("Hidden in the simulated stand");
    // What was planted stands beside what was found, here and in the JSON.
    at("temperature on gyro_x, slope: planted -0.1315, found -0.13");
    let planted = &diagnosis["planted"]["items"][0];
    assert_eq!(planted["cause"], "temperature");
    assert_eq!(planted["matches"], true);
    assert_eq!(planted["sizes"][0]["parameter"], "slope");
}

#[test]
fn the_same_record_and_seed_give_the_same_report() {
    let (folder, _, _) = reported();
    let make = || {
        succeed(
            program()
                .current_dir(folder)
                .args(["report", "run.csv", "--out", "again.html"]),
        );
        std::fs::read_to_string(folder.join("again.html")).unwrap()
    };
    assert!(make() == make());
}

#[test]
fn a_reader_that_has_had_enough_is_no_failure() {
    let folder = folder("pipe");
    succeed(program().current_dir(&folder).args([
        "simulate",
        "--seconds",
        "120",
        "--out",
        "c.csv",
    ]));
    let mut child = program()
        .current_dir(&folder)
        .args([
            "diagnose", "c.csv", "--json", "d.json", "--report", "r.html",
        ])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.success() && said.is_empty(),
        "{:?} {said}",
        output.status
    );
    // What it was asked to write is there all the same.
    assert!(folder.join("d.json").exists() && folder.join("r.html").exists());
}

#[test]
fn the_convicting_figures_can_be_had_as_files() {
    let (folder, _, _) = reported();
    let arguments = [
        "report",
        "run.csv",
        "--out",
        "figures.html",
        "--figures",
        "figures",
    ];
    succeed(program().current_dir(folder).args(arguments));
    let figures = folder.join("figures");
    let svg = std::fs::read_to_string(figures.join("temperature-gyro_x.svg")).unwrap();
    assert!(
        svg.starts_with("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox="),
        "{}",
        &svg[..100]
    );
    assert_eq!(svg.matches("<svg ").count(), svg.matches("</svg>").count());
    assert!(svg.contains("degC"));
}

/// The model without the motion is the sensor at rest, no bias that walks away: the scale is that of the sway.
#[test]
fn a_base_that_sways_is_shown_beside_the_sensor_at_rest() {
    let folder = folder("report_sway");
    let line =
        "run --native --hide uncalibrated --seed 1795691001 --quiet --no-replicates --out sway.csv";
    succeed(program().current_dir(&folder).args(line.split(' ')));
    let line = "report sway.csv --quiet --no-replicates --figures figures --out r.html";
    succeed(program().current_dir(&folder).args(line.split(' ')));
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).expect("it was written");
    let texts = |svg: &str| -> Vec<f64> {
        let parts = svg.split('>').filter_map(|part| part.split('<').next());
        parts.filter_map(|text| text.trim().parse().ok()).collect()
    };
    // Ticks of the rate, beside those of the time, 0 to 600 s.
    let motion = read("figures/base_motion-gyro_x.svg");
    let ticks = texts(&motion);
    assert!(ticks.contains(&4.0) && ticks.contains(&-4.0), "{ticks:?}");
    assert!(
        ticks.iter().all(|t| t.abs() < 20.0 || *t >= 100.0),
        "{ticks:?}"
    );
    assert!(motion.contains("simulated without it"));
    let cross = texts(&read("figures/cross_axis-gyro_y.svg"));
    assert!(cross.iter().all(|t| t.abs() < 20.0), "{cross:?}");
    let page = read("r.html");
    assert!(page.contains("The other causes stay in the simulation."));
    assert!(page.contains("leaves the figure: its band reaches"));
}

/// An echo of half of each reading seven readings later is in no library: the page shows its spectrum, under no name.
#[test]
fn what_has_no_name_has_a_figure() {
    let folder = folder("report_unnamed");
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(8);
    let mut csv = String::from("time_s,gx_dps,gy_dps,gz_dps\n");
    let mut before = std::collections::VecDeque::from([0.0; 7]);
    for i in 0..12_000 {
        let [x, y, z]: [f64; 3] = std::array::from_fn(|_| StandardNormal.sample(&mut rng));
        before.push_back(x);
        let echo = 0.5 * before.pop_front().unwrap();
        let time = f64::from(i) / 20.0;
        writeln!(csv, "{time:.2},{:.2},{y:.2},{z:.2}", x + echo).unwrap();
    }
    std::fs::write(folder.join("echo.csv"), csv).expect("it is written");
    let line = "report echo.csv --quiet --no-replicates --figures figures --out r.html";
    succeed(program().current_dir(&folder).args(line.split(' ')));
    let names = std::fs::read_dir(folder.join("figures")).expect("figures");
    let names: Vec<String> = names
        .map(|f| f.unwrap().file_name().into_string().unwrap())
        .filter(|name| name.ends_with(".svg"))
        .collect();
    assert!(
        names.contains(&"unexplained-gyro_x.svg".to_owned()),
        "{names:?}"
    );
    let page = std::fs::read_to_string(folder.join("r.html")).expect("it was written");
    assert!(page.contains("gyro_x: what has no name. </b>"));
}
