//! A word for a person at a terminal: `?` at the start of a line is answered in plain text, ended by the delimiter
//! so that the frame after it is intact. No frame begins with 0x3F: the longest request is shorter.

use firmware::{Board, VERSION};
use heapless::Vec;
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
    let mut text = Text(Vec::new());
    let [major, minor, patch] = VERSION;
    text.number(b'v', major.into());
    text.number(b'w', minor.into());
    text.number(b'x', patch.into());
    text.number(b'y', board.reset_cause().into());
    text.number(b'z', board.stack_free());
    let _room = text.0.push(0);
    serial::send_plain(&text.0);
}

/// Five numbers of at most four hexadecimal digits with a letter and a blank each, and the delimiter.
struct Text(Vec<u8, 31>);

impl Text {
    #[inline(never)]
    fn number(&mut self, letter: u8, value: u16) {
        let _room = self.0.push(letter);
        let _room = uwrite!(self, "{:x}", value);
        let _room = self.0.push(b' ');
    }
}

impl uWrite for Text {
    type Error = ();

    #[inline(never)]
    fn write_str(&mut self, digits: &str) -> Result<(), ()> {
        for &digit in digits.as_bytes() {
            let _room = self.0.push(digit);
        }
        Ok(())
    }
}
