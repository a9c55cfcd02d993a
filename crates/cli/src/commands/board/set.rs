//! Changing the set-up, keeping it, and starting anew.

use std::time::{Duration, Instant};

use clap::{Subcommand, ValueEnum};
use imu_stand::link::{self, LinkError, baud_of, divisor};
use imu_stand::report::plot::tidy;
use miette::Result;
use wire::{Axis, Command, Hello, Sample, Status};

use super::super::usage::misuse;
use super::Session;
use super::show::{ACC_RANGES_G, Q16, Q24, gyro_range_dps};

/// An axis as people write it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
#[allow(missing_docs)]
pub enum AxisName {
    X,
    Y,
    Z,
}

impl From<AxisName> for Axis {
    fn from(name: AxisName) -> Self {
        match name {
            AxisName::X => Axis::X,
            AxisName::Y => Axis::Y,
            AxisName::Z => Axis::Z,
        }
    }
}

/// What can be set.
#[derive(Subcommand)]
pub enum Set {
    /// Samples a second, 1 to 256
    Rate {
        /// Hz; the board rounds to whole ticks
        hz: f64,
    },
    /// Range and filter of the gyros; the scale factors become those of the range again
    Gyro {
        /// Full scale, deg/s: 320, 160 or 80; without it as it is
        #[arg(long)]
        range: Option<u16>,
        /// M: 2^M taps in each of two stages, 0 to 6; without it as it is
        #[arg(long)]
        filter: Option<u8>,
    },
    /// Full scale of the accelerometer, g: 1.5, 2, 4 or 6
    AccRange {
        /// g
        g: f64,
    },
    /// Bias that is subtracted from a gyro
    Bias {
        /// x, y or z
        axis: AxisName,
        /// deg/s
        #[arg(allow_negative_numbers = true)]
        dps: f64,
    },
    /// Scale factor of a gyro
    Scale {
        /// x, y or z
        axis: AxisName,
        /// deg/s for each count
        dps_per_count: f64,
    },
    /// Speed of the line, on both ends
    Baud {
        /// 9600, 19200, 38400, 76800, 250000, 500000, ...
        baud: u32,
    },
    /// Largest command and largest change of the command of the motor
    MotorLimits {
        /// 0 to 255
        #[arg(long)]
        max_duty: u8,
        /// Steps a second
        #[arg(long)]
        ramp: u16,
    },
    /// Number of the board
    BoardId {
        /// 0 for none
        id: u16,
    },
}

impl Set {
    /// What can be wrong with it whatever the board is: asked before a port is opened.
    pub fn check(&self) -> Result<()> {
        match *self {
            Set::Rate { hz } => is_rate(hz),
            Set::Gyro { range, filter } => gyro_range(range, filter).map(|_| ()),
            Set::AccRange { g } => acc_range(g).map(|_| ()),
            Set::Bias { dps, .. } => fixed(dps, Q16, "bias")
                .map(|_| ())
                .map_err(|error| misuse(error.as_ref())),
            Set::Scale { dps_per_count, .. } => scale(dps_per_count).map(|_| ()),
            Set::Baud { baud } => divisor_of(baud).map(|_| ()),
            Set::MotorLimits { .. } | Set::BoardId { .. } => Ok(()),
        }
    }
}

/// A value in fixed point.
pub fn fixed(value: f64, unit: f64, what: &str) -> Result<i32> {
    let scaled = (value * unit).round();
    if scaled.is_finite() && scaled.abs() <= f64::from(i32::MAX) {
        return Ok(scaled as i32);
    }
    miette::bail!(
        help = "biases are some deg/s, scale factors about 0.07 deg/s for each count",
        "{what}: {} does not fit into the board's fixed point",
        tidy(value, 6)
    )
}

pub fn run(session: &mut Session, set: &Set) -> Result<()> {
    let hello = session.link.ask_hello()?;
    let command = match *set {
        Set::Rate { hz } => rate(&hello, hz)?,
        Set::Gyro { range, filter } => gyro(&hello, range, filter)?,
        Set::AccRange { g } => Command::SetAccRange {
            range: acc_range(g)?,
        },
        Set::Bias { axis, dps } => Command::SetBias {
            axis: axis.into(),
            value: fixed(dps, Q16, "bias")?,
        },
        Set::Scale {
            axis,
            dps_per_count,
        } => Command::SetScale {
            axis: axis.into(),
            value: scale(dps_per_count)?,
        },
        Set::Baud { baud } => return set_baud(session, &hello, baud),
        Set::MotorLimits { max_duty, ramp } => Command::MotorLimits {
            max_duty,
            ramp_per_s: ramp,
        },
        Set::BoardId { id } => Command::SetBoardId { board_id: id },
    };
    session.link.ask(command)?;
    session.show_info()?;
    if !session.quiet && matches!(command, Command::SetGyro { .. }) {
        say!(
            "  the scale factors are those of the range again; biases and `calibrate` were for the old set-up"
        );
    }
    unsaved(session);
    Ok(())
}

