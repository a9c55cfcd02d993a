//! What the three inputs see, in order. The truth table is written out again here.

use embedded_hal_mock::eh1::delay::{CheckedDelay, Transaction as Pause};
use embedded_hal_mock::eh1::digital::{Mock as Pin, State, Transaction};
use mma7260qt::{Axis, Error, Mma7260qt, Range, ReadCounts, Scale, acceleration};

fn pin(states: &[State]) -> Pin {
    Pin::new(
        &states
            .iter()
            .map(|&state| Transaction::set(state))
            .collect::<Vec<_>>(),
    )
}

#[test]
fn each_range_sets_both_inputs_then_the_part_is_woken() {
    use State::{High, Low};
    for (range, g_select2, g_select1, code) in [
        (Range::G1_5, Low, Low, 0),
        (Range::G2, Low, High, 1),
        (Range::G4, High, Low, 2),
        (Range::G6, High, High, 3),
    ] {
        assert_eq!((range.code(), Range::from_code(code)), (code, Some(range)));
        let pins = (pin(&[g_select1]), pin(&[g_select2]), pin(&[High]));
        let part = Mma7260qt::new(pins.0, pins.1, pins.2, range).unwrap();
        assert_eq!(part.range(), range);
        let (mut g_select1, mut g_select2, mut sleep) = part.release();
        g_select1.done();
        g_select2.done();
        sleep.done();
    }
    assert_eq!(Range::from_code(4), None);
}

#[test]
fn the_part_sleeps_low_and_wakes_high() {
    use State::{High, Low};
    let (g_select1, g_select2) = (pin(&[Low, High]), pin(&[Low, High]));
    let mut part =
        Mma7260qt::new(g_select1, g_select2, pin(&[High, Low, High]), Range::G1_5).unwrap();
    part.sleep().unwrap();
    part.set_range(Range::G6).unwrap();
    part.wake().unwrap();
    let (mut g_select1, mut g_select2, mut sleep) = part.release();
    g_select1.done();
    g_select2.done();
    sleep.done();
}

#[test]
fn waiting_takes_the_time_of_the_data_sheet_after_the_pins() {
    use State::{High, Low};
    let mut delay = CheckedDelay::new(&[Pause::delay_us(5_400), Pause::delay_us(2_000)]);
    let (g_select1, g_select2) = (pin(&[Low, Low]), pin(&[Low, High]));
    let mut part =
        Mma7260qt::new(g_select1, g_select2, pin(&[High, Low, High]), Range::G1_5).unwrap();
    part.set_range_and_wait(Range::G4, &mut delay).unwrap();
    part.sleep().unwrap();
    part.wake_and_wait(&mut delay).unwrap();
    let (mut g_select1, mut g_select2, mut sleep) = part.release();
    delay.done();
    g_select1.done();
    g_select2.done();
    sleep.done();
}

#[test]
fn a_pin_that_fails_is_named_and_the_range_stays() {
    use embedded_hal_mock::eh1::MockError;
    use std::io::ErrorKind;
    let failing = Transaction::set(State::High).with_error(MockError::Io(ErrorKind::NotConnected));
    let mut g_select2 = Pin::new(&[Transaction::set(State::Low), failing]);
    let mut g_select1 = pin(&[State::Low, State::Low]);
    let mut sleep = pin(&[State::High]);
    let mut part = Mma7260qt::new(
        g_select1.clone(),
        g_select2.clone(),
        sleep.clone(),
        Range::G1_5,
    )
    .unwrap();
    assert!(matches!(part.set_range(Range::G4), Err(Error::GSelect2(_))));
    assert_eq!(part.range(), Range::G1_5);
    g_select1.done();
    g_select2.done();
    sleep.done();
}

#[test]
fn a_conversion_that_fails_gives_no_value() {
    let mut converter = |axis| {
        if axis == Axis::Y {
            Err("no conversion")
        } else {
            Ok(512)
        }
    };
    assert_eq!(converter.read_counts(Axis::X), Ok(512));
    assert_eq!(
        acceleration(&mut converter, &Scale::ratiometric(Range::G2, 10)),
        Err("no conversion")
    );
}
