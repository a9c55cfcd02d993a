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

/// In a planned request: the nonce that the board has told by then.
pub const TOLD_NONCE: u16 = u16::MAX;
/// From the question for the nonce to the answer with it, and from there to the first keep-alive: a reply takes no longer.
const ARM_STEP_US: u64 = 90_000;

/// The two requests that arm the motor, the first at `at_us`; after the second, 90 ms later, keep-alives are due.
#[must_use]
pub fn arming(at_us: u64, number: u16) -> [TimedRequest; 2] {
    [(0, 0), (1, TOLD_NONCE)].map(|(step, nonce)| TimedRequest {
        at_us: at_us + step * ARM_STEP_US,
        request: Request {
            number: number.wrapping_add(step as u16),
            command: Command::Arm { nonce },
        },
    })
}

/// The request with the nonce that the board told, where it asks for that.
pub(crate) fn with_nonce(request: Request, nonce: u16) -> Request {
    match request.command {
        Command::Arm { nonce: TOLD_NONCE } => Request {
            command: Command::Arm { nonce },
            ..request
        },
        _ => request,
    }
}

/// Requests that drive the motor by `steps` of (time s, duty -255..=255), with keep-alives from the first step to the
/// end of the run at `seconds`, and armed before the first step, which is at 0.6 s at the earliest.
#[must_use]
pub fn duty_profile(steps: &[(f64, i16)], seconds: f64) -> Vec<TimedRequest> {
    let us = |s: f64| (s * 1e6) as u64;
    let mut commands: Vec<(u64, Command)> = Vec::new();
    if let Some(&(first, _)) = steps.first() {
        let armed = arming(us(first).saturating_sub(2 * ARM_STEP_US), 0);
        commands.extend(armed.map(|timed| (timed.at_us, timed.request.command)));
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
