//! What a name has to hold, and what is told where none does: effects that no cause of the library makes are hidden in
//! simulated runs, and causes where they were lost before.

mod graded;

use std::f64::consts::TAU;

use diagnosis::result::Finding;
use graded::{LEAST, RUNS, add, graded, graded_over, named, record, said, told, values};
use model::file::EffectModel;
use model::record::{Base, Quantity, Record};
use model::{ModelFile, Parameter};
use rand_core::SeedableRng;
use rand_distr::{Distribution, Exp1, StandardNormal, Uniform};
use rand_xoshiro::Xoshiro256PlusPlus;

#[test]
fn a_large_step_is_a_step_wherever_it_lies() {
    graded("a step of 2..4 deg/s", |run, rng| {
        let mut r = record(&[], 5100 + run);
        let height = Uniform::new(2.0, 4.0).expect("a range").sample(rng);
        // Any place in the blocks of four samples in which two levels are weighed.
        let at = Uniform::new(2000usize, 10_000)
            .expect("a range")
            .sample(rng);
        add(&mut r, "gyro_x", |i| if i >= at { height } else { 0.0 });
        let d = told(&r);
        let right = named(&d) == [("bias_step", "gyro_x")] && d.unexplained.is_empty();
        right
            .then_some(())
            .ok_or_else(|| format!("{height} at {at}: {}", said(&d)))
    });
}

#[test]
fn a_response_to_changes_of_the_supply_alone_gets_no_name() {
    graded("a supply behind a high-pass", |run, rng| {
        let mut r = record(&[("supply_load_v", 0.05)], 5200 + run);
        let supply = values(&r, Quantity::Supply);
        let tau = Uniform::new(0.5, 4.0).expect("a range").sample(rng) * 20.0;
        let mut followed = supply[0];
        let changes: Vec<f64> = supply
            .iter()
            .map(|u| {
                followed += (u - followed) / tau;
                u - followed
            })
            .collect();
        let rms = (changes.iter().map(|v| v * v).sum::<f64>() / changes.len() as f64).sqrt();
        add(&mut r, "gyro_y", |i| 0.15 * changes[i] / rms);
        let d = told(&r);
        let follows = d.unexplained.iter().any(|u| u.channel == "gyro_y");
        let right = named(&d).is_empty() && follows;
        right.then_some(()).ok_or_else(|| said(&d))
    });
}

#[test]
fn a_bias_late_behind_its_thermometer_is_no_line() {
    graded("a bias behind its thermometer", |run, rng| {
        let period = Uniform::new(50.0, 150.0).expect("a range").sample(rng);
        let mut r = record(
            &[("heater_degc", 6.0), ("heater_period_s", period)],
            5250 + run,
        );
        let warmth = values(&r, Quantity::Temp);
        let late = Uniform::new(0.1, 0.3).expect("a range").sample(rng) * period * 20.0;
        let mut followed = warmth[0];
        let behind: Vec<f64> = warmth
            .iter()
            .map(|t| {
                followed += (t - followed) / late;
                followed
            })
            .collect();
        let slope = Uniform::new(0.2, 0.5).expect("a range").sample(rng);
        add(&mut r, "gyro_x", |i| slope * behind[i]);
        let d = told(&r);
        let line = named(&d).contains(&("line", "gyro_x"));
        let seen = !named(&d).is_empty() || !d.unexplained.is_empty();
        (seen && !line)
            .then_some(())
            .ok_or_else(|| format!("{period} s, {late}: {}", said(&d)))
    });
}

#[test]
fn noise_below_half_a_step_whose_level_drifts_is_no_effect() {
    graded("three axes of coarse readings", |run, rng| {
        let mut model = ModelFile::paper();
        let share: f64 = Uniform::new(0.28, 0.45).expect("a range").sample(rng);
        // N holds the rounding too (docs/model-file.md): `share` is of the noise before the converter.
        let read = share.hypot(1.0 / 12f64.sqrt());
        for c in &mut model.channels {
            let step = c.lsb.expect("a step");
            let walk = Uniform::new(0.2, 1.0).expect("a range").sample(rng) * step;
            for (name, value) in [
                ("angle_random_walk", read * step * 60.0 / 20f64.sqrt()),
                ("rate_random_walk", walk / 600f64.sqrt()),
            ] {
                c.baseline.get_mut(name).expect("a parameter").value = value;
            }
        }
        let r = model::simulate(&model, 600.0, 20.0, 5260 + run).expect("a run");
        let d = told(&r);
        let clean = named(&d).is_empty() && d.unexplained.is_empty();
        clean
            .then_some(())
            .ok_or_else(|| format!("{share} steps: {}", said(&d)))
    });
}

