//! The audits on readings that come again: from one reading to the next, from one gyro to another. Graded by rate.

mod made;

use diagnosis::audit::audit;
use diagnosis::test_level::Observation;
use made::{PLAIN, World, alter, causes, parameter, record, rng};
use model::record::Record;
use rand_core::Rng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

#[test]
fn silent_repeats_are_told_by_their_number() {
    let mut rng = rng(62);
    let (mut hits, mut missed) = (0, vec![]);
    for _ in 0..60 {
        let mut r = record(PLAIN, &mut rng);
        // 12 of 12000 lie at the detection limit times 1.1; 20 are certain.
        let rows: Vec<usize> = (0..20)
            .map(|_| 1 + rng.next_u32() as usize % 11_999)
            .collect();
        for axis in 0..3 {
            alter(&mut r, axis, |i, c| {
                if rows.contains(&i) { c[i - 1] } else { c[i] }
            });
        }
        let a = audit(&r);
        if causes(&a) == ["stale_samples gyro_x,gyro_y,gyro_z"]
            && (parameter(&a, "count") - 20.0).abs() < 7.0
        {
            hits += 1;
        } else {
            missed.push(causes(&a));
        }
    }
    assert!(hits >= 57, "{hits} of 60: {missed:?}");
}

#[test]
fn one_gyro_that_repeats_is_told() {
    let mut rng = rng(63);
    let mut hits = 0;
    for _ in 0..20 {
        let mut r = record(PLAIN, &mut rng);
        let rows: Vec<bool> = (0..12_000)
            .map(|i| i > 0 && rng.next_u32().is_multiple_of(40))
            .collect();
        alter(&mut r, 2, |i, c| if rows[i] { c[i - 1] } else { c[i] });
        let a = audit(&r);
        hits += u32::from(
            causes(&a) == ["stale_samples gyro_z"]
                && (parameter(&a, "count") - 284.0).abs() < 150.0,
        );
    }
    assert!(hits >= 19, "{hits} of 20");
}

/// One gyro stops for a while, at a reading within its range.
#[test]
fn a_gyro_that_stands_still_is_told() {
    let mut rng = rng(64);
    for _ in 0..20 {
        let mut r = record(PLAIN, &mut rng);
        let length = 30 + rng.next_u32() as usize % 4000;
        let start = 1 + rng.next_u32() as usize % (12_000 - length);
        // The reading nearest to the middle of those before it.
        let still = {
            let mut sorted = r.channels[1].counts.clone().unwrap();
            sorted.sort_unstable();
            sorted[6000]
        };
        alter(&mut r, 1, |i, c| {
            if (start..start + length).contains(&i) {
                still
            } else {
                c[i]
            }
        });
        let a = audit(&r);
        assert_eq!(causes(&a), ["stale_samples gyro_y"], "{length} readings");
        let count = parameter(&a, "count");
        // A neighbour may have the same reading by chance.
        assert!((count - length as f64).abs() <= 3.0, "{count} of {length}");
    }
}

/// A record whose third gyro has noise of which a filter keeps `keep`.
fn smooth(keep: f64, sigma: f64, rng: &mut Xoshiro256PlusPlus) -> Record {
    let mut r = record(PLAIN, rng);
    let mut e = 0.0;
    let noise: Vec<f64> = (0..12_000)
        .map(|_| {
            let z: f64 = StandardNormal.sample(rng);
            e = keep * e + (1.0f64 - keep * keep).sqrt() * z;
            sigma * e
        })
        .collect();
    alter(&mut r, 2, |i, _| noise[i].round() as i32);
    r
}

#[test]
fn a_reading_that_is_held_at_any_time_is_stale_beside_a_filter_too() {
    let mut rng = rng(65);
    for keep in [0.0, 0.2, 0.5, 0.8, -0.3] {
        for (every, sigma) in [(8, 3.0), (16, 5.4), (8, 10.0)] {
            let mut r = smooth(keep, sigma, &mut rng);
            let rows: Vec<bool> = (0..12_000)
                .map(|i| i > 0 && rng.next_u32().is_multiple_of(every))
                .collect();
            alter(&mut r, 2, |i, c| if rows[i] { c[i - 1] } else { c[i] });
            let a = audit(&r);
            // So many agree with repeats of all three by chance that these may be told instead.
            let told = causes(&a);
            let stale = |c: &String| c.starts_with("stale_samples") && c.ends_with("gyro_z");
            assert!(
                told.len() == 1 && told.iter().all(stale),
                "{keep} {every} {sigma}: {told:?}"
            );
        }
    }
}

