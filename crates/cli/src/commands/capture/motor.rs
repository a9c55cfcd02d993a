//! The motor while a capture runs: armed, started, kept alive, and let run down.

use std::time::{Duration, Instant};

use imu_stand::link::{self, Feed};
use miette::Result;
use wire::{Command, Reply};

use super::super::board::motor::{KEEP_ALIVE, RAMP_DOWN};
use super::{ASK, Capture};

/// What the capture does with the motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Motor {
    /// Nothing, or nothing any more.
    Off,
    /// It starts as soon as rows are written.
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

impl Capture<'_> {
    /// Starts the motor once the file is open, and keeps it alive. After a restart of the board, or a port that was gone,
    /// it stays off: nobody may be watching.
    pub(super) fn drive(&mut self, feed: &mut Feed) -> Result<()> {
        match self.motor {
            Motor::Wanted(command) if self.live.is_some() && !feed.is_gone() => {
                let number = feed.link.send(Command::Arm { nonce: 0 })?;
                self.motor = Motor::Arming(command, number, Instant::now());
            }
            Motor::Armed(command, nonce) if !feed.is_gone() => {
                feed.link.send(Command::Arm { nonce })?;
                let number = feed.link.send(command)?;
                self.motor = Motor::Asked(command, number, Instant::now());
            }
            Motor::Arming(command, _, asked) | Motor::Asked(command, _, asked)
                if asked.elapsed() > ASK =>
            {
                self.motor = Motor::Wanted(command);
            }
            Motor::Alive(last) if last.elapsed() >= KEEP_ALIVE && !feed.is_gone() => {
                // A port that fails here is gone for the reader, too.
                let _ = feed.link.send(Command::KeepAlive);
                self.motor = Motor::Alive(Instant::now());
            }
            _ => {}
        }
        Ok(())
    }

    /// A reply: the nonce that arms the motor; to the motor's command it says whether it turns.
    pub(super) fn replied(&mut self, reply: Reply) -> Result<()> {
        let asks = Command::GetCorrection {
            other: false,
            row: 0,
        };
        if reply.command == asks.code() && self.live.is_none() {
            self.corrects = reply.status == wire::Status::Ok && reply.value != 0;
        }
        if let Motor::Arming(command, number, _) = self.motor
            && reply.number == number
        {
            link::done(&Command::Arm { nonce: 0 }, reply)?;
            self.motor = Motor::Armed(command, reply.value as u16);
        }
        if let Motor::Asked(command, number, _) = self.motor
            && reply.number == number
            && reply.command == command.code()
        {
            link::done(&command, reply)?;
            self.motor = Motor::Alive(Instant::now());
            self.tell("the motor is driven")?;
        }
        Ok(())
    }

    pub(super) fn motor_is_off(&mut self) -> Result<()> {
        if matches!(self.motor, Motor::Alive(_) | Motor::Asked(..)) {
            self.motor = Motor::Off;
            self.tell("the motor stays off from here on")?;
        }
        Ok(())
    }

    /// Lets the motor run down, at its ramp, and captures that, too.
    pub(super) fn halt(&mut self, feed: &mut Feed) -> Result<()> {
        if !matches!(self.motor, Motor::Alive(_)) {
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
