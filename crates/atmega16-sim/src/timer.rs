//! Timers 0, 1 and 2: counting up (normal, CTC, fast PWM), by ticks of a prescaler that runs freely.
//!
//! Nothing is done tick by tick: a timer knows when a flag will be set, and catches up when somebody looks. Counting
//! up and down (phase-correct PWM) is not modelled; a program that asks for it is told so.

/// Overflow.
pub const OVERFLOW: u8 = 1;
/// Compare A (the only one of timers 0 and 2).
pub const COMPARE_A: u8 = 2;
/// Compare B.
pub const COMPARE_B: u8 = 4;
/// Capture flag, set where ICR1 is the top.
pub const CAPTURE: u8 = 8;

/// Where a period ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Top {
    Max,
    Fixed(u16),
    CompareA,
    Capture,
}

/// How it counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Mode {
    top: Top,
    /// Fast PWM: the end of a period is an overflow, and compare values wait for it.
    pwm: bool,
}

/// A timer's state.
#[derive(Clone, Copy, Debug)]
pub struct Timer {
    max: u16,
    mode: Mode,
    /// Cycles for each tick; 0 when stopped.
    divider: u32,
    count: u16,
    compare: [u16; 2],
    waiting: [u16; 2],
    capture: u16,
    /// Flags of [`OVERFLOW`] and the others.
    pub flags: u8,
    /// Cycle at which each flag last went from 0 to 1, by bit.
    rose: [u64; 4],
    /// The counter was written: its value does not match until it has counted.
    written: bool,
    /// The prescaler was reset here.
    prescaler: u64,
    /// Caught up until here.
    seen: u64,
}

/// What a control register asks for and this model has not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unmodelled(pub &'static str);

/// Prescaler of timers 0 and 1 by CS2:0.
pub fn divider_01(cs: u8) -> Result<u32, Unmodelled> {
    match cs & 7 {
        0 => Ok(0),
        1 => Ok(1),
        2 => Ok(8),
        3 => Ok(64),
        4 => Ok(256),
        5 => Ok(1024),
        _ => Err(Unmodelled("a timer clocked by a pin")),
    }
}

/// Prescaler of timer 2 by CS2:0.
pub fn divider_2(cs: u8) -> u32 {
    [0, 1, 8, 32, 64, 128, 256, 1024][usize::from(cs & 7)]
}

const UP_AND_DOWN: Unmodelled = Unmodelled("a timer that counts up and down (phase-correct PWM)");

impl Timer {
    /// Stopped at 0, as after a reset at cycle `now`. `max` is 255 or 65535.
    pub fn new(max: u16, now: u64) -> Self {
        Timer {
            max,
            mode: Mode {
                top: Top::Max,
                pwm: false,
            },
            divider: 0,
            count: 0,
            compare: [0; 2],
            waiting: [0; 2],
            capture: 0,
            flags: 0,
            rose: [0; 4],
            written: false,
            prescaler: now,
            seen: now,
        }
    }

    /// Mode of an 8-bit timer by WGM1:0.
    pub fn set_mode_8(&mut self, wgm: u8) -> Result<(), Unmodelled> {
        self.mode = match wgm {
            0 => Mode {
                top: Top::Max,
                pwm: false,
            },
            2 => Mode {
                top: Top::CompareA,
                pwm: false,
            },
            3 => Mode {
                top: Top::Max,
                pwm: true,
            },
            // While it stands, a program may pass through any mode on its way to another.
            _ if self.divider == 0 => self.mode,
            _ => return Err(UP_AND_DOWN),
        };
        self.release();
        Ok(())
    }

    /// Mode of timer 1 by WGM3:0.
    pub fn set_mode_16(&mut self, wgm: u8) -> Result<(), Unmodelled> {
        let (top, pwm) = match wgm {
            0 => (Top::Max, false),
            4 => (Top::CompareA, false),
            12 => (Top::Capture, false),
            5 => (Top::Fixed(0xff), true),
            6 => (Top::Fixed(0x1ff), true),
            7 => (Top::Fixed(0x3ff), true),
            14 => (Top::Capture, true),
            15 => (Top::CompareA, true),
            _ if self.divider == 0 && !matches!(wgm, 0 | 4..=7 | 12 | 14 | 15) => return Ok(()),
            13 => return Err(Unmodelled("a reserved mode of timer 1")),
            _ => return Err(UP_AND_DOWN),
        };
        self.mode = Mode { top, pwm };
        self.release();
        Ok(())
    }

    /// Sets the cycles for each tick, 0 to stop. Catch up first.
    pub fn set_divider(&mut self, divider: u32) {
        self.divider = divider;
    }

