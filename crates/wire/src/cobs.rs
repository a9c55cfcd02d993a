//! Consistent overhead byte stuffing in one pass, with the CRC computed on the way.

use heapless::Vec;

use crate::crc;

/// Puts out a payload with CRC and delimiter, stuffed as it comes, from the place `first` on; returns the place behind it. `after`
/// says which place follows one. `put` gets each byte with its place, in their order but for the code of a block, which is known
/// at its end.
pub(crate) fn write(
    kind: u8,
    fields: &[u8],
    first: u8,
    after: impl Fn(u8) -> u8,
    mut put: impl FnMut(u8, u8),
) -> u8 {
    let mut register = crc::INIT;
    // Where the next byte goes, where the code of the block being written goes, and that code.
    let (mut at, mut code_at, mut code) = (after(first), first, 1u8);
    let mut rest = fields.iter();
    // Version, kind, the fields, and the four bytes of the CRC, each a step but for the fields.
    let mut step = 0u8;
    loop {
        let next = match step {
            0 => Some(crate::VERSION),
            1 => Some(kind),
            _ => rest.next().copied(),
        };
        if step < 2 || next.is_none() {
            step = step.wrapping_add(1);
        }
        let byte = match next {
            Some(byte) => {
                register = crc::update(register, byte);
                byte
            }
            None if step > 2 + 4 => break,
            None => {
                let byte = crc::finish(register) as u8;
                register >>= 8;
                byte
            }
        };
        if byte == crate::DELIMITER {
            // It ends the block, and the code of the next one takes its place.
            put(code_at, code);
            (code_at, code) = (at, 1);
        } else {
            put(at, byte);
            code = code.wrapping_add(1);
        }
        at = after(at);
    }
    put(code_at, code);
    put(at, crate::DELIMITER);
    after(at)
}

/// Why a run of bytes between two delimiters is no payload.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Broken {
    /// A code byte points past the end of the frame, or is 0xFF, which no frame is long enough to need.
    Cobs,
    /// The CRC does not fit.
    Crc,
    /// Fewer bytes than version, kind and CRC have, or more than the longest payload.
    Length,
}

/// Takes a line apart into payloads whose CRC fits. `N` is the room for the longest payload with its CRC.
///
/// Whatever was received, a delimiter brings it back to the start of a frame.
#[derive(Clone, Debug)]
pub(crate) struct Deframer<const N: usize> {
    body: Vec<u8, N, u8>,
    /// Bytes until the next code byte; 0 before the first byte of a frame and when a code byte is due.
    run: u8,
    state: State,
    register: u32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Empty,
    Filling,
    Overlong,
    BadCobs,
}

impl<const N: usize> Deframer<N> {
    pub(crate) const fn new() -> Self {
        Deframer {
            body: Vec::new(),
            run: 0,
            state: State::Empty,
            register: 0,
        }
    }

    /// At a delimiter that ends something: the payload without its CRC, or why there is none.
    pub(crate) fn push(&mut self, byte: u8) -> Option<Result<&[u8], Broken>> {
        if byte == crate::DELIMITER {
            return self.end();
        }
        match self.state {
            State::Overlong | State::BadCobs => {}
            State::Empty => {
                self.state = State::Filling;
                self.register = crc::INIT;
                self.body.clear();
                self.code(byte);
            }
            State::Filling if self.run == 0 => {
                self.append(0);
                self.code(byte);
            }
            State::Filling => {
                self.append(byte);
                self.run = self.run.wrapping_sub(1);
            }
        }
        None
    }

    fn code(&mut self, code: u8) {
        if code == 0xFF {
            self.state = State::BadCobs;
        }
        self.run = code.wrapping_sub(1);
    }

    fn append(&mut self, byte: u8) {
        match self.body.push(byte) {
            Ok(()) => self.register = crc::update(self.register, byte),
            Err(_) => self.state = State::Overlong,
        }
    }

    fn end(&mut self) -> Option<Result<&[u8], Broken>> {
        let (state, run, register) = (self.state, self.run, self.register);
        self.state = State::Empty;
        self.run = 0;
        match state {
            State::Empty => None,
            State::Overlong => Some(Err(Broken::Length)),
            State::BadCobs => Some(Err(Broken::Cobs)),
            State::Filling if run != 0 => Some(Err(Broken::Cobs)),
            // Version, kind and CRC are there in every payload.
            State::Filling if self.body.len() < 6 => Some(Err(Broken::Length)),
            State::Filling if !crc::is_whole(register) => Some(Err(Broken::Crc)),
            State::Filling => Some(
                self.body
                    .get(..self.body.len().wrapping_sub(4))
                    .ok_or(Broken::Length),
            ),
        }
    }
}
