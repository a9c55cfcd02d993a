//! What a link reads and writes: a serial port, or whatever else brings a board's bytes.

use std::io::{ErrorKind, Read as _, Result, Write as _};
use std::time::{Duration, Instant};

use serialport::SerialPort;

use super::LinkError;

/// How long a read waits for the first byte.
const READ_WAIT: Duration = Duration::from_millis(20);

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

impl Serial {
    /// Opens a port and forgets what had been received before.
    pub fn open(name: &str, baud: u32, since: Instant) -> std::result::Result<Self, LinkError> {
        let open = |error: serialport::Error| LinkError::Open {
            port: name.to_owned(),
            why: error.description.clone(),
            help: help_to_open(&error),
        };
        let port = serialport::new(name, baud)
            .timeout(READ_WAIT)
            .open()
            .map_err(open)?;
        port.clear(serialport::ClearBuffer::Input).map_err(open)?;
        Ok(Self { port, since })
    }
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

/// What to do about a port that does not open.
fn help_to_open(error: &serialport::Error) -> String {
    let ports = serialport::available_ports().unwrap_or_default();
    let names: Vec<&str> = ports.iter().map(|port| port.port_name.as_str()).collect();
    let there = if names.is_empty() {
        "the system sees no serial port: plug the adapter in".to_owned()
    } else {
        format!("ports that there are: {}", names.join(", "))
    };
    match error.kind {
        serialport::ErrorKind::Io(ErrorKind::PermissionDenied) => {
            "you may not use this port: on Linux join its group (`sudo usermod -aG dialout $USER`) and log in again"
                .to_owned()
        }
        serialport::ErrorKind::NoDevice => {
            format!("another program may have it open: close it; {there}")
        }
        _ => there,
    }
}
