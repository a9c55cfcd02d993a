//! One time and one numbering through unplugged cables, restarts of the board and resumed captures.
//!
//! On the wire, sequence numbers have 16 bits and times 32, and both begin anew when the board does. Here they go on.

use wire::{Hello, Sample};

use super::ends::LastRow;

/// A reset whose hello frame was lost shows as a clock that disagrees with the PC's by more than this, s ...
const CLOCKS_AGREE_S: f64 = 2.0;
/// ... or by more than this share of the time between: a crystal is better by a factor of ten.
const CLOCKS_AGREE: f64 = 1e-3;

/// Where a sample belongs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Sequence number, which goes on over wraps and restarts.
    pub seq: u64,
    /// Time, ticks, which goes on likewise.
    pub t_ticks: u64,
    /// Sample instants since the last one that have no sample.
    pub missing: u64,
}

/// What a restart of the board did to time and numbering.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Restart {
    /// Sample instants between, by this computer's clock, rounded to whole ones.
    pub instants: u64,
    /// Added to the board's numbers from here on.
    pub seq_offset: u64,
    /// Added to the board's ticks from here on.
    pub t_offset: u64,
}

#[derive(Clone, Copy, Debug)]
struct Last {
    sample: (u16, u32),
    place: (u64, u64),
    host_s: f64,
}

/// Follows samples.
#[derive(Clone, Debug)]
pub struct Continuity {
    tick_s: f64,
    ticks_per_sample: u64,
    last: Option<Last>,
    restarted: Restarted,
    fresh: bool,
}

/// What hello frames say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Restarted {
    No,
    /// The next number is 0: a start, or a wrap of the numbers.
    Perhaps,
    Yes,
}

impl Continuity {
    /// For a board with ticks of `tick_s` seconds and a sample every `ticks_per_sample` of them.
    #[must_use]
    pub fn new(tick_s: f64, ticks_per_sample: u64) -> Self {
        Self {
            tick_s,
            ticks_per_sample: ticks_per_sample.max(1),
            last: None,
            restarted: Restarted::No,
            fresh: false,
        }
    }

    /// As [`new`](Self::new), to go on after a row that is there already: its number, its ticks, its host time, and what
    /// was added to the board's own by then.
    #[must_use]
    pub fn after(mut self, seq: u64, t_ticks: u64, host_s: f64, offsets: (u64, u64)) -> Self {
        self.last = Some(Last {
            sample: (
                seq.wrapping_sub(offsets.0) as u16,
                t_ticks.wrapping_sub(offsets.1) as u32,
            ),
            place: (seq, t_ticks),
            host_s,
        });
        self.fresh = true;
        self
    }

    /// What is added to the board's own numbers and ticks by now, and where the last sample was put; `None` before the first.
    pub(super) fn at(&self) -> Option<((u64, u64), LastRow)> {
        let last = self.last?;
        let offsets = (
            last.place.0.wrapping_sub(u64::from(last.sample.0)),
            last.place.1.wrapping_sub(u64::from(last.sample.1)),
        );
        let row = LastRow {
            seq: last.place.0,
            t_ticks: last.place.1,
            host_s: last.host_s,
            counts: String::new(),
        };
        Some((offsets, row))
    }

    /// A hello frame: `before` is the count of restarts in the last one.
    pub fn hello(&mut self, hello: &Hello, before: Option<u16>) {
        if self.last.is_none() {
            return;
        }
        if before.is_some_and(|before| before != hello.restarts) {
            self.restarted = Restarted::Yes;
        } else if hello.next_seq == 0 && self.restarted == Restarted::No {
            self.restarted = Restarted::Perhaps;
        }
    }

    /// The line was opened anew: the next sample's host time is its own, and no buffer's.
    pub fn fresh(&mut self) {
        self.fresh = true;
    }

