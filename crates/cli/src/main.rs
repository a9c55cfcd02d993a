//! The program `imu-stand`.

/// `println!` for output that may be cut short: a reader like `head` that has had enough is no failure.
macro_rules! say {
    ($($words:tt)*) => { $crate::commands::say(format_args!($($words)*)) };
}

/// `eprintln!` for words with names from files in them.
macro_rules! warn {
    ($($words:tt)*) => { $crate::commands::warn(format_args!($($words)*)) };
}

/// Returns an error of wrong usage, in the form of `miette::bail!`.
macro_rules! misused {
    ($($words:tt)*) => {
        return Err(miette::miette!(code = $crate::commands::usage::CODE, $($words)*))
    };
}

mod commands;

use std::process::ExitCode;

use clap::{CommandFactory as _, Parser, Subcommand};

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
    #[command(
        after_help = "Examples:\n  imu-stand analyze run.csv --json analysis.json\n  imu-stand analyze their.csv.gz --columns time=t,gyro_x=gx --units gyro=rad/s"
    )]
    Analyze(commands::analyze::Arguments),
    /// What the simulation gets wrong, the causes, the extended model, the measured gain.
    #[command(
        after_help = "Examples:\n  imu-stand diagnose run.csv --json diagnosis.json --model-out model.toml --report report.html\n  imu-stand diagnose runs --json all.json"
    )]
    Diagnose(commands::diagnose::Arguments),
    /// The paper's figures 3, 4, 5 and 8 and its two numbers again, and what does not fit in them.
    #[command(
        after_help = "Examples:\n  imu-stand paper --out paper\n  imu-stand paper --capture run.csv --channel gyro_x"
    )]
    Paper(commands::paper::Arguments),
    /// How long to record, and with which excitation, for an answer that is still missing.
    #[command(
        after_help = "Examples:\n  imu-stand plan --want 'K within 20 %'\n  imu-stand plan run.csv --separate temperature,rate_ramp"
    )]
    Plan(commands::plan::Arguments),
    /// Which of many runs represents them, and which do not and in what.
    #[command(
        after_help = "Example:\n  imu-stand representative run1.csv run2.csv run3.csv run4.csv run5.csv"
    )]
    Representative(commands::representative::Arguments),
    /// One self-contained HTML file: the verdict, and the figures that it rests on.
    #[command(
        after_help = "Example:\n  imu-stand report run.csv --out report.html --pdf report.pdf --figures figures --png"
    )]
    Report(commands::report::Arguments),
    /// The simulated stand with something hidden in it: capture, analysis, diagnosis in one go.
    #[command(
        after_help = "Examples:\n  imu-stand run --native --hide random --seed 7 --out run.csv --report report.html\n  imu-stand run --native --hide none --stand-seed 3 --noise-seed 2 --out run2.csv\n  imu-stand run --native --pty --hide none --pose 40:+x,80:-x,120:+y,160:-y,200:-z,240:+z\n  imu-stand run --hide none --seconds 60 --vcd traces.vcd --vcd-span 0,2"
    )]
    Run(commands::run::Arguments),
    /// A capture straight from a model file.
    #[command(
        after_help = "Example:\n  imu-stand simulate --model model.toml --seconds 600 --seed 1 --out simulated.csv"
    )]
    Simulate(commands::simulate::Arguments),
    /// A capture from the board's serial port.
    #[command(
        after_help = "Examples:\n  imu-stand capture --port /dev/ttyUSB0 --out run.csv.gz --seconds 600\n  imu-stand capture --port /dev/ttyUSB0 --out run.csv.gz --resume\n  imu-stand capture --port /dev/ttyUSB0 --out year/run.csv.gz --rotate 24h\n  imu-stand capture --port /dev/ttyUSB0 --out run.csv --shape sine --amplitude 120 --period-ms 8000\n  imu-stand capture --replay run.raw --out again.csv"
    )]
    Capture(commands::capture::Arguments),
    /// The data for other programs, or N, B, K in the units and conventions of filters and simulators.
    #[command(
        after_help = "Examples:\n  imu-stand export run.csv --out run.parquet\n  imu-stand export run.csv --to kalibr --out imu.yaml"
    )]
    Export(commands::export::Arguments),
    /// A live view on a terminal or in a browser: rates, temperatures, supply, what is lost, Allan deviations as they grow.
    #[command(
        after_help = "Examples:\n  imu-stand monitor --port /dev/ttyUSB0\n  imu-stand monitor --port /dev/ttyUSB0 --web\n  imu-stand monitor --port /dev/ttyUSB0 --quiet --seconds 60 --json view.json"
    )]
    Monitor(commands::monitor::Arguments),
    /// Read and set the board's configuration over the line.
    #[command(
        after_help = "Examples:\n  imu-stand board --port /dev/ttyUSB0 info\n  imu-stand board --port /dev/ttyUSB0 set rate 50\n  imu-stand board --port /dev/ttyUSB0 bias-null --store\n  imu-stand board --port /dev/ttyUSB0 motor --shape sine --amplitude 120 --period-ms 5000 --seconds 60"
    )]
    Board(commands::board::Arguments),
    /// The firmware onto the board, by avrdude; fuses are checked, and written only on request.
    #[command(
        after_help = "Examples:\n  imu-stand flash --programmer usbasp --dry-run\n  imu-stand flash firmware.hex --programmer stk500v1 --programmer-port /dev/ttyACM0"
    )]
    Flash(commands::flash::Arguments),
    /// What this computer has of what the program can use, and what to do about the rest.
    #[command(after_help = "Example:\n  imu-stand doctor")]
    Doctor(commands::doctor::Arguments),
    /// Words that a shell completes, on standard output.
    #[command(
        after_help = "Examples:\n  imu-stand completions bash > ~/.local/share/bash-completion/completions/imu-stand\n  imu-stand completions zsh > ~/.zfunc/_imu-stand"
    )]
    Completions(commands::shell::Completions),
    /// The manual: a page for the program and one for each command.
    #[command(after_help = "Example:\n  imu-stand man --out ~/.local/share/man/man1")]
    Man(commands::shell::Man),
}

