//! What is asked for, job by job and byte by byte of room.

use super::*;
use crate::acquire::Done;

fn health(board: &Board) -> wire::Health {
    let found = board.frames.iter().rev().find_map(|frame| match frame {
        Frame::Health(health) => Some(*health),
        _ => None,
    });
    found.expect("a health frame")
}

fn hellos(board: &Board) -> usize {
    let is_hello = |frame: &&Frame| matches!(frame, Frame::Hello(_));
    board.frames.iter().filter(is_hello).count()
}

/// A job has ended with the sample.
pub(super) fn ended(stand: &mut Stand, board: &mut Board, task: Task, status: Status, value: u16) {
    let done = Done {
        task,
        status,
        value,
    };
    stand.on_sample(board, &Raw { done, ..raw() }, 0);
}

pub(super) fn milliseconds(stand: &mut Stand, board: &mut Board, count: u16) {
    (0..count).for_each(|_| stand.on_millisecond(board));
}

pub(super) fn jobs(board: &Board) -> Vec<Job> {
    let job = |deed: &Deed| match deed {
        Deed::Job(job) => Some(*job),
        _ => None,
    };
    board.deeds.iter().filter_map(job).collect()
}

#[test]
fn the_longest_work_of_a_tick_is_told() {
    let mut board = Board::new();
    let mut stand = booted(&mut board);
    for since in [120, 300, 300, 200] {
        board.since = since;
        sampled(&mut stand, &mut board, &raw());
    }
    ask(&mut stand, &mut board, Command::Counters);
    assert_eq!(health(&board).tick_busy_max, 300);
}

#[test]
fn health_comes_each_second_with_the_seconds_since_the_start() {
    let mut board = Board::new();
    let mut stand = booted(&mut board);
    board.frames.clear();
    milliseconds(&mut stand, &mut board, 999);
    assert!(board.frames.is_empty());
    milliseconds(&mut stand, &mut board, 1);
    assert_eq!((board.frames.len(), health(&board).uptime_s), (1, 1));
    milliseconds(&mut stand, &mut board, 2000);
    assert_eq!((board.frames.len(), health(&board).uptime_s), (3, 3));
    // Little stack is counted, with the frame that tells of it.
    for (stack, low) in [(32, 0), (31, 1)] {
        board.stack = stack;
        ask(&mut stand, &mut board, Command::Counters);
        let health = health(&board);
        assert_eq!(
            (health.stack_free, health.faults.get(Fault::StackLow)),
            (stack, low)
        );
    }
    // And the counters begin anew behind the frame that told them.
    ask(&mut stand, &mut board, Command::ClearCounters);
    assert_eq!(health(&board).faults.get(Fault::StackLow), 2);
    board.stack = 99;
    ask(&mut stand, &mut board, Command::Counters);
    assert_eq!(health(&board).faults.get(Fault::StackLow), 0);
}

/// A sample has 50 bytes on the line, a reply 28, a health frame 90.
#[test]
fn bytes_are_looked_at_where_there_is_room_for_what_they_may_bring() {
    let mut board = Board::new();
    let mut stand = booted(&mut board);
    let listens = |stand: &Stand, board: &mut Board, least: u8| {
        [least - 1, least].map(|room| {
            board.room = room;
            let listens = stand.listens(board);
            board.room = 191;
            listens
        })
    };
    // A reply beside a sample and the reply to come.
    for _ in 0..4 {
        assert_eq!(listens(&stand, &mut board, 50 + 28 + 28), [false, true]);
        sampled(&mut stand, &mut board, &raw());
    }
    // After four samples without a reply its own room is enough, and after a reply not any more.
    assert_eq!(listens(&stand, &mut board, 28), [false, true]);
    ask(&mut stand, &mut board, Command::Ping);
    assert_eq!(listens(&stand, &mut board, 50 + 28 + 28), [false, true]);
}

#[test]
fn a_report_that_is_late_goes_before_samples_and_has_its_room_kept() {
    let mut board = Board::new();
    let mut stand = booted(&mut board);
    for _ in 0..16 {
        sampled(&mut stand, &mut board, &raw());
    }
    // Not room enough beside a sample: it is owed.
    board.room = 90 + 28 + 50 - 1;
    milliseconds(&mut stand, &mut board, 1000);
    let before = board.frames.len();
    // For a sample's time it waits; then the sample does.
    stand.on_sample(&mut board, &raw(), 0);
    assert_eq!(board.frames.len(), before + 1);
    stand.on_sample(&mut board, &raw(), 0);
    stand.on_sample(&mut board, &raw(), 0);
    let dropped = counted(&stand, Fault::FrameDropped);
    assert!(dropped >= 1, "{dropped}");
    board.room = 90 + 28 + 28 - 1;
    assert!(!stand.listens(&board));
    board.room += 1;
    assert!(stand.listens(&board));
    // Its own room and a reply's are enough then.
    board.room = 90 + 28 - 1;
    milliseconds(&mut stand, &mut board, 1);
    assert!(!matches!(board.frames.last(), Some(Frame::Health(_))));
    board.room += 1;
    milliseconds(&mut stand, &mut board, 1);
    assert!(matches!(board.frames.last(), Some(Frame::Health(_))));
    // And samples have their turn again.
    board.room = 191;
    sampled(&mut stand, &mut board, &raw());
    assert_eq!(counted(&stand, Fault::FrameDropped), dropped);
}

