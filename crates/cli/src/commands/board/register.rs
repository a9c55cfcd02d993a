//! Registers of the gyros, and the sensors' self-tests.

use adis16250::{Access, Register as Part};
use clap::{Args, Subcommand, ValueEnum};
use imu_stand::link::{LinkError, done, words};
use miette::Result;
use serde::Serialize;
use wire::{Command, Sensor, Status};

use super::Session;
use super::set::AxisName;

/// What can be done with registers.
#[derive(Subcommand)]
pub enum Register {
    /// Read one register, or `all`
    Read {
        /// x, y or z
        axis: AxisName,
        /// Name of the data sheet (SENS_AVG, STATUS, ...), address (0x38), or `all`
        register: String,
    },
    /// Write one register and read it back; the samples are flagged as misconfigured until `board set gyro` or a restart
    Write {
        /// x, y or z
        axis: AxisName,
        /// Name of the data sheet or address
        register: String,
        /// 16 bits, 0x0402 or 1026
        value: String,
        /// Do it even where it wears the part's flash, resets it, or undoes the board's set-up
        #[arg(long)]
        yes: bool,
    },
    /// The registers by name and address
    List,
}

/// In place of a name: every register that can be read.
const ALL: &str = "all";

/// Names of the data sheet.
const NAMES: [(&str, Part); 21] = [
    ("ENDURANCE", Part::Endurance),
    ("SUPPLY_OUT", Part::SupplyOut),
    ("GYRO_OUT", Part::GyroOut),
    ("AUX_ADC", Part::AuxAdc),
    ("TEMP_OUT", Part::TempOut),
    ("ANGL_OUT", Part::AnglOut),
    ("GYRO_OFF", Part::GyroOff),
    ("GYRO_SCALE", Part::GyroScale),
    ("ALM_MAG1", Part::AlmMag1),
    ("ALM_MAG2", Part::AlmMag2),
    ("ALM_SMPL1", Part::AlmSmpl1),
    ("ALM_SMPL2", Part::AlmSmpl2),
    ("ALM_CTRL", Part::AlmCtrl),
    ("AUX_DAC", Part::AuxDac),
    ("GPIO_CTRL", Part::GpioCtrl),
    ("MSC_CTRL", Part::MscCtrl),
    ("SMPL_PRD", Part::SmplPrd),
    ("SENS_AVG", Part::SensAvg),
    ("SLP_CNT", Part::SlpCnt),
    ("STATUS", Part::Status),
    ("COMMAND", Part::Command),
];

fn name(register: Part) -> &'static str {
    NAMES
        .iter()
        .find(|(_, part)| *part == register)
        .map_or("?", |(name, _)| name)
}

fn number(text: &str) -> Option<u16> {
    let hex = text.strip_prefix("0x").or_else(|| text.strip_prefix("0X"));
    match hex {
        Some(digits) => u16::from_str_radix(digits, 16).ok(),
        None => text.parse().ok(),
    }
}

fn register(text: &str) -> Result<Part> {
    let plain = text.to_ascii_uppercase().replace(['/', '-'], "_");
    let by_name = NAMES.iter().find(|(name, _)| *name == plain);
    let by_address = || {
        number(text)
            .and_then(|address| u8::try_from(address).ok())
            .and_then(Part::from_address)
    };
    match by_name.map(|(_, part)| *part).or_else(by_address) {
        Some(part) => Ok(part),
        None => misused!(
            help = "`imu-stand board register list` shows names and addresses",
            "the ADIS16250 has no register `{text}`"
        ),
    }
}

/// A register that was read.
#[derive(Serialize)]
struct Content {
    axis: String,
    register: &'static str,
    address: u8,
    bits: u16,
    meaning: String,
}

#[derive(Serialize)]
struct Answer {
    format: &'static str,
    registers: Vec<Content>,
}

