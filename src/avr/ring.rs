//! A ring between one interrupt and the main loop: one side writes, the other reads.
//!
//! Indices are single bytes, which the AVR reads and writes in one instruction, so neither side needs the interrupts
//! off. (`heapless::spsc` does the same with 16-bit indices and a division.)

use core::cell::UnsafeCell;
use core::ptr::{read_volatile, write_volatile};

/// Holds up to `N - 1` bytes; `N` is at most 255.
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
    const LAST: u8 = {
        assert!(N > 1 && N <= 255);
        (N - 1) as u8
    };

    /// Writes a byte ahead of what the reader sees, at a place from [`head`](Self::head) on, of which there is
    /// [`room`](Self::room) for. The writer's.
    #[inline(always)]
    pub fn put(&self, at: u8, byte: u8) {
        // SAFETY: inside, and behind the head the reader does not look.
        unsafe { write_volatile(self.place(at), byte) }
    }

    /// Shows the reader what [`put`](Self::put) has written before this place. The writer's.
    pub fn advance(&self, to: u8) {
        // SAFETY: a byte, written once.
        unsafe { write_volatile(self.head.get(), to) }
    }

    /// The place behind one.
    #[inline(always)]
    pub fn after(at: u8) -> u8 {
        if at >= Self::LAST {
            0
        } else {
            at.wrapping_add(1)
        }
    }

    /// Empty.
    pub const fn new() -> Self {
        Self {
            bytes: UnsafeCell::new([0; N]),
            head: UnsafeCell::new(0),
            tail: UnsafeCell::new(0),
        }
    }

    /// Next to write.
    pub fn head(&self) -> u8 {
        // SAFETY: a byte.
        unsafe { read_volatile(self.head.get()) }
    }

    fn tail(&self) -> u8 {
        // SAFETY: a byte.
        unsafe { read_volatile(self.tail.get()) }
    }

    fn place(&self, at: u8) -> *mut u8 {
        self.bytes.get().cast::<u8>().wrapping_add(at as usize)
    }

    /// Bytes that still fit.
    pub fn room(&self) -> u8 {
        let (head, tail) = (self.head(), self.tail());
        let used = head.wrapping_sub(tail);
        // Behind the tail the head has wrapped.
        let used = if head < tail {
            used.wrapping_add(N as u8)
        } else {
            used
        };
        Self::LAST.wrapping_sub(used)
    }

    /// Whether nothing is in it.
    pub fn is_empty(&self) -> bool {
        self.head() == self.tail()
    }

    /// Adds a byte; false when it is full. The writer's.
    #[inline(always)]
    pub fn push(&self, byte: u8) -> bool {
        let head = self.head();
        let next = Self::after(head);
        if next == self.tail() {
            return false;
        }
        // SAFETY: the head stays inside; the reader does not look at it before the head moves.
        unsafe {
            write_volatile(self.place(head), byte);
            write_volatile(self.head.get(), next);
        }
        true
    }

    /// Takes a byte. The reader's. In line: a call would have the interrupt save every register that a call may change.
    #[inline(always)]
    pub fn pop(&self) -> Option<u8> {
        let tail = self.tail();
        if self.head() == tail {
            return None;
        }
        // SAFETY: the tail stays inside; the writer does not reuse it before the tail moves.
        unsafe {
            let byte = read_volatile(self.place(tail));
            write_volatile(self.tail.get(), Self::after(tail));
            Some(byte)
        }
    }
}
