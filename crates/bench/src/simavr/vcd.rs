//! The traces of the board's pins as a value change dump (IEEE Std 1364, clause 18), to lay beside a logic analyser.
//!
//! | trace | pin | from |
//! |---|---|---|
//! | `cs_x`, `cs_y`, `cs_z` | PB2, PB3, PB4 | each change, to the cycle |
//! | `sck`, `mosi`, `miso` | PB7, PB5, PB6 | each byte at its last bit, its bits by the clock that the chip is set to (mode 3) |
//! | `txd` | PD1 | each byte at the end of its stop bit, its bits by the divisor that the chip is set to |
//! | `rxd` | PD0 | each byte of the host, its bits by the host's clock |
//! | `stop` | PD2 | each change: low as the motor's stop is pressed |
//! | `oc2` | PD7 | frequency and width as the timer is set; where in a pulse it starts is not simulated |
//! | `direction` | PD6 | each change |
//! | `tick` | - | the interrupt of the sampling instant: high for 1 us from its flag on |
//! | `adc` | - | the converter holds an accelerometer's voltage: high for 1 us |

use std::fmt::Write as _;

use super::{Event, Probe, TICK_VECTOR};

/// The traces, in their order: name, and level before anything has happened.
pub const TRACES: [(&str, bool); 13] = [
    ("cs_x", true),
    ("cs_y", true),
    ("cs_z", true),
    ("sck", true),
    ("mosi", true),
    ("miso", true),
    ("txd", true),
    ("oc2", false),
    ("direction", false),
    ("tick", false),
    ("adc", false),
    ("rxd", true),
    ("stop", true),
];
const SCK: usize = 3;
const MOSI: usize = 4;
const MISO: usize = 5;
const TXD: usize = 6;
const OC2: usize = 7;
const DIRECTION: usize = 8;
const TICK: usize = 9;
const ADC: usize = 10;
const RXD: usize = 11;
const STOP: usize = 12;
/// How long a mark is high, cycles: 1 us.
const MARK: u64 = 16;
/// Steps of time in a second.
const PER_SECOND: f64 = 1e12;

/// Collects changes within a stretch of a run.
#[derive(Clone, Debug)]
pub struct Vcd {
    from: u64,
    to: u64,
    /// Of each trace the last change before the stretch: how it begins.
    before: [(u64, bool); TRACES.len()],
    /// Cycle, trace, level: bytes are known at their ends, so these are put in order at last.
    changes: Vec<(u64, usize, bool)>,
    /// Since when OC2 puts out what, and that: width 0..=1, pulses a second.
    pulse: (u64, f64, f64),
    hz: f64,
}

impl Vcd {
    /// Of the cycles from `from` to `to`, of a chip of `hz`.
    #[must_use]
    pub fn new(from: u64, to: u64, hz: f64) -> Self {
        Self {
            from,
            to,
            before: TRACES.map(|(_, level)| (0, level)),
            changes: Vec::new(),
            pulse: (0, 0.0, 0.0),
            hz,
        }
    }

    fn change(&mut self, at: u64, trace: usize, level: bool) {
        if at < self.from {
            // Hours may lie before the stretch: they leave one level each.
            if let Some(last) = self.before.get_mut(trace)
                && at >= last.0
            {
                *last = (at, level);
            }
        } else if at <= self.to {
            self.changes.push((at, trace, level));
        }
    }

    fn mark(&mut self, at: u64, trace: usize) {
        self.change(at, trace, true);
        self.change(at + MARK, trace, false);
    }

    /// Eight bits in mode 3: the clock rests high, data change as it falls and are taken as it rises.
    fn spi(&mut self, end: u64, mosi: u8, miso: u8, cycles: u64) {
        let start = end.saturating_sub(cycles);
        for k in 0..8u64 {
            let fall = start + k * cycles / 8;
            let bit = |byte: u8| byte >> (7 - k) & 1 != 0;
            self.change(fall, SCK, false);
            self.change(fall, MOSI, bit(mosi));
            self.change(fall, MISO, bit(miso));
            self.change(fall + cycles / 16, SCK, true);
        }
    }

    /// A byte of 8N1, the lowest bit first.
    fn uart(&mut self, start: f64, trace: usize, byte: u8, bit: f64) {
        let at = |k: u32| (start + f64::from(k) * bit).round() as u64;
        self.change(at(0), trace, false);
        for k in 0..8 {
            self.change(at(k + 1), trace, byte >> k & 1 != 0);
        }
        self.change(at(9), trace, true);
    }

    /// The pulses of OC2 up to a cycle.
    fn pulses(&mut self, until: u64) {
        let (since, high, hz) = self.pulse;
        if hz <= 0.0 || high <= 0.0 || high >= 1.0 {
            self.change(since, OC2, high >= 0.5);
            return;
        }
        let period = self.hz / hz;
        // What lies before the stretch is not wanted.
        let first = (self.from.saturating_sub(since) as f64 / period).floor() as u64;
        let end = until.min(self.to);
        for k in first.. {
            let rise = since + (k as f64 * period) as u64;
            if rise >= end {
                break;
            }
            self.change(rise, OC2, true);
            self.change((rise + (high * period) as u64).min(end), OC2, false);
        }
    }

