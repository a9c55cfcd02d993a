//! What a live view shows: the last second of every channel, what was lost, the board's counters, and Allan deviations
//! that grow with the run at constant memory.

mod control;
mod page;
mod screen;

use std::collections::VecDeque;

use noise::allan::{Deviation, Streaming};
use noise::edf::{NoiseType, chi_square_interval, edf};
use serde::Serialize;
use wire::{Frame, Hello, Sample, flags};

use crate::RecordBuilder;
use crate::capture::{Calibration, Continuity, STANDARD_GRAVITY, SUPPLY_LSB_V, TEMP};
use crate::link::Heard;

pub use control::{Action, Control};
pub use screen::{About, Axes, Key, Screen};

/// Longest averaging time, as a power of two of samples: 2^17 at 20 Hz are 1.8 h, and 4 MB for each gyro.
const OCTAVES: u32 = 17;
/// Confidence of the intervals, as everywhere.
const CONFIDENCE: f64 = 0.95;
const AXES: [&str; 3] = ["x", "y", "z"];

/// A deviation so far.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Point {
    /// Averaging time, s.
    pub tau_s: f64,
    /// deg/s.
    pub deviation: f64,
    /// Of the 95 % interval, deg/s.
    pub low: f64,
    /// Of the 95 % interval, deg/s.
    pub high: f64,
}

/// A gyro over the last second.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Recent {
    /// Mean rate, scaled by the nominal factor, no bias subtracted, deg/s; null where there was no sample.
    pub mean_dps: Option<f64>,
    /// Spread about it, deg/s.
    pub rms_dps: Option<f64>,
    /// degC.
    pub temp_c: Option<f64>,
}

/// All that is shown.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Snapshot {
    /// Names the shape of this file.
    pub format: &'static str,
    /// Since the first sample, s.
    pub seconds: f64,
    /// Samples.
    pub samples: u64,
    /// Sample instants without one.
    pub missing: u64,
    /// Samples that the board lost, by its own counters.
    pub lost_by_board: u64,
    /// Samples that the line lost.
    pub lost_by_line: u64,
    /// Frames that were rejected.
    pub rejected: u32,
    /// Restarts of the board.
    pub restarts: u64,
    /// Largest distance of two neighbouring sampling instants of the last second from their period, by the board's clock, s.
    pub sampling_jitter_s: Option<f64>,
    /// Spread of the times of arrival about the board's, over the last second, s.
    pub arrival_jitter_s: Option<f64>,
    /// Hz, as the board says.
    pub rate_hz: f64,
    /// The board's clock against this computer's, ppm; null before a minute has passed.
    pub clock_ppm: Option<f64>,
    /// x, y, z.
    pub gyros: [Recent; 3],
    /// x, y, z, m/s^2.
    pub acc_mps2: [Option<f64>; 3],
    /// V.
    pub supply_v: Option<f64>,
    /// Motor command.
    pub pwm: Option<i16>,
    /// Flags of the last second's samples: set in any of them (and NEW, missing in any of them).
    pub flags: Vec<&'static str>,
    /// Overlapping Allan deviation, x, y, z.
    pub allan: [Vec<Point>; 3],
    /// Counters of the board that are not 0; null before it has sent them.
    pub counters: Option<Vec<(&'static str, u16)>>,
}

/// Runs that are remembered: a line that loses something now and then has more of them in the end than there is memory.
const RUNS: usize = 4096;

/// Forgets the shorter half of them: they have the least to say of a deviation, and its interval becomes wider without them.
fn shorten(runs: &mut Vec<usize>) {
    if runs.len() >= RUNS {
        runs.sort_unstable_by_key(|run| std::cmp::Reverse(*run));
        runs.truncate(RUNS / 2);
    }
}

/// Collects frames.
pub struct View {
    calibration: Calibration,
    hello: Option<Hello>,
    follow: Continuity,
    streams: [Streaming<i64>; 3],
    /// Lengths of the runs without a gap, samples.
    runs: Vec<usize>,
    /// First reading of each gyro: taken out, so that sums stay small.
    zero: Option<[i16; 3]>,
    /// With their times of arrival, s.
    recent: VecDeque<(Sample, f64)>,
    samples: u64,
    missing: u64,
    restarts: u64,
    first: Option<(u64, f64)>,
    last: Option<(u64, f64)>,
    counters: Option<Vec<(&'static str, u16)>>,
}

impl Default for View {
    fn default() -> Self {
        Self::new()
    }
}

impl View {
    /// Nothing yet.
    #[must_use]
    pub fn new() -> Self {
        let calibration = Calibration::default();
        Self {
            hello: None,
            follow: follow(&calibration),
            streams: streams(&calibration),
            runs: vec![0],
            zero: None,
            recent: VecDeque::new(),
            samples: 0,
            missing: 0,
            restarts: 0,
            first: None,
            last: None,
            counters: None,
            calibration,
        }
    }

