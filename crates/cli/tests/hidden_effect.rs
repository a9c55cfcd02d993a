//! One of six faults of the stand, or none, is drawn at random and planted in the bench by physics; the firmware's logic
//! samples it, the frames become a capture file, and the diagnosis gets the file alone.
//!
//! The seed is fresh at each run and printed; `IMU_STAND_SEED` replays it, `IMU_STAND_DRAWS` sets how many draws.
//! Graded by rates: the test fails when what was seen has a chance below 1e-3 under the rates that are asked for.

use std::collections::BTreeMap;
use std::hash::{BuildHasher, Hasher};

use analysis::DiagnoseOptions;
use imu_stand::ReadOptions;
use imu_stand::capture::{read_from, write_to};
use imu_stand::stand::{Hidden, plan, run_native};

/// What is asked: named at least, wrong names and false alarms at most.
const NAMED: f64 = 0.90;
const WRONG: f64 = 0.10;
const FALSE_ALARM: f64 = 0.02;
/// Chance of failing an engine that just meets them.
const CHANCE: f64 = 1e-3;

const FAULTS: [(Hidden, &[&str]); 7] = [
    (Hidden::None, &[]),
    (Hidden::Tempco, &["temperature"]),
    // The motor's current sags the supply too, and is not proportional to the command while it spins up.
    (Hidden::MotorCoupling, &["motor_bias"]),
    (Hidden::SupplyCoupling, &["supply_sensitivity"]),
    (Hidden::Vibration, &["line"]),
    (Hidden::Knock, &["bias_step"]),
    (Hidden::Stall, &["stale_samples"]),
];

fn number(name: &str) -> Option<u64> {
    std::env::var(name).ok().map(|text| {
        text.parse()
            .unwrap_or_else(|_| panic!("{name} is no number: {text}"))
    })
}

/// P(X <= k) of a binomial.
fn at_most(k: usize, n: usize, p: f64) -> f64 {
    let mut term = (1.0 - p).powi(n as i32);
    let mut sum = term;
    for i in 0..k {
        term *= (n - i) as f64 / (i + 1) as f64 * p / (1.0 - p);
        sum += term;
    }
    sum.min(1.0)
}

#[test]
fn a_fault_of_the_stand_is_named_from_the_capture_alone() {
    let seed = number("IMU_STAND_SEED")
        .unwrap_or_else(|| std::hash::RandomState::new().build_hasher().finish());
    let draws = number("IMU_STAND_DRAWS").unwrap_or(28) as usize;
    println!("IMU_STAND_SEED={seed} IMU_STAND_DRAWS={draws}");
    // (draws, named, with a wrong name)
    let mut rows: BTreeMap<usize, (usize, usize, usize)> = BTreeMap::new();
    for draw in 0..draws {
        let which = draw % FAULTS.len();
        let (hidden, causes) = FAULTS[which];
        let own = seed.wrapping_add(0x9e37_79b9_7f4a_7c15u64.wrapping_mul(draw as u64 + 1));
        let plan = plan(hidden, 600.0, own);
        let (record, link) = run_native(&plan, |_| {});
        assert_eq!(link.rejected(), 0, "every frame arrives in order");
        let mut file = Vec::new();
        write_to(&mut file, &record).expect("memory takes it");
        let read = read_from(file.as_slice(), &ReadOptions::default()).expect("it is a capture");
        let options = DiagnoseOptions {
            seed: own,
            file: "hidden.csv".into(),
            hash: None,
        };
        let found = analysis::diagnose(&read.record, &options)
            .expect("600 s are enough")
            .diagnosis;
        let channel = plan
            .channel
            .map(|axis| ["gyro_x", "gyro_y", "gyro_z"][axis]);
        let is_it = |finding: &analysis::result::Finding| {
            let names = std::iter::once(finding.cause.as_str()).chain(
                finding
                    .alternatives
                    .iter()
                    .map(|rival| rival.cause.as_str()),
            );
            channel.is_some_and(|channel| finding.channels.iter().any(|c| c == channel))
                && names.into_iter().any(|name| causes.contains(&name))
        };
        let named = causes.is_empty() || found.findings.iter().any(is_it);
        let wrong = found.findings.iter().any(|finding| !is_it(finding));
        let row = rows.entry(which).or_default();
        *row = (
            row.0 + 1,
            row.1 + usize::from(named),
            row.2 + usize::from(wrong),
        );
        if !named || wrong {
            let said: Vec<String> = found
                .findings
                .iter()
                .map(|f| format!("{} on {}", f.cause, f.channels.join("+")))
                .collect();
            println!(
                "draw {draw}: hidden {}; said {}",
                plan.hidden,
                said.join(", ")
            );
        }
    }
    println!(
        "{:<16} {:>5} {:>6} {:>6}",
        "hidden", "draws", "named", "wrong"
    );
    for (which, (n, named, wrong)) in &rows {
        println!(
            "{:<16} {n:>5} {named:>6} {wrong:>6}",
            format!("{:?}", FAULTS[*which].0)
        );
    }
    let (clean, _, alarms) = rows.get(&0).copied().unwrap_or_default();
    let faulty = rows
        .iter()
        .filter(|(which, _)| **which > 0)
        .map(|(_, row)| row);
    let (n, named, wrong) = faulty.fold((0, 0, 0), |sum, row| {
        (sum.0 + row.0, sum.1 + row.1, sum.2 + row.2)
    });
    assert!(
        at_most(named, n, NAMED) > CHANCE,
        "named {named} of {n}: less than {NAMED}"
    );
    assert!(
        at_most(n - wrong, n, 1.0 - WRONG) > CHANCE,
        "a wrong name in {wrong} of {n}: more than {WRONG}"
    );
    assert!(
        at_most(clean - alarms, clean, 1.0 - FALSE_ALARM) > CHANCE,
        "false alarms in {alarms} of {clean}"
    );
}