    /// The dump.
    #[must_use]
    pub fn text(&self) -> String {
        let mut whole = self.clone();
        whole.pulses(self.to);
        let mut changes = whole.changes;
        // In the order of time; of one time in that in which they were told.
        changes.sort_by_key(|(at, ..)| *at);
        let mut out = String::from(
            "$version imu-stand run --vcd $end\n$timescale 1 ps $end\n$scope module board $end\n",
        );
        let code = |trace: usize| char::from(b'!' + trace as u8);
        for (k, (name, _)) in TRACES.iter().enumerate() {
            let _ = writeln!(out, "$var wire 1 {} {name} $end", code(k));
        }
        out.push_str("$upscope $end\n$enddefinitions $end\n");
        let mut levels = whole.before.map(|(_, level)| level);
        let time = |cycle: u64| (cycle as f64 / self.hz * PER_SECOND).round() as u64;
        let _ = write!(out, "#{}\n$dumpvars\n", time(self.from));
        for (k, level) in levels.iter().enumerate() {
            let _ = writeln!(out, "{}{}", u8::from(*level), code(k));
        }
        out.push_str("$end\n");
        let mut last = self.from;
        for (at, trace, level) in &changes {
            if std::mem::replace(&mut levels[*trace], *level) == *level {
                continue;
            }
            if std::mem::replace(&mut last, *at) != *at {
                let _ = writeln!(out, "#{}", time(*at));
            }
            let _ = writeln!(out, "{}{}", u8::from(*level), code(*trace));
        }
        let _ = writeln!(out, "#{}", time(self.to));
        out
    }
}

impl Probe for Vcd {
    fn event(&mut self, at: u64, event: Event) {
        match event {
            Event::Select { axis, selected } => self.change(at, axis, !selected),
            Event::Spi { mosi, miso, cycles } => self.spi(at, mosi, miso, cycles),
            Event::Uart { byte, bit } => {
                self.uart(at.saturating_sub(10 * bit) as f64, TXD, byte, bit as f64);
            }
            Event::Received { byte, bit } => self.uart(at as f64, RXD, byte, bit),
            Event::Stop { pressed } => self.change(at, STOP, !pressed),
            Event::Adc { .. } => self.mark(at, ADC),
            Event::Interrupt {
                vector: TICK_VECTOR,
            } => self.mark(at, TICK),
            Event::Interrupt { .. } => {}
            Event::Motor { duty } => {
                if duty != 0.0 {
                    self.change(at, DIRECTION, duty < 0.0);
                }
            }
            Event::Pulse { high, hz } => {
                self.pulses(at);
                self.pulse = (at, high, hz);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hours_before_the_stretch_leave_one_level_of_each_trace() {
        let mut vcd = Vcd::new(1_000_000, 1_000_100, 16e6);
        for at in (0..1_000_000).step_by(100) {
            let (axis, selected) = (2, at % 200 == 100);
            vcd.event(at, Event::Select { axis, selected });
            let (high, hz) = (0.5, 7812.5);
            vcd.event(at, Event::Pulse { high, hz });
        }
        assert!(vcd.changes.len() < 10, "{}", vcd.changes.len());
        assert!(vcd.text().contains("\n0#\n"), "cs_z was left low");
    }

    #[test]
    fn a_byte_is_eight_bits_by_the_clock_and_the_stretch_begins_as_it_was_left() {
        let mut vcd = Vcd::new(100, 400, 16e6);
        vcd.event(
            50,
            Event::Select {
                axis: 1,
                selected: true,
            },
        );
        vcd.event(
            256,
            Event::Spi {
                mosi: 0xa5,
                miso: 0x0f,
                cycles: 128,
            },
        );
        vcd.event(
            300,
            Event::Select {
                axis: 1,
                selected: false,
            },
        );
        vcd.event(
            900,
            Event::Select {
                axis: 0,
                selected: true,
            },
        );
        let text = vcd.text();
        let (head, rest) = text.split_once("$dumpvars").unwrap();
        assert!(
            head.contains("$timescale 1 ps") && head.contains("$var wire 1 \" cs_y"),
            "{head}"
        );
        let (start, rest) = rest.split_once("$end\n").unwrap();
        assert!(
            start.contains("0\"") && start.contains("1!"),
            "cs_y was low before: {start}"
        );
        // Eight falls and eight rises of the clock, 16 cycles of 62.5 ns apart.
        assert_eq!(rest.matches("0$").count(), 8);
        assert_eq!(rest.matches("1$").count(), 8);
        assert!(rest.starts_with("#8000000\n0$\n"), "128 cycles: {rest}");
        assert!(rest.contains("#18750000\n1\"\n"), "300 cycles: {rest}");
        assert!(
            rest.ends_with("#25000000\n") && !rest.contains("0!"),
            "{rest}"
        );
    }
}
