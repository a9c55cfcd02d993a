// A session that any image of the board can be put through: sensors that answer by a script, a host that sends
// everything there is to send. Included by tests/c_reference.rs and examples/cost.rs.
//
// The sensors answer by how often they were asked, not by when, and the host counts from the image's first tick. So two
// images that do the same work at different speeds have to say the same.

use atmega16_sim::{CLOCK_HZ, Mcu, Port, Stop};
use wire::{Command, Shape, code, encode_request, kind};

#[path = "hearing.rs"]
mod hearing;
#[path = "script.rs"]
mod script;
use hearing::nonce;
pub use hearing::{busy_max, frames, jitter};
pub use script::Script;
use script::spread;

const MILLISECOND: u64 = CLOCK_HZ as u64 / 1_000;

/// What the host does, and when: ms after the first tick.
enum Deed {
    Send(Vec<u8>),
    SendWithoutStopBit(u8),
    /// The answer with the nonce that the board has told, under this number.
    Arm(u16),
    /// The stand comes to rest, or moves again.
    Quiet(bool),
    /// The motor's stop is pressed, or let go.
    Press(bool),
    /// From here on the ticks' phase means nothing: a reset comes.
    LastTick,
    /// A bit of the EEPROM's byte at an address flips.
    Flip(usize),
}

fn request(number: u16, command: Command) -> Deed {
    let mut line = [0; wire::MAX_FRAME];
    let len = encode_request(&wire::Request { number, command }, &mut line).expect("there is room");
    Deed::Send(line[..len].to_vec())
}