fn unsaved(session: &Session) {
    if !session.quiet {
        say!("  until the next reset; `imu-stand board store` keeps it");
    }
}

/// Longest period of the board's timer, ticks; slower rates take every second, third or fourth.
const LONGEST_PERIOD: f64 = 62_500.0;

/// Rates that the gyros and the board's timer have, Hz.
const LEAST_HZ: f64 = 1.0;
const MOST_HZ: f64 = 256.0;

/// Share of a line's capacity that samples may take: the rest is for health, hello, replies.
const LINE_SHARE: f64 = 0.85;

fn is_rate(hz: f64) -> Result<()> {
    if !(LEAST_HZ..=MOST_HZ).contains(&hz) {
        misused!(
            help = "write `board set rate 20`",
            "the board samples at {LEAST_HZ} to {MOST_HZ} Hz, not at {} Hz",
            tidy(hz, 6)
        );
    }
    Ok(())
}

/// Number of a range of the accelerometer.
fn acc_range(g: f64) -> Result<u8> {
    match ACC_RANGES_G.iter().position(|full| *full == g) {
        Some(range) => Ok(range as u8),
        None => misused!(
            help = "write `board set acc-range 1.5`",
            "the accelerometer has ranges of 1.5, 2, 4 and 6 g, not {} g",
            tidy(g, 6)
        ),
    }
}

/// A scale factor in fixed point.
fn scale(dps_per_count: f64) -> Result<i32> {
    match fixed(dps_per_count, Q24, "scale") {
        Ok(value) if value > 0 => Ok(value),
        Ok(_) => misused!(
            help = "0.07326 is the nominal one at 320 deg/s",
            "a scale factor of {} deg/s for each count turns the rate around or off",
            tidy(dps_per_count, 6)
        ),
        Err(error) => Err(misuse(error.as_ref())),
    }
}

/// Code of a range of the gyros, where one is asked for.
fn gyro_range(range: Option<u16>, filter: Option<u8>) -> Result<Option<u8>> {
    let Some(dps) = range else {
        if filter.is_none() {
            misused!(
                help = "write `board set gyro --range 160 --filter 3`",
                "nothing to set: neither range nor filter"
            );
        }
        return Ok(None);
    };
    let is_it = |code: &u8| gyro_range_dps(*code) == Some(f64::from(dps));
    match [4u8, 2, 1].into_iter().find(is_it) {
        Some(code) => Ok(Some(code)),
        None => misused!(
            help = "write `board set gyro --range 320`",
            "the gyros have ranges of 320, 160 and 80 deg/s, not {dps} deg/s"
        ),
    }
}

/// What the board divides its clock by for a speed of the line.
fn divisor_of(baud: u32) -> Result<u16> {
    match divisor(baud) {
        Some(divisor) => Ok(divisor),
        None => misused!(
            help = "9600, 19200, 38400, 76800, 250000 and 500000 baud are within 0.2 %",
            "the board's 16 MHz come no nearer than 2 % to {baud} baud"
        ),
    }
}

fn rate(hello: &Hello, hz: f64) -> Result<Command> {
    is_rate(hz)?;
    let ticks = (1e9 / f64::from(hello.tick_ns.max(1)) / hz).round();
    // A period that the 16-bit timer cannot hold is that many shorter ones.
    let periods = (ticks / LONGEST_PERIOD).ceil();
    if periods > 4.0 || ticks < 1.0 {
        return Err(LinkError::Refused {
            command: "set rate",
            code: wire::code::SET_RATE,
            status: Status::BadArgument,
        }
        .into());
    }
    let (needed, has) = (
        hz * Sample::FRAME_LEN as f64 * 10.0,
        baud_of(hello.baud_divisor),
    );
    if needed > LINE_SHARE * has {
        let fits = [38_400u32, 76_800, 250_000, 500_000]
            .into_iter()
            .find(|baud| f64::from(*baud) * LINE_SHARE > needed);
        let help = match fits {
            Some(baud) => format!("`imu-stand board set baud {baud}` first"),
            None => "no speed that the board has carries that".to_owned(),
        };
        miette::bail!(
            help = help,
            "samples at {hz} Hz need {needed:.0} bit/s, the line has {has:.0}: the board would drop frames"
        );
    }
    Ok(Command::SetRate {
        period_ticks: (ticks / periods).round() as u16,
        periods_per_sample: periods as u8,
    })
}

