//! The USART by the data sheet (2466T, USART): time of a byte, buffers, the register that two share.

mod common;

use common::{Recorder, load, run_to_end, variable};

fn send(divisor: u16, double: u8, flags: &[&str]) -> (Recorder, Vec<u8>) {
    let (divisor, double) = (format!("-DDIVISOR={divisor}"), format!("-DDOUBLE={double}"));
    let mut all = vec![divisor.as_str(), double.as_str(), "-DBYTES=6"];
    all.extend(flags);
    let mut mcu = load("serial.c", &all);
    let mut board = Recorder::new();
    run_to_end(&mut mcu, &mut board);
    let shared = [
        variable(&mcu, "after_ubrrh", 1),
        variable(&mcu, "after_ucsrc", 1),
    ];
    (board, shared.concat())
}

#[test]
fn a_byte_takes_ten_bits_of_16_or_8_times_ubrr_plus_1() {
    for (divisor, double, cycles) in [
        (25, 0, 4160),
        (3, 0, 640),
        (16, 1, 1360),
        (7, 1, 640),
        (831, 0, 133_120),
    ] {
        let (board, _) = send(divisor, double, &[]);
        let bytes: Vec<u8> = board.uart.iter().map(|&(_, byte)| byte).collect();
        assert_eq!(bytes, [0, 1, 2, 3, 4, 5]);
        for pair in board.uart.windows(2) {
            assert_eq!(pair[1].0 - pair[0].0, cycles, "UBRR {divisor} U2X {double}");
        }
    }
}

#[test]
fn ucsrc_written_before_ubrrh_changes_nothing() {
    let (first, _) = send(25, 0, &["-DUCSRC_FIRST"]);
    assert_eq!(first.uart[1].0 - first.uart[0].0, 4160);
}

#[test]
fn the_shared_address_reads_ubrrh_and_in_the_next_cycle_ucsrc() {
    let (_, shared) = send(0x33f, 0, &[]);
    assert_eq!(shared, [0x03, 0x86]);
}

#[test]
fn two_bytes_are_taken_at_once_and_txc_comes_when_all_is_out() {
    let (board, _) = send(25, 0, &[]);
    // The first goes to the shift register, the second to the buffer; the third waits for the end of the first.
    let written: Vec<u64> = (1..=6)
        .map(|n| board.port_b.iter().find(|&&(_, b)| b == n).unwrap().0)
        .collect();
    assert!(written[1] - written[0] < 30);
    assert!(written[2] - board.uart[0].0 < 30);
    let end = board.port_b.last().unwrap();
    let last = board.uart.last().unwrap().0;
    assert!(end.0 > last && end.0 - last < 30, "TXC once, at the end");
}
