//! Single far readings of one channel that meet by chance: two within a blow's reach are like a short shock.

use super::{Channel, Piece};
use crate::fit::threshold;
use crate::ingest::blows::Blow;
use crate::search::searched::Searched;
use numerics::tails;

/// Whether they may be all there is of a blow that channels `felt`. Far readings come at any time, whatever their sizes: of all sets
/// of two, three and so on that the record has with sizes as large as those in the blow, so many fall within its reach. What they do
/// not explain of `lr`, which has so many degrees of freedom, is noise as often as chi-square says.
pub(super) fn meet(
    piece: &Piece,
    blow: &Blow,
    felt: &[usize],
    searched: &[&Searched<'_>],
    (lr, freedom): (f64, usize),
) -> bool {
    let alarm = threshold::false_alarm();
    felt.iter().any(|k| {
        let s = searched[*k];
        let others = sizes_aside(s, blow);
        let reach = blow.readings.len() as f64 / s.search.panel.bins.n as f64;
        let (channel, mut by_readings) = (&piece.channels[*k], Readings::default());
        let mut meetings = 1.0;
        (1..=others.len() + 1).any(|together| {
            let Some(size) = by_readings.add(channel, piece, blow) else {
                return false;
            };
            let as_large = others.iter().filter(|other| **other >= size).count();
            // Of n + k as large, k of them here, there are n + k over k such sets.
            let sets = (as_large + together) as f64 / together as f64;
            if together == 1 {
                meetings = sets;
                return false;
            }
            meetings *= (sets * reach).min(1.0);
            let rest = (lr - by_readings.lr).max(0.0);
            meetings.min(1.0) * tails::chi_square(rest, freedom as f64) > alarm
        })
    })
}

/// Sizes of the far readings of a channel beside a blow, standard deviations.
fn sizes_aside(s: &Searched<'_>, blow: &Blow) -> Vec<f64> {
    let panel = &s.search.panel;
    let data = panel.dct.inverse(&panel.column(0));
    let law = |at: usize| s.variance.product().map_or(1.0, |v| v[at]);
    let others = (s.target.aside.iter()).filter(|(at, _)| !blow.readings.contains(at));
    let size = |(at, read): &(usize, f64)| {
        (read - data[*at]).abs() / (s.state.solution.white * law(*at)).sqrt()
    };
    others.map(size).collect()
}

/// Single readings of a channel in a blow.
#[derive(Default)]
struct Readings {
    /// Their coefficients, each orthogonal to those before it and of length 1 by the noise.
    columns: Vec<Vec<f64>>,
    /// What they explain together.
    lr: f64,
}

impl Readings {
    /// Adds the one that explains most of what the others leave, and gives its size, standard deviations; none where none is left.
    fn add(&mut self, channel: &Channel, piece: &Piece, blow: &Blow) -> Option<f64> {
        // Of a reading that the others hold rounding is left.
        const LEAST: f64 = 1e-6;
        let over = |a: &[f64], b: &[f64]| channel.over(a, b);
        let beside = |at: usize| {
            let mut column = vec![0.0; piece.all.len()];
            column[at - piece.all.start] = 1.0;
            let mut column = piece.dct.forward(&column);
            let whole = over(&column, &column);
            for other in &self.columns {
                let part = over(&column, other);
                (column.iter_mut().zip(other)).for_each(|(c, o)| *c -= part * o);
            }
            let square = over(&column, &column);
            column.iter_mut().for_each(|c| *c /= square.sqrt());
            (square > LEAST * whole).then(|| (over(&column, &channel.left).powi(2), column))
        };
        let all = blow.readings.clone().filter_map(beside);
        let (lr, column) = all.max_by(|a, b| a.0.total_cmp(&b.0))?;
        self.lr += lr;
        self.columns.push(column);
        Some(lr.sqrt())
    }
}
