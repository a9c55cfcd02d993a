//! A base that moved: no error of a sensor, but an input of the run.

use super::fitted::rms;
use crate::effect::value;
use crate::file::{ChannelModel, EffectModel, ModelFile};
use crate::parameter::Parameter;
use crate::record::Record;
use crate::simulate::held;

/// The cause that is a motion of the base.
pub(super) const MOVED: &str = "base_motion";
/// Length of a block that motion is hardly faster than, s.
pub(super) const BLOCK_S: f64 = 0.5;
const GYROS: [&str; 3] = ["gyro_x", "gyro_y", "gyro_z"];

/// Whether an effect is a motion of the base, and no turn of seconds, which is simulated as what it is.
pub(super) fn moves_throughout(e: &EffectModel) -> bool {
    e.cause == MOVED && !e.parameters.contains_key("start")
}

/// The channels that moved.
pub(super) fn moved_channels(model: &ModelFile) -> Vec<String> {
    let moves = model.effects.iter().filter(|e| moves_throughout(e));
    moves.flat_map(|e| e.channels.iter().cloned()).collect()
}

/// Factor by which a channel reads a rate too large under a model.
pub(super) fn scale_of(model: &ModelFile, name: &str) -> f64 {
    let own = model.effects.iter().filter(|e| e.cause == "scale_error");
    let own = own.filter(|e| e.channels.is_empty() || e.channels.iter().any(|c| c == name));
    let relative = own.map(|e| 1.0 + value(&e.parameters, "relative"));
    relative.product::<f64>()
}

/// An axis that moved in a record.
#[derive(Clone)]
pub(crate) struct Moved {
    /// Slow part of the readings that a model has of the motion, deg/s.
    pub read: Vec<f64>,
    /// The motion itself, about its mean, deg/s.
    pub motion: Vec<f64>,
}

/// Standard deviations beyond which two readings near each other are no noise about the slow part of a motion. By chance that is
/// one pair in a hundred runs of ten minutes, which are then replayed as they were read.
const FAR: f64 = 3.5;
/// As many of means over readings next to each other. By chance that is one in twenty runs of ten minutes.
const FAR_MEAN: f64 = 4.5;
/// Half of a normal distribution lies within so much of its standard deviation.
const NORMAL_MEDIAN: f64 = 0.674_5;
/// As many of second differences, one by one.
const FAR_BEND: f64 = 6.0;

/// The baseline of a channel that moved, read at `rate_hz`: the random walk fitted to it is the motion's, and no other can be seen
/// below that; the white noise is what is left in second differences, to which a motion of seconds adds nothing, but where it
/// begins.
pub fn at_rest(channel: &mut ChannelModel, values: &[f64], rate_hz: f64) {
    let (white, count) = white(values);
    // deg/s at one sample -> deg/sqrt(h).
    let white = white / rate_hz.sqrt() * 60.0;
    // Second differences of white noise have the correlations -2/3 and 1/6: a mean of their squares is worth n / 1.94 of free ones.
    let error = white * (1.944 / (2.0 * count as f64)).sqrt();
    if let Some(p) = channel.baseline.get_mut("angle_random_walk") {
        *p = Parameter::estimated(white, error, &p.unit);
    }
    if let Some(p) = channel.baseline.get_mut("rate_random_walk") {
        *p = Parameter::exact(0.0, &p.unit);
    }
    if let Some(bias) = channel.baseline.get_mut("bias") {
        bias.std_error = None;
    }
}

