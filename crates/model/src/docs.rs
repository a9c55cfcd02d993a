//! docs/effects.md, made of what every effect says about itself.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use crate::effect::{Effect, ParameterSpec};
use crate::effects::EFFECTS;
use crate::file::{EffectModel, ModelFile};
use crate::parameter::Parameter;

/// Length of the examples, s.
pub const EXAMPLE_SECONDS: f64 = 600.0;
/// Seed of the examples.
pub const EXAMPLE_SEED: u64 = 1;

/// What an effect says that any record shows.
const ANY_RECORD: &str = "Nothing.";

/// The run that shows an effect: the stand of the paper with it, or the same without it.
#[must_use]
pub fn example(effect: &dyn Effect, with_it: bool) -> ModelFile {
    let example = effect.docs().example;
    let unit = |name: &str| {
        let spec = effect.parameters().iter().find(|s| s.name == name);
        spec.map_or("1", |s| s.unit)
    };
    let parameter =
        |(name, value): &(&str, f64)| ((*name).to_owned(), Parameter::exact(*value, unit(name)));
    let mut model = ModelFile::paper();
    let world = example.world.iter().map(|(k, v)| ((*k).to_owned(), *v));
    model.excitation.extend(world);
    if with_it {
        model.effects.push(EffectModel {
            cause: effect.id().to_owned(),
            channels: example.channels.iter().map(|c| (*c).to_owned()).collect(),
            parameters: example.parameters.iter().map(parameter).collect(),
        });
    }
    model
}

/// Two causes that may look the same, each pair once, and what to record to tell them apart: as rows of a table.
fn rivals(out: &mut String) {
    out.push_str(
        "\n## Telling two causes apart\n\nWhat to record where a diagnosis says that a record leaves both open.\n\n\
         | this | or that: record |\n|---|---|\n",
    );
    let mut known = BTreeSet::new();
    for e in EFFECTS {
        let others = e.rivals().iter().filter(|r| {
            let mut pair = [e.id(), r.cause];
            pair.sort_unstable();
            known.insert(pair)
        });
        let others: Vec<String> = others
            .map(|r| format!("`{}`: {}", r.cause, r.experiment))
            .collect();
        if !others.is_empty() {
            let _ = writeln!(out, "| `{}` | {} |", e.id(), others.join(". "));
        }
    }
}

/// Whether `text` is `x` with the axis x replaced by `axis`, as a name of its own or at the end of one.
fn is_of_axis(x: &str, text: &str, axis: &str) -> bool {
    let words = |s: &str| -> Vec<String> { s.split([' ', '_']).map(str::to_owned).collect() };
    let (x, text) = (words(x), words(text));
    let same = |(a, b): (&String, &String)| a == b || (a == "x" && b == axis);
    x.len() == text.len() && x != text && x.iter().zip(&text).all(same)
}

/// How many parameters from the first on are those of x, y and z: they stand in one line.
fn axes(parameters: &[ParameterSpec]) -> usize {
    let [x, y, z, ..] = parameters else { return 1 };
    let like = |p: &ParameterSpec, axis: &str| {
        (p.unit, p.required) == (x.unit, x.required)
            && is_of_axis(x.name, p.name, axis)
            && is_of_axis(x.meaning, p.meaning, axis)
    };
    if like(y, "y") && like(z, "z") { 3 } else { 1 }
}

/// The parameters as a list.
fn parameters(out: &mut String, mut left: &[ParameterSpec]) {
    while let Some(p) = left.first() {
        let details = left
            .iter()
            .take_while(|other| p.detail && other.detail)
            .count();
        let count = axes(left).max(details);
        let optional = if p.required { "" } else { " (optional)" };
        let of_axes = match left.get(count - 1) {
            Some(last) if details > 1 => format!("; the same up to `{}`", last.name),
            Some(_) if count > 1 => "; the same for y and z".to_owned(),
            _ => String::new(),
        };
        let _ = writeln!(
            out,
            "- `{}` ({}): {}{of_axes}{optional}",
            p.name, p.unit, p.meaning
        );
        left = &left[count..];
    }
}

/// The text of docs/effects.md.
#[must_use]
pub fn effects_markdown() -> String {
    let mut out = String::from(
        "# The effects\n\n\
         Made of `crates/model/src/effects/`, a file for each, by `cargo xtask effects`; how a cause is tested stands there \
         (`Docs::test`). Each figure is a simulated run of the paper's stand (`Docs::example`), {SECONDS} s at {RATE} Hz \
         with seed {SEED}, beside the same run without the effect.\n",
    );
    for (key, value) in [
        ("{SECONDS}", EXAMPLE_SECONDS.to_string()),
        ("{RATE}", ModelFile::paper().rate_hz.to_string()),
        ("{SEED}", EXAMPLE_SEED.to_string()),
    ] {
        out = out.replace(key, &value);
    }
    for e in EFFECTS {
        let docs = e.docs();
        let _ = write!(
            out,
            "\n## {}\n\n{}. {}\n\n",
            e.id(),
            docs.title,
            docs.physics
        );
        parameters(&mut out, e.parameters());
        if docs.excitation != ANY_RECORD {
            let _ = writeln!(out, "- Needs: {}", docs.excitation);
        }
        let _ = write!(
            out,
            "- Remedy: {}\n\n![{1}](figures/effects/{1}.svg)\n\n{2}\n",
            docs.remedy,
            e.id(),
            docs.figure
        );
    }
    rivals(&mut out);
    out
}
