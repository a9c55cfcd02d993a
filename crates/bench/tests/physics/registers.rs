//! What the part says over SPI: registers, flags and ranges.

use bench::{Scenario, Stand, register, status};

use crate::{LSB, read, signed, silent, write};

#[test]
fn the_reply_comes_one_frame_after_its_command() {
    let stand = &mut Stand::new(&silent(5));
    let t = 1.0;
    stand.spi_frame(0, u16::from(register::GYRO_SCALE) << 8, t, t);
    assert_eq!(
        stand.spi_frame(0, u16::from(register::SMPL_PRD) << 8, t, t),
        0x0800
    );
    assert_eq!(
        stand.spi_frame(0, u16::from(register::SENS_AVG + 1) << 8, t, t),
        0x0001
    );
    assert_eq!(stand.spi_frame(0, 0, t, t), 0x0402);
    // Written a byte at a time; GYRO_OUT is read-only.
    write(stand, 0, register::GYRO_OFF, 0x34, t);
    assert_eq!(read(stand, 0, register::GYRO_OFF, t), 0x0034);
    write(stand, 0, register::GYRO_OFF + 1, 0xf2, t);
    assert_eq!(read(stand, 0, register::GYRO_OFF, t), 0x0234);
    write(stand, 0, register::GYRO_SCALE, 0, t);
    write(stand, 0, register::COMMAND, 1 << 1, t);
    assert_eq!(read(stand, 0, register::GYRO_SCALE, t + 0.06), 0x0800);
    assert_eq!(read(stand, 0, register::ENDURANCE, t + 0.06), 1);
}

#[test]
fn new_data_is_set_by_a_sample_and_cleared_by_a_read() {
    let stand = &mut Stand::new(&silent(6));
    for k in 0..200 {
        let t = 1.0 + k as f64 * 0.0101;
        let word = read(stand, 2, register::GYRO_OUT, t);
        assert_ne!(word & 0x8000, 0, "a sample every 3.9 ms");
        assert_eq!(
            read(stand, 2, register::GYRO_OUT, t) & 0xbfff,
            word & 0x3fff
        );
        assert_ne!(
            read(stand, 2, register::TEMP_OUT, t) & 0x8000,
            0,
            "each register has its own bit"
        );
    }
}

#[test]
fn a_frame_that_is_not_16_clocks_long_raises_an_alarm() {
    let stand = &mut Stand::new(&silent(7));
    stand.select(1, true, 1.0);
    stand.spi_byte(0x04, 1.0);
    stand.select(1, false, 1.0);
    assert_eq!(stand.gyro(1).status(), status::SPI_FAILURE);
    assert_ne!(read(stand, 1, register::GYRO_OUT, 1.1) & 0x4000, 0, "EA");
    assert_eq!(read(stand, 1, register::STATUS, 1.1), status::SPI_FAILURE);
    assert_eq!(
        read(stand, 1, register::GYRO_OUT, 1.2) & 0x4000,
        0,
        "reading STATUS clears it"
    );
    assert_eq!(stand.gyro(0).status(), 0, "the others saw no clock");
}

#[test]
fn a_part_in_reset_answers_zeros_and_comes_back_as_flash_has_it() {
    let stand = &mut Stand::new(&silent(8));
    assert_eq!(read(stand, 0, register::SMPL_PRD, 0.1), 0, "start-up");
    write(stand, 0, register::SENS_AVG, 0x06, 1.0);
    assert_eq!(read(stand, 0, register::SENS_AVG, 1.0), 0x0406);
    write(stand, 0, register::COMMAND, 1 << 7, 1.0);
    assert_eq!(read(stand, 0, register::SENS_AVG, 1.1), 0);
    assert_eq!(read(stand, 0, register::SENS_AVG, 1.3), 0x0402);
}

#[test]
fn ranges_self_test_and_autonull_act_on_the_output() {
    let mut scenario = silent(9);
    scenario.gyros[0].turn_on_bias_dps = 3.0;
    let stand = &mut Stand::new(&scenario);
    assert_eq!(
        signed(read(stand, 0, register::GYRO_OUT, 1.0)),
        (3.0 / LSB).round()
    );
    write(stand, 0, register::SENS_AVG + 1, 0x01, 1.0);
    assert_eq!(
        signed(read(stand, 0, register::GYRO_OUT, 1.1)),
        (3.0 / LSB * 4.0).round()
    );
    write(stand, 0, register::SENS_AVG + 1, 0x04, 1.1);
    write(stand, 0, register::MSC_CTRL + 1, 0x01, 1.1);
    assert_eq!(
        signed(read(stand, 0, register::GYRO_OUT, 1.3)),
        (3.0 / LSB + 721.0).round()
    );
    write(stand, 0, register::MSC_CTRL + 1, 0x00, 1.3);
    write(stand, 0, register::MSC_CTRL + 1, 0x04, 1.3);
    assert_eq!(
        read(stand, 0, register::MSC_CTRL, 1.4),
        0,
        "the internal test clears its bit"
    );
    write(stand, 0, register::COMMAND, 1, 1.5);
    assert!(signed(read(stand, 0, register::GYRO_OUT, 1.7)).abs() <= 1.0);
}

#[test]
fn temperature_and_supply_registers_follow_the_world() {
    let mut scenario = silent(10);
    scenario.gyros[0].temp_offset_c = 0.0;
    let stand = &mut Stand::new(&scenario);
    let word = read(stand, 0, register::TEMP_OUT, 300.0);
    let temp = f64::from(((word << 4) as i16) >> 4) * 0.1453 + 25.0;
    assert!((temp - stand.thermal().die_c()[0]).abs() < 0.4, "{temp}");
    let supply = f64::from(read(stand, 0, register::SUPPLY_OUT, 300.0) & 0xfff) * 1.8315e-3;
    assert!((supply - stand.supply().volts()).abs() < 6e-3, "{supply}");
}

#[test]
fn answers_depend_on_the_time_and_not_on_how_often_one_asks() {
    let scenario = Scenario::lively(14);
    let (mut often, mut seldom) = (Stand::new(&scenario), Stand::new(&scenario));
    for k in 0..2000 {
        let t = 1.0 + f64::from(k) * 0.0017;
        often.advance(t - 0.0008);
        often.acc_volts(1, t - 0.0004);
        if k % 30 == 0 {
            assert_eq!(
                read(&mut often, 0, register::GYRO_OUT, t) & 0x3fff,
                read(&mut seldom, 0, register::GYRO_OUT, t) & 0x3fff
            );
            assert_eq!(often.acc_counts(2, t), seldom.acc_counts(2, t));
        }
    }
}
