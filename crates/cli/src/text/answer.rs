//! A finding in sentences for a person: what it is and how large, what it costs to leave it out, what is still open.

use std::collections::{BTreeMap, BTreeSet};

use diagnosis::result::{Finding, Parameter, Unexplained};
use model::effect::Parameters;
use model::effects::{effect, wandering_line};
use model::one_source;
use model::record::Base;

use crate::report::plot::{fixed, number, tidy};
pub use crate::text::cost::{consequence_of, cost};

/// Half the width of a 95 % interval, in standard errors of a normal law.
pub const HALF_WIDTH_95: f64 = 1.96;
/// Parameters that a sentence names; the others stand in the details.
const NAMED: usize = 3;
/// The end of a remedy that asks what the base did.
const ASKED_OF_BASE: &str = " Where the base stood still, say so: --base static.";
/// What a cause is called in a headline.
#[must_use]
pub fn title(cause: &str) -> &str {
    effect(cause).map_or(cause, |e| e.docs().title)
}

/// Whether a parameter only says which law it is (`triangular`, `by_magnitude`), and is no size, or is a detail for programs.
#[must_use]
pub fn is_switch(cause: &str, name: &str, p: &Parameter) -> bool {
    let specs = effect(cause).map_or(&[][..], |e| e.parameters());
    let is_detail = specs.iter().any(|s| s.name == name && s.detail);
    let is_optional = specs.iter().any(|s| s.name == name && !s.required);
    is_detail || is_optional && p.unit == "1" && p.std_error.is_none()
}

/// What the cause is, where it acts, and its size with 95 % intervals.
#[must_use]
pub fn headline(finding: &Finding) -> String {
    let title = title(&finding.cause);
    let sizes: Vec<String> = named(finding)
        .into_iter()
        .map(|(name, p)| match *name == p.unit {
            true => found_size(&finding.cause, name, p),
            false => format!(
                "{} {}",
                name.replace('_', " "),
                found_size(&finding.cause, name, p)
            ),
        })
        .collect();
    let place = finding.channels.join(", ");
    let effective = match finding.effective {
        true => "; effective for this excitation, a static test gives more",
        false => "",
    };
    let times = match finding.occurrences.len() {
        0 => String::new(),
        count => format!("{count} times, "),
    };
    match sizes.is_empty() {
        true => format!("{place}: {title} ({})", finding.cause),
        false => format!(
            "{place}: {title} ({}), {times}{}{}{effective}",
            finding.cause,
            sizes.join("; "),
            other_tones(finding)
        ),
    }
}

/// The pitches of the other tones of a rotor.
fn other_tones(finding: &Finding) -> String {
    let pitch = |by: &BTreeMap<String, Parameters>| {
        let first = by.values().next()?.get("center_frequency")?;
        Some(without_error(first.value))
    };
    let pitches: Vec<String> = finding.harmonics.iter().filter_map(pitch).collect();
    match &pitches[..] {
        [] => String::new(),
        [one] => format!("; and a tone at {one} Hz that turns with it"),
        some => format!("; and tones at {} Hz that turn with it", some.join(", ")),
    }
}

/// What a cause of several channels is on the others, where that is not what it is on the first; and what feels the same.
#[must_use]
pub fn elsewhere(finding: &Finding) -> Option<String> {
    let said: Vec<String> = [on_others(finding), felt(finding)]
        .into_iter()
        .flatten()
        .collect();
    (!said.is_empty()).then(|| said.join(" "))
}

