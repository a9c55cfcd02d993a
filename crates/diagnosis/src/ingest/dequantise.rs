//! A slow reading in coarse steps: what it was between them.
//!
//! A thermometer that moves by less than a step from reading to reading, and has too little noise of its own to dither,
//! is a staircase. Its rounding errors hang together for minutes, so that no averaging takes them off, and a regression
//! on them finds a slope that is too small and a rest that follows the steps. Where the staircase changes the truth is
//! known, half a step from either side; in between it is a cubic through these places that never leaves what the reading
//! allows.

/// The reading changed between two samples: where, samples, and the value half way.
struct Crossing {
    at: f64,
    value: f64,
}

/// Changes by more than one step that a staircase may have, as a share of all: readings are lost now and then.
const TALL: f64 = 0.05;

/// The smooth course of readings of this step, NaN where lost; none where they are no staircase: too fast, or with noise
/// enough of their own for an average to tell what lies between the steps.
pub(crate) fn smoothed(readings: &[f64], step: f64) -> Option<Vec<f64>> {
    let known: Vec<(usize, f64)> = readings
        .iter()
        .copied()
        .enumerate()
        .filter(|(_, v)| v.is_finite())
        .collect();
    if step.is_nan() || step <= 0.0 || noise(&known) > step * step / 12.0 {
        return None;
    }
    let changes = || known.windows(2).filter(|w| w[0].1 != w[1].1);
    let tall = changes().filter(|w| (w[1].1 - w[0].1).abs() > 1.5 * step);
    if tall.count() as f64 > TALL * changes().count() as f64 {
        return None;
    }
    let crossings = settled(changes().map(|w| Crossing {
        at: 0.5 * (w[0].0 + w[1].0) as f64,
        value: 0.5 * (w[0].1 + w[1].1),
    }));
    let slopes = slopes(&crossings)?;
    let last = crossings.len() - 1;
    let mut next = 0;
    let course = readings.iter().enumerate().map(|(i, read)| {
        let t = i as f64;
        while next <= last && crossings[next].at < t {
            next += 1;
        }
        if next == 0 {
            return outside(&crossings[0], slopes[0], t, known[0].1);
        }
        if next > last {
            return outside(&crossings[last], slopes[last], t, known[known.len() - 1].1);
        }
        let of = |k: usize| (&crossings[k], slopes[k]);
        let value = between(of(next - 1), of(next), t);
        if read.is_finite() {
            value.clamp(read - 0.5 * step, read + 0.5 * step)
        } else {
            value
        }
    });
    Some(course.collect())
}

/// Before the first crossing and after the last one: on to the middle of the reading, and no further, for nothing else is
/// known there.
fn outside(end: &Crossing, slope: f64, t: f64, reading: f64) -> f64 {
    let value = end.value + slope * (t - end.at);
    value.clamp(end.value.min(reading), end.value.max(reading))
}

/// Crossings with those put together in which a reading of some noise goes to and fro over one place: such come closer
/// than a quarter of the time that a step takes.
fn settled(crossings: impl Iterator<Item = Crossing>) -> Vec<Crossing> {
    let crossings: Vec<Crossing> = crossings.collect();
    let mut times: Vec<f64> = crossings
        .windows(2)
        .filter(|w| w[0].value != w[1].value)
        .map(|w| w[1].at - w[0].at)
        .collect();
    times.sort_by(f64::total_cmp);
    let near = times.get(times.len() / 2).map_or(0.0, |t| 0.25 * t);
    crossings
        .chunk_by(|a, b| a.value == b.value && b.at - a.at < near)
        .map(|together| Crossing {
            at: together.iter().map(|c| c.at).sum::<f64>() / together.len() as f64,
            value: together[0].value,
        })
        .collect()
}

/// Variance of the white noise of readings, by how far each change is taken back by the next.
fn noise(known: &[(usize, f64)]) -> f64 {
    let back: f64 = known
        .windows(3)
        .map(|w| (w[1].1 - w[0].1) * (w[1].1 - w[2].1))
        .sum();
    back / known.len().max(1) as f64
}

