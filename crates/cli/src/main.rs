//! The program `imu-stand`.

/// `println!` for output that may be cut short: a reader like `head` that has had enough is no failure.
macro_rules! say {
    ($($words:tt)*) => { $crate::commands::say(format_args!($($words)*)) };
}

mod commands;

use clap::{Parser, Subcommand};

/// Captures, analyzes and criticizes an inertial test stand: what your simulation of the sensor gets wrong, why, and
/// what the gain is.
#[derive(Parser)]
#[command(name = "imu-stand", version, max_term_width = 100)]
struct Program {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Allan deviations, N, B, K, R, Q and the paper's two figures, with intervals.
    Analyze(commands::analyze::Arguments),
    /// What the simulation gets wrong, the causes, the extended model, the measured gain.
    Diagnose(commands::diagnose::Arguments),
    /// The paper's figures 3, 4, 5 and 8 and its two numbers again, and what does not fit in them.
    Paper(commands::paper::Arguments),
    /// How long to record, and with which excitation, for an answer that is still missing.
    Plan(commands::plan::Arguments),
    /// Which of many runs represents them, and which do not and in what.
    Representative(commands::representative::Arguments),
    /// One self-contained HTML file: the verdict, and the figures that it rests on.
    Report(commands::report::Arguments),
    /// The simulated stand with something hidden in it: capture, analysis, diagnosis in one go.
    Run(commands::run::Arguments),
    /// A capture straight from a model file.
    Simulate(commands::simulate::Arguments),
    /// A capture from the board's serial port.
    Capture(commands::capture::Arguments),
    /// The data for other programs, or N, B, K in the units and conventions of filters and simulators.
    Export(commands::export::Arguments),
    /// A live view: rates, temperatures, supply, what is lost, the board's counters, Allan deviations as they grow.
    Monitor(commands::monitor::Arguments),
    /// Read and set the board's configuration over the line.
    Board(commands::board::Arguments),
    /// The firmware onto the board, by avrdude; fuses are checked, and written only on request.
    Flash(commands::flash::Arguments),
}

fn main() -> miette::Result<()> {
    match Program::parse().command {
        Command::Analyze(arguments) => commands::analyze::run(&arguments),
        Command::Diagnose(arguments) => commands::diagnose::run(&arguments),
        Command::Paper(arguments) => commands::paper::run(&arguments),
        Command::Plan(arguments) => commands::plan::run(&arguments),
        Command::Representative(arguments) => commands::representative::run(&arguments),
        Command::Report(arguments) => commands::report::run(&arguments),
        Command::Run(arguments) => commands::run::run(&arguments),
        Command::Simulate(arguments) => commands::simulate::run(&arguments),
        Command::Capture(arguments) => commands::capture::run(&arguments),
        Command::Export(arguments) => commands::export::run(&arguments),
        Command::Monitor(arguments) => commands::monitor::run(&arguments),
        Command::Board(arguments) => commands::board::run(&arguments),
        Command::Flash(arguments) => commands::flash::run(&arguments),
    }
}
