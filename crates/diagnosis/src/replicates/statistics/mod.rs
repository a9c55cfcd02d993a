//! What is compared of a record and its replicates: one fixed list for every channel.

mod codes;
mod deviations;
mod local;
mod spectrum;

use std::ops::Range;

use model::record::{Quantity, Record};

use super::world::Parts;
use codes::Codes;
use deviations::Deviations;
use local::Local;
use spectrum::{Spectrum, Transforms};

/// A statistic.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Statistic {
    /// Its name.
    pub what: String,
    /// Its unit.
    pub unit: String,
    /// The other axis, where it is of two.
    pub with: Option<String>,
    /// Whether it is of what is slower than [`REPLAYED_HZ`].
    pub slow: bool,
}

/// Below it the readings of an axis that moved are the record's own in every replicate, Hz: nothing new is told there.
pub(super) const REPLAYED_HZ: f64 = 1.0;

impl Statistic {
    fn new(what: impl Into<String>, unit: &str) -> Self {
        Self {
            what: what.into(),
            unit: unit.to_owned(),
            with: None,
            slow: false,
        }
    }

    /// Of what is slower than so many Hz.
    fn below(mut self, hz: f64) -> Self {
        self.slow = hz <= REPLAYED_HZ;
        self
    }

    fn with(mut self, other: &str) -> Self {
        self.with = Some(other.to_owned());
        self
    }
}

/// What the list is made for: a channel and its baseline noise.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Subject {
    /// Name of the channel.
    pub name: String,
    /// Unit of its readings.
    pub unit: String,
    /// Step of its readings, 0 where there is none.
    pub step: f64,
    /// Whether each reading is a known count of steps.
    pub counted: bool,
    /// Variance of a step of the random walk over that of the white noise: what the spectrum is whitened by.
    pub walk: f64,
}

/// The list of a record's channels, and what computes it.
pub(super) struct Battery {
    /// Of all channels, one after the other.
    pub statistics: Vec<Statistic>,
    /// Those of each channel.
    pub channels: Vec<Range<usize>>,
    of: Vec<OfChannel>,
    spectrum: Spectrum,
    deviations: Deviations,
}

/// What the computing takes beside the list: transforms and room. Each thread has its own.
pub(super) struct Work {
    transforms: Transforms,
    centred: Vec<f64>,
    sums: Vec<f64>,
    residual: Vec<f64>,
    codes: Vec<u8>,
}

struct OfChannel {
    codes: Codes,
    local: Local,
    slopes: spectrum::Slopes,
    white: Vec<f64>,
}

impl Battery {
    /// For a record in these parts.
    pub fn new(subjects: &[Subject], record: &Record, rate_hz: f64, parts: &Parts) -> Self {
        let spectrum = Spectrum::new(parts.length, rate_hz);
        let deviations = Deviations::new(parts.length, parts.stretches.len(), rate_hz);
        let duty = record
            .all(Quantity::Pwm)
            .next()
            .map(|c| parts.pick(&c.values));
        let of: Vec<OfChannel> = subjects
            .iter()
            .map(|s| OfChannel {
                codes: Codes::new(s.step, s.counted),
                local: Local::new(parts.length, duty.as_deref()),
                slopes: spectrum.slopes(s, record, parts),
                white: spectrum.whitener(s.walk),
            })
            .collect();
        let (mut statistics, mut channels) = (vec![], vec![]);
        for (subject, of) in subjects.iter().zip(&of) {
            let from = statistics.len();
            let unit = subject.unit.as_str();
            statistics.push(Statistic::new("mean", unit).below(0.0));
            statistics.push(Statistic::new("rms about the mean", unit));
            deviations.name(unit, &mut statistics);
            spectrum.name(unit, &mut statistics);
            of.slopes.name(unit, &mut statistics);
            of.local.name(unit, &mut statistics);
            of.codes.name(&mut statistics);
            let others = subjects.iter().filter(|o| o.name != subject.name);
            others.for_each(|o| spectrum.name_with(&o.name, &mut statistics));
            channels.push(from..statistics.len());
        }
        Self {
            statistics,
            channels,
            of,
            spectrum,
            deviations,
        }
    }

    /// What a thread needs.
    pub fn work(&self) -> Work {
        Work {
            transforms: self.spectrum.transforms(),
            centred: vec![],
            sums: vec![],
            residual: vec![],
            codes: vec![],
        }
    }

