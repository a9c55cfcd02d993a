//! The SPI by the data sheet (2466T, serial peripheral interface), as master.

mod common;

use atmega16_sim::Port;
use common::{Recorder, byte, load, run, run_to_end};

#[test]
fn a_byte_takes_eight_clocks_of_each_divisor() {
    let mut mcu = load("spi.c", &[]);
    let mut board = Recorder::new();
    run_to_end(&mut mcu, &mut board);
    // Each byte's end, after its write and the mark in the cycle behind it.
    for (n, clock) in [4u64, 16, 64, 128, 2, 8, 32, 64].into_iter().enumerate() {
        let (end, mosi, pins) = board.spi[n];
        let begun = board.port_b[2 * n].0;
        assert_eq!((mosi, u64::from(pins.spi_clock)), (0x5a, clock));
        assert_eq!(end + 2 - begun, 8 * clock, "clock / {clock}");
    }
    assert_eq!(byte(&mcu, "answer"), !0x5a);
}

#[test]
fn the_order_of_bits_can_be_turned() {
    let mut mcu = load("spi.c", &[]);
    let mut board = Recorder::new();
    run_to_end(&mut mcu, &mut board);
    assert_eq!(board.spi[8].1, 0x80);
}

#[test]
fn a_write_while_a_byte_is_on_its_way_collides_and_changes_nothing() {
    let mut mcu = load("spi.c", &[]);
    let mut board = Recorder::new();
    run_to_end(&mut mcu, &mut board);
    assert_eq!(byte(&mcu, "collided"), 1 << 6);
    assert_eq!(board.spi.len(), 10);
    assert_eq!(
        board.spi[9].1, 0x08,
        "the first of the two, its bits turned"
    );
    assert_eq!(byte(&mcu, "after_read") & 0xc0, 0, "reading clears");
}

#[test]
fn ss_low_as_an_input_takes_the_bus_away() {
    let mut mcu = load("spi.c", &[]);
    let mut board = Recorder::new();
    while board.port_b.last().is_none_or(|&(_, mark)| mark != 3) {
        run(&mut mcu, &mut board, 50);
    }
    mcu.drive(Port::B, 1 << 4, 0);
    run_to_end(&mut mcu, &mut board);
    assert_eq!(byte(&mcu, "control") & 1 << 4, 0, "no master any more");
    assert_eq!(byte(&mcu, "lost_master"), 1 << 7);
}
