//! The attitude behind corrected rates, against the twin.

use super::*;

/// By how much two attitudes differ, deg.
fn between(a: [f64; 4], b: [f64; 4]) -> f64 {
    let dot: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
    assert!(dot.is_finite(), "{a:?} {b:?}");
    let across = (1.0
        - dot * dot / a.iter().map(|a| a * a).sum::<f64>() / b.iter().map(|b| b * b).sum::<f64>())
    .max(0.0);
    2.0 * across.sqrt().asin().to_degrees()
}

fn attitude(frame: &Corrected) -> [f64; 4] {
    frame
        .attitude
        .map(|part| f64::from(part.get()) / f64::from(1 << 30))
}

/// 600 s of a base that sways and turns about all axes, with the paper's noise, at both ends of the rates: the twin turns by
/// the exact sine of the same rates.
#[test]
fn the_attitude_follows_the_twin_for_600_s() {
    for (rate_hz, period) in [(20.0, 12_500u32), (256.2, 976)] {
        let numbers = plain(0.0096).numbers().unwrap();
        let mut board = OnBoard::with(0, &numbers);
        let mut twin = Twin::new(&correction::Correction::from_numbers(&numbers).unwrap());
        let mut random = Random(600);
        let (mut worst, mut turned) = (0.0f64, 0.0f64);
        for n in 0..(600.0 * rate_hz) as u32 {
            let t = f64::from(n) / rate_hz;
            let swing = [(30.0, 0.31, 0.0), (18.0, 0.23, 1.0), (40.0, 0.05, 2.0)];
            let rate = swing.map(|(dps, hz, phase)| {
                in_counts(
                    dps * (std::f64::consts::TAU * hz * t + phase).sin()
                        + 5.0
                        + 0.4 * random.normal(),
                )
            });
            let raw = Raw {
                t_ticks: n.wrapping_mul(period).wrapping_add(0xffff_0000),
                ..raw(rate, [0; 3], 2730, [512, 512, 760])
            };
            // With the motor on nothing leads it.
            let (_, frame) = board.step(&raw, 1);
            twin.step(&inputs(&raw, 1));
            worst = worse(worst, between(attitude(&frame), twin.attitude));
            turned += rate
                .iter()
                .map(|c| (f64::from(*c) * scale()).powi(2))
                .sum::<f64>()
                .sqrt()
                / rate_hz;
            assert_eq!(frame.state & YAW_FREE != 0, n > 0);
        }
        println!("{rate_hz} Hz: worst {worst:.1e} deg of {turned:.0} deg");
        assert!(worst < 1e-3, "{worst}");
    }
}

/// Tilted by 20 and -35 deg at rest, a bias that the filter has to find, and a rate about the vertical that nothing holds.
#[test]
fn at_rest_the_tilt_comes_from_the_accelerometer_and_the_yaw_from_nowhere() {
    let numbers = plain(0.0096).numbers().unwrap();
    let mut board = OnBoard::with(0, &numbers);
    let mut twin = Twin::new(&correction::Correction::from_numbers(&numbers).unwrap());
    let mut random = Random(4);
    let (roll, pitch) = (20f64.to_radians(), (-35f64).to_radians());
    let up = [
        -pitch.sin(),
        pitch.cos() * roll.sin(),
        pitch.cos() * roll.cos(),
    ];
    let mut last = Corrected::new_zeroed();
    for n in 0..4_000u32 {
        let acc = up.map(|up| (512.0 + 248.24 * up + random.normal()).round() as u16);
        let rate = [0.5, 0.3, -0.8].map(|bias| in_counts(bias + 0.4 * random.normal()));
        let raw = Raw {
            t_ticks: n * 12_500,
            ..raw(rate, [0; 3], 2730, acc)
        };
        last = board.step(&raw, 0).1;
        twin.step(&inputs(&raw, 0));
    }
    let [w, x, y, z] = attitude(&last);
    let got = [
        2.0 * (x * z - w * y),
        2.0 * (y * z + w * x),
        1.0 - 2.0 * (x * x + y * y),
    ];
    let tilt = got
        .iter()
        .zip(up)
        .map(|(a, b)| a * b)
        .sum::<f64>()
        .min(1.0)
        .acos();
    // A gyro's noise of 0.02 deg in a sample, which 66 samples forget: 0.12 deg rms about each axis.
    assert!(tilt.to_degrees() < 0.5, "{}", tilt.to_degrees());
    assert!((w * w + x * x + y * y + z * z - 1.0).abs() < 1e-6);
    assert!(last.state & (YAW_FREE | AT_REST | FILTERED) == YAW_FREE | AT_REST | FILTERED);
    // Of the yaw, what the twin says is what there is: the rest of a bias, before the filter has it.
    let off = between([w, x, y, z], twin.attitude);
    assert!(off < 0.5, "{off}");
}

#[test]
fn a_gap_begins_the_attitude_anew_and_it_is_said() {
    let mut board = OnBoard::with(0, &plain(0.0096).numbers().unwrap());
    let at = |t_ticks| Raw {
        t_ticks,
        ..raw([500, 0, 0], [0; 3], 2730, [512, 512, 760])
    };
    for n in 0..10u32 {
        board.step(&at(n * 12_500), 1);
    }
    let (_, turned) = board.step(&at(125_000), 1);
    assert!(turned.state & YAW_FREE != 0 && turned.attitude[1].get() > 1 << 24);
    // 100 ms are not too long, a tick more is.
    let (_, still) = board.step(&at(150_000), 1);
    assert!(still.state & YAW_FREE != 0 && still.attitude[1].get() > turned.attitude[1].get());
    let (_, anew) = board.step(&at(150_000 + 25_001), 1);
    assert_eq!(anew.state & YAW_FREE, 0);
    assert_eq!(anew.attitude.map(I32::get), [1 << 30, 0, 0, 0]);
    let (_, on) = board.step(&at(150_000 + 25_001 + 12_500), 1);
    assert!(on.state & YAW_FREE != 0 && on.attitude[1].get() > 0);
}
