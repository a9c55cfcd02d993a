//! A run: a scenario, how long, and what the host asks meanwhile. Both drivers take one and give serial bytes.

use rand_xoshiro::Xoshiro256PlusPlus;
use wire::{Command, Request};

use crate::random::{Stream, uniform};
use crate::{Fault, Scenario};

/// A byte that the host has received.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SerialByte {
    /// End of its stop bit, s since power came on.
    pub time_s: f64,
    /// The byte.
    pub byte: u8,
}

/// A request and when the host begins to send it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimedRequest {
    /// Microseconds since power came on.
    pub at_us: u64,
    /// What it asks.
    pub request: Request,
}

/// A scenario, how long, and what the host asks meanwhile.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// The stand.
    pub scenario: Scenario,
    /// Length, s since power came on.
    pub seconds: f64,
    /// Requests in the order of their times.
    pub requests: Vec<TimedRequest>,
}

/// Why a run has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// Its time is over.
    Complete,
    /// The receiver wanted no more.
    Stopped,
}

/// Keeps the motor alive: well within the board's 200 ms.
const KEEP_ALIVE_US: u64 = 100_000;

/// Requests that drive the motor by `steps` of (time s, duty -255..=255), with keep-alives from the first step to the
/// end of the run at `seconds`.
#[must_use]
pub fn duty_profile(steps: &[(f64, i16)], seconds: f64) -> Vec<TimedRequest> {
    let us = |s: f64| (s * 1e6) as u64;
    let mut commands: Vec<(u64, Command)> = Vec::new();
    if let Some(&(first, _)) = steps.first() {
        commands.extend(
            (us(first)..us(seconds))
                .step_by(KEEP_ALIVE_US as usize)
                .map(|at| (at, Command::KeepAlive)),
        );
    }
    // 20 ms behind the keep-alive of the same time: a request takes 5 ms on the line.
    commands.extend(
        steps
            .iter()
            .map(|&(at, duty)| (us(at) + 20_000, Command::MotorDuty { duty })),
    );
    commands.sort_by_key(|&(at, _)| at);
    commands
        .into_iter()
        .zip(0u64..)
        .map(|((at_us, command), number)| TimedRequest {
            at_us,
            request: Request {
                number: number as u16,
                command,
            },
        })
        .collect()
}

/// The cable: loses bytes where the scenario says so.
pub(crate) struct Cable {
    losses: Vec<f64>,
}

impl Cable {
    pub fn new(scenario: &Scenario) -> Self {
        let rng: &mut Xoshiro256PlusPlus = &mut Stream::Link.of(scenario.seed);
        let mut losses = Vec::new();
        for fault in &scenario.faults {
            if let Fault::LossyLine { count } = *fault {
                losses.extend((0..count).map(|_| uniform(rng, 1.0, scenario.seconds.max(1.0))));
            }
        }
        losses.sort_by(|a, b| b.total_cmp(a));
        Cable { losses }
    }

    /// What arrives of a byte: the first one after each loss's time is gone.
    pub fn carry(&mut self, byte: SerialByte) -> Option<SerialByte> {
        if self.losses.last().is_some_and(|&time| time <= byte.time_s) {
            self.losses.pop();
            return None;
        }
        Some(byte)
    }
}
