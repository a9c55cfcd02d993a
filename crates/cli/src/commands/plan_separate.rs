//! `imu-stand plan --separate`: which excitation tells two causes apart.

use std::collections::BTreeMap;

use miette::Result;
use model::effects::{EFFECTS, effect};
use noise::discriminate::{PRESETS, TOLD_APART, separation};
use noise::plan::KnownNoise;
use serde::Serialize;

use super::plan::duration;

/// Longest record that `--separate` lays out, s.
const LONGEST_S: f64 = 36.0 * 3600.0;
/// How well one cause is told from another with one excitation.
#[derive(Debug, Serialize)]
pub(super) struct Told {
    cause: String,
    rival: String,
    parameter: &'static str,
    unit: &'static str,
    excitation: &'static str,
    /// Length in s, smallest size shown, smallest size told apart.
    sizes: Vec<(f64, f64, f64)>,
    /// Why there are none.
    why: Option<String>,
}

/// Lengths laid out by `--separate`, s.
fn lengths() -> Vec<f64> {
    std::iter::successors(Some(600.0), |s| Some(s * 3.0))
        .take_while(|s| *s <= LONGEST_S)
        .collect()
}

/// What each excitation of the stand tells `cause` from `rival` by.
pub(super) fn separate(
    noise: &KnownNoise,
    rate_hz: f64,
    cause: &str,
    rival: &str,
) -> Result<Vec<Told>> {
    let find = |id: &str| {
        effect(id).ok_or_else(|| {
            let known: Vec<&str> = EFFECTS.iter().map(|e| e.id()).collect();
            miette::miette!(
                help = format!("the causes are {}", known.join(", ")),
                "--separate: `{id}` is no cause"
            )
        })
    };
    let (a, b) = (find(cause)?, find(rival)?);
    let mut out = Vec::new();
    for preset in PRESETS {
        let settings: BTreeMap<String, f64> = preset
            .settings
            .iter()
            .map(|(key, value)| ((*key).to_owned(), *value))
            .collect();
        let mut told = Told {
            cause: cause.to_owned(),
            rival: rival.to_owned(),
            parameter: "",
            unit: "",
            excitation: preset.name,
            sizes: Vec::new(),
            why: None,
        };
        for seconds in lengths() {
            match separation(a, b, &settings, noise, rate_hz, seconds) {
                Ok(found) => {
                    told.parameter = found.parameter;
                    told.unit = a
                        .parameters()
                        .iter()
                        .find(|p| p.name == found.parameter)
                        .map_or("", |p| p.unit);
                    told.sizes.push((seconds, found.shown, found.told_apart));
                }
                Err(why) => told.why = Some(why),
            }
        }
        out.push(told);
    }
    Ok(out)
}

/// Prints them.
pub(super) fn print_separate(separate: &[Told]) {
    for direction in separate.chunk_by(|a, b| a.cause == b.cause) {
        let (cause, rival) = (&direction[0].cause, &direction[0].rival);
        let Some(told) = direction.iter().find(|t| !t.sizes.is_empty()) else {
            let why = direction.iter().find_map(|t| t.why.as_deref());
            say!(
                "{cause} against {rival}: {}",
                why.unwrap_or("nothing moves")
            );
            continue;
        };
        say!(
            "{cause} against {rival}: smallest {} that shows / that is not taken for {rival}, {} (d = {TOLD_APART})",
            told.parameter,
            told.unit
        );
        let lengths: String = lengths()
            .into_iter()
            .map(|s| format!("{:<20}", duration(s)))
            .collect();
        say!("    {:<62}{}", "excitation", lengths.trim_end());
        for told in direction {
            if told.sizes.is_empty() {
                let why = told.why.as_deref().unwrap_or("nothing moves");
                say!("    {:<62}{why}", told.excitation);
                continue;
            }
            let sizes: String = told
                .sizes
                .iter()
                .map(|(_, shown, apart)| {
                    let apart = if apart.is_finite() {
                        format!("{apart:.2e}")
                    } else {
                        "never".to_owned()
                    };
                    format!("{:<20}", format!("{shown:.2e} / {apart}"))
                })
                .collect();
            say!("    {:<62}{}", told.excitation, sizes.trim_end());
        }
        let first = |t: &&Told| t.sizes.first().map_or(f64::INFINITY, |s| s.2);
        if let Some(best) = direction
            .iter()
            .min_by(|a, b| first(a).total_cmp(&first(b)))
            .filter(|t| first(t).is_finite())
        {
            say!("    record: {}", best.excitation);
        }
    }
    say!(
        "least sizes that can work: a random walk refitted under each hypothesis takes a part of d"
    );
}
