//! What has its turn on the line: samples, replies, and hello and health frames that are owed.

use wire::{Fault, Status, kind};
use zerocopy::{FromZeros, IntoBytes};

use super::{Board, CLEAR, HEALTH, HELLO, Pending, Stand};

/// Less stack than this left at any time is counted with each health frame: an interrupt's worth.
const STACK_GUARD: u16 = 32;
/// Lengths on the line.
pub(super) const SAMPLE_LEN: u8 = wire::Sample::FRAME_LEN as u8;
pub(super) const REPLY_LEN: u8 = wire::Reply::FRAME_LEN as u8;
const HELLO_LEN: u8 = wire::Hello::FRAME_LEN as u8;
const HEALTH_LEN: u8 = wire::Health::FRAME_LEN as u8;
pub(super) const CORRECTED_LEN: u8 = wire::Corrected::FRAME_LEN as u8;
/// Samples from one reply to the next, and from one hello or health frame to the next, where the queue has no room for a
/// sample beside it: 16 samples, 4 replies and a health frame are 1002 bytes, so that samples have four fifths of any line.
const SAMPLES_PER_REPLY: u8 = 4;
pub(super) const SAMPLES_PER_REPORT: u8 = 16;

impl Stand {
    /// Whether there is room for the reply that the next received byte may bring. Until then the bytes wait: no request,
    /// however many there are, takes the room of a sample, or of a report that is late.
    #[inline(never)]
    pub fn listens<B: Board>(&self, board: &B) -> bool {
        let beside = if self.late != 0 {
            HEALTH_LEN + REPLY_LEN
        } else if self.since_reply >= SAMPLES_PER_REPLY {
            0
        } else {
            SAMPLE_LEN + REPLY_LEN
        };
        board.room() >= beside.wrapping_add(REPLY_LEN)
    }

    /// The one reply to a request, with what [`answer`](Self::answer) says.
    #[inline(never)]
    pub(super) fn reply<B: Board>(&mut self, board: &mut B, asked: Pending, status: Status) {
        self.answer.number.set(asked.number);
        self.answer.command = asked.code;
        self.answer.status = status as u8;
        if !board.send(kind::REPLY, self.answer.as_bytes()) {
            self.record(Fault::ReportDropped, 0);
        }
        self.since_reply = 0;
        self.answer.zero();
    }

    /// Sends what is owed, and `more`, as far as there is room.
    #[inline(never)]
    pub(super) fn tell<B: Board>(&mut self, board: &mut B, more: u8) {
        self.owed |= more;
        if self.owed & HELLO != 0 && self.may_report(board, HELLO_LEN) {
            let hello = wire::fields::Hello {
                // Byte by byte: as a whole it would be a constant in the SRAM.
                firmware: {
                    let [major, minor, patch] = crate::VERSION;
                    [major, minor, patch]
                },
                board_id: self.config.board_id,
                reset_cause: board.reset_cause(),
                restarts: board.restarts().into(),
                next_seq: self.health.next_seq,
                tick_ns: crate::TICK_NS.into(),
                set_up: self.config.set_up,
            };
            if board.send(kind::HELLO, hello.as_bytes()) {
                self.owed &= !HELLO;
                self.reported();
            }
        }
        if self.owed & HEALTH != 0 && self.may_report(board, HEALTH_LEN) {
            let stack_free = board.stack_free();
            self.health.stack_free.set(stack_free);
            if stack_free < STACK_GUARD {
                self.record(Fault::StackLow, 0);
            }
            if board.send(kind::HEALTH, self.health.as_bytes()) {
                if self.owed & CLEAR != 0 {
                    self.health.faults.zero();
                    board.keep([0; 2]);
                }
                self.owed &= !(HEALTH | CLEAR);
                self.reported();
            }
        }
    }

    /// Whether a hello or health frame of this length has its turn: unless it is late there has to be room for a sample beside
    /// it.
    pub(super) fn may_report<B: Board>(&self, board: &B, len: u8) -> bool {
        let beside = if self.late != 0 {
            REPLY_LEN
        } else {
            REPLY_LEN + SAMPLE_LEN
        };
        board.room() >= beside.wrapping_add(len)
    }

    /// A hello or health frame has been sent.
    pub(super) fn reported(&mut self) {
        (self.since_report, self.late) = (0, 0);
    }
}
