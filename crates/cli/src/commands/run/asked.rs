//! What a run refuses, before any work.

use imu_stand::report::plot::tidy;
use miette::Result;

use super::Arguments;

/// Shortest run that is analyzed and diagnosed, s: a shorter one leaves most causes untested.
const SHORTEST_S: f64 = 60.0;

/// Longest run, s: a day.
const LONGEST_S: f64 = 86_400.0;

/// Refuses what somebody does by hand to a stand that nobody is at, and what belongs to a loop that is not closed. Not by
/// clap's `requires`, which says no reason, and nothing at all beside an option that the required one excludes.
pub fn by_hand(arguments: &Arguments) -> Result<()> {
    let by_hand = [
        ("--pose", arguments.pose.is_some()),
        ("--belt", arguments.belt != 0.0),
        ("--stop", !arguments.stop.is_empty()),
    ];
    if let Some((option, _)) = by_hand.iter().find(|(_, is_given)| *is_given) {
        misused!(
            help = "serve the board, and record it from another terminal: `imu-stand run --pty --belt 0.004 --stop 20,25`, then \
                    `imu-stand capture --port PORT --duty 120 --out capture.csv` with the PORT that it prints",
            "{option} goes with --pty: without it nobody is at the stand, and what is hidden has a course of its own"
        );
    }
    let of_loop = [
        ("--correct-by", arguments.correct_by.is_some()),
        ("--longest", arguments.longest.is_some()),
    ];
    if let Some((option, _)) = of_loop
        .iter()
        .find(|(_, is_given)| *is_given && !arguments.correct)
    {
        misused!(
            help = "add `--correct`, without --analysis, --report and --details, which are of one record",
            "{option} goes with --correct, which closes the loop"
        );
    }
    Ok(())
}

/// Whether a run of so many seconds can be answered.
pub fn length(seconds: f64) -> Result<()> {
    let help = if seconds > LONGEST_S {
        "a run lasts a day at the most: `--seconds 86400`"
    } else {
        "a run is analyzed and diagnosed, and a record under a minute is too short for that: `--seconds 60` is the \
         shortest, 600 the usual length; with --pty any length is served"
    };
    if !(SHORTEST_S..=LONGEST_S).contains(&seconds) {
        misused!(
            help = help,
            "--seconds: {} s is not within {SHORTEST_S} .. {LONGEST_S} s",
            tidy(seconds, 6)
        );
    }
    Ok(())
}

/// A length of the first record, s.
pub fn longest(text: &str) -> std::result::Result<f64, String> {
    let seconds = text
        .parse()
        .ok()
        .filter(|s| (SHORTEST_S..=LONGEST_S).contains(s));
    seconds.ok_or_else(|| format!("takes a length within {SHORTEST_S} .. {LONGEST_S} s"))
}