#[test]
fn an_axis_that_another_leaks_into_a_frame_later_is_told() {
    graded("a leak by one frame", |run, rng| {
        let mut r = record(&[], 5300 + run);
        let from: Vec<f64> = {
            let c = r.channels.iter().find(|c| c.name == "gyro_z");
            c.expect("a channel").values.clone()
        };
        let mean = from.iter().sum::<f64>() / from.len() as f64;
        let share = Uniform::new(0.15, 0.4).expect("a range").sample(rng);
        add(&mut r, "gyro_x", |i| {
            share * (from[i.saturating_sub(1)] - mean)
        });
        let d = told(&r);
        let late = |u: &diagnosis::result::Unexplained| {
            u.channel == "gyro_x" && u.says("gyro_z by 1 samples")
        };
        let right = named(&d).is_empty() && d.unexplained.iter().any(late);
        right.then_some(()).ok_or_else(|| said(&d))
    });
}

#[test]
fn what_comes_again_every_few_samples_is_told() {
    graded("levels that repeat", |run, rng| {
        let mut r = record(&[], 5400 + run);
        let period = Uniform::new(20usize, 200).expect("a range").sample(rng);
        let levels: Vec<f64> = (0..period).map(|_| StandardNormal.sample(rng)).collect();
        add(&mut r, "gyro_y", |i| 0.1 * levels[i % period]);
        let d = told(&r);
        let right = d.unexplained.iter().any(|u| u.channel == "gyro_y");
        right
            .then_some(())
            .ok_or_else(|| format!("{period}: {}", said(&d)))
    });
}

#[test]
fn a_slow_cause_on_an_axis_at_rest_is_named_while_the_table_turns_another() {
    graded("a ramp beside a turning axis", |run, rng| {
        let mut r = record(&[], 5500 + run);
        r.header.base = Some(Base::Turntable);
        let speed = Uniform::new(5.0, 20.0).expect("a range").sample(rng);
        let rms = Uniform::new(0.5, 0.8).expect("a range").sample(rng);
        add(&mut r, "gyro_z", |i| {
            speed * (TAU * i as f64 / 20.0 / 37.0).sin().signum()
        });
        // A straight line of that rms about its mean.
        add(&mut r, "gyro_x", |i| {
            rms * 12f64.sqrt() * (i as f64 / 12_000.0 - 0.5)
        });
        let d = told(&r);
        let right = named(&d) == [("rate_ramp", "gyro_x")] && d.unexplained.is_empty();
        right.then_some(()).ok_or_else(|| said(&d))
    });
}

#[test]
fn a_step_beside_a_line_that_wanders_keeps_its_name() {
    graded("a step beside a driven mode", |run, rng| {
        let mut r = record(&[], 5600 + run);
        let (f, half_width) = (
            Uniform::new(4.0, 8.0).expect("a range").sample(rng),
            Uniform::new(0.004, 0.01).expect("a range").sample(rng),
        );
        // A circle that turns, fades and is driven at random; 0.3 deg/s rms.
        let keep = (-TAU * half_width / 20.0).exp();
        let (mut a, mut b) = (0.3, 0.0);
        let mode: Vec<f64> = (0..12_000)
            .map(|_| {
                let (s, c) = (TAU * f / 20.0).sin_cos();
                let mut drive = || -> f64 {
                    let e: f64 = StandardNormal.sample(rng);
                    0.3 * (1.0 - keep * keep).sqrt() * e
                };
                (a, b) = (
                    keep * (a * c - b * s) + drive(),
                    keep * (a * s + b * c) + drive(),
                );
                a
            })
            .collect();
        add(&mut r, "gyro_z", |i| {
            mode[i] + if i >= 7003 { 0.4 } else { 0.0 }
        });
        let d = told(&r);
        let right = named(&d).contains(&("bias_step", "gyro_z"));
        right.then_some(()).ok_or_else(|| said(&d))
    });
}

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
fn noise_of_another_slope_is_no_bias_that_comes_back() {
    graded("fractional noise beside the white one", |run, rng| {
        let mut r = record(&[], 5900 + run);
        let order = Uniform::new(0.25, 0.35).expect("a range").sample(rng);
        let n = r.len();
        // (1 - B)^-order of white noise.
        let mut weights = vec![1.0; n];
        for k in 1..n {
            weights[k] = weights[k - 1] * (k as f64 - 1.0 + order) / k as f64;
        }
        let drive: Vec<f64> = (0..n).map(|_| StandardNormal.sample(rng)).collect();
        let noise: Vec<f64> = (0..n)
            .map(|i| {
                let past = weights.iter().zip(drive[..=i].iter().rev());
                0.4 * past.map(|(w, e)| w * e).sum::<f64>()
            })
            .collect();
        add(&mut r, "gyro_x", |i| noise[i]);
        let d = told(&r);
        let seen = (d.unexplained.iter())
            .any(|u| u.channel == "gyro_x" && u.says("falls with the frequency"));
        // Flicker noise is its nearest relative.
        let other = named(&d).iter().any(|n| n.0 != "flicker");
        (seen && !other).then_some(()).ok_or_else(|| said(&d))
    });
}

