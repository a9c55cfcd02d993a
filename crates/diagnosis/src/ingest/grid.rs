//! From a record to an even grid: gaps found by the sequence numbers, lost samples filled so that the likelihood cannot
//! tell, slow channels smoothed, motion of the base noticed.

mod levelled;
mod readings;
mod signals;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use model::effect::Signal;
use model::effects::shock::LONGEST_S;
use model::record::{Base, Channel, Quantity, Record};
use rand_core::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::fit::likelihood::{Bins, Dct, Noise, Panel};
use crate::ingest::base_turns::{Excursion, MOTION_RMS};
use crate::ingest::jumps::Jumps;
use crate::ingest::motion::{MOTION_BAND_HZ, Rest, drives, felt, followers, motion, places_of};
use crate::ingest::spikes::spikes;
use crate::ingest::types::{Grid, Target};
use crate::ingest::{dequantise, fill, kalman};
use crate::test_level::on_two_threads;
use levelled::Still;
use model::record::AnalysisError;
use numerics::column::LONG;
use numerics::series::{smallest_step, white_by_differences};
use numerics::transform::quick_length;
use readings::{is_constant, unit_of, white_of};
use signals::{of_gyro, other};

/// Least number of samples of a gyro.
pub const LEAST_SAMPLES: usize = 600;
/// Least length, s.
pub const LEAST_SECONDS: f64 = 30.0;
/// What a sensor's own oscillator is off by (PS-MPU-6000A, 7.15: 1 % over temperature): a record may be as much shorter.
const CLOCK: f64 = 0.01;
/// So many readings show their step.
fn few(values: &[f64]) -> &[f64] {
    &values[..values.len().min(crate::test_level::MOST)]
}

/// Sample rate of a record: the header's, else by the times of the rows.
#[must_use]
pub fn rate_of(record: &Record) -> Option<f64> {
    let stated = record.header.rate_hz;
    stated
        .or_else(|| model::record::rows::by_times(record))
        .filter(|r| (LARGEST.recip()..LARGEST).contains(r))
}

/// Largest reading, and rate, of which sums of products are numbers.
const LARGEST: f64 = 1e100;

/// Place of every row on the grid, and the number of places.
fn places(record: &Record) -> (Vec<usize>, usize) {
    let rows = record.len();
    let even = || ((0..rows).collect(), rows);
    let Some(seq) = record.seq.as_ref().filter(|s| s.len() == rows && rows > 0) else {
        return even();
    };
    let ascending = seq.windows(2).all(|w| w[1] > w[0]);
    let span = seq[rows - 1].saturating_sub(seq[0]) as usize + 1;
    // A sequence that leaps by more than the record is no count of samples.
    if !ascending || span > 4 * rows {
        return even();
    }
    (seq.iter().map(|s| (s - seq[0]) as usize).collect(), span)
}

/// Place of every row of a record on its grid.
pub(crate) fn places_of_rows(record: &Record) -> Vec<usize> {
    places(record).0
}

fn spread(values: &[f64], places: &[usize], n: usize, masked: &[usize]) -> Vec<f64> {
    let mut grid = vec![f64::NAN; n];
    for (v, p) in values.iter().zip(places).filter(|(v, _)| v.abs() < LARGEST) {
        grid[*p] = *v;
    }
    for row in masked {
        if let Some(p) = places.get(*row) {
            grid[*p] = f64::NAN;
        }
    }
    grid
}

/// Values with straight lines over what is missing, the first and the last held.
pub(crate) fn interpolated(values: &[f64]) -> Vec<f64> {
    let known: Vec<usize> = (0..values.len())
        .filter(|i| values[*i].is_finite())
        .collect();
    let mut out = values.to_vec();
    let (Some(first), Some(last)) = (known.first(), known.last()) else {
        return vec![0.0; values.len()];
    };
    out[..*first].fill(values[*first]);
    out[*last..].fill(values[*last]);
    for pair in known.windows(2) {
        let (a, b) = (pair[0], pair[1]);
        for (step, v) in out[a + 1..b].iter_mut().enumerate() {
            *v = values[a] + (values[b] - values[a]) * (step + 1) as f64 / (b - a) as f64;
        }
    }
    out
}

/// Too little for a diagnosis.
fn short(have: f64, need: f64, unit: &'static str) -> AnalysisError {
    AnalysisError::Inconclusive {
        what: "a diagnosis".into(),
        have,
        need,
        unit,
    }
}

