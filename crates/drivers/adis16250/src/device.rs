//! The part, one register at a time.

use embedded_hal::delay::DelayNs;
use embedded_hal::spi::SpiDevice;

use crate::alarm::control_with;
use crate::error::Error;
use crate::register::control;
use crate::{
    Access, Alarm, AlarmNumber, AlarmOutput, AuxCounts, Command, DataReady, OffsetCounts, Pace,
    Register, START_UP_MS, SamplePeriod, SensAvg, Status, Stimulus, Word, exchange,
};

/// Time for the internal self-test, ms. 25 ms typically (*unverified*); the driver written for this part waits 35 ms.
const SELF_TEST_MS: u32 = 35;
/// Time for a flash update, ms. 50 ms (*unverified*); 100 ms are used in the field.
const FLASH_MS: u32 = 100;
/// Time for the factory restore, ms. 20 ms are used in the field.
const RESTORE_MS: u32 = 50;
/// Time for the autonull, ms, as used in the field.
const AUTONULL_MS: u32 = 100;

/// An ADIS16250 or ADIS16255 on an SPI bus in mode 3.
///
/// Every call waits out the pause after each frame, so the next call, to this part, can follow at once. The bus clock
/// is the caller's: at most [`Pace::clock_max_hz`].
#[derive(Debug)]
pub struct Adis16250<S> {
    spi: S,
    pace: Pace,
}

impl<S: SpiDevice> Adis16250<S> {
    /// A part that may sample at any period, so it is addressed at the slower pace until
    /// [`set_sample_period`](Self::set_sample_period) or [`sample_period`](Self::sample_period) has told.
    /// Nothing is sent.
    pub const fn new(spi: S) -> Self {
        Adis16250 {
            spi,
            pace: Pace::Normal,
        }
    }

    /// Gives the bus back.
    pub fn release(self) -> S {
        self.spi
    }

    /// How fast the bus runs at the part's sample period.
    pub const fn pace(&self) -> Pace {
        self.pace
    }

    /// One frame, without a pause: see [`exchange`].
    ///
    /// # Errors
    /// Those of the bus.
    #[inline]
    pub fn exchange(&mut self, command: Command) -> Result<Word, S::Error> {
        exchange(&mut self.spi, command)
    }

    /// Reads a register: two frames, each with its pause.
    ///
    /// # Errors
    /// [`Error::Spi`]; [`Error::NoAccess`] for COMMAND.
    pub fn read(
        &mut self,
        register: Register,
        delay: &mut impl DelayNs,
    ) -> Result<Word, Error<S::Error>> {
        if register.access() == Access::Write {
            return Err(Error::NoAccess(register));
        }
        self.frame(Command::read(register), delay)?;
        // The reply comes with any next frame; one that asks for ENDURANCE disturbs nothing.
        self.frame(Command::read(Register::Endurance), delay)
    }

    /// Writes a register, low byte first. The part holds half the new value in between; no order is prescribed.
    ///
    /// # Errors
    /// [`Error::Spi`]; [`Error::NoAccess`] for registers that can only be read.
    pub fn write(
        &mut self,
        register: Register,
        value: u16,
        delay: &mut impl DelayNs,
    ) -> Result<(), Error<S::Error>> {
        if register.access() == Access::Read {
            return Err(Error::NoAccess(register));
        }
        let [high, low] = value.to_be_bytes();
        self.frame(Command::write_low(register, low), delay)?;
        self.frame(Command::write_high(register, high), delay)?;
        Ok(())
    }

    /// Writes a register and reads it back.
    ///
    /// # Errors
    /// As [`write`](Self::write); [`Error::ReadBack`] where the part does not hold it.
    pub fn write_checked(
        &mut self,
        register: Register,
        value: u16,
        delay: &mut impl DelayNs,
    ) -> Result<(), Error<S::Error>> {
        self.write(register, value, delay)?;
        self.check(register, value, delay)
    }

    /// Sets range and filter, and reads them back.
    ///
    /// # Errors
    /// [`Error::Spi`], [`Error::ReadBack`].
    pub fn set_range(
        &mut self,
        range: SensAvg,
        delay: &mut impl DelayNs,
    ) -> Result<(), Error<S::Error>> {
        self.write_checked(Register::SensAvg, range.bits(), delay)
    }