#[test]
fn a_frame_that_finds_no_room_is_counted_by_its_kind() {
    let mut board = Board::new();
    let mut stand = booted(&mut board);
    board.takes = 0;
    stand.on_sample(&mut board, &raw(), 0);
    assert_eq!(counted(&stand, Fault::FrameDropped), 1);
    ask(&mut stand, &mut board, Command::Ping);
    assert_eq!(counted(&stand, Fault::ReportDropped), 1);
    let before = hellos(&board);
    ask(&mut stand, &mut board, Command::GetHello);
    board.takes = 191;
    milliseconds(&mut stand, &mut board, 1);
    assert_eq!(hellos(&board), before + 1, "a hello waits for its room");
    milliseconds(&mut stand, &mut board, 1);
    assert_eq!(hellos(&board), before + 1);
}

#[test]
fn lost_ticks_spend_their_numbers_and_are_flagged_and_counted() {
    let mut board = Board::new();
    let mut stand = booted(&mut board);
    assert_eq!(sampled(&mut stand, &mut board, &raw()).seq, 0);
    stand.on_sample(&mut board, &raw(), 3);
    let Some(Frame::Sample(sample)) = board.frames.last() else {
        panic!("a sample");
    };
    assert_eq!(sample.seq, 4);
    assert_eq!(sample.flags, flags::IN_ORDER | flags::TICK_OVERRUN);
    assert_eq!(counted(&stand, Fault::TickOverrun), 3);
}

#[test]
fn setting_the_gyros_goes_from_one_to_the_next_and_says_which_do_not_read_back() {
    let set = Command::SetGyro {
        range: 2,
        filter: 4,
    };
    let mut board = Board::new();
    let mut stand = booted(&mut board);
    // The slot is taken: busy, and nothing has changed.
    board.free = false;
    ask(&mut stand, &mut board, set);
    assert_eq!(last_reply(&board).status, Status::Busy);
    assert_eq!(stand.sens_avg(), 0x0402);
    board.free = true;
    board.deeds.clear();
    ask(&mut stand, &mut board, set);
    ask(&mut stand, &mut board, set);
    assert_eq!(last_reply(&board).status, Status::Busy, "one at a time");
    board.frames.clear();
    for axis in 0..3u8 {
        let job = jobs(&board)[usize::from(axis)];
        assert_eq!(
            (job.task, job.axis, job.value),
            (Task::Configure, axis, 0x0204)
        );
        // y does not read back; z has another's scale.
        let wrong = [0, 2, 4 << 3][usize::from(axis)];
        ended(&mut stand, &mut board, Task::Configure, Status::Ok, wrong);
        let is_last = axis == 2;
        let replied = board
            .frames
            .iter()
            .any(|frame| matches!(frame, Frame::Reply(_)));
        assert_eq!(replied, is_last);
    }
    let reply = last_reply(&board);
    assert_eq!((reply.status, reply.value), (Status::ReadBackWrong, 2));
    assert_eq!(jobs(&board).len(), 3);
    let mismatch = |axis| counted_at(&stand, Fault::GyroRegisterMismatchX, axis);
    assert_eq!([mismatch(0), mismatch(1), mismatch(2)], [0, 1, 0]);
    let scale = |axis| counted_at(&stand, Fault::GyroScaleImpossibleX, axis);
    assert_eq!([scale(0), scale(1), scale(2)], [0, 0, 1]);
    let sample = sampled(&mut stand, &mut board, &raw());
    assert_eq!(sample.flags, flags::IN_ORDER | flags::GYRO_MISCONFIGURED);
    // Within a second it is tried anew; then all is well, and that is counted.
    board.deeds.clear();
    milliseconds(&mut stand, &mut board, 1000);
    sampled(&mut stand, &mut board, &raw());
    for _ in 0..3 {
        ended(&mut stand, &mut board, Task::Configure, Status::Ok, 0);
    }
    let sample = sampled(&mut stand, &mut board, &raw());
    assert_eq!(sample.flags, flags::IN_ORDER);
    let recovered = |axis| counted_at(&stand, Fault::GyroRecoveredX, axis);
    assert_eq!([recovered(0), recovered(1), recovered(2)], [0, 1, 1]);
}

