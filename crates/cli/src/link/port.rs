//! What a link reads and writes: a serial port, or whatever else brings a board's bytes.

use std::io::{Read as _, Result, Write as _};
use std::time::{Duration, Instant};

use serialport::SerialPort;

/// The host's end of a line to a board.
pub trait Port {
    /// Reads what has arrived, waiting for some milliseconds where nothing has ([`std::io::ErrorKind::TimedOut`] then); 0
    /// bytes where the other end has hung up.
    ///
    /// # Errors
    /// The line's.
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize>;
    /// Sends.
    ///
    /// # Errors
    /// The line's.
    fn write_all(&mut self, bytes: &[u8]) -> Result<()>;
    /// Sets the speed of this end, baud, and forgets what was received at the old one.
    ///
    /// # Errors
    /// The line's.
    fn set_baud(&mut self, baud: u32) -> Result<()>;
    /// The time by which replies are waited for, since a moment that stays the same: that of the last byte that was read.
    fn now(&self) -> Duration;
}

/// A serial port, by the clock on the wall.
pub(super) struct Serial {
    pub port: Box<dyn SerialPort>,
    pub since: Instant,
}

impl Port for Serial {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize> {
        self.port.read(buffer)
    }

    fn write_all(&mut self, bytes: &[u8]) -> Result<()> {
        self.port.write_all(bytes)?;
        self.port.flush()
    }

    fn set_baud(&mut self, baud: u32) -> Result<()> {
        self.port.set_baud_rate(baud)?;
        Ok(self.port.clear(serialport::ClearBuffer::Input)?)
    }

    fn now(&self) -> Duration {
        self.since.elapsed()
    }
}
