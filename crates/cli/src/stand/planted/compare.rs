//! What was planted beside what was found.

use std::fmt::Write as _;

use diagnosis::result::{Diagnosis, Finding, Parameter};
use serde::Serialize;

use super::{Planted, Size};
use crate::text::{measured, rounded_as};

/// Standard errors on either side of an estimate that hold the truth 95 times of 100.
const NORMAL_95: f64 = 1.96;
/// What is called a match.
pub const RULE: &str = "a match: the diagnosis names the cause on the channel where it was planted, and what was planted lies within \
     1.96 standard errors (95 %) of what was found; a size that is effective for one excitation has the sign of what was planted \
     and is no larger";

/// Whether the diagnosis names what was planted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Named {
    /// As a finding.
    Found,
    /// As one of the causes that the record cannot tell from a finding.
    Rival,
    /// Not on its channel.
    NotFound,
}

/// One planted size beside the found one.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ComparedSize {
    /// Name of the parameter, as the effect has it.
    pub parameter: &'static str,
    /// Unit of all that follows.
    pub unit: &'static str,
    /// What was planted, as the effect states it.
    pub planted: f64,
    /// What was found; `None` where the finding does not state it, or there is none.
    pub found: Option<f64>,
    /// Standard error of what was found; `None` where it is a count.
    pub std_error: Option<f64>,
    /// Whether what was found is effective for this excitation: it has the sign of what was planted, and a part of its size.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub effective: bool,
    /// What was planted lies in the interval of what was found; `None` where nothing was found.
    pub matches: Option<bool>,
}

/// One planted thing beside what the diagnosis says of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Compared {
    /// The stand's physics, in a sentence.
    pub what: String,
    /// The cause that names it.
    pub cause: &'static str,
    /// The channels it is in; none where it is in the rows.
    pub channels: Vec<&'static str>,
    /// Whether it was named.
    pub named: Named,
    /// Its sizes.
    pub sizes: Vec<ComparedSize>,
    /// Why the name alone is compared; empty where sizes are.
    #[serde(skip_serializing_if = "str::is_empty")]
    pub name_alone: &'static str,
    /// The finding's name that it is a rival of.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rival_of: Option<String>,
    /// Named, and every size that both state is in its interval.
    pub matches: bool,
}

/// Everything planted beside everything found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// What is called a match.
    pub rule: &'static str,
    /// What was planted.
    pub items: Vec<Compared>,
    /// What was found besides.
    pub besides: Vec<String>,
}

/// Holds what was planted against a diagnosis.
#[must_use]
pub fn compare(planted: &[Planted], diagnosis: &Diagnosis) -> Comparison {
    let items: Vec<Compared> = planted.iter().map(|p| one(p, diagnosis)).collect();
    let is_planted = |finding: &&Finding| {
        let names = |item: &Compared| match item.named {
            Named::Found => item.cause == finding.cause,
            Named::Rival => item.rival_of.as_deref() == Some(&finding.cause),
            Named::NotFound => false,
        };
        (items.iter().zip(planted)).any(|(item, p)| names(item) && is_on(finding, p))
    };
    let named = (diagnosis.findings.iter())
        .filter(|finding| !is_planted(finding))
        .map(|finding| format!("{} on {}", finding.cause, finding.channels.join(", ")));
    let mut besides: Vec<String> = named.collect();
    for left in &diagnosis.unexplained {
        let line = format!("something unexplained on {}", left.channel);
        if !besides.contains(&line) {
            besides.push(line);
        }
    }
    Comparison {
        rule: RULE,
        items,
        besides,
    }
}

fn is_on(finding: &Finding, planted: &Planted) -> bool {
    let has = |channel: &&str| finding.channels.iter().any(|c| c == channel);
    planted.channels.iter().all(has)
}

fn one(planted: &Planted, diagnosis: &Diagnosis) -> Compared {
    let here = || (diagnosis.findings.iter()).filter(|finding| is_on(finding, planted));
    let found = here().find(|finding| finding.cause == planted.cause);
    let rival = here().find(|finding| {
        let mut rivals = finding.alternatives.iter();
        rivals.any(|rival| rival.cause == planted.cause)
    });
    let named = match (found, rival) {
        (Some(_), _) => Named::Found,
        (None, Some(_)) => Named::Rival,
        (None, None) => Named::NotFound,
    };
    let sizes: Vec<ComparedSize> = (planted.sizes.iter())
        .map(|size| sized(size, planted, found))
        .collect();
    let matches = named != Named::NotFound && sizes.iter().all(|s| s.matches != Some(false));
    Compared {
        what: planted.what.clone(),
        cause: planted.cause,
        channels: planted.channels.clone(),
        named,
        sizes,
        name_alone: planted.name_alone,
        rival_of: rival
            .filter(|_| named == Named::Rival)
            .map(|finding| finding.cause.clone()),
        matches,
    }
}

