//! The audits on records made here, graded by rate.

mod draws;
mod made;

use diagnosis::audit::audit;
use made::{PLAIN, TICK_S, World, alter, causes, parameter, record, rng};
use model::record::Record;
use numerics::tails::hits_at_least;
use rand_core::Rng;
use rand_distr::{Distribution, Normal, StandardNormal};

/// Nothing is said of any of `runs` records, or of a third of them: 17 checks of 2e-5 each may speak, 3.4e-4 a record.
fn silent(world: World, runs: u64, offset: u64) {
    let runs = draws::of(runs.div_ceil(3), runs);
    let mut rng = rng(offset);
    let mut told = vec![];
    for _ in 0..runs {
        let a = audit(&record(world, &mut rng));
        if !a.findings.is_empty() || !a.unexplained.is_empty() {
            told.push((
                causes(&a),
                a.findings
                    .iter()
                    .map(|f| f.what.clone())
                    .collect::<Vec<_>>(),
            ));
        }
    }
    // Of 150 records two come by chance 1.3e-3 of the time, three 2e-5; of 50 two 1.4e-4.
    let chance = hits_at_least(told.len() as u64, runs, 3.4e-4);
    assert!(chance > 1e-4, "{} of {runs}: {told:#?}", told.len());
}

#[test]
fn clean_records_pass() {
    silent(PLAIN, 150, 1);
}

#[test]
fn one_gyro_alone_and_two_pass() {
    let mut rng = rng(2);
    for run in 0..60 {
        let mut r = record(PLAIN, &mut rng);
        r.channels.truncate(1 + run % 2);
        let a = audit(&r);
        assert!(a.findings.is_empty(), "{:?}", causes(&a));
    }
}

#[test]
fn noise_below_a_count_is_no_fault() {
    for (k, sigma) in [0.05, 0.2, 0.3, 0.5, 0.8, 1.5].into_iter().enumerate() {
        silent(World { sigma, ..PLAIN }, 25, 10 + k as u64);
    }
}

#[test]
fn fine_steps_are_no_fault() {
    silent(
        World {
            sigma: 300.0,
            walk: 1.0,
            ..PLAIN
        },
        25,
        20,
    );
}

#[test]
fn a_swaying_base_is_no_fault() {
    for (k, sway) in [(70.0, 0.1), (300.0, 0.5), (1000.0, 0.05)]
        .into_iter()
        .enumerate()
    {
        silent(World { sway, ..PLAIN }, 25, 30 + k as u64);
    }
}

#[test]
fn lines_and_drifts_are_no_fault() {
    silent(World { line: 6.0, ..PLAIN }, 25, 40);
    silent(
        World {
            drift: 3000.0,
            ..PLAIN
        },
        25,
        41,
    );
    silent(World { walk: 1.0, ..PLAIN }, 25, 42);
}

#[test]
fn short_and_empty_records_are_no_trouble() {
    for samples in [0, 1, 2, 10, 199, 250, 600] {
        let a = audit(&record(World { samples, ..PLAIN }, &mut rng(50)));
        assert!(a.findings.is_empty(), "{samples}: {:?}", causes(&a));
    }
    assert_eq!(audit(&Record::default()).findings, vec![]);
}

#[test]
fn dead_and_lost_gyros_are_no_trouble() {
    let mut r = record(PLAIN, &mut rng(51));
    alter(&mut r, 0, |_, _| 3);
    r.channels[1].values.iter_mut().for_each(|v| *v = f64::NAN);
    let a = audit(&r);
    assert!(a.findings.is_empty(), "{:?}", causes(&a));
    r.channels.truncate(1);
    assert!(audit(&r).findings.is_empty());
}

#[test]
fn lost_frames_are_counted() {
    let mut r = record(PLAIN, &mut rng(60));
    let seq = r.seq.as_mut().unwrap();
    let tick = r.t_ticks.as_mut().unwrap();
    for (row, lost) in [(1000usize, 1u64), (5000, 3)] {
        seq[row..].iter_mut().for_each(|s| *s += lost);
        tick[row..].iter_mut().for_each(|t| *t += 12_500 * lost);
    }
    // One that no number tells.
    tick[8000..].iter_mut().for_each(|t| *t += 12_500);
    // A late frame.
    tick[9000] += 9000;
    let host: Vec<f64> = tick.iter().map(|t| *t as f64 * TICK_S).collect();
    r.host_time_s = Some(host);
    let a = audit(&r);
    assert_eq!(causes(&a), ["dropped_samples gyro_x,gyro_y,gyro_z"]);
    assert_eq!(parameter(&a, "count"), 5.0);
    assert_eq!(a.silently_lost, [(8000, 1)]);
    assert!(
        (a.findings[0].times_s[1] - 250.05).abs() < 0.2,
        "{:?}",
        a.findings[0].times_s
    );
}

