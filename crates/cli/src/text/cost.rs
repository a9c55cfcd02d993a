//! What it costs to leave a cause out, in a sentence.

use diagnosis::result::{Consequence, Finding};
use model::effect::Frequencies;
use model::effects::effect;

use crate::report::plot::number;

/// An angle error that changes by less than this share of itself is not worth a sentence (design: `--matters`, percent).
const MATTERS: f64 = 0.05;
/// A smaller share is told by this limit, percent.
const LEAST_PERCENT: f64 = 0.01;
/// Digits of an angle error.
const ANGLE_DIGITS: usize = 2;

/// What leaving it out of the simulation costs; `None` where the diagnosis does not tell.
#[must_use]
pub fn cost(finding: &Finding) -> Option<String> {
    match &finding.consequence {
        Some(consequence) if finding.material && is_filter(finding) => Some(format!(
            "It takes {} off the variance of the readings, and leaves the angle as it is; without it a deviation is off by {}.",
            percent(consequence.share_of_variance),
            at_most(consequence.largest_change)
        )),
        Some(consequence) => Some(match taken(finding).filter(|_| finding.material) {
            Some(what) => format!(
                "It takes {what} from the readings; without it a deviation is off by {}.",
                at_most(consequence.largest_change)
            ),
            None => consequence_of(consequence, finding.material),
        }),
        None => cost_in_angle(finding),
    }
}

/// Whether it takes something from the noise, and adds nothing.
fn is_filter(finding: &Finding) -> bool {
    let at = Frequencies::default();
    effect(&finding.cause).is_some_and(|e| e.passes(&finding.parameters, &at).is_some())
}

/// What it takes from the readings, where that is more than noise.
fn taken(finding: &Finding) -> Option<&'static str> {
    effect(&finding.cause)?.takes()
}

/// What something does to the integrated angle and to the readings.
#[must_use]
pub fn consequence_of(of: &Consequence, material: bool) -> String {
    let (what, unit, by_horizon) = match of.velocity_rms_mps.is_empty() {
        true => ("an angle", "deg", &of.angle_rms_deg),
        false => ("a velocity", "m/s", &of.velocity_rms_mps),
    };
    if !material {
        return format!("Too small to matter for {what} or a deviation (`--matters`).");
    }
    let errors: Vec<String> = (by_horizon.iter())
        .map(|(over, v)| {
            format!(
                "{} {unit} rms over {}",
                number(*v, ANGLE_DIGITS),
                spaced(over)
            )
        })
        .collect();
    // A noise that changes its size adds nothing of its own that could be told apart.
    if of.share_of_variance <= 0.0 && by_horizon.values().all(|v| *v <= 0.0) {
        return format!(
            "It changes {what} error or a deviation by {}.",
            at_most(of.largest_change)
        );
    }
    let share = format!("{} of the variance", percent(of.share_of_variance));
    match errors.is_empty() {
        true => format!("It makes {share} of the readings."),
        false => format!(
            "It makes {what} error of {}, and {share}.",
            errors.join(", ")
        ),
    }
}

/// A share in percent, of two digits.
fn percent(share: f64) -> String {
    match 100.0 * share {
        p if p < LEAST_PERCENT => format!("less than {LEAST_PERCENT} %"),
        p => format!("{} %", number(p, 2)),
    }
}

/// The largest of some shares, in percent.
fn at_most(share: f64) -> String {
    let prefix = match 100.0 * share < LEAST_PERCENT {
        true => "",
        false => "up to ",
    };
    prefix.to_owned() + &percent(share)
}

/// The same by the angle errors that its gain states.
fn cost_in_angle(finding: &Finding) -> Option<String> {
    let gain = finding.gain.as_ref()?;
    let (what, unit, angles) = match gain.velocity_rms_mps.is_empty() {
        true => ("angle", "deg", &gain.angle_rms_deg),
        false => ("velocity", "m/s", &gain.velocity_rms_mps),
    };
    let finite = |pair: &&[f64; 2]| pair.iter().all(|v| v.is_finite());
    let mut horizons: Vec<(&String, &[f64; 2])> =
        angles.iter().filter(|(_, pair)| finite(pair)).collect();
    if horizons.is_empty() {
        return None;
    }
    // The longest first: that is where a user meets it. Keys are `10s`, `100s`.
    horizons.sort_by_key(|(over, _)| std::cmp::Reverse(over.len()));
    let matters = |[before, after]: &[f64; 2]| (before - after).abs() > MATTERS * before.abs();
    if !horizons.iter().any(|(_, pair)| matters(pair)) {
        let seconds: Vec<String> = horizons
            .iter()
            .rev()
            .map(|(over, _)| spaced(over))
            .collect();
        return Some(format!(
            "Left out, it changes the integrated {what} by less than 5 % over {}.",
            seconds.join(" and ")
        ));
    }
    let each: Vec<String> = horizons
        .iter()
        .map(|(over, [before, after])| {
            format!(
                "{} {unit} rms after {} instead of {}",
                number(*before, ANGLE_DIGITS),
                spaced(over),
                number(*after, ANGLE_DIGITS)
            )
        })
        .collect();
    Some(format!(
        "Left out, the integrated {what} is off by {}.",
        each.join(", ")
    ))
}

/// `10s` as `10 s`.
fn spaced(over: &str) -> String {
    over.strip_suffix('s')
        .map_or_else(|| over.to_owned(), |n| format!("{n} s"))
}
