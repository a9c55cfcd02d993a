//! Rows out of order, there twice, missing; boards that start anew; headers that contradict the clock.

use diagnosis::{DiagnoseOptions, diagnose};
use model::ModelFile;
use model::record::rows::{in_order, longest_part};
use model::record::{Channel, Quantity, Record};
use noise::{AnalyzeOptions, analyze};
use proptest::prelude::*;

const RATE: f64 = 20.0;

/// A record in order whose numbers begin in the middle of their range.
fn sound(seconds: f64, seed: u64) -> Record {
    let mut record = model::simulate(&ModelFile::paper(), seconds, RATE, seed).expect("simulated");
    record.seq.iter_mut().flatten().for_each(|s| *s += 30_000);
    record
        .t_ticks
        .iter_mut()
        .flatten()
        .for_each(|t| *t += 375_000_000);
    record
}

/// The rows of `record`, in that order.
fn rows(record: &Record, order: &[usize]) -> Record {
    fn pick<T: Copy>(v: &[T], order: &[usize]) -> Vec<T> {
        order.iter().map(|i| v[*i]).collect()
    }
    Record {
        seq: record.seq.as_ref().map(|v| pick(v, order)),
        t_ticks: record.t_ticks.as_ref().map(|v| pick(v, order)),
        host_time_s: record.host_time_s.as_ref().map(|v| pick(v, order)),
        flags: record.flags.as_ref().map(|v| pick(v, order)),
        channels: record
            .channels
            .iter()
            .map(|c| Channel {
                values: pick(&c.values, order),
                counts: c.counts.as_ref().map(|v| pick(v, order)),
                ..c.clone()
            })
            .collect(),
        ..record.clone()
    }
}

/// The same but for the notes.
fn same(a: &Record, b: &Record) -> bool {
    let without = |r: &Record| Record {
        notes: vec![],
        ..r.clone()
    };
    // Where nothing is read, nothing is equal: by words.
    without(a) == without(b) || format!("{:?}", without(a)) == format!("{:?}", without(b))
}

fn told(record: &Record, words: &[&str]) {
    for word in words {
        assert!(
            record.notes.iter().any(|n| n.contains(word)),
            "{word}: {:?}",
            record.notes
        );
    }
}

#[test]
fn a_record_in_order_is_left_alone() {
    let record = sound(60.0, 1);
    let ordered = in_order(&record);
    assert!(matches!(ordered, std::borrow::Cow::Borrowed(_)));
    assert!(matches!(
        longest_part(&ordered),
        std::borrow::Cow::Borrowed(_)
    ));
}

#[test]
fn rows_in_reverse_are_put_in_order_and_told() {
    let record = sound(60.0, 2);
    let back: Vec<usize> = (0..record.len()).rev().collect();
    let reversed = rows(&record, &back);
    let ordered = in_order(&reversed);
    assert!(same(&ordered, &record));
    told(&ordered, &["the rows run backwards in time"]);
    let options = AnalyzeOptions::default();
    let (a, b) = (analyze(&reversed, &options), analyze(&record, &options));
    let (a, b) = (a.expect("analyzed"), b.expect("analyzed"));
    assert_eq!(a.channels, b.channels);
    assert_eq!(a.input.notes.len(), 1);
}

#[test]
fn rows_in_reverse_of_a_file_that_has_times_alone_are_put_in_order() {
    let mut record = sound(60.0, 2);
    (record.seq, record.t_ticks, record.header.tick_s) = (None, None, None);
    record.host_time_s = Some((0..record.len()).map(|i| i as f64 / RATE).collect());
    let back: Vec<usize> = (0..record.len()).rev().collect();
    assert!(same(&in_order(&rows(&record, &back)), &record));
}

