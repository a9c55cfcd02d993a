//! The model file: what is written is read back, what is wrong is named with its line, and it simulates.

use model::ModelFile;
use model::effects::EFFECTS;
use model::file::EffectModel;
use model::parameter::Parameter;
use model::unnamed::{Column, Domain, Unnamed};

fn full() -> ModelFile {
    let mut model = ModelFile::paper();
    model.excitation.insert("heater_degc".into(), 6.0);
    for e in EFFECTS {
        let parameters = e
            .parameters()
            .iter()
            .map(|p| (p.name.to_owned(), Parameter::estimated(1.0, 0.125, p.unit)))
            .collect();
        model.effects.push(EffectModel {
            cause: e.id().into(),
            channels: vec!["gyro_y".into()],
            parameters,
        });
    }
    for domain in Domain::ALL {
        for follows in [None, Some("temp_y".to_owned())] {
            let over_channel = domain == Domain::Channel;
            if follows.is_some() != over_channel && domain != Domain::Variance {
                continue;
            }
            let columns = domain.columns(follows.is_some()).iter();
            let values = match domain {
                Domain::Cross | Domain::Codes => vec![0.125],
                Domain::Lag => vec![0.5, 1.0],
                _ => vec![0.5, 2.0, 4.0],
            };
            let column = |c: &model::unnamed::ColumnSpec| {
                Column::new(values.clone(), c.unit.unwrap_or("degC"))
            };
            model.unnamed.push(Unnamed {
                domain,
                channels: match domain {
                    Domain::Cross => vec!["gyro_x".into(), "gyro_z".into()],
                    _ => vec!["gyro_y".into()],
                },
                follows,
                refines: (domain == Domain::Spectrum).then(|| "wandering_line".to_owned()),
                rms: Parameter::estimated(0.25, 0.125, "deg/s"),
                columns: columns.map(column).collect(),
            });
        }
    }
    model
}

#[test]
fn what_is_written_is_read_back() {
    let model = full();
    assert_eq!(ModelFile::parse(&model.to_toml()), Ok(model));
}

#[test]
fn unknown_keys_units_and_effects_are_named_with_their_line() {
    let text = ModelFile::paper().to_toml();
    for (from, to, line, what) in [
        ("rate_hz", "rate_hertz", 3, "unknown key rate_hertz"),
        (
            "unit = \"deg/sqrt(h)\"",
            "unit = \"deg/h\"",
            8,
            "its unit is \"deg/sqrt(h)\"",
        ),
        ("lsb =", "lsbs =", 8, "unknown key lsbs"),
    ] {
        let error = ModelFile::parse(&text.replacen(from, to, 1)).expect_err(from);
        assert!(error.what.contains(what) && error.line >= line, "{error}");
    }
    let error = ModelFile::parse(&format!("{text}\n[[effect]]\ncause = \"gremlins\"\n"))
        .expect_err("gremlins");
    assert_eq!(error.line, text.lines().count() + 3, "{error}");
}

#[test]
fn what_is_wrong_with_an_unnamed_term_is_named_with_its_line() {
    let text = ModelFile::paper().to_toml();
    let rms = "rms = { value = 0.1, unit = \"deg/s\" }\n";
    let term = |lines: &str| format!("{text}\n[[unnamed]]\nchannels = [\"gyro_x\"]\n{rms}{lines}");
    let mean = "domain = \"mean\"\nlevel = { values = [1, 2], unit = \"deg/s\" }\n";
    for (text, what) in [
        (
            term("domain = \"soul\"\n"),
            "unknown domain soul; known are mean",
        ),
        (term(""), "needs a domain"),
        (term(mean), "needs time"),
        (
            term(&format!(
                "{mean}time = {{ values = [0, 1, 2], unit = \"s\" }}\n"
            )),
            "level has 2 values; expected 3",
        ),
        (
            term(&format!(
                "{mean}time = {{ values = [1, 1], unit = \"s\" }}\n"
            )),
            "time has to rise",
        ),
        (
            term(&format!(
                "{mean}time = {{ values = [0, 1], unit = \"h\" }}\n"
            )),
            "time is in \"h\"; its unit is \"s\"",
        ),
        (
            term(&format!("{mean}time = {{ values = [], unit = \"s\" }}\n")),
            "time has 0 values",
        ),
        (term(&format!("{mean}phase = 1\n")), "unknown key phase"),
        (
            term(&format!("{mean}follows = \"pwm\"\n")),
            "the domain mean follows no channel",
        ),
        (
            term("domain = \"channel\"\n"),
            "the domain channel needs follows",
        ),
        (
            term("domain = \"cross\"\ncorrelation = { values = [0.1], unit = \"1\" }\n"),
            "a term of two axes names 1 channels",
        ),
        (
            term("domain = \"codes\"\nskewness = { values = [9], unit = \"1\" }\n"),
            "skewness is 9",
        ),
        (
            term("domain = \"spectrum\"\nrefines = \"wandering_line\"\n"),
            "refines is \"wandering_line\"",
        ),
    ] {
        let error = ModelFile::parse(&text).expect_err(what);
        assert!(
            error.what.contains(what) && error.line > 1,
            "{what}: {error}"
        );
    }
}

