//! The loop: something is planted in the simulated stand, recorded, diagnosed, corrected on the board, and recorded again under
//! another history. Graded by the angle errors of the corrected rates against those of the same board on a stand with nothing
//! wrong.
//!
//! A run of the tests makes a few draws. `IMU_STAND_LOOPS` sets how many, `IMU_STAND_SEED` replays them, `IMU_STAND_THROUGH=image`
//! takes the image in the simulated ATmega16, and answers that lie in the folder `IMU_STAND_KEPT` are not made again. `cargo xtask
//! loop` sets them, and writes docs/loop.txt.

mod common;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use campaign::tally::Rate;
use common::{assert_success, folder, json, run};
use model::ModelFile;
use serde_json::Value;

/// Corrected may be so much worse than the limit, in so many cases: what is asked for.
const NEAR: f64 = 1.15;
const ASKED: f64 = 0.90;
/// Chance of failing a loop that just meets what is asserted.
const CHANCE: f64 = 1e-3;
/// The image, for whom `IMU_STAND_THROUGH` asks.
const IMAGE: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../../target/avr/avr-none/firmware/firmware.elf"
);
/// What is drawn: each kind whose cause the board has a term for, and all three at once as often as all others.
const KINDS: [&str; 6] = [
    "uncalibrated",
    "tempco",
    "uncalibrated",
    "motor-coupling",
    "uncalibrated",
    "supply-coupling",
];

fn drawn(number: &str, or: u64) -> u64 {
    std::env::var(number).map_or(or, |text| text.parse().expect("a number"))
}

/// Runs the loop on the firmware's logic; its answer.
fn whole(folder: &Path, hide: &str, seed: u64, more: &[&str]) -> Value {
    looped(folder, hide, seed, &[&["--native"], more].concat())
}

fn looped(folder: &Path, hide: &str, seed: u64, more: &[&str]) -> Value {
    let out = folder.join(format!("run-{seed}.csv"));
    let answer = folder.join(format!("loop-{seed}.json"));
    let (seed, out) = (seed.to_string(), out.to_str().unwrap());
    let mut all = vec![
        "run",
        "--correct",
        "--hide",
        hide,
        "--seed",
        &seed,
        "--out",
        out,
    ];
    all.extend(["--json", answer.to_str().unwrap()]);
    all.extend(more);
    assert_success(&run(&all));
    json(&answer)
}

/// The loop of a draw; of its files the answer is kept, which is written whole.
fn drawn_loop(folder: &Path, hide: &str, seed: u64, way: &[&str]) -> Value {
    let own = folder.join(format!("draw-{seed}"));
    std::fs::create_dir_all(&own).unwrap();
    let answer = looped(&own, hide, seed, &[&["--no-replicates"], way].concat());
    std::fs::rename(
        own.join(format!("loop-{seed}.json")),
        folder.join(format!("loop-{seed}.json")),
    )
    .unwrap();
    std::fs::remove_dir_all(own).unwrap();
    answer
}

/// Angle errors: axis, record, span, before, after, predicted, limit.
fn rows(answer: &Value) -> Vec<(String, f64, [f64; 4])> {
    let mut all = Vec::new();
    for judged in answer["angle_errors"].as_array().unwrap() {
        for row in judged["rows"].as_array().unwrap() {
            let number = |key: &str| row[key].as_f64().unwrap();
            all.push((
                format!(
                    "{} {}",
                    judged["what"].as_str().unwrap(),
                    row["channel"].as_str().unwrap()
                ),
                number("span_s"),
                ["before_deg", "after_deg", "predicted_deg", "limit_deg"].map(number),
            ));
        }
    }
    all
}

fn axis_of(cause: &Value) -> (String, String) {
    let word = |key: &str| cause[key].as_str().unwrap().to_owned();
    (word("cause"), word("channel"))
}

#[test]
fn a_correction_by_what_was_found_comes_near_what_the_noise_alone_leaves() {
    let draws = drawn("IMU_STAND_LOOPS", 3);
    let clock = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    let seed = drawn("IMU_STAND_SEED", clock.unwrap().as_secs());
    println!("IMU_STAND_SEED={seed} IMU_STAND_LOOPS={draws}");
    let folder =
        std::env::var_os("IMU_STAND_KEPT").map_or_else(|| folder("correct"), PathBuf::from);
    std::fs::create_dir_all(&folder).unwrap();
    let through_image = std::env::var_os("IMU_STAND_THROUGH").is_some_and(|what| what == "image");
    let (next, all) = (AtomicU64::new(0), Mutex::new(Vec::new()));
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(|| {
                loop {
                    let number = next.fetch_add(1, Ordering::Relaxed);
                    if number >= draws {
                        return;
                    }
                    // Kinds go round from one that the seed chooses.
                    let kind = KINDS[(seed.wrapping_add(number) % KINDS.len() as u64) as usize];
                    let own = seed.wrapping_mul(1000).wrapping_add(number);
                    let kept = folder.join(format!("loop-{own}.json"));
                    let answer = if kept.exists() {
                        json(&kept)
                    } else {
                        let way: &[&str] = if through_image {
                            &["--longest", "1260", "--image", IMAGE]
                        } else {
                            &["--native"]
                        };
                        drawn_loop(&folder, kind, own, way)
                    };
                    eprintln!("draw {number}: {kind}, seed {own}");
                    all.lock().unwrap().push((number, kind, own, answer));
                }
            });
        }
    });
    let mut all = all.into_inner().unwrap();
    all.sort_by_key(|(number, ..)| *number);
    graded(&all);
}

