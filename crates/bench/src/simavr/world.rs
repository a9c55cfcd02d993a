//! The stand at the chip's pins.

use std::collections::VecDeque;

use atmega16_sim::{Board, Pins, Port, Pwm};
use wire::{Decoder, Frame, code};

use super::{Answer, Discipline, Event, Probe};
use crate::{AccSelect, Scenario, Stand};

const SELECTS: [u8; 3] = [2, 3, 4];
const DIRECTION: u8 = 6;
/// CPOL = CPHA = 1.
const SPI_MODE: u8 = 3;
/// Cycles of a bit at the part's fastest clock, 2.5 MHz, rounded up.
const SPI_MIN_CYCLES: u8 = 7;

/// The stand at the chip's pins.
pub(super) struct World<P> {
    pub stand: Stand,
    pub probe: P,
    pub hz: f64,
    pub selected: [bool; 3],
    /// Bytes since a select went low.
    pub bytes: [u32; 3],
    /// The last whole frame from the board, and the one that is being sent.
    pub asked: [u16; 3],
    pub asking: [u16; 3],
    pub frame_start: [Option<u64>; 3],
    pub frame_end: [Option<u64>; 3],
    pub discipline: Discipline,
    pub acc_range: Option<u8>,
    pub pwm: Pwm,
    pub reverse: bool,
    pub duty: f64,
    pub sent: VecDeque<(u64, u8)>,
    /// Listens for the nonce that the board told last.
    pub decoder: Decoder,
    pub nonce: u16,
}

impl<P: Probe> World<P> {
    pub fn new(scenario: &Scenario, hz: f64, probe: P) -> Self {
        World {
            stand: Stand::new(scenario),
            probe,
            hz,
            selected: [false; 3],
            bytes: [0; 3],
            asked: [0; 3],
            asking: [0; 3],
            frame_start: [None; 3],
            frame_end: [None; 3],
            discipline: Discipline::default(),
            acc_range: None,
            pwm: Pwm::default(),
            reverse: false,
            duty: 0.0,
            sent: VecDeque::new(),
            decoder: Decoder::new(),
            nonce: 0,
        }
    }

    pub fn seconds(&self, cycle: u64) -> f64 {
        cycle as f64 / self.hz
    }

    pub fn select(&mut self, at: u64, axis: usize, selected: bool) {
        let t = self.seconds(at);
        self.probe.event(at, Event::Select { axis, selected });
        let shortest = |so_far: &mut Option<u64>, since: Option<u64>| {
            if let Some(since) = since {
                let time = at - since;
                *so_far = Some(so_far.map_or(time, |least| least.min(time)));
            }
        };
        self.selected[axis] = selected;
        if selected {
            shortest(&mut self.discipline.shortest_period, self.frame_start[axis]);
            shortest(&mut self.discipline.shortest_stall, self.frame_end[axis]);
            self.frame_start[axis] = Some(at);
            self.bytes[axis] = 0;
        } else {
            self.frame_end[axis] = Some(at);
            if self.bytes[axis] == 2 {
                self.discipline.frames += 1;
                self.asked[axis] = self.asking[axis];
            } else {
                self.discipline.broken_frames += 1;
            }
        }
        // A wire that has come off is pulled up at the gyro.
        let arrives = selected && self.probe.select_arrives(t, axis);
        self.stand.select(axis, arrives, t);
    }

    pub fn turn(&mut self, at: u64) {
        let duty = if self.reverse {
            -self.pwm.high
        } else {
            self.pwm.high
        };
        // Where the pulse has no width the direction means nothing.
        if duty != self.duty {
            self.duty = duty;
            let t = self.seconds(at);
            self.stand.set_motor(duty, t);
            self.probe.event(at, Event::Motor { duty });
        }
    }
}

impl<P: Probe> Board for World<P> {
    fn spi_byte(&mut self, at: u64, mosi: u8, pins: &Pins) -> u8 {
        let t = self.seconds(at);
        let cycles = 8 * u64::from(pins.spi_clock);
        if pins.spi_mode != SPI_MODE || pins.spi_clock < SPI_MIN_CYCLES {
            self.discipline.wrong_clock += 1;
        }
        let mut miso = self.stand.spi_byte(mosi, t);
        match self.selected {
            [true, false, false] | [false, true, false] | [false, false, true] => {
                let axis = self
                    .selected
                    .iter()
                    .position(|&selected| selected)
                    .unwrap_or(0);
                let is_high = self.bytes[axis].is_multiple_of(2);
                self.asking[axis] = self.asking[axis] << 8 | u16::from(mosi);
                self.bytes[axis] += 1;
                let asked = self.asked[axis];
                miso = self.probe.miso(
                    t,
                    Answer {
                        axis,
                        asked,
                        is_high,
                        byte: miso,
                    },
                );
            }
            _ => self.discipline.unselected_bytes += 1,
        }
        self.probe.event(at, Event::Spi { mosi, miso, cycles });
        miso
    }

    fn adc_volts(&mut self, at: u64, channel: u8) -> f64 {
        let t = self.seconds(at);
        let volts = match channel {
            0..=2 => self.stand.acc_volts(usize::from(channel), t),
            _ => 0.0,
        };
        self.probe.event(at, Event::Adc { channel });
        self.probe.volts(t, channel, volts)
    }

    fn aref_volts(&self) -> f64 {
        self.stand.aref_volts()
    }

    fn uart_byte(&mut self, at: u64, byte: u8, bit: u64) {
        self.probe.event(at, Event::Uart { byte, bit });
        self.sent.push_back((at, byte));
        if let Some(Ok(Frame::Reply(reply))) = self.decoder.push(byte)
            && reply.command == code::ARM
        {
            self.nonce = reply.value as u16;
        }
    }

    fn pins_changed(&mut self, at: u64, pins: &Pins) {
        for (axis, bit) in SELECTS.into_iter().enumerate() {
            let low = pins.is_low(Port::B, bit);
            if low != self.selected[axis] {
                self.select(at, axis, low);
            }
        }
        // A pin that is let go is pulled up to 3.3 V.
        let range = u8::from(!pins.is_low(Port::C, 1)) << 1 | u8::from(!pins.is_low(Port::C, 0));
        if self.acc_range != Some(range) {
            self.acc_range = Some(range);
            let select = AccSelect {
                select1: range & 1 != 0,
                select2: range & 2 != 0,
                awake: true,
            };
            let t = self.seconds(at);
            self.stand.set_acc_pins(select, t);
        }
        self.reverse = pins.is_high(Port::D, DIRECTION);
        self.turn(at);
    }

    fn motor_changed(&mut self, at: u64, motor: &Pwm) {
        self.pwm = *motor;
        let (high, hz) = (motor.high, motor.hz);
        self.probe.event(at, Event::Pulse { high, hz });
        self.turn(at);
    }

    fn interrupt(&mut self, at: u64, vector: u8) {
        self.probe.event(at, Event::Interrupt { vector });
    }
}
