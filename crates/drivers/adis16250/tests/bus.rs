//! The exact traffic on the bus. Register addresses and bits are written out again here, from the register map, so that
//! a slip in the driver's tables shows.

use adis16250::{
    Access, Adis16250, Alarm, AlarmNumber, AlarmOutput, AlarmSource, AuxCounts, Command, DataReady,
    Error, Filter, Line, OffsetCounts, Pace, Polarity, Range, Register, SamplePeriod, SensAvg,
    Status, Stimulus, Trigger,
};
use embedded_hal_mock::eh1::delay::{CheckedDelay, Transaction as Pause};
use embedded_hal_mock::eh1::spi::{Mock as Spi, Transaction as Bus};

/// What the sampling period after a fresh start is unknown for: the slow pause.
const SLOW: u32 = 100;
const FAST: u32 = 40;

/// One frame in its own chip select: what goes out, what comes in.
fn frame(out: [u8; 2], back: u16) -> [Bus<u8>; 3] {
    [
        Bus::transaction_start(),
        Bus::transfer_in_place(out.to_vec(), back.to_be_bytes().to_vec()),
        Bus::transaction_end(),
    ]
}

struct Script {
    frames: Vec<Bus<u8>>,
    pauses: Vec<Pause>,
    pause_us: u32,
}

impl Script {
    fn new() -> Self {
        Script {
            frames: vec![],
            pauses: vec![],
            pause_us: SLOW,
        }
    }

    fn at_pace(mut self, pause_us: u32) -> Self {
        self.pause_us = pause_us;
        self
    }

    fn write(mut self, address: u8, value: u8) -> Self {
        self.frames.extend(frame([0x80 | address, value], 0xA5A5));
        self.pauses.push(Pause::delay_us(self.pause_us));
        self
    }

    fn write_both(self, address: u8, value: u16) -> Self {
        self.write(address, value as u8)
            .write(address + 1, (value >> 8) as u8)
    }

    /// A read and its reply, one frame later.
    fn read(mut self, address: u8, reply: u16) -> Self {
        self.frames.extend(frame([address, 0x00], 0x5A5A));
        self.frames.extend(frame([0x00, 0x00], reply));
        self.pauses.extend([
            Pause::delay_us(self.pause_us),
            Pause::delay_us(self.pause_us),
        ]);
        self
    }

    fn wait_ms(mut self, ms: u32) -> Self {
        self.pauses.push(Pause::delay_ms(ms));
        self
    }

    fn run<T>(self, act: impl FnOnce(&mut Adis16250<Spi<u8>>, &mut CheckedDelay) -> T) -> T {
        let mut spi = Spi::new(&self.frames);
        let mut delay = CheckedDelay::new(&self.pauses);
        let mut gyro = Adis16250::new(spi.clone());
        let result = act(&mut gyro, &mut delay);
        spi.done();
        delay.done();
        result
    }
}

#[test]
fn every_register_is_where_the_map_has_it() {
    use Access::{Read, ReadWrite, Write};
    let map = [
        (Register::Endurance, 0x00, Read, None),
        (Register::SupplyOut, 0x02, Read, None),
        (Register::GyroOut, 0x04, Read, None),
        (Register::AuxAdc, 0x0A, Read, None),
        (Register::TempOut, 0x0C, Read, None),
        (Register::AnglOut, 0x0E, Read, None),
        (Register::GyroOff, 0x14, ReadWrite, Some(0)),
        (Register::GyroScale, 0x16, ReadWrite, Some(0x0800)),
        (Register::AlmMag1, 0x20, ReadWrite, Some(0)),
        (Register::AlmMag2, 0x22, ReadWrite, Some(0)),
        (Register::AlmSmpl1, 0x24, ReadWrite, Some(0)),
        (Register::AlmSmpl2, 0x26, ReadWrite, Some(0)),
        (Register::AlmCtrl, 0x28, ReadWrite, Some(0)),
        (Register::AuxDac, 0x30, ReadWrite, Some(0)),
        (Register::GpioCtrl, 0x32, ReadWrite, Some(0)),
        (Register::MscCtrl, 0x34, ReadWrite, Some(0)),
        (Register::SmplPrd, 0x36, ReadWrite, Some(0x0001)),
        (Register::SensAvg, 0x38, ReadWrite, Some(0x0402)),
        (Register::SlpCnt, 0x3A, ReadWrite, Some(0)),
        (Register::Status, 0x3C, Read, Some(0)),
        (Register::Command, 0x3E, Write, None),
    ];
    assert_eq!(map.map(|row| row.0), Register::all());
    for (register, address, access, default) in map {
        assert_eq!(register.address(), address, "{register:?}");
        assert_eq!(register.access(), access, "{register:?}");
        assert_eq!(register.default_value(), default, "{register:?}");
        assert_eq!(Register::from_address(address), Some(register));
        assert_eq!(
            Register::from_address(address + 1),
            Some(register),
            "the high byte's address"
        );
        assert_eq!(Command::read(register).bits(), u16::from(address) << 8);
    }
    for reserved in [
        0x06, 0x07, 0x08, 0x09, 0x10, 0x12, 0x18, 0x1E, 0x2A, 0x2E, 0x40, 0x80,
    ] {
        assert_eq!(Register::from_address(reserved), None, "{reserved:#x}");
    }
}

