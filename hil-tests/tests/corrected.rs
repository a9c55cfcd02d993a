//! The correction through the image, over a link as a real board has one: written by the functions of `board correct`, read back,
//! and held against the rates as they were read.

use std::time::Duration;

use bench::{Fault, Scenario};
use hil_tests::{image, seed};
use imu_stand::correct::{Course, Noise, Proposed, Stage, in_use, judge, record};
use imu_stand::link::{DEFAULT_BAUD, Link};
use imu_stand::stand::{Board, Simulated, course, without_defects};
use model::ModelFile;
use model::record::Base;

/// Rest and length of the record, s.
const REST_S: f64 = 60.0;
const SECONDS: f64 = 300.0;
/// What is planted on gyro x and z, deg/s/degC.
const TEMPCO: [f64; 3] = [0.15, 0.0, -0.12];

/// What a perfect diagnosis would say of the stand.
fn truth(scenario: &Scenario) -> ModelFile {
    let mut text = ModelFile::paper().to_toml();
    for (gyro, slope) in ["x", "y", "z"].iter().zip(TEMPCO) {
        text += &format!(
            "[[effect]]\ncause = \"temperature\"\nchannels = [\"gyro_{gyro}\"]\nslope = {{ value = {slope:?}, unit = \"deg/s/degC\" }}\n"
        );
    }
    let mut model = ModelFile::parse(&text).expect("a model");
    for (channel, gyro) in model.channels.iter_mut().zip(&scenario.gyros) {
        for (key, value) in [
            ("angle_random_walk", gyro.angle_random_walk_deg_sqrt_h),
            ("rate_random_walk", gyro.rate_random_walk),
        ] {
            channel.baseline.get_mut(key).expect("it has one").value = value;
        }
    }
    model.excitation = [
        ("ambient_degc".to_owned(), 25.0),
        ("heater_degc".to_owned(), 30.0),
    ]
    .into();
    model
}

#[test]
fn the_image_corrects_what_a_model_says_and_comes_near_the_noise_alone() {
    let seed = seed();
    let mut scenario = Scenario::lively(seed);
    scenario.thermal.heater_c = 10.0;
    scenario.thermal.heater_period_s = 150.0;
    for gyro in [0, 2] {
        scenario = scenario.with(Fault::Tempco {
            gyro,
            dps_per_c: TEMPCO[gyro],
            dps_per_c2: 0.0,
        });
    }
    let course = Course {
        from: Duration::from_secs(20),
        seconds: SECONDS,
        steps: course(seed, REST_S, SECONDS),
        base: Base::Static,
    };
    let over = |scenario: &Scenario, model: &ModelFile| {
        let port = Simulated::start(Board::Image(image()), scenario.clone());
        let mut link = Link::over(Box::new(port), "the image", DEFAULT_BAUD);
        assert_eq!(in_use(&mut link).expect("it answers"), None);
        let proposed = Proposed::of(&mut link, model).expect("it answers");
        let proposed = proposed.expect("the model fits the board");
        proposed.write(&mut link).expect("it reads back");
        assert!(in_use(&mut link).expect("it answers").is_some());
        let again = Proposed::of(&mut link, model).expect("it answers");
        assert!(again.expect("it fits").changed.is_empty(), "it is there");
        record(&mut link, &course, |_| {}).expect("it records")
    };
    let model = truth(&scenario);
    let taken = over(&scenario, &model);
    let mut sound = model.clone();
    sound.effects.clear();
    let limit = over(&without_defects(&scenario, seed), &sound);
    assert!(taken.record.len() >= (SECONDS * 20.0) as usize);
    let (frames, rows) = (taken.corrected.len(), taken.record.len());
    println!("seed {seed}: {frames} corrected frames of {rows} samples");
    // Samples, replies to keep-alives and health frames go first.
    assert!(frames * 100 >= rows * 99, "{frames} of {rows}");
    let noise = [Noise::default(), Noise::default(), Noise::default()];
    let stage = Stage {
        what: "at rest",
        record: &taken.record,
        corrected: &taken.corrected,
        rest_s: REST_S,
        noise: &noise,
        truth: None,
        limit: Some(&limit.record),
    };
    let judged = judge(&stage, diagnosis::MATTERS);
    assert_eq!(judged.board.applied, 1.0);
    for row in &judged.rows {
        println!("seed {seed}: {row:?}");
        let limit = row.limit_deg.expect("it has one");
        // The thermometer is not the die: 0.15 of a lag of some s. Half more than the limit is not the planted error.
        assert!(row.after_deg <= 1.5 * limit, "{row:?}");
        // Of what was planted more than half is gone, where it stands out of the noise alone: one seed in some tens draws a walk
        // as large.
        let planted = row.channel != "gyro_y" && row.span_s == 100.0;
        if planted && row.before_deg > 1.5 * limit {
            let half = limit + 0.5 * (row.before_deg - limit);
            assert!(row.after_deg < half, "{row:?}");
        }
    }
    assert_eq!(judged.rows.len(), 6, "10 and 100 s");
}