/// Put a record on its grid. `masked(name)` gives the rows of a channel that are not to be believed.
///
/// # Errors
/// As [`crate::diagnose`].
pub fn lay_out(
    record: &Record,
    masked: &dyn Fn(&str) -> Vec<usize>,
    seed: u64,
) -> Result<Grid, AnalysisError> {
    on_grid(Layout::new(record, masked)?, record, seed)
}

/// The same, brief events beyond the noise left where they are: part of a motion, of jumps, or of nothing.
///
/// # Errors
/// As [`crate::diagnose`].
pub(crate) fn with_knocks(
    record: &Record,
    masked: &dyn Fn(&str) -> Vec<usize>,
    seed: u64,
) -> Result<Grid, AnalysisError> {
    let mut layout = Layout::new(record, masked)?;
    layout.asks_for_knocks = false;
    on_grid(layout, record, seed)
}

fn on_grid(layout: Layout<'_>, record: &Record, seed: u64) -> Result<Grid, AnalysisError> {
    let gyros = || record.all(Quantity::Gyro);
    let targets = |felt: &[Vec<Excursion>]| -> Result<Vec<Target>, _> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed ^ 0x6d69_7373_696e_6721);
        gyros()
            .zip(felt)
            .map(|(channel, own)| layout.target(channel, own, felt, &mut rng))
            .collect()
    };
    let felt: Vec<Vec<Excursion>> = gyros().map(|g| layout.felt(g)).collect();
    let seldom = targets(&felt)?;
    // What still moves without them moves all the time, and they are part of that.
    let goes_on = seldom.iter().any(|t| t.moving && !t.excursions.is_empty());
    let mut targets = match goes_on {
        true => targets(&vec![vec![]; felt.len()])?,
        false => seldom,
    };
    followers(&mut targets, &|t, strongest| layout.rest(t, strongest));
    let (mut others, mut of_gyros) = (layout.others.into_iter(), targets.iter());
    let signals = (record.channels.iter())
        .filter_map(|c| match c.quantity {
            Quantity::Gyro => of_gyros.next().map(|t| of_gyro(c, t)),
            _ => others.next(),
        })
        .collect();
    Ok(Grid {
        rate_hz: layout.rate_hz,
        n: layout.n,
        end: layout.end,
        dct: layout.dct,
        bins: layout.bins,
        bursts: None,
        base: record.header.base,
        targets,
        signals,
    })
}

/// The grid while channels are put on it.
struct Layout<'a> {
    masked: &'a dyn Fn(&str) -> Vec<usize>,
    base: Option<Base>,
    /// Whether brief events are left out where they would pass for a motion or for jumps.
    asks_for_knocks: bool,
    rate_hz: f64,
    /// Places, those up to the last reading, and that of every row.
    n: usize,
    end: usize,
    places: Vec<usize>,
    dct: Dct,
    bins: Arc<Bins>,
    /// All channels but the gyros.
    others: Vec<Signal>,
    /// Coefficients, in the band of motion, of what may drive a bias.
    known: Vec<Vec<f64>>,
}

impl<'a> Layout<'a> {
    fn new(record: &Record, masked: &'a dyn Fn(&str) -> Vec<usize>) -> Result<Self, AnalysisError> {
        let rate_hz = rate_of(record).ok_or(AnalysisError::NoRate)?;
        if record.all(Quantity::Gyro).next().is_none() {
            let present = record.channels.iter().map(|c| c.name.clone()).collect();
            return Err(AnalysisError::NoChannel {
                name: "gyro_x, gyro_y or gyro_z".into(),
                present,
            });
        }
        let (places, end) = places(record);
        let seconds = end as f64 / rate_hz;
        if end < LEAST_SAMPLES {
            return Err(short(end as f64, LEAST_SAMPLES as f64, "samples"));
        }
        if seconds < LEAST_SECONDS * (1.0 - CLOCK) {
            return Err(short(seconds, LEAST_SECONDS, "s"));
        }
        let n = if end > LONG { quick_length(end) } else { end };
        let (dct, bins) = (Dct::new(n), Arc::new(Bins::new(n)));
        // Of the coefficients of what may drive a bias only the band of motion is asked for.
        let top = places_of(MOTION_BAND_HZ.1, n, rate_hz);
        let channels = (record.channels.iter()).filter(|c| c.quantity != Quantity::Gyro);
        let laid = on_two_threads(channels, |channel| {
            let (signal, driver) = other(channel, &places, n, &dct, &bins);
            (signal, driver.map(|c| c[..top].to_vec()))
        });
        let (others, known): (Vec<_>, Vec<_>) = laid.into_iter().unzip();
        let known = known.into_iter().flatten().collect();
        Ok(Self {
            masked,
            base: record.header.base,
            asks_for_knocks: true,
            rate_hz,
            n,
            end,
            places,
            dct,
            bins,
            others,
            known,
        })
    }

