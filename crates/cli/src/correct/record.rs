//! A record over a link, with the motor driven meanwhile.

use std::time::Duration;

use model::record::{Base, Record};
use wire::{Command, Corrected, Frame, LinkCounts, Reply, Status};

use crate::RecordBuilder;
use crate::capture::Calibration;
use crate::link::{KEEP_ALIVE, Link, LinkError, done};

/// After how long an answer that arms the motor is asked for again: as long as [`Link`] waits for a reply.
const ASK_AGAIN: Duration = Duration::from_millis(700);

/// What happens in a record.
#[derive(Clone, Debug, PartialEq)]
pub struct Course {
    /// When it begins, by the line's own time; at once where that is over.
    pub from: Duration,
    /// Length, s.
    pub seconds: f64,
    /// Commands of the motor, -255..=255, with their times since the record's begin, s, in order; it turns until the end.
    pub steps: Vec<(f64, i16)>,
    /// What the base does.
    pub base: Base,
}

/// What was recorded.
#[derive(Clone, Debug)]
pub struct Taken {
    /// Its rows.
    pub record: Record,
    /// What else the board said of the rates that it corrected.
    pub corrected: Vec<Corrected>,
    /// What the line did since it was opened.
    pub line: LinkCounts,
}

/// The motor, as far as it has been asked for.
enum Motor {
    Off,
    /// For a nonce, or with it, under this number; when.
    Asked(u16, Duration),
    /// When the last keep-alive went out.
    Alive(Duration),
}

struct Driver<'a> {
    steps: &'a [(f64, i16)],
    motor: Motor,
}

impl Driver<'_> {
    /// Sends what is due `t` s after the begin.
    fn drive(&mut self, link: &mut Link, t: f64) -> Result<(), LinkError> {
        let Some(&(at, duty)) = self.steps.first() else {
            return self.keep_alive(link);
        };
        // Two questions and their answers come first.
        if t < at - 2.0 * ASK_AGAIN.as_secs_f64() {
            return self.keep_alive(link);
        }
        let now = link.now();
        match self.motor {
            Motor::Asked(_, asked) if now.saturating_sub(asked) < ASK_AGAIN => Ok(()),
            Motor::Off | Motor::Asked(..) => {
                let number = link.send(Command::Arm { nonce: 0 })?;
                self.motor = Motor::Asked(number, now);
                Ok(())
            }
            Motor::Alive(_) => {
                if t >= at {
                    link.send(Command::MotorDuty { duty })?;
                    self.steps = &self.steps[1..];
                }
                self.keep_alive(link)
            }
        }
    }

    fn keep_alive(&mut self, link: &mut Link) -> Result<(), LinkError> {
        let now = link.now();
        if let Motor::Alive(last) = self.motor
            && now.saturating_sub(last) >= KEEP_ALIVE
        {
            link.send(Command::KeepAlive)?;
            self.motor = Motor::Alive(now);
        }
        Ok(())
    }

    /// An answer: the nonce, which goes back, or that the motor may turn.
    fn answered(&mut self, link: &mut Link, reply: &Reply) -> Result<(), LinkError> {
        let number = match self.motor {
            Motor::Asked(number, _) => number,
            // A record that wants it turning is none without.
            Motor::Alive(_) if reply.status == Status::Stopped => {
                return done(&Command::KeepAlive, *reply).map(|_| ());
            }
            _ => return Ok(()),
        };
        let command = Command::Arm { nonce: 0 };
        if reply.number != number || reply.command != command.code() {
            return Ok(());
        }
        let now = link.now();
        let told = done(&command, *reply)?;
        self.motor = match told.value {
            // The answer to a nonce that was right tells none.
            0 => Motor::Alive(now),
            nonce => Motor::Asked(
                link.send(Command::Arm {
                    nonce: nonce as u16,
                })?,
                now,
            ),
        };
        Ok(())
    }
}

/// Takes a record; `progress` is told the time since its begin, s. At the end the motor is stopped.
///
/// # Errors
/// [`LinkError`].
pub fn record(
    link: &mut Link,
    course: &Course,
    mut progress: impl FnMut(f64),
) -> Result<Taken, LinkError> {
    let mut builder = RecordBuilder::new(Calibration {
        base: course.base,
        ..Calibration::default()
    });
    builder.hello(&link.ask_hello()?);
    let mut corrected = Vec::new();
    let mut driver = Driver {
        steps: &course.steps,
        motor: Motor::Off,
    };
    let from = link.now().max(course.from);
    loop {
        link.read()?;
        let t = link.now().as_secs_f64() - from.as_secs_f64();
        while let Some(frame) = link.next() {
            match frame {
                Frame::Sample(sample) if t >= 0.0 => builder.push(&sample, t),
                Frame::Corrected(frame) if !builder.is_empty() => {
                    builder.corrected(&frame);
                    corrected.push(frame);
                }
                Frame::Reply(reply) => driver.answered(link, &reply)?,
                _ => {}
            }
        }
        progress(t);
        if t >= course.seconds {
            break;
        }
        driver.drive(link, t)?;
    }
    if matches!(driver.motor, Motor::Alive(_)) {
        link.ask(Command::MotorDuty { duty: 0 })?;
    }
    Ok(Taken {
        record: builder.build(),
        corrected,
        line: link.heard().counts,
    })
}