#[test]
fn a_gyro_that_comes_back_is_set_up_and_an_error_has_its_status_read_once_a_second() {
    let mut board = Board::new();
    let mut stand = booted(&mut board);
    board.deeds.clear();
    let mut silent = raw();
    silent.gyro[1] = Word(0xffff);
    silent.supply[1] = Word(0xffff);
    let sample = sampled(&mut stand, &mut board, &silent);
    assert_eq!(
        sample.flags & flags::GYRO_NOT_ANSWERING,
        flags::GYRO_NOT_ANSWERING
    );
    assert!(jobs(&board).is_empty());
    sampled(&mut stand, &mut board, &raw());
    assert_eq!(jobs(&board).len(), 1, "it is set up");
    assert_eq!(counted_at(&stand, Fault::GyroRecoveredX, 1), 1);
    for _ in 0..3 {
        ended(&mut stand, &mut board, Task::Configure, Status::Ok, 0);
    }
    board.deeds.clear();
    let mut alarm = raw();
    alarm.gyro[2] = Word(0xc003);
    let sample = sampled(&mut stand, &mut board, &alarm);
    assert_eq!(sample.flags, flags::IN_ORDER | flags::error(2));
    let [job] = jobs(&board)[..] else {
        panic!("one job");
    };
    assert_eq!((job.task, job.axis), (Task::Read, 2));
    assert_eq!(job.address, Register::Status.address());
    let frames = board.frames.len();
    let done = Done {
        task: Task::Read,
        status: Status::Ok,
        value: 16,
    };
    stand.on_sample(&mut board, &Raw { done, ..alarm }, 0);
    sampled(&mut stand, &mut board, &alarm);
    assert_eq!(jobs(&board).len(), 1, "once a second");
    assert_eq!(board.frames.len(), frames + 2, "and nobody is told");
    milliseconds(&mut stand, &mut board, 1000);
    sampled(&mut stand, &mut board, &alarm);
    assert_eq!(jobs(&board).len(), 2);
}

/// Clears STATUS, starts the test, waits for 40 ms, asks whether it has ended, reads the verdict.
#[test]
fn a_self_test_goes_step_by_step_and_each_way_it_ends_is_told() {
    use adis16250::control::{MSC_SELF_TEST, STATUS_SELF_TEST_FAILED};
    let sensor = wire::Sensor::GyroY;
    for (at, status, value, wanted) in [
        (3, Status::Ok, 0, Status::Ok),
        (
            3,
            Status::Ok,
            STATUS_SELF_TEST_FAILED,
            Status::SelfTestFailed,
        ),
        (2, Status::Ok, MSC_SELF_TEST, Status::SelfTestFailed),
        (0, Status::NotAnswering, 0, Status::NotAnswering),
        (1, Status::NotAnswering, 0, Status::NotAnswering),
        (2, Status::NotAnswering, 0, Status::NotAnswering),
        (3, Status::NotAnswering, 0, Status::NotAnswering),
    ] {
        let mut board = Board::new();
        let mut stand = booted(&mut board);
        board.deeds.clear();
        board.frames.clear();
        ask(&mut stand, &mut board, Command::SelfTest { sensor });
        for step in 0..=at {
            // The slot may be taken: it is tried again.
            board.free = false;
            let wait = if step == 2 { 40 } else { 1 };
            milliseconds(&mut stand, &mut board, wait);
            board.free = true;
            assert_eq!(jobs(&board).len(), step, "{wanted:?}");
            milliseconds(&mut stand, &mut board, 1);
            let job = jobs(&board)[step];
            let (task, register) = [
                (Task::Read, Register::Status),
                (Task::Write, Register::MscCtrl),
                (Task::Read, Register::MscCtrl),
                (Task::Read, Register::Status),
            ][step];
            assert_eq!(
                (job.task, job.axis, job.address),
                (task, 1, register.address())
            );
            if step == 1 {
                assert_eq!(job.value, MSC_SELF_TEST);
            }
            let sample = sampled(&mut stand, &mut board, &raw());
            assert_ne!(sample.flags & flags::GYRO_MISCONFIGURED, 0);
            let (status, value) = if step == at {
                (status, value)
            } else if step == 1 {
                // The bit clears itself.
                (Status::ReadBackWrong, 0)
            } else {
                (Status::Ok, u16::from(step == 2) * 0x0003)
            };
            ended(&mut stand, &mut board, task, status, value);
        }
        assert_eq!(last_reply(&board).status, wanted, "step {at}");
        assert_eq!(
            sampled(&mut stand, &mut board, &raw()).flags,
            flags::IN_ORDER
        );
        let before = jobs(&board).len();
        milliseconds(&mut stand, &mut board, 100);
        assert_eq!(jobs(&board).len(), before, "it is over");
    }
    let mut board = Board::new();
    let mut stand = booted(&mut board);
    let sensor = wire::Sensor::Accelerometer;
    ask(&mut stand, &mut board, Command::SelfTest { sensor });
    assert_eq!(last_reply(&board).status, Status::Unsupported);
}

