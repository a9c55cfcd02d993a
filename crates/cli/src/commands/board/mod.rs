//! `imu-stand board`: what the board is, how it is set, and setting it.

mod bring_up;
mod calibrate;
mod correct;
pub mod motor;
mod null;
mod register;
mod sequence;
mod set;
mod show;

use std::path::PathBuf;

use clap::{Args, Subcommand};
use imu_stand::link::{Link, LinkError};
use miette::Result;
use wire::Command;

use show::Info;

use super::Line;

/// What `board` takes.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    line: Line,
    /// Write the result as JSON
    #[arg(long, global = true, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Print nothing but errors
    #[arg(long, short, global = true)]
    quiet: bool,
    #[command(subcommand)]
    action: Action,
}

#[derive(Subcommand)]
enum Action {
    /// Who the board is, why it started last, how it is set
    #[command(
        after_help = "Examples:\n  imu-stand board --port /dev/ttyUSB0 info\n  imu-stand board --port /dev/ttyUSB0 info --json board.json"
    )]
    Info,
    /// What went wrong on the board, by name: the counters of docs/wire-format.md
    #[command(after_help = "Example:\n  imu-stand board --port /dev/ttyUSB0 health --all")]
    Health(show::HealthArguments),
    /// One value of the set-up, for scripts
    #[command(after_help = "Example:\n  imu-stand board --port /dev/ttyUSB0 get rate")]
    Get(show::GetArguments),
    /// Change the set-up; it holds until the next reset, or for good after `store`
    #[command(
        after_help = "Examples:\n  imu-stand board --port /dev/ttyUSB0 set rate 50\n  imu-stand board --port /dev/ttyUSB0 set gyro --range 160 --filter 3\n  imu-stand board --port /dev/ttyUSB0 set acc-range 2\n  imu-stand board --port /dev/ttyUSB0 set bias y -0.25\n  imu-stand board --port /dev/ttyUSB0 set baud 250000\n  imu-stand board --port /dev/ttyUSB0 set motor-limits --max-duty 200 --ramp 400"
    )]
    #[command(subcommand)]
    Set(set::Set),
    /// Measure the gyros' bias at rest; the board subtracts it from then on
    #[command(
        after_help = "Example:\n  imu-stand board --port /dev/ttyUSB0 bias-null --samples 1200 --store"
    )]
    BiasNull(null::Arguments),
    /// Write bias and scale of a diagnosis (JSON) or of a model file (TOML) to the board, or go through a calibration sequence
    #[command(
        after_help = "Examples:\n  imu-stand board --port /dev/ttyUSB0 calibrate diagnosis.json --dry-run\n  imu-stand board --port /dev/ttyUSB0 calibrate model.toml --store\n  imu-stand board --port /dev/ttyUSB0 calibrate six-position --model model.toml --out calibrated.toml"
    )]
    Calibrate(calibrate::Arguments),
    /// Walk a new board, check what can be checked, and write one page of it
    ///
    /// Fuses (where a programmer is named), supply, registers, sample period, self-test, the sign of each gyro by hand, each of
    /// the six sides, and what is left to be seen on a scope. Nothing has to be typed: it waits for what it asks for.
    #[command(
        after_help = "Examples:\n  imu-stand board --port /dev/ttyUSB0 bring-up --programmer usbasp --out bring-up.md\n  imu-stand board --port /dev/ttyUSB0 bring-up --no-hand"
    )]
    BringUp(bring_up::Arguments),
    /// Write the correction of a model file to the board, which applies it from then on
    #[command(
        after_help = "Examples:\n  imu-stand board --port /dev/ttyUSB0 correct model.toml --dry-run\n  imu-stand board --port /dev/ttyUSB0 correct --model model.toml\n  imu-stand board --port /dev/ttyUSB0 correct --off"
    )]
    Correct(correct::Arguments),
    /// Turn the motor for as long as this program runs; Ctrl-C stops it
    #[command(
        after_help = "Examples:\n  imu-stand board --port /dev/ttyUSB0 motor --duty 100 --seconds 10\n  imu-stand board --port /dev/ttyUSB0 motor --shape sine --amplitude 120 --period-ms 5000"
    )]
    Motor(motor::Arguments),
    /// Read and write registers of the gyros
    #[command(
        after_help = "Examples:\n  imu-stand board --port /dev/ttyUSB0 register list\n  imu-stand board --port /dev/ttyUSB0 register read x all\n  imu-stand board --port /dev/ttyUSB0 register write z ALM_MAG1 0x8123"
    )]
    #[command(subcommand)]
    Register(register::Register),
    /// Let a sensor test itself
    #[command(
        after_help = "Examples:\n  imu-stand board --port /dev/ttyUSB0 self-test\n  imu-stand board --port /dev/ttyUSB0 self-test gyro-y"
    )]
    SelfTest(register::SelfTestArguments),
    /// Keep the set-up over resets (EEPROM)
    #[command(after_help = "Example:\n  imu-stand board --port /dev/ttyUSB0 store")]
    Store,
    /// Take the stored set-up again
    #[command(after_help = "Example:\n  imu-stand board --port /dev/ttyUSB0 load")]
    Load,
    /// Take the built-in set-up; what is stored stays
    #[command(after_help = "Example:\n  imu-stand board --port /dev/ttyUSB0 defaults")]
    Defaults,
    /// Reset the board and wait until it is back
    #[command(after_help = "Example:\n  imu-stand board --port /dev/ttyUSB0 reboot")]
    Reboot,
}

