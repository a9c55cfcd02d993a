//! Long runs: days of the board's time through logic and image, hours of a live capture on a bad line.

use std::path::Path;

use crate::cargo;
use crate::step::{Failure, run};

const HELP: &str = "--quick for minutes; --hours N of the board's time (720 through its logic; through the image a thirtieth of \
                    it), --minutes N of a live capture (1440), --seed N, and --only logic, image or line";

/// How long and what.
pub(crate) struct Plan {
    hours: f64,
    minutes: f64,
    seed: u64,
    only: Option<String>,
}

/// Options that take a value.
const VALUED: [&str; 4] = ["--hours", "--minutes", "--seed", "--only"];

pub(crate) fn plan(arguments: &[String]) -> Result<Plan, Failure> {
    let wrong = |what: &str| Failure::new(&format!("`cargo xtask soak`: {what}"), HELP);
    let mut plan = Plan {
        hours: 720.0,
        minutes: 1440.0,
        seed: 20_261_124,
        only: None,
    };
    let mut words = arguments.iter();
    while let Some(word) = words.next() {
        if word == "--quick" {
            (plan.hours, plan.minutes) = (30.0, 1.0);
            continue;
        }
        if !VALUED.contains(&word.as_str()) {
            return Err(wrong(&format!("it knows no {word}")));
        }
        let value = words.next();
        let value = value.ok_or_else(|| wrong(&format!("{word} takes a value")))?;
        let number = || {
            let number: Option<f64> = value.parse().ok();
            number
                .filter(|n| n.is_finite() && *n > 0.0)
                .ok_or_else(|| wrong(&format!("{word} takes a number above 0")))
        };
        match word.as_str() {
            "--hours" => plan.hours = number()?,
            "--minutes" => plan.minutes = number()?,
            "--seed" => plan.seed = number()? as u64,
            "--only" if ["logic", "image", "line"].contains(&value.as_str()) => {
                plan.only = Some(value.clone());
            }
            _ => return Err(wrong(&format!("it knows no {word} {value}"))),
        }
    }
    Ok(plan)
}

/// Runs them one after the other; each says how it goes, and what it saw in the end.
///
/// # Errors
/// When one finds something.
pub fn soak(root: &Path, arguments: &[String]) -> Result<(), Failure> {
    let plan = plan(arguments)?;
    let parts = [
        ("logic", "logic_for_hours", plan.hours),
        ("image", "the_image_for_hours", plan.hours / 30.0),
        ("line", "a_live_capture", plan.minutes),
    ];
    // Every part is compiled beside the simulator, which is of the workspace.
    crate::toolchain::simulator()?;
    for (name, test, amount) in parts {
        if plan.only.as_deref().is_some_and(|only| only != name) {
            continue;
        }
        if name == "image" {
            crate::build_image(root, &mut crate::step::Pace::Steady)?;
        }
        println!("== {name}");
        // The features of the workspace, so that nothing is compiled for this alone.
        let mut test_of = cargo(root, &["test", "--quiet", "--workspace", "--test", "soak"]);
        test_of.args(["--", "--nocapture", test]);
        test_of.env("IMU_STAND_SOAK_HOURS", amount.to_string());
        test_of.env("IMU_STAND_SOAK_MINUTES", amount.to_string());
        test_of.env("IMU_STAND_SEED", plan.seed.to_string());
        run(name, &mut test_of)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str) -> Result<Plan, Failure> {
        let words: Vec<String> = text.split_whitespace().map(str::to_owned).collect();
        plan(&words)
    }

    #[test]
    fn how_long_is_30_days_minutes_or_what_is_asked_for() {
        let long = of("").expect("nothing asked for");
        assert_eq!((long.hours, long.minutes), (720.0, 1440.0));
        let short = of("--quick --seed 3 --only line").expect("all known");
        assert_eq!((short.hours, short.seed), (30.0, 3));
        assert_eq!(short.only.as_deref(), Some("line"));
        for wrong in [
            "--days 3",
            "--hours",
            "--hours -1",
            "--hours nan",
            "--only sea",
        ] {
            assert!(of(wrong).is_err(), "{wrong}");
        }
    }
}
