//! Single far readings of one channel that meet by chance: two within a blow's reach are like a short shock.

use super::{Channel, Piece};
use crate::fit::threshold;
use crate::ingest::blows::Blow;
use crate::search::searched::Searched;
use numerics::tails;

/// Whether they may be all there is of a blow that channels `felt`. Far readings come like a Poisson process: the others of the
/// record tell how often two, three and so on fall within the blow's reach. What they do not explain of `lr`, which has so many
/// degrees of freedom, is noise as often as chi-square says.
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
        let aside = s.target.aside.iter();
        let others = aside.filter(|a| !blow.readings.contains(&a.0)).count();
        let reach = blow.readings.len() as f64 / s.search.panel.bins.n as f64;
        let (channel, mut by_readings) = (&piece.channels[*k], Readings::default());
        by_readings.add(channel, piece, blow);
        (1..=others).any(|beside| {
            let together = (beside + 1) as f64;
            let meetings = (others as f64 + together) / together
                * tails::at_least(beside as u64, others as f64 * reach);
            if meetings < alarm || !by_readings.add(channel, piece, blow) {
                return false;
            }
            let rest = (lr - by_readings.lr).max(0.0);
            meetings.min(1.0) * tails::chi_square(rest, freedom as f64) > alarm
        })
    })
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
    /// Adds the one that explains most of what the others leave; false where none is left.
    fn add(&mut self, channel: &Channel, piece: &Piece, blow: &Blow) -> bool {
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
        let best = all.max_by(|a, b| a.0.total_cmp(&b.0));
        let found = best.is_some();
        if let Some((lr, column)) = best {
            self.lr += lr;
            self.columns.push(column);
        }
        found
    }
}
