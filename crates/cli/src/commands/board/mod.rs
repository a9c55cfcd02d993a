//! `imu-stand board`: what the board is, how it is set, and setting it.

mod calibrate;
mod motor;
mod null;
mod register;
mod set;
mod show;

use std::path::PathBuf;

use clap::{Args, Subcommand};
use imu_stand::link::Link;
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
    Info,
    /// What went wrong on the board, by name: the counters of docs/wire-format.md
    Health(show::HealthArguments),
    /// One value of the set-up, for scripts
    Get(show::GetArguments),
    /// Change the set-up; it holds until the next reset, or for good after `store`
    #[command(subcommand)]
    Set(set::Set),
    /// Measure the gyros' bias at rest; the board subtracts it from then on
    BiasNull(null::Arguments),
    /// Write bias and scale of a diagnosis (JSON) or of a model file (TOML) to the board
    Calibrate(calibrate::Arguments),
    /// Turn the motor for as long as this program runs; Ctrl-C stops it
    Motor(motor::Arguments),
    /// Read and write registers of the gyros
    #[command(subcommand)]
    Register(register::Register),
    /// Let a sensor test itself
    SelfTest(register::SelfTestArguments),
    /// Keep the set-up over resets (EEPROM)
    Store,
    /// Take the stored set-up again
    Load,
    /// Take the built-in set-up; what is stored stays
    Defaults,
    /// Reset the board and wait until it is back
    Reboot,
}

/// What all actions share.
struct Session {
    link: Link,
    json: Option<PathBuf>,
    quiet: bool,
}

impl Session {
    /// Prints the set-up as it now is, and writes it where JSON was asked for.
    fn show_info(&mut self) -> Result<()> {
        let info = Info::of(&self.link.ask_hello()?, self.link.name());
        super::write_json(self.json.as_ref(), &info)?;
        if !self.quiet {
            say!("{}", info.text().trim_end());
        }
        Ok(())
    }
}

/// Runs it.
pub fn run(arguments: &Arguments) -> Result<()> {
    if let Action::Calibrate(calibrate) = &arguments.action
        && calibrate.dry_run
        && !arguments.line.is_named()
    {
        return calibrate::dry_run(calibrate, arguments.quiet, arguments.json.as_ref());
    }
    if let Action::Register(register::Register::List) = &arguments.action {
        register::list();
        return Ok(());
    }
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
        Action::Calibrate(calibrate) => calibrate::run(session, calibrate),
        Action::Motor(motor) => motor::run(session, motor),
        Action::Register(register) => register::run(session, register),
        Action::SelfTest(test) => register::self_test(session, test),
        Action::Store => set::store(session),
        Action::Load => set::load(session),
        Action::Defaults => set::defaults(session),
        Action::Reboot => set::reboot(session),
    }
}
