use super::*;

mod events;

const LSB: f64 = 0.073_26;
const DT: f64 = 1.0 / 256.0;

/// A gyro without noise.
fn still() -> GyroPart {
    GyroPart {
        angle_random_walk_deg_sqrt_h: 0.0,
        rate_random_walk: 0.0,
        ..GyroPart::default()
    }
}

fn world() -> Stimulus {
    Stimulus {
        die_c: 25.0,
        supply_v: 5.0,
        ..Stimulus::default()
    }
}

fn chain(part: GyroPart, faults: &[Fault]) -> GyroChain {
    GyroChain::new(1, part, faults, &[], 5)
}

/// The rate that a chain settles at, deg/s, in steps of a 16th of a count: the offset register dithers it.
fn settled(part: &GyroPart, faults: &[Fault], world: &Stimulus, t: f64) -> f64 {
    let mut chain = chain(part.clone(), faults);
    let adis = Adis16250::new();
    // Angle is what the rate integrates to before it is rounded.
    for _ in 0..300 {
        chain.sample(world, &adis, t, 0.0);
        chain.sample(world, &adis, t, 1e-3);
    }
    let before = chain.angle_deg;
    chain.sample(world, &adis, t, 1.0);
    chain.angle_deg - before
}

fn near(got: f64, wanted: f64) {
    assert!((got - wanted).abs() < 1e-6, "{got}, not {wanted}");
}

#[test]
fn each_error_of_a_part_adds_what_it_says() {
    let part = GyroPart {
        turn_on_bias_dps: 0.5,
        scale_error: 0.01,
        tempco_dps_c: 0.02,
        supply_dps_v: 0.3,
        g_sensitivity_dps_g: [0.1, -0.2, 0.05],
        ..still()
    };
    let world = Stimulus {
        rate_dps: 40.0,
        die_c: 32.0,
        supply_v: 4.9,
        acc_g: [0.5, 1.0, -1.0],
        common_dps: 0.04,
        ..world()
    };
    let wanted = 40.0 * 1.01 + 0.5 + 0.02 * 7.0 - 0.3 * 0.1 + (0.05 - 0.2 - 0.05) + 0.04;
    near(settled(&part, &[], &world, 3.0), wanted);
}

#[test]
fn each_fault_adds_what_it_says_to_its_own_gyro_and_nothing_to_another() {
    let world = Stimulus {
        die_c: 21.0,
        supply_v: 5.1,
        motor_a: -0.5,
        acc_g: [0.1, 0.2, 0.9],
        ..world()
    };
    let t = 12.0;
    let faults = |gyro: usize| {
        [
            (
                Fault::Tempco {
                    gyro,
                    dps_per_c: 0.1,
                    dps_per_c2: 0.01,
                },
                -4.0 * 0.1 + 16.0 * 0.01,
            ),
            (
                Fault::MotorCoupling {
                    gyro,
                    dps_per_amp: 0.8,
                },
                -0.4,
            ),
            (
                Fault::SupplyCoupling {
                    gyro,
                    dps_per_volt: 2.0,
                },
                0.2,
            ),
            (
                Fault::Knock {
                    gyro,
                    time_s: 12.0,
                    step_dps: 0.3,
                    tilt_deg: 0.0,
                },
                0.3,
            ),
            (
                Fault::Knock {
                    gyro,
                    time_s: 12.1,
                    step_dps: 0.3,
                    tilt_deg: 0.0,
                },
                0.0,
            ),
            (
                Fault::WarmUp {
                    gyro,
                    amplitude_dps: 2.0,
                    tau_s: 6.0,
                },
                2.0 * (-2f64).exp(),
            ),
            (
                Fault::Leak {
                    gyro,
                    dps_per_s: 0.05,
                },
                0.6,
            ),
            (
                Fault::GSensitivity {
                    gyro,
                    dps_per_g: [1.0, 2.0, -1.0],
                },
                0.1 + 0.4 - 0.9,
            ),
        ]
    };
    for (fault, wanted) in faults(1) {
        near(settled(&still(), &[fault], &world, t), wanted);
    }
    for (fault, _) in faults(2) {
        near(settled(&still(), &[fault], &world, t), 0.0);
    }
}

