//! The board's work below the tick: scaling, framing, answering, counting.

use fixed::types::I16F16;
use wire::{
    Command, Fault, FaultCounts, Request, RequestDecoder, RequestError, Sample, Shape, Status,
    flags, reset_cause,
};

mod reports;

use crate::acquire::{Job, Raw};
use crate::bias::{BiasNull, MAX_SAMPLES, Outcome};
use crate::config::{Config, MAX_PERIOD, MIN_PERIOD, SLOTS, STORED_LEN};
use crate::motor::Motor;

/// The rest of the board, as the stand sees it.
pub trait Board {
    /// Queues a whole frame for the line; false, and nothing queued, when it does not fit.
    fn send(&mut self, frame: &[u8]) -> bool;
    /// Puts out the motor command, -255..=255.
    fn set_motor(&mut self, duty: i16);
    /// Sets the time from tick to tick.
    fn set_period(&mut self, ticks: u16);
    /// Sets the USART's UBRR once what is queued has gone out.
    fn set_baud(&mut self, divisor: u16);
    /// Sets the accelerometer's g-select pins.
    fn set_acc_range(&mut self, range: u8);
    /// Posts work on the gyros for the slot after the next sample; false when one is waiting.
    fn post(&mut self, job: Job) -> bool;
    /// A byte of EEPROM.
    fn eeprom_read(&mut self, address: u16) -> u8;
    /// Whether the last write has ended.
    fn eeprom_is_ready(&mut self) -> bool;
    /// Starts writing a byte of EEPROM.
    fn eeprom_write(&mut self, address: u16, byte: u8);
    /// Resets the board through its watchdog.
    fn reboot(&mut self);
    /// MCUCSR as the reset left it.
    fn reset_cause(&self) -> u8;
    /// Resets since power-on.
    fn restarts(&self) -> u16;
    /// The least stack that was ever left, bytes.
    fn stack_free(&self) -> u16;
    /// Timer ticks since the last tick of the sample clock.
    fn ticks_since(&self) -> u16;
}

/// Where the set-up comes from, as the hello frame says it.
mod source {
    pub const BUILT_IN: u8 = 0;
    /// The first of the EEPROM's copies; the second is one more.
    pub const STORED: u8 = 1;
    pub const SET: u8 = 3;
}

/// Milliseconds from health frame to health frame.
const HEALTH_MS: u16 = 1_000;
/// SUPPLY_OUT of 4.75 V and 5.25 V at 1.8315 mV a count: the part's operating range (data sheet).
const SUPPLY_COUNTS: core::ops::RangeInclusive<u16> = 2_594..=2_866;
/// Codes at which the accelerometer's output is at the converter's end.
const ADC_MAX: u16 = 1_023;

/// A configuration on its way to EEPROM, a byte at a time.
struct Store {
    number: u16,
    slot: u16,
    bytes: [u8; STORED_LEN],
    at: u8,
}

/// A request whose answer waits for the slot after a sample.
#[derive(Clone, Copy)]
struct Waiting {
    number: u16,
    command: u8,
}

/// The logic below the tick.
pub struct Stand {
    config: Config,
    source: u8,
    generation: u8,
    newest_slot: u8,
    faults: FaultCounts,
    motor: Motor,
    requests: RequestDecoder,
    null: Option<BiasNull>,
    store: Option<Store>,
    waiting: Option<Waiting>,
    /// Bit per axis: not answering at the last sample.
    silent: u8,
    misconfigured: u8,
    next_seq: u16,
    uptime_s: u32,
    millisecond: u16,
    tick_busy_max: u16,
}

impl Stand {
    /// Reads the stored set-up, applies it and says hello. `misconfigured` is what [`crate::configure`] returned.
    #[inline(never)]
    pub fn boot<B: Board>(board: &mut B) -> Self {
        let mut stand = Self {
            config: Config::default(),
            source: source::BUILT_IN,
            generation: 0,
            newest_slot: 1,
            faults: FaultCounts::new(),
            motor: Motor::new(255, crate::motor::DEFAULT_RAMP_PER_S),
            requests: RequestDecoder::new(),
            null: None,
            store: None,
            waiting: None,
            silent: 0,
            misconfigured: 0,
            next_seq: 0,
            uptime_s: 0,
            millisecond: 0,
            tick_busy_max: 0,
        };
        if board.reset_cause() & reset_cause::WATCHDOG != 0 {
            stand.faults.record(Fault::WatchdogReset);
        }
        if board.reset_cause() & reset_cause::BROWN_OUT != 0 {
            stand.faults.record(Fault::BrownOutReset);
        }
        stand.load(board);
        stand.apply(board);
        stand
    }