    /// Whether the header says that the base moves.
    fn turns(&self) -> bool {
        matches!(self.base, Some(Base::Moving | Base::Turntable))
    }

    /// What may drive a bias. Where the base moves, and where the motor turns it, it explains nothing away.
    fn drivers(&self) -> &[Vec<f64>] {
        if self.turns() { &[] } else { &self.known }
    }

    /// The readings of a gyro on the grid, those that are not believed left out.
    fn read(&self, channel: &Channel) -> Vec<f64> {
        let masked = (self.masked)(&channel.name);
        let mut y = spread(&channel.values, &self.places, self.n, &masked);
        let (scale, _) = unit_of(channel);
        y.iter_mut().for_each(|v| *v *= scale);
        y
    }

    /// Turns of a base at rest that a gyro felt. Where it is known to move, a turn of seconds is part of that.
    fn felt(&self, channel: &Channel) -> Vec<Excursion> {
        if unit_of(channel).1 != "deg/s" || self.turns() {
            return vec![];
        }
        let mut y = interpolated(&self.read(channel));
        // After the last reading noise goes on, and no level.
        let (read, after) = y.split_at_mut(self.end);
        let mirrored = after.iter_mut().zip(read.iter().rev());
        mirrored.for_each(|(y, read)| *y = *read);
        felt(&y, &self.others, self.rate_hz, &self.dct)
    }

    /// Excess rms in the band of base motion. Over a gap the fill wanders as the noise does that was fitted, which a process
    /// beside it swells: only what was read tells of motion.
    fn motion(&self, y: &[f64], c: &[f64], lost: &[usize], (noise, white): &(Noise, f64)) -> f64 {
        let all =
            |mut c: Vec<f64>| motion(&mut c, self.drivers(), self.n, self.rate_hz, self.turns());
        let whole = all(c.to_vec());
        if lost.is_empty() || whole <= MOTION_RMS {
            return whole;
        }
        let mut read = y.to_vec();
        lost.iter().for_each(|i| read[*i] = f64::NAN);
        kalman::bridge(&mut read, *white, white * noise.log_walk.exp());
        let known = (self.n - lost.len()).max(1);
        all(self.dct.forward(&read)) * (self.n as f64 / known as f64).sqrt()
    }

    /// White noise and a random walk fitted to the readings `given`, with the lost ones filled, their coefficients and the fit.
    fn filled(
        &self,
        given: &[f64],
        guess: f64,
        rng: &mut Xoshiro256PlusPlus,
    ) -> (Vec<f64>, Arc<Vec<f64>>, (Noise, f64)) {
        let lost = given.iter().any(|v| !v.is_finite());
        let mut fit = (Noise::new(0.0), guess.max(1e-300));
        let mut y = given.to_vec();
        kalman::fill_to(self.end, &mut y, fit.1, fit.1 * 1e-4, rng);
        let mut pass = 0;
        loop {
            let panel = Panel::new(&self.dct, &self.bins, &y);
            let (noise, solution) = panel.fit(&Noise::new(-12.0), &[]);
            fit = (noise, solution.white);
            if !lost || pass == 1 {
                return (y, panel.column(0), fit);
            }
            y = given.to_vec();
            kalman::fill_to(self.end, &mut y, fit.1, fit.1 * fit.0.log_walk.exp(), rng);
            pass += 1;
        }
    }

    /// The readings of a gyro beside the turns that were felt, the places of those that are missing, and a first guess of the white
    /// variance.
    fn given(
        &self,
        channel: &Channel,
        felt: &[Vec<Excursion>],
    ) -> Result<(Vec<f64>, Vec<usize>, f64), AnalysisError> {
        let mut given = self.read(channel);
        let read = given.iter().filter(|v| v.is_finite()).count();
        if read < LEAST_SAMPLES {
            return Err(short(read as f64, LEAST_SAMPLES as f64, "samples"));
        }
        for e in felt.iter().flatten() {
            given[e.with_margin(self.n)].fill(f64::NAN);
        }
        let lost: Vec<usize> = (0..self.n).filter(|i| !given[*i].is_finite()).collect();
        let (scale, _) = unit_of(channel);
        let guess = white_by_differences(&given)
            .max(channel.lsb.map_or(0.0, |l| (l * scale).powi(2) / 12.0));
        if is_constant(&given) || guess <= 0.0 && white_of(&given) <= 0.0 {
            let mut known = channel.values.iter().copied().filter(|v| v.is_finite());
            return Err(AnalysisError::Constant {
                name: channel.name.clone(),
                value: known.next().unwrap_or(f64::NAN),
            });
        }
        Ok((given, lost, guess))
    }

