//! docs/effects.md, made of what every effect says about itself.

use std::fmt::Write as _;

use crate::effect::Effect;
use crate::effects::EFFECTS;
use crate::file::{EffectModel, ModelFile};
use crate::parameter::Parameter;

/// Length of the examples, s.
pub const EXAMPLE_SECONDS: f64 = 600.0;
/// Seed of the examples.
pub const EXAMPLE_SEED: u64 = 1;

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

/// The example in words.
fn caption(effect: &dyn Effect) -> String {
    let example = effect.docs().example;
    let parameters: Vec<String> = example
        .parameters
        .iter()
        .map(|(name, value)| {
            let spec = effect.parameters().iter().find(|s| s.name == *name);
            match spec.map_or("1", |s| s.unit) {
                "1" => format!("`{name}` {value}"),
                unit => format!("`{name}` {value} {unit}"),
            }
        })
        .collect();
    let world: Vec<String> = example
        .world
        .iter()
        .map(|(key, value)| format!("`{key}` {value}"))
        .collect();
    let world = if world.is_empty() {
        String::new()
    } else {
        format!(", in a world with {}", world.join(", "))
    };
    let on = if example.channels.is_empty() {
        "all axes".to_owned()
    } else {
        example.channels.join(", ")
    };
    format!("*Simulated: {} on {on}{world}.*", parameters.join(", "))
}

/// Two causes that may look the same, each pair once, and what to record to tell them apart: as rows of a table.
fn rivals(out: &mut String) {
    out.push_str(
        "\n## Telling two causes apart\n\nWhat to record where a diagnosis says that a record leaves both open.\n\n\
         | this | or that | record |\n|---|---|---|\n",
    );
    let mut known: Vec<[&str; 2]> = Vec::new();
    for e in EFFECTS {
        for r in e.rivals() {
            let mut pair = [e.id(), r.cause];
            pair.sort_unstable();
            if !known.contains(&pair) {
                known.push(pair);
                let _ = writeln!(out, "| `{}` | `{}` | {} |", e.id(), r.cause, r.experiment);
            }
        }
    }
}

/// The text of docs/effects.md.
#[must_use]
pub fn effects_markdown() -> String {
    let mut out = String::from(
        "# The effects\n\n\
         Made of `crates/model/src/effects/`, a file for each, by `cargo xtask effects`; how a cause is tested stands there \
         (`Docs::test`). Each figure is a simulated run of the paper's stand, {SECONDS} s at {RATE} Hz with seed {SEED}, \
         beside the same run without the effect.\n",
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
        for p in e.parameters() {
            let meaning = if p.required {
                p.meaning.to_owned()
            } else {
                format!("{} (optional)", p.meaning)
            };
            let _ = writeln!(out, "- `{}` ({}): {meaning}", p.name, p.unit);
        }
        let _ = write!(
            out,
            "- Needs: {}\n- What to do: {}\n\n![{}](figures/effects/{}.svg)\n\n{} {}\n",
            docs.excitation,
            docs.remedy,
            docs.title,
            e.id(),
            docs.figure,
            caption(*e)
        );
    }
    rivals(&mut out);
    out
}
