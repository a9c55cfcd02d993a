//! The board's parts on the host: its chip, and what the firmware sees of it.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::convert::Infallible;
use std::rc::Rc;

use adis16250::Adis16250;
use embedded_hal::delay::DelayNs;
use embedded_hal::spi::{ErrorType, Operation, SpiDevice};
use firmware::{Board, Job, Sensors};
use wire::{Frame, code, reset_cause};

use super::{CYCLES_PER_TICK, EEPROM_LEN, Timeline, WATCHDOG_CYCLES, byte_cycles};
use crate::{AccSelect, Run, Stand};

/// What the parts of the board share.
pub(super) struct Chip {
    pub stand: Stand,
    pub timeline: Timeline,
    /// Cycles since power came on.
    pub now: u64,
    pub hz: f64,
    /// The tick whose acquisition runs, and how many SPI bytes it has sent.
    pub tick: Option<(u64, usize)>,
    /// The conversion that runs: its axis, and when its input is held.
    pub holding: Option<(usize, u64)>,
    pub conversion: Option<u16>,
    pub job: Option<Job>,
    pub eeprom: [u8; EEPROM_LEN],
    pub eeprom_until: u64,
    pub divisor: Option<u16>,
    pub next_divisor: Option<u16>,
    /// Milliseconds that the motor may still turn without a word from the host.
    pub alive: u8,
    /// When the motor's stop is pressed, s; how many of these have begun by the last look.
    presses: Vec<[f64; 2]>,
    begun: usize,
    /// It was pressed since a nonce was told last.
    stopped: bool,
    /// The nonce that the board told last.
    pub nonce: u16,
    pub period: u32,
    /// Ends of the bytes that are queued or on their way.
    pub line: VecDeque<u64>,
    pub line_free: u64,
    pub sent: VecDeque<(u64, u8)>,
    pub reboot: bool,
    pub cause: u8,
    pub restarts: u16,
    pub kept: [u16; 2],
    pub last_tick: u64,
    /// Ticks since power came on, this one not counted.
    pub ticks: usize,
}

impl Chip {
    /// Of a board whose power comes on.
    pub fn new(run: &Run, timeline: &Timeline, hz: f64) -> Self {
        Self {
            stand: Stand::new(&run.scenario),
            timeline: timeline.clone(),
            now: 0,
            hz,
            tick: None,
            holding: None,
            conversion: None,
            job: None,
            eeprom: [0xff; EEPROM_LEN],
            eeprom_until: 0,
            divisor: None,
            next_divisor: None,
            alive: 0,
            presses: run.scenario.stop_pressed.clone(),
            begun: 0,
            stopped: false,
            nonce: 0,
            period: 12_500,
            line: VecDeque::new(),
            line_free: 0,
            sent: VecDeque::new(),
            reboot: false,
            cause: reset_cause::POWER_ON,
            restarts: 0,
            kept: [0; 2],
            last_tick: 0,
            ticks: 0,
        }
    }

    /// The watchdog's reset.
    pub fn restart(&mut self) {
        self.reboot = false;
        self.now += WATCHDOG_CYCLES;
        (self.job, self.divisor, self.next_divisor, self.period) = (None, None, None, 12_500);
        (self.alive, self.stopped) = (0, false);
        self.cause = reset_cause::WATCHDOG;
        self.restarts = self.restarts.saturating_add(1);
        // What had not left the transmitter is lost with the reset.
        let now = self.now - WATCHDOG_CYCLES;
        self.sent.retain(|&(at, _)| at <= now);
        self.line.clear();
        self.line_free = self.now;
        let t = self.seconds(self.now);
        self.stand.set_motor(0.0, t);
    }

    pub fn seconds(&self, cycle: u64) -> f64 {
        cycle as f64 / self.hz
    }

    /// When the next SPI byte ends.
    pub fn spi_time(&mut self) -> u64 {
        let recorded = self.timeline.recorded.get(self.ticks);
        let ends = recorded.map_or(&self.timeline.spi_bytes, |instants| &instants.spi_bytes);
        match &mut self.tick {
            Some((tick, sent)) if *sent < ends.len() => {
                self.now = *tick + ends[*sent];
                *sent += 1;
            }
            _ => self.now += 95,
        }
        self.now
    }

    /// When the converter holds an input.
    pub fn adc_time(&self, axis: usize) -> u64 {
        let recorded = self.timeline.recorded.get(self.ticks);
        let after = recorded.map_or(&self.timeline.adc, |instants| &instants.adc)[axis];
        let at = self.tick.map_or(self.now, |(tick, _)| tick + after);
        at.max(self.now)
    }