/// Standard deviation of the white noise beside a motion, by so many second differences: of those that are far out the motion is.
fn white(values: &[f64]) -> (f64, usize) {
    let bends = values.windows(3).map(|w| w[0] - 2.0 * w[1] + w[2]);
    let bends: Vec<f64> = bends.filter(|b| b.is_finite()).collect();
    let mut sizes: Vec<f64> = bends.iter().map(|b| b.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let sigma = sizes
        .get(sizes.len() / 2)
        .map_or(0.0, |m| m / NORMAL_MEDIAN);
    let near = bends
        .iter()
        .filter(|b| sigma == 0.0 || b.abs() <= FAR_BEND * sigma);
    let near: Vec<f64> = near.copied().collect();
    // Variances add up to 1 + 4 + 1.
    (rms(&near) / 6f64.sqrt(), near.len().max(1))
}

/// The model as it is simulated in the world of a record, and each axis that moved there: the motion is the one that was read, as
/// the model `by` understands the readings.
pub(crate) fn moved_like(
    model: &ModelFile,
    by: &ModelFile,
    record: &Record,
    rate_hz: f64,
) -> (ModelFile, [Option<Moved>; 3]) {
    let named = moved_channels(model);
    let scales = GYROS.map(|name| scale_of(model, name));
    let mut model = model.clone();
    let read = [0, 1, 2].map(|axis| {
        let name = GYROS[axis];
        let moved = named.iter().any(|n| n == name);
        let seen = record.channel(name).filter(|_| moved)?;
        let own = model.channels.iter_mut().find(|c| c.name == name)?;
        let values = held(&seen.values, 1.0)?;
        at_rest(own, &seen.values, rate_hz);
        let mut read = motion(&values, rate_hz);
        let mean = read.iter().sum::<f64>() / read.len() as f64;
        let about: Vec<f64> = read.iter().map(|v| v - mean).collect();
        let mut moved = about.clone();
        let (own, known) = (scales[axis], scale_of(by, name));
        if known != 0.0 && known != 1.0 {
            moved.iter_mut().for_each(|v| *v /= known);
        }
        if known != 0.0 && own != known {
            let each = read.iter_mut().zip(&about);
            each.for_each(|(read, v)| *read = mean + own / known * v);
        }
        Some(Moved {
            read,
            motion: moved,
        })
    });
    let replayed = |c: &String| GYROS.iter().zip(&read).any(|(n, r)| n == c && r.is_some());
    model.effects.retain_mut(|e| {
        let by_name = moves_throughout(e) && !e.channels.is_empty();
        if by_name {
            e.channels.retain(|c| !replayed(c));
        }
        !(by_name && e.channels.is_empty())
    });
    (model, read)
}

/// The motion in what was read: what is slower than about 1 Hz, and where a motion begins or ends faster than that, which several
/// readings near each other show, or their means, all of it.
fn motion(values: &[f64], rate_hz: f64) -> Vec<f64> {
    let mut motion = slow(values, rate_hz);
    let far = FAR * white(values).0;
    let reach = reach(rate_hz).max(1);
    let off = (0..values.len()).filter(|i| (values[*i] - motion[*i]).abs() > far);
    let off: Vec<usize> = off.collect();
    for pair in off.windows(2).filter(|w| w[1] - w[0] <= reach) {
        let around = pair[0].saturating_sub(reach)..(pair[1] + reach).min(values.len());
        motion[around.clone()].copy_from_slice(&values[around]);
    }
    for half in [reach / 4, reach / 2] {
        for i in bent(values, &motion, half) {
            let around = i.saturating_sub(reach)..(i + reach).min(values.len());
            motion[around.clone()].copy_from_slice(&values[around]);
        }
    }
    motion
}

/// Places about which the mean over `half` readings to either side is off the motion by more than noise makes of it.
fn bent(values: &[f64], motion: &[f64], half: usize) -> Vec<usize> {
    let rest: Vec<f64> = values.iter().zip(motion).map(|(v, m)| v - m).collect();
    let rest = means(&rest, half);
    let mut sizes: Vec<f64> = rest.iter().map(|r| r.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let far = sizes
        .get(sizes.len() / 2)
        .map_or(0.0, |m| FAR_MEAN * m / NORMAL_MEDIAN);
    (0..rest.len())
        .filter(|i| far > 0.0 && rest[*i].abs() > far)
        .collect()
}

/// Samples of a third of a block.
fn reach(rate_hz: f64) -> usize {
    (BLOCK_S * rate_hz / 3.0) as usize
}

/// What of a record is slower than about 1 Hz: 2 B - B^2, where B is the mean over a third of a second taken twice, which
/// turns no frequency round. The band of motion, to 0.6 Hz, passes to 2 %.
pub(crate) fn slow(values: &[f64], rate_hz: f64) -> Vec<f64> {
    let half = reach(rate_hz);
    let smooth = |x: &[f64]| means(&means(x, half), half);
    let once = smooth(values);
    let twice = smooth(&once);
    once.iter().zip(twice).map(|(a, b)| 2.0 * a - b).collect()
}

/// The rest of a noise beside the [`slow`] part of another of the same spectrum: a filter whose gain squared is 1 less that of
/// the slow part, so that both together have the spectrum of either. With u = 1 - B the slow part has the gain 1 - u^2, and this
/// one u (2 - u^2)^1/2, the root by a parabola in u^2 that is within 0.1 % from 0 to 1.
pub(crate) fn fast(values: &[f64], rate_hz: f64) -> Vec<f64> {
    const ROOT: [f64; 3] = [std::f64::consts::SQRT_2, -0.343_67, -0.070_54];
    let half = reach(rate_hz);
    let without = |x: &[f64]| -> Vec<f64> {
        let smooth = means(&means(x, half), half);
        x.iter().zip(smooth).map(|(x, s)| x - s).collect()
    };
    let mut power = without(values);
    let mut rest = vec![0.0; values.len()];
    for (k, by) in ROOT.into_iter().enumerate() {
        if k > 0 {
            power = without(&without(&power));
        }
        rest.iter_mut().zip(&power).for_each(|(r, p)| *r += by * p);
    }
    rest
}

/// Means over `half` samples to either side, fewer at the ends.
fn means(values: &[f64], half: usize) -> Vec<f64> {
    let mut sum = 0.0;
    let sums: Vec<f64> = std::iter::once(0.0)
        .chain(values.iter().map(|v| {
            sum += v;
            sum
        }))
        .collect();
    (0..values.len())
        .map(|i| {
            let (from, to) = (i.saturating_sub(half), (i + half + 1).min(values.len()));
            (sums[to] - sums[from]) / (to - from) as f64
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    type Tested = Result<(), Box<dyn std::error::Error>>;

    /// A run in which one axis is shoved to and fro three times for four seconds, and its model.
    fn shoved() -> Result<(Record, ModelFile), crate::simulate::SimulateError> {
        let mut record = crate::simulate(&ModelFile::paper(), 600.0, 20.0, 6)?;
        let shove = |t: f64| {
            let since = (t - 100.0).rem_euclid(200.0);
            let rate = 6.0 * (std::f64::consts::TAU * since / 4.0).sin();
            if since < 4.0 { rate } else { 0.0 }
        };
        for c in record.channels.iter_mut().filter(|c| c.name == "gyro_x") {
            for (i, v) in c.values.iter_mut().enumerate() {
                *v += shove(i as f64 / 20.0);
            }
        }
        let mut model = ModelFile::paper();
        model.effects = vec![EffectModel {
            cause: MOVED.into(),
            channels: vec!["gyro_x".into()],
            parameters: [("peak".to_owned(), Parameter::exact(6.0, "deg/s"))].into(),
        }];
        Ok((record, model))
    }

    /// The readings of a channel, centred: their slow part and the rest.
    fn parts(record: &Record, name: &str) -> [Vec<f64>; 2] {
        let values = record.channel(name).map(|c| c.values.as_slice());
        let values = values.unwrap_or_default();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let slow: Vec<f64> = slow(values, 20.0).iter().map(|v| v - mean).collect();
        let fast = values
            .iter()
            .zip(&slow)
            .map(|(v, s)| v - mean - s)
            .collect();
        [slow, fast]
    }

    #[test]
    fn a_motion_that_begins_at_once_is_motion_and_no_noise() -> Tested {
        let mut record = crate::simulate(&ModelFile::paper(), 600.0, 20.0, 9)?;
        let rest = record.clone();
        let rate = |i: usize| {
            if i < 2000 {
                0.0
            } else {
                10.0 * (i as f64 / 20.0 - 100.0).cos()
            }
        };
        for c in record.channels.iter_mut().filter(|c| c.name == "gyro_x") {
            c.values
                .iter_mut()
                .enumerate()
                .for_each(|(i, v)| *v += rate(i));
        }
        let [read, still] = [&record, &rest].map(|r| &r.channel("gyro_x").unwrap().values);
        let [(with, _), (without, _)] = [read, still].map(|v| white(v));
        assert!((with / without - 1.0).abs() < 0.02, "{with} {without}");
        let left = |m: Vec<f64>| -> f64 {
            let off = read.iter().zip(m).map(|(v, m)| (v - m).abs());
            off.fold(0.0, f64::max)
        };
        // The edge is far out of the noise about the slow part, and there alone: of 12 000 readings none lies beyond 4.5.
        let (slow, all) = (left(slow(read, 20.0)), left(motion(read, 20.0)));
        assert!(slow > 8.0 * with && all < 5.0 * with, "{slow} {all} {with}");
        Ok(())
    }

    #[test]
    fn a_shove_of_one_axis_moves_that_axis_alone() -> Tested {
        let (record, model) = shoved()?;
        let again = crate::simulate(&model.excited_like(&record), 600.0, 20.0, 7)?;
        for name in ["gyro_x", "gyro_y", "gyro_z", "acc_x", "acc_y"] {
            let [read, made] = [&record, &again].map(|r| rms(&parts(r, name)[0]));
            assert!((made / read - 1.0).abs() < 0.2, "{name}: {read} {made}");
        }
        Ok(())
    }

    #[test]
    fn in_the_world_of_a_record_the_base_moves_as_it_did_and_only_the_rest_is_new() -> Tested {
        let (record, model) = shoved()?;
        let again = crate::simulate_in_the_world_of(&model, &record, 20.0, 8)?;
        let [slow_read, fast_read] = parts(&record, "gyro_x");
        let [slow_made, fast_made] = parts(&again, "gyro_x");
        // Over two seconds nothing of what is new is left.
        let [read, made] = [&slow_read, &slow_made].map(|s| means(s, 20));
        let off: Vec<f64> = read.iter().zip(&made).map(|(a, b)| a - b).collect();
        assert!(
            rms(&off) < 0.05 * rms(&read),
            "{} {}",
            rms(&off),
            rms(&read)
        );
        let ratio = rms(&fast_made) / rms(&fast_read);
        assert!((ratio - 1.0).abs() < 0.05, "{ratio}");
        // Both parts together have the noise of either, at whatever pace.
        let [read, made] = [&record, &again].map(|r| {
            let x = &r.channel("gyro_x").unwrap().values;
            [1, 2, 4, 8, 16].map(|half| {
                let smooth = means(x, half);
                rms(&x.iter().zip(smooth).map(|(x, s)| x - s).collect::<Vec<_>>())
            })
        });
        for (read, made) in read.into_iter().zip(made) {
            assert!((made / read - 1.0).abs() < 0.03, "{read} {made}");
        }
        // Where one part passes into the other, and there alone, some of what was read stays.
        let product: f64 = fast_read.iter().zip(&fast_made).map(|(a, b)| a * b).sum();
        let shared = product / 12_000.0 / rms(&fast_read) / rms(&fast_made);
        assert!(shared.abs() < 0.15, "{shared}");
        Ok(())
    }
}
