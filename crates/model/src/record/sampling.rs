//! The sample interval of a record, and where it is interrupted.

use std::ops::Range;

use crate::record::{Record, batches};

use crate::record::error::AnalysisError;

/// Share of intervals off the median by more than half of it, beyond which times are taken for arrival times that
/// come in bursts and not for sampling times.
const BURSTY_SHARE: f64 = 0.05;

/// Slots that a gap of unknown length is taken for: more than any record has.
const UNKNOWN_GAP: u64 = 1 << 40;

/// Jitter, in parts of the interval, that a reader is told of.
const JITTER_TOLD: f64 = 0.02;

/// Evenly spaced stretches of a record.
#[derive(Clone, Debug, PartialEq)]
pub struct Sampling {
    /// Sample interval τ₀, s.
    pub tau0: f64,
    /// Rows that follow each other without a gap, in order.
    pub runs: Vec<Range<usize>>,
    /// Place of each row on the grid of sample times: one more for each interval. Where nothing tells how long a gap is,
    /// it is taken as too long to bridge.
    pub slots: Vec<u64>,
    /// Scatter of the sample times about an even grid, s rms, where the device's clock or the times of the rows tell it.
    pub jitter_s: Option<f64>,
    /// Samples lost in the gaps, as far as they can be counted.
    pub lost: u64,
    /// What a reader of the results has to know.
    pub warnings: Vec<String>,
}

impl Sampling {
    /// Of a record: the interval from `rate_hz` (an option of the user), the header, the device's clock or the times of
    /// the rows, in this order; the gaps from sequence numbers and device ticks, else from the times.
    ///
    /// # Errors
    /// [`AnalysisError::NoRate`] when nothing tells the rate, [`AnalysisError::BadOption`] when `rate_hz` is not
    /// positive.
    pub fn of(record: &Record, rate_hz: Option<f64>) -> Result<Self, AnalysisError> {
        if let Some(rate) = rate_hz
            && !(rate.is_finite() && rate > 0.0)
        {
            return Err(AnalysisError::BadOption {
                option: "--rate",
                found: rate.to_string(),
                expected: "a positive number of samples per second".into(),
            });
        }
        let clocks = Clocks::of(record);
        let mut warnings = Vec::new();
        let tau0 = clocks.interval(record, rate_hz, &mut warnings)?;
        let steps = clocks.steps(record, tau0, &mut warnings);
        let laid = Laid::out(&steps);
        let jitter_s = clocks.jitter(&laid.runs);
        if let Some(jitter) = jitter_s.filter(|j| *j > JITTER_TOLD * tau0) {
            warnings.push(format!(
                "the sample times scatter by {jitter:.2e} s rms about an even grid, {:.1} % of the interval: clusters begin and end \
                 with that uncertainty, which blurs the shortest cluster times by as much; rows are used as they came",
                100.0 * jitter / tau0
            ));
        }
        let mut runs = laid.runs;
        if laid.start < record.len() {
            runs.push(laid.start..record.len());
        }
        Ok(Self {
            tau0,
            runs,
            slots: laid.slots,
            jitter_s,
            lost: laid.lost,
            warnings,
        })
    }

    /// The runs of one channel: those of the record, interrupted wherever the channel has no finite reading.
    #[must_use]
    pub fn runs_of(&self, values: &[f64]) -> Vec<Range<usize>> {
        let mut out = Vec::new();
        for run in &self.runs {
            let mut start = run.start;
            for i in run.clone() {
                if !values[i].is_finite() {
                    if i > start {
                        out.push(start..i);
                    }
                    start = i + 1;
                }
            }
            if run.end > start {
                out.push(start..run.end);
            }
        }
        out
    }
}

/// The times that a record has, and the intervals between them.
struct Clocks<'a> {
    /// Device time since the first row, s.
    device: Option<Vec<f64>>,
    device_interval: Option<Interval>,
    /// Time of the rows, s.
    host: Option<&'a [f64]>,
    host_interval: Option<Interval>,
}

