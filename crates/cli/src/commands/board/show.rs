//! What the board says of itself: hello and health, in words and as JSON.

use std::collections::BTreeMap;
use std::fmt::Write;

use clap::{Args, ValueEnum};
use imu_stand::link::{Heard, baud_of};
use miette::Result;
use serde::Serialize;
use wire::{Hello, reset_cause};

use super::Session;

/// Q16.16 deg/s.
pub const Q16: f64 = 65_536.0;
/// Q8.24 deg/s for each count.
pub const Q24: f64 = 16_777_216.0;
/// The ATmega16's: a board that says more of its stack has none of its own.
const SRAM_BYTES: u16 = 1024;
/// Full scales of the accelerometer, g, by the code of g-select.
pub const ACC_RANGES_G: [f64; 4] = [1.5, 2.0, 4.0, 6.0];

/// The hello frame, decoded.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Info {
    format: &'static str,
    port: String,
    firmware: String,
    board_id: u16,
    reset_cause: Vec<&'static str>,
    resets_since_power_on: u16,
    next_seq: u16,
    /// Samples a second.
    pub rate_hz: f64,
    tick_s: f64,
    period_ticks: u16,
    periods_per_sample: u8,
    /// Speed of the line.
    pub baud: f64,
    /// Full scale of the gyros; null where the code is none of the part's.
    pub gyro_range_dps: Option<f64>,
    /// M: 2^M taps in each of the filter's two stages.
    pub gyro_filter: u8,
    gyro_sample_period: u8,
    /// Full scale of the accelerometer; null where the code is none of the part's.
    pub acc_range_g: Option<f64>,
    /// Where the set-up came from.
    pub config_source: &'static str,
    /// Subtracted from each rate, x, y, z.
    pub bias_dps: [f64; 3],
    /// x, y, z.
    pub scale_dps_per_count: [f64; 3],
    /// Number of the correction in use; null where none is.
    correction: Option<u16>,
    /// Whether the gyros are set as it was made for: else its rates mean nothing.
    correction_fits: Option<bool>,
    /// What it was made for, in words.
    #[serde(skip)]
    correction_for: String,
    #[serde(skip)]
    sens_avg: u16,
}

/// SENS/AVG in words.
pub fn gyros_at(sens_avg: u16) -> String {
    let [filter, range] = sens_avg.to_le_bytes();
    let range = gyro_range_dps(range).map_or_else(|| "?".to_owned(), |range| range.to_string());
    format!("{range} deg/s, filter {filter}")
}

/// Full scale of a gyro by SENS/AVG bits 10:8, deg/s.
pub fn gyro_range_dps(code: u8) -> Option<f64> {
    match code {
        4 => Some(320.0),
        2 => Some(160.0),
        1 => Some(80.0),
        _ => None,
    }
}

/// Samples a second; `None` where the frame makes no sense.
pub fn rate_hz(hello: &Hello) -> Option<f64> {
    // Whole nanoseconds: 4000 ns times 1000 is 250 Hz and not 249.999.
    let period_ns = u64::from(hello.tick_ns)
        * u64::from(hello.period_ticks)
        * u64::from(hello.periods_per_sample.max(1));
    (period_ns > 0).then(|| 1e9 / period_ns as f64)
}

impl Info {
    /// Of a frame that came from `port`.
    pub fn of(hello: &Hello, port: &str) -> Self {
        let [major, minor, patch] = hello.firmware;
        let causes = [
            (reset_cause::POWER_ON, "power-on"),
            (reset_cause::EXTERNAL, "reset pin"),
            (reset_cause::BROWN_OUT, "brown-out"),
            (reset_cause::WATCHDOG, "watchdog or reboot"),
            (reset_cause::JTAG, "JTAG"),
        ];
        Info {
            format: "imu-stand-board/1",
            port: port.to_owned(),
            firmware: format!("{major}.{minor}.{patch}"),
            board_id: hello.board_id,
            reset_cause: causes
                .iter()
                .filter(|(bit, _)| hello.reset_cause & bit != 0)
                .map(|(_, name)| *name)
                .collect(),
            resets_since_power_on: hello.restarts,
            next_seq: hello.next_seq,
            rate_hz: rate_hz(hello).unwrap_or(f64::NAN),
            tick_s: f64::from(hello.tick_ns) / 1e9,
            period_ticks: hello.period_ticks,
            periods_per_sample: hello.periods_per_sample,
            baud: baud_of(hello.baud_divisor),
            gyro_range_dps: gyro_range_dps(hello.gyro_range),
            gyro_filter: hello.gyro_filter,
            gyro_sample_period: hello.gyro_sample_period,
            acc_range_g: ACC_RANGES_G.get(usize::from(hello.acc_range)).copied(),
            config_source: match hello.config_source {
                0 => "built in",
                1 => "EEPROM, first copy",
                2 => "EEPROM, second copy",
                3 => "changed since it was loaded, not stored",
                _ => "unknown",
            },
            bias_dps: hello.bias.map(|b| f64::from(b) / Q16),
            scale_dps_per_count: hello.scale.map(|s| f64::from(s) / Q24),
            correction: None,
            correction_fits: None,
            correction_for: String::new(),
            sens_avg: u16::from_le_bytes([hello.gyro_filter, hello.gyro_range]),
        }
    }

