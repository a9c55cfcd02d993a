//! `imu-stand board bring-up`: a new board, checked step by step, and one page of what was found.

mod hand;

use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::Duration;

use adis16250::Register;
use clap::Args;
use imu_stand::capture::SUPPLY_LSB_V;
use imu_stand::link::{Link, words};
use miette::Result;
use serde::Serialize;
use wire::{Axis, Command, Frame, Health, Hello, Sample, Sensor, Status, flags};

use super::super::flash::{self, Programmer};
use super::Session;
use super::show::{Info, rate_hz};
use hand::by_hand;

/// What `bring-up` takes.
#[derive(Args)]
pub struct Arguments {
    /// The page to write, Markdown
    #[arg(long, value_name = "FILE", default_value = "bring-up.md")]
    out: PathBuf,
    /// Read the fuses by this programmer, as `avrdude -c` has it
    #[arg(long, short = 'c', value_name = "NAME")]
    programmer: Option<String>,
    /// Where the programmer is, as `avrdude -P` has it
    #[arg(long, short = 'P', value_name = "PORT", requires = "programmer")]
    programmer_port: Option<String>,
    /// The program to call for it
    #[arg(long, default_value = "avrdude", value_name = "PATH")]
    avrdude: PathBuf,
    /// Leave out what a hand has to do: the motor's stop, the sign of each gyro, the six sides
    #[arg(long)]
    no_hand: bool,
    /// How long what a hand has to do is waited for, s
    #[arg(long, default_value_t = 120.0, value_parser = super::super::positive)]
    within: f64,
}

impl Arguments {
    /// The page.
    pub fn out(&self) -> &PathBuf {
        &self.out
    }
}

/// How a step ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
enum Verdict {
    Ok,
    Wrong,
    NotDone,
}

impl Verdict {
    fn words(self) -> &'static str {
        match self {
            Verdict::Ok => "ok",
            Verdict::Wrong => "**wrong**",
            Verdict::NotDone => "not done",
        }
    }
}

/// A step.
#[derive(Clone, Debug, Serialize)]
struct Step {
    what: String,
    found: String,
    expected: String,
    verdict: Verdict,
}

fn step(what: &str, found: impl Into<String>, expected: &str, is_ok: bool) -> Step {
    Step {
        what: what.to_owned(),
        found: found.into(),
        expected: expected.to_owned(),
        verdict: if is_ok { Verdict::Ok } else { Verdict::Wrong },
    }
}

#[derive(Serialize)]
struct Answer<'a> {
    format: &'static str,
    steps: &'a [Step],
    wrong: usize,
    not_done: usize,
    page: String,
}

const AXES: [(Axis, &str); 3] = [(Axis::X, "x"), (Axis::Y, "y"), (Axis::Z, "z")];
/// The supply that the gyros want, V (ADIS16250 data sheet).
const SUPPLY_V: [f64; 2] = [4.75, 5.25];
/// How long the line is listened to, s.
const LISTEN_S: f64 = 5.0;
/// The crystal, and what the host's clock may be off over some seconds, ppm.
const CLOCK_PPM: f64 = 2_000.0;

/// Registers that are read back, and what a board that was just set up has in them.
const REGISTERS: [(Register, &str, u16); 4] = [
    (Register::GyroScale, "GYRO_SCALE", 0x0800),
    (Register::GyroOff, "GYRO_OFF", 0x0000),
    (Register::SmplPrd, "SMPL_PRD", 0x0001),
    (Register::MscCtrl, "MSC_CTRL", 0x0000),
];

