//! What happens at a tick: three gyros and three accelerometer outputs, in a fixed order and at fixed times.
//!
//! The ADIS16250 answers a command in the frame after it, and wants 40 us from frame to frame with a gap of 30 us
//! (data sheet notes, partly unverified). The frames go round the three gyros, so that each has its pause while the
//! others are served, and the ADC converts meanwhile.

use adis16250::{Adis16250, Command, Register, Word};
use embedded_hal::{delay::DelayNs, spi::SpiDevice};
use wire::Status;

/// The sensors as the acquisition sees them.
pub trait Sensors {
    /// A gyro's SPI with its chip select.
    type Spi: SpiDevice;
    /// Waits.
    type Delay: DelayNs;

    /// A gyro: 0, 1, 2 are x, y, z.
    fn gyro(&mut self, axis: u8) -> Option<&mut Adis16250<Self::Spi>>;
    /// The delay that goes with it.
    fn delay(&mut self) -> Self::Delay;
    /// Slows SPI down to what a gyro of any sample period stands (1 MHz), or back to the sampling's own clock.
    fn slow(&mut self, _slow: bool) {}
    /// All sampling instants have passed: from here on interruptions do no harm.
    fn sampled(&mut self) {}
    /// Starts the conversion of accelerometer output 0, 1 or 2 (x, y, z).
    fn adc_start(&mut self, channel: u8);
    /// The result of the conversion; `None` when it does not end within its budget.
    fn adc_finish(&mut self) -> Option<u16>;
}

/// Pause between two rounds over the gyros, us: a round takes about 33 us, a gyro wants 40 us.
const ROUND_STALL_US: u32 = 12;

/// Pause after a frame when one gyro is spoken to alone, us: 40 us from frame to frame, of which a frame takes 10 us, and 30 us
/// between them; for slow sample periods 100 us, as a gyro that has just been powered may have one.
const FAST_STALL_US: u8 = 32;
const SLOW_STALL_US: u8 = 100;

/// What one tick delivered, as it came.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Raw {
    /// GYRO_OUT words.
    pub gyro: [Word; 3],
    /// TEMP_OUT words.
    pub temp: [Word; 3],
    /// SUPPLY_OUT word of gyro x; of y or z where the one before does not answer.
    pub supply: [Word; 3],
    /// ADC counts.
    pub acc: [u16; 3],
    /// Bit per axis: an SPI frame did not end.
    pub spi_stalled: u8,
    /// Bit per axis: a conversion did not end.
    pub adc_stalled: u8,
    /// What became of the job that was posted before this tick.
    pub done: Done,
    /// Time of the tick, set by whoever owns the clock.
    pub t_ticks: u32,
}

impl Raw {
    /// Nothing has come yet; all zeros.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            gyro: [Word(0); 3],
            temp: [Word(0); 3],
            supply: [Word(0); 3],
            acc: [0; 3],
            spi_stalled: 0,
            adc_stalled: 0,
            done: Done::NONE,
            t_ticks: 0,
        }
    }
}

impl Default for Raw {
    fn default() -> Self {
        Self::new()
    }
}

/// Kinds of work on the gyros' registers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Task {
    /// Nothing to do.
    #[default]
    None,
    /// Read a register.
    Read,
    /// Write a register, and read it back where it can be read.
    Write,
    /// Set a gyro up: `value` is SENS/AVG; the result is that of [`configure`].
    Configure,
}

/// Work on the gyros' registers, done in the slot after a sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Job {
    /// What to do.
    pub task: Task,
    /// Gyro 0..=2.
    pub axis: u8,
    /// Even byte address.
    pub address: u8,
    /// 16 bits.
    pub value: u16,
}

/// The end of a [`Job`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Done {
    /// What it was; [`Task::None`] where none has ended.
    pub task: Task,
    /// [`Status::BadArgument`] for a register that is not there, [`Status::NotAnswering`] when SPI stalls.
    pub status: Status,
    /// The register, or bits of axes.
    pub value: u16,
}

impl Done {
    /// None has ended; all zeros.
    pub const NONE: Self = Self {
        task: Task::None,
        status: Status::Ok,
        value: 0,
    };
}

/// The bit of an axis; of a function, as the AVR shifts in a loop.
#[inline(never)]
pub(crate) fn bit(axis: u8) -> u8 {
    1u8.wrapping_shl(axis.into())
}

/// One frame with one gyro, and whether it ended; a word of 0 where it did not. (An `Option` would have the AVR move the word from
/// registers to registers for each caller.)
#[inline(never)]
fn exchange<S: Sensors>(sensors: &mut S, axis: u8, command: Command) -> (Word, bool) {
    let gyro = sensors.gyro(axis);
    match gyro.and_then(|gyro| gyro.exchange(command).ok()) {
        Some(reply) => (reply, true),
        None => (Word(0), false),
    }
}

/// One frame with each gyro: what they answer to the command of the round before, and a bit for each that does not.
#[inline(never)]
fn round<S: Sensors>(sensors: &mut S, command: Command, into: &mut [Word; 3]) -> u8 {
    let (mut axis, mut bit, mut stalled) = (0, 1, 0);
    for word in into {
        let (reply, ended) = exchange(sensors, axis, command);
        *word = reply;
        if !ended {
            stalled |= bit;
        }
        axis = axis.wrapping_add(1);
        bit <<= 1;
    }
    stalled
}