#[test]
fn a_tone_whose_pitch_wanders_and_a_mode_that_noise_drives_have_names_of_their_own() {
    let wide =
        |rng: &mut Xoshiro256PlusPlus| TAU * Uniform::new(0.1, 0.4).expect("a range").sample(rng);
    graded("a tone whose phase walks", |run, rng| {
        let mut r = record(&[], 6000 + run);
        let mut phase = 0.0;
        let step = wide(rng);
        let tone: Vec<f64> = (0..r.len())
            .map(|_| {
                let e: f64 = StandardNormal.sample(rng);
                phase += step + 0.05 * e;
                0.25 * phase.cos()
            })
            .collect();
        add(&mut r, "gyro_y", |i| tone[i]);
        let d = told(&r);
        let right = named(&d) == [("wandering_line", "gyro_y")];
        right.then_some(()).ok_or_else(|| said(&d))
    });
    graded("a mode that noise drives", |run, rng| {
        let mut r = record(&[], 6100 + run);
        let (omega, decay) = (wide(rng), 1.0 / 300.0f64);
        let (a, b) = (2.0 * (-decay).exp() * omega.cos(), (-2.0 * decay).exp());
        let (mut x, mut before) = (0.0, 0.0);
        let mode: Vec<f64> = (0..r.len())
            .map(|_| {
                let e: f64 = StandardNormal.sample(rng);
                (x, before) = (a * x - b * before + e, x);
                x
            })
            .collect();
        let rms = (mode.iter().map(|v| v * v).sum::<f64>() / mode.len() as f64).sqrt();
        add(&mut r, "gyro_y", |i| 0.18 * mode[i] / rms);
        let d = told(&r);
        let right = named(&d) == [("narrow_band", "gyro_y")];
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

#[test]
fn a_filter_and_a_process_beside_it_are_told_as_both() {
    let mut model = ModelFile::paper();
    let mut planted = |cause: &str, parameter: &str, value: f64, unit: &str| {
        let parameter = (parameter.to_owned(), Parameter::exact(value, unit));
        model.effects.push(EffectModel {
            cause: cause.into(),
            channels: vec!["gyro_y".into()],
            parameters: [parameter].into(),
        });
    };
    planted("low_pass", "lag1_correlation", 0.4, "1");
    planted("flicker", "bias_instability", 450.0, "deg/h");
    // Right in 95 of 100: 20 of 24 are reached in 99 of 100 tries.
    graded_over((24, 20), "a filter beside flicker noise", |run, _| {
        let r = model::simulate(&model, 1200.0, 20.0, 6300 + run).expect("a run");
        let d = told(&r);
        // Where the record leaves it open, flicker stands among the alternatives of the process.
        let tells = |cause: &str| {
            d.findings.iter().any(|f| {
                f.cause == cause || f.alternatives.iter().any(|other| other.cause == cause)
            })
        };
        let right = named(&d).len() == 2 && tells("flicker") && tells("low_pass");
        right.then_some(()).ok_or_else(|| said(&d))
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

/// Adds two levels +-half that take turns; `stay` draws how long each lasts, in samples.
fn switch(record: &mut Record, half: f64, mut stay: impl FnMut(bool) -> f64) {
    let (mut upper, mut left) = (true, 0.0);
    let levels: Vec<f64> = (0..record.len())
        .map(|_| {
            while left <= 0.0 {
                upper = !upper;
                left += stay(upper);
            }
            left -= 1.0;
            if upper { half } else { -half }
        })
        .collect();
    add(record, "gyro_x", |i| levels[i]);
}

/// A thermostat or a load with a duty cycle: 6 to 9 switchings in 600 s, each stay alike to 5 %. Before the dwell times were
/// asked, 41 of 100 such draws were telegraph noise. Two of 20 may get a name: more have a chance of 0.7 % at a fiftieth each.
#[test]
fn two_levels_that_switch_by_a_clock_are_no_telegraph_noise() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(0xc10c);
    graded_over((20, 18), "levels that a clock switches", |run, _| {
        let mut r = record(&[], 6500 + run);
        let mut between = |from, to| {
            let range = Uniform::new(from, to).expect("a range");
            range.sample(&mut rng)
        };
        let (half, duty) = (between(0.1, 0.5), between(0.2, 0.8));
        let (jitter, phase) = (between(0.0, 0.05), between(0.0, 1.0));
        let period = 2.0 * r.len() as f64 / between(6.0, 9.0);
        let mut first = phase;
        switch(&mut r, half, |upper| {
            let e: f64 = StandardNormal.sample(&mut rng);
            let share = if upper { duty } else { 1.0 - duty };
            std::mem::replace(&mut first, 1.0) * share * period * (1.0 + jitter * e)
        });
        let d = told(&r);
        let right = named(&d).is_empty() && !d.unexplained.is_empty();
        right
            .then_some(())
            .ok_or_else(|| format!("+-{half}, {duty} of {period}: {}", said(&d)))
    });
    graded("the same levels that switch at random", |run, rng| {
        let mut r = record(&[], 6600 + run);
        let half = Uniform::new(0.2, 0.25).expect("a range").sample(rng);
        switch(&mut r, half, |_| {
            let e: f64 = Exp1.sample(rng);
            200.0 * e
        });
        let d = told(&r);
        let right = named(&d) == [("telegraph", "gyro_x")] && d.unexplained.is_empty();
        right.then_some(()).ok_or_else(|| said(&d))
    });
}

/// A motor that is driven at many duties: its noise follows their magnitude in every other run, else their square.
#[test]
fn the_law_of_the_motors_noise_is_told_where_the_record_tells_it() {
    let mut undecided = 0;
    graded("noise by |duty| and by duty^2", |run, rng| {
        let mut r = record(&[("motor_duty", 0.9)], 6700 + run);
        let by_magnitude = (run % 2) as f64;
        let increase = Uniform::new(2.0, 4.0).expect("a range").sample(rng);
        // Another duty every 12 s.
        let duty: Vec<f64> = (0..r.len() / 240 + 1)
            .map(|_| Uniform::new(-1.0, 1.0).expect("a range").sample(rng))
            .collect();
        let pwm = r.channels.iter_mut().find(|c| c.quantity == Quantity::Pwm);
        let pwm = pwm.expect("a channel");
        pwm.counts = None;
        for (i, v) in pwm.values.iter_mut().enumerate() {
            *v = (255.0 * duty[i / 240]).round();
        }
        let white = {
            let y = values(&r, Quantity::Gyro);
            let squares = y.windows(2).map(|w| (w[1] - w[0]).powi(2));
            (squares.sum::<f64>() / 2.0 / (y.len() - 1) as f64).sqrt()
        };
        let more: Vec<f64> = (0..r.len())
            .map(|i| {
                let d = duty[i / 240].abs();
                let law = if by_magnitude > 0.0 { d } else { d * d };
                let e: f64 = StandardNormal.sample(rng);
                white * (increase * law).sqrt() * e
            })
            .collect();
        let first = r.channels.iter().find(|c| c.quantity == Quantity::Gyro);
        let first = first.expect("a channel").name.clone();
        add(&mut r, &first, |i| more[i]);
        let d = told(&r);
        let found = d.findings.iter().find(|f| f.cause == "motor_noise");
        let parameters = &found.ok_or_else(|| said(&d))?.parameters;
        let size = &parameters["variance_increase_at_full_duty"];
        let off = (size.value - increase) / size.std_error.unwrap_or(f64::NAN);
        let law = parameters.get("by_magnitude").map(|p| p.value);
        undecided += u64::from(law.is_none());
        // Where the law is open, the size is the square's.
        let right = law.is_none() || law == Some(by_magnitude) && off.abs() < 4.0;
        let told = format!("{by_magnitude} {increase}: {law:?} {off}");
        right.then_some(()).ok_or(told)
    });
    assert!(undecided <= 1, "{undecided}");
}

#[test]
fn two_laws_of_the_variance_on_one_axis_are_both_told_with_their_sizes() {
    graded(
        "a noisy motor, and noise that is larger for a while",
        |run, rng| {
            let mut between = |low, high| Uniform::new(low, high).expect("a range").sample(rng);
            let (by_motor, by_time) = (between(0.8, 2.0), between(0.8, 2.0));
            let start = between(20.0, 400.0);
            let end = start + between(80.0, 180.0);
            let effect = |cause: &str, of: &[(&str, f64, &str)]| EffectModel {
                cause: cause.into(),
                channels: vec!["gyro_y".into()],
                parameters: (of.iter())
                    .map(|(k, v, unit)| ((*k).to_owned(), Parameter::exact(*v, unit)))
                    .collect(),
            };
            let mut model = ModelFile::paper();
            model.excitation.insert("motor_duty".into(), 0.9);
            let increase = "variance_increase_at_full_duty";
            model.effects = vec![
                effect("motor_noise", &[(increase, by_motor, "1")]),
                effect(
                    "noise_change",
                    &[
                        ("start", start, "s"),
                        ("end", end, "s"),
                        ("variance_increase", by_time, "1"),
                    ],
                ),
            ];
            let r = model::simulate(&model, 600.0, 20.0, 9100 + run).expect("a run");
            let d = told(&r);
            // In standard errors; the law of the motor may stay open, and is then the square's, as planted.
            let off = |cause: &str, parameter: &str, truth: f64| {
                let found = d.findings.iter().find(|f| f.cause == cause);
                let size = found.and_then(|f| f.parameters.get(parameter));
                size.map_or(f64::INFINITY, |p| {
                    (p.value - truth) / p.std_error.unwrap_or(f64::NAN)
                })
            };
            let offs = [
                off("motor_noise", increase, by_motor),
                off("noise_change", "variance_increase", by_time),
            ];
            let right = named(&d).len() == 2
                && d.unexplained.is_empty()
                && offs.iter().all(|z| z.abs() < 4.0);
            right.then_some(()).ok_or_else(|| {
                format!(
                    "{by_motor} and {by_time} from {start} to {end} s: {offs:?} {}",
                    said(&d)
                )
            })
        },
    );
}

#[test]
fn acceleration_that_is_felt_a_little_late_is_felt_and_what_comes_a_sample_later_is_another_thing()
{
    for late in [(0.15, 0.4), (0.9, 1.0)] {
        graded("vibration that is felt late", |run, rng| {
            let mut between = |low, high| Uniform::new(low, high).expect("a range").sample(rng);
            let r = record(&[("vibration_g", between(0.08, 0.15))], 8400 + run);
            let (mut r, felt) = (r.clone(), values(&r, Quantity::Acc));
            // Of a sensitivity in deg/s/g, this part acts in the next sample.
            let (k, part) = (between(1.5, 3.0), between(late.0, late.1));
            let mean = felt.iter().sum::<f64>() / felt.len() as f64;
            let g = |i: usize| (felt[i] - mean) / 9.80665;
            add(&mut r, "gyro_y", |i| {
                k * ((1.0 - part) * g(i) + part * g(i.saturating_sub(1)))
            });
            let d = told(&r);
            let right = if part > 0.5 {
                named(&d).is_empty() && !d.unexplained.is_empty()
            } else {
                let whole = d.findings.first().and_then(|f| f.parameters.get("acc_x"));
                let hit = |p: &Parameter| (p.value - k).abs() < 4.0 * p.std_error.unwrap_or(0.0);
                named(&d) == [("g_sensitivity", "gyro_y")] && whole.is_some_and(hit)
            };
            right
                .then_some(())
                .ok_or_else(|| format!("{part:.2} of {k:.2} late: {}", said(&d)))
        });
    }
}
