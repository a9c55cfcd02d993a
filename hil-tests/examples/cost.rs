//! What an image of the board costs: `cost IMAGE...` prints a line of `key=value` for each, for `cargo xtask size`.
//!
//! The deepest stack is that of the session of c-reference/session.rs: the lowest the stack pointer ever was, seen after
//! each instruction. The cycles are those of a tick at 20 Hz in order, with its share of everything else that goes on.

use std::process::ExitCode;

use atmega16_sim::{CLOCK_HZ, Mcu};

#[allow(dead_code, unused_imports)]
#[path = "../c-reference/session.rs"]
mod session;

/// Ticks that are measured, at 20 Hz.
const TICKS: u64 = 200;
const TICK: u64 = CLOCK_HZ as u64 / 20;
/// End of SRAM + 1.
const RAM_END: u16 = 0x460;

/// Cycles awake in [`TICKS`] ticks, from the middle of one pause to the middle of another, so many half ticks after the first.
fn awake(
    mcu: &mut Mcu,
    script: &mut session::Script,
    first: u64,
    half_ticks: u64,
) -> Result<u64, String> {
    session::run(mcu, script, first + half_ticks * TICK / 2)?;
    let (from, slept) = (mcu.cycle(), mcu.slept());
    session::run(mcu, script, first + (2 * TICKS + half_ticks) * TICK / 2)?;
    Ok((mcu.cycle() - from) - (mcu.slept() - slept))
}

fn measure(path: &str) -> Result<(), String> {
    let elf = std::fs::read(path).map_err(|error| format!("{path}: {error}"))?;
    let mcu = || Mcu::new(&elf).map_err(|error| format!("{path}: {error}"));

    let mut script = session::Script::default();
    script.quiet = true;
    let mut quiet = mcu()?;
    let first = session::start(&mut quiet, &mut script)?;
    let awake = awake(&mut quiet, &mut script, first, 9)?;
    let mut script = session::Script::default();
    script.quiet = true;
    let mut correcting = mcu()?;
    let first = session::start_corrected(&mut correcting, &mut script)?;
    let corrected = self::awake(&mut correcting, &mut script, first, 201)?;
    let frames = session::frames(&script.line);
    if frames
        .iter()
        .filter(|frame| frame.contains("Corrected("))
        .count()
        < TICKS as usize
    {
        return Err("it does not correct each sample".to_owned());
    }

    let mut busy = mcu()?;
    busy.watch_stack();
    let script = session::play(&mut busy)?;
    let lowest = busy
        .min_stack_pointer()
        .ok_or("no stack pointer was seen")?;
    println!(
        "image={path} cycles={} corrected={} stack={} jitter={} busy_ticks={}",
        awake / TICKS,
        (corrected - awake) / TICKS,
        RAM_END - 1 - lowest,
        session::jitter(&script),
        session::busy_max(&script),
    );
    Ok(())
}

fn main() -> ExitCode {
    let images: Vec<String> = std::env::args().skip(1).collect();
    if images.is_empty() {
        eprintln!("usage: cost IMAGE...: the ELF files of the images to measure");
        return ExitCode::from(2);
    }
    for image in &images {
        if let Err(error) = measure(image) {
            eprintln!("error: {image}: {error}");
            return ExitCode::FAILURE;
        }
    }
    ExitCode::SUCCESS
}
