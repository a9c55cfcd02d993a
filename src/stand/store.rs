//! What is kept in the EEPROM: two copies of the set-up and two of the correction, written a byte at a time while everything else
//! goes on. The copy that is not in use is written, so a cut at any byte leaves the other.

use core::num::NonZeroU16;

use wire::correction::{self, ROWS};
use wire::{Asked, Fault, Status};
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout, Unaligned};

use super::{Board, Pending, Stand, source};
use crate::config::{Config, FORMAT, SLOTS, STORED_LEN};
use crate::correction::COPIES;

/// What is on its way to the EEPROM, and what is known of the set-up's copies there.
pub(super) struct Store {
    asked: Pending,
    at: u8,
    /// Which copy of the set-up the newest is: 0, 1.
    newest: u8,
    /// Whether a row of the correction is written, not the set-up.
    is_row: bool,
    /// Where the bytes go.
    place: u16,
    row: Row,
}

#[derive(Clone, Copy, FromBytes, IntoBytes, KnownLayout, Immutable, Unaligned)]
#[repr(C)]
struct Row([u8; 6]);

impl Store {
    pub(super) const fn new() -> Self {
        Self {
            asked: Pending::NONE,
            at: 0,
            newest: 0,
            is_row: false,
            place: 0,
            row: Row([0; 6]),
        }
    }

    /// Whether none is under way.
    pub(super) fn is_idle(&self) -> bool {
        self.asked.is_none()
    }

    /// Where copy 0 or 1 of the set-up begins.
    fn slot(place: u8) -> u16 {
        if place == 0 { SLOTS[0] } else { SLOTS[1] }
    }

    /// What is written. A set-up that is changed meanwhile does not get the CRC that it needs.
    fn bytes<'a>(&'a self, config: &'a Config) -> &'a [u8] {
        if self.is_row {
            &self.row.0
        } else {
            config.as_bytes()
        }
    }
}

impl Stand {
    /// Starts to store the set-up; false while something is written.
    pub(super) fn begin_store(&mut self, asked: &Asked) -> bool {
        if !self.store.is_idle() {
            return false;
        }
        self.config.seal();
        let store = &mut self.store;
        // The copy that is not the newest is overwritten.
        store.place = Store::slot(store.newest ^ 1);
        store.asked.ask(asked);
        (store.at, store.is_row) = (0, false);
        true
    }

    /// Starts to write a row of a correction. Not while something is written.
    pub(super) fn begin_write(&mut self, asked: &Asked, place: u16) {
        let store = &mut self.store;
        store.asked.ask(asked);
        (store.at, store.is_row) = (0, true);
        store.place = place;
        let [_, row @ .., _] = asked.arguments;
        store.row = Row(row);
    }

    /// A byte more of what is under way, when the EEPROM is ready; after the last one, the reply.
    pub(super) fn step_store<B: Board>(&mut self, board: &mut B) {
        if !board.eeprom_is_ready() {
            return;
        }
        let (at, mut place) = (self.store.at, self.store.place);
        let bytes = self.store.bytes(&self.config);
        if let Some(&byte) = bytes.get(at as usize) {
            board.eeprom_write(place.wrapping_add(at.into()), byte);
            self.store.at = at.wrapping_add(1);
            return;
        }
        let mut stored = true;
        if self.store.is_row {
            for &byte in bytes {
                stored &= board.eeprom_read(place) == byte;
                place = place.wrapping_add(1);
            }
            let place = NonZeroU16::new(self.store.place);
            if self.correction.place(true, ROWS as u8) == place {
                // With the row of its CRC the copy is whole, and in use from then on.
                stored &=
                    self.correction.on(board) && self.correction.place(false, ROWS as u8) == place;
            }
        } else {
            let to = self.store.newest ^ 1;
            stored = newest(board, SLOTS[0], SLOTS[1]) & 3 == to.wrapping_add(1);
            if stored {
                self.store.newest = to;
                self.config.set_up.config_source = source::STORED.wrapping_add(to);
            }
        }
        let status = if stored {
            Status::Ok
        } else {
            self.record(Fault::ConfigNotStored, 0);
            Status::NotStored
        };
        let asked = self.store.asked.take();
        self.reply(board, asked, status);
    }

    /// Takes the newer of the two stored copies that are whole; false, and nothing changed, where none is or its fields are not in
    /// order. Not while one is written.
    #[inline(never)]
    pub(super) fn load<B: Board>(&mut self, board: &mut B) -> bool {
        let found = newest(board, SLOTS[0], SLOTS[1]);
        self.health
            .count(Fault::ConfigInvalid, 0, (found >> 2).into());
        let number = found & 3;
        if number == 0 {
            return false;
        }
        let was = self.config;
        let place = number.wrapping_sub(1);
        let mut at = Store::slot(place);
        for byte in self.config.as_mut_bytes() {
            *byte = board.eeprom_read(at);
            at = at.wrapping_add(1);
        }
        if !self.config.is_in_order() {
            self.config = was;
            self.record(Fault::ConfigInvalid, 0);
            return false;
        }
        self.store.newest = place;
        self.config.set_up.config_source = source::STORED.wrapping_add(place);
        true
    }
}

/// What lies where a copy belongs.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Copy {
    Erased,
    Spoilt,
    Whole,
}

/// Looks at a copy of the set-up or, behind those, of a correction: it begins with its format and ends with its CRC.
#[inline(never)]
fn look<B: Board>(board: &mut B, copy: u16) -> Copy {
    let (mut left, format) = if copy < COPIES[0] {
        (STORED_LEN as u8, FORMAT)
    } else {
        (correction::STORED_LEN as u8, correction::FORMAT)
    };
    let (mut register, mut all, mut at) = (wire::crc::INIT, 0xff, copy);
    while left > 0 {
        let byte = board.eeprom_read(at);
        register = wire::crc::update(register, byte);
        all &= byte;
        at = at.wrapping_add(1);
        left = left.wrapping_sub(1);
    }
    if wire::crc::is_whole(register) && board.eeprom_read(copy) == format {
        return Copy::Whole;
    }
    if all == 0xff {
        Copy::Erased
    } else {
        Copy::Spoilt
    }
}

/// Which of two copies is the newest that is whole: 1, 2, or 0 for neither; four more for each that is spoilt.
#[inline(never)]
pub(crate) fn newest<B: Board>(board: &mut B, first: u16, second: u16) -> u8 {
    let (one, two) = (look(board, first), look(board, second));
    let mut found = 0;
    if one == Copy::Spoilt {
        found = 4;
    }
    if two == Copy::Spoilt {
        found += 4;
    }
    // Generations, behind the format, wrap: the newer one is ahead by less than half the circle.
    if two == Copy::Whole
        && (one != Copy::Whole
            || board
                .eeprom_read(second.wrapping_add(1))
                .wrapping_sub(board.eeprom_read(first.wrapping_add(1)))
                < 128)
    {
        found += 2;
    } else if one == Copy::Whole {
        found += 1;
    }
    found
}

const _: () = assert!(STORED_LEN < 256, "a byte counts them");
