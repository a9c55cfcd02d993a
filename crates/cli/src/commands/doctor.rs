//! `imu-stand doctor`: what this computer has of what the program can use.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use clap::Args;
use imu_stand::browser::Browser;
use imu_stand::text;
use miette::Result;
use serde::Serialize;

/// What `doctor` takes.
#[derive(Args)]
pub struct Arguments {
    /// Write the result as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Print nothing but errors
    #[arg(long, short)]
    quiet: bool,
}

/// One thing that was looked for.
#[derive(Debug, Serialize)]
struct Found {
    what: &'static str,
    /// What needs it.
    needed_for: &'static str,
    is_there: bool,
    /// What is there.
    details: Vec<String>,
    /// What to do where it is missing.
    help: Option<String>,
}

#[derive(Serialize)]
struct Answer {
    format: &'static str,
    version: &'static str,
    found: Vec<Found>,
}

/// Runs it. What is missing is no failure: nothing here is needed by every command.
pub fn run(arguments: &Arguments) -> Result<()> {
    super::Outputs::beside([]).result("--json", arguments.json.as_ref())?;
    let found = vec![
        ports(),
        avrdude(),
        simulator(),
        image(),
        toolchain(),
        browser(),
    ];
    let answer = Answer {
        format: "imu-stand-doctor/1",
        version: env!("CARGO_PKG_VERSION"),
        found,
    };
    super::write_json(arguments.json.as_ref(), &answer)?;
    if arguments.quiet {
        return Ok(());
    }
    say!("imu-stand {}", answer.version);
    say!("analyze, diagnose, report, plan, simulate and export need nothing else");
    for found in &answer.found {
        let state = if found.is_there { "ok     " } else { "missing" };
        say!("{state}  {}: {}", found.what, found.needed_for);
        let help = found.help.iter();
        for line in found.details.iter().chain(help) {
            say!("{}", text::item("", line));
        }
    }
    Ok(())
}

/// The first line that a program prints, where it is there.
fn first_line(program: &str, argument: &str) -> Option<String> {
    let output = Command::new(program)
        .arg(argument)
        .stdin(Stdio::null())
        .output()
        .ok()?;
    let said = [output.stdout, output.stderr].concat();
    let said = String::from_utf8_lossy(&said).into_owned();
    let line = said.lines().map(str::trim).find(|line| !line.is_empty());
    Some(line.unwrap_or_default().to_owned())
}

fn ports() -> Found {
    let ports = serialport::available_ports().unwrap_or_default();
    let shut: Vec<&str> = (ports.iter().map(|port| port.port_name.as_str()))
        .filter(|name| !may_open(name))
        .collect();
    let help = match (ports.is_empty(), shut.first()) {
        (true, _) => Some(
            "plug the board's cable in; without a board `imu-stand run --native --pty` shows the simulated one as a port".to_owned(),
        ),
        (_, Some(name)) => Some(format!(
            "{name} is not yours to open: join the group that owns it (Debian: `sudo usermod -a -G dialout $USER`), and log in again"
        )),
        _ => None,
    };
    let about = |port: &serialport::SerialPortInfo| match &port.port_type {
        serialport::SerialPortType::UsbPort(usb) => {
            let name = usb.product.as_deref().unwrap_or("USB");
            format!("{}: {name}", port.port_name)
        }
        _ => port.port_name.clone(),
    };
    Found {
        what: "serial ports",
        needed_for: "capture, monitor and board",
        is_there: !ports.is_empty() && shut.is_empty(),
        details: ports.iter().map(about).collect(),
        help,
    }
}

#[cfg(unix)]
fn may_open(name: &str) -> bool {
    use std::os::unix::ffi::OsStrExt as _;
    let Ok(name) = std::ffi::CString::new(Path::new(name).as_os_str().as_bytes()) else {
        return false;
    };
    // SAFETY: the name ends in a zero and lives on; nothing is opened, which could reset a board.
    unsafe { libc::access(name.as_ptr(), libc::R_OK | libc::W_OK) == 0 }
}

#[cfg(not(unix))]
fn may_open(_: &str) -> bool {
    true
}

fn avrdude() -> Found {
    let says = first_line("avrdude", "-?").is_some();
    let version = || {
        let output = Command::new("avrdude").arg("-?").output().ok()?;
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        let line = said.lines().find(|line| line.contains("version"))?;
        Some(line.trim().to_owned())
    };
    Found {
        what: "avrdude",
        needed_for: "flash, beside a programmer (`imu-stand flash --programmer usbasp --dry-run` shows what it would be told)",
        is_there: says,
        details: version().into_iter().collect(),
        help: (!says).then(|| {
            "Debian: `apt-get install avrdude`; macOS: `brew install avrdude`; Windows: its releases".to_owned()
        }),
    }
}

fn simulator() -> Found {
    let is_there = cfg!(feature = "simavr");
    Found {
        what: "the simulated ATmega16",
        needed_for: "run without --native: the firmware's image, not its logic alone",
        is_there,
        details: Vec::new(),
        help: (!is_there).then(|| {
            "in the source folder, `cargo xtask demo` builds the program with it; `--native` runs the same logic on this computer".to_owned()
        }),
    }
}

fn image() -> Found {
    let is_there = Path::new(super::run::IMAGE).is_file();
    Found {
        what: "the firmware's image",
        needed_for: "run without --native, and flash",
        is_there,
        details: is_there
            .then(|| super::run::IMAGE.to_owned())
            .into_iter()
            .collect(),
        help: (!is_there).then(|| {
            format!(
                "in the source folder, `cargo xtask image` builds {}",
                super::run::IMAGE
            )
        }),
    }
}

fn toolchain() -> Found {
    let tools = [("cargo", "--version"), ("avr-gcc", "--version")];
    let said = tools.map(|(program, argument)| first_line(program, argument));
    let is_there = said.iter().all(Option::is_some);
    Found {
        what: "toolchain",
        needed_for: "to build the firmware's image",
        is_there,
        details: said.into_iter().flatten().collect(),
        help: (!is_there).then(|| {
            "Rust by rustup; the rest, with what else the image needs, `cargo xtask image` installs".to_owned()
        }),
    }
}

fn browser() -> Found {
    let found = Browser::find();
    Found {
        what: "Chromium",
        needed_for: "report --pdf",
        is_there: found.is_ok(),
        details: (found.iter().map(|b| b.path().display().to_string())).collect(),
        help: found.is_err().then(|| {
            "Debian: `apt-get install chromium`; Chrome and Edge do as well; IMU_STAND_CHROMIUM names one elsewhere".to_owned()
        }),
    }
}
