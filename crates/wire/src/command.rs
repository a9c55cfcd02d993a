//! What the PC asks of the board.

use zerocopy::IntoBytes;

use crate::frame::write_frame;
use crate::{EncodeError, OVERHEAD, fields, kind};

/// The codes of the commands on the wire.
#[allow(missing_docs)]
pub mod code;

mod asked;

pub use asked::Asked;

macro_rules! coded {
    ($(#[$outer:meta])* $enum:ident { $($(#[$doc:meta])* $name:ident = $code:literal,)* }) => {
        $(#[$outer])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[repr(u8)]
        pub enum $enum {
            $($(#[$doc])* $name = $code,)*
        }

        impl $enum {
            /// The one with this code on the wire; `None` where the table has none.
            #[must_use]
            pub const fn from_code(code: u8) -> Option<Self> {
                match code {
                    $($code => Some($enum::$name),)*
                    _ => None,
                }
            }
        }
    };
}

coded! {
    /// What became of a request.
    Status {
        /// Done.
        Ok = 0,
        /// No command has this code.
        UnknownCommand = 1,
        /// The command exists; this firmware or this board lacks it.
        Unsupported = 2,
        /// An argument is outside its range, or an unused argument byte is not 0.
        BadArgument = 3,
        /// A command that takes time is still running.
        Busy = 4,
        /// Refused or broken off because the stand moves.
        Moving = 5,
        /// The sensor does not answer.
        NotAnswering = 6,
        /// The sensor answers, but does not read back what was written.
        ReadBackWrong = 7,
        /// The self-test of the sensor failed.
        SelfTestFailed = 8,
        /// The motor does not turn without keep-alive.
        NoKeepAlive = 9,
        /// The EEPROM does not read back what was written.
        NotStored = 10,
        /// There is no stored configuration that passes its check.
        NoConfig = 11,
        /// Broken off by another command.
        Aborted = 12,
        /// The motor's stop is pressed, or was since a nonce was last asked for.
        Stopped = 13,
    }
}

coded! {
    /// One of the three axes.
    Axis {
        /// x.
        X = 0,
        /// y.
        Y = 1,
        /// z.
        Z = 2,
    }
}

coded! {
    /// A sensor that can test itself.
    Sensor {
        /// The gyro of the x axis.
        GyroX = 0,
        /// The gyro of the y axis.
        GyroY = 1,
        /// The gyro of the z axis.
        GyroZ = 2,
        /// The accelerometer.
        Accelerometer = 3,
    }
}

coded! {
    /// Shape of a motor profile.
    Shape {
        /// Ends the profile; the motor goes to rest at its ramp rate.
        Stop = 0,
        /// Half a period at `offset + amplitude`, half at `offset - amplitude`.
        Steps = 1,
        /// From `offset - amplitude` to `offset + amplitude` and back, linearly.
        Triangle = 2,
        /// A sine about `offset`.
        Sine = 3,
    }
}

/// What the PC can ask. Every command has its code on the wire, whether a firmware has it or not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// Nothing but the reply.
    Ping,
    /// Sends a hello frame.
    GetHello,
    /// The PC is there: the motor may turn for the next 200 ms.
    KeepAlive,
    /// Sends a health frame.
    Counters,
    /// Sends a health frame, then starts counting anew.
    ClearCounters,
    /// Replies, then resets the board through its watchdog.
    Reboot,
    /// Sets the time from sample to sample.
    SetRate {
        /// Period of the sample timer, ticks of [`Hello::tick_ns`](crate::Hello::tick_ns).
        period_ticks: u16,
        /// Periods from sample to sample; 0 is taken as 1.
        periods_per_sample: u8,
    },
    /// Replies, then sets the speed of the line.
    SetBaud {
        /// The USART's UBRR: 16 MHz / 16 / (divisor + 1) baud.
        divisor: u16,
    },
    /// Sets all three gyros.
    SetGyro {
        /// Bits 10:8 of SENS/AVG: 4 for 320 deg/s, 2 for 160 deg/s, 1 for 80 deg/s.
        range: u8,
        /// Bits 2:0 of SENS/AVG: 2^filter taps in each of two stages.
        filter: u8,
    },
    /// Sets the accelerometer.
    SetAccRange {
        /// g-select2 and g-select1 as bits 1 and 0: 0 for 1.5 g, 1 for 2 g, 2 for 4 g, 3 for 6 g.
        range: u8,
    },
    /// Measures the bias of all three gyros at rest. The reply comes when it is done.
    BiasNull {
        /// How many samples to average.
        samples: u16,
    },
    /// Sets the bias that is subtracted.
    SetBias {
        /// Which gyro.
        axis: Axis,
        /// Q16.16 deg/s.
        value: i32,
    },
    /// Sets the scale factor.
    SetScale {
        /// Which gyro.
        axis: Axis,
        /// Q8.24 deg/s for each count.
        value: i32,
    },
    /// Writes a row of the stored correction that is not in use; see [`crate::correction`]. The row behind the last one is the
    /// CRC, which puts it in use. The reply comes when it is done.
    SetCorrection {
        /// Which row.
        row: u8,
        /// Its three numbers.
        values: [i16; 3],
    },
    /// Switches the correction off until the next reset, or on: the newest stored one, its filter started anew.
    Correction {
        /// On.
        on: bool,
    },
    /// Reads a row of a stored correction: the reply's details. Its value is the copy in use, 1 or 2, or 0 for none.
    GetCorrection {
        /// The copy in use, or the other one.
        other: bool,
        /// Which row.
        row: u8,
    },
    /// Ends a profile and turns the motor at a constant command.
    MotorDuty {
        /// -255 ..= 255.
        duty: i16,
    },
    /// Arms the motor: without a nonce asks for one, which comes as the reply's value; with it, once, the motor may turn for
    /// the next 200 ms, and for as long as keep-alives come in time.
    Arm {
        /// 0, or the one that was told.
        nonce: u16,
    },
    /// Turns the motor by a periodic profile.
    MotorProfile {
        /// Shape over a period.
        shape: Shape,
        /// -255 ..= 255.
        amplitude: i16,
        /// -255 ..= 255.
        offset: i16,
        /// Length of a period, ms.
        period_ms: u16,
        /// Periods until it ends; 0 for as long as the PC is there.
        cycles: u8,
    },
    /// Limits what the other motor commands can ask for.
    MotorLimits {
        /// Largest magnitude of the command, 0 ..= 255.
        max_duty: u8,
        /// Largest change of the command, steps a second.
        ramp_per_s: u16,
    },
    /// Reads a register of a gyro; the reply's value is its 16 bits.
    ReadRegister {
        /// Which gyro.
        gyro: Axis,
        /// Even byte address.
        address: u8,
    },
    /// Writes a register of a gyro, and reads it back where the register can be read.
    WriteRegister {
        /// Which gyro.
        gyro: Axis,
        /// Even byte address.
        address: u8,
        /// The 16 bits.
        value: u16,
    },
    /// Lets a sensor test itself. The reply comes when it is done.
    SelfTest {
        /// Which sensor.
        sensor: Sensor,
    },
    /// Writes the set-up to EEPROM.
    StoreConfig,
    /// Takes the set-up from EEPROM.
    LoadConfig,
    /// Takes the built-in set-up; EEPROM stays as it is.
    DefaultConfig,
    /// Gives the board its number.
    SetBoardId {
        /// The number.
        board_id: u16,
    },
}

/// A command and the number under which its reply comes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Request {
    /// Chosen by the PC, comes back in the reply.
    pub number: u16,
    /// What to do.
    pub command: Command,
}

impl Request {
    /// Bytes of the payload, version and kind included; the same for every command.
    pub const LEN: usize = 2 + size_of::<fields::Request>();
    /// Bytes on the line.
    pub const FRAME_LEN: usize = Self::LEN + OVERHEAD;
}

impl Command {
    /// The code on the wire.
    #[must_use]
    pub const fn code(&self) -> u8 {
        match self {
            Command::Ping => code::PING,
            Command::GetHello => code::GET_HELLO,
            Command::KeepAlive => code::KEEP_ALIVE,
            Command::Counters => code::COUNTERS,
            Command::ClearCounters => code::CLEAR_COUNTERS,
            Command::Reboot => code::REBOOT,
            Command::SetRate { .. } => code::SET_RATE,
            Command::SetBaud { .. } => code::SET_BAUD,
            Command::SetGyro { .. } => code::SET_GYRO,
            Command::SetAccRange { .. } => code::SET_ACC_RANGE,
            Command::BiasNull { .. } => code::BIAS_NULL,
            Command::SetBias { .. } => code::SET_BIAS,
            Command::SetScale { .. } => code::SET_SCALE,
            Command::SetCorrection { .. } => code::SET_CORRECTION,
            Command::Correction { .. } => code::CORRECTION,
            Command::GetCorrection { .. } => code::GET_CORRECTION,
            Command::MotorDuty { .. } => code::MOTOR_DUTY,
            Command::MotorProfile { .. } => code::MOTOR_PROFILE,
            Command::MotorLimits { .. } => code::MOTOR_LIMITS,
            Command::Arm { .. } => code::ARM,
            Command::ReadRegister { .. } => code::READ_REGISTER,
            Command::WriteRegister { .. } => code::WRITE_REGISTER,
            Command::SelfTest { .. } => code::SELF_TEST,
            Command::StoreConfig => code::STORE_CONFIG,
            Command::LoadConfig => code::LOAD_CONFIG,
            Command::DefaultConfig => code::DEFAULT_CONFIG,
            Command::SetBoardId { .. } => code::SET_BOARD_ID,
        }
    }

    /// The argument bytes; unused ones, at the end, are 0.
    fn arguments(&self) -> [u8; 8] {
        let word = |value: u16| {
            let [low, high] = value.to_le_bytes();
            [low, high, 0, 0, 0, 0, 0, 0]
        };
        let long = |axis: Axis, value: i32| {
            let [a, b, c, d] = value.to_le_bytes();
            [axis as u8, a, b, c, d, 0, 0, 0]
        };
        match *self {
            Command::Ping
            | Command::GetHello
            | Command::KeepAlive
            | Command::Counters
            | Command::ClearCounters
            | Command::Reboot
            | Command::StoreConfig
            | Command::LoadConfig
            | Command::DefaultConfig => [0; 8],
            Command::SetRate {
                period_ticks,
                periods_per_sample,
            } => {
                let [a, b] = period_ticks.to_le_bytes();
                [a, b, periods_per_sample, 0, 0, 0, 0, 0]
            }
            Command::SetBaud { divisor: value }
            | Command::BiasNull { samples: value }
            | Command::Arm { nonce: value }
            | Command::SetBoardId { board_id: value } => word(value),
            Command::SetGyro { range, filter } => [range, filter, 0, 0, 0, 0, 0, 0],
            Command::SetAccRange { range } => [range, 0, 0, 0, 0, 0, 0, 0],
            Command::SetBias { axis, value } | Command::SetScale { axis, value } => {
                long(axis, value)
            }
            Command::SetCorrection { row, values } => {
                let [[a, b], [c, d], [e, f]] = values.map(i16::to_le_bytes);
                [row, a, b, c, d, e, f, 0]
            }
            Command::Correction { on } => [u8::from(on), 0, 0, 0, 0, 0, 0, 0],
            Command::GetCorrection { other, row } => [u8::from(other), row, 0, 0, 0, 0, 0, 0],
            Command::MotorDuty { duty } => word(duty.cast_unsigned()),
            Command::MotorProfile {
                shape,
                amplitude,
                offset,
                period_ms,
                cycles,
            } => {
                let ([a, b], [c, d], [e, f]) = (
                    amplitude.to_le_bytes(),
                    offset.to_le_bytes(),
                    period_ms.to_le_bytes(),
                );
                [shape as u8, a, b, c, d, e, f, cycles]
            }
            Command::MotorLimits {
                max_duty,
                ramp_per_s,
            } => {
                let [a, b] = ramp_per_s.to_le_bytes();
                [max_duty, a, b, 0, 0, 0, 0, 0]
            }
            Command::ReadRegister { gyro, address } => [gyro as u8, address, 0, 0, 0, 0, 0, 0],
            Command::WriteRegister {
                gyro,
                address,
                value,
            } => {
                let [a, b] = value.to_le_bytes();
                [gyro as u8, address, a, b, 0, 0, 0, 0]
            }
            Command::SelfTest { sensor } => [sensor as u8, 0, 0, 0, 0, 0, 0, 0],
        }
    }
}

/// How many argument bytes each command has.
mod arguments;

/// Writes a request as it goes on the line, delimiter included; returns its length.
///
/// # Errors
/// [`EncodeError::BufferTooSmall`] below [`Request::FRAME_LEN`].
pub fn encode_request(request: &Request, out: &mut [u8]) -> Result<usize, EncodeError> {
    let request = fields::Request {
        number: request.number.into(),
        command: request.command.code(),
        arguments: request.command.arguments(),
    };
    write_frame(kind::REQUEST, request.as_bytes(), out)
}