    /// Resets the prescaler. Catch up first.
    pub fn reset_prescaler(&mut self, now: u64) {
        self.prescaler = now;
    }

    /// The counter. Catch up first.
    pub fn count(&self) -> u16 {
        self.count
    }

    /// Writes the counter. Catch up first.
    pub fn set_count(&mut self, count: u16) {
        self.count = count & self.max;
        self.written = true;
    }

    /// Compare A or B as the program reads it.
    pub fn compare(&self, which: usize) -> u16 {
        self.waiting[which]
    }

    /// Writes compare A or B. Catch up first.
    pub fn set_compare(&mut self, which: usize, value: u16) {
        self.waiting[which] = value & self.max;
        if !self.mode.pwm {
            self.release();
        }
    }

    /// ICR1.
    pub fn capture(&self) -> u16 {
        self.capture
    }

    /// Writes ICR1. Catch up first.
    pub fn set_capture(&mut self, value: u16) {
        self.capture = value;
    }

    fn release(&mut self) {
        self.compare = self.waiting;
    }

    fn top(&self) -> u16 {
        match self.mode.top {
            Top::Max => self.max,
            Top::Fixed(top) => top,
            Top::CompareA => self.compare[0],
            Top::Capture => self.capture,
        }
    }

    /// Edges of the prescaler up to `at`.
    fn edges(&self, at: u64) -> u64 {
        at.saturating_sub(self.prescaler) / u64::from(self.divider)
    }

    /// Counts up to the next value at which something happens, or by `ticks` if that is nearer. Returns the ticks
    /// that it took.
    fn step(&mut self, ticks: u64) -> u64 {
        // A counter above its top runs on to the maximum.
        let top = self.top();
        let end = if self.count <= top { top } else { self.max };
        let mut stop = end;
        for compare in self.compare {
            if compare >= self.count && compare < stop {
                stop = compare;
            }
        }
        let needed = u64::from(stop - self.count) + 1;
        if needed > ticks {
            self.count += ticks as u16;
            self.written = false;
            return ticks;
        }
        // Flags are set by the tick that leaves the value.
        let blocked = self.written && needed == 1;
        self.written = false;
        if !blocked {
            if stop == self.compare[0] {
                self.flags |= COMPARE_A;
            }
            if stop == self.compare[1] {
                self.flags |= COMPARE_B;
            }
        }
        if stop != end {
            self.count = stop + 1;
            return needed;
        }
        self.count = 0;
        if stop == self.max || self.mode.pwm {
            self.flags |= OVERFLOW;
        }
        if self.mode.top == Top::Capture && stop == top {
            self.flags |= CAPTURE;
        }
        if self.mode.pwm {
            self.release();
        }
        needed
    }

    /// Brings counter and flags up to `now`.
    pub fn catch_up(&mut self, now: u64) {
        if self.divider == 0 {
            self.seen = now;
            return;
        }
        let first_edge = self.edges(self.seen);
        let all = self.edges(now) - first_edge;
        let mut ticks = all;
        self.seen = now;
        // Long after the last look, whole periods have done no more than set every flag of a period.
        let period = u64::from(self.max) + 1;
        if ticks > 4 * period {
            let whole = u64::from(self.top()) + 1;
            let mut first = 3 * period;
            ticks -= first;
            while first > 0 {
                first -= self.step(first);
            }
            ticks %= whole;
        }
        while ticks > 0 {
            let before = self.flags;
            ticks -= self.step(ticks);
            let risen = self.flags & !before;
            for bit in (0..4).filter(|bit| risen >> bit & 1 != 0) {
                let edge = first_edge + all - ticks;
                self.rose[bit] = self.prescaler + edge * u64::from(self.divider);
            }
        }
    }

    /// When a flag that is set was set. Catch up first.
    pub fn set_at(&self, flag: u8) -> Option<u64> {
        (self.flags & flag != 0).then(|| self.rose[flag.trailing_zeros() as usize & 3])
    }

    /// The cycle at which the first of `flags` that is not set yet will be. Catch up first.
    pub fn next(&self, flags: u8) -> Option<u64> {
        if self.divider == 0 || flags & !self.flags == 0 {
            return None;
        }
        let mut ahead = *self;
        let mut ticks = 0;
        // At most: up to the maximum, then three stops of each period, twice, for a compare value that waits.
        for _ in 0..8 {
            ticks += ahead.step(u64::MAX);
            if flags & ahead.flags & !self.flags != 0 {
                let edge = self.edges(self.seen) + ticks;
                return Some(self.prescaler + edge * u64::from(self.divider));
            }
        }
        None
    }
}
