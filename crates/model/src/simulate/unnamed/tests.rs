use super::*;
use crate::parameter::Parameter;
use crate::unnamed::Column;
use crate::{ModelFile, simulate};

type Tested = Result<(), Box<dyn std::error::Error>>;

fn term(
    domain: Domain,
    channels: &[&str],
    follows: Option<&str>,
    columns: &[(&[f64], &str)],
) -> Unnamed {
    Unnamed {
        domain,
        channels: channels.iter().map(|c| (*c).to_owned()).collect(),
        follows: follows.map(str::to_owned),
        refines: None,
        rms: Parameter::exact(0.1, "deg/s"),
        columns: columns
            .iter()
            .map(|(v, u)| Column::new(v.to_vec(), u))
            .collect(),
    }
}

/// The paper's stand, its white noise times `noise`, with a term.
fn stand(noise: f64, unnamed: Unnamed) -> ModelFile {
    let mut model = ModelFile::paper();
    for channel in &mut model.channels {
        channel.lsb = None;
        for (name, p) in &mut channel.baseline {
            p.value *= if name == "angle_random_walk" {
                noise
            } else {
                0.0
            };
        }
    }
    model.unnamed = vec![unnamed];
    model
}

fn moments(x: &[f64]) -> [f64; 4] {
    let n = x.len() as f64;
    let mean = x.iter().sum::<f64>() / n;
    let about = |p: i32| x.iter().map(|v| (v - mean).powi(p)).sum::<f64>() / n;
    let variance = about(2);
    [
        mean,
        variance.sqrt(),
        about(3) / variance.powf(1.5),
        about(4) / variance.powi(2) - 3.0,
    ]
}

#[test]
fn levels_go_from_knot_to_knot_over_time_and_over_what_is_followed() -> Tested {
    let over_time: &[(&[f64], &str)] = &[(&[10.0, 30.0], "s"), (&[0.0, 2.0], "deg/s")];
    let model = stand(0.0, term(Domain::Mean, &["gyro_y"], None, over_time));
    let record = simulate(&model, 50.0, 20.0, 1)?;
    let y = &record.channel("gyro_y").ok_or("no gyro_y")?.values;
    for (second, level) in [(5, 0.0), (20, 1.0), (40, 2.0)] {
        assert!((y[second * 20] - level).abs() < 1e-4, "{second}");
    }
    assert!(record.channels[0].values.iter().all(|v| v.abs() < 1e-4));
    let over_duty: &[(&[f64], &str)] = &[(&[-255.0, 255.0], "1"), (&[-1.0, 1.0], "deg/s")];
    let model = stand(
        0.0,
        term(Domain::Channel, &["gyro_x"], Some("pwm"), over_duty),
    );
    let mut model = model;
    model.excitation.insert("motor_duty".into(), 0.8);
    let record = simulate(&model, 200.0, 20.0, 1)?;
    let duty = record.channel("pwm").ok_or("no pwm")?;
    assert!(duty.values.iter().any(|d| d.abs() > 10.0));
    let x = &record.channels[0].values;
    assert!(
        x.iter()
            .zip(&duty.values)
            .all(|(x, d)| (x - d / 255.0).abs() < 3e-3)
    );
    Ok(())
}

#[test]
fn bumps_have_their_sizes_and_factors_scale_the_variance() -> Tested {
    // 4000 s of a width of 1 Hz are some 6000 independent values of the variance: 2 % of it, and four of that allowed.
    let bumps: &[(&[f64], &str)] = &[
        (&[0.0, 4.0], "Hz"),
        (&[1.0, 1.0], "Hz"),
        (&[0.3, 0.4], "deg/s"),
    ];
    let model = stand(0.0, term(Domain::Spectrum, &["gyro_z"], None, bumps));
    let record = simulate(&model, 4000.0, 20.0, 2)?;
    let z = &record.channel("gyro_z").ok_or("no gyro_z")?.values;
    assert!(
        (moments(z)[1] / 0.5 - 1.0).abs() < 0.04,
        "{}",
        moments(z)[1]
    );
    let knots: &[(&[f64], &str)] = &[(&[0.0, 100.0], "s"), (&[1.0, 4.0], "1")];
    let model = stand(1.0, term(Domain::Variance, &["gyro_x"], None, knots));
    let record = simulate(&model, 4000.0, 20.0, 3)?;
    let x = &record.channels[0].values;
    let early = moments(&x[900..1100])[1];
    let late = moments(&x[4000..])[1];
    // Half way the factor is 2; 200 values tell their size to 5 %.
    assert!(
        (late / early / 2f64.sqrt() - 1.0).abs() < 0.2,
        "{late} {early}"
    );
    assert!((late / moments(&record.channels[1].values)[1] - 2.0).abs() < 0.02);
    Ok(())
}