#[test]
fn a_column_that_is_no_time_puts_nothing_in_order() {
    let mut record = sound(60.0, 2);
    (record.seq, record.t_ticks, record.header.tick_s) = (None, None, None);
    record.host_time_s = Some(record.channels[0].values.clone());
    let ordered = in_order(&record);
    assert!(same(&ordered, &record));
    told(&ordered, &["no times of sampling"]);
}

#[test]
fn a_capture_appended_to_itself_counts_once() {
    let record = sound(60.0, 3);
    let n = record.len();
    let twice: Vec<usize> = (0..n).chain(0..n).collect();
    let double = rows(&record, &twice);
    let ordered = in_order(&double);
    assert!(same(&ordered, &record), "{:?}", ordered.notes);
    told(&ordered, &[&format!("{n} rows are there twice")]);
    let options = DiagnoseOptions::default();
    let found = diagnose(&double, &options).expect("diagnosed").diagnosis;
    assert_eq!(found.input.samples, n);
    assert_eq!(found.input.notes, ordered.notes);
    assert!(found.findings.is_empty(), "{:?}", found.findings);
}

#[test]
fn single_rows_that_are_there_twice_or_exchanged_and_a_block_that_comes_again() {
    let record = sound(60.0, 4);
    let n = record.len();
    let mut order: Vec<usize> = (0..n)
        .flat_map(|i| vec![i; 1 + usize::from(i % 97 == 5)])
        .collect();
    assert!(same(&in_order(&rows(&record, &order)), &record));
    order = (0..n).collect();
    order.swap(600, 601);
    let ordered = in_order(&rows(&record, &order)).into_owned();
    assert!(same(&ordered, &record));
    told(&ordered, &["goes back at 1 place", "row 602"]);
    order = (0..600).chain(500..n).collect();
    let ordered = in_order(&rows(&record, &order)).into_owned();
    assert!(same(&ordered, &record));
    told(&ordered, &["100 rows are there twice"]);
}

#[test]
fn rows_exchanged_where_the_numbers_wrap_find_their_places() {
    let record = sound(60.0, 5);
    let mut order: Vec<usize> = (0..record.len()).collect();
    order.swap(536, 535);
    let mut wrapped = rows(&record, &order);
    // Numbers as they are on the wire: row 536 of the record has 0.
    let start = 65_536 - 536;
    for (s, row) in wrapped.seq.iter_mut().flatten().zip(&order) {
        *s = (start + *row as u64) % 65_536;
    }
    let ordered = in_order(&wrapped);
    assert_eq!(ordered.channels, record.channels);
    let seq = ordered.seq.as_ref().expect("kept");
    assert!(seq.windows(2).all(|w| w[1] == w[0] + 1));
}

/// A board that starts anew after `at` rows; the host's clock goes on by `gap_s`.
fn started_anew(record: &Record, at: usize, gap_s: f64) -> Record {
    let mut out = record.clone();
    for i in at..record.len() {
        let new = (i - at) as u64;
        if let Some(s) = &mut out.seq {
            s[i] = new;
        }
        if let Some(t) = &mut out.t_ticks {
            t[i] = new * 12_500;
        }
        if let Some(h) = &mut out.host_time_s {
            h[i] += gap_s - 1.0 / RATE;
        }
    }
    out
}

#[test]
fn a_board_that_starts_anew_goes_on_by_the_hosts_clock() {
    let record = sound(60.0, 6);
    for (gap_s, missing) in [(0.05, 0), (1.0, 19)] {
        let restarted = started_anew(&record, 700, gap_s);
        let ordered = in_order(&restarted);
        let seq = ordered.seq.as_ref().expect("kept");
        assert_eq!(seq[700] - seq[699], missing + 1, "{:?}", ordered.notes);
        assert!(seq.windows(2).all(|w| w[1] > w[0]));
        assert_eq!(ordered.channels, record.channels);
        told(&ordered, &["started anew before row 701"]);
    }
}

