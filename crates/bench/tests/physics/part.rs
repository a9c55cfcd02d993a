//! Registers of the simulated ADIS16250, word by word: what is written, what is kept, what a command does.

use bench::{Adis16250, Outputs, register as reg, status};

/// A part that has started.
const T: f64 = 1.0;

fn part() -> Adis16250 {
    let mut part = Adis16250::new();
    part.refresh(outputs(100), 0, T);
    part
}

fn outputs(gyro: i16) -> Outputs {
    Outputs {
        gyro,
        temp: -5,
        supply: 2730,
        aux: 7,
        angle: 0x1234,
    }
}

fn write(part: &mut Adis16250, address: u8, value: u16, t: f64) {
    let [low, high] = value.to_le_bytes();
    part.frame(0x8000 | u16::from(address) << 8 | u16::from(low), t);
    part.frame(0x8000 | u16::from(address | 1) << 8 | u16::from(high), t);
}

fn read(part: &mut Adis16250, address: u8, t: f64) -> u16 {
    part.frame(u16::from(address) << 8, t);
    part.frame(0, t)
}

fn command(part: &mut Adis16250, bits: u8, t: f64) {
    part.frame(0x8000 | u16::from(reg::COMMAND) << 8 | u16::from(bits), t);
}

#[test]
fn each_register_keeps_the_bits_it_has_and_read_only_ones_nothing() {
    let bits = [
        (reg::GYRO_OFF, 0x0fff),
        (reg::GYRO_SCALE, 0x0fff),
        (0x20, 0xffff),
        (0x22, 0xffff),
        (0x24, 0x00ff),
        (0x26, 0x00ff),
        (0x28, 0xffff),
        (reg::AUX_DAC, 0x0fff),
        (reg::GPIO_CTRL, 0x0303),
        (reg::MSC_CTRL, 0x0707),
        (reg::SMPL_PRD, 0x00ff),
        (reg::SENS_AVG, 0x0707),
    ];
    for (address, bits) in bits {
        let mut part = part();
        write(&mut part, address, 0xffff, T);
        assert_eq!(read(&mut part, address, T), bits, "{address:#04x}");
        write(&mut part, address, 0xa55a, T);
        assert_eq!(read(&mut part, address, T), 0xa55a & bits, "{address:#04x}");
        // The other registers are as they were.
        for (other, _) in bits_of_new() {
            if other != address {
                assert_eq!(part.get(other), Adis16250::new().get(other), "{other:#04x}");
            }
        }
    }
    let mut part = part();
    write(&mut part, reg::ENDURANCE, 0xffff, T);
    assert_eq!(read(&mut part, reg::ENDURANCE, T), 0);
}

fn bits_of_new() -> [(u8, u16); 3] {
    [
        (reg::GYRO_SCALE, 0x0800),
        (reg::SMPL_PRD, 1),
        (reg::SENS_AVG, 0x0402),
    ]
}

#[test]
fn outputs_have_their_widths_flags_and_marks() {
    let mut part = part();
    assert_eq!(read(&mut part, reg::GYRO_OUT, T), 0x8000 | 100);
    assert_eq!(read(&mut part, reg::GYRO_OUT, T), 100, "not new any more");
    // Temperature, supply and converter have twelve bits and a 1 above them.
    assert_eq!(read(&mut part, reg::TEMP_OUT, T), 0x9000 | 0x0ffb);
    assert_eq!(read(&mut part, reg::SUPPLY_OUT, T), 0x9000 | 2730);
    assert_eq!(read(&mut part, reg::AUX_ADC, T), 0x9000 | 7);
    assert_eq!(read(&mut part, reg::ANGL_OUT, T), 0x8000 | 0x1234);
    part.raise(status::SPI_FAILURE);
    assert_eq!(read(&mut part, reg::GYRO_OUT, T), 0x4000 | 100);
    part.refresh(outputs(-1), 0, T);
    assert_eq!(read(&mut part, reg::GYRO_OUT, T), 0xc000 | 0x3fff);
    assert_eq!(read(&mut part, reg::STATUS, T), status::SPI_FAILURE);
    assert_eq!(read(&mut part, reg::STATUS, T), 0, "reading clears it");
    assert_eq!(read(&mut part, reg::COMMAND, T), 0);
}

#[test]
fn sample_periods_and_ranges_are_those_of_the_data_sheet() {
    let mut part = part();
    for (value, period) in [
        (0x00, 1.0 / 512.0),
        (0x01, 1.0 / 256.0),
        (0x7f, 128.0 / 512.0),
        (0x80, 31.0 / 512.0),
        (0x81, 62.0 / 512.0),
        (0xff, 31.0 / 4.0),
    ] {
        part.keep(reg::SMPL_PRD, value);
        assert!(
            (part.sample_period_s() - period).abs() < 1e-12,
            "{value:#04x}"
        );
    }
    for (value, range, filter) in [
        (0x0402, 320.0, 2),
        (0x0206, 160.0, 6),
        (0x0107, 80.0, 6),
        (0x0000, 320.0, 0),
    ] {
        part.keep(reg::SENS_AVG, value);
        assert_eq!(
            (part.range_dps(), part.filter()),
            (range, filter),
            "{value:#06x}"
        );
        assert!((part.lsb_dps() - 0.073_26 * range / 320.0).abs() < 1e-12);
    }
}

