//! What is read and written by hand: registers of the gyros, rows of a correction.

use super::asked::{ended, jobs, milliseconds};
use super::*;

#[test]
fn registers_are_read_and_written_by_a_job_that_is_answered_when_it_is_done() {
    let mut board = Board::new();
    let mut stand = booted(&mut board);
    board.deeds.clear();
    let gyro = wire::Axis::Z;
    let read = Command::ReadRegister {
        gyro,
        address: 0x38,
    };
    ask(&mut stand, &mut board, read);
    ask(&mut stand, &mut board, read);
    assert_eq!(last_reply(&board).status, Status::Busy);
    ended(&mut stand, &mut board, Task::Read, Status::Ok, 0xbeef);
    let reply = last_reply(&board);
    assert_eq!((reply.status, reply.value), (Status::Ok, 0xbeef));
    let value = 0x1234;
    let write = Command::WriteRegister {
        gyro,
        address: 0x36,
        value,
    };
    ask(&mut stand, &mut board, write);
    ended(
        &mut stand,
        &mut board,
        Task::Write,
        Status::ReadBackWrong,
        1,
    );
    let reply = last_reply(&board);
    assert_eq!((reply.status, reply.value), (Status::ReadBackWrong, 1));
    let job = |task, address, value| Job {
        task,
        axis: 2,
        address,
        value,
    };
    assert_eq!(
        jobs(&board),
        [job(Task::Read, 0x38, 0), job(Task::Write, 0x36, value)]
    );
}

#[test]
fn a_register_written_by_hand_takes_its_gyro_out_of_order_until_it_is_set_up_anew() {
    let mut board = Board::new();
    let mut stand = booted(&mut board);
    let is_flagged = |stand: &mut Stand, board: &mut Board| {
        sampled(stand, board, &raw()).flags & flags::GYRO_MISCONFIGURED != 0
    };
    let read = Command::ReadRegister {
        gyro: wire::Axis::Y,
        address: 0x38,
    };
    ask(&mut stand, &mut board, read);
    ended(&mut stand, &mut board, Task::Read, Status::Ok, 0x0402);
    assert!(!is_flagged(&mut stand, &mut board), "read alone");
    for (gyro, axis) in [(wire::Axis::X, 0), (wire::Axis::Y, 1), (wire::Axis::Z, 2)] {
        let write = Command::WriteRegister {
            gyro,
            address: 0x38,
            value: 0x0102,
        };
        ask(&mut stand, &mut board, write);
        ended(&mut stand, &mut board, Task::Write, Status::BadArgument, 0);
        assert!(!is_flagged(&mut stand, &mut board), "nothing was written");
        for status in [Status::Ok, Status::ReadBackWrong, Status::NotAnswering] {
            ask(&mut stand, &mut board, write);
            ended(&mut stand, &mut board, Task::Write, status, 0x0102);
            assert!(is_flagged(&mut stand, &mut board), "{axis} {status:?}");
            board.deeds.clear();
            milliseconds(&mut stand, &mut board, 1_100);
            assert!(is_flagged(&mut stand, &mut board), "it stays so");
            assert!(jobs(&board).is_empty(), "and what was written stays");
            let set = Command::SetGyro {
                range: 4,
                filter: 2,
            };
            ask(&mut stand, &mut board, set);
            for n in 0..3 {
                assert!(is_flagged(&mut stand, &mut board), "{n} of 3 are set up");
                ended(&mut stand, &mut board, Task::Configure, Status::Ok, 0);
            }
            assert!(!is_flagged(&mut stand, &mut board), "{axis} {status:?}");
        }
        // One that was away is set up as it comes back.
        ask(&mut stand, &mut board, write);
        ended(&mut stand, &mut board, Task::Write, Status::Ok, 0x0102);
        let mut away = raw();
        away.gyro[axis] = Word(0);
        away.supply[axis] = Word(0);
        sampled(&mut stand, &mut board, &away);
        assert!(is_flagged(&mut stand, &mut board));
        (0..3).for_each(|_| ended(&mut stand, &mut board, Task::Configure, Status::Ok, 0));
        assert!(!is_flagged(&mut stand, &mut board), "{axis}");
    }
}

/// A board that stores a correction in each of its copies, which differ in every number; the second is the newer one.
fn with_two_corrections() -> Board {
    let mut board = Board::new();
    for (copy, at) in crate::correction::COPIES.into_iter().enumerate() {
        let mut numbers: wire::correction::Numbers =
            std::array::from_fn(|n| (100 * copy + n) as i16);
        numbers[0] = i16::from_le_bytes([wire::correction::FORMAT, copy as u8]);
        let mut bytes = wire::correction::bytes(&numbers).to_vec();
        bytes.extend(wire::crc::crc32c(&bytes).to_le_bytes());
        board.eeprom[usize::from(at)..usize::from(at) + bytes.len()].copy_from_slice(&bytes);
    }
    board
}

#[test]
fn a_correction_is_switched_on_where_one_is_stored_and_off_anywhere() {
    for (mut board, in_use, on) in [
        (Board::new(), 0, Status::NoConfig),
        (with_two_corrections(), 2, Status::Ok),
    ] {
        let mut stand = booted(&mut board);
        for (on, used, status) in [(false, 0, Status::Ok), (true, in_use, on)] {
            ask(&mut stand, &mut board, Command::Correction { on });
            assert_eq!(last_reply(&board).status, status);
            assert_eq!(stand.correction.in_use(), used);
        }
    }
}

#[test]
fn a_row_is_read_of_the_copy_that_is_asked_for_and_written_to_the_one_that_is_not_in_use() {
    use crate::correction::COPIES;
    let mut board = with_two_corrections();
    let mut stand = booted(&mut board);
    for (other, begins) in [(false, 103), (true, 3)] {
        ask(
            &mut stand,
            &mut board,
            Command::GetCorrection { other, row: 1 },
        );
        let reply = last_reply(&board);
        assert_eq!((reply.status, reply.value), (Status::Ok, 2));
        assert_eq!(reply.detail, [begins, begins + 1, begins + 2]);
    }
    for row in 0..19u8 {
        let before = board.eeprom;
        let values = [-1, -2, -3 - i16::from(row)];
        ask(
            &mut stand,
            &mut board,
            Command::SetCorrection { row, values },
        );
        milliseconds(&mut stand, &mut board, 20);
        assert_eq!(last_reply(&board).status, Status::Ok);
        let mut wanted = before;
        let at = usize::from(COPIES[0]) + 6 * usize::from(row);
        for (place, value) in wanted[at..at + 6].chunks_exact_mut(2).zip(values) {
            place.copy_from_slice(&value.to_le_bytes());
        }
        assert_eq!(board.eeprom, wanted, "row {row}");
    }
    let refused = [
        Command::SetCorrection {
            row: 20,
            values: [0; 3],
        },
        Command::GetCorrection {
            other: false,
            row: 20,
        },
    ];
    for command in refused {
        ask(&mut stand, &mut board, command);
        assert_eq!(last_reply(&board).status, Status::BadArgument);
    }
}