impl<'a> Clocks<'a> {
    fn of(record: &'a Record) -> Self {
        let device: Option<Vec<f64>> = match (&record.t_ticks, record.header.tick_s) {
            (Some(ticks), Some(tick_s)) => {
                let first = ticks.first().copied().unwrap_or(0);
                let since = |t: &u64| t.wrapping_sub(first) as i64 as f64 * tick_s;
                Some(ticks.iter().map(since).collect())
            }
            _ => None,
        };
        let host = record.host_time_s.as_deref();
        Self {
            device_interval: device.as_deref().and_then(Interval::of),
            device,
            host,
            host_interval: host.and_then(Interval::of),
        }
    }

    /// The sample interval, s.
    fn interval(
        &self,
        record: &Record,
        rate_hz: Option<f64>,
        warnings: &mut Vec<String>,
    ) -> Result<f64, AnalysisError> {
        let stated = rate_hz
            .or(record.header.rate_hz.filter(|r| r.is_finite() && *r > 0.0))
            .map(|r| 1.0 / r);
        let tau0 = stated
            .or(self.device_interval.as_ref().map(|i| i.regular_s))
            .or(self.host_interval.as_ref().map(Interval::best_s))
            .ok_or(AnalysisError::NoRate)?;
        if let (Some(stated), Some(measured)) = (stated, &self.device_interval)
            && (measured.regular_s / stated - 1.0).abs() > 0.01
        {
            warnings.push(format!(
                "the stated interval {stated:.6} s differs from the device's clock, which says {:.6} s: all times here \
                 follow the stated one",
                measured.regular_s
            ));
        }
        Ok(tau0)
    }

    /// Intervals since the row before: 1 where nothing is missing, `None` where the gap's length is not known.
    fn steps(&self, record: &Record, tau0: f64, warnings: &mut Vec<String>) -> Vec<Option<u64>> {
        let mut steps = by_numbers(record, warnings);
        if let (Some(times), Some(interval)) = (&self.device, &self.device_interval) {
            // A jump of the clock that the sequence number does not show is an interruption all the same.
            jumps(times, interval.regular_s, &mut steps);
        } else if record.seq.is_none()
            && let (Some(times), Some(interval)) = (self.host, &self.host_interval)
        {
            if interval.bursty() {
                warnings.push(format!(
                    "the times are uneven ({:.0} % of the steps are off the median by more than half of it), so they \
                     tell arrival, not sampling: rows are taken as evenly spaced at {:.6} s, and gaps cannot be seen",
                    100.0 * interval.irregular_share,
                    tau0
                ));
            } else {
                jumps(times, interval.regular_s, &mut steps);
            }
        }
        steps
    }

    /// Scatter of the times about an even grid, s rms.
    fn jitter(&self, runs: &[Range<usize>]) -> Option<f64> {
        match (&self.device, &self.device_interval) {
            (Some(times), Some(interval)) => jitter(times, interval.regular_s, runs),
            _ => match (self.host, &self.host_interval) {
                (Some(times), Some(interval)) if !interval.bursty() => {
                    jitter(times, interval.regular_s, runs)
                }
                _ => None,
            },
        }
    }
}

/// Intervals since the row before, by the sequence numbers.
fn by_numbers(record: &Record, warnings: &mut Vec<String>) -> Vec<Option<u64>> {
    let n = record.len();
    let mut steps: Vec<Option<u64>> = vec![Some(1); n];
    let Some(seq) = &record.seq else {
        return steps;
    };
    let mut backwards = 0usize;
    for i in 1..n.min(seq.len()) {
        match seq[i].checked_sub(seq[i - 1]) {
            Some(1) => {}
            Some(step) if step > 1 => steps[i] = Some(step),
            _ => {
                steps[i] = None;
                backwards += 1;
            }
        }
    }
    if backwards > 0 {
        warnings.push(format!(
            "the sequence number repeats or runs backwards at {backwards} rows: treated as interruptions"
        ));
    }
    steps
}