fn gyro(hello: &Hello, range: Option<u16>, filter: Option<u8>) -> Result<Command> {
    Ok(Command::SetGyro {
        range: gyro_range(range, filter)?.unwrap_or(hello.gyro_range),
        filter: filter.unwrap_or(hello.gyro_filter),
    })
}

/// Sets both ends. A reply that is lost leaves open which speed the board has: it is looked for at both.
fn set_baud(session: &mut Session, hello: &Hello, baud: u32) -> Result<()> {
    let new = divisor_of(baud)?;
    let rate = super::show::rate_hz(hello).unwrap_or(0.0);
    if rate * Sample::FRAME_LEN as f64 * 10.0 > LINE_SHARE * f64::from(baud) {
        let fits = (LINE_SHARE * f64::from(baud) / (Sample::FRAME_LEN as f64 * 10.0)).floor();
        let help = match fits >= 1.0 {
            true => format!("lower the rate first: `imu-stand board set rate {fits}`"),
            false => "the board samples at 1 Hz or faster: a faster line, `imu-stand board set baud 38400`, carries that".to_owned(),
        };
        miette::bail!(
            help = help,
            "{baud} baud do not carry the samples of {rate:.1} Hz"
        );
    }
    let link = &mut session.link;
    let old = link.baud();
    let command = Command::SetBaud { divisor: new };
    match link.ask_any(command, |_| {}) {
        Ok(reply) => drop(link::done(&command, reply)?),
        Err(LinkError::Unknown { .. } | LinkError::NoReply { .. }) => {}
        Err(error) => return Err(error.into()),
    }
    // What was queued on the board goes out at the old speed first.
    std::thread::sleep(Duration::from_millis(150));
    link.set_own_baud(baud)?;
    if link.ask(Command::Ping).is_err() {
        link.set_own_baud(old)?;
        let at_old = link.ask(Command::Ping).is_ok();
        let where_is = if at_old {
            format!("it still answers at {old} baud")
        } else {
            format!("it answers neither there nor at {old} baud")
        };
        return Err(LinkError::NotAsAsked {
            what: format!("the board does not answer at {baud} baud; {where_is}"),
            help: "a reset brings the stored speed back, 38400 baud if none is stored; long cables want slow lines"
                .to_owned(),
        }
        .into());
    }
    session.show_info()?;
    if !session.quiet {
        say!("  from now on: --baud {baud}");
    }
    unsaved(session);
    Ok(())
}

/// Whether the hello frame says that the set-up is the stored one.
fn is_stored(hello: &Hello) -> bool {
    matches!(hello.config_source, 1 | 2)
}

pub fn store(session: &mut Session) -> Result<()> {
    let before = session.link.ask_hello()?;
    match session.link.ask(Command::StoreConfig) {
        Ok(_) => {}
        // The reply was lost: a set-up that was not stored and now is has been stored by this.
        Err(LinkError::Unknown { .. })
            if !is_stored(&before) && is_stored(&session.link.ask_hello()?) => {}
        Err(error) => return Err(error.into()),
    }
    session.show_info()
}

pub fn load(session: &mut Session) -> Result<()> {
    session.link.ask(Command::LoadConfig)?;
    session.show_info()
}

pub fn defaults(session: &mut Session) -> Result<()> {
    session.link.ask(Command::DefaultConfig)?;
    session.show_info()?;
    unsaved(session);
    Ok(())
}

/// How long a board may take to come back: 16 ms of watchdog, 250 ms of sensors' start, and a hello frame.
const BACK_WITHIN: Duration = Duration::from_secs(4);

pub fn reboot(session: &mut Session) -> Result<()> {
    let before = session.link.ask_hello()?;
    match session.link.ask(Command::Reboot) {
        Ok(_) | Err(LinkError::Unknown { .. }) => {}
        Err(error) => return Err(error.into()),
    }
    // What was changed and not stored goes with the reset, the speed of the line with it.
    session.link.hello = None;
    let began = Instant::now();
    while session.link.hello.is_none() && began.elapsed() < BACK_WITHIN {
        session.link.read()?;
        while session.link.next().is_some() {}
    }
    let restarted = |hello: &Hello| hello.restarts != before.restarts || hello.next_seq == 0;
    let hello = match session.link.hello {
        Some(hello) => hello,
        None => session.link.ask_hello()?,
    };
    if !restarted(&hello) {
        return Err(LinkError::NotAsAsked {
            what: "the board answers as before: it has not restarted".to_owned(),
            help: "repeat the command".to_owned(),
        }
        .into());
    }
    session.show_info()
}
