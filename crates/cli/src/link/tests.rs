use super::*;

#[test]
fn speeds_are_those_of_the_data_sheets_table_and_the_marginal_ones_are_refused() {
    assert_eq!(divisor(38_400), Some(25));
    assert_eq!(divisor(250_000), Some(3));
    assert_eq!(divisor(9_600), Some(103));
    assert_eq!(divisor(115_200), None, "-3.5 %");
    assert_eq!(divisor(230_400), None, "+8.5 %");
    assert_eq!(divisor(57_600), None, "+2.1 %");
    assert!((baud_of(25) - 38_461.5).abs() < 0.1);
}

#[test]
fn what_must_not_happen_twice_is_sent_once() {
    let axis = wire::Axis::X;
    let write = |address| Command::WriteRegister {
        gyro: axis,
        address,
        value: 0,
    };
    let row = |row| Command::SetCorrection {
        row,
        values: [0; 3],
    };
    for once in [
        row(wire::correction::ROWS as u8),
        Command::Reboot,
        Command::ClearCounters,
        Command::SetBaud { divisor: 3 },
        Command::BiasNull { samples: 1 },
        Command::StoreConfig,
        Command::Arm { nonce: 0 },
        write(0x3e),
        write(0x3f),
    ] {
        assert_eq!(Patience::of(&once).tries, 1, "{once:?}");
    }
    for again in [Command::Ping, Command::KeepAlive, write(0x38), row(0)] {
        assert!(Patience::of(&again).tries > 1, "{again:?}");
    }
}

#[test]
fn a_motor_whose_stop_is_pressed_is_off_and_a_late_keep_alive_leaves_it() {
    let reply = |status| wire::Reply {
        number: 1,
        command: wire::code::KEEP_ALIVE,
        status,
        value: 0,
        detail: [0; 3],
    };
    let mut motor = Motor::Alive(std::time::Instant::now());
    for status in [Status::Ok, Status::NoKeepAlive] {
        assert!(matches!(motor.replied(&reply(status)), Ok(false)));
        assert!(motor.is_alive(), "{status:?}");
    }
    let refused = motor.replied(&reply(Status::Stopped));
    let refused = refused.expect_err("it is told").to_string();
    assert!(refused.contains("the motor's stop is pressed"), "{refused}");
    assert_eq!(motor, Motor::Off);
}
