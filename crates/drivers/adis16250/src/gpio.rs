//! The two digital lines as inputs and outputs. All bits of GPIO_CTRL are *unverified*: they are a sibling part's.

use embedded_hal::delay::DelayNs;
use embedded_hal::spi::SpiDevice;

use crate::register::control;
use crate::{Adis16250, Command, Error, Line, Register};

/// What a digital line does, where neither data-ready nor an alarm uses it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LineUse {
    /// It can be read; so after power-on.
    #[default]
    Input,
    /// It is driven low.
    Low,
    /// It is driven high.
    High,
}

impl LineUse {
    /// The line's bits of GPIO_CTRL: direction and level.
    const fn bits(self, output: u16, high: u16) -> u16 {
        match self {
            LineUse::Input => 0,
            LineUse::Low => output,
            LineUse::High => output | high,
        }
    }
}

/// The content of GPIO_CTRL.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GpioCtrl(pub u16);

impl GpioCtrl {
    /// Both lines.
    #[must_use]
    pub const fn new(dio0: LineUse, dio1: LineUse) -> Self {
        GpioCtrl(
            dio0.bits(control::GPIO_DIO0_OUTPUT, control::GPIO_DIO0_HIGH)
                | dio1.bits(control::GPIO_DIO1_OUTPUT, control::GPIO_DIO1_HIGH),
        )
    }

    /// Whether the line is high: what is there for an input, what is driven for an output.
    #[must_use]
    pub const fn is_high(self, line: Line) -> bool {
        let bit = match line {
            Line::Dio0 => control::GPIO_DIO0_HIGH,
            Line::Dio1 => control::GPIO_DIO1_HIGH,
        };
        self.0 & bit != 0
    }

    /// Whether the line is an output.
    #[must_use]
    pub const fn is_output(self, line: Line) -> bool {
        let bit = match line {
            Line::Dio0 => control::GPIO_DIO0_OUTPUT,
            Line::Dio1 => control::GPIO_DIO1_OUTPUT,
        };
        self.0 & bit != 0
    }
}

impl<S: SpiDevice> Adis16250<S> {
    /// Sets both lines, levels before directions, so that no output shows the wrong level in between. Levels of inputs
    /// are the outside's, so nothing is read back.
    ///
    /// # Errors
    /// [`Error::Spi`].
    pub fn set_lines(
        &mut self,
        dio0: LineUse,
        dio1: LineUse,
        delay: &mut impl DelayNs,
    ) -> Result<(), Error<S::Error>> {
        let [high, low] = GpioCtrl::new(dio0, dio1).0.to_be_bytes();
        self.frame(Command::write_high(Register::GpioCtrl, high), delay)?;
        self.frame(Command::write_low(Register::GpioCtrl, low), delay)?;
        Ok(())
    }

    /// Directions and levels of both lines.
    ///
    /// # Errors
    /// [`Error::Spi`].
    pub fn lines(&mut self, delay: &mut impl DelayNs) -> Result<GpioCtrl, Error<S::Error>> {
        Ok(GpioCtrl(self.read(Register::GpioCtrl, delay)?.bits()))
    }
}