#[test]
fn what_is_set_reaches_the_board_and_what_is_out_of_range_does_not() {
    let mut board = Board::new();
    let mut stand = booted(&mut board);
    board.deeds.clear();
    let rate = |period_ticks, periods_per_sample| Command::SetRate {
        period_ticks,
        periods_per_sample,
    };
    for (command, deed) in [
        (rate(2_500, 0), Some(Deed::Period(2_500, 1))),
        (rate(50_000, 4), Some(Deed::Period(50_000, 4))),
        (rate(500, 1), None),
        (rate(2_500, 5), None),
        (Command::SetBaud { divisor: 3 }, Some(Deed::Baud(3))),
        (Command::SetBaud { divisor: 4_096 }, None),
        (Command::SetAccRange { range: 3 }, Some(Deed::AccRange(3))),
        (Command::SetAccRange { range: 4 }, None),
    ] {
        let before = stand.config;
        ask(&mut stand, &mut board, command);
        let status = last_reply(&board).status;
        if let Some(deed) = deed {
            assert_eq!((status, board.deeds.pop()), (Status::Ok, Some(deed)));
            assert_eq!(stand.config.set_up.config_source, 3, "changed since");
        } else {
            assert_eq!((status, board.deeds.pop()), (Status::BadArgument, None));
            assert_eq!(stand.config, before, "{command:?}");
        }
    }
    ask(&mut stand, &mut board, Command::DefaultConfig);
    assert_eq!(stand.config.set_up.config_source, 0);
    for deed in [
        Deed::Motor(0),
        Deed::Period(12_500, 1),
        Deed::Baud(25),
        Deed::AccRange(0),
    ] {
        assert!(board.deeds.contains(&deed), "{deed:?}");
    }
    ask(&mut stand, &mut board, Command::LoadConfig);
    assert_eq!(last_reply(&board).status, Status::NoConfig);
}

#[test]
fn a_motor_turns_for_one_who_has_armed_it_and_says_what_holds() {
    let mut board = Board::new();
    let mut stand = booted(&mut board);
    let duty = |duty| Command::MotorDuty { duty };
    let profile = Command::MotorProfile {
        shape: wire::Shape::Sine,
        amplitude: 100,
        offset: 0,
        period_ms: 500,
        cycles: 1,
    };
    for (command, status) in [
        (duty(10), Status::NoKeepAlive),
        (duty(0), Status::Ok),
        (profile, Status::NoKeepAlive),
        (Command::KeepAlive, Status::NoKeepAlive),
    ] {
        ask(&mut stand, &mut board, command);
        assert_eq!(last_reply(&board).status, status, "{command:?}");
    }
    // A nonce is good once, and another number never.
    let arm = |nonce| Command::Arm { nonce };
    sampled(&mut stand, &mut board, &raw());
    ask(&mut stand, &mut board, arm(1));
    assert_eq!(last_reply(&board).status, Status::BadArgument);
    ask(&mut stand, &mut board, arm(0));
    let nonce = last_reply(&board).value as u16;
    assert_ne!(nonce, 0);
    ask(&mut stand, &mut board, arm(nonce ^ 2));
    ask(&mut stand, &mut board, arm(nonce));
    assert_eq!(last_reply(&board).status, Status::BadArgument, "one answer");
    ask(&mut stand, &mut board, arm(0));
    let nonce = last_reply(&board).value as u16;
    assert!(!board.alive);
    ask(&mut stand, &mut board, arm(nonce));
    assert!(board.alive);
    let limits = Command::MotorLimits {
        max_duty: 80,
        ramp_per_s: 65_535,
    };
    for (command, status, value) in [
        (limits, Status::Ok, 0),
        (duty(200), Status::Ok, 80),
        (duty(-200), Status::Ok, -80),
        (duty(256), Status::BadArgument, 0),
        (profile, Status::Ok, 0),
        (Command::KeepAlive, Status::Ok, 0),
    ] {
        ask(&mut stand, &mut board, command);
        let reply = last_reply(&board);
        assert_eq!((reply.status, reply.value), (status, value), "{command:?}");
    }
    // The host falls silent: the command ends, once.
    milliseconds(&mut stand, &mut board, 10);
    assert!(stand.motor.is_on());
    board.alive = false;
    milliseconds(&mut stand, &mut board, 10);
    assert!(!stand.motor.is_on());
    assert_eq!(counted(&stand, Fault::MotorTimeout), 1);
}
