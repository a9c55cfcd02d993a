//! The firmware's logic on the host, with this stand as its hardware: some thousand times faster than real time.
//!
//! The logic is the image's own ([`firmware::Stand`], [`firmware::acquire`]); what the chip adds - when each SPI byte
//! ends, when the converter samples, when the main loop gets round to a millisecond - is a [`Timeline`]. A tick that
//! comes before the last one's work is done (overrun) does not happen here: that is for the image to show.

mod board;

use std::cell::RefCell;
use std::collections::VecDeque;
use std::ops::ControlFlow;
use std::rc::Rc;

use adis16250::Adis16250;
use wire::{Request, encode_request};

use self::board::{Chip, GyroSpi, HostBoard, HostSensors, Shared};
use crate::run::{Cable, with_nonce};
use crate::{Ending, Run, SerialByte};

pub(crate) const CLOCK_HZ: f64 = 16e6;
const CYCLES_PER_TICK: u64 = 64;
const CYCLES_PER_MS: u64 = 16_000;
const EEPROM_LEN: usize = 512;
const WATCHDOG_CYCLES: u64 = 16_300 * 16;
/// A byte of 8N1 has ten bits of 16 (divisor + 1) cycles.
const fn byte_cycles(divisor: u16) -> u64 {
    160 * (divisor as u64 + 1)
}

/// When the parts are asked in a tick, in cycles after it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Instants {
    /// Ends of the SPI bytes.
    pub spi_bytes: Vec<u64>,
    /// Sampling instants of the three conversions.
    pub adc: [u64; 3],
}

/// When the chip does what, in cycles of 16 MHz. The defaults were measured in the image of this version with nobody on
/// the line; `simavr::simavr_timed` measures them in any run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Timeline {
    /// Power-on (or reset) to the start of timer 1.
    pub start: u64,
    /// Power-on to the first frame of the set-up.
    pub configure: u64,
    /// Ends of the SPI bytes of an acquisition, after the tick.
    pub spi_bytes: Vec<u64>,
    /// Sampling instants of the three conversions, after the tick.
    pub adc: [u64; 3],
    /// The interrupt of the tick gives the processor back, after the tick.
    pub acquired: u64,
    /// The sample is framed and queued, after the tick.
    pub framed: u64,
    /// The guard takes the processor, before the tick.
    pub guard: u64,
    /// Writing a byte of EEPROM.
    pub eeprom: u64,
    /// Bytes that the transmit queue holds.
    pub queue: usize,
    /// What the health frame says of the stack, bytes: the host's is not the board's, and more than its SRAM says so.
    pub stack_free: u16,
    /// The instants of each tick since the start, where the image's own are known: serial interrupts move those behind
    /// the first round by some cycles. Ticks behind the last have those of `spi_bytes` and `adc`.
    pub recorded: Vec<Instants>,
}

impl Default for Timeline {
    fn default() -> Self {
        Timeline {
            start: 3_629_568,
            configure: 3_543_347,
            // Four rounds of three frames.
            spi_bytes: vec![
                150, 238, 397, 485, 644, 732, 1154, 1242, 1401, 1489, 1648, 1736, 3504, 3592, 3751,
                3839, 3998, 4086, 4467, 4555, 4714, 4802, 4961, 5049,
            ],
            adc: [1_894, 3_686, 5_478],
            acquired: 7_100,
            framed: 16_100,
            guard: 1_024,
            eeprom: 136_000,
            queue: 191,
            stack_free: u16::MAX,
            recorded: Vec::new(),
        }
    }
}

/// What the board's receiver gets: requests that were planned, and bytes that somebody sends while the run lasts.
struct Incoming<'a> {
    /// Requests with the cycle at which each is to begin.
    planned: VecDeque<(u64, Request)>,
    /// Bytes with the cycle at which each has arrived.
    queue: VecDeque<(u64, u8)>,
    /// The host's line is busy until then.
    free: u64,
    listen: &'a mut dyn FnMut(f64) -> Vec<u8>,
}