/// Lets the allocator keep what it was given back. A diagnosis makes and drops arrays as long as the record again and again;
/// by default each one's pages go back to the system and are cleared anew.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
fn keep_memory() {
    /// The largest that glibc takes; longer arrays are mapped one by one as before.
    const MAPPED_FROM: libc::c_int = 32 << 20;
    const KEPT_AT_THE_END: libc::c_int = 1 << 30;
    // SAFETY: no other thread runs yet, and it sets two numbers of the allocator; where it refuses them they stay as they are.
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, MAPPED_FROM);
        libc::mallopt(libc::M_TRIM_THRESHOLD, KEPT_AT_THE_END);
    }
}

fn main() -> ExitCode {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    keep_memory();
    // It fails where there is a hook already.
    let _ = miette::set_hook(Box::new(|_| Box::new(commands::terminal::Handler::new())));
    commands::usage::exit_code(run(Program::parse().command))
}

fn run(command: Command) -> miette::Result<()> {
    match command {
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
        Command::Doctor(arguments) => commands::doctor::run(&arguments),
        Command::Completions(arguments) => {
            commands::shell::completions(&arguments, Program::command())
        }
        Command::Man(arguments) => commands::shell::man(&arguments, Program::command()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A line as a shell takes it: what is in quotes is one word.
    fn words(line: &str) -> Vec<&str> {
        let parts = line.split('\'').enumerate();
        parts
            .flat_map(|(k, part)| match k % 2 {
                0 => part.split_whitespace().collect(),
                _ => vec![part],
            })
            .collect()
    }

    /// The examples of a command; each has to be understood and to be about it.
    fn check(command: &clap::Command) {
        let help = command.get_after_help().map(ToString::to_string);
        let help = help.unwrap_or_default();
        let examples: Vec<&str> = help
            .lines()
            .map(str::trim)
            .filter(|line| line.starts_with("imu-stand "))
            .collect();
        assert!(!examples.is_empty(), "{} has none", command.get_name());
        for example in examples {
            let words = words(example);
            assert!(words.contains(&command.get_name()), "{example}");
            // Where it is written is the shell's to do.
            let words = words.into_iter().take_while(|word| *word != ">");
            if let Err(error) = Program::try_parse_from(words) {
                panic!("{example}: {error}");
            }
        }
    }

    #[test]
    fn every_command_has_an_example_and_every_example_is_understood() {
        for command in Program::command().get_subcommands() {
            check(command);
            for action in command.get_subcommands() {
                check(action);
                let explained = |of: &&clap::Command| of.get_after_help().is_some();
                action.get_subcommands().filter(explained).for_each(check);
            }
        }
    }

    #[test]
    fn the_arguments_of_no_command_contradict_each_other() {
        Program::command().debug_assert();
    }

    /// All options and commands, and values for them that are right, nearly right, or nothing of the kind.
    fn vocabulary(command: &clap::Command, words: &mut Vec<String>) {
        words.push(command.get_name().to_owned());
        for argument in command.get_arguments() {
            words.extend(argument.get_long().map(|long| format!("--{long}")));
            words.extend(argument.get_short().map(|short| format!("-{short}")));
            let values = argument.get_possible_values();
            words.extend(values.iter().map(|value| value.get_name().to_owned()));
            words.extend(
                argument
                    .get_default_values()
                    .iter()
                    .map(|v| v.to_string_lossy().into_owned()),
            );
        }
        for inner in command.get_subcommands() {
            vocabulary(inner, words);
        }
    }

    /// `IMU_STAND_FUZZ_SECONDS` and `IMU_STAND_SEED` set how long and with which seed: `cargo xtask fuzz --target arguments`.
    #[test]
    fn any_words_are_arguments_or_are_refused_in_words() {
        use rand_core::{Rng as _, SeedableRng as _};
        const VALUES: [&str; 24] = [
            "",
            "-",
            "--",
            "=",
            "1",
            "-1",
            "0",
            "1e999",
            "nan",
            "inf",
            "9223372036854775808",
            "run.csv",
            "24h",
            "100MB",
            "-5kB",
            "time=t,gyro_x=",
            "gyro=deg/s,,",
            "40:+x,80:0,0,0",
            "K within 20 %",
            "0,2",
            "\u{1b}[2J",
            "\u{202e}x",
            "../../etc/passwd",
            "gyro_x,gyro_x",
        ];
        let set = |name: &str| std::env::var(name).ok().and_then(|text| text.parse().ok());
        let seconds: f64 = set("IMU_STAND_FUZZ_SECONDS").unwrap_or(2.0);
        let seed = set("IMU_STAND_SEED").unwrap_or(1.0) as u64;
        let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut below = |n: usize| ((u128::from(rng.next_u64()) * n as u128) >> 64) as usize;
        let mut words: Vec<String> = VALUES.map(str::to_owned).to_vec();
        vocabulary(&Program::command(), &mut words);
        let commands: Vec<String> = (Program::command().get_subcommands())
            .map(|command| command.get_name().to_owned())
            .collect();
        let (begin, mut count, mut understood) = (std::time::Instant::now(), 0u64, 0u64);
        while begin.elapsed().as_secs_f64() < seconds {
            let mut line = vec![
                "imu-stand".to_owned(),
                commands[below(commands.len())].clone(),
            ];
            for _ in 0..below(8) {
                let mut word = words[below(words.len())].clone();
                if below(5) == 0 {
                    word = format!("{word}={}", words[below(words.len())]);
                }
                if below(8) == 0 {
                    let at = below(word.chars().count() + 1);
                    word = word
                        .chars()
                        .take(at)
                        .chain(['\u{7f}'])
                        .chain(word.chars().skip(at))
                        .collect();
                }
                line.push(word);
            }
            count += 1;
            match Program::try_parse_from(&line) {
                Ok(_) => understood += 1,
                Err(error) => assert!(!error.to_string().is_empty(), "{line:?}"),
            }
        }
        println!(
            "arguments: {count} lines, {:.0} a second, {understood} understood; seed {seed}",
            count as f64 / begin.elapsed().as_secs_f64()
        );
        assert!(understood > 0);
    }
}
