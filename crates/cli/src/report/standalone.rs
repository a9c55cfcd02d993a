//! A figure as a file of its own: for a page of somebody else's.

use diagnosis::result::{Evidence, SeriesStyle};
use maud::{PreEscaped, html};

use super::plot::{self, Drawn, Figure, Layer, PlotError};

/// Height of title and legend.
const HEAD: u32 = 74;
/// Height of what they stand above.
pub(super) const HEIGHT: u32 = 400;
/// Width and height of a figure of a file.
pub const SIZE: (u32, u32) = (plot::WIDE, HEIGHT + HEAD);

/// A page with a figure and nothing else, of [`SIZE`].
#[must_use]
pub fn page(svg: &str) -> String {
    format!(
        "<!doctype html><meta charset=utf-8><style>body{{margin:0}}svg{{display:block}}</style>{svg}"
    )
}

/// The figure of an evidence.
#[must_use]
pub fn figure(evidence: &Evidence) -> Figure {
    let layers = evidence
        .series
        .iter()
        .enumerate()
        .map(|(k, series)| {
            let points: Vec<_> = series
                .x
                .iter()
                .copied()
                .zip(series.y.iter().copied())
                .collect();
            let layer = match series.style {
                SeriesStyle::Points => Layer::Points(points),
                SeriesStyle::Line => Layer::Line(points),
            };
            Drawn::new(&series.label, plot::colour(k, &series.label), layer)
        })
        .collect();
    Figure {
        x_label: evidence.x_label.clone(),
        y_label: evidence.y_label.clone(),
        log_x: evidence.log_x,
        log_y: evidence.log_y,
        width: plot::WIDE,
        height: HEIGHT,
        layers,
        ..Figure::default()
    }
}

/// A figure with title and legend on white.
///
/// # Errors
/// [`PlotError`] where it cannot be drawn.
pub(super) fn alone(title: &str, figure: &Figure) -> Result<String, PlotError> {
    let (width, height) = (figure.width, figure.height + HEAD);
    let place = format!(
        "<svg y=\"{HEAD}\" width=\"{width}\" height=\"{}\" ",
        figure.height
    );
    let drawn = figure.svg()?.replacen("<svg ", &place, 1);
    let labels: Vec<_> = figure
        .layers
        .iter()
        .filter_map(|layer| Some((layer.label.clone()?, plot::css(layer.colour))))
        .collect();
    let mut x = 88;
    let mut marks = Vec::new();
    for (label, colour) in labels {
        marks.push((x, label.clone(), colour));
        // 8 units a letter at this size, and a gap.
        x += 60 + 8 * label.chars().count() as u32;
    }
    let page = html! {
        svg xmlns="http://www.w3.org/2000/svg" viewBox=(format!("0 0 {width} {height}"))
            font-family="system-ui, sans-serif" role="img" aria-label=(title) {
            rect width=(width) height=(height) fill="#ffffff" {}
            text x="88" y="30" font-size="20" font-weight="600" fill="#1b1f24" { (title) }
            @for (x, label, colour) in &marks {
                rect x=(x) y="48" width="18" height="10" fill=(colour) {}
                text x=(x + 26) y="58" font-size="15" fill="#1b1f24" { (label) }
            }
            (PreEscaped(drawn))
        }
    };
    Ok(page.into_string())
}
