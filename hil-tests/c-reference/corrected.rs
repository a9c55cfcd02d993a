//! Corrections that are written, spoilt, switched and at work.

use super::*;

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
pub(super) fn correct(all: &mut Vec<(u64, Deed)>, from: u64, next: &mut dyn FnMut() -> u16) -> u64 {
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
