//! A line between board and host that damages what it carries, and knows what was true.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::io::ErrorKind;
use std::rc::Rc;
use std::time::Duration;

use imu_stand::link::Port;
use imu_stand::stand::Simulated;
use rand_core::{Rng as _, SeedableRng as _};
use rand_xoshiro::Xoshiro256PlusPlus;
use wire::{Decoder, Frame, Sample};

/// One frame in so many is damaged on its way to the host.
const DAMAGED: u64 = 2_000;

/// What the line knows: the truth, and what it did to it.
#[derive(Default)]
pub struct Truth {
    /// Samples on the line, not yet looked for at the host's end.
    pub samples: VecDeque<Sample>,
    /// Frames to the host that were damaged, samples among them or not.
    pub damaged: u64,
    /// Damage the next request.
    pub damages_request: bool,
}

/// A line that damages.
pub struct Line {
    inner: Simulated,
    witness: Decoder,
    rng: Xoshiro256PlusPlus,
    truth: Rc<RefCell<Truth>>,
}

impl Line {
    /// Of a simulated stand, with damage by that seed.
    pub fn new(inner: Simulated, seed: u64, truth: Rc<RefCell<Truth>>) -> Self {
        Self {
            inner,
            witness: Decoder::new(),
            rng: Xoshiro256PlusPlus::seed_from_u64(seed),
            truth,
        }
    }

    /// 0 bytes would be the end of the line.
    fn left(&self, count: usize) -> std::io::Result<usize> {
        match count {
            0 => Err(ErrorKind::TimedOut.into()),
            count => Ok(count),
        }
    }

    fn below(&mut self, n: usize) -> usize {
        ((u128::from(self.rng.next_u64()) * n as u128) >> 64) as usize
    }
}

impl Port for Line {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let count = self.inner.read(buffer)?;
        for &byte in &buffer[..count] {
            if let Some(Ok(Frame::Sample(sample))) = self.witness.push(byte) {
                self.truth.borrow_mut().samples.push_back(sample);
            }
        }
        if self.below(DAMAGED as usize) > 0 {
            return Ok(count);
        }
        self.truth.borrow_mut().damaged += 1;
        let at = self.below(count);
        match self.below(3) {
            0 => buffer[at] ^= 1 << self.below(8),
            1 => {
                buffer.copy_within(at + 1..count, at);
                return self.left(count - 1);
            }
            _ => return self.left(0),
        }
        Ok(count)
    }

    fn write_all(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        if !std::mem::take(&mut self.truth.borrow_mut().damages_request) {
            return self.inner.write_all(bytes);
        }
        let mut bytes = bytes.to_vec();
        // Not its end: the next one would be lost with it.
        let at = self.below(bytes.len() - 1);
        bytes[at] ^= 0x80 | 1 << self.below(7);
        self.inner.write_all(&bytes)
    }

    fn set_baud(&mut self, baud: u32) -> std::io::Result<()> {
        self.inner.set_baud(baud)
    }

    fn now(&self) -> Duration {
        self.inner.now()
    }
}
