//! The firmware's image on a simulated ATmega16, with this stand at its pins.
//!
//! What the board's wiring is, this file says once more: chip selects at PB2, PB3, PB4 (x, y, z), the accelerometer's
//! outputs at ADC 0, 1, 2 and its g-select pins at PC0, PC1 (open drain), the motor's pulse width at PD7 (OC2) and its
//! direction at PD6, the motor's stop at PD2, a contact to ground that is open unless the scenario or a test closes it.

mod error;
mod vcd;
mod world;

use std::collections::VecDeque;
use std::ops::ControlFlow;

use atmega16_sim::{LoadError, Mcu, Port, ResetCause, Stop};
use wire::{Request, encode_request};

pub use self::error::{Died, SimavrError};
pub use self::vcd::{TRACES, Vcd};
use self::world::World;
use crate::native::{CLOCK_HZ, Instants, Timeline};
use crate::run::{Cable, with_nonce};
use crate::{Ending, Run, Scenario, SerialByte, Stand, TimedRequest};

/// Compare A of timer 1: the tick.
const TICK_VECTOR: u8 = 6;
/// The motor's stop, PD2.
const STOP: u8 = 1 << 2;

/// What happens at the pins, in cycles since power came on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    /// A chip select goes low or high.
    Select {
        /// 0, 1, 2.
        axis: usize,
        /// Low.
        selected: bool,
    },
    /// Eight bits have gone both ways.
    Spi {
        /// From the board.
        mosi: u8,
        /// To the board.
        miso: u8,
        /// Cycles of the eight bits.
        cycles: u64,
    },
    /// The converter holds an input.
    Adc {
        /// 0..=7.
        channel: u8,
    },
    /// An interrupt is taken.
    Interrupt {
        /// Its number, reset being 0.
        vector: u8,
    },
    /// The motor's command changes, -1..=1.
    Motor {
        /// Signed by the direction pin.
        duty: f64,
    },
    /// OC2 puts out other pulses.
    Pulse {
        /// Share of the time for which it is high, 0..=1.
        high: f64,
        /// Pulses a second; 0 for a steady level.
        hz: f64,
    },
    /// A byte has left at TXD, the end of its stop bit now.
    Uart {
        /// The byte.
        byte: u8,
        /// Cycles of each bit.
        bit: u64,
    },
    /// The host begins to send a byte at RXD. It is told as the byte is put on the line, which may be before its cycle.
    Received {
        /// The byte.
        byte: u8,
        /// Cycles of each bit.
        bit: f64,
    },
    /// The motor's stop is pressed, or let go.
    Stop {
        /// PD2 is low.
        pressed: bool,
    },
}

/// The byte of a gyro's answer that goes to the board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Answer {
    /// 0, 1, 2.
    pub axis: usize,
    /// The word that it answers: the frame before this one.
    pub asked: u16,
    /// The high byte (first on the wire) or the low one.
    pub is_high: bool,
    /// What the part says.
    pub byte: u8,
}

/// Probes and clips on the board's lines: sees what happens there, and can put something else on them.
pub trait Probe {
    /// Something has happened at cycle `at`.
    fn event(&mut self, _at: u64, _event: Event) {}
    /// What arrives at MISO at `t` s of what the selected gyro says.
    fn miso(&mut self, _t: f64, answer: Answer) -> u8 {
        answer.byte
    }
    /// What arrives at an ADC input at `t` s of the voltage there.
    fn volts(&mut self, _t: f64, _channel: u8, volts: f64) -> f64 {
        volts
    }
    /// Whether a chip select that goes low at `t` s reaches its gyro.
    fn select_arrives(&mut self, _t: f64, _axis: usize) -> bool {
        true
    }
}

/// No probe.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoProbe;

impl Probe for NoProbe {}

/// What the gyros' data sheet asks of the board's SPI, and how often it was not so.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Discipline {
    /// Frames of 16 bits with one gyro.
    pub frames: u64,
    /// Selections with another number of bits.
    pub broken_frames: u64,
    /// Bytes with no gyro or several selected.
    pub unselected_bytes: u64,
    /// Bytes in another mode than 3 or faster than 2.5 MHz.
    pub wrong_clock: u64,
    /// Shortest time from one frame's start to the next with the same gyro, cycles.
    pub shortest_period: Option<u64>,
    /// Shortest time from one frame's end to the next with the same gyro, cycles.
    pub shortest_stall: Option<u64>,
}

/// The image on the stand.
pub struct Simulated<P = NoProbe> {
    mcu: Mcu,
    world: World<P>,
    cable: Cable,
    requests: VecDeque<(u64, Request)>,
    /// Cycles at which the motor's stop is pressed and let go.
    presses: VecDeque<(u64, bool)>,
}

