//! The figures of docs/effects.md: a run with each effect beside the same run without it, in the view that convicts.
//!
//! An effect names the kind of its figure and the run that shows it in its own file ([`model::effect::Example`]); what is
//! drawn here knows kinds, never effects.

pub(super) mod views;

use model::docs::{EXAMPLE_SECONDS, EXAMPLE_SEED, example};
use model::effect::Effect;
use model::effects::EFFECTS;
use model::record::Record;

use super::plot::{self, PlotError};
use super::standalone::alone;

/// Why an effect has no figure.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExhibitError {
    /// Its example cannot be simulated.
    #[error("the example of {cause} cannot be simulated")]
    Simulate {
        /// The effect.
        cause: &'static str,
        /// Why.
        source: model::simulate::SimulateError,
    },
    /// The record lacks what the figure is made of.
    #[error("the figure of {cause} needs {what}, which its example does not record")]
    Lacks {
        /// The effect.
        cause: &'static str,
        /// A channel, or times.
        what: String,
    },
    /// It cannot be drawn.
    #[error(transparent)]
    Plot(#[from] PlotError),
}

/// All of docs/effects.md: the page and its figures, by their paths from the root of the project.
///
/// # Errors
/// [`ExhibitError`] for the first effect whose example does not show.
pub fn effects_page() -> Result<Vec<(String, String)>, ExhibitError> {
    let mut files = vec![(
        "docs/effects.md".to_owned(),
        model::docs::effects_markdown(),
    )];
    for effect in EFFECTS {
        let path = format!("docs/figures/effects/{}.svg", effect.id());
        files.push((path, exhibit(*effect)?));
    }
    Ok(files)
}

/// The figure of an effect.
///
/// # Errors
/// [`ExhibitError`].
pub fn exhibit(effect: &dyn Effect) -> Result<String, ExhibitError> {
    let cause = effect.id();
    let run = |with_it: bool| -> Result<Record, ExhibitError> {
        let model = example(effect, with_it);
        model::simulate(&model, EXAMPLE_SECONDS, model.rate_hz, EXAMPLE_SEED)
            .map_err(|source| ExhibitError::Simulate { cause, source })
    };
    let docs = effect.docs();
    let channel = docs.example.channels.first().copied().unwrap_or("gyro_x");
    let pair = views::Pair {
        with: &run(true)?,
        without: &run(false)?,
        labels: ["with the effect", "without it"],
        at: None,
    };
    let figure = views::figure(docs.example.plot, channel, &pair)
        .map_err(|what| ExhibitError::Lacks { cause, what })?;
    Ok(compact(&alone(docs.title, &figure)?))
}

/// The same drawing with all dots of a colour in one path, a tenth as long.
fn compact(svg: &str) -> String {
    let mut out = String::with_capacity(svg.len());
    let mut dots = String::new();
    let mut colour = String::new();
    let flush = |out: &mut String, dots: &mut String, colour: &str| {
        if !dots.is_empty() {
            let width = 2 * plot::DOT;
            *out += &format!(
                "<path d=\"{dots}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\" stroke-linecap=\"round\"/>\n"
            );
            dots.clear();
        }
    };
    for line in svg.lines() {
        let value = |key: &str| {
            let (_, rest) = line.split_once(&format!(" {key}=\""))?;
            Some(rest.split_once('"')?.0)
        };
        let dot = line.starts_with("<circle ").then(|| {
            let fill = value("fill")?;
            Some((fill, value("cx")?, value("cy")?))
        });
        if let Some(Some((fill, x, y))) = dot {
            if fill != colour {
                flush(&mut out, &mut dots, &colour);
                fill.clone_into(&mut colour);
            }
            dots += &format!("M{x} {y}h0");
        } else {
            flush(&mut out, &mut dots, &colour);
            out += line;
            out.push('\n');
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn golden_page_of_the_effects_and_its_figures() {
        let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../../");
        for (path, text) in effects_page().unwrap() {
            let there = std::fs::read_to_string(format!("{root}{path}")).unwrap_or_default();
            assert!(there == text, "{path} is old: cargo xtask effects");
            assert!(
                text.len() < 30_000 || path.ends_with(".md"),
                "{path}: {} B",
                text.len()
            );
        }
    }

    #[test]
    fn dots_of_a_colour_become_one_path_and_all_else_stays() {
        let circle = |x: i32, fill: &str| {
            format!(
                "<circle cx=\"{x}\" cy=\"7\" r=\"3\" opacity=\"1\" fill=\"{fill}\" stroke=\"none\"/>\n"
            )
        };
        let svg = format!(
            "<svg>\n{}{}{}</svg>",
            circle(1, "#111111"),
            circle(2, "#111111"),
            circle(3, "#222222")
        );
        let short = compact(&svg);
        assert!(
            short.contains("d=\"M1 7h0M2 7h0\" fill=\"none\" stroke=\"#111111\""),
            "{short}"
        );
        assert!(
            short.contains("d=\"M3 7h0\" fill=\"none\" stroke=\"#222222\""),
            "{short}"
        );
        assert!(
            short.starts_with("<svg>\n") && short.ends_with("</svg>\n"),
            "{short}"
        );
    }
}
