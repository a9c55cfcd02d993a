//! The board's work below the tick: what it keeps, its start and its millisecond. The sample is in [`sample`], what keeps the gyros
//! set up in [`gyros`], what has its turn on the line in [`line`], what the PC asks for in [`requests`].

use wire::fields::{Health, Reply};
use wire::{Asked, Fault, RequestDecoder, Status, code, reset_cause};

mod gyros;
mod line;
mod requests;
mod sample;
pub(crate) mod store;

use crate::acquire::Job;
use crate::bias::BiasNull;
use crate::config::Config;
use crate::correction::Correction;
use crate::math::sum;
use crate::motor::Motor;
use line::{CORRECTED_LEN, REPLY_LEN, SAMPLE_LEN};
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
    /// Whether they are not over yet, and [`is_stopped`](Self::is_stopped) does not say so.
    fn host_is_there(&self) -> bool;
    /// Whether the motor's stop is pressed, or was since [`forget_stop`](Self::forget_stop). The board cuts the motor by itself
    /// then, at once.
    fn is_stopped(&self) -> bool;
    /// What was pressed before is over, what keep-alive there was with it; what is pressed is not.
    fn forget_stop(&mut self);
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
    /// What [`keep`](Self::keep) was given last, before the reset or since; anything after power-on.
    fn kept(&self) -> [u16; 2];
    /// Keeps the counts of resets by the watchdog and by brown-out where a reset leaves them.
    fn keep(&mut self, counts: [u16; 2]);
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
/// Bits of what is owed to the host.
const HELLO: u8 = 1;
const HEALTH: u8 = 2;
/// The counters return to zero once the health frame has told them.
const CLEAR: u8 = 4;
/// [`Stand::setting`] when all gyros are set up.
const SET: u8 = 3;

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

    /// This is asked for from now on.
    #[inline(never)]
    fn ask(&mut self, asked: &Asked) {
        *self = asked.into();
    }

    /// What it was; from now on nothing is asked for.
    #[inline(never)]
    fn take(&mut self) -> Self {
        core::mem::replace(self, Self::NONE)
    }
}

/// The logic below the tick. Its initial value is all zeros, so that it costs no flash as a static.
pub struct Stand {
    /// Bit per axis: not answering at the last sample.
    silent: u8,
    /// Bit per axis: not set up as the hello frame says.
    misconfigured: u8,
    /// Bit per axis: a register was written by hand since it was set up. It stays so until that is done again.
    touched: u8,
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
    /// And the gyro that it is for.
    job_axis: u8,
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
            touched: 0,
            unset: false,
            setting: 0,
            wrong: 0,
            cleared: 0,
            noise: 0,
            nonce: 0,
            job: Pending::NONE,
            job_axis: 0,
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
        self.count_reset(board);
        if !self.load(board) {
            self.config.set_default();
        }
        self.apply(board);
        self.correction.on(board);
    }

    /// Takes up the counts of resets where the last one left them.
    fn count_reset<B: Board>(&mut self, board: &mut B) {
        let cause = board.reset_cause();
        let [mut watchdog, mut brown_out] = board.kept();
        if cause & reset_cause::POWER_ON != 0 {
            (watchdog, brown_out) = (0, 0);
        }
        if cause & reset_cause::WATCHDOG != 0 {
            watchdog = sum(watchdog, 1);
        }
        if cause & reset_cause::BROWN_OUT != 0 {
            brown_out = sum(brown_out, 1);
        }
        board.keep([watchdog, brown_out]);
        self.health.count(Fault::WatchdogReset, 0, watchdog);
        self.health.count(Fault::BrownOutReset, 0, brown_out);
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
        let on = self.miss_host(board);
        self.motor.on_millisecond(on);
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

    /// Where the host fell silent, or the stop was pressed, the board has cut the motor: its command ends with it. Whether the
    /// motor is on then.
    #[inline(never)]
    fn miss_host<B: Board>(&mut self, board: &B) -> bool {
        let on = self.motor.turns();
        if on && !board.host_is_there() {
            self.motor.cut();
            // Somebody wanted that: no fault.
            if !board.is_stopped() {
                self.record(Fault::MotorTimeout, 0);
            }
            return false;
        }
        on
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
