//! What is kept in the EEPROM: two copies of the set-up and two of the correction, written a byte at a time while everything else
//! goes on. The copy that is not in use is written, so a cut at any byte leaves the other.

use wire::correction::ROWS;
use wire::{Asked, Fault, Status};
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout, Unaligned};

use super::{Board, Pending, Stand, source};
use crate::config::{Config, SLOTS, STORED_LEN};
use crate::correction::is_whole;

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
    pub(super) fn begin_store(&mut self, asked: Pending) -> bool {
        if !self.store.is_idle() {
            return false;
        }
        self.config.seal();
        let store = &mut self.store;
        // The copy that is not the newest is overwritten.
        store.place = Store::slot(store.newest ^ 1);
        (store.asked, store.at, store.is_row) = (asked, 0, false);
        true
    }

    /// Starts to write a row of a correction. Not while something is written.
    pub(super) fn begin_write(&mut self, asked: &Asked, place: u16) {
        let store = &mut self.store;
        (store.asked, store.at, store.is_row) = (asked.into(), 0, true);
        store.place = place;
        let [_, row @ .., _] = asked.arguments;
        store.row = Row(row);
    }

    /// A byte more of what is under way, when the EEPROM is ready; after the last one, the reply.
    #[inline(never)]
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
        for &byte in bytes {
            stored &= board.eeprom_read(place) == byte;
            place = place.wrapping_add(1);
        }
        let place = self.store.place;
        if !self.store.is_row {
            stored = is_whole(board, place, STORED_LEN as u8);
            if stored {
                self.store.newest ^= 1;
                self.config.set_up.config_source = source::STORED.wrapping_add(self.store.newest);
            }
        } else if self.correction.place(true, ROWS as u8) == Some(place) {
            // With the row of its CRC the copy is whole, and in use from then on.
            stored &= self.correction.on(board)
                && self.correction.place(false, ROWS as u8) == Some(place);
        }
        let status = if stored {
            Status::Ok
        } else {
            self.record(Fault::ConfigNotStored, 0);
            Status::NotStored
        };
        let asked = core::mem::replace(&mut self.store.asked, Pending::NONE);
        self.reply(board, asked, status);
    }

    /// Takes the newer of the two stored copies that are in order; false when neither is. Not while one is written.
    pub(super) fn load<B: Board>(&mut self, board: &mut B) -> bool {
        let mut found = false;
        for place in 0..2 {
            let was = self.config;
            let mut all = 0xff;
            for (byte, address) in (self.config.as_mut_bytes().iter_mut()).zip(Store::slot(place)..)
            {
                *byte = board.eeprom_read(address);
                all &= *byte;
            }
            let in_order = self.config.is_whole() && self.config.is_in_order();
            // Generations wrap: the newer one is ahead by less than half the circle.
            if in_order && (!found || self.config.generation.wrapping_sub(was.generation) < 128) {
                found = true;
                self.config.set_up.config_source = source::STORED.wrapping_add(place);
                self.store.newest = place;
                continue;
            }
            self.config = was;
            // An erased one is not spoilt.
            if !in_order && all != 0xff {
                self.record(Fault::ConfigInvalid, 0);
            }
        }
        found
    }
}

const _: () = assert!(STORED_LEN < 256, "a byte counts them");