/// What no simulation and no line shows; hardware.md has what it matters for.
const SCOPE: [(&str, &str); 11] = [
    (
        "MISO high level with each gyro selected",
        "3.3 V or more; below it a 74HCT125 at 5 V goes into the line",
    ),
    (
        "CS x to CS x, persistence on",
        "50.000 ms, no jitter (simulation: 0 cycles)",
    ),
    (
        "SCK",
        "2.0 MHz, idle high; the first words after power-on at 1.0 MHz",
    ),
    (
        "gyro word to word, one gyro",
        "40 us from start to start, 30 us between",
    ),
    (
        "CS x, y, z: trigger on a low longer than 20 us, for a minute",
        "none: a word takes 11 us; a byte that stalls holds its CS for 26 us or more, and `board health` counts it as spi_stalled",
    ),
    (
        "OC2 at `board motor --duty 60`",
        "7.8 kHz, 60/255 high; low at rest and in reset",
    ),
    ("OC2 and direction at a reversal", "3 ms of rest between"),
    (
        "OC2 against PD2 as the motor's stop is pressed",
        "low 12 us behind the first edge at the latest",
    ),
    ("bridge's supply at a reversal", "no spike above its rating"),
    ("5 V rail while the motor starts", "4.75 V or more"),
    ("TXD", "26.0 us a bit at 38400 baud; 0 to 5 V"),
];

/// Runs it. Wrong steps are a failure that names the page.
pub fn run(session: &mut Session, arguments: &Arguments) -> Result<()> {
    let mut steps = Vec::new();
    fuses(arguments, &mut steps);
    let hello = session.link.ask_hello()?;
    let mut info = Info::of(&hello, session.link.name());
    info.corrected_by(super::correction_in_use(&mut session.link)?);
    set_up(&hello, &mut steps);
    stop_let_go(&mut session.link, &mut steps)?;
    let before = session.link.ask_health(false)?;
    listened(&mut session.link, &hello, &mut steps)?;
    counted(&mut session.link, &before, &mut steps)?;
    registers(&mut session.link, &mut steps)?;
    self_tests(&mut session.link, &mut steps)?;
    by_hand(session, arguments, &mut steps)?;
    let page = page(&steps, &info);
    super::super::write(&arguments.out, &page)?;
    let count = |verdict| steps.iter().filter(|step| step.verdict == verdict).count();
    let (wrong, not_done) = (count(Verdict::Wrong), count(Verdict::NotDone));
    let answer = Answer {
        format: "imu-stand-bring-up/1",
        steps: &steps,
        wrong,
        not_done,
        page: super::super::name(&arguments.out),
    };
    super::super::write_json(session.json.as_ref(), &answer)?;
    if !session.quiet {
        for step in &steps {
            let verdict = step.verdict.words().replace('*', "");
            say!("{verdict:<8}  {}: {}", step.what, step.found);
        }
        say!(
            "{} is written; {not_done} steps were not done",
            arguments.out.display()
        );
    }
    if wrong > 0 {
        miette::bail!(
            help = format!(
                "{} has what was expected of each, and docs/hardware.md what it hangs on",
                arguments.out.display()
            ),
            "{wrong} of {} steps are wrong",
            steps.len()
        );
    }
    Ok(())
}

fn fuses(arguments: &Arguments, steps: &mut Vec<Step>) {
    const EXPECTED: &str = "low 0x3f or 0x2f, high 0xc1 (docs/hardware.md)";
    let Some(name) = &arguments.programmer else {
        steps.push(Step {
            what: "fuses".to_owned(),
            found: "no programmer was named".to_owned(),
            expected: EXPECTED.to_owned(),
            verdict: Verdict::NotDone,
        });
        return;
    };
    let programmer = Programmer {
        programmer: name.clone(),
        programmer_port: arguments.programmer_port.clone(),
        programmer_baud: None,
        bit_clock_us: 10.0,
        avrdude: arguments.avrdude.clone(),
    };
    steps.push(match flash::fuses(&programmer) {
        Ok((found, deviations)) => {
            let is_ok = deviations.iter().all(|(_, fails)| !fails);
            let told: String = deviations
                .iter()
                .map(|(what, _)| format!("; {what}"))
                .collect();
            step("fuses", found + &told, EXPECTED, is_ok)
        }
        Err(error) => Step {
            what: "fuses".to_owned(),
            found: error.to_string(),
            expected: EXPECTED.to_owned(),
            verdict: Verdict::NotDone,
        },
    });
}