    /// Holds the converter's input, if that is due by `until`: the world must not be asked ahead of its time.
    pub fn hold(&mut self, until: u64) {
        if let Some((axis, at)) = self.holding.filter(|&(_, at)| at <= until) {
            self.holding = None;
            let t = self.seconds(at);
            self.conversion = Some(self.stand.acc_counts(axis, t));
        }
    }

    /// Bytes that the transmit queue still takes.
    pub fn room(&mut self) -> usize {
        let now = self.now;
        let byte = byte_cycles(self.divisor.unwrap_or(25));
        // A byte leaves the queue for the transmitter's buffer when the one before it begins to shift.
        while self.line.front().is_some_and(|&end| end < now + 2 * byte) {
            self.line.pop_front();
        }
        self.timeline.queue.saturating_sub(self.line.len())
    }

    /// Looks at the motor's stop, where an edge has its interrupt, too; whether it has been pressed.
    fn is_stopped(&mut self) -> bool {
        let t = self.seconds(self.now);
        let begun = self.presses.iter().filter(|[from, _]| *from <= t).count();
        let held = begun > 0 && self.presses.get(begun - 1).is_some_and(|[_, to]| t < *to);
        if held || begun > self.begun {
            self.stopped = true;
            self.stand.set_motor(0.0, t);
        }
        self.begun = begun;
        self.stopped
    }

    /// The interrupt of the millisecond at a cycle: it cuts the motor, whatever the main loop is busy with.
    pub fn millisecond(&mut self, at: u64) {
        self.alive = match self.alive {
            0 => return,
            left => left - 1,
        };
        if self.alive == 0 {
            let t = self.seconds(at);
            self.stand.set_motor(0.0, t);
        }
    }

    pub fn byte(&mut self, mosi: u8) -> u8 {
        let t = self.spi_time();
        self.hold(t);
        let t = self.seconds(t);
        self.stand.spi_byte(mosi, t)
    }
}

pub(super) type Shared = Rc<RefCell<Chip>>;

pub(super) struct GyroSpi {
    pub chip: Shared,
    pub axis: usize,
}

impl ErrorType for GyroSpi {
    type Error = Infallible;
}

impl SpiDevice for GyroSpi {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Infallible> {
        let mut chip = self.chip.borrow_mut();
        let t = chip.seconds(chip.now);
        chip.stand.select(self.axis, true, t);
        for operation in operations {
            match operation {
                Operation::Read(into) => into.iter_mut().for_each(|place| *place = chip.byte(0)),
                Operation::Write(from) => from.iter().for_each(|&out| {
                    chip.byte(out);
                }),
                Operation::Transfer(into, from) => {
                    for (place, &out) in into.iter_mut().zip(from.iter()) {
                        *place = chip.byte(out);
                    }
                }
                Operation::TransferInPlace(both) => {
                    both.iter_mut().for_each(|place| *place = chip.byte(*place));
                }
                Operation::DelayNs(ns) => chip.now += u64::from(*ns) * 16 / 1000,
            }
        }
        let t = chip.seconds(chip.now);
        chip.stand.select(self.axis, false, t);
        Ok(())
    }
}

pub(super) struct Delay(Shared);

impl DelayNs for Delay {
    fn delay_ns(&mut self, ns: u32) {
        self.0.borrow_mut().now += u64::from(ns) * 16 / 1000;
    }
}

pub(super) struct HostSensors {
    pub chip: Shared,
    pub gyros: [Adis16250<GyroSpi>; 3],
}

impl Sensors for HostSensors {
    type Spi = GyroSpi;
    type Delay = Delay;

    fn gyro(&mut self, axis: u8) -> Option<&mut Adis16250<GyroSpi>> {
        self.gyros.get_mut(usize::from(axis))
    }

    fn delay(&mut self) -> Delay {
        Delay(Rc::clone(&self.chip))
    }

    fn adc_start(&mut self, channel: u8) {
        let chip = &mut *self.chip.borrow_mut();
        let axis = usize::from(channel.min(2));
        let at = chip.adc_time(axis);
        chip.holding = Some((axis, at));
    }

    fn adc_finish(&mut self) -> Option<u16> {
        let chip = &mut *self.chip.borrow_mut();
        chip.hold(u64::MAX);
        chip.conversion.take()
    }
}

pub(super) struct HostBoard(pub Shared);

