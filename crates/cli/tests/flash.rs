//! `imu-stand flash` with the real avrdude, on a programmer that is simulated behind a pseudo-terminal: STK500 version 1
//! (Atmel AVR061), and behind that an ATmega16's serial programming (data sheet, "Serial Programming").
#![cfg(unix)]

mod common;

#[path = "flash/refused.rs"]
mod refused;

use std::io::{Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::process::Output;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

use common::{assert_refused, folder, json, run, said};
use serialport::{SerialPort as _, TTYPort};

const PAGE: usize = 128;

/// The part, as far as a programmer sees it.
#[derive(Clone)]
struct Part {
    flash: Vec<u8>,
    eeprom: Vec<u8>,
    low: u8,
    high: u8,
    lock: u8,
    signature: [u8; 3],
    erased: u32,
    /// A page that does not take what is written.
    bad_page: Option<usize>,
}

impl Part {
    fn as_delivered() -> Self {
        Part {
            flash: vec![0x55; 16_384],
            eeprom: vec![0x42; 512],
            low: 0xe1,
            high: 0x99,
            lock: 0xff,
            signature: [0x1e, 0x94, 0x03],
            erased: 0,
            bad_page: None,
        }
    }

    fn ours() -> Self {
        Part {
            low: 0x3f,
            high: 0xc1,
            ..Part::as_delivered()
        }
    }

    /// An instruction of the serial programming; what is clocked out with its last byte.
    fn instruction(&mut self, [a, b, c, d]: [u8; 4]) -> u8 {
        match (a, b) {
            (0xac, 0x80) => {
                self.flash.fill(0xff);
                if self.high & 0x08 != 0 {
                    self.eeprom.fill(0xff);
                }
                self.lock = 0xff;
                self.erased += 1;
                0
            }
            (0xac, 0xa0) => {
                self.low = d;
                0
            }
            (0xac, 0xa8) => {
                self.high = d;
                0
            }
            (0xac, _) if b & 0xe0 == 0xe0 => {
                self.lock = d;
                0
            }
            (0x30, _) => self.signature[usize::from(c & 3).min(2)],
            (0x50, 0x00) => self.low,
            (0x58, 0x08) => self.high,
            (0x58, 0x00) => self.lock,
            _ => 0,
        }
    }
}

/// A programmer with a part on it.
struct Programmer {
    path: String,
    part: Arc<Mutex<Part>>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Programmer {
    fn with(part: Part) -> Self {
        let (mut master, slave) = TTYPort::pair().expect("a pseudo-terminal");
        let path = slave.name().expect("it has a name");
        master
            .set_timeout(Duration::from_millis(20))
            .expect("it takes a timeout");
        let (part, stop) = (Arc::new(Mutex::new(part)), Arc::new(AtomicBool::new(false)));
        let (of_thread, flag) = (Arc::clone(&part), Arc::clone(&stop));
        let thread = std::thread::spawn(move || {
            let _slave = slave;
            let mut line = Line { port: master, flag };
            let mut at = 0;
            while answer(&mut line, &of_thread, &mut at).is_some() {}
        });
        Programmer {
            path,
            part,
            stop,
            thread: Some(thread),
        }
    }

    fn part(&self) -> Part {
        self.part.lock().expect("no test panics inside").clone()
    }

    /// `imu-stand flash ...` on this programmer.
    fn flash(&self, arguments: &[&str]) -> Output {
        let mut all = vec![
            "flash",
            "--programmer",
            "stk500v1",
            "--programmer-port",
            &self.path,
            "--programmer-baud",
            "115200",
        ];
        all.extend(arguments);
        run(&all)
    }
}

impl Drop for Programmer {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

struct Line {
    port: TTYPort,
    flag: Arc<AtomicBool>,
}

impl Line {
    /// The next byte; `None` when the test is over.
    fn byte(&mut self) -> Option<u8> {
        let mut byte = [0];
        loop {
            match self.port.read(&mut byte) {
                Ok(1) => return Some(byte[0]),
                _ if self.flag.load(Ordering::Relaxed) => return None,
                _ => {}
            }
        }
    }

    fn bytes(&mut self, count: usize) -> Option<Vec<u8>> {
        (0..count).map(|_| self.byte()).collect()
    }
}

/// Takes a command of AVR061 and answers it.
fn answer(line: &mut Line, part: &Mutex<Part>, at: &mut usize) -> Option<()> {
    let command = line.byte()?;
    let mut out = vec![0x14];
    let part_of = |work: &mut dyn FnMut(&mut Part)| work(&mut part.lock().expect("no panic"));
    match command {
        // Get parameter: a version, any.
        0x41 => {
            line.bytes(1)?;
            out.push(2);
        }
        0x40 => drop(line.bytes(2)?),
        0x42 => drop(line.bytes(20)?),
        0x45 => {
            let count = line.byte()?;
            line.bytes(usize::from(count).saturating_sub(1))?;
        }
        // Universal.
        0x56 => {
            let bytes = line.bytes(4)?;
            let four = [bytes[0], bytes[1], bytes[2], bytes[3]];
            part_of(&mut |part| out.push(part.instruction(four)));
        }
        // Load address, in words.
        0x55 => {
            let bytes = line.bytes(2)?;
            *at = 2 * usize::from(u16::from_le_bytes([bytes[0], bytes[1]]));
        }
        // Program page.
        0x64 => {
            let head = line.bytes(3)?;
            let data = line.bytes(usize::from(u16::from_be_bytes([head[0], head[1]])))?;
            part_of(&mut |part| {
                let bad = part.bad_page == Some(*at / PAGE);
                for (place, byte) in part.flash[*at..].iter_mut().zip(&data) {
                    // Flash is written from ones to zeros.
                    *place &= if bad { 0 } else { *byte };
                }
            });
        }
        // Read page.
        0x74 => {
            let head = line.bytes(3)?;
            let count = usize::from(u16::from_be_bytes([head[0], head[1]]));
            part_of(&mut |part| out.extend(&part.flash[*at..*at + count]));
        }
        0x75 => part_of(&mut |part| out.extend(part.signature)),
        _ => {}
    }
    // The end of a command; without it the two are out of step.
    if line.byte()? != 0x20 {
        out = vec![0x15];
    } else {
        out.push(0x10);
    }
    line.port.write_all(&out).ok()
}

/// An Intel hex file with these bytes from address 0.
fn hex(folder: &Path, bytes: &[u8]) -> PathBuf {
    let mut text = String::new();
    for (k, row) in bytes.chunks(16).enumerate() {
        let address = (k * 16) as u16;
        let mut line = vec![row.len() as u8];
        line.extend(address.to_be_bytes());
        line.push(0);
        line.extend(row);
        let sum = line.iter().fold(0u8, |sum, byte| sum.wrapping_add(*byte));
        line.push(sum.wrapping_neg());
        text.push(':');
        line.iter().for_each(|byte| text += &format!("{byte:02X}"));
        text.push('\n');
    }
    text.push_str(":00000001FF\n");
    let path = folder.join("image.hex");
    std::fs::write(&path, text).expect("the folder takes a file");
    path
}

fn image() -> Vec<u8> {
    (0..1000u32).map(|k| (k * 7 + k / 256) as u8).collect()
}

/// The same bytes as the linker leaves them: an ELF for AVR with a section in flash and one in EEPROM.
fn elf(folder: &Path, bytes: &[u8]) -> PathBuf {
    const HEAD: u32 = 52;
    const SEGMENT: u32 = 32;
    let names = b"\0.text\0.eeprom\0.shstrtab\0";
    let eeprom = [0x11u8; 16];
    let text_at = HEAD + 2 * SEGMENT;
    let eeprom_at = text_at + bytes.len() as u32;
    let names_at = eeprom_at + eeprom.len() as u32;
    let sections_at = (names_at + names.len() as u32).next_multiple_of(4);
    let mut out = b"\x7fELF\x01\x01\x01".to_vec();
    out.resize(16, 0);
    let mut put = |values: &[(u32, usize)]| {
        for (value, width) in values {
            out.extend(&value.to_le_bytes()[..*width]);
        }
    };
    // Executable, AVR, version 1, entry 0, then where headers are and how large.
    put(&[
        (2, 2),
        (83, 2),
        (1, 4),
        (0, 4),
        (HEAD, 4),
        (sections_at, 4),
        (0, 4),
    ]);
    put(&[(HEAD, 2), (SEGMENT, 2), (2, 2), (40, 2), (4, 2), (3, 2)]);
    for (at, address, length) in [(text_at, 0, bytes.len()), (eeprom_at, 0x81_0000, 16)] {
        let length = length as u32;
        put(&[
            (1, 4),
            (at, 4),
            (address, 4),
            (address, 4),
            (length, 4),
            (length, 4),
            (5, 4),
            (1, 4),
        ]);
    }
    out.extend(bytes);
    out.extend(eeprom);
    out.extend(names);
    out.resize(sections_at as usize, 0);
    let mut section = |name: u32, kind: u32, flags: u32, address: u32, at: u32, length: usize| {
        for value in [name, kind, flags, address, at, length as u32, 0, 0, 1, 0] {
            out.extend(value.to_le_bytes());
        }
    };
    section(0, 0, 0, 0, 0, 0);
    section(1, 1, 6, 0, text_at, bytes.len());
    section(7, 1, 3, 0x81_0000, eeprom_at, eeprom.len());
    section(15, 3, 0, 0, names_at, names.len());
    let path = folder.join("image.elf");
    std::fs::write(&path, out).expect("the folder takes a file");
    path
}

#[test]
fn an_elf_goes_into_flash_alone() {
    let programmer = Programmer::with(Part::ours());
    let folder = folder("flash_elf");
    let file = elf(&folder, &image());
    let done = programmer.flash(&[file.to_str().unwrap()]);
    assert_eq!(done.status.code(), Some(0), "{}", said(&done));
    let part = programmer.part();
    assert_eq!(&part.flash[..1000], image());
    assert!(part.eeprom.iter().all(|byte| *byte == 0x42));
}

#[test]
fn an_image_goes_onto_a_board_that_is_set_right_and_the_set_up_stays() {
    let programmer = Programmer::with(Part::ours());
    let folder = folder("flash_ours");
    let file = hex(&folder, &image());
    let out = folder.join("flash.json");
    let done = programmer.flash(&[file.to_str().unwrap(), "--json", out.to_str().unwrap()]);
    let said = said(&done);
    assert_eq!(done.status.code(), Some(0), "{said}");
    let part = programmer.part();
    assert_eq!(&part.flash[..1000], image());
    assert!(part.flash[1008..].iter().all(|byte| *byte == 0xff));
    assert_eq!(part.erased, 1);
    assert!(part.eeprom.iter().all(|byte| *byte == 0x42), "EESAVE");
    assert_eq!((part.low, part.high, part.lock), (0x3f, 0xc1, 0xff));
    let answer = json(&out);
    assert_eq!(answer["written"], true);
    assert_eq!(answer["fuses"]["low"], 0x3f);
    assert_eq!(answer["deviations"].as_array().unwrap().len(), 0);
}

#[test]
fn a_new_part_is_neither_flashed_nor_fused_unasked() {
    let programmer = Programmer::with(Part::as_delivered());
    let folder = folder("flash_new");
    let file = hex(&folder, &image());
    let file = file.to_str().unwrap();
    for arguments in [vec![file], vec![file, "--write-fuses"]] {
        // Without a terminal nobody says yes.
        let refused = programmer.flash(&arguments);
        assert_eq!(refused.status.code(), Some(1));
        let said = said(&refused);
        assert!(said.contains("CKSEL") && said.contains("1 MHz"), "{said}");
        let part = programmer.part();
        assert_eq!((part.low, part.high, part.erased), (0xe1, 0x99, 0));
        assert!(part.flash.iter().all(|byte| *byte == 0x55));
    }
    let done = programmer.flash(&[file, "--write-fuses", "--yes"]);
    assert_eq!(done.status.code(), Some(0), "{}", said(&done));
    let part = programmer.part();
    assert_eq!((part.low, part.high, part.lock), (0x2f, 0xc1, 0xff));
    assert_eq!(&part.flash[..1000], image());
    assert!(
        part.eeprom.iter().all(|byte| *byte == 0x42),
        "EESAVE was written first"
    );
}

#[test]
fn fuses_can_be_kept_and_then_the_lost_eeprom_is_told() {
    let programmer = Programmer::with(Part::as_delivered());
    let folder = folder("flash_keep");
    let file = hex(&folder, &image());
    let done = programmer.flash(&[file.to_str().unwrap(), "--keep-fuses"]);
    let said = said(&done);
    assert_eq!(done.status.code(), Some(0), "{said}");
    assert!(said.contains("EEPROM was erased"), "{said}");
    let part = programmer.part();
    assert_eq!((part.low, part.high), (0xe1, 0x99));
    assert!(part.eeprom.iter().all(|byte| *byte == 0xff));
}