impl Incoming<'_> {
    /// Before the receiver is on, until a cycle and a time, s, bytes are lost.
    fn lose(&mut self, deaf_until: u64, deaf_until_s: f64) {
        drop((self.listen)(deaf_until_s));
        loop {
            self.begin(deaf_until, 0);
            match self.queue.front() {
                Some(&(at, _)) if at < deaf_until => self.queue.pop_front(),
                _ => break,
            };
        }
    }

    /// Puts the next planned request on the line if it begins by `until` and the one before it has been received: what it
    /// says may hang on an answer.
    fn begin(&mut self, until: u64, nonce: u16) {
        if !self.queue.is_empty() || self.planned.front().is_none_or(|&(at, _)| at > until) {
            return;
        }
        let Some((at, request)) = self.planned.pop_front() else {
            return;
        };
        let mut line = [0; Request::FRAME_LEN];
        let len = encode_request(&with_nonce(request, nonce), &mut line).unwrap_or(0);
        self.free = self.free.max(at);
        for &byte in &line[..len] {
            self.free += byte_cycles(25);
            // The receiver has it in the middle of the stop bit: after the tenth of its sixteenths.
            self.queue
                .push_back((self.free - byte_cycles(25) * 6 / 160, byte));
        }
    }
}

/// Runs the firmware's logic on the stand of `run` and hands each received byte to `receive`, in order. A callback that
/// breaks ends the run.
pub fn native(
    run: &Run,
    timeline: &Timeline,
    receive: impl FnMut(SerialByte) -> ControlFlow<()>,
) -> Ending {
    native_live(run, timeline, |_| Vec::new(), receive)
}

/// As [`native`], with somebody at the other end of the line: each simulated millisecond `listen` is told the time, s
/// since power came on, and returns the bytes that have arrived at the board by then. It may wait, so that the run
/// keeps pace with a clock on the wall; what was sent in between is handed out after each sample.
pub fn native_live(
    run: &Run,
    timeline: &Timeline,
    mut listen: impl FnMut(f64) -> Vec<u8>,
    mut receive: impl FnMut(SerialByte) -> ControlFlow<()>,
) -> Ending {
    let hz = CLOCK_HZ * (1.0 + run.scenario.crystal_ppm * 1e-6);
    let end = (run.seconds * hz) as u64;
    let chip = Rc::new(RefCell::new(Chip::new(run, timeline, hz)));
    let mut cable = Cable::new(&run.scenario);
    let mut received = Incoming {
        planned: (run.requests.iter())
            .map(|timed| ((timed.at_us as f64 * 1e-6 * hz) as u64, timed.request))
            .collect(),
        queue: VecDeque::new(),
        free: 0,
        listen: &mut listen,
    };
    let mut deliver = |chip: &Shared, until: u64| {
        let chip = &mut *chip.borrow_mut();
        while chip.sent.front().is_some_and(|&(at, _)| at <= until) {
            let Some((at, byte)) = chip.sent.pop_front() else {
                break;
            };
            let byte = SerialByte {
                time_s: at as f64 / hz,
                byte,
            };
            if cable
                .carry(byte)
                .is_some_and(|byte| receive(byte).is_break())
            {
                return ControlFlow::Break(());
            }
        }
        ControlFlow::Continue(())
    };
    loop {
        if life(&chip, &mut received, end, &mut deliver).is_break() {
            return Ending::Stopped;
        }
        let mut board = chip.borrow_mut();
        if !board.reboot {
            return Ending::Complete;
        }
        board.restart();
    }
}

