//! The figures of one channel, measured and simulated: Allan deviation, angle, signal.

use maud::{Markup, PreEscaped, html};

use super::plot::{self, AFTER, BEFORE, Drawn, Figure, Layer, MEASURED, number};
use super::replicates::{self, Against};
use super::{ReportError, at_two_widths};

/// Width of the figure of a signal, units of its view box.
const SIGNAL: u32 = 880;
/// Columns of a thinned signal.
const COLUMNS: usize = 700;
/// One channel, measured and simulated.
pub(super) struct View<'a> {
    pub name: &'a str,
    pub unit: &'a str,
    pub values: &'a [f64],
    pub simulated: [&'a [f64]; 2],
    pub tau0: f64,
    pub extended: bool,
}

impl View<'_> {
    pub fn figures(
        &self,
        own: &replicates::Curves,
        at: &replicates::Abscissae,
        against: &[Against; 2],
    ) -> Result<Markup, ReportError> {
        let [before, after] = against;
        let name = self.name;
        let same = !self.extended;
        Ok(html! {
            .pair {
                figure {
                    (self.allan(own, at, against)?)
                    figcaption {
                        b { "Overlapping Allan deviation" } " of " code { (name) } ", up to a tenth of the run. The bands "
                        "hold whole curves, not points. Chance of a curve as far off: "
                        (chance(before))
                        @if !same { " before, " (chance(after)) " after" }
                        "."
                    }
                }
                figure {
                    (self.angle(own, at, against)?)
                    figcaption {
                        b { (capitalised(model::integral::of(self.unit).0)) " by integration" } ", less the mean of the first " (number(at.calibration_s, 2))
                        " s. Bands hold 95 % of the replicates at each instant."
                        @if self.angle_range(own, against).is_some() {
                            " " b.before { "Before" } " leaves the figure: its band reaches "
                            (two_digits(reach(&before.angle))) " " (model::integral::of(self.unit).1) "."
                        }
                    }
                }
            }
            figure {
                (self.signal()?)
                figcaption {
                    b { "Signal. " }
                    "Measured, then simulated by the "
                    @if same { "model" } @else { "model before and after the extension" }
                    ", on one scale. Alike to the eye is no test: the figures above are."
                }
            }
        })
    }

    fn signal(&self) -> Result<Markup, ReportError> {
        let time: Vec<f64> = (0..self.values.len())
            .map(|k| k as f64 * self.tau0)
            .collect();
        let mut panels = vec![("measured", MEASURED, self.values)];
        if self.extended {
            panels.push(("simulated before", BEFORE, self.simulated[0]));
            panels.push(("simulated after", AFTER, self.simulated[1]));
        } else {
            panels.push(("simulated", AFTER, self.simulated[1]));
        }
        let finite = || {
            panels
                .iter()
                .flat_map(|(_, _, values)| values.iter())
                .copied()
                .filter(|v| v.is_finite())
        };
        let (low, high) = (
            finite().fold(f64::MAX, f64::min),
            finite().fold(f64::MIN, f64::max),
        );
        let margin = ((high - low) * 0.04).max(f64::MIN_POSITIVE);
        let last = panels.len() - 1;
        let mut legend = Figure::default();
        let mut out = Vec::new();
        for (k, (label, colour, values)) in panels.iter().enumerate() {
            let curve = Layer::Line(plot::envelope(&time, values, COLUMNS));
            let figure = Figure {
                x_label: if k == last {
                    "time, s".into()
                } else {
                    String::new()
                },
                y_label: self.unit.to_owned(),
                // Narrower than the page: its letters can be read in print.
                width: SIGNAL,
                height: if k == last { 104 } else { 60 },
                y_range: (low < high).then_some(low - margin..high + margin),
                layers: vec![Drawn::new(label, *colour, curve)],
                ..Figure::default()
            };
            out.push(figure.svg()?);
            legend.layers.extend(figure.layers);
        }
        Ok(html! { (legend.legend()) @for panel in out { (PreEscaped(panel)) } })
    }

    fn bands(&self, x: &[f64], of: impl Fn(usize) -> replicates::Band) -> Vec<Drawn> {
        let shown: &[(usize, &str, _)] = if self.extended {
            &[(0, "before", BEFORE), (1, "after", AFTER)]
        } else {
            &[(1, "model", AFTER)]
        };
        let mut layers = Vec::new();
        for (k, label, colour) in shown {
            let band = of(*k);
            let area = x
                .iter()
                .zip(band.low.iter().zip(&band.high))
                .map(|(x, (low, high))| (*x, *low, *high))
                .collect();
            layers.push(Drawn::new(label, *colour, Layer::Band(area)));
        }
        layers
    }

    fn allan(
        &self,
        own: &replicates::Curves,
        at: &replicates::Abscissae,
        against: &[Against; 2],
    ) -> Result<Markup, ReportError> {
        let mut layers = self.bands(&at.tau_s, |k| against[k].adev.clone());
        let points: Vec<_> = at
            .tau_s
            .iter()
            .zip(&own.ln_adev)
            .map(|(tau, ln)| (*tau, ln.exp()))
            .collect();
        layers.push(Drawn {
            label: None,
            colour: MEASURED,
            layer: Layer::Line(points.clone()),
        });
        layers.push(Drawn::new("measured", MEASURED, Layer::Points(points)));
        let figure = Figure {
            x_label: "cluster time, s".into(),
            y_label: format!("deviation, {}", self.unit),
            log_x: true,
            log_y: true,
            width: plot::HALF,
            height: 380,
            layers,
            ..Figure::default()
        };
        at_two_widths(&figure)
    }

    /// The scale of the angle where that of the band before would hide what was measured, and the model after; nothing where
    /// the figure holds all of it.
    fn angle_range(
        &self,
        own: &replicates::Curves,
        [before, after]: &[Against; 2],
    ) -> Option<std::ops::Range<f64>> {
        /// Times the height of the rest from which on the band before is cut off.
        const HIDES: f64 = 8.0;
        /// Share of that height which is left free on either side.
        const MARGIN: f64 = 0.25;
        let shown = (own.angle.iter())
            .chain(&after.angle.low)
            .chain(&after.angle.high);
        let finite = shown.copied().filter(|v| v.is_finite());
        let (low, high) = finite.fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v), h.max(v)));
        let height = high - low;
        let hides = self.extended && height > 0.0 && reach(&before.angle) > HIDES * height;
        hides.then_some(low - MARGIN * height..high + MARGIN * height)
    }

    fn angle(
        &self,
        own: &replicates::Curves,
        at: &replicates::Abscissae,
        against: &[Against; 2],
    ) -> Result<Markup, ReportError> {
        let y_range = self.angle_range(own, against);
        let mut layers = self.bands(&at.angle_s, |k| {
            let mut band = against[k].angle.clone();
            if let Some(range) = &y_range {
                let all = band.low.iter_mut().chain(&mut band.high);
                all.for_each(|v| *v = v.clamp(range.start, range.end));
            }
            band
        });
        let points = at.angle_s.iter().copied().zip(own.angle.iter().copied());
        layers.push(Drawn::new(
            "measured",
            MEASURED,
            Layer::Line(points.collect()),
        ));
        let (integral, unit) = model::integral::of(self.unit);
        let figure = Figure {
            x_label: "time since the calibration, s".into(),
            y_label: format!("{integral}, {unit}"),
            y_range,
            width: plot::HALF,
            height: 380,
            layers,
            ..Figure::default()
        };
        at_two_widths(&figure)
    }
}

/// To two digits, of a number that may be large: 28000.
fn two_digits(value: f64) -> String {
    let unit = 10f64.powf(value.log10().floor() - 1.0).max(1.0);
    number((value / unit).round() * unit, 2)
}

/// How far from 0 a band reaches.
fn reach(band: &replicates::Band) -> f64 {
    let edges = band.low.iter().chain(&band.high);
    edges
        .copied()
        .filter(|v| v.is_finite())
        .fold(0.0, |most, v| f64::max(most, v.abs()))
}

fn capitalised(word: &str) -> String {
    let first = word.chars().next().into_iter().flat_map(char::to_uppercase);
    first.chain(word.chars().skip(1)).collect()
}

/// A chance as a reader wants it: never 0, because replicates are finite.
fn chance(of: &Against) -> String {
    let (p, floor) = (of.adev_p, 1.0 / (of.replicates as f64 + 1.0));
    if p <= floor * 1.001 {
        format!("at most {}", number(floor, 1))
    } else {
        number(p, 2)
    }
}
