//! From the bytes of a line to frames.

use zerocopy::FromBytes;

use crate::cobs::{Broken, Deframer};
use crate::{Asked, Frame, MAX_FRAME, Request, Status, VERSION, fields, kind};

/// Why what ended at a delimiter is no frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum DecodeError {
    /// The stuffing is broken: bytes were lost or added.
    BadCobs,
    /// The CRC does not fit: bytes were changed.
    BadCrc,
    /// Too short or too long for any frame, or, with a CRC that fits, for one of its kind.
    BadLength,
    /// Undamaged, but of another version of the format.
    UnknownVersion(u8),
    /// Undamaged, but no kind that travels in this direction.
    UnknownKind(u8),
    /// Undamaged, but a field has a value that its table lacks.
    UnknownValue,
}

impl core::fmt::Display for DecodeError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            DecodeError::BadCobs => f.write_str("bytes lost or added (stuffing broken)"),
            DecodeError::BadCrc => f.write_str("bytes damaged (CRC does not fit)"),
            DecodeError::BadLength => f.write_str("no frame has this length"),
            DecodeError::UnknownVersion(version) => {
                write!(
                    f,
                    "format version {version}, this program speaks version {VERSION}"
                )
            }
            DecodeError::UnknownKind(kind) => write!(
                f,
                "frame kind {kind:#04x} does not travel in this direction"
            ),
            DecodeError::UnknownValue => {
                f.write_str("a field has a value that the format does not define")
            }
        }
    }
}

impl core::error::Error for DecodeError {}

/// What a decoder has seen so far. Counts saturate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LinkCounts {
    /// Frames handed on.
    pub frames: u32,
    /// [`DecodeError::BadCobs`].
    pub bad_cobs: u32,
    /// [`DecodeError::BadCrc`].
    pub bad_crc: u32,
    /// [`DecodeError::BadLength`].
    pub bad_length: u32,
    /// [`DecodeError::UnknownVersion`].
    pub unknown_version: u32,
    /// [`DecodeError::UnknownKind`].
    pub unknown_kind: u32,
    /// [`DecodeError::UnknownValue`].
    pub unknown_value: u32,
}

impl LinkCounts {
    fn record<T>(&mut self, outcome: &Result<T, DecodeError>) {
        let count = match outcome {
            Ok(_) => &mut self.frames,
            Err(DecodeError::BadCobs) => &mut self.bad_cobs,
            Err(DecodeError::BadCrc) => &mut self.bad_crc,
            Err(DecodeError::BadLength) => &mut self.bad_length,
            Err(DecodeError::UnknownVersion(_)) => &mut self.unknown_version,
            Err(DecodeError::UnknownKind(_)) => &mut self.unknown_kind,
            Err(DecodeError::UnknownValue) => &mut self.unknown_value,
        };
        *count = count.saturating_add(1);
    }

    /// Everything that ended at a delimiter and was no frame.
    #[must_use]
    pub const fn rejected(&self) -> u32 {
        self.bad_cobs
            .saturating_add(self.bad_crc)
            .saturating_add(self.bad_length)
            .saturating_add(self.unknown_version)
            .saturating_add(self.unknown_kind)
            .saturating_add(self.unknown_value)
    }
}

/// The PC's side: takes the line byte by byte and gives back the board's frames.
///
/// It starts anew at each delimiter, so after any damage the next intact frame arrives. Delimiters with nothing
/// between them are idle line and no error. A decoder that is switched on in the middle of a frame counts that one as
/// damaged.
#[derive(Clone, Debug)]
pub struct Decoder {
    deframer: Deframer<{ MAX_FRAME - 2 }>,
    counts: LinkCounts,
}

impl Default for Decoder {
    fn default() -> Self {
        Decoder::new()
    }
}

impl Decoder {
    /// A decoder that has seen nothing.
    #[must_use]
    pub const fn new() -> Self {
        Decoder {
            deframer: Deframer::new(),
            counts: LinkCounts {
                frames: 0,
                bad_cobs: 0,
                bad_crc: 0,
                bad_length: 0,
                unknown_version: 0,
                unknown_kind: 0,
                unknown_value: 0,
            },
        }
    }

