//! An ATmega16 at 16 MHz and 5 V, for tests: it runs an image, and a [`Board`] round it answers its pins.
//!
//! simavr executes the instructions; its core times each as the data sheet does. Everything else - ports, timers,
//! USART, SPI, ADC, EEPROM, watchdog, interrupts, sleep, resets - is written here by the data sheet, because simavr's
//! ATmega16 deviates from it in more than twenty ways (docs/simulator.md has the table, tests/ holds both to it).
//! What a program uses and this model has not ends the run with [`Stop::Unmodelled`], which says what.
//!
//! Times are cycles since power came on; resets do not set them back. A write of a register takes effect at the start
//! of its instruction. Not modelled at all: levels in volts, oscillator start-up and tolerance, brown-out (but as a
//! [`ResetCause`]), JTAG.

mod chip;
mod converter;
mod core;
mod elf;
mod memory;
mod pins;
pub mod register;
mod spi;
mod timer;
mod usart;

use crate::chip::Chip;
use crate::core::{Core, Ran, SRAM};
pub use crate::elf::{Image, LoadError};
pub use crate::memory::{EEPROM_WRITE, WATCHDOG};
pub use crate::pins::{Pins, Port, Pwm};

/// The crystal.
pub const CLOCK_HZ: u32 = 16_000_000;
/// Cycles from an interrupt to the first instruction at its vector.
const ENTRY: u64 = 4;
/// And so many more out of sleep.
const WAKE: u64 = 4;

/// What is round the chip. Times are cycles since power came on.
pub trait Board {
    /// Eight bits have gone out on MOSI, the last at cycle `at`; returns what came in on MISO.
    fn spi_byte(&mut self, at: u64, mosi: u8, pins: &Pins) -> u8;
    /// The voltage at ADC input 0..=7 at cycle `at`, V.
    fn adc_volts(&mut self, at: u64, channel: u8) -> f64;
    /// The voltage at AREF, V.
    fn aref_volts(&self) -> f64;
    /// A byte has gone out on TXD, the end of its stop bit at cycle `at`, each of its bits so many cycles long.
    fn uart_byte(&mut self, at: u64, byte: u8, bit: u64);
    /// A port has changed.
    fn pins_changed(&mut self, at: u64, pins: &Pins);
    /// OC2 puts out something else.
    fn motor_changed(&mut self, _at: u64, _motor: &Pwm) {}
    /// An interrupt is taken, its number counted from 0 (reset). `at` is the cycle of its flag, if the processor slept.
    fn interrupt(&mut self, _at: u64, _vector: u8) {}
    /// The voltage at AVCC, V.
    fn avcc_volts(&self) -> f64 {
        5.0
    }
}

/// Why the chip starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ResetCause {
    /// Power comes on.
    PowerOn,
    /// The RESET pin.
    External,
    /// The supply sagged.
    BrownOut,
    /// The watchdog.
    Watchdog,
}

impl ResetCause {
    /// Its flag in MCUCSR.
    #[must_use]
    pub fn flag(self) -> u8 {
        1 << self as u8
    }
}

/// Why [`Mcu::run_until`] came back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Stop {
    /// The cycle has come.
    Reached,
    /// It sleeps with interrupts and watchdog off: nothing but a reset will wake it.
    Halted,
    /// No instruction at this address.
    Crashed {
        /// Byte address.
        at: u32,
    },
    /// The program uses something that is not modelled.
    Unmodelled(&'static str),
}

/// Resets since power came on, and when the last was.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Resets {
    /// By the watchdog.
    pub watchdog: u32,
    /// Cycle of the last one.
    pub last_at: u64,
}

/// The chip.
pub struct Mcu {
    core: Core,
    image: Image,
    asleep: bool,
    /// One instruction runs before the next interrupt.
    shielded: bool,
    slept: u64,
    stack: StackWatch,
    watched: bool,
    resets: Resets,
}

impl Mcu {
    /// A chip with this image, power just on. EEPROM as the image has it, else erased; SRAM holds what it held by
    /// chance.
    ///
    /// # Errors
    /// [`LoadError`] for what is no image of an ATmega16.
    pub fn new(elf: &[u8]) -> Result<Self, LoadError> {
        Ok(Self::with_image(Image::read(elf)?))
    }