#[test]
fn a_read_takes_two_frames_and_the_second_brings_the_reply() {
    let word = Script::new()
        .read(0x04, 0x9110)
        .run(|gyro, delay| gyro.read(Register::GyroOut, delay))
        .unwrap();
    assert!(word.is_new() && !word.has_error());
    assert_eq!(word.rate().0, 4368);
    let word = Script::new()
        .read(0x0C, 0x4F54)
        .run(|gyro, delay| gyro.read(Register::TempOut, delay))
        .unwrap();
    assert!(!word.is_new() && word.has_error());
    assert_eq!(word.temperature().0, -172, "0 degC");
}

#[test]
fn a_pipelined_loop_sends_nothing_but_its_frames() {
    let frames: Vec<_> = [
        frame([0x04, 0], 0),
        frame([0x0C, 0], 0x8001),
        frame([0x02, 0], 0x8002),
        frame([0x04, 0], 0x8AAA),
    ]
    .concat();
    let mut spi = Spi::new(&frames);
    let mut word = |register| adis16250::exchange(&mut spi, Command::read(register)).unwrap();
    word(Register::GyroOut);
    let (rate, temp, supply) = (
        word(Register::TempOut),
        word(Register::SupplyOut),
        word(Register::GyroOut),
    );
    assert_eq!(
        (rate.rate().0, temp.temperature().0, supply.supply().0),
        (1, 2, 0x0AAA)
    );
    spi.done();
}

#[test]
fn a_register_is_written_low_byte_first() {
    Script::new()
        .write_both(0x14, 0x0ABC)
        .run(|gyro, delay| gyro.write(Register::GyroOff, 0x0ABC, delay))
        .unwrap();
}

#[test]
fn what_cannot_be_done_is_refused_before_anything_is_sent() {
    Script::new().run(|gyro, delay| {
        assert_eq!(
            gyro.read(Register::Command, delay),
            Err(Error::NoAccess(Register::Command))
        );
        for register in [Register::Endurance, Register::GyroOut, Register::Status] {
            assert_eq!(
                gyro.write(register, 0, delay),
                Err(Error::NoAccess(register))
            );
        }
    });
}

#[test]
fn a_range_comes_with_the_filter_it_needs_and_is_read_back() {
    for (range, filter, bits) in [
        (Range::Dps320, Filter::Taps1, 0x0400),
        (Range::Dps320, Filter::Taps64, 0x0406),
        (Range::Dps160, Filter::Taps1, 0x0202),
        (Range::Dps160, Filter::Taps8, 0x0203),
        (Range::Dps80, Filter::Taps4, 0x0104),
        (Range::Dps80, Filter::Taps32, 0x0105),
    ] {
        let setting = SensAvg::new(range, filter);
        assert_eq!(setting.bits(), bits);
        Script::new()
            .write_both(0x38, bits)
            .read(0x38, bits)
            .run(|gyro, delay| gyro.set_range(setting, delay))
            .unwrap();
        let found = Script::new()
            .read(0x38, bits)
            .run(|gyro, delay| gyro.range(delay))
            .unwrap();
        assert_eq!(found, setting);
    }
    for invalid in [0x0000, 0x0302, 0x0407, 0x0201, 0x0103, 0xFFFF] {
        assert_eq!(SensAvg::from_bits(invalid), None, "{invalid:#06x}");
    }
}