    /// Range and filter as the part has them.
    ///
    /// # Errors
    /// [`Error::Spi`]; [`Error::UnknownContent`] where the register holds no valid pair.
    pub fn range(&mut self, delay: &mut impl DelayNs) -> Result<SensAvg, Error<S::Error>> {
        let bits = self.read(Register::SensAvg, delay)?.bits();
        SensAvg::from_bits(bits).ok_or(Error::UnknownContent {
            register: Register::SensAvg,
            bits,
        })
    }

    /// Sets the sample period, reads it back and goes on at its pace. Where the new pace is slower, the bus clock has
    /// to come down *before*.
    ///
    /// # Errors
    /// [`Error::Spi`], [`Error::ReadBack`].
    pub fn set_sample_period(
        &mut self,
        period: SamplePeriod,
        delay: &mut impl DelayNs,
    ) -> Result<(), Error<S::Error>> {
        self.pace = Pace::Normal;
        self.frame(Command::write_low(Register::SmplPrd, period.bits()), delay)?;
        self.check(Register::SmplPrd, u16::from(period.bits()), delay)?;
        self.pace = period.pace();
        Ok(())
    }

    /// The sample period as the part has it; goes on at its pace.
    ///
    /// # Errors
    /// [`Error::Spi`]; [`Error::UnknownContent`] for a period that the data sheet does not offer.
    pub fn sample_period(
        &mut self,
        delay: &mut impl DelayNs,
    ) -> Result<SamplePeriod, Error<S::Error>> {
        self.pace = Pace::Normal;
        let bits = self.read(Register::SmplPrd, delay)?.bits();
        let unknown = Error::UnknownContent {
            register: Register::SmplPrd,
            bits,
        };
        let period = u8::try_from(bits)
            .ok()
            .and_then(SamplePeriod::from_bits)
            .ok_or(unknown)?;
        self.pace = period.pace();
        Ok(period)
    }

    /// Reads STATUS, which clears it; a fault that persists comes back.
    ///
    /// # Errors
    /// [`Error::Spi`].
    pub fn status(&mut self, delay: &mut impl DelayNs) -> Result<Status, Error<S::Error>> {
        Ok(Status(self.read(Register::Status, delay)?.bits()))
    }

    /// Clears STATUS by command (*unverified*).
    ///
    /// # Errors
    /// [`Error::Spi`].
    pub fn clear_status(&mut self, delay: &mut impl DelayNs) -> Result<(), Error<S::Error>> {
        self.command(control::COMMAND_CLEAR_STATUS, 0, delay)
    }

    /// Lets the part test itself, 35 ms, at rest. MSC_CTRL's high byte is 0 afterwards: no stimulus is held.
    ///
    /// # Errors
    /// [`Error::Spi`]; [`Error::SelfTest`] where the part says that it failed; [`Error::ReadBack`] where the test does
    /// not end.
    pub fn self_test(&mut self, delay: &mut impl DelayNs) -> Result<(), Error<S::Error>> {
        let start = (control::MSC_SELF_TEST >> 8) as u8;
        self.status(delay)?;
        self.frame(Command::write_high(Register::MscCtrl, start), delay)?;
        delay.delay_ms(SELF_TEST_MS);
        let control = self.read(Register::MscCtrl, delay)?.bits();
        if control & control::MSC_SELF_TEST != 0 {
            let wrote = control & !control::MSC_SELF_TEST;
            return Err(Error::ReadBack {
                register: Register::MscCtrl,
                wrote,
                read: control,
            });
        }
        let status = self.status(delay)?;
        if status.self_test_failed() {
            Err(Error::SelfTest(status))
        } else {
            Ok(())
        }
    }

    /// Holds a test stimulus until told otherwise; the output moves by what [`Stimulus`] says.
    ///
    /// # Errors
    /// [`Error::Spi`].
    pub fn hold_stimulus(
        &mut self,
        stimulus: Stimulus,
        delay: &mut impl DelayNs,
    ) -> Result<(), Error<S::Error>> {
        self.frame(
            Command::write_high(Register::MscCtrl, stimulus.bits()),
            delay,
        )?;
        Ok(())
    }

