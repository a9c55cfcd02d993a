//! A host's clock that was set back while it recorded: its times say an hour twice, and the rows of both would mingle.

use super::rate::median;

/// Rows that a stretch between two settings has at least.
const LEAST_ROWS: usize = 20;
/// Deviation of a stretch's interval from that of all.
const ALIKE: f64 = 0.05;
/// Share of the steps that may be shorter than half the usual one: times of arrival, which come in batches, tell nothing.
const MOST_SHORT: f64 = 0.1;
/// Rows for each interval that was passed twice: two where it was recorded twice, one where rows merely changed places.
const ROWS_TO_AN_INTERVAL: f64 = 1.5;

/// What has to be added to the times of each stretch that begins at one of the places `back`, s, where all of them are
/// settings of the clock: an even rate before and after, and rows for all that was passed twice. The row after a setting
/// then comes one interval after the row before it.
pub(super) fn shifts(t: &[f64], back: &[usize]) -> Option<Vec<f64>> {
    let forward: Vec<f64> = (1..t.len())
        .filter(|i| !back.contains(i))
        .map(|i| t[i] - t[i - 1])
        .collect();
    let usual = median(&forward);
    let short = forward.iter().filter(|d| **d < 0.5 * usual).count();
    if usual.is_nan() || usual <= 0.0 || short as f64 > MOST_SHORT * forward.len() as f64 {
        return None;
    }
    let begins: Vec<usize> = [0].into_iter().chain(back.iter().copied()).collect();
    let ends = back.iter().copied().chain([t.len()]);
    for (from, to) in begins.iter().zip(ends) {
        let steps: Vec<f64> = t[*from..to].windows(2).map(|w| w[1] - w[0]).collect();
        let is_alike = (median(&steps) / usual - 1.0).abs() < ALIKE;
        if steps.len() + 1 < LEAST_ROWS || !is_alike {
            return None;
        }
    }
    let mut shift = 0.0;
    let mut shifts = Vec::new();
    for (k, at) in back.iter().enumerate() {
        let (end, begin) = (t[at - 1], t[*at]);
        let next = back.get(k + 1).copied().unwrap_or(t.len());
        let before = t[begins[k]..*at].iter().filter(|v| **v >= begin).count();
        let after = t[*at..next].iter().filter(|v| **v <= end).count();
        let passed = (end - begin) / usual;
        if before < 2 || after < 2 || (before + after) as f64 <= ROWS_TO_AN_INTERVAL * passed {
            return None;
        }
        shift += end - begin + usual;
        shifts.push(shift);
    }
    Some(shifts)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn even(from: f64, rows: usize) -> Vec<f64> {
        (0..rows).map(|i| from + 0.05 * i as f64).collect()
    }

    #[test]
    fn a_clock_set_back_is_told_from_rows_and_parts_that_changed_places() {
        let set_back = [even(0.0, 500), even(15.013, 500)].concat();
        let shift = shifts(&set_back, &[500]).expect("the clock was set back")[0];
        assert!((set_back[500] + shift - 25.0).abs() < 1e-9, "{shift}");
        let twice = [even(0.0, 300), even(0.0, 300), even(0.0, 300)].concat();
        let two = shifts(&twice, &[300, 600]).expect("two settings");
        assert!(
            (two[0] - 15.0).abs() < 1e-9 && (two[1] - 30.0).abs() < 1e-9,
            "{two:?}"
        );
        // The later part of a record before the earlier one.
        let turned = [even(25.0, 500), even(0.0, 500)].concat();
        assert_eq!(shifts(&turned, &[500]), None);
        // A block of rows that was moved.
        let mut moved = even(0.0, 1000);
        moved[400..500].rotate_left(50);
        let back: Vec<usize> = (1..1000).filter(|i| moved[*i] < moved[i - 1]).collect();
        assert_eq!(shifts(&moved, &back), None);
        // Another rate.
        let other: Vec<f64> = (0..500).map(|i| 15.0 + 0.02 * f64::from(i)).collect();
        assert_eq!(shifts(&[even(0.0, 500), other].concat(), &[500]), None);
    }
}
