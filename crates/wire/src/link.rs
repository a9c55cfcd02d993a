//! Lost samples, and who lost them.
//!
//! Every tick of the board spends a sequence number, sampled or not. A number that never arrives was lost on the board
//! (no time for the sample, or no room to send it) or on the line (damaged, or never captured). The board counts its
//! own losses in the health frame, which travels in order with the samples; the rest is the line's.

use crate::{Fault, Frame, Health, Hello, Sample};

/// What became of the sequence numbers that the board has spent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Losses {
    /// Samples that arrived.
    pub received: u64,
    /// Samples that the board never sent, by its own count.
    pub device: u64,
    /// Samples that were sent and did not arrive.
    pub line: u64,
    /// Samples that are missing and that nobody can be charged with: no two health frames bracket them yet, a counter
    /// was saturated, or the board was reset in between.
    pub unattributed: u64,
    /// Samples whose number came twice or out of order; a correct board and line never do that.
    pub out_of_order: u64,
    /// Starts of the board that were noticed.
    pub restarts: u64,
}

/// Follows the frames of one board and tells its own losses from the line's.
///
/// Feed it every frame in the order of arrival. Sequence numbers have 16 bits, so a gap of 65536 samples or more
/// (54 min at 20 Hz) between two frames reads shorter than it is by a multiple of that.
#[derive(Clone, Debug, Default)]
pub struct LinkStats {
    losses: Losses,
    /// The number that the next sample should have.
    expected: Option<u16>,
    /// The last health frame's device losses, and what was missing since.
    bracket: Option<Bracket>,
    /// Missing since the last health frame.
    missing: u64,
    restarts: Option<u16>,
    t_ticks: Option<u32>,
}

#[derive(Clone, Copy, Debug)]
struct Bracket {
    overrun: u16,
    dropped: u16,
    uptime_s: u32,
}

impl LinkStats {
    /// Has seen nothing.
    #[must_use]
    pub fn new() -> Self {
        LinkStats::default()
    }

    /// Takes the next frame. Returns the number of samples missing right before it.
    pub fn push(&mut self, frame: &Frame) -> u16 {
        match frame {
            Frame::Sample(sample) => self.sample(sample),
            Frame::Health(health) => self.health(health),
            Frame::Hello(hello) => self.hello(hello),
            Frame::Reply(_) | Frame::Corrected(_) => 0,
        }
    }

    /// What is known so far. Samples missing since the last health frame are among the unattributed.
    #[must_use]
    pub fn losses(&self) -> Losses {
        Losses {
            unattributed: self.losses.unattributed + self.missing,
            ..self.losses
        }
    }

    /// The line was not listened to until now: what was sent meanwhile is nobody's loss, and is not counted here.
    pub fn interrupted(&mut self) {
        self.losses.unattributed += self.missing;
        self.missing = 0;
        self.expected = None;
        self.bracket = None;
    }

    fn sample(&mut self, sample: &Sample) -> u16 {
        // Time that runs backwards by more than the numbers do is a start whose hello frame was lost.
        let backwards = |last: u32| sample.t_ticks.wrapping_sub(last) > u32::MAX / 2;
        if self.t_ticks.is_some_and(backwards) && !self.is_repeated(sample.seq) {
            self.restarted();
        }
        let gap = self.gap_to(sample.seq);
        self.losses.received += 1;
        self.t_ticks = Some(sample.t_ticks);
        match gap {
            Some(gap) => {
                self.expected = Some(sample.seq.wrapping_add(1));
                gap
            }
            None => 0,
        }
    }

    /// Counts what is missing before `seq`; `None` where `seq` was there already.
    fn gap_to(&mut self, seq: u16) -> Option<u16> {
        let gap = seq.wrapping_sub(self.expected.unwrap_or(seq));
        if self.is_repeated(seq) {
            self.losses.out_of_order += 1;
            return None;
        }
        self.missing += u64::from(gap);
        Some(gap)
    }

    /// The last 64 numbers before the expected one are a repetition, not a gap of nearly 65536.
    fn is_repeated(&self, seq: u16) -> bool {
        self.expected
            .is_some_and(|expected| seq.wrapping_sub(expected) >= u16::MAX - 63)
    }

    fn health(&mut self, health: &Health) -> u16 {
        let now = Bracket {
            overrun: health.faults.get(Fault::TickOverrun),
            dropped: health.faults.get(Fault::FrameDropped),
            uptime_s: health.uptime_s,
        };
        if self
            .bracket
            .is_some_and(|last| now.uptime_s < last.uptime_s)
        {
            self.restarted();
        }
        let gap = self.gap_to(health.next_seq).unwrap_or(0);
        if self.expected.is_none() || gap > 0 {
            self.expected = Some(health.next_seq);
        }
        match self.bracket.and_then(|last| now.since(last)) {
            Some(device) => {
                let device = u64::from(device).min(self.missing);
                self.losses.device += device;
                self.losses.line += self.missing - device;
            }
            None => self.losses.unattributed += self.missing,
        }
        self.missing = 0;
        self.bracket = Some(now);
        gap
    }

    fn hello(&mut self, hello: &Hello) -> u16 {
        let fresh = hello.next_seq == 0 && self.expected.is_some_and(|expected| expected != 0);
        if fresh
            || self
                .restarts
                .is_some_and(|restarts| restarts != hello.restarts)
        {
            self.restarted();
        }
        self.restarts = Some(hello.restarts);
        if self.expected.is_none() {
            self.expected = Some(hello.next_seq);
            // A board that starts has lost nothing yet, so its first losses are bracketed from here.
            if hello.next_seq == 0 {
                self.bracket = Some(Bracket {
                    overrun: 0,
                    dropped: 0,
                    uptime_s: 0,
                });
            }
        }
        0
    }

    fn restarted(&mut self) {
        self.losses.restarts += 1;
        self.losses.unattributed += self.missing;
        self.missing = 0;
        self.expected = None;
        self.bracket = None;
        self.t_ticks = None;
    }
}

impl Bracket {
    /// Samples that the board lost since `last`; `None` where its counters cannot say.
    fn since(self, last: Bracket) -> Option<u32> {
        let one = |now: u16, then: u16| (now != u16::MAX).then(|| now.checked_sub(then)).flatten();
        Some(
            u32::from(one(self.overrun, last.overrun)?)
                + u32::from(one(self.dropped, last.dropped)?),
        )
    }
}
