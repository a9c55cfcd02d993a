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
        matrix: [[0.01, 0.124, -0.03], [0.0; 3], [-0.02, 0.0, 0.001]],
        noise: [0.0096, 0.2, 1e-4],
        walk: [8e-7, 2e-5, 0.0],
        ..Correction::default()
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
    }
}

#[test]
fn what_does_not_fit_is_refused_by_name() {
    let too_much = Correction {
        temperature: [0.0, 0.04, 0.0],
        ..Correction::default()
    };
    let error = too_much.numbers().unwrap_err();
    assert_eq!(error.place, 16);
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
