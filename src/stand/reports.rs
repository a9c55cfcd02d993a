//! What the board says besides samples: hello, health, replies.

use wire::{Fault, Health, Hello, Reply, Status};

use super::{Board, Stand};

impl Stand {
    #[inline(never)]
    pub(super) fn reply<B: Board>(
        &mut self,
        board: &mut B,
        number: u16,
        command: u8,
        status: Status,
        value: i32,
        detail: [i32; 3],
    ) {
        let reply = Reply {
            number,
            command,
            status,
            value,
            detail,
        };
        let mut frame = [0; Reply::FRAME_LEN];
        if wire::encode_reply(&reply, &mut frame).is_err() || !board.send(&frame) {
            self.faults.record(Fault::ReportDropped);
        }
    }

    #[inline(never)]
    pub(super) fn hello<B: Board>(&mut self, board: &mut B) {
        let hello = Hello {
            firmware: crate::VERSION,
            board_id: self.config.board_id,
            reset_cause: board.reset_cause(),
            restarts: board.restarts(),
            next_seq: self.next_seq,
            tick_ns: crate::TICK_NS,
            period_ticks: self.config.period_ticks,
            baud_divisor: self.config.baud_divisor,
            gyro_range: self.config.gyro_range,
            gyro_filter: self.config.gyro_filter,
            gyro_sample_period: 1,
            acc_range: self.config.acc_range,
            config_source: self.source,
            bias: self.config.bias,
            scale: self.config.scale,
        };
        let mut frame = [0; Hello::FRAME_LEN];
        if wire::encode_hello(&hello, &mut frame).is_err() || !board.send(&frame) {
            self.faults.record(Fault::ReportDropped);
        }
    }

    #[inline(never)]
    pub(super) fn health<B: Board>(&mut self, board: &mut B) {
        let health = Health {
            uptime_s: self.uptime_s,
            next_seq: self.next_seq,
            tick_busy_max: self.tick_busy_max,
            stack_free: board.stack_free(),
            faults: self.faults,
        };
        let mut frame = [0; Health::FRAME_LEN];
        if wire::encode_health(&health, &mut frame).is_err() || !board.send(&frame) {
            self.faults.record(Fault::ReportDropped);
        }
    }
}
