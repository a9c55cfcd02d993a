//! The stand against closed forms: what it does to the data is what its parameters say.

use bench::scenario::{GyroPart, MotorPart, StallFlags, SupplyPart, ThermalPart};
use bench::{Fault, Motor, Scenario, Stand, Supply, Thermal, bartlett, register, status};

const LSB: f64 = 0.073_26;
const RATE_HZ: f64 = 20.0;

/// Two frames: the command, and one that fetches its reply.
fn read(stand: &mut Stand, axis: usize, address: u8, t: f64) -> u16 {
    stand.spi_frame(axis, u16::from(address) << 8, t, t);
    stand.spi_frame(axis, 0, t, t)
}

fn write(stand: &mut Stand, axis: usize, address: u8, value: u8, t: f64) {
    stand.spi_frame(
        axis,
        0x8000 | u16::from(address) << 8 | u16::from(value),
        t,
        t,
    );
}

fn signed(word: u16) -> f64 {
    f64::from(((word << 2) as i16) >> 2)
}

/// GYRO_OUT of an axis at 20 Hz, deg/s, one second after power-on.
fn rates(stand: &mut Stand, axis: usize, n: usize) -> Vec<f64> {
    (0..n)
        .map(|k| {
            signed(read(
                stand,
                axis,
                register::GYRO_OUT,
                1.0 + k as f64 / RATE_HZ,
            )) * LSB
        })
        .collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn variance(values: &[f64]) -> f64 {
    let m = mean(values);
    values.iter().map(|v| (v - m).powi(2)).sum::<f64>() / (values.len() - 1) as f64
}

/// White noise only.
fn white(seed: u64) -> Scenario {
    let mut scenario = Scenario::quiet(seed);
    for gyro in &mut scenario.gyros {
        gyro.rate_random_walk = 0.0;
        gyro.scale_error = 0.0;
        gyro.turn_on_bias_dps = 0.0;
    }
    scenario
}

/// No noise either.
fn silent(seed: u64) -> Scenario {
    let mut scenario = white(seed);
    for gyro in &mut scenario.gyros {
        gyro.angle_random_walk_deg_sqrt_h = 0.0;
    }
    scenario
}

#[test]
fn the_stated_angle_random_walk_is_what_a_20_hz_reader_gets() {
    // sigma = ARW/60 sqrt(20), with 1/12 LSB^2 of quantisation. Chi-square with 12000 - 1 degrees of freedom: standard
    // deviation of the ratio sqrt(2/n) = 0.0129; 5 of them: 6e-7 false alarms for each axis.
    let n = 12_000;
    let expected = (5.27 / 60.0_f64).powi(2) * RATE_HZ + LSB * LSB / 12.0;
    for axis in 0..3 {
        let values = rates(&mut Stand::new(&white(1)), axis, n);
        let ratio = variance(&values) / expected;
        assert!(
            (ratio - 1.0).abs() < 5.0 * (2.0 / n as f64).sqrt(),
            "axis {axis}: {ratio}"
        );
        // White at 20 Hz: 27 ms of filter and a 3-ms pole have gone by after 50 ms.
        let m = mean(&values);
        let lag1 = values
            .windows(2)
            .map(|w| (w[0] - m) * (w[1] - m))
            .sum::<f64>()
            / (n as f64 * expected);
        assert!(
            lag1.abs() < 5.0 / (n as f64).sqrt(),
            "axis {axis}: lag 1 {lag1}"
        );
    }
}

#[test]
fn the_bias_walks_by_k_sqrt_t() {
    let (k, seconds, runs) = (0.05, 100.0, 200);
    let mut sum = 0.0;
    for seed in 0..runs {
        let mut scenario = silent(seed);
        scenario.gyros[0].rate_random_walk = k;
        let stand = &mut Stand::new(&scenario);
        let first = signed(read(stand, 0, register::GYRO_OUT, 1.0)) * LSB;
        let last = signed(read(stand, 0, register::GYRO_OUT, 1.0 + seconds)) * LSB;
        sum += (last - first).powi(2);
    }
    let ratio = sum / runs as f64 / (k * k * seconds + LSB * LSB / 6.0);
    assert!(
        (ratio - 1.0).abs() < 5.0 * (2.0 / runs as f64).sqrt(),
        "{ratio}"
    );
}

#[test]
fn the_bartlett_window_is_two_boxcars() {
    for m in 0..=6 {
        let n = 1usize << m;
        let mut direct = vec![0.0; 2 * n - 1];
        for i in 0..n {
            for j in 0..n {
                direct[i + j] += 1.0 / (n * n) as f64;
            }
        }
        let window = bartlett(m);
        assert_eq!(window.len(), direct.len());
        assert!(
            window
                .iter()
                .zip(&direct)
                .all(|(a, b)| (a - b).abs() < 1e-15),
            "m = {m}"
        );
    }
}

#[test]
fn a_vibration_passes_pole_and_filter_and_folds() {
    // 47 Hz, 20 deg/s: pole 1/sqrt(1 + (47/50)^2), Bartlett (sin(N w/2)/(N sin(w/2)))^2 at w = 2 pi 47/256.
    let (frequency, amplitude) = (47.0, 20.0);
    let mut scenario = silent(3).with(Fault::Vibration {
        axis: 1,
        frequency_hz: frequency,
        amplitude_dps: amplitude,
        linear_g: 0.0,
    });
    scenario.gyros[1].clock_ppm = 0.0;
    scenario.gyros[1].pole_hz = 50.0;
    let values = rates(&mut Stand::new(&scenario), 1, 4000);
    let w = std::f64::consts::TAU * frequency / 256.0;
    let boxcar = (4.0 * w / 2.0).sin() / (4.0 * (w / 2.0).sin());
    let expected = amplitude * boxcar * boxcar / (1.0 + (frequency / 50.0f64).powi(2)).sqrt();
    let measured = (2.0 * variance(&values)).sqrt();
    assert!(
        (measured / expected - 1.0).abs() < 0.01,
        "{measured} deg/s, expected {expected}"
    );
}

#[test]
fn a_slow_filter_correlates_neighbours() {
    // 4 Hz: exp(-2 pi 4/20) = 0.285 behind the pole; the 27-ms Bartlett window raises it somewhat.
    let scenario = white(4).with(Fault::SlowFilter {
        gyro: 0,
        pole_hz: 4.0,
    });
    let values = rates(&mut Stand::new(&scenario), 0, 12_000);
    let (m, v) = (mean(&values), variance(&values));
    let lag1 = values
        .windows(2)
        .map(|w| (w[0] - m) * (w[1] - m))
        .sum::<f64>()
        / (values.len() as f64 * v);
    assert!((0.25..0.36).contains(&lag1), "{lag1}");
}

#[test]
fn a_die_warms_with_its_time_constants() {
    let part = ThermalPart {
        drift_c_h: 0.0,
        swing_c: 0.0,
        powered_before_s: 0.0,
        ..ThermalPart::default()
    };
    let mut thermal = Thermal::new(part.clone());
    let dt = 0.016;
    let mut t = 0.0;
    while t < 100.0 {
        t += dt;
        thermal.step(t, dt);
    }
    let board = part.room_c + part.board_rise_c * (1.0 - (-t / part.board_tau_s).exp());
    assert!((thermal.board_c() - board).abs() < 1e-9);
    // A first-order stage behind a first-order stage: A (1 - (a e^(-t/a) - b e^(-t/b))/(a - b)).
    for (die, b) in thermal.die_c().into_iter().zip(part.die_tau_s) {
        let a = part.board_tau_s;
        let through = 1.0 - (a * (-t / a).exp() - b * (-t / b).exp()) / (a - b);
        let own = part.die_rise_c * (1.0 - (-t / b).exp());
        let expected = part.room_c + part.board_rise_c * through + own;
        assert!(
            (die - expected).abs() < 2e-3,
            "{die} degC, expected {expected}"
        );
    }
}

#[test]
fn the_motor_settles_where_torque_and_voltage_balance() {
    let part = MotorPart::default();
    for duty in [-1.0, -0.3, 0.5, 1.0] {
        let mut motor = Motor::new(part.clone());
        for _ in 0..5000 {
            motor.step(duty, 1e-3);
        }
        // R i + k w = u, k i = b w + friction.
        let u: f64 = duty * part.driver_v;
        let sign = u.signum();
        let speed = (part.constant * u / part.resistance_ohm - sign * part.coulomb)
            / (part.viscous + part.constant.powi(2) / part.resistance_ohm);
        let current = (u - part.constant * speed) / part.resistance_ohm;
        assert!(
            (motor.speed_rad_s() / speed - 1.0).abs() < 1e-9,
            "duty {duty}"
        );
        assert!(
            (motor.current_a() / current - 1.0).abs() < 1e-9,
            "duty {duty}"
        );
    }
}

#[test]
fn friction_holds_a_motor_that_is_driven_too_weakly() {
    let part = MotorPart {
        coulomb: 0.01,
        ..MotorPart::default()
    };
    let mut motor = Motor::new(part.clone());
    // Stall torque k u/R = 0.006 N m < 0.01.
    for _ in 0..1000 {
        motor.step(0.1, 1e-3);
    }
    assert_eq!(motor.speed_rad_s(), 0.0);
    assert!((motor.current_a() - 0.1 * part.driver_v / part.resistance_ohm).abs() < 1e-9);
}

#[test]
fn the_motors_current_pulls_the_supply_down() {
    let part = SupplyPart {
        motor_ohm: 0.05,
        wander_v: 0.0,
        ..SupplyPart::default()
    };
    let mut supply = Supply::new(part, 1);
    supply.step(0.0, 1e-3, -2.0);
    assert!((supply.volts() - 4.9).abs() < 1e-12);
}

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
fn gravity_is_on_z_and_the_converter_reads_it() {
    let mut scenario = silent(11);
    scenario.acc = Default::default();
    scenario.base.tilt_deg = [0.0, 0.0];
    let stand = &mut Stand::new(&scenario);
    let mean_counts = |stand: &mut Stand, axis| {
        (0..2000)
            .map(|k| f64::from(stand.acc_counts(axis, 1.0 + k as f64 * 0.01)))
            .sum::<f64>()
            / 2000.0
    };
    let mut z = stand.clone();
    assert!((mean_counts(stand, 0) - 511.5).abs() < 1.0);
    // 0.8 V of 3.3 V in 1024 steps.
    assert!((mean_counts(&mut z, 2) - 511.5 - 1024.0 * 0.8 / 3.3).abs() < 1.0);
}

#[test]
fn a_stall_repeats_the_last_sample_and_says_so_or_not() {
    for (flags, new) in [(StallFlags::NewDataClear, 0), (StallFlags::Silent, 0x8000)] {
        let mut scenario = white(12).with(Fault::Stall {
            gyro: 0,
            count: 1,
            length_s: 2.0,
            flags,
        });
        scenario.seconds = 10.0;
        let stand = &mut Stand::new(&scenario);
        let words: Vec<u16> = (0..240)
            .map(|k| read(stand, 0, register::GYRO_OUT, 1.0 + k as f64 / 20.0))
            .collect();
        let longest = words
            .chunk_by(|a, b| a & 0x3fff == b & 0x3fff)
            .max_by_key(|run| run.len())
            .unwrap();
        assert!(longest.len() >= 39, "{} equal samples", longest.len());
        assert!(longest[2..].iter().all(|word| word & 0x8000 == new));
    }
}

#[test]
fn each_fault_leaves_the_other_gyros_alone() {
    let faults = [
        Fault::Tempco {
            gyro: 0,
            dps_per_c: 0.5,
            dps_per_c2: 0.0,
        },
        Fault::SupplyCoupling {
            gyro: 0,
            dps_per_volt: 30.0,
        },
        Fault::Knock {
            gyro: 0,
            time_s: 3.0,
            step_dps: 1.0,
            tilt_deg: 0.2,
        },
        Fault::WarmUp {
            gyro: 0,
            amplitude_dps: 2.0,
            tau_s: 5.0,
        },
        Fault::Leak {
            gyro: 0,
            dps_per_s: 0.1,
        },
        Fault::WanderingBias {
            gyro: 0,
            sigma_dps: 0.5,
            tau_s: 1.0,
        },
        Fault::Trap {
            gyro: 0,
            half_height_dps: 0.5,
            dwell_s: 1.0,
        },
        Fault::SlowFilter {
            gyro: 0,
            pole_hz: 3.0,
        },
        Fault::GSensitivity {
            gyro: 0,
            dps_per_g: [0.0, 0.0, 1.0],
        },
        Fault::NoisySpell {
            gyro: 0,
            start_s: 2.0,
            end_s: 5.0,
            power: 3.0,
        },
        Fault::Glitches {
            gyro: 0,
            count: 3,
            height_dps: 5.0,
        },
        Fault::StuckBit {
            gyro: 0,
            bit: 2,
            value: true,
        },
        Fault::DeadSpi {
            gyro: 0,
            start_s: 2.0,
            end_s: 3.0,
            level: true,
        },
    ];
    let mut scenario = Scenario::lively(13);
    scenario.seconds = 8.0;
    let all = |scenario: &Scenario| {
        let stand = &mut Stand::new(scenario);
        let mut words = [vec![], vec![], vec![]];
        for k in 0..140 {
            for (axis, words) in words.iter_mut().enumerate() {
                words.push(read(stand, axis, register::GYRO_OUT, 1.0 + k as f64 / 20.0));
            }
        }
        words
    };
    let clean = all(&scenario);
    for fault in faults {
        let planted = all(&scenario.clone().with(fault.clone()));
        assert_ne!(planted[0], clean[0], "{fault:?} does something");
        assert_eq!(planted[1..], clean[1..], "{fault:?} acts on gyro x alone");
    }
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

#[test]
fn the_motor_faults_follow_the_current() {
    let part = GyroPart {
        angle_random_walk_deg_sqrt_h: 0.0,
        rate_random_walk: 0.0,
        ..GyroPart::default()
    };
    let mut scenario = silent(15).with(Fault::MotorCoupling {
        gyro: 1,
        dps_per_amp: 10.0,
    });
    scenario.gyros[1] = part;
    let stand = &mut Stand::new(&scenario);
    stand.set_motor(1.0, 1.0);
    let rate = signed(read(stand, 1, register::GYRO_OUT, 5.0)) * LSB;
    let current = stand.motor().current_a();
    assert!(
        current > 0.3 && (rate - 10.0 * current).abs() <= LSB,
        "{rate} deg/s at {current} A"
    );
}
