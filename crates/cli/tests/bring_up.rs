//! `board bring-up` on a simulated board in real time, turned by a script: the page says what was planted.
#![cfg(unix)]

mod common;

use bench::{Fault, Pose, Scenario};
use common::{Board, Swallow, assert_refused, assert_success, folder, json};

/// A hand that turns the stand about each axis in turn and then lays it on its sides, again and again: when it is asked is not
/// known beforehand. `sign` is the way of the turns.
fn hand(sign: f64) -> Scenario {
    let mut scenario = Scenario::quiet(3);
    for k in 0..60 {
        scenario = scenario.with(Fault::Shove {
            axis: k % 3,
            time_s: 9.0 + 4.0 * k as f64,
            peak_dps: sign * 60.0,
            length_s: 3.0,
        });
    }
    scenario
}

fn verdicts(answer: &serde_json::Value) -> Vec<(String, String)> {
    let steps = answer["steps"].as_array().expect("steps");
    let word =
        |step: &serde_json::Value, key: &str| step[key].as_str().unwrap_or_default().to_owned();
    steps
        .iter()
        .map(|step| (word(step, "what"), word(step, "verdict")))
        .collect()
}

#[test]
fn a_sound_board_is_found_sound_and_what_needs_a_hand_is_not_done_without_one() {
    let board = Board::start();
    let folder = folder("bring_up");
    let (page, out) = (folder.join("b.md"), folder.join("b.json"));
    let said = assert_success(&board.ask(&[
        "bring-up",
        "--no-hand",
        "--out",
        page.to_str().unwrap(),
        "--json",
        out.to_str().unwrap(),
    ]));
    assert!(said.contains("6 steps were not done"), "{said}");
    let all = verdicts(&json(&out));
    for (what, verdict) in &all {
        let by_hand = [
            "fuses",
            "motor's stop, pressed",
            "sign of",
            "accelerometers",
        ]
        .iter()
        .any(|w| what.starts_with(w));
        assert_eq!(
            verdict,
            if by_hand { "not_done" } else { "ok" },
            "{what}: {said}"
        );
    }
    assert_eq!(
        all.iter()
            .filter(|(what, _)| what.starts_with("registers"))
            .count(),
        3
    );
    let page = std::fs::read_to_string(&page).unwrap();
    for what in [
        "| supply, by the gyros |",
        "GYRO_SCALE 0x0800",
        "On a scope",
        "7.8 kHz",
        "not done",
    ] {
        assert!(page.contains(what), "no {what} in {page}");
    }
}

#[test]
fn a_weak_supply_and_a_gyro_that_is_silent_are_wrong() {
    let mut scenario = Scenario::quiet(3);
    scenario.supply.open_v = 4.6;
    scenario.stop_pressed = vec![[0.0, 1e6]];
    let scenario = scenario.with(Fault::DeadSpi {
        gyro: 1,
        start_s: 0.0,
        end_s: 1e6,
        level: true,
    });
    let board = Board::with(scenario, Swallow::default());
    let folder = folder("bring_up_wrong");
    let (page, out) = (folder.join("b.md"), folder.join("b.json"));
    let refused = board.ask(&[
        "bring-up",
        "--no-hand",
        "--out",
        page.to_str().unwrap(),
        "--json",
        out.to_str().unwrap(),
    ]);
    assert_refused(&refused, &["steps are wrong", "b.md"]);
    let wrong: Vec<String> = verdicts(&json(&out))
        .into_iter()
        .filter(|(_, v)| v == "wrong")
        .map(|(w, _)| w)
        .collect();
    for what in [
        "motor's stop, let go",
        "supply, by the gyros",
        "flags of the samples",
        "stalls and faults, as counted",
        "registers of gyro y",
        "self-test of gyro y",
    ] {
        assert!(wrong.iter().any(|w| w == what), "{what}: {wrong:?}");
    }
    assert!(
        !wrong
            .iter()
            .any(|w| w.ends_with("gyro x") || w == "sample period"),
        "{wrong:?}"
    );
    assert!(
        std::fs::read_to_string(&page)
            .unwrap()
            .contains("**wrong**")
    );
}

/// Every gyro is turned, clockwise by a `sign` of 1; the verdicts are all `expected`.
fn turned_by_hand(sign: f64, expected: &str) {
    let mut scenario = hand(sign);
    // Sides, after the turns: too late for them to matter.
    scenario.base.poses = vec![Pose {
        at_s: 300.0,
        turn_s: 2.0,
        up: [1.0, 0.0, 0.0],
    }];
    // And the stop, for a second now and then, once the board has been listened to.
    scenario.stop_pressed = (0..20)
        .map(|n| f64::from(n) * 3.0 + 6.0)
        .map(|t| [t, t + 1.0])
        .collect();
    let board = Board::with(scenario, Swallow::default());
    let folder = folder(&format!("bring_up_hand_{expected}"));
    let (page, out) = (folder.join("b.md"), folder.join("b.json"));
    let words = ["bring-up", "--within", "20", "--out"];
    let files = [page.to_str().unwrap(), "--json", out.to_str().unwrap()];
    let done = board.ask(&[&words[..], &files[..]].concat());
    let all = verdicts(&json(&out));
    let stop = all.iter().find(|(what, _)| what == "motor's stop, pressed");
    assert_eq!(stop.map(|(_, verdict)| verdict.as_str()), Some("ok"));
    let signs = all.iter().filter(|(what, _)| what.starts_with("sign of"));
    assert_eq!(signs.clone().count(), 3);
    for (what, verdict) in signs {
        assert_eq!(verdict, expected, "{what}: {}", common::said(&done));
    }
    assert_eq!(done.status.code(), Some(i32::from(sign < 0.0)));
}

#[test]
fn a_hand_that_turns_a_gyro_clockwise_is_seen() {
    turned_by_hand(1.0, "ok");
}

#[test]
fn a_gyro_that_counts_the_other_way_is_wrong() {
    turned_by_hand(-1.0, "wrong");
}
