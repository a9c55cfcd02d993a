//! The page that runs the engine in a browser, in Chromium: what it says of a file is what the program says. It is opened as a
//! file; `cargo xtask page` builds it, and without it or without Chromium the test says so.

mod common;

use std::path::{Path, PathBuf};
use std::time::Duration;

use common::{assert_success, folder, program};
use imu_stand::browser::Browser;
use serde_json::Value;

/// Relative difference of numbers. Both engines do the same sums; `exp`, `ln` and the like come from another library in
/// a browser and differ in the last of 16 digits, which minimisers and derivatives by differences make more of.
const RELATIVE: f64 = 1e-5;
/// Chances, shares and test statistics near 0 are differences of numbers of about 1.
const ABSOLUTE: f64 = 1e-8;
/// Relative difference of what is simulated to size a consequence. The random numbers of an effect hang on the last digit of its
/// parameters, so they are others; some ten draws leave a scatter of a tenth.
const SIMULATED: f64 = 0.3;

/// The page and the browser.
fn page() -> Option<(String, Browser)> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/page/index.html");
    let page = std::fs::read_to_string(&path).map_err(|error| error.to_string());
    let browser = Browser::find().map_err(|error| error.to_string());
    match (page, browser) {
        (Ok(page), Ok(browser)) => Some((page, browser)),
        (Err(error), _) | (_, Err(error)) => {
            assert!(std::env::var_os("CI").is_none(), "in CI: {error}");
            eprintln!(
                "NOT TESTED: {error}; `cargo xtask page`, `apt-get install chromium`, and again"
            );
            None
        }
    }
}

/// Drops a file on the page, and after a failure with a proposal or a span reads it so, in deg/s where it asks for a unit;
/// writes down what came of it.
const USER: &str = r#"<script>
// A frame that goes on loading keeps the browser from ending.
const hold = document.createElement('iframe');
document.body.append(hold);
hold.contentDocument.open();
const wrong = [], said = [], failures = [];
let ticks = 0;
onerror = (what) => wrong.push(`script: ${what}`);
addEventListener('securitypolicyviolation', (event) => wrong.push(`asks for ${event.blockedURI}`));
setInterval(() => { ticks += 1; }, 50);
const words = () => part('said').textContent.replace(/, \d+ s$/, '');
new MutationObserver(() => { if (part('said') && said.at(-1) !== words()) said.push(words()); }).observe(part('said'), { childList: true });
const answer = (found) => {
  const shown = document.createElement('p');
  shown.textContent = 'SAID' + JSON.stringify({ ...found, wrong, said, failures, ticks, requests: performance.getEntriesByType('resource').map((r) => r.name) }) + 'SAID';
  document.body.replaceChildren(shown);
};
addEventListener('failed', ({ detail }) => {
  failures.push(detail);
  part('units').value = part('units').value.replaceAll('UNIT', 'deg/s');
  if ((detail.proposal || detail.span) && failures.length === 1 && part('mapping').open) part('again').click();
  else answer({});
});
addEventListener('finished', ({ detail }) => {
  part('report').onload = () => answer({ done: detail, links: [...part('downloads').querySelectorAll('a')].map((a) => a.download) });
});
const bytes = Uint8Array.from(atob('FILE'), (c) => c.charCodeAt(0));
const transfer = new DataTransfer();
transfer.items.add(new File([bytes], 'NAME'));
dispatchEvent(new DragEvent('drop', { dataTransfer: transfer }));
</script></body>"#;

/// What the page makes of a file.
fn dropped(file: &Path, beside: &Path) -> Option<Value> {
    dropped_within(file, beside, Duration::from_secs(120))
}

