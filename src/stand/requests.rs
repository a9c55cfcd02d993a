//! What the PC asks for: every request gets one reply, now or when it is done.

use adis16250::{Register, control};
use wire::{Asked, Sensor, Status, code};

use super::{Board, Pending, SET, Stand, source};
use crate::acquire::{Done, Job, Task, bit};
use crate::motor::is_duty;

/// What becomes of a request at once.
enum Answer {
    Now(Status),
    /// The reply comes when it is done, or has been sent.
    Later,
}

/// Time for a gyro's self-test, ms: the data sheet's 25 ms (unverified) with margin; see the driver.
const SELF_TEST_MS: u8 = 40;

/// A gyro's self-test: a job at a time, none of them long.
pub(super) struct SelfTest {
    /// 0: none runs.
    step: u8,
    wait_ms: u8,
}

/// Steps of the self-test, each with the job that it waits for.
mod step {
    pub const CLEAR_STATUS: u8 = 1;
    pub const START: u8 = 2;
    pub const HAS_ENDED: u8 = 3;
    pub const VERDICT: u8 = 4;
}

impl SelfTest {
    pub(super) const fn new() -> Self {
        Self {
            step: 0,
            wait_ms: 0,
        }
    }

    /// Whether its next job is to be posted when its time has come.
    pub(super) fn waits(&self) -> bool {
        self.step != 0 && self.wait_ms > 0
    }
}

impl Stand {
    pub(super) fn on_request<B: Board>(&mut self, board: &mut B, asked: &Asked) {
        let answer = match asked.refusal() {
            Some(status) => Answer::Now(status),
            None => self.carry_out(board, asked),
        };
        if let Answer::Now(status) = answer {
            self.reply(board, asked.into(), status);
        }
    }

    #[inline(never)]
    fn carry_out<B: Board>(&mut self, board: &mut B, asked: &Asked) -> Answer {
        let axis = asked.u8::<0>();
        let status = match asked.code {
            code::PING => Status::Ok,
            code::GET_HELLO => {
                self.tell(board, super::HELLO);
                Status::Ok
            }
            code::KEEP_ALIVE => {
                self.miss_host(board);
                if board.host_is_there() {
                    board.keep_alive();
                    Status::Ok
                } else {
                    off(board)
                }
            }
            code::COUNTERS | code::CLEAR_COUNTERS => {
                let clear = if asked.code == code::CLEAR_COUNTERS {
                    super::CLEAR
                } else {
                    0
                };
                self.tell(board, super::HEALTH | clear);
                Status::Ok
            }
            code::REBOOT => {
                self.reply(board, asked.into(), Status::Ok);
                self.motor.cut();
                board.set_motor(0);
                board.reboot();
                return Answer::Later;
            }
            code::SET_RATE..=code::SET_ACC_RANGE | code::SET_BIAS | code::SET_SCALE => {
                return self.set_up(board, asked);
            }
            code::BIAS_NULL => {
                let set_up = &self.config.set_up;
                if !self.null.is_none() {
                    Status::Busy
                } else if !self.bias_null.begin(
                    word(asked),
                    set_up.gyro_filter,
                    set_up.period_ticks.get(),
                ) {
                    Status::BadArgument
                } else if self.motor.is_on() {
                    Status::Moving
                } else {
                    self.null.ask(asked);
                    return Answer::Later;
                }
            }
            code::ARM => self.arm(board, asked),
            code::SET_CORRECTION..=code::GET_CORRECTION => {
                return self.on_correction(board, asked);
            }
            code::MOTOR_DUTY => {
                let duty = word(asked).cast_signed();
                if !is_duty(duty) {
                    Status::BadArgument
                } else if duty != 0 && !board.host_is_there() {
                    off(board)
                } else {
                    let holds = self.motor.command(duty);
                    self.say(holds.into());
                    Status::Ok
                }
            }
            code::MOTOR_PROFILE => {
                let shape = asked.u8::<0>();
                if shape != 0 && !board.host_is_there() {
                    off(board)
                } else {
                    done(self.motor.profile(
                        shape,
                        asked.i16::<1>(),
                        asked.i16::<3>(),
                        asked.u16::<5>(),
                        asked.u8::<7>(),
                    ))
                }
            }
            code::MOTOR_LIMITS => {
                let (most, ramp) = (asked.u8::<0>(), asked.u16::<1>());
                self.config.max_duty = most;
                self.config.ramp_per_s.set(ramp);
                self.motor.limit(most, ramp);
                self.changed(true)
            }
            code::READ_REGISTER | code::WRITE_REGISTER => {
                // A read has no value: its bytes are 0.
                let job = Job {
                    task: if asked.code == code::READ_REGISTER {
                        Task::Read
                    } else {
                        Task::Write
                    },
                    axis,
                    address: asked.u8::<1>(),
                    value: asked.u16::<2>(),
                };
                return self.post(board, asked, job);
            }
            code::SELF_TEST => return self.begin_self_test(asked),
            code::STORE_CONFIG => {
                if self.begin_store(asked) {
                    return Answer::Later;
                }
                Status::Busy
            }
            code::LOAD_CONFIG => {
                if !self.store.is_idle() {
                    Status::Busy
                } else if self.load(board) {
                    self.apply(board);
                    Status::Ok
                } else {
                    Status::NoConfig
                }
            }
            code::DEFAULT_CONFIG => {
                self.config.set_default();
                self.config.set_up.config_source = source::BUILT_IN;
                self.apply(board);
                Status::Ok
            }
            code::SET_BOARD_ID => {
                self.config.board_id.set(word(asked));
                self.changed(true)
            }
            // What has a code but no arm here: none.
            _ => Status::Unsupported,
        };
        Answer::Now(status)
    }