/// A despiker gives the median of three for a reading farther from it than a gate.
#[test]
fn a_despiker_that_repeats_readings_is_told_without_the_name_of_a_lost_conversion() {
    const GATE: f64 = 1.4;
    let mut rng = rng(68);
    let (mut told, mut runs) = (0, 0);
    for sigma in [3.0, 5.4, 10.0, 5.4, 5.4, 5.4] {
        let mut r = smooth(0.0, sigma, &mut rng);
        let raw = r.channels[2].counts.clone().unwrap();
        alter(&mut r, 2, |i, c| {
            let mut about = raw[i.saturating_sub(1)..(i + 2).min(raw.len())].to_vec();
            about.sort_unstable();
            let middle = about[about.len() / 2];
            let far = f64::from((raw[i] - middle).abs()) > GATE * sigma;
            if far { middle } else { c[i] }
        });
        let a = audit(&r);
        let own =
            |u: &Observation| u.channel == "gyro_z" && u.what.contains("repeat the one before");
        runs += 1;
        told += usize::from(causes(&a).is_empty() && a.unexplained.iter().any(own));
    }
    println!("{told} of {runs}");
    // Some are near enough to one that holds: the name is doubted at 1e-4.
    assert!(2 * told > runs, "{told} of {runs}");
}

fn level(counts: &[i32]) -> i32 {
    counts.iter().sum::<i32>() / counts.len() as i32
}

#[test]
fn a_gyro_that_holds_another_s_readings_for_a_while_is_told_from_when_to_when() {
    let mut rng = rng(66);
    for (behind, length) in [(0, 90), (0, 2000), (1, 60)] {
        let mut r = record(World { walk: 0.0, ..PLAIN }, &mut rng);
        // Levels 2 sigma apart tell whose the readings are.
        let x: Vec<i32> = r.channels[0].counts.clone().unwrap();
        let of_y = level(r.channels[1].counts.as_ref().unwrap());
        let off = level(&x) + 11 - of_y;
        alter(&mut r, 1, |i, c| c[i] + off);
        alter(&mut r, 1, |i, c| {
            if (4000..4000 + length).contains(&i) {
                x[i - behind]
            } else {
                c[i]
            }
        });
        let a = audit(&r);
        let last = 4000 + length - 1;
        let held: Vec<usize> = (4000..=last).collect();
        // One more may agree by chance on either side.
        let masked = a.masked("gyro_y");
        assert!(held.iter().all(|i| masked.contains(i)), "{masked:?}");
        assert!(masked.len() <= held.len() + 4 && a.masked("gyro_x").is_empty());
        let what: Vec<&str> = a.unexplained.iter().map(|u| u.what.as_str()).collect();
        assert!(
            what.len() == 1 && a.unexplained[0].channel == "gyro_y",
            "{what:?}"
        );
        assert!(
            what[0].starts_with("gyro_y holds the readings of gyro_x"),
            "{what:?}"
        );
        assert!(
            what[0].contains("from 200.0") || what[0].contains("from 199.9"),
            "{what:?}"
        );
        assert!(causes(&a).is_empty(), "{:?}", causes(&a));
    }
}

#[test]
fn gyros_that_share_a_motion_hang_at_a_value_or_have_few_codes_hold_none_of_each_other() {
    let mut rng = rng(67);
    for sigma in [0.2, 0.6, 3.0] {
        let mut r = record(World::white(sigma), &mut rng);
        let shared: Vec<i32> = (0..12_000)
            .map(|i| (300.0 * (f64::from(i) / 40.0).sin()).round() as i32)
            .collect();
        for axis in 0..3 {
            let level = level(r.channels[axis].counts.as_ref().unwrap());
            alter(&mut r, axis, |i, c| match i {
                3000..3100 => 7,
                _ => (c[i] - level + shared[i]).clamp(-280, 280),
            });
        }
        let a = audit(&r);
        let told: Vec<&str> = a.unexplained.iter().map(|u| u.what.as_str()).collect();
        let copies = |w: &&str| w.contains("count for count");
        assert!(!told.iter().any(copies), "{sigma}: {told:?}");
    }
}

