//! A ring between one interrupt and the main loop: one side writes, the other reads.
//!
//! Indices are single bytes, which the AVR reads and writes in one instruction, so neither side needs the interrupts
//! off. (`heapless::spsc` does the same with 16-bit indices and a division; it took 500 B more.)

use core::cell::UnsafeCell;
use core::ptr::{read_volatile, write_volatile};

/// Holds up to `N - 1` bytes; `N` is a power of two, at most 256.
pub struct Ring<const N: usize> {
    bytes: UnsafeCell<[u8; N]>,
    /// Next to write; the writer's.
    head: UnsafeCell<u8>,
    /// Next to read; the reader's.
    tail: UnsafeCell<u8>,
}

// SAFETY: one writer and one reader, on a machine with one core and byte-wide indices.
unsafe impl<const N: usize> Sync for Ring<N> {}

impl<const N: usize> Ring<N> {
    const MASK: u8 = {
        assert!(N.is_power_of_two() && N <= 256);
        (N - 1) as u8
    };

    /// Empty.
    pub const fn new() -> Self {
        Self {
            bytes: UnsafeCell::new([0; N]),
            head: UnsafeCell::new(0),
            tail: UnsafeCell::new(0),
        }
    }

    fn head(&self) -> u8 {
        // SAFETY: a byte.
        unsafe { read_volatile(self.head.get()) }
    }

    fn tail(&self) -> u8 {
        // SAFETY: a byte.
        unsafe { read_volatile(self.tail.get()) }
    }

    fn place(&self, at: u8) -> *mut u8 {
        self.bytes
            .get()
            .cast::<u8>()
            .wrapping_add((at & Self::MASK) as usize)
    }

    /// Bytes that still fit.
    pub fn room(&self) -> u8 {
        self.tail().wrapping_sub(self.head()).wrapping_sub(1) & Self::MASK
    }

    /// Whether nothing is in it.
    pub fn is_empty(&self) -> bool {
        self.head() == self.tail()
    }

    /// Adds a byte; false when it is full. The writer's.
    #[inline(never)]
    pub fn push(&self, byte: u8) -> bool {
        if self.room() == 0 {
            return false;
        }
        let head = self.head();
        // SAFETY: the mask keeps the place inside; the reader does not look at it before the head moves.
        unsafe {
            write_volatile(self.place(head), byte);
            write_volatile(self.head.get(), head.wrapping_add(1) & Self::MASK);
        }
        true
    }

    /// Takes a byte. The reader's.
    #[inline(never)]
    pub fn pop(&self) -> Option<u8> {
        if self.is_empty() {
            return None;
        }
        let tail = self.tail();
        // SAFETY: the mask keeps the place inside; the writer does not reuse it before the tail moves.
        unsafe {
            let byte = read_volatile(self.place(tail));
            write_volatile(self.tail.get(), tail.wrapping_add(1) & Self::MASK);
            Some(byte)
        }
    }
}