/// What the bits say, where that is more than a number.
fn meaning(register: Part, bits: u16) -> String {
    let word = adis16250::Word(bits);
    let flags = || {
        let mut text = String::new();
        if word.is_new() {
            text.push_str(", new");
        }
        if word.has_error() {
            text.push_str(", error or alarm");
        }
        text
    };
    match register {
        Part::SupplyOut => format!(
            "{:.3} V{}",
            f64::from(word.unsigned_12()) * 1.8315e-3,
            flags()
        ),
        Part::TempOut => format!(
            "{:.2} degC{}",
            25.0 + f64::from(word.signed_12()) * 0.1453,
            flags()
        ),
        Part::GyroOut => format!("{} counts{}", word.signed_14(), flags()),
        Part::AuxAdc => format!(
            "{:.4} V{}",
            f64::from(word.unsigned_12()) * 0.6105e-3,
            flags()
        ),
        Part::GyroScale => format!("{:.5}", f64::from(bits & 0x0fff) / 2048.0),
        Part::SensAvg => {
            let range = super::show::gyro_range_dps((bits >> 8) as u8 & 7);
            let range = range.map_or_else(|| "unknown".to_owned(), |dps| format!("{dps} deg/s"));
            format!("range {range}, {} taps a stage", 1 << (bits & 7))
        }
        Part::Status => alarms(bits),
        _ => match register.default_value() {
            Some(value) if value == bits => "as delivered".to_owned(),
            Some(value) => format!("delivered as {value:#06x}"),
            None => String::new(),
        },
    }
}

/// The bits of STATUS that are set, by name.
fn alarms(bits: u16) -> String {
    let names = [
        (9, "alarm 2"),
        (8, "alarm 1"),
        (5, "self-test failed"),
        (4, "beyond range"),
        (3, "SPI failure"),
        (2, "flash not written"),
        (1, "supply above 5.25 V"),
        (0, "supply below 4.75 V"),
    ];
    let set: Vec<&str> = names
        .iter()
        .filter(|(bit, _)| bits >> bit & 1 != 0)
        .map(|(_, name)| *name)
        .collect();
    if set.is_empty() {
        "in order".to_owned()
    } else {
        set.join(", ")
    }
}

/// Prints names and addresses; needs no board.
pub fn list() {
    for (name, part) in NAMES {
        let access = match part.access() {
            Access::Read => "read",
            Access::ReadWrite => "read, write",
            Access::Write => "write",
        };
        say!("{name:<11} {:#04x}  {access}", part.address());
    }
}

pub fn run(session: &mut Session, action: &Register) -> Result<()> {
    let contents = match action {
        Register::List => vec![],
        Register::Read {
            axis,
            register: text,
        } if text == ALL => NAMES
            .iter()
            .filter(|(_, part)| part.access() != Access::Write)
            .map(|(_, part)| read(session, *axis, *part))
            .collect::<Result<Vec<_>>>()?,
        Register::Read {
            axis,
            register: text,
        } => vec![read(session, *axis, readable(text)?)?],
        Register::Write {
            axis,
            register: text,
            value,
            yes,
        } => vec![write(session, *axis, writable(text, value)?, *yes)?],
    };
    if !session.quiet {
        for content in &contents {
            say!(
                "gyro {}  {:<11} {:#04x}  {:#06x}  {}",
                content.axis,
                content.register,
                content.address,
                content.bits,
                content.meaning
            );
        }
    }
    let answer = Answer {
        format: "imu-stand-registers/1",
        registers: contents,
    };
    super::super::write_json(session.json.as_ref(), &answer)
}

fn content(axis: AxisName, register: Part, bits: u16) -> Content {
    Content {
        axis: format!("{axis:?}").to_lowercase(),
        register: name(register),
        address: register.address(),
        bits,
        meaning: meaning(register, bits),
    }
}

/// A register that can be read, by its name or address.
fn readable(text: &str) -> Result<Part> {
    let register = register(text)?;
    if register.access() == Access::Write {
        misused!(
            help = "STATUS shows what its commands led to",
            "{} can only be written",
            name(register)
        );
    }
    Ok(register)
}

/// A register that can be written, and what.
fn writable(text: &str, value: &str) -> Result<(Part, u16)> {
    let register = register(text)?;
    let Some(bits) = number(value) else {
        misused!(
            help = "write 16 bits as 0x0402 or 1026",
            "`{value}` is no value of a register"
        );
    };
    if register.access() == Access::Read {
        misused!(
            help = "`imu-stand board register list` shows what can be written",
            "{} can only be read",
            name(register)
        );
    }
    Ok((register, bits))
}

