//! The first sentence of a diagnosis: what it means for who uses the sensor's simulation.

use diagnosis::result::{Diagnosis, Finding, Unexplained, Verdict};

use super::answer;
use crate::report::plot::tidy;

/// Causes that a banner names; the cards below it have them all.
const NAMED: usize = 3;
/// Check of the record among simulations of the extended model.
const REPLICATES: &str = "replicates";

/// How an entry ends of a channel that gave too few readings.
const LEFT_OUT: &str = "it is left out";

/// The verdict as a terminal shows it: the word of the JSON, and what it means.
#[must_use]
pub fn sentence(d: &Diagnosis) -> String {
    let found = d.findings.as_slice();
    match d.verdict {
        Verdict::Adequate => {
            "adequate: white noise, random walk and a constant bias describe this record".into()
        }
        Verdict::Extended => match immaterial(found) {
            Some(small) => format!("extended: {small}"),
            None => format!("extended: the simulation lacks {}", causes(found)),
        },
        Verdict::Unexplained if found.is_empty() => match not_measured(&d.unexplained) {
            Some(channels) => format!("unexplained: {}", unmeasured(&channels)),
            None => "unexplained: the record has structure that no known cause explains".into(),
        },
        Verdict::Unexplained => match immaterial(found) {
            Some(small) => {
                format!("unexplained: something is left that no known cause explains; {small}")
            }
            None => format!(
                "unexplained: the simulation lacks {}; something is left that no known cause explains",
                causes(found)
            ),
        },
    }
}

/// The same without its first word, with the causes themselves: what stands in large letters on a report.
#[must_use]
pub fn banner(d: &Diagnosis) -> String {
    let found = d.findings.as_slice();
    let what = immaterial(found).unwrap_or_else(|| match found {
        [one] => answer::headline(one),
        all => several(all),
    });
    match d.verdict {
        Verdict::Adequate => "the model describes this run".into(),
        Verdict::Extended => what,
        Verdict::Unexplained if found.is_empty() => left_over(&d.unexplained),
        Verdict::Unexplained => match found.iter().any(|f| f.material) {
            true => format!("{}; {}", several(found), left_over(&d.unexplained)),
            false => format!("{}; {what}", left_over(&d.unexplained)),
        },
    }
}

/// How many causes there are, as the screen lists them: `2 causes, and 1 too small to matter`.
fn causes(found: &[Finding]) -> String {
    let material = found.iter().filter(|f| f.material).count();
    match found.len() - material {
        0 => count(material),
        small => format!("{}, and {small} too small to matter", count(material)),
    }
}

fn count(n: usize) -> String {
    match n {
        1 => "1 cause".to_owned(),
        n => format!("{n} causes"),
    }
}

/// What causes mean of which none matters: that a simulation does without them, and how far off it is then at most.
fn immaterial(found: &[Finding]) -> Option<String> {
    if found.is_empty() || found.iter().any(|f| f.material) {
        return None;
    }
    if found.iter().any(|f| f.consequence.is_none()) {
        return Some(format!("{} found, too small to matter", count(found.len())));
    }
    let known = || found.iter().filter_map(|f| f.consequence.as_ref());
    let largest = known().map(|c| c.largest_change).fold(0.0, f64::max);
    let of_velocity = known().filter(|c| !c.velocity_rms_mps.is_empty()).count();
    let error = match of_velocity {
        0 => "an angle error",
        n if n == found.len() => "a velocity error",
        _ => "an angle or velocity error",
    };
    let none = match found.len() {
        1 => format!(
            "it changes no {} and no",
            error.trim_start_matches("an ").trim_start_matches("a ")
        ),
        _ => format!("none of them changes {error} or an"),
    };
    Some(format!(
        "{} found that your simulation may leave out: {none} Allan deviation by more than {}",
        count(found.len()),
        at_most(largest),
    ))
}

/// A relative change in percent, rounded up to two digits.
fn at_most(change: f64) -> String {
    let percent = 100.0 * change;
    if percent < 0.01 {
        return "0.01\u{a0}%".to_owned();
    }
    let unit = 10f64.powi(percent.log10().floor() as i32 - 1);
    format!("{}\u{a0}%", tidy((percent / unit).ceil() * unit, 2))
}

/// What was found and where, the largest first.
fn several(all: &[Finding]) -> String {
    let name = |f: &Finding| {
        let title = answer::title(&f.cause);
        format!("{title} on {}", f.channels.join(", "))
    };
    let material = all.iter().filter(|f| f.material);
    let named: Vec<String> = material.take(NAMED).map(name).collect();
    match all.len() - named.len() {
        0 => named.join("; "),
        more => format!("{}; and {more} more", named.join("; ")),
    }
}

/// Whether an entry is of readings: a check saw it, or it has a size.
#[must_use]
pub fn was_read(left: &Unexplained) -> bool {
    !left.checks.is_empty() || left.rms.is_some()
}

/// Whether an entry is of a channel that gave too few readings.
pub(super) fn is_dead(left: &Unexplained) -> bool {
    !was_read(left) && left.what.ends_with(LEFT_OUT)
}

/// The channels that gave too few readings, where nothing else is left that matters.
fn not_measured(all: &[Unexplained]) -> Option<Vec<&str>> {
    let material = all.iter().filter(|u| u.material);
    let channels: Option<Vec<&str>> = material
        .map(|u| is_dead(u).then_some(u.channel.as_str()))
        .collect();
    channels.filter(|channels| !channels.is_empty())
}