/// Rates of a chain, deg/s, with a filter of one tap.
fn course(part: GyroPart, faults: &[Fault], world: &Stimulus, n: usize) -> Vec<f64> {
    let mut chain = chain(part, faults);
    let mut adis = Adis16250::new();
    adis.keep(crate::register::SENS_AVG, 0x0400);
    let mut before = 0.0;
    (0..n)
        .map(|k| {
            chain.sample(world, &adis, k as f64 * DT, DT);
            let rate = (chain.angle_deg - before) / DT;
            before = chain.angle_deg;
            rate
        })
        .collect()
}

fn rms(x: &[f64]) -> f64 {
    (x.iter().map(|v| v * v).sum::<f64>() / x.len() as f64).sqrt()
}

/// What of a value is left in the one `lag` behind it.
fn left(x: &[f64], lag: usize) -> f64 {
    let products: f64 = x.iter().zip(&x[lag..]).map(|(a, b)| a * b).sum();
    products / (x.len() - lag) as f64 / rms(x).powi(2)
}

#[test]
fn a_bias_that_wanders_has_its_rms_and_comes_back_within_its_time() {
    let fault = Fault::WanderingBias {
        gyro: 1,
        sigma_dps: 0.2,
        tau_s: 0.5,
    };
    // 780 s of half a second: 780 independent values.
    let course = course(still(), &[fault], &world(), 200_000);
    assert!((rms(&course) / 0.2 - 1.0).abs() < 0.1, "{}", rms(&course));
    assert!((left(&course, 128) - (-1f64).exp()).abs() < 0.1);
}

#[test]
fn a_trap_has_two_levels_and_stays_at_each_for_its_time() {
    let fault = Fault::Trap {
        gyro: 1,
        half_height_dps: 0.3,
        dwell_s: 0.4,
    };
    let course = course(still(), &[fault], &world(), 200_000);
    assert!((rms(&course) / 0.3 - 1.0).abs() < 0.03, "{}", rms(&course));
    let turns = course
        .windows(2)
        .filter(|two| two[0] * two[1] < 0.0)
        .count();
    let wanted = 200_000.0 * DT / 0.4;
    assert!(
        (turns as f64 / wanted - 1.0).abs() < 0.1,
        "{turns} of {wanted}"
    );
}

#[test]
fn noise_grows_with_the_motors_current_and_in_a_spell() {
    let noisy = || GyroPart {
        rate_random_walk: 0.0,
        ..GyroPart::default()
    };
    let driven = Stimulus {
        motor_a: -0.5,
        ..world()
    };
    let fault = Fault::MotorNoise {
        gyro: 1,
        power_per_amp: 6.0,
    };
    let n = 40_000;
    let plain = rms(&course(noisy(), &[], &driven, n));
    let more = rms(&course(noisy(), &[fault], &driven, n));
    assert!((more / plain - 2.0).abs() < 0.06, "{}", more / plain);
    let spell = Fault::NoisySpell {
        gyro: 1,
        start_s: 50.0,
        end_s: 100.0,
        power: 8.0,
    };
    let course = course(noisy(), &[spell], &world(), n);
    let (a, b) = ((50.0 / DT) as usize, (100.0 / DT) as usize);
    assert!((rms(&course[a..b]) / plain - 3.0).abs() < 0.15);
    assert!((rms(&course[..a]) / plain - 1.0).abs() < 0.05);
    assert!((rms(&course[b..]) / plain - 1.0).abs() < 0.05);
}

#[test]
fn white_noise_behind_a_slower_pole_is_less_and_more_alike() {
    let slow = |pole_hz| {
        let fault = Fault::SlowFilter { gyro: 1, pole_hz };
        let part = GyroPart {
            rate_random_walk: 0.0,
            ..GyroPart::default()
        };
        course(part, &[fault], &world(), 60_000)
    };
    let (fast, slow) = (slow(50.0), slow(12.5));
    // A fourth of the corner: a fourth of the power.
    assert!((rms(&fast) / rms(&slow) - 2.0).abs() < 0.1);
    for (course, pole) in [(fast, 50.0), (slow, 12.5)] {
        let alike = (-TAU * pole * DT).exp();
        assert!((left(&course, 1) - alike).abs() < 0.02, "{pole} Hz");
    }
}

