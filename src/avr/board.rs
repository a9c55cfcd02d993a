//! Motor, EEPROM, watchdog, reset cause, stack.

use avr_device::atmega16::{CPU, EEPROM, PORTC, PORTD, TC2, WDT};
use avr_device::interrupt;
use firmware::math::sum;
use firmware::{Board, Job};

use super::{serial, tick};

/// PWM of the motor: OC2 = PD7; direction: PD6.
const MOTOR_PWM: u8 = 1 << 7;
const MOTOR_DIRECTION: u8 = 1 << 6;
/// The motor's stop: PD2 = INT0, low where a contact to ground is closed; its pull-up holds it high.
pub const STOP: u8 = 1 << 2;
/// Fast PWM, clock / 8: 7.8 kHz, which common bridge drivers follow.
const FAST_PWM: u8 = 1 << 6 | 1 << 3 | 2;
/// Non-inverting output on OC2.
const PWM_TO_PIN: u8 = 1 << 5;
const RESET_FLAGS: u8 = 0x1f;
const POWER_ON: u8 = 1;
const EERE: u8 = 1;
const EEWE: u8 = 1 << 1;
const EEMWE: u8 = 1 << 2;
const STACK_POINTER: *const usize = 0x5d as *const usize;
/// What untouched stack looks like.
const PAINT: u8 = 0xc5;
/// End of SRAM + 1.
const RAM_END: usize = 0x460;

unsafe extern "C" {
    /// End of .data and .bss, by the linker.
    static mut _end: u8;
}

#[unsafe(link_section = ".noinit")]
static mut RESTARTS: u16 = 0;
#[unsafe(link_section = ".noinit")]
static mut KEPT: [u16; 2] = [0; 2];
/// Why it started.
static mut RESET_CAUSE: u8 = 0;

/// Fills the free stack with [`PAINT`], so that its depth can be read off later.
#[inline(always)]
pub fn paint_stack() {
    // SAFETY: from the end of the statics to well below the stack pointer nothing lives yet.
    unsafe {
        let top = core::ptr::read_volatile(STACK_POINTER).wrapping_sub(8) as *mut u8;
        let mut at = core::ptr::addr_of_mut!(_end);
        while at < top {
            core::ptr::write_volatile(at, PAINT);
            at = at.wrapping_add(1);
        }
    }
}

/// Takes the motor's pulses off the pin, which is low then: fast PWM would leave a spike at 0.
#[inline(always)]
pub fn cut_motor() {
    // SAFETY: timer 2 is the motor's; a single byte is written.
    unsafe { (*TC2::ptr()).tccr2.write(|w| bits!(w, 0)) };
}

/// As [`cut_motor`] where the motor's stop was pressed while its interrupt is masked, which notes the edge in GIFR all the same
/// (2466T, INTF0). In three cycles either way, so that nothing moves where it stands: `sbrc` skips in two, and is one before
/// the `out` of one. r1 holds 0.
#[inline(always)]
pub fn cut_motor_if_pressed() {
    const GIFR: u8 = 0x3a;
    const INTF0: u8 = 6;
    const TCCR2: u8 = 0x25;
    // SAFETY: as `cut_motor`; the flags stay.
    unsafe {
        core::arch::asm!(
            "in {seen}, {gifr}",
            "sbrc {seen}, {edge}",
            "out {tccr2}, r1",
            seen = out(reg) _,
            gifr = const GIFR,
            edge = const INTF0,
            tccr2 = const TCCR2,
            options(nostack, preserves_flags)
        );
    }
}

/// The board but for its sensors. What it keeps is in statics: as fields they would be handed from function to function, in
/// registers that each of them has to save.
pub struct AvrBoard(());

impl AvrBoard {
    /// Reads why it started, and sets the motor's pins to off, its stop to be felt.
    pub fn start() -> Self {
        // SAFETY: at start nothing else runs.
        let (cpu, port, restarts) = unsafe {
            (
                &*CPU::ptr(),
                &*PORTD::ptr(),
                &mut *core::ptr::addr_of_mut!(RESTARTS),
            )
        };
        port.portd.write(|w| bits!(w, STOP));
        port.ddrd.write(|w| bits!(w, MOTOR_PWM | MOTOR_DIRECTION));
        let reset_cause = cpu.mcucsr.read().bits() & RESET_FLAGS;
        cpu.mcucsr.write(|w| bits!(w, 0));
        *restarts = if reset_cause & POWER_ON != 0 {
            0
        } else {
            sum(*restarts, 1)
        };
        // SAFETY: as above.
        unsafe { RESET_CAUSE = reset_cause };
        Self(())
    }
}

