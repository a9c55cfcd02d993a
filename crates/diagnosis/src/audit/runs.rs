//! Repeats in a row: how many of them are of stalls, and how long those last.
//!
//! A reading repeats the one before by chance p, so that of n readings n (1 - p) p^k begin k repeats and more. What lies beyond
//! that are stalls. Chance goes on before and after one: its run of repeats is longer than the stall by 2p, on the average.

use std::ops::Range;

use model::parameter::Parameter;

/// Times as many runs as by chance of which the most are stalls, and are left out whole.
const MOST: f64 = 2.0;

/// Repeats, of readings that repeat by chance as well.
pub(super) struct Runs<'a> {
    /// Rows that repeat the one before, and runs of them in that list.
    rows: &'a [usize],
    runs: Vec<Range<usize>>,
    /// Readings in all, and the chance that one repeats.
    all: f64,
    chance: f64,
}

impl<'a> Runs<'a> {
    /// Of `all` readings `rows`, in ascending order, repeat the one before; `expected` would by chance.
    pub fn new(rows: &'a [usize], expected: f64, all: usize) -> Self {
        let mut runs: Vec<Range<usize>> = vec![];
        for (i, row) in rows.iter().enumerate() {
            match runs.last_mut() {
                Some(run) if rows[run.end - 1] + 1 == *row => run.end = i + 1,
                _ => runs.push(i..i + 1),
            }
        }
        let all = all.max(1) as f64;
        Self {
            rows,
            runs,
            all,
            chance: (expected / all).clamp(0.0, 0.9),
        }
    }

    /// Readings that a stall repeats: a part of what it does would have repeated anyway.
    pub fn stalled(&self) -> f64 {
        let excess = self.rows.len() as f64 - self.chance * self.all;
        (excess / (1.0 - self.chance)).clamp(1.0, self.all)
    }

    /// How many of them a stall makes, on the average.
    pub fn running(&self) -> Parameter {
        let (stalled, p) = (self.stalled(), self.chance);
        let by_chance = p * (1.0 - p) * (self.all - stalled);
        let stalls = (self.runs.len() as f64 - by_chance) / (1.0 - 2.0 * p).max(0.1);
        Parameter::exact((stalled / stalls.max(1.0)).max(1.0), "1")
    }

    /// The same on the average over the frames, each of which is in a longer run the longer it is.
    pub fn running_by_frames(&self) -> Parameter {
        let (stalled, p, running) = (self.stalled(), self.chance, self.running().value);
        let seen: f64 = self.runs.iter().map(|r| (r.len() as f64).powi(2)).sum();
        let by_chance = p * (1.0 + p) / (1.0 - p) * (self.all - stalled);
        // Chance goes on by a geometric number on either side.
        let beyond = 2.0 * p / (1.0 - p);
        let its_square = (2.0 * p + 4.0 * p * p) / (1.0 - p).powi(2);
        let longer = (2.0 * running * beyond + its_square) * stalled / running;
        let own = (seen - by_chance - longer) / stalled;
        Parameter::exact(own.clamp(running, self.all), "1")
    }

    /// Both, by their names.
    pub fn how_long(&self) -> [(String, Parameter); 2] {
        let both = [
            ("running", self.running()),
            ("running_by_frames", self.running_by_frames()),
        ];
        both.map(|(name, value)| (name.to_owned(), value))
    }

    /// Rows of the runs that are longer than chance makes them.
    pub fn beyond_chance(&self) -> impl Iterator<Item = usize> {
        let longest = self.runs.iter().map(Range::len).max().unwrap_or(0);
        let shortest = (1..=longest).find(|least| {
            let found = self.runs.iter().filter(|r| r.len() >= *least).count() as f64;
            found > MOST * self.all * (1.0 - self.chance) * self.chance.powf(*least as f64)
        });
        let runs = self.runs.iter();
        let long = runs.filter(move |r| shortest.is_some_and(|s| r.len() >= s));
        long.flat_map(|r| &self.rows[r.clone()]).copied()
    }
}

#[cfg(test)]
mod tests {
    use rand_core::{Rng, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::Runs;

    const READINGS: usize = 50_000;

    /// A stall of four at every hundredth reading, and every 20th reading repeats by chance.
    fn stalls() -> Vec<usize> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        let repeats = |i: &usize| (1..=4).contains(&(i % 100)) || rng.next_u32() % 20 == 0;
        (0..READINGS).filter(repeats).collect()
    }

    #[test]
    fn stalls_among_repeats_by_chance_have_their_length() {
        let rows = stalls();
        let all = Runs::new(&rows, READINGS as f64 / 20.0, READINGS);
        // Both within three standard errors of what chance adds.
        assert!((all.stalled() - 2000.0).abs() < 150.0, "{}", all.stalled());
        let running = all.running().value;
        assert!((running - 4.0).abs() < 0.6, "{running}");
        let by_frames = all.running_by_frames().value;
        assert!((by_frames - 4.0).abs() < 0.6, "{by_frames}");
    }

    #[test]
    fn single_repeats_by_chance_are_not_left_out() {
        let rows = stalls();
        let all = Runs::new(&rows, READINGS as f64 / 20.0, READINGS);
        let left: Vec<usize> = all.beyond_chance().collect();
        let stalled = (0..READINGS).filter(|i| (1..=4).contains(&(i % 100)));
        assert!(stalled.into_iter().all(|i| left.contains(&i)));
        // Chance goes on where a stall ends, and makes three in a row once in a while.
        assert!(left.len() < 2300, "{}", left.len());
    }

    #[test]
    fn without_chance_all_are_stalls() {
        let all = Runs::new(&[3, 7, 8, 9], 0.0, 100);
        assert_eq!((all.stalled(), all.running().value), (4.0, 2.0));
        // One is alone, and three are three.
        assert_eq!(all.running_by_frames().value, 2.5);
        assert_eq!(all.beyond_chance().count(), 4);
    }
}
