//! EEPROM, watchdog and resets by the data sheet (2466T, EEPROM; system control and reset).

mod common;

use atmega16_sim::{EEPROM_WRITE, Mcu, ResetCause, Stop, WATCHDOG};
use common::{Recorder, byte, load, run, run_to_end, variable};

#[test]
fn writing_a_byte_takes_8_5_ms_and_eewe_shows_it() {
    let mut mcu = load("eeprom.c", &[]);
    mcu.set_eeprom(&[1, 2, 3, 4, 5, 6]);
    let mut board = Recorder::new();
    run(&mut mcu, &mut board, 1_000_000);
    assert_eq!(byte(&mcu, "before"), 6);
    assert_eq!(byte(&mcu, "busy"), 1 << 1);
    let took = board.mark(2) - board.mark(1);
    assert!(
        (EEPROM_WRITE - 4..EEPROM_WRITE + 12).contains(&took),
        "{took}"
    );
    assert_eq!(byte(&mcu, "read_back"), 0x42);
    assert_eq!(mcu.eeprom()[0x1ff], 0x42);
}

#[test]
fn a_byte_is_written_only_within_four_cycles_of_eemwe() {
    let mut mcu = load("eeprom.c", &[]);
    run(&mut mcu, &mut Recorder::new(), 1_000_000);
    assert_eq!((byte(&mcu, "unarmed"), byte(&mcu, "late")), (0, 0));
    assert_eq!(mcu.eeprom()[7], 0xff);
}

#[test]
fn reading_halts_the_processor_for_four_cycles() {
    let mut mcu = load("eeprom.c", &[]);
    let mut board = Recorder::new();
    run(&mut mcu, &mut board, 1_000_000);
    // sbi 2, halt 4, out 1.
    assert_eq!(board.mark(5) - board.mark(4), 7);
}

#[test]
fn power_that_goes_while_a_byte_is_written_spoils_that_byte_alone() {
    let mut changed = 0;
    for cut in 0..20u64 {
        let mut mcu = load("eeprom.c", &[]);
        let mut board = Recorder::new();
        while board.port_b.last().is_none_or(|&(_, mark)| mark != 6) {
            run(&mut mcu, &mut board, 100);
        }
        run(&mut mcu, &mut board, 1 + cut * 6_000);
        mcu.power_cycle();
        changed += u32::from(mcu.eeprom()[6] != 0x55);
        let others = mcu.eeprom().iter().enumerate();
        assert!(
            others
                .into_iter()
                .all(|(at, &value)| matches!(at, 6 | 0x1ff) || value == 0xff)
        );
    }
    assert!(changed >= 15, "{changed} of 20");
    let mut mcu = load("eeprom.c", &[]);
    run(&mut mcu, &mut Recorder::new(), 2_000_000);
    mcu.power_cycle();
    assert_eq!(mcu.eeprom()[6], 0x55, "a write that has ended stays");
}

fn end_of(flags: &[&str]) -> (Mcu, Recorder) {
    let mut mcu = load("resets.c", flags);
    let mut board = Recorder::new();
    let stop = run(&mut mcu, &mut board, 100_000_000);
    assert_eq!(stop, Stop::Halted);
    (mcu, board)
}

#[test]
fn the_watchdog_bites_after_its_time_and_says_so() {
    for (prescale, factor) in [("0", 1), ("3", 8), ("6", 64)] {
        let (mcu, board) = end_of(&[&format!("-DWATCHDOG={prescale}")]);
        assert_eq!(mcu.resets().watchdog, 2);
        assert_eq!(variable(&mcu, "causes", 3), [1, 8, 8]);
        assert_eq!(
            variable(&mcu, "control", 3),
            [0, 0, 0],
            "and is off after it"
        );
        let enabled: Vec<u64> = board
            .port_b
            .iter()
            .filter(|m| m.1 == 0x80)
            .map(|m| m.0)
            .collect();
        let next: Vec<u64> = board
            .port_b
            .iter()
            .filter(|m| m.1 == 0)
            .map(|m| m.0)
            .collect();
        for (from, to) in enabled.iter().zip(&next) {
            let took = to - from;
            assert!(
                (WATCHDOG * factor - 30..WATCHDOG * factor + 30).contains(&took),
                "{took}"
            );
        }
    }
}

#[test]
fn a_watchdog_that_is_fed_waits_and_one_stopped_without_wdtoe_bites() {
    let (_, board) = end_of(&["-DWATCHDOG=0", "-DFED"]);
    assert!(board.mark(0x81) - board.mark(0x80) > 2 * WATCHDOG);
    let (mcu, _) = end_of(&["-DWATCHDOG=0", "-DSTOP_WRONG"]);
    assert_eq!(mcu.resets().watchdog, 2);
}

#[test]
fn each_reset_has_its_flag_and_all_but_power_keep_the_sram() {
    let mut mcu = load("resets.c", &[]);
    let mut board = Recorder::new();
    run_to_end(&mut mcu, &mut board);
    for cause in [
        ResetCause::External,
        ResetCause::BrownOut,
        ResetCause::Watchdog,
    ] {
        mcu.reset(cause);
        run_to_end(&mut mcu, &mut board);
    }
    assert_eq!(variable(&mcu, "causes", 4), [1, 2, 4, 8]);
    assert_eq!(
        byte(&mcu, "zeroed"),
        1,
        ".bss is cleared by the start-up code"
    );
    mcu.power_cycle();
    run_to_end(&mut mcu, &mut board);
    assert_eq!(byte(&mcu, "starts"), 1);
    assert_eq!(variable(&mcu, "causes", 1), [1]);
}

#[test]
fn a_reset_lets_go_of_all_pins() {
    let mut mcu = load("motor.c", &[]);
    let mut board = Recorder::new();
    while board.port_b.last().is_none_or(|&(_, mark)| mark != 2) {
        run(&mut mcu, &mut board, 1);
    }
    assert!(mcu.motor_pwm().high > 0.0);
    mcu.reset(ResetCause::BrownOut);
    run(&mut mcu, &mut board, 1);
    assert_eq!(mcu.motor_pwm().high, 0.0);
    assert_eq!(mcu.pins().ddr, [0; 4]);
}
