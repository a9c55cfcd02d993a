//! Requests as they come.

use super::{Axis, Command, Sensor, Shape, Status, arguments, code};
use crate::fields;

/// An undamaged request, as it came: what the board works from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Asked {
    /// Chosen by the PC, comes back in the reply.
    pub number: u16,
    /// One of [`code`], if the command exists.
    pub code: u8,
    /// The argument bytes.
    pub arguments: [u8; 8],
}

impl Asked {
    /// Why the request is refused, whatever its arguments mean: the command does not exist, or bytes that it does not
    /// use are not 0 (they may come to mean something).
    #[must_use]
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub fn refusal(&self) -> Option<Status> {
        let Some(used) = arguments::len(self.code) else {
            return Some(Status::UnknownCommand);
        };
        for (&byte, place) in self.arguments.iter().zip(0u8..) {
            if place >= used && byte != 0 {
                return Some(Status::BadArgument);
            }
        }
        None
    }

    /// An argument of one byte.
    #[must_use]
    #[inline]
    pub const fn u8<const AT: usize>(&self) -> u8 {
        const { assert!(AT < 8) };
        self.arguments[AT]
    }

    /// An argument that is 0 or 1.
    fn yes<const AT: usize>(&self) -> Result<bool, Status> {
        match self.u8::<AT>() {
            0 => Ok(false),
            1 => Ok(true),
            _ => Err(Status::BadArgument),
        }
    }

    /// An argument of two bytes.
    #[must_use]
    #[inline]
    pub const fn u16<const AT: usize>(&self) -> u16 {
        const { assert!(AT + 1 < 8) };
        u16::from_le_bytes([self.arguments[AT], self.arguments[AT + 1]])
    }

    /// A signed argument of two bytes.
    #[must_use]
    #[inline]
    pub const fn i16<const AT: usize>(&self) -> i16 {
        self.u16::<AT>().cast_signed()
    }

    /// A signed argument of four bytes.
    #[must_use]
    #[inline]
    pub const fn i32<const AT: usize>(&self) -> i32 {
        const { assert!(AT + 3 < 8) };
        let at = &self.arguments;
        i32::from_le_bytes([at[AT], at[AT + 1], at[AT + 2], at[AT + 3]])
    }

    /// The command with its arguments.
    ///
    /// # Errors
    /// [`Status::UnknownCommand`] or [`Status::BadArgument`]; what is refused by a board for the values of its
    /// arguments is a command here.
    pub fn command(&self) -> Result<Command, Status> {
        const BAD: Status = Status::BadArgument;
        if let Some(status) = self.refusal() {
            return Err(status);
        }
        let axis = || Axis::from_code(self.u8::<0>()).ok_or(BAD);
        Ok(match self.code {
            code::PING => Command::Ping,
            code::GET_HELLO => Command::GetHello,
            code::KEEP_ALIVE => Command::KeepAlive,
            code::COUNTERS => Command::Counters,
            code::CLEAR_COUNTERS => Command::ClearCounters,
            code::REBOOT => Command::Reboot,
            code::SET_RATE => Command::SetRate {
                period_ticks: self.u16::<0>(),
                periods_per_sample: self.u8::<2>(),
            },
            code::SET_BAUD => Command::SetBaud {
                divisor: self.u16::<0>(),
            },
            code::SET_GYRO => Command::SetGyro {
                range: self.u8::<0>(),
                filter: self.u8::<1>(),
            },
            code::SET_ACC_RANGE => Command::SetAccRange {
                range: self.u8::<0>(),
            },
            code::BIAS_NULL => Command::BiasNull {
                samples: self.u16::<0>(),
            },
            code::SET_BIAS => Command::SetBias {
                axis: axis()?,
                value: self.i32::<1>(),
            },
            code::SET_SCALE => Command::SetScale {
                axis: axis()?,
                value: self.i32::<1>(),
            },
            code::SET_CORRECTION => Command::SetCorrection {
                row: self.u8::<0>(),
                values: [self.i16::<1>(), self.i16::<3>(), self.i16::<5>()],
            },
            code::CORRECTION => Command::Correction {
                on: self.yes::<0>()?,
            },
            code::GET_CORRECTION => Command::GetCorrection {
                other: self.yes::<0>()?,
                row: self.u8::<1>(),
            },
            code::MOTOR_DUTY => Command::MotorDuty {
                duty: self.i16::<0>(),
            },
            code::MOTOR_PROFILE => Command::MotorProfile {
                shape: Shape::from_code(self.u8::<0>()).ok_or(BAD)?,
                amplitude: self.i16::<1>(),
                offset: self.i16::<3>(),
                period_ms: self.u16::<5>(),
                cycles: self.u8::<7>(),
            },
            code::MOTOR_LIMITS => Command::MotorLimits {
                max_duty: self.u8::<0>(),
                ramp_per_s: self.u16::<1>(),
            },
            code::ARM => Command::Arm {
                nonce: self.u16::<0>(),
            },
            code::READ_REGISTER => Command::ReadRegister {
                gyro: axis()?,
                address: self.u8::<1>(),
            },
            code::WRITE_REGISTER => Command::WriteRegister {
                gyro: axis()?,
                address: self.u8::<1>(),
                value: self.u16::<2>(),
            },
            code::SELF_TEST => Command::SelfTest {
                sensor: Sensor::from_code(self.u8::<0>()).ok_or(BAD)?,
            },
            code::STORE_CONFIG => Command::StoreConfig,
            code::LOAD_CONFIG => Command::LoadConfig,
            code::DEFAULT_CONFIG => Command::DefaultConfig,
            code::SET_BOARD_ID => Command::SetBoardId {
                board_id: self.u16::<0>(),
            },
            _ => return Err(Status::UnknownCommand),
        })
    }
}

impl From<&fields::Request> for Asked {
    fn from(request: &fields::Request) -> Self {
        Asked {
            number: request.number.get(),
            code: request.command,
            arguments: request.arguments,
        }
    }
}