#[test]
fn a_setting_that_does_not_read_back_is_an_error_that_says_what_it_reads() {
    let setting = SensAvg::new(Range::Dps80, Filter::Taps16);
    let error = Script::new()
        .write_both(0x38, 0x0104)
        .read(0x38, 0x0402)
        .run(|gyro, delay| gyro.set_range(setting, delay))
        .unwrap_err();
    assert_eq!(
        error,
        Error::ReadBack {
            register: Register::SensAvg,
            wrote: 0x0104,
            read: 0x0402
        }
    );
    assert_eq!(
        error.to_string(),
        "SensAvg reads 0x0402 after 0x0104 was written"
    );
}

#[test]
fn the_sample_period_sets_the_pace() {
    Script::new()
        .write(0x36, 0x01)
        .read(0x36, 0x0001)
        .at_pace(FAST)
        .read(0x3C, 0x0000)
        .run(|gyro, delay| {
            gyro.set_sample_period(SamplePeriod::SPS_256, delay)?;
            assert_eq!(gyro.pace(), Pace::Fast);
            gyro.status(delay)
        })
        .unwrap();
    for (bits, micros, pace) in [
        (0x01, 3_906, Pace::Fast),
        (0x07, 15_625, Pace::Fast),
        (0x08, 17_578, Pace::Normal),
        (0x7F, 250_000, Pace::Normal),
        (0x80, 60_546, Pace::Normal),
        (0xFF, 7_750_000, Pace::Normal),
    ] {
        let period = SamplePeriod::from_bits(bits).unwrap();
        assert_eq!(
            (period.micros(), period.pace()),
            (micros, pace),
            "{bits:#04x}"
        );
    }
    assert_eq!(SamplePeriod::from_bits(0), None);
}

#[test]
fn the_self_test_starts_waits_and_asks() {
    let passed = || Script::new().read(0x3C, 0).write(0x35, 0x04).wait_ms(35);
    passed()
        .read(0x34, 0x0006)
        .read(0x3C, 0)
        .run(|gyro, delay| gyro.self_test(delay))
        .unwrap();

    let failed = passed()
        .read(0x34, 0x0006)
        .read(0x3C, 0x0020)
        .run(|gyro, delay| gyro.self_test(delay));
    assert_eq!(failed, Err(Error::SelfTest(Status(0x0020))));

    let endless = passed()
        .read(0x34, 0x0406)
        .run(|gyro, delay| gyro.self_test(delay));
    assert_eq!(
        endless,
        Err(Error::ReadBack {
            register: Register::MscCtrl,
            wrote: 0x0006,
            read: 0x0406
        })
    );
}

#[test]
fn commands_set_one_bit_and_wait() {
    Script::new()
        .write(0x3E, 0x01)
        .wait_ms(100)
        .run(|gyro, delay| gyro.autonull(delay))
        .unwrap();
    Script::new()
        .write(0x3E, 0x02)
        .wait_ms(50)
        .read(0x16, 0x0800)
        .run(|gyro, delay| gyro.restore_factory_calibration(delay))
        .unwrap();
    Script::new()
        .write(0x3E, 0x08)
        .wait_ms(100)
        .read(0x3C, 0)
        .run(|gyro, delay| gyro.save(delay))
        .unwrap();
    let failed = Script::new()
        .write(0x3E, 0x08)
        .wait_ms(100)
        .read(0x3C, 0x0004)
        .run(|gyro, delay| gyro.save(delay));
    assert_eq!(failed, Err(Error::Flash(Status(0x0004))));
    Script::new()
        .write(0x3E, 0x10)
        .run(|gyro, delay| gyro.clear_status(delay))
        .unwrap();
    let period = Script::new()
        .write(0x3E, 0x80)
        .wait_ms(220)
        .read(0x36, 0x0007)
        .run(|gyro, delay| gyro.reset(delay));
    assert_eq!(period, Ok(SamplePeriod::SPS_64));
}

