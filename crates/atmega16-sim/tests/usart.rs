//! The USART by the data sheet (2466T, USART): time of a byte, buffers, the register that two share.

mod common;

use common::{Recorder, byte, load, run, run_to_end, variable};

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

/// 0x55 on the line: 0 1010 1010 1. The speed changes after three and a half bits of 416 cycles; from there on bits last 64.
/// The listener, whose bits last 416, still finds start, 1, 0 and, in the middle of the fourth, 1; then the stop bit.
#[test]
fn a_byte_whose_speed_changes_on_its_way_is_corrupted() {
    let (board, _) = send(25, 0, &["-DFASTER"]);
    assert_eq!(board.uart[0].1, 0b1111_1101);
    let (byte, apart) = (board.uart[1].1, board.uart[2].0 - board.uart[1].0);
    assert_eq!(
        (byte, apart),
        (0, 640),
        "what is begun at one speed is whole"
    );
}

fn receive(delay_ms: u32, feed: impl Fn(&mut atmega16_sim::Mcu)) -> (Vec<u8>, Vec<u8>) {
    let mut mcu = load("receive.c", &[&format!("-DDELAY={delay_ms}")]);
    let mut board = Recorder::new();
    while board.port_b.is_empty() {
        run(&mut mcu, &mut board, 10);
    }
    feed(&mut mcu);
    run_to_end(&mut mcu, &mut board);
    let taken = usize::from(byte(&mcu, "taken"));
    (
        variable(&mcu, "bytes", taken),
        variable(&mcu, "status", taken),
    )
}

#[test]
fn bytes_arrive_at_the_hosts_pace() {
    let sent: Vec<u8> = (0..10).map(|n| n * 25).collect();
    let (bytes, status) = receive(0, |mcu| sent.iter().for_each(|&byte| mcu.send(byte)));
    assert_eq!(bytes, sent);
    assert!(status.iter().all(|&s| s == 0));
}

#[test]
fn two_bytes_and_the_shift_register_hold_what_nobody_takes_and_the_rest_is_an_overrun() {
    let (bytes, status) = receive(40, |mcu| (1..=10).for_each(|byte| mcu.send(byte)));
    assert_eq!(bytes, [1, 2, 3]);
    assert_eq!(status, [0, 0, 1 << 3]);
}

#[test]
fn a_stop_bit_that_is_low_is_a_framing_error() {
    let (bytes, status) = receive(0, |mcu| {
        mcu.send(0x41);
        mcu.send_without_stop_bit(0x42);
        mcu.send_at(mcu.cycle() + 60_000, 0x43);
    });
    assert_eq!(bytes, [0x41, 0x42, 0x43]);
    assert_eq!(status, [0, 1 << 4, 0]);
}

#[test]
fn a_host_two_percent_off_is_heard_and_one_ten_percent_off_is_not() {
    let sent: Vec<u8> = (1..=10).map(|n| n * 23).collect();
    let at = |bit: f64| {
        receive(0, |mcu| {
            mcu.set_host_bit(Some(bit));
            sent.iter().for_each(|&byte| mcu.send(byte));
        })
    };
    for off in [0.98, 1.02] {
        assert_eq!(at(416.0 * off), (sent.clone(), vec![0; 10]), "{off}");
    }
    let (bytes, status) = at(416.0 * 1.1);
    assert!(bytes != sent || status.iter().any(|&s| s != 0));
}
