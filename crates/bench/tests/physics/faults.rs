//! Faults that are planted: each does what its parameters say, to its own gyro.

use bench::scenario::{GyroPart, StallFlags};
use bench::{Fault, Scenario, Stand, register};

use crate::{LSB, mean, rates, read, signed, silent, variance, white};

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

/// A sensor that leans by the angle whose sine is 0.6 feels 0.6 of the other axis and 0.8 of its own.
#[test]
fn a_gyro_that_leans_reads_both_axes_by_sine_and_cosine() {
    let turned = |gyro: usize, from: usize, share: f64| {
        let mut scenario = silent(15).with(Fault::Misalignment { gyro, from, share });
        scenario.motor.table_ratio = 0.004;
        // Floor and supply have nothing to do with it.
        scenario.supply.wander_v = 0.0;
        let stand = &mut Stand::new(&scenario);
        stand.set_motor(0.5, 1.0);
        let rates = [0, 1, 2].map(|axis| signed(read(stand, axis, register::GYRO_OUT, 9.0)) * LSB);
        (rates, stand.motor().table_dps())
    };
    for (share, own) in [(0.6, 0.8), (-0.6, 0.8), (0.28, 0.96)] {
        for from in [0, 1] {
            // About z alone: nothing comes over from the other axis, and its own grows less.
            let (rates, table) = turned(2, from, share);
            assert!(table > 20.0, "{table}");
            for (axis, wanted) in [(0, 0.0), (1, 0.0), (2, own * table)] {
                assert!(
                    (rates[axis] - wanted).abs() <= LSB,
                    "{axis}: {}",
                    rates[axis]
                );
            }
            // And one that leans towards it.
            let (rates, table) = turned(from, 2, share);
            for (axis, wanted) in [(from, share * table), (1 - from, 0.0), (2, table)] {
                assert!(
                    (rates[axis] - wanted).abs() <= LSB,
                    "{axis}: {}",
                    rates[axis]
                );
            }
        }
    }
}
