//! What keeps the gyros set up: anew after they were away or did not read back, and their alarms cleared.

use adis16250::Register;
use wire::Fault;

use super::{Board, Pending, Stand};
use crate::acquire::{Job, Task};

impl Stand {
    /// A gyro that answers again may have lost its set-up with its power; one that raises its error or alarm bit, bit per
    /// axis in `errors`, keeps it up until its STATUS is read.
    pub(super) fn look_after_gyros<B: Board>(&mut self, board: &mut B, silent: u8, errors: u8) {
        let back = self.silent & !silent;
        self.silent = silent;
        if back != 0 {
            self.record_each(Fault::GyroRecoveredX, back);
            self.unset = true;
        }
        if !self.job.is_none() {
            return;
        }
        if self.unset {
            if self.configure(board, 0) {
                self.unset = false;
                self.job.code = Pending::OWN;
            }
            return;
        }
        let uncleared = errors & !self.cleared;
        if uncleared == 0 {
            return;
        }
        // The lowest of them.
        let (mut axis, mut bit) = (0, 1);
        while uncleared & bit == 0 {
            axis += 1;
            bit <<= 1;
        }
        let job = Job {
            task: Task::Read,
            axis,
            address: Register::Status.address(),
            value: 0,
        };
        if board.post(job) {
            self.cleared |= bit;
            self.job.code = Pending::OWN;
        }
    }

    /// Has a gyro set up in the next slot; the others follow, each in its own.
    #[inline(never)]
    pub(super) fn configure<B: Board>(&mut self, board: &mut B, axis: u8) -> bool {
        let posted = board.post(Job {
            task: Task::Configure,
            axis,
            value: self.config.sens_avg(),
            address: 0,
        });
        if posted {
            self.setting = axis;
        }
        posted
    }

    /// What has come of setting up the gyros that have their bit in `axes`.
    #[inline(never)]
    pub(super) fn note_configured(&mut self, axes: u8, wrong: u8) {
        let now = (wrong | wrong >> 3) & 7;
        self.record_each(Fault::GyroRecoveredX, self.misconfigured & axes & !now);
        self.misconfigured = self.misconfigured & !axes | now;
        self.touched &= !axes;
        self.record_each(Fault::GyroRegisterMismatchX, wrong);
        self.record_each(Fault::GyroScaleImpossibleX, wrong >> 3);
    }

    /// Counts a fault of each axis that has its bit set.
    #[inline(never)]
    pub(super) fn record_each(&mut self, fault_of_x: Fault, axes: u8) {
        for axis in 0..3 {
            if axes & (1 << axis) != 0 {
                self.record(fault_of_x, axis);
            }
        }
    }
}
