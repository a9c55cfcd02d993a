//! The board's work below the tick: scaling, framing, counting. What the PC asks for is in [`requests`].

use adis16250::Register;
use fixed::types::I16F16;
use wire::fields::{Health, Reply, Sample};
use wire::{Asked, Fault, RequestDecoder, Status, code, flags, kind, reset_cause};
use zerocopy::{FromZeros, IntoBytes};

mod requests;
pub(crate) mod store;

use crate::acquire::{Job, Raw, Task};
use crate::bias::{BiasNull, Outcome, TURNS};
use crate::config::Config;
use crate::correction::Correction;
use crate::math::times;
use crate::motor::Motor;
use store::Store;

/// The rest of the board, as the stand sees it.
pub trait Board {
    /// Queues a frame of these fields for the line (see [`wire::fields`]); false, and nothing queued, when there is less room
    /// than [`wire::fields::room_for`] says.
    fn send(&mut self, kind: u8, fields: &[u8]) -> bool;
    /// Bytes that the transmit queue still takes.
    fn room(&self) -> u8;
    /// Puts out the motor command, -255..=255; anything but 0 while [`host_is_there`](Self::host_is_there) only.
    fn set_motor(&mut self, duty: i16);
    /// The host is there: from now on the motor may turn for [`crate::motor::KEEP_ALIVE_MS`]. The board cuts it by itself
    /// when they are over, whatever its main loop is busy with.
    fn keep_alive(&mut self);
    /// Whether they are not over yet.
    fn host_is_there(&self) -> bool;
    /// Sets the period of the sample timer, and that every n-th period has a sample.
    fn set_period(&mut self, ticks: u16, every: u8);
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

/// Less stack than this left at any time is counted with each health frame: an interrupt's worth.
const STACK_GUARD: u16 = 32;
/// Milliseconds from health frame to health frame.
const HEALTH_MS: u16 = 1_000;
/// Bits of what is owed to the host.
const HELLO: u8 = 1;
const HEALTH: u8 = 2;
/// The counters return to zero once the health frame has told them.
const CLEAR: u8 = 4;
/// [`Stand::setting`] when all gyros are set up.
const SET: u8 = 3;
/// The flags of EA begin here.
const ERROR_SHIFT: u8 = 3;
const _: () = assert!(flags::error(0) == 1 << ERROR_SHIFT);
/// Lengths on the line.
const SAMPLE_LEN: u8 = wire::Sample::FRAME_LEN as u8;
const REPLY_LEN: u8 = wire::Reply::FRAME_LEN as u8;
const HELLO_LEN: u8 = wire::Hello::FRAME_LEN as u8;
const HEALTH_LEN: u8 = wire::Health::FRAME_LEN as u8;
const CORRECTED_LEN: u8 = wire::Corrected::FRAME_LEN as u8;
/// Samples from one reply to the next, and from one hello or health frame to the next, where the queue has no room for a
/// sample beside it: 16 samples, 4 replies and a health frame are 1002 bytes, so that samples have four fifths of any line.
const SAMPLES_PER_REPLY: u8 = 4;
const SAMPLES_PER_REPORT: u8 = 16;
/// Codes at which the accelerometer's output is at the converter's end.
const ADC_MAX: u16 = 1_023;

/// A request that is answered later, when what it asks for is done.
#[derive(Clone, Copy)]
struct Pending {
    /// 0: nothing is asked for.
    code: u8,
    number: u16,
}

impl Pending {
    const NONE: Self = Self { code: 0, number: 0 };
    /// Code of what the board does unasked, and nobody is told of.
    const OWN: u8 = 0xff;