    /// Adds the correction in use: its number, and the SENS/AVG that it is for.
    pub fn corrected_by(&mut self, in_use: Option<(u16, u16)>) {
        self.correction = in_use.map(|(number, _)| number);
        self.correction_fits = in_use.map(|(_, sens_avg)| sens_avg == self.sens_avg);
        self.correction_for = in_use.map_or_else(String::new, |(_, sens_avg)| gyros_at(sens_avg));
    }

    /// For people.
    pub fn text(&self) -> String {
        let number = |value: Option<f64>| value.map_or_else(|| "?".to_owned(), |v| v.to_string());
        let mut out = String::new();
        let _ = writeln!(
            out,
            "board {} on {}, firmware {}",
            self.board_id, self.port, self.firmware
        );
        let causes = match self.reset_cause.as_slice() {
            [] => "unknown".to_owned(),
            causes => causes.join(" and "),
        };
        let _ = writeln!(
            out,
            "  last reset   {causes}; {} since power came on",
            self.resets_since_power_on
        );
        let _ = writeln!(out, "  set-up       {}", self.config_source);
        let _ = writeln!(
            out,
            "  rate         {:.4} Hz ({} ticks of {} us)",
            self.rate_hz,
            self.period_ticks,
            (self.tick_s * 1e9).round() / 1e3
        );
        let _ = writeln!(out, "  line         {:.0} baud", self.baud);
        let _ = writeln!(
            out,
            "  gyros        {} deg/s, filter {} ({} taps a stage)",
            number(self.gyro_range_dps),
            self.gyro_filter,
            1u32 << self.gyro_filter.min(31)
        );
        let _ = writeln!(out, "  acc          {} g", number(self.acc_range_g));
        let _ = match self.correction {
            Some(number) if self.correction_fits == Some(false) => writeln!(
                out,
                "  correction   {number:#06x}, not applied: it is for gyros at {}; `board correct --model` writes one for these",
                self.correction_for
            ),
            Some(number) => writeln!(out, "  correction   {number:#06x}, stored and in use"),
            None => writeln!(out, "  correction   none in use"),
        };
        let _ = writeln!(out, "               bias deg/s   scale deg/s/count");
        for ((axis, bias), scale) in ["x", "y", "z"]
            .iter()
            .zip(self.bias_dps)
            .zip(self.scale_dps_per_count)
        {
            let _ = writeln!(out, "  gyro {axis}       {bias:>10.5}   {scale:>10.7}");
        }
        out
    }
}

/// What `health` takes.
#[derive(Args)]
pub struct HealthArguments {
    /// Set all counters to 0 after they were read
    #[arg(long)]
    clear: bool,
    /// Print the counters that are 0, too
    #[arg(long)]
    all: bool,
}

#[derive(Serialize)]
struct HealthAnswer {
    format: &'static str,
    uptime_s: u32,
    next_seq: u16,
    tick_busy_max_s: Option<f64>,
    stack_free_bytes: Option<u16>,
    counters: BTreeMap<&'static str, u16>,
    line: LineAnswer,
}

