//! What the worker calls. Bytes go through the engine's memory: the worker asks for room, writes, calls, and reads an answer.

use std::cell::RefCell;

use crate::Session;

/// What the engine keeps between calls.
#[derive(Default)]
struct Kept {
    session: Session,
    file: Vec<u8>,
    request: Vec<u8>,
    answer: String,
}

thread_local! {
    static KEPT: RefCell<Kept> = RefCell::default();
}

/// Room for a file of so many bytes, which the worker writes there before any other call.
#[unsafe(no_mangle)]
pub extern "C" fn file_room(length: usize) -> *mut u8 {
    KEPT.with_borrow_mut(|kept| {
        kept.file = vec![0; length];
        kept.file.as_mut_ptr()
    })
}

/// Room for a request of so many bytes.
#[unsafe(no_mangle)]
pub extern "C" fn request_room(length: usize) -> *mut u8 {
    KEPT.with_borrow_mut(|kept| {
        kept.request = vec![0; length];
        kept.request.as_mut_ptr()
    })
}

/// Does what the request says; returns the length of the answer.
#[unsafe(no_mangle)]
pub extern "C" fn call() -> usize {
    KEPT.with_borrow_mut(|kept| {
        let request = String::from_utf8_lossy(&kept.request);
        kept.answer = kept.session.answer(&kept.file, &request);
        kept.answer.len()
    })
}

/// Where the answer is.
#[unsafe(no_mangle)]
pub extern "C" fn answer() -> *const u8 {
    KEPT.with_borrow(|kept| kept.answer.as_ptr())
}