    fn is_none(self) -> bool {
        self.code == 0
    }
}

/// The logic below the tick. Its initial value is all zeros, so that it costs no flash as a static.
pub struct Stand {
    /// Bit per axis: not answering at the last sample.
    silent: u8,
    /// Bit per axis: not set up as the hello frame says.
    misconfigured: u8,
    /// The gyros have to be set up (anew).
    unset: bool,
    /// The gyro that is being set up; [`SET`]: none.
    setting: u8,
    /// Bit per axis: has not read back since the first of them.
    wrong: u8,
    /// Bit per axis: its STATUS has been read in this second.
    cleared: u8,
    /// What the sensors' noise has come to, and the nonce that arms the motor; 0: none.
    noise: u32,
    nonce: u16,
    /// Who waits for the work on the gyros that is under way.
    job: Pending,
    self_test: requests::SelfTest,
    null: Pending,
    millisecond: u16,
    /// [`HELLO`], [`HEALTH`], [`CLEAR`]: to be sent as soon as there is room.
    owed: u8,
    /// What has been owed for a sample's time: it goes before samples, or a line too slow for the rate would carry nothing else.
    late: u8,
    /// What was owed at the last sample.
    waited: u8,
    /// Samples sent since the last reply, and since the last hello or health frame; they saturate.
    since_reply: u8,
    since_report: u8,
    motor: Motor,
    config: Config,
    /// What the next reply will say beside its status; zero after each.
    answer: Reply,
    health: Health,
    store: Store,
    requests: RequestDecoder,
    bias_null: BiasNull,
    correction: Correction,
    /// Whether the last sample was in order.
    in_order: bool,
}

impl Stand {
    /// Before [`boot`](Self::boot).
    #[must_use]
    pub const fn new() -> Self {
        use zerocopy::little_endian::{I32, U16, U32};
        Self {
            silent: 0,
            misconfigured: 0,
            unset: false,
            setting: 0,
            wrong: 0,
            cleared: 0,
            noise: 0,
            nonce: 0,
            job: Pending::NONE,
            self_test: requests::SelfTest::new(),
            null: Pending::NONE,
            millisecond: 0,
            owed: 0,
            late: 0,
            waited: 0,
            since_reply: 0,
            since_report: 0,
            motor: Motor::new(),
            config: Config::new(),
            answer: Reply {
                number: U16::ZERO,
                command: 0,
                status: 0,
                value: I32::ZERO,
                detail: [I32::ZERO; 3],
            },
            health: Health {
                uptime_s: U32::ZERO,
                next_seq: U16::ZERO,
                tick_busy_max: U16::ZERO,
                stack_free: U16::ZERO,
                faults: [U16::ZERO; Fault::COUNT],
            },
            store: Store::new(),
            requests: RequestDecoder::new(),
            bias_null: BiasNull::new(),
            correction: Correction::new(),
            in_order: false,
        }
    }

    /// Reads the stored set-up and applies it.
    #[inline(never)]
    pub fn boot<B: Board>(&mut self, board: &mut B) {
        if board.reset_cause() & reset_cause::WATCHDOG != 0 {
            self.record(Fault::WatchdogReset, 0);
        }
        if board.reset_cause() & reset_cause::BROWN_OUT != 0 {
            self.record(Fault::BrownOutReset, 0);
        }
        if !self.load(board) {
            self.config.set_default();
        }
        self.apply(board);
        self.correction.on(board);
    }

    /// SENS/AVG that the gyros are to have.
    #[must_use]
    pub fn sens_avg(&self) -> u16 {
        self.config.sens_avg()
    }

    /// What [`crate::configure_all`] returned at start; says hello.
    pub fn started<B: Board>(&mut self, board: &mut B, misconfigured: u8) {
        self.unset = false;
        self.setting = SET;
        self.note_configured(7, misconfigured);
        self.tell(board, HELLO);
    }

    /// Counts what has been lost outside.
    #[inline(never)]
    pub fn count(&mut self, fault: Fault, times: u8) {
        self.health.count(fault, 0, times.into());
    }

    #[inline(never)]
    fn record(&mut self, fault_of_x: Fault, axis: u8) {
        self.health.count(fault_of_x, axis, 1);
    }