/// Sizes on the channels after the first that are not those on it.
fn on_others(finding: &Finding) -> Option<String> {
    let (first, others) = finding.channels.split_first()?;
    let own = finding.per_channel.get(first)?;
    let names: Vec<&String> = named(finding).into_iter().map(|(name, _)| name).collect();
    let apart = |name: &str, p: &Parameters| match (own.get(name), p.get(name)) {
        (Some(a), Some(b)) => {
            let error = a.std_error.unwrap_or(0.0).hypot(b.std_error.unwrap_or(0.0));
            a.unit != b.unit || (a.value - b.value).abs() > HALF_WIDTH_95 * error
        }
        _ => false,
    };
    let of = |channel: &String| {
        let p = finding.per_channel.get(channel)?;
        let sizes = names.iter().filter(|name| apart(name, p));
        let sizes = sizes.map(|name| {
            let size = found_size(&finding.cause, name, &p[*name]);
            format!("{} {size}", name.replace('_', " "))
        });
        let sizes: Vec<String> = sizes.collect();
        (!sizes.is_empty()).then(|| format!("on {channel} {}", sizes.join(", ")))
    };
    let sizes: Vec<String> = others.iter().filter_map(of).collect();
    (!sizes.is_empty()).then(|| format!("That is on {first}; {}.", sizes.join("; ")))
}

/// Of an oscillation: that one source makes it, and what reads that too.
fn felt(finding: &Finding) -> Option<String> {
    let all = finding.per_channel.values().chain([&finding.parameters]);
    let all: Vec<(&str, f64)> = all.flat_map(one_source::others).collect();
    let Some(least) = all.iter().map(|(_, v)| *v).reduce(f64::min) else {
        let tones = finding.per_channel.values();
        let tones = tones.filter(|p| wandering_line::is_of_rotor(p)).count();
        return (tones > 1).then(|| "One rotor shakes them.".to_owned());
    };
    let is_other = |name: &&str| !finding.channels.iter().any(|c| c == name);
    let others: BTreeSet<&str> = all.iter().map(|(name, _)| *name).filter(is_other).collect();
    let others: Vec<&str> = others.into_iter().collect();
    let shaken = match finding.channels.len() {
        1 => "it",
        _ => "them",
    };
    let read = match others[..] {
        [] => String::new(),
        [one] => format!(", which {one} reads too"),
        _ => format!(", which {} read too", others.join(", ")),
    };
    let coherence = match without_error(least).as_str() {
        "1" => "1".to_owned(),
        least => format!("at least {least}"),
    };
    Some(format!(
        "One source shakes {shaken}{read}: coherence {coherence}."
    ))
}

/// The cause, where it acts and how large it is, in a few words.
#[must_use]
pub fn brief(finding: &Finding) -> String {
    let size = named(finding)
        .into_iter()
        .next()
        .map(|(name, p)| match p.unit.as_str() {
            _ if is_count(name, p) => format!(" {:.0}", p.value),
            "1" => format!(" {}", number(p.value, 3)),
            unit => format!(" {} {unit}", number(p.value, 3)),
        });
    let place = finding.channels.join(", ");
    format!("{} on {place}{}", finding.cause, size.unwrap_or_default())
}

/// All parameters of a finding, in the order in which its effect lists them, and those of no list after them.
fn in_order(finding: &Finding) -> Vec<(&String, &Parameter)> {
    let specs = effect(&finding.cause).map_or(&[][..], |e| e.parameters());
    let place = |name: &str| specs.iter().position(|s| s.name == name);
    let mut all: Vec<_> = finding.parameters.iter().collect();
    all.sort_by_key(|(name, _)| place(name).unwrap_or(specs.len()));
    all
}

/// The parameters that say it all, where its effect names some.
fn named_first(finding: &Finding) -> Vec<(&String, &Parameter)> {
    let names = effect(&finding.cause).map_or(&[][..], |e| e.named_first(&finding.parameters));
    let each = names.iter();
    each.filter_map(|name| finding.parameters.get_key_value(*name))
        .collect()
}

/// The parameters that a table lists: what says which law it is, and no size, is left out.
#[must_use]
pub fn listed(finding: &Finding) -> Vec<(&String, &Parameter)> {
    let named = named_first(finding);
    if !named.is_empty() {
        return named;
    }
    let all = in_order(finding).into_iter();
    all.filter(|(name, p)| !is_switch(&finding.cause, name, p))
        .collect()
}

