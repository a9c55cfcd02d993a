//! Simulated replicates of a record: what its model would have given, again and again.

use std::ops::Range;
use std::thread;

use model::file::ModelFile;
use model::record::Record;
use model::record::sampling::Sampling;
use model::simulate::{Replicas, SimulateError};
use noise::allan::{Estimate, Phase, TauGrid};
use numerics::column;

/// Instants at which the integrated angle is compared.
const ANGLE_POINTS: usize = 150;
/// Share of the record over which the bias is calibrated before the angle is integrated.
const CALIBRATION: usize = 10;
/// The record has to be at least this many times longer than the longest cluster time (the paper's rule).
const LONGER_THAN_TAU: usize = 10;
/// Rows of a record above which a long cluster time is read at every [`THINNED`]th place only: the places of the others say
/// the same again.
const LONG: usize = 1 << 18;
const THINNED: usize = 8;
/// Places in a cluster time that is read so, at least.
const OVERLAPS: usize = 8;
/// Coverage of the bands.
const COVERAGE: f64 = 0.95;

/// What is compared of one channel, measured or simulated.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Curves {
    /// ln of the overlapping Allan deviation by octaves, unit of the channel.
    pub ln_adev: Vec<f64>,
    /// Integral of the reading less the calibrated bias, unit of the channel times s.
    pub angle: Vec<f64>,
}

/// The abscissae of [`Curves`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Abscissae {
    /// Cluster times, s.
    pub tau_s: Vec<f64>,
    /// Times of the angle since the end of the calibration, s.
    pub angle_s: Vec<f64>,
    /// Length of the calibration, s.
    pub calibration_s: f64,
}

/// A band that holds [`COVERAGE`] of the replicates.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Band {
    /// Lower edge.
    pub low: Vec<f64>,
    /// Median (angle) or geometric mean (deviation).
    pub middle: Vec<f64>,
    /// Upper edge.
    pub high: Vec<f64>,
}

/// One channel, measured, beside one model.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Against {
    /// Allan deviation: simultaneous over all cluster times.
    pub adev: Band,
    /// Chance that a replicate strays from the model's mean curve, anywhere, as far as the measurement does.
    pub adev_p: f64,
    /// How many replicates that rests on.
    pub replicates: usize,
    /// Angle: at each instant by itself.
    pub angle: Band,
}

/// Places at which the curves of one channel are read off.
#[derive(Clone, Debug)]
pub struct Places {
    tau0: f64,
    rows: usize,
    /// Rows without a gap between them. A replicate lacks the readings that the record lacks, and has the same.
    runs: Vec<Range<usize>>,
    factors: Vec<usize>,
    /// Rows without a reading.
    missing: Vec<usize>,
}

impl Places {
    /// For the readings of a channel of a record sampled so.
    #[must_use]
    pub fn new(sampling: &Sampling, values: &[f64]) -> Self {
        let runs = sampling.runs_of(values);
        let samples: usize = runs.iter().map(ExactSizeIterator::len).sum();
        Self {
            tau0: sampling.tau0,
            rows: values.len(),
            factors: TauGrid::Octave.factors(samples / LONGER_THAN_TAU),
            runs,
            missing: (0..values.len())
                .filter(|row| !values[*row].is_finite())
                .collect(),
        }
    }

    /// The abscissae of the curves.
    #[must_use]
    pub fn abscissae(&self) -> Abscissae {
        let calibration = self.rows / CALIBRATION;
        Abscissae {
            tau_s: self.factors.iter().map(|m| *m as f64 * self.tau0).collect(),
            angle_s: self
                .angle_rows()
                .map(|row| (row - calibration) as f64 * self.tau0)
                .collect(),
            calibration_s: calibration as f64 * self.tau0,
        }
    }

    fn angle_rows(&self) -> impl Iterator<Item = usize> {
        let calibration = self.rows / CALIBRATION;
        let rest = self.rows - calibration;
        (1..=ANGLE_POINTS).map(move |k| calibration + k * rest / ANGLE_POINTS)
    }

