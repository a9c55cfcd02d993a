use super::*;

#[test]
fn what_is_stored_is_within_half_a_step_of_what_was_meant() {
    let meant = Correction {
        number: 0xBEEF,
        generation: 7,
        block_shift: 4,
        sens_avg: 0x0402,
        temp_range: [-8, 30],
        bias: [1.234_567, -31.9, 1e-6],
        temperature: [0.03, -0.0312, 1e-5],
        motor: [0.4 / 255.0, -3.9 / 255.0, 0.0],
        motor_turning: [0.25, -3.9, 0.0],
        motor_magnitude: [-0.01, 0.0, 0.02],
        temperature_squared: [1e-4, -4e-4, 0.0],
        supply: [-0.001, 0.0, 0.03],
        acc: [[0.01, -0.02, 0.03], [0.0, 1e-3, 0.0], [-0.005; 3]],
        follow: 0.25,
        surge: [-0.01, 0.02, -0.0305],
        matrix: [[0.01, 0.124, -0.03], [0.0; 3], [-0.02, 0.0, 0.001]],
        noise: [0.0096, 0.2, 1e-4],
        walk: [8e-7, 2e-5, 0.0],
    };
    let read = Correction::from_numbers(&meant.numbers().unwrap()).unwrap();
    assert_eq!(
        (
            read.number,
            read.generation,
            read.block_shift,
            read.sens_avg,
            read.temp_range
        ),
        (0xBEEF, 7, 4, 0x0402, [-8, 30])
    );
    let places = read.values().into_iter().zip(meant.values()).enumerate();
    for (place, (read, meant)) in places.skip(OF_AXES) {
        let off = (read - meant).abs();
        assert!(
            off <= 0.5001 * step(place),
            "{:?}: {read} {meant}",
            name(place)
        );
    }
    for axis in 0..3 {
        assert!((read.bias[axis] - meant.bias[axis]).abs() < 5e-7);
        assert!((read.walk[axis] - meant.walk[axis]).abs() < 4e-8 * meant.noise[axis]);
    }
    assert!((read.follow - meant.follow).abs() < 2e-5);
    for (read, meant) in read.acc.iter().flatten().zip(meant.acc.iter().flatten()) {
        assert!((read - meant).abs() < 5e-7);
    }
    for (read, meant) in read
        .matrix
        .iter()
        .flatten()
        .zip(meant.matrix.iter().flatten())
    {
        assert!((read - meant).abs() < 2e-6);
    }
    let mut other = meant.numbers().unwrap();
    other[0] ^= 1;
    assert_eq!(Correction::from_numbers(&other), None, "another format");
}

/// Each number by its place, as docs/wire-format.md has them.
#[test]
fn places_have_the_names_and_steps_that_are_written_down() {
    let two = |bits: i32| 2f64.powi(-bits);
    for place in 0..6 {
        assert_eq!((name(place), step(place)), ((' ', "", ""), 0.0));
    }
    for (axis, begin) in [('x', 6), ('y', 17), ('z', 28)] {
        let names = [
            ("temperature", 20),
            ("temperature squared", 26),
            ("bias", 10),
            ("bias, fine part", 20),
            ("motor", 20),
            ("motor by magnitude", 20),
            ("motor as it turns", 13),
            ("supply", 20),
            ("acc x", 20),
            ("acc y", 20),
            ("acc z", 20),
        ];
        for (place, (what, bits)) in (begin..).zip(names) {
            let (of, named, _) = name(place);
            assert_eq!((of, named, step(place)), (axis, what, two(bits)), "{place}");
        }
    }
    for (axis, begin) in [('x', 39), ('y', 42), ('z', 45)] {
        for (place, from) in (begin..).zip(["x", "y", "z"]) {
            let (of, named, _) = name(place);
            assert_eq!((of, step(place)), (axis, two(18)), "{place}");
            assert!(named.ends_with(from), "{named}");
        }
    }
    for (axis, begin) in [('x', 48), ('y', 51), ('z', 54)] {
        let names = [("noise of", 18), ("walk of", 24), ("motor, while", 20)];
        for (place, (what, bits)) in (begin..).zip(names) {
            let (of, named, _) = name(place);
            assert_eq!((of, step(place)), (axis, two(bits)), "{place}");
            assert!(named.starts_with(what), "{named}");
        }
    }
    assert_eq!((name(57), step(57)), ((' ', "", ""), 0.0));
    assert_eq!((NUMBERS, ROWS, NUMBERS_LEN, STORED_LEN), (57, 19, 114, 118));
}

