//! A word for a person at a terminal: `?` at the start of a line is answered in plain text, ended by the delimiter
//! so that the frame after it is intact. No frame begins with 0x3F: the longest request is shorter.

use firmware::{Board, VERSION};
use heapless::String;
use ufmt::uwrite;

use super::board::AvrBoard;

/// Sees every received byte first.
pub struct Console {
    at_start: bool,
}

impl Console {
    /// At the start of a frame.
    pub fn new() -> Self {
        Self { at_start: true }
    }

    /// Whether the byte was a question for the console; then it has been answered.
    pub fn takes(&mut self, board: &mut AvrBoard, byte: u8) -> bool {
        let asked = self.at_start && byte == b'?';
        self.at_start = asked || byte == 0;
        if asked {
            answer(board);
        }
        asked
    }
}

/// Version, reset cause, stack, each as `letter number`: every string would be copied to the SRAM, letters are not.
#[inline(never)]
fn answer(board: &mut AvrBoard) {
    let [major, minor, patch] = VERSION;
    let mut text: String<48> = String::new();
    let values = [
        major.into(),
        minor.into(),
        patch.into(),
        board.reset_cause().into(),
        board.stack_free(),
    ];
    for (letter, value) in (b'v'..).zip(values) {
        number(&mut text, letter, value);
    }
    if text.push('\0').is_ok() {
        board.send(text.as_bytes());
    }
}

/// One formatting of a number in the image, not one for each.
#[inline(never)]
fn number(text: &mut String<48>, letter: u8, value: u16) {
    // Five numbers of at most five digits with a letter and a blank each fit.
    let _fits = text.push(letter as char).is_ok() && uwrite!(text, "{} ", value).is_ok();
}