    /// As [`Mcu::new`], from an image that has been read.
    #[must_use]
    pub fn with_image(image: Image) -> Self {
        let mut mcu = Mcu {
            core: Core::new(&image.flash),
            image,
            asleep: false,
            shielded: false,
            slept: 0,
            stack: StackWatch::default(),
            watched: false,
            resets: Resets::default(),
        };
        if let Some(eeprom) = mcu.image.eeprom.clone() {
            mcu.set_eeprom(&eeprom);
        }
        mcu.fill_sram();
        mcu
    }

    /// SRAM at power-on holds anything: reproducible, but no zeros to rely on.
    fn fill_sram(&mut self) {
        let mut state = self.cycle() ^ 0x2545_f491_4f6c_dd1d;
        for byte in &mut self.core.data_mut()[SRAM..] {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            *byte = (state >> 32) as u8;
        }
    }

    /// The image it runs.
    #[must_use]
    pub fn image(&self) -> &Image {
        &self.image
    }

    /// Cycles since power first came on.
    #[must_use]
    pub fn cycle(&self) -> u64 {
        self.core.cycle()
    }

    /// Of these, how many it slept.
    #[must_use]
    pub fn slept(&self) -> u64 {
        self.slept
    }

    /// Address of the next instruction, bytes.
    #[must_use]
    pub fn program_counter(&self) -> u32 {
        self.core.program_counter()
    }

    /// Wakes the processor, to go on at an address in bytes: for planting a program that hangs. False, and nothing done, unless
    /// it sleeps with interrupts on, when no instruction is half done.
    pub fn wake_at(&mut self, address: u32) -> bool {
        let sleeps = self.asleep && self.core.interrupts_enabled();
        if sleeps {
            self.asleep = false;
            self.core.set_program_counter(address);
        }
        sleeps
    }

    fn chip(&self) -> &Chip {
        self.core.chip()
    }

    /// The host sends a byte to RXD, after those that are on their way; at the pace of [`Mcu::set_host_bit`], or as
    /// the USART is set.
    pub fn send(&mut self, byte: u8) {
        let at = self.cycle();
        self.send_at(at, byte);
    }

    /// As [`Mcu::send`], not before a cycle. Returns when its start bit begins and how long a bit is, cycles.
    pub fn send_at(&mut self, at: u64, byte: u8) -> (f64, f64) {
        let at = at.max(self.cycle());
        self.core.chip_mut().usart.host_sends(at, byte, true)
    }

    /// As [`Mcu::send`], with a stop bit that is low.
    pub fn send_without_stop_bit(&mut self, byte: u8) {
        let at = self.cycle();
        self.core.chip_mut().usart.host_sends(at, byte, false);
    }

    /// The host's time for a bit in cycles of this chip; `None`: whatever the USART is set to when a byte is sent.
    pub fn set_host_bit(&mut self, cycles: Option<f64>) {
        self.core.chip_mut().usart.set_host_bit(cycles);
    }

    /// Bytes of the host still on their way.
    #[must_use]
    pub fn host_queue(&self) -> usize {
        self.chip().usart.host_queue(self.cycle())
    }

    /// What the ports drive.
    #[must_use]
    pub fn pins(&self) -> Pins {
        self.chip().pins
    }

    /// The outside drives pins of a port to levels.
    pub fn drive(&mut self, port: Port, mask: u8, levels: u8) {
        self.core.chip_mut().drive(port, mask, levels);
    }

    /// The outside lets go of pins.
    pub fn release(&mut self, port: Port, mask: u8) {
        self.core.chip_mut().release(port, mask);
    }

    /// Writes a register of [`register`] as the program could: for planting what an error in it would do.
    pub fn write_register(&mut self, address: u8, value: u8) {
        let now = self.cycle();
        // What it asks of the processor concerns an instruction, and none is running.
        let _effect = self.core.chip_mut().write(address, value, now);
    }

    /// What OC2 puts out, from timer 2's registers. A pin left connected while its timer stands counts as high.
    #[must_use]
    pub fn motor_pwm(&self) -> Pwm {
        self.chip().motor_pwm()
    }

    /// Cycles for a bit as the USART is set.
    #[must_use]
    pub fn uart_bit_cycles(&self) -> u64 {
        self.chip().usart.bit_cycles()
    }

    /// Looks at the stack pointer after every instruction from now on: two to three times slower while awake.
    pub fn watch_stack(&mut self) {
        self.watched = true;
        self.stack = StackWatch::default();
    }

    /// The lowest stack pointer since [`Mcu::watch_stack`], leaving out the time after a reset before the program
    /// sets it; `None` when not watched.
    #[must_use]
    pub fn min_stack_pointer(&self) -> Option<u16> {
        self.stack.lowest.filter(|_| self.watched)
    }

