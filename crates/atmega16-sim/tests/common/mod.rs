//! Compiles small programs for the chip and records what they do.
#![allow(dead_code)]

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicU32, Ordering};

use atmega16_sim::{Board, Mcu, Pins, Port, Pwm, Stop};

/// Compiles a program of tests/programs with avr-gcc.
pub fn compile(name: &str, chip: &str, flags: &[&str]) -> Vec<u8> {
    static NUMBER: AtomicU32 = AtomicU32::new(0);
    let source = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/programs")
        .join(name);
    let number = NUMBER.fetch_add(1, Ordering::Relaxed);
    let out: PathBuf =
        std::env::temp_dir().join(format!("atmega16-sim-{}-{number}.elf", std::process::id()));
    let run = Command::new("avr-gcc")
        .args(["-Os", "-Wall", "-Werror", &format!("-mmcu={chip}")])
        .args(flags)
        .arg("-o")
        .arg(&out)
        .arg(&source)
        .output()
        .expect("avr-gcc runs: apt-get install gcc-avr avr-libc");
    assert!(
        run.status.success(),
        "{}: {}",
        source.display(),
        String::from_utf8_lossy(&run.stderr)
    );
    let elf = std::fs::read(&out).expect("avr-gcc wrote it");
    std::fs::remove_file(&out).expect("it is ours");
    elf
}

/// A chip with a program of tests/programs, compiled with `flags`.
pub fn load(name: &str, flags: &[&str]) -> Mcu {
    Mcu::new(&compile(name, "atmega16", flags)).expect("it is an image")
}

/// Records everything, answers SPI with what it got inverted, and each ADC input with its volts.
pub struct Recorder {
    /// Changes of port B.
    pub port_b: Vec<(u64, u8)>,
    /// Changes of port C.
    pub port_c: Vec<(u64, u8)>,
    pub uart: Vec<(u64, u8)>,
    pub spi: Vec<(u64, u8, Pins)>,
    pub adc: Vec<(u64, u8)>,
    pub motor: Vec<(u64, Pwm)>,
    pub volts: [f64; 8],
    pub aref: f64,
}

impl Recorder {
    pub fn new() -> Self {
        Recorder {
            port_b: Vec::new(),
            port_c: Vec::new(),
            uart: Vec::new(),
            spi: Vec::new(),
            adc: Vec::new(),
            motor: Vec::new(),
            volts: [0.0; 8],
            aref: 3.3,
        }
    }

    /// Cycles at which port B changed.
    pub fn marks(&self) -> Vec<u64> {
        self.port_b.iter().map(|&(at, _)| at).collect()
    }

    /// When port B first became `value`.
    pub fn mark(&self, value: u8) -> u64 {
        let found = self.port_b.iter().find(|&&(_, b)| b == value);
        found
            .unwrap_or_else(|| panic!("mark {value} in {:?}", self.port_b))
            .0
    }
}

impl Board for Recorder {
    fn spi_byte(&mut self, at: u64, mosi: u8, pins: &Pins) -> u8 {
        self.spi.push((at, mosi, *pins));
        !mosi
    }
    fn adc_volts(&mut self, at: u64, channel: u8) -> f64 {
        self.adc.push((at, channel));
        self.volts[usize::from(channel)]
    }
    fn aref_volts(&self) -> f64 {
        self.aref
    }
    fn uart_byte(&mut self, at: u64, byte: u8, _bit: u64) {
        self.uart.push((at, byte));
    }
    fn pins_changed(&mut self, at: u64, pins: &Pins) {
        for (port, list) in [(Port::B, &mut self.port_b), (Port::C, &mut self.port_c)] {
            let value = pins.port[port as usize];
            if list.last().map_or(0, |&(_, last)| last) != value {
                list.push((at, value));
            }
        }
    }
    fn motor_changed(&mut self, at: u64, motor: &Pwm) {
        self.motor.push((at, *motor));
    }
}

/// Runs for so many cycles.
pub fn run(mcu: &mut Mcu, board: &mut Recorder, cycles: u64) -> Stop {
    let until = mcu.cycle() + cycles;
    mcu.run_until(until, board)
}

/// Runs until the program sleeps for good.
pub fn run_to_end(mcu: &mut Mcu, board: &mut Recorder) {
    let until = mcu.cycle() + 160_000_000;
    let stop = mcu.run_until(until, board);
    assert_eq!(stop, Stop::Halted, "the program ends");
}

/// Bytes of a variable of the program.
pub fn variable(mcu: &Mcu, name: &str, len: usize) -> Vec<u8> {
    let address = mcu.image().symbol(name).expect("the program has it");
    let at = (address & 0xffff) as usize - 0x60;
    mcu.sram()[at..at + len].to_vec()
}

/// A 16-bit variable.
pub fn word(mcu: &Mcu, name: &str) -> u16 {
    let bytes = variable(mcu, name, 2);
    u16::from_le_bytes([bytes[0], bytes[1]])
}

/// A byte.
pub fn byte(mcu: &Mcu, name: &str) -> u8 {
    variable(mcu, name, 1)[0]
}

/// Differences of neighbours.
pub fn steps(times: &[u64]) -> Vec<u64> {
    times.windows(2).map(|pair| pair[1] - pair[0]).collect()
}
