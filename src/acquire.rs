//! What happens at a tick: three gyros and three accelerometer outputs, in a fixed order and at fixed times.
//!
//! The ADIS16250 answers a command in the frame after it, and wants 40 us from frame to frame with a gap of 30 us
//! (data sheet notes, partly unverified). The frames go round the three gyros, so that each has its pause while the
//! others are served, and the ADC converts meanwhile.

use adis16250::{Access, Adis16250, Command, Register, Word};
use embedded_hal::{delay::DelayNs, spi::SpiDevice};
use wire::Status;

/// The sensors as the acquisition sees them.
pub trait Sensors {
    /// A gyro's SPI with its chip select.
    type Spi: SpiDevice;
    /// Waits.
    type Delay: DelayNs;

    /// The three gyros, x, y, z.
    fn gyros(&mut self) -> &mut [Adis16250<Self::Spi>; 3];
    /// The delay that goes with them.
    fn delay(&mut self) -> Self::Delay;
    /// All sampling instants have passed: from here on interruptions do no harm.
    fn sampled(&mut self) {}
    /// Starts the conversion of accelerometer output 0, 1 or 2 (x, y, z).
    fn adc_start(&mut self, channel: u8);
    /// The result of the conversion; `None` when it does not end within its budget.
    fn adc_finish(&mut self) -> Option<u16>;
}

/// Pause between two rounds over the gyros, us: a round takes about 33 us, a gyro wants 40 us.
const ROUND_STALL_US: u32 = 12;

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
    pub job: Option<Result<u16, Status>>,
}

impl Raw {
    /// Nothing has come yet.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            gyro: [Word(0); 3],
            temp: [Word(0); 3],
            supply: [Word(0); 3],
            acc: [0; 3],
            spi_stalled: 0,
            adc_stalled: 0,
            job: None,
        }
    }
}

impl Default for Raw {
    fn default() -> Self {
        Self::new()
    }
}

/// Work on the gyros' registers, done in the slot after a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Job {
    /// Read a register.
    Read {
        /// Gyro 0..=2.
        axis: u8,
        /// Even byte address.
        address: u8,
    },
    /// Write a register.
    Write {
        /// Gyro 0..=2.
        axis: u8,
        /// Even byte address.
        address: u8,
        /// 16 bits.
        value: u16,
    },
    /// Bring range and filter of all three into line; the result has a bit for each axis that did not read back.
    Configure {
        /// SENS/AVG.
        sens_avg: u16,
    },
}

#[inline(never)]
fn round<S: Sensors>(sensors: &mut S, command: Command, into: &mut [Word; 3], stalled: &mut u8) {
    let mut bit = 1;
    for (gyro, word) in sensors.gyros().iter_mut().zip(into) {
        match gyro.exchange(command) {
            Ok(reply) => *word = reply,
            Err(_) => *stalled |= bit,
        }
        bit <<= 1;
    }
}

/// One sample. The first thing it does is to start the ADC, the second is the first SPI frame.
pub fn acquire<S: Sensors>(sensors: &mut S) -> Raw {
    let mut raw = Raw::new();
    let mut ignored = [Word(0); 3];
    let mut delay = sensors.delay();
    sensors.adc_start(0);
    round(
        sensors,
        Command::read(Register::GyroOut),
        &mut ignored,
        &mut raw.spi_stalled,
    );
    sensors.sampled();
    delay.delay_us(ROUND_STALL_US);
    round(
        sensors,
        Command::read(Register::TempOut),
        &mut raw.gyro,
        &mut raw.spi_stalled,
    );
    convert(sensors, &mut raw, 0);
    sensors.adc_start(1);
    round(
        sensors,
        Command::read(Register::SupplyOut),
        &mut raw.temp,
        &mut raw.spi_stalled,
    );
    delay.delay_us(ROUND_STALL_US);
    round(
        sensors,
        Command::read(Register::SupplyOut),
        &mut raw.supply,
        &mut raw.spi_stalled,
    );
    convert(sensors, &mut raw, 1);
    sensors.adc_start(2);
    convert(sensors, &mut raw, 2);
    raw
}

#[inline(never)]
fn convert<S: Sensors>(sensors: &mut S, raw: &mut Raw, channel: u8) {
    match sensors.adc_finish() {
        Some(counts) => {
            if let Some(place) = raw.acc.get_mut(channel as usize) {
                *place = counts;
            }
        }
        None => raw.adc_stalled |= 1 << channel,
    }
}

/// Does a job, after the sample and before the next tick.
///
/// # Errors
/// [`Status::BadArgument`] for a register that is not there, [`Status::NotAnswering`] when SPI stalls.
#[inline(never)]
pub fn work<S: Sensors>(sensors: &mut S, job: Job) -> Result<u16, Status> {
    let mut delay = sensors.delay();
    match job {
        Job::Read { axis, address } => {
            let gyro = sensors
                .gyros()
                .get_mut(axis as usize)
                .ok_or(Status::BadArgument)?;
            let register = Register::from_address(address).ok_or(Status::BadArgument)?;
            let word = gyro
                .read(register, &mut delay)
                .map_err(|_| Status::NotAnswering)?;
            Ok(word.bits())
        }
        Job::Write {
            axis,
            address,
            value,
        } => {
            let gyro = sensors
                .gyros()
                .get_mut(axis as usize)
                .ok_or(Status::BadArgument)?;
            let register = Register::from_address(address).ok_or(Status::BadArgument)?;
            gyro.write(register, value, &mut delay)
                .map_err(|_| Status::NotAnswering)?;
            if register.access() == Access::Write {
                return Ok(value);
            }
            let word = gyro
                .read(register, &mut delay)
                .map_err(|_| Status::NotAnswering)?;
            if word.bits() == value {
                Ok(value)
            } else {
                Err(Status::ReadBackWrong)
            }
        }
        Job::Configure { sens_avg } => Ok(u16::from(configure(sensors, sens_avg))),
    }
}

/// Sets range and filter of all three gyros and reads them back; a bit for each axis that does not read as written.
#[inline(never)]
pub fn configure<S: Sensors>(sensors: &mut S, sens_avg: u16) -> u8 {
    let mut delay = sensors.delay();
    let mut wrong = 0;
    let mut bit = 1;
    for gyro in sensors.gyros() {
        let done = gyro.write(Register::SensAvg, sens_avg, &mut delay).is_ok()
            && matches!(gyro.read(Register::SensAvg, &mut delay), Ok(word) if word.bits() == sens_avg);
        if !done {
            wrong |= bit;
        }
        bit <<= 1;
    }
    wrong
}
