//! What the PC asks of the board.

use crate::cobs::{Reader, Writer};
use crate::frame::write_frame;
use crate::{EncodeError, OVERHEAD, kind};

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
        /// Timer ticks of [`Hello::tick_ns`](crate::Hello::tick_ns).
        period_ticks: u16,
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
    /// Ends a profile and turns the motor at a constant command.
    MotorDuty {
        /// -255 ..= 255.
        duty: i16,
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
    pub const LEN: usize = 13;
    /// Bytes on the line.
    pub const FRAME_LEN: usize = Self::LEN + OVERHEAD;
}

/// Bytes that every request has for arguments; unused ones, at the end, are 0.
const ARGUMENTS: u8 = 8;

impl Command {
    /// The code on the wire.
    #[must_use]
    pub const fn code(&self) -> u8 {
        match self {
            Command::Ping => 1,
            Command::GetHello => 2,
            Command::KeepAlive => 3,
            Command::Counters => 4,
            Command::ClearCounters => 5,
            Command::Reboot => 6,
            Command::SetRate { .. } => 16,
            Command::SetBaud { .. } => 17,
            Command::SetGyro { .. } => 18,
            Command::SetAccRange { .. } => 19,
            Command::BiasNull { .. } => 32,
            Command::SetBias { .. } => 33,
            Command::SetScale { .. } => 34,
            Command::MotorDuty { .. } => 48,
            Command::MotorProfile { .. } => 49,
            Command::MotorLimits { .. } => 50,
            Command::ReadRegister { .. } => 64,
            Command::WriteRegister { .. } => 65,
            Command::SelfTest { .. } => 66,
            Command::StoreConfig => 80,
            Command::LoadConfig => 81,
            Command::DefaultConfig => 82,
            Command::SetBoardId { .. } => 83,
        }
    }

    /// Writes the arguments; returns how many bytes they took.
    fn write(&self, writer: &mut Writer<'_>) -> u8 {
        match *self {
            Command::Ping
            | Command::GetHello
            | Command::KeepAlive
            | Command::Counters
            | Command::ClearCounters
            | Command::Reboot
            | Command::StoreConfig
            | Command::LoadConfig
            | Command::DefaultConfig => 0,
            Command::SetRate {
                period_ticks: value,
            }
            | Command::SetBaud { divisor: value }
            | Command::BiasNull { samples: value }
            | Command::SetBoardId { board_id: value } => {
                writer.u16(value);
                2
            }
            Command::SetGyro { range, filter } => {
                writer.u8(range);
                writer.u8(filter);
                2
            }
            Command::SetAccRange { range } => {
                writer.u8(range);
                1
            }
            Command::SetBias { axis, value } | Command::SetScale { axis, value } => {
                writer.u8(axis as u8);
                writer.i32(value);
                5
            }
            Command::MotorDuty { duty } => {
                writer.i16(duty);
                2
            }
            Command::MotorProfile {
                shape,
                amplitude,
                offset,
                period_ms,
                cycles,
            } => {
                writer.u8(shape as u8);
                writer.i16(amplitude);
                writer.i16(offset);
                writer.u16(period_ms);
                writer.u8(cycles);
                8
            }
            Command::MotorLimits {
                max_duty,
                ramp_per_s,
            } => {
                writer.u8(max_duty);
                writer.u16(ramp_per_s);
                3
            }
            Command::ReadRegister { gyro, address } => {
                writer.u8(gyro as u8);
                writer.u8(address);
                2
            }
            Command::WriteRegister {
                gyro,
                address,
                value,
            } => {
                writer.u8(gyro as u8);
                writer.u8(address);
                writer.u16(value);
                4
            }
            Command::SelfTest { sensor } => {
                writer.u8(sensor as u8);
                1
            }
        }
    }

    /// The command of a code and its arguments, or why there is none: [`Status::UnknownCommand`] or
    /// [`Status::BadArgument`].
    pub(crate) fn read(code: u8, reader: &mut Reader<'_>) -> Result<Self, Status> {
        const BAD: Status = Status::BadArgument;
        let mut byte = || reader.u8().ok_or(BAD);
        let command = match code {
            1 => Command::Ping,
            2 => Command::GetHello,
            3 => Command::KeepAlive,
            4 => Command::Counters,
            5 => Command::ClearCounters,
            6 => Command::Reboot,
            16 => Command::SetRate {
                period_ticks: reader.u16().ok_or(BAD)?,
            },
            17 => Command::SetBaud {
                divisor: reader.u16().ok_or(BAD)?,
            },
            18 => Command::SetGyro {
                range: byte()?,
                filter: byte()?,
            },
            19 => Command::SetAccRange { range: byte()? },
            32 => Command::BiasNull {
                samples: reader.u16().ok_or(BAD)?,
            },
            33 => Command::SetBias {
                axis: Axis::from_code(byte()?).ok_or(BAD)?,
                value: reader.i32().ok_or(BAD)?,
            },
            34 => Command::SetScale {
                axis: Axis::from_code(byte()?).ok_or(BAD)?,
                value: reader.i32().ok_or(BAD)?,
            },
            48 => Command::MotorDuty {
                duty: reader.i16().ok_or(BAD)?,
            },
            49 => Command::MotorProfile {
                shape: Shape::from_code(byte()?).ok_or(BAD)?,
                amplitude: reader.i16().ok_or(BAD)?,
                offset: reader.i16().ok_or(BAD)?,
                period_ms: reader.u16().ok_or(BAD)?,
                cycles: reader.u8().ok_or(BAD)?,
            },
            50 => Command::MotorLimits {
                max_duty: byte()?,
                ramp_per_s: reader.u16().ok_or(BAD)?,
            },
            64 => Command::ReadRegister {
                gyro: Axis::from_code(byte()?).ok_or(BAD)?,
                address: byte()?,
            },
            65 => Command::WriteRegister {
                gyro: Axis::from_code(byte()?).ok_or(BAD)?,
                address: byte()?,
                value: reader.u16().ok_or(BAD)?,
            },
            66 => Command::SelfTest {
                sensor: Sensor::from_code(byte()?).ok_or(BAD)?,
            },
            80 => Command::StoreConfig,
            81 => Command::LoadConfig,
            82 => Command::DefaultConfig,
            83 => Command::SetBoardId {
                board_id: reader.u16().ok_or(BAD)?,
            },
            _ => return Err(Status::UnknownCommand),
        };
        // What is left over is unused, and must say so: it may come to mean something.
        while let Some(unused) = reader.u8() {
            if unused != 0 {
                return Err(BAD);
            }
        }
        Ok(command)
    }
}

/// Writes a request as it goes on the line, delimiter included; returns its length.
///
/// # Errors
/// [`EncodeError::BufferTooSmall`] below [`Request::FRAME_LEN`].
pub fn encode_request(request: &Request, out: &mut [u8]) -> Result<usize, EncodeError> {
    write_frame(out, kind::REQUEST, Request::FRAME_LEN, |writer| {
        writer.u16(request.number);
        writer.u8(request.command.code());
        let used = request.command.write(writer);
        for _ in used..ARGUMENTS {
            writer.u8(0);
        }
    })
}
