//! A word for a person at a terminal: `?` at the start of a line is answered in plain text, ended by the delimiter
//! so that the frame after it is intact. No frame begins with 0x3F: the longest request is shorter.

use firmware::{Board, VERSION};
use ufmt::{uWrite, uwrite};

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

#[inline(never)]
fn number(letter: u8, value: u16) {
    serial::say(letter);
    let Ok(()) = uwrite!(&mut Line, "{:x}", value);
    serial::say(b' ');
}

/// The line, straight.
struct Line;

impl uWrite for Line {
    type Error = core::convert::Infallible;

    #[inline(never)]
    fn write_str(&mut self, digits: &str) -> Result<(), core::convert::Infallible> {
        for &digit in digits.as_bytes() {
            serial::say(digit);
        }
        Ok(())
    }
}