    /// What changes several things at once, or nothing when one of them is out of range.
    #[inline(never)]
    fn set_up<B: Board>(&mut self, board: &mut B, asked: &Asked) -> Answer {
        let was = self.config;
        let set_up = &mut self.config.set_up;
        match asked.code {
            code::SET_RATE => {
                set_up.period_ticks.set(word(asked));
                set_up.periods_per_sample = asked.u8::<2>().max(1);
            }
            code::SET_BAUD => set_up.baud_divisor.set(word(asked)),
            code::SET_GYRO => {
                (set_up.gyro_range, set_up.gyro_filter) = (asked.u8::<0>(), asked.u8::<1>())
            }
            code::SET_ACC_RANGE => set_up.acc_range = asked.u8::<0>(),
            _ => {
                let values = if asked.code == code::SET_BIAS {
                    &mut set_up.bias
                } else {
                    &mut set_up.scale
                };
                match values.get_mut(asked.u8::<0>() as usize) {
                    Some(place) => place.set(asked.i32::<1>()),
                    None => return Answer::Now(Status::BadArgument),
                }
            }
        }
        if !self.config.is_in_order() {
            self.config = was;
            return Answer::Now(Status::BadArgument);
        }
        // A measurement of the bias mixes what was before with what is now.
        self.end_bias_null(board, Status::Aborted);
        let set_up = &mut self.config.set_up;
        set_up.config_source = source::SET;
        match asked.code {
            code::SET_RATE => {
                board.set_period(set_up.period_ticks.get(), set_up.periods_per_sample)
            }
            code::SET_BAUD => {
                let divisor = set_up.baud_divisor.get();
                self.reply(board, asked.into(), Status::Ok);
                board.set_baud(divisor);
                return Answer::Later;
            }
            code::SET_GYRO => {
                if !self.job.is_none() || !self.configure(board, 0) {
                    self.config = was;
                    return Answer::Now(Status::Busy);
                }
                self.config.set_scale_of_range();
                self.job.ask(asked);
                return Answer::Later;
            }
            code::SET_ACC_RANGE => board.set_acc_range(set_up.acc_range),
            _ => {}
        }
        Answer::Now(Status::Ok)
    }

    /// Without a nonce: makes one of the sensors' noise so far and tells it. With that one, once: the host is there, and the
    /// motor may turn for as long as its keep-alives come. What somebody has recorded and sends again has another's nonce. A stop
    /// that is pressed refuses both, one that was pressed since the nonce was told refuses that.
    #[inline(never)]
    fn arm<B: Board>(&mut self, board: &mut B, asked: &Asked) -> Status {
        let said = word(asked);
        self.miss_host(board);
        let nonce = core::mem::take(&mut self.nonce);
        if said == 0 {
            board.forget_stop();
        }
        if board.is_stopped() {
            return Status::Stopped;
        }
        if said == 0 {
            self.nonce = self.noise as u16 | 1;
            self.say(self.nonce.into());
        } else if said == nonce {
            board.keep_alive();
        } else {
            return Status::BadArgument;
        }
        Status::Ok
    }

    /// What concerns the correction.
    #[inline(always)]
    fn on_correction<B: Board>(&mut self, board: &mut B, asked: &Asked) -> Answer {
        let what = asked.u8::<0>();
        // The EEPROM is read at once.
        if !self.store.is_idle() {
            return Answer::Now(Status::Busy);
        }
        if asked.code == code::CORRECTION {
            if what == 0 {
                self.correction.off();
            } else if !self.correction.on(board) {
                return Answer::Now(Status::NoConfig);
            }
            return Answer::Now(Status::Ok);
        }
        let write = asked.code == code::SET_CORRECTION;
        let row = if write { what } else { asked.u8::<1>() };
        let Some(place) = self.correction.place(write || what != 0, row) else {
            return Answer::Now(Status::BadArgument);
        };
        if write {
            self.begin_write(asked, place.get());
            return Answer::Later;
        }
        self.say(self.correction.in_use().into());
        self.correction
            .read(board, place.get(), &mut self.answer.detail);
        Answer::Now(Status::Ok)
    }

    /// What the reply says beside its status.
    #[inline(never)]
    fn say(&mut self, value: i32) {
        self.answer.value.set(value);
    }

