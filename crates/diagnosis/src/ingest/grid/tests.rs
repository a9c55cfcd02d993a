use model::ModelFile;

use super::*;

#[test]
fn a_long_record_is_laid_out_on_a_quick_length_and_told_at_its_own() {
    // 262 447 is a prime.
    let rows = 262_447;
    let mut record =
        model::simulate(&ModelFile::paper(), rows as f64 / 20.0, 20.0, 1).expect("simulated");
    assert_eq!(record.len(), rows);
    record.channels[0].values[1000] = f64::NAN;
    let grid = lay_out(&record, &|_| vec![], 1).expect("long enough");
    assert_eq!((grid.end, grid.n), (rows, quick_length(rows)));
    assert!(grid.n > rows && grid.seconds() == rows as f64 / 20.0);
    assert!(grid.signals.iter().all(|s| s.values.len() == grid.n));
    for (t, channel) in grid.targets.iter().zip(record.all(Quantity::Gyro)) {
        let read = |i: &usize| *i < rows && channel.values[*i].is_finite();
        let lost: Vec<usize> = (0..grid.n).filter(|i| !read(i)).collect();
        assert_eq!(t.lost, lost);
        let (scale, _) = unit_of(channel);
        let mut kept = (0..grid.n).filter(read);
        assert!(kept.all(|i| t.y[i] == scale * channel.values[i]));
        // What follows is noise of the same size about the same level.
        let after = &t.y[rows..];
        let count = after.len() as f64;
        let level = t.y[rows - 1000..rows].iter().sum::<f64>() / 1000.0;
        let square: f64 = after.iter().map(|v| (v - level).powi(2)).sum();
        let ratio = square / count / t.white;
        assert!((ratio - 1.0).abs() < 5.0 * (2.0 / count).sqrt(), "{ratio}");
    }
}
