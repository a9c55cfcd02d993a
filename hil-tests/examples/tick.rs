//! Where the cycles of a sample go: `tick IMAGE` runs it at 20 Hz in order, instruction by instruction, and prints the
//! cycles of each kind of work for one sample, with its share of the milliseconds and of the serial line.

use std::process::ExitCode;

use atmega16_sim::{CLOCK_HZ, Mcu};

#[allow(dead_code, unused_imports)]
#[path = "../c-reference/session.rs"]
mod session;

/// Ticks that are measured, at 20 Hz: a second, so that a health frame has its share.
const TICKS: u64 = 20;
const TICK: u64 = CLOCK_HZ as u64 / 20;

/// Kinds of work, and what marks the names of their functions; the first that fits counts.
const KINDS: [(&str, &[&str]); 8] = [
    (
        "the tick's interrupts, guard and ADC",
        &["__vector_6", "__vector_7", "7convert"],
    ),
    (
        "SPI: three gyros, four rounds with their pauses",
        &["7acquire", "7sensors", "8Register"],
    ),
    (
        "framing: COBS, CRC-32C, into the queue",
        &["4cobs", "3crc", "6serial4send", "3put"],
    ),
    ("serial interrupts", &["__vector_11", "__vector_12"]),
    (
        "milliseconds: motor, EEPROM, health",
        &[
            "__vector_19",
            "14on_millisecond",
            "5motor",
            "set_motor",
            "6health",
            "stack_free",
        ],
    ),
    (
        "scaling, flags, counters",
        &[
            "9on_sample",
            "4gyro",
            "16look_after",
            "13accelerometer",
            "mul",
            "6record",
            "5count",
            "5fixed",
            "4word",
        ],
    ),
    ("main loop", &["main", "4tick", "6serial", "5board"]),
    ("else", &[""]),
];

fn measure(path: &str) -> Result<(), String> {
    let elf = std::fs::read(path).map_err(|error| format!("{path}: {error}"))?;
    let mut mcu = Mcu::new(&elf).map_err(|error| format!("{path}: {error}"))?;
    let mut symbols: Vec<(u32, String)> = mcu
        .image()
        .symbols
        .iter()
        .filter(|(name, at)| {
            // The linker's constants are no places in the code.
            let constant = name.starts_with("__") && (name.ends_with("__") || name == "__stack");
            *at < 0x80_0000 && !name.starts_with('.') && !name.starts_with("__data") && !constant
        })
        .map(|(name, at)| (*at, name.clone()))
        .collect();
    symbols.sort();
    let mut script = session::Script::default();
    script.quiet = true;
    let first = session::start(&mut mcu, &mut script)?;
    session::run(&mut mcu, &mut script, first + 9 * TICK / 2)?;
    let (from, slept_before) = (mcu.cycle(), mcu.slept());
    let mut cycles = [0u64; KINDS.len()];
    while mcu.cycle() < from + TICKS * TICK {
        let (at, before, slept) = (mcu.program_counter(), mcu.cycle(), mcu.slept());
        session::run(&mut mcu, &mut script, before + 1)?;
        let awake = (mcu.cycle() - before) - (mcu.slept() - slept);
        if awake == 0 {
            continue;
        }
        let place = symbols.partition_point(|(start, _)| *start <= at);
        let name = place
            .checked_sub(1)
            .map_or("", |place| symbols[place].1.as_str());
        let kind = KINDS
            .iter()
            .position(|(_, marks)| marks.iter().any(|mark| name.contains(mark)))
            .unwrap_or(KINDS.len() - 1);
        cycles[kind] += awake;
    }
    let (spent, slept) = (mcu.cycle() - from, mcu.slept() - slept_before);
    for ((kind, _), cycles) in KINDS.iter().zip(cycles) {
        println!("{kind:50} {:8}", cycles / TICKS);
    }
    println!("{:50} {:8}", "asleep", slept / TICKS);
    println!("{:50} {:8}", "a tick at 20 Hz", spent / TICKS);
    println!(
        "{:50} {:7.1} %",
        "idle share",
        100.0 * slept as f64 / spent as f64
    );
    Ok(())
}

fn main() -> ExitCode {
    let Some(image) = std::env::args().nth(1) else {
        eprintln!("usage: tick IMAGE: the ELF file of the image to measure");
        return ExitCode::from(2);
    };
    match measure(&image) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