/// Rows laid out on the grid of sample times.
struct Laid {
    /// Runs that a gap ends.
    runs: Vec<Range<usize>>,
    /// First row after the last gap.
    start: usize,
    slots: Vec<u64>,
    lost: u64,
}

impl Laid {
    fn out(steps: &[Option<u64>]) -> Self {
        let mut laid = Self {
            runs: Vec::new(),
            start: 0,
            slots: Vec::with_capacity(steps.len()),
            lost: 0,
        };
        let mut slot = 0u64;
        for (i, step) in steps.iter().enumerate() {
            if i > 0 {
                slot += step.unwrap_or(UNKNOWN_GAP);
                if *step != Some(1) {
                    laid.runs.push(laid.start..i);
                    laid.start = i;
                    laid.lost += step.unwrap_or(1) - 1;
                }
            }
            laid.slots.push(slot);
        }
        laid
    }
}

/// Note the rows before which the times jump by something else than `interval`.
fn jumps(times: &[f64], interval: f64, steps: &mut [Option<u64>]) {
    for (i, pair) in times.windows(2).enumerate() {
        let intervals = (pair[1] - pair[0]) / interval;
        if let Some(step @ Some(1)) = steps.get_mut(i + 1)
            && !(0.5..=1.5).contains(&intervals)
        {
            // Less than half an interval, backwards, or not a time.
            *step = (intervals > 1.5 && intervals < UNKNOWN_GAP as f64)
                .then(|| intervals.round() as u64);
        }
    }
}

/// Scatter of the times about even spacing, s rms: second differences over rows without a gap have six times the
/// variance of independent shifts, whatever the interval and its drift are.
fn jitter(times: &[f64], interval: f64, runs: &[Range<usize>]) -> Option<f64> {
    let (mut squares, mut n) = (0.0, 0usize);
    for run in runs {
        for t in times.get(run.clone()).unwrap_or_default().windows(3) {
            squares += ((t[2] - t[1]) - (t[1] - t[0])).powi(2);
            n += 1;
        }
    }
    (n >= 30 && interval > 0.0).then(|| (squares / (6.0 * n as f64)).sqrt())
}

/// What a column of times says about the interval.
struct Interval {
    /// Mean of the steps within half a median of the median, s.
    regular_s: f64,
    /// Length over number of steps, s.
    mean_s: f64,
    irregular_share: f64,
    /// Whether rows come in batches.
    in_batches: bool,
}

impl Interval {
    fn of(times: &[f64]) -> Option<Self> {
        let mut steps: Vec<f64> = times
            .windows(2)
            .map(|w| w[1] - w[0])
            .filter(|d| d.is_finite())
            .collect();
        if steps.len() < 2 {
            return None;
        }
        let mean_s = steps.iter().sum::<f64>() / steps.len() as f64;
        let middle = steps.len() / 2;
        let (_, median, _) = steps.select_nth_unstable_by(middle, f64::total_cmp);
        let median = *median;
        let regular: Vec<f64> = steps
            .iter()
            .copied()
            .filter(|d| (d - median).abs() <= 0.5 * median)
            .collect();
        let irregular_share = 1.0 - regular.len() as f64 / steps.len() as f64;
        let regular_s = regular.iter().sum::<f64>() / regular.len().max(1) as f64;
        (mean_s > 0.0 && (regular_s > 0.0 || irregular_share > BURSTY_SHARE)).then_some(Self {
            regular_s,
            mean_s,
            irregular_share,
            in_batches: irregular_share <= BURSTY_SHARE && batches::arrive(times),
        })
    }

    fn bursty(&self) -> bool {
        self.irregular_share > BURSTY_SHARE || self.in_batches
    }

