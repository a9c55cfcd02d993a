//! Mutants of what the host does not compile: registers, delays, interrupts. Each is a change of one place, and the test program
//! of `hil-tests` that is there to notice it.

use std::collections::BTreeSet;
use std::path::Path;

use super::tree::Tree;
use crate::image;
use crate::step::{Failure, Pace};

/// A fault to be planted.
struct Planted {
    what: &'static str,
    file: &'static str,
    /// Text that stands there once.
    was: &'static str,
    becomes: &'static str,
    /// The program of `hil-tests`.
    test: &'static str,
}

const fn planted(
    what: &'static str,
    [file, test]: [&'static str; 2],
    was: &'static str,
    becomes: &'static str,
) -> Planted {
    Planted {
        what,
        file,
        was,
        becomes,
        test,
    }
}

const SERIAL: &str = "src/avr/serial.rs";
const SENSORS: &str = "src/avr/sensors.rs";
const BOARD: &str = "src/avr/board.rs";
const TICK: &str = "src/avr/tick.rs";
const RING: &str = "src/avr/ring.rs";
const MAIN: &str = "src/avr/mod.rs";
const ACQUIRE: &str = "src/acquire.rs";

#[rustfmt::skip]
const TABLE: &[Planted] = &[
    planted("TXC is not cleared as a byte goes out", [SERIAL, "registers"],
        "        Some(byte) => {\n            usart().ucsra.write(|w| bits!(w, TXC));\n", "        Some(byte) => {\n"),
    planted("the line is idle as soon as the buffer is empty", [SERIAL, "registers"],
        "(UDRE | TXC) == UDRE | TXC", "UDRE == UDRE"),
    planted("the line's speed changes without waiting", [SERIAL, "registers"],
        "next_waits() && is_idle()", "next_waits()"),
    planted("the high byte of the divisor is left out", [SERIAL, "registers"],
        "(divisor >> 8) as u8 & 0x0f", "0"),
    planted("the reply before a reboot is cut", [SERIAL, "boot"],
        "    while !is_idle() {}\n", ""),
    planted("SPI does not become master again", [SENSORS, "registers"],
        "    spi.spcr.write(|w| bits!(w, SPCR));\n    Err(Stalled)", "    Err(Stalled)"),
    planted("a byte of SPI that does not end counts as one", [SENSORS, "registers"],
        "    Err(Stalled)\n}", "    Ok(0)\n}"),
    planted("SPI gives up before the end of a byte", [SENSORS, "registers"],
        "SPI_BUDGET: u8 = 60", "SPI_BUDGET: u8 = 6"),
    planted("EEWE follows EEMWE with interrupts on", [BOARD, "registers"],
        "        interrupt::free(|_| {\n            eeprom.eecr.write(|w| bits!(w, EEMWE));\n            eeprom.eecr.write(|w| bits!(w, EEMWE | EEWE));\n        });",
        "        eeprom.eecr.write(|w| bits!(w, EEMWE));\n        eeprom.eecr.write(|w| bits!(w, EEMWE | EEWE));"),
    planted("EEWE without EEMWE", [BOARD, "motor"],
        "            eeprom.eecr.write(|w| bits!(w, EEMWE));\n", ""),
    planted("TCNT1 is read with interrupts on", [TICK, "registers"],
        "interrupt::free(|_| timer1().tcnt1.read().bits())", "timer1().tcnt1.read().bits()"),
    planted("compare values are written with interrupts on", [TICK, "registers"],
        "    interrupt::disable();\n    if lost {", "    if lost {"),
    planted("delays are 19 % short", [SENSORS, "registers"],
        "    (nop(), nop(), nop(), nop(), nop());\n}", "    (nop(), nop());\n}"),
    planted("a gyro of unknown pace has 30 us", [ACQUIRE, "registers"],
        "SLOW_STALL_US: u8 = 100", "SLOW_STALL_US: u8 = 30"),
    planted("a gyro spoken to alone has 18 us", [ACQUIRE, "registers"],
        "FAST_STALL_US: u8 = 32", "FAST_STALL_US: u8 = 18"),
    planted("no pause between rounds", [ACQUIRE, "registers"],
        "ROUND_STALL_US: u32 = 12", "ROUND_STALL_US: u32 = 0"),
    planted("gyros are not waited for", ["src/lib.rs", "registers"],
        "SENSOR_START_MS: u16 = 220", "SENSOR_START_MS: u16 = 200"),
    planted("a gyro of unknown pace is clocked at 2 MHz", [SENSORS, "registers"],
        "if slow { 0 } else { SPI2X }", "if slow { SPI2X } else { SPI2X }"),
    planted("gyro y is selected as z is", [SENSORS, "registers"],
        "1 => SELECTS[1],", "1 => SELECTS[2],"),
    planted("the converter is clocked at 250 kHz", [SENSORS, "registers"],
        "ADC_ON: u8 = 1 << 7 | 7", "ADC_ON: u8 = 1 << 7 | 6"),
    planted("the converter stays on as the processor sleeps", [TICK, "adc"],
        "    sensors::adc_off();\n", ""),
    planted("the watchdog is fed by the sample clock alone", [MAIN, "motor"],
        "if moved == TICKED | PASSED {", "if moved & TICKED != 0 {"),
    planted("the watchdog is fed by the millisecond alone", [MAIN, "motor"],
        "if moved == TICKED | PASSED {", "if moved & PASSED != 0 {"),
    planted("the watchdog is off", [TICK, "boot"],
        "        watchdog.wdtcr.write(|w| bits!(w, 1 << 3 | 6));\n", "        let _ = watchdog;\n"),
    planted("the interrupt of the millisecond does not cut the motor", [TICK, "motor"],
        "                board::cut_motor();\n", ""),
    planted("a stopped millisecond clock stays stopped", [TICK, "motor"],
        "    timer1().timsk.write(|w| bits!(w, OCIE1A));\n    run_milliseconds();\n", "    timer1().timsk.write(|w| bits!(w, OCIE1A));\n"),
    planted("the direction pin is turned round", [BOARD, "motor"],
        "if duty < 0 {", "if duty > 0 {"),
    planted("the motor's pin is high from the start", [BOARD, "motor"],
        "port.portd.write(|w| bits!(w, STOP));", "port.portd.write(|w| bits!(w, STOP | MOTOR_PWM));"),
    planted("the motor's stop has no pull-up", [BOARD, "motor"],
        "port.portd.write(|w| bits!(w, STOP));", "port.portd.write(|w| bits!(w, 0));"),
    planted("the interrupt of the motor's stop does nothing", [TICK, "stop"],
        "fn INT0() {\n    stop();\n}", "fn INT0() {}"),
    planted("the motor's stop is felt as it is let go", [TICK, "stop"],
        "FALLING: u8 = 1 << 1", "FALLING: u8 = 3"),
    planted("the interrupt of the motor's stop is never enabled", [TICK, "stop"],
        "INT0_ON: u8 = 1 << 6", "INT0_ON: u8 = 0"),
    planted("the motor's stop comes in between the guard and the sample", [TICK, "stop"],
        "    sense_stop(0);\n", ""),
    planted("the motor's stop is deaf from the first sample on", [TICK, "stop"],
        "    serial::unmask(unsafe { (*shared()).masked_ucsrb });\n    sense_stop(INT0_ON);\n", "    serial::unmask(unsafe { (*shared()).masked_ucsrb });\n"),
    planted("the motor's stop is not looked for in the guard", [TICK, "stop"],
        "        board::cut_motor_if_pressed();\n        if timer1()", "        if timer1()"),
    planted("the guard looks for the stop until the tick", [TICK, "timing"],
        "wrapping_add(GUARD_TICKS - 1)", "wrapping_add(GUARD_TICKS + 1)"),
    planted("the motor's stop is not looked for in the first round", [SENSORS, "stop"],
        "    super::board::cut_motor_if_pressed();\n", ""),
    planted("the pin of the motor's stop is not looked at", [TICK, "stop"],
        "pind.read().bits() & STOP == 0", "pind.read().bits() & 0 != 0"),
    planted("a keep-alive from before the motor's stop counts behind it", [TICK, "stop"],
        "            core::ptr::write_volatile(&raw mut ALIVE, 0);\n            core", "            core"),
    planted("a stop that was let go is forgotten", [TICK, "stop"],
        "    unsafe { core::ptr::write_volatile(&raw mut STOPPED, 1) };\n", ""),
    planted("the accelerometer's range pins are turned round", [BOARD, "same"],
        "!range & 0b11", "range & 0b11"),
    planted("the cause of the reset stays", [BOARD, "boot"],
        "        cpu.mcucsr.write(|w| bits!(w, 0));\n", ""),
    planted("the counts of resets are not kept", [BOARD, "boot"],
        "unsafe { KEPT = counts };", "let _ = counts;"),
    planted("the counts of resets lie where a reset clears them", [BOARD, "boot"],
        "#[unsafe(link_section = \".noinit\")]\nstatic mut KEPT", "static mut KEPT"),
    planted("restarts are counted at power-on", [BOARD, "boot"],
        "reset_cause & POWER_ON != 0", "reset_cause & POWER_ON == 0"),
    planted("a byte without a stop bit is not counted", [SERIAL, "faults"],
        "status & FE != 0", "status & FE == 0xff"),
    planted("the receiver's overrun is not counted", [SERIAL, "registers"],
        "status & DOR != 0 || full", "full"),
    planted("a ring is never full", [RING, "registers"],
        "        if next == self.tail() {\n            return false;\n        }\n", ""),
    planted("a frame is queued whether there is room or not", [SERIAL, "rates"],
        "if waits || room() < room_for(kind, fields.len()) as u8 {", "if waits {"),
    planted("the guard is 8 us", [TICK, "timing"],
        "GUARD_TICKS: u16 = 16", "GUARD_TICKS: u16 = 2"),
    planted("the guard does not sleep", [TICK, "timing"],
        "SLEEP_IDLE: u8 = 1 << 6", "SLEEP_IDLE: u8 = 0"),
    planted("serial interrupts stay on in the guard", [SERIAL, "timing"],
        "was & !(RXCIE | UDRIE)", "was"),
    planted("the console answers in the middle of a frame", ["src/avr/console.rs", "timing"],
        "self.at_start && byte == b'?'", "byte == b'?'"),
    planted("the stack's paint is looked for from its top", [BOARD, "stack"],
        "let mut free = 0u16;", "let mut free = 64u16;"),
];

/// Where what catches each of them is kept.
const KEPT: &str = "docs/mutants-registers.txt";

/// A line of it: the fault, its file, the program and the test that fails.
fn line(one: &Planted, by: Option<&str>) -> String {
    let Planted {
        what, file, test, ..
    } = one;
    format!("{what}\n    {file}; {test}: {}\n", by.unwrap_or("NOBODY"))
}

/// Plants each of them, or those whose name has the word, and keeps what catches them where that is asked for.
///
/// # Errors
/// An image that does not build, or a fault that its test does not notice.
pub fn hunt(root: &Path, word: Option<&str>, write: bool) -> Result<(), Failure> {
    if write && word.is_some() {
        return Err(Failure::new(
            "--write keeps all of them, and a word leaves some out",
            "leave out the word, or --write",
        ));
    }
    let tree = Tree::copy(root, "image")?;
    let chosen = TABLE
        .iter()
        .filter(|one| word.is_none_or(|word| one.what.contains(word)));
    let chosen: Vec<&Planted> = chosen.collect();
    // Without a fault the tests pass, or nothing that they say counts.
    let sound = image::build(tree.root(), &mut Pace::Rarer(0))?;
    let programs: BTreeSet<&str> = chosen.iter().map(|one| one.test).collect();
    for program in programs {
        if let Some(by) = tree.test_image(&sound.elf, program)? {
            return Err(Failure::new(
                &format!("{program} does not pass without a fault: {by}"),
                "mend it first",
            ));
        }
    }
    let (mut caught, mut survived) = (0, Vec::new());
    let mut kept = "# `cargo xtask mutants --registers --write` writes this: faults of the registers, and the test that fails first.\n".to_owned();
    for one in chosen {
        let by = tree.changed(
            one.file,
            |text| (text.matches(one.was).count() == 1).then(|| text.replace(one.was, one.becomes)),
            || {
                let built = image::build(tree.root(), &mut Pace::Rarer(0))?;
                tree.test_image(&built.elf, one.test)
            },
        )?;
        kept.push_str(&line(one, by.as_deref()));
        match by {
            Some(by) => {
                println!("caught    {}: {} by {}: {by}", one.file, one.what, one.test);
                caught += 1;
            }
            None => {
                println!("SURVIVED  {}: {}, {} passes", one.file, one.what, one.test);
                survived.push(one.what);
            }
        }
    }
    println!("{caught} of {} caught", caught + survived.len());
    if write {
        std::fs::write(root.join(KEPT), kept)
            .map_err(|error| Failure::new(&format!("{KEPT}: {error}"), "make room for it"))?;
    }
    if survived.is_empty() {
        return Ok(());
    }
    Err(Failure::new(
        &format!("not noticed: {}", survived.join("; ")),
        "write the test that each of them asks for",
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_fault_has_its_place_in_the_code_and_a_test_that_is_there() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        for one in TABLE {
            let text = std::fs::read_to_string(root.join(one.file)).expect("a file of the image");
            assert_eq!(
                text.matches(one.was).count(),
                1,
                "{}: {}",
                one.file,
                one.what
            );
            let test = format!("hil-tests/tests/{}.rs", one.test);
            assert!(root.join(test).exists(), "{}", one.test);
        }
    }

    #[test]
    fn the_page_that_is_kept_has_each_fault_with_a_test_that_is_there() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        let kept = std::fs::read_to_string(root.join(KEPT)).expect("it is kept");
        let mut lines = kept.lines().filter(|line| !line.starts_with('#'));
        for one in TABLE {
            assert_eq!(lines.next(), Some(one.what), "`--registers --write` is due");
            let by = lines.next().and_then(|by| by.rsplit(": ").next());
            let test = format!("hil-tests/tests/{}.rs", one.test);
            let program = std::fs::read_to_string(root.join(test)).expect("a program");
            let named = by.is_some_and(|by| program.contains(&format!("fn {by}(")));
            assert!(named, "{}: {by:?}", one.what);
        }
        assert_eq!(lines.next(), None);
    }
}