    /// Whether every row has a reading, and none is missing between them.
    fn is_whole(&self) -> bool {
        self.runs.iter().eq([&(0..self.rows)])
    }

    /// The curves of readings that lack what the channel lacks: that is neither filled nor integrated.
    #[must_use]
    pub fn curves(&self, values: &[f64]) -> Curves {
        Curves {
            ln_adev: self.ln_adev(values),
            angle: self.angle(values),
        }
    }

    fn ln_adev(&self, values: &[f64]) -> Vec<f64> {
        let is_thinned = self.rows > LONG && self.is_whole();
        let split = match is_thinned {
            true => self.factors.partition_point(|m| *m < OVERLAPS * THINNED),
            false => self.factors.len(),
        };
        let (short, long) = self.factors.split_at(split);
        let mut estimates =
            Phase::from_values(values, &self.runs).overlapping_allan(self.tau0, short);
        if !long.is_empty() {
            let (groups, _) = values.as_chunks::<THINNED>();
            let means: Vec<f64> = groups
                .iter()
                .map(|g| g.iter().sum::<f64>() / THINNED as f64)
                .collect();
            let factors: Vec<usize> = long.iter().map(|m| m / THINNED).collect();
            let thinned =
                Phase::in_place(means).overlapping_allan(self.tau0 * THINNED as f64, &factors);
            estimates.extend(thinned.into_iter().map(|e| Estimate {
                m: e.m * THINNED,
                ..e
            }));
        }
        // A cluster time that no run is long enough for has no deviation.
        let mut estimates = estimates.into_iter().peekable();
        self.factors
            .iter()
            .map(|m| {
                let own = estimates.next_if(|estimate| estimate.m == *m);
                own.map_or(f64::NAN, |estimate| estimate.deviation.ln())
            })
            .collect()
    }

    fn angle(&self, values: &[f64]) -> Vec<f64> {
        let is_whole = self.is_whole();
        let total = |part: &[f64]| match is_whole {
            true => (column::sum_of(part, |v| v), part.len()),
            false => part
                .iter()
                .filter(|v| v.is_finite())
                .fold((0.0, 0), |(sum, n), v| (sum + v, n + 1)),
        };
        let calibration = self.rows / CALIBRATION;
        let (sum, count) = total(&values[..calibration]);
        let bias = sum / count.max(1) as f64;
        let mut angle = Vec::with_capacity(ANGLE_POINTS);
        let (mut all, mut row) = (0.0, calibration);
        for until in self.angle_rows() {
            let (sum, count) = total(&values[row..until]);
            all += (sum - bias * count as f64) * self.tau0;
            row = until;
            angle.push(all);
        }
        angle
    }
}

/// Readings of each channel, once, and the curves of each, every time.
type Drawn = (Vec<Vec<f64>>, Vec<Vec<Curves>>);

/// Simulates a model in the world that the record saw, `count` times, with the record's own gaps: the readings of each
/// channel of the model once, and the curves of those that have places every time. The second half is drawn beside the first where there is a
/// thread for it (a browser has none), with the same numbers.
///
/// # Errors
/// Those of the simulation.
pub fn replicate(
    model: &ModelFile,
    record: &Record,
    places: &[Option<Places>],
    count: usize,
    seed: u64,
) -> Result<Drawn, SimulateError> {
    let replicas = Replicas::new(model, record, model.rate_hz, &[])?;
    let draws = |of: Range<u64>| draws(replicas.clone(), places, of, seed);
    let (count, half) = (count as u64, count.div_ceil(2) as u64);
    thread::scope(|threads| {
        let beside = thread::Builder::new().spawn_scoped(threads, || draws(half..count));
        let (once, mut curves) = draws(0..half);
        let (_, rest) = match beside {
            Ok(thread) => thread
                .join()
                .unwrap_or_else(|panic| std::panic::resume_unwind(panic)),
            Err(_) => draws(half..count),
        };
        for (curves, rest) in curves.iter_mut().zip(rest) {
            curves.extend(rest);
        }
        Ok((once, curves))
    })
}

