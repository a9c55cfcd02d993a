//! How long a reply is waited for, and what may be asked twice.

use std::time::Duration;

use wire::Command;
use wire::correction::ROWS;

/// How long a reply may take: 60 ms of queue at 38400 baud, behind a health and a hello frame.
pub(super) const REPLY_WAIT: Duration = Duration::from_millis(700);
/// How long work on the gyros may take, which is done beside a sample and told with the next: two of them at 1 Hz.
const GYRO_WAIT: Duration = Duration::from_millis(2_700);
/// Setting the gyros up is one such work for each, beside three samples that follow one another.
const SET_GYRO_WAIT: Duration = Duration::from_millis(5_500);
/// A self-test is four such works, and 40 ms.
const SELF_TEST_WAIT: Duration = Duration::from_secs(11);
/// How often a command that may be repeated is sent.
pub(super) const TRIES: u32 = 3;

/// How long a reply is waited for, and how often the request may be sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Patience {
    /// For each try.
    pub wait: Duration,
    /// Tries; 1 where a second one could do harm.
    pub tries: u32,
}

impl Patience {
    /// What is right for a command. A lost reply looks like a lost request, so what must not happen twice is sent once:
    ///
    /// | command | why not twice |
    /// |---|---|
    /// | reboot | the second one hits the board as it starts |
    /// | clear counters | clears what was counted since the first, unseen |
    /// | set baud | the board has left the old speed |
    /// | bias null, self-test | measures anew, or is refused as busy |
    /// | store set-up | overwrites the other copy too: then both are the same |
    /// | CRC of a correction | spoils the other copy, as this one is in use by then |
    /// | motor profile | begins anew |
    /// | arm | a nonce is good for once |
    /// | write register COMMAND | a reset or a flash update, again |
    #[must_use]
    pub fn of(command: &Command) -> Self {
        let once = |wait| Patience { wait, tries: 1 };
        match command {
            Command::Reboot | Command::ClearCounters | Command::SetBaud { .. } => once(REPLY_WAIT),
            // 42 bytes of 8.5 ms; where a byte takes twice that, still.
            Command::StoreConfig => once(Duration::from_secs(2)),
            Command::SelfTest { .. } => once(SELF_TEST_WAIT),
            Command::BiasNull { .. } => once(Duration::from_secs(3)),
            Command::MotorProfile { .. } | Command::Arm { .. } => once(REPLY_WAIT),
            Command::SetCorrection { row, .. } if usize::from(*row) == ROWS => once(REPLY_WAIT),
            Command::SetGyro { .. } => Patience {
                wait: SET_GYRO_WAIT,
                tries: TRIES,
            },
            Command::WriteRegister { address, .. }
                if *address & !1 == adis16250::Register::Command.address() =>
            {
                once(GYRO_WAIT)
            }
            Command::ReadRegister { .. } | Command::WriteRegister { .. } => Patience {
                wait: GYRO_WAIT,
                tries: TRIES,
            },
            _ => Patience {
                wait: REPLY_WAIT,
                tries: TRIES,
            },
        }
    }
}