/// Share of frames lost without a gap of the numbers, up to one in four, at rates from 1 to 100 Hz.
#[test]
fn frames_lost_without_a_gap_of_the_numbers_are_told_from_the_times() {
    let mut rng = rng(164);
    for _ in 0..40 {
        let rate = [1.0, 5.0, 20.0, 100.0][(rng.next_u32() % 4) as usize];
        let each = 4 + rng.next_u32() % 96;
        let mut r = record(
            World {
                samples: 4000,
                ..PLAIN
            },
            &mut rng,
        );
        let mut at = 0u64;
        let mut lost = 0;
        let ticks: Vec<u64> = (0..4000)
            .map(|_| {
                at += 1;
                while rng.next_u32().is_multiple_of(each) {
                    at += 1;
                    lost += 1;
                }
                (at as f64 / rate / TICK_S) as u64
            })
            .collect();
        r.header.rate_hz = Some(rate);
        r.host_time_s = Some(ticks.iter().map(|t| *t as f64 * TICK_S).collect());
        r.t_ticks = Some(ticks);
        let a = audit(&r);
        let found: u64 = a.silently_lost.iter().map(|l| l.1).sum();
        // Those before the first row and next to the last do not show.
        assert!(
            found.abs_diff(lost) <= 3,
            "{found} of {lost}, one in {each}"
        );
        assert!(causes(&a).contains(&"dropped_samples gyro_x,gyro_y,gyro_z".to_owned()));
    }
}

#[test]
fn frames_that_no_gyro_has_anew_are_one_event() {
    let mut r = record(PLAIN, &mut rng(165));
    for i in (0..25).map(|k| 300 + 17 * k) {
        r.flags.as_mut().unwrap()[i] &= !7;
    }
    let a = audit(&r);
    assert_eq!(causes(&a), ["stale_samples gyro_x,gyro_y,gyro_z"]);
    assert_eq!(parameter(&a, "count"), 25.0);
}

#[test]
fn old_readings_are_told_by_their_flags() {
    let mut r = record(PLAIN, &mut rng(61));
    for i in [100, 200, 201] {
        r.flags.as_mut().unwrap()[i] &= !2;
    }
    let a = audit(&r);
    assert_eq!(causes(&a), ["stale_samples gyro_y"]);
    assert_eq!(a.masked("gyro_y"), [100, 200, 201]);
}

#[test]
fn clipped_readings_are_told_by_the_missing_tail() {
    let mut rng = rng(64);
    let (mut hits, mut missed) = (0, vec![]);
    for _ in 0..40 {
        let mut r = record(PLAIN, &mut rng);
        let mut sorted = r.channels[1].counts.clone().unwrap();
        sorted.sort_unstable();
        let rail = sorted[12_000 - 26] - 1;
        alter(&mut r, 1, |i, c| c[i].min(rail));
        let a = audit(&r);
        if causes(&a) == ["saturation gyro_y"] && parameter(&a, "high") == f64::from(rail) {
            hits += 1;
        } else {
            let seen =
                |c: &&diagnosis::result::Check| c.id == "missing_tail" && c.channel == "gyro_y";
            missed.push((
                causes(&a),
                a.checks
                    .iter()
                    .find(seen)
                    .map(|c| (c.what.clone(), c.p_value)),
            ));
        }
    }
    assert!(hits >= 38, "{hits} of 40: {missed:#?}");
}

/// A bit above the noise that is 1 throughout moves all readings below its edge up and leaves two humps, cut off at its own
/// edges; no rail does that.
#[test]
fn a_bit_that_folds_the_range_is_no_rail() {
    let mut rng = rng(166);
    let mut wrong = vec![];
    for _ in 0..30 {
        let sigma = 4.0 + f64::from(rng.next_u32() % 400) / 100.0;
        let mut r = record(World::white(sigma), &mut rng);
        let (bit, value) = (5, (rng.next_u32() % 2) as i32);
        // The level to within two spreads of an edge of the bit.
        let from = f64::from(rng.next_u32() % 400) / 100.0 - 2.0;
        let mean = {
            let c = r.channels[0].counts.as_ref().unwrap();
            c.iter().map(|v| f64::from(*v)).sum::<f64>() / c.len() as f64
        };
        let shift = (32.0 + from * sigma - mean).round() as i32;
        alter(&mut r, 0, |i, c| {
            let c = c[i] + shift;
            if value == 1 {
                c | (1 << bit)
            } else {
                c & !(1 << bit)
            }
        });
        let a = audit(&r);
        if causes(&a) != ["stuck_bit gyro_x"] || parameter(&a, "bit") != 5.0 {
            let what: Vec<String> = a.findings.iter().map(|f| f.what.clone()).collect();
            wrong.push((sigma, value, from, what, a.not_normal.clone()));
        }
    }
    assert!(wrong.len() <= 1, "{wrong:#?}");
}

