//! Faults of frames and samples that the grid itself shows: gaps of the sequence numbers, readings flagged as not new,
//! single samples that the noise cannot have made.

use model::effects::effect;
use model::record::{Axis, Record, flag};

use crate::diagnosis::Searched;
use crate::grid::Grid;
use crate::result::{Finding, Parameter};

/// Most times that a finding lists.
const MOST_TIMES: usize = 1000;

fn counted(cause: &str, channels: Vec<String>, times: Vec<f64>, count: usize) -> Option<Finding> {
    let title = effect(cause)?.docs().title;
    (count > 0).then(|| Finding {
        cause: cause.into(),
        what: format!(
            "{title}: {count} on {}, first at {:.2} s",
            channels.join(", "),
            times.first().unwrap_or(&0.0)
        ),
        channels,
        parameters: [("count".to_owned(), Parameter::exact(count as f64, "1"))].into(),
        times_s: times.into_iter().take(MOST_TIMES).collect(),
        ..Finding::default()
    })
}

/// All that the grid shows.
pub(crate) fn findings(record: &Record, searched: &[Searched<'_>], grid: &Grid) -> Vec<Finding> {
    let time = |place: usize| place as f64 / grid.rate_hz;
    let names: Vec<String> = searched.iter().map(|s| s.target.name.clone()).collect();
    let mut all = vec![];
    let lost = grid.n - record.len();
    let gaps: Vec<f64> = record
        .seq
        .as_ref()
        .filter(|_| lost > 0)
        .map_or(vec![], |seq| {
            seq.windows(2)
                .filter(|w| w[1] > w[0] + 1)
                .map(|w| time((w[0] + 1 - seq[0]) as usize))
                .collect()
        });
    all.extend(counted("dropped_samples", names, gaps, lost));
    if let Some(flags) = &record.flags {
        for axis in Axis::ALL {
            let own: Vec<String> = searched
                .iter()
                .filter(|s| s.target.axis == Some(axis))
                .map(|s| s.target.name.clone())
                .collect();
            let stale: Vec<f64> = flags
                .iter()
                .enumerate()
                .filter(|(_, f)| **f & (flag::NEW_DATA_X << axis.index()) == 0)
                .map(|(i, _)| time(i))
                .collect();
            let count = stale.len();
            if !own.is_empty() {
                all.extend(counted("stale_samples", own, stale, count));
            }
        }
    }
    for s in searched {
        let times: Vec<f64> = s.target.spikes.iter().map(|i| time(*i)).collect();
        let count = times.len();
        all.extend(counted(
            "outliers",
            vec![s.target.name.clone()],
            times,
            count,
        ));
    }
    all
}
