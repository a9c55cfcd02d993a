use adis16250::{Register, Word};
use wire::{Command, Decoder, Frame, Request, Sample, encode_request, flags};

use super::*;
use crate::acquire::{Raw, Task};

mod asked;
mod registers;
mod stopped;

/// What the stand has asked the board for, in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Deed {
    Motor(i16),
    Reboot,
    Period(u16, u8),
    Baud(u16),
    AccRange(u8),
    Job(Job),
}

/// A board that remembers, and whose EEPROM has a cell that does not keep what is written.
struct Board {
    frames: Vec<Frame>,
    deeds: Vec<Deed>,
    eeprom: [u8; 512],
    worn: Option<u16>,
    alive: bool,
    /// The stop is pressed now; it was.
    pressed: bool,
    stopped: bool,
    cause: u8,
    /// Bytes that the queue takes, and the largest frame's that it still takes.
    room: u8,
    takes: usize,
    /// Whether the slot for a job is free.
    free: bool,
    since: u16,
    stack: u16,
    kept: [u16; 2],
}

impl Board {
    fn new() -> Self {
        Self {
            frames: Vec::new(),
            deeds: Vec::new(),
            eeprom: [0xff; 512],
            worn: None,
            alive: false,
            pressed: false,
            stopped: false,
            cause: reset_cause::POWER_ON,
            room: 191,
            takes: 191,
            free: true,
            since: 0,
            stack: 99,
            // As SRAM comes up.
            kept: [0xdead; 2],
        }
    }
}

impl super::Board for Board {
    fn send(&mut self, kind: u8, fields: &[u8]) -> bool {
        let mut line = [0; wire::MAX_FRAME];
        let len = wire::fields::encode(kind, fields, &mut line);
        if len > self.takes {
            return false;
        }
        let mut decoder = Decoder::new();
        let frames = line[..len].iter().filter_map(|byte| decoder.push(*byte));
        self.frames
            .extend(frames.map(|frame| frame.expect("a frame")));
        true
    }
    fn room(&self) -> u8 {
        self.room
    }
    fn set_motor(&mut self, duty: i16) {
        self.deeds.push(Deed::Motor(duty));
    }
    fn keep_alive(&mut self) {
        self.alive = true;
    }
    fn host_is_there(&self) -> bool {
        self.alive && !self.is_stopped()
    }
    fn is_stopped(&self) -> bool {
        self.pressed || self.stopped
    }
    fn forget_stop(&mut self) {
        if std::mem::take(&mut self.stopped) {
            self.alive = false;
        }
    }
    fn set_period(&mut self, ticks: u16, every: u8) {
        self.deeds.push(Deed::Period(ticks, every));
    }
    fn set_baud(&mut self, divisor: u16) {
        self.deeds.push(Deed::Baud(divisor));
    }
    fn set_acc_range(&mut self, range: u8) {
        self.deeds.push(Deed::AccRange(range));
    }
    fn post(&mut self, job: Job) -> bool {
        if self.free {
            self.deeds.push(Deed::Job(job));
        }
        self.free
    }
    fn eeprom_read(&mut self, address: u16) -> u8 {
        self.eeprom[usize::from(address)]
    }
    fn eeprom_is_ready(&mut self) -> bool {
        true
    }
    fn eeprom_write(&mut self, address: u16, byte: u8) {
        if self.worn != Some(address) {
            self.eeprom[usize::from(address)] = byte;
        }
    }
    fn reboot(&mut self) {
        self.deeds.push(Deed::Reboot);
    }
    fn reset_cause(&self) -> u8 {
        self.cause
    }
    fn restarts(&self) -> u16 {
        0
    }
    fn kept(&self) -> [u16; 2] {
        self.kept
    }
    fn keep(&mut self, counts: [u16; 2]) {
        self.kept = counts;
    }
    fn stack_free(&self) -> u16 {
        self.stack
    }
    fn ticks_since(&self) -> u16 {
        self.since
    }
}

fn booted(board: &mut Board) -> Box<Stand> {
    let mut stand = Box::new(Stand::new());
    stand.boot(board);
    stand.started(board, 0);
    stand
}

fn ask(stand: &mut Stand, board: &mut Board, command: Command) {
    let mut line = [0; wire::MAX_FRAME];
    let number = 7;
    let len = encode_request(&Request { number, command }, &mut line).expect("there is room");
    for byte in &line[..len] {
        stand.on_byte(board, *byte);
    }
}

fn last_reply(board: &Board) -> wire::Reply {
    let replies = board.frames.iter().rev().find_map(|frame| match frame {
        Frame::Reply(reply) => Some(*reply),
        _ => None,
    });
    replies.expect("a reply")
}

fn counted(stand: &Stand, fault: Fault) -> u16 {
    stand.health.faults[fault as usize].get()
}

/// A sample in order.
fn raw() -> Raw {
    Raw {
        gyro: [Word(0x8003); 3],
        temp: [Word(0x8010); 3],
        supply: [Word(0x8000 | 2730); 3],
        acc: [512, 512, 760],
        ..Raw::new()
    }
}

