//! The board on its registers: start, main loop, and the interrupts that feed it.

/// Writes all bits of a register. Some registers' `bits` is safe, most are not: which values are legal is the data
/// sheet's word, and the constants beside each use say where theirs come from.
macro_rules! bits {
    ($w:ident, $value:expr) => {
        // SAFETY: a whole value for the register, from the data sheet.
        {
            #[allow(unused_unsafe)]
            let written = unsafe { $w.bits($value) };
            written
        }
    };
}

mod board;
mod console;
mod memory;
mod ring;
mod sensors;
mod serial;
mod tick;

use avr_device::{asm, interrupt};
use firmware::{Stand, configure_all};

/// Nothing that panics may be reachable: the symbol is defined nowhere, so an image that could get here does not link.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    unsafe extern "C" {
        fn firmware_contains_a_reachable_panic() -> !;
    }
    // SAFETY: defined nowhere, see above.
    unsafe { firmware_contains_a_reachable_panic() }
}

/// Received bytes that are looked at before the next sample and millisecond have their turn: a request and a half, which
/// take less than a millisecond.
const BYTES_PER_PASS: u8 = 32;

/// Bits of the two clocks, sample and millisecond.
const TICKED: u8 = 1;
const PASSED: u8 = 2;

/// All zeros: in .bss, which costs no flash.
static mut STAND: Stand = Stand::new();

#[avr_device::entry]
fn main() -> ! {
    board::paint_stack();
    let mut board = board::AvrBoard::start();
    // SAFETY: interrupts are off; from their start on the sensors are the tick's.
    let sensors = unsafe { sensors::start() };
    // SAFETY: the one reference to it.
    let stand = unsafe { &mut *core::ptr::addr_of_mut!(STAND) };
    stand.boot(&mut board);
    let misconfigured = configure_all(sensors, stand.sens_avg());
    stand.started(&mut board, misconfigured);
    // SAFETY: called once, before interrupts are on.
    unsafe { tick::start() };
    // SAFETY: everything that the interrupts touch is set up.
    unsafe { interrupt::enable() };

    let mut console = console::Console::new();
    // Which of the two clocks have moved since the watchdog was fed.
    let mut moved = 0u8;
    loop {
        if let Some((raw, missed)) = tick::take() {
            stand.on_sample(&mut board, raw, missed);
            stand.correct(&mut board, raw);
            moved |= TICKED;
        } else if tick::take_passed() {
            moved |= TICKED;
        }
        for _ in 0..BYTES_PER_PASS {
            if !serial::has_received() || !stand.listens(&board) {
                break;
            }
            let Some(byte) = serial::received() else {
                break;
            };
            if !console.takes(&mut board, byte) {
                stand.on_byte(&mut board, byte);
            }
        }
        serial::count_losses(stand);
        if tick::take_millisecond() {
            stand.on_millisecond(&mut board);
            moved |= PASSED;
        }
        // Fed by both clocks, and from here alone: one that stalls is a reset, a main loop that hangs is one, and a reset
        // stops the motor.
        if moved == TICKED | PASSED {
            asm::wdr();
            moved = 0;
        }
        serial::work();
        tick::sleep_until_work(!serial::has_received() || stand.listens(&board));
    }
}