    /// The board, as it says.
    #[must_use]
    pub fn board(&self) -> String {
        self.hello.map_or_else(
            || "board that has not said who it is".to_owned(),
            |h| {
                let [major, minor, patch] = h.firmware;
                format!("board {}, firmware {major}.{minor}.{patch}", h.board_id)
            },
        )
    }

    /// Restarts of the board so far.
    #[must_use]
    pub fn restarts(&self) -> u64 {
        self.restarts
    }

    /// The line was opened anew.
    pub fn reconnected(&mut self) {
        self.follow.fresh();
    }

    /// A frame that arrived at `host_s`.
    pub fn push(&mut self, frame: &Frame, host_s: f64) {
        match frame {
            Frame::Sample(sample) => self.sample(sample, host_s),
            Frame::Hello(hello) => self.set(hello),
            Frame::Health(health) => {
                let counted = health.faults.iter().filter(|(_, count)| *count > 0);
                self.counters = Some(
                    counted
                        .map(|(fault, count)| (fault.name(), count))
                        .collect(),
                );
            }
            Frame::Reply(_) | Frame::Corrected(_) => {}
        }
    }

    fn set(&mut self, hello: &Hello) {
        let mut builder = RecordBuilder::new(Calibration::default());
        builder.hello(hello);
        self.follow.hello(hello, self.hello.map(|h| h.restarts));
        if *builder.calibration() != self.calibration {
            // Other counts: what was summed does not go with them.
            self.calibration = builder.calibration().clone();
            self.follow = follow(&self.calibration);
            self.streams = streams(&self.calibration);
            (self.runs, self.zero) = (vec![0], None);
            (self.first, self.last) = (None, None);
            self.recent.clear();
        }
        self.hello = Some(*hello);
    }

    fn sample(&mut self, sample: &Sample, host_s: f64) {
        let (place, restart) = self.follow.place(sample, host_s);
        self.samples += 1;
        self.missing += place.missing;
        if restart.is_some() {
            self.restarts += 1;
            (self.first, self.last) = (None, None);
        }
        self.first.get_or_insert((place.t_ticks, host_s));
        self.last = Some((place.t_ticks, host_s));
        let zero = *self.zero.get_or_insert(sample.gyro);
        let in_order = sample.flags & flags::IN_ORDER == flags::IN_ORDER
            && sample.flags & flags::GYRO_NOT_ANSWERING == 0;
        if place.missing > 0 || !in_order {
            self.streams.iter_mut().for_each(Streaming::gap);
            shorten(&mut self.runs);
            self.runs.push(0);
        }
        if in_order {
            for ((stream, gyro), zero) in self.streams.iter_mut().zip(sample.gyro).zip(zero) {
                stream.push(i64::from(gyro) - i64::from(zero));
            }
            if let Some(run) = self.runs.last_mut() {
                *run += 1;
            }
        }
        self.recent.push_back((*sample, host_s));
        let second = self.calibration.rate_hz.ceil().max(1.0) as usize;
        while self.recent.len() > second {
            self.recent.pop_front();
        }
    }

    /// The largest step between two neighbouring sampling instants beside the period, s, and the spread of the times of
    /// arrival about the board's, s.
    fn jitter(&self) -> (Option<f64>, Option<f64>) {
        let c = &self.calibration;
        let pairs = self.recent.iter().zip(self.recent.iter().skip(1));
        let steps = pairs.filter(|((a, _), (b, _))| b.seq.wrapping_sub(a.seq) == 1);
        let apart = steps.map(|((a, _), (b, _))| {
            let ticks = b.t_ticks.wrapping_sub(a.t_ticks);
            (f64::from(ticks) * c.tick_s - 1.0 / c.rate_hz).abs()
        });
        let sampling = apart.max_by(f64::total_cmp);
        let Some((first, _)) = self.recent.front() else {
            return (sampling, None);
        };
        let late = |(sample, host_s): &(Sample, f64)| {
            host_s - f64::from(sample.t_ticks.wrapping_sub(first.t_ticks)) * c.tick_s
        };
        let n = self.recent.len() as f64;
        let mean = self.recent.iter().map(late).sum::<f64>() / n;
        let squares: f64 = self
            .recent
            .iter()
            .map(|row| (late(row) - mean).powi(2))
            .sum();
        let arrival = (n > 2.0).then(|| (squares / n).sqrt());
        (sampling, arrival)
    }

