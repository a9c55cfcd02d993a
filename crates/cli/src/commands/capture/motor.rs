//! The motor while a capture runs: started once the file is open, kept alive, and let run down.

use std::time::{Duration, Instant};

use imu_stand::link::{Feed, LinkError, Motor};
use miette::Result;
use wire::{Command, Reply, Status};

use super::super::board::motor::RAMP_DOWN;
use super::Capture;

impl Capture<'_> {
    /// Starts the motor once the file is open, and keeps it alive. After a restart of the board, or a port that was gone,
    /// it stays off: nobody may be watching.
    pub(super) fn drive(&mut self, feed: &mut Feed) -> Result<()> {
        let waits = matches!(self.motor, Motor::Wanted(_)) && self.live.is_none();
        if !waits && !feed.is_gone() {
            self.motor.drive(&mut feed.link)?;
        }
        Ok(())
    }

    /// A reply to what was asked at the start, or of the motor.
    pub(super) fn replied(&mut self, reply: Reply) -> Result<()> {
        let asks = Command::GetCorrection {
            other: false,
            row: 0,
        };
        if reply.command == asks.code() && self.live.is_none() {
            self.corrects = reply.status == Status::Ok && reply.value != 0;
        }
        let turned = self.motor.is_alive();
        match self.motor.replied(&reply) {
            Ok(true) => self.remark("the motor is driven"),
            // What the sensors say is in no doubt: the capture goes on.
            Err(LinkError::Refused {
                status: Status::Stopped,
                ..
            }) if turned => self.tell("the motor's stop was pressed: it stays off from here on"),
            other => Ok(other.map(|_| ())?),
        }
    }

    pub(super) fn motor_is_off(&mut self) -> Result<()> {
        if self.motor.may_turn() {
            self.motor = Motor::Off;
            self.tell("the motor stays off from here on")?;
        }
        Ok(())
    }

    /// Lets the motor run down, at its ramp, and captures that, too.
    pub(super) fn halt(&mut self, feed: &mut Feed) -> Result<()> {
        if !self.motor.is_alive() {
            return Ok(());
        }
        let began = Instant::now();
        let mut stood = None;
        // Asked again and again: a request may be lost. Two samples later than the first at 0 it stands.
        while began.elapsed() < RAMP_DOWN {
            feed.link.send(Command::MotorDuty { duty: 0 })?;
            let until = Instant::now() + Duration::from_millis(300);
            self.listen(feed, |_| Instant::now() >= until)?;
            let stands = feed.link.sample.is_some_and(|sample| sample.pwm == 0);
            if stands && stood.replace(()).is_some() {
                break;
            }
        }
        Ok(())
    }
}