    /// The next sequence number; `times` of them are spent.
    #[inline(never)]
    fn take_seq(&mut self, times: u8) -> u16 {
        let seq = self.health.next_seq.get();
        self.health.next_seq.set(seq.wrapping_add(times.into()));
        seq
    }

    /// A tick's sample, and how many ticks before it had none: scales, flags, counts and sends it.
    #[inline(never)]
    pub fn on_sample<B: Board>(&mut self, board: &mut B, raw: &Raw, missed: u8) {
        let mut sample = Sample::new_zeroed();
        let mut seen = 0;
        if missed != 0 {
            self.count(Fault::TickOverrun, missed);
            self.take_seq(missed);
            seen = flags::TICK_OVERRUN;
        }
        sample.seq.set(self.take_seq(1));
        sample.t_ticks.set(raw.t_ticks);
        sample.pwm.set(self.motor.output());
        let (mut silent, mut bit, mut noise) = (0, 1, 0);
        for axis in 0..3 {
            let gyro = self.gyro(axis, bit, raw, &mut sample);
            if gyro & flags::GYRO_NOT_ANSWERING != 0 {
                silent |= bit;
            }
            seen |= gyro | self.accelerometer(axis, bit, raw, &mut sample);
            noise ^= raw.gyro[axis as usize].bits() as u8;
            bit <<= 1;
        }
        self.noise = wire::crc::update(self.noise, noise);
        self.look_after_gyros(board, silent, (seen >> ERROR_SHIFT) as u8 & 7);
        if self.misconfigured & !silent != 0 || self.setting != SET {
            seen |= flags::GYRO_MISCONFIGURED;
        }
        seen |= self.supply(silent, raw, &mut sample);
        self.in_order = seen == flags::IN_ORDER;
        if !self.null.is_none() {
            seen |= flags::BIAS_NULL;
            self.step_bias_null(board, &sample);
        }
        sample.flags.set(seen);
        if self.late != 0 || !board.send(kind::SAMPLE, sample.as_bytes()) {
            self.record(Fault::FrameDropped, 0);
        } else {
            self.since_reply = self.since_reply.saturating_add(1);
            self.since_report = self.since_report.saturating_add(1);
        }
        self.late = if self.since_report >= SAMPLES_PER_REPORT {
            self.owed & self.waited
        } else {
            0
        };
        self.waited = self.owed;
        if !matches!(raw.done.task, Task::None) {
            self.job_done(board, raw.done);
        }
        let busy = board.ticks_since();
        if busy > self.health.tick_busy_max.get() {
            self.health.tick_busy_max.set(busy);
        }
    }

    /// Corrects the sample that [`on_sample`](Self::on_sample) had just before. Its frame goes out with a millisecond, as soon as
    /// the line has room for it beside the next one and a reply, and nothing else is owed; one that has not until the next sample is dropped.
    #[inline(always)]
    pub fn correct<B: Board>(&mut self, board: &mut B, raw: &Raw) {
        if self.correction.is_ready(board) {
            // One behind the other, so that the stack has to hold one of them.
            self.correction.end(board);
            self.correct_rates(board, raw);
            self.correction.turn(raw);
        }
    }

    #[inline(never)]
    fn correct_rates<B: Board>(&mut self, board: &mut B, raw: &Raw) {
        self.correction.step(
            board,
            raw,
            self.health.next_seq.get().wrapping_sub(1),
            self.motor.output(),
            &self.config,
            self.in_order,
        );
    }