/// What is planted on an axis and shows in a record: a lean only while the base turns, the others above all at rest.
fn shows(stage: &str, causes: &[&str]) -> String {
    let (askew, mut others): (Vec<&str>, Vec<&str>) =
        causes.iter().partition(|cause| **cause == "cross_axis");
    others.sort_unstable();
    match (stage, others.is_empty(), askew.is_empty()) {
        ("at rest", true, _) => "nothing that shows at rest".to_owned(),
        ("at rest", false, _) => others.join(" and "),
        (_, _, false) => "askew".to_owned(),
        _ => "not askew".to_owned(),
    }
}

fn graded(all: &[(u64, &str, u64, Value)]) {
    // By record and span, planted axes apart: near the limit, better than read.
    let mut table: BTreeMap<(String, u64), Vec<[f64; 4]>> = BTreeMap::new();
    let (mut gone, mut flagged, mut better) = (Vec::new(), Vec::new(), Vec::new());
    for (number, kind, seed, answer) in all {
        let planted: Vec<(String, String)> =
            (answer["planted"]["items"].as_array().unwrap().iter())
                .map(|item| {
                    let channel = item["channels"][0].as_str().unwrap_or("").to_owned();
                    (item["cause"].as_str().unwrap().to_owned(), channel)
                })
                .collect();
        let still: Vec<(String, String)> = (answer["still_named"].as_array().unwrap().iter())
            .map(axis_of)
            .collect();
        gone.push(still.is_empty());
        for (what, span, values) in rows(answer) {
            let (stage, channel) = what.rsplit_once(' ').unwrap();
            let causes: Vec<&str> = (planted.iter().filter(|(_, c)| c == channel))
                .map(|(cause, _)| cause.as_str())
                .collect();
            let of = shows(stage, &causes);
            table
                .entry((format!("{stage}, {of}"), span as u64))
                .or_default()
                .push(values);
            if stage == "at rest" && !causes.is_empty() {
                better.push(values[1] < values[0]);
            }
        }
        flagged.push(answer["worse"].as_bool().unwrap());
        println!(
            "draw {number}: {kind}, seed {seed}: first record {} s, still named {still:?}, worse {}",
            answer["recorded"]["seconds"], answer["worse"]
        );
    }
    println!(
        "| second record | planted on the axis | span, s | after <= {NEAR} x limit | before | after | predicted | limit | after / limit |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for ((what, span), values) in &table {
        let near = Rate::of(values.iter().map(|v| v[1] <= NEAR * v[3]));
        let (low, high) = near.interval();
        let median = |of: &dyn Fn(&[f64; 4]) -> f64| {
            let mut all: Vec<f64> = values.iter().map(of).collect();
            all.sort_by(f64::total_cmp);
            all[all.len() / 2].midpoint(all[(all.len() - 1) / 2])
        };
        let deg = [0, 1, 2, 3].map(|k| format!("{:.3}", median(&|v| v[k])));
        let (stage, of) = what.split_once(", ").unwrap();
        println!(
            "| {stage} | {of} | {span} | {} of {} ({:.0} %, {:.0} .. {:.0}) | {} | {:.2} |",
            near.hits,
            near.trials,
            100.0 * near.hits as f64 / near.trials as f64,
            100.0 * low,
            100.0 * high,
            deg.join(" | "),
            median(&|v| v[1] / v[3])
        );
    }
    let all_near = |keep: &dyn Fn(&str) -> bool| {
        let those = table.iter().filter(|((what, _), _)| keep(what));
        Rate::of(those.flat_map(|(_, values)| values.iter().map(|v| v[1] <= NEAR * v[3])))
    };
    let told = |what: &str, rate: Rate| {
        let (low, high) = rate.interval();
        println!(
            "{what}: {} of {} ({:.0} .. {:.0} %)",
            rate.hits,
            rate.trials,
            100.0 * low,
            100.0 * high
        );
        rate
    };
    let without = |what: &str| what.starts_with("at rest") && !what.contains("temperature");
    told("after <= 1.15 limit, everything", all_near(&|_| true));
    told(
        "after <= 1.15 limit, at rest",
        all_near(&|what| what.starts_with("at rest")),
    );
    told(
        "after <= 1.15 limit, at rest, no temperature",
        all_near(&without),
    );
    let gone = told("nothing corrected still named", Rate::of(gone));
    told(
        "not flagged as worse",
        Rate::of(flagged.into_iter().map(|f| !f)),
    );
    let better = told("better than read, planted axes at rest", Rate::of(better));
    for (what, rate, asked) in [("better", better, ASKED), ("gone", gone, ASKED)] {
        assert!(
            rate.trials == 0 || rate.at_most(asked) > CHANCE,
            "{what}: {} of {}, less than {asked}",
            rate.hits,
            rate.trials
        );
    }
}

