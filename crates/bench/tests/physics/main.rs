//! The stand against closed forms: what it does to the data is what its parameters say.

use bench::scenario::{MotorPart, SupplyPart, ThermalPart};
use bench::{Motor, Scenario, Stand, Supply, Thermal, bartlett, register};

mod data_sheet;
mod faults;
mod part;
mod registers;

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