fn unmeasured(channels: &[&str]) -> String {
    format!(
        "{} gave too little to conclude anything from; of the other channels nothing is left unexplained",
        channels.join(", ")
    )
}

/// What no known cause explains: the largest of it.
fn left_over(all: &[Unexplained]) -> String {
    if let Some(channels) = not_measured(all) {
        return unmeasured(&channels);
    }
    let Some(left) = all.iter().find(|u| u.material) else {
        return "something is left that no known cause explains".to_owned();
    };
    if left.checks.iter().any(|check| check == REPLICATES) || left.what.contains("replicates") {
        return format!(
            "no known cause explains all of {}: simulations of the model differ from it",
            left.channel
        );
    }
    // What it is stands before its size and its nearest names.
    let what = left.what.split(';').next().unwrap_or(&left.what);
    format!("no known cause explains this on {}: {what}", left.channel)
}

#[cfg(test)]
mod tests {
    use super::*;
    use diagnosis::result::Consequence;

    fn finding(cause: &str, change: f64, material: bool) -> Finding {
        Finding {
            cause: cause.into(),
            channels: vec!["gyro_z".into()],
            consequence: Some(Consequence {
                largest_change: change,
                ..Consequence::default()
            }),
            material,
            ..Finding::default()
        }
    }

    fn diagnosis(verdict: Verdict, findings: Vec<Finding>, left: Vec<Unexplained>) -> Diagnosis {
        let empty = serde_json::json!({
            "format": "", "input": {"file": "", "seconds": 1.0, "rate_hz": 1.0, "samples": 1, "channels": []},
            "baseline": {}, "checks": [], "findings": [], "unexplained": [], "not_tested": [], "verdict": "adequate"
        });
        Diagnosis {
            findings,
            unexplained: left,
            verdict,
            ..serde_json::from_value(empty).expect("a diagnosis")
        }
    }

    fn said(d: &Diagnosis) -> [String; 2] {
        [sentence(d), banner(d)].map(|s| s.replace('\u{a0}', " "))
    }

    #[test]
    fn causes_of_which_none_matters_may_be_left_out_and_the_sentence_says_how_far_off_that_is() {
        let both = vec![
            finding("low_pass", 0.0312, false),
            finding("shock", 0.002, false),
        ];
        let what = "2 causes found that your simulation may leave out: none of them changes an angle error or an Allan \
                    deviation by more than 3.2 %";
        let d = diagnosis(Verdict::Extended, both, vec![]);
        assert_eq!(said(&d), [format!("extended: {what}"), what.to_owned()]);
        let one = vec![finding("low_pass", 0.03, false)];
        let what = "1 cause found that your simulation may leave out: it changes no angle error and no Allan deviation by \
                    more than 3 %";
        let d = diagnosis(Verdict::Extended, one.clone(), vec![]);
        assert_eq!(said(&d), [format!("extended: {what}"), what.to_owned()]);
        // Without its consequence nothing is promised.
        let mut unknown = one.clone();
        unknown[0].consequence = None;
        let [short, _] = said(&diagnosis(Verdict::Extended, unknown, vec![]));
        assert_eq!(short, "extended: 1 cause found, too small to matter");
        // Beside something that matters and has no name.
        let left = Unexplained {
            channel: "gyro_x".into(),
            what: "noise that comes in spells; 0.1 deg/s rms".into(),
            rms: Some(0.1),
            material: true,
            ..Unexplained::default()
        };
        let [short, long] = said(&diagnosis(Verdict::Unexplained, one, vec![left]));
        assert_eq!(
            short,
            format!("unexplained: something is left that no known cause explains; {what}")
        );
        assert_eq!(
            long,
            format!("no known cause explains this on gyro_x: noise that comes in spells; {what}")
        );
    }

    #[test]
    fn causes_that_matter_are_counted_or_named_before_those_that_do_not() {
        let all = vec![
            finding("motor_bias", 2.0, true),
            finding("low_pass", 0.01, false),
        ];
        let [short, long] = said(&diagnosis(Verdict::Extended, all, vec![]));
        assert_eq!(
            short,
            "extended: the simulation lacks 1 cause, and 1 too small to matter"
        );
        assert_eq!(long, "Motor shifts the bias on gyro_z; and 1 more");
    }

    #[test]
    fn a_channel_without_readings_is_no_structure() {
        let dead = Unexplained {
            channel: "gyro_x".into(),
            what: "0 readings, of which 600 are needed; it is left out".into(),
            material: true,
            ..Unexplained::default()
        };
        let what = "gyro_x gave too little to conclude anything from; of the other channels nothing is left unexplained";
        let d = diagnosis(Verdict::Unexplained, vec![], vec![dead]);
        assert_eq!(said(&d), [format!("unexplained: {what}"), what.to_owned()]);
    }

    #[test]
    fn a_model_that_its_own_simulations_refute_is_said_to_be_one_in_plain_words() {
        let left = Unexplained {
            channel: "gyro_x".into(),
            what: "the replicates of the model do not hold the record (chance at most 0.005): kurtosis 3.7".into(),
            rms: Some(0.1),
            material: true,
            ..Unexplained::default()
        };
        let [_, long] = said(&diagnosis(Verdict::Unexplained, vec![], vec![left]));
        assert_eq!(
            long,
            "no known cause explains all of gyro_x: simulations of the model differ from it"
        );
    }
}
