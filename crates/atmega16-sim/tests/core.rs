//! The processor by the data sheet (2466T, instruction set summary, interrupts, sleep): cycles of instructions, of
//! interrupts, and what `sei` and `reti` let through. These hold simavr's own part to it.

mod common;

use atmega16_sim::{LoadError, Mcu, Port, Stop};
use common::{Recorder, byte, compile, load, run, run_to_end, steps, variable};

#[test]
fn each_instruction_takes_the_data_sheets_cycles() {
    let mut mcu = load("instructions.c", &[]);
    let mut board = Recorder::new();
    run_to_end(&mut mcu, &mut board);
    // The order of the program; `out`, which marks, takes one more.
    let cycles = [
        1, 1, 2, 1, 1, 1, 2, 2, 2, 2, 2, 1, 1, 2, 2, 2, 2, 2, 2, 2, 2, 3, 2, 3, 7, 8, 7, 2, 3, 1,
        2, 3, 2, 2, 2, 1, 1, 1,
    ];
    // Marks go 1, 2, 1, 2; from 1 to 2 lies the instruction, from 2 to 1 nothing but `out`.
    let marks = board.marks();
    assert_eq!(marks.len(), 2 * cycles.len());
    let between: Vec<u64> = marks.chunks(2).map(|pair| pair[1] - pair[0] - 1).collect();
    assert_eq!(between, cycles);
    assert!(steps(&marks[1..]).iter().step_by(2).all(|&step| step == 1));
}

#[test]
fn an_interrupt_takes_four_cycles_and_four_more_out_of_sleep() {
    let mut mcu = load("interrupt.c", &[]);
    run_to_end(&mut mcu, &mut Recorder::new());
    // The flag is set when the counter goes from 200 to 0. Entry 4, jmp 3: `in` reads 7; busy code adds what is left of
    // the instruction in which it fell, at most one cycle here.
    let (busy, sleep) = (byte(&mcu, "busy_count"), byte(&mcu, "sleep_count"));
    assert!((7..=8).contains(&busy), "busy {busy}");
    assert_eq!(sleep, 11);
}

#[test]
fn flags_set_before_their_interrupts_are_enabled_are_served_lowest_vector_first() {
    let mut mcu = load("interrupt.c", &[]);
    run_to_end(&mut mcu, &mut Recorder::new());
    assert_eq!(variable(&mcu, "order", 2), [3, 19]);
}

#[test]
fn one_instruction_runs_behind_sei_before_an_interrupt() {
    let mut mcu = load("interrupt.c", &[]);
    run_to_end(&mut mcu, &mut Recorder::new());
    assert_eq!(byte(&mcu, "shadow"), 2);
}

#[test]
fn the_lowest_stack_pointer_is_seen_when_watched() {
    let mut mcu = load("instructions.c", &[]);
    assert_eq!(mcu.min_stack_pointer(), None);
    mcu.watch_stack();
    run_to_end(&mut mcu, &mut Recorder::new());
    let lowest = mcu.min_stack_pointer().expect("watched");
    // From the top of SRAM: main's return address, `push`, and the return address of a call.
    assert!((0x450..0x45f).contains(&lowest), "{lowest:#x}");
}

#[test]
fn ports_read_back_pull_up_and_pinx_is_read_only() {
    let mut mcu = load("ports.c", &[]);
    mcu.drive(Port::C, 0x80, 0x80);
    mcu.drive(Port::A, 0x0f, 0x05);
    run_to_end(&mut mcu, &mut Recorder::new());
    assert_eq!(byte(&mcu, "toggled"), 0x35);
    // Outputs 0x05, pull-ups on 0x30, driven 0x80.
    assert_eq!(byte(&mcu, "pulled"), 0xb5);
    assert_eq!(byte(&mcu, "driven"), 0x05);
}

