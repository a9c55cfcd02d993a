//! The motor's stop, by what is answered to requests.

use super::asked::milliseconds;
use super::*;

#[test]
fn a_stop_ends_the_command_is_no_fault_and_refuses_until_a_new_nonce_comes_back() {
    let mut board = Board::new();
    let mut stand = booted(&mut board);
    sampled(&mut stand, &mut board, &raw());
    let arm = |nonce| Command::Arm { nonce };
    let duty = |duty| Command::MotorDuty { duty };
    let refused = |stand: &mut Stand, board: &mut Board, command| {
        ask(stand, board, command);
        last_reply(board).status
    };
    let profile = Command::MotorProfile {
        shape: wire::Shape::Steps,
        amplitude: 100,
        offset: 0,
        period_ms: 500,
        cycles: 0,
    };
    let driving = [duty(1), profile, Command::KeepAlive];
    // Held: there is no nonce, and nothing turns.
    board.pressed = true;
    for command in driving.into_iter().chain([arm(0), arm(5)]) {
        let status = refused(&mut stand, &mut board, command);
        assert_eq!(status, Status::Stopped, "{command:?}");
        assert_eq!(last_reply(&board).value, 0);
    }
    assert_eq!(refused(&mut stand, &mut board, duty(0)), Status::Ok);
    assert!(!board.alive && !stand.motor.is_on());
    // Let go: as before until a nonce is asked for, and then it is only not armed.
    (board.pressed, board.stopped) = (false, true);
    for command in driving {
        assert_eq!(refused(&mut stand, &mut board, command), Status::Stopped);
    }
    for pressed_between in [true, false] {
        assert_eq!(refused(&mut stand, &mut board, arm(0)), Status::Ok);
        let nonce = last_reply(&board).value as u16;
        assert!(!board.stopped);
        board.stopped = pressed_between;
        let status = refused(&mut stand, &mut board, arm(nonce));
        assert_eq!(status == Status::Stopped, pressed_between);
        assert_eq!(board.alive, !pressed_between);
    }
    assert_eq!(refused(&mut stand, &mut board, duty(200)), Status::Ok);
    milliseconds(&mut stand, &mut board, 10);
    assert!(stand.motor.is_on());
    // Pressed as it turns.
    board.stopped = true;
    milliseconds(&mut stand, &mut board, 1);
    assert!(!stand.motor.is_on());
    assert_eq!(board.deeds.last(), Some(&Deed::Motor(0)));
    milliseconds(&mut stand, &mut board, 10);
    assert_eq!(counted(&stand, Fault::MotorTimeout), 0);
}