#[test]
fn a_board_that_starts_anew_with_nobody_to_tell_leaves_one_place() {
    let mut record = started_anew(&sound(60.0, 7), 700, 1.0);
    record.host_time_s = None;
    let ordered = in_order(&record);
    let seq = ordered.seq.as_ref().expect("kept");
    assert_eq!(seq[700] - seq[699], 2, "{:?}", ordered.notes);
    told(&ordered, &["nothing tells how long"]);
}

#[test]
fn two_recordings_in_one_file_are_not_woven_into_each_other() {
    let (a, b) = (sound(60.0, 8), sound(60.0, 9));
    let n = a.len();
    let mut both = rows(&a, &(0..n).chain(0..n).collect::<Vec<_>>());
    for (c, other) in both.channels.iter_mut().zip(&b.channels) {
        c.values[n..].copy_from_slice(&other.values);
        if let (Some(c), Some(o)) = (&mut c.counts, &other.counts) {
            c[n..].copy_from_slice(o);
        }
    }
    let ordered = in_order(&both);
    assert_eq!(ordered.len(), 2 * n);
    for (c, both) in ordered.channels.iter().zip(&both.channels) {
        assert_eq!(c.values, both.values, "{:?}", ordered.notes);
    }
}

#[test]
fn filled_holes_convict_nobody() {
    // Half an hour of nothing in ten minutes of a sound record: five times as many places as rows would be filled.
    for seed in 20..26 {
        let record = started_anew(&sound(600.0, seed), 6000, 1800.0);
        let found = diagnose(&record, &DiagnoseOptions::default()).expect("diagnosed");
        let d = found.diagnosis;
        assert!(d.findings.is_empty(), "seed {seed}: {:?}", d.findings);
        assert!(d.unexplained.is_empty(), "seed {seed}: {:?}", d.unexplained);
        assert_eq!(d.input.samples, 6000);
        assert!(
            d.input.notes.iter().any(|n| n.contains("longest part")),
            "{:?}",
            d.input.notes
        );
    }
}

#[test]
fn of_a_header_whose_rate_contradicts_the_ticks_the_ticks_are_believed() {
    let mut record = sound(60.0, 10);
    record.header.rate_hz = Some(40.0);
    record
        .header
        .entries
        .iter_mut()
        .filter(|(k, _)| k == "rate_hz")
        .for_each(|e| e.1 = "40".into());
    let ordered = in_order(&record);
    let rate = ordered.header.rate_hz.expect("a rate");
    assert!((rate - 20.0).abs() < 0.01, "{rate}");
    told(&ordered, &["stated rate is 40.0000 Hz", "and the host's"]);
    let found = diagnose(&record, &DiagnoseOptions::default()).expect("diagnosed");
    assert!((found.diagnosis.input.seconds - 60.0).abs() < 0.1);
    let analysis = analyze(&record, &AnalyzeOptions::default()).expect("analyzed");
    assert!((analysis.input.seconds - 60.0).abs() < 0.1);
    assert_eq!(analysis.input.notes, found.diagnosis.input.notes);
}

#[test]
fn a_tick_that_rate_and_host_contradict_is_the_one_that_is_wrong() {
    let mut record = sound(60.0, 11);
    record.header.tick_s = Some(1e-6);
    let ordered = in_order(&record);
    assert_eq!(ordered.header.rate_hz, Some(RATE));
    let tick = ordered.header.tick_s.expect("a tick");
    assert!((tick / 4e-6 - 1.0).abs() < 1e-3, "{tick}");
    told(&ordered, &["ticks are taken as"]);
}

#[test]
fn a_crystal_off_by_200_ppm_is_a_matter_of_clocks_and_no_wrong_header() {
    let mut record = sound(60.0, 12);
    record
        .t_ticks
        .iter_mut()
        .flatten()
        .for_each(|t| *t += *t / 5000);
    let ordered = in_order(&record);
    assert_eq!(ordered.header.rate_hz, Some(RATE));
    assert!(ordered.notes.is_empty(), "{:?}", ordered.notes);
}

