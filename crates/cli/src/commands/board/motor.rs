//! The motor turns for as long as this program says so: keep-alives go out while it runs, and a stop at its end.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use clap::{Args, ValueEnum};
use imu_stand::link::{KEEP_ALIVE, Link, LinkError, done};
use miette::{IntoDiagnostic, Result};
use serde::Serialize;
use wire::{Command, Frame, Shape, Status};

use super::Session;

/// The board answers each; without an answer for so long it has stopped the motor on its own.
const DEAF: Duration = Duration::from_secs(1);
/// By then the reply to a keep-alive has told why the motor was cut, if its stop was pressed.
const TOLD: Duration = Duration::from_millis(300);
/// How long a ramp down may take.
pub const RAMP_DOWN: Duration = Duration::from_secs(10);

/// Shape of a profile.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ShapeName {
    /// Half a period at offset + amplitude, half at offset - amplitude
    Steps,
    /// Linear from offset - amplitude to offset + amplitude and back
    Triangle,
    /// A sine about the offset
    Sine,
}

/// How the motor is driven.
#[derive(Args)]
pub struct Drive {
    /// Constant command, -255 to 255
    #[arg(long, allow_negative_numbers = true, conflicts_with = "shape",
          value_parser = clap::value_parser!(i16).range(-255..=255))]
    duty: Option<i16>,
    /// Periodic command instead
    #[arg(long, requires = "amplitude", requires = "period_ms")]
    shape: Option<ShapeName>,
    /// Of the profile, 0 to 255
    #[arg(long, value_parser = clap::value_parser!(i16).range(0..=255))]
    amplitude: Option<i16>,
    /// Of the profile, -255 to 255
    #[arg(long, default_value_t = 0, allow_negative_numbers = true,
          value_parser = clap::value_parser!(i16).range(-255..=255))]
    offset: i16,
    /// Of the profile, ms
    #[arg(long)]
    period_ms: Option<u16>,
    /// Periods; 0 for as long as this program runs
    #[arg(long, default_value_t = 0)]
    cycles: u8,
}

/// What `motor` takes.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    drive: Drive,
    /// How long, s; without it until Ctrl-C
    #[arg(long, value_parser = super::super::positive, allow_negative_numbers = true)]
    seconds: Option<f64>,
}

#[derive(Serialize)]
struct Answer {
    format: &'static str,
    duty_asked: Option<i16>,
    duty_after_limits: Option<i32>,
    seconds: f64,
    keep_alives_sent: u32,
    keep_alives_answered: u32,
    largest_pwm_seen: i16,
    smallest_pwm_seen: i16,
    stopped: bool,
}

/// What happened while it ran.
#[derive(Default)]
struct Turning {
    sent: u32,
    answered: u32,
    low: i16,
    high: i16,
    now: i16,
    /// The board cut the motor: the command was there, and is not any more. Since when.
    cut: Option<Instant>,
}

impl Arguments {
    /// What the motor is to do.
    pub fn command(&self) -> Result<Command> {
        match self.drive.command() {
            Some(command) => Ok(command),
            None => misused!(
                help = "write `board motor --duty 100`, or `--shape sine --amplitude 120 --period-ms 5000`",
                "neither duty nor shape"
            ),
        }
    }
}

pub fn run(session: &mut Session, arguments: &Arguments) -> Result<()> {
    let command = arguments.command()?;
    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed)).into_diagnostic()?;

    session.link.arm()?;
    let reply = session.link.ask(command)?;
    let began = Instant::now();
    let mut turning = Turning::default();
    let end = || {
        stop.load(Ordering::Relaxed)
            || arguments
                .seconds
                .is_some_and(|seconds| began.elapsed().as_secs_f64() >= seconds)
    };
    let steady = arguments.drive.duty.filter(|duty| *duty != 0).is_some();
    let turned = turn(session, &mut turning, steady, end);
    // Whatever happened, the motor is told to stop; if the board does not hear it, it stops by itself.
    let stopped = halt(&mut session.link, &mut turning);
    turned?;
    stopped?;
    let answer = Answer {
        format: "imu-stand-motor/1",
        duty_asked: arguments.drive.duty,
        duty_after_limits: arguments.drive.duty.map(|_| reply.value),
        seconds: began.elapsed().as_secs_f64(),
        keep_alives_sent: turning.sent,
        keep_alives_answered: turning.answered,
        largest_pwm_seen: turning.high,
        smallest_pwm_seen: turning.low,
        stopped: turning.now == 0,
    };
    super::super::write_json(session.json.as_ref(), &answer)?;
    if !session.quiet {
        say!(
            "motor ran {:.1} s, command {} .. {}, and stands; {} of {} keep-alives answered",
            answer.seconds,
            turning.low,
            turning.high,
            turning.answered,
            turning.sent
        );
        if let Some(why) = arguments.drive.missed(&turning, answer.seconds) {
            say!("{}", imu_stand::text::item("note: ", &why));
        }
    }
    Ok(())
}

