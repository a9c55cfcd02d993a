//! Ports as the outside sees them.

/// A port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Port {
    /// PA: the ADC's inputs.
    A,
    /// PB: SPI.
    B,
    /// PC.
    C,
    /// PD: USART, OC1, OC2.
    D,
}

impl Port {
    pub(crate) fn of_register(address: u8) -> Self {
        match (address - crate::register::PIND) / 3 {
            0 => Port::D,
            1 => Port::C,
            2 => Port::B,
            _ => Port::A,
        }
    }
}

/// What the ports drive. Compare outputs are not in it: [`Pwm`] is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pins {
    /// PORTA..PORTD.
    pub port: [u8; 4],
    /// DDRA..DDRD: 1 is an output.
    pub ddr: [u8; 4],
    /// CPOL (2) and CPHA (1) of the SPI.
    pub spi_mode: u8,
    /// Cycles for each bit of the last SPI byte.
    pub spi_clock: u8,
}

impl Pins {
    /// Whether a pin is driven low.
    #[must_use]
    pub fn is_low(&self, port: Port, bit: u8) -> bool {
        self.ddr[port as usize] >> bit & 1 == 1 && self.port[port as usize] >> bit & 1 == 0
    }

    /// Whether a pin is driven high.
    #[must_use]
    pub fn is_high(&self, port: Port, bit: u8) -> bool {
        self.ddr[port as usize] & self.port[port as usize] & 1 << bit != 0
    }
}

/// A pulse-width output.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pwm {
    /// Share of the time for which it is high, 0..=1.
    pub high: f64,
    /// Pulses a second; 0 for a steady level.
    pub hz: f64,
}