    fn best_s(&self) -> f64 {
        if self.bursty() {
            self.mean_s
        } else {
            self.regular_s
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::{Channel, Header, Quantity};

    fn record(n: usize) -> Record {
        Record {
            channels: vec![Channel {
                name: "y".into(),
                quantity: Quantity::Other,
                axis: None,
                unit: "1".into(),
                values: vec![0.0; n],
                counts: None,
                lsb: None,
            }],
            ..Record::default()
        }
    }

    #[test]
    fn a_hole_in_the_sequence_numbers_is_a_gap_of_its_length() {
        let mut r = record(5);
        r.header.rate_hz = Some(20.0);
        r.seq = Some(vec![7, 8, 12, 13, 14]);
        let s = Sampling::of(&r, None).unwrap();
        assert_eq!((s.runs, s.lost), (vec![0..2, 2..5], 3));
    }

    #[test]
    fn rounded_times_give_the_mean_interval_and_a_jump_is_a_gap() {
        let mut r = record(1000);
        r.host_time_s = Some(
            (0..1000)
                .map(|i| ((if i < 400 { i } else { i + 3 }) as f64 * 0.0503424 * 1e4).round() / 1e4)
                .collect(),
        );
        let s = Sampling::of(&r, None).unwrap();
        assert!((s.tau0 / 0.0503424 - 1.0).abs() < 1e-4, "{}", s.tau0);
        assert_eq!((s.runs, s.lost), (vec![0..400, 400..1000], 3));
    }

    #[test]
    fn slots_are_true_times_and_jitter_is_measured_and_told() {
        let mut r = record(2000);
        let mut state = 12_345u64;
        r.host_time_s = Some(
            (0..2000)
                .map(|i| {
                    state = state
                        .wrapping_mul(6_364_136_223_846_793_005)
                        .wrapping_add(1);
                    let uniform = (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
                    (if i < 700 { i } else { i + 25 }) as f64 * 0.05 + 0.01 * uniform
                })
                .collect(),
        );
        let s = Sampling::of(&r, None).unwrap();
        assert_eq!((s.slots[699], s.slots[700], s.lost), (699, 725, 25));
        // Uniform over 10 ms: 2.89 ms rms.
        let jitter = s.jitter_s.unwrap();
        assert!((jitter / 2.887e-3 - 1.0).abs() < 0.05, "{jitter}");
        assert!(
            s.warnings[0].contains("5.8 %") || s.warnings[0].contains("5.7 %"),
            "{:?}",
            s.warnings
        );
    }

    #[test]
    fn a_wrong_rate_is_told_and_invents_no_gaps() {
        let mut r = record(100);
        r.header.tick_s = Some(4e-6);
        r.t_ticks = Some(
            (0..100u64)
                .map(|i| i * 12_500 + if i > 60 { 25_000 } else { 0 })
                .collect(),
        );
        let s = Sampling::of(&r, Some(100.0)).unwrap();
        assert_eq!((s.tau0, s.lost, s.runs), (0.01, 2, vec![0..61, 61..100]));
        assert!(s.warnings[0].contains("0.050000 s"), "{:?}", s.warnings);
    }

    #[test]
    fn bursts_of_arrival_times_are_told_and_the_mean_rate_is_used() {
        let mut r = record(1000);
        // Ten samples at a time, every 0.1 s.
        r.host_time_s = Some(
            (0..1000)
                .map(|i| (i / 10) as f64 * 0.1 + (i % 10) as f64 * 1e-4)
                .collect(),
        );
        let s = Sampling::of(&r, None).unwrap();
        assert!((s.tau0 / 0.01 - 1.0).abs() < 0.02, "{}", s.tau0);
        assert_eq!(s.runs, vec![0..1000]);
        assert!(s.warnings[0].contains("arrival"), "{:?}", s.warnings);
    }

    #[test]
    fn without_rate_and_times_there_is_no_answer() {
        assert_eq!(Sampling::of(&record(10), None), Err(AnalysisError::NoRate));
        let header = Header {
            rate_hz: Some(0.0),
            ..Header::default()
        };
        assert_eq!(
            Sampling::of(
                &Record {
                    header,
                    ..record(10)
                },
                None
            ),
            Err(AnalysisError::NoRate)
        );
    }
}
