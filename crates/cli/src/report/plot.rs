//! Figures as inline SVG.

use std::ops::Range;

use maud::{Markup, html};
use plotters::coord::Shift;
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use plotters::prelude::*;

/// Width of a figure across the page, units of its view box; the page scales it.
pub const WIDE: u32 = 1100;
/// Width of one of two figures beside each other: the same size of letters at half the width.
pub const HALF: u32 = 540;

/// Size of letters, units of the view box, and the part of it by which a letter of a label advances.
const LETTERS: f64 = 15.0;
const LETTER: f64 = 0.45;
/// Radius of a dot, units of the view box.
pub const DOT: u32 = 3;

/// Colours that keep apart for colour-blind readers and in grey (Okabe and Ito).
pub const MEASURED: RGBColor = RGBColor(0x1b, 0x1f, 0x24);
/// Of the baseline model.
pub const BEFORE: RGBColor = RGBColor(0xd5, 0x5e, 0x00);
/// Of the extended model.
pub const AFTER: RGBColor = RGBColor(0x00, 0x72, 0xb2);
/// Of readings behind what is made of them.
pub const READINGS: RGBColor = RGBColor(0xa8, 0xb0, 0xb8);
const OTHERS: [RGBColor; 3] = [MEASURED, AFTER, RGBColor(0x00, 0x9e, 0x73)];
const GRID: RGBColor = RGBColor(0xe3, 0xe6, 0xea);
const INK: RGBColor = RGBColor(0x57, 0x60, 0x6a);

/// What a layer of a figure is.
#[derive(Clone, Debug)]
pub enum Layer {
    /// A line through points.
    Line(Vec<(f64, f64)>),
    /// Dots.
    Points(Vec<(f64, f64)>),
    /// The area between two curves: (x, low, high).
    Band(Vec<(f64, f64, f64)>),
}

/// A layer with its colour and legend entry.
#[derive(Clone, Debug)]
pub struct Drawn {
    /// Legend entry; without it none.
    pub label: Option<String>,
    /// Colour.
    pub colour: RGBColor,
    /// What is drawn.
    pub layer: Layer,
}

impl Drawn {
    /// A layer with a legend entry.
    #[must_use]
    pub fn new(label: &str, colour: RGBColor, layer: Layer) -> Self {
        Self {
            label: Some(label.to_owned()),
            colour,
            layer,
        }
    }

    fn points(&self) -> Box<dyn Iterator<Item = (f64, f64)> + '_> {
        match &self.layer {
            Layer::Line(points) | Layer::Points(points) => Box::new(points.iter().copied()),
            Layer::Band(points) => Box::new(
                points
                    .iter()
                    .flat_map(|(x, low, high)| [(*x, *low), (*x, *high)]),
            ),
        }
    }
}

/// A figure of one pair of axes.
#[derive(Clone, Debug, Default)]
pub struct Figure {
    /// Label of the abscissa, with unit.
    pub x_label: String,
    /// Label of the ordinate, with unit.
    pub y_label: String,
    /// Whether the abscissa is logarithmic.
    pub log_x: bool,
    /// Whether the ordinate is logarithmic.
    pub log_y: bool,
    /// Width, units of the view box: [`WIDE`] or [`HALF`].
    pub width: u32,
    /// Height, units of the view box.
    pub height: u32,
    /// Range of the ordinate; without it that of the data.
    pub y_range: Option<Range<f64>>,
    /// From back to front.
    pub layers: Vec<Drawn>,
}

/// Colour of the n-th series of a figure: that of the model it names, as everywhere in the report.
#[must_use]
pub fn colour(n: usize, label: &str) -> RGBColor {
    if label.contains("before") {
        BEFORE
    } else if label.contains("after") {
        AFTER
    } else {
        OTHERS[n % OTHERS.len()]
    }
}

/// The figure could not be drawn.
#[derive(Debug, thiserror::Error)]
#[error("the figure of {what} cannot be drawn: {why}")]
pub struct PlotError {
    what: String,
    why: String,
}

/// A colour as the page writes it.
pub(super) fn css(colour: RGBColor) -> String {
    format!("#{:02x}{:02x}{:02x}", colour.0, colour.1, colour.2)
}