#[test]
fn numbers_reach_to_the_ends_of_their_sixteen_bits() {
    for (value, whole) in [(32_767.0, i16::MAX), (-32_767.0, -i16::MAX)] {
        let meant = Correction {
            supply: [value * step(13), 0.0, 0.0],
            ..Correction::default()
        };
        assert_eq!(meant.numbers().unwrap()[13], whole);
    }
    let noise = |value: f64| Correction {
        noise: [value * step(48), 0.0, 0.0],
        ..Correction::default()
    };
    assert_eq!(noise(65_535.0).numbers().unwrap()[48], -1);
    assert!(noise(65_536.0).numbers().is_err());
    let shift = Correction {
        block_shift: 12,
        follow: 3.0,
        ..Correction::default()
    };
    let numbers = shift.numbers().unwrap();
    assert_eq!((numbers[2], numbers[5]), (7, i16::MAX));
    // Halves go away from zero.
    for (value, whole) in [(0.5, 1), (0.49, 0), (-0.5, -1), (-1.51, -2)] {
        let meant = Correction {
            supply: [value * step(13), 0.0, 0.0],
            ..Correction::default()
        };
        assert_eq!(meant.numbers().unwrap()[13], whole, "{value}");
    }
}

#[test]
fn the_row_that_ends_a_correction_is_the_crc_of_its_bytes() {
    let numbers: Numbers = core::array::from_fn(|place| place as i16 * 257 - 300);
    let bytes = bytes(&numbers);
    assert_eq!(bytes[..4], [0xd4, 0xfe, 0xd5, 0xff]);
    let [low, high, zero] = crc_row(&numbers);
    let crc = u32::from(high.cast_unsigned()) << 16 | u32::from(low.cast_unsigned());
    assert_eq!((crc, zero), (crate::crc::crc32c(&bytes), 0));
}

#[test]
fn what_does_not_fit_is_refused_by_name() {
    let too_much = Correction {
        temperature: [0.0, 0.04, 0.0],
        ..Correction::default()
    };
    let error = too_much.numbers().unwrap_err();
    assert_eq!(error.place, 17);
    assert_eq!(
        std::string::ToString::to_string(&error),
        "temperature of gyro y: 0.040000 deg/s/count is outside what the board holds, 0.031249"
    );
    for bad in [f64::NAN, f64::INFINITY, -1.0, 0.3] {
        let noise = Correction {
            noise: [bad; 3],
            ..Correction::default()
        };
        assert!(noise.numbers().is_err(), "{bad}");
    }
    let nothing = Correction {
        bias: [f64::NAN; 3],
        ..Correction::default()
    };
    assert!(nothing.numbers().is_err());
}

#[test]
fn the_filter_settles_where_its_equations_say() {
    // P = q + P R / (P + R) at rest: P before a measurement is q/2 + sqrt(q^2/4 + q R), and R / P behind it what is known.
    let correction = Correction {
        noise: [0.01; 3],
        walk: [1e-6; 3],
        ..Correction::default()
    };
    let mut twin = Twin::new(&correction);
    let inputs = |n: u32| Inputs {
        // +-0.1 deg/s about 0.5: the variance that it was told.
        rate: [if n.is_multiple_of(2) { 0.6 } else { 0.4 }; 3],
        acc: [512; 3],
        supply: 2730,
        in_order: true,
        ..Inputs::default()
    };
    for n in 0..4000 {
        twin.step(&inputs(n));
    }
    let noise = 0.01 * twin.axes[0].noise;
    let before = 0.5e-6 + (0.25e-12f64 + 1e-6 * noise).sqrt();
    let after = before * noise / (before + noise);
    assert!((0.01 / after / twin.axes[0].known - 1.0).abs() < 0.02);
    assert!((twin.axes[0].bias - 0.5).abs() < 0.01);
}

/// The twin is at rest by what its rates spread about the mean of each block, however large that is: beyond four times what was
/// told of a block's mean, for its samples, it moves.
#[test]
fn a_twin_is_at_rest_by_the_spread_of_its_rates_and_not_by_their_mean() {
    let filtered = |mean: f64, spread: f64| {
        let correction = Correction {
            block_shift: 4,
            noise: [1e-3; 3],
            walk: [1e-6; 3],
            ..Correction::default()
        };
        let mut twin = Twin::new(&correction);
        for n in 0..16 * 4 {
            let sign = if n % 2 == 0 { 1.0 } else { -1.0 };
            twin.step(&Inputs {
                rate: [mean + sign * spread; 3],
                in_order: true,
                ..Inputs::default()
            });
        }
        twin.axes[0].known > 0.0
    };
    // A block has 16 samples, and both sides have three axes.
    let edge = (f64::from(1u32 << NOISE_SHIFT) * 16.0 * 1e-3).sqrt();
    for mean in [0.0, 0.04, -0.06] {
        assert!(filtered(mean, 0.98 * edge), "at rest: {mean}");
        assert!(!filtered(mean, 1.02 * edge), "moving: {mean}");
    }
}