#[test]
fn a_self_test_lasts_25_ms_and_clears_its_bit() {
    let mut part = part();
    write(&mut part, reg::MSC_CTRL, 1 << 10, T);
    part.refresh(outputs(0), 0, T + 0.024);
    assert_eq!(part.get(reg::MSC_CTRL), 1 << 10);
    part.refresh(outputs(0), 0, T + 0.026);
    assert_eq!(part.get(reg::MSC_CTRL), 0);
    // Without the bit nothing is cleared.
    write(&mut part, reg::MSC_CTRL, 0x0301, T);
    part.refresh(outputs(0), 0, T + 1.0);
    assert_eq!(part.get(reg::MSC_CTRL), 0x0301);
}

/// The bit is in the upper byte, which a driver may write alone; the lower byte starts no test and ends none.
#[test]
fn a_self_test_is_started_by_its_bit_and_by_no_other() {
    let byte = |part: &mut Adis16250, address: u8, value: u8, t: f64| {
        part.frame(0x8000 | u16::from(address) << 8 | u16::from(value), t);
    };
    let mut part = part();
    byte(&mut part, reg::MSC_CTRL + 1, 1 << 2, T);
    part.refresh(outputs(0), 0, T + 0.024);
    assert_eq!(part.get(reg::MSC_CTRL), 1 << 10);
    part.refresh(outputs(0), 0, T + 0.026);
    assert_eq!(part.get(reg::MSC_CTRL), 0, "it has ended");
    // Asleep for no time at all it is awake, and so it is after other registers.
    byte(&mut part, reg::SLP_CNT, 0, T + 1.0);
    byte(&mut part, reg::SENS_AVG, 4, T + 1.0);
    assert!(!part.is_busy(T + 1.0));
    byte(&mut part, reg::SLP_CNT, 1, T + 1.0);
    assert!(part.is_busy(T + 1.49) && !part.is_busy(T + 1.51));
    assert_eq!(part.get(reg::SLP_CNT), 0, "it counts down to nothing");
}

#[test]
fn asleep_it_answers_nothing_for_half_a_second_a_count() {
    let mut part = part();
    part.frame(0x8000 | u16::from(reg::SLP_CNT) << 8 | 3, T);
    assert!(part.is_busy(T + 1.49) && !part.is_busy(T + 1.51));
    assert_eq!(read(&mut part, reg::GYRO_SCALE, T + 1.4), 0);
    part.refresh(outputs(55), 0, T + 1.4);
    assert_eq!(part.outputs().gyro, 100, "no sample is taken");
    assert_eq!(read(&mut part, reg::GYRO_SCALE, T + 1.6), 0x0800);
}

#[test]
fn commands_null_restore_save_clear_and_reset() {
    // Precision null: the offset takes the rate off, in units of a fourth of a count.
    let mut nulled = part();
    command(&mut nulled, 1, T);
    assert_eq!(nulled.offset(), -400);
    assert!(nulled.is_busy(T + 0.049) && !nulled.is_busy(T + 0.051));
    assert_eq!(nulled.get(reg::ENDURANCE), 1);
    // On top of what there is.
    nulled.refresh(outputs(10), 0, T + 0.1);
    command(&mut nulled, 1, T + 0.1);
    assert_eq!(nulled.offset(), -440);
    // Factory calibration.
    write(&mut nulled, reg::GYRO_SCALE, 0x0700, T + 0.2);
    command(&mut nulled, 2, T + 0.2);
    assert_eq!((nulled.offset(), nulled.get(reg::GYRO_SCALE)), (0, 0x0800));
    assert_eq!(nulled.get(reg::ENDURANCE), 3);
    // A set-up that is saved outlives a reset, one that is not does not.
    let mut part = part();
    write(&mut part, reg::SENS_AVG, 0x0206, T);
    command(&mut part, 1 << 3, T);
    write(&mut part, reg::ALM_CTRL, 0x1234, T + 0.1);
    command(&mut part, 1 << 7, T + 0.1);
    assert!(part.is_busy(T + 0.264) && !part.is_busy(T + 0.266));
    assert_eq!(
        (part.get(reg::SENS_AVG), part.get(reg::ALM_CTRL)),
        (0x0206, 0)
    );
    // Status.
    part.raise(status::OVERRANGE);
    command(&mut part, 1 << 4, T + 1.0);
    assert_eq!(part.status(), 0);
    // The high byte of COMMAND does nothing.
    part.raise(status::OVERRANGE);
    part.frame(0x8000 | u16::from(reg::COMMAND | 1) << 8 | 1 << 4, T + 1.0);
    assert_eq!(part.status(), status::OVERRANGE);
    assert_eq!(part.get(reg::ENDURANCE), 1);
}

#[test]
fn a_frame_of_eight_bits_is_a_failure_once_the_part_has_started() {
    let mut part = Adis16250::new();
    part.select(true, 0.1);
    part.transfer(0, 0.1);
    part.select(false, 0.1);
    assert_eq!(part.status(), 0, "it is starting");
    part.select(true, T);
    assert!(part.is_selected());
    part.transfer(0, T);
    part.select(false, T);
    assert_eq!(part.status(), status::SPI_FAILURE);
    assert_eq!((part.is_selected(), part.transfer(0, T)), (false, None));
    // Words that neither read nor write are none.
    assert_eq!(part.frame(0x4400, T), 0);
    assert_eq!(part.frame(0, T), 0);
}
