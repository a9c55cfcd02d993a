//! What is hidden in the stand is said in words, and compared with what is found in the units of the diagnosis, whatever
//! it is.

use diagnosis::result::{Alternative, Diagnosis, Finding, Parameter};
use imu_stand::stand::planted::{GYROS, Named, ON_ITS_WAY_S, Planted, compare, planted};
use imu_stand::stand::{Hidden, Plan, Sizes, plan, run_native};

const SECONDS: f64 = 600.0;
/// When the record begins after power-on, s.
const START_S: f64 = 0.25;
const STD_ERROR: f64 = 0.01;

/// A diagnosis of these findings, and of nothing else.
fn diagnosis(findings: Vec<Finding>) -> Diagnosis {
    let empty = serde_json::json!({
        "format": "imu-stand-diagnosis/1",
        "input": { "file": "", "seconds": SECONDS, "rate_hz": 20.0, "samples": 12_000, "channels": [] },
        "baseline": {}, "checks": [], "findings": [], "unexplained": [], "not_tested": [], "verdict": "extended"
    });
    Diagnosis {
        findings,
        ..serde_json::from_value(empty).expect("a diagnosis")
    }
}

/// A finding that states what was planted, each size off by `apart` standard errors.
fn finding(planted: &Planted, apart: f64) -> Finding {
    let parameters = planted.sizes.iter().map(|size| {
        let (error, value) = (STD_ERROR, size.value + apart * STD_ERROR);
        (
            size.parameter.to_owned(),
            Parameter::estimated(value, error, size.unit),
        )
    });
    Finding {
        cause: planted.cause.to_owned(),
        channels: planted.channels.iter().map(|c| (*c).to_owned()).collect(),
        parameters: parameters.collect(),
        ..Finding::default()
    }
}

/// Every kind, in several draws.
fn plans() -> impl Iterator<Item = (Hidden, Plan)> {
    let kinds = Hidden::ALL.into_iter();
    kinds.flat_map(|hidden| {
        (1..=4).map(move |seed| (hidden, plan(hidden, Sizes::Visible, SECONDS, seed)))
    })
}

/// How Rust prints a value for programmers: a struct's brace, a path, an option.
fn is_debug(text: &str) -> bool {
    [" { ", "::", "Some(", "None", "_dps", "_s:"]
        .iter()
        .any(|mark| text.contains(mark))
}

#[test]
fn every_hidden_kind_is_said_in_words_and_in_the_parameters_of_an_effect() {
    for (hidden, plan) in plans() {
        let all = planted(&plan.run, START_S);
        assert!(!all.is_empty(), "{hidden:?}");
        assert!(
            !is_debug(&plan.hidden) && plan.hidden.contains(' '),
            "{}",
            plan.hidden
        );
        for planted in all {
            let what = format!("{hidden:?}: {}", planted.what);
            let effect = model::effects::effect(planted.cause).expect(&what);
            assert_eq!(
                planted.sizes.is_empty(),
                !planted.name_alone.is_empty(),
                "{what}"
            );
            for size in &planted.sizes {
                let mut specs = effect.parameters().iter();
                let spec = specs.find(|spec| spec.name == size.parameter).expect(&what);
                assert_eq!(spec.unit, size.unit, "{what}");
                assert!(size.value.is_finite(), "{what}");
            }
        }
    }
}

#[test]
fn every_hidden_kind_is_compared_in_one_line_for_each_size() {
    for (hidden, plan) in plans() {
        let all = planted(&plan.run, START_S);
        for (apart, ends) in [(0.0, "match"), (1.9, "match")] {
            let found = all.iter().map(|p| finding(p, apart)).collect();
            let comparison = compare(&all, &diagnosis(found));
            assert!(comparison.besides.is_empty(), "{comparison:?}");
            let lines = comparison.lines();
            // Where the name alone is compared, a line says why.
            let sizes: usize = all
                .iter()
                .map(|p| p.sizes.len().max(2 * usize::from(p.sizes.is_empty())))
                .sum();
            assert_eq!(lines.len(), all.len() + sizes, "{lines:?}");
            for line in lines.iter().filter(|line| !line.starts_with([' ', 'p'])) {
                assert!(line.contains(": planted"), "{hidden:?}: {line}");
                assert!(
                    line.contains(ends) && !line.contains("no match"),
                    "{hidden:?}: {line}"
                );
                assert!(!is_debug(line), "{hidden:?}: {line}");
            }
        }
    }
}