/// The noise that rails leave depends on the level, so that a level that moves makes it change.
#[test]
fn rails_explain_a_variance_that_follows_the_level() {
    let mut rng = rng(167);
    for k in 0..20 {
        let mut r = record(PLAIN, &mut rng);
        let mut sorted = r.channels[1].counts.clone().unwrap();
        sorted.sort_unstable();
        let step = if k % 2 == 0 { 5 } else { 0 };
        let rail = sorted[12_000 - 250];
        alter(&mut r, 1, |i, c| {
            (c[i] + if i > 8000 { step } else { 0 }).min(rail)
        });
        let a = audit(&r);
        assert!(
            causes(&a).contains(&"saturation gyro_y".to_owned()),
            "{:?}",
            causes(&a)
        );
        assert_eq!(a.is_suppressed("time_frequency", "gyro_y"), step > 0);
    }
}

/// Where a gap is filled with the noise that was fitted, a process beside the white noise makes the fill wander far; the base
/// has not moved for that. Six readings far beyond any range have not moved it either.
#[test]
fn neither_a_gap_nor_wild_readings_are_a_base_that_moves() {
    let mut rng = rng(168);
    for _ in 0..4 {
        let mut r = record(PLAIN, &mut rng);
        let mut x = 0.0;
        let process: Vec<f64> = (0..12_000)
            .map(|_| {
                let z: f64 = StandardNormal.sample(&mut rng);
                x = 0.8 * x + 0.6 * 4.0 * z;
                x
            })
            .collect();
        alter(&mut r, 2, |i, c| c[i] + process[i].round() as i32);
        let lost = u64::from(2000 + rng.next_u32() % 4000);
        let at = 4000 + (rng.next_u32() % 4000) as usize;
        let ticks = (0.05 / TICK_S) as u64;
        let late = |column: &mut Vec<u64>, by: u64| column[at..].iter_mut().for_each(|v| *v += by);
        late(r.seq.as_mut().unwrap(), lost);
        late(r.t_ticks.as_mut().unwrap(), lost * ticks);
        if let Some(host) = &mut r.host_time_s {
            host[at..].iter_mut().for_each(|h| *h += 0.05 * lost as f64);
        }
        let wild = 1000 + (rng.next_u32() % 2000) as usize;
        for c in r.channels.iter_mut().filter(|c| c.name == "gyro_x") {
            (wild..wild + 6).for_each(|i| c.values[i] = 1e6);
        }
        let found = diagnosis::diagnose(&r, &diagnosis::DiagnoseOptions::default()).unwrap();
        let findings = &found.diagnosis.findings;
        assert!(
            findings.iter().all(|f| f.cause != "base_motion"),
            "{findings:#?}"
        );
        let outliers = findings.iter().find(|f| f.cause == "outliers").unwrap();
        assert_eq!(outliers.channels, ["gyro_x"]);
        assert_eq!(outliers.parameters["count"].value, 6.0);
    }
}

#[test]
fn missing_bits_are_counted() {
    let mut rng = rng(65);
    for bits in [1u32, 2, 3, 4] {
        let mut r = record(PLAIN, &mut rng);
        alter(&mut r, 0, |i, c| (c[i] >> bits) << bits);
        let a = audit(&r);
        assert_eq!(causes(&a), ["coarse_lsb gyro_x"]);
        assert_eq!(parameter(&a, "missing_bits"), f64::from(bits));
    }
    for step in [3, 6, 7] {
        let mut r = record(PLAIN, &mut rng);
        alter(&mut r, 0, |i, c| c[i].div_euclid(step) * step);
        assert_eq!(parameter(&audit(&r), "step_counts"), f64::from(step));
    }
    // A fault of the noise's own size, all axes.
    let mut r = record(
        World {
            sigma: 1.0,
            ..PLAIN
        },
        &mut rng,
    );
    for axis in 0..3 {
        alter(&mut r, axis, |i, c| (c[i] >> 2) << 2);
    }
    let a = audit(&r);
    assert_eq!(
        causes(&a),
        [
            "coarse_lsb gyro_x",
            "coarse_lsb gyro_y",
            "coarse_lsb gyro_z"
        ]
    );
}

