//! Times of arrival: a sensor's FIFO that is read out now and then gives its rows times that are those of the reading.

/// Rows of one batch at least, and batches.
const ROWS: usize = 4;
const BATCHES: usize = 30;
/// What a batch takes at most: longer ones are stretches of sampling with pauses between.
const LONGEST_S: f64 = 0.25;
/// Time between two batches up to which they are those of one run, s.
const PERIOD_S: f64 = 10.0;
/// The time within a batch, in parts of that between two: rows that are lost leave more than this.
const WITHIN: f64 = 0.25;
/// Part by which one batch may differ from the usual one in rows and time, and share of them that has to be so.
const ALIKE: f64 = 0.25;
const MOST: f64 = 0.9;

/// Whether times are those at which rows arrived, many at once: short batches of like size, evenly far apart.
#[must_use]
pub fn arrive(times: &[f64]) -> bool {
    let steps = || times.windows(2).map(|w| w[1] - w[0]);
    if times.len() < ROWS * BATCHES || steps().any(|s| !s.is_finite() || s < 0.0) {
        return false;
    }
    let usual = middle(steps());
    let mean = (times[times.len() - 1] - times[0]) / (times.len() - 1) as f64;
    if usual > WITHIN * mean {
        return false;
    }
    // Between the steps in a batch and those between two.
    let pause = ROWS as f64 * mean / 2.0;
    let starts: Vec<usize> = (1..times.len())
        .filter(|i| times[*i] - times[*i - 1] > pause)
        .collect();
    if starts.len() < BATCHES {
        return false;
    }
    let whole = || starts.windows(2);
    let rows = || whole().map(|w| (w[1] - w[0]) as f64);
    let takes = whole().map(|w| times[w[1] - 1] - times[w[0]]);
    let apart = || whole().map(|w| times[w[1]] - times[w[0]]);
    let (takes, period) = (middle(takes), middle(apart()));
    are_alike(rows(), middle(rows()))
        && are_alike(apart(), period)
        && middle(rows()) >= ROWS as f64
        && takes < WITHIN * period
        && takes <= LONGEST_S
        && period <= PERIOD_S
}

fn are_alike(of: impl Iterator<Item = f64>, usual: f64) -> bool {
    let (mut near, mut all) = (0usize, 0usize);
    for v in of {
        near += usize::from((v - usual).abs() <= ALIKE * usual);
        all += 1;
    }
    near as f64 >= MOST * all as f64
}

fn middle(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Batches of so many rows at 100 Hz, 0.4 ms apart, read within 3 ms.
    fn fifo(rows: usize) -> Vec<f64> {
        let each = |k: usize| {
            let late = 3e-3 * ((k / rows * 7919 % 101) as f64 / 101.0);
            ((k / rows + 1) * rows) as f64 * 0.01 + late + (k % rows) as f64 * 4e-4
        };
        (0..20_000).map(each).collect()
    }

    #[test]
    fn batches_of_any_size_are_times_of_arrival() {
        for rows in [4, 8, 10, 16, 32, 64] {
            assert!(arrive(&fifo(rows)), "{rows}");
        }
        // Equal times.
        let equal = |k: usize| (k / 16) as f64 * 0.16;
        assert!(arrive(&(0..20_000).map(equal).collect::<Vec<_>>()));
        // One batch is lost now and then.
        let mut lost = fifo(16);
        lost.drain(1600..1616);
        assert!(arrive(&lost));
    }

    #[test]
    fn sampling_with_pauses_and_lost_rows_is_none() {
        let times = |of: &dyn Fn(usize) -> f64| (0..20_000).map(of).collect::<Vec<f64>>();
        // Two seconds of each minute; half a second of each five.
        assert!(!arrive(&times(
            &|k| (k / 100) as f64 * 60.0 + (k % 100) as f64 * 0.02
        )));
        assert!(!arrive(&times(
            &|k| (k / 25) as f64 * 5.0 + (k % 25) as f64 * 0.02
        )));
        // Every tenth row is lost.
        assert!(!arrive(&times(&|k| (k + k / 9) as f64 * 0.01)));
        assert!(!arrive(&times(&|k| k as f64 * 0.01)));
        // Pauses of any length.
        assert!(!arrive(&times(
            &|k| (k / 16 * k / 16) as f64 + (k % 16) as f64 * 4e-4
        )));
    }
}