/// The same of a page that takes so long at the most.
fn dropped_within(file: &Path, beside: &Path, at_most: Duration) -> Option<Value> {
    let (page, browser) = page()?;
    let browser = browser.patient(at_most);
    let bytes = std::fs::read(file).expect("a file");
    let name = file.file_name().expect("a name").to_string_lossy();
    // The name first: 40 million letters have any four of them in a row.
    let user = USER.replace("NAME", &name).replace("FILE", &base64(&bytes));
    let (start, end) = page.rsplit_once("</body>").expect("a body");
    let shown = [start, &user, end].concat();
    let (dom, console) = browser.dom(&shown, beside).expect("it shows a page");
    let mut parts = dom.split("SAID");
    let said = parts
        .nth(1)
        .unwrap_or_else(|| panic!("no answer: {console}"));
    let said = said
        .replace("&lt;", "<")
        .replace("&gt;", ">")
        .replace("&nbsp;", "\u{a0}");
    let said: Value = serde_json::from_str(&said.replace("&amp;", "&")).expect("JSON");
    let complaints: Vec<&str> = console
        .lines()
        .filter(|line| line.contains("CONSOLE"))
        .collect();
    assert!(complaints.is_empty(), "{complaints:#?}");
    assert_eq!(said["wrong"], serde_json::json!([]), "{}", said["wrong"]);
    let requests = said["requests"].as_array().expect("requests");
    // Its own worker is a blob; nothing else is asked for.
    assert!(
        requests
            .iter()
            .all(|name| name.as_str().expect("a name").starts_with("blob:")),
        "{requests:?}"
    );
    Some(said)
}

fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::new();
    for three in bytes.chunks(3) {
        let of = |k: usize| u32::from(three.get(k).copied().unwrap_or(0));
        let bits = of(0) << 16 | of(1) << 8 | of(2);
        let letter = |k: usize| char::from(LETTERS[(bits >> (18 - 6 * k)) as usize & 63]);
        out.extend((0..4).map(|k| if k <= three.len() { letter(k) } else { '=' }));
    }
    out
}

/// Where two results differ by more than rounding, and the largest relative difference of all.
fn differences(path: &str, a: &Value, b: &Value, out: &mut Vec<String>, largest: &mut f64) {
    match (a, b) {
        (Value::Object(a_fields), Value::Object(b_fields)) => {
            if a_fields.keys().ne(b_fields.keys()) {
                out.push(format!("{path}: other keys"));
            }
            for (key, value) in a_fields {
                let other = b_fields.get(key).unwrap_or(&Value::Null);
                differences(&format!("{path}.{key}"), value, other, out, largest);
            }
        }
        (Value::Array(a_items), Value::Array(b_items)) if a_items.len() == b_items.len() => {
            for (k, (one, other)) in a_items.iter().zip(b_items).enumerate() {
                differences(&format!("{path}[{k}]"), one, other, out, largest);
            }
        }
        (Value::Number(one), Value::Number(other)) => {
            let (x, y) = (
                one.as_f64().unwrap_or(f64::NAN),
                other.as_f64().unwrap_or(f64::NAN),
            );
            let (apart, size) = ((x - y).abs(), x.abs().max(y.abs()));
            let is_simulated = path.contains(".consequence.");
            if apart > ABSOLUTE && !is_simulated {
                *largest = largest.max(apart / size);
            }
            let relative = if is_simulated { SIMULATED } else { RELATIVE };
            if apart.is_nan() || apart > relative * size + ABSOLUTE {
                out.push(format!("{path}: {x} and {y}"));
            }
        }
        _ if a == b => {}
        _ => out.push(format!("{path}: {a} and {b}")),
    }
}