/// A number from `least` on, below `most`.
fn drawn(least: usize, most: usize, rng: &mut Xoshiro256PlusPlus) -> usize {
    least + rng.next_u32() as usize % (most - least)
}

#[test]
fn buffers_that_were_sent_twice_are_told_with_their_frames() {
    let mut rng = rng(69);
    let (mut hits, mut missed) = (0, vec![]);
    const RUNS: usize = 60;
    for _ in 0..RUNS {
        let sigma = [1.0, 1.6, 3.0, 5.4, 40.0, 300.0][drawn(0, 6, &mut rng)];
        let axes = drawn(1, 4, &mut rng);
        let (length, count) = (drawn(16, 97, &mut rng), drawn(1, 14, &mut rng));
        let mut r = record(World { sigma, ..PLAIN }, &mut rng);
        r.channels.truncate(axes);
        // Each in its own part of the record.
        let part = 12_000 / count;
        let firsts: Vec<usize> = (0..count)
            .map(|k| k * part + drawn(length, part - length, &mut rng))
            .collect();
        let again = |i: &usize| firsts.iter().any(|f| (*f..f + length).contains(i));
        for axis in 0..axes {
            alter(
                &mut r,
                axis,
                |i, c| if again(&i) { c[i - length] } else { c[i] },
            );
        }
        let a = audit(&r);
        let told = causes(&a);
        let right = told.len() == 1 && told[0].starts_with("stale_samples") && {
            let (all, masked) = (length * count, a.masked("gyro_x"));
            // Frames beside a block agree by chance.
            parameter(&a, "count") - all as f64 <= (3 * count) as f64
                && parameter(&a, "behind") == length as f64
                && (0..12_000).filter(again).all(|i| masked.contains(&i))
        };
        if right {
            hits += 1;
        } else {
            missed.push(format!(
                "{count} of {length}, {axes} axes, {sigma}: {told:?}"
            ));
        }
    }
    println!("{hits} of {RUNS}: {missed:#?}");
    // One axis of a few codes repeats so much by chance that a short block is none.
    assert!(10 * hits >= 9 * RUNS, "{hits} of {RUNS}: {missed:?}");
}

#[test]
fn few_codes_motions_that_come_again_and_quiet_stretches_are_no_buffers() {
    let mut rng = rng(70);
    let mut told = vec![];
    for round in 0..80 {
        let sigma = [0.05, 0.2, 0.35, 0.6, 1.0, 3.0][drawn(0, 6, &mut rng)];
        let axes = drawn(1, 4, &mut rng);
        let mut r = record(World::white(sigma), &mut rng);
        r.channels.truncate(axes);
        let period = drawn(5, 3000, &mut rng) as f64;
        let quiet = drawn(0, 11_000, &mut rng);
        let mut slow = [0.0f64; 3];
        for axis in 0..axes {
            let level = level(r.channels[axis].counts.as_ref().unwrap());
            let smooth: Vec<i32> = (0..12_000)
                .map(|_| {
                    // Two poles, of fifty readings.
                    let z: f64 = StandardNormal.sample(&mut rng);
                    slow[1] = 0.98 * slow[1] + z;
                    slow[2] = 0.98 * slow[2] + 0.02 * slow[1];
                    slow[2].round() as i32
                })
                .collect();
            slow = [0.0; 3];
            alter(&mut r, axis, |i, c| match round % 4 {
                0 => c[i],
                1 => {
                    let phase = std::f64::consts::TAU * i as f64 / period;
                    c[i] + (50.0 * phase.sin()).round() as i32
                }
                // A gyro that hardly moves for a while.
                2 if (quiet..quiet + 800).contains(&i) => level + (c[i] - level) / 2,
                2 => c[i],
                _ => smooth[i],
            });
        }
        let a = audit(&r);
        let blocks = a
            .findings
            .iter()
            .filter(|f| f.parameters.contains_key("behind"));
        told.extend(blocks.map(|f| format!("{}, {sigma}, {axes} axes: {}", round % 4, f.what)));
    }
    assert!(told.is_empty(), "{told:#?}");
}
