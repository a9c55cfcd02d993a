//! Bias null: the board averages N samples at rest and subtracts them from then on.

use std::time::{Duration, Instant};

use clap::Args;
use imu_stand::link::{Heard, Link, LinkError, done};
use indicatif::{ProgressBar, ProgressStyle};
use miette::Result;
use serde::Serialize;
use wire::{Command, Frame, Hello, Reply, Sample, flags};

use super::Session;
use super::show::{Q16, Q24, rate_hz};

/// What `bias-null` takes.
#[derive(Args)]
pub struct Arguments {
    /// Samples to average, at most 16384; 600 are half a minute at 20 Hz. At the least eight blocks of 31 ms times the filter's
    /// taps: 24 at 20 Hz and 264 at 256 Hz with four taps
    #[arg(long, default_value_t = 600)]
    samples: u16,
    /// Keep it over resets
    #[arg(long)]
    store: bool,
}

/// Samples without the flag before a request counts as lost, and after it before a reply does.
const WITHOUT: u32 = 10;
/// Silence after which the board is given up.
const SILENCE: Duration = Duration::from_secs(3);
/// Time without a sample in order after which a measurement is given up: the board gives up after 16 samples, and its reply may
/// be lost; at 1 Hz.
const STUCK: Duration = Duration::from_secs(20);
/// How long the sample behind a reply may take, at 1 Hz.
const LAST_WITHIN: Duration = Duration::from_millis(1_500);
/// Requests sent at the most; a further one only where the board does not measure.
const TRIES: u32 = 3;

/// What this end saw of the samples that the board averages.
#[derive(Clone, Copy, Default)]
struct Seen {
    count: u32,
    sum: [f64; 3],
    squares: [f64; 3],
    /// Samples in a row without the flag.
    without: u32,
}

impl Seen {
    fn take(&mut self, sample: &Sample) {
        if sample.flags & flags::BIAS_NULL == 0 {
            self.without += 1;
            return;
        }
        self.without = 0;
        // As the board: only samples in order.
        if sample.flags & !flags::BIAS_NULL != flags::IN_ORDER {
            return;
        }
        self.count += 1;
        for ((sum, squares), gyro) in self.sum.iter_mut().zip(&mut self.squares).zip(sample.gyro) {
            let value = f64::from(gyro);
            *sum += value;
            *squares += value * value;
        }
    }

    /// Standard error of the mean if noise were white, counts.
    fn standard_error(&self, axis: usize) -> Option<f64> {
        let n = f64::from(self.count);
        if self.count < 2 {
            return None;
        }
        let mean = self.sum[axis] / n;
        let variance = (self.squares[axis] / n - mean * mean).max(0.0) * n / (n - 1.0);
        Some((variance / n).sqrt())
    }
}

#[derive(Serialize)]
struct Answer {
    format: &'static str,
    samples: u16,
    samples_seen_here: u32,
    reply_lost: bool,
    bias_before_dps: [f64; 3],
    bias_dps: [f64; 3],
    /// The largest of the three, by the board, which knows of the filter; absent where its reply was lost.
    std_error_dps: Option<f64>,
    std_error_if_white_dps: [Option<f64>; 3],
    stored: bool,
}

pub fn run(session: &mut Session, arguments: &Arguments) -> Result<()> {
    let before = session.link.ask_hello()?;
    let rate = rate_hz(&before).unwrap_or(20.0);
    let bar = if session.quiet {
        ProgressBar::hidden()
    } else {
        ProgressBar::new(u64::from(arguments.samples))
    };
    bar.set_style(
        ProgressStyle::with_template("at rest {bar:40} {pos}/{len} samples, {eta} left")
            .unwrap_or(ProgressStyle::default_bar()),
    );
    let (reply, seen) = measure(session, arguments.samples, rate, &bar)?;
    bar.finish_and_clear();
    let command = Command::BiasNull { samples: 0 };
    let bias = match reply {
        Some(reply) => done(&command, reply)?.detail,
        None => reply_was_lost(session, &before)?,
    };
    if arguments.store {
        session.link.ask(Command::StoreConfig)?;
    }
    let scale = before.scale.map(|s| f64::from(s) / Q24);
    let answer = Answer {
        format: "imu-stand-bias-null/1",
        samples: arguments.samples,
        samples_seen_here: seen.count,
        reply_lost: reply.is_none(),
        bias_before_dps: before.bias.map(|b| f64::from(b) / Q16),
        bias_dps: bias.map(|b| f64::from(b) / Q16),
        std_error_dps: reply.map(|reply| f64::from(reply.value) / Q16),
        std_error_if_white_dps: [0, 1, 2].map(|k| Some(seen.standard_error(k)? * scale[k])),
        stored: arguments.store,
    };
    super::super::write_json(session.json.as_ref(), &answer)?;
    if session.quiet {
        return Ok(());
    }
    show(&answer);
    Ok(())
}

