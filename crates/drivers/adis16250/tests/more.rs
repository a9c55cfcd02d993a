//! Bus traffic of readings in a row, digital lines, alarms read back, and commands by address. Addresses and bits are
//! written out again here.

use adis16250::{
    Adis16250, Alarm, AlarmNumber, AlarmSource, Command, Error, Filter, GpioCtrl, Line, LineUse,
    Range, RateCounts, Register, Stimulus, Trigger, Word,
};
use embedded_hal_mock::eh1::delay::{CheckedDelay, Transaction as Pause};
use embedded_hal_mock::eh1::spi::{Mock as Spi, Transaction as Bus};

const PAUSE: u32 = 100;

/// Frames, each with what goes out and what comes back, and the pauses after them; `None` is a wait of 60 ms.
fn run<T>(
    script: &[Option<([u8; 2], u16)>],
    act: impl FnOnce(&mut Adis16250<Spi<u8>>, &mut CheckedDelay) -> T,
) -> T {
    let (mut frames, mut pauses) = (vec![], vec![]);
    for step in script {
        let Some((out, back)) = step else {
            pauses.push(Pause::delay_ms(60));
            continue;
        };
        frames.extend([
            Bus::transaction_start(),
            Bus::transfer_in_place(out.to_vec(), back.to_be_bytes().to_vec()),
            Bus::transaction_end(),
        ]);
        pauses.push(Pause::delay_us(PAUSE));
    }
    let (mut spi, mut delay) = (Spi::new(&frames), CheckedDelay::new(&pauses));
    let result = act(&mut Adis16250::new(spi.clone()), &mut delay);
    spi.done();
    delay.done();
    result
}

fn frame(first: u8, second: u8, back: u16) -> Option<([u8; 2], u16)> {
    Some(([first, second], back))
}

#[test]
fn several_registers_take_one_frame_more_than_there_are() {
    let script = [
        frame(0x04, 0, 0x1234),
        frame(0x0C, 0, 0x8001),
        frame(0x02, 0, 0x8002),
        frame(0x00, 0, 0x8AAA),
    ];
    let outputs = [Register::GyroOut, Register::TempOut, Register::SupplyOut];
    let words = run(&script, |gyro, delay| gyro.read_many(outputs, delay)).unwrap();
    assert_eq!(words, [Word(0x8001), Word(0x8002), Word(0x8AAA)]);
    run(&[], |gyro, delay| {
        assert_eq!(gyro.read_many([], delay), Ok([]));
        let refused = gyro.read_many([Register::GyroOut, Register::Command], delay);
        assert_eq!(refused, Err(Error::NoAccess(Register::Command)));
    });
}

#[test]
fn a_part_is_told_from_an_empty_bus() {
    let answers = |scale, range, period| {
        [
            frame(0x16, 0, 0xA5A5),
            frame(0x38, 0, scale),
            frame(0x36, 0, range),
            frame(0x00, 0, period),
        ]
    };
    let there = answers(0x0800, 0x0402, 0x0001);
    assert_eq!(run(&there, |gyro, delay| gyro.probe(delay)), Ok(()));
    for (script, register, bits) in [
        (answers(0, 0, 0), Register::GyroScale, 0),
        (answers(0xFFFF, 0xFFFF, 0xFFFF), Register::GyroScale, 0xFFFF),
        (answers(0x0800, 0x0802, 1), Register::SensAvg, 0x0802),
        (answers(0x0800, 0x0407, 1), Register::SensAvg, 0x0407),
        (answers(0x0800, 0x0402, 0x0101), Register::SmplPrd, 0x0101),
    ] {
        let error = run(&script, |gyro, delay| gyro.probe(delay));
        assert_eq!(error, Err(Error::UnknownContent { register, bits }));
    }
}