    /// A gyro that answers again may have lost its set-up with its power; one that raises its error or alarm bit, bit per
    /// axis in `errors`, keeps it up until its STATUS is read.
    fn look_after_gyros<B: Board>(&mut self, board: &mut B, silent: u8, errors: u8) {
        let back = self.silent & !silent;
        self.silent = silent;
        if back != 0 {
            self.record_each(Fault::GyroRecoveredX, back);
            self.unset = true;
        }
        if !self.job.is_none() {
            return;
        }
        if self.unset {
            if self.configure(board, 0) {
                self.unset = false;
                self.job.code = Pending::OWN;
            }
            return;
        }
        let uncleared = errors & !self.cleared;
        if uncleared == 0 {
            return;
        }
        // The lowest of them.
        let (mut axis, mut bit) = (0, 1);
        while uncleared & bit == 0 {
            axis += 1;
            bit <<= 1;
        }
        let job = Job {
            task: Task::Read,
            axis,
            address: Register::Status.address(),
            value: 0,
        };
        if board.post(job) {
            self.cleared |= bit;
            self.job.code = Pending::OWN;
        }
    }

    /// Has a gyro set up in the next slot; the others follow, each in its own.
    #[inline(never)]
    fn configure<B: Board>(&mut self, board: &mut B, axis: u8) -> bool {
        let posted = board.post(Job {
            task: Task::Configure,
            axis,
            value: self.config.sens_avg(),
            address: 0,
        });
        if posted {
            self.setting = axis;
        }
        posted
    }

    /// Counts a fault of each axis that has its bit set.
    #[inline(never)]
    fn record_each(&mut self, fault_of_x: Fault, axes: u8) {
        for axis in 0..3 {
            if axes & (1 << axis) != 0 {
                self.record(fault_of_x, axis);
            }
        }
    }

    /// One gyro's part of the sample; its flags. `bit` is the one of the axis.
    fn gyro(&mut self, axis: u8, bit: u8, raw: &Raw, sample: &mut Sample) -> u16 {
        let at = axis as usize;
        if at >= 3 {
            return 0;
        }
        let word = raw.gyro[at];
        let stalled = raw.spi_stalled & bit != 0;
        if stalled {
            self.record(Fault::SpiStalled, 0);
        }
        // A rate may be zero without new data, or -1 count with an alarm; its supply is neither 0 V nor full scale.
        if stalled || word.is_stuck() && raw.supply[at].is_stuck() {
            self.record(Fault::GyroNotAnsweringX, axis);
            return flags::GYRO_NOT_ANSWERING;
        }
        sample.gyro[at].set(word.signed_14());
        sample.temp[at].set(raw.temp[at].signed_12());
        // Q24 times counts; scale and bias are bounded so that nothing wraps.
        let scale = self.config.set_up.scale[at].get();
        let rate = I16F16::from_bits(times(scale << 8, word.signed_14()));
        let bias = I16F16::from_bits(self.config.set_up.bias[at].get());
        sample.rate[at].set(rate.wrapping_sub(bias).to_bits());
        let mut seen = 0;
        if word.is_new() {
            seen = flags::NEW_X * u16::from(bit);
        } else {
            self.record(Fault::GyroStaleX, axis);
        }
        if word.has_error() {
            seen |= flags::ERROR_X * u16::from(bit);
            self.record(Fault::GyroErrorAlarmX, axis);
        }
        seen
    }

    fn accelerometer(&mut self, axis: u8, bit: u8, raw: &Raw, sample: &mut Sample) -> u16 {
        let at = axis as usize;
        if at >= 3 {
            return 0;
        }
        let counts = raw.acc[at];
        sample.acc[at].set(counts);
        if raw.adc_stalled & bit != 0 {
            self.record(Fault::AdcStalled, 0);
            flags::ACC_NOT_CONVERTED
        } else if counts == 0 || counts >= ADC_MAX {
            self.record(Fault::AccAtRailX, axis);
            flags::ACC_AT_RAIL
        } else {
            0
        }
    }

    /// One supply for three gyros: the first that answers says what it is.
    fn supply(&mut self, silent: u8, raw: &Raw, sample: &mut Sample) -> u16 {
        let mut bit = 1;
        for &word in &raw.supply {
            if silent & bit == 0 {
                let counts = word.unsigned_12();
                sample.supply.set(counts);
                if word.supply().is_in_range() {
                    return 0;
                }
                self.record(Fault::SupplyOutOfRange, 0);
                return flags::SUPPLY_OUT_OF_RANGE;
            }
            bit <<= 1;
        }
        0
    }

