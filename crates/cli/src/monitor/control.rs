//! What a live view may do to the board: turn the motor for as long as somebody watches, stop it, null the bias.

use std::time::{Duration, Instant};

use wire::{Command, Frame, Reply, flags};

use crate::link::{Link, LinkError, Motor, done};

/// From request to request that the motor stop; one may be lost.
const STOP_AGAIN: Duration = Duration::from_millis(300);
/// The board's numbers of a bias are Q16: deg/s a count.
const Q16: f64 = 65_536.0;
/// A bias null whose flag does not show for so long was not heard, or is over and its reply was lost.
const NO_FLAG: Duration = Duration::from_secs(3);

/// What is asked of the board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// Turn at a constant command, -255 to 255.
    Motor(i16),
    /// Let the motor run down. Needs no confirmation.
    Stop,
    /// Average so many samples at rest and subtract them from then on.
    BiasNull(u16),
}

impl Action {
    /// What is about to happen, as a question.
    #[must_use]
    pub fn question(self) -> String {
        match self {
            Action::Motor(duty) => format!("turn the motor at {duty} of 255?"),
            Action::Stop => "stop the motor?".to_owned(),
            Action::BiasNull(samples) => {
                format!("null the bias over {samples} samples? The table must stand still")
            }
        }
    }
}

/// Carries it out, a step each time that frames have been read.
#[derive(Default)]
pub struct Control {
    motor: Motor,
    /// Since when the motor is to stand, and when it was last told so.
    stopping: Option<Instant>,
    /// Number of the request for a bias null, and when it was last known to run.
    null: Option<(u16, Instant)>,
    said: String,
}

impl Control {
    /// What happened last, in words.
    #[must_use]
    pub fn said(&self) -> &str {
        &self.said
    }

    /// Whether the motor turns by what was asked here.
    #[must_use]
    pub fn turns(&self) -> bool {
        self.motor != Motor::Off
    }

    /// Begins. What is confirmed by a person is whoever calls' to see to.
    ///
    /// # Errors
    /// [`LinkError::Gone`].
    pub fn act(&mut self, action: Action, link: &mut Link) -> Result<(), LinkError> {
        match action {
            Action::Motor(0) | Action::Stop => {
                self.said = "the motor is told to stop".to_owned();
                self.stop(link)?;
            }
            Action::Motor(_) if self.null.is_some() => {
                self.said = "a bias null runs: the table must stand still".to_owned();
            }
            Action::Motor(duty) => {
                self.stopping = None;
                self.motor = Motor::Wanted(Command::MotorDuty { duty });
                self.said = format!("the motor is armed for {duty}");
            }
            Action::BiasNull(_) if self.turns() => {
                self.said = "stop the motor first: a bias is nulled at rest".to_owned();
            }
            Action::BiasNull(samples) => {
                let number = link.send(Command::BiasNull { samples })?;
                self.null = Some((number, Instant::now()));
                self.said = format!("bias null over {samples} samples; leave the table alone");
            }
        }
        Ok(())
    }

    fn stop(&mut self, link: &mut Link) -> Result<(), LinkError> {
        self.stopping = Some(Instant::now());
        link.send(Command::MotorDuty { duty: 0 }).map(drop)
    }

    /// Does what is due, several times within 60 ms.
    ///
    /// # Errors
    /// [`LinkError::Gone`].
    pub fn drive(&mut self, link: &mut Link) -> Result<(), LinkError> {
        if self
            .stopping
            .is_some_and(|told| told.elapsed() > STOP_AGAIN)
        {
            self.stop(link)?;
        }
        if self.null.is_some_and(|(_, seen)| seen.elapsed() > NO_FLAG) {
            self.null = None;
            self.said =
                "the bias null was not heard, or its reply was lost: `board info` shows the bias"
                    .to_owned();
        }
        self.motor.drive(link)
    }

    /// What the board sends.
    pub fn take(&mut self, frame: &Frame) {
        match frame {
            Frame::Sample(sample) => {
                if sample.pwm == 0 && self.stopping.take().is_some() {
                    self.motor = Motor::Off;
                    self.said = "the motor stands".to_owned();
                }
                if let Some((_, seen)) = &mut self.null
                    && sample.flags & flags::BIAS_NULL != 0
                {
                    *seen = Instant::now();
                }
            }
            Frame::Reply(reply) => self.replied(reply),
            _ => {}
        }
    }

    fn replied(&mut self, reply: &Reply) {
        match self.motor.replied(reply) {
            Ok(true) => self.said = "the motor turns; s stops it".to_owned(),
            Ok(false) => {}
            Err(error) => {
                self.motor = Motor::Off;
                self.said = error.to_string();
            }
        }
        if self.null.is_none_or(|(number, _)| number != reply.number) {
            return;
        }
        self.null = None;
        self.said = match done(&Command::BiasNull { samples: 0 }, *reply) {
            Ok(reply) => {
                let [x, y, z] = reply.detail.map(|bias| f64::from(bias) / Q16);
                format!(
                    "bias nulled: {x:.4}, {y:.4}, {z:.4} deg/s, until the next reset (`board store` keeps it)"
                )
            }
            Err(error) => error.to_string(),
        };
    }

    /// The port was gone, or the board restarted: the motor stays off, nobody may be watching.
    pub fn interrupted(&mut self) {
        if self.turns() {
            self.said = "the motor stays off: the line was interrupted".to_owned();
        }
        (self.motor, self.stopping, self.null) = (Motor::Off, None, None);
    }

    /// Whether nothing is left to be done.
    #[must_use]
    pub fn is_at_rest(&self) -> bool {
        !self.turns() && self.stopping.is_none()
    }
}