/// Some of the draws, by their numbers, and the readings of the first of them.
fn draws(
    mut replicas: Replicas,
    places: &[Option<Places>],
    numbers: Range<u64>,
    seed: u64,
) -> Drawn {
    let mut readings = vec![];
    let mut curves = vec![Vec::new(); places.len()];
    let mut once = vec![];
    let first = numbers.start;
    for k in numbers {
        replicas.draw(seed.wrapping_add(k), &mut readings);
        for ((places, curves), values) in places.iter().zip(&mut curves).zip(&mut readings) {
            // The record lacks the channel: nothing is held against it.
            let Some(places) = places else { continue };
            for row in &places.missing {
                values[*row] = f64::NAN;
            }
            curves.push(places.curves(values));
        }
        if k == first {
            once.clone_from(&readings);
        }
    }
    (once, curves)
}

/// Holds the measured curves against replicates.
#[must_use]
pub fn against(measured: &Curves, replicates: &[Curves]) -> Against {
    let count = replicates.len() as f64;
    let points = measured.ln_adev.len();
    let (mut mean, mut spread) = (vec![0.0; points], vec![0.0; points]);
    for i in 0..points {
        let all = || replicates.iter().map(|r| r.ln_adev[i]);
        mean[i] = all().sum::<f64>() / count;
        let square = all().map(|v| (v - mean[i]).powi(2)).sum::<f64>();
        spread[i] = (square / (count - 1.0)).sqrt();
    }
    let strays = |curves: &Curves| {
        (0..points)
            .filter(|i| spread[*i] > 0.0)
            .map(|i| ((curves.ln_adev[i] - mean[i]) / spread[i]).abs())
            .fold(0.0, f64::max)
    };
    let mut farthest: Vec<f64> = replicates.iter().map(strays).collect();
    farthest.sort_by(f64::total_cmp);
    let limit = quantile(&farthest, COVERAGE);
    let own = strays(measured);
    let beyond = farthest.iter().filter(|far| **far >= own).count();
    let edge = |side: f64| {
        (0..points)
            .map(|i| (mean[i] + side * limit * spread[i]).exp())
            .collect()
    };
    let mut angle = Band::default();
    for i in 0..measured.angle.len() {
        let mut all: Vec<f64> = replicates.iter().map(|r| r.angle[i]).collect();
        all.sort_by(f64::total_cmp);
        angle.low.push(quantile(&all, (1.0 - COVERAGE) / 2.0));
        angle.middle.push(quantile(&all, 0.5));
        angle.high.push(quantile(&all, (1.0 + COVERAGE) / 2.0));
    }
    Against {
        adev: Band {
            low: edge(-1.0),
            middle: edge(0.0),
            high: edge(1.0),
        },
        adev_p: (beyond as f64 + 1.0) / (count + 1.0),
        replicates: replicates.len(),
        angle,
    }
}