#[test]
fn a_model_with_its_signs_turned_is_told_to_be_worse_than_nothing() {
    let folder = folder("correct_wrong");
    let right = whole(
        &folder,
        "tempco",
        5,
        &["--no-replicates", "--seconds", "300"],
    );
    assert_eq!(right["worse"], false, "{}", right["angle_errors"]);
    let path = folder.join("run-5.toml");
    let mut model = ModelFile::parse(&std::fs::read_to_string(path).unwrap()).unwrap();
    for effect in &mut model.effects {
        for name in ["slope", "at_full_duty"] {
            if let Some(parameter) = effect.parameters.get_mut(name) {
                parameter.value = -parameter.value;
            }
        }
    }
    let wrong = folder.join("wrong.toml");
    std::fs::write(&wrong, model.to_toml()).unwrap();
    let out = folder.join("again.csv");
    let answer = folder.join("again.json");
    let said = assert_success(&run(&[
        "run",
        "--native",
        "--correct",
        "--hide",
        "tempco",
        "--seed",
        "5",
        "--seconds",
        "300",
        "--no-replicates",
        "--correct-by",
        wrong.to_str().unwrap(),
        "--out",
        out.to_str().unwrap(),
        "--json",
        answer.to_str().unwrap(),
    ]));
    assert!(
        said.contains("WORSE than the rates as they are read"),
        "{said}"
    );
    assert!(said.contains("board correct --off"), "{said}");
    let answer = json(&answer);
    assert_eq!(answer["worse"], true);
    // The slope is there twice; the bias was taken while the temperature moved.
    let row = rows(&answer);
    let (_, _, [before, after, ..]) = (row.iter())
        .filter(|(_, span, _)| *span == 100.0)
        .max_by(|a, b| a.2[0].total_cmp(&b.2[0]))
        .unwrap();
    assert!(*after > 1.6 * before, "{before} -> {after}");
}

#[test]
fn a_wrong_model_is_not_excused_by_the_noise_that_it_claims() {
    let folder = folder("correct_excused");
    let seconds = ["--no-replicates", "--seconds", "300", "--longest", "300"];
    whole(&folder, "tempco", 5, &seconds);
    let right = std::fs::read_to_string(folder.join("run-5.toml")).unwrap();
    let wrong = folder.join("wrong.toml");
    for noisier in [1.0, 3.0] {
        let mut model = ModelFile::parse(&right).unwrap();
        // Gyro y has no slope; its angle over 100 s becomes four times as wrong.
        let mut slope = model.effects[0].clone();
        assert_eq!(slope.channels, ["gyro_x"]);
        slope.channels = vec!["gyro_y".to_owned()];
        slope.parameters.get_mut("slope").unwrap().value = 0.01;
        model.effects.push(slope);
        for channel in &mut model.channels {
            let n = channel.baseline.get_mut("angle_random_walk").unwrap();
            n.value *= noisier;
        }
        std::fs::write(&wrong, model.to_toml()).unwrap();
        let by = ["--correct-by", wrong.to_str().unwrap()];
        let answer = whole(&folder, "tempco", 5, &[&seconds[..], &by].concat());
        let told = (answer["angle_errors"][0]["rows"].as_array().unwrap().iter())
            .find(|row| row["channel"] == "gyro_y" && row["span_s"] == 100.0);
        let row = told.unwrap();
        let of = |key: &str| row[key].as_f64().unwrap();
        assert!(of("after_deg") > 3.0 * of("before_deg"), "{row}");
        assert_eq!(row["worse"], true, "N times {noisier}: {row}");
        assert_eq!(answer["worse"], true);
    }
}

#[test]
fn the_same_seed_gives_the_same_loop() {
    let folder = folder("correct_same");
    let once = |name: &str| {
        let folder = folder.join(name);
        std::fs::create_dir_all(&folder).unwrap();
        whole(
            &folder,
            "tempco",
            7,
            &["--no-replicates", "--seconds", "120"],
        )
    };
    assert_eq!(once("a"), once("b"));
}