#[test]
fn the_stimulus_is_off_again_even_where_a_reading_is_stale() {
    let script = |with: u16| {
        [
            None,
            frame(0x04, 0, 0),
            frame(0x00, 0, 0x8003),
            frame(0xB5, 0x02, 0),
            None,
            frame(0x04, 0, 0),
            frame(0x00, 0, with),
            frame(0xB5, 0x00, 0),
        ]
    };
    let moved = |with| {
        run(&script(with), |gyro, delay| {
            gyro.stimulus_response(Stimulus::Negative, 60, delay)
        })
    };
    // -718 - 3.
    assert_eq!(moved(0x8000 | 0x3D32), Ok(RateCounts(-721)));
    let (least, most) = Stimulus::Negative.response(Range::Dps320);
    assert!((least..=most).contains(&RateCounts(-721)));
    assert_eq!(moved(0x3D32), Err(Error::StaleOutput(Word(0x3D32))));
    assert_eq!(
        Stimulus::Positive.response(Range::Dps80),
        (RateCounts(1_756), RateCounts(4_368))
    );
    assert_eq!(Filter::Taps64.delay_samples(), 63);
}

#[test]
fn levels_are_set_before_directions() {
    let script = [frame(0xB3, 0x02, 0), frame(0xB2, 0x03, 0)];
    run(&script, |gyro, delay| {
        gyro.set_lines(LineUse::Low, LineUse::High, delay)
    })
    .unwrap();
    let read = [frame(0x32, 0, 0), frame(0x00, 0, 0x0102)];
    let lines = run(&read, |gyro, delay| gyro.lines(delay)).unwrap();
    assert!(lines.is_high(Line::Dio0) && !lines.is_output(Line::Dio0));
    assert!(!lines.is_high(Line::Dio1) && lines.is_output(Line::Dio1));
    assert_eq!(GpioCtrl::new(LineUse::Input, LineUse::Input), GpioCtrl(0));
}

#[test]
fn an_alarm_reads_back_as_it_was_set() {
    let read = |number, control, magnitude, samples| {
        let (mag, smpl) = if number == AlarmNumber::One {
            (0x20, 0x24)
        } else {
            (0x22, 0x26)
        };
        let script = [
            frame(0x28, 0, 0),
            frame(mag, 0, control),
            frame(smpl, 0, magnitude),
            frame(0x00, 0, samples),
        ];
        run(&script, |gyro, delay| gyro.alarm(number, delay))
    };
    let jerk = Alarm {
        source: AlarmSource::Rate,
        trigger: Trigger::Change { samples: 9 },
        above: false,
        threshold: -100,
    };
    let supply = Alarm {
        source: AlarmSource::Supply,
        trigger: Trigger::Level,
        above: true,
        threshold: 2_866,
    };
    let control = 0xA116;
    assert_eq!(
        read(
            AlarmNumber::Two,
            control,
            jerk.magnitude_bits(),
            jerk.samples_bits()
        ),
        Ok(Some(jerk))
    );
    assert_eq!(
        read(AlarmNumber::One, control, supply.magnitude_bits(), 0),
        Ok(Some(supply))
    );
    assert_eq!(read(AlarmNumber::One, 0xA016, 1, 1), Ok(None));
    assert_eq!(
        read(AlarmNumber::One, 0x0316, 1, 1),
        Err(Error::UnknownContent {
            register: Register::AlmCtrl,
            bits: 0x0316
        })
    );
}

#[test]
fn the_scale_reads_without_the_bits_above_it() {
    let script = [frame(0x16, 0, 0), frame(0x00, 0, 0xF7FF)];
    assert_eq!(run(&script, |gyro, delay| gyro.scale(delay)), Ok(0x07FF));
}

/// From outside an address may be anything.
#[test]
fn an_address_from_outside_becomes_a_command_only_where_the_map_has_it() {
    let readable = [
        0x00, 0x02, 0x04, 0x0A, 0x0C, 0x0E, 0x14, 0x16, 0x20, 0x22, 0x24, 0x26, 0x28, 0x30, 0x32,
        0x34, 0x36, 0x38, 0x3A, 0x3C,
    ];
    let writable = [
        0x14, 0x16, 0x20, 0x22, 0x24, 0x26, 0x28, 0x30, 0x32, 0x34, 0x36, 0x38, 0x3A, 0x3E,
    ];
    for address in 0..=u8::MAX {
        let even = address & !1;
        let read = readable.contains(&even).then_some([even, 0]);
        let write = writable.contains(&even).then_some([0x80 | address, 0x5A]);
        assert_eq!(
            Command::read_at(address).map(Command::bytes),
            read,
            "{address:#04x}"
        );
        let written = Command::write_at(address, 0x5A);
        assert_eq!(written.map(Command::bytes), write, "{address:#04x}");
    }
}
