//! `imu-stand capture`.

use std::fs::OpenOptions;
use std::io::{Read, Write};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use clap::Args;
use imu_stand::capture::Calibration;
use imu_stand::{RecordBuilder, text};
use miette::{IntoDiagnostic, Result, WrapErr};
use wire::{Command, Decoder, Frame, Request, encode_request};

/// What `capture` takes.
#[derive(Args)]
pub struct Arguments {
    /// The serial port, /dev/ttyUSB0 or COM3
    #[arg(long)]
    port: String,
    /// Speed of the line
    #[arg(long, default_value_t = 38_400)]
    baud: u32,
    /// The capture to write; the raw bytes go beside it, with the ending .raw
    #[arg(long)]
    out: PathBuf,
    /// How long, s; without it until Ctrl-C
    #[arg(long)]
    seconds: Option<f64>,
    /// Print nothing but errors
    #[arg(long, short)]
    quiet: bool,
}

/// How long a read waits before it looks whether it is time to stop.
const READ_TIMEOUT: Duration = Duration::from_millis(200);
/// Silence after which the user is told.
const SILENCE: Duration = Duration::from_secs(3);

/// Runs it.
pub fn run(arguments: &Arguments) -> Result<()> {
    let mut port = serialport::new(&arguments.port, arguments.baud)
        .timeout(READ_TIMEOUT)
        .open()
        .into_diagnostic()
        .wrap_err_with(|| {
            format!(
                "cannot open {}: is the board connected, and may you use the port?",
                arguments.port
            )
        })?;
    let raw_path = arguments.out.with_extension("raw");
    let mut raw = OpenOptions::new()
        .create(true)
        .append(true)
        .open(&raw_path)
        .into_diagnostic()
        .wrap_err_with(|| format!("cannot write {}", raw_path.display()))?;
    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed)).into_diagnostic()?;
    let mut hello = [0; Request::FRAME_LEN];
    let request = Request {
        number: 1,
        command: Command::GetHello,
    };
    encode_request(&request, &mut hello).into_diagnostic()?;
    port.write_all(&hello).into_diagnostic()?;

    let (mut decoder, mut builder) = (Decoder::new(), RecordBuilder::new(Calibration::default()));
    let (start, mut heard, mut shown) = (Instant::now(), Instant::now(), Instant::now());
    let mut buffer = [0; 512];
    while !stop.load(Ordering::Relaxed)
        && arguments
            .seconds
            .is_none_or(|seconds| start.elapsed().as_secs_f64() < seconds)
    {
        let count = match port.read(&mut buffer) {
            Ok(count) => count,
            Err(error) if error.kind() == std::io::ErrorKind::TimedOut => 0,
            Err(error) => {
                eprintln!("the port fell silent: {error}; what was received is kept");
                break;
            }
        };
        raw.write_all(&buffer[..count]).into_diagnostic()?;
        for &byte in &buffer[..count] {
            if let Some(Ok(frame)) = decoder.push(byte) {
                heard = Instant::now();
                match frame {
                    Frame::Sample(sample) => builder.push(&sample, start.elapsed().as_secs_f64()),
                    Frame::Hello(hello) => builder.hello(&hello),
                    Frame::Health(_) | Frame::Reply(_) => {}
                }
            }
        }
        if heard.elapsed() > SILENCE {
            eprintln!(
                "no frame for {} s: check the cable and the baud rate",
                SILENCE.as_secs()
            );
            heard = Instant::now();
        }
        if !arguments.quiet && shown.elapsed() > Duration::from_secs(1) {
            shown = Instant::now();
            eprintln!(
                "{:>6.0} s  {} samples, {}",
                start.elapsed().as_secs_f64(),
                builder.len(),
                text::link(decoder.counts())
            );
        }
    }
    if builder.is_empty() {
        miette::bail!(
            help = "check the cable, the port and the baud rate; the raw bytes are kept",
            "no sample arrived on {}",
            arguments.port
        );
    }
    imu_stand::write_capture(&arguments.out, &builder.build())?;
    if !arguments.quiet {
        say!(
            "{}: {} samples, {}",
            arguments.out.display(),
            builder.len(),
            text::link(decoder.counts())
        );
    }
    Ok(())
}