#[test]
fn a_tone_passes_the_pole_with_its_gain_and_lag() {
    let tone = Tone {
        axis: 1,
        frequency_hz: 50.0,
        amplitude_dps: 2.0,
        linear_g: 0.0,
        phase: 0.3,
    };
    let other = Tone { axis: 0, ..tone };
    let mut chain = GyroChain::new(1, still(), &[], &[tone, other], 5);
    let mut adis = Adis16250::new();
    adis.keep(crate::register::SENS_AVG, 0x0400);
    let mut before = 0.0;
    for k in 0..200 {
        let t = f64::from(k) * DT;
        chain.sample(&world(), &adis, t, DT);
        let rate = (chain.angle_deg - before) / DT;
        before = chain.angle_deg;
        // At its corner a pole passes 0.707, 45 degrees behind.
        let wanted = 2.0 * 0.5f64.sqrt() * (TAU * (50.0 * t + 0.3 - 0.125)).sin();
        near(rate, wanted);
    }
}

#[test]
fn a_step_passes_the_pole_and_then_the_window() {
    let mut chain = chain(still(), &[]);
    let mut adis = Adis16250::new();
    adis.keep(crate::register::SENS_AVG, 0x0401);
    let turns = Stimulus {
        rate_dps: 10.0,
        ..world()
    };
    (0..300).for_each(|_| {
        chain.sample(&world(), &adis, 0.0, DT);
    });
    let keep = (-TAU * 50.0 * DT).exp();
    // Behind the pole 1 - keep^k; two boxcars of two taps weigh 1/4, 1/2, 1/4.
    let at = |k: i32| {
        if k > 0 {
            10.0 * (1.0 - keep.powi(k))
        } else {
            0.0
        }
    };
    for k in 1..8 {
        let before = chain.angle_deg;
        let (outputs, _) = chain.sample(&turns, &adis, 0.0, DT);
        let wanted = at(k) / 4.0 + at(k - 1) / 2.0 + at(k - 2) / 4.0;
        near((chain.angle_deg - before) / DT, wanted);
        assert_eq!(f64::from(outputs.gyro), (wanted / LSB).round());
    }
}

#[test]
fn registers_hold_rounded_and_clamped_counts_and_the_angle_goes_round() {
    let adis = Adis16250::new();
    let sample = |world: &Stimulus, part: GyroPart| {
        let mut chain = chain(part, &[]);
        (0..200)
            .map(|_| chain.sample(world, &adis, 1.0, 0.05))
            .last()
            .expect("some")
            .0
    };
    let hot = Stimulus {
        rate_dps: -700.0,
        die_c: 39.0,
        supply_v: 5.2,
        ..world()
    };
    let part = GyroPart {
        temp_offset_c: 2.0,
        ..still()
    };
    let out = sample(&hot, part);
    assert_eq!(out.gyro, -8192);
    // The sensor's own noise is 0.05 degC and 1 mV.
    assert!(
        (f64::from(out.temp) - 16.0 / 0.1453).abs() < 2.5,
        "{}",
        out.temp
    );
    assert!(
        (f64::from(out.supply) - 5.2 / 1.8315e-3).abs() < 3.5,
        "{}",
        out.supply
    );
    let out = sample(
        &Stimulus {
            rate_dps: 700.0,
            ..world()
        },
        still(),
    );
    assert_eq!(out.gyro, 8191);
    // 200 samples of 50 ms at 10 deg/s, less what the filter's begin lacks: 100 deg of 0.03663.
    let out = sample(
        &Stimulus {
            rate_dps: 10.0,
            ..world()
        },
        still(),
    );
    assert!(
        (f64::from(out.angle) * 0.036_63 - 100.0).abs() < 2.0,
        "{}",
        out.angle
    );
    let out = sample(
        &Stimulus {
            rate_dps: -10.0,
            ..world()
        },
        still(),
    );
    assert!((f64::from(out.angle) - (16384.0 - 100.0 / 0.036_63)).abs() < 60.0);
}