    /// SENS/AVG that the gyros are to have.
    #[must_use]
    pub fn sens_avg(&self) -> u16 {
        self.config.sens_avg()
    }

    /// What [`crate::configure`] returned at start; says hello.
    pub fn started<B: Board>(&mut self, board: &mut B, misconfigured: u8) {
        self.note_configured(misconfigured);
        self.hello(board);
    }

    /// Counts what has been lost outside: ticks without a sample, received bytes.
    pub fn count(&mut self, fault: Fault, times: u16) {
        self.faults.record_many(fault, times);
        if fault == Fault::TickOverrun {
            self.next_seq = self.next_seq.wrapping_add(times);
        }
    }

    /// A tick's sample: scales, flags, counts and sends it.
    #[inline(never)]
    pub fn on_sample<B: Board>(&mut self, board: &mut B, raw: &Raw, t_ticks: u32, overrun: bool) {
        let mut sample = Sample {
            seq: self.next_seq,
            t_ticks,
            pwm: self.motor.output(),
            ..Sample::default()
        };
        self.next_seq = self.next_seq.wrapping_add(1);
        self.gyros(board, raw, &mut sample);
        self.accelerometer(raw, &mut sample);
        if overrun {
            sample.flags |= flags::TICK_OVERRUN;
        }
        self.bias_null(board, &mut sample);
        let mut frame = [0; Sample::FRAME_LEN];
        let sent = wire::encode_sample(&sample, &mut frame).is_ok() && board.send(&frame);
        if !sent {
            self.faults.record(Fault::FrameDropped);
        }
        if let Some(result) = raw.job {
            self.job_done(board, result);
        }
        self.tick_busy_max = self.tick_busy_max.max(board.ticks_since());
    }

    #[inline(never)]
    fn gyros<B: Board>(&mut self, board: &mut B, raw: &Raw, sample: &mut Sample) {
        let mut silent = 0;
        for axis in 0..3 {
            if !self.gyro(axis, raw, sample) {
                silent |= 1 << axis;
            }
        }
        // A gyro that answers again may have lost its set-up with its power.
        if self.silent & !silent != 0 {
            for axis in 0..3u8 {
                if self.silent & !silent & (1 << axis) != 0 {
                    self.faults.record(Fault::gyro_recovered(axis));
                }
            }
            board.post(Job::Configure {
                sens_avg: self.config.sens_avg(),
            });
        }
        self.silent = silent;
        if self.misconfigured & !silent != 0 {
            sample.flags |= flags::GYRO_MISCONFIGURED;
        }
        // One supply for three gyros: the first that answers says what it is.
        let answering = raw
            .supply
            .iter()
            .zip(0u8..)
            .find(|&(_, axis)| silent & (1 << axis) == 0);
        if let Some((word, _)) = answering {
            sample.supply = word.unsigned_12();
            if !SUPPLY_COUNTS.contains(&sample.supply) {
                sample.flags |= flags::SUPPLY_OUT_OF_RANGE;
                self.faults.record(Fault::SupplyOutOfRange);
            }
        }
    }

    /// One gyro's part of the sample; false when it does not answer.
    #[inline(never)]
    fn gyro(&mut self, axis: u8, raw: &Raw, sample: &mut Sample) -> bool {
        let at = axis as usize;
        let (Some(&word), Some(&temp), Some(&bias), Some(&scale)) = (
            raw.gyro.get(at),
            raw.temp.get(at),
            self.config.bias.get(at),
            self.config.scale.get(at),
        ) else {
            return false;
        };
        let scaled = I16F16::from_bits(word.rate().dps_q16(scale));
        put(&mut sample.gyro, axis, word.signed_14());
        put(&mut sample.temp, axis, temp.signed_12());
        put(
            &mut sample.rate,
            axis,
            scaled.saturating_sub(I16F16::from_bits(bias)).to_bits(),
        );
        let stalled = raw.spi_stalled & (1 << axis) != 0;
        if stalled {
            self.faults.record(Fault::SpiStalled);
        }
        if stalled || word.is_stuck() {
            sample.flags |= flags::GYRO_NOT_ANSWERING;
            self.faults.record(Fault::gyro_not_answering(axis));
            return false;
        }
        if word.is_new() {
            sample.flags |= flags::new_data(axis);
        } else {
            self.faults.record(Fault::gyro_stale(axis));
        }
        if word.has_error() {
            sample.flags |= flags::error(axis);
            self.faults.record(Fault::gyro_error_alarm(axis));
        }
        true
    }