#[test]
fn the_aux_output_is_written_then_latched() {
    Script::new()
        .write_both(0x30, 0x0FFF)
        .write(0x3E, 0x04)
        .run(|gyro, delay| gyro.set_aux_dac(AuxCounts(5000), delay))
        .unwrap();
}

#[test]
fn offset_and_scale_have_twelve_bits() {
    Script::new()
        .write_both(0x14, 0x0FFE)
        .read(0x14, 0x0FFE)
        .read(0x14, 0x0FFE)
        .write_both(0x14, 0x0800)
        .read(0x14, 0x0800)
        .write_both(0x16, 0x0FFF)
        .read(0x16, 0x0FFF)
        .run(|gyro, delay| {
            gyro.set_offset(OffsetCounts(-2), delay)?;
            assert_eq!(gyro.offset(delay)?, OffsetCounts(-2));
            gyro.set_offset(OffsetCounts(i16::MIN), delay)?;
            gyro.set_scale(u16::MAX, delay)
        })
        .unwrap();
    assert_eq!(OffsetCounts(2047).micro_dps(), 37_490_805, "37.5 deg/s");
}

#[test]
fn an_alarm_leaves_the_other_one_alone() {
    let hot = Alarm {
        source: AlarmSource::Temperature,
        trigger: Trigger::Level,
        above: true,
        threshold: 413,
    };
    Script::new()
        .read(0x28, 0xA016)
        .write_both(0x20, 0x8000 | 413)
        .read(0x20, 0x8000 | 413)
        .write_both(0x24, 0)
        .read(0x24, 0)
        .write_both(0x28, 0xA616)
        .read(0x28, 0xA616)
        .run(|gyro, delay| gyro.set_alarm(AlarmNumber::One, Some(&hot), delay))
        .unwrap();

    let jerk = Alarm {
        source: AlarmSource::Rate,
        trigger: Trigger::Change { samples: 9 },
        above: false,
        threshold: -100,
    };
    Script::new()
        .read(0x28, 0x0616)
        .write_both(0x22, 0x3F9C)
        .read(0x22, 0x3F9C)
        .write_both(0x26, 9)
        .read(0x26, 9)
        .write_both(0x28, 0xA616)
        .read(0x28, 0xA616)
        .run(|gyro, delay| gyro.set_alarm(AlarmNumber::Two, Some(&jerk), delay))
        .unwrap();

    Script::new()
        .read(0x28, 0xA616)
        .write_both(0x28, 0x0616)
        .read(0x28, 0x0616)
        .run(|gyro, delay| gyro.set_alarm(AlarmNumber::Two, None, delay))
        .unwrap();
    let output = AlarmOutput {
        filtered: true,
        line: Some((Line::Dio1, Polarity::ActiveHigh)),
    };
    Script::new()
        .write(0x28, 0x17)
        .run(|gyro, delay| gyro.set_alarm_output(output, delay))
        .unwrap();
}

#[test]
fn data_ready_and_stimulus_have_a_byte_each() {
    let ready = DataReady {
        line: Line::Dio0,
        polarity: Polarity::ActiveHigh,
    };
    Script::new()
        .write(0x34, 0x06)
        .write(0x34, 0x00)
        .write(0x35, 0x01)
        .write(0x35, 0x02)
        .write(0x35, 0x00)
        .write(0x3A, 0x06)
        .read(0x00, 0xC123)
        .run(|gyro, delay| {
            gyro.set_data_ready(Some(ready), delay)?;
            gyro.set_data_ready(None, delay)?;
            gyro.hold_stimulus(Stimulus::Positive, delay)?;
            gyro.hold_stimulus(Stimulus::Negative, delay)?;
            gyro.hold_stimulus(Stimulus::None, delay)?;
            gyro.sleep(6, delay)?;
            assert_eq!(gyro.endurance(delay)?, 0xC123, "all 16 bits are data");
            Ok::<_, Error<_>>(())
        })
        .unwrap();
}
