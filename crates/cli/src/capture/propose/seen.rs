//! What the values of columns say of them where their names do not.

use std::io::BufRead;

use super::super::cells::Cells;
use super::super::layout::next_row;
use super::super::stream::TextLines;
use super::super::time::Clock;
use super::super::{CaptureError, STANDARD_GRAVITY};

/// Rows that are looked at, and the fewest that say anything: noise rises so many times in a row once in 40 000 times.
pub(in crate::capture) const ROWS: usize = 200;
const LEAST: usize = 8;
/// Offsets and scale errors of an accelerometer stay below a tenth of gravity.
const OF_GRAVITY: f64 = 0.1;
/// Largest reading below which it is no sensor's of rates, deg/s or rad/s: earth turns 70 times as fast in rad/s.
const NO_RATE: f64 = 1e-6;

/// What numbers of packets in 16 bits are called, by Xsens and Analog Devices.
const PACKETS: [&str; 4] = ["packetcounter", "counter", "datacntr", "datacounter"];

/// The first rows of a file, column by column; a cell that is no number is NaN.
#[derive(Default)]
pub(in crate::capture) struct Seen(pub Vec<Vec<f64>>);

impl Seen {
    fn of(&self, at: usize) -> Option<&[f64]> {
        let values = self.0.get(at)?.as_slice();
        (values.len() >= LEAST).then_some(values)
    }

    /// Whether a column rises in every row, as no reading does.
    pub fn rises(&self, at: usize) -> bool {
        let rises = |v: &[f64]| v.windows(2).all(|w| w[1] > w[0]);
        self.of(at).is_some_and(rises)
    }

    /// Whether it numbers the rows: a time at 1 Hz looks the same.
    pub fn counts(&self, at: usize) -> bool {
        let counts = |v: &[f64]| v.windows(2).all(|w| w[1] - w[0] == 1.0);
        self.of(at).is_some_and(counts)
    }

    /// Whether it numbers packets in 16 bits, as its name says: a step is one, but where some were lost.
    pub fn counts_packets(&self, at: usize, name: &str) -> bool {
        let letters = name.chars().filter(char::is_ascii_alphanumeric);
        let letters: String = letters.flat_map(char::to_lowercase).collect();
        let counts = |v: &[f64]| {
            let steps = v.windows(2).map(|w| (w[1] - w[0]).rem_euclid(65_536.0));
            let ones = steps.clone().filter(|step| *step == 1.0).count();
            let most = v.iter().copied().fold(0.0, f64::max);
            let is_16_bit = most < 65_536.0 && (most > 255.0 || letters != "counter");
            is_16_bit && steps.clone().all(|step| step > 0.0) && 10 * ones > 9 * (v.len() - 1)
        };
        PACKETS.contains(&letters.as_str()) && self.of(at).is_some_and(counts)
    }

    /// Whether it is a time: it rises, and does not number the rows.
    pub fn is_time(&self, at: usize) -> bool {
        self.rises(at) && !self.counts(at)
    }

    /// Whether it never changes, or has no number.
    pub fn is_constant(&self, at: usize) -> bool {
        let constant = |v: &[f64]| v.iter().all(|x| *x == v[0] || x.is_nan());
        self.of(at).is_some_and(constant)
    }

    /// Whether it is too small for a rate.
    pub fn is_no_rate(&self, at: usize) -> bool {
        let largest = |v: &[f64]| v.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        self.of(at).is_some_and(|v| largest(v) < NO_RATE)
    }

    /// Whether all of its numbers are whole.
    pub fn is_whole(&self, at: usize) -> bool {
        let whole = |v: &[f64]| v.iter().all(|x| x.fract() == 0.0 || x.is_nan());
        self.of(at).is_some_and(whole)
    }

    /// Whether it holds text: it has rows, and no number.
    pub fn is_text(&self, at: usize) -> bool {
        self.of(at).is_some_and(|v| v.iter().all(|x| x.is_nan()))
    }

    /// Whether there are rows to go by.
    pub fn has_rows(&self) -> bool {
        self.of(0).is_some()
    }

    /// The unit in which three columns read gravity; `None` where they do not, and where a part of 1024 counts a g does, too.
    pub fn gravity(&self, of: &[usize]) -> Option<&'static str> {
        let is_counted = of.iter().all(|at| self.is_whole(*at));
        self.reads_gravity(of)
            .filter(|unit| *unit != "mg" || !is_counted)
    }

    /// The unit in which three columns most probably read gravity; `None` where they do not.
    pub fn reads_gravity(&self, of: &[usize]) -> Option<&'static str> {
        let means: Option<Vec<f64>> = of
            .iter()
            .map(|at| {
                let values = self.of(*at)?.iter().filter(|v| v.is_finite());
                let (sum, count) = values.fold((0.0, 0.0), |(s, n), v| (s + v, n + 1.0));
                Some(sum / count)
            })
            .collect();
        let norm = means?.iter().map(|m| m * m).sum::<f64>().sqrt();
        let near = |g: f64| (norm / g - 1.0).abs() < OF_GRAVITY;
        let units = [(STANDARD_GRAVITY, "m/s2"), (1.0, "g"), (1000.0, "mg")];
        units.into_iter().find(|(g, _)| near(*g)).map(|u| u.1)
    }
}

/// The first rows of a text, for a proposal: numbers and dates.
pub(in crate::capture) fn first_rows(
    text: &mut TextLines<impl BufRead>,
    first: Option<(u64, String)>,
    cells: &mut Cells,
    width: usize,
) -> Result<Seen, CaptureError> {
    let mut seen = vec![Vec::new(); width];
    let mut clocks: Vec<Clock> = (0..width).map(|_| Clock::new(1.0)).collect();
    let mut line = first.map(|(_, line)| line);
    while let Some(row) = line.filter(|_| seen.iter().all(|of| of.len() < ROWS)) {
        let row = cells.cut(&row);
        for (k, (of, clock)) in seen.iter_mut().zip(&mut clocks).enumerate() {
            let cell = row.get(k).map_or("", |cell| cell.as_ref());
            let value = clock.seconds(cell, |cell| cells.number(cell));
            of.push(value.unwrap_or(f64::NAN));
        }
        line = next_row(text)?.map(|(_, line)| line);
    }
    Ok(Seen(seen))
}
