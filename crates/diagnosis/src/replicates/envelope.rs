//! The global envelope test.

use std::ops::Range;

use super::statistics::Statistic;
use crate::result::{Among, LEVEL, Worst};

/// Statistics of the record and of the replicates of a model, the record first.
pub(super) struct Table {
    /// One row a record or replicate.
    pub rows: Vec<Vec<f64>>,
    /// The columns of each channel.
    pub channels: Vec<Range<usize>>,
}

impl Table {
    /// Each channel of the record among the replicates.
    ///
    /// The measure of a row in a channel is its smallest continuous rank from either end over the statistics of the
    /// channel; the chance is the share of rows, the record's included, whose smallest measure over all channels is not
    /// above that. Rows that the model made are exchangeable with the record where the model is true, so that the level
    /// is exact whatever the statistics are: simultaneous over them and over the channels.
    ///
    /// # Source
    /// Myllymaki, Mrkvicka, Grabarnik, Seijo, Hahn (2017), J. R. Stat. Soc. B 79: 381-404, the test by extreme ranks;
    /// its ranks made continuous as by Hahn (2015) and Mrkvicka, Myllymaki, Kuronen, Narisetty (2022), Stat. Med. 41:
    /// 276-297, so that one statistic far off counts for as much as many that are a little off.
    pub fn among(&self, statistics: &[Statistic]) -> Vec<Among> {
        let ranks = self.ranks();
        let measure = |row: usize, channel: &Range<usize>| {
            let all = channel.clone().map(|k| ranks[k][row]);
            all.fold(f64::INFINITY, f64::min)
        };
        let rows = self.rows.len();
        let least: Vec<f64> = (0..rows)
            .map(|row| {
                self.channels
                    .iter()
                    .map(|c| measure(row, c))
                    .fold(f64::INFINITY, f64::min)
            })
            .collect();
        // The envelope leaves out the rows that stray farthest.
        let mut sorted = least.clone();
        sorted.sort_by(f64::total_cmp);
        let out = (LEVEL * rows as f64).floor() as usize;
        let limit = sorted[out.min(rows - 1)];
        let inside: Vec<usize> = (0..rows).filter(|row| least[*row] >= limit).collect();
        self.channels
            .iter()
            .map(|channel| {
                let own = measure(0, channel);
                let as_far = least.iter().filter(|m| **m <= own).count();
                let worst = channel
                    .clone()
                    .min_by(|a, b| ranks[*a][0].total_cmp(&ranks[*b][0]));
                Among {
                    p_value: as_far as f64 / rows as f64,
                    worst: worst.map_or_else(Worst::default, |k| {
                        let held = || inside.iter().map(|row| self.rows[*row][k]);
                        Worst {
                            statistic: statistics[k].what.clone(),
                            value: self.rows[0][k],
                            low: held().fold(f64::INFINITY, f64::min),
                            high: held().fold(f64::NEG_INFINITY, f64::max),
                            unit: statistics[k].unit.clone(),
                            with: statistics[k].with.clone(),
                        }
                    }),
                }
            })
            .collect()
    }

    /// Continuous ranks of each statistic, by row.
    fn ranks(&self) -> Vec<Vec<f64>> {
        let count = self.channels.last().map_or(0, |c| c.end);
        let column = |k: usize| self.rows.iter().map(|row| row[k]).collect::<Vec<_>>();
        (0..count).map(|k| continuous_ranks(&column(k))).collect()
    }
}

/// Continuous rank of each value from the nearer end, 0 and up.
///
/// Of v(1) <= ... <= v(m), from below: v(j) has j - 1 + (v(j) - v(j-1)) / (v(j+1) - v(j-1)), the lowest
/// exp(-(v(2) - v(1)) / (v(m) - v(2))): the farther it lies beyond all others, the less. Equal ones have their mean place,
/// and a statistic that is no number of any row tells nothing.
fn continuous_ranks(values: &[f64]) -> Vec<f64> {
    let m = values.len();
    let mut ranks = vec![m as f64; m];
    if m < 4 || values.iter().any(|v| !v.is_finite()) {
        return ranks;
    }
    let mut order: Vec<usize> = (0..m).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let v: Vec<f64> = order.iter().map(|i| values[*i]).collect();
    let mut from = 0;
    while from < m {
        let equal = v[from..].iter().take_while(|w| **w == v[from]).count();
        let until = from + equal;
        let rank = if equal > 1 {
            let middle = 0.5 * (from + until) as f64;
            middle.min(m as f64 - middle)
        } else {
            single(&v, from)
        };
        order[from..until].iter().for_each(|i| ranks[*i] = rank);
        from = until;
    }
    ranks
}

/// Of a value that no other is equal to.
fn single(v: &[f64], j: usize) -> f64 {
    let m = v.len();
    let beyond = |gap: f64, rest: f64| if rest > 0.0 { (-gap / rest).exp() } else { 0.0 };
    if j == 0 {
        beyond(v[1] - v[0], v[m - 1] - v[1])
    } else if j == m - 1 {
        beyond(v[m - 1] - v[m - 2], v[m - 2] - v[0])
    } else {
        let part = (v[j] - v[j - 1]) / (v[j + 1] - v[j - 1]);
        (j as f64 + part).min((m - 1 - j) as f64 + 1.0 - part)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks_from_the_nearer_end_grow_towards_the_middle() {
        let ranks = continuous_ranks(&[1.0, 2.0, 4.0, 5.0, 30.0]);
        // 5 of the range 1..5 beyond all others by 25; the lowest beyond by 1 of 28.
        assert!((ranks[4] - (-25.0f64 / 4.0).exp()).abs() < 1e-12);
        assert!((ranks[0] - (-1.0f64 / 28.0).exp()).abs() < 1e-12);
        assert!((ranks[1] - (1.0 + 1.0 / 3.0)).abs() < 1e-12);
        assert!(ranks[2] > ranks[1] && ranks[3] < ranks[2]);
    }

    #[test]
    fn a_statistic_that_is_alike_in_all_rows_convicts_none() {
        let ranks = continuous_ranks(&[3.0; 20]);
        assert!(ranks.iter().all(|r| (*r - 10.0).abs() < 1e-12));
        let mut values = vec![0.0; 20];
        values[7] = 1.0;
        let ranks = continuous_ranks(&values);
        assert!(ranks[7] < 1e-12 && ranks[0] > 9.0);
    }

    #[test]
    fn the_row_that_strays_has_the_least_chance_and_the_envelope_leaves_it_out() {
        let statistics = ["a", "b"].map(|what| Statistic {
            what: what.into(),
            unit: "1".into(),
            with: None,
            slow: false,
        });
        let rows = (0..200).map(|i| {
            let x = f64::from(i) / 200.0;
            // The record is row 0: ordinary in the one statistic, far off in the other.
            vec![
                (x * 37.0 + 0.4).fract(),
                if i == 0 {
                    9.0
                } else {
                    (x * 61.0 + 0.3).fract()
                },
            ]
        });
        let table = Table {
            rows: rows.collect(),
            channels: vec![0..1, 1..2],
        };
        let among = table.among(&statistics);
        assert!(among[0].holds());
        assert!((among[1].p_value - 0.005).abs() < 1e-12);
        let worst = &among[1].worst;
        assert!(worst.statistic == "b" && worst.value > worst.high && worst.high <= 1.0);
    }
}