    #[inline(never)]
    fn accelerometer(&mut self, raw: &Raw, sample: &mut Sample) {
        sample.acc = raw.acc;
        for (&count, axis) in raw.acc.iter().zip(0u8..) {
            if raw.adc_stalled & (1 << axis) != 0 {
                sample.flags |= flags::ACC_NOT_CONVERTED;
                self.faults.record(Fault::AdcStalled);
            } else if count == 0 || count >= ADC_MAX {
                sample.flags |= flags::ACC_AT_RAIL;
                self.faults.record(Fault::acc_at_rail(axis));
            }
        }
    }

    #[inline(never)]
    fn bias_null<B: Board>(&mut self, board: &mut B, sample: &mut Sample) {
        let Some(null) = &mut self.null else { return };
        sample.flags |= flags::BIAS_NULL;
        let number = null.number();
        // Only samples in order count; a gyro that is silent or stale would be averaged as if it were at rest.
        let in_order = sample.flags & flags::IN_ORDER == flags::IN_ORDER;
        let outcome = if self.motor.is_on() {
            Outcome::Moving
        } else if in_order {
            null.take(sample.gyro)
        } else {
            Outcome::Running
        };
        let code = Command::BiasNull { samples: 0 }.code();
        match outcome {
            Outcome::Running => {}
            Outcome::Moving => {
                self.null = None;
                self.reply(board, number, code, Status::Moving, 0, [0; 3]);
            }
            Outcome::Done(mean_q8) => {
                self.null = None;
                let scales = self.config.scale;
                for ((bias, &mean), &scale) in
                    self.config.bias.iter_mut().zip(&mean_q8).zip(&scales)
                {
                    // Q8 counts (at most 68 * 256 < 2^15) times Q8.24 deg/s, in two halves, is Q32; >> 16 is Q16.
                    let high = mean.wrapping_mul(scale >> 16);
                    let low = mean.wrapping_mul(scale & 0xffff) >> 16;
                    *bias = high.wrapping_add(low);
                }
                self.source = source::SET;
                let bias = self.config.bias;
                self.reply(board, number, code, Status::Ok, 0, bias);
            }
        }
    }

    #[inline(never)]
    fn job_done<B: Board>(&mut self, board: &mut B, result: Result<u16, Status>) {
        let Some(Waiting { number, command }) = self.waiting.take() else {
            if let Ok(wrong) = result {
                self.note_configured(wrong as u8);
            }
            return;
        };
        let configured = command
            == Command::SetGyro {
                range: 0,
                filter: 0,
            }
            .code();
        let (status, value) = match result {
            Ok(wrong) if configured => {
                self.note_configured(wrong as u8);
                (
                    if wrong == 0 {
                        Status::Ok
                    } else {
                        Status::ReadBackWrong
                    },
                    i32::from(wrong),
                )
            }
            Ok(value) => (Status::Ok, i32::from(value)),
            Err(status) => (status, 0),
        };
        self.reply(board, number, command, status, value, [0; 3]);
    }

    fn note_configured(&mut self, wrong: u8) {
        self.misconfigured = wrong;
        for axis in 0..3u8 {
            if wrong & (1 << axis) != 0 {
                self.faults.record(Fault::gyro_register_mismatch(axis));
            }
        }
    }

    /// A received byte.
    #[inline(never)]
    pub fn on_byte<B: Board>(&mut self, board: &mut B, byte: u8) {
        match self.requests.push(byte) {
            None => {}
            Some(Ok(request)) => self.on_request(board, &request),
            Some(Err(RequestError::Refused {
                number,
                command,
                status,
            })) => {
                self.reply(board, number, command, status, 0, [0; 3]);
            }
            Some(Err(RequestError::Frame(_))) => self.faults.record(Fault::RxBadFrame),
        }
    }