    #[inline(never)]
    fn changed(&mut self, in_range: bool) -> Status {
        if in_range {
            self.config.set_up.config_source = source::SET;
        }
        done(in_range)
    }

    /// Posts work whose end answers the request.
    fn post<B: Board>(&mut self, board: &mut B, asked: &Asked, job: Job) -> Answer {
        if self.job.is_none() && board.post(job) {
            self.job.ask(asked);
            self.job_axis = job.axis;
            Answer::Later
        } else {
            Answer::Now(Status::Busy)
        }
    }

    /// Work on the gyros has ended.
    pub(super) fn job_done<B: Board>(&mut self, board: &mut B, done: Done) {
        let (value, mut status) = (done.value, done.status);
        if matches!(done.task, Task::Configure) {
            self.note_configured(bit(self.setting), value as u8);
            if self.setting == 0 {
                self.wrong = 0;
            }
            self.wrong |= value as u8 & 7;
            let next = self.setting.wrapping_add(1);
            // The slot is free: this was the job in it.
            if next != SET && self.configure(board, next) {
                return;
            }
            self.setting = SET;
        }
        match self.job.code {
            Pending::OWN => {
                self.job = Pending::NONE;
                return;
            }
            code::SELF_TEST => match self.next_self_test(value, status) {
                Some(end) => status = end,
                None => return,
            },
            code::SET_GYRO => {
                self.say(self.wrong.into());
                if self.wrong != 0 {
                    status = Status::ReadBackWrong;
                }
            }
            code => {
                // By hand: what the part is set to now is not what the set-up says.
                if code == code::WRITE_REGISTER && !matches!(status, Status::BadArgument) {
                    self.touched |= bit(self.job_axis);
                }
                self.say(value.into());
            }
        }
        let asked = self.job.take();
        self.reply(board, asked, status);
    }

    /// The jobs of the self-test are posted from the millisecond, where a slot is free.
    fn begin_self_test(&mut self, asked: &Asked) -> Answer {
        let sensor = asked.u8::<0>();
        if sensor == Sensor::Accelerometer as u8 {
            // The MMA7260QT has no self-test.
            Answer::Now(Status::Unsupported)
        } else if sensor > Sensor::GyroZ as u8 {
            Answer::Now(Status::BadArgument)
        } else if !self.job.is_none() {
            Answer::Now(Status::Busy)
        } else {
            self.job.ask(asked);
            self.job_axis = sensor;
            self.self_test = SelfTest {
                step: step::CLEAR_STATUS,
                wait_ms: 1,
            };
            // Its rate is not to be trusted until the end.
            self.misconfigured |= bit(sensor);
            Answer::Later
        }
    }

    pub(super) fn step_self_test<B: Board>(&mut self, board: &mut B) {
        let test = &mut self.self_test;
        test.wait_ms = test.wait_ms.wrapping_sub(1);
        if test.wait_ms > 0 {
            return;
        }
        let axis = self.job_axis;
        let (task, register) = match test.step {
            step::START => (Task::Write, Register::MscCtrl),
            step::HAS_ENDED => (Task::Read, Register::MscCtrl),
            _ => (Task::Read, Register::Status),
        };
        let job = Job {
            task,
            axis,
            address: register.address(),
            value: control::MSC_SELF_TEST,
        };
        if !board.post(job) {
            test.wait_ms = 1;
        }
    }

    /// A job of the self-test has ended; the status of the test, when that was the last.
    fn next_self_test(&mut self, value: u16, status: Status) -> Option<Status> {
        let test = &mut self.self_test;
        test.wait_ms = 1;
        let end = match (test.step, status) {
            // The bit that starts it need not read back: it clears itself.
            (step::START, Status::Ok | Status::ReadBackWrong) => {
                test.wait_ms = SELF_TEST_MS;
                test.step = step::HAS_ENDED;
                return None;
            }
            (_, Status::Ok) => match test.step {
                step::CLEAR_STATUS => {
                    test.step = step::START;
                    return None;
                }
                step::HAS_ENDED if value & control::MSC_SELF_TEST == 0 => {
                    test.step = step::VERDICT;
                    return None;
                }
                step::VERDICT if value & control::STATUS_SELF_TEST_FAILED == 0 => Status::Ok,
                _ => Status::SelfTestFailed,
            },
            _ => status,
        };
        test.step = 0;
        self.misconfigured &= !(bit(self.job_axis));
        Some(end)
    }
}

/// The first two bytes of the arguments. In line they are put together where one of them is at hand, which takes more.
#[inline(never)]
fn word(asked: &Asked) -> u16 {
    asked.u16::<0>()
}

/// Why the motor may not turn.
#[inline(never)]
fn off<B: Board>(board: &B) -> Status {
    if board.is_stopped() {
        Status::Stopped
    } else {
        Status::NoKeepAlive
    }
}

fn done(in_range: bool) -> Status {
    if in_range {
        Status::Ok
    } else {
        Status::BadArgument
    }
}
