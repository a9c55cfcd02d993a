//! Why a run through the image ends before its time.

use atmega16_sim::{LoadError, Stop};

use crate::native::CLOCK_HZ;

/// Why the image no longer runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Died {
    /// Cycles since power came on.
    pub at: u64,
    /// Address of the next instruction, bytes.
    pub program_counter: u32,
    /// What happened.
    pub stop: Stop,
}

impl std::fmt::Display for Died {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let seconds = self.at as f64 / CLOCK_HZ;
        write!(
            f,
            "the image stopped after {seconds:.6} s at {:#06x}: ",
            self.program_counter
        )?;
        match self.stop {
            Stop::Crashed { at } => write!(f, "no instruction at {at:#06x}"),
            Stop::Halted => write!(f, "asleep, with nothing left to wake it"),
            Stop::Unmodelled(what) => write!(f, "it uses {what}, which the simulator has not"),
            other => write!(f, "{other:?}"),
        }
    }
}

impl std::error::Error for Died {}

/// Why a run through the image could not be made.
#[derive(Debug)]
#[non_exhaustive]
pub enum SimavrError {
    /// The file is no image of an ATmega16.
    Image(LoadError),
    /// The image stopped.
    Died(Died),
}

impl std::fmt::Display for SimavrError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            SimavrError::Image(error) => error.fmt(f),
            SimavrError::Died(died) => died.fmt(f),
        }
    }
}

impl std::error::Error for SimavrError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            SimavrError::Image(error) => std::error::Error::source(error),
            SimavrError::Died(_) => None,
        }
    }
}

impl From<LoadError> for SimavrError {
    fn from(error: LoadError) -> Self {
        SimavrError::Image(error)
    }
}

impl From<Died> for SimavrError {
    fn from(died: Died) -> Self {
        SimavrError::Died(died)
    }
}