    /// Sets the data-ready line; `None` switches it off.
    ///
    /// # Errors
    /// [`Error::Spi`].
    pub fn set_data_ready(
        &mut self,
        data_ready: Option<DataReady>,
        delay: &mut impl DelayNs,
    ) -> Result<(), Error<S::Error>> {
        let bits = data_ready.map_or(0, DataReady::bits);
        self.frame(Command::write_low(Register::MscCtrl, bits), delay)?;
        Ok(())
    }

    /// Measures the bias in one filtered sample and sets GYRO_OFF against it. The part must be at rest, and the result
    /// is as good as the filter: set its longest one first. It writes the flash (*unverified*).
    ///
    /// # Errors
    /// [`Error::Spi`].
    pub fn autonull(&mut self, delay: &mut impl DelayNs) -> Result<(), Error<S::Error>> {
        self.command(control::COMMAND_AUTONULL, AUTONULL_MS, delay)
    }

    /// GYRO_OFF and GYRO_SCALE as delivered; reads GYRO_SCALE back. It writes the flash (*unverified*).
    ///
    /// # Errors
    /// [`Error::Spi`], [`Error::ReadBack`].
    pub fn restore_factory_calibration(
        &mut self,
        delay: &mut impl DelayNs,
    ) -> Result<(), Error<S::Error>> {
        self.command(control::COMMAND_FACTORY_RESTORE, RESTORE_MS, delay)?;
        self.check(Register::GyroScale, 0x0800, delay)
    }

    /// Sets GYRO_OFF, which the part adds to its output: -2048 ..= 2047, beyond that the nearest. Reads it back.
    ///
    /// # Errors
    /// [`Error::Spi`], [`Error::ReadBack`].
    pub fn set_offset(
        &mut self,
        offset: OffsetCounts,
        delay: &mut impl DelayNs,
    ) -> Result<(), Error<S::Error>> {
        let bits = offset.0.clamp(-2048, 2047).cast_unsigned() & 0x0FFF;
        self.write_checked(Register::GyroOff, bits, delay)
    }

    /// GYRO_OFF as the part has it.
    ///
    /// # Errors
    /// [`Error::Spi`].
    pub fn offset(&mut self, delay: &mut impl DelayNs) -> Result<OffsetCounts, Error<S::Error>> {
        Ok(OffsetCounts(
            self.read(Register::GyroOff, delay)?.signed_12(),
        ))
    }

    /// Sets GYRO_SCALE in 1/2048: 0 ..= 4095, beyond that the nearest. Reads it back.
    ///
    /// # Errors
    /// [`Error::Spi`], [`Error::ReadBack`].
    pub fn set_scale(
        &mut self,
        scale: u16,
        delay: &mut impl DelayNs,
    ) -> Result<(), Error<S::Error>> {
        self.write_checked(Register::GyroScale, scale.min(0x0FFF), delay)
    }

    /// GYRO_SCALE as the part has it, in 1/2048.
    ///
    /// # Errors
    /// [`Error::Spi`].
    pub fn scale(&mut self, delay: &mut impl DelayNs) -> Result<u16, Error<S::Error>> {
        Ok(self.read(Register::GyroScale, delay)?.unsigned_12())
    }

    /// Writes all registers that the flash keeps to it; ENDURANCE counts it, and 20 000 times (*unverified*) is what it
    /// is made for.
    ///
    /// # Errors
    /// [`Error::Spi`]; [`Error::Flash`] where the part says that it failed.
    pub fn save(&mut self, delay: &mut impl DelayNs) -> Result<(), Error<S::Error>> {
        self.command(control::COMMAND_FLASH_UPDATE, FLASH_MS, delay)?;
        let status = self.status(delay)?;
        if status.flash_failed() {
            Err(Error::Flash(status))
        } else {
            Ok(())
        }
    }

    /// How often the flash was written.
    ///
    /// # Errors
    /// [`Error::Spi`].
    pub fn endurance(&mut self, delay: &mut impl DelayNs) -> Result<u16, Error<S::Error>> {
        Ok(self.read(Register::Endurance, delay)?.bits())
    }