/// The parameters that say how large a finding is: those that its effect requires, then those that were estimated.
fn named(finding: &Finding) -> Vec<(&String, &Parameter)> {
    let specs = effect(&finding.cause).map_or(&[][..], |e| e.parameters());
    let required = |name: &str| specs.iter().any(|s| s.name == name && s.required);
    let estimated = |p: &Parameter| p.std_error.is_some_and(|e| e.is_finite() && e > 0.0);
    let named = named_first(finding);
    if !named.is_empty() {
        return named;
    }
    let (first, then): (Vec<_>, Vec<_>) = in_order(finding)
        .into_iter()
        .partition(|(name, _)| required(name));
    let then = then.into_iter();
    let then = then.filter(|(name, p)| estimated(p) && !is_switch(&finding.cause, name, p));
    first.into_iter().chain(then).take(NAMED).collect()
}

/// Lines that a sentence lists; the file has them all.
const LISTED: usize = 4;

/// The lines that an entry is made of, the largest first, where it is.
#[must_use]
pub fn lines(left: &Unexplained) -> Option<String> {
    let of = |line: &Parameters| {
        let (size, pitch) = (line.get("amplitude")?, line.get("frequency")?);
        Some(format!("{} at {:.4} Hz", with_interval(size), pitch.value))
    };
    let told: Vec<String> = left.lines.iter().filter_map(of).take(LISTED).collect();
    let more = match left.lines.len().saturating_sub(LISTED) {
        0 => String::new(),
        more => format!(", and {more} smaller"),
    };
    (!told.is_empty()).then(|| format!("Amplitudes: {}{more}.", told.join(", ")))
}

/// How the model has what has no name.
#[must_use]
pub fn modelled(left: &Unexplained) -> Option<String> {
    let each = left.modelled.iter().map(|domain| match domain.as_str() {
        "mean" => "its course",
        "channel" => "a slope over what was recorded",
        "spectrum" => "its spectrum",
        "variance" => "the course of its size",
        "cross" => "the correlation",
        _ => "the shape of its distribution",
    });
    let each: Vec<&str> = each.collect();
    (!each.is_empty()).then(|| format!("The model has it without a name: {}.", each.join(", ")))
}

/// What to change about the stand, the filter or the model.
///
/// Where the operator has said what the `base` did, nobody asks for it.
#[must_use]
pub fn remedy(finding: &Finding, base: Option<Base>) -> Option<String> {
    let remedy = effect(&finding.cause)?.docs().remedy;
    let remedy = match base {
        Some(_) => remedy.strip_suffix(ASKED_OF_BASE).unwrap_or(remedy),
        None => remedy,
    };
    // What is taken off is in the unit of what is read.
    let is_acc = |name: &String| name.starts_with("acc_");
    let of_accelerometers = !finding.channels.is_empty() && finding.channels.iter().all(is_acc);
    let remedy = match of_accelerometers {
        true => remedy.replace("from the rate", "from the acceleration"),
        false => remedy.to_owned(),
    };
    (!remedy.is_empty()).then(|| format!("What to do: {remedy}"))
}

/// What this record leaves open, and what to record to close it.
#[must_use]
pub fn open_question(finding: &Finding) -> Option<String> {
    let rivals: Vec<&str> = finding
        .alternatives
        .iter()
        .map(|a| a.cause.as_str())
        .collect();
    let experiment = finding.experiment.as_deref();
    match (rivals.is_empty(), experiment) {
        (true, None) => None,
        (true, Some(e)) => Some(format!("To be sure: {}.", ended(e))),
        (false, e) => Some(format!(
            "This record cannot tell it from {}.{}",
            rivals.join(", "),
            e.map_or_else(String::new, |e| format!(" To decide: {}.", ended(e)))
        )),
    }
}

/// A sentence without its full stop.
fn ended(text: &str) -> &str {
    text.trim_end_matches('.')
}

/// A parameter of an effect with its 95 % interval, which ends where the parameter does (a share at 1), and unit.
#[must_use]
pub fn size(name: &str, p: &Parameter) -> String {
    match is_count(name, p) {
        true => counted(p),
        false => between(p, model::bounds(name, &p.unit)),
    }
}

/// Whether a parameter counts samples or frames.
fn is_count(name: &str, p: &Parameter) -> bool {
    matches!(name, "count" | "clipped") && p.unit == "1"
}