fn sampled(stand: &mut Stand, board: &mut Board, raw: &Raw) -> Sample {
    stand.on_sample(board, raw, 0);
    match board.frames.last() {
        Some(Frame::Sample(sample)) => *sample,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_set_up_or_a_row_that_the_eeprom_does_not_keep_is_told_and_counted() {
    let row = Command::SetCorrection {
        row: 3,
        values: [1, 2, 3],
    };
    for (command, worn) in [(Command::StoreConfig, 80 + 20), (row, 272 + 18 + 4)] {
        let mut board = Board::new();
        let mut stand = booted(&mut board);
        for broken in [true, false] {
            board.worn = broken.then_some(worn);
            ask(&mut stand, &mut board, command);
            (0..100).for_each(|_| stand.on_millisecond(&mut board));
            let wanted = if broken {
                Status::NotStored
            } else {
                Status::Ok
            };
            assert_eq!(last_reply(&board).status, wanted, "{command:?}");
            assert_eq!(counted(&stand, Fault::ConfigNotStored), 1);
        }
    }
}

#[test]
fn a_stored_set_up_comes_back_and_of_two_the_newer_one() {
    let mut board = Board::new();
    let mut stand = booted(&mut board);
    for board_id in [11, 12, 13] {
        ask(&mut stand, &mut board, Command::SetBoardId { board_id });
        ask(&mut stand, &mut board, Command::StoreConfig);
        (0..100).for_each(|_| stand.on_millisecond(&mut board));
        let again = booted(&mut board);
        assert_eq!(again.config.board_id.get(), board_id);
        assert_eq!(counted(&again, Fault::ConfigInvalid), 0);
    }
    // The newest is spoilt: the one before it, and it is counted.
    board.eeprom[80 + 30] ^= 4;
    let again = booted(&mut board);
    assert_eq!(again.config.board_id.get(), 12);
    assert_eq!(counted(&again, Fault::ConfigInvalid), 1);
}

#[test]
fn each_cause_of_a_reset_has_its_counter_which_outlasts_resets_until_power_goes_or_it_is_cleared() {
    use reset_cause::{BROWN_OUT, EXTERNAL, POWER_ON, WATCHDOG};
    let mut board = Board::new();
    let mut start = |cause, clear: bool| {
        board.cause = cause;
        let mut stand = booted(&mut board);
        let told = [Fault::WatchdogReset, Fault::BrownOutReset].map(|f| counted(&stand, f));
        if clear {
            ask(&mut stand, &mut board, Command::ClearCounters);
        }
        told
    };
    assert_eq!(start(POWER_ON, false), [0, 0]);
    assert_eq!(start(WATCHDOG, false), [1, 0]);
    assert_eq!(start(EXTERNAL, false), [1, 0]);
    assert_eq!(start(BROWN_OUT, false), [1, 1]);
    assert_eq!(start(WATCHDOG | BROWN_OUT, false), [2, 2]);
    assert_eq!(start(BROWN_OUT, true), [2, 3]);
    assert_eq!(start(WATCHDOG, false), [1, 0]);
    // Brown-out while power comes up is one.
    assert_eq!(start(POWER_ON | BROWN_OUT, false), [0, 1]);
    board.kept = [u16::MAX; 2];
    board.cause = WATCHDOG;
    let stand = booted(&mut board);
    assert_eq!(counted(&stand, Fault::WatchdogReset), u16::MAX, "saturates");
}

#[test]
fn a_reboot_takes_the_motor_off_before_the_board_goes() {
    let mut board = Board::new();
    let mut stand = booted(&mut board);
    board.alive = true;
    ask(&mut stand, &mut board, Command::MotorDuty { duty: 200 });
    (0..500).for_each(|_| stand.on_millisecond(&mut board));
    assert_eq!(board.deeds.last(), Some(&Deed::Motor(200)));
    board.deeds.clear();
    ask(&mut stand, &mut board, Command::Reboot);
    assert_eq!(board.deeds, [Deed::Motor(0), Deed::Reboot]);
    // And its command is gone, should the board come round once more.
    assert_eq!(stand.motor.output(), 0);
}

#[test]
fn an_spi_frame_or_a_conversion_that_does_not_end_is_flagged_and_counted_on_its_axis() {
    let mut board = Board::new();
    let mut stand = booted(&mut board);
    assert_eq!(
        sampled(&mut stand, &mut board, &raw()).flags,
        flags::IN_ORDER
    );
    for axis in 0..3u8 {
        let bit = 1 << axis;
        let stalled = Raw {
            spi_stalled: bit,
            ..raw()
        };
        let before = counted(&stand, Fault::SpiStalled);
        let sample = sampled(&mut stand, &mut board, &stalled);
        assert_eq!(
            sample.flags & (flags::IN_ORDER | flags::GYRO_NOT_ANSWERING),
            flags::IN_ORDER & !u16::from(bit) | flags::GYRO_NOT_ANSWERING
        );
        assert_eq!(sample.gyro[usize::from(axis)], 0);
        assert_eq!(counted(&stand, Fault::SpiStalled), before + 1);
        let slow = Raw {
            adc_stalled: bit,
            ..raw()
        };
        let before = counted(&stand, Fault::AdcStalled);
        let sample = sampled(&mut stand, &mut board, &slow);
        assert!(sample.flags & flags::ACC_NOT_CONVERTED != 0, "{axis}");
        assert_eq!(counted(&stand, Fault::AdcStalled), before + 1);
    }
    let missing = |axis: u8| counted_at(&stand, Fault::GyroNotAnsweringX, axis);
    assert_eq!([missing(0), missing(1), missing(2)], [1, 1, 1]);
}

fn counted_at(stand: &Stand, fault_of_x: Fault, axis: u8) -> u16 {
    stand.health.faults[fault_of_x as usize + usize::from(axis)].get()
}