impl Drive {
    /// What of a profile did not come about: the ramp bounds how fast the command moves.
    fn missed(&self, turning: &Turning, seconds: f64) -> Option<String> {
        let (_, amplitude, period_ms) = (self.shape?, self.amplitude?, self.period_ms?);
        let asked = (amplitude + self.offset.abs()).min(255);
        let reached = turning.high.max(-turning.low);
        let whole = seconds * 1e3 > f64::from(period_ms);
        (whole && reached < asked / 2).then(|| {
            format!(
                "the samples show no command beyond {reached}, and the profile asks for {asked}: {period_ms} ms are too short \
                 for the ramp or for the samples; a longer --period-ms, or `imu-stand board set motor-limits`"
            )
        })
    }

    /// The command that starts it, if it is asked for.
    pub fn command(&self) -> Option<Command> {
        if let Some(duty) = self.duty {
            return Some(Command::MotorDuty { duty });
        }
        // clap has seen to it that a shape has an amplitude and a period.
        let (shape, amplitude, period_ms) = (self.shape?, self.amplitude?, self.period_ms?);
        Some(Command::MotorProfile {
            shape: match shape {
                ShapeName::Steps => Shape::Steps,
                ShapeName::Triangle => Shape::Triangle,
                ShapeName::Sine => Shape::Sine,
            },
            amplitude,
            offset: self.offset,
            period_ms,
            cycles: self.cycles,
        })
    }
}

/// Keeps the motor alive until `end`; shows each second what the board does.
fn turn(
    session: &mut Session,
    turning: &mut Turning,
    steady: bool,
    end: impl Fn() -> bool,
) -> Result<()> {
    let quiet = session.quiet;
    let link = &mut session.link;
    let mut last: Option<Instant> = None;
    let (mut answered, mut shown) = (Instant::now(), Instant::now());
    let began = Instant::now();
    while !end() {
        if last.is_none_or(|last| last.elapsed() >= KEEP_ALIVE) {
            link.send(Command::KeepAlive)?;
            turning.sent += 1;
            last = Some(Instant::now());
        }
        if listen(link, turning)? {
            answered = Instant::now();
        }
        if answered.elapsed() > DEAF {
            return Err(LinkError::NotAsAsked {
                what: format!(
                    "the board has not taken a keep-alive for {} s; heard so far: {}",
                    DEAF.as_secs(),
                    link.heard()
                ),
                help:
                    "without keep-alive it stops the motor by itself within 200 ms; check the line"
                        .to_owned(),
            }
            .into());
        }
        if steady && turning.cut.is_some_and(|cut| cut.elapsed() > TOLD) {
            return Err(LinkError::NotAsAsked {
                what: "the board has stopped the motor".to_owned(),
                help: "`imu-stand board health`: motor_timeout says that keep-alives came late, watchdog_reset or \
                       brown_out_reset that the board restarted, which a motor can do to a weak supply"
                    .to_owned(),
            }
            .into());
        }
        if !quiet && shown.elapsed() >= Duration::from_secs(1) {
            shown = Instant::now();
            if let Some(sample) = link.sample {
                eprintln!(
                    "{:>6.0} s  pwm {:>4}  supply {:.3} V",
                    began.elapsed().as_secs_f64(),
                    sample.pwm,
                    f64::from(sample.supply) * imu_stand::capture::SUPPLY_LSB_V
                );
            }
        }
    }
    Ok(())
}

/// Takes what has come; whether a keep-alive was answered.
fn listen(link: &mut Link, turning: &mut Turning) -> Result<bool, LinkError> {
    link.read()?;
    let mut answered = false;
    while let Some(frame) = link.next() {
        match frame {
            Frame::Reply(reply) if reply.command == Command::KeepAlive.code() => {
                match reply.status {
                    Status::Ok => {
                        turning.answered += 1;
                        answered = true;
                    }
                    Status::Stopped => {
                        done(&Command::KeepAlive, reply)?;
                    }
                    _ => {}
                }
            }
            Frame::Sample(sample) => {
                if turning.now != 0 && sample.pwm == 0 {
                    turning.cut.get_or_insert_with(Instant::now);
                }
                turning.now = sample.pwm;
                turning.low = turning.low.min(sample.pwm);
                turning.high = turning.high.max(sample.pwm);
            }
            _ => {}
        }
    }
    Ok(answered)
}

/// Stops the motor at its ramp, and waits until it stands.
fn halt(link: &mut Link, turning: &mut Turning) -> Result<(), LinkError> {
    link.ask(Command::MotorDuty { duty: 0 })?;
    let began = Instant::now();
    let mut samples = 0;
    // A sample that was on its way does not count.
    while samples < 2 && began.elapsed() < RAMP_DOWN {
        link.send(Command::KeepAlive)?;
        let due = Instant::now() + KEEP_ALIVE;
        while Instant::now() < due {
            link.read()?;
            while let Some(frame) = link.next() {
                if let Frame::Sample(sample) = frame {
                    turning.now = sample.pwm;
                    samples = if sample.pwm == 0 { samples + 1 } else { 0 };
                }
            }
        }
    }
    if turning.now == 0 {
        return Ok(());
    }
    Err(LinkError::NotAsAsked {
        what: format!(
            "the motor was told to stop {} s ago and its command still reads {}",
            RAMP_DOWN.as_secs(),
            turning.now
        ),
        help: "cut its supply; then raise the ramp: `imu-stand board set motor-limits --max-duty 255 --ramp 510`".to_owned(),
    })
}
