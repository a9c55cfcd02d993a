//! What can go wrong with a board on a line, and what to do about it.

use wire::{Command, Status};

use super::Heard;

/// A board that cannot be asked, or says no.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
#[non_exhaustive]
pub enum LinkError {
    /// The port cannot be opened.
    #[error("cannot open {port}: {why}")]
    #[diagnostic(code(link::open), help("{help}"))]
    Open {
        /// The port's name.
        port: String,
        /// What the system says.
        why: String,
        /// What to do.
        help: String,
    },
    /// The port was there and is gone.
    #[error("{port} is gone: {why}")]
    #[diagnostic(
        code(link::gone),
        help(
            "plug the adapter in again and repeat the command; `capture` waits for a port to come back"
        )
    )]
    Gone {
        /// The port's name.
        port: String,
        /// What the system says.
        why: String,
    },
    /// No reply, and it is certain or harmless that the command was not carried out.
    #[error("no reply to `{command}` in {tries} tries of {wait_ms} ms; heard meanwhile: {heard}")]
    #[diagnostic(code(link::no_reply), help("{help}"))]
    NoReply {
        /// The command.
        command: &'static str,
        /// How often it was sent.
        tries: u32,
        /// How long each reply was waited for, ms.
        wait_ms: u128,
        /// What came instead.
        heard: Box<Heard>,
        /// What to do.
        help: String,
    },
    /// No reply to a command that must not be sent twice.
    #[error(
        "no reply to `{command}`: whether the board has carried it out is not known; heard meanwhile: {heard}"
    )]
    #[diagnostic(code(link::unknown), help("{help}"))]
    Unknown {
        /// The command.
        command: &'static str,
        /// What came instead.
        heard: Box<Heard>,
        /// What to do.
        help: String,
    },
    /// The board says no.
    #[error("the board refuses `{command}`: {}", why(*.code, *.status))]
    #[diagnostic(code(link::refused), help("{}", remedy(*.code, *.status)))]
    Refused {
        /// The command.
        command: &'static str,
        /// Its code on the wire.
        code: u8,
        /// Why.
        status: Status,
    },
    /// The board answered, and something else than it should have.
    #[error("{what}")]
    #[diagnostic(code(link::not_as_asked), help("{help}"))]
    NotAsAsked {
        /// What was found and what was expected.
        what: String,
        /// What to do.
        help: String,
    },
}

/// The command's name as docs/wire-format.md has it.
#[must_use]
pub const fn name(command: &Command) -> &'static str {
    match command {
        Command::Ping => "ping",
        Command::GetHello => "get hello",
        Command::KeepAlive => "keep-alive",
        Command::Counters => "counters",
        Command::ClearCounters => "clear counters",
        Command::Reboot => "reboot",
        Command::SetRate { .. } => "set rate",
        Command::SetBaud { .. } => "set baud",
        Command::SetGyro { .. } => "set gyro",
        Command::SetAccRange { .. } => "set accelerometer range",
        Command::BiasNull { .. } => "bias null",
        Command::SetBias { .. } => "set bias",
        Command::SetScale { .. } => "set scale",
        Command::SetCorrection { .. } => "set correction",
        Command::Correction { .. } => "correction",
        Command::GetCorrection { .. } => "get correction",
        Command::MotorDuty { .. } => "motor duty",
        Command::MotorProfile { .. } => "motor profile",
        Command::MotorLimits { .. } => "motor limits",
        Command::Arm { .. } => "arm motor",
        Command::ReadRegister { .. } => "read register",
        Command::WriteRegister { .. } => "write register",
        Command::SelfTest { .. } => "self-test",
        Command::StoreConfig => "store set-up",
        Command::LoadConfig => "load set-up",
        Command::DefaultConfig => "built-in set-up",
        Command::SetBoardId { .. } => "set board id",
    }
}

/// A status in words.
#[must_use]
pub const fn words(status: Status) -> &'static str {
    match status {
        Status::Ok => "done",
        Status::UnknownCommand => "it does not know this command",
        Status::Unsupported => "its firmware lacks this command",
        Status::BadArgument => "an argument is out of range",
        Status::Busy => "it is still busy with another command",
        Status::Moving => "the stand moves",
        Status::NotAnswering => "the sensor does not answer, or says that something is wrong",
        Status::ReadBackWrong => "the sensor does not read back what was written",
        Status::SelfTestFailed => "the self-test failed",
        Status::NoKeepAlive => "the motor is not armed, or keep-alive came late",
        Status::NotStored => "the EEPROM does not read back what was written",
        Status::NoConfig => "no stored set-up passes its check",
        Status::Aborted => "another command broke it off",
        Status::Stopped => "the motor's stop is pressed, or was since it was armed",
    }
}

/// A refusal in words.
const fn why(code: u8, status: Status) -> &'static str {
    match status {
        Status::NoConfig if code == wire::code::CORRECTION => {
            "no stored correction passes its check"
        }
        status => words(status),
    }
}

/// What to do about a refusal.
fn remedy(code: u8, status: Status) -> &'static str {
    let is = |command: Command| command.code() == code;
    match status {
        Status::UnknownCommand | Status::Unsupported => {
            "`imu-stand board info` shows the firmware's version; `imu-stand flash` writes a newer one"
        }
        Status::BadArgument if code == wire::code::SET_RATE => {
            "the board samples at 1 Hz to 256 Hz; see docs/wire-format.md"
        }
        Status::BadArgument
            if is(Command::SetGyro {
                range: 0,
                filter: 0,
            }) =>
        {
            "320 deg/s takes --filter 0 to 6, 160 deg/s 2 to 6, 80 deg/s 4 to 6: the part wants the taps"
        }
        Status::BadArgument if is(Command::BiasNull { samples: 0 }) => "average 1 to 16384 samples",
        Status::BadArgument => "`imu-stand board --help` and docs/wire-format.md give the ranges",
        Status::Busy => "wait for the bias null, self-test or store that is running, then repeat",
        Status::Moving => {
            "let the table come to rest with the motor off; a bias is measured on a stand that does not move"
        }
        Status::NotAnswering | Status::ReadBackWrong => {
            "`imu-stand board health` counts which gyro; check its supply, chip select and wiring (docs/hardware.md)"
        }
        Status::SelfTestFailed => {
            "repeat it at rest; if it fails again the part is damaged or its supply is out of range"
        }
        Status::NoKeepAlive => {
            "use `imu-stand board motor`, which arms the motor and keeps it alive"
        }
        Status::NotStored => {
            "repeat it with a steady supply; if it fails again the EEPROM is worn out"
        }
        Status::NoConfig if code == wire::code::CORRECTION => {
            "`board correct --model model.toml` writes one"
        }
        Status::NoConfig => "`board set` what you need, then `board store`",
        Status::Stopped => {
            "see that nothing can be hurt, let go of the stop (PD2, pin 16, to ground), then start the motor anew; where nobody \
             presses one look for a wire at PD2 (docs/hardware.md)"
        }
        Status::Aborted | Status::Ok => "repeat the command",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refusal_says_what_and_what_to_do() {
        let error = LinkError::Refused {
            command: "set rate",
            code: wire::code::SET_RATE,
            status: Status::BadArgument,
        };
        assert_eq!(
            error.to_string(),
            "the board refuses `set rate`: an argument is out of range"
        );
        let help = miette::Diagnostic::help(&error).unwrap().to_string();
        assert!(help.contains("1 Hz to 256 Hz"), "{help}");
    }
}