#[test]
fn a_single_wrong_time_is_no_restart_and_interrupts_nothing() {
    for wrong in [0, 1 << 32, 1 << 45] {
        let mut record = sound(60.0, 15);
        record.t_ticks.as_mut().expect("ticks")[600] = wrong;
        let ordered = in_order(&record);
        assert!(same(&ordered, &record), "{:?}", ordered.notes);
        assert_eq!(longest_part(&ordered).len(), record.len());
    }
}

#[test]
fn cells_without_a_reading_are_told() {
    let mut record = sound(60.0, 13);
    for c in &mut record.channels[..2] {
        c.values[100..160].fill(f64::NAN);
    }
    told(
        &in_order(&record),
        &["60 of 1200 rows have no reading of gyro_x, gyro_y"],
    );
}

#[test]
fn a_gyro_that_never_flags_a_new_reading_is_left_out_and_the_others_are_diagnosed() {
    let mut record = sound(60.0, 14);
    record.flags.iter_mut().flatten().for_each(|f| *f = 3);
    let found = diagnose(&record, &DiagnoseOptions::default()).expect("two are left");
    let d = found.diagnosis;
    let told = d.unexplained.iter().find(|u| u.channel == "gyro_z");
    assert!(
        told.is_some_and(|u| u.what.contains("never flagged as new")),
        "{:?}",
        d.unexplained
    );
    assert!(d.baseline.contains_key("gyro_x") && !d.baseline.contains_key("gyro_z"));
    record.flags.iter_mut().flatten().for_each(|f| *f = 0);
    let error = diagnose(&record, &DiagnoseOptions::default()).expect_err("none is left");
    assert!(
        error.to_string().contains("gyro_x is never flagged as new"),
        "{error}"
    );
}

#[derive(Clone, Debug)]
enum Mishap {
    Shuffle(Vec<usize>),
    Reverse,
    Twice(usize, usize),
    Drop(usize, usize),
    Nan(usize, usize, usize),
    Restart(usize, f64),
    Glitch(usize, u64),
    Number(usize, u64),
    NoSeq,
    NoTicks,
    NoHost,
    Host(usize, f64),
    Rate(f64),
    Tick(f64),
    Stopped,
    Wrapped,
}

fn mishap(n: usize) -> impl Strategy<Value = Mishap> {
    let any = prop_oneof![Just(0u64), Just(u64::MAX), Just(1 << 32), 0..1u64 << 40];
    prop_oneof![
        Just((0..n).collect::<Vec<_>>())
            .prop_shuffle()
            .prop_map(Mishap::Shuffle),
        Just(Mishap::Reverse),
        (0..n, 1..n).prop_map(|(a, b)| Mishap::Twice(a, b)),
        (0..n, 1..n / 2).prop_map(|(a, b)| Mishap::Drop(a, b)),
        (0..6usize, 0..n, 1..n).prop_map(|(c, a, b)| Mishap::Nan(c, a, b)),
        (0..n, prop_oneof![Just(0.05), Just(-10.0), 0.0..1e7f64])
            .prop_map(|(a, g)| Mishap::Restart(a, g)),
        (0..n, any.clone()).prop_map(|(a, v)| Mishap::Glitch(a, v)),
        (0..n, any).prop_map(|(a, v)| Mishap::Number(a, v)),
        Just(Mishap::NoSeq),
        Just(Mishap::NoTicks),
        Just(Mishap::NoHost),
        (0..n, prop_oneof![Just(f64::NAN), Just(1e300), Just(-1e300)])
            .prop_map(|(a, v)| Mishap::Host(a, v)),
        prop_oneof![
            Just(40.0),
            Just(f64::NAN),
            Just(0.0),
            Just(1e-300),
            Just(1e300)
        ]
        .prop_map(Mishap::Rate),
        prop_oneof![Just(1e-6), Just(f64::NAN), Just(0.0), Just(1e300)].prop_map(Mishap::Tick),
        Just(Mishap::Stopped),
        Just(Mishap::Wrapped),
    ]
}