fn set_up(hello: &Hello, steps: &mut Vec<Step>) {
    let [major, minor, patch] = hello.firmware;
    let own = env!("CARGO_PKG_VERSION");
    let firmware = format!("{major}.{minor}.{patch}");
    steps.push(step("firmware", firmware.clone(), own, firmware == own));
    let known = rate_hz(hello).is_some() && super::show::gyro_range_dps(hello.gyro_range).is_some();
    steps.push(step(
        "set-up",
        format!(
            "{:.4} Hz, gyro range code {}, filter {}",
            rate_hz(hello).unwrap_or(f64::NAN),
            hello.gyro_range,
            hello.gyro_filter
        ),
        "a rate, a range and a filter of the parts",
        known,
    ));
}

/// The motor's stop, which nobody presses: the board tells a nonce, and nothing turns.
fn stop_let_go(link: &mut Link, steps: &mut Vec<Step>) -> Result<()> {
    let status = link.ask_any(Command::Arm { nonce: 0 }, |_| {})?.status;
    let found = match status {
        Status::Ok => "open",
        Status::Stopped => "closed: somebody presses it, or PD2 is wired to ground",
        other => words(other),
    };
    let is_ok = status == Status::Ok;
    steps.push(step("motor's stop, let go", found, "open", is_ok));
    Ok(())
}

/// Some seconds of samples: supply, thermometers, flags, losses, and the board's clock against this computer's.
fn listened(link: &mut Link, hello: &Hello, steps: &mut Vec<Step>) -> Result<()> {
    let before = link.heard();
    let mut samples: Vec<(Sample, f64)> = Vec::new();
    let end = link.now() + Duration::from_secs_f64(LISTEN_S);
    while link.now() < end {
        link.read()?;
        let now = link.now().as_secs_f64();
        while let Some(frame) = link.next() {
            if let Frame::Sample(sample) = frame {
                samples.push((sample, now));
            }
        }
    }
    let heard = link.heard().since(&before);
    let rate = rate_hz(hello).unwrap_or(20.0);
    let due = (LISTEN_S * rate) as usize;
    if samples.is_empty() {
        let found = format!("none in {LISTEN_S} s");
        steps.push(step("samples", found, &due.to_string(), false));
        return Ok(());
    }
    let lost = heard.losses.device + heard.losses.line + heard.losses.unattributed;
    let rejected = heard.counts.rejected();
    steps.push(step(
        "samples",
        format!(
            "{} in {LISTEN_S} s, {lost} lost, {rejected} frames rejected",
            samples.len()
        ),
        &format!("{due}, none lost, none rejected"),
        lost == 0 && rejected == 0 && samples.len() + 3 >= due,
    ));
    let supply = samples
        .iter()
        .map(|(s, _)| f64::from(s.supply) * SUPPLY_LSB_V);
    let (low, high) = extremes(&supply.collect::<Vec<f64>>());
    steps.push(step(
        "supply, by the gyros",
        format!("{low:.3} to {high:.3} V"),
        "4.75 to 5.25 V",
        low >= SUPPLY_V[0] && high <= SUPPLY_V[1],
    ));
    let flags = samples.iter().map(|(s, _)| s.flags ^ flags::IN_ORDER);
    let odd = flags.fold(0, |odd, off| odd | off);
    steps.push(step(
        "flags of the samples",
        format!("{odd:#06x} besides those of a row in order"),
        "0x0000",
        odd == 0,
    ));
    steps.extend(clock(hello, &samples));
    Ok(())
}

/// What the board counted meanwhile: stalls of SPI and ADC, gyros that are silent or in error, what the line lost.
fn counted(link: &mut Link, before: &Health, steps: &mut Vec<Step>) -> Result<()> {
    let now = link.ask_health(false)?;
    let new: Vec<String> = (now.faults.iter().zip(before.faults.iter()))
        .filter(|((_, now), (_, before))| now > before)
        .map(|((fault, now), (_, before))| format!("{} {}", fault.name(), now - before))
        .collect();
    let found = if new.is_empty() {
        format!("nothing new in {LISTEN_S} s")
    } else {
        new.join(", ")
    };
    steps.push(step(
        "stalls and faults, as counted",
        found,
        "nothing new (docs/wire-format.md has the counters)",
        new.is_empty(),
    ));
    Ok(())
}

