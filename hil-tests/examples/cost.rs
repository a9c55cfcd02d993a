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

fn measure(path: &str) -> Result<(), String> {
    let elf = std::fs::read(path).map_err(|error| format!("{path}: {error}"))?;
    let mcu = || Mcu::new(&elf).map_err(|error| format!("{path}: {error}"));

    let mut quiet = mcu()?;
    let mut script = session::Script::default();
    script.quiet = true;
    let first = session::start(&mut quiet, &mut script)?;
    // From the middle of one pause to the middle of another.
    session::run(&mut quiet, &mut script, first + 9 * TICK / 2)?;
    let (from, slept) = (quiet.cycle(), quiet.slept());
    session::run(&mut quiet, &mut script, first + (2 * TICKS + 9) * TICK / 2)?;
    let awake = (quiet.cycle() - from) - (quiet.slept() - slept);

    let mut busy = mcu()?;
    busy.watch_stack();
    let script = session::play(&mut busy)?;
    let lowest = busy
        .min_stack_pointer()
        .ok_or("no stack pointer was seen")?;
    println!(
        "image={path} cycles={} stack={} jitter={} busy_ticks={}",
        awake / TICKS,
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