#[test]
fn what_lies_outside_the_interval_or_is_not_found_is_no_match() {
    for (hidden, plan) in plans() {
        let all = planted(&plan.run, START_S);
        let far = |p: &Planted| finding(p, 2.0 + 3.0 / STD_ERROR);
        let comparison = compare(&all, &diagnosis(all.iter().map(far).collect()));
        for (item, planted) in comparison.items.iter().zip(&all) {
            assert_eq!(
                item.matches,
                planted.sizes.is_empty(),
                "{hidden:?}: {item:?}"
            );
        }
        let comparison = compare(&all, &diagnosis(vec![]));
        assert!(
            comparison.items.iter().all(|item| !item.matches),
            "{hidden:?}"
        );
        let lines = comparison.lines();
        let mut compared = lines.iter().filter(|line| !line.starts_with([' ', 'p']));
        let last = compared.next_back().expect("a line");
        assert!(
            last.contains("not found: no match") && !is_debug(last),
            "{hidden:?}: {last}"
        );
    }
}

#[test]
fn a_rival_of_a_finding_is_named_as_such_and_what_is_found_besides_is_listed() {
    let plan = plan(Hidden::Trap, Sizes::Visible, SECONDS, 1);
    let all = planted(&plan.run, START_S);
    let channel = all[0].channels[0];
    let rival = Alternative {
        cause: "telegraph".into(),
        log_odds: -1.0,
    };
    let named = Finding {
        cause: "gauss_markov".into(),
        channels: vec![channel.into()],
        alternatives: vec![rival],
        ..Finding::default()
    };
    let other = Finding {
        cause: "line".into(),
        channels: vec!["gyro_y".into()],
        ..Finding::default()
    };
    let comparison = compare(&all, &diagnosis(vec![named, other]));
    assert_eq!(comparison.items[0].named, Named::Rival);
    assert!(comparison.items[0].matches);
    assert_eq!(comparison.besides, ["line on gyro_y"]);
    let text = comparison.lines().join("\n");
    assert!(text.contains("as a rival of gauss_markov"), "{text}");
    assert!(text.contains("found besides: line on gyro_y"), "{text}");
}

#[test]
fn another_axis_is_no_match_and_nothing_planted_and_nothing_found_is_one() {
    let hidden = plan(Hidden::Tempco, Sizes::Visible, SECONDS, 5);
    let all = planted(&hidden.run, START_S);
    let mut elsewhere = finding(&all[0], 0.0);
    elsewhere.channels = vec!["gyro_z".into()];
    assert_ne!(all[0].channels, ["gyro_z"]);
    assert!(!compare(&all, &diagnosis(vec![elsewhere.clone()])).items[0].matches);

    let sound = plan(Hidden::None, Sizes::Visible, SECONDS, 5);
    assert_eq!(sound.hidden, "nothing");
    let none = planted(&sound.run, START_S);
    assert_eq!(
        compare(&none, &diagnosis(vec![])).lines(),
        ["planted nothing, found nothing: match"]
    );
    let alarm = compare(&none, &diagnosis(vec![elsewhere]));
    assert_eq!(
        alarm.lines(),
        ["planted nothing, found temperature on gyro_z: no match"]
    );
}

/// What is said of when a bias steps is when the readings do, by the time that a record counts from its first sample.
#[test]
fn a_step_is_planted_where_the_readings_show_it() {
    for seed in 1..=8 {
        let mut plan = plan(Hidden::Knock, Sizes::Visible, 60.0, seed);
        let mut gyro = 0;
        for fault in &mut plan.run.scenario.faults {
            if let bench::Fault::Knock {
                step_dps,
                tilt_deg,
                gyro: own,
                ..
            } = fault
            {
                (*step_dps, *tilt_deg, gyro) = (60.0, 0.0, *own);
            }
        }
        let (record, _) = run_native(&plan, |_| {});
        let first = record.host_time_s.as_ref().expect("times")[0];
        let said = &planted(&plan.run, first - ON_ITS_WAY_S)[0];
        let time = said.sizes.iter().find(|size| size.parameter == "time");
        let time = time.expect("a time").value;
        let values = &record.channel(GYROS[gyro]).expect("a gyro").values;
        let behind = values.iter().position(|v| *v > 30.0).expect("a step");
        // Half of the step is read between two samples of 20 Hz.
        let (from, to) = (0.05 * (behind as f64 - 1.0), 0.05 * behind as f64);
        // The part takes 256 samples a second.
        let within = 1.0 / 256.0;
        assert!(
            (from - within..to + within).contains(&time),
            "seed {seed}: {time} is not between {from} and {to}"
        );
    }
}
