//! The report: one self-contained HTML file, verdict first, then the figures that it rests on.

mod channel;
mod convict;
pub mod exhibits;
pub mod plot;
pub mod replicates;
mod shock;
pub mod standalone;
mod tables;

use diagnosis::result::Diagnosed;
use maud::{DOCTYPE, Markup, PreEscaped, html};
use model::file::ModelFile;
use model::record::sampling::Sampling;
use model::record::{Record, rows};

use crate::text::verdict;
use channel::View;
use plot::Figure;
use replicates::Places;

/// Replicates behind the bands, and the fewest of a long record: the outermost of 39 hold 95 % on both sides.
const REPLICATES: usize = 199;
const FEWEST: usize = 39;
/// Rows that are simulated for the bands of one model where that leaves enough replicates: seconds of one core.
const DRAWN: usize = 35_000_000;
const STYLE: &str = include_str!("style.css");

/// What a report is made of.
#[derive(Clone, Copy, Debug)]
pub struct Subject<'a> {
    /// The record.
    pub record: &'a Record,
    /// What was found in it.
    pub diagnosed: &'a Diagnosed,
    /// Sample rate given by the user, Hz.
    pub rate_hz: Option<f64>,
    /// The command that makes this report again.
    pub command: &'a str,
    /// Seed of whatever is random.
    pub seed: u64,
    /// Digest of the file.
    pub hash: Option<&'a str>,
    /// What was hidden in the stand, where it was a simulated one, beside what was found of it: lines of text.
    pub hidden: Option<&'a str>,
}

/// Why there is no report.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReportError {
    /// A figure cannot be drawn.
    #[error(transparent)]
    Plot(#[from] plot::PlotError),
    /// The record has no rate.
    #[error(transparent)]
    Analysis(#[from] model::record::AnalysisError),
}

/// What is drawn of a record: bursts are, end to end.
fn drawn<'a>(subject: &Subject<'a>, joined: Option<&'a (Record, f64, Diagnosed)>) -> Subject<'a> {
    match joined {
        Some((record, rate_hz, diagnosed)) => Subject {
            record,
            rate_hz: Some(*rate_hz),
            diagnosed,
            ..*subject
        },
        None => *subject,
    }
}

/// The figures that convict, as files: `cause-channel.svg` and the SVG, with title and legend on white.
///
/// # Errors
/// [`ReportError`].
pub fn figure_files(subject: &Subject<'_>) -> Result<Vec<(String, String)>, ReportError> {
    let joined = end_to_end(subject);
    convict::files(&drawn(subject, joined.as_ref()))
}

/// Makes the report.
///
/// # Errors
/// [`ReportError`].
pub fn report(subject: &Subject<'_>) -> Result<String, ReportError> {
    let diagnosis = &subject.diagnosed.diagnosis;
    let joined = end_to_end(subject);
    let drawn = drawn(subject, joined.as_ref());
    let channels = channels(&drawn)?;
    let convicting = convict::figures(&drawn)?;
    let title = format!("{}: {}", diagnosis.input.file, verdict::banner(diagnosis));
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                (tables::verdict(subject, &verdict::banner(diagnosis)))
                @if !convicting.is_empty() {
                    section {
                        h2 { "The evidence for each cause" }
                        .evidence { @for figure in &convicting { (figure) } }
                    }
                }
                (tables::noise(subject))
                section {
                    h2 { "The measurement beside its simulation" }
                    p.lead {
                        "Both models are simulated in the world that the run saw: its temperatures, supply, motor "
                        "command and accelerations. " b.before { "Before" } " is white noise, a random walk and a "
                        "constant bias; " b.after { "after" } " adds the causes found. Bands hold 95 % of "
                        (replicates_of(subject.record)) " replicates, with every parameter at its estimate."
                        @if subject.diagnosed.diagnosis.findings.iter().any(|f| f.cause == "base_motion") {
                            " A motion of the base is an input too: of an axis that moved, " b.after { "after" }
                            " repeats what was read below 1 Hz, and only what is faster is simulated."
                        }
                    }
                    (tables::replicates(subject))
                    @for channel in &channels { (channel) }
                }
                (tables::details(subject))
            }
        }
    };
    Ok(page.into_string())
}

/// The bursts of a record end to end, as they were diagnosed and as figures show them, with their rate, Hz; `None` of a record
/// without bursts.
fn end_to_end(subject: &Subject<'_>) -> Option<(Record, f64, Diagnosed)> {
    let (record, bursts) = rows::end_to_end(&rows::in_order(subject.record))?;
    let mut diagnosed = subject.diagnosed.clone();
    bursts.join(&mut diagnosed.baseline_model);
    bursts.join(&mut diagnosed.extended_model);
    let findings = &mut diagnosed.diagnosis.findings;
    for t in findings.iter_mut().flat_map(|f| &mut f.times_s) {
        *t = bursts.joined(*t);
    }
    Some((record, bursts.rate_hz, diagnosed))
}

