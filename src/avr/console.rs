//! A word for a person at a terminal: `?` at the start of a line is answered in plain text, ended by the delimiter
//! so that the frame after it is intact. No frame begins with 0x3F: the longest request is shorter.

use firmware::{Board, VERSION};

use super::{board::AvrBoard, serial};

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
    if serial::room() < LONGEST {
        return;
    }
    let [major, minor, patch] = VERSION;
    number(b'v', major.into());
    number(b'w', minor.into());
    number(b'x', patch.into());
    number(b'y', board.reset_cause().into());
    number(b'z', board.stack_free());
    serial::say(0);
}

/// Five numbers of at most four hexadecimal digits with a letter and a blank each, and the delimiter.
const LONGEST: u8 = 31;

/// The letter, the number in hexadecimal digits without zeros before it, and a blank.
#[inline(never)]
fn number(letter: u8, mut value: u16) {
    serial::say(letter);
    let mut left = 4u8;
    while left > 1 && value & 0xf000 == 0 {
        value <<= 4;
        left = left.wrapping_sub(1);
    }
    while left > 0 {
        let digit = (value >> 12) as u8;
        let to_letter = if digit > 9 { b'a' - b'9' - 1 } else { 0 };
        serial::say(digit.wrapping_add(b'0').wrapping_add(to_letter));
        value <<= 4;
        left = left.wrapping_sub(1);
    }
    serial::say(b' ');
}