/// Holds what the page says of a file against the program.
fn assert_same(file: &Path, beside: &Path, words: &[&str]) -> Option<Value> {
    let said = dropped(file, beside)?;
    let done = &said["done"];
    assert!(done.is_object(), "{:?}", said["failures"]);
    let name = file.display().to_string();
    let mut largest = 0.0;
    for (command, key) in [("analyze", "analysis"), ("diagnose", "json")] {
        let json = beside.with_extension(format!("{command}.json"));
        let report = beside.with_extension("program.html");
        let mut all = vec![command, name.as_str(), "--quiet", "--json"];
        let (json_name, report_name) = (json.display().to_string(), report.display().to_string());
        all.push(&json_name);
        all.extend(words);
        if command == "diagnose" {
            all.extend(["--report", &report_name]);
        }
        assert_success(&program(&all).output().expect("it starts"));
        let parsed = |text: &str| serde_json::from_str::<Value>(text).expect("JSON");
        let theirs = parsed(&std::fs::read_to_string(&json).expect("JSON"));
        let ours = parsed(done[key].as_str().expect("text"));
        let mut out = Vec::new();
        differences("", &ours, &theirs, &mut out, &mut largest);
        assert!(out.is_empty(), "{command}: {out:#?}");
        if command == "diagnose" {
            let theirs = std::fs::read_to_string(&report).expect("a report");
            let page = done["html"].as_str().expect("a report");
            for part in ["<figure", "<tr", "<h2", "<svg"] {
                assert_eq!(
                    page.matches(part).count(),
                    theirs.matches(part).count(),
                    "{part}"
                );
            }
        }
    }
    eprintln!("{name}: largest relative difference {largest:.1e}");
    Some(said)
}

#[test]
fn a_simulated_stand_dropped_on_the_page_is_diagnosed_as_by_the_program() {
    let folder = folder("page_simulated");
    let words = "run --native --hide tempco --seed 5 --quiet --out run.csv.gz";
    let mut command = program(&words.split(' ').collect::<Vec<_>>());
    assert_success(&command.current_dir(&folder).output().expect("it starts"));
    let Some(said) = assert_same(&folder.join("run.csv.gz"), &folder.join("look"), &[]) else {
        return;
    };
    let text = said["done"]["text"].as_str().expect("text");
    assert!(text.contains("Bias follows temperature"), "{text}");
    let links = serde_json::json!([
        "run.html",
        "run-diagnosis.json",
        "run-analysis.json",
        "run.toml"
    ]);
    assert_eq!(said["links"], links);
    // The page lives meanwhile, and says what is done.
    let told = said["said"].to_string();
    for stage in [
        "reading the file",
        "Allan deviations",
        "looking for causes",
        "drawing the report",
        "done in",
    ] {
        assert!(told.contains(stage), "{told}");
    }
    assert!(
        said["ticks"].as_u64().expect("a number") >= 5,
        "{}",
        said["ticks"]
    );
}

#[test]
fn a_measured_record_dropped_on_the_page_is_diagnosed_as_by_the_program() {
    let Some(data) = std::env::var_os("IMU_STAND_DATA").map(PathBuf::from) else {
        eprintln!("NOT TESTED: IMU_STAND_DATA is unset");
        return;
    };
    let file = data.join("mpu6050_static_20hz_600s.csv.gz");
    assert_same(&file, &folder("page_measured").join("look"), &[]);
}

/// Two busy cores take a part of it.
const OF_A_DAY: Duration = Duration::from_secs(3600);

