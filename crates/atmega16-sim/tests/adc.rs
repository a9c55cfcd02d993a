//! The ADC by the data sheet (2466T, analog to digital converter: conversion times, auto triggering, result).

mod common;

use common::{Recorder, byte, load, run_to_end, steps, variable, word};

fn converted(flags: &[&str]) -> (atmega16_sim::Mcu, Recorder) {
    let mut mcu = load("adc.c", flags);
    let mut board = Recorder::new();
    board.volts = [0.0, 0.1, 1.0, 1.65, 2.0, 3.0, 3.299, 5.0];
    run_to_end(&mut mcu, &mut board);
    (mcu, board)
}

#[test]
fn a_conversion_takes_13_clocks_and_the_first_25() {
    for (prescale, clock) in [(7, 128), (6, 64), (2, 4)] {
        let (_, board) = converted(&[&format!("-DPRESCALE={prescale}")]);
        for n in 0..9 {
            let marks = board.marks();
            let took = marks[2 * n + 1] - marks[2 * n];
            let clocks = if n == 0 { 25 } else { 13 };
            // It starts with the next edge of its clock, and the loop that looks takes some cycles.
            let range = clocks * clock - 4..=(clocks + 1) * clock + 12;
            assert!(range.contains(&took), "{took} cycles at /{clock}");
        }
    }
}

#[test]
fn the_input_is_held_one_and_a_half_clocks_after_the_start() {
    let (_, board) = converted(&["-DPRESCALE=7"]);
    let marks = board.marks();
    for (n, &(at, channel)) in board.adc.iter().enumerate() {
        assert_eq!(usize::from(channel), n);
        let after = at - marks[2 * n];
        let clocks = if n == 0 { 1728 } else { 192 };
        assert!((clocks - 4..=clocks + 128).contains(&after), "{after}");
    }
}

#[test]
fn the_result_is_1024_v_over_the_reference() {
    let (mcu, _) = converted(&["-DPRESCALE=7"]);
    let counts: Vec<u16> = variable(&mcu, "counts", 16)
        .chunks(2)
        .map(|pair| u16::from_le_bytes([pair[0], pair[1]]))
        .collect();
    let expected = [0.0, 0.1, 1.0, 1.65, 2.0, 3.0, 3.299, 5.0]
        .map(|v: f64| (v / 3.3 * 1024.0).floor().min(1023.0) as u16);
    assert_eq!(counts, expected);
    assert_eq!(word(&mcu, "gap"), (1.22f64 / 3.3 * 1024.0) as u16);
}

/// Asked for input 0 after a sleep, MUX 2 before it: what is read, and the inputs held from the sleep on.
fn after_idle_sleep(flags: &[&str]) -> (u8, u16, Vec<u8>) {
    let mut all = vec!["-DPRESCALE=7", "-DIDLE"];
    all.extend(flags);
    let (mcu, board) = converted(&all);
    let held = board.adc.iter().skip(1).map(|&(_, channel)| channel);
    (byte(&mcu, "running"), word(&mcu, "counts"), held.collect())
}

#[test]
fn idle_sleep_starts_a_conversion_while_the_adc_is_on() {
    // Input 0 is at 0 V, input 2 at 1 V. What is asked for while it runs is not converted.
    let of_2 = (1.0f64 / 3.3 * 1024.0) as u16;
    assert_eq!(after_idle_sleep(&[]), (1 << 6, of_2, vec![2]));
    // Switched off after the sleep the conversion is gone, before it there is none; the next one takes its own input.
    assert_eq!(
        after_idle_sleep(&["-DOFF_AFTER_SLEEP"]),
        (1 << 6, 0, vec![2, 0])
    );
    assert_eq!(after_idle_sleep(&["-DOFF_BEFORE_SLEEP"]), (0, 0, vec![0]));
}

#[test]
fn free_running_it_takes_13_clocks_each() {
    let (_, board) = converted(&["-DPRESCALE=7", "-DFREE_RUNNING"]);
    let held: Vec<u64> = board.adc.iter().map(|&(at, _)| at).collect();
    assert!(held.len() >= 8);
    assert!(
        steps(&held).iter().skip(1).all(|&step| step == 13 * 128),
        "{:?}",
        steps(&held)
    );
}

#[test]
fn timer_1_triggers_it_to_the_cycle_and_only_by_a_rise_of_its_flag() {
    let (_, board) = converted(&["-DPRESCALE=7", "-DTRIGGERED"]);
    let held: Vec<u64> = board.adc.iter().map(|&(at, _)| at).collect();
    assert_eq!(held.len(), 8);
    assert!(
        steps(&held)[1..].iter().all(|&step| step == 12_500),
        "{:?}",
        steps(&held)
    );
    // Held 2 clocks, there after 13.5 (and the interrupt's entry with its `push`es until the mark).
    let (at, mark) = (held[3], board.mark(4));
    let after = mark - at;
    assert!((1472..1472 + 60).contains(&after), "{after}");
    assert!(byte(&converted(&["-DPRESCALE=7", "-DTRIGGERED"]).0, "taken") >= 8);
}
