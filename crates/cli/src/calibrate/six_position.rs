//! Six positions: the stand on each of its sides in turn, still each time. Zero and scale of the accelerometers, and what the
//! gyros feel of gravity.

use model::Parameter;
use model::file::EffectModel;
use numerics::least_squares::{Fit, fit};

use super::blocks::{Block, Blocks, moved, white};
use super::{Identified, Outcome, SequenceError, Told};
use crate::RecordBuilder;
use crate::capture::Calibration;
use crate::link::Link;
use crate::plan::SEQUENCES;
use wire::Frame;

/// How the sequence is run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SixPosition {
    /// How long each side is recorded, s.
    pub seconds: f64,
    /// How long a side is waited for, s.
    pub within: f64,
}

/// A side of the stand: which axis points up, and whether its positive end does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Side {
    /// 0, 1, 2.
    pub axis: usize,
    /// Whether the axis points up, and not down.
    pub up: bool,
}

const AXES: [&str; 3] = ["x", "y", "z"];
/// A side lies flat enough if this much of gravity is along it, and no more than that along another axis, g: 26 degrees, in which
/// the sides stay independent.
const ALONG_G: f64 = 0.8;
const ACROSS_G: f64 = 0.45;
/// What the accelerometers' means of the first and the last third of a recording may differ by beside what the floor shakes, g: a
/// stand that settles.
const SETTLED_G: f64 = 0.01;
/// Blocks of a side at the least.
const LEAST: usize = 5;

impl std::fmt::Display for Side {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let sign = if self.up { '+' } else { '-' };
        write!(f, "{sign}{}", AXES[self.axis])
    }
}

impl Side {
    fn all() -> [Side; 6] {
        [0, 1, 2, 3, 4, 5].map(|k| Side {
            axis: k / 2,
            up: k % 2 == 0,
        })
    }

    /// The side that a stand lies on by its accelerometers, as the board is set; `None` where it lies askew.
    #[must_use]
    pub fn of(block: &Block, c: &Calibration) -> Option<Side> {
        let g = block
            .acc
            .map(|counts| (counts - c.acc_zero_counts) / c.acc_counts_per_g);
        let axis = (0..3).max_by(|a, b| g[*a].abs().total_cmp(&g[*b].abs()))?;
        let is_flat = (0..3).all(|k| k == axis || g[k].abs() < ACROSS_G);
        (is_flat && g[axis].abs() > ALONG_G).then_some(Side {
            axis,
            up: g[axis] > 0.0,
        })
    }
}

/// A side that was recorded.
struct Taken {
    side: Side,
    blocks: Vec<Block>,
}

fn list(sides: &[Side]) -> String {
    sides
        .iter()
        .map(ToString::to_string)
        .collect::<Vec<_>>()
        .join(", ")
}

/// Runs it: a side is recorded as soon as the stand lies still on one that is new.
///
/// # Errors
/// [`SequenceError`].
pub fn six_position(
    link: &mut Link,
    how: SixPosition,
    tell: &mut dyn FnMut(Told),
) -> Result<Outcome, SequenceError> {
    let mut builder = RecordBuilder::new(Calibration::default());
    builder.hello(&link.ask_hello()?);
    let c = builder.calibration().clone();
    let mut blocks = Blocks::new(c.clone());
    let count = ((how.seconds / blocks.seconds()).ceil() as usize).max(LEAST);
    let mut taken: Vec<Taken> = Vec::new();
    let mut refused = Vec::new();
    while taken.len() < 6 {
        let left: Vec<Side> = Side::all()
            .into_iter()
            .filter(|side| taken.iter().all(|t| t.side != *side))
            .collect();
        tell(Told::Do(format!(
            "lay the stand on another side and leave it alone; which axis points up: left are {}",
            list(&left)
        )));
        let one = next_side(
            link,
            &mut blocks,
            &c,
            (count, how.within),
            &left,
            &mut |said| {
                if let Told::Refused(why) = &said {
                    refused.push(why.clone());
                }
                tell(said);
            },
        )?;
        tell(Told::Note(format!(
            "{} is done, {} of 6",
            one.side,
            taken.len() + 1
        )));
        taken.push(one);
    }
    Ok(outcome(&taken, &c, refused))
}

/// A side that is waited for.
struct Waiting<'a> {
    c: &'a Calibration,
    left: &'a [Side],
    /// Blocks that are recorded.
    count: usize,
    /// How long that takes, s.
    seconds: f64,
    /// Blocks since it lies still.
    run: Vec<Block>,
    /// Whether it has been moved since it is waited for: until then it lies on the side before.
    has_moved: bool,
    /// Whether it lies on a side that can be used.
    is_usable: bool,
}