    #[inline(never)]
    fn on_request<B: Board>(&mut self, board: &mut B, request: &Request) {
        let number = request.number;
        let code = request.command.code();
        let mut value = 0;
        let status = match request.command {
            Command::Ping => Status::Ok,
            Command::GetHello => {
                self.hello(board);
                Status::Ok
            }
            Command::KeepAlive => {
                self.motor.keep_alive();
                Status::Ok
            }
            Command::Counters => {
                self.health(board);
                Status::Ok
            }
            Command::ClearCounters => {
                self.health(board);
                self.faults = FaultCounts::new();
                Status::Ok
            }
            Command::Reboot => {
                self.reply(board, number, code, Status::Ok, 0, [0; 3]);
                self.motor.cut();
                board.set_motor(0);
                board.reboot();
                return;
            }
            Command::SetRate { period_ticks }
                if (MIN_PERIOD..=MAX_PERIOD).contains(&period_ticks) =>
            {
                self.config.period_ticks = period_ticks;
                board.set_period(period_ticks);
                self.changed()
            }
            Command::SetBaud { divisor } if divisor < 4096 => {
                self.reply(board, number, code, Status::Ok, 0, [0; 3]);
                self.config.baud_divisor = divisor;
                self.source = source::SET;
                board.set_baud(divisor);
                return;
            }
            Command::SetGyro { range, filter } if Config::gyro_is_valid(range, filter) => {
                let was = (self.config.gyro_range, self.config.gyro_filter);
                (self.config.gyro_range, self.config.gyro_filter) = (range, filter);
                let job = Job::Configure {
                    sens_avg: self.config.sens_avg(),
                };
                if self.post(board, number, code, job) {
                    let shift = match range {
                        4 => 0,
                        2 => 1,
                        _ => 2,
                    };
                    self.config.scale = [crate::config::SCALE_320 >> shift; 3];
                    self.changed();
                    return;
                }
                (self.config.gyro_range, self.config.gyro_filter) = was;
                Status::Busy
            }
            Command::SetAccRange { range } if range <= 3 => {
                self.config.acc_range = range;
                board.set_acc_range(range);
                self.changed()
            }
            Command::BiasNull { samples } if (1..=MAX_SAMPLES).contains(&samples) => {
                if self.null.is_some() {
                    Status::Busy
                } else if self.motor.is_on() {
                    Status::Moving
                } else {
                    self.null = Some(BiasNull::new(number, samples));
                    return;
                }
            }
            Command::SetBias { axis, value } => {
                put(&mut self.config.bias, axis as u8, value);
                self.changed()
            }
            Command::SetScale { axis, value } if value > 0 => {
                put(&mut self.config.scale, axis as u8, value);
                self.changed()
            }
            Command::MotorDuty { duty } if (-255..=255).contains(&duty) => {
                if duty != 0 && !self.motor.is_alive() {
                    Status::NoKeepAlive
                } else {
                    self.motor.keep_alive();
                    value = i32::from(self.motor.command(duty));
                    Status::Ok
                }
            }
            Command::MotorProfile {
                shape: Shape::Stop, ..
            } => {
                self.motor.command(0);
                Status::Ok
            }
            Command::MotorProfile { .. } | Command::SelfTest { .. } => Status::Unsupported,
            Command::MotorLimits {
                max_duty,
                ramp_per_s,
            } => {
                (self.config.max_duty, self.config.ramp_per_s) = (max_duty, ramp_per_s);
                self.motor.cut();
                self.motor = Motor::new(max_duty, ramp_per_s);
                self.changed()
            }
            Command::ReadRegister { gyro, address } => {
                let job = Job::Read {
                    axis: gyro as u8,
                    address,
                };
                if self.post(board, number, code, job) {
                    return;
                }
                Status::Busy
            }
            Command::WriteRegister {
                gyro,
                address,
                value,
            } => {
                let job = Job::Write {
                    axis: gyro as u8,
                    address,
                    value,
                };
                if self.post(board, number, code, job) {
                    return;
                }
                Status::Busy
            }
            Command::StoreConfig => {
                if self.store.is_some() {
                    Status::Busy
                } else {
                    self.store = Some(self.begin_store(number));
                    return;
                }
            }
            Command::LoadConfig => {
                if self.load(board) {
                    self.apply(board);
                    Status::Ok
                } else {
                    Status::NoConfig
                }
            }
            Command::DefaultConfig => {
                self.config = Config {
                    board_id: self.config.board_id,
                    ..Config::default()
                };
                self.source = source::BUILT_IN;
                self.apply(board);
                Status::Ok
            }
            Command::SetBoardId { board_id } => {
                self.config.board_id = board_id;
                self.changed()
            }
            _ => Status::BadArgument,
        };
        self.reply(board, number, code, status, value, [0; 3]);
    }