    fn step_bias_null<B: Board>(&mut self, board: &mut B, sample: &Sample) {
        let outcome = if self.motor.is_on() {
            Outcome::Moving
        } else {
            self.bias_null.take(&sample.gyro, self.in_order)
        };
        let status = match outcome {
            Outcome::GoesOn => return,
            Outcome::NotInOrder => Status::NotAnswering,
            Outcome::Done if self.take_biases() => Status::Ok,
            _ => Status::Moving,
        };
        self.end_bias_null(board, status);
    }

    /// The reply to the bias measurement that is under way, if one is.
    #[inline(never)]
    fn end_bias_null<B: Board>(&mut self, board: &mut B, status: Status) {
        if self.null.is_none() {
            return;
        }
        if !matches!(status, Status::Ok) {
            self.answer.zero();
        }
        let asked = core::mem::replace(&mut self.null, Pending::NONE);
        self.reply(board, asked, status);
    }

    /// The means become the biases; false, and nothing changed, when the stand turns.
    fn take_biases(&mut self) -> bool {
        let mut largest = 0;
        for ((sum, scale), mean) in (self.bias_null.axes())
            .zip(&self.config.set_up.scale)
            .zip(&mut self.answer.detail)
        {
            let scale = scale.get();
            let found = self.bias_null.mean(sum, scale);
            if found == TURNS {
                return false;
            }
            mean.set(found);
            largest = self.bias_null.error(sum, scale).max(largest);
        }
        self.answer.value.set(largest);
        self.config.set_up.bias = self.answer.detail;
        self.config.set_up.config_source = source::SET;
        true
    }

    /// Whether there is room for the reply that the next received byte may bring. Until then the bytes wait: no request,
    /// however many there are, takes the room of a sample, or of a report that is late.
    #[inline(never)]
    pub fn listens<B: Board>(&self, board: &B) -> bool {
        let beside = if self.late != 0 {
            HEALTH_LEN + REPLY_LEN
        } else if self.since_reply >= SAMPLES_PER_REPLY {
            0
        } else {
            SAMPLE_LEN + REPLY_LEN
        };
        board.room() >= beside.wrapping_add(REPLY_LEN)
    }

    /// A received byte.
    #[inline(never)]
    pub fn on_byte<B: Board>(&mut self, board: &mut B, byte: u8) {
        match self.requests.ask(byte) {
            None => {}
            Some(Ok(asked)) => self.on_request(board, &asked),
            Some(Err(_)) => self.record(Fault::RxBadFrame, 0),
        }
    }

    /// A millisecond has passed: motor, EEPROM, self-test, health.
    #[inline(never)]
    pub fn on_millisecond<B: Board>(&mut self, board: &mut B) {
        self.miss_host(board);
        self.motor.on_millisecond();
        board.set_motor(self.motor.output());
        if !self.store.is_idle() {
            self.step_store(board);
        }
        if self.self_test.waits() {
            self.step_self_test(board);
        }
        self.millisecond = self.millisecond.wrapping_add(1);
        if self.millisecond >= HEALTH_MS {
            self.millisecond = 0;
            self.cleared = 0;
            // What does not read back is tried anew each second.
            self.unset |= self.misconfigured & !self.silent != 0;
            self.health
                .uptime_s
                .set(self.health.uptime_s.get().wrapping_add(1));
            self.owed |= HEALTH;
        }
        if self.owed != 0 {
            self.tell(board, 0);
        } else if self.correction.waits() && board.room() >= CORRECTED_LEN + SAMPLE_LEN + REPLY_LEN
        {
            self.correction.tell(board);
        }
    }