impl Waiting<'_> {
    /// The next block; the side, where it is recorded now.
    fn take(&mut self, block: Block, tell: &mut dyn FnMut(Told)) -> Option<Taken> {
        if let Some(why) = (self.run.last()).and_then(|before| moved(before, &block, self.c)) {
            if self.is_usable && self.run.len() > 2 {
                tell(Told::Refused(format!("not used: {why}")));
            }
            (self.has_moved, self.is_usable) = (true, false);
            self.run.clear();
            return None;
        }
        self.run.push(block);
        // The first one may have begun while it was let go.
        if self.run.len() == 2 {
            let why = unusable(&block, self.c, self.left);
            self.is_usable = why.is_none();
            match why {
                Some(why) if self.has_moved => tell(Told::Refused(why)),
                Some(_) => {}
                None => {
                    let side = Side::of(&block, self.c).map_or_else(String::new, |s| s.to_string());
                    tell(Told::Note(format!(
                        "{side} up: still, recording {:.0} s",
                        self.seconds
                    )));
                }
            }
        }
        if !self.is_usable {
            // It may lie there for hours.
            let old = self.run.len().saturating_sub(2);
            self.run.drain(..old);
            return None;
        }
        if self.run.len() <= self.count {
            return None;
        }
        let kept = std::mem::take(&mut self.run).split_off(1);
        self.is_usable = false;
        if let Some(why) = drifted(&kept, self.c) {
            tell(Told::Refused(format!("not used: {why}")));
            return None;
        }
        let side = Side::of(&block, self.c)?;
        Some(Taken { side, blocks: kept })
    }
}

/// Waits for the next side and records it: `count` blocks, within so many s.
fn next_side(
    link: &mut Link,
    blocks: &mut Blocks,
    c: &Calibration,
    (count, within): (usize, f64),
    left: &[Side],
    tell: &mut dyn FnMut(Told),
) -> Result<Taken, SequenceError> {
    let from = link.now().as_secs_f64();
    let seconds = count as f64 * blocks.seconds();
    let mut waiting = Waiting {
        c,
        left,
        count,
        seconds,
        run: Vec::new(),
        has_moved: left.len() == 6,
        is_usable: false,
    };
    loop {
        link.read()?;
        let now = link.now().as_secs_f64();
        if now - from > within + seconds {
            return Err(SequenceError::NotDone {
                what: format!(
                    "no further side within {within:.0} s; left are {}",
                    list(left)
                ),
                help:
                    "begin again, and turn the stand when it is asked for; `--within` waits longer"
                        .to_owned(),
            });
        }
        while let Some(frame) = link.next() {
            let Frame::Sample(sample) = frame else {
                continue;
            };
            let block = blocks.push(&sample, now);
            if let Some(taken) = block.and_then(|block| waiting.take(block, tell)) {
                return Ok(taken);
            }
        }
    }
}

/// Why a stand that lies so is not recorded.
fn unusable(block: &Block, c: &Calibration, left: &[Side]) -> Option<String> {
    match Side::of(block, c) {
        None => Some("the stand lies askew: lay it flat on a side, within 25 degrees".to_owned()),
        Some(side) if !left.contains(&side) => {
            Some(format!("{side} is done: turn it to another side"))
        }
        Some(_) => None,
    }
}

/// Whether it crept while it was recorded, by more than the floor shakes.
fn drifted(blocks: &[Block], c: &Calibration) -> Option<String> {
    let third = blocks.len() / 3;
    (0..3).find_map(|k| {
        let n = third.max(1) as f64;
        let mean = |part: &[Block]| part.iter().map(|b| b.acc[k]).sum::<f64>() / n;
        let variance = |part: &[Block]| part.iter().map(|b| b.acc_variance[k]).sum::<f64>() / n / n;
        let (first, last) = (&blocks[..third], &blocks[blocks.len() - third..]);
        let g = (mean(last) - mean(first)).abs() / c.acc_counts_per_g;
        let shaken = (variance(first) + variance(last)).sqrt() / c.acc_counts_per_g;
        (g > SETTLED_G + 4.0 * shaken)
            .then(|| format!("acc_{} crept by {g:.3} g meanwhile", AXES[k]))
    })
}