    /// Readings that are set aside, with their places: those that the audits take for none, and the spikes.
    fn aside(&self, channel: &Channel, given: &[f64], spikes: &[usize]) -> Vec<(usize, f64)> {
        let (scale, _) = unit_of(channel);
        let of_audit = (self.masked)(&channel.name).into_iter();
        let of_audit = of_audit.filter_map(|row| {
            let given = channel.values.get(row).filter(|v| v.is_finite())?;
            Some((*self.places.get(row)?, given * scale))
        });
        of_audit
            .chain(spikes.iter().map(|i| (*i, given[*i])))
            .collect()
    }

    /// A gyro on the grid; `own` are the turns that it felt, `felt` those of all gyros: while the base turns, no axis of it is
    /// at rest.
    fn target(
        &self,
        channel: &Channel,
        own: &[Excursion],
        felt: &[Vec<Excursion>],
        rng: &mut Xoshiro256PlusPlus,
    ) -> Result<Target, AnalysisError> {
        let (scale, unit) = unit_of(channel);
        let (read, lost, guess) = self.given(channel, felt)?;
        let step = scale * (channel.lsb).unwrap_or_else(|| smallest_step(few(&channel.values)));
        let (mut jumps, still, knocks) = self.levelled(channel, (&read, &lost), guess, rng);
        let Still {
            given,
            lost,
            mut y,
            mut c,
            mut fit,
            mut motion_rms,
        } = still;
        let still = motion_rms <= MOTION_RMS;
        let (dct, bins) = (&self.dct, &self.bins);
        // A blow is not loud for longer than it rings.
        let loud = (2.0 * LONGEST_S * self.rate_hz) as usize;
        let spikes = if still {
            spikes((&given, loud), &mut y, &mut c, &mut fit, dct, bins, rng)
        } else {
            vec![]
        };
        let mut spikes = [spikes, knocks.clone()].concat();
        spikes.sort_unstable();
        let aside = self.aside(channel, &read, &spikes);
        let lost = [lost, spikes.clone()].concat();
        if still {
            let panel = Panel::of(dct, bins, c);
            c = fill::first(&channel.name, panel, &mut y, &lost, &mut fit);
        }
        if unit == "deg/s" && !spikes.is_empty() {
            motion_rms = self.motion(&y, &c, &lost, &fit);
        }
        if !jumps.is_empty() {
            c = jumps.put_back(&mut y, &mut fit, (dct, bins));
        }
        Ok(Target {
            name: channel.name.clone(),
            axis: channel.axis,
            unit,
            lsb: channel.lsb.map(|l| l * scale),
            step,
            y: Arc::new(y),
            coefficients: c,
            lost,
            spikes,
            knocks,
            aside,
            jumps,
            explained: vec![],
            wild_from: None,
            excursions: own.to_vec(),
            motion_rms,
            moving: motion_rms > MOTION_RMS,
            astray: false,
            noise: fit.0,
            white: fit.1,
        })
    }

    /// What the motion of an axis is made of beside the one that turns most.
    fn rest(&self, t: &Target, strongest: &Target) -> Rest {
        let top = places_of(MOTION_BAND_HZ.1, self.n, self.rate_hz);
        let axis = [strongest.coefficients[..top].to_vec()];
        let left = |with: &[Vec<f64>], slow| {
            let mut c = t.coefficients.to_vec();
            motion(&mut c, with, self.n, self.rate_hz, slow)
        };
        if self.base != Some(Base::Turntable) {
            return Rest {
                follows: t.motion_rms,
                own: left(&[self.drivers(), &axis].concat(), self.turns()),
                table: false,
            };
        }
        // A table turns one axis: what the others do with the motor, the supply or the temperature, and what is slow
        // on them, is their own.
        let (by_axis, by_known) = (left(&axis, self.turns()), left(&self.known, self.turns()));
        let follows = (t.motion_rms.powi(2) - by_axis.powi(2)).max(0.0).sqrt();
        Rest {
            follows: if by_known < by_axis { 0.0 } else { follows },
            own: left(&[self.known.as_slice(), &axis].concat(), false),
            table: true,
        }
    }
}