    fn changed(&mut self) -> Status {
        self.source = source::SET;
        Status::Ok
    }

    fn post<B: Board>(&mut self, board: &mut B, number: u16, command: u8, job: Job) -> bool {
        let posted = self.waiting.is_none() && board.post(job);
        if posted {
            self.waiting = Some(Waiting { number, command });
        }
        posted
    }

    /// A millisecond has passed: motor, EEPROM, health.
    #[inline(never)]
    pub fn on_millisecond<B: Board>(&mut self, board: &mut B) {
        if self.motor.on_millisecond() {
            self.faults.record(Fault::MotorTimeout);
        }
        board.set_motor(self.motor.output());
        self.step_store(board);
        self.millisecond = self.millisecond.wrapping_add(1);
        if self.millisecond >= HEALTH_MS {
            self.millisecond = 0;
            self.uptime_s = self.uptime_s.wrapping_add(1);
            self.health(board);
        }
    }

    fn begin_store(&self, number: u16) -> Store {
        let generation = self.generation.wrapping_add(1);
        // The copy that is not the newest is overwritten.
        let slot = if self.newest_slot == 0 {
            SLOTS[1]
        } else {
            SLOTS[0]
        };
        Store {
            number,
            slot,
            bytes: self.config.to_bytes(generation),
            at: 0,
        }
    }

    #[inline(never)]
    fn step_store<B: Board>(&mut self, board: &mut B) {
        let Some(store) = &mut self.store else { return };
        if !board.eeprom_is_ready() {
            return;
        }
        let address = store.slot.wrapping_add(u16::from(store.at));
        if let Some(&byte) = store.bytes.get(store.at as usize) {
            board.eeprom_write(address, byte);
            store.at = store.at.wrapping_add(1);
            return;
        }
        let (number, slot, mut same) = (store.number, store.slot, true);
        for (&byte, offset) in store.bytes.iter().zip(0u16..) {
            same &= board.eeprom_read(slot.wrapping_add(offset)) == byte;
        }
        self.store = None;
        if same {
            self.generation = self.generation.wrapping_add(1);
            self.newest_slot = u8::from(slot != SLOTS[0]);
            self.source = source::STORED;
        } else {
            self.faults.record(Fault::ConfigNotStored);
        }
        let status = if same { Status::Ok } else { Status::NotStored };
        self.reply(
            board,
            number,
            Command::StoreConfig.code(),
            status,
            0,
            [0; 3],
        );
    }

    /// Takes the newer of the two stored copies that are in order.
    #[inline(never)]
    fn load<B: Board>(&mut self, board: &mut B) -> bool {
        let mut found: Option<(Config, u8, u8)> = None;
        let mut spoilt = 0;
        for (slot, place) in SLOTS.into_iter().zip(0u8..) {
            let mut bytes = [0; STORED_LEN];
            let mut erased = true;
            for (byte, address) in bytes.iter_mut().zip(slot..) {
                *byte = board.eeprom_read(address);
                erased &= *byte == 0xff;
            }
            let copy = Config::from_bytes(&bytes);
            match (copy, &found) {
                // Generations wrap: the newer one is ahead by less than half the circle.
                (Some((_, generation)), Some((_, best, _)))
                    if generation.wrapping_sub(*best) >= 128 => {}
                (Some((config, generation)), _) => found = Some((config, generation, place)),
                (None, _) if !erased => spoilt += 1,
                (None, _) => {}
            }
        }
        self.faults.record_many(Fault::ConfigInvalid, spoilt);
        let Some((config, generation, place)) = found else {
            return false;
        };
        self.config = config;
        self.generation = generation;
        self.newest_slot = place;
        self.source = source::STORED;
        true
    }

    #[inline(never)]
    fn apply<B: Board>(&mut self, board: &mut B) {
        self.motor = Motor::new(self.config.max_duty, self.config.ramp_per_s);
        board.set_motor(0);
        board.set_period(self.config.period_ticks);
        board.set_baud(self.config.baud_divisor);
        board.set_acc_range(self.config.acc_range);
        board.post(Job::Configure {
            sens_avg: self.config.sens_avg(),
        });
    }
}

fn put<T>(values: &mut [T; 3], axis: u8, value: T) {
    if let Some(place) = values.get_mut(axis as usize) {
        *place = value;
    }
}