impl Figure {
    /// The legend, beside the drawing and never over the data.
    #[must_use]
    pub fn legend(&self) -> Markup {
        html! {
            p.legend {
                @for drawn in &self.layers {
                    @if let Some(label) = &drawn.label {
                        @let class = match drawn.layer {
                            Layer::Line(_) => "line",
                            Layer::Points(_) => "dot",
                            Layer::Band(_) => "band",
                        };
                        span { i class=(class) style=(format!("background:{}", css(drawn.colour))) {} (label) }
                    }
                }
            }
        }
    }

    /// Draws it.
    ///
    /// # Errors
    /// [`PlotError`] when no point is finite or the drawing fails.
    pub fn svg(&self) -> Result<String, PlotError> {
        let failed = |why: &dyn std::fmt::Display| PlotError {
            what: self.y_label.clone(),
            why: why.to_string(),
        };
        let axes = [
            (
                self.log_x,
                None,
                (|p: &(f64, f64)| p.0) as fn(&(f64, f64)) -> f64,
            ),
            (self.log_y, self.y_range.clone(), |p: &(f64, f64)| p.1),
        ];
        let [x, y] = axes.map(|(log, given, of)| {
            given.or_else(|| {
                range(
                    self.layers
                        .iter()
                        .flat_map(Drawn::points)
                        .filter(|p| self.drawable(*p))
                        .map(|p| of(&p)),
                    log,
                )
            })
        });
        let (Some(x), Some(y)) = (x, y) else {
            return Err(failed(&"there is no finite point"));
        };
        let mut out = String::new();
        {
            let area =
                SVGBackend::with_string(&mut out, (self.width, self.height)).into_drawing_area();
            self.draw(&area, Axis::new(x, self.log_x), Axis::new(y, self.log_y))
                .map_err(|error| failed(&error))?;
            area.present().map_err(|error| failed(&error))?;
        }
        // The page sets the size; the view box keeps the shape.
        let fixed = format!(
            "width=\"{}\" height=\"{}\" viewBox",
            self.width, self.height
        );
        Ok(out.replacen(&fixed, "viewBox", 1))
    }

    fn drawable(&self, (x, y): (f64, f64)) -> bool {
        x.is_finite() && y.is_finite() && (!self.log_x || x > 0.0) && (!self.log_y || y > 0.0)
    }

    /// Along the upper edge of a band and back along the lower one.
    fn outline(&self, points: &[(f64, f64, f64)]) -> Vec<(f64, f64)> {
        let edge = |upper: bool| {
            let at = move |(x, low, high): &(f64, f64, f64)| (*x, if upper { *high } else { *low });
            points.iter().map(at).filter(|p| self.drawable(*p))
        };
        let mut outline: Vec<_> = edge(true).collect();
        outline.extend(edge(false).collect::<Vec<_>>().into_iter().rev());
        outline
    }

    fn draw<'a>(
        &self,
        area: &DrawingArea<SVGBackend<'a>, Shift>,
        x: Axis,
        y: Axis,
    ) -> Result<(), DrawingAreaErrorKind<<SVGBackend<'a> as DrawingBackend>::ErrorType>> {
        let (x_is_log, y_is_log) = (x.log, y.log);
        let place = |(a, b): (f64, f64)| (scaled(a, x_is_log), scaled(b, y_is_log));
        // Without a label it stands on another figure, which has the numbers.
        let below = if self.x_label.is_empty() { 0 } else { 44 };
        let letters = self.y_label.chars().count().max(1) as f64;
        let described =
            (f64::from(self.height.saturating_sub(below)) / (LETTER * letters)).min(LETTERS);
        let mut chart = ChartBuilder::on(area)
            .margin(8)
            .margin_right(18)
            .x_label_area_size(below)
            .y_label_area_size(78)
            .build_cartesian_2d(x, y)?;
        chart
            .configure_mesh()
            .x_desc(&self.x_label)
            .y_desc(&self.y_label)
            .x_labels(if self.width < WIDE { 6 } else { 12 })
            .y_labels(match self.height {
                // A strip.
                ..120 => 3,
                120..250 => 5,
                _ => 8,
            })
            .light_line_style(TRANSPARENT)
            .bold_line_style(GRID)
            .axis_style(INK)
            .label_style(("sans-serif", LETTERS).into_font().color(&INK))
            .axis_desc_style(("sans-serif", described).into_font().color(&INK))
            .draw()?;
        for drawn in &self.layers {
            let colour = drawn.colour;
            match &drawn.layer {
                Layer::Line(points) => {
                    let points: Vec<_> = points
                        .iter()
                        .filter(|p| self.drawable(**p))
                        .map(|p| place(*p))
                        .collect();
                    chart.draw_series(LineSeries::new(points, colour.stroke_width(2)))?;
                }
                Layer::Points(points) => {
                    let dots = points
                        .iter()
                        .filter(|p| self.drawable(**p))
                        .map(|p| Circle::new(place(*p), DOT, colour.filled()));
                    chart.draw_series(dots)?;
                }
                Layer::Band(points) => {
                    let outline = self.outline(points).into_iter().map(place);
                    chart.draw_series(std::iter::once(Polygon::new(
                        outline.collect::<Vec<_>>(),
                        colour.mix(0.22).filled(),
                    )))?;
                }
            }
        }
        Ok(())
    }
}

