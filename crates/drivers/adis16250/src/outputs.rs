//! Readings of several outputs at once, and what can be told from them: is the part there, does its sensor respond.

use embedded_hal::delay::DelayNs;
use embedded_hal::spi::SpiDevice;

use crate::{Access, Adis16250, Command, Error, Range, RateCounts, Register, Stimulus, Word};

impl<S: SpiDevice> Adis16250<S> {
    /// Reads several registers by the part's pipeline: one frame for each and one more, where
    /// [`read`](Self::read) takes two for each. `words[i]` is the content of `registers[i]`.
    ///
    /// # Errors
    /// [`Error::Spi`]; [`Error::NoAccess`] for COMMAND, before anything is sent.
    pub fn read_many<const N: usize>(
        &mut self,
        registers: [Register; N],
        delay: &mut impl DelayNs,
    ) -> Result<[Word; N], Error<S::Error>> {
        for register in registers {
            if register.access() == Access::Write {
                return Err(Error::NoAccess(register));
            }
        }
        let mut words = [Word(0); N];
        let mut asked = registers.into_iter();
        let Some(first) = asked.next() else {
            return Ok(words);
        };
        self.frame(Command::read(first), delay)?;
        for word in &mut words {
            // The last reply comes with a frame that disturbs nothing.
            let next = asked.next().unwrap_or(Register::Endurance);
            *word = self.frame(Command::read(next), delay)?;
        }
        Ok(words)
    }

    /// Whether a part is there: the part has no identification, so this reads what every part of the family has.
    /// GYRO_SCALE and SENS/AVG hold something possible, and no word is all zeros or all ones, as of a bus without a part
    /// on it. A part whose GYRO_SCALE was set to nothing at all is taken for none.
    ///
    /// # Errors
    /// [`Error::Spi`]; [`Error::UnknownContent`] with what it reads instead.
    pub fn probe(&mut self, delay: &mut impl DelayNs) -> Result<(), Error<S::Error>> {
        let registers = [Register::GyroScale, Register::SensAvg, Register::SmplPrd];
        let words = self.read_many(registers, delay)?;
        let possible = [
            |bits: u16| bits != 0 && bits <= 0x0FFF,
            |bits| Range::from_code((bits >> 8) as u8).is_some() && bits & 0x00FF <= 6,
            |bits| bits != 0 && bits <= 0x00FF,
        ];
        for ((register, word), is_possible) in registers.into_iter().zip(words).zip(possible) {
            let bits = word.bits();
            if !is_possible(bits) {
                return Err(Error::UnknownContent { register, bits });
            }
        }
        Ok(())
    }

    /// By how much the output moves under a test stimulus: the rate with it less the rate without. At rest that should be
    /// within [`Stimulus::response`]. Before each of the two readings it waits `settle_ms`, which has to cover the sensor
    /// (50 Hz) and the filter in use ([`crate::Filter::delay_samples`] twice); the stimulus is off afterwards, whatever
    /// happened on the way but for the bus itself.
    ///
    /// # Errors
    /// [`Error::Spi`]; [`Error::StaleOutput`] where the part had no new sample.
    pub fn stimulus_response(
        &mut self,
        stimulus: Stimulus,
        settle_ms: u32,
        delay: &mut impl DelayNs,
    ) -> Result<RateCounts, Error<S::Error>> {
        let without = self.settled_rate(settle_ms, delay)?;
        self.hold_stimulus(stimulus, delay)?;
        let with = self.settled_rate(settle_ms, delay);
        self.hold_stimulus(Stimulus::None, delay)?;
        // 14 bits each: the difference fits.
        Ok(RateCounts(with?.0.wrapping_sub(without.0)))
    }

    fn settled_rate(
        &mut self,
        settle_ms: u32,
        delay: &mut impl DelayNs,
    ) -> Result<RateCounts, Error<S::Error>> {
        delay.delay_ms(settle_ms);
        let word = self.read(Register::GyroOut, delay)?;
        if word.is_new() {
            Ok(word.rate())
        } else {
            Err(Error::StaleOutput(word))
        }
    }
}
