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
            let [major, minor, patch] = VERSION;
            let mut text: String<40> = String::new();
            let written = uwrite!(
                text,
                "imu {}.{}.{} reset {} stack {}\r\n\0",
                major,
                minor,
                patch,
                board.reset_cause(),
                board.stack_free()
            );
            if written.is_ok() {
                board.send(text.as_bytes());
            }
        }
        asked
    }
}
