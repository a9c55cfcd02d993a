//! What is left alone, printed and not done, or explained.

use super::*;

#[test]
fn a_locked_part_is_left_alone_unless_told_otherwise() {
    let programmer = Programmer::with(Part {
        lock: 0xfc,
        ..Part::ours()
    });
    let folder = folder("flash_locked");
    let file = hex(&folder, &image());
    let refused = programmer.flash(&[file.to_str().unwrap()]);
    assert_eq!(refused.status.code(), Some(1));
    assert!(said(&refused).contains("--unlock"));
    assert_eq!(programmer.part().erased, 0);
    let done = programmer.flash(&[file.to_str().unwrap(), "--unlock"]);
    assert_eq!(done.status.code(), Some(0), "{}", said(&done));
    assert_eq!(programmer.part().lock, 0xff);
}

#[test]
fn a_dry_run_prints_calls_that_avrdude_takes_and_makes_none() {
    let programmer = Programmer::with(Part::ours());
    let folder = folder("flash_dry");
    let file = hex(&folder, &image());
    let dry = programmer.flash(&[file.to_str().unwrap(), "--dry-run", "--write-fuses"]);
    assert_eq!(dry.status.code(), Some(0));
    assert_eq!(programmer.part().erased, 0);
    let calls: Vec<String> = String::from_utf8(dry.stdout)
        .unwrap()
        .lines()
        .filter(|line| !line.starts_with('#'))
        .map(str::to_owned)
        .collect();
    assert_eq!(calls.len(), 4);
    for call in &calls {
        // -n: avrdude does all but write.
        let done = std::process::Command::new("sh")
            .args(["-c", &format!("{call} -n")])
            .output()
            .expect("a shell");
        assert!(done.status.success(), "{call}: {}", said(&done));
    }
    let part = programmer.part();
    assert_eq!((part.low, part.high), (0x3f, 0xc1));
    assert!(
        part.flash.iter().all(|byte| *byte == 0x55),
        "-n writes nothing"
    );
}

#[test]
fn fuses_are_checked_without_an_image() {
    let programmer = Programmer::with(Part::as_delivered());
    let done = programmer.flash(&["--check"]);
    let said = said(&done);
    assert_eq!(done.status.code(), Some(0), "{said}");
    assert!(said.contains("low 0xe1, high 0x99"), "{said}");
    assert!(
        said.contains("BODEN is wrong") && said.contains("EESAVE could be better"),
        "{said}"
    );
}

#[test]
fn what_avrdude_complains_of_is_explained() {
    let folder = folder("flash_errors");
    let file = hex(&folder, &image());
    let file = file.to_str().unwrap();
    let wrong = Programmer::with(Part {
        signature: [0x1e, 0x95, 0x02],
        ..Part::ours()
    });
    let refused = wrong.flash(&[file]);
    assert_refused(&refused, &["is no ATmega16"]);

    let worn = Programmer::with(Part {
        bad_page: Some(3),
        ..Part::ours()
    });
    let refused = worn.flash(&[file]);
    assert_refused(&refused, &["read back differs"]);

    let none = run(&["flash", file, "--programmer", "no-such-thing"]);
    assert_refused(&none, &["lists the programmers"]);
    let absent = run(&[
        "flash",
        file,
        "-c",
        "usbasp",
        "--avrdude",
        "no-such-avrdude",
    ]);
    assert!(
        said(&absent).contains("apt-get install avrdude"),
        "{}",
        said(&absent)
    );
    let program = env!("CARGO_BIN_EXE_imu-stand");
    let foreign = run(&["flash", program, "-c", "usbasp"]);
    assert!(
        said(&foreign).contains("not one for an AVR"),
        "{}",
        said(&foreign)
    );
    let text = run(&["flash", "Cargo.toml", "-c", "usbasp"]);
    assert!(
        said(&text).contains("neither ELF nor Intel hex"),
        "{}",
        said(&text)
    );
}

#[test]
fn a_dry_run_says_that_a_serial_programmer_needs_a_port() {
    let folder = folder("a_dry_run_says_that_a_serial_programmer_needs_a_port");
    let image = folder.join("image.hex");
    std::fs::write(&image, ":00000001FF\n").expect("room");
    let image = image.to_str().expect("UTF-8");
    let dry = |more: &[&str]| {
        let flash = ["flash", image, "--dry-run", "--programmer", "avrisp"];
        let done = run(&[&flash[..], more].concat());
        assert!(done.status.success(), "{}", said(&done));
        String::from_utf8_lossy(&done.stdout).into_owned()
    };
    assert!(dry(&[]).starts_with("# avrisp is on a serial line: say which, `--programmer-port"));
    assert!(!dry(&["--programmer-port", "/dev/ttyUSB0"]).contains("serial line"));
}