    /// Where the host fell silent the board has cut the motor: its command ends with it.
    #[inline(never)]
    fn miss_host<B: Board>(&mut self, board: &B) {
        if self.motor.is_on() && !board.host_is_there() {
            self.motor.cut();
            self.record(Fault::MotorTimeout, 0);
        }
    }

    /// The one reply to a request, with what [`answer`](Self::answer) says.
    #[inline(never)]
    fn reply<B: Board>(&mut self, board: &mut B, asked: Pending, status: Status) {
        self.answer.number.set(asked.number);
        self.answer.command = asked.code;
        self.answer.status = status as u8;
        if !board.send(kind::REPLY, self.answer.as_bytes()) {
            self.record(Fault::ReportDropped, 0);
        }
        self.since_reply = 0;
        self.answer.zero();
    }

    /// Whether a hello or health frame of this length has its turn: unless it is late there has to be room for a sample beside
    /// it.
    fn may_report<B: Board>(&self, board: &B, len: u8) -> bool {
        let beside = if self.late != 0 {
            REPLY_LEN
        } else {
            REPLY_LEN + SAMPLE_LEN
        };
        board.room() >= beside.wrapping_add(len)
    }

    /// Sends what is owed, and `more`, as far as there is room.
    #[inline(never)]
    fn tell<B: Board>(&mut self, board: &mut B, more: u8) {
        self.owed |= more;
        if self.owed & HELLO != 0 && self.may_report(board, HELLO_LEN) {
            let hello = wire::fields::Hello {
                firmware: crate::VERSION,
                board_id: self.config.board_id,
                reset_cause: board.reset_cause(),
                restarts: board.restarts().into(),
                next_seq: self.health.next_seq,
                tick_ns: crate::TICK_NS.into(),
                set_up: self.config.set_up,
            };
            if board.send(kind::HELLO, hello.as_bytes()) {
                self.owed &= !HELLO;
                self.reported();
            }
        }
        if self.owed & HEALTH != 0 && self.may_report(board, HEALTH_LEN) {
            let stack_free = board.stack_free();
            self.health.stack_free.set(stack_free);
            if stack_free < STACK_GUARD {
                self.record(Fault::StackLow, 0);
            }
            if board.send(kind::HEALTH, self.health.as_bytes()) {
                if self.owed & CLEAR != 0 {
                    self.health.faults.zero();
                }
                self.owed &= !(HEALTH | CLEAR);
                self.reported();
            }
        }
    }

    /// A hello or health frame has been sent.
    fn reported(&mut self) {
        (self.since_report, self.late) = (0, 0);
    }

    /// What has come of setting up the gyros that have their bit in `axes`.
    #[inline(never)]
    fn note_configured(&mut self, axes: u8, wrong: u8) {
        let now = (wrong | wrong >> 3) & 7;
        self.record_each(Fault::GyroRecoveredX, self.misconfigured & axes & !now);
        self.misconfigured = self.misconfigured & !axes | now;
        self.record_each(Fault::GyroRegisterMismatchX, wrong);
        self.record_each(Fault::GyroScaleImpossibleX, wrong >> 3);
    }

    #[inline(never)]
    fn apply<B: Board>(&mut self, board: &mut B) {
        self.end_bias_null(board, Status::Aborted);
        self.motor
            .limit(self.config.max_duty, self.config.ramp_per_s.get());
        board.set_motor(0);
        let set_up = &self.config.set_up;
        board.set_period(set_up.period_ticks.get(), set_up.periods_per_sample);
        board.set_baud(set_up.baud_divisor.get());
        board.set_acc_range(set_up.acc_range);
        self.unset = true;
    }
}

impl Default for Stand {
    fn default() -> Self {
        Self::new()
    }
}

impl From<&Asked> for Pending {
    fn from(asked: &Asked) -> Self {
        Self {
            code: asked.code,
            number: asked.number,
        }
    }
}

const _: () = assert!(code::PING != 0, "0 stands for no request");

#[cfg(test)]
mod tests;
