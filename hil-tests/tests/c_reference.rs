//! The C reference says, byte for byte, what the Rust image says.

use std::path::{Path, PathBuf};
use std::process::Command as Process;
use std::sync::atomic::{AtomicU32, Ordering};

use atmega16_sim::Mcu;
use hil_tests::{image, seed};

#[allow(dead_code, unused_imports)]
#[path = "../c-reference/session.rs"]
mod session;

/// Builds the C reference as its README says, by `AVR_GCC` where it is set.
fn reference() -> Vec<u8> {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("c-reference");
    // Tests run side by side: each builds its own.
    static NUMBER: AtomicU32 = AtomicU32::new(0);
    let number = NUMBER.fetch_add(1, Ordering::Relaxed);
    let elf = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("reference-{number}.elf"));
    let run = Process::new("sh")
        .current_dir(&source)
        .args(["-c", "exec \"${AVR_GCC:-avr-gcc}\" @flags *.c -o \"$0\""])
        .arg(&elf)
        .output()
        .expect("a shell runs");
    assert!(
        run.status.success(),
        "avr-gcc (apt-get install gcc-avr avr-libc): {}",
        String::from_utf8_lossy(&run.stderr)
    );
    std::fs::read(&elf).expect("avr-gcc wrote it")
}

fn assert_same(of_rust: &[String], of_c: &[String]) {
    for (n, (of_rust, of_c)) in of_rust.iter().zip(of_c).enumerate() {
        assert_eq!(of_rust, of_c, "frame {n} (left: Rust, right: C)");
    }
    // The session ends by the clock, and after its reset the two do not start at the same cycle.
    assert!(of_rust.len().abs_diff(of_c.len()) <= 1);
}

#[test]
fn it_sends_byte_for_byte_what_the_rust_image_sends() {
    let play = |name: &str, elf: &[u8]| {
        let mut mcu = Mcu::new(elf).expect("it is an image");
        session::play(&mut mcu).unwrap_or_else(|error| panic!("the {name} image {error}"))
    };
    let (rust, c) = (play("Rust", &image()), play("C", &reference()));
    let (of_rust, of_c) = (session::frames(&rust.line), session::frames(&c.line));
    // At 256 Hz a request comes at any moment of the tick's work, and what is sent first depends on its speed: up to
    // there all in one order, over the whole session each kind of frame in its own.
    let slow = |frames: &[String]| {
        let fast = frames
            .iter()
            .position(|frame| frame.contains("command: 16, status: Ok"));
        fast.expect("the rate is set")
    };
    let until = slow(&of_c);
    assert_same(&of_rust[..until], &of_c[..until]);
    // What a health frame of the fast part has seen hangs on when it had room: those before and behind it.
    let fast = |frames: &[String]| {
        let mut rates = (frames.iter().enumerate())
            .filter(|(_, frame)| frame.contains("command: 16, status: Ok"))
            .map(|(n, _)| n);
        (rates.next(), rates.next())
    };
    for kind in ["Hello {", "Sample(", "Health {", "Reply {", "Corrected("] {
        let of_kind = |frames: &[String]| -> Vec<String> {
            let (Some(begin), Some(end)) = fast(frames) else {
                panic!("the rate is set and set back");
            };
            let found = frames.iter().enumerate().filter(|(n, frame)| {
                frame.contains(kind) && (kind != "Health {" || *n < begin || *n > end)
            });
            found.map(|(_, frame)| frame.clone()).collect()
        };
        let (of_rust, of_c) = (of_kind(&of_rust), of_kind(&of_c));
        assert!(!of_c.is_empty(), "{kind}");
        assert_same(&of_rust, &of_c);
    }
    assert_eq!(rust.motor, c.motor, "the motor's pulses");
    assert_eq!(rust.acc_pins, c.acc_pins, "g-select");
    assert_eq!(rust.eeprom, c.eeprom);

    // What they agree on is a whole session: every request answered once, every kind of frame, every status.
    let replies: Vec<_> = of_c
        .iter()
        .filter(|frame| frame.contains("Reply {"))
        .collect();
    assert_eq!(replies.len(), session::requests());
    for status in [
        "Ok",
        "UnknownCommand",
        "Unsupported",
        "BadArgument",
        "Busy",
        "Moving",
        "ReadBackWrong",
        "SelfTestFailed",
        "NoKeepAlive",
        "Aborted",
        "Stopped",
        "NoConfig",
    ] {
        let said = format!("status: {status},");
        assert!(
            replies.iter().any(|reply| reply.contains(&said)),
            "{status}"
        );
    }
    println!(
        "{} frames, {} replies, {} bytes",
        of_c.len(),
        replies.len(),
        c.line.len()
    );
}

#[test]
fn it_answers_requests_by_chance_as_the_rust_image_does() {
    let reference = reference();
    let seed = seed();
    for draw in 0..4 {
        let play = |name: &str, elf: &[u8]| {
            let mut mcu = Mcu::new(elf).expect("it is an image");
            session::play_by_chance(&mut mcu, seed.wrapping_add(draw))
                .unwrap_or_else(|error| panic!("the {name} image {error}"))
        };
        let (rust, c) = (play("Rust", &image()), play("C", &reference));
        let of_c = session::frames(&c.line);
        assert_same(&session::frames(&rust.line), &of_c);
        assert_eq!(rust.motor, c.motor, "the motor's pulses");
        assert_eq!(rust.acc_pins, c.acc_pins, "g-select");
        assert_eq!(rust.eeprom, c.eeprom);
        let replies = of_c.iter().filter(|frame| frame.contains("Reply {"));
        println!("{} frames, {} replies", of_c.len(), replies.count());
    }
}

#[test]
fn both_take_each_sample_at_the_same_instant_of_the_tick() {
    for (name, elf) in [("Rust", image()), ("C", reference())] {
        let mut mcu = Mcu::new(&elf).expect("it is an image");
        let script =
            session::play(&mut mcu).unwrap_or_else(|error| panic!("the {name} image {error}"));
        let jitter = session::jitter(&script);
        assert_eq!(
            jitter,
            0,
            "{name}: cycles, peak to peak, over {} ticks",
            script.instants.len()
        );
    }
}