impl Register {
    /// What can be wrong with it whatever the board is: asked before a port is opened.
    pub fn check(&self) -> Result<()> {
        match self {
            Register::Read { register, .. } if register == ALL => Ok(()),
            Register::Read { register, .. } => readable(register).map(|_| ()),
            Register::Write {
                register, value, ..
            } => writable(register, value).map(|_| ()),
            Register::List => Ok(()),
        }
    }
}

fn read(session: &mut Session, axis: AxisName, register: Part) -> Result<Content> {
    let reply = session.link.ask(Command::ReadRegister {
        gyro: axis.into(),
        address: register.address(),
    })?;
    Ok(content(axis, register, reply.value as u16))
}

fn write(
    session: &mut Session,
    axis: AxisName,
    (register, bits): (Part, u16),
    yes: bool,
) -> Result<Content> {
    let danger = match register {
        Part::Command => {
            Some("COMMAND resets the part, moves its bias or wears its flash (20 000 writes)")
        }
        Part::SensAvg => Some(
            "`board set gyro` sets range, filter and scale factors together; this undoes one of them",
        ),
        Part::SmplPrd => Some("the board's filter and rate count on 256 samples a second"),
        Part::GyroScale | Part::GyroOff => {
            Some("this changes the part's calibration under the board's own")
        }
        Part::SlpCnt => Some("the part sleeps, and the board finds it silent meanwhile"),
        _ => None,
    };
    if let Some(why) = danger
        && !yes
    {
        miette::bail!(
            help = "if that is what you want, add `--yes`",
            "not written: {why}"
        );
    }
    let reply = session.link.ask(Command::WriteRegister {
        gyro: axis.into(),
        address: register.address(),
        value: bits,
    })?;
    Ok(content(axis, register, reply.value as u16))
}

/// A sensor as people write it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
#[allow(missing_docs)]
pub enum SensorName {
    GyroX,
    GyroY,
    GyroZ,
    Acc,
    All,
}

/// What `self-test` takes.
#[derive(Args)]
pub struct SelfTestArguments {
    /// Which sensor
    #[arg(default_value = "all")]
    sensor: SensorName,
}

#[derive(Serialize)]
struct Tested {
    sensor: &'static str,
    passed: bool,
    status: &'static str,
    value: i32,
}

#[derive(Serialize)]
struct SelfTestAnswer {
    format: &'static str,
    sensors: Vec<Tested>,
}

pub fn self_test(session: &mut Session, arguments: &SelfTestArguments) -> Result<()> {
    let all = [
        (SensorName::GyroX, Sensor::GyroX, "gyro x"),
        (SensorName::GyroY, Sensor::GyroY, "gyro y"),
        (SensorName::GyroZ, Sensor::GyroZ, "gyro z"),
        (SensorName::Acc, Sensor::Accelerometer, "accelerometer"),
    ];
    let mut tested = Vec::new();
    let mut failure: Option<LinkError> = None;
    for (name, sensor, words_of) in all {
        if arguments.sensor != SensorName::All && arguments.sensor != name {
            continue;
        }
        let command = Command::SelfTest { sensor };
        let reply = session.link.ask_any(command, |_| {})?;
        tested.push(Tested {
            sensor: words_of,
            passed: reply.status == Status::Ok,
            status: words(reply.status),
            value: reply.value,
        });
        // The MMA7260QT has no self-test pin: a board that says so has not failed.
        let is_lacking = sensor == Sensor::Accelerometer && reply.status == Status::Unsupported;
        if !session.quiet {
            let outcome = match reply.status {
                Status::Ok => "passed".to_owned(),
                _ if is_lacking => "has none".to_owned(),
                status => words(status).to_owned(),
            };
            say!("{words_of:<14} {outcome}");
        }
        if !(is_lacking && arguments.sensor == SensorName::All) {
            failure = failure.or(done(&command, reply).err());
        }
    }
    let answer = SelfTestAnswer {
        format: "imu-stand-self-test/1",
        sensors: tested,
    };
    super::super::write_json(session.json.as_ref(), &answer)?;
    failure.map_or(Ok(()), |error| Err(error.into()))
}
