//! The motor of a board that is listened to: armed, started and kept alive beside what else the line brings.

use std::time::{Duration, Instant};

use wire::{Command, Reply, Status, code};

use super::{Link, LinkError, done};

/// From keep-alive to keep-alive: three fit into the 200 ms that the board waits.
pub const KEEP_ALIVE: Duration = Duration::from_millis(60);
/// From one request to the next where no reply comes.
const ASK: Duration = Duration::from_secs(2);

/// How far it is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Motor {
    /// Nothing, or nothing any more.
    #[default]
    Off,
    /// It starts with the next [`drive`](Self::drive).
    Wanted(Command),
    /// A nonce was asked for under this number; when.
    Arming(Command, u16, Instant),
    /// The nonce has come.
    Armed(Command, u16),
    /// It was asked for under this number; when.
    Asked(Command, u16, Instant),
    /// It turns; when the last keep-alive went out.
    Alive(Instant),
}

impl Motor {
    /// Whether it turns, or may soon.
    #[must_use]
    pub fn may_turn(&self) -> bool {
        matches!(self, Motor::Alive(_) | Motor::Asked(..))
    }

    /// Whether it turns and is kept alive.
    #[must_use]
    pub fn is_alive(&self) -> bool {
        matches!(self, Motor::Alive(_))
    }

    /// Does what is due. To be called several times between two keep-alives ([`KEEP_ALIVE`]) while the port is open.
    ///
    /// # Errors
    /// [`LinkError::Gone`] where a start cannot be sent. A keep-alive that cannot is the reader's to notice.
    pub fn drive(&mut self, link: &mut Link) -> Result<(), LinkError> {
        match *self {
            Motor::Wanted(command) => {
                let number = link.send(Command::Arm { nonce: 0 })?;
                *self = Motor::Arming(command, number, Instant::now());
            }
            Motor::Armed(command, nonce) => {
                link.send(Command::Arm { nonce })?;
                let number = link.send(command)?;
                *self = Motor::Asked(command, number, Instant::now());
            }
            Motor::Arming(command, _, asked) | Motor::Asked(command, _, asked)
                if asked.elapsed() > ASK =>
            {
                *self = Motor::Wanted(command);
            }
            Motor::Alive(last) if last.elapsed() >= KEEP_ALIVE => {
                let _ = link.send(Command::KeepAlive);
                *self = Motor::Alive(Instant::now());
            }
            _ => {}
        }
        Ok(())
    }

    /// A reply: the nonce that arms it; to its command it says whether it turns; to a keep-alive, whether its stop was pressed,
    /// after which it is off. True where it turns from now on.
    ///
    /// # Errors
    /// [`LinkError::Refused`].
    pub fn replied(&mut self, reply: &Reply) -> Result<bool, LinkError> {
        match *self {
            Motor::Arming(command, number, _) if reply.number == number => {
                done(&Command::Arm { nonce: 0 }, *reply)?;
                *self = Motor::Armed(command, reply.value as u16);
                Ok(false)
            }
            Motor::Asked(command, number, _)
                if reply.number == number && reply.command == command.code() =>
            {
                done(&command, *reply)?;
                *self = Motor::Alive(Instant::now());
                Ok(true)
            }
            Motor::Alive(_)
                if reply.command == code::KEEP_ALIVE && reply.status == Status::Stopped =>
            {
                *self = Motor::Off;
                done(&Command::KeepAlive, *reply)?;
                Ok(false)
            }
            _ => Ok(false),
        }
    }
}
