//! The parts' figures, pinned to their data sheets within 0.5 %.

use bench::{AccSelect, Fault, Stand, register};

use super::{LSB, read, signed, silent};

/// A stand in a room of so many degC, its sensors as warm as that and by themselves.
fn in_room(room_c: f64) -> bench::Scenario {
    let mut scenario = silent(40);
    scenario.thermal.room_c = room_c;
    for gyro in &mut scenario.gyros {
        gyro.temp_offset_c = 0.0;
    }
    scenario
}

/// ADIS16250: TEMP_OUT has 0.1453 degC for each count and 0 at 25 degC.
#[test]
fn temp_out_has_the_scale_of_the_data_sheet() {
    for room_c in [-35.0, 75.0] {
        let stand = &mut Stand::new(&in_room(room_c));
        let counts: f64 = (0..400)
            .map(|k| {
                let word = read(stand, 0, register::TEMP_OUT, 3000.0 + f64::from(k) * 0.05);
                f64::from(((word << 4) as i16) >> 4) / 400.0
            })
            .sum();
        let warm = stand.thermal().die_c()[0] - 25.0;
        assert!(warm.abs() > 40.0, "{warm}");
        assert!(
            (counts * 0.1453 / warm - 1.0).abs() < 0.005,
            "{counts} counts at {warm}"
        );
    }
}

/// MMA7260QT at 3.3 V: 800, 600, 300, 200 mV/g for the four settings of g-select, 1024 counts over 3.3 V.
#[test]
fn each_range_of_the_accelerometer_has_its_sensitivity() {
    for (range, volts_per_g) in [(0u8, 0.8), (1, 0.6), (2, 0.3), (3, 0.2)] {
        let mut scenario = silent(41);
        scenario.acc = Default::default();
        scenario.base.tilt_deg = [0.0, 0.0];
        let select = AccSelect {
            select1: range & 1 != 0,
            select2: range & 2 != 0,
            awake: true,
        };
        let mut level = Stand::new(&scenario);
        level.set_acc_pins(select, 0.5);
        let mean = |axis| {
            let stand = &mut level.clone();
            let counts =
                (0..8000).map(|k| f64::from(stand.acc_counts(axis, 1.0 + f64::from(k) * 0.01)));
            counts.sum::<f64>() / 8000.0
        };
        let per_g = mean(2) - mean(0);
        let expected = 1024.0 * volts_per_g / 3.3;
        assert!(
            (per_g / expected - 1.0).abs() < 0.005,
            "range {range}: {per_g}, {expected}"
        );
    }
}

/// What is said to rise with the temperature rises with it, by so much.
#[test]
fn a_slope_over_the_temperature_has_its_sign_and_size() {
    for planted in [false, true] {
        let mut scenario = in_room(75.0);
        if planted {
            scenario = scenario.with(Fault::Tempco {
                gyro: 0,
                dps_per_c: 0.2,
                dps_per_c2: 0.0,
            });
        } else {
            scenario.gyros[0].tempco_dps_c = 0.2;
        }
        let stand = &mut Stand::new(&scenario);
        let rate: f64 = (0..400)
            .map(|k| {
                signed(read(
                    stand,
                    0,
                    register::GYRO_OUT,
                    3000.0 + f64::from(k) * 0.05,
                )) * LSB
                    / 400.0
            })
            .sum();
        let other = if planted {
            scenario.gyros[0].tempco_dps_c
        } else {
            0.0
        };
        let expected = (0.2 + other) * (stand.thermal().die_c()[0] - 25.0);
        assert!(
            (rate / expected - 1.0).abs() < 0.01,
            "{planted}: {rate}, {expected}"
        );
    }
}

#[test]
fn a_quiet_stands_accelerometer_has_zeros_within_its_part() {
    let zeros: Vec<f64> = (0..200)
        .flat_map(|seed| bench::Scenario::quiet(seed).acc.zero_g_error_v)
        .collect();
    let rms = (zeros.iter().map(|v| v * v).sum::<f64>() / zeros.len() as f64).sqrt();
    // 600 draws: 3 % rms.
    assert!((rms / 0.03 - 1.0).abs() < 0.1, "{rms} V");
}

#[test]
fn a_reference_that_follows_the_rail_does_so_by_its_share() {
    let mut scenario = bench::Scenario::quiet(3).with(bench::Fault::AccReference { share: 0.4 });
    scenario.supply = bench::scenario::SupplyPart {
        open_v: 5.05,
        wander_v: 0.0,
        load_step_v: 0.0,
        ..scenario.supply
    };
    let mut stand = bench::Stand::new(&scenario);
    stand.advance(1.0);
    assert!(
        (stand.aref_volts() - (3.3 + 0.4 * 0.05)).abs() < 1e-9,
        "{}",
        stand.aref_volts()
    );
}