/// The sensors' own noise: 0.05 degC and 1 mV, and the rounding of a count, whose variance is a twelfth.
#[test]
fn temperature_and_supply_have_their_noise() {
    let mut chain = chain(still(), &[]);
    let adis = Adis16250::new();
    let n = 20_000;
    let spread = |values: Vec<f64>| {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        rms(&values.iter().map(|x| x - mean).collect::<Vec<_>>())
    };
    // The world creeps over many counts, so that rounding is even; what it is then is taken off.
    let (mut temp, mut supply) = (vec![], vec![]);
    for k in 0..n {
        let part = f64::from(k) / f64::from(n);
        let world = Stimulus {
            die_c: 25.0 + 20.0 * TEMP_LSB_C * part,
            supply_v: 5.0 + 20.0 * SUPPLY_LSB_V * part,
            ..world()
        };
        let (outputs, _) = chain.sample(&world, &adis, 1.0, DT);
        temp.push(f64::from(outputs.temp) - 20.0 * part);
        supply.push(f64::from(outputs.supply) - 20.0 * part);
    }
    for (values, sigma) in [(temp, 0.05 / TEMP_LSB_C), (supply, 1e-3 / SUPPLY_LSB_V)] {
        let wanted = (sigma * sigma + 1.0 / 12.0).sqrt();
        let got = spread(values);
        // 20 000 values: 0.5 % rms.
        assert!((got / wanted - 1.0).abs() < 0.03, "{got}, not {wanted}");
    }
}

#[test]
fn alarms_have_their_thresholds() {
    let adis = Adis16250::new();
    let alarms = |rate_dps: f64, supply_v: f64| {
        let mut chain = chain(still(), &[]);
        let world = Stimulus {
            rate_dps,
            supply_v,
            ..world()
        };
        (0..200)
            .map(|_| chain.sample(&world, &adis, 1.0, DT).1)
            .last()
            .expect("some")
    };
    assert_eq!(alarms(0.0, 4.76), 0);
    assert_eq!(alarms(0.0, 4.74), status::SUPPLY_LOW);
    assert_eq!(alarms(0.0, 5.24), 0);
    assert_eq!(alarms(0.0, 5.26), status::SUPPLY_HIGH);
    assert_eq!((alarms(319.0, 5.0), alarms(-319.0, 5.0)), (0, 0));
    assert_eq!(alarms(321.0, 5.0), status::OVERRANGE);
    assert_eq!(alarms(-321.0, 4.74), status::OVERRANGE | status::SUPPLY_LOW);
}

#[test]
fn scale_offset_and_stimulus_act_where_the_data_sheet_has_them() {
    let world = Stimulus {
        rate_dps: 20.0,
        ..world()
    };
    let with = |registers: &[(u8, u16)]| {
        let mut chain = chain(still(), &[]);
        let mut adis = Adis16250::new();
        for &(address, value) in registers {
            adis.keep(address, value);
        }
        (0..300).for_each(|_| {
            chain.sample(&world, &adis, 1.0, DT);
        });
        let before = chain.angle_deg;
        chain.sample(&world, &adis, 1.0, 1.0);
        chain.angle_deg - before
    };
    use crate::register as reg;
    near(with(&[(reg::GYRO_SCALE, 0x0c00)]), 30.0);
    near(with(&[(reg::GYRO_OFF, 100)]), 20.0 + 100.0 * 0.018_315);
    near(with(&[(reg::GYRO_OFF, 0x0fff)]), 20.0 - 0.018_315);
    near(with(&[(reg::MSC_CTRL, 1 << 8)]), 20.0 + 721.0 * LSB);
    near(with(&[(reg::MSC_CTRL, 1 << 9)]), 20.0 - 721.0 * LSB);
}
