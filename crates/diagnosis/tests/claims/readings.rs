//! Readings that are held, smoothed or lost.

use super::*;

#[test]
fn a_reading_that_is_held_until_the_next_is_far_is_no_stale_sample() {
    graded("hysteresis of the converter", |run, rng| {
        let mut r = record(&[], 5700 + run);
        let counts = Uniform::new(1.5, 3.0).expect("a range").sample(rng) * 0.07326;
        let c = r.channels.iter_mut().find(|c| c.name == "gyro_y");
        let mut held = f64::NAN;
        for v in &mut c.expect("a channel").values {
            if (*v - held).abs() < counts {
                *v = held;
            }
            held = *v;
        }
        let d = told(&r);
        let until =
            |u: &diagnosis::result::Unexplained| u.channel == "gyro_y" && u.says("held until");
        let right = named(&d).is_empty() && d.unexplained.iter().any(until);
        right.then_some(()).ok_or_else(|| said(&d))
    });
}

#[test]
fn frames_in_which_one_axis_holds_the_reading_of_another_are_told() {
    graded("words read twice", |run, rng| {
        let mut r = record(&[], 5800 + run);
        let share = Uniform::new(0.1, 0.3).expect("a range").sample(rng);
        let of = |r: &Record, name: &str| {
            let c = r.channels.iter().position(|c| c.name == name);
            c.expect("a channel")
        };
        let (x, y) = (of(&r, "gyro_x"), of(&r, "gyro_y"));
        // Biases alike, so that a copy is no far reading.
        let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
        let lsb = 0.07326;
        let off = mean(&r.channels[x].values) - mean(&r.channels[y].values);
        let off = (off / lsb).round() * lsb;
        for i in 0..r.channels[y].values.len() {
            r.channels[y].values[i] += off;
            if Uniform::new(0.0, 1.0).expect("a range").sample(rng) < share {
                r.channels[y].values[i] = r.channels[x].values[i];
            }
        }
        for c in &mut r.channels[..=x.max(y)] {
            let counts = c.values.iter().map(|v| (v / lsb).round() as i32);
            c.counts = c.lsb.filter(|l| *l == lsb).map(|_| counts.collect());
        }
        let d = told(&r);
        let holds = |u: &diagnosis::result::Unexplained| u.says("one holds the other's");
        let right = d.unexplained.iter().any(holds);
        right.then_some(()).ok_or_else(|| said(&d))
    });
}

#[test]
fn readings_that_are_smoothed_while_little_happens_are_not_stale() {
    graded("a filter that lets large changes through", |run, rng| {
        let mut r = record(&[], 6200 + run);
        let c = r.channels.iter_mut().find(|c| c.name == "gyro_z");
        let c = c.expect("a channel");
        let large = Uniform::new(0.3, 0.5).expect("a range").sample(rng);
        let mut held = c.values[0];
        for v in &mut c.values {
            let change = *v - held;
            // The larger the change, the more of it.
            held += change * (1.0 - 0.8 * (-(change / large).powi(2)).exp());
            *v = (held / 0.07326).round() * 0.07326;
        }
        c.counts = None;
        let d = told(&r);
        let stale = named(&d).iter().any(|n| n.0 == "stale_samples");
        (!stale).then_some(()).ok_or_else(|| said(&d))
    });
}

/// A sixth of the readings, in one hole, once made what was found a sixth smaller.
#[test]
fn a_hole_makes_nothing_smaller() {
    let amplitude = 0.1;
    let sizes: Vec<f64> = (0..RUNS)
        .map(|run| {
            let mut r = record(&[], 6400 + run);
            let pitch = 0.11 + 0.013 * run as f64;
            let c = r.channels.iter_mut().find(|c| c.name == "gyro_y");
            let c = c.expect("a channel");
            // Rounded again, a line of one step would be another one.
            (c.counts, c.lsb) = (None, None);
            for (i, v) in c.values.iter_mut().enumerate() {
                *v += amplitude * (TAU * pitch * i as f64).sin();
            }
            let from = 2000 + 700 * run as usize;
            c.values[from..from + 2000].fill(f64::NAN);
            let d = told(&r);
            let line = d.findings.iter().find(|f| f.cause == "line");
            let line = line.unwrap_or_else(|| panic!("run {run}: {}", said(&d)));
            line.parameters["amplitude"].value / amplitude
        })
        .collect();
    let mean = sizes.iter().sum::<f64>() / sizes.len() as f64;
    // One is off by a twentieth, the mean of eight by 0.018.
    assert!((mean - 1.0).abs() < 0.06, "{mean}: {sizes:?}");
}

/// Frames lost one by one, a fifth of them: what they were filled with once made a filter a process beside white noise, a
/// process slower, and what the axes share weaker by a tenth.
#[test]
fn frames_lost_at_random_make_no_noise_weaker() {
    let effect = |cause: &str, channel: &str, of: &[(&str, f64, &str)]| EffectModel {
        cause: cause.into(),
        channels: vec![channel.into()],
        parameters: (of.iter())
            .map(|(k, v, unit)| ((*k).to_owned(), Parameter::exact(*v, unit)))
            .collect(),
    };
    let mut model = ModelFile::paper();
    model.effects = vec![
        effect("low_pass", "gyro_x", &[("lag1_correlation", 0.2, "1")]),
        effect(
            "gauss_markov",
            "gyro_y",
            &[("sigma", 0.2, "deg/s"), ("correlation_time", 2.0, "s")],
        ),
    ];
    let mut ratios: [Vec<f64>; 3] = Default::default();
    // Three standard errors of the mean of eight, of which one is off by 7, 4 and 15 %.
    let truths = [
        ("low_pass", "gyro_x", "lag1_correlation", 0.2, 0.08),
        ("gauss_markov", "gyro_y", "sigma", 0.2, 0.045),
        ("gauss_markov", "gyro_y", "correlation_time", 2.0, 0.16),
    ];
    for run in 0..RUNS {
        let mut r = model::simulate(&model, 600.0, 20.0, 6500 + run).expect("a run");
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(6500 + run);
        let chance = Uniform::new(0.0, 1.0).expect("a range");
        for i in 0..r.len() {
            if chance.sample(&mut rng) < 0.2 {
                r.channels.iter_mut().for_each(|c| c.values[i] = f64::NAN);
            }
        }
        let d = told(&r);
        for ((cause, channel, name, truth, _), ratios) in truths.iter().zip(&mut ratios) {
            let own = |f: &&Finding| f.cause == *cause && f.channels.iter().any(|c| c == channel);
            let found = d.findings.iter().find(own);
            ratios.extend(found.map(|f| {
                let all = f.per_channel.get(*channel).unwrap_or(&f.parameters);
                all[*name].value / truth
            }));
        }
    }
    for ((cause, _, name, _, off), ratios) in truths.iter().zip(&ratios) {
        let count = ratios.len() as u64;
        assert!(count >= LEAST, "{cause}: {count} of {RUNS}");
        let mean = ratios.iter().sum::<f64>() / count as f64;
        assert!(
            (mean - 1.0).abs() < *off,
            "{cause} {name}: {mean} {ratios:?}"
        );
    }
}