impl Board for HostBoard {
    fn send(&mut self, kind: u8, fields: &[u8]) -> bool {
        let mut frame = [0; wire::MAX_FRAME];
        let len = wire::fields::encode(kind, fields, &mut frame);
        let frame = &frame[..len];
        let chip = &mut *self.0.borrow_mut();
        // A line that is to change its speed has to fall idle first.
        let waits = chip.next_divisor.is_some() && kind != wire::kind::REPLY;
        if waits || chip.room() < wire::fields::room_for(kind, fields.len()) {
            return false;
        }
        let mut decoder = wire::Decoder::new();
        if let Some(Ok(Frame::Reply(reply))) = frame.iter().find_map(|&byte| decoder.push(byte))
            && reply.command == code::ARM
        {
            chip.nonce = reply.value as u16;
        }
        let (now, byte) = (chip.now, byte_cycles(chip.divisor.unwrap_or(25)));
        for &out in frame {
            chip.line_free = chip.line_free.max(now) + byte;
            chip.line.push_back(chip.line_free);
            chip.sent.push_back((chip.line_free, out));
        }
        true
    }

    fn room(&self) -> u8 {
        self.0.borrow_mut().room().try_into().unwrap_or(u8::MAX)
    }

    fn keep_alive(&mut self) {
        // A millisecond is under way: one more makes it whole.
        self.0.borrow_mut().alive = firmware::motor::KEEP_ALIVE_MS + 1;
    }

    fn host_is_there(&self) -> bool {
        let chip = &mut *self.0.borrow_mut();
        !chip.is_stopped() && chip.alive != 0
    }

    fn is_stopped(&self) -> bool {
        self.0.borrow_mut().is_stopped()
    }

    fn forget_stop(&mut self) {
        let chip = &mut *self.0.borrow_mut();
        // What was pressed and let go while nobody looked is seen by the chip's interrupt, and forgotten as well.
        chip.is_stopped();
        if std::mem::take(&mut chip.stopped) {
            chip.alive = 0;
        }
    }

    fn set_motor(&mut self, duty: i16) {
        let chip = &mut *self.0.borrow_mut();
        if duty != 0 && (chip.is_stopped() || chip.alive == 0) {
            return;
        }
        let t = chip.seconds(chip.now);
        // Fast PWM is high for OCR2 + 1 of 256 counts; at 0 the output is disconnected.
        let magnitude = if duty == 0 {
            0.0
        } else {
            (f64::from(duty.abs()) + 1.0) / 256.0
        };
        chip.stand.set_motor(magnitude.copysign(f64::from(duty)), t);
    }

    fn set_period(&mut self, ticks: u16, every: u8) {
        self.0.borrow_mut().period = u32::from(ticks) * u32::from(every);
    }

    fn set_baud(&mut self, divisor: u16) {
        let chip = &mut *self.0.borrow_mut();
        if chip.divisor.is_none() {
            chip.divisor = Some(divisor);
        } else {
            chip.next_divisor = Some(divisor);
        }
    }

    fn set_acc_range(&mut self, range: u8) {
        let chip = &mut *self.0.borrow_mut();
        let t = chip.seconds(chip.now);
        let select = AccSelect {
            select1: range & 1 != 0,
            select2: range & 2 != 0,
            awake: true,
        };
        chip.stand.set_acc_pins(select, t);
    }

    fn post(&mut self, job: Job) -> bool {
        let chip = &mut *self.0.borrow_mut();
        let free = chip.job.is_none();
        if free {
            chip.job = Some(job);
        }
        free
    }

    fn eeprom_read(&mut self, address: u16) -> u8 {
        self.0.borrow().eeprom[usize::from(address) % EEPROM_LEN]
    }

    fn eeprom_is_ready(&mut self) -> bool {
        let chip = self.0.borrow();
        chip.now >= chip.eeprom_until
    }

    fn eeprom_write(&mut self, address: u16, byte: u8) {
        let chip = &mut *self.0.borrow_mut();
        chip.eeprom[usize::from(address) % EEPROM_LEN] = byte;
        chip.eeprom_until = chip.now + chip.timeline.eeprom;
    }

    fn reboot(&mut self) {
        let chip = &mut *self.0.borrow_mut();
        // The image waits until the transmitter is empty.
        chip.now = chip.now.max(chip.line_free);
        chip.reboot = true;
    }

    fn reset_cause(&self) -> u8 {
        self.0.borrow().cause
    }

    fn restarts(&self) -> u16 {
        self.0.borrow().restarts
    }

    fn kept(&self) -> [u16; 2] {
        self.0.borrow().kept
    }

    fn keep(&mut self, counts: [u16; 2]) {
        self.0.borrow_mut().kept = counts;
    }

    fn stack_free(&self) -> u16 {
        self.0.borrow().timeline.stack_free
    }

    fn ticks_since(&self) -> u16 {
        let chip = self.0.borrow();
        ((chip.now - chip.last_tick) / CYCLES_PER_TICK) as u16
    }
}
