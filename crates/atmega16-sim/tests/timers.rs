//! Timers by the data sheet (2466T, 8-bit timers 0 and 2, 16-bit timer 1).

mod common;

use common::{Recorder, byte, load, run_to_end, steps};

fn end_of(flags: &[&str]) -> (atmega16_sim::Mcu, Recorder) {
    let mut mcu = load("timers.c", flags);
    let mut board = Recorder::new();
    run_to_end(&mut mcu, &mut board);
    (mcu, board)
}

#[test]
fn timer_0_in_ctc_ticks_at_1_khz_to_the_cycle() {
    let (_, board) = end_of(&["-DTIMER0"]);
    assert!(steps(&board.marks()).iter().all(|&step| step == 64 * 250));
}

#[test]
fn timer_1_in_ctc_ticks_at_20_hz_to_the_cycle() {
    let (_, board) = end_of(&["-DTIMER1_CTC"]);
    let times: Vec<u64> = board.port_c.iter().map(|&(at, _)| at).collect();
    assert_eq!(times.len(), 10);
    assert!(steps(&times).iter().all(|&step| step == 64 * 12_500));
}

#[test]
fn timer_1_in_mode_14_has_a_period_of_icr1_plus_1() {
    let (_, board) = end_of(&["-DTIMER1_PWM"]);
    let times: Vec<u64> = board.port_c.iter().map(|&(at, _)| at).collect();
    assert!(steps(&times).iter().all(|&step| step == 800));
}

#[test]
fn ctc_sets_its_compare_flag_and_no_overflow() {
    let (mcu, _) = end_of(&[]);
    assert_eq!(byte(&mcu, "tov_in_ctc"), 1 << 1);
}

#[test]
fn a_flag_falls_by_writing_1_and_a_stopped_counter_keeps_its_value() {
    let (mcu, _) = end_of(&[]);
    assert_eq!(byte(&mcu, "cleared") & 3, 0);
    assert_eq!(byte(&mcu, "stopped"), 77);
}

#[test]
fn in_pwm_a_compare_value_waits_for_the_end_of_the_period() {
    let (mcu, _) = end_of(&[]);
    assert_eq!((byte(&mcu, "early"), byte(&mcu, "late")), (0, 1 << 4));
}

#[test]
fn oc2_puts_out_what_its_registers_say() {
    let mut mcu = load("motor.c", &[]);
    let mut board = Recorder::new();
    run_to_end(&mut mcu, &mut board);
    let at = |mark: u8| {
        let cycle = board.mark(mark);
        board
            .motor
            .iter()
            .rfind(|&&(at, _)| at <= cycle)
            .expect("it changed")
            .1
    };
    let hz = 16e6 / 256.0 / 8.0;
    assert_eq!((at(1).high, at(1).hz), (64.0 / 256.0, hz));
    assert_eq!((at(2).high, at(2).hz), (1.0, hz));
    assert_eq!((at(3).high, at(3).hz), (255.0 / 256.0, hz));
    assert_eq!((at(4).high, at(4).hz), (0.0, 0.0));
    assert_eq!(mcu.motor_pwm().high, 0.0);
}
