use std::collections::BTreeMap;

use diagnosis::result::{Alternative, Consequence, Gain};

use super::*;

fn finding(cause: &str, parameters: &[(&str, f64, Option<f64>, &str)]) -> Finding {
    Finding {
        cause: cause.into(),
        channels: vec!["gyro_x".into()],
        parameters: parameters
            .iter()
            .map(|(name, value, std_error, unit)| {
                let p = Parameter {
                    value: *value,
                    std_error: *std_error,
                    unit: (*unit).into(),
                };
                ((*name).to_owned(), p)
            })
            .collect(),
        ..Finding::default()
    }
}

#[test]
fn a_mean_is_told_by_its_readings_and_no_correlation_beside_them() {
    let mean = |stages: f64| {
        let all = [
            ("averaged", 6.0, None, "samples"),
            ("half_power", 4.44, None, "Hz"),
            ("lag1_correlation", 0.974, None, "1"),
            ("stages", stages, None, "1"),
        ];
        finding("low_pass", &all)
    };
    let said = headline(&mean(3.0));
    assert!(
        said.ends_with("averaged 6 samples; stages 3; half power 4.44 Hz"),
        "{said}"
    );
    let listed: Vec<_> = listed(&mean(1.0))
        .into_iter()
        .map(|(name, _)| name.clone())
        .collect();
    assert_eq!(listed, ["averaged", "half_power"]);
}

#[test]
fn an_interval_ends_where_its_parameter_does() {
    let f = finding(
        "stuck_bit",
        &[
            ("fraction", 1.0, Some(0.000_66), "1"),
            ("spread", 0.0, Some(0.0077), "deg/s"),
        ],
    );
    let of = |name: &str| size(name, &f.parameters[name]).replace('\u{a0}', " ");
    assert_eq!(of("fraction"), "1.0000 (95 %: 0.9987 to 1.0000)");
    assert_eq!(of("spread"), "0.000 deg/s (95 %: 0.000 to 0.015)");
}

#[test]
fn a_value_without_an_error_has_three_digits_and_says_that_it_has_no_interval() {
    let said = |value: f64, unit: &str| {
        let p = Parameter {
            value,
            std_error: None,
            unit: unit.into(),
        };
        [with_interval(&p), level(&p)].map(|s| s.replace('\u{a0}', " "))
    };
    let k = "0.000126 deg/s/sqrt(s) (no interval from this record)";
    assert_eq!(said(0.000_126_444, "deg/s/sqrt(s)"), [k, k]);
    let time = "43211 s (no interval from this record)";
    assert_eq!(said(43_210.6, "s"), [time, time]);
    // A reference is a setting.
    let reference = Parameter {
        value: 20.0,
        std_error: None,
        unit: "degC".into(),
    };
    assert_eq!(
        found_size("temperature_quadratic", "reference", &reference),
        "20 degC"
    );
    // A count is exact, and so is a code.
    assert_eq!(said(1234.0, "1"), ["1234", "1234"]);
    assert_eq!(said(-8192.0, "counts"), ["-8192 counts", "-8192 counts"]);
}

#[test]
fn the_headline_says_where_what_and_how_large_with_its_interval() {
    let f = finding(
        "temperature",
        &[("slope", -0.130_8, Some(0.002_8), "deg/s/degC")],
    );
    assert_eq!(
        headline(&f).replace('\u{a0}', " "),
        "gyro_x: Bias follows temperature (temperature), slope -0.1308 deg/s/degC (95 %: -0.1363 to -0.1253)"
    );
}

#[test]
fn parameters_come_as_their_effect_lists_them_and_no_name_is_its_unit() {
    let times = [("end", 9.0, None, "s"), ("start", 4.0, None, "s")];
    let f = finding("noise_change", &times);
    let said = headline(&f);
    let said = said.replace('\u{a0}', " ");
    let none = "(no interval from this record)";
    assert!(
        said.ends_with(&format!("start 4 s {none}; end 9 s {none}")),
        "{said}"
    );
    let f = finding("clock_rate", &[("ppm", 417.4, None, "ppm")]);
    assert!(
        headline(&f).contains("(clock_rate), 417 ppm (no"),
        "{}",
        headline(&f)
    );
}

#[test]
fn what_is_otherwise_on_other_channels_is_said_and_what_feels_the_same() {
    let sizes = |rms: f64, with: &str| {
        let error = Some(0.001);
        let phase = format!("phase_to_{}", &with["with_".len()..]);
        let all = [
            ("rms", rms, error, "deg/s"),
            (with, 0.97, error, "1"),
            (&phase, 0.3, error, "rad"),
        ];
        finding("narrow_band", &all).parameters
    };
    let mut f = Finding {
        parameters: sizes(0.03, "with_acc_y"),
        ..finding("narrow_band", &[])
    };
    let alone = "One source shakes it, which acc_y reads too: coherence at least 0.97.";
    assert_eq!(elsewhere(&f).as_deref(), Some(alone));
    f.channels.push("gyro_z".into());
    f.per_channel = BTreeMap::from([
        ("gyro_x".to_owned(), f.parameters.clone()),
        ("gyro_z".to_owned(), sizes(0.05, "with_gyro_x")),
    ]);
    let both = "That is on gyro_x; on gyro_z rms 0.0500 deg/s (95\u{a0}%: 0.0480 to 0.0520). One source shakes them, which acc_y reads too: coherence at least 0.97.";
    assert_eq!(elsewhere(&f).as_deref(), Some(both));
    assert_eq!(elsewhere(&finding("temperature", &[])), None);
}