/// Replicates of a record.
fn replicates_of(record: &Record) -> usize {
    (DRAWN / record.len().max(1)).clamp(FEWEST, REPLICATES)
}

/// The figures of every channel of the model, those with something to say first and open.
fn channels(subject: &Subject<'_>) -> Result<Vec<Markup>, ReportError> {
    let (record, diagnosed) = (subject.record, subject.diagnosed);
    let after = &diagnosed.extended_model;
    let said = |name: &str| {
        let d = &diagnosed.diagnosis;
        d.findings
            .iter()
            .any(|f| f.channels.iter().any(|c| c == name))
            || d.unexplained.iter().any(|u| u.channel == name)
    };
    let before = of_channels(&diagnosed.baseline_model, said);
    let sampling = Sampling::of(record, subject.rate_hz)?;
    let places_of = |model: &ModelFile| -> Vec<Option<Places>> {
        let readings = model.channels.iter().map(|c| record.channel(&c.name));
        readings
            .map(|c| c.map(|c| Places::new(&sampling, &c.values)))
            .collect()
    };
    let simulate = |model: &ModelFile, stream: u64| {
        let count = replicates_of(record);
        let places = places_of(model);
        replicates::replicate(model, record, &places, count, subject.seed ^ stream)
    };
    let first = match before.channels.is_empty() {
        true => Ok(Default::default()),
        false => simulate(&before, 0x6265_666f_7265),
    };
    let both = first.and_then(|first| Ok((first, simulate(after, 0x0061_6674_6572)?)));
    let ((one_before, all_before), (one_after, all_after)) = match both {
        Ok(both) => both,
        Err(error) => {
            return Ok(vec![html! {
                p.warning { "Not simulated: " (error) ". The bands and the simulated signal are left out." }
            }]);
        }
    };
    let mut out = Vec::new();
    for (index, (channel, places)) in after.channels.iter().zip(places_of(after)).enumerate() {
        let (Some(measured), Some(places)) = (record.channel(&channel.name), places) else {
            continue;
        };
        let of_before = (before.channels.iter()).position(|c| c.name == channel.name);
        // Of a channel of which nothing is said the two models are one.
        let (one, all) = match of_before {
            Some(k) => (&one_before[k], &all_before[k]),
            None => (&one_after[index], &all_after[index]),
        };
        let view = View {
            name: &channel.name,
            unit: &channel.unit,
            values: &measured.values,
            simulated: [one, &one_after[index]],
            tau0: sampling.tau0,
            extended: said(&channel.name),
        };
        let own = places.curves(&measured.values);
        let against = [
            replicates::against(&own, all),
            replicates::against(&own, &all_after[index]),
        ];
        let at = places.abscissae();
        let figures = view.figures(&own, &at, &against)?;
        out.push((said(&channel.name), channel.name.as_str(), figures));
    }
    out.sort_by_key(|(said, ..)| !said);
    Ok(folded(out))
}

/// A model without the channels of which nothing is said. Its baseline joins no two of them; a model with effects, as of a
/// base that moved, stays whole.
fn of_channels(model: &ModelFile, said: impl Fn(&str) -> bool) -> ModelFile {
    let mut model = model.clone();
    let is_any = model.channels.iter().any(|c| said(&c.name));
    if !is_any || (model.effects.is_empty() && model.unnamed.is_empty()) {
        model.channels.retain(|c| said(&c.name));
    }
    model
}

/// Figures of channels, by name, each to be opened; those of which something is said are open.
fn folded(all: Vec<(bool, &str, Markup)>) -> Vec<Markup> {
    // Where nothing is said of any channel, the first is as good as another.
    let all_quiet = all.iter().all(|(said, ..)| !said);
    let open = |k: usize, said: bool| said || (all_quiet && k == 0);
    all.into_iter()
        .enumerate()
        .map(|(k, (said, name, figures))| {
            html! {
                details open[open(k, said)] {
                    summary { code { (name) } }
                    (figures)
                }
            }
        })
        .collect()
}

/// Width and height of a figure on a telephone and in a column of a printed page, units of its view box: letters keep their
/// size at 390 px, and have 7 pt in print.
const NARROW: (u32, u32) = (430, 224);

/// A figure as it is for a wide page, and for a telephone and a printed one, of which the style shows one.
fn at_two_widths(wide: &Figure) -> Result<Markup, ReportError> {
    let narrow = Figure {
        width: NARROW.0,
        height: NARROW.1,
        ..wide.clone()
    };
    Ok(html! {
        (wide.legend())
        div.wide { (PreEscaped(wide.svg()?)) }
        div.narrow { (PreEscaped(narrow.svg()?)) }
    })
}