/// Of sorted values, so that one more of their law lies below it with that chance: of n + 1 values each has any rank.
fn quantile(sorted: &[f64], q: f64) -> f64 {
    let rank = (sorted.len() as f64 + 1.0) * q;
    // Outwards, as far as rounding of the product does not decide.
    let rank = if q > 0.5 {
        (rank - 1e-9).ceil()
    } else {
        (rank + 1e-9).floor()
    };
    let last = sorted.len().saturating_sub(1);
    let at = (rank as usize).saturating_sub(1).min(last);
    sorted.get(at).copied().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(model: &ModelFile, seed: u64) -> Record {
        model::simulate(model, 300.0, 20.0, seed).expect("the paper's stand simulates")
    }

    #[test]
    fn a_record_of_the_model_is_within_its_bands_and_one_of_another_model_is_not() {
        let paper = ModelFile::paper();
        let mut noisy = paper.clone();
        for parameter in noisy
            .channels
            .iter_mut()
            .filter_map(|c| c.baseline.get_mut("angle_random_walk"))
        {
            // 6000 samples know sigma to 1 %.
            parameter.value *= 1.2;
        }
        let mut outcomes = [0; 2];
        for seed in 0..20 {
            for (model, outcome) in [&paper, &noisy].into_iter().zip(&mut outcomes) {
                let record = record(model, 1000 + seed);
                let sampling = Sampling::of(&record, None).unwrap();
                let values = &record.channel("gyro_x").unwrap().values;
                let places = Places::new(&sampling, values);
                let measured = places.curves(values);
                let places = [Some(places)];
                let (_, replicates) = replicate(&paper, &record, &places, 99, seed * 1000).unwrap();
                *outcome += usize::from(against(&measured, &replicates[0]).adev_p <= 0.02);
            }
        }
        // At 2 %, four or more of twenty right ones are rejected with a chance of 0.6 %.
        assert!(outcomes[0] <= 3, "{outcomes:?}");
        assert_eq!(outcomes[1], 20, "{outcomes:?}");
    }

    #[test]
    fn the_edges_of_a_band_leave_their_share_of_the_ranks() {
        let sorted = |n: usize| (0..n).map(|k| k as f64).collect::<Vec<_>>();
        // 40 ranks: one on either side of 95 %; two above 95 %.
        let of = sorted(39);
        assert_eq!(
            [0.025, 0.5, 0.975, 0.95].map(|q| quantile(&of, q)),
            [0.0, 19.0, 38.0, 37.0]
        );
        // 200 ranks: five on either side, ten above.
        let of = sorted(199);
        assert_eq!(
            [0.025, 0.5, 0.975, 0.95].map(|q| quantile(&of, q)),
            [4.0, 99.0, 194.0, 189.0]
        );
    }

    #[test]
    fn the_angle_of_a_constant_rate_after_calibration_is_a_straight_line() {
        let paper = ModelFile::paper();
        let mut record = record(&paper, 1);
        let rows = record.len();
        let values = &mut record.channels[0].values;
        for (row, value) in values.iter_mut().enumerate() {
            *value = if row < rows / 10 { 3.0 } else { 5.0 };
        }
        values[rows / 2] = f64::NAN;
        let sampling = Sampling::of(&record, None).unwrap();
        let values = &record.channels[0].values;
        let places = Places::new(&sampling, values);
        let (curves, at) = (places.curves(values), places.abscissae());
        assert!((at.calibration_s - 30.0).abs() < 1e-9);
        let (first, last) = (curves.angle[0], *curves.angle.last().unwrap());
        assert!((first - 2.0 * at.angle_s[0]).abs() < 1e-9);
        // One reading is missing and is not invented: 2 deg/s over 0.05 s less.
        assert!((last - (2.0 * at.angle_s.last().unwrap() - 0.1)).abs() < 1e-9);
    }

    #[test]
    fn a_long_record_has_the_curve_that_all_places_of_its_clusters_give() {
        let mut model = ModelFile::paper();
        model.channels.truncate(1);
        let record = model::simulate(&model, 15_000.0, 20.0, 3).expect("it simulates");
        let values = &record.channels[0].values;
        assert!(values.len() > LONG);
        let sampling = Sampling::of(&record, None).unwrap();
        let places = Places::new(&sampling, values);
        let all = Phase::from_values(values, &places.runs)
            .overlapping_allan(sampling.tau0, &places.factors);
        let curve = places.curves(values).ln_adev;
        assert_eq!(curve.len(), all.len());
        for (ln, all) in curve.iter().zip(&all) {
            // A deviation of 64 samples is known to 1 % in this record.
            assert!(
                (ln - all.deviation.ln()).abs() < 2e-3,
                "{all:?} {}",
                ln.exp()
            );
        }
        assert!((0..curve.len()).any(|i| curve[i] != all[i].deviation.ln()));
    }
}