    /// Sets the auxiliary output's voltage: 0 ..= 4095 counts, beyond that the nearest.
    ///
    /// # Errors
    /// [`Error::Spi`].
    pub fn set_aux_dac(
        &mut self,
        counts: AuxCounts,
        delay: &mut impl DelayNs,
    ) -> Result<(), Error<S::Error>> {
        self.write(Register::AuxDac, counts.0.min(0x0FFF), delay)?;
        self.command(control::COMMAND_DAC_LATCH, 0, delay)
    }

    /// Sets one alarm, or switches it off; the other stays as it is.
    ///
    /// # Errors
    /// [`Error::Spi`], [`Error::ReadBack`].
    pub fn set_alarm(
        &mut self,
        number: AlarmNumber,
        alarm: Option<&Alarm>,
        delay: &mut impl DelayNs,
    ) -> Result<(), Error<S::Error>> {
        let before = self.read(Register::AlmCtrl, delay)?.bits();
        if let Some(alarm) = alarm {
            self.write_checked(number.magnitude_register(), alarm.magnitude_bits(), delay)?;
            self.write_checked(number.samples_register(), alarm.samples_bits(), delay)?;
        }
        self.write_checked(
            Register::AlmCtrl,
            control_with(before, number, alarm),
            delay,
        )
    }

    /// One alarm as the part has it; `None` where it is off.
    ///
    /// # Errors
    /// [`Error::Spi`]; [`Error::UnknownContent`] for a source that no output has.
    pub fn alarm(
        &mut self,
        number: AlarmNumber,
        delay: &mut impl DelayNs,
    ) -> Result<Option<Alarm>, Error<S::Error>> {
        let registers = [
            Register::AlmCtrl,
            number.magnitude_register(),
            number.samples_register(),
        ];
        let [control, magnitude, samples] = self.read_many(registers, delay)?.map(Word::bits);
        Alarm::from_bits(number, control, magnitude, samples).map_err(|bits| {
            Error::UnknownContent {
                register: Register::AlmCtrl,
                bits,
            }
        })
    }

    /// Sets how both alarms report.
    ///
    /// # Errors
    /// [`Error::Spi`].
    pub fn set_alarm_output(
        &mut self,
        output: AlarmOutput,
        delay: &mut impl DelayNs,
    ) -> Result<(), Error<S::Error>> {
        self.frame(Command::write_low(Register::AlmCtrl, output.bits()), delay)?;
        Ok(())
    }

    /// Switches the part off for so many half seconds; it comes back by itself. While it sleeps, leave its chip select
    /// alone: that may wake it (*unverified*).
    ///
    /// # Errors
    /// [`Error::Spi`].
    pub fn sleep(
        &mut self,
        half_seconds: u8,
        delay: &mut impl DelayNs,
    ) -> Result<(), Error<S::Error>> {
        self.frame(Command::write_low(Register::SlpCnt, half_seconds), delay)?;
        Ok(())
    }

    /// Resets the part, waits for its start, and reads the sample period that the flash holds.
    ///
    /// # Errors
    /// [`Error::Spi`]; [`Error::UnknownContent`] for a period that the data sheet does not offer.
    pub fn reset(&mut self, delay: &mut impl DelayNs) -> Result<SamplePeriod, Error<S::Error>> {
        self.command(control::COMMAND_RESET, START_UP_MS, delay)?;
        self.sample_period(delay)
    }

    pub(crate) fn frame(
        &mut self,
        command: Command,
        delay: &mut impl DelayNs,
    ) -> Result<Word, Error<S::Error>> {
        let word = exchange(&mut self.spi, command).map_err(Error::Spi)?;
        delay.delay_us(self.pace.pause_us());
        Ok(word)
    }

    fn command(
        &mut self,
        bit: u8,
        wait_ms: u32,
        delay: &mut impl DelayNs,
    ) -> Result<(), Error<S::Error>> {
        self.frame(Command::write_low(Register::Command, bit), delay)?;
        if wait_ms > 0 {
            delay.delay_ms(wait_ms);
        }
        Ok(())
    }

    fn check(
        &mut self,
        register: Register,
        wrote: u16,
        delay: &mut impl DelayNs,
    ) -> Result<(), Error<S::Error>> {
        let read = self.read(register, delay)?.bits();
        if read == wrote {
            Ok(())
        } else {
            Err(Error::ReadBack {
                register,
                wrote,
                read,
            })
        }
    }
}