fn raw_request(number: u16, code: u8, arguments: [u8; 8]) -> Deed {
    let mut fields = number.to_le_bytes().to_vec();
    fields.push(code);
    fields.extend(arguments);
    let mut line = [0; wire::MAX_FRAME];
    let len = wire::fields::encode(kind::REQUEST, &fields, &mut line);
    Deed::Send(line[..len].to_vec())
}

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
fn deeds() -> Vec<(u64, Deed)> {
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

/// A correction of every kind of term, for gyros as they are set up at the start, in blocks of 16 samples.
fn correction(generation: i16, number: i16) -> wire::correction::Numbers {
    let mut all = [0; wire::correction::NUMBERS];
    for (place, value) in (0u64..).zip(&mut all) {
        *value = spread(0xC0DE ^ place) as i16 >> 4;
    }
    let format = i16::from(wire::correction::FORMAT) | generation << 8;
    all[..6].copy_from_slice(&[
        format,
        number,
        4,
        0x0402,
        i16::from_le_bytes([0xE0, 0x40]),
        7_000,
    ]);
    // Noise of a block of which the quiet stand's is a part, and a walk.
    let filter = wire::correction::NUMBERS - 9;
    for axis in 0..3 {
        all[filter + 3 * axis] = 20_000;
        all[filter + 1 + 3 * axis] = 300;
    }
    all
}

/// Power on and a correction in use, 4 s later; the cycle of the first tick.
///
/// # Errors
/// As of [`start`].
pub fn start_corrected(mcu: &mut Mcu, script: &mut Script) -> Result<u64, String> {
    let first = start(mcu, script)?;
    let numbers = correction(1, 77);
    let rows = numbers.chunks_exact(3).map(|row| [row[0], row[1], row[2]]);
    let rows = (0u8..).zip(rows.chain([wire::correction::crc_row(&numbers)]));
    for (row, values) in rows {
        let at = 20 + 200 * u64::from(row);
        run(mcu, script, first + at * MILLISECOND + OFF_THE_EDGE)?;
        if let Deed::Send(bytes) = request(row.into(), Command::SetCorrection { row, values }) {
            bytes.into_iter().for_each(|byte| mcu.send(byte));
        }
    }
    run(mcu, script, first + 4_000 * MILLISECOND)?;
    Ok(first)
}

/// The row of the CRC.
const LAST: u8 = wire::correction::ROWS as u8;

/// Writes corrections, spoils one, switches, and has them work at rest and with the motor.
fn correct(all: &mut Vec<(u64, Deed)>, from: u64, next: &mut dyn FnMut() -> u16) -> u64 {
    let mut at = from;
    let mut ask = |at: u64, command: Command| all.push((at, request(next(), command)));
    // As from the start, whatever was stored; none is there to be switched on, and no row is behind that of the CRC.
    ask(at, Command::DefaultConfig);
    ask(at + 500, Command::Correction { on: true });
    ask(
        at + 550,
        Command::GetCorrection {
            other: true,
            row: LAST + 1,
        },
    );
    at += 600;
    for (generation, number) in [(1, 77), (2, 78)] {
        // None is in use while one is written: whether a byte is on its way at the moment of a sample is a matter of speed.
        ask(at, Command::Correction { on: false });
        at += 50;
        let numbers = correction(generation, number);
        let rows = (0u8..).zip(numbers.chunks_exact(3));
        for (row, three) in rows {
            let values = [three[0], three[1], three[2]];
            ask(at, Command::SetCorrection { row, values });
            at += 150;
        }
        // The second one's CRC is wrong at first.
        let mut crc = wire::correction::crc_row(&numbers);
        if generation == 2 {
            let wrong = [crc[0] ^ 1, crc[1], 0];
            ask(
                at,
                Command::SetCorrection {
                    row: LAST,
                    values: wrong,
                },
            );
            ask(at + 20, Command::Correction { on: true });
            at += 250;
        }
        crc[2] = 0;
        // The first one works again meanwhile: off the tick, so that the answer and the frame of a sample do not race.
        ask(
            at + 38,
            Command::SetCorrection {
                row: LAST,
                values: crc,
            },
        );
        at += 500;
        for (other, row) in [(false, 0), (false, LAST - 1), (true, 5)] {
            ask(at, Command::GetCorrection { other, row });
            at += 50;
        }
    }
    // At rest for some blocks, so that the filter measures; then moving, then the motor, and gyros set up otherwise.
    all.push((at, Deed::Quiet(true)));
    at += 12_000;
    all.push((at, Deed::Quiet(false)));
    all.push((at + 1_000, request(next(), Command::Arm { nonce: 0 })));
    all.push((at + 1_050, Deed::Arm(next())));
    for keep in 1..20 {
        all.push((at + 1_050 + 100 * keep, request(next(), Command::KeepAlive)));
    }
    all.push((
        at + 1_180,
        request(next(), Command::MotorDuty { duty: -120 }),
    ));
    at += 3_500;
    let to = |range, filter| Command::SetGyro { range, filter };
    all.push((at, request(next(), to(4, 3))));
    all.push((at + 1_000, request(next(), to(4, 2))));
    all.push((
        at + 2_000,
        request(next(), Command::Correction { on: false }),
    ));
    all.push((
        at + 2_100,
        request(next(), Command::Correction { on: true }),
    ));
    all.push((
        at + 2_600,
        request(next(), Command::Correction { on: false }),
    ));
    at + 2_700
}

/// How many undamaged requests the session has.
pub fn requests() -> usize {
    deeds()
        .iter()
        .filter(|(_, deed)| match deed {
            Deed::Send(bytes) => bytes.len() == wire::Request::FRAME_LEN,
            Deed::Arm(_) => true,
            _ => false,
        })
        .count()
}

/// Runs until `until`, and says what is wrong where the image stops.
///
/// # Errors
/// An image that stops.
pub fn run(mcu: &mut Mcu, script: &mut Script, until: u64) -> Result<(), String> {
    match mcu.run_until(until, script) {
        Stop::Reached => Ok(()),
        stop => Err(format!(
            "stopped at {:#06x} after {} cycles: {stop:?}",
            mcu.program_counter(),
            mcu.cycle()
        )),
    }
}

/// Power on, until the first tick; its cycle.
///
/// # Errors
/// An image that stops, or does not tick within a second.
pub fn start(mcu: &mut Mcu, script: &mut Script) -> Result<u64, String> {
    for millisecond in 1..1_000 {
        run(mcu, script, millisecond * MILLISECOND)?;
        if let Some(first) = script.first_tick {
            return Ok(first);
        }
    }
    Err("no tick within a second".to_owned())
}

/// Requests by chance, one after each tick: commands that there are, with arguments that are small, extreme or anything,
/// and codes that no command has. Without a reboot, and at the rate and speed of the start: at others, what comes first
/// is a matter of the image's speed.
fn chance(seed: u64) -> Vec<(u64, Deed)> {
    const CODES: [u8; 24] = [
        code::ARM,
        code::ARM,
        code::ARM,
        code::PING,
        code::GET_HELLO,
        code::KEEP_ALIVE,
        code::COUNTERS,
        code::CLEAR_COUNTERS,
        code::SET_GYRO,
        code::SET_ACC_RANGE,
        code::BIAS_NULL,
        code::SET_BIAS,
        code::SET_SCALE,
        code::MOTOR_DUTY,
        code::MOTOR_PROFILE,
        code::MOTOR_LIMITS,
        code::READ_REGISTER,
        code::WRITE_REGISTER,
        code::SELF_TEST,
        code::STORE_CONFIG,
        code::LOAD_CONFIG,
        code::DEFAULT_CONFIG,
        code::SET_BOARD_ID,
        code::KEEP_ALIVE,
    ];
    let mut all = vec![(1, Deed::Quiet(seed.is_multiple_of(2)))];
    let mut asked_for_nonce = false;
    let mut let_go = None;
    // When the set-up was last stored; at the start nothing is.
    let mut stored = 0;
    for n in 0..CHANCE_REQUESTS {
        let bits = |salt: u64| spread(seed ^ spread(n << 8 | salt));
        // The motor's stop, for a millisecond or for some requests.
        if let_go == Some(n) {
            all.push((20 + 50 * n, Deed::Press(false)));
            let_go = None;
            continue;
        }
        if let_go.is_none() && bits(4) % 24 == 0 {
            all.push((20 + 50 * n, Deed::Press(true)));
            match bits(5) % 6 {
                0 => let_go = Some(n + 4),
                _ => all.push((21 + 50 * n, Deed::Press(false))),
            }
            continue;
        }
        let code = match bits(0) % 16 {
            0 => (bits(1) % 13 * 7) as u8,
            _ => CODES[(bits(1) % CODES.len() as u64) as usize],
        };
        if matches!(code, code::REBOOT | code::SET_RATE | code::SET_BAUD) {
            continue;
        }
        // Both write where the newest copy is not; what they make of chance is in the other session.
        if matches!(code, code::SET_CORRECTION..=code::GET_CORRECTION) {
            continue;
        }
        // The reference writes the set-up as it was when it was asked to, the image tells of one that was changed meanwhile.
        if n < stored + 20
            && matches!(
                code,
                code::SET_GYRO
                    | code::SET_ACC_RANGE
                    | code::BIAS_NULL
                    | code::SET_BIAS
                    | code::SET_SCALE
                    | code::MOTOR_LIMITS
                    | code::DEFAULT_CONFIG
                    | code::SET_BOARD_ID
            )
        {
            continue;
        }
        // The second's health frame comes at the same moment as this request: with a long answer beside it, a byte that
        // has left or not decides whether the reply fits.
        if n % 20 == 19
            && matches!(
                code,
                code::GET_HELLO | code::COUNTERS | code::CLEAR_COUNTERS
            )
        {
            continue;
        }
        // A copy takes 0.6 s to write: the last one is to be whole when the EEPROMs are compared.
        if code == code::STORE_CONFIG && n + 20 > CHANCE_REQUESTS {
            continue;
        }
        if code == code::STORE_CONFIG {
            stored = n;
        }
        // Asked for a nonce, the board is given it in the next slot, seven times of eight.
        if asked_for_nonce && bits(3) % 8 != 0 {
            all.push((20 + 50 * n, Deed::Arm(n as u16)));
            asked_for_nonce = false;
            continue;
        }
        if code == code::ARM {
            all.push((20 + 50 * n, raw_request(n as u16, code, [0; 8])));
            asked_for_nonce = true;
            continue;
        }
        // As many bytes as the command has, more often than not.
        let used = wire::Asked {
            number: 0,
            code,
            arguments: [1; 8],
        };
        let mut arguments = [0; 8];
        for (place, byte) in (0..).zip(&mut arguments) {
            let mut unused = used;
            unused.arguments = [0; 8];
            unused.arguments[place] = 1;
            if unused.refusal().is_some() && bits(2) % 8 != 0 {
                break;
            }
            let any = bits(10 + place as u64);
            *byte = match any % 4 {
                0 => (any >> 8) as u8 % 5,
                1 => 0,
                2 => 0xFF,
                _ => (any >> 8) as u8,
            };
        }
        all.push((20 + 50 * n, raw_request(n as u16, code, arguments)));
    }
    all.push((20 + 50 * CHANCE_REQUESTS + 40, Deed::LastTick));
    all
}

/// Requests in [`chance`], at most.
const CHANCE_REQUESTS: u64 = 400;

/// Puts an image through the session.
///
/// # Errors
/// An image that stops.
pub fn play(mcu: &mut Mcu) -> Result<Script, String> {
    act(mcu, deeds())
}

/// Puts an image through requests by chance.
///
/// # Errors
/// An image that stops.
pub fn play_by_chance(mcu: &mut Mcu, seed: u64) -> Result<Script, String> {
    act(mcu, chance(seed))
}

/// Requests end 25.3 ms after a tick, not when a millisecond ends.
const OFF_THE_EDGE: u64 = MILLISECOND * 2 / 5;

fn act(mcu: &mut Mcu, deeds: Vec<(u64, Deed)>) -> Result<Script, String> {
    let mut script = Script::default();
    let first = start(mcu, &mut script)?;
    for (ms, deed) in deeds {
        run(mcu, &mut script, first + ms * MILLISECOND + OFF_THE_EDGE)?;
        match deed {
            Deed::Send(bytes) => bytes.into_iter().for_each(|byte| mcu.send(byte)),
            Deed::Arm(number) => {
                let nonce = nonce(&script.line);
                if let Deed::Send(bytes) = request(number, Command::Arm { nonce }) {
                    bytes.into_iter().for_each(|byte| mcu.send(byte));
                }
            }
            Deed::LastTick => script.reset = true,
            Deed::SendWithoutStopBit(byte) => mcu.send_without_stop_bit(byte),
            Deed::Quiet(quiet) => script.quiet = quiet,
            // PD2.
            Deed::Press(true) => mcu.drive(Port::D, 1 << 2, 0),
            Deed::Press(false) => mcu.release(Port::D, 1 << 2),
            Deed::Flip(address) => {
                let mut bytes = mcu.eeprom().to_vec();
                bytes[address] ^= 1;
                mcu.set_eeprom(&bytes);
            }
        }
    }
    script.eeprom = mcu.eeprom().to_vec();
    Ok(script)
}
