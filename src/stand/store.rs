//! The two stored copies of the set-up: written a byte at a time while everything else goes on.

use wire::{Fault, Status};
use zerocopy::IntoBytes;

use super::{Board, Pending, Stand, source};
use crate::config::{SLOTS, STORED_LEN, Stored};

/// A configuration on its way to EEPROM, and what is known of the copies there.
pub(super) struct Store {
    asked: Pending,
    at: u8,
    generation: u8,
    /// Which copy the newest is: 0, 1.
    newest: u8,
    copy: Stored,
}

impl Store {
    pub(super) const fn new() -> Self {
        Self {
            asked: Pending::NONE,
            at: 0,
            generation: 0,
            newest: 0,
            copy: Stored::new(),
        }
    }

    /// Whether none is under way.
    pub(super) fn is_idle(&self) -> bool {
        self.asked.is_none()
    }

    /// Where copy 0 or 1 begins.
    fn slot(place: u8) -> u16 {
        if place == 0 { SLOTS[0] } else { SLOTS[1] }
    }
}

impl Stand {
    /// Starts; false while a copy is under way.
    pub(super) fn begin_store(&mut self, asked: Pending) -> bool {
        if !self.store.is_idle() {
            return false;
        }
        self.store.asked = asked;
        self.store.at = 0;
        self.store
            .copy
            .seal(self.store.generation.wrapping_add(1), &self.config);
        true
    }

    /// A byte more of the copy that is under way, when the EEPROM is ready; after the last one, the reply.
    #[inline(never)]
    pub(super) fn step_store<B: Board>(&mut self, board: &mut B) {
        if !board.eeprom_is_ready() {
            return;
        }
        // The copy that is not the newest is overwritten.
        let place = self.store.newest ^ 1;
        let slot = Store::slot(place);
        let at = self.store.at;
        if let Some(&byte) = self.store.copy.as_bytes().get(at as usize) {
            board.eeprom_write(slot.wrapping_add(at.into()), byte);
            self.store.at = at.wrapping_add(1);
            return;
        }
        let mut status = Status::Ok;
        for (&byte, address) in self.store.copy.as_bytes().iter().zip(slot..) {
            if board.eeprom_read(address) != byte {
                status = Status::NotStored;
            }
        }
        if matches!(status, Status::Ok) {
            self.store.generation = self.store.copy.generation;
            self.store.newest = place;
            self.config.set_up.config_source = source::STORED.wrapping_add(place);
        } else {
            self.record(Fault::ConfigNotStored, 0);
        }
        let asked = core::mem::replace(&mut self.store.asked, Pending::NONE);
        self.reply(board, asked, status);
    }

    /// Takes the newer of the two stored copies that are in order; false when neither is. Not while one is written.
    pub(super) fn load<B: Board>(&mut self, board: &mut B) -> bool {
        let mut found = false;
        for place in 0..2 {
            let copy = &mut self.store.copy;
            let mut all = 0xff;
            for (byte, address) in copy.as_mut_bytes().iter_mut().zip(Store::slot(place)..) {
                *byte = board.eeprom_read(address);
                all &= *byte;
            }
            if !copy.is_in_order() {
                // An erased one is not spoilt.
                if all != 0xff {
                    self.record(Fault::ConfigInvalid, 0);
                }
                continue;
            }
            // Generations wrap: the newer one is ahead by less than half the circle.
            let generation = copy.generation;
            let ahead = generation.wrapping_sub(self.store.generation);
            if !found || ahead < 128 {
                found = true;
                self.config = self.store.copy.config;
                self.config.set_up.config_source = source::STORED.wrapping_add(place);
                self.store.generation = generation;
                self.store.newest = place;
            }
        }
        found
    }
}

const _: () = assert!(STORED_LEN < 256, "a byte counts them");