/// From a start to a reset or the end.
fn life(
    chip: &Shared,
    received: &mut Incoming<'_>,
    end: u64,
    deliver: &mut impl FnMut(&Shared, u64) -> ControlFlow<()>,
) -> ControlFlow<()> {
    let timeline = chip.borrow().timeline.clone();
    let power = chip.borrow().now;
    let start = power + timeline.start;
    let mut sensors = sensors(chip);
    let board = &mut HostBoard(Rc::clone(chip));
    chip.borrow_mut().now = power + timeline.configure;
    let mut stand = firmware::Stand::new();
    stand.boot(board);
    let misconfigured = firmware::configure_all(&mut sensors, stand.sens_avg());
    stand.started(board, misconfigured);
    let configured = chip.borrow().seconds(power + timeline.configure);
    received.lose(power + timeline.configure, configured);
    chip.borrow_mut().now = start;
    let mut period = chip.borrow().period;
    let mut tick = start;
    let mut raw = firmware::Raw::new();
    let mut millisecond = start + CYCLES_PER_MS;
    loop {
        tick += u64::from(period) * CYCLES_PER_TICK;
        if tick + timeline.framed > end {
            return deliver(chip, end);
        }
        // What is due before the guard closes is done when it is due; the rest waits until the sample is framed.
        let quiet = tick.saturating_sub(timeline.guard);
        work(chip, &mut stand, received, &mut millisecond, quiet, None);
        if chip.borrow().reboot {
            let now = chip.borrow().now;
            return deliver(chip, now);
        }
        sample(chip, &mut sensors, &mut raw, tick);
        raw.t_ticks = raw.t_ticks.wrapping_add(period);
        period = chip.borrow().period;
        // A job may have taken the processor for longer.
        let framed = {
            let chip = &mut *chip.borrow_mut();
            chip.now = chip.now.max(tick + timeline.acquired) + timeline.framed - timeline.acquired;
            chip.now
        };
        stand.on_sample(board, &raw, 0);
        stand.correct(board, &raw);
        let late = Some(framed);
        work(chip, &mut stand, received, &mut millisecond, framed, late);
        let now = chip.borrow().now;
        deliver(chip, now)?;
    }
}

/// The sensors on the buses of a chip.
fn sensors(chip: &Shared) -> HostSensors {
    let gyros = [0, 1, 2].map(|axis| {
        Adis16250::new(GyroSpi {
            chip: Rc::clone(chip),
            axis,
        })
    });
    HostSensors {
        chip: Rc::clone(chip),
        gyros,
    }
}

/// The work of a tick with the sensors: the readings, then what a command asked of them.
fn sample(chip: &Shared, sensors: &mut HostSensors, raw: &mut firmware::Raw, tick: u64) {
    {
        let chip = &mut *chip.borrow_mut();
        (chip.now, chip.tick, chip.last_tick) = (tick, Some((tick, 0)), tick);
    }
    firmware::acquire(sensors, raw);
    let job = {
        let chip = &mut *chip.borrow_mut();
        chip.tick = None;
        chip.ticks += 1;
        chip.job.take()
    };
    firmware::acquire::work(sensors, &job.unwrap_or_default(), &mut raw.done);
}

/// What is due until `until`: received bytes and milliseconds. With `late`, all of it at that cycle, bytes first, as
/// the main loop does it.
fn work(
    chip: &Shared,
    stand: &mut firmware::Stand,
    received: &mut Incoming<'_>,
    millisecond: &mut u64,
    until: u64,
    late: Option<u64>,
) {
    let board = &mut HostBoard(Rc::clone(chip));
    loop {
        received.begin(until, chip.borrow().nonce);
        let byte = (received.queue.front().copied()).filter(|&(at, _)| at <= until);
        // Where there is no room for a reply the bytes wait for the next millisecond, and so on.
        let byte = byte.filter(|&(at, _)| {
            let now = chip.borrow().now;
            chip.borrow_mut().now = late.unwrap_or(at).max(now);
            let listens = stand.listens(board);
            chip.borrow_mut().now = now;
            listens
        });
        let byte_first = byte.is_some_and(|(at, _)| late.is_some() || at <= *millisecond);
        if let Some((at, byte)) = byte.filter(|_| byte_first) {
            received.queue.pop_front();
            let now = chip.borrow().now;
            chip.borrow_mut().now = late.unwrap_or(at).max(now);
            stand.on_byte(board, byte);
        } else if *millisecond <= until {
            let t = chip.borrow().seconds(*millisecond);
            let bytes = (received.listen)(t);
            (received.queue).extend(bytes.into_iter().map(|byte| (*millisecond, byte)));
            chip.borrow_mut().millisecond(*millisecond);
            chip.borrow_mut().now = late.unwrap_or(*millisecond);
            *millisecond += CYCLES_PER_MS;
            stand.on_millisecond(board);
        } else {
            return;
        }
        let chip = &mut *chip.borrow_mut();
        if chip.reboot {
            return;
        }
        if chip.next_divisor.is_some() && chip.line_free <= chip.now {
            chip.divisor = chip.next_divisor.take();
        }
    }
}