impl<P: Probe> Simulated<P> {
    /// Power comes on.
    ///
    /// # Errors
    /// [`LoadError`] for what is no image of an ATmega16.
    pub fn new(image: &[u8], scenario: &Scenario, probe: P) -> Result<Self, LoadError> {
        let hz = CLOCK_HZ * (1.0 + scenario.crystal_ppm * 1e-6);
        Ok(Simulated {
            mcu: Mcu::new(image)?,
            world: World::new(scenario, hz, probe),
            cable: Cable::new(scenario),
            requests: VecDeque::new(),
            presses: (scenario.stop_pressed.iter())
                .flat_map(|&[from, to]| [(from, true), (to, false)])
                .map(|(t, pressed)| ((t * hz) as u64, pressed))
                .collect(),
        })
    }

    /// Presses the motor's stop now, or lets it go: its contact ties PD2 to ground, or leaves it to the pull-up.
    pub fn press_stop(&mut self, pressed: bool) {
        let at = self.mcu.cycle();
        self.world.probe.event(at, Event::Stop { pressed });
        if pressed {
            self.mcu.drive(Port::D, STOP, 0);
        } else {
            self.mcu.release(Port::D, STOP);
        }
    }

    /// The chip.
    #[must_use]
    pub fn mcu(&self) -> &Mcu {
        &self.mcu
    }

    /// The chip, to meddle with: reset it, cut its power, send it bytes.
    pub fn mcu_mut(&mut self) -> &mut Mcu {
        &mut self.mcu
    }

    /// The stand, for looking only.
    #[must_use]
    pub fn stand(&self) -> &Stand {
        &self.world.stand
    }

    /// The stand, to meddle with.
    pub fn stand_mut(&mut self) -> &mut Stand {
        &mut self.world.stand
    }

    /// The probe.
    #[must_use]
    pub fn probe(&self) -> &P {
        &self.world.probe
    }

    /// The probe.
    pub fn probe_mut(&mut self) -> &mut P {
        &mut self.world.probe
    }

    /// What the board's SPI has been like so far.
    #[must_use]
    pub fn discipline(&self) -> Discipline {
        self.world.discipline
    }

    /// The motor's command at the pins, -1..=1.
    #[must_use]
    pub fn duty(&self) -> f64 {
        self.world.duty
    }

    /// Seconds since power came on.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        self.world.seconds(self.mcu.cycle())
    }

    /// Cycles for each second of the stand.
    #[must_use]
    pub fn hz(&self) -> f64 {
        self.world.hz
    }

    /// The host will send requests at their times, which must not lie behind those given before.
    pub fn request(&mut self, requests: &[TimedRequest]) {
        for timed in requests {
            let at = (timed.at_us as f64 * 1e-6 * self.world.hz) as u64;
            self.requests.push_back((at, timed.request));
        }
    }

    /// The host sends bytes now.
    pub fn send(&mut self, bytes: &[u8]) {
        let now = self.mcu.cycle();
        bytes.iter().for_each(|&byte| self.send_at(now, byte));
    }

    fn send_at(&mut self, at: u64, byte: u8) {
        let (start, bit) = self.mcu.send_at(at, byte);
        let probe = &mut self.world.probe;
        probe.event(start.round() as u64, Event::Received { byte, bit });
    }

    /// The chip's power goes and comes back at once; the sensors keep theirs.
    pub fn power_cycle(&mut self) {
        self.mcu.power_cycle();
    }

    /// A reset of the chip.
    pub fn reset(&mut self, cause: ResetCause) {
        self.mcu.reset(cause);
    }

    /// Runs until `t` s since power first came on, and hands each byte that the host receives to `receive`, in order.
    /// A callback that breaks stops it there.
    ///
    /// # Errors
    /// [`Died`] when the image stops.
    pub fn run_until(
        &mut self,
        t: f64,
        receive: &mut dyn FnMut(SerialByte) -> ControlFlow<()>,
    ) -> Result<Ending, Died> {
        /// Requests are put on the line in pieces of this many cycles.
        const PIECE: u64 = 800_000;
        let end = (t * self.world.hz) as u64;
        loop {
            while let Some(&(at, pressed)) = self.presses.front()
                && at <= self.mcu.cycle()
            {
                self.presses.pop_front();
                self.press_stop(pressed);
            }
            let press = self.presses.front().map_or(u64::MAX, |&(at, _)| at);
            let until = end.min(self.mcu.cycle() + PIECE).min(press);
            while self.requests.front().is_some_and(|&(at, _)| at <= until) {
                if let Some((at, request)) = self.requests.pop_front() {
                    let mut line = [0; Request::FRAME_LEN];
                    let request = with_nonce(request, self.world.nonce);
                    let len = encode_request(&request, &mut line).unwrap_or(0);
                    line.into_iter()
                        .take(len)
                        .for_each(|byte| self.send_at(at, byte));
                }
            }
            let stop = self.mcu.run_until(until, &mut self.world);
            while let Some((at, byte)) = self.world.sent.pop_front() {
                let time_s = self.world.seconds(at);
                let byte = SerialByte { time_s, byte };
                if self
                    .cable
                    .carry(byte)
                    .is_some_and(|byte| receive(byte).is_break())
                {
                    return Ok(Ending::Stopped);
                }
            }
            if stop != Stop::Reached {
                let (at, program_counter) = (self.mcu.cycle(), self.mcu.program_counter());
                return Err(Died {
                    at,
                    program_counter,
                    stop,
                });
            }
            if self.mcu.cycle() >= end {
                return Ok(Ending::Complete);
            }
        }
    }
}