fn scaled(value: f64, log: bool) -> f64 {
    if log { value.log10() } else { value }
}

/// Range of values with a margin, in the units of the data.
fn range(values: impl Iterator<Item = f64>, log: bool) -> Option<Range<f64>> {
    let mut ends: Option<(f64, f64)> = None;
    for value in values {
        let (low, high) = ends.get_or_insert((value, value));
        (*low, *high) = (low.min(value), high.max(value));
    }
    let (low, high) = ends?;
    if log {
        return Some(low / 1.15..high * 1.15);
    }
    let margin = match high - low {
        0.0 => high.abs().max(1.0) * 0.1,
        span => span * 0.04,
    };
    Some(low - margin..high + margin)
}

/// An axis of decimal logarithms or of plain values, with labels that people write.
#[derive(Clone)]
struct Axis {
    range: Range<f64>,
    log: bool,
}

impl Axis {
    fn new(range: Range<f64>, log: bool) -> Self {
        Self {
            range: scaled(range.start, log)..scaled(range.end, log),
            log,
        }
    }
}

impl Ranged for Axis {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        let span = self.range.end - self.range.start;
        limit.0 + ((value - self.range.start) / span * f64::from(limit.1 - limit.0)).round() as i32
    }

    fn key_points<H: KeyPointHint>(&self, hint: H) -> Vec<f64> {
        if !self.log {
            return plain(self.range.clone(), hint.max_num_points());
        }
        let decades = self.range.start.floor() as i32..=self.range.end.ceil() as i32;
        let within = |at: &f64| self.range.contains(at);
        let all = |steps: &[f64]| -> Vec<f64> {
            let points = decades
                .clone()
                .flat_map(|d| steps.iter().map(move |s| f64::from(d) + s.log10()));
            points.filter(within).collect()
        };
        let fine = all(&[1.0, 2.0, 5.0]);
        if fine.len() <= hint.max_num_points().min(12) {
            fine
        } else {
            all(&[1.0])
        }
    }

    fn range(&self) -> Range<f64> {
        self.range.clone()
    }
}

fn plain(range: Range<f64>, most: usize) -> Vec<f64> {
    let span = range.end - range.start;
    let rough = span / most.max(2) as f64;
    let decade = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|s| s * decade)
        .find(|s| *s >= rough)
        .unwrap_or(rough);
    let first = (range.start / step).ceil() as i64;
    let last = (range.end / step).floor() as i64;
    (first..=last).map(|k| k as f64 * step).collect()
}

impl ValueFormatter<f64> for Axis {
    fn format_ext(&self, value: &f64) -> String {
        if self.log {
            return number(10f64.powf(*value), 1);
        }
        // As many digits as tell neighbours on this axis apart.
        let span = self.range.end - self.range.start;
        let digits = (1.5 - span.log10()).ceil().clamp(0.0, 12.0) as usize;
        let text = format!("{value:.digits$}");
        let trimmed = if text.contains('.') {
            text.trim_end_matches('0').trim_end_matches('.')
        } else {
            &text
        };
        if trimmed == "-0" {
            "0".into()
        } else {
            trimmed.to_owned()
        }
    }
}

