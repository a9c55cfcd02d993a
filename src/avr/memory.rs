//! `memcpy` and `memset` as byte loops: a tenth of the flash of the general ones, whose symbols are weak.

use core::ffi::{c_int, c_void};
use core::ptr::{read_volatile, write_volatile};

/// Copies `n` bytes. Volatile, so that the compiler does not see a `memcpy` in it and calls itself.
///
/// # Safety
/// As C has it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn memcpy(to: *mut c_void, from: *const c_void, n: usize) -> *mut c_void {
    let (mut at, mut source, mut left) = (to.cast::<u8>(), from.cast::<u8>(), n);
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
pub unsafe extern "C" fn memset(to: *mut c_void, byte: c_int, n: usize) -> *mut c_void {
    let (mut at, mut left) = (to.cast::<u8>(), n);
    while left != 0 {
        // SAFETY: the caller's.
        unsafe { write_volatile(at, byte as u8) };
        (at, left) = (at.wrapping_add(1), left.wrapping_sub(1));
    }
    to
}
