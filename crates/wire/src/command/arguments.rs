//! How many argument bytes each command has.

use super::code;

/// Codes that are looked up: those of the commands, to a whole byte of the table.
const CODES: u8 = code::SET_BOARD_ID + 1;
const _: () = assert!(CODES.is_multiple_of(2));

/// As the table of docs/wire-format.md has them.
const fn written(code: u8) -> Option<u8> {
    Some(match code {
        code::PING..=code::REBOOT | code::STORE_CONFIG..=code::DEFAULT_CONFIG => 0,
        code::SET_ACC_RANGE | code::SELF_TEST | code::CORRECTION => 1,
        code::SET_BAUD..=code::SET_GYRO
        | code::BIAS_NULL
        | code::MOTOR_DUTY
        | code::ARM
        | code::READ_REGISTER
        | code::GET_CORRECTION
        | code::SET_BOARD_ID => 2,
        code::SET_RATE | code::MOTOR_LIMITS => 3,
        code::WRITE_REGISTER => 4,
        code::SET_BIAS | code::SET_SCALE => 5,
        code::SET_CORRECTION => 7,
        code::MOTOR_PROFILE => 8,
        _ => return None,
    })
}

/// Four bits for each code, two in a byte: one more than the command has bytes of arguments, 0 where there is no command.
/// Of the AVR's flash: elsewhere it would be copied to SRAM.
#[cfg_attr(
    target_arch = "avr",
    allow(unsafe_code),
    unsafe(link_section = ".progmem.data")
)]
static TABLE: [u8; CODES as usize / 2] = {
    let mut table = [0; CODES as usize / 2];
    let mut code = 0;
    while code < CODES {
        if let Some(len) = written(code) {
            table[code as usize / 2] |= (len + 1) << (code % 2 * 4);
        }
        code += 1;
    }
    table
};

/// A byte of the table; `at` is in it.
#[cfg(not(target_arch = "avr"))]
fn byte(at: u8) -> u8 {
    TABLE.get(usize::from(at)).copied().unwrap_or(0)
}

/// A byte of the table; `at` is in it.
#[cfg(target_arch = "avr")]
#[allow(unsafe_code)]
fn byte(at: u8) -> u8 {
    let place = core::ptr::addr_of!(TABLE)
        .cast::<u8>()
        .wrapping_add(at as usize);
    let found: u8;
    // SAFETY: reads a byte of the flash.
    unsafe {
        core::arch::asm!("lpm {}, Z", out(reg) found, in("Z") place, options(pure, readonly, nostack));
    }
    found
}

/// `None` where no command has the code.
pub(super) fn len(code: u8) -> Option<u8> {
    if code >= CODES {
        return None;
    }
    let both = byte(code >> 1);
    let one_more = if code & 1 == 0 { both & 15 } else { both >> 4 };
    one_more.checked_sub(1)
}