    /// What there is to show; `heard` is what the line says of its losses.
    #[must_use]
    pub fn snapshot(&self, heard: &Heard) -> Snapshot {
        let c = &self.calibration;
        let n = self.recent.len() as f64;
        let some = |value: f64| (n > 0.0).then_some(value);
        let mean = |of: &dyn Fn(&Sample) -> f64| {
            some(self.recent.iter().map(|(s, _)| of(s)).sum::<f64>() / n)
        };
        let elapsed = self
            .first
            .zip(self.last)
            .map(|(first, last)| ((last.0 - first.0) as f64 * c.tick_s, last.1 - first.1));
        let (sampling_jitter_s, arrival_jitter_s) = self.jitter();
        Snapshot {
            format: "imu-stand-monitor/1",
            seconds: elapsed.map_or(0.0, |(device, _)| device),
            samples: self.samples,
            missing: self.missing,
            lost_by_board: heard.losses.device,
            lost_by_line: heard.losses.line,
            rejected: heard.counts.rejected(),
            restarts: self.restarts,
            sampling_jitter_s,
            arrival_jitter_s,
            rate_hz: c.rate_hz,
            // Host times jitter by a frame's length; over a minute that is some 100 ppm.
            clock_ppm: elapsed
                .filter(|(device, _)| *device > 60.0)
                .map(|(device, host)| (device / host - 1.0) * 1e6),
            gyros: [0, 1, 2].map(|k| {
                let mean_dps = mean(&|s| f64::from(s.gyro[k]) * c.gyro_lsb_dps);
                let squares = mean_dps
                    .and_then(|m| mean(&|s| (f64::from(s.gyro[k]) * c.gyro_lsb_dps - m).powi(2)));
                Recent {
                    mean_dps,
                    rms_dps: squares.map(f64::sqrt),
                    temp_c: mean(&|s| f64::from(s.temp[k]) * TEMP.0 + TEMP.1),
                }
            }),
            acc_mps2: [0, 1, 2].map(|k| {
                mean(&|s| f64::from(s.acc[k])).map(|counts| {
                    (counts - c.acc_zero_counts) / c.acc_counts_per_g * STANDARD_GRAVITY
                })
            }),
            supply_v: mean(&|s| f64::from(s.supply) * SUPPLY_LSB_V),
            pwm: self.recent.back().map(|(s, _)| s.pwm),
            flags: self.flags(),
            allan: [0, 1, 2].map(|k| self.points(k)),
            counters: self.counters.clone(),
        }
    }

    fn flags(&self) -> Vec<&'static str> {
        let any = self.recent.iter().fold(0, |all, (s, _)| all | s.flags);
        let all = (self.recent.iter()).fold(u16::MAX, |all, (s, _)| all & s.flags);
        let stale = [
            (flags::NEW_X, "gyro x repeats itself"),
            (flags::NEW_Y, "gyro y repeats itself"),
            (flags::NEW_Z, "gyro z repeats itself"),
        ];
        let set = [
            (flags::ERROR_X, "gyro x alarm"),
            (flags::ERROR_Y, "gyro y alarm"),
            (flags::ERROR_Z, "gyro z alarm"),
            (flags::GYRO_NOT_ANSWERING, "a gyro does not answer"),
            (flags::ACC_AT_RAIL, "acc at its rail"),
            (flags::TICK_OVERRUN, "tick overrun"),
            (flags::BIAS_NULL, "bias null running"),
            (flags::SUPPLY_OUT_OF_RANGE, "supply out of range"),
            (flags::ACC_NOT_CONVERTED, "acc not converted"),
            (flags::GYRO_MISCONFIGURED, "a gyro is set wrongly"),
        ];
        let stale = stale.iter().filter(|(bit, _)| all & bit == 0);
        let set = set.iter().filter(|(bit, _)| any & bit != 0);
        stale.chain(set).map(|(_, name)| *name).collect()
    }

    fn points(&self, axis: usize) -> Vec<Point> {
        let estimates = self.streams[axis].estimates();
        let mut out = Vec::new();
        for (k, e) in estimates.iter().enumerate() {
            // Kind of noise by the slope to the next longer time; the last one's is that before it.
            let pair = estimates
                .get(k..k + 2)
                .or(estimates.get(k.saturating_sub(1)..=k));
            let alpha = match pair {
                Some([a, b]) if a.deviation > 0.0 && b.deviation > 0.0 => {
                    -2.0 * (b.deviation / a.deviation).log2() - 1.0
                }
                _ => 0.0,
            };
            let known = |kind| edf(Deviation::Oadev, kind, e.m, &self.runs);
            // Two uncertain points may lie as steeply as those of a noise that would be known far better than this one is.
            let free = known(NoiseType::nearest(alpha)).min(known(NoiseType::WhiteRate));
            // Below that an interval spans a factor of three: no figure to show.
            if free < 3.0 {
                continue;
            }
            let (low, high) = chi_square_interval(e.deviation, free, CONFIDENCE);
            out.push(Point {
                tau_s: e.tau_s,
                deviation: e.deviation,
                low,
                high,
            });
        }
        out
    }
}