/// Zero and scale of the accelerometers, counts and counts per g, with their standard errors.
#[derive(Clone, Copy, Debug)]
struct Accelerometer {
    zero: [(f64, f64); 3],
    scale: [(f64, f64); 3],
}

/// From the six means: the length of gravity is 1 g on every side, however it lies.
fn accelerometer(taken: &[Taken], c: &Calibration) -> Accelerometer {
    let means: Vec<[f64; 3]> = taken
        .iter()
        .map(|t| mean_of(&t.blocks, |b| b.acc))
        .collect();
    let reads = |axis: usize, up: bool| {
        let at = taken.iter().position(|t| t.side == Side { axis, up });
        at.map_or(0.0, |at| means[at][axis])
    };
    let (mut zero, mut scale) = ([c.acc_zero_counts; 3], [c.acc_counts_per_g; 3]);
    for k in 0..3 {
        zero[k] = (reads(k, true) + reads(k, false)) / 2.0;
        scale[k] = (reads(k, true) - reads(k, false)) / 2.0;
    }
    let (zero, scale, inverse) = of_length_one(&means, zero, scale);
    // Errors of the means, to the length of gravity, to the six.
    let sides = taken.iter().zip(&means);
    let of_side: Vec<f64> = sides
        .map(|(t, m)| {
            let n = t.blocks.len() as f64;
            let squares = [0, 1, 2].map(|k| {
                let spread: f64 = t.blocks.iter().map(|b| (b.acc[k] - m[k]).powi(2)).sum();
                // A converter's step hides what is smaller: a twelfth of its square stays.
                let variance = spread / (n - 1.0) / n + 1.0 / 12.0 / (n * LEAST as f64);
                (2.0 * (m[k] - zero[k]) / scale[k].powi(2)).powi(2) * variance
            });
            squares.iter().sum()
        })
        .collect();
    let error = |k: usize| {
        let row = inverse.get(k);
        row.map_or(f64::NAN, |row: &Vec<f64>| {
            let squares = row.iter().zip(&of_side).map(|(a, v)| a * a * v);
            squares.sum::<f64>().sqrt()
        })
    };
    Accelerometer {
        zero: [0, 1, 2].map(|k| (zero[k], error(k))),
        scale: [0, 1, 2].map(|k| (scale[k], error(k + 3))),
    }
}

/// Newton's steps for six unknowns of six equations.
const NEWTON: usize = 8;

/// Zeros and scales by which the six means are of length 1, from others near them, and the inverse of the derivatives there: of
/// the length of each mean to the three zeros and the three scales.
fn of_length_one(
    means: &[[f64; 3]],
    mut zero: [f64; 3],
    mut scale: [f64; 3],
) -> ([f64; 3], [f64; 3], Vec<Vec<f64>>) {
    let mut inverse = Vec::new();
    for _ in 0..NEWTON {
        let in_g = |m: &[f64; 3]| [0, 1, 2].map(|k| (m[k] - zero[k]) / scale[k]);
        let rows = means.iter().map(|m| {
            let g = in_g(m);
            let by_zero = [0, 1, 2].map(|k| -2.0 * g[k] / scale[k]);
            let by_scale = [0, 1, 2].map(|k| -2.0 * g[k] * g[k] / scale[k]);
            by_zero.into_iter().chain(by_scale).collect()
        });
        let Some(found) = inverted(rows.collect()) else {
            break;
        };
        let off = means
            .iter()
            .map(|m| 1.0 - in_g(m).map(|g| g * g).iter().sum::<f64>());
        let off: Vec<f64> = off.collect();
        let along = |row: &Vec<f64>| row.iter().zip(&off).map(|(a, b)| a * b).sum();
        let step: Vec<f64> = found.iter().map(along).collect();
        for k in 0..3 {
            zero[k] += step[k];
            scale[k] += step[k + 3];
        }
        inverse = found;
    }
    (zero, scale, inverse)
}

fn mean_of(blocks: &[Block], of: impl Fn(&Block) -> [f64; 3]) -> [f64; 3] {
    let n = blocks.len().max(1) as f64;
    [0, 1, 2].map(|k| blocks.iter().map(|b| of(b)[k]).sum::<f64>() / n)
}

