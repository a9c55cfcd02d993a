//! What goes wrong with the part.

use crate::{Register, Status, Word};

/// What went wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Error<E> {
    /// The bus.
    Spi(E),
    /// The register cannot be read, or cannot be written.
    NoAccess(Register),
    /// The register does not read back what was written.
    ReadBack {
        /// Which one.
        register: Register,
        /// What was written.
        wrote: u16,
        /// What it reads.
        read: u16,
    },
    /// The self-test did not end, or failed.
    SelfTest(Status),
    /// The part says that its flash was not written.
    Flash(Status),
    /// The output was not refreshed since it was read before.
    StaleOutput(Word),
    /// The register holds what the data sheet does not offer.
    UnknownContent {
        /// Which one.
        register: Register,
        /// What it holds.
        bits: u16,
    },
}

impl<E: core::fmt::Debug> core::fmt::Display for Error<E> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Error::Spi(error) => write!(f, "SPI: {error:?}"),
            Error::NoAccess(register) => write!(f, "{register:?} has no such access"),
            Error::ReadBack {
                register,
                wrote,
                read,
            } => {
                write!(
                    f,
                    "{register:?} reads {read:#06x} after {wrote:#06x} was written"
                )
            }
            Error::SelfTest(status) => write!(f, "self-test failed, status {:#06x}", status.0),
            Error::Flash(status) => write!(f, "flash not written, status {:#06x}", status.0),
            Error::StaleOutput(word) => write!(f, "no new data: {:#06x}", word.0),
            Error::UnknownContent { register, bits } => write!(f, "{register:?} holds {bits:#06x}"),
        }
    }
}

impl<E: core::fmt::Debug> core::error::Error for Error<E> {}