#[test]
fn a_switch_is_no_size() {
    let f = finding(
        "motor_noise",
        &[
            ("by_magnitude", 1.0, None, "1"),
            ("variance_increase_at_full_duty", 2.9, Some(0.18), "1"),
        ],
    );
    let said = headline(&f).replace('\u{a0}', " ");
    assert!(!said.contains("magnitude"), "{said}");
    assert!(
        said.ends_with("variance increase at full duty 2.90 (95 %: 2.55 to 3.25)"),
        "{said}"
    );
}

#[test]
fn the_cost_names_the_longest_horizon_first_and_a_small_one_is_called_small() {
    let mut f = finding("temperature", &[]);
    assert_eq!(cost(&f), None);
    let angle = |pairs: &[(&str, [f64; 2])]| {
        let each = pairs.iter().map(|(k, v)| ((*k).to_owned(), *v));
        Some(Gain {
            angle_rms_deg: each.collect::<BTreeMap<_, _>>(),
            ..Gain::default()
        })
    };
    f.gain = angle(&[("10s", [0.378, 0.214]), ("100s", [17.4, 1.35])]);
    assert_eq!(
        cost(&f).unwrap(),
        "Left out, the integrated angle is off by 17 deg rms after 100 s instead of 1.4, 0.38 deg rms after 10 s instead of 0.21."
    );
    f.gain = angle(&[("10s", [0.300, 0.299]), ("100s", [1.35, 1.34])]);
    assert_eq!(
        cost(&f).unwrap(),
        "Left out, it changes the integrated angle by less than 5 % over 10 s and 100 s."
    );
    f.gain = angle(&[("10s", [f64::NAN, 0.3])]);
    assert_eq!(cost(&f), None);
}

#[test]
fn what_is_left_open_is_said_with_the_experiment_that_decides() {
    let mut f = finding("gauss_markov", &[]);
    assert_eq!(open_question(&f), None);
    f.alternatives = vec![Alternative {
        cause: "flicker".into(),
        log_odds: -1.0,
    }];
    f.experiment = Some("a longer record.".into());
    assert_eq!(
        open_question(&f).unwrap(),
        "This record cannot tell it from flicker. To decide: a longer record."
    );
}

#[test]
fn a_count_and_its_interval_are_whole_numbers() {
    let of = |value: f64, error: Option<f64>| {
        let f = finding("stale_samples", &[("count", value, error, "1")]);
        (headline(&f).replace('\u{a0}', " "), brief(&f))
    };
    let (line, short) = of(1774.0, Some(0.0172));
    assert!(line.ends_with(", count 1774"), "{line}");
    assert_eq!(short, "stale_samples on gyro_x 1774");
    let (line, _) = of(1714.0, Some(1.26));
    assert!(line.ends_with("count 1714 (95 %: 1712 to 1716)"), "{line}");
    assert!(of(2.0, Some(1.5)).0.ends_with("count 2 (95 %: 0 to 5)"));
    assert!(of(30.0, None).0.ends_with("count 30"));
}

#[test]
fn a_limit_is_told_once() {
    let changed = |largest_change: f64| Consequence {
        largest_change,
        ..Consequence::default()
    };
    let said = consequence_of(&changed(3e-5), true);
    assert!(said.ends_with("a deviation by less than 0.01 %."), "{said}");
    let said = consequence_of(&changed(0.12), true);
    assert!(said.ends_with("a deviation by up to 12 %."), "{said}");
}

#[test]
fn nobody_asks_again_what_the_base_did() {
    let f = finding("base_motion", &[("peak", 3.0, None, "deg/s")]);
    let said = remedy(&f, None).expect("a remedy");
    assert!(said.ends_with("--base static."), "{said}");
    let said = remedy(&f, Some(Base::Moving)).expect("a remedy");
    assert!(
        said.contains("does not move") && !said.contains("--base"),
        "{said}"
    );
}

#[test]
fn the_largest_lines_of_an_entry_are_listed_with_intervals_and_the_others_counted() {
    let line = |hz: f64| {
        let p = |value, error, unit| Parameter::estimated(value, error, unit);
        Parameters::from([
            ("amplitude".to_owned(), p(0.5, 0.01, "deg/s")),
            ("frequency".to_owned(), p(hz, 1e-5, "Hz")),
        ])
    };
    let left = |count: u32| Unexplained {
        lines: (1..=count).map(|k| line(8.5 * f64::from(k))).collect(),
        ..Unexplained::default()
    };
    assert_eq!(lines(&left(0)), None);
    let one = "Amplitudes: 0.500 deg/s (95\u{a0}%: 0.480 to 0.520) at 8.5000 Hz.";
    assert_eq!(lines(&left(1)).as_deref(), Some(one));
    assert!(lines(&left(6)).is_some_and(|text| text.ends_with(" at 34.0000 Hz, and 2 smaller.")));
}

#[test]
fn what_is_taken_off_an_accelerometer_is_no_rate() {
    for cause in [
        "temperature",
        "temperature_quadratic",
        "supply_sensitivity",
        "g_sensitivity",
    ] {
        let mut f = finding(cause, &[("slope", 3e-3, None, "m/s^2/degC")]);
        assert!(remedy(&f, None).expect(cause).contains("from the rate"));
        f.channels = vec!["acc_x".to_owned(), "acc_z".to_owned()];
        let said = remedy(&f, None).expect(cause);
        assert!(
            said.contains("from the acceleration") && !said.contains("rate,"),
            "{said}"
        );
    }
}