    /// SRAM, from 0x60 on.
    #[must_use]
    pub fn sram(&self) -> &[u8] {
        &self.core.data()[SRAM..]
    }

    /// SRAM, for planting what was there by chance.
    pub fn sram_mut(&mut self) -> &mut [u8] {
        &mut self.core.data_mut()[SRAM..]
    }

    /// EEPROM, 512 bytes.
    #[must_use]
    pub fn eeprom(&self) -> &[u8] {
        &self.chip().eeprom.bytes
    }

    /// Sets the EEPROM from its start on.
    ///
    /// # Panics
    /// For more than 512 bytes.
    pub fn set_eeprom(&mut self, bytes: &[u8]) {
        let eeprom = &mut self.core.chip_mut().eeprom.bytes;
        eeprom[..bytes.len()].copy_from_slice(bytes);
    }

    /// Resets since power came on.
    #[must_use]
    pub fn resets(&self) -> Resets {
        self.resets
    }

    /// Power goes and comes back at once: SRAM is lost, EEPROM stays but for a byte that was being written.
    pub fn power_cycle(&mut self) {
        self.reset(ResetCause::PowerOn);
    }

    /// A reset. The board learns of the pins when the chip next runs.
    pub fn reset(&mut self, cause: ResetCause) {
        let now = self.cycle();
        self.core.chip_mut().reset(cause, now);
        self.core.restart();
        if cause == ResetCause::PowerOn {
            self.fill_sram();
        }
        (self.asleep, self.shielded) = (false, false);
        self.resets.last_at = now;
    }

    /// Runs until a cycle, or a little longer: until the instruction that passes it has ended.
    pub fn run_until(&mut self, cycle: u64, board: &mut dyn Board) -> Stop {
        loop {
            let now = self.core.cycle();
            let bites = self.core.chip_mut().process(now, board);
            if bites {
                self.resets.watchdog += 1;
                self.reset(ResetCause::Watchdog);
                continue;
            }
            if let Some(what) = self.chip().unmodelled {
                return Stop::Unmodelled(what.0);
            }
            if now >= cycle {
                return Stop::Reached;
            }
            if self.core.interrupts_enabled()
                && !self.shielded
                && let Some(vector) = self.core.chip_mut().pending(now)
            {
                let wake = if self.asleep { WAKE } else { 0 };
                self.asleep = false;
                self.core.chip_mut().taken(vector);
                board.interrupt(now, vector);
                self.core.call(vector);
                self.core.set_cycle(now + ENTRY + wake);
                self.look_at_stack();
                continue;
            }
            let next = self.core.chip_mut().next(now);
            let until = next.map_or(cycle, |next| next.clamp(now + 1, cycle));
            if self.asleep {
                if !self.core.interrupts_enabled() && self.chip().watchdog.next().is_none() {
                    return Stop::Halted;
                }
                self.slept += until - now;
                self.core.set_cycle(until);
                continue;
            }
            let cycles = if self.shielded || self.watched {
                1
            } else {
                until - now
            };
            self.shielded = false;
            match self.core.run(cycles) {
                Ran::On => {}
                Ran::Enabled => self.shielded = true,
                Ran::Sleep => {
                    let now = self.core.cycle();
                    self.asleep = self.core.chip_mut().sleep(now);
                }
                Ran::Crash => {
                    let at = self.core.program_counter();
                    return Stop::Crashed { at };
                }
            }
            self.look_at_stack();
        }
    }

    fn look_at_stack(&mut self) {
        if self.watched {
            let pointer = self.core.stack_pointer();
            self.stack.see(pointer);
        }
    }
}

/// The lowest stack pointer, seen after each instruction.
#[derive(Clone, Copy, Debug, Default)]
struct StackWatch {
    last: u16,
    /// Looks for which a changed high byte may wait for its low byte.
    half: u8,
    lowest: Option<u16>,
}

impl StackWatch {
    fn see(&mut self, pointer: u16) {
        /// gcc's prologue restores SREG between the two bytes.
        const PATIENCE: u8 = 3;
        let [low, high] = pointer.to_le_bytes();
        let [last_low, last_high] = self.last.to_le_bytes();
        self.half = match self.half {
            _ if low != last_low => 0,
            0 if high != last_high => PATIENCE,
            half => half.saturating_sub(1),
        };
        self.last = pointer;
        if self.half == 0 && usize::from(pointer) >= SRAM {
            self.lowest = Some(self.lowest.map_or(pointer, |lowest| lowest.min(pointer)));
        }
    }
}