/// One sample. The first thing it does is to start the ADC, the second is the first SPI frame.
pub fn acquire<S: Sensors>(sensors: &mut S, raw: &mut Raw) {
    let mut delay = sensors.delay();
    sensors.adc_start(0);
    raw.adc_stalled = 0;
    let mut stalled = round(sensors, Command::read(Register::GyroOut), &mut raw.gyro);
    sensors.sampled();
    delay.delay_us(ROUND_STALL_US);
    stalled |= round(sensors, Command::read(Register::TempOut), &mut raw.gyro);
    convert(sensors, raw, 0);
    sensors.adc_start(1);
    stalled |= round(sensors, Command::read(Register::SupplyOut), &mut raw.temp);
    delay.delay_us(ROUND_STALL_US);
    stalled |= round(sensors, Command::read(Register::SupplyOut), &mut raw.supply);
    raw.spi_stalled = stalled;
    convert(sensors, raw, 1);
    sensors.adc_start(2);
    convert(sensors, raw, 2);
}

/// Takes the conversion of an output.
#[inline(never)]
fn convert<S: Sensors>(sensors: &mut S, raw: &mut Raw, channel: u8) {
    let counts = sensors.adc_finish();
    if counts.is_none() {
        raw.adc_stalled |= bit(channel);
    }
    if let Some(place) = raw.acc.get_mut(channel as usize) {
        *place = counts.unwrap_or(0);
    }
}

/// Does a job, after the sample and before the next tick.
pub fn work<S: Sensors>(sensors: &mut S, job: &Job, done: &mut Done) {
    if matches!(job.task, Task::None) {
        *done = Done::NONE;
        return;
    }
    sensors.slow(true);
    let (axis, value) = (job.axis, job.value);
    (done.value, done.status) = if job.task == Task::Configure {
        (configure(sensors, axis, value).into(), Status::Ok)
    } else {
        match reach(sensors, axis, job.address, job.task, value, SLOW_STALL_US) {
            (read, Status::Ok) if job.task == Task::Write && read != value => {
                (read, Status::ReadBackWrong)
            }
            reached => reached,
        }
    };
    sensors.slow(false);
    done.task = job.task;
}

/// One frame with one gyro, and the pause that it wants after it.
#[inline(never)]
fn frame<S: Sensors>(sensors: &mut S, axis: u8, command: Command, stall_us: u8) -> (Word, bool) {
    let reply = exchange(sensors, axis, command);
    sensors.delay().delay_us(stall_us.into());
    reply
}

/// Reads a register, after writing it where that is the task. The value is 0 but for [`Status::Ok`].
#[inline(never)]
fn reach<S: Sensors>(
    sensors: &mut S,
    axis: u8,
    address: u8,
    task: Task,
    value: u16,
    stall_us: u8,
) -> (u16, Status) {
    const REFUSED: (u16, Status) = (0, Status::BadArgument);
    const SILENT: (u16, Status) = (0, Status::NotAnswering);
    if axis > 2 {
        return REFUSED;
    }
    let is_write = task == Task::Write;
    // Before the first frame: looking it up takes 15 us, which would be a pause more.
    let read = Command::read_at(address);
    if is_write {
        let Some([low, high]) = Command::write_word_at(address, value) else {
            return REFUSED;
        };
        if !frame(sensors, axis, low, stall_us).1 || !frame(sensors, axis, high, stall_us).1 {
            return SILENT;
        }
    }
    let Some(read) = read else {
        return if is_write {
            (value, Status::Ok)
        } else {
            REFUSED
        };
    };
    if frame(sensors, axis, read, stall_us).1 {
        // The reply comes with any next frame; one that asks for ENDURANCE disturbs nothing.
        let endurance = Command::read(Register::Endurance);
        let (reply, ended) = frame(sensors, axis, endurance, stall_us);
        if ended {
            return (reply.bits(), Status::Ok);
        }
    }
    SILENT
}

/// GYRO_SCALE as the parts leave the factory: 1.
const FACTORY_SCALE: u16 = 0x0800;
/// SMPL_PRD of 256 samples a second, the part's fastest and the only one that the firmware supports.
pub const FASTEST: u16 = 1;

/// Sets a gyro up and reads it back; bit `axis` when a register does not read as written, bit `axis` + 3 when GYRO_SCALE is
/// not what the part was calibrated to. A part that was used elsewhere may have kept anything: its sample period comes first,
/// as the pace of all else hangs on it, then what would shift, flag or disturb the rate without a word.
#[inline(never)]
pub fn configure<S: Sensors>(sensors: &mut S, axis: u8, sens_avg: u16) -> u8 {
    const SENS_AVG: u8 = Register::SensAvg.address();
    const GYRO_OFF: u8 = Register::GyroOff.address();
    const ALM_CTRL: u8 = Register::AlmCtrl.address();
    const MSC_CTRL: u8 = Register::MscCtrl.address();
    let bit = bit(axis);
    let mut stall_us = SLOW_STALL_US;
    sensors.slow(true);
    let (mut address, mut value) = (Register::SmplPrd.address(), FASTEST);
    loop {
        // A gyro that does not answer has no value.
        if reach(sensors, axis, address, Task::Write, value, stall_us) != (value, Status::Ok) {
            return bit;
        }
        // From here on it has its fastest sample period.
        sensors.slow(false);
        stall_us = FAST_STALL_US;
        value = 0;
        address = match address {
            SENS_AVG => GYRO_OFF,
            GYRO_OFF => ALM_CTRL,
            ALM_CTRL => MSC_CTRL,
            MSC_CTRL => break,
            _ => {
                value = sens_avg;
                SENS_AVG
            }
        };
    }
    address = Register::GyroScale.address();
    if reach(sensors, axis, address, Task::Read, 0, stall_us).0 & 0x0fff != FACTORY_SCALE {
        return bit << 3;
    }
    0
}

/// Sets all three up; their bits.
pub fn configure_all<S: Sensors>(sensors: &mut S, sens_avg: u16) -> u8 {
    let mut wrong = 0;
    for axis in 0..3 {
        wrong |= configure(sensors, axis, sens_avg);
    }
    sensors.slow(false);
    wrong
}