impl Board for AvrBoard {
    fn send(&mut self, kind: u8, fields: &[u8]) -> bool {
        serial::send(kind, fields)
    }

    fn set_motor(&mut self, duty: i16) {
        // SAFETY: timer 2 and port D's upper pins are the motor's.
        let (timer, port) = unsafe { (&*TC2::ptr(), &*PORTD::ptr()) };
        if duty == 0 {
            cut_motor();
            return;
        }
        // A byte is enough for what is put out either way.
        let mut magnitude = duty as u8;
        if duty < 0 {
            magnitude = magnitude.wrapping_neg();
            port.portd
                .modify(|r, w| bits!(w, r.bits() | MOTOR_DIRECTION));
        } else {
            port.portd
                .modify(|r, w| bits!(w, r.bits() & !MOTOR_DIRECTION));
        }
        timer.ocr2.write(|w| bits!(w, magnitude));
        // Not behind an interrupt that cuts it.
        interrupt::free(|_| {
            if tick::host_is_there() {
                timer.tccr2.write(|w| bits!(w, FAST_PWM | PWM_TO_PIN));
            }
        });
    }

    fn keep_alive(&mut self) {
        tick::keep_alive();
    }

    fn host_is_there(&self) -> bool {
        tick::host_is_there()
    }

    fn is_stopped(&self) -> bool {
        tick::is_stopped()
    }

    fn forget_stop(&mut self) {
        tick::forget_stop();
    }

    fn room(&self) -> u8 {
        serial::room()
    }

    fn set_period(&mut self, ticks: u16, every: u8) {
        tick::set_period(ticks, every);
    }

    fn set_baud(&mut self, divisor: u16) {
        serial::set_baud(divisor);
    }

    #[inline(never)]
    fn set_acc_range(&mut self, range: u8) {
        // Open drain: an output that is low, or an input that the pull-up to 3.3 V holds high.
        // SAFETY: port C is the accelerometer's.
        unsafe { (*PORTC::ptr()).ddrc.write(|w| bits!(w, !range & 0b11)) };
    }

    fn post(&mut self, job: Job) -> bool {
        tick::post(job)
    }

    #[inline(never)]
    fn eeprom_read(&mut self, address: u16) -> u8 {
        // SAFETY: the EEPROM is used here alone.
        let eeprom = unsafe { &*EEPROM::ptr() };
        eeprom.eear.write(|w| bits!(w, address));
        eeprom.eecr.modify(|r, w| bits!(w, r.bits() | EERE));
        eeprom.eedr.read().bits()
    }

    fn eeprom_is_ready(&mut self) -> bool {
        // SAFETY: as above.
        unsafe { (*EEPROM::ptr()).eecr.read().bits() & EEWE == 0 }
    }

    fn eeprom_write(&mut self, address: u16, byte: u8) {
        // SAFETY: as above.
        let eeprom = unsafe { &*EEPROM::ptr() };
        eeprom.eear.write(|w| bits!(w, address));
        eeprom.eedr.write(|w| bits!(w, byte));
        // EEWE has to follow EEMWE within four cycles.
        interrupt::free(|_| {
            eeprom.eecr.write(|w| bits!(w, EEMWE));
            eeprom.eecr.write(|w| bits!(w, EEMWE | EEWE));
        });
    }

    fn reboot(&mut self) {
        serial::drain();
        interrupt::disable();
        // SAFETY: nothing runs any more; 16 ms and the watchdog resets the board.
        unsafe { (*WDT::ptr()).wdtcr.write(|w| bits!(w, 1 << 3)) };
        loop {
            avr_device::asm::nop();
        }
    }

    fn reset_cause(&self) -> u8 {
        // SAFETY: written at start alone.
        unsafe { RESET_CAUSE }
    }

    fn restarts(&self) -> u16 {
        // SAFETY: as above.
        unsafe { RESTARTS }
    }

    fn kept(&self) -> [u16; 2] {
        // SAFETY: the main loop's alone.
        unsafe { KEPT }
    }

    fn keep(&mut self, counts: [u16; 2]) {
        // SAFETY: as above.
        unsafe { KEPT = counts };
    }

    #[inline(never)]
    fn stack_free(&self) -> u16 {
        // SAFETY: reads SRAM above the statics.
        unsafe {
            let mut at = core::ptr::addr_of!(_end);
            let mut free = 0u16;
            while (at as usize) < RAM_END && core::ptr::read_volatile(at) == PAINT {
                at = at.wrapping_add(1);
                free = free.wrapping_add(1);
            }
            free
        }
    }

    fn ticks_since(&self) -> u16 {
        tick::ticks_since()
    }
}