    /// Takes the next byte; a delimiter may bring a frame, or why there is none.
    pub fn push(&mut self, byte: u8) -> Option<Result<Frame, DecodeError>> {
        let outcome = match self.deframer.push(byte)? {
            Ok(payload) => frame_of(payload),
            Err(broken) => Err(broken.into()),
        };
        self.counts.record(&outcome);
        Some(outcome)
    }

    /// What was seen so far.
    #[must_use]
    pub const fn counts(&self) -> &LinkCounts {
        &self.counts
    }
}

impl From<Broken> for DecodeError {
    fn from(broken: Broken) -> Self {
        match broken {
            Broken::Cobs => DecodeError::BadCobs,
            Broken::Crc => DecodeError::BadCrc,
            Broken::Length => DecodeError::BadLength,
        }
    }
}

fn frame_of(payload: &[u8]) -> Result<Frame, DecodeError> {
    let (&[version, kind_byte], fields) =
        payload.split_first_chunk().ok_or(DecodeError::BadLength)?;
    if version != VERSION {
        return Err(DecodeError::UnknownVersion(version));
    }
    match Frame::is_of_length(kind_byte, payload.len()) {
        None => Err(DecodeError::UnknownKind(kind_byte)),
        Some(false) => Err(DecodeError::BadLength),
        Some(true) => Frame::read(kind_byte, fields).ok_or(DecodeError::UnknownValue),
    }
}

/// Why what ended at a delimiter is no request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RequestError {
    /// Damaged, or no request: nobody can be answered. The board counts it.
    Frame(DecodeError),
    /// Undamaged, but not to be carried out: the board answers with this status.
    Refused {
        /// Number of the request.
        number: u16,
        /// Code of the command.
        command: u8,
        /// [`Status::UnknownCommand`] or [`Status::BadArgument`].
        status: Status,
    },
}

/// The board's side: takes received bytes one by one and gives back requests.
///
/// Its whole memory is the longest request and a few bytes of state.
#[derive(Clone, Debug)]
pub struct RequestDecoder {
    deframer: Deframer<{ Request::LEN + 4 }>,
}

impl Default for RequestDecoder {
    fn default() -> Self {
        RequestDecoder::new()
    }
}

impl RequestDecoder {
    /// A decoder that has seen nothing.
    #[must_use]
    pub const fn new() -> Self {
        RequestDecoder {
            deframer: Deframer::new(),
        }
    }

    /// Takes the next byte; a delimiter may bring a request as it came, or why there is none.
    pub fn ask(&mut self, byte: u8) -> Option<Result<Asked, DecodeError>> {
        Some(match self.deframer.push(byte)? {
            Ok(payload) => asked_of(payload),
            Err(broken) => Err(broken.into()),
        })
    }

    /// Takes the next byte; a delimiter may bring a request, or why there is none.
    pub fn push(&mut self, byte: u8) -> Option<Result<Request, RequestError>> {
        Some(match self.ask(byte)? {
            Ok(asked) => asked
                .command()
                .map(|command| Request {
                    number: asked.number,
                    command,
                })
                .map_err(|status| RequestError::Refused {
                    number: asked.number,
                    command: asked.code,
                    status,
                }),
            Err(error) => Err(RequestError::Frame(error)),
        })
    }
}

fn asked_of(payload: &[u8]) -> Result<Asked, DecodeError> {
    let (&[version, kind_byte], fields) =
        payload.split_first_chunk().ok_or(DecodeError::BadLength)?;
    if version != VERSION {
        return Err(DecodeError::UnknownVersion(version));
    }
    if kind_byte != kind::REQUEST {
        return Err(DecodeError::UnknownKind(kind_byte));
    }
    fields::Request::ref_from_bytes(fields)
        .map(Asked::from)
        .map_err(|_| DecodeError::BadLength)
}