#[test]
fn sleep_needs_its_enable_and_ends_the_run_where_nothing_can_wake() {
    let mut mcu = load("ports.c", &[]);
    let mut board = Recorder::new();
    assert_eq!(run(&mut mcu, &mut board, 100_000), Stop::Halted);
    let at = mcu.cycle();
    assert_eq!(run(&mut mcu, &mut board, 100_000), Stop::Halted);
    assert_eq!(mcu.cycle(), at);
}

#[test]
fn what_is_not_modelled_ends_the_run_and_is_named() {
    let mut mcu = load("unmodelled.c", &[]);
    let stop = run(&mut mcu, &mut Recorder::new(), 100_000);
    let Stop::Unmodelled(what) = stop else {
        panic!("{stop:?}");
    };
    assert!(what.contains("phase-correct"), "{what}");
}

#[test]
fn what_is_no_image_of_this_chip_is_refused_with_its_reason() {
    let refused = |elf: &[u8]| Mcu::new(elf).err().expect("refused").to_string();
    assert!(refused(b"not an ELF file").contains("no ELF file"));
    let other = compile("ports.c", "atmega32", &[]);
    assert!(matches!(Mcu::new(&other), Err(LoadError::OtherChip { .. })));
    assert!(refused(&other).contains("atmega32"));
    let own = compile("ports.c", "atmega16", &[]);
    assert!(refused(&own[..200]).contains("ELF") || refused(&own[..200]).contains("whole"));
}

#[test]
fn the_same_image_and_inputs_give_the_same_run_to_the_cycle() {
    let go = || {
        let mut mcu = load("timers.c", &["-DTIMER0"]);
        let mut board = Recorder::new();
        run_to_end(&mut mcu, &mut board);
        (mcu.cycle(), board.port_b)
    };
    assert_eq!(go(), go());
}

const PD2: u8 = 1 << 2;

/// Runs so long that what is due has been done.
fn settle(mcu: &mut Mcu) {
    assert_eq!(run(mcu, &mut Recorder::new(), 2_000), Stop::Reached);
}

/// What INT0 has been taken for behind power on, a fall, a rise and another fall of its pin.
fn taken(sense: &str) -> [u8; 4] {
    let mut mcu = load("external.c", &[&format!("-DISC={sense}")]);
    settle(&mut mcu);
    assert_eq!(byte(&mcu, "undriven"), PD2, "the pull-up");
    let mut counts = [byte(&mcu, "taken"); 4];
    for (n, low) in [true, false, true].into_iter().enumerate() {
        if low {
            mcu.drive(Port::D, PD2, 0);
        } else {
            mcu.release(Port::D, PD2);
        }
        settle(&mut mcu);
        counts[n + 1] = byte(&mcu, "taken");
    }
    counts
}

#[test]
fn int0_senses_the_edges_that_it_is_set_to_and_wakes_from_idle() {
    assert_eq!(taken("2"), [0, 1, 1, 2], "falling");
    assert_eq!(taken("3"), [0, 0, 1, 1], "rising");
    assert_eq!(taken("1"), [0, 1, 2, 3], "any");
    let [none, low, high, again] = taken("0");
    assert!(none == 0 && low > 5 && high == low && again > high, "low");
}

#[test]
fn an_edge_at_int0_is_kept_until_it_is_enabled_or_cleared_and_a_pulse_is_enough() {
    let mut mcu = load("external.c", &["-DMASKED"]);
    settle(&mut mcu);
    for expected in [0, 1] {
        mcu.drive(Port::D, PD2, 0);
        mcu.release(Port::D, PD2);
        settle(&mut mcu);
        assert_eq!(byte(&mcu, "taken"), expected);
    }
    assert_eq!(byte(&mcu, "flag"), 1 << 6, "set, then cleared by a 1");
    mcu.reset(atmega16_sim::ResetCause::External);
    mcu.drive(Port::D, PD2, 0);
    mcu.release(Port::D, PD2);
    settle(&mut mcu);
    assert_eq!(byte(&mcu, "taken"), 0, "a level has no flag");
}
