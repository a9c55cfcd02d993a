//! Which excitation tells two causes apart.

use std::collections::BTreeMap;

use miette::Result;
use model::effect::Effect;
use model::effects::{EFFECTS, effect};
use noise::discriminate::{PRESETS, separation};
use noise::plan::KnownNoise;
use serde::Serialize;

use super::sequences::tells_apart;

/// Longest record that `--separate` lays out, s.
const LONGEST_S: f64 = 36.0 * 3600.0;

/// How well one cause is told from another with one excitation.
#[derive(Debug, Serialize)]
pub struct Told {
    /// The one cause.
    pub cause: String,
    /// The other, which it is not to be taken for.
    pub rival: String,
    /// Whose size is meant.
    pub parameter: &'static str,
    /// Of that size.
    pub unit: &'static str,
    /// What the stand does meanwhile.
    pub excitation: &'static str,
    /// Length in s, smallest size shown, smallest size told apart.
    pub sizes: Vec<(f64, f64, f64)>,
    /// Why there are none.
    pub why: Option<String>,
    /// The calibration sequence that tells them apart, of `imu-stand board calibrate`.
    pub sequence: Option<&'static str>,
}

/// Lengths laid out by `--separate`, s.
#[must_use]
pub fn lengths() -> Vec<f64> {
    std::iter::successors(Some(600.0), |s| Some(s * 3.0))
        .take_while(|s| *s <= LONGEST_S)
        .collect()
}

/// The two causes of `temperature,rate_ramp`.
pub(super) fn two_causes(text: &str) -> Result<[&'static dyn Effect; 2]> {
    let causes: Vec<&str> = text.split(',').map(str::trim).collect();
    let [a, b] = causes[..] else {
        miette::bail!(
            help = "write `--separate temperature,rate_ramp`",
            "--separate: `{text}` is not two causes"
        );
    };
    if a == b {
        miette::bail!(
            help = "write `--separate temperature,rate_ramp`",
            "--separate: `{text}` is one cause twice, which nothing tells apart"
        );
    }
    let find = |id: &str| {
        effect(id).ok_or_else(|| {
            let known: Vec<&str> = EFFECTS.iter().map(|e| e.id()).collect();
            miette::miette!(
                help = format!("the causes are {}", known.join(", ")),
                "--separate: `{id}` is no cause"
            )
        })
    };
    Ok([find(a)?, find(b)?])
}

/// What each excitation of the stand tells the first from the second by.
pub(super) fn separate(
    noise: &KnownNoise,
    rate_hz: f64,
    [a, b]: [&'static dyn Effect; 2],
) -> Result<Vec<Told>> {
    let (cause, rival) = (a.id(), b.id());
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
            sequence: tells_apart(cause, rival).map(|sequence| sequence.name),
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