fn follow(c: &Calibration) -> Continuity {
    Continuity::new(c.tick_s, (1.0 / c.rate_hz / c.tick_s).round() as u64)
}

fn streams(c: &Calibration) -> [Streaming<i64>; 3] {
    [0, 1, 2].map(|_| Streaming::new(1.0 / c.rate_hz, c.gyro_lsb_dps, OCTAVES))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(k: u32) -> Sample {
        // A square wave of +-1 count: mean and spread are known.
        let gyro = if k.is_multiple_of(2) { 11 } else { 9 };
        Sample {
            seq: k as u16,
            t_ticks: 12_500 * k,
            gyro: [gyro, -gyro, 0],
            temp: [0, 10, -10],
            supply: 2_730,
            acc: [512, 512, 760],
            flags: flags::IN_ORDER,
            ..Sample::default()
        }
    }

    #[test]
    fn the_last_second_is_in_the_units_that_are_named() {
        let mut view = View::new();
        for k in 0..100 {
            view.push(&Frame::Sample(sample(k)), f64::from(k) * 0.05);
        }
        let s = view.snapshot(&Heard::default());
        assert_eq!((s.samples, s.missing, s.restarts), (100, 0, 0));
        let lsb = 0.073_26;
        assert!((s.gyros[0].mean_dps.unwrap() - 10.0 * lsb).abs() < 1e-9);
        assert!((s.gyros[0].rms_dps.unwrap() - lsb).abs() < 1e-9);
        assert!((s.gyros[1].temp_c.unwrap() - 26.453).abs() < 1e-9);
        assert!((s.acc_mps2[2].unwrap() - 9.8).abs() < 0.02);
        assert!((s.supply_v.unwrap() - 5.0).abs() < 1e-3);
        // Alternating +-1 count: the deviation at one sample is 2 / sqrt 2 counts, at two samples 0.
        assert!((s.allan[0][0].deviation - 2.0 * lsb / 2f64.sqrt()).abs() < 1e-9);
        assert_eq!(s.allan[0][1].deviation, 0.0);
        assert!(s.sampling_jitter_s.unwrap() < 1e-9, "every 12500 ticks");
        assert!(s.arrival_jitter_s.unwrap() < 1e-9);
        let page = s.page("P", &view.board());
        assert!(
            page.contains("in order") && page.contains("not sent yet"),
            "{page}"
        );
        assert!(
            page.lines().all(|line| line.chars().count() <= 80),
            "{page}"
        );
    }

    #[test]
    fn jitter_of_the_sampling_instant_and_of_the_arrival_are_told_apart() {
        let mut view = View::new();
        for k in 0..40 {
            let mut sample = sample(k);
            if k == 30 {
                // 25 ticks late: 100 us.
                sample.t_ticks += 25;
            }
            // Every second frame arrives 4 ms late.
            let late = if k % 2 == 0 { 0.004 } else { 0.0 };
            view.push(&Frame::Sample(sample), f64::from(k) * 0.05 + late);
        }
        let s = view.snapshot(&Heard::default());
        assert!((s.sampling_jitter_s.unwrap() - 1e-4).abs() < 1e-9);
        assert!(
            (s.arrival_jitter_s.unwrap() - 2e-3).abs() < 1e-5,
            "{:?}",
            s.arrival_jitter_s
        );
    }

    #[test]
    fn no_difference_spans_a_gap_and_a_silent_gyro_is_named() {
        let mut view = View::new();
        for k in (0..50).chain(60..100) {
            let mut sample = sample(k);
            if k == 99 {
                sample.flags = flags::NEW_X | flags::NEW_Z | flags::GYRO_NOT_ANSWERING;
            }
            if k >= 60 {
                // A step over the gap, which no deviation may see.
                sample.gyro[0] += 500;
            }
            view.push(&Frame::Sample(sample), f64::from(k) * 0.05);
        }
        let s = view.snapshot(&Heard::default());
        assert_eq!(s.missing, 10);
        assert!(
            s.allan[0].iter().all(|point| point.deviation < 0.2),
            "{:?}",
            s.allan[0]
        );
        assert_eq!(s.flags, ["gyro y repeats itself", "a gyro does not answer"]);
    }
}