/// The period of samples and its clock, by samples with the times at which they came here.
fn clock(hello: &Hello, samples: &[(Sample, f64)]) -> Option<Step> {
    let ((first, from), (last, to)) = (samples.first()?, samples.last()?);
    let ticks = last.t_ticks.wrapping_sub(first.t_ticks);
    let tick_s = f64::from(hello.tick_ns) / 1e9;
    let apart = samples
        .windows(2)
        .map(|pair| pair[1].0.t_ticks.wrapping_sub(pair[0].0.t_ticks));
    let period = u32::from(hello.period_ticks) * u32::from(hello.periods_per_sample.max(1));
    let uneven = apart.filter(|step| *step % period.max(1) != 0).count();
    let ppm = (f64::from(ticks) * tick_s / (to - from) - 1.0) * 1e6;
    // Host times jitter by a frame's length: over five seconds, some thousand ppm.
    let jitter_ppm = 2e6 / (LISTEN_S * rate_hz(hello).unwrap_or(20.0));
    Some(step(
        "sample period",
        format!(
            "{:.6} s by the board, {uneven} steps off it; its clock {ppm:+.0} ppm beside this computer's",
            f64::from(period) * tick_s
        ),
        "no step off it, clocks alike (a board at 1 MHz would be off by 16 times)",
        uneven == 0 && ppm.abs() < CLOCK_PPM.max(jitter_ppm),
    ))
}

fn extremes(values: &[f64]) -> (f64, f64) {
    values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
            (l.min(*v), h.max(*v))
        })
}

fn registers(link: &mut Link, steps: &mut Vec<Step>) -> Result<()> {
    for (axis, name) in AXES {
        let mut found = Vec::new();
        let mut is_ok = true;
        for (register, called, expected) in REGISTERS {
            let command = Command::ReadRegister {
                gyro: axis,
                address: register.address(),
            };
            let reply = link.ask_any(command, |_| {})?;
            if reply.status != Status::Ok {
                is_ok = false;
                found.push(format!("{called}: {}", words(reply.status)));
                continue;
            }
            let value = reply.value as u16;
            is_ok &= value == expected;
            found.push(format!("{called} {value:#06x}"));
        }
        let expected: Vec<String> = REGISTERS
            .iter()
            .map(|(_, called, value)| format!("{called} {value:#06x}"))
            .collect();
        steps.push(step(
            &format!("registers of gyro {name}"),
            found.join(", "),
            &expected.join(", "),
            is_ok,
        ));
    }
    Ok(())
}

fn self_tests(link: &mut Link, steps: &mut Vec<Step>) -> Result<()> {
    for (sensor, name) in [
        (Sensor::GyroX, "x"),
        (Sensor::GyroY, "y"),
        (Sensor::GyroZ, "z"),
    ] {
        let reply = link.ask_any(Command::SelfTest { sensor }, |_| {})?;
        let found = match reply.status {
            Status::Ok => "passed",
            status => words(status),
        };
        steps.push(step(
            &format!("self-test of gyro {name}"),
            found,
            "passed",
            reply.status == Status::Ok,
        ));
    }
    Ok(())
}

fn not_done(what: &str, expected: &str) -> Step {
    Step {
        what: what.to_owned(),
        found: "-".to_owned(),
        expected: expected.to_owned(),
        verdict: Verdict::NotDone,
    }
}

/// The page.
fn page(steps: &[Step], info: &Info) -> String {
    let mut out = format!(
        "# Bring-up of a board\n\n```text\n{}\n```\n\n",
        info.text().trim_end()
    );
    out.push_str("| step | found | expected | |\n|---|---|---|---|\n");
    let cell = |text: &str| text.replace('|', "\\|").replace('\n', " ");
    for step in steps {
        let _ = writeln!(
            out,
            "| {} | {} | {} | {} |",
            cell(&step.what),
            cell(&step.found),
            cell(&step.expected),
            step.verdict.words()
        );
    }
    out.push_str(
        "\n## On a scope or a logic analyser\n\n`imu-stand run --vcd traces.vcd` writes the same lines of the simulated board, to lay beside.\n\n| what | expected | seen |\n|---|---|---|\n",
    );
    for (what, expected) in SCOPE {
        let _ = writeln!(out, "| {what} | {expected} | |");
    }
    out.push_str("\nDate, board, who:\n");
    out
}
