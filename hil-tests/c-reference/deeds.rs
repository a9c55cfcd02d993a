//! Everything that the host does in the session.

use super::*;

/// Commands that are answered at once, good ones and bad.
fn plain_commands() -> Vec<(u8, [u8; 8])> {
    let mut all = Vec::new();
    let mut ask = |code: u8, arguments: &[u8]| {
        let mut eight = [0; 8];
        eight[..arguments.len()].copy_from_slice(arguments);
        all.push((code, eight));
    };
    for code in [
        code::PING,
        code::GET_HELLO,
        code::COUNTERS,
        0,
        7,
        20,
        67,
        84,
        255,
    ] {
        ask(code, &[]);
    }
    ask(code::PING, &[0, 0, 0, 0, 0, 0, 0, 1]);
    ask(code::SET_ACC_RANGE, &[3]);
    ask(code::SET_ACC_RANGE, &[4]);
    ask(code::SET_ACC_RANGE, &[2, 1]);
    for axis in 0..4 {
        ask(code::SET_BIAS, &[axis, 0x12, 0x34 ^ axis, axis, 0]);
        ask(code::SET_SCALE, &[axis, 0xEB, 0xC0, 0x12, 0]);
    }
    ask(code::SET_SCALE, &[0, 0, 0, 0, 0]);
    ask(code::SET_SCALE, &[0, 0, 0, 0, 0x80]);
    ask(code::SET_SCALE, &[0, 0, 0, 0x40, 0]);
    ask(code::SET_SCALE, &[0, 0xFF, 0xFF, 0x3F, 0]);
    // Out of range, and at its ends.
    for high in [0x0200, 0x01FF, 0xFDFF, 0xFE00, 0x7FFF, 0x8000u16] {
        let [low, high] = high.to_le_bytes();
        ask(code::SET_BIAS, &[1, 0, 0, low, high]);
    }
    ask(code::SET_RATE, &[0xCF, 0x03, 0]);
    ask(code::SET_RATE, &[0x25, 0xF4, 0]);
    ask(code::SET_RATE, &[0x51, 0xC3, 5]);
    ask(code::SET_BAUD, &[0x00, 0x10]);
    ask(code::SET_GYRO, &[3, 2]);
    ask(code::SET_GYRO, &[2, 1]);
    ask(code::SET_GYRO, &[1, 3]);
    ask(code::SET_GYRO, &[4, 7]);
    ask(code::MOTOR_DUTY, &[100, 0]);
    ask(code::MOTOR_DUTY, &[0, 1]);
    ask(code::MOTOR_DUTY, &[0, 0]);
    ask(code::MOTOR_PROFILE, &[3, 100, 0, 0, 0, 200, 0, 0]);
    ask(code::MOTOR_PROFILE, &[0, 9, 9, 9, 9, 9, 9, 9]);
    ask(code::SELF_TEST, &[3]);
    ask(code::SELF_TEST, &[4]);
    ask(code::BIAS_NULL, &[1, 0]);
    ask(code::BIAS_NULL, &[1, 64]);
    ask(code::SET_BOARD_ID, &[0x39, 0x30]);
    ask(code::LOAD_CONFIG, &[]);
    ask(code::GET_HELLO, &[]);
    all
}