#[test]
fn a_sticking_bit_is_named() {
    let mut rng = rng(66);
    for bit in 0..4u32 {
        for value in [0, 1] {
            let mut hits = 0;
            for _ in 0..10 {
                let mut r = record(PLAIN, &mut rng);
                let at: Vec<bool> = (0..12_000)
                    .map(|_| rng.next_u32().is_multiple_of(10))
                    .collect();
                alter(&mut r, 1, |i, c| match (at[i], value) {
                    (true, 1) => c[i] | (1 << bit),
                    (true, _) => c[i] & !(1 << bit),
                    (false, _) => c[i],
                });
                let a = audit(&r);
                let right = causes(&a) == ["stuck_bit gyro_y"]
                    && parameter(&a, "bit") == f64::from(bit)
                    && parameter(&a, "value") == f64::from(value)
                    && (parameter(&a, "fraction") - 0.1).abs() < 0.05;
                hits += u32::from(right);
                if !right {
                    println!(
                        "bit {bit} at {value}: {:?}",
                        a.findings.iter().map(|f| &f.what).collect::<Vec<_>>()
                    );
                }
            }
            assert!(hits >= 9, "bit {bit} at {value}: {hits} of 10");
        }
    }
}

#[test]
fn uneven_sampling_is_measured() {
    let mut rng = rng(67);
    // A fiftieth of the period, and a quarter of it, of which one step in twenty is off by half a period.
    for ticks in [100.0, 3_125.0] {
        let mut r = record(PLAIN, &mut rng);
        let late = Normal::new(0.0, ticks).unwrap();
        for t in r.t_ticks.as_mut().unwrap() {
            *t = t.saturating_add_signed(late.sample(&mut rng) as i64);
        }
        let a = audit(&r);
        assert_eq!(causes(&a), ["timestamp_jitter gyro_x,gyro_y,gyro_z"]);
        let sigma = parameter(&a, "sigma");
        let truth = 4e-6 * ticks;
        assert!((sigma - truth).abs() < 0.05 * truth, "{sigma}, {truth}");
    }
}

#[test]
fn a_fast_clock_is_told_beyond_its_tolerance_alone() {
    let mut rng = rng(68);
    for (ppm, told) in [
        (0.0, false),
        (-80.0, false),
        (130.0, true),
        (-300.0, true),
        (5000.0, true),
    ] {
        let mut r = record(PLAIN, &mut rng);
        r.host_time_s
            .as_mut()
            .unwrap()
            .iter_mut()
            .for_each(|h| *h /= 1.0 + ppm * 1e-6);
        let a = audit(&r);
        assert_eq!(!a.findings.is_empty(), told, "{ppm}: {:?}", a.checks);
        if told {
            assert!(
                (parameter(&a, "ppm") - ppm).abs() < 5.0,
                "{}",
                parameter(&a, "ppm")
            );
        }
    }
}

#[test]
fn single_far_readings_are_found() {
    let mut rng = rng(69);
    let mut hits = 0;
    for _ in 0..20 {
        let mut r = record(PLAIN, &mut rng);
        alter(&mut r, 0, |i, c| {
            if i % 3000 == 1500 {
                c[i] + if i < 6000 { 56 } else { -56 }
            } else {
                c[i]
            }
        });
        let a = audit(&r);
        hits += u32::from(causes(&a) == ["outliers gyro_x"] && parameter(&a, "count") == 4.0);
    }
    // 56 counts are 10.3 sigma; the noise of the sample has to take 4 of them to hide one.
    assert!(hits >= 19, "{hits} of 20");
}

#[test]
fn a_record_without_counts_and_times_says_what_it_cannot_tell() {
    let mut r = record(PLAIN, &mut rng(70));
    r.channels.iter_mut().for_each(|c| c.counts = None);
    (r.seq, r.t_ticks, r.host_time_s, r.flags) = (None, None, None, None);
    let a = audit(&r);
    let untested: Vec<&str> = a.not_tested.iter().map(|n| n.cause.as_str()).collect();
    for cause in [
        "dropped_samples",
        "timestamp_jitter",
        "clock_rate",
        "coarse_lsb",
        "stuck_bit",
        "saturation",
    ] {
        assert!(untested.contains(&cause), "{cause}: {untested:?}");
    }
    assert!(a.findings.is_empty());
}

#[test]
fn an_alarm_bit_is_no_silence() {
    let mut r = record(PLAIN, &mut rng(71));
    r.flags.as_mut().unwrap()[77] |= 1 << 5;
    let a = audit(&r);
    assert!(a.findings.is_empty());
    assert_eq!(a.unexplained[0].channel, "gyro_z");
}