/// Slope at every crossing: of the parabola through it and its neighbours. None where there is no second crossing.
fn slopes(crossings: &[Crossing]) -> Option<Vec<f64>> {
    let secants: Vec<(f64, f64)> = crossings
        .windows(2)
        .map(|w| (w[1].at - w[0].at, w[1].value - w[0].value))
        .collect();
    let (first, last) = (secants.first()?, secants.last()?);
    let inner = secants.windows(2).map(|w| {
        let ((h, d), (k, e)) = (w[0], w[1]);
        (d / h * k + e / k * h) / (h + k)
    });
    let slope = |(h, d): &(f64, f64)| d / h;
    Some(
        std::iter::once(slope(first))
            .chain(inner)
            .chain(std::iter::once(slope(last)))
            .collect(),
    )
}

/// Hermite's cubic between two crossings and their slopes.
fn between((a, slope_a): (&Crossing, f64), (b, slope_b): (&Crossing, f64), t: f64) -> f64 {
    let h = b.at - a.at;
    let s = (t - a.at) / h;
    let r = 1.0 - s;
    a.value * r * r * (1.0 + 2.0 * s)
        + b.value * s * s * (1.0 + 2.0 * r)
        + h * s * r * (slope_a * r - slope_b * s)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rms(a: &[f64], b: impl Fn(usize) -> f64) -> f64 {
        let sum: f64 = a.iter().enumerate().map(|(i, v)| (v - b(i)).powi(2)).sum();
        (sum / a.len() as f64).sqrt()
    }

    /// Drift of some steps, up and down.
    fn truth(i: usize) -> f64 {
        let t = i as f64 / 12_000.0;
        25.0 + 0.8 * (7.3 * t).sin() - 0.6 * t
    }

    const STEP: f64 = 0.1453;

    /// Uniform noise, -0.5..0.5.
    fn noise() -> impl FnMut() -> f64 {
        let mut state = 1u32;
        move || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1u32 << 24) - 0.5
        }
    }

    #[test]
    fn a_staircase_is_smoothed_to_a_fraction_of_its_rounding() {
        let mut read: Vec<f64> = (0..12_000)
            .map(|i| (truth(i) / STEP).round() * STEP)
            .collect();
        read[4000..4030].fill(f64::NAN);
        let smooth = smoothed(&read, STEP).unwrap();
        assert!(smooth.iter().all(|v| v.is_finite()));
        let rounding = STEP / 12f64.sqrt();
        assert!(
            rms(&smooth, truth) < 0.35 * rounding,
            "{}",
            rms(&smooth, truth) / rounding
        );
        let inside = smooth
            .iter()
            .zip(&read)
            .all(|(s, r)| !r.is_finite() || (s - r).abs() <= 0.5 * STEP + 1e-9);
        assert!(inside);
    }

    #[test]
    fn a_little_noise_at_the_steps_does_not_spoil_it() {
        let mut draw = noise();
        let read: Vec<f64> = (0..12_000)
            .map(|i| (truth(i) / STEP + 0.3 * draw()).round() * STEP)
            .collect();
        let smooth = smoothed(&read, STEP).unwrap();
        let rounding = STEP / 12f64.sqrt();
        assert!(
            rms(&smooth, truth) < 0.5 * rounding,
            "{}",
            rms(&smooth, truth) / rounding
        );
    }

    #[test]
    fn readings_that_dither_or_never_change_are_no_staircase() {
        let mut draw = noise();
        let dithered: Vec<f64> = (0..12_000)
            .map(|i| (truth(i) / STEP + 1.2 * draw()).round() * STEP)
            .collect();
        assert!(smoothed(&dithered, STEP).is_none());
        assert!(smoothed(&[25.0; 100], STEP).is_none());
        let exact: Vec<f64> = (0..12_000).map(truth).collect();
        assert!(smoothed(&exact, 1e-9).is_none());
    }
}