/// Runs the image on the stand of `run` and hands each received byte to `receive`, in order. A callback that breaks ends
/// the run.
///
/// # Errors
/// [`SimavrError`] for an image that cannot be loaded, and for one that stops.
pub fn simavr(
    image: &[u8],
    run: &Run,
    mut receive: impl FnMut(SerialByte) -> ControlFlow<()>,
) -> Result<Ending, SimavrError> {
    let mut simulated = Simulated::new(image, &run.scenario, NoProbe)?;
    simulated.request(&run.requests);
    Ok(simulated.run_until(run.seconds, &mut receive)?)
}

/// As [`simavr`], with somebody at the other end of the line: each simulated millisecond `listen` is told the time, s
/// since power came on, and returns the bytes that the host begins to send then. It may wait, so that the run keeps pace
/// with a clock on the wall.
///
/// # Errors
/// As [`simavr`].
pub fn simavr_live(
    image: &[u8],
    run: &Run,
    mut listen: impl FnMut(f64) -> Vec<u8>,
    mut receive: impl FnMut(SerialByte) -> ControlFlow<()>,
) -> Result<Ending, SimavrError> {
    let mut simulated = Simulated::new(image, &run.scenario, NoProbe)?;
    simulated.request(&run.requests);
    let mut millisecond = 0u64;
    while (millisecond as f64) * 1e-3 < run.seconds {
        millisecond += 1;
        let t = (millisecond as f64 * 1e-3).min(run.seconds);
        if simulated.run_until(t, &mut receive)? == Ending::Stopped {
            return Ok(Ending::Stopped);
        }
        let bytes = listen(t);
        simulated.send(&bytes);
    }
    Ok(Ending::Complete)
}

/// As [`simavr`], and the traces of the pins from `from` to `to`, s.
///
/// # Errors
/// As [`simavr`].
pub fn simavr_traced(
    image: &[u8],
    run: &Run,
    [from, to]: [f64; 2],
    mut receive: impl FnMut(SerialByte) -> ControlFlow<()>,
) -> Result<Vcd, SimavrError> {
    let hz = CLOCK_HZ * (1.0 + run.scenario.crystal_ppm * 1e-6);
    let probe = Vcd::new((from * hz) as u64, (to * hz) as u64, hz);
    let mut simulated = Simulated::new(image, &run.scenario, probe)?;
    simulated.request(&run.requests);
    simulated.run_until(run.seconds, &mut receive)?;
    Ok(simulated.probe().clone())
}

/// Notes when the image does what in each tick.
#[derive(Clone, Debug, Default)]
struct Clockwork {
    configure: Option<u64>,
    ticks: Vec<(u64, Instants)>,
}

impl Probe for Clockwork {
    fn event(&mut self, at: u64, event: Event) {
        match (event, self.ticks.last_mut()) {
            (
                Event::Interrupt {
                    vector: TICK_VECTOR,
                },
                _,
            ) => {
                self.ticks.push((at, Instants::default()));
            }
            (Event::Spi { cycles, .. }, None) => {
                self.configure.get_or_insert(at - cycles);
            }
            (Event::Spi { .. }, Some((tick, instants))) => instants.spi_bytes.push(at - *tick),
            (Event::Adc { channel }, Some((tick, instants))) => {
                // A reset within the tick would convert once more.
                if let Some(place) = instants.adc.get_mut(usize::from(channel))
                    && *place == 0
                {
                    *place = at - *tick;
                }
            }
            _ => {}
        }
    }
}

/// As [`simavr`], and what the run says of the image's times: a [`Timeline`] with the sampling instants of every tick, so
/// that the firmware's logic on the host can ask the world at the same cycles.
///
/// # Errors
/// As [`simavr`].
pub fn simavr_timed(
    image: &[u8],
    run: &Run,
    mut receive: impl FnMut(SerialByte) -> ControlFlow<()>,
) -> Result<Timeline, SimavrError> {
    let mut simulated = Simulated::new(image, &run.scenario, Clockwork::default())?;
    simulated.request(&run.requests);
    simulated.run_until(run.seconds, &mut receive)?;
    let probe = simulated.probe();
    let mut timeline = Timeline::default();
    if let (Some(configure), [(first, instants), (second, _), ..]) =
        (probe.configure, probe.ticks.as_slice())
    {
        timeline.configure = configure;
        timeline.start = first - (second - first);
        timeline.spi_bytes.clone_from(&instants.spi_bytes);
        timeline.adc = instants.adc;
        // A period without a sample has the interrupt, and is no tick of the host's.
        let sampled = probe.ticks.iter().map(|(_, each)| each);
        timeline.recorded = sampled
            .filter(|each| !each.spi_bytes.is_empty())
            .cloned()
            .collect();
    }
    Ok(timeline)
}