    /// The place of the first sample after a start of the board, by the host's clock, in ticks since the last one.
    fn restarted_at(&self, last: Last, raw: (u16, u32), elapsed: f64) -> ((u64, u64), Restart) {
        let instants = (elapsed / self.ticks_per_sample as f64).round().max(1.0) as u64;
        let place = (
            last.place.0 + instants,
            last.place.1 + instants * self.ticks_per_sample,
        );
        let restart = Restart {
            instants,
            seq_offset: place.0.wrapping_sub(u64::from(raw.0)),
            t_offset: place.1.wrapping_sub(u64::from(raw.1)),
        };
        (place, restart)
    }

    /// The place of a sample that many ticks after the last one.
    fn gone_on_to(&self, last: Last, raw: (u16, u32), ticks: u64) -> (u64, u64) {
        let numbers = u64::from(raw.0.wrapping_sub(last.sample.0));
        // Numbers wrap after 65536 samples; how often, the ticks tell.
        let by_time = ticks as f64 / self.ticks_per_sample as f64;
        let turns = ((by_time - numbers as f64) / 65_536.0).round().max(0.0) as u64;
        (
            last.place.0 + numbers + turns * 65_536,
            last.place.1 + ticks,
        )
    }

    /// Places a sample that arrived at `host_s`.
    pub fn place(&mut self, sample: &Sample, host_s: f64) -> (Place, Option<Restart>) {
        let raw = (sample.seq, sample.t_ticks);
        let Some(last) = self.last else {
            let place = (u64::from(raw.0), u64::from(raw.1));
            self.last = Some(Last {
                sample: raw,
                place,
                host_s,
            });
            return (
                Place {
                    seq: place.0,
                    t_ticks: place.1,
                    missing: 0,
                },
                None,
            );
        };
        let elapsed = ((host_s - last.host_s) / self.tick_s).max(0.0);
        let forward = raw.1.wrapping_sub(last.sample.1);
        // Ticks wrap after hours; how often, only another clock can tell.
        let turns = ((elapsed - f64::from(forward)) / 2f64.powi(32))
            .round()
            .max(0.0);
        let ticks = u64::from(forward) + turns as u64 * (1 << 32);
        let disagree = (ticks as f64 - elapsed).abs() * self.tick_s
            > CLOCKS_AGREE_S.max(CLOCKS_AGREE * elapsed * self.tick_s);
        let backwards = turns == 0.0 && forward > u32::MAX / 2;
        let told = match self.restarted {
            Restarted::No => false,
            // Numbers wrap while time goes on.
            Restarted::Perhaps => raw.1 <= last.sample.1,
            Restarted::Yes => true,
        };
        let is_restart = told || backwards || (self.fresh && disagree);
        let (place, restart) = if is_restart {
            let (place, restart) = self.restarted_at(last, raw, elapsed);
            (place, Some(restart))
        } else {
            (self.gone_on_to(last, raw, ticks), None)
        };
        let missing = (place.0 - last.place.0).saturating_sub(1);
        self.last = Some(Last {
            sample: raw,
            place,
            host_s,
        });
        (self.restarted, self.fresh) = (Restarted::No, false);
        (
            Place {
                seq: place.0,
                t_ticks: place.1,
                missing,
            },
            restart,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(seq: u16, t_ticks: u32) -> Sample {
        Sample {
            seq,
            t_ticks,
            ..Sample::default()
        }
    }

    fn at(seq: u64, t_ticks: u64, missing: u64) -> Place {
        Place {
            seq,
            t_ticks,
            missing,
        }
    }

    #[test]
    fn numbers_and_ticks_go_on_over_their_wraps() {
        let mut follow = Continuity::new(4e-6, 12_500);
        follow.place(&sample(65_535, u32::MAX - 99), 0.0);
        let (place, restart) = follow.place(&sample(0, 12_400), 0.05);
        assert_eq!(restart, None);
        assert_eq!(place, at(65_536, (1 << 32) - 100 + 12_500, 0));
    }

    #[test]
    fn a_cable_out_for_longer_than_the_numbers_last_is_counted_by_the_ticks_and_then_by_the_clock()
    {
        // 6 h at 20 Hz: 432000 samples, 5.4e9 ticks.
        let mut follow = Continuity::new(4e-6, 12_500);
        follow.place(&sample(10, 1_000), 1.0);
        follow.fresh();
        let ticks = 432_000u64 * 12_500;
        let after = sample((10 + 432_000u64) as u16, (1_000 + ticks) as u32);
        // The board's crystal is 50 ppm off.
        let (place, restart) = follow.place(&after, 1.0 + 21_600.0 * 1.000_05);
        assert_eq!(restart, None);
        assert_eq!(place, at(432_010, 1_000 + ticks, 431_999));
    }

    #[test]
    fn a_restart_goes_on_by_this_computers_clock() {
        let mut follow = Continuity::new(4e-6, 12_500);
        follow.place(&sample(199, 2_500_000), 10.0);
        follow.hello(&Hello::default(), Some(0));
        let (place, restart) = follow.place(&sample(0, 12_500), 10.76);
        assert_eq!(place, at(214, 2_500_000 + 15 * 12_500, 14));
        let restart = restart.expect("it was told");
        assert_eq!((restart.seq_offset, restart.t_offset), (214, 2_675_000));
        let (place, again) = follow.place(&sample(1, 25_000), 10.81);
        assert_eq!((place, again), (at(215, 2_700_000, 0), None));
    }

    #[test]
    fn a_hello_where_the_numbers_wrap_is_no_restart_and_one_with_another_count_is() {
        let mut follow = Continuity::new(4e-6, 12_500);
        let at_wrap = 65_536 * 12_500;
        follow.place(&sample(65_535, at_wrap - 12_500), 3_276.75);
        let hello = Hello {
            restarts: 3,
            ..Hello::default()
        };
        follow.hello(&hello, Some(3));
        let (place, restart) = follow.place(&sample(0, at_wrap), 3_276.8);
        assert_eq!((place, restart), (at(65_536, u64::from(at_wrap), 0), None));
        follow.hello(&hello, Some(2));
        let later = follow.place(&sample(9_000, at_wrap + 9_000 * 12_500), 3_726.8);
        assert!(later.1.is_some());
    }

    #[test]
    fn a_restart_that_nobody_told_is_seen_by_ticks_that_run_backwards_or_by_the_clock() {
        let mut follow = Continuity::new(4e-6, 12_500);
        follow.place(&sample(199, 2_500_000), 10.0);
        assert!(follow.place(&sample(3, 50_000), 11.0).1.is_some());
        // Power was cut for long, and the board has run for longer since than before: ticks run forwards.
        follow.fresh();
        let (_, restart) = follow.place(&sample(1_200, 15_000_000), 500.0);
        assert!(restart.is_some());
    }

    #[test]
    fn a_computer_that_was_busy_is_no_restart() {
        let mut follow = Continuity::new(4e-6, 12_500);
        follow.place(&sample(0, 12_500), 0.05);
        // Ten seconds of samples wait in the system's buffer and come at once.
        for k in 1..200u16 {
            let (place, restart) = follow.place(&sample(k, 12_500 * (u32::from(k) + 1)), 10.0);
            assert_eq!((place.seq, place.missing, restart), (u64::from(k), 0, None));
        }
    }

    #[test]
    fn a_resumed_capture_goes_on_where_the_file_ends() {
        let offsets = (214, 2_675_000);
        let mut follow = Continuity::new(4e-6, 12_500).after(215, 2_700_000, 10.81, offsets);
        let (place, restart) = follow.place(&sample(101, 25_000 + 100 * 12_500), 15.82);
        assert_eq!(restart, None);
        assert_eq!(place, at(315, 2_700_000 + 1_250_000, 99));
    }
}