/// A day at 20 Hz, in the 4 GB that the engine has there. It takes minutes, so it runs where it is asked for.
#[test]
fn a_day_dropped_on_the_page_is_diagnosed_as_by_the_program() {
    if std::env::var_os("IMU_STAND_DAY").is_none() {
        eprintln!("NOT TESTED: IMU_STAND_DAY is unset, and a day takes minutes");
        return;
    }
    let folder = folder("page_day");
    let ran = |words: &str| {
        let mut command = program(&words.split(' ').collect::<Vec<_>>());
        assert_success(&command.current_dir(&folder).output().expect("it starts"));
    };
    ran("simulate --seconds 86400 --seed 3 --out day.csv.gz");
    let file = folder.join("day.csv.gz");
    let Some(said) = dropped_within(&file, &folder.join("look"), OF_A_DAY) else {
        return;
    };
    let done = &said["done"];
    assert!(done.is_object(), "{:?}", said["failures"]);
    ran("diagnose day.csv.gz --quiet --json day.json");
    let parsed = |text: &str| serde_json::from_str::<Value>(text).expect("JSON");
    let ours = parsed(done["json"].as_str().expect("text"));
    let theirs = parsed(&std::fs::read_to_string(folder.join("day.json")).expect("JSON"));
    assert_eq!(ours["input"]["samples"], 1_728_000);
    for key in ["input", "verdict", "findings", "unexplained"] {
        let (mut out, mut largest) = (Vec::new(), 0.0);
        differences(key, &ours[key], &theirs[key], &mut out, &mut largest);
        assert!(out.is_empty(), "{out:#?}");
    }
    let page = done["html"].as_str().expect("a report");
    assert!(
        page.matches("<svg").count() >= 9 && page.len() < 4_000_000,
        "{}",
        page.len()
    );
    eprintln!("{}", said["said"]);
}

/// White noise by a generator whose period is longer than the record.
fn noise() -> impl FnMut() -> f64 {
    let mut state = 1_u64;
    let mut next = move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f64 / f64::from(1 << 24)
    };
    move || (0..12).map(|_| next()).sum::<f64>() - 6.0
}

#[test]
fn a_part_of_a_file_with_two_sample_rates_is_read() {
    let folder = folder("page_two_rates");
    let file = folder.join("two.csv");
    let mut noise = noise();
    let times = (0..1200)
        .map(|k| k * 50)
        .chain((1..1200).map(|k| 60_000 + k * 10));
    let rows = times.map(|t| format!("{t},{:.5}\n", noise()));
    let text: String = std::iter::once("time_ms,gyro_x_dps\n".to_owned())
        .chain(rows)
        .collect();
    std::fs::write(&file, text).expect("a file");
    let Some(said) = dropped(&file, &folder.join("look")) else {
        return;
    };
    assert_eq!(said["failures"].as_array().map(Vec::len), Some(1), "{said}");
    let json = said["done"]["json"].as_str().expect("a diagnosis");
    let diagnosis: Value = serde_json::from_str(json).expect("JSON");
    let samples = diagnosis["input"]["samples"].as_u64().expect("samples");
    assert!((1199..=1201).contains(&samples), "{samples}");
    let page = said["done"]["html"].as_str().expect("a report");
    assert!(
        page.contains("--span "),
        "the report's command takes the part"
    );
}

#[test]
fn a_foreign_table_is_read_as_the_page_proposes() {
    let folder = folder("page_foreign");
    let file = folder.join("their.csv");
    let mut noise = noise();
    let rows = (0..1200).map(|k| format!("{},{:.5},{:.5}\n", k * 50, noise(), noise()));
    let text: String = std::iter::once("stamp_ms,gx_raw,gy_raw\n".to_owned())
        .chain(rows)
        .collect();
    std::fs::write(&file, text).expect("a file");
    let Some(said) = dropped(&file, &folder.join("look")) else {
        return;
    };
    let failures = said["failures"].as_array().expect("failures");
    assert!(
        failures[0]["proposal"][0]
            .as_str()
            .is_some_and(|p| p.contains("gyro_x=gx_raw")),
        "{failures:?}"
    );
    assert!(said["done"].is_object() && failures.len() == 1, "{said}");
}

#[test]
fn a_file_that_is_none_is_told_with_what_to_do() {
    let folder = folder("page_none");
    let file = folder.join("empty.csv");
    std::fs::write(&file, "").expect("a file");
    let Some(said) = dropped(&file, &folder.join("look")) else {
        return;
    };
    let failure = &said["failures"][0];
    assert!(
        failure["help"]
            .as_str()
            .is_some_and(|help| !help.is_empty()),
        "{failure}"
    );
}