/// A number with that many significant digits, as people write it.
#[must_use]
pub fn number(value: f64, digits: usize) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    // Of the rounded value: 0.09999996 is 0.1000, not 0.10000.
    let scientific = format!("{value:.*e}", digits.saturating_sub(1));
    let exponent: i32 = scientific
        .rsplit_once('e')
        .and_then(|(_, e)| e.parse().ok())
        .unwrap_or(0);
    if !(-4..6).contains(&exponent) {
        return scientific;
    }
    let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
    format!("{value:.decimals$}")
}

/// The same without zeros at the end: for what is known better than it is shown, a rate or a length.
#[must_use]
pub fn tidy(value: f64, digits: usize) -> String {
    let rounded: f64 = format!("{value:.*e}", digits.saturating_sub(1))
        .parse()
        .unwrap_or(value);
    if rounded != 0.0 && !PLAIN.contains(&rounded.abs()) {
        return format!("{rounded:e}");
    }
    format!("{rounded}")
}

/// Sizes outside are written with an exponent.
const PLAIN: std::ops::Range<f64> = 1e-4..1e15;

/// A number with that many places; 0 has no sign.
#[must_use]
pub fn fixed(value: f64, places: usize) -> String {
    let text = format!("{value:.places$}");
    match text.strip_prefix('-') {
        Some(zero) if zero.chars().all(|c| matches!(c, '0' | '.')) => zero.to_owned(),
        _ => text,
    }
}

/// Thins a signal to what a figure can show: the lowest and the highest of each of `columns` stretches.
#[must_use]
pub fn envelope(x: &[f64], y: &[f64], columns: usize) -> Vec<(f64, f64)> {
    let finite = |k: &usize| y[*k].is_finite();
    if y.len() <= 2 * columns {
        return (0..y.len()).filter(finite).map(|k| (x[k], y[k])).collect();
    }
    let mut out = Vec::with_capacity(2 * columns);
    for column in 0..columns {
        let rows = column * y.len() / columns..(column + 1) * y.len() / columns;
        let low = rows
            .clone()
            .filter(finite)
            .min_by(|a, b| y[*a].total_cmp(&y[*b]));
        let high = rows.filter(finite).max_by(|a, b| y[*a].total_cmp(&y[*b]));
        if let (Some(low), Some(high)) = (low, high) {
            let (first, second) = (low.min(high), low.max(high));
            out.push((x[first], y[first]));
            out.push((x[second], y[second]));
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_as_people_write_them() {
        assert_eq!(number(0.051_234, 3), "0.0512");
        assert_eq!(number(-1234.5, 3), "-1234");
        assert_eq!(number(0.099_999_96, 4), "0.1000");
        assert_eq!(number(999_999.9, 4), "1.000e6");
        assert_eq!(tidy(20.000_000_001, 6), "20");
        assert_eq!(tidy(599.75, 6), "599.75");
        assert_eq!(tidy(2.587e-11, 6), "2.587e-11");
        assert_eq!(number(3.2e-7, 2), "3.2e-7");
        assert_eq!(number(0.0, 3), "0");
    }

    #[test]
    fn an_envelope_keeps_the_extremes_and_drops_what_is_not_there() {
        let x: Vec<f64> = (0..1000).map(f64::from).collect();
        let mut y = vec![0.0; 1000];
        (y[313], y[777], y[500]) = (9.0, -4.0, f64::NAN);
        let thin = envelope(&x, &y, 50);
        assert_eq!(thin.len(), 100);
        assert!(thin.contains(&(313.0, 9.0)) && thin.contains(&(777.0, -4.0)));
        assert!(thin.iter().all(|(_, y)| y.is_finite()));
    }

    #[test]
    fn labels_of_a_plain_axis_are_round_and_inside() {
        assert_eq!(plain(-0.31..0.52, 8), [-0.2, 0.0, 0.2, 0.4]);
        assert_eq!(Axis::new(-0.3..0.5, false).format_ext(&0.2), "0.2");
        assert_eq!(Axis::new(0.01..20.0, true).format_ext(&1.0), "10");
    }

    #[test]
    fn a_figure_without_a_finite_point_is_an_error() {
        let figure = Figure {
            width: WIDE,
            height: 200,
            y_label: "rate".into(),
            layers: vec![Drawn::new(
                "a",
                MEASURED,
                Layer::Line(vec![(0.0, f64::NAN)]),
            )],
            ..Figure::default()
        };
        assert!(figure.svg().unwrap_err().to_string().contains("rate"));
    }
}
