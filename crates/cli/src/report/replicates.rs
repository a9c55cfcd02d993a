//! Simulated replicates of a record: what its model would have given, again and again.

use std::ops::Range;
use std::thread;

use model::file::ModelFile;
use model::record::Record;
use model::record::sampling::Sampling;
use model::simulate::{Replicas, SimulateError};
use noise::allan::{Phase, TauGrid};

/// Instants at which the integrated angle is compared.
const ANGLE_POINTS: usize = 150;
/// Share of the record over which the bias is calibrated before the angle is integrated.
const CALIBRATION: usize = 10;
/// The record has to be at least this many times longer than the longest cluster time (the paper's rule).
const LONGER_THAN_TAU: usize = 10;
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

/// Places at which curves are read off.
pub struct Places<'a> {
    sampling: &'a Sampling,
    rows: usize,
}

impl<'a> Places<'a> {
    /// For a record of `rows` rows sampled so.
    #[must_use]
    pub fn new(sampling: &'a Sampling, rows: usize) -> Self {
        Self { sampling, rows }
    }

    /// The abscissae of the curves of a channel.
    #[must_use]
    pub fn abscissae(&self, values: &[f64]) -> Abscissae {
        let tau0 = self.sampling.tau0;
        let calibration = self.rows / CALIBRATION;
        Abscissae {
            tau_s: self
                .factors(values)
                .iter()
                .map(|m| *m as f64 * tau0)
                .collect(),
            angle_s: self
                .angle_rows()
                .map(|row| (row - calibration) as f64 * tau0)
                .collect(),
            calibration_s: calibration as f64 * tau0,
        }
    }

    fn factors(&self, values: &[f64]) -> Vec<usize> {
        let samples: usize = self
            .sampling
            .runs_of(values)
            .iter()
            .map(ExactSizeIterator::len)
            .sum();
        TauGrid::Octave.factors(samples / LONGER_THAN_TAU)
    }

    fn angle_rows(&self) -> impl Iterator<Item = usize> {
        let calibration = self.rows / CALIBRATION;
        let rest = self.rows - calibration;
        (1..=ANGLE_POINTS).map(move |k| calibration + k * rest / ANGLE_POINTS)
    }

    /// The curves of a channel. Rows that it lacks are neither filled nor integrated.
    #[must_use]
    pub fn curves(&self, values: &[f64]) -> Curves {
        let tau0 = self.sampling.tau0;
        let factors = self.factors(values);
        let phase = Phase::from_values(values, &self.sampling.runs_of(values));
        let mut deviations = phase
            .overlapping_allan(tau0, &factors)
            .into_iter()
            .peekable();
        // A cluster time that no run is long enough for has no deviation.
        let ln_adev = factors
            .iter()
            .map(|m| {
                let own = deviations.next_if(|estimate| estimate.m == *m);
                own.map_or(f64::NAN, |estimate| estimate.deviation.ln())
            })
            .collect();
        let calibration = self.rows / CALIBRATION;
        let finite = values[..calibration].iter().filter(|v| v.is_finite());
        let (sum, count) = finite.fold((0.0, 0), |(sum, n), v| (sum + v, n + 1));
        let bias = sum / count.max(1) as f64;
        let mut angle = Vec::with_capacity(ANGLE_POINTS);
        let (mut sum, mut row) = (0.0, calibration);
        for until in self.angle_rows() {
            sum += values[row..until]
                .iter()
                .filter(|v| v.is_finite())
                .map(|v| (v - bias) * tau0)
                .sum::<f64>();
            row = until;
            angle.push(sum);
        }
        Curves { ln_adev, angle }
    }
}

/// Readings of each channel, once, and the curves of each, every time.
type Drawn = (Vec<Vec<f64>>, Vec<Vec<Curves>>);

/// Simulates a model in the world that the record saw, `count` times, with the record's own gaps: the readings of each
/// channel of the model once, and the curves of each every time. The second half is drawn beside the first where there is a
/// thread for it (a browser has none), with the same numbers.
///
/// # Errors
/// Those of the simulation.
pub fn replicate(
    model: &ModelFile,
    record: &Record,
    places: &Places<'_>,
    count: usize,
    seed: u64,
) -> Result<Drawn, SimulateError> {
    let draws = |of: Range<u64>| draws(model, record, places, of, seed);
    let (count, half) = (count as u64, count.div_ceil(2) as u64);
    thread::scope(|threads| {
        let beside = thread::Builder::new().spawn_scoped(threads, || draws(half..count));
        let (once, mut curves) = draws(0..half)?;
        let (_, rest) = match beside {
            Ok(thread) => thread
                .join()
                .unwrap_or_else(|panic| std::panic::resume_unwind(panic)),
            Err(_) => draws(half..count),
        }?;
        for (curves, rest) in curves.iter_mut().zip(rest) {
            curves.extend(rest);
        }
        Ok((once, curves))
    })
}

/// Some of the draws, by their numbers, and the readings of the first of them.
fn draws(
    model: &ModelFile,
    record: &Record,
    places: &Places<'_>,
    numbers: Range<u64>,
    seed: u64,
) -> Result<Drawn, SimulateError> {
    let mut replicas = Replicas::new(model, record, model.rate_hz, &[])?;
    let mut readings = vec![];
    let mut curves = vec![Vec::new(); model.channels.len()];
    let mut once = vec![];
    let first = numbers.start;
    for k in numbers {
        replicas.draw(seed.wrapping_add(k), &mut readings);
        for (channel, values) in model.channels.iter().zip(&mut readings) {
            let measured = record.channel(&channel.name).map(|c| c.values.iter());
            for (value, measured) in values.iter_mut().zip(measured.into_iter().flatten()) {
                if !measured.is_finite() {
                    *value = f64::NAN;
                }
            }
        }
        for (curves, values) in curves.iter_mut().zip(&readings) {
            curves.push(places.curves(values));
        }
        if k == first {
            once.clone_from(&readings);
        }
    }
    Ok((once, curves))
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
                let places = Places::new(&sampling, record.len());
                let (_, replicates) = replicate(&paper, &record, &places, 99, seed * 1000).unwrap();
                let measured = places.curves(&record.channel("gyro_x").unwrap().values);
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
        let places = Places::new(&sampling, rows);
        let values = &record.channels[0].values;
        let (curves, at) = (places.curves(values), places.abscissae(values));
        assert!((at.calibration_s - 30.0).abs() < 1e-9);
        let (first, last) = (curves.angle[0], *curves.angle.last().unwrap());
        assert!((first - 2.0 * at.angle_s[0]).abs() < 1e-9);
        // One reading is missing and is not invented: 2 deg/s over 0.05 s less.
        assert!((last - (2.0 * at.angle_s.last().unwrap() - 0.1)).abs() < 1e-9);
    }
}