/// The biases, and how sure they are.
fn show(answer: &Answer) {
    say!("         bias deg/s   +- (if the noise is white)   before");
    for (k, axis) in ["x", "y", "z"].iter().enumerate() {
        let error = answer.std_error_if_white_dps[k]
            .map_or_else(|| "?".to_owned(), |error| format!("{error:.5}"));
        say!(
            "gyro {axis}  {:>11.5}   {error:>24}   {:>8.5}",
            answer.bias_dps[k],
            answer.bias_before_dps[k]
        );
    }
    if let Some(error) = answer.std_error_dps {
        say!(
            "standard error, the largest of the three, with what the gyros' filter does to the noise: {error:.5} deg/s"
        );
    }
    if answer.reply_lost {
        say!("the reply was lost; the biases are those of the board's hello frame");
    }
    if answer.stored {
        say!("stored");
    } else {
        say!("until the next reset; `imu-stand board store` keeps it");
    }
}

/// Asks, and follows the samples' flag until the reply comes. `None` where the board has ended and no reply came.
///
/// The flag tells a lost request (it never rises) from a lost reply (it rises and falls), so a measurement that runs
/// is never begun anew.
fn measure(
    session: &mut Session,
    samples: u16,
    rate: f64,
    bar: &ProgressBar,
) -> Result<(Option<Reply>, Seen)> {
    let link = &mut session.link;
    let command = Command::BiasNull { samples };
    let began = link.heard();
    let mut number = link.send(command)?;
    let (mut tries, mut heard, mut counted) = (1, Instant::now(), Instant::now());
    let mut seen = Seen::default();
    // A sample that was on its way when the request arrived has no flag yet.
    let patience = WITHOUT.max((rate * 0.5).ceil() as u32);
    loop {
        if !link.read()?.is_empty() {
            heard = Instant::now();
        }
        while let Some(frame) = link.next() {
            match frame {
                Frame::Reply(reply)
                    if reply.number == number && reply.command == command.code() =>
                {
                    last_sample(link, &mut seen)?;
                    return Ok((Some(reply), seen));
                }
                Frame::Sample(sample) => {
                    let had = seen.count;
                    seen.take(&sample);
                    if seen.count > had || seen.without > 0 {
                        counted = Instant::now();
                    }
                    bar.set_position(u64::from(seen.count));
                }
                _ => {}
            }
        }
        if seen.without > patience {
            if seen.count > 0 {
                return Ok((None, seen));
            }
            if tries == TRIES {
                return Err(no_reply(link, &began, tries, patience, rate).into());
            }
            tries += 1;
            seen.without = 0;
            number = link.send(command)?;
        }
        if counted.elapsed() > STUCK && heard.elapsed() < SILENCE {
            return Err(stuck().into());
        }
        if heard.elapsed() > SILENCE {
            let heard = link.heard().since(&began);
            return Err(LinkError::Unknown {
                command: "bias null",
                help: heard.remedy(link.baud()),
                heard: Box::new(heard),
            }
            .into());
        }
    }
}

fn no_reply(link: &Link, began: &Heard, tries: u32, patience: u32, rate: f64) -> LinkError {
    let heard = link.heard().since(began);
    LinkError::NoReply {
        command: "bias null",
        tries,
        wait_ms: (f64::from(patience) / rate * 1e3) as u128,
        help: heard.remedy(link.baud()),
        heard: Box::new(heard),
    }
}

fn stuck() -> LinkError {
    LinkError::NotAsAsked {
        what: format!(
            "the board measures, but for {} s no sample was in order: a gyro is silent or repeats itself",
            STUCK.as_secs()
        ),
        help:
            "`imu-stand board health` names the gyro; `imu-stand board reboot` ends the measurement"
                .to_owned(),
    }
}

/// The reply leaves the board just before the sample that completed the mean: that one is waited for.
fn last_sample(link: &mut Link, seen: &mut Seen) -> Result<()> {
    let began = Instant::now();
    while began.elapsed() < LAST_WITHIN {
        while let Some(frame) = link.next() {
            if let Frame::Sample(sample) = frame {
                seen.take(&sample);
                return Ok(());
            }
        }
        link.read()?;
    }
    Ok(())
}

/// What the board subtracts now, if that is new.
fn reply_was_lost(session: &mut Session, before: &Hello) -> Result<[i32; 3]> {
    let after = session.link.ask_hello()?;
    if after.bias != before.bias {
        return Ok(after.bias);
    }
    Err(LinkError::NotAsAsked {
        what: "the board has ended the measurement without a new bias, and its reply was lost"
            .to_owned(),
        help: "it breaks off when the stand moves: let it come to rest and repeat the command"
            .to_owned(),
    }
    .into())
}