    /// The statistics of one record or replicate, given the readings of each channel.
    pub fn of(&self, readings: &[Vec<f64>], work: &mut Work) -> Vec<f64> {
        let mut all = Vec::with_capacity(self.statistics.len());
        let whitened: Vec<_> = (readings.iter().zip(&self.of))
            .map(|(x, of)| self.spectrum.of(x, &of.white, &work.transforms))
            .collect();
        let correlated = self.spectrum.correlated(&whitened);
        let Work {
            transforms,
            centred,
            sums,
            residual,
            codes,
        } = work;
        for (k, (x, of)) in readings.iter().zip(&self.of).enumerate() {
            let mean = x.iter().sum::<f64>() / x.len() as f64;
            let (mut square, mut sum) = (0.0, 0.0);
            centred.clear();
            sums.clear();
            sums.push(0.0);
            centred.extend(x.iter().map(|v| v - mean));
            sums.extend(centred.iter().map(|v| {
                square += v * v;
                sum += v;
                sum
            }));
            all.push(mean);
            all.push((square / x.len() as f64).sqrt());
            self.deviations.take(sums, &mut all);
            self.spectrum.take(&whitened[k], transforms, &mut all);
            of.slopes.take(&whitened[k], &mut all);
            of.local.take(centred, sums, residual, &mut all);
            of.codes.take(x, codes, &mut all);
            let others = (0..readings.len()).filter(|o| *o != k);
            all.extend(others.flat_map(|o| correlated[k][o]));
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;

    fn battery(n: usize) -> Battery {
        let subject = |name: &str| Subject {
            name: name.into(),
            unit: "deg/s".into(),
            step: 0.25,
            counted: true,
            walk: 0.0,
        };
        let parts = Parts::of(n, 20.0);
        Battery::new(
            &[subject("gyro_x"), subject("gyro_y")],
            &Record::default(),
            20.0,
            &parts,
        )
    }

    #[test]
    fn white_noise_has_the_values_of_white_noise() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
        let n = 12_000;
        let mut noise = || -> Vec<f64> {
            (0..n)
                .map(|_| {
                    let e: f64 = StandardNormal.sample(&mut rng);
                    (e / 0.25).round() * 0.25
                })
                .collect()
        };
        let battery = battery(n);
        let values = battery.of(&[noise(), noise()], &mut battery.work());
        assert_eq!(values.len(), battery.statistics.len());
        // 12 000 samples: sigma to 0.65 %, a correlation to 0.009, a third octave at the top to 2 %.
        let value = |what: &str| {
            let k = battery.statistics.iter().position(|s| s.what == what);
            k.map_or(f64::NAN, |k| values[k])
        };
        assert!((value("rms about the mean") - 1.003).abs() < 0.03);
        assert!((value("Allan deviation at 0.05 s") - 1.003).abs() < 0.04);
        assert!((value("Allan deviation at 0.8 s") - 0.25).abs() < 0.03);
        // sigma sqrt(T tau0) deg over T = 10 s.
        assert!((value("change of the angle over 10 s") - 0.5f64.sqrt()).abs() < 0.15);
        assert!(value("correlation at a lag of 1 sample").abs() < 0.04);
        assert!(value("largest correlation beyond 5 samples").abs() < 0.06);
        assert!(value("correlation with gyro_y").abs() < 0.04);
        assert!((value("kurtosis about the local mean") - 3.0).abs() < 0.2);
        assert!((value("share of ones in bit 0") - 0.5).abs() < 0.02);
    }

    #[test]
    fn an_echo_is_the_largest_correlation_and_shared_noise_one_with_the_other_axis() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(4);
        let n = 12_000;
        let e: Vec<f64> = (0..n).map(|_| StandardNormal.sample(&mut rng)).collect();
        let late: Vec<f64> = (0..n)
            .map(|i| e[i] + if i >= 700 { 0.3 * e[i - 700] } else { 0.0 })
            .collect();
        let battery = battery(n);
        let values = battery.of(&[late, e], &mut battery.work());
        let value = |what: &str| {
            let k = battery.statistics.iter().position(|s| s.what == what);
            k.map_or(f64::NAN, |k| values[k])
        };
        // 0.3 / 1.09, of which the sum over the mirrored record tapers little at a lag of 700 of 12 000.
        assert!((value("largest correlation beyond 5 samples") - 0.275).abs() < 0.04);
        assert!((value("correlation with gyro_y") - 1.0 / 1.09f64.sqrt()).abs() < 0.02);
    }
}