#[test]
fn every_effect_has_an_id_of_its_own_a_page_and_rivals_that_exist() {
    for (i, e) in EFFECTS.iter().enumerate() {
        assert!(EFFECTS.iter().skip(i + 1).all(|o| o.id() != e.id()));
        assert!(
            !e.parameters().is_empty()
                && e.docs().physics.len() > 40
                && e.docs().remedy.ends_with('.')
                && e.docs().remedy.len() > 40,
            "{}",
            e.id()
        );
        assert!(
            e.rivals()
                .iter()
                .all(|r| model::effects::effect(r.cause).is_some()),
            "{}",
            e.id()
        );
    }
}

#[test]
fn a_run_is_the_same_from_the_same_seed_and_has_the_stated_noise() {
    let model = ModelFile::paper();
    let one = model::simulate(&model, 600.0, 20.0, 7).expect("a run");
    assert_eq!(one, model::simulate(&model, 600.0, 20.0, 7).expect("a run"));
    let x = &one.channels[0].values;
    let half_mean_square =
        x.windows(2).map(|w| (w[1] - w[0]).powi(2)).sum::<f64>() / (2.0 * (x.len() - 1) as f64);
    // 5.27 deg/sqrt(h) at 20 Hz is 0.393 deg/s; the quantisation adds lsb^2 / 12.
    let sigma = (5.27f64 / 60.0 * 20f64.sqrt()).hypot(0.07326 / 12f64.sqrt());
    assert!((half_mean_square.sqrt() / sigma - 1.0).abs() < 0.04);
    assert!(
        one.flags
            .as_ref()
            .is_some_and(|f| f.iter().all(|f| *f == 7))
    );
}

#[test]
fn a_channel_without_a_step_is_not_rounded() {
    let mut model = ModelFile::paper();
    for c in &mut model.channels {
        c.lsb = None;
        if let Some(p) = c.baseline.get_mut("angle_random_walk") {
            p.value = 0.01;
        }
    }
    // 0.01 deg/sqrt(h) at 20 Hz is 7.5e-4 deg/s, a hundredth of the stand's step: rounded to it, readings would be equal.
    let record = model::simulate(&model, 100.0, 20.0, 3).expect("a record");
    let y = &record.channel("gyro_x").expect("gyro_x").values;
    let equal = y.windows(2).filter(|w| w[0] == w[1]).count();
    assert!(equal < 10, "{equal} of {} repeat", y.len());
}

#[test]
fn what_no_stand_has_is_refused_with_its_line() {
    let paper = ModelFile::paper().to_toml();
    let effect = |text: &str| format!("{paper}\n[[effect]]\n{text}\n");
    let excitation = |text: &str| format!("{paper}\n[excitation]\n{text}\n");
    let first = |from: &str, to: &str| paper.replacen(from, to, 1);
    for (text, what) in [
        (
            excitation("motor_duty = 5"),
            "motor_duty is 5; it has to be from 0 to 1",
        ),
        (excitation("heater_period_s = 0"), "heater_period_s is 0"),
        (
            effect("cause = \"low_pass\"\nlag1_correlation = { value = 5, unit = \"1\" }"),
            "from -1 to 1",
        ),
        (
            effect(
                "cause = \"stuck_bit\"\nbit = { value = 99, unit = \"1\" }\nvalue = { value = 1, unit = \"1\" }\n\
                 fraction = { value = 1, unit = \"1\" }",
            ),
            "bit is 99; it has to be a whole number from 0 to 13",
        ),
        (
            effect("cause = \"coarse_lsb\"\nmissing_bits = { value = 200, unit = \"1\" }"),
            "missing_bits is 200",
        ),
        (
            effect("cause = \"outliers\"\ncount = { value = 1e18, unit = \"1\" }"),
            "count is 1",
        ),
        (
            effect("cause = \"dropped_samples\"\ncount = { value = -1, unit = \"1\" }"),
            "count is -1",
        ),
        (
            effect(
                "cause = \"telegraph\"\nhalf_height = { value = 1, unit = \"deg/s\" }\n\
                 dwell_time = { value = 1e-300, unit = \"s\" }",
            ),
            "dwell_time is",
        ),
        (first("lsb = 0.07326", "lsb = -1"), "lsb is -1"),
        (first("lsb = 0.07326", "lsb = 1e300"), "lsb is 1"),
        (
            first(
                "value = 0.0, unit = \"deg/s\"",
                "value = 1e308, unit = \"deg/s\"",
            ),
            "bias is 1",
        ),
        (
            first("value = 5.27", "value = -5.27"),
            "angle_random_walk is -5.27; it has to be from 0",
        ),
        (first("rate_hz = 20.0", "rate_hz = 1e300"), "rate_hz is 1"),
        (first("gyro_y", "gyro_x"), "a second channel gyro_x"),
        (
            effect("cause = \"clock_rate\"\nppm = { value = 1, unit = \"ppm\" }")
                + &"[[effect]]\ncause = \"clock_rate\"\nppm = { value = 1, unit = \"ppm\" }\n"
                    .repeat(1000),
            "more than 1000 effects",
        ),
    ] {
        let error = ModelFile::parse(&text).expect_err(what);
        assert!(
            error.what.contains(what) && error.line > 1,
            "{what}: {error}"
        );
    }
}
