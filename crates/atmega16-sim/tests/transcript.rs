//! What a chip sees of itself and prints over its USART (`programs/transcript.c`), between what the data sheet says. `IMU_STAND_TRANSCRIPT`
//! names what a real ATmega16 has printed, which is then held against the same table; docs/simulator.md says how it is made.

mod common;

use common::{Recorder, load, run_to_end};

/// What each line may be: name, least and largest value.
fn table() -> Vec<(&'static str, [u16; 2])> {
    include_str!("programs/transcript.txt")
        .lines()
        .map(|line| line.split('#').next().unwrap_or_default().trim())
        .filter(|line| !line.is_empty())
        .map(|line| {
            let mut words = line.split(' ');
            let name = words.next().expect("a name");
            let mut value = || words.next().and_then(|v| v.parse().ok()).expect("a number");
            (name, [value(), value()])
        })
        .collect()
}

/// What of a transcript the table does not say; a line that was cut or doubled is one.
fn apart(transcript: &str) -> Vec<String> {
    let said: Vec<(&str, Option<u16>)> = (transcript.lines())
        .filter_map(|line| line.trim().split_once(' '))
        .map(|(name, value)| (name, value.trim().parse().ok()))
        .collect();
    let wrong = |(name, [least, most]): (&str, [u16; 2])| {
        let values: Vec<_> = said.iter().filter(|s| s.0 == name).map(|s| s.1).collect();
        match values.as_slice() {
            [Some(value)] if (least..=most).contains(value) => None,
            _ => Some(format!(
                "{name}: {values:?}, by the data sheet {least} to {most}"
            )),
        }
    };
    table().into_iter().filter_map(wrong).collect()
}

#[test]
fn the_simulated_chip_sees_of_itself_what_the_data_sheet_says() {
    let mut board = Recorder::new();
    run_to_end(&mut load("transcript.c", &[]), &mut board);
    let bytes: Vec<u8> = board.uart.iter().map(|(_, byte)| *byte).collect();
    let transcript = String::from_utf8(bytes).expect("it is text");
    print!("{transcript}");
    assert_eq!(apart(&transcript), [""; 0], "{transcript}");
}

#[test]
fn what_a_real_chip_printed_is_as_the_data_sheet_says() {
    let Ok(path) = std::env::var("IMU_STAND_TRANSCRIPT") else {
        println!("left out: IMU_STAND_TRANSCRIPT names no transcript of a real ATmega16");
        return;
    };
    let transcript = std::fs::read_to_string(&path).expect("a transcript");
    assert_eq!(apart(&transcript), [""; 0], "{transcript}");
}

#[test]
fn a_value_apart_and_a_line_that_is_missing_are_told() {
    let whole: Vec<String> = (table().iter())
        .map(|(name, [least, _])| format!("{name} {least}\n"))
        .collect();
    assert_eq!(apart(&whole.concat()), [""; 0]);
    for left_out in 0..whole.len() {
        let mut lines = whole.clone();
        lines[left_out] = String::new();
        assert_eq!(apart(&lines.concat()).len(), 1, "{left_out}");
        lines[left_out] = whole[left_out].replace(' ', " 9");
        assert_eq!(apart(&lines.concat()).len(), 1, "{left_out}");
    }
}