/// What this end heard, for JSON.
#[derive(Serialize)]
pub struct LineAnswer {
    bytes: u64,
    frames: u32,
    rejected: u32,
    bad_stuffing: u32,
    bad_crc: u32,
    bad_length: u32,
    samples_received: u64,
    samples_lost_by_board: u64,
    samples_lost_by_line: u64,
    samples_lost_unattributed: u64,
    restarts: u64,
}

impl From<&Heard> for LineAnswer {
    fn from(heard: &Heard) -> Self {
        let (counts, losses) = (&heard.counts, &heard.losses);
        LineAnswer {
            bytes: heard.bytes,
            frames: counts.frames,
            rejected: counts.rejected(),
            bad_stuffing: counts.bad_cobs,
            bad_crc: counts.bad_crc,
            bad_length: counts.bad_length,
            samples_received: losses.received,
            samples_lost_by_board: losses.device,
            samples_lost_by_line: losses.line,
            samples_lost_unattributed: losses.unattributed,
            restarts: losses.restarts,
        }
    }
}

pub fn health(session: &mut Session, arguments: &HealthArguments) -> Result<()> {
    let hello = session.link.ask_hello()?;
    let health = session.link.ask_health(arguments.clear)?;
    let answer = HealthAnswer {
        format: "imu-stand-health/1",
        uptime_s: health.uptime_s,
        next_seq: health.next_seq,
        tick_busy_max_s: Some(f64::from(health.tick_busy_max) * f64::from(hello.tick_ns) * 1e-9),
        stack_free_bytes: (health.stack_free <= SRAM_BYTES).then_some(health.stack_free),
        counters: health.faults.iter().map(|(f, n)| (f.name(), n)).collect(),
        line: LineAnswer::from(&session.link.heard()),
    };
    super::super::write_json(session.json.as_ref(), &answer)?;
    if session.quiet {
        return Ok(());
    }
    say!("up for {} s", health.uptime_s);
    if let (Some(busy), Some(rate)) = (answer.tick_busy_max_s, rate_hz(&hello)) {
        say!(
            "longest work of a tick {:.2} ms of {:.2} ms",
            busy * 1e3,
            1e3 / rate
        );
    }
    match answer.stack_free_bytes {
        Some(bytes) => say!("least stack ever left  {bytes} bytes"),
        None => say!("least stack ever left  not measured: this board is simulated on the host"),
    }
    let mut zero = 0;
    for (fault, count) in health.faults.iter() {
        if count > 0 || arguments.all {
            // Counters saturate.
            let least = if count == u16::MAX { "at least " } else { "" };
            say!("  {:<26} {least}{count}", fault.name());
        } else {
            zero += 1;
        }
    }
    if zero > 0 {
        say!("  {zero} counters are 0");
    }
    if arguments.clear {
        say!("and now all of them");
    }
    say!("line: {}", session.link.heard());
    Ok(())
}

/// A value of the set-up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Key {
    /// Hz
    Rate,
    /// deg/s
    GyroRange,
    /// M: 2^M taps in each of two stages
    GyroFilter,
    /// g
    AccRange,
    /// x y z, deg/s
    Bias,
    /// x y z, deg/s for each count
    Scale,
    /// Speed of the line
    Baud,
    /// Number of the board
    BoardId,
    /// Where the set-up came from
    Source,
}

/// What `get` takes.
#[derive(Args)]
pub struct GetArguments {
    /// Which value
    key: Key,
}

pub fn get(session: &mut Session, arguments: &GetArguments) -> Result<()> {
    let info = Info::of(&session.link.ask_hello()?, session.link.name());
    super::super::write_json(session.json.as_ref(), &info)?;
    let three = |values: [f64; 3]| values.map(|v| v.to_string()).join(" ");
    let number = |value: Option<f64>| value.map_or_else(|| "?".to_owned(), |v| v.to_string());
    let text = match arguments.key {
        Key::Rate => info.rate_hz.to_string(),
        Key::GyroRange => number(info.gyro_range_dps),
        Key::GyroFilter => info.gyro_filter.to_string(),
        Key::AccRange => number(info.acc_range_g),
        Key::Bias => three(info.bias_dps),
        Key::Scale => three(info.scale_dps_per_count),
        Key::Baud => format!("{:.0}", info.baud),
        Key::BoardId => info.board_id.to_string(),
        Key::Source => info.config_source.to_owned(),
    };
    if !session.quiet {
        say!("{text}");
    }
    Ok(())
}
