//! `memcpy` and `memset` as byte loops: a tenth of the flash of the general ones, whose symbols are weak.

use core::ptr::{read_volatile, write_volatile};

/// Copies `n` bytes. Volatile, so that the compiler does not see a `memcpy` in it and calls itself.
///
/// # Safety
/// As C has it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn memcpy(to: *mut u8, from: *const u8, n: usize) -> *mut u8 {
    let (mut at, mut source, mut left) = (to, from, n);
    while left != 0 {
        // SAFETY: the caller's.
        unsafe { write_volatile(at, read_volatile(source)) };
        (at, source, left) = (
            at.wrapping_add(1),
            source.wrapping_add(1),
            left.wrapping_sub(1),
        );
    }
    to
}

/// Sets `n` bytes.
///
/// # Safety
/// As C has it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn memset(to: *mut u8, byte: core::ffi::c_int, n: usize) -> *mut u8 {
    let (mut at, mut left) = (to, n);
    while left != 0 {
        // SAFETY: the caller's.
        unsafe { write_volatile(at, byte as u8) };
        (at, left) = (at.wrapping_add(1), left.wrapping_sub(1));
    }
    to
}