/// The inverse of a square matrix, by Gauss and Jordan with the largest pivot; `None` where there is none.
pub(super) fn inverted(mut a: Vec<Vec<f64>>) -> Option<Vec<Vec<f64>>> {
    let n = a.len();
    for (i, row) in a.iter_mut().enumerate() {
        row.extend((0..n).map(|k| if k == i { 1.0 } else { 0.0 }));
    }
    for column in 0..n {
        let pivot =
            (column..n).max_by(|i, j| a[*i][column].abs().total_cmp(&a[*j][column].abs()))?;
        a.swap(column, pivot);
        let by = a[column][column];
        if by.abs() < 1e-12 {
            return None;
        }
        a[column].iter_mut().for_each(|v| *v /= by);
        let row = a[column].clone();
        for (_, other) in a.iter_mut().enumerate().filter(|(i, _)| *i != column) {
            let times = other[column];
            other
                .iter_mut()
                .zip(&row)
                .for_each(|(v, r)| *v -= times * r);
        }
    }
    Some(a.into_iter().map(|row| row[n..].to_vec()).collect())
}

/// The gyros over what gravity is on each axis.
fn gyro(k: usize, taken: &[Taken], acc: &Accelerometer, variance: f64) -> Option<Fit> {
    let all = || {
        taken.iter().flat_map(|t| {
            let mean = mean_of(&t.blocks, |b| b.acc);
            t.blocks.iter().map(move |b| (b, mean))
        })
    };
    let y: Vec<f64> = all().map(|(b, _)| b.gyro[k]).collect();
    let t: Vec<f64> = all().map(|(b, _)| b.t).collect();
    let mut columns = vec![vec![1.0; y.len()]];
    for axis in 0..3 {
        let g = |(_, mean): (&Block, [f64; 3])| (mean[axis] - acc.zero[axis].0) / acc.scale[axis].0;
        columns.push(all().map(g).collect());
    }
    fit(&y, &t, &vec![variance; y.len()], &columns)
}

/// Between which temperatures it was.
fn range_of(taken: &[Taken]) -> [f64; 2] {
    let all = taken
        .iter()
        .flat_map(|t| t.blocks.iter().flat_map(|b| b.temp));
    all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| {
        [low.min(v), high.max(v)]
    })
}

fn outcome(taken: &[Taken], c: &Calibration, refused: Vec<String>) -> Outcome {
    let acc = accelerometer(taken, c);
    let mut out = Outcome {
        refused,
        temperatures: Some(range_of(taken)),
        ..Outcome::of(&SEQUENCES[0], c.rate_hz, c.gyro_lsb_dps)
    };
    for (k, axis) in AXES.iter().enumerate() {
        let sizes = [
            ("zero", acc.zero[k], "counts"),
            ("scale", acc.scale[k], "counts/g"),
        ];
        out.identified
            .extend(sizes.map(|(what, (value, error), unit)| Identified {
                channel: format!("acc_{axis}"),
                what: what.to_owned(),
                size: Parameter::estimated(value, error, unit),
            }));
    }
    let runs: Vec<&[Block]> = taken.iter().map(|t| &t.blocks[..]).collect();
    let seconds = taken[0].blocks[1].t - taken[0].blocks[0].t;
    for (k, variance) in white(&runs).into_iter().enumerate() {
        let Some(found) = gyro(k, taken, &acc, variance) else {
            continue;
        };
        // The board counts acceleration from where its accelerometer would read 0 g if it had no error.
        let from_nominal: f64 = (0..3)
            .map(|i| found.values[i + 1] * (acc.zero[i].0 - c.acc_zero_counts) / c.acc_counts_per_g)
            .sum();
        out.baseline[k] = Some((
            Parameter::estimated(found.values[0] - from_nominal, found.errors[0], "deg/s"),
            Parameter::exact((variance * seconds).sqrt() * 60.0, "deg/sqrt(h)"),
        ));
        add_g_sensitivity(&mut out, format!("gyro_{}", AXES[k]), &found);
    }
    out
}

/// The three sensitivities to acceleration that follow the bias of a gyro in its fit.
fn add_g_sensitivity(out: &mut Outcome, channel: String, found: &Fit) {
    let of_axis =
        |i: usize| Parameter::estimated(found.values[i + 1], found.errors[i + 1], "deg/s/g");
    out.identified.extend((0..3).map(|i| Identified {
        channel: channel.clone(),
        what: format!("g-sensitivity along {}", AXES[i]),
        size: of_axis(i),
    }));
    let parameters = (0..3).map(|i| (format!("acc_{}", AXES[i]), of_axis(i)));
    out.effects.push(EffectModel {
        cause: "g_sensitivity".to_owned(),
        channels: vec![channel],
        parameters: parameters.collect(),
    });
}