/// A count with the whole numbers that its 95 % interval reaches from and to, where those are others.
fn counted(p: &Parameter) -> String {
    let half = HALF_WIDTH_95 * p.std_error.filter(|e| e.is_finite()).unwrap_or(0.0);
    let [value, low, high] = [p.value, (p.value - half).max(0.0), p.value + half].map(f64::round);
    match low < high {
        true => format!("{value} (95\u{a0}%: {low} to {high})"),
        false => value.to_string(),
    }
}

/// The same of a finding: what its effect requires was estimated, and says so where the record gives no interval; the rest
/// is a setting, as a reference temperature is.
#[must_use]
pub fn found_size(cause: &str, name: &str, p: &Parameter) -> String {
    let specs = effect(cause).map_or(&[][..], |e| e.parameters());
    let is_setting = specs.iter().any(|s| s.name == name && !s.required);
    let remark = if is_setting { "" } else { no_interval(p) };
    size(name, p) + remark
}

/// A value with its 95 % interval and unit.
#[must_use]
pub fn with_interval(p: &Parameter) -> String {
    between(p, [f64::NEG_INFINITY, f64::INFINITY]) + no_interval(p)
}

/// What is said behind a value that should have an interval and has none; a count or a code is exact.
fn no_interval(p: &Parameter) -> &'static str {
    let is_exact = matches!(p.unit.as_str(), "1" | "counts") && p.value.fract() == 0.0;
    match p.std_error.is_some_and(|e| e > 0.0 && e.is_finite()) || is_exact {
        true => "",
        false => NO_INTERVAL,
    }
}

/// What stands behind a value that the record gives no interval for.
pub const NO_INTERVAL: &str = " (no\u{a0}interval from this record)";

/// A value without an error: three digits, and those before the point, as of a time or a count.
#[must_use]
pub fn without_error(value: f64) -> String {
    match value.abs() {
        1e3..1e9 => format!("{value:.0}"),
        _ => tidy(value, 3),
    }
}

fn between(p: &Parameter, [least, most]: [f64; 2]) -> String {
    let unit = match p.unit.as_str() {
        "1" => String::new(),
        unit => format!(" {unit}"),
    };
    let error = p
        .std_error
        .filter(|e| *e > 0.0 && e.is_finite() && p.value.is_finite());
    let Some(error) = error else {
        return format!("{}{unit}", without_error(p.value));
    };
    let half = HALF_WIDTH_95 * error;
    let show = |v: f64| to_place_of(v, half);
    format!(
        "{}{unit} (95\u{a0}%: {} to {})",
        show(p.value),
        show((p.value - half).max(least)),
        show((p.value + half).min(most))
    )
}

/// A size that cannot be negative: with its interval, or the upper limit where the interval reaches 0.
#[must_use]
pub fn level(p: &Parameter) -> String {
    match upper_limit(p) {
        Some(limit) => format!("< {} {}", number(limit, 2), p.unit),
        None => with_interval(p),
    }
}

/// The upper limit of a size that cannot be negative, where its interval reaches 0.
#[must_use]
pub fn upper_limit(p: &Parameter) -> Option<f64> {
    let half = HALF_WIDTH_95 * p.std_error.filter(|e| e.is_finite())?;
    (p.value < half).then_some(p.value + half)
}

/// Digits behind the point of a value with an exponent, at most.
pub const MOST_DIGITS: i32 = 8;

/// A value to the second digit of `half`, the half width of its interval.
fn to_place_of(value: f64, half: f64) -> String {
    let exponent = |v: f64| format!("{v:.1e}").rsplit_once('e')?.1.parse::<i32>().ok();
    let place = exponent(half).unwrap_or(0) - 1;
    let size = exponent(value.abs().max(half)).unwrap_or(0);
    if (-4..9).contains(&size) && place > -10 {
        return fixed(value, (-place).max(0) as usize);
    }
    // Beside a value that is that much larger than its interval, that has no width.
    format!("{value:.*e}", (size - place).clamp(1, MOST_DIGITS) as usize)
}

#[cfg(test)]
mod tests;