fn sized(size: &Size, planted: &Planted, found: Option<&Finding>) -> ComparedSize {
    let parameters = found.map(|finding| {
        let first = planted.channels.first();
        let own = first.and_then(|channel| finding.per_channel.get(*channel));
        own.unwrap_or(&finding.parameters)
    });
    let lacks = |name: &str| parameters.is_some_and(|all| !all.contains_key(name));
    let value = match size.without {
        Some((other, value)) if lacks(other) => value,
        _ => size.value,
    };
    let stated: Option<&Parameter> = parameters.and_then(|all| all.get(size.parameter));
    let effective = found.is_some_and(|finding| finding.effective);
    ComparedSize {
        effective,
        parameter: size.parameter,
        unit: size.unit,
        planted: value,
        found: stated.map(|p| p.value),
        std_error: stated.and_then(|p| p.std_error),
        matches: stated.map(|p| {
            let interval = NORMAL_95 * p.std_error.unwrap_or(0.0) + size.within;
            let is_part = effective && p.value * value > 0.0 && p.value.abs() <= value.abs();
            is_part || (p.value - value).abs() <= interval
        }),
    }
}

impl Comparison {
    /// As lines: what was planted, then a line for each of its sizes, or one of its name.
    #[must_use]
    pub fn lines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        for item in &self.items {
            lines.push(format!("planted: {}", item.what));
            lines.extend(item.lines());
        }
        match (self.items.is_empty(), self.besides.is_empty()) {
            (true, true) => lines.push("planted nothing, found nothing: match".to_owned()),
            (true, false) => lines.push(format!(
                "planted nothing, found {}: no match",
                self.besides.join("; ")
            )),
            (false, true) => {}
            (false, false) => lines.push(format!("found besides: {}", self.besides.join("; "))),
        }
        lines
    }
}

impl Compared {
    fn lines(&self) -> Vec<String> {
        let place = match self.channels.as_slice() {
            [] => String::new(),
            channels => format!(" on {}", channels.join(", ")),
        };
        let name = format!("{}{place}", self.cause);
        let sizes: Vec<String> = (self.sizes.iter().enumerate())
            // What an effect may leave out is no miss where it is left out; its first size it always states.
            .filter(|(number, size)| *number == 0 || size.found.is_some())
            .map(|(_, size)| format!("{name}, {}", self.sized(size)))
            .collect();
        if !sizes.is_empty() {
            return sizes;
        }
        vec![
            format!("{name}: {} by name alone", self.by_name()),
            format!("    ({})", self.name_alone),
        ]
    }

    /// What became of the name.
    fn by_name(&self) -> String {
        match (self.named, &self.rival_of) {
            (Named::Found, _) => "planted, and found: match".to_owned(),
            (Named::Rival, Some(other)) => {
                format!("planted, and found as a rival of {other}: match")
            }
            _ => "planted, not found: no match".to_owned(),
        }
    }

    fn sized(&self, size: &ComparedSize) -> String {
        let unit = match size.unit {
            "1" => String::new(),
            unit => format!(" {unit}"),
        };
        let planted = rounded_as(size.planted, size.std_error);
        let mut line = format!("{}: planted {planted}", size.parameter);
        let Some(found) = size.found else {
            let name = match (self.named, &self.rival_of) {
                (Named::Found, _) => "found, its size not stated: match by name alone".to_owned(),
                (Named::Rival, Some(other)) => {
                    format!("found as a rival of {other}: match by name alone")
                }
                _ => "not found: no match".to_owned(),
            };
            let _ = write!(line, "{unit}, {name}");
            return line;
        };
        let found_is = measured(found, size.std_error);
        let effective = match size.effective {
            true => ", effective for this excitation",
            false => "",
        };
        let _ = write!(line, ", found {found_is}{unit}{effective}: ");
        let apart = (found - size.planted).abs();
        line += &match (size.matches, size.std_error) {
            (Some(true), _) => "match".to_owned(),
            (_, Some(error)) if error > 0.0 => {
                format!("no match, {:.1} standard errors apart", apart / error)
            }
            _ => "no match".to_owned(),
        };
        line
    }
}