/// Everything that the host does.
pub(super) fn deeds() -> Vec<(u64, Deed)> {
    let mut all: Vec<(u64, Deed)> = Vec::new();
    let mut number = 0;
    let mut next = || {
        number += 1;
        number
    };
    // 20 ms after a tick or 5 ms before one: neither on the edge of a sample, nor of the health frame.
    let mut at = 20;
    for (code, arguments) in plain_commands() {
        all.push((at, raw_request(next(), code, arguments)));
        at += 50;
    }
    // Damage of all kinds, then a request in order.
    for bytes in [
        vec![5, 1, 16, 3, 0],
        vec![255, 1, 2, 3, 0],
        vec![1, 0],
        vec![9; 40],
        vec![0, 0, 0],
        vec![7, 1, 16, 3, 2, 1, 9, 1, 1, 1, 1, 1, 1, 1, 5, 1, 2, 3, 4, 0],
        b"?".to_vec(),
        b"??\0".to_vec(),
        b"ping?\0".to_vec(),
    ] {
        all.push((at, Deed::Send(bytes)));
        at += 50;
    }
    for byte in [0x55, 0] {
        all.push((at, Deed::SendWithoutStopBit(byte)));
        at += 50;
    }
    all.push((at, Deed::Send(vec![0])));
    at += 50;
    // Work on the gyros; the second of a pair finds the first one busy.
    let on_gyros = [
        (
            Command::SetGyro {
                range: 2,
                filter: 4,
            },
            300,
        ),
        (
            Command::SetGyro {
                range: 2,
                filter: 4,
            },
            5,
        ),
        (
            Command::SetGyro {
                range: 4,
                filter: 2,
            },
            395,
        ),
        (
            Command::SetGyro {
                range: 4,
                filter: 2,
            },
            300,
        ),
        (
            Command::ReadRegister {
                gyro: wire::Axis::Y,
                address: 0x38,
            },
            100,
        ),
        (
            Command::ReadRegister {
                gyro: wire::Axis::Y,
                address: 0x3E,
            },
            100,
        ),
        (
            Command::ReadRegister {
                gyro: wire::Axis::Y,
                address: 0x06,
            },
            100,
        ),
        (
            Command::ReadRegister {
                gyro: wire::Axis::Y,
                address: 0x40,
            },
            100,
        ),
        (
            Command::WriteRegister {
                gyro: wire::Axis::X,
                address: 0x14,
                value: 0x0123,
            },
            100,
        ),
        (
            Command::WriteRegister {
                gyro: wire::Axis::X,
                address: 0x02,
                value: 1,
            },
            100,
        ),
        (
            Command::WriteRegister {
                gyro: wire::Axis::Z,
                address: 0x38,
                value: 0x0204,
            },
            100,
        ),
        (
            Command::WriteRegister {
                gyro: wire::Axis::Z,
                address: 0x38,
                value: 0x0402,
            },
            100,
        ),
        (
            Command::WriteRegister {
                gyro: wire::Axis::X,
                address: 0x3E,
                value: 0x0010,
            },
            100,
        ),
        (
            Command::SelfTest {
                sensor: wire::Sensor::GyroX,
            },
            400,
        ),
        (
            Command::SelfTest {
                sensor: wire::Sensor::GyroY,
            },
            5,
        ),
        (
            Command::SelfTest {
                sensor: wire::Sensor::GyroZ,
            },
            395,
        ),
        (
            Command::SelfTest {
                sensor: wire::Sensor::GyroZ,
            },
            400,
        ),
    ];
    for (command, pause) in on_gyros {
        all.push((at, request(next(), command)));
        at += pause;
    }
    all.push((
        at,
        raw_request(next(), code::READ_REGISTER, [3, 0x38, 0, 0, 0, 0, 0, 0]),
    ));
    at += 100;
    // z does not keep its filter: the set-up that it has from the factory, so that what follows finds all in order.
    all.push((at, request(next(), Command::DefaultConfig)));
    at += 500;
    // The motor: refused, driven, limited, left alone; profiles of all shapes.
    let alive =
        |all: &mut Vec<(u64, Deed)>, from: u64, ms: u64, number: &mut dyn FnMut() -> u16| {
            for keep in 0..ms / 100 {
                all.push((from + keep * 100, request(number(), Command::KeepAlive)));
            }
        };
    // Keep-alives alone do not arm it, nor does a nonce that nobody told, which spoils the one that was; nor one twice.
    all.push((at, request(next(), Command::KeepAlive)));
    all.push((at + 50, request(next(), Command::Arm { nonce: 0 })));
    all.push((at + 100, request(next(), Command::Arm { nonce: 2 })));
    all.push((at + 150, Deed::Arm(next())));
    all.push((at + 200, request(next(), Command::Arm { nonce: 0 })));
    all.push((at + 250, Deed::Arm(next())));
    all.push((at + 300, Deed::Arm(next())));
    at += 350;
    for (command, ms) in [
        (Command::MotorDuty { duty: 200 }, 700),
        (Command::MotorDuty { duty: -255 }, 1300),
        (
            Command::MotorLimits {
                max_duty: 90,
                ramp_per_s: 2000,
            },
            200,
        ),
        (Command::MotorDuty { duty: 200 }, 600),
        (Command::BiasNull { samples: 24 }, 100),
        (
            Command::MotorLimits {
                max_duty: 255,
                ramp_per_s: 65_535,
            },
            100,
        ),
        (
            Command::MotorProfile {
                shape: Shape::Steps,
                amplitude: 50,
                offset: -20,
                period_ms: 300,
                cycles: 2,
            },
            1000,
        ),
        (
            Command::MotorProfile {
                shape: Shape::Triangle,
                amplitude: 255,
                offset: 30,
                period_ms: 700,
                cycles: 0,
            },
            1500,
        ),
        (
            Command::MotorProfile {
                shape: Shape::Sine,
                amplitude: -200,
                offset: 10,
                period_ms: 999,
                cycles: 1,
            },
            1500,
        ),
    ] {
        alive(&mut all, at, ms, &mut next);
        all.push((at + 10, request(next(), command)));
        at += ms;
    }
    at += 500;
    // The stop, held: no nonce. Pressed behind the nonce: it is spent. Pressed as it turns: off, until it is armed anew.
    let duty = Command::MotorDuty { duty: 90 };
    all.push((at, Deed::Press(true)));
    all.push((at + 10, request(next(), Command::Arm { nonce: 0 })));
    all.push((at + 60, request(next(), duty)));
    all.push((at + 110, Deed::Press(false)));
    all.push((at + 120, request(next(), Command::KeepAlive)));
    all.push((at + 170, request(next(), Command::Arm { nonce: 0 })));
    all.push((at + 220, Deed::Press(true)));
    all.push((at + 221, Deed::Press(false)));
    all.push((at + 230, Deed::Arm(next())));
    all.push((at + 300, request(next(), Command::Arm { nonce: 0 })));
    all.push((at + 350, Deed::Arm(next())));
    all.push((at + 400, request(next(), duty)));
    all.push((at + 450, request(next(), Command::KeepAlive)));
    all.push((at + 470, Deed::Press(true)));
    all.push((at + 471, Deed::Press(false)));
    alive(&mut all, at + 500, 300, &mut next);
    all.push((at + 850, request(next(), duty)));
    all.push((at + 900, request(next(), Command::Counters)));
    at += 1_000;
    // Bias: moving, then at rest, and another one meanwhile.
    all.push((at, request(next(), Command::BiasNull { samples: 24 })));
    at += 200;
    all.push((at, Deed::Quiet(true)));
    at += 100;
    all.push((at, request(next(), Command::BiasNull { samples: 33 })));
    all.push((at + 50, request(next(), Command::BiasNull { samples: 33 })));
    at += 2500;
    // Broken off by what changes what it measures.
    all.push((at, request(next(), Command::BiasNull { samples: 33 })));
    let to = Command::SetBias {
        axis: wire::Axis::X,
        value: 5,
    };
    all.push((at + 200, request(next(), to)));
    at += 250;
    all.push((at, Deed::Quiet(false)));
    at += 50;
    // EEPROM: store twice, spoil the newer, load; store, and spoil both.
    for command in [
        Command::StoreConfig,
        Command::SetBoardId { board_id: 77 },
        Command::StoreConfig,
        Command::GetHello,
        Command::DefaultConfig,
        Command::LoadConfig,
        Command::GetHello,
    ] {
        all.push((at, request(next(), command)));
        at += 700;
    }
    all.push((at, request(next(), Command::StoreConfig)));
    all.push((at + 100, request(next(), Command::StoreConfig)));
    at += 700;
    for spoilt in [20, 90] {
        all.push((at, Deed::Flip(spoilt)));
        all.push((at + 50, request(next(), Command::LoadConfig)));
        all.push((at + 150, request(next(), Command::GetHello)));
        at += 500;
    }
    at = correct(&mut all, at, &mut next);
    // Fast: 256 Hz at 250 kBd, with everything going on; slow: 1 Hz. Before it all gyros are set up as they should be: one that
    // is not is tried anew each second, and before or behind which sample that begins is a matter of the image's speed.
    all.push((at, request(next(), Command::DefaultConfig)));
    at += 500;
    all.push((at, request(next(), Command::SetBaud { divisor: 3 })));
    at += 100;
    all.push((
        at,
        request(
            next(),
            Command::SetRate {
                period_ticks: 976,
                periods_per_sample: 1,
            },
        ),
    ));
    at += 1_000;
    all.push((
        at,
        request(
            next(),
            Command::SetRate {
                period_ticks: 50_000,
                periods_per_sample: 5,
            },
        ),
    ));
    at += 3_500;
    all.push((
        at,
        request(
            next(),
            Command::SetRate {
                period_ticks: 12_500,
                periods_per_sample: 1,
            },
        ),
    ));
    at += 2_000;
    all.push((at, request(next(), Command::ClearCounters)));
    all.push((at + 100, request(next(), Command::Counters)));
    // Frames of each kind; then the start, which is heard. Apart by more than a report waits for its turn.
    all.push((at + 200, request(next(), Command::Counters)));
    all.push((at + 230, request(next(), Command::GetHello)));
    all.push((at + 260, Deed::LastTick));
    all.push((at + 260, request(next(), Command::Reboot)));
    at += 1_000;
    all.push((at, Deed::Send(Vec::new())));
    all
}