fn befall(record: Record, mishap: &Mishap) -> Record {
    let n = record.len();
    let mut out = record;
    match mishap {
        Mishap::Shuffle(order) => {
            let order: Vec<usize> = order.iter().copied().filter(|i| *i < n).collect();
            return rows(&out, &order);
        }
        Mishap::Reverse => return rows(&out, &(0..n).rev().collect::<Vec<_>>()),
        Mishap::Twice(at, many) => {
            let end = (at + many).min(n);
            let order: Vec<usize> = (0..end).chain((*at).min(end)..n).collect();
            return rows(&out, &order);
        }
        Mishap::Drop(at, many) => {
            let order: Vec<usize> = (0..n).filter(|i| i < at || *i >= at + many).collect();
            return rows(&out, &order);
        }
        Mishap::Nan(c, at, many) => {
            let c = &mut out.channels[*c];
            let end = (at + many).min(n);
            c.values[(*at).min(end)..end].fill(f64::NAN);
        }
        Mishap::Restart(at, gap) => return started_anew(&out, (*at).min(n), *gap),
        Mishap::Glitch(at, v) => {
            if let Some(t) = out.t_ticks.as_mut().and_then(|t| t.get_mut(*at)) {
                *t = *v;
            }
        }
        Mishap::Number(at, v) => {
            if let Some(s) = out.seq.as_mut().and_then(|t| t.get_mut(*at)) {
                *s = *v;
            }
        }
        Mishap::NoSeq => out.seq = None,
        Mishap::NoTicks => out.t_ticks = None,
        Mishap::NoHost => out.host_time_s = None,
        Mishap::Host(at, v) => {
            if let Some(h) = out.host_time_s.as_mut().and_then(|t| t.get_mut(*at)) {
                *h = *v;
            }
        }
        Mishap::Rate(rate) => out.header.rate_hz = Some(*rate),
        Mishap::Tick(tick) => out.header.tick_s = Some(*tick),
        Mishap::Stopped => out.t_ticks.iter_mut().flatten().for_each(|t| *t = 7),
        Mishap::Wrapped => {
            out.seq.iter_mut().flatten().for_each(|s| *s %= 256);
            out.t_ticks.iter_mut().flatten().for_each(|t| *t %= 1 << 20);
        }
    }
    out
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    /// Whatever befalls the rows, there is an answer or an error.
    #[test]
    fn nothing_that_befalls_rows_stops_the_program(
        seed in 0..4u64,
        mishaps in proptest::collection::vec(mishap(700), 1..4),
    ) {
        let mut record = sound(35.0, seed);
        record.channels.retain(|c| matches!(c.quantity, Quantity::Gyro | Quantity::Temp));
        for m in &mishaps {
            record = befall(record, m);
        }
        let ordered = in_order(&record).into_owned();
        if let Some(seq) = &ordered.seq {
            prop_assert!(seq.windows(2).all(|w| w[0] < w[1]));
        }
        let _ = diagnose(&record, &DiagnoseOptions::default());
        let _ = analyze(&record, &AnalyzeOptions::default());
    }

    /// However rows of a sound record are shuffled and repeated, they come out as they were.
    #[test]
    fn shuffled_and_repeated_rows_come_out_as_they_were(
        seed in 0..4u64,
        order in Just((0..700).collect::<Vec<usize>>()).prop_shuffle(),
        again in proptest::collection::vec(0..700usize, 0..50),
    ) {
        let record = sound(35.0, seed);
        let order: Vec<usize> = order.into_iter().chain(again).collect();
        let ordered = in_order(&rows(&record, &order)).into_owned();
        prop_assert!(same(&ordered, &record), "{:?}", ordered.notes);
        prop_assert!(!ordered.notes.is_empty());
        prop_assert_eq!(&*in_order(&ordered), &ordered);
    }
}