#[test]
fn noise_comes_again_after_its_lag_and_at_no_other() -> Tested {
    let echo: &[(&[f64], &str)] = &[(&[0.35], "s"), (&[0.5], "deg/s"), (&[-1.0], "1")];
    let model = stand(0.0, term(Domain::Lag, &["gyro_y"], None, echo));
    let record = simulate(&model, 4000.0, 20.0, 5)?;
    let y = &record.channel("gyro_y").ok_or("no gyro_y")?.values;
    // 80 000 values tell the size to 0.3 % and a correlation to 0.004; four of that.
    assert!((moments(y)[1] / 0.5 - 1.0).abs() < 0.012);
    let energy: f64 = y.iter().map(|v| v * v).sum();
    for lag in 1..20 {
        let r = y.iter().zip(&y[lag..]).map(|(a, b)| a * b).sum::<f64>() / energy;
        let expected = if lag == 7 { -0.5 } else { 0.0 };
        assert!((r - expected).abs() < 0.016, "{lag}: {r}");
    }
    Ok(())
}

#[test]
fn axes_share_noise_and_the_white_noise_has_its_shape() -> Tested {
    let shape: &[(&[f64], &str)] = &[(&[0.3], "1"), (&[1.0], "1")];
    let model = stand(1.0, term(Domain::Codes, &["gyro_x"], None, shape));
    let record = simulate(&model, 10_000.0, 20.0, 4)?;
    let [_, size, skewness, kurtosis] = moments(&record.channels[0].values);
    let plain = moments(&record.channels[1].values);
    assert!((size / plain[1] - 1.0).abs() < 0.02);
    // 200 000 values: 0.0055 and 0.011 for normal ones, some three times that with such tails.
    assert!((skewness - 0.3).abs() < 0.06, "{skewness}");
    assert!((kurtosis - 1.0).abs() < 0.2, "{kurtosis}");
    assert!(plain[2].abs() < 0.03 && plain[3].abs() < 0.06);
    let shared: &[(&[f64], &str)] = &[(&[-0.3], "1")];
    let model = stand(
        1.0,
        term(Domain::Cross, &["gyro_x", "gyro_z"], None, shared),
    );
    let record = simulate(&model, 5000.0, 20.0, 5)?;
    let [x, z] = [0, 2].map(|k| &record.channels[k].values);
    let product: f64 = x.iter().zip(z).map(|(a, b)| a * b).sum();
    let r = product / x.len() as f64 / (moments(x)[1] * moments(z)[1]);
    assert!((r + 0.3).abs() < 0.015, "{r}");
    Ok(())
}

#[test]
fn what_cannot_be_is_refused() {
    let shared: &[(&[f64], &str)] = &[(&[0.6], "1")];
    let mut model = stand(
        1.0,
        term(Domain::Cross, &["gyro_x", "gyro_z"], None, shared),
    );
    model
        .unnamed
        .push(term(Domain::Cross, &["gyro_y", "gyro_x"], None, shared));
    let refused = simulate(&model, 10.0, 20.0, 1).map(|_| ());
    assert!(matches!(refused, Err(SimulateError::TooCorrelated { .. })));
    let over: &[(&[f64], &str)] = &[(&[0.0], "1"), (&[1.0], "deg/s")];
    let model = stand(1.0, term(Domain::Channel, &["gyro_x"], Some("mag_x"), over));
    let refused = simulate(&model, 10.0, 20.0, 1).map(|_| ());
    assert!(matches!(
        refused,
        Err(SimulateError::NothingToFollow { .. })
    ));
}
