//! The sample clock, and what comes at times of its own.

use super::*;

/// A gyro in a world at rest, sampled until `until` s; what its GYRO_OUT reads after each sample, and when.
fn sampled(gyro: &mut Gyro, until: f64) -> Vec<(f64, u16)> {
    let mut read = Vec::new();
    while gyro.next_s() < until {
        let t = gyro.next_s();
        gyro.sample(&world());
        gyro.adis
            .frame(u16::from(crate::register::GYRO_OUT) << 8, t);
        read.push((t, gyro.adis.frame(0, t)));
    }
    read
}

#[test]
fn its_clock_has_its_phase_and_its_error() {
    let part = GyroPart {
        clock_ppm: 2000.0,
        clock_phase: 0.25,
        ..still()
    };
    let mut gyro = Gyro::new(1, &part, &[], &[], 10.0, 5);
    near(gyro.next_s(), 0.25 * DT);
    let read = sampled(&mut gyro, 2.0);
    let period = (read[400].0 - read[0].0) / 400.0;
    near(period, DT / 1.002);
}

#[test]
fn stalls_glitches_and_dead_lines_come_where_they_are_planned_to() {
    let plan = |faults: &[Fault]| Gyro::new(1, &still(), faults, &[], 30.0, 5);
    let stall = |flags| Fault::Stall {
        gyro: 1,
        count: 3,
        length_s: 0.5,
        flags,
    };
    for (flags, new) in [
        (StallFlags::NewDataClear, false),
        (StallFlags::Silent, true),
    ] {
        let mut gyro = plan(&[stall(flags)]);
        let stalls = gyro.stalls.clone();
        assert_eq!(stalls.len(), 3);
        assert!(
            stalls
                .iter()
                .all(|(a, b, _)| (b - a - 0.5).abs() < 1e-9 && *a >= 1.0 && *b <= 30.0)
        );
        for (t, word) in sampled(&mut gyro, 30.0)
            .into_iter()
            .filter(|(t, _)| *t > 0.2)
        {
            let inside = stalls.iter().any(|(a, b, _)| (*a..*b).contains(&t));
            assert_eq!(word >> 15 == 1, !inside || new, "{t} s");
        }
    }
    let glitches = Fault::Glitches {
        gyro: 1,
        count: 5,
        height_dps: 30.0,
    };
    let mut gyro = plan(std::slice::from_ref(&glitches));
    let times: Vec<f64> = gyro.glitches.iter().rev().map(|(time, _)| *time).collect();
    assert!(times.is_sorted() && times[0] >= 1.0 && times[4] <= 30.0);
    let struck: Vec<(f64, f64)> = (sampled(&mut gyro, 31.0).into_iter())
        .map(|(t, word)| (t, f64::from(((word << 2) as i16) >> 2)))
        .filter(|(_, counts)| counts.abs() > 100.0)
        .collect();
    assert_eq!(struck.len(), 5);
    for ((t, counts), time) in struck.iter().zip(times) {
        assert!((0.0..=DT).contains(&(t - time)), "{t} {time}");
        near(counts.abs(), (30.0 / LSB).round());
    }
    for (level, all) in [(true, 0xffff), (false, 0)] {
        let mut gyro = plan(&[Fault::DeadSpi {
            gyro: 1,
            start_s: 2.0,
            end_s: 3.0,
            level,
        }]);
        for (t, _) in sampled(&mut gyro, 4.0)
            .into_iter()
            .filter(|(t, _)| *t > 0.2)
        {
            // GYRO_SCALE, which is neither.
            gyro.adis.frame(0x1600, t);
            gyro.adis.select(true, t);
            let word = [0x04, 0x00].map(|byte| gyro.transfer(byte, t).expect("it is selected"));
            gyro.adis.select(false, t);
            let dead = u16::from_be_bytes(word) == all;
            assert_eq!(dead, (2.0..3.0).contains(&t), "{t} s");
        }
        assert_eq!(gyro.transfer(0, 2.5), None, "it is not selected");
    }
    // Those of another gyro leave this one alone.
    let others = [
        Fault::Stall {
            gyro: 2,
            count: 3,
            length_s: 0.5,
            flags: StallFlags::Silent,
        },
        Fault::Glitches {
            gyro: 0,
            count: 5,
            height_dps: 30.0,
        },
        Fault::DeadSpi {
            gyro: 0,
            start_s: 2.0,
            end_s: 3.0,
            level: true,
        },
        Fault::SlowFilter {
            gyro: 0,
            pole_hz: 5.0,
        },
    ];
    let gyro = plan(&others);
    assert!(gyro.stalls.is_empty() && gyro.glitches.is_empty() && gyro.dead.is_empty());
    assert_eq!(gyro.chain.part.pole_hz, 50.0);
}

/// Whether values fill a range evenly: mean and variance of a uniform law, both within four standard errors.
fn is_even(values: &[f64], low: f64, high: f64) {
    let n = values.len() as f64;
    assert!(values.iter().all(|x| (low..=high).contains(x)));
    let half = (high - low) / 2.0;
    let mean = values.iter().sum::<f64>() / n;
    let off = (mean - (low + half)) / half;
    // On -1 .. 1 the variance is 1/3 and the fourth moment 1/5.
    assert!(off.abs() < 4.0 / (3.0 * n).sqrt(), "{off}");
    let of_square = |x: &f64| ((x - low) / half - 1.0).powi(2);
    let variance = values.iter().map(of_square).sum::<f64>() / n;
    let error = (1.0 / 5.0 - 1.0 / 9.0) / n;
    assert!((variance - 1.0 / 3.0).abs() < 4.0 * error.sqrt());
}

#[test]
fn events_are_spread_over_the_run_and_discharges_have_either_sign_as_often() {
    let (count, seconds, length_s) = (1000, 40.0, 8.0);
    let faults = [
        Fault::Stall {
            gyro: 1,
            count,
            length_s,
            flags: StallFlags::Silent,
        },
        Fault::Glitches {
            gyro: 1,
            count,
            height_dps: 30.0,
        },
    ];
    let gyro = Gyro::new(1, &still(), &faults, &[], seconds, 5);
    let starts: Vec<f64> = gyro.stalls.iter().map(|stall| stall.0).collect();
    is_even(&starts, 1.0, seconds - length_s);
    let times: Vec<f64> = gyro.glitches.iter().map(|glitch| glitch.0).collect();
    is_even(&times, 1.0, seconds);
    let up = gyro.glitches.iter().filter(|glitch| glitch.1 > 0).count();
    // Four standard errors of half of them.
    let off = (up as f64 - 500.0) / (1000f64.sqrt() / 2.0);
    assert!(off.abs() < 4.0, "{up} of {count}");
}

#[test]
fn a_stuck_bit_is_in_what_the_part_says() {
    let at = |fault: Fault| {
        let mut gyro = Gyro::new(1, &still(), &[fault], &[], 10.0, 5);
        sampled(&mut gyro, 1.0).last().expect("some").1 & 0x3fff
    };
    let stuck = |gyro, bit, value| Fault::StuckBit { gyro, bit, value };
    assert_eq!(at(stuck(1, 3, true)), 8);
    assert_eq!(at(stuck(2, 3, true)), 0);
    assert_eq!(at(stuck(1, 3, false)), 0);
}
