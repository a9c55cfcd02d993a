//! What is made of series of values.

/// What is made of each value.
pub(crate) fn each<A: Copy, B>(values: &[A], of: impl FnMut(A) -> B) -> Vec<B> {
    values.iter().copied().map(of).collect()
}

/// What is made of each value and the one beside it in another series.
pub(crate) fn each_pair<A: Copy, B: Copy, C>(
    values: &[A],
    others: &[B],
    mut of: impl FnMut(A, B) -> C,
) -> Vec<C> {
    let pairs = values.iter().zip(others);
    pairs.map(|(value, other)| of(*value, *other)).collect()
}

/// What is carried along a series: `next` of what it was, from a first one on, and of each value.
pub(crate) fn carry<A: Copy, S: Copy>(
    mut now: S,
    values: &[A],
    mut next: impl FnMut(S, A) -> S,
) -> Vec<S> {
    each(values, |value| {
        now = next(now, value);
        now
    })
}

/// Adds values to those of a series from a place on, as far as it goes.
pub(crate) fn add_at(series: &mut [f64], place: usize, values: impl IntoIterator<Item = f64>) {
    let beyond = series.iter_mut().skip(place);
    beyond.zip(values).for_each(|(s, v)| *s += v);
}

/// 1 where something is so, 0 where it is not.
pub(crate) fn one_if(so: bool) -> f64 {
    f64::from(u8::from(so))
}

/// Mean of a series.
pub(crate) fn mean(series: &[f64]) -> f64 {
    series.iter().sum::<f64>() / series.len() as f64
}

/// A series without its mean.
pub(crate) fn about_mean(series: &[f64]) -> Vec<f64> {
    let mean = mean(series);
    each(series, |v| v - mean)
}

/// Mean square of a series.
pub(crate) fn mean_square(series: &[f64]) -> f64 {
    mean(&each(series, |v| v * v))
}

/// Mean square of what a series is off its mean.
pub(crate) fn spread(series: &[f64]) -> f64 {
    mean_square(&about_mean(series))
}

/// Least and largest of some values.
pub(crate) fn extremes(values: &[f64]) -> (f64, f64) {
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    let largest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    (least, largest)
}

/// How far the largest is from the least.
pub(crate) fn swing(values: &[f64]) -> f64 {
    let (low, high) = extremes(values);
    high - low
}

/// Where each value is between the least, 0, and the largest, 1.
pub(crate) fn within_range(values: &[f64]) -> Vec<f64> {
    let (low, high) = extremes(values);
    each(values, |v| (v - low) / (high - low).max(1e-9))
}

/// Change since the sample before.
pub(crate) fn changes(series: &[f64]) -> Vec<f64> {
    let mut last = series.first().copied().unwrap_or(0.0);
    each(series, |v| v - std::mem::replace(&mut last, v))
}

/// What follows a series behind a lag, s.
pub(crate) fn lagged(series: &[f64], lag_s: f64, rate_hz: f64) -> Vec<f64> {
    let gain = 1.0 - (-1.0 / (lag_s * rate_hz)).exp();
    let first = series.first().copied().unwrap_or(0.0);
    carry(first, series, |at, v| at + gain * (v - at))
}

/// What a series adds to a store that leaks with a time constant, s.
pub(crate) fn leaking(series: &[f64], leaks_s: f64, rate_hz: f64) -> Vec<f64> {
    let keep = (-1.0 / (leaks_s * rate_hz)).exp();
    carry(0.0, series, |left, v| keep * left + v)
}

/// What follows a series no faster than so much a second.
pub(crate) fn ramped(series: &[f64], most_per_s: f64, rate_hz: f64) -> Vec<f64> {
    let most = most_per_s / rate_hz;
    let first = series.first().copied().unwrap_or(0.0);
    carry(first, series, |at, v| at + (v - at).clamp(-most, most))
}

/// What is left of a series when the straight line in another is taken off.
pub(crate) fn without_line(y: &[f64], x: &[f64]) -> Vec<f64> {
    let (y, x) = (about_mean(y), about_mean(x));
    let sum = |a: &[f64], b: &[f64]| each_pair(a, b, |a, b| a * b).iter().sum::<f64>();
    let slope = sum(&y, &x) / sum(&x, &x).max(f64::MIN_POSITIVE);
    each_pair(&y, &x, |y, x| y - slope * x)
}