/// What all actions share.
pub(crate) struct Session {
    link: Link,
    json: Option<PathBuf>,
    quiet: bool,
}

impl Session {
    /// Prints the set-up as it now is, and writes it where JSON was asked for.
    fn show_info(&mut self) -> Result<()> {
        let hello = self.link.ask_hello()?;
        let mut info = Info::of(&hello, self.link.name());
        info.corrected_by(correction_in_use(&mut self.link)?);
        super::write_json(self.json.as_ref(), &info)?;
        if !self.quiet {
            say!("{}", info.text().trim_end());
        }
        Ok(())
    }
}

/// Number of the correction in use and the SENS/AVG that it is for, if one is; a board that does not know of corrections has none.
pub(super) fn correction_in_use(link: &mut Link) -> Result<Option<(u16, u16)>> {
    let mut ask = |row| {
        let other = false;
        match link.ask(Command::GetCorrection { other, row }) {
            Ok(reply) => Ok((reply.value != 0).then_some(reply.detail)),
            Err(LinkError::Refused { .. }) => Ok(None),
            Err(error) => Err(error),
        }
    };
    let Some(first) = ask(0)? else {
        return Ok(None);
    };
    Ok(ask(1)?.map(|second| (first[1] as u16, second[0] as u16)))
}

/// Refuses what no board can do before one is asked.
fn understood(action: &Action) -> Result<()> {
    match action {
        Action::Set(set) => set.check(),
        Action::Register(register) => register.check(),
        Action::Motor(motor) => motor.command().map(|_| ()),
        Action::Calibrate(calibrate) if calibrate.sequence.is_none() => {
            calibrate.file().map(|_| ())
        }
        _ => Ok(()),
    }
}

/// Runs it.
pub fn run(arguments: &Arguments) -> Result<()> {
    let reads = match &arguments.action {
        Action::Calibrate(calibrate) => calibrate.reads(),
        Action::Correct(correct) => correct.model(),
        _ => None,
    };
    let outputs = super::Outputs::beside(reads).result("--json", arguments.json.as_ref())?;
    if let Action::Calibrate(calibrate) = &arguments.action
        && let Some(sequence) = &calibrate.sequence
    {
        outputs.result("--out", Some(sequence.out()))?;
    } else if let Action::BringUp(bring_up) = &arguments.action {
        outputs.result("--out", Some(bring_up.out()))?;
    }
    if let Action::Calibrate(calibrate) = &arguments.action
        && calibrate.dry_run
        && calibrate.sequence.is_none()
        && !arguments.line.is_named()
    {
        return calibrate::dry_run(calibrate, arguments.quiet, arguments.json.as_ref());
    }
    if let Action::Register(register::Register::List) = &arguments.action {
        register::list();
        return Ok(());
    }
    understood(&arguments.action)?;
    let mut session = Session {
        link: arguments.line.open()?,
        json: arguments.json.clone(),
        quiet: arguments.quiet,
    };
    let session = &mut session;
    // A board that is just starting, or is not there, is found out by what may be repeated.
    session.link.ask(Command::Ping)?;
    match &arguments.action {
        Action::Info => session.show_info(),
        Action::Health(health) => show::health(session, health),
        Action::Get(get) => show::get(session, get),
        Action::Set(set) => set::run(session, set),
        Action::BiasNull(null) => null::run(session, null),
        Action::Calibrate(calibrate) => match &calibrate.sequence {
            Some(sequence) => sequence::run(session, sequence),
            None => calibrate::run(session, calibrate),
        },
        Action::BringUp(bring_up) => bring_up::run(session, bring_up),
        Action::Correct(correct) => correct::run(session, correct),
        Action::Motor(motor) => motor::run(session, motor),
        Action::Register(register) => register::run(session, register),
        Action::SelfTest(test) => register::self_test(session, test),
        Action::Store => set::store(session),
        Action::Load => set::load(session),
        Action::Defaults => set::defaults(session),
        Action::Reboot => set::reboot(session),
    }
}
